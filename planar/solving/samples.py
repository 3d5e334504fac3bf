"""Runs made into motions: the rates at their rows, which have passed both checks, and motions at places between."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from planar.equations.acceptance import InputSamples
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer
from planar.foundation.jets import Jet, value_and_rates
from planar.model.mechanism import Drive, Input, replace_inputs
from planar.model.wording import count_phrase
from planar.results.kinematic_result import KinematicResult
from planar.results.motion import Motion
from planar.results.records import InputMotion, Limit, ThirdRates
from planar.solving.checks import CONTACT_TOLERANCE, MAX_RATE_ERROR, stack_motion
from planar.solving.continuation.events import change_point_remarks
from planar.solving.continuation.fast_path import InputRates, RunSamples, join_runs
from planar.solving.continuation.path import follow_samples
from planar.solving.diagnosis import refusals
from planar.solving.position import PositionSolver, solved_mechanism
from planar.solving.prepared_mechanism import lazy_frames
from planar.solving.sample_rates import AccuracyDoubts, sample_rates

CheckedRates = tuple[list[Array], float, tuple[str, ...]]
"""Rows on the general path: w with its rates (rows, coordinates) of each order, what the worst constraint leaves open,
and what there is to say."""
PLACE_TOLERANCE = 1e-12
"""Of a run: places nearer to each other are one."""
MAX_ROOT_STEPS = 60
LONGEST_GAP = 16.0
"""Steps of a run: places that are farther apart are not followed from one to the other."""


@dataclass(eq=False)
class RunCourse:
    """The path of a run; see `FollowedPath`."""

    unknowns: Array
    singular_rows: frozenset[int]
    fork_positions: tuple[float, ...]
    find_limits: Callable[[Motion], tuple[Limit, ...]]

    def limits(self, motion: Motion) -> tuple[Limit, ...]:
        """See `Motion.limits`."""
        return self.find_limits(motion)


def build_motion(
    solver: PositionSolver,
    assembly_remarks: tuple[str, ...],
    run: RunSamples,
    with_jerk: bool = False,
    time: Array | None = None,
    find_limits: Callable[[Motion], tuple[Limit, ...]] | None = None,
    fork_positions: tuple[float, ...] = (),
) -> Motion:
    """The motion, with what there is to say of its assembly; raises NoAnswer where the gate does not let it pass.

    Without `find_limits` its rows are positions side by side, of no path.
    """
    if solver.equations.open_rows:
        run = _rows_within_misfit(solver, run)
        time = time if time is None else time[: len(run.z)]
    unsure = np.arange(len(run.z)) if with_jerk else np.flatnonzero(~run.is_sure)
    parts, residual = list(run.coordinate_rates.transpose(1, 0, 2)), run.residual
    remarks: tuple[str, ...] = ()
    if unsure.size:
        rest, is_part = run.select(unsure), unsure.size < len(run.z)
        checked = None if with_jerk else _rates_at_dead_points(solver, rest)
        examined, residual, remarks = checked or _checked_rates(solver, rest, with_jerk, is_part)
        if is_part:
            parts, residual = [part.copy() for part in parts], max(residual, run.residual)
            for part, rates in zip(parts, examined, strict=True):
                part[unsure] = rates
        else:
            parts = examined
    course = None
    if find_limits is not None:
        course = RunCourse(run.z, frozenset(run.branch_rates), fork_positions, find_limits)
    input_rates = [(rate * solver.input_scale).T for rate in run.inputs[:3]]
    input_motions = (InputMotion(*rates) for rates in zip(*input_rates, strict=True))
    frames, coordinates = lazy_frames(solver, parts[:3])
    return Motion(
        mechanism=solver.mechanism,
        inputs={driven.pair: rates for driven, rates in zip(solver.mechanism.inputs, input_motions, strict=True)},
        outcome=run.outcome,
        reason=run.reason or (run.stopped.reason if run.stopped is not None else ""),
        residual=residual,
        remarks=(*assembly_remarks, *change_point_remarks(solver, run.passed, run.nearby), *remarks),
        frames=frames,
        own=coordinates,
        shapes=solver.shapes,
        time=time,
        jerked=ThirdRates(*lazy_frames(solver, parts)) if with_jerk else None,
        course=course,
        rate_remarks=remarks,
    )


def _rows_within_misfit(solver: PositionSolver, run: RunSamples) -> RunSamples:
    """The rows up to where a pair is open by more than may be. Raises NoAnswer where that is the first."""
    from planar.solving.assembly.least_misfit import misfit_refusal  # few mechanisms have one

    misfits = np.max([*solver.pair_misfits(run.z, run.inputs.u).values()], axis=0)
    passed = (misfits <= (solver.mechanism.closes_within or 0.0)) & solver.is_least_misfit(run.z, run.inputs.u)
    beyond = np.flatnonzero(~passed)
    if not beyond.size:
        return run
    refusal = misfit_refusal(solver, run.z[beyond[0]], run.inputs.u[beyond[0]])
    assert refusal is not None
    if not beyond[0]:
        raise refusal
    return run.select(np.arange(beyond[0]))._replace(stopped=refusal, reason="")


def _rates_at_dead_points(solver: PositionSolver, run: RunSamples) -> CheckedRates | None:
    """Rows that are all dead points, which have no rates, by the acceptance test; None where it does not decide."""
    if solver.acceptance is None or len(run.dead_points) < len(run.z):
        return None
    w: Array = np.full((3, len(run.z), len(solver.scale)), np.nan)
    residual = 0.0
    for row, (z, *inputs) in enumerate(zip(run.z, *run.inputs[:3], strict=True)):
        coordinate_rates, result = solver.acceptance.position(z, InputSamples(*inputs), solver.acceptance_scales)
        w[0, row], residual = coordinate_rates[0], max(residual, result.residual)
        if not (result.residual <= solver.tolerance and result.contact_gap <= CONTACT_TOLERANCE):
            return None
    return [*w], residual, ()


def _checked_rates(solver: PositionSolver, run: RunSamples, with_jerk: bool, is_part: bool) -> CheckedRates:
    """Rows by the general path; rates that cannot be believed are not numbers, unless none can: then NoAnswer. The rows
    may be a part of a run whose other rows have rates."""
    z, inputs = run.z, run.inputs
    gaps = solver.residuals(z, inputs.u)
    residual = float(gaps.max(initial=0.0))
    if not residual <= solver.tolerance:
        open_row, worst = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        raise refusals.not_closed(
            solver, solver.row_pairs[open_row], residual, f"at {solver.describe_inputs(inputs.u[worst])}"
        )
    parts, doubt = sample_rates(solver, z, inputs, run.branch_rates, with_jerk)
    remarks = _undetermined_remark(solver, run, parts[1])
    for part in parts[1:]:
        # where the input turns back, no velocity of the rest goes with one of the input
        part[list(run.dead_points)] = np.nan
    if doubt is not None:
        remarks += _remove_inexact_rates(solver, inputs, parts, doubt, is_part)
    motion = stack_motion(parts[:3], inputs[:3])
    determined = ~np.isnan(parts[1]).any(axis=1) if parts[1].size else np.ones(len(z), dtype=bool)
    gaps_of_rates = solver.structure.residual_check.rate_residuals(motion, solver.inputs.p)
    for (broken, pair), what in zip(gaps_of_rates, ("velocities", "accelerations"), strict=True):
        of_rows = np.where(determined, broken, 0.0)
        wrong = of_rows > 1e3 * solver.tolerance
        if not wrong.any():
            continue
        row = int(np.argmax(of_rows))
        place = f"at {solver.describe_inputs(inputs.u[row])}"
        if wrong[determined].all() and not is_part:
            raise refusals.broken_rates(solver, what, pair, float(of_rows[row]), place)
        for part in parts[1:]:
            part[wrong] = np.nan
        remarks = (*remarks, f"{place} no rates are given: they would break pair {pair!r}, next to a change point")
        determined &= ~wrong
    solver.refuse_open_contact(motion)
    return parts, residual, remarks


def _undetermined_remark(solver: PositionSolver, run: RunSamples, w1: Array) -> tuple[str, ...]:
    """Why the first row without rates that is no dead point has none, as `solve` would say of that position."""
    missing = np.setdiff1d(np.flatnonzero(np.isnan(w1).any(axis=1)), run.dead_points)
    if not missing.size:
        return ()
    row = missing[0]
    positions = run.inputs.u[row] * solver.input_scale
    drives = tuple(
        Drive(driven.pair, float(position)) for driven, position in zip(solver.mechanism.inputs, positions, strict=True)
    )
    try:
        solver.with_inputs_of(replace_inputs(solver.mechanism, drives)).state(run.z[row])
    except NoAnswer as problem:
        return (f"{count_phrase(len(missing), 'row')} without rates: {problem.reason}",)
    return ()


def _remove_inexact_rates(
    solver: PositionSolver, inputs: InputRates, parts: list[Array], doubt: AccuracyDoubts, is_part: bool
) -> tuple[str, ...]:
    """What to say of rows of which rounding leaves few digits; the rates of those with too few taken away.

    Raises NoAnswer where the places are lost too, or the rates of all rows.
    """
    lost, remarks = doubt.is_too_inexact, []
    if lost.any():
        worst = int(np.argmax(np.where(lost, np.nan_to_num(doubt.greatest, nan=np.inf), 0.0)))
        places = ~(doubt.position <= MAX_RATE_ERROR)
        inexact_rows = doubt.rows[lost]
        rows_with_rates = int((~np.isnan(parts[1]).any(axis=1)).sum())
        if places.any() or (len(inexact_rows) == rows_with_rates and not is_part):
            k = int(np.argmax(places)) if places.any() else worst
            raise doubt.refusal(solver, k, f"at {solver.describe_inputs(inputs.u[doubt.rows[k]])}")
        for part in parts[1:]:
            part[inexact_rows] = np.nan
        reason = doubt.refusal(solver, worst, f"at {solver.describe_inputs(inputs.u[doubt.rows[worst]])}").reason
        remarks.append(f"{count_phrase(len(inexact_rows), 'row')} without rates: {reason}")
    return (*remarks, *doubt.remarks(lambda row: f" at {solver.describe_inputs(inputs.u[row])}"))


class ContinuousRun:
    """A run of positions, made continuous.

    A place is the time (s) of a run in time, else how far the running input has gone since the first row (rad or m).
    The run keeps the branch of its rows. A simulated motion follows no law of its inputs and is not continuous.
    """

    def __init__(self, motion: Motion):
        self.motion = motion
        self.name = motion.running_input
        self.known = solved_mechanism(motion.mechanism)
        self.solver = self.known.solver
        position = motion.inputs[self.name].position
        steps = np.diff(position)
        self.rows: Array = (
            np.concatenate([[0.0], np.cumsum(np.abs(steps))]) if motion.time is None else np.asarray(motion.time)
        )
        self.turning_rows: IntArray = np.flatnonzero(steps[1:] * steps[:-1] < 0.0) + 1
        course = motion.course
        unknowns = None if course is None else course.unknowns
        self.z = run_unknowns(self.solver, motion) if unknowns is None else unknowns[: len(motion)]
        singular = [] if course is None else [row for row in course.singular_rows if row < len(motion)]
        has_rates = rows_with_rates(motion)
        self.is_regular = bool(has_rates.all()) and self.high > self.low
        "whether every row has rates, so that no dead point or unsolved row is between"
        self._is_sound: BoolArray = has_rates.copy()
        self._is_sound[singular] = False
        forks = () if course is None or motion.time is not None else course.fork_positions
        self.forks = self._places_of_positions(forks)
        self._seams: Array = np.sort(np.concatenate([self.forks, self.rows[~has_rates]]))
        "where the path does not go on smoothly"

    @property
    def low(self) -> float:
        """The first place."""
        return float(self.rows[0])

    @property
    def high(self) -> float:
        """The last place."""
        return float(self.rows[-1])

    def positions(self, places: Array) -> Array:
        """The position of the running input at places (n,), rad or m."""
        return self._input_rates(np.asarray(places)).u[:, self._running] * self.solver.input_scale[self._running]

    def motion_at(self, places: Array) -> Motion:
        """The motion at places (n,), in their order. Raises NoAnswer where the branch cannot be followed."""
        places = np.asarray(places, dtype=float)
        order = np.argsort(places, kind="stable")
        back = np.argsort(order, kind="stable")
        targets = places[order]
        run = join_runs([self._follow(part) for part in self._divided(targets) if len(part)]).select(back)
        run = run._replace(inputs=self._input_rates(places), passed=(), nearby=())
        time = None if self.motion.time is None else places
        forks = () if self.motion.course is None else self.motion.course.fork_positions
        motion = build_motion(self.solver, self.known.remarks, run, False, time, self._limits, forks)
        if len(motion) < len(places):  # a pair that may stay open does so by too much
            raise NoAnswer(motion.outcome, motion.reason)
        return motion

    def _limits(self, motion: Motion) -> tuple[Limit, ...]:
        return () if self.motion.course is None else self.motion.course.limits(self.motion)

    def breaks(self) -> Array:
        """Places inside the run at which the file says that something may bend or jump, and forks of the path."""
        places = [*self.forks.tolist(), *self.rows[self.turning_rows].tolist()]
        if self.motion.time is not None:
            for driven in self.motion.mechanism.inputs:
                places += [] if driven.law is None else driven.law.joint_times
        for pair in self.motion.mechanism.pairs:
            ends = pair.piece_ends(self.motion.shapes)
            if ends is not None:
                link, carrier = ends.link, ends.carrier

                def angle(motion: Motion, link: str = link, carrier: str = carrier) -> Array:
                    angles = (value_and_rates(motion.frames[name].angle)[0] for name in (link, carrier))
                    return np.broadcast_to(np.subtract(*angles), (len(motion),))

                places += self.crossings(angle, ends.angles, 2.0 * np.pi).tolist()
        return self.distinct(places)

    def input_crossings(self, name: str, levels: Iterable[float], period: float = 0.0) -> Array:
        """The places at which an input passes one of its positions, or one whole periods (rad) away."""
        if self.motion.time is None and name == self.name:
            position = self.motion.inputs[name].position
            low, high = float(np.min(position)), float(np.max(position))
            return self._places_of_positions(
                [target for level in levels for target in _repeated(level, period, low, high)]
            )
        return self.crossings(lambda motion: motion.inputs[name].position, levels, period)

    def speed_crossings(self, name: str, speeds: Iterable[float]) -> Array:
        """The places at which an input passes one of these speeds."""
        return self.crossings(lambda motion: motion.inputs[name].velocity, speeds)

    def crossings(self, signal: Callable[[Motion], Array], levels: Iterable[float], period: float = 0.0) -> Array:
        """The places at which a signal (n,) of a motion passes a level, or one whole periods away; each to round-off.

        A level that is passed twice between two rows is not seen.
        """
        values = np.asarray(signal(self.motion), dtype=float)
        brackets: list[tuple[float, float, float, float, float]] = []
        for level in levels:
            for target in _repeated(level, period, float(np.nanmin(values)), float(np.nanmax(values))):
                gap = values - target
                for k in np.flatnonzero((gap[1:] * gap[:-1] <= 0.0) & (gap[1:] != gap[:-1])):
                    brackets.append((self.rows[k], self.rows[k + 1], gap[k], gap[k + 1], target))
        if not brackets:
            return np.zeros(0)
        a, b, fa, fb, target = np.array(brackets).T
        return self.distinct(self.roots(signal, (a, b), (fa, fb), target))

    def distinct(self, places: Iterable[float]) -> Array:
        """Places inside the run in their order, those that differ by rounding once."""
        room = PLACE_TOLERANCE * (self.high - self.low)
        inside = np.sort([place for place in places if self.low + room < place < self.high - room])
        return inside[np.diff(inside, prepend=-np.inf) > room] if len(inside) else inside

    def roots(
        self, signal: Callable[[Motion], Array], ends: tuple[Array, Array], values: tuple[Array, Array], target: Array
    ) -> Array:
        """Where a signal reaches its targets between two places at which its distances from them are known and differ
        in sign, all at once, by the method of `root_finding.find_root`."""
        (b, a), (fb, fa) = (tuple(part.copy() for part in pair) for pair in (ends, values))
        room, part, is_open = 1e-15 * max(abs(self.low), abs(self.high)), np.full(len(a), 0.5), fa * fb < 0.0
        for _ in range(MAX_ROOT_STEPS):
            k = np.flatnonzero(is_open)
            if not k.size:
                break
            x = a[k] + part[k] * (b[k] - a[k])
            f = np.asarray(signal(self.motion_at(x)), dtype=float) - target[k]
            stays = f * fa[k] > 0.0
            c, fc = np.where(stays, a[k], b[k]), np.where(stays, fa[k], fb[k])
            b[k], fb[k] = np.where(stays, b[k], a[k]), np.where(stays, fb[k], fa[k])
            a[k], fa[k] = x, f
            with np.errstate(invalid="ignore", divide="ignore"):
                shortest_part = room / np.abs(b[k] - x)
                xi, phi = (x - b[k]) / (c - b[k]), (f - fb[k]) / (fc - fb[k])
                inner = f / (fb[k] - f) * fc / (fb[k] - fc) + (c - x) / (b[k] - x) * f / (fc - f) * fb[k] / (fc - fb[k])
            is_smooth = (phi**2 < xi) & ((1.0 - phi) ** 2 < 1.0 - xi)
            part[k] = np.minimum(np.maximum(np.where(is_smooth, inner, 0.5), shortest_part), 1.0 - shortest_part)
            is_open[k] = (f != 0.0) & (shortest_part <= 0.5)
        return np.where(np.abs(fa) < np.abs(fb), a, b)

    @property
    def _running(self) -> int:
        return list(self.motion.inputs).index(self.name)

    def _places_of_positions(self, positions: Iterable[float]) -> Array:
        """The places at which the running input of a range has positions, each as often as it comes there."""
        row_positions = self.motion.inputs[self.name].position
        places: list[float] = []
        for position in positions:
            gap = row_positions - position
            k = np.flatnonzero(gap[1:] * gap[:-1] <= 0.0)
            places += (self.rows[k] + np.abs(gap[k])).tolist()
        return self.distinct(places)

    def _input_rates(self, places: Array) -> InputRates:
        motion = self.motion
        if motion.time is not None:
            return timed_inputs(self.solver, places)
        k = np.clip(np.searchsorted(self.rows, places, side="right") - 1, 0, len(self.rows) - 2)
        along = np.where(np.isin(k, self.turning_rows), k + 1, k)  # a turning row has the rates of the way before it
        inputs = motion.inputs.values()
        u = np.array([driven.position[k] for driven in inputs])
        running = motion.inputs[self.name].position
        u[self._running] = running[k] + (places - self.rows[k]) * np.sign(running[k + 1] - running[k])
        u1, u2 = (
            np.array([getattr(driven, rate)[along] for driven in inputs]) for rate in ("velocity", "acceleration")
        )
        return InputRates(*(part.T / self.solver.input_scale for part in (u, u1, u2, np.zeros_like(u1))))

    def _divided(self, targets: Array) -> list[Array]:
        """Sorted places, divided where the path does not go on smoothly, and where no others are near."""
        spacing = (self.high - self.low) / (len(self.rows) - 1)
        gaps = np.flatnonzero(np.diff(targets) > LONGEST_GAP * spacing) + 1
        return np.split(targets, np.unique([*np.searchsorted(targets, self._seams), *gaps]).astype(int))

    def _follow(self, targets: Array) -> RunSamples:
        """The unknowns at sorted places, followed over the rows between them from the nearest sound row."""
        start = np.max(self._seams, initial=-np.inf, where=self._seams <= targets[0])
        stop = np.min(self._seams, initial=np.inf, where=self._seams >= targets[-1])
        usable = self._is_sound & (self.rows >= start) & (self.rows <= stop)
        usable = usable if usable.any() else self._is_sound
        base = int(np.argmin(np.where(usable, np.abs(self.rows - targets[0]), np.inf)))
        between = self.rows[(self.rows > targets[0]) & (self.rows < targets[-1])]
        places = np.sort(np.concatenate([targets, between]))
        rates = self._input_rates(np.concatenate([[self.rows[base]], places]))
        run = follow_samples(self.solver, self.z[base], rates)
        if run.stopped is not None:
            raise run.stopped
        return run.select(1 + np.searchsorted(places, targets))


def timed_inputs(solver: PositionSolver, time: Array) -> InputRates:
    """The inputs at times (s), each by its law, or at the file's velocity and acceleration."""
    parts = np.array([input_law_rates(driven, time) for driven in solver.mechanism.inputs])
    return InputRates(*(part.T / solver.input_scale for part in parts.transpose(1, 0, 2)))


def input_law_rates(driven: Input, time: Array) -> Array:
    """Position and first, second and third rate of an input (4, times)."""
    if driven.law is not None:
        return np.asarray(driven.law.evaluate(time, driven.position, driven.velocity))
    velocity = driven.velocity + driven.acceleration * time
    position = driven.position + driven.velocity * time + 0.5 * driven.acceleration * time**2
    return np.array([position, velocity, np.full_like(time, driven.acceleration), np.zeros_like(time)])


def _repeated(level: float, period: float, low: float, high: float) -> list[float]:
    """A level between two values, and all that are whole periods away."""
    if not period:
        return [level] if low <= level <= high else []
    first, last = np.ceil((low - level) / period - 1e-9), np.floor((high - level) / period + 1e-9)
    return [level + period * k for k in np.arange(first, last + 1.0).tolist()]


def moving_jets(moving: KinematicResult) -> list[Jet]:
    """x, y and angle of all moving links, then the coordinates of pairs."""
    jets = [jet for f in moving.frames.values() if not f.fixed for jet in (f.x, f.y, f.angle)]
    return jets + [jet for coordinates in moving.own.values() for jet in coordinates]


def rows_with_rates(motion: Motion) -> BoolArray:
    """Which rows have velocities and accelerations (n,)."""
    parts = [np.broadcast_to(part, len(motion)) for jet in moving_jets(motion) for part in jet.parts]
    if not parts:
        return np.ones(len(motion), dtype=bool)
    is_known: BoolArray = np.asarray(np.isfinite(parts).all(axis=0), dtype=bool)
    return is_known


def run_unknowns(solver: PositionSolver, motion: Motion) -> Array:
    """The unknowns at every row of a motion (rows, unknowns), from its frames."""
    w = solver.coordinates(motion.frames, motion.own)
    return np.broadcast_to(w, (len(motion), w.shape[-1]))[:, list(solver.equations.unknowns)]
