"""Dimensions for a chain with a frame and inputs: random ones that go together, of which a search takes the best.

Where the joints stand is drawn at random, which puts the linkage together, and what the input drives is drawn smaller
and smaller about its pivot, since a short crank moves the rest little. All candidates run through one turn together; of
those whose crank turns fully that one is taken whose joints go far with little acceleration, else that one which turns
farthest.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations, count, islice, product
from math import atan2, degrees
from string import ascii_uppercase
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.model.pin_linkage import turning_pair_type

SPREADS = 16
"""Random places of all joints, of which those are taken that lie farthest apart."""
CRANK_SIZES = (0.45, 0.3, 0.2, 0.12)
"""Of the distance across all joints: how far what is driven reaches from its pivot, from candidate to candidate."""
LENGTH = 400.0
"""mm from side to side of what is drawn."""
DIGITS = 0
"""Of a millimetre, behind the point, of where joints stand."""
VELOCITY = "60 rpm"


class Linkage(NamedTuple):
    """A structure as a linkage: of each joint the two links that it joins; the fixed link, and the driven joints."""

    joints: tuple[tuple[int, int], ...]
    frame: int
    drives: tuple[int, ...]

    @property
    def link_count(self) -> int:
        """How many links there are, the frame among them."""
        return 1 + max(map(max, self.joints))

    def joints_of(self, link: int) -> list[int]:
        """The joints of a link."""
        return [k for k, links in enumerate(self.joints) if link in links]

    def driven_link(self, drive: int) -> int:
        """The link that a joint drives: that which is not the frame, between moving links the second."""
        first, second = self.joints[drive]
        return first if second == self.frame else second


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
        pivot = np.array([each.drives[k] for each in linkages])
        driven = np.zeros((many, joints), dtype=bool)
        for row, each in enumerate(linkages):
            driven[row, each.joints_of(each.driven_link(each.drives[k]))] = True
        off = places - places[every, pivot][:, None]
        reach = np.where(driven, np.linalg.norm(off, axis=-1), 0.0).max(axis=1)
        shorter = places[every, pivot][:, None] + off * (sizes / reach)[:, None, None]
        places = np.where(driven[..., None], shorter, places)
    return places


def linkage_document(linkage: Linkage, places: Array, name: str) -> dict[str, Any]:
    """The file of a linkage whose joints stand at places (joints, 2), as `candidate_places` has them: in mm, rounded,
    with links named by their joints."""
    places = np.round(0.5 * LENGTH * (places - places[linkage.drives[0]]), DIGITS)
    names = list(islice(joint_names(), len(linkage.joints)))
    links, cranks = {}, {linkage.driven_link(drive): drive for drive in linkage.drives}
    named, axes = {linkage.frame: "frame"}, {linkage.frame: 0.0}
    for link in range(linkage.link_count):
        own = linkage.joints_of(link)
        if link == linkage.frame:
            links["frame"] = {"points": {names[k]: [float(x) for x in places[k]] for k in own}}
            continue
        if link in cranks:  # its angle is that of the line from its pivot
            own = [cranks[link], *(k for k in own if k != cranks[link])]
        along = places[own[1]] - places[own[0]]
        named[link], axes[link] = "".join(names[k] for k in own), degrees(atan2(along[1], along[0]))
        links[named[link]] = _link_entry([names[k] for k in own], places[own])
    inputs: list[dict[str, Any]] = []
    pairs: list[dict[str, Any]] = [{turning_pair_type().keyword: each} for each in names]
    for drive in linkage.drives:
        second = linkage.driven_link(drive)
        first = next(each for each in linkage.joints[drive] if each != second)
        if first != linkage.frame:
            pairs[drive]["links"] = [named[first], named[second]]
        turned = (axes[second] - axes[first] + 180.0) % 360.0 - 180.0
        inputs.append({"pair": names[drive], "position": round(turned, 1)} | ({} if inputs else {"velocity": VELOCITY}))
    moving = [k for k, links_of in enumerate(linkage.joints) if linkage.frame not in links_of]
    return {
        "planar": 1,
        "name": name,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": links,
        "pairs": pairs,
        "inputs": inputs,
        "sketch": {names[k]: [float(x) for x in places[k]] for k in moving},
    }


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
