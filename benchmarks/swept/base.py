"""What a linkage whose dimensions are swept says of itself, so that every solver can be timed on it."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, ClassVar, NamedTuple

import numpy as np

from benchmarks.linkages.base import ALPHA, OMEGA, THETA

Array = np.ndarray

RATES = (OMEGA, ALPHA)
"""The crank's velocity and acceleration, rad/s and rad/s^2."""


class Dimension(NamedTuple):
    """A dimension by planar's name and its value (m) in the mechanism file."""

    name: str
    value: float


class Moving(NamedTuple):
    """A point's position, velocity and acceleration: pairs x, y of arrays (m, per s, per s^2)."""

    p: tuple[Array, Array]
    v: tuple[Array, Array]
    a: tuple[Array, Array]


class Swept(ABC):
    """A linkage with a crank that turns, and one point of it that is asked for."""

    name: ClassVar[str]
    limit: ClassVar[str]
    """The function of limit.c that solves it."""
    point: ClassVar[str]
    dimensions: ClassVar[tuple[Dimension, ...]]
    """In the order in which limit.c takes them."""
    dyadic: ClassVar[bool] = True
    """Whether it is solved dyad by dyad, in closed form."""
    only_turning: ClassVar[bool] = True
    """Whether all its pairs are turning pairs."""
    spread: ClassVar[float] = 0.05
    """By how much of itself a dimension varies from design to design."""

    @abstractmethod
    def document(self) -> dict[str, Any]:
        """The mechanism file (m, rad), at THETA with OMEGA and ALPHA."""

    @abstractmethod
    def motion(self, d: Array, theta: Array) -> Array:
        """The point (6, steps, designs) in the arithmetic of `d` (dimensions, designs), theta (steps,): x, y, rates."""

    def assemblies(self, d: Array, theta: Array) -> list[Array]:
        """As `motion`, of every assembly that somebody may take."""
        return [self.motion(d, theta)]

    def base(self) -> Array:
        """The file's own dimensions (dimensions,)."""
        return np.array([dimension.value for dimension in self.dimensions])

    def designs(self, many: int) -> Array:
        """Dimensions (dimensions, designs) up to `spread` of themselves away from the file's, evenly drawn."""
        drawn = np.random.default_rng(0).uniform(-self.spread, self.spread, (len(self.dimensions), many))
        return np.ascontiguousarray(self.base()[:, None] * (1.0 + drawn))

    def stops(self, d: Array, theta: Array) -> Array:
        """Which designs have stopped at a step, or before it (steps, designs)."""
        if not self.dyadic:
            return np.zeros((len(theta), d.shape[1]), dtype=bool)
        parts = np.array_split(d, max(1, d.shape[1] // 1000), axis=1)
        return np.hstack([np.isnan(self.motion(part, theta)[0]) for part in parts])

    def start(self, d: Array) -> Array | None:
        """From where Newton's iteration of limit.c sets out, where it has one."""
        return None


def angles(steps: int) -> Array:
    """The crank's angle (steps + 1,) over one turn, rad."""
    return THETA + 2.0 * np.pi * np.linspace(0.0, 1.0, steps + 1)


def crank_pin(r: Array, theta: Array) -> Moving:
    """The pin at r from the origin."""
    x, y = r * np.cos(theta), r * np.sin(theta)
    return Moving((x, y), (-OMEGA * y, OMEGA * x), (-ALPHA * y - OMEGA**2 * x, ALPHA * x - OMEGA**2 * y))


def fixed(x: Array, y: Array) -> Moving:
    """A point of the frame."""
    still = (0.0 * x, 0.0 * y)
    return Moving((x, y), still, still)


def dyad_pin(P: Moving, Q: Moving, b: Array, c: Array) -> Moving:
    """The pin b from P and c from Q, to the left of the way from P to Q; NaN where it is too far.

    Two circles intersect; the rates are those of the two squared distances, which do not change.
    """
    ex, ey = Q.p[0] - P.p[0], Q.p[1] - P.p[1]
    square = ex * ex + ey * ey
    along = (b * b - c * c + square) / (2.0 * square)
    with np.errstate(invalid="ignore"):
        across = np.sqrt(b * b / square - along * along)
    at = P.p[0] + along * ex - across * ey, P.p[1] + along * ey + across * ex
    v = _carry(P, Q, at, P.v, Q.v, 0.0, 0.0)
    turn_p, turn_q = ((v[0] - end.v[0]) ** 2 + (v[1] - end.v[1]) ** 2 for end in (P, Q))
    return Moving(at, v, _carry(P, Q, at, P.a, Q.a, turn_p, turn_q))


def _carry(P: Moving, Q: Moving, at: Any, of_p: Any, of_q: Any, to_p: Any, to_q: Any) -> tuple[Array, Array]:
    """The rate of a pin from those of the two ends, less the squared rates about them."""
    bx, by, cx, cy = at[0] - P.p[0], at[1] - P.p[1], at[0] - Q.p[0], at[1] - Q.p[1]
    f, g = bx * of_p[0] + by * of_p[1] - to_p, cx * of_q[0] + cy * of_q[1] - to_q
    whole = bx * cy - by * cx
    return (f * cy - g * by) / whole, (bx * g - cx * f) / whole


def rows(point: Moving) -> Array:
    """x, y, then their first and second rates (6, ...)."""
    return np.stack(np.broadcast_arrays(*point.p, *point.v, *point.a))
