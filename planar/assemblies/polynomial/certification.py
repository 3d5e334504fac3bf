"""Solutions of a block's polynomials certified: by Krawczyk's operator in ball arithmetic, outward rounded.

The dimensions are the floats that they are; their cosines, sines and sums are enclosed. Each solution gets a box in
which there is one, and one only (R. Krawczyk, Computing 4, 1969; S. M. Rump, Verification methods, Acta Numerica 19,
2010, sec. 13), boxes apart from each other. The block is its own mirror image under X <-> conjugate of Y: a solution
whose mirror image lies in its own box is its own mirror image, so an assembly; one whose box and its image are apart is
none.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.assemblies.polynomial.isotropic_form import IsotropicForm
from planar.assemblies.polynomial.krawczyk import (
    ProvedBox,
    apart_boxes,
    ball,
    ball_precision,
    is_own_image,
    prove_box,
)
from planar.equations.casadi_functions import evaluate_function
from planar.foundation.arrays import Array, BoolArray, ComplexArray


class Certificate(NamedTuple):
    """Of every solution: whether a box of its own is proved to hold it, and that it is real at a finite place.

    `decided`: whether it is proved that it is so, or that it is not.
    """

    proved: BoolArray
    real: BoolArray
    decided: BoolArray


def certify_solutions(form: IsotropicForm, given: Sequence[Array], V: ComplexArray) -> Certificate:
    """What is proved of solutions V (solutions, 2 many) of a block at (z, u, p)."""
    with ball_precision():
        try:
            return _certify_balls(_BallPolynomials(form, given), V)
        except ZeroDivisionError:  # rows of X that may depend on each other
            none = np.zeros(len(V), dtype=bool)
            return Certificate(none, none, none)


def _certify_balls(balls: _BallPolynomials, V: ComplexArray) -> Certificate:
    count, m = len(V), V.shape[1] // 2
    proved, real, decided = (np.zeros(count, dtype=bool) for _ in range(3))
    x, y = balls.reduce_solutions(V[:, :m], V[:, m:])
    w = np.concatenate([x, y], axis=1)
    half = np.full(count, np.inf)
    boxes: list[ProvedBox | None] = [None] * count
    for k in range(count):
        boxes[k] = box = prove_box(balls.residuals_and_jacobian, [ball(complex(each)) for each in w[k]])
        if box is not None:
            proved[k], half[k] = True, box.half
    proved = apart_boxes(w, half, proved)
    n = w.shape[1] // 2
    for k, box in enumerate(boxes):
        if box is None or not proved[k]:
            continue
        image = np.concatenate([w[k, n:], w[k, :n]]).conj()
        gap = float(np.abs(image - w[k]).max())
        if gap > 4.0 * half[k]:
            decided[k] = True
        elif is_own_image(box) and balls.is_finite(box.inside):
            real[k] = decided[k] = True
    return Certificate(proved, real, decided)


def is_available() -> bool:
    """Whether there is a library for ball arithmetic (the extra `modes`)."""
    try:
        import flint  # noqa: F401
    except ImportError:
        return False
    return True


def is_regular(slope: ca.Function, given: Sequence[Array]) -> bool:
    """Whether it is proved that linear equations, of a square slope as a function of (z, u, p), have one solution."""
    from flint import arb_mat

    with ball_precision():
        return not arb_mat(_evaluate_in_balls(slope, given)[0]).det().contains(0)


class _BallPolynomials:
    """The polynomials of a block as balls, and what is left of them once the rows linear in X, and in Y, are solved.

    Then X = P x and Y = conj(P) y, where x are some entries of X; they are measured so that c x = 1, conj(c) y = 1.
    """

    def __init__(self, form: IsotropicForm, given: Sequence[Array]):
        from flint import acb, acb_mat

        self.acb, self.mat, self.form = acb, acb_mat, form
        alpha = _factors(form.row_factors, given)
        loops = self._combine_rows(form.combined, alpha)
        for row in loops:
            for k in form.real_entries:
                row[k] = row[k] * 2
        self.single = self._combine_rows(form.single.astype(complex), alpha)
        A = np.array([[complex(each.mid()) for each in row] for row in loops]).reshape(-1, form.entry_count)
        self.pivots = _pivots(A)
        self.free = [k for k in range(form.entry_count) if k not in self.pivots]
        size = len(self.free)
        self.P = [[acb(0)] * size for _ in range(form.entry_count)]
        for n, k in enumerate(self.free):
            self.P[k][n] = acb(1)
        if loops:
            left = acb_mat([[row[k] for k in self.pivots] for row in loops])
            right = acb_mat([[-row[k] for k in self.free] for row in loops])
            for k, row in zip(self.pivots, left.solve(right).tolist(), strict=True):
                self.P[k] = row
        rng = np.random.default_rng(11)
        self.c = rng.normal(size=size) + 1j * rng.normal(size=size)
        self.c_balls = [acb(each.real, each.imag) for each in self.c]
        self.products = [tuple(int(each) for each in row) for row in form.products]

    def _combine_rows(self, combined: Array, alpha: list[list[Any]]) -> list[list[Any]]:
        found = []
        for row in combined:
            whole = [self.acb(0)] * self.form.entry_count
            for factor, terms in zip(row, alpha, strict=True):
                if factor:
                    ball = self.acb(factor.real, factor.imag)
                    whole = [one + ball * term for one, term in zip(whole, terms, strict=True)]
            found.append(whole)
        return found

    def reduce_solutions(self, X: ComplexArray, Y: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
        """x and y of solutions, measured."""
        x, y = X[:, self.free], Y[:, self.free]
        return x / (x @ self.c)[:, None], y / (y @ self.c.conj())[:, None]

    def _expand_solution(self, w: Sequence[Any]) -> tuple[list[Any], list[Any]]:
        """X and Y as balls."""
        n = len(self.free)
        X = self.mat(self.P) * self.mat([[each] for each in w[:n]])
        Y = self.mat(self.P).conjugate() * self.mat([[each] for each in w[n:]])
        return X.entries(), Y.entries()

    def residuals_and_jacobian(self, w: Sequence[Any]) -> tuple[list[Any], list[list[Any]]]:
        """The equations at w, and their Jacobian."""
        n = len(self.free)
        X, Y = self._expand_solution(w)
        P, conj = self.P, [[each.conjugate() for each in row] for row in self.P]
        left, slope = [], []
        for i, j, k, l in self.products:  # noqa: E741
            left.append(X[i] * Y[j] - X[k] * Y[l])
            row = [P[i][q] * Y[j] - P[k][q] * Y[l] for q in range(n)]
            slope.append(row + [conj[j][q] * X[i] - conj[l][q] * X[k] for q in range(n)])
        for terms in self.single:
            one = sum((a * x for a, x in zip(terms, X, strict=True)), self.acb(0))
            other = sum((a.conjugate() * y for a, y in zip(terms, Y, strict=True)), self.acb(0))
            left.append(one * Y[0] + X[0] * other)
            a = [sum((t * P[r][q] for r, t in enumerate(terms)), self.acb(0)) for q in range(n)]
            b = [each.conjugate() for each in a]
            row = [a[q] * Y[0] + P[0][q] * other for q in range(n)]
            slope.append(row + [conj[0][q] * one + b[q] * X[0] for q in range(n)])
        none = [self.acb(0)] * n
        c = self.c_balls
        left.append(sum((a * x for a, x in zip(c, w[:n], strict=True)), self.acb(-1)))
        left.append(sum((a.conjugate() * y for a, y in zip(c, w[n:], strict=True)), self.acb(-1)))
        slope += [c + none, none + [each.conjugate() for each in c]]
        return left, slope

    def is_finite(self, inside: Sequence[Any]) -> bool:
        """Whether the solution is at a finite place."""
        X, Y = self._expand_solution(inside)
        return not (X[0].contains(0) or Y[0].contains(0))


def _pivots(rows: ComplexArray) -> list[int]:
    """Columns, one for each row, that are as independent as can be had: the longest of what is left each time."""
    left = rows.copy()
    found: list[int] = []
    for _ in range(len(rows)):
        sizes = np.linalg.norm(left, axis=0)
        sizes[found] = -1.0
        best = int(np.argmax(sizes))
        found.append(best)
        way = left[:, best] / max(sizes[best], 1e-300)
        left = left - np.outer(way, way.conj() @ left)
    return sorted(found)


def _factors(function: ca.Function, given: Sequence[Array]) -> list[list[Any]]:
    """What a function of real and imaginary parts gives, computed in balls: (rows, columns)."""
    from flint import acb

    parts = _evaluate_in_balls(function, given)
    return [[acb(*both) for both in zip(*rows, strict=True)] for rows in zip(*parts, strict=True)]


def _evaluate_in_balls(function: ca.Function, given: Sequence[Array]) -> list[list[list[Any]]]:
    """The results of a function of dense matrices, computed in balls from floats: each (rows, columns)."""
    from flint import arb

    inputs = [[arb(float(each)) for each in values] for values in given]
    found = evaluate_function(function, inputs, arb)
    sizes = [function.size_out(k) for k in range(function.n_out())]
    return [
        [[values[r + rows * c] for c in range(columns)] for r in range(rows)]
        for values, (rows, columns) in zip(found, sizes, strict=True)
    ]
