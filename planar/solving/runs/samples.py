"""Positions of a run made into a Motion with its rates, once they have passed the residual and the branch check."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from planar.equations.acceptance import InputSamples
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Drive, replace_inputs
from planar.model.wording import count_phrase
from planar.results.motion import FollowedPath, Motion
from planar.results.records import InputMotion, ThirdRates
from planar.solving.checks.residual_check import CONTACT_TOLERANCE, MAX_RATE_ERROR, stack_motion
from planar.solving.continuation.change_point_remarks import change_point_remarks
from planar.solving.continuation.fast_path import FastSamples, concatenate_samples
from planar.solving.continuation.path import FollowedSamples
from planar.solving.continuation.path_pieces import BranchRates, PathBifurcation
from planar.solving.continuation.predictor_corrector import NearbyBifurcation
from planar.solving.diagnosis import refusals
from planar.solving.position import PositionSolver
from planar.solving.prepared_mechanism import lazy_frames
from planar.solving.rates.accuracy import AccuracyDoubts
from planar.solving.rates.sample_rates import InputRates, sample_rates


class RunSamples(NamedTuple):
    """Unknowns at the rows of a run (rows, unknowns), inputs with their rates, the rows that are dead points, rates
    where the slope is singular, and what was met on the way."""

    z: Array
    inputs: InputRates
    dead_points: tuple[int, ...] = ()
    branch_rates: Mapping[int, BranchRates] = MappingProxyType({})
    passed: tuple[PathBifurcation, ...] = ()
    nearby: tuple[NearbyBifurcation, ...] = ()
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""
    fast_samples: FastSamples | None = None

    def select(self, some: IntArray) -> RunSamples:
        """Some of the rows, in their order, of which nothing is told."""
        where = {int(row): k for k, row in enumerate(some)}
        return self._replace(
            z=self.z[some],
            inputs=InputRates(*(each[some] for each in self.inputs)),
            dead_points=tuple(where[row % len(self.z)] for row in self.dead_points),
            branch_rates={where[row]: each for row, each in self.branch_rates.items()},
            fast_samples=None,
        )

    def with_problem(self, problem: NoAnswer | None) -> RunSamples:
        """The same rows, of a run that stopped."""
        return self if problem is None else self._replace(outcome=problem.outcome, reason=problem.reason)


def run_samples(found: FollowedSamples, given: InputRates, dead: tuple[int, ...] = ()) -> RunSamples:
    """The rows of a run that was followed in one piece."""
    part = InputRates(*(each[: len(found.z)] for each in given))
    return RunSamples(
        found.z, part, dead, found.branch_rates, found.passed, found.nearby, fast_samples=found.fast_samples
    )


def splice_runs(down: FollowedSamples, up: FollowedSamples) -> FollowedSamples:
    """Two runs from one position, which is no row, as one through it: the first backwards, then the second."""
    back = len(down.z) - 1
    local = {back - row: each for row, each in down.branch_rates.items() if row}
    local |= {back + row - 1: each for row, each in up.branch_rates.items() if row}
    return FollowedSamples(
        np.vstack([down.z[:0:-1], up.z[1:]]),
        down.general_count + up.general_count,
        up.stopped,
        up.last_position,
        local,
        (*down.passed[::-1], *up.passed),
        (*down.nearby, *up.nearby),
        concatenate_samples(
            down.fast_samples and down.fast_samples.cut(slice(None, 0, -1)),
            up.fast_samples and up.fast_samples.cut(slice(1, None)),
        ),
    )


def drop_first(found: FollowedSamples) -> FollowedSamples:
    """A run without its first position, which is no row."""
    local = {row - 1: each for row, each in found.branch_rates.items() if row}
    return found._replace(
        z=found.z[1:], branch_rates=local, fast_samples=found.fast_samples and found.fast_samples.cut(slice(1, None))
    )


def join_runs(first: RunSamples, second: RunSamples) -> RunSamples:
    """Two runs one after the other, the second of which starts in the last row of the first."""
    shift = len(first.z) - 1
    given = InputRates(*(np.vstack([a, b[1:]]) for a, b in zip(first.inputs, second.inputs, strict=True)))
    return first._replace(
        z=np.vstack([first.z, second.z[1:]]),
        inputs=given,
        dead_points=tuple(sorted({*first.dead_points, *(row + shift for row in second.dead_points)})),
        branch_rates={**first.branch_rates, **{row + shift: each for row, each in second.branch_rates.items() if row}},
        passed=(*first.passed, *second.passed),
        nearby=(*first.nearby, *second.nearby),
        outcome=second.outcome,
        reason=first.reason or second.reason,
        fast_samples=concatenate_samples(
            first.fast_samples, second.fast_samples and second.fast_samples.cut(slice(1, None))
        ),
    )


def reverse_run(run: RunSamples) -> RunSamples:
    """The same run backwards: velocities turn round, accelerations stay, as in a film run backwards."""
    last = len(run.z) - 1
    u, u1, u2, u3 = (each[::-1] for each in run.inputs)
    return run._replace(
        z=run.z[::-1],
        inputs=InputRates(u, -u1, u2, -u3),
        dead_points=tuple(sorted(last - row for row in run.dead_points)),
        branch_rates={last - row: each for row, each in run.branch_rates.items()},
        fast_samples=run.fast_samples and run.fast_samples.reversed(),
    )


def build_motion(
    solver: PositionSolver,
    assembly_remarks: tuple[str, ...],
    run: RunSamples,
    with_jerk: bool,
    course: FollowedPath | None,
    time: Array | None = None,
) -> Motion:
    """The motion, with what there is to say of its assembly; raises NoAnswer where the gate does not let it pass."""
    if solver.equations.open_rows:
        run = _rows_within_misfit(solver, run)
        time = time if time is None else time[: len(run.z)]
    told = run.fast_samples if not with_jerk else None
    remarks: tuple[str, ...] = ()
    if told is not None and told.is_sure.all():
        parts, residual = list(told.coordinate_rates.transpose(1, 0, 2)), told.residual
    elif told is not None:
        rest = np.flatnonzero(~told.is_sure)
        some = run.select(rest)
        looked_at, residual, remarks = _rates_at_dead_points(solver, some) or _checked_rates(
            solver, some, with_jerk, bool(told.is_sure.any())
        )
        whole = told.coordinate_rates.copy()
        whole[rest] = np.stack(looked_at, axis=1)
        parts, residual = list(whole.transpose(1, 0, 2)), max(residual, told.residual)
    else:
        parts, residual, remarks = _checked_rates(solver, run, with_jerk)
    inputs = {each.pair: _input_motion(solver, run.inputs, index) for index, each in enumerate(solver.mechanism.inputs)}
    frames, own = lazy_frames(solver, parts[:3])
    return Motion(
        mechanism=solver.mechanism,
        inputs=inputs,
        outcome=run.outcome,
        reason=run.reason,
        residual=residual,
        remarks=(*assembly_remarks, *change_point_remarks(solver, run.passed, run.nearby), *remarks),
        frames=frames,
        own=own,
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
    kept = np.arange(beyond[0])
    some = run._replace(
        dead_points=tuple(row for row in run.dead_points if row % len(run.z) < len(kept)),
        branch_rates={row: each for row, each in run.branch_rates.items() if row < len(kept)},
    )
    return some.select(kept).with_problem(refusal)


class _CheckedRates(NamedTuple):
    """Rows on the general path: w with its rates (rows, coordinates) of each order, what the worst constraint leaves
    open, and what there is to say."""

    coordinate_rates: list[Array]
    residual: float
    remarks: tuple[str, ...] = ()


def _rates_at_dead_points(solver: PositionSolver, run: RunSamples) -> _CheckedRates | None:
    """Rows that are all dead points, which have no rates, by the acceptance test; None where it does not tell."""
    if solver.acceptance is None or len(run.dead_points) < len(run.z):
        return None
    w: Array = np.full((3, len(run.z), len(solver.scale)), np.nan)
    residual = 0.0
    for row, (z, *given) in enumerate(zip(run.z, *run.inputs[:3], strict=True)):
        coordinate_rates, judged = solver.acceptance.position(z, InputSamples(*given), solver.acceptance_scales)
        w[0, row], residual = coordinate_rates[0], max(residual, judged.residual)
        if not (judged.residual <= solver.tolerance and judged.contact_gap <= CONTACT_TOLERANCE):
            return None
    return _CheckedRates([*w], residual)


def _checked_rates(solver: PositionSolver, run: RunSamples, with_jerk: bool, is_part: bool = False) -> _CheckedRates:
    """Rows by the general path; rates that cannot be believed are not numbers, unless none can: then NoAnswer. The rows
    may be a part of a run whose other rows have rates."""
    z, given = run.z, run.inputs
    gaps = solver.residuals(z, given.u)
    residual = float(gaps.max(initial=0.0))
    if not residual <= solver.tolerance:
        open_row, worst = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        raise refusals.not_closed(
            solver, solver.row_pairs[open_row], residual, f"at {solver.describe_inputs(given.u[worst])}"
        )
    parts, doubt = sample_rates(solver, z, given, run.branch_rates, with_jerk)
    remarks = _undetermined_remark(solver, run, parts[1])
    for part in parts[1:]:
        # where the input turns back, no velocity of the rest goes with one of the input
        part[list(run.dead_points)] = np.nan
    if doubt is not None:
        remarks += _remove_inexact_rates(solver, given, parts, doubt, is_part)
    motion = stack_motion(parts[:3], given[:3])
    determined = ~np.isnan(parts[1]).any(axis=1) if parts[1].size else np.ones(len(z), dtype=bool)
    gaps_of_rates = solver.structure.residual_check.rate_residuals(motion, solver.inputs.p)
    for (broken, pair), what in zip(gaps_of_rates, ("velocities", "accelerations"), strict=True):
        of_rows = np.where(determined, broken, 0.0)
        wrong = of_rows > 1e3 * solver.tolerance
        if not wrong.any():
            continue
        row = int(np.argmax(of_rows))
        at = f"at {solver.describe_inputs(given.u[row])}"
        if wrong[determined].all() and not is_part:
            raise refusals.broken_rates(solver, what, pair, float(of_rows[row]), at)
        for part in parts[1:]:
            part[wrong] = np.nan
        remarks = (*remarks, f"{at} no rates are given: they would break pair {pair!r}, next to a change point")
        determined &= ~wrong
    solver.refuse_open_contact(motion)
    return _CheckedRates(parts, residual, remarks)


def _undetermined_remark(solver: PositionSolver, run: RunSamples, w1: Array) -> tuple[str, ...]:
    """What is said of the first row without rates that is no dead point: what would be said of it by itself."""
    missing = np.setdiff1d(np.flatnonzero(np.isnan(w1).any(axis=1)), run.dead_points)
    if not missing.size:
        return ()
    row = missing[0]
    there = tuple(
        Drive(each.pair, float(at) * (solver.unit if solver.is_sliding(each.pair) else 1.0))
        for each, at in zip(solver.mechanism.inputs, run.inputs.u[row], strict=True)
    )
    try:
        solver.with_inputs_of(replace_inputs(solver.mechanism, there)).state(run.z[row])
    except NoAnswer as problem:
        return (f"{count_phrase(len(missing), 'row')} without rates: {problem.reason}",)
    return ()


def _remove_inexact_rates(
    solver: PositionSolver, given: InputRates, parts: list[Array], doubt: AccuracyDoubts, is_part: bool
) -> tuple[str, ...]:
    """What to say of rows of which rounding leaves few digits; the rates of those with too few taken away.

    Raises NoAnswer where the places are lost too, or the rates of all rows.
    """
    lost, remarks = doubt.errors.is_too_inexact, []
    if lost.any():
        worst = int(np.argmax(np.where(lost, np.nan_to_num(doubt.errors.greatest, nan=np.inf), 0.0)))
        places = ~(doubt.errors.position <= MAX_RATE_ERROR)
        some = doubt.rows[lost]
        rows_with_rates = int((~np.isnan(parts[1]).any(axis=1)).sum())
        if places.any() or (len(some) == rows_with_rates and not is_part):
            k = int(np.argmax(places)) if places.any() else worst
            raise doubt.refusal(solver, k, f"at {solver.describe_inputs(given.u[doubt.rows[k]])}")
        for part in parts[1:]:
            part[some] = np.nan
        told = doubt.refusal(solver, worst, f"at {solver.describe_inputs(given.u[doubt.rows[worst]])}").reason
        remarks.append(f"{count_phrase(len(some), 'row')} without rates: {told}")
    kept = np.flatnonzero(~lost)
    if kept.size:
        row = doubt.rows[kept[np.argmax(doubt.errors.greatest[kept])]]
        remarks.append(doubt.remark(f" at {solver.describe_inputs(given.u[row])}"))
    return tuple(remarks)


def _input_motion(solver: PositionSolver, given: InputRates, index: int) -> InputMotion:
    size = solver.unit if solver.is_sliding(solver.mechanism.inputs[index].pair) else 1.0
    return InputMotion(*(part[:, index] * size for part in given[:3]))
