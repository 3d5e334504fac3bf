"""Solutions in homogeneous coordinates, the homotopy between members of a family, and a dyad's roots in closed form.

With p = (1, z, z*) of one place and q of the other each of a dyad's four rows is p R q = 0. Along a random line of p's
plane, moved by t, p = a + s b + t c, the four rows times 1, s and s^2 are linear in t and in q, s q, s^2 q and s^3 q,
twelve by twelve (D. Manocha, Solving systems of polynomial equations, IEEE Computer Graphics and Applications 14 (1994)
46). Six points are found in the whole plane, two of them at infinity, the circular points, where turning dyads are
sought.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from planar.assemblies.polynomial.path_tracker import HomotopyValues
from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.synthesis.exact.relations.family import Family, Member

Images = Callable[[ComplexArray], list[ComplexArray]]
"""Of solutions V all that stand for the same thing, themselves first."""


def reordered(V: ComplexArray, order: tuple[int, ...]) -> ComplexArray:
    """Solutions whose unknown at each place is that of an order."""
    half = V.shape[1] // 2
    own = np.array(order, dtype=int) + 1
    return V[:, [0, *own.tolist(), half, *(own + half).tolist()]]


def exchange_images(exchanges: tuple[tuple[int, ...], ...]) -> Images:
    """All that exchanges make of solutions."""
    return lambda V: [reordered(V, each) for each in exchanges]


def representatives(V: ComplexArray, images: Images | None) -> ComplexArray:
    """Of all that stand for the same thing always the same one."""
    every = images(V) if images is not None else [V]
    if len(every) == 1:
        return V
    keys = np.array([solution_keys(each).real for each in every])
    chosen = np.argmin(keys, axis=0)
    found: ComplexArray = np.array(every)[chosen, np.arange(len(V))]
    return found


def solution_keys(V: ComplexArray) -> ComplexArray:
    """A number by which solutions are told from each other, whatever the length of their halves."""
    half = V.shape[1] // 2
    rng = np.random.default_rng(1)
    weights = rng.normal(size=(2, 2, half)) + 1j * rng.normal(size=(2, 2, half))
    parts = V[:, :half], V[:, half:]
    found: ComplexArray = sum((part @ w[0]) / (part @ w[1]) for part, w in zip(parts, weights, strict=True))
    return found


SAME = 1e-7
"""Of directions of length one: solutions nearer to each other are one. Two that are nearly real are no farther apart
than their imaginary parts."""


def first_of_same(V: ComplexArray) -> IntArray:
    """Of each solution the first that is the same (solutions,)."""
    found: IntArray = np.arange(len(V))
    if len(V) < 2:
        return found
    half, key = V.shape[1] // 2, solution_keys(V)
    parts = V[:, :half], V[:, half:]
    order = np.argsort(key.real, kind="stable")
    unit = [part / np.linalg.norm(part, axis=1, keepdims=True) for part in parts]
    room = 1e3 * SAME * np.maximum(1.0, np.abs(key))
    for at, k in enumerate(order.tolist()):
        for other in order[at + 1 :].tolist():
            if key[other].real - key[k].real > room[k]:
                break
            apart = max(np.linalg.norm(each[other] - np.vdot(each[k], each[other]) * each[k]) for each in unit)
            if apart < SAME:
                low = min(found[k], found[other])
                found[k] = found[other] = low
    return found


class MemberHomotopy:
    """Solutions are V = (1, places; 1, conjugates), each half up to a factor, so that what goes to infinity is followed
    like the rest. Numbers of the members (entries, numbers, 2) may have a last axis of paths."""

    def __init__(self, family: Family, begin: Member, end: Member):
        self.family, self.begin = family, begin
        self.change = tuple(b - a for a, b in zip(begin.parts, end.parts, strict=True))

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way; each row of slope has length one."""
        f, slope, along = self.family.rows_at(affine_solutions(V).T.copy(), self.begin, self.change, way)
        return scaled_rows(f, homogeneous_slopes(slope, V), along)


class EdgeHomotopy:
    """Of each path a homotopy of its own between two of several members: `edges` (paths, 2)."""

    def __init__(self, family: Family, members: Sequence[Member], edges: IntArray):
        self.family, self.edges = family, edges
        self.numbers = [np.stack(parts, axis=-1) for parts in zip(*(member.parts for member in members), strict=True)]

    def at_paths(self, paths: IntArray) -> MemberHomotopy:
        """The homotopy of some of the paths."""
        begin, end = (Member(tuple(part[..., nodes] for part in self.numbers)) for nodes in self.edges[paths].T)
        return MemberHomotopy(self.family, begin, end)

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way, of all paths."""
        return self.at_paths(np.arange(len(V)))(V, way)


def homogeneous_slopes(slope: ComplexArray, V: ComplexArray) -> ComplexArray:
    """Derivatives by homogeneous coordinates (paths, rows, 2 many + 2) from those by unknowns x = X / X0 (rows, 2 many,
    paths)."""
    rows, both, paths = slope.shape
    half = both // 2
    result: ComplexArray = np.empty((paths, rows, 2, half + 1), dtype=complex)
    result[..., 1:] = slope.reshape(rows, 2, half, paths).transpose(3, 0, 1, 2)
    sides = V.reshape(paths, 1, 2, half + 1)
    inverse = 1.0 / sides[..., :1]
    result[..., 1:] *= inverse
    result[..., 0] = -(result[..., 1:] * (sides[..., 1:] * inverse)).sum(axis=3)
    return result.reshape(paths, rows, -1)


def scaled_rows(f: ComplexArray, slope: ComplexArray, along: ComplexArray) -> HomotopyValues:
    """Rows (rows, paths), slopes (paths, rows, columns) and changes (rows, paths), path by path and with each row of
    slope of length one."""
    size = np.sqrt(np.einsum("prc,prc->pr", slope.real, slope.real) + np.einsum("prc,prc->pr", slope.imag, slope.imag))
    scale = 1.0 / np.where(size > 0.0, size, 1.0)
    return f.T * scale, slope * scale[..., None], along.T * scale


def affine_solutions(V: ComplexArray) -> ComplexArray:
    """The unknowns (solutions, 2 many) of solutions in homogeneous coordinates."""
    half = V.shape[1] // 2
    with np.errstate(all="ignore"):
        return np.concatenate([V[:, 1:half] / V[:, :1], V[:, half + 1 :] / V[:, half : half + 1]], axis=1)


def homogeneous_solutions(x: ComplexArray) -> ComplexArray:
    """Homogeneous coordinates of unknowns."""
    half, one = x.shape[1] // 2, np.ones((len(x), 1))
    return np.concatenate([one, x[:, :half], one, x[:, half:]], axis=1)


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
    still = [np.zeros_like(part) for part in member.parts]
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
