"""Published curves and four-bars, from a copy of KmolYuan/four-bar-rs in the folder that FOUR_BAR_FOLDER names.

Its folder test-fb has curves as rows of x, y and four-bars as named numbers, each with the paper it comes from: the
crank l2 turns at p1, the ground l1 lies at the angle a, the coupler is l3, the rocker l4, and the point lies at l5 from
the crank's end, turned by g from the coupler. They are read, not kept here.
"""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np

import planar
from benchmarks.synthesis.misses import Array, path_of

FOLDER = "FOUR_BAR_FOLDER"
POINT = "E"
COMMENT = re.compile(r"/\*.*?\*/|//[^\n]*", re.DOTALL)
KEY = re.compile(r"(\w+)\s*:\s*([-+.\w]+)")

Parameters = dict[str, Any]


def is_there() -> bool:
    """Whether a copy is named."""
    return _folder().is_dir()


def _folder() -> Path:
    return Path(os.environ.get(FOLDER, os.devnull)) / "test-fb"


def read_curve(name: str) -> Array:
    """The places (n, 2) of a target; without the last where it is the first again."""
    places = np.loadtxt(_folder() / f"{name}.csv", delimiter=",")
    return places[:-1] if np.allclose(places[0], places[-1]) else places


def read_parameters(name: str, published: bool = True) -> Parameters:
    """The numbers of a published four-bar, or of one whose path is itself the target."""
    folder = _folder() / "refer" if published else _folder()
    return parse_parameters((folder / f"{name}.ron").read_text(encoding="utf-8"))


def parse_parameters(text: str) -> Parameters:
    """The numbers that stand in a text, and its circuit and branch as they are named there."""
    found = dict(KEY.findall(COMMENT.sub("", text)))
    return {key: value if key == "stat" else float(value) for key, value in found.items()}


def four_bar(parameters: Parameters, unit: str = "mm") -> planar.Mechanism:
    """The mechanism of published numbers, in the middle of the branch that they name.

    >>> lengths = {"l1": 90, "l2": 35, "l3": 70, "l4": 70, "l5": 45}
    >>> four_bar({"p1x": 0, "p1y": 0, "a": 0, "g": 0.5, "stat": "c1b1", **lengths})
    <Mechanism 'four-bar': 4 links, 4 pairs, driven at A>
    """
    p = parameters
    turned = _start(p)
    start = np.array([p["p1x"], p["p1y"]])
    ground = start + p["l1"] * _direction(p["a"])
    b = start + p["l2"] * _direction(p["a"] + turned)
    apart = ground - b
    far = float(np.hypot(*apart))
    # the circuits are mirror images in the line from the crank's end to the rocker's pivot
    side = -1.0 if p["stat"].startswith("c2") else 1.0
    opening = side * np.arccos(np.clip((far**2 + p["l3"] ** 2 - p["l4"] ** 2) / (2.0 * far * p["l3"]), -1.0, 1.0))
    c = b + p["l3"] * _direction(np.arctan2(apart[1], apart[0]) + opening)
    return planar.from_dict(
        {
            "planar": 1,
            "name": "four-bar",
            "units": {"length": unit},
            "frame": "AD",
            "links": {
                "AD": {"points": {"A": start.tolist(), "D": ground.tolist()}},
                "AB": {"ends": ["A", "B"], "length": p["l2"]},
                "BC": {
                    "ends": ["B", "C"],
                    "length": p["l3"],
                    "points": {POINT: (p["l5"] * _direction(p["g"])).tolist()},
                },
                "DC": {"ends": ["D", "C"], "length": p["l4"]},
            },
            "pairs": [{"turning": name} for name in "ABCD"],
            "inputs": [{"pair": "A", "position": p["a"] + turned}],
            "sketch": {"C": c.tolist()},
        }
    )


def _direction(angle: float) -> Array:
    return np.array([np.cos(angle), np.sin(angle)])


def _start(p: Parameters) -> float:
    """The crank's angle from the ground in the middle of its range; a quarter turn where it turns fully."""
    l1, l2, l3, l4 = (p[f"l{k}"] for k in (1, 2, 3, 4))
    ends = [(l1**2 + l2**2 - far**2) / (2.0 * l1 * l2) for far in (abs(l3 - l4), l3 + l4)]
    least, most = (float(np.arccos(np.clip(each, -1.0, 1.0))) for each in ends)
    if least == 0.0 and most == np.pi:
        return 0.5 * np.pi
    if least > 0.0 and most == np.pi:
        return float(np.pi)
    if least == 0.0:
        return 0.0
    first = p["stat"].endswith("b1")
    middle = 0.5 * (least + most)
    return -middle if first else middle


def path_target(parameters: Parameters, many: int) -> Array:
    """So many places (n, 2) at equal ways along the path of a four-bar, in its file's unit: the target is that path."""
    path = path_of(four_bar(parameters, "m"), POINT)
    way = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    closes = np.hypot(*(path[-1] - path[0])) < 1e-6 * way[-1]
    along = np.linspace(0.0, way[-1], many, endpoint=not closes)
    return np.stack([np.interp(along, way, path[:, k]) for k in range(2)], axis=1)
