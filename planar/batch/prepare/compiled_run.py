"""One linkage's runs as one compiled function: values of a design in, positions and rates out."""

from __future__ import annotations

import ctypes
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.kernel import KernelEquations, Operand
from planar.batch.prepare.design_numbers import DesignNumbers
from planar.batch.prepare.llvm_ending import PositionRows
from planar.batch.prepare.llvm_numbers import FUNCTION_NAME as NUMBERS_FUNCTION
from planar.batch.prepare.llvm_numbers import IS_FIT, write_numbers
from planar.batch.prepare.llvm_positions import FUNCTION_NAME as POSITIONS_FUNCTION
from planar.batch.prepare.llvm_positions import (
    LANES,
    write_positions,
)
from planar.batch.prepare.llvm_start import FUNCTION_NAME as START_FUNCTION
from planar.batch.prepare.llvm_start import SAID, write_start
from planar.batch.prepare.run_endings import DEAD_POINT, UNSURE
from planar.batch.prepare.value_binder import ValueBinder
from planar.codegen.instructions import UnsupportedOperation
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter

Array = np.ndarray

FUNCTION_NAME = "run"
ARGUMENT_TYPES = ("int", "int", "int", *("array",) * 5)
"""Of the function's arguments: blocks of positions, how many positions; how many values are given; all values of the
file's design, the places of those that are given, these; drive; out."""
HEADER = 8
"""Numbers at the head of `out`: how the run ended, and at which position."""


class RunLayout(NamedTuple):
    """The text of the function `run`, what it writes, and of what the rows of given inputs are cos, sin and value."""

    ir: str
    rows: PositionRows
    inputs: tuple[Operand, ...]


def write_run(equations: KernelEquations, design: DesignNumbers, links: tuple[str, ...], rates: bool) -> RunLayout:
    """The function for points on these links. Raises UnsupportedOperation."""
    signs = [("sign", k) for k in range(len(equations.closed_forms))]
    order: list[Operand] = [*design.numbers, IS_FIT, SAID, *signs]
    positions = write_positions(equations, links, rates, order)
    numbers, start = write_numbers(design, order), write_start(equations, design.sketched, order)
    t = IRWriter(1)
    t.write_line(
        f"define void @{FUNCTION_NAME}(i64 %blocks, i64 %positions, i64 %many, ptr %own, ptr %places, ptr %given, "
        "ptr %drive, ptr %out) {"
    )
    t.write_label("entry")
    size = design.symbols.numel()
    t.write_line(f"%values = alloca [{size} x double], align 64")
    t.write_line(f"%numbers = alloca [{len(order)} x double], align 64")
    t.write_line(f"call void @llvm.memcpy.p0.p0.i64(ptr %values, ptr %own, i64 {8 * size}, i1 false)")
    t.write_line("%any = icmp sgt i64 %many, 0")
    t.write_line("br i1 %any, label %value, label %known")
    t.write_label("value")
    t.write_line("%k = phi i64 [0, %entry], [%knext, %value]")
    t.write_line("%at = getelementptr i64, ptr %places, i64 %k")
    t.write_line("%place = load i64, ptr %at")
    number = t.add_instruction(f"load double, ptr {t.double_pointer('%given', '%k')}")
    t.write_line(f"store double {number}, ptr {t.double_pointer('%values', '%place')}")
    t.close_loop("k", "many", "value", "known")
    t.write_label("known")
    t.write_line(f"call void @{NUMBERS_FUNCTION}(ptr %values, ptr %numbers)")
    t.write_line(f"store double {UNSURE}, ptr %out")
    fit, said = (
        t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(order.index(each)))}")
        if each == IS_FIT
        else t.double_pointer("%numbers", str(order.index(each)))
        for each in (IS_FIT, SAID)
    )
    t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {fit}, 1.0')}, label %fits, label %ends")
    t.write_label("fits")
    t.write_line(f"call void @{START_FUNCTION}(ptr %numbers)")
    begins = t.add_instruction(f"load double, ptr {said}")
    t.write_line(f"store double {begins}, ptr %out")
    t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {begins}, 0.0')}, label %begins, label %ends")
    t.write_label("begins")
    rows = t.double_pointer("%out", str(HEADER))
    t.write_line(
        f"call void @{POSITIONS_FUNCTION}(i64 %blocks, i64 %positions, ptr %numbers, ptr %drive, ptr {rows}, ptr %out)"
    )
    t.write_line("ret void")
    t.write_label("ends")
    t.write_line("ret void")
    t.write_line("}")
    t.write_line("declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)")
    return RunLayout(t.module_text(numbers, start, *positions.writers), positions.rows, positions.inputs)


class CompiledRun:
    """The function ready to be called, always over the same positions of the inputs; from any thread.

    Raises UnsupportedOperation.
    """

    def __init__(
        self, equations: KernelEquations, design: DesignNumbers, links: tuple[str, ...], rates: bool, u: Array
    ):
        """u (positions, inputs): where the inputs are of a design that has them where the file has them."""
        if len(u) < 3:
            raise UnsupportedOperation("two positions do not show what lies between them")
        layout = write_run(equations, design, links, rates)
        self._function: Any = compile_function(layout.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        self._rows = layout.rows
        blocks = -(-len(u) // LANES)
        self._width = blocks * LANES
        # those that do not fill the lanes are the last again
        whole = np.concatenate([u, np.repeat(u[-1:], self._width - len(u), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self._drive = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in layout.inputs])
        self._own = design.own_values
        self._counts = blocks, len(u)
        self._pointers = self._own.ctypes.data, self._drive.ctypes.data
        self._size = HEADER + layout.rows.row_count * self._width
        self._binder = ValueBinder(design.index)

    def __call__(self, values: Mapping[str, float]) -> tuple[Array, float, int]:
        """See `native_run.NativeRun`."""
        names = tuple(values)
        pack, _, places = self._binder.bind(names)
        out = np.empty(self._size)
        own, drive = self._pointers
        self._function(
            *self._counts,
            len(names),
            own,
            places,
            pack(*values.values()),
            drive,
            ctypes.addressof(ctypes.c_char.from_buffer(out)),  # type: ignore[arg-type]
        )
        told = self._rows.told
        rows = out[HEADER : HEADER + told * self._width].reshape(told, self._width)[:, : self._counts[1]]
        ending = out.item(0)
        return rows, ending, int(out.item(1)) if ending == DEAD_POINT else 0
