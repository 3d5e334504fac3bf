"""How uneven an input's torque is over a cycle, and the flywheel that keeps its speed within bounds."""

from __future__ import annotations

from dataclasses import dataclass
from math import isclose, pi

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.results.motion import Motion, State

DEFAULT_FLUCTUATION = 0.02
"""The coefficient of fluctuation of speed where none is given."""
CYCLE_TOLERANCE = 1e-6
"""Of the greatest: what may differ between the start and the end of a whole cycle."""
STEADY_SPEED_TOLERANCE = 1e-6
"""Of the speed: what it may differ by and be steady."""

ZERO_MEAN_TOLERANCE = 1e-13
"""Of the greatest torque: a smaller mean is none."""


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

    The torque goes through all positions by a periodic cubic spline, whose integral and places are exact; the links'
    own inertia is in the torque already, at the speed without fluctuation (J. E. Shigley, Mechanical Engineering
    Design, chapter on flywheels; R. L. Norton, Design of Machinery, section on flywheels). Raises BadInput for an input
    that is not there or is no angle, forces that are not over a whole cycle, and a fluctuation that is none.

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
    angle, torque = motion.inputs[name].position, np.asarray(forces.inputs[name])
    refused = explain_no_cycle(forces, name)
    if refused:
        raise BadInput(name, refused)
    if angle[-1] < angle[0]:
        angle, torque = angle[::-1], torque[::-1]
    return _flywheel_over_cycle(name, angle, torque, fluctuation, _steady_speed(motion.inputs[name].velocity))


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
    """Why forces over a motion are not those of a whole cycle of an input; nothing where they are."""
    motion, torque = forces.moving, np.asarray(forces.inputs[name])
    if isinstance(motion, State):
        return "one position is no cycle; give the forces over a motion"
    if motion.has_length_motion(name):
        return "a flywheel turns; this input is a length"
    if not whole_turns(motion, name):
        return "the motion is no whole cycle: it does not end as it began after whole turns of this input"
    if not np.isfinite(torque).all():
        return "the torque is not told all over the cycle"
    if abs(torque[-1] - torque[0]) > CYCLE_TOLERANCE * float(np.abs(torque).max()):
        return "the motion is no whole cycle: the torque does not end as it began"
    return ""


def _steady_speed(velocity: Array) -> float | None:
    """The steady speed, if it is that."""
    mean = abs(float(np.mean(velocity)))
    return mean if mean and float(np.ptp(velocity)) <= STEADY_SPEED_TOLERANCE * mean else None


def _flywheel_over_cycle(name: str, angle: Array, torque: Array, fluctuation: float, speed: float | None) -> Flywheel:
    from scipy.interpolate import CubicSpline  # slow to load, and only needed here

    closed = np.append(torque[:-1], torque[0])
    mean = float(CubicSpline(angle, closed, bc_type="periodic").integrate(angle[0], angle[-1]) / (angle[-1] - angle[0]))
    if abs(mean) <= ZERO_MEAN_TOLERANCE * float(np.abs(torque).max()):
        mean = 0.0
    over = CubicSpline(angle, closed - mean, bc_type="periodic")
    turning = over.roots(extrapolate=False)
    places = np.concatenate([angle[:1], turning[np.isfinite(turning)]])
    stored = -over.antiderivative()(places)
    energy = float(np.ptp(stored))
    return Flywheel(
        name,
        mean,
        energy,
        float(places[np.argmax(stored)]),
        float(places[np.argmin(stored)]),
        fluctuation,
        speed,
        energy / (fluctuation * speed**2) if speed else None,
    )
