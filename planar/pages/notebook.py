"""What a notebook shows: a table, a still picture, and over it the page, whose scripts outputs share."""

from __future__ import annotations

import json
import sys
import zlib
from base64 import b64encode
from functools import cache
from hashlib import sha256
from html import escape
from typing import Any

PAGE_HEIGHT = 720
"""Pixels of a page in a notebook."""
_runs_by_cell: dict[str | None, Any] = {}
"""Of every cell that has shown a page in this session the run in which it last did."""


def must_carry_scripts() -> bool:
    """Whether the output that is made now has to carry the scripts, or may use those of another output.

    It carries them where outputs cannot see one another or nothing is known of the cells (outside Jupyter, in Colab),
    as the first of a session, and where its cell is run again: what it carried before is gone then, and a reader whose
    outputs lack them needs to run but one cell.
    """
    shell = _jupyter_shell()
    if shell is None or "google.colab" in sys.modules:
        return True
    parent = shell.get_parent() or {}
    cell, run = parent.get("metadata", {}).get("cellId"), parent.get("header", {}).get("msg_id")
    first, before = not _runs_by_cell, _runs_by_cell.get(cell)
    _runs_by_cell[cell] = run
    return first or (cell is not None and before is not None and before != run)


def _jupyter_shell() -> Any | None:
    """The shell of a Jupyter kernel that runs this; None where there is none."""
    interactive = sys.modules.get("IPython")
    shell = interactive and interactive.get_ipython()
    return shell if hasattr(shell, "kernel") and hasattr(shell, "get_parent") else None


@cache
def pack_scripts(styles: str, scripts: str) -> tuple[str, str]:
    """Styles and scripts for outputs to share: a key of this version of them, and the text that one carries."""
    text = json.dumps({"styles": styles, "scripts": scripts}).encode()
    return sha256(text).hexdigest()[:16], b64encode(zlib.compress(text, 9)).decode()


def output_html(name: str, table: str, picture: str, page: str) -> str:
    """The HTML of an output: a table, and a still picture that a page covers where the notebook lets it run."""
    image = b64encode(picture.encode()).decode()
    place = f"grid-area:1/1;max-width:100%;max-height:{PAGE_HEIGHT}px;align-self:start"
    shown = f'<img alt="{escape(name)}" src="data:image/svg+xml;base64,{image}" style="{place}">'
    return (
        f'{table}<div style="display:grid">{shown}<iframe title="{escape(name)}" srcdoc="{escape(page)}" '
        f'allow="clipboard-write" style="grid-area:1/1;width:100%;height:{PAGE_HEIGHT}px;border:0;background:Canvas">'
        "</iframe></div>"
    )
