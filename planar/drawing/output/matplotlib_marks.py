"""The marks and labels of a picture as artists of matplotlib."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from math import hypot
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from planar.drawing.labels.fonts import printable_text
from planar.drawing.labels.placement import PlacedLabel
from planar.drawing.labels.text_metrics import text_size
from planar.drawing.paper.pens import FILL_COLOURS, MM_PER_POINT, PEN_STYLES, PenStyle, pen_style
from planar.drawing.paper.picture import Arrow, Circle, Mark, PaperPoint, Pen, Polyline
from planar.drawing.paper.stroke_shapes import ArrowHead, arc_arrow_head, arrow_head, sweep_angle

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch


def draw_labels(axes: Axes, labels: Sequence[PlacedLabel], order: int) -> None:
    """Letters in their boxes and the lines that lead to their spots, above all else."""
    from planar.drawing.labels.matplotlib_text import draw_text

    for letter, box, leader in labels:
        if leader is not None:
            _add_line(axes, leader, PEN_STYLES[Pen.LEADER], f"{letter.about} leader", order)
        below = text_size(letter.text, letter.size, letter.slanted, letter.math).descent
        # centred, as the same font is a little wider or narrower in other programs
        at = (box.left + box.right) / 2.0, box.bottom + below
        drawn = draw_text(axes, letter.text, at, letter.size, math=letter.math, slanted=letter.slanted, ha="center")
        _tag_artist(drawn, letter.about, order + 1)


def _tag_artist(artist: Artist, about: str, order: float) -> None:
    artist.set(gid=printable_text(about) or None, zorder=order, clip_on=False)


def _line_style(ink: PenStyle, width: float | None = None) -> Mapping[str, Any]:
    """How matplotlib draws with an ink, of another width (mm) if one is given."""
    wide = ink.width if width is None else width
    return {
        "linewidth": wide / MM_PER_POINT,
        # dashes are counted in widths of the line
        "linestyle": (0, tuple(dash / wide for dash in ink.dashes)) if ink.dashes else "-",
    }


def _add_line(
    axes: Axes,
    spots: Sequence[PaperPoint],
    ink: PenStyle,
    about: str,
    order: float,
    width: float | None = None,
    cap: Literal["butt", "round"] = "butt",
) -> None:
    from matplotlib.lines import Line2D

    x, y = [each[0] for each in spots], [each[1] for each in spots]
    drawn = Line2D(x, y, color=ink.colour, solid_capstyle=cap, solid_joinstyle="round", **_line_style(ink, width))
    axes.add_artist(drawn)
    _tag_artist(drawn, about, order)


def _add_arrow_head(axes: Axes, made: ArrowHead, ink: PenStyle, about: str, order: float) -> None:
    from matplotlib.patches import Polygon

    tip = Polygon(made.corners, closed=True, facecolor=ink.colour, edgecolor="none", linewidth=0.0)
    axes.add_artist(tip)
    _tag_artist(tip, f"{about} head", order)


def draw_mark(axes: Axes, mark: Mark, order: int) -> None:
    """The artists of a stroke; letters are drawn elsewhere."""
    if isinstance(mark, Polyline):
        _draw_line(axes, mark, order)
    elif isinstance(mark, Arrow):
        made = arrow_head(mark.tail, mark.head, hypot(mark.head[0] - mark.tail[0], mark.head[1] - mark.tail[1]))
        if made is not None:
            ink = pen_style(mark)
            _add_line(axes, (mark.tail, made.line_end), ink, mark.about, order, min(ink.width, made.max_line_width))
            _add_arrow_head(axes, made, ink, mark.about, order + 0.5)
    elif isinstance(mark, Circle):
        _draw_circle(axes, mark, order)


def _draw_line(axes: Axes, mark: Polyline, order: int) -> None:
    from matplotlib.patches import Polygon

    ink = pen_style(mark)
    if mark.closed and len(mark.points) > 2:
        fill = FILL_COLOURS.get(mark.fill, "none")
        area = Polygon(
            mark.points, closed=True, facecolor=fill, edgecolor=ink.colour, joinstyle="round", **_line_style(ink)
        )
        axes.add_artist(area)
        _tag_artist(area, mark.about, order)
    elif len(mark.points) > 1:
        flat = mark.pen in {Pen.HATCH, Pen.GROUND}
        _add_line(axes, mark.points, ink, mark.about, order, cap="butt" if flat else "round")


def _draw_circle(axes: Axes, mark: Circle, order: int) -> None:
    from matplotlib.patches import Circle as Whole
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    ink, turn = pen_style(mark), sweep_angle(mark)
    fill = FILL_COLOURS.get(mark.fill, "none")
    looks = {"facecolor": fill, "edgecolor": ink.colour}
    tip = arc_arrow_head(mark)
    if turn == 360.0 and tip is None:
        drawn: Patch = Whole(mark.centre, abs(mark.radius), **looks, **_line_style(ink))
    elif turn > 0.0:
        start, stop = (mark.start, mark.start + turn) if tip is None else tip[1:]
        arc = Path.arc(start, stop)
        corners = np.asarray(arc.vertices) * mark.radius + mark.centre
        drawn = PathPatch(Path(corners, arc.codes), capstyle="butt", **looks, **_line_style(ink))
    else:
        return
    axes.add_artist(drawn)
    _tag_artist(drawn, mark.about, order)
    if tip is not None:
        _add_arrow_head(axes, tip[0], ink, mark.about, order + 0.5)


def frame_window(axes: Axes, window: tuple[PaperPoint, PaperPoint]) -> None:
    """Show of the strokes what is in a window, and its frame."""
    from matplotlib.patches import Rectangle

    (left, low), (right, up) = window
    ink = PEN_STYLES[Pen.CIRCLE]
    frame = Rectangle((left, low), right - left, up - low, facecolor="none", edgecolor=ink.colour, **_line_style(ink))
    strokes = [*axes.lines, *axes.patches]
    axes.add_artist(frame)
    _tag_artist(frame, "window", len(strokes))
    for each in strokes:
        each.set(clip_on=True)
        each.set_clip_path(frame)
