"""Whether masses that bodies can have balance a linkage, or a certificate that none can.

A body of mass m, first moments s and moment of inertia I about the origin of its link has m I >= |s|^2. The greatest
margin t by which all links stay inside that cone, with their masses in all one and every condition met, is above zero
where real bodies balance the linkage; else the multipliers of the conditions are a sum of these that is zero for every
balanced linkage and, by the duality of cones (Farkas' lemma), above zero for all bodies. That four-bars of special
lengths need no counter-rotation: C. Gosselin, B. Moore and J. Schicho, Dynamic balancing of planar mechanisms using
toric geometry, J. Symb. Comput. 44, 2009.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from math import hypot

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.dynamics.balancing.conditions import (
    BalancingConditions,
    ConditionSet,
    ConditionTerm,
    balancing_conditions,
)
from planar.dynamics.balancing.cone_program import ConeBlock, solve_cone_program
from planar.dynamics.balancing.mass_parameters import QUANTITIES, as_mass
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.model.loads import Mass
from planar.model.mechanism import Mechanism

MARGIN_TOLERANCE = 1e-7
"""A margin below this is none: bodies would have to be points, or to have no mass."""
SHOWN_COEFFICIENT = 1e-6
"""Of the greatest, in units of the size: smaller ones of a certificate are rounding of the solver, and in its error."""
CONDITION_TOLERANCE = 1e-3
"""Of the margin by which parameters are those of bodies: what the conditions may be off by; it takes less to mend."""
GREATEST_MOMENT = 1e3
"""In units of the size and of all masses: first moments of links whose mass has no part in it are no greater."""
CERTIFICATE_TOLERANCE = 1e-10
"""A certificate on the edge, with no margin, and more rounding than this beside its coefficients is none."""
SPARSE_RATIO = 1e-4
"""Of the greatest coefficient of a certificate: smaller ones are tried without."""
IDLE_COLUMN = 1e-9
"""A column of the conditions below this is that of a mass parameter that has no part in them."""
SPARE_MASS_RATIO = 0.1
"""Of the greatest mass: what a link is given whose mass has no part in it."""
KINDS = {"shaking force": "force", "shaking moment": "moment", "both": "both"}
"""The kinds of conditions, and the attributes in which they are found."""


@dataclass(frozen=True, eq=False)
class MassBalance:
    """Whether bodies with mass on all links balance a linkage: its `kind` is "shaking force", "shaking moment" or
    "both".

    Where they do (`is_possible`), `masses` are some that do (kg, m, kg m^2), the heaviest of one kilogram; they may be
    multiplied by any number. `margin` is how far inside the cone of bodies they can be, in units of all masses.

    Where they do not, `certificate` is a sum of mass parameters that is zero for every balanced linkage, and greater
    than zero for any bodies: by -`margin` times the sum of all m + I / size^2 that have a part in it, at least. A
    margin of about zero says that the sum is above zero but for points, or links without mass. `error` is what rounding
    leaves of the certificate, beside its greatest coefficient in units of the size.
    """

    kind: str
    is_possible: bool
    margin: float
    masses: tuple[Mass, ...] = ()
    certificate: tuple[ConditionTerm, ...] = ()
    error: float = 0.0
    size: float = field(default=1.0, repr=False)

    __repr__ = short_repr


@takes_mechanism
def mass_balance(mechanism: Mechanism, kind: str = "both", about: str | None = None) -> MassBalance:
    """Whether bodies with mass on all links can end the shaking force, the moment about a point, or both.

    `about` names a point of the frame. Without gears only linkages of special lengths have no moment; of the others a
    certificate says that masses below zero, or a wheel that turns the other way, are wanted. Raises BadInput for a kind
    that is none, and where the conic solver is not installed (extra `balance`), and what `balancing_conditions` raises.

    >>> import planar
    >>> planar.mass_balance("four-bar", "shaking force").is_possible
    True
    """
    return find_mass_balance(balancing_conditions(mechanism, about), kind)


def find_mass_balance(conditions: BalancingConditions, kind: str) -> MassBalance:
    """The same of conditions that are known."""
    if kind not in KINDS:
        raise BadInput("kind", f"one of {', '.join(KINDS)} is wanted, not {kind!r:.60}")
    wanted: ConditionSet = getattr(conditions, KINDS[kind])
    problem = _MarginProblem(wanted.basis)
    if not len(problem.positive):
        return MassBalance(kind, True, 1.0, _masses_of(conditions, np.zeros(wanted.basis.shape[1])))
    t, parameters, multipliers = problem.solve()
    size = conditions.rows.size
    if t > MARGIN_TOLERANCE:
        problem.check(parameters, wanted.basis_error)
        return MassBalance(kind, True, t, _masses_of(conditions, problem.completed(parameters)), size=size)
    combined = problem.without_rounding(multipliers)
    combined = combined / max(float(np.abs(combined).max()), 1e-300)
    margin, error = problem.margin_of(combined)
    error = max(error, wanted.basis_error)
    if error > max(CERTIFICATE_TOLERANCE, 0.5 * margin / GREATEST_MOMENT):
        told = f"whether bodies balance this linkage is on the edge, and rounding of {error:.1g} hides it"
        raise NoAnswer(Outcome.TOO_INEXACT, told)
    terms = tuple(
        ConditionTerm(
            float(value / conditions.rows.column_scale[k]),
            QUANTITIES[k % 4],
            conditions.axes[k // 4].link,
            conditions.axes[k // 4].description,
        )
        for k, value in enumerate(combined)
        if abs(value) > SHOWN_COEFFICIENT
    )
    error = max(error, float(np.abs(combined[np.abs(combined) <= SHOWN_COEFFICIENT]).max(initial=0.0)))
    return MassBalance(kind, False, -max(margin, 0.0), (), terms, error, size)


class _MarginProblem:
    """The greatest margin by which mass parameters (4 links,) that meet conditions are those of bodies.

    Of every link the parameters with a part in the conditions are asked for: where the mass has none, any first moments
    will do, for a heavy body near the origin has them with no moment of inertia to speak of.
    """

    def __init__(self, basis: Array):
        self.basis, self.count = basis, basis.shape[1]
        matters = np.abs(basis).max(axis=0, initial=0.0) > IDLE_COLUMN
        self.links = matters.reshape(-1, 4)
        self.positive = np.array([4 * k + part for k, row in enumerate(self.links) for part in (0, 3) if row[part]])
        turned = self.links[:, 1] | self.links[:, 2]
        whole = self.links[:, 0] & turned & self.links[:, 3]
        self.coned = tuple(int(k) for k in np.flatnonzero(whole))
        self.free = tuple(int(k) for k in np.flatnonzero(turned & ~whole))

    def solve(self) -> tuple[float, Array, Array]:
        """The margin, the parameters, and the multipliers of the conditions."""
        many = self.count + 1
        in_all = np.zeros((1, many))
        in_all[0, self.positive] = 1.0
        above = np.zeros((len(self.positive), many))
        above[np.arange(len(self.positive)), self.positive] = 1.0
        above[:, -1] = -1.0
        idle = np.flatnonzero(~self.links.ravel())
        unused = np.zeros((len(idle), many))
        unused[np.arange(len(idle)), idle] = 1.0
        blocks = [
            ConeBlock("zero", np.pad(self.basis, ((0, 0), (0, 1))), np.zeros(len(self.basis))),
            ConeBlock("zero", in_all, np.array([-1.0])),
            ConeBlock("nonnegative", above, np.zeros(len(above))),
        ]
        if len(idle):
            blocks.append(ConeBlock("zero", unused, np.zeros(len(idle))))
        if self.coned:
            cones = np.zeros((4 * len(self.coned), many))
            for number, k in enumerate(self.coned):
                row = 4 * number
                cones[row, [4 * k, 4 * k + 3, many - 1]] = 1.0, 1.0, -2.0
                cones[row + 1, [4 * k, 4 * k + 3]] = 1.0, -1.0
                cones[row + 2, 4 * k + 1] = cones[row + 3, 4 * k + 2] = 2.0
            blocks.append(ConeBlock("second-order", cones, np.zeros(len(cones)), 4))
        if self.free:
            bounded, heights = np.zeros((3 * len(self.free), many)), np.zeros(3 * len(self.free))
            for number, k in enumerate(self.free):
                heights[3 * number] = 1.0
                bounded[3 * number + 1, 4 * k + 1] = bounded[3 * number + 2, 4 * k + 2] = 1.0 / GREATEST_MOMENT
            blocks.append(ConeBlock("second-order", bounded, heights, 3))
        cost = np.zeros(many)
        cost[-1] = -1.0
        found = solve_cone_program(cost, blocks)
        if found.is_infeasible:
            # masses that meet the conditions are all none, and the multipliers say why
            return -np.inf, found.x[:-1], -found.multipliers[0]
        if not found.is_solved:
            # it stands on the edge: what the conditions leave may be no masses at all
            return -np.inf, found.x[:-1], self._certificate()
        margin = float(found.x[-1])
        parameters = found.x[:-1]
        if margin > MARGIN_TOLERANCE:
            parameters = self._near_origin(blocks, margin)
        return margin, parameters, -found.multipliers[0]

    def _certificate(self) -> Array:
        """Multipliers of the conditions whose sum is as far inside the cone of sums above zero as may be.

        With its coefficients of masses and moments of inertia one in all there always are best multipliers, or none are
        inside. Raises NoAnswer where the solver does not find them.
        """
        rank, many = len(self.basis), len(self.basis) + 1  # the last: how far inside
        columns = np.pad(self.basis.T, ((0, 0), (0, 1)))  # (4 links, multipliers)
        inside = columns[self.positive].copy()
        inside[:, -1] = -1.0
        free = [4 * k + part for k in self.free for part in (1, 2)]
        blocks = [
            ConeBlock("zero", columns[self.positive].sum(axis=0)[None], np.array([-1.0])),
            ConeBlock("nonnegative", inside, np.zeros(len(inside))),
            ConeBlock(
                "second-order", np.vstack([np.zeros(many), np.eye(rank, many)]), np.eye(rank + 1)[0] * 1e3, rank + 1
            ),
        ]
        if free:
            blocks.append(ConeBlock("zero", columns[free], np.zeros(len(free))))
        if self.coned:
            cones = []
            for k in self.coned:
                m, x, y, inertia = columns[4 * k : 4 * k + 4]
                both = m + inertia
                both[-1] = -2.0
                cones += [both, m - inertia, x, y]
            blocks.append(ConeBlock("second-order", np.array(cones), np.zeros(len(cones)), 4))
        cost = np.zeros(many)
        cost[-1] = -1.0
        found = solve_cone_program(cost, blocks)
        if not found.is_solved:
            told = f"the conic solver did not find whether bodies can balance this linkage ({found.status})"
            raise NoAnswer(Outcome.TOO_INEXACT, told)
        return found.x[:-1]

    def _near_origin(self, blocks: list[ConeBlock], margin: float) -> Array:
        """Parameters with half the margin whose first moments together are least."""
        many = self.count + 2  # the last: how long all first moments are
        wide = [each._replace(matrix=np.pad(each.matrix, ((0, 0), (0, 1)))) for each in blocks]
        half = np.zeros((1, many))
        half[0, -2] = 1.0
        moments = [4 * k + part for k in range(len(self.links)) for part in (1, 2)]
        length = np.zeros((len(moments) + 1, many))
        length[0, -1] = 1.0
        length[np.arange(1, len(length)), moments] = 1.0
        wide += [
            ConeBlock("zero", half, np.array([-0.5 * margin])),
            ConeBlock("second-order", length, np.zeros(len(length)), len(length)),
        ]
        found: Array = solve_cone_program(length[0], wide).x[: self.count]
        return found

    def check(self, parameters: Array, basis_error: float) -> None:
        """Raise NoAnswer where parameters do not meet the conditions, or are not those of bodies."""
        left = float(np.abs(self.basis @ parameters).max(initial=0.0)) + basis_error * float(np.linalg.norm(parameters))
        least = float(parameters[self.positive].min())
        for k in self.coned:
            m, x, y, inertia = parameters[4 * k : 4 * k + 4]
            least = min(least, 0.5 * (m + inertia - hypot(m - inertia, 2.0 * x, 2.0 * y)))
        if left > CONDITION_TOLERANCE * least:
            told = f"bodies that balance this linkage, or none, were not told apart: {left:.1g} is left of a condition"
            raise NoAnswer(Outcome.TOO_INEXACT, told)

    def completed(self, parameters: Array) -> Array:
        """The same with what has no part in the conditions: enough of it for bodies to have the rest."""
        found = parameters.reshape(-1, 4).copy()
        most = max(float(found[:, 0].max(initial=0.0)), float(np.abs(found).max(initial=0.0)), 1e-300)
        for row, (has_mass, *_, has_inertia) in zip(found, self.links, strict=True):
            square = row[1] ** 2 + row[2] ** 2
            if not has_mass:
                row[0] = max(SPARE_MASS_RATIO * most, 2.0 * square / row[3] if has_inertia and row[3] > 0.0 else 0.0)
            if not has_inertia:
                row[3] = 2.0 * square / row[0] if row[0] > 0.0 else 0.0
        return found.ravel() / float(found[:, 0].max())

    def without_rounding(self, multipliers: Array) -> Array:
        """The sum of the conditions with these multipliers (4 links,), its small coefficients made none where others
        can make up for that."""
        whole = multipliers @ self.basis
        greatest = float(np.abs(whole).max(initial=0.0)) or 1.0
        small = np.abs(whole) <= SPARSE_RATIO * greatest
        left, singular, _ = np.linalg.svd(self.basis[:, small])
        held = left[:, : len(singular)][:, singular > IDLE_COLUMN]
        sparse = (multipliers - held @ (held.T @ multipliers)) @ self.basis
        sparse = np.where(small, 0.0, sparse)
        is_near = float(np.abs(sparse - whole).max(initial=0.0)) <= 10.0 * SPARSE_RATIO * greatest
        found: Array = sparse if is_near else whole
        return found

    def margin_of(self, combined: Array) -> tuple[float, float]:
        """By how much a sum of mass parameters is above zero for bodies beside m + I, and its rounding.

        Of a link on which mass, first moments and I have a part it is that of the least eigenvalue of the sum's matrix;
        where the mass has none the first moments must have none either.
        """
        least, error = np.inf, 0.0
        for k, row in enumerate(self.links):
            m, x, y, inertia = combined[4 * k : 4 * k + 4]
            if k in self.coned:
                least = min(least, 0.5 * (m + inertia - hypot(m - inertia, x, y)))
                continue
            error = max(error, hypot(x, y))
            least = min([least, *([m] if row[0] else []), *([inertia] if row[3] else [])])
        return float(least), float(max(error, -min(least, 0.0)))


def _masses_of(conditions: BalancingConditions, parameters: Array) -> tuple[Mass, ...]:
    """Mass parameters in units of the size as masses of the links."""
    return tuple(_each_mass(conditions, parameters * conditions.rows.column_scale))


def _each_mass(conditions: BalancingConditions, parameters: Array) -> Iterator[Mass]:
    for k, axes in enumerate(conditions.axes):
        own = parameters[4 * k : 4 * k + 4]
        if own[0] > 0.0:
            yield as_mass(axes, conditions.rows.shapes[axes.link], own)
