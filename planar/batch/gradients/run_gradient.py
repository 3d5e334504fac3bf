"""What a gradient of a run gives, and the weights that it is asked with."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, join_names, suggest_name
from planar.foundation.short_repr import short_repr

ORDERS = ("position", "velocity", "acceleration")
"""What a run tells of its points, in the order of its rows."""
DOUBLE = np.dtype(float)
RunWeights = Mapping[str, Mapping[str, Any]]


class RunGradient(NamedTuple):
    """The gradient of a weighed sum over a run: the sum itself, `value`; its `derivatives` in each number of the file
    by name (SI); `status` (steps + 1,): 0 is a position that brings its part, any other number k is
    `Sweep.outcomes[k]`: it brings nothing.
    """

    value: float
    derivatives: Mapping[str, float]
    status: IntArray

    def __repr__(self) -> str:
        return short_repr(self)


class WeightRows(NamedTuple):
    """Weights by the rows of a run: `rows` (weighed rows,), x and y of each weighed point one after the other, and
    `arrays` of two rows each (steps + 1, 2)."""

    rows: tuple[int, ...]
    arrays: tuple[Array, ...]


def read_weights(weights: RunWeights, index: Mapping[str, int], rates: bool, count: int) -> WeightRows:
    """The weights (count, 2) of points, `index` the row of each point's x among the positions. Raises BadInput."""
    if not (type(weights) is dict or isinstance(weights, Mapping)) or not weights:
        raise BadInput("weights", "name what is weighed, with an array each, as {'position': {'C': weights}}")
    orders = ORDERS if rates else ORDERS[:1]
    wide, shape = 2 * len(index), (count, 2)
    rows: list[int] = []
    arrays: list[Array] = []
    for order, points in weights.items():
        if order not in orders or not (type(points) is dict or isinstance(points, Mapping)):
            raise _refuse_order(order, orders, rates)
        first = wide * ORDERS.index(order)
        for point, given in points.items():
            if point not in index:
                hint = suggest_name(str(point), index, "its points")
                raise BadInput(f"weights[{order!r}]", f"the run was not prepared with the point {point!r:.60}{hint}")
            row = first + index[point]
            rows += (row, row + 1)
            is_read = type(given) is np.ndarray and given.dtype is DOUBLE and given.shape == shape
            arrays.append(given if is_read else _read_array(given, f"weights[{order!r}][{point!r}]", shape))
    if not rows:
        raise BadInput("weights", "name the points that are weighed, with an array each")
    return WeightRows(tuple(rows), tuple(arrays))


def _refuse_order(order: str, orders: Sequence[str], rates: bool) -> BadInput:
    if order in orders:
        return BadInput(f"weights[{order!r}]", "points by name are wanted here, with an array each")
    without = "" if rates or order not in ORDERS else "; prepare it with rates"
    return BadInput("weights", f"the run tells {join_names(orders)}, and no {str(order)!r:.60}{without}")


def _read_array(given: Any, place: str, shape: tuple[int, int]) -> Array:
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        array = np.empty(0)
    if array.shape != shape:
        raise BadInput(place, f"an array of numbers of shape {shape} is wanted here, not {np.shape(given)}")
    return array


def check_finite(weights: WeightRows) -> None:
    """Refuse weights that are no numbers. Raises BadInput."""
    if not all(np.isfinite(each).all() for each in weights.arrays):
        raise BadInput("weights", "a number here is not finite")


def read_names(of: Sequence[str] | str | None, known: Iterable[str]) -> tuple[str, ...]:
    """The numbers by which derivatives are wanted; all where none are named. Raises BadInput."""
    known = tuple(known)
    if of is None:
        return known
    names = tuple(dict.fromkeys([of] if isinstance(of, str) else of))
    for name in names:
        if name not in known:
            hint = suggest_name(str(name), known, "numbers")
            raise BadInput("of", f"there is no derivative in a number {str(name)!r:.60}{hint}")
    return names
