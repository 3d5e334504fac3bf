"""Blocks in closed form joined one after the other, designs in the lanes, as one function of LLVM IR."""

from __future__ import annotations

from functools import lru_cache
from math import inf
from typing import NamedTuple

import numpy as np

from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations, batch_equations, operand_rows
from planar.batch.march.kernel_writer import KernelWriter, OperandNames, write_nearest, write_squared_distance
from planar.codegen.llvm_compile import compile_function
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.turns import leave_turn

Array = np.ndarray

LANES = 8
LONG_CALL_DESIGNS = 2**9
"""Designs from which on other threads go on meanwhile."""
FUNCTION_NAME = "join"
JOINED_ROWS = 4
"""Rows that are told of a block where the sketch chooses, see `JoinedBlocks`."""


class JoinedBlocks(NamedTuple):
    """Designs joined block after block, each array (blocks, designs): the sign of the assembly that was taken; the
    squared distance of the block's sketched points from where they are shown (sizes), in that assembly, and in the
    other, infinite where the sign was forced; how near the two are to where they meet, 1 there, beyond it there is
    none.

    state (operands, designs): the unknowns as the kernel's operands, cos and sin of angles. What comes after a block
    that cannot be joined is no number.
    """

    signs: Array
    distances: Array
    other_distances: Array
    coalescences: Array
    state: Array


class BlockJoinWriter(KernelWriter):
    """The text of the function; `point_blocks`: of the block that places each sketched point, None without a sketch."""

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        point_blocks: tuple[int, ...] | None,
        lanes: int = LANES,
    ):
        super().__init__(equations, links, False, lanes)
        self.point_blocks = point_blocks

    def write_block(
        self, part: KernelBlock, names: OperandNames, forced: str | None = None
    ) -> tuple[str, str, str, str]:
        """Join a block: put into `names` the unknowns and the sign of the assembly nearer to the sketch, or of that of
        the sign `forced` where it is not zero. Return the sign, the squared distance, that of the other assembly,
        infinite where a sign is forced, and the coalescence.

        `names` has p, q, the inputs, and ("sketch", k) of where the points are shown.
        """
        t, sign_operand = self.ir, ("sign", self.sign_index[part.block.block_index])
        operands = [sign_operand, *self.closed_form_operands(part)]
        assemblies = [names | {sign_operand: t.constant(sign)} for sign in (1.0, -1.0)]
        coalescence, _ = (self.write_closed_form(part, assembly) for assembly in assemblies)
        options = []
        for assembly in assemblies:
            distance = self.write_distance(part, assembly)
            if forced is not None:
                is_other = t.compare("olt", t.binary("mul", forced, assembly[sign_operand]), t.constant(0.0))
                distance = t.select(is_other, t.constant(inf), distance)
            options.append(([assembly[operand] for operand in operands], distance))
        values, distance, other_distance = write_nearest(t, options)
        names.update(zip(operands, values, strict=True))
        return names[sign_operand], distance, other_distance, coalescence

    def write_distance(self, part: KernelBlock, names: OperandNames) -> str:
        """The squared distance of a block's sketched points from where they are shown."""
        points = [k for k, block in enumerate(self.point_blocks or ()) if block == part.block.block_index]
        coordinates = self.write_values([self.point_coordinates(points)], names)
        shown = [names["sketch", 2 * k + axis] for k in points for axis in range(2)]
        return write_squared_distance(self.ir, coordinates, shown)

    def write(self) -> str:
        """The complete function; without a sketch it takes the assemblies of the signs and gives the state alone."""
        t, rows = self.ir, list[str]()
        self.write_header(FUNCTION_NAME, ("p", "q", "drive", "sign", "sketch"))
        sketch: OperandNames = {}
        if self.point_blocks is not None:
            for k in range(2 * len(self.links)):
                number = t.add_instruction(f"load double, ptr {t.double_pointer('%sketch', str(k))}")
                sketch["sketch", k] = t.broadcast(number)
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        names = sketch | self.load_designs()
        for k, part in enumerate(self.equations.blocks):
            if self.point_blocks is None:
                self.write_closed_form(part, names)
            else:
                rows += self.write_block(part, names, names["sign", k])
        for k, value in enumerate([*rows, *(names[operand] for operand in self.state_operands())]):
            t.store(value, self.entry_pointer("%out", k))
        return self.close_function("block")

    def write_header(self, name: str, arrays: tuple[str, ...]) -> None:
        """The beginning of a function of blocks of designs, the last of which may lie over the one before.

        name(blocks, last, width, *arrays, out): the last block begins at design `last`; rows are `width` apart.
        """
        pointers = ", ".join(f"ptr noalias readonly %{array}" for array in arrays)
        self.ir.write_line(f"define void @{name}(i64 %blocks, i64 %last, i64 %width, {pointers}, ptr noalias %out) {{")
        self.ir.write_label("entry")

    def load_designs(self) -> OperandNames:
        """A block of designs, the number %b, begins: its numbers, inputs and signs."""
        t = self.ir
        first = t.add_instruction(f"mul i64 %b, {t.lanes}")
        past = t.add_instruction(f"icmp sgt i64 {first}, %last")
        self.lane = t.add_instruction(f"select i1 {past}, i64 %last, i64 {first}")
        names = self.load_numbers()
        names |= {operand: self.load_entry("%drive", k) for k, operand in enumerate(self.equations.input_operands)}
        return names | {("sign", k): self.load_entry("%sign", k) for k in range(len(self.equations.blocks))}

    def close_function(self, again: str) -> str:
        """The end of the function, where the label `again` begins the next block of designs; the complete text."""
        self.ir.close_loop("b", "blocks", again, "done")
        self.ir.write_label("done")
        self.ir.write_line("ret void")
        self.ir.write_line("}")
        return self.ir.module_text()


class BlockJoiner:
    """Joins the blocks of the designs of a batch: with points by the sketch, see `join`, without by `follow`.

    `state`: what stands for the unknowns. Raises UnsupportedOperation, and BareAngle where an angle counts its turns.
    """

    def __init__(self, equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...] | None):
        writer = BlockJoinWriter(equations, links, point_blocks)
        self.equations, self.text, self.state = equations, writer.write(), writer.state_operands()

    def join(self, batch: DesignBatch, sketch: Array, forced: Array) -> JoinedBlocks:
        """At the inputs u0 of a batch, whose points are the sketched ones, each block in the assembly whose points lie
        nearer to the sketch.

        sketch (points, 2), in sizes; forced (blocks, designs): the sign of a block's assembly, 0 where it is free.
        """
        count = JOINED_ROWS * len(self.equations.blocks)
        rows = (batch.p, batch.q, operand_rows(self.equations.input_operands, batch.u0), forced)
        out = call_with_designs(self.text, FUNCTION_NAME, rows, sketch, count + len(self.state))
        signs, distances, other_distances, coalescences = (out[k:count:JOINED_ROWS] for k in range(JOINED_ROWS))
        return JoinedBlocks(signs, distances, other_distances, coalescences, out[count:])

    def follow(self, batch: DesignBatch, signs: Array, u: Array) -> Array:
        """The state (operands, designs) at inputs u (inputs, designs), in the assemblies of these signs (blocks,
        designs)."""
        rows = (batch.numbers, batch.q, operand_rows(self.equations.input_operands, u), signs)
        return call_with_designs(self.text, FUNCTION_NAME, rows, np.zeros(0), len(self.state))


def call_with_designs(text: str, name: str, rows: tuple[Array, ...], common: Array, row_count: int) -> Array:
    """out (rows, designs) by the function of a text, of designs whose rows (..., designs) it takes, and what is common
    to all."""
    count = rows[0].shape[1]
    if not count:
        return np.empty((row_count, 0))
    if count < LANES:  # those that do not fill the lanes, with copies of the last beside them
        which = np.minimum(np.arange(LANES), count - 1)
        return call_with_designs(text, name, tuple(row[:, which] for row in rows), common, row_count)[:, :count]
    arrays = [np.ascontiguousarray(array, dtype=float) for array in (*rows, common)]
    out = np.empty((row_count, count))
    function = compile_function(text, name, *("int",) * 3, *("array",) * (len(arrays) + 1))
    with leave_turn(count >= LONG_CALL_DESIGNS):
        function(-(-count // LANES), count - LANES, count, *(array.ctypes.data for array in (*arrays, out)))
    return out


def find_joiner(batch: DesignBatch, point_blocks: tuple[int, ...] | None) -> BlockJoiner | None:
    """What joins the blocks of a batch, whose points are placed by these blocks; None where one is not in closed
    form, or stands in an angle's own value."""
    try:
        equations = batch_equations(batch)
    except UnsupportedOperation:
        return None
    if equations.has_newton_blocks or not equations.blocks:
        return None
    return _make_joiner(equations, () if point_blocks is None else batch.links, point_blocks)


@lru_cache(maxsize=256)
def _make_joiner(
    equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...] | None
) -> BlockJoiner | None:
    try:
        return BlockJoiner(equations, links, point_blocks)
    except (UnsupportedOperation, BareAngle):
        return None
