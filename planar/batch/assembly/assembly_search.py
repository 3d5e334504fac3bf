"""The search for the assemblies of many designs, block after block, all ways to add one side by side."""

from __future__ import annotations

from collections.abc import Callable
from functools import reduce
from typing import NamedTuple

import numpy as np

from planar.batch.assembly.assembly_scores import (
    CLEARLY_OPEN,
    MAX_BLOCK_UNKNOWNS,
    NEAR_SKETCH,
    DesignAssemblies,
    is_at_sketch,
    is_clearly_regular,
)
from planar.batch.march.checks import column_volume
from planar.batch.reference_design import DesignRows, ReferenceDesign
from planar.equations.coordinates import frames_from_coordinates
from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_vectors
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.angles import distances
from planar.foundation.geometry import Vector
from planar.solving.assembly.block_assemblies import (
    CLEAR_SKETCH_DISTANCE,
    MEETING_COSINE_SQUARED,
    SAME_ASSEMBLY_TOLERANCE,
)
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE
from planar.solving.newton import CLOSED_TOLERANCE, damped_newton

Array = np.ndarray


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
            name: {point: Vector(place.x / unit, place.y / unit) for point, place in shape.points.items()}
            for name, shape in rows.shapes.items()
        }
        ends = np.cumsum([len(pair.number_kinds) for pair in base.mechanism.pairs])
        self.numbers = dict(zip(self.candidates.pairs, np.split(p, ends[:-1]), strict=True))
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
        return np.flatnonzero((extended.exists & near & is_clearly_regular(regularity[..., 0]))[:, 0]), extended

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
        names = candidates.sketched_by_level.get(block.block_index, ())
        sketched = {name: candidates.first_link[name][1:] for name in names}
        pairs = {name: candidates.pairs[name] for name in block.pairs}
        links = {*block.links, *(link for pair in pairs.values() for link in pair.bodies)}
        links |= {link for link, _ in sketched.values()}
        frames, pair_coordinates = frames_from_coordinates(w, candidates.column, links, pairs)

        def place(link: str, point: str) -> Vector:
            local = self.local_points[link][point]
            return frames[link].to_world(Vector(*(np.reshape(part, (-1, 1)) for part in local)))

        distance = partial.distance.copy()
        for name, member in sketched.items():
            gap = place(*member) - candidates.sketch[name]
            distance += gap.dot(gap)
        if sketched:
            return partial._replace(distance=distance)
        # no sketch tells them apart: slides ahead of where they start first, then what lies higher, then farther
        behind, far = np.zeros(partial.exists.shape), np.zeros(partial.exists.shape)
        for name, pair in pairs.items():
            if pair.coordinate_kinds:
                numbers = [number[:, None] for number in self.numbers[name]]
                bodies = [frames[link] for link in pair.bodies]
                position = np.asarray(pair.input_position(bodies, numbers, pair_coordinates[name]))
                behind += ~np.vectorize(pair.is_intended_assembly, otypes=[bool])(position)
                far = far + position
        heights = [place(link, point).y for link in block.links for point in self.local_points[link]]
        height = np.mean(np.broadcast_arrays(*heights, far), axis=0) if heights else far * 0.0
        return partial._replace(distance=distance, tie_keys=(*partial.tie_keys, behind, -height, -far))

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
