"""What is told of a mechanism while it is drawn: how it moves, what is loose or held twice, what is in conflict."""

from __future__ import annotations

from itertools import islice
from typing import Any

import numpy as np

from planar.analysis.identity.mobility import closed_position, mobility
from planar.assemblies.conflict import conflict
from planar.document.files import from_dict
from planar.equations.coordinates import frames_from_coordinates
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.units import parse_unit
from planar.model.file_units import display_unit
from planar.model.mechanism import Mechanism
from planar.model.pairs.cams.lift_law import rise_motions
from planar.model.wording import count_phrase, join_all_names, quote_names
from planar.pages.data.page_data import page_data
from planar.solving.assembly.nearest_assembly import AssemblySearchFailure
from planar.solving.full_constraints import FullConstraints
from planar.solving.position import PositionSolver, solved_mechanism

LOOSE_TOLERANCE = 1e-9
"""Of a free motion of one: coordinates that move by less stand still."""
USUAL_AMOUNTS = {"force": 100.0, "mass": 1.0, "stiffness": 1000.0}
"""SI, before somebody says how much it is."""
MAX_REMEDIES = 3
"""Changes of one number that are told where it does not go together."""
BACKDROP = {
    "planar": 1,
    "name": "Mechanism",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {"frame": {"points": {"O": [0, 0]}}},
    "pairs": [],
}
"""What stands on the page where nothing is drawn yet that can be solved."""
BLANK = {**BACKDROP, "links": {"frame": {"points": {}}}}
"""What is drawn on where no model is named."""


def edit_answer(value: Any) -> dict[str, Any]:
    """What the page is told of a file's JSON value.

    `problem` is a sentence, empty where it moves, `place` its JSON path; `mobility` says in words how it can move,
    `loose` are the links that inputs leave free; `conflicts`: whether `conflict_answer` has more to say. `data` and
    `functions` are those of a page, where there is a position; `units` the metres and radians of the file's units,
    `usual` what is drawn of a force, a mass, a stiffness at first: a number and its unit; `rises` the motions of a
    cam's lift.
    """
    answer, mechanism = file_answer(value)
    if mechanism is None:
        return answer
    try:
        if mechanism.inputs:
            solved_mechanism(mechanism).check_motion()
        data, functions = page_data(mechanism)
    except BadInput as problem:
        return answer | {"problem": problem.sentence, "place": problem.place}
    except NoAnswer as problem:
        if problem.outcome is Outcome.CANNOT_BE_ASSEMBLED:
            return answer | {"problem": problem.outcome.value, "conflicts": True}
        freedom = {"mobility": _mobility_words(mechanism), "loose": loose_links(mechanism)}
        return answer | freedom | {"problem": str(problem)}
    shown = {"window": None, "layers": ["paths"], "wanted": None, "edited": None}
    return answer | {"mobility": _mobility_words(mechanism), "data": data | shown, "functions": functions}


def file_answer(value: Any) -> tuple[dict[str, Any], Mechanism | None]:
    """The part of `edit_answer` that is read from the file without computing, and the mechanism if it is one."""
    answer: dict[str, Any] = {"problem": "", "place": "", "mobility": "", "loose": [], "remedies": []}
    answer["rises"] = rise_motions()
    try:
        mechanism = from_dict(value)
    except BadInput as problem:
        return answer | {"problem": problem.sentence, "place": problem.place}, None
    return answer | {"units": _units(mechanism), "usual": _usual_amounts(mechanism)}, mechanism


def loose_links(mechanism: Mechanism) -> list[str]:
    """The links that can still move while the inputs stand still; none where it cannot be assembled."""
    known = solved_mechanism(mechanism)
    if known.plain_solver.equations.open_rows:
        return []
    constraints = FullConstraints(known.plain_solver)
    try:
        place = closed_position(known, constraints)
    except NoAnswer:
        return []
    free = constraints.free_motions(place, tuple(given.pair for given in mechanism.inputs))
    names = {link.name for link in mechanism.links}
    moved = np.abs(free).max(axis=1, initial=0.0) > LOOSE_TOLERANCE
    return list(
        dict.fromkeys(
            each.owner
            for each, moves in zip(constraints.coordinates, moved, strict=True)
            if moves and each.owner in names
        )
    )


def _mobility_words(mechanism: Mechanism) -> str:
    """How it moves, against its inputs, and what is held twice."""
    try:
        found = mobility(mechanism)
    except NoAnswer:
        return ""
    told = [f"mobility {found.finite}, {count_phrase(len(mechanism.inputs), 'input')}"]
    if found.redundant:
        told.append(f"held twice: {join_all_names([quote_names(each) for each in found.redundant])}")
    return "; ".join(told)


def conflict_answer(value: Any) -> dict[str, Any]:
    """What is in conflict in a file that does not go together, and the least changes of one number that mend it.

    `problem` is how far it stays open, `remedies` are in sentences, none where nothing in conflict was found, `nearest`
    tells where it is nearest to going together (`nearest_places`). It takes a search. Raises BadInput, NoAnswer.
    """
    mechanism = from_dict(value)
    why = ""
    try:
        known = solved_mechanism(mechanism).assembly
    except NoAnswer as problem:
        known, why = None, str(problem)
    if known is not None:
        return {"problem": "", "remedies": [], "nearest": {}}
    told = {"problem": why, "remedies": [], "nearest": nearest_places(mechanism)}
    found = conflict(mechanism)
    if found is None:
        return told
    changes = islice((*found.dimensions, *found.positions), MAX_REMEDIES)
    mended = (f"it goes together with {each.name} = {each.shown}" for each in changes)
    return told | {"remedies": [found.remarks[0], *mended]}


def nearest_places(mechanism: Mechanism) -> dict[str, dict[str, list[float]]]:
    """Where the points of links lie (m) where a mechanism that does not go together is nearest to it.

    {link: {point: [x, y]}}: a pin that stays open has a place of its own in each of its links. Links that hang on what
    stays open are left out; all are where it goes together, or is loose.
    """
    solver = PositionSolver(mechanism)
    try:
        found = solver.nearest()
    except NoAnswer:
        return {}
    if not isinstance(found, AssemblySearchFailure):
        return {}
    w = solver.functions.coordinates(found.z, solver.inputs.u, solver.inputs.p) * solver.scale
    frames, _ = frames_from_coordinates(w.tolist(), solver.column, solver.shapes, {})
    later = {link for block in solver.equations.blocks[found.stage.block_index + 1 :] for link in block.links}
    return {
        link: {name: list(frames[link].to_world(at)) for name, at in shape.points.items()}
        for link, shape in solver.shapes.items()
        if link not in later
    }


def _usual_amounts(mechanism: Mechanism) -> dict[str, tuple[float, str]]:
    """A round number of the unit in which each is shown, and that unit."""
    found = {}
    for kind, value in USUAL_AMOUNTS.items():
        name, unit = display_unit(kind, mechanism.units)
        found[kind] = float(f"{unit.from_si(value):.1g}"), name
    return found


def _units(mechanism: Mechanism) -> dict[str, float]:
    return {kind: parse_unit(getattr(mechanism.units, kind)).to_si(1.0) for kind in ("length", "angle")}
