"""Compiled casadi functions, called on arrays as they lie in memory, at one position or many."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
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
    renamed = [ca.SX.sym(f"q{k}", each.numel()) for k, each in enumerate(symbols)]
    function = ca.Function("rows", list(symbols), [ca.densify(rows)])
    text: str = ca.Function("rows", renamed, [function(*renamed)]).serialize()
    return text


def bound_call(function: Any, inputs: Sequence[Array], outputs: Sequence[Array]) -> tuple[Any, Any]:
    """What runs a function from arrays to arrays, and the buffer, which has to live as long."""
    buffer, run = function.buffer()
    for set_array, arrays in ((buffer.set_arg, inputs), (buffer.set_res, outputs)):
        for k, array in enumerate(arrays):
            if array.size:
                set_array(k, array.reshape(-1).data)
    return run, buffer


class BufferedFunction:
    """A function of dense columns. Results are (columns, rows), or (positions, columns, rows).

    A call through casadi's own interface costs some 30 us, one through its buffers less than one.
    """

    def __init__(self, function: Any):
        self.function = function
        self.lock = Lock()
        self.input_buffers = [np.zeros(function.numel_in(k)) for k in range(function.n_in())]
        self.output_buffers = [np.zeros(function.size_out(k)[::-1]) for k in range(function.n_out())]
        self.call_buffers, self._buffer = bound_call(function, self.input_buffers, self.output_buffers)
        self._is_large = sum(array.size for array in self.output_buffers) > MAX_MAPPED_ENTRIES
        self._mapped: dict[int, tuple[Any, Any]] = {}
        self._asked: Counter[int] = Counter()
        self._few: dict[int, tuple[list[Array], list[Array], Any, Any]] = {}

    def __call__(self, *arguments: Array) -> list[Array]:
        """The results at one position, each argument as long as the function's."""
        with self.lock:
            for own, each in zip(self.input_buffers, arguments, strict=True):
                own[:] = each
            self.call_buffers()
            return [each.copy() for each in self.output_buffers]

    def evaluate_batch(self, count: int, *arguments: Array) -> list[Array]:
        """The results at many positions; arguments (positions, entries), or (entries,) for all of them alike."""
        if self._is_large:
            results = [np.empty((count, *buffer.shape)) for buffer in self.output_buffers]
            for k in range(count):
                parts = self(*(argument if argument.ndim == 1 else argument[k] for argument in arguments))
                for result, part in zip(results, parts, strict=True):
                    result[k] = part
            return results
        if count <= CHUNK_SIZES[0]:
            self._asked[count] += 1
            if count <= CHUNK_SIZES[1] or self._asked[count] > 2:
                return self._evaluate_few(count, arguments)
        room = -(-count // CHUNK_SIZES[-1]) * CHUNK_SIZES[-1]  # whole calls: what is over is not looked at
        given, found = [], [np.empty((room, *own.shape)) for own in self.output_buffers]
        for own, each in zip(self.input_buffers, arguments, strict=True):
            alike = each.ndim == 1
            array = np.empty((min(room, CHUNK_SIZES[0]) if alike else room, len(own)))
            array[: len(array) if alike else count] = each
            array[len(array) if alike else count :] = 0.0
            given.append((array, alike))
        views = [(k, array.reshape(-1).data, array[:1].size, alike) for k, (array, alike) in enumerate(given)]
        told = [(k, each.reshape(-1).data, each[:1].size, False) for k, each in enumerate(found)]
        done = 0
        with self.lock:
            for size in CHUNK_SIZES:
                first = True
                while room - done >= size:
                    buffer, run = self._mapped_call(size)
                    for set_, of_all in ((buffer.set_arg, views), (buffer.set_res, told)):
                        for k, view, entries, alike in of_all:
                            if entries and (first or not alike):
                                start = 0 if alike else done
                                set_(k, view[start * entries : (start + size) * entries])
                    run()
                    done, first = done + size, False
        return [each[:count] for each in found]

    def _evaluate_few(self, count: int, arguments: tuple[Array, ...]) -> list[Array]:
        """The same at few positions, by a call that is as long and whose buffers stay."""
        with self.lock:
            if count not in self._few:
                inputs: list[Array] = [np.zeros((count, len(own))) for own in self.input_buffers]
                outputs: list[Array] = [np.zeros((count, *own.shape)) for own in self.output_buffers]
                function = self.function.map(count) if count > 1 else self.function
                self._few[count] = inputs, outputs, *bound_call(function, inputs, outputs)
            inputs, outputs, run, _ = self._few[count]
            for array, argument in zip(inputs, arguments, strict=True):
                array[:] = argument
            if count:
                run()
            return [array.copy() for array in outputs]

    def _mapped_call(self, size: int) -> tuple[Any, Any]:
        if size not in self._mapped:
            self._mapped[size] = self.function.map(size).buffer()
        return self._mapped[size]
