"""Lines of text as artists of matplotlib, with their base line exactly where it is asked."""

from __future__ import annotations

from typing import Any

from matplotlib.artist import allow_rasterization
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.path import Path
from matplotlib.text import Text
from matplotlib.transforms import Affine2D, Bbox, Transform

from planar.drawing.labels.fonts import DRAWING_FAMILY, font_properties
from planar.drawing.labels.text_line import TextLine, text_line
from planar.drawing.paper.picture import PaperPoint

ALIGNMENT_FRACTIONS = {"left": 0.0, "center": 0.5, "right": 1.0}


class TextLineArtist(Text):
    """A line of text, or a formula, that is drawn piece by piece; its extent is that of its letters."""

    def __init__(
        self, at: PaperPoint, text: str, size: float, math: bool, slanted: bool, heavy: bool, family: str, **looks: Any
    ):
        self.line: TextLine = text_line(text, math, slanted, heavy, family)
        chosen = self.line.pieces[0].families if self.line.pieces else (family,)
        super().__init__(
            *at, text, fontproperties=font_properties(size, slanted, heavy, chosen), va="baseline", **looks
        )
        self.set_parse_math(math)
        if hasattr(self, "set_fontfeatures"):
            # a letter that stands in a ligature makes a font of its own in PDF files
            self.set_fontfeatures(("-liga", "-clig"))

    def _start_point(self, pixels: float) -> PaperPoint:
        """Where the line begins on its base line, in pixels; `pixels` is the size of its font."""
        x, y = self.get_transform().transform(self.get_unitless_position())
        return float(x - ALIGNMENT_FRACTIONS[self.get_horizontalalignment()] * self.line.width * pixels), float(y)

    @allow_rasterization
    def draw(self, renderer: Any) -> None:
        if not self.get_visible() or not (self.line.pieces or self.line.bars):
            return
        renderer.open_group("text", self.get_gid())
        pen = renderer.new_gc()
        pen.set_foreground(self.get_color())
        pen.set_alpha(self.get_alpha())
        pen.set_linewidth(0.0)
        pixels = renderer.points_to_pixels(self.get_fontsize())
        x, y = self._start_point(pixels)
        top = renderer.get_canvas_width_height()[1] if renderer.flipy() else None
        alone = self if len(self.line.pieces) == 1 and not self.line.bars else None
        for each in self.line.pieces:
            right, up = x + pixels * each.x, y + pixels * each.y
            looks = font_properties(float(self.get_fontsize()) * each.size, each.slanted, each.heavy, each.families)
            renderer.draw_text(pen, right, up if top is None else top - up, each.text, looks, 0.0, False, alone)
        for left, low, right, high in self.line.bars:
            corners = Path([(left, low), (right, low), (right, high), (left, high), (left, low)], closed=True)
            place = Affine2D().scale(pixels).translate(x, y)
            renderer.draw_path(pen, corners, place, pen.get_rgb())
        pen.restore()
        renderer.close_group("text")
        self.stale = False

    def get_window_extent(self, renderer: Any = None, dpi: float | None = None) -> Bbox:
        figure = self.get_figure()
        whole = figure.dpi if figure is not None else 72.0
        shift = 1.0 if dpi is None else dpi / whole
        pixels = float(self.get_fontsize()) * whole / 72.0
        x, y = self._start_point(pixels)
        box = (x, y - pixels * self.line.descent, x + pixels * self.line.width, y + pixels * self.line.ascent)
        return Bbox.from_extents(*(shift * each for each in box))


# many: how it looks, as for matplotlib's own texts
def draw_text(
    on: Figure | Axes,
    text: str,
    at: PaperPoint,
    size: float,
    *,
    math: bool = False,
    slanted: bool = False,
    heavy: bool = False,
    family: str = DRAWING_FAMILY,
    ha: str = "left",
    color: str = "black",
    transform: Transform | None = None,
    **looks: Any,
) -> Text:
    """A line of text on a figure (places in parts of it) or on axes (in their data), on its base line.

    Raises ValueError for a formula with a fault.
    """
    made = TextLineArtist(at, text, size, math, slanted, heavy, family, ha=ha, color=color, **looks)
    if isinstance(on, Figure):
        made.set_transform(transform or on.transFigure)
        made.set_figure(on)
        on.texts.append(made)
        made._remove_method = on.texts.remove  # type: ignore[attr-defined]  # as `Figure.text` does, untold
    else:
        made.set_transform(transform or on.transData)
        on.add_artist(made)
    return made


def used_families(figure: Figure) -> set[str]:
    """The families of fonts that a figure's texts are set in."""
    found: set[str] = set()
    for text in figure.findobj(Text):
        pieces = text.line.pieces if isinstance(text, TextLineArtist) else ()
        found.update(text.get_fontfamily(), *(each.families for each in pieces))
    return found
