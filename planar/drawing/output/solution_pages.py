"""The worked solution as printed pages: space diagram and polygons to scale, equations, tables, sentences, results."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from io import BytesIO
from math import isclose
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.analysis.rich_text import Name, Phrase, format_number
from planar.analysis.worked.published import Comparison
from planar.analysis.worked.sections import Section
from planar.analysis.worked.solution import WorkedPolygon, WorkedSolution, worked_solution
from planar.drawing.labels.fonts import quiet_font_logs
from planar.drawing.labels.typesetting import TextStyle, TypesetPage
from planar.drawing.output.matplotlib_figure import (
    MATPLOTLIB_SETTINGS,
    MM_PER_INCH,
    PictureCell,
    draw_cell,
    encode_pages,
    lay_out_picture,
)
from planar.drawing.output.page_layout import (
    PAGE_HEIGHT,
    PAGE_WIDTH,
    TEXT_WIDTH,
    USABLE_HEIGHT,
    PageColumn,
    Strip,
    lay_out_pages,
    paragraph,
    table_strips,
)
from planar.drawing.paper.pens import require_matplotlib
from planar.drawing.paper.picture import Label, Picture, extent
from planar.drawing.paper.scales import Scale, round_scale
from planar.drawing.polygons.polygon import polygon_picture
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme, space_scale
from planar.dynamics.load_attachment import attachment_remarks
from planar.foundation.errors import BadInput
from planar.foundation.units import format_unit, parse_unit
from planar.model.file_units import display_unit, rate_unit, unit_of_kind
from planar.model.mechanism import PUBLISHED_QUANTITIES
from planar.results.motion import State

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DRAWING_SIZES = {"length": (80.0, 80.0), "velocity": (80.0, 90.0), "acceleration": (80.0, 90.0)}
"""mm that a drawing takes at the most, unless its scale is given."""
SYMBOL_MARGIN = 15.0
"""mm that symbols may take about the points of a space diagram."""
RESOLUTION = 150
"""Dots to an inch of pages in one picture."""
MAX_PIXEL_HEIGHT = 60_000
"""Pixels: pages in one picture are not higher together."""
TITLE_STYLE, SECTION_STYLE, TOPIC_STYLE, SMALL_STYLE = (
    TextStyle(15.0, heavy=True),
    TextStyle(12.5, heavy=True),
    TextStyle(11.0, heavy=True),
    TextStyle(9.5),
)
INDENT = 8.0
"""mm by which numbered sentences are set in."""


def solution_pages(
    state: State,
    comparisons: Sequence[Comparison] = (),
    scales: Mapping[str, Scale] | None = None,
    title: str | None = None,
    notes: Sequence[str] = (),
) -> list[Figure]:
    """The worked solution of a position on upright A4 pages, drawings to round scales unless they are given.

    `title` stands on top in place of the mechanism's name; `notes` follow the notes of the solution.

    Raises BadInput where a given scale would make a drawing larger than a page, or matplotlib is missing.
    """
    require_matplotlib()
    from matplotlib import rc_context

    solution = worked_solution(state, comparisons)
    used = {**_fitting_scales(solution), **(scales or {})}
    with rc_context(MATPLOTLIB_SETTINGS):
        return lay_out_pages(_solution_strips(solution, used, title or state.mechanism.name, notes))


def encode_sheets(figures: Sequence[Figure], suffix: str) -> bytes:
    """Pages as a .pdf file, or together as one .png picture. Raises BadInput."""
    if suffix.lower() != ".png":
        return encode_pages(figures, suffix)
    from matplotlib import rc_context
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.image import imsave

    sizes = np.array([figure.get_size_inches() for figure in figures])
    columns = _column_count(len(figures), *sizes.max(axis=0))
    high = sum(sizes[row : row + columns, 1].max() for row in range(0, len(sizes), columns))
    dots = min(RESOLUTION, int(MAX_PIXEL_HEIGHT / high))
    found = []
    with rc_context(MATPLOTLIB_SETTINGS), quiet_font_logs():
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
        rows.append(np.hstack([_pad_page(page, tall, wide) for page in row]))
    nameless: dict[str, Any] = {"Software": None}  # what matplotlib would write there is left out
    imsave(out, np.vstack(rows), format="png", dpi=dots, metadata=nameless)
    return out.getvalue()


def _column_count(count: int, width: float, height: float) -> int:
    """Sheets (inches) side by side, so that the picture is about square; upright pages of A4 are below each other."""
    if isclose(MM_PER_INCH * width, PAGE_WIDTH, abs_tol=0.1) and isclose(
        MM_PER_INCH * height, PAGE_HEIGHT, abs_tol=0.1
    ):
        return 1
    return max(each for each in range(1, count + 1) if each == 1 or each * width <= -(-count // each) * height)


def _pad_page(page: np.ndarray, tall: int, wide: int) -> np.ndarray:
    """A page with white paper on the right and below it."""
    return np.pad(page, ((0, tall - page.shape[0]), (0, wide - page.shape[1]), (0, 0)), constant_values=255)


def _fitting_scales(solution: WorkedSolution) -> dict[str, Scale]:
    """Round scales at which the polygons fit their room."""
    found = {}
    for half in solution.worked_polygons:
        values = np.array([(0.0, 0.0), *half.polygon.letters.values()])
        width, height = (float(each) for each in np.ptp(values, axis=0))
        most = DRAWING_SIZES[half.kind]
        found[half.kind] = round_scale(
            half.kind, unit_of_kind(half.kind, solution.state.mechanism.units)[0], width, height, most
        )
    return found | {"length": space_diagram_scale(solution.state)}


def space_diagram_scale(state: State, size: tuple[float, float] = DRAWING_SIZES["length"]) -> Scale:
    """A round scale at which the strokes of the space diagram fit a room in mm, wheels and guides included."""
    scale, length = space_scale(state.mechanism, plain_frames(state.frames), state.shapes), state.mechanism.units.length
    for _ in range(3):
        low, high = extent([mark for mark in scheme(state, scale).marks if not isinstance(mark, Label)])
        width, height = ((b - a) * scale.per_mm for a, b in zip(low, high, strict=True))
        room = size[0] + SYMBOL_MARGIN, size[1] + SYMBOL_MARGIN
        scale, before = round_scale("length", length, width, height, room), scale
        if scale == before:
            break
    return scale


def _solution_strips(
    solution: WorkedSolution, scales: Mapping[str, Scale], title: str, more_notes: Sequence[str]
) -> Iterator[Strip]:
    mechanism = solution.state.mechanism
    yield from paragraph((title,), TITLE_STYLE)
    if mechanism.source:
        yield from paragraph((mechanism.source,), TextStyle(9.5, slanted=True), space_before=0.5)
    yield from paragraph(("Given",), TOPIC_STYLE, space_before=3.0, keep_with_next=True)
    for phrase in solution.given:
        yield from paragraph(phrase, indent=4.0)
    yield from paragraph(("To find",), TOPIC_STYLE, space_before=2.0, keep_with_next=True)
    for phrase in solution.asked:
        yield from paragraph(phrase, indent=4.0)
    pictures = [scheme(solution.state, scales["length"])._replace(title="Space diagram")]
    for half in solution.worked_polygons:
        pictures.append(
            polygon_picture(half.polygon, scales[half.kind])._replace(title=f"{half.kind.capitalize()} polygon")
        )
    yield from picture_strips([shorten_notes(picture) for picture in pictures])
    for count, half in enumerate(solution.worked_polygons, 1):
        yield from paragraph(
            (f"{count}. {half.kind.capitalize()} polygon",), SECTION_STYLE, space_before=5.0, keep_with_next=True
        )
        for section in half.sections:
            yield from _section_strips(section, half, scales)
    yield from paragraph(("3. Results",), SECTION_STYLE, space_before=5.0, keep_with_next=True)
    yield from _result_strips(solution)
    yield from _comparison_strips(solution)
    notes = [*attachment_remarks(mechanism), *solution.state.remarks, *mechanism.notes, *more_notes]
    if notes:
        yield from paragraph(("Notes",), TOPIC_STYLE, space_before=4.0, keep_with_next=True)
    for note in notes:
        yield from paragraph((note,), SMALL_STYLE, label="–", indent=4.0)


def shorten_notes(picture: Picture) -> Picture:
    """A picture whose notes do not say its title again."""
    notes = [note.removeprefix("Space diagram, ").replace("^2", "²") for note in picture.notes]
    return picture._replace(notes=tuple(n for n in notes if n.lower() != picture.title.lower() and n[:1] != "μ"))


def picture_strips(pictures: Sequence[Picture]) -> Iterator[Strip]:
    """Pictures side by side where they fit, else below each other."""
    made = [lay_out_picture(picture) for picture in pictures]
    for each in made:
        if each.width > TEXT_WIDTH or each.axes_size[1] + each.text_height > USABLE_HEIGHT:
            size = f"{each.width:.0f} x {each.axes_size[1] + each.text_height:.0f} mm"
            raise BadInput(
                "--scale", f"the {each.picture.title.lower()} takes {size}, more than a page: choose a smaller"
            )
    rows: list[list[PictureCell]] = []
    for each in made:
        if rows and sum(other.width for other in (*rows[-1], each)) + 6.0 * len(rows[-1]) <= TEXT_WIDTH:
            rows[-1].append(each)
        else:
            rows.append([each])
    for row in rows:
        yield _picture_row_strip(row)


def _picture_row_strip(row: Sequence[PictureCell]) -> Strip:
    inside = max(each.axes_size[1] for each in row)
    tall = inside + max(each.text_height for each in row)
    gap = (TEXT_WIDTH - sum(each.width for each in row)) / (len(row) + 1)

    def draw(page: TypesetPage, x: float, y: float) -> None:
        left = x + gap
        for each in row:
            draw_cell(page.figure, each, (left, y - inside))
            left += each.width + gap

    return Strip(tall, draw, space_before=4.0, is_float=True)


def _section_strips(section: Section, half: WorkedPolygon, scales: Mapping[str, Scale]) -> Iterator[Strip]:
    yield from paragraph((section.title,), TOPIC_STYLE, space_before=3.0, keep_with_next=True)
    for phrase in section.known:
        yield from paragraph(phrase, keep_with_next=True)
    for phrase in section.equation:
        yield from paragraph(phrase, indent=INDENT, space_before=0.6, keep_with_next=True)
    if section.rows:
        heads = (
            "S.N.",
            "Vector",
            f"Magnitude ({format_unit(rate_unit(half.kind, half.polygon.state.mechanism.units)[0])})",
            "Direction",
            "Sense",
        )
        cells = [
            ((f"{count}.",), (row.symbol, " or ", row.chord), row.magnitude, row.direction, row.sense)
            for count, row in enumerate(section.rows, 1)
        ]
        yield from table_strips([PageColumn(head) for head in heads], cells)
    for count, phrase in enumerate(section.steps, 1):
        yield from paragraph(
            phrase, paper=scales, label=f"{count})", indent=INDENT, space_before=2.0 if count == 1 else 0.0
        )
    for phrase in section.simultaneous:
        yield from paragraph(phrase, space_before=1.0)
    for count, phrase in enumerate(section.images, len(section.steps) + 1):
        yield from paragraph(phrase, paper=scales, label=f"{count})", indent=INDENT)
    for count, phrase in enumerate(section.results):
        yield from paragraph(phrase, indent=INDENT, space_before=2.0 if not count else 0.0)


def _result_strips(solution: WorkedSolution) -> Iterator[Strip]:
    """What was found: links, points, slides, and rubbing speeds at the pins."""
    yield from _link_strips(solution)
    yield from _point_strips(solution)
    yield from _slide_strips(solution)
    if solution.rubbing:
        yield from paragraph(
            ("Rubbing speeds at the pins",), TextStyle(10.0, heavy=True), space_before=4.0, keep_with_next=True
        )
    for phrase in solution.rubbing:
        yield from paragraph(phrase, indent=4.0)


def _link_strips(solution: WorkedSolution) -> Iterator[Strip]:
    if solution.links:
        (w, velocity), (e, acceleration) = (
            display_unit(kind, solution.state.mechanism.units) for kind in ("angular velocity", "angular acceleration")
        )
        heads = [
            PageColumn("Link"),
            PageColumn(f"ω ({w})", True),
            PageColumn(""),
            PageColumn(f"α ({e})", True),
            PageColumn(""),
        ]
        cells: list[Sequence[Phrase]] = [
            (
                (Name(link.link),),
                (format_number(velocity.from_si(abs(link.velocity))),),
                (link.velocity_sense,),
                (format_number(acceleration.from_si(abs(link.acceleration))),),
                (link.acceleration_sense,),
            )
            for link in solution.links
        ]
        yield from table_strips(heads, cells, title="Links")


def _point_strips(solution: WorkedSolution) -> Iterator[Strip]:
    (v, velocity), (a, acceleration) = (
        display_unit(kind, solution.state.mechanism.units) for kind in ("velocity", "acceleration")
    )
    heads = [
        PageColumn("Point"),
        PageColumn(f"v ({v})", True),
        PageColumn(""),
        PageColumn(f"a ({a})", True),
        PageColumn(""),
    ]
    cells: list[Sequence[Phrase]] = [
        (
            (Name(point.point),),
            (format_number(velocity.from_si(point.velocity)),),
            (point.velocity_sense,),
            (format_number(acceleration.from_si(point.acceleration)),),
            (point.acceleration_sense,),
        )
        for point in solution.points
    ]
    yield from table_strips(heads, cells, title="Points", space_before=4.0)


def _slide_strips(solution: WorkedSolution) -> Iterator[Strip]:
    if solution.slides:
        (v, velocity), (a, acceleration) = (
            display_unit(kind, solution.state.mechanism.units) for kind in ("velocity", "acceleration")
        )
        length = solution.state.mechanism.units.length
        names = ("Pair", f"s ({length})", f"v ({v})", f"a ({a})")
        cells: list[Sequence[Phrase]] = [
            (
                (slide.pair,),
                (f"{parse_unit(length).from_si(slide.displacement):.6g}".replace("-", "−"),),
                (format_number(velocity.from_si(slide.velocity)),),
                (format_number(acceleration.from_si(slide.acceleration)),),
            )
            for slide in solution.slides
        ]
        heads = [PageColumn(name, index > 0) for index, name in enumerate(names)]
        yield from table_strips(heads, cells, title="Slides, along their lines", space_before=4.0)


def _comparison_strips(solution: WorkedSolution) -> Iterator[Strip]:
    if not solution.comparisons:
        return
    cells: list[Sequence[Phrase]] = []
    reasons: list[Phrase] = []
    for each in solution.comparisons:
        item = each.published
        measure, of = display_unit(PUBLISHED_QUANTITIES[item.quantity], solution.state.mechanism.units)
        off = (
            ""
            if each.relative_difference is None
            else f"{round(100.0 * each.relative_difference, 1) + 0.0:+.1f} %".replace("-", "−")
        )
        printed = "—" if item.value is None else f"{of.from_si(item.value):.6g}".replace("-", "−")
        solved = (format_number(of.from_si(each.solved)),)
        cells.append(((each.about,), solved, (printed,), (measure,), (off,), (each.verdict,)))
        why = item.slip or item.note
        if why:
            reasons.append((f"{each.about}: {why}",))
    heads = [PageColumn("Quantity"), PageColumn("Solved", True), PageColumn("Printed", True), PageColumn("")]
    yield from table_strips(
        [*heads, PageColumn("Off", True), PageColumn("")], cells, title="Published values", space_before=4.0
    )
    for count, reason in enumerate(reasons):
        yield from paragraph(reason, SMALL_STYLE, label="–", indent=4.0, space_before=1.5 if not count else 0.0)
