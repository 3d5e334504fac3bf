"""The law of an input in time: pieces one after the other, with exact rates up to jerk."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from itertools import accumulate
from typing import NamedTuple

import numpy as np

from planar.model.input_laws.segment import MOST, Array, Piece
from planar.model.input_laws.spline_table import Table


class Joint(NamedTuple):
    """Where a piece starts, or where the last one ends: the velocity there of what ends, and of what starts."""

    time: float
    position: float
    ending: float
    starting: float


@dataclass(frozen=True)
class Law:
    """Pieces of motion from t = 0 on, as in a cam's timing diagram (s, m, rad)."""

    pieces: tuple[Piece, ...]

    @cached_property
    def times(self) -> tuple[float, ...]:
        """When each piece starts, and when the last ends; each sum is rounded once."""
        return tuple(
            map(float, accumulate((Fraction(float(each.duration)) for each in self.pieces), initial=Fraction(0)))
        )

    @property
    def duration(self) -> float:
        """When the last piece ends (s)."""
        return self.times[-1]

    def joints(self, position: float, velocity: float) -> tuple[Joint, ...]:
        """The start of every piece, and the end, of an input that starts at this position and velocity."""
        return tuple(self._joints(position, velocity))

    def _joints(self, position: float, velocity: float) -> Iterator[Joint]:
        for time, piece in zip(self.times, self.pieces, strict=False):
            yield Joint(time, position, velocity, piece.starts(velocity))
            way, velocity = piece.ends(velocity)
            position += way
        yield Joint(self.duration, position, velocity, velocity)

    def at(self, t: Array, position: float, velocity: float) -> Array:
        """(4, n): position, velocity, acceleration and jerk at times t (n,), from this position and velocity on.

        At a joint, rates are those of the piece that starts there; at the very end, those of the last. After it the
        input goes on at the speed that it has then; before t = 0 it comes on at `velocity`.
        """
        t = np.atleast_1d(np.asarray(t, dtype=float))
        joints = self.joints(position, velocity)
        index = np.clip(np.searchsorted(self.times, t, side="right") - 1, 0, len(self.pieces) - 1)
        found = np.zeros((4, len(t)))
        order = np.argsort(index, kind="stable")
        for rows in np.split(order, np.flatnonzero(np.diff(index[order])) + 1) if len(t) else ():
            i = index[rows[0]]
            piece = self.pieces[i]
            # at the end of the last piece it is its own time that counts, not the difference of two rounded ones
            own = np.where(t[rows] >= self.times[i + 1], piece.duration, t[rows] - self.times[i])
            found[:, rows] = piece.at(np.clip(own, 0.0, piece.duration), joints[i].ending)
            found[0, rows] += joints[i].position
        for rows, joint in ((t < 0.0, joints[0]), (t > self.duration, joints[-1])):
            found[:, rows] = 0.0
            found[0, rows] = joint.position + joint.ending * (t[rows] - joint.time)
            found[1, rows] = joint.ending
        return found

    def started(self, position: float, velocity: float) -> Law:
        """The law for an input that starts here: tables, whose positions are absolute, move to where they start."""
        pieces = []
        for joint, piece in zip(self.joints(position, velocity), self.pieces, strict=False):
            lies = not isinstance(piece, Table) or piece.begins(joint.position)
            pieces.append(piece if lies else piece.moved(joint.position))
        return Law(tuple(pieces))

    def problem(self) -> tuple[str, str] | None:
        """The place within the law that cannot be meant, such as "[1].in", and why."""
        if not 1 <= len(self.pieces) <= MOST:
            return "", f"a law has from 1 to {MOST} pieces, not {len(self.pieces)}"
        for i, piece in enumerate(self.pieces):
            wrong = piece.problem()
            if wrong is not None:
                return f"[{i}].{wrong[0]}", wrong[1]
        return None
