"""Frames of links and pairs' own coordinates of solved positions, computed when first read."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

from planar.equations.coordinates import frames_from_coordinates
from planar.foundation.arrays import Array
from planar.foundation.jets import Jet
from planar.solving.prepared_mechanism import PreparedMechanism


class LazyFrames:
    """Coordinates with rates, scaled: (coordinates, orders), or of a motion for each order (rows, coordinates)."""

    def __init__(self, setup: PreparedMechanism, parts: Array | list[Array]):
        self.column, self.shapes, self.pairs, self.scale = setup.column, setup.shapes, setup.pairs, setup.scale
        self.coordinate_rates = parts

    @cached_property
    def frames_and_own(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """The frames of all links and the own coordinates of all pairs, as jets (m, rad, s)."""
        if isinstance(self.coordinate_rates, list):
            scaled = [part * self.scale for part in self.coordinate_rates]
            jets = [Jet(*(part[:, column] for part in scaled)) for column in range(scaled[0].shape[1])]
        else:
            jets = [Jet(*each) for each in (self.coordinate_rates * self.scale[:, None]).tolist()]
        return frames_from_coordinates(jets, self.column, self.shapes, self.pairs)


class LazyFrameMapping(Mapping[str, Any]):
    """The frames (0) or the own coordinates (1) of a placing, by name."""

    def __init__(self, placing: LazyFrames, which: int):
        self.source, self.which = placing, which

    def __getitem__(self, name: str) -> Any:
        return self.source.frames_and_own[self.which][name]

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:
        return {**self, **other}

    def __iter__(self) -> Iterator[str]:
        return iter(self.source.shapes if self.which == 0 else self.source.pairs)

    def __len__(self) -> int:
        return len(self.source.shapes if self.which == 0 else self.source.pairs)


def lazy_frames(
    setup: PreparedMechanism, coordinate_rates: Array | list[Array]
) -> tuple[LazyFrameMapping, LazyFrameMapping]:
    """Frames of links and own coordinates of pairs; see `LazyFrames`."""
    placing = LazyFrames(setup, coordinate_rates)
    return LazyFrameMapping(placing, 0), LazyFrameMapping(placing, 1)
