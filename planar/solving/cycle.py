"""A run of positions, each with its velocities and accelerations, that keeps to one branch and stops where it ends."""

from __future__ import annotations

from math import pi
from numbers import Integral, Real
from typing import NamedTuple

import numpy as np

from planar.algebra import Jet
from planar.errors import BadInput, NoAnswer, Outcome
from planar.mechanism import FARTHEST, Drive, Mechanism, with_inputs
from planar.motion import Motion
from planar.pairs import Kind
from planar.program import placed
from planar.results import InputMotion
from planar.solving import refusals
from planar.solving.branch import cancelling
from planar.solving.follow import Run, follow, reach, run
from planar.solving.freedom import SINGULAR, strengths
from planar.solving.position import Solver
from planar.words import listed

Array = np.ndarray

ENDLESS = 100.0
"""Lengths of the size: a slide that goes on so far has no limit."""
LEAST = 1e-5
"""rad or sizes: a range shorter than this is none; and how far beside the end of a run its limit may lie."""
BESIDE, REFINEMENTS, NUDGE = 1e-2, 6, 1e-7
"""Beside a limit unknowns move as the square root of the input does: so far at the most, in so many refinements."""
FAST = 50.0
"""Beside a limit, at follow's least step from it, the rest moves some thousand times as fast as the input."""
MOST_STEPS = 10**5
"""A run of so many positions of forty links takes some hundred megabytes."""


def cycle(
    mechanism: Mechanism,
    steps: int = 360,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
) -> Motion:
    """The motion of the assembly nearest to the sketch while one input runs from `start` to `stop` (rad or m).

    `steps` divide the range, so there are steps + 1 positions unless it ends before. Left out, the range is one turn on
    from the file's position where the input makes it, else from limit to limit; a slide's is always that. `pair` names
    the input that runs, where there are several; the others stand still. Every row has the file's velocity and
    acceleration of the input that runs, as the chapters do; it is no run in time.

    A motion that ends before `stop` says so in its `outcome` and `reason`. Where no velocity is determined (a dead
    point, the limits of a range) rates are NaN. Raises BadInput for an input or a range that is not there,
    NoAnswer where there is no position to start from.
    """
    if isinstance(steps, bool) or not isinstance(steps, Integral) or not 1 <= steps <= MOST_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MOST_STEPS} is wanted, not {steps!r:.40}")
    for name, value in (("start", start), ("stop", stop)):
        if value is None:
            continue
        if isinstance(value, bool) or not isinstance(value, Real) or not abs(value) <= FARTHEST:
            raise BadInput(name, f"a number up to {FARTHEST:g} (rad or m) is wanted, not {value!r:.40}")
    runner = _Runner(mechanism, pair)
    return runner.between(int(steps), start, stop)


class _End(NamedTuple):
    """An end of a range: the unknowns and the position there, whether the input goes on, or branches cross."""

    z: Array
    position: float
    open: bool
    crosses: bool


class _Runner:
    """One input of a mechanism that runs while the others stand still."""

    def __init__(self, mechanism: Mechanism, pair: str | None):
        names = [given.pair for given in mechanism.inputs]
        if not names:
            raise BadInput("inputs", "the mechanism has no input that could run")
        if pair is None and len(names) > 1:
            raise BadInput("inputs", f"there are several inputs, {', '.join(names)}; name the one that runs")
        if pair is not None and pair not in names:
            raise BadInput(pair, f"there is no input at {pair!r}; inputs are at {', '.join(names)}")
        self.index = names.index(pair) if pair is not None else 0
        still = tuple(Drive(name, None, 0.0, 0.0) for k, name in enumerate(names) if k != self.index)
        self.solver = Solver(with_inputs(mechanism, still))
        self.pair = names[self.index]
        self.slides = self.solver.named[self.pair].drive_kind is Kind.LENGTH
        self.scale = self.solver.unit if self.slides else 1.0
        self.u = self.solver.station.u
        self.p = self.solver.station.p
        self.found = self.solver.assembly()

    def between(self, steps: int, start: float | None, stop: float | None) -> Motion:
        """The run over a range, or over the one that the input has by itself."""
        here = float(self.u[self.index])
        if start is None and stop is None:
            return self._whole(steps, here)
        first = here if start is None else start / self.scale
        z = follow(self.solver, self.p, self.found.z, self.u, self._at(first))
        if stop is not None or not self.slides:
            last = first + 2.0 * pi if stop is None else stop / self.scale
            found, inputs = self._run(steps, z, first, last)
            return self._motion(found, inputs) if found.stopped is None else self._stopped(found, inputs)
        end = self._end(z, first, 1.0)
        inputs = self._inputs_at(np.linspace(first, end.position, steps + 1))
        found = run(self.solver, self.p, z, inputs[:-1])
        if found.stopped is not None:
            return self._stopped(found, inputs)
        return self._motion(found._replace(z=np.vstack([found.z, end.z])), inputs, ends=(-1,))

    def _whole(self, steps: int, here: float) -> Motion:
        """One turn on where the input makes it, else all between its limits."""
        if not self.slides:
            found, inputs = self._run(steps, self.found.z, here, here + 2.0 * pi)
            if found.stopped is None:
                return self._motion(found, inputs)
        low, high = (self._end(self.found.z, here, sign) for sign in (-1.0, 1.0))
        if high.position - low.position < LEAST:
            self.solver.state(self.found.z)  # says why nothing goes on from a dead point or a change point
            at = self.solver.told(self.pair, here)
            told = f"the input at {self.pair!r} cannot move from {at} while the other inputs stand still"
            raise NoAnswer(Outcome.TOO_MANY_INPUTS, told)
        # from within to the limits: from a limit two branches lead inwards
        grid = np.linspace(low.position, high.position, steps + 1)
        back, on = grid[(grid < here) & (grid > grid[0])][::-1], grid[(grid >= here) & (grid < grid[-1])]
        down, up = (self._through(np.concatenate([[here], part])) for part in (back, on))
        for part, way in ((down, back), (up, on)):
            if part.stopped is not None:
                return self._stopped(part, self._inputs_at(np.concatenate([[here], way])))
        z = np.concatenate([[low.z], down.z[:0:-1], up.z[1:], [high.z]])
        slow = [end.position for end in (low, high) if end.crosses]
        found = Run(z, down.general + up.general, self._crossing(slow) if slow else None)
        ends = tuple(index for index, end in ((0, low), (-1, high)) if not end.open)
        return self._motion(found, self._inputs_at(grid), ends)

    def _stopped(self, found: Run, inputs: Array) -> Motion:
        """A run that did not come to its end, with a last row where it stopped."""
        here = inputs[len(found.z) - 1]
        z, part = reach(self.solver, self.p, found.z[-1], here, inputs[-1] - here)
        if part == 0.0:
            return self._motion(found, inputs)
        z, u, _ = self._settled(z, here + part * (inputs[-1] - here))
        inputs = np.vstack([inputs[: len(found.z)], u])
        return self._motion(found._replace(z=np.vstack([found.z, z])), inputs, ends=(-1,))

    def _crossing(self, slow: list[float]) -> NoAnswer:
        """What to say of a range that ends where branches cross."""
        told = listed([self.solver.told(self.pair, end) for end in slow])
        sentence = f"at {told} branches of the motion cross; this one is followed up to there, and no further"
        return NoAnswer(Outcome.BRANCH_LOST, sentence)

    def _through(self, positions: Array) -> Run:
        return run(self.solver, self.p, self.found.z, self._inputs_at(positions))

    def _inputs_at(self, positions: Array) -> Array:
        inputs = np.repeat(self.u[None], len(positions), axis=0)
        inputs[:, self.index] = positions
        return inputs

    def _at(self, position: float) -> Array:
        return self._inputs_at(np.array([position]))[0]

    def _end(self, z: Array, here: float, sign: float) -> _End:
        """Where the range of the input ends, one way from a position with unknowns z."""
        far = sign * (ENDLESS if self.slides else 2.0 * pi)
        start, way = self._at(here), self._at(here + far) - self._at(here)
        found, part = reach(self.solver, self.p, z, start, way)
        if part == 1.0:
            if self.slides:
                told = "the slide goes on without a limit; name where the range starts and stops"
                raise BadInput(self.pair, told)
            return _End(found, here + far, True, False)
        found, u, crosses = self._settled(found, start + part * way)
        return _End(found, float(u[self.index]), False, crosses)

    def _settled(self, z: Array, u: Array) -> tuple[Array, Array, bool]:
        """The end of a run, a limit to round-off, and whether branches cross there instead.

        At a limit the input turns back, so that the rest moves ever faster beside it; at a crossing it does not.
        """
        slopes, drives = self.solver.program.slopes(z[None], u[None], self.p)
        if np.abs(cancelling(slopes, drives)[:, :, self.index]).max(initial=0.0) < FAST:
            return z, u, True
        return (*self._limit(z, u), False)

    def _limit(self, z: Array, u: Array) -> tuple[Array, Array]:
        """The limit next to a position, to round-off: where constraints have a slope with a null vector n, |n| = 1.

        Newton's method for z, n and the input that runs; the position itself where that does not lead to one beside it.
        """
        program, many = self.solver.program, len(z)
        found, place = z.copy(), u.copy()
        slopes, _ = program.slopes(z[None], u[None], self.p)
        null = np.linalg.svd(slopes[0])[2][-1] if slopes.size else np.zeros(0)
        still = np.zeros_like(u)
        for _ in range(REFINEMENTS):
            left, slope = program.deflated(found, null, place, still, self.p)
            nudged = place.copy()
            nudged[self.index] += NUDGE
            ahead, _ = program.deflated(found, null, nudged, still, self.p)
            unit = np.concatenate([np.zeros(many), null, [0.0]])
            system = np.vstack([np.hstack([slope, ((ahead - left) / NUDGE)[:, None]]), unit])
            step = np.linalg.lstsq(system, -np.append(left, 0.5 * (null @ null - 1.0)), rcond=1e-12)[0]
            found, null = found + step[:many], null + step[many:-1]
            place[self.index] += step[-1]
        near = abs(place[self.index] - u[self.index]) < LEAST and np.max(np.abs(found - z), initial=0.0) < BESIDE
        closed = near and self.solver.open_along(found[None], place[None])[0] <= self.solver.tolerance
        return (found, place) if closed else (z, u)

    def _run(self, steps: int, z: Array, first: float, last: float) -> tuple[Run, Array]:
        inputs = self._inputs_at(np.linspace(first, last, steps + 1))
        return run(self.solver, self.p, z, inputs), inputs

    def _motion(self, found: Run, inputs: Array, ends: tuple[int, ...] = ()) -> Motion:
        """The run with its rates; at its `ends` it goes on no further."""
        solver, many = self.solver, len(found.z)
        u = inputs[:many]
        w, w1, w2 = _rates(solver, found.z, u)
        # where the input turns back, no velocity of the rest goes with one of the input
        w1[list(ends)] = w2[list(ends)] = np.nan
        parts = np.stack([w, w1, w2]) * solver.scale
        jets = [Jet(*parts[:, :, column]) for column in range(parts.shape[2])]
        frames, own = placed(jets, solver.column, solver.shapes, solver.pairs)
        determined = ~np.isnan(w1).any(axis=1) if w1.size else np.ones(many, dtype=bool)
        for (gaps, pair), what in zip(solver.gate.rate_gaps(frames, own), ("velocities", "accelerations"), strict=True):
            broken = np.broadcast_to(gaps, (many,))[determined].max(initial=0.0)
            if broken > 1e3 * solver.tolerance:
                raise refusals.broken_rates(solver, what, pair, float(broken))
        solver.refuse_gap(frames, own)
        outcome, reason = Outcome.SOLVED, ""
        if found.stopped is not None:
            outcome, reason = found.stopped.outcome, found.stopped.reason
        elif ends:
            told = listed([self.solver.told(self.pair, float(u[end, self.index])) for end in ends])
            reason = f"the range of {self.pair!r} ends at {told}"
        return Motion(
            mechanism=solver.mechanism,
            inputs=self._inputs(u),
            outcome=outcome,
            reason=reason,
            residual=float(solver.open_along(found.z, u).max(initial=0.0)),
            remarks=solver.remarks(self.found),
            frames=frames,
            own=own,
            shapes=solver.shapes,
        )

    def _inputs(self, u: Array) -> dict[str, InputMotion]:
        found = {}
        for index, given in enumerate(self.solver.mechanism.inputs):
            position = np.full(len(u), given.position)
            if index == self.index:
                position = u[:, index] * self.scale
            rates = (np.full(len(u), rate) for rate in (given.velocity, given.acceleration))
            found[given.pair] = InputMotion(position, *rates)
        return found


def _rates(solver: Solver, z: Array, u: Array) -> tuple[Array, Array, Array]:
    """w with its first and second rate at samples (samples, coordinates); NaN where none is determined."""
    station, many = solver.station, len(z)
    y = np.hstack([z, u])
    u1, u2 = (np.repeat(rate[None], many, axis=0) for rate in (station.u1, station.u2))
    none = np.zeros_like(z)
    rest = solver.program.kinematics(y, np.hstack([none, u1]), np.hstack([none, u2]), station.p)
    strong = np.array([strengths(solver, slope).min(initial=1.0) >= SINGULAR for slope in rest.slope])
    slopes = np.where(strong[:, None, None], rest.slope, np.nan)
    z1 = _solved(slopes, rest.F1, strong)
    y1 = np.hstack([z1, u1])
    moving = solver.program.kinematics(y, y1, np.hstack([none, u2]), station.p)
    y2 = np.hstack([_solved(slopes, moving.F2, strong), u2])
    whole = solver.program.kinematics(y, y1, y2, station.p)
    weak = ~strong[:, None]
    return whole.w, np.where(weak, np.nan, whole.w1), np.where(weak, np.nan, whole.w2)


def _solved(slopes: Array, known: Array, strong: Array) -> Array:
    found = np.full((len(slopes), slopes.shape[2]), np.nan)
    if strong.any():
        found[strong] = cancelling(slopes[strong], known[strong][..., None])[..., 0]
    return found
