"""Motors beside what their inputs need, as sentences and tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.analysis.efforts.motor_duty import MotorDuty, motor_duty
from planar.dynamics.forces import Forces
from planar.model.file_units import display_unit
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_number, format_quantity, quantity_text
from planar.results.motion import Motion


def motor_duties(forces: Forces) -> tuple[MotorDuty, ...]:
    """Of every input that has a motor."""
    return tuple(motor_duty(forces, given.pair) for given in forces.mechanism.inputs if given.motor is not None)


def motors_table(forces: Forces, duties: tuple[MotorDuty, ...]) -> FittedTable:
    """What motors supply at the speeds that there are, and what is needed; over a motion where the margin is least."""
    moving = forces.moving
    title = "Motors, where the margin is least" if isinstance(moving, Motion) else "Motors"
    units = forces.mechanism.units
    powers = (column_heading(each, "power", units) for each in ("power needed", "at most"))
    efforts = ("supplies", "needs", "margin", "unit")
    table = plain_table(title, "input", "at", "speed", efforts, *powers, left=(0, 1, 2, 6))
    for each in duties:
        velocity, row = np.atleast_1d(np.asarray(moving.inputs[each.input].velocity)), 0
        margins = np.atleast_1d(np.asarray(each.margin))
        if np.isfinite(margins).any():
            row = int(np.nanargmin(margins))
        rate_kind = relative_motions(forces.mechanism)[each.input].input_quantity_kinds()[1]
        kind = "force" if forces.is_force_input(each.input) else "torque"
        values = (np.atleast_1d(np.asarray(part))[row] for part in (each.available, each.needed, each.margin))
        table.add_row(
            each.input,
            _place(forces, each.least_at),
            quantity_text(float(velocity[row]), rate_kind, units),
            *(format_quantity(float(value), kind, units) for value in values),
            display_unit(kind, units)[0],
            format_quantity(float(np.nanmax(np.atleast_1d(np.asarray(each.power)))), "power", units),
            format_quantity(each.greatest_power, "power", units),
        )
    return table


def motor_sentences(forces: Forces, duties: tuple[MotorDuty, ...]) -> Iterator[str]:
    """Which motors are too weak, and where."""
    for each in duties:
        if not each.too_weak:
            continue
        if not isinstance(forces.moving, Motion):
            yield f"the motor at {each.input!r} is too weak for this speed here: it slows down, or stalls"
            continue
        stretches = [f"from {_place(forces, low)} to {_place(forces, high)}" for low, high in each.too_weak]
        yield (
            f"the motor at {each.input!r} is too weak for this speed {join_all_names(stretches)}: there it slows down, "
            "and lives on what is stored; a simulation tells how far"
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
