"""Forces over a motion between its positions: series of them on the pieces on which everything is smooth."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, lru_cache

import numpy as np

from planar.dynamics.forces import Forces, forces, greatest_moment_and_force
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer
from planar.foundation.piecewise_series import PiecewiseSeries, fit_series
from planar.model.mechanism import relative_motions
from planar.results.motion import Motion
from planar.solving.samples import ContinuousRun

TURN_TOLERANCE = 1e-9
"""rad: what rounding leaves of a turn that the places of a load span."""
STEP_SIDE_RATIO = 1e-9
"""Of a run: how far from a step its two sides are shown."""
LEAST_SCALE_RATIO = 1e-3
"""Of the greatest force or moment: smaller ones have errors of rounding of the greatest."""


class ForceCourse:
    """The forces of a motion at any of its places (see `ContinuousRun`).

    Every integral, mean, extreme and crossing of a result of forces is taken from `series`, which has its pieces
    between the places that the file names: steps and bends of loads, pieces of laws and of cams, corners of motors.
    """

    def __init__(self, forces: Forces, motion: Motion):
        self.forces, self.run = forces, ContinuousRun(motion)
        self._known: dict[bytes, Forces] = {}

    def forces_at(self, places: Array) -> Forces:
        """The forces at places (n,). Raises NoAnswer where the branch cannot be followed."""
        key = np.asarray(places).tobytes()
        if key not in self._known:
            motion = self.run.motion_at(places)
            self._known[key] = forces(motion, self.forces.with_inertia, self.forces.with_friction)
        return self._known[key]

    def with_steps(self) -> Forces:
        """The forces at the positions of the motion, and on both sides of each place where they may step or bend."""
        inside, room = np.array(self.ends[1:-1]), STEP_SIDE_RATIO * (self.run.high - self.run.low)
        sides = np.concatenate([inside - room, inside + room, [self.run.high - room] * self.has_step_at_ends])
        if not len(sides):
            return self.forces
        rows = self.run.rows
        if len(inside):
            rows = rows[np.abs(np.subtract.outer(rows, inside)).min(axis=1) > room]
        return self.forces_at(np.sort(np.concatenate([rows, sides])))

    def series(self, measure: Callable[[Forces], Array], least_scale: Array | float = 0.0) -> PiecewiseSeries | None:
        """The series of what is measured of forces at n places, (n,) or (n, columns); see `fit_series`.

        None where it has none, not over the whole motion, or where a column grows without bound.
        """
        try:
            series = fit_series(lambda places: measure(self.forces_at(places)), self.ends, least_scale)
        except NoAnswer:
            return None
        return None if series is None or series.has_gaps else series

    def positions(self, places: Sequence[float] | Array) -> Array:
        """Where places are, as tables say it: the time (s) of a run in time, else the running input (rad or m)."""
        values = np.asarray(places, dtype=float)
        return values if self.run.motion.time is not None else self.run.positions(values)

    @cached_property
    def least_scales(self) -> tuple[float, float]:
        """The moment (N m) and force (N) that are the least scales of series: smaller values are partly rounding."""
        moment, force = greatest_moment_and_force(self.forces)
        return LEAST_SCALE_RATIO * moment, LEAST_SCALE_RATIO * force

    def effort_scale(self, name: str) -> float:
        """The least scale of the effort of an input."""
        return self.least_scales[self.forces.is_force_input(name)]

    @cached_property
    def ends(self) -> tuple[float, ...]:
        """The ends of the pieces, the first and the last place among them."""
        inside = self.run.distinct([*self.run.breaks(), *self._load_breaks(), *self._motor_breaks()])
        return self.run.low, *inside.tolist(), self.run.high

    @property
    def has_step_at_ends(self) -> bool:
        """Whether a load or a law of an input may have a step at the first or the last place."""
        motion = self.run.motion
        if motion.time is not None and any(driven.law is not None for driven in motion.mechanism.inputs):
            return True
        for load in motion.mechanism.loads:
            if load.varies is None:
                continue
            along = motion.time if load.varies.input is None else motion.inputs[load.varies.input].position
            period = self._period(load.varies.input, load.varies.at)
            gaps = np.subtract.outer(np.asarray(along)[[0, -1]], load.varies.at)
            if period:
                gaps -= period * np.round(gaps / period)
            if (np.abs(gaps) <= TURN_TOLERANCE * max(1.0, float(np.ptp(load.varies.at)))).any():
                return True
        return False

    def _load_breaks(self) -> Iterator[float]:
        for load in self.run.motion.mechanism.loads:
            if load.varies is None:
                continue
            name, places = load.varies.input, load.varies.at
            if name is None:
                yield from places
            else:
                yield from self.run.input_crossings(name, set(places), self._period(name, places)).tolist()

    def _period(self, name: str | None, places: tuple[float, ...]) -> float:
        """The turn after which a load comes again; 0 where it does not."""
        is_angle = name is not None and (
            relative_motions(self.run.motion.mechanism)[name].input_quantity_kinds()[0] == "angle"
        )
        turn = 2.0 * np.pi
        return turn if is_angle and abs(places[-1] - places[0] - turn) < TURN_TOLERANCE else 0.0

    def _motor_breaks(self) -> Iterator[float]:
        for driven in self.run.motion.mechanism.inputs:
            if driven.motor is not None and self.run.motion.time is not None:
                yield from self.run.speed_crossings(driven.pair, driven.motor.speeds).tolist()


def has_unknown_intervals(values: Array) -> bool:
    """Whether values (n,) are unknown at two positions in a row, and not at isolated ones such as change points."""
    is_unknown = ~np.isfinite(values)
    return bool((is_unknown[1:] & is_unknown[:-1]).any() or is_unknown.all())


def force_course(forces: Forces) -> ForceCourse | None:
    """The forces of a motion between its positions.

    None where they are known at the positions alone: at a single position, over a simulated motion, and where a dead
    point or a position without rates is in the motion.
    """
    return _cached_course(forces)


@lru_cache(maxsize=4)
def _cached_course(forces: Forces) -> ForceCourse | None:
    motion = forces.moving
    if not isinstance(motion, Motion) or motion.course is None or len(motion) < 2:
        return None
    try:
        course = ForceCourse(forces, motion)
    except NoAnswer:
        return None
    return course if course.run.is_regular else None
