"""Every drawing of every textbook example and of ten other models on one sheet: `python -m tests.contact_sheet`."""

import io
import sys
from concurrent.futures import ProcessPoolExecutor
from itertools import product
from pathlib import Path

from PIL import Image, ImageDraw

from planar import plot
from planar.document.files import model_files
from planar.drawing.output.matplotlib_figure import encode_figure
from tests.known import MODELS as MODELS_OF
from tests.known import state_of

GALLERY = (
    "jansen-leg",
    "peaucellier-lipkin",
    "whitworth",
    "slotted-lever",
    "planetary-gear-set",
    "rack-steering",
    "double-butterfly",
    "geared-five-bar",
    "scissor-lift",
    "oscillating-cylinder",
)
MODELS = (*(file.stem for file in model_files() if file.parent.name == "textbook"), *GALLERY)
DRAWINGS = ("scheme", "velocity", "acceleration", "centres", "positions", "loci", "diagrams")
CELL, LINE = (280, 190), 14
"""Pixels of a drawing on the sheet, and of the line below it."""


def drawn(model: str, what: str):
    """One drawing of a model as a figure."""
    if what in ("scheme", "velocity", "acceleration", "centres"):
        return getattr(plot, what)(state_of(model))
    return getattr(plot, what)(MODELS_OF[model])


def small(cell: tuple[str, str]) -> bytes:
    """A drawing as the bytes of a small picture."""
    picture = Image.open(io.BytesIO(encode_figure(drawn(*cell), ".png"))).convert("RGB")
    picture.thumbnail(CELL, Image.Resampling.LANCZOS)
    small_one = io.BytesIO()
    picture.save(small_one, "png")
    return small_one.getvalue()


def main(file: Path) -> None:
    cells = tuple(product(MODELS, DRAWINGS))
    sheet = Image.new("RGB", (len(DRAWINGS) * CELL[0], len(MODELS) * (CELL[1] + LINE)), "white")
    pen = ImageDraw.Draw(sheet)
    with ProcessPoolExecutor() as pool:
        for index, (cell, content) in enumerate(zip(cells, pool.map(small, cells), strict=True)):
            row, column = divmod(index, len(DRAWINGS))
            x, y = column * CELL[0], row * (CELL[1] + LINE)
            picture = Image.open(io.BytesIO(content))
            sheet.paste(picture, (x + (CELL[0] - picture.width) // 2, y + (CELL[1] - picture.height) // 2))
            pen.text((x + 4, y + CELL[1]), f"{cell[0]}: {cell[1]}", "black")
    sheet.quantize(64, Image.Quantize.FASTOCTREE).save(file, optimize=True)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).with_suffix(".png"))
