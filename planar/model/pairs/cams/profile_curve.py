"""A closed curve through points: the periodic cubic spline over the lengths of their chords."""

from __future__ import annotations

from functools import lru_cache
from math import degrees, pi
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.jets import Jet, Scalar
from planar.model.pairs.cams.lift_law import MAX_PROFILE_POINTS, MIN_PROFILE_POINTS

SAMPLES_PER_CHORD = 8
"""Of a curve, where it is looked at as a whole."""
HOLLOW_TOLERANCE = 1e-6
"""Of the curvature of a circle as large as the profile: what is less hollow is straight but for rounding."""


class ProfileCurve(NamedTuple):
    """A closed curve of n cubic pieces: `knots` (n + 1,) from 0 up to its whole length, and `coefficients` (4, n, 2) by
    powers of the way from the knot before, in m, that of the power 0 first."""

    knots: Array
    coefficients: Array

    def at(self, parameter: Scalar) -> tuple[Scalar, Scalar]:
        """x and y at a parameter (any shape) or a jet of one, taken round the curve as often as need be."""
        value = np.asarray(parameter.parts[0] if isinstance(parameter, Jet) else parameter, dtype=float)
        round_ = float(self.knots[-1])
        turns = np.floor(value / round_) * round_
        k = np.clip(np.searchsorted(self.knots, value - turns, side="right") - 1, 0, len(self.knots) - 2)
        way = parameter - (turns + self.knots[k])
        a = self.coefficients[:, k]
        x, y = (
            ((a[3, ..., axis] * way + a[2, ..., axis]) * way + a[1, ..., axis]) * way + a[0, ..., axis]
            for axis in (0, 1)
        )
        return x, y

    def samples(self, per_chord: int = SAMPLES_PER_CHORD) -> Array:
        """Parameters at so many places of every piece (m,)."""
        part = np.arange(per_chord) / per_chord
        found: Array = (self.knots[:-1, None] + np.diff(self.knots)[:, None] * part).ravel()
        return found

    def curvature(self, parameter: Array) -> Array:
        """The curvature (1/m), positive where the curve bends to the left."""
        one = np.ones_like(parameter)
        x, y = self.at(Jet(parameter, one, 0.0 * one))
        _, x1, x2 = x.parts
        _, y1, y2 = y.parts
        found: Array = (x1 * y2 - y1 * x2) / np.hypot(x1, y1) ** 3
        return found

    @property
    def least_radius(self) -> float:
        """The least distance of the curve from the origin (m)."""
        at = self.samples()
        best = at[np.argmin(np.hypot(*self.at(at)))]
        for _ in range(6):  # of half the square of the distance, Newton's steps
            x, y = self.at(Jet(best, 1.0, 0.0))
            half = (x * x + y * y) * 0.5
            step = half.parts[1] / half.parts[2] if half.parts[2] > 0.0 else 0.0
            best = best - step
        return float(np.hypot(*self.at(best)))


@lru_cache(maxsize=64)
def profile_curve(points: tuple[tuple[float, float], ...]) -> ProfileCurve:
    """The curve through points (m): twice differentiable also where it closes (C. de Boor, A Practical Guide to
    Splines, Springer 2001, ch. IV; by chord lengths its error goes with the fourth power of their distance)."""
    at = np.array(points, dtype=float)
    way = np.roll(at, -1, axis=0) - at
    h = np.hypot(*way.T)
    n, before = len(at), np.roll(h, 1)
    slope = way / h[:, None]
    rows = np.zeros((n, n))
    k = np.arange(n)
    rows[k, k] = 2.0 * (h + before)
    rows[k, (k - 1) % n] += before
    rows[k, (k + 1) % n] += h
    bend = np.linalg.solve(rows, 6.0 * (slope - np.roll(slope, 1, axis=0)))  # the second derivatives at the points
    after, h = np.roll(bend, -1, axis=0), h[:, None]
    coefficients = np.stack([at, slope - h * (2.0 * bend + after) / 6.0, 0.5 * bend, (after - bend) / (6.0 * h)])
    return ProfileCurve(np.concatenate([[0.0], np.cumsum(h)]), coefficients)


def find_profile_problem(points: tuple[tuple[float, float], ...]) -> tuple[str, str] | None:
    """The place within the list of points that can be no profile, as "[3]", and why."""
    if not MIN_PROFILE_POINTS <= len(points) <= MAX_PROFILE_POINTS:
        return "", f"a profile has from {MIN_PROFILE_POINTS} to {MAX_PROFILE_POINTS} points, not {len(points)}"
    at = np.array(points, dtype=float)
    apart = np.hypot(*(at - np.roll(at, 1, axis=0)).T)
    size = float(np.hypot(*at.T).max())
    if not apart.min() > 1e-9 * size:
        return f"[{int(np.argmin(apart))}]", "this point is the one before it again"
    curve = profile_curve(points)
    x, y = curve.at(curve.samples())
    nearest = int(np.argmin(np.hypot(x, y)))
    turned = np.diff(np.unwrap(np.arctan2(np.append(y, y[0]), np.append(x, x[0]))))
    whole = round(float(turned.sum()) / (2.0 * pi))
    if whole == -1:
        return "", "the points go round the cam clockwise; they are wanted anticlockwise"
    if whole != 1 or not np.hypot(x, y)[nearest] > 1e-9 * size:
        return f"[{nearest // SAMPLES_PER_CHORD}]", "the profile does not go once round the cam's centre"
    if turned.min() > 0.0:
        return None
    crossed = _find_crossing(curve)
    return None if crossed is None else (f"[{crossed}]", "the profile meets itself after this point")


def _find_crossing(curve: ProfileCurve) -> int | None:
    """The number of a point after which straight pieces of the curve cross others; None where none do."""
    per = 4
    x, y = curve.at(curve.samples(per))
    start = x + 1j * y
    way = np.roll(start, -1) - start
    many = len(start)
    for k in range(many):
        other = np.arange(k + 2, many if k else many - 1)
        if not len(other):
            continue
        apart = start[other] - start[k]
        turn = (np.conj(way[k]) * way[other]).imag
        with np.errstate(divide="ignore", invalid="ignore"):
            here = (np.conj(apart) * way[other]).imag / turn
            there = (np.conj(apart) * way[k]).imag / turn
        if np.any((here >= 0.0) & (here < 1.0) & (there >= 0.0) & (there < 1.0)):
            return k // per
    return None


def find_hollow(points: tuple[tuple[float, float], ...]) -> tuple[int, float] | None:
    """The number of the point where a profile is hollow most, about, and its angle (deg); None where it is convex."""
    curve = profile_curve(points)
    at = curve.samples()
    bend = curve.curvature(at)
    size = max(np.hypot(*each) for each in points)
    worst = int(np.argmin(bend))
    if not bend[worst] < -HOLLOW_TOLERANCE / size:
        return None
    x, y = curve.at(at[worst])
    nearest = round(worst / SAMPLES_PER_CHORD) % len(points)
    return nearest, degrees(float(np.arctan2(y, x)))
