"""A run of positions as the content of a CSV file."""

from __future__ import annotations

import io
from collections.abc import Iterable

import numpy as np

from planar.reports.columns import ReportedSeries, run_columns
from planar.results.motion import Motion

FORMULA_STARTS = ("=", "+", "-", "@", "'")
"""What a formula begins with in spreadsheets, and what marks a text there."""
CSV_BLOCK_ROWS = 500
"""Of a CSV file that are made at a time: enough to be quick, few enough for the memory of many columns."""


def encode_csv(motion: Motion, more: Iterable[ReportedSeries]) -> bytes:
    """A row a position; in the units that go with the mechanism's file, as the heads say."""
    all_columns = tuple(run_columns(motion, more))
    text = io.BytesIO()
    text.write((",".join(csv_cell(column.head) for column in all_columns) + "\n").encode())
    for first in range(0, len(motion), CSV_BLOCK_ROWS):
        block = np.column_stack([column.values[first : first + CSV_BLOCK_ROWS] for column in all_columns]).tolist()
        rows = "".join(",".join(map(repr, row)) + "\n" for row in block)
        text.write(rows.replace("nan", "").encode())  # what is not determined is a blank cell
    return text.getvalue()


def csv_cell(text: str) -> str:
    """A text as a cell, in quotes where it holds what ends a cell (RFC 4180).

    What a spreadsheet would take for a formula has an apostrophe before it, and so has what begins with one: a reader
    takes one apostrophe off.
    """
    text = f"'{text}" if text[:1] in FORMULA_STARTS else text
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n\r') else text
