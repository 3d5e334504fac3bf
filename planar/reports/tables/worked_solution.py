"""A worked solution as text for a terminal, and as a JSON value."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.polygons.notation import Row
from planar.analysis.rich_text import Paper, Phrase, number, plain
from planar.analysis.worked.sections import Section
from planar.analysis.worked.solution import LinkResult, PointResult, SlideResult, Solution, Worked
from planar.dynamics.load_attachment import choices
from planar.foundation.units import Unit, shown, unit
from planar.reports.tables_of_numbers import heading, paragraphs, plain_table, published

Scales = Mapping[str, Paper]


def explained(solution: Solution, scales: Scales | None = None) -> RenderableType:
    """A worked solution; lengths on paper stand beside what is drawn where its kind has a scale."""
    scales = scales or {}
    mechanism = solution.state.mechanism
    parts: list[RenderableType] = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        parts.append(Text(mechanism.source, style="italic"))
    parts += [Text(), Text("Given", style="bold"), _paragraphs(solution.given, scales)]
    parts += [Text(), Text("To find", style="bold"), _paragraphs(solution.asked, scales)]
    for number_, half in enumerate(solution.halves, 1):
        parts += [Text(), _heading(number_, half, scales)]
        for section in half.sections:
            parts += [Text(), *_section(section, half, scales)]
    parts += [Text(), *_results(solution)]
    if solution.comparisons:
        parts.append(published(solution.comparisons, mechanism.units))
    notes = [*choices(mechanism), *solution.state.remarks, *mechanism.notes]
    if notes:
        parts += [Text("Notes", style="bold"), paragraphs(("-", note) for note in notes)]
    return Group(*parts)


def _heading(count: int, half: Worked, scales: Scales) -> Text:
    scale = scales.get(half.kind)
    return Text(f"{count}. {half.kind.capitalize()} polygon" + (f", {scale}" if scale else ""), style="bold underline")


def _paragraphs(phrases: Iterable[Phrase], scales: Scales) -> RenderableType:
    return paragraphs(("-", plain(phrase, scales)) for phrase in phrases)


def _section(section: Section, half: Worked, scales: Scales) -> Iterator[RenderableType]:
    yield Text(section.title, style="bold")
    if section.known:
        yield _paragraphs(section.known, scales)
    if section.equation:
        yield paragraphs((" ", plain(line)) for line in section.equation)
    if section.rows:
        yield _table(section.rows, shown(half.kind, half.polygon.state.mechanism.units)[0])
    steps = [(f"{count})", plain(step, scales)) for count, step in enumerate((*section.steps, *section.images), 1)]
    if section.simultaneous:
        yield paragraphs(steps[: len(section.steps)])
        yield paragraphs((" ", plain(line)) for line in section.simultaneous)
        yield paragraphs(steps[len(section.steps) :])
    else:
        yield paragraphs(steps)
    if section.results:
        yield Text("Read off:")
        yield _paragraphs(section.results, {})


def _table(rows: Iterable[Row], measure: str) -> RenderableType:
    table = plain_table(
        None, "S.N.", "vector", f"magnitude, {measure}", "direction", "sense", left=(1, 2, 3, 4), keys=2
    )
    for count, row in enumerate(rows, 1):
        vector = f"{plain((row.symbol,))} or {plain((row.chord,))}"
        table.add_row(f"{count}.", vector, plain(row.magnitude), plain(row.direction), plain(row.sense))
    return table


def _results(solution: Solution) -> Iterator[RenderableType]:
    units = solution.state.mechanism.units
    rates = [shown(kind, units)[1] for kind in ("velocity", "acceleration")]
    links = plain_table(
        "Links", "link", ("ang. velocity, rad/s", "sense"), ("ang. acceleration, rad/s²", "sense"), left=(0, 2, 4)
    )
    for link in solution.links:
        links.add_row(*_turn(link))
    points = plain_table(
        "Points",
        "point",
        (heading("velocity", "velocity", units), "sense"),
        (heading("acceleration", "acceleration", units), "sense"),
        left=(0, 2, 4),
    )
    for point in solution.points:
        points.add_row(*_move(point, rates))
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
            heading("velocity", "velocity", units),
            heading("acceleration", "acceleration", units),
        )
        for slide in solution.slides:
            slides.add_row(*_slide(slide, length, rates))
        yield slides
    if solution.rubbing:
        yield Text("Rubbing speeds at the pins", style="bold")
        yield _paragraphs(solution.rubbing, {})


def _turn(link: LinkResult) -> tuple[str, ...]:
    name, velocity, sense, acceleration, second = link
    return name, number(abs(velocity)), sense, number(abs(acceleration)), second


def _move(point: PointResult, rates: Sequence[Unit]) -> tuple[str, ...]:
    name, velocity, sense, acceleration, second = point
    return name, number(rates[0].from_si(velocity)), sense, number(rates[1].from_si(acceleration)), second


def _slide(slide: SlideResult, length: str, rates: Sequence[Unit]) -> tuple[str, ...]:
    name, displacement, velocity, acceleration = slide
    return (
        name,
        f"{unit(length).from_si(displacement):.6g}",
        *(number(of.from_si(rate)) for of, rate in zip(rates, (velocity, acceleration), strict=True)),
    )


def record(solution: Solution, scales: Scales | None = None) -> dict[str, Any]:
    """A worked solution as a JSON value, numbers in SI."""
    scales = scales or {}
    found: dict[str, Any] = {
        "mechanism": solution.state.mechanism.name,
        "given": _lines(solution.given),
        "asked": _lines(solution.asked),
    }
    for half in solution.halves:
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
    return [plain(phrase, scales) for phrase in phrases]


def _part(section: Section, scales: Scales) -> dict[str, Any]:
    return {
        "title": section.title,
        "links": list(section.links),
        "known": _lines(section.known, scales),
        "equation": _lines(section.equation),
        "vectors": [
            {
                "symbol": row.symbol._asdict(),
                "vector": plain((row.symbol,)),
                "letters": plain((row.chord,)),
                "value": row.value,
                "known": row.known,
                "magnitude": plain(row.magnitude),
                "direction": plain(row.direction),
                "sense": plain(row.sense),
            }
            for row in section.rows
        ],
        "steps": _lines(section.steps, scales),
        "simultaneous": _lines(section.simultaneous),
        "images": _lines(section.images, scales),
        "results": _lines(section.results),
    }
