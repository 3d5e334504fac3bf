"""The gradient of a weighed sum of results, in all numbers of the file at once."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planar.derivatives.result_slopes import DerivedResults, SlopeSystem
from planar.document.first_argument import takes_result
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, join_names
from planar.foundation.time_limit import stops_in_time
from planar.results.motion import Motion, State

Weights = Mapping[str, Any]


@takes_result("State", "Motion", "Forces")
@stops_in_time
def gradient(
    result: State | Motion | Forces,
    weights: Weights,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> dict[str, float]:
    """The derivatives of a weighed sum of results, by the name of each number of the file (SI).

    `weights` by the name of a point, link, pair or input: an array for what is told of it first, as (n, 2) for the
    positions of a point over a motion of n positions, (2,) in a state; or arrays by the names of its results, as
    `{"E": {"velocity": ...}}`. The sum is over all that is given. Numbers that cannot change alone are NaN (see
    `Sensitivity.tied`).

    Raises Unknown for another name, BadInput for weights that do not fit; NoAnswer where a position with a weight has
    no derivatives, and after `timeout` s, or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> found = planar.gradient(motion, {"stroke": [1.0] + 12 * [0.0]})
    >>> one = planar.sensitivity(motion, "stroke").displacement["rod.length"][0]
    >>> round(found["rod.length"], 3), round(float(one), 3)
    (1.036, 1.036)
    """
    if not isinstance(weights, Mapping) or not weights:
        raise BadInput("weights", "name what is weighed, with an array each, as {'E': weights}")
    system = SlopeSystem(result)
    total, tied = np.zeros((system.count, len(system.names))), set[str]()
    is_used = np.zeros(system.count, dtype=bool)
    is_singular = is_used.copy()
    for name, value in weights.items():
        derived = system.named_slopes(name)
        is_singular |= derived.is_singular
        tied.update(derived.tied)
        for result_name, weight in _read_weights(derived, name, value).items():
            rows = np.any(weight != 0.0, axis=1)
            is_used |= rows
            total[rows] += np.einsum("np,npk->nk", weight[rows], derived.slopes[result_name][rows])
    if (is_singular & is_used).any():
        row = int(np.argmax(is_singular & is_used))
        raise NoAnswer(
            Outcome.DEAD_POINT,
            f"position {row} is a dead point or change point, where there are no derivatives; give it the weight 0",
        )
    gradient = total[is_used].sum(axis=0)
    return {
        name: float("nan") if name in tied else float(slope) for name, slope in zip(system.names, gradient, strict=True)
    }


def _read_weights(derived: DerivedResults, name: str, given: Any) -> dict[str, Array]:
    """Weights (n, parts) by the name of the result."""
    shapes = {result: values.shape for result, values in derived.values.items()}
    named = given if isinstance(given, Mapping) else {next(iter(shapes)): given}
    weights = {}
    for result, values in named.items():
        place = f"weights[{name!r}]"
        if result not in shapes:
            raise BadInput(place, f"of {name!r} are told {join_names(shapes)}, and no {result!r}")
        count, parts = shapes[result]
        try:
            array = np.asarray(values, dtype=float)
            weights[result] = array.reshape(count, parts)
        except (TypeError, ValueError):
            expected = (count, parts) if parts > 1 else (count,)
            raise BadInput(place, f"an array of shape {expected} is wanted here, not {np.shape(values)}") from None
        if not np.isfinite(array).all():
            raise BadInput(place, "a number here is not finite")
    return weights
