"""The forces at a position, as tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.efforts.unknown_load import UnknownLoad
from planar.analysis.worked.published import Comparison
from planar.dynamics.forces import Forces, greatest_moment_and_force
from planar.dynamics.load_attachment import attachment_remarks
from planar.dynamics.reactions import Reaction
from planar.foundation.errors import Outcome
from planar.foundation.units import Unit
from planar.model.file_units import display_unit
from planar.model.link_graph import link_label, link_numbers
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import (
    ROUNDING_RATIO,
    column_heading,
    format_quantity,
    paragraphs,
    precision_text,
    quantity_text,
)
from planar.reports.tables.forces import cam_contacts, fixed_wheels, friction, loads, motors, unknown_loads
from planar.reports.tables.forces import mechanical_advantage as ratios
from planar.reports.tables.position import published_table


def tables(
    forces: Forces,
    advantages: ratios.Advantages,
    comparisons: Sequence[Comparison] = (),
    unknown: UnknownLoad | None = None,
) -> RenderableType:
    """Inputs, what acts, reactions, power, mechanical advantages, and the published torques beside the solved ones."""
    state, units = forces.moving, forces.mechanism.units
    head = [Text(forces.mechanism.name, style="bold")]
    if forces.mechanism.source:
        head.append(Text(forces.mechanism.source, style="italic"))
    parts: list[RenderableType] = [Text(equilibrium_text(forces)), Text()]
    if forces.inputs:
        parts.append(_inputs_table(forces))
    duties = motors.motor_duties(forces)
    if duties:
        parts.append(motors.motors_table(forces, duties))
    acting, inertia = loads.actions_with_motion(forces, inertia=False), loads.actions_with_motion(forces, inertia=True)
    if acting:
        parts.append(loads.actions_table("Loads", acting, units, greatest_moment_and_force(forces)[0]))
    if inertia:
        parts.append(loads.actions_table("Inertia", inertia, units, greatest_moment_and_force(forces)[0]))
    most = sum(each.max_power for each in (*acting, *inertia))
    parts.append(_reactions_table(forces))
    parts += fixed_wheels.fixed_wheels_tables(forces, greatest_moment_and_force(forces)[0])
    contacts = cam_contacts.contacts_table(forces)
    if contacts is not None:
        parts.append(contacts)
    if forces.friction:
        parts.append(friction.friction_table(forces))
    facts = (*_power_and_shaking(forces, most), *friction.efficiency_facts(forces), *friction.holding_facts(forces))
    parts += [paragraphs(facts), Text()]
    if unknown is not None:
        parts += [paragraphs(unknown_loads.unknown_load_facts(forces, unknown)), Text()]
    told = ratios.all_advantages(advantages)
    if told:
        parts.append(ratios.advantages_table(told, units))
    if any(each.through for each in told):
        links = join_all_names([link_label(number, link) for link, number in link_numbers(forces.mechanism).items()])
        parts += [paragraphs([("links", links)]), Text()]
    if comparisons:
        parts += [published_table(comparisons, units), Text()]
    parts.append(paragraphs(proof_facts(forces)))
    notes = (
        *undetermined_sentences(forces),
        *_time_remarks(forces),
        *dict.fromkeys(each.why for each in told if each.why),
        *forces.remarks,
    )
    notes += (
        *motors.motor_sentences(forces, duties),
        *stop_remarks(forces),
        *cam_contacts.lift_off_remarks(forces),
        *attachment_remarks(forces.mechanism),
        *state.remarks,
    )
    if notes:
        parts += [Text(), paragraphs(("-", sentence) for sentence in notes)]
    return Group(*head, *parts)


def equilibrium_text(forces: Forces) -> str:
    """What the equilibrium takes account of, and what is left out."""
    kinds = {each.kind for each in forces.acting} | ({"friction"} if forces.friction else set())
    there = [kind for kind in ("inertia", "weight", "friction") if kind in kinds]
    absent = [name for name in ("inertia", "weight", "friction") if name not in there]
    return f"in equilibrium {f'with {join_all_names(there)}, ' if there else ''}without {join_all_names(absent)}"


def has_inertia(forces: Forces) -> bool:
    """Whether the links' inertia is taken account of."""
    return any(each.kind == "inertia" for each in forces.acting)


def effort_name_and_unit(forces: Forces, name: str) -> tuple[str, str, Unit]:
    """What an input's effort is called, which is its kind of quantity, and its unit, with the name that is printed."""
    kind = "force" if forces.is_force_input(name) else "torque"
    return (kind, *display_unit(kind, forces.mechanism.units))


def _inputs_table(forces: Forces) -> FittedTable:
    mechanism, given = forces.mechanism, forces.moving.inputs
    named, most = relative_motions(mechanism), greatest_moment_and_force(forces)
    units = mechanism.units
    table = plain_table(
        "Inputs", "input", ("effort", "unit"), "position", "rate", column_heading("power", "power", units), left=(0, 2)
    )
    for name, effort in forces.inputs.items():
        kind, rate_kind, _ = named[name].input_quantity_kinds()
        rate = display_unit(rate_kind, units)[0]
        what, unit, _ = effort_name_and_unit(forces, name)
        most_here = most[forces.is_force_input(name)]
        position, velocity = float(given[name].position), float(given[name].velocity)
        table.add_row(
            name,
            format_quantity(float(effort), what, units, most_here),
            unit,
            amount(position, kind, units),
            f"{format_quantity(velocity, rate_kind, units)} {rate}",
            format_quantity(float(forces.powers[name]), "power", units, most_here * velocity),
        )
    return table


def _reactions_table(forces: Forces) -> FittedTable:
    units, (moment, most) = forces.mechanism.units, greatest_moment_and_force(forces)
    force, *axes = (column_heading(each, "force", units) for each in ("force", "x", "y"))
    whole = (force, column_heading("at", "angle", units))
    headings = ("pair", "on", "by", whole, tuple(axes), column_heading("couple", "torque", units))
    table = plain_table("Reactions in the pairs", *headings, left=(0, 1, 2), keys=3)
    for name, reaction in forces.reactions.items():
        first, second = reaction.links
        if reaction.at is not None:
            parts = (format_quantity(float(each), "force", units, most) for each in reaction.force)
            arrow = loads.polar_cells(reaction.force, units, "force", most)
            turned = format_quantity(float(reaction.couple), "torque", units, moment)
            table.add_row(name, second, first, *arrow, *parts, turned)
        for link, couple in reaction.couples.items():
            table.add_row(name, link, "", "-", "-", "-", "-", format_quantity(float(couple), "torque", units, moment))
    return table


def _power_and_shaking(forces: Forces, most: float) -> Iterator[tuple[str, str]]:
    """Power, beside the most that all could have, and what the frame feels of the links' inertia."""
    yield "power", _power_text(forces, most)
    if has_inertia(forces):
        units = forces.mechanism.units
        force, moment = forces.shaking
        strength, way = loads.polar_cells(force, units, "force")
        degree, unit, by = (display_unit(kind, units)[0] for kind in ("angle", "force", "torque"))
        turned = f" at {way} {degree}" if way else ""
        moved = format_quantity(float(moment), "torque", units, greatest_moment_and_force(forces)[0])
        yield "shaking", f"{strength} {unit}{turned} and {moved} {by} about the frame's origin, on the frame"


def _power_text(forces: Forces, most: float) -> str:
    supplied, taken = float(forces.power_in), float(forces.power_out)
    units = forces.mechanism.units
    watt = display_unit("power", units)[0]

    def told(value: float) -> str:
        return f"{format_quantity(value, 'power', units, most)} {watt}"

    stored = sum(float(each.power) for each in forces.acting if each.kind == "inertia")
    if not np.isfinite(supplied):
        return "not determined, as what the inputs supply is not"
    if forces.proof.power is None:
        return "nothing that is loaded moves at the inputs' speeds, so that there is none"
    if has_inertia(forces):
        parts = [(supplied, "from the inputs"), (-taken, "from the loads"), (stored, "from the links' inertia")]
        if forces.friction:
            parts.append((-float(forces.heat_flow), "from friction"))
        return ", ".join(f"{told(value)} {source}" for value, source in parts)
    if supplied < -ROUNDING_RATIO * most:
        return f"the loads drive: {told(-taken)} from the loads, {told(-supplied)} taken up by the inputs"
    return f"in: {told(supplied)} from the inputs; out: {told(taken)} against the loads"


def proof_facts(forces: Forces) -> list[tuple[str, str]]:
    """How well laws are kept."""
    proof, told = forces.proof, []
    if proof.power is not None:
        told.append(f"all powers add up to nothing, {precision_text(proof.power, 'of the greatest')}")
    if proof.routes is not None:
        told.append(
            "the efforts are those by virtual power with each input alone at unit rate, "
            f"{precision_text(proof.routes, 'of what all that acts could ask for')}"
        )
    if proof.equilibrium is not None:
        told.append(f"{_balanced_links_text(forces)}, {precision_text(proof.equilibrium, 'of the greatest force')}")
    if not told:
        told.append("none: of no link all is told" if forces.undetermined else "none: nothing acts on what moves")
    return [("" if index else "proof", each) for index, each in enumerate(told)]


def _balanced_links_text(forces: Forces) -> str:
    told, moving = len(forces.bodies), len(forces.mechanism.links) - 1
    if told == moving:
        return "every link balances as a free body"
    return f"as free bodies {told} of {moving} links balance, the others feel what is not determined"


def stop_remarks(forces: Forces) -> Iterator[str]:
    """What stops carry in place of the input."""
    motions = relative_motions(forces.mechanism)
    for name, by_input in forces.stop_loads.items():
        kind = "force" if motions[name].input_kind is MeasureKind.LENGTH else "torque"
        for released, force in by_input.items():
            carried = f"the stop carries {quantity_text(force, kind, forces.mechanism.units)} in place of the input"
            result = carried if force else "the mechanism leaves the stop"
            yield f"pair {name!r} stands at its stop: if the input at {released!r} is released, {result}"


def undetermined_sentences(forces: Forces) -> tuple[str, ...]:
    """What equilibrium does not tell, with why; what has the same reason together."""
    by: dict[str, list[str]] = {}
    for name, why in forces.undetermined.items():
        by.setdefault(why, []).append(name)
    return tuple(f"not determined at {join_all_names(names)}: {why}" for why, names in by.items())


def _time_remarks(forces: Forces) -> tuple[str, ...]:
    varying = any(load.varies is not None and load.varies.input is None for load in forces.mechanism.loads)
    return ("loads that vary with time are those at 0 s",) if varying else ()


def record(
    forces: Forces,
    advantages: ratios.Advantages,
    comparisons: Sequence[Comparison] = (),
    unknown: UnknownLoad | None = None,
) -> dict[str, Any]:
    """All of it as a JSON value (SI); null for what is not determined."""
    given = forces.moving.inputs
    force, moment = forces.shaking
    found: dict[str, Any] = {
        "mechanism": forces.mechanism.name,
        "outcome": Outcome.SOLVED.value,
        "links": dict(link_numbers(forces.mechanism)),
        "inputs": {
            name: {effort_name_and_unit(forces, name)[0]: _finite_or_none(float(effort))}
            | {"position": given[name].position, "velocity": given[name].velocity}
            | {"power": _finite_or_none(float(forces.powers[name]))}
            for name, effort in forces.inputs.items()
        },
        "loads": loads.record(loads.actions_with_motion(forces, inertia=False)),
        "inertia": loads.record(loads.actions_with_motion(forces, inertia=True)),
        "reactions": {name: _reaction_record(each) for name, each in forces.reactions.items()},
        **({"motors": motors.record(duties)} if (duties := motors.motor_duties(forces)) else {}),
        **({"stops": dict(forces.stops)} if forces.stops else {}),
        **({"stop_loads": {name: dict(of) for name, of in forces.stop_loads.items()}} if forces.stop_loads else {}),
        **fixed_wheels.record(forces),
        **({"solved_for": unknown_loads.record(unknown)} if unknown is not None else {}),
        **({"shaking": {"force": force.tolist(), "moment": float(moment)}} if has_inertia(forces) else {}),
        "power": {"in": _finite_or_none(float(forces.power_in)), "out": forces.power_out},
        "advantage": ratios.record(advantages),
        **friction.record(forces),
        **cam_contacts.record(forces),
        **proof_record(forces),
        "remarks": [
            *forces.remarks,
            *cam_contacts.lift_off_remarks(forces),
            *attachment_remarks(forces.mechanism),
            *forces.moving.remarks,
        ],
    }
    if forces.others:
        found["solutions"] = [_solution_record(each) for each in forces.solutions]
    return found | ({"published": [each.record() for each in comparisons]} if comparisons else {})


def _solution_record(forces: Forces) -> dict[str, Any]:
    """One of several solutions as a JSON value: what differs between them."""
    return {
        "inputs": {
            name: {effort_name_and_unit(forces, name)[0]: _finite_or_none(float(effort))}
            for name, effort in forces.inputs.items()
        },
        "reactions": {name: _reaction_record(each) for name, each in forces.reactions.items()},
        **friction.record(forces),
        **proof_record(forces),
    }


def proof_record(forces: Forces) -> dict[str, Any]:
    """What is said of all forces together, as JSON values."""
    return {
        "undetermined": dict(forces.undetermined),
        "proof": forces.proof._asdict(),
        "bodies": list(forces.bodies),
    }


def _reaction_record(reaction: Reaction) -> dict[str, Any]:
    """What the pair does to the second of its links; where its forces have no place, its couple on every link."""
    if reaction.at is None:
        return {"links": list(reaction.links)} | {
            "couples": {link: _finite_or_none(float(couple)) for link, couple in reaction.couples.items()}
        }
    return {
        "links": list(reaction.links),
        "position": reaction.at.tolist(),
        "force": [_finite_or_none(each) for each in reaction.force.tolist()],
        "couple": _finite_or_none(float(reaction.couple)),
    }


def _finite_or_none(value: float) -> float | None:
    return value if np.isfinite(value) else None
