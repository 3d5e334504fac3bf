"""Designs near the reference design: their assembly found from its own, all blocks at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import (
    MAX_BLOCK_UNKNOWNS,
    NEAR_SKETCH,
    is_at_sketch,
    is_clearly_regular,
    is_surely_farther,
)
from planar.batch.march.design_batch import CorrectedAssemblies
from planar.batch.march.runs import correct_designs
from planar.batch.reference_design import ReferenceDesign
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import LinkShape
from planar.solving.assembly.block_assemblies import SAME_ASSEMBLY_TOLERANCE, BlockAssemblies

Array = np.ndarray

CORRECTIONS = 6
"""Newton's steps from the assembly of the base."""


class NearestAssemblies(NamedTuple):
    """z (unknowns, designs), and which of the designs are clearly meant to be assembled so (designs,)."""

    z: Array
    is_clear: Array


def find_nearest_assemblies(
    reference: ReferenceDesign,
    shapes: Mapping[str, LinkShape],
    p: Array,
    u: Array,
) -> NearestAssemblies | None:
    """The assemblies at inputs u (inputs, designs); None where the sketch does not show every block, or the
    structure cannot be compiled.

    Costs never fall: where the nearest assembly is taken of every block, and each block's next one alone would cost
    more than all these, there is no nearer one of the whole. A block in closed form has two assemblies; any other as
    many as the base has, if they are found again, or it lies where it does at the sketch, and so regular that no other
    is near.
    """
    candidates = reference.candidates
    blocks = [block for block in reference.functions.equations.blocks if slice_length(block.unknowns)]
    at = {block.block_index: candidates.sketched_by_level.get(block.block_index, ()) for block in blocks}
    if candidates.counts_turns or any(
        slice_length(block.unknowns) > MAX_BLOCK_UNKNOWNS or not at[block.block_index] for block in blocks
    ):
        return None
    try:
        return _NearestAssemblySearch(reference, shapes, p, u, candidates, blocks).search()
    except UnsupportedOperation:
        return None


class _NearestAssemblySearch:
    def __init__(
        self,
        base: ReferenceDesign,
        shapes: Mapping[str, LinkShape],
        p: Array,
        u: Array,
        candidates: BlockAssemblies,
        blocks: list[Block],
    ):
        self.design_count, self.blocks = p.shape[1], blocks
        at = candidates.sketched_by_level
        self.roots = {
            block.block_index: each
            for block, each in zip(base.functions.equations.blocks, base.block_assemblies(), strict=True)
        }
        self.names = [name for block in blocks for name in at[block.block_index]]
        self.point_blocks = tuple(block.block_index for block in blocks for _ in at[block.block_index])
        self.sketch = np.array([candidates.sketch[name] for name in self.names]).reshape(-1, 2, 1)
        members = [candidates.first_link[name][1:] for name in self.names]
        start = np.concatenate([np.zeros(0), *(roots[0] for roots, _ in self.roots.values() if len(roots))])
        self.batch = base.design_batch(shapes, p, (u, u, u), members)
        self.batch.z0[:] = start[:, None]

    def search(self) -> NearestAssemblies:
        """See `find_nearest_assemblies`."""
        found = correct_designs(self.batch, self.point_blocks, CORRECTIONS)
        costs, others = (np.square(places - self.sketch).sum(axis=1) for places in (found.points, found.other_points))
        clear, total, before = found.converged.copy(), costs.sum(axis=0), np.zeros(self.design_count)
        for block in self.blocks:
            own = np.array(self.point_blocks) == block.block_index
            cost, other, own_count = costs[own].sum(axis=0), others[own].sum(axis=0), int(own.sum())
            if np.all(np.isinf(other)):
                clear &= is_at_sketch(cost, own_count, NEAR_SKETCH) & is_clearly_regular(found.regularity)
                near = is_at_sketch(cost, own_count)
                clear &= (
                    near if near.all() else near | is_surely_farther(before + self._next_cost(block, found, own), total)
                )
            else:
                clear &= is_surely_farther(before + other, total)
            before += cost
        return NearestAssemblies(found.z, clear)

    def _next_cost(self, block: Block, found: CorrectedAssemblies, own: Array) -> Array:
        """The least cost of a block's other assemblies (designs,); nothing where not as many are found as it has."""
        roots, most = self.roots[block.block_index]
        least, known = np.full(self.design_count, np.inf), [found.z[block.unknowns]]
        count = np.ones(self.design_count, dtype=int)
        for root in roots[1:]:
            self.batch.z0[block.unknowns] = root[:, None]
            other = correct_designs(self.batch, self.point_blocks, CORRECTIONS)
            z = other.z[block.unknowns]
            apart = [
                ~(np.max(np.abs(np.exp(1j * z) - np.exp(1j * each)), axis=0) <= SAME_ASSEMBLY_TOLERANCE)
                for each in known
            ]
            new = other.converged & np.all(apart, axis=0)
            cost = np.square(other.points - self.sketch)[own].sum(axis=(0, 1))
            least = np.where(new, np.minimum(least, cost), least)
            count += new
            known.append(np.where(new, z, np.nan))
        self.batch.z0[block.unknowns] = roots[0][:, None]
        return np.where(count == most, least, -np.inf)
