"""All that a position has to pass, with its rates, in one compiled function of a structure.

It says yes to what is surely sound. To what it does not, the general path says why, or that it is sound nevertheless.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_call import BufferedFunction
from planar.equations.constraint_equations import ConstraintEquations
from planar.equations.elimination import stack_expressions
from planar.equations.functions import (
    MAX_CACHED_STRUCTURES,
    RUN_NEWTON_STEPS,
    EquationFunctions,
    equation_functions,
    equation_structure,
    frames_from_coordinates,
    function_with_cse,
    slice_length,
    solve_linear,
)
from planar.foundation.geometry import Frame, frame_at, frame_term_sizes
from planar.foundation.jets import Jet, TermSizes, term_sizes
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind

Array = np.ndarray

CARRIED_ROUNDING = 1e-3
"""The rates of a constraint are judged by its own terms, and by this part of the greatest speed anywhere: some rounding
of that is carried round a loop into terms that are small, as where a link comes to rest."""
MAX_BLOCK_SIZE = 12
"""Unknowns of a group: the expressions of a larger one would be too long."""


class AcceptanceResult(NamedTuple):
    """What is judged at a position; of many positions arrays. Lengths in sizes of the mechanism, angles in rad."""

    residual: Array
    "what the worst constraint leaves open"
    finite_sum: Array
    "the sum of all that is left open: a number only if everything is"
    velocity_error: Array
    "how far velocities break the worst constraint, as a part of the greatest"
    acceleration_error: Array
    "the same of accelerations"
    contact_gap: Array
    "the greatest gap, or rate of one as a part of the greatest, of contacts that guides have to keep closed"
    regularity: Array
    "no more than the least strength of any group, see `solving.freedom`"
    least_singular_value: Array
    "no more than the least singular value of any group, columns of one size"
    rounding_amplification: Array
    "by how much, at most, round-off is greater in the rates, see `solving.accuracy`"


class StepCheck(NamedTuple):
    """What is judged of a step from one position to another along a straight way of the inputs."""

    residual: float
    "what the worst constraint leaves open at its end"
    finite_sum: float
    "a number only if everything is"
    deviation: float
    "how far the unknowns have gone aside of what the rates at its ends allow; 1 at most"
    forward_product: float
    "negative where a group comes back"
    regular_distance: float
    "how far the two ends together are from where a group could be singular, in steps"
    least_singular_value: float
    "no more than the least singular value of any group at its ends, columns of one size"


class AcceptanceFunctions:
    """The compiled functions of one structure. Only for structures whose every group has as many constraints as
    unknowns."""

    def __init__(self, structure: Mechanism, program: EquationFunctions):
        self.structure, self.functions, self.equations = structure, program, program.equations
        sizes = [slice_length(stage.unknowns) for stage in self.equations.blocks]
        self.is_available = program.is_square and max(sizes, default=0) <= MAX_BLOCK_SIZE
        self.block_starts = np.array([stage.unknowns.start for stage in self.equations.blocks], dtype=int)

    @cached_property
    def corrected_position(self) -> BufferedFunction:
        """The same as `position`, after one more of Newton's corrections: first the corrected z."""
        e = self.equations
        sizes = (e.z, e.u, e.u, e.u, e.u, e.p, e.F, e.z)
        names = ("z", "axis", "u", "u1", "u2", "p", "by", "least")
        given = [ca.SX.sym(name, size.numel()) for name, size in zip(names, sizes, strict=True)]
        settled, left = self.functions.newton_expressions(given[0], given[2], given[5])
        parts, verdict, *along = self._position(settled, *given[1:])
        # one step from a position that is not closed to round-off does not make it so where groups are weak
        open_ = ca.fmax(verdict[0], _maximum(ca.fabs(left)))
        verdict = ca.vertcat(open_, verdict[1] + ca.sum1(left), verdict[2:])
        return BufferedFunction(function_with_cse("row", given, [settled, parts, verdict, *along]))

    @cached_property
    def position(self) -> BufferedFunction:
        """(z, axis, u, u1, u2, p, by, least) -> (w, w1, w2), verdict, rates along the axis of the inputs, distances.

        `by` (rows,): what every row is divided by, `least` (unknowns,): the least sizes of columns, see
        `solving.rates.regularity`. Distances (stages,) are along the axis: within them no group can become singular.
        """
        return BufferedFunction(self._position)

    @cached_property
    def _position(self) -> ca.Function:
        e = self.equations
        axis, u1, u2 = (ca.SX.sym(name, e.u.numel()) for name in ("axis", "u1", "u2"))
        by, least = ca.SX.sym("by", e.F.numel()), ca.SX.sym("least", e.z.numel())
        rates = _RateExpressions(e)
        ways = rates.first(axis)
        z1 = rates.first(u1)
        z2 = rates.second(z1, u1, u2)
        w1 = ca.jtimes(e.w, rates.y, rates.v)
        w2 = ca.jtimes(w1, rates.y, rates.v) + ca.jtimes(e.w, rates.y, rates.a)
        w1, w2 = ca.substitute([w1, w2], [rates.v, rates.a], [ca.vertcat(z1, u1), ca.vertcat(z2, u2)])
        strength, lost = ca.SX(1.0), ca.SX(1.0)
        for stage, block in zip(e.blocks, rates.blocks, strict=True):
            if slice_length(stage.unknowns):
                own = _regularity_bound(block, by[stage.rows], least[stage.unknowns])
                strength = ca.fmin(strength, own)
                for k in range(block.size2()):
                    lost = ca.fmax(lost, 1.0 / (ca.norm_2(block[:, k]) * own * own))
        lost = lost * ca.fmax(_maximum(ca.fabs(e.w)) / np.pi, 1.0)
        clear, distances = rates.regular_distances(ca.vertcat(ways, axis))
        judged = self._residual_check(e.w, w1, w2, e.u, u1, u2, e.p)
        outputs = [ca.horzcat(e.w, w1, w2), stack_expressions([*judged, strength, clear, lost]), ways, distances]
        given = [e.z, axis, e.u, u1, u2, e.p, by, least]
        return function_with_cse("position", given, [ca.densify(each) for each in outputs])

    @cached_property
    def step_check(self) -> BufferedFunction:
        """(z, u, step of u, p) -> z after the step, and what is judged of the step, see `StepCheck`."""
        e, rates = self.equations, _RateExpressions(self.equations)
        z, u, du, p = (
            ca.SX.sym(name, size.numel())
            for name, size in zip(("z", "u", "du", "p"), (e.z, e.u, e.u, e.p), strict=True)
        )
        first = rates.first(du)
        second = rates.second(first, du, ca.SX.zeros(e.u.numel()))
        clear, distances = rates.regular_distances(ca.vertcat(first, du))
        end = ca.Function("end", [e.z, e.u, du, e.p], [first, second, stack_expressions([clear]), distances])
        before, bend, clear, room = end(z, u, du, p)
        after = self.functions.newton_expressions(z + before + 0.5 * bend, u + du, p, RUN_NEWTON_STEPS)[0]
        there, _, clear_there, room_there = end(after, u + du, du, p)
        w = ca.Function("w", [e.z, e.u, e.p], [e.w])(after, u + du, p)
        none = ca.SX.zeros(e.w.numel()), ca.SX.zeros(e.w.numel())
        still = ca.SX.zeros(e.u.numel()), ca.SX.zeros(e.u.numel())
        open_, whole = self._residual_check(w, *none, u + du, *still, p)[:2]
        change = ca.fabs(there - before) + 0.25 * ca.fmax(ca.fabs(before), ca.fabs(there)) + 1e-9
        astray = _maximum(ca.fabs(after - z - 0.5 * (before + there)) / change)
        turns = [
            ca.dot(before[stage.unknowns], there[stage.unknowns]) for stage in e.blocks if slice_length(stage.unknowns)
        ]
        onwards = ca.SX(1.0)
        for turn in turns:
            onwards = ca.fmin(onwards, turn + ca.sumsqr(du))
        safe = ca.SX(np.inf)
        for each in ca.vertsplit(room + room_there) if e.blocks else []:
            safe = ca.fmin(safe, each)
        whole = whole + ca.sum1(there) + ca.sum1(before)
        judged = stack_expressions([open_, whole, astray, onwards, safe, ca.fmin(clear, clear_there)])
        return BufferedFunction(function_with_cse("stride", [z, u, du, p], [after, ca.densify(judged)]))

    def _residual_check(self, *given: ca.SX) -> list[ca.SX]:
        """What `ResidualCheck` judges, from coordinates and rates alone: nothing of the elimination is believed."""
        e = self.equations
        w, w1, w2 = (ca.SX.sym(name, e.w.numel()) for name in ("w", "w1", "w2"))
        u, u1, u2, p = (
            ca.SX.sym(name, size) for name, size in (*((n, e.u.numel()) for n in ("u", "u1", "u2")), ("p", e.p.numel()))
        )
        closures, kinds, contacts, counted = self._residuals_and_contacts(w, u, p)
        whole = self._term_sizes((w, w1, w2), (u, u1, u2), p)
        x, x1, x2 = ca.vertcat(w, u), ca.vertcat(w1, u1), ca.vertcat(w2, u2)

        def rates(of: ca.SX) -> tuple[ca.SX, ca.SX]:
            once = ca.jtimes(of, x, x1)
            return once, ca.jtimes(once, x, x1) + ca.jtimes(of, x, x2)

        gaps = [
            ca.fabs(ca.sin(left)) + 1.0 - ca.cos(left) if kind is MeasureKind.ANGLE else ca.fabs(left)
            for kind, left in zip(kinds, ca.vertsplit(closures) if kinds else [], strict=True)
        ]
        broken = []
        lengths = [k for k, kind in enumerate(kinds) if kind is MeasureKind.LENGTH]
        fastest = ca.SX(0.0)
        for order, left in enumerate(rates(closures), 1):
            scale = stack_expressions(size.parts[order] for size in whole)
            # a velocity counts as one in an arc of the size: what turning leaves there but for rounding is none
            fastest = ca.fmax(_maximum(scale[lengths]), fastest**2)
            scale = scale + CARRIED_ROUNDING * fastest
            broken.append(_maximum(ca.fabs(left) / ca.if_else(scale == 0.0, 1.0, scale)))
        greatest = self._greatest_rates(w1, w2)
        open_ = [
            _maximum(ca.fabs(each) / size)
            for each, size in zip((contacts, *rates(contacts)), (1.0, *greatest), strict=True)
        ]
        many = ca.fmax(_maximum(ca.fabs(counted)) / (2.0 * np.pi), 1.0)
        total = sum(gaps, ca.SX(0.0)) + ca.sum1(ca.vertcat(w, w1, w2))
        verdict = [_maximum(stack_expressions(gaps)) / many, total, *broken, _maximum(stack_expressions(open_))]
        inner = ca.Function("gate", [w, w1, w2, u, u1, u2, p], verdict)
        return list(inner(*given))

    def _greatest_rates(self, w1: ca.SX, w2: ca.SX) -> list[ca.SX]:
        """The greatest rate of each order, what a velocity makes of itself in an arc included."""
        turns = [
            k
            for k, each in enumerate(self.equations.coordinates)
            if each.of_link and each.kind is not MeasureKind.LENGTH
        ]
        found = [_maximum(ca.fabs(w1)), ca.fmax(_maximum(ca.fabs(w2)), _maximum(w1[turns] ** 2))]
        return [ca.if_else(each == 0.0, 1.0, each) for each in found]

    def _term_sizes(self, w: tuple[ca.SX, ...], u: tuple[ca.SX, ...], p: ca.SX) -> list[TermSizes]:
        """The sizes of the terms of every constraint and every input, with their rates."""
        sizes = [term_sizes(Jet(*each)) for each in zip(*(ca.vertsplit(each) for each in w), strict=True)]
        frames, own = self._frames_from_coordinates(sizes, frame_term_sizes)
        given = [term_sizes(Jet(*each)) for each in zip(*(ca.vertsplit(each) for each in u), strict=True)]
        return [each for _, each in self._constraint_residuals(frames, own, given, p)]

    def _frames_from_coordinates(
        self, w: Sequence[Any], frame: Callable[..., Frame]
    ) -> tuple[dict[str, Frame], dict[str, tuple]]:
        column = {(c.owner, c.part): k for k, c in enumerate(self.equations.coordinates)}
        pairs = {pair.name: pair for pair in self.structure.pairs}
        return frames_from_coordinates(w, column, [link.name for link in self.structure.links], pairs, frame)

    def _constraint_residuals(
        self, frames: dict[str, Frame], own: dict[str, tuple], u: Sequence[Any], p: ca.SX
    ) -> Iterator[tuple[MeasureKind, Any]]:
        """(kind, what is left open) of every constraint, then of every input."""
        mechanism, values = self.structure, iter(ca.vertsplit(p) if p.numel() else ())
        numbers: dict[str, list[ca.SX]] = {}
        for pair in mechanism.pairs:
            numbers[pair.name] = [next(values) for _ in pair.number_kinds]
            left = pair.residual([frames[link] for link in pair.bodies], numbers[pair.name], own[pair.name])
            yield from zip(pair.residual_kinds, left, strict=True)
        named = relative_motions(mechanism)
        for given, at in zip(mechanism.inputs, u, strict=True):
            pair = named[given.pair]
            known = numbers.get(pair.name, [])
            yield (
                pair.input_kind,
                pair.input_position([frames[link] for link in pair.bodies], known, own.get(pair.name, ())) - at,
            )

    def _residuals_and_contacts(self, w: ca.SX, u: ca.SX, p: ca.SX) -> tuple[ca.SX, list[MeasureKind], ca.SX, ca.SX]:
        """What every constraint and every input leaves open with its kind, gaps of contacts, and what counts turns."""
        mechanism, first = self.structure, 0
        frames, own = self._frames_from_coordinates(ca.vertsplit(w), frame_at)
        rows = list(self._constraint_residuals(frames, own, ca.vertsplit(u) if u.numel() else [], p))
        contacts: list[ca.SX] = []
        for pair in mechanism.pairs:
            gap = pair.contact_gap([p[first + k] for k in range(len(pair.number_kinds))], own[pair.name])
            first += len(pair.number_kinds)
            contacts += [gap] if isinstance(gap, ca.SX) else []
        counted = [frame.angle for frame in frames.values() if not frame.fixed]
        counted += [each for values in own.values() for each in values]
        return (
            stack_expressions(left for _, left in rows),
            [kind for kind, _ in rows],
            stack_expressions(contacts),
            stack_expressions(counted),
        )


class _RateExpressions:
    """Rates of the unknowns as expressions, stage after stage."""

    def __init__(self, e: ConstraintEquations):
        self.e, self.y = e, ca.vertcat(e.z, e.u)
        self.v, self.a = ca.SX.sym("v", self.y.numel()), ca.SX.sym("a", self.y.numel())
        self.first_rate = ca.jtimes(e.F, self.y, self.v)
        self.second_rate = ca.jtimes(self.first_rate, self.y, self.v) + ca.jtimes(e.F, self.y, self.a)
        self.blocks = [ca.densify(ca.jacobian(e.F[stage.rows], e.z[stage.unknowns])) for stage in e.blocks]

    def first(self, u1: ca.SX) -> ca.SX:
        """The first rates of the unknowns for those of the inputs."""
        return self._solve_blocks(self.first_rate, self.v, u1)

    def second(self, z1: ca.SX, u1: ca.SX, u2: ca.SX) -> ca.SX:
        """Their second rates."""
        return self._solve_blocks(ca.substitute(self.second_rate, self.v, ca.vertcat(z1, u1)), self.a, u2)

    def _solve_blocks(self, rate: ca.SX, unknown_rates: ca.SX, input_rates: ca.SX) -> ca.SX:
        """The part of `way` that belongs to the unknowns, so that a rate linear in it vanishes."""
        many = self.e.z.numel()
        if not many:
            return ca.SX(0, 1)
        names, values = [unknown_rates[many:]], [input_rates]
        for stage, block in zip(self.e.blocks, self.blocks, strict=True):
            if slice_length(stage.unknowns):
                # later unknowns may stand in the expression, but cancel
                ahead = unknown_rates[stage.unknowns.start : many]
                rest = ca.substitute(rate[stage.rows], ahead, ca.SX.zeros(ahead.numel()))
                names.append(unknown_rates[stage.unknowns])
                values.append(-solve_linear(block, rest))
        return ca.substitute_inplace(names, values, [unknown_rates[:many]])[1][0]

    def regular_distances(self, along: ca.SX) -> tuple[ca.SX, ca.SX]:
        """The least singular value of any group, and how far along a way each group is regular (stages,)."""
        clear, distances = ca.SX(1.0), []
        for stage, block in zip(self.e.blocks, self.blocks, strict=True):
            if not slice_length(stage.unknowns):
                distances.append(ca.SX(np.inf))
                continue
            value, distance = _regular_distance(block, self.y, along)
            clear = ca.fmin(clear, value)
            distances.append(distance)
        return clear, stack_expressions(distances)


def _maximum(values: ca.SX) -> ca.SX:
    """The greatest of a column of numbers from zero on."""
    found = ca.SX(0.0)
    for value in ca.vertsplit(values) if values.numel() else []:
        found = ca.fmax(found, value)
    return found


def _regularity_bound(block: ca.SX, row_scale: ca.SX, column_floor: ca.SX) -> ca.SX:
    """No more than the strength of a group, see `solving.rates.regularity`."""
    scaled = block / ca.repmat(row_scale, 1, block.size2())
    sizes = [ca.fmax(ca.norm_2(scaled[:, k]), column_floor[k]) for k in range(block.size2())]
    low, high = _singular_value_bounds(scaled / ca.repmat(ca.horzcat(*sizes), block.size1(), 1))
    return low / ca.fmax(1.0, high)


def _singular_value_bounds(matrix: ca.SX) -> tuple[ca.SX, ca.SX]:
    """No more than the least singular value of a square matrix, and no less than the greatest; of two by two exact."""
    if matrix.numel() == 1:
        return ca.fabs(matrix), ca.fabs(matrix)
    square = ca.sumsqr(matrix)
    if matrix.numel() == 4:
        det = ca.fabs(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
        greatest = ca.sqrt(0.5 * (square + ca.sqrt(ca.fmax(square * square - 4.0 * det * det, 0.0))))
        return det / greatest, greatest
    # the inverse is as large as that of the triangle
    inverse = ca.solve(ca.qr(matrix)[1], ca.SX.eye(matrix.size1()))
    return 1.0 / ca.norm_fro(inverse), ca.sqrt(square)


def _regular_distance(block: ca.SX, y: ca.SX, direction: ca.SX) -> tuple[ca.SX, ca.SX]:
    """No more than the least singular value of a group, columns of one size, and how far along a way it is one at
    least (Weyl), see `solving.checks.branch_check`."""
    change = ca.reshape(ca.jtimes(ca.vec(block), y, direction), block.shape)
    sizes = ca.horzcat(*(ca.norm_2(block[:, k]) for k in range(block.size2())))
    whole = ca.repmat(sizes, block.size1(), 1)
    value = _singular_value_bounds(block / whole)[0]
    return value, value / ca.fmax(ca.norm_fro(change / whole), 1e-300)


def acceptance_functions(mechanism: Mechanism) -> AcceptanceFunctions:
    """What judges positions of a mechanism; mechanisms that differ in their links' dimensions share one."""
    return _cached_acceptance_functions(equation_structure(mechanism))


@lru_cache(maxsize=MAX_CACHED_STRUCTURES)
def _cached_acceptance_functions(structure: Mechanism) -> AcceptanceFunctions:
    return AcceptanceFunctions(structure, equation_functions(structure))
