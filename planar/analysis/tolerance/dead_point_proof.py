"""Whether there is a dead point within tolerances: a solution of its own equations, proved, and what brings it near."""

from __future__ import annotations

from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.analysis.tolerance.cover import Undecided
from planar.analysis.tolerance.varied import Varied
from planar.derivatives.design_equations import DesignEquations, dead_points_over_boxes, fold_function
from planar.derivatives.enclosures import ParameterBoxes, ParametricSystem
from planar.equations.casadi_functions import BufferedFunction
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import relative_motions
from planar.model.wording import amount

MAX_STARTS = 16
"""Positions of the inputs, those nearest to a dead point, from which it is looked for."""
NEAR = 0.6
"""rad or sizes: a dead point farther from a position is one of another assembly."""
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

    def __init__(self, design: DesignEquations, nominal: Array, varied: Varied, names: tuple[str, ...]):
        """`nominal` are the parameters (t,) about which others vary."""
        self.design, self.nominal, self.varied, self.names = design, nominal, varied, names

    @cached_property
    def _dead_points(self) -> ParametricSystem:
        return dead_points_over_boxes(self.design)

    @cached_property
    def _fold(self) -> BufferedFunction:
        return fold_function(self.design)

    def _weakest(self, lower: Array, upper: Array, near: Array) -> list[Weakest]:
        """Of all boxes those nearest to singular, the nearest first, each at another position of the inputs."""
        t = self.varied.boxes_of_t(self.nominal, lower, upper).middle
        slopes = self._fold.evaluate_batch(len(t), near, t, near)[0].transpose(0, 2, 1)
        least = np.linalg.svd(np.nan_to_num(slopes), compute_uv=False).min(axis=1, initial=np.inf)
        known = np.isfinite(slopes).all(axis=(1, 2)) & np.isfinite(least)
        found: dict[bytes, Weakest] = {}
        for k in np.argsort(np.where(known, least, np.inf))[: int(known.sum())].tolist():
            place = t[k, : self.varied.inputs].tobytes()
            if place not in found:
                found[place] = self._near_singular(t[k], near[k])
            if len(found) == MAX_STARTS:
                break
        return list(found.values())

    def _near_singular(self, t: Array, near: Array) -> Weakest:
        left, sizes, right = np.linalg.svd(self._fold(near, t, near)[0].T)
        by, turned = self._fold(near, t, right[-1])[1:]
        push = (left[:, -1] @ by.T)[self.varied.columns]
        return Weakest(t, near, float(sizes[-1]), right[-1], float(left[:, -1] @ turned[0]), push)

    def _start(self, found: Weakest) -> tuple[Array, Array]:
        """Where Newton's method starts, by the quadratic in which it folds, and what is given."""
        k = self.varied.inputs
        t, e = found.t.copy(), np.zeros(len(found.t))
        own = self.varied.columns[k:]
        t[own] = np.where(np.isin(own, self.varied.columns[:k]), t[own], self.nominal[own])
        way = found.push[k:] * np.sign(found.turn)
        far = np.where(way > 0.0, self.varied.upper, self.varied.lower) * (way != 0.0)
        if self.varied.discs:
            both = way[-2 * self.varied.discs :].reshape(-1, 2)
            size = np.hypot(*both.T)[:, None]
            part = np.abs(both) / np.where(size > 0.0, size, 1.0)
            far[-2 * self.varied.discs :] *= part.ravel() * (1.0 - 1e-12)
        np.add.at(e, own, far)
        gain = abs(found.turn) * float(np.abs(way) @ np.abs(far))
        factor = min(1.0, 0.5 * found.least**2 / gain) if gain > 0.0 else 1.0
        aside = -found.least / found.turn if found.turn else 0.0
        return np.concatenate([found.near + aside * found.right, found.right, [factor]]), np.concatenate(
            [t, e, found.right]
        )

    def look(self, lower: Array, upper: Array, near: Array) -> None:
        """Raises NoAnswer where a dead point is proved near boxes, as of `Undecided`."""
        found = self._weakest(lower, upper, near)
        if not found:
            return
        start, given = (np.array(each) for each in zip(*map(self._start, found), strict=True))
        told = self._dead_points.enclose(ParameterBoxes(given, given), start, NEWTON_STEPS)
        least, most = (told.middle[:, -1] + way * told.radius[:, -1] for way in (-1.0, 1.0))
        many = self.design.z.numel()
        apart = np.abs(told.middle[:, :many] - np.array([each.near for each in found])).max(axis=1)
        known = np.flatnonzero(told.is_proved & (least >= 0.0) & (most <= 1.0) & (apart < NEAR))
        if len(known):
            k = int(known[np.argmin(most[known])])
            share = f"{100.0 * most[k]:.2g} %" if most[k] < 0.995 else "the limits"
            text = (
                f"within the tolerances there is a dead point at {self._place(found[k].t)}, at {share} of them, and "
                "beyond it no position: nothing can be guaranteed"
            )
            raise NoAnswer(Outcome.DEAD_POINT, text + self._contributor(found[k], "; {} brings it nearest"))

    def describe_doubt(self, undecided: Undecided) -> str:
        """Where it is undecided, and by which number most."""
        found = self._weakest(undecided.lower, undecided.upper, undecided.near)
        middle = 0.5 * (undecided.lower[:1] + undecided.upper[:1])
        t = found[0].t if found else self.varied.boxes_of_t(self.nominal, middle, middle).middle[0]
        tighter = self._contributor(found[0], "; {} contributes most: tighten it") if found else ""
        return (
            f"it is undecided whether all mechanisms within the tolerances have a position at {self._place(t)}, "
            f"however finely they are divided{tighter}"
        )

    def _place(self, t: Array) -> str:
        motions = relative_motions(self.design.mechanism)
        units = self.design.mechanism.units
        told = (
            f"{name} = {amount(float(t[k]), motions[name].input_kind.value, units)}"
            for k, name in enumerate(self.names[: self.varied.inputs])
        )
        return ", ".join(told)

    def _contributor(self, found: Weakest, sentence: str) -> str:
        """A sentence with the name of what pushes the Jacobian farthest to singular; nothing where nothing does."""
        k = self.varied.inputs
        far = np.abs(found.push[k:]) * np.maximum(np.abs(self.varied.lower), np.abs(self.varied.upper))
        if not np.any(far):
            return ""
        name = self.names[k + int(np.argmax(far))]
        return sentence.format(name[:-2] if name.startswith("clearance.") else name)
