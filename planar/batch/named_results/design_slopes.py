"""Derivatives of a sweep's results in numbers of the file: by machine code beside the march, or by the links' places.

Where a number of the file changes the equations F(z, u, p) = 0 and their rates stay zero, so that

    A dz = -(F_p dp + F_u du)    A dz' = -(F'_z dz + F'_p dp + ...)    A dz'' = -(F''_z dz + F''_z' dz' + ...)

with A = dF/dz, block after block. The changes of the numbers p of pairs and q of points hold for a whole run.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from planar.batch.block import DesignBlock, SolvedDesigns
from planar.batch.design_arrays import split_into_blocks
from planar.batch.design_frames import DesignFrames
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import Operand
from planar.batch.march.kernel_writer import KernelWriter
from planar.batch.march.runs import run_designs
from planar.batch.named_results.design_forces import position_chunks
from planar.batch.named_results.result_rows import NamedArrays, RequestedResults, derivative_name
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import allocate_aligned
from planar.derivatives.design_equations import design_equations, with_rates
from planar.derivatives.kinematic_slopes import (
    CoordinateMotion,
    Directions,
    KinematicSlopes,
    Parameters,
    constraint_elements,
    result_array,
)
from planar.derivatives.result_slopes import tied_dimensions
from planar.document.dimensions import value_at
from planar.equations.casadi_functions import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.equations.residuals import input_positions, split_pair_numbers
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, suggest_name
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.jets import Scalar
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind

OPERANDS = ("p", "q", "u", "u1", "u2")
"""The kinds of operands that change with a number of the file."""
MAX_NUMBERS = 8
"""Numbers of the file by which one function derives: with more its text grows so long that its code is optimised
less."""


class DesignSlopes:
    """The derivatives of results over a sweep's positions in some numbers, those of `planar.sensitivity`.

    Raises BadInput where a structure has no derivatives, or none in a number.
    """

    def __init__(self, reference: ReferenceDesign, results: RequestedResults, rates: bool):
        self.reference, self.results, self.rates = reference, results, rates
        self.parameters = Parameters(reference.mechanism)
        names = list(self.parameters.names)
        for number in results.derivatives:
            if number not in names:
                hint = suggest_name(number, names, "numbers")
                raise BadInput("derivatives", f"nothing is derived in {number!r:.60}{hint}")
        self.directions = Directions(self.parameters, [names.index(number) for number in results.derivatives])

    @cached_property
    def is_bound(self) -> BoolArray:
        """The numbers that cannot change alone (numbers,)."""
        bound = tied_dimensions(self.reference.mechanism)
        return np.array([number in bound for number in self.results.derivatives])

    def march_block(
        self, block: DesignBlock, march: DesignBatch, done: SolvedDesigns
    ) -> tuple[Array, BoolArray] | None:
        """The slopes (steps + 1, rows, designs) of a block that has been solved and marched, and the positions
        (steps + 1, designs) that are solved but have none yet; None where that cannot be compiled.

        NaN at positions that are not solved, and in numbers that cannot change alone.
        """
        design_count = march.p.shape[1]
        number_of_row = self.results.number_of_row(self.rates)
        slopes = allocate_aligned(len(march.input_offsets), len(number_of_row), design_count)
        free = np.flatnonzero(~self.is_bound)
        if len(free) < len(self.is_bound):
            slopes[:] = 0.0
        for group in split_into_blocks(len(free), MAX_NUMBERS):
            numbers = tuple(self.results.derivatives[k] for k in free[group])
            rows = slope_rows(self.reference, self.results._replace(derivatives=numbers), self.rates)
            is_complete = rows.row_count == slopes.shape[1]
            out = slopes if is_complete else allocate_aligned(len(slopes), rows.row_count, design_count)
            try:
                rows.march(march, block.designs, out)
            except UnsupportedOperation:
                return None
            if not is_complete:
                slopes[:, np.isin(number_of_row, free[group])] = out
        is_missing = np.zeros((len(slopes), design_count), dtype=bool)
        # mostly all are numbers, and their sum is one
        if done.status.any() or not np.isfinite(slopes.sum()):
            is_solved = done.status.T == 0
            is_missing = is_solved & ~np.isfinite(slopes).all(axis=1)
            np.copyto(slopes, np.nan, where=~is_solved[:, None])
        slopes[:, self.is_bound[number_of_row]] = np.nan
        return slopes, is_missing

    def find(
        self, frames: DesignFrames, values: Mapping[str, Array], is_solved: BoolArray, arrays: NamedArrays
    ) -> None:
        """Fill in the derivatives of designs with `values` (designs,) by name.

        NaN stays at positions that are not solved or are singular, and in numbers that cannot change alone.
        """
        elements = constraint_elements(self.reference.mechanism)
        for positions in position_chunks(self.reference.mechanism, frames, values, is_solved):
            numbers = [value_at(positions.mechanism, number.address) for number in self.parameters.dimensions]
            coordinates = elements.coordinates(positions)[: 3 if self.rates else 1]
            kinematics = KinematicSlopes(self.parameters, coordinates, self.directions, numbers)
            is_unknown = kinematics.tied | self.is_bound | kinematics.is_singular[:, None]
            places = positions.steps, positions.designs
            for result, parts in self._results(kinematics.motion):
                for axis, part in enumerate(parts):
                    slopes = np.where(is_unknown, np.nan, result_array(part, 1, is_unknown.shape))
                    for number, column in zip(self.results.derivatives, slopes.T, strict=True):
                        arrays["derivatives", derivative_name(result, number)][axis][places] = column

    def _results(self, motion: CoordinateMotion) -> Iterator[tuple[str, tuple[Scalar, ...]]]:
        """What is derived, as `position of E`, with its parts."""
        points, links, pairs = self.results.derived
        for order in range(motion.orders):
            for name in points.names:
                link, point = self.reference.point_member(name)
                place = motion.place(link, motion.shapes[link].position(point), order)
                yield f"{points.quantities[order]} of {name}", tuple(place)
            for name in links.names:
                yield f"{links.quantities[order]} of {name}", (motion.angle_rates(name, order),)
            for name in pairs.names:
                position = motion.input_position(motion.relative_motions[name])
                yield f"{pairs.quantities[order]} of {name}", (position.parts[order],)


@lru_cache(maxsize=16)
def design_slopes(reference: ReferenceDesign, results: RequestedResults, rates: bool) -> DesignSlopes:
    """The derivatives of a mechanism's designs, cached: a worker solves many blocks of one sweep."""
    return DesignSlopes(reference, results, rates)


class SlopeRows:
    """See `ResultRows`: the derivatives of results, in the order of `RequestedResults`."""

    def __init__(self, reference: ReferenceDesign, results: RequestedResults, rates: bool):
        self.reference, self.results, self.orders = reference, results, 3 if rates else 1
        self.row_count = len(results.number_of_row(rates))
        self.design = design_equations(reference.mechanism)
        self.members = [reference.point_member(name) for name in results.derived_points]
        places = self.design.point_numbers(self.members)
        self.changes = self._operand_changes(ca.vertcat(ca.SX(0, 1), *self.design.pair_numbers, *places))
        varying = [k for k in range(self.changes.nnz()) if not self.changes.nz[k].is_constant()]
        columns = [ca.vertcat(ca.SX(0, 1), *values) for values in (places, [self.changes.nz[k] for k in varying])]
        self._numbers = BufferedFunction(ca.Function("numbers", [self.design.d], [*map(ca.densify, columns)]))
        self.numbers = ca.SX.sym("number", len(varying))
        "the further numbers of a design: the changes of operands that are not constant"
        for number, k in enumerate(varying):
            self.changes.nz[k] = self.numbers[number]

    def _operand_changes(self, design_operands: ca.SX) -> ca.SX:
        """How `OPERANDS` change with the numbers of the file (operands, numbers); `design_operands` are p and q."""
        design, inputs = self.design, len(self.reference.mechanism.inputs)
        columns = []
        for name in self.results.derivatives:
            input_change, k = ca.SX(3 * inputs, 1), design.names.index(name)
            change = ca.SX(design_operands.numel(), 1)
            if k < 3 * inputs:
                input_change[k] = 1.0 / float(self.reference.input_scale[k % inputs])
            else:
                change = ca.jacobian(design_operands, design.t[k])
            columns.append(ca.vertcat(change, input_change))
        return ca.sparsify(ca.horzcat(*columns))

    def design_numbers(self, values: Mapping[str, Array], count: int) -> tuple[Array, Array]:
        """q (2 a point, designs), in sizes, and the further numbers (numbers, designs), of designs with these values
        (designs,) by name."""
        d = np.empty((count, len(self.design.dimensions)))
        for k, dimension in enumerate(self.design.dimensions):
            d[:, k] = values.get(dimension.name, dimension.value)
        places, numbers = (array.reshape(count, -1).T for array in self._numbers.evaluate_batch(count, d))
        return np.ascontiguousarray(places), np.ascontiguousarray(numbers)

    @cached_property
    def zero_places(self) -> list[int]:
        """The rows of q that are zero in the reference."""
        return np.flatnonzero(self.design_numbers({}, 1)[0][:, 0] == 0.0).tolist()

    def march(self, march: DesignBatch, values: Mapping[str, Array], out: Array) -> None:
        """Fill `out` with the slopes (steps + 1, rows, designs) of marched designs with these values (designs,) by
        name; not numbers where a design stopped, or has no derivatives. Raises UnsupportedOperation."""
        design_count = march.p.shape[1]
        places, numbers = self.design_numbers(values, design_count)
        zeros = {operand for operand in march.zeros if operand[0] == "p"}
        zeros |= {("q", k) for k in self.zero_places if not places[k].any()}
        batch = march._replace(
            q=np.concatenate([places, numbers]),
            links=tuple(link for link, _ in self.members),
            rates=self.orders > 1,
            zeros=frozenset(zeros),
            stops=None,
            results=self,
        )
        run_designs(batch, out, np.zeros(design_count, dtype=int))

    def write_rows(self, writer: Any, have: dict[Operand, str]) -> list[str]:
        """See `ResultRows`."""
        return _SlopeWriter(self, writer).write(have)


class _SlopeWriter:
    """Writes the rows into one march."""

    def __init__(self, rows: SlopeRows, kernel: KernelWriter):
        self.rows, self.changes = rows, rows.changes
        e, s = kernel.equations.equations, kernel.symbols
        self.kernel, self.count = kernel, e.z.numel()
        self.unknowns = [e.z, s["z1"], s["z2"]][: rows.orders]
        self.y = [e.y, ca.vertcat(s["z1"], s["u1"]), ca.vertcat(s["z2"], s["u2"])][: rows.orders]
        number_count = self.changes.shape[1]
        s["slope"] = ca.SX.sym("slope", rows.orders * number_count * self.count)
        columns = ca.reshape(s["slope"], self.count, rows.orders * number_count)
        # the slopes of the unknowns (unknowns, numbers) of every order
        self.slopes = [columns[:, k * number_count : (k + 1) * number_count] for k in range(rows.orders)]
        self.operands = ca.vertcat(*(s[kind] for kind in OPERANDS))

    def write(self, have: dict[Operand, str]) -> list[str]:
        """The rows, after the unknowns' slopes have been put into `have`."""
        levels = with_rates(self.kernel.equations.equations.F, self.y)
        number_count = self.changes.shape[1]
        for part in self.kernel.equations.blocks:
            self.kernel.factorise_block(part, have)
            for order, level in enumerate(levels):
                openings = ca.horzsplit(self._slopes_of(level[part.block.rows], order, part.unknowns.start))
                for number, values in enumerate(self.kernel.solve_block(part, openings, have)):
                    first = (order * number_count + number) * self.count
                    for k, value in zip(part.unknowns, values, strict=True):
                        have["slope", first + k] = value
        return self.kernel.write_values(self._result_slopes(), have)

    def _slopes_of(self, value: ca.SX, order: int, known: int) -> ca.SX:
        """The slopes (rows, numbers) of an expression of an order, where the slopes of the first `known` unknowns of
        that order are known."""
        slopes = ca.mtimes(ca.jacobian(value, self.operands), self.changes)
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

    def _results(self) -> Iterator[tuple[ca.SX, int, ca.SX]]:
        """The values of points, links and pairs, how many numbers each has, and the unit of each number."""
        equations, results = self.kernel.equations, self.rows.results
        scale = self.kernel.symbols["scale"]
        if results.derived_points:
            points = self.kernel.point_coordinates(range(len(results.derived_points)))
            yield points, 2, ca.repmat(scale, points.numel(), 1)
        if results.links:
            angles = stack_expressions(equations.frames[link].angle for link in results.links)
            yield angles, 1, ca.SX.ones(angles.numel())
        if results.pairs:
            motions = [relative_motions(self.rows.reference.mechanism)[name] for name in results.pairs]
            numbers = split_pair_numbers(equations.mechanism.pairs, equations.equations.p)
            values = input_positions(motions, equations.frames, numbers, equations.pair_coordinates)
            units = [scale if pair.input_kind is MeasureKind.LENGTH else ca.SX(1.0) for pair in motions]
            yield stack_expressions(values), 1, ca.vertcat(*units)


@lru_cache(maxsize=64)
def slope_rows(reference: ReferenceDesign, results: RequestedResults, rates: bool) -> SlopeRows:
    """The rows of a mechanism's designs, cached."""
    return SlopeRows(reference, results, rates)
