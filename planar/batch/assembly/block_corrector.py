"""Newton's method for one block of many designs at once, from many starts."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import CLEARLY_OPEN
from planar.batch.march.checks import column_volume
from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_vectors
from planar.equations.symbolic_equations import Block
from planar.model.pairs import MeasureKind
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED, SAME_ASSEMBLY_TOLERANCE
from planar.solving.newton import CLOSED_TOLERANCE

Array = np.ndarray

LONGEST_NEWTON_STEP = 0.8
"""rad or sizes: no step of Newton's method is longer."""
NEARLY_CLOSED_TOLERANCE = 1e-5
"""Lengths of the size, or rad: a block that is open by less is closed by the step from there."""
COMPACTION_INTERVAL = 4
"""Steps after which those that have closed are left out."""
SPREAD_STARTS = 24
"""Starts all over the circles."""


class CorrectedBlocks(NamedTuple):
    """z (unknowns, designs, ways, starts), which of these close and how regular the block's Jacobian is where they
    ended (designs, ways, starts), see `column_volume`."""

    z: Array
    converged: Array
    regularity: Array


class JoinedAssemblies(NamedTuple):
    """z (unknowns, designs, ways, 2), which of these there are (designs, ways, 2), and for which designs that is sure
    (designs,)."""

    z: Array
    exists: Array
    is_sure: Array


class BlockCorrector:
    """Corrects blocks of designs with numbers p (numbers, designs) at inputs u (inputs, designs).

    `counts_turns`: whether angles a turn apart are different assemblies.
    """

    def __init__(self, functions: EquationFunctions, p: Array, u: Array, counts_turns: bool):
        self.functions, self.equations = functions, functions.equations
        self.p, self.u, self.counts_turns = p, u, counts_turns

    def select(self, designs: Array) -> BlockCorrector:
        """The same for some of the designs, which may stand there twice."""
        return BlockCorrector(self.functions, self.p[:, designs], self.u[:, designs], self.counts_turns)

    def correct(self, block: Block, z: Array, exists: Array, starts: Array, steps: int) -> CorrectedBlocks:
        """Newton's method for a block from every start (starts, unknowns) beside z (unknowns, designs, ways).

        `exists` (designs, ways) are the ways that are there."""
        count = len(starts)
        shape = (*exists.shape, count)
        z = np.repeat(z[..., None], count, axis=3)
        z[block.unknowns] = starts.T[:, None, None, :]
        each = np.broadcast_to(np.arange(self.p.shape[1])[:, None, None], shape).ravel()
        flat = z.reshape(len(z), -1)
        closed = np.zeros(flat.shape[1], dtype=bool)
        busy = np.flatnonzero(np.repeat(exists[..., None], count, axis=2).ravel())
        at, *given = self._open_columns(flat, busy, each)
        closing = self.functions.block_call(block)
        regularity = np.zeros(flat.shape[1])
        for step in range(steps + 1):
            residuals, jacobian = closing.evaluate_batch(len(at), at, *given)
            residuals, jacobian = residuals[:, 0], jacobian.transpose(0, 2, 1)
            # the error of the next step is the square of this one, which the march looks at again
            done = np.max(np.abs(residuals), axis=1, initial=0.0) <= NEARLY_CLOSED_TOLERANCE
            regularity[busy] = column_volume(jacobian)
            move = solve_vectors(jacobian, residuals, least_squares=True)
            far = np.maximum(np.max(np.abs(move), axis=1), LONGEST_NEWTON_STEP)[:, None] / LONGEST_NEWTON_STEP
            at[:, block.unknowns] -= move / far
            if step == steps or np.all(done):
                flat[:, busy[done]] = at[done].T
                closed[busy[done]] = True
                break
            if step % COMPACTION_INTERVAL == COMPACTION_INTERVAL - 1:
                flat[:, busy] = at.T
                closed[busy] = done
                busy = busy[~done & np.all(np.isfinite(at), axis=1)]
                if not busy.size:
                    break
                at, *given = self._open_columns(flat, busy, each)
        if self.counts_turns:
            flat = self._wind_back(block, flat, closed, each)
        return CorrectedBlocks(flat.reshape(z.shape), closed.reshape(shape), regularity.reshape(shape))

    def has_closed_form(self, block: Block) -> bool:
        """Whether both assemblies of a block are known without a search."""
        return not self.counts_turns and self.functions.block_assemblies(block) is not None

    def join(self, block: Block, z: Array, exists: Array) -> JoinedAssemblies:
        """Both assemblies of a block in closed form beside z (unknowns, designs, ways), where there are such ways."""
        assemblies = self.functions.block_assemblies(block)
        assert assemblies is not None
        width, flat = exists.shape[1], z.reshape(len(z), -1).T
        u, p = (np.repeat(part.T, width, axis=0) for part in (self.u, self.p))
        whole = np.repeat(z[..., None], 2, axis=3)
        both, coalescence = assemblies.evaluate_batch(flat, u, p)
        for k, own in enumerate(both):
            whole[block.unknowns, ..., k] = own.T.reshape(-1, *exists.shape)
        near = coalescence.reshape(exists.shape)
        is_joined = near < MEETING_COSINE_SQUARED
        # of a length that turns on an arm this may have vanished
        is_open = (near >= CLEARLY_OPEN) & (not assemblies.has_changing_arm)
        there = np.repeat((exists & is_joined)[..., None], 2, axis=2)
        return JoinedAssemblies(whole, there, np.all(is_joined | is_open | ~exists, axis=1))

    def _open_columns(self, flat: Array, busy: Array, each: Array) -> tuple[Array, Array, Array]:
        """Columns of z (columns, unknowns) that are not closed yet, with their inputs and numbers."""
        return np.ascontiguousarray(flat[:, busy].T), self.u.T[each[busy]], self.p.T[each[busy]]

    def _wind_back(self, block: Block, z: Array, closed: Array, each: Array) -> Array:
        """The same assemblies with angles at the turn nearest to none where that is closed too, as in `Candidates`."""
        least = z.copy()
        own, angles = least[block.unknowns], self._is_angle(block)
        own[angles] = np.arctan2(np.sin(own[angles]), np.cos(own[angles]))
        given = least.T, self.u[:, each].T, self.p[:, each].T
        residuals = self.functions.block_call(block).evaluate_batch(len(each), *given)[0][:, 0]
        still = closed & (np.max(np.abs(residuals), axis=1, initial=0.0) <= 10.0 * CLOSED_TOLERANCE)
        return np.where(still, least, z)

    def _is_angle(self, block: Block) -> Array:
        columns = self.equations.unknowns[block.unknowns]
        return np.array([self.equations.coordinates[c].kind is not MeasureKind.LENGTH for c in columns], dtype=bool)

    def spread_starts(self, block: Block, roots: Array) -> Array:
        """Starts with angles spread over the circles, and lengths as the base has them."""
        angles = self._is_angle(block)
        grid = (
            np.arange(SPREAD_STARTS)[:, None] * np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0])[: roots.shape[1]] % 1.0
        )
        grid = np.pad(grid, ((0, 0), (0, roots.shape[1] - grid.shape[1])), mode="reflect")
        like = roots[np.arange(SPREAD_STARTS) % len(roots)]
        return np.where(angles, 2.0 * np.pi * grid - np.pi, like)

    def is_distinct(self, block: Block, z: Array, there: Array) -> Array:
        """Which of the ways from one partial assembly are not the same as one before (designs, ways, starts)."""
        own, angles = z[block.unknowns], self._is_angle(block)
        found = there.copy()
        for k in range(1, there.shape[2]):
            for other in range(k):
                gap = np.abs(own[..., k] - own[..., other])
                if not self.counts_turns:
                    gap[angles] = np.abs(2.0 * np.sin(0.5 * gap[angles]))
                found[..., k] &= ~(found[..., other] & np.all(gap < SAME_ASSEMBLY_TOLERANCE, axis=0))
        return found
