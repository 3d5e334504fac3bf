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

from benchmarks.truth.comparison import Verdict, agrees, compare_case
from benchmarks.truth.random_cases import DESIGNS, KINDS, random_case

SHOWN = 40
"""Differing designs of each way and kind of difference that are printed."""


def compare_random_case(kind: str, seed: int, designs: int = DESIGNS) -> list[Verdict]:
    """The verdicts over the case of a kind and seed; none where there is no such case."""
    case = random_case(kind, seed, designs)
    return [] if case is None else compare_case(case)


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
        case = random_case(kind, seed, wanted.designs)
        console.print(case)
        verdicts = compare_random_case(kind, seed, wanted.designs)
        for each in verdicts:
            console.print(f"design {each.design}, {each.way}: {each.what}. {each.detail}", highlight=False)
    else:
        cases = -(-wanted.count // wanted.designs)
        seeds = (wanted.first + n // len(wanted.kinds) for n in range(cases))
        verdicts = []
        with ProcessPoolExecutor(wanted.workers) as pool:
            for found in pool.map(
                compare_random_case, islice(cycle(wanted.kinds), cases), seeds, repeat(wanted.designs), chunksize=4
            ):
                verdicts += found
        _print(console, verdicts, perf_counter() - start)
    sys.exit(any(not agrees(each) for each in verdicts))


def _print(console: Console, verdicts: list[Verdict], seconds: float) -> None:
    designs = len({(each.kind, each.seed, each.design) for each in verdicts})
    table = Table(title=f"{designs:,} designs, {seconds:.0f} s; {SHOWN} of a row at most are listed below")
    for name in ("mechanisms", "way", "beside the general path", "designs"):
        table.add_column(name)
    counts = Counter((each.kind, each.way, each.what) for each in verdicts)
    for (kind, way, what), many in sorted(counts.items()):
        table.add_row(kind, way, what, f"{many:,}")
    console.print(table)
    shown: Counter[tuple[str, str, str]] = Counter()
    for each in verdicts:
        row = each.kind, each.way, each.what
        if not agrees(each) and shown[row] < SHOWN:
            shown[row] += 1
            console.print(
                f"{each.kind} {each.seed} design {each.design}, {each.way}: {each.what}; {each.detail}", highlight=False
            )


if __name__ == "__main__":
    main()
