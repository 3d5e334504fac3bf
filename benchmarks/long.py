"""Linkages of ten to ten thousand links: how the time of a position and link grows with their number."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial
from itertools import pairwise
from time import perf_counter
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.chain import FIRST
from benchmarks.dyadic import CARRIED, CRANK, DYAD, FRAME, closed_form, together
from benchmarks.limit import Tape, compiled
from benchmarks.linkages import FourBar
from benchmarks.linkages.base import THETA
from benchmarks.timing import best

Array = np.ndarray

NEXT = tuple(FourBar(a=0.5, b=1.0 + more, c=0.5, g=1.0) for more in (5e-4, -5e-4))
"""The later four-bars in turn, so nearly parallelograms that the last rocker still swings as the first."""
LINKS = (10, 100, 1_000, 10_000)
STEPS = 200
ROUNDS = 2
PATIENCE = 8.0
"""s that one run may take; longer ones are not waited for."""


class Pinned(NamedTuple):
    """A linkage of bars by the places of its pins (see `planar.pinned`); as a tape where it is solved by dyads."""

    places: Array
    bars: list[tuple[int, ...]]
    frame: list[int]
    tape: Tape | None

    @property
    def links(self) -> int:
        """The frame among them."""
        return len(self.bars) + 1


@dataclass(frozen=True)
class Long:
    """One kind of linkage: numbers of links, and seconds a position and link of planar and of C.

    None where it was not waited for, or has no closed form. The greatest error is a part of the greatest coordinate,
    against the closed form, else of the bars' lengths.
    """

    structure: str
    links: tuple[int, ...]
    planar: tuple[float | None, ...]
    limit: tuple[float | None, ...]
    error: float


class _Tape:
    """Joints that are added one after the other, with where they stand."""

    def __init__(self) -> None:
        self.kind: list[int] = []
        self.of: list[tuple[int, int]] = []
        self.size: list[tuple[float, float, float]] = []
        self.at: list[tuple[float, float]] = []

    def frame(self, x: float, y: float) -> int:
        return self._add(FRAME, (0, 0), (x, y, 0.0), (x, y))

    def crank(self, pivot: int, radius: float, angle: float) -> int:
        c, s = np.cos(angle), np.sin(angle)
        x, y = self.at[pivot]
        return self._add(CRANK, (pivot, 0), (radius, c, s), (x + radius * c, y + radius * s))

    def dyad(self, p: int, q: int, b: float, c: float, side: float) -> int:
        """The joint b from p and c from q, to the left of the way from p to q where the side is 1."""
        (px, py), (qx, qy) = self.at[p], self.at[q]
        ex, ey = qx - px, qy - py
        square = ex * ex + ey * ey
        along = 0.5 + 0.5 * (b * b - c * c) / square
        across = side * np.sqrt(b * b / square - along * along)
        return self._add(
            DYAD, (p, q), (b * b, c * c, side), (px + along * ex - across * ey, py + along * ey + across * ex)
        )

    def carry(self, p: int, q: int, along: float, across: float = 0.0) -> int:
        (px, py), (qx, qy) = self.at[p], self.at[q]
        x, y = qx - px, qy - py
        return self._add(
            CARRIED, (p, q), (along, across, 0.0), (px + along * x - across * y, py + along * y + across * x)
        )

    def _add(self, kind: int, of: tuple[int, int], size: tuple[float, float, float], at: tuple[float, float]) -> int:
        self.kind.append(kind)
        self.of.append(of)
        self.size.append(size)
        self.at.append((float(at[0]), float(at[1])))
        return len(self.kind) - 1

    def pinned(self, bars: list[tuple[int, ...]]) -> Pinned:
        """The linkage of these bars."""
        frame = [joint for joint, kind in enumerate(self.kind) if kind == FRAME]
        return Pinned(np.array(self.at), bars, frame, together([(self.kind, self.of, self.size)]))


def row(links: int) -> Pinned:
    """Four-bars, each driven by the rocker of the one before."""
    tape, pivot = _Tape(), 0.0
    cells = (FIRST, *(NEXT[k % 2] for k in range((links - 4) // 2)))
    pin = tape.crank(tape.frame(0.0, 0.0), cells[0].a, THETA)
    bars: list[tuple[int, ...]] = [(0, pin)]
    for k, cell in enumerate(cells):
        pivot += cell.g
        end = tape.frame(pivot, 0.0)
        joint = tape.dyad(pin, end, cell.b, cell.c, 1.0)
        bars.append((pin, joint))
        if k + 1 < len(cells):
            pin = tape.carry(end, joint, cells[k + 1].a / cell.c)
            bars.append((end, joint, pin))
        else:
            bars.append((end, joint))
    return tape.pinned(bars)


def scissors(links: int) -> Pinned:
    """Lazy tongs: pairs of bars that cross; a crank rocks the first bar, a long bar guides the foot of the second."""
    tape, half, low = _Tape(), 0.5, np.sqrt(0.125)
    foot, guide = tape.frame(0.0, 0.0), tape.frame(2.0 * low, -5.0)
    pivot = tape.frame(low - 0.9 * np.sqrt(0.5), low + 0.9 * np.sqrt(0.5))
    pin = tape.crank(pivot, 0.07, THETA)
    middle = tape.dyad(pin, foot, 0.9, half, 1.0)
    other = tape.dyad(middle, guide, half, 5.0, 1.0)
    right, left = tape.carry(foot, middle, 2.0), tape.carry(other, middle, 2.0)
    bars: list[tuple[int, ...]] = [(pivot, pin), (pin, middle), (foot, middle, right), (other, middle, left)]
    bars.append((guide, other))
    while len(bars) + 1 < links:
        # the bars change sides at every crossing
        middle = tape.dyad(left, right, half, half, 1.0)
        to_right, to_left = tape.carry(left, middle, 2.0), tape.carry(right, middle, 2.0)
        bars += [(left, middle, to_right), (right, middle, to_left)]
        left, right = to_left, to_right
    return tape.pinned(bars)


def triads(links: int) -> Pinned:
    """Plates on two rods each, pushed along by a rod from the plate before: three rods and a plate at once."""
    places, frame = [(0.0, 0.0), (0.1 * np.cos(THETA), 0.1 * np.sin(THETA))], [0]
    bars: list[tuple[int, ...]] = [(0, 1)]
    pin, x, wider = 1, 1.0, 0.01
    while len(bars) + 1 < links:
        first = len(places)
        places += [(x, -1.0), (x + 0.5 + wider, -1.0), (x, 0.0), (x + 0.5, 0.0), (x + 0.25, 0.3)]
        one, two, a, b, c = range(first, first + 5)
        frame += [one, two]
        bars += [(pin, c), (one, a), (two, b), (a, b, c)]
        pin, x, wider = b, x + 1.0, -wider
    return Pinned(np.array(places), bars, frame, None)


STRUCTURES: dict[str, Callable[[int], Pinned]] = {
    "rows of four-bars": row,
    "scissors": scissors,
    "chains of triads": triads,
}


def long() -> tuple[Long, ...]:
    """All of them, as far as they are waited for."""
    return tuple(map(long_of, STRUCTURES))


@cache
def long_of(name: str) -> Long:
    """One kind of linkage."""
    make = STRUCTURES[name]
    links, ours, theirs, errors = [], [], [], [0.0]
    turned = 2.0 * np.pi * np.linspace(0.0, 1.0, STEPS + 1)
    limit, waited = compiled(), True
    for many in LINKS:
        linkage = make(many)
        links.append(linkage.links)
        tasks: dict[str, Callable[[], Any]] = {}
        if limit is not None and linkage.tape is not None:
            tasks["C"] = limit.tape(linkage.tape, turned)
        if waited and hasattr(planar, "sweep_each"):
            mechanism = planar.pinned(linkage.places, linkage.bars, linkage.frame, 0)
            last = f"P{len(linkage.places) - 1}"
            start = perf_counter()
            found = planar.sweep_each([mechanism], STEPS, rates=False, workers=1)[0]
            took = perf_counter() - start
            errors.append(_error(linkage, found.position, turned))
            # the next is ten times as long; by the general path that may take a thousand times as long
            waited = (1000.0 if found.general else 10.0) * took < PATIENCE
            tasks["planar"] = partial(planar.sweep_each, [mechanism], STEPS, [last], rates=False)
        times = best(tasks, ROUNDS) if tasks else {}
        positions = linkage.links * (STEPS + 1)
        ours.append(times["planar"] / positions if "planar" in times else None)
        theirs.append(times["C"] / positions if "C" in times else None)
    return Long(name, tuple(links), tuple(ours), tuple(theirs), max(errors))


def _error(linkage: Pinned, position: Any, turned: Array) -> float:
    """The greatest error as a part of the greatest coordinate; NaN where a position is not given."""
    found = np.repeat(linkage.places[:, :, None], len(turned), axis=2)
    for joint in range(len(found)):
        if f"P{joint}" in position:
            found[joint] = np.asarray(position[f"P{joint}"]).T
    greatest = float(np.abs(found).max())
    if linkage.tape is not None:
        return float(np.abs(found - closed_form(linkage.tape, turned, 0, rates=False)).max()) / greatest
    apart = [np.hypot(*(found[a] - found[b])) for bar in linkage.bars for a, b in pairwise(bar)]
    return float(max(np.abs(each - each[0]).max() for each in apart)) / greatest
