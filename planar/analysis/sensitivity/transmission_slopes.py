"""How a transmission angle, and the least over a motion, change with the numbers of the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.output import Extreme
from planar.analysis.motion.transmission_angle import Transmission, transmission
from planar.derivatives.kinematic_slopes import NamedResult
from planar.derivatives.result_slopes import PositionSlopes, SlopeSystem
from planar.derivatives.transmission_system import loaded_output, output_angle
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.short_repr import short_repr
from planar.model.output_pair import find_output_pair
from planar.model.pairs import Pair
from planar.results.motion import Motion, State

FOLD = 1e-9
"""rad: nearer to a right angle, from which the reported angle falls to both sides, it has no derivative."""


class TransmissionSlopes(NamedTuple):
    """The transmission angle of an output (rad) with its derivatives by the names of inputs and dimensions (SI).

    `angle` and each of `slopes` are numbers, over a motion arrays (n,); `least` is the least over a motion, and
    `least_slopes` its derivatives, where the input follows it: None of a position, and at an end of an open range.
    There is no derivative (NaN) at an angle of 0 or 90 degrees, from which it is reported as falling to both sides, and
    where an input between moving links drives the output.
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
    slopes = _angle_slopes(moving, found, pair, np.atleast_1d(found.angle))
    if not isinstance(moving, Motion):
        return TransmissionSlopes(found.link, found.pair, found.angle, {k: float(v[0]) for k, v in slopes.items()})
    return TransmissionSlopes(
        found.link, found.pair, found.angle, slopes, found.least, _least_slopes(moving, found, pair)
    )


def _angle_slopes(moving: State | Motion, of: Transmission, pair: Pair, angle: Array) -> dict[str, Array]:
    """The derivatives of the angles (n,) by the names of inputs and of numbers of links and pairs (n,)."""
    system = SlopeSystem(replace(moving, mechanism=loaded_output(moving.mechanism, pair)), is_balanced=True)

    def output_result(part: PositionSlopes) -> list[NamedResult]:
        assert part.forces is not None
        balance = part.forces.balance(1)
        forces = [balance.pair_wrench(name, of.link)[0] for name in of.through]
        derived_angle = output_angle(balance.motion, (of.link, pair), of.through, forces)
        return [NamedResult("angle", "angle", (derived_angle,))]

    slopes = system.derive(output_result).slopes["angle"][:, 0]
    # the balance does not derive the effort of an input between moving links, by which it may drive the output
    is_by_input = any(driven.pair in of.through for driven in moving.mechanism.inputs)
    is_known = (np.abs(angle - 0.5 * np.pi) > FOLD) & (angle > FOLD) & (not is_by_input)
    slopes = np.where(is_known[:, None], slopes, np.nan)
    sections = {dimension.name: dimension.path[0] for dimension in system.parameters.dimensions}
    return {
        name: slopes[:, k] for k, name in enumerate(system.names) if sections.get(name, "links") in ("links", "pairs")
    }


def _least_slopes(motion: Motion, of: Transmission, pair: Pair) -> dict[str, float] | None:
    """Those at the least: as the input follows it, its own change does nothing to the first order."""
    least = of.least
    try:
        run = InterpolatedRun(motion)
        is_end = not run.closed and least is not None and least.input in (run.lowest, run.highest)
        if least is None or is_end:
            return None
        state = run.state_at(least.input)
    except (BadInput, NoAnswer):
        return None
    slopes = _angle_slopes(state, of, pair, np.array([least.value]))
    return {name: float(values[0]) for name, values in slopes.items() if not name.startswith(f"{run.pair}.")}
