"""What runs in a motion, as the axis of a diagram."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.units import parse_unit
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion


def running_axis(motion: Motion) -> tuple[Array, str, bool]:
    """What runs, in its unit, the name of its axis, and whether it is an angle."""
    if motion.time is not None:
        return motion.time, "time (s)", False
    name = motion.running_input
    positions = motion.inputs[name].position
    if relative_motions(motion.mechanism)[name].input_kind is MeasureKind.ANGLE:
        return np.degrees(positions), f"{name} (°)", True
    unit = motion.mechanism.units.length
    return np.array([parse_unit(unit).from_si(float(each)) for each in positions]), f"{name} ({unit})", False
