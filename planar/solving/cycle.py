"""A run of positions, each with its velocities and accelerations, that keeps to one branch and stops where it ends."""

from __future__ import annotations

from math import isfinite, pi

import numpy as np

from planar.algebra import Jet
from planar.errors import BadInput, NoAnswer, Outcome
from planar.mechanism import Drive, Mechanism, with_inputs
from planar.motion import InputMotion, Motion
from planar.pairs import Kind
from planar.program import placed
from planar.solving.branch import cancelling
from planar.solving.follow import Run, follow, reach, run
from planar.solving.freedom import SINGULAR, strengths
from planar.solving.position import Solver
from planar.words import listed

Array = np.ndarray

FARTHEST = 100.0
"""Lengths of the size: a slide that goes on so far has no limit."""
FAST = 50.0
"""Beside a limit, at follow's least step from it, the rest moves some thousand times as fast as the input."""
MOST_STEPS = 10**5


def cycle(
    mechanism: Mechanism,
    steps: int = 360,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
) -> Motion:
    """The motion of the assembly nearest to the sketch while one input runs from `start` to `stop` (rad or m).

    `steps` divide the range, so there are steps + 1 positions. Left out, the range is one turn on from the file's
    position where the input makes it, else from limit to limit; a slide's is always that. `pair` names the input that
    runs, where there are several; the others stand still. Every row has the file's velocity and acceleration of
    the input that runs, as the chapters do; it is no run in time.

    A motion that ends before `stop` says so in its `outcome` and `reason`. Where no velocity is determined (a dead
    point, the limits of a range) rates are NaN. Raises BadInput for an input or a range that is not there,
    NoAnswer where there is no position to start from.
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps <= MOST_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MOST_STEPS} is wanted, not {steps!r:.40}")
    for name, value in (("start", start), ("stop", stop)):
        if value is not None and not isfinite(value):
            raise BadInput(name, f"a finite number (rad or m) is wanted, not {value!r}")
    runner = _Runner(mechanism, pair)
    return runner.between(steps, start, stop)


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
        here = float(self.u[self.index])
        first = here if start is None else start / self.scale
        if start is not None and stop is None and self.slides:
            stop = self._end(self.found.z, here, 1.0)[1] * self.scale
        if stop is not None or (start is not None and not self.slides):
            last = first + 2.0 * pi if stop is None else stop / self.scale
            z = follow(self.solver, self.p, self.found.z, self.u, self._at(first))
            found, inputs = self._run(steps, z, first, last)
            return self._motion(found, inputs) if found.stopped is None else self._stopped(found, inputs)
        if not self.slides:
            whole, inputs = self._run(steps, self.found.z, here, here + 2.0 * pi)
            if whole.stopped is None:
                return self._motion(whole, inputs)
        (low_z, low), (high_z, high) = (self._end(self.found.z, here, sign) for sign in (-1.0, 1.0))
        # from within to the limits: from a limit two branches lead inwards
        grid = np.linspace(low, high, steps + 1)
        back, on = grid[(grid < here) & (grid > low)][::-1], grid[(grid >= here) & (grid < high)]
        down, up = (self._through(np.concatenate([[here], part])) for part in (back, on))
        for part in (down, up):
            if part.stopped is not None:
                return self._motion(part, self._inputs_at(np.concatenate([[here], back if part is down else on])))
        z = np.concatenate([[low_z], down.z[:0:-1], up.z[1:], [high_z]])
        found = Run(z, down.general + up.general, self._crossing(z, grid))
        return self._motion(found, self._inputs_at(grid), ends=(0, -1))

    def _stopped(self, found: Run, inputs: Array) -> Motion:
        """A run that did not come to its end, with a last row where it stopped."""
        here = inputs[len(found.z) - 1]
        z, part = reach(self.solver, self.p, found.z[-1], here, inputs[-1] - here)
        if part == 0.0:
            return self._motion(found, inputs)
        inputs = np.vstack([inputs[: len(found.z)], here + part * (inputs[-1] - here)])
        return self._motion(found._replace(z=np.vstack([found.z, z])), inputs, ends=(-1,))

    def _crossing(self, z: Array, grid: Array) -> NoAnswer | None:
        """What to say of a range that ends where branches cross; None where both its ends are limits.

        At a limit the input turns back, so that the rest moves ever faster beside it; at a crossing it does not.
        """
        slopes, drives = self.solver.program.slopes(z[[0, -1]], self._inputs_at(grid[[0, -1]]), self.p)
        fast = np.abs(cancelling(slopes, drives)[:, :, self.index]).max(axis=1, initial=0.0)
        slow = [float(end) for end, rate in zip(grid[[0, -1]], fast, strict=True) if rate < FAST]
        if not slow:
            return None
        told = listed([self.solver.where(self._at(end)) for end in slow])
        sentence = f"at {told} branches of the motion cross; this one is followed up to there, and no further"
        return NoAnswer(Outcome.BRANCH_LOST, sentence)

    def _through(self, positions: Array) -> Run:
        return run(self.solver, self.p, self.found.z, self._inputs_at(positions))

    def _inputs_at(self, positions: Array) -> Array:
        inputs = np.repeat(self.u[None], len(positions), axis=0)
        inputs[:, self.index] = positions
        return inputs

    def _at(self, position: float) -> Array:
        u = self.u.copy()
        u[self.index] = position
        return u

    def _end(self, z: Array, here: float, sign: float) -> tuple[Array, float]:
        """Unknowns and position of the input where its range ends."""
        far = FARTHEST if self.slides else 2.0 * pi
        found, part = reach(self.solver, self.p, z, self.u, self._at(here + sign * far) - self.u)
        if part == 1.0 and self.slides:
            told = "the slide goes on without a limit; name where the range starts and stops"
            raise BadInput(self.pair, told)
        return found, here + part * sign * far

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
                told = (
                    f"on the way the {what} break pair {pair!r} by {broken:.2g} of the greatest; name a smaller range"
                )
                raise NoAnswer(Outcome.DEAD_POINT, told)
        solver.refuse_gap(frames, own)
        outcome, reason = Outcome.SOLVED, ""
        if found.stopped is not None:
            outcome, reason = found.stopped.outcome, found.stopped.reason
        elif ends:
            reason = f"the range of {self.pair!r} ends at {solver.where(u[0])} and {solver.where(u[-1])}"
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
