"""Solutions with their unknowns exchanged, one of those that stand for the same linkage, and those that are equal."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.foundation.arrays import ComplexArray, IntArray

Images = Callable[[ComplexArray], list[ComplexArray]]
"""Of solutions V all that stand for the same thing, themselves first."""


def reordered(V: ComplexArray, order: tuple[int, ...]) -> ComplexArray:
    """Solutions whose unknown at each place is that of an order."""
    half = V.shape[1] // 2
    own = np.array(order, dtype=int) + 1
    return V[:, [0, *own.tolist(), half, *(own + half).tolist()]]


def exchange_images(exchanges: tuple[tuple[int, ...], ...]) -> Images:
    """All that exchanges make of solutions."""
    return lambda V: [reordered(V, each) for each in exchanges]


def representatives(V: ComplexArray, images: Images | None) -> ComplexArray:
    """Of all that stand for the same thing always the same one."""
    every = images(V) if images is not None else [V]
    if len(every) == 1:
        return V
    keys = np.array([solution_keys(each).real for each in every])
    chosen = np.argmin(keys, axis=0)
    found: ComplexArray = np.array(every)[chosen, np.arange(len(V))]
    return found


def solution_keys(V: ComplexArray) -> ComplexArray:
    """A number by which solutions are told from each other, whatever the length of their halves."""
    half = V.shape[1] // 2
    rng = np.random.default_rng(1)
    weights = rng.normal(size=(2, 2, half)) + 1j * rng.normal(size=(2, 2, half))
    parts = V[:, :half], V[:, half:]
    found: ComplexArray = sum((each @ w[0]) / (each @ w[1]) for each, w in zip(parts, weights, strict=True))
    return found


SAME = 1e-7
"""Of directions of length one: solutions nearer to each other are one. Two that are nearly real are no farther apart
than their imaginary parts."""


def first_of_same(V: ComplexArray) -> IntArray:
    """Of each solution the first that is the same (solutions,)."""
    found: IntArray = np.arange(len(V))
    if len(V) < 2:
        return found
    half, key = V.shape[1] // 2, solution_keys(V)
    parts = V[:, :half], V[:, half:]
    order = np.argsort(key.real, kind="stable")
    unit = [each / np.linalg.norm(each, axis=1, keepdims=True) for each in parts]
    room = 1e3 * SAME * np.maximum(1.0, np.abs(key))
    for at, k in enumerate(order.tolist()):
        for other in order[at + 1 :].tolist():
            if key[other].real - key[k].real > room[k]:
                break
            apart = max(np.linalg.norm(each[other] - np.vdot(each[k], each[other]) * each[k]) for each in unit)
            if apart < SAME:
                low = min(found[k], found[other])
                found[k] = found[other] = low
    return found
