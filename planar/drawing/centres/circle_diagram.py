"""The circle diagram of instantaneous centres: links are points on a circle, their centres the chords between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi

import numpy as np

from planar.analysis.centres.centres import Centre, Centres
from planar.drawing.labels.text_metrics import measured
from planar.drawing.paper.picture import Circle, Letter, Line, Mark, Pen, Picture, Spot, spot
from planar.foundation.geometry import direction
from planar.model.link_graph import number_and_name

CHORDS = {
    "pair": (Pen.CHORD, "full: by pairs"),
    "Kennedy": (Pen.CHORD_FOUND, "dashed: by lines of centres"),
    "ratio": (Pen.CHORD_FOUND, "dashed: by lines of centres"),
    "equations": (Pen.CHORD_SOLVED, "dash-dot: by equations"),
}
"""How the chord of a centre is drawn by how it was found, and what that is called."""
POINT = 0.3
"""mm: the radius of a link's point, without its stroke."""
SIZE = 6.5
"""Points: of the chords' numbers."""
PARTS = np.linspace(0.12, 0.88, 77)
"""Of a chord: where its number may stand."""
CLEAR, GAP = 4.0, 0.9
"""mm to other chords and numbers, beyond which a number stands no better; mm between its box and its chord."""
MIDDLE = 3.0
"""mm of room that a place in the middle of a chord is worth, beside one at its end."""
Array = np.ndarray


def circle_picture(found: Centres, shown: Sequence[Centre]) -> Picture:
    """The circle diagram of some centres; found ones are numbered in the order in which all were found.

    Strokes are `about` "circle", "link AB" and "chord I24", of which there are two parts where its number stands
    between them; letters "number of AB" and "order of I24". A centre that is not determined has no chord.
    """
    places = _places(found)
    drawn = [each for each in shown if each.how in CHORDS]
    chords = {each.name: np.array([places[link] for link in each.links]) for each in drawn}
    orders = {each.name: str(each.order) for each in drawn if each.how != "pair"}
    spots = _free(orders, chords)
    marks: list[Mark] = [Circle((0.0, 0.0), radius(len(places)), Pen.CIRCLE, "circle")]
    for each in sorted(drawn, key=lambda centre: centre.how == "pair"):
        marks += _chord(each, chords[each.name], orders.get(each.name, ""), spots.get(each.name))
    marks += (Circle(at, POINT, Pen.CENTRE, f"link {link}") for link, at in places.items())
    marks += (Letter(found.numbers[link], at, f"number of {link}", 9.0, POINT + 1.1) for link, at in places.items())
    for name, text in orders.items():
        # half its height inwards: a letter in the middle of its spot, which is the gap in its chord
        marks.append(Letter(text, spot(spots[name]), f"order of {name}", SIZE, -measured(text, SIZE).height / 2.0))
    return Picture(tuple(marks), "Circle diagram", tuple(_notes(found, drawn)))


def radius(links: int) -> float:
    """Of the circle for so many links (mm)."""
    return min(26.0 + 1.5 * links, 48.0)


def _places(found: Centres) -> dict[str, Spot]:
    """The links' points in the order of their numbers, clockwise; of an even number two stand at the top."""
    links = sorted(found.numbers, key=lambda link: int(found.numbers[link]))
    count = len(links)
    first = pi / 2.0 + (pi / count if count % 2 == 0 else 0.0)
    return {link: spot(direction(first - 2.0 * pi * k / count) * radius(count)) for k, link in enumerate(links)}


def _chord(centre: Centre, ends: Array, text: str, at: Array | None) -> Iterator[Line]:
    """A chord, with a gap for its number."""
    start, stop = ends
    pen, about = CHORDS[centre.how][0], f"chord {centre.name}"
    if at is None:
        yield Line((spot(start), spot(stop)), pen, about)
        return
    way = (stop - start) / np.linalg.norm(stop - start)
    width, height, _ = measured(text, SIZE)
    across, up = np.maximum(np.abs(way), 1e-9)
    half = min((width / 2.0 + GAP) / across, (height / 2.0 + GAP) / up)
    yield Line((spot(start), spot(at - half * way)), pen, about)
    yield Line((spot(at + half * way), spot(stop)), pen, about)


def _free(orders: Mapping[str, str], chords: Mapping[str, Array]) -> dict[str, Array]:
    """Where each number stands on its chord: near the middle, and where other chords and numbers leave most room."""
    taken: dict[str, Array] = {}
    for name in orders:
        start, stop = chords[name]
        spots = start + PARTS[:, None] * (stop - start)
        room = np.full(len(PARTS), CLEAR)
        for other, (one, end) in chords.items():
            if other != name:
                room = np.minimum(room, _distances(spots, one, end))
        for at in taken.values():
            room = np.minimum(room, np.hypot(*(spots - at).T) - 1.0)
        taken[name] = spots[int(np.argmax(room - MIDDLE * np.abs(PARTS - 0.5)))]
    return taken


def _distances(spots: Array, start: Array, stop: Array) -> Array:
    """From each spot (n, 2) to a chord (mm)."""
    way = stop - start
    part = np.clip((spots - start) @ way / (way @ way), 0.0, 1.0)
    return np.hypot(*(spots - start - part[:, None] * way).T)


def _notes(found: Centres, drawn: Sequence[Centre]) -> Iterator[str]:
    links = sorted(found.numbers.items(), key=lambda item: int(item[1]))
    yield f"Links: {', '.join(number_and_name(number, link) for link, number in links)}"
    kinds = dict.fromkeys(told for how, (_, told) in CHORDS.items() if any(each.how == how for each in drawn))
    if kinds:
        yield "; ".join(kinds).capitalize()
    if any(each.how != "pair" for each in drawn):
        yield "Numbers on chords: the order of finding"
