"""The mass, first moments and moment of inertia of every link about a point of its own."""

from __future__ import annotations

from collections.abc import Mapping
from math import hypot
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector
from planar.model.link_shapes import LinkShape
from planar.model.loads import Mass
from planar.model.mechanism import Mechanism, named_points

QUANTITIES = ("m", "m x", "m y", "I")
"""The mass parameters of a link, in their order: kg, kg m, kg m, kg m^2."""
QUANTITY_POWERS = np.array([0, 1, 1, 2])
"""The power of the length in each."""


class LinkAxes(NamedTuple):
    """The axes of a link about whose origin its mass parameters are taken.

    `origin` and the unit vector `axis` are in the link's own axes (m); `origin_name` and `toward` name the points of
    the link from and to which the x-axis goes, empty where it has none. `is_pivoted`: the origin is a point of the
    frame too, so that the link turns about it.
    """

    link: str
    origin: Vector
    axis: Vector
    origin_name: str
    toward: str
    is_pivoted: bool

    @property
    def description(self) -> str:
        """In words, as "about O, x from O to A"."""
        about = f"about {self.origin_name}" if self.origin_name else "about its origin"
        return about + (f", x from {self.origin_name} to {self.toward}" if self.toward else ", x as it was drawn")


def link_axes(mechanism: Mechanism, shapes: Mapping[str, LinkShape]) -> tuple[LinkAxes, ...]:
    """Those of every moving link: from its pivot on the frame if it has one, else its first joint, to its farthest
    joint."""
    joined = {each.name: [link for link, _ in each.members] for each in named_points(mechanism)}
    return tuple(
        _axes_of_link(mechanism, link.name, shapes[link.name], joined)
        for link in mechanism.links
        if link.name != mechanism.frame
    )


def _axes_of_link(mechanism: Mechanism, link: str, shape: LinkShape, joined: Mapping[str, list[str]]) -> LinkAxes:
    places = {
        each.name: shape.position(point)
        for each in named_points(mechanism)
        for owner, point in each.members
        if owner == link
    }
    pivots = [name for name in places if mechanism.frame in joined[name]]
    joints = [name for name in places if len({*joined[name]}) > 1]
    first = next(iter(pivots or joints or places), "")
    if not first:
        return LinkAxes(link, Vector(0.0, 0.0), Vector(1.0, 0.0), "", "", False)
    origin = places[first]
    apart = {name: hypot(*(places[name] - origin)) for name in joints or places}
    toward = max(apart, key=lambda name: apart[name], default=first)
    length = apart.get(toward, 0.0)
    if not length:
        return LinkAxes(link, origin, Vector(1.0, 0.0), first, "", bool(pivots))
    return LinkAxes(link, origin, (places[toward] - origin) * (1.0 / length), first, toward, bool(pivots))


def link_reach(axes: LinkAxes, shape: LinkShape) -> float:
    """How far the points of a link are from the origin of its axes (m); 0 where it has none."""
    return max((hypot(*(point - axes.origin)) for point in shape.points.values()), default=0.0)


def mass_parameters(mechanism: Mechanism, shapes: Mapping[str, LinkShape], axes: tuple[LinkAxes, ...]) -> Array:
    """All masses of the moving links as (4 links,): m, m x, m y, I of each about its axes (kg, kg m, kg m^2)."""
    found = np.zeros((len(axes), 4))
    rows = {each.link: k for k, each in enumerate(axes)}
    for mass in mechanism.masses:
        if mass.link in rows:
            own = axes[rows[mass.link]]
            away = shapes[mass.link].position(mass.at) - own.origin
            x, y = away.dot(own.axis), own.axis.cross(away)
            found[rows[mass.link]] += [
                mass.mass,
                mass.mass * x,
                mass.mass * y,
                mass.inertia + mass.mass * (x * x + y * y),
            ]
    return found.ravel()


def as_mass(axes: LinkAxes, shape: LinkShape, parameters: Array) -> Mass:
    """The mass (4,) of a link as its file has it: where it is centred in the axes in which the link was drawn."""
    mass, x, y, about_origin = (float(each) for each in parameters)
    centre = axes.origin + Vector(x / mass, y / mass).rotate(axes.axis)
    drawn = centre.rotate(shape.axis) + shape.origin
    return Mass(axes.link, mass, (drawn.x, drawn.y), max(about_origin - (x * x + y * y) / mass, 0.0))
