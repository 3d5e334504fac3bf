"""Jets along many directions at once: values, and their first or second derivatives in all parameters.

A jet of the first order is Jet(value, slopes), whose slopes have a last axis for the parameters; one of the second
order is a jet of such jets, with two axes. Time derivatives are jets around these.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.jets import Jet, Scalar


def parameter_jet(value: Any, column: int, count: int, order: int) -> Jet:
    """The parameter of a column among `count`."""
    unit: Array = np.zeros(count)
    unit[column] = 1.0
    return Jet(value, unit) if order == 1 else Jet(Jet(value, unit), Jet(unit[:, None], 0.0))


def variable_jet(value: Array, slopes: Array, second_slopes: Array | None = None) -> Jet:
    """What depends on the parameters: values (n, entries), slopes (n, entries, parameters), and second ones."""
    if second_slopes is None:
        return Jet(value[..., None], slopes)
    inner = Jet(value[..., None, None], slopes[..., None, :])
    return Jet(inner, Jet(slopes[..., None], second_slopes))


def take_entries(value: Scalar, entries: Any) -> Scalar:
    """Some entries of arrays (n, entries, ...) in a jet, or of a jet of jets."""
    if isinstance(value, Jet):
        return Jet(*(take_entries(part, entries) for part in value.parts))
    return value[:, entries]


def highest_slopes(value: Scalar, order: int) -> Scalar:
    """The derivatives of an order, of a number that may have none: 0."""
    for _ in range(order):
        value = value.parts[1] if isinstance(value, Jet) else 0.0
    return value


def plain_value(value: Scalar) -> Scalar:
    """The number itself."""
    while isinstance(value, Jet):
        value = value.parts[0]
    return value


def stack_numbers(numbers: Sequence[Scalar], count: int, order: int) -> Scalar:
    """Numbers as one jet of arrays (1 or n, numbers, ...), of `count` parameters; of order 0 an array (1 or n, numbers,
    1)."""
    plain = [plain_value(number) for number in numbers]
    size, lanes = max((np.size(value) for value in plain), default=1), max(order, 1)
    values: Array = np.zeros((size, len(numbers), *((1,) * lanes)))
    for k, value in enumerate(plain):
        values[:, k] = value
    if order == 0:
        return values
    slopes: Array = np.zeros((size, len(numbers), *((1,) * (order - 1)), count))
    second: Array = np.zeros((size, len(numbers), *((count,) * order)))
    for k, number in enumerate(numbers):
        if isinstance(number, Jet):
            slopes[:, k] = number.parts[1] if order == 1 else number.parts[0].parts[1]
            second[:, k] = highest_slopes(number, order)
    if order == 1:
        return Jet(values, slopes)
    return Jet(Jet(values, slopes), Jet(slopes.swapaxes(-1, -2), second))
