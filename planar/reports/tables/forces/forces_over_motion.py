"""The forces over a motion: tables for a terminal, and what a file of the motion has of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.efforts.unknown_load import UnknownLoad
from planar.dynamics.forces import Forces
from planar.dynamics.load_attachment import attachment_remarks
from planar.dynamics.reactions import Reaction
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.file_units import display_unit
from planar.model.wording import count_phrase, join_all_names
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import ROUNDING_RATIO, column_heading, format_or_zero, format_quantity, paragraphs
from planar.reports.tables.forces import cam_contacts, fixed_wheels, flywheels, friction, loads, motors, unknown_loads
from planar.reports.tables.forces import position_forces as at_one
from planar.reports.tables.motion import motion_heading, position_cell, position_heading, running_pair
from planar.results.motion import Motion


def tables(
    forces: Forces, wanted: flywheels.WantedFlywheel | None = None, unknown: UnknownLoad | None = None
) -> RenderableType:
    """Mean, least and greatest effort of every input, the greatest force and couple in every pair, each with where; the
    flywheel that is wanted, and the load that is solved for."""
    motion = _motion_of(forces)
    parts: list[RenderableType] = [
        *motion_heading(motion),
        Text(at_one.equilibrium_text(forces)),
        Text(),
        _efforts_table(forces, motion),
    ]
    duties = motors.motor_duties(forces)
    if duties:
        parts.append(motors.motors_table(forces, duties))
    facts = [*_shaking_facts(forces, motion), *friction.efficiency_facts(forces), *friction.holding_facts(forces)]
    facts += at_one.proof_facts(forces)
    if wanted is not None:
        facts = [*flywheels.flywheel_facts(forces, wanted), *facts]
    if unknown is not None:
        facts = [*unknown_loads.unknown_load_facts(forces, unknown), *facts]
    parts.append(_reactions_table(forces, motion))
    parts += [_holding_torques_table(forces, motion)] if forces.fixed_wheels else []
    contacts = cam_contacts.contacts_table(forces)
    if contacts is not None:
        parts.append(contacts)
    if forces.friction:
        parts.append(friction.friction_over_motion_table(forces))
    parts.append(paragraphs(facts))
    notes = (
        *motors.motor_sentences(forces, duties),
        *_undetermined_sentences(forces, len(motion)),
        *cam_contacts.lift_off_remarks(forces),
        *forces.remarks,
        *attachment_remarks(forces.mechanism),
        *motion.remarks,
    )
    if notes:
        parts += [Text(), paragraphs(("-", sentence) for sentence in notes)]
    return Group(*parts)


def _motion_of(forces: Forces) -> Motion:
    if not isinstance(forces.moving, Motion):
        raise BadInput("forces", "this is told over a motion; give the forces over one")
    return forces.moving


def _efforts_table(forces: Forces, motion: Motion) -> FittedTable:
    at, most = position_heading(motion), at_one.greatest_moment_and_force(forces)
    table = plain_table(
        "Inputs, among these positions", "input", ("mean effort", "unit"), ("least", at), ("greatest", at), left=(0, 2)
    )
    for name, effort in forces.inputs.items():
        _, unit, of = at_one.effort_name_and_unit(forces, name)
        values = np.asarray(effort)
        scale = most[forces.is_force_input(name)]
        least, greatest = _extremes_with_places(motion, values, scale)
        mean, low, high = (
            format_or_zero(of.from_si(each), of.from_si(scale))
            for each in (_mean(motion, values), least[0], greatest[0])
        )
        table.add_row(name, mean, unit, low, least[1], high, greatest[1])
    return table


def _holding_torques_table(forces: Forces, motion: Motion) -> FittedTable:
    """The least and the greatest torque that holds wheels of the frame, about each centre."""
    at, moment, units = position_heading(motion), at_one.greatest_moment_and_force(forces)[0], forces.mechanism.units
    title = f"Holding torque on wheels of {forces.mechanism.frame}, anticlockwise, among these positions"
    heading = column_heading("least", "torque", units), column_heading("greatest", "torque", units)
    table = plain_table(title, "about", "pair", (heading[0], at), (heading[1], at), left=(0, 1), keys=2)
    for name, wheel in forces.fixed_wheels.items():
        values = np.asarray(wheel.torque)
        least, greatest = _extremes_with_places(motion, values, moment)
        low, high = (format_quantity(value, "torque", units, moment) for value in (least[0], greatest[0]))
        about = "-" if wheel.centre is None else name
        table.add_row(about, join_all_names([*wheel.shares]), low, least[1], high, greatest[1])
    return table


def _mean(motion: Motion, values: Array) -> float:
    """Over the time, or over the way of the input that runs, there and back: work by way where it does not turn."""
    driver = running_pair(motion)
    ways = motion.time if driver is None else motion.inputs[driver].position
    steps = np.zeros(0) if ways is None else np.abs(np.diff(ways))
    if not steps.any():
        return float(values[0])
    return float(np.sum(0.5 * (values[1:] + values[:-1]) * steps) / np.sum(steps))


def _extremes_with_places(motion: Motion, values: Array, scale: float) -> tuple[tuple[float, str], tuple[float, str]]:
    """The least and the greatest of values, each with its place; without one where they differ by round-off of a scale
    alone."""
    least, greatest = (_greatest_with_place(motion, sense * values) for sense in (-1.0, 1.0))
    is_constant = greatest[0] + least[0] <= ROUNDING_RATIO * scale
    return (-least[0], "" if is_constant else least[1]), (greatest[0], "" if is_constant else greatest[1])


def _greatest_with_place(motion: Motion, values: Array) -> tuple[float, str]:
    """The greatest of the values that are determined, and where it is."""
    if not np.isfinite(values).any():
        return np.nan, ""
    row = int(np.nanargmax(values))
    return float(values[row]), position_cell(motion, row)


def _reactions_table(forces: Forces, motion: Motion) -> FittedTable:
    units, at, (moment, greatest) = (
        forces.mechanism.units,
        position_heading(motion),
        at_one.greatest_moment_and_force(forces),
    )
    force = (column_heading("greatest force", "force", units), column_heading("its direction", "angle", units), at)
    headings = ("pair", "on", "by", force, (column_heading("greatest couple", "torque", units), at))
    table = plain_table("Reactions in the pairs, among these positions", *headings, left=(0, 1, 2), keys=3)
    for name, each in forces.reactions.items():
        first, second = each.links
        if each.at is not None:
            sizes = np.hypot(*each.force.T)
            most, where = _greatest_with_place(motion, sizes)
            way = loads.polar_cells(each.force[int(np.nanargmax(sizes))], units, "force", greatest)[1] if where else ""
            told = format_quantity(most, "force", units, greatest), way, where if way else ""
            table.add_row(name, second, first, *told, *_greatest_couple(motion, each.couple, moment))
        for link, couple in each.couples.items():
            table.add_row(name, link, "", "-", "", "", *_greatest_couple(motion, couple, moment))
    return table


def _greatest_couple(motion: Motion, couple: Array | float, beside: float) -> tuple[str, str]:
    """The greatest couple, whatever its sense, and where; nowhere if there is none."""
    most, where = _greatest_with_place(motion, np.abs(np.asarray(couple)))
    told = format_quantity(most, "torque", motion.mechanism.units, beside)
    return told, "" if told == "0" else where


def _shaking_facts(forces: Forces, motion: Motion) -> Iterator[tuple[str, str]]:
    if not at_one.has_inertia(forces):
        return
    force, moment = forces.shaking
    (name, measure), told = position_heading(motion).split(", "), []
    sizes, most_of_all = (np.hypot(*force.T), np.abs(np.asarray(moment))), at_one.greatest_moment_and_force(forces)
    units = motion.mechanism.units
    for values, kind, beside in zip(sizes, ("force", "torque"), most_of_all[::-1], strict=True):
        most, where = _greatest_with_place(motion, values)
        unit = display_unit(kind, units)[0]
        told.append(f"up to {format_quantity(most, kind, units, beside)} {unit} ({name} = {where} {measure})")
    yield "shaking", f"{told[0]}, and {told[1]} about the frame's origin"


def _undetermined_sentences(forces: Forces, position_count: int) -> Iterator[str]:
    """What is not told, at how many positions, and why; what has the same reason together."""
    efforts = {name: np.isnan(values) for name, values in forces.inputs.items()}
    by: dict[tuple[str, int], list[str]] = {}
    for name, lost in (efforts | {name: _undetermined_rows(each) for name, each in forces.reactions.items()}).items():
        if lost.any():
            by.setdefault((forces.undetermined[name], int(np.sum(lost))), []).append(name)
    for (why, count), names in by.items():
        yield (
            f"not determined at {join_all_names(names)}, at {count} of "
            f"{count_phrase(position_count, 'position')}: {why}"
        )


def _undetermined_rows(each: Reaction) -> Array:
    """Where something of a reaction is not told (n,)."""
    parts = [np.asarray(couple) for couple in each.couples.values()] or [*each.force.T, np.asarray(each.couple)]
    return np.isnan(np.stack(parts)).any(axis=0)


def force_series(forces: Forces) -> Iterable[ReportedSeries]:
    """Efforts, reactions, shaking force and moment at every position, beside what a file of the motion has."""
    available = {each.input: each.available for each in motors.motor_duties(forces)}
    for name, effort in forces.inputs.items():
        what, _, _ = at_one.effort_name_and_unit(forces, name)
        kinds = {what: what, "power": "power"}
        values = {what: np.asarray(effort), "power": np.asarray(forces.powers[name])}
        if name in available:
            kinds["available"], values["available"] = what, np.asarray(available[name])
        yield ReportedSeries("inputs", name, kinds, values)
    for name, each in forces.reactions.items():
        values = _reaction_values(each)
        yield ReportedSeries("reactions", name, {what: _REACTION_KINDS.get(what, "torque") for what in values}, values)
    yield from fixed_wheels.fixed_wheel_series(forces)
    yield from friction.friction_series(forces)
    yield from cam_contacts.contact_series(forces)
    if at_one.has_inertia(forces):
        force, moment = forces.shaking
        kinds = {"force": "force", "moment": "torque"}
        yield ReportedSeries("shaking", "", kinds, {"force": force, "moment": np.asarray(moment)})


_REACTION_KINDS = {"position": "length", "force": "force"}
"""Of what is told of a reaction; everything else of it is a couple."""


def _reaction_values(each: Reaction) -> dict[str, Array]:
    if each.at is None:
        return {f"couple on {link}": np.asarray(couple) for link, couple in each.couples.items()}
    return {"position": each.at, "force": each.force, "couple": np.asarray(each.couple)}


def run_facts(
    forces: Forces, wanted: flywheels.WantedFlywheel | None = None, unknown: UnknownLoad | None = None
) -> dict[str, Any]:
    """What is said of the whole motion, as JSON values; forces in a pair are on the second of the links `between`."""
    between = {name: list(each.links) for name, each in forces.reactions.items()}
    remarks = [
        *forces.remarks,
        *cam_contacts.lift_off_remarks(forces),
        *attachment_remarks(forces.mechanism),
        *forces.moving.remarks,
    ]
    duties = motors.motor_duties(forces)
    told = {"motors": motors.record(duties)} if duties else {}
    told |= {} if wanted is None else {"flywheel": flywheels.record(wanted)}
    told |= {} if unknown is None else {"solved_for": unknown_loads.record(unknown)}
    told |= friction.motion_record(forces) | cam_contacts.record(forces)
    return {"between": between, "remarks": remarks, **told, **at_one.proof_record(forces)}
