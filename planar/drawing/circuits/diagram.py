"""The diagram of all circuits: the input across, an output up, each circuit in a panel of its own."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise
from math import ceil, floor
from typing import TYPE_CHECKING

import numpy as np

from planar.assemblies.circuits.circuit_of_assembly import LocatedAssembly
from planar.assemblies.circuits.circuits import Circuits
from planar.assemblies.selection import selection_words
from planar.drawing.circuits.curves import (
    CircuitChart,
    InputWindow,
    PlottedOutput,
    choose_output,
    circuit_charts,
    drawn_motion,
    input_window,
    plotted_outputs,
)
from planar.drawing.circuits.equal_curves import merge_equal_charts
from planar.drawing.circuits.letters import label_dead_points, label_numbers
from planar.drawing.circuits.sheet import (
    ASSEMBLY_MARK,
    BRANCH_LINES,
    GAP_GREY,
    INPUT_LINE,
    LARGE_TEXT,
    NORMAL_TEXT,
    OTHER_GREY,
    SMALL_TEXT,
    ArtistStyle,
    PanelLayout,
    PanelPoint,
    text_settings,
)
from planar.drawing.diagrams.drawn_run import MAX_TURNS
from planar.drawing.labels.fonts import DRAWING_FAMILY
from planar.drawing.labels.text_metrics import clip_text, format_tick, text_size, wrap_text
from planar.drawing.paper.pens import MM_PER_POINT, require_matplotlib
from planar.drawing.paper.scales import DECIMAL_STEPS, DEGREE_STEPS, round_step
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.units import parse_unit
from planar.model.wording import amount, count_phrase, number_ranges

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


INCHES_PER_MM = 1.0 / 25.4
"""inches"""
PANEL_GRIDS = ((1, 1, 120.0, 75.0), (4, 2, 76.0, 56.0), (12, 3, 54.0, 44.0))
"""Up to so many circuits: columns, and mm across and up that each panel takes."""
MAX_PANELS_PER_SHEET, MAX_CIRCUITS = PANEL_GRIDS[-1][0], 48
"""Circuits of one sheet, and circuits that are drawn."""
LEFT_MARGIN, RIGHT_MARGIN, TOP_MARGIN, PANEL_GAP, AXIS_HEIGHT = 20.0, 6.0, 15.0, 8.0, 14.0
"""mm beside, above and between the panels, and below each for its axis."""
TITLE_HEIGHT, DEAD_POINT_LABEL_HEIGHT = 5.0, 8.0
"""mm above a panel for its title, and for the letters of dead points."""
KEY_LINE_LENGTH, KEY_GAP = 9.5, 4.0
"""mm of the key that a line takes, and between two entries."""


def circuit_figures(circuits: Circuits, assemblies: Sequence[LocatedAssembly], of: str | None = None) -> list[Figure]:
    """The sheets of all circuits: an output over the input, of a point first its x and then its y.

    `lying` are the assemblies that are marked. Raises BadInput for an output that is not there, and NoAnswer where
    there is no circuit.
    """
    require_matplotlib()
    if not len(circuits):
        raise NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, "no position of the input was found at which it goes together")
    shown = input_window(circuits)
    motions = [drawn_motion(circuits, each, shown) for each in circuits[:MAX_CIRCUITS]]
    outputs = plotted_outputs(circuits.mechanism, choose_output(circuits, motions, shown) if of is None else of)
    figures = []
    for reading in outputs:
        drawn = merge_equal_charts(circuit_charts(circuits, motions, reading, shown, assemblies), shown)
        sheets = [drawn[first : first + MAX_PANELS_PER_SHEET] for first in range(0, len(drawn), MAX_PANELS_PER_SHEET)]
        most = min(len(drawn), MAX_PANELS_PER_SHEET)
        columns, size = next((across, (wide, tall)) for up_to, across, wide, tall in PANEL_GRIDS if most <= up_to)
        figures += [_sheet_figure(circuits, reading, shown, sheet, columns, size) for sheet in sheets]
    return figures


def _sheet_figure(
    circuits: Circuits,
    reading: PlottedOutput,
    shown: InputWindow,
    drawn: Sequence[CircuitChart],
    columns: int,
    size: PanelPoint,
) -> Figure:
    from matplotlib.figure import Figure

    columns = min(columns, len(drawn))
    rows = ceil(len(drawn) / columns)
    units = circuits.mechanism.units
    values = np.concatenate([strand.y for each in drawn for strand in each.branch_curves])
    low, high = float(values.min()), float(values.max())
    beside = 0.06 * (high - low) or (0.1 if reading.is_angle else max(abs(low), 1e-3) * 0.1)
    sheet = PanelLayout(
        circuits,
        reading,
        shown,
        units.length if shown.is_length else units.angle,
        units.angle if reading.is_angle else units.length,
        low - beside,
        high + beside,
        size,
        TITLE_HEIGHT + DEAD_POINT_LABEL_HEIGHT * any(each.dead_points for each in drawn),
    )
    wide, tall = sheet.panel_size
    whole = LEFT_MARGIN + columns * wide + (columns - 1) * PANEL_GAP + RIGHT_MARGIN
    keys = _key_rows(sheet, drawn, whole - 12.0)
    lines = [line for text in _caption_sentences(circuits) for line in wrap_text(text, SMALL_TEXT, whole - 12.0)]
    line = SMALL_TEXT * MM_PER_POINT * 1.5
    foot = 4.0 + line * (len(lines) + len(keys)) + 3.0
    height = TOP_MARGIN + rows * (sheet.head_height + tall + AXIS_HEIGHT) + foot
    made = Figure(figsize=(whole * INCHES_PER_MM, height * INCHES_PER_MM), facecolor="white")
    boxes = []
    for index, each in enumerate(drawn):
        column, row = index % columns, index // columns
        left, bottom = (
            LEFT_MARGIN + column * (wide + PANEL_GAP),
            height - TOP_MARGIN - (row + 1) * (sheet.head_height + tall + AXIS_HEIGHT) + AXIS_HEIGHT,
        )
        box = (left / whole, bottom / height, wide / whole, tall / height)
        boxes.append(made.add_axes(box, label=f"circuit {each.circuit.number}"))
        _draw_panel(boxes[-1], sheet, each, [other for other in drawn if other is not each], column == 0)
    named = f"{reading.name} over the input {circuits.pair}"
    for text, points, down in ((circuits.mechanism.name, LARGE_TEXT, 3.0), (f"Circuits: {named}", NORMAL_TEXT, 8.5)):
        told = clip_text(text, points, whole - 8.0)
        made.text(
            0.5, 1.0 - down / height, told, fontsize=points, ha="center", va="top", **text_settings("title", told)
        )
    for index, row_ in enumerate(keys):
        _draw_key_row(made, row_, foot - 4.0 - line * (index + 0.5), whole, height)
    for index, text in enumerate(lines):
        at = foot - 4.0 - line * (len(keys) + index + 0.3)
        made.text(6.0 / whole, at / height, text, fontsize=SMALL_TEXT, va="top", **text_settings("caption", text))
    return made


def _caption_sentences(circuits: Circuits) -> list[str]:
    return [
        f"{count_phrase(len(circuits), 'circuit')}, {circuits.complete.value}.",
        *(f"{each[:1].upper()}{each[1:]}." for each in circuits.remarks),
    ]


def _draw_panel(
    axes: Axes, sheet: PanelLayout, chart: CircuitChart, others: Sequence[CircuitChart], with_ordinate: bool
) -> None:
    """One circuit with its axes, the other circuits in grey behind it."""
    _draw_axes(axes, sheet, with_ordinate)
    _draw_gaps(axes, sheet)
    _draw_branch_curves(axes, sheet, chart, others)
    label_numbers(axes, sheet, chart)
    label_dead_points(axes, sheet, chart)
    _write_panel_title(axes, sheet, chart)


def _draw_axes(axes: Axes, sheet: PanelLayout, with_ordinate: bool) -> None:
    """The axes over the window, with ticks, a grid and names; the upright one is named and numbered if wanted."""
    across, up = parse_unit(sheet.input_unit), parse_unit(sheet.output_unit)
    axes.set_xlim(across.from_si(sheet.window.low), across.from_si(sheet.window.high))
    axes.set_ylim(up.from_si(sheet.output_low), up.from_si(sheet.output_high))
    for axis, name, room in (
        (axes.xaxis, sheet.input_unit, sheet.panel_size[0] / 11.0),
        (axes.yaxis, sheet.output_unit, sheet.panel_size[1] / 9.0),
    ):
        low, high = axis.get_view_interval()
        step = round_step((high - low) / room, DEGREE_STEPS if name == "deg" else DECIMAL_STEPS)
        ticks = [step * k for k in range(ceil(low / step - 1e-9), floor(high / step + 1e-9) + 1)]
        told = [format_tick(tick) for tick in ticks] if with_ordinate or axis is axes.xaxis else []
        axis.set_ticks(ticks, told or [""] * len(ticks), family=DRAWING_FAMILY, fontsize=SMALL_TEXT)
    axes.tick_params(length=2.0, width=0.5, pad=1.5)
    axes.grid(color="0.9", lw=0.3)
    axes.set_axisbelow(True)
    for side in axes.spines.values():
        side.set_linewidth(0.5)
    x_name = clip_text(sheet.circuits.pair, NORMAL_TEXT, sheet.panel_size[0] - 20.0)
    axes.set_xlabel(
        f"{x_name} ({sheet.input_unit})", fontsize=NORMAL_TEXT, labelpad=2.0, **text_settings("input", x_name)
    )
    if with_ordinate:
        y_name = clip_text(sheet.output.name, NORMAL_TEXT, sheet.panel_size[1] - 10.0)
        axes.set_ylabel(
            f"{y_name} ({sheet.output_unit})", fontsize=NORMAL_TEXT, labelpad=2.0, **text_settings("output", y_name)
        )


def _draw_branch_curves(axes: Axes, sheet: PanelLayout, chart: CircuitChart, others: Sequence[CircuitChart]) -> None:
    """The branches of a circuit, each in its own line, those of the others in grey, and where the file's input is."""
    across, up = parse_unit(sheet.input_unit), parse_unit(sheet.output_unit)
    axes.axvline(across.from_si(sheet.window.input_position), zorder=2, gid="file", **INPUT_LINE)
    for other in others:
        for strand in other.branch_curves:
            axes.plot(across.from_si(strand.x), up.from_si(strand.y), color=OTHER_GREY, lw=0.7, zorder=2.5, gid="other")
    for strand in sorted(
        chart.branch_curves, key=lambda each: each.branch
    ):  # dashes over unbroken lines, where both lie
        colour, dash = BRANCH_LINES[(strand.branch - 1) % len(BRANCH_LINES)]
        axes.plot(
            across.from_si(strand.x),
            up.from_si(strand.y),
            color=colour,
            ls=dash,
            lw=1.2,
            zorder=4,
            gid=f"branch {strand.branch}",
        )


def _write_panel_title(axes: Axes, sheet: PanelLayout, chart: CircuitChart) -> None:
    """Which circuits the panel is of."""
    numbers = [each.number for each in (chart.circuit, *chart.equal_circuits)]
    named = f"Circuit{'s' * (len(numbers) > 1)} {number_ranges(numbers)}"
    title = clip_text(
        f"{named} of {len(sheet.circuits)}{_title_suffix(chart)}",
        NORMAL_TEXT,
        sheet.panel_size[0] + PANEL_GAP / 2.0,
        heavy=True,
    )
    axes.annotate(
        title,
        (0.0, 1.0),
        (0.0, (sheet.head_height - 3.5 if chart.dead_points else TITLE_HEIGHT - 3.5) / MM_PER_POINT),
        "axes fraction",
        "offset points",
        fontsize=NORMAL_TEXT,
        fontweight="bold",
        ha="left",
        va="bottom",
        **text_settings("title", title, heavy=True),
    )


def _title_suffix(chart: CircuitChart) -> str:
    circuit = chart.circuit
    if chart.left_out:
        return f", {MAX_TURNS} turns of it"
    turns = max((branch.turns for branch in circuit.branches), default=0)
    if turns:
        return ", all round" if turns == 1 else f", back after {turns} turns"
    told = count_phrase(len(circuit.branches), "branch", "branches")
    return f", {told}" if circuit.closed else f", {told}, not closed"


def _draw_gaps(axes: Axes, sheet: PanelLayout) -> None:
    """Where it does not go together: hatched, with a word where there is room for it."""
    across = parse_unit(sheet.input_unit)
    for low, high in sheet.window.gaps:
        axes.axvspan(
            across.from_si(low), across.from_si(high), fc="0.97", ec=GAP_GREY, hatch="////", lw=0.0, zorder=1, gid="gap"
        )
        per = sheet.panel_size[0] / (sheet.window.high - sheet.window.low)
        sides = sorted({low, min(max(sheet.window.input_position, low), high), high})
        free = max(pairwise(sides), key=lambda both: both[1] - both[0])
        word, room = "cannot be assembled", (free[1] - free[0]) * per
        if room < 4.0:
            continue
        flat = text_size(word, SMALL_TEXT).width + 2.0 <= room
        axes.text(
            across.from_si(0.5 * (free[0] + free[1])),
            sum(axes.get_ylim()) / 2.0,
            word,
            fontsize=SMALL_TEXT,
            rotation=0 if flat else 90,
            ha="center",
            va="center",
            zorder=3,
            bbox={"fc": "0.97", "ec": "none", "pad": 1.0},
            **text_settings("gap"),
        )


KeyEntry = tuple[str, ArtistStyle]


def _key_rows(sheet: PanelLayout, drawn: Sequence[CircuitChart], room: float) -> list[list[KeyEntry]]:
    """What the lines and marks mean, in rows of so many mm at the most."""
    shown = sheet.window
    mechanism = sheet.circuits.mechanism
    most = max(len(each.circuit.branches) for each in drawn)
    keys: list[KeyEntry] = [
        (f"branch {k + 1}", {"color": BRANCH_LINES[k][0], "ls": BRANCH_LINES[k][1], "lw": 1.2})
        for k in range(min(most, len(BRANCH_LINES)))
    ]
    if len(drawn) > 1:
        keys.append(("the other circuits", {"color": OTHER_GREY, "ls": "-", "lw": 0.7}))
    if any(each.dead_points for each in drawn):
        keys.append(
            ("dead point, lettered with the input's position", {"ls": "", "marker": "o", "ms": 4.0, "color": "black"})
        )
    at = amount(shown.input_position, "length" if shown.is_length else "angle", mechanism.units)
    keys.append((f"the file's input, {at}", INPUT_LINE))
    marked = [each for chart in drawn for each in chart.marked_assemblies]
    if any(not each.is_sketch for each in marked):
        keys.append(("assembly there, numbered", {"mfc": "white"} | ASSEMBLY_MARK))
    if any(each.is_sketch for each in marked):
        keys.append((selection_words(mechanism), {"mfc": "black"} | ASSEMBLY_MARK))
    rows: list[list[KeyEntry]] = [[]]
    for key in keys:
        if rows[-1] and sum(_entry_width(each) for each in (*rows[-1], key)) > room + KEY_GAP:
            rows.append([])
        rows[-1].append(key)
    return rows


def _entry_width(key: KeyEntry) -> float:
    """mm that an entry takes, with what is left free behind it."""
    return KEY_LINE_LENGTH + text_size(key[0], SMALL_TEXT).width + KEY_GAP


def _draw_key_row(made: Figure, keys: Sequence[KeyEntry], up: float, whole: float, height: float) -> None:
    from matplotlib.lines import Line2D

    left = 6.0
    for text, style in keys:
        xs = [left, left + KEY_LINE_LENGTH - 1.5] if style["ls"] else [left + KEY_LINE_LENGTH - 3.0]
        made.add_artist(Line2D([x / whole for x in xs], [up / height] * len(xs), gid="key", **style))
        made.text(
            (left + KEY_LINE_LENGTH) / whole,
            up / height,
            text,
            fontsize=SMALL_TEXT,
            va="center",
            **text_settings("key", text),
        )
        left += _entry_width((text, style))
