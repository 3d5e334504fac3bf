"""The guide's page on what synthesis was measured to do: its tables, written between their markers from the results."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from benchmarks.synthesis.family_tasks import is_met as is_listed
from benchmarks.synthesis.random_tasks import ALLOWED, KINDS, is_met
from benchmarks.synthesis.six_bar_curves import STRUCTURES
from benchmarks.versions import planar_versions

Record = dict[str, Any]

START, END = "<!-- benchmarks -->", "<!-- /benchmarks -->"
PAGE = "planar/guide/look-up/synthesis-measured.md"
NONE = "none"


def write(root: Path, records: Sequence[Record]) -> None:
    """The page. Raises ValueError where it has no markers."""
    page = root / PAGE
    text = page.read_text(encoding="utf-8")
    if text.count(START) != 1 or text.count(END) != 1 or text.index(END) < text.index(START):
        raise ValueError(f"{PAGE} has no {START} before an {END}")
    before, after = text.split(START)[0], text.split(END)[1]
    page.write_text(f"{before}{START}\n{section(records)}\n{END}{after}", encoding="utf-8")


def section(records: Sequence[Record]) -> str:
    """What stands between the markers, as Markdown."""
    lines = [f"{planar_versions()}."]
    for part, (title, table) in TABLES.items():
        own = [record for record in records if record["part"] == part]
        if own:
            lines += ["", f"### {title}", "", *table(own)]
    return "\n".join(lines)


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]]) -> list[str]:
    lines = [f"| {' | '.join(heads)} |", "|---" * len(heads) + "|"]
    return [*lines, *(f"| {' | '.join(row)} |" for row in rows)]


def _percent(misses: Sequence[float] | None) -> str:
    """Root mean square and greatest, as they stand in a result."""
    return NONE if misses is None else f"{misses[0]:.3g} ({misses[1]:.3g})"


def _number(value: float | None, digits: int = 2) -> str:
    return NONE if value is None else f"{value:.{digits}g}"


def _seconds(record: Record) -> str:
    return f"{record['seconds']:.1f} s"


def _faults(record: Record) -> str:
    return "; ".join(record.get("faults") or record.get("remarks") or record.get("defects") or ())


def _published(records: Sequence[Record]) -> list[str]:
    heads = ("curve", "places", "published linkage", "planar", "time")
    rows = [
        (
            each["name"],
            str(each["places"]),
            "" if each["published"] is None else _percent(each["published"]),
            _percent(each["own"]),
            _seconds(each),
        )
        for each in records
    ]
    return _table(heads, rows)


def _curves(records: Sequence[Record]) -> list[str]:
    structures = [name for name in STRUCTURES if any(each["structure"] == name for each in records)]
    by_curve: dict[str, dict[str, Record]] = {}
    for each in records:
        by_curve.setdefault(each["curve"], {})[each["structure"]] = each
    rows = [
        [curve, *(f"{_percent(own[s]['own'])}, {_seconds(own[s])}" if s in own else "" for s in structures)]
        for curve, own in by_curve.items()
    ]
    return _table(["curve", *structures], rows)


def _random(records: Sequence[Record]) -> list[str]:
    heads = (
        "links",
        "tasks",
        f"greatest miss at most {100 * ALLOWED:g} %",
        "accepted with a defect",
        "median time",
        "longest",
    )
    rows = [_random_row(kind, [each for each in records if each["kind"] == kind]) for kind in KINDS]
    return _table(heads, [row for row in [*rows, _random_row("all", records)] if row])


def _random_row(name: str, records: Sequence[Record]) -> list[str]:
    if not records:
        return []
    met = sum(map(is_met, records))
    faulty = sum(any(own) for each in records for own in each.get("faults", ()))
    seconds = [each["seconds"] for each in records]
    share = f"{met} ({100.0 * met / len(records):.0f} %)"
    return [name, str(len(records)), share, str(faulty), f"{np.median(seconds):.1f} s", f"{max(seconds):.0f} s"]


def _functions(records: Sequence[Record]) -> list[str]:
    heads = ("function", "planar", "three points", "time", "")
    return _table(
        heads,
        [(e["name"], _number(e["own"]), _number(e["three_points"]), _seconds(e), _faults(e)) for e in records],
    )


def _lifting(records: Sequence[Record]) -> list[str]:
    heads = ("task", "places missed by", "angles by, deg", "time", "")
    return _table(
        heads, [(e["name"], _number(e["place"]), _number(e["angle"]), _seconds(e), _faults(e)) for e in records]
    )


def _dwells(records: Sequence[Record]) -> list[str]:
    heads = ("linkage", "still for, deg of the crank", "within, % of the output's motion", "time", "")
    return _table(
        heads, [(e["name"], f"{e['crank']:.0f}", _number(e["error"]), _seconds(e), _faults(e)) for e in records]
    )


def _lines(records: Sequence[Record]) -> list[str]:
    heads = ("linkage", "length, of its longest link", "its departure", "planar's", "time", "")
    return _table(
        heads,
        [
            (e["name"], f"{e['length']:.2f}", _number(e["famous"]), _number(e["own"]), _seconds(e), _faults(e))
            for e in records
        ],
    )


def _beside(records: Sequence[Record]) -> list[str]:
    heads = ("task", "system", "greatest miss", "time", "")
    return _table(heads, [(e["task"], e["system"], _number(e["greatest"]), _seconds(e), e["remark"]) for e in records])


def _families(records: Sequence[Record]) -> list[str]:
    heads = ("entries", "tasks", "draws hold a design", "listed there, too", "listed in all", "median time")
    rows = []
    for kind in dict.fromkeys(each["kind"] for each in records):
        own = [each for each in records if each["kind"] == kind]
        held = [each for each in own if each["drawn"]]
        counts = (len(own), len(held), sum(map(is_listed, held)), sum(each["listed"] > 0 for each in own))
        rows.append((kind, *map(str, counts), f"{np.median([each['seconds'] for each in own]):.1f} s"))
    return _table(heads, rows)


TABLES: dict[str, tuple[str, Callable[[Sequence[Record]], list[str]]]] = {
    "published": ("Published curves by four-bars: root mean square (greatest) in %", _published),
    "curves": ("Curves beyond four-bars: root mean square (greatest) in %", _curves),
    "random": ("Tasks made from random linkages", _random),
    "functions": ("Functions by four-bars: structural error in % of the output's swing", _functions),
    "lifting": ("Poses by four-bars: greatest misses, of places in % of their extent", _lifting),
    "dwells": ("Dwells", _dwells),
    "lines": ("Straight lines: departures in % of the line's length", _lines),
    "beside": ("Beside pylinkage: greatest miss in % of the extent", _beside),
    "families": ("Tasks that leave numbers open, beside 20,000 random draws", _families),
}
"""Of each part its title and its table."""
