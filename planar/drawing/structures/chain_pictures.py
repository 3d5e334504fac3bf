"""Kinematic chains as pictures: bars as lines, other links as plates, pins as circles, slides as blocks, numbers."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.drawing.paper.picture import Circle, Fill, Label, Mark, PaperPoint, Pen, Picture, Polyline, paper_point
from planar.foundation.arrays import Array
from planar.model.wording import count_phrase
from planar.structures.chain import Chain, ChainMechanism
from planar.structures.plane.layout import ChainLayout, lay_out_chain

LONGEST_LINE = 22.0
"""mm that a line is at most."""
JOINT_RADIUS = 0.9
BLOCK_SIZE = (3.2, 1.9)
"""mm, of a slide, along and across."""
NUMBER_SIZE, SMALL_NUMBER_SIZES, WIDE_PLATE = 6.0, (3.8, 5.0), 1.9
"""Points, of the numbers of links, and of those in plates in which a circle of this radius (mm) has no room."""
BESIDE_BAR, BAR_PARTS, GOOD_ROOM = 1.7, (0.5, 0.38, 0.62), 2.4
"""Where the number of a bar may stand: so far from it (mm), at these parts of its length; and how far from all else
there is room enough (mm)."""
HATCH_PITCH, HATCH_LENGTH = 1.3, 1.6
"""mm from one stroke of a fixed link's hatching to the next, and of one beside a bar."""
MAX_DRIVES_SHOWN = 6
"""Choices of driven joints that are told beneath a picture; of more how many there are."""
NO_BREAK = "\N{NO-BREAK SPACE}"
GRID_LINES = 40
"""Either way, of spots within a plate that are looked at for its number."""


class DrawnChain(NamedTuple):
    """A chain with the places of its joints."""

    chain: Chain
    layout: ChainLayout


def draw_chain(chain: Chain) -> DrawnChain:
    """A chain with places of its joints: without crossings where it has such, else with few."""
    return DrawnChain(chain, lay_out_chain(chain.links, chain.pins))


def chain_picture(drawn: DrawnChain, size: tuple[float, float]) -> Picture:
    """A chain on so much paper (mm), with what it is beneath."""
    return Picture(tuple(_marks(drawn, size)), chain_title(drawn.chain), tuple(_chain_notes(drawn)))


def inversion_picture(
    drawn: DrawnChain, frame: int, mechanisms: Sequence[ChainMechanism], size: tuple[float, float]
) -> Picture:
    """A chain with a link fixed, which is hatched; black are the joints by which its mechanisms are driven."""
    driven = {drawn.chain.pin_of(joint) for each in mechanisms for joint in each.drives}
    number = "" if drawn.chain.number is None else f"{drawn.chain.number}, "
    notes = [drawn.chain.inversion_name(frame) or drawn.chain.name, *_drive_notes(drawn.chain, mechanisms)]
    return Picture(
        tuple(_marks(drawn, size, frame, driven)), f"{number}link {frame} fixed", tuple(each for each in notes if each)
    )


def chain_title(chain: Chain) -> str:
    """Its number, and how many of its links are binary, ternary and so on."""
    number = "" if chain.number is None else f"{chain.number}: "
    return f"{number}{' + '.join(map(str, chain.assortment))}"


def _chain_notes(drawn: DrawnChain) -> Iterator[str]:
    chain = drawn.chain
    if chain.name:
        yield chain.name
    yield f"symmetry {chain.symmetry.order}, {count_phrase(len(chain.inversions), 'inversion')}"
    yield chain.describe_classes().replace(": ", f":{NO_BREAK}")
    told = ["fractionated"] if chain.is_fractionated else []
    told += [count_phrase(drawn.layout.crossings, "crossing")] if drawn.layout.crossings else []
    if told:
        yield ", ".join(told)


def _drive_notes(chain: Chain, mechanisms: Sequence[ChainMechanism]) -> Iterator[str]:
    """What drives it, each joint by its two links, with the class."""
    if not mechanisms:
        yield "no joints on it drive all links"
        return
    told = [
        " and ".join("{}-{}".format(*chain.edges[joint]) for joint in each.drives) + f":{NO_BREAK}{each.assur_class}"
        for each in mechanisms[:MAX_DRIVES_SHOWN]
    ]
    left = len(mechanisms) - len(told)
    yield "driven " + ", ".join(told) + (f", {left} more" if left else "")


def _marks(
    drawn: DrawnChain, size: tuple[float, float], frame: int | None = None, driven: Iterable[int] = ()
) -> Iterator[Mark]:
    layout = drawn.layout
    ends = np.array([pair for each in layout.rotations for pair in zip(each, (*each[1:], each[0]), strict=True)])
    longest = np.hypot(*(layout.places[ends[:, 0]] - layout.places[ends[:, 1]]).T).max()
    span = np.maximum(np.ptp(layout.places, axis=0), 1e-9)
    places = layout.places * min(size[0] / span[0], size[1] / span[1], LONGEST_LINE / longest)
    spots = [paper_point(place) for place in places]
    links = sorted(range(len(layout.rotations)), key=lambda link: (len(layout.rotations[link]) == 2, link))
    for link in links:
        corners = tuple(spots[joint] for joint in layout.rotations[link])
        is_plate = len(corners) > 2
        fill = Fill.NONE if link == frame or not is_plate else Fill.LINK
        if link == frame:
            shape = places[list(layout.rotations[link])]
            strokes = _plate_hatching(shape) if is_plate else _bar_hatching(shape, places)
            for stroke in strokes:
                yield Polyline(stroke, Pen.HATCH, f"link {link} fixed")
        yield Polyline(corners, Pen.LINK, f"link {link}", closed=is_plate, fill=fill)
    black = {*driven}
    slides = {drawn.chain.pin_of(joint) for joint in drawn.chain.slides}
    for number, spot in enumerate(spots):
        fill = Fill.SOLID if number in black else Fill.PAPER
        if number in slides:
            block = _block(number, drawn.chain.pins[number], layout.rotations, places)
            yield Polyline(block, Pen.PIN, f"joint {number}", closed=True, fill=fill)
        else:
            yield Circle(spot, JOINT_RADIUS, Pen.PIN, f"joint {number}", fill)
    yield from _numbers(layout.rotations, places)


def _numbers(rotations: Sequence[Sequence[int]], places: Array) -> Iterator[Label]:
    """The numbers of links: of plates within them, of bars beside them on the side where there is more room."""
    shapes = [places[list(joints)] for joints in rotations]
    sides = [
        (link, *pair) for link, each in enumerate(shapes) for pair in zip(np.roll(each, 1, axis=0), each, strict=True)
    ]
    spots: dict[int, Array] = {}
    rooms = dict.fromkeys(range(len(shapes)), WIDE_PLATE)
    for link, corners in enumerate(shapes):
        if len(corners) > 2:
            spots[link], rooms[link] = _widest_spot(corners)
    for link, corners in enumerate(shapes):
        if len(corners) == 2:
            beside = _spots_beside(corners[0], corners[1], places.mean(axis=0))
            room = np.full(len(beside), GOOD_ROOM)
            for other, one, two in sides:
                if other != link:
                    room = np.minimum(room, _distances(beside, one, two))
            for spot in spots.values():
                room = np.minimum(room, np.hypot(*(beside - spot).T) - 0.5 * GOOD_ROOM)
            spots[link] = beside[int(np.argmax(room))]
    for link, spot in sorted(spots.items()):
        share = rooms[link] / WIDE_PLATE
        size = NUMBER_SIZE if share >= 1.0 else float(np.clip(share * NUMBER_SIZE, *SMALL_NUMBER_SIZES))
        yield Label(str(link), paper_point(spot), f"link {link}", size, clearance=0.3)


def _spots_beside(one: Array, other: Array, middle: Array) -> Array:
    """Spots (n, 2) near a bar, at its middle first, on that side first that is farther from the middle of all."""
    way = other - one
    out = np.array([-way[1], way[0]]) / np.hypot(*way)
    if out @ (0.5 * (one + other) - middle) < 0.0:
        out = -out
    return np.array([one + part * way + side * BESIDE_BAR * out for part in BAR_PARTS for side in (1.0, -1.0)])


def _distances(spots: Array, one: Array, other: Array) -> Array:
    """How far spots (n, 2) are from a line from one point to another (n,)."""
    way = other - one
    part = np.clip((spots - one) @ way / (way @ way), 0.0, 1.0)
    distances: Array = np.hypot(*(spots - one - part[:, None] * way).T)
    return distances


def _block(
    joint: int, ends: Sequence[int], rotations: Sequence[Sequence[int]], places: Array
) -> tuple[PaperPoint, ...]:
    """The corners of a slide, which lies along that of its links that has fewer joints."""
    link = min(ends, key=lambda each: len(rotations[each]))
    others = [each for each in rotations[link] if each != joint]
    way = places[others].mean(axis=0) - places[joint]
    way = way / max(float(np.hypot(*way)), 1e-9) * 0.5
    along, across = BLOCK_SIZE[0] * way, BLOCK_SIZE[1] * np.array([-way[1], way[0]])
    corners = (along + across, across - along, -along - across, along - across)
    return tuple(paper_point(places[joint] + each) for each in corners)


def _widest_spot(corners: Array) -> tuple[Array, float]:
    """The middle of the largest circle within a plate, and its radius (mm)."""
    low, high = corners.min(axis=0), corners.max(axis=0)
    grid = np.linspace(low, high, GRID_LINES)
    spots = np.stack(np.meshgrid(*grid.T), axis=-1).reshape(-1, 2)
    nearest, inside = np.full(len(spots), np.inf), np.zeros(len(spots), dtype=bool)
    for one, other in zip(np.roll(corners, 1, axis=0), corners, strict=True):
        nearest = np.minimum(nearest, _distances(spots, one, other))
        if one[1] != other[1]:
            across = one[0] + (spots[:, 1] - one[1]) / (other - one)[1] * (other - one)[0]
            inside ^= ((one[1] > spots[:, 1]) != (other[1] > spots[:, 1])) & (spots[:, 0] < across)
    best = int(np.argmax(np.where(inside, nearest, 0.0)))
    return spots[best], float(nearest[best])


Segment = tuple[PaperPoint, PaperPoint]


def _plate_hatching(corners: Array) -> Iterator[Segment]:
    """Slanted lines within a plate, whatever its shape."""
    across, along = np.array([1.0, -1.0]) / np.sqrt(2.0), np.array([1.0, 1.0]) / np.sqrt(2.0)
    depth, far = corners @ across, corners @ along
    for level in np.arange(depth.min() + HATCH_PITCH / 2.0, depth.max(), HATCH_PITCH):
        cuts = []
        for one, other in zip(range(-1, len(corners) - 1), range(len(corners)), strict=True):
            if (depth[one] > level) != (depth[other] > level):
                part = (level - depth[one]) / (depth[other] - depth[one])
                cuts.append(far[one] + part * (far[other] - far[one]))
        cuts.sort()
        for start, stop in zip(cuts[::2], cuts[1::2], strict=True):
            yield paper_point(level * across + start * along), paper_point(level * across + stop * along)


def _bar_hatching(ends: Array, places: Array) -> Iterator[Segment]:
    """Slanted strokes on that side of a bar on which the nearest joint is farther."""
    way = ends[1] - ends[0]
    length = np.hypot(*way)
    way = way / length
    left = np.array([-way[1], way[0]])
    off = places - ends[0]
    beside = np.abs(off @ way / length - 0.5) < 1.0
    heights = off[beside] @ left
    above, below = heights[heights > 1e-6], -heights[heights < -1e-6]
    side = left if min(above, default=np.inf) >= min(below, default=np.inf) else -left
    count = max(2, int((length - 2.0 * JOINT_RADIUS) / HATCH_PITCH))
    for part in (np.arange(count) + 0.7) / count:
        foot = ends[0] + way * (JOINT_RADIUS + part * (length - 2.0 * JOINT_RADIUS))
        yield paper_point(foot), paper_point(foot + HATCH_LENGTH / np.sqrt(2.0) * (side - way))
