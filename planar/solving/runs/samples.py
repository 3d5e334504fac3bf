"""Positions of a run made into a Motion with its rates, once they have passed the residual and the branch check."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from planar.equations.acceptance import InputSamples
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.model.mechanism import Drive, replace_inputs
from planar.model.wording import count_phrase
from planar.results.motion import Motion
from planar.results.records import InputMotion, Limit, ThirdRates
from planar.solving.checks.residual_check import CONTACT_TOLERANCE, MAX_RATE_ERROR, stack_motion
from planar.solving.continuation.events import change_point_remarks
from planar.solving.continuation.run_samples import InputRates, RunSamples
from planar.solving.diagnosis import refusals
from planar.solving.position import PositionSolver
from planar.solving.prepared_mechanism import lazy_frames
from planar.solving.rates.sample_rates import AccuracyDoubts, sample_rates


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
    names = [driven.pair for driven in solver.mechanism.inputs]
    frames, coordinates = lazy_frames(solver, parts[:3])
    return Motion(
        mechanism=solver.mechanism,
        inputs=dict(zip(names, _input_motions(solver, run.inputs), strict=True)),
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


CheckedRates = tuple[list[Array], float, tuple[str, ...]]
"""Rows on the general path: w with its rates (rows, coordinates) of each order, what the worst constraint leaves open,
and what there is to say."""


def _rates_at_dead_points(solver: PositionSolver, run: RunSamples) -> CheckedRates | None:
    """Rows that are all dead points, which have no rates, by the acceptance test; None where it does not tell."""
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
    """What is said of the first row without rates that is no dead point: what would be said of it by itself."""
    missing = np.setdiff1d(np.flatnonzero(np.isnan(w1).any(axis=1)), run.dead_points)
    if not missing.size:
        return ()
    row = missing[0]
    drives = tuple(
        Drive(driven.pair, float(position) * (solver.unit if solver.is_sliding(driven.pair) else 1.0))
        for driven, position in zip(solver.mechanism.inputs, run.inputs.u[row], strict=True)
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
    lost, remarks = doubt.errors.is_too_inexact, []
    if lost.any():
        worst = int(np.argmax(np.where(lost, np.nan_to_num(doubt.errors.greatest, nan=np.inf), 0.0)))
        places = ~(doubt.errors.position <= MAX_RATE_ERROR)
        inexact_rows = doubt.rows[lost]
        rows_with_rates = int((~np.isnan(parts[1]).any(axis=1)).sum())
        if places.any() or (len(inexact_rows) == rows_with_rates and not is_part):
            k = int(np.argmax(places)) if places.any() else worst
            raise doubt.refusal(solver, k, f"at {solver.describe_inputs(inputs.u[doubt.rows[k]])}")
        for part in parts[1:]:
            part[inexact_rows] = np.nan
        reason = doubt.refusal(solver, worst, f"at {solver.describe_inputs(inputs.u[doubt.rows[worst]])}").reason
        remarks.append(f"{count_phrase(len(inexact_rows), 'row')} without rates: {reason}")
    exact = np.flatnonzero(~lost)
    if exact.size:
        row = doubt.rows[exact[np.argmax(doubt.errors.greatest[exact])]]
        remarks.append(doubt.remark(f" at {solver.describe_inputs(inputs.u[row])}"))
    return tuple(remarks)


def _input_motions(solver: PositionSolver, inputs: InputRates) -> list[InputMotion]:
    """The inputs over a run (rad or m)."""
    sizes = [solver.unit if slides else 1.0 for slides in solver.structure.input_slides]
    return [InputMotion(*(rate[:, k] * size for rate in inputs[:3])) for k, size in enumerate(sizes)]
