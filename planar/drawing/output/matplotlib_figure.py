"""Pictures to matplotlib figures in which a millimetre on paper is a millimetre, and those to files."""

from __future__ import annotations

import re
from collections.abc import Sequence
from io import BytesIO
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.drawing.labels.fonts import have_truetype_outlines, outlines_only, printable_text, quiet_font_logs
from planar.drawing.labels.placement import PlacedLabel, count_labels, place_labels
from planar.drawing.labels.text_metrics import text_size, wrap_text
from planar.drawing.output.matplotlib_marks import draw_labels, draw_mark, frame_window
from planar.drawing.paper.pens import MM_PER_POINT, require_matplotlib
from planar.drawing.paper.picture import Label, PaperPoint, Picture, extent
from planar.drawing.paper.stroke_shapes import check_finite
from planar.foundation.errors import BadInput, unknown_format_error
from planar.model.wording import count_phrase

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.typing import RcKeyType

MM_PER_INCH = 25.4
PAGE_WIDTH, PAGE_HEIGHT = 277.0, 190.0
"""mm that a row of pictures may be wide, and all rows high where there are several sheets: A4 on its side."""
PICTURE_MARGIN, PICTURE_GAP, SHEET_MARGIN = 3.0, 8.0, 5.0
"""mm about the marks of a picture, between pictures, and about them all."""
MIN_CAPTION_WIDTH = 70.0
"""mm that the text below a narrow picture may be wide."""
HEADING_SIZE, TITLE_SIZE, NOTE_SIZE = 12.0, 10.0, 8.5
"""Sizes of texts in points: above all pictures, below each, and its notes."""
LEADING = 1.35
"""From one line of text to the next, in sizes of the font."""
MAX_SHEET_SIZE = 5000.0
"""mm: the largest sheet that readers of PDF files show."""
RESOLUTION = 200
"""Dots to an inch in PNG files."""
MAX_PIXELS = 1e8
MATPLOTLIB_SETTINGS: dict[RcKeyType, Any] = {
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


class PictureCell(NamedTuple):
    """A picture with its letters placed: its corners (mm, in its own axes), and lines of text as (text, size)."""

    picture: Picture
    labels: tuple[PlacedLabel, ...]
    low: PaperPoint
    high: PaperPoint
    text_lines: tuple[tuple[str, float], ...]

    @property
    def axes_size(self) -> tuple[float, float]:
        """Width and height of its axes (mm)."""
        return self.high[0] - self.low[0], self.high[1] - self.low[1]

    @property
    def width(self) -> float:
        """mm, with the text below."""
        return max(
            self.axes_size[0],
            *(text_size(text, size, heavy=size == TITLE_SIZE).width for text, size in self.text_lines),
            1.0,
        )

    @property
    def text_height(self) -> float:
        """mm that the text takes."""
        return sum(LEADING * MM_PER_POINT * size for _, size in self.text_lines) + (2.0 if self.text_lines else 0.0)


def draw_pictures(pictures: Sequence[Picture], title: str = "") -> Figure:
    """Pictures in rows, each in axes whose data units are millimetres on paper, named by the picture's title.

    Below each stand its title and its notes; `title` goes above all. Every stroke's artist has the mark's `about` as
    its gid, the head of an arrow that and " head" (its first corner is the tip). Raises BadInput for a picture that
    is too large for any sheet or has a mark with no place, and where matplotlib is missing.
    """
    return _draw_sheet(_arrange_rows([lay_out_picture(picture) for picture in pictures]), title)


def draw_on_sheets(pictures: Sequence[Picture], title: str = "") -> list[Figure]:
    """The same on as many sheets as it takes for none to be higher than A4 on its side, where a row itself is not.

    Several sheets are as wide as the page.
    """
    sheets: list[list[list[PictureCell]]] = []
    left = 0.0
    for row in _arrange_rows([lay_out_picture(picture) for picture in pictures]):
        if not sheets or _row_height(row) > left:
            sheets.append([])
            left = PAGE_HEIGHT - heading_lines(title, PAGE_WIDTH)[1]
        sheets[-1].append(row)
        left -= _row_height(row) + PICTURE_GAP
    return [_draw_sheet(rows, title, PAGE_WIDTH if len(sheets) > 1 else 0.0) for rows in sheets]


def _draw_sheet(rows: Sequence[Sequence[PictureCell]], title: str, min_width: float = 0.0) -> Figure:
    """Rows of pictures below each other, at least so wide (mm)."""
    require_matplotlib()
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    widest = max(min_width, max(map(_row_width, rows), default=20.0))
    heading, above = heading_lines(title, widest)
    widest = max([widest, *(text_size(line, HEADING_SIZE, heavy=True).width for line in heading)])
    width = widest + 2.0 * SHEET_MARGIN
    height = above + sum(map(_row_height, rows)) + PICTURE_GAP * max(len(rows) - 1, 0) + 2.0 * SHEET_MARGIN
    if max(width, height) > MAX_SHEET_SIZE:
        raise BadInput("scale", f"the drawing would be {max(width, height) / 1e3:.3g} m on paper: choose a smaller one")
    with rc_context(MATPLOTLIB_SETTINGS):
        made = Figure(figsize=(width / MM_PER_INCH, height / MM_PER_INCH), dpi=RESOLUTION, facecolor="white")
        top = height - SHEET_MARGIN
        for line in heading:
            top -= LEADING * MM_PER_POINT * HEADING_SIZE
            write_centred(made, line, (width / 2.0, top), HEADING_SIZE)
        top = height - SHEET_MARGIN - above
        for row in rows:
            left = (width - _row_width(row)) / 2.0
            floor = top - max(each.axes_size[1] for each in row)
            for each in row:
                draw_cell(made, each, (left, floor))
                left += each.width + PICTURE_GAP
            top -= _row_height(row) + PICTURE_GAP
    return made


def heading_lines(title: str, width: float) -> tuple[list[str], float]:
    """The lines of a title above pictures so wide, and what they take (mm)."""
    lines = wrap_text(title, HEADING_SIZE, max(width, MIN_CAPTION_WIDTH), heavy=True)
    return lines, LEADING * MM_PER_POINT * HEADING_SIZE * len(lines) + (3.0 if lines else 0.0)


def _row_height(row: Sequence[PictureCell]) -> float:
    """mm that a row takes, with the texts below."""
    return max(each.axes_size[1] for each in row) + max(each.text_height for each in row)


def encode_figure(figure: Figure, suffix: str) -> bytes:
    """A figure as a file's content: png (200 dots to an inch), svg, pdf or dxf.

    All but dxf are the same bytes for the same picture. Raises BadInput for another suffix, or a PNG too large for any
    screen.
    """
    return encode_pages([figure], suffix)


def encode_pages(figures: Sequence[Figure], suffix: str) -> bytes:
    """Figures as the pages of one PDF, or a single one as png, svg or dxf. Raises BadInput."""
    require_matplotlib()
    from matplotlib import rc_context

    kind = suffix.lower().removeprefix(".")
    if kind not in (*METADATA, "dxf"):
        raise unknown_format_error(suffix, "a drawing", (f".{each}" for each in (*METADATA, "dxf")))
    if not figures:
        raise BadInput(suffix, "there is nothing to draw")
    if len(figures) > 1 and kind != "pdf":
        raise BadInput(suffix, f"{len(figures)} sheets need pages, which only .pdf has")
    out = BytesIO()
    with rc_context(MATPLOTLIB_SETTINGS), quiet_font_logs():
        if kind == "pdf":
            return _encode_pdf(figures)
        if kind == "dxf":
            from planar.drawing.output.dxf_figure import encode_dxf

            return encode_dxf(figures[0])
        across, up = figures[0].get_size_inches() * RESOLUTION
        if kind == "png" and (across * up > MAX_PIXELS or max(across, up) >= 2**16):
            raise BadInput(suffix, f"{across:.0f} x {up:.0f} pixels are too many: choose .pdf, .svg or a smaller scale")
        figures[0].savefig(out, format=kind, dpi=RESOLUTION, metadata=METADATA[kind])
    return _add_font_fallback(out.getvalue()) if kind == "svg" else out.getvalue()


def _encode_pdf(figures: Sequence[Figure]) -> bytes:
    from matplotlib import rc_context
    from matplotlib.backends.backend_pdf import PdfPages

    from planar.drawing.labels.matplotlib_text import used_families

    out = BytesIO()
    used = {family for each in figures for family in used_families(each)}
    # where a font cannot be embedded as it is, all are embedded as drawings of their letters
    fonts: dict[RcKeyType, Any] = {} if have_truetype_outlines(used) else {"pdf.fonttype": 3, "ps.fonttype": 3}
    with rc_context(fonts), outlines_only(), PdfPages(out, metadata=METADATA["pdf"]) as book:
        for each in figures:
            book.savefig(each)
    return out.getvalue()


def _add_font_fallback(page: bytes) -> bytes:
    """An SVG page whose letters any font without serifs can show where those that it names are not installed."""
    return re.sub(rb"(font(?:-family)?: [^;\"]*'DejaVu Sans[^;\"]*')(?=[;\"])", rb"\1, sans-serif", page)


def lay_out_picture(picture: Picture, caption_width: float = MIN_CAPTION_WIDTH) -> PictureCell:
    """A picture with its letters placed and the text below broken to its width, or to a greater one (mm)."""
    for mark in picture.marks:
        check_finite(mark)
    labels = [mark for mark in picture.marks if isinstance(mark, Label)]
    letters = place_labels(labels, picture.marks)
    notes = list(picture.notes)
    left_out = count_labels(labels) - len(letters)
    if left_out:
        letters_text = f"{count_phrase(left_out, 'letter')} of {len(letters) + left_out}"
        notes.append(f"{letters_text} left out: there is no room for them at this scale")
    strokes = [mark for mark in picture.marks if not isinstance(mark, Label)]
    corners = [*(picture.window or extent(strokes))] if strokes else []
    for each in letters:
        corners += [(each.box.left, each.box.bottom), (each.box.right, each.box.top), *(each.leader or ())]
    corners = corners or [(0.0, 0.0)]
    low = min(x for x, _ in corners) - PICTURE_MARGIN, min(y for _, y in corners) - PICTURE_MARGIN
    high = max(x for x, _ in corners) + PICTURE_MARGIN, max(y for _, y in corners) + PICTURE_MARGIN
    room = max(high[0] - low[0], caption_width)
    text = [(line, TITLE_SIZE) for line in wrap_text(picture.title, TITLE_SIZE, room, heavy=True)]
    text += [(line, NOTE_SIZE) for note in notes for line in wrap_text(note, NOTE_SIZE, room)]
    return PictureCell(picture, letters, low, high, tuple(text))


def _row_width(row: Sequence[PictureCell]) -> float:
    return sum(cell.width for cell in row) + PICTURE_GAP * (len(row) - 1)


def _arrange_rows(cells: Sequence[PictureCell]) -> list[list[PictureCell]]:
    """Cells in reading order, as many to a row as the page is wide, one at least."""
    rows: list[list[PictureCell]] = []
    for cell in cells:
        if rows and _row_width([*rows[-1], cell]) <= PAGE_WIDTH:
            rows[-1].append(cell)
        else:
            rows.append([cell])
    return rows


def write_centred(made: Figure, line: str, at: PaperPoint, size: float) -> None:
    """One line of text, centred, on its base line (mm from the sheet's lower left corner)."""
    from planar.drawing.labels.matplotlib_text import draw_text

    width, height = made.get_size_inches() * MM_PER_INCH
    draw_text(made, line, (at[0] / width, at[1] / height), size, heavy=size != NOTE_SIZE, ha="center")


def draw_cell(made: Figure, cell: PictureCell, corner: PaperPoint) -> None:
    """A picture with the lower left corner of its place there (mm on the sheet), and its text below."""
    width, height = made.get_size_inches() * MM_PER_INCH
    across, up = cell.axes_size
    left = corner[0] + (cell.width - across) / 2.0
    axes = made.add_axes((left / width, corner[1] / height, across / width, up / height))
    axes.set_axis_off()
    axes.set_label(cell.picture.title)
    axes.set_gid(printable_text(cell.picture.title) or None)
    axes.set(xlim=(cell.low[0], cell.high[0]), ylim=(cell.low[1], cell.high[1]), autoscale_on=False)
    for order, mark in enumerate(cell.picture.marks):
        draw_mark(axes, mark, order)
    if cell.picture.window is not None:
        frame_window(axes, cell.picture.window)
    draw_labels(axes, cell.labels, len(cell.picture.marks))
    down = corner[1]
    for line, size in cell.text_lines:
        down -= LEADING * MM_PER_POINT * size
        write_centred(made, line, (corner[0] + cell.width / 2.0, down), size)
