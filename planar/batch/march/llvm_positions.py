"""One linkage at many positions of its inputs, these in the lanes, as one function of LLVM IR.

Only where every block is in closed form: then nothing goes from one position to the next but the signs of the blocks.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.kernel import BareAngle, KernelEquations, Operand
from planar.batch.march.llvm_kernel import KernelWriter, OperandNames
from planar.batch.march.prediction import MAX_TURN_PER_STEP
from planar.batch.march.regularity import LEAST_KERNEL_REGULARITY
from planar.codegen.instructions import UnsupportedOperation
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter

Array = np.ndarray

LANES = 16
FUNCTION_NAME = "turn"
ARGUMENT_TYPES = ("int", "int", "array", "array", "float", "float", "array", "array")
"""Of the function's arguments: blocks of positions, how many positions; numbers, drives; tolerance, scale; out,
fine."""


class PositionsKernelLayout(NamedTuple):
    """numbers: what is the same at every position, one after the other; drives: rows of cos, sin and value of what is
    given; out: rows that are told, of which the last are counted angles and the blocks' bends."""

    numbers: tuple[Operand, ...]
    inputs: tuple[Operand, ...]
    output_row_count: int
    ir: str


class _PositionsKernelWriter(KernelWriter):
    def __init__(self, equations: KernelEquations, links: tuple[str, ...], rates: bool):
        super().__init__(equations, links, rates, LANES, frozenset({"p", "q", "u1", "u2", "sign"}), frozenset())
        if any(part.closed_form is None for part in equations.blocks):
            raise UnsupportedOperation("a group is not in closed form")
        sizes = {name: self.symbols[name].numel() for name in ("p", "q", "sign", *(("u1", "u2") if rates else ()))}
        self.numbers = tuple((name, k) for name, size in sizes.items() for k in range(size))

    def write(self) -> PositionsKernelLayout:
        """The whole function: blocks of positions, then whether the blocks keep clear of their dead points."""
        t, of = self.ir, self.equations
        t.write_line(
            f"define void @{FUNCTION_NAME}(i64 %blocks, i64 %positions, ptr noalias readonly %numbers, "
            "ptr noalias readonly %drive, double %tolerance, double %scale, ptr noalias %out, ptr noalias %fine) {"
        )
        t.write_label("entry")
        self.passed_slot = t.allocate()
        t.store(t.constant(1.0), self.passed_slot)
        self.width = t.add_instruction(f"mul i64 %blocks, {t.lanes}")
        scale = t.broadcast("%scale")
        have: OperandNames = {
            leaf: t.broadcast(t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(k))}"))
            for k, leaf in enumerate(self.numbers)
        }
        t.mark_hoist_point()
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        first = t.add_instruction(f"mul i64 %b, {t.lanes}")
        have |= {leaf: t.load(self._row_pointer("%drive", k, first)) for k, leaf in enumerate(self.input_operands)}
        bends = [self.write_closed_form(part, have) for part in of.blocks]
        left, counted, *values = self.write_separately(
            [of.residuals(), self.counted_angles(), *self.output_expressions()], have
        )
        worst = t.add_all(
            [t.constant(0.0), *(t.call_intrinsic("fabs", each) for each in (*left, *self.write_circle_residuals(have)))]
        )
        self._write_condition(t.compare("ole", worst, t.broadcast("%tolerance")))
        rows = [*(t.binary("mul", scale, each) for part in values for each in part), *counted, *bends]
        for k, each in enumerate(rows):
            t.store(each, self._row_pointer("%out", k, first))
        t.close_loop("b", "blocks", "block", "after")
        t.write_label("after")
        first_bend = len(rows) - len(bends)
        self._write_between_checks(t, range(first_bend - len(counted), first_bend), range(first_bend, len(rows)))
        t.write_line("ret void")
        t.write_line("}")
        return PositionsKernelLayout(self.numbers, self.input_operands, len(rows), t.module_text())

    def _row_pointer(self, base: str, k: int, first: str) -> str:
        t = self.ir
        return t.double_pointer(
            base, t.add_instruction(f"add i64 {t.add_instruction(f'mul i64 {self.width}, {k}')}, {first}")
        )

    def _write_condition(self, flag: str) -> None:
        t = self.ir
        t.store(t.select_or_zero(flag, t.load(self.passed_slot)), self.passed_slot)

    def _write_between_checks(self, t: IRWriter, angles: Sequence[int], bends: Sequence[int]) -> None:
        """Between positions too no bend reaches one, by as much as it bends over three of them; no counted angle goes
        far."""
        if not bends and not angles:
            t.store(t.load(self.passed_slot), "%fine")
            return
        t.write_line("br label %judge")
        t.write_label("judge")
        t.write_line("%j = phi i64 [0, %after], [%jnext, %judge]")
        first = t.add_instruction(f"mul i64 %j, {t.lanes}")
        places = t.add_instruction(
            f"insertelement <{t.lanes} x i64> poison, i64 {t.add_instruction('sub i64 %positions, 2')}, i64 0"
        )
        for k in angles:
            one, two, three = (
                t.load(self._row_pointer("%out", k, t.add_instruction(f"add i64 {first}, {ahead}")))
                for ahead in range(3)
            )
            for before, after in ((one, two), (two, three)):
                far = t.call_intrinsic("fabs", t.binary("sub", after, before))
                self._write_condition(
                    t.or_flags(t.compare("ole", far, t.constant(MAX_TURN_PER_STEP)), t.lanes_from(first, places))
                )
        for k in bends:
            one, two, three = (
                t.load(self._row_pointer("%out", k, t.add_instruction(f"add i64 {first}, {ahead}")))
                for ahead in range(3)
            )
            change = t.binary("sub", t.binary("add", one, three), t.binary("add", two, two))
            kept = t.binary("mul", t.call_intrinsic("fabs", change), t.constant(0.5))
            least = t.call_intrinsic(
                "minnum",
                t.call_intrinsic("minnum", self._write_bend_margin(one), self._write_bend_margin(two)),
                self._write_bend_margin(three),
            )
            flag = t.compare("oge", t.binary("sub", least, kept), t.constant(LEAST_KERNEL_REGULARITY**2))
            self._write_condition(t.or_flags(flag, t.lanes_from(first, places)))
        t.close_loop("j", "blocks", "judge", "done")
        t.write_label("done")
        t.store(t.load(self.passed_slot), "%fine")

    def _write_bend_margin(self, bend: str) -> str:
        return self.ir.binary("sub", self.ir.constant(1.0), bend)


@lru_cache(maxsize=256)
def write_positions_kernel(structure: KernelEquations, links: tuple[str, ...], rates: bool) -> PositionsKernelLayout:
    """The function of a structure for points on these links, none of which is the frame. Raises
    UnsupportedOperation."""
    try:
        return _PositionsKernelWriter(structure, links, rates).write()
    except BareAngle as angle:
        raise UnsupportedOperation(f"an angle counts its turns: {angle.operand}") from None


class PositionsKernel:
    """A function ready to be called, always at the same positions u (positions, inputs) of the inputs, three at least.

    Raises UnsupportedOperation.
    """

    def __init__(self, structure: KernelEquations, links: tuple[str, ...], rates: bool, u: Array):
        self.layout = write_positions_kernel(structure, links, rates)
        self.function: Any = compile_function(self.layout.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        self.position_count, self.row_count = len(u), self.layout.output_row_count
        if self.position_count < 3:
            raise UnsupportedOperation("two positions do not show what lies between them")
        self.lane_blocks = -(-self.position_count // LANES)
        # those that do not fill the lanes are the last again
        whole = np.concatenate([u, np.repeat(u[-1:], self.lane_blocks * LANES - len(u), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self.input_rows = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in self.layout.inputs])
        self.passed = np.zeros(LANES)
        self._input_rows_pointer, self._passed_pointer = self.input_rows.ctypes.data, self.passed.ctypes.data

    def pack_numbers(self, **rows: Array) -> Array:
        """The numbers of a linkage: p, q, sign, u1, u2, each a row."""
        return np.array([rows[name][k] for name, k in self.layout.numbers])

    def __call__(self, numbers: Array, tolerance: float, scale: float) -> tuple[Array, bool]:
        """x and y of every point, then with rates their first and second rates, (rows, positions), times `scale`; and
        whether all passed both checks."""
        width = self.lane_blocks * LANES
        # two more positions than there are may be looked at
        out = np.empty(self.row_count * width + 2)
        self.function(
            self.lane_blocks,
            self.position_count,
            numbers.ctypes.data,
            self._input_rows_pointer,
            tolerance,
            scale,
            out.ctypes.data,
            self._passed_pointer,
        )
        return out[:-2].reshape(self.row_count, width)[:, : self.position_count], bool(self.passed.min() == 1.0)
