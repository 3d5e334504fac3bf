"""A run of positions as a workbook (.xlsx): numbers with their units in the heads, and their extremes as formulas."""

from __future__ import annotations

import io
from collections.abc import Iterable
from math import isfinite
from typing import Any

import numpy as np

from planar.foundation.errors import BadInput
from planar.reports.columns import ReportedSeries, RunColumn, run_columns, run_header
from planar.results.motion import Motion

MAX_ROWS, MAX_COLUMNS = 1_048_576, 16_384
"""Of a sheet (ECMA-376, as spreadsheets have them)."""
RUN_SHEET, SUMMARY_SHEET = "run", "extremes"


def require_xlsxwriter() -> None:
    """Make sure that XlsxWriter is there before a long run. Raises BadInput."""
    try:
        import xlsxwriter as _  # noqa: F401
    except ImportError:
        raise BadInput("xlsxwriter", 'workbooks need XlsxWriter: pip install "planar-linkages[xlsx]"') from None


def encode_workbook(motion: Motion, more: Iterable[ReportedSeries] = ()) -> bytes:
    """The columns of a CSV file on a sheet, with the same heads; on a second the least and greatest of each.

    Those are formulas over the first sheet, with the unit of each beside it, so that they follow what is changed there.
    What is not determined is a blank cell. A text is never taken for a formula. Raises BadInput where XlsxWriter is not
    installed, and for more rows or columns than a sheet has.
    """
    require_xlsxwriter()
    import xlsxwriter

    columns = tuple(run_columns(motion, more))
    if len(motion) + 1 > MAX_ROWS or len(columns) > MAX_COLUMNS:
        told = f"{len(motion)} rows of {len(columns)} columns are more than a sheet has; write .csv or .parquet"
        raise BadInput(".xlsx", told)
    content = io.BytesIO()
    with xlsxwriter.Workbook(content, {"in_memory": True, "nan_inf_to_errors": False}) as book:
        book.set_properties({"title": motion.mechanism.name})
        bold = book.add_format({"bold": True, "text_wrap": True, "valign": "top", "bottom": 1})
        _write_run(book.add_worksheet(RUN_SHEET), columns, bold)
        _write_extremes(book.add_worksheet(SUMMARY_SHEET), columns, len(motion), bold, motion)
    return content.getvalue()


def _write_run(sheet: Any, columns: tuple[RunColumn, ...], bold: Any) -> None:
    """A column of the run a column, its head with its unit, which stays in sight."""
    sheet.freeze_panes(1, 1)
    sheet.set_column(0, max(len(columns) - 1, 0), 13)
    for number, column in enumerate(columns):
        sheet.write_string(0, number, column.head, bold)
        for row, value in enumerate(np.asarray(column.values, dtype=float).tolist(), 1):
            if isfinite(value):
                sheet.write_number(row, number, value)


def _write_extremes(sheet: Any, columns: tuple[RunColumn, ...], rows: int, bold: Any, motion: Motion) -> None:
    """Least and greatest of each column by formulas, with what the run is of."""
    from xlsxwriter.utility import xl_range_abs

    sheet.set_column(0, 0, 34)
    sheet.set_column(1, 3, 16)
    for number, head in enumerate(("quantity", "unit", "least", "greatest")):
        sheet.write_string(0, number, head, bold)
    for row, column in enumerate(columns, 1):
        values = np.asarray(column.values, dtype=float)
        known = values[np.isfinite(values)]
        cells = f"{RUN_SHEET}!{xl_range_abs(1, row - 1, rows, row - 1)}"
        sheet.write_string(row, 0, column.name)
        sheet.write_string(row, 1, column.unit)
        for place, (function, found) in enumerate((("MIN", np.min), ("MAX", np.max)), 2):
            sheet.write_formula(row, place, f"={function}({cells})", None, float(found(known)) if known.size else 0.0)
    for row, (key, text) in enumerate(run_header(motion).items(), len(columns) + 2):
        sheet.write_string(row, 0, key)
        sheet.write_string(row, 1, text)
