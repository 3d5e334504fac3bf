"""Every assembly of a mechanism drawn small, to one scale, in windows that show the same part of the plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import ceil, floor, log10

from planar.assemblies.modes import Mode, Modes
from planar.drawing.paper.picture import Arrow, Circle, Line, Mark, Pen, Picture, Spot, extent
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme.ground import fixed
from planar.drawing.scheme.link_bodies import bodies
from planar.drawing.scheme.link_strokes import moving
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.scheme import point_letters, space_scale
from planar.foundation.errors import Outcome
from planar.foundation.units import unit
from planar.model.wording import many

SHEET = 20
"""Assemblies of one sheet, at the most."""
MOST = 96
"""Assemblies that are drawn."""
ROOMS = ((2, (130.0, 110.0)), (6, (86.0, 66.0)), (8, (62.0, 66.0)), (SHEET, (49.0, 48.0)))
"""mm for each drawing, where there are so many at the most."""
SMALLER = ((2, 1.0), (8, 0.75), (MOST, 0.6))
"""The size of pins and supports, where there are so many at the most, of their size in a drawing by itself."""
LETTERED = 10
"""Points: of more the windows would be full of letters."""
LETTER = 7.0
"""Points of the letters' size."""
AROUND = 4.5
"""mm between a drawing and its window, for letters."""
LARGE = 4.0
"""How much larger than on its own sheet a drawing is made to be measured, so that symbols hardly count."""
ROUND = (1.0, 1.2, 1.4, 1.6, 1.8, 2.0, 2.5, 3.0, 3.5, 4.0, 5.0, 6.0, 7.0, 8.0, 10.0)
"""First digits of a scale: finer steps than a ruler likes, so that the drawings fill their windows."""
THICK = 3
"""How many times the window of the sketch's own assembly is drawn, each outside the one before."""


def sheets_of(modes: Modes, scale: Scale | None = None) -> list[tuple[list[Picture], str]]:
    """The first assemblies as pictures with their numbers, as many to a sheet as it holds; and what stands above it.

    Raises NoAnswer where there is no assembly.
    """
    shown = list(modes[:MOST])
    if not shown:
        raise modes.refusal()
    by = next(by for most, by in SMALLER if len(shown) <= most)
    chosen = scale or _fitting(shown)
    drawn = [_marks(mode, chosen, by) for mode in shown]
    # letters keep near their spots, within the window
    low, high = extent([mark for marks in drawn for mark in marks])
    window = (low[0] - AROUND, low[1] - AROUND), (high[0] + AROUND, high[1] + AROUND)
    near = modes.nearest
    pictures = [
        _picture(mode, marks, window, near is not None and near.choices == mode.choices)
        for mode, marks in zip(shown, drawn, strict=True)
    ]
    # sheets that are about as full as each other
    count = ceil(len(pictures) / SHEET)
    size = ceil(len(pictures) / count)
    for first in range(0, len(pictures), size):
        pictures[first] = pictures[first]._replace(notes=(str(chosen),))
    heading = f"{modes.mechanism.name}: {_counted(modes, len(shown))}"
    return [(pictures[first : first + size], heading) for first in range(0, len(pictures), size)]


def _counted(modes: Modes, shown: int) -> str:
    if modes.total == shown:
        return f"{many(shown, 'assembly', 'assemblies')}, {modes.complete.value}"
    return f"the first {shown} of {modes.total or 'more'} assemblies"


def _fitting(shown: Sequence[Mode]) -> Scale:
    """The scale at which all assemblies fit windows of one size."""
    room = next((room for most, room in ROOMS if len(shown) <= most), ROOMS[-1][1])
    corners: list[Spot] = []
    mechanism = shown[0].mechanism
    for mode in shown:
        whole = space_scale(mode.mechanism, mode.frames, mode.shapes)
        large = replace(whole, per_mm=whole.per_mm / LARGE)
        corners += [(x * large.per_mm, y * large.per_mm) for x, y in extent(_marks(mode, large))]
    xs, ys = zip(*corners, strict=True)
    width, height = max(xs) - min(xs), max(ys) - min(ys)
    most = max(width / (room[0] - 2.0 * AROUND), height / (room[1] - 2.0 * AROUND)) or 1e-3
    by = unit(mechanism.units.length)
    per_cm = by.from_si(10.0 * most)
    power = 10.0 ** floor(log10(per_cm))
    digit = next(digit for digit in ROUND if digit * power >= per_cm * (1.0 - 1e-9))
    return Scale("length", by.to_si(digit * power) / 10.0, mechanism.units.length)


def _marks(mode: Mode, scale: Scale, by: float = 1.0) -> list[Mark]:
    """A drawing to scale, its symbols so much smaller than usual."""
    mechanism, shapes = mode.mechanism, mode.shapes
    larger = replace(scale, per_mm=scale.per_mm * by)
    scene = Scene(mechanism, bodies(mechanism, shapes), mode.frames, shapes, larger)
    letters = list(point_letters(scene, LETTER))
    marks = [*fixed(scene), *moving(scene), *(letters if len(letters) <= LETTERED else [])]
    return [_shrunk(mark, by) for mark in marks]


def _shrunk(mark: Mark, by: float) -> Mark:
    """A mark with all its places and radii so much smaller; a letter keeps its size."""

    def place(at: Spot) -> Spot:
        return by * at[0], by * at[1]

    if isinstance(mark, Line):
        return mark._replace(spots=tuple(map(place, mark.spots)))
    if isinstance(mark, Arrow):
        return mark._replace(tail=place(mark.tail), head=place(mark.head))
    if isinstance(mark, Circle):
        return mark._replace(centre=place(mark.centre), radius=by * mark.radius)
    return mark._replace(at=place(mark.at), away=by * mark.away)


def _picture(mode: Mode, marks: Sequence[Mark], window: tuple[Spot, Spot], own: bool) -> Picture:
    """One assembly in its window, with its number below."""
    (left, bottom), (right, top) = window
    about = f"window of {mode.number}"
    boxes = []
    for k in range(THICK if own else 1):
        off = 0.25 * k
        corners = ((left, bottom), (right, bottom), (right, top), (left, top))
        spots = tuple((x + (off if x == right else -off), y + (off if y == top else -off)) for x, y in corners)
        boxes.append(Line(spots, Pen.INPUT if own else Pen.CIRCLE, about, closed=True))
    told = [str(mode.number)]
    told += ["the sketch's own"] if own else []
    told += [] if mode.outcome is Outcome.SOLVED else [mode.outcome.value]
    return Picture((*boxes, *marks), ", ".join(told))
