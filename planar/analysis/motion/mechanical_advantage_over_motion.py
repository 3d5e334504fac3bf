"""The mechanical advantage against an output over a motion: infinite where the output turns back."""

from __future__ import annotations

from math import inf, nan
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.extremes import find_greatest, quantity_and_rates
from planar.analysis.motion.output import Extreme, Output
from planar.analysis.motion.zeros import bracket_zeros
from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.model.wording import REST_TOLERANCE
from planar.results.motion import Motion, State


class AdvantageOver(NamedTuple):
    """Output force (or torque) for each unit of the running input's torque (or force), without friction, over a motion.

    `values` (n,), in the order of the motion's rows, are the input's rate by the output's: with the sign of the
    output's motion of a pair and a link, of a point by the force along its motion. They are infinite at samples where
    the output stands still, NaN at limits, where there are no rates. `measure` is the unit: `1/m` of a force for a
    torque, `m` of a torque for a force, `1` of like for like. `least` is the least magnitude, and `infinite` are the
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
    """The mechanical advantage of a slide, a point, another pair or a link (in this order, by name) over a motion.

    Over the input that runs; `planar.advantage` tells that of one position by two ways. Raises Unknown for another
    name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.advantage_over(motion, "stroke").values.shape
    (13,)
    """
    return advantage_over_run(InterpolatedRun(motion), output)


def advantage_over_run(steady: InterpolatedRun, output: str | Output) -> AdvantageOver:
    """See `advantage_over`; of a motion made ready for it, or of an output of it."""
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
    name = output.name if isinstance(output, Output) else output
    return AdvantageOver(name, steady.pair, values, measure, least, tuple(_find_standstills(steady, output, still)))


def _is_length(steady: InterpolatedRun, output: str | Output) -> bool:
    """Whether the output's rate is a velocity."""
    if isinstance(output, Output):
        return output.kind == "length"
    named = steady.solver.relative_motions
    if output in named and steady.samples.has_length_motion(output):
        return True
    return output in steady.samples._point_names


def _find_standstills(steady: InterpolatedRun, output: str | Output, still: float) -> list[float]:
    """Where the output stands still: where its speed is least, and none beside the greatest."""

    def power(moving: State | Motion) -> Array:
        _, velocity, acceleration = quantity_and_rates(moving, output)
        found: Array = np.sum(velocity * acceleration, axis=-1) / steady.rate
        return found

    if not still:
        return []
    positions, powers = steady.tabulate(power)
    found = set()
    for low, high in bracket_zeros(positions, -powers, falling=True) if len(positions) else ():
        try:
            at = find_root(lambda at: float(power(steady.state_at(at))), low, high)
            place, speed = (
                steady.wrap_position(at),
                np.hypot(*_x_and_y(quantity_and_rates(steady.state_at(at), output)[1])) / abs(steady.rate),
            )
        except NoAnswer:
            continue
        if place is not None and speed <= still:
            found.add(place)
    return sorted(found)


def _x_and_y(vector: Array) -> tuple[float, float]:
    x, *rest = np.asarray(vector, dtype=float)
    return float(x), float(rest[0]) if rest else 0.0
