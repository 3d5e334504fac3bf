"""A linkage that is known with what it does, as values of an exact problem's symbols."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import design_equations
from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.jets import value_and_rates
from planar.model.link_shapes import link_shape
from planar.model.mechanism import Mechanism
from planar.model.pairs.guide_line import GuidedPair
from planar.solving.cycle import cycle
from planar.synthesis.exact.relations.exact_problem import Component, ExactProblem
from planar.synthesis.exact.relations.polynomials import Polynomial
from planar.synthesis.exact.relations.reference_pose import PATCH_ANGLE
from planar.synthesis.exact.relations.unknowns import NumberKind
from planar.synthesis.task.freedom import moving_start
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath
from planar.synthesis.task.wanted_results import wanted_expression

POSITIONS = 48
"""Of the motion of a linkage, of which entries are some."""
SPREAD = 0.6180339887498949
"""Of the motion: how far one entry is from the next."""


class KnownLinkage(NamedTuple):
    """A mechanism, the wanted items that it meets, in the order of its exact problem, and where the axes of its moving
    links are at the first entry: the origin (m), and the x-axis as a unit vector."""

    mechanism: Mechanism
    items: tuple[Wanted, ...]
    axes: Mapping[str, tuple[complex, complex]]


def linkage_values(problem: ExactProblem, known: KnownLinkage) -> dict[int, complex]:
    """The values of all symbols of which places, lines and axes are made."""
    pose, found = problem.pose, problem.first_values(known.items)
    axes = {known.mechanism.frame: (0.0j, 1.0 + 0.0j), **known.axes}
    shapes = {each.name: link_shape(each) for each in known.mechanism.links}
    lines = {pair.name: pair.line for pair in known.mechanism.pairs if isinstance(pair, GuidedPair)}

    def assign(value: Polynomial | None, number: complex, kind: NumberKind) -> None:
        if value is not None and len(value.terms) == 1:
            ((key, factor),) = value.terms.items()
            if len(key) == 1 and factor == 1.0 and key[0] not in found:
                scaled = (number, number.conjugate()) if kind is NumberKind.TURN else problem.scaled(kind, number)
                found[key[0]], found[key[0] ^ 1] = scaled

    for (link, name), place in pose.places.items():
        at = shapes[link].position(name)
        assign(place, axes[link][0] + axes[link][1] * complex(float(at.x), float(at.y)), NumberKind.PLACE)
    for slide in pose.slides:
        name = slide.pair.name
        link = slide.pair.links[0]
        way = axes[link][1] * np.exp(1j * lines[name].direction_angle(shapes[link]))
        patch = complex(np.exp(1j * PATCH_ANGLE))
        way = way / (way * patch.conjugate()).real if name in pose.patched else way
        assign(slide.direction, complex(way), NumberKind.TURN)
    for link, tied in pose.axes.items():
        assign(tied.origin, axes[link][0], NumberKind.PLACE)
        assign(tied.direction, axes[link][1], NumberKind.TURN)
    return found


def component_unknowns(component: Component, values: Mapping[int, complex]) -> ComplexArray:
    """The unknowns of a component (unknowns,), conjugates behind."""
    symbols = [each.own for each in component.unknowns] + [each.conjugate for each in component.unknowns]
    return np.array([values[k] for k in symbols], dtype=complex)


def sample_linkage(problem: ExactProblem) -> KnownLinkage:
    """A linkage near the start with other values of the numbers that are sought, and what it does at as many entries.
    Raises NoAnswer where it does not move."""
    start = problem.mechanism
    mechanism = moving_start(start, problem.free_numbers)
    design = design_equations(mechanism)
    motion = cycle(mechanism, POSITIONS, pair=mechanism.inputs[0].pair)
    z, t = design.coordinates_at(motion)
    counts = [len(each.weights) for each in problem.items]
    order = np.argsort(np.modf(SPREAD * np.arange(1, len(motion) + 1))[0], kind="stable")
    order = order[(order > 0) & (order < len(motion) - 1)]
    if sum(counts) > len(order):
        raise NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, "the motion has fewer positions than entries are wanted")
    items, first = [], 0
    for wanted, count in zip(problem.items, counts, strict=True):
        rows = order[first : first + count]
        values = ca.Function("values", [design.z, design.t], [wanted_expression(design, wanted)])(
            z[0][rows].T, t[rows].T
        )
        items.append(_met(wanted, np.array(values).T, t[rows]))
        first += count
    axes = {}
    for link in mechanism.links:
        if link.name != mechanism.frame:
            frame = motion.frames[link.name]
            x, y, angle = (
                float(np.asarray(value_and_rates(each)[0])[order[0]]) for each in (frame.x, frame.y, frame.angle)
            )
            axes[link.name] = complex(x, y), complex(np.exp(1j * angle))
    return KnownLinkage(mechanism, tuple(items), axes)


def _met(wanted: Wanted, values: Array, inputs: Array) -> Wanted:
    """A wanted item whose entries are what a linkage does."""
    if isinstance(wanted, WantedFunction):
        return wanted._replace(inputs=inputs[:, 0], values=values[:, 0])
    own = None if wanted.inputs is None else inputs[:, 0]
    if isinstance(wanted, WantedPath):
        return wanted._replace(places=values, inputs=own)
    return wanted._replace(places=values[:, :2], angles=values[:, 2], inputs=own)
