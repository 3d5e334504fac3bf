"""General tolerances of lengths and angles.

ISO 2768-1:1989, General tolerances - Part 1: tables 1 (linear dimensions) and 3 (angular dimensions).
"""

from __future__ import annotations

from bisect import bisect_left
from math import pi

CLASSES = {"f": "fine", "m": "medium", "c": "coarse", "v": "very coarse"}
LENGTH_STEPS = (3.0, 6.0, 30.0, 120.0, 400.0, 1000.0, 2000.0, 4000.0)
"""mm: each range goes up to and with this length."""
LEAST_LENGTH = 0.5
"""mm: below it a drawing gives the deviation beside the length."""
LENGTH_DEVIATIONS: dict[str, tuple[float | None, ...]] = {
    "f": (0.05, 0.05, 0.1, 0.15, 0.2, 0.3, 0.5, None),
    "m": (0.1, 0.1, 0.2, 0.3, 0.5, 0.8, 1.2, 2.0),
    "c": (0.2, 0.3, 0.5, 0.8, 1.2, 2.0, 3.0, 4.0),
    "v": (None, 0.5, 1.0, 1.5, 2.5, 4.0, 6.0, 8.0),
}
"""mm, plus and minus."""
SIDE_STEPS = (10.0, 50.0, 120.0, 400.0)
"""mm: ranges of the shorter side of an angle; the last is open."""
ANGLE_DEVIATIONS = {
    "f": (60.0, 30.0, 20.0, 10.0, 5.0),
    "m": (60.0, 30.0, 20.0, 10.0, 5.0),
    "c": (90.0, 60.0, 30.0, 15.0, 10.0),
    "v": (180.0, 120.0, 60.0, 30.0, 20.0),
}
"""Minutes of arc, plus and minus."""
ROUNDING = 1e-9
"""A length that is more than the end of a range by this part is that end."""


def length_deviation(grade: str, length: float) -> float | None:
    """The deviation (m), plus and minus, of a length (m) in class f, m, c or v; None where the table has none.

    >>> length_deviation("m", 0.066)
    0.0003
    """
    size = abs(length) * 1e3 * (1.0 - ROUNDING)
    step = bisect_left(LENGTH_STEPS, size)
    if size < LEAST_LENGTH * (1.0 - 2.0 * ROUNDING) or step == len(LENGTH_STEPS):
        return None
    found = LENGTH_DEVIATIONS[grade][step]
    return None if found is None else found / 1e3


def angle_deviation(grade: str, side: float) -> float:
    """The deviation (rad), plus and minus, of an angle whose shorter side is as long (m)."""
    found = ANGLE_DEVIATIONS[grade][bisect_left(SIDE_STEPS, abs(side) * 1e3 * (1.0 - ROUNDING))]
    return found / 60.0 * pi / 180.0
