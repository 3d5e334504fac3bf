"""A fitted design as a mechanism: its numbers, its input at the first entry, and its joints there as the sketch."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import ceil, log10

import casadi as ca

from planar.derivatives.design_equations import DesignEquations
from planar.document.dimensions import file_dimensions
from planar.document.revised.changed_numbers import with_values
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array
from planar.model.file_units import FileUnits, unit_of_kind
from planar.model.mechanism import Mechanism, NamedPoint, named_points

DIGITS, SKETCH_DIGITS = 13, 7
"""Of the size of a mechanism, or of a rad, to which its numbers are written, so that what is met exactly still is; and
those of its sketch, which only chooses the assembly."""


def write_design(
    design: DesignEquations,
    numbers: Mapping[str, float],
    y: Array,
    input_position: float,
    name: str,
) -> Mechanism:
    """The mechanism with these numbers (SI, rounded to `DIGITS`), whose sketch is where it stands with
    unknowns y (unknowns,). Raises BadInput where a file with these numbers is refused."""
    start = design.mechanism
    units, size = start.units, design.solver.unit
    known = file_dimensions(start)
    told = {key: _rounded(value, known[key].kind, units, size, DIGITS) for key, value in numbers.items()}
    running = f"{start.inputs[0].pair}.position"
    told[running] = _rounded(input_position, known[running].kind, units, size, DIGITS)
    joints = [each for each in named_points(start) if len(each.members) > 1 and _moves(start, each)]
    places = _places(design, joints, told, y)
    sketch = []
    for each, at in zip(joints, places, strict=True):
        x, y_own = (_rounded(part, "length", units, size, SKETCH_DIGITS) for part in at)
        sketch.append((each.name, x, y_own))
    made = replace(start, sketch=tuple(sketch), name=name, about=None, source=None, published=(), ids=())
    return with_values(made, told)


def _moves(mechanism: Mechanism, point: NamedPoint) -> bool:
    return all(link != mechanism.frame for link, _ in point.members)


def _places(
    design: DesignEquations, joints: list[NamedPoint], numbers: Mapping[str, float], y: Array
) -> list[tuple[float, float]]:
    frames, _ = design.placed
    parts = []
    for each in joints:
        link, point = each.members[0]
        parts += list(frames[link].to_world(design.work.shapes[link].position(point)))
    d = [numbers.get(each.name, each.value) for each in design.dimensions]
    u = [y[-1] * design.input_scale[0], *(each.position for each in design.mechanism.inputs[1:])]
    at = ca.Function("places", [design.z, design.u, design.d], [stack_expressions(parts)])
    found = at(ca.DM(y[:-1]), ca.DM(u), ca.DM(d)).full().ravel().tolist()
    return list(zip(found[::2], found[1::2], strict=True))


def _rounded(value: float, kind: str, units: FileUnits, size: float, digits: int) -> float:
    """A quantity (SI) with so many digits behind that of the size, in the file's units."""
    if kind not in ("length", "angle"):
        return float(value)
    of = unit_of_kind(kind, units)[1]
    whole = abs(of.from_si(size if kind == "length" else 1.0))
    return float(of.to_si(round(of.from_si(float(value)), digits - ceil(log10(whole)))))
