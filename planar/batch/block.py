"""One block of a sweep: plain data in, arrays out, so that it may be solved in any process."""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.dead_point_tracking import stopped
from planar.batch.design_arrays import lifted, one
from planar.batch.general_path import OUTCOMES, Solved, solve_one
from planar.batch.initial_assembly import assembled
from planar.batch.march.backend import March, Marching, NotMarched, Reaching
from planar.batch.march.choice import closing, marching, reaching
from planar.batch.march.numpy_backend import rows
from planar.batch.reference_design import Base, base, spread
from planar.codegen.aligned_arrays import room
from planar.foundation.errors import Outcome
from planar.model.mechanism import FARTHEST, Mechanism

Array = np.ndarray

GENTLE = 0.03
"""rad or sizes a step on the way to where the run starts."""
MOSTLY = 0.9
"""Where more than this part of the designs can be run, all are."""
TURN = 2.0 * np.pi


class Block(NamedTuple):
    """A block that is to be solved. `designs`: names with an array (designs,) each; `start`, `stop`: see `sweep`."""

    mechanism: Mechanism
    designs: Mapping[str, Array]
    steps: int
    points: tuple[str, ...]
    rates: bool
    start: float | None
    stop: float | None
    pair: str | None
    backend: str


class Done(NamedTuple):
    """A solved block: out (steps + 1, rows, designs), x and y of every point, then first, then second rates (m, s);
    status (designs, steps + 1); positions of the running input (steps + 1,) or (designs, steps + 1); how many positions
    the general path solved, how many designs it was given; by outcome how many designs ended so, and a sentence of one.
    """

    out: Array
    status: Array
    input: Array
    general: int
    sent: int
    said: tuple[tuple[int, int, str], ...]


def solve_block(block: Block, out: Array | None = None) -> Done:
    """Solve a block, in `out` (steps + 1, rows, designs) if that is given. Raises BadInput only for what holds for all
    designs."""
    return _Solving(block, out).done()


class _Solving:
    def __init__(self, block: Block, out: Array | None):
        self.block, self.out = block, out
        self.base: Base = base(block.mechanism, block.pair)
        self.many = len(next(iter(block.designs.values())))
        self.scale = float(self.base.scale[self.base.index])
        self.all = lifted(self.base.mechanism, block.designs)
        self.u, self.u1, self.u2 = self.base.inputs(self.all, self.many)
        self.u = np.ascontiguousarray(self.u)
        here = self.u[self.base.index] * self.scale
        self.first = here if block.start is None else np.full(self.many, float(block.start))
        self.own_range = self.base.slides and block.stop is None
        "whether every design has a range of its own, from limit to limit"
        self.solved = np.full(self.many, -1)
        "how many steps are solved of a design that was followed to its end, or to a dead point"
        self.followed = 0
        self.ends = np.full(self.many, -1)
        "the group that cannot be joined, where a design surely cannot be assembled"
        length = TURN if block.stop is None else block.stop - self.first
        self.length = np.broadcast_to(np.asarray(length, dtype=float), (self.many,))

    def done(self) -> Done:
        """See `solve_block`."""
        block = self.block
        status = np.zeros((self.many, block.steps + 1), dtype=np.int8)
        grid = np.linspace(0.0, 1.0, block.steps + 1)
        same = np.ptp(self.length) == 0.0
        found = self._marched() if same and not self.own_range and self.base.marched else None
        out, good = (self._room(), np.zeros(self.many, dtype=int)) if found is None else found
        ended = (self.solved >= 0) & (good <= block.steps)
        rest = np.flatnonzero((good <= block.steps) & ~ended)
        alike = same and np.ptp(self.first) == 0.0
        if self.own_range:
            inputs = np.full((self.many, block.steps + 1), np.nan)
        elif alike:
            inputs = self.first[0] + self.length[0] * grid
        else:
            inputs = self.first[:, None] + self.length[:, None] * grid
        general, sent, said = self.followed, int(ended.sum()), {}  # by outcome how many designs, and a sentence
        dead = np.flatnonzero(ended & (self.solved <= block.steps))
        if dead.size:
            code = OUTCOMES.index(Outcome.DEAD_POINT)
            for index in dead:
                out[self.solved[index] :, :, index] = np.nan
                status[index, self.solved[index] :] = code
            first = int(dead[0])
            said[code] = dead.size, self._one(first, inputs if alike else inputs[first]).said
        refused: dict[int, Solved] = {}  # by the group that cannot be joined: the first design says it for all
        for index in rest:
            ends = int(self.ends[index])
            row = None if self.own_range else inputs if alike else inputs[index]
            told = refused.get(ends) or self._one(int(index), row)
            if ends >= 0 and OUTCOMES[told.status[0]] is Outcome.CANNOT_BE_ASSEMBLED:
                refused[ends] = told
            out[:, :, index], status[index] = told.out, told.status
            if self.own_range:
                inputs[index] = told.input
            general += int(np.sum(told.status == 0))
            sent += ends < 0
            if told.said:
                many, sentence = said.get(told.status[-1], (0, told.said))
                said[int(told.status[-1])] = many + 1, sentence
        return Done(out, status, inputs, general, sent, tuple((code, *each) for code, each in said.items()))

    def _one(self, index: int, grid: Array | None):  # noqa: ANN202
        block = self.block
        mechanism = lifted(self.base.mechanism, one(block.designs, index))
        ends = (block.start, block.stop) if grid is None else (float(grid[0]), float(grid[-1]))
        return solve_one(mechanism, self.base.pair, grid, block.steps, ends, block.points, block.rates)

    def _marched(self) -> tuple[Array, Array] | None:
        """out (m, s), and how many of the first steps passed the gate; None where no backend can run the structure."""
        block, base_ = self.block, self.base
        shapes = base_.shapes(self.all)
        p = base_.numbers(shapes, self.many)
        told = {name: base_.member(name) for name in block.points}
        moving = {name: each for name, each in told.items() if each[0] != base_.mechanism.frame}
        q = [part for link, point in moving.values() for part in shapes[link].at(point)]
        tolerance = base_.tolerance(p)
        start = assembled(base_, shapes, p, self.u, tolerance, closing(block.backend))
        self.ends = start.ends
        fit = start.sure & ~base_.unfit(block.designs, shapes) & np.all(np.isfinite(p), axis=0)
        fit &= ~base_.short(shapes, self.many)
        offsets = np.zeros((block.steps + 1, len(self.u)))
        u0 = self.u.copy()
        u0[base_.index] = self.first / self.scale
        offsets[:, base_.index] = np.linspace(0.0, self.length[0] / self.scale, block.steps + 1)
        march = March(
            base_.program,
            base_.mechanism,
            p,
            spread(q, self.many) / base_.unit,
            start.z,
            offsets,
            u0,
            self.u1,
            self.u2,
            tuple(link for link, _ in moving.values()),
            block.rates,
            tolerance,
            base_.unit,
        )
        march, fit = self._at_start(march, fit)
        for name, run in marching(block.backend):
            try:
                out, good = self._run(run, march, fit)
            except NotMarched:
                continue
            self._stopped(march, out, good, reaching(name))
            return self._whole(out, told, shapes), good
        return None

    def _room(self) -> Array:
        """Where the results stand."""
        block = self.block
        if self.out is None:
            self.out = room(block.steps + 1, 2 * len(block.points) * (3 if block.rates else 1), self.many)
        return self.out

    def _run(self, run: Marching, march: March, fit: Array) -> tuple[Array, Array]:
        """out and good of all designs, of which only the fit ones are run."""
        out = self._room()
        if march.rows != out.shape[1]:
            out = room(len(out), march.rows, self.many)
        if fit.mean() > MOSTLY:
            return out, np.where(fit, run(march, out), 0)
        some, good = np.flatnonzero(fit), np.zeros(self.many, dtype=int)
        if some.size:
            own = room(len(out), march.rows, some.size)
            good[some] = run(march.of(some), own)
            out[:, :, some] = own
        return out, good

    def _stopped(self, march: March, out: Array, good: Array, reach: Reaching | None) -> None:
        """Follow those that a backend did not bring to the end, all at once, as far as they come."""
        some = np.flatnonzero((good > 0) & (good < len(march.u)))
        if not some.size:
            return
        found = stopped(march.of(some), self.base.index, good[some], reach)
        out[found.step, :, some[found.design]] = found.out.T
        settled = some[found.settled]
        self.followed = int(found.design.size)
        self.solved[settled] = found.solved[found.settled]

    def _at_start(self, march: March, fit: Array) -> tuple[March, Array]:
        """The same march from the assemblies at its start, to which those at the designs' own positions are led."""
        gone = march.u0 - self.u
        far = float(np.max(np.abs(gone), initial=0.0))
        if far == 0.0:
            return march, fit
        if far > FARTHEST:
            return march, np.zeros_like(fit)
        places = np.linspace(0.0, 1.0, int(np.ceil(far / GENTLE)) + 2)
        with np.errstate(all="ignore"):
            (last,) = deque(rows(march, (self.u + place * gone for place in places)), maxlen=1)
        return march._replace(z0=last.z.T), fit & last.good

    def _whole(self, out: Array, told: Mapping[str, tuple[str, str]], shapes) -> Array:  # noqa: ANN001
        """The rows of all points, those on the frame filled in."""
        frame = self.base.mechanism.frame
        if all(link != frame for link, _ in told.values()):
            return out
        orders = 3 if self.block.rates else 1
        whole = self._room()
        whole[:] = 0.0
        moving = [k for k, (link, _) in enumerate(told.values()) if link != frame]
        for k, (link, point) in enumerate(told.values()):
            if link == frame:
                whole[:, 2 * k], whole[:, 2 * k + 1] = shapes[link].at(point)
        for order in range(orders):
            for place, k in enumerate(moving):
                old, new = 2 * (order * len(moving) + place), 2 * (order * len(told) + k)
                whole[:, new : new + 2] = out[:, old : old + 2]
        return whole
