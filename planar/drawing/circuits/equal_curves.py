"""Circuits that look alike in the diagram, which are drawn once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.drawing.circuits.curves import Chart, Strand, Window

Array = np.ndarray

APART = 4e-3
"""Of a panel's width or height: curves nearer than that cannot be told apart on paper."""
LOOKED_AT = 40
"""Places of a curve that are compared, at the most."""


def alike_together(drawn: Sequence[Chart], shown: Window) -> list[Chart]:
    """The charts with those that look like an earlier one joined to it: its number and the marks of its assemblies."""
    values = np.concatenate([strand.y for each in drawn for strand in each.strands])
    size = np.array([shown.high - shown.low, float(np.ptp(values)) or 1.0])
    kept: list[Chart] = []
    for chart in drawn:
        index = next((k for k, other in enumerate(kept) if _alike(chart, other, size)), None)
        if index is None:
            kept.append(chart)
            continue
        first = kept[index]
        kept[index] = first._replace(
            others=(*first.others, chart.circuit), marked=tuple(dict.fromkeys((*first.marked, *chart.marked)))
        )
    return kept


def _alike(one: Chart, other: Chart, size: Array) -> bool:
    """Whether two circuits are said to be alike, and their curves and dead points lie on each other."""
    if _words(one) != _words(other) or len(one.dead) != len(other.dead):
        return False
    if one.dead and not _near(np.array(sorted(one.dead)), np.array(sorted(other.dead)), size):
        return False
    ways = [sorted(each.strands, key=lambda strand: (strand.branch, *_ends(strand)[0])) for each in (one, other)]
    return all(_lie_on_each_other(*both, size) for both in zip(*ways, strict=True))


def _words(chart: Chart) -> tuple[object, ...]:
    """What the title says of a circuit, and which branches have how many strands."""
    circuit = chart.circuit
    turns = max((branch.turns for branch in circuit.branches), default=0)
    branches = sorted(strand.branch for strand in chart.strands)
    return chart.left_out, circuit.closed, turns, len(circuit.branches), tuple(branches)


def _ends(strand: Strand) -> Array:
    """Both ends (2, 2), the one with the lesser input first."""
    ends = np.array([(strand.x[k], strand.y[k]) for k in (0, -1)])
    return ends if ends[0, 0] <= ends[1, 0] else ends[::-1]


def _near(one: Array, other: Array, size: Array) -> bool:
    return bool((np.abs(one - other) <= APART * size).all())


def _lie_on_each_other(one: Strand, other: Strand, size: Array) -> bool:
    return _near(_ends(one), _ends(other), size) and _lies_on(one, other, size) and _lies_on(other, one, size)


def _lies_on(one: Strand, other: Strand, size: Array) -> bool:
    """Whether places along a curve lie on another, by their distances from its straight pieces."""
    rows = np.unique(np.linspace(0, len(one.x) - 1, LOOKED_AT).astype(int))
    spots = np.column_stack([one.x[rows], one.y[rows]]) / size
    curve = np.column_stack([other.x, other.y]) / size
    start, way = curve[:-1], np.diff(curve, axis=0)
    to = spots[:, None] - start
    part = np.clip((to * way).sum(axis=2) / np.maximum((way**2).sum(axis=1), 1e-300), 0.0, 1.0)
    return bool((np.hypot(*(to - part[..., None] * way).transpose(2, 0, 1)).min(axis=1) <= APART).all())
