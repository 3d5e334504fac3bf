"""All solutions of a block's polynomials at once, as eigenvalues.

In x alone, Y eliminated, they are where a matrix M(x) of 2d rows and d + 1 columns, linear in x, has a column too many:
its largest minors, of degree d + 1, vanish. Where Bezout's number C(2d, d) of solutions is reached, the minors leave
just so many values of the monomials of degree d + 1 open, and multiplying those of degree d by a linear form is an
eigenvalue problem of that size (D. Cox, J. Little, D. O'Shea, Using Algebraic Geometry, 2005, ch. 3; the matrix is
that of the Dixon determinant in Wampler's paper, see `isotropic_form`).
"""

from __future__ import annotations

from functools import lru_cache
from itertools import combinations, combinations_with_replacement
from math import comb
from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.isotropic_form import BlockPolynomials, IsotropicForm
from planar.foundation.arrays import ComplexArray, IntArray

MAX_DIMENSION = 3
"""Dimensions up to which eigenvalues are sought; beyond, paths are followed: their number grows less than the size's
cube."""


class _MonomialTables(NamedTuple):
    """What depends on the dimension alone: places, the inverse of the monomials there, which minors, products."""

    points: ComplexArray
    inverse: ComplexArray
    minors: IntArray
    product_index: IntArray
    "(d + 1, monomials of degree d): which monomial of degree d + 1 the product with an entry of x is"


def eigenvalue_solutions(form: IsotropicForm, polynomials: BlockPolynomials) -> ComplexArray | None:
    """As many solutions X, Y (C(2d, d), 2 many) as Bezout's number; None where these are not single solutions."""
    d = form.dimension
    room = _monomial_tables(d)
    P, Q = _kernel(polynomials.A), _kernel(polynomials.B)
    i, j, k, l = form.products.T  # noqa: E741
    # M(x) = sum of x[n] times parts[n] (2d, d + 1)
    parts = P[i].T[:, :, None] * Q[j][None] - P[k].T[:, :, None] * Q[l][None]
    if len(polynomials.a):
        single = (polynomials.a @ P).T[:, :, None] * Q[0] + P[0][:, None, None] * (polynomials.b @ Q)[None]
        parts = np.concatenate([parts, single], axis=1)
    parts = parts / np.maximum(np.linalg.norm(parts, axis=(0, 2), keepdims=True), 1e-300)
    there = np.tensordot(room.points, parts, 1)
    minors = room.inverse @ np.linalg.det(there[:, room.minors])
    kept = np.linalg.svd(minors.T)[2][minors.shape[1] :].conj().T
    rng = np.random.default_rng(d)
    one, other = rng.normal(size=(2, d + 1)) + 1j * rng.normal(size=(2, d + 1))
    of = kept[room.product_index]  # (d + 1, degree d, solutions)
    try:
        vectors = np.linalg.eig(np.linalg.solve(np.tensordot(one, of, 1), np.tensordot(other, of, 1)))[1]
    except np.linalg.LinAlgError:
        return None
    found = (of @ vectors).transpose(2, 1, 0)  # (solutions, degree d, d + 1): each row is x times a monomial
    x = found[np.arange(len(found)), np.argmax(np.linalg.norm(found, axis=2), axis=1)]
    matrices = np.tensordot(x, parts, 1)
    if not np.all(np.isfinite(matrices)):
        return None
    y = np.linalg.svd(matrices)[2][:, -1].conj()
    return np.concatenate([x @ P.T, y @ Q.T], axis=1)


@lru_cache(maxsize=8)
def _monomial_tables(d: int) -> _MonomialTables:
    monomials = list(combinations_with_replacement(range(d + 1), d + 1))
    lower = list(combinations_with_replacement(range(d + 1), d))
    place = {monomial: k for k, monomial in enumerate(monomials)}
    times = np.array([[place[tuple(sorted((*each, n)))] for each in lower] for n in range(d + 1)])
    rng = np.random.default_rng(5)
    places = np.exp(2j * np.pi * rng.uniform(size=(comb(2 * d + 1, d), d + 1)))
    values = np.prod(places[:, np.array(monomials)], axis=2)
    return _MonomialTables(places, np.linalg.inv(values), np.array(list(combinations(range(2 * d), d + 1))), times)


def _kernel(rows: ComplexArray) -> ComplexArray:
    """An orthonormal basis of what rows send to nothing (many, d + 1)."""
    return np.linalg.svd(rows)[2][len(rows) :].conj().T if len(rows) else np.eye(rows.shape[1], dtype=complex)
