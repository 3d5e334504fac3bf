"""Letters in the diagram of circuits, placed where there is room: dead points, assemblies, branches."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from planar.drawing.circuits.curves import CircuitChart, MarkedAssembly
from planar.drawing.circuits.sheet import (
    ASSEMBLY_MARK,
    BRANCH_LINES,
    DEAD_POINT_MARK,
    LEADER_GREY,
    SMALL_TEXT,
    PanelLayout,
    PanelPoint,
    text_settings,
)
from planar.drawing.labels.text_metrics import format_tick, text_size
from planar.foundation.arrays import Array
from planar.foundation.units import parse_unit
from planar.model.wording import number_ranges

if TYPE_CHECKING:
    from matplotlib.axes import Axes


NUMBER_DISTANCE, PANEL_MARGIN, SAME_MARK_DISTANCE = 3.2, 2.0, 0.3
"""mm from an assembly to its number, from there to the panel's edge at the least, and between marks that are one."""
NUMBER_DIRECTIONS = np.arange(8) * np.pi / 4.0
NUMBER_FRACTIONS = np.linspace(0.12, 0.88, 20)
"""Of a strand: where its number may stand."""


def label_dead_points(axes: Axes, sheet: PanelLayout, chart: CircuitChart) -> None:
    """Dead points, with the positions of the input above the panel, at thin lines that lead there."""
    across, up = parse_unit(sheet.input_unit), parse_unit(sheet.output_unit)
    if not chart.dead_points:
        return
    x, y = (np.array(each) for each in zip(*chart.dead_points, strict=True))
    axes.plot(across.from_si(x), up.from_si(y), clip_on=False, zorder=6, gid="dead point", **DEAD_POINT_MARK)
    highest: dict[str, PanelPoint] = {}
    for place, value in sorted(chart.dead_points):
        text = format_tick(float(f"{across.from_si(place):.4g}"))
        if text not in highest or value > highest[text][1]:
            highest[text] = (place, value)
    wide, tall = sheet.panel_size
    texts = list(highest)
    sizes = [text_size(text, SMALL_TEXT) for text in texts]
    flat = sum(size.width + 1.5 for size in sizes) <= wide
    room = [size.width + 1.5 if flat else size.height + 1.2 for size in sizes]
    spots = [sheet.to_paper(*map(np.array, highest[text]))[0] for text in texts]
    for text, spot, at in zip(texts, spots, _spread_texts([spot[0] for spot in spots], room, wide), strict=True):
        ends = np.array([[spot[0], spot[1]], [spot[0], tall], [at, tall + 2.0]]) / [wide, tall]
        axes.plot(*ends.T, transform=axes.transAxes, color=LEADER_GREY, lw=0.4, clip_on=False, zorder=3, gid="leader")
        axes.text(
            at / wide,
            1.0 + 2.4 / tall,
            text,
            transform=axes.transAxes,
            fontsize=SMALL_TEXT,
            rotation=0 if flat else 90,
            ha="center",
            va="bottom",
            **text_settings("dead point"),
        )


def _spread_texts(wanted: Sequence[float], rooms: Sequence[float], wide: float) -> list[float]:
    """Middles of texts in a row, sorted, near where they are wanted, none on another, within so many mm."""
    middles = list(wanted)
    edge = 0.0
    for k, room in enumerate(rooms):
        middles[k] = max(middles[k], edge + room / 2.0)
        edge = middles[k] + room / 2.0
    edge = wide + max(0.0, sum(rooms) - wide)
    for k in reversed(range(len(rooms))):
        middles[k] = min(middles[k], edge - rooms[k] / 2.0)
        edge = middles[k] - rooms[k] / 2.0
    return middles


def label_numbers(axes: Axes, sheet: PanelLayout, chart: CircuitChart) -> None:
    """The numbers of the assemblies at the file's input and those of the branches, where there is room for them."""
    lines = [sheet.to_paper(strand.x, strand.y) for strand in chart.branch_curves]
    dead = [sheet.to_paper(*map(np.array, each)) for each in chart.dead_points]
    lettered = _label_assemblies(axes, sheet, chart, [*lines, *dead])
    if len(chart.circuit.branches) < 2:
        return
    for number in sorted({strand.branch for strand in chart.branch_curves}):
        own = max(
            (k for k, each in enumerate(chart.branch_curves) if each.branch == number), key=lambda k: len(lines[k])
        )
        tried = lines[own][(NUMBER_FRACTIONS * (len(lines[own]) - 1)).astype(int)]
        rest = [line for k, line in enumerate(lines) if k != own]
        at = _clearest_point(tried, np.concatenate([*rest, *dead, *lettered, lines[own][[0, -1]]]))
        lettered.append(at[None])
        _draw_number(axes, sheet, at, str(number), BRANCH_LINES[(number - 1) % len(BRANCH_LINES)][0], "branch")


def _label_assemblies(axes: Axes, sheet: PanelLayout, chart: CircuitChart, taken: Sequence[Array]) -> list[Array]:
    """Marks and numbers of the assemblies; what they take of the panel besides (mm)."""
    lettered: list[Array] = []
    together: dict[tuple[float, float], list[MarkedAssembly]] = {}
    for each in chart.marked_assemblies:
        spot = sheet.to_paper(np.array(each.x), np.array(each.y))
        near = next((key for key in together if np.hypot(*(spot[0] - key)) <= SAME_MARK_DISTANCE), tuple(spot[0]))
        together.setdefault(near, []).append(each)
    for key, marked in together.items():
        spot = np.array([key])
        filled = "black" if any(each.is_sketch for each in marked) else "white"
        axes.plot(
            *(spot[0] / sheet.panel_size),
            transform=axes.transAxes,
            mfc=filled,
            clip_on=False,
            zorder=7,
            gid="assembly",
            **ASSEMBLY_MARK,
        )
        around = spot + NUMBER_DISTANCE * np.column_stack([np.cos(NUMBER_DIRECTIONS), np.sin(NUMBER_DIRECTIONS)])
        inside = around[((around > PANEL_MARGIN) & (around < np.array(sheet.panel_size) - PANEL_MARGIN)).all(axis=1)]
        at = _clearest_point(inside, np.concatenate([*taken, *lettered, spot]))
        lettered += [at[None], spot]
        told = number_ranges(each.number for each in marked if each.number is not None)
        _draw_number(
            axes, sheet, at, told if any(each.number is not None for each in marked) else "", "black", "assembly"
        )
    return lettered


def _clearest_point(tried: Array, taken: Array) -> Array:
    """The one of some places that is farthest from all that is there."""
    return tried[np.argmax(np.hypot(*(tried[:, None] - taken[None]).transpose(2, 0, 1)).min(axis=1))]


def _draw_number(axes: Axes, sheet: PanelLayout, at: Array, text: str, colour: str, gid: str) -> None:
    x, y = at / sheet.panel_size
    axes.text(
        x,
        y,
        text,
        transform=axes.transAxes,
        fontsize=SMALL_TEXT,
        color=colour,
        ha="center",
        va="center",
        zorder=8,
        bbox={"fc": "white", "ec": "none", "pad": 0.4},
        **text_settings(gid),
    )
