"""The equations of links that no two lines locate: round every loop the vectors close, all unknown rates at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple

import numpy as np

from planar.analysis.polygons.polygon import Equation
from planar.analysis.rate_equations import Pin, Rate, Rates, Tie
from planar.analysis.vector_chains import Joint, Known, Walks

Array = np.ndarray
NOTHING = 1e-12
"""m or pure: a coefficient that is none."""
DEPENDENT = 1e-9
"""What is left of an equation's coefficients, made one in size, where it follows from others."""


class Step(NamedTuple):
    """From a link over a joint to the next."""

    joint: Joint
    tail: str
    head: str


class Loops(NamedTuple):
    """The equations of a group, and the unknowns in them, by name."""

    equations: tuple[Equation, ...]
    unknowns: Mapping[str, Rate]


def loops(walks: Walks, group: Sequence[str], known: Known, order: int, inputs: bool = True) -> Loops:
    """Velocities (order 1) or accelerations (order 2) round the loops of a group, and what else ties its rates.

    Without `inputs` these are the equations of the mechanism alone, however it is driven.
    """
    unknowns: dict[str, Rate] = {}

    def name(rate: Rate) -> str:
        members = [link for link in group if known.alike.get(Rate(link), Rate(link)) == rate]
        symbols = ("ω", "v") if order == 1 else ("α", "a")
        told = f"{symbols[0]}_{members[0]}" if members else f"{symbols[1]} at {rate.owner}"
        unknowns[told] = rate
        return told

    equations = []
    for steps in _closed(walks, group, known):
        sums, left = _round(walks, steps, known, order)
        points = tuple(dict.fromkeys(walks.end(step.joint, step.head).over for step in steps))
        for axis, index in (("x", 0), ("y", 1)):
            terms = tuple((name(rate), float(way[index])) for rate, way in sums.items() if abs(way[index]) > NOTHING)
            if terms:
                equations.append(Equation(points, axis, terms, float(left[index])))
    own = {stands for link in group if (stands := known.unknown(Rate(link)))} | set(unknowns.values())
    ties = [tie for tie in walks.rates.ties if inputs or not tie.given]
    equations += _ties(ties, walks.rates, known, order, own, name)
    return Loops(tuple(_independent(equations, tuple(unknowns))), unknowns)


def _independent(equations: Sequence[Equation], unknowns: Sequence[str]) -> list[Equation]:
    """The equations that do not follow from those before them: two slides on one line say the same twice."""
    kept: list[Equation] = []
    basis: list[Array] = []
    for equation in equations:
        terms = dict(equation.terms)
        row = np.array([terms.get(name, 0.0) for name in unknowns])
        row /= np.linalg.norm(row)
        for other in (*basis, *basis):  # twice, so that rounding leaves nothing
            row = row - (row @ other) * other
        if np.linalg.norm(row) > DEPENDENT:
            kept.append(equation)
            basis.append(row / np.linalg.norm(row))
    return kept


def _ties(
    ties: Sequence[Tie], rates: Rates, known: Known, order: int, own: AbstractSet[Rate], name: Callable[[Rate], str]
) -> list[Equation]:
    """What ties a group's own unknown rates besides: wheels on one another, inputs between moving links."""
    found = []
    for tie in ties:
        open_ones: dict[Rate, float] = {}
        right = sum(slope * rates.value(rate, order) for rate, slope in tie.slopes.items()) if tie.given else 0.0
        for rate, slope in tie.slopes.items():
            stands = known.unknown(rate)
            if stands is None:
                right -= slope * rates.value(rate, order)
            else:
                open_ones[stands] = open_ones.get(stands, 0.0) + slope
        if not own >= {rate for rate, slope in open_ones.items() if abs(slope) > NOTHING}:
            continue
        terms = tuple((name(rate), slope) for rate, slope in open_ones.items() if abs(slope) > NOTHING)
        if terms:
            found.append(Equation((tie.pair,), "turns", terms, right))
    return found


def _round(walks: Walks, steps: Sequence[Step], known: Known, order: int) -> tuple[dict[Rate, Array], Array]:
    """The unknown rates with their ways round a closed way, and what they have to come to together."""
    rates = walks.rates
    begin, finish = walks.end(steps[0].joint, steps[0].tail), walks.end(steps[-1].joint, steps[-1].head)
    sums: dict[Rate, Array] = {}
    left = np.zeros(2)
    if begin.link in known.placed:
        left = rates.carried(finish.link, finish.local, order) - rates.carried(begin.link, begin.local, order)

    def add(rate: Rate, way: Array) -> None:
        nonlocal left
        stands = known.unknown(rate)
        if stands is None:
            left = left - way * rates.value(rate, order)
        else:
            sums[stands] = sums.get(stands, np.zeros(2)) + way

    def across(link: str, reach: Array) -> None:
        nonlocal left
        add(Rate(link), np.array([-reach[1], reach[0]]))
        if order == 2:  # centripetal
            left = left + rates.value(Rate(link)) ** 2 * reach

    if begin.link not in known.placed:  # round links of the group alone
        across(begin.link, walks.at(begin) - walks.at(finish))
    for before, after in zip(steps, [*steps[1:], None], strict=True):
        joint, here = before.joint, walks.end(before.joint, before.head)
        if not isinstance(joint, Pin):
            sign = 1.0 if before.head == joint.rider else -1.0
            turning = rates.value(Rate(joint.guide))
            for way, rate in zip(joint.ways, joint.rates, strict=True):
                add(rate, sign * way)
                if order == 2:  # Coriolis
                    left = left - sign * 2.0 * turning * rates.value(rate) * np.array([-way[1], way[0]])
        if after is not None:
            across(here.link, walks.at(walks.end(after.joint, after.tail)) - walks.at(here))
    return sums, left


def _closed(walks: Walks, group: Sequence[str], known: Known) -> list[list[Step]]:
    """An independent set of closed ways: out along a tree of joints, over a joint that is not of it, and back."""
    root = ""
    edges: list[tuple[str, str, Step]] = []
    seen: list[Joint] = []
    for link in group:
        for joint in walks.joints(link):
            if any(joint is other for other in seen):
                continue
            seen.append(joint)
            nodes: dict[str, str] = {}
            for member in joint.members:
                node = member if member in group else root if member in known.placed else None
                if node is not None:
                    nodes.setdefault(node, member)
            hub, *others = nodes
            edges += [(hub, other, Step(joint, nodes[hub], nodes[other])) for other in others]
    tree: dict[str, list[Step]] = {root: []}
    used: list[Step] = []
    waiting = [root]
    while waiting:
        node = waiting.pop(0)
        for a, b, step in edges:
            for here, there, way in ((a, b, step), (b, a, Step(step.joint, step.head, step.tail))):
                if here == node and there not in tree:
                    tree[there] = [*tree[node], way]
                    used.append(step)
                    waiting.append(there)
    chords = [(a, b, step) for a, b, step in edges if not any(step is other for other in used)]
    back = {node: [Step(s.joint, s.head, s.tail) for s in reversed(steps)] for node, steps in tree.items()}
    return [_shortened([*tree[a], step, *back[b]]) for a, b, step in chords if a in tree and b in tree]


def _shortened(steps: list[Step]) -> list[Step]:
    """A closed way without the part that it goes out and back."""
    while len(steps) > 2 and steps[0].joint is steps[-1].joint and steps[0].head == steps[-1].tail:
        steps = steps[1:-1]
    return steps
