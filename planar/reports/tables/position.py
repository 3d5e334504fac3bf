"""Tables of one position: links, points, pairs, and published values beside those computed."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.worked.published import Comparison
from planar.model.file_units import FileUnits, display_unit
from planar.model.mechanism import PUBLISHED_QUANTITIES, relative_motions
from planar.model.pairs import Pair
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import (
    SIZE_PHRASE,
    _polar_cells,
    _report_cell,
    column_heading,
    format_number,
    paragraphs,
    precision_text,
)
from planar.results.motion import Motion, State
from planar.results.records import PointState, RelativeState


def solution_tables(
    state: State, comparisons: Iterable[Comparison], relatives: Mapping[str, RelativeState] | None = None
) -> RenderableType:
    """A solved position: links, points, pairs, relative motions, and the published values beside the solved ones."""
    points = state.points
    scales = _kind_scales(state, points)
    parts: list[RenderableType] = [
        _state_heading(state),
        Text(),
        _links_table(state, scales),
        _points_table(state, points, scales),
        _pair_tables(state, scales),
    ]
    if state.misfits:
        parts.append(misfit_table(state))
    parts += [_relative_table(text, motion, state, scales) for text, motion in (relatives or {}).items()]
    comparisons = tuple(comparisons)
    if comparisons:
        parts.append(published_table(comparisons, state.mechanism.units))
    notes = [*state.remarks, *state.mechanism.notes]
    if notes:
        parts += [Text(), Text("Notes", style="bold"), paragraphs(("-", note) for note in notes)]
    return Group(*parts)


def published_table(comparisons: Iterable[Comparison], units: FileUnits) -> RenderableType:
    """Solved values beside those that a book prints."""
    headings = ("", "quantity", ("solved", "printed", "unit"), ("off", ""))
    table = plain_table("Published values", *headings, left=(0, 1, 4, 6))
    reasons: list[tuple[str, str]] = []
    for each in comparisons:
        item = each.published
        measure, of = display_unit(PUBLISHED_QUANTITIES[item.quantity], units)
        off = "" if each.relative_difference is None else f"{round(100.0 * each.relative_difference, 1) + 0.0:+.1f} %"
        style = {"differs": "bold red", "sense differs": "bold red", "slip in the book": "yellow"}.get(each.verdict, "")
        printed = "-" if item.value is None else f"{of.from_si(item.value):.6g}"
        solved = format_number(of.from_si(each.solved))
        table.add_row(item.symbol, each.about, solved, printed, measure, off, Text(each.verdict, style))
        why = item.slip or item.note
        if why:
            reasons.append((item.symbol, why))
    return Group(table, paragraphs(reasons))


def _state_heading(state: State) -> RenderableType:
    mechanism = state.mechanism
    lines = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        lines.append(Text(mechanism.source, style="italic"))
    named = relative_motions(mechanism)
    inputs = [
        f"{name} = {amount(given.position, named[name].input_kind.value, mechanism.units)}"
        for name, given in state.inputs.items()
    ]
    at = f"at {join_all_names(inputs)}" if inputs else "without inputs"
    met = "the misfit is the least" if state.misfits else "every pair closes"
    lines.append(Text(f"{at}; mobility {state.mobility}; {met} {precision_text(state.residual, SIZE_PHRASE)}"))
    return Group(*lines)


def _kind_scales(state: State, named_points: Mapping[str, PointState]) -> dict[str, float]:
    """By kinds of quantity the greatest size (SI) of a position: what is round-off of it is printed as 0."""
    points, links = state.scales_of_points, state.scales_of_links
    size = max((float(np.hypot(*point.position)) for point in named_points.values()), default=1.0) or 1.0
    rates = {"velocity": points[0], "acceleration": points[1]}
    turning = {"angular velocity": links[0], "angular acceleration": links[1]}
    return {"length": size, "angle": 1.0, **rates, **turning}


def _links_table(state: State, scales: Mapping[str, float]) -> FittedTable:
    units = state.mechanism.units
    table = plain_table(
        "Links",
        "link",
        column_heading("angle", "angle", units),
        column_heading("ang. velocity", "angular velocity", units),
        (column_heading("ang. acceleration", "angular acceleration", units), "sense"),
    )
    for name, link in state.links.items():
        if name != state.mechanism.frame:
            table.add_row(
                name,
                _report_cell(link.angle, "angle", units, scales["angle"]),
                _report_cell(link.angular_velocity, "angular velocity", units, scales["angular velocity"]),
                _report_cell(link.angular_acceleration, "angular acceleration", units, scales["angular acceleration"]),
                link.sense,
            )
    return table


def _points_table(state: State, points: Mapping[str, PointState], scales: Mapping[str, float]) -> FittedTable:
    units = state.mechanism.units
    at = column_heading("at", "angle", units)
    table = plain_table(
        "Points",
        "point",
        tuple(column_heading(axis, "length", units) for axis in "xy"),
        (column_heading("velocity", "velocity", units), at),
        (column_heading("acceleration", "acceleration", units), at),
        "sense",
    )
    length, velocity, acceleration = (display_unit(kind, units)[1] for kind in ("length", "velocity", "acceleration"))
    for name, point in points.items():
        placed = (
            format_number(length.from_si(float(each) if abs(each) > 1e-13 * scales["length"] else 0.0))
            for each in point.position
        )
        table.add_row(
            name,
            *placed,
            *_polar_cells(point.velocity, velocity, units, scales["velocity"]),
            *_polar_cells(point.acceleration, acceleration, units, scales["acceleration"]),
            point.sense,
        )
    return table


def _pair_tables(state: State, scales: Mapping[str, float]) -> RenderableType:
    kinds: dict[type[Pair], list[Pair]] = {}
    for pair in relative_motions(state.mechanism).values():
        kinds.setdefault(type(pair), []).append(pair)
    tables, units = [], state.mechanism.units
    for kind, pairs in kinds.items():
        titles = [
            column_heading(name.replace("_", " ").replace("angular", "ang."), of, units)
            for name, of in kind.result_kinds.items()
        ]
        table = plain_table(f"{kind.keyword.capitalize()} pairs", "pair", "links", *titles, left=(0, 1), keys=2)
        for pair in pairs:
            report = state.pair(pair.name)
            values = [
                _report_cell(report[name], of, units, scales.get(of, 0.0)) for name, of in kind.result_kinds.items()
            ]
            table.add_row(pair.name, " - ".join(pair.links), *values)
        tables.append(table)
    return Group(*tables)


def misfit_table(moving: State | Motion) -> FittedTable:
    """By how much the pairs stay open, over a motion at most, where the mechanism closes within a misfit."""
    units, within = moving.mechanism.units, moving.mechanism.closes_within or 0.0
    title = f"Least misfit, within {amount(within, 'length', units)}"
    table = plain_table(title, "pair", "links", column_heading("misfit", "length", units), left=(0, 1))
    for pair in moving.mechanism.pairs:
        most = float(np.max(moving.misfits[pair.name]))
        table.add_row(pair.name, " - ".join(pair.links), _report_cell(most, "length", units, 0.0))
    return table


def _relative_table(text: str, relative: RelativeState, state: State, scales: Mapping[str, float]) -> RenderableType:
    """How one point moves against another, part by part."""
    point, other = text.split(",")[:2]
    units = state.mechanism.units
    title = f"{point.strip()} against {other.strip()}, in the axes of {relative.axes}"
    at = column_heading("at", "angle", units)
    table = plain_table(title, "part", ("magnitude", "unit", at), ("x", "y"), left=(0, 2))
    parts = {
        "velocity": ("velocity", relative.velocity),
        "  by rotation": ("velocity", relative.rotation),
        "  by sliding": ("velocity", relative.sliding),
        "acceleration": ("acceleration", relative.acceleration),
        "  centripetal": ("acceleration", relative.centripetal),
        "  tangential": ("acceleration", relative.tangential),
        "  Coriolis": ("acceleration", relative.coriolis),
        "  by sliding ": ("acceleration", relative.sliding_acceleration),
    }
    for name, (kind, part) in parts.items():
        measure, of = display_unit(kind, units)
        size, direction = _polar_cells(part, of, units, scales[kind])
        cells = (_report_cell(float(component), kind, units, scales[kind]) for component in part)
        table.add_row(name, size, measure, direction, *cells)
    return table
