"""Designs for a task on sheets, over what was wanted of them."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from planar.drawing.designs.design_picture import design_picture
from planar.drawing.designs.function_picture import function_picture
from planar.drawing.output.matplotlib_figure import draw_on_sheets
from planar.drawing.paper.picture import Picture
from planar.foundation.errors import BadInput
from planar.synthesis.synthesis import check_synthesis
from planar.synthesis.task.starts import miss_text
from planar.synthesis.task.synthesis_task import WantedFunction

if TYPE_CHECKING:
    from matplotlib.figure import Figure

SHEET_ROOM = (84.0, 50.0)
"""mm of a picture: two rows are on a sheet."""
NOTE = "Red: what is wanted. Green: what the design makes, with a circle where each entry is."


def design_sheets(found: Any) -> list[Figure]:
    """Sheets of A4 on its side with the sound designs, the best first.

    Raises BadInput for anything else, and where there is none.
    """
    found = check_synthesis(found)
    if not len(found):
        raise BadInput("found", "there is no design without a defect, and so nothing to draw")
    pictures: list[Picture] = []
    for number, design in enumerate(found, start=1):
        drawn = design_picture(design, found.task, SHEET_ROOM, f"{number}: {design.start}")
        note = f"greatest miss {miss_text(found.task, design.greatest_miss, found.size)}"
        pictures.append(drawn._replace(notes=(note, *((NOTE,) if number == 1 else ()))))
        for item, wanted in enumerate(found.task.wanted):
            if isinstance(wanted, WantedFunction):
                made = function_picture(design, found.task, item, SHEET_ROOM)
                pictures += [] if made is None else [made._replace(title=f"{number}: {made.title}")]
    return draw_on_sheets(pictures, found.task.name)
