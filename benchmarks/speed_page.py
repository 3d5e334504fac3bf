"""The guide's page on speed: its tables and plots, written between their markers from one run's measurements."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path

from benchmarks import plots
from benchmarks.compiling import Compiling
from benchmarks.contests import Result
from benchmarks.curves import Curve
from benchmarks.long import Long
from benchmarks.processes import Process
from benchmarks.tables import time

START, END = "<!-- benchmarks -->", "<!-- /benchmarks -->"
PAGE, PICTURES_FOLDER = "planar/guide/look-up/speed.md", "planar/guide/pictures"
PICTURES = {"designs": "time-designs.png", "links": "time-links.png"}


Tables = tuple[Sequence[Long], Sequence[Compiling], Sequence[Process]]


def write(
    root: Path,
    versions: str,
    results: Iterable[Result],
    designs: Sequence[Curve],
    links: Sequence[Curve],
    tables: Tables = ((), (), ()),
) -> None:
    """The page and its two plots. Raises ValueError where the page has no markers."""
    page = root / PAGE
    text = page.read_text(encoding="utf-8")
    if text.count(START) != 1 or text.count(END) != 1 or text.index(END) < text.index(START):
        raise ValueError(f"{PAGE} has no {START} before an {END}")
    for what, title, along, curves in (
        ("designs", "Four-bars, 200 steps round, positions", "designs in one call", designs),
        ("links", "One row of four-bars, over a turn, positions", "links", links),
    ):
        path = root / PICTURES_FOLDER / PICTURES[what]
        path.parent.mkdir(exist_ok=True, parents=True)
        plots.save(path, title, along, curves)
    before, after = text.split(START)[0], text.split(END)[1]
    page.write_text(f"{before}{START}\n{section(versions, results, tables)}\n{END}{after}", encoding="utf-8")


def section(versions: str, results: Iterable[Result], tables: Tables = ((), (), ())) -> str:
    """What stands between the markers, as Markdown."""
    lines = [
        f"{versions}.",
        "",
        "| | system | a position | with velocities and accelerations | times C | greatest error | refused (wrongly) |",
        "|---|---|---|---|---|---|---|",
    ]
    by_contest: dict[str, dict[str, dict[bool, Result]]] = {}
    for each in results:
        by_contest.setdefault(each.contest, {}).setdefault(each.system, {})[each.rates] = each
    for contest, systems in by_contest.items():
        for index, (system, found) in enumerate(sorted(systems.items(), key=lambda item: _key(item[1]))):
            lines.append(f"| {contest if not index else ''} | {system} | {_row(found)} |")
    long, code, processes = tables
    lines += [*_long(long), *_code(code), *_processes(processes)]
    lines += [
        "",
        f"![Time a position against the number of designs](../pictures/{PICTURES['designs']})",
        "",
        f"![Time a position against the number of links](../pictures/{PICTURES['links']})",
    ]
    return "\n".join(lines)


def _long(measured: Sequence[Long]) -> list[str]:
    """Time a position and link, as Markdown; planar's, with its ratio to that of C."""
    if not measured:
        return []
    sizes = sorted({round(links, -1) for each in measured for links in each.links})
    lines = ["", f"| a position and link, of links: | {' | '.join(f'{size:,}' for size in sizes)} | greatest error |"]
    lines.append("|---|" + "---|" * (len(sizes) + 1))
    for each in measured:
        cells = []
        for ours, theirs in zip(each.planar, each.limit, strict=True):
            shown = "not waited for" if ours is None else time(ours)
            cells.append(shown if ours is None or theirs is None else f"{shown} ({ours / theirs:.3g} times C)")
        lines.append(f"| {each.structure} | {' | '.join(cells)} | {each.error:.0e} |")
    return lines


def _code(measured: Sequence[Compiling]) -> list[str]:
    if not measured:
        return []
    lines = ["", "| machine code, with velocities and accelerations | printed | compiled | read by another process |"]
    lines.append("|---|---|---|---|")
    for each in measured:
        times = " | ".join(time(seconds) for seconds in (each.printing, each.compiling, each.reading))
        lines.append(f"| {each.structure} | {times} |")
    return lines


def _processes(measured: Sequence[Process]) -> list[str]:
    if not measured:
        return []
    lines = ["", "| a whole process | time | ratio |", "|---|---|---|"]
    for each in measured:
        remark = f", {each.remark}" if each.remark else ""
        lines.append(f"| `{each.command}`{remark} | {time(each.seconds)} | {each.ratio:.2g} |")
    return lines


def _key(found: dict[bool, Result]) -> float:
    return min(each.seconds for each in found.values())


def _row(found: dict[bool, Result]) -> str:
    both = [found.get(rates) for rates in (False, True)]
    there = [each for each in both if each is not None]
    times = " | ".join("" if each is None else time(each.seconds) for each in both)
    ratios = " / ".join("-" if each is None else f"{each.ratio:.3g}" for each in both)
    error = max(each.error for each in there)
    most = max(there, key=lambda each: each.designs)
    return f"{times} | {ratios} | {error:.0e} | {most.refused} of {most.designs} ({max(e.wrong for e in there)})"
