"""Lists of answers that students hand in: a CSV file with the seed of the problem in its first line."""

from __future__ import annotations

import csv
import re
from pathlib import Path
from typing import NamedTuple

from planar.document.files import read_limited
from planar.document.tables.spreadsheet_text import SEPARATOR_LINE, choose_separator, decode_text, read_number
from planar.foundation.errors import BadInput, join_names, suggest_spelling

COLUMNS = ("student", "variant", "quantity", "value", "unit")
SEED_LINE = re.compile(r"#?\s*seed[\s:=,;]*(\d{1,18})", re.IGNORECASE)


class HandedInValue(NamedTuple):
    """A line of a list: who, of which variant, what, the number as it was written (None where it is none), its unit,
    and the number of the line in the file."""

    student: str
    variant: int
    quantity: str
    number: float | None
    unit: str
    line: int


class UnreadLine(NamedTuple):
    """A line of a list that cannot be read, by its number in the file, and a sentence that says why."""

    line: int
    sentence: str


class AnswerList(NamedTuple):
    """A list: the seed of the problem's variants, its lines, and those that cannot be read."""

    seed: int
    values: tuple[HandedInValue, ...]
    unread: tuple[UnreadLine, ...] = ()


MAX_VARIANT = 1000
"""As many variants as a problem has at most."""
MAX_VARIANT_DIGITS = 9
"""Digits that are looked at."""


def read_answers(path: Path) -> AnswerList:
    """The list in a file as spreadsheets save it: `seed 7`, then a head, then lines of student, variant, quantity,
    value, unit; separated by commas, semicolons or tabs. Raises BadInput where it is no such list."""
    lines = decode_text(read_limited(path)).splitlines()
    told = [number for number, line in enumerate(lines) if _cells_text(line) and not SEPARATOR_LINE.match(line)]
    first = told[0] if told else 0
    seed = SEED_LINE.fullmatch(_cells_text(lines[first])) if lines else None
    if seed is None:
        shown = lines[first][:40] if lines else ""
        raise BadInput(
            f"{path}:{first + 1}", f"the first line names the seed of the problem, as in 'seed 7', not {shown!r}"
        )
    if len(told) == 1:
        raise BadInput(str(path), f"after the seed come the columns {join_names(COLUMNS)}, and a line for each value")
    head = told[1]
    separator = choose_separator(lines[head])
    rows = csv.reader(lines[head:], delimiter=separator)
    values, unread = [], []
    try:
        names = [cell.strip().lower() for cell in next(rows)]
        columns = _find_columns(names, f"{path}:{head + 1}")
        for row in rows:
            cells = {name: row[index].strip() if index < len(row) else "" for name, index in columns.items()}
            if not any(cells.values()):
                continue
            try:
                if any(cell.strip() for cell in row[len(names) :]):
                    quoted = "; a number with a decimal comma stands in quotes" if separator == "," else ""
                    raise BadInput("line", f"the line has more cells than the head{quoted}")
                values.append(_read_line(cells, head + rows.line_num))
            except BadInput as problem:
                unread.append(UnreadLine(head + rows.line_num, problem.sentence))
    except csv.Error as problem:
        raise BadInput(f"{path}:{head + rows.line_num}", f"this is no line of a table: {problem}") from None
    return AnswerList(int(seed[1]), tuple(values), tuple(unread))


def _cells_text(line: str) -> str:
    """A line without its quotes and empty cells."""
    return line.replace('"', "").strip(" ,;\t\ufeff")


def _find_columns(names: list[str], place: str) -> dict[str, int]:
    for column in COLUMNS[:-1]:
        if column not in names:
            meant = suggest_spelling(column, names, "is it the column {!r}?") or f"; its head has {join_names(names)}"
            raise BadInput(place, f"there is no column {column!r}{meant}")
    return {name: names.index(name) for name in COLUMNS if name in names}


def _read_line(cells: dict[str, str], line: int) -> HandedInValue:
    place = f"line {line}"
    for column in ("student", "quantity"):
        if not cells[column]:
            raise BadInput(place, f"the line has no {column}")
    variant = cells["variant"].removesuffix(".0").removesuffix(",0")
    if not (variant.isdecimal() and len(variant) <= MAX_VARIANT_DIGITS and 1 <= int(variant) <= MAX_VARIANT):
        wanted = f"the number of a variant is wanted, from 1 to {MAX_VARIANT}"
        raise BadInput(place, f"{wanted}, not {cells['variant']!r:.40}" if variant else f"{wanted}; there is none")
    number, unit = read_number(cells["value"])
    student = " ".join(cells["student"].split())
    return HandedInValue(student, int(variant), cells["quantity"], number, cells.get("unit", "") or unit, line)
