"""Dimensions for a chain with a frame and inputs: random ones that go together, of which a search takes the best.

Where the joints stand is drawn at random, which puts the linkage together, and what the input drives is drawn smaller
and smaller about its pivot, since a short crank moves the rest little. All candidates run through one turn together; of
those whose crank turns fully that one is taken whose joints go far with little acceleration, else that one which turns
farthest. A slide stands where a pin of a link with no other joint stands, where there is one, as on a piston; the way
along which it slides is drawn, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, count, islice, product
from math import atan2, degrees
from string import ascii_uppercase
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.model.pin_linkage import sliding_pair_type, turning_pair_type

SPREADS = 16
"""Random places of all joints, of which those are taken that lie farthest apart."""
CRANK_SIZES = (0.45, 0.3, 0.2, 0.12)
"""Of the distance across all joints: how far what is driven reaches from its pivot, from candidate to candidate."""
LENGTH = 400.0
"""mm from side to side of what is drawn."""
DIGITS = 0
"""Of a millimetre, behind the point, of where joints stand."""
VELOCITY, SLIDING_VELOCITY = "60 rpm", "0.1 m/s"
WAY_STEP, WAYS = 5.0, 36
"""Degrees from one way of a slide that may be drawn to the next, and how many there are."""
SLIDE_LENGTH = 120.0
"""mm along a slide's line from the point from which it counts to where it is drawn."""


class Linkage(NamedTuple):
    """A structure as a linkage: of each joint the links that it joins, two or, on a pin, more; the fixed link, and the
    driven joints; which joints slide. `drive_ends` are the two links of each drive where joints have more."""

    joints: tuple[tuple[int, ...], ...]
    frame: int
    drives: tuple[int, ...]
    slides: tuple[int, ...] = ()
    drive_ends: tuple[tuple[int, int], ...] = ()

    @property
    def link_count(self) -> int:
        """How many links there are, the frame among them."""
        return 1 + max(map(max, self.joints))

    def joints_of(self, link: int) -> list[int]:
        """The joints of a link."""
        return [k for k, links in enumerate(self.joints) if link in links]

    def driven_link(self, drive: int) -> int:
        """The link that an input drives, by its place among the drives."""
        return self.ends_of(drive)[1]

    def ends_of(self, drive: int) -> tuple[int, int]:
        """The link against which an input drives, and that which it drives: not the frame, between moving links the
        second."""
        first, second = self.drive_ends[drive] if self.drive_ends else self.joints[self.drives[drive]]
        return (second, first) if second == self.frame else (first, second)

    def pin_beside(self, slide: int) -> tuple[int, int] | None:
        """A link that has nothing but this slide and a pin, if there is one, and that pin: the pin stands for both."""
        for link in sorted(self.joints[slide], key=lambda link: link == self.frame):
            others = [joint for joint in self.joints_of(link) if joint != slide]
            if len(others) == 1 and others[0] not in self.slides:
                return link, others[0]
        return None


def joint_names() -> Any:
    """A, B, ..., Z, AA, AB, ..."""
    return ("".join(letters) for size in count(1) for letters in product(ascii_uppercase, repeat=size))


def candidate_places(linkages: Sequence[Linkage], random: np.random.Generator) -> Array:
    """Where the joints of linkages with as many joints stand at random (linkages, joints, 2), in a square of side 2."""
    many, joints = len(linkages), len(linkages[0].joints)
    drawn = random.uniform(-1.0, 1.0, (many, SPREADS, joints, 2))
    apart = np.linalg.norm(drawn[:, :, :, None] - drawn[:, :, None], axis=-1) + 9.0 * np.eye(joints)
    every = np.arange(many)
    places: Array = drawn[every, np.argmax(apart.min(axis=(2, 3)), axis=1)]
    sizes = random.choice(CRANK_SIZES, many)
    for k in range(len(linkages[0].drives)):
        if any(each.drives[k] in each.slides for each in linkages):
            continue
        pivot = np.array([each.drives[k] for each in linkages])
        driven = np.zeros((many, joints), dtype=bool)
        for row, each in enumerate(linkages):
            driven[row, each.joints_of(each.driven_link(k))] = True
        off = places - places[every, pivot][:, None]
        reach = np.where(driven, np.linalg.norm(off, axis=-1), 0.0).max(axis=1)
        shorter = places[every, pivot][:, None] + off * (sizes / reach)[:, None, None]
        places = np.where(driven[..., None], shorter, places)
    for row, each in enumerate(linkages):
        for slide in each.slides:
            beside = each.pin_beside(slide)
            if beside is not None:
                places[row, slide] = places[row, beside[1]]
    return places


def candidate_ways(linkage: Linkage, count: int, random: np.random.Generator) -> Array:
    """Along which ways the slides of a linkage run (count, slides), degrees from the frame's x-axis: no two alike."""
    ways: Array = WAY_STEP * np.array([random.choice(WAYS, len(linkage.slides), replace=False) for _ in range(count)])
    return ways


def linkage_document(linkage: Linkage, places: Array, name: str, ways: Sequence[float] | Array = ()) -> dict[str, Any]:
    """The file of a linkage whose joints stand at places (joints, 2), as `candidate_places` has them: in mm, rounded,
    with links named by their joints; its slides run along `ways` (degrees)."""
    places = np.round(0.5 * LENGTH * (places - places[linkage.drives[0]]), DIGITS)
    names = list(islice(joint_names(), len(linkage.joints)))
    slides = [_laid_slide(linkage, k, places, float(way), names) for k, way in zip(linkage.slides, ways, strict=True)]
    spots: dict[int, dict[str, Array]] = {link: {} for link in range(linkage.link_count)}
    for k, ends in enumerate(linkage.joints):
        for link in ends if k not in linkage.slides else ():
            spots[link][names[k]] = places[k]
    for each in slides:
        spots[each.guide].setdefault(each.through, each.start)
        spots[each.block].setdefault(each.point, each.place)
    links, cranks = {}, {linkage.driven_link(k): names[drive] for k, drive in enumerate(linkage.drives)}
    named, axes = {linkage.frame: "frame"}, {linkage.frame: 0.0}
    for link, own in spots.items():
        if link == linkage.frame:
            links["frame"] = {"points": {point: [float(x) for x in place] for point, place in own.items()}}
            continue
        # the angle of a crank is that of the line from its pivot
        order = sorted(own, key=lambda point: point != cranks.get(link))
        named[link] = "".join(sorted((names[k] for k in linkage.joints_of(link)), key=lambda k: k != cranks.get(link)))
        if len(order) == 1:
            axes[link] = next(each.way for each in slides if each.block == link)
            links[named[link]] = {"points": {order[0]: [0.0, 0.0]}}
            continue
        along = own[order[1]] - own[order[0]]
        axes[link] = degrees(atan2(along[1], along[0]))
        links[named[link]] = _link_entry(order, np.array([own[point] for point in order]))
    pairs: list[dict[str, Any]] = [{turning_pair_type().keyword: each} for each in names]
    for each in slides:
        pairs[each.joint] = _slide_entry(each, names[each.joint], named, axes)
    return {
        "planar": 1,
        "name": name,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": links,
        "pairs": pairs,
        "inputs": _inputs(linkage, pairs, named, axes, {names[each.joint]: each.position for each in slides}),
        "sketch": {
            point: [float(x) for x in place]
            for link, own in spots.items()
            for point, place in own.items()
            if point not in spots[linkage.frame]
        },
    }


class _LaidSlide(NamedTuple):
    """A slide in place: a point of the block on a line of the guide, which begins at a point of the guide (mm)."""

    joint: int
    guide: int
    block: int
    through: str
    start: Array
    point: str
    place: Array
    way: float

    @property
    def position(self) -> float:
        """How far it is drawn from where its line begins (mm)."""
        return round(float(np.hypot(*(self.place - self.start))), 1)


def _laid_slide(linkage: Linkage, joint: int, places: Array, way: float, names: Sequence[str]) -> _LaidSlide:
    """The block is the link that has but a pin beside the slide, else the second; the frame is the guide."""
    beside, ends = linkage.pin_beside(joint), linkage.joints[joint]
    block = ends[1] if beside is None else beside[0]
    if block == linkage.frame:
        block = next(link for link in ends if link != block)
    guide = next(link for link in ends if link != block)
    point = names[joint] if beside is None or beside[0] != block else names[beside[1]]
    if beside is not None and beside[0] == guide:
        return _LaidSlide(joint, guide, block, names[beside[1]], places[joint], point, places[joint], way)
    off = SLIDE_LENGTH * np.array([np.cos(np.radians(way)), np.sin(np.radians(way))])
    start = np.round(places[joint] - off, DIGITS)
    return _LaidSlide(joint, guide, block, f"{names[joint]}0", start, point, places[joint], way)


def _slide_entry(slide: _LaidSlide, name: str, named: dict[int, str], axes: dict[int, float]) -> dict[str, Any]:
    """What the file says of a slide."""
    line: dict[str, Any] = {"through": slide.through, "angle": _between(axes[slide.guide], slide.way)}
    entry = {
        sliding_pair_type().keyword: name,
        "links": [named[slide.guide], named[slide.block]],
        "line": line,
        "point": slide.point,
    }
    turn = _between(slide.way, axes[slide.block])
    return entry if turn == 0.0 else entry | {"turn": turn}


def _between(one: float, other: float) -> float:
    """From one angle to another, degrees from -180 on, rounded."""
    return round((other - one + 180.0) % 360.0 - 180.0, 1) + 0.0


def _inputs(
    linkage: Linkage,
    pairs: Sequence[dict[str, Any]],
    named: dict[int, str],
    axes: dict[int, float],
    slid: dict[str, float],
) -> list[dict[str, Any]]:
    """What the file says of the inputs, which are where they are drawn; the first runs. Pins between moving links, and
    those of several links, are given their links in order."""
    inputs: list[dict[str, Any]] = []
    for k, drive in enumerate(linkage.drives):
        pair: str = next(iter(pairs[drive].values()))
        first, second = linkage.ends_of(k)
        position = slid[pair] if pair in slid else _between(axes[first], axes[second])
        velocity = {"velocity": SLIDING_VELOCITY if pair in slid else VELOCITY}
        on_pin = linkage.joints[drive]
        if len(on_pin) > 2 or (first != linkage.frame and pair not in slid):
            others = [named[link] for link in on_pin if link not in (first, second)]
            pairs[drive].setdefault("links", [named[first], named[second], *others])
        if len(on_pin) > 2:
            order: list[str] = pairs[drive]["links"]
            ends = sorted((named[first], named[second]), key=order.index)
            pair = f"{pair}:{','.join(ends)}"
        inputs.append({"pair": pair, "position": position} | ({} if inputs else velocity))
    return inputs


def _link_entry(names: Sequence[str], places: Array) -> dict[str, Any]:
    """A bar by its length, a plate by coordinates along the line through its first two joints."""
    along = places[1] - places[0]
    length = float(np.hypot(*along))
    entry: dict[str, Any] = {"ends": [names[0], names[1]], "length": round(length, 1)}
    if len(names) > 2:
        x, y = along / length
        own = (places[2:] - places[0]) @ np.array([[x, -y], [y, x]])
        entry["points"] = {
            name: [round(float(each[0]), 1), round(float(each[1]), 1)]
            for name, each in zip(names[2:], own, strict=True)
        }
    return entry


def crossings(linkage: Linkage, places: Array) -> int:
    """How often bars cross in a drawing: that of sides of links that share no joint."""
    sides = [pair for link in range(linkage.link_count) for pair in combinations(linkage.joints_of(link), 2)]
    return sum(
        not {*one} & {*other} and _cross(*places[[*one]], *places[[*other]]) for one, other in combinations(sides, 2)
    )


def _cross(a: Array, b: Array, c: Array, d: Array) -> bool:
    def side(p: Array, q: Array, r: Array) -> float:
        return float((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0]))

    return side(a, b, c) * side(a, b, d) < 0.0 and side(c, d, a) * side(c, d, b) < 0.0
