"""What stands still of a mechanism as strokes of its frame: supports, fixed guides, racks and wheels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from itertools import chain
from math import atan2, ceil, pi

from planar.drawing.paper.picture import Mark, Outline, Pen
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.link_bodies import LinkBody, distance_between
from planar.drawing.scheme.link_strokes import (
    bar_strokes,
    curved_slot_strokes,
    cylinder_strokes,
    rack_half_length,
    rack_side,
    rack_strokes,
    spring_strokes,
    wheel_symbols,
)
from planar.drawing.scheme.placed_strokes import PlacedLine, PlacedStroke, PlacedSymbol, stroke_marks
from planar.drawing.scheme.scene import Scene, TravelRanges, greatest, least
from planar.drawing.scheme.springs_masses import Coil
from planar.foundation.geometry import Frame, Vector, direction
from planar.foundation.jets import Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs.symbols import (
    BeltMark,
    CurvedSlotMark,
    GuideMark,
    PinMark,
    PitchLineMark,
    SliderMark,
    SlotMark,
    WheelMark,
)

FIXED_GUIDE_OVERHANG = symbol_table.BLOCK_SIZE[0] / 2.0 + 2.0
"""mm: how far a fixed guide goes on beyond the middle of a block at the end of its travel."""
SAME_POINT_TOLERANCE = 0.05
"""mm: places nearer than this are one."""

GuideOfFrame = GuideMark | SlotMark | SliderMark


def ground_marks(
    mechanism: Mechanism,
    bodies: Mapping[str, LinkBody],
    frames: Mapping[str, Frame],
    shapes: Mapping[str, LinkShape],
    scale: Scale,
    travel: TravelRanges | None = None,
    obstacles: Iterable[Mark] = (),
) -> tuple[Outline, ...]:
    """What stands still: supports, fixed guides and wheels, turned so that they are clear of the links' position.

    `obstacles` are further strokes to be clear of, such as the links in other positions.
    """
    return fixed_marks(Scene(mechanism, bodies, frames, shapes, scale, travel or {}), obstacles)


def fixed_marks(scene: Scene, obstacles: Iterable[Mark] = ()) -> tuple[Outline, ...]:
    """Supports, guides, racks and wheels of the frame, clear of the links and of further strokes where that can be."""
    on_paper = scene.frames, scene.scale.per_mm
    moving = stroke_marks(obstructing_strokes(scene), *on_paper)
    pins = stroke_marks(fixed_pins(scene), *on_paper)
    return tuple(stroke_marks(fixed_strokes(scene, Clearance.from_marks((*moving, *pins, *obstacles))), *on_paper))


def obstructing_strokes(scene: Scene) -> Iterator[PlacedStroke]:
    """The strokes of links that what stands still keeps clear of."""
    return chain(bar_strokes(scene), cylinder_strokes(scene), rack_strokes(scene), spring_strokes(scene))


def fixed_pins(scene: Scene) -> list[PlacedSymbol]:
    """The pins on the frame."""
    frame = scene.mechanism.frame
    return [
        PlacedSymbol(mark.name, frame, "pin", mark.positions[mark.links.index(frame)])
        for mark in scene.marks
        if isinstance(mark, PinMark) and frame in mark.links
    ]


def fixed_strokes(scene: Scene, clear: Clearance) -> list[PlacedStroke]:
    """What stands still; its sides are chosen clear of strokes on paper, and of one another."""
    frame, made = scene.mechanism.frame, list(_fixed_wheels(scene))
    middle = clear.centre()

    def add(strokes: Iterable[PlacedStroke]) -> None:
        nonlocal clear
        told = list(strokes)
        made.extend(told)
        clear = clear.with_marks(stroke_marks(told, scene.frames, float(scene.per_mm)))

    clear = clear.with_marks(stroke_marks(made, scene.frames, float(scene.per_mm)))
    for mark in scene.marks:
        if isinstance(mark, GuideOfFrame) and mark.link == frame:
            add(_fixed_guide_strokes(scene, mark, clear, middle))
    for slot in scene.curved_slots.values():
        if slot.link == frame:
            add(_fixed_curved_slot(scene, slot))
    drawn: set[str] = set()
    for pin in fixed_pins(scene):
        if pin.about not in drawn:
            drawn.add(pin.about)
            add([_support(scene, f"ground {pin.about}", pin.at, clear)])
    for name, at in _spring_anchors(scene):
        add([_support(scene, f"ground of {name}", at, clear)])
    return made


def fixed_point_strokes(scene: Scene) -> Iterator[PlacedSymbol]:
    """Points of the frame at which nothing is pinned."""
    frame = scene.mechanism.frame
    pinned = {mark.name for mark in scene.marks if isinstance(mark, PinMark)}
    for each in named_points(scene.mechanism):
        point = dict(each.members).get(frame)
        if point is not None and each.name not in pinned and not scene.is_unmarked(frame, point):
            yield PlacedSymbol(f"point {each.name}", frame, "fixed dot", scene.place(frame, point))


def _support(scene: Scene, about: str, at: Vector, clear: Clearance) -> PlacedSymbol:
    frame = scene.mechanism.frame
    return PlacedSymbol(about, frame, "support", at, clear.support_direction(scene.to_paper(frame, at)))


def _spring_anchors(scene: Scene) -> Iterator[tuple[str, Vector]]:
    """Where springs hang on the frame, but at its pins; once where several do."""
    frame, near = scene.mechanism.frame, SAME_POINT_TOLERANCE * float(scene.per_mm)
    met = [pin.at for pin in fixed_pins(scene)]
    for mark in scene.marks:
        if isinstance(mark, Coil):
            for link, at in zip(mark.links, mark.at, strict=True):
                if link == frame and all(distance_between(at, other) > near for other in met):
                    met.append(at)
                    yield mark.name, at


def _fixed_wheels(scene: Scene) -> Iterator[PlacedStroke]:
    """The outline, wheels and racks of the frame."""
    frame, seen = scene.mechanism.frame, set()
    corners = scene.outline_corners(frame)
    if len(corners) > 1:
        yield PlacedLine("ground outline", frame, Pen.PIN, corners, len(corners) > 2)
    banded = {mark.name for mark in scene.marks if isinstance(mark, BeltMark)}
    for mark in scene.marks:
        if isinstance(mark, WheelMark) and mark.link == frame and mark[2:] not in seen:
            seen.add(mark[2:])
            about = f"band {mark.name}" if mark.name in banded else f"gear {mark.name}"
            if mark.name not in banded:
                yield from wheel_symbols(mark, about, "fixed rim")
            yield from _rim_hatching(scene, mark, about)
        elif isinstance(mark, PitchLineMark) and mark.link == frame:
            half = rack_half_length(scene, mark)
            low, high = _guide_extent(scene, mark.name, mark.through, mark.direction, half)
            yield _rail(f"guide {mark.name}", frame, mark.through, mark.direction, low, high, rack_side(scene, mark))


def _rim_hatching(scene: Scene, mark: WheelMark, about: str) -> Iterator[PlacedSymbol]:
    """Hatching in three places inside the circle of a wheel, of an internal wheel outside its rim."""
    inside = mark.radius > 0.0
    rim = abs(mark.radius) if inside else abs(mark.radius) + symbol_table.RIM_WIDTH * scene.per_mm
    length = float(rim) / float(scene.per_mm)
    if inside and length < 3.0 * symbol_table.HATCH_LENGTH:
        return
    arc = min(pi / 5.0, 12.0 / length)
    count = max(2, ceil(arc * length / symbol_table.HATCH_LENGTH))
    for middle in (pi / 2.0, pi * 7.0 / 6.0, pi * 11.0 / 6.0):
        outs = (direction(middle + arc * (k / count - 0.5)) for k in range(count + 1))
        yield from _arc_hatching(about, mark.link, mark.centre, rim, outs, -1.0 if inside else 1.0)


def _arc_hatching(
    about: str, link: str, centre: Vector, rim: Scalar, outs: Iterable[Vector], side: float
) -> Iterator[PlacedSymbol]:
    """Hatching of a circle in directions from its centre, outside (`side` 1) or inside (-1) of it."""
    for out in outs:
        yield PlacedSymbol(about, link, "hatch", centre + out * rim, symbols.quarter_turn(out) * -1.0, side=side)


def _fixed_curved_slot(scene: Scene, slot: CurvedSlotMark) -> Iterator[PlacedStroke]:
    """A curved slot of the frame, hatched outside."""
    about = f"guide {slot.name}"
    yield from curved_slot_strokes(scene, slot, about, Pen.GROUND)
    rim = slot.radius + symbol_table.SLOT_SIZE[1] / 2.0 * scene.per_mm
    first, last = (atan2(float(out.y), float(out.x)) for out in (slot.directions[0], slot.directions[-1]))
    sweep = 2.0 * pi if slot.closed else (last - first) % (2.0 * pi)
    count = max(2, round(sweep * float(rim) / float(scene.per_mm) / symbol_table.HATCH_LENGTH))
    outs = (direction(first + sweep * k / count) for k in range(count + (not slot.closed)))
    yield from _arc_hatching(about, slot.link, slot.centre, rim, outs, 1.0)


def _guide_extent(scene: Scene, name: str, through: Vector, way: Vector, half: Scalar) -> tuple[Scalar, Scalar]:
    """From where to where a fixed line is drawn (m), `half` beside what is seen to run along it at least."""
    frame, over = scene.mechanism.frame, FIXED_GUIDE_OVERHANG * scene.per_mm
    first, last = scene.shown_range(name, frame, through, way)
    low, high = scene.drawn_range(name, frame, through, through, way)
    return least(low - over, first - half), greatest(high + over, last + half)


def _rail(about: str, link: str, at: Vector, way: Vector, start: Scalar, stop: Scalar, side: float) -> PlacedSymbol:
    """A line of what does not move, hatched on one side, between distances along it (m)."""
    return PlacedSymbol(about, link, "rail", at + way * start, way, at + way * stop, side)


def _fixed_guide_strokes(scene: Scene, mark: GuideOfFrame, clear: Clearance, middle: Vector) -> Iterator[PlacedStroke]:
    """A hatched line beneath a block; round a pin a slot; a fixed block, through which a link slides."""
    about, per_mm = f"guide {mark.name}", scene.per_mm
    half, link, way = symbol_table.BLOCK_SIZE[1] / 2.0, mark.link, mark.direction
    if isinstance(mark, SliderMark):
        at = mark.position
        low, high = (sign * (symbol_table.BLOCK_SIZE[0] / 2.0 + 1.0) * per_mm for sign in (-1.0, 1.0))
    else:
        at = mark.through
        room = 0.0 if scene.knows_travel(mark.name) else symbol_table.RAIL_LENGTH / 2.0
        low, high = _guide_extent(scene, mark.name, at, way, room * per_mm)
        if isinstance(mark, SlotMark):
            half = symbol_table.SLOT_SIZE[1] / 2.0
            across = symbols.quarter_turn(way) * (half * per_mm)
            for side in (across, across * -1.0):
                yield PlacedLine(about, link, Pen.GROUND, (at + way * low + side, at + way * high + side))
    here = 0.0 if isinstance(mark, SliderMark) else float(scene.shown_range(mark.name, link, at, way)[0])
    spot, along = scene.to_paper(link, at + way * here), scene.direction_on_paper(link, way)
    first, last = ((float(end) - here) / float(per_mm) for end in (low, high))
    sign, off = clear.hatching_side(spot, along, first, last, half, middle)
    beside = at + symbols.quarter_turn(way) * (sign * off * per_mm)
    for start, stop in _rail_segments(scene, mark, at, low, high):
        yield _rail(about, link, beside, way, start, stop, sign)


def _rail_segments(
    scene: Scene, mark: GuideOfFrame, at: Vector, low: Scalar, high: Scalar
) -> list[tuple[Scalar, Scalar]]:
    """A rail along a line (m from a place on it), with gaps for the supports of fixed pins that lie on its way."""
    pieces, way, per_mm = [(low, high)], mark.direction, scene.per_mm
    room = (symbol_table.SUPPORT_WIDTH / 2.0 + 1.0) * per_mm
    deep = (symbol_table.SUPPORT_HEIGHT + symbol_table.HATCH_LENGTH) * per_mm
    block = under = 0.0
    if not scene.knows_travel(mark.name):
        block = 0.0 if isinstance(mark, SliderMark) else scene.shown_range(mark.name, mark.link, at, way)[0]
        under = room + symbol_table.BLOCK_SIZE[0] / 2.0 * per_mm
    for pin in fixed_pins(scene):
        here, beside = (pin.at - at).dot(way), abs(way.cross(pin.at - at))
        if beside < deep and not abs(here - block) < under:
            cut = [(start, least(stop, here - room)) for start, stop in pieces]
            cut += [(greatest(start, here + room), stop) for start, stop in pieces]
            pieces = [each for each in cut if each[1] - each[0] > symbol_table.HATCH_LENGTH * per_mm]
    return pieces or [(low, high)]
