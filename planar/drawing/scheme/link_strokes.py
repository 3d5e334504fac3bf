"""What moves of a mechanism as strokes on paper: plates, wheels, bars, springs, slots, blocks, masses and pins."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from math import hypot
from typing import Any

from planar.drawing.paper.picture import Circle, Fill, Line, Mark, Pen
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme import symbols
from planar.drawing.scheme.link_bodies import Body, off_line
from planar.drawing.scheme.scene import OVER, Scene, Travel, Tube
from planar.drawing.scheme.spring_mass_strokes import centres, springs
from planar.foundation.geometry import Frame, Vector
from planar.model.link_shapes import Shape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import Band, Block, Guide, Opening, Pin, PitchLine, Wheel


def body_marks(
    mechanism: Mechanism,
    bodies: Mapping[str, Body],
    frames: Mapping[str, Frame],
    shapes: Mapping[str, Shape],
    scale: Scale,
    pen: Pen = Pen.LINK,
    symbols: bool = True,
    travel: Travel | None = None,
) -> tuple[Mark, ...]:
    """What moves, in one position (frames of plain numbers), with all pins; lines alone where no symbols are wanted."""
    scene = Scene(mechanism, bodies, frames, shapes, scale, travel or {})
    return moving(scene, pen) if symbols else (*bars(scene, pen), *_tube_lines(scene, pen))


def moving(scene: Scene, pen: Pen = Pen.LINK) -> tuple[Mark, ...]:
    """Plates, wheels, bars, springs, slots, blocks, centres of mass and pins of a scene."""
    plates = [
        symbols.area(f"link {body.link}", pen, Fill.LINK, *(scene.place(body.link, p) for p in body.plate))
        for body in scene.bodies.values()
        if body.plate
    ]
    solid = (*plates, *_wheels(scene), *racks(scene), *cylinders(scene, pen), *bars(scene, pen))
    return (*solid, *springs(scene), *_sliders(scene, pen))


def bars(scene: Scene, pen: Pen) -> Iterator[Line]:
    """The lines of the bodies, with guides as far as their blocks and thin lines to points beside."""
    thin = Pen.PIN if pen is Pen.LINK else pen
    for link, body in scene.bodies.items():
        about = f"link {link}"
        tubes = [tube for tube in scene.tubes.values() if link == tube.guide]
        rods = [tube for tube in scene.tubes.values() if link == tube.rod]
        for side in body.sides:
            if not any(_lies_on(scene, link, side, tube) for tube in (*tubes, *rods)):
                yield symbols.line(about, pen, *(scene.place(link, p) for p in side))
        for side in body.tracers:
            yield symbols.line(about, thin, *(scene.place(link, p) for p in side))
        yield from _guide_lines(scene, link, body, pen)


def _lies_on(scene: Scene, link: str, side: tuple[Vector, Vector], tube: Tube) -> bool:
    """Whether a side lies on the centre line of a cylinder, which is drawn in its place."""
    frame, world = scene.frames[tube.guide], scene.frames[link]
    return all(off_line(frame.local(world.carry(p)), tube.foot, tube.way) <= 2.0 * scene.near for p in side)


def _guide_lines(scene: Scene, link: str, body: Body, pen: Pen) -> Iterator[Line]:
    """The lines of a link along which blocks run, from its body to beyond the block."""
    through = {mark.name: mark.through for mark in scene.marks if isinstance(mark, Guide | Opening)}
    over = OVER * scene.scale.per_mm
    slides = {mark.at for mark in scene.marks if isinstance(mark, Block) and mark.link == link}
    for name, foot, way in body.guides:
        if name in scene.tubes or name not in through:
            continue
        low, high = scene.range(name, link, through[name], foot, way)
        here = scene.along(name, link, foot, way)
        low, high = min(low, here), max(high, here)
        start, stop = min(0.0, low - over), max(0.0, high + over)
        if low > over or high < -over:  # to one side of the body only
            start, stop = (0.0, high + over) if low > 0.0 else (low - over, 0.0)
        if len(body.joints) == 1 and any(hypot(*(at - foot)) <= scene.near for at in slides):
            behind = over + symbols.BLOCK[1] / 2.0 * scene.scale.per_mm  # a yoke shows on both sides of its own block
            start, stop = min(start, -behind), max(stop, behind)
        yield symbols.line(
            f"link {link}", pen, scene.place(link, foot + way * start), scene.place(link, foot + way * stop)
        )


def _wheels(scene: Scene) -> Iterator[Mark]:
    """Wheels that move, and bands."""
    frame = scene.mechanism.frame
    seen: set[tuple[Any, ...]] = set()
    banded = {mark.name for mark in scene.marks if isinstance(mark, Band)}
    for mark in scene.marks:
        if isinstance(mark, Wheel) and mark.link != frame and mark.name not in banded:
            key = mark.link, *(round(value / scene.near) for value in (*mark.centre, mark.radius))
            if key not in seen:
                seen.add(key)
                at, radius = scene.place(mark.link, mark.centre), scene.scale.on_paper(mark.radius)
                yield from symbols.wheel(at, radius, f"gear {mark.name}", Pen.LINK)
        elif isinstance(mark, Band):
            both = mark.first, mark.second
            centres = [scene.place(wheel.link, wheel.centre) for wheel in both]
            radii = [scene.scale.on_paper(abs(wheel.radius)) for wheel in both]
            yield from symbols.band(centres, radii, mark.crossed, f"band {mark.name}")


def racks(scene: Scene) -> Iterator[Line]:
    """Racks that move, from the link's body to beneath the wheel."""
    for mark in scene.marks:
        if isinstance(mark, PitchLine) and mark.link != scene.mechanism.frame:
            at, way, back, half = contact(scene, mark)
            foot = next(each.foot for each in scene.bodies[mark.link].guides if each.name == mark.name)
            to_foot = (scene.place(mark.link, foot) - at).dot(way)
            low, high = min(-half, to_foot), max(half, to_foot)
            yield from symbols.rack(at + way * low, at + way * high, back, f"link {mark.link}")


def contact(scene: Scene, mark: PitchLine) -> tuple[Vector, Vector, Vector, float]:
    """Of a rack the place beneath its wheel, its way, which way the wheel is not, and half the length drawn (mm)."""
    through, way = scene.place(mark.link, mark.through), scene.way(mark.link, mark.way)
    centre = scene.place(mark.wheel.link, mark.wheel.centre)
    at = through + way * (centre - through).dot(way)
    left = symbols.quarter(way)
    back = left * (-1.0 if (centre - through).dot(left) > 0.0 else 1.0)
    return at, way, back, max(10.0, scene.scale.on_paper(1.2 * mark.wheel.radius))


def _tube_lines(scene: Scene, pen: Pen) -> Iterator[Line]:
    """Cylinders and rods by their centre lines alone."""
    for name, tube in scene.tubes.items():
        here = scene.along(name, tube.guide, tube.foot, tube.way)
        for link, low, high in ((tube.guide, tube.base, tube.mouth), (tube.rod, here + tube.piston, here + tube.end)):
            ends = (scene.place(tube.guide, tube.foot + tube.way * s) for s in (low, high))
            yield symbols.line(f"link {link}", pen, *ends)


def cylinders(scene: Scene, pen: Pen) -> Iterator[Line]:
    """Cylinders with their pistons and rods."""
    for name, tube in scene.tubes.items():
        here = scene.along(name, tube.guide, tube.foot, tube.way)
        spots = [
            scene.place(tube.guide, tube.foot + tube.way * s)
            for s in (tube.base, tube.mouth, here + tube.piston, here + tube.end)
        ]
        way = scene.way(tube.guide, tube.way)
        if tube.mouth - tube.base > scene.near:
            yield symbols.cylinder(spots[0], spots[1], way, f"link {tube.guide}")
        yield from symbols.piston(spots[2], spots[3], way, f"link {tube.rod}", pen)


def _sliders(scene: Scene, pen: Pen) -> Iterator[Mark]:
    """Slots, blocks, pins and points, in the order in which they hide one another."""
    frame = scene.mechanism.frame
    for mark in scene.marks:
        if isinstance(mark, Opening) and mark.link != frame:
            at, way = scene.place(mark.pin, mark.at), scene.way(mark.link, mark.way)
            yield symbols.opening(at, way, f"link {mark.link}", pen)
    for mark in scene.marks:
        if isinstance(mark, Block) and mark.name not in scene.tubes:
            at, way = scene.place(mark.link, mark.at), scene.way(mark.link, mark.way)
            yield symbols.block(at, way, f"block {scene.named(mark.name)}")
    yield from centres(scene)
    yield from pins(scene)
    for link, body in scene.bodies.items():
        for point, at in scene.shapes[link].points.items():
            if any(hypot(*(at - each)) <= scene.near for each in body.dots):
                yield symbols.dot(scene.place(link, at), f"point {scene.points[link, point]}")


def pins(scene: Scene) -> Iterator[Circle]:
    """Every pin, once however many links it joins."""
    drawn: set[str] = set()
    for mark in scene.marks:
        if isinstance(mark, Pin):
            link, at, name = mark.links[0], mark.at[0], mark.name
        elif isinstance(mark, Opening):
            link, at, name = mark.pin, mark.at, scene.named(mark.name)
        else:
            continue
        if name not in drawn:
            drawn.add(name)
            yield symbols.pin(scene.place(link, at), f"pin {name}")
