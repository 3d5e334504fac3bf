"""What a page carries of a mechanism: names and numbers as JSON, and its equations as JavaScript."""

from __future__ import annotations

from typing import Any

import casadi as ca

from planar.analysis.centres import extent
from planar.analysis.centrodes import usual
from planar.analysis.primary import primary
from planar.analysis.standing import standing
from planar.analysis.ties import rates
from planar.dimensions import Dimension, changed, dimensions
from planar.drawing.bodies import all_marks
from planar.graph import numbered
from planar.mechanism import Mechanism, counting, named_points
from planar.pages.script import printed
from planar.pairs import Kind
from planar.pairs.marks import Mark
from planar.plane import Vector
from planar.program import scaled, shapes
from planar.solving.position import known_of
from planar.units import unit

LONGEST, SHORTEST = 2.0, 0.25
"""By what a dimension can be changed on a page: from a quarter of it to twice as much."""


class Numbers:
    """Numbers that depend on the dimensions, each with its place in what the page's function `sizes` gives."""

    def __init__(self, mechanism: Mechanism):
        self.dimensions = list(dimensions(mechanism, frozenset(link.name for link in mechanism.links)))
        self.d = ca.SX.sym("d", len(self.dimensions))
        for k, each in enumerate(self.dimensions):
            mechanism = changed(mechanism, each, self.d[k])
        self.mechanism, self.shapes = mechanism, shapes(mechanism)
        self.values: list[ca.SX] = []

    def place(self, value: Any) -> int:
        """The place of a number."""
        self.values.append(ca.SX(value))
        return len(self.values) - 1

    def spot(self, at: Vector) -> list[int]:
        """The places of x and y."""
        return [self.place(at.x), self.place(at.y)]

    def function(self) -> str:
        """sizes(d): all numbers."""
        return printed("sizes", ca.Function("sizes", [self.d], [ca.vertcat(*self.values)]))


def carried(mechanism: Mechanism) -> tuple[dict[str, Any], str]:
    """The data of a page, and its functions.

    Raises NoAnswer where the mechanism has no position to start from.
    """
    known = known_of(mechanism)
    solver, z = known.solver, known.assembly.z
    e, program = solver.equations, solver.program
    numbers = Numbers(mechanism)
    measured = [
        value
        for pair in numbers.mechanism.pairs
        for value in scaled(pair.measure([numbers.shapes[link] for link in pair.bodies]), pair.measures, solver.unit)
    ]
    for value in measured:
        numbers.place(value)
    points = {
        name: {
            "links": [member[0] for member in members],
            "at": [numbers.spot(numbers.shapes[link].at(point)) for link, point in members],
        }
        for name, members in named_points(mechanism)
    }
    named = {member: name for name, members in named_points(mechanism) for member in members}
    marks = [_mark(mark, numbers) for mark in all_marks(numbers.mechanism, numbers.shapes)]
    data = {
        "name": mechanism.name,
        "about": mechanism.about,
        "units": _units(mechanism),
        "frame": mechanism.frame,
        "links": [link.name for link in mechanism.links],
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
            {"z": [s.unknowns.start, s.unknowns.stop], "F": [s.rows.start, s.rows.stop], "links": list(s.links)}
            for s in e.stages
        ],
        "inputs": [_input(given, solver.slides(given.pair)) for given in mechanism.inputs],
        "dimensions": [_dimension(each, solver.unit) for each in numbers.dimensions],
        "points": points,
        "numbers": numbered(mechanism),
        "counting": sorted(counting(mechanism)),
        "centred": _centred(mechanism),
        "rides": [[named[rider], guide] for rider, guide in filter(None, (pair.rides() for pair in mechanism.pairs))],
        "rolling": list(usual(mechanism)) if len(mechanism.links) > 1 else None,
        "marks": marks,
        "z": z.tolist(),
        "tolerance": solver.tolerance,
        "sizes": len(numbers.values),
    }
    functions = [numbers.function(), printed("positions", program.positions), printed("kinematics", program.rates)]
    functions += [printed(f"closing{k}", program.closing(stage)) for k, stage in enumerate(e.stages)]
    stages = ",".join(f"closing{k}" for k in range(len(e.stages)))
    functions.append(f"const program={{sizes,positions,kinematics,stages:[{stages}]}};")
    return data, "\n".join(functions)


def _input(given: Any, slides: bool) -> dict[str, Any]:
    return {
        "pair": given.pair,
        "slides": slides,
        "position": given.position,
        "velocity": given.velocity,
        "acceleration": given.acceleration,
    }


def _centred(mechanism: Mechanism) -> list[list[str]]:
    """Every two links whose instantaneous centre a pair of theirs shows."""
    state = standing(mechanism)
    return [sorted(two) for two in primary(rates(state), *extent(state)).centres]


def _units(mechanism: Mechanism) -> dict[str, Any]:
    return {kind: {"name": name, "si": unit(name).to_si(1.0)} for kind, name in mechanism.units._asdict().items()}


def _dimension(each: Dimension, size: float) -> dict[str, Any]:
    """A dimension with the range in which a page lets it be changed: a length stays one, a coordinate may pass zero."""
    value = float(each.value)
    part = each.name.rsplit(".", 1)[1]
    free = part in ("x", "y")
    low, high = (
        (value - 0.5 * size, value + 0.5 * size) if free or not value else sorted((SHORTEST * value, LONGEST * value))
    )
    return {"name": each.name, "value": value, "low": low, "high": high}


def _mark(mark: Mark, numbers: Numbers) -> dict[str, Any]:
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
