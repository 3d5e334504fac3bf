"""The gate that every answer passes, whichever way it was found.

It knows nothing of elimination, casadi or Newton: it runs the pairs' own formulas on plain numbers. It has two
parts, since the residual of a flipped linkage is zero too: is everything closed, and is it still the same branch.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from planar.algebra import Jet
from planar.mechanism import Mechanism, motions
from planar.pairs import Kind, Pair
from planar.plane import Frame
from planar.program import Program
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
        self.names = [pair.name for pair in mechanism.pairs for _ in pair.constrains]
        self.names += [given.pair for given in mechanism.inputs]
        """The pair of every constraint, the inputs' last."""
        self.tolerance = 16.0 * EPS * (4 + len(mechanism.links)) * max(1.0, reach / unit)

    def _measured(self) -> list[tuple[str, Pair]]:
        return [(pair.name, pair) for pair in self.mechanism.pairs]

    def gaps(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Array]], u: Array | None = None) -> Array:
        """How far every constraint is open (constraints, ...): lengths of the size, or rad; see `names`.

        Frames with cos and sin made from their angles, floats or arrays alike. `u` (inputs, ...) are the positions
        of the inputs, else the mechanism's own. What is not a number counts as infinitely open.
        """
        gaps = [_gap(left, kind, self.unit) for kind, left in self._closures(frames, own, u)]
        return np.nan_to_num(np.array(np.broadcast_arrays(*gaps)), nan=np.inf, posinf=np.inf)

    def rate_gaps(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]]) -> list[tuple[float, str]]:
        """How far velocities, then accelerations, break the worst constraint, as a part of the greatest; its pair."""
        closures = [(kind, left) for kind, left in self._closures(frames, own) if isinstance(left, Jet)]
        units = np.array([self.unit if kind is Kind.LENGTH else 1.0 for kind, _ in closures])
        found = []
        for order in (1, 2):
            rates = [(given.velocity, given.acceleration)[order - 1] for given in self.mechanism.inputs]
            wanted = np.zeros(len(closures))
            wanted[len(closures) - len(rates) :] = rates
            broken = np.array([left.parts[order] for _, left in closures]) - wanted
            gaps = np.nan_to_num(np.abs(broken) / units / self._greatest(frames, own, order), nan=np.inf)
            worst = int(np.argmax(gaps)) if len(gaps) else 0
            found.append((float(gaps.max(initial=0.0)), self.names[worst] if len(gaps) else ""))
        return found

    def _greatest(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]], order: int) -> float:
        """The greatest rate of an order (lengths of the size), what a velocity makes of itself in an arc included."""
        rates = [self._rate(frame, order) for frame in frames.values() if not frame.fixed]
        rates += [abs(jet.parts[order]) / self.unit for each in own.values() for jet in each]
        return max(rates, default=0.0) or 1.0

    def _rate(self, frame: Frame, order: int) -> float:
        angular = max(abs(frame.angle.parts[k]) ** (order / k) for k in range(1, order + 1))
        return max(angular, *(abs(value.parts[order]) / self.unit for value in (frame.x, frame.y)))

    def _closures(self, frames, own, u=None):  # noqa: ANN001, ANN202 - floats, arrays or jets alike
        """(kind, what is left open) of every constraint, then of every input."""
        for pair in self.mechanism.pairs:
            first, second = (frames[link] for link in pair.links)
            left = pair.residual(first, second, self.numbers[pair.name], own[pair.name])
            yield from zip(pair.constrains, left, strict=True)
        for index, given in enumerate(self.mechanism.inputs):
            pair = self.motions[given.pair]
            first, second = (frames[link] for link in pair.links)
            drive = pair.drive(first, second, self.numbers[pair.name], own.get(pair.name, ()))
            yield pair.drive_kind, drive - (given.position if u is None else u[index])


def _lengths(pair: Pair, numbers: Sequence[float]) -> list[float]:
    return [value for value, kind in zip(numbers, pair.measures, strict=True) if kind is Kind.LENGTH]


def _gap(left: Array, kind: Kind, unit: float) -> Array:
    if kind is Kind.LENGTH:
        return np.abs(left) / unit
    if kind is Kind.ANGLE:
        return np.abs(np.arctan2(np.sin(left), np.cos(left)))
    return np.abs(left)


class Place(NamedTuple):
    """A position of a run: unknowns, their first and second rates along it, and each group's distance (stages,) from
    the nearest position in which it could be singular, in units of the run's parameter."""

    z: Array
    rates: Array
    second: Array
    safe: Array


CLOSE = 1.5
"""How many times shorter than the distances from singular positions at its two ends a step must be."""
NUDGE = 1e-6
"""The part of a step over which the change of a slope is taken."""


class Branch:
    """The second part of the gate: can two positions of a run lie on one branch, and on no other?

    They can if every unknown has moved as its rates allow, and if no group can have been singular between. A slope
    stays regular until it has changed by its least singular value (Weyl), so least value over rate of change is a
    distance in which nothing happens: a step must be shorter than those at its two ends together. So a change point,
    where branches cross, is not passed within a step, whichever sign the determinant has beyond it and however the
    rates there agree.
    """

    def __init__(self, program: Program, p: Array):
        self.program, self.p = program, p

    def at(self, z: Array, u: Array, way: Array) -> Place:
        """The position at unknowns z and inputs u, with rates against the parameter whose unit is `way` of u."""
        y, still = np.concatenate([z, u]), np.zeros_like(z)
        none = np.zeros_like(way)
        rest = self.program.kinematics(y, np.concatenate([still, way]), np.concatenate([still, none]), self.p)
        rates = _cancelling(rest.slope, rest.F1[:, None])[:, 0]
        moving = self.program.kinematics(y, np.concatenate([rates, way]), np.concatenate([still, none]), self.p)
        second = _cancelling(rest.slope, moving.F2[:, None])[:, 0]
        return Place(z, rates, second, self._safe(z[None], u[None], rest.slope[None], rates[None], way[None])[0])

    def same(self, before: Place, after: Place, step: float) -> bool:
        """Whether two positions, a step of the parameter apart, can lie on one branch."""
        smooth = np.all(allowed(after.z - before.z, before.rates * step, after.rates * step))
        return bool(smooth and np.all(CLOSE * step < before.safe + after.safe))

    def along(self, z: Array, u: Array) -> Array:
        """For each step of a run, z (samples, unknowns) and u (samples, inputs), whether it keeps to the branch."""
        slopes, drives = self.program.slopes(z, u, self.p)
        gains = _cancelling(slopes, drives)
        way = np.diff(u, axis=0)
        before, after = ((gain @ way[:, :, None])[..., 0] for gain in (gains[:-1], gains[1:]))
        smooth = np.all(allowed(np.diff(z, axis=0), before, after), axis=1)
        first = self._safe(z[:-1], u[:-1], slopes[:-1], before, way)
        second = self._safe(z[1:], u[1:], slopes[1:], after, way)
        return smooth & np.all(first + second > CLOSE, axis=1)

    def _safe(self, z: Array, u: Array, slopes: Array, rates: Array, way: Array) -> Array:
        """How far each group is from where it could be singular (samples, stages), in steps of rates and way."""
        pace = np.maximum(np.max(np.abs(np.hstack([rates, way])), axis=1, initial=0.0), 1e-300)[:, None]
        nudge = NUDGE / np.maximum(pace, NUDGE)
        moved, _ = self.program.slopes(z + nudge * rates, u + nudge * way, self.p)
        distances = np.full((len(z), len(self.program.equations.stages)), np.inf)
        for index, stage in enumerate(self.program.equations.stages):
            here, there = (each[:, stage.rows, stage.unknowns] for each in (slopes, moved))
            if here.size:
                # columns of one size, so that a small link counts as much as a large one
                sizes = np.maximum(np.linalg.norm(here, axis=1, keepdims=True), 1e-300)
                change = np.linalg.norm((there - here) / sizes, axis=(1, 2)) / nudge[:, 0]
                distances[:, index] = _least(here / sizes) / np.maximum(change, 1e-300)
        return np.nan_to_num(distances, nan=0.0, posinf=np.inf)


def _cancelling(slopes: Array, known: Array) -> Array:
    """The rates of the unknowns that cancel what known rates open; slopes (..., rows, unknowns), known (..., rows, k).

    Where a square slope is singular, NaN: no rate is allowed there.
    """
    if slopes.shape[-1] != slopes.shape[-2]:
        return -np.linalg.pinv(slopes, rcond=1e-12) @ known
    try:
        return -np.linalg.solve(slopes, known)
    except np.linalg.LinAlgError:
        if slopes.ndim > 2:
            return np.stack([_cancelling(slope, each) for slope, each in zip(slopes, known, strict=True)])
        return np.full((slopes.shape[-1], known.shape[-1]), np.nan)


def _least(slopes: Array) -> Array:
    """The least singular value of each slope (steps, rows, unknowns), rows >= unknowns."""
    if slopes.shape[1:] == (2, 2):
        # of two by two in closed form: the two have the determinant as product and the norm as sum of squares
        det = np.abs(slopes[:, 0, 0] * slopes[:, 1, 1] - slopes[:, 0, 1] * slopes[:, 1, 0])
        norm = np.sum(slopes * slopes, axis=(1, 2))
        greatest = np.sqrt(0.5 * (norm + np.sqrt(np.maximum(norm * norm - 4.0 * det * det, 0.0))))
        return det / np.maximum(greatest, 1e-300)
    if slopes.shape[1] < slopes.shape[2]:
        return np.zeros(len(slopes))
    return np.linalg.svd(slopes, compute_uv=False)[:, -1]


def allowed(move: Array, before: Array, after: Array) -> Array:
    """Whether a move is one that the rates at its two ends allow, each as a move over the whole step.

    A smooth move differs from the mean of the two by no more than they differ from one another, with room for the
    curvature between (a quarter of the greater) and a floor of round-off for what hardly moves.
    """
    room = np.abs(after - before) + 0.25 * np.maximum(np.abs(before), np.abs(after)) + 1e-9
    return np.abs(move - 0.5 * (before + after)) <= room
