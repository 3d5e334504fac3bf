"""What moves of a mechanism as strokes of its links: plates, wheels, bars, springs, slots, blocks, masses and pins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import chain, product
from math import hypot, pi
from typing import Any

from planar.drawing.paper.picture import Fill, Outline, Pen
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.link_bodies import LinkBody, distance_between, distance_from_line, is_inside_outline
from planar.drawing.scheme.placed_strokes import (
    PlacedLine,
    PlacedSpring,
    PlacedStroke,
    PlacedSymbol,
    PlacedTorsionSpring,
    stroke_marks,
)
from planar.drawing.scheme.scene import GUIDE_OVERHANG, Cylinder, Scene, TravelRanges, greatest, least
from planar.drawing.scheme.springs_masses import Coil, MassCentreMark, Spiral
from planar.drawing.scheme.stops import stop_strokes
from planar.foundation import jets
from planar.foundation.geometry import Frame, Vector, direction
from planar.foundation.jets import Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import (
    BeltMark,
    CamMark,
    CurvedSlotMark,
    GuideMark,
    OutlineMark,
    PinMark,
    PitchLineMark,
    SliderMark,
    SlotMark,
    WheelMark,
)

ROLLER_POINTS = 48
"""Corners of the line that is drawn for the rim of a roller."""
SLOT_END_STEPS = 8
"""Parts of the line that is drawn for the round end of a curved slot."""


# many: what a scene is made of, and how it is drawn
def body_marks(
    mechanism: Mechanism,
    bodies: Mapping[str, LinkBody],
    frames: Mapping[str, Frame],
    shapes: Mapping[str, LinkShape],
    scale: Scale,
    pen: Pen = Pen.LINK,
    with_symbols: bool = True,
    travel: TravelRanges | None = None,
) -> tuple[Outline, ...]:
    """What moves, in one position (frames of plain numbers), with all pins; lines alone where no symbols are wanted."""
    scene = Scene(mechanism, bodies, frames, shapes, scale, travel or {})
    if with_symbols:
        return moving_marks(scene, pen)
    lines = (*bar_strokes(scene, pen), *_cylinder_centre_lines(scene, pen))
    return tuple(stroke_marks(lines, frames, scale.per_mm))


def moving_marks(scene: Scene, pen: Pen = Pen.LINK) -> tuple[Outline, ...]:
    """Plates, wheels, bars, springs, slots, blocks, centres of mass and pins of a scene on paper."""
    strokes = chain.from_iterable(moving_strokes(scene, pen).values())
    return tuple(stroke_marks(strokes, scene.frames, scene.scale.per_mm))


def moving_strokes(scene: Scene, pen: Pen = Pen.LINK) -> dict[str, Iterator[PlacedStroke]]:
    """The same as strokes of links by their level; each level hides those before it."""
    return {
        "plates": _plate_strokes(scene, pen),
        "wheels": chain(_wheel_strokes(scene), rack_strokes(scene), cam_strokes(scene)),
        "tubes": cylinder_strokes(scene, pen),
        "bars": bar_strokes(scene, pen),
        "springs": spring_strokes(scene),
        "sliders": chain(stop_strokes(scene), _slider_strokes(scene, pen)),
        "pins": pin_strokes(scene),
    }


def _plate_strokes(scene: Scene, pen: Pen) -> Iterator[PlacedLine]:
    for body in scene.bodies.values():
        if body.plate:
            yield PlacedLine(f"link {body.link}", body.link, pen, body.plate, True, Fill.LINK)
        corners = scene.outline_corners(body.link)
        if len(corners) > 1:
            thin = Pen.PIN if pen is Pen.LINK else pen
            yield PlacedLine(f"link {body.link}", body.link, thin, corners, len(corners) > 2, Fill.LINK)


def bar_strokes(scene: Scene, pen: Pen = Pen.LINK) -> Iterator[PlacedLine]:
    """The lines of the bodies, with guides as far as their blocks and thin lines to points beside."""
    thin = Pen.PIN if pen is Pen.LINK else pen
    for link, body in scene.bodies.items():
        about = f"link {link}"
        lines = [
            *((tube.foot, tube.direction) for tube in scene.cylinders.values() if link == tube.guide),
            *((tube.rod_place, tube.rod_direction) for tube in scene.cylinders.values() if link == tube.rod),
        ]
        for side in body.sides:
            # what lies on the centre line of a cylinder is drawn as the cylinder
            if not any(all(distance_from_line(p, *line) <= 2.0 * scene.tolerance for p in side) for line in lines):
                yield PlacedLine(about, link, pen, side)
        for side in body.tracers:
            yield PlacedLine(about, link, thin, side)
        support = _outline_support(scene, body)
        if support is not None:
            yield PlacedLine(about, link, thin if body.sides else pen, support)
        yield from _guide_strokes(scene, link, body, pen)
        for slot in scene.curved_slots.values():
            if slot.link == link and (supports := [*body.joints, *(guide.foot for guide in body.guides)]):
                nearest = min(product(supports, slot.places()), key=lambda ends: float(distance_between(*ends)))
                yield PlacedLine(about, link, pen, nearest)


def _outline_support(scene: Scene, body: LinkBody) -> tuple[Vector, Vector] | None:
    """The line from the nearest joint to an outline that lies apart from the link's body."""
    corners = scene.outline_corners(body.link)
    supports = [*body.joints, *(guide.foot for guide in body.guides)]
    is_apart = corners and supports and not any(is_inside_outline(place, corners) for place in supports)
    if not is_apart or any(is_inside_outline(corner, body.plate) for corner in corners):
        return None
    return min(product(supports, corners), key=lambda endpoints: float(distance_between(*endpoints)))


def _guide_strokes(scene: Scene, link: str, body: LinkBody, pen: Pen) -> Iterator[PlacedLine]:
    """The lines of a link along which blocks run, from its body to beyond the block."""
    if not body.guides:
        return
    through = {mark.name: mark.through for mark in scene.marks if isinstance(mark, GuideMark | SlotMark)}
    over = GUIDE_OVERHANG * scene.per_mm
    slides = {mark.position for mark in scene.marks if isinstance(mark, SliderMark) and mark.link == link}
    for name, foot, way in body.guides:
        if name in scene.cylinders or name not in through:
            continue
        low, high = scene.drawn_range(name, link, through[name], foot, way)
        start, stop = least(0.0, low - over), greatest(0.0, high + over)
        if len(body.joints) == 1 and any(hypot(*(at - foot)) <= scene.tolerance for at in slides):
            behind = over + symbol_table.BLOCK_SIZE[1] / 2.0 * scene.per_mm
            start, stop = least(start, -behind), greatest(stop, behind)  # a yoke shows on both sides of its own block
        yield PlacedLine(f"link {link}", link, pen, (foot + way * start, foot + way * stop))


def _wheel_strokes(scene: Scene) -> Iterator[PlacedStroke]:
    """Wheels that move, and bands. In a moving picture a mark shows that a wheel turns."""
    frame = scene.mechanism.frame
    seen: set[tuple[Any, ...]] = set()
    banded = {mark.name for mark in scene.marks if isinstance(mark, BeltMark)}
    for mark in scene.marks:
        if isinstance(mark, BeltMark):
            yield from _band_strokes(mark)
        if not isinstance(mark, WheelMark) or mark.link == frame:
            continue
        about, radius, loose = f"gear {mark.name}", abs(mark.radius), mark.name not in banded
        key = mark.link, loose, *(round(float(value) / scene.tolerance) for value in (*mark.centre, mark.radius))
        if key in seen:
            continue
        seen.add(key)
        if loose:
            yield from wheel_symbols(mark, about)
        if scene.is_moving:
            rim = mark.centre + symbols.EAST * radius
            yield PlacedSymbol(about, mark.link, "wheel mark", mark.centre, stop=rim, radius=radius)


def wheel_symbols(mark: WheelMark, about: str, rim: str = "rim") -> Iterator[PlacedSymbol]:
    """A pitch circle; of an internal wheel (radius below zero) also its rim."""
    for name in ("wheel", rim) if mark.radius < 0.0 else ("wheel",):
        yield PlacedSymbol(about, mark.link, name, mark.centre, radius=abs(mark.radius))


def _band_strokes(mark: BeltMark) -> Iterator[PlacedStroke]:
    """A loop round two wheels: both circles and their outer, if crossed their inner, common tangents."""
    about, (p, q), (r, s) = f"band {mark.name}", mark.centres, (abs(mark.first.radius), abs(mark.second.radius))
    for at, radius in ((p, r), (q, s)):
        yield PlacedSymbol(about, mark.carrier, "band circle", at, radius=radius)
    length = jets.hypot(*(q - p))
    far = -s if mark.crossed else s
    if length <= 0.0 or abs(r - far) > length:
        return
    way = (q - p) * (1.0 / length)
    along = (r - far) / length
    aside = jets.sqrt(1.0 - along * along)
    for sign in (1.0, -1.0):
        out = way * along + symbols.quarter_turn(way) * (sign * aside)
        yield PlacedLine(about, mark.carrier, Pen.BAND, (p + out * r, q + out * far))


def rack_strokes(scene: Scene) -> Iterator[PlacedSymbol]:
    """Racks that move, from the link's body to beneath the wheel, wherever it is known to come."""
    for mark in scene.marks:
        if isinstance(mark, PitchLineMark) and mark.link != scene.mechanism.frame:
            foot, way = next(each[1:] for each in scene.bodies[mark.link].guides if each.name == mark.name)
            first, last = scene.drawn_range(mark.name, mark.link, mark.through, foot, way)
            half, side = rack_half_length(scene, mark), rack_side(scene, mark)
            low, high = least(first - half, 0.0), greatest(last + half, 0.0)
            yield PlacedSymbol(
                f"link {mark.link}",
                mark.link,
                "rack bar",
                foot + way * low,
                way,
                foot + way * high,
                side,
            )


def cam_strokes(scene: Scene) -> Iterator[PlacedLine]:
    """Profiles of cams that move or stand, and what of their followers touches them; other outlines."""
    for mark in scene.marks:
        if isinstance(mark, OutlineMark):
            yield PlacedLine(f"link {mark.link}", mark.link, Pen.LINK, mark.points, mark.closed)
        if not isinstance(mark, CamMark):
            continue
        yield PlacedLine(f"link {mark.link}", mark.link, Pen.LINK, mark.profile, True)
        about = f"link {mark.follower_link}"
        if mark.face:
            yield PlacedLine(about, mark.follower_link, Pen.LINK, mark.face)
        elif mark.roller_radius:
            turned = (direction(2.0 * pi * k / ROLLER_POINTS) for k in range(ROLLER_POINTS))
            rim = tuple(mark.middle + each * mark.roller_radius for each in turned)
            yield PlacedLine(about, mark.follower_link, Pen.PIN, rim, True)


def rack_half_length(scene: Scene, mark: PitchLineMark) -> Scalar:
    """How far a rack is drawn at least to either side of where its wheel touches it (m)."""
    return greatest(10.0 * scene.per_mm, 1.2 * mark.wheel.radius)


def rack_side(scene: Scene, mark: PitchLineMark) -> float:
    """On which side of its pitch line a rack's wheel is not: 1 to the left of its direction, -1 to the right."""
    centre = scene.to_paper(mark.wheel.link, mark.wheel.centre) - scene.to_paper(mark.link, mark.through)
    left = symbols.quarter_turn(scene.direction_on_paper(mark.link, mark.direction))
    return -1.0 if centre.dot(left) > 0.0 else 1.0


def _cylinder_centre_lines(scene: Scene, pen: Pen) -> Iterator[PlacedLine]:
    """Cylinders and rods by their centre lines alone."""
    for tube in scene.cylinders.values():
        for link, ends in ((tube.guide, _cylinder_ends(tube)), (tube.rod, _rod_ends(tube))):
            yield PlacedLine(f"link {link}", link, pen, ends)


def _cylinder_ends(tube: Cylinder) -> tuple[Vector, Vector]:
    return tube.foot + tube.direction * tube.base, tube.foot + tube.direction * tube.mouth


def _rod_ends(tube: Cylinder) -> tuple[Vector, Vector]:
    place, way = tube.rod_place, tube.rod_direction
    return place + way * tube.piston, place + way * tube.rod_end


def cylinder_strokes(scene: Scene, pen: Pen = Pen.LINK) -> Iterator[PlacedSymbol]:
    """Cylinders with their pistons and rods."""
    for tube in scene.cylinders.values():
        if tube.mouth - tube.base > scene.tolerance:
            start, stop = _cylinder_ends(tube)
            yield PlacedSymbol(f"link {tube.guide}", tube.guide, "cylinder", start, tube.direction, stop)
        start, stop = _rod_ends(tube)
        yield PlacedSymbol(f"link {tube.rod}", tube.rod, "piston", start, tube.rod_direction, stop, pen=pen)


def spring_strokes(scene: Scene) -> Iterator[PlacedSpring | PlacedTorsionSpring]:
    """Springs and dampers, each as long as it is in this position."""
    for mark in scene.marks:
        if isinstance(mark, Coil):
            yield PlacedSpring(mark.name, mark.links, mark.symbol, mark.at)
        elif isinstance(mark, Spiral):
            symbol = f"torsion {mark.symbol}"
            yield PlacedTorsionSpring(mark.name, mark.links, symbol, mark.pin, mark.at, mark.ways, mark.free)


def _slider_strokes(scene: Scene, pen: Pen) -> Iterator[PlacedLine | PlacedSymbol]:
    """Straight and curved slots, blocks and centres of mass."""
    frame = scene.mechanism.frame
    spare = 0.0 if scene.is_moving else (symbol_table.SLOT_SIZE[0] - symbol_table.SLOT_SIZE[1]) / 2.0 * scene.per_mm
    for mark in scene.marks:
        if isinstance(mark, SlotMark) and mark.link != frame:
            at, way = mark.through, mark.direction
            low, high = scene.shown_range(mark.name, mark.link, at, way)
            start, stop = at + way * (low - spare), at + way * (high + spare)
            yield PlacedSymbol(f"link {mark.link}", mark.link, "slot opening", start, way, stop, pen=pen)
    for curved in scene.curved_slots.values():
        if curved.link != frame:
            yield from curved_slot_strokes(scene, curved, f"link {curved.link}", pen)
    for mark in scene.marks:
        if isinstance(mark, SliderMark) and mark.name not in scene.cylinders:
            about = f"block {scene.running_point_name(mark.name)}"
            yield PlacedSymbol(about, mark.link, "block", mark.position, mark.direction)
    for mark in scene.marks:
        if isinstance(mark, MassCentreMark):
            yield PlacedSymbol(mark.name, mark.link, "mass centre", mark.at, symbols.EAST if scene.is_moving else None)


def curved_slot_strokes(scene: Scene, slot: CurvedSlotMark, about: str, pen: Pen) -> Iterator[PlacedLine]:
    """The edge of a curved slot, as wide as a straight one: round ends where its pin stops, two circles without."""
    half = symbol_table.SLOT_SIZE[1] / 2.0 * scene.per_mm
    outside, inside = slot.places(half), slot.places(-least(half, slot.radius))
    if slot.closed:
        for edge in (outside, inside):
            yield PlacedLine(about, slot.link, pen, edge, True)
        return
    first, last = slot.directions[0], slot.directions[-1]

    def end(out: Vector, start: float) -> Iterator[Vector]:
        middle, along = slot.centre + out * slot.radius, symbols.quarter_turn(out)
        for k in range(1, SLOT_END_STEPS):
            turn = direction(start + pi * k / SLOT_END_STEPS)
            yield middle + (out * turn.x + along * turn.y) * half

    edge = (*outside, *end(last, 0.0), *reversed(inside), *end(first, pi))
    yield PlacedLine(about, slot.link, pen, edge, True, Fill.PAPER)


def pin_strokes(scene: Scene) -> Iterator[PlacedSymbol]:
    """Every pin, once however many links it joins, and points that are no joints."""
    drawn: set[str] = set()
    for mark in scene.marks:
        if isinstance(mark, PinMark):
            link, at, name = mark.links[0], mark.positions[0], mark.name
        elif isinstance(mark, SlotMark):
            link, at, name = mark.pin_link, mark.pin_position, scene.running_point_name(mark.name)
        else:
            continue
        if name not in drawn:
            drawn.add(name)
            yield PlacedSymbol(f"pin {name}", link, "pin", at)
    for link, body in scene.bodies.items():
        for point, at in scene.places[link].items():
            if any(hypot(*(at - each)) <= scene.tolerance for each in body.dots):
                yield PlacedSymbol(f"point {scene.point_names[link, point]}", link, "dot", at)
