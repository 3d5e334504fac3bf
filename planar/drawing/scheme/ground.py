"""What stands still of a mechanism as strokes on paper: supports, fixed guides, racks and wheels."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, product
from math import pi
from typing import Self

import numpy as np

from planar.drawing.paper.picture import Arrow, Circle, Line, Mark, Pen, spot
from planar.drawing.paper.scales import Scale
from planar.drawing.scheme import symbols
from planar.drawing.scheme.link_bodies import Body, apart, unit
from planar.drawing.scheme.link_strokes import bars, contact, cylinders, racks
from planar.drawing.scheme.scene import Scene, Travel
from planar.drawing.scheme.spring_mass_strokes import springs
from planar.drawing.scheme.springs_masses import Coil
from planar.foundation.geometry import Frame, Vector
from planar.model.link_shapes import Shape
from planar.model.mechanism import Mechanism
from planar.model.pairs.symbols import Band, Block, Guide, Opening, Pin, PitchLine, Wheel

BLOCK_END = symbols.BLOCK[0] / 2.0 + 2.0
"""mm: how far a fixed guide goes on beyond the middle of a block at the end of its travel."""
LIFT = 0.8
"""mm: how far a guide may be off its block, where a rack lies between them."""
SAME = 0.05
"""mm: places nearer than this are one."""
DOWN = (Vector(0, -1), Vector(-1, 0), Vector(1, 0), Vector(0, 1))
SLANTS = tuple(Vector(x / 2**0.5, y / 2**0.5) for x, y in ((-1, -1), (1, -1), (-1, 1), (1, 1)))


def ground_marks(
    mechanism: Mechanism,
    bodies: Mapping[str, Body],
    frames: Mapping[str, Frame],
    shapes: Mapping[str, Shape],
    scale: Scale,
    travel: Travel | None = None,
    beside: Iterable[Mark] = (),
) -> tuple[Mark, ...]:
    """What stands still: supports, fixed guides and wheels, turned so that they are clear of the links' position.

    `beside` are further strokes to be clear of, such as the links in other positions.
    """
    return fixed(Scene(mechanism, bodies, frames, shapes, scale, travel or {}), beside)


def fixed(scene: Scene, beside: Iterable[Mark] = ()) -> tuple[Mark, ...]:
    """Supports, guides, racks and wheels of the frame, clear of the links and of further strokes where that can be."""
    frame = scene.mechanism.frame
    made: list[Mark] = []
    taken = [
        symbols.pin(scene.place(frame, mark.at[mark.links.index(frame)]), "")
        for mark in scene.marks
        if isinstance(mark, Pin) and frame in mark.links
    ]
    moving = (*bars(scene, Pen.LINK), *cylinders(scene, Pen.LINK), *racks(scene), *springs(scene))
    clear = Clearance.of((*moving, *taken, *beside))
    middle = clear.middle()
    wheels: set[tuple[Vector | float, ...]] = set()
    banded = {mark.name for mark in scene.marks if isinstance(mark, Band)}
    for mark in scene.marks:
        if isinstance(mark, Wheel) and mark.link == frame and mark[2:] not in wheels:
            wheels.add(mark[2:])
            at, radius = scene.place(frame, mark.centre), scene.scale.on_paper(mark.radius)
            if mark.name in banded:
                made += symbols.rim_hatching(at, radius, f"band {mark.name}")
            else:
                made += symbols.fixed_wheel(at, radius, f"gear {mark.name}")
        elif isinstance(mark, PitchLine) and mark.link == frame:
            at, way, back, half = contact(scene, mark)
            low, high = _stretch(scene, mark.name, mark.through, mark.way, half)
            made += symbols.rail(at + way * low, at + way * high, back, f"guide {mark.name}")
    clear = clear.beside(made)
    for mark in scene.marks:
        on_frame = isinstance(mark, Guide | Opening) and mark.link == frame
        if on_frame or (isinstance(mark, Block) and mark.link == frame):
            strokes = tuple(_fixed_guide(scene, mark, clear, middle))
            made += strokes
            clear = clear.beside(strokes)
    drawn: set[str] = set()
    for mark in scene.marks:
        if isinstance(mark, Pin) and frame in mark.links and mark.name not in drawn:
            drawn.add(mark.name)
            at = scene.place(frame, mark.at[mark.links.index(frame)])
            strokes = symbols.support(at, clear.support(at), f"ground {mark.name}")
            made += strokes
            clear = clear.beside(strokes)
    for name, at in _hung(scene, taken):
        strokes = symbols.support(at, clear.support(at), f"ground of {name}")
        made += strokes
        clear = clear.beside(strokes)
    return tuple(made)


def _hung(scene: Scene, pins: Sequence[Circle]) -> Iterator[tuple[str, Vector]]:
    """Where springs hang on the frame, but at its pins; once where several do."""
    met = [Vector(*pin.centre) for pin in pins]
    for mark in scene.marks:
        if isinstance(mark, Coil):
            for link, place in zip(mark.links, mark.at, strict=True):
                at = scene.place(link, place)
                if link == scene.mechanism.frame and all(apart(at, other) > SAME for other in met):
                    met.append(at)
                    yield mark.name, at


def _stretch(scene: Scene, name: str, through: Vector, way: Vector, half: float) -> tuple[float, float]:
    """From where to where a fixed line is drawn, from beside what runs along it (mm)."""
    frame = scene.mechanism.frame
    here = scene.along(name, frame, through, way)
    low, high = scene.range(name, frame, through, through, way)
    paper = scene.scale.on_paper
    return min(paper(min(low, here) - here) - BLOCK_END, -half), max(paper(max(high, here) - here) + BLOCK_END, half)


def _fixed_guide(scene: Scene, mark: Guide | Opening | Block, clear: Clearance, middle: Vector) -> Iterator[Mark]:
    """A hatched line beneath a block; round a pin a slot; a fixed block, through which a link slides."""
    about = f"guide {mark.name}"
    half = symbols.BLOCK[1] / 2.0
    if isinstance(mark, Block):
        at, way = scene.place(mark.link, mark.at), scene.way(mark.link, mark.way)
        low, high = -symbols.BLOCK[0] / 2.0 - 1.0, symbols.BLOCK[0] / 2.0 + 1.0
    else:
        rider, point = scene.rider(mark.name) or (mark.link, mark.through)
        at, way = scene.place(rider, point), scene.way(mark.link, mark.way)
        room = symbols.RAIL / 2.0 if mark.name not in scene.travel else 0.0
        low, high = _stretch(scene, mark.name, mark.through, mark.way, room)
        if isinstance(mark, Opening):
            half = symbols.OPENING[1] / 2.0
            across = symbols.quarter(way) * half
            for side in (across, across * -1.0):
                yield symbols.line(about, Pen.GROUND, at + way * low + side, at + way * high + side)
    side, off = clear.side(at, way, low, high, half, middle)
    for start, stop in _pieces(scene, mark, at, way, low, high):
        yield from symbols.rail(at + way * start + side * off, at + way * stop + side * off, side, about)


def _pieces(
    scene: Scene, mark: Guide | Opening | Block, at: Vector, way: Vector, low: float, high: float
) -> list[tuple[float, float]]:
    """A rail along a line (mm from its block), with gaps for the supports of fixed pins that lie on its way."""
    frame, pieces = scene.mechanism.frame, [(low, high)]
    room = symbols.BASE / 2.0 + 1.0
    for pin in scene.marks:
        if isinstance(pin, Pin) and frame in pin.links:
            off = scene.place(frame, pin.at[pin.links.index(frame)]) - at
            here, beside = off.dot(way), abs(way.cross(off))
            under = mark.name not in scene.travel and abs(here) < room + symbols.BLOCK[0] / 2.0
            if beside < symbols.STAND + symbols.HATCH and not under:
                cut = [(start, min(stop, here - room)) for start, stop in pieces]
                cut += [(max(start, here + room), stop) for start, stop in pieces]
                pieces = [(start, stop) for start, stop in cut if stop - start > symbols.HATCH]
    return pieces or [(low, high)]


@dataclass(frozen=True)
class Clearance:
    """Points of strokes (n, 2) in mm, from which the freest side for a symbol is told."""

    points: np.ndarray

    @classmethod
    def of(cls, marks: Iterable[Mark]) -> Self:
        """Strokes as points at most half a millimetre apart."""
        rows = [np.zeros((0, 2))]
        for mark in marks:
            if isinstance(mark, Circle):
                turns = np.radians(np.linspace(mark.start, mark.stop, 2 + int(4.0 * pi * mark.radius)))
                rows.append(np.array(mark.centre) + mark.radius * np.stack([np.cos(turns), np.sin(turns)], axis=1))
            elif isinstance(mark, Line | Arrow):
                spots = mark.spots if isinstance(mark, Line) else (mark.tail, mark.head)
                closing = spots[:1] if isinstance(mark, Line) and mark.closed else ()
                for a, b in pairwise(np.array((*spots, *closing))):
                    parts = np.linspace(0.0, 1.0, 2 + int(np.hypot(*(b - a)) / 0.5))
                    rows.append(a + (b - a) * parts[:, None])
        return cls(np.concatenate(rows))

    def beside(self, marks: Iterable[Mark]) -> Self:
        """The same with more strokes."""
        return type(self)(np.concatenate([self.points, self.of(marks).points]))

    def middle(self) -> Vector:
        """The middle of all strokes."""
        if not len(self.points):
            return Vector(0.0, 0.0)
        low, high = self.points.min(axis=0), self.points.max(axis=0)
        return Vector(*map(float, (low + high) / 2.0))

    def crowd(self, at: Vector, way: Vector, low: Vector, high: Vector) -> int:
        """How many points lie in a box: from `low` to `high` along a unit vector and to its left."""
        off = self.points - np.array(spot(at))
        along = off @ np.array(spot(way))
        left = off @ np.array(spot(symbols.quarter(way)))
        return int(np.sum((along > low.x) & (along < high.x) & (left > low.y) & (left < high.y)))

    def ring(self, at: Vector, radius: float, middle: float, sweep: float) -> int:
        """How many points lie near an arc about a place (mm, rad)."""
        off = self.points - np.array(spot(at))
        turned = (np.arctan2(off[:, 1], off[:, 0]) - middle + np.pi) % (2.0 * np.pi) - np.pi
        near = np.abs(np.hypot(off[:, 0], off[:, 1]) - radius) < 1.3
        return int(np.sum(near & (np.abs(turned) < sweep / 2.0 + 0.15)))

    def support(self, at: Vector) -> Vector:
        """Which way a support stands best: downwards, unless strokes are there."""
        centre = np.array(spot(at))

        def price(index: int, down: Vector) -> tuple[float, int]:
            off = self.points - centre
            along, left = off @ np.array(spot(down)), off @ np.array(spot(symbols.quarter(down)))
            inside = (along > 1.4) & (along < symbols.STAND + symbols.HATCH + 0.8)
            inside &= np.abs(left) < np.minimum(1.0 + 0.7 * along, symbols.BASE / 2.0 + 0.5)
            return float(np.sum(inside)) + 1.5 * (index > 0) + 1.5 * (index > 3), index

        ways = [*DOWN, *SLANTS]
        return ways[min(range(len(ways)), key=lambda index: price(index, ways[index]))]

    def side(
        self, at: Vector, way: Vector, low: float, high: float, half: float, middle: Vector
    ) -> tuple[Vector, float]:
        """On which side of a line, and how far off, its hatching is clearest; else below, else away from the middle."""
        left = unit(symbols.quarter(way))

        def price(choice: tuple[float, float]) -> tuple[float, float, float]:
            sign, off = choice
            near, far = sorted((sign * (off - 0.25), sign * (off + symbols.HATCH + 1.0)))
            lifted = 1.0 * (off > half)
            crowded = self.crowd(at, way, Vector(low, near), Vector(high, far)) + lifted
            side = left * sign
            return crowded, side.y if abs(side.y) > 0.5 else 0.0, (middle - at).dot(side)

        sign, off = min(product((1.0, -1.0), (half, half + LIFT)), key=price)
        return left * sign, off
