"""What is printed for a terminal as HTML: the same tables and sentences, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planar.reports.fitted_table import FittedTable

CELL = "padding:1px 8px"


def html(printed: RenderableType) -> str:
    """Tables, texts and groups of them; all that they say is escaped."""
    if isinstance(printed, Group):
        return "".join(html(each) for each in printed.renderables)
    if isinstance(printed, FittedTable):
        heads = [(column.label, column.words) for column in printed.columns]
        return _table(printed.title, heads, printed.rows)
    if isinstance(printed, Table):
        return _grid(printed)
    text = _plain(printed)
    if not text.strip():
        return ""
    heavy = isinstance(printed, Text) and "bold" in str(printed.style)
    return f"<p>{f'<b>{escape(text)}</b>' if heavy else escape(text)}</p>"


def _grid(table: Table) -> str:
    columns = [list(column.cells) for column in table.columns]
    if not table.show_header:  # a grid of sentences with what they are about before them
        rows = (" ".join(filter(None, (_plain(cell).strip() for cell in row))) for row in zip(*columns, strict=True))
        return "".join(f"<p>{escape(row)}</p>" for row in rows if row)
    heads = [(column.header, column.justify == "left") for column in table.columns]
    return _table(table.title, heads, zip(*columns, strict=True))


def _table(
    title: RenderableType | None,
    heads: Sequence[tuple[RenderableType, bool]],
    rows: Iterable[Sequence[RenderableType]],
) -> str:
    """A table under headings, of which each says whether words stand below it."""
    style = [f'style="text-align:{"left" if words else "right"};{CELL}"' for _, words in heads]
    named = "".join(
        f'<th scope="col" {s}>{escape(_plain(head))}</th>' for (head, _), s in zip(heads, style, strict=True)
    )
    body = "".join(
        f"<tr>{''.join(f'<td {s}>{escape(_plain(cell))}</td>' for cell, s in zip(row, style, strict=True))}</tr>"
        for row in rows
    )
    caption = f'<caption style="text-align:left"><b>{escape(_plain(title))}</b></caption>' if title else ""
    return f"<table>{caption}<thead><tr>{named}</tr></thead><tbody>{body}</tbody></table>"


def _plain(said: RenderableType | None) -> str:
    return said.plain if isinstance(said, Text) else str(said or "")
