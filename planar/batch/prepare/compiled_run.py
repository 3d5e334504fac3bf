"""One linkage's runs as one compiled function: values of a design in, positions and rates out."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.llvm_ending import PositionRows
from planar.batch.prepare.llvm_numbers import FUNCTION_NAME as NUMBERS_FUNCTION
from planar.batch.prepare.llvm_numbers import SAID, write_numbers
from planar.batch.prepare.llvm_positions import FUNCTION_NAME as POSITIONS_FUNCTION
from planar.batch.prepare.llvm_positions import (
    LANES,
    write_positions,
)
from planar.batch.prepare.llvm_start import FUNCTION_NAME as START_FUNCTION
from planar.batch.prepare.llvm_start import write_start
from planar.batch.prepare.run_endings import ALL_SOLVED, DEAD_POINT, STOP
from planar.batch.prepare.value_binder import RunCall, ValueBinder, address_of
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.instruction_list import UnsupportedOperation

Array = np.ndarray

FUNCTION_NAME = "run"
ARGUMENT_TYPES = ("array",) * 4
"""Of the function's arguments: what does not change from call to call; places of values that are given, these; out."""
CONTEXT = ("own values", "drive", "blocks", "positions")
"""What does not change, each of eight bytes: addresses and whole numbers."""


class RunLayout(NamedTuple):
    """The text of the function `run`, what it writes, and of what the rows of given inputs are cos, sin and value."""

    ir: str
    rows: PositionRows
    inputs: tuple[Operand, ...]


def write_run(design: DesignNumbers, links: tuple[str, ...], rates: bool, states: bool = False) -> RunLayout:
    """The function for points on these links, or for the states. Raises UnsupportedOperation."""
    equations = design.equations("q")
    signs = [("sign", k) for k in range(len(equations.closed_forms))]
    order: list[Operand] = [*design.numbers, SAID, *signs]
    positions = write_positions(equations, links, rates, order, states)
    numbers, start = write_numbers(design, order), write_start(design.equations("at"), design.sketched, order)
    t = IRWriter(1)
    t.write_line(f"define void @{FUNCTION_NAME}(ptr %context, ptr %places, ptr %given, ptr %out) {{")
    t.write_label("entry")
    own, drive, blocks, many = (
        t.add_instruction(f"load {kind}, ptr {t.double_pointer('%context', str(k))}")
        for k, kind in enumerate(("ptr", "ptr", "i64", "i64"))
    )
    t.write_line(f"%numbers = alloca [{len(order)} x double], align 64")
    t.write_line(f"call void @{NUMBERS_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %numbers)")
    said_row = t.add_instruction(f"mul i64 {blocks}, {LANES * positions.rows.row_count}")
    ending = t.double_pointer("%out", said_row)
    said = t.double_pointer("%numbers", str(order.index(SAID)))
    fit = t.add_instruction(f"load double, ptr {said}")
    t.write_line(f"store double {fit}, ptr {ending}")
    t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {fit}, {ALL_SOLVED}')}, label %fits, label %ends")
    t.write_label("fits")
    t.write_line(f"call void @{START_FUNCTION}(ptr %numbers)")
    begins = t.add_instruction(f"load double, ptr {said}")
    t.write_line(f"store double {begins}, ptr {ending}")
    t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {begins}, {ALL_SOLVED}')}, label %begins, label %ends")
    t.write_label("begins")
    t.write_line(
        f"call void @{POSITIONS_FUNCTION}(i64 {blocks}, i64 {many}, ptr %numbers, ptr {drive}, ptr %out, ptr {ending})"
    )
    t.write_line("ret void")
    t.write_label("ends")
    t.write_line("ret void")
    t.write_line("}")
    return RunLayout(t.module_text(numbers, start, *positions.writers), positions.rows, positions.inputs)


class CompiledRun:
    """The function ready to be called, always over the same positions of the inputs; from any thread.

    Raises UnsupportedOperation.
    """

    def __init__(self, design: DesignNumbers, links: tuple[str, ...], rates: bool, u: Array, states: bool = False):
        """u (positions, inputs): where the inputs are of a design that has them where the file has them.

        With `states` the rows are what stands for the unknowns, and not those of points.
        """
        if len(u) < 3:
            raise UnsupportedOperation("two positions do not show what lies between them")
        layout = write_run(design, links, rates, states)
        self._function: Any = compile_function(layout.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        blocks = -(-len(u) // LANES)
        width = blocks * LANES
        # those that do not fill the lanes are the last again
        whole = np.concatenate([u, np.repeat(u[-1:], width - len(u), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self._drive = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in layout.inputs])
        self._own = design.own_values
        self._context = np.array([self._own.ctypes.data, self._drive.ctypes.data, blocks, len(u)], dtype=np.int64)
        self._context_pointer = self._context.ctypes.data
        self._shape = layout.rows.row_count + 1, width
        self._told, self._positions, self._ending = layout.rows.told, len(u), layout.rows.row_count * width
        binder = ValueBinder(design.index)
        self.bind, self.bound = binder.bind, binder.bound

    def __call__(self, values: Mapping[str, float]) -> tuple[Array, float, int]:
        """See `native_run.NativeRun`."""
        names = tuple(values)
        pack, _, places = self.bound.get(names) or self.bind(names)
        out = np.empty(self._shape)
        self._function(self._context_pointer, places, pack(*values.values()), address_of(out))
        ending = out.item(self._ending)
        rows = out[: self._told, : self._positions]
        return rows, ending, int(out.item(self._ending + 1)) if ending in (DEAD_POINT, STOP) else 0

    def run_call(self) -> RunCall:
        """How other compiled code runs it."""
        rows, width = self._shape
        return RunCall(self._function, self._context_pointer, rows * width, None, self._ending, 0, width)
