"""One self-contained HTML file: the mechanism's data and equations, and the scripts that show and move it."""

from __future__ import annotations

import json
from html import escape
from typing import Any, NamedTuple

import numpy as np

from planar.document.files import read_asset
from planar.model.mechanism import Mechanism
from planar.pages.data.page_data import page_data
from planar.pages.data.wanted_data import PageTask, wanted_data
from planar.pages.drawing_style import pen_styles, symbol_script
from planar.pages.notebook import pack_scripts
from planar.pages.overlay_style import overlay_script, overlay_styles
from planar.pages.still_picture import still_svg
from planar.solving.position import rest_remarks


class PageLink(NamedTuple):
    """A link to another page, by its address and in words."""

    address: str
    words: str


class EditedFile(NamedTuple):
    """A file that is drawn on: its JSON value, its name if it has one, and what is told of it (`edit_answer`).

    `mark` is what tells its content from any other; `note` is a sentence that the page shows when it is opened.
    """

    value: Any
    name: str | None
    answer: dict[str, Any]
    mark: str = ""
    note: str = ""


class PageRange(NamedTuple):
    """The input that runs on a page: its number, and both ends of its range (rad or m).

    Without ends its range is a turn, or from limit to limit.
    """

    running: int
    low: float | None = None
    high: float | None = None


STYLES = (
    "stage/still.css",
    "uplot/uPlot.min.css",
    "page.css",
    "stage/stage.css",
    "stage/lens.css",
    "layers/layers.css",
    "controls/dimensions.css",
    "wanted/wanted.css",
    "print.css",
)
SCRIPTS = (
    "uplot/uPlot.iife.min.js",
    "solve/singular.js",
    "solve/stops.js",
    "solve/linkage.js",
    "page.js",
    "solve/course.js",
    "solve/slopes.js",
    "stage/plane.js",
    "stage/symbols.js",
    "stage/strokes.js",
    "stage/letters.js",
    "solve/poses.js",
    "stage/drawing.js",
    "controls/dragging.js",
    "controls/controls.js",
    "controls/figures.js",
    "layers/ink.js",
    "layers/points.js",
    "layers/polygons.js",
    "layers/centres.js",
    "layers/centrodes.js",
    "solve/friction.js",
    "solve/forces.js",
    "layers/forces.js",
    "controls/forces_table.js",
    "controls/numbers.js",
    "controls/charts.js",
    "layers/bands.js",
    "layers/layers.js",
    "controls/dimensions.js",
    "controls/influence.js",
    "wanted/wanted_fit.js",
    "wanted/wanted.js",
    "wanted/wanted_drawing.js",
    "wanted/wanted_table.js",
    "wanted/wish.js",
    "wanted/wish_form.js",
    "wanted/wish_stroke.js",
    "controls/assemblies.js",
    "controls/acting.js",
    "controls/keeping.js",
    "additions/input_rates.js",
    "additions/links.js",
    "controls/panels.js",
    "stage/lens.js",
    "stage/coupled.js",
    "stage/places.js",
    "stage/placed_pages.js",
    "stage/pins.js",
    "additions/stage_tools.js",
    "additions/additions.js",
    "controls/undo.js",
    "controls/saving.js",
    "films/gif.js",
    "films/films.js",
    "start.js",
)


START = 'beginPage(JSON.parse(document.getElementById("data").textContent), program);'
EDITOR_SCRIPTS = (
    "editor/server.js",
    "editor/document.js",
    "editor/couplings.js",
    "editor/sketch.js",
    "editor/leading.js",
    "editor/hand.js",
    "editor/underlay.js",
    "editor/synthesis.js",
    "editor/filing.js",
    "editor/tool_numbers.js",
    "editor/panel.js",
    "editor/editing.js",
)
"""What a page has besides on which a mechanism is drawn."""
EDITOR_STYLES = ("editor/editor.css",)


def page(  # many: what is shown, and how
    mechanism: Mechanism,
    z: np.ndarray | None = None,
    window: PageRange | None = None,
    *,
    back: PageLink | None = None,
    layers: tuple[str, ...] = ("paths",),
    library: bool | None = None,
    wanted: PageTask | None = None,
    edited: EditedFile | None = None,
) -> str:
    """The page of a mechanism at its inputs.

    `z` are the unknowns of the assembly, left out that nearest to the sketch; `window` is the input that runs and its
    range, by default the first input with a rate, and a turn or from limit to limit. `back` leads to an index, `layers`
    are shown at first. `library` is of notebooks: the page carries the scripts for others beside it (True), or takes
    them from one of those (False). `wanted` is what the page shows under the mechanism, to be dragged; `edited` the
    file that its server draws on. Raises NoAnswer where it has no position to start from, BadInput for something wanted
    of what it does not have.
    """
    data, functions = page_data(mechanism, z)
    data["window"] = window._asdict() if window is not None and window.low is not None else None
    data["layers"] = layers
    data["running"] = data["running"] if window is None else window.running
    data["wanted"] = wanted_data(mechanism, data, wanted)
    data["edited"] = edited and edited._asdict()
    own = (EDITOR_SCRIPTS, EDITOR_STYLES) if edited else ((), ())
    styles = "\n".join([overlay_styles(), *map(read_asset, STYLES + own[1]), pen_styles()])
    scripts = "\n".join([symbol_script(), overlay_script(), *map(read_asset, SCRIPTS + own[0])])
    start = f"{functions}\n{START}"
    if library is not None:
        key, carrying = pack_scripts(styles, scripts)
        carrying = json.dumps(carrying) if library else "null"
        styles = read_asset("stage/still.css")
        scripts, start = read_asset("shared.js"), f"shareScripts({json.dumps(key)}, {carrying}, () => {{\n{start}\n}});"
    parts = {
        "title": escape(mechanism.name),
        "back": f'<a class="back" href="{escape(back.address)}">{escape(back.words)}</a>' if back else "",
        # on a page to draw on this is said beside the drawing, as it changes
        "about": _about(mechanism) + ("" if edited else _rest(mechanism)),
        "still": still_svg(mechanism, z),
        "notes": _notes(mechanism),
        "styles": styles,
        "policy": "; connect-src 'self'" if edited else "",
        "data": script_safe_json(data),
        "scripts": f"{scripts}\n{start}",
    }
    return fill_template(read_asset("page.html"), parts)


def _about(mechanism: Mechanism) -> str:
    """What the file says that the mechanism is, and where it is from."""
    about = f"<p>{escape(mechanism.about)}</p>" if mechanism.about else ""
    source = f'<p class="source">Source: {escape(mechanism.source)}</p>' if mechanism.source else ""
    return about + source


def _rest(mechanism: Mechanism) -> str:
    """Why nothing moves the mechanism, where nothing does."""
    return "".join(f'<p class="rest">{escape(remark)}</p>' for remark in rest_remarks(mechanism))


def _notes(mechanism: Mechanism) -> str:
    """The notes of the file."""
    if not mechanism.notes:
        return ""
    each = "".join(f"<li>{escape(note)}</li>" for note in mechanism.notes)
    return f'<section id="notes"><h2>Notes</h2><ul>{each}</ul></section>\n'


def fill_template(template: str, parts: dict[str, str]) -> str:
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


def script_safe_json(value: Any) -> str:
    """A JSON text that ends no script, whatever texts it holds."""
    text = json.dumps(value, ensure_ascii=False, allow_nan=False)
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
