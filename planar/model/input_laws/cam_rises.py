"""Rises of cams: from rest to rest, a half of each written once for a way and a time of one.

The laws and their greatest rates are those of R. L. Norton, Cam Design and Manufacturing Handbook, 2nd ed.,
Industrial Press 2009, ch. 2 and 3.
"""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi
from typing import ClassVar

import numpy as np
from numpy.polynomial import Polynomial

from planar.foundation.arrays import Array, BoolArray
from planar.foundation.jets import Scalar, sin, value_between
from planar.model.input_laws.segment import LawSegment, SegmentKey


@dataclass(frozen=True)
class CamRise(LawSegment):
    """A way `by` from rest to rest.

    All rises here are symmetric, s(1 - x) = 1 - s(x): the first half says all, and both ends are exact.
    """

    duration: float
    by: float
    is_lift: ClassVar[bool] = True
    keys: ClassVar[Mapping[str, SegmentKey]] = {
        "by": SegmentKey("by", "position", "how far the input goes, from rest to rest"),
        "in": SegmentKey("duration", "time", "how long it takes"),
    }

    @abstractmethod
    def first_half(self, x: Array, is_mirrored: BoolArray) -> Array:
        """(4, n): s and its derivatives by x, for x (n,) between 0 and 1/2.

        Where a derivative jumps, it is what follows; what went before where `back` says so.
        """

    @abstractmethod
    def fraction(self, x: Scalar) -> Scalar:
        """The part of the way after the part x of the time, 0 to 1, in any arithmetic."""

    def evaluate(self, t: Array, velocity: float) -> Array:
        x = t / self.duration
        back = x > 0.5
        s = self.first_half(np.where(back, 1.0 - x, x), back)
        s[0] = np.where(back, 1.0 - s[0], s[0])
        s[2] = np.where(back, -s[2], s[2])
        return s * (self.by / self.duration ** np.arange(4.0))[:, None]

    def end_displacement_and_velocity(self, velocity: float) -> tuple[float, float]:
        return self.by, 0.0

    def start_velocity(self, velocity: float) -> float:
        return 0.0


class PolynomialRise(CamRise):
    """A polynomial in x."""

    coefficients: ClassVar[tuple[int, ...]]

    def first_half(self, x: Array, is_mirrored: BoolArray) -> Array:
        s = Polynomial(self.coefficients)
        return np.stack([s.deriv(k)(x) for k in range(4)])

    def fraction(self, x: Scalar) -> Scalar:
        found: Scalar = float(self.coefficients[-1])
        for coefficient in reversed(self.coefficients[:-1]):
            found = x * found + float(coefficient)
        return found


class Polynomial345Rise(PolynomialRise):
    """3-4-5: velocity and acceleration are zero at both ends. Greatest 1.875, 5.7735, 60 times by / duration^k."""

    motion = "3-4-5"
    description = "a rise by the polynomial 3-4-5: velocity and acceleration are zero at both ends"
    coefficients = (0, 0, 0, 10, -15, 6)


class Polynomial4567Rise(PolynomialRise):
    """4-5-6-7: jerk is zero at both ends too. Greatest 2.1875, 7.5132, 52.5 times by / duration^k."""

    motion = "4-5-6-7"
    description = "a rise by the polynomial 4-5-6-7: jerk is zero at both ends too"
    coefficients = (0, 0, 0, 0, 35, -84, 70, -20)


class CycloidalRise(CamRise):
    """Cycloidal: acceleration is a full sine. Greatest 2, 2 pi, 4 pi^2 times by / duration^k."""

    motion = "cycloidal"
    description = "a cycloidal rise: its acceleration is a full sine"

    def first_half(self, x: Array, is_mirrored: BoolArray) -> Array:
        turn = 2.0 * pi
        c, s = np.cos(turn * x), np.sin(turn * x)
        return np.stack([x - s / turn, 2.0 * np.sin(pi * x) ** 2, turn * s, turn**2 * c])

    def fraction(self, x: Scalar) -> Scalar:
        return x - sin(x * (2.0 * pi)) * (0.5 / pi)


class HarmonicRise(CamRise):
    """Simple harmonic: half a cosine, so acceleration jumps at both ends. Greatest pi/2, pi^2/2, pi^3/2."""

    motion = "harmonic"
    description = "a simple harmonic rise: its acceleration jumps at both ends"

    def first_half(self, x: Array, is_mirrored: BoolArray) -> Array:
        c, s = np.cos(pi * x), np.sin(pi * x)
        return np.stack([np.sin(0.5 * pi * x) ** 2, 0.5 * pi * s, 0.5 * pi**2 * c, -0.5 * pi**3 * s])

    def fraction(self, x: Scalar) -> Scalar:
        half = sin(x * (0.5 * pi))
        return half * half


class ParabolicRise(CamRise):
    """Parabolic: constant acceleration, then as much retardation. Greatest 2, 4 times by / duration^k."""

    motion = "parabolic"
    description = "a parabolic rise: constant acceleration for the first half, as much retardation for the second"

    def first_half(self, x: Array, is_mirrored: BoolArray) -> Array:
        return np.stack([2.0 * x**2, 4.0 * x, np.full_like(x, 4.0), np.zeros_like(x)])

    def fraction(self, x: Scalar) -> Scalar:
        rest = 1.0 + x * -1.0
        return value_between(x, None, 0.5, x * x * 2.0) + value_between(x, 0.5, None, rest * rest * -2.0 + 1.0)


@dataclass(frozen=True)
class RampedRise(CamRise):
    """Acceleration that comes up in a ramp, stays, goes down in a ramp, and does the same the other way.

    Each of the four ramps takes the part `ramp` of the time, 1/4 at most: the two ramps to the opposite
    acceleration join in the middle.
    """

    ramp: float = 0.125
    keys: ClassVar[Mapping[str, SegmentKey]] = {
        **CamRise.keys,
        "ramp": SegmentKey(
            "ramp",
            "number",
            "the part of the time that each of four ramps takes, 1/4 at most; left out: 1/8",
            is_required=False,
        ),
    }
    ramp_mean: ClassVar[float]
    "the mean of acceleration over a ramp, of its greatest"

    @abstractmethod
    def ramp_integrals(self, x: Array) -> Array:
        """(4, n): what acceleration sums to within a ramp, of height and length one: s, v, a, j over x (n,)."""

    @abstractmethod
    def ramp_way(self, x: Scalar) -> Scalar:
        """The first of these, s, in any arithmetic."""

    @property
    def greatest_acceleration(self) -> Scalar:
        """Of a way and a time of one: v(1/2) = a (1/2 - 2 b + 2 b mean), and s(1/2) = v(1/2) / 4 = 1/2."""
        return 2.0 / (0.5 - 2.0 * self.ramp + 2.0 * self.ramp * self.ramp_mean)

    def fraction(self, x: Scalar) -> Scalar:
        rest = 1.0 + x * -1.0
        second_half = value_between(x, 0.5, None, self._half_fraction(rest) * -1.0 + 1.0)
        return value_between(x, None, 0.5, self._half_fraction(x)) + second_half

    def _half_fraction(self, x: Scalar) -> Scalar:
        """The same for x up to 1/2."""
        a, b = self.greatest_acceleration, self.ramp
        height, start_speed = a * b * b, a * b * self.ramp_mean
        u, y = x + -b, 0.5 + x * -1.0
        start = self.ramp_way(1.0) * height
        rising = self.ramp_way(x * (1.0 / b)) * height
        flat = u * start_speed + u * u * (0.5 * a) + start
        falling = self.ramp_way(y * (1.0 / b)) * height + y * -2.0 + 0.5
        pieces = ((None, b, rising), (b, 0.5 - b, flat), (0.5 - b, None, falling))
        low, middle, high = (value_between(x, start, end, value) for start, end, value in pieces)
        return low + middle + high

    def first_half(self, x: Array, is_mirrored: BoolArray) -> Array:
        b, a = self.ramp, self.greatest_acceleration
        scale = (a * b ** np.array([2.0, 1.0, 0.0, -1.0]))[:, None]
        flat_from, flat_to = b, 0.5 - b

        def passed(edge: float) -> Array:
            return np.where(is_mirrored, x > edge, x >= edge)

        rising = self.ramp_integrals(np.minimum(x, flat_from) / b) * scale
        s0, v0 = (self.ramp_integrals(np.ones(1)) * scale)[:2, 0]
        u = np.clip(x - flat_from, 0.0, flat_to - flat_from)
        flat = np.stack([s0 + (v0 + 0.5 * a * u) * u, v0 + a * u, np.full_like(u, a), np.zeros_like(u)])
        # downwards, counted back from the middle: s = 1/2 - v(1/2) y + what a ramp upwards sums to over y
        y = np.clip(0.5 - x, 0.0, b)
        s, v, up, jerk = self.ramp_integrals(y / b) * scale
        falling = np.stack([0.5 - 2.0 * y + s, 2.0 - v, up, -jerk])
        return np.where(passed(flat_to), falling, np.where(passed(flat_from), flat, rising))

    def find_problem(self) -> tuple[str, str] | None:
        found = super().find_problem()
        if found is None and not 0.001 <= self.ramp <= 0.25:
            told = "each of the four ramps takes a part of the time from 0.001 to 0.25"
            return "ramp", f"{told}, not {float(self.ramp):g}"
        return found


class TrapezoidalRise(RampedRise):
    """Trapezoidal acceleration: straight ramps, so jerk is constant piece by piece.

    With ramps of 1/8: greatest 2, 16/3, 128/3 times by / duration^k.
    """

    motion = "trapezoidal"
    description = "a rise of trapezoidal acceleration: jerk is constant piece by piece"
    ramp_mean = 0.5

    def ramp_integrals(self, x: Array) -> Array:
        return np.stack([x**3 / 6.0, x**2 / 2.0, x, np.ones_like(x)])

    def ramp_way(self, x: Scalar) -> Scalar:
        return x * x * x * (1.0 / 6.0)


class ModifiedTrapezoidalRise(RampedRise):
    """Modified trapezoid: ramps are quarters of a sine (C. N. Neklutin, 1952); with ramps of 1/4 it is cycloidal.

    With ramps of 1/8: greatest 2, 4.888, 61.43 times by / duration^k.
    """

    motion = "modified trapezoidal"
    description = "a rise of modified trapezoidal acceleration, with ramps that are quarters of a sine"
    ramp_mean = 2.0 / pi

    def ramp_integrals(self, x: Array) -> Array:
        w = 0.5 * pi
        c, s = np.cos(w * x), np.sin(w * x)
        return np.stack([x / w - s / w**2, 2.0 * np.sin(0.5 * w * x) ** 2 / w, s, w * c])

    def ramp_way(self, x: Scalar) -> Scalar:
        w = 0.5 * pi
        return x * (1.0 / w) + sin(x * w) * (-1.0 / w**2)
