"""Gradients of runs as compiled functions: the states of a run, then the adjoint of all its positions in one call."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.batch.gradients.adjoint_equations import WeighedRow
from planar.batch.gradients.llvm_adjoint import LANES
from planar.batch.gradients.llvm_gradient import ARGUMENT_TYPES, FUNCTION_NAME, TOLD, GradientWriter
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.native_run import (
    NativeRun,
    NativeRuns,
    RunPositions,
    compile_run_function,
    prepare_native,
    run_design_numbers,
)
from planar.batch.prepare.value_binder import address_of
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.aligned_arrays import WIDEST_VECTOR_BYTES
from planar.codegen.llvm_compile import compile_function
from planar.derivatives.design_equations import DesignEquations
from planar.foundation.arrays import Array

if TYPE_CHECKING:
    from planar.batch.prepare.compiled_run import CompiledRun
    from planar.batch.prepare.newton_run import NewtonRun


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

    Each takes values by name and weights (pairs of rows, `padded_width`, 2), and gives the sum and its derivatives in
    `equations.names` (1 + names,), how the run ended, as a `NativeRun`, and how many of its positions are good.
    """
    wide = 2 * len(points)
    chosen = dict.fromkeys((row % wide) // 2 for row in rows)
    number = {point: k for k, point in enumerate(chosen)}
    weighed = [WeighedRow(row // wide, number[(row % wide) // 2]) for row in rows[::2]]
    members = [reference.point_member(points[point]) for point in chosen]

    def compile_gradient(grid: RunPositions, zeros: frozenset[str]) -> NativeRun:
        own = run_design_numbers(reference, (), may_shift, zeros)
        states = compile_run_function(reference, own, (), False, grid, True)
        design = run_design_numbers(reference, members, may_shift, zeros)
        return NativeGradient(states, design, GradientWriter(reference, equations, members, weighed), grid)

    return prepare_native(reference, positions, compile_gradient)


def padded_width(count: int) -> int:
    """How many numbers a row of weights has: whole vectors of positions."""
    return LANES * -(-count // LANES)


class NativeGradient:
    """One function's calls, over the same positions always; from any thread. Raises UnsupportedOperation."""

    def __init__(
        self, states: CompiledRun | NewtonRun, design: DesignNumbers, writer: GradientWriter, grid: RunPositions
    ):
        """`states` and `design` have the same values, in one order."""
        wanted = range(grid.lead, len(grid.u), grid.every)
        call = states.run_call()
        self._width = padded_width(len(wanted))
        ir, inputs = writer.write(design, call, wanted, self._width)
        self._states, self._own = states, design.own_values
        self._function: Any = compile_function(ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        at = grid.u[wanted]
        whole = np.concatenate([at, np.repeat(at[-1:], self._width - len(at), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self._drive = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in inputs])
        run = ctypes.cast(call.function, ctypes.c_void_p).value or 0
        context = [self._own.ctypes.data, self._drive.ctypes.data, run, call.context]
        self._context = np.array(context, dtype=np.int64)
        self._pointer = self._context.ctypes.data
        self._told = TOLD + 1 + len(writer.equations.names)
        self._room = call.room + WIDEST_VECTOR_BYTES // 8

    def __call__(self, values: Mapping[str, float], weights: Array) -> tuple[list[float], float, int]:
        """See `prepare_native_gradient`."""
        names, states = tuple(values), self._states
        pack, _, places = states.bound.get(names) or states.bind(names)
        out = np.empty(self._told + self._room)
        told = address_of(out)
        room = told + 8 * self._told
        room += -room % WIDEST_VECTOR_BYTES
        self._function(self._pointer, places, pack(*values.values()), address_of(weights), room, told, 1)
        ending, good, *found = out[: self._told].tolist()
        return found, ending, int(good)

    def run_designs(self, names: tuple[str, ...], designs: Array, weights: Array) -> tuple[Array, Array]:
        """The sums with their derivatives (designs, 1 + names), and how the runs end (designs,), of designs (designs,
        given names) and weights (designs, pairs of rows, width, 2)."""
        _, _, places = self._states.bound.get(names) or self._states.bind(names)
        given = np.ascontiguousarray(designs, dtype=float)
        out, room = np.empty((len(given), self._told)), np.empty(self._room)
        first = address_of(room)
        first += -first % WIDEST_VECTOR_BYTES
        self._function(
            self._pointer, places, given.ctypes.data, weights.ctypes.data, first, out.ctypes.data, len(given)
        )
        out[out[:, 1] == 0.0, TOLD:] = 0.0
        return out[:, TOLD:], out[:, 0]
