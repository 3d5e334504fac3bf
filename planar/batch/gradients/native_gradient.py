"""Gradients of runs as compiled functions: the states of a run, then the adjoint of all its positions in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

import casadi as ca
import numpy as np

from planar.batch.gradients.adjoint_equations import WeighedRow
from planar.batch.gradients.llvm_adjoint import FUNCTION_NAME as ADJOINT_FUNCTION
from planar.batch.gradients.llvm_adjoint import LANES, AdjointFunction, write_adjoint
from planar.batch.gradients.llvm_file_slopes import FUNCTION_NAME as SLOPES_FUNCTION
from planar.batch.gradients.llvm_file_slopes import file_slope_expressions, write_file_slopes
from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.llvm_numbers import FUNCTION_NAME as NUMBERS_FUNCTION
from planar.batch.prepare.llvm_numbers import write_numbers
from planar.batch.prepare.native_run import (
    NativeRun,
    NativeRuns,
    RunPositions,
    compile_run_function,
    prepare_native,
    run_design_numbers,
    wanted_end,
)
from planar.batch.prepare.run_endings import ALL_SOLVED, UNSURE
from planar.batch.prepare.value_binder import address_of
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.derivatives.design_equations import DesignEquations
from planar.foundation.arrays import Array
from planar.model.link_shapes import PointMember

if TYPE_CHECKING:
    from planar.batch.prepare.compiled_run import CompiledRun
    from planar.batch.prepare.newton_run import NewtonRun

FUNCTION_NAME = "gradient"
ARGUMENT_TYPES = (*("array",) * 3, "int", "array", "int", "array", "array")
"""Of the function's arguments: what does not change from call to call; places of values that are given, these; how many
positions are good; states, and how far apart their rows are; weights; out: the sum, then its derivatives."""
NUMBER_KINDS = frozenset({"p", "q", "u1", "u2", "d", "dc", "ds"})


def prepare_native_gradient(  # many: what a gradient is made of
    reference: ReferenceDesign,
    equations: DesignEquations,
    points: tuple[str, ...],
    rows: tuple[int, ...],
    positions: Array,
    may_shift: bool,
) -> NativeRuns | None:
    """The compiled gradients of a run over these positions of the running input, of sums of these rows of its points;
    None where there are none.

    Each takes values by name and weights (pairs of rows, `padded_width`, 2), and gives the sum and its
    derivatives in `equations.names` (1 + names,), how the run ended and at which position, as a `NativeRun`.
    """
    wide = 2 * len(points)
    chosen = dict.fromkeys((row % wide) // 2 for row in rows)
    number = {point: k for k, point in enumerate(chosen)}
    weighed = [WeighedRow(row // wide, number[(row % wide) // 2]) for row in rows[::2]]
    members = [reference.point_member(points[point]) for point in chosen]

    def compile_gradient(grid: RunPositions, zeros: frozenset[str]) -> NativeRun:
        states = compile_run_function(
            reference, run_design_numbers(reference, (), may_shift, zeros), (), False, grid, True
        )
        design = run_design_numbers(reference, members, may_shift, zeros)
        return _NativeGradient(states, design, _GradientParts(reference, equations, members, weighed), grid)

    return prepare_native(reference, positions, compile_gradient)


def padded_width(count: int) -> int:
    """How many numbers a row of weights has: whole vectors of positions."""
    return LANES * -(-count // LANES)


class _GradientParts:
    """What a gradient is written of: the functions of a run's numbers, of the adjoint, and of the way to the file."""

    def __init__(
        self,
        reference: ReferenceDesign,
        equations: DesignEquations,
        members: Sequence[PointMember],
        weighed: Sequence[WeighedRow],
    ):
        self.reference, self.equations, self.members, self.weighed = reference, equations, members, weighed

    def write(self, design: DesignNumbers) -> tuple[str, AdjointFunction]:
        """The text of `gradient`, and what its adjoint takes. Raises UnsupportedOperation."""
        order = [operand for operand in design.numbers if operand[0] in NUMBER_KINDS]
        links = tuple(link for link, _ in self.members)
        adjoint = write_adjoint(design.equations("q"), links, self.weighed, order)
        sums = ca.SX.sym("sum", 1 + len(adjoint.derived))
        unit = self.reference.unit
        named: dict[Operand, ca.SX] = {operand: unit * sums[1 + k] for k, operand in enumerate(adjoint.derived)}
        slopes = file_slope_expressions(self.reference, self.equations, design, self.members, named)
        by_file = write_file_slopes(design, sums, ca.vertcat(unit * sums[0], slopes))
        numbers = write_numbers(design, order)
        return self._write_function(len(order), sums.numel()).module_text(numbers, adjoint.writer, by_file), adjoint

    @staticmethod
    def _write_function(number_count: int, sum_count: int) -> IRWriter:
        t = IRWriter(1)
        t.write_line(
            f"define void @{FUNCTION_NAME}(ptr %context, ptr %places, ptr %given, i64 %good, ptr %state, i64 %stride, "
            "ptr %weights, ptr %out) {"
        )
        t.write_label("entry")
        own, drive, width = (
            t.add_instruction(f"load {kind}, ptr {t.double_pointer('%context', str(k))}")
            for k, kind in enumerate(("ptr", "ptr", "i64"))
        )
        t.write_line(f"%numbers = alloca [{number_count} x double], align 64")
        t.write_line(f"%sums = alloca [{sum_count} x double], align 64")
        t.write_line(f"call void @{NUMBERS_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %numbers)")
        t.write_line(
            f"call void @{ADJOINT_FUNCTION}(i64 %good, ptr %numbers, ptr {drive}, i64 {width}, ptr %state, "
            "i64 %stride, ptr %weights, ptr %sums)"
        )
        t.write_line(f"call void @{SLOPES_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %sums, ptr %out)")
        t.write_line("ret void")
        t.write_line("}")
        return t


class _NativeGradient:
    """One function's calls, over the same positions always; from any thread. Raises UnsupportedOperation."""

    def __init__(
        self, states: CompiledRun | NewtonRun, design: DesignNumbers, parts: _GradientParts, grid: RunPositions
    ):
        """`states` and `design` have the same values, in one order."""
        ir, adjoint = parts.write(design)
        self._states, self._grid = states, grid
        self._function: Any = compile_function(ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        wanted = grid.u[grid.lead :: grid.every]
        self._count, self._width = len(wanted), padded_width(len(wanted))
        whole = np.concatenate([wanted, np.repeat(wanted[-1:], self._width - self._count, axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self._drive = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in adjoint.inputs])
        self._own = design.own_values
        self._context = np.array([self._own.ctypes.data, self._drive.ctypes.data, self._width], dtype=np.int64)
        self._pointer = self._context.ctypes.data
        self._size = 1 + len(parts.equations.names)
        self._row_count = adjoint.state_count
        self._has_others = grid.lead > 0 or grid.every > 1 or states.stride < self._width

    def __call__(self, values: Mapping[str, float], weights: Array) -> tuple[Array, float, int]:
        """See `prepare_native_gradient`."""
        names, states = tuple(values), self._states
        pack, _, places = states.bound.get(names) or states.bind(names)
        given = pack(*values.values())
        out = np.empty(self._size)
        held, state, ending, end = states.run_bound(places, given)
        stride = states.stride
        if self._has_others:
            ending, end = wanted_end(self._grid, ending, end)
            held, stride = self._wanted_states(held, state), self._width
            state = address_of(held)
        if ending != UNSURE:
            good = self._count if ending == ALL_SOLVED else end
            self._function(self._pointer, places, given, good, state, stride, address_of(weights), address_of(out))
        return out, ending, end

    def _wanted_states(self, held: Array, state: int) -> Array:
        """The states (rows, width) at the run's own positions alone, out of those that are held."""
        stride, first = self._states.stride, (state - address_of(held)) // 8
        whole = held.reshape(-1)[first:]
        rows = whole[: len(whole) // stride * stride].reshape(-1, stride)[: self._row_count]
        found = np.empty((max(len(rows), 1), self._width))  # an array of nothing has no address
        found[: len(rows), : self._count] = rows[:, self._grid.lead : len(self._grid.u) : self._grid.every]
        return found
