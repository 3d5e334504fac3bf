"""How a transmission angle, and the least over a motion, change with the numbers of the file."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.output import Extreme
from planar.analysis.motion.transmission_angle import transmission
from planar.derivatives.transmission_system import TransmissionSystem
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.short_repr import short_repr
from planar.model.output_pair import find_output_pair
from planar.results.motion import Motion, State


class TransmissionSlopes(NamedTuple):
    """The transmission angle of an output (rad) with its derivatives by the names of inputs and dimensions (SI).

    `angle` and each of `slopes` are numbers, over a motion arrays (n,); `least` is the least over a motion, and
    `least_slopes` its derivatives, where the input follows it: None of a position, and at an end of an open range.
    There is no derivative (NaN) at an angle of 0 or 90 degrees, where it is told as turning round.
    """

    link: str
    pair: str
    angle: Array | float
    slopes: Mapping[str, Array | float]
    least: Extreme | None = None
    least_slopes: Mapping[str, float] | None = None

    def __repr__(self) -> str:
        return short_repr(self)


def transmission_slopes(moving: State | Motion, of: str) -> TransmissionSlopes | None:
    """The same of a link or a pair; None where it has no transmission angle."""
    try:
        found = transmission(moving, of)
    except BadInput:
        return None
    _, pair = find_output_pair(moving.mechanism, of)
    system = TransmissionSystem(moving.mechanism, found.link, pair, found.through)
    slopes = system.slopes(moving, np.atleast_1d(found.angle))
    if not isinstance(moving, Motion):
        return TransmissionSlopes(found.link, found.pair, found.angle, {k: float(v[0]) for k, v in slopes.items()})
    return TransmissionSlopes(
        found.link, found.pair, found.angle, slopes, found.least, _least_slopes(moving, system, found.least)
    )


def _least_slopes(motion: Motion, system: TransmissionSystem, least: Extreme | None) -> dict[str, float] | None:
    """Those at the least: as the input follows it, its own change does nothing to the first order."""
    try:
        run = InterpolatedRun(motion)
        is_end = not run.closed and least is not None and least.input in (run.lowest, run.highest)
        if least is None or is_end:
            return None
        state = run.state_at(least.input)
    except (BadInput, NoAnswer):
        return None
    slopes = system.slopes(state, np.array([least.value]))
    return {name: float(each[0]) for name, each in slopes.items() if not name.startswith(f"{run.pair}.")}
