"""The transmission angles of a start's outputs with their slopes, at positions of many designs.

Forces are those of all constraints' multipliers l under an effort on the output alone, A(y, x) l = -b(y, x). Where the
angle is a(y, x, l), with A^T w = a_l, it changes by the adjoint (A. Griewank, A. Walther, Evaluating Derivatives, SIAM
2008, ch. 15): da = (a - w^T (A l + b))_x dx, and with y alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.analysis.motion.transmission_angle import Transmission
from planar.derivatives.transmission_system import TransmissionSystem
from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.model.output_pair import find_output_pair
from planar.synthesis.fitting.wanted_equations import in_entries


class _OutputFunctions(NamedTuple):
    balance: BufferedFunction
    "(y, x) -> A, b"
    angle: BufferedFunction
    "(y, x, l) -> a, a_l"
    slopes: BufferedFunction
    "(y, x, l, w) -> the derivatives in y and x of a - w^T (A l + b)"


class TransmissionRows:
    """Angles (rad) at positions y of designs x (see `in_entries`), a column for each of the transmissions."""

    def __init__(self, mechanism: Mechanism, transmissions: Sequence[Transmission], free: Sequence[str], scale: Array):
        self.mechanism, self.transmissions, self.free, self.scale = mechanism, tuple(transmissions), tuple(free), scale

    def __len__(self) -> int:
        """How many columns there are."""
        return len(self.transmissions)

    @cached_property
    def _outputs(self) -> list[_OutputFunctions]:
        return [self._functions(each) for each in self.transmissions]

    def _functions(self, of: Transmission) -> _OutputFunctions:
        pair = find_output_pair(self.mechanism, of.pair)[1]
        system = TransmissionSystem(self.mechanism, of.link, pair, of.through)
        balance, design = system.balance, system.design
        acting, angle = ca.substitute(
            [balance.in_unknowns(balance.acting), balance.in_unknowns(system.angle)],
            [balance.work.factors, balance.constants, design.z1, design.z2],
            [
                ca.SX.ones(balance.work.factors.numel()),
                ca.SX.zeros(balance.constants.numel()),
                ca.SX.zeros(design.z1.numel()),
                ca.SX.zeros(design.z2.numel()),
            ],
        )
        y, x, (acting, angle) = in_entries(design, self.free, self.scale, [acting, angle])
        forces = balance.unknowns
        w = ca.SX.sym("w", acting.numel())
        A, b = ca.jacobian(acting, forces), ca.substitute(acting, forces, ca.SX.zeros(forces.numel()))
        adjoint = angle - ca.dot(w, acting)
        told = ([y, x], [A, b]), ([y, x, forces], [angle, ca.jacobian(angle, forces)])
        slopes = [y, x, forces, w], [ca.jacobian(adjoint, y), ca.jacobian(adjoint, x)]
        return _OutputFunctions(
            *(
                BufferedFunction(ca.Function("output", given, [ca.densify(each) for each in found]))
                for given, found in (*told, slopes)
            )
        )

    def values(self, x: Array, y: Array) -> Array:
        """The angles (positions, outputs), of positions y (positions, unknowns) of designs x (positions, free)."""
        found = np.empty((len(y), len(self)))
        for k, each in enumerate(self._outputs):
            found[:, k] = self._balanced(each, x, y)[0]
        return found

    def linearise(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """The angles, and their slopes in y (positions, outputs, unknowns) and x (positions, outputs, free), each with
        the other held."""
        many = len(y)
        angles = np.empty((many, len(self)))
        by_y, by_x = (np.empty((many, len(self), each.shape[1])) for each in (y, x))
        for k, each in enumerate(self._outputs):
            angles[:, k], by_l, forces, inverse = self._balanced(each, x, y)
            w = np.einsum("nlr,nl->nr", inverse, by_l)
            own = each.slopes.evaluate_batch(many, y, x, forces, w)
            by_y[:, k], by_x[:, k] = own[0][..., 0], own[1][..., 0]
        return angles, by_y, by_x

    def _balanced(self, of: _OutputFunctions, x: Array, y: Array) -> tuple[Array, Array, Array, Array]:
        """Angles (n,), their slopes by the forces (n, forces), the forces, and the inverse of A; NaN at limits."""
        many = len(y)
        A, b = of.balance.evaluate_batch(many, y, x)
        inverse = _inverses(A.transpose(0, 2, 1))
        forces = -np.einsum("nlr,nr->nl", inverse, b[:, 0])
        angle, by_l = of.angle.evaluate_batch(many, y, x, forces)
        return angle[:, 0, 0], by_l[..., 0], forces, inverse


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
