"""Every assembly of a mechanism drawn small, to one scale, in windows that show the same part of the plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, floor, log10

from planar.assemblies.modes import Mode, Modes
from planar.assemblies.selection import selection_words
from planar.drawing.paper.picture import Arrow, Circle, Mark, PaperPoint, Pen, Picture, Polyline, extent
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.ground import fixed_marks
from planar.drawing.scheme.link_bodies import link_bodies
from planar.drawing.scheme.link_strokes import moving_marks
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.scheme import point_labels, space_scale
from planar.foundation.errors import Outcome
from planar.foundation.units import parse_unit
from planar.model.wording import count_phrase

ASSEMBLIES_PER_SHEET = 20
"""Assemblies of one sheet, at the most."""
MAX_ASSEMBLIES = 96
"""Assemblies that are drawn."""
WINDOW_SIZES = ((2, (130.0, 110.0)), (6, (86.0, 66.0)), (8, (62.0, 66.0)), (ASSEMBLIES_PER_SHEET, (49.0, 48.0)))
"""mm for each drawing, where there are so many at the most."""
SYMBOL_SIZES = ((2, 1.0), (8, 0.75), (MAX_ASSEMBLIES, 0.6))
"""The size of pins and supports, where there are so many at the most, of their size in a drawing by itself."""
MAX_LABELLED_POINTS = 10
"""Points: of more the windows would be full of letters."""
LABEL_SIZE = 7.0
"""Points of the letters' size."""
WINDOW_MARGIN = 4.5
"""mm between a drawing and its window, for letters."""
MEASURING_ENLARGEMENT = 4.0
"""How much larger than on its own sheet a drawing is made to be measured, so that symbols hardly count."""
SCALE_DIGITS = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0)
"""First digits of a scale: finer steps than a ruler likes, so that the drawings fill their windows."""
OWN_WINDOW_LINES = 3
"""How many times the window of the sketch's own assembly is drawn, each outside the one before."""


def assembly_sheets(modes: Modes, scale: Scale | None = None) -> list[tuple[list[Picture], str]]:
    """The first assemblies as pictures with their numbers, as many to a sheet as it holds; and what stands above it.

    Raises NoAnswer where there is no assembly.
    """
    shown = list(modes[:MAX_ASSEMBLIES])
    if not shown:
        raise modes.refusal()
    by = next(by for most, by in SYMBOL_SIZES if len(shown) <= most)
    chosen = scale or _common_scale(shown)
    drawn = [_assembly_marks(mode, chosen, by) for mode in shown]
    # letters keep near their spots, within the window
    low, high = extent([mark for marks in drawn for mark in marks])
    window = (low[0] - WINDOW_MARGIN, low[1] - WINDOW_MARGIN), (high[0] + WINDOW_MARGIN, high[1] + WINDOW_MARGIN)
    near, words = modes.nearest, selection_words(modes.mechanism)
    pictures = [
        _assembly_picture(mode, marks, window, words if near is not None and near.choices == mode.choices else "")
        for mode, marks in zip(shown, drawn, strict=True)
    ]
    # sheets that are about as full as each other
    count = ceil(len(pictures) / ASSEMBLIES_PER_SHEET)
    size = ceil(len(pictures) / count)
    for first in range(0, len(pictures), size):
        pictures[first] = pictures[first]._replace(notes=(str(chosen),))
    heading = f"{modes.mechanism.name}: {_count_text(modes, len(shown))}"
    return [(pictures[first : first + size], heading) for first in range(0, len(pictures), size)]


def _count_text(modes: Modes, shown: int) -> str:
    if modes.total == shown:
        return f"{count_phrase(shown, 'assembly', 'assemblies')}, {modes.complete.value}"
    return f"the first {shown} of {modes.total or 'more'} assemblies"


def _common_scale(shown: Sequence[Mode]) -> Scale:
    """The scale at which all assemblies fit windows of one size."""
    room = next((room for most, room in WINDOW_SIZES if len(shown) <= most), WINDOW_SIZES[-1][1])
    corners: list[PaperPoint] = []
    mechanism = shown[0].mechanism
    for mode in shown:
        whole = space_scale(mode.mechanism, mode.frames, mode.shapes)
        large = replace(whole, per_mm=whole.per_mm / MEASURING_ENLARGEMENT)
        corners += [(x * large.per_mm, y * large.per_mm) for x, y in extent(_assembly_marks(mode, large))]
    xs, ys = zip(*corners, strict=True)
    width, height = max(xs) - min(xs), max(ys) - min(ys)
    most = max(width / (room[0] - 2.0 * WINDOW_MARGIN), height / (room[1] - 2.0 * WINDOW_MARGIN)) or 1e-3
    by = parse_unit(mechanism.units.length)
    per_cm = by.from_si(10.0 * most)
    power = 10.0 ** floor(log10(per_cm))
    digit = next(digit for digit in SCALE_DIGITS if digit * power >= per_cm * (1.0 - 1e-9))
    return Scale("length", by.to_si(digit * power) / 10.0, mechanism.units.length)


def _assembly_marks(mode: Mode, scale: Scale, symbol_size: float = 1.0) -> list[Mark]:
    """A drawing to scale, its symbols so much smaller than usual."""
    mechanism, shapes = mode.mechanism, mode.shapes
    larger = replace(scale, per_mm=scale.per_mm * symbol_size)
    scene = Scene(mechanism, link_bodies(mechanism, shapes), mode.frames, shapes, larger)
    letters = list(point_labels(scene, LABEL_SIZE))
    marks = [*fixed_marks(scene), *moving_marks(scene), *(letters if len(letters) <= MAX_LABELLED_POINTS else [])]
    return [_scale_mark(mark, symbol_size) for mark in marks]


def _scale_mark(mark: Mark, factor: float) -> Mark:
    """A mark with all its places and radii so much smaller; a letter keeps its size."""

    def place(at: PaperPoint) -> PaperPoint:
        return factor * at[0], factor * at[1]

    if isinstance(mark, Polyline):
        return mark._replace(points=tuple(map(place, mark.points)))
    if isinstance(mark, Arrow):
        return mark._replace(tail=place(mark.tail), head=place(mark.head))
    if isinstance(mark, Circle):
        return mark._replace(centre=place(mark.centre), radius=factor * mark.radius)
    return mark._replace(at=place(mark.at), clearance=factor * mark.clearance)


def _assembly_picture(
    mode: Mode, marks: Sequence[Mark], window: tuple[PaperPoint, PaperPoint], selection: str
) -> Picture:
    """One assembly in its window, with its number below and, of the one that is solved, how it is selected."""
    (left, bottom), (right, top) = window
    about = f"window of {mode.number}"
    boxes = []
    for k in range(OWN_WINDOW_LINES if selection else 1):
        off = 0.25 * k
        corners = ((left, bottom), (right, bottom), (right, top), (left, top))
        spots = tuple((x + (off if x == right else -off), y + (off if y == top else -off)) for x, y in corners)
        boxes.append(Polyline(spots, Pen.INPUT if selection else Pen.CIRCLE, about, closed=True))
    outcome = "" if mode.outcome is Outcome.SOLVED else mode.outcome.value
    return Picture((*boxes, *marks), ", ".join(filter(None, (str(mode.number), selection, outcome))))
