"""Rows in the unknowns as functions of numpy, many solutions and entries side by side, and of balls."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from planar.codegen.instructions import InstructionList
from planar.codegen.numpy_code import NumpyFunction, compile_numpy
from planar.foundation.arrays import ComplexArray
from planar.synthesis.exact.relations.elimination import EntryRows


class CompiledRows:
    """Rows f(x, q): `unknowns` are the numbers of the symbols x, `given` those of q, conjugates each on its own."""

    def __init__(self, rows: EntryRows, unknowns: Sequence[int], given: Sequence[int]):
        self.unknowns, self.given, self.equation_count = tuple(unknowns), tuple(given), rows.equation_count
        x, q, dq = (
            ca.SX.sym(name, many) for name, many in (("x", len(unknowns)), ("q", len(given)), ("dq", len(given)))
        )
        values = {number: x[k] for k, number in enumerate(unknowns)}
        values |= {number: q[k] for k, number in enumerate(given)}
        f = ca.vertcat(*_expressions(rows, values))
        outputs = [f, ca.jacobian(f, x), ca.jtimes(f, q, dq)]
        outputs = [ca.densify(each) for each in ca.cse(outputs)]
        self.function = ca.Function("rows", [x, q, dq], outputs)
        "f, its Jacobian in x, and its derivative where q changes by dq"

    @cached_property
    def _listing(self) -> tuple[InstructionList[tuple[str, int]], list[list[int]], list[list[int]]]:
        """The instructions, the numbers of the inputs, and those of what is wanted."""
        listing: InstructionList[tuple[str, int]] = InstructionList()
        inputs = [
            [listing.add_input((name, k)) for k in range(self.function.numel_in(n))]
            for n, name in enumerate(("x", "q", "dq"))
        ]
        return listing, inputs, listing.inline_function(self.function, inputs)

    @cached_property
    def _with_change(self) -> NumpyFunction:
        listing, inputs, wanted = self._listing
        return compile_numpy(listing, [each for part in wanted for each in part], [k for part in inputs for k in part])

    @cached_property
    def _without_change(self) -> NumpyFunction:
        listing, inputs, wanted = self._listing
        return compile_numpy(listing, [each for part in wanted[:2] for each in part], [*inputs[0], *inputs[1]])

    def evaluate(
        self, x: Sequence[Any], q: Sequence[Any], dq: Sequence[Any], shape: tuple[int, ...]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """f (rows, *shape), its Jacobian (rows, unknowns, *shape) and its change (rows, *shape), of arrays that
        broadcast to a shape."""
        shapes = [self.function.size_out(k) for k in range(3)]
        values = self._with_change(*x, *q, *dq)
        found, at = [], 0
        for rows, columns in shapes:
            many = rows * columns
            whole = np.empty((columns, rows, *shape), dtype=complex)
            for k in range(many):
                whole[k // rows, k % rows] = values[at + k]
            at += many
            found.append(whole)
        f, slope, along = found
        return f[0], np.swapaxes(slope, 0, 1), along[0]

    def evaluate_as(self, x: Sequence[Any], q: Sequence[Any]) -> tuple[list[Any], list[list[Any]]]:
        """f and its Jacobian, row by row, in numbers of another kind that floats go with."""
        values = [x[0] * 0 + each for each in self._without_change(*x, *q)]
        f, slope = values[: self.equation_count], values[self.equation_count :]
        return f, [slope[row :: self.equation_count] for row in range(self.equation_count)]


def _expressions(rows: EntryRows, values: dict[int, ca.SX]) -> list[ca.SX]:
    found = [_real(row, values) for row in rows.rows]
    if rows.turn is None:
        return found
    linear = [tuple(part.expression(values) for part in row) for row in rows.linear]
    (a, b, c), (p, q, r), *others = linear
    below, own, other = a * q - b * p, b * r - c * q, c * p - a * r
    found.append(own * other - below * below)
    found += [u * own + v * other + w * below for u, v, w in others]
    return found


def _real(row: Any, values: dict[int, ca.SX]) -> ca.SX:
    """A row with real coefficients: itself, or i times it."""
    first = next(iter(row.terms.values()))
    found: ca.SX = (row if abs(first.imag) < abs(first.real) else row * 1j).expression(values)
    return found
