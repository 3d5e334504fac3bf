"""What scripts and styles of a page have from Python's drawing: the table of symbols, and the pens."""

from __future__ import annotations

import json
from enum import Enum
from functools import cache
from typing import Any

from planar.drawing.paper.pens import PEN_STYLES
from planar.drawing.paper.picture import Fill, Pen
from planar.drawing.scheme import symbol_table

DIGITS = 5
"""Of the numbers of symbols (mm, rad)."""
SOFT_PENS, SCRIPT_PENS = (Pen.PITCH,), (Pen.LINK, Pen.PIN, Pen.GROUND, Pen.HATCH, Pen.PITCH, Pen.BAND, Pen.INPUT)
FILL_TONES = {Fill.PAPER: "paper", Fill.LINK: "link", Fill.SOLID: "ink"}
"""Colours of areas by the names that a page has for them, where it is light and where it is dark."""


@cache
def symbol_script() -> str:
    """The constants of the scripts: the strokes of every symbol."""
    symbols = {name: [_plain(stroke._asdict()) for stroke in strokes] for name, strokes in symbol_table.SYMBOLS.items()}
    constants = {"SYMBOLS": symbols}
    return "\n".join(f"const {name} = {json.dumps(value, separators=(',', ':'))};" for name, value in constants.items())


def _plain(value: Any) -> Any:
    """What JSON can hold."""
    if isinstance(value, dict):
        return {name: _plain(part) for name, part in value.items()}
    if isinstance(value, tuple):
        return [_plain(part) for part in value]
    if isinstance(value, Enum):
        return value.value
    return round(value, DIGITS) if isinstance(value, float) else value


@cache
def pen_styles() -> str:
    """The pens and fills of the moving picture as classes, as wide as on paper."""
    lines = []
    for pen in SCRIPT_PENS:
        style = PEN_STYLES[pen]
        tone = "soft" if pen in SOFT_PENS else "drive" if pen is Pen.INPUT else "ink"
        dashes = " ".join(f"calc(var(--mm) * {each:g}px)" for each in style.dashes)
        dashed = f" stroke-dasharray: {dashes};" if dashes else ""
        width = f"calc(var(--mm) * {style.width:g}px)"
        lines.append(f".mechanism .pen-{pen.value} {{ stroke: var(--{tone}); stroke-width: {width};{dashed} }}")
    lines += [f".mechanism .fill-{fill.value} {{ fill: var(--{tone}); }}" for fill, tone in FILL_TONES.items()]
    return "\n".join(lines)
