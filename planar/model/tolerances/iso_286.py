"""Fits of holes and shafts: limit deviations of tolerance classes, as H7 and g6.

ISO 286-1:2010, tables 1 (standard tolerances) and 2 to 5 (fundamental deviations), for diameters up to 500 mm: holes C
to H and JS in grades 4 to 13, shafts c to s, js. Holes J to ZC, whose rule has exceptions, are not among them.
"""

from __future__ import annotations

import re
from bisect import bisect_left
from typing import NamedTuple

MAIN_STEPS = (3, 6, 10, 18, 30, 50, 80, 120, 180, 250, 315, 400, 500)
"""mm: each range of diameters goes up to and with this one."""
FINE_STEPS = (3, 6, 10, 18, 30, 40, 50, 65, 80, 100, 120, 140, 160, 180, 200, 225, 250, 280, 315, 355, 400, 450, 500)
"""mm: those of shafts a to c and r to zc."""
GRADES: dict[int, tuple[int, ...]] = {
    4: (3, 4, 4, 5, 6, 7, 8, 10, 12, 14, 16, 18, 20),
    5: (4, 5, 6, 8, 9, 11, 13, 15, 18, 20, 23, 25, 27),
    6: (6, 8, 9, 11, 13, 16, 19, 22, 25, 29, 32, 36, 40),
    7: (10, 12, 15, 18, 21, 25, 30, 35, 40, 46, 52, 57, 63),
    8: (14, 18, 22, 27, 33, 39, 46, 54, 63, 72, 81, 89, 97),
    9: (25, 30, 36, 43, 52, 62, 74, 87, 100, 115, 130, 140, 155),
    10: (40, 48, 58, 70, 84, 100, 120, 140, 160, 185, 210, 230, 250),
    11: (60, 75, 90, 110, 130, 160, 190, 220, 250, 290, 320, 360, 400),
    12: (100, 120, 150, 180, 210, 250, 300, 350, 400, 460, 520, 570, 630),
    13: (140, 180, 220, 270, 330, 390, 460, 540, 630, 720, 810, 890, 970),
}
"""um: the width of the tolerance of each grade IT."""
UPPER_DEVIATIONS: dict[str, tuple[int, ...]] = {
    "c": (
        60,
        70,
        80,
        95,
        110,
        120,
        130,
        140,
        150,
        170,
        180,
        200,
        210,
        230,
        240,
        260,
        280,
        300,
        330,
        360,
        400,
        440,
        480,
    ),
    "d": (20, 30, 40, 50, 65, 80, 100, 120, 145, 170, 190, 210, 230),
    "e": (14, 20, 25, 32, 40, 50, 60, 72, 85, 100, 110, 125, 135),
    "f": (6, 10, 13, 16, 20, 25, 30, 36, 43, 50, 56, 62, 68),
    "g": (2, 4, 5, 6, 7, 9, 10, 12, 14, 15, 17, 18, 20),
    "h": (0,) * 13,
}
"""um: how far below the diameter the upper deviation es of a shaft lies; holes lie as far above it (EI)."""
LOWER_DEVIATIONS: dict[str, tuple[int, ...]] = {
    "k": (0, 1, 1, 1, 2, 2, 2, 3, 3, 4, 4, 4, 5),
    "m": (2, 4, 6, 7, 8, 9, 11, 13, 15, 17, 20, 21, 23),
    "n": (4, 8, 10, 12, 15, 17, 20, 23, 27, 31, 34, 37, 40),
    "p": (6, 12, 15, 18, 22, 26, 32, 37, 43, 50, 56, 62, 68),
    "r": (10, 15, 19, 23, 28, 34, 34, 41, 43, 51, 54, 63, 65, 68, 77, 80, 84, 94, 98, 108, 114, 126, 132),
    "s": (14, 19, 23, 28, 35, 43, 43, 53, 59, 71, 79, 92, 100, 108, 122, 130, 140, 158, 170, 190, 208, 232, 252),
}
"""um: how far above the diameter the lower deviation ei of a shaft lies; of k in grades 4 to 7, else 0."""
K_GRADES = range(4, 8)
HOLES = ("C", "D", "E", "F", "G", "H", "JS")
SHAFTS = (*UPPER_DEVIATIONS, "js", *LOWER_DEVIATIONS)
_FIT = re.compile(r"\s*([A-Za-z]{1,2})(\d{1,2})\s*/\s*([A-Za-z]{1,2})(\d{1,2})\s*")


class FitError(ValueError):
    """A fit that is none, or that the tables do not have, as a sentence."""


class Fit(NamedTuple):
    """The letters and grades of a hole and a shaft."""

    hole: str
    hole_grade: int
    shaft: str
    shaft_grade: int

    def __str__(self) -> str:
        return f"{self.hole}{self.hole_grade}/{self.shaft}{self.shaft_grade}"


def parse_fit(text: str) -> Fit:
    """A fit such as "H7/g6". Raises FitError."""
    found = _FIT.fullmatch(text)
    if found is None:
        raise FitError(f"{text!r:.40} is no fit, such as 'H7/g6': a hole's letter and grade, then a shaft's")
    hole, shaft = found[1], found[3]
    if hole not in HOLES:
        raise FitError(f"of holes {', '.join(HOLES)} are known, and no {hole!r}")
    if shaft not in SHAFTS:
        raise FitError(f"of shafts {', '.join(SHAFTS)} are known, and no {shaft!r}")
    for grade in (found[2], found[4]):
        if int(grade) not in GRADES:
            raise FitError(f"grades {min(GRADES)} to {max(GRADES)} are known, and no {grade}")
    return Fit(hole, int(found[2]), shaft, int(found[4]))


def hole_deviations(letter: str, grade: int, diameter: float) -> tuple[float, float]:
    """The lower and upper deviation EI and ES (m) of a hole of a diameter (m). Raises FitError.

    >>> hole_deviations("H", 7, 0.02)
    (0.0, 2.1e-05)
    """
    width = _grade_width(grade, diameter)
    if letter == "JS":
        return -0.5 * width / 1e6, 0.5 * width / 1e6
    low = _at_diameter(UPPER_DEVIATIONS[letter.lower()], diameter)
    return low / 1e6, (low + width) / 1e6


def shaft_deviations(letter: str, grade: int, diameter: float) -> tuple[float, float]:
    """The lower and upper deviation ei and es (m) of a shaft of a diameter (m). Raises FitError."""
    width = _grade_width(grade, diameter)
    if letter == "js":
        return -0.5 * width / 1e6, 0.5 * width / 1e6
    if letter in UPPER_DEVIATIONS:
        high = -_at_diameter(UPPER_DEVIATIONS[letter], diameter)
        return (high - width) / 1e6, high / 1e6
    low = 0 if letter == "k" and grade not in K_GRADES else _at_diameter(LOWER_DEVIATIONS[letter], diameter)
    return low / 1e6, (low + width) / 1e6


def greatest_clearance(fit: Fit, diameter: float) -> float:
    """How far the centres of hole and shaft can stand apart (m): half of ES - ei. Raises FitError."""
    _, widest = hole_deviations(fit.hole, fit.hole_grade, diameter)
    thinnest, _ = shaft_deviations(fit.shaft, fit.shaft_grade, diameter)
    if widest - thinnest <= 0.0:
        raise FitError(f"the fit {fit} leaves no clearance at {diameter * 1e3:g} mm, so the pin would not turn")
    return 0.5 * (widest - thinnest)


def _grade_width(grade: int, diameter: float) -> int:
    return _at_diameter(GRADES[grade], diameter)


def _at_diameter(values: tuple[int, ...], diameter: float) -> int:
    size = diameter * 1e3
    steps = FINE_STEPS if len(values) == len(FINE_STEPS) else MAIN_STEPS
    index = bisect_left(steps, size * (1.0 - 1e-9))
    if not size > 0.0 or index == len(steps):
        raise FitError(f"fits are known for diameters up to {steps[-1]} mm, and this pin's is {size:g} mm")
    return values[index]
