"""Sheets of A4 with many small pictures in rows and columns."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

from planar.drawing.labels.text_metrics import wrap_text
from planar.drawing.output.matplotlib_figure import (
    HEADING_SIZE,
    LEADING,
    MATPLOTLIB_SETTINGS,
    MM_PER_INCH,
    NOTE_SIZE,
    PICTURE_MARGIN,
    RESOLUTION,
    TITLE_SIZE,
    draw_cell,
    lay_out_picture,
    write_centred,
)
from planar.drawing.paper.pens import MM_PER_POINT, require_matplotlib
from planar.drawing.paper.picture import Picture

if TYPE_CHECKING:
    from matplotlib.figure import Figure

GRID_COLUMNS, GRID_ROWS = 4, 5
GRID_COUNT = GRID_COLUMNS * GRID_ROWS
"""Pictures on a sheet."""
PAGE_WIDTH, PAGE_HEIGHT = 210.0, 297.0
"""mm: A4, upright."""
MARGIN, HEAD_HEIGHT, FOOT_HEIGHT = 10.0, 10.0, 12.0
"""mm on every side, for the heading, and for the notes at the foot."""
CELL_WIDTH = (PAGE_WIDTH - 2.0 * MARGIN) / GRID_COLUMNS
CELL_HEIGHT = (PAGE_HEIGHT - 2.0 * MARGIN - HEAD_HEIGHT - FOOT_HEIGHT) / GRID_ROWS
"""mm of a picture with its texts."""
CAPTION_LINES = 3
"""Lines of notes for which there is room below a picture and its title."""
PICTURE_HEIGHT = CELL_HEIGHT - LEADING * MM_PER_POINT * (TITLE_SIZE + CAPTION_LINES * NOTE_SIZE) - 2.0
"""mm of a picture with its letters."""
GRID_PICTURE_SIZE = CELL_WIDTH - 2.0 * PICTURE_MARGIN - 4.0, PICTURE_HEIGHT - 2.0 * PICTURE_MARGIN - 3.0
"""mm that the strokes of a picture may take."""


def draw_grid(pictures: Sequence[Picture], title: str, note: str = "") -> Iterator[Figure]:
    """Pictures in reading order, twenty to a sheet, each with its title and notes below; a note at each sheet's foot.

    A single sheet is as high as its rows take, several are of A4. Raises BadInput without matplotlib.
    """
    require_matplotlib()
    sheets = [pictures[first : first + GRID_COUNT] for first in range(0, len(pictures), GRID_COUNT)]
    for number, own in enumerate(sheets, start=1):
        heading = f"{title}, sheet {number} of {len(sheets)}" if len(sheets) > 1 else title
        rows = GRID_ROWS if len(sheets) > 1 else -(-len(own) // GRID_COLUMNS)
        yield _draw_sheet(own, heading, note, PAGE_HEIGHT - (GRID_ROWS - rows) * CELL_HEIGHT)


def _draw_sheet(pictures: Sequence[Picture], heading: str, note: str, height: float) -> Figure:
    from matplotlib import rc_context
    from matplotlib.figure import Figure

    with rc_context(MATPLOTLIB_SETTINGS):
        size = PAGE_WIDTH / MM_PER_INCH, height / MM_PER_INCH
        made = Figure(figsize=size, dpi=RESOLUTION, facecolor="white")
        top = height - MARGIN - LEADING * MM_PER_POINT * HEADING_SIZE
        write_centred(made, heading, (PAGE_WIDTH / 2.0, top), HEADING_SIZE)
        spare_columns = max(0, GRID_COLUMNS - len(pictures)) * (height < PAGE_HEIGHT)
        for place, picture in enumerate(pictures):
            row, column = divmod(place, GRID_COLUMNS)
            cell = lay_out_picture(picture, CELL_WIDTH - 2.0)
            floor = height - MARGIN - HEAD_HEIGHT - row * CELL_HEIGHT - PICTURE_HEIGHT
            # all titles of a row stand on one line
            spare = (PICTURE_HEIGHT - cell.axes_size[1]) / 2.0
            low, high = (cell.low[0], cell.low[1] - spare), (cell.high[0], cell.high[1] + spare)
            left = MARGIN + (column + 0.5 * (1 + spare_columns)) * CELL_WIDTH - cell.width / 2.0
            draw_cell(made, cell._replace(low=low, high=high), (left, floor))
        down = MARGIN + FOOT_HEIGHT
        for line in wrap_text(note, NOTE_SIZE, PAGE_WIDTH - 2.0 * MARGIN):
            down -= LEADING * MM_PER_POINT * NOTE_SIZE
            write_centred(made, line, (PAGE_WIDTH / 2.0, down), NOTE_SIZE)
    return made
