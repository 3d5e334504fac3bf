"""A polygon cut into the sections of a worked solution: each finds one point, with what only prepares it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import groupby
from typing import NamedTuple

from planar.analysis.polygons.construction_steps import ConstructionSteps, image_step
from planar.analysis.polygons.notation import NEGLIGIBLE_RATIO, Notation, VectorRow
from planar.analysis.polygons.polygon import (
    DrawingStage,
    LoopEquation,
    Meeting,
    MeetingSide,
    PointImage,
    Polygon,
    PolygonVector,
    SimultaneousSolution,
    TurningRate,
    VectorPart,
)
from planar.analysis.polygons.readings import LINE_OF_MOTION, Readings
from planar.analysis.rich_text import (
    MeasuredValue,
    Name,
    Phrase,
    PhrasePiece,
    Symbol,
    format_number,
    join_phrases,
    list_phrases,
    with_double_primes,
)
from planar.model.wording import count_phrase
from planar.model.wording import join_all_names as words_listed


class Section(NamedTuple):
    """One step of a worked solution, in the order in which it is written.

    `known` says what is known beforehand, `equation` is the vector equation in words, symbols, parts and letters,
    `rows` is the vector table, `steps` the construction, `group` and `simultaneous` stand where no pencil order solves
    it, `images` place the further points of links and `results` are what is read off.
    """

    title: str
    links: tuple[str, ...]
    known: tuple[Phrase, ...] = ()
    equation: tuple[Phrase, ...] = ()
    rows: tuple[VectorRow, ...] = ()
    steps: tuple[Phrase, ...] = ()
    simultaneous: tuple[Phrase, ...] = ()
    images: tuple[Phrase, ...] = ()
    results: tuple[Phrase, ...] = ()


@dataclass
class SectionStages:
    """The stages of one section: those that prepare, the one it is about, and what follows from it."""

    main: Meeting | SimultaneousSolution | None = None
    before: list[DrawingStage] = field(default_factory=list)
    after: list[DrawingStage] = field(default_factory=list)


class RelativeTerm(NamedTuple):
    """The motion of one point relative to another: its vectors, or none where it is already drawn."""

    of: str
    against: str
    vectors: tuple[PolygonVector, ...]
    tail: str
    head: str


def sections(polygon: Polygon) -> tuple[Section, ...]:
    """The sections of a polygon, in the order of drawing."""
    notation = Notation(polygon)
    return tuple(_section(notation, batch, index == 0) for index, batch in enumerate(stages_by_section(notation)))


def stages_by_section(notation: Notation) -> list[SectionStages]:
    """The stages of a polygon by sections."""
    found: list[SectionStages] = []
    waiting: list[DrawingStage] = []
    drawn = set(notation.poles)
    for stage in notation.polygon.stages:
        if isinstance(stage, SimultaneousSolution) or (isinstance(stage, Meeting) and len(stage.sides) > 1):
            taken = waiting if isinstance(stage, SimultaneousSolution) else _needed_stages(notation, waiting, stage)
            found.append(SectionStages(stage, taken))
            waiting = [each for each in waiting if not any(each is other for other in taken)]
            for each in (*taken, stage):
                drawn |= _letters_drawn(notation, each)
        elif found and isinstance(stage, TurningRate) and stage.vector[0]:
            found[-1].after.append(stage)
        elif found and isinstance(stage, PointImage) and _letters_needed(notation, stage) <= drawn:
            found[-1].after.append(stage)
            drawn |= _letters_drawn(notation, stage)
        else:
            waiting.append(stage)
    if waiting or not found:
        last = [each for each in waiting if isinstance(each, TurningRate)]
        if found and len(last) == len(waiting):
            found[-1].after += waiting
        else:
            found.append(SectionStages(None, waiting))
    return found


def _preparing_steps(notation: Notation, steps: ConstructionSteps, stage: DrawingStage) -> list[Phrase]:
    if isinstance(stage, Meeting):
        return steps.side(stage.sides[0])
    return [image_step(notation, stage)] if isinstance(stage, PointImage) else []


def _needed_stages(
    notation: Notation, waiting: Sequence[DrawingStage], main: Meeting, start: str = ""
) -> list[DrawingStage]:
    """The waiting stages without which a meeting, or its side from a start, could not be drawn, in their order."""
    asked = {start} if start else _letters_needed(notation, main)
    taken: list[DrawingStage] = []
    for stage in reversed(waiting):
        if _letters_drawn(notation, stage) & asked:
            taken.append(stage)
            asked |= _letters_needed(notation, stage)
    links = {link for each in (*taken, main) if isinstance(each, Meeting) for link in each.links}
    links |= {each.link for each in taken if isinstance(each, PointImage)}
    turns = [each for each in waiting if isinstance(each, TurningRate) and each.link in links]
    return [each for each in waiting if any(each is other for other in (*taken, *turns))]


def _letters_drawn(notation: Notation, stage: DrawingStage) -> set[str]:
    """The letters that a stage draws."""
    if isinstance(stage, Meeting):
        return {stage.letter} | {vector.head for side in stage.sides for vector in side.vectors}
    if isinstance(stage, PointImage):
        return {notation.letters.get(stage.point, "")}
    return set(stage.letters) if isinstance(stage, SimultaneousSolution) else set()


def _letters_needed(notation: Notation, stage: DrawingStage) -> set[str]:
    """The letters that a stage starts from."""
    if isinstance(stage, Meeting):
        return {side.start for side in stage.sides}
    if isinstance(stage, PointImage):
        return {notation.letters[point] for point in stage.base if point in notation.letters}
    return set()


def _section(notation: Notation, batch: SectionStages, first: bool) -> Section:
    readings, steps = Readings(notation), ConstructionSteps(notation)
    before = [stage for stage in batch.before if isinstance(stage, Meeting)]
    main = batch.main if isinstance(batch.main, Meeting) else None
    chains = _chains(notation, before, main)
    on_chain = {(vector.tail, vector.head) for chain in chains for term in chain for vector in term.vectors}
    apart = [
        stage
        for stage in before
        if not any((vector.tail, vector.head) in on_chain for vector in stage.sides[0].vectors)
    ]
    rows = [row for stage in apart for term in _terms(stage.sides[0]) for row in _rows(notation, term)]
    rows += [row for chain in chains for term in chain for row in _rows(notation, term)]
    written = [steps.pole()] if first else []
    if main is not None:
        later = _needed_stages(notation, batch.before, main, main.sides[1].start)
        soon = _needed_stages(notation, batch.before, main, main.sides[0].start)
        later = [stage for stage in later if not any(stage is other for other in soon)]
        early = [stage for stage in batch.before if not any(stage is other for other in later)]
        prepared = [
            [words for stage in each for words in _preparing_steps(notation, steps, stage)] for each in (early, later)
        ]
        written += steps.meeting(main, *prepared)
        written += steps.totals([term for chain in chains for term in chain])
    else:
        written += [words for stage in batch.before for words in _preparing_steps(notation, steps, stage)]
        written += steps.totals([term for stage in before for term in _terms(stage.sides[0])])
    simultaneous = batch.main if isinstance(batch.main, SimultaneousSolution) else None
    return Section(
        title=_title(batch),
        links=batch.main.links if batch.main is not None else tuple(dict.fromkeys(_links_of_stages(batch))),
        known=(
            *_introduce_points(notation, batch),
            *(readings.turning_reading(stage) for stage in batch.before if isinstance(stage, TurningRate)),
        ),
        equation=tuple(_equations(notation, apart, chains, main)),
        rows=tuple(dict.fromkeys(rows)),
        steps=tuple(written),
        simultaneous=tuple(_simultaneous_phrases(notation, simultaneous)) if simultaneous else (),
        images=tuple(image_step(notation, stage) for stage in batch.after if isinstance(stage, PointImage)),
        results=tuple(_results(readings, batch)),
    )


def _introduce_points(notation: Notation, batch: SectionStages) -> Iterator[Phrase]:
    """What the points are that only lie on others: those of a line on which something slides."""
    if notation.order == 2:  # they are known from the velocities
        return
    named, told = notation.polygon.state.point_names, set()
    stages = [stage for stage in (*batch.before, batch.main) if isinstance(stage, Meeting)]
    for vector in (vector for stage in stages for side in stage.sides for vector in side.vectors):
        both = vector.of, vector.against
        new = [point for point in both if point not in named and point not in told]
        if vector.part is VectorPart.SLIDING and len(new) == 1:
            (point,), other = new, both[both[0] in new]
            told.add(point)
            fixed = vector.line.startswith(LINE_OF_MOTION)
            whose = "the fixed point" if fixed else f"the point of {vector.line.removeprefix('line on ')}"
            yield (f"{with_double_primes(point)} is {whose} that {with_double_primes(other)} lies on",)


def _links_of_stages(batch: SectionStages) -> Iterator[str]:
    for stage in batch.before:
        if isinstance(stage, Meeting):
            yield from stage.links
        elif isinstance(stage, PointImage | TurningRate):
            yield stage.link


def _title(batch: SectionStages) -> str:
    if isinstance(batch.main, Meeting):
        return f"Point {with_double_primes(batch.main.point)}: {_links_phrase(batch.main.links)}"
    if isinstance(batch.main, SimultaneousSolution):
        together = " together" if len(batch.main.links) > 1 else ""
        return f"L{_links_phrase(batch.main.links)[1:]}{together}"
    links = tuple(dict.fromkeys(_links_of_stages(batch)))
    return f"L{_links_phrase(links)[1:]}" if links else "Everything"


def _links_phrase(links: Sequence[str]) -> str:
    return f"{'link' if len(links) == 1 else 'links'} {words_listed(links)}"


def _terms(side: MeetingSide) -> list[RelativeTerm]:
    """The relative motions along a side, the parts of each together."""
    found = []
    for (of, against), group in groupby(side.vectors, key=lambda vector: (vector.of, vector.against)):
        vectors = tuple(group)
        found.append(RelativeTerm(of, against, vectors, vectors[0].tail, vectors[-1].head))
    return found


def _chains(notation: Notation, before: Sequence[Meeting], main: Meeting | None) -> list[list[RelativeTerm]]:
    """The sides of a meeting, each from the pole on."""
    sources = {stage.letter: stage for stage in before}

    def from_pole(start: str) -> list[RelativeTerm]:
        if start in sources:
            side = sources[start].sides[0]
            return [*from_pole(side.start), *_terms(side)]
        if start in notation.poles:
            return []
        root = notation.pole_letter(start)
        points = notation.polygon.points
        return [RelativeTerm(points.get(start, start), points.get(root, root), (), root, start)]

    return [[*from_pole(side.start), *_terms(side)] for side in main.sides] if main is not None else []


def _rows(notation: Notation, term: RelativeTerm) -> list[VectorRow]:
    if not term.vectors:
        size = notation.letter_distance(term.tail, term.head)
        symbol, chord = notation.symbol(term.of, term.against), notation.chord(term.tail, term.head)
        return [VectorRow(symbol, chord, size, True, ("already drawn" if size else "0",), ("—",), ("—",))]
    return [notation.row(vector, len(term.vectors) == 1) for vector in term.vectors]


def _equations(
    notation: Notation, apart: Sequence[Meeting], chains: Sequence[Sequence[RelativeTerm]], main: Meeting | None
) -> Iterator[Phrase]:
    for stage in apart:
        for term in _terms(stage.sides[0]):
            yield from _part_equations(notation, term)
    if main is not None:
        yield from _equation(notation, chains)


def _equation(notation: Notation, chains: Sequence[Sequence[RelativeTerm]]) -> Iterator[Phrase]:
    """The vector equation in words, in symbols, in parts where there are any, and in the polygon's letters."""
    sides = chains if len(chains[0]) < len(chains[1]) else chains[::-1]
    short = "Vel." if notation.order == 1 else "Acc."

    def words(term: RelativeTerm) -> Phrase:
        return (f"{short} of ", Name(term.of), " rel. to ", Name(term.against))

    def symbols(term: RelativeTerm) -> Phrase:
        return (notation.symbol(term.of, term.against),)

    lines = [
        join_phrases((join_phrases(map(write, side), " + ") or ("0",) for side in sides), " = ")
        for write in (words, symbols, partial(_part_symbols, notation), partial(_chord_symbols, notation))
    ]
    yield from dict.fromkeys(lines)


def _part_equations(notation: Notation, term: RelativeTerm) -> Iterator[Phrase]:
    """The equation of a relative acceleration alone, where it has two parts."""
    if len(term.vectors) > 1:
        yield (notation.symbol(term.of, term.against), " = ", *_part_symbols(notation, term))
        yield (notation.chord(term.tail, term.head), " = ", *_chord_symbols(notation, term))


def _part_symbols(notation: Notation, term: RelativeTerm) -> Phrase:
    return join_phrases(((row.symbol,) for row in _rows(notation, term)), " + ")


def _chord_symbols(notation: Notation, term: RelativeTerm) -> Phrase:
    pairs = [(vector.tail, vector.head) for vector in term.vectors] or [(term.tail, term.head)]
    return join_phrases(((notation.chord(*pair),) for pair in pairs), " + ")


def _simultaneous_phrases(notation: Notation, stage: SimultaneousSolution) -> Iterator[Phrase]:
    """Why there is no pencil order, the equations with their numbers, and what solves them."""
    equations, unknowns = len(stage.equations), len(stage.unknowns)
    give = "gives" if equations == 1 else "give"
    # of two unknowns or fewer it is not said that no pencil could: it may, in another order than is tried
    why = (
        f"No two lines locate a point of {_links_phrase(stage.links)}: more than two unknown magnitudes hang "
        "together, so "
        f"there is no order in which a pencil could find them one after the other."
        if unknowns > 2
        else f"The rates of {_links_phrase(stage.links)} hang together."
    )
    yield (
        f"{why} {count_phrase(equations, 'simultaneous equation')} in {count_phrase(unknowns, 'unknown')} "
        f"{give} them at once.",
    )
    for equation in stage.equations:
        yield _equation_phrase(notation, stage, equation)
    angular = ("rad/s", "rad/s^2")[notation.order - 1]
    solved = [
        (
            *_rate_symbol(each.name),
            " = ",
            MeasuredValue(each.value, angular) if each.is_angular else notation.quantity(each.value),
        )
        for each in stage.unknowns
    ]
    yield ("From these ", *list_phrases(solved), ".")


def _rate_symbol(name: str) -> Phrase:
    letter, mark, below = name.partition("_")
    return (Symbol(letter, below),) if mark and letter in ("ω", "α") else (name,)


def _equation_phrase(notation: Notation, stage: SimultaneousSolution, equation: LoopEquation) -> Phrase:
    """An equation with its numbers; one of lengths is in the length in which rates are told."""
    turning = {each.name for each in stage.unknowns if each.is_angular}
    of_lengths = equation.axis in ("x", "y") or any(name not in turning for name, _ in equation.terms)
    by = notation.lengths_per_metre if of_lengths else 1.0
    greatest = max((abs(slope) for _, slope in equation.terms), default=1.0)
    where = "".join(equation.loop) if max(map(len, equation.loop), default=0) <= 2 else "–".join(equation.loop)
    if equation.axis in ("x", "y"):
        found: list[PhrasePiece] = [
            "Round " if len(equation.loop) > 1 else "At ",
            Name(where),
            f", along {equation.axis}: ",
        ]
    else:
        found = [f"By the pair {where}: "]
    start = len(found)
    for name, slope in equation.terms:
        if abs(slope) <= NEGLIGIBLE_RATIO * greatest:
            continue
        sign = ("−" if slope < 0.0 else "") if len(found) == start else (" − " if slope < 0.0 else " + ")
        told = abs(slope) * (by if name in turning else 1.0)
        factor = "" if abs(told - 1.0) < NEGLIGIBLE_RATIO else f"{format_number(told)} "
        found += [sign + factor, *_rate_symbol(name)]
    known = equation.known if abs(equation.known) > NEGLIGIBLE_RATIO * greatest else 0.0
    return (*found, " = ", format_number(known * by))


def _results(readings: Readings, batch: SectionStages) -> Iterator[Phrase]:
    for stage in batch.before:
        if isinstance(stage, Meeting):
            yield from readings.meeting_readings(stage)
    if isinstance(batch.main, Meeting):
        yield from readings.meeting_readings(batch.main)
        yield from readings.slide_readings(batch.main)
    elif batch.main is not None:
        yield from readings.simultaneous_readings(batch.main)
    for stage in batch.before:
        if isinstance(stage, PointImage):
            yield from readings.point_readings(stage.point)
    for stage in batch.after:
        if isinstance(stage, TurningRate):
            yield readings.turning_reading(stage)
        elif isinstance(stage, PointImage):
            yield from readings.point_readings(stage.point)
