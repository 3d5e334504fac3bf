"""Kinematic diagrams: displacement, velocity and acceleration over time, to scale, below each other on one axis."""

from __future__ import annotations

from collections.abc import Sequence
from math import ceil, degrees, floor, isclose
from numbers import Integral, Real
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planar.drawing.diagrams.captions import DiagramSheet, Ordinate, bounded_values, caption_lines
from planar.drawing.diagrams.drawn_run import steady_run
from planar.drawing.diagrams.held_intervals import held_intervals
from planar.drawing.diagrams.motion_curves import (
    ChordRates,
    MotionCurve,
    chord_rates,
    default_subject,
    diagram_subject,
    find_slide,
    merge_subjects,
)
from planar.drawing.labels.fonts import DRAWING_FAMILY, font_families
from planar.drawing.labels.text_metrics import clip_text, format_tick, text_size
from planar.drawing.paper.pens import MM_PER_POINT, require_matplotlib
from planar.drawing.paper.scales import DECIMAL_STEPS, DEGREE_STEPS, round_scale, round_step, tick_spacing
from planar.dynamics.simulation import Simulation
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.units import SI_UNITS, format_unit, parse_unit
from planar.model.file_units import coherent_unit, rate_length, rate_unit, unit_of_kind
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.wording import amount
from planar.results.motion import Motion

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


INCHES_PER_MM = 1.0 / 25.4
"""inches"""
LEFT_MARGIN, RIGHT_MARGIN, TOP_MARGIN, DIAGRAM_GAP, AXIS_GAP = 24.0, 22.0, 22.0, 11.0, 11.0
"""mm on paper beside the diagrams, above them, between them, and from one axis below them to the next."""
MAX_CURVE_HEIGHT = 46.0
"""mm that a curve takes up and down at the most."""
MIN_WIDTH, MAX_WIDTH = 60.0, 1000.0
MAX_CHORDS = 180
SMALL_TEXT, NORMAL_TEXT, LARGE_TEXT = 7.0, 8.0, 10.0
"""points"""
LEGEND_ROW = 4.5
"""mm from one row of a legend to the next."""
CURVE_DASHES = ("-", (0, (5.0, 2.0)), (0, (8.0, 2.0, 1.0, 2.0)), (0, (1.5, 1.5)), (0, (12.0, 3.0)), (0, (3.0, 3.0)))
CURVE_COLOURS = ("black", "tab:red", "tab:green", "tab:purple", "tab:orange", "tab:brown")
CURVE_COLOUR, POSITION_GREY, GRID_GREY, HELD_GREY, CHORD_COLOUR = "black", "0.72", "0.88", "0.92", "tab:blue"
ORDINATE_SYMBOLS = {False: ("S", "V", "a"), True: ("φ", "ω", "ε")}
"""Of a slide or a point, and of a link; the chapter's α is the angle of the crank."""


def diagrams(
    source: Motion | Simulation | Mechanism,
    of: str | Sequence[str] | None = None,
    chords: int | None = None,
    width: float = 120.0,
) -> Figure:
    """S-t, V-t and a-t diagrams, as `planar.plot.diagrams` has them. Raises BadInput, NoAnswer."""
    if isinstance(width, bool) or not isinstance(width, Real) or not MIN_WIDTH <= width <= MAX_WIDTH:
        raise BadInput("width", f"a time axis of {MIN_WIDTH:g} to {MAX_WIDTH:g} mm is wanted, not {width!r:.40}")
    if chords is not None and (
        isinstance(chords, bool) or not isinstance(chords, Integral) or not 2 <= chords <= MAX_CHORDS
    ):
        raise BadInput("chords", f"a whole number of chords from 2 to {MAX_CHORDS} is wanted, not {chords!r:.40}")
    motion = source.motion if isinstance(source, Simulation) else source
    mechanism = motion.mechanism if isinstance(motion, Motion) else motion
    names = [of] if isinstance(of, str) else list(of or ()) or [default_subject(mechanism)]
    repeated = next((name for name in names if names.count(name) > 1), None)
    if repeated is not None:
        raise BadInput("of", f"{repeated!r:.40} is named twice; name each slide, point or link once")
    pairs = relative_motions(mechanism)
    slides = [slide for name in names if (slide := find_slide(mechanism, name)) is not None]
    count = chords or 12
    run = steady_run(
        motion, next((slide for slide in slides if mechanism.frame in pairs[slide].links), None), count=count
    )
    held = held_intervals(source, names) if isinstance(source, Simulation) else None
    subjects = merge_subjects(names, [diagram_subject(run, name) for name in names])
    return _draw_figure(
        [DiagramSheet(run, subject, mechanism.units, float(width), count, chords, held) for subject in subjects]
    )


def _draw_figure(sheets: Sequence[DiagramSheet]) -> Figure:
    """The diagrams of all sheets below each other, three of each, over one axis of the input or the time."""
    require_matplotlib()
    from matplotlib.figure import Figure

    from planar.drawing.labels.matplotlib_text import draw_text

    run, width = sheets[0].run, sheets[0].width
    ordinates = [[_fit_ordinate(sheet, index) for index in range(3)] for sheet in sheets]
    lines = caption_lines(sheets, ordinates, SMALL_TEXT, LEFT_MARGIN + width + RIGHT_MARGIN - 8.0)
    line_height = SMALL_TEXT * MM_PER_POINT * 1.45
    rulers = [_draw_travel_axis] * (not run.is_time_run) + [_draw_time_axis] * run.has_speed
    below = DIAGRAM_GAP / 2.0 + len(rulers) * AXIS_GAP + 2.0 + line_height * len(lines) + 3.0
    heights = [ordinate.high - ordinate.low for three in ordinates for ordinate in three]
    legends = [_legend_rows(sheet) for sheet in sheets]
    # room above the first diagram of each sheet
    heads = [TOP_MARGIN + LEGEND_ROW * max(len(legends[0]) - 1, 0)]
    heads += [DIAGRAM_GAP + LEGEND_ROW * len(rows) for rows in legends[1:]]
    size = (
        LEFT_MARGIN + width + RIGHT_MARGIN,
        sum(heads) + sum(heights) + 2.0 * DIAGRAM_GAP * len(sheets) + below,
    )
    made = Figure(figsize=(size[0] * INCHES_PER_MM, size[1] * INCHES_PER_MM), facecolor="white")
    bottom = size[1]
    charts: list[Axes] = []
    for number, (sheet, three) in enumerate(zip(sheets, ordinates, strict=True)):
        bottom -= heads[number]
        _draw_legend(made, legends[number], bottom, size)
        for index, ordinate in enumerate(three):
            height = ordinate.high - ordinate.low
            bottom -= height + (DIAGRAM_GAP if index else 0.0)
            box = (LEFT_MARGIN / size[0], bottom / size[1], width / size[0], height / size[1])
            charts.append(made.add_axes(box, label=f"angular {ordinate.name}" if number else ordinate.name))
            _draw_diagram(charts[-1], sheet, ordinate, index)
    bottom -= DIAGRAM_GAP / 2.0
    for ruler in rulers:
        bottom -= AXIS_GAP / 2.0
        axis = made.add_axes((LEFT_MARGIN / size[0], bottom / size[1], width / size[0], 0.01 / size[1]))
        ruler(axis, sheets[0])
        bottom -= AXIS_GAP / 2.0
    _draw_head(made, sheets, charts[0], size)
    for index, (text, math) in enumerate(lines):
        place = (4.0 / size[0], (3.0 + line_height * (len(lines) - index) - SMALL_TEXT * MM_PER_POINT) / size[1])
        draw_text(made, text, place, SMALL_TEXT, math=math, gid="caption")
    return made


def _fit_ordinate(sheet: DiagramSheet, index: int) -> Ordinate:
    """The scale of one diagram, round, and its ends: halves of what ticks are apart, with some air."""
    angle, timed = sheet.subject.is_angle, sheet.run.has_speed
    kinds = ("angle", "angular velocity", "angular acceleration") if angle else ("length", "velocity", "acceleration")
    kind = kinds[index]
    values = np.concatenate(
        [bounded_values(sheet.run.time, each.derivatives[index], each) for each in sheet.subject.curves]
    )
    values = values[np.isfinite(values)]
    low, high = float(values.min(initial=0.0)), float(values.max(initial=0.0))
    name = _ordinate_unit(kind, index, sheet)
    scale = round_scale(kind, name, high - low, high - low, (MAX_CURVE_HEIGHT, MAX_CURVE_HEIGHT))
    nothing = 1e-9 * max(high, -low)  # what rounding leaves of zero asks for no room
    half = tick_spacing(name) / 2.0
    top = half * max(ceil((scale.on_paper(high) + 2.0) / half - 1e-9), 0) if high > nothing else 0.0
    foot = half * min(floor((scale.on_paper(low) - 2.0) / half + 1e-9), 0) if low < -nothing else 0.0
    if top - foot < 2.0 * half:
        top, foot = max(top, half), min(foot, -half)
    told, of = (name, parse_unit(name)) if index else coherent_unit(SI_UNITS["angle"] if angle else name)
    if not timed and index:
        length = rate_length(sheet.units)[0]
        base, per = ("rad" if each else length for each in (angle, not sheet.run.is_sliding_input))
        told = f"{base}/{per}" + ("^2" if index == 2 else "")
    written = name if index == 0 else told
    title = ("displacement", "velocity", "acceleration")[index]
    return Ordinate(title, ORDINATE_SYMBOLS[angle][index], scale, written, told, foot, top, of.from_si(1.0))


def _ordinate_unit(kind: str, index: int, sheet: DiagramSheet) -> str:
    """The unit of a diagram: the one in which its kind is shown; that which goes with the input's where that rests."""
    if index == 0 or sheet.run.has_speed:
        return unit_of_kind(kind, sheet.units)[0]
    return SI_UNITS[kind] if sheet.subject.is_angle else rate_unit(kind, sheet.units)[0]


def _draw_diagram(axes: Axes, sheet: DiagramSheet, ordinate: Ordinate, index: int) -> None:
    """One diagram with its grid, its zero line and its curves."""
    per_mm = parse_unit(ordinate.scale.unit).from_si(ordinate.scale.per_mm)
    time = sheet.run.time
    axes.set_xlim(0.0, sheet.span)
    axes.set_ylim(ordinate.low * per_mm, ordinate.high * per_mm)
    step = tick_spacing(ordinate.scale.unit)
    ticks = [step * k for k in range(ceil(ordinate.low / step), floor(ordinate.high / step) + 1)]
    axes.set_yticks(
        [tick * per_mm for tick in ticks],
        [format_tick(tick * per_mm) for tick in ticks],
        family=DRAWING_FAMILY,
        fontsize=SMALL_TEXT,
    )
    axes.set_ylabel(
        f"{ordinate.symbol} ({format_unit(ordinate.unit_name)})",
        family=DRAWING_FAMILY,
        fontsize=NORMAL_TEXT,
        labelpad=3.0,
    )
    every = ceil(4.5 * sheet.interval_count / sheet.width)
    marks = np.linspace(0.0, sheet.span, sheet.interval_count + 1)
    numbers = ["" if k % every else f"{k}" for k in range(sheet.interval_count + 1)]
    axes.set_xticks(marks, numbers, family=DRAWING_FAMILY, fontsize=SMALL_TEXT)
    axes.tick_params(length=2.0, width=0.5, pad=1.5)
    for side in axes.spines.values():
        side.set_linewidth(0.5)
    for mark in marks:
        axes.axvline(mark, color=POSITION_GREY, lw=0.4, zorder=1, gid="position")
    for tick in ticks:
        axes.axhline(tick * per_mm, color=GRID_GREY, lw=0.4, zorder=0.5, gid="grid")
    for start, end in sheet.held.intervals if sheet.held is not None else ():
        axes.axvspan(start, end, color=HELD_GREY, lw=0.0, zorder=0.2, gid="held")
    axes.axhline(0.0, color=CURVE_COLOUR, lw=0.7, zorder=2, gid="zero")
    for curve, style in zip(sheet.subject.curves, _curve_styles(sheet), strict=True):
        values = _in_written_unit(curve.derivatives[index], ordinate)
        axes.plot(time, values, **style, lw=1.1, zorder=4, gid=f"{ordinate.symbol}{curve.label}")
        if sheet.chords is not None and index > 0:
            found = chord_rates(sheet.run, curve.derivatives[index - 1], sheet.chords)
            _draw_chord_stems(
                axes,
                sheet,
                ordinate,
                curve,
                found,
                style["color"] if len(sheet.subject.curves) > 1 and curve.subject else CHORD_COLOUR,
            )


def _curve_styles(sheet: DiagramSheet) -> list[dict[str, Any]]:
    """Colour and dashes of each curve: a colour for each subject, other dashes for each curve of one colour."""
    subjects = list(dict.fromkeys(curve.subject for curve in sheet.subject.curves))
    styles, counts = [], dict.fromkeys(subjects, 0)
    for curve in sheet.subject.curves:
        number = subjects.index(curve.subject)
        dash = CURVE_DASHES[(counts[curve.subject] + 2 * number) % len(CURVE_DASHES)]
        styles.append({"color": CURVE_COLOURS[number % len(CURVE_COLOURS)], "ls": dash})
        counts[curve.subject] += 1
    return styles


def _in_written_unit(values: Array, ordinate: Ordinate) -> Array:
    size = parse_unit(ordinate.scale.unit)
    return np.asarray(values) * size.denominator / size.numerator


def _draw_chord_stems(
    axes: Axes, sheet: DiagramSheet, ordinate: Ordinate, curve: MotionCurve, found: ChordRates, colour: str
) -> None:
    """Chords as points on thin stems at the middles of the intervals, lettered V_1, V_2 on the free side of zero."""
    from planar.drawing.labels.matplotlib_text import draw_text

    rates = _in_written_unit(found.rates, ordinate)
    hollow = "white" if curve.name == "y" else colour
    axes.vlines(found.times, 0.0, rates, color=colour, lw=0.5, zorder=3, gid="stem")
    axes.plot(found.times, rates, ls="", marker="o", ms=3.0, mew=0.6, mec=colour, mfc=hollow, zorder=5, gid="chords")
    spacing = sheet.width / len(rates)
    if len(sheet.subject.curves) > 1 or spacing < 5.0:
        return
    per_mm = parse_unit(ordinate.scale.unit).from_si(ordinate.scale.per_mm)
    across, up = (
        sheet.run.time / sheet.span * sheet.width,
        _in_written_unit(curve.derivatives[_ordinate_index(ordinate)], ordinate) / per_mm,
    )
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
                _, high, below = text_size(text, SMALL_TEXT - 0.5, math=True)
                at = (time, (0.7 + below if side > 0 else below - high - 0.7) * per_mm)
                draw_text(axes, text, at, SMALL_TEXT - 0.5, math=True, ha="center", color=colour, gid=name)
                break


def _ordinate_index(ordinate: Ordinate) -> int:
    return ("displacement", "velocity", "acceleration").index(ordinate.name)


def _draw_travel_axis(axes: Axes, sheet: DiagramSheet) -> None:
    """How far the input has gone, in the file's units, below the diagrams."""
    if sheet.run.is_sliding_input:
        written, symbol = sheet.units.length, "s₁"
    else:
        written, symbol = sheet.units.angle, "α"
    size = parse_unit(written)
    last = size.from_si(float(sheet.run.input_travel[-1]))
    in_degrees = not sheet.run.is_sliding_input and isclose(degrees(sheet.run.input_travel[-1]), last)
    _draw_scale_axis(axes, sheet, last, f"{symbol} ({written})", DEGREE_STEPS if in_degrees else DECIMAL_STEPS, "angle")


def _draw_time_axis(axes: Axes, sheet: DiagramSheet) -> None:
    _draw_scale_axis(axes, sheet, sheet.span, "t (s)", DECIMAL_STEPS, "time")


def _draw_scale_axis(
    axes: Axes, sheet: DiagramSheet, last: float, label: str, first_digits: tuple[float, ...], name: str
) -> None:
    """An axis by itself, with round ticks at least 9 mm apart, and its label at its end."""
    axes.set_label(name)
    axes.set_xlim(0.0, last)
    axes.set_yticks([])
    for side in ("left", "right", "top"):
        axes.spines[side].set_visible(False)
    axes.spines["bottom"].set_linewidth(0.5)
    step = round_step(last * 9.0 / sheet.width, first_digits)
    ticks = [step * k for k in range(floor(last / step * (1.0 + 1e-9)) + 1)]
    axes.set_xticks(ticks, [format_tick(tick) for tick in ticks], family=DRAWING_FAMILY, fontsize=SMALL_TEXT)
    axes.tick_params(length=2.0, width=0.5, pad=1.5)
    ends = (1.0, 0.5)
    axes.annotate(
        label,
        ends,
        (9.0, 0.0),
        "axes fraction",
        "offset points",
        family=DRAWING_FAMILY,
        fontsize=NORMAL_TEXT,
        va="center",
        ha="left",
        gid=name,
    )


def _draw_head(made: Figure, sheets: Sequence[DiagramSheet], chart: Axes, size: tuple[float, float]) -> None:
    """Title, dead centres and stroke."""
    sheet = sheets[0]
    mechanism, subjects = sheet.run.motion.mechanism, ", ".join(part.subject.title for part in sheets)
    rows = ((mechanism.name, LARGE_TEXT, 3.0), (f"Kinematic diagrams of {subjects}", NORMAL_TEXT, 8.5))
    for whole, points, down in rows:
        text = clip_text(whole, points, size[0] - 8.0)
        made.text(
            0.5,
            1.0 - down / size[1],
            text,
            family=list(font_families(text)),
            fontsize=points,
            ha="center",
            va="top",
            parse_math=False,
            gid="title",
        )
    for name, at in _dead_centre_positions(sheet):
        chart.annotate(
            name,
            (at / sheet.width, 1.0),
            (0.0, 3.0),
            "axes fraction",
            "offset points",
            family=DRAWING_FAMILY,
            fontsize=SMALL_TEXT,
            ha="center",
            va="bottom",
            gid=name,
        )
    stroke = sheet.run.stroke
    if stroke is not None and sheet.subject.slide == stroke.pair and len(sheet.subject.curves) == 1:
        _draw_stroke(chart, sheet, stroke.length)


class _LegendEntry(NamedTuple):
    """A curve in a legend: its label, where its line starts in the row (mm), and how it is drawn."""

    label: str
    start: float
    style: dict[str, Any]


def _legend_rows(sheet: DiagramSheet) -> list[list[_LegendEntry]]:
    """Which curve is which, in rows that end where the diagrams do; none for a single curve."""
    if len(sheet.subject.curves) == 1 and not sheet.subject.curves[0].subject:
        return []
    rows: list[list[tuple[float, str, dict[str, Any]]]] = [[]]
    for curve, style in zip(sheet.subject.curves, _curve_styles(sheet), strict=True):
        label = clip_text(curve.label, NORMAL_TEXT, sheet.width - 20.0)
        width = max(12.0 + text_size(label, NORMAL_TEXT).width + 4.0, 18.0)
        if rows[-1] and sum(entry[0] for entry in rows[-1]) + width > sheet.width:
            rows.append([])
        rows[-1].append((width, label, style))
    right = LEFT_MARGIN + sheet.width
    return [
        [
            _LegendEntry(label, right - sum(entry[0] for entry in row[index:]), style)
            for index, (_, label, style) in enumerate(row)
        ]
        for row in rows
    ]


def _draw_legend(
    made: Figure, rows: Sequence[Sequence[_LegendEntry]], chart_top: float, size: tuple[float, float]
) -> None:
    """The legend above a diagram whose upper edge is at a height (mm)."""
    from matplotlib.lines import Line2D

    lowest = chart_top + 3.0 * MM_PER_POINT + SMALL_TEXT * MM_PER_POINT / 2.0 + 3.5
    for number, row in enumerate(reversed(rows)):
        height = lowest + LEGEND_ROW * number
        for entry in row:
            spots = np.array([[entry.start, entry.start + 10.0], [height] * 2]) / np.array([[size[0]], [size[1]]])
            made.add_artist(Line2D(*spots, **entry.style, lw=1.1, gid="legend"))
            made.text(
                (entry.start + 12.0) / size[0],
                height / size[1],
                entry.label,
                family=list(font_families(entry.label)),
                fontsize=NORMAL_TEXT,
                va="center",
                style="italic",
                parse_math=False,
                gid="legend",
            )


def _dead_centre_positions(sheet: DiagramSheet) -> list[tuple[str, float]]:
    """TDC and BDC with their places along the axis (mm), kept clear of one another."""
    stroke, run = sheet.run.stroke, sheet.run
    if stroke is None or sheet.subject.slide != stroke.pair:
        return []
    found = (
        [("TDC", 0.0), ("TDC", sheet.width)]
        if run.starts_at_top
        else [("TDC", sheet.on_axis(run.time_at(stroke.top.input)))]
    )
    found.append(("BDC", sheet.on_axis(run.time_at(stroke.bottom.input))))
    found.sort(key=lambda each: each[1])
    return [(name, at) for name, at in found if -1e-6 <= at <= sheet.width * (1.0 + 1e-9)]


def _draw_stroke(axes: Axes, sheet: DiagramSheet, length: float) -> None:
    """The stroke as a measure at the right of the displacements."""
    high = parse_unit(sheet.units.length).from_si(length)
    x = sheet.span * (1.0 + 4.0 / sheet.width)
    axes.plot([sheet.span, x * 1.008], [high, high], color=CURVE_COLOUR, lw=0.4, clip_on=False, gid="stroke")
    axes.plot([sheet.span, x * 1.008], [0.0, 0.0], color=CURVE_COLOUR, lw=0.4, clip_on=False, gid="stroke")
    axes.annotate(
        "",
        (x, high),
        (x, 0.0),
        annotation_clip=False,
        arrowprops={
            "arrowstyle": "<|-|>",
            "lw": 0.5,
            "shrinkA": 0,
            "shrinkB": 0,
            "mutation_scale": 6,
            "fc": CURVE_COLOUR,
        },
    )
    axes.annotate(
        f"stroke {amount(length, 'length', sheet.units)}",
        (x, high / 2.0),
        (3.0, 0.0),
        "data",
        "offset points",
        rotation=90,
        family=DRAWING_FAMILY,
        fontsize=SMALL_TEXT,
        va="center",
        ha="left",
        annotation_clip=False,
        gid="stroke",
    )
