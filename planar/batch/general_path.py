"""The general path: one design of a sweep, solved as a separate cycle."""

from __future__ import annotations

from collections.abc import Mapping
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


class GridMotion(NamedTuple):
    """The motion of one design (None where there is none), the positions of the running input in its rows, or their
    times (s), how many of the rows are on the grid, the status of every row, and the reason of its end."""

    motion: Motion | None
    position: Array
    row_count: int
    status: Array
    message: str | NoAnswer


class DesignRun(NamedTuple):
    """One design, a mechanism with `values` of some of its numbers, and its run; as text, why it ends.

    Its input `pair` runs over a grid of positions (steps + 1,), or, without a grid, from `start` over its own range.
    With a `duration` (s) all its inputs run by their laws or rates, and the grid is the times.
    """

    mechanism: Mechanism
    pair: str
    grid: Array | None
    steps: int
    values: Mapping[str, float] = {}
    start: float | None = None
    duration: float | None = None

    def motion(self) -> Motion:
        """The motion of the design. Raises NoAnswer, BadInput and PointPlacementError."""
        mechanism = with_design_values(self.mechanism, self.values)
        if self.duration is not None:
            return cycle(mechanism, self.steps, duration=self.duration)
        start, stop = (self.start, None) if self.grid is None else (float(self.grid[0]), float(self.grid[-1]))
        return cycle(mechanism, self.steps, start, stop, self.pair)

    def run(self) -> GridMotion:
        """The motion on the grid; instead of raising NoAnswer the status contains it."""
        status, grid = np.zeros(self.steps + 1, dtype=np.int8), self.grid

        def without_motion(outcome: Outcome, message: str | NoAnswer) -> GridMotion:
            status[:] = outcome.code
            return GridMotion(None, np.zeros(0), 0, status, message)

        reason = time_is_over()
        if reason:
            return without_motion(Outcome.INTERRUPTED, reason)
        try:
            motion = self.motion()
        except NoAnswer as problem:
            return without_motion(problem.outcome, problem.with_traceback(None))  # its sentence takes long to make
        except (BadInput, PointPlacementError) as problem:
            return without_motion(Outcome.CANNOT_BE_ASSEMBLED, str(problem))
        position = motion.time if self.duration is not None else None
        if position is None:
            position = motion.inputs[self.pair].position
        row_count = min(len(position), self.steps + 1)
        if grid is not None:
            distance = np.abs(position[:row_count] - grid[:row_count])
            is_off = distance > GRID_TOLERANCE * max(1.0, float(np.max(np.abs(grid))))
            row_count = int(np.argmax(is_off)) if is_off.any() else row_count
        status[row_count:] = motion.outcome.code
        return GridMotion(motion, position, row_count, status, motion.reason if row_count <= self.steps else "")

    def solve(self, points: tuple[PointName, ...], rates: bool) -> SolvedDesign:
        """The design with its points; without a grid `input` is where its own range has the running input."""
        motion, position, row_count, status, message = self.run()
        out = np.full((self.steps + 1, 2 * len(points) * (3 if rates else 1)), np.nan)
        grid = self.grid
        if grid is None:
            grid = np.full(self.steps + 1, np.nan)
            grid[: len(position)] = position[: self.steps + 1]
        if motion is None:
            return SolvedDesign(grid, out, status, message)
        out[:row_count] = point_rows(motion, points, rates)[:row_count]
        solved = SolvedDesign(grid, out, status, message, "; ".join(motion.rate_remarks) if rates else "")
        if self.duration is not None or row_count > self.steps:
            return solved
        last = float(position[-1])
        if motion.outcome is Outcome.DEAD_POINT:
            return solved._replace(dead_point=last)
        return solved._replace(stop_position=last) if motion.outcome is Outcome.STOP else solved

    def __str__(self) -> str:
        return str(self.solve((), False).message)


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
