"""What acts on the links of a mechanism, as tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from planar.dynamics.external_actions import ExternalAction, KinematicArrays
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.model.file_units import FileUnits
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import ROUNDING_RATIO, column_heading, format_quantity, vector_direction


class ActionMotion(NamedTuple):
    """What acts at a position, and how fast what it acts on moves: its place (2,), m/s, and its link, rad/s."""

    acting: ExternalAction
    velocity: Array
    angular_velocity: float

    @property
    def max_power(self) -> float:
        """The greatest power that it could have at these speeds, W."""
        pushing = float(np.hypot(*self.acting.force) * np.hypot(*self.velocity))
        return pushing + abs(float(self.acting.couple) * self.angular_velocity)


def actions_with_motion(forces: Forces, inertia: bool) -> list[ActionMotion]:
    """Of a position: the links' inertia, or everything else but the inputs."""
    field = KinematicArrays(forces.moving)
    asked = [each for each in forces.acting if each.kind == "inertia"] if inertia else forces.loads
    return [
        ActionMotion(each, field.velocity_at(each.link, each.at[None])[0], float(field.angle_rates(each.link)[0]))
        for each in asked
    ]


def actions_table(title: str, rows: Iterable[ActionMotion], units: FileUnits, moment: float) -> FittedTable:
    """Forces and couples with the motion of what they act on, and their power; beside the greatest moment (N m)."""
    at = column_heading("at", "angle", units)
    table = plain_table(
        title,
        "what",
        "on",
        (column_heading("force", "force", units), at),
        column_heading("torque", "torque", units),
        (column_heading("velocity", "velocity", units), at),
        column_heading("ang. velocity", "angular velocity", units),
        column_heading("power", "power", units),
        left=(0, 1),
        keys=2,
    )
    for each in rows:
        acting = each.acting
        turns = abs(float(acting.couple)) > ROUNDING_RATIO * moment
        pushes = acting.force.any() or not turns
        table.add_row(
            acting.name,
            acting.link,
            *polar_cells(acting.force if pushes else None, units, "force"),
            format_quantity(float(acting.couple) if turns else None, "torque", units),
            *polar_cells(each.velocity if pushes else None, units, "velocity"),
            format_quantity(each.angular_velocity if turns else None, "angular velocity", units),
            format_quantity(float(acting.power), "power", units, each.max_power + moment * abs(each.angular_velocity)),
        )
    return table


def polar_cells(vector: Array | None, units: FileUnits, kind: str, beside: float = 0.0) -> tuple[str, str]:
    """A vector's magnitude and direction, without one where it is nothing (see `format_or_zero`)."""
    if vector is None or not np.isfinite(vector).all():
        return "-", "-"
    size = float(np.hypot(*vector))
    way = format_quantity(vector_direction(vector), "angle", units) if size > ROUNDING_RATIO * beside else ""
    return format_quantity(size, kind, units, beside), way


def record(rows: Iterable[ActionMotion]) -> list[dict[str, Any]]:
    """The same as JSON values (SI)."""
    return [
        {"kind": each.acting.kind, "name": each.acting.name, "link": each.acting.link}
        | {"position": each.acting.at.tolist(), "force": each.acting.force.tolist(), "torque": each.acting.couple}
        | {"velocity": each.velocity.tolist(), "angular_velocity": each.angular_velocity, "power": each.acting.power}
        for each in rows
    ]
