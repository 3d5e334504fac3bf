"""Mechanisms that several test files build: linkages of bars, four-bars, slider-cranks, levers; one builder each."""

from __future__ import annotations

from math import cos, pi, radians, sin
from typing import Any

import numpy as np

import planar
from planar.document.dimensions import link_lengths
from planar.model.mechanism import Mechanism
from tests.closed_forms import rocker as rocker_angle

Value = dict[str, Any]
Bar = tuple[str, str, float] | tuple[str, str, float, Value] | Value
Where = tuple[float, float]


def bar_document(
    frame: Value,
    bars: dict[str, Bar],
    driven: tuple[str, float] | None = None,
    *,
    ground: str = "frame",
    pairs: tuple[Value, ...] = (),
    omega: Any = 1.0,
    alpha: Any = None,
    **more: Any,
) -> Value:
    """A linkage of bars between pins: {name: (end, end, length) or with further points, or a whole link}.

    A pin is wherever two links have a point of one name, the frame (named `ground`) with its points among them; then
    come the other `pairs`. The first pair of `driven` stands at the second; units, sketch, loads and so on are `more`.
    """
    links: Value = {ground: {"points": frame}}
    for name, bar in bars.items():
        links[name] = bar
        if isinstance(bar, tuple):
            links[name] = {"ends": list(bar[:2]), "length": bar[2]} | ({"points": bar[3]} if bar[3:] else {})
    named = [[*link.get("ends", ()), *link.get("points", ())] for link in links.values()]
    own = dict.fromkeys(name for each in named[1:] for name in each)
    pins = [name for name in own if sum(name in each for each in named) > 1]
    value = {
        "planar": 1,
        "frame": ground,
        "links": links,
        "pairs": [*({"turning": name} for name in pins), *pairs],
    }
    if driven is not None:
        rates = {"velocity": omega, "acceleration": alpha}
        given = {name: rate for name, rate in rates.items() if rate is not None}
        value["inputs"] = [{"pair": driven[0], "position": driven[1]} | given]
    return value | more


def bar_linkage(
    frame: Value, bars: dict[str, Bar], driven: tuple[str, float], sketch: Value | None = None
) -> Mechanism:
    return planar.from_dict(bar_document(frame, bars, driven, name="bars", sketch=sketch or {}))


def four_bar_document(
    a: float,
    b: float,
    c: float,
    d: float,
    theta: float | None = None,
    closed: int = 0,
    *,
    pins: str | list[str] = "ABCD",
    names: list[str] | None = None,
    driven: str | None = None,
    points: Value | None = None,
    turn: float = 0.0,
    shift: Where = (0.0, 0.0),
    **more: Any,
) -> Value:
    """A four-bar with its crank a at theta from the frame d, a coupler b with these points, and a rocker c.

    Sketched in one of its assemblies (`closed` 1 or -1) or as `more` says; `names` are those of the links d, a, b, c.
    The frame's line is turned and shifted; angles are in the file's unit, `turn` in rad.
    """
    first, second, third, fourth = pins
    ground, crank, coupler, rocker = names or [first + fourth, first + second, second + third, fourth + third]
    deg = more.get("units", {}).get("angle") == "deg"
    if closed:
        at = radians(theta) if deg else theta
        spot = complex(*shift) + (d + c * np.exp(1j * rocker_angle(a, b, c, d, at, closed))) * np.exp(1j * turn)
        more = {"sketch": {third: [float(spot.real), float(spot.imag)]}} | more
    return bar_document(
        {first: list(shift), fourth: [shift[0] + d * cos(turn), shift[1] + d * sin(turn)]},
        {
            crank: (first, second, a),
            coupler: (second, third, b, *([points] if points else [])),
            rocker: (fourth, third, c),
        },
        None if theta is None else (driven or first, theta + turn),
        ground=ground,
        **more,
    )


def four_bar(a, b, c, d, theta, closed=1, omega=2.0, alpha=1.0, **more):
    """Its coupler carries a point E."""
    points = {"E": {"along": ["B", "C"], "distance": 0.4 * b}}
    given = {"name": "four-bar", "points": points, "omega": omega, "alpha": alpha} | more
    return planar.from_dict(four_bar_document(a, b, c, d, theta, closed, **given))


def open_four_bar(a, b, c, d, velocity=3.0, position=1.0):
    """The open assembly, the coupler a triangle with a point P."""
    points = {"P": {"along": ["B", "C"], "distance": b, "angle": 0.7}}
    return four_bar(a, b, c, d, position, 1, velocity, None, points=points, names=["frame", "AB", "BC", "DC"])


def bare_four_bar(crank: float, coupler: float, rocker: float, ground: float, at: float) -> Mechanism:
    """Nothing says which assembly is meant."""
    names = ["frame", "crank", "coupler", "rocker"]
    return planar.from_dict(four_bar_document(crank, coupler, rocker, ground, at, names=names))


def dynamic_four_bar_document(crank: float, coupler: float, rocker: float, base: float, **more: Any) -> Value:
    """Links that can be given the `masses`."""
    given = {"names": ["f", "crank", "coupler", "rocker"], "sketch": {"B": [base, 2.0 * rocker]}} | more
    return four_bar_document(crank, coupler, rocker, base, 0.6, pins="OABQ", omega=7.0, alpha=-3.0, **given)


def six_bar_document(coupler: float, rocker: float, at: float, **more: Any) -> Value:
    """A four-bar ABCD with a dyad CFG on the pin of its rocker; only the dyad's lengths are given."""
    bars = {"AB": ("A", "B", 50.0), "BC": ("B", "C", 66.0), "DC": ("D", "C", 56.0)}
    bars |= {"CF": ("C", "F", coupler), "GF": ("G", "F", rocker)}
    return bar_document({"A": [0.0, 0.0], "D": [100.0, 0.0], "G": [200.0, 0.0]}, bars, ("A", at), **more)


def six_bar(coupler: float, rocker: float, at: float = pi / 3.0) -> Mechanism:
    return planar.from_dict(six_bar_document(coupler, rocker, at, name="six-bar"))


def slider_crank_document(
    r: float,
    l: float,  # noqa: E741 - the letters of textbooks
    theta: float | None = None,
    e: float = 0.0,
    closed: int = 1,
    *,
    pins: str = "OAB",
    names: tuple[str, str, str] = ("frame", "crank", "rod"),
    piston: str | None = None,
    slide: str = "stroke",
    driven: str | None = None,
    turn: float = 0.0,
    shift: Where = (0.0, 0.0),
    **more: Any,
) -> Value:
    """A crank r at theta from the stroke, a rod l; the stroke's line e to the left of the crank's pin.

    The rod's end is a block, or pinned to a link `piston`; sketched at its farthest ahead or behind (`closed` 1 or -1)
    or as `more` says. All of it is turned (rad) and shifted.
    """
    shaft, pin, wrist = pins
    ground, crank, rod = names
    way, left = np.array([cos(turn), sin(turn)]), np.array([-sin(turn), cos(turn)])
    line: Value = {"through": (np.array(shift) + e * left).tolist()} | ({"angle": turn} if turn else {})
    bars: Value = {crank: (shaft, pin, r), rod: (pin, wrist, l)}
    ends: Value = {"on": ground, "block": wrist, "line": line}
    if piston is not None:
        bars[piston] = {"points": {wrist: [0, 0]}}
        ends = {"links": [ground, piston], "line": line, "point": wrist}
    if closed:
        spot = np.array(shift) + closed * (r + l) * way + e * left
        more = {"sketch": {wrist: spot.tolist()}} | more
    at = None if theta is None else (driven or shaft, theta if driven == slide else theta + turn)
    return bar_document({shaft: list(shift)}, bars, at, ground=ground, pairs=({"sliding": slide} | ends,), **more)


def block_slider_crank(r=0.48, rod=1.6, offset=0.1, theta=1.0):
    """Its slide is s."""
    return planar.from_dict(slider_crank_document(r, rod, theta, offset, 0, slide="s", omega=3.0, alpha=-1.0))


def slider_crank(r, l, e=0.0, heading=0.0, position=1.0, velocity=2.0, acceleration=None, **more):  # noqa: E741
    """The stroke at an angle; the position of the crank is counted from the x-axis."""
    given = {
        "name": "Slider-crank",
        "names": ("frame", "OA", "AB"),
        "turn": heading,
        "omega": velocity,
        "alpha": acceleration,
    }
    return planar.from_dict(slider_crank_document(r, l, position - heading, e, **(given | more)))


def piston_document(crank: float, rod: float, **more: Any) -> Value:
    """A slider-crank whose piston is a link; links that can be given the `masses`."""
    given = {"names": ("f", "crank", "rod"), "piston": "piston", "omega": 9.0, "alpha": 5.0} | more
    return slider_crank_document(crank, rod, 0.4, **given)


def lever_document(points: dict[str, list[float]], angle: float = 0.0, **more: Any) -> Value:
    """A link `lever` that turns about O."""
    lever = {"points": {"O": [0, 0], **points}}
    return bar_document({"O": [0, 0]}, {"lever": lever}, ("O", angle), ground="f", omega=3.0, alpha=2.0, **more)


BODIES = {"crank": (1.3, 0.11, -0.04, 0.02), "second": (0.7, 0.17, 0.06, 0.03), "third": (2.1, 0.05, 0.08, 0.05)}
"""Masses (kg), where they are centred along their links and off them (m), and their inertias (kg m^2)."""


def masses(*names: str) -> list[Value]:
    return [
        {"link": name, "mass": m, "at": [x, y], "inertia": j}
        for name, (m, x, y, j) in zip(names, BODIES.values(), strict=True)
    ]


def bracket_document(**more: Any) -> Value:
    """Two bars from the frame to C."""
    bars = {"strut": ("P", "C", 4), "tie": ("Q", "C", 5)}
    return bar_document({"P": [0, 0], "Q": [0, 3]}, bars, ground="f", **({"sketch": {"C": [4, 0]}} | more))


def crank_rocker(seed):
    """Lengths of a random four-bar whose crank turns and whose rocker swings (Grashof, the crank shortest)."""
    rng = np.random.default_rng(seed)
    while True:
        a, b, c, d = (float(x) for x in rng.uniform(0.1, 1.0, 4))
        if min(b, c, d) > 1.1 * a and a + max(b, c, d) < 0.95 * (a + b + c + d - a - max(b, c, d)):
            return a, b, c, d


def triangle(base: float) -> Mechanism:
    """Links of 70 and 80 mm on a base (mm), which does not move."""
    links = {"base": {"ends": ["A", "B"], "length": base}, "left": ("A", "C", 70), "right": ("B", "C", 80)}
    units = {"length": "mm", "angle": "deg"}
    value = bar_document({}, links, name="Triangle", units=units, sketch={"C": [50, 50]})
    del value["links"]["frame"]
    return planar.from_dict(value | {"frame": "base"})


def designs_around(mechanism, spread, many=5, seed=0):
    """Random designs: every length that is not zero, and the inputs' rates, changed by so much."""
    rng = np.random.default_rng(seed)
    own = {each.name: each.value for each in link_lengths(mechanism, frozenset(link.name for link in mechanism.links))}
    own |= {f"{each.pair}.velocity": each.velocity for each in mechanism.inputs}
    own |= {f"{each.pair}.acceleration": each.acceleration for each in mechanism.inputs}
    return {name: value * (1 + spread * rng.uniform(-1, 1, many)) for name, value in own.items() if value}


def lift_document(stages: int) -> dict[str, Any]:
    """A scissor lift: pairs of bars that cross in the middle, the lowest on a pivot and on a slide that is driven."""
    links: dict[str, Any] = {"g": {"points": {"P0": [0, 0]}}}
    pairs: list[dict[str, Any]] = [{"turning": "P0"}]
    for k in range(1, stages + 1):
        for name, ends in ((f"a{k}", [f"P{k - 1}", f"Q{k}"]), (f"b{k}", [f"Q{k - 1}", f"P{k}"])):
            links[name] = {"ends": ends, "length": 2, "points": {f"M{k}": {"along": ends, "distance": 1}}}
        pairs += [{"turning": f"M{k}"}, *({"turning": f"{name}{k}"} for name in "PQ" if k < stages)]
    pairs.append({"sliding": "s", "on": "g", "block": "Q0", "line": {"through": "P0", "angle": 0}})
    inputs = [{"pair": "s", "position": 1.2}]
    return {"planar": 1, "frame": "g", "links": links, "pairs": pairs, "inputs": inputs}


def tower(many: int) -> planar.Mechanism:
    """Triangles one on a side of the other, each of which can be turned over: two assemblies each, whatever before."""
    links = {"crank": ("A", "B", 1.0)}
    ends = ["A", "B"]
    for k in range(many):
        new = f"P{k}"
        links |= {f"a{k}": (ends[-2], new, 1.1), f"b{k}": (ends[-1], new, 0.9)}
        ends.append(new)
    return bar_linkage({"A": [0.0, 0.0]}, links, ("A:frame,crank" if many else "A", 1.0))
