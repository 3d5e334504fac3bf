"""Circuits that look alike in the diagram, which are drawn once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.drawing.circuits.curves import BranchCurve, CircuitChart, InputWindow
from planar.foundation.arrays import Array

INDISTINGUISHABLE_RATIO = 4e-3
"""Of a panel's width or height: curves nearer than that cannot be told apart on paper."""
MAX_COMPARED_POINTS = 40
"""Places of a curve that are compared, at the most."""


def merge_equal_charts(drawn: Sequence[CircuitChart], shown: InputWindow) -> list[CircuitChart]:
    """The charts with those that look like an earlier one joined to it: its number and the marks of its assemblies."""
    values = np.concatenate([strand.y for each in drawn for strand in each.branch_curves])
    size = np.array([shown.high - shown.low, float(np.ptp(values)) or 1.0])
    kept: list[CircuitChart] = []
    for chart in drawn:
        index = next((k for k, other in enumerate(kept) if _are_alike(chart, other, size)), None)
        if index is None:
            kept.append(chart)
            continue
        first = kept[index]
        kept[index] = first._replace(
            equal_circuits=(*first.equal_circuits, chart.circuit),
            marked_assemblies=tuple(dict.fromkeys((*first.marked_assemblies, *chart.marked_assemblies))),
        )
    return kept


def _are_alike(one: CircuitChart, other: CircuitChart, size: Array) -> bool:
    """Whether two circuits are said to be alike, and their curves and dead points lie on each other."""
    if _title_facts(one) != _title_facts(other) or len(one.dead_points) != len(other.dead_points):
        return False
    if one.dead_points and not _are_near(np.array(sorted(one.dead_points)), np.array(sorted(other.dead_points)), size):
        return False
    ways = [
        sorted(each.branch_curves, key=lambda strand: (strand.branch, *_end_points(strand)[0])) for each in (one, other)
    ]
    return all(_coincide(mine, its, size) for mine, its in zip(*ways, strict=True))


def _title_facts(chart: CircuitChart) -> tuple[object, ...]:
    """What the title says of a circuit, and which branches have how many strands."""
    circuit = chart.circuit
    turns = max((branch.turns for branch in circuit.branches), default=0)
    branches = sorted(strand.branch for strand in chart.branch_curves)
    return chart.left_out, circuit.closed, turns, len(circuit.branches), tuple(branches)


def _end_points(strand: BranchCurve) -> Array:
    """Both ends (2, 2), the one with the lesser input first."""
    ends = np.array([(strand.x[k], strand.y[k]) for k in (0, -1)])
    return ends if ends[0, 0] <= ends[1, 0] else ends[::-1]


def _are_near(one: Array, other: Array, size: Array) -> bool:
    return bool((np.abs(one - other) <= INDISTINGUISHABLE_RATIO * size).all())


def _coincide(one: BranchCurve, other: BranchCurve, size: Array) -> bool:
    return (
        _are_near(_end_points(one), _end_points(other), size)
        and _lies_on(one, other, size)
        and _lies_on(other, one, size)
    )


def _lies_on(one: BranchCurve, other: BranchCurve, size: Array) -> bool:
    """Whether places along a curve lie on another, by their distances from its straight pieces."""
    rows = np.unique(np.linspace(0, len(one.x) - 1, MAX_COMPARED_POINTS).astype(int))
    spots = np.column_stack([one.x[rows], one.y[rows]]) / size
    curve = np.column_stack([other.x, other.y]) / size
    start, way = curve[:-1], np.diff(curve, axis=0)
    to = spots[:, None] - start
    part = np.clip((to * way).sum(axis=2) / np.maximum((way**2).sum(axis=1), 1e-300), 0.0, 1.0)
    return bool(
        (np.hypot(*(to - part[..., None] * way).transpose(2, 0, 1)).min(axis=1) <= INDISTINGUISHABLE_RATIO).all()
    )
