"""Derivatives of what a sweep tells, in numbers of the file, as rows that a march writes beside its positions.

Where a number of the file changes the equations F(z, u, p) = 0 and their rates stay zero, so that

    A dz = -(F_p dp + F_u du)    A dz' = -(F'_z dz + F'_p dp + ...)    A dz'' = -(F''_z dz + F''_z' dz' + ...)

with A = dF/dz, block after block. What the numbers p of pairs and q of points change by stands for a whole run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.batch.design_arrays import split_into_blocks
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import KernelInstructions, Operand
from planar.batch.march.runs import run_designs
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import allocate_aligned
from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.equations.linear import solve_by_determinants
from planar.equations.mechanism_numbers import scale_lengths
from planar.equations.rates import block_jacobian, time_derivatives
from planar.equations.residuals import input_positions, split_pair_numbers
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.jets import Scalar
from planar.model.link_shapes import PointMember
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind

CHANGING = ("p", "q", "u", "u1", "u2")
"""What a number of the file changes."""


class SlopeResults(NamedTuple):
    """What is derived: points, links and pairs by name, with two rates or without; and in which numbers of the file."""

    points: tuple[str, ...]
    links: tuple[str, ...]
    pairs: tuple[str, ...]
    numbers: tuple[str, ...]
    rates: bool

    @property
    def row_count(self) -> int:
        """How many numbers these are at a position."""
        parts = 2 * len(self.points) + len(self.links) + len(self.pairs)
        return parts * len(self.numbers) * (3 if self.rates else 1)

    def split_rows(self, rows: Array) -> Iterator[Array]:
        """Of rows (steps + 1, rows, designs) those of points, links and pairs: views (steps + 1, orders times results,
        numbers, parts, designs)."""
        first, count = 0, len(self.numbers)
        for results, parts in ((self.points, 2), (self.links, 1), (self.pairs, 1)):
            lines = len(results) * (3 if self.rates else 1)
            stop = first + lines * count * parts
            yield rows[:, first:stop].reshape(len(rows), lines, count, parts, rows.shape[2])
            first = stop


def numbers_of_file(
    reference: ReferenceDesign, design: DesignEquations, members: Sequence[PointMember]
) -> tuple[list[Scalar], list[Scalar]]:
    """The numbers of pairs, and x and y of points of links, in sizes: expressions in the numbers of the file."""
    unit, work = reference.unit, design.work
    numbers = [
        number
        for pair in reference.mechanism.pairs
        for number in scale_lengths(work.numbers[pair.name], pair.number_kinds, unit)
    ]
    return numbers, [part / unit for link, point in members for part in work.shapes[link].position(point)]


def with_rates(value: ca.SX, y: Sequence[ca.SX]) -> list[ca.SX]:
    """What is made of y, and its rates, as many as y has."""
    return [value, *time_derivatives(value, *y)] if len(y) > 1 else [value]


class SlopeRows:
    """See `ResultRows`: for each kind of result, order, result and number of the file so many rows as it has parts."""

    def __init__(self, reference: ReferenceDesign, design: DesignEquations, results: SlopeResults):
        self.reference, self.design, self.results = reference, design, results
        self.members = [reference.point_member(name) for name in results.points]
        self.orders, self.row_count = 3 if results.rates else 1, results.row_count
        numbers, places = numbers_of_file(reference, design, self.members)
        self.changes = self._changes(ca.vertcat(ca.SX(0, 1), *numbers, *places))
        varying = [k for k in range(self.changes.nnz()) if not self.changes.nz[k].is_constant()]
        columns = [ca.vertcat(ca.SX(0, 1), *values) for values in (places, [self.changes.nz[k] for k in varying])]
        self._numbers = BufferedFunction(ca.Function("numbers", [design.d], [ca.densify(each) for each in columns]))
        self.numbers = ca.SX.sym("number", len(varying))
        "the further numbers of a design: what is changed by no constant"
        for number, k in enumerate(varying):
            self.changes.nz[k] = self.numbers[number]

    def _changes(self, taken: ca.SX) -> ca.SX:
        """How what is `CHANGING` changes (entries, numbers), of which p and q are `taken` from the file."""
        design, inputs = self.design, len(self.reference.mechanism.inputs)
        columns = []
        for name in self.results.numbers:
            input_change, k = ca.SX(3 * inputs, 1), design.names.index(name)
            change = ca.SX(taken.numel(), 1)
            if k < 3 * inputs:
                input_change[k] = 1.0 / float(self.reference.input_scale[k % inputs])
            else:
                change = ca.jacobian(taken, design.t[k])
            columns.append(ca.vertcat(change, input_change))
        return ca.sparsify(ca.horzcat(*columns))

    def design_numbers(self, values: Mapping[str, Array], count: int) -> tuple[Array, Array]:
        """q (2 a point, designs), in sizes, and the further numbers (numbers, designs), of designs with these values
        (designs,) by name."""
        d = np.empty((count, len(self.design.dimensions)))
        for k, each in enumerate(self.design.dimensions):
            d[:, k] = values.get(each.name, each.value)
        places, numbers = (each.reshape(count, -1).T for each in self._numbers.evaluate_batch(count, d))
        return np.ascontiguousarray(places), np.ascontiguousarray(numbers)

    @cached_property
    def zero_places(self) -> list[int]:
        """The rows of q that are nothing in the reference."""
        return np.flatnonzero(self.design_numbers({}, 1)[0][:, 0] == 0.0).tolist()

    def write_rows(self, writer: Any, have: dict[Operand, str]) -> list[str]:
        """See `ResultRows`."""
        return _SlopeWriter(self, writer).write(have)


class _SlopeWriter:
    """Writes the rows into one march."""

    def __init__(self, rows: SlopeRows, writer: Any):
        self.rows, self.writer = rows, writer
        kernel: KernelInstructions = writer
        e, s = kernel.equations.equations, kernel.symbols
        self.kernel, self.count = kernel, e.z.numel()
        self.unknowns = [e.z, s["z1"], s["z2"]][: rows.orders]
        self.y = [e.y, ca.vertcat(s["z1"], s["u1"]), ca.vertcat(s["z2"], s["u2"])][: rows.orders]
        number_count = len(rows.results.numbers)
        s["slope"] = ca.SX.sym("slope", rows.orders * number_count * self.count)
        columns = ca.reshape(s["slope"], self.count, rows.orders * number_count)
        # the slopes of the unknowns (unknowns, numbers) of every order
        self.slopes = [columns[:, k * number_count : (k + 1) * number_count] for k in range(rows.orders)]
        self.arguments = ca.vertcat(*(s[kind] for kind in CHANGING))
        self.changes = rows.changes

    def write(self, have: dict[Operand, str]) -> list[str]:
        """The rows, after the unknowns' slopes have been put into `have`."""
        e, t = self.kernel.equations.equations, self.writer.ir
        levels = with_rates(e.F, self.y)
        number_count = self.changes.shape[1]
        for part in self.kernel.equations.blocks:
            jacobian = block_jacobian(e, part.block.rows, part.block.unknowns)
            if part.is_large:
                columns = self.writer.write_values([ca.vec(jacobian)], have)
                self.writer.linear_systems.factorise(columns, len(part.unknowns))
            for order, level in enumerate(levels):
                changed = ca.horzsplit(self._slopes_of(level[part.block.rows], order, part.unknowns.start))
                if part.is_large:
                    known = self.writer.write_separately(changed, have)
                    solutions = [self.writer.linear_systems.solve(each) for each in known]
                else:
                    solved = [solve_by_determinants(jacobian, each) for each in changed]
                    solutions = self.writer.write_separately(solved, have)
                for number, values in enumerate(solutions):
                    first = (order * number_count + number) * self.count
                    for k, value in zip(part.unknowns, values, strict=True):
                        have["slope", first + k] = t.add_instruction(f"fneg {t.vector} {value}")
        return self.writer.write_values(self._result_slopes(), have)

    def _slopes_of(self, value: ca.SX, order: int, known: int) -> ca.SX:
        """The slopes (rows, numbers) of what stands at an order, where of that order so many unknowns' slopes are
        known."""
        slopes = ca.mtimes(ca.jacobian(value, self.arguments), self.changes)
        for k in range(order + 1):
            count = known if k == order else self.count
            slopes += ca.mtimes(ca.jacobian(value, self.unknowns[k][:count]), self.slopes[k][:count, :])
        return ca.densify(slopes)

    def _result_slopes(self) -> list[ca.SX]:
        """The slopes of all results, row by row."""
        rows = []
        for values, width, scale in self._results():
            for order, value in enumerate(with_rates(values, self.y)):
                slopes = self._slopes_of(value, order, self.count)
                for first in range(0, value.numel(), width):
                    for number in range(slopes.shape[1]):
                        rows.append(slopes[first : first + width, number] * scale[first : first + width])
        return rows

    def _results(self) -> list[tuple[ca.SX, int, ca.SX]]:
        """Of points, links and pairs the values, how many numbers each has, and what each number is in units of."""
        rows, equations = self.rows, self.kernel.equations
        e, scale = equations.equations, self.kernel.symbols["scale"]
        results, values_and_units = rows.results, []
        if results.points:
            points = self.kernel.point_coordinates(range(len(results.points)))
            values_and_units.append((points, 2, ca.repmat(scale, points.numel(), 1)))
        if results.links:
            angles = [ca.SX(equations.frames[link].angle) for link in results.links]
            values_and_units.append((ca.vertcat(*angles), 1, ca.SX.ones(len(angles))))
        if results.pairs:
            mechanism = rows.reference.mechanism
            motions = [relative_motions(mechanism)[name] for name in results.pairs]
            numbers = split_pair_numbers(equations.mechanism.pairs, e.p)
            values = input_positions(motions, equations.frames, numbers, equations.pair_coordinates)
            units = [scale if each.input_kind is MeasureKind.LENGTH else ca.SX(1.0) for each in motions]
            values_and_units.append((stack_expressions(values), 1, ca.vertcat(*units)))
        return values_and_units


MAX_NUMBERS = 8
"""Numbers of the file by which one function derives: of more its text grows so long that its code is made briefly."""


def march_slopes(
    reference: ReferenceDesign, march: DesignBatch, results: SlopeResults, values: Mapping[str, Array]
) -> Array | None:
    """The slopes (steps + 1, rows, designs) of designs with these values (designs,) by name that ran so.

    Rows are as `SlopeRows` has them. Not numbers where a design did not come, or where its own numbers have no
    derivatives. None where that cannot be compiled.
    """
    design_count = march.p.shape[1]
    groups = list(split_into_blocks(len(results.numbers), MAX_NUMBERS))
    out = allocate_aligned(len(march.input_offsets), results.row_count, design_count)
    for group in groups:
        group_results = results._replace(numbers=results.numbers[group])
        group_out = out if len(groups) == 1 else allocate_aligned(len(out), group_results.row_count, design_count)
        if not _march_group(slope_rows(reference, group_results), march, values, group_out):
            return None
        if group_out is not out:
            for target, part in zip(results.split_rows(out), group_results.split_rows(group_out), strict=True):
                target[:, :, group] = part
    return out


@lru_cache(maxsize=64)
def slope_rows(reference: ReferenceDesign, results: SlopeResults) -> SlopeRows:
    """The rows of a mechanism's designs, kept."""
    return SlopeRows(reference, design_equations(reference.mechanism), results)


def _march_group(rows: SlopeRows, march: DesignBatch, values: Mapping[str, Array], out: Array) -> bool:
    """Fill out; whether it could be compiled."""
    design_count = march.p.shape[1]
    places, numbers = rows.design_numbers(values, design_count)
    zeros = {each for each in march.zeros if each[0] == "p"}
    zeros |= {("q", k) for k in rows.zero_places if not places[k].any()}
    batch = march._replace(
        q=np.concatenate([places, numbers]),
        links=tuple(link for link, _ in rows.members),
        rates=rows.results.rates,
        zeros=frozenset(zeros),
        stops=None,
        results=rows,
    )
    try:
        run_designs(batch, out, np.zeros(design_count, dtype=int))
    except UnsupportedOperation:
        return False
    return True
