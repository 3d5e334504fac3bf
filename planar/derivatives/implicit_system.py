"""Derivatives of what follows from equations that are solved level after level: implicit differentiation.

Unknowns x_k of level k are solved from G_k(x_0, ..., x_k, t) = 0, and results are r(x, t), for parameters t. With
A_k = dG_k/dx_k

    dx_k/dt = -A_k^-1 (dG_k/dt + sum of dG_k/dx_j dx_j/dt over j < k)

and transposed, level after level from the last, it gives the gradient of any weighed sum of results at the cost of one
such solution, however many parameters there are (A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, ch. 15).
Second derivatives are those of the Lagrangian r - lambda^T G along the first ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.time_limit import all_within_time, stop_if_over

SINGULAR = 1e-9
"""A singular value below this part of the greatest is none."""
CONTRADICTION = 1e-7
"""Equations that no change of the unknowns keeps, by more than this part, are contradicted."""
MAX_CHUNK_NUMBERS = 4_000_000
"""Numbers of Jacobians that are held at once."""


class Level(NamedTuple):
    """Unknowns x, and the equations G = 0 that they are solved from, which those of lower levels and t stand in."""

    unknowns: ca.SX
    equations: ca.SX
    is_determinate: bool = True
    """False where the equations may leave some unknowns open, and results ask for none of these."""


class ResultSlopes(NamedTuple):
    """Derivatives of results at n positions, where there are none, and which changes contradict the equations."""

    slopes: Array
    "(n, results, parameters)"
    is_singular: BoolArray
    "(n,)"
    contradicts: BoolArray
    "(n, parameters)"


class ImplicitSystem:
    """Levels, one upon the other, over parameters; `constants` are symbols of numbers that nothing is derived by."""

    def __init__(self, levels: Sequence[Level], parameters: ca.SX, constants: ca.SX | None = None):
        self.levels, self.parameters = tuple(levels), parameters
        self.constants = ca.SX(0, 1) if constants is None else constants
        self.unknowns = [level.unknowns for level in levels]
        self.given = [*self.unknowns, self.parameters, self.constants]

    @cached_property
    def _jacobians(self) -> BufferedFunction:
        """(x_0, ..., t, constants) -> of every level dG/dx_0, ..., dG/dx_k, dG/dt."""
        found = []
        for k, level in enumerate(self.levels):
            found += [ca.jacobian(level.equations, of) for of in (*self.unknowns[: k + 1], self.parameters)]
        return BufferedFunction(ca.Function("levels", self.given, [ca.densify(each) for each in found]))

    def result_jacobians(self, results: ca.SX) -> BufferedFunction:
        """(x_0, ..., t, constants) -> of results dr/dx_0, ..., dr/dt."""
        slopes = [ca.densify(ca.jacobian(results, of)) for of in self.given[:-1]]
        return BufferedFunction(ca.Function("results", self.given, slopes))

    def slopes(
        self, results: BufferedFunction, values: Sequence[Array], parameters: Array, constants: Array | None = None
    ) -> ResultSlopes:
        """The derivatives of results, of which the Jacobians are given, in the parameters, at positions (n)."""
        size = sum(level.unknowns.numel() for level in self.levels) + parameters.shape[1]
        step = max(1, MAX_CHUNK_NUMBERS // (size * size))
        constants = np.zeros((len(parameters), 0)) if constants is None else constants
        found = []
        for first in all_within_time(range(0, len(parameters), step), "parts of the positions"):
            rows = slice(first, first + step)
            here = [each[rows] for each in (*values, parameters, constants)]
            linear = self.linearise(here)
            own, against = linear.unknown_slopes()
            *by_unknowns, slope = (each.transpose(0, 2, 1) for each in results.evaluate_batch(len(here[0]), *here))
            for by, of in zip(by_unknowns, own, strict=True):
                slope = slope + by @ of
            found.append(ResultSlopes(slope, linear.is_singular, against))
        return ResultSlopes(*(np.concatenate(each) for each in zip(*found, strict=True)))

    def gradient(
        self,
        weighed: BufferedFunction,
        weights: Array,
        values: Sequence[Array],
        parameters: Array,
        constants: Array | None = None,
    ) -> tuple[Array, BoolArray]:
        """The derivative of the sum of results (see `weighed_results`) times their weights (n, results) at each of n
        positions, in the parameters (n, parameters), and where there is none (n,): one transposed solution, for however
        many."""
        stop_if_over("before the positions were linearised")
        constants = np.zeros((len(parameters), 0)) if constants is None else constants
        given = [*values, parameters, constants]
        of_results = weighed.evaluate_batch(len(parameters), *given, weights)
        *by_unknowns, whole = (each[:, 0] for each in of_results)
        blocks = iter(each.transpose(0, 2, 1) for each in self._level_jacobians.evaluate_batch(len(parameters), *given))
        many, none = len(self.levels), np.zeros((len(parameters), 0, 0))
        linear = LinearLevels(
            [[*(next(blocks) for _ in range(k + 1)), none] for k in range(many)],
            [level.is_determinate for level in self.levels],
        )
        multipliers = linear.multipliers(by_unknowns)
        own = self._weighed_equations.evaluate_batch(len(parameters), *given, np.concatenate(multipliers, axis=1))
        return whole - own[0][:, 0], linear.is_singular

    def weighed_results(self, results: ca.SX) -> BufferedFunction:
        """(x_0, ..., t, constants, weights) -> the derivatives of the weighed sum in x_0, ..., t."""
        weights = ca.SX.sym("weights", results.numel())
        slopes = [ca.densify(ca.jtimes(results, of, weights, True)) for of in self.given[:-1]]
        return BufferedFunction(ca.Function("weighed", [*self.given, weights], slopes))

    @cached_property
    def _weighed_equations(self) -> BufferedFunction:
        """The same of all levels' equations, in t."""
        equations = ca.vertcat(*(level.equations for level in self.levels))
        weights = ca.SX.sym("weights", equations.numel())
        slope = ca.densify(ca.jtimes(equations, self.parameters, weights, True))
        return BufferedFunction(ca.Function("weighed", [*self.given, weights], [slope]))

    @cached_property
    def _level_jacobians(self) -> BufferedFunction:
        """(x_0, ..., t, constants) -> of every level dG/dx_0, ..., dG/dx_k."""
        found = [
            ca.densify(ca.jacobian(level.equations, of))
            for k, level in enumerate(self.levels)
            for of in self.unknowns[: k + 1]
        ]
        return BufferedFunction(ca.Function("levels", self.given, found))

    def second_slopes(
        self, result: ca.SX, values: Sequence[Array], parameters: Array, constants: Array | None = None
    ) -> Array:
        """The second derivatives of one result in the parameters (n, parameters, parameters): with the first ones of
        the unknowns X, (X, 1)^T H (X, 1) of the Hessian H of the Lagrangian r - lambda^T G."""
        constants = np.zeros((len(parameters), 0)) if constants is None else constants
        given = [*values, parameters, constants]
        linear = self.linearise(given)
        first, _ = linear.unknown_slopes()
        one = np.ones((len(parameters), 1))
        *by_unknowns, _ = (
            each[:, 0] for each in self.weighed_results(result).evaluate_batch(len(parameters), *given, one)
        )
        multipliers = np.concatenate(linear.multipliers(by_unknowns), axis=1)
        equations = ca.vertcat(*(level.equations for level in self.levels))
        weights = ca.SX.sym("weights", equations.numel())
        variables = ca.vertcat(*self.given[:-1])
        hessian = ca.hessian(result - ca.dot(weights, equations), variables)[0]
        function = BufferedFunction(ca.Function("hessian", [*self.given, weights], [ca.densify(hessian)]))
        whole = function.evaluate_batch(len(parameters), *given, multipliers)[0]
        own = np.broadcast_to(np.eye(parameters.shape[1]), (len(parameters), *[parameters.shape[1]] * 2))
        along = np.concatenate([*first, own], axis=1)
        found: Array = along.transpose(0, 2, 1) @ whole @ along
        return found

    def linearise(self, values: Sequence[Array]) -> LinearLevels:
        """The levels at positions: the unknowns, parameters and constants (n, ...) each."""
        found = iter(each.transpose(0, 2, 1) for each in self._jacobians.evaluate_batch(len(values[0]), *values))
        blocks = [[next(found) for _ in range(k + 2)] for k in range(len(self.levels))]
        return LinearLevels(blocks, [level.is_determinate for level in self.levels])


class LinearLevels:
    """The levels of an implicit system linearised at n positions, and their matrices factored."""

    def __init__(self, blocks: Sequence[Sequence[Array]], are_determinate: Sequence[bool]):
        self.blocks = blocks
        self.is_singular = np.zeros(len(blocks[0][-1]), bool)
        "(n,): where a level does not determine its unknowns, so that there are no derivatives"
        self._inverses: list[Array] = []
        for row, is_determinate in zip(blocks, are_determinate, strict=True):
            inverse, is_singular = invert_matrices(row[-2])
            self._inverses.append(inverse)
            if is_determinate:
                self.is_singular |= is_singular

    def unknown_slopes(self) -> tuple[list[Array], BoolArray]:
        """dx_k/dt (n, unknowns, parameters) of every level, and where a level contradicts a change of a parameter
        alone (n, parameters)."""
        slopes: list[Array] = []
        against: BoolArray = np.zeros((len(self.is_singular), self.blocks[0][-1].shape[2]), dtype=bool)
        for row, inverse in zip(self.blocks, self._inverses, strict=True):
            changed = row[-1] + sum(block @ slope for block, slope in zip(row, slopes, strict=False))
            slope = -inverse @ changed
            left = changed + row[-2] @ slope
            slope -= inverse @ left  # refined once
            left = np.abs(changed + row[-2] @ slope).max(axis=1, initial=0.0)
            terms = np.abs(row[-1]) + sum(np.abs(block) @ np.abs(of) for block, of in zip(row, slopes, strict=False))
            against |= left > CONTRADICTION * terms.max(axis=1, initial=0.0)
            slopes.append(slope)
        return slopes, against

    def multipliers(self, weights: Sequence[Array]) -> list[Array]:
        """lambda (n, rows) of every level: by how much a weighed sum of results changes where its equations are open
        by one, from the weighed results' derivatives in the unknowns (n, unknowns) of every level."""
        left = [each.copy() for each in weights]
        found: list[Array] = []
        for k in reversed(range(len(self.blocks))):
            row, inverse = self.blocks[k], self._inverses[k]
            own = np.einsum("nur,nu->nr", inverse, left[k])
            own += np.einsum("nur,nu->nr", inverse, left[k] - np.einsum("nru,nr->nu", row[-2], own))
            for j in range(k):
                left[j] -= np.einsum("nru,nr->nu", row[j], own)
            found.append(own)
        return found[::-1]


def invert_matrices(matrices: Array) -> tuple[Array, BoolArray]:
    """The inverses (n, columns, rows) of matrices (n, rows, columns), as far as there are any, and where they do not
    determine all that they are multiplied by (n,)."""
    many, rows, columns = matrices.shape
    is_known: BoolArray = np.asarray(np.isfinite(matrices).all(axis=(1, 2)))
    if not columns or not many:
        return np.zeros((many, columns, rows)), ~is_known
    known = np.where(is_known[:, None, None], matrices, 0.0)
    by_row = _nonzero(np.linalg.norm(known, axis=2, keepdims=True))
    by_column = _nonzero(np.linalg.norm(known / by_row, axis=1, keepdims=True))
    scaled = known / by_row / by_column
    inverse, is_sure = _regular_inverses(scaled)
    is_singular: BoolArray = ~is_known | (rows < columns)
    if not is_sure.all():
        u, s, v = np.linalg.svd(scaled[~is_sure], full_matrices=False)
        weak: BoolArray = np.asarray(s <= SINGULAR * s[:, :1])
        kept = np.where(weak, 0.0, 1.0 / np.where(weak, 1.0, s))
        inverse[~is_sure] = (v.transpose(0, 2, 1) * kept[:, None]) @ u.transpose(0, 2, 1)
        is_singular[~is_sure] |= weak.any(axis=1)
    return inverse / by_row.transpose(0, 2, 1) / by_column.transpose(0, 2, 1), is_singular


def _regular_inverses(matrices: Array) -> tuple[Array, BoolArray]:
    """The inverses of matrices (n, rows, columns), and which of them (n,) surely have no weak singular value."""
    many, rows, columns = matrices.shape
    found = np.zeros((many, columns, rows))
    none: BoolArray = np.zeros(many, dtype=bool)
    if rows != columns:
        return found, none
    try:
        found[:] = np.linalg.inv(matrices)
    except np.linalg.LinAlgError:  # one of them is singular to the last digit
        return found, none
    sizes = np.linalg.norm(matrices, axis=(1, 2)) * np.linalg.norm(found, axis=(1, 2))  # no less than the condition
    return found, np.asarray(sizes < 1.0 / SINGULAR)


def _nonzero(scale: Array) -> Array:
    return np.where(scale > 0.0, scale, 1.0)
