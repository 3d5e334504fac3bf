"""Functions that may jump or bend at some places, as Chebyshev series on the smooth pieces between them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from math import ceil
from typing import NamedTuple

import numpy as np
from numpy.polynomial import chebyshev

from planar.foundation.arrays import Array, BoolArray

NODE_COUNT = 16
"""Values of the function on each piece; the series has as many terms."""
SERIES_TOLERANCE = 1e-11
"""Last terms of a series, beside the greatest value of the function, when the series has converged."""
NOISE_TOLERANCE, HALVING_GAIN = 1e-8, 0.25
"""Last terms that are rounding errors of the function: below this, and not less than this part of those on the piece
twice as long."""
SHORTEST_PIECE_RATIO = 1e-12
"""Of the whole range: a piece that has not converged at this length contains a jump."""
JOINT_TOLERANCE, JOINT_RATIO = 1e-9, 0.01
"""Two pieces meet that differ at their joint by less than this part of the scale. A hidden jump lies within this part
of the shorter piece from the joint, because the outermost node is nearer to the end."""
LONGEST_PIECE_RATIO = 1.0 / 6.0
"""Of the range: a longer piece could have features between its nodes."""
MAX_ENCLOSURES = 40
POLE_PIECE_RATIO, POLE_GROWTH = 1e-4, 100.0
"""Near a pole pieces are shorter than this part of the range, and values greater by this factor than on long pieces."""
LONG_PIECE_RATIO = 1e-2
"""Of the range: a longer piece is far from a pole."""
MAX_PIECES_AT_ONCE = 1000
"""Pieces in one generation of halving; a function that needs more has no series."""
TIE_TOLERANCE = 1e-9
"""Of the greatest value: extreme values that are nearer to each other are equal, and the first place counts."""
REAL_ROOT_TOLERANCE = 1e-8
"""Parts of a piece: the imaginary part of a root, or its distance beyond the end of the piece, that is rounding."""
_NODES = chebyshev.chebpts1(NODE_COUNT)
_FIT = np.linalg.inv(chebyshev.chebvander(_NODES, NODE_COUNT - 1))


class SeriesExtreme(NamedTuple):
    """An extreme value of a column, its place, and all columns there (columns,), on the side of its piece."""

    place: float
    value: float
    columns: Array


class SeriesPiece(NamedTuple):
    """A smooth piece between two places: Chebyshev coefficients (terms, columns)."""

    low: float
    high: float
    coefficients: Array

    def evaluate(self, x: Array) -> Array:
        """Values (n, columns) at places (n,) of this piece."""
        return np.asarray(chebyshev.chebval(self._local(x), self.coefficients)).T

    def integral(self, low: float, x: Array, column: int) -> Array:
        """The integral of a column from `low` to places (n,), all within this piece."""
        antiderivative = chebyshev.chebint(self.coefficients[:, column]) * 0.5 * (self.high - self.low)
        ends = chebyshev.chebval(self._local(np.append(low, x)), antiderivative)
        return np.asarray(ends[1:] - ends[0])

    def roots(self, coefficients: Array) -> Array:
        """The places in this piece where a series of this piece is zero, in their order."""
        if np.abs(coefficients[1:]).sum() < abs(coefficients[0]) or not coefficients[1:].any():
            return np.zeros(0)
        terms = np.abs(coefficients)
        significant = np.flatnonzero(terms > 1e-15 * terms.max())[-1]
        roots = chebyshev.chebroots(coefficients[: significant + 1])
        real = roots.real[np.abs(roots.imag) <= REAL_ROOT_TOLERANCE]
        inside = np.clip(real[np.abs(real) <= 1.0 + REAL_ROOT_TOLERANCE], -1.0, 1.0)
        return np.sort(self.low + 0.5 * (inside + 1.0) * (self.high - self.low))

    def level_roots(self, column: int, level: float) -> Array:
        """The places in this piece where a column has a value."""
        shifted = self.coefficients[:, column].copy()
        shifted[0] -= level
        return self.roots(shifted)

    def critical_places(self, column: int) -> Array:
        """The ends of this piece, and the places between them where the derivative of a column is zero."""
        flat = self.roots(chebyshev.chebder(self.coefficients[:, column]))
        return np.concatenate([[self.low], flat, [self.high]])

    def _local(self, x: Array) -> Array:
        local: Array = np.clip((2.0 * np.asarray(x) - self.low - self.high) / (self.high - self.low), -1.0, 1.0)
        return local


class PiecewiseSeries(NamedTuple):
    """A function (places) -> (columns) on smooth pieces in their order.

    `scale` (columns,) are its greatest absolute values, or `least_scale` where that is greater, see `fit_series`.

    Between two pieces the function may jump. A gap between them, longer than rounding, is a part of the range where
    the function has no finite values.
    """

    pieces: tuple[SeriesPiece, ...]
    low: float
    high: float
    scale: Array

    @property
    def has_gaps(self) -> bool:
        """Whether the function is unknown in a part of the range."""
        if not self.pieces:
            return True
        known = sum(piece.high - piece.low for piece in self.pieces)
        jumps = 1e3 * SHORTEST_PIECE_RATIO * (len(self.pieces) + 1)
        return bool(known < (self.high - self.low) * (1.0 - jumps))

    def integral(self, column: int = 0) -> float:
        """The integral of a column over the range."""
        return float(sum(piece.integral(piece.low, np.array([piece.high]), column)[0] for piece in self.pieces))

    def positive_integral(self, column: int = 0) -> float:
        """The integral of the positive part of a column over the range."""
        total = 0.0
        for piece in self.pieces:
            ends = np.concatenate([[piece.low], piece.level_roots(column, 0.0), [piece.high]])
            total += sum(
                max(float(piece.integral(low, np.array([high]), column)[0]), 0.0) for low, high in pairwise(ends)
            )
        return total

    def running_integral(self, places: Array, column: int = 0) -> Array:
        """The integral of a column from the start of the range to places (n,)."""
        totals = np.zeros(len(places))
        for piece in self.pieces:
            totals += piece.integral(piece.low, np.clip(places, piece.low, piece.high), column)
        return totals

    def crossings(self, level: float = 0.0, column: int = 0) -> Array:
        """The places where a column passes a value, also by a jump from one piece to the next, in their order."""
        places: list[float] = []
        before: float | None = None
        for piece in self.pieces:
            first, last = (float(piece.evaluate(np.array([end]))[0, column]) - level for end in (piece.low, piece.high))
            if before is not None and before * first < 0.0:
                places.append(piece.low)
            places += piece.level_roots(column, level).tolist()
            before = last
        return np.unique(places)

    def intervals_below(self, level: float = 0.0, column: int = 0) -> Iterator[tuple[float, float]]:
        """The intervals in which a column is below a value; their ends are crossings or ends of the range."""
        start: float | None = None
        end = self.low
        shortest, below = (
            SHORTEST_PIECE_RATIO * (self.high - self.low),
            level - TIE_TOLERANCE * float(self.scale[column]),
        )
        for piece in self.pieces:
            ends = np.concatenate([[piece.low], piece.level_roots(column, level), [piece.high]])
            for low, high in pairwise(ends.tolist()):
                if high - low <= shortest:
                    continue
                is_below = bool(piece.evaluate(np.array([0.5 * (low + high)]))[0, column] < below)
                if is_below and start is None:
                    start = low
                elif not is_below and start is not None:
                    yield start, end
                    start = None
                end = high
        if start is not None:
            yield start, end

    def greatest(self, column: int = 0, sign: float = 1.0) -> SeriesExtreme:
        """The greatest value of a column (with `sign` -1 the least), and the first of its places.

        At a jump the value is that of one side.
        """
        critical = [piece.critical_places(column) for piece in self.pieces]
        places = np.concatenate(critical)
        values = np.vstack([piece.evaluate(part) for piece, part in zip(self.pieces, critical, strict=True)])
        signed = sign * values[:, column]
        first = int(np.argmax(signed >= signed.max() - TIE_TOLERANCE * self.scale[column]))
        return SeriesExtreme(float(places[first]), float(sign * signed.max()), values[first])

    def smallest(self, column: int = 0) -> SeriesExtreme:
        """The least value of a column, and the first of its places."""
        return self.greatest(column, -1.0)


def fit_series(
    function: Callable[[Array], Array], ends: Sequence[float], least_scale: Array | float = 0.0
) -> PiecewiseSeries | None:
    """The series of a function (n,) -> (n, columns) between places in their order, where it may jump or bend.

    Its errors are judged beside the greatest value of each column, or beside `least_scale` (columns,) where that is
    greater: a column that is rounding alone has no series of its own.

    The function is asked for values inside pieces only, never at their ends, so that each piece has the values of its
    side. A piece is halved until its series converges, and where two halves do not meet, the jump or bend that `ends`
    do not name is enclosed more and more closely (Z. Battles and L. N. Trefethen, An extension of MATLAB to continuous
    functions and operators, SIAM J. Sci. Comput. 25, 2004; R. Pachón, R. B. Platte and L. N. Trefethen,
    Piecewise-smooth chebfuns, IMA J. Numer. Anal. 30, 2010). Parts without finite values are gaps. None where too many
    pieces do not converge, or where a column grows without bound.
    """
    fit = _Fit(function, (float(ends[0]), float(ends[-1])), least_scale)
    longest = LONGEST_PIECE_RATIO * (fit.high - fit.low)
    pieces: list[_OpenPiece] = []
    for low, high in pairwise(ends):
        parts = np.linspace(low, high, max(1, ceil((high - low) / longest)) + 1).tolist()
        pieces += [_OpenPiece(*part, np.inf) for part in pairwise(parts) if high - low > fit.shortest]
    known = set(ends)
    for _ in range(MAX_ENCLOSURES):
        if not fit.add(pieces):
            return None
        pieces = fit.open_joints(known)
        if not pieces:
            break
    return PiecewiseSeries(tuple(fit.pieces), fit.low, fit.high, fit.scale)


class _OpenPiece(NamedTuple):
    """A piece without a series, and the last terms of that on the piece twice as long, beside the scale."""

    low: float
    high: float
    parent_error: float


class _Fit:
    """The pieces of a function that have converged, and the greatest values that it had (columns,)."""

    def __init__(self, function: Callable[[Array], Array], ends: tuple[float, float], least_scale: Array | float):
        self.function, (self.low, self.high) = function, ends
        self.shortest = SHORTEST_PIECE_RATIO * (self.high - self.low)
        self.pieces: list[SeriesPiece] = []
        self.least_scale: Array = np.atleast_1d(np.asarray(least_scale, dtype=float))
        self.scale: Array = self.least_scale

    def add(self, pieces: list[_OpenPiece]) -> bool:
        """Fit pieces, halved until they converge; False where they are too many, or about a pole."""
        while pieces:
            if len(pieces) > MAX_PIECES_AT_ONCE or self._has_pole(pieces):
                return False
            nodes = np.array([piece.low + 0.5 * (1.0 + _NODES) * (piece.high - piece.low) for piece in pieces])
            values = np.asarray(self.function(nodes.ravel()), dtype=float).reshape(*nodes.shape, -1)
            is_finite: BoolArray = np.isfinite(values).all(axis=2)
            self.scale = np.maximum(self.scale, np.abs(values[is_finite]).max(axis=0, initial=0.0))
            rows = zip(pieces, values, is_finite, strict=True)
            pieces = [half for row in rows for half in self._fit_or_halve(*row)]
        self.pieces.sort(key=lambda piece: piece.low)
        return True

    def _has_pole(self, pieces: list[_OpenPiece]) -> bool:
        """Whether a column has grown by much on its way to very short pieces."""
        span = self.high - self.low
        if min(piece.high - piece.low for piece in pieces) > POLE_PIECE_RATIO * span:
            return False
        long = [piece for piece in self.pieces if piece.high - piece.low >= LONG_PIECE_RATIO * span]
        sizes = [np.abs(piece.coefficients).sum(axis=0) for piece in long]
        typical = np.max([*sizes, np.broadcast_to(self.least_scale, self.scale.shape)], axis=0)
        return bool(long) and bool((self.scale > POLE_GROWTH * typical).any())

    def _fit_or_halve(self, piece: _OpenPiece, values: Array, is_finite: BoolArray) -> Iterator[_OpenPiece]:
        low, high, parent_error = piece
        if not is_finite.any():
            return
        error = np.inf
        if is_finite.all():
            coefficients = _FIT @ values
            tail = np.abs(coefficients[-2:]).max(axis=0)
            error = float(np.max(tail / np.where(self.scale > 0.0, self.scale, 1.0), initial=0.0))
            if error <= SERIES_TOLERANCE or HALVING_GAIN * parent_error < error <= NOISE_TOLERANCE:
                self.pieces.append(SeriesPiece(low, high, coefficients))
                return
        if high - low > 2.0 * self.shortest:
            middle = 0.5 * (low + high)
            yield _OpenPiece(low, middle, error)
            yield _OpenPiece(middle, high, error)

    def open_joints(self, known: set[float]) -> list[_OpenPiece]:
        """Short pieces about the joints at which two pieces do not meet, and the rest of those two; taken out here.

        Between its outermost node and its end a piece does not see a jump or a bend.
        """
        opened: list[_OpenPiece] = []
        removed: set[int] = set()
        for k, (before, after) in enumerate(pairwise(self.pieces)):
            place, reach = before.high, JOINT_RATIO * min(before.high - before.low, after.high - after.low)
            if after.low != place or place in known or reach < self.shortest or removed & {k, k + 1}:
                continue
            step = np.abs(before.evaluate(np.array([place])) - after.evaluate(np.array([place])))[0]
            if (step > JOINT_TOLERANCE * self.scale).any():
                places = before.low, place - reach, place + reach, after.high
                opened += [_OpenPiece(*part, np.inf) for part in pairwise(places)]
                removed |= {k, k + 1}
        self.pieces = [piece for k, piece in enumerate(self.pieces) if k not in removed]
        return opened
