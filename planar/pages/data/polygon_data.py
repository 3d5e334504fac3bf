"""Velocity and acceleration polygons as a page carries them: their points, and the strokes between these.

It is one general rule, which holds at every position: from the pole an arrow to the image of each joint of a link that
has a point at rest, or that slides on the frame; between the images of a link's joints the relative vectors, of
accelerations with their parts; the image of a whole link; below what slides the guide's own point (B′), with the
relative velocity along it. Where a link's joints lie about one another is that of the file's dimensions.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from itertools import pairwise
from typing import Any

from planar.analysis.polygons.lettering import PRIME, legend, small_letters
from planar.analysis.rich_text import with_double_primes
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.geometry import Vector
from planar.model.mechanism import Mechanism, named_points

POLE = 0
"""The number of the pole among the points of a polygon."""
POLE_LETTER = "o"
"""Of the pole, where no point of the mechanism is at rest."""
IN_LINE_RATIO = 1e-9
"""Of the square of their spread: places off a line by less lie on it."""


def polygon_data(mechanism: Mechanism, points: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The points of polygons, their strokes by these points' numbers, and what letters stand for.

    `points` are those of `page_data`; those of outlines have no place in polygons. A polygon's point is that of the
    mechanism (`point`), whose velocity it has, fixed or not, or one of a guide (`link`) below a point that slides
    (`over`). A stroke goes `from` a point `to` another; it is an `image`, or a vector from the pole (`absolute`) or
    between two points (`relative`). That of two points of one `link` has a part along their line and one across, of
    which the first ends in what is lettered `end`. `legends` say what letters stand for, without such ends and with
    them.
    """
    frame, letters = mechanism.frame, small_letters(points)
    rests = any(frame in each["links"] for each in points.values())
    vertices: list[dict[str, Any]] = [{"letter": "" if rests else POLE_LETTER, "fixed": True}]
    place = {}
    for name, point in points.items():
        if "is_outline" in point:
            continue
        place[name] = len(vertices)
        vertices.append({"letter": letters[name], "point": name, "fixed": frame in point["links"]})
    riders, own, below = _riders(mechanism), {}, {}
    for rider, guide in riders:
        if guide == frame or (rider, guide) in own:
            continue
        letter = _free_letter(letters[rider], {each["letter"] for each in vertices[1:]})
        below[letter] = (guide, rider)
        own[rider, guide] = len(vertices)
        vertices.append({"letter": letter, "link": guide, "over": rider, "fixed": False})
    strokes = [_vector(vertices, own.get((rider, guide), POLE), place[rider]) for rider, guide in riders]
    shapes = shapes_of_links(mechanism)
    carried: defaultdict[str, list[tuple[str, str]]] = defaultdict(list)
    for named in named_points(mechanism):
        for carrier, link_point in named.members:
            if named.name in place:
                carried[carrier].append((named.name, link_point))
    for link in (each.name for each in mechanism.links if each.name != frame):
        members = {
            place[name]: Vector(*map(float, shapes[link].position(link_point))) for name, link_point in carried[link]
        }
        joints = [each for each in members if len(points[vertices[each]["point"]]["links"]) > 1]
        guided = [number for (_, guide), number in own.items() if guide == link]
        strokes += (_vector(vertices, *ends, link) for ends in _vector_ends(vertices, members, joints, guided))
        strokes += ({"kind": "image", "from": a, "to": b, "link": link} for a, b in outline_sides(members))
    orders = {"velocity": 1, "acceleration": 2}
    legends = {kind: [legend(order, below, frame, parts) for parts in (False, True)] for kind, order in orders.items()}
    return {"vertices": vertices, "strokes": strokes, "legends": legends}


def _riders(mechanism: Mechanism) -> list[tuple[str, str]]:
    """Of every slide the point that slides and the link that guides it."""
    named = {member: name for name, members in named_points(mechanism) for member in members}
    rides = (pair.point_on_line() for pair in mechanism.pairs)
    return [(named[each[0]], each[1]) for each in rides if each is not None]


def _free_letter(letter: str, taken: set[str]) -> str:
    """A letter with as many primes, one at least, as make it another one than all so far."""
    letter += PRIME
    while with_double_primes(letter) in taken:
        letter += PRIME
    return with_double_primes(letter)


def _vector(vertices: Sequence[Mapping[str, Any]], tail: int, head: int, link: str | None = None) -> dict[str, Any]:
    """The stroke of a vector, from what is at rest if either is; of two points of a `link` with its parts."""
    if vertices[head]["fixed"]:
        tail, head = head, tail
    stroke: dict[str, Any] = {"kind": "absolute" if vertices[tail]["fixed"] else "relative", "from": tail, "to": head}
    if link is not None:
        stroke |= {"link": link, "end": [vertices[head]["letter"], vertices[tail]["letter"]]}
    return stroke


def _vector_ends(
    vertices: Sequence[Mapping[str, Any]], members: Mapping[int, Vector], joints: Sequence[int], guided: Sequence[int]
) -> Iterator[tuple[int, int]]:
    """Between which points of a link there are vectors: round its joints, and to the points below what slides on it."""
    several = len(joints) + len(guided) > 1
    yield from outline_sides({each: members[each] for each in joints} if several else members)
    known = [*(each for each in joints if vertices[each]["fixed"]), *joints, *members, *guided]
    for each in guided:
        if each != known[0]:
            yield known[0], each


def outline_sides(places: Mapping[Any, Vector]) -> list[tuple[Any, Any]]:
    """The sides of the convex outline of places, anticlockwise, by their names; of those on a line its two ends.

    By Andrew's monotone chain (Information Processing Letters 9, 1979).
    """
    order = sorted(places, key=lambda name: tuple(places[name]))
    if len(order) < 2:
        return []
    start = places[order[0]]
    least = IN_LINE_RATIO * max((each - start).dot(each - start) for each in places.values())

    def half(names: Sequence[Any]) -> list[Any]:
        chain: list[Any] = []
        for name in names:
            while len(chain) > 1 and _turn(*(places[each] for each in (*chain[-2:], name))) <= least:
                chain.pop()
            chain.append(name)
        return chain[:-1]

    corners = [*half(order), *half(order[::-1])]
    return list(pairwise([*corners, corners[0]] if len(corners) > 2 else corners))


def _turn(one: Vector, other: Vector, third: Vector) -> float:
    """Twice the area of a triangle, positive anticlockwise."""
    return float((other - one).cross(third - one))
