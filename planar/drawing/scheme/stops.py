"""Stops of pairs as they are drawn: small blocks before which a block, a piston or a bar comes to stand."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import cos, sin

from planar.drawing.scheme.link_bodies import unit_vector
from planar.drawing.scheme.placed_strokes import PlacedSymbol
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.springs_masses import SpringMassMark
from planar.drawing.scheme.symbols import quarter_turn
from planar.foundation.geometry import Vector, direction
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.model.pairs.symbols import DrawingMark, GuideMark, SlotMark
from planar.model.stops import Stops


def stop_strokes(scene: Scene) -> Iterator[PlacedSymbol]:
    """The stops of slides and pins; those of wheels have no place of their own."""
    motions = relative_motions(scene.mechanism) if scene.mechanism.stops else {}
    guides = {mark.name: mark for mark in scene.marks if isinstance(mark, GuideMark | SlotMark)}
    for stops in scene.mechanism.stops:
        pair = motions[stops.pair]
        if stops.pair in scene.curved_slots:
            yield from _ring_stops(scene, stops, pair)
            continue
        if stops.pair in guides:
            yield from _slide_stops(scene, stops, guides[stops.pair])
        elif pair.input_kind is MeasureKind.ANGLE and pair.coincident_points():
            yield from _pin_stops(scene, stops, pair)


def slide_stop_places(
    mechanism: Mechanism, marks: Iterable[DrawingMark | SpringMassMark]
) -> Iterator[tuple[str, Vector]]:
    """Where the stops of slides are: their link, and the place in its axes."""
    guides = {mark.name: mark for mark in marks if isinstance(mark, GuideMark | SlotMark)}
    for stops in mechanism.stops:
        if (guide := guides.get(stops.pair)) is None:
            continue
        for at, _ in _ends(stops):
            yield guide.link, guide.through + guide.direction * at


def _ends(stops: Stops) -> Iterator[tuple[float, float]]:
    """Where the stops are, and on which side of that their blocks: -1 below, 1 above."""
    for at, sense in ((stops.low, -1.0), (stops.high, 1.0)):
        if at is not None:
            yield at, sense


def _slide_stops(scene: Scene, stops: Stops, guide: GuideMark | SlotMark) -> Iterator[PlacedSymbol]:
    """Blocks on the line of a slide, and in a cylinder where its piston would strike."""
    tube, about = scene.cylinders.get(stops.pair), f"stop of {stops.pair}"
    for at, sense in _ends(stops):
        place = guide.through + guide.direction * at
        symbol = "pin stop" if isinstance(guide, SlotMark) else "block stop"
        if tube is not None:
            place, symbol = place + tube.direction * tube.piston, "piston stop"
        yield PlacedSymbol(about, guide.link, symbol, place, guide.direction * sense)


def _pin_stops(scene: Scene, stops: Stops, pair: Pair) -> Iterator[PlacedSymbol]:
    """Blocks on one of two links on both sides of the way in which the other lies at its stops."""
    action = pair.effort_action(scene.frames, scene.shapes)
    points = dict(pair.coincident_points())
    moving, base = action.link, action.reaction_link
    way = _bar_direction(scene, moving, points[moving])
    for at, sense in _ends(stops):
        c, s = cos(at), sin(at)
        turned = Vector(c * way.x - s * way.y, s * way.x + c * way.y)
        yield PlacedSymbol(
            f"stop of {stops.pair}", base, "bar stop", scene.place(base, points[base]), turned, side=sense
        )


def _ring_stops(scene: Scene, stops: Stops, pair: Pair) -> Iterator[PlacedSymbol]:
    """A block in a curved slot that is a whole ring; the ends of any other slot are its stops."""
    slot = scene.curved_slots[stops.pair]
    turn = 1.0 if pair.effort_action(scene.frames, scene.shapes).reaction_link == slot.link else -1.0
    for position, sense in _ends(stops) if slot.closed else ():
        out = direction(turn * position)
        along = quarter_turn(out) * (turn * sense)
        yield PlacedSymbol(f"stop of {stops.pair}", slot.link, "pin stop", slot.centre + out * slot.radius, along)


def _bar_direction(scene: Scene, link: str, pin: str) -> Vector:
    """The direction from a pin along a link's bar, in its own axes."""
    here = scene.place(link, pin)
    sides = [side for side in scene.bodies[link].sides if here in side] if link in scene.bodies else []
    others = [end for side in sides for end in side if end != here]
    others += [scene.place(link, name) for name in scene.places[link] if name != pin]
    for other in others:
        if any(float(each) for each in other - here):
            return unit_vector(other - here)
    return Vector(1.0, 0.0)
