"""The worked solution as printed pages: space diagram and polygons to scale, equations, tables, sentences, results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from math import isclose
from typing import TYPE_CHECKING

import numpy as np

from planar.analysis.rich_text import Name, Phrase, number
from planar.analysis.worked.published import Comparison
from planar.analysis.worked.sections import Section
from planar.analysis.worked.solution import Solution, Worked, worked_solution
from planar.drawing.labels.fonts import quiet
from planar.drawing.labels.typesetting import Sheet, Style
from planar.drawing.output.matplotlib_figure import INCH, SETTINGS, cell, pages, put
from planar.drawing.output.page_layout import (
    HEIGHT,
    PAGE,
    ROOM,
    WIDTH,
    Column,
    Strip,
    lines,
    paged,
    table,
)
from planar.drawing.paper.pens import ready
from planar.drawing.paper.picture import Letter, Picture, extent
from planar.drawing.paper.scales import Scale, fitting
from planar.drawing.polygons.polygon import polygon_picture
from planar.drawing.scheme.scheme import scheme, space_scale, standing
from planar.dynamics.load_attachment import choices
from planar.foundation.errors import BadInput
from planar.foundation.units import own, shown, unit
from planar.model.mechanism import QUANTITIES
from planar.results.motion import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

ROOMS = {"length": (80.0, 80.0), "velocity": (80.0, 90.0), "acceleration": (80.0, 90.0)}
"""mm that a drawing takes at the most, unless its scale is given."""
AROUND = 15.0
"""mm that symbols may take about the points of a space diagram."""
RESOLUTION = 150
"""Dots to an inch of pages in one picture."""
HIGHEST = 60_000
"""Pixels: pages in one picture are not higher together."""
TITLE, PART, TOPIC, SMALL = Style(15.0, heavy=True), Style(12.5, heavy=True), Style(11.0, heavy=True), Style(9.5)
INDENT = 8.0
"""mm by which numbered sentences are set in."""


def solution_pages(
    state: State, comparisons: Sequence[Comparison] = (), scales: Mapping[str, Scale] | None = None
) -> list[Figure]:
    """The worked solution of a position on upright A4 pages, drawings to round scales unless they are given.

    Raises BadInput where a given scale would make a drawing larger than a page, or matplotlib is missing.
    """
    ready()
    from matplotlib import rc_context

    solution = worked_solution(state, comparisons)
    used = {**_fitting(solution), **(scales or {})}
    with rc_context(SETTINGS):
        return paged(_strips(solution, used))


def sheets(figures: Sequence[Figure], suffix: str) -> bytes:
    """Pages as a .pdf file, or together as one .png picture. Raises BadInput."""
    if suffix.lower() != ".png":
        return pages(figures, suffix)
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.image import imsave

    sizes = np.array([figure.get_size_inches() for figure in figures])
    columns = _columns(len(figures), *sizes.max(axis=0))
    high = sum(sizes[row : row + columns, 1].max() for row in range(0, len(sizes), columns))
    dots = min(RESOLUTION, int(HIGHEST / high))
    found = []
    with rc_context(SETTINGS), quiet():
        for figure in figures:
            canvas = FigureCanvasAgg(figure)
            figure.set_dpi(dots)
            canvas.draw()
            found.append(np.asarray(canvas.buffer_rgba())[..., :3].copy())
    out = BytesIO()
    wide = max(page.shape[1] for page in found)
    rows = []
    for first in range(0, len(found), columns):
        row = found[first : first + columns]
        tall = max(page.shape[0] for page in row)
        row += [np.zeros((0, 0, 3), dtype=np.uint8)] * (columns - len(row))
        rows.append(np.hstack([_padded(page, tall, wide) for page in row]))
    imsave(out, np.vstack(rows), format="png", dpi=dots, metadata={"Software": None})
    return out.getvalue()


def _columns(count: int, width: float, height: float) -> int:
    """Sheets (inches) side by side, so that the picture is about square; upright pages of A4 are below each other."""
    if isclose(INCH * width, WIDTH, abs_tol=0.1) and isclose(INCH * height, HEIGHT, abs_tol=0.1):
        return 1
    return max(each for each in range(1, count + 1) if each == 1 or each * width <= -(-count // each) * height)


def _padded(page: np.ndarray, tall: int, wide: int) -> np.ndarray:
    """A page with white paper on the right and below it."""
    return np.pad(page, ((0, tall - page.shape[0]), (0, wide - page.shape[1]), (0, 0)), constant_values=255)


def _fitting(solution: Solution) -> dict[str, Scale]:
    """Round scales at which the polygons fit their room."""
    found = {}
    for half in solution.halves:
        values = np.array([(0.0, 0.0), *half.polygon.letters.values()])
        width, height = (float(each) for each in np.ptp(values, axis=0))
        most = ROOMS[half.kind]
        found[half.kind] = fitting(half.kind, own(half.kind, solution.state.mechanism.units)[0], width, height, most)
    return found | {"length": _space(solution.state)}


def _space(state: State) -> Scale:
    """A round scale at which the strokes of the space diagram fit their room, wheels and guides included."""
    scale, length = space_scale(state.mechanism, standing(state.frames), state.shapes), state.mechanism.units.length
    for _ in range(3):
        low, high = extent([mark for mark in scheme(state, scale).marks if not isinstance(mark, Letter)])
        size = [(b - a) * scale.per_mm for a, b in zip(low, high, strict=True)]
        room = ROOMS["length"][0] + AROUND, ROOMS["length"][1] + AROUND
        scale, before = fitting("length", length, *size, room), scale
        if scale == before:
            break
    return scale


def _strips(solution: Solution, used: Mapping[str, Scale]) -> Iterator[Strip]:
    mechanism = solution.state.mechanism
    yield from lines((mechanism.name,), TITLE)
    if mechanism.source:
        yield from lines((mechanism.source,), Style(9.5, slanted=True), before=0.5)
    yield from lines(("Given",), TOPIC, before=3.0, keep=True)
    for phrase in solution.given:
        yield from lines(phrase, indent=4.0)
    yield from lines(("To find",), TOPIC, before=2.0, keep=True)
    for phrase in solution.asked:
        yield from lines(phrase, indent=4.0)
    pictures = [scheme(solution.state, used["length"])._replace(title="Space diagram")]
    for half in solution.halves:
        pictures.append(
            polygon_picture(half.polygon, used[half.kind])._replace(title=f"{half.kind.capitalize()} polygon")
        )
    yield from _figures([_captioned(picture) for picture in pictures])
    for count, half in enumerate(solution.halves, 1):
        yield from lines((f"{count}. {half.kind.capitalize()} polygon",), PART, before=5.0, keep=True)
        for section in half.sections:
            yield from _section(section, half, used)
    yield from lines(("3. Results",), PART, before=5.0, keep=True)
    yield from _results(solution)
    yield from _compared(solution)
    notes = [*choices(mechanism), *solution.state.remarks, *mechanism.notes]
    if notes:
        yield from lines(("Notes",), TOPIC, before=4.0, keep=True)
    for note in notes:
        yield from lines((note,), SMALL, label="–", indent=4.0)


def _captioned(picture: Picture) -> Picture:
    """A picture whose notes do not say its title again."""
    notes = [note.removeprefix("Space diagram, ").replace("^2", "²") for note in picture.notes]
    return picture._replace(notes=tuple(n for n in notes if n.lower() != picture.title.lower() and n[:1] != "μ"))


def _figures(pictures: Sequence[Picture]) -> Iterator[Strip]:
    """Pictures side by side where they fit, else below each other."""
    made = [cell(picture) for picture in pictures]
    for each in made:
        if each.width > ROOM or each.inside[1] + each.below > PAGE:
            size = f"{each.width:.0f} x {each.inside[1] + each.below:.0f} mm"
            raise BadInput(
                "--scale", f"the {each.picture.title.lower()} takes {size}, more than a page: choose a smaller"
            )
    rows: list[list] = []
    for each in made:
        if rows and sum(other.width for other in (*rows[-1], each)) + 6.0 * len(rows[-1]) <= ROOM:
            rows[-1].append(each)
        else:
            rows.append([each])
    for row in rows:
        yield _drawn(row)


def _drawn(row: Sequence) -> Strip:
    inside = max(each.inside[1] for each in row)
    tall = inside + max(each.below for each in row)
    gap = (ROOM - sum(each.width for each in row)) / (len(row) + 1)

    def draw(page: Sheet, x: float, y: float) -> None:
        left = x + gap
        for each in row:
            put(page.figure, each, (left, y - inside))
            left += each.width + gap

    return Strip(tall, draw, before=4.0, floats=True)


def _section(section: Section, half: Worked, used: Mapping[str, Scale]) -> Iterator[Strip]:
    yield from lines((section.title,), TOPIC, before=3.0, keep=True)
    for phrase in section.known:
        yield from lines(phrase, keep=True)
    for phrase in section.equation:
        yield from lines(phrase, indent=INDENT, before=0.6, keep=True)
    if section.rows:
        heads = (
            "S.N.",
            "Vector",
            f"Magnitude ({shown(half.kind, half.polygon.state.mechanism.units)[0]})",
            "Direction",
            "Sense",
        )
        cells = [
            ((f"{count}.",), (row.symbol, " or ", row.chord), row.magnitude, row.direction, row.sense)
            for count, row in enumerate(section.rows, 1)
        ]
        yield from table([Column(head) for head in heads], cells)
    for count, phrase in enumerate(section.steps, 1):
        yield from lines(phrase, paper=used, label=f"{count})", indent=INDENT, before=2.0 if count == 1 else 0.0)
    for phrase in section.simultaneous:
        yield from lines(phrase, before=1.0)
    for count, phrase in enumerate(section.images, len(section.steps) + 1):
        yield from lines(phrase, paper=used, label=f"{count})", indent=INDENT)
    for count, phrase in enumerate(section.results):
        yield from lines(phrase, indent=INDENT, before=2.0 if not count else 0.0)


def _results(solution: Solution) -> Iterator[Strip]:
    if solution.links:
        heads = [Column("Link"), Column("ω (rad/s)", True), Column(""), Column("α (rad/s²)", True), Column("")]
        cells: list[Sequence[Phrase]] = [
            (
                (Name(link.link),),
                (number(abs(link.velocity)),),
                (link.velocity_sense,),
                (number(abs(link.acceleration)),),
                (link.acceleration_sense,),
            )
            for link in solution.links
        ]
        yield from table(heads, cells, title="Links")
    (v, velocity), (a, acceleration) = (
        shown(kind, solution.state.mechanism.units) for kind in ("velocity", "acceleration")
    )
    heads = [Column("Point"), Column(f"v ({v})", True), Column(""), Column(f"a ({a})", True), Column("")]
    cells = [
        (
            (Name(point.point),),
            (number(velocity.from_si(point.velocity)),),
            (point.velocity_sense,),
            (number(acceleration.from_si(point.acceleration)),),
            (point.acceleration_sense,),
        )
        for point in solution.points
    ]
    yield from table(heads, cells, title="Points", before=4.0)
    if solution.slides:
        length = solution.state.mechanism.units.length
        names = ("Pair", f"s ({length})", f"v ({v})", f"a ({a})")
        cells = [
            (
                (slide.pair,),
                (f"{unit(length).from_si(slide.displacement):.6g}".replace("-", "−"),),
                (number(velocity.from_si(slide.velocity)),),
                (number(acceleration.from_si(slide.acceleration)),),
            )
            for slide in solution.slides
        ]
        heads = [Column(name, index > 0) for index, name in enumerate(names)]
        yield from table(heads, cells, title="Slides, along their lines", before=4.0)
    if solution.rubbing:
        yield from lines(("Rubbing speeds at the pins",), Style(10.0, heavy=True), before=4.0, keep=True)
    for phrase in solution.rubbing:
        yield from lines(phrase, indent=4.0)


def _compared(solution: Solution) -> Iterator[Strip]:
    if not solution.comparisons:
        return
    cells: list[Sequence[Phrase]] = []
    reasons: list[Phrase] = []
    for each in solution.comparisons:
        item = each.published
        measure, of = shown(QUANTITIES[item.quantity], solution.state.mechanism.units)
        off = "" if each.apart is None else f"{round(100.0 * each.apart, 1) + 0.0:+.1f} %".replace("-", "−")
        printed = "—" if item.value is None else f"{of.from_si(item.value):.6g}".replace("-", "−")
        solved = (number(of.from_si(each.solved)),)
        cells.append(((each.about,), solved, (printed,), (measure,), (off,), (each.verdict,)))
        why = item.slip or item.note
        if why:
            reasons.append((f"{each.about}: {why}",))
    heads = [Column("Quantity"), Column("Solved", True), Column("Printed", True), Column("")]
    yield from table([*heads, Column("Off", True), Column("")], cells, title="Published values", before=4.0)
    for count, reason in enumerate(reasons):
        yield from lines(reason, SMALL, label="–", indent=4.0, before=1.5 if not count else 0.0)
