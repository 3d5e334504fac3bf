"""Motors of inputs as they are drawn: a circle with an M, by a short shaft at the pin or the slide that each drives."""

from __future__ import annotations

from collections.abc import Iterator
from math import pi

from planar.drawing.paper.picture import Pen
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.input_arrows import driven_place
from planar.drawing.scheme.placed_strokes import PlacedLine, PlacedStroke, PlacedSymbol
from planar.drawing.scheme.scene import Scene
from planar.drawing.scheme.symbol_table import BLOCK_SIZE, CYLINDER_WIDTH, MOTOR_DISTANCE, MOTOR_RADIUS, PIN_RADIUS
from planar.foundation.geometry import Vector, direction
from planar.model.mechanism import relative_motions
from planar.model.pairs import Pair
from planar.model.pairs.symbols import PinMark, SliderMark

DIRECTIONS = 24
"""Ways round a pin in which its motor may stand."""


def motor_strokes(scene: Scene, clear: Clearance) -> Iterator[PlacedStroke]:
    """The motors of inputs, each where it is clearest; of inputs that have no place of their own none."""
    pairs = relative_motions(scene.mechanism)
    for given in scene.mechanism.inputs:
        found = None if given.motor is None else _shaft_place(scene, pairs[given.pair])
        if found is None:
            continue
        link, at, start = found
        frame, about = scene.frames[link], f"motor of {given.pair}"
        way = _clear_direction(scene.to_paper(link, at), start, clear)
        own = direction(way - float(frame.angle))
        centre = at + own * (MOTOR_DISTANCE * scene.per_mm)
        rim = at + own * ((MOTOR_DISTANCE - MOTOR_RADIUS) * scene.per_mm)
        yield PlacedLine(about, link, Pen.PIN, (at + own * (start * scene.per_mm), rim))
        upright = direction(-float(frame.angle)) if scene.is_moving else None
        yield PlacedSymbol(about, link, "motor", centre, upright)


def _shaft_place(scene: Scene, pair: Pair) -> tuple[str, Vector, float] | None:
    """The link that carries a motor, the place there at which it drives, and how far from that its shaft is seen (mm).

    That is the link against which the driven one turns, the tube of a cylinder, or else what slides.
    """
    found = driven_place(scene, pair)
    if found is None:
        return None
    tube = scene.cylinders.get(pair.name)
    if tube is not None:
        return tube.guide, tube.foot, CYLINDER_WIDTH / 2.0
    base = found.against or scene.mechanism.frame
    for mark in scene.pair_marks(pair):
        if isinstance(mark, PinMark) and base in mark.links:
            return base, mark.positions[mark.links.index(base)], PIN_RADIUS
        if isinstance(mark, SliderMark):
            return found.link, found.at, BLOCK_SIZE[1] / 2.0
    return found.link, found.at, PIN_RADIUS


def _clear_direction(at: Vector, start: float, clear: Clearance) -> float:
    """The way on paper (rad) in which least is behind a motor and its shaft, best upwards."""
    room = MOTOR_RADIUS + 0.8

    def price(k: int) -> tuple[float, int]:
        way = direction(0.5 * pi + k * 2.0 * pi / DIRECTIONS)
        shaft = clear.count_in_box(at, way, Vector(start + 0.6, -0.6), Vector(MOTOR_DISTANCE - room, 0.6))
        box = Vector(MOTOR_DISTANCE - room, -room), Vector(MOTOR_DISTANCE + room, room)
        return round(clear.count_in_box(at, way, *box) + shaft, 1), min(k, DIRECTIONS - k)

    return 0.5 * pi + min(range(DIRECTIONS), key=price) * 2.0 * pi / DIRECTIONS
