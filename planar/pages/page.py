"""One self-contained HTML file: the mechanism's data and equations, and the scripts that show and move it."""

from __future__ import annotations

import json
from html import escape
from typing import Any, NamedTuple

import numpy as np

from planar.files import asset
from planar.mechanism import Mechanism
from planar.pages.carried import carried


class Window(NamedTuple):
    """The part of an input's range that a page runs through: the number of the input, and both ends (rad or m)."""

    running: int
    low: float
    high: float


STYLES = (
    "uplot/uPlot.min.css",
    "page.css",
    "stage.css",
    "layers.css",
    "dimensions.css",
)
SCRIPTS = (
    "uplot/uPlot.iife.min.js",
    "solver.js",
    "page.js",
    "course.js",
    "bodies.js",
    "symbols.js",
    "ground.js",
    "springs.js",
    "letters.js",
    "poses.js",
    "drawing.js",
    "dragging.js",
    "controls.js",
    "layers_ink.js",
    "layers_points.js",
    "polygons.js",
    "centres.js",
    "layers_centrodes.js",
    "forces.js",
    "layers_forces.js",
    "forces_table.js",
    "numbers.js",
    "charts.js",
    "layers.js",
    "dimensions.js",
    "assemblies.js",
    "saving.js",
)


def page(mechanism: Mechanism, z: np.ndarray | None = None, window: Window | None = None) -> str:
    """The page of a mechanism at its inputs.

    `z` are the unknowns of the assembly, left out that nearest to the sketch; `window` is the range that is run
    through, left out a turn or from limit to limit. Raises NoAnswer where it has no position to start from.
    """
    data, functions = carried(mechanism, z)
    data["window"] = window and window._asdict()
    scripts = "\n".join([*(asset(name) for name in SCRIPTS), functions, START])
    parts = {
        "title": escape(mechanism.name),
        "styles": "\n".join(asset(name) for name in STYLES),
        "data": told(data),
        "scripts": scripts,
    }
    return filled(asset("page.html"), parts)


START = r"""
const page = new Page(JSON.parse(document.getElementById("data").textContent), program);
const svg = document.getElementById("drawing"), drawing = new Drawing(page, svg), dragging = new Dragging(page, svg);
const controls = new Controls(page, document.getElementById("controls"), svg, drawing, dragging);
new Courses(page);
new Dimensions(page, document.getElementById("dimensions"));
new Assemblies(page, document.getElementById("assemblies"));
new Saving(page, document.getElementById("saving"), document.getElementById("drawing"));
startLayers(page);
"""


def filled(template: str, parts: dict[str, str]) -> str:
    """A template with its parts in place; what stands in a part is not looked at again."""
    found = template
    pieces = []
    while found:
        places = [(found.find(f"{{{name}}}"), name) for name in parts]
        at, name = min((each for each in places if each[0] >= 0), default=(-1, ""))
        if at < 0:
            break
        pieces += [found[:at], parts[name]]
        found = found[at + len(name) + 2 :]
    return "".join([*pieces, found])


def told(value: Any) -> str:
    """A JSON text that ends no script, whatever texts it holds."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
