"""The assembly of every design that lies nearest to the sketch, found for all designs at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import AssemblyCorrector
from planar.batch.march.checks import column_volume
from planar.batch.nearest_assemblies import CLEAR_REGULARITY, MAX_BLOCK_UNKNOWNS, NEAR_SKETCH, find_nearest_assemblies
from planar.batch.reference_design import ReferenceDesign, shape_of_designs
from planar.equations.constraint_equations import Block
from planar.equations.functions import frames_from_coordinates, slice_length
from planar.foundation.geometry import Vector
from planar.model.link_shapes import LinkShape
from planar.model.pairs import MeasureKind
from planar.solving.assembly.block_assemblies import CLEAR_SKETCH_DISTANCE, SAME_ASSEMBLY_TOLERANCE
from planar.solving.assembly.nearest_assembly import EQUAL_DISTANCE_TOLERANCE
from planar.solving.newton import CLOSED_TOLERANCE, damped_newton

Array = np.ndarray

NEWTON_STEPS, SPREAD_NEWTON_STEPS = 8, 40
"""Newton's steps from the assemblies of the base, and from starts all over the circles."""
LONGEST_NEWTON_STEP = 0.8
"""rad or sizes: no step of Newton's method is longer."""
NEARLY_CLOSED_TOLERANCE = 1e-5
"""Lengths of the size, or rad: a group that is open by less is closed by the step from there."""
COMPACTION_INTERVAL = 4
"""Steps after which those that have closed are left out."""
SPREAD_STARTS = 24
DAMPED_STARTS = 6
"""Starts of the damped method, by which a design is refused."""
REFUSAL_TOLERANCE = 1e-6
"""Lengths of the size by which a group stays open that is not sure to be refused."""
MAX_PARTIAL_ASSEMBLIES = 8
"""Partial assemblies of a design that are carried on, those nearest to the sketch."""


class DesignAssemblies(NamedTuple):
    """z (unknowns, designs), and for which of them it is surely the one that the search one by one would take.

    `ends`: the level of the group that surely cannot be joined to the rest, -1 where all can (designs,).
    """

    z: Array
    is_sure: Array
    failed_block: Array


class _PartialAssemblies(NamedTuple):
    """Partial assemblies of all designs: z (unknowns, designs, ways), which of the ways there are (designs, ways), and
    what they are told apart by: the squared distance to the sketch, and for each group how its slides and points lie.
    """

    z: Array
    exists: Array
    distance: Array
    tie_keys: tuple[Array, ...] = ()

    def select(self, designs: Array) -> _PartialAssemblies:
        """Those of some designs."""
        lying = tuple(each[designs] for each in self.tie_keys)
        return _PartialAssemblies(self.z[:, designs], self.exists[designs], self.distance[designs], lying)


def find_assemblies(
    reference: ReferenceDesign,
    shapes: Mapping[str, LinkShape],
    p: Array,
    u: Array,
    tolerance: float,
    corrector: AssemblyCorrector | None,
) -> DesignAssemblies:
    """The assemblies at inputs u (inputs, designs), of designs with numbers p (numbers, designs) and these shapes."""
    with np.errstate(all="ignore"):  # starts that lead nowhere end as what is no number
        near = corrector and find_nearest_assemblies(reference, shapes, p, u, tolerance, corrector)
        if not near:
            return _AssemblySearch(reference, shapes, p, u).search()
        every, rest = (
            DesignAssemblies(near.z, near.is_clear, np.full(len(near.is_clear), -1)),
            np.flatnonzero(~near.is_clear),
        )
        if rest.size:
            own = {name: shape_of_designs(shape, rest) for name, shape in shapes.items()}
            found = _AssemblySearch(reference, own, p[:, rest], u[:, rest]).search()
            every.z[:, rest], every.is_sure[rest], every.failed_block[rest] = found
        return every


class _AssemblySearch:
    def __init__(self, base: ReferenceDesign, shapes: Mapping[str, LinkShape], p: Array, u: Array):
        self.reference, self.shapes, self.p, self.u = base, shapes, p, u
        self.equations, self.functions = base.functions.equations, base.functions
        self.design_count = p.shape[1]
        self.candidates = base.candidates
        unit = base.unit
        self.local_points = {
            name: {point: Vector(at.x / unit, at.y / unit) for point, at in shape.points.items()}
            for name, shape in shapes.items()
        }
        ends = np.cumsum([len(pair.number_kinds) for pair in base.mechanism.pairs])
        self.numbers = dict(zip(self.candidates.pairs, np.split(p, ends[:-1]), strict=True))
        self.is_sure = np.ones(self.design_count, dtype=bool)
        self.failed_block = np.full(self.design_count, -1)
        self.dropped_distance = np.full(self.design_count, np.inf)
        "the nearest partial assembly that was not carried on"
        self.regularity = np.zeros(0)
        "how regular the slopes of the last Newton's method were where it ended, see `volume`"

    def search(self) -> DesignAssemblies:
        """See `find_assemblies`."""
        here, hasty = self._join_blocks(True)
        found = self._choose(here)
        # a group that lies where it is meant may leave the later ones no place near the sketch
        cost = np.where(here.exists, here.distance, np.inf).min(axis=1)
        again = np.flatnonzero(hasty & (cost > self._sketched_point_count() * CLEAR_SKETCH_DISTANCE**2))
        if again.size:
            own = {name: shape_of_designs(shape, again) for name, shape in self.shapes.items()}
            slow = _AssemblySearch(self.reference, own, self.p[:, again], self.u[:, again])
            found.z[:, again], found.is_sure[again], found.failed_block[again] = slow._choose(
                slow._join_blocks(False)[0]
            )
        return found

    def _join_blocks(self, quick: bool) -> tuple[_PartialAssemblies, Array]:
        """All groups joined, and which designs had one that was clear by itself; without `quick` none is."""
        hasty = np.zeros(self.design_count, dtype=bool)
        unknowns = len(self.equations.unknowns)
        zero = np.zeros((self.design_count, 1))
        here = _PartialAssemblies(np.zeros((unknowns, self.design_count, 1)), zero == 0.0, zero)
        for stage, (roots, most) in zip(self.equations.blocks, self.reference.block_assemblies(), strict=True):
            if slice_length(stage.rows):
                on, rest = self._extend_clearly(stage, here, roots) if quick else (here, np.arange(self.design_count))
                hasty[np.setdiff1d(np.arange(self.design_count), rest)] = True
                if rest.size:
                    part = self._select(rest)
                    on = self._merge_extensions(here, on, rest, part._extend(stage, here.select(rest), roots, most))
                    self.is_sure[rest] &= part.is_sure
                    none = np.flatnonzero(here.exists.any(axis=1) & ~on.exists.any(axis=1))
                    if none.size:
                        self._refuse_designs(stage, none, here, roots)
                    on = self._score(stage, on)
                here = self._keep_nearest(on)
        return here, hasty

    def _sketched_point_count(self) -> int:
        """How many points the sketch shows."""
        return sum(map(len, self.candidates.sketched_by_level.values()))

    def _refuse_designs(self, stage: Block, designs: Array, here: _PartialAssemblies, roots: Array) -> None:
        """Of designs that no start has led to an assembly, those that have none: where the damped method says so too.

        Only of groups of two unknowns, whose least squares it cannot miss from starts on all sides.
        """
        unknowns = slice_length(stage.unknowns)
        if unknowns > 2:
            return
        ways = [(design, way) for design in designs for way in np.flatnonzero(here.exists[design])]
        starts = np.repeat(self._spread_starts(stage, roots)[:: SPREAD_STARTS // DAMPED_STARTS], len(ways), axis=0)
        each = np.tile(np.arange(len(ways)), len(starts) // len(ways))
        design, way = np.array(ways).T
        whole = here.z[:, design, way]
        function = self.functions.block_call(stage)

        def closing(tried: Array) -> tuple[Array, Array]:
            # the last entry tells the columns apart: nothing depends on it, so no step moves it
            which = np.rint(tried[:, -1]).astype(int)
            z = whole[:, which].T
            z[:, stage.unknowns] = tried[:, :-1]
            left, slope = function.evaluate_batch(len(which), z, self.u.T[design[which]], self.p.T[design[which]])
            slope = np.concatenate([slope.transpose(0, 2, 1), np.zeros((len(which), left.shape[2], 1))], axis=2)
            return left[:, 0], slope

        ended = damped_newton(closing, np.hstack([starts, each[:, None]]))
        # nearly closed is neither the one nor the other
        near = np.zeros(self.design_count, dtype=bool)
        near[design[each[ended.residual < REFUSAL_TOLERANCE]]] = True
        self.failed_block[designs[~near[designs]]] = stage.block_index

    def _extend_clearly(self, stage: Block, here: _PartialAssemblies, roots: Array) -> tuple[_PartialAssemblies, Array]:
        """Every design with one way to add a group, and the designs for which that is not clearly the one meant.

        It is where it lies at the sketch, and the slope is so regular that no other is near: see `BlockAssemblies`.
        """
        every = np.arange(self.design_count)
        sketched = len(self.candidates.sketched_by_level.get(stage.block_index, ()))
        # of a group of two both assemblies may be near the sketch, where its links are short
        if not sketched or here.exists.shape[1] > 1 or slice_length(stage.unknowns) <= 2:
            return here, every
        z, closed = self._correct(stage, here, roots[:1], NEWTON_STEPS)
        on = self._score(stage, here._replace(z=z[:, :, :, 0], exists=closed[:, :, 0]))
        near = on.distance - here.distance <= sketched * CLEAR_SKETCH_DISTANCE**2
        clear = on.exists[:, 0] & near[:, 0] & (self.regularity > CLEAR_REGULARITY)
        return on, every[~clear]

    def _merge_extensions(
        self, here: _PartialAssemblies, clear: _PartialAssemblies, rest: Array, others: _PartialAssemblies
    ) -> _PartialAssemblies:
        """The ways of all designs: one of those that are clear, and those of the rest; not measured yet."""
        width = others.exists.shape[1]

        def widened(own: Array, of_rest: Array) -> Array:
            whole = np.repeat(own[..., :1], width, axis=-1)
            whole[..., rest, :] = of_rest
            return whole

        there = np.zeros((self.design_count, width), dtype=bool)
        there[:, 0] = clear.exists[:, 0]
        there[rest] = others.exists
        lying = tuple(widened(*both) for both in zip(here.tie_keys, others.tie_keys, strict=True))
        return _PartialAssemblies(widened(clear.z, others.z), there, widened(here.distance, others.distance), lying)

    def _extend(self, stage: Block, here: _PartialAssemblies, roots: Array, most: int) -> _PartialAssemblies:
        """Every partial assembly with the ways in which a group may be added to it."""
        found, there = self._correct(stage, here, roots, NEWTON_STEPS)
        there &= self._is_distinct(stage, found, there)
        few = here.exists & (there.sum(axis=2) < most)
        if few.any():
            # where some starts led astray or to one end, others are tried as well
            designs, ways = np.nonzero(few)
            some = _PartialAssemblies(
                here.z[:, designs, ways][:, :, None], here.exists[designs, ways][:, None], here.distance
            )
            part = self._select(designs)
            more, closed = part._correct(stage, some, self._spread_starts(stage, roots), SPREAD_NEWTON_STEPS)
            old = found[:, designs, ways][:, :, None], there[designs, ways][:, None]
            more, closed = np.concatenate([old[0], more], axis=3), np.concatenate([old[1], closed], axis=2)
            closed &= part._is_distinct(stage, more, closed)
            order = np.argsort(~closed[:, 0], axis=1, kind="stable")[:, : len(roots)]
            kept = np.take_along_axis(closed[:, 0], order, axis=1)
            # more than the base has, or some but fewer: the search one by one may see it otherwise
            count = closed[:, 0].sum(axis=1)
            self.is_sure[designs[(count > 0) & (count != most)]] = False
            found[:, designs, ways] = np.take_along_axis(more[:, :, 0], order[None], axis=2)
            there[designs, ways] = kept
        width = there.shape[1] * there.shape[2]
        spread = np.repeat(here.distance, there.shape[2], axis=1)
        lying = tuple(np.repeat(each, there.shape[2], axis=1) for each in here.tie_keys)
        return _PartialAssemblies(
            found.reshape(-1, self.design_count, width), there.reshape(self.design_count, width), spread, lying
        )

    def _select(self, designs: Array) -> _AssemblySearch:
        """The same for some of the designs, which may stand there twice."""
        part = object.__new__(_AssemblySearch)
        part.__dict__ |= self.__dict__
        part.p, part.u, part.design_count = self.p[:, designs], self.u[:, designs], len(designs)
        part.is_sure = np.ones(len(designs), dtype=bool)
        return part

    def _correct(self, stage: Block, here: _PartialAssemblies, starts: Array, steps: int) -> tuple[Array, Array]:
        """Newton's method from every partial assembly and start: z (unknowns, designs, ways, starts), which close."""
        count = len(starts)
        shape = (*here.exists.shape, count)
        z = np.repeat(here.z[..., None], count, axis=3)
        z[stage.unknowns] = starts.T[:, None, None, :]
        each = np.broadcast_to(np.arange(self.design_count)[:, None, None], shape).ravel()
        flat = z.reshape(len(z), -1)
        closed = np.zeros(flat.shape[1], dtype=bool)
        busy = np.flatnonzero(np.repeat(here.exists[..., None], count, axis=2).ravel())
        at, *given = self._open_columns(flat, busy, each)
        closing = self.functions.block_call(stage)
        self.regularity = np.zeros(flat.shape[1])
        for step in range(steps + 1):
            left, slope = closing.evaluate_batch(len(at), at, *given)
            left, slope = left[:, 0], slope.transpose(0, 2, 1)
            # the error of the next step is the square of this one, which the march looks at again
            done = np.max(np.abs(left), axis=1, initial=0.0) <= NEARLY_CLOSED_TOLERANCE
            self.regularity[busy] = column_volume(slope)
            move = _newton_step(left, slope)
            far = np.maximum(np.max(np.abs(move), axis=1), LONGEST_NEWTON_STEP)[:, None] / LONGEST_NEWTON_STEP
            at[:, stage.unknowns] -= move / far
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
        if self.candidates.counts_turns:
            flat = self._wind_back(stage, flat, closed, each)
        return flat.reshape(z.shape), closed.reshape(shape)

    def _open_columns(self, flat: Array, busy: Array, each: Array) -> tuple[Array, Array, Array]:
        """Columns of z (columns, unknowns) that are not closed yet, with their inputs and numbers."""
        return np.ascontiguousarray(flat[:, busy].T), self.u.T[each[busy]], self.p.T[each[busy]]

    def _wind_back(self, stage: Block, z: Array, closed: Array, each: Array) -> Array:
        """The same assemblies with angles at the turn nearest to none where that is closed too, as in
        `BlockAssemblies`."""
        least = z.copy()
        own, angles = least[stage.unknowns], self._is_angle(stage)
        own[angles] = np.arctan2(np.sin(own[angles]), np.cos(own[angles]))
        left = self.functions.block_function(stage)(least, self.u[:, each], self.p[:, each])[0].full()
        still = closed & (np.max(np.abs(left), axis=0, initial=0.0) <= 10.0 * CLOSED_TOLERANCE)
        return np.where(still, least, z)

    def _is_angle(self, stage: Block) -> Array:
        columns = self.equations.unknowns[stage.unknowns]
        return np.array([self.equations.coordinates[c].kind is not MeasureKind.LENGTH for c in columns], dtype=bool)

    def _spread_starts(self, stage: Block, roots: Array) -> Array:
        """Starts with angles spread over the circles, and lengths as the base has them."""
        angles = self._is_angle(stage)
        grid = (
            np.arange(SPREAD_STARTS)[:, None] * np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0])[: roots.shape[1]] % 1.0
        )
        grid = np.pad(grid, ((0, 0), (0, roots.shape[1] - grid.shape[1])), mode="reflect")
        like = roots[np.arange(SPREAD_STARTS) % len(roots)]
        return np.where(angles, 2.0 * np.pi * grid - np.pi, like)

    def _is_distinct(self, stage: Block, z: Array, there: Array) -> Array:
        """Which of the ways from one partial assembly are not the same as one before (designs, ways, starts)."""
        own, angles = z[stage.unknowns], self._is_angle(stage)
        found = there.copy()
        for k in range(1, there.shape[2]):
            for other in range(k):
                gap = np.abs(own[..., k] - own[..., other])
                if not self.candidates.counts_turns:
                    gap[angles] = np.abs(2.0 * np.sin(0.5 * gap[angles]))
                found[..., k] &= ~(found[..., other] & np.all(gap < SAME_ASSEMBLY_TOLERANCE, axis=0))
        return found

    def _score(self, stage: Block, here: _PartialAssemblies) -> _PartialAssemblies:
        """The partial assemblies with what a group adds to how they are told apart."""
        candidates, width = self.candidates, here.exists.shape[1]
        u, p = (np.repeat(part.T, width, axis=0) for part in (self.u, self.p))
        found = self.functions.coordinates(here.z.reshape(len(here.z), -1).T, u, p)
        w = np.ascontiguousarray(found.T).reshape(-1, self.design_count, width)
        sketched = {
            name: candidates.first_link[name] for name in candidates.sketched_by_level.get(stage.block_index, ())
        }
        pairs = {name: candidates.pairs[name] for name in stage.pairs}
        links = {*stage.links, *(link for pair in pairs.values() for link in pair.bodies)}
        links |= {link for _, link, _ in sketched.values()}
        frames, own = frames_from_coordinates(w, candidates.column, links, pairs)

        def carried(link: str, point: str) -> Vector:
            return frames[link].to_world(
                Vector(*(np.reshape(part, (-1, 1)) for part in self.local_points[link][point]))
            )

        distance = here.distance.copy()
        for name, (_, link, point) in sketched.items():
            gap = carried(link, point) - candidates.sketch[name]
            distance += gap.dot(gap)
        if sketched:
            return here._replace(distance=distance)
        # no sketch tells them apart: slides ahead of where they start first, then what lies higher, then farther
        behind, far = np.zeros(here.exists.shape), np.zeros(here.exists.shape)
        for name, pair in pairs.items():
            if pair.coordinate_kinds:
                numbers = [number[:, None] for number in self.numbers[name]]
                drive = np.asarray(pair.input_position([frames[link] for link in pair.bodies], numbers, own[name]))
                behind += ~np.vectorize(pair.is_intended_assembly, otypes=[bool])(drive)
                far = far + drive
        heights = [carried(link, point).y for link in stage.links for point in self.local_points[link]]
        height = np.mean(np.broadcast_arrays(*heights, far), axis=0) if heights else far * 0.0
        return here._replace(distance=distance, tie_keys=(*here.tie_keys, behind, -height, -far))

    def _keep_nearest(self, here: _PartialAssemblies) -> _PartialAssemblies:
        """The partial assemblies nearest to the sketch, so many as are carried on."""
        if here.exists.shape[1] <= MAX_PARTIAL_ASSEMBLIES:
            return here
        cost = np.where(here.exists, here.distance, np.inf)
        order = np.argsort(cost, axis=1, kind="stable")
        self.dropped_distance = np.minimum(
            self.dropped_distance, np.take_along_axis(cost, order, axis=1)[:, MAX_PARTIAL_ASSEMBLIES]
        )
        order = order[:, :MAX_PARTIAL_ASSEMBLIES]
        lying = tuple(np.take_along_axis(each, order, axis=1) for each in here.tie_keys)
        return _PartialAssemblies(
            np.take_along_axis(here.z, order[None], axis=2),
            np.take_along_axis(here.exists, order, axis=1),
            np.take_along_axis(here.distance, order, axis=1),
            lying,
        )

    def _choose(self, here: _PartialAssemblies) -> DesignAssemblies:
        cost = np.where(here.exists, here.distance, np.inf)
        least = cost.min(axis=1)
        best = np.argmin(cost, axis=1)
        alike = here.exists & (cost <= least[:, None] + EQUAL_DISTANCE_TOLERANCE)
        tied = np.flatnonzero(alike.sum(axis=1) > 1)
        if tied.size:
            keys = [each[tied] for each in here.tie_keys]
            # behind counts over all groups, the rest group after group
            keys = [sum(keys[::3])] + [key for k, key in enumerate(keys) if k % 3] if keys else []
            left = alike[tied]
            for key in keys:
                value = np.where(left, key, np.inf)
                left &= value <= value.min(axis=1, keepdims=True) + EQUAL_DISTANCE_TOLERANCE
            best[tied] = np.argmax(left, axis=1)
            self.is_sure[tied[left.sum(axis=1) > 1]] = False
        z = np.take_along_axis(here.z, best[None, :, None], axis=2)[..., 0]
        shown = self._sketched_point_count()
        clear = (least <= shown * CLEAR_SKETCH_DISTANCE**2) & (shown > 0) & ~np.isin(np.arange(self.design_count), tied)
        sure = (self.is_sure | clear) & np.isfinite(least) & (least < self.dropped_distance - EQUAL_DISTANCE_TOLERANCE)
        largest = max((slice_length(stage.unknowns) for stage in self.equations.blocks), default=0)
        if largest > 2:
            # it may have assemblies that no start has led to: none of these is nearer than what is near
            sure &= least <= shown * (NEAR_SKETCH if largest <= MAX_BLOCK_UNKNOWNS else CLEAR_SKETCH_DISTANCE) ** 2
        return DesignAssemblies(z, sure, self.failed_block)


def _newton_step(residuals: Array, jacobians: Array) -> Array:
    """Newton's step back (designs, unknowns); left (designs, rows), slope (designs, rows, unknowns)."""
    rows, unknowns = jacobians.shape[1:]
    if rows == unknowns == 1:
        return residuals / jacobians[:, :, 0]
    if rows == unknowns == 2:
        a, b, c, d = (jacobians[:, i, j] for i in (0, 1) for j in (0, 1))
        one, two = residuals[:, 0], residuals[:, 1]
        return np.stack([d * one - b * two, a * two - c * one], axis=1) / (a * d - b * c)[:, None]
    try:
        return np.linalg.solve(jacobians, residuals[:, :, None])[..., 0]
    except np.linalg.LinAlgError:
        return (np.linalg.pinv(np.nan_to_num(jacobians)) @ residuals[:, :, None])[..., 0]
