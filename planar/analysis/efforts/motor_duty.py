"""Whether a motor is strong enough: what it supplies over a motion beside what its input needs, and where it stalls."""

from __future__ import annotations

from itertools import groupby
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.force_course import force_course
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr
from planar.model.motors import Motor
from planar.results.motion import Motion, State


class MotorDuty(NamedTuple):
    """A motor over a motion, or at a position (then numbers in place of arrays (n,)); N m and W, at a slide N.

    `available` is what it supplies at the input's speed, `needed` what the input needs, `margin` how much more there
    is, in the sense in which the motor drives: below zero it is too weak, and slows down. `power` is what the input
    needs. `least` is the least margin, and `least_at` the position of the running input there (the time of a run in
    time); `too_weak` are the intervals (from, to) in which the margin is below zero. `greatest_power` is the most that
    the motor can supply, at the speed `best_speed`, and `greatest_power_needed` the most that the input needs.
    `is_solved` says whether least margin, intervals and power needed are solved for between the positions of a motion;
    where the motion is known at its positions alone, they are read off these.
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
    greatest_power_needed: float
    is_solved: bool = True

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("Forces")
def motor_duty(forces: Forces, of: str | None = None) -> MotorDuty:
    """What the motor of an input (left out: of the only one that has a motor) supplies, beside what the input needs.

    At the speed that the motion has: a simulation runs by the motor. The least margin and the ends of intervals in
    which the motor is too weak are solved for between the positions, on each smooth piece of the motion. Raises
    BadInput for an input that has no motor.

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
        message = f"inputs with motors are at {', '.join(motors)}" if motors else "no input has a motor"
        raise BadInput(of or "motor", f"{message}; name one" if of is None else f"there is no motor here; {message}")
    motor, needed = motors[of], np.asarray(forces.inputs[of])
    measure = _MarginMeasure(of, motor)
    available = motor.effort_at(moving.inputs[of].velocity)
    margin, power = measure.of_forces(forces).T
    greatest, best_speed = motor.greatest_power
    if isinstance(moving, State):
        position, remaining = float(moving.inputs[of].position), float(margin[0])
        numbers = float(available), float(needed), remaining, float(power[0]), remaining, position
        weak = ((position, position),) if remaining < 0.0 else ()
        return MotorDuty(of, motor, *numbers, weak, greatest, best_speed, float(power[0]))
    rows = available, needed, margin, power
    solved = _solved_margin(forces, of, measure)
    if solved is not None:
        return MotorDuty(of, motor, *rows, *solved[:3], greatest, best_speed, solved[3])
    smallest, place, intervals, highest = _margin_at_rows(moving, margin, power)
    return MotorDuty(of, motor, *rows, smallest, place, intervals, greatest, best_speed, highest, is_solved=False)


Margins = tuple[float, float, tuple[tuple[float, float], ...], float]
"""The least margin, where it is, the intervals in which the motor is too weak, and the greatest power needed."""


class _MarginMeasure(NamedTuple):
    """The margin of a motor and the power that its input needs, of forces (n, 2)."""

    input: str
    motor: Motor

    def of_forces(self, forces: Forces) -> Array:
        """Margin and power needed (n, 2)."""
        needed, velocity = np.asarray(forces.inputs[self.input]), np.asarray(forces.moving.inputs[self.input].velocity)
        margin = self.motor.sense * (self.motor.effort_at(velocity) - needed)
        return np.stack(np.broadcast_arrays(margin, needed * velocity), axis=-1).reshape(-1, 2)


def _solved_margin(forces: Forces, name: str, measure: _MarginMeasure) -> Margins | None:
    """The margins between the positions of a motion; None where the motion is known at these alone."""
    course = force_course(forces)
    if course is None:
        return None
    scale = course.effort_scale(name)
    speed = float(np.abs(np.asarray(forces.moving.inputs[name].velocity)).max())
    series = course.series(measure.of_forces, np.array([scale, scale * speed]))
    if series is None:
        return None
    smallest, highest = series.smallest(0), series.greatest(1)
    ends = [course.positions(interval) for interval in series.intervals_below(0.0, 0)]
    weak = tuple((float(start), float(stop)) for start, stop in ends)
    return smallest.value, float(course.positions([smallest.place])[0]), weak, highest.value


def _margin_at_rows(motion: Motion, margin: Array, power: Array) -> Margins:
    """The margins at the positions of a motion; intervals go from one position to another."""
    places = motion.inputs[motion.running_input].position if motion.time is None else motion.time
    if not np.isfinite(margin).any():
        return np.nan, np.nan, (), np.nan
    row = int(np.nanargmin(margin))
    weak = []
    for is_weak, rows in groupby(range(len(margin)), key=lambda row: bool(margin[row] < 0.0)):
        ends = list(rows)
        if is_weak:
            weak.append((float(places[ends[0]]), float(places[ends[-1]])))
    return float(margin[row]), float(places[row]), tuple(weak), float(np.nanmax(power))
