"""`python -m benchmarks.truth --count N` compares so many random designs; what differs is printed with its seed."""

from __future__ import annotations

import argparse
import os
import sys
from collections import Counter
from concurrent.futures import ProcessPoolExecutor
from itertools import cycle, islice, repeat
from time import perf_counter

from rich.console import Console
from rich.table import Table

from benchmarks.truth.draws import DESIGNS, KINDS, drawn
from benchmarks.truth.judge import Verdict, agrees, verdicts

SHOWN = 40
"""Differing designs of each way and kind of difference that are printed."""


def tried(kind: str, seed: int, designs: int = DESIGNS) -> list[Verdict]:
    """What every way told of the case of a kind and seed; nothing where there is no such case."""
    case = drawn(kind, seed, designs)
    return [] if case is None else verdicts(case)


def main() -> None:
    """Draw, compare, print."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.truth", description=__doc__)
    parser.add_argument("--count", type=int, default=1000, help="designs")
    parser.add_argument("--designs", type=int, default=DESIGNS, help="of a case, which is one mechanism")
    parser.add_argument("--first", type=int, default=0, help="the first seed")
    parser.add_argument("--kinds", nargs="+", choices=list(KINDS), default=list(KINDS), help="of mechanisms")
    parser.add_argument("--workers", type=int, default=os.cpu_count(), help="processes")
    parser.add_argument("--case", nargs=2, metavar=("KIND", "SEED"), help="one case alone, all of it printed")
    wanted = parser.parse_args()
    console = Console(width=200, soft_wrap=True)
    start = perf_counter()
    if wanted.case:
        kind, seed = wanted.case[0], int(wanted.case[1])
        case = drawn(kind, seed, wanted.designs)
        console.print(case)
        told = tried(kind, seed, wanted.designs)
        for each in told:
            console.print(f"design {each.design}, {each.way}: {each.what}. {each.detail}", highlight=False)
    else:
        cases = -(-wanted.count // wanted.designs)
        seeds = (wanted.first + n // len(wanted.kinds) for n in range(cases))
        told = []
        with ProcessPoolExecutor(wanted.workers) as pool:
            for found in pool.map(
                tried, islice(cycle(wanted.kinds), cases), seeds, repeat(wanted.designs), chunksize=4
            ):
                told += found
        _print(console, told, perf_counter() - start)
    sys.exit(any(not agrees(each) for each in told))


def _print(console: Console, told: list[Verdict], seconds: float) -> None:
    designs = len({(each.kind, each.seed, each.design) for each in told})
    table = Table(title=f"{designs:,} designs, {seconds:.0f} s; {SHOWN} of a row at most are listed below")
    for name in ("mechanisms", "way", "what it told beside the general path", "designs"):
        table.add_column(name)
    counts = Counter((each.kind, each.way, each.what) for each in told)
    for (kind, way, what), many in sorted(counts.items()):
        table.add_row(kind, way, what, f"{many:,}")
    console.print(table)
    shown: Counter[tuple[str, str, str]] = Counter()
    for each in told:
        row = each.kind, each.way, each.what
        if not agrees(each) and shown[row] < SHOWN:
            shown[row] += 1
            console.print(
                f"{each.kind} {each.seed} design {each.design}, {each.way}: {each.what}; {each.detail}", highlight=False
            )


if __name__ == "__main__":
    main()
