"""The law of an input in time: pieces one after the other, with exact rates up to jerk."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from planar.foundation.argument_types import check_field_types
from planar.foundation.arrays import Array, IntArray
from planar.model.input_laws.segment import LawSegment
from planar.model.input_laws.spline_table import TableSegment
from planar.model.loads import MAX_LAW_ITEMS


class SegmentJoint(NamedTuple):
    """Where a piece starts, or where the last one ends: the velocity there of what ends, and of what starts."""

    time: float
    position: float
    velocity_before: float
    velocity_after: float


@dataclass(frozen=True)
class InputLaw:
    """Pieces of motion from t = 0 on, as in a cam's timing diagram (s, m, rad)."""

    segments: tuple[LawSegment, ...]

    def __post_init__(self) -> None:
        check_field_types(self)

    @cached_property
    def joint_times(self) -> tuple[float, ...]:
        """When each piece starts, and when the last ends; each sum is rounded once."""
        return tuple(
            map(float, accumulate((Fraction(float(each.duration)) for each in self.segments), initial=Fraction(0)))
        )

    @property
    def duration(self) -> float:
        """When the last piece ends (s)."""
        return self.joint_times[-1]

    def joints(self, position: float, velocity: float) -> tuple[SegmentJoint, ...]:
        """The start of every piece, and the end, of an input that starts at this position and velocity."""
        return tuple(self._joints(position, velocity))

    def _joints(self, position: float, velocity: float) -> Iterator[SegmentJoint]:
        for time, piece in zip(self.joint_times, self.segments, strict=False):
            yield SegmentJoint(time, position, velocity, piece.start_velocity(velocity))
            way, velocity = piece.end_displacement_and_velocity(velocity)
            position += way
        yield SegmentJoint(self.duration, position, velocity, velocity)

    def evaluate(self, t: Array, position: float, velocity: float) -> Array:
        """(4, n): position, velocity, acceleration and jerk at times t (n,), from this position and velocity on.

        At a joint, rates are those of the piece that starts there; at the very end, those of the last. After it the
        input goes on at the speed that it has then; before t = 0 it comes on at `velocity`.
        """
        t = np.atleast_1d(np.asarray(t, dtype=float))
        joints = self.joints(position, velocity)
        index = np.minimum(np.searchsorted(self.joint_times[1:], t, side="right"), len(self.segments) - 1)
        found = np.zeros((4, len(t)))
        for rows in _rows_alike(index):
            i = index[rows][0]
            piece = self.segments[i]
            # at the end of the last piece it is its own time that counts, not the difference of two rounded ones
            own = np.where(t[rows] >= self.joint_times[i + 1], piece.duration, t[rows] - self.joint_times[i])
            own = np.minimum(np.maximum(own, 0.0), piece.duration)
            found[:, rows] = piece.evaluate(own, joints[i].velocity_before)
            found[0, rows] += joints[i].position
        for outside, joint in ((t < 0.0, joints[0]), (t > self.duration, joints[-1])):
            if outside.any():
                found[:, outside] = 0.0
                found[0, outside] = joint.position + joint.velocity_before * (t[outside] - joint.time)
                found[1, outside] = joint.velocity_before
        return found

    def start_at(self, position: float, velocity: float) -> InputLaw:
        """The law for an input that starts here: tables, whose positions are absolute, move to where they start."""
        pieces: list[LawSegment] = []
        for joint, piece in zip(self.joints(position, velocity), self.segments, strict=False):
            if isinstance(piece, TableSegment) and not piece.starts_at(joint.position):
                pieces.append(piece.shift_to(joint.position))
            else:
                pieces.append(piece)
        return InputLaw(tuple(pieces))

    def find_problem(self) -> tuple[str, str] | None:
        """The place within the law that cannot be meant, such as "[1].in", and why."""
        if not 1 <= len(self.segments) <= MAX_LAW_ITEMS:
            return "", f"a law has from 1 to {MAX_LAW_ITEMS} pieces, not {len(self.segments)}"
        for i, piece in enumerate(self.segments):
            wrong = piece.find_problem()
            if wrong is not None:
                return f"[{i}].{wrong[0]}", wrong[1]
        return None


def _rows_alike(index: IntArray) -> list[IntArray] | list[slice]:
    """The rows with each of the numbers; where all have the same, all at once."""
    if len(index) and (index == index[0]).all():
        return [slice(None)]
    order = np.argsort(index, kind="stable")
    return np.split(order, np.flatnonzero(np.diff(index[order])) + 1) if len(index) else []
