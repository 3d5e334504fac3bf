"""A picture as SVG text, without a drawing library: for pages and notebooks, where no font is measured.

Letters stand where a guess of their size finds room. Strokes are black, areas white, unless the page that the SVG
stands in says otherwise: by its colour, and by `--paper` and `--link`; `--pen-c2185b` is what it has for that colour.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from math import cos, hypot, radians, sin

import numpy as np

from planar.drawing.paper.boxes import Box, bounding_boxes, lengths_inside_boxes, nearby_pairs
from planar.drawing.paper.pens import FILL_COLOURS, MM_PER_POINT, PEN_STYLES, PenStyle, pen_style
from planar.drawing.paper.picture import (
    Arrow,
    Circle,
    Fill,
    Label,
    Mark,
    PaperPoint,
    Picture,
    Polyline,
    Stroke,
    extent,
)
from planar.drawing.paper.stroke_shapes import (
    ArrowHead,
    arc_arrow_head,
    arrow_head,
    point_on_circle,
    stroke_segments,
    sweep_angle,
)

MARGIN = 2.0
"""mm about strokes and letters."""
CHARACTER_WIDTH, LINE_HEIGHT = 0.62, 0.75
"""Of a letter's size: about how wide a character is, and how high a line."""
LABEL_DIRECTIONS = 16
"""Directions in which a letter may stand from its spot."""
LABEL_DISTANCES = (0.6, 1.6, 3.0, 5.0)
"""mm beyond `away`: how far it may stand."""
MAX_LABEL_LENGTH = 40
"""Characters of a letter that are shown."""
PAPER_COLOUR = "var(--paper,#fff)"


def svg(picture: Picture, title: str = "") -> str:
    """The SVG element of a picture: all strokes and letters, to the scale of its millimetres; it names itself."""
    (left, low), (right, high) = extent(picture.marks)
    strokes = [mark for mark in picture.marks if not isinstance(mark, Label)]
    letters = list(_label_elements([mark for mark in picture.marks if isinstance(mark, Label)], strokes))
    body = [*(each for mark in strokes for each in _mark_elements(mark)), *(text for text, _ in letters)]
    for _, box in letters:
        left, low, right, high = min(left, box[0]), min(low, box[1]), max(right, box[2]), max(high, box[3])
    left, low, right, high = left - MARGIN, low - MARGIN, right + MARGIN, high + MARGIN
    wide, tall = right - left, high - low
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="{_format_number(left)} '
        f'{_format_number(-high)} {_format_number(wide)} {_format_number(tall)}" '
        f'width="{_format_number(wide)}mm" height="{_format_number(tall)}mm" role="img" '
        f'aria-label="{escape(title or picture.title)}" '
        f'stroke-linejoin="round" font-family="sans-serif">'
        f'<rect x="{_format_number(left)}" y="{_format_number(-high)}" width="{_format_number(wide)}" '
        f'height="{_format_number(tall)}" fill="{PAPER_COLOUR}"/>'
        f"{''.join(body)}</svg>"
    )


def _mark_elements(mark: Stroke) -> Iterable[str]:
    ink = pen_style(mark)
    stroke = _stroke_attributes(ink)
    if isinstance(mark, Polyline):
        kind = "polygon" if mark.closed else "polyline"
        yield f'<{kind} points="{_svg_points(mark.points)}" fill="{_fill_colour(mark.fill)}" {stroke}/>'
    elif isinstance(mark, Arrow):
        made = arrow_head(mark.tail, mark.head, hypot(mark.head[0] - mark.tail[0], mark.head[1] - mark.tail[1]))
        if made is not None:
            yield (
                f'<polyline points="{_svg_points((mark.tail, made.line_end))}" fill="none" '
                f"{stroke}/>{_head_element(made, ink.colour)}"
            )
    elif isinstance(mark, Circle):
        yield from _circle_elements(mark, stroke)


def _circle_elements(mark: Circle, stroke: str) -> Iterable[str]:
    (x, y), radius, tip = mark.centre, abs(mark.radius), arc_arrow_head(mark)
    if sweep_angle(mark) == 360.0 and tip is None:
        yield (
            f'<circle cx="{_format_number(x)}" cy="{_format_number(-y)}" r="{_format_number(radius)}" '
            f'fill="{_fill_colour(mark.fill)}" {stroke}/>'
        )
        return
    start, stop = (mark.start, mark.start + sweep_angle(mark)) if tip is None else tip[1:]
    ends = [point_on_circle(mark, angle) for angle in (start, stop)]
    large = int((stop - start) % 360.0 > 180.0)
    way = (
        " ".join(f"{_format_number(x)} {_format_number(-y)}" for x, y in ends[:1])
        + f" A {_format_number(radius)} {_format_number(radius)} 0 {large} 0 "
    )
    yield (
        f'<path d="M {way}{_format_number(ends[1][0])} {_format_number(-ends[1][1])}" '
        f'fill="{_fill_colour(mark.fill)}" {stroke}/>'
    )
    if tip is not None:
        yield _head_element(tip[0], PEN_STYLES[mark.pen].colour)


def _head_element(made: ArrowHead, colour: str) -> str:
    return f'<polygon points="{_svg_points(made.corners)}" fill="{_css_colour(colour)}"/>'


def _stroke_attributes(ink: PenStyle) -> str:
    dashes = f' stroke-dasharray="{" ".join(map(_format_number, ink.dashes))}"' if ink.dashes else ""
    return f'stroke="{_css_colour(ink.colour)}" stroke-width="{_format_number(ink.width)}"{dashes}'


def pen_variable(colour: str) -> str:
    """By which a page may have another colour for this one."""
    return f"--pen-{colour.removeprefix('#')}"


def _css_colour(colour: str) -> str:
    return "currentColor" if colour == "#000000" else f"var({pen_variable(colour)},{colour})"


def _fill_colour(fill: Fill) -> str:
    if fill is Fill.NONE:
        return "none"
    return PAPER_COLOUR if fill is Fill.PAPER else f"var(--link,{FILL_COLOURS[fill]})"


def _svg_points(spots: Sequence[PaperPoint]) -> str:
    return " ".join(f"{_format_number(x)},{_format_number(-y)}" for x, y in spots)


def _format_number(value: float) -> str:
    return f"{value:.2f}".rstrip("0").rstrip(".")


def _label_elements(letters: Sequence[Label], strokes: Sequence[Mark]) -> Iterable[tuple[str, Box]]:
    """Every letter and its box, where it covers the least of strokes and of letters before it, near rather than far."""
    ends = stroke_segments(strokes).ends
    bounds = bounding_boxes(ends)
    taken: list[Box] = []
    for letter in letters:
        text = " ".join(letter.text.split())[:MAX_LABEL_LENGTH]
        if not text:
            continue
        size = letter.size * MM_PER_POINT
        wide, tall = CHARACTER_WIDTH * size * len(text), LINE_HEIGHT * size
        if letter.side is not None:
            far = letter.clearance
            (x, y), (across, up) = letter.at, letter.side
            spots = [(x + across * (far + wide / 2.0), y + up * (far + tall / 2.0))]
        else:
            spots = [
                (
                    letter.at[0] + cos(angle) * (letter.clearance + far + wide / 2.0),
                    letter.at[1] + sin(angle) * (letter.clearance + far + tall / 2.0),
                )
                for far in LABEL_DISTANCES
                for angle in (radians(45.0 + 360.0 * k / LABEL_DIRECTIONS) for k in range(LABEL_DIRECTIONS))
            ]
        boxes = np.array([(x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2) for x, y in spots])
        costs = np.repeat(np.arange(len(LABEL_DISTANCES)), LABEL_DIRECTIONS)[: len(boxes)].astype(float)
        region = np.concatenate([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])[None]
        if len(ends):
            near = ends[nearby_pairs(region, bounds, 0.2)[1]]
            costs += 4.0 * np.maximum(lengths_inside_boxes(boxes[:, None], near[None], 0.2), 0.0).sum(axis=1)
        placed = np.array(taken).reshape(-1, 4)
        for other in placed[nearby_pairs(region, placed, 0.0)[1]]:
            meets = (np.minimum(boxes[:, 2:], other[2:]) - np.maximum(boxes[:, :2], other[:2])).min(axis=1)
            costs += 40.0 * np.maximum(meets, 0.0)
        x, y = spots[int(np.argmin(costs))]
        taken.append(Box(x - wide / 2, y - tall / 2, x + wide / 2, y + tall / 2))
        slant = ' font-style="italic"' if letter.slanted else ""
        yield (
            f'<text x="{_format_number(x)}" y="{_format_number(-y + 0.36 * size)}" '
            f'font-size="{_format_number(size)}" text-anchor="middle"{slant} '
            f'fill="currentColor">{escape(text)}</text>',
            taken[-1],
        )
