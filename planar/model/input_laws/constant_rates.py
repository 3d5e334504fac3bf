"""Pieces of a law that rest, or go on at constant speed or constant acceleration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from planar.model.input_laws.segment import Array, Key, Piece


@dataclass(frozen=True)
class Dwell(Piece):
    """The input rests."""

    duration: float
    motion: ClassVar[str] = "dwell"
    keys: ClassVar[Mapping[str, Key]] = {"in": Key("duration", "time")}

    def at(self, t: Array, velocity: float) -> Array:
        return np.zeros((4, len(t)))

    def ends(self, velocity: float) -> tuple[float, float]:
        return 0.0, 0.0

    def starts(self, velocity: float) -> float:
        return 0.0


@dataclass(frozen=True)
class ConstantSpeed(Piece):
    """Constant speed: `speed`, or what brings the input on `by`; with neither, that at which the piece before ended."""

    duration: float
    by: float | None = None
    speed: float | None = None
    motion: ClassVar[str] = "constant speed"
    keys: ClassVar[Mapping[str, Key]] = {
        "by": Key("by", "position", needed=False),
        "speed": Key("speed", "velocity", needed=False),
        "in": Key("duration", "time"),
    }

    def at(self, t: Array, velocity: float) -> Array:
        speed = self.starts(velocity)
        way = speed * t if self.by is None else self.by * (t / self.duration)
        return np.stack([way, np.full_like(t, speed), np.zeros_like(t), np.zeros_like(t)])

    def ends(self, velocity: float) -> tuple[float, float]:
        speed = self.starts(velocity)
        return (speed * self.duration if self.by is None else self.by), speed

    def starts(self, velocity: float) -> float:
        if self.by is not None:
            return self.by / self.duration
        return velocity if self.speed is None else self.speed

    def problem(self) -> tuple[str, str] | None:
        if self.by is not None and self.speed is not None:
            return "speed", "constant speed has 'by' or 'speed', not both: one follows from the other"
        return super().problem()


@dataclass(frozen=True)
class ConstantAcceleration(Piece):
    """Constant acceleration from the speed at which the piece before ended."""

    duration: float
    acceleration: float
    motion: ClassVar[str] = "constant acceleration"
    keys: ClassVar[Mapping[str, Key]] = {
        "acceleration": Key("acceleration", "acceleration"),
        "in": Key("duration", "time"),
    }

    def at(self, t: Array, velocity: float) -> Array:
        a = self.acceleration
        return np.stack([(velocity + 0.5 * a * t) * t, velocity + a * t, np.full_like(t, a), np.zeros_like(t)])

    def ends(self, velocity: float) -> tuple[float, float]:
        a, t = self.acceleration, self.duration
        return (velocity + 0.5 * a * t) * t, velocity + a * t

    def starts(self, velocity: float) -> float:
        return velocity
