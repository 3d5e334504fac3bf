"""The assembly nearest to the sketch of every design, of all designs at once.

By closed forms where all blocks have one, else near the reference design's own; what is not clear then, by a search.
"""

from __future__ import annotations

import numpy as np

from planar.batch.assembly.assembly_scores import (
    CLEARLY_OPEN,
    MAX_BLOCK_UNKNOWNS,
    NEAR_SKETCH,
    DesignAssemblies,
    is_at_sketch,
    is_clearly_regular,
    is_surely_farther,
)
from planar.batch.assembly.assembly_search import AssemblySearch
from planar.batch.closed_form.joined_blocks import BlockJoiner, JoinedBlocks, find_joiner
from planar.batch.march.design_batch import CorrectedAssemblies, DesignBatch
from planar.batch.march.kernel import unknowns_from_state
from planar.batch.march.runs import correct_designs
from planar.batch.reference_design import DesignRows, ReferenceDesign
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.angles import distances
from planar.foundation.instruction_list import UnsupportedOperation
from planar.solving.assembly.block_assemblies import MEETING_COSINE_SQUARED, SAME_ASSEMBLY_TOLERANCE

Array = np.ndarray

MAX_ALONE = 12
"""Designs that are not clear: up to this count they are solved one by one sooner than they are searched for."""
MAX_OPTIONS = 64
"""Combinations of assemblies of blocks that are joined for a design; one that has more to look at is searched for."""
CORRECTIONS = 6
"""Newton's steps from the assembly of the base."""


def given_assemblies(z: Array) -> DesignAssemblies:
    """Assemblies with unknowns z (unknowns, designs), not numbers of designs that have none."""
    return DesignAssemblies(z, np.isfinite(z).all(axis=0), np.full(z.shape[1], -1))


def find_assemblies(reference: ReferenceDesign, rows: DesignRows) -> DesignAssemblies:
    """The assemblies of designs with these numbers at their inputs."""
    with np.errstate(all="ignore"):  # starts that lead nowhere end as what is no number
        assemblies = _find_without_search(reference, rows)
        if assemblies is None:
            return AssemblySearch(reference, rows).search()
        rest = np.flatnonzero(~assemblies.is_sure & (assemblies.failed_block < 0))
        if rest.size > (0 if assemblies.signs is None else MAX_ALONE):
            searched = AssemblySearch(reference, rows.select(rest)).search()
            assemblies.z[:, rest], assemblies.is_sure[rest], assemblies.failed_block[rest] = searched[:3]
            if assemblies.signs is not None:
                assemblies.signs[:, rest] = 0.0
        return assemblies


def _find_without_search(reference: ReferenceDesign, rows: DesignRows) -> DesignAssemblies | None:
    """Those by closed forms, else those near the base's own; None where the sketch does not show every block, or the
    structure allows neither."""
    candidates, equations = reference.candidates, reference.functions.equations
    blocks = [block for block in equations.blocks if slice_length(block.unknowns)]
    names_of_block = {block.block_index: candidates.sketched_by_level.get(block.block_index, ()) for block in blocks}
    if candidates.counts_turns or not all(names_of_block.values()):
        return None
    names = [name for names in names_of_block.values() for name in names]
    point_blocks = tuple(index for index, names in names_of_block.items() for _ in names)
    sketch = np.array([candidates.sketch[name] for name in names]).reshape(-1, 2)
    batch = reference.design_batch(rows, [candidates.first_link[name][1:] for name in names])
    joiner = find_joiner(batch, point_blocks)
    if joiner is not None:
        return _JoinedAssemblySearch(joiner, batch, sketch).search()
    if any(slice_length(block.unknowns) > MAX_BLOCK_UNKNOWNS for block in blocks):
        return None
    try:
        return _NearReferenceSearch(reference, batch, blocks, point_blocks, sketch).search()
    except UnsupportedOperation:
        return None


class _JoinedAssemblySearch:
    """The nearest assembly of designs whose blocks are all in closed form: exactly, without a start.

    A block takes the nearer of its two assemblies. Squared distances never fall as blocks are added: where each block's
    other assembly alone lies farther than the complete one that was taken, there is no nearer one. Where that is not
    so the other option is joined as well.
    """

    def __init__(self, joiner: BlockJoiner, batch: DesignBatch, sketch: Array):
        self.joiner, self.batch, self.sketch = joiner, batch, sketch
        self.design_count = batch.p.shape[1]
        parts = joiner.equations.blocks
        self.block_index = np.array([part.block.block_index for part in parts], dtype=int)
        self.is_bounded = np.array([part.closed_form is None or part.closed_form.squared_arm is None for part in parts])
        "blocks that cannot be joined where their coalescence is beyond one; of others an arm may have vanished"

    def search(self) -> DesignAssemblies:
        """See `find_assemblies`."""
        count, every = self.design_count, np.arange(self.batch.p.shape[1])
        joined = self.joiner.join(self.batch, self.sketch, np.zeros((len(self.block_index), count)))
        state, signs = joined.state, joined.signs
        total, failed, is_sure = self._judge(joined)
        is_tied, option_count = np.zeros(count, dtype=bool), np.ones(count, dtype=int)
        design, forced = self._other_options(every, joined, np.zeros(count, dtype=int), total)
        while design.size:
            option_count += np.bincount(design, minlength=count)
            design, forced = (rows[..., option_count[design] <= MAX_OPTIONS] for rows in (design, forced))
            joined = self.joiner.join(self.batch.select(design), self.sketch, forced)
            distance, failed_block, is_known = self._judge(joined)
            np.logical_and.at(is_sure, design, is_known)
            np.maximum.at(failed, design, failed_block)
            order = np.lexsort((distance, design))
            best = order[np.unique(design[order], return_index=True)[1]]
            of = design[best]
            second = np.full(count, np.inf)
            others = np.setdiff1d(order, best)
            np.minimum.at(second, design[others], distance[others])
            least = np.minimum(total[of], distance[best])
            greater = np.fmin(np.maximum(total[of], distance[best]), second[of])
            # alike, as long as none is found that is nearer than both
            is_alike = ~is_surely_farther(greater, least) & np.isfinite(least)
            is_tied[of] = (is_tied[of] & (least >= total[of])) | is_alike
            nearer = distance[best] < total[of]
            state[:, of[nearer]], signs[:, of[nearer]] = joined.state[:, best[nearer]], joined.signs[:, best[nearer]]
            total[of] = least
            design, forced = self._other_options(design, joined, np.count_nonzero(forced, axis=0), total[design])
        is_sure &= ~is_tied & (option_count <= MAX_OPTIONS)
        is_joined = np.isfinite(total)
        z = unknowns_from_state(self.joiner.state, state, len(self.batch.z0))
        return DesignAssemblies(z, is_sure & is_joined, np.where(is_sure & ~is_joined, failed, -1), signs)

    def _judge(self, joined: JoinedBlocks) -> tuple[Array, Array, Array]:
        """The squared distance of all points, infinite where a block cannot be joined; which block that is, -1 where
        all are; and whether that is clear, each (designs,)."""
        is_joined = joined.coalescences < MEETING_COSINE_SQUARED
        if is_joined.all():  # as of designs that differ by little
            count = is_joined.shape[1]
            return joined.distances.sum(axis=0), np.full(count, -1), np.ones(count, dtype=bool)
        is_open = (joined.coalescences >= CLEARLY_OPEN) & self.is_bounded[:, None]
        all_joined, first = is_joined.all(axis=0), np.argmin(is_joined, axis=0)
        is_known = all_joined | np.take_along_axis(is_open, first[None], axis=0)[0]
        total = np.where(all_joined, joined.distances.sum(axis=0), np.inf)
        return total, np.where(all_joined, -1, self.block_index[first]), is_known

    def _other_options(
        self, design: Array, joined: JoinedBlocks, forced_count: Array, total: Array
    ) -> tuple[Array, Array]:
        """The options that differ at a block behind those that are forced, and are not surely farther than the total:
        the designs (options,), and signs (blocks, options), 0 where a block is free."""
        previous = np.zeros(len(design))
        designs, forced = [np.zeros(0, dtype=int)], [np.zeros((len(self.block_index), 0))]
        for k in range(len(self.block_index)):
            bound = previous + joined.other_distances[k]
            # what is no number is behind a block that cannot be joined
            is_open = (k >= forced_count) & ~is_surely_farther(bound, total) & np.isfinite(bound)
            is_open &= joined.coalescences[k] < MEETING_COSINE_SQUARED
            if is_open.any():
                signs = joined.signs[:, is_open].copy()
                signs[k] *= -1.0
                signs[k + 1 :] = 0.0
                designs.append(design[is_open])
                forced.append(signs)
            previous = previous + joined.distances[k]
        return np.concatenate(designs), np.concatenate(forced, axis=1)


class _NearReferenceSearch:
    """Designs near the reference design: their assembly corrected from its own, all blocks at once.

    Costs never fall: where the nearest assembly is taken of every block, and each block's next one alone would cost
    more than all these, there is no nearer one in total. A block in closed form has two assemblies; any other as
    many as the base has, if they are found again, or it lies where it does at the sketch, and so regular that no other
    is near.
    """

    def __init__(
        self,
        reference: ReferenceDesign,
        batch: DesignBatch,
        blocks: list[Block],
        point_blocks: tuple[int, ...],
        sketch: Array,
    ):
        self.batch, self.blocks, self.point_blocks, self.sketch = batch, blocks, point_blocks, sketch[..., None]
        self.is_angle = reference.functions.equations.unknown_is_angle
        pairs = zip(reference.functions.equations.blocks, reference.block_assemblies, strict=True)
        self.roots = {block.block_index: roots for block, roots in pairs}
        start = np.concatenate([np.zeros(0), *(roots[0] for roots, _ in self.roots.values() if len(roots))])
        self.batch.z0[:] = start[:, None]

    def search(self) -> DesignAssemblies:
        """See `find_assemblies`."""
        corrected = correct_designs(self.batch, self.point_blocks, CORRECTIONS)
        points = corrected.points, corrected.other_points
        costs, others = (np.square(places - self.sketch).sum(axis=1) for places in points)
        clear, total, previous = corrected.converged.copy(), costs.sum(axis=0), np.zeros(len(corrected.converged))
        for block in self.blocks:
            rows = np.array(self.point_blocks) == block.block_index
            cost, other, point_count = costs[rows].sum(axis=0), others[rows].sum(axis=0), int(rows.sum())
            if np.all(np.isinf(other)):
                clear &= is_at_sketch(cost, point_count, NEAR_SKETCH) & is_clearly_regular(corrected.regularity)
                near = is_at_sketch(cost, point_count)
                if not near.all():
                    near |= is_surely_farther(previous + self._next_cost(block, corrected, rows), total)
                clear &= near
            else:
                clear &= is_surely_farther(previous + other, total)
            previous += cost
        return DesignAssemblies(corrected.z, clear, np.full(len(clear), -1))

    def _next_cost(self, block: Block, corrected: CorrectedAssemblies, rows: Array) -> Array:
        """The least cost of a block's other assemblies (designs,), minus infinity where not as many are found as the
        base has; `rows` are the block's points."""
        roots, base_count = self.roots[block.block_index]
        count = np.ones(len(corrected.converged), dtype=int)
        least, known = np.full(len(count), np.inf), [corrected.z[block.unknowns]]
        for root in roots[1:]:
            self.batch.z0[block.unknowns] = root[:, None]
            other = correct_designs(self.batch, self.point_blocks, CORRECTIONS)
            z = other.z[block.unknowns]
            gaps = distances(self.is_angle[block.unknowns], z.T, np.array(known).transpose(0, 2, 1)).max(axis=2)
            is_new = other.converged & np.all(~(gaps <= SAME_ASSEMBLY_TOLERANCE), axis=0)
            cost = np.square(other.points - self.sketch)[rows].sum(axis=(0, 1))
            least = np.where(is_new, np.minimum(least, cost), least)
            count += is_new
            known.append(np.where(is_new, z, np.nan))
        self.batch.z0[block.unknowns] = roots[0][:, None]
        return np.where(count == base_count, least, -np.inf)
