"""Tables as plain text, SVG or HTML."""

from __future__ import annotations

import io
import re

from rich.console import Console, RenderableType
from rich.terminal_theme import DEFAULT_TERMINAL_THEME

from planar.errors import no_format

WIDTH = 124
"""Characters; the widest table of a textbook mechanism takes about 120."""


def written(renderable: RenderableType, suffix: str) -> str:
    """Tables in the format that a file's suffix names. Raises BadInput."""
    console = Console(
        record=True, width=WIDTH, file=io.StringIO(), force_terminal=True, markup=False, emoji=False, highlight=False
    )
    console.print(renderable)
    formats = {
        ".txt": console.export_text,
        ".html": lambda: console.export_html(theme=DEFAULT_TERMINAL_THEME),
        ".svg": lambda: _without_fonts(console.export_svg(title="planar", theme=DEFAULT_TERMINAL_THEME)),
    }
    if suffix not in formats:
        raise no_format(suffix, "tables", formats)
    return formats[suffix]()


def _without_fonts(svg: str) -> str:
    """The picture without fonts from the network: the viewer's own monospaced one serves."""
    return re.sub(r"@font-face\s*\{[^}]*\}|<!--.*?-->", "", svg, flags=re.DOTALL)
