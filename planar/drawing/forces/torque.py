"""What an input supplies over a cycle: its curve, mean and areas beside that, its parts, and the flywheel."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from planar.drawing.diagrams import axes
from planar.drawing.forces.drawn_forces import ForceRun, forces_over_cycle
from planar.drawing.paper.picture import Circle, Fill, Label, Mark, Pen, Picture, Polyline
from planar.drawing.paper.scales import format_force
from planar.dynamics.flywheel import DEFAULT_FLUCTUATION, Flywheel, explain_no_cycle, flywheel
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.units import parse_unit
from planar.model.file_units import display_unit
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion

DIAGRAM_WIDTH, DIAGRAM_HEIGHT = 170.0, 85.0
"""mm between the axes."""
MARK_RADIUS = 0.5
"""mm: the radius of the mark at the greatest and the least."""
PART_NAMES = {"load": "loads", "weight": "weights", "spring": "springs", "inertia": "inertia"}
ROUND_OFF_RATIO = 1e-9
"""A part of the greatest below this is round-off."""


def torque_picture(  # long: one part of the diagram after the other
    source: Forces | Motion | Mechanism, of: str | None = None, fluctuation: float = DEFAULT_FLUCTUATION
) -> Picture:
    """The effort of an input (left out: of the one that runs) over a cycle.

    Strokes are `about` "effort", "mean", "above", "below", "greatest", "least", and "part loads" and the like where it
    has several. Raises BadInput for an input that is not there, or a fluctuation that is none.
    """
    drawn = forces_over_cycle(source)
    found = drawn.forces
    name = drawn.motion.running_input if of is None else of
    if name not in found.inputs:
        raise BadInput(name, f"there is no input of this name; inputs are at {', '.join(found.inputs)}")
    effort = drawn.in_order(found.inputs[name])
    if not np.isfinite(effort).any():
        told = found.undetermined.get(name, "no forces in the pairs balance the links at any position")
        raise BadInput(name, f"what it supplies is not told: {told}")
    effort = np.where(
        np.abs(effort) <= drawn.round_off * (1.0 if found.is_force_input(name) else drawn.arm), 0.0, effort
    )
    symbol, kind = ("F", "force") if found.is_force_input(name) else ("T", "torque")
    units = found.mechanism.units
    why = explain_no_cycle(found, name)
    even = None if why else flywheel(found, name, fluctuation)
    mean = even.mean if even is not None else None
    seen = axes.without_outliers(effort)
    parts = {label: np.where(np.isfinite(seen), part, np.nan) for label, part in _effort_parts(drawn, name).items()}
    parts |= _motor_curve(drawn, name)
    across = axes.fit_axis(
        drawn.abscissa, DIAGRAM_WIDTH, drawn.axis_name, end_at_ticks=False, degrees=drawn.unit == "deg"
    )
    up = axes.force_axis(np.concatenate([seen, *parts.values()]), DIAGRAM_HEIGHT, symbol, kind, units)
    strokes: list[Mark] = [] if mean is None else [*_mean_areas(drawn.abscissa, effort, mean, across, up)]
    strokes += axes.axes_frame(across, up)
    for label, part in parts.items():
        strokes += axes.curve_strokes(drawn.abscissa, part, across, up, Pen.SHARE, f"part {label}")
        flat = np.ptp(part[np.isfinite(part)]) <= ROUND_OFF_RATIO * np.nanmax(np.abs(part))
        row = len(part) // 4 if flat else int(np.nanargmax(np.abs(part)))
        strokes.append(
            Label(label, axes.point_on_paper(drawn.abscissa[row], part[row], across, up), f"part {label}", 7.5, 0.8)
        )
    if mean is not None:
        level = float(up.on_paper(mean))
        strokes.append(Polyline(((0.0, level), (DIAGRAM_WIDTH, level)), Pen.MEAN, "mean"))
        text = f"${symbol}_m$ = {format_force(mean, kind, units)}"
        strokes.append(Label(text, (DIAGRAM_WIDTH, level), "mean", 8.0, 1.2, math=True, side=(1, 0)))
    strokes += axes.curve_strokes(drawn.abscissa, seen, across, up, Pen.CURVE, "effort")
    notes = [*drawn.notes]
    greatest, least = _effort_extremes(drawn, name, effort)
    if greatest[1] - least[1] <= ROUND_OFF_RATIO * max(abs(greatest[1]), abs(least[1])):
        notes.append("the same at every position")
    else:
        for label, (place, value) in (("greatest", greatest), ("least", least)):
            text = f"{format_force(value, kind, units)} {drawn.abscissa_text(place)}"
            row = int(np.argmin(np.abs(drawn.abscissa - place)))
            if np.isfinite(seen[row]):
                at = axes.point_on_paper(place, value, across, up)
                strokes.append(Circle(at, MARK_RADIUS, Pen.CURVE, label, Fill.PAPER))
                strokes.append(Label(text, at, label, 8.0, 1.0))
            else:
                notes.append(f"beyond the axis: {text}")
    notes += _notes(even, why, kind, drawn)
    return Picture(tuple(strokes), f"{found.mechanism.name}: {kind} of the input {name}", tuple(notes))


def _effort_extremes(drawn: ForceRun, name: str, effort: Array) -> tuple[tuple[float, float], ...]:
    """The greatest and the least effort, each with its place on the axis: solved for, else of the positions."""
    solved = drawn.solved_extremes(lambda forces: np.asarray(forces.inputs[name]), max(drawn.least_scales))
    if solved is not None:
        return solved
    rows = int(np.nanargmax(effort)), int(np.nanargmin(effort))
    return tuple((float(drawn.abscissa[row]), float(effort[row])) for row in rows)


def _notes(even: Flywheel | None, why: str, kind: str, drawn: ForceRun) -> Iterator[str]:
    if even is None:
        yield f"no mean and no flywheel: {why}"
        return
    units = drawn.motion.mechanism.units

    def told(value: float, kind: str) -> str:
        name, of = display_unit(kind, units)
        return f"{of.from_si(value):.4g} {name}"

    yield f"mean {format_force(even.mean, kind, units)}; fluctuation of energy ΔE = {told(even.energy, 'energy')}"
    if not even.energy:
        return
    slow, fast = (np.mod(parse_unit(drawn.unit).from_si(each), drawn.period) for each in (even.slowest, even.fastest))
    yield f"fastest at {fast:.4g} {drawn.unit}, slowest at {slow:.4g} {drawn.unit}, driven by the mean torque"
    if even.inertia is None or even.speed is None:
        yield "no flywheel: the input has no steady speed"
    else:
        yield (
            f"flywheel for a coefficient of fluctuation {even.fluctuation:g} at "
            f"{told(even.speed, 'angular velocity')}: "
            f"I = ΔE / (C ω²) = {told(even.inertia, 'moment of inertia')}"
        )


def _motor_curve(drawn: ForceRun, name: str) -> dict[str, Array]:
    """What the motor of the input supplies at its speed, if it has one."""
    motor = next(given.motor for given in drawn.motion.mechanism.inputs if given.pair == name)
    return {} if motor is None else {"motor": drawn.in_order(motor.effort_at(drawn.motion.inputs[name].velocity))}


def _effort_parts(drawn: ForceRun, name: str) -> dict[str, Array]:
    """What the input supplies against loads, weights, springs, friction and inertia, where it alone moves.

    By power: at every position that of a part and that of its share are opposite.
    """
    motion = drawn.motion
    rates = {other: given.velocity for other, given in motion.inputs.items()}
    if any(np.any(rate) for other, rate in rates.items() if other != name) or not np.all(rates[name]):
        return {}
    found: dict[str, Array] = {}
    for each in drawn.forces.acting:
        if each.kind in PART_NAMES:
            share = drawn.in_order(-each.power / rates[name])
            found[PART_NAMES[each.kind]] = found.get(PART_NAMES[each.kind], 0.0) + share
    if drawn.forces.friction:
        found["friction"] = drawn.in_order(np.asarray(drawn.forces.heat_flow) / rates[name])
    most = max((float(np.nanmax(np.abs(part))) for part in found.values()), default=0.0)
    seen = {label: part for label, part in found.items() if np.nanmax(np.abs(part)) > ROUND_OFF_RATIO * most}
    return seen if len(seen) > 1 else {}


def _mean_areas(x: Array, y: Array, mean: float, across: axes.Axis, up: axes.Axis) -> Iterator[Polyline]:
    """What of a curve is above its mean, and what is below, between the places where it crosses it."""
    off = y - mean
    over = off >= 0.0
    cut = np.flatnonzero(over[:-1] != over[1:])
    crossing = x[cut] + (x[cut + 1] - x[cut]) * off[cut] / (off[cut] - off[cut + 1])
    for k, piece in enumerate(np.split(np.arange(len(x)), cut + 1)):
        first = crossing[k - 1] if k else x[0]
        last = crossing[k] if k < len(crossing) else x[-1]
        side = "above" if over[piece[0]] else "below"
        spots = [(first, mean), *zip(x[piece], y[piece], strict=True), (last, mean)]
        fill = Fill.ABOVE if side == "above" else Fill.BELOW
        yield Polyline(tuple(axes.point_on_paper(*each, across, up) for each in spots), Pen.HATCH, side, True, fill)
