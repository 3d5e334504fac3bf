"""The general path: one design of a sweep, solved as a separate cycle."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from planar.batch.design_arrays import with_design_values
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.jets import value_and_rates
from planar.foundation.time_limit import time_is_over
from planar.model.link_shapes import PointName, PointPlacementError
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.results.records import PointMotion, stack_vectors, vector_and_rates
from planar.solving.cycle import cycle

Array = np.ndarray

OUTCOMES = tuple(Outcome)
"""What the integers of a status stand for: 0 is solved."""
GRID_TOLERANCE = 1e-9
"""rad or sizes by which a row may be off the grid."""


class SolvedDesign(NamedTuple):
    """One design: positions of the running input (rows,), the points (rows, 2 a point and order; m, s), the status of
    every row, the reason of its end (its text is the sentence), a remark on rates that are missing or of few digits,
    and the position of the input at the dead point or at the stop that ends it (rad, m; NaN without one)."""

    input: Array
    out: Array
    status: Array
    message: str | NoAnswer
    rate_remark: str = ""
    dead_point: float = np.nan
    stop_position: float = np.nan


class DesignQuestion(NamedTuple):
    """A design by its numbers, and the arguments of `solve_design`, or of `solve_timed_design` where it has a duration
    (s); its text says why the design ends."""

    mechanism: Mechanism
    values: Mapping[str, float]
    pair: str
    grid: Array | None
    steps: int
    range: tuple[float | None, float | None]
    duration: float | None = None

    def solve(self, points: tuple[PointName, ...], rates: bool) -> SolvedDesign:
        """See `solve_design`."""
        design = with_design_values(self.mechanism, self.values)
        if self.duration is not None:
            return solve_timed_design(design, self.duration, self.steps, points, rates)
        return solve_design(design, self.pair, self.grid, self.steps, self.range, points, rates)

    def __str__(self) -> str:
        return str(self.solve((), False).message)


def solve_design(
    mechanism: Mechanism,
    pair: str,
    grid: Array | None,
    steps: int,
    range_: tuple[float | None, float | None],
    points: tuple[PointName, ...],
    rates: bool,
) -> SolvedDesign:
    """Solve a design over a grid of positions (rows,) of its running input, or, without one, over its own range.

    `range_` is the start and the stop of the cycle. Does not raise NoAnswer: the status contains it.
    """

    def run() -> tuple[Motion, Array]:
        motion = cycle(mechanism, steps, *range_, pair)
        return motion, motion.inputs[pair].position

    return _solve(run, grid, steps, points, rates)


def solve_timed_design(
    mechanism: Mechanism, duration: float, steps: int, points: tuple[PointName, ...], rates: bool
) -> SolvedDesign:
    """Solve a design in time, all its inputs by their laws or rates: as `solve_design`, but `input` is the times (s),
    and no position of one input ends it."""

    def run() -> tuple[Motion, Array]:
        motion = cycle(mechanism, steps, duration=duration)
        assert motion.time is not None
        return motion, motion.time

    solved = _solve(run, np.linspace(0.0, duration, steps + 1), steps, points, rates)
    return solved._replace(dead_point=np.nan, stop_position=np.nan)


class GridMotion(NamedTuple):
    """The motion of one design (None where there is none), how many of its rows are on the grid, the status of every
    row, and the reason of its end."""

    motion: Motion | None
    many: int
    status: Array
    message: str | NoAnswer


def run_design(mechanism: Mechanism, pair: str, grid: Array) -> GridMotion:
    """The motion of a design over a grid of positions (rows,) of its running input. Does not raise NoAnswer."""

    def run() -> tuple[Motion, Array]:
        motion = cycle(mechanism, len(grid) - 1, float(grid[0]), float(grid[-1]), pair)
        return motion, motion.inputs[pair].position

    return _run_on_grid(run, grid, len(grid) - 1)[0]


def _run_on_grid(
    run: Callable[[], tuple[Motion, Array]], grid: Array | None, steps: int
) -> tuple[GridMotion, Array | None]:
    """Run a motion; return it with the number of rows that are on the grid (all without a grid), and the positions of
    its rows."""
    status = np.zeros(steps + 1, dtype=np.int8)
    reason = time_is_over()
    if reason:
        status[:] = OUTCOMES.index(Outcome.INTERRUPTED)
        return GridMotion(None, 0, status, reason), None
    try:
        motion, position = run()
    except NoAnswer as problem:
        status[:] = OUTCOMES.index(problem.outcome)
        return GridMotion(None, 0, status, problem.with_traceback(None)), None  # its sentence takes long to make
    except (BadInput, PointPlacementError) as problem:
        status[:] = OUTCOMES.index(Outcome.CANNOT_BE_ASSEMBLED)
        return GridMotion(None, 0, status, str(problem)), None
    row_count = min(len(position), steps + 1)
    if grid is not None:
        distance = np.abs(position[:row_count] - grid[:row_count])
        is_off = distance > GRID_TOLERANCE * max(1.0, float(np.max(np.abs(grid))))
        row_count = int(np.argmax(is_off)) if is_off.any() else row_count
    status[row_count:] = OUTCOMES.index(motion.outcome)
    return GridMotion(motion, row_count, status, motion.reason if row_count <= steps else ""), position


def _solve(
    run: Callable[[], tuple[Motion, Array]],
    grid: Array | None,
    steps: int,
    points: tuple[PointName, ...],
    rates: bool,
) -> SolvedDesign:
    """The rows of a motion on a grid (rows,), or on its own; `run` returns the motion, and the positions of its
    rows."""
    out = np.full((steps + 1, 2 * len(points) * (3 if rates else 1)), np.nan)
    input_ = np.full(steps + 1, np.nan) if grid is None else grid
    (motion, row_count, status, message), position = _run_on_grid(run, grid, steps)
    if motion is None or position is None:
        return SolvedDesign(input_, out, status, message)
    if grid is None:
        input_[: len(position)] = position[: steps + 1]
    out[:row_count] = point_rows(motion, points, rates)[:row_count]
    remark = "; ".join(motion.rate_remarks) if rates else ""
    last = float(position[-1]) if row_count <= steps else np.nan
    ends = (last if motion.outcome is outcome else np.nan for outcome in (Outcome.DEAD_POINT, Outcome.STOP))
    return SolvedDesign(input_, out, status, message, remark, *ends)


def link_angles(motion: Motion, links: tuple[str, ...]) -> Array:
    """The angles of links (links, rows) over a motion, counting turns."""
    return np.array([np.broadcast_to(value_and_rates(motion.frames[link].angle)[0], len(motion)) for link in links])


def point_rows(motion: Motion, points: tuple[PointName, ...], rates: bool) -> Array:
    """x and y of points (rows, 2 a point and order) over a motion."""
    motions = [_point_motion(motion, name) for name in points]
    orders = ("position", "velocity", "acceleration") if rates else ("position",)
    if not motions:
        return np.zeros((len(motion), 0))
    return np.hstack([getattr(point, order) for order in orders for point in motions])


def _point_motion(motion: Motion, name: PointName) -> PointMotion:
    if isinstance(name, str):
        return motion.point(name)
    orders = vector_and_rates(motion.frames[name.link].to_world(name.at))[:3]
    return PointMotion(*(np.broadcast_to(stack_vectors(*order), (len(motion), 2)) for order in orders))
