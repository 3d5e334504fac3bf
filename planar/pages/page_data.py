"""What a page carries of a mechanism: names and numbers as JSON, and its equations as JavaScript."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import islice
from typing import Any

import casadi as ca
import numpy as np

from planar.analysis.centres.centres import extent
from planar.analysis.centres.centrodes import usual
from planar.analysis.centres.pair_centres import primary
from planar.analysis.polygons.lettering import PARTS, PRIME, legend, small_letters
from planar.analysis.rate_equations import rates
from planar.analysis.rich_text import primed
from planar.assemblies.circuits.circuits import circuits
from planar.assemblies.modes import modes
from planar.codegen.javascript import printed
from planar.drawing.scheme.link_bodies import all_marks
from planar.drawing.scheme.springs_masses import Element
from planar.drawing.scheme.symbols import COILS
from planar.equations.functions import length, scaled, shapes
from planar.foundation.geometry import Vector
from planar.foundation.units import shown
from planar.model.dimensions import Dimension, changed, dimensions
from planar.model.link_graph import numbered
from planar.model.link_shapes import Unplaced
from planar.model.mechanism import Mechanism, counting, misfits, named_points
from planar.model.pairs import Kind, Pair
from planar.model.pairs.symbols import Mark
from planar.model.wording import amount
from planar.pages.column_data import heads, reported, starting
from planar.pages.document_data import above_zero, called, document
from planar.pages.force_data import loaded
from planar.results.motion import State
from planar.solving.position import Solver, known_of
from planar.solving.rest_position import standing

LONGEST, SHORTEST = 2.0, 0.25
"""By what a dimension can be changed on a page: from a quarter of it to twice as much."""
PROBE = 0.02
"""Of the way to its end, where a dimension is tried that may be held by a pair."""
HALVINGS = 40
MOST = 64
"""Assemblies that a page offers."""


class Numbers:
    """Numbers that depend on the dimensions, each with its place in what the page's function `sizes` gives."""

    def __init__(self, mechanism: Mechanism, live: bool = True):
        self.dimensions = list(dimensions(mechanism, frozenset(link.name for link in mechanism.links))) if live else []
        self.d = ca.SX.sym("d", len(self.dimensions))
        for k, each in enumerate(self.dimensions):
            mechanism = changed(mechanism, each, self.d[k])
        self.mechanism, self.shapes = mechanism, shapes(mechanism)
        self.values: list[Any] = []

    def place(self, value: Any) -> int:
        """The place of a number."""
        self.values.append(value)
        return len(self.values) - 1

    def spot(self, at: Vector) -> list[int]:
        """The places of x and y."""
        return [self.place(at.x), self.place(at.y)]

    def function(self) -> str:
        """sizes(d): all numbers."""
        return printed("sizes", ca.Function("sizes", [self.d], [ca.vertcat(*map(ca.SX, self.values))]))


KINDS = ("length", "angle", "velocity", "acceleration", "angular velocity", "angular acceleration")
"""Of quantities that a page shows."""


def carried(mechanism: Mechanism, z: np.ndarray | None = None) -> tuple[dict[str, Any], str]:
    """The data of a page, and its functions.

    `z` are the unknowns of an assembly; left out, that nearest to the sketch. Raises NoAnswer where the mechanism has
    no position to start from.
    """
    known = known_of(mechanism)
    solver, z = known.solver, known.assembly.z if z is None else z
    e, program, state = solver.equations, solver.program, standing(mechanism)
    named = {member: name for name, members in named_points(mechanism) for member in members}
    numbers = Numbers(mechanism)
    measured = [
        value
        for pair in numbers.mechanism.pairs
        for value in scaled(pair.measure([numbers.shapes[link] for link in pair.bodies]), pair.measures, solver.unit)
    ]
    for value in measured:
        numbers.place(value)
    data = looks(mechanism, numbers) | {
        "name": mechanism.name,
        "about": mechanism.about,
        "units": _units(mechanism),
        "column": {
            link.name: [solver.column[link.name, part] for part in ("x", "y", "angle")]
            for link in mechanism.links
            if link.name != mechanism.frame
        },
        "size": solver.unit,
        "lengths": [bool(each) for each in solver.outline.lengths],
        "unknown_angles": [e.coordinates[column].kind is not Kind.LENGTH for column in e.unknowns],
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
            for s in e.stages
        ],
        "row_lengths": [row.kind is Kind.LENGTH for row in e.rows],
        "owners": [e.coordinates[column].owner for column in e.unknowns],
        "inputs": [_input(given, solver.slides(given.pair)) for given in mechanism.inputs],
        "dimensions": [_dimension(mechanism, each, solver.unit) for each in numbers.dimensions],
        "numbers": numbered(mechanism),
        "counting": sorted(counting(mechanism)),
        "centred": _centred(state),
        **_lettered(mechanism, named),
        "rolling": list(usual(mechanism)) if len(mechanism.links) > 1 else None,
        "document": document(mechanism, numbers.dimensions),
        "columns": heads(mechanism, solver),
        "starting": starting(mechanism),
        "assemblies": _assemblies(mechanism, solver),
        "z": z.tolist(),
        "tolerance": solver.tolerance,
        "sizes": len(numbers.values),
    }
    acting = loaded(numbers.mechanism, numbers.d, state, solver.unit)
    data["forces"] = acting and acting[0]
    functions = [numbers.function(), printed("positions", program.positions), printed("kinematics", program.rates)]
    functions += [printed(f"closing{k}", program.closing(stage)) for k, stage in enumerate(e.stages)]
    functions.append(reported(mechanism, solver, numbers.d, numbers.shapes))
    stages = ",".join(f"closing{k}" for k in range(len(e.stages)))
    functions.append(acting[1] if acting else "const balance=null;")
    functions.append(f"const program={{sizes,positions,kinematics,reported,balance,stages:[{stages}]}};")
    return data, "\n".join(functions)


def _lettered(mechanism: Mechanism, named: Mapping[tuple[str, str], str]) -> dict[str, Any]:
    """The letters of polygons: of points, of guides' own points below what slides on them, and what they stand for.

    `rides` has for each slide the point that slides, the link with its guide, and that link's point's letter.
    """
    letters = small_letters(each.name for each in named_points(mechanism))
    taken, rides, below = set(letters.values()), [], {}
    for rider, guide in filter(None, (pair.rides() for pair in mechanism.pairs)):
        point = named[rider]
        own = None
        if guide != mechanism.frame:
            own = letters[point] + PRIME
            while primed(own) in taken:
                own += PRIME
            own = primed(own)
            taken.add(own)
            below[own] = guide, point
        rides.append([point, guide, own])
    kinds = {"velocity": 1, "acceleration": 2}
    legends = {kind: legend(order, below, mechanism.frame, parts=False) for kind, order in kinds.items()}
    return {"letters": letters, "rides": rides, "legends": legends | {"parts": PARTS}}


def looks(mechanism: Mechanism, numbers: Numbers) -> dict[str, Any]:
    """What a drawing of the mechanism needs: its links, points and marks, their numbers as places."""
    points = {
        name: {
            "links": [member[0] for member in members],
            "at": [numbers.spot(numbers.shapes[link].at(point)) for link, point in members],
        }
        for name, members in named_points(mechanism)
    }
    return {
        "frame": mechanism.frame,
        "links": [link.name for link in mechanism.links],
        "points": points,
        "names": list(points),
        "marks": [_mark(mark, numbers) for mark in all_marks(numbers.mechanism, numbers.shapes)],
        "coils": COILS,
    }


def drawn(mechanism: Mechanism) -> tuple[dict[str, Any], list[float]]:
    """What a drawing needs whose dimensions stay as they are, and the numbers themselves."""
    numbers = Numbers(mechanism, live=False)
    return looks(mechanism, numbers), [float(each) for each in numbers.values]


def _centred(state: State) -> list[list[str]]:
    """Every two links whose instantaneous centre a pair of theirs shows."""
    return [sorted(two) for two in primary(rates(state), *extent(state)).centres]


def _input(given: Any, slides: bool) -> dict[str, Any]:
    return {
        "pair": given.pair,
        "slides": slides,
        "position": given.position,
        "velocity": given.velocity,
        "acceleration": given.acceleration,
    }


def _units(mechanism: Mechanism) -> dict[str, Any]:
    """Of kinds of quantities as they are shown; a unit is `ratio[0] / ratio[1]` of the SI unit, `si` in one number."""
    found = {kind: shown(kind, mechanism.units) for kind in KINDS}
    return {
        kind: {"name": name, "si": of.to_si(1.0), "ratio": [of.numerator, of.denominator]}
        for kind, (name, of) in found.items()
    }


def _assemblies(mechanism: Mechanism, solver: Solver) -> dict[str, Any]:
    """The first assemblies in the order of their numbers, whether these are all, and where each lies."""
    found = modes(mechanism, certify=False)
    listed = list(islice(found, MOST + 1))
    stages = solver.equations.stages
    # of one group of two the circuits are known in some milliseconds; of others it may take a minute
    small = len(stages) <= 1 and all(length(stage.unknowns) <= 2 for stage in stages) and len(mechanism.inputs) == 1
    every = circuits(mechanism) if small else None
    lying = [every.of(mode) if every else None for mode in listed[:MOST]]
    return {
        "more": len(listed) > MOST,
        "list": [
            {
                "z": mode.z.tolist(),
                "circuit": on and [on[0].number, len(every)],
                "branch": on and [on[1].number, len(on[0].branches)],
            }
            for mode, on in zip(listed, lying, strict=False)
        ],
    }


def _dimension(mechanism: Mechanism, each: Dimension, size: float) -> dict[str, Any]:
    """A dimension with the range in which a page lets it be changed: a length stays one, a coordinate may pass zero."""
    value, part = float(each.value), each.name.rsplit(".", 1)[1]
    free = part in ("x", "y") or not value
    low, high = (value - 0.5 * size, value + 0.5 * size) if free else sorted((SHORTEST * value, LONGEST * value))
    tried = [value + PROBE * (to - value) for to in (low, high)]
    wrong = [(to, why) for to in tried if (why := _misfit(mechanism, each, to))]
    held = f"at {amount(wrong[0][0], 'length', mechanism.units)} {wrong[0][1]}" if wrong else ""
    far = (low, high) if held else tuple(_as_far(mechanism, each, value, to) for to in (low, high))
    return {
        "name": each.name,
        "link": each.link,
        "what": called(mechanism, each),
        "value": value,
        "low": far[0],
        "high": far[1],
        "bounds": [None if to == end else end for to, end in zip((low, high), far, strict=True)],
        "positive": above_zero(mechanism, each),
        "held": held,
    }


def _misfit(mechanism: Mechanism, each: Dimension, value: float) -> str:
    """What a pair has against another value of a dimension, as wheels whose radii say how far apart they are."""
    if all(type(pair).misfit is Pair.misfit for pair in mechanism.pairs):
        return ""  # none of them looks at sizes
    other = changed(mechanism, each, value)
    try:
        return next((wrong for _, wrong in misfits(other.pairs, shapes(other), other.units)), "")
    except Unplaced:
        return ""  # the page says itself how far a triangle closes


def _as_far(mechanism: Mechanism, each: Dimension, value: float, to: float) -> float:
    """How far from its value towards another one no pair has anything against a dimension."""
    if not _misfit(mechanism, each, to):
        return to
    for _ in range(HALVINGS):
        middle = 0.5 * (value + to)
        value, to = (value, middle) if _misfit(mechanism, each, middle) else (middle, to)
    return value


def _mark(mark: Mark | Element, numbers: Numbers) -> dict[str, Any]:
    """A mark with its numbers as places."""

    def told(value: Any) -> Any:
        if isinstance(value, Vector):
            return numbers.spot(value)
        if isinstance(value, tuple) and hasattr(value, "_fields"):
            return {"kind": type(value).__name__, **{name: told(part) for name, part in value._asdict().items()}}
        if isinstance(value, tuple):
            return [told(part) for part in value]
        return value if isinstance(value, str | bool) else {"at": numbers.place(value)}

    return told(mark)
