"""What the layers of a page have from Python's drawing: arrow heads, round values, sizes, pens and colours."""

from __future__ import annotations

import json
from collections.abc import Mapping
from functools import cache
from typing import Any

import casadi as ca

from planar.analysis.centres.centrodes import AS_ONE_RATIO, INFINITY_RATIO, STANDSTILL_RATIO
from planar.drawing.centres.centres import (
    ARROW_LENGTH,
    ARROW_MARGIN,
    FEW_NAMES,
    FOUND_CENTRE_RADIUS,
    LINE_OVERHANG,
    MAX_LISTED_NAMES,
    PAIR_CENTRE_RADIUS,
)
from planar.drawing.centres.choice import MAX_CENTRES
from planar.drawing.centres.circle_diagram import CHORD_STYLES
from planar.drawing.diagrams.axes import FLAT_HALF_RATIO, FLAT_TOLERANCE
from planar.drawing.forces.action_arrows import ROUND_OFF_RATIO
from planar.drawing.forces.free_bodies import COUPLE_RADII, COUPLE_SWEEP
from planar.drawing.paper.pens import PEN_STYLES
from planar.drawing.paper.picture import Pen
from planar.drawing.paper.scales import DECIMAL_STEPS, DEGREE_STEPS, ROUND_SLACK, SCREEN_DIGITS, round_values
from planar.drawing.paper.stroke_shapes import LINE_END_IN_HEAD, head_length, head_of_length
from planar.drawing.polygons.polygon import FEW_POLE_LETTERS, MAX_POLE_LETTERS, POLE_RADIUS
from planar.drawing.scheme.symbol_table import INPUT_ARC_RADII
from planar.pages.javascript import write_javascript

POWERS = range(-15, 19)
"""Of ten, between which round values are offered."""
PANEL_MM = 4.5
"""px of a millimetre of paper in what is drawn beside the mechanism; in the mechanism's own drawing it depends on the
window."""
LAYER_COLOURS = {
    "velocity": (PEN_STYLES[Pen.VELOCITY].colour, "#7db4ff"),
    "acceleration": (PEN_STYLES[Pen.ACCELERATION].colour, "#ff8d85"),
    "centre": (PEN_STYLES[Pen.CENTRE].colour, "#d9a3ff"),
    "centrode": ("#00695c", "#63d2bf"),
    "reaction": ("#1b7a3d", "#7bd88f"),
    "load": ("#99117c", "#ff94dd"),
    "wanted": (PEN_STYLES[Pen.WANTED].colour, "#ff8ab4"),
}
"""Of layers, where the page is light and where it is dark. Centrodes, reactions and loads have others than on paper, as
a page lays them over velocities and accelerations."""
SERIES_COLOURS = (
    ("#0b5cad", "#6cb2ff"),
    ("#b3261e", "#ff8a80"),
    ("#1b7a3d", "#7bd88f"),
    ("#8a4fbf", "#cf9bff"),
    ("#a35a00", "#ffb45c"),
    ("#0f7c86", "#5fd3dd"),
)
"""Of the points and links that are looked at, in swatches, paths and diagrams."""
LAYER_PENS = {
    "path.path": Pen.PATH,
    "path.velocity": Pen.VELOCITY,
    "path.acceleration": Pen.ACCELERATION,
    "path.part": Pen.PART,
    "path.image": Pen.IMAGE,
    "path.reaction": Pen.REACTION,
    "path.load": Pen.LOAD,
    "path.centre": Pen.CENTRE,
    "circle.centre": Pen.CENTRE,
    "path.kennedy": Pen.CENTRE_LINE,
    "path.centrode.fixed": Pen.FIXED_CENTRODE,
    "path.centrode.moving": Pen.MOVING_CENTRODE,
    "circle.pole": Pen.VELOCITY,
    "circle.circle": Pen.CIRCLE,
    "path.chord.shown": CHORD_STYLES["pair"][0],
    "path.chord.found": CHORD_STYLES["Kennedy"][0],
}
"""The pens of strokes by their classes, later ones before earlier ones."""
LAYER_AREAS = ":is(#drawing .layers, #layers .beside)"
"""Where layers are drawn."""

LETTER_PARTS = {"index_size": 0.7, "drop": 0.25, "told_size": 0.9}
"""Of a letter's height: that of its index and how far this is set low, and that of what is said of it."""
INPUT_ARC_ROOM = 2.0
"""mm between the arrow of an input, which the mechanism's drawing has about the same pins, and that of a couple."""
SIZES: Mapping[str, Any] = {
    "PANEL_MM": PANEL_MM,
    "LINE_END_IN_HEAD": LINE_END_IN_HEAD,
    "COUPLE_ARC": {
        "radii": [each for each in COUPLE_RADII if each >= INPUT_ARC_RADII[0] + INPUT_ARC_ROOM],
        "sweep": COUPLE_SWEEP,
    },
    "FORCE_ROUND_OFF": ROUND_OFF_RATIO,
    "POLE_RADIUS": POLE_RADIUS,
    "DOT_RADIUS": 0.36,
    "CENTRE_RADII": {"shown": PAIR_CENTRE_RADIUS, "found": FOUND_CENTRE_RADIUS},
    "CENTRE_ARROW": {"length": ARROW_LENGTH, "margin": ARROW_MARGIN},
    "LINE_OVERHANG": LINE_OVERHANG,
    "INFINITY_RATIO": INFINITY_RATIO,
    "AS_ONE_RATIO": AS_ONE_RATIO,
    "MAX_CENTRES": MAX_CENTRES,
    "LEAST_SINES": {"apart": 1e-6, "crossing": 1e-3},
    "CENTRE_NAMES": {"most": MAX_LISTED_NAMES, "few": FEW_NAMES},
    "POLYGON_LETTERS": {"most": MAX_POLE_LETTERS, "few": FEW_POLE_LETTERS},
    # of the mechanism: how far out a centrode goes, between which rows it passes through infinity, what stands still
    "CENTRODE": {"farthest": 30, "leap": 8, "still": STANDSTILL_RATIO},
    # over a turn, or about as many over another range
    "PATH_MARKS": 24,
    "SERIES": len(SERIES_COLOURS),
    "AXIS": {"flat": FLAT_TOLERANCE, "half": FLAT_HALF_RATIO, "room": 0.06, "near_zero": 0.3},
    # px, as texts are: the height of letters, and how far from its place one may stand
    "LETTER": {"height": 13, "width": 0.6, "reach": [9, 15, 23, 33], "turns": 16, **LETTER_PARTS},
    "MAX_ARROW_LENGTH": 80,
    "CHART": {
        "height": 240,
        "narrowest": 280,
        "printed": 660,
        "font": 12,
        "head": 24,
        "axes": (34, 64),
        "line": 2,
        "dash": (6, 4),
    },
    "POLYGON_SHEET": {"size": [400, 330], "border": 34},
    "CIRCLE_SHEET": {"size": [260, 260], "radius": 96, "number": 14},
}
"""Sizes (mm on paper unless they are said to be px) and bounds of what scripts draw."""


ROUND_VALUES: Mapping[str, Any] = {
    "ROUND_SLACK": ROUND_SLACK,
    "SCALE_VALUES": round_values(SCREEN_DIGITS, POWERS),
    "STEP_VALUES": round_values(DECIMAL_STEPS, POWERS),
    # a diagram numbers whole degrees
    "DEGREE_VALUES": [each for each in round_values(DEGREE_STEPS, range(3)) if each.is_integer()],
}
"""What scales, and steps between the numbers of an axis or a bar, are chosen from."""

HEAD_ARGUMENTS = {"room": 1, "mm": 1, "tip": 2, "way": 2, "length": 1}
"""Of the functions of an arrow's head, by how many numbers each has."""


@cache
def round_value_script() -> str:
    """The round values of scripts as constants."""
    return _constants(ROUND_VALUES)


def _constants(values: Mapping[str, Any]) -> str:
    return "\n".join(f"const {name} = {json.dumps(each, separators=(',', ':'))};" for name, each in values.items())


@cache
def overlay_script() -> str:
    """The constants of the layers, and how an arrow's head lies, as it is on paper."""
    room, mm, tip, way, length = (ca.SX.sym(name, count) for name, count in HEAD_ARGUMENTS.items())
    head = head_of_length((tip[0], tip[1]), (way[0], way[1]), length)
    found = [*(part for corner in head.corners for part in corner), *head.line_end, head.max_line_width]
    functions = (
        ca.Function("headLength", [room, mm], [head_length(room, mm, ca.fmin)]),
        ca.Function("headOfLength", [tip, way, length], [ca.vertcat(*found)]),
    )
    written = [write_javascript(each.name(), each) for each in functions]
    return "\n".join([_constants(SIZES), round_value_script(), *written])


@cache
def overlay_styles() -> str:
    """The colours and pens of layers, as wide as on paper."""
    named = LAYER_COLOURS | {f"series{k}": each for k, each in enumerate(SERIES_COLOURS)}
    light, dark = (" ".join(f"--{name}: {each[k]};" for name, each in named.items()) for k in (0, 1))
    lines = [
        f":root {{ {light} }}",
        f"@media screen and (prefers-color-scheme: dark) {{ :root:not(.printed) {{ {dark} }} }}",
        *(f".{name} {{ --of: var(--{name}); }}" for name in named),
        f"#layers .beside {{ --mm: {PANEL_MM}; }}",
    ]
    for selector, pen in LAYER_PENS.items():
        style = PEN_STYLES[pen]
        dashes = " ".join(f"calc(var(--mm) * {each:g}px)" for each in style.dashes)
        dashed = f" stroke-dasharray: {dashes};" if dashes else ""
        # not too thin for a screen, nor wider than its arrow's head allows
        width = f"min(max(1px, var(--mm) * {style.width:g}px), var(--widest, 1em))"
        lines.append(f"{LAYER_AREAS} {selector} {{ stroke-width: {width};{dashed} }}")
    return "\n".join(lines)
