"""How uneven an input's torque is over a cycle, and the flywheel that keeps its speed within bounds."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import isclose, pi

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.force_course import ForceCourse, force_course, has_unknown_intervals
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.piecewise_series import TIE_TOLERANCE
from planar.results.motion import Motion, State

DEFAULT_FLUCTUATION = 0.02
"""The coefficient of fluctuation of speed where none is given."""
CYCLE_TOLERANCE = 1e-6
"""Of the greatest: what may differ between the start and the end of a whole cycle."""
STEADY_SPEED_TOLERANCE = 1e-6
"""Of the speed: what it may differ by and be steady."""

ZERO_MEAN_TOLERANCE = 1e-10
"""Of the greatest torque: a smaller mean is rounding of its series."""
UNKNOWN_TORQUE = "the torque is not known over the whole cycle"


@dataclass(frozen=True)
class Flywheel:
    """What a whole cycle asks of a flywheel on the link that an input turns.

    Driven by the steady torque `mean` (N m), the input has `energy` (J) too much and too little by turns: the greatest
    difference between two places of the integral of mean less torque, at `fastest` and at `slowest` (rad). A moment of
    inertia `inertia` (kg m^2) keeps (greatest - least) / mean speed to `fluctuation` at the mean `speed` (rad/s):
    I = energy / (fluctuation speed^2). Without a steady speed both are None.
    """

    input: str
    mean: float
    energy: float
    fastest: float
    slowest: float
    fluctuation: float
    speed: float | None
    inertia: float | None

    def rim_mass(self, radius: float) -> float | None:
        """The mass (kg) of a thin rim of this mean radius (m) that has the moment of inertia: m = I / r^2.

        None without a steady speed. Raises BadInput for a radius that is none.
        """
        if not 0.0 < radius < np.inf:
            raise BadInput("radius", f"a radius above zero (m) is wanted, not {radius!r:.40}")
        return None if self.inertia is None else self.inertia / radius**2


@takes_result("Forces")
def flywheel(forces: Forces, of: str | None = None, fluctuation: float = DEFAULT_FLUCTUATION) -> Flywheel:
    """The flywheel of an input (left out: the one that runs) after forces over a whole cycle of it.

    Mean, energy and angles are solved for between the positions, on each smooth piece of the motion, so they do not
    depend on the number of steps; the inertia of the links is part of the torque, at the speed without fluctuation
    (J. E. Shigley, Mechanical Engineering Design, chapter on flywheels; R. L. Norton, Design of Machinery, section on
    flywheels). Raises BadInput for an input that does not exist or is no angle, forces that are not over a whole cycle,
    and a fluctuation outside 0 to 2.

    >>> import planar
    >>> motion = planar.cycle(planar.load("two-stroke-engine"), 72)
    >>> round(planar.flywheel(planar.forces(motion)).speed, 2)
    314.16
    """
    motion = forces.moving
    if not 0.0 < fluctuation < 2.0:
        raise BadInput("fluctuation", f"a coefficient between 0 and 2 is wanted, not {fluctuation!r:.40}")
    if not isinstance(motion, Motion):
        raise BadInput("forces", "a flywheel is of a whole cycle; give the forces over a motion")
    name = motion.running_input if of is None else of
    if name not in forces.inputs:
        raise BadInput(name, f"there is no input of this name; inputs are at {', '.join(forces.inputs)}")
    effort = _EffortOverCycle(forces, name)
    angles, stored = effort.stored_energy()
    energy, speed = float(np.ptp(stored)), _steady_speed(motion.inputs[name].velocity)
    return Flywheel(
        name,
        effort.mean,
        energy,
        _first_place(angles, stored, 1.0),
        _first_place(angles, stored, -1.0),
        fluctuation,
        speed,
        energy / (fluctuation * speed**2) if speed else None,
    )


def whole_turns(motion: Motion, name: str) -> int:
    """The whole turns of an input after which a motion ends as it began; 0 where it does not, or turns back."""
    angle = motion.inputs[name].position
    gone = abs(angle[-1] - angle[0]) / (2.0 * pi)
    ahead = np.sign(angle[-1] - angle[0]) * np.diff(angle) > 0.0
    if motion.has_length_motion(name) or not isclose(gone, round(gone), rel_tol=1e-9) or not ahead.all():
        return 0
    places = [motion.point(point).position for point in motion.point_names]
    size = max((float(np.ptp(each, axis=0).max()) for each in places), default=0.0)
    return round(gone) if all(np.abs(each[-1] - each[0]).max() <= CYCLE_TOLERANCE * size for each in places) else 0


def explain_no_cycle(forces: Forces, name: str) -> str:
    """Why there is no mean effort of an input: its forces are not those of a whole cycle. Empty where they are."""
    motion, torque = forces.moving, np.asarray(forces.inputs[name])
    if isinstance(motion, State):
        return "one position is no cycle; give the forces over a motion"
    if motion.has_length_motion(name):
        return "a flywheel turns; this input is a length"
    if not whole_turns(motion, name):
        return "the motion is no whole cycle: it does not end as it began after whole turns of this input"
    if has_unknown_intervals(torque):
        return UNKNOWN_TORQUE
    course = force_course(forces)
    if course is None:
        return "the motion is known at its positions alone, and not between them"
    return _explain_open_end(course, name)


def _explain_open_end(course: ForceCourse, name: str) -> str:
    """Why the end of a motion is not its start, by the speed and the effort of an input; empty where it is."""
    motion, torque = course.run.motion, np.asarray(course.forces.inputs[name])
    speed = motion.inputs[name].velocity
    largest = max(float(np.nanmax(np.abs(torque))), course.effort_scale(name))
    if motion.time is not None and abs(speed[-1] - speed[0]) > CYCLE_TOLERANCE * float(np.abs(speed).max()):
        return "the motion is no whole cycle: the speed does not end as it began"
    is_open = abs(torque[-1] - torque[0]) > CYCLE_TOLERANCE * largest and not course.has_step_at_ends
    return "the motion is no whole cycle: the torque does not end as it began" if is_open else ""


def _steady_speed(velocity: Array) -> float | None:
    """The steady speed, if it is that."""
    mean = abs(float(np.mean(velocity)))
    return mean if mean and float(np.ptp(velocity)) <= STEADY_SPEED_TOLERANCE * mean else None


def mean_effort(forces: Forces, name: str) -> float:
    """The mean effort (N m) of an input over a whole cycle of it, by its angle. Raises BadInput where there is none."""
    return _EffortOverCycle(forces, name).mean


class _EffortOverCycle:
    """The effort of an input over a whole cycle: its mean and what it stores against that, between all positions."""

    def __init__(self, forces: Forces, name: str):
        refused = explain_no_cycle(forces, name)
        if refused:
            raise BadInput(name, refused)
        course = force_course(forces)
        assert course is not None
        self.name, self.course = name, course
        rate = 1.0 if course.run.motion.time is None else float(np.abs(forces.moving.inputs[name].velocity).max())
        scale = course.effort_scale(name)
        series = course.series(self._power_and_torque, np.array([scale * rate, scale]))
        if series is None:
            raise BadInput(name, UNKNOWN_TORQUE)
        self.series = series
        self.start, self.stop = map(float, self._angles([course.run.low, course.run.high]))
        mean = series.integral(0) / (self.stop - self.start)
        self.mean = 0.0 if abs(mean) <= ZERO_MEAN_TOLERANCE * float(series.scale[1]) else mean

    def stored_energy(self) -> tuple[Array, Array]:
        """The angles of the input at which it is fastest or slowest by turns, and the energy that it has stored there
        since the start."""
        crossings = self.series.crossings(self.mean, 1)
        places = np.concatenate([[self.course.run.low], crossings])
        angles = self._angles(places)
        energy: Array = self.mean * (angles - self.start) - self.series.running_integral(places, 0)
        rounding = ZERO_MEAN_TOLERANCE * float(self.series.scale[1]) * abs(self.stop - self.start)
        return angles, energy if np.ptp(energy) > rounding else np.zeros_like(energy)

    def _power_and_torque(self, forces: Forces) -> Array:
        """The torque times the rate of the angle along the run, and the torque (n, 2)."""
        motion, torque = forces.moving, np.asarray(forces.inputs[self.name])
        assert isinstance(motion, Motion)
        rate = motion.inputs[self.name].velocity if motion.time is not None else self._range_direction
        return np.stack([torque * rate, torque], axis=-1)

    @property
    def _range_direction(self) -> float:
        position = self.course.run.motion.inputs[self.name].position
        return 1.0 if position[-1] > position[0] else -1.0

    def _angles(self, places: Sequence[float] | Array) -> Array:
        """The angles of the input at places (n,)."""
        return self.course.run.motion_at(np.asarray(places)).inputs[self.name].position


def _first_place(angles: Array, energy: Array, sign: float) -> float:
    """The angle at which the energy is greatest (`sign` 1) or least, the first of equal ones."""
    signed = sign * energy
    near = signed >= signed.max() - TIE_TOLERANCE * float(np.ptp(energy))
    return float(angles[int(np.argmax(near))])
