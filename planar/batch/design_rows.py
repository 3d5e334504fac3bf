"""What equations take of many designs: the numbers of pairs, inputs and links as rows, by one recorded formula."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import reduce
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.batch.design_arrays import design_variables, with_design_values
from planar.codegen.printed_formula import FormulaFunction
from planar.equations.mechanism_numbers import scaled_pair_numbers
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.geometry import Vector
from planar.foundation.jets import Scalar
from planar.foundation.recorded_formula import greatest_of, least_of, record_formula
from planar.model.link_shapes import LinkShape
from planar.solving.checks.residual_check import SHORT_ARM

if TYPE_CHECKING:
    from planar.batch.reference_design import ReferenceDesign

KINEMATIC_SECTIONS = ("links", "pairs", "inputs")
"""Sections of the file whose numbers the equations take."""


class DesignRows(NamedTuple):
    """The numbers of designs: p (numbers, designs) of all pairs, and of the inputs the positions u and the rates u1 and
    u2 (inputs, designs), each in sizes or rad; the shapes of the links (m), whose coordinates are arrays (designs,)
    where designs differ; and which designs have finite numbers and no arm so short that rounding takes its digits
    (designs,)."""

    p: Array
    u: Array
    u1: Array
    u2: Array
    shapes: Mapping[str, LinkShape]
    is_fit: BoolArray


class DesignFormula:
    """The numbers of the designs of a mechanism that differ in the numbers of these names."""

    def __init__(self, reference: ReferenceDesign, names: Sequence[str]):
        known = design_variables(reference.mechanism)
        self.names = tuple(name for name in names if known[name].path[0] in KINEMATIC_SECTIONS)
        self.reference = reference
        shapes = reference.shapes(
            with_design_values(reference.mechanism, {name: known[name].value for name in self.names})
        )
        self.changed_links = [link for link, shape in shapes.items() if shape is not reference.solver.shapes[link]]
        self.pair_number_count = sum(len(pair.number_kinds) for pair in reference.mechanism.pairs)
        self.function: FormulaFunction | None = None
        "None where a pair has numbers that are measured in floats alone"
        if all(pair.measures_symbols for pair in reference.mechanism.pairs):
            formula = record_formula(self._rows, len(self.names))
            self.function = FormulaFunction(formula, [1] * len(self.names), [(1, len(formula.results))])

    def _rows(self, values: Sequence[Scalar]) -> list[Scalar]:
        """The rows of designs with these values of the named numbers, in any arithmetic: p; positions, velocities and
        accelerations of the inputs; x and y of the points of the changed links; a margin that is negative where an arm
        is short; and the sum of all these, which is finite where they are."""
        reference = self.reference
        design = with_design_values(reference.mechanism, dict(zip(self.names, values, strict=True)))
        shapes = reference.shapes(design)
        rows = [number for pair in design.pairs for number in scaled_pair_numbers(pair, shapes, reference.unit)]
        rows += [given.position / scale for given, scale in zip(design.inputs, reference.input_scale, strict=True)]
        for rate in ("velocity", "acceleration"):
            rows += [0.0] * len(design.inputs)
            running = design.inputs[reference.running_index]
            rows[reference.running_index - len(design.inputs)] = (
                getattr(running, rate) / reference.input_scale[reference.running_index]
            )
        rows += [part for link in self.changed_links for point in shapes[link].points.values() for part in point]
        points = [point for shape in shapes.values() for point in shape.points.values()]
        squared_size = reduce(greatest_of, [point.dot(point) for point in points], reference.unit**2)
        margin: Scalar = 0.0
        for link, first, second in reference.arms:
            arm = shapes[link].points[second] - shapes[link].points[first]
            square = arm.dot(arm)
            # an arm of no length at all turns nothing
            margin = least_of(margin, greatest_of(square - SHORT_ARM**2 * squared_size, -square))
        return [*rows, margin, sum(rows)]

    def rows(self, values: Mapping[str, Array], count: int) -> DesignRows:
        """The rows of designs with these values (designs,) by name."""
        arguments = [values[name] for name in self.names]
        with np.errstate(all="ignore"):  # what cannot be placed is not a number
            if self.function is None:
                rows = stack_rows(self._rows(arguments), count)
            else:
                rows = self.function.evaluate_entries(count, *(argument[None] for argument in arguments))
        p, u, u1, u2 = np.split(rows[: self.pair_number_count + 3 * self.input_count], self._sections)
        shapes, row = dict(self.reference.solver.shapes), self.pair_number_count + 3 * self.input_count
        for link in self.changed_links:
            shape = shapes[link]
            places = {name: Vector(rows[row + 2 * k], rows[row + 2 * k + 1]) for k, name in enumerate(shape.points)}
            shapes[link] = LinkShape(places, shape.origin, shape.axis)
            row += 2 * len(places)
        return DesignRows(p, u, u1, u2, shapes, (rows[-2] >= 0.0) & np.isfinite(rows[-1]))

    @property
    def input_count(self) -> int:
        return len(self.reference.mechanism.inputs)

    @property
    def _sections(self) -> list[int]:
        return [self.pair_number_count + k * self.input_count for k in range(3)]


def stack_rows(rows: Sequence[Array | Scalar], design_count: int) -> Array:
    """Rows of numbers, or of arrays of one for each design, as one array (rows, designs)."""
    stacked = np.empty((len(rows), design_count))
    for k, row in enumerate(rows):
        stacked[k] = row
    return stacked
