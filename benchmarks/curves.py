"""Time a position against the number of designs, and against the number of links: the two plots' numbers."""

from __future__ import annotations

from dataclasses import dataclass
from importlib import import_module

import numpy as np

from benchmarks import by_planar, peers
from benchmarks.contests import LIMIT, STEPS, TURN
from benchmarks.entry import Array, Entry
from benchmarks.limit import compiled
from benchmarks.long import long_of, row
from benchmarks.swept import SweptFourBar, angles
from benchmarks.swept.row import Row
from benchmarks.timing import best

MANY = (1, 10, 100, 1_000, 10_000)
LINKS = (4, 10, 20, 40)
ROUNDS = 3
LONGEST = {"kimech": 10, "kinepy": 10}
"""Solvers that are not put to rows longer than this, for their time."""


@dataclass(frozen=True)
class Curve:
    """Seconds a position of one system over what grows, and the greatest error (m) along it."""

    system: str
    grows: tuple[int, ...]
    seconds: tuple[float, ...]
    error: float


def against_designs() -> tuple[Curve, ...]:
    """A four-bar over a turn, positions alone; what each needs before it sets out is counted in."""
    swept = SweptFourBar()
    theta = angles(STEPS)
    told: list[tuple[int, Entry]] = []
    for many in MANY:
        d = swept.designs(many)
        limit = compiled()
        if limit is not None:
            call = limit.sweep(swept.limit, d, theta)
            told.append((many, Entry(LIMIT, False, np.arange(many), np.arange(len(theta)), call, _move)))
        for entry in (*by_planar.sweeps(swept, d, STEPS), *peers.sweeps(swept, d, theta)):
            if len(entry.designs) == many and (not entry.rates or entry.system.startswith("planar.cycle")):
                told.append((many, entry))
    exact = {many: swept.motion(swept.designs(many), theta)[:2] for many in MANY}
    return _curves(told, exact)


def against_links() -> tuple[Curve, ...]:
    """One row of four-bars over a turn, positions alone; longer ones where a solver takes them."""
    told: list[tuple[int, Entry]] = []
    theta = angles(TURN)
    exact = {}
    for links in LINKS:
        row = Row(links)
        exact[links] = row.motion(np.empty((0, 1)), theta.astype(np.longdouble))
        limit = compiled()
        if limit is not None:
            call = limit.row(row.cells, theta)
            told.append((links, Entry(LIMIT, False, np.arange(1), np.arange(len(theta)), call, _alone)))
        told += [(links, entry) for entry in by_planar.turns(row, TURN) if not entry.rates]
        for name in peers.installed():
            if name == "pylinkage" or links > LONGEST.get(name, LINKS[-1]):
                continue
            entries = import_module(f"benchmarks.peers.{peers.PACKAGES[name]}").entries(row, theta)
            told += [(links, entry) for entry in entries if not entry.rates]
    return _lengthen(_curves(told, exact))


def _lengthen(curves: tuple[Curve, ...]) -> tuple[Curve, ...]:
    """The same, with rows of up to ten thousand links by `planar.sweep_each`, and by C."""
    found = long_of("rows of four-bars")
    # its error is a part of the greatest coordinate
    error = found.error * float(np.abs(row(found.links[-1]).places).max())

    def known(seconds: tuple[float | None, ...], after: int) -> list[tuple[int, float]]:
        both = zip(found.links, seconds, strict=True)
        return [(links, each * links) for links, each in both if each is not None and links > after]

    told = []
    for curve in curves:
        more = known(found.limit, curve.grows[-1]) if curve.system == LIMIT else []
        grows, seconds = (*curve.grows, *(n for n, _ in more)), (*curve.seconds, *(each for _, each in more))
        told.append(Curve(curve.system, grows, seconds, curve.error))
    ours = known(found.planar, 0)
    if ours:
        told.append(Curve("planar.sweep_each", *zip(*ours, strict=True), error))
    return tuple(told)


def _curves(told: list[tuple[int, Entry]], exact: dict[int, Array]) -> tuple[Curve, ...]:
    """A curve for each system, without the points at which it refused a position."""
    off = [_off(entry, exact[grows]) for grows, entry in told]
    solved = [index for index, error in enumerate(off) if not np.isnan(error)]
    times = best({index: told[index][1].solve for index in solved}, ROUNDS)
    curves = []
    for system in dict.fromkeys(told[index][1].system for index in solved):
        mine = [index for index in solved if told[index][1].system == system]
        seconds = tuple(times[index] / told[index][1].positions for index in mine)
        curves.append(
            Curve(system, tuple(told[index][0] for index in mine), seconds, max(off[index] for index in mine))
        )
    return tuple(curves)


def _off(entry: Entry, exact: Array) -> float:
    """The greatest error (m); NaN where a position is not given."""
    found = entry.read(entry.solve())[:2]
    return float(np.max(np.abs(found - exact[:, entry.steps][:, :, entry.designs])))


def _move(found: Array) -> Array:
    return np.moveaxis(found, 1, 0)


def _alone(found: Array) -> Array:
    return found[:, :, None].copy()
