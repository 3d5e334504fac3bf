"""What acts on the links of a mechanism, as tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np

from planar.dynamics.external_actions import Acting, Field
from planar.dynamics.forces import Forces
from planar.foundation.units import shown, unit
from planar.model.mechanism import Units
from planar.reports.fitted_table import FittedTable
from planar.reports.tables_of_numbers import ROUNDING, counted, direction, heading, plain_table

Array = np.ndarray


class Moved(NamedTuple):
    """What acts at a position, and how fast what it acts on moves: its place (2,), m/s, and its link, rad/s."""

    acting: Acting
    velocity: Array
    angular_velocity: float

    @property
    def most(self) -> float:
        """The greatest power that it could have at these speeds, W."""
        pushing = float(np.hypot(*self.acting.force) * np.hypot(*self.velocity))
        return pushing + abs(self.acting.couple * self.angular_velocity)


def moved(forces: Forces, inertia: bool) -> list[Moved]:
    """Of a position: the links' inertia, or everything else but the inputs."""
    field = Field(forces.moving, forces.moving.shapes)
    asked = [each for each in forces.acting if each.kind == "inertia"] if inertia else forces.loads
    return [
        Moved(each, field.velocity(each.link, each.at[None])[0], float(field.turning(each.link)[0])) for each in asked
    ]


def acting_table(title: str, rows: Iterable[Moved], units: Units, moment: float) -> FittedTable:
    """Forces and couples with the motion of what they act on, and their power; beside the greatest moment (N m)."""
    at = heading("at", "angle", units)
    table = plain_table(
        title,
        "what",
        "on",
        ("force, N", at),
        "torque, N·m",
        (heading("velocity", "velocity", units), at),
        heading("ang. velocity", "angular velocity", units),
        "power, W",
        left=(0, 1),
        keys=2,
    )
    measure = shown("velocity", units)[1]
    for each in rows:
        acting = each.acting
        turns = abs(acting.couple) > ROUNDING * moment
        pushes = acting.force.any() or not turns
        table.add_row(
            acting.name,
            acting.link,
            *arrow(acting.force if pushes else None, units.angle),
            counted(float(acting.couple) if turns else None),
            *arrow(measure.from_si(each.velocity) if pushes else None, units.angle),
            counted(each.angular_velocity if turns else None),
            counted(float(acting.power), each.most + moment * abs(each.angular_velocity)),
        )
    return table


def arrow(vector: Array | None, degree: str, beside: float = 0.0) -> tuple[str, str]:
    """A vector's magnitude and direction, without one where it is nothing (see `counted`)."""
    if vector is None or not np.isfinite(vector).all():
        return "-", "-"
    size = float(np.hypot(*vector))
    way = counted(unit(degree).from_si(direction(vector))) if size > ROUNDING * beside else ""
    return counted(size, beside), way


def record(rows: Iterable[Moved]) -> list[dict[str, Any]]:
    """The same as JSON values (SI)."""
    return [
        {"kind": each.acting.kind, "name": each.acting.name, "link": each.acting.link}
        | {"position": each.acting.at.tolist(), "force": each.acting.force.tolist(), "torque": each.acting.couple}
        | {"velocity": each.velocity.tolist(), "angular_velocity": each.angular_velocity, "power": each.acting.power}
        for each in rows
    ]
