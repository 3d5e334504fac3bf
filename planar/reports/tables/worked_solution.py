"""A worked solution as text for a terminal, and as a JSON value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.polygons.notation import VectorRow
from planar.analysis.rich_text import PaperScale, Phrase, format_number, plain_text
from planar.analysis.worked.sections import Section
from planar.analysis.worked.solution import LinkResult, PointResult, SlideResult, WorkedPolygon, WorkedSolution
from planar.dynamics.load_attachment import attachment_remarks
from planar.foundation.units import Unit, format_unit, parse_unit
from planar.model.file_units import display_unit, rate_unit
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import column_heading, paragraphs
from planar.reports.tables.position import published_table

Scales = Mapping[str, PaperScale]


def solution_text(solution: WorkedSolution, scales: Scales | None = None) -> RenderableType:
    """A worked solution; lengths on paper stand beside what is drawn where its kind has a scale."""
    scales = scales or {}
    mechanism = solution.state.mechanism
    parts: list[RenderableType] = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        parts.append(Text(mechanism.source, style="italic"))
    parts += [Text(), Text("Given", style="bold"), _phrase_paragraphs(solution.given, scales)]
    parts += [Text(), Text("To find", style="bold"), _phrase_paragraphs(solution.asked, scales)]
    for number_, half in enumerate(solution.worked_polygons, 1):
        parts += [Text(), _polygon_heading(number_, half, scales)]
        for section in half.sections:
            parts += [Text(), *_section_parts(section, half, scales)]
    parts += [Text(), *_result_tables(solution)]
    if solution.comparisons:
        parts.append(published_table(solution.comparisons, mechanism.units))
    notes = [*attachment_remarks(mechanism), *solution.state.remarks, *mechanism.notes]
    if notes:
        parts += [Text("Notes", style="bold"), paragraphs(("-", note) for note in notes)]
    return Group(*parts)


def _polygon_heading(count: int, half: WorkedPolygon, scales: Scales) -> Text:
    scale = scales.get(half.kind)
    return Text(f"{count}. {half.kind.capitalize()} polygon" + (f", {scale}" if scale else ""), style="bold underline")


def _phrase_paragraphs(phrases: Iterable[Phrase], scales: Scales) -> RenderableType:
    return paragraphs(("-", plain_text(phrase, scales)) for phrase in phrases)


def _section_parts(section: Section, half: WorkedPolygon, scales: Scales) -> Iterator[RenderableType]:
    yield Text(section.title, style="bold")
    if section.known:
        yield _phrase_paragraphs(section.known, scales)
    if section.equation:
        yield paragraphs((" ", plain_text(line)) for line in section.equation)
    if section.rows:
        yield _vector_table(section.rows, format_unit(rate_unit(half.kind, half.polygon.state.mechanism.units)[0]))
    steps = [(f"{count})", plain_text(step, scales)) for count, step in enumerate((*section.steps, *section.images), 1)]
    if section.simultaneous:
        yield paragraphs(steps[: len(section.steps)])
        yield paragraphs((" ", plain_text(line)) for line in section.simultaneous)
        yield paragraphs(steps[len(section.steps) :])
    else:
        yield paragraphs(steps)
    if section.results:
        yield Text("Read off:")
        yield _phrase_paragraphs(section.results, {})


def _vector_table(rows: Iterable[VectorRow], measure: str) -> RenderableType:
    table = plain_table(
        None, "S.N.", "vector", f"magnitude, {measure}", "direction", "sense", left=(1, 2, 3, 4), keys=2
    )
    for count, row in enumerate(rows, 1):
        vector = f"{plain_text((row.symbol,))} or {plain_text((row.chord,))}"
        table.add_row(f"{count}.", vector, plain_text(row.magnitude), plain_text(row.direction), plain_text(row.sense))
    return table


def _result_tables(solution: WorkedSolution) -> Iterator[RenderableType]:
    units = solution.state.mechanism.units
    rates = [display_unit(kind, units)[1] for kind in ("velocity", "acceleration")]
    links = plain_table(
        "Links",
        "link",
        (column_heading("ang. velocity", "angular velocity", units), "sense"),
        (column_heading("ang. acceleration", "angular acceleration", units), "sense"),
        left=(0, 2, 4),
    )
    turns = [display_unit(kind, units)[1] for kind in ("angular velocity", "angular acceleration")]
    for link in solution.links:
        links.add_row(*_link_cells(link, turns))
    points = plain_table(
        "Points",
        "point",
        (column_heading("velocity", "velocity", units), "sense"),
        (column_heading("acceleration", "acceleration", units), "sense"),
        left=(0, 2, 4),
    )
    for point in solution.points:
        points.add_row(*_point_cells(point, rates))
    yield Text("3. Results", style="bold underline")
    yield Text()
    yield links
    yield points
    if solution.slides:
        length = units.length
        slides = plain_table(
            "Slides, along their lines",
            "pair",
            f"displacement, {length}",
            column_heading("velocity", "velocity", units),
            column_heading("acceleration", "acceleration", units),
        )
        for slide in solution.slides:
            slides.add_row(*_slide_cells(slide, length, rates))
        yield slides
    if solution.rubbing:
        yield Text("Rubbing speeds at the pins", style="bold")
        yield _phrase_paragraphs(solution.rubbing, {})


def _link_cells(link: LinkResult, turns: Sequence[Unit]) -> tuple[str, ...]:
    name, velocity, sense, acceleration, second = link
    first, after = (of.from_si(abs(each)) for of, each in zip(turns, (velocity, acceleration), strict=True))
    return name, format_number(first), sense, format_number(after), second


def _point_cells(point: PointResult, rates: Sequence[Unit]) -> tuple[str, ...]:
    name, velocity, sense, acceleration, second = point
    return name, format_number(rates[0].from_si(velocity)), sense, format_number(rates[1].from_si(acceleration)), second


def _slide_cells(slide: SlideResult, length: str, rates: Sequence[Unit]) -> tuple[str, ...]:
    name, displacement, velocity, acceleration = slide
    return (
        name,
        f"{parse_unit(length).from_si(displacement):.6g}",
        *(format_number(of.from_si(rate)) for of, rate in zip(rates, (velocity, acceleration), strict=True)),
    )


def record(solution: WorkedSolution, scales: Scales | None = None) -> dict[str, Any]:
    """A worked solution as a JSON value, numbers in SI."""
    scales = scales or {}
    found: dict[str, Any] = {
        "mechanism": solution.state.mechanism.name,
        "given": _lines(solution.given),
        "asked": _lines(solution.asked),
    }
    for half in solution.worked_polygons:
        found[half.kind] = {
            "pole": list(half.polygon.pole),
            "letters": {letter: value.tolist() for letter, value in half.polygon.letters.items()},
            "sections": [_part(section, scales) for section in half.sections],
        }
    found["links"] = {each.link: _values(each) for each in solution.links}
    found["points"] = {each.point: _values(each) for each in solution.points}
    found["slides"] = {each.pair: _values(each) for each in solution.slides}
    found["rubbing"] = _lines(solution.rubbing)
    if solution.comparisons:
        found["published"] = [each.record() for each in solution.comparisons]
    return found


def _values(result: LinkResult | PointResult | SlideResult) -> dict[str, Any]:
    return dict(list(result._asdict().items())[1:])


def _lines(phrases: Iterable[Phrase], scales: Scales | None = None) -> list[str]:
    return [plain_text(phrase, scales) for phrase in phrases]


def _part(section: Section, scales: Scales) -> dict[str, Any]:
    return {
        "title": section.title,
        "links": list(section.links),
        "known": _lines(section.known, scales),
        "equation": _lines(section.equation),
        "vectors": [
            {
                "symbol": row.symbol._asdict(),
                "vector": plain_text((row.symbol,)),
                "letters": plain_text((row.chord,)),
                "value": row.value,
                "known": row.known,
                "magnitude": plain_text(row.magnitude),
                "direction": plain_text(row.direction),
                "sense": plain_text(row.sense),
            }
            for row in section.rows
        ],
        "steps": _lines(section.steps, scales),
        "simultaneous": _lines(section.simultaneous),
        "images": _lines(section.images, scales),
        "results": _lines(section.results),
    }
