"""The acceptance test of a position and its rates, all checks of it in one compiled function of a structure.

It says yes to what is surely sound. To what it does not, the general path says why, or that it is sound nevertheless.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property, lru_cache
from typing import Any, Generic, NamedTuple, TypeVar

import casadi as ca
import numpy as np

from planar.equations.block_regularity import greatest_entry, regular_distances, regularity_bound
from planar.equations.casadi_call import BufferedFunction
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.elimination import stack_expressions
from planar.equations.functions import (
    MAX_CACHED_STRUCTURES,
    RUN_NEWTON_STEPS,
    EquationFunctions,
    equation_functions,
    function_with_cse,
)
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.rates import UnknownRates, block_jacobian, first_and_second_rates, time_derivatives
from planar.equations.residuals import CARRIED_ROUNDING, closing_error, residuals, scalars, split_pair_numbers
from planar.equations.symbolic_equations import slice_length
from planar.foundation.geometry import Frame, frame_at, frame_term_sizes
from planar.foundation.jets import Jet, TermSizes, term_sizes
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind

MAX_BLOCK_SIZE = 12
"""Unknowns of a block: the expressions of a larger one would be too long."""


Judged = TypeVar("Judged")
"""A float of one position, an array of many."""


class AcceptanceResult(NamedTuple, Generic[Judged]):
    """What is judged at a position; of many positions arrays. Lengths in sizes of the mechanism, angles in rad."""

    residual: Judged
    "what the worst constraint leaves open"
    finite_sum: Judged
    "the sum of all that is left open: a number only if everything is"
    velocity_error: Judged
    "how far velocities break the worst constraint, as a part of the greatest"
    acceleration_error: Judged
    "the same of accelerations"
    contact_gap: Judged
    "the greatest gap, or rate of one as a part of the greatest, of contacts that guides have to keep closed"
    regularity: Judged
    "no more than the least regularity of any block, see `solving.rates.regularity`"
    least_singular_value: Judged
    "no more than the least singular value of any block, columns of one size"
    rounding_amplification: Judged
    "by how much, at most, round-off is greater in the rates, see `solving.rates.accuracy`"


class StepCheck(NamedTuple):
    """What is judged of a step from one position to another along a straight way of the inputs."""

    residual: float
    "what the worst constraint leaves open at its end"
    finite_sum: float
    "a number only if everything is"
    deviation: float
    "how far the unknowns have gone aside of what the rates at its ends allow; 1 at most"
    forward_product: float
    "negative where a block comes back"
    regular_distance: float
    "how far the two ends together are from where a block could be singular, in steps"
    least_singular_value: float
    "no more than the least singular value of any block at its ends, columns of one size"


class AcceptanceFunctions:
    """The compiled functions of one structure. Only for structures of few unknowns whose every block has as many
    constraints as unknowns."""

    def __init__(self, structure: Mechanism, program: EquationFunctions):
        self.structure, self.functions, self.equations = structure, program, program.equations
        sizes = [slice_length(block.unknowns) for block in self.equations.blocks]
        self.is_available = program.is_square and not program.is_sparse and max(sizes, default=0) <= MAX_BLOCK_SIZE
        self.block_starts = np.array([block.unknowns.start for block in self.equations.blocks], dtype=int)

    @staticmethod
    def result(verdict: Iterable[Judged]) -> AcceptanceResult[Judged]:
        """What the functions of positions judge, by name."""
        return AcceptanceResult(*verdict)

    @staticmethod
    def step_result(verdict: Iterable[float]) -> StepCheck:
        """What the function of steps judges, by name."""
        return StepCheck(*verdict)

    @cached_property
    def corrected_position(self) -> BufferedFunction:
        """The same as `position`, after one more of Newton's corrections: first the corrected z."""
        return BufferedFunction(self.functions.kept("corrected position", self._make_corrected_position))

    def _make_corrected_position(self) -> ca.Function:
        e = self.equations
        sizes = (e.z, e.u, e.u, e.u, e.u, e.p, e.F, e.z)
        names = ("z", "axis", "u", "u1", "u2", "p", "by", "least")
        given = [ca.SX.sym(name, size.numel()) for name, size in zip(names, sizes, strict=True)]
        settled, left = self.functions.newton_expressions(given[0], given[2], given[5])
        parts, verdict, *along = self._position(settled, *given[1:])
        # one step from a position that is not closed to round-off does not make it so where blocks are weak
        open_ = ca.fmax(verdict[0], greatest_entry(ca.fabs(left)))
        verdict = ca.vertcat(open_, verdict[1] + ca.sum1(left), verdict[2:])
        return function_with_cse("row", given, [settled, parts, verdict, *along])

    @cached_property
    def position(self) -> BufferedFunction:
        """(z, axis, u, u1, u2, p, by, least) -> (w, w1, w2), verdict, rates along the axis of the inputs, distances.

        `by` (rows,): what every row is divided by, `least` (unknowns,): the least sizes of columns, see
        `solving.rates.regularity`. Distances (blocks,) are along the axis: within them no block can become singular.
        """
        return BufferedFunction(self._position)

    @cached_property
    def _position(self) -> ca.Function:
        return self.functions.kept("position", self._make_position)

    def _make_position(self) -> ca.Function:
        e = self.equations
        axis, u1, u2 = (ca.SX.sym(name, e.u.numel()) for name in ("axis", "u1", "u2"))
        by, least = ca.SX.sym("by", e.F.numel()), ca.SX.sym("least", e.z.numel())
        rates = UnknownRates(e)
        ways = rates.first(axis)
        z1, z2 = rates.first_and_second(u1, u2)
        w1, w2 = first_and_second_rates(e.w, rates.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))
        strength, lost = ca.SX(1.0), ca.SX(1.0)
        for block, jacobian in zip(e.blocks, rates.jacobians, strict=True):
            if slice_length(block.unknowns):
                own = regularity_bound(jacobian, by[block.rows], least[block.unknowns])
                strength = ca.fmin(strength, own)
                for k in range(jacobian.size2()):
                    lost = ca.fmax(lost, 1.0 / (ca.norm_2(jacobian[:, k]) * own * own))
        lost = lost * ca.fmax(greatest_entry(ca.fabs(e.w)) / np.pi, 1.0)
        clear, distances = regular_distances(rates, ca.vertcat(ways, axis))
        judged = self._residual_check(e.w, w1, w2, e.u, u1, u2, e.p)
        outputs = [ca.horzcat(e.w, w1, w2), stack_expressions([*judged, strength, clear, lost]), ways, distances]
        given = [e.z, axis, e.u, u1, u2, e.p, by, least]
        return function_with_cse("position", given, [ca.densify(each) for each in outputs])

    @cached_property
    def regularity(self) -> BufferedFunction:
        """(z, u, p, by, least) -> the `regularity` that `position` judges, which takes a tenth as long to derive."""
        return BufferedFunction(self.functions.kept("regularity", self._make_regularity))

    def _make_regularity(self) -> ca.Function:
        e = self.equations
        by, least = ca.SX.sym("by", e.F.numel()), ca.SX.sym("least", e.z.numel())
        strength = ca.SX(1.0)
        for block in e.blocks:
            if slice_length(block.unknowns):
                jacobian = block_jacobian(e, block.rows, block.unknowns)
                strength = ca.fmin(strength, regularity_bound(jacobian, by[block.rows], least[block.unknowns]))
        return function_with_cse("regularity", [e.z, e.u, e.p, by, least], [strength])

    @cached_property
    def step_check(self) -> BufferedFunction:
        """(z, u, step of u, p) -> z after the step, and what is judged of the step, see `Stride`."""
        return BufferedFunction(self.functions.kept("step check", self._make_step_check))

    def _make_step_check(self) -> ca.Function:
        e, rates = self.equations, UnknownRates(self.equations)
        z, u, du, p = (
            ca.SX.sym(name, size.numel())
            for name, size in zip(("z", "u", "du", "p"), (e.z, e.u, e.u, e.p), strict=True)
        )
        first = rates.first(du)
        second = rates.second(first, du, ca.SX.zeros(e.u.numel()))
        clear, distances = regular_distances(rates, ca.vertcat(first, du))
        end = ca.Function("end", [e.z, e.u, du, e.p], [first, second, stack_expressions([clear]), distances])
        before, bend, clear, room = end(z, u, du, p)
        after = self.functions.newton_expressions(z + before + 0.5 * bend, u + du, p, RUN_NEWTON_STEPS)[0]
        there, _, clear_there, room_there = end(after, u + du, du, p)
        w = ca.Function("w", [e.z, e.u, e.p], [e.w])(after, u + du, p)
        none = ca.SX.zeros(e.w.numel()), ca.SX.zeros(e.w.numel())
        still = ca.SX.zeros(e.u.numel()), ca.SX.zeros(e.u.numel())
        open_, whole = self._residual_check(w, *none, u + du, *still, p)[:2]
        change = ca.fabs(there - before) + 0.25 * ca.fmax(ca.fabs(before), ca.fabs(there)) + 1e-9
        astray = greatest_entry(ca.fabs(after - z - 0.5 * (before + there)) / change)
        turns = [
            ca.dot(before[block.unknowns], there[block.unknowns]) for block in e.blocks if slice_length(block.unknowns)
        ]
        onwards = ca.SX(1.0)
        for turn in turns:
            onwards = ca.fmin(onwards, turn + ca.sumsqr(du))
        safe = ca.SX(np.inf)
        both = ca.if_else(room * room_there < 0.0, -1.0, ca.fabs(room) + ca.fabs(room_there))
        for each in ca.vertsplit(both) if e.blocks else []:
            safe = ca.fmin(safe, each)
        whole = whole + ca.sum1(there) + ca.sum1(before)
        judged = stack_expressions([open_, whole, astray, onwards, safe, ca.fmin(clear, clear_there)])
        return function_with_cse("stride", [z, u, du, p], [after, ca.densify(judged)])

    def _residual_check(self, *given: ca.SX) -> list[ca.SX]:
        """What `ResidualCheck` of `solving` judges, by coordinates and rates alone, without the elimination."""
        e = self.equations
        w, w1, w2 = (ca.SX.sym(name, e.w.numel()) for name in ("w", "w1", "w2"))
        u, u1, u2, p = (
            ca.SX.sym(name, size) for name, size in (*((n, e.u.numel()) for n in ("u", "u1", "u2")), ("p", e.p.numel()))
        )
        closures, kinds, contacts, counted = self._residuals_and_contacts(w, u, p)
        whole = self._term_sizes((w, w1, w2), (u, u1, u2), p)
        x, x1, x2 = ca.vertcat(w, u), ca.vertcat(w1, u1), ca.vertcat(w2, u2)

        errors: list[ca.SX] = [closing_error(left, kind) for kind, left in zip(kinds, scalars(closures), strict=True)]
        gaps = [ca.fabs(each) for each in errors]
        broken = []
        lengths = [k for k, kind in enumerate(kinds) if kind is MeasureKind.LENGTH]
        fastest = ca.SX(0.0)
        for order, left in enumerate(time_derivatives(closures, x, x1, x2), 1):
            scale = stack_expressions(size.parts[order] for size in whole)
            # a velocity counts as one in an arc of the size: what turning leaves there but for rounding is none
            fastest = ca.fmax(greatest_entry(scale[lengths]), fastest**2)
            scale = scale + CARRIED_ROUNDING * fastest
            broken.append(greatest_entry(ca.fabs(left) / ca.if_else(scale == 0.0, 1.0, scale)))
        greatest = self._greatest_rates(w1, w2)
        moving = (contacts, *time_derivatives(contacts, x, x1, x2))
        open_ = [
            greatest_entry(ca.fabs(each) / size) for each, size in zip(moving, (ca.SX(1.0), *greatest), strict=True)
        ]
        many = ca.fmax(greatest_entry(ca.fabs(counted)) / (2.0 * np.pi), 1.0)
        total = sum(gaps, ca.SX(0.0)) + ca.sum1(ca.vertcat(w, w1, w2))
        verdict = [
            greatest_entry(stack_expressions(gaps)) / many,
            total,
            *broken,
            greatest_entry(stack_expressions(open_)),
        ]
        inner = ca.Function("gate", [w, w1, w2, u, u1, u2, p], verdict)
        return list(inner(*given))

    def _greatest_rates(self, w1: ca.SX, w2: ca.SX) -> list[ca.SX]:
        """The greatest rate of each order, what a velocity makes of itself in an arc included."""
        turns = [
            k
            for k, each in enumerate(self.equations.coordinates)
            if each.of_link and each.kind is not MeasureKind.LENGTH
        ]
        found = [greatest_entry(ca.fabs(w1)), ca.fmax(greatest_entry(ca.fabs(w2)), greatest_entry(w1[turns] ** 2))]
        return [ca.if_else(each == 0.0, 1.0, each) for each in found]

    def _term_sizes(self, w: tuple[ca.SX, ...], u: tuple[ca.SX, ...], p: ca.SX) -> list[TermSizes]:
        """The sizes of the terms of every constraint and every input, with their rates."""
        sizes = [term_sizes(Jet(*each)) for each in zip(*(ca.vertsplit(each) for each in w), strict=True)]
        frames, own = self._frames_from_coordinates(sizes, frame_term_sizes)
        given = [term_sizes(Jet(*each)) for each in zip(*(ca.vertsplit(each) for each in u), strict=True)]
        numbers = split_pair_numbers(self.structure.pairs, p)
        return [each for _, each in residuals(self.structure, frames, numbers, own, given)]

    def _frames_from_coordinates(
        self, w: Sequence[Any], frame: Callable[..., Frame]
    ) -> tuple[dict[str, Frame], dict[str, tuple[Any, ...]]]:
        pairs = {pair.name: pair for pair in self.structure.pairs}
        columns = coordinate_columns(self.equations.coordinates)
        return frames_from_coordinates(w, columns, [link.name for link in self.structure.links], pairs, frame)

    def _residuals_and_contacts(self, w: ca.SX, u: ca.SX, p: ca.SX) -> tuple[ca.SX, list[MeasureKind], ca.SX, ca.SX]:
        """What every constraint and every input leaves open with its kind, gaps of contacts, and what counts turns."""
        frames, own = self._frames_from_coordinates(ca.vertsplit(w), frame_at)
        numbers = split_pair_numbers(self.structure.pairs, p)
        rows = list(residuals(self.structure, frames, numbers, own, u))
        gaps = [pair.contact_gap(numbers[pair.name], own[pair.name]) for pair in self.structure.pairs]
        contacts = [gap for gap in gaps if isinstance(gap, ca.SX)]
        counted = [frame.angle for frame in frames.values() if not frame.fixed]
        counted += [each for values in own.values() for each in values]
        return (
            stack_expressions(left for _, left in rows),
            [row.kind for row, _ in rows],
            stack_expressions(contacts),
            stack_expressions(counted),
        )


def acceptance_functions(mechanism: Mechanism) -> AcceptanceFunctions:
    """What judges positions of a mechanism; mechanisms that differ in their links' dimensions share one."""
    return _cached_acceptance_functions(equation_structure(mechanism))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_acceptance_functions(structure: Mechanism) -> AcceptanceFunctions:
    return AcceptanceFunctions(structure, equation_functions(structure))
