"""Tables to files: plain text, SVG or HTML."""

from __future__ import annotations

import io
import re
from pathlib import Path

from rich.console import Console, RenderableType
from rich.terminal_theme import DEFAULT_TERMINAL_THEME

from planar.errors import BadInput

WIDTH = 124
"""Characters; the widest table of a textbook mechanism takes about 120."""


def save(renderable: RenderableType, path: Path) -> None:
    """Write tables in the format that the file's name says. Raises BadInput."""
    console = Console(record=True, width=WIDTH, file=io.StringIO(), force_terminal=True)
    console.print(renderable)
    formats = {
        ".txt": console.export_text,
        ".html": lambda: console.export_html(theme=DEFAULT_TERMINAL_THEME),
        ".svg": lambda: _without_fonts(console.export_svg(title="planar", theme=DEFAULT_TERMINAL_THEME)),
    }
    if path.suffix not in formats:
        raise BadInput(str(path), f"tables are written to {', '.join(formats)} files, not {path.suffix or 'this'}")
    try:
        path.write_text(formats[path.suffix](), encoding="utf-8")
    except OSError as problem:
        raise BadInput(str(path), f"the file cannot be written: {problem.strerror}") from None


def _without_fonts(svg: str) -> str:
    """The picture without fonts from the network: the viewer's own monospaced one serves."""
    return re.sub(r"@font-face\s*\{[^}]*\}", "", svg)
