"""Results as tables for a terminal."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from textwrap import wrap

import numpy as np
from rich.box import SIMPLE_HEAD
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planar.analysis.published import Comparison
from planar.mechanism import QUANTITIES, motions
from planar.motion import RelativeState, State
from planar.pairs import Pair
from planar.units import SI, Unit, unit
from planar.words import amount, listed

HEADING = 13
"""Characters: longer headings stand in several lines, so that the tables of a textbook mechanism fit 80 columns."""
DIGITS = 6
"""Significant digits printed; `--json` has all of them."""
ROUNDING = 1e-12
"""What is less than this part of what it is told beside is printed as 0."""
_UNITS = {"rad/s^2": "rad/s²", "m/s^2": "m/s²", "N m": "N·m"}


def solution(
    state: State, comparisons: Iterable[Comparison], relatives: Mapping[str, RelativeState] | None = None
) -> RenderableType:
    """A solved position: links, points, pairs, relative motions, and the published values beside the solved ones."""
    parts: list[RenderableType] = [_heading(state), Text(), _links(state), _points(state), _pairs(state)]
    parts += [_relative(text, each, state) for text, each in (relatives or {}).items()]
    comparisons = tuple(comparisons)
    if comparisons:
        parts.append(published(comparisons))
    notes = [*state.remarks, *state.mechanism.notes]
    if notes:
        parts += [Text(), Text("Notes", style="bold"), paragraphs(("-", note) for note in notes)]
    return Group(*parts)


def published(comparisons: Iterable[Comparison]) -> RenderableType:
    """Solved values beside those that a book prints."""
    headings = ("", "quantity", "solved", "printed", "unit", "off", "")
    table = plain_table("Published values", *headings, left=(0, 1, 4, 6))
    reasons: list[tuple[str, str]] = []
    for each in comparisons:
        item = each.published
        kind = QUANTITIES[item.quantity]
        off = "" if each.apart is None else f"{round(100.0 * each.apart, 1) + 0.0:+.1f} %"
        style = {"differs": "bold red", "sense differs": "bold red", "slip in the book": "yellow"}.get(each.verdict, "")
        printed = "-" if item.value is None else f"{item.value:.6g}"
        table.add_row(
            item.symbol,
            each.about,
            number(each.solved),
            printed,
            _UNITS.get(SI[kind], SI[kind]),
            off,
            Text(each.verdict, style),
        )
        why = item.slip or item.note
        if why:
            reasons.append((item.symbol, why))
    return Group(table, paragraphs(reasons))


def paragraphs(rows: Iterable[tuple[str, str]]) -> Table:
    """Paragraphs with what they are about before them."""
    grid = Table.grid(padding=(0, 1))
    for about, text in rows:
        grid.add_row("", Text(about), Text(text))
    return grid


def models(rows: Iterable[tuple[str, str, str]]) -> RenderableType:
    """The models that come along: name, other ids, what each is."""
    table = plain_table(None, "model", "also", "what it is", left=(0, 1, 2))
    for row in rows:
        table.add_row(*row)
    return table


def _heading(state: State) -> RenderableType:
    mechanism = state.mechanism
    lines = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        lines.append(Text(mechanism.source, style="italic"))
    named = motions(mechanism)
    inputs = [
        f"{name} = {amount(given.position, named[name].drive_kind.value, mechanism.units)}"
        for name, given in state.inputs.items()
    ]
    at = f"at {listed(inputs)}" if inputs else "without inputs"
    lines.append(Text(f"{at}; mobility {state.mobility}; residual {state.residual:.1e} of the mechanism's size"))
    return Group(*lines)


def _links(state: State) -> RenderableType:
    units = state.mechanism.units
    table = plain_table(
        "Links", "link", f"angle, {units.angle}", "ang. velocity, rad/s", "ang. acceleration, rad/s²", "sense"
    )
    angle = unit(units.angle)
    for name, link in state.links.items():
        if name != state.mechanism.frame:
            table.add_row(
                name,
                number(angle.from_si(link.angle)),
                number(link.angular_velocity),
                number(link.angular_acceleration),
                link.sense,
            )
    return table


def _points(state: State) -> RenderableType:
    units = state.mechanism.units
    degree = units.angle
    table = plain_table(
        "Points",
        "point",
        f"x, {units.length}",
        f"y, {units.length}",
        "velocity, m/s",
        f"at, {degree}",
        "acceleration, m/s²",
        f"at, {degree}",
        "sense",
    )
    length, angle = unit(units.length), unit(units.angle)
    points = state.points
    scale = max((float(np.hypot(*point.position)) for point in points.values()), default=1.0) or 1.0

    def placed(value: float) -> str:
        return number(length.from_si(value if abs(value) > 1e-13 * scale else 0.0))

    def at(vector: np.ndarray) -> str:
        return number(angle.from_si(float(np.arctan2(vector[1], vector[0])))) if np.hypot(*vector) else ""

    for name, point in points.items():
        table.add_row(
            name,
            placed(point.position[0]),
            placed(point.position[1]),
            number(float(np.hypot(*point.velocity))),
            at(point.velocity),
            number(float(np.hypot(*point.acceleration))),
            at(point.acceleration),
            point.sense,
        )
    return table


def _pairs(state: State) -> RenderableType:
    kinds: dict[type[Pair], list[Pair]] = {}
    for pair in motions(state.mechanism).values():
        kinds.setdefault(type(pair), []).append(pair)
    tables = []
    for kind, pairs in kinds.items():
        titles = [
            f"{name.replace('_', ' ').replace('angular', 'ang.')}, {_shown(of, state)[0]}"
            for name, of in kind.reports.items()
        ]
        table = plain_table(f"{kind.keyword.capitalize()} pairs", "pair", "links", *titles, left=(0, 1))
        for pair in pairs:
            report = state.pair(pair.name)
            values = [_reported(report[name], of, state) for name, of in kind.reports.items()]
            table.add_row(pair.name, " - ".join(pair.links), *values)
        tables.append(table)
    return Group(*tables)


def _relative(text: str, relative: RelativeState, state: State) -> RenderableType:
    """How one point moves against another, part by part."""
    point, other = text.split(",")[:2]
    degree = state.mechanism.units.angle
    title = f"{point.strip()} against {other.strip()}, in the axes of {relative.axes}"
    table = plain_table(title, "part", "magnitude", "unit", f"at, {degree}", "x", "y", left=(0, 2))
    parts = {
        "velocity": ("m/s", relative.velocity),
        "  by rotation": ("m/s", relative.rotation),
        "  by sliding": ("m/s", relative.sliding),
        "acceleration": ("m/s²", relative.acceleration),
        "  centripetal": ("m/s²", relative.centripetal),
        "  tangential": ("m/s²", relative.tangential),
        "  Coriolis": ("m/s²", relative.coriolis),
        "  by sliding ": ("m/s²", relative.sliding_acceleration),
    }
    angle = unit(degree)
    for name, (measure, part) in parts.items():
        size = float(np.hypot(*part))
        at = number(angle.from_si(float(np.arctan2(part[1], part[0])))) if size > 1e-14 else ""
        table.add_row(name, number(size), measure, at, *(number(float(each)) for each in part))
    return table


def _shown(kind: str, state: State) -> tuple[str, Unit]:
    """The unit in which a kind of quantity is printed: positions in the file's own, rates in SI."""
    units = state.mechanism.units
    name = {"angle": units.angle, "length": units.length}.get(kind, SI[kind])
    return _UNITS.get(name, name), unit(name)


def _reported(value: float | None, kind: str, state: State) -> str:
    return "-" if value is None else number(_shown(kind, state)[1].from_si(value))


def number(value: float) -> str:
    return "0" if abs(value) < 1e-14 else f"{value:#.{DIGITS}g}".rstrip(".")


def counted(value: float | None, beside: float = 0.0) -> str:
    """A number, nothing where it is only what rounding leaves of another beside it; a dash where there is none."""
    if value is None or not np.isfinite(value):
        return "-"
    return f"{value:#.{DIGITS}g}".rstrip(".") if abs(value) > ROUNDING * abs(beside) else "0"


def plain_table(title: str | None, *headings: str, left: tuple[int, ...] = (0,)) -> Table:
    """An empty table; of a heading "name, unit" the unit stands below the name. Numbers are never broken."""
    table = Table(
        title=title,
        title_justify="left",
        title_style="bold",
        box=SIMPLE_HEAD,
        padding=(0, 1, 0, 0),
        pad_edge=False,
    )
    for index, text in enumerate(headings):
        words = index in left or text == "sense"
        name, _, unit_name = text.partition(", ")
        heading = "\n".join(filter(None, (*wrap(name, HEADING), unit_name)))
        table.add_column(heading, justify="left" if words else "right", overflow="fold", no_wrap=not words, min_width=5)
    return table
