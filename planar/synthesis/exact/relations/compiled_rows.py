"""Rows in the unknowns as functions of numpy, many solutions and entries side by side, and of balls."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np

from planar.codegen.complex_kernel import ComplexKernel
from planar.codegen.formula_kernel import LANES
from planar.codegen.printed_formula import PrintedFunction, compile_numpy
from planar.equations.casadi_functions import inline_function
from planar.foundation.arrays import Array, ComplexArray
from planar.foundation.instruction_list import InstructionList
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
        self._nonzero = ca.Function("nonzero", [x, q], [ca.vertcat(*_nonzero_expressions(rows, values))])

    @cached_property
    def _listing(self) -> tuple[InstructionList[tuple[str, int]], list[list[int]], list[list[int]]]:
        """The instructions, the numbers of the inputs, and those of what is wanted."""
        listing: InstructionList[tuple[str, int]] = InstructionList()
        inputs = [
            [listing.add_input((name, k)) for k in range(self.function.numel_in(n))]
            for n, name in enumerate(("x", "q", "dq"))
        ]
        return listing, inputs, inline_function(listing, self.function, inputs)

    @cached_property
    def _kernel(self) -> ComplexKernel:
        listing, inputs, outputs = self._listing
        return ComplexKernel(
            listing, [number for part in outputs for number in part], [number for part in inputs for number in part]
        )

    @cached_property
    def _without_change(self) -> PrintedFunction:
        listing, inputs, wanted = self._listing
        return compile_numpy(listing, [each for part in wanted[:2] for each in part], [*inputs[0], *inputs[1]])

    def evaluate(
        self, x: ComplexArray, q: Sequence[ComplexArray], dq: Sequence[ComplexArray]
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """f (rows, *shape), its Jacobian (unknowns, rows, *shape) and its change (rows, *shape) at columns of a shape
        (entries, paths): of unknowns x (unknowns, paths), numbers q and their changes dq, blocks (numbers, 1 or
        entries, 1 or paths) one after the other."""
        shape = np.broadcast_shapes(x.shape[1:], *(block.shape[1:] for block in (*q, *dq)))
        count = int(np.prod(shape))
        operands: ComplexArray = np.zeros((len(self._kernel.operands), -(-count // LANES) * LANES), dtype=x.dtype)
        columns = operands[:, :count].reshape(-1, *shape)
        row = 0
        for block in (x[:, None], *q, *dq):
            columns[row : row + len(block)] = block
            row += len(block)
        values = self._kernel(operands)[:, :count].reshape(-1, *shape)
        m = self.equation_count
        return values[:m], values[m:-m].reshape(len(self.unknowns), m, *shape), values[-m:]

    def nonzero_values(self, x: ComplexArray, q: ComplexArray) -> Array:
        """The sizes (values, entries) of what vanishes at no linkage, of unknowns x (unknowns,) and numbers q (numbers,
        entries): directions of slides, vectors that turn, and what turns them."""
        listing: InstructionList[tuple[str, int]] = InstructionList()
        inputs = [
            [listing.add_input((name, k)) for k in range(self._nonzero.numel_in(n))] for n, name in enumerate("xq")
        ]
        (outputs,) = inline_function(listing, self._nonzero, inputs)
        values = ComplexKernel(listing, outputs, [*inputs[0], *inputs[1]]).in_numpy(
            np.concatenate([np.broadcast_to(x[:, None], (len(x), q.shape[1])), q])
        )
        sizes: Array = np.abs(values)
        return sizes

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


def _nonzero_expressions(rows: EntryRows, values: dict[int, ca.SX]) -> list[ca.SX]:
    """What an isotropic direction or a link of no length makes vanish, as far as it is known without elimination."""
    polynomials = [part for step in rows.steps for part in (step.numerator, step.denominator)]
    found = [
        _real(each, values) for each in polynomials if each.terms and each.symbols and each.symbols <= values.keys()
    ]
    if rows.turn is not None:
        (a, b, c), (p, q, r), *_ = (tuple(part.expression(values) for part in row) for row in rows.linear)
        found += [a * q - b * p, b * r - c * q, c * p - a * r]
    return found


def _real(row: Any, values: dict[int, ca.SX]) -> ca.SX:
    """A row with real coefficients: itself, or i times it."""
    first = next(iter(row.terms.values()))
    found: ca.SX = (row if abs(first.imag) < abs(first.real) else row * 1j).expression(values)
    return found
