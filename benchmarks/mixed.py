"""The contest of mixed structures: many random linkages of dyads, no two alike, each over one turn."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

import planar
from benchmarks import dyadic, peers
from benchmarks.contests import LIMIT, Result
from benchmarks.dyadic import DYAD, MOST, closed_form, moving, sketch
from benchmarks.limit import compiled
from benchmarks.peers import by_link
from benchmarks.swept import RATES
from benchmarks.timing import best

Array = np.ndarray

LINKAGES, STOPPING, STEPS = 500, 200, 200
ROUNDS = 4
SAMPLE = 40
"""Errors are taken over so many linkages that go round."""
BLOCK = 32
"""Linkages that numpy solves at a time, so that they stay in the cache."""
NUMPY = "numpy, joint after joint"


@dataclass(frozen=True)
class _Entry:
    """`solve` is timed; `read` gives (2 or 6, steps) of every joint of a linkage, the first of which are not given."""

    system: str
    rates: bool
    solve: Callable[[], Any]
    read: Callable[[Any, int], Array]
    first: int = 0


@dataclass(frozen=True)
class Mixed:
    """So many linkages; times are those of one position of one joint that moves."""

    many: int = LINKAGES
    stops: bool = False
    steps: int = STEPS

    @property
    def name(self) -> str:
        some = " of which some cannot turn" if self.stops else ""
        return f"{self.many:,} random linkages of up to {MOST} joints{some} x {self.steps} steps, a joint that moves"

    def measure(self) -> tuple[Result, ...]:
        """Time everybody, and see what they found."""
        entries = self.entries()
        times = best({index: entry.solve for index, entry in enumerate(entries)}, ROUNDS)
        whole = int(moving(self.tape).sum())
        seconds = [times[k] / (whole * (self.steps + 1 - entry.first)) for k, entry in enumerate(entries)]
        first = {entry.rates: each for entry, each in reversed(list(zip(entries, seconds, strict=True)))}
        return tuple(self.result(entry, each, first[entry.rates]) for entry, each in zip(entries, seconds, strict=True))

    @property
    def tape(self) -> dyadic.Tape:
        return dyadic.random_tape(self.many, self.stops)

    @property
    def turned(self) -> Array:
        """How far the crank has turned (steps + 1,), rad."""
        return 2.0 * np.pi * np.linspace(0.0, 1.0, self.steps + 1)

    def entries(self) -> list[_Entry]:
        """Everybody, the limit first."""
        found, tape = [], self.tape
        limit = compiled()
        if limit is not None:
            for rates in (None, RATES):
                call = limit.tape(tape, self.turned, rates)
                found.append(_Entry(LIMIT, rates is not None, call, lambda told, k: told[_of(tape, k)]))
        found.append(_Entry(NUMPY, False, lambda: _numpy(tape, self.turned), lambda told, k: told[k]))
        places = [sketch(tape, k) for k in range(self.many)]
        found += self._planar(places)
        if "pylinkage" in peers.installed():
            from benchmarks.peers.by_pylinkage import mixed

            found += [_Entry(*each) for each in mixed(tape, places, self.steps)]
        if by_link.is_there():
            found.append(_Entry(*by_link.entry(tape, places, self.turned)))
        return found

    def _planar(self, places: list[Array]) -> list[_Entry]:
        """`planar.sweep_each` on linkages as arrays and as mechanisms, ready and made of the places of their joints."""
        if not (hasattr(planar, "sweep_each") and hasattr(planar, "pinned_linkages")):
            return []
        tape, flat = self.tape, np.concatenate(places)
        ways: dict[str, Callable[[], Any]] = {
            "planar.sweep_each": lambda: dyadic.linkages(tape, flat),
            "planar.sweep_each, of mechanisms": lambda: dyadic.mechanisms(tape, places),
        }

        def read(rates: bool) -> Callable[[Any, int], Array]:
            return lambda told, k: _read(told[k], places[k], rates)

        found = []
        for rates in (False, True):
            for name, build in ways.items():
                ready = build()
                for system, made in ((name, lambda ready=ready: ready), (f"{name}, with building", build)):
                    call = partial(self._swept, made, rates)
                    found.append(_Entry(system, rates, call, read(rates)))
        return found

    def _swept(self, made: Callable[[], Any], rates: bool) -> Any:
        return planar.sweep_each(made(), self.steps, rates=rates, workers=1)

    def result(self, entry: _Entry, seconds: float, first: float) -> Result:
        """What an entry found beside the closed form."""
        told, tape = entry.solve(), self.tape
        off, greatest, refused, wrong = [], [], 0, 0
        for k in range(self.many):
            found = entry.read(told, k)
            last = np.isnan(closed_form(tape, self.turned, k, rates=False)).any(axis=(0, 1))[entry.first :]
            gone = np.isnan(found[:, :2]).any(axis=(0, 1))
            refused += bool(gone.any())
            wrong += not np.array_equal(np.logical_or.accumulate(last), np.logical_or.accumulate(gone))
            if not last.any() and not gone.any() and len(off) < SAMPLE:
                exact = closed_form(tape, self.turned.astype(np.longdouble), k)[:, : found.shape[1], entry.first :]
                greatest.append(np.abs(exact).max(axis=(0, 2)).reshape(-1, 2).max(axis=1))
                off.append(np.abs(found - exact).max(axis=(0, 2)).reshape(-1, 2).max(axis=1) / greatest[-1])
        error = float(np.max(off)) if off else float("nan")
        return Result(self.name, entry.system, entry.rates, seconds, seconds / first, error, self.many, refused, wrong)


def _of(tape: dyadic.Tape, linkage: int) -> slice:
    return slice(tape.first[linkage], tape.first[linkage + 1])


def _read(found: Any, places: Array, rates: bool) -> Array:
    """Every joint of what planar found, those on the frame where they stand."""
    steps = len(found.status)
    told = np.zeros((len(places), 6 if rates else 2, steps))
    told[:, :2] = places[:, :, None]
    orders = (found.position, found.velocity, found.acceleration)[: 3 if rates else 1]
    for joint in range(len(places)):
        for order, values in enumerate(orders):
            if f"P{joint}" in values:
                told[joint, 2 * order : 2 * order + 2] = np.asarray(values[f"P{joint}"]).T
    told[:, :, found.status != 0] = np.nan
    return told


def _numpy(tape: dyadic.Tape, turned: Array) -> list[Array]:
    """All linkages in blocks, joint after joint over all of a block and all steps; (joints, 2, steps) of each."""
    counts = np.diff(tape.first)
    co, si = np.cos(turned), np.sin(turned)
    # linkages of as many joints stand together, so that a block is not longer than it must be
    order = np.argsort(counts, kind="stable")
    told: dict[int, Array] = {}
    for begin in range(0, len(counts), BLOCK):
        block = order[begin : begin + BLOCK]
        longest = int(counts[block].max())
        places = np.zeros((longest, 2, len(block), len(turned)))
        here = np.arange(len(block))
        for joint in range(longest):
            at = np.minimum(tape.first[block] + joint, tape.first[block + 1] - 1)
            kind, (p, q), (a, b, c) = tape.kind[at], tape.of[at].T, tape.size[at].T[:, :, None]
            first, second = places[p, :, here], places[q, :, here]
            e = second - first
            square = (e * e).sum(axis=1)
            with np.errstate(all="ignore"):
                along = 0.5 + 0.5 * (a - b) / square
                across = c * np.sqrt(a / square - along * along)
                x = first[:, 0] + along * e[:, 0] - across * e[:, 1]
                y = first[:, 1] + along * e[:, 1] + across * e[:, 0]
            cranks, joined = (kind == dyadic.CRANK)[:, None], (kind == DYAD)[:, None]
            places[joint, 0] = np.where(joined, x, np.where(cranks, first[:, 0] + a * (b * co - c * si), a))
            places[joint, 1] = np.where(joined, y, np.where(cranks, first[:, 1] + a * (c * co + b * si), b))
        told |= {int(k): places[: counts[k], :, n] for n, k in enumerate(block)}
    return [told[k] for k in range(len(counts))]
