"""A picture as SVG text, without a drawing library: for pages and notebooks, where no font is measured.

Letters stand where a guess of their size finds room. Strokes are black, areas white, unless the page that the SVG
stands in says otherwise: by its colour, and by `--paper` and `--link`.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from math import cos, hypot, radians, sin

import numpy as np

from planar.drawing.paper.boxes import Box, inside
from planar.drawing.paper.pens import FILLS, INK, POINT
from planar.drawing.paper.picture import (
    Arrow,
    Circle,
    Fill,
    Letter,
    Line,
    Mark,
    Pen,
    Picture,
    Spot,
    extent,
)
from planar.drawing.paper.stroke_shapes import Head, head, on, pieces, pointed, sweep

MARGIN = 2.0
"""mm about strokes and letters."""
WIDE, TALL = 0.62, 0.75
"""Of a letter's size: about how wide a character is, and how high a line."""
WAYS = 16
"""Directions in which a letter may stand from its spot."""
REACH = (0.6, 1.6, 3.0, 5.0)
"""mm beyond `away`: how far it may stand."""
LONGEST = 40
"""Characters of a letter that are shown."""
PAPER = "var(--paper,#fff)"


def svg(picture: Picture, title: str = "") -> str:
    """The SVG element of a picture: all strokes and letters, to the scale of its millimetres; it names itself."""
    (left, low), (right, high) = extent(picture.marks)
    strokes = [mark for mark in picture.marks if not isinstance(mark, Letter)]
    letters = list(_lettered([mark for mark in picture.marks if isinstance(mark, Letter)], strokes))
    body = [*(each for mark in strokes for each in _drawn(mark)), *(text for text, _ in letters)]
    for _, box in letters:
        left, low, right, high = min(left, box[0]), min(low, box[1]), max(right, box[2]), max(high, box[3])
    left, low, right, high = left - MARGIN, low - MARGIN, right + MARGIN, high + MARGIN
    wide, tall = right - left, high - low
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{_n(left)} {_n(-high)} {_n(wide)} {_n(tall)}" '
        f'width="{_n(wide)}mm" height="{_n(tall)}mm" role="img" aria-label="{escape(title or picture.title)}" '
        f'stroke-linejoin="round" font-family="sans-serif">'
        f'<rect x="{_n(left)}" y="{_n(-high)}" width="{_n(wide)}" height="{_n(tall)}" fill="{PAPER}"/>'
        f"{''.join(body)}</svg>"
    )


def _drawn(mark: Mark) -> Iterable[str]:
    ink, stroke = INK[mark.pen], _stroke(mark.pen)
    if isinstance(mark, Line):
        kind = "polygon" if mark.closed else "polyline"
        yield f'<{kind} points="{_spots(mark.spots)}" fill="{_fill(mark.fill)}" {stroke}/>'
    elif isinstance(mark, Arrow):
        made = head(mark.tail, mark.head, hypot(mark.head[0] - mark.tail[0], mark.head[1] - mark.tail[1]))
        if made is not None:
            yield f'<polyline points="{_spots((mark.tail, made.end))}" fill="none" {stroke}/>{_head(made, ink.colour)}'
    elif isinstance(mark, Circle):
        yield from _round(mark, stroke)


def _round(mark: Circle, stroke: str) -> Iterable[str]:
    (x, y), radius, tip = mark.centre, abs(mark.radius), pointed(mark)
    if sweep(mark) == 360.0 and tip is None:
        yield f'<circle cx="{_n(x)}" cy="{_n(-y)}" r="{_n(radius)}" fill="{_fill(mark.fill)}" {stroke}/>'
        return
    start, stop = (mark.start, mark.start + sweep(mark)) if tip is None else tip[1:]
    ends = [on(mark, angle) for angle in (start, stop)]
    large = int((stop - start) % 360.0 > 180.0)
    way = " ".join(f"{_n(x)} {_n(-y)}" for x, y in ends[:1]) + f" A {_n(radius)} {_n(radius)} 0 {large} 0 "
    yield f'<path d="M {way}{_n(ends[1][0])} {_n(-ends[1][1])}" fill="{_fill(mark.fill)}" {stroke}/>'
    if tip is not None:
        yield _head(tip[0], INK[mark.pen].colour)


def _head(made: Head, colour: str) -> str:
    return f'<polygon points="{_spots(made.corners)}" fill="{_ink(colour)}"/>'


def _stroke(pen: Pen) -> str:
    ink = INK[pen]
    dashes = f' stroke-dasharray="{" ".join(map(_n, ink.dashes))}"' if ink.dashes else ""
    return f'stroke="{_ink(ink.colour)}" stroke-width="{_n(ink.width)}"{dashes}'


def _ink(colour: str) -> str:
    return "currentColor" if colour == "#000000" else colour


def _fill(fill: Fill) -> str:
    if fill is Fill.NONE:
        return "none"
    return PAPER if fill is Fill.PAPER else f"var(--link,{FILLS[fill]})"


def _spots(spots: Sequence[Spot]) -> str:
    return " ".join(f"{_n(x)},{_n(-y)}" for x, y in spots)


def _n(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _lettered(letters: Sequence[Letter], strokes: Sequence[Mark]) -> Iterable[tuple[str, Box]]:
    """Every letter and its box, where it covers the least of strokes and of letters before it, near rather than far."""
    ends = pieces(strokes).ends
    taken: list[Box] = []
    for letter in letters:
        text = " ".join(letter.text.split())[:LONGEST]
        if not text:
            continue
        size = letter.size * POINT
        wide, tall = WIDE * size * len(text), TALL * size
        if letter.side is not None:
            far = letter.away
            (x, y), (across, up) = letter.at, letter.side
            spots = [(x + across * (far + wide / 2.0), y + up * (far + tall / 2.0))]
        else:
            spots = [
                (
                    letter.at[0] + cos(angle) * (letter.away + far + wide / 2.0),
                    letter.at[1] + sin(angle) * (letter.away + far + tall / 2.0),
                )
                for far in REACH
                for angle in (radians(45.0 + 360.0 * k / WAYS) for k in range(WAYS))
            ]
        boxes = np.array([(x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2) for x, y in spots])
        costs = np.repeat(np.arange(len(REACH)), WAYS)[: len(boxes)].astype(float)
        if len(ends):
            costs += 4.0 * np.maximum(inside(boxes[:, None], ends[None], 0.2), 0.0).sum(axis=1)
        for other in taken:
            meets = (np.minimum(boxes[:, 2:], other[2:]) - np.maximum(boxes[:, :2], other[:2])).min(axis=1)
            costs += 40.0 * np.maximum(meets, 0.0)
        x, y = spots[int(np.argmin(costs))]
        taken.append(Box(x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2))
        slant = ' font-style="italic"' if letter.slanted else ""
        yield (
            f'<text x="{_n(x)}" y="{_n(-y + 0.36 * size)}" font-size="{_n(size)}" text-anchor="middle"{slant} '
            f'fill="currentColor">{escape(text)}</text>',
            taken[-1],
        )
