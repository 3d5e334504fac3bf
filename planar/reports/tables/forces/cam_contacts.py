"""How cams press on their followers, as a table and sentences for a terminal, columns of files, and JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np

from planar.analysis.cams.contact_force import ContactForce, contact_columns, contact_forces
from planar.dynamics.force_course import LEAST_SCALE_RATIO
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.model.wording import amount, join_all_names
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import AMONG_POSITIONS, column_heading, format_quantity
from planar.reports.tables.forces.run_extremes import RunExtremes
from planar.reports.tables.motion import place_cell, position_heading
from planar.results.motion import Motion


def contacts_table(forces: Forces) -> FittedTable | None:
    """The force of each contact and its stress, over a motion the greatest; None where no cam has a profile."""
    contacts, units, moving = contact_forces(forces), forces.mechanism.units, forces.moving
    if not contacts:
        return None
    has_stress = any(each.stress is not None for each in contacts.values())
    extremes = _contact_extremes(forces)
    at = (position_heading(moving),) if isinstance(moving, Motion) else ()
    most = "greatest " if at else ""
    columns = [(column_heading(f"{most}force", "force", units), *at)]
    if has_stress:
        columns.append((column_heading(f"{most}stress", "stress", units), *at))
    title = "Contact of cams" + (extremes.title if extremes is not None else "")
    table = plain_table(title, "pair", *columns, left=(0,))
    column = 0
    for name, contact in contacts.items():
        cells = _cells(forces, extremes, column, contact.force, "force")
        column += 1
        if contact.stress is not None:
            cells += _cells(forces, extremes, column, contact.stress, "stress")
            column += 1
        elif has_stress:
            cells += ("-", "") if at else ("-",)
        table.add_row(name, *cells)
    return table


def _contact_extremes(forces: Forces) -> RunExtremes | None:
    """The extreme forces and stresses of all contacts over a motion; None at a position."""
    if not isinstance(forces.moving, Motion):
        return None
    rows = contact_columns(forces)
    return RunExtremes(forces, contact_columns, LEAST_SCALE_RATIO * np.nan_to_num(np.abs(rows)).max(axis=0))


def _cells(forces: Forces, extremes: RunExtremes | None, column: int, values: Array, kind: str) -> tuple[str, ...]:
    """The greatest value, and over a motion where it is."""
    if extremes is None:
        value = float(values[0])
        return (format_quantity(value, kind, forces.mechanism.units) if np.isfinite(value) else "-",)
    extreme = extremes.greatest(column)
    size = float(np.sqrt(extreme.value)) if kind == "stress" else extreme.value
    return (format_quantity(size, kind, forces.mechanism.units), extreme.place)


def lift_off_remarks(forces: Forces) -> list[str]:
    """A sentence for each cam whose follower lifts off somewhere: where, and how hard the cam would have to pull."""
    remarks = []
    for name, contact in contact_forces(forces).items():
        is_lifted = (
            bool(contact.lift_off_intervals) if isinstance(forces.moving, Motion) else bool(contact.lifts_off.any())
        )
        if not is_lifted:
            continue
        pull = amount(-contact.smallest, "force", forces.mechanism.units)
        among = "" if contact.is_solved else AMONG_POSITIONS
        remarks.append(
            f"the follower of {name!r} lifts off {_places(forces, contact)}{among}: the cam would have to pull it by "
            f"up to {pull}; a stronger spring, a groove or less speed keeps it down"
        )
    return remarks


def _places(forces: Forces, contact: ContactForce) -> str:
    """Where a follower lifts off."""
    motion = forces.moving
    if not isinstance(motion, Motion):
        return "here"
    name, unit = position_heading(motion).rsplit(", ", 1)
    intervals = [[place_cell(motion, end) for end in interval] for interval in contact.lift_off_intervals]
    texts = [first if first == last else f"{first} to {last}" for first, last in intervals]
    return f"{name} = {join_all_names(texts)} {unit}"


def contact_series(forces: Forces) -> Iterator[ReportedSeries]:
    """The force and the stress of each contact at every position."""
    for name, each in contact_forces(forces).items():
        values = {"force": each.force} | ({} if each.stress is None else {"stress": each.stress})
        yield ReportedSeries("contacts", name, {what: what for what in values}, values)


def record(forces: Forces) -> dict[str, Any]:
    """The contacts as JSON values (SI); over a motion the greatest, and the intervals in which followers lift off."""
    contacts = contact_forces(forces)
    if not contacts:
        return {}
    extremes, column, records = _contact_extremes(forces), 0, {}
    for name, contact in contacts.items():
        values = [contact.force] + ([] if contact.stress is None else [contact.stress])
        if extremes is None:
            greatest = [float(each[0]) for each in values]
        else:
            greatest = [extremes.greatest(column + k).value for k in range(len(values))]
            greatest[1:] = [float(np.sqrt(each)) for each in greatest[1:]]
        column += len(values)
        records[name] = _contact_record(forces, contact, greatest)
    return {"contacts": records}


def _contact_record(forces: Forces, contact: ContactForce, greatest: list[float]) -> dict[str, Any]:
    names = ["force"] + ([] if contact.stress is None else ["stress"])
    values = dict(zip(names, (each if np.isfinite(each) else None for each in greatest), strict=True))
    over = (
        {"lift_off": [list(interval) for interval in contact.lift_off_intervals]}
        if isinstance(forces.moving, Motion)
        else {}
    )
    return {**values, **over}
