"""The program's functions over many columns at once, each with numbers of its own."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import numpy as np

from planar.equations import Equations
from planar.program import Program, Rates

Array = np.ndarray

CHUNK = 256
"""Columns that are worked on at once, or a smaller power of two: what they take stays near the processor."""


class Over:
    """A compiled function mapped over many columns, called on arrays as they lie in memory.

    Arguments and results have the column first: (many, entries), and (many, columns, rows) of each result. The results
    are overwritten by the next call.
    """

    def __init__(self, function: Any, many: int):
        size = min(CHUNK, 1 << max(many - 1, 0).bit_length())
        self.mapped = _mapped(function, size)
        self.buffer, self.run = self.mapped.buffer()
        self.dense = all(function.nnz_out(k) == function.numel_out(k) for k in range(function.n_out()))
        room = -(-many // size) * size  # whole chunks: what is over is not looked at
        given = [np.zeros((room, function.numel_in(k))) for k in range(function.n_in())]
        found = [np.zeros((room, *function.size_out(k)[::-1])) for k in range(function.n_out())]
        self.given, self.found = [each[:many] for each in given], [each[:many] for each in found]
        self.chunks = [
            [
                (set_, k, memoryview(array[first : first + size].reshape(-1)))
                for set_, arrays in ((self.buffer.set_arg, given), (self.buffer.set_res, found))
                for k, array in enumerate(arrays)
                if array.size
            ]
            for first in range(0, room, size)
        ]
        self.function = function

    def __call__(self, *arguments: Array | None) -> list[Array]:
        """The results; an argument that is None stays what it was."""
        for own, given in zip(self.given, arguments, strict=True):
            if given is not None:
                own[...] = given
        if self.dense:
            for chunk in self.chunks:
                for set_, k, view in chunk:
                    set_(k, view)
                self.run()
            return self.found
        told = self.function(*(own.T for own in self.given))
        for own, each in zip(self.found, told if isinstance(told, tuple) else (told,), strict=True):
            own[...] = each.full().T.reshape(own.shape)
        return self.found


@lru_cache(maxsize=64)
def _mapped(function: Any, many: int) -> Any:
    return function.map(many)


class Columns:
    """A program over many designs, each with its own p (numbers, designs)."""

    def __init__(self, program: Program, p: Array):
        self.program, self.p = program, p
        self.equations: Equations = program.equations
        self._made: dict[str, Over] = {}

    def _over(self, name: str) -> Over:
        if name not in self._made:
            functions = {
                "advance": lambda: self.program.advance,
                "positions": lambda: self.program.positions,
                "slopes": lambda: self.program._slopes,
                "kinematics": lambda: self.program._kinematics,
            }
            made = self._made[name] = Over(functions[name](), self.p.shape[1])
            made.given[-1][...] = self.p.T
        return self._made[name]

    def advance(self, z: Array, u: Array) -> Array:
        """Newton's method from z (designs, unknowns) near by, at inputs u (designs, inputs)."""
        return self._over("advance")(z, u, None)[0][:, 0].copy() if z.size else z

    def positions(self, z: Array, u: Array) -> Array:
        """w (coordinates, designs)."""
        return np.ascontiguousarray(self._over("positions")(z, u, None)[0][:, 0].T)

    def slopes(self, z: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """dF/dz (designs, rows, unknowns) and dF/du (designs, rows, inputs), as `Program.slopes`."""
        unknowns = z.shape[1]
        if not self.equations.F.numel():
            return np.zeros((len(z), 0, unknowns)), np.zeros((len(z), 0, u.shape[1]))
        both = self._over("slopes")(z, u, None)[0].transpose(0, 2, 1).copy()
        return both[:, :, :unknowns], both[:, :, unknowns:]

    def kinematics(self, y: Array, y1: Array, y2: Array) -> Rates:
        """As `Program.kinematics`, with an entry for each design."""
        rows, unknowns = self.equations.F.numel(), self.equations.z.numel()
        parts, slopes = self._over("kinematics")(y, y1, y2, None)
        parts, slopes = parts.transpose(1, 0, 2).copy(), slopes.transpose(0, 2, 1).copy()
        return Rates(*parts[..., :rows], *parts[..., rows:], slopes[..., :unknowns], slopes[..., unknowns:])
