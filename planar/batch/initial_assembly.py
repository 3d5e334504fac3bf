"""The assembly nearest to the sketch of every design, of all designs at once.

By closed forms where all blocks have one, else near the reference design's own; what is not clear then, by a search
block after block, in which all options to add a block are computed side by side.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import NamedTuple

import numpy as np

from planar.batch.closed_form.joined_blocks import BlockJoiner, JoinedBlocks, find_joiner
from planar.batch.march.checks import column_volume
from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.kernel import unknowns_from_state
from planar.batch.march.prediction import CLEAR_REGULARITY
from planar.batch.march.runs import correct_designs
from planar.batch.reference_design import DesignRows, ReferenceDesign
from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_vectors
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.angles import distances
from planar.foundation.geometry import Vector
from planar.foundation.instruction_list import UnsupportedOperation
from planar.solving.assembly.block_assemblies import (
    CLEAR_SKETCH_DISTANCE,
    MEETING_COSINE_SQUARED,
    SAME_ASSEMBLY_TOLERANCE,
)
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE, is_at_sketch, is_surely_farther
from planar.solving.newton import CLOSED_TOLERANCE, damped_newton

Array = np.ndarray

NEAR_SKETCH = 0.15
"""Lengths of the size, on average, from the sketch: a large block that lies farther off may have another assembly that
is nearer, of which no start tells."""
MAX_BLOCK_UNKNOWNS = 4
"""Unknowns of the largest block whose regularity tells whether another assembly is near."""
CLEARLY_OPEN = 1.0 + 1e-6
"""Of a block's coalescence: from there on it cannot be joined, and stays open by more than what counts as closed."""


class DesignAssemblies(NamedTuple):
    """z (unknowns, designs), and for which of them it is surely the one that the search one by one would take.

    `failed_block`: the level of the block that surely cannot be joined to the rest, -1 where all can (designs,);
    `signs` (blocks, designs): of the assemblies of blocks, None where not all have a closed form.
    """

    z: Array
    is_sure: Array
    failed_block: Array
    signs: Array | None = None


MAX_OPTIONS = 512
"""Combinations of assemblies of blocks that are joined for a design; one that has more to look at is not sure."""
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
        if rest.size and assemblies.signs is None:  # what closed forms leave open no search decides
            searched = AssemblySearch(reference, rows.select(rest)).search()
            assemblies.z[:, rest], assemblies.is_sure[rest], assemblies.failed_block[rest] = searched[:3]
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
        clear, regularity, z, *points = correct_designs(self.batch, self.point_blocks, CORRECTIONS)
        costs, others = (np.square(places - self.sketch).sum(axis=1) for places in points)
        total, previous = costs.sum(axis=0), np.zeros(len(clear))
        for block in self.blocks:
            rows = np.array(self.point_blocks) == block.block_index
            cost, other, point_count = costs[rows].sum(axis=0), others[rows].sum(axis=0), int(rows.sum())
            if np.all(np.isinf(other)):
                clear &= is_at_sketch(cost, point_count, NEAR_SKETCH) & (regularity > CLEAR_REGULARITY)
                near = is_at_sketch(cost, point_count)
                if not near.all():
                    near |= is_surely_farther(previous + self._next_cost(block, z[block.unknowns], rows), total)
                clear &= near
            else:
                clear &= is_surely_farther(previous + other, total)
            previous += cost
        return DesignAssemblies(z, clear, np.full(len(clear), -1))

    def _next_cost(self, block: Block, unknowns: Array, rows: Array) -> Array:
        """The least cost of a block's assemblies other than that with these unknowns (unknowns, designs), minus
        infinity where there are fewer of them than in the base; `rows` are the block's points."""
        roots, base_count = self.roots[block.block_index]
        count = np.ones(unknowns.shape[1], dtype=int)
        least, known = np.full(len(count), np.inf), [unknowns]
        for root in roots[1:]:
            self.batch.z0[block.unknowns] = root[:, None]
            converged, _, z, points, _ = correct_designs(self.batch, self.point_blocks, CORRECTIONS)
            z = z[block.unknowns]
            gaps = distances(self.is_angle[block.unknowns], z.T, np.array(known).transpose(0, 2, 1)).max(axis=2)
            is_new = converged & np.all(~(gaps <= SAME_ASSEMBLY_TOLERANCE), axis=0)
            cost = np.square(points - self.sketch)[rows].sum(axis=(0, 1))
            least = np.where(is_new, np.minimum(least, cost), least)
            count += is_new
            known.append(np.where(is_new, z, np.nan))
        self.batch.z0[block.unknowns] = roots[0][:, None]
        return np.where(count == base_count, least, -np.inf)


class PartialAssemblies(NamedTuple):
    """Partial assemblies of all designs side by side: z (unknowns, designs, options), which of the options there are
    (designs, options), and what tells them apart: the squared distance to the sketch, and for each block how its slides
    and points lie.
    """

    z: Array
    exists: Array
    distance: Array
    tie_keys: tuple[Array, ...] = ()

    @staticmethod
    def _map(change: Callable[..., Array], *assemblies: PartialAssemblies) -> PartialAssemblies:
        rows = zip(*((part.z, part.exists, part.distance, *part.tie_keys) for part in assemblies), strict=True)
        z, exists, distance, *tie_keys = (change(*arrays) for arrays in rows)
        return PartialAssemblies(z, exists, distance, tuple(tie_keys))

    def select(self, designs: Array) -> PartialAssemblies:
        """Those of some designs."""
        return self._map(lambda rows: rows[..., designs, :], self)

    def take(self, order: Array) -> PartialAssemblies:
        """Those options of each design (designs, options)."""
        return self._map(lambda rows: np.take_along_axis(rows, order[None] if rows.ndim == 3 else order, axis=-1), self)

    def spread(self, z: Array, exists: Array) -> PartialAssemblies:
        """Options to add a block to each partial assembly, z (unknowns, designs, options, assemblies), side by side."""
        width, shape = exists.shape[2], (len(exists), exists.shape[1] * exists.shape[2])
        distance, *tie_keys = (np.repeat(rows, width, axis=1) for rows in (self.distance, *self.tie_keys))
        return PartialAssemblies(z.reshape(len(z), *shape), exists.reshape(shape), distance, tuple(tie_keys))

    def replace(self, designs: Array, others: PartialAssemblies) -> PartialAssemblies:
        """The same with other ones of some designs; with as many options as there are of either."""
        width = max(self.exists.shape[1], others.exists.shape[1])

        def merged(rows: Array, other_rows: Array) -> Array:
            total, part = (
                np.pad(
                    array,
                    [*[(0, 0)] * (array.ndim - 1), (0, width - array.shape[-1])],
                    mode="edge" if array.dtype != bool else "constant",
                )
                for array in (rows, other_rows)
            )
            total[..., designs, :] = part
            return total

        return self._map(merged, self, others)


LONGEST_NEWTON_STEP = 0.8
"""rad or sizes: no step of Newton's method is longer."""
NEARLY_CLOSED_TOLERANCE = 1e-5
"""Lengths of the size, or rad: a block that is open by less is closed by the step from there."""
COMPACTION_INTERVAL = 4
"""Steps after which those that have closed are left out."""
SPREAD_STARTS = 24
"""Starts all over the circles."""


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

    def correct(self, block: Block, z: Array, exists: Array, starts: Array, steps: int) -> tuple[Array, Array, Array]:
        """Newton's method for a block from every start (starts, unknowns) beside z (unknowns, designs, options).

        `exists` (designs, options) are the options that there are. z (unknowns, designs, options, starts), which of
        these close, and how regular the block's Jacobian is where they ended, see `column_volume`."""
        count = len(starts)
        shape = (*exists.shape, count)
        z = np.repeat(z[..., None], count, axis=3)
        z[block.unknowns] = starts.T[:, None, None, :]
        design = np.broadcast_to(np.arange(self.p.shape[1])[:, None, None], shape).ravel()
        flat = z.reshape(len(z), -1)
        closed = np.zeros(flat.shape[1], dtype=bool)
        busy = np.flatnonzero(np.repeat(exists[..., None], count, axis=2).ravel())
        tried, *numbers = self._open_columns(flat, busy, design)
        closing = self.functions.block_call(block)
        regularity = np.zeros(flat.shape[1])
        for step in range(steps + 1):
            residuals, jacobian = closing.evaluate_batch(len(tried), tried, *numbers)
            residuals, jacobian = residuals[:, 0], jacobian.transpose(0, 2, 1)
            # the error of the next step is the square of this one, which the march looks at again
            done = np.max(np.abs(residuals), axis=1, initial=0.0) <= NEARLY_CLOSED_TOLERANCE
            regularity[busy] = column_volume(jacobian)
            move = solve_vectors(jacobian, residuals, least_squares=True)
            far = np.maximum(np.max(np.abs(move), axis=1), LONGEST_NEWTON_STEP)[:, None] / LONGEST_NEWTON_STEP
            tried[:, block.unknowns] -= move / far
            if step == steps or np.all(done):
                flat[:, busy[done]] = tried[done].T
                closed[busy[done]] = True
                break
            if step % COMPACTION_INTERVAL == COMPACTION_INTERVAL - 1:
                flat[:, busy] = tried.T
                closed[busy] = done
                busy = busy[~done & np.all(np.isfinite(tried), axis=1)]
                if not busy.size:
                    break
                tried, *numbers = self._open_columns(flat, busy, design)
        if self.counts_turns:
            flat = self._wind_back(block, flat, closed, design)
        return flat.reshape(z.shape), closed.reshape(shape), regularity.reshape(shape)

    def has_closed_form(self, block: Block) -> bool:
        """Whether both assemblies of a block are known without a search."""
        return not self.counts_turns and self.functions.block_assemblies(block) is not None

    def join(self, block: Block, partial: PartialAssemblies) -> tuple[PartialAssemblies, Array]:
        """Partial assemblies with both assemblies of a block in closed form; for which designs these are sure."""
        assemblies, exists = self.functions.block_assemblies(block), partial.exists
        assert assemblies is not None
        width = exists.shape[1]
        u, p = (np.repeat(part.T, width, axis=0) for part in (self.u, self.p))
        z = np.repeat(partial.z[..., None], 2, axis=3)
        both, coalescence = assemblies.evaluate_batch(partial.z.reshape(len(partial.z), -1).T, u, p)
        for k, unknowns in enumerate(both):
            z[block.unknowns, ..., k] = unknowns.T.reshape(-1, *exists.shape)
        near = coalescence.reshape(exists.shape)
        is_joined = near < MEETING_COSINE_SQUARED
        # of a length that turns on an arm this may have vanished
        is_open = (near >= CLEARLY_OPEN) & (not assemblies.has_changing_arm)
        joined = partial.spread(z, np.repeat((exists & is_joined)[..., None], 2, axis=2))
        return joined, np.all(is_joined | is_open | ~exists, axis=1)

    def _open_columns(self, flat: Array, busy: Array, design: Array) -> tuple[Array, Array, Array]:
        """Columns of z (columns, unknowns) that are not closed yet, with their inputs and numbers."""
        return np.ascontiguousarray(flat[:, busy].T), self.u.T[design[busy]], self.p.T[design[busy]]

    def _wind_back(self, block: Block, z: Array, closed: Array, design: Array) -> Array:
        """The same assemblies with angles at the turn nearest to none where that is closed too, as in `Candidates`."""
        least = z.copy()
        unknowns, angles = least[block.unknowns], self.equations.unknown_is_angle[block.unknowns]
        unknowns[angles] = np.arctan2(np.sin(unknowns[angles]), np.cos(unknowns[angles]))
        arguments = least.T, self.u[:, design].T, self.p[:, design].T
        residuals = self.functions.block_call(block).evaluate_batch(len(design), *arguments)[0][:, 0]
        still = closed & (np.max(np.abs(residuals), axis=1, initial=0.0) <= 10.0 * CLOSED_TOLERANCE)
        return np.where(still, least, z)

    def spread_starts(self, block: Block, roots: Array) -> Array:
        """Starts with angles spread over the circles, and lengths as the base has them."""
        factors = np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0])[: roots.shape[1]]
        grid = np.arange(SPREAD_STARTS)[:, None] * factors % 1.0
        grid = np.pad(grid, ((0, 0), (0, roots.shape[1] - grid.shape[1])), mode="reflect")
        base = roots[np.arange(SPREAD_STARTS) % len(roots)]
        return np.where(self.equations.unknown_is_angle[block.unknowns], 2.0 * np.pi * grid - np.pi, base)

    def is_distinct(self, block: Block, z: Array, exists: Array) -> Array:
        """Which of the assemblies from one partial assembly are not the same as one before (designs, options,
        starts)."""
        unknowns, distinct = np.moveaxis(z[block.unknowns], 0, -1), exists.copy()
        is_angle = self.equations.unknown_is_angle[block.unknowns] & (not self.counts_turns)
        for k in range(1, exists.shape[2]):
            gaps = distances(is_angle, unknowns[:, :, :k], unknowns[:, :, k : k + 1]).max(axis=-1, initial=0.0)
            distinct[..., k] &= ~np.any(distinct[..., :k] & (gaps < SAME_ASSEMBLY_TOLERANCE), axis=-1)
        return distinct


NEWTON_STEPS, SPREAD_NEWTON_STEPS = 8, 40
"""Newton's steps from the assemblies of the base, and from starts all over the circles."""
DAMPED_STARTS = 6
"""Starts of the damped method, by which a design is refused."""
REFUSAL_TOLERANCE = 1e-6
"""Lengths of the size by which a block stays open that is not sure to be refused."""
LARGEST_NUMBER = 1e12
"""Sizes, or rad, of a number of a pair: farther off nothing is refused by the damped method."""
MAX_PARTIAL_ASSEMBLIES = 8
"""Partial assemblies of a design that are carried on, those nearest to the sketch."""
MAX_SEARCHED_UNKNOWNS = 6
"""Unknowns of a block of which the search one by one finds every assembly from its starts; of a larger one it may not
find the nearest where that lies far from the sketch."""


class AssemblySearch:
    def __init__(self, base: ReferenceDesign, rows: DesignRows):
        p, u = rows.p, rows.u
        self.reference, self.rows, self.p, self.u = base, rows, p, u
        self.equations, self.functions = base.functions.equations, base.functions
        self.design_count = p.shape[1]
        self.candidates = base.candidates
        unit = base.unit
        self.local_points = {
            name: {
                point: Vector(*(np.reshape(part / unit, (-1, 1)) for part in place))
                for point, place in shape.points.items()
            }
            for name, shape in rows.shapes.items()
        }
        ends = np.cumsum([len(pair.number_kinds) for pair in base.mechanism.pairs])
        pair_rows = map(list, np.split(p[..., None], ends[:-1]))
        self.numbers = dict(zip(self.candidates.pairs, pair_rows, strict=True))
        self.is_sure = np.ones(self.design_count, dtype=bool)
        self.failed_block = np.full(self.design_count, -1)
        self.is_listed = np.ones(self.design_count, dtype=bool)
        "of which all assemblies of every larger block are known"
        self.clear_options: list[tuple[Block, Array]] = []
        "of larger blocks what lies where it is meant, not a number where nothing does (unknowns, designs)"
        self.sketched_point_count = sum(map(len, self.candidates.sketched_by_level.values()))
        self.dropped_distance = np.full(self.design_count, np.inf)
        "the nearest partial assembly that was not carried on"
        self.corrector = BlockCorrector(self.functions, p, u, self.candidates.counts_turns)

    def search(self) -> DesignAssemblies:
        """See `find_assemblies`."""
        joined, is_hasty = self._join_blocks(True)
        chosen = self._choose(joined)
        # a block that lies where it is meant may leave the later ones no place near the sketch
        cost = np.where(joined.exists, joined.distance, np.inf).min(axis=1)
        again = np.flatnonzero(is_hasty & ~is_at_sketch(cost, self.sketched_point_count))
        if again.size:
            slow = AssemblySearch(self.reference, self.rows.select(again))
            slow_chosen = slow._choose(slow._join_blocks(False)[0])
            chosen.z[:, again], chosen.is_sure[again], chosen.failed_block[again] = slow_chosen[:3]
        return chosen

    def _join_blocks(self, quick: bool) -> tuple[PartialAssemblies, Array]:
        """All blocks joined, and which designs had one that was clear by itself; without `quick` none is."""
        is_hasty = np.zeros(self.design_count, dtype=bool)
        unknowns = len(self.equations.unknowns)
        zero = np.zeros((self.design_count, 1))
        partial = PartialAssemblies(np.zeros((unknowns, self.design_count, 1)), zero == 0.0, zero)
        for block, (roots, base_count) in zip(self.equations.blocks, self.reference.block_assemblies, strict=True):
            if slice_length(block.rows):
                clear, extended = np.zeros(0, dtype=int), partial
                if quick:
                    clear, extended = self._extend_clearly(block, partial, roots)
                rest = np.setdiff1d(np.arange(self.design_count), clear)
                is_hasty[clear], self.is_listed[clear] = True, False
                if rest.size:
                    others, sure, listed = self._extend(
                        self.corrector.select(rest), block, partial.select(rest), roots, base_count
                    )
                    extended = extended._replace(distance=partial.distance).replace(rest, others)
                    self.is_sure[rest] &= sure
                    self.is_listed[rest] &= listed
                    none = np.flatnonzero(partial.exists.any(axis=1) & ~extended.exists.any(axis=1))
                    if none.size and self.corrector.has_closed_form(block):
                        self.failed_block[none[self.is_sure[none]]] = block.block_index
                        none = none[~self.is_sure[none]]
                    if none.size:
                        self._refuse_designs(block, none, partial, roots)
                    previous, extended = extended.distance, self._score(block, extended)
                    self._keep_clear_options(block, extended, extended.distance - previous)
                partial = self._keep_nearest(extended)
        return partial, is_hasty

    def _keep_clear_options(self, block: Block, extended: PartialAssemblies, cost: Array) -> None:
        """Keep which option of a larger block lies where it is meant: the search one by one may not look for others
        then, though later blocks can be joined to one of those alone."""
        sketched = len(self.candidates.sketched_by_level.get(block.block_index, ()))
        if sketched and slice_length(block.unknowns) > 2:
            costs = np.where(extended.exists & is_at_sketch(cost, sketched), cost, np.inf)
            nearest = extended.take(np.argmin(costs, axis=1)[:, None]).z[block.unknowns, :, 0]
            self.clear_options.append((block, np.where(np.isfinite(costs).any(axis=1), nearest, np.nan)))

    def _refuse_designs(self, block: Block, designs: Array, partial: PartialAssemblies, roots: Array) -> None:
        """Of designs that no start has led to an assembly, those that have none: where the damped method says so too.

        That of blocks of two unknowns, whose least squares it cannot miss from starts on all sides; of larger ones
        where the complete list says so.
        """
        unknowns = slice_length(block.unknowns)
        # of numbers that are none, or whose squares are none, nothing is known here
        designs = designs[np.abs(self.p[:, designs]).max(axis=0, initial=0.0) < LARGEST_NUMBER]
        if unknowns > 2:
            all_known = self.is_listed[designs] & self.is_sure[designs] & np.isinf(self.dropped_distance[designs])
            self.failed_block[designs[all_known]] = block.block_index
        if unknowns > 2 or not designs.size:
            return
        rows, options = np.nonzero(partial.exists[designs])
        design, count = designs[rows], len(rows)
        starts = self.corrector.spread_starts(block, roots)[:: SPREAD_STARTS // DAMPED_STARTS]
        column = np.tile(np.arange(count), len(starts))
        unextended = partial.z[:, design, options]
        function = self.functions.block_call(block)

        def closing(tried: Array) -> tuple[Array, Array]:
            # the last entry tells the columns apart: nothing depends on it, so no step moves it
            columns = np.rint(tried[:, -1]).astype(int)
            z = unextended[:, columns].T
            z[:, block.unknowns] = tried[:, :-1]
            numbers = self.u.T[design[columns]], self.p.T[design[columns]]
            residuals, jacobian = function.evaluate_batch(len(columns), z, *numbers)
            return residuals[:, 0], np.pad(jacobian.transpose(0, 2, 1), ((0, 0), (0, 0), (0, 1)))

        result = damped_newton(closing, np.hstack([np.repeat(starts, count, axis=0), column[:, None]]))
        # nearly closed is neither the one nor the other
        near = np.zeros(self.design_count, dtype=bool)
        near[design[column[result.residual < REFUSAL_TOLERANCE]]] = True
        self.failed_block[designs[~near[designs]]] = block.block_index

    def _extend_clearly(
        self, block: Block, partial: PartialAssemblies, roots: Array
    ) -> tuple[Array, PartialAssemblies]:
        """The designs with one option to add a block that is clearly the one meant, and that of every design.

        It is where it lies at the sketch, and the Jacobian is so regular that no other is near: see `BlockAssemblies`.
        """
        sketched = len(self.candidates.sketched_by_level.get(block.block_index, ()))
        # of a block of two both assemblies may be near the sketch, where its links are short
        if not sketched or partial.exists.shape[1] > 1 or slice_length(block.unknowns) <= 2:
            return np.zeros(0, dtype=int), partial
        z, closed, regularity = self.corrector.correct(block, partial.z, partial.exists, roots[:1], NEWTON_STEPS)
        extended = self._score(block, partial.spread(z, closed))
        near = is_at_sketch(extended.distance - partial.distance, sketched)
        return np.flatnonzero((extended.exists & near & (regularity[..., 0] > CLEAR_REGULARITY))[:, 0]), extended

    def _extend(
        self, corrector: BlockCorrector, block: Block, partial: PartialAssemblies, roots: Array, base_count: int
    ) -> tuple[PartialAssemblies, Array, Array]:
        """Every partial assembly with the options in which a block may be added, for which designs these are sure, and
        for which they are all there are."""
        count, listing, is_large = len(partial.exists), None, slice_length(block.unknowns) > 2
        if is_large:
            from planar.batch.assembly.complete_lists import block_listing  # only where it is needed

            listing = block_listing(self.reference, block.block_index)
        if listing is None:
            extended, sure = self._extend_from_starts(corrector, block, partial, roots, base_count)
            return extended, sure, np.full(count, not is_large)
        z, exists, is_complete = listing.extend(partial.z, partial.exists, corrector.p, corrector.u)
        extended, rest, sure = partial.spread(z, exists), np.flatnonzero(~is_complete), np.ones(count, dtype=bool)
        if rest.size:
            others, sure[rest] = self._extend_from_starts(
                corrector.select(rest), block, partial.select(rest), roots, base_count
            )
            extended = extended.replace(rest, others)
        return extended, sure, is_complete

    def _extend_from_starts(
        self, corrector: BlockCorrector, block: Block, partial: PartialAssemblies, roots: Array, base_count: int
    ) -> tuple[PartialAssemblies, Array]:
        """The same by Newton's method from the base's assemblies, and from starts all over the circles."""
        if corrector.has_closed_form(block):
            return corrector.join(block, partial)
        sure = np.ones(len(partial.exists), dtype=bool)
        z, exists, _ = corrector.correct(block, partial.z, partial.exists, roots, NEWTON_STEPS)
        exists &= corrector.is_distinct(block, z, exists)
        few = partial.exists & (exists.sum(axis=2) < base_count)
        if few.any():
            # where some starts led astray or to one end, others are tried as well
            designs, options = np.nonzero(few)
            part = corrector.select(designs)
            more, closed, _ = part.correct(
                block,
                partial.z[:, designs, options][:, :, None],
                partial.exists[designs, options][:, None],
                part.spread_starts(block, roots),
                SPREAD_NEWTON_STEPS,
            )
            more = np.concatenate([z[:, designs, options][:, :, None], more], axis=3)
            closed = np.concatenate([exists[designs, options][:, None], closed], axis=2)
            closed &= part.is_distinct(block, more, closed)
            order = np.argsort(~closed[:, 0], axis=1, kind="stable")[:, : len(roots)]
            # more than the base has, or some but fewer: the search one by one may see it otherwise
            count = closed[:, 0].sum(axis=1)
            sure[designs[(count > 0) & (count != base_count)]] = False
            z[:, designs, options] = np.take_along_axis(more[:, :, 0], order[None], axis=2)
            exists[designs, options] = np.take_along_axis(closed[:, 0], order, axis=1)
        return partial.spread(z, exists), sure

    def _score(self, block: Block, partial: PartialAssemblies) -> PartialAssemblies:
        """The partial assemblies with what a block adds to how they are told apart."""
        candidates, width = self.candidates, partial.exists.shape[1]
        u, p = (np.repeat(part.T, width, axis=0) for part in (self.u, self.p))
        coordinates = self.functions.coordinates(partial.z.reshape(len(partial.z), -1).T, u, p)
        w = np.ascontiguousarray(coordinates.T).reshape(-1, self.design_count, width)
        distance, *keys = candidates.block_position(block, w, self.local_points, self.numbers)
        partial = partial._replace(distance=partial.distance + distance)
        if candidates.sketched_by_level.get(block.block_index):
            return partial
        # no sketch tells them apart: slides ahead of where they start first, then what lies higher, then farther
        behind, height, ahead = keys
        keys = [np.broadcast_to(key, partial.exists.shape) for key in (behind, -height, -ahead)]
        return partial._replace(tie_keys=(*partial.tie_keys, *keys))

    def _keep_nearest(self, partial: PartialAssemblies) -> PartialAssemblies:
        """The partial assemblies nearest to the sketch, so many as are carried on."""
        if partial.exists.shape[1] <= MAX_PARTIAL_ASSEMBLIES:
            return partial
        cost = np.where(partial.exists, partial.distance, np.inf)
        order = np.argsort(cost, axis=1, kind="stable")
        self.dropped_distance = np.minimum(
            self.dropped_distance, np.take_along_axis(cost, order, axis=1)[:, MAX_PARTIAL_ASSEMBLIES]
        )
        return partial.take(order[:, :MAX_PARTIAL_ASSEMBLIES])

    def _choose(self, partial: PartialAssemblies) -> DesignAssemblies:
        cost = np.where(partial.exists, partial.distance, np.inf)
        least = cost.min(axis=1)
        best = np.argmin(cost, axis=1)
        alike = partial.exists & (cost <= least[:, None] + EQUAL_DISTANCE_TOLERANCE)
        tied = np.flatnonzero(alike.sum(axis=1) > 1)
        if tied.size:
            keys = [key[tied] for key in partial.tie_keys]
            # behind counts over all blocks, the rest block after block
            keys = [reduce(np.add, keys[::3]), *(key for k, key in enumerate(keys) if k % 3)] if keys else []
            alike = alike[tied]
            for key in keys:
                value = np.where(alike, key, np.inf)
                alike &= value <= value.min(axis=1, keepdims=True) + EQUAL_DISTANCE_TOLERANCE
            best[tied] = np.argmax(alike, axis=1)
            self.is_sure[tied[alike.sum(axis=1) > 1]] = False
        z = partial.take(best[:, None]).z[..., 0]
        shown = self.sketched_point_count
        clear = is_at_sketch(least, shown) & (shown > 0) & ~np.isin(np.arange(self.design_count), tied)
        sure = (self.is_sure | clear) & np.isfinite(least) & (least < self.dropped_distance - EQUAL_DISTANCE_TOLERANCE)
        largest = max((slice_length(block.unknowns) for block in self.equations.blocks), default=0)
        if largest > 2:
            # it may have assemblies that no start has led to: none of these is nearer than what is near
            reach = np.where(
                self.is_listed,
                np.inf if largest <= MAX_SEARCHED_UNKNOWNS else NEAR_SKETCH,
                NEAR_SKETCH if largest <= MAX_BLOCK_UNKNOWNS else CLEAR_SKETCH_DISTANCE,
            )
            sure &= is_at_sketch(least, shown, reach)
            # of two that lie where they are meant the search one by one may see one alone
            sure &= np.count_nonzero(partial.exists & is_at_sketch(cost, shown), axis=1) <= 1
            for block, clear_option in self.clear_options:
                angles = self.equations.unknown_is_angle[block.unknowns]
                gaps = distances(angles, z[block.unknowns].T, clear_option.T)
                sure &= ~np.any(gaps > SAME_ASSEMBLY_TOLERANCE, axis=1)
        return DesignAssemblies(z, sure, self.failed_block)
