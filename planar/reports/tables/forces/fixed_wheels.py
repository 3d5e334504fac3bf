"""The torques that hold wheels of the frame: a table for a terminal, columns of a motion, and JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.dynamics.forces import Forces
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_quantity


def fixed_wheels_tables(forces: Forces, moment: float) -> list[FittedTable]:
    """The holding torque about each centre at a position, beside the greatest moment (N m), and by pairs; no table
    where the frame has no wheel."""
    if not forces.fixed_wheels:
        return []
    units = forces.mechanism.units
    headings = ("about", "pair", column_heading("holding torque", "torque", units))
    table = plain_table(
        f"Holding torque on wheels of {forces.mechanism.frame}, anticlockwise", *headings, left=(0, 1), keys=2
    )
    for name, wheel in forces.fixed_wheels.items():
        about = "-" if wheel.centre is None else name
        for pair, share in wheel.shares.items():
            table.add_row(about, pair, format_quantity(float(share), "torque", units, moment))
        if len(wheel.shares) > 1:
            table.add_row(about, "all of them", format_quantity(float(wheel.torque), "torque", units, moment))
    return [table]


def fixed_wheel_series(forces: Forces) -> Iterator[ReportedSeries]:
    """The holding torque about each centre at every position."""
    for name, wheel in forces.fixed_wheels.items():
        yield ReportedSeries(
            "fixed_wheels", name, {"holding_torque": "torque"}, {"holding_torque": np.asarray(wheel.torque)}
        )


def record(forces: Forces) -> dict[str, Any]:
    """The same of a position as JSON values (SI); null for what equilibrium does not determine."""

    def finite_or_none(value: float) -> float | None:
        return value if np.isfinite(value) else None

    wheels = {
        name: {
            "centre": None if wheel.centre is None else wheel.centre.tolist(),
            "holding_torque": finite_or_none(float(wheel.torque)),
            "shares": {pair: finite_or_none(float(share)) for pair, share in wheel.shares.items()},
        }
        for name, wheel in forces.fixed_wheels.items()
    }
    return {"fixed_wheels": wheels} if wheels else {}
