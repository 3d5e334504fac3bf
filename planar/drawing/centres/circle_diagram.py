"""The circle diagram of instantaneous centres: links are points on a circle, their centres the chords between them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from math import pi

import numpy as np

from planar.analysis.centres.centres import Centre, Centres
from planar.drawing.labels.text_metrics import text_size
from planar.drawing.paper.picture import Circle, Label, Mark, PaperPoint, Pen, Picture, Polyline, paper_point
from planar.foundation.arrays import Array
from planar.foundation.geometry import direction
from planar.model.link_graph import link_label

CHORD_STYLES = {
    "pair": (Pen.CHORD, "full: by pairs"),
    "Kennedy": (Pen.CHORD_FOUND, "dashed: by lines of centres"),
    "ratio": (Pen.CHORD_FOUND, "dashed: by lines of centres"),
    "equations": (Pen.CHORD_SOLVED, "dash-dot: by equations"),
}
"""How the chord of a centre is drawn by how it was found, and what that is called."""
POINT_RADIUS = 0.3
"""mm: the radius of a link's point, without its stroke."""
NUMBER_SIZE = 6.5
"""Points: of the chords' numbers."""
NUMBER_FRACTIONS = np.linspace(0.12, 0.88, 77)
"""Of a chord: where its number may stand."""
ENOUGH_ROOM, NUMBER_GAP = 4.0, 0.9
"""mm to other chords and numbers, beyond which a number stands no better; mm between its box and its chord."""
MIDDLE_BONUS = 3.0
"""mm of room that a place in the middle of a chord is worth, beside one at its end."""


def circle_picture(found: Centres, shown: Sequence[Centre]) -> Picture:
    """The circle diagram of some centres; found ones are numbered in the order in which all were found.

    Strokes are `about` "circle", "link AB" and "chord I24", of which there are two parts where its number stands
    between them; letters "number of AB" and "order of I24". A centre that is not determined has no chord.
    """
    places = link_points(found.numbers)
    drawn = [each for each in shown if each.how in CHORD_STYLES]
    chords = {each.name: np.array([places[link] for link in each.links]) for each in drawn}
    orders = {each.name: str(each.order) for each in drawn if each.how != "pair"}
    spots = _number_points(orders, chords)
    marks: list[Mark] = [Circle((0.0, 0.0), circle_radius(len(places)), Pen.CIRCLE, "circle")]
    for each in sorted(drawn, key=lambda centre: centre.how == "pair"):
        marks += _chord_strokes(each, chords[each.name], orders.get(each.name, ""), spots.get(each.name))
    marks += (Circle(at, POINT_RADIUS, Pen.CENTRE, f"link {link}") for link, at in places.items())
    marks += (
        Label(found.numbers[link], at, f"number of {link}", 9.0, POINT_RADIUS + 1.1) for link, at in places.items()
    )
    for name, text in orders.items():
        # half its height inwards: a letter in the middle of its spot, which is the gap in its chord
        marks.append(
            Label(
                text,
                paper_point(spots[name]),
                f"order of {name}",
                NUMBER_SIZE,
                -text_size(text, NUMBER_SIZE).height / 2.0,
            )
        )
    return Picture(tuple(marks), "Circle diagram", tuple(_notes(found, drawn)))


def circle_radius(links: int) -> float:
    """Of the circle for so many links (mm)."""
    return min(26.0 + 1.5 * links, 48.0)


def link_points(numbers: Mapping[str, str]) -> dict[str, PaperPoint]:
    """The links' points (mm) in the order of their numbers, clockwise; of an even number two stand at the top."""
    links = sorted(numbers, key=lambda link: int(numbers[link]))
    count = len(links)
    first = pi / 2.0 + (pi / count if count % 2 == 0 else 0.0)
    return {
        link: paper_point(direction(first - 2.0 * pi * k / count) * circle_radius(count))
        for k, link in enumerate(links)
    }


def _chord_strokes(centre: Centre, ends: Array, text: str, at: Array | None) -> Iterator[Polyline]:
    """A chord, with a gap for its number."""
    start, stop = ends
    pen, about = CHORD_STYLES[centre.how][0], f"chord {centre.name}"
    if at is None:
        yield Polyline((paper_point(start), paper_point(stop)), pen, about)
        return
    way = (stop - start) / np.linalg.norm(stop - start)
    width, height, _ = text_size(text, NUMBER_SIZE)
    across, up = np.maximum(np.abs(way), 1e-9)
    half = min((width / 2.0 + NUMBER_GAP) / across, (height / 2.0 + NUMBER_GAP) / up)
    yield Polyline((paper_point(start), paper_point(at - half * way)), pen, about)
    yield Polyline((paper_point(at + half * way), paper_point(stop)), pen, about)


def _number_points(orders: Mapping[str, str], chords: Mapping[str, Array]) -> dict[str, Array]:
    """Where each number stands on its chord: near the middle, and where other chords and numbers leave most room."""
    taken: dict[str, Array] = {}
    for name in orders:
        start, stop = chords[name]
        spots = start + NUMBER_FRACTIONS[:, None] * (stop - start)
        room = np.full(len(NUMBER_FRACTIONS), ENOUGH_ROOM)
        for other, (one, end) in chords.items():
            if other != name:
                room = np.minimum(room, _distances_to_chord(spots, one, end))
        for at in taken.values():
            room = np.minimum(room, np.hypot(*(spots - at).T) - 1.0)
        taken[name] = spots[int(np.argmax(room - MIDDLE_BONUS * np.abs(NUMBER_FRACTIONS - 0.5)))]
    return taken


def _distances_to_chord(points: Array, start: Array, stop: Array) -> Array:
    """From each spot (n, 2) to a chord (mm)."""
    way = stop - start
    part = np.clip((points - start) @ way / (way @ way), 0.0, 1.0)
    return np.hypot(*(points - start - part[:, None] * way).T)


def _notes(found: Centres, drawn: Sequence[Centre]) -> Iterator[str]:
    links = sorted(found.numbers.items(), key=lambda item: int(item[1]))
    yield f"Links: {', '.join(link_label(number, link) for link, number in links)}"
    kinds = dict.fromkeys(told for how, (_, told) in CHORD_STYLES.items() if any(each.how == how for each in drawn))
    if kinds:
        yield "; ".join(kinds).capitalize()
    if any(each.how != "pair" for each in drawn):
        yield "Numbers on chords: the order of finding"
