"""A mechanism let go: its motion in time under loads, weights and springs."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from numbers import Real
from typing import Any

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.dynamics.equations_of_motion import FULL_RANK_REGULARITY, EquationsOfMotion
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.imbalance import explain_loose_links
from planar.dynamics.lagrangian import lagrangian_functions
from planar.dynamics.load_validation import check_loads
from planar.dynamics.load_variation import first_kink
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.geometry import Frame, frame_at
from planar.foundation.jets import Jet
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Input, Mechanism
from planar.model.run_arguments import check_steps
from planar.model.wording import join_all_names, quote_names
from planar.results.motion import Motion, State
from planar.results.records import InputMotion
from planar.solving.position import PositionSolver, solve

RELATIVE_TOLERANCE = 1e-12
"""What a step may be off, of sizes and turns and of the rates that are reached."""
MAX_DURATION = 1e4
CONSTANT_ENERGY_TOLERANCE = 1e-12
"""Energies that change by less than this part of the greatest do not change."""
SHORTEST_STEP_RATIO, MAX_SHORT_STEPS = 1e-10, 20
"""Of the time: so many steps in a row that are shorter than this get nowhere."""
CHANGE_POINT_REGULARITY, EXTRAPOLATION_STEPS, REMEMBERED_STEPS, EXTRAPOLATION_TOLERANCE = 5e-3, 6, 200, 1e-5
"""A weakest constraint beside the strongest as near a change point; from how many of the steps before, and of how many,
the motion goes on beyond, and by how much these may miss."""
PROJECTION_TOLERANCE = 1e-8
"""What is brought back onto the constraints by more than this is bent: near a change point these are weak."""
LEAST_REGULARITY = 1e-5
"""Nearer to a change point accelerations are no more told by the constraints."""
ProgressCallback = Callable[[float], None]
"""Told how much of the time is done, from 0 to 1."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A motion in time, and its energies at every row (n,), J.

    `work` is what loads, dampers and driven inputs have put in since the start, so that kinetic + potential - work
    stays what it was: `balance` is how far it does not, of the greatest of the three.
    """

    motion: Motion
    kinetic: Array
    potential: Array
    work: Array
    driven: tuple[str, ...]

    __repr__ = short_repr

    @property
    def balance(self) -> float:
        """How well energy is kept: the greatest change of what should not change, beside what goes to and fro.

        Where nothing goes to and fro, beside the greatest of the energies.
        """
        whole = self.kinetic + self.potential - self.work
        swing = max(float(np.ptp(each)) for each in (self.kinetic, self.potential, self.work))
        most = max(float(np.abs(each).max()) for each in (self.kinetic, self.potential, self.work))
        beside = swing if swing > CONSTANT_ENERGY_TOLERANCE * most else most
        return float(np.ptp(whole)) / beside if beside else 0.0


@takes_mechanism
def simulate(
    mechanism: Mechanism,
    duration: float,
    steps: int = 360,
    driven: Sequence[str] = (),
    *,
    moving: bool = False,
    tick: ProgressCallback | None = None,
) -> Simulation:
    """The motion of a mechanism that is let go at the file's position, for a duration (s), in so many steps.

    Inputs that have a law keep to it, the others only say where the motion starts; `driven` names others that are to
    keep to their laws, or to the file's velocity and acceleration. From rest, or `moving` with the file's velocities.
    Accelerations come from masses, loads, weights, springs and dampers; they are integrated by the method of order 8 of
    Dormand and Prince (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, II.5), and
    after every step the position is brought back onto the constraints.

    A motion that cannot go on says so in its `outcome` and `reason`. Raises BadInput for a duration or names that are
    none, NoAnswer where there is no position to start from, or something can move that has no mass.

    >>> import planar
    >>> planar.simulate(planar.load("door-closer"), 0.1, 10).motion.outcome.value
    'solved'
    """
    if isinstance(duration, bool) or not isinstance(duration, Real) or not 0.0 < duration <= MAX_DURATION:
        raise BadInput("duration", f"a time above zero up to {MAX_DURATION:g} s is wanted, not {duration!r:.40}")
    check_steps(steps)
    names = [given.pair for given in mechanism.inputs]
    for pair in driven:
        if pair not in names:
            raise BadInput(
                "driven", f"there is no input at {pair!r} to be driven; the inputs are at {', '.join(names)}"
            )
    kept = [given.pair for given in mechanism.inputs if given.law is not None or given.pair in driven]
    check_loads(mechanism)
    PositionSolver(mechanism).refuse_misfit("a motion that is let go is not told")
    started = (
        mechanism
        if moving
        else replace(mechanism, inputs=tuple(_initial_input(each, kept) for each in mechanism.inputs))
    )
    return _SimulationRun(solve(started), kept, duration, steps).run(tick)


def _initial_input(given: Input, kept: Sequence[str]) -> Input:
    """An input as it starts: from rest where it is let go, at its law's own rates where it is driven."""
    if given.pair not in kept:
        return given._replace(velocity=0.0, acceleration=0.0, law=None)
    if given.law is None:
        return given
    _, velocity, acceleration, _ = given.law.evaluate(np.zeros(1), given.position, given.velocity)[:, 0]
    return given._replace(velocity=float(velocity), acceleration=float(acceleration))


def _end_sentence(time: float, why: str) -> str:
    return f"the motion can be told only to {time:.6g} s{why}"


class _SimulationRun:
    """One motion from a solved position."""

    def __init__(self, start: State, kept: Sequence[str], duration: float, steps: int):
        self.start, self.mechanism, self.driven = start, start.mechanism, tuple(kept)
        self.work = lagrangian_functions(self.mechanism)
        q, q1, _ = (each[0] for each in self.work.coordinates(start))
        unit = mechanism_size(self.mechanism, self.work.shapes)
        self.equations = EquationsOfMotion(self.work, kept, unit, self.work.initial_spring_turns(q))
        self.coordinate_count = len(q)
        q, q1 = self.equations.project(0.0, q, q1)
        self.initial_state = np.concatenate([q, q1, [0.0]])
        self.is_firm = False
        "whether constraints are far from a change point"
        self.time = np.linspace(0.0, duration, steps + 1)

    def run(self, tick: ProgressCallback | None) -> Simulation:
        rows, outcome, reason = self._integrate(tick)
        self.equations.pieces = None
        time = self.time[: len(rows)]
        q, q1 = rows[:, : self.coordinate_count], rows[:, self.coordinate_count : 2 * self.coordinate_count]
        q2 = np.array([self._accelerations(*each) for each in zip(time, q, q1, strict=True)])
        energies = np.array([self.equations.energies(*each) for each in zip(time, q, q1, strict=True)])
        motion = replace(self._make_motion(time, q, q1, q2), outcome=outcome, reason=reason)
        return Simulation(motion, energies[:, 0], energies[:, 1], rows[:, -1], self.driven)

    def _freedom_remark(self) -> Iterator[str]:
        """That nothing moves freely, where that is so."""
        if self.equations.rank != self.coordinate_count:
            return
        if not self.driven:
            yield "nothing can move: the pairs hold every link"
            return
        by_law = [given.pair for given in self.mechanism.inputs if given.law is not None]
        options = [f"--drive {name}" for name in self.driven if name not in by_law]
        ways = [f"leave out {' or '.join(options)}"] if options else []
        ways += [f"take the law of {quote_names(by_law)} out of the file"] if by_law else []
        yield (
            f"nothing moves freely: the driven inputs at {quote_names(self.driven)} determine the whole motion, and "
            f"loads, weights and springs only what these supply; to let it go {', or '.join(ways)}"
        )

    def _accelerations(self, time: float, q: Array, q1: Array) -> Array:
        """Those of a row; not a number where nothing tells them."""
        try:
            pushed = self.equations.accelerations_at(time, q, q1)
        except NoAnswer:
            return np.full(self.coordinate_count, np.nan)
        return pushed.q2 if pushed.regularity > LEAST_REGULARITY else np.full(self.coordinate_count, np.nan)

    def _integrate(self, tick: ProgressCallback | None) -> tuple[Array, Outcome, str]:
        """The rows at all times that were reached, and why not all of them were."""
        rows = [self.initial_state]
        if not np.all(np.isfinite(self.equations.accelerations_at(0.0, *self._split_state(self.initial_state)).q2)):
            return (
                np.array(rows),
                Outcome.BRANCH_LOST,
                _end_sentence(0.0, self._explain_failure(0.0, self.initial_state)),
            )
        try:
            stopped = self._add_rows(rows, tick)
        except NoAnswer as massless:
            told = _end_sentence(float(self.time[len(rows) - 1]), f": beyond, {massless.reason}")
            return np.array(rows), massless.outcome, told
        return np.array(rows), Outcome.BRANCH_LOST if stopped else Outcome.SOLVED, stopped

    def _add_rows(self, rows: list[Array], tick: ProgressCallback | None) -> str:
        """Add the rows after the first, as far as they can be told; why not all of them."""
        last = float(self.time[-1])
        self._hold_pieces(0.0, self.initial_state)
        solver, tiny = self._integrator(0.0, self.initial_state), 0
        good: list[tuple[float, Array]] = []
        while solver.status == "running":
            before, failed = (solver.t, solver.y), False
            try:
                solver.step()
            except FloatingPointError:
                failed = True
            firm = self.equations.accelerations_at(solver.t, *self._split_state(solver.y)).regularity
            self.is_firm = firm > FULL_RANK_REGULARITY
            y = self._project(solver.t, solver.y)
            failed = failed or self._relative_change(solver.y, y) > PROJECTION_TOLERANCE
            length = solver.step_size or 0.0
            kink = None if failed or solver.status == "failed" else self._first_kink(solver, before)
            done = length if kink is None else kink[0] - before[0]
            tiny = tiny + 1 if done < SHORTEST_STEP_RATIO * last else 0
            if failed or solver.status == "failed" or tiny > MAX_SHORT_STEPS:
                over = self._extrapolate_beyond(good, solver.t) if firm < CHANGE_POINT_REGULARITY else None
                if over is None:
                    return _end_sentence(solver.t, self._explain_failure(solver.t, solver.y))
                at, inner = over
                self._add_rows_until(rows, at, inner)
                y = self._project(at, inner(at))
                self._hold_pieces(at, y)
                solver, good, tiny = self._integrator(at, y), [], 0
                continue
            at = solver.t if kink is None else kink[0]
            if len(rows) < len(self.time) and self.time[len(rows)] <= at:
                self._add_rows_until(rows, at, solver.dense_output())
            if kink is not None:
                y = self._project(*kink)
                self._hold_pieces(at, y, solver.y if at == before[0] else None)
                solver = self._integrator(at, y, length)
            else:
                solver.y, solver.f = y, self._state_rate(solver.t, y)
            if firm > CHANGE_POINT_REGULARITY:
                good = [*good[-REMEMBERED_STEPS:], (at, y)]
            if tick is not None:
                tick(at / last)
        return ""

    def _hold_pieces(self, time: float, y: Array, ahead: Array | None = None) -> None:
        """Hold loads that vary on the pieces of their courses on which they are, going on towards a state ahead."""
        places = self.equations.course_places(time, *self._split_state(y))
        if ahead is not None:
            then = self.equations.course_places(time, *self._split_state(ahead))
            places = [(at, beyond - at) for (at, _), (beyond, _) in zip(places, then, strict=True)]
        self.equations.pieces = self.equations.course_pieces(places)

    def _first_kink(self, solver: Any, before: tuple[float, Array]) -> tuple[float, Array] | None:
        """Where in the last step a load first left the piece of its course, so that the next one holds from there."""
        if not self.equations.pieces:
            return None
        course_places = self.equations.course_places
        ends = [course_places(time, *self._split_state(y)) for time, y in (before, (solver.t, solver.y))]
        inner: list[Any] = []

        def places(time: float) -> list[tuple[float, float]]:
            inner[:] = inner or [solver.dense_output()]
            return course_places(time, *self._split_state(inner[0](time)))

        found = first_kink(self.equations.pieces, (before[0], solver.t), (ends[0], ends[1]), places)
        return None if found is None else (found, before[1] if found == before[0] else np.asarray(inner[0](found)))

    def _add_rows_until(self, rows: list[Array], end: float, interpolant: Callable[..., Array]) -> None:
        """Add the rows up to a time, on the constraints; with rates as they come where constraints would bend them."""
        while len(rows) < len(self.time) and self.time[len(rows)] <= end:
            time = float(self.time[len(rows)])
            y = np.asarray(interpolant(time))
            back = self._project(time, y)
            if self._relative_change(y, back) > PROJECTION_TOLERANCE:
                back[self.coordinate_count :] = y[self.coordinate_count :]
            rows.append(back)

    def _relative_change(self, y: Array, back: Array) -> float:
        """How far coordinates and rates are moved, of sizes and turns and of the rates."""
        scale = np.concatenate(
            [self.equations.scale, np.maximum(np.abs(y[self.coordinate_count : -1]), self.equations.scale)]
        )
        return float(np.abs((back - y)[:-1] / scale).max(initial=0.0))

    def _integrator(self, time: float, y: Array, step: float | None = None) -> Any:
        from scipy.integrate import DOP853  # slow to load, and only needed here

        last, n = float(self.time[-1]), self.coordinate_count
        scales = np.concatenate([self.equations.scale, self.equations.scale / last, [1.0]])
        fastest = max(float(np.abs(self.initial_state[n : 2 * n] / self.equations.scale).max(initial=0.0)) * last, 1.0)
        scales[n : 2 * n] *= fastest
        scales[-1] = max(
            float(np.abs(self.equations.energies(0.0, *self._split_state(self.initial_state))).max()), 1e-9
        )
        first = None if step is None or time >= last else min(step, last - time)
        tolerances = {"rtol": RELATIVE_TOLERANCE, "atol": RELATIVE_TOLERANCE * scales}
        return DOP853(self._state_rate, time, y, last, first_step=first, **tolerances)

    def _explain_failure(self, time: float, y: Array) -> str:
        loose = explain_loose_links(self.mechanism)
        if loose:
            return f": {loose}"
        pushed = self.equations.accelerations_at(time, *self._split_state(y))
        if pushed.regularity < CHANGE_POINT_REGULARITY:
            driven = f"a dead point of what is driven at {join_all_names(self.driven)}, or " if self.driven else ""
            return f", near {driven}a change point, where branches of the motion cross"
        if not np.all(np.isfinite(pushed.q2)):
            return ", where the ends of a spring or damper meet, so that it has no direction"
        return ", where accelerations grow without end"

    def _extrapolate_beyond(
        self, good: Sequence[tuple[float, Array]], stalled: float
    ) -> tuple[float, Callable[..., Array]] | None:
        """Half as far beyond a change point as the last good step is before it, and the polynomial to there.

        There constraints do not tell accelerations, but the motion is smooth. None where it is not, as where an input
        jams, or where too few steps are known.
        """
        from scipy.interpolate import KroghInterpolator

        chosen: list[tuple[float, Array]] = []
        for time, y in reversed(good):
            # about so far from one another as from what they tell
            if not chosen or chosen[-1][0] - time >= 0.5 * (stalled - good[-1][0]):
                chosen.append((time, y))
        if len(chosen) < EXTRAPOLATION_STEPS:
            return None
        chosen = chosen[EXTRAPOLATION_STEPS - 1 :: -1]
        at = [time for time, _ in chosen for _ in range(2)]
        inner = KroghInterpolator(at, [each for time, y in chosen for each in (y, self._state_rate(time, y))])
        beyond = stalled + 0.5 * (stalled - good[-1][0])
        found = np.asarray(inner(beyond))
        if beyond > self.time[-1] or not np.all(np.isfinite(found)):
            return None
        back = self._project(beyond, found)
        return (
            (beyond, inner)
            if self._relative_change(found, back) < EXTRAPOLATION_TOLERANCE
            and self.equations.accelerations_at(beyond, *self._split_state(back)).regularity
            > 0.1 * CHANGE_POINT_REGULARITY
            else None
        )

    def _split_state(self, y: Array) -> tuple[Array, Array]:
        return y[: self.coordinate_count], y[self.coordinate_count : -1]

    def _state_rate(self, time: float, y: Array) -> Array:
        q, q1 = self._split_state(y)
        way = self.equations.regular_accelerations if self.is_firm else self.equations.accelerations_at
        found = way(time, q, q1)
        if not np.all(np.isfinite(found.q2)):
            raise FloatingPointError  # with no number the integrator would never end
        return np.concatenate([q1, found.q2, [found.power]])

    def _project(self, time: float, y: Array) -> Array:
        """The nearest position and rates that the constraints allow."""
        return np.concatenate([*self.equations.project(time, *self._split_state(y)), y[-1:]])

    def _make_motion(self, time: Array, *orders: Array) -> Motion:
        """The rows as a motion like any other."""
        at = {
            link: [Jet(*(order[:, k + j] for order in orders)) for j in range(3)]
            for link, k in self.work.link_columns.items()
        }
        frames: dict[str, Frame] = {
            name: frame_at(*at[name]) if name in at else frame for name, frame in self.start.frames.items()
        }
        own = {
            name: tuple(Jet(*(order[:, k] for order in orders)) for k in range(part.start, part.stop))
            for name, part in self.work.own_slices.items()
        }
        inputs = {}
        for given in self.mechanism.inputs:
            pair = self.work.relative_motions[given.pair]
            inputs[given.pair] = InputMotion(*pair.input_position_at(self.work.shapes, frames, own).parts[:3])
        motion = Motion(
            mechanism=self.mechanism,
            inputs=inputs,
            outcome=Outcome.SOLVED,
            reason="",
            residual=0.0,
            remarks=(*self.start.remarks, *self._freedom_remark()),
            frames=frames,
            own=own,
            shapes=self.start.shapes,
            time=time,
        )
        u = np.array([each.position for each in inputs.values()]).reshape(len(inputs), len(time))
        still = {name: [each.parts[0] for each in values] for name, values in own.items()}
        gaps = PositionSolver(self.mechanism).residual_check.residuals(
            KinematicArrays(motion, self.work.shapes).frames, still, u
        )
        return replace(motion, residual=float(np.max(gaps, initial=0.0)))
