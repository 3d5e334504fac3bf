"""Links' frames and pairs' own coordinates of solved positions, made when they are first asked for."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import Any

import numpy as np

from planar.equations.functions import placed
from planar.foundation.jets import Jet
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray


class Placing:
    """Coordinates with rates, scaled: (coordinates, orders), or of a motion for each order (rows, coordinates)."""

    def __init__(self, setup: Setup, parts: Array | list[Array]):
        self.column, self.shapes, self.pairs, self.scale = setup.column, setup.shapes, setup.pairs, setup.scale
        self.parts = parts

    @cached_property
    def both(self) -> tuple[Mapping[str, Any], Mapping[str, Any]]:
        """The frames of all links and the own coordinates of all pairs, as jets (m, rad, s)."""
        if isinstance(self.parts, list):
            scaled = [part * self.scale for part in self.parts]
            jets = [Jet(*(part[:, column] for part in scaled)) for column in range(scaled[0].shape[1])]
        else:
            jets = [Jet(*each) for each in (self.parts * self.scale[:, None]).tolist()]
        return placed(jets, self.column, self.shapes, self.pairs)


class Placed(Mapping[str, Any]):
    """The frames (0) or the own coordinates (1) of a placing, by name."""

    def __init__(self, placing: Placing, which: int):
        self.placing, self.which = placing, which

    def __getitem__(self, name: str) -> Any:
        return self.placing.both[self.which][name]

    def __or__(self, other: Mapping[str, Any]) -> dict[str, Any]:
        return {**self, **other}

    def __iter__(self) -> Iterator[str]:
        return iter(self.placing.shapes if self.which == 0 else self.placing.pairs)

    def __len__(self) -> int:
        return len(self.placing.shapes if self.which == 0 else self.placing.pairs)


def laid(setup: Setup, parts: Array | list[Array]) -> tuple[Placed, Placed]:
    """Frames of links and own coordinates of pairs; see `Placing`."""
    placing = Placing(setup, parts)
    return Placed(placing, 0), Placed(placing, 1)
