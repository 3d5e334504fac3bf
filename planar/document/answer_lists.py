"""Lists of answers that students hand in: a CSV file with the seed of the problem in its first line."""

from __future__ import annotations

import csv
import re
from io import StringIO
from math import isfinite
from pathlib import Path
from typing import NamedTuple

from planar.document.cursor import suggest_spelling
from planar.document.files import read_limited
from planar.foundation.errors import BadInput, join_names

COLUMNS = ("student", "variant", "quantity", "value", "unit")
SEED_LINE = re.compile(r"\s*#?\s*seed\s*[:=,;]?\s*(\d{1,18})[\s,;]*", re.IGNORECASE)


class HandedInValue(NamedTuple):
    """A line of a list: who, of which variant, what, the number as it was written (None where it is none), its unit,
    and the place of the line."""

    student: str
    variant: int
    quantity: str
    number: float | None
    unit: str
    place: str


class AnswerList(NamedTuple):
    """A list: the seed of the problem's variants, and its lines."""

    seed: int
    values: tuple[HandedInValue, ...]


MAX_VARIANT = 10_000


def read_answers(path: Path) -> AnswerList:
    """The list in a file: `seed 7`, then a head, then lines of student, variant, quantity, value, unit; separated by
    commas, semicolons or tabs. Raises BadInput with the line."""
    try:
        text = read_limited(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise BadInput(str(path), "this is no text in UTF-8; save the table as CSV (UTF-8)") from None
    first, _, rest = text.partition("\n")
    seed = SEED_LINE.fullmatch(first)
    if seed is None:
        raise BadInput(f"{path}:1", f"the first line names the seed of the problem, as in 'seed 7', not {first[:40]!r}")
    head = rest.partition("\n")[0]
    separator = max(",;\t", key=head.count)
    rows = csv.reader(StringIO(rest), delimiter=separator)
    names = [cell.strip().lower() for cell in next(rows, [])]
    for column in COLUMNS[:-1]:
        if column not in names:
            meant = suggest_spelling(column, names, "is it the column {!r}?") or f"; its head has {join_names(names)}"
            raise BadInput(f"{path}:2", f"there is no column {column!r}{meant}")
    place = {name: names.index(name) for name in COLUMNS if name in names}
    values = []
    for number, row in enumerate(rows, 3):
        cells = {name: row[index].strip() if index < len(row) else "" for name, index in place.items()}
        if any(cells.values()):
            values.append(_read_line(cells, f"{path}:{number}", separator))
    return AnswerList(int(seed[1]), tuple(values))


def _read_line(cells: dict[str, str], place: str, separator: str) -> HandedInValue:
    for column in ("student", "quantity"):
        if not cells[column]:
            raise BadInput(place, f"the line has no {column}")
    if not (cells["variant"].isdecimal() and 1 <= int(cells["variant"]) <= MAX_VARIANT):
        raise BadInput(place, f"the number of a variant is wanted, from 1 on, not {cells['variant']!r:.40}")
    written = cells["value"].replace("−", "-")
    if separator != ",":
        written = written.replace(",", ".")  # where a comma does not separate it may be the decimal one
    try:
        value: float | None = float(written)
    except ValueError:
        value = None
    if value is not None and not isfinite(value):
        value = None
    unit = cells.get("unit", "")
    return HandedInValue(cells["student"], int(cells["variant"]), cells["quantity"], value, unit, place)
