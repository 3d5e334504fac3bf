"""Values of what solves linear equations, as forces and velocities do, with slopes, at positions of many designs."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations
from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array
from planar.synthesis.fitting.wanted_equations import in_entries


class LinearSystem(NamedTuple):
    """Equations that are linear in unknowns l, and a value of these, over a design's z, u and d."""

    design: DesignEquations
    equations: ca.SX
    unknowns: ca.SX
    value: ca.SX


class _SystemFunctions(NamedTuple):
    system: BufferedFunction
    "(y, x) -> A, b"
    value: BufferedFunction
    "(y, x, l) -> a, a_l"
    slopes: BufferedFunction
    "(y, x, l, w) -> the derivatives in y and x of a - w^T (A l + b)"


class AdjointRows:
    """Values at positions y of designs x (see `in_entries`), a column for each of linear `systems`.

    Where a value is a(y, x, l) of what solves A(y, x) l = -b(y, x), with A^T w = a_l, it changes by the adjoint (A.
    Griewank, A. Walther, Evaluating Derivatives, SIAM 2008, ch. 15): da = (a - w^T (A l + b))_x dx, and with y alike.
    """

    def __init__(self, systems: Iterable[LinearSystem], free: Sequence[str], scale: Array):
        self.systems, self.free, self.scale = tuple(systems), tuple(free), scale

    def __len__(self) -> int:
        """How many columns there are."""
        return len(self.systems)

    @cached_property
    def _functions(self) -> list[_SystemFunctions]:
        return [self._functions_of(each) for each in self.systems]

    def _functions_of(self, of: LinearSystem) -> _SystemFunctions:
        y, x, (equations, value) = in_entries(of.design, self.free, self.scale, [of.equations, of.value])
        own, w = of.unknowns, ca.SX.sym("w", equations.numel())
        A, b = ca.jacobian(equations, own), ca.substitute(equations, own, ca.SX.zeros(own.numel()))
        adjoint = value - ca.dot(w, equations)
        told = ([y, x], [A, b]), ([y, x, own], [value, ca.jacobian(value, own)])
        slopes = [y, x, own, w], [ca.jacobian(adjoint, y), ca.jacobian(adjoint, x)]
        return _SystemFunctions(
            *(
                BufferedFunction(ca.Function("rows", given, [ca.densify(each) for each in found]))
                for given, found in (*told, slopes)
            )
        )

    def values(self, x: Array, y: Array) -> Array:
        """The values (positions, rows), of positions y (positions, unknowns) of designs x (positions, free)."""
        found = np.empty((len(y), len(self)))
        for k, each in enumerate(self._functions):
            found[:, k] = self._solved(each, x, y)[0]
        return found

    def linearise(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """The values, and their slopes in y (positions, rows, unknowns) and x (positions, rows, free), each with the
        other held."""
        many = len(y)
        values = np.empty((many, len(self)))
        by_y, by_x = (np.empty((many, len(self), each.shape[1])) for each in (y, x))
        for k, each in enumerate(self._functions):
            values[:, k], by_l, unknowns, inverse = self._solved(each, x, y)
            w = np.einsum("nlr,nl->nr", inverse, by_l)
            own = each.slopes.evaluate_batch(many, y, x, unknowns, w)
            by_y[:, k], by_x[:, k] = own[0][..., 0], own[1][..., 0]
        return values, by_y, by_x

    def _solved(self, of: _SystemFunctions, x: Array, y: Array) -> tuple[Array, Array, Array, Array]:
        """Values (n,), their slopes by the unknowns (n, unknowns), these, and the inverse of A; NaN at limits."""
        many = len(y)
        A, b = of.system.evaluate_batch(many, y, x)
        inverse = _inverses(A.transpose(0, 2, 1))
        unknowns = -np.einsum("nlr,nr->nl", inverse, b[:, 0])
        value, by_l = of.value.evaluate_batch(many, y, x, unknowns)
        return value[:, 0, 0], by_l[..., 0], unknowns, inverse


def _inverses(matrices: Array) -> Array:
    """Of matrices (n, rows, columns), generalised where constraints hold twice; NaN where there is none."""
    is_finite = np.isfinite(matrices).all(axis=(1, 2))
    if matrices.shape[1] == matrices.shape[2] and is_finite.all():
        try:
            told: Array = np.linalg.inv(matrices)
            return told
        except np.linalg.LinAlgError:
            pass  # one of them is exactly at a limit
    found: Array = np.full(matrices.swapaxes(1, 2).shape, np.nan)
    found[is_finite] = np.linalg.pinv(matrices[is_finite], rcond=1e-12)
    return found
