"""What is printed for a terminal as HTML: the same tables and sentences, for notebooks."""

from __future__ import annotations

from html import escape

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

CELL = "padding:1px 8px"


def html(printed: RenderableType) -> str:
    """Tables, texts and groups of them; all that they say is escaped."""
    if isinstance(printed, Group):
        return "".join(html(each) for each in printed.renderables)
    if isinstance(printed, Table):
        return _table(printed)
    text = _plain(printed)
    if not text.strip():
        return ""
    heavy = isinstance(printed, Text) and "bold" in str(printed.style)
    return f"<p>{f'<b>{escape(text)}</b>' if heavy else escape(text)}</p>"


def _table(table: Table) -> str:
    columns = [list(column.cells) for column in table.columns]
    if not table.show_header:  # a grid of sentences with what they are about before them
        rows = (" ".join(filter(None, (_plain(cell).strip() for cell in row))) for row in zip(*columns, strict=True))
        return "".join(f"<p>{escape(row)}</p>" for row in rows if row)
    sides = ["left" if column.justify == "left" else "right" for column in table.columns]
    style = [f'style="text-align:{side};{CELL}"' for side in sides]
    heads = "".join(
        f'<th scope="col" {s}>{escape(_plain(c.header))}</th>' for c, s in zip(table.columns, style, strict=True)
    )
    body = "".join(
        f"<tr>{''.join(f'<td {s}>{escape(_plain(cell))}</td>' for cell, s in zip(row, style, strict=True))}</tr>"
        for row in zip(*columns, strict=True)
    )
    caption = f'<caption style="text-align:left"><b>{escape(_plain(table.title))}</b></caption>' if table.title else ""
    return f"<table>{caption}<thead><tr>{heads}</tr></thead><tbody>{body}</tbody></table>"


def _plain(said: RenderableType | None) -> str:
    return said.plain if isinstance(said, Text) else str(said or "")
