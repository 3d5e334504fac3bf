"""Compiled casadi functions, called on arrays as they lie in memory, at one position or many."""

from __future__ import annotations

from collections import Counter
from threading import Lock
from typing import Any

import casadi as ca
import numpy as np

from planar.foundation.arrays import Array

CHUNK_SIZES = (256, 32, 8)
"""Positions that are worked on by one call."""
MAX_MAPPED_ENTRIES = 20_000
"""Entries of a function's results: one of more is called for one position after the other, since to make a call of
many positions takes long, and room."""


def formula_text(rows: ca.SX, *symbols: ca.SX) -> str:
    """Rows in columns of symbols, as casadi writes a function: the same text whatever the symbols are called."""
    renamed = [ca.SX.sym(f"q{k}", symbol.numel()) for k, symbol in enumerate(symbols)]
    function = ca.Function("rows", list(symbols), [ca.densify(rows)])
    text: str = ca.Function("rows", renamed, [function(*renamed)]).serialize()
    return text


class _BoundCall:
    """A function of so many positions, run from its own arrays to its own arrays."""

    def __init__(self, function: Any, count: int):
        self.inputs = [np.zeros((count, function.numel_in(k))) for k in range(function.n_in())]
        self.outputs = [np.zeros((count, *function.size_out(k)[::-1])) for k in range(function.n_out())]
        # the buffer has to live as long as what runs it
        self._buffer, self.run = (function.map(count) if count > 1 else function).buffer()
        for set_array, arrays in ((self._buffer.set_arg, self.inputs), (self._buffer.set_res, self.outputs)):
            for k, array in enumerate(arrays):
                if array.size:
                    set_array(k, array.reshape(-1).data)


class BufferedFunction:
    """A function of dense columns. Results are (columns, rows), or (positions, columns, rows).

    A call through casadi's own interface costs some 30 us, one through its buffers less than one.
    """

    def __init__(self, function: Any):
        self.function = function
        self._lock = Lock()
        self._single = _BoundCall(function, 1)
        self._calls = {1: self._single}
        "by the number of positions"
        self._asked: Counter[int] = Counter()

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results at one position, each argument as long as the function's."""
        with self._lock:
            for array, argument in zip(self._single.inputs, arguments, strict=True):
                array[0] = argument
            self._single.run()
            return [array[0].copy() for array in self._single.outputs]

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results at many positions; arguments (positions, entries), or (entries,) for all of them alike."""
        results: list[Array] = [np.empty((count, *array.shape[1:])) for array in self._single.outputs]
        first = 0
        with self._lock:
            for size in self._call_sizes(count):
                if size not in self._calls:
                    self._calls[size] = _BoundCall(self.function, size)
                call, last = self._calls[size], min(first + size, count)
                for array, argument in zip(call.inputs, arguments, strict=True):
                    array[: last - first] = argument if argument.ndim == 1 else argument[first:last]
                call.run()
                for result, array in zip(results, call.outputs, strict=True):
                    result[first:last] = array[: last - first]
                first = last
        return results

    def _call_sizes(self, count: int) -> list[int]:
        """The numbers of positions of calls, one after the other; of the last one some may be left over."""
        if sum(array.size for array in self._single.outputs) > MAX_MAPPED_ENTRIES:
            return [1] * count
        self._asked[count] += 1
        if 0 < count <= CHUNK_SIZES[1] or (count <= CHUNK_SIZES[0] and self._asked[count] > 2):
            return [count]
        sizes: list[int] = []
        for size in CHUNK_SIZES:
            chunks, count = divmod(count, size)
            sizes += [size] * chunks
        return [*sizes, CHUNK_SIZES[-1]] if count else sizes
