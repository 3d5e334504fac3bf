"""What pairs carry over a cycle: polar load diagrams, and along a line the force across it and the couple."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import floor
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams import axes
from planar.drawing.forces.action_arrows import Sign, both
from planar.drawing.forces.drawn_forces import Loaded, loaded
from planar.drawing.paper.picture import Arrow, Circle, Fill, Letter, Line, Mark, Pen, Picture, Spot
from planar.drawing.paper.scales import DEGREES, PLAIN, Scale, fitting, prefixed, round_step, said
from planar.dynamics.external_actions import Field
from planar.dynamics.forces import Forces
from planar.dynamics.reactions import Reaction
from planar.foundation.errors import BadInput
from planar.model.link_graph import numbered
from planar.model.mechanism import Mechanism
from planar.model.pairs import Kind, Pair
from planar.model.pairs.symbols import Guide
from planar.model.wording import listed
from planar.results.motion import Motion

Array = np.ndarray

POLAR, WIDTH, HEIGHT = (58.0, 58.0), 75.0, 42.0
"""mm: room of a polar diagram; between the axes of the others."""
MARKS = 12
"""Places of the input that are marked on a polar diagram, at most."""
BETWEEN = 5.0
"""mm of its path between two marks."""
ROUND = 4.0
"""mm about the tips of a polar diagram."""
SPOT = 0.45
"""mm: the radius of a mark."""
SAME = 1e-9
"""A force that varies by less than this part of itself is the same everywhere."""
NOTHING = "no force or couple is carried here"
MANY = 4
"""Places at which something is not told, of which all are named."""


class _Load(NamedTuple):
    """What a diagram is of: a pair, its force's or couple's letter, on which link by which, and why it is not told."""

    pair: str
    sign: Sign
    told: str
    about: str
    why: str

    @property
    def heading(self) -> str:
        """The diagram's title."""
        return f"{self.pair}: {self.sign.plain}, {self.told}"


class _Undrawn(NamedTuple):
    """A pair of which there is no diagram, and why."""

    pair: str
    why: str


def bearing_pictures(what: Forces | Motion | Mechanism, pairs: Sequence[str] | None = None) -> list[Picture]:
    """The loads of pairs (left out: of all in which links touch) over a cycle.

    Of a pair along a line the force across it and the couple over the input; of any other the tip of the force over
    the motion, in the frame's axes, as polar diagrams, with marks where the input is. Strokes are `about` "load",
    "couple", "greatest" and "mark 30". Raises BadInput for a pair that is not there.
    """
    drawn = loaded(what)
    found = drawn.forces
    of = {pair.name: pair for pair in found.mechanism.pairs}
    for name in pairs or ():
        if name not in of:
            raise BadInput("pair", f"there is no pair {name!r}; pairs are {', '.join(of)}")
    chosen = pairs or [name for name, pair in of.items() if pair.coincident()[1:] or pair.rides()]
    diagrams = [each for name in chosen for each in _pictures(drawn, of[name], found.reactions[name])]
    return [each for each in diagrams if isinstance(each, Picture)] + _undrawn(diagrams)


def _undrawn(diagrams: Sequence[Picture | _Undrawn]) -> list[Picture]:
    """The pairs of which there is no diagram, those without one for the same reason in one line."""
    pairs: dict[str, dict[str, None]] = {}
    for each in diagrams:
        if isinstance(each, _Undrawn):
            pairs.setdefault(each.why, {})[each.pair] = None
    return [Picture((), f"No diagram: {listed(list(names))}", (why,)) for why, names in pairs.items()]


def _pictures(drawn: Loaded, pair: Pair, reaction: Reaction) -> Iterator[Picture | _Undrawn]:
    mechanism, number = drawn.forces.mechanism, numbered(drawn.forces.mechanism)
    first, second = pair.links
    sense = 1.0
    if second == mechanism.frame:
        first, second, sense = second, first, -1.0
    force, couple = sense * drawn.along(reaction.force), sense * drawn.along(reaction.couple)
    index, told = both(number[second], number[first]), f"on {second} by {first}"
    least = drawn.least
    couple = np.where(np.abs(couple) <= least * drawn.arm, 0.0, couple)
    of_couple = _Load(pair.name, Sign("M", index), told, "couple", reaction.why)
    if reaction.at is None:
        yield _over(drawn, couple, of_couple)
    elif pair.lower and pair.drive_kind is Kind.LENGTH:
        across = _across(drawn, pair, force)
        across = np.where(np.abs(across) <= least, 0.0, across)
        of_force = _Load(pair.name, Sign("F", index), f"{told}, to the left of its line", "load", reaction.why)
        yield _over(drawn, across, of_force)
        if np.nanmax(np.abs(couple), initial=0.0) > 0.0:
            yield _over(drawn, couple, of_couple)
    else:
        force = np.where(np.hypot(*force.T)[:, None] <= least[:, None], 0.0, force)
        yield _polar(drawn, force, _Load(pair.name, Sign("F", index), told, "load", reaction.why))


def _polar(drawn: Loaded, force: Array, load: _Load) -> Picture | _Undrawn:
    """The tip of a force (n, 2), to a round scale."""
    long = np.hypot(*force.T)
    if not np.nanmax(long, initial=0.0):
        return _nothing(load, long)
    seen = np.where(np.isfinite(axes.within(long))[:, None], force, np.nan)
    corners = np.concatenate([seen[np.isfinite(seen).all(axis=1)], np.zeros((1, 2))])
    low, high = corners.min(axis=0), corners.max(axis=0)
    prefix, per = prefixed(float(np.abs(corners).max()))
    scale = fitting("force", f"{prefix}N", *map(float, high - low), POLAR)
    across, up = (_equal(low[k], high[k], scale, f"{'xy'[k]} ({prefix}N)", per) for k in (0, 1))
    strokes: list[Mark] = [*axes.frame(across, up)]
    middle = float(across.on_paper(0.0))
    strokes.append(Line(((middle, 0.0), (middle, up.length)), Pen.AXIS, "zero"))
    strokes += axes.curve(*seen.T, across, up, Pen.CURVE, "load")
    strokes += _marks(drawn, seen, across, up)
    notes = [str(scale), *_reasons(drawn, long, load)]
    row = int(np.nanargmax(long))
    text = said(long[row], "N")
    if np.nanmin(long) < (1.0 - SAME) * long[row]:
        text = f"{text} {drawn.place(row)}"
    if np.isfinite(seen[row]).all():
        tip = axes.at(*seen[row], across, up)
        strokes.append(Arrow(axes.at(0.0, 0.0, across, up), tip, Pen.REACTION, "greatest"))
        strokes.append(Letter(text, tip, "greatest", 8.0, 1.0))
    else:
        notes.append(f"beyond the axes: {text}")
    return Picture(tuple(strokes), load.heading, tuple(notes))


def _nothing(load: _Load, values: Array) -> _Undrawn:
    """Why there is no diagram."""
    return _Undrawn(load.pair, NOTHING if np.isfinite(values).any() else load.why or "not told at any position")


def _equal(low: float, high: float, scale: Scale, name: str, per: float) -> axes.Axis:
    """An axis of a force at a scale, a little longer than what is drawn, with a tick at every centimetre of it."""
    low, high = low - ROUND * scale.per_mm, high + ROUND * scale.per_mm
    return axes.Axis(low, high, scale.on_paper(high - low), 10.0 * scale.per_mm, name, per)


def _marks(drawn: Loaded, force: Array, across: axes.Axis, up: axes.Axis) -> Iterator[Mark]:
    """Spots where the input is at round places, with these."""
    path = np.stack([across.on_paper(force[:, 0]), up.on_paper(force[:, 1])], axis=1)
    room = int(np.nansum(np.hypot(*np.diff(path, axis=0).T)) / BETWEEN)
    if not room:
        return
    span = float(drawn.over[-1] - drawn.over[0])
    step = round_step(span / min(room, MARKS) * (1.0 - 1e-9), DEGREES if drawn.unit == "deg" else PLAIN)
    last = floor(drawn.over[-1] / step + 1e-9)
    places = step * np.arange(-floor(-drawn.over[0] / step + 1e-9), last + 1)
    for place in places[:-1] if drawn.period else places:
        x, y = (float(np.interp(place, drawn.over, part)) for part in force.T)
        if np.isfinite([x, y]).all():
            name = f"mark {axes.number(place)}"
            at = axes.at(x, y, across, up)
            yield Circle(at, SPOT, Pen.CURVE, name, Fill.PAPER)
            yield Letter(axes.number(place), at, name, 6.5, 0.7)


def _over(drawn: Loaded, values: Array, load: _Load) -> Picture | _Undrawn:
    """A force along a line's left, or a couple, over the input."""
    if not np.nanmax(np.abs(values), initial=0.0):
        return _nothing(load, values)
    seen, measure = axes.within(values), "N·m" if load.about == "couple" else "N"
    across = axes.axis(drawn.over, WIDTH, drawn.name, tidy=False, degrees=drawn.unit == "deg")
    up = axes.effort_axis(seen, HEIGHT, load.sign.base, measure)
    strokes: list[Mark] = [*axes.frame(across, up), *axes.curve(drawn.over, seen, across, up, Pen.CURVE, load.about)]
    notes = [*_reasons(drawn, values, load)]
    row = int(np.nanargmax(np.abs(values)))
    text = f"{said(values[row], measure)} {drawn.place(row)}"
    if np.isfinite(seen[row]):
        at: Spot = axes.at(drawn.over[row], values[row], across, up)
        strokes.append(Circle(at, SPOT, Pen.CURVE, "greatest", Fill.PAPER))
        strokes.append(Letter(text, at, "greatest", 8.0, 1.0))
    else:
        notes.append(f"beyond the axis: {text}")
    return Picture(tuple(strokes), load.heading, tuple(notes))


def _reasons(drawn: Loaded, values: Array, load: _Load) -> Iterator[str]:
    """What is to be said of all diagrams, and of gaps in this one."""
    yield from drawn.notes
    gaps = np.flatnonzero(~np.isfinite(values))
    if len(gaps) > MANY:
        yield f"told at {len(values) - len(gaps)} of {len(values)} positions only: {load.why}"
    elif len(gaps):
        yield f"not told {listed([drawn.place(row) for row in gaps])}"


def _across(drawn: Loaded, pair: Pair, force: Array) -> Array:
    """The force (n,) on the left of the pair's line."""
    motion = drawn.forces.moving
    marks = pair.marks(motion.shapes, motion.mechanism.pairs)
    guide = next(mark for mark in marks if isinstance(mark, Guide))
    way = Field(motion, motion.shapes).frame(guide.link).turn(guide.way)
    left = np.stack(np.broadcast_arrays(-way.y, way.x, np.zeros(len(motion)))[:2], axis=-1)
    return (force * drawn.along(left)).sum(axis=1)
