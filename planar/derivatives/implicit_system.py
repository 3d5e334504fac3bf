"""Derivatives of what follows from equations that are solved level after level: implicit differentiation.

Unknowns x_k of level k are solved from G_k(x_0, ..., x_k, t) = 0, and results are r(x, t), for parameters t. With
A_k = dG_k/dx_k

    dx_k/dt = -A_k^-1 (dG_k/dt + sum of dG_k/dx_j dx_j/dt over j < k)

and transposed, level after level from the last, it gives the gradient of any weighed sum of results at the cost of one
such solution, however many parameters there are (A. Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, ch. 15).
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.generalised_inverses import invert_matrices
from planar.foundation.time_limit import all_within_time, stop_if_over

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
