"""Every assembly of large groups against random starts: `python -m benchmarks.modes 20000` prints counts and times.

Inversions of six-bar, eight-bar and ten-bar linkages of random dimensions, whose crank drives one group of four, six or
eight links. All its assemblies are listed, certified, and compared with where Newton's method leads from random starts.
"""

from __future__ import annotations

import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import repeat
from time import perf_counter
from typing import NamedTuple

import numpy as np
from rich.console import Console
from rich.progress import Progress
from rich.table import Table

from benchmarks.timing import best
from planar.assemblies.block_roots import block_roots
from planar.assemblies.polynomial.completeness import Completeness
from tests.inversions import group, listed, missed, structures

CHUNK = 50
STARTS = 40
KINDS = {"triad, six-bar": (4, 12), "three loops, eight-bar": (6, 24), "four loops, ten-bar": (8, 6)}
"""Links of the group, and in how many ways they are joined."""
SHARES = {4: 0.48, 6: 0.48, 8: 0.04}
"""Of the linkages that are compared: how many have a group of so many links."""


class LinkageComparison(NamedTuple):
    """What came out of one linkage: its complex solutions, its assemblies, how surely they are all, and what failed."""

    links: int
    complex: int
    real: int
    complete: str
    failed: str


def compare_linkage(seed: int) -> LinkageComparison:
    """One linkage, listed and compared."""
    rng = np.random.default_rng(seed)
    links = int(rng.choice(list(SHARES), p=list(SHARES.values())))
    count = next(many for size, many in KINDS.values() if size == links)
    joints = structures(links, count)[int(rng.integers(count))]
    built = group(joints, rng)
    setup = built.setup
    found = block_roots(setup, setup.equations.blocks[0], np.zeros(len(built.z)))
    failed = "" if listed(setup, found, built.z) else "as built is not listed"
    if not failed and missed(setup, found, rng, STARTS):
        failed = "a start found one more"
    if not failed and (found.found != found.expected or found.complete is Completeness.NOT):
        failed = "not all complex solutions found"
    return LinkageComparison(links, found.expected or 0, len(found.real), found.complete.value, failed)


def _chunk(first: int, many: int) -> list[tuple[int, LinkageComparison]]:
    return [(seed, compare_linkage(seed)) for seed in range(first, min(first + CHUNK, many))]


def times() -> Table:
    """What one group takes: the first of its structure, and each after it."""
    table = Table(title="all assemblies of one group")
    for name in ("group", "complex", "the first", "listed", "listed and certified", "how surely"):
        table.add_column(name, justify="left" if name in ("group", "how surely") else "right")
    for name, (links, count) in KINDS.items():
        for joints in structures(links, count)[:3]:
            built = group(joints, np.random.default_rng(1))
            setup, z = built.setup, np.zeros(len(built.z))
            stage = setup.equations.blocks[0]
            start = perf_counter()
            found = block_roots(setup, stage, z)
            first = perf_counter() - start
            took = best(
                {certify: lambda c=certify, s=setup, g=stage, z=z: block_roots(s, g, z, c) for certify in (False, True)}
            )
            row = (f"{1e3 * each:.1f} ms" for each in (first, took[False], took[True]))
            table.add_row(name, str(found.expected), *row, found.complete.value)
    return table


def main() -> None:
    """Print times, compare so many linkages, and print what came out."""
    many = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    console = Console()
    console.print(times())
    counts: dict[tuple[int, int, str], dict[int, int]] = {}
    failures: list[tuple[int, str]] = []
    start = perf_counter()
    with ProcessPoolExecutor() as pool, Progress(console=console, disable=not console.is_terminal) as progress:
        chunks = range(0, many, CHUNK)
        for each in progress.track(pool.map(_chunk, chunks, repeat(many)), total=len(chunks)):
            for seed, one in each:
                of = counts.setdefault((one.links, one.complex, one.complete), {})
                of[one.real] = of.get(one.real, 0) + 1
                if one.failed:
                    failures.append((seed, one.failed))
    table = Table(title=f"{many} linkages against {STARTS} random starts each, {perf_counter() - start:.0f} s")
    for name in ("links", "complex", "how surely", "linkages", "with so many real ones"):
        table.add_column(name)
    for (links, complex_, complete), of in sorted(counts.items()):
        real = ", ".join(f"{number}: {of[number]}" for number in sorted(of))
        table.add_row(str(links), str(complex_), complete, str(sum(of.values())), real)
    console.print(table)
    console.print(f"failed: {failures}" if failures else "nothing was found that is not listed")
    sys.exit(bool(failures))


if __name__ == "__main__":
    main()
