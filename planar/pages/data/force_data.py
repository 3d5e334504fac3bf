"""What a page carries to find forces: a mechanism's balance as JavaScript, and what stands in which row of it."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import permutations
from typing import Any

import casadi as ca

from planar.analysis.motion.mechanical_advantage import loaded_outputs
from planar.document.dimensions import change_dimensions
from planar.drawing.forces.action_arrows import ActionSymbol, action_symbols, reaction_symbols
from planar.dynamics.forces import forces
from planar.dynamics.lagrangian import LagrangianFunctions
from planar.dynamics.load_attachment import attachment_remarks
from planar.dynamics.reaction_solver import bearing_point
from planar.dynamics.virtual_velocities import has_length_motion
from planar.foundation.errors import NoAnswer
from planar.model.link_graph import link_numbers
from planar.model.loads import Course, Load, Spring
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import Pair
from planar.pages.data.action_parameters import action_parameters, parameter_data
from planar.pages.data.balance_rows import BalanceRows
from planar.pages.data.dimension_numbers import DimensionNumbers
from planar.pages.data.friction_data import contact_data
from planar.pages.javascript import write_javascript
from planar.reports.tables.forces.position_forces import undetermined_sentences
from planar.results.motion import State


def force_data(
    numbers: DimensionNumbers, filed: Mechanism, state: State, unit: float
) -> tuple[dict[str, Any], str] | None:
    """The data and the function of the forces; None where nothing acts.

    Of a mechanism with its dimensions as symbols, as it is `filed` and stands in its file (`state`), and its size
    `unit` (m). The numbers of what acts are symbols too, after the dimensions; `parameters` has them.
    """
    mechanism, d = numbers.mechanism, numbers.d
    if not (mechanism.loads or mechanism.masses or mechanism.springs):
        return None
    parameters = list(action_parameters(filed))
    symbols = ca.SX.sym("f", len(parameters))
    mechanism = change_dimensions(mechanism, ((parameter, symbols[k]) for k, parameter in enumerate(parameters)))
    work = LagrangianFunctions(mechanism, unit)
    rows = BalanceRows(work)
    slopes = ca.jacobian(work.residuals, work.q)
    first, pairs = 0, []
    for pair in mechanism.pairs:
        last = first + len(pair.residual_kinds)
        pairs.append(_pair_data(pair, rows, rows.add(slopes[first:last, :])))
        first = last
    data = {
        "links": list(work.links),
        "coordinates": work.q.numel(),
        "pairs": pairs,
        "inputs": [
            _input_data(
                given.pair,
                rows,
                rows.add(work.unit_effort_on_links(given.pair).T)[0],
                has_length_motion(mechanism, given.pair),
            )
            for given in mechanism.inputs
        ],
        "acting": list(_action_data(rows)),
        "advantages": list(_advantage_data(rows, state)),
        "contacts": list(contact_data(rows, state)),
        "springs": [_spring_angle_data(work, spring) for spring in mechanism.springs],
        "wheels": list(_fixed_wheel_data(rows)),
        "massive": bool(mechanism.masses),
        "timed": any(load.varies is not None and load.varies.input is None for load in mechanism.loads),
        "untold": _undetermined_sentences(state),
        "choices": list(attachment_remarks(mechanism)),
        "parameters": [parameter_data(each, filed, parameters) for each in parameters],
    }
    data["symbols"] = _symbol_data(mechanism, data)
    data["inertia"] = rows.add(work.inertia.T)[0]
    table = ca.vertcat(*rows.rows)
    data["row"], data["column"] = (list(each) for each in table.sparsity().get_triplet())
    told = ca.vertcat(table.nz[:], *rows.places)
    given = [work.q, work.q1, work.q2, work.factors, work.spring_turns, ca.vertcat(d, symbols)]
    data |= {"rows": rows.count, "told": told.numel()}
    return data, write_javascript("balance", ca.Function("balance", given, [told]))


def _symbol_data(mechanism: Mechanism, data: Mapping[str, Any]) -> dict[str, Any]:
    """The letters of force and couple, each with its index, by kind, name and link that feels them."""
    number = link_numbers(mechanism)
    found: dict[str, Any] = {"reaction": {}}
    for pair in mechanism.pairs:
        felt = {link: reaction_symbols(number[link], number[other]) for link, other in permutations(pair.links)}
        found["reaction"][pair.name] = {link: _plain_symbols(both) for link, both in felt.items()}
    inputs = [("input", given["pair"], (given["on"], given["against"])) for given in data["inputs"]]
    acting = [(each["kind"], each["name"], [link for link, _ in each["on"]]) for each in data["acting"]]
    for kind, name, links in (*inputs, *acting):
        of = found.setdefault(kind, {}).setdefault(name, {})
        of |= {link: _plain_symbols(action_symbols(kind, name, link, number)) for link in links}
    return found


def _plain_symbols(symbols: Iterable[ActionSymbol]) -> list[tuple[str, str]]:
    return [(each.base, each.subscript) for each in symbols]


def _pair_data(pair: Pair, rows: BalanceRows, held: list[int]) -> dict[str, Any]:
    work, own = rows.work, rows.work.own_slices[pair.name]
    contact = pair.tooth_contact(work.frames, work.shapes, rows.mechanism.pairs)
    end = bearing_point(pair)
    at = contact.pitch_point if contact is not None else None
    if at is None and end is not None:
        at = rows.point_in_world(*end)
    return {
        "name": pair.name,
        "links": list(pair.links),
        "bodies": list(dict.fromkeys(pair.bodies)),
        "rows": held,
        "own": [own.start, own.stop],
        "at": None if at is None else rows.add_place(at),
        "contact": contact
        and {
            "along": rows.add_contact_force(pair, contact, contact.drive_direction),
            "apart": rows.add_contact_force(pair, contact, contact.separation_direction),
            "slope": float(contact.pressure_tangent),
        },
        # only couples are known, not what forces they come from
        "unshared": pair.ties_angles and contact is None,
    }


def _fixed_wheel_data(rows: BalanceRows) -> Iterator[dict[str, Any]]:
    """The pairs of wheels that belong to the frame, with the centre of each wheel, as in `reactions.fixed_wheels`."""
    mechanism = rows.mechanism
    for pair in mechanism.pairs:
        centres = pair.wheel_centres(mechanism.pairs)
        if mechanism.frame in centres:
            point = centres[mechanism.frame]
            at = None if point is None else rows.add_place(rows.point_in_world(mechanism.frame, point))
            yield {"frame": mechanism.frame, "centre": point, "at": at, "pair": pair.name}


def _input_data(name: str, rows: BalanceRows, row: int, slide: bool) -> dict[str, Any]:
    """How an input acts, and where: on one link, and the opposite on another."""
    pair = relative_motions(rows.mechanism)[name]
    way, end = pair.effort_action(rows.work.frames, rows.work.shapes), bearing_point(pair)
    if way.point is not None:
        at = rows.add_place(way.point)
    elif end is not None:
        at = rows.add_place(rows.point_in_world(*end))
    else:
        at = rows.add_origin(way.link)
    return {"pair": name, "row": row, "slides": slide, "on": way.link, "against": way.reaction_link, "at": at}


def _action_data(rows: BalanceRows) -> Iterator[dict[str, Any]]:
    """Every load, weight and spring, in the order of `collect_actions`: its row, and its places on links."""
    work, mechanism = rows.work, rows.mechanism
    row, _ = rows.add(work.actions_on_links.T)
    for load in mechanism.loads:
        on = _loaded_links(load, rows)
        yield {
            "kind": "load",
            "name": load.target,
            "row": row,
            "on": list(on.items()),
            "course": _load_law_data(load.varies, mechanism),
        }
        row += 1
    for mass in mechanism.masses:
        yield {
            "kind": "weight",
            "name": mass.link,
            "row": row,
            "on": [(mass.link, rows.add_place(work.mass_centre(mass)))],
        }
        row += 1
    for number, spring in enumerate(mechanism.springs, start=1):
        if spring.is_torsional:
            ends = [(link, rows.add_origin(link)) for link in spring.ends]
        else:
            hung = [work.attachments[end] for end in spring.ends]
            ends = [(each.link, rows.add_place(work.attachment_position(each))) for each in hung]
        yield {"kind": "spring", "name": str(number), "row": row, "on": ends}
        row += 1


def _advantage_data(rows: BalanceRows, state: State) -> Iterator[dict[str, Any]]:
    """What `advantages` lists: each with the rows of the unit loads whose power is the output's rate.

    Of a point there are two rows, along x and y, of which the rate is the speed along its path.
    """
    mechanism = rows.mechanism
    for name, index in loaded_outputs(state).items():
        load, along = mechanism.loads[index], ""
        if name != load.target:
            along = name
            numbers = load.force if load.force is not None else (load.torque, load.effort)
            size = ca.sqrt(sum(number**2 for number in numbers if number is not None))
            units = [load.scaled(1.0 / size)]
        elif load.point is not None:
            along, units = "path", [Load(point=name, force=way) for way in ((1.0, 0.0), (0.0, 1.0))]
        elif load.link is not None:
            units = [Load(link=name, torque=1.0)]
        else:
            along, units = "line" if load.points else "", [load._replace(effort=1.0)]
        is_length = load.link is None and (load.pair is None or has_length_motion(mechanism, load.pair))
        first_row = rows.add(ca.horzcat(*map(rows.work.load_on_links, units)).T)
        yield {"output": load.target, "along": along, "rows": first_row, "length": is_length}


def _loaded_links(load: Load, rows: BalanceRows) -> Mapping[str, int]:
    """The links on which a load acts, each with the place."""
    on: dict[str, int] = {}
    for point in (load.point, *(load.points or ())):
        if point is not None:
            at = rows.work.attachments[point]
            on[at.link] = rows.add_place(rows.work.attachment_position(at))
    if load.link is not None:
        on.setdefault(load.link, rows.add_origin(load.link))
    if load.pair is not None:
        way = _input_data(load.pair, rows, -1, False)
        on = {way["on"]: way["at"], way["against"]: way["at"]} | on
    return on


def _load_law_data(course: Course | None, mechanism: Mechanism) -> dict[str, Any] | None:
    if course is None:
        return None
    names = [given.pair for given in mechanism.inputs]
    return {
        "input": None if course.input is None else names.index(course.input),
        "turns": course.input is not None and not has_length_motion(mechanism, course.input),
        "at": list(course.at),
        "factors": list(course.factors),
    }


def _spring_angle_data(work: LagrangianFunctions, spring: Spring) -> dict[str, Any] | None:
    """Of a spring that turns: the coordinates of its links' angles, and off which angle it is wound up the least."""
    if not spring.is_torsional:
        return None
    return {
        "angles": [work.link_columns[end] + 2 if end in work.link_columns else None for end in spring.ends],
        "free": spring.free,
    }


def _undetermined_sentences(state: State) -> list[str]:
    """What equilibrium does not tell as the file has it, in sentences."""
    try:
        return list(undetermined_sentences(forces(state, friction=False)))
    except NoAnswer as refused:
        return [str(refused)]
