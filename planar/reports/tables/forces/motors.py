"""Motors beside what their inputs need, as sentences and tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.analysis.efforts.motor_duty import MotorDuty, motor_duty
from planar.dynamics.force_course import force_course
from planar.dynamics.forces import Forces
from planar.model.file_units import display_unit
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import AMONG_POSITIONS, column_heading, format_number, format_quantity, quantity_text
from planar.results.motion import Motion


def motor_duties(forces: Forces) -> tuple[MotorDuty, ...]:
    """Of every input that has a motor."""
    return tuple(motor_duty(forces, given.pair) for given in forces.mechanism.inputs if given.motor is not None)


def motors_table(forces: Forces, duties: tuple[MotorDuty, ...]) -> FittedTable:
    """What motors supply at the speeds that there are, and what is needed; over a motion where the margin is least."""
    moving = forces.moving
    title = "Motors"
    if isinstance(moving, Motion):
        title += ", where the margin is least" + ("" if all(duty.is_solved for duty in duties) else AMONG_POSITIONS)
    units = forces.mechanism.units
    powers = (column_heading(each, "power", units) for each in ("power needed", "at most"))
    efforts = ("supplies", "needs", "margin", "unit")
    table = plain_table(title, "input", "at", "speed", efforts, *powers, left=(0, 1, 2, 6))
    for duty in duties:
        rate_kind = relative_motions(forces.mechanism)[duty.input].input_quantity_kinds()[1]
        kind = "force" if forces.is_force_input(duty.input) else "torque"
        velocity = _velocity_at(forces, duty)
        available = float(duty.motor.effort_at(velocity))
        needed = available - duty.motor.sense * duty.least if isinstance(moving, Motion) else float(duty.needed)
        table.add_row(
            duty.input,
            _place(forces, duty.least_at),
            quantity_text(velocity, rate_kind, units),
            *(format_quantity(value, kind, units) for value in (available, needed, duty.least)),
            display_unit(kind, units)[0],
            format_quantity(duty.greatest_power_needed, "power", units),
            format_quantity(duty.greatest_power, "power", units),
        )
    return table


def _velocity_at(forces: Forces, duty: MotorDuty) -> float:
    """The velocity of the input where the margin is least."""
    moving = forces.moving
    if not isinstance(moving, Motion):
        return float(moving.inputs[duty.input].velocity)
    along = moving.inputs[moving.running_input].position if moving.time is None else moving.time
    velocity = np.asarray(moving.inputs[duty.input].velocity)
    course = force_course(forces)
    if moving.time is not None and duty.is_solved and course is not None:
        velocity = np.asarray(course.run.motion_at(np.array([duty.least_at])).inputs[duty.input].velocity)
        return float(velocity[0])
    return float(velocity[int(np.argmin(np.abs(along - duty.least_at)))] if np.isfinite(duty.least_at) else velocity[0])


def motor_sentences(forces: Forces, duties: tuple[MotorDuty, ...]) -> Iterator[str]:
    """Which motors are too weak, and where."""
    for each in duties:
        if not each.too_weak:
            continue
        if not isinstance(forces.moving, Motion):
            yield f"the motor at {each.input!r} is too weak for this speed here: it slows down, or stalls"
            continue
        stretches = [f"from {_place(forces, low)} to {_place(forces, high)}" for low, high in each.too_weak]
        among = "" if each.is_solved else AMONG_POSITIONS
        yield (
            f"the motor at {each.input!r} is too weak for this speed {join_all_names(stretches)}{among}: it slows down "
            "there and uses the kinetic energy of the links; a simulation computes by how much"
        )


def _place(forces: Forces, at: float) -> str:
    moving = forces.moving
    if isinstance(moving, Motion) and moving.time is not None:
        return f"{format_number(at)} s"
    name = moving.running_input if isinstance(moving, Motion) else next(iter(moving.inputs))
    kind = "length" if forces.is_force_input(name) else "angle"
    return amount(at, kind, forces.mechanism.units)


def record(duties: tuple[MotorDuty, ...]) -> dict[str, Any]:
    """The motors as JSON values (SI), without the rows of a motion."""
    return {
        each.input: {
            "margin": each.least if np.isfinite(each.least) else None,
            "at": each.least_at if np.isfinite(each.least_at) else None,
            "too_weak": [[float(end) for end in ends] for ends in each.too_weak],
            "greatest_power": each.greatest_power,
            "best_speed": each.best_speed,
        }
        for each in duties
    }
