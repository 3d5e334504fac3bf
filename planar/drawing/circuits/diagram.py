"""The diagram of all circuits: the input across, an output up, each circuit in a panel of its own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from planar.assemblies.circuits.circuit_of_assembly import Located
from planar.assemblies.circuits.circuits import Circuits
from planar.drawing.circuits.curves import Chart, Reading, Window, charts, readings, telling, window
from planar.drawing.circuits.equal_curves import alike_together
from planar.drawing.circuits.letters import letter_dead_points, letter_numbers
from planar.drawing.circuits.sheet import (
    GAP,
    HERE,
    LARGE,
    LINES,
    MARK,
    NORMAL,
    OTHER,
    SMALL,
    Sheet,
    Spot,
    plain,
)
from planar.drawing.diagrams.drawn_run import MOST_TURNS
from planar.drawing.labels.fonts import FAMILY
from planar.drawing.labels.text_metrics import clipped, measured, signed, wrapped
from planar.drawing.paper.pens import POINT, ready
from planar.drawing.paper.scales import DEGREES, PLAIN, round_step
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.units import unit
from planar.model.wording import amount, many, ranged

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


MM = 1.0 / 25.4
"""inches"""
PANELS = ((1, 1, 120.0, 75.0), (4, 2, 76.0, 56.0), (12, 3, 54.0, 44.0))
"""Up to so many circuits: columns, and mm across and up that each panel takes."""
SHEET, MOST = PANELS[-1][0], 48
"""Circuits of one sheet, and circuits that are drawn."""
LEFT, RIGHT, TOP, BETWEEN, BELOW = 20.0, 6.0, 15.0, 8.0, 14.0
"""mm beside, above and between the panels, and below each for its axis."""
TITLE, LETTERS = 5.0, 8.0
"""mm above a panel for its title, and for the letters of dead points."""
SAMPLE, BESIDE = 9.5, 4.0
"""mm of the key that a line takes, and between two entries."""


def circuits_figures(circuits: Circuits, lying: Sequence[Located], of: str | None = None) -> list[Figure]:
    """The sheets of all circuits: an output over the input, of a point first its x and then its y.

    `lying` are the assemblies that are marked. Raises BadInput for an output that is not there, and NoAnswer where
    there is no circuit.
    """
    ready()
    if not len(circuits):
        raise NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, "no position of the input was found at which it goes together")
    shown = window(circuits)
    outputs = readings(circuits.mechanism, telling(circuits, shown) if of is None else of)
    figures = []
    for reading in outputs:
        drawn = alike_together(charts(circuits, circuits[:MOST], reading, shown, lying), shown)
        sheets = [drawn[first : first + SHEET] for first in range(0, len(drawn), SHEET)]
        columns, *size = next(rest for most, *rest in PANELS if min(len(drawn), SHEET) <= most)
        figures += [_figure(circuits, reading, shown, sheet, columns, (size[0], size[1])) for sheet in sheets]
    return figures


def _figure(
    circuits: Circuits, reading: Reading, shown: Window, drawn: Sequence[Chart], columns: int, size: Spot
) -> Figure:
    from matplotlib.figure import Figure

    columns = min(columns, len(drawn))
    rows = ceil(len(drawn) / columns)
    units = circuits.mechanism.units
    values = np.concatenate([strand.y for each in drawn for strand in each.strands])
    low, high = float(values.min()), float(values.max())
    beside = 0.06 * (high - low) or (0.1 if reading.angle else max(abs(low), 1e-3) * 0.1)
    sheet = Sheet(
        circuits,
        reading,
        shown,
        units.length if shown.slides else units.angle,
        units.angle if reading.angle else units.length,
        low - beside,
        high + beside,
        size,
        TITLE + LETTERS * any(each.dead for each in drawn),
    )
    wide, tall = sheet.size
    whole = LEFT + columns * wide + (columns - 1) * BETWEEN + RIGHT
    keys = _keys(sheet, drawn, whole - 12.0)
    lines = [line for text in _told(circuits) for line in wrapped(text, SMALL, whole - 12.0)]
    line = SMALL * POINT * 1.5
    foot = 4.0 + line * (len(lines) + len(keys)) + 3.0
    height = TOP + rows * (sheet.head + tall + BELOW) + foot
    made = Figure(figsize=(whole * MM, height * MM), facecolor="white")
    boxes = []
    for index, each in enumerate(drawn):
        column, row = index % columns, index // columns
        left, bottom = LEFT + column * (wide + BETWEEN), height - TOP - (row + 1) * (sheet.head + tall + BELOW) + BELOW
        box = (left / whole, bottom / height, wide / whole, tall / height)
        boxes.append(made.add_axes(box, label=f"circuit {each.circuit.number}"))
        _panel(boxes[-1], sheet, each, [other for other in drawn if other is not each], column == 0)
    named = f"{reading.name} over the input {circuits.pair}"
    for text, points, down in ((circuits.mechanism.name, LARGE, 3.0), (f"Circuits: {named}", NORMAL, 8.5)):
        told = clipped(text, points, whole - 8.0)
        made.text(0.5, 1.0 - down / height, told, fontsize=points, ha="center", va="top", **plain("title", told))
    for index, row_ in enumerate(keys):
        _key(made, row_, foot - 4.0 - line * (index + 0.5), whole, height)
    for index, text in enumerate(lines):
        at = foot - 4.0 - line * (len(keys) + index + 0.3)
        made.text(6.0 / whole, at / height, text, fontsize=SMALL, va="top", **plain("caption", text))
    return made


def _told(circuits: Circuits) -> list[str]:
    return [
        f"{many(len(circuits), 'circuit')}, {circuits.complete.value}.",
        *(f"{each[:1].upper()}{each[1:]}." for each in circuits.said),
    ]


def _panel(axes: Axes, sheet: Sheet, chart: Chart, others: Sequence[Chart], first: bool) -> None:
    """One circuit with its axes, the other circuits in grey behind it."""
    across, up = unit(sheet.across), unit(sheet.up)
    axes.set_xlim(across.from_si(sheet.shown.low), across.from_si(sheet.shown.high))
    axes.set_ylim(up.from_si(sheet.low), up.from_si(sheet.high))
    for axis, name, room in (
        (axes.xaxis, sheet.across, sheet.size[0] / 11.0),
        (axes.yaxis, sheet.up, sheet.size[1] / 9.0),
    ):
        low, high = axis.get_view_interval()
        step = round_step((high - low) / room, DEGREES if name == "deg" else PLAIN)
        ticks = [step * k for k in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]
        told = [signed(tick) for tick in ticks] if first or axis is axes.xaxis else []
        axis.set_ticks(ticks, told or [""] * len(ticks), family=FAMILY, fontsize=SMALL)
    axes.tick_params(length=2.0, width=0.5, pad=1.5)
    axes.grid(color="0.9", lw=0.3)
    axes.set_axisbelow(True)
    for side in axes.spines.values():
        side.set_linewidth(0.5)
    x_name = clipped(sheet.circuits.pair, NORMAL, sheet.size[0] - 20.0)
    axes.set_xlabel(f"{x_name} ({sheet.across})", fontsize=NORMAL, labelpad=2.0, **plain("input", x_name))
    if first:
        y_name = clipped(sheet.reading.name, NORMAL, sheet.size[1] - 10.0)
        axes.set_ylabel(f"{y_name} ({sheet.up})", fontsize=NORMAL, labelpad=2.0, **plain("output", y_name))
    _gaps(axes, sheet)
    axes.axvline(across.from_si(sheet.shown.at), zorder=2, gid="file", **HERE)
    for other in others:
        for strand in other.strands:
            axes.plot(across.from_si(strand.x), up.from_si(strand.y), color=OTHER, lw=0.7, zorder=2.5, gid="other")
    for strand in sorted(chart.strands, key=lambda each: each.branch):  # dashes over unbroken lines, where both lie
        colour, dash = LINES[(strand.branch - 1) % len(LINES)]
        axes.plot(
            across.from_si(strand.x),
            up.from_si(strand.y),
            color=colour,
            ls=dash,
            lw=1.2,
            zorder=4,
            gid=f"branch {strand.branch}",
        )
    letter_numbers(axes, sheet, chart)
    letter_dead_points(axes, sheet, chart)
    numbers = [each.number for each in (chart.circuit, *chart.others)]
    named = f"Circuit{'s' * (len(numbers) > 1)} {ranged(numbers)}"
    title = clipped(
        f"{named} of {len(sheet.circuits)}{_goes(chart)}", NORMAL, sheet.size[0] + BETWEEN / 2.0, heavy=True
    )
    axes.annotate(
        title,
        (0.0, 1.0),
        (0.0, (sheet.head - 3.5 if chart.dead else TITLE - 3.5) / POINT),
        "axes fraction",
        "offset points",
        fontsize=NORMAL,
        fontweight="bold",
        ha="left",
        va="bottom",
        **plain("title", title, heavy=True),
    )


def _goes(chart: Chart) -> str:
    circuit = chart.circuit
    if chart.left_out:
        return f", {MOST_TURNS} turns of it"
    turns = max((branch.turns for branch in circuit.branches), default=0)
    if turns:
        return ", all round" if turns == 1 else f", back after {turns} turns"
    told = many(len(circuit.branches), "branch", "branches")
    return f", {told}" if circuit.closed else f", {told}, not closed"


def _gaps(axes: Axes, sheet: Sheet) -> None:
    """Where it does not go together: hatched, with a word where there is room for it."""
    across = unit(sheet.across)
    for low, high in sheet.shown.gaps:
        axes.axvspan(
            across.from_si(low), across.from_si(high), fc="0.97", ec=GAP, hatch="////", lw=0.0, zorder=1, gid="gap"
        )
        per = sheet.size[0] / (sheet.shown.high - sheet.shown.low)
        sides = sorted({low, min(max(sheet.shown.at, low), high), high})
        free = max(pairwise(sides), key=lambda both: both[1] - both[0])
        word, room = "cannot be assembled", (free[1] - free[0]) * per
        if room < 4.0:
            continue
        flat = measured(word, SMALL).width + 2.0 <= room
        axes.text(
            across.from_si(0.5 * (free[0] + free[1])),
            sum(axes.get_ylim()) / 2.0,
            word,
            fontsize=SMALL,
            rotation=0 if flat else 90,
            ha="center",
            va="center",
            zorder=3,
            bbox={"fc": "0.97", "ec": "none", "pad": 1.0},
            **plain("gap"),
        )


Key = tuple[str, dict[str, object]]


def _keys(sheet: Sheet, drawn: Sequence[Chart], room: float) -> list[list[Key]]:
    """What the lines and marks mean, in rows of so many mm at the most."""
    shown = sheet.shown
    mechanism = sheet.circuits.mechanism
    most = max(len(each.circuit.branches) for each in drawn)
    keys: list[Key] = [
        (f"branch {k + 1}", {"color": LINES[k][0], "ls": LINES[k][1], "lw": 1.2}) for k in range(min(most, len(LINES)))
    ]
    if len(drawn) > 1:
        keys.append(("the other circuits", {"color": OTHER, "ls": "-", "lw": 0.7}))
    if any(each.dead for each in drawn):
        keys.append(
            ("dead point, lettered with the input's position", {"ls": "", "marker": "o", "ms": 4.0, "color": "black"})
        )
    at = amount(shown.at, "length" if shown.slides else "angle", mechanism.units)
    keys.append((f"the file's input, {at}", HERE))
    marked = [each for chart in drawn for each in chart.marked]
    if any(not each.own for each in marked):
        keys.append(("assembly there, numbered", {"mfc": "white"} | MARK))
    if any(each.own for each in marked):
        keys.append(("the sketch's own", {"mfc": "black"} | MARK))
    rows: list[list[Key]] = [[]]
    for key in keys:
        if rows[-1] and sum(_long(each) for each in (*rows[-1], key)) > room + BESIDE:
            rows.append([])
        rows[-1].append(key)
    return rows


def _long(key: Key) -> float:
    """mm that an entry takes, with what is left free behind it."""
    return SAMPLE + measured(key[0], SMALL).width + BESIDE


def _key(made: Figure, keys: Sequence[Key], up: float, whole: float, height: float) -> None:
    from matplotlib.lines import Line2D

    left = 6.0
    for text, style in keys:
        xs = [left, left + SAMPLE - 1.5] if style["ls"] else [left + SAMPLE - 3.0]
        made.add_artist(Line2D([x / whole for x in xs], [up / height] * len(xs), gid="key", **style))
        made.text((left + SAMPLE) / whole, up / height, text, fontsize=SMALL, va="center", **plain("key", text))
        left += _long((text, style))
