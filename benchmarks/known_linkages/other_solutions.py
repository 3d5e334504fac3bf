"""Linkages that meet a task, by Newton's method from many random starts: a second route to a complete list."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks.known_linkages.known_tasks import STEP, KnownTask, item_rows
from planar.foundation.arrays import Array

STARTS, STEPS = 400, 40
MET = 1e-10
REGULAR = 1e-4
"""Of the greatest singular value of the Jacobian, its columns of length 1."""
FAR = 30.0
"""m: what is farther out is not looked at."""

Solution = tuple[dict[str, float], float, tuple[float, ...]]
"""Numbers, where the input is at the first entry, and the signs of the assembly there."""


class _System:
    """All rows of a task as a function of its free numbers and open positions of the input, for many at once."""

    def __init__(self, task: KnownTask, signs: list[tuple[Array, ...]]):
        self.task, self.signs = task, signs
        self.counts = [item.parameter_count for item in task.items]
        self.size = len(task.free) + sum(self.counts)

    def rows(self, x: Any) -> Any:
        """The misses (starts, rows) at values (starts, unknowns)."""
        task, first = self.task, len(self.task.free)
        numbers: Mapping[str, Any] = {
            **task.linkage.numbers,
            **{name: x[:, k : k + 1] for k, name in enumerate(task.free)},
        }
        found = []
        for item, count, signs in zip(task.items, self.counts, self.signs, strict=True):
            angles = item.positions(x[:, first : first + count])
            first += count
            rows = item_rows(item, task.linkage.structure, numbers, angles, signs)
            rows = np.broadcast_to(rows, (rows.shape[0], len(x), rows.shape[2]))
            found.append(np.moveaxis(rows, 1, 0).reshape(len(x), -1))
        return np.concatenate(found, axis=1)

    def with_slopes(self, x: Array) -> tuple[Array, Array]:
        """The misses and their Jacobians, by complex steps."""
        slopes = []
        for k in range(self.size):
            moved = x.astype(complex)
            moved[:, k] += 1j * STEP
            slopes.append(self.rows(moved).imag / STEP)
        return self.rows(x), np.stack(slopes, axis=2)


def other_solutions(task: KnownTask, starts: int = STARTS, seed: int = 1) -> list[Solution]:
    """Regular solutions that Newton's method comes to, each once."""
    rng = np.random.default_rng(seed)
    signs = [
        tuple(rng.choice([-1.0, 1.0], (starts, len(item.targets))) for _ in range(task.linkage.structure.sign_count))
        for item in task.items
    ]
    system = _System(task, signs)
    x = _starts(task, system, starts, rng)
    with np.errstate(all="ignore"):
        for _ in range(STEPS):
            x = _newton_step(system, x)
        rows, slopes = system.with_slopes(x)
    good = np.asarray(np.isfinite(rows).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2)))
    good &= (np.abs(np.where(np.isfinite(rows), rows, 1.0)).max(axis=1) < MET) & (np.abs(x).max(axis=1) < FAR)
    solutions: list[Solution] = []
    known: list[Array] = []
    for k in np.flatnonzero(good).tolist():
        lengths = np.linalg.norm(slopes[k], axis=0)
        values = np.linalg.svd(slopes[k] / np.where(lengths > 0.0, lengths, 1.0), compute_uv=False)
        own = x[k, : len(task.free)]
        if values[-1] < REGULAR or any(np.abs(each - own).max() < 1e-7 for each in known):
            continue
        known.append(own)
        numbers = {**task.linkage.numbers, **dict(zip(task.free, own.tolist(), strict=True))}
        item = task.items[0]
        angle = float(np.atleast_1d(item.positions(x[k, len(task.free) : len(task.free) + item.parameter_count]))[0])
        solutions.append((numbers, angle, tuple(float(each[k, 0]) for each in signs[0])))
    return solutions


def _starts(task: KnownTask, system: _System, count: int, rng: np.random.Generator) -> Array:
    known = np.array([task.linkage.numbers[name] for name in task.free])
    spread = rng.choice([0.2, 1.0, 3.0], (count, 1))
    numbers = known + spread * rng.normal(size=(count, len(known)))
    angles = rng.uniform(-np.pi, np.pi, (count, system.size - len(known)))
    found: Array = np.concatenate([numbers, angles], axis=1)
    return found


def _newton_step(system: _System, x: Array) -> Array:
    """A step of Gauss and Newton with a little damping; starts that cannot be assembled stay where they are."""
    rows, slopes = system.with_slopes(x)
    good = np.asarray(np.isfinite(rows).all(axis=1) & np.isfinite(slopes).all(axis=(1, 2)))
    rows, slopes = np.where(good[:, None], rows, 0.0), np.where(good[:, None, None], slopes, 0.0)
    transposed = np.swapaxes(slopes, 1, 2)
    damping = 1e-10 + 1e-6 * (rows * rows).sum(axis=1)
    matrix = transposed @ slopes + damping[:, None, None] * np.eye(system.size)
    step = np.linalg.solve(matrix, (transposed @ rows[:, :, None]))[:, :, 0]
    length = np.abs(step).max(axis=1, keepdims=True)
    step = step * np.minimum(1.0, 0.5 / np.where(length > 0.0, length, 1.0))
    for factor in (1.0, 0.3, 0.05):
        moved = x - factor * step
        is_better = np.isfinite(system.rows(moved)).all(axis=1)
        x = np.where((is_better & good)[:, None], moved, x)
        good &= ~is_better
    return x
