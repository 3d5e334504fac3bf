"""The assembly nearest to the sketch of every design whose blocks are all in closed form: exactly, without a start."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import CLEARLY_OPEN, DesignAssemblies, is_surely_farther
from planar.batch.closed_form.joined_blocks import BlockJoiner, JoinedBlocks, find_joiner
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import unknowns_from_state
from planar.batch.reference_design import ReferenceDesign
from planar.equations.symbolic_equations import slice_length
from planar.model.link_shapes import LinkShape
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED

Array = np.ndarray

MAX_WAYS = 64
"""Ways to assemble a design that are looked at: one that has more to look at is left to be searched by itself."""


def find_start_assemblies(
    reference: ReferenceDesign, shapes: Mapping[str, LinkShape], p: Array, u: Array
) -> DesignAssemblies | None:
    """The assemblies at inputs u (inputs, designs); None where a block has no closed form, or no sketched points.

    A block takes the nearer of its two assemblies. Squared distances never fall as blocks are added: where each block's
    other assembly alone lies farther than the whole that was taken, there is no nearer one of the whole. Where that is
    not so the other way is gone as well.
    """
    candidates = reference.candidates
    at = candidates.sketched_by_level
    blocks = [block for block in reference.functions.equations.blocks if slice_length(block.unknowns)]
    if candidates.counts_turns or not blocks or not all(at.get(block.block_index) for block in blocks):
        return None
    names = [name for block in blocks for name in at[block.block_index]]
    point_blocks = tuple(block.block_index for block in blocks for _ in at[block.block_index])
    batch = reference.design_batch(shapes, p, (u, u, u), [candidates.first_link[name][1:] for name in names])
    joiner = find_joiner(batch, point_blocks)
    if joiner is None:
        return None
    sketch = np.array([candidates.sketch[name] for name in names]).reshape(-1, 2)
    with np.errstate(all="ignore"):  # what cannot be joined is no number
        return _StartSearch(joiner, batch, sketch).search()


class _StartSearch:
    def __init__(self, joiner: BlockJoiner, batch: DesignBatch, sketch: Array):
        self.joiner, self.batch, self.sketch = joiner, batch, sketch
        self.design_count = batch.p.shape[1]
        parts = joiner.equations.blocks
        self.block_index = np.array([part.block.block_index for part in parts], dtype=int)
        self.is_bounded = np.array([part.closed_form is None or part.closed_form.squared_arm is None for part in parts])
        "blocks that cannot be joined where their coalescence is beyond one; of others an arm may have vanished"

    def search(self) -> DesignAssemblies:
        """See `find_start_assemblies`."""
        count, blocks = self.design_count, len(self.block_index)
        first = self.joiner.join(self.batch, self.sketch, np.zeros((blocks, count)))
        ended = self._judge(first)
        total, state, signs, failed = ended.total, first.state, first.signs, ended.failed
        sure, tied = ended.is_known, np.zeros(count, dtype=bool)
        design, forced = self._other_ways(np.arange(count), first, ended, np.zeros(count, dtype=int), total)
        looked_at = np.ones(count, dtype=int)
        while design.size:
            looked_at += np.bincount(design, minlength=count)
            design, forced = (each[..., looked_at[design] <= MAX_WAYS] for each in (design, forced))
            found = self.joiner.join(self.batch.select(design), self.sketch, forced)
            ended = self._judge(found)
            np.logical_and.at(sure, design, ended.is_known)
            np.maximum.at(failed, design, ended.failed)
            order = np.lexsort((ended.total, design))
            best = order[np.unique(design[order], return_index=True)[1]]
            of = design[best]
            second = np.full(count, np.inf)
            rest = np.setdiff1d(order, best)
            np.minimum.at(second, design[rest], ended.total[rest])
            least = np.minimum(total[of], ended.total[best])
            greater = np.fmin(np.maximum(total[of], ended.total[best]), second[of])
            # alike, as long as none is found that is nearer than both
            tied[of] = (tied[of] & (least >= total[of])) | (~is_surely_farther(greater, least) & np.isfinite(least))
            nearer = ended.total[best] < total[of]
            state[:, of[nearer]], signs[:, of[nearer]] = found.state[:, best[nearer]], found.signs[:, best[nearer]]
            total[of] = least
            prefix = np.count_nonzero(forced, axis=0)
            design, forced = self._other_ways(design, found, ended, prefix, total[design])
        sure &= ~tied & (looked_at <= MAX_WAYS)
        fails = sure & ~np.isfinite(total)
        z = unknowns_from_state(self.joiner.state, state, len(self.batch.z0))
        return DesignAssemblies(z, sure & np.isfinite(total), np.where(fails, failed, -1), signs)

    class _Ended(NamedTuple):
        """How ways to assemble ended: the squared distance of all points, infinite where a block cannot be joined,
        which block that is, -1 where all are; and whether that is clear."""

        total: Array
        failed: Array
        is_known: Array

    def _judge(self, joined: JoinedBlocks) -> _Ended:
        is_joined = joined.coalescences < MEETING_COSINE_SQUARED
        if is_joined.all():  # as of designs that differ by little
            count = is_joined.shape[1]
            return self._Ended(joined.distances.sum(axis=0), np.full(count, -1), np.ones(count, dtype=bool))
        is_open = (joined.coalescences >= CLEARLY_OPEN) & self.is_bounded[:, None]
        all_joined = is_joined.all(axis=0)
        at = np.argmin(is_joined, axis=0)
        known = all_joined | np.take_along_axis(is_open, at[None], axis=0)[0]
        total = np.where(all_joined, joined.distances.sum(axis=0), np.inf)
        return self._Ended(total, np.where(all_joined, -1, self.block_index[at]), known)

    def _other_ways(
        self, design: Array, joined: JoinedBlocks, ended: _Ended, prefix: Array, total: Array
    ) -> tuple[Array, Array]:
        """The ways that differ at a block behind those that are forced (`prefix`), and are not surely farther: the
        designs (ways,), and signs (blocks, ways), 0 where a block is free."""
        before, designs, forced = np.zeros(len(design)), [], []
        for k in range(len(self.block_index)):
            bound = before + joined.other_distances[k]
            # what is no number is behind a block that cannot be joined
            on = (k >= prefix) & ~is_surely_farther(bound, total) & np.isfinite(bound)
            on &= joined.coalescences[k] < MEETING_COSINE_SQUARED
            if on.any():
                own = joined.signs[:, on].copy()
                own[k] *= -1.0
                own[k + 1 :] = 0.0
                designs.append(design[on])
                forced.append(own)
            before = before + joined.distances[k]
        if not designs:
            return np.zeros(0, dtype=int), np.zeros((len(self.block_index), 0))
        return np.concatenate(designs), np.concatenate(forced, axis=1)
