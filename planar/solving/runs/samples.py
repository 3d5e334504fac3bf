"""Positions of a run as a motion with its rates, once both parts of the gate have let them pass."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.jets import Jet
from planar.model.wording import many
from planar.results.motion import Course, Motion
from planar.results.records import InputMotion, Jerked
from planar.solving.assembly.nearest_assembly import Assembly
from planar.solving.checks.residual_check import MOST_LOST
from planar.solving.continuation.change_point_remarks import on_the_way
from planar.solving.continuation.fast_path import Told, stacked
from planar.solving.continuation.path import Local, Met, Run
from planar.solving.continuation.predictor_corrector import Missed
from planar.solving.diagnosis import refusals
from planar.solving.lazy_frames import laid
from planar.solving.position import Solver
from planar.solving.rates.accuracy import Doubts
from planar.solving.rates.sample_rates import Given, rates

Array = np.ndarray


class Rows(NamedTuple):
    """Unknowns at the rows of a run (rows, unknowns), inputs with their rates, the rows that are dead points, rates
    where the slope is singular, and what was met on the way."""

    z: Array
    given: Given
    dead: tuple[int, ...] = ()
    local: Mapping[int, Local] = MappingProxyType({})
    met: tuple[Met, ...] = ()
    missed: tuple[Missed, ...] = ()
    outcome: Outcome = Outcome.SOLVED
    reason: str = ""
    told: Told | None = None

    def of(self, some: Array) -> Rows:
        """Some of the rows, in their order, of which nothing is told."""
        where = {int(row): k for k, row in enumerate(some)}
        return self._replace(
            z=self.z[some],
            given=Given(*(each[some] for each in self.given)),
            dead=tuple(where[row % len(self.z)] for row in self.dead),
            local={where[row]: each for row, each in self.local.items()},
            told=None,
        )

    def stopped(self, problem: NoAnswer | None) -> Rows:
        """The same rows, of a run that stopped."""
        return self if problem is None else self._replace(outcome=problem.outcome, reason=problem.reason)


def rows(found: Run, given: Given, dead: tuple[int, ...] = ()) -> Rows:
    """The rows of a run that was followed in one piece."""
    part = Given(*(each[: len(found.z)] for each in given))
    return Rows(found.z, part, dead, found.local, found.met, found.missed, told=found.told)


def spliced(down: Run, up: Run) -> Run:
    """Two runs from one position, which is no row, as one through it: the first backwards, then the second."""
    back = len(down.z) - 1
    local = {back - row: each for row, each in down.local.items() if row}
    local |= {back + row - 1: each for row, each in up.local.items() if row}
    return Run(
        np.vstack([down.z[:0:-1], up.z[1:]]),
        down.general + up.general,
        up.stopped,
        up.last,
        local,
        (*down.met[::-1], *up.met),
        (*down.missed, *up.missed),
        stacked(down.told and down.told.cut(slice(None, 0, -1)), up.told and up.told.cut(slice(1, None))),
    )


def shortened(found: Run) -> Run:
    """A run without its first position, which is no row."""
    local = {row - 1: each for row, each in found.local.items() if row}
    return found._replace(z=found.z[1:], local=local, told=found.told and found.told.cut(slice(1, None)))


def joined(first: Rows, second: Rows) -> Rows:
    """Two runs one after the other, the second of which starts in the last row of the first."""
    shift = len(first.z) - 1
    given = Given(*(np.vstack([a, b[1:]]) for a, b in zip(first.given, second.given, strict=True)))
    return first._replace(
        z=np.vstack([first.z, second.z[1:]]),
        given=given,
        dead=tuple(sorted({*first.dead, *(row + shift for row in second.dead)})),
        local={**first.local, **{row + shift: each for row, each in second.local.items() if row}},
        met=(*first.met, *second.met),
        missed=(*first.missed, *second.missed),
        outcome=second.outcome,
        reason=first.reason or second.reason,
        told=stacked(first.told, second.told and second.told.cut(slice(1, None))),
    )


def reversed_(run: Rows) -> Rows:
    """The same run backwards: velocities turn round, accelerations stay, as in a film run backwards."""
    last = len(run.z) - 1
    u, u1, u2, u3 = (each[::-1] for each in run.given)
    return run._replace(
        z=run.z[::-1],
        given=Given(u, -u1, u2, -u3),
        dead=tuple(sorted(last - row for row in run.dead)),
        local={last - row: each for row, each in run.local.items()},
        told=run.told and run.told.backwards(),
    )


def motion(
    solver: Solver, assembly: Assembly, run: Rows, third: bool, course: Course, time: Array | None = None
) -> Motion:
    """The motion; raises NoAnswer where the gate does not let it pass."""
    told, remarks = run.told if not third else None, ()
    if told is not None and told.sure.all():
        parts, residual = list(told.parts.transpose(1, 0, 2)), told.open
    elif told is not None:
        rest = np.flatnonzero(~told.sure)
        looked_at, residual, remarks = _looked_at(solver, run.of(rest), third)
        whole = told.parts.copy()
        whole[rest] = np.stack(looked_at, axis=1)
        parts, residual = list(whole.transpose(1, 0, 2)), max(residual, told.open)
    else:
        parts, residual, remarks = _looked_at(solver, run, third)
    inputs = {each.pair: _input(solver, run.given, index) for index, each in enumerate(solver.mechanism.inputs)}
    frames, own = laid(solver, parts[:3])
    return Motion(
        mechanism=solver.mechanism,
        inputs=inputs,
        outcome=run.outcome,
        reason=run.reason,
        residual=residual,
        remarks=(*solver.remarks(assembly), *on_the_way(solver, run.met, run.missed), *remarks),
        frames=frames,
        own=own,
        shapes=solver.shapes,
        time=time,
        jerked=Jerked(*laid(solver, parts)) if third else None,
        course=course,
    )


class _Looked(NamedTuple):
    """Rows on the general path: w with its rates (rows, coordinates) of each order, what the worst constraint leaves
    open, and what there is to say."""

    parts: list[Array]
    open: float
    remarks: tuple[str, ...] = ()


def _looked_at(solver: Solver, run: Rows, third: bool) -> _Looked:
    """Rows by the general path; rates that cannot be believed are not numbers, unless none can: then NoAnswer."""
    z, given = run.z, run.given
    gaps = solver.gaps(z, given.u)
    residual = float(gaps.max(initial=0.0))
    if not residual <= solver.tolerance:
        pair, row = np.unravel_index(int(np.argmax(gaps)), gaps.shape)
        raise refusals.not_closed(solver, solver.gate.names[pair], residual, f"at {solver.where(given.u[row])}")
    parts, doubt = rates(solver, z, given, run.local, third)
    for part in parts[1:]:
        # where the input turns back, no velocity of the rest goes with one of the input
        part[list(run.dead)] = np.nan
    remarks = _without(solver, given, parts, doubt) if doubt is not None else ()
    frames, own = laid(solver, parts[:3])
    determined = ~np.isnan(parts[1]).any(axis=1) if parts[1].size else np.ones(len(z), dtype=bool)
    inputs = [_input(solver, given, index) for index in range(len(solver.mechanism.inputs))]
    gaps_of_rates = solver.gate.rate_gaps(frames, own, [Jet(*each) for each in inputs])
    for (broken, pair), what in zip(gaps_of_rates, ("velocities", "accelerations"), strict=True):
        of_rows = np.where(determined, np.broadcast_to(broken, (len(z),)), 0.0)
        wrong = of_rows > 1e3 * solver.tolerance
        if not wrong.any():
            continue
        row = int(np.argmax(of_rows))
        at = f"at {solver.where(given.u[row])}"
        if wrong[determined].all():
            raise refusals.broken_rates(solver, what, pair, float(of_rows[row]), at)
        for part in parts[1:]:
            part[wrong] = np.nan
        remarks = (*remarks, f"{at} no rates are given: they would break pair {pair!r}, next to a change point")
        determined &= ~wrong
    solver.refuse_gap(frames, own)
    return _Looked(parts, residual, remarks)


def _without(solver: Solver, given: Given, parts: list[Array], doubt: Doubts) -> tuple[str, ...]:
    """What to say of rows of which rounding leaves few digits; the rates of those with too few taken away.

    Raises NoAnswer where the places are lost too, or the rates of all rows.
    """
    lost, remarks = doubt.errors.lost, []
    if lost.any():
        worst = int(np.argmax(np.where(lost, np.nan_to_num(doubt.errors.greatest, nan=np.inf), 0.0)))
        places = ~(doubt.errors.places <= MOST_LOST)
        some = doubt.rows[lost]
        if places.any() or len(some) == int((~np.isnan(parts[1]).any(axis=1)).sum()):
            k = int(np.argmax(places)) if places.any() else worst
            raise doubt.refused(solver, k, f"at {solver.where(given.u[doubt.rows[k]])}")
        for part in parts[1:]:
            part[some] = np.nan
        told = doubt.refused(solver, worst, f"at {solver.where(given.u[doubt.rows[worst]])}").reason
        remarks.append(f"{many(len(some), 'row')} without rates: {told}")
    kept = np.flatnonzero(~lost)
    if kept.size:
        row = doubt.rows[kept[np.argmax(doubt.errors.greatest[kept])]]
        remarks.append(doubt.remark(f" at {solver.where(given.u[row])}"))
    return tuple(remarks)


def _input(solver: Solver, given: Given, index: int) -> InputMotion:
    size = solver.unit if solver.slides(solver.mechanism.inputs[index].pair) else 1.0
    return InputMotion(*(part[:, index] * size for part in given[:3]))
