"""What pairs carry over a cycle: polar load diagrams, and along a line the force across it and the couple."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from math import floor
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams import axes
from planar.drawing.forces.action_arrows import ActionSymbol, link_pair_index
from planar.drawing.forces.drawn_forces import ForceRun, forces_over_cycle
from planar.drawing.paper.picture import Arrow, Circle, Fill, Label, Mark, PaperPoint, Pen, Picture, Polyline
from planar.drawing.paper.scales import (
    DECIMAL_STEPS,
    DEGREE_STEPS,
    Scale,
    format_force,
    round_scale,
    round_step,
    tick_spacing,
    unit_for_size,
)
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.forces import Forces
from planar.dynamics.reactions import Reaction
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.link_graph import link_numbers
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair
from planar.model.pairs.symbols import GuideMark
from planar.model.wording import join_all_names
from planar.results.motion import Motion

POLAR_SIZE, DIAGRAM_WIDTH, DIAGRAM_HEIGHT = (58.0, 58.0), 75.0, 42.0
"""mm: room of a polar diagram; between the axes of the others."""
MAX_MARKS = 12
"""Places of the input that are marked on a polar diagram, at most."""
MARK_SPACING = 5.0
"""mm of its path between two marks."""
POLAR_MARGIN = 4.0
"""mm about the tips of a polar diagram."""
MARK_RADIUS = 0.45
"""mm: the radius of a mark."""
CONSTANT_TOLERANCE = 1e-9
"""A force that varies by less than this part of itself is the same everywhere."""
NOTHING = "no force or couple is carried here"
MAX_NAMED_GAPS = 4
"""Places at which something is not told, of which all are named."""


class _BearingLoad(NamedTuple):
    """What a diagram is of: a pair, its force's or couple's letter, on which link by which, and why it is not told."""

    pair: str
    symbol: ActionSymbol
    acting_on: str
    about: str
    gap_reason: str

    @property
    def heading(self) -> str:
        """The diagram's title."""
        return f"{self.pair}: {self.symbol.plain_text}, {self.acting_on}"


class _Undrawn(NamedTuple):
    """A pair of which there is no diagram, and why."""

    pair: str
    why: str


def bearing_pictures(source: Forces | Motion | Mechanism, pairs: Sequence[str] | None = None) -> list[Picture]:
    """The loads of pairs (left out: of all in which links touch) over a cycle.

    Of a pair along a line the force across it and the couple over the input; of any other the tip of the force over
    the motion, in the frame's axes, as polar diagrams, with marks where the input is. Strokes are `about` "load",
    "couple", "greatest" and "mark 30". Raises BadInput for a pair that is not there.
    """
    drawn = forces_over_cycle(source)
    found = drawn.forces
    of = {pair.name: pair for pair in found.mechanism.pairs}
    for name in pairs or ():
        if name not in of:
            raise BadInput("pair", f"there is no pair {name!r}; pairs are {', '.join(of)}")
    chosen = pairs or [name for name, pair in of.items() if pair.coincident_points()[1:] or pair.point_on_line()]
    diagrams = [each for name in chosen for each in _pair_pictures(drawn, of[name], found.reactions[name])]
    return [each for each in diagrams if isinstance(each, Picture)] + _undrawn(diagrams)


def _undrawn(diagrams: Sequence[Picture | _Undrawn]) -> list[Picture]:
    """The pairs of which there is no diagram, those without one for the same reason in one line."""
    pairs: dict[str, dict[str, None]] = {}
    for each in diagrams:
        if isinstance(each, _Undrawn):
            pairs.setdefault(each.why, {})[each.pair] = None
    return [Picture((), f"No diagram: {join_all_names(list(names))}", (why,)) for why, names in pairs.items()]


def _pair_pictures(drawn: ForceRun, pair: Pair, reaction: Reaction) -> Iterator[Picture | _Undrawn]:
    mechanism, number = drawn.forces.mechanism, link_numbers(drawn.forces.mechanism)
    first, second = pair.links
    sense = 1.0
    if second == mechanism.frame:
        first, second, sense = second, first, -1.0
    force, couple = sense * drawn.in_order(reaction.force), sense * drawn.in_order(reaction.couple)
    index, told = link_pair_index(number[second], number[first]), f"on {second} by {first}"
    least = drawn.round_off
    couple = np.where(np.abs(couple) <= least * drawn.arm, 0.0, couple)

    def couple_of(found: Forces) -> Array:
        return sense * np.asarray(found.reactions[pair.name].couple)

    of_couple = _BearingLoad(pair.name, ActionSymbol("M", index), told, "couple", reaction.why)
    if reaction.at is None:
        yield _curve_picture(drawn, couple, of_couple, couple_of)
    elif pair.is_lower_pair and pair.input_kind is MeasureKind.LENGTH:
        across = drawn.in_order(sense * _lateral_force(drawn.forces, pair))
        across = np.where(np.abs(across) <= least, 0.0, across)
        of_force = _BearingLoad(
            pair.name, ActionSymbol("F", index), f"{told}, to the left of its line", "load", reaction.why
        )
        yield _curve_picture(drawn, across, of_force, lambda found: sense * _lateral_force(found, pair))
        if np.nanmax(np.abs(couple), initial=0.0) > 0.0:
            yield _curve_picture(drawn, couple, of_couple, couple_of)
    else:
        force = np.where(np.hypot(*force.T)[:, None] <= least[:, None], 0.0, force)
        yield _polar_picture(
            drawn, force, _BearingLoad(pair.name, ActionSymbol("F", index), told, "load", reaction.why)
        )


def _polar_picture(drawn: ForceRun, force: Array, load: _BearingLoad) -> Picture | _Undrawn:
    """The tip of a force (n, 2), to a round scale."""
    long = np.hypot(*force.T)
    if not np.nanmax(long, initial=0.0):
        return _empty_picture(load, long)
    seen = np.where(np.isfinite(axes.without_outliers(long))[:, None], force, np.nan)
    corners = np.concatenate([seen[np.isfinite(seen).all(axis=1)], np.zeros((1, 2))])
    low, high = corners.min(axis=0), corners.max(axis=0)
    units = drawn.motion.mechanism.units
    name, per = unit_for_size("force", float(np.abs(corners).max()), units)
    width, height = map(float, high - low)
    scale = round_scale("force", name, width, height, POLAR_SIZE)
    across, up = (_axis_at_scale(low[k], high[k], scale, f"{'xy'[k]} ({name})", per) for k in (0, 1))
    strokes: list[Mark] = [*axes.axes_frame(across, up)]
    middle = float(across.on_paper(0.0))
    strokes.append(Polyline(((middle, 0.0), (middle, up.length)), Pen.AXIS, "zero"))
    strokes += axes.curve_strokes(seen[:, 0], seen[:, 1], across, up, Pen.CURVE, "load")
    strokes += _input_marks(drawn, seen, across, up)
    notes = [str(scale), *_load_notes(drawn, long, load)]
    row = int(np.nanargmax(long))
    place, size = drawn.abscissa[row], long[row]
    least_scale = max(drawn.least_scales) ** 2
    solved = drawn.solved_extremes(lambda found: np.sum(found.reactions[load.pair].force ** 2, axis=-1), least_scale)
    if solved is not None:
        place, size = solved[0][0], np.sqrt(solved[0][1])
    text = format_force(size, "force", units)
    if np.nanmin(long) < (1.0 - CONSTANT_TOLERANCE) * long[row]:
        text = f"{text} {drawn.abscissa_text(place)}"
    if np.isfinite(seen[row]).all():
        tip = axes.point_on_paper(seen[row, 0], seen[row, 1], across, up)
        strokes.append(Arrow(axes.point_on_paper(0.0, 0.0, across, up), tip, Pen.REACTION, "greatest"))
        strokes.append(Label(text, tip, "greatest", 8.0, 1.0))
    else:
        notes.append(f"beyond the axes: {text}")
    return Picture(tuple(strokes), load.heading, tuple(notes))


def _empty_picture(load: _BearingLoad, values: Array) -> _Undrawn:
    """Why there is no diagram."""
    return _Undrawn(load.pair, NOTHING if np.isfinite(values).any() else load.gap_reason or "not told at any position")


def _axis_at_scale(low: float, high: float, scale: Scale, name: str, per: float) -> axes.Axis:
    """An axis of a force at a scale, a little longer than what is drawn, with ticks by the centimetre or half inch."""
    low, high = low - POLAR_MARGIN * scale.per_mm, high + POLAR_MARGIN * scale.per_mm
    return axes.Axis(low, high, scale.on_paper(high - low), tick_spacing(scale.unit) * scale.per_mm, name, per)


def _input_marks(drawn: ForceRun, force: Array, across: axes.Axis, up: axes.Axis) -> Iterator[Mark]:
    """Spots where the input is at round places, with these."""
    path = np.stack([across.on_paper(force[:, 0]), up.on_paper(force[:, 1])], axis=1)
    room = int(np.nansum(np.hypot(*np.diff(path, axis=0).T)) / MARK_SPACING)
    if not room:
        return
    span = float(drawn.abscissa[-1] - drawn.abscissa[0])
    step = round_step(
        span / min(room, MAX_MARKS) * (1.0 - 1e-9), DEGREE_STEPS if drawn.unit == "deg" else DECIMAL_STEPS
    )
    last = floor(drawn.abscissa[-1] / step + 1e-9)
    places = step * np.arange(-floor(-drawn.abscissa[0] / step + 1e-9), last + 1)
    for place in places[:-1] if drawn.period else places:
        x, y = (float(np.interp(place, drawn.abscissa, part)) for part in force.T)
        if np.isfinite([x, y]).all():
            name = f"mark {axes.format_number(place)}"
            at = axes.point_on_paper(x, y, across, up)
            yield Circle(at, MARK_RADIUS, Pen.CURVE, name, Fill.PAPER)
            yield Label(axes.format_number(place), at, name, 6.5, 0.7)


def _curve_picture(
    drawn: ForceRun, values: Array, load: _BearingLoad, measure: Callable[[Forces], Array]
) -> Picture | _Undrawn:
    """A force to the left of a line, or a couple, over the input; `measure` takes it (n,) of forces."""
    if not np.nanmax(np.abs(values), initial=0.0):
        return _empty_picture(load, values)
    seen, kind = axes.without_outliers(values), "torque" if load.about == "couple" else "force"
    units = drawn.motion.mechanism.units
    across = axes.fit_axis(
        drawn.abscissa, DIAGRAM_WIDTH, drawn.axis_name, end_at_ticks=False, degrees=drawn.unit == "deg"
    )
    up = axes.force_axis(seen, DIAGRAM_HEIGHT, load.symbol.base, kind, units)
    strokes: list[Mark] = [
        *axes.axes_frame(across, up),
        *axes.curve_strokes(drawn.abscissa, seen, across, up, Pen.CURVE, load.about),
    ]
    notes = [*_load_notes(drawn, values, load)]
    row = int(np.nanargmax(np.abs(values)))
    place, value = drawn.abscissa[row], values[row]
    solved = drawn.solved_extremes(measure, max(drawn.least_scales))
    if solved is not None:
        place, value = max(solved, key=lambda extreme: abs(extreme[1]))
    text = f"{format_force(value, kind, units)} {drawn.abscissa_text(place)}"
    if np.isfinite(seen[row]):
        at: PaperPoint = axes.point_on_paper(place, value, across, up)
        strokes.append(Circle(at, MARK_RADIUS, Pen.CURVE, "greatest", Fill.PAPER))
        strokes.append(Label(text, at, "greatest", 8.0, 1.0))
    else:
        notes.append(f"beyond the axis: {text}")
    return Picture(tuple(strokes), load.heading, tuple(notes))


def _load_notes(drawn: ForceRun, values: Array, load: _BearingLoad) -> Iterator[str]:
    """What is to be said of all diagrams, and of gaps in this one."""
    yield from drawn.notes
    gaps = np.flatnonzero(~np.isfinite(values))
    if len(gaps) > MAX_NAMED_GAPS:
        yield f"told at {len(values) - len(gaps)} of {len(values)} positions only: {load.gap_reason}"
    elif len(gaps):
        yield f"not told {join_all_names([drawn.place_text(row) for row in gaps.tolist()])}"


def _lateral_force(forces: Forces, pair: Pair) -> Array:
    """The force (n,) on the second link of a pair, to the left of the line of the pair."""
    motion, force = forces.moving, np.asarray(forces.reactions[pair.name].force)
    marks = pair.drawing_marks(motion.shapes, motion.mechanism.pairs)
    guide = next(mark for mark in marks if isinstance(mark, GuideMark))
    way = KinematicArrays(motion).frame(guide.link).rotate_to_world(guide.direction)
    left = np.stack(np.broadcast_arrays(-way.y, way.x, np.zeros(len(force)))[:2], axis=-1)
    lateral: Array = (force * left).sum(axis=1)
    return lateral
