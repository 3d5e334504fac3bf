"""Pieces of a law that rest, or go on at constant speed or constant acceleration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from planar.foundation.arrays import Array
from planar.model.input_laws.segment import LawSegment, SegmentKey


@dataclass(frozen=True)
class DwellSegment(LawSegment):
    """The input rests."""

    duration: float
    motion: ClassVar[str] = "dwell"
    is_lift: ClassVar[bool] = True
    description: ClassVar[str] = "the input rests"
    keys: ClassVar[Mapping[str, SegmentKey]] = {"in": SegmentKey("duration", "time", "how long it takes")}

    def evaluate(self, t: Array, velocity: float) -> Array:
        return np.zeros((4, len(t)))

    def end_displacement_and_velocity(self, velocity: float) -> tuple[float, float]:
        return 0.0, 0.0

    def start_velocity(self, velocity: float) -> float:
        return 0.0


@dataclass(frozen=True)
class ConstantSpeedSegment(LawSegment):
    """Constant speed: `speed`, or what brings the input on `by`; with neither, that at which the piece before ended."""

    duration: float
    by: float | None = None
    speed: float | None = None
    motion: ClassVar[str] = "constant speed"
    is_lift: ClassVar[bool] = True
    description: ClassVar[str] = "the input goes on at constant speed"
    keys: ClassVar[Mapping[str, SegmentKey]] = {
        "by": SegmentKey("by", "position", "how far the input goes, in place of speed", is_required=False),
        "speed": SegmentKey(
            "speed", "velocity", "its speed; with neither, that of the piece before", is_required=False
        ),
        "in": SegmentKey("duration", "time", "how long it takes"),
    }

    def evaluate(self, t: Array, velocity: float) -> Array:
        speed = self.start_velocity(velocity)
        way = speed * t if self.by is None else self.by * (t / self.duration)
        return np.stack([way, np.full_like(t, speed), np.zeros_like(t), np.zeros_like(t)])

    def end_displacement_and_velocity(self, velocity: float) -> tuple[float, float]:
        speed = self.start_velocity(velocity)
        return (speed * self.duration if self.by is None else self.by), speed

    def start_velocity(self, velocity: float) -> float:
        if self.by is not None:
            return self.by / self.duration
        return velocity if self.speed is None else self.speed

    def find_problem(self) -> tuple[str, str] | None:
        if self.by is not None and self.speed is not None:
            return "speed", "constant speed has 'by' or 'speed', not both: one follows from the other"
        return super().find_problem()


@dataclass(frozen=True)
class ConstantAccelerationSegment(LawSegment):
    """Constant acceleration from the speed at which the piece before ended."""

    duration: float
    acceleration: float
    motion: ClassVar[str] = "constant acceleration"
    description: ClassVar[str] = "the input goes on at constant acceleration"
    keys: ClassVar[Mapping[str, SegmentKey]] = {
        "acceleration": SegmentKey(
            "acceleration", "acceleration", "its acceleration, from the speed of the piece before"
        ),
        "in": SegmentKey("duration", "time", "how long it takes"),
    }

    def evaluate(self, t: Array, velocity: float) -> Array:
        a = self.acceleration
        return np.stack([(velocity + 0.5 * a * t) * t, velocity + a * t, np.full_like(t, a), np.zeros_like(t)])

    def end_displacement_and_velocity(self, velocity: float) -> tuple[float, float]:
        a, t = self.acceleration, self.duration
        return (velocity + 0.5 * a * t) * t, velocity + a * t

    def start_velocity(self, velocity: float) -> float:
        return velocity
