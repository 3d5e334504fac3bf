"""Designs that synthesis found as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.document.dimensions import file_dimensions
from planar.foundation.arrays import Array
from planar.model.wording import amount, count_phrase
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import format_or_zero, paragraphs
from planar.reports.tables.design.cognates import cognate_record
from planar.synthesis.exact.complete_synthesis import CompleteSynthesis, ExactDesign
from planar.synthesis.synthesis import Synthesis, SynthesisedDesign, design_record
from planar.synthesis.task.starts import miss_text, motion_kind

MAX_REJECTED = 8
"""Rejected designs whose defects are listed."""


def table(found: Synthesis, files: Sequence[Path]) -> RenderableType:
    """The designs with their misses, where they are written, and the best of those rejected with the reason."""
    entries = count_phrase(found.task.entry_count, "entry is wanted", "entries are wanted")
    parts: list[RenderableType] = [Text(found.task.name, style="bold"), Text(entries), Text()]
    if isinstance(found, CompleteSynthesis):
        parts += [*_complete_parts(found, files), Text()]
    elif len(found):
        parts += [_designs_table(found, files), Text()]
    if found.rejected:
        parts += [_rejected_table(found), Text()]
    return Group(*parts, paragraphs((" -", sentence) for sentence in _remarks(found)))


def _designs_table(found: Synthesis, files: Sequence[Path]) -> FittedTable:
    rows = plain_table(
        "Designs",
        "no.",
        "start",
        "greatest miss",
        "root mean square",
        "of the extent %",
        "input",
        "transmission",
        "cognates",
        *(("file",) if files else ()),
        left=(1, 5, 8),
        keys=1,
    )
    for number, each in enumerate(found, start=1):
        rows.add_row(
            str(number),
            each.start,
            *_misses(found, each),
            input_text(found, each),
            transmission_text(found, each),
            str(len(each.cognates)),
            *_file_cells(files, number),
        )
    return rows


def _file_cells(files: Sequence[Path], number: int) -> tuple[str, ...]:
    """The cell of the file of a design; none where no files are written."""
    return (str(files[number - 1]),) if files else ()


def _dimensions_text(found: Synthesis, design: SynthesisedDesign) -> str:
    """The numbers of a design that were sought, with their units."""
    known = file_dimensions(design.mechanism)
    return ", ".join(
        f"{name} {amount(value, known[name].kind, found.task.units)}" for name, value in design.numbers.items()
    )


def _complete_parts(found: CompleteSynthesis, files: Sequence[Path]) -> Iterator[RenderableType]:
    """How many there are and how many were to be expected, all real ones with their defects, and curves of them."""
    yield from map(Text, found.summary)
    if found.family is not None and len(found):
        yield Text()
        yield _designs_table(found, files)
    elif len(found):
        yield Text()
        file_heading = ("file",) if files else ()
        rows = plain_table("Designs", "no.", "proved", "greatest miss", "defects", *file_heading, left=(3, 4), keys=1)
        for number, design in enumerate(found, start=1):
            proved = "yes" if isinstance(design, ExactDesign) and design.certified else "no"
            defects = "; ".join(design.defects) or "none"
            rows.add_row(str(number), proved, _misses(found, design)[0], defects, *_file_cells(files, number))
        yield rows
    if len(found):
        yield Text("Dimensions")
        yield paragraphs((str(number), _dimensions_text(found, design)) for number, design in enumerate(found, start=1))
    if found.curves:
        yield Text()
        rows = plain_table("Dyads", "pivot", "joint", "dimension", "points", left=(0, 1), keys=2)
        for curve in found.curves:
            pins = curve.circle_points if len(curve.circle_points) else curve.centre_points
            places = int(np.isfinite(pins).all(axis=1).sum())
            rows.add_row(curve.pivot, curve.joint, str(curve.dimension), str(places))
        yield rows


def _rejected_table(found: Synthesis) -> FittedTable:
    rows = plain_table("Rejected", "start", "greatest miss", "defects", left=(0, 2), keys=1)
    for each in found.rejected[:MAX_REJECTED]:
        rows.add_row(each.start, _misses(found, each)[0], "; ".join(each.defects))
    return rows


def _misses(found: Synthesis, design: SynthesisedDesign) -> tuple[str, str, str]:
    if design.error != design.error:
        return "", "", ""
    share = format_or_zero(100.0 * design.greatest_miss / found.size, 100.0) if found.task.wants_places else ""
    greatest, error = (miss_text(found.task, miss, found.size) for miss in (design.greatest_miss, design.error))
    return greatest, error, share


def input_text(found: Synthesis, design: SynthesisedDesign) -> str:
    """How far the input of a design goes."""
    if design.motion is None:
        return ""
    pair, low, high, is_whole, _ = design.motion
    if is_whole:
        return f"{pair} turns fully"
    kind = motion_kind(design.mechanism, pair)
    ends = (amount(each, kind, found.task.units) for each in (low, high))
    return f"{pair} {' to '.join(ends)}"


def transmission_text(found: Synthesis, design: SynthesisedDesign) -> str:
    """The least transmission angle of a design."""
    least = None if design.motion is None else design.motion.least_transmission
    return "" if least is None else amount(least.value, "angle", found.task.units)


def _remarks(found: Synthesis) -> Iterator[str]:
    if len(found) or found.rejected:
        yield "judged by the general path: every entry on one branch of the motion, in its order where that is wanted"
    if len(found.rejected) > MAX_REJECTED:
        yield f"{len(found.rejected) - MAX_REJECTED} more were rejected; --json lists them"
    yield from found.remarks


def record(found: Synthesis, files: Sequence[Path]) -> dict[str, Any]:
    """The designs as JSON values, SI."""
    whole = _complete_record(found) if isinstance(found, CompleteSynthesis) else {}
    return {
        "task": found.task.name,
        "seed": found.seed,
        "is_finished": found.is_finished,
        "size": found.size,
        "designs": [
            _record(each)
            | {"cognates": [cognate_record(one) for one in each.cognates]}
            | ({"file": str(files[k])} if files else {})
            for k, each in enumerate(found)
        ],
        "rejected": [_record(each) for each in found.rejected],
        "remarks": list(found.remarks),
        **whole,
    }


def _record(design: SynthesisedDesign) -> dict[str, Any]:
    own = design_record(design) | {"defects": list(design.defects), "motion": None}
    own["shortages"] = [each._asdict() for each in design.shortages]
    if isinstance(design, ExactDesign):
        own["certified"] = design.certified
    if design.motion is not None:
        least = {name: each._asdict() for name, each in design.motion.transmission.items()}
        own["motion"] = design.motion._asdict() | {"transmission": least}
    return own


def _complete_record(found: CompleteSynthesis) -> dict[str, Any]:
    return {
        "expected": found.expected,
        "found": found.found,
        "complete": found.complete,
        "counted": found.counted,
        "family": None if found.family is None else found.family._asdict(),
        "curves": [
            {
                "pivot": each.pivot,
                "joint": each.joint,
                "dimension": each.dimension,
                "circle_points": _points(each.circle_points),
                "centre_points": _points(each.centre_points),
                "directions": [float(way) if np.isfinite(way) else None for way in each.directions],
            }
            for each in found.curves
        ],
    }


def _points(places: Array) -> list[list[float] | None]:
    return [each.tolist() if np.isfinite(each).all() else None for each in places]
