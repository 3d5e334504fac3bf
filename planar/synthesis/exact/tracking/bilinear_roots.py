"""All solutions of four rows that are bilinear in two places, as those of a dyad of two pins are, by eigenvalues.

With p = (1, z, z*) of one place and q of the other each row is p R q = 0. Along a random line of p's plane, moved by t,
p = a + s b + t c, the four rows times 1, s and s^2 are linear in t and in q, s q, s^2 q and s^3 q, twelve by twelve
(D. Manocha, Solving systems of polynomial equations, IEEE Computer Graphics and Applications 14 (1994) 46). Six points
are found in the whole plane, two of them at infinity, the circular points, where turning dyads are sought.
"""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.member_homotopy import homogeneous_solutions
from planar.synthesis.exact.tracking.same_solutions import first_of_same

PLACES = 2
EXACT = 1e-9
"""Of the size of rows: what they may leave at a solution."""
FINITE = 1e-8
"""Of homogeneous coordinates of length one: what is less is at infinity."""
CORRECTIONS = 3


def bilinear_roots(family: Family, member: Member, count: int) -> ComplexArray | None:
    """The solutions (count, 4) of a member of a family of two places and four rows; None where its rows are of another
    kind, or where not so many stand clear of each other and of infinity."""
    if family.size != PLACES or family.row_count != 2 * PLACES:
        return None
    rows = _coefficients(family, member)
    if rows is None:
        return None
    size = np.linalg.norm(rows, axis=(1, 2), keepdims=True)
    if not (size > 0.0).all():
        return None
    found = _finite_roots(rows / size)
    if len(found) != count:
        return None
    x = np.stack([found[:, 0, 1], found[:, 1, 1], found[:, 0, 2], found[:, 1, 2]], axis=1)
    for _ in range(CORRECTIONS):
        f, slope = _rows_at(family, member, x)
        try:
            x = x - np.linalg.solve(slope, f[..., None])[..., 0]
        except np.linalg.LinAlgError:
            return None
    is_apart = np.array_equal(first_of_same(homogeneous_solutions(x)), np.arange(len(x)))
    return x if np.isfinite(x).all() and is_apart else None


def _rows_at(family: Family, member: Member, x: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Rows (n, rows) and their Jacobians at places (n, 4)."""
    still = [np.zeros_like(each) for each in member.parts]
    f, slope, _ = family.rows_at(np.ascontiguousarray(x.T), member, still, np.zeros(len(x)))
    return f.T, slope.transpose(2, 0, 1)


def _coefficients(family: Family, member: Member) -> ComplexArray | None:
    """R (rows, 3, 3); None where rows are not bilinear."""
    corners = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
    one, other = np.repeat(corners, 3, axis=0), np.tile(corners, (3, 1))
    far = np.array([[0.7, -1.3, 0.4, 1.9], [-0.8, 0.6, 1.7, -0.3]])
    x = np.concatenate([np.stack([one[:, 0], other[:, 0], one[:, 1], other[:, 1]], axis=1), far]).astype(complex)
    f = _rows_at(family, member, x)[0]
    back = np.array([[1.0, 0.0, 0.0], [-1.0, 1.0, 0.0], [-1.0, 0.0, 1.0]])
    found: ComplexArray = np.einsum("ai,ijr,bj->rab", back, f[:9].reshape(3, 3, -1), back)
    p, q = (np.insert(far[:, [k, k + PLACES]], 0, 1.0, axis=1) for k in range(PLACES))
    expected = np.einsum("na,rab,nb->nr", p, found, q)
    return found if np.abs(expected - f[9:]).max() <= EXACT * max(1.0, float(np.abs(f).max())) else None


def _finite_roots(rows: ComplexArray) -> ComplexArray:
    """The p and q (n, 2, 3) at finite places where all rows vanish."""
    rng = np.random.default_rng(4)
    turn = np.linalg.qr(rng.normal(size=(3, 3)) + 1j * rng.normal(size=(3, 3)))[0]
    a, b, c = np.einsum("ik,rij->krj", turn, rows)
    still, moved = (_shifted(each) for each in ((a, b), (c, np.zeros_like(c))))
    middle = complex(*rng.normal(size=2))
    try:
        values, vectors = np.linalg.eig(np.linalg.solve(still + middle * moved, moved))
    except np.linalg.LinAlgError:
        return np.zeros((0, 2, 3), dtype=complex)
    found = []
    for value, vector in zip(values.tolist(), vectors.T, strict=True):
        if abs(value) < EXACT:
            continue
        powers = vector.reshape(4, 3)
        s = np.vdot(powers[:-1], powers[1:]) / np.vdot(powers[:-1], powers[:-1])
        p = turn @ np.array([1.0, s, middle - 1.0 / value])
        p /= np.linalg.norm(p)
        left = np.linalg.svd(np.einsum("i,rij->rj", p, rows))
        q = left[2][-1].conj()
        if left[1][-1] < np.sqrt(EXACT) * left[1][0] and min(abs(p[0]), abs(q[0])) > FINITE:
            found.append([p / p[0], q / q[0]])
    return np.array(found, dtype=complex).reshape(-1, 2, 3)


def _shifted(parts: tuple[ComplexArray, ComplexArray]) -> Array:
    """The rows times 1, s and s^2 (12, 12), of (4, 3) without s and (4, 3) with it."""
    whole: Array = np.zeros((12, 12), dtype=complex)
    for k in range(3):
        for step, part in enumerate(parts):
            whole[4 * k : 4 * k + 4, 3 * (k + step) : 3 * (k + step) + 3] = part
    return whole
