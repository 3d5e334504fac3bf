"""Whether a motor is strong enough: what it supplies over a motion beside what its input needs, and where it stalls."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.zeros import bracket_zeros
from planar.document.first_argument import takes_result
from planar.dynamics.forces import Forces, forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.model.motors import Motor
from planar.results.motion import Motion, State


class MotorDuty(NamedTuple):
    """A motor over a motion, or at a position (then numbers in place of arrays (n,)); N m and W, at a slide N.

    `available` is what it supplies at the input's speed, `needed` what the input needs, `margin` how much more there
    is, in the sense in which the motor drives: below zero it is too weak, and slows down. `power` is what the input
    needs. `least` is the least margin, and `least_at` the position of the running input there (the time of a run in
    time); `too_weak` are the stretches (from, to) where the margin is below zero, their ends solved for.
    `greatest_power` is the most that the motor can supply, at the speed `best_speed`.
    """

    input: str
    motor: Motor
    available: Array | float
    needed: Array | float
    margin: Array | float
    power: Array | float
    least: float
    least_at: float
    too_weak: tuple[tuple[float, float], ...]
    greatest_power: float
    best_speed: float

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("Forces")
def motor_duty(forces: Forces, of: str | None = None) -> MotorDuty:
    """What the motor of an input (left out: of the only one that has a motor) supplies, beside what the input needs.

    At the speed that the motion has: a simulation runs by the motor. Of a motion in a range of the input the ends of
    stretches where it is too weak are solved for on exact positions, of others through a straight line between rows.
    Raises BadInput for an input that has no motor.

    >>> import planar
    >>> motion = planar.cycle(planar.load("motor-press"), 72)
    >>> [[round(end, 3) for end in ends] for ends in planar.motor_duty(planar.forces(motion)).too_weak]
    [[3.491, 4.289]]
    """
    moving = forces.moving
    motors = {given.pair: given.motor for given in forces.mechanism.inputs if given.motor is not None}
    if of is None and len(motors) == 1:
        (of,) = motors
    if of is None or of not in motors:
        told = f"inputs with motors are at {', '.join(motors)}" if motors else "no input has a motor"
        raise BadInput(of or "motor", f"{told}; name one" if of is None else f"there is no motor here; {told}")
    motor, needed = motors[of], forces.inputs[of]
    velocity = moving.inputs[of].velocity
    available = motor.effort_at(velocity)
    margin = motor.sense * (available - needed)
    power = np.asarray(needed) * np.asarray(velocity)
    most, best = motor.greatest_power
    if isinstance(moving, State):
        at, left = float(moving.inputs[of].position), float(margin)
        numbers = float(available), float(needed), left, float(power), left, at
        return MotorDuty(of, motor, *numbers, ((at, at),) if left < 0.0 else (), most, best)
    where = moving.inputs[moving.running_input].position if moving.time is None else moving.time
    weak = tuple(_too_weak(moving, of, motor, where, margin))
    if np.isfinite(margin).any():
        row = int(np.nanargmin(margin))
        least, at = float(margin[row]), float(where[row])
    else:
        least = at = np.nan
    return MotorDuty(of, motor, available, np.asarray(needed), margin, power, least, at, weak, most, best)


def _too_weak(motion: Motion, name: str, motor: Motor, where: Array, margin: Array) -> Iterator[tuple[float, float]]:
    """The stretches where the margin is below zero, in the order of the rows."""
    known = np.isfinite(margin)
    where, margin = where[known], margin[known]
    if not len(where) or not (margin < 0.0).any():
        return
    zeros = [
        _find_zero(motion, name, motor, (low, high), margin_at(where, margin, low, high))
        for low, high in bracket_zeros(where, margin)
    ]
    begin = float(where[0]) if margin[0] < 0.0 else None
    for zero in zeros:
        if begin is None:
            begin = zero
        else:
            yield begin, zero
            begin = None
    if begin is not None:
        yield begin, float(where[-1])


def margin_at(where: Array, margin: Array, low: float, high: float) -> tuple[float, float]:
    """The margins at two rows' positions."""
    rows = [int(np.flatnonzero(where == each)[0]) for each in (low, high)]
    return float(margin[rows[0]]), float(margin[rows[1]])


def _find_zero(
    motion: Motion, name: str, motor: Motor, ends: tuple[float, float], margins: tuple[float, float]
) -> float:
    """Where the margin is zero between two positions: on exact ones where the motion has them."""
    (low, high), (first, last) = ends, margins
    straight = low + (high - low) * first / (first - last)
    if motion.time is not None or any(given.acceleration for given in motion.mechanism.inputs):
        return straight
    try:
        run = InterpolatedRun(motion)

        def margin(position: float) -> float:
            state = run.state_at(position)
            return motor.sense * float(motor.effort_at(state.inputs[name].velocity) - forces(state).inputs[name])

        if run.rate != next(each.velocity for each in motion.mechanism.inputs if each.pair == run.pair):
            return straight  # an input at rest
        return find_root(margin, low, high)
    except (BadInput, NoAnswer):
        return straight
