"""Arrays: their types, for annotations, and what is done with small ones at every step, without numpy's detours."""

from math import sqrt
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.floating[Any]]
"""Of float64, as all numbers here; what numpy's linear algebra returns is annotated no closer."""
IntArray: TypeAlias = NDArray[np.integer[Any]]
BoolArray: TypeAlias = NDArray[np.bool_]
ComplexArray: TypeAlias = NDArray[np.complexfloating[Any, Any]]


def greatest_size(values: Array) -> float:
    """The greatest of the sizes of all entries, 0 where there are none; not a number where one is not."""
    return float(np.maximum.reduce(np.abs(values), axis=None, initial=0.0))


def length_of(vector: Array) -> float:
    """The length of a vector (n,)."""
    return sqrt(vector.dot(vector))


def stack_row(matrix: Array, row: Array) -> Array:
    """A matrix (rows, columns) with one more row (columns,) below."""
    found = np.empty((len(matrix) + 1, len(row)))
    found[:-1], found[-1] = matrix, row
    return found


def append_number(vector: Array, number: float) -> Array:
    """A vector (n,) with one more entry."""
    found = np.empty(len(vector) + 1)
    found[:-1], found[-1] = vector, number
    return found
