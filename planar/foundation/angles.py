"""Angles modulo a turn."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.foundation.jets import Scalar, atan2, cos, sin


def wrap_angle(angle: Scalar) -> Scalar:
    """The same direction as an angle between -pi and pi, of any arithmetic."""
    return atan2(sin(angle), cos(angle))


def distances(is_angle: BoolArray, one: Array, other: Array) -> Array:
    """How far numbers are apart, those that are angles modulo a turn: by the chord of their directions."""
    chords: Array = np.where(is_angle, np.abs(np.exp(1j * one) - np.exp(1j * other)), np.abs(one - other))
    return chords
