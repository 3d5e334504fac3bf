"""Senses and amounts in words, as a textbook says them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import atan2, hypot, pi

from planar.foundation.arrays import Array
from planar.foundation.errors import join_names as several
from planar.model.file_units import FileUnits, display_unit

REST_TOLERANCE = 1e-12
"""A rate below this part of the greatest of its kind is at rest: what rounding leaves of none."""
AT_REST, NOT_TURNING = "at rest", "does not turn"
"""The senses of a point and of a link without a velocity; a link that does not turn may move along a line."""
STEADY_TOLERANCE = 1e-9
"""A speed that changes by less than this part of what it could is steady."""


def amount(value: float, kind: str, units: FileUnits, beside: float = 0.0) -> str:
    """A quantity (SI) in the unit in which its kind is shown beside those of a mechanism's file, with that unit.

    It is 0 where it is round-off of another of its kind `beside` it.
    """
    name, of = display_unit(kind, units)
    shown = f"{of.from_si(value if abs(value) > REST_TOLERANCE * abs(beside) else 0.0):.6g}"
    return shown if name == "1" else f"{shown} {name}"


def sentence(phrase: str) -> str:
    """A phrase as a sentence: its first letter capital, and a full stop at its end."""
    return f"{phrase[:1].upper()}{phrase[1:]}."


def turning_sense(rate: float, scale: float = 0.0) -> str:
    """The sense of an angular rate, beside the greatest of its kind."""
    if abs(rate) <= REST_TOLERANCE * scale:
        return NOT_TURNING
    return "anticlockwise" if rate > 0.0 else "clockwise"


def direction_sense(vector: Sequence[float] | Array, scale: float = 0.0) -> str:
    """The sense of a vector, beside the greatest of its kind: one of four ways along an axis, else two together."""
    x, y = float(vector[0]), float(vector[1])
    if hypot(x, y) <= REST_TOLERANCE * scale:
        return AT_REST
    sector = round(atan2(y, x) / (pi / 4)) % 8
    across = "to the right" if x > 0 else "to the left"
    along = "upwards" if y > 0 else "downwards"
    if min(abs(x), abs(y)) <= 1e-6 * max(abs(x), abs(y)):
        return (across, "", along, "", across, "", along, "")[sector]
    return f"{along}, {across}" if abs(y) > abs(x) else f"{across}, {along}"


def speed_trend(power: float, scale: float = 0.0) -> str:
    """Whether speed grows, from the product of velocity and acceleration, beside the greatest that it could be."""
    if abs(power) <= STEADY_TOLERANCE * scale:
        return "steady"
    return "speeding up" if power > 0.0 else "slowing down"


def count_phrase(count: int, what: str, plural: str = "") -> str:
    """So many of something: 1 way, 2 ways."""
    return f"{count} {what if count == 1 else plural or what + 's'}"


def join_all_names(names: Sequence[str]) -> str:
    """All names in a sentence: a, b and c. Where they may be very many, see `errors.listed`."""
    return several(names, None)


def quote_names(names: Sequence[str]) -> str:
    """The first of names, in quotes, and how many more there are."""
    return several([repr(name) for name in names])


def number_ranges(numbers: Iterable[int]) -> str:
    """Numbers in a sentence, three or more in a row by their ends: 1–4, 7 and 9."""
    runs: list[list[int]] = []
    for number in sorted({*numbers}):
        if runs and number == runs[-1][-1] + 1:
            runs[-1].append(number)
        else:
            runs.append([number])
    short = [run for run in runs if len(run) > 2]
    parts = [(run[0], f"{run[0]}–{run[-1]}") for run in short]
    parts += [(number, str(number)) for run in runs if run not in short for number in run]
    return join_all_names([text for _, text in sorted(parts)])
