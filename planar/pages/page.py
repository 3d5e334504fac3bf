"""One self-contained HTML file: the mechanism's data and equations, and the scripts that show and move it."""

from __future__ import annotations

import json
from html import escape
from typing import Any

from planar.files import asset
from planar.mechanism import Mechanism
from planar.pages.carried import carried

STYLES = ("uplot/uPlot.min.css", "page.css", "stage.css", "layers.css")
SCRIPTS = (
    *("uplot/uPlot.iife.min.js", "solver.js", "page.js", "course.js"),
    *("bodies.js", "symbols.js", "ground.js", "letters.js", "poses.js", "drawing.js", "dragging.js", "controls.js"),
    *(
        "layers_ink.js",
        "layers_points.js",
        "polygons.js",
        "centres.js",
        "layers_centrodes.js",
        "numbers.js",
        "charts.js",
    ),
    "layers.js",
)


def page(mechanism: Mechanism) -> str:
    """The page of a mechanism. Raises NoAnswer where it has no position to start from."""
    data, functions = carried(mechanism)
    scripts = "\n".join([*(asset(name) for name in SCRIPTS), functions, START])
    parts = {
        "title": escape(mechanism.name),
        "styles": "\n".join(asset(name) for name in STYLES),
        "data": told(data),
        "scripts": scripts,
    }
    return filled(asset("page.html"), parts)


START = """
const page = new Page(JSON.parse(document.getElementById("data").textContent), program);
const svg = document.getElementById("drawing"), drawing = new Drawing(page, svg), dragging = new Dragging(page, svg);
const controls = new Controls(page, document.getElementById("controls"), svg, drawing, dragging);
new Courses(page);
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
