"""What moves of a mechanism as strokes on paper: plates, wheels, bars, springs, slots, blocks, masses and pins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot
from typing import Any

from planar.drawing.paper.picture import Fill, Outline, Pen, Polyline
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.link_bodies import LinkBody, distance_from_line
from planar.drawing.scheme.scene import GUIDE_OVERHANG, Cylinder, Scene, TravelRanges
from planar.drawing.scheme.spring_mass_strokes import mass_centre_marks, spring_strokes
from planar.foundation.geometry import Frame, Vector
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import BeltMark, GuideMark, PinMark, PitchLineMark, SliderMark, SlotMark, WheelMark


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
    return moving_marks(scene, pen) if with_symbols else (*bar_strokes(scene, pen), *_cylinder_centre_lines(scene, pen))


def moving_marks(scene: Scene, pen: Pen = Pen.LINK) -> tuple[Outline, ...]:
    """Plates, wheels, bars, springs, slots, blocks, centres of mass and pins of a scene."""
    plates = [
        symbols.filled_area(f"link {body.link}", pen, Fill.LINK, *(scene.to_paper(body.link, p) for p in body.plate))
        for body in scene.bodies.values()
        if body.plate
    ]
    solid = (
        *plates,
        *_wheel_marks(scene),
        *rack_strokes(scene),
        *cylinder_strokes(scene, pen),
        *bar_strokes(scene, pen),
    )
    return (*solid, *spring_strokes(scene), *_slider_marks(scene, pen))


def bar_strokes(scene: Scene, pen: Pen) -> Iterator[Polyline]:
    """The lines of the bodies, with guides as far as their blocks and thin lines to points beside."""
    thin = Pen.PIN if pen is Pen.LINK else pen
    for link, body in scene.bodies.items():
        about = f"link {link}"
        tubes = [tube for tube in scene.cylinders.values() if link == tube.guide]
        rods = [tube for tube in scene.cylinders.values() if link == tube.rod]
        for side in body.sides:
            if not any(_lies_on_cylinder(scene, link, side, tube) for tube in (*tubes, *rods)):
                yield symbols.stroke(about, pen, *(scene.to_paper(link, p) for p in side))
        for side in body.tracers:
            yield symbols.stroke(about, thin, *(scene.to_paper(link, p) for p in side))
        yield from _guide_strokes(scene, link, body, pen)


def _lies_on_cylinder(scene: Scene, link: str, side: tuple[Vector, Vector], tube: Cylinder) -> bool:
    """Whether a side lies on the centre line of a cylinder, which is drawn in its place."""
    frame, world = scene.frames[tube.guide], scene.frames[link]
    return all(
        distance_from_line(frame.to_local(world.to_world(p)), tube.foot, tube.direction) <= 2.0 * scene.tolerance
        for p in side
    )


def _guide_strokes(scene: Scene, link: str, body: LinkBody, pen: Pen) -> Iterator[Polyline]:
    """The lines of a link along which blocks run, from its body to beyond the block."""
    through = {mark.name: mark.through for mark in scene.marks if isinstance(mark, GuideMark | SlotMark)}
    over = GUIDE_OVERHANG * scene.scale.per_mm
    slides = {mark.position for mark in scene.marks if isinstance(mark, SliderMark) and mark.link == link}
    for name, foot, way in body.guides:
        if name in scene.cylinders or name not in through:
            continue
        low, high = scene.travel_range(name, link, through[name], foot, way)
        here = scene.displacement_along(name, link, foot, way)
        low, high = min(low, here), max(high, here)
        start, stop = min(0.0, low - over), max(0.0, high + over)
        if low > over or high < -over:  # to one side of the body only
            start, stop = (0.0, high + over) if low > 0.0 else (low - over, 0.0)
        if len(body.joints) == 1 and any(hypot(*(at - foot)) <= scene.tolerance for at in slides):
            behind = (
                over + symbol_table.BLOCK_SIZE[1] / 2.0 * scene.scale.per_mm
            )  # a yoke shows on both sides of its own block
            start, stop = min(start, -behind), max(stop, behind)
        yield symbols.stroke(
            f"link {link}", pen, scene.to_paper(link, foot + way * start), scene.to_paper(link, foot + way * stop)
        )


def _wheel_marks(scene: Scene) -> Iterator[Outline]:
    """Wheels that move, and bands."""
    frame = scene.mechanism.frame
    seen: set[tuple[Any, ...]] = set()
    banded = {mark.name for mark in scene.marks if isinstance(mark, BeltMark)}
    for mark in scene.marks:
        if isinstance(mark, WheelMark) and mark.link != frame and mark.name not in banded:
            key = mark.link, *(round(value / scene.tolerance) for value in (*mark.centre, mark.radius))
            if key not in seen:
                seen.add(key)
                at, radius = scene.to_paper(mark.link, mark.centre), scene.scale.on_paper(mark.radius)
                yield from symbols.wheel(at, radius, f"gear {mark.name}")
        elif isinstance(mark, BeltMark):
            both = mark.first, mark.second
            centres = [scene.to_paper(wheel.link, wheel.centre) for wheel in both]
            radii = [scene.scale.on_paper(abs(wheel.radius)) for wheel in both]
            yield from symbols.band(centres, radii, mark.crossed, f"band {mark.name}")


def rack_strokes(scene: Scene) -> Iterator[Outline]:
    """Racks that move, from the link's body to beneath the wheel."""
    for mark in scene.marks:
        if isinstance(mark, PitchLineMark) and mark.link != scene.mechanism.frame:
            at, way, back, half = rack_contact(scene, mark)
            foot = next(each.foot for each in scene.bodies[mark.link].guides if each.name == mark.name)
            to_foot = (scene.to_paper(mark.link, foot) - at).dot(way)
            low, high = min(-half, to_foot), max(half, to_foot)
            yield from symbols.symbol_marks(
                "rack bar", f"link {mark.link}", at + way * low, way, at + way * high, left=back
            )


def rack_contact(scene: Scene, mark: PitchLineMark) -> tuple[Vector, Vector, Vector, float]:
    """Of a rack the place beneath its wheel, its way, which way the wheel is not, and half the length drawn (mm)."""
    through, way = scene.to_paper(mark.link, mark.through), scene.direction_on_paper(mark.link, mark.direction)
    centre = scene.to_paper(mark.wheel.link, mark.wheel.centre)
    at = through + way * (centre - through).dot(way)
    left = symbols.quarter_turn(way)
    back = left * (-1.0 if (centre - through).dot(left) > 0.0 else 1.0)
    return at, way, back, max(10.0, scene.scale.on_paper(1.2 * mark.wheel.radius))


def _cylinder_centre_lines(scene: Scene, pen: Pen) -> Iterator[Polyline]:
    """Cylinders and rods by their centre lines alone."""
    for name, tube in scene.cylinders.items():
        here = scene.displacement_along(name, tube.guide, tube.foot, tube.direction)
        for link, low, high in (
            (tube.guide, tube.base, tube.mouth),
            (tube.rod, here + tube.piston, here + tube.rod_end),
        ):
            ends = (scene.to_paper(tube.guide, tube.foot + tube.direction * s) for s in (low, high))
            yield symbols.stroke(f"link {link}", pen, *ends)


def cylinder_strokes(scene: Scene, pen: Pen) -> Iterator[Outline]:
    """Cylinders with their pistons and rods."""
    for name, tube in scene.cylinders.items():
        here = scene.displacement_along(name, tube.guide, tube.foot, tube.direction)
        spots = [
            scene.to_paper(tube.guide, tube.foot + tube.direction * s)
            for s in (tube.base, tube.mouth, here + tube.piston, here + tube.rod_end)
        ]
        way = scene.direction_on_paper(tube.guide, tube.direction)
        if tube.mouth - tube.base > scene.tolerance:
            yield from symbols.symbol_marks("cylinder", f"link {tube.guide}", spots[0], way, spots[1])
        yield from symbols.symbol_marks("piston", f"link {tube.rod}", spots[2], way, spots[3], pen=pen)


def _slider_marks(scene: Scene, pen: Pen) -> Iterator[Outline]:
    """Slots, blocks, pins and points, in the order in which they hide one another."""
    frame = scene.mechanism.frame
    for mark in scene.marks:
        if isinstance(mark, SlotMark) and mark.link != frame:
            at, way = (
                scene.to_paper(mark.pin_link, mark.pin_position),
                scene.direction_on_paper(mark.link, mark.direction),
            )
            yield from symbols.slot(at, way, f"link {mark.link}", pen)
    for mark in scene.marks:
        if isinstance(mark, SliderMark) and mark.name not in scene.cylinders:
            at, way = scene.to_paper(mark.link, mark.position), scene.direction_on_paper(mark.link, mark.direction)
            yield from symbols.symbol_marks("block", f"block {scene.running_point_name(mark.name)}", at, way)
    yield from mass_centre_marks(scene)
    yield from pin_strokes(scene)
    for link, body in scene.bodies.items():
        for point, at in scene.shapes[link].points.items():
            if any(hypot(*(at - each)) <= scene.tolerance for each in body.dots):
                yield from symbols.symbol_marks(
                    "dot", f"point {scene.point_names[link, point]}", scene.to_paper(link, at)
                )


def pin_strokes(scene: Scene) -> Iterator[Outline]:
    """Every pin, once however many links it joins."""
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
            yield from symbols.symbol_marks("pin", f"pin {name}", scene.to_paper(link, at))
