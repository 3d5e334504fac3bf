"""The two plots of README: time a position against the number of designs, and against the number of links."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from benchmarks.contests import LIMIT
from benchmarks.curves import Curve

SIZE = (7.2, 4.3)
DOTS = 140
COLOURS = ("#c1121f", "#e07a1f", "#1d6fa5", "#3a7d44", "#7b4fa3", "#8a5a3c", "#4a4e57", "#c2529b")
MARKS = "osD^vPX*"
APART = 0.055
"""Names of lines stand at least so far apart, as a part of the height."""


def save(path: Path, title: str, along: str, curves: Sequence[Curve]) -> None:
    """A plot on logarithmic axes; every line has its name at its end."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=SIZE, dpi=DOTS, layout="constrained")
    FigureCanvasAgg(figure)
    axes = figure.add_subplot()
    axes.set(xscale="log", yscale="log", xlabel=along, ylabel="time a position, ns")
    axes.set_title(title, loc="left", fontsize=10)
    styles = {}
    others = iter(zip(COLOURS[2:], MARKS[2:], strict=True))
    ours = iter(zip(COLOURS[:2], MARKS[:2], strict=True))
    for curve in curves:
        if curve.system == LIMIT:
            styles[curve.system] = ("black", ".")
        else:
            styles[curve.system] = next(ours if curve.system.startswith("planar") else others, ("grey", "."))
    for curve in curves:
        colour, mark = styles[curve.system]
        wide = 2.0 if curve.system.startswith("planar") else 1.2
        shown = [1e9 * seconds for seconds in curve.seconds]
        axes.plot(curve.grows, shown, color=colour, marker=mark, markersize=5, linewidth=wide, clip_on=False)
    axes.grid(True, which="major", color="#d8d8d8", linewidth=0.6)
    axes.set_axisbelow(True)
    for side in ("top", "right"):
        axes.spines[side].set_visible(False)
    last = max(number for curve in curves for number in curve.grows)
    first = min(number for curve in curves for number in curve.grows)
    axes.set_xlim(first * 0.9, last * 1.05)
    ticks = sorted({number for curve in curves for number in curve.grows})
    axes.set_xticks(ticks, [f"{number:,}" for number in ticks])
    axes.minorticks_off()
    _names(axes, curves, styles)
    figure.savefig(path)


def _names(axes: object, curves: Sequence[Curve], styles: dict[str, tuple[str, str]]) -> None:
    """Names right of the axes at the height where each line ends, moved apart; a thin line leads to a line that ends
    before."""
    low, high = axes.get_ylim()
    from math import log

    def height(seconds: float) -> float:
        return (log(1e9 * seconds) - log(low)) / (log(high) - log(low))

    order = sorted(curves, key=lambda curve: curve.seconds[-1])
    at = [height(curve.seconds[-1]) for curve in order]
    for index in range(1, len(at)):
        at[index] = max(at[index], at[index - 1] + APART)
    over = max(0.0, at[-1] - 1.0)
    at = [each - over * index / max(1, len(at) - 1) for index, each in enumerate(at)]
    for curve, y in zip(order, at, strict=True):
        colour, _ = styles[curve.system]
        axes.annotate(
            curve.system,
            xy=(curve.grows[-1], 1e9 * curve.seconds[-1]),
            xycoords="data",
            xytext=(1.03, y),
            textcoords="axes fraction",
            color=colour,
            fontsize=8.5,
            va="center",
            annotation_clip=False,
            arrowprops={"arrowstyle": "-", "color": colour, "linewidth": 0.5, "alpha": 0.5, "shrinkB": 4},
        )
