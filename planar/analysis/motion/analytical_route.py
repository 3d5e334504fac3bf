"""The analytical route of the chapters for a slide or a point: harmonics, greatest speed, and the two-term formula."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from planar.analysis.interpolated_run import Steady
from planar.analysis.motion.extremes import Extreme, fastest, rates
from planar.analysis.motion.harmonics import Harmonics, harmonics, turning
from planar.analysis.motion.piston import Deviation, Piston, RodPoint, piston
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism, motions, named_points
from planar.model.pairs import Kind
from planar.results.motion import Array


class Formula(NamedTuple):
    """What the two-term formula makes of a piston, beside what is exact, at the steady rate of the input.

    `here` and `exact` are displacement, velocity and acceleration from TDC at the file's position (SI, positive away
    from it); `deviations` those of each over a turn; `fastest` is the input's position at the greatest speed by the
    formula, and that speed.
    """

    theta: float
    here: tuple[float, float, float]
    exact: tuple[float, float, float]
    deviations: tuple[Deviation, Deviation, Deviation]
    fastest: Extreme


class OnRod(NamedTuple):
    """A point on the rod of a piston, `b` (m) from it: by the two-term formulas, and exactly, in the piston's axes."""

    piston: Piston
    b: float
    here: RodPoint
    exact: RodPoint


@dataclass(frozen=True, eq=False)
class Route:
    """What is found of one slide (one series) or point (x and y), at the steady rate of the input.

    `rate` is that of the input (rad/s); where the file's is zero it is 1 and `per_unit` is true: rates are then per
    unit of the input. `here` is position, velocity and acceleration at the file's position, (axes,) each.
    """

    of: str
    series: tuple[Harmonics, ...]
    position: float
    rate: float
    per_unit: bool
    fastest: Extreme
    here: tuple[Array, Array, Array]
    piston: Piston | None = None
    formula: Formula | None = None
    rods: tuple[OnRod, ...] = ()


def routes(
    mechanism: Mechanism, pairs: tuple[str, ...] = (), points: tuple[str, ...] = (), running: str | None = None
) -> tuple[Route, ...]:
    """The analytical route of some slides and points; of none, every slide on the frame that is not driven.

    `running` names the input that turns, where there are several. Raises BadInput where there is nothing of a name or
    no such slide, or a motion does not repeat with every turn; NoAnswer where the input makes no full turn.
    """
    named = motions(mechanism)
    for pair in pairs:
        if pair in named and named[pair].drive_kind is not Kind.LENGTH:
            raise BadInput(pair, "nothing slides at this pair; name a slide, or a point")
    full = {point: _full(mechanism, point) for point in points}
    if not pairs and not points:
        pairs = slides(mechanism)
    if not pairs and not points:
        such = named_points(mechanism)[-1:]
        told = "no slide on the frame follows an input; name another slide with --pair, or a point with --point"
        told += f", such as {such[0].name!r}" if such else ""
        raise BadInput(mechanism.name, told)
    pistons = [one for pair in slides(mechanism) if (one := piston(mechanism, pair)) is not None]
    found = [((harmonics(mechanism, pair, None, running),), pair) for pair in pairs]
    found += [
        (tuple(harmonics(mechanism, point, axis, running) for axis in "xy"), f"{link}.{name}")
        for point, (link, name) in full.items()
    ]
    steady = Steady(turning(mechanism, running))
    return tuple(_route(mechanism, steady, series, name, pistons) for series, name in found)


def slides(mechanism: Mechanism) -> tuple[str, ...]:
    """The slides on the frame that are not driven."""
    driven = {given.pair for given in mechanism.inputs}
    return tuple(
        pair.name
        for pair in motions(mechanism).values()
        if pair.drive_kind is Kind.LENGTH and mechanism.frame in pair.links and pair.name not in driven
    )


def _full(mechanism: Mechanism, name: str) -> tuple[str, str]:
    """A (link, point) that lies at a point, so that nothing else is of that name."""
    for each in named_points(mechanism):
        for link, point in each.members:
            if name in (each.name, f"{link}.{point}"):
                return link, point
    known = ", ".join(each.name for each in named_points(mechanism))
    raise BadInput(name, f"there is no point {name!r}; points are {known}")


def _route(
    mechanism: Mechanism, steady: Steady, series: tuple[Harmonics, ...], name: str, pistons: Sequence[Piston]
) -> Route:
    """The route of a slide or a point that nothing else is named as."""
    given = next(each for each in mechanism.inputs if each.pair == steady.pair)
    route = Route(
        of=series[0].of,
        series=series,
        position=given.position,
        rate=steady.rate,
        per_unit=not given.velocity,
        fastest=fastest(steady, name),
        here=rates(steady.at(given.position), name),
    )
    if series[0].axis is not None:
        return replace(route, rods=tuple(_rods(steady, route, name, pistons)))
    one = next((each for each in pistons if each.pair == name and each.input == steady.pair), None)
    return route if one is None else replace(route, piston=one, formula=_formula(steady, route, one))


def _formula(steady: Steady, route: Route, one: Piston) -> Formula | None:
    """The two-term formula beside what was solved; None where the stroke does not pass through the crank's axis."""
    if not one.in_line:
        return None
    two, theta = one.two_terms, one.theta(route.position)
    start, way = one.slide
    position, velocity, acceleration = (float(part[0]) for part in route.here)
    top = two.fastest()
    places = [place for at in (top, -top) if (place := steady.within(at - one.lead)) is not None]
    return Formula(
        theta=theta,
        here=(
            float(two.displacement(theta)),
            float(two.velocity(theta, route.rate)),
            float(two.acceleration(theta, route.rate)),
        ),
        exact=(way * (position - start), way * velocity, way * acceleration),
        deviations=(one.deviation(0), one.deviation(1), one.deviation(2)),
        fastest=Extreme(
            min(places, key=lambda place: abs(place - route.fastest.input)), abs(float(two.velocity(top, route.rate)))
        ),
    )


def _rods(steady: Steady, route: Route, name: str, pistons: Sequence[Piston]) -> Iterator[OnRod]:
    """The rods of pistons on which a point lies."""
    here = next(each for each in named_points(steady.mechanism) if name in {".".join(end) for end in each.members})
    for one in pistons:
        point = dict(here.members).get(one.rod)
        b = None if point is None else one.along(steady.samples.shapes[one.rod].at(point))
        if b is not None and one.input == steady.pair and one.in_line:
            theta = one.theta(route.position)
            yield OnRod(one, b, *(each.point(theta, route.rate, b) for each in (one.two_terms, one.exact)))
