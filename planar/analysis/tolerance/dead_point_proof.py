"""Whether there is a dead point within tolerances: a solution of its own equations, proved, and what brings it near."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.analysis.tolerance.cover import Undecided, Varied
from planar.derivatives.enclosures import ParameterBoxes, ParametricSystem
from planar.derivatives.result_slopes import SlopeSystem
from planar.equations.casadi_call import BufferedFunction
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import relative_motions
from planar.model.wording import amount

MAX_LOOKED_AT = 256
"""Boxes among which the one nearest to a dead point is sought."""
NEWTON_STEPS = 12
"""Before what they lead to is proved or not."""


class Weakest(NamedTuple):
    """The box where the Jacobian is nearest to singular: t, the unknowns, the least singular value with its vectors on
    both sides, how the equations turn along the right one, and how each deviation pushes them along the left one."""

    t: Array
    near: Array
    least: float
    right: Array
    turn: float
    push: Array


class DeadPointProof:
    """Dead points of mechanisms whose deviations are all by one factor of those that bring it nearest.

    F(z, u, d + f e) = 0, F_z v = 0 and c v = 1 for z, v and the factor f, at a given position u and deviations e at
    their limits; with 0 <= f <= 1 it is within the tolerances.
    """

    def __init__(self, system: SlopeSystem, varied: Varied, names: tuple[str, ...]):
        self.design, self.varied, self.names = system.design, varied, names
        self.nominal = system.parameters[0]

    @cached_property
    def _dead_points(self) -> ParametricSystem:
        """Unknowns z, v and f over t, e of all t, and c."""
        design = self.design
        v, factor = ca.SX.sym("v", design.z.numel()), ca.SX.sym("factor")
        e, c = ca.SX.sym("e", design.t.numel()), ca.SX.sym("c", design.z.numel())
        both = ca.Function("both", [design.z, design.t, v], [design.F, ca.jtimes(design.F, design.z, v)])
        left = ca.vertcat(*both(design.z, design.t + factor * e, v), ca.dot(c, v) - 1.0)
        return ParametricSystem(ca.vertcat(design.z, v, factor), ca.vertcat(design.t, e, c), left, ca.SX(0, 1), ())

    @cached_property
    def _curvature(self) -> BufferedFunction:
        """(z, t, v) -> F_z, F_t and F_zz v v."""
        design = self.design
        v = ca.SX.sym("v", design.z.numel())
        turned = ca.jtimes(ca.jtimes(design.F, design.z, v), design.z, v)
        slopes = [ca.densify(ca.jacobian(design.F, of)) for of in (design.z, design.t)]
        return BufferedFunction(ca.Function("curvature", [design.z, design.t, v], [*slopes, ca.densify(turned)]))

    def _weakest(self, lower: Array, upper: Array, near: Array) -> Weakest | None:
        many = min(len(near), MAX_LOOKED_AT)
        t = self.varied.boxes_of_t(self.nominal, *(each[:many] for each in (lower, upper))).middle
        slopes = self._curvature.evaluate_batch(many, near[:many], t, near[:many])[0].transpose(0, 2, 1)
        least = np.linalg.svd(np.nan_to_num(slopes), compute_uv=False).min(axis=1, initial=np.inf)
        k = int(np.argmin(np.where(np.isfinite(slopes).all(axis=(1, 2)), least, np.inf)))
        if not near.shape[1] or not np.isfinite(slopes[k]).all():
            return None
        left, _, right = np.linalg.svd(slopes[k])
        by, turned = self._curvature.evaluate_batch(1, near[k][None], t[k][None], right[-1][None])[1:]
        push = (left[:, -1] @ by[0].T)[self.varied.columns]
        return Weakest(t[k], near[k], float(least[k]), right[-1], float(left[:, -1] @ turned[0, 0]), push)

    def look(self, lower: Array, upper: Array, near: Array) -> None:
        """Raises NoAnswer where a dead point is proved near boxes, as of `Undecided`."""
        found = self._weakest(lower, upper, near)
        if found is None:
            return
        k = self.varied.inputs
        t, e = found.t.copy(), np.zeros(len(found.t))
        own = self.varied.columns[k:]
        t[own] = np.where(np.isin(own, self.varied.columns[:k]), t[own], self.nominal[own])
        way = found.push[k:] * np.sign(found.turn)
        on_disc = np.ones(len(way))
        if self.varied.discs:
            both = way[-2 * self.varied.discs :].reshape(-1, 2)
            size = np.hypot(*both.T)[:, None]
            on_disc[-2 * self.varied.discs :] = (np.abs(both) / np.where(size > 0.0, size, 1.0)).ravel() * (1.0 - 1e-12)
        np.add.at(e, own, np.where(way > 0.0, self.varied.upper, self.varied.lower) * on_disc * (way != 0.0))
        gain = abs(found.turn) * float(np.abs(way) @ np.abs(e[own]))
        factor = min(1.0, 0.5 * found.least**2 / gain) if gain > 0.0 else 1.0
        aside = -found.least / found.turn if found.turn else 0.0
        start = np.concatenate([found.near + aside * found.right, found.right, [factor]])
        given = np.concatenate([t, e, found.right])[None]
        told = self._dead_points.enclose(ParameterBoxes(given, given), start[None], NEWTON_STEPS)
        least, most = (float(told.middle[0, -1] + way * told.radius[0, -1]) for way in (-1.0, 1.0))
        if told.is_proved[0] and least >= 0.0 and most <= 1.0:
            share = f"{100.0 * most:.2g} %" if most < 0.995 else "the limits"
            text = (
                f"within the tolerances there is a dead point at {self._place(t)}, at {share} of them, and beyond it "
                f"no position: nothing can be guaranteed; {self._contributor(found)} brings it nearest"
            )
            raise NoAnswer(Outcome.DEAD_POINT, text)

    def describe_doubt(self, undecided: Undecided) -> str:
        """Where it is undecided, and by which number most."""
        found = self._weakest(undecided.lower, undecided.upper, undecided.near)
        if found is None:
            middle = 0.5 * (undecided.lower[:1] + undecided.upper[:1])
            return f"it is undecided at {self._place(self.varied.boxes_of_t(self.nominal, middle, middle).middle[0])}"
        return (
            f"it is undecided whether all mechanisms within the tolerances have a position at {self._place(found.t)}, "
            f"however finely they are divided; {self._contributor(found)} contributes most: tighten it"
        )

    def _place(self, t: Array) -> str:
        motions = relative_motions(self.design.mechanism)
        units = self.design.mechanism.units
        told = (
            f"{name} = {amount(float(t[k]), motions[name].input_kind.value, units)}"
            for k, name in enumerate(self.names[: self.varied.inputs])
        )
        return ", ".join(told)

    def _contributor(self, found: Weakest) -> str:
        k = self.varied.inputs
        if len(self.names) == k:
            return "nothing"
        far = np.abs(found.push[k:]) * np.maximum(np.abs(self.varied.lower), np.abs(self.varied.upper))
        name = self.names[k + int(np.argmax(far))]
        return name[:-2] if name.startswith("clearance.") else name
