"""The coordinates w of a mechanism: what each is, and the frames of links that they make."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import NamedTuple

from planar.foundation.arrays import Array
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.foundation.jets import Scalar
from planar.model.pairs import MeasureKind, Pair

FRAME_PARTS = ("x", "y", "angle")
"""The coordinates of a link."""


class Coordinate(NamedTuple):
    """One entry of w: a part of a link's frame ("x", "y", "angle"), or a coordinate of a pair's own."""

    owner: str
    part: str
    kind: MeasureKind
    of_link: bool


def coordinate_columns(coordinates: Iterable[Coordinate]) -> dict[tuple[str, str], int]:
    """Where in w each part of a link or a pair stands."""
    return {(coordinate.owner, coordinate.part): k for k, coordinate in enumerate(coordinates)}


def consecutive_ranges(counts: Mapping[str, int], first: int = 0) -> dict[str, range]:
    """Where the entries of each name stand, one name after the other, from `first` on."""
    ranges: dict[str, range] = {}
    for name, count in counts.items():
        ranges[name] = range(first, first + count)
        first += count
    return ranges


def frames_from_coordinates(
    w: Sequence[Scalar] | Mapping[int, Scalar] | Array,
    column: Mapping[tuple[str, str], int],
    links: Iterable[str],
    pairs: Mapping[str, Pair],
) -> tuple[dict[str, Frame], dict[str, tuple[Scalar, ...]]]:
    """Frames of links and own coordinates of pairs from w, whose entries may be of any arithmetic.

    `column` says where a part stands in w; a link without a place there is the frame.
    """
    frames = {
        link: frame_at(*(w[column[link, part]] for part in FRAME_PARTS)) if (link, "x") in column else GROUND
        for link in links
    }
    own_coordinates = {
        name: tuple(w[column[name, part]] for part, _ in pair.coordinate_kinds) for name, pair in pairs.items()
    }
    return frames, own_coordinates
