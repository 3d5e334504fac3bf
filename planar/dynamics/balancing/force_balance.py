"""What complete balance of the shaking force needs: mass times radius of counterweights on given links."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from math import hypot

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.dynamics.balancing.conditions import BalanceCondition, BalancingConditions, balancing_conditions
from planar.dynamics.balancing.cone_program import ConeBlock, solve_cone_program
from planar.dynamics.balancing.counterweights import (
    Counterweight,
    CounterweightLimit,
    CounterweightSet,
    choose_counterweights,
    counterweight_angle,
)
from planar.dynamics.balancing.mass_parameters import mass_parameters
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism

MET_TOLERANCE = 1e-9
"""Of the greatest term: what a condition may be off by and be met."""
NEGLIGIBLE_MOMENT = 1e-8
"""Of the greatest mass times radius: a counterweight with less is none."""


@dataclass(frozen=True, eq=False)
class ForceBalance:
    """What complete balance of the shaking force needs, at any speed.

    `counterweights` are the lightest point masses, at the radii of their limits, on the links that bear some: of a link
    on a pivot mass times radius alone counts, and any radius will do. Where these links cannot balance the force
    (`is_possible` is False), there are none, and `unmet` are conditions that counterweights there do not meet.
    """

    is_possible: bool
    counterweights: tuple[Counterweight, ...]
    unmet: tuple[BalanceCondition, ...]

    __repr__ = short_repr


@takes_mechanism
def force_balance(
    mechanism: Mechanism,
    counterweights: Sequence[str] | Mapping[str, CounterweightLimit] | None = None,
    limit: CounterweightLimit | None = None,
) -> ForceBalance:
    """The counterweights with which a linkage shakes its frame by no force, at any speed, with the masses of its file.

    `counterweights` names the links that bear one (left out: all on pivots of the frame), or gives the limit of each;
    `limit` is that of the others. The radii are heeded, the greatest masses are not. Of a four-bar with counterweights
    on crank and rocker it is the closed form of R. S. Berkof and G. G. Lowen (J. Eng. Ind. 91, 1969). Raises BadInput
    where no link has a mass, and what `balancing_conditions` raises.

    >>> import planar
    >>> planar.force_balance("two-stroke-engine", ["crank"]).is_possible
    False
    """
    return find_force_balance(balancing_conditions(mechanism), counterweights, limit or CounterweightLimit())


def find_force_balance(
    conditions: BalancingConditions,
    counterweights: Sequence[str] | Mapping[str, CounterweightLimit] | None,
    limit: CounterweightLimit,
) -> ForceBalance:
    """The same of conditions that are known."""
    if conditions.is_massless:
        raise BadInput("masses", "no moving link has a mass, so that nothing shakes; give 'masses'")
    rows = conditions.rows
    parameters = mass_parameters(conditions.mechanism, rows.shapes, conditions.axes)
    total = float(parameters[::4].sum())
    weights = choose_counterweights(conditions.axes, rows.shapes, counterweights, limit, total)
    # in units of the size and of all masses
    columns, basis = weights.columns, conditions.force.basis
    asked = basis @ (parameters / rows.column_scale / total)
    unit = weights.unit / rows.column_scale[columns] / np.repeat([each.mass for each in weights.limits], 4)
    x = _lightest(basis[:, columns] * unit, asked)
    if x is None:
        return ForceBalance(False, (), _unmet(conditions, weights, parameters))
    found = []
    for number, link in enumerate(weights.links):
        mass, first, second = (float(each) * total for each in x[4 * number : 4 * number + 3])
        radius, axes = weights.limits[number].radius, conditions.axes[link]
        size = hypot(first, second)
        if size > NEGLIGIBLE_MOMENT * total:
            away = min(radius * size / mass, radius) if mass > 0.0 else radius
            found.append(
                Counterweight(
                    axes.link, size * radius / away, away, counterweight_angle(first, second), 0.0, axes.description
                )
            )
    return ForceBalance(True, tuple(found), ())


def _lightest(matrix: Array, asked: Array) -> Array | None:
    """Variables (4 links,) of the lightest points within their radii that add what is asked; None where none do."""
    count = matrix.shape[1]
    masses = np.arange(0, count, 4)
    best = np.linalg.lstsq(matrix, -asked, rcond=None)[0]
    if np.abs(matrix @ best + asked).max(initial=0.0) > MET_TOLERANCE * max(float(np.abs(asked).max(initial=0.0)), 1.0):
        return None
    cones = np.zeros((3 * len(masses), count))
    for number, mass in enumerate(masses):
        for k in range(3):
            cones[3 * number + k, mass + k] = 1.0
    cost = np.zeros(count)
    cost[masses] = 1.0
    left, singular, right = np.linalg.svd(matrix, full_matrices=False)
    strong = singular > MET_TOLERANCE * singular[0] if len(singular) else np.zeros(0, dtype=bool)
    blocks = [
        ConeBlock("zero", right[strong], (left.T @ asked)[strong] / singular[strong]),
        ConeBlock("second-order", cones, np.zeros(len(cones)), 3),
    ]
    idle = np.zeros((len(masses), count))
    idle[np.arange(len(masses)), masses + 3] = 1.0
    found = solve_cone_program(cost, [*blocks, ConeBlock("zero", idle, np.zeros(len(masses)))])
    return found.x if found.is_solved else None


def _unmet(
    conditions: BalancingConditions, weights: CounterweightSet, parameters: Array
) -> tuple[BalanceCondition, ...]:
    """The conditions that no counterweights on these links meet: such as are not met, and on which they do nothing."""
    borne = {conditions.axes[link].link for link in weights.links}
    scale = float(np.abs(parameters / conditions.rows.column_scale).max())
    alone = []
    for each in conditions.force.conditions:
        own = any(term.link in borne and (term.quantity != "m") for term in each.terms)
        size = conditions.rows.size ** {"m": 0, "I": 2}.get(each.terms[0].quantity, 1)
        if not own and abs(each.value) > MET_TOLERANCE * scale * size:
            alone.append(each)
    return tuple(alone)
