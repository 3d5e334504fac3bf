"""The text of tables as spreadsheets save them: alphabets, separators, and numbers with a decimal point or comma."""

from __future__ import annotations

import re
from codecs import BOM_UTF8, BOM_UTF16_BE, BOM_UTF16_LE
from math import isfinite

SEPARATOR_LINE = re.compile(r"sep=.\s*$", re.IGNORECASE)
"""What some spreadsheets write in front."""
THOUSANDS_BLANK = re.compile(r"(?<=\d)[ \u00a0\u202f](?=\d{3}(?!\d))")
NUMBER = re.compile(r"([+-]?[\d.,]*\d[\d.,]*(?:[eE][+-]?\d+)?)\s*(|[^\d\s.,].*)")
MAX_CELL_LENGTH = 100
"""Characters that are looked at."""


def choose_separator(head: str) -> str:
    """What parts the cells of a table with this head: a comma, a semicolon or a tab."""
    return max(",;\t", key=head.count)


def decode_text(content: bytes) -> str:
    """The text of a file as spreadsheets write it: in UTF-8 or UTF-16 with a mark in front, in UTF-8 without, or in the
    alphabet of western Windows."""
    for mark, name in ((BOM_UTF8, "utf-8-sig"), (BOM_UTF16_LE, "utf-16"), (BOM_UTF16_BE, "utf-16")):
        if content.startswith(mark):
            return content.decode(name, errors="replace")
    try:
        return content.decode("utf-8")
    except UnicodeDecodeError:
        return content.decode("cp1252", errors="replace")


def read_number(written: str) -> tuple[float | None, str]:
    """The number of a cell, with a decimal point or comma, or None; and the unit that stands behind it."""
    plain = THOUSANDS_BLANK.sub("", written[: MAX_CELL_LENGTH + 1].replace("−", "-"))
    parts = NUMBER.fullmatch(plain) if len(written) <= MAX_CELL_LENGTH else None
    if parts is None:
        return None, ""
    digits, unit = parts.groups()
    marks = [each for each in digits if each in ".,"]
    if len(set(marks)) > 1 or marks.count(",") > 1:  # the other one, or each of many, parts thousands
        decimal = marks[-1] if marks.count(marks[-1]) == 1 else ""
        digits = "".join(each for each in digits if each not in ".," or each == decimal)
    try:
        value = float(digits.replace(",", "."))
    except ValueError:
        return None, ""
    return (value if isfinite(value) else None), unit.strip()
