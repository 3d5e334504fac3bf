"""A mechanism let go: its motion in time under loads, weights and springs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from numbers import Real
from typing import Any

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.dynamics.equations_of_motion import FULL_RANK_REGULARITY, EquationsOfMotion
from planar.dynamics.friction.determined_friction import check_determined_friction
from planar.dynamics.imbalance import explain_loose_links
from planar.dynamics.in_time.contact_phases import ContactEvent, make_phases
from planar.dynamics.in_time.freedom_remark import freedom_remarks
from planar.dynamics.in_time.friction_record import FrictionEvent, RubbingPair
from planar.dynamics.in_time.oscillations import Oscillation, OscillationRecorder
from planar.dynamics.in_time.simulated_motion import simulated_motion
from planar.dynamics.in_time.stop_contacts import Impact
from planar.dynamics.lagrangian import lagrangian_functions
from planar.dynamics.load_validation import check_loads
from planar.dynamics.load_variation import first_kink
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import report_progress, returns_part_in_time, time_is_over
from planar.model.mechanism import Input, Mechanism
from planar.model.run_arguments import check_steps
from planar.model.wording import join_all_names
from planar.results.motion import Motion, State
from planar.solving.position import PositionSolver, solve, solved_mechanism

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
LEAST_STICKING_STEPS = 100
"""Steps of a whole motion at which it is seen whether what sticks is released."""
ProgressCallback = Callable[[float], None]
"""Told how much of the time is done, from 0 to 1."""


@dataclass(frozen=True, eq=False)
class Simulation:
    """A motion in time, and its energies at every row (n,), J.

    `work` is what loads, dampers and driven inputs have put in since the start, and `lost` what impacts on stops have
    taken, and `heat` what friction has, so that kinetic + potential - work + lost + heat stays what it was: `balance`
    is how far it does not, of the greatest of these. `impacts` are those on stops, in their order. `rubbing` has by
    pair what sticks and slips at every row, with its own heat, and `friction_events` when that changed. `oscillations`
    has the released inputs that turn back, with the times of it and the period.
    """

    motion: Motion
    kinetic: Array
    potential: Array
    work: Array
    lost: Array
    driven: tuple[str, ...]
    impacts: tuple[Impact, ...] = ()
    rubbing: Mapping[str, RubbingPair] = field(default_factory=dict)
    friction_events: tuple[FrictionEvent, ...] = ()
    oscillations: Mapping[str, Oscillation] = field(default_factory=dict)

    __repr__ = short_repr

    @property
    def heat(self) -> Array:
        """What friction has taken since the start, at every row (n,), J."""
        return sum((each.heat for each in self.rubbing.values()), np.zeros(len(self.kinetic)))

    @property
    def balance(self) -> float:
        """How well energy is kept: the greatest change of what should not change, beside what goes to and fro.

        Where nothing goes to and fro, beside the greatest of the energies.
        """
        parts = (self.kinetic, self.potential, self.work, self.lost, self.heat)
        whole = self.kinetic + self.potential - self.work + self.lost + self.heat
        swing = max(float(np.ptp(each)) for each in parts)
        most = max(float(np.abs(each).max()) for each in parts)
        beside = swing if swing > CONSTANT_ENERGY_TOLERANCE * most else most
        return float(np.ptp(whole)) / beside if beside else 0.0


@takes_mechanism
@returns_part_in_time
def simulate(
    mechanism: Mechanism,
    duration: float,
    steps: int = 360,
    driven: Sequence[str] = (),
    *,
    moving: bool = False,
    tick: ProgressCallback | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Simulation:
    """The motion of a mechanism that is let go at the file's position, for a duration (s), in so many steps.

    An input that has a motor runs by it: by what that supplies at the input's speed. Of the others those that have a
    law keep to it, and the rest only say where the motion starts; `driven` names inputs that are to keep to their laws,
    or to the file's velocity and acceleration. Where there are fewer inputs than freedoms it starts as it is drawn, and
    a remark says at which pairs. From rest, or `moving` with the file's velocities.
    Accelerations come from masses, loads, weights, springs and dampers; they are integrated by the method of order 8 of
    Dormand and Prince (E. Hairer, S. P. Norsett, G. Wanner, Solving Ordinary Differential Equations I, 1993, II.5), and
    after every step the position is brought back onto the constraints. A pair that meets its stop strikes it, with the
    restitution of the file (I. Newton's law; an impulse over all links, through what joins them), and rests on it while
    it is pressed there. Pairs with friction stick and slip: what friction follows and the accelerations are found
    together, and sticking, slipping and turning back are events (J. P. Den Hartog; F. Pfeiffer, C. Glocker).

    A motion that cannot go on says so in its `outcome` and `reason`, as where friction leaves no solution or several,
    or after `timeout` s or a Ctrl-C.
    Raises BadInput for a duration or names that are none, and where what friction follows is not determined, NoAnswer
    where there is no position to start from, nothing can move, or something can move that has no mass.

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
            told = f"there is no input at {pair!r} to be driven; the inputs are at {', '.join(names)}"
            raise BadInput("driven", told)
    kept = [
        given.pair
        for given in mechanism.inputs
        if (given.law is not None and given.motor is None) or given.pair in driven
    ]
    check_loads(mechanism)
    PositionSolver(mechanism).refuse_misfit("a motion that is let go is not told")
    mechanism = solved_mechanism(mechanism).completed_mechanism
    problem = solved_mechanism(mechanism).motion_refusal()
    if problem is not None and problem.outcome is Outcome.STRUCTURE and mechanism.inputs:
        raise problem
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
        check_determined_friction(start)
        self.work = lagrangian_functions(self.mechanism)
        q, q1, _ = (each[0] for each in self.work.coordinates(start))
        unit = mechanism_size(self.mechanism, self.work.shapes)
        self.phases = make_phases(
            self.work, self.driven, unit, self.work.initial_spring_turns(q, self.mechanism.springs), q
        )
        self.coordinate_count = len(q)
        q, q1 = self.equations.project(0.0, q, q1)
        self.initial_state = np.concatenate([q, q1, np.zeros(1 + len(self.phases.record.pairs))])
        self.is_firm = False
        "whether constraints are far from a change point"
        self.time = np.linspace(0.0, duration, steps + 1)
        released = [given.pair for given in self.mechanism.inputs if given.pair not in self.driven]
        self.oscillations = OscillationRecorder(self.work, released, duration)

    @property
    def equations(self) -> EquationsOfMotion:
        """Those of the phase in which it is."""
        return self.phases.equations

    def run(self, tick: ProgressCallback | None) -> Simulation:
        rows, outcome, reason = self._integrate(tick)
        time = self.time[: len(rows)]
        q, q1 = rows[:, : self.coordinate_count], rows[:, self.coordinate_count : 2 * self.coordinate_count]
        q2 = np.array([self._accelerations(*each) for each in zip(time, q, q1, strict=True)])
        base = self.phases.base
        energies = np.array([base.energies(*each) for each in zip(time, q, q1, strict=True)])
        is_held = base.rank == self.coordinate_count
        remarks = freedom_remarks(self.mechanism, self.driven) if is_held else ()
        made = simulated_motion(self.work, self.start, time, (q, q1, q2), tuple(remarks))
        motion, lost = replace(made, outcome=outcome, reason=reason), self.phases.lost_at(time)
        work, heats = rows[:, 2 * self.coordinate_count], rows[:, 2 * self.coordinate_count + 1 :]
        told = motion, energies[:, 0], energies[:, 1], work, lost, self.driven, tuple(self.phases.impacts)
        rubbing, events = self.phases.record.rubbing(time, heats), tuple(self.phases.record.events)
        return Simulation(*told, rubbing, events, self.oscillations.oscillations())

    def _accelerations(self, time: float, q: Array, q1: Array) -> Array:
        """Those of a row; not a number where nothing tells them."""
        if not self.phases.is_begun:
            return np.full(self.coordinate_count, np.nan)
        equations = self.phases.equations_at(time)
        equations.pieces = None
        try:
            pushed = equations.accelerations_at(time, q, q1)
        except NoAnswer:
            return np.full(self.coordinate_count, np.nan)
        return pushed.q2 if pushed.regularity > LEAST_REGULARITY else np.full(self.coordinate_count, np.nan)

    def _integrate(self, tick: ProgressCallback | None) -> tuple[Array, Outcome, str]:
        """The rows at all times that were reached, and why not all of them were."""
        self.phases.base.accelerations_at(0.0, *self._split_state(self.initial_state))
        try:
            self.initial_state = self.phases.respond(0.0, self.initial_state)
        except NoAnswer as driven_on:
            return self.initial_state[None], driven_on.outcome, _end_sentence(0.0, f": {driven_on.reason}")
        rows = [self.initial_state]
        if not np.all(np.isfinite(self.equations.accelerations_at(0.0, *self._split_state(self.initial_state)).q2)):
            why = self._explain_failure(0.0, self.initial_state)
            return np.array(rows), Outcome.BRANCH_LOST, _end_sentence(0.0, why)
        try:
            stopped = self._add_rows(rows, tick)
        except NoAnswer as ended:
            beyond = "" if ended.outcome is Outcome.INTERRUPTED else "beyond, "
            told = _end_sentence(float(self.time[len(rows) - 1]), f": {beyond}{ended.reason}")
            return np.array(rows), ended.outcome, told
        return np.array(rows), Outcome.BRANCH_LOST if stopped else Outcome.SOLVED, stopped

    def _add_rows(self, rows: list[Array], tick: ProgressCallback | None) -> str:
        """Add the rows after the first, as far as they can be told; why not all of them."""
        last = float(self.time[-1])
        self.oscillations.jump(0.0, self.initial_state)
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
            kink = None if failed or solver.status == "failed" else self._first_break(solver, before)
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
                self.oscillations.follow(before, (at, y), lambda: inner)  # noqa: B023 - it is called at once
                solver, good, tiny = self._integrator(at, y), [], 0
                continue
            at = solver.t if kink is None else kink[0]
            if len(rows) < len(self.time) and self.time[len(rows)] <= at:
                self._add_rows_until(rows, at, solver.dense_output())
            self.oscillations.follow(before, (at, y if kink is None else kink[1]), solver.dense_output)
            if kink is not None:
                ahead = solver.y if at == before[0] and kink[2] is None else None
                y = self.phases.respond(at, self._project(*kink[:2]), kink[2])
                y, good = self._project(at, y), [] if kink[2] is not None else good
                self._hold_pieces(at, y, ahead)
                self.oscillations.jump(at, y)
                solver = self._integrator(at, y, length)
            else:
                solver.y, solver.f = y, self._state_rate(solver.t, y)
            if firm > CHANGE_POINT_REGULARITY:
                good = [*good[-REMEMBERED_STEPS:], (at, y)]
            report_progress(at, last)
            if tick is not None:
                tick(at / last)
            if solver.status == "running" and time_is_over():
                raise NoAnswer(Outcome.INTERRUPTED, time_is_over())
        return ""

    def _hold_pieces(self, time: float, y: Array, ahead: Array | None = None) -> None:
        """Hold loads that vary on the pieces of their courses on which they are, going on towards a state ahead."""
        places = self.equations.course_places(time, *self._split_state(y))
        if ahead is not None:
            then = self.equations.course_places(time, *self._split_state(ahead))
            places = [(at, beyond - at) for (at, _), (beyond, _) in zip(places, then, strict=True)]
        self.equations.pieces = self.equations.course_pieces(places)

    def _first_break(self, solver: Any, before: tuple[float, Array]) -> tuple[float, Array, ContactEvent | None] | None:
        """Where in the last step something first happened that the next one has to start from: a load's kink, or a
        contact."""
        kink = self._first_kink(solver, before)
        contact = self.phases.first_event(before, (solver.t, solver.y), solver.dense_output)
        if contact is not None and (kink is None or contact.time <= kink[0]):
            at = contact.time
            return at, before[1] if at == before[0] else np.asarray(solver.dense_output()(at)), contact
        return None if kink is None else (*kink, None)

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
        q1 = self._split_state(y)[1]
        scale = np.concatenate([self.equations.scale, np.maximum(np.abs(q1), self.equations.scale)])
        return float(np.abs((back - y)[: len(scale)] / scale).max(initial=0.0))

    def _integrator(self, time: float, y: Array, step: float | None = None) -> Any:
        from scipy.integrate import DOP853  # slow to load, and only needed here

        last, n = float(self.time[-1]), self.coordinate_count
        scales = np.concatenate([self.equations.scale, self.equations.scale / last, np.ones(len(y) - 2 * n)])
        fastest = max(float(np.abs(self.initial_state[n : 2 * n] / self.equations.scale).max(initial=0.0)) * last, 1.0)
        scales[n : 2 * n] *= fastest
        scales[2 * n :] = max(
            float(np.abs(self.equations.energies(0.0, *self._split_state(self.initial_state))).max()), 1e-9
        )
        first = None if step is None or time >= last else min(step, last - time)
        options = {"rtol": RELATIVE_TOLERANCE, "atol": RELATIVE_TOLERANCE * scales}
        if self.phases.is_sticking:  # what is released between two steps and caught again is not seen
            options["max_step"] = min(self.time[1], last / LEAST_STICKING_STEPS)
        return DOP853(self._state_rate, time, y, last, first_step=first, **options)

    def _explain_failure(self, time: float, y: Array) -> str:
        loose = explain_loose_links(self.mechanism)
        if loose:
            return f": {loose}"
        pushed = self.equations.accelerations_at(time, *self._split_state(y))
        if pushed.regularity < CHANGE_POINT_REGULARITY:
            driven = f"a dead point of what is driven at {join_all_names(self.driven)}, or " if self.driven else ""
            return f", near {driven}a change point, where branches of the motion cross"
        if not np.all(np.isfinite(pushed.q2)):
            return (
                ", where two points between which a spring, damper or load acts coincide, so that it has no direction"
            )
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
        return y[: self.coordinate_count], y[self.coordinate_count : 2 * self.coordinate_count]

    def _state_rate(self, time: float, y: Array) -> Array:
        q, q1 = self._split_state(y)
        is_quick = self.is_firm or self.equations.is_sparse
        way = self.equations.regular_accelerations if is_quick else self.equations.accelerations_at
        found = way(time, q, q1)
        if not np.all(np.isfinite(found.q2)):
            raise FloatingPointError  # with no number the integrator would never end
        heat = found.heat if found.heat.size else np.zeros(len(y) - 2 * len(q) - 1)
        return np.concatenate([q1, found.q2, [found.power], heat])

    def _project(self, time: float, y: Array) -> Array:
        """The nearest position and rates that the constraints allow."""
        return np.concatenate([*self.equations.project(time, *self._split_state(y)), y[2 * self.coordinate_count :]])
