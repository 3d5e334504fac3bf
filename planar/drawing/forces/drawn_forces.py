"""The forces over the run that a drawing shows."""

from __future__ import annotations

from collections.abc import Callable
from math import pi
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams.axes import format_number
from planar.drawing.diagrams.drawn_run import closed_run, steady_run
from planar.dynamics.flywheel import whole_turns
from planar.dynamics.force_course import force_course
from planar.dynamics.forces import Forces, forces
from planar.dynamics.load_validation import require_loads
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput
from planar.foundation.units import parse_unit
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion

ROUND_OFF_RATIO = 1e-9
"""A force below this part of the greatest in any pair at that position is round-off."""


class ForceRun(NamedTuple):
    """Forces over a motion, and what they are drawn over, in the order in which that grows.

    `over` is of the input that runs, in the file's units, else the time (s) where the input turns back; of a whole
    cycle it goes from zero on.
    """

    forces: Forces
    motion: Motion
    abscissa: Array
    axis_name: str
    "of what it is, with its unit"
    unit: str
    order: IntArray
    period: float
    "of a whole cycle, in the unit; else 0"
    notes: tuple[str, ...]

    def in_order(self, values: Array | float) -> Array:
        """What the motion has at its rows (n, ...), in this order."""
        found = np.asarray(values)[self.order]
        if not self.period:
            return found
        before, after = self.abscissa[1], self.period - self.abscissa[-2]
        part = after / (before + after) if before + after else 0.0
        edge = (found[:1] * part + found[-1:] * (1.0 - part)) if before else found[:1]
        return np.concatenate([edge, found, edge])

    @property
    def arm(self) -> float:
        """The mechanism's size (m)."""
        return mechanism_size(self.forces.mechanism, self.forces.moving.shapes)

    @property
    def round_off(self) -> Array:
        """What a force (N) at least is beside round-off, of the greatest in any pair there; a couple at the arm."""
        found = np.zeros(len(self.abscissa))
        for each in self.forces.reactions.values():
            found = np.fmax(found, np.hypot(*self.in_order(each.force).T))
        return ROUND_OFF_RATIO * found

    def place_text(self, row: int) -> str:
        """Where a row is: at 120 deg."""
        return self.abscissa_text(float(self.abscissa[row]))

    def abscissa_text(self, value: float) -> str:
        """A place on the axis: at 120 deg."""
        return f"at {format_number(value, 4)} {self.unit}"

    @property
    def least_scales(self) -> tuple[float, float]:
        """See `ForceCourse.least_scales`."""
        course = force_course(self.forces)
        return (0.0, 0.0) if course is None else course.least_scales

    def solved_extremes(
        self, measure: Callable[[Forces], Array], least_scale: float
    ) -> tuple[tuple[float, float], ...] | None:
        """The greatest and the least value of what is measured of forces (n,), each as (abscissa, value).

        Solved for between the positions; None where the motion is known at these alone. See `fit_series`.
        """
        course = force_course(self.forces)
        series = None if course is None else course.series(measure, least_scale)
        if course is None or series is None:
            return None
        extremes = []
        for extreme in (series.greatest(), series.smallest()):
            value = float(course.positions([extreme.place])[0])
            if self.unit != "s":
                value = parse_unit(self.unit).from_si(value)
            extremes.append((float(np.mod(value, self.period)) if self.period else value, extreme.value))
        return tuple(extremes)


def forces_over_cycle(source: Forces | Motion | Mechanism, with_steps: bool = True) -> ForceRun:
    """Forces as they are given, or those over a whole cycle at the input's steady speed.

    `with_steps` adds positions on both sides of each place where a force may step or bend. If the file gives no speed,
    inertia is left out. Raises BadInput for the forces of one position, for a mechanism on which nothing acts, and what
    `planar.cycle` and `planar.forces` raise.
    """
    require_loads(source if isinstance(source, Mechanism) else source.mechanism)
    notes = []
    if isinstance(source, Forces):
        found = source
    elif isinstance(source, Motion) and source.time is not None:
        found = forces(source)
    else:
        run = closed_run(steady_run(source))
        found = forces(run.motion, inertia=run.has_speed)
        if not run.has_speed and run.motion.mechanism.masses:
            notes.append("without inertia: the file gives no speed of the input")
    course = force_course(found)
    if course is not None and with_steps:
        found = course.with_steps()
    motion = found.moving
    if not isinstance(motion, Motion):
        raise BadInput("forces", "this is drawn over a motion; give the forces over one")
    name = motion.running_input
    position, way = motion.inputs[name].position, np.diff(motion.inputs[name].position)
    units = motion.mechanism.units
    if (way > 0.0).all() or (way < 0.0).all() or motion.time is None:
        written = units.length if motion.has_length_motion(name) else units.angle
        over, label = position * parse_unit(written).denominator / parse_unit(written).numerator, f"{name} ({written})"
    else:
        written, over, label = "s", motion.time, "t (s)"
    period = parse_unit(written).from_si(2.0 * pi) * whole_turns(motion, name) if written != "s" else 0.0
    if period:
        over = np.mod(over[:-1], period)
        over[period - over < 1e-9 * period] = 0.0
    order = np.argsort(over, kind="stable")
    over = over[order]
    if period:
        over = np.concatenate([[0.0], over, [period]])
    return ForceRun(found, motion, over, label, written, order, period, tuple(notes))
