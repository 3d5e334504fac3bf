"""What stands still of a mechanism as strokes on paper: supports, fixed guides, racks and wheels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import pi
from typing import Self

import numpy as np

from planar.drawing.paper.picture import Arrow, Circle, Mark, Outline, Pen, Polyline, paper_point
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme import symbol_table, symbols
from planar.drawing.scheme.link_bodies import LinkBody, distance_between, unit_vector
from planar.drawing.scheme.link_strokes import bar_strokes, cylinder_strokes, rack_contact, rack_strokes
from planar.drawing.scheme.scene import Scene, TravelRanges
from planar.drawing.scheme.spring_mass_strokes import spring_strokes
from planar.drawing.scheme.springs_masses import Coil
from planar.foundation.geometry import Frame, Vector
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import BeltMark, GuideMark, PinMark, PitchLineMark, SliderMark, SlotMark, WheelMark

FIXED_GUIDE_OVERHANG = symbol_table.BLOCK_SIZE[0] / 2.0 + 2.0
"""mm: how far a fixed guide goes on beyond the middle of a block at the end of its travel."""
GUIDE_LIFT = 0.8
"""mm: how far a guide may be off its block, where a rack lies between them."""
SAME_POINT_TOLERANCE = 0.05
"""mm: places nearer than this are one."""
UPRIGHT_DIRECTIONS = (Vector(0, -1), Vector(-1, 0), Vector(1, 0), Vector(0, 1))
SLANTED_DIRECTIONS = tuple(Vector(x / 2**0.5, y / 2**0.5) for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1)))


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

    `beside` are further strokes to be clear of, such as the links in other positions.
    """
    return fixed_marks(Scene(mechanism, bodies, frames, shapes, scale, travel or {}), obstacles)


def fixed_marks(scene: Scene, obstacles: Iterable[Mark] = ()) -> tuple[Outline, ...]:
    """Supports, guides, racks and wheels of the frame, clear of the links and of further strokes where that can be."""
    frame = scene.mechanism.frame
    made: list[Outline] = []
    taken = [
        pin
        for mark in scene.marks
        if isinstance(mark, PinMark) and frame in mark.links
        for pin in symbols.symbol_marks("pin", "", scene.to_paper(frame, mark.positions[mark.links.index(frame)]))
    ]
    moving = (
        *bar_strokes(scene, Pen.LINK),
        *cylinder_strokes(scene, Pen.LINK),
        *rack_strokes(scene),
        *spring_strokes(scene),
    )
    clear = Clearance.from_marks((*moving, *taken, *obstacles))
    middle = clear.centre()
    wheels: set[tuple[Vector | float, ...]] = set()
    banded = {mark.name for mark in scene.marks if isinstance(mark, BeltMark)}
    for mark in scene.marks:
        if isinstance(mark, WheelMark) and mark.link == frame and mark[2:] not in wheels:
            wheels.add(mark[2:])
            at, radius = scene.to_paper(frame, mark.centre), scene.scale.on_paper(mark.radius)
            if mark.name in banded:
                made += symbols.rim_hatching(at, radius, f"band {mark.name}")
            else:
                made += symbols.fixed_wheel(at, radius, f"gear {mark.name}")
        elif isinstance(mark, PitchLineMark) and mark.link == frame:
            at, way, back, half = rack_contact(scene, mark)
            low, high = _guide_extent(scene, mark.name, mark.through, mark.direction, half)
            made += symbols.rail(at + way * low, at + way * high, back, f"guide {mark.name}")
    clear = clear.with_marks(made)
    for mark in scene.marks:
        if isinstance(mark, GuideMark | SlotMark | SliderMark) and mark.link == frame:
            strokes = tuple(_fixed_guide_strokes(scene, mark, clear, middle))
            made += strokes
            clear = clear.with_marks(strokes)
    drawn: set[str] = set()
    for mark in scene.marks:
        if isinstance(mark, PinMark) and frame in mark.links and mark.name not in drawn:
            drawn.add(mark.name)
            at = scene.to_paper(frame, mark.positions[mark.links.index(frame)])
            strokes = tuple(symbols.symbol_marks("support", f"ground {mark.name}", at, clear.support_direction(at)))
            made += strokes
            clear = clear.with_marks(strokes)
    for name, at in _spring_anchors(scene, taken):
        strokes = tuple(symbols.symbol_marks("support", f"ground of {name}", at, clear.support_direction(at)))
        made += strokes
        clear = clear.with_marks(strokes)
    return tuple(made)


def _spring_anchors(scene: Scene, pins: Sequence[Outline]) -> Iterator[tuple[str, Vector]]:
    """Where springs hang on the frame, but at its pins; once where several do."""
    met = [Vector(*pin.centre) for pin in pins if isinstance(pin, Circle)]
    for mark in scene.marks:
        if isinstance(mark, Coil):
            for link, place in zip(mark.links, mark.at, strict=True):
                at = scene.to_paper(link, place)
                if link == scene.mechanism.frame and all(
                    distance_between(at, other) > SAME_POINT_TOLERANCE for other in met
                ):
                    met.append(at)
                    yield mark.name, at


def _guide_extent(scene: Scene, name: str, through: Vector, way: Vector, half: float) -> tuple[float, float]:
    """From where to where a fixed line is drawn, from beside what runs along it (mm)."""
    frame = scene.mechanism.frame
    here = scene.displacement_along(name, frame, through, way)
    low, high = scene.travel_range(name, frame, through, through, way)
    paper = scene.scale.on_paper
    return min(paper(min(low, here) - here) - FIXED_GUIDE_OVERHANG, -half), max(
        paper(max(high, here) - here) + FIXED_GUIDE_OVERHANG, half
    )


def _fixed_guide_strokes(
    scene: Scene, mark: GuideMark | SlotMark | SliderMark, clear: Clearance, middle: Vector
) -> Iterator[Outline]:
    """A hatched line beneath a block; round a pin a slot; a fixed block, through which a link slides."""
    about = f"guide {mark.name}"
    half = symbol_table.BLOCK_SIZE[1] / 2.0
    if isinstance(mark, SliderMark):
        at, way = scene.to_paper(mark.link, mark.position), scene.direction_on_paper(mark.link, mark.direction)
        low, high = -symbol_table.BLOCK_SIZE[0] / 2.0 - 1.0, symbol_table.BLOCK_SIZE[0] / 2.0 + 1.0
    else:
        rider, point = scene.running_point(mark.name) or (mark.link, mark.through)
        at, way = scene.to_paper(rider, point), scene.direction_on_paper(mark.link, mark.direction)
        room = symbol_table.RAIL_LENGTH / 2.0 if mark.name not in scene.travel else 0.0
        low, high = _guide_extent(scene, mark.name, mark.through, mark.direction, room)
        if isinstance(mark, SlotMark):
            half = symbol_table.SLOT_SIZE[1] / 2.0
            across = symbols.quarter_turn(way) * half
            for side in (across, across * -1.0):
                yield symbols.stroke(about, Pen.GROUND, at + way * low + side, at + way * high + side)
    side, off = clear.hatching_side(at, way, low, high, half, middle)
    for start, stop in _rail_segments(scene, mark, at, way, low, high):
        yield from symbols.rail(at + way * start + side * off, at + way * stop + side * off, side, about)


def _rail_segments(
    scene: Scene, mark: GuideMark | SlotMark | SliderMark, at: Vector, way: Vector, low: float, high: float
) -> list[tuple[float, float]]:
    """A rail along a line (mm from its block), with gaps for the supports of fixed pins that lie on its way."""
    frame, pieces = scene.mechanism.frame, [(low, high)]
    room = symbol_table.SUPPORT_WIDTH / 2.0 + 1.0
    for pin in scene.marks:
        if isinstance(pin, PinMark) and frame in pin.links:
            off = scene.to_paper(frame, pin.positions[pin.links.index(frame)]) - at
            here, beside = off.dot(way), abs(way.cross(off))
            under = mark.name not in scene.travel and abs(here) < room + symbol_table.BLOCK_SIZE[0] / 2.0
            if beside < symbol_table.SUPPORT_HEIGHT + symbol_table.HATCH_LENGTH and not under:
                cut = [(start, min(stop, here - room)) for start, stop in pieces]
                cut += [(max(start, here + room), stop) for start, stop in pieces]
                pieces = [(start, stop) for start, stop in cut if stop - start > symbol_table.HATCH_LENGTH]
    return pieces or [(low, high)]


@dataclass(frozen=True)
class Clearance:
    """Points of strokes (n, 2) in mm, from which the freest side for a symbol is told."""

    points: np.ndarray

    @classmethod
    def from_marks(cls, marks: Iterable[Mark]) -> Self:
        """Strokes as points at most half a millimetre apart."""
        rows = [np.zeros((0, 2))]
        for mark in marks:
            if isinstance(mark, Circle):
                turns = np.radians(np.linspace(mark.start, mark.stop, 2 + int(4.0 * pi * mark.radius)))
                rows.append(np.array(mark.centre) + mark.radius * np.stack([np.cos(turns), np.sin(turns)], axis=1))
            elif isinstance(mark, Polyline | Arrow):
                spots = mark.points if isinstance(mark, Polyline) else (mark.tail, mark.head)
                closing = spots[:1] if isinstance(mark, Polyline) and mark.closed else ()
                for a, b in pairwise(np.array((*spots, *closing))):
                    parts = np.linspace(0.0, 1.0, 2 + int(np.hypot(*(b - a)) / 0.5))
                    rows.append(a + (b - a) * parts[:, None])
        return cls(np.concatenate(rows))

    def with_marks(self, marks: Iterable[Mark]) -> Self:
        """The same with more strokes."""
        return type(self)(np.concatenate([self.points, self.from_marks(marks).points]))

    def centre(self) -> Vector:
        """The middle of all strokes."""
        if not len(self.points):
            return Vector(0.0, 0.0)
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return Vector(*map(float, (low + high) / 2.0))

    def count_in_box(self, at: Vector, way: Vector, low: Vector, high: Vector) -> int:
        """How many points lie in a box: from `low` to `high` along a unit vector and to its left."""
        off = self.points - np.array(paper_point(at))
        along = off @ np.array(paper_point(way))
        left = off @ np.array(paper_point(symbols.quarter_turn(way)))
        return int(np.sum((along > low.x) & (along < high.x) & (left > low.y) & (left < high.y)))

    def count_near_arc(self, at: Vector, radius: float, middle: float, sweep: float) -> int:
        """How many points lie near an arc about a place (mm, rad)."""
        off = self.points - np.array(paper_point(at))
        turned = (np.arctan2(off[:, 1], off[:, 0]) - middle + np.pi) % (2.0 * np.pi) - np.pi
        near = np.abs(np.hypot(off[:, 0], off[:, 1]) - radius) < 1.3
        return int(np.sum(near & (np.abs(turned) < sweep / 2.0 + 0.15)))

    def support_direction(self, at: Vector) -> Vector:
        """Which way a support stands best: downwards, unless strokes are there."""
        centre = np.array(paper_point(at))

        def price(index: int, down: Vector) -> tuple[float, int]:
            off = self.points - centre
            along, left = off @ np.array(paper_point(down)), off @ np.array(paper_point(symbols.quarter_turn(down)))
            inside = (along > 1.4) & (along < symbol_table.SUPPORT_HEIGHT + symbol_table.HATCH_LENGTH + 0.8)
            inside &= np.abs(left) < np.minimum(1.0 + 0.7 * along, symbol_table.SUPPORT_WIDTH / 2.0 + 0.5)
            return float(np.sum(inside)) + 1.5 * (index > 0) + 1.5 * (index > 3), index

        ways = [*UPRIGHT_DIRECTIONS, *SLANTED_DIRECTIONS]
        return ways[min(range(len(ways)), key=lambda index: price(index, ways[index]))]

    def hatching_side(
        self, at: Vector, way: Vector, low: float, high: float, half: float, middle: Vector
    ) -> tuple[Vector, float]:
        """On which side of a line, and how far off, its hatching is clearest; else below, else away from the middle."""
        left = unit_vector(symbols.quarter_turn(way))

        def price(choice: tuple[float, float]) -> tuple[float, float, float]:
            sign, off = choice
            near, far = sorted((sign * (off - 0.25), sign * (off + symbol_table.HATCH_LENGTH + 1.0)))
            lifted = 1.0 * (off > half)
            crowded = self.count_in_box(at, way, Vector(low, near), Vector(high, far)) + lifted
            side = left * sign
            return crowded, side.y if abs(side.y) > 0.5 else 0.0, (middle - at).dot(side)

        sign, off = min(product((1.0, -1.0), (half, half + GUIDE_LIFT)), key=price)
        return left * sign, off
