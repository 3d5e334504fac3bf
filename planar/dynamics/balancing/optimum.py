"""The counterweights that make something least over a motion, with a bound below which none can bring it.

For any multipliers u_k, positions k, with the sum of |u_k| one, max |f_k| >= sum u_k . f_k, which is linear in the
counterweights: what it is at least over all of them is known in closed form. So the bound does not rest on the solver.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.dynamics.balancing.cone_program import ConeBlock, solve_cone_program
from planar.dynamics.balancing.counterweights import CounterweightSet
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome

LIGHTEST_SLACKS = (1e-9, 1e-8, 1e-7)
"""Of what it is without counterweights: by so much more the lightest of the best may leave, tried one after the other:
the smaller the harder for the solver."""
LEAST_LIMIT = 1e-9
"""Of what a counterweight at its limits does: no limit of a response is smaller."""
ROUNDING = 1e-12
"""Of the greatest part of a sum: what is less is none."""
INERTIA_WEIGHT = 1e-3
"""Of a mass at the limit: what a moment of inertia at the limit counts where the lightest are looked for."""


class Response(NamedTuple):
    """What mass parameters do at positions: `matrix` (n, d, 4 links) of them and `offset` (n, d), in one unit.

    Its size at a position is the length of the vector of d; `greatest_part` is the greatest of the parts that the
    offset is the sum of, beside which it is rounding.
    """

    matrix: Array
    offset: Array
    greatest_part: float = 0.0

    def as_root_mean_square(self, share: Array) -> Response:
        """The same as one long vector, whose length is the root of the mean square; rows count by their share (n,)."""
        n, d, columns = self.matrix.shape
        by = np.sqrt(share)[:, None]
        matrix, offset = (self.matrix * by[..., None]).reshape(1, n * d, columns), (self.offset * by).reshape(1, n * d)
        return Response(matrix, offset, self.greatest_part)

    def restricted(self, weights: CounterweightSet) -> Response:
        """The same by the variables of counterweights."""
        return Response(self.matrix[:, :, weights.columns] * weights.unit, self.offset, self.greatest_part)

    def greatest(self, x: Array) -> float:
        """The greatest size over the positions."""
        return float(np.linalg.norm(self.matrix @ x + self.offset, axis=1).max(initial=0.0))


class Optimum(NamedTuple):
    """Variables of counterweights (4 links,), what they make of the objective, and a bound that no others go below."""

    x: Array
    value: float
    bound: float


def minimise_greatest(
    objective: Response, weights: CounterweightSet, limits: Sequence[tuple[Response, float]] = ()
) -> Optimum:
    """The counterweights that make the greatest size of a response least, other responses within limits.

    Of those that do so the lightest. Raises NoAnswer where none keep to the limits, or the solver does not get there.
    """
    mine = objective.restricted(weights)
    others = [_limited(each.restricted(weights), limit) for each, limit in limits]
    nothing = np.zeros(4 * len(weights.links))
    scale = mine.greatest(nothing)
    # beside what the masses, and the greatest counterweights, do
    if scale <= ROUNDING * max(mine.greatest_part, float(np.abs(mine.matrix).max(initial=0.0))) and not others:
        return Optimum(nothing, scale, 0.0)
    scale = scale or float(np.abs(mine.matrix).max()) or 1.0
    count = weights.variable_count
    cost = np.zeros(count + 1)
    cost[-1] = 1.0
    blocks = [
        *weights.cone_blocks(count + 1),
        _size_block(mine, scale, count, None),
        *(_size_block(each, limit, count, 1.0) for each, limit in others),
    ]
    found = solve_cone_program(cost, blocks)
    if not found.is_solved:
        told = f"the conic solver did not find the best counterweights ({found.status})"
        raise NoAnswer(Outcome.TOO_INEXACT, told)
    bound = _dual_bound(mine, scale, others, weights, found.multipliers[2:])
    x = found.x[: len(nothing)]
    lighter = _lightest(mine, mine.greatest(x), scale, others, weights)
    x = x if lighter is None else lighter
    return Optimum(x, mine.greatest(x), bound)


def _limited(response: Response, limit: float) -> tuple[Response, float]:
    """A response with its limit, which is no smaller than rounding of what the greatest counterweights do."""
    return response, max(limit, LEAST_LIMIT * float(np.abs(response.matrix).max(initial=0.0)), 1e-300)


def _lightest(
    mine: Response, value: float, scale: float, others: Sequence[tuple[Response, float]], weights: CounterweightSet
) -> Array | None:
    """The lightest variables that leave hardly more than a value; None where the solver finds none."""
    count, links = weights.variable_count, len(weights.links)
    cost = np.zeros(count)
    cost[np.arange(0, 4 * links, 4)] = 1.0
    cost[np.arange(3, 4 * links, 4)] = INERTIA_WEIGHT
    for slack in LIGHTEST_SLACKS:
        found = solve_cone_program(
            cost,
            [
                *weights.cone_blocks(count),
                _size_block(mine, scale, count - 1, value / scale + slack),
                *(_size_block(each, limit, count - 1, 1.0) for each, limit in others),
            ],
        )
        x = found.x[: 4 * links]
        within = all(each.greatest(x) <= limit * (1.0 + slack) for each, limit in others)
        if found.is_solved and within and mine.greatest(x) <= value + 2.0 * slack * scale:
            return x
    return None


def _size_block(response: Response, scale: float, last: int, limit: float | None) -> ConeBlock:
    """That the size at every position is at most the last variable, or a limit, times the scale."""
    n, d, columns = response.matrix.shape
    matrix, offset = np.zeros((n, d + 1, last + 1)), np.zeros((n, d + 1))
    matrix[:, 1:, :columns], offset[:, 1:] = response.matrix / scale, response.offset / scale
    if limit is None:
        matrix[:, 0, last] = 1.0
    else:
        offset[:, 0] = limit
    return ConeBlock("second-order", matrix.reshape(n * (d + 1), -1), offset.ravel(), d + 1)


def _dual_bound(
    mine: Response,
    scale: float,
    others: Sequence[tuple[Response, float]],
    weights: CounterweightSet,
    multipliers: Sequence[Array],
) -> float:
    """The bound that multipliers of the sizes prove, whatever they are; nothing is below zero."""
    vectors = [
        -each.reshape(len(response.offset), -1)[:, 1:]
        for each, (response, _) in zip(multipliers, [(mine, 0.0), *others], strict=True)
    ]
    total = float(np.linalg.norm(vectors[0], axis=1).sum())
    if not total:
        return 0.0
    linear, constant = np.zeros(mine.matrix.shape[2]), 0.0
    for vector, response, unit, limit in zip(
        vectors,
        [mine, *(each for each, _ in others)],
        [scale, *(limit for _, limit in others)],
        [0.0, *(limit for _, limit in others)],
        strict=True,
    ):
        by = vector * (scale / (total * unit))
        linear = linear + np.einsum("nd,ndc->c", by, response.matrix)
        constant += float((by * response.offset).sum()) - limit * float(np.linalg.norm(by, axis=1).sum())
    return max(constant + weights.least_sum(linear), 0.0)
