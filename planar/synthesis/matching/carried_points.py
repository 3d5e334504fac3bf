"""Points that moving links carry: where each lies in its link, in all designs, and whether that is free."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from planar.batch.design_arrays import with_design_values
from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.foundation.errors import BadInput
from planar.model.link_shapes import At, Link, LinkShape, link_shape
from planar.model.mechanism import Mechanism, named_points
from planar.synthesis.swept.bare_mechanism import bare_mechanism, length_scale

COUPLER_SPREAD, FARTHEST = 0.8, 4.0
"""Of the link's extent: the standard deviation of free points from its middle, either way; and how far they go."""

Bounds = Mapping[str, tuple[float, float]]
"""Of free numbers by name: between which each lies, infinite where there is no bound."""


@dataclass(frozen=True, eq=False)
class CarriedPoint:
    """A point of a moving link, by the link's number; `coordinates` (designs,) are x + iy in the link's axes (m).

    Where `names` are given both its coordinates are free numbers on which nothing else rests, between `lower` and
    `upper` (2,). `middle` and `extent` (designs,) are those of the other points of its link.
    """

    link: int
    coordinates: ComplexArray
    names: tuple[str, str] | None
    lower: Array
    upper: Array
    middle: ComplexArray
    extent: Array

    @property
    def is_free(self) -> bool:
        """Whether it may lie anywhere on its link."""
        return self.names is not None

    def nearest_allowed(self, design: IntArray, places: ComplexArray) -> ComplexArray:
        """Of places (n,) on links of designs (n,) those nearest to them between bounds, and not too far out."""
        off = places - self.middle[design]
        most = FARTHEST * self.extent[design]
        far = np.maximum(np.abs(off), most)
        held = self.middle[design] + off * (most / far)
        x, y = np.clip(held.real, self.lower[0], self.upper[0]), np.clip(held.imag, self.lower[1], self.upper[1])
        found: ComplexArray = x + 1j * y
        return found

    def draw(self, many: int, random: np.random.Generator) -> ComplexArray:
        """Places (designs, many) where the point is free: spread over and about its link, or between its bounds."""
        count = len(self.middle)
        x, y = random.normal(size=(2, count, many))
        found = self.middle[:, None] + COUPLER_SPREAD * self.extent[:, None] * (x + 1j * y)
        if np.isfinite([self.lower, self.upper]).all():
            size = self.upper - self.lower
            x, y = (low + wide * random.uniform(size=(count, many)) for low, wide in zip(self.lower, size, strict=True))
            return np.asarray(x + 1j * y)
        design = np.repeat(np.arange(count), many)
        return self.nearest_allowed(design, found.ravel()).reshape(count, many)


def free_point_names(mechanism: Mechanism, point: str) -> tuple[str, str] | None:
    """The names of a point's coordinates in the file, if it has such and nothing but itself rests on them.

    Raises BadInput where there is no such point, or where it lies on the frame.
    """
    link, own = _carrier(mechanism, point)
    place = next((each.place for each in link.points if each.name == own), None)
    needed = next(each for each in bare_mechanism(mechanism).links if each.name == link.name).names
    if own in needed or link.axis is not None or not isinstance(place, At):
        return None
    return f"{link.name}.{own}.x", f"{link.name}.{own}.y"


def carried_point(
    mechanism: Mechanism, point: str, values: Mapping[str, Array], count: int, free: Bounds
) -> CarriedPoint:
    """A point by its result name in `count` designs with `values` (designs,) by name; it is free if `free` names it.

    Raises BadInput where there is no such point, or where it lies on the frame.
    """
    link, own = _carrier(mechanism, point)
    names = free_point_names(mechanism, point)
    if names is not None and not all(each in free for each in names):
        names = None
    shape = link_shape(next(each for each in with_design_values(mechanism, values).links if each.name == link.name))
    others = [name for name in link.names if name != own] or [own]
    places = np.array([_spread(shape, name, count) for name in others])
    extent = np.abs(places[:, None] - places).max(axis=(0, 1))
    ends = np.array([free[name] for name in names] if names else [(-np.inf, np.inf)] * 2)
    return CarriedPoint(
        [each.name for each in mechanism.links if each.name != mechanism.frame].index(link.name),
        _spread(shape, own, count),
        names,
        ends[:, 0],
        ends[:, 1],
        places.mean(axis=0),
        np.where(extent > 0.0, extent, length_scale(mechanism)),
    )


def _carrier(mechanism: Mechanism, point: str) -> tuple[Link, str]:
    """The moving link that carries a point, and its name there."""
    links = {each.name: each for each in mechanism.links}
    for name, members in named_points(mechanism):
        if point == name or point in map(".".join, members):
            if mechanism.frame in dict(members):
                raise BadInput("points", f"{point!r} lies on the frame {mechanism.frame!r}, and will come nowhere")
            return links[members[0][0]], members[0][1]
    raise BadInput("points", f"{mechanism.name!r} has no point {point!r}")


def _spread(shape: LinkShape, point: str, count: int) -> ComplexArray:
    """Where a point of links lies (designs,)."""
    at = shape.position(point)
    found: ComplexArray = np.zeros(count) + np.asarray(at.x) + 1j * np.asarray(at.y)
    return found
