"""Angles modulo a turn."""

from __future__ import annotations

import numpy as np

from planar.foundation.jets import Scalar, atan2, cos, sin

Array = np.ndarray


def wrap_angle(angle: Scalar) -> Scalar:
    """The same direction as an angle between -pi and pi, of any arithmetic."""
    return atan2(sin(angle), cos(angle))


def distances(is_angle: Array, one: Array, other: Array) -> Array:
    """How far numbers are apart, those that are angles modulo a turn: by the chord of their directions."""
    return np.where(is_angle, np.abs(np.exp(1j * one) - np.exp(1j * other)), np.abs(one - other))
