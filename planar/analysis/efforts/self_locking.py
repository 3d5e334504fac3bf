"""Where a mechanism locks itself, held by friction under its loads alone, and where friction jams its motion."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.document.first_argument import takes_result
from planar.dynamics.forces import forces
from planar.dynamics.friction.holding import holding
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.root_finding import find_root
from planar.foundation.short_repr import short_repr
from planar.results.motion import Motion, State

GOLDEN_SECTION, MAX_SECTIONS = 0.5 * (3.0 - np.sqrt(5.0)), 60


class LockedInterval(NamedTuple):
    """Positions of an input (rad or m) between which a mechanism locks itself, or friction jams it.

    Where an end is one of the motion, or a position at which nothing balances the links, as at a dead point, its
    `start_is_solved` or `stop_is_solved` is False: it is that position then, or the last one known before.
    """

    start: float
    stop: float
    start_is_solved: bool
    stop_is_solved: bool

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("Motion")
def self_locking(motion: Motion) -> tuple[LockedInterval, ...]:
    """Where the loads alone do not move a mechanism with friction: intervals of the input that runs, ends solved for.

    With the coefficients at rest, by `planar.holding`: no effort of the input is wanted. Between samples of the motion
    such an interval is found where its middle or an end of it shows among them. Raises what `holding` raises.

    >>> import planar
    >>> clamp = planar.cycle(planar.load("toggle-clamp"), 60)
    >>> [round(interval.stop - interval.start, 4) for interval in planar.self_locking(clamp)]
    [0.2221, 0.0742]
    """

    def margin(moving: State | Motion) -> Array:
        held = holding(moving)
        found: Array = np.minimum(np.asarray(held.high), -np.asarray(held.low))
        return found

    return _intervals(motion, margin, has_extremes=True)


@takes_result("Motion")
def jamming(motion: Motion) -> tuple[LockedInterval, ...]:
    """Where friction jams a motion: intervals of the input in which no forces balance it, ends found by bisection.

    In the sense of the file's velocity (forward where it is none), with inertia at that steady rate. Raises what
    `planar.forces` raises.

    >>> import planar
    >>> planar.jamming(planar.cycle(planar.load("toggle-clamp"), 60))
    ()
    """

    def margin(moving: State | Motion) -> Array:
        try:
            found = forces(moving)
        except NoAnswer as refused:
            return np.array(1.0 if refused.outcome is Outcome.INPUT_JAMMED else np.nan)
        if found.frictionless is None:
            return np.where(np.isfinite([np.asarray(each) for each in found.inputs.values()]).all(axis=0), -1.0, np.nan)
        sound = np.isfinite([np.asarray(each) for each in found.frictionless.inputs.values()]).all(axis=0)
        return np.where(sound, np.where(np.asarray(found.solution_count) == 0, 1.0, -1.0), np.nan)

    return _intervals(motion, margin, has_extremes=False)


def _intervals(
    motion: Motion, margin: Callable[[State | Motion], Array], has_extremes: bool
) -> tuple[LockedInterval, ...]:
    """Where a margin is not below zero over the input that runs; whether it may be so between samples as well."""
    run = InterpolatedRun(motion)

    def margin_at(position: float) -> float:
        try:
            return float(margin(run.state_at(position)))
        except NoAnswer:
            return np.nan

    positions, margins = run.tabulate(margin)
    if has_extremes:
        positions, margins = _with_extremes(positions, margins, margin_at)
    found: list[LockedInterval] = []
    start: tuple[float, bool] | None = None
    for k, (position, value) in enumerate(zip(positions.tolist(), margins.tolist(), strict=True)):
        before = margins[k - 1] if k else np.nan
        if value >= 0.0 and start is None:
            solved = k > 0 and bool(before < 0.0)
            start = (find_root(margin_at, positions[k - 1], position), True) if solved else (position, False)
        elif start is not None and not value >= 0.0:
            solved = bool(value < 0.0)
            stop = find_root(margin_at, positions[k - 1], position) if solved else float(positions[k - 1])
            found.append(LockedInterval(*_ends(start, (stop, solved))))
            start = None
    if start is not None:
        found.append(LockedInterval(*_ends(start, (float(positions[-1]), False))))
    return tuple(found)


def _ends(start: tuple[float, bool], stop: tuple[float, bool]) -> tuple[float, float, bool, bool]:
    return float(start[0]), float(stop[0]), start[1], stop[1]


def _with_extremes(positions: Array, margins: Array, margin_at: Callable[[float], float]) -> tuple[Array, Array]:
    """The samples with extremes between them at which the margin has the other sign."""
    more: list[tuple[float, float]] = []
    for k in range(1, len(positions) - 1):
        middle, sides = margins[k], (margins[k - 1], margins[k + 1])
        sense = 1.0 if middle < 0.0 else -1.0  # a negative margin may rise above zero, and the other way round
        if np.isfinite([middle, *sides]).all() and all(sense * (middle - side) >= 0.0 for side in sides):
            low, high = float(positions[k - 1]), float(positions[k + 1])
            for _ in range(MAX_SECTIONS):
                left, right = (low + part * (high - low) for part in (GOLDEN_SECTION, 1.0 - GOLDEN_SECTION))
                values = margin_at(left), margin_at(right)
                crossed = [(at, value) for at, value in zip((left, right), values, strict=True) if sense * value > 0.0]
                if crossed:
                    more.append(crossed[0])
                    break
                low, high = (low, right) if sense * (values[0] - values[1]) > 0.0 else (left, high)
    if not more:
        return positions, margins
    where = np.concatenate([positions, [each[0] for each in more]])
    order = np.argsort(where, kind="stable")
    return where[order], np.concatenate([margins, [each[1] for each in more]])[order]
