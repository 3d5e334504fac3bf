"""What a linkage says of itself so that every way of solving it can be timed."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from typing import Any, ClassVar

Scalar = Any
"""A float, or an array of any shape."""
Two = tuple[Scalar, Scalar]

THETA, OMEGA, ALPHA = 1.0, 10.5, -26.0
"""The crank's angle (rad), velocity (rad/s) and acceleration (rad/s^2) that every mechanism file here gives."""


class Linkage(ABC):
    """A linkage of one loop, driven by a crank; two unknowns x close it.

    Formulas take `math`, `numpy` or another module of their names as their first argument, so that the closed form
    that is timed on floats and on arrays is the same. Lengths in m, angles in rad.
    """

    name: ClassVar[str]
    crank: ClassVar[str]
    """The driven pair."""
    answers: ClassVar[tuple[tuple[str, str], tuple[str, str]]]
    """(link, "angle") or (sliding pair, "displacement") of each entry of x."""

    @abstractmethod
    def document(self) -> dict[str, Any]:
        """The mechanism file (m, rad), at THETA with OMEGA and ALPHA."""

    @abstractmethod
    def positions(self, m: Any, theta: Scalar) -> Two:
        """x in closed form."""

    @abstractmethod
    def motion(self, m: Any, theta: Scalar, omega: Scalar, alpha: Scalar) -> tuple[Two, Two, Two]:
        """x with its velocities and accelerations (per s, per s^2) in closed form."""

    @abstractmethod
    def loop(self, x: Sequence[float], theta: float) -> Two:
        """The loop equation's two components, zero where x closes it."""

    @abstractmethod
    def slope(self, x: Sequence[float]) -> tuple[Two, Two]:
        """The derivative of `loop` in x, by rows."""

    @abstractmethod
    def bend(self, x: Sequence[float], v: Sequence[float], theta: float, omega: float, alpha: float) -> tuple[Two, Two]:
        """What `loop` gains per second, and per second twice, beside slope times the velocities v and accelerations."""
