"""Blocks in closed form joined one after the other, designs in the lanes, as one function of LLVM IR."""

from __future__ import annotations

from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from planar.batch.closed_form.dead_points import (
    LEAST_ARM,
    MOST_WITHOUT_INTERVALS,
    SEARCH_NAME,
    DeadPointWriter,
)
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations, Operand, batch_equations, operand_rows
from planar.batch.march.kernel_writer import KernelWriter, OperandNames
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
    squared distance of the block's sketched points from where they are shown (sizes), in that assembly and in the
    other; how near the two are to where they meet, 1 there, beyond it there is none.

    state (operands, designs): the unknowns as the kernel's operands, cos and sin of angles. What comes after a block
    that cannot be joined is no number.
    """

    signs: Array
    distances: Array
    other_distances: Array
    coalescences: Array
    state: Array


class FollowedBlocks(NamedTuple):
    """Designs in assemblies that are known, each array (..., designs): how near the two of each block are to where they
    meet, as above (blocks, designs), no number where an arm on which a length turns is shorter than `LEAST_ARM`; behind
    these what reaches one where a pair meets its stop; and their state (operands, designs)."""

    coalescences: Array
    state: Array


class InputRanges(NamedTuple):
    """How one input of designs, `running`, goes on from where they start, each array (designs,), rad or sizes: how far
    it surely came, how far it is to go, to either side, and the steps in which it went."""

    running: int
    reached: Array
    lengths: Array
    step: Array


class DeadPoints(NamedTuple):
    """How far designs surely go (designs,), rad or sizes from their start: to a dead point, or infinitely where there
    is none up to the end; not a number where that is not decided. And the block that ends it, else -1; behind the
    blocks are the pairs with stops, which end designs alike, and then the input that runs with its own."""

    distance: Array
    block: Array


class StartBlock(NamedTuple):
    """Names of what is known of a block that was joined: see `JoinedBlocks`."""

    sign: str
    distance: str
    other_distance: str
    coalescence: str


class BlockJoinWriter(KernelWriter):
    """The text of the function; `point_blocks`: of the block that places each sketched point, None without a sketch."""

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        point_blocks: tuple[int, ...] | None,
        lanes: int = LANES,
    ):
        super().__init__(equations, links, False, lanes, frozenset(), frozenset())
        self.point_blocks = point_blocks

    def write_block(self, part: KernelBlock, names: OperandNames, forced: str) -> StartBlock:
        """Join a block: its unknowns put into `names`, those of the assembly nearer to the sketch unless it is forced.

        `names` has p, q, the inputs, and ("sketch", k) of where the points are shown.
        """
        t, sign_operand = self.ir, ("sign", self.sign_index[part.block.block_index])
        ways = [{**names, sign_operand: t.constant(sign)} for sign in (1.0, -1.0)]
        coalescence, _ = (self.write_closed_form(part, way) for way in ways)
        left, right = (self._write_distance(part, way) for way in ways)
        nearer = t.select(t.compare("ole", left, right), t.constant(1.0), t.constant(-1.0))
        sign = t.select(t.compare("oeq", forced, "zeroinitializer"), nearer, forced)
        is_left = t.compare("ogt", sign, "zeroinitializer")
        for operand in self.closed_form_operands(part):
            names[operand] = t.select(is_left, *(way[operand] for way in ways))
        return StartBlock(sign, t.select(is_left, left, right), t.select(is_left, right, left), coalescence)

    def _write_distance(self, part: KernelBlock, names: OperandNames) -> str:
        """The squared distance of a block's sketched points from where they are shown."""
        t = self.ir
        points = [k for k, block in enumerate(self.point_blocks or ()) if block == part.block.block_index]
        at = self.write_values([self.point_coordinates(points)], names)
        shown = [names["sketch", 2 * k + axis] for k in points for axis in range(2)]
        gaps = [t.binary("sub", *both) for both in zip(at, shown, strict=True)]
        return t.add_all([t.constant(0.0), *(t.binary("mul", gap, gap) for gap in gaps)])

    def write(self) -> str:
        """The whole function: blocks of designs, the last of which may lie over the one before."""
        t = self.ir
        arrays = ", ".join(f"ptr noalias readonly %{name}" for name in ("p", "q", "drive", "sign", "sketch"))
        t.write_line(f"define void @{FUNCTION_NAME}(i64 %blocks, i64 %last, i64 %width, {arrays}, ptr noalias %out) {{")
        t.write_label("entry")
        names: OperandNames = {}
        if self.point_blocks is not None:
            for k in range(2 * len(self.links)):
                number = t.add_instruction(f"load double, ptr {t.double_pointer('%sketch', str(k))}")
                names["sketch", k] = t.broadcast(number)
        t.write_line("br label %block")
        t.write_label("block")
        t.write_line("%b = phi i64 [0, %entry], [%bnext, %block]")
        first = t.add_instruction(f"mul i64 %b, {t.lanes}")
        past = t.add_instruction(f"icmp sgt i64 {first}, %last")
        self.lane = t.add_instruction(f"select i1 {past}, i64 %last, i64 {first}")
        count = self.symbols["p"].numel()
        names |= {("p", k): self.load_entry("%p", k) for k in range(count)}
        names |= self.stop_number_names(partial(self.load_entry, "%p"))
        names |= {("q", k): self.load_entry("%q", k) for k in range(2 * len(self.links))}
        names |= {operand: self.load_entry("%drive", k) for k, operand in enumerate(self.input_operands)}
        rows: list[str] = []
        arms: list[str] = []
        for k, part in enumerate(self.equations.blocks):
            sign = self.load_entry("%sign", k)
            if self.point_blocks is None:
                names["sign", k] = sign
                self.write_closed_form(part, names)
                form = self.equations.closed_forms[k]
                rows += self.write_values([form.coalescence], names)
                arms += [] if form.squared_arm is None else self.write_values([form.squared_arm], names)
            else:
                rows += self.write_block(part, names, sign)
        rows += self.write_stops(names) if self.point_blocks is None else []
        state = [names[operand] for operand in self.state_operands()]
        for k, value in enumerate([*rows, *state, *arms]):
            t.store(value, self.entry_pointer("%out", k))
        t.close_loop("b", "blocks", "block", "done")
        t.write_label("done")
        t.write_line("ret void")
        t.write_line("}")
        return t.module_text()


class _JoinText(NamedTuple):
    """The text of a function that joins blocks, and what stands for the unknowns in it."""

    text: str
    state: tuple[Operand, ...]


@lru_cache(maxsize=256)
def _write_join(equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...] | None) -> _JoinText:
    """The text of the function. Raises UnsupportedOperation."""
    try:
        writer = BlockJoinWriter(equations, links, point_blocks)
        return _JoinText(writer.write(), writer.state_operands())
    except BareAngle as angle:
        raise UnsupportedOperation(f"an angle counts its turns: {angle.operand}") from None


class BlockJoiner:
    """Joins the blocks of the designs of a batch. Raises UnsupportedOperation."""

    def __init__(self, equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...]):
        self.equations = equations
        self.block_count = len(equations.blocks)
        self.joining_text = _write_join(equations, links, point_blocks).text if point_blocks else ""
        "what needs sketched points"
        self.following_text, self.state = _write_join(equations, (), None)
        self.search_texts: dict[int, str] = {}
        "for dead points, by the input that runs"

    def join(self, batch: DesignBatch, sketch: Array, forced: Array) -> JoinedBlocks:
        """At the inputs u0 of a batch, whose points are the sketched ones, each block in the assembly whose points lie
        nearer to the sketch.

        sketch (points, 2), in sizes; forced (blocks, designs): the sign of a block's assembly, 0 where it is free.
        """
        row_count = JOINED_ROWS * self.block_count + len(self.state)
        rows = (batch.p, batch.q, operand_rows(self.equations.input_operands, batch.u0), forced)
        out = _call(self.joining_text, FUNCTION_NAME, rows, sketch, row_count)
        known = out[: JOINED_ROWS * self.block_count].reshape(self.block_count, JOINED_ROWS, -1).transpose(1, 0, 2)
        return JoinedBlocks(known[0], known[1], known[2], known[3], out[JOINED_ROWS * self.block_count :])

    def follow(self, batch: DesignBatch, signs: Array, u: Array) -> FollowedBlocks:
        """At inputs u (inputs, designs), in the assemblies of these signs (blocks, designs)."""
        count = self.block_count + len(self.equations.stop_pairs)
        last = count + len(self.state)
        arms = sum(form.squared_arm is not None for form in self.equations.closed_forms)
        rows = (batch.numbers, batch.q, operand_rows(self.equations.input_operands, u), signs)
        out = _call(self.following_text, FUNCTION_NAME, rows, np.zeros(0), last + arms)
        squared_arms = iter(out[last:])
        for k, form in enumerate(self.equations.closed_forms):
            if form.squared_arm is not None:
                out[k, next(squared_arms) < LEAST_ARM**2] = np.nan
        return FollowedBlocks(out[:count], out[count:last])

    def find_dead_points(self, batch: DesignBatch, signs: Array, ranges: InputRanges) -> DeadPoints:
        """The first dead points of designs in the assemblies of these signs (blocks, designs), of none that goes no
        way."""
        text = self.search_texts.get(ranges.running)
        if text is None:
            text = self.search_texts[ranges.running] = DeadPointWriter(self.equations, ranges.running, LANES).write()
        span = np.abs(ranges.lengths)
        own = np.stack([ranges.reached, span, ranges.step, np.sign(ranges.lengths)])
        with np.errstate(all="ignore"):
            intervals = float(np.fmax.reduce((span - ranges.reached) / ranges.step, initial=0.0))
        most = np.array([MOST_WITHOUT_INTERVALS + 2.0 * intervals])
        rows = (batch.numbers, operand_rows(self.equations.input_operands, batch.u0), signs, own)
        distance, block = _call(text, SEARCH_NAME, rows, most, 2)
        return DeadPoints(np.where(span > 0.0, distance, np.nan), block.astype(int))


def _call(text: str, name: str, rows: tuple[Array, ...], common: Array, row_count: int) -> Array:
    """out (rows, designs) by the function of a text, of designs whose rows (..., designs) it takes, and what is common
    to all."""
    count = rows[0].shape[1]
    if not count:
        return np.empty((row_count, 0))
    if count < LANES:  # those that do not fill the lanes, with copies of the last beside them
        which = np.minimum(np.arange(LANES), count - 1)
        return _call(text, name, tuple(row[:, which] for row in rows), common, row_count)[:, :count]
    given = [np.ascontiguousarray(each, dtype=float) for each in (*rows, common)]
    out = np.empty((row_count, count))
    function = compile_function(text, name, *("int",) * 3, *("array",) * (len(given) + 1))
    with leave_turn(count >= LONG_CALL_DESIGNS):
        function(-(-count // LANES), count - LANES, count, *(each.ctypes.data for each in (*given, out)))
    return out


def find_joiner(batch: DesignBatch, point_blocks: tuple[int, ...]) -> BlockJoiner | None:
    """What joins the blocks of a batch, whose points are placed by these blocks; None where one is not in closed
    form, or stands in an angle's own value."""
    try:
        equations = batch_equations(batch)
    except UnsupportedOperation:
        return None
    if equations.has_newton_blocks or not equations.blocks:
        return None
    return _make_joiner(equations, batch.links, point_blocks)


@lru_cache(maxsize=256)
def _make_joiner(
    equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...]
) -> BlockJoiner | None:
    try:
        return BlockJoiner(equations, links, point_blocks)
    except UnsupportedOperation:
        return None
