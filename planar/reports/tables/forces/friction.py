"""Friction in pairs as tables and JSON values: how pairs rub, what that takes, what it holds at rest."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from planar.analysis.efforts.self_locking import LockedInterval, jamming, self_locking
from planar.dynamics.force_course import LEAST_SCALE_RATIO, force_course, has_unknown_intervals
from planar.dynamics.forces import Forces, PairFriction
from planar.dynamics.friction.holding import Holding, holding
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.model.file_units import display_unit
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.wording import join_all_names
from planar.reports.columns import ReportedSeries
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import column_heading, format_quantity, quantity_text
from planar.reports.tables.forces.run_extremes import RunExtremes
from planar.results.motion import Motion


def friction_table(forces: Forces) -> FittedTable:
    """How every pair rubs at a position, with what friction does in the positive sense of its motion."""
    most = max((abs(float(each.heat)) for each in forces.friction.values()), default=0.0)
    units = forces.mechanism.units
    headings = ("pair", "rubs", ("friction", "unit"), column_heading("heat", "power", units), "contact")
    table = plain_table("Friction", *headings, left=(0, 1, 3, 5))
    for name, each in forces.friction.items():
        rubs = {1.0: "forward", -1.0: "back"}.get(float(each.sense), "not")
        table.add_row(
            name,
            rubs,
            *_effort_cells(forces.mechanism, name, float(each.effort)),
            format_quantity(float(each.heat), "power", units, most),
            str(each.side),
        )
    return table


def friction_over_motion_table(forces: Forces) -> FittedTable:
    """The greatest friction in every pair, and its mean heat over the motion."""
    units = forces.mechanism.units
    headings = ("pair", ("greatest", "unit"), column_heading("mean heat", "power", units), "contacts")
    rows = _friction_columns(forces)
    extremes = RunExtremes(forces, _friction_columns, LEAST_SCALE_RATIO * np.nan_to_num(np.abs(rows)).max(axis=0))
    table = plain_table(f"Friction{extremes.title}", *headings, left=(0, 2, 4))
    for k, (name, friction) in enumerate(forces.friction.items()):
        sides = "; ".join(sorted({side for side in friction.side if side}))
        greatest, heat = extremes.greatest_size(2 * k).value, extremes.mean(2 * k + 1)
        cells = _effort_cells(forces.mechanism, name, 0.0 if np.isnan(greatest) else greatest)
        table.add_row(name, *cells, format_quantity(heat, "power", units), sides)
    return table


def _friction_columns(forces: Forces) -> Array:
    """Of every pair with friction its effort and its heat (n, 2 pairs)."""
    columns = [np.asarray(part) for each in forces.friction.values() for part in (each.effort, each.heat)]
    return np.stack(columns, axis=-1)


def _effort_kind(mechanism: Mechanism, name: str) -> str:
    """Which kind of quantity acts along a pair's motion."""
    return "force" if relative_motions(mechanism)[name].input_quantity_kinds()[0] == "length" else "torque"


def _effort_cells(mechanism: Mechanism, name: str, effort: float) -> tuple[str, str]:
    """An effort at a pair, and its unit."""
    kind, units = _effort_kind(mechanism, name), mechanism.units
    return format_quantity(effort, kind, units), display_unit(kind, units)[0]


def efficiency_facts(forces: Forces) -> Iterator[tuple[str, str]]:
    """What friction takes of the power, and what the inputs would supply without it."""
    if not forces.friction or forces.frictionless is None:
        return
    if isinstance(forces.moving, Motion):
        mean = mean_efficiency(forces)
        if mean is not None:
            yield "efficiency", f"{mean:.4g} over the motion: {1.0 - mean:.4g} of what goes in turns into heat"
        return
    heat, efficiency = float(forces.heat_flow), float(forces.efficiency)
    if np.isfinite(efficiency):
        yield "efficiency", f"{efficiency:.4g}: {quantity_text(heat, 'power', forces.mechanism.units)} turn into heat"
    parts = [
        f"{' '.join(_effort_cells(forces.mechanism, name, float(effort)))} at {name}"
        for name, effort in forces.frictionless.inputs.items()
    ]
    yield "without friction", f"the inputs would supply {join_all_names(parts)}"


def mean_efficiency(forces: Forces) -> float | None:
    """The part of all work that goes in over a motion that comes out again, by integrals over its smooth pieces.

    None where friction is unknown at a position, or the motion between its positions.
    """
    course = force_course(forces)
    powers = _powers(forces)
    if course is None or any(has_unknown_intervals(column) for column in powers.T):
        return None
    series = course.series(_powers, LEAST_SCALE_RATIO * float(np.nanmax(np.abs(powers))))
    if series is None:
        return None
    lost, *supplied = (series.integral(k) if k == 0 else series.positive_integral(k) for k in range(len(series.scale)))
    return 1.0 - lost / sum(supplied) if sum(supplied) > 0.0 else None


def _powers(forces: Forces) -> Array:
    """The heat flow, and the power of all that acts (n, 1 + acting)."""
    heat = np.asarray(forces.heat_flow, dtype=float)
    parts = [heat, *(np.asarray(each.power, dtype=float) for each in forces.acting)]
    return np.stack(np.broadcast_arrays(*parts), axis=-1)


def held_at_rest(forces: Forces) -> Holding | None:
    """What friction holds at rest; None where there is none, or that is not told."""
    if not any(pair.has_friction for pair in forces.mechanism.pairs) or len(forces.mechanism.inputs) != 1:
        return None
    try:
        return holding(forces.moving)
    except NoAnswer:
        return None


def holding_facts(forces: Forces) -> Iterator[tuple[str, str]]:
    """What friction holds at rest at a position, or where over a motion the mechanism locks itself."""
    held = held_at_rest(forces)
    if held is None:
        return
    if isinstance(forces.moving, Motion):
        yield "self-locking", _locking_text(forces.moving, held)
        jams = jammed_intervals(forces)
        if jams:
            yield "jams", f"at {held.input} from {_intervals_text(forces.moving, jams)}, in the sense of this motion"
        return
    low, high = float(held.low), float(held.high)
    if held.undetermined:
        yield "at rest", held.undetermined
    elif np.isnan([low, high]).any():
        return
    else:
        (start, unit), (stop, _) = (_effort_cells(forces.mechanism, held.input, each) for each in (low, high))
        ends = ("-∞" if low == -np.inf else start, "∞" if high == np.inf else stop)
        locks = "; it locks itself under these loads" if held.is_self_locking else "; without it the loads move it"
        yield "at rest", f"friction holds it with {ends[0]} to {ends[1]} {unit} at {held.input}{locks}"
        wide = np.asarray(held.widest)
        if wide[0] < low or wide[1] > high:
            pair = " to ".join(_effort_cells(forces.mechanism, held.input, float(each))[0] for each in wide)
            yield "", f"braced against each other pairs may hold {pair} {unit}"
        if not held.is_proved:
            yield "", "that there are no other solutions at these ends is not proved"


def held_loads_table(held: Sequence[Holding]) -> FittedTable:
    """How much of each load friction holds at rest with an effort of the input."""
    first = held[0]
    effort = " ".join(_effort_cells(first.moving.mechanism, first.input, first.effort))
    title = f"Loads that are held at rest, with {effort} at {first.input}"
    table = plain_table(title, "load", "from, times", "to, times", "held as it is", left=(0, 3))
    for each in held:
        ends = [
            "not determined" if np.isnan(end) else "∞" if end == np.inf else "-∞" if end == -np.inf else f"{end:.6g}"
            for end in (float(each.low), float(each.high))
        ]
        table.add_row(str(each.load), *ends, "yes" if each.is_self_locking else "no")
    return table


def held_record(held: Sequence[Holding]) -> dict[str, Any]:
    """The same as JSON values, by what the loads act on."""
    return {
        str(each.load): {
            "effort": each.effort,
            "low": _number(each.low),
            "high": _number(each.high),
            "proved": bool(each.is_proved),
            "held": bool(each.is_self_locking),
        }
        for each in held
    }


def locked_intervals(motion: Motion) -> tuple[LockedInterval, ...] | None:
    """Where a motion locks itself; None for a run in time or a circuit, whose input is more than once at a position."""
    try:
        return self_locking(motion)
    except BadInput:
        return None


def _locking_text(motion: Motion, held: Holding) -> str:
    if held.undetermined:
        return held.undetermined
    found = locked_intervals(motion)
    if found is None:
        count = int(np.sum(held.is_self_locking))
        return f"at {count} of these positions the loads alone do not move it"
    if not found:
        return "nowhere: the loads alone move it wherever they are not balanced"
    return f"the loads alone do not move it at {held.input} from {_intervals_text(motion, found)}"


def _intervals_text(motion: Motion, intervals: Sequence[LockedInterval]) -> str:
    """Intervals of the input that runs, in the file's units."""
    kind = "length" if motion.has_length_motion(motion.running_input) else "angle"
    unit, measure = display_unit(kind, motion.mechanism.units)
    told = [" to ".join(f"{measure.from_si(each):.6g}" for each in interval[:2]) for interval in intervals]
    return f"{join_all_names(told)} {unit}"


def jammed_intervals(forces: Forces) -> tuple[LockedInterval, ...]:
    """Where friction jams a motion, if it does so at any of its positions; nothing where that is not told."""
    motion = forces.moving
    if not isinstance(motion, Motion) or forces.frictionless is None:
        return ()
    sound = np.isfinite([np.asarray(each) for each in forces.frictionless.inputs.values()]).all(axis=0)
    if not np.any(sound & (np.asarray(forces.solution_count) == 0)):
        return ()
    try:
        return jamming(motion)
    except BadInput:
        return ()


def record(forces: Forces) -> dict[str, Any]:
    """Friction at a position as JSON values; nothing where no pair has any."""
    if not any(pair.has_friction for pair in forces.mechanism.pairs):
        return {}
    found: dict[str, Any] = {"friction": {name: _pair_record(each) for name, each in forces.friction.items()}}
    if forces.frictionless is not None:
        found["efficiency"] = _number(forces.efficiency)
        found["without_friction"] = {name: _number(each) for name, each in forces.frictionless.inputs.items()}
        found["solution_count"] = forces.solution_count
    held = held_at_rest(forces)
    if held is not None:
        found["holding"] = {
            "input": held.input,
            "low": _number(held.low),
            "high": _number(held.high),
            "widest": [_number(each) for each in np.asarray(held.widest)],
            "proved": bool(held.is_proved),
            "self_locking": bool(held.is_self_locking),
        }
    return found


def motion_record(forces: Forces) -> dict[str, Any]:
    """Friction over a motion as JSON values; nothing where no pair has any."""
    motion = forces.moving
    if not any(pair.has_friction for pair in forces.mechanism.pairs) or not isinstance(motion, Motion):
        return {}
    found: dict[str, Any] = {"efficiency": mean_efficiency(forces)}
    held = held_at_rest(forces)
    if held is not None and not held.undetermined:
        intervals = locked_intervals(motion)
        if intervals is not None:
            found["self_locking"] = [[each.start, each.stop] for each in intervals]
        found["jams"] = [[each.start, each.stop] for each in jammed_intervals(forces)]
    return found


def friction_series(forces: Forces) -> Iterator[ReportedSeries]:
    """Friction and its heat at every position, and the efforts without it."""
    for name, each in forces.friction.items():
        kind = _effort_kind(forces.mechanism, name)
        values = {kind: np.asarray(each.effort), "heat": np.asarray(each.heat)}
        yield ReportedSeries("friction", name, {kind: kind, "heat": "power"}, values)
    if forces.frictionless is not None and forces.friction:
        for name, effort in forces.frictionless.inputs.items():
            kind = _effort_kind(forces.mechanism, name)
            yield ReportedSeries("without friction", name, {kind: kind}, {kind: np.asarray(effort)})


def _pair_record(each: PairFriction) -> dict[str, Any]:
    return {
        "sense": float(each.sense),
        "effort": _number(each.effort),
        "heat": _number(each.heat),
        "contact": str(each.side),
    }


def _number(value: Any) -> float | None:
    return float(value) if np.isfinite(value) else None
