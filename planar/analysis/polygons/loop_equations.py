"""The equations of links that no two lines locate: round every loop the vectors close, all unknown rates at once."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from typing import NamedTuple

import numpy as np

from planar.analysis.polygons.polygon import LoopEquation
from planar.analysis.rate_equations import PinJoint, Rate, RateEquation, RateEquations
from planar.analysis.vector_chains import JointOfRates, KnownRates, VectorChains
from planar.foundation.arrays import Array

LEAST_COEFFICIENT = 1e-12
"""m or pure: a coefficient that is none."""
DEPENDENCE_TOLERANCE = 1e-9
"""What is left of an equation's coefficients, made one in size, where it follows from others."""


class LoopStep(NamedTuple):
    """From a link over a joint to the next."""

    joint: JointOfRates
    tail: str
    head: str


class LoopEquations(NamedTuple):
    """The equations of a group, and the unknowns in them, by name."""

    equations: tuple[LoopEquation, ...]
    unknowns: Mapping[str, Rate]


def loop_equations(
    chains: VectorChains, links: Sequence[str], known: KnownRates, order: int, inputs: bool = True
) -> LoopEquations:
    """Velocities (order 1) or accelerations (order 2) round the loops of a group, and what else ties its rates.

    Without `inputs` these are the equations of the mechanism alone, however it is driven.
    """
    unknowns: dict[str, Rate] = {}

    def name(rate: Rate) -> str:
        members = [link for link in links if known.representatives.get(Rate(link), Rate(link)) == rate]
        symbols = ("ω", "v") if order == 1 else ("α", "a")
        told = f"{symbols[0]}_{members[0]}" if members else f"{symbols[1]} at {rate.owner}"
        unknowns[told] = rate
        return told

    equations = []
    for steps in _independent_loops(chains, links, known):
        sums, left = _sum_round_loop(chains, steps, known, order)
        points = tuple(dict.fromkeys(chains.joint_point(step.joint, step.head).over for step in steps))
        for axis, index in (("x", 0), ("y", 1)):
            terms = tuple(
                (name(rate), float(way[index])) for rate, way in sums.items() if abs(way[index]) > LEAST_COEFFICIENT
            )
            if terms:
                equations.append(LoopEquation(points, axis, terms, float(left[index])))
    own = {stands for link in links if (stands := known.unknown_rate(Rate(link)))} | set(unknowns.values())
    ties = [tie for tie in chains.equations.equations if inputs or not tie.is_input]
    equations += _pair_equations(ties, chains.equations, known, order, own, name)
    return LoopEquations(tuple(_independent_equations(equations, tuple(unknowns))), unknowns)


def _independent_equations(equations: Sequence[LoopEquation], unknowns: Sequence[str]) -> list[LoopEquation]:
    """The equations that do not follow from those before them: two slides on one line say the same twice."""
    kept: list[LoopEquation] = []
    basis: list[Array] = []
    for equation in equations:
        terms = dict(equation.terms)
        row = np.array([terms.get(name, 0.0) for name in unknowns])
        row /= np.linalg.norm(row)
        for other in (*basis, *basis):  # twice, so that rounding leaves nothing
            row = row - (row @ other) * other
        if np.linalg.norm(row) > DEPENDENCE_TOLERANCE:
            kept.append(equation)
            basis.append(row / np.linalg.norm(row))
    return kept


def _pair_equations(
    equations: Sequence[RateEquation],
    rates: RateEquations,
    known: KnownRates,
    order: int,
    own: AbstractSet[Rate],
    name: Callable[[Rate], str],
) -> list[LoopEquation]:
    """What ties a group's own unknown rates besides: wheels on one another, inputs between moving links."""
    found = []
    for tie in equations:
        open_ones: dict[Rate, float] = {}
        right = (
            sum(slope * rates.value(rate, order) for rate, slope in tie.coefficients.items()) if tie.is_input else 0.0
        )
        for rate, slope in tie.coefficients.items():
            stands = known.unknown_rate(rate)
            if stands is None:
                right -= slope * rates.value(rate, order)
            else:
                open_ones[stands] = open_ones.get(stands, 0.0) + slope
        if not own >= {rate for rate, slope in open_ones.items() if abs(slope) > LEAST_COEFFICIENT}:
            continue
        terms = tuple((name(rate), slope) for rate, slope in open_ones.items() if abs(slope) > LEAST_COEFFICIENT)
        if terms:
            found.append(LoopEquation((tie.pair,), "turns", terms, right))
    return found


def _sum_round_loop(
    chains: VectorChains, steps: Sequence[LoopStep], known: KnownRates, order: int
) -> tuple[dict[Rate, Array], Array]:
    """The unknown rates with their ways round a closed way, and what they have to come to together."""
    rates = chains.equations
    begin, finish = (
        chains.joint_point(steps[0].joint, steps[0].tail),
        chains.joint_point(steps[-1].joint, steps[-1].head),
    )
    sums: dict[Rate, Array] = {}
    left = np.zeros(2)
    if begin.link in known.links:
        left = rates.point_motion(finish.link, finish.local, order) - rates.point_motion(begin.link, begin.local, order)

    def add(rate: Rate, way: Array) -> None:
        nonlocal left
        stands = known.unknown_rate(rate)
        if stands is None:
            left = left - way * rates.value(rate, order)
        else:
            sums[stands] = sums.get(stands, np.zeros(2)) + way

    def across(link: str, reach: Array) -> None:
        nonlocal left
        add(Rate(link), np.array([-reach[1], reach[0]]))
        if order == 2:  # centripetal
            left = left + rates.value(Rate(link)) ** 2 * reach

    if begin.link not in known.links:  # round links of the group alone
        across(begin.link, chains.point_position(begin) - chains.point_position(finish))
    for before, after in zip(steps, [*steps[1:], None], strict=True):
        joint, here = before.joint, chains.joint_point(before.joint, before.head)
        if not isinstance(joint, PinJoint):
            sign = 1.0 if before.head == joint.rider else -1.0
            turning = rates.value(Rate(joint.guide))
            for way, rate in zip(joint.directions, joint.rates, strict=True):
                add(rate, sign * way)
                if order == 2:  # Coriolis
                    left = left - sign * 2.0 * turning * rates.value(rate) * np.array([-way[1], way[0]])
        if after is not None:
            across(
                here.link,
                chains.point_position(chains.joint_point(after.joint, after.tail)) - chains.point_position(here),
            )
    return sums, left


def _independent_loops(chains: VectorChains, links: Sequence[str], known: KnownRates) -> list[list[LoopStep]]:
    """An independent set of closed ways: out along a tree of joints, over a joint that is not of it, and back."""
    root = ""
    edges: list[tuple[str, str, LoopStep]] = []
    seen: list[JointOfRates] = []
    for link in links:
        for joint in chains.joints(link):
            if any(joint is other for other in seen):
                continue
            seen.append(joint)
            nodes: dict[str, str] = {}
            for member in joint.members:
                node = member if member in links else root if member in known.links else None
                if node is not None:
                    nodes.setdefault(node, member)
            hub, *others = nodes
            edges += [(hub, other, LoopStep(joint, nodes[hub], nodes[other])) for other in others]
    tree: dict[str, list[LoopStep]] = {root: []}
    used: list[LoopStep] = []
    waiting = [root]
    while waiting:
        node = waiting.pop(0)
        for a, b, step in edges:
            for here, there, way in ((a, b, step), (b, a, LoopStep(step.joint, step.head, step.tail))):
                if here == node and there not in tree:
                    tree[there] = [*tree[node], way]
                    used.append(step)
                    waiting.append(there)
    chords = [(a, b, step) for a, b, step in edges if not any(step is other for other in used)]
    back = {node: [LoopStep(s.joint, s.head, s.tail) for s in reversed(steps)] for node, steps in tree.items()}
    return [_trim_loop([*tree[a], step, *back[b]]) for a, b, step in chords if a in tree and b in tree]


def _trim_loop(steps: list[LoopStep]) -> list[LoopStep]:
    """A closed way without the part that it goes out and back."""
    while len(steps) > 2 and steps[0].joint is steps[-1].joint and steps[0].head == steps[-1].tail:
        steps = steps[1:-1]
    return steps
