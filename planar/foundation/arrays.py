"""Arrays: their types, for annotations, and what is done with small ones at every step, without numpy's detours."""

from contextlib import AbstractContextManager, nullcontext
from functools import cache
from math import sqrt
from typing import Any, TypeAlias

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array: TypeAlias = NDArray[np.floating[Any]]
"""Of float64, as all numbers here; what numpy's linear algebra returns is annotated no closer."""
IntArray: TypeAlias = NDArray[np.integer[Any]]
BoolArray: TypeAlias = NDArray[np.bool_]
ComplexArray: TypeAlias = NDArray[np.complexfloating[Any, Any]]
MIN_LINKS_FOR_ONE_THREAD = 24
"""Links of a mechanism from which on its matrices are so large that BLAS would take several threads for each."""


def part_offsets(counts: ArrayLike) -> IntArray:
    """Return the first index of every part of so many entries, and the number of all entries (parts + 1,)."""
    offsets = np.zeros(len(np.asarray(counts)) + 1, dtype=np.int64)
    np.cumsum(counts, out=offsets[1:])
    return offsets


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


@cache
def _blas_controller() -> Any:
    from threadpoolctl import ThreadpoolController  # it looks through all libraries that are loaded

    return ThreadpoolController().select(user_api="blas")


def one_blas_thread(link_count: int) -> AbstractContextManager[Any]:
    """A context in which BLAS works on one thread, for mechanisms of many links; one that does nothing for others."""
    if link_count < MIN_LINKS_FOR_ONE_THREAD:
        return nullcontext()
    limited: AbstractContextManager[Any] = _blas_controller().limit(limits=1)
    return limited
