"""A motion as tables: its range, its limits, and where every point went and how fast."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.foundation.units import parse_unit
from planar.model.file_units import display_unit
from planar.model.wording import amount, count_phrase, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import (
    ROUNDING_RATIO,
    SIZE_PHRASE,
    column_heading,
    format_number,
    format_or_zero,
    paragraphs,
    precision_text,
)
from planar.reports.tables.position import misfit_table
from planar.results.motion import Motion

MAX_LISTED_ENDS = 6
"""Ends of stretches of a circuit that are named one by one."""
TURN_TOLERANCE = 1e-9
"""Turns: what rounding leaves of one."""


def motion_tables(motion: Motion) -> RenderableType:
    """A run: its range, its limits, and for every point where it went and how fast it was, at most, among the rows."""
    tables: list[RenderableType] = [Text(), _limits_table(motion)] if motion.limits else []
    notes = [paragraphs(("-", remark) for remark in motion.remarks)] if motion.remarks else []
    if motion.misfits:
        tables += [Text(), misfit_table(motion)]
    return Group(*motion_heading(motion), *tables, Text(), _points_table(motion), *notes)


def motion_heading(motion: Motion) -> list[Text]:
    """What runs, from where to where, and how well it is solved."""
    lines = [Text(motion.mechanism.name, style="bold")]
    lines += [Text(_range_text(motion, name)) for name in motion.inputs]
    if motion.time is not None:
        lines.append(Text(f"in time, from 0 s to {motion.time[-1]:.6g} s"))
    met = "the misfit is the least" if motion.misfits else "every pair closes"
    worst = f"{met} {precision_text(motion.residual, SIZE_PHRASE)}"
    lines.append(
        Text(f"{count_phrase(len(motion), 'position')}; {worst}" + (f"; {motion.reason}" if motion.reason else ""))
    )
    return lines


def _range_text(motion: Motion, name: str) -> str:
    """Where an input went: A from 0 deg to 90 deg and to 0 deg."""
    units, kind = motion.mechanism.units, "length" if motion.has_length_motion(name) else "angle"
    position = motion.inputs[name].position
    change = np.diff(position)
    way = np.sign(np.where(np.abs(change) > ROUNDING_RATIO * np.abs(position).max(), change, 0.0))
    moved = np.flatnonzero(way)
    turns = [int(after) for before, after in pairwise(moved) if way[before] != way[after]]
    ends = [amount(float(position[k]), kind, units) for k in (0, *turns, len(position) - 1)]
    if len(set(ends)) == 1 and not turns:
        return f"{name} = {ends[0]}" + (", held" if len(motion) > 1 else "")
    gone = abs(float(position[-1] - position[0])) / (2.0 * np.pi)
    if not turns and kind == "angle" and round(gone) >= 1 and abs(gone - round(gone)) < TURN_TOLERANCE:
        turned = "a full turn" if round(gone) == 1 else count_phrase(round(gone), "full turn")
        return f"{name} from {ends[0]} to {ends[1]}, {turned}"
    places = ends[1:] if len(ends) <= MAX_LISTED_ENDS else [*ends[1:MAX_LISTED_ENDS], f"and so on to {ends[-1]}"]
    return f"{name} from {ends[0]} to {', to '.join(places)}"


def _limits_table(motion: Motion) -> FittedTable:
    """Dead points, change points and ends of strokes, solved for."""
    units = motion.mechanism.units
    driver = running_pair(motion)
    at = position_heading(motion)
    table = plain_table("Limits, solved for", "limit", "of", at, "where")
    for limit in motion.limits:
        of = [name for name in (limit.of,) if name]
        kind = "length" if limit.of and motion.has_length_motion(limit.of) else "angle"
        where = amount(limit.value, kind, units) if limit.kind in ("stroke end", "stop") else ""
        at_input = limit.input if driver is None else _to_file_unit(motion, driver, limit.input)
        name = f"{limit.kind}, {limit.end}" if limit.end else limit.kind
        table.add_row(name, join_all_names(of) if of else "", format_number(at_input), where)
    return table


def position_heading(motion: Motion) -> str:
    """The heading of a column that says where in a run something is: at the input that runs, or the time."""
    driver, units = running_pair(motion), motion.mechanism.units
    return (
        "time, s"
        if driver is None
        else f"at {driver}, {units.length if motion.has_length_motion(driver) else units.angle}"
    )


def place_cell(motion: Motion, place: float) -> str:
    """A time (s) of a run in time, else a position of the running input (rad or m), under that heading."""
    driver = running_pair(motion)
    return format_number(place if driver is None else _to_file_unit(motion, driver, place))


def _to_file_unit(motion: Motion, pair: str, value: float) -> float:
    units = motion.mechanism.units
    return parse_unit(units.length if motion.has_length_motion(pair) else units.angle).from_si(value)


def running_pair(motion: Motion) -> str | None:
    """The input that runs, unless they run in time."""
    return motion.running_input if motion.time is None else None


def _points_table(motion: Motion) -> FittedTable:
    units = motion.mechanism.units
    heads = [tuple(f"{axis} {end}, {units.length}" for end in ("from", "to")) for axis in "xy"]
    kinds = ("velocity", "acceleration")
    most = [column_heading(f"{kind} up to", kind, units) for kind in kinds]
    table = plain_table("Points, among these positions", "point", *heads, *most)
    measures = [display_unit(kind, units)[1] for kind in kinds]
    length = parse_unit(units.length).from_si
    farthest = max((float(np.abs(each.position).max()) for each in motion.points.values()), default=0.0)
    for name, point in motion.points.items():
        ends = [float(end) for values in point.position.T for end in (values.min(), values.max())]
        fastest = [np.hypot(*rate.T) for rate in (point.velocity, point.acceleration)]
        rates = [
            "-" if np.isnan(rate).all() else format_number(of.from_si(float(np.nanmax(rate))))
            for rate, of in zip(fastest, measures, strict=True)
        ]
        places = (format_or_zero(length(end), length(farthest)) for end in ends)
        table.add_row(name, *places, *rates)
    return table
