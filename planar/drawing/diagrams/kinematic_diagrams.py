"""Kinematic diagrams: displacement, velocity and acceleration over time, to scale, below each other on one axis."""

from __future__ import annotations

from math import ceil, degrees, floor, isclose
from numbers import Integral, Real
from typing import TYPE_CHECKING

import numpy as np

from planar.drawing.diagrams.captions import Ordinate, Sheet, caption, inner, raised
from planar.drawing.diagrams.drawn_run import steady
from planar.drawing.diagrams.motion_curves import (
    Chords,
    Curve,
    chords,
    default_subject,
    slide_of,
    subject,
)
from planar.drawing.labels.fonts import FAMILY, families
from planar.drawing.labels.text_metrics import clipped, measured, signed
from planar.drawing.paper.pens import POINT, ready
from planar.drawing.paper.scales import DEGREES, PLAIN, fitting, round_step
from planar.foundation.errors import BadInput
from planar.foundation.units import SI, coherent, length_of_rates, own, unit
from planar.model.mechanism import Mechanism, motions
from planar.model.wording import amount
from planar.results.motion import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

Array = np.ndarray

MM = 1.0 / 25.4
"""inches"""
LEFT, RIGHT, TOP, GAP, BETWEEN = 24.0, 22.0, 22.0, 11.0, 11.0
"""mm on paper beside the diagrams, above them, between them, and from one axis below them to the next."""
ROOM = 46.0
"""mm that a curve takes up and down at the most."""
NARROWEST, WIDEST = 60.0, 1000.0
MOST_CHORDS = 180
SMALL, NORMAL, LARGE = 7.0, 8.0, 10.0
"""points"""
DASHES = ("-", (0, (5.0, 2.0)))
INK, RULE, GRID, CHORD = "black", "0.72", "0.88", "tab:blue"
SYMBOLS = {False: ("S", "V", "a"), True: ("φ", "ω", "ε")}
"""Of a slide or a point, and of a link; the chapter's α is the angle of the crank."""


def diagrams(
    motion: Motion | Mechanism, of: str | None = None, chords: int | None = None, width: float = 120.0
) -> Figure:
    """S-t, V-t and a-t diagrams, as `planar.plot.diagrams` has them. Raises BadInput, NoAnswer."""
    if isinstance(width, bool) or not isinstance(width, Real) or not NARROWEST <= width <= WIDEST:
        raise BadInput("width", f"a time axis of {NARROWEST:g} to {WIDEST:g} mm is wanted, not {width!r:.40}")
    if chords is not None and (
        isinstance(chords, bool) or not isinstance(chords, Integral) or not 2 <= chords <= MOST_CHORDS
    ):
        raise BadInput("chords", f"a whole number of chords from 2 to {MOST_CHORDS} is wanted, not {chords!r:.40}")
    mechanism = motion.mechanism if isinstance(motion, Motion) else motion
    of = default_subject(mechanism) if of is None else of
    slide = slide_of(mechanism, of)
    if slide is not None and mechanism.frame not in motions(mechanism)[slide].links:
        slide = None
    count = chords or 12
    run = steady(motion, slide, count=count)
    return _drawn(Sheet(run, subject(run, of), mechanism.units, float(width), count, chords))


def _drawn(sheet: Sheet) -> Figure:
    ready()
    from matplotlib.figure import Figure

    from planar.drawing.labels.matplotlib_text import write

    ordinates = [_ordinate(sheet, index) for index in range(3)]
    lines = caption(sheet, ordinates, SMALL, LEFT + sheet.width + RIGHT - 8.0)
    line = SMALL * POINT * 1.45
    rulers = [_angle_axis] * (not sheet.run.in_time) + [_time_axis] * sheet.run.timed
    below = GAP / 2.0 + len(rulers) * BETWEEN + 2.0 + line * len(lines) + 3.0
    heights = [each.high - each.low for each in ordinates]
    size = (LEFT + sheet.width + RIGHT, TOP + sum(heights) + 2.0 * GAP + below)
    made = Figure(figsize=(size[0] * MM, size[1] * MM), facecolor="white")
    bottom = size[1] - TOP
    charts: list[Axes] = []
    for index, each in enumerate(ordinates):
        bottom -= heights[index]
        box = (LEFT / size[0], bottom / size[1], sheet.width / size[0], heights[index] / size[1])
        charts.append(made.add_axes(box, label=each.name))
        _chart(charts[-1], sheet, each, index)
        bottom -= GAP
    bottom += GAP - GAP / 2.0
    for ruler in rulers:
        bottom -= BETWEEN / 2.0
        axis = made.add_axes((LEFT / size[0], bottom / size[1], sheet.width / size[0], 0.01 / size[1]))
        ruler(axis, sheet)
        bottom -= BETWEEN / 2.0
    _head(made, sheet, charts[0], size)
    for index, (text, math) in enumerate(lines):
        at = (4.0 / size[0], (3.0 + line * (len(lines) - index) - SMALL * POINT) / size[1])
        write(made, text, at, SMALL, math=math, gid="caption")
    return made


def _ordinate(sheet: Sheet, index: int) -> Ordinate:
    """The scale of one diagram, round, and its ends: whole half-centimetres with some air."""
    angle, timed = sheet.subject.angle, sheet.run.timed
    kinds = ("angle", "angular velocity", "angular acceleration") if angle else ("length", "velocity", "acceleration")
    kind = kinds[index]
    values = np.concatenate([inner(sheet.run.time, each.all[index], each) for each in sheet.subject.curves])
    values = values[np.isfinite(values)]
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    of_time = timed or not sheet.run.slides or angle
    name = own(kind, sheet.units)[0] if index == 0 or of_time else SI[kind]
    scale = fitting(kind, name, high - low, high - low, (ROOM, ROOM))
    top = 5.0 * max(ceil((scale.on_paper(high) + 2.0) / 5.0), 0) if high > 0.0 else 0.0
    foot = 5.0 * min(floor((scale.on_paper(low) - 2.0) / 5.0), 0) if low < 0.0 else 0.0
    if top - foot < 10.0:
        top, foot = max(top, 5.0), min(foot, -5.0)
    told, of = coherent(SI[kind] if angle else name)
    if not timed and index:
        per = SI["length"] if sheet.run.slides else SI["angle"]
        base = SI["angle"] if angle else length_of_rates(sheet.units.length)[0] if of_time else SI["length"]
        told = f"{base}/{per}" + ("^2" if index == 2 else "")
    written = name if index == 0 else told
    title = ("displacement", "velocity", "acceleration")[index]
    return Ordinate(title, SYMBOLS[angle][index], scale, written, told, foot, top, of.from_si(1.0))


def _chart(axes: Axes, sheet: Sheet, ordinate: Ordinate, index: int) -> None:
    """One diagram with its grid, its zero line and its curves."""
    per_mm = unit(ordinate.scale.unit).from_si(ordinate.scale.per_mm)
    time = sheet.run.time
    axes.set_xlim(0.0, sheet.span)
    axes.set_ylim(ordinate.low * per_mm, ordinate.high * per_mm)
    ticks = [10.0 * k for k in range(ceil(ordinate.low / 10.0), floor(ordinate.high / 10.0) + 1)]
    axes.set_yticks(
        [tick * per_mm for tick in ticks], [signed(tick * per_mm) for tick in ticks], family=FAMILY, fontsize=SMALL
    )
    axes.set_ylabel(f"{ordinate.symbol} ({raised(ordinate.written)})", family=FAMILY, fontsize=NORMAL, labelpad=3.0)
    every = ceil(4.5 * sheet.count / sheet.width)
    marks = np.linspace(0.0, sheet.span, sheet.count + 1)
    numbers = ["" if k % every else f"{k}" for k in range(sheet.count + 1)]
    axes.set_xticks(marks, numbers, family=FAMILY, fontsize=SMALL)
    axes.tick_params(length=2.0, width=0.5, pad=1.5)
    for side in axes.spines.values():
        side.set_linewidth(0.5)
    for mark in marks:
        axes.axvline(mark, color=RULE, lw=0.4, zorder=1, gid="position")
    for tick in ticks:
        axes.axhline(tick * per_mm, color=GRID, lw=0.4, zorder=0.5, gid="grid")
    axes.axhline(0.0, color=INK, lw=0.7, zorder=2, gid="zero")
    for curve, dash in zip(sheet.subject.curves, DASHES, strict=False):
        values = _written(curve.all[index], ordinate)
        axes.plot(time, values, color=INK, lw=1.1, ls=dash, zorder=4, gid=f"{ordinate.symbol}{curve.name}")
        if sheet.chords is not None and index > 0:
            found = chords(sheet.run, curve.all[index - 1], sheet.chords)
            _stems(axes, sheet, ordinate, curve, found)


def _written(values: Array, ordinate: Ordinate) -> Array:
    size = unit(ordinate.scale.unit)
    return np.asarray(values) * size.denominator / size.numerator


def _stems(axes: Axes, sheet: Sheet, ordinate: Ordinate, curve: Curve, found: Chords) -> None:
    """Chords as points on thin stems at the middles of the intervals, lettered V_1, V_2 on the free side of zero."""
    from planar.drawing.labels.matplotlib_text import write

    rates = _written(found.rates, ordinate)
    hollow = "white" if curve.name == "y" else CHORD
    axes.vlines(found.times, 0.0, rates, color=CHORD, lw=0.5, zorder=3, gid="stem")
    axes.plot(found.times, rates, ls="", marker="o", ms=3.0, mew=0.6, mec=CHORD, mfc=hollow, zorder=5, gid="chords")
    spacing = sheet.width / len(rates)
    if len(sheet.subject.curves) > 1 or spacing < 5.0:
        return
    per_mm = unit(ordinate.scale.unit).from_si(ordinate.scale.per_mm)
    across, up = sheet.run.time / sheet.span * sheet.width, _written(curve.all[_index(ordinate)], ordinate) / per_mm
    for number, (time, rate) in enumerate(zip(found.times, rates, strict=True), start=1):
        near = up[np.abs(across - sheet.on_axis(time)) < 3.2]
        sides = (-1.0, 1.0) if rate >= 0.0 else (1.0, -1.0)
        for side in sides:
            low, high = sorted((0.4 * side, 3.9 * side))
            if low >= ordinate.low and high <= ordinate.high and not ((near > low - 0.4) & (near < high + 0.4)).any():
                if side * rate > 0.0:
                    continue
                name = f"{ordinate.symbol}_{number}"
                text = f"${ordinate.symbol}_{{{number}}}$"
                _, high, below = measured(text, SMALL - 0.5, math=True)
                at = (time, (0.7 + below if side > 0 else below - high - 0.7) * per_mm)
                write(axes, text, at, SMALL - 0.5, math=True, ha="center", color=CHORD, gid=name)
                break


def _index(ordinate: Ordinate) -> int:
    return ("displacement", "velocity", "acceleration").index(ordinate.name)


def _angle_axis(axes: Axes, sheet: Sheet) -> None:
    """How far the input has gone, in the file's units, below the diagrams."""
    if sheet.run.slides:
        written, symbol = sheet.units.length, "s₁"
    else:
        written, symbol = sheet.units.angle, "α"
    size = unit(written)
    last = size.from_si(float(sheet.run.turned[-1]))
    in_degrees = not sheet.run.slides and isclose(degrees(sheet.run.turned[-1]), last)
    _ruler(axes, sheet, last, f"{symbol} ({written})", DEGREES if in_degrees else PLAIN, "angle")


def _time_axis(axes: Axes, sheet: Sheet) -> None:
    _ruler(axes, sheet, sheet.span, "t (s)", PLAIN, "time")


def _ruler(axes: Axes, sheet: Sheet, last: float, label: str, firsts: tuple[float, ...], name: str) -> None:
    """An axis by itself, with round ticks at least 9 mm apart, and its label at its end."""
    axes.set_label(name)
    axes.set_xlim(0.0, last)
    axes.set_yticks([])
    for side in ("left", "right", "top"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_linewidth(0.5)
    step = round_step(last * 9.0 / sheet.width, firsts)
    ticks = [step * k for k in range(floor(last / step * (1.0 + 1e-9)) + 1)]
    axes.set_xticks(ticks, [signed(tick) for tick in ticks], family=FAMILY, fontsize=SMALL)
    axes.tick_params(length=2.0, width=0.5, pad=1.5)
    ends = (1.0, 0.5)
    axes.annotate(
        label,
        ends,
        (9.0, 0.0),
        "axes fraction",
        "offset points",
        family=FAMILY,
        fontsize=NORMAL,
        va="center",
        ha="left",
        gid=name,
    )


def _head(made: Figure, sheet: Sheet, chart: Axes, size: tuple[float, float]) -> None:
    """Title, dead centres, stroke, and which curve is which."""
    mechanism = sheet.run.motion.mechanism
    rows = ((mechanism.name, LARGE, 3.0), (f"Kinematic diagrams of {sheet.subject.words}", NORMAL, 8.5))
    for whole, points, down in rows:
        text = clipped(whole, points, size[0] - 8.0)
        made.text(
            0.5,
            1.0 - down / size[1],
            text,
            family=list(families(text)),
            fontsize=points,
            ha="center",
            va="top",
            parse_math=False,
            gid="title",
        )
    for name, at in _dead_centres(sheet):
        chart.annotate(
            name,
            (at / sheet.width, 1.0),
            (0.0, 3.0),
            "axes fraction",
            "offset points",
            family=FAMILY,
            fontsize=SMALL,
            ha="center",
            va="bottom",
            gid=name,
        )
    if len(sheet.subject.curves) > 1:
        _legend(made, sheet, size)
    stroke = sheet.run.stroke
    if stroke is not None and sheet.subject.slide == stroke.pair:
        _stroke(chart, sheet, stroke.length)


def _legend(made: Figure, sheet: Sheet, size: tuple[float, float]) -> None:
    """Which curve is which, in the row above the diagrams."""
    from matplotlib.lines import Line2D

    right = LEFT + sheet.width
    row = size[1] - TOP + 3.0 * POINT + SMALL * POINT / 2.0 + 3.5
    for index, (curve, dash) in enumerate(zip(sheet.subject.curves, DASHES, strict=False)):
        start = right - 18.0 * (len(sheet.subject.curves) - index)
        spots = np.array([[start, start + 10.0], [row, row]]) / np.array([[size[0]], [size[1]]])
        made.add_artist(Line2D(*spots, color=INK, lw=1.1, ls=dash, gid="legend"))
        made.text(
            (start + 12.0) / size[0],
            row / size[1],
            curve.name,
            family=FAMILY,
            fontsize=NORMAL,
            va="center",
            style="italic",
            gid="legend",
        )


def _dead_centres(sheet: Sheet) -> list[tuple[str, float]]:
    """TDC and BDC with their places along the axis (mm), kept clear of one another."""
    stroke, run = sheet.run.stroke, sheet.run
    if stroke is None or sheet.subject.slide != stroke.pair:
        return []
    found = (
        [("TDC", 0.0), ("TDC", sheet.width)] if run.from_top else [("TDC", sheet.on_axis(run.when(stroke.top.input)))]
    )
    found.append(("BDC", sheet.on_axis(run.when(stroke.bottom.input))))
    found.sort(key=lambda each: each[1])
    return [(name, at) for name, at in found if -1e-6 <= at <= sheet.width * (1.0 + 1e-9)]


def _stroke(axes: Axes, sheet: Sheet, length: float) -> None:
    """The stroke as a measure at the right of the displacements."""
    high = unit(sheet.units.length).from_si(length)
    x = sheet.span * (1.0 + 4.0 / sheet.width)
    axes.plot([sheet.span, x * 1.008], [high, high], color=INK, lw=0.4, clip_on=False, gid="stroke")
    axes.plot([sheet.span, x * 1.008], [0.0, 0.0], color=INK, lw=0.4, clip_on=False, gid="stroke")
    axes.annotate(
        "",
        (x, high),
        (x, 0.0),
        annotation_clip=False,
        arrowprops={"arrowstyle": "<|-|>", "lw": 0.5, "shrinkA": 0, "shrinkB": 0, "mutation_scale": 6, "fc": INK},
    )
    axes.annotate(
        f"stroke {amount(length, 'length', sheet.units)}",
        (x, high / 2.0),
        (3.0, 0.0),
        "data",
        "offset points",
        rotation=90,
        family=FAMILY,
        fontsize=SMALL,
        va="center",
        ha="left",
        annotation_clip=False,
        gid="stroke",
    )
