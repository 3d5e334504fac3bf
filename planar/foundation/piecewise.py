"""Functions that are put together of pieces, for floats, arrays, symbols and jets: a formula is written once.

Derivatives at a joint are those of the piece that starts there.
"""

from __future__ import annotations

from math import floor, pi

import numpy as np

from planar.foundation.jets import Jet, Scalar, TermSizes

TURN = 2.0 * pi


def within_turn(angle: Scalar) -> Scalar:
    """An angle (rad) less the whole turns in it: from 0 up to a turn."""
    if isinstance(angle, TermSizes):
        return angle
    if isinstance(angle, Jet):
        return Jet(within_turn(angle.parts[0]), *angle.parts[1:])
    if type(angle) is float:
        return angle - TURN * floor(angle / TURN)
    if _is_symbol(angle):
        return angle - TURN * (angle / TURN).floor()
    return angle - TURN * np.floor(np.real(angle) / TURN)


def value_between(x: Scalar, low: Scalar | None, high: Scalar | None, value: Scalar) -> Scalar:
    """A value where low <= x < high, else nothing; an end that is None is none."""
    if isinstance(x, TermSizes) or isinstance(value, TermSizes):
        return value
    if isinstance(value, Jet):
        return Jet(*(value_between(x, low, high, part) for part in value.parts))
    x, low, high = (each.parts[0] if isinstance(each, Jet) else each for each in (x, low, high))
    if any(map(_is_symbol, (x, low, high, value))):
        # flags are numbers, 0 or 1, whose derivative is none
        is_below = 1.0 if high is None else x < high
        return is_below * value if low is None else (low <= x) * (is_below * value)
    is_inside = np.asarray(True)
    if low is not None:
        is_inside = is_inside & (np.real(low) <= np.real(x))
    if high is not None:
        is_inside = is_inside & (np.real(x) < np.real(high))
    if is_inside.ndim == 0:
        return value if is_inside else value * 0.0
    return np.where(is_inside, value, 0.0)


def part_of_piece(x: Scalar) -> Scalar:
    """A number that lies between 0 and 1 wherever it counts: sizes of its terms say no more."""
    if not isinstance(x, TermSizes):
        return x
    return TermSizes(1.0, *x.parts[1:])


def _is_symbol(value: Scalar) -> bool:
    return hasattr(value, "is_symbolic")
