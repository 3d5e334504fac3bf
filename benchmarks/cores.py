"""Two cores against one, and the memory of sweeps that are reduced: `python -m benchmarks.cores` prints both.

Times are the best of several rounds, one worker and two by turns, on two cores. Memory is the most that a process of
its own held at any time, its inputs and what it keeps included.
"""

from __future__ import annotations

import argparse
import os
import resource
import subprocess
import sys
from collections.abc import Callable, Iterator
from time import perf_counter

import numpy as np

import planar
from benchmarks import dyadic
from benchmarks.memory import hold
from tests.builders import designs_around, four_bar
from tests.closed_forms import ROCKER
from tests.known import MODELS

STEPS, ROUNDS = 200, 5
STRUCTURES = 500
"""Structures of which linkages are drawn, each with its joints moved a little."""
REACH = {"reach": "E.bounding_box", "length": "E.path_length"}


def near(many: int) -> tuple[planar.Mechanism, dict[str, np.ndarray]]:
    """Four-bars that all turn."""
    mechanism = four_bar(*ROCKER, 0.8)
    return mechanism, designs_around(mechanism, 0.03, many)


def wide(many: int) -> tuple[planar.Mechanism, dict[str, np.ndarray]]:
    """Four-bars drawn from a wide box, about half of which turn."""
    names = ("AB.length", "BC.length", "DC.length", "AD.D.x")
    drawn = np.random.default_rng(0).uniform(0.2, 1.5, (4, many))
    return four_bar(*ROCKER, 0.8), dict(zip(names, drawn, strict=True))


def six_bar(name: str, many: int) -> tuple[planar.Mechanism, dict[str, np.ndarray]]:
    """A six-bar of the models, in designs near its own."""
    return MODELS[name], designs_around(MODELS[name], 0.005, many)


class Linkages:
    """Random linkages of dyads of up to twenty joints, as arrays."""

    def __init__(self) -> None:
        tape = dyadic.random_tape(STRUCTURES, False)
        made = dyadic.mechanisms(tape, [dyadic.sketch(tape, k) for k in range(STRUCTURES)])
        layouts = [each.layout for each in made]
        pins = max(len(each.pin_positions) for each in layouts)
        self.places = np.full((STRUCTURES, pins, 2), np.nan)
        bars, wide_ = max(len(each.bars) for each in layouts), max(len(bar) for each in layouts for bar in each.bars)
        self.bars = np.full((STRUCTURES, bars, wide_), -1)
        self.frame = np.full((STRUCTURES, max(len(each.frame_pins) for each in layouts)), -1)
        for k, each in enumerate(layouts):
            self.places[k, : len(each.pin_positions)] = each.pin_positions
            for row, bar in enumerate(each.bars):
                self.bars[k, row, : len(bar)] = bar
            self.frame[k, : len(each.frame_pins)] = each.frame_pins
        self.crank = np.array([each.crank for each in layouts])

    def draw(self, seed: int) -> planar.PinnedLinkages:
        """As many as there are structures, no two alike."""
        moved = self.places + np.random.default_rng(seed).normal(0.0, 1e-3, self.places.shape)
        return planar.pinned_linkages(moved, self.bars, self.frame, self.crank, velocity=2.0)


def boxes(each: planar.Each) -> np.ndarray:
    """The boxes that all joints of each linkage stay in (linkages, 4)."""
    rows = each.rows()
    first, path = rows.first[:-1], rows.position
    low, high = np.fmin.reduce(path, axis=1), np.fmax.reduce(path, axis=1)
    return np.concatenate([np.fmin.reduceat(low, first), np.fmax.reduceat(high, first)], axis=1)


def compare_workers() -> Iterator[str]:
    """One worker against two."""
    hold()
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:2])
    linkages = [Linkages().draw(seed) for seed in range(8)]
    tasks: dict[str, Callable[[int], object]] = {
        name: lambda workers, of=of: planar.sweep(*of, STEPS, workers=workers)
        for name, of in (
            ("40,000 near four-bars", near(40_000)),
            ("40,000 four-bars from a wide box", wide(40_000)),
            ("20,000 Watt six-bars", six_bar("watt-six-bar", 20_000)),
            ("10,000 six-bars without a dyad", six_bar("double-butterfly", 10_000)),
        )
    }
    reach = {"boxes": boxes}
    tasks["4,000 linkages of up to 20 joints, reduced"] = lambda workers: planar.sweep_each(
        iter(linkages), STEPS, rates=False, workers=workers, reduce=reach
    )
    for name, task in tasks.items():
        least = {1: np.inf, 2: np.inf}
        for _ in range(ROUNDS):
            for workers, before in least.items():
                began = perf_counter()
                task(workers)
                least[workers] = min(before, perf_counter() - began)
        yield f"{name}: {1e3 * least[1]:.0f} ms by one worker, by two {least[1] / least[2]:.2f} x as fast"


def reduce_designs(many: int) -> str:
    """Near four-bars of which a point's box and path length are kept."""
    began = perf_counter()
    planar.sweep(*near(many), STEPS, dtype="float32", reduce=REACH)
    return f"{many:,} designs x {STEPS}, reduced: {perf_counter() - began:.0f} s, {_peak():.0f} MB at the most"


def reduce_linkages(many: int) -> str:
    """Random linkages, drawn as they are taken, of which the box of all joints is kept."""
    source, began = Linkages(), perf_counter()
    stream = (source.draw(seed) for seed in range(many // STRUCTURES))
    planar.sweep_each(stream, STEPS, rates=False, reduce={"boxes": boxes})
    return f"{many:,} linkages x {STEPS}, reduced: {perf_counter() - began:.0f} s, {_peak():.0f} MB at the most"


def _peak() -> float:
    """The most memory that this process has held, MB."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / (2**20 if sys.platform == "darwin" else 2**10)


def main() -> None:
    """Measure, each by itself, and print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.cores", description="Cores and memory of sweeps.")
    parser.add_argument("--designs", type=int, default=10**7)
    parser.add_argument("--linkages", type=int, default=10**6)
    parser.add_argument("--only", choices=("workers", "designs", "linkages"))
    wanted = parser.parse_args()
    if wanted.only == "workers":
        for line in compare_workers():
            print(line, flush=True)
    elif wanted.only == "designs":
        print(reduce_designs(wanted.designs), flush=True)
    elif wanted.only == "linkages":
        print(reduce_linkages(wanted.linkages), flush=True)
    else:
        for only in ("workers", "designs", "linkages"):
            subprocess.run([sys.executable, "-m", "benchmarks.cores", *sys.argv[1:], "--only", only], check=True)


if __name__ == "__main__":
    main()
