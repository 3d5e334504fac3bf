"""How cams press on their followers, as a table and sentences for a terminal, columns of files, and JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import groupby
from typing import Any

import numpy as np

from planar.analysis.cams.contact_force import ContactForce, contact_forces
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.model.wording import amount, join_all_names
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_quantity
from planar.reports.tables.motion import position_cell, position_heading
from planar.results.motion import Motion


def contacts_table(forces: Forces) -> FittedTable | None:
    """The force of each contact and its stress, over a motion the greatest; None where no cam has a profile."""
    contacts, units, moving = contact_forces(forces), forces.mechanism.units, forces.moving
    if not contacts:
        return None
    has_stress = any(each.stress is not None for each in contacts.values())
    at = (position_heading(moving),) if isinstance(moving, Motion) else ()
    most = "greatest " if at else ""
    columns = [(column_heading(f"{most}force", "force", units), *at)]
    if has_stress:
        columns.append((column_heading(f"{most}stress", "stress", units), *at))
    title = "Contact of cams, among these positions" if at else "Contact of cams"
    table = plain_table(title, "pair", *columns, left=(0,))
    for name, each in contacts.items():
        cells = _cells(forces, each.force, "force")
        if has_stress:
            cells += _cells(forces, each.stress, "stress")
        table.add_row(name, *cells)
    return table


def _cells(forces: Forces, values: Array | None, kind: str) -> tuple[str, ...]:
    """The greatest value, and over a motion where it is."""
    over = isinstance(forces.moving, Motion)
    if values is None or not np.isfinite(values).any():
        return ("-", "") if over else ("-",)
    row = int(np.nanargmax(values))
    told = format_quantity(float(values[row]), kind, forces.mechanism.units)
    return (told, position_cell(forces.moving, row)) if isinstance(forces.moving, Motion) else (told,)


def lift_off_remarks(forces: Forces) -> list[str]:
    """A sentence for each cam whose follower lifts off somewhere: where, and how hard the cam would have to pull."""
    told = []
    for name, each in contact_forces(forces).items():
        if not each.lifts_off.any():
            continue
        pull = amount(-float(np.nanmin(each.force)), "force", forces.mechanism.units)
        told.append(
            f"the follower of {name!r} lifts off {_places(forces, each.lifts_off)}: the cam would have to pull it by "
            f"up to {pull}; a stronger spring, a groove or less speed keeps it down"
        )
    return told


def _places(forces: Forces, lifts_off: Array) -> str:
    """Where a follower lifts off, by positions of the motion."""
    motion = forces.moving
    if not isinstance(motion, Motion):
        return "here"
    name, unit = position_heading(motion).rsplit(", ", 1)
    spans = []
    for lifted, rows in groupby(range(len(lifts_off)), key=lambda row: bool(lifts_off[row])):
        ends = list(rows)
        if lifted:
            first, last = (position_cell(motion, row) for row in (ends[0], ends[-1]))
            spans.append(first if first == last else f"{first} to {last}")
    return f"{name} = {join_all_names(spans)} {unit}".replace("at at", "at")


def contact_series(forces: Forces) -> Iterator[ReportedSeries]:
    """The force and the stress of each contact at every position."""
    for name, each in contact_forces(forces).items():
        values = {"force": each.force} | ({} if each.stress is None else {"stress": each.stress})
        yield ReportedSeries("contacts", name, {what: what for what in values}, values)


def record(forces: Forces) -> dict[str, Any]:
    """The contacts as JSON values (SI); over a motion the greatest."""
    found = {name: _contact_record(each) for name, each in contact_forces(forces).items()}
    return {"contacts": found} if found else {}


def _contact_record(each: ContactForce) -> dict[str, float | None]:
    values = {"force": each.force} | ({} if each.stress is None else {"stress": each.stress})
    return {what: float(np.nanmax(value)) if np.isfinite(value).any() else None for what, value in values.items()}
