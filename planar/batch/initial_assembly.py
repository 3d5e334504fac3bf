"""The assembly of every design that lies nearest to the sketch, found for all designs at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.march.backend import Closing
from planar.batch.march.checks import volume
from planar.batch.nearest_assemblies import MOST, NEAR, REGULAR, nearby
from planar.batch.reference_design import Base, of_designs
from planar.equations.constraint_equations import Stage
from planar.equations.functions import length, placed
from planar.foundation.geometry import Vector
from planar.model.link_shapes import Shape
from planar.model.pairs import Kind
from planar.solving.assembly.block_assemblies import CLEAR, SAME
from planar.solving.assembly.nearest_assembly import ALIKE
from planar.solving.newton import CLOSED, newton

Array = np.ndarray

FIRST, MORE = 8, 40
"""Newton's steps from the assemblies of the base, and from starts all over the circles."""
LONGEST = 0.8
"""rad or sizes: no step of Newton's method is longer."""
NEARLY_CLOSED = 1e-5
"""Lengths of the size, or rad: a group that is open by less is closed by the step from there."""
FEWER = 4
"""Steps after which those that have closed are left out."""
SPREAD = 24
DAMPED = 6
"""Starts of the damped method, by which a design is refused."""
NEARLY = 1e-6
"""Lengths of the size by which a group stays open that is not sure to be refused."""
KEPT = 8
"""Partial assemblies of a design that are carried on, those nearest to the sketch."""


class Assembled(NamedTuple):
    """z (unknowns, designs), and for which of them it is surely the one that the search one by one would take.

    `ends`: the level of the group that surely cannot be joined to the rest, -1 where all can (designs,).
    """

    z: Array
    sure: Array
    ends: Array


class _Partial(NamedTuple):
    """Partial assemblies of all designs: z (unknowns, designs, ways), which of the ways there are (designs, ways), and
    what they are told apart by: the squared distance to the sketch, and for each group how its slides and points lie.
    """

    z: Array
    there: Array
    distance: Array
    lying: tuple[Array, ...] = ()

    def of(self, designs: Array) -> _Partial:
        """Those of some designs."""
        lying = tuple(each[designs] for each in self.lying)
        return _Partial(self.z[:, designs], self.there[designs], self.distance[designs], lying)


def assembled(
    base: Base, shapes: Mapping[str, Shape], p: Array, u: Array, tolerance: float, close: Closing | None
) -> Assembled:
    """The assemblies at inputs u (inputs, designs), of designs with numbers p (numbers, designs) and these shapes."""
    with np.errstate(all="ignore"):  # starts that lead nowhere end as what is no number
        near = close and nearby(base, shapes, p, u, tolerance, close)
        if not near:
            return _Assembling(base, shapes, p, u).found()
        every, rest = Assembled(near.z, near.clear, np.full(len(near.clear), -1)), np.flatnonzero(~near.clear)
        if rest.size:
            own = {name: of_designs(shape, rest) for name, shape in shapes.items()}
            found = _Assembling(base, own, p[:, rest], u[:, rest]).found()
            every.z[:, rest], every.sure[rest], every.ends[rest] = found
        return every


class _Assembling:
    def __init__(self, base: Base, shapes: Mapping[str, Shape], p: Array, u: Array):
        self.base, self.shapes, self.p, self.u = base, shapes, p, u
        self.equations, self.program = base.program.equations, base.program
        self.many = p.shape[1]
        self.candidates = base.candidates
        unit = base.unit
        self.local = {
            name: {point: Vector(at.x / unit, at.y / unit) for point, at in shape.points.items()}
            for name, shape in shapes.items()
        }
        ends = np.cumsum([len(pair.measures) for pair in base.mechanism.pairs])
        self.numbers = dict(zip(self.candidates.pairs, np.split(p, ends[:-1]), strict=True))
        self.sure = np.ones(self.many, dtype=bool)
        self.ends = np.full(self.many, -1)
        self.dropped = np.full(self.many, np.inf)
        "the nearest partial assembly that was not carried on"
        self.spanned = np.zeros(0)
        "how regular the slopes of the last Newton's method were where it ended, see `volume`"

    def found(self) -> Assembled:
        """See `assembled`."""
        here, hasty = self._joined(True)
        found = self._chosen(here)
        # a group that lies where it is meant may leave the later ones no place near the sketch
        cost = np.where(here.there, here.distance, np.inf).min(axis=1)
        again = np.flatnonzero(hasty & (cost > self._shown() * CLEAR**2))
        if again.size:
            own = {name: of_designs(shape, again) for name, shape in self.shapes.items()}
            slow = _Assembling(self.base, own, self.p[:, again], self.u[:, again])
            found.z[:, again], found.sure[again], found.ends[again] = slow._chosen(slow._joined(False)[0])
        return found

    def _joined(self, quick: bool) -> tuple[_Partial, Array]:
        """All groups joined, and which designs had one that was clear by itself; without `quick` none is."""
        hasty = np.zeros(self.many, dtype=bool)
        unknowns = len(self.equations.unknowns)
        zero = np.zeros((self.many, 1))
        here = _Partial(np.zeros((unknowns, self.many, 1)), zero == 0.0, zero)
        for stage, (roots, most) in zip(self.equations.stages, self.base.roots(), strict=True):
            if length(stage.rows):
                on, rest = self._clear(stage, here, roots) if quick else (here, np.arange(self.many))
                hasty[np.setdiff1d(np.arange(self.many), rest)] = True
                if rest.size:
                    part = self._part(rest)
                    on = self._beside(here, on, rest, part._on(stage, here.of(rest), roots, most))
                    self.sure[rest] &= part.sure
                    none = np.flatnonzero(here.there.any(axis=1) & ~on.there.any(axis=1))
                    if none.size:
                        self._refused(stage, none, here, roots)
                    on = self._measured(stage, on)
                here = self._nearest(on)
        return here, hasty

    def _shown(self) -> int:
        """How many points the sketch shows."""
        return sum(map(len, self.candidates.sketched_at.values()))

    def _refused(self, stage: Stage, designs: Array, here: _Partial, roots: Array) -> None:
        """Of designs that no start has led to an assembly, those that have none: where the damped method says so too.

        Only of groups of two unknowns, whose least squares it cannot miss from starts on all sides.
        """
        unknowns = length(stage.unknowns)
        if unknowns > 2:
            return
        ways = [(design, way) for design in designs for way in np.flatnonzero(here.there[design])]
        starts = np.repeat(self._spread(stage, roots)[:: SPREAD // DAMPED], len(ways), axis=0)
        each = np.tile(np.arange(len(ways)), len(starts) // len(ways))
        design, way = np.array(ways).T
        whole = here.z[:, design, way]
        function = self.program.closed(stage)

        def closing(tried: Array) -> tuple[Array, Array]:
            # the last entry tells the columns apart: nothing depends on it, so no step moves it
            which = np.rint(tried[:, -1]).astype(int)
            z = whole[:, which].T
            z[:, stage.unknowns] = tried[:, :-1]
            left, slope = function.over(len(which), z, self.u.T[design[which]], self.p.T[design[which]])
            slope = np.concatenate([slope.transpose(0, 2, 1), np.zeros((len(which), left.shape[2], 1))], axis=2)
            return left[:, 0], slope

        ended = newton(closing, np.hstack([starts, each[:, None]]))
        # nearly closed is neither the one nor the other
        near = np.zeros(self.many, dtype=bool)
        near[design[each[ended.open < NEARLY]]] = True
        self.ends[designs[~near[designs]]] = stage.level

    def _clear(self, stage: Stage, here: _Partial, roots: Array) -> tuple[_Partial, Array]:
        """Every design with one way to add a group, and the designs for which that is not clearly the one meant.

        It is where it lies at the sketch, and the slope is so regular that no other is near: see `Candidates`.
        """
        every = np.arange(self.many)
        sketched = len(self.candidates.sketched_at.get(stage.level, ()))
        # of a group of two both assemblies may be near the sketch, where its links are short
        if not sketched or here.there.shape[1] > 1 or length(stage.unknowns) <= 2:
            return here, every
        z, closed = self._newton(stage, here, roots[:1], FIRST)
        on = self._measured(stage, here._replace(z=z[:, :, :, 0], there=closed[:, :, 0]))
        near = on.distance - here.distance <= sketched * CLEAR**2
        clear = on.there[:, 0] & near[:, 0] & (self.spanned > REGULAR)
        return on, every[~clear]

    def _beside(self, here: _Partial, clear: _Partial, rest: Array, others: _Partial) -> _Partial:
        """The ways of all designs: one of those that are clear, and those of the rest; not measured yet."""
        width = others.there.shape[1]

        def widened(own: Array, of_rest: Array) -> Array:
            whole = np.repeat(own[..., :1], width, axis=-1)
            whole[..., rest, :] = of_rest
            return whole

        there = np.zeros((self.many, width), dtype=bool)
        there[:, 0] = clear.there[:, 0]
        there[rest] = others.there
        lying = tuple(widened(*both) for both in zip(here.lying, others.lying, strict=True))
        return _Partial(widened(clear.z, others.z), there, widened(here.distance, others.distance), lying)

    def _on(self, stage: Stage, here: _Partial, roots: Array, most: int) -> _Partial:
        """Every partial assembly with the ways in which a group may be added to it."""
        found, there = self._newton(stage, here, roots, FIRST)
        there &= self._distinct(stage, found, there)
        few = here.there & (there.sum(axis=2) < most)
        if few.any():
            # where some starts led astray or to one end, others are tried as well
            designs, ways = np.nonzero(few)
            some = _Partial(here.z[:, designs, ways][:, :, None], here.there[designs, ways][:, None], here.distance)
            part = self._part(designs)
            more, closed = part._newton(stage, some, self._spread(stage, roots), MORE)
            old = found[:, designs, ways][:, :, None], there[designs, ways][:, None]
            more, closed = np.concatenate([old[0], more], axis=3), np.concatenate([old[1], closed], axis=2)
            closed &= part._distinct(stage, more, closed)
            order = np.argsort(~closed[:, 0], axis=1, kind="stable")[:, : len(roots)]
            kept = np.take_along_axis(closed[:, 0], order, axis=1)
            # more than the base has, or some but fewer: the search one by one may see it otherwise
            count = closed[:, 0].sum(axis=1)
            self.sure[designs[(count > 0) & (count != most)]] = False
            found[:, designs, ways] = np.take_along_axis(more[:, :, 0], order[None], axis=2)
            there[designs, ways] = kept
        width = there.shape[1] * there.shape[2]
        spread = np.repeat(here.distance, there.shape[2], axis=1)
        lying = tuple(np.repeat(each, there.shape[2], axis=1) for each in here.lying)
        return _Partial(found.reshape(-1, self.many, width), there.reshape(self.many, width), spread, lying)

    def _part(self, designs: Array) -> _Assembling:
        """The same for some of the designs, which may stand there twice."""
        part = object.__new__(_Assembling)
        part.__dict__ |= self.__dict__
        part.p, part.u, part.many = self.p[:, designs], self.u[:, designs], len(designs)
        part.sure = np.ones(len(designs), dtype=bool)
        return part

    def _newton(self, stage: Stage, here: _Partial, starts: Array, steps: int) -> tuple[Array, Array]:
        """Newton's method from every partial assembly and start: z (unknowns, designs, ways, starts), which close."""
        count = len(starts)
        shape = (*here.there.shape, count)
        z = np.repeat(here.z[..., None], count, axis=3)
        z[stage.unknowns] = starts.T[:, None, None, :]
        each = np.broadcast_to(np.arange(self.many)[:, None, None], shape).ravel()
        flat = z.reshape(len(z), -1)
        closed = np.zeros(flat.shape[1], dtype=bool)
        busy = np.flatnonzero(np.repeat(here.there[..., None], count, axis=2).ravel())
        at, *given = self._busy(flat, busy, each)
        closing = self.program.closed(stage)
        self.spanned = np.zeros(flat.shape[1])
        for step in range(steps + 1):
            left, slope = closing.over(len(at), at, *given)
            left, slope = left[:, 0], slope.transpose(0, 2, 1)
            # the error of the next step is the square of this one, which the march looks at again
            done = np.max(np.abs(left), axis=1, initial=0.0) <= NEARLY_CLOSED
            self.spanned[busy] = volume(slope)
            move = _step(left, slope)
            far = np.maximum(np.max(np.abs(move), axis=1), LONGEST)[:, None] / LONGEST
            at[:, stage.unknowns] -= move / far
            if step == steps or np.all(done):
                flat[:, busy[done]] = at[done].T
                closed[busy[done]] = True
                break
            if step % FEWER == FEWER - 1:
                flat[:, busy] = at.T
                closed[busy] = done
                busy = busy[~done & np.all(np.isfinite(at), axis=1)]
                if not busy.size:
                    break
                at, *given = self._busy(flat, busy, each)
        if self.candidates.counts:
            flat = self._least(stage, flat, closed, each)
        return flat.reshape(z.shape), closed.reshape(shape)

    def _busy(self, flat: Array, busy: Array, each: Array) -> tuple[Array, Array, Array]:
        """Columns of z (columns, unknowns) that are not closed yet, with their inputs and numbers."""
        return np.ascontiguousarray(flat[:, busy].T), self.u.T[each[busy]], self.p.T[each[busy]]

    def _least(self, stage: Stage, z: Array, closed: Array, each: Array) -> Array:
        """The same assemblies with angles at the turn nearest to none where that is closed too, as in `Candidates`."""
        least = z.copy()
        own, angles = least[stage.unknowns], self._angles(stage)
        own[angles] = np.arctan2(np.sin(own[angles]), np.cos(own[angles]))
        left = self.program.closing(stage)(least, self.u[:, each], self.p[:, each])[0].full()
        still = closed & (np.max(np.abs(left), axis=0, initial=0.0) <= 10.0 * CLOSED)
        return np.where(still, least, z)

    def _angles(self, stage: Stage) -> Array:
        columns = self.equations.unknowns[stage.unknowns]
        return np.array([self.equations.coordinates[c].kind is not Kind.LENGTH for c in columns], dtype=bool)

    def _spread(self, stage: Stage, roots: Array) -> Array:
        """Starts with angles spread over the circles, and lengths as the base has them."""
        angles = self._angles(stage)
        grid = np.arange(SPREAD)[:, None] * np.sqrt([2.0, 3.0, 5.0, 7.0, 11.0, 13.0, 17.0])[: roots.shape[1]] % 1.0
        grid = np.pad(grid, ((0, 0), (0, roots.shape[1] - grid.shape[1])), mode="reflect")
        like = roots[np.arange(SPREAD) % len(roots)]
        return np.where(angles, 2.0 * np.pi * grid - np.pi, like)

    def _distinct(self, stage: Stage, z: Array, there: Array) -> Array:
        """Which of the ways from one partial assembly are not the same as one before (designs, ways, starts)."""
        own, angles = z[stage.unknowns], self._angles(stage)
        found = there.copy()
        for k in range(1, there.shape[2]):
            for other in range(k):
                gap = np.abs(own[..., k] - own[..., other])
                if not self.candidates.counts:
                    gap[angles] = np.abs(2.0 * np.sin(0.5 * gap[angles]))
                found[..., k] &= ~(found[..., other] & np.all(gap < SAME, axis=0))
        return found

    def _measured(self, stage: Stage, here: _Partial) -> _Partial:
        """The partial assemblies with what a group adds to how they are told apart."""
        candidates, width = self.candidates, here.there.shape[1]
        u, p = (np.repeat(part.T, width, axis=0) for part in (self.u, self.p))
        found = self.program.coordinates(here.z.reshape(len(here.z), -1).T, u, p)
        w = np.ascontiguousarray(found.T).reshape(-1, self.many, width)
        sketched = {name: candidates.first[name] for name in candidates.sketched_at.get(stage.level, ())}
        pairs = {name: candidates.pairs[name] for name in stage.pairs}
        links = {*stage.links, *(link for pair in pairs.values() for link in pair.bodies)}
        links |= {link for _, link, _ in sketched.values()}
        frames, own = placed(w, candidates.column, links, pairs)

        def carried(link: str, point: str) -> Vector:
            return frames[link].carry(Vector(*(np.reshape(part, (-1, 1)) for part in self.local[link][point])))

        distance = here.distance.copy()
        for name, (_, link, point) in sketched.items():
            gap = carried(link, point) - candidates.sketch[name]
            distance += gap.dot(gap)
        if sketched:
            return here._replace(distance=distance)
        # no sketch tells them apart: slides ahead of where they start first, then what lies higher, then farther
        behind, far = np.zeros(here.there.shape), np.zeros(here.there.shape)
        for name, pair in pairs.items():
            if pair.coordinates:
                numbers = [number[:, None] for number in self.numbers[name]]
                drive = np.asarray(pair.drive([frames[link] for link in pair.bodies], numbers, own[name]))
                behind += ~np.vectorize(pair.ahead, otypes=[bool])(drive)
                far = far + drive
        heights = [carried(link, point).y for link in stage.links for point in self.local[link]]
        height = np.mean(np.broadcast_arrays(*heights, far), axis=0) if heights else far * 0.0
        return here._replace(distance=distance, lying=(*here.lying, behind, -height, -far))

    def _nearest(self, here: _Partial) -> _Partial:
        """The partial assemblies nearest to the sketch, so many as are carried on."""
        if here.there.shape[1] <= KEPT:
            return here
        cost = np.where(here.there, here.distance, np.inf)
        order = np.argsort(cost, axis=1, kind="stable")
        self.dropped = np.minimum(self.dropped, np.take_along_axis(cost, order, axis=1)[:, KEPT])
        order = order[:, :KEPT]
        lying = tuple(np.take_along_axis(each, order, axis=1) for each in here.lying)
        return _Partial(
            np.take_along_axis(here.z, order[None], axis=2),
            np.take_along_axis(here.there, order, axis=1),
            np.take_along_axis(here.distance, order, axis=1),
            lying,
        )

    def _chosen(self, here: _Partial) -> Assembled:
        cost = np.where(here.there, here.distance, np.inf)
        least = cost.min(axis=1)
        best = np.argmin(cost, axis=1)
        alike = here.there & (cost <= least[:, None] + ALIKE)
        tied = np.flatnonzero(alike.sum(axis=1) > 1)
        if tied.size:
            keys = [each[tied] for each in here.lying]
            # behind counts over all groups, the rest group after group
            keys = [sum(keys[::3])] + [key for k, key in enumerate(keys) if k % 3] if keys else []
            left = alike[tied]
            for key in keys:
                value = np.where(left, key, np.inf)
                left &= value <= value.min(axis=1, keepdims=True) + ALIKE
            best[tied] = np.argmax(left, axis=1)
            self.sure[tied[left.sum(axis=1) > 1]] = False
        z = np.take_along_axis(here.z, best[None, :, None], axis=2)[..., 0]
        shown = self._shown()
        clear = (least <= shown * CLEAR**2) & (shown > 0) & ~np.isin(np.arange(self.many), tied)
        sure = (self.sure | clear) & np.isfinite(least) & (least < self.dropped - ALIKE)
        largest = max((length(stage.unknowns) for stage in self.equations.stages), default=0)
        if largest > 2:
            # it may have assemblies that no start has led to: none of these is nearer than what is near
            sure &= least <= shown * (NEAR if largest <= MOST else CLEAR) ** 2
        return Assembled(z, sure, self.ends)


def _step(left: Array, slope: Array) -> Array:
    """Newton's step back (designs, unknowns); left (designs, rows), slope (designs, rows, unknowns)."""
    rows, unknowns = slope.shape[1:]
    if rows == unknowns == 1:
        return left / slope[:, :, 0]
    if rows == unknowns == 2:
        a, b, c, d = (slope[:, i, j] for i in (0, 1) for j in (0, 1))
        one, two = left[:, 0], left[:, 1]
        return np.stack([d * one - b * two, a * two - c * one], axis=1) / (a * d - b * c)[:, None]
    try:
        return np.linalg.solve(slope, left[:, :, None])[..., 0]
    except np.linalg.LinAlgError:
        return (np.linalg.pinv(np.nan_to_num(slope)) @ left[:, :, None])[..., 0]
