"""A plate as it is cut: an outline of lines and arcs, holes and slots, in millimetres where the mechanism was drawn."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import atan2, cos, hypot, pi, radians, sin, tan
from typing import NamedTuple

Place = tuple[float, float]
ROUND_OFF = 1e-12
"""Of the square of a hull's extent: a turn that is none."""
ONE_PLACE = 1e-9
"""mm: points that are all this near to each other are one."""
SAME_HOLE = 1e-6
"""Part of a hole's diameter: holes this near to each other are one."""
Vertex = tuple[float, float, float]
"""x, y, and the bulge of the way to the next vertex: the tangent of a quarter of its arc's angle, 0 if straight."""


class Hole(NamedTuple):
    """A round hole for the pin of this name."""

    pin: str
    at: Place
    diameter: float


class Slot(NamedTuple):
    """A slot in which the pin of this name slides, between the centres of its round ends."""

    pin: str
    start: Place
    end: Place
    width: float


class Plate(NamedTuple):
    """A plate of a link. `core` are points round which everything within `reach` is of the plate, for what clears it.

    A plate with teeth is of kind "wheel", "ring" or, of a rack, "strip"; a pulley is a "disc"; a cam is a "profile"
    that drives a "roller" or the flat face of a "shoe"; any other is a "bar".
    """

    name: str
    link: str
    kind: str
    outline: tuple[Vertex, ...]
    inside: tuple[tuple[Vertex, ...], ...]
    holes: tuple[Hole, ...]
    slots: tuple[Slot, ...]
    core: tuple[Place, ...]
    reach: float
    layer: int = 0
    teeth: int = 0
    module: float = 0.0

    @property
    def loops(self) -> tuple[tuple[Vertex, ...], ...]:
        """All closed lines that are cut: the outline, what is cut out of it, slots; holes are apart."""
        return (self.outline, *self.inside, *(slot_outline(slot) for slot in self.slots))

    @property
    def drilled(self) -> tuple[Hole, ...]:
        """The holes that are drilled: of two pins on one axis one hole, the wider."""
        distinct: list[Hole] = []
        for hole in sorted(self.holes, key=lambda hole: -hole.diameter):
            if all(hypot(hole.at[0] - at[0], hole.at[1] - at[1]) > SAME_HOLE * hole.diameter for _, at, _ in distinct):
                distinct.append(hole)
        return tuple(distinct)


def convex_hull(points: Iterable[Place]) -> list[Place]:
    """The corners of the convex hull, anticlockwise (A. M. Andrew's monotone chain); on a line to round-off is none.

    Points are ordered along the direction to the one farthest from the first, so that points of one line, or at one
    place, keep their order whatever rounding makes of their coordinates.
    """
    distinct = sorted(set(points))
    if not distinct:
        return []
    x, y = distinct[0]
    far = max(distinct, key=lambda point: hypot(point[0] - x, point[1] - y))
    u, v = far[0] - x, far[1] - y
    if hypot(u, v) <= ONE_PLACE:
        return [distinct[0]]
    order = sorted(distinct, key=lambda point: (u * (point[0] - x) + v * (point[1] - y), point))
    straight = ROUND_OFF * (u**2 + v**2)

    def half(run: Sequence[Place]) -> list[Place]:
        chain: list[Place] = []
        for point in run:
            while len(chain) > 1 and _turn(chain[-2], chain[-1], point) <= straight:
                chain.pop()
            chain.append(point)
        return chain[:-1]

    return half(order) + half(order[::-1])


def rounded_hull(points: Iterable[Place], radius: float) -> tuple[Vertex, ...]:
    """The outline at this distance round the convex hull of points: its corners are arcs."""
    hull = convex_hull(points)
    if len(hull) == 1:
        ((x, y),) = hull
        return (x - radius, y, 1.0), (x + radius, y, 1.0)
    normals = [_outward(p, q) for p, q in zip(hull, [*hull[1:], hull[0]], strict=True)]
    found: list[Vertex] = []
    for index, (x, y) in enumerate(hull):
        (u, v), (a, b) = normals[index - 1], normals[index]
        angle = atan2(u * b - v * a, u * a + v * b) % (2.0 * pi)
        found.append((x + radius * u, y + radius * v, tan(angle / 4.0)))
        found.append((x + radius * a, y + radius * b, 0.0))
    return tuple(found)


def slot_outline(slot: Slot) -> tuple[Vertex, ...]:
    """A slot as a closed line."""
    return rounded_hull((slot.start, slot.end), slot.width / 2.0)


def sampled(loop: Sequence[Vertex], steps: int = 16) -> list[Place]:
    """The points of a closed line, its arcs in so many steps of half a turn."""
    found: list[Place] = []
    for (x, y, bulge), (u, v, _) in zip(loop, [*loop[1:], loop[0]], strict=True):
        found.append((x, y))
        if bulge:
            turn = 4.0 * _arctan(bulge)
            cx, cy = (x + u) / 2.0 - (v - y) / 2.0 / tan(turn / 2.0), (y + v) / 2.0 + (u - x) / 2.0 / tan(turn / 2.0)
            many = max(2, round(steps * abs(turn) / pi))
            for step in range(1, many):
                c, s = cos(turn * step / many), sin(turn * step / many)
                found.append((cx + c * (x - cx) - s * (y - cy), cy + s * (x - cx) + c * (y - cy)))
    return found


def room_within(loop: Sequence[Place], at: Place) -> float:
    """How far a place within a polygon is from it; below zero outside."""
    least, crossings = float("inf"), 0
    (x, y) = at
    for (u, v), (p, q) in zip(loop, [*loop[1:], loop[0]], strict=True):
        size = (p - u) ** 2 + (q - v) ** 2
        along = min(1.0, max(0.0, ((x - u) * (p - u) + (y - v) * (q - v)) / size)) if size else 0.0
        least = min(least, hypot(x - u - along * (p - u), y - v - along * (q - v)))
        if (v > y) != (q > y) and x < u + (y - v) / (q - v) * (p - u):
            crossings += 1
    return least if crossings % 2 else -least


def plate_area(plate: Plate) -> float:
    """The area of a plate (mm^2), of its straight edges and arcs."""
    holes = sum(pi * hole.diameter**2 / 4.0 for hole in plate.drilled)
    return _loop_area(plate.outline) - sum(_loop_area(loop) for loop in plate.loops[1:]) - holes


def _loop_area(loop: Sequence[Vertex]) -> float:
    """The area within a closed line: its polygon's, and the segments between arcs and their chords."""
    found = 0.0
    for (x, y, bulge), (u, v, _) in zip(loop, [*loop[1:], loop[0]], strict=True):
        found += (x * v - u * y) / 2.0
        if bulge:
            turn = 4.0 * _arctan(bulge)
            radius = hypot(u - x, v - y) / 2.0 / sin(turn / 2.0)
            found += radius * radius * (turn - sin(turn)) / 2.0
    return abs(found)


def moved_plate(plate: Plate, angle: float, x: float, y: float) -> Plate:
    """The plate turned (degrees) about the origin, then shifted."""
    c, s = cos(radians(angle)), sin(radians(angle))

    def place(at: Place) -> Place:
        return c * at[0] - s * at[1] + x, s * at[0] + c * at[1] + y

    def loop(vertices: tuple[Vertex, ...]) -> tuple[Vertex, ...]:
        return tuple((*place((u, v)), bulge) for u, v, bulge in vertices)

    return plate._replace(
        outline=loop(plate.outline),
        inside=tuple(loop(each) for each in plate.inside),
        holes=tuple(each._replace(at=place(each.at)) for each in plate.holes),
        slots=tuple(each._replace(start=place(each.start), end=place(each.end)) for each in plate.slots),
        core=tuple(place(each) for each in plate.core),
    )


def scaled_plate(plate: Plate, factor: float) -> Plate:
    """The plate with all lengths multiplied by a factor, as from millimetres to inches."""

    def place(at: Place) -> Place:
        return factor * at[0], factor * at[1]

    def loop(vertices: tuple[Vertex, ...]) -> tuple[Vertex, ...]:
        return tuple((factor * x, factor * y, bulge) for x, y, bulge in vertices)

    return plate._replace(
        outline=loop(plate.outline),
        inside=tuple(map(loop, plate.inside)),
        holes=tuple(hole._replace(at=place(hole.at), diameter=factor * hole.diameter) for hole in plate.holes),
        slots=tuple(
            slot._replace(start=place(slot.start), end=place(slot.end), width=factor * slot.width)
            for slot in plate.slots
        ),
        core=tuple(map(place, plate.core)),
        reach=factor * plate.reach,
    )


def plate_box(plates: Iterable[Plate]) -> tuple[float, float, float, float]:
    """The box round plates: left, lower, right and upper side."""
    points = [point for plate in plates for point in sampled(plate.outline, 64)]
    x, y = [point[0] for point in points], [point[1] for point in points]
    return min(x), min(y), max(x), max(y)


def _arctan(value: float) -> float:
    return atan2(value, 1.0)


def _turn(a: Place, b: Place, c: Place) -> float:
    return (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])


def _outward(p: Place, q: Place) -> Place:
    """The unit normal to the right of a way, outwards of a hull that goes anticlockwise."""
    size = hypot(q[0] - p[0], q[1] - p[1])
    return (q[1] - p[1]) / size, (p[0] - q[0]) / size
