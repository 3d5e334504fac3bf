"""Angles modulo a turn."""

from __future__ import annotations

from math import ceil, floor, pi

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.foundation.jets import Scalar, atan2, cos, sin

TURN = 2.0 * pi
"""rad"""
SAME_ANGLE_TOLERANCE = 1e-9
"""rad: an angle this near to an end of an interval lies on it."""


def wrap_angle(angle: Scalar) -> Scalar:
    """The same direction as an angle between -pi and pi, of any arithmetic."""
    return atan2(sin(angle), cos(angle))


def distances(is_angle: BoolArray, one: Array, other: Array) -> Array:
    """How far numbers are apart, those that are angles modulo a turn: by the chord of their directions."""
    chords: Array = np.where(is_angle, np.abs(np.exp(1j * one) - np.exp(1j * other)), np.abs(one - other))
    return chords


def interval_offset(low: float, high: float, position: float, with_ends: bool = True) -> float:
    """Return the whole turns (rad) to add to an interval of angles so that it is written as every result writes it.

    The interval written contains `position` if whole turns can bring it there (`with_ends`: also as one of its ends);
    otherwise it starts in (-pi, pi]. An interval of a turn or more from 0 on has no ends and is not moved.
    """
    if low == 0.0 and high - low >= TURN - SAME_ANGLE_TOLERANCE:
        return 0.0
    tolerance = SAME_ANGLE_TOLERANCE if with_ends else -SAME_ANGLE_TOLERANCE
    offset = TURN * ceil((position - high - tolerance) / TURN)
    if low + offset <= position + tolerance:
        return offset
    return -TURN * ceil((low - pi - SAME_ANGLE_TOLERANCE) / TURN)


def window_start(position: float) -> float:
    """Return where the turn that shows a position starts: at 0, at -pi for a position below, or whole turns off."""
    return -pi if -pi <= position < 0.0 else TURN * floor(position / TURN)
