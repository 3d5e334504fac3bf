"""The analytical route of the chapters for a slide or a point: harmonics, greatest speed, and the two-term formula."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.extremes import find_greatest, quantity_and_rates
from planar.analysis.motion.harmonics import Harmonics, full_turn, harmonics
from planar.analysis.motion.output import Extreme
from planar.analysis.motion.piston import Deviation, Piston, RodPointMotion, find_piston
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind


class TwoTermComparison(NamedTuple):
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


class RodPointComparison(NamedTuple):
    """A point on the rod of a piston, `b` (m) from it: by the two-term formulas, and exactly, in the piston's axes."""

    piston: Piston
    b: float
    here: RodPointMotion
    exact: RodPointMotion


@dataclass(frozen=True, eq=False)
class AnalyticalRoute:
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
    formula: TwoTermComparison | None = None
    rods: tuple[RodPointComparison, ...] = ()

    __repr__ = short_repr


def analytical_routes(
    mechanism: Mechanism, pairs: tuple[str, ...] = (), points: tuple[str, ...] = (), running: str | None = None
) -> tuple[AnalyticalRoute, ...]:
    """The analytical route of some slides and points; of none, every slide on the frame that is not driven.

    `running` names the input that turns, where there are several. Raises BadInput where there is nothing of a name or
    no such slide, or a motion does not repeat with every turn; NoAnswer where the input makes no full turn.
    """
    named = relative_motions(mechanism)
    for pair in pairs:
        if pair in named and named[pair].input_kind is not MeasureKind.LENGTH:
            raise BadInput(pair, "nothing slides at this pair; name a slide, or a point")
    full = {point: _unambiguous_point(mechanism, point) for point in points}
    if not pairs and not points:
        pairs = frame_slides(mechanism)
    if not pairs and not points:
        such = named_points(mechanism)[-1:]
        told = "no slide on the frame follows an input; name another slide with --pair, or a point with --point"
        told += f", such as {such[0].name!r}" if such else ""
        raise BadInput(mechanism.name, told)
    pistons = [one for pair in frame_slides(mechanism) if (one := find_piston(mechanism, pair)) is not None]
    found: list[tuple[tuple[Harmonics, ...], str]]
    found = [((harmonics(mechanism, pair, None, running),), pair) for pair in pairs]
    found += [
        (tuple(harmonics(mechanism, point, axis, running) for axis in "xy"), f"{link}.{name}")
        for point, (link, name) in full.items()
    ]
    steady = InterpolatedRun(full_turn(mechanism, running))
    return tuple(_analytical_route(mechanism, steady, series, name, pistons) for series, name in found)


def frame_slides(mechanism: Mechanism) -> tuple[str, ...]:
    """The slides on the frame that are not driven."""
    driven = {given.pair for given in mechanism.inputs}
    return tuple(
        pair.name
        for pair in relative_motions(mechanism).values()
        if pair.input_kind is MeasureKind.LENGTH and mechanism.frame in pair.links and pair.name not in driven
    )


def _unambiguous_point(mechanism: Mechanism, name: str) -> tuple[str, str]:
    """A (link, point) that lies at a point, so that nothing else is of that name."""
    for each in named_points(mechanism):
        for link, point in each.members:
            if name in (each.name, f"{link}.{point}"):
                return link, point
    hint = suggest_name(name, (each.name for each in named_points(mechanism)), "points")
    raise BadInput(name, f"there is no point {name!r}{hint}")


def _analytical_route(
    mechanism: Mechanism, steady: InterpolatedRun, series: tuple[Harmonics, ...], name: str, pistons: Sequence[Piston]
) -> AnalyticalRoute:
    """The route of a slide or a point that nothing else is named as."""
    given = next(each for each in mechanism.inputs if each.pair == steady.pair)
    route = AnalyticalRoute(
        of=series[0].of,
        series=series,
        position=given.position,
        rate=steady.rate,
        per_unit=not given.velocity,
        fastest=find_greatest(steady, name),
        here=quantity_and_rates(steady.state_at(given.position), name),
    )
    if series[0].axis is not None:
        return replace(route, rods=tuple(_rod_points(steady, route, name, pistons)))
    one = next((each for each in pistons if each.pair == name and each.input == steady.pair), None)
    return route if one is None else replace(route, piston=one, formula=_compare_two_terms(steady, route, one))


def _compare_two_terms(steady: InterpolatedRun, route: AnalyticalRoute, piston: Piston) -> TwoTermComparison | None:
    """The two-term formula beside what was solved; None where the stroke does not pass through the crank's axis."""
    if not piston.is_in_line:
        return None
    two, theta = piston.two_terms, piston.theta(route.position)
    start, way = piston.slide
    position, velocity, acceleration = (float(part[0]) for part in route.here)
    top = two.angle_of_greatest_speed()
    places = [place for at in (top, -top) if (place := steady.wrap_position(at - piston.lead)) is not None]
    return TwoTermComparison(
        theta=theta,
        here=(
            float(two.displacement(theta)),
            float(two.velocity(theta, route.rate)),
            float(two.acceleration(theta, route.rate)),
        ),
        exact=(way * (position - start), way * velocity, way * acceleration),
        deviations=(piston.deviation(0), piston.deviation(1), piston.deviation(2)),
        fastest=Extreme(
            min(places, key=lambda place: abs(place - route.fastest.input)), abs(float(two.velocity(top, route.rate)))
        ),
    )


def _rod_points(
    steady: InterpolatedRun, route: AnalyticalRoute, name: str, pistons: Sequence[Piston]
) -> Iterator[RodPointComparison]:
    """The rods of pistons on which a point lies."""
    here = next(each for each in named_points(steady.mechanism) if name in {".".join(end) for end in each.members})
    for one in pistons:
        point = dict(here.members).get(one.rod)
        b = None if point is None else one.distance_from_piston(steady.samples.shapes[one.rod].position(point))
        if b is not None and one.input == steady.pair and one.is_in_line:
            theta = one.theta(route.position)
            yield RodPointComparison(
                one, b, *(each.rod_point(theta, route.rate, b) for each in (one.two_terms, one.exact))
            )
