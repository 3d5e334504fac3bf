"""Mechanisms that several test files build: four-bars, slider-cranks, levers and linkages of bars, one builder each."""

from __future__ import annotations

from math import acos, atan2, cos, hypot, sin
from typing import Any

import numpy as np

import planar
from planar.document import files
from planar.document.dimensions import link_lengths
from planar.model.mechanism import Mechanism
from tests.closed_forms import rocker


def four_bar(a, b, c, d, theta, closed=1, omega=2.0, alpha=1.0, unit="m"):
    """A four-bar with the crank at theta, sketched in one of its two assemblies."""
    phi = float(rocker(a, b, c, d, theta, closed))
    value = {
        "planar": 1,
        "name": "four-bar",
        "units": {"length": unit},
        "frame": "AD",
        "links": {
            "AD": {"points": {"A": [0, 0], "D": [d, 0]}},
            "AB": {"ends": ["A", "B"], "length": a},
            "BC": {"ends": ["B", "C"], "length": b, "points": {"E": {"along": ["B", "C"], "distance": 0.4 * b}}},
            "DC": {"ends": ["D", "C"], "length": c},
        },
        "pairs": [{"turning": name} for name in "ABCD"],
        "inputs": [{"pair": "A", "position": theta, "velocity": omega, "acceleration": alpha}],
        "sketch": {"C": [d + c * np.cos(phi), c * np.sin(phi)]},
    }
    return files.from_dict(value)


def block_slider_crank(r=0.48, rod=1.6, offset=0.1, theta=1.0):
    links = {
        "frame": {"points": {"O": [0, 0]}},
        "crank": {"ends": ["O", "A"], "length": r},
        "rod": {"ends": ["A", "B"], "length": rod},
    }
    pairs = [{"turning": "O"}, {"turning": "A"}]
    pairs.append({"sliding": "s", "on": "frame", "block": "B", "line": {"through": [0, offset]}})
    inputs = [{"pair": "O", "position": theta, "velocity": 3.0, "acceleration": -1.0}]
    return files.from_dict({"planar": 1, "frame": "frame", "links": links, "pairs": pairs, "inputs": inputs})


Value = dict[str, Any]


def four_bar_document(crank: float, coupler: float, rocker: float, base: float, **more: Any) -> Value:
    return {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0], "Q": [base, 0]}},
            "crank": {"ends": ["O", "A"], "length": crank},
            "coupler": {"ends": ["A", "B"], "length": coupler},
            "rocker": {"ends": ["Q", "B"], "length": rocker},
        },
        "pairs": [{"turning": each} for each in "OABQ"],
        "inputs": [{"pair": "O", "position": 0.6, "velocity": 7.0, "acceleration": -3.0}],
        "sketch": {"B": [base, 2.0 * rocker]},
        **more,
    }


def slider_crank_document(crank: float, rod: float, **more: Any) -> Value:
    """The line of the slide is the world's x-axis, through the shaft."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0]}},
            "crank": {"ends": ["O", "A"], "length": crank},
            "rod": {"ends": ["A", "B"], "length": rod},
            "piston": {"points": {"B": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "A"},
            {"turning": "B"},
            {"sliding": "stroke", "links": ["f", "piston"], "line": {"through": "O"}, "point": "B"},
        ],
        "inputs": [{"pair": "O", "position": 0.4, "velocity": 9.0, "acceleration": 5.0}],
        "sketch": {"B": [crank + rod, 0.0]},
        **more,
    }


def lever_document(points: dict[str, list[float]], angle: float = 0.0, **more: Any) -> Value:
    """A link `lever` that turns about O."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "lever": {"points": {"O": [0, 0], **points}}},
        "pairs": [{"turning": "O"}],
        "inputs": [{"pair": "O", "position": angle, "velocity": 3.0, "acceleration": 2.0}],
        **more,
    }


BODIES = {"crank": (1.3, 0.11, -0.04, 0.02), "second": (0.7, 0.17, 0.06, 0.03), "third": (2.1, 0.05, 0.08, 0.05)}
"""Masses (kg), where they are centred along their links and off them (m), and their inertias (kg m^2)."""


def masses(*names: str) -> list[Value]:
    return [
        {"link": name, "mass": m, "at": [x, y], "inertia": j}
        for name, (m, x, y, j) in zip(names, BODIES.values(), strict=True)
    ]


def bracket_document(**more: Any) -> Value:
    """Two bars from the frame to C."""
    return {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"P": [0, 0], "Q": [0, 3]}},
            "strut": {"ends": ["P", "C"], "length": 4},
            "tie": {"ends": ["Q", "C"], "length": 5},
        },
        "pairs": [{"turning": each} for each in "PQC"],
        "sketch": {"C": [4, 0]},
        **more,
    }


def slider_crank(r, l, e=0.0, heading=0.0, **given):  # noqa: E741 - the letters of textbooks
    """A crank r and a rod l in metres; the stroke at an angle, e to the left of the crank's pin."""
    way, left = np.array([cos(heading), sin(heading)]), np.array([-sin(heading), cos(heading)])
    return planar.from_dict(
        {
            "planar": 1,
            "name": "Slider-crank",
            "frame": "frame",
            "links": {
                "frame": {"points": {"O": [0, 0]}},
                "OA": {"ends": ["O", "A"], "length": r},
                "AB": {"ends": ["A", "B"], "length": l},
            },
            "pairs": [
                {"turning": "O"},
                {"turning": "A"},
                {
                    "sliding": "stroke",
                    "on": "frame",
                    "block": "B",
                    "line": {"through": list(e * left), "angle": heading},
                },
            ],
            "inputs": [{"pair": "O", "position": 1.0, "velocity": 2.0} | given],
            "sketch": {"B": list((r + l) * way + e * left)},
        }
    )


def open_four_bar(a, b, c, d, velocity=3.0, position=1.0):
    """A crank a, a coupler b with a point P, a rocker c and a frame d along x (m), the open assembly."""
    pin, size = np.array([a * cos(position), a * sin(position)]), None
    far = hypot(d - pin[0], -pin[1])
    size = atan2(-pin[1], d - pin[0]) + acos((b * b + far * far - c * c) / (2.0 * b * far))
    joint = pin + b * np.array([cos(size), sin(size)])
    return planar.from_dict(
        {
            "planar": 1,
            "name": "Four-bar",
            "frame": "frame",
            "links": {
                "frame": {"points": {"A": [0, 0], "D": [d, 0]}},
                "AB": {"ends": ["A", "B"], "length": a},
                "BC": {
                    "ends": ["B", "C"],
                    "length": b,
                    "points": {"P": {"along": ["B", "C"], "distance": b, "angle": 0.7}},
                },
                "DC": {"ends": ["D", "C"], "length": c},
            },
            "pairs": [{"turning": "A"}, {"turning": "B"}, {"turning": "C"}, {"turning": "D"}],
            "inputs": [{"pair": "A", "position": position, "velocity": velocity}],
            "sketch": {"B": list(map(float, pin)), "C": list(map(float, joint))},
        }
    )


def crank_rocker(seed):
    """Lengths of a random four-bar whose crank turns and whose rocker swings (Grashof, the crank shortest)."""
    rng = np.random.default_rng(seed)
    while True:
        a, b, c, d = (float(x) for x in rng.uniform(0.1, 1.0, 4))
        if min(b, c, d) > 1.1 * a and a + max(b, c, d) < 0.95 * (a + b + c + d - a - max(b, c, d)):
            return a, b, c, d


def triangle(base: float) -> Mechanism:
    """Links of 70 and 80 mm on a base (mm), which does not move."""
    return planar.from_dict(
        {
            "planar": 1,
            "name": "Triangle",
            "units": {"length": "mm", "angle": "deg"},
            "frame": "base",
            "links": {
                "base": {"ends": ["A", "B"], "length": base},
                "left": {"ends": ["A", "C"], "length": 70},
                "right": {"ends": ["B", "C"], "length": 80},
            },
            "pairs": [{"turning": "A"}, {"turning": "B"}, {"turning": "C"}],
            "sketch": {"C": [50, 50]},
        }
    )


def designs_around(mechanism, spread, many=5, seed=0):
    """Random designs: every length that is not zero, and the inputs' rates, changed by so much."""
    rng = np.random.default_rng(seed)
    own = {each.name: each.value for each in link_lengths(mechanism, frozenset(link.name for link in mechanism.links))}
    own |= {f"{each.pair}.velocity": each.velocity for each in mechanism.inputs}
    own |= {f"{each.pair}.acceleration": each.acceleration for each in mechanism.inputs}
    return {name: value * (1 + spread * rng.uniform(-1, 1, many)) for name, value in own.items() if value}


def bar_linkage(frame: dict, links: dict, driven: tuple[str, float], sketch: dict | None = None) -> planar.Mechanism:
    """A linkage of bars between pins: {name: (end, end, length)}; a pin is wherever two links name it."""
    value = {
        "planar": 1,
        "name": "bars",
        "units": {"length": "m", "angle": "rad"},
        "frame": "frame",
        "links": {"frame": {"points": frame}}
        | {name: {"ends": [a, b], "length": length} for name, (a, b, length) in links.items()},
        "pairs": [{"turning": pin} for pin in dict.fromkeys(end for a, b, _ in links.values() for end in (a, b))],
        "inputs": [{"pair": driven[0], "position": driven[1], "velocity": 1.0}],
        "sketch": sketch or {},
    }
    value["pairs"] = [
        pair
        for pair in value["pairs"]
        if sum(pair["turning"] in each[:2] for each in links.values()) + (pair["turning"] in frame) > 1
    ]
    return planar.from_dict(value)


def bare_four_bar(crank: float, coupler: float, rocker: float, ground: float, at: float) -> planar.Mechanism:
    links = {"crank": ("A", "B", crank), "coupler": ("B", "C", coupler), "rocker": ("D", "C", rocker)}
    return bar_linkage({"A": [0.0, 0.0], "D": [ground, 0.0]}, links, ("A", at))


def tower(many: int) -> planar.Mechanism:
    """Triangles one on a side of the other, each of which can be turned over: two assemblies each, whatever before."""
    links = {"crank": ("A", "B", 1.0)}
    ends = ["A", "B"]
    for k in range(many):
        new = f"P{k}"
        links |= {f"a{k}": (ends[-2], new, 1.1), f"b{k}": (ends[-1], new, 0.9)}
        ends.append(new)
    return bar_linkage({"A": [0.0, 0.0]}, links, ("A:frame,crank" if many else "A", 1.0))
