"""Pictures to matplotlib figures in which a millimetre on paper is a millimetre, and those to files."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from io import BytesIO
from math import hypot
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.drawing.labels.fonts import outlined, outlines_only, quiet, shown
from planar.drawing.labels.placement import Placed, placed
from planar.drawing.labels.text_metrics import measured, wrapped
from planar.drawing.paper.pens import FILLS, INK, POINT, Ink, ready
from planar.drawing.paper.picture import Arrow, Circle, Letter, Line, Mark, Pen, Picture, Spot, extent
from planar.drawing.paper.stroke_shapes import Head, check, head, pointed, sweep
from planar.foundation.errors import BadInput, no_format

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

INCH = 25.4
PAGE, PAGE_HEIGHT = 277.0, 190.0
"""mm that a row of pictures may be wide, and all rows high where there are several sheets: A4 on its side."""
MARGIN, APART, EDGE = 3.0, 8.0, 5.0
"""mm about the marks of a picture, between pictures, and about them all."""
CAPTION = 70.0
"""mm that the text below a narrow picture may be wide."""
HEADING, TITLE, NOTE = 12.0, 10.0, 8.5
"""Sizes of texts in points: above all pictures, below each, and its notes."""
LEADING = 1.35
"""From one line of text to the next, in sizes of the font."""
LARGEST = 5000.0
"""mm: the largest sheet that readers of PDF files show."""
RESOLUTION = 200
"""Dots to an inch in PNG files."""
PIXELS = 1e8
SETTINGS = {
    "svg.fonttype": "none",
    "svg.hashsalt": "planar",
    "pdf.fonttype": 42,
    # matplotlib 3.11 reads this one to see how many characters of a PDF's font may stand together
    "ps.fonttype": 42,
    "pdf.compression": 6,
    "pdf.use14corefonts": False,
    "text.usetex": False,
    "text.hinting": "no_hinting",
    "mathtext.fontset": "dejavusans",
    "mathtext.default": "it",
    "lines.scale_dashes": True,
    "lines.antialiased": True,
    "patch.antialiased": True,
    "path.simplify": False,
    "path.sketch": None,
    "path.effects": [],
    "lines.dash_capstyle": "butt",
    "lines.marker": "None",
    "figure.autolayout": False,
    "figure.constrained_layout.use": False,
    "savefig.bbox": None,
    "savefig.facecolor": "auto",
    "savefig.edgecolor": "auto",
    "savefig.transparent": False,
}
"""What a reader's own settings of matplotlib must not change."""
# no dates: the same picture is the same file
METADATA: dict[str, dict[str, Any]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


class _Cell(NamedTuple):
    """A picture with its letters placed: its corners (mm, in its own axes), and lines of text as (text, size)."""

    picture: Picture
    letters: tuple[Placed, ...]
    low: Spot
    high: Spot
    text: tuple[tuple[str, float], ...]

    @property
    def inside(self) -> tuple[float, float]:
        """Width and height of its axes (mm)."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]

    @property
    def width(self) -> float:
        """mm, with the text below."""
        return max(self.inside[0], *(measured(text, size, heavy=size == TITLE).width for text, size in self.text), 1.0)

    @property
    def below(self) -> float:
        """mm that the text takes."""
        return sum(LEADING * POINT * size for _, size in self.text) + (2.0 if self.text else 0.0)


def figure(pictures: Sequence[Picture], title: str = "") -> Figure:
    """Pictures in rows, each in axes whose data units are millimetres on paper, named by the picture's title.

    Below each stand its title and its notes; `title` goes above all. Every stroke's artist has the mark's `about` as
    its gid, the head of an arrow that and " head" (its first corner is the tip). Raises BadInput for a picture that
    is too large for any sheet or has a mark with no place, and where matplotlib is missing.
    """
    return _sheet(_rows([cell(picture) for picture in pictures]), title)


def on_sheets(pictures: Sequence[Picture], title: str = "") -> list[Figure]:
    """The same on as many sheets as it takes for none to be higher than A4 on its side, where a row itself is not.

    Several sheets are as wide as the page.
    """
    sheets: list[list[list[_Cell]]] = []
    left = 0.0
    for row in _rows([cell(picture) for picture in pictures]):
        if not sheets or _tall(row) > left:
            sheets.append([])
            left = PAGE_HEIGHT - _heading(title, PAGE)[1]
        sheets[-1].append(row)
        left -= _tall(row) + APART
    return [_sheet(rows, title, PAGE if len(sheets) > 1 else 0.0) for rows in sheets]


def _sheet(rows: Sequence[Sequence[_Cell]], title: str, least: float = 0.0) -> Figure:
    """Rows of pictures below each other, at least so wide (mm)."""
    ready()
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    widest = max(least, max(map(_across, rows), default=20.0))
    heading, above = _heading(title, widest)
    widest = max([widest, *(measured(line, HEADING, heavy=True).width for line in heading)])
    width = widest + 2.0 * EDGE
    height = above + sum(map(_tall, rows)) + APART * max(len(rows) - 1, 0) + 2.0 * EDGE
    if max(width, height) > LARGEST:
        raise BadInput("scale", f"the drawing would be {max(width, height) / 1e3:.3g} m on paper: choose a smaller one")
    with rc_context(SETTINGS):
        made = Figure(figsize=(width / INCH, height / INCH), dpi=RESOLUTION, facecolor="white")
        top = height - EDGE
        for line in heading:
            top -= LEADING * POINT * HEADING
            _write(made, line, (width / 2.0, top), HEADING)
        top = height - EDGE - above
        for row in rows:
            left = (width - _across(row)) / 2.0
            floor = top - max(each.inside[1] for each in row)
            for each in row:
                put(made, each, (left, floor))
                left += each.width + APART
            top -= _tall(row) + APART
    return made


def _heading(title: str, widest: float) -> tuple[list[str], float]:
    """The lines of a title above pictures so wide, and what they take (mm)."""
    lines = wrapped(title, HEADING, max(widest, CAPTION), heavy=True)
    return lines, LEADING * POINT * HEADING * len(lines) + (3.0 if lines else 0.0)


def _tall(row: Sequence[_Cell]) -> float:
    """mm that a row takes, with the texts below."""
    return max(each.inside[1] for each in row) + max(each.below for each in row)


def saved(figure: Figure, suffix: str) -> bytes:
    """A figure as a file's content: png (200 dots to an inch), svg or pdf; the same bytes for the same picture.

    Raises BadInput for another suffix, or a PNG too large for any screen.
    """
    return pages([figure], suffix)


def pages(figures: Sequence[Figure], suffix: str) -> bytes:
    """Figures as the pages of one PDF, or a single one as png or svg. Raises BadInput."""
    ready()
    from matplotlib import rc_context

    kind = suffix.lower().removeprefix(".")
    if kind not in METADATA:
        raise no_format(suffix, "a drawing", (f".{each}" for each in METADATA))
    if not figures:
        raise BadInput(suffix, "there is nothing to draw")
    if len(figures) > 1 and kind != "pdf":
        raise BadInput(suffix, f"{len(figures)} sheets need pages, which only .pdf has")
    out = BytesIO()
    with rc_context(SETTINGS), quiet():
        if kind == "pdf":
            return _book(figures)
        across, up = figures[0].get_size_inches() * RESOLUTION
        if kind == "png" and (across * up > PIXELS or max(across, up) >= 2**16):
            raise BadInput(suffix, f"{across:.0f} x {up:.0f} pixels are too many: choose .pdf, .svg or a smaller scale")
        figures[0].savefig(out, format=kind, dpi=RESOLUTION, metadata=METADATA[kind])
    return _any_font(out.getvalue()) if kind == "svg" else out.getvalue()


def _book(figures: Sequence[Figure]) -> bytes:
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import PdfPages

    from planar.drawing.labels.matplotlib_text import families_of

    out = BytesIO()
    used = {family for each in figures for family in families_of(each)}
    # where a font cannot be embedded as it is, all are embedded as drawings of their letters
    fonts = {} if outlined(used) else {"pdf.fonttype": 3, "ps.fonttype": 3}
    with rc_context(fonts), outlines_only(), PdfPages(out, metadata=METADATA["pdf"]) as book:
        for each in figures:
            book.savefig(each)
    return out.getvalue()


def _any_font(page: bytes) -> bytes:
    """An SVG page whose letters any font without serifs can show where those that it names are not installed."""
    return re.sub(rb"(font(?:-family)?: [^;\"]*'DejaVu Sans[^;\"]*')(?=[;\"])", rb"\1, sans-serif", page)


def cell(picture: Picture) -> _Cell:
    for mark in picture.marks:
        check(mark)
    letters = placed([mark for mark in picture.marks if isinstance(mark, Letter)], picture.marks)
    strokes = [mark for mark in picture.marks if not isinstance(mark, Letter)]
    corners = [*(picture.window or extent(strokes))] if strokes else []
    for each in letters:
        corners += [(each.box.left, each.box.bottom), (each.box.right, each.box.top), *(each.leader or ())]
    corners = corners or [(0.0, 0.0)]
    low = min(x for x, _ in corners) - MARGIN, min(y for _, y in corners) - MARGIN
    high = max(x for x, _ in corners) + MARGIN, max(y for _, y in corners) + MARGIN
    room = max(high[0] - low[0], CAPTION)
    text = [(line, TITLE) for line in wrapped(picture.title, TITLE, room, heavy=True)]
    text += [(line, NOTE) for note in picture.notes for line in wrapped(note, NOTE, room)]
    return _Cell(picture, letters, low, high, tuple(text))


def _across(row: Sequence[_Cell]) -> float:
    return sum(cell.width for cell in row) + APART * (len(row) - 1)


def _rows(cells: Sequence[_Cell]) -> list[list[_Cell]]:
    """Cells in reading order, as many to a row as the page is wide, one at least."""
    rows: list[list[_Cell]] = []
    for cell in cells:
        if rows and _across([*rows[-1], cell]) <= PAGE:
            rows[-1].append(cell)
        else:
            rows.append([cell])
    return rows


def _write(made: Figure, line: str, at: Spot, size: float) -> None:
    """One line of text, centred, on its base line (mm from the sheet's lower left corner)."""
    from planar.drawing.labels.matplotlib_text import write

    width, height = made.get_size_inches() * INCH
    write(made, line, (at[0] / width, at[1] / height), size, heavy=size != NOTE, ha="center")


def put(made: Figure, cell: _Cell, corner: Spot) -> None:
    """A picture with the lower left corner of its place there (mm on the sheet), and its text below."""
    width, height = made.get_size_inches() * INCH
    across, up = cell.inside
    left = corner[0] + (cell.width - across) / 2.0
    axes = made.add_axes((left / width, corner[1] / height, across / width, up / height))
    axes.set_axis_off()
    axes.set_label(cell.picture.title)
    axes.set_gid(shown(cell.picture.title) or None)
    axes.set(xlim=(cell.low[0], cell.high[0]), ylim=(cell.low[1], cell.high[1]), autoscale_on=False)
    for order, mark in enumerate(cell.picture.marks):
        _draw(axes, mark, order)
    if cell.picture.window is not None:
        _framed(axes, cell.picture.window)
    _letter(axes, cell.letters, len(cell.picture.marks))
    down = corner[1]
    for line, size in cell.text:
        down -= LEADING * POINT * size
        _write(made, line, (corner[0] + cell.width / 2.0, down), size)


def _framed(axes: Axes, window: tuple[Spot, Spot]) -> None:
    """Show of the strokes what is in a window, and its frame."""
    from matplotlib.patches import Rectangle

    (left, low), (right, up) = window
    ink = INK[Pen.CIRCLE]
    frame = Rectangle((left, low), right - left, up - low, facecolor="none", edgecolor=ink.colour, **_stroke(ink))
    strokes = [*axes.lines, *axes.patches]
    axes.add_artist(frame)
    _named(frame, "window", len(strokes))
    for each in strokes:
        each.set(clip_on=True)
        each.set_clip_path(frame)


def _letter(axes: Axes, letters: Sequence[Placed], order: int) -> None:
    """Letters in their boxes and the lines that lead to their spots, above all else."""
    from planar.drawing.labels.matplotlib_text import write

    for letter, box, leader in letters:
        if leader is not None:
            _line(axes, leader, INK[Pen.LEADER], f"{letter.about} leader", order)
        below = measured(letter.text, letter.size, letter.slanted, letter.math).below
        # centred, as the same font is a little wider or narrower in other programs
        at = (box.left + box.right) / 2.0, box.bottom + below
        looks = {"math": letter.math, "slanted": letter.slanted, "ha": "center"}
        _named(write(axes, letter.text, at, letter.size, **looks), letter.about, order + 1)


def _named(artist: Artist, about: str, order: float) -> None:
    artist.set(gid=shown(about) or None, zorder=order, clip_on=False)


def _stroke(ink: Ink, width: float | None = None) -> Mapping[str, Any]:
    """How matplotlib draws with an ink, of another width (mm) if one is given."""
    wide = ink.width if width is None else width
    return {
        "linewidth": wide / POINT,
        # dashes are counted in widths of the line
        "linestyle": (0, tuple(dash / wide for dash in ink.dashes)) if ink.dashes else "-",
    }


def _line(
    axes: Axes, spots: Sequence[Spot], ink: Ink, about: str, order: float, width: float | None = None, cap: str = "butt"
) -> None:
    from matplotlib.lines import Line2D

    x, y = [each[0] for each in spots], [each[1] for each in spots]
    drawn = Line2D(x, y, color=ink.colour, solid_capstyle=cap, solid_joinstyle="round", **_stroke(ink, width))
    axes.add_artist(drawn)
    _named(drawn, about, order)


def _head(axes: Axes, made: Head, ink: Ink, about: str, order: float) -> None:
    from matplotlib.patches import Polygon

    tip = Polygon(made.corners, closed=True, facecolor=ink.colour, edgecolor="none", linewidth=0.0)
    axes.add_artist(tip)
    _named(tip, f"{about} head", order)


def _draw(axes: Axes, mark: Mark, order: int) -> None:
    """The artists of a stroke; letters are drawn elsewhere."""
    if isinstance(mark, Line):
        _draw_line(axes, mark, order)
    elif isinstance(mark, Arrow):
        made = head(mark.tail, mark.head, hypot(mark.head[0] - mark.tail[0], mark.head[1] - mark.tail[1]))
        if made is not None:
            ink = INK[mark.pen]
            _line(axes, (mark.tail, made.end), ink, mark.about, order, min(ink.width, made.line))
            _head(axes, made, ink, mark.about, order + 0.5)
    elif isinstance(mark, Circle):
        _draw_circle(axes, mark, order)


def _draw_line(axes: Axes, mark: Line, order: int) -> None:
    from matplotlib.patches import Polygon

    ink = INK[mark.pen]
    if mark.closed and len(mark.spots) > 2:
        fill = FILLS.get(mark.fill, "none")
        area = Polygon(mark.spots, closed=True, facecolor=fill, edgecolor=ink.colour, joinstyle="round", **_stroke(ink))
        axes.add_artist(area)
        _named(area, mark.about, order)
    elif len(mark.spots) > 1:
        cap = "butt" if mark.pen in {Pen.HATCH, Pen.GROUND} else "round"
        _line(axes, mark.spots, ink, mark.about, order, cap=cap)


def _draw_circle(axes: Axes, mark: Circle, order: int) -> None:
    from matplotlib.patches import Circle as Whole
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    ink, turn = INK[mark.pen], sweep(mark)
    fill = FILLS.get(mark.fill, "none")
    looks = {"facecolor": fill, "edgecolor": ink.colour}
    tip = pointed(mark)
    if turn == 360.0 and tip is None:
        drawn = Whole(mark.centre, abs(mark.radius), **looks, **_stroke(ink))
    elif turn > 0.0:
        start, stop = (mark.start, mark.start + turn) if tip is None else tip[1:]
        arc = Path.arc(start, stop)
        corners = arc.vertices * mark.radius + mark.centre
        drawn = PathPatch(Path(corners, arc.codes), capstyle="butt", **looks, **_stroke(ink))
    else:
        return
    axes.add_artist(drawn)
    _named(drawn, mark.about, order)
    if tip is not None:
        _head(axes, tip[0], ink, mark.about, order + 0.5)
