"""The mechanical advantage against an output over a motion: infinite where the output turns back."""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import CLOSED_TOLERANCE, InterpolatedRun
from planar.analysis.motion.extremes import find_greatest, quantity_and_rates
from planar.analysis.motion.load_direction import LoadDirection, loads_by_name
from planar.analysis.motion.output import Extreme, MotionQuantity
from planar.analysis.motion.zeros import bracket_zeros
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Unknown, suggest_name_of_kinds
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import relative_motions
from planar.model.wording import REST_TOLERANCE
from planar.results.motion import Motion, State


class AdvantageOver(NamedTuple):
    """Output force (or torque) for each unit of the running input's torque (or force), without friction, over a motion.

    `values` (n,), in the order of the motion's rows, are the input's rate by the output's: with the sign of the
    output's motion of a pair and a link, of a point by the force along its motion. They are infinite at samples where
    the output stands still, NaN at limits, where there are no rates. `measure` is the unit: `1/m` of a force for a
    torque, `m` of a torque for a force, `1` of like for like. Of a load they are by the force in the load's direction,
    negative where what it acts on moves against it. `least` is the least magnitude, and `infinite` are the
    positions of the input where it is beyond all bounds: solved for.
    """

    output: str
    input: str
    values: Array
    measure: str
    least: Extreme
    infinite: tuple[float, ...]

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("Motion")
def advantage_over(motion: Motion, output: str) -> AdvantageOver:
    """The mechanical advantage over a motion, of a slide, point, other pair, link or load (in this order, by name).

    Over the input that runs; `planar.advantage` tells that of one position by two ways. A load is named as there,
    `loads.0`; `P,Q` is a force between two points, along the line that joins them. Raises Unknown for another name,
    BadInput for a load that is zero.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.advantage_over(motion, "stroke").values.shape
    (13,)
    """
    mechanism = motion.mechanism
    if output in relative_motions(mechanism) or output in motion.frames or output in motion._point_names:
        return advantage_over_run(InterpolatedRun(motion), output)
    direction = LoadDirection.of(mechanism, output)
    if direction is None:
        known = {
            "points": motion.point_names,
            "links": motion.frames,
            "pairs": relative_motions(mechanism),
            "loads": loads_by_name(mechanism),
        }
        raise Unknown(f"there is no point, link, pair or load {output!r}{suggest_name_of_kinds(output, known)}")
    return advantage_over_run(InterpolatedRun(motion), direction)


def advantage_over_run(steady: InterpolatedRun, output: str | MotionQuantity) -> AdvantageOver:
    """See `advantage_over`; of a motion made ready for it, or of a quantity of it."""
    rate = np.atleast_2d(quantity_and_rates(steady.samples, output)[1] / steady.rate)
    length = _is_length(steady, output)
    signed = rate[:, 0] if rate.shape[1] == 1 else np.hypot(*rate.T)
    most = find_greatest(steady, output)
    greatest = most.value / abs(steady.rate)
    known = np.abs(signed[~np.isnan(signed)])
    still = REST_TOLERANCE * min(
        greatest, float(known.max(initial=0.0))
    )  # towards a limit the greatest is beyond all bounds
    with np.errstate(divide="ignore", invalid="ignore"):
        values = np.where(np.abs(signed) <= still, inf, 1.0 / signed)
    values[np.isnan(signed)] = nan
    least = Extreme(most.input, 1.0 / greatest if greatest else inf)
    force = steady.samples.has_length_motion(steady.pair)
    measure = {(True, False): "1/m", (False, True): "m"}.get((length, force), "1")
    name = output if isinstance(output, str) else output.name
    return AdvantageOver(name, steady.pair, values, measure, least, tuple(_find_standstills(steady, output, still)))


def _is_length(steady: InterpolatedRun, output: str | MotionQuantity) -> bool:
    """Whether the output's rate is a velocity."""
    if not isinstance(output, str):
        return output.kind == "length"
    named = steady.solver.relative_motions
    if output in named and steady.samples.has_length_motion(output):
        return True
    return output in steady.samples._point_names


def _find_standstills(steady: InterpolatedRun, output: str | MotionQuantity, still: float) -> list[float]:
    """Where the output stands still: its rate passes zero, or its speed is least and none beside the greatest."""

    def powers_and_rates(moving: State | Motion) -> Array:
        """What half the square of the speed grows by along the input, and the first component of the rate (..., 2)."""
        _, velocity, acceleration = quantity_and_rates(moving, output)
        power = np.sum(velocity * acceleration, axis=-1) / steady.rate
        return np.stack([power, velocity[..., 0] if velocity.shape[-1] == 1 else np.ones_like(power)], axis=-1)

    if not still:
        return []
    positions, table = steady.tabulate(powers_and_rates)
    if not len(positions):
        return []
    brackets = [(0, *bracket) for bracket in bracket_zeros(positions, -table[:, 0], falling=True)]
    brackets += [(1, *bracket) for bracket in bracket_zeros(positions, table[:, 1])]
    found: list[float] = []
    for column, low, high in brackets:
        try:
            at = find_root(lambda at: float(powers_and_rates(steady.state_at(at))[column]), low, high)  # noqa: B023
            place, speed = (
                steady.wrap_position(at),
                np.hypot(*_x_and_y(quantity_and_rates(steady.state_at(at), output)[1])) / abs(steady.rate),
            )
        except NoAnswer:
            continue
        is_new = place is not None and not np.isclose(place, found, rtol=0.0, atol=CLOSED_TOLERANCE).any()
        if place is not None and is_new and speed <= still:
            found.append(place)
    return sorted(found)


def _x_and_y(vector: Array) -> tuple[float, float]:
    x, *rest = np.asarray(vector, dtype=float)
    return float(x), float(rest[0]) if rest else 0.0
