"""Tables of what was measured: a CSV file with heads as the project's own run files have them, as "C x [mm]"."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import NamedTuple

from planar.document.files import read_limited
from planar.document.tables.spreadsheet_text import SEPARATOR_LINE, choose_separator, decode_text, read_number
from planar.foundation.errors import BadInput

HEAD = re.compile(r"'?\s*(.*?)\s*(?:\[\s*([^\]]*?)\s*\]|\(\s*([^)]*?)\s*\))?\s*")
MAX_ROWS = 100_000


class MeasuredColumn(NamedTuple):
    """A column: its name, its unit as it is written or nothing, and its numbers, None where a cell is blank."""

    name: str
    unit: str
    numbers: tuple[float | None, ...]


class MeasuredTable(NamedTuple):
    """The columns of a file, and the line in the file of each row."""

    path: Path
    columns: tuple[MeasuredColumn, ...]
    lines: tuple[int, ...]


def read_measured_table(path: Path) -> MeasuredTable:
    """The table in a file, as spreadsheets save it; commas, semicolons or tabs part its cells. Raises BadInput."""
    lines = decode_text(read_limited(path)).splitlines()
    head = next((k for k, line in enumerate(lines) if line.strip(' ",;\t') and not SEPARATOR_LINE.match(line)), None)
    if head is None:
        raise BadInput(str(path), "the file is empty; its first line names the columns, as 'C x [mm],C y [mm]'")
    separator = choose_separator(lines[head])
    rows = csv.reader(lines[head:], delimiter=separator)
    told: list[list[float | None]] = []
    where: list[int] = []
    try:
        heads = [_read_head(cell) for cell in next(rows)]
        for row in rows:
            if not any(cell.strip() for cell in row):
                continue
            line = head + rows.line_num
            if any(cell.strip() for cell in row[len(heads) :]):
                quoted = "; a number with a decimal comma stands in quotes" if separator == "," else ""
                raise BadInput(f"{path}:{line}", f"the line has more cells than the head{quoted}")
            cells = [*row, *[""] * (len(heads) - len(row))]
            told.append(
                [_read_cell(cell, f"{path}:{line}", name) for cell, (name, _) in zip(cells, heads, strict=False)]
            )
            where.append(line)
            if len(told) > MAX_ROWS:
                raise BadInput(str(path), f"the file has more than {MAX_ROWS} lines")
    except csv.Error as problem:
        raise BadInput(f"{path}:{head + rows.line_num}", f"this is no line of a table: {problem}") from None
    if not told:
        raise BadInput(str(path), "after the line that names the columns comes a line for each sample; there is none")
    columns = zip(heads, zip(*told, strict=True), strict=True)
    named = tuple(MeasuredColumn(name, unit, numbers) for (name, unit), numbers in columns if name)
    for k, each in enumerate(named):
        if each.name in {other.name for other in named[:k]}:
            raise BadInput(f"{path}:{head + 1}", f"the column {each.name!r} stands twice")
    return MeasuredTable(path, named, tuple(where))


def _read_head(cell: str) -> tuple[str, str]:
    """The name and the unit of a column."""
    found = HEAD.fullmatch(cell.strip("\ufeff "))
    return (" ".join(found[1].split()), found[2] or found[3] or "") if found else (cell.strip(), "")


def _read_cell(cell: str, place: str, column: str) -> float | None:
    written = cell.strip()
    if not written or written.lower() in ("nan", "null", "none"):
        return None
    number, unit = read_number(written)
    if number is None or unit:
        raise BadInput(place, f"in the column {column!r} a number is wanted, not {written!r:.40}")
    return number
