"""Tables as plain text, SVG or HTML."""

from __future__ import annotations

import io
import re
from collections.abc import Callable

from rich.cells import cell_len
from rich.console import Console, RenderableType
from rich.terminal_theme import DEFAULT_TERMINAL_THEME

from planar.foundation.errors import unknown_format_error

DEFAULT_WIDTH = 124
"""Characters, but for what cannot be narrower."""
SUFFIXES = (".txt", ".html", ".svg")


def encode_tables(renderable: RenderableType, suffix: str) -> str:
    """Tables in the format that a file's suffix names. Raises BadInput."""
    console = _print_to_console(renderable, DEFAULT_WIDTH)
    longest = max(map(cell_len, console.export_text(clear=False).splitlines()), default=0)
    if longest > DEFAULT_WIDTH:  # a picture would be cut where its width ends
        console = _print_to_console(renderable, longest)
    formats: dict[str, Callable[[], str]] = {
        ".txt": console.export_text,
        ".html": lambda: console.export_html(theme=DEFAULT_TERMINAL_THEME),
        ".svg": lambda: _without_fonts(console.export_svg(title="planar", theme=DEFAULT_TERMINAL_THEME)),
    }
    if suffix not in formats:
        raise unknown_format_error(suffix, "tables", SUFFIXES)
    return formats[suffix]()


def _print_to_console(renderable: RenderableType, width: int) -> Console:
    """A console on which it stands."""
    console = Console(
        record=True, width=width, file=io.StringIO(), force_terminal=True, markup=False, emoji=False, highlight=False
    )
    console.print(renderable, crop=False)
    return console


def _without_fonts(svg: str) -> str:
    """The picture without fonts from the network: the viewer's own monospaced one serves."""
    return re.sub(r"@font-face\s*\{[^}]*\}|<!--.*?-->", "", svg, flags=re.DOTALL)
