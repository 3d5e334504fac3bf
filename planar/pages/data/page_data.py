"""What a page carries of a mechanism: names and numbers as JSON, and its equations as JavaScript."""

from __future__ import annotations

from functools import lru_cache
from itertools import islice
from typing import Any

import numpy as np

from planar.analysis.centres.centrodes import usual_links
from planar.assemblies.circuits.circuits import Circuits, circuits
from planar.assemblies.modes import Mode, modes
from planar.document.dimensions import Dimension, change_dimension
from planar.drawing.scheme.link_bodies import outline_point_names
from planar.equations.mechanism_numbers import scale_lengths, shapes_of_links
from planar.equations.structure_formulas import StructureFormulas
from planar.equations.symbolic_equations import slice_length
from planar.foundation.time_limit import stop_if_over
from planar.model.link_graph import link_numbers
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import (
    Mechanism,
    check_link_count,
    links_counting_turns,
    named_points,
    pair_misfits,
    unit_input_rate,
    unit_rate_note,
)
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import amount, sentence
from planar.pages.data.centre_data import centre_data
from planar.pages.data.column_data import column_heads, reported_function, uncounted_angles
from planar.pages.data.dimension_numbers import DimensionNumbers
from planar.pages.data.document_data import dimension_words, document_data, is_positive_length
from planar.pages.data.force_data import force_data
from planar.pages.data.polygon_data import polygon_data
from planar.pages.data.scheme_data import motion_positions, scheme_data
from planar.pages.data.stop_data import stop_data, stop_position_function
from planar.pages.data.tolerance_data import tolerance_data
from planar.pages.data.unit_data import unit_choices, unit_data
from planar.pages.javascript import write_javascript
from planar.solving.position import PositionSolver, rest_position, solve, solved_mechanism

MAX_DIMENSION_RATIO, MIN_DIMENSION_RATIO = 2.0, 0.25
"""By what a dimension can be changed on a page: from a quarter of it to twice as much."""
PROBE_RATIO = 0.02
"""Of the way to its end, where a dimension is tried that may be held by a pair."""
MAX_HALVINGS = 40
MAX_ASSEMBLIES = 64
"""Assemblies that a page offers."""
MAX_PAGE_LINKS = 400
"""Of more links a page would be tens of megabytes, most of it their centres."""
MAX_CACHED_PAGES = 16
"""Mechanisms whose data is kept: an answer, the page and a notebook's output ask for it one after the other."""


def page_data(mechanism: Mechanism, z: np.ndarray | None = None) -> tuple[dict[str, Any], str]:
    """Return the data of a page, and its functions. Entries may be added to the data; those returned are shared.

    `z` are the unknowns of an assembly; left out, that nearest to the sketch. Raises NoAnswer where the mechanism has
    no position to start from, or does not move.
    """
    if z is not None or not _is_hashable(mechanism):
        return _computed_page_data(mechanism, z)
    data, functions = _cached_page_data(mechanism)
    return dict(data), functions


def _is_hashable(mechanism: Mechanism) -> bool:
    """Whether a mechanism has a hash; one that is made in Python of lists has none."""
    try:
        hash(mechanism)
    except TypeError:
        return False
    return True


@lru_cache(maxsize=MAX_CACHED_PAGES)
def _cached_page_data(mechanism: Mechanism) -> tuple[dict[str, Any], str]:
    """The data of a page at the assembly nearest to the sketch."""
    return _computed_page_data(mechanism, None)


# long: one record after the other, as the scripts read them
def _computed_page_data(mechanism: Mechanism, z: np.ndarray | None) -> tuple[dict[str, Any], str]:
    """Compute the data of a page, and its functions."""
    check_link_count(mechanism, MAX_PAGE_LINKS, "a page", "`planar plot` draws a mechanism of any size")
    stop_if_over("before the mechanism was solved")
    known = solved_mechanism(mechanism)
    solver, z = known.solver, known.assembly.z if z is None else z
    e, program, state = solver.equations, solver.functions, rest_position(mechanism)
    if 0 < state.mobility < len(mechanism.inputs):
        solve(mechanism)  # refuses inputs that contradict one another; a structure is shown as it stands
    # other lengths might agree less than the file allows, and some pairs take plain numbers alone
    is_live = not e.open_rows and all(pair.measures_symbols for pair in mechanism.pairs)
    numbers = DimensionNumbers(mechanism, live=is_live)
    measured = [
        value
        for pair in numbers.mechanism.pairs
        for value in scale_lengths(
            pair.measure([numbers.shapes[link] for link in pair.bodies]), pair.number_kinds, solver.unit
        )
    ]
    measured += solver.inputs.p[len(measured) :].tolist()  # what the misfits count
    for value in measured:
        numbers.add(value)
    scheme, drawing = scheme_data(mechanism, numbers, motion_positions(mechanism, z))
    named = _point_data(mechanism, numbers)
    tolerances = tolerance_data(mechanism, numbers.dimensions)
    data = named | {
        "scheme": scheme,
        "name": mechanism.name,
        "about": mechanism.about,
        **unit_data(mechanism.units),
        "unit_choices": unit_choices(mechanism.units),
        "column": {
            link.name: [solver.column[link.name, part] for part in ("x", "y", "angle")]
            for link in mechanism.links
            if link.name != mechanism.frame
        },
        "size": solver.unit,
        "lengths": [bool(each) for each in solver.structure.is_length],
        "unknown_angles": [e.coordinates[column].kind is not MeasureKind.LENGTH for column in e.unknowns],
        "counts": {
            "z": len(e.unknowns),
            "u": len(mechanism.inputs),
            "p": len(measured),
            "w": len(e.coordinates),
            "F": len(e.rows),
        },
        "stages": [
            {
                "z": [s.unknowns.start, s.unknowns.stop],
                "F": [s.rows.start, s.rows.stop],
                "links": list(s.links),
                "beside": sorted({link for pair in s.pairs for link in solver.pairs[pair].links}),
            }
            for s in e.blocks
        ],
        "row_lengths": [row.kind is MeasureKind.LENGTH for row in e.rows],
        "owners": [e.coordinates[column].owner for column in e.unknowns],
        "inputs": [_input_data(given, solver.is_sliding(given.pair)) for given in mechanism.inputs],
        "running": _starting_input(mechanism),
        "unit_rates": _unit_rates(mechanism),
        "dimensions": [
            {**_dimension_data(mechanism, each, solver.unit), "tolerance": tolerance}
            for each, tolerance in zip(numbers.dimensions, tolerances.dimensions, strict=True)
        ],
        "other_tolerances": tolerances.others,
        "numbers": link_numbers(mechanism),
        "counting": sorted(links_counting_turns(mechanism)),
        "centres": centre_data(state, named["points"]),
        "polygons": polygon_data(mechanism, named["points"]),
        "rolling": list(usual_links(mechanism)) if len(mechanism.links) > 1 else None,
        "document": document_data(mechanism, numbers.dimensions),
        "columns": column_heads(mechanism, solver),
        "starting": uncounted_angles(mechanism),
        "assemblies": _assembly_data(mechanism, solver),
        "z": z.tolist(),
        "fixed": solved_mechanism(mechanism).motion_refusal() is not None,
        "tolerance": solver.tolerance,
        "stops": stop_data(solver),
        "sizes": len(numbers.values),
    }
    stop_if_over("before the forces of the page were set up")
    acting = force_data(numbers, mechanism, state, solver.unit)
    data["forces"] = acting and acting[0]
    formulas = StructureFormulas(program.equations)
    functions = [
        numbers.to_javascript(),
        drawing.to_javascript(),
        write_javascript("positions", formulas.coordinate_function),
        write_javascript("kinematics", formulas.dense_kinematics_function),
    ]
    functions += [write_javascript(f"closing{k}", formulas.block_function(stage)) for k, stage in enumerate(e.blocks)]
    functions.append(reported_function(mechanism, solver, numbers.d, numbers.shapes))
    functions.append(stop_position_function(solver, numbers.d, numbers.shapes))
    stages = ",".join(f"closing{k}" for k in range(len(e.blocks)))
    functions.append(acting[1] if acting else "const balance=null;")
    functions.append(f"const program={{sizes,drawn,positions,kinematics,reported,stopping,balance,stages:[{stages}]}};")
    return data, "\n".join(functions)


def _point_data(mechanism: Mechanism, numbers: DimensionNumbers) -> dict[str, Any]:
    """The links and the points of a mechanism, their numbers as places; points of outlines are marked as such."""
    outlines = outline_point_names(mechanism, shapes_of_links(mechanism))
    points = {
        name: {
            "links": [member[0] for member in members],
            "at": [numbers.add_point(numbers.shapes[link].position(point)) for link, point in members],
            **({"is_outline": True} if name in outlines else {}),
        }
        for name, members in named_points(mechanism)
    }
    return {
        "frame": mechanism.frame,
        "links": [link.name for link in mechanism.links],
        "points": points,
        "names": list(points),
    }


def _input_data(given: Any, slides: bool) -> dict[str, Any]:
    return {
        "pair": given.pair,
        "slides": slides,
        "position": given.position,
        "velocity": given.velocity,
        "acceleration": given.acceleration,
    }


def _starting_input(mechanism: Mechanism) -> int:
    """The number of the input that runs at first: the first that has a rate or a law, else the first."""
    moving = (driven.velocity or driven.acceleration or driven.law is not None for driven in mechanism.inputs)
    return next((number for number, is_moving in enumerate(moving) if is_moving), 0)


def _unit_rates(mechanism: Mechanism) -> list[dict[str, Any]] | None:
    """The unit rate (SI) of every input with the sentence on it; None where inputs move by laws, or nothing moves.

    A page uses that of the input that runs while all rates of the inputs are zero.
    """
    has_laws = any(driven.law is not None for driven in mechanism.inputs)
    if has_laws or solved_mechanism(mechanism).motion_refusal() is not None:
        return None
    return [
        {"velocity": unit_input_rate(mechanism, driven.pair), "note": sentence(unit_rate_note(mechanism, driven.pair))}
        for driven in mechanism.inputs
    ]


def _assembly_data(mechanism: Mechanism, solver: PositionSolver) -> dict[str, Any]:
    """The first assemblies in the order of their numbers, whether these are all, and where each lies."""
    if solver.equations.open_rows:  # by least misfit, of which assemblies are not listed
        return {"more": False, "list": []}
    found = modes(mechanism, certify=False)
    listed = list(islice(found, MAX_ASSEMBLIES + 1))
    stages = solver.equations.blocks
    # of one group of two the circuits are known in some milliseconds; of others it may take a minute
    small = (
        len(stages) <= 1 and all(slice_length(stage.unknowns) <= 2 for stage in stages) and len(mechanism.inputs) == 1
    )
    # a rack goes on without end, and comes back nowhere
    goes_on = any(pair.counts_turns and MeasureKind.LENGTH in pair.residual_kinds for pair in mechanism.pairs)
    runs = small and not goes_on and solved_mechanism(mechanism).motion_refusal() is None
    every = circuits(mechanism) if runs else None
    return {
        "more": len(listed) > MAX_ASSEMBLIES,
        "list": [
            {"z": mode.z.tolist(), "beyond_stop": mode.is_beyond_stop, **_location_data(mode, every)}
            for mode in listed[:MAX_ASSEMBLIES]
        ],
    }


def _location_data(mode: Mode, every: Circuits | None) -> dict[str, Any]:
    """The circuit and the branch of an assembly, each with how many there are; null where that is not known."""
    on = every.of(mode) if every else None
    if not every or on is None:
        return {"circuit": None, "branch": None}
    circuit, branch = on
    return {"circuit": [circuit.number, len(every)], "branch": [branch.number, len(circuit.branches)]}


def _dimension_data(mechanism: Mechanism, each: Dimension, size: float) -> dict[str, Any]:
    """A dimension with the range in which a page lets it be changed: a length stays one, a coordinate may pass zero."""
    value, part = float(each.value), each.name.rsplit(".", 1)[1]
    free = part in ("x", "y") or not value
    low, high = (
        (value - 0.5 * size, value + 0.5 * size)
        if free
        else sorted((MIN_DIMENSION_RATIO * value, MAX_DIMENSION_RATIO * value))
    )
    tried = [value + PROBE_RATIO * (to - value) for to in (low, high)]
    wrong = [(to, why) for to in tried if (why := _misfit(mechanism, each, to))]
    held = f"at {amount(wrong[0][0], 'length', mechanism.units)} {wrong[0][1]}" if wrong else ""
    far = (low, high) if held else tuple(_admissible_bound(mechanism, each, value, to) for to in (low, high))
    return {
        "name": each.name,
        "link": each.link,
        "what": dimension_words(mechanism, each),
        "value": value,
        "low": far[0],
        "high": far[1],
        "bounds": [None if to == end else end for to, end in zip((low, high), far, strict=True)],
        "positive": is_positive_length(mechanism, each),
        "held": held,
    }


def _misfit(mechanism: Mechanism, each: Dimension, value: float) -> str:
    """What a pair has against another value of a dimension, as wheels whose radii say how far apart they are."""
    if all(type(pair).find_misfit is Pair.find_misfit for pair in mechanism.pairs):
        return ""  # none of them looks at sizes
    other = change_dimension(mechanism, each, value)
    try:
        return next((wrong for _, wrong in pair_misfits(other.pairs, shapes_of_links(other), other.units)), "")
    except PointPlacementError:
        return ""  # the page says itself how far a triangle closes


def _admissible_bound(mechanism: Mechanism, each: Dimension, value: float, to: float) -> float:
    """How far from its value towards another one no pair has anything against a dimension."""
    if not _misfit(mechanism, each, to):
        return to
    for _ in range(MAX_HALVINGS):
        middle = 0.5 * (value + to)
        value, to = (value, middle) if _misfit(mechanism, each, middle) else (middle, to)
    return value
