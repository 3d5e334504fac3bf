"""Drawings of mechanisms as matplotlib figures in which a millimetre on paper is a millimetre."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from planar.analysis.pencil import acceleration_polygon, velocity_polygon
from planar.drawing import animation, paper
from planar.drawing.diagrams import diagrams
from planar.drawing.figure import figure, pages
from planar.drawing.page import solution_pages
from planar.drawing.picture import Picture, extent
from planar.drawing.polygons import polygon_picture
from planar.drawing.positions import loci as loci_picture
from planar.drawing.positions import positions as positions_picture
from planar.drawing.scheme import scheme as scheme_picture
from planar.drawing.scheme import space_scale, standing
from planar.errors import BadInput
from planar.files import save as write
from planar.mechanism import Mechanism
from planar.motion import Motion, State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["acceleration", "animate", "diagrams", "loci", "positions", "save", "scheme", "solution", "velocity"]

Scales = str | Sequence[str] | None
"""Scales as a reader writes them, each for what its unit measures: "1 cm = 100 mm", "1:5", "1 cm = 0.1 m/s"."""
KINDS = ("length", "velocity", "acceleration")
PANEL = (80.0, 80.0)
"""mm on paper for each of several drawings in a row of a sheet of A4."""


def scheme(state: State, scale: Scales = None) -> Figure:
    """The kinematic scheme of a position: links numbered, points lettered. Raises BadInput for a scale that is none."""
    return figure([scheme_picture(state, _scale(scale, "length"))])


def velocity(state: State, scale: Scales = None) -> Figure:
    """The space diagram and the velocity polygon of a position, each to its scale."""
    return figure(_polygons(state, scale, 2), state.mechanism.name)


def acceleration(state: State, scale: Scales = None) -> Figure:
    """The space diagram, the velocity polygon and the acceleration polygon of a position, each to its scale."""
    return figure(_polygons(state, scale, 3), state.mechanism.name)


def positions(
    motion: Motion | Mechanism, count: int = 12, points: Sequence[str] | None = None, scale: Scales = None
) -> Figure:
    """The mechanism in `count` + 1 positions, its joints lettered A0, A1, ...; TDC and BDC where a slider has them."""
    return figure([positions_picture(motion, count, points, _scale(scale, "length"))])


def loci(motion: Motion | Mechanism, points: Sequence[str] | None = None, scale: Scales = None) -> Figure:
    """The paths of points (left out: of those that no link on the frame carries)."""
    return figure([loci_picture(motion, points, _scale(scale, "length"))])


def solution(state: State) -> list[Figure]:
    """The worked solution of a position on pages of A4."""
    return solution_pages(state)


def animate(
    motion: Motion | Mechanism,
    file: str | Path,
    points: Sequence[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> None:
    """Write the motion as a .gif or .mp4 file, with the paths of points. `progress` is told (frames done, frames).

    Raises BadInput for another kind of file, and where what writes it is not installed.
    """
    path = Path(file)
    write(path, animation.animate(motion, path.suffix, points, progress))


def save(figures: Figure | Sequence[Figure], file: str | Path) -> None:
    """Write a figure to a .png, .svg or .pdf file, several as pages of one .pdf. Raises BadInput."""
    path = Path(file)
    write(path, pages(figures if isinstance(figures, Sequence) else [figures], path.suffix))


def _polygons(state: State, scales: Scales, many: int) -> list[Picture]:
    """Space diagram, velocity polygon and acceleration polygon, the first of them, each small enough for a row."""
    space = _scale(scales, "length")
    if space is None:
        whole = space_scale(state.mechanism, standing(state.frames), state.shapes)
        width, height = _size(scheme_picture(state, whole))
        space = paper.fitting("length", whole.unit, width * whole.per_mm, height * whole.per_mm, PANEL)
    pictures = [scheme_picture(state, space)._replace(title="Space diagram", notes=_scales(space))]
    for polygon in (velocity_polygon(state), acceleration_polygon(state))[: many - 1]:
        spread = np.ptp([(0.0, 0.0), *polygon.letters.values()], axis=0)
        unit = paper.SI[polygon.kind]
        fits = _scale(scales, polygon.kind) or paper.fitting(polygon.kind, unit, *map(float, spread), PANEL)
        drawn = polygon_picture(polygon, fits)
        rest = tuple(note for note in drawn.notes[1:] if note not in _scales(fits))
        title = f"{polygon.kind} polygon".capitalize()
        pictures.append(drawn._replace(title=title, notes=(*_scales(fits), *rest)))
    return pictures


def _scales(scale: paper.Scale) -> tuple[str, str]:
    return str(scale), scale.mu


def _size(picture: Picture) -> tuple[float, float]:
    low, high = extent(picture.marks)
    return high[0] - low[0], high[1] - low[1]


def _scale(scales: Scales, kind: str) -> paper.Scale | None:
    """The scale that is given for a kind of quantity. Raises BadInput for what is none, or stands twice."""
    texts = [scales] if isinstance(scales, str) else list(scales or ())
    found = [paper.given(text) for text in texts]
    for each in found:
        if each.kind not in KINDS:
            raise BadInput("scale", f"drawings have scales of {', '.join(KINDS)}, not of {each.kind}")
    of_kind = [each for each in found if each.kind == kind]
    if len(of_kind) > 1:
        raise BadInput("scale", f"two scales of {kind} are given; one is wanted")
    return of_kind[0] if of_kind else None
