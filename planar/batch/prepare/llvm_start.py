"""The assembly at the start as an LLVM function: both of every block in closed form, all combinations in the lanes.

The sketch chooses: the combination whose sketched points lie nearest to where it shows them. Beyond `ENUMERATED_BLOCKS`
every block takes the nearer of its two; what its other one, or a block that is neither clearly joined nor clearly open,
might yet give bounds what else there may be from below, since squared distances never fall as blocks are added.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import inf

from planar.batch.closed_form.joined_blocks import BlockJoinWriter
from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations, Operand
from planar.batch.march.kernel_writer import OperandNames
from planar.batch.prepare.design_numbers import SAID
from planar.batch.prepare.run_calls import ALL_SOLVED, CANNOT_BE_ASSEMBLED, CLEARLY_OPEN, UNSURE
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.instruction_list import UnsupportedOperation
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE

START_FUNCTION = "start"
ENUMERATED_BLOCKS = 4
"""Blocks of whose assemblies all combinations are tried."""


def write_start(
    equations: KernelEquations, sketched: Sequence[tuple[int, str, str, str]], order: Sequence[Operand]
) -> IRWriter:
    """The function: reads a design's numbers and writes its signs and what it says to their places in the order.

    `sketched`: as `DesignNumbers.sketched`. Raises UnsupportedOperation.
    """
    try:
        return _StartWriter(equations, sketched, order).write_function()
    except BareAngle as angle:
        raise UnsupportedOperation(f"an angle counts its turns: {angle.operand}") from None


class _StartWriter(BlockJoinWriter):
    def __init__(
        self,
        equations: KernelEquations,
        sketched: Sequence[tuple[int, str, str, str]],
        order: Sequence[Operand],
    ):
        self.enumerated = min(len(equations.blocks), ENUMERATED_BLOCKS)
        blocks, links = tuple(block for block, *_ in sketched), tuple(link for *_, link, _ in sketched)
        super().__init__(equations, links, blocks, 2**self.enumerated)
        if any(part.closed_form is None for part in equations.blocks):
            raise UnsupportedOperation("a group is not in closed form")
        if set(blocks) < {part.block.block_index for part in equations.blocks}:
            raise UnsupportedOperation("the sketch does not show every group")
        self.order = order

    def write_function(self) -> IRWriter:
        """The whole function."""
        t = self.ir
        t.write_line(f"define internal void @{START_FUNCTION}(ptr noalias %numbers) {{")
        t.write_label("entry")
        have: OperandNames = {}
        for k, operand in enumerate(self.order):
            if operand[0] in ("p", "u", "uc", "us", "at", "sketch"):
                number = t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(k))}")
                have["q" if operand[0] == "at" else operand[0], operand[1]] = t.broadcast(number)
        self.total, self.otherwise = t.constant(0.0), t.constant(inf)
        for k, part in enumerate(self.equations.blocks):
            if k < self.enumerated:
                lanes = range(t.lanes)
                have["sign", k] = t.constants([1.0 if lane >> k & 1 else -1.0 for lane in lanes])
                bend = self.write_closed_form(part, have)
                self._add_block(part, bend, self._write_distance(part, have))
            else:
                self._write_nearer(part, k, have)
        self._write_choice(have)
        t.write_line("ret void")
        t.write_line("}")
        return t

    def _write_nearer(self, part: KernelBlock, k: int, have: OperandNames) -> None:
        """A block in the nearer of its assemblies."""
        t = self.ir
        found = self.write_block(part, have, "zeroinitializer")
        have["sign", k] = found.sign
        farther = t.binary("add", self.total, found.other_distance)
        joined = t.compare("olt", found.coalescence, t.constant(MEETING_COSINE_SQUARED))
        self.otherwise = t.call_intrinsic("minnum", self.otherwise, t.select(joined, farther, t.constant(inf)))
        self._add_block(part, found.coalescence, found.distance)

    def _add_block(self, part: KernelBlock, bend: str, cost: str) -> None:
        """A block more: of lanes in which it is joined, of those in which it may be, and of those in which it cannot
        be."""
        t = self.ir
        never = t.constant(inf)
        joined = t.compare("olt", bend, t.constant(MEETING_COSINE_SQUARED))
        assert part.closed_form is not None
        known = joined
        if part.closed_form.squared_arm is None:
            known = t.or_flags(joined, t.compare("oge", bend, t.constant(CLEARLY_OPEN)))
        # of a lane that had ended the total is infinite already
        self.otherwise = t.call_intrinsic("minnum", self.otherwise, t.select(known, never, self.total))
        self.total = t.select(joined, t.binary("add", self.total, cost), never)

    def _write_choice(self, have: OperandNames) -> None:
        """The nearest of all lanes, if it is clearly that."""
        t = self.ir
        count = len(self.equations.blocks)
        best = t.broadcast(t.reduce("fmin", self.total))
        nearest = t.compare("ole", self.total, best)
        rest = t.call_intrinsic("minnum", self.total, self.otherwise)
        other = t.broadcast(t.reduce("fmin", t.select(nearest, self.otherwise, rest)))
        single = t.broadcast(t.reduce("fadd", t.select_or_zero(nearest, t.constant(1.0))))
        beyond = t.binary("add", best, t.constant((count + 1) * EQUAL_DISTANCE_TOLERANCE))
        sure = t.and_flags(
            t.compare("olt", best, t.constant(inf)),
            t.and_flags(t.compare("oeq", single, t.constant(1.0)), t.compare("ogt", other, beyond)),
        )
        none = t.compare("oeq", t.call_intrinsic("minnum", best, other), t.constant(inf))
        said = t.select(
            sure, t.constant(ALL_SOLVED), t.select(none, t.constant(CANNOT_BE_ASSEMBLED), t.constant(UNSURE))
        )
        places = {operand: k for k, operand in enumerate(self.order)}
        self._store_number(said, places[SAID])
        for k in range(count):
            chosen = t.select_or_zero(nearest, have["sign", k])
            total = t.reduce("fadd", chosen)
            t.write_line(f"store double {total}, ptr {t.double_pointer('%numbers', str(places['sign', k]))}")

    def _store_number(self, value: str, place: int) -> None:
        t = self.ir
        first = t.add_instruction(f"extractelement {t.vector} {value}, i64 0")
        t.write_line(f"store double {first}, ptr {t.double_pointer('%numbers', str(place))}")
