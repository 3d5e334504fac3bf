"""Figures written to files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from planar.drawing.output.matplotlib_figure import encode_figure
from planar.foundation.safe_files import save_file

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def save(figures: Figure | Sequence[Figure], file: str | Path) -> None:
    """Write a figure to a .png, .svg, .pdf or .dxf file; several as pages of one .pdf, or one below the other.

    Raises BadInput for another kind of file, and where it cannot be written.
    """
    path = Path(file)
    if not isinstance(figures, Sequence):
        save_file(path, encode_figure(figures, path.suffix))
        return
    from planar.drawing.output.solution_pages import encode_sheets

    save_file(path, encode_sheets(figures, path.suffix))
