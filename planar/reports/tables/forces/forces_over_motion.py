"""The forces over a motion: tables for a terminal, and what a file of the motion has of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.efforts.unknown_load import UnknownLoad
from planar.dynamics.flywheel import explain_no_cycle, mean_effort
from planar.dynamics.force_course import LEAST_SCALE_RATIO
from planar.dynamics.forces import Forces, greatest_moment_and_force
from planar.dynamics.load_attachment import attachment_remarks
from planar.dynamics.reactions import Reaction
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.file_units import display_unit
from planar.model.wording import count_phrase, join_all_names, quote_names
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_or_zero, format_quantity, paragraphs
from planar.reports.tables.forces import cam_contacts, fixed_wheels, flywheels, friction, loads, motors, unknown_loads
from planar.reports.tables.forces import position_forces as at_one
from planar.reports.tables.forces.run_extremes import RunExtremes
from planar.reports.tables.motion import motion_heading, position_heading
from planar.results.motion import Motion


def tables(
    forces: Forces, wanted: flywheels.WantedFlywheel | None = None, unknown: UnknownLoad | None = None
) -> RenderableType:
    """Mean, least and greatest effort of every input, the greatest force and couple in every pair, each with its place;
    the flywheel and the load that are asked for."""
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
        *_mean_remarks(forces),
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
    at, largest = position_heading(motion), greatest_moment_and_force(forces)
    extremes = effort_extremes(forces)
    headings = ("input", ("mean effort", "unit"), ("least", at), ("greatest", at))
    table = plain_table(f"Inputs{extremes.title}", *headings, left=(0, 2))
    for column, name in enumerate(forces.inputs):
        _, unit, of = at_one.effort_name_and_unit(forces, name)
        scale = largest[forces.is_force_input(name)]
        least, greatest = extremes.least_and_greatest(column, scale)
        mean, low, high = (
            format_or_zero(of.from_si(value), of.from_si(scale))
            for value in (known_mean(forces, name), least.value, greatest.value)
        )
        table.add_row(name, mean, unit, low, least.place, high, greatest.place)
    return table


def _holding_torques_table(forces: Forces, motion: Motion) -> FittedTable:
    """The least and the greatest torque that holds wheels of the frame, about each centre."""
    at, moment, units = position_heading(motion), greatest_moment_and_force(forces)[0], forces.mechanism.units
    extremes = RunExtremes(
        forces,
        lambda found: np.stack([wheel.torque for wheel in found.fixed_wheels.values()], axis=-1),
        LEAST_SCALE_RATIO * moment,
    )
    title = f"Holding torque on wheels of {forces.mechanism.frame}, anticlockwise{extremes.title}"
    heading = column_heading("least", "torque", units), column_heading("greatest", "torque", units)
    table = plain_table(title, "about", "pair", (heading[0], at), (heading[1], at), left=(0, 1), keys=2)
    for column, (name, wheel) in enumerate(forces.fixed_wheels.items()):
        least, greatest = extremes.least_and_greatest(column, moment)
        low, high = (format_quantity(extreme.value, "torque", units, moment) for extreme in (least, greatest))
        about = "-" if wheel.centre is None else name
        table.add_row(about, join_all_names([*wheel.shares]), low, least.place, high, greatest.place)
    return table


def effort_extremes(forces: Forces) -> RunExtremes:
    """The extreme efforts of all inputs, a column each."""
    moment, force = greatest_moment_and_force(forces)
    scales = [LEAST_SCALE_RATIO * (force if forces.is_force_input(name) else moment) for name in forces.inputs]
    return RunExtremes(forces, lambda found: np.stack([*found.inputs.values()], axis=-1), np.array(scales))


def known_mean(forces: Forces, name: str) -> float:
    """The mean effort of an input over a whole cycle of it; NaN where there is none."""
    return np.nan if explain_no_cycle(forces, name) else mean_effort(forces, name)


def _mean_remarks(forces: Forces) -> Iterator[str]:
    """Of which inputs there is no mean effort, and why."""
    reasons: dict[str, list[str]] = {}
    for name in forces.inputs:
        reason = explain_no_cycle(forces, name)
        if reason:
            reasons.setdefault(reason, []).append(name)
    for reason, names in reasons.items():
        yield f"no mean effort of {quote_names(names)}: {reason}"


def _reactions_table(forces: Forces, motion: Motion) -> FittedTable:
    units, at, (moment, greatest) = (
        forces.mechanism.units,
        position_heading(motion),
        greatest_moment_and_force(forces),
    )
    force = (column_heading("greatest force", "force", units), column_heading("its direction", "angle", units), at)
    headings = ("pair", "on", "by", force, (column_heading("greatest couple", "torque", units), at))
    small = LEAST_SCALE_RATIO * moment, LEAST_SCALE_RATIO * greatest
    scales = [
        scale
        for each in forces.reactions.values()
        for scale in (
            (small[1], small[1], small[1] ** 2, small[0]) if each.at is not None else small[:1] * len(each.couples)
        )
    ]
    extremes = RunExtremes(forces, _reaction_columns, np.array(scales))
    table = plain_table(f"Reactions in the pairs{extremes.title}", *headings, left=(0, 1, 2), keys=3)
    column = 0
    for name, each in forces.reactions.items():
        first, second = each.links
        if each.at is not None:
            most = extremes.greatest(column + 2)
            size = float(np.sqrt(most.value))
            way = (
                loads.polar_cells(most.columns[column : column + 2], units, "force", greatest)[1] if most.place else ""
            )
            cells = format_quantity(size, "force", units, greatest), way, most.place if way else ""
            table.add_row(name, second, first, *cells, *_couple_cells(extremes, column + 3, forces, moment))
            column += 4
        for link in each.couples:
            table.add_row(name, link, "", "-", "", "", *_couple_cells(extremes, column, forces, moment))
            column += 1
    return table


def _reaction_columns(forces: Forces) -> Array:
    """Of every pair the force, its square and the couple (n, 4), or the couples on its links (n, links)."""
    columns: list[Array] = []
    for each in forces.reactions.values():
        if each.at is not None:
            columns += [*each.force.T, np.sum(each.force**2, axis=-1), np.asarray(each.couple)]
        columns += [np.asarray(couple) for couple in each.couples.values()]
    return np.stack(columns, axis=-1)


def _couple_cells(extremes: RunExtremes, column: int, forces: Forces, beside: float) -> tuple[str, str]:
    """The greatest couple in either sense, and where; nowhere if there is none."""
    most = extremes.greatest_size(column)
    cell = format_quantity(most.value, "torque", forces.mechanism.units, beside)
    return cell, "" if cell == "0" else most.place


def _shaking_facts(forces: Forces, motion: Motion) -> Iterator[tuple[str, str]]:
    if not at_one.has_inertia(forces):
        return
    name, measure = position_heading(motion).split(", ")
    units, (moment, greatest) = motion.mechanism.units, greatest_moment_and_force(forces)
    scales = np.array([(LEAST_SCALE_RATIO * greatest) ** 2, LEAST_SCALE_RATIO * moment])
    extremes = RunExtremes(forces, _shaking_columns, scales)
    most = extremes.greatest(0), extremes.greatest_size(1)
    cells = []
    for value, kind, beside, place in (
        (np.sqrt(most[0].value), "force", greatest, most[0].place),
        (most[1].value, "torque", moment, most[1].place),
    ):
        cell = format_quantity(float(value), kind, units, beside)
        where = f" ({name} = {place} {measure})" if place and cell != "0" else ""
        cells.append(f"up to {cell} {display_unit(kind, units)[0]}{where}")
    yield "shaking", f"{cells[0]}, and {cells[1]} about the frame's origin{extremes.title}"


def _shaking_columns(forces: Forces) -> Array:
    """The square of the shaking force, and the shaking moment (n, 2)."""
    force, moment = forces.shaking
    return np.stack([np.sum(force**2, axis=-1), np.asarray(moment)], axis=-1)


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
    means = {name: known_mean(forces, name) for name in forces.inputs}
    told: dict[str, Any] = {"mean_effort": {name: None if np.isnan(mean) else mean for name, mean in means.items()}}
    told |= {"motors": motors.record(duties)} if duties else {}
    told |= {} if wanted is None else {"flywheel": flywheels.record(wanted)}
    told |= {} if unknown is None else {"solved_for": unknown_loads.record(unknown)}
    told |= friction.motion_record(forces) | cam_contacts.record(forces)
    return {"between": between, "remarks": remarks, **told, **at_one.proof_record(forces)}
