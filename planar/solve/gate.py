"""The gate that every answer passes, whichever way it was found.

It knows nothing of elimination, casadi or Newton: it runs the pairs' own formulas on plain numbers. It has two
parts, since the residual of a flipped linkage is zero too: is everything closed, and is it still the same branch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from planar.algebra import Jet
from planar.mechanism import Mechanism, motions
from planar.pairs import Kind, Pair
from planar.plane import Frame
from planar.shapes import Shape

Array = np.ndarray
EPS = float(np.finfo(float).eps)


class Gate:
    """The constraints of one mechanism (SI, lengths judged in units of its size)."""

    def __init__(self, mechanism: Mechanism, shapes: Mapping[str, Shape], unit: float):
        self.mechanism, self.unit = mechanism, unit
        self.motions = motions(mechanism)
        self.numbers = {
            pair.name: pair.measure(*(shapes[link] for link in pair.links))
            for pair in (*mechanism.pairs, *(self.motions[given.pair] for given in mechanism.inputs))
        }
        reach = max(
            (abs(value) for name, pair in self._measured() for value in _lengths(pair, self.numbers[name])), default=0.0
        )
        # an entry of a residual is a sum of a few terms as long as the mechanism reaches, after one step of rounding
        # for each link on the way round a loop
        self.tolerance = 16.0 * EPS * (4 + len(mechanism.links)) * max(1.0, reach / unit)

    def _measured(self) -> list[tuple[str, Pair]]:
        return [(pair.name, pair) for pair in self.mechanism.pairs]

    def open(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[float]]) -> tuple[float, str]:
        """How far the worst constraint is open (lengths of the size, or rad), and its pair.

        Frames with cos and sin made from their angles; a value that is not a number counts as infinitely open.
        """
        worst, where = 0.0, ""
        for name, kind, left, _ in self._rows(frames, own):
            gap = _gap(left, kind, self.unit)
            if not gap <= worst:
                worst, where = (gap if gap == gap else float("inf")), name
        return worst, where

    def open_rates(
        self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]], order: int
    ) -> tuple[float, str]:
        """How far velocities (order 1) or accelerations (2) break the worst constraint, as a part of the greatest."""
        greatest = max((self._rate(frame, order) for frame in frames.values() if not frame.fixed), default=0.0)
        greatest = max([greatest, *(abs(x.parts[order]) / self.unit for each in own.values() for x in each)])
        worst, where = 0.0, ""
        for name, kind, left, given in self._rows(frames, own):
            wanted = given[order] if given is not None else 0.0
            rate = left.parts[order] if isinstance(left, Jet) else 0.0
            gap = abs(rate - wanted) / (self.unit if kind is Kind.LENGTH else 1.0) / (greatest or 1.0)
            if not gap <= worst:
                worst, where = (gap if gap == gap else float("inf")), name
        return worst, where

    def _rate(self, frame: Frame, order: int) -> float:
        angular = max(abs(frame.angle.parts[k]) ** (order / k) for k in range(1, order + 1))
        return max(angular, *(abs(value.parts[order]) / self.unit for value in (frame.x, frame.y)))

    def _rows(self, frames, own):  # noqa: ANN001, ANN202 - floats or jets alike
        """(pair, kind, what is left open, rates that are given) of every constraint and input."""
        for pair in self.mechanism.pairs:
            first, second = (frames[link] for link in pair.links)
            left = pair.residual(first, second, self.numbers[pair.name], own[pair.name])
            for kind, value in zip(pair.constrains, left, strict=True):
                yield pair.name, kind, value, None
        for given in self.mechanism.inputs:
            pair = self.motions[given.pair]
            first, second = (frames[link] for link in pair.links)
            drive = pair.drive(first, second, self.numbers[pair.name], own.get(pair.name, ()))
            rates = (0.0, given.velocity, given.acceleration)
            yield pair.name, pair.drive_kind, drive - given.position, rates


def _lengths(pair: Pair, numbers: Sequence[float]) -> list[float]:
    return [value for value, kind in zip(numbers, pair.measures, strict=True) if kind is Kind.LENGTH]


def _gap(left: float, kind: Kind, unit: float) -> float:
    if kind is Kind.LENGTH:
        return abs(left) / unit
    if kind is Kind.ANGLE:
        return abs(float(np.arctan2(np.sin(left), np.cos(left))))
    return abs(left)


def same_branch(
    slopes: Sequence[tuple[Array, Array]], before: tuple[Array, Array], after: tuple[Array, Array], step: float
) -> bool:
    """Whether two positions of a run can lie on one branch.

    `slopes`: each group's square slope at both; no determinant may have changed its sign. `before`, `after`: the
    unknowns with their rates against the run's parameter, `step` apart: the move must be what the rates allow.
    """
    for first, second in slopes:
        if first.shape[0] == first.shape[1] and first.size:
            if np.linalg.slogdet(first)[0] != np.linalg.slogdet(second)[0]:
                return False
    return bool(np.all(allowed(before, after, step)))


def allowed(before: tuple[Array, Array], after: tuple[Array, Array], step: float) -> Array:
    """For each unknown whether its move lies within what the rates at both ends allow.

    A smooth move differs from the mean rate times the step by no more than the rates themselves differ, with
    room for the curvature between (a quarter of the greater move, and a floor for unknowns that hardly move).
    """
    move = after[0] - before[0]
    mean = 0.5 * (before[1] + after[1]) * step
    room = np.abs(after[1] - before[1]) * abs(step) + 0.25 * np.maximum(np.abs(before[1]), np.abs(after[1])) * abs(step)
    return np.abs(move - mean) <= room + 1e-9
