"""Pictures to matplotlib figures in which a millimetre on paper is a millimetre."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from planar.drawing.picture import Arrow, Circle, Line, Picture, extent

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MM = 1.0 / 25.4
MARGIN = 8.0


def figure(pictures: Sequence[Picture], title: str = "") -> Figure:
    """Pictures side by side, each in axes whose data units are millimetres on paper."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Arc, Polygon

    boxes = [extent(picture.marks) for picture in pictures]
    sizes = [(high[0] - low[0] + 2 * MARGIN, high[1] - low[1] + 2 * MARGIN) for low, high in boxes]
    width, height = sum(w for w, _ in sizes), max(h for _, h in sizes) + 12.0
    made = Figure(figsize=(width * MM, height * MM))
    made.suptitle(title)
    left = 0.0
    for picture, (low, high), (w, h) in zip(pictures, boxes, sizes, strict=True):
        axes = made.add_axes((left / width, 12.0 / height, w / width, h / height))
        axes.set_xlim(low[0] - MARGIN, high[0] + MARGIN)
        axes.set_ylim(low[1] - MARGIN, high[1] + MARGIN)
        axes.axis("off")
        left += w
        for mark in picture.marks:
            if isinstance(mark, Line):
                if mark.closed:
                    axes.add_patch(Polygon(mark.spots, fill=mark.fill.value != "none", ec="k", fc="w", gid=mark.about))
                else:
                    axes.plot(*zip(*mark.spots, strict=True), "k-", lw=1, gid=mark.about)
            elif isinstance(mark, Arrow):
                axes.annotate("", mark.head, mark.tail, arrowprops={"arrowstyle": "->", "shrinkA": 0, "shrinkB": 0})
            elif isinstance(mark, Circle):
                d = 2 * mark.radius
                axes.add_patch(Arc(mark.centre, d, d, theta1=mark.start, theta2=mark.stop, gid=mark.about))
            else:
                axes.annotate(mark.text, mark.at, (2, 2), textcoords="offset points", fontsize=mark.size)
        axes.text(
            0.5, -0.02, "\n".join((picture.title, *picture.notes)), transform=axes.transAxes, ha="center", va="top"
        )
    return made
