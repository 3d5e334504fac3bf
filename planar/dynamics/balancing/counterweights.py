"""Counterweights: what bodies within limits of mass and radius can add to a link, and which of them a sum likes least.

A body of mass m within a circle of radius r about the origin has first moments s and a moment of inertia I about it
with |s|^2 <= m I and I <= r^2 m, and every such m, s and I is that of some body: the convex hull of the points
(1, x, y, x^2 + y^2) of the circle is what lies between that paraboloid and its rim.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import atan2, hypot, pi
from typing import NamedTuple

import numpy as np

from planar.dynamics.balancing.cone_program import ConeBlock
from planar.dynamics.balancing.mass_parameters import LinkAxes, link_reach
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, join_names
from planar.model.link_shapes import LinkShape

STEEL_DENSITY = 7850.0
"""kg/m^3: of discs where none is given."""


class CounterweightLimit(NamedTuple):
    """The greatest mass (kg) of a counterweight, and how far from the origin of its link's axes it may lie (m).

    Left out, the mass is that of all moving links together, and the radius that of the link's own points. With a
    `thickness` (m) it is a solid disc of `density` (kg/m^3) whose centre lies within the radius; else a body of any
    shape that lies within it as a whole.
    """

    mass: float | None = None
    radius: float | None = None
    thickness: float | None = None
    density: float = STEEL_DENSITY


class SetLimit(NamedTuple):
    """The limit of a counterweight with nothing left out."""

    mass: float
    radius: float
    inertia_factor: float
    "k of a disc, whose moment of inertia about its centre is k m^2; 0 of a body of any shape"

    @property
    def disc(self) -> float:
        """The greatest moment of inertia of a disc about its centre, in units of mass and radius."""
        return self.inertia_factor * self.mass / self.radius**2


class Counterweight(NamedTuple):
    """A mass (kg) on a link, its centre at a `radius` (m) from the origin of the link's axes, at an `angle` (rad) from
    their x-axis, with the moment of inertia `inertia` (kg m^2) about that centre. `axes` say where these lie.
    """

    link: str
    mass: float
    radius: float
    angle: float
    inertia: float
    axes: str

    @property
    def mass_radius(self) -> float:
        """Mass times radius, kg m, which is all that the shaking force of a link on a pivot depends on."""
        return self.mass * self.radius


class CounterweightSet(NamedTuple):
    """What counterweights on some links may be: `links` are their places among the axes of all.

    Variables are m, m x, m y, I of each, in parts of `unit` (4 links,): its greatest mass times powers of its radius.
    """

    links: tuple[int, ...]
    limits: tuple[SetLimit, ...]

    @property
    def unit(self) -> Array:
        """SI units of the variables (4 links,)."""
        return np.concatenate(
            [limit.mass * limit.radius ** np.array([0.0, 1.0, 1.0, 2.0]) for limit in self.limits] or [np.zeros(0)]
        )

    @property
    def columns(self) -> Array:
        """The columns of the variables among the mass parameters of all links (4 links,)."""
        return np.array([4 * link + k for link in self.links for k in range(4)], dtype=int)

    @property
    def variable_count(self) -> int:
        """The variables of their cones: four of each, and of every disc its own moment of inertia."""
        return 4 * len(self.links) + sum(limit.inertia_factor > 0.0 for limit in self.limits)

    def cone_blocks(self, variables: int) -> list[ConeBlock]:
        """The limits on the first of so many variables, of discs their convex hull: k m^2 lies above the square."""
        linear, offsets, cones, heights = [], [], [], []
        own = 4 * len(self.links)
        for number, limit in enumerate(self.limits):
            m, x, y, inertia = (4 * number + k for k in range(4))
            disc = limit.disc
            part = {own: -1.0} if disc else {}
            for entries, offset in (
                ({m: -1.0}, 1.0),
                ({m: 1.0, inertia: -1.0} | dict.fromkeys(part, 1.0), 0.0),
                ({m: 1.0}, 0.0),
            ):
                linear.append(_row(variables, entries))
                offsets.append(offset)
            pair = ({m: 1.0, inertia: 1.0} | part, {m: 1.0, inertia: -1.0} | dict.fromkeys(part, 1.0))
            cones += [_row(variables, each) for each in (*pair, {x: 2.0}, {y: 2.0})]
            heights += [0.0] * 4
            if disc:
                linear.append(_row(variables, {m: disc, own: -1.0}))
                offsets.append(0.0)
                # own >= disc m^2
                cones += [_row(variables, each) for each in ({own: 1.0}, {own: 1.0}, {m: 2.0 * disc**0.5}, {})]
                heights += [1.0, -1.0, 0.0, 0.0]
                own += 1
        return [
            ConeBlock("nonnegative", np.array(linear), np.array(offsets)),
            ConeBlock("second-order", np.array(cones), np.array(heights), 4),
        ]

    def least_sum(self, coefficients: Array) -> float:
        """The least that a sum of the variables (4 links,) can be over all these counterweights, exactly."""
        parts = zip(coefficients.reshape(-1, 4).tolist(), self.limits, strict=True)
        return float(sum(_least_of_body(m, x, y, inertia, limit.disc) for (m, x, y, inertia), limit in parts))

    def as_bodies(self, x: Array) -> Array:
        """Variables (4 links,) that are off by what the solver leaves, as those of bodies within the limits.

        Counterweights without mass to speak of are none.
        """
        found = np.zeros_like(x)
        for number, limit in enumerate(self.limits):
            mass, first, second, about_origin = (float(each) for each in x[4 * number : 4 * number + 4])
            if mass <= NEGLIGIBLE_MASS:
                continue
            mass = min(mass, 1.0)
            shorter = min(1.0, mass / max(hypot(first, second), 1e-300))
            first, second = first * shorter, second * shorter
            least = (first**2 + second**2) / mass
            inertia = least + limit.disc * mass**2 if limit.disc else min(max(about_origin, least), mass)
            found[4 * number : 4 * number + 4] = mass, first, second, max(inertia, least)
        return found

    def counterweights(self, x: Array, axes: Sequence[LinkAxes]) -> tuple[Counterweight, ...]:
        """Those of variables (4 links,) that have a mass."""
        found = []
        for number, link in enumerate(self.links):
            mass, first, second, about_origin = (float(each) for each in (x * self.unit)[4 * number : 4 * number + 4])
            limit = self.limits[number]
            if not mass > 0.0:
                continue
            radius = min(hypot(first, second) / mass, limit.radius)
            inertia = (
                limit.inertia_factor * mass**2 if limit.inertia_factor else max(about_origin - mass * radius**2, 0.0)
            )
            own = inertia if inertia > NEGLIGIBLE_MASS * mass * limit.radius**2 else 0.0
            angle = counterweight_angle(first, second)
            found.append(Counterweight(axes[link].link, mass, radius, angle, own, axes[link].description))
        return tuple(found)


ANGLE_ROUNDING = 1e-8
"""Of the first moments of a counterweight: a part that is less is rounding of the solver."""
NEGLIGIBLE_MASS = 1e-9
"""Of the limit: a counterweight, or a moment of inertia, that is less is none."""


def counterweight_angle(x: float, y: float) -> float:
    """The direction of first moments (rad), above -pi up to pi; what rounding leaves of a part is none."""
    least = ANGLE_ROUNDING * hypot(x, y)
    return atan2(y if abs(y) > least else 0.0, x if abs(x) > least else 0.0)


def _row(variables: int, entries: Mapping[int, float]) -> Array:
    found = np.zeros(variables)
    for place, value in entries.items():
        found[place] = value
    return found


def _least_of_body(mass: float, x: float, y: float, inertia: float, disc: float) -> float:
    """The least of mass m + x sx + y sy + inertia I over bodies of at most one in mass and radius.

    Of one kilogram at a distance d it is least on the line of (x, y): mass - |(x, y)| d + inertia d^2, and where that
    coefficient is below zero and it is no disc, spread over the rim. A disc has disc m^2 of its own besides.
    """
    pull = hypot(x, y)
    if inertia > 0.0:
        at = min(pull / (2.0 * inertia), 1.0)
        each = mass - pull * at + inertia * at**2
    else:
        each = mass - pull + inertia
    if not disc:
        return min(each, 0.0)
    ends = [0.0, each + inertia * disc]
    if inertia * disc > 0.0 and -each < 2.0 * inertia * disc and each < 0.0:
        ends.append(-(each**2) / (4.0 * inertia * disc))
    return min(ends)


def choose_counterweights(
    axes: Sequence[LinkAxes],
    shapes: Mapping[str, LinkShape],
    links: Sequence[str] | Mapping[str, CounterweightLimit] | None,
    default: CounterweightLimit,
    mass: float,
) -> CounterweightSet:
    """The links that bear counterweights (left out: all that turn about a pivot on the frame), and their limits.

    `mass` is that of all moving links. Raises BadInput for a link that is not there, and where a limit is none.
    """
    names = [each.link for each in axes]
    given = default.radius is not None
    pivoted = [each.link for each in axes if each.is_pivoted and (given or link_reach(each, shapes[each.link]))]
    chosen = pivoted if links is None else list(links)
    if not chosen:
        told = "no link with a second point turns about a pivot on the frame"
        told += f"; name links among {join_names(names)}, and a radius"
        raise BadInput("counterweights", told)
    if len(set(chosen)) < len(chosen):
        raise BadInput("counterweights", "a link bears one counterweight; one is named twice")
    limits = []
    for name in chosen:
        if name not in names:
            raise BadInput("counterweights", f"there is no moving link {name!r}; these are {join_names(names)}")
        limit = links[name] if isinstance(links, Mapping) else default
        reach = link_reach(axes[names.index(name)], shapes[name])
        limits.append(_set_limit(name, limit, mass, reach))
    return CounterweightSet(tuple(names.index(name) for name in chosen), tuple(limits))


def _set_limit(name: str, limit: CounterweightLimit, mass: float, reach: float) -> SetLimit:
    greatest = mass if limit.mass is None else limit.mass
    radius = reach if limit.radius is None else limit.radius
    if limit.radius is None and not reach:
        raise BadInput("counterweights", f"link {name!r} has no second point that tells a radius; give one")
    for what, value in (("mass", greatest), ("radius", radius), ("thickness", limit.thickness or 1.0)):
        if not 0.0 < value < np.inf:
            raise BadInput("counterweights", f"the {what} on link {name!r} is to be above zero, not {value!r:.40}")
    if not 0.0 < limit.density < np.inf:
        raise BadInput("counterweights", f"a density above zero is wanted (kg/m^3), not {limit.density!r:.40}")
    factor = 0.0 if limit.thickness is None else 1.0 / (2.0 * pi * limit.thickness * limit.density)
    return SetLimit(float(greatest), float(radius), factor)
