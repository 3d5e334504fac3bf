"""`python -m benchmarks.synthesis` measures what planar.synthesise finds; results are kept, so that it goes on where it
was interrupted, and `--write` writes the guide's page from them."""

from __future__ import annotations

import argparse
from pathlib import Path
from time import monotonic

from rich.console import Console
from rich.markdown import Markdown

from benchmarks.processes import ROOT
from benchmarks.synthesis import measured_page
from benchmarks.synthesis.parts import PARTS, Record, Wish, measurements
from benchmarks.synthesis.random_tasks import KINDS
from benchmarks.synthesis.records import append_record, read_records

RESULTS = Path("synthesis-results.jsonl")


def main() -> None:
    """Measure what is not there yet, then print, then write."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.synthesis", description=__doc__)
    parser.add_argument("--parts", nargs="+", choices=list(PARTS), default=list(PARTS), help="what to measure")
    parser.add_argument("--count", type=int, default=200, help="random tasks")
    parser.add_argument("--only", nargs="+", choices=list(KINDS), default=list(KINDS), help="kinds of random tasks")
    parser.add_argument("--results", type=Path, default=RESULTS, help="a file of results, one a line")
    parser.add_argument("--seconds", type=float, default=float("inf"), help="after which nothing new is begun")
    parser.add_argument("--write", action="store_true", help="write the guide's page")
    wanted = parser.parse_args()
    console = Console(width=160)
    end = monotonic() + wanted.seconds
    for part in wanted.parts:
        measure_part(part, Wish(wanted.count, tuple(wanted.only)), wanted.results, end, console)
    records = [*read_records(wanted.results)]
    console.print(Markdown(measured_page.section(records)))
    if wanted.write:
        measured_page.write(ROOT, records)


def measure_part(part: str, wish: Wish, results: Path, end: float, console: Console) -> None:
    """Measure what of a part is not among the results, and add it to them."""
    there = {(record["part"], record["name"]) for record in read_records(results)}
    for name, measure in measurements(part, wish):
        if (part, name) in there:
            continue
        if monotonic() > end:
            return
        record: Record = {"part": part, "name": name} | measure() | {"name": name}
        append_record(results, record)
        console.print(f"{part}, {name}: {record}", highlight=False, soft_wrap=True)


if __name__ == "__main__":
    main()
