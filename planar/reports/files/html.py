"""Tables and sentences of the terminal as HTML, for notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planar.reports.fitted_table import FittedTable

CELL_STYLE = "padding:1px 8px"


def to_html(renderable: RenderableType) -> str:
    """Tables, texts and groups of them; all that they say is escaped."""
    if isinstance(renderable, Group):
        return "".join(to_html(each) for each in renderable.renderables)
    if isinstance(renderable, FittedTable):
        heads = [(column.label, column.has_words) for column in renderable.columns]
        return _table_html(renderable.title, heads, renderable.rows)
    if isinstance(renderable, Table):
        return _grid_html(renderable)
    text = _plain_text(renderable)
    if not text.strip():
        return ""
    heavy = isinstance(renderable, Text) and "bold" in str(renderable.style)
    return f"<p>{f'<b>{escape(text)}</b>' if heavy else escape(text)}</p>"


def _grid_html(table: Table) -> str:
    columns = [list(column.cells) for column in table.columns]
    if not table.show_header:  # a grid of sentences with what they are about before them
        rows = (
            " ".join(filter(None, (_plain_text(cell).strip() for cell in row))) for row in zip(*columns, strict=True)
        )
        return "".join(f"<p>{escape(row)}</p>" for row in rows if row)
    heads = [(column.header, column.justify == "left") for column in table.columns]
    return _table_html(table.title, heads, zip(*columns, strict=True))


def _table_html(
    title: RenderableType | None,
    heads: Sequence[tuple[RenderableType, bool]],
    rows: Iterable[Sequence[RenderableType]],
) -> str:
    """A table under headings, of which each says whether words stand below it."""
    style = [f'style="text-align:{"left" if words else "right"};{CELL_STYLE}"' for _, words in heads]
    named = "".join(
        f'<th scope="col" {s}>{escape(_plain_text(head))}</th>' for (head, _), s in zip(heads, style, strict=True)
    )
    body = "".join(
        f"<tr>{''.join(f'<td {s}>{escape(_plain_text(cell))}</td>' for cell, s in zip(row, style, strict=True))}</tr>"
        for row in rows
    )
    caption = f'<caption style="text-align:left"><b>{escape(_plain_text(title))}</b></caption>' if title else ""
    return f"<table>{caption}<thead><tr>{named}</tr></thead><tbody>{body}</tbody></table>"


def _plain_text(said: RenderableType | None) -> str:
    return said.plain if isinstance(said, Text) else str(said or "")
