"""The factor of a load at a position of an input, or at a time."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.model.loads import Course
from planar.model.mechanism import Mechanism, relative_motions


def load_factors(mechanism: Mechanism, inputs: Mapping[str, Array], time: Array | None, many: int) -> Array:
    """What every load is multiplied by at positions of the inputs, or at times (n, loads)."""
    found = np.ones((many, len(mechanism.loads)))
    for k, load in enumerate(mechanism.loads):
        if load.varies is not None:
            named = load.varies.input
            at = (np.zeros(many) if time is None else time) if named is None else inputs[named]
            turns = named is not None and relative_motions(mechanism)[named].input_quantity_kinds()[0] == "angle"
            found[:, k] = interpolate_factor(load.varies, np.broadcast_to(at, (many,)), turns)
    return found


def interpolate_factor(course: Course, at: Array, is_angle: bool) -> Array:
    """The factor at places (n,): straight between those that are given."""
    places, span = np.array(course.at), course.at[-1] - course.at[0]
    if is_angle and abs(span - 2.0 * np.pi) < 1e-9:
        at = places[0] + np.mod(at - places[0], 2.0 * np.pi)
    return np.interp(at, places, course.factors)


Places = Sequence[tuple[float, float]]
"""Where on its course each load that varies is, and how fast it goes there."""
PIECE_ROUNDING = 1e-9
"""Of all places of a course: nearer to the end of a piece is at its end."""


class CoursePiece(NamedTuple):
    """A straight piece of a course between two places, which may be endless: `factor` at `place`, and its slope."""

    low: float
    high: float
    place: float
    factor: float
    slope: float
    rounding: float

    def factor_at(self, at: float) -> float:
        """The factor at a place, beyond its ends as well."""
        return self.factor + self.slope * (at - self.place)

    def side_left(self, at: float) -> int:
        """Whether a place is above (1) or below (-1) the piece, or on it (0)."""
        return int(at > self.high + self.rounding) - int(at < self.low - self.rounding)


def course_piece(course: Course, at: float, sense: float, is_angle: bool) -> CoursePiece:
    """The piece on which a place lies; where two meet the one that comes next in a sense (1 or -1)."""
    places, factors = course.at, course.factors
    span = places[-1] - places[0]
    rounding = PIECE_ROUNDING * span
    beside = at + 2.0 * sense * rounding
    off = 0.0
    if is_angle and abs(span - 2.0 * np.pi) < 1e-9:
        off = 2.0 * np.pi * float(np.floor((beside - places[0]) / (2.0 * np.pi)))
    after = int(np.searchsorted(places, beside - off, side="right"))
    if after == 0 or after == len(places):
        low, high = (-np.inf, places[0]) if after == 0 else (places[-1], np.inf)
        return CoursePiece(low, high, 0.0, factors[0 if after == 0 else -1], 0.0, rounding)
    low, high = places[after - 1], places[after]
    slope = (factors[after] - factors[after - 1]) / (high - low)
    return CoursePiece(low + off, high + off, low + off, factors[after - 1], slope, rounding)


def first_kink(
    pieces: Sequence[CoursePiece],
    times: tuple[float, float],
    ends: tuple[Places, Places],
    places: Callable[[float], Places],
) -> float | None:
    """When between two times, at whose `ends` the places are known, a load first leaves its piece; None if none."""
    from scipy.optimize import brentq, minimize_scalar  # slow to load, and only needed here

    found: list[float] = []
    for k, (piece, (was, rate), (at, rate_then)) in enumerate(zip(pieces, *ends, strict=True)):
        side, until = piece.side_left(at), times[1]
        if not side and rate * rate_then < 0.0:  # it turns round between, and may have been beyond
            way = -1.0 if rate > 0.0 else 1.0
            turned = minimize_scalar(
                lambda time, k=k, way=way: way * places(time)[k][0], bounds=times, method="bounded"
            )
            until = float(turned.x)
            side = piece.side_left(places(until)[k][0])
        if not side:
            continue
        edge = piece.high if side > 0 else piece.low
        if side * (was - edge) >= 0.0:
            return times[0]
        found.append(
            float(
                brentq(lambda time, k=k, edge=edge: places(time)[k][0] - edge, times[0], until, xtol=1e-300, rtol=1e-15)
            )
        )
    return min(found, default=None)
