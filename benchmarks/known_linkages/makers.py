"""Random linkages whose links and lines are written in different ways, and their mechanism files."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from benchmarks.known_linkages.closed_forms import SECOND_ENDS, STRUCTURES, Position, Structure
from planar.foundation.arrays import Array, BoolArray

Place = complex
"""x + i y in the plane, m."""


class LinkForm(NamedTuple):
    """How a link is written: its points, and whether the first two are its ends."""

    name: str
    points: tuple[str, ...]
    by_ends: bool


class KnownLinkage(NamedTuple):
    """A linkage with its numbers (SI), and a position of its input (rad) with the signs of the assembly there."""

    kind: str
    forms: tuple[LinkForm, ...]
    line: str
    'how the line "s" is written: "point", "coordinates", "points", or "" where there is none'
    is_block: bool
    numbers: dict[str, float]
    angle: float
    signs: tuple[float, ...]

    @property
    def structure(self) -> Structure:
        """Its kind."""
        return STRUCTURES[self.kind]

    def position(self, angle: Any, signs: tuple[Any, ...] | None = None) -> Position:
        """Its position by the closed form."""
        return self.structure.kinematics(self.numbers, angle, self.signs if signs is None else signs)


class _Writer:
    """Links with random forms, as they are written from their places."""

    def __init__(self, rng: np.random.Generator):
        self.rng = rng
        self.forms: list[LinkForm] = []
        self.numbers: dict[str, float] = {}

    def frame(self, name: str, points: dict[str, Place], by_ends: bool) -> None:
        """The frame, whose axes are the world's."""
        self._add(name, points, 0.0j, 1.0 + 0.0j, by_ends)

    def link(self, name: str, points: dict[str, Place]) -> None:
        """A moving link, which is written by ends, by points along its first two, or by points in axes at random."""
        form = str(self.rng.choice(["ends", "points", "general"], p=[0.5, 0.3, 0.2]))
        first, second, *others = points.values()
        origin, way = first, (second - first) / abs(second - first)
        if form == "general":
            origin, way = complex(*self.rng.uniform(-1.0, 1.0, 2)), np.exp(1j * self.rng.uniform(-np.pi, np.pi))
            if others and self.rng.random() < 0.3:
                origin = others[0]
        self._add(name, points, origin, way, form == "ends")

    def drawn(self, name: str, points: dict[str, Place], origin: Place, way: Place) -> None:
        """A moving link by points in given axes."""
        self._add(name, points, origin, way, False)

    def _add(self, name: str, points: dict[str, Place], origin: Place, way: Place, by_ends: bool) -> None:
        self.forms.append(LinkForm(name, tuple(points), by_ends))
        ends = [*points][:2] if by_ends else []
        if by_ends:
            assert ends[1] == SECOND_ENDS[name]
            self.numbers[f"{name}.length"] = abs(points[ends[1]] - points[ends[0]])
        for point, place in points.items():
            if point not in ends:
                own = (place - origin) / way
                self.numbers |= {f"{name}.{point}.x": _written(own.real), f"{name}.{point}.y": _written(own.imag)}


def _written(value: float) -> float:
    """A coordinate, 0 where it is round-off."""
    return float(value) if abs(value) > 1e-14 else 0.0


def _places(rng: np.random.Generator, *centres: Place) -> list[Place]:
    """Places at random about centres."""
    return [each + complex(*rng.uniform(-0.5, 0.5, 2)) for each in centres]


def four_bar(rng: np.random.Generator) -> KnownLinkage:
    """A four-bar with a point P of its coupler."""
    by_ends = bool(rng.random() < 0.3)
    a, d, b, c, p = _places(rng, 0.0, 1.0, 0.4j, 1.0 + 0.8j, 0.5 + 0.7j)
    if by_ends:
        d, a = complex(abs(d - a)), 0.0j
    made = _Writer(rng)
    made.frame("g", {"A": a, "D": d}, by_ends)
    made.link("AB", {"A": a, "B": b})
    made.link("BC", {"B": b, "C": c, "P": p})
    made.link("DC", {"D": d, "C": c})
    return _finish("four-bar", made, b - a, "AB")


def watt_two(rng: np.random.Generator) -> KnownLinkage:
    """A six-bar of Watt II: two four-bars one after the other."""
    a, d, g, b, c, e, f = _places(rng, 0.0, 1.0, 2.0, 0.4j, 1.0 + 0.8j, 1.3 + 0.6j, 2.2 + 0.8j)
    made = _Writer(rng)
    made.frame("g", {"A": a, "D": d, "G": g}, False)
    made.link("AB", {"A": a, "B": b})
    made.link("BC", {"B": b, "C": c})
    made.link("DC", {"D": d, "C": c, "E": e})
    made.link("EF", {"E": e, "F": f})
    made.link("GF", {"G": g, "F": f})
    return _finish("Watt II", made, b - a, "AB")


def slider_crank(rng: np.random.Generator) -> KnownLinkage:
    """A slider-crank with offset and a point P of its rod; its line through a named point, two, or coordinates."""
    o, a, b, p = _places(rng, 0.0, 0.4j, 1.5, 0.7 + 0.5j)
    line = str(rng.choice(["point", "coordinates", "points"], p=[0.5, 0.35, 0.15]))
    angle = float(rng.choice([0.0, rng.uniform(-np.pi, np.pi)]))
    through = b - rng.uniform(-1.5, 1.5) * np.exp(1j * angle)
    made = _Writer(rng)
    points = {"O": o}
    if line != "coordinates":
        points["G"] = through
    if line == "points":
        points["H"] = through + rng.uniform(0.5, 2.0) * np.exp(1j * angle)
    else:
        made.numbers["s.line.angle"] = angle
    if line == "coordinates":
        made.numbers |= {"s.line.x": float(through.real), "s.line.y": float(through.imag)}
    made.frame("f", points, False)
    made.link("c", {"O": o, "A": a})
    made.link("rod", {"A": a, "B": b, "P": p})
    return _finish("slider-crank", made, a - o, "c", line, bool(rng.random() < 0.5))


def inverted_slider(kind: str, pin: str) -> Callable[[np.random.Generator], KnownLinkage]:
    """The maker of a kind of inverted slider-crank: the pin of the rod is the crank's A, and the rod slides through a
    block about D, or it is D, and the crank's pin slides along the rod."""

    def make(rng: np.random.Generator) -> KnownLinkage:
        o, a, d, p = _places(rng, 0.0, 0.4j, 1.5, 0.7 + 0.5j)
        writer = _Writer(rng)
        writer.frame("f", {"O": o, "D": d}, False)
        writer.link("c", {"O": o, "A": a})
        place, other = (a, d) if pin == "A" else (d, a)
        way = np.exp(1j * rng.uniform(-np.pi, np.pi))
        origin = place if rng.random() < 0.6 else complex(*rng.uniform(-1.0, 1.0, 2))
        through = place + complex(*rng.uniform(-0.3, 0.3, 2)) if rng.random() < 0.7 else place + 0.0j
        writer.drawn("rod", {pin: place, "G": through, "P": p}, origin, way)
        writer.numbers["s.line.angle"] = float(np.angle((other - through) / way * rng.choice([1.0, -1.0])))
        return _finish(kind, writer, a - o, "c", "point", True)

    return make


def _finish(kind: str, made: _Writer, crank: Place, link: str, line: str = "", is_block: bool = False) -> KnownLinkage:
    """The linkage with the position of its input, and the signs of the assembly in which it was placed."""
    structure = STRUCTURES[kind]
    pins = next(form.points for form in made.forms if form.name == link)
    drawn = [complex(*(made.numbers.get(f"{link}.{pin}.{axis}", 0.0) for axis in "xy")) for pin in pins]
    if f"{link}.length" in made.numbers:
        drawn = [0.0j, complex(made.numbers[f"{link}.length"])]
    angle = float(np.angle(crank / (drawn[1] - drawn[0])))
    signs = tuple(float(each) for each in made.rng.choice([-1.0, 1.0], structure.sign_count))
    return KnownLinkage(kind, tuple(made.forms), line, is_block, made.numbers, angle, signs)


MAKERS: dict[str, Callable[[np.random.Generator], KnownLinkage]] = {
    "four-bar": four_bar,
    "slider-crank": slider_crank,
    "swinging block": inverted_slider("swinging block", "A"),
    "slotted lever": inverted_slider("slotted lever", "D"),
    "Watt II": watt_two,
}


PINS = {
    "four-bar": "ABCD",
    "Watt II": "ABCDEFG",
    "slider-crank": "OA",
    "swinging block": "OA",
    "slotted lever": "OD",
}
"""The turning pairs of kinds of linkages."""
SLIDERS = {"slider-crank": "B", "swinging block": "D", "slotted lever": "A"}
"""The points that slide."""


def write_mechanism(linkage: KnownLinkage, numbers: dict[str, float], position: Position, units: str) -> dict[str, Any]:
    """The mechanism file with these numbers, in "m" and rad or in "mm" and degrees; its sketch is a position."""
    length, turn = (1000.0, 180.0 / np.pi) if units == "mm" else (1.0, 1.0)
    links: dict[str, Any] = {}
    for form in linkage.forms:
        ends = form.points[:2] if form.by_ends else ()
        points = {
            name: [numbers[f"{form.name}.{name}.x"] * length, numbers[f"{form.name}.{name}.y"] * length]
            for name in form.points
            if name not in ends
        }
        links[form.name] = {"ends": [*ends], "length": numbers[f"{form.name}.length"] * length} if ends else {}
        links[form.name] |= {"points": points} if points else {}
    pairs: list[dict[str, Any]] = [{"turning": pin} for pin in PINS[linkage.kind]]
    if linkage.line:
        slide = SLIDERS[linkage.kind]
        line: dict[str, Any] = {"through": "G"}
        if linkage.line == "coordinates":
            line = {"through": [numbers["s.line.x"] * length, numbers["s.line.y"] * length]}
        line |= {"to": "H"} if linkage.line == "points" else {"angle": numbers["s.line.angle"] * turn}
        on = "f" if linkage.kind == "slider-crank" else "rod"
        if linkage.is_block:
            pairs.append({"sliding": "s", "on": on, "block": slide, "line": line})
        else:
            links["p"] = {"points": {"B": [0.0, 0.0]}}
            pairs += [{"turning": "B"}, {"sliding": "s", "links": [on, "p"], "line": line, "point": "B"}]
    frame = linkage.structure.frame
    moving = {name: form.name for form in linkage.forms if form.name != frame for name in form.points}
    places = {name: position.place(numbers, link, name) for name, link in moving.items()}
    fixed = next(form.points for form in linkage.forms if form.name == frame)
    sketch = {
        name: [float(place.x) * length, float(place.y) * length] for name, place in places.items() if name not in fixed
    }
    return {
        "planar": 1,
        "name": linkage.kind,
        "units": {"length": units, "angle": "deg" if units == "mm" else "rad"},
        "frame": frame,
        "links": links,
        "pairs": pairs,
        "inputs": [{"pair": linkage.structure.inputs, "position": linkage.angle * turn}],
        "sketch": sketch,
    }


def is_assembled(position: Position) -> BoolArray:
    """Whether all pins and links of a position have a place (angles,)."""
    vectors = [*position.pins.values(), *position.directions.values()]
    parts = [np.asarray(part, float) for each in vectors for part in (each.x, each.y)]
    found: BoolArray = np.isfinite(np.stack(np.broadcast_arrays(*parts))).all(axis=0)
    return found


def angles_about(linkage: KnownLinkage, reach: float = 2.8, count: int = 561) -> Array:
    """Positions of the input about its own to which the assembly goes without a dead point."""
    offsets = np.linspace(-reach, reach, count)
    good = is_assembled(linkage.position(linkage.angle + offsets))
    middle = count // 2
    if not good[middle]:
        return offsets[:0]
    first = middle - int(np.argmin(np.append(good[middle::-1], False)))
    last = middle + int(np.argmin(np.append(good[middle:], False)))
    within: Array = linkage.angle + offsets[first + 1 : last]
    return within
