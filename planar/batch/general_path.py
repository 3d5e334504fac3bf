"""The general path: one design of a sweep, solved as a cycle of its own."""

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
    every row, what there is to say of its end (which as text is the sentence), and of rates that are missing or of few
    digits; where the input is at the dead point or at the stop that ends it (rad, m), not numbers where none does."""

    input: Array
    out: Array
    status: Array
    message: str | NoAnswer
    rate_remark: str = ""
    dead_point: float = np.nan
    stop_position: float = np.nan


class DesignQuestion(NamedTuple):
    """A design by its numbers, and the arguments of `solve_design`; as text the sentence that says why it ends."""

    mechanism: Mechanism
    values: Mapping[str, float]
    pair: str
    grid: Array | None
    steps: int
    range: tuple[float | None, float | None]

    def solve(self, points: tuple[PointName, ...], rates: bool) -> SolvedDesign:
        """See `solve_design`."""
        return solve_design(with_design_values(self.mechanism, self.values), *self[2:], points, rates)

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
    """A design over a grid of positions (rows,) of its running input, or, without one, over a range of its own.

    `range_` is the start and the stop that the cycle is asked for. Never raises NoAnswer: the status says it.
    """

    def run() -> tuple[Motion, Array]:
        motion = cycle(mechanism, steps, *range_, pair)
        return motion, motion.inputs[pair].position

    return _solve(run, grid, steps, points, rates)


def solve_timed_design(
    mechanism: Mechanism, duration: float, steps: int, points: tuple[PointName, ...], rates: bool
) -> SolvedDesign:
    """A design in time, all its inputs at once by their laws or rates: as `solve_design`, `input` the times (s)."""

    def run() -> tuple[Motion, Array]:
        motion = cycle(mechanism, steps, duration=duration)
        assert motion.time is not None
        return motion, motion.time

    return _solve(run, np.linspace(0.0, duration, steps + 1), steps, points, rates)


class GridMotion(NamedTuple):
    """The motion of one design (None where there is none), how many of its rows are on the grid, the status of every
    row, and what there is to say of its end."""

    motion: Motion | None
    many: int
    status: Array
    message: str | NoAnswer


def run_design(mechanism: Mechanism, pair: str, grid: Array) -> GridMotion:
    """The motion of a design over a grid of positions (rows,) of its running input. Never raises NoAnswer."""

    def run() -> tuple[Motion, Array]:
        motion = cycle(mechanism, len(grid) - 1, float(grid[0]), float(grid[-1]), pair)
        return motion, motion.inputs[pair].position

    return _run_on_grid(run, grid, len(grid) - 1)[0]


def _run_on_grid(
    run: Callable[[], tuple[Motion, Array]], grid: Array | None, steps: int
) -> tuple[GridMotion, Array | None]:
    """A motion, and where its rows are; which of these are on a grid, or all where there is none."""
    status = np.zeros(steps + 1, dtype=np.int8)
    reason = time_is_over()
    if reason:
        status[:] = OUTCOMES.index(Outcome.INTERRUPTED)
        return GridMotion(None, 0, status, reason), None
    try:
        motion, position = run()
    except NoAnswer as problem:
        status[:] = OUTCOMES.index(problem.outcome)
        return GridMotion(None, 0, status, problem.with_traceback(None)), None  # its sentence takes long to find
    except (BadInput, PointPlacementError) as problem:
        status[:] = OUTCOMES.index(Outcome.CANNOT_BE_ASSEMBLED)
        return GridMotion(None, 0, status, str(problem)), None
    many = min(len(position), steps + 1)
    if grid is not None:
        off = np.abs(position[:many] - grid[:many]) > GRID_TOLERANCE * max(1.0, float(np.max(np.abs(grid))))
        many = int(np.argmax(off)) if off.any() else many
    status[many:] = OUTCOMES.index(motion.outcome)
    return GridMotion(motion, many, status, motion.reason if many <= steps else ""), position


def _solve(
    run: Callable[[], tuple[Motion, Array]],
    grid: Array | None,
    steps: int,
    points: tuple[PointName, ...],
    rates: bool,
) -> SolvedDesign:
    """The rows of a motion on a grid (rows,), or on its own; `run` gives the motion, and where its rows are."""
    wide = 2 * len(points) * (3 if rates else 1)
    out = np.full((steps + 1, wide), np.nan)
    input_ = np.full(steps + 1, np.nan) if grid is None else grid
    (motion, many, status, message), position = _run_on_grid(run, grid, steps)
    if motion is None or position is None:
        return SolvedDesign(input_, out, status, message)
    if grid is None:
        input_[: len(position)] = position[: steps + 1]
    out[:many] = point_rows(motion, points, rates)[:many]
    told = "; ".join(motion.rate_remarks) if rates else ""
    last = float(position[-1]) if many <= steps else np.nan
    at_dead_point, at_stop = (motion.outcome is each for each in (Outcome.DEAD_POINT, Outcome.STOP))
    ends = last if at_dead_point else np.nan, last if at_stop else np.nan
    return SolvedDesign(input_, out, status, message, told, *ends)


def link_angles(motion: Motion, links: tuple[str, ...]) -> Array:
    """The angles of links (links, rows) over a motion, with all turns as they are followed."""
    return np.array([np.broadcast_to(value_and_rates(motion.frames[link].angle)[0], len(motion)) for link in links])


def point_rows(motion: Motion, points: tuple[PointName, ...], rates: bool) -> Array:
    """x and y of points (rows, 2 a point and order) over a motion."""
    found = [_point_motion(motion, name) for name in points]
    orders = ("position", "velocity", "acceleration") if rates else ("position",)
    if not found:
        return np.zeros((len(motion), 0))
    return np.hstack([getattr(point, order) for order in orders for point in found])


def _point_motion(motion: Motion, name: PointName) -> PointMotion:
    if isinstance(name, str):
        return motion.point(name)
    orders = vector_and_rates(motion.frames[name.link].to_world(name.at))[:3]
    return PointMotion(*(np.broadcast_to(stack_vectors(*each), (len(motion), 2)) for each in orders))
