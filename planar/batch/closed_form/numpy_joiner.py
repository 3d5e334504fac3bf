"""Blocks in closed form joined one after the other by numpy."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planar.batch.closed_form.dead_points import find_dead_points
from planar.batch.closed_form.joined_blocks import (
    DeadPoints,
    FollowedBlocks,
    InputRanges,
    JoinedBlocks,
    input_rows,
    state_operands,
    without_short_arms,
)
from planar.batch.march.backend import DesignBatch
from planar.batch.march.kernel import KernelBlock, KernelEquations, KernelInstructions, Operand
from planar.codegen.printed_formula import PrintedFunction, compile_numpy
from planar.foundation.instruction_list import UnsupportedOperation, required_values

Array = np.ndarray


class _BlockFunctions(NamedTuple):
    """Of a block by operands: its unknowns and how near its two assemblies are; where its sketched points are; and how
    near these are without the arm, then that."""

    part: KernelBlock
    solve: PrintedFunction
    operands: tuple[Operand, ...]
    locate: PrintedFunction
    point_operands: tuple[Operand, ...]
    points: tuple[int, ...]
    meet: PrintedFunction
    meeting_operands: tuple[Operand, ...]


class NumpyBlockJoiner:
    """See `BlockJoiner`. Raises UnsupportedOperation."""

    def __init__(self, equations: KernelEquations, links: tuple[str, ...], point_blocks: tuple[int, ...]):
        self.equations, self.state = equations, state_operands(equations)
        self.kernel = KernelInstructions(equations, links, False, frozenset(), frozenset())
        known = {(name, k) for name in ("p", "q", "sign", "stop") for k in range(self.kernel.symbols[name].numel())}
        known |= {*self.kernel.input_operands, *self.state}
        self.blocks = []
        for part in equations.blocks:
            points = tuple(k for k, block in enumerate(point_blocks) if block == part.block.block_index)
            solving = self._compile(self.kernel.list_values(self.kernel.closed_form_outputs(part)), known)
            locating = self._compile(self.kernel.list_values([self.kernel.point_coordinates(points)]), known)
            form = part.closed_form
            assert form is not None
            meeting = [form.coalescence, *([] if form.squared_arm is None else [form.squared_arm])]
            near = self._compile(self.kernel.list_values(meeting), known)
            self.blocks.append(_BlockFunctions(part, *solving, *locating, points, *near))
        stops = self.kernel.stop_outputs() if equations.stop_pairs else []
        self.stops = self._compile(self.kernel.list_values(stops), known) if stops else None

    def _compile(self, wanted: list[int], known: set[Operand]) -> tuple[PrintedFunction, tuple[Operand, ...]]:
        made = self.kernel.hoister.result
        inputs = {each: key for each in required_values(made, wanted) if (key := made.instructions[each].key)}
        bare = set(inputs.values()) - known
        if bare:
            raise UnsupportedOperation(f"an angle counts its turns: {bare}")
        return compile_numpy(made, wanted, tuple(inputs)), tuple(inputs.values())

    def _solve_block(self, block: _BlockFunctions, values: dict[Operand, Any], sign: Any) -> Any:
        """A block's unknowns put into `values`; how near its two assemblies are."""
        values["sign", self.kernel.sign_index[block.part.block.block_index]] = sign
        *unknowns, coalescence = block.solve(*(values[each] for each in block.operands))
        values.update(zip(self.kernel.closed_form_operands(block.part), unknowns, strict=True))
        return coalescence

    def _values(self, batch: DesignBatch, u: Array) -> dict[Operand, Any]:
        values: dict[Operand, Any] = {("p", k): row for k, row in enumerate(batch.p)}
        values |= {("q", k): row for k, row in enumerate(batch.q)}
        values |= {} if batch.stops is None else {("stop", k): row for k, row in enumerate(batch.stops.numbers)}
        return values | dict(zip(self.kernel.input_operands, input_rows(self.equations, u), strict=True))

    def join(self, batch: DesignBatch, sketch: Array, forced: Array) -> JoinedBlocks:
        """See `BlockJoiner`."""
        known, values = np.empty((4, *forced.shape)), self._values(batch, batch.u0)
        for k, block in enumerate(self.blocks):
            ways, distances = [dict(values), dict(values)], []
            for way, sign in zip(ways, (1.0, -1.0), strict=True):
                known[3, k] = self._solve_block(block, way, sign)
                places = block.locate(*(way[each] for each in block.point_operands))
                shown = [sketch[point, axis] for point in block.points for axis in range(2)]
                distances.append(sum((at - there) ** 2 for at, there in zip(places, shown, strict=True)) + 0.0)
            left, right = distances
            known[0, k] = np.where(forced[k] == 0.0, np.where(left <= right, 1.0, -1.0), forced[k])
            is_left = known[0, k] > 0.0
            known[1, k], known[2, k] = np.where(is_left, left, right), np.where(is_left, right, left)
            for operand in self.kernel.closed_form_operands(block.part):
                values[operand] = np.where(is_left, *(way[operand] for way in ways))
        state = np.array([np.broadcast_to(values[each], forced.shape[1:]) for each in self.state])
        return JoinedBlocks(known[0], known[1], known[2], known[3], state)

    def follow(self, batch: DesignBatch, signs: Array, u: Array) -> FollowedBlocks:
        """See `BlockJoiner`."""
        values, arms = self._values(batch, u), []
        found = np.empty((len(signs) + len(self.equations.stop_pairs), signs.shape[1]))
        for k, block in enumerate(self.blocks):
            self._solve_block(block, values, signs[k])
            found[k], *arm = block.meet(*(values[each] for each in block.meeting_operands))
            arms += arm
        if self.stops is not None:
            function, operands = self.stops
            for k, value in enumerate(function(*(values[each] for each in operands)), len(self.blocks)):
                found[k] = value
        state = np.array([np.broadcast_to(values[each], signs.shape[1:]) for each in self.state])
        return FollowedBlocks(without_short_arms(found, self.equations, arms), state)

    def find_dead_points(self, batch: DesignBatch, signs: Array, ranges: InputRanges) -> DeadPoints:
        """See `BlockJoiner`."""
        return find_dead_points(self, batch, signs, ranges)
