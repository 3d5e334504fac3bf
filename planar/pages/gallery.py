"""A folder of pages, a mechanism each, and an index of small moving pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

import numpy as np

from planar.document.files import read_asset
from planar.drawing.scheme.scene import plain_frames
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.safe_files import make_folder, save_file
from planar.foundation.time_limit import report_progress, within_time
from planar.model.mechanism import Mechanism
from planar.pages.data.dimension_numbers import DimensionNumbers
from planar.pages.data.scheme_data import frames_of_rows, scheme_data
from planar.pages.drawing_style import pen_styles, symbol_script
from planar.pages.gallery_kinds import KINDS, kind_and_search_text
from planar.pages.overlay_style import round_value_script
from planar.pages.page import PageLink, fill_template, page, script_safe_json
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import rest_position, solved_mechanism

SCRIPTS = (
    "stage/plane.js",
    "stage/symbols.js",
    "stage/strokes.js",
    "stage/letters.js",
    "stage/drawing.js",
    "gallery.js",
)
STYLES = ("page.css", "stage/stage.css", "gallery.css", "print.css")
"""The drawing as pages have it, and what moves many of them."""

PICTURE_STEPS = 36
"""Of the motion in a small picture, between which it goes on evenly."""
PICTURE_DIGITS = 5
"""Of places and angles there: less than a hundredth of a pixel."""


def write_gallery(
    models: Sequence[tuple[str, Mechanism]],
    folder: Path,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[Path, list[tuple[str, NoAnswer]]]:
    """Write a page for each mechanism under its name, and the index; gives the index's path.

    Mechanisms that have no position to start from are left out and given back with the reason; where time is over those
    done by then alone are written. `progress` is told
    after each how many are done, of how many. Raises BadInput where the folder or a file cannot be written.
    """
    make_folder(folder)
    taken, shown, refused = {"index"}, [], []
    for done, (name, mechanism) in enumerate(within_time(models), start=1):
        try:
            drawn = solved_mechanism(mechanism).completed_mechanism
            text, moving = page(drawn, back=PageLink("index.html", "All mechanisms")), small_picture_data(drawn)
        except NoAnswer as problem:
            refused.append((name, problem))
            continue
        finally:
            report_progress(done, len(models))
            if progress is not None:
                progress(done, len(models))
        file = _unused_name(name, taken)
        save_file(folder / f"{file}.html", text)
        under, words = kind_and_search_text(mechanism, name)
        titles = {"name": mechanism.name, "about": mechanism.about or "", "href": quote(f"{file}.html")}
        shown.append(moving | titles | {"kind": under, "words": words})
    save_file(folder / "index.html", index_page(shown))
    return folder / "index.html", refused


def index_page(shown: list[dict[str, Any]]) -> str:
    """The page of small pictures, kind after kind."""
    shown = sorted(shown, key=lambda each: KINDS.index(each["kind"]))
    kinds = [(kind, [each for each in shown if each["kind"] == kind]) for kind in KINDS]
    kinds = [(kind, own) for kind, own in kinds if own]
    links = "".join(f'<a href="#kind-{KINDS.index(kind)}">{escape(kind)}</a> ' for kind, _ in kinds)
    title = escape(f"{len(shown)} mechanisms" if len(shown) != 1 else "1 mechanism")
    drawn = ",\n".join(each["drawn"] for each in shown)
    shown = [{name: value for name, value in each.items() if name != "drawn"} for each in shown]
    scripts = "\n".join([symbol_script(), round_value_script(), f"const DRAWN = [{drawn}];", *map(read_asset, SCRIPTS)])
    styles = "\n".join([*map(read_asset, STYLES), pen_styles()]).replace("#drawing", ".small")  # a page has one drawing
    parts = {
        "title": title,
        "styles": styles,
        "kinds": links if len(kinds) > 1 else "",
        "list": "\n".join(_kind_section(kind, own) for kind, own in kinds),
        "data": script_safe_json(shown),
        "scripts": scripts,
    }
    return fill_template(read_asset("gallery.html"), parts)


def _kind_section(kind: str, shown: Sequence[dict[str, Any]]) -> str:
    """The mechanisms of a kind, which stand there also without scripts."""
    items = [
        f'<li><a href="{escape(each["href"])}"><strong>{escape(each["name"])}</strong>'
        f"<span>{escape(each['about'])}</span></a></li>"
        for each in shown
    ]
    number = KINDS.index(kind)
    return f'<section id="kind-{number}"><h2>{escape(kind)}</h2><ul>{"".join(items)}</ul></section>'


def small_picture_data(mechanism: Mechanism) -> dict[str, Any]:
    """What a small picture is drawn from: how the links look, and where they are at every step.

    `closed` says whether the motion comes back to its start, so that it goes round, not to and fro; `drawn` is a
    function of scripts. What nothing can move is shown where it stands.
    """
    if solved_mechanism(mechanism).motion_refusal() is None:
        positions = frames_of_rows(_picture_motion(mechanism))
    else:
        positions = [plain_frames(rest_position(mechanism).frames)]
    fixed = DimensionNumbers(mechanism, live=False)
    scheme, numbers = scheme_data(mechanism, fixed, positions, PICTURE_DIGITS)
    links = [link.name for link in mechanism.links]
    paths = [
        np.array([[frames[link].x, frames[link].y, frames[link].angle] for frames in positions])
        for link in links
        if link != mechanism.frame
    ]
    whole = 2.0 * np.pi
    closed = all(
        np.abs(p[-1] - p[0] - [0.0, 0.0, whole * round((p[-1, 2] - p[0, 2]) / whole)]).max() < 1e-6 for p in paths
    )
    return {
        "frame": mechanism.frame,
        "links": links,
        "scheme": scheme | {"arrows": [], "letters": []},
        "size": solved_mechanism(mechanism).solver.unit,
        "frames": [[_round_digits(value) for value in path.ravel()] for path in paths],
        "closed": closed and len(positions) > 1,
        "drawn": numbers.to_javascript(),
    }


def _picture_motion(mechanism: Mechanism) -> Motion:
    """The motion of the first input over its own range; of a slide without limits, its own size either way."""
    given = mechanism.inputs[0]
    lawful = any(each.law is not None for each in mechanism.inputs)
    try:
        return cycle(mechanism, PICTURE_STEPS) if lawful else cycle(mechanism, PICTURE_STEPS, pair=given.pair)
    except BadInput:
        far = solved_mechanism(mechanism).solver.unit
        return cycle(mechanism, PICTURE_STEPS, given.position - far, given.position + far, given.pair)


def _round_digits(value: float) -> float:
    return float(f"{float(value):.{PICTURE_DIGITS}g}")


def _unused_name(name: str, taken: set[str]) -> str:
    """A name for a file that no other of the folder has, on any system."""
    kept = "".join(each if each.isalnum() or each in "-_." else "-" for each in name)[:80].strip(".-") or "mechanism"
    found, again = kept, 1
    while found.lower() in taken:
        again += 1
        found = f"{kept}-{again}"
    taken.add(found.lower())
    return found
