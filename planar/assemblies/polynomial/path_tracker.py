"""Solutions of a block's polynomials followed from those of others of its structure, all paths side by side.

Predictor by the polynomial through the last points and their tangents (Hermite), corrector by Newton, in homogeneous
coordinates, so that what goes to infinity is followed like the rest; each path takes steps of its own. Two evaluations
a step: the second correction's Jacobian also gives the next tangent. A. P. Morgan, A. J. Sommese,
Coefficient-parameter polynomial continuation, Appl. Math. Comput. 29, 1989; A. J. Sommese, C. W. Wampler, The Numerical
Solution of Systems of Polynomials, 2005.
"""

from __future__ import annotations

from collections.abc import Callable
from itertools import combinations
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from planar.assemblies.polynomial.isotropic_form import BlockPolynomials, IsotropicForm
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.time_limit import stop_if_over

FIRST_STEP = 0.05
MIN_STEP = 1e-11
"""Of the way; what needs less ends in a multiple solution."""
MAX_STEPS = 2000
"""Steps of the slowest path."""
PREDICTION_TOLERANCE = 1e-4
"""How far a prediction may be off: directions of length one."""
END_VISIBLE_DISTANCE = 1e-6
"""Of the way: paths that come nearer to the end than this are not lost."""
CORRECTION_TOLERANCE = 1e-9
"""What Newton's second step may still move a solution by."""
HISTORY = 3
"""Points of a path that the predictor goes through at most."""
STEP_SAFETY, STEP_FACTORS, SHRINKING_FACTORS = 0.9, (0.5, 2.0), (0.1, 0.6)
"""Of the step that corrections call for; bounds of a step over the one before it, and over one that failed."""
SINGULAR_TOLERANCE = 1e-9
"""Least singular value, of the largest, at which a solution counts as single."""
SAME_SOLUTION_DISTANCE = 1e-6
"""Solutions nearer to each other than this (directions of length one) are one, or were taken for another's path."""


class PathEnds(NamedTuple):
    """Where paths ended: solutions X and Y in one row, of length one each, and how regular they are.

    `regular`: least singular value over the largest; `arrived`: whether Newton's method converges at the end itself;
    `near`: whether the path came so near to the end that what it comes to is to be seen.
    """

    V: ComplexArray
    regularity: Array
    has_converged: BoolArray
    is_near_end: BoolArray

    @property
    def is_single(self) -> BoolArray:
        """Which are isolated solutions that count once."""
        return self.has_converged & (self.regularity > SINGULAR_TOLERANCE)


HomotopyValues = tuple[ComplexArray, ComplexArray, ComplexArray]
Homotopy = Callable[[ComplexArray, Array], HomotopyValues]
"""Solutions (paths, 2 many), how far on the way (paths,) -> equations (paths, rows), slope, derivative along it."""


@runtime_checkable
class PathwiseHomotopy(Protocol):
    """A homotopy whose beginning and end differ from path to path."""

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """Its values for all paths."""

    def at_paths(self, paths: IntArray) -> Homotopy:
        """The homotopy of some of the paths, in this order."""


class CoefficientHomotopy:
    """From the polynomials at the beginning to those at the end, coefficient by coefficient."""

    def __init__(self, form: IsotropicForm, begin: BlockPolynomials, end: BlockPolynomials):
        self.many, self.products = form.entry_count, form.products
        self.begin = begin
        self.change = BlockPolynomials(*(there - here for here, there in zip(begin, end, strict=True)))
        m = form.entry_count
        self.rows = 2 * m - 2

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way."""
        m, products = self.many, self.products
        X, Y = V[:, :m], V[:, m:]
        A, B, a, b = (here + way[:, None, None] * change for here, change in zip(self.begin, self.change, strict=True))
        dA, dB, da, db = self.change
        loops, turns = A.shape[1], len(products)
        left = np.zeros((len(V), self.rows), dtype=complex)
        slope = np.zeros((len(V), self.rows, 2 * m), dtype=complex)
        along = np.zeros_like(left)
        left[:, :loops], left[:, loops : 2 * loops] = _matrix_times_vector(A, X), _matrix_times_vector(B, Y)
        slope[:, :loops, :m], slope[:, loops : 2 * loops, m:] = A, B
        along[:, :loops], along[:, loops : 2 * loops] = X @ dA.T, Y @ dB.T
        at = 2 * loops
        if turns:
            i, j, k, l = products.T  # noqa: E741
            row = at + np.arange(turns)
            left[:, row] = X[:, i] * Y[:, j] - X[:, k] * Y[:, l]
            slope[:, row, i], slope[:, row, k] = Y[:, j], -Y[:, l]
            slope[:, row, m + j], slope[:, row, m + l] = X[:, i], -X[:, k]
        at += turns
        if a.shape[1]:
            one, other = _matrix_times_vector(a, X), _matrix_times_vector(b, Y)
            left[:, at:] = one * Y[:, :1] + X[:, :1] * other
            slope[:, at:, :m], slope[:, at:, m:] = a * Y[:, :1, None], b * X[:, :1, None]
            slope[:, at:, m] += one
            slope[:, at:, 0] += other
            along[:, at:] = (X @ da.T) * Y[:, :1] + X[:, :1] * (Y @ db.T)
        return left, slope, along


class ProductHomotopy:
    """From products of linear forms, whose solutions are known, to given polynomials."""

    def __init__(self, form: IsotropicForm, end: BlockPolynomials, rng: np.random.Generator):
        self.form, self.end, self.whole = form, end, CoefficientHomotopy(form, end, end)
        many, equations = form.entry_count, 2 * form.dimension
        self.l, self.r = (_random_complex(rng, equations, many) for _ in range(2))
        self.turned = np.exp(1j * rng.uniform(0.0, 2.0 * np.pi))

    def __call__(self, V: ComplexArray, way: Array) -> HomotopyValues:
        """The equations, their slope, and their derivative along the way."""
        m, fixed = self.form.entry_count, 2 * len(self.end.A)
        left, slope, _ = self.whole(V, np.zeros(len(V)))
        one, other = V[:, :m] @ self.l.T, V[:, m:] @ self.r.T
        begin = self.turned * one * other
        along = np.zeros_like(left)
        along[:, fixed:] = left[:, fixed:] - begin
        away, towards = 1.0 - way[:, None], way[:, None]
        left[:, fixed:] = towards * left[:, fixed:] + away * begin
        slope[:, fixed:] *= towards[..., None]
        slope[:, fixed:, :m] += (self.turned * away * other)[..., None] * self.l
        slope[:, fixed:, m:] += (self.turned * away * one)[..., None] * self.r
        return left, slope, along

    def starts(self) -> ComplexArray:
        """The solutions of the products: in half of them the form in X vanishes, in the others that in Y."""
        equations = 2 * self.form.dimension
        chosen = [np.isin(np.arange(equations), own) for own in combinations(range(equations), self.form.dimension)]
        X = [_null_vector(np.concatenate([self.end.A, self.l[own]])) for own in chosen]
        Y = [_null_vector(np.concatenate([self.end.B, self.r[~own]])) for own in chosen]
        return np.concatenate([np.array(X), np.array(Y)], axis=1)


def track_paths(
    homotopy: Homotopy,
    V: ComplexArray,
    near: float = PREDICTION_TOLERANCE,
    correction: float = CORRECTION_TOLERANCE,
    most_steps: int = MAX_STEPS,
) -> PathEnds:
    """The solutions at the end of the way from those at its beginning; in as many digits as V has, where the homotopy
    keeps them, though linear systems are solved in double precision.

    `near` is how far a prediction may be off, `correction` what Newton's second step may still move a solution by.
    """
    if not len(V):
        return refine_ends(homotopy, V, np.zeros(0, dtype=bool))
    V = normalize(V)
    way, step = np.zeros(len(V), V.real.dtype), np.full(len(V), FIRST_STEP, V.real.dtype)
    least_step = MIN_STEP * min(1.0, float(np.finfo(V.real.dtype).eps / np.finfo(float).eps))
    busy = np.arange(len(V))
    current = _at_paths(homotopy, busy)
    _, jacobian, along = current(V, way)
    history = _History(V, _solve_in_patch(jacobian, V, -along)[1][0])
    for _ in range(most_steps):
        if busy.size == 0:
            break
        stop_if_over(f"after {len(V) - busy.size} of {len(V)} paths to complex solutions")
        t = way[busy]
        h = np.minimum(step[busy], 1.0 - t)
        ahead = np.where(h == 1.0 - t, 1.0, t + h)
        with np.errstate(all="ignore"):
            corrected, tangent, first, second = _predict_and_correct(current, history, h, ahead)
        good = (first < near) & (second < correction)
        order = history.point_counts
        taken = busy[good]
        way[taken] = ahead[good]
        step[busy] = h * _step_factors(first / near, second / correction, good, order)
        history.add(good, corrected, tangent, t, ahead)
        V[taken] = history.V[good]
        goes_on = (way[busy] < 1.0) & (step[busy] > least_step * np.maximum(1.0 - way[busy], 1e-3))
        if not goes_on.all():
            busy = busy[goes_on]
            history.keep(goes_on)
            current = _at_paths(homotopy, busy)
    return refine_ends(homotopy, V, way >= 1.0)._replace(is_near_end=way > 1.0 - END_VISIBLE_DISTANCE)


def _at_paths(homotopy: Homotopy, paths: IntArray) -> Homotopy:
    return homotopy.at_paths(paths) if isinstance(homotopy, PathwiseHomotopy) else homotopy


class _History:
    """The last points of paths with their tangents, in the patch <V, .> = 1 of the current point V, the last of them.

    `points` and `tangents` are (points, paths, 2, entries of a half), the latest first; `ways` (points, paths) are how
    far they are from there, of which `point_counts` (paths,) are in use.
    """

    def __init__(self, V: ComplexArray, tangent: ComplexArray):
        self.V = V
        shape = (HISTORY, len(V), 2, V.shape[1] // 2)
        self.points: ComplexArray = np.zeros(shape, dtype=V.dtype)
        self.tangents: ComplexArray = np.zeros(shape, dtype=V.dtype)
        self.points[0], self.tangents[0] = V.reshape(shape[1:]), tangent.reshape(shape[1:])
        self.ways: Array = np.zeros(shape[:2], dtype=V.real.dtype)
        self.point_counts: IntArray = np.ones(len(V), dtype=int)

    def keep(self, paths: BoolArray) -> None:
        """Leave the other paths out."""
        self.V, self.points, self.tangents = self.V[paths], self.points[:, paths], self.tangents[:, paths]
        self.ways, self.point_counts = self.ways[:, paths], self.point_counts[paths]

    def add(self, paths: BoolArray, V: ComplexArray, tangent: ComplexArray, way: Array, ahead: Array) -> None:
        """Take the next point of some paths, which is made the current one."""
        if not paths.any():
            return
        size = (len(self.V), 2, -1)
        points = np.concatenate([V.reshape(size)[None], self.points[:-1]])
        tangents = np.concatenate([tangent.reshape(size)[None], self.tangents[:-1]])
        with np.errstate(all="ignore"):
            normal = normalize(V)
            patch = normal.reshape(size).conj()
            inside = np.einsum("pbu,kpbu->kpb", patch, points)[..., None]
            scale = 1.0 / np.where(inside == 0.0, 1.0, inside)
            points = points * scale
            tangents = tangents * scale
            tangents -= points * np.einsum("pbu,kpbu->kpb", patch, tangents)[..., None]
        chosen = paths[None, :, None, None]
        self.points, self.tangents = np.where(chosen, points, self.points), np.where(chosen, tangents, self.tangents)
        self.V = np.where(paths[:, None], normal, self.V)
        ways = np.concatenate([np.zeros_like(ahead)[None], self.ways[:-1] + (way - ahead)])
        self.ways = np.where(paths, ways, self.ways)
        self.point_counts = np.where(paths, np.minimum(self.point_counts + 1, HISTORY), self.point_counts)

    def predict(self, h: Array) -> ComplexArray:
        """The points a step h (paths,) ahead, on the polynomials through all that is in use."""
        used = np.arange(HISTORY)[:, None] < self.point_counts
        is_pair = used & used[:, None] & ~np.eye(HISTORY, dtype=bool)[:, :, None]
        apart = np.where(is_pair, self.ways[:, None] - self.ways, 1.0)
        value = np.where(is_pair, (h - self.ways) / apart, 1.0).prod(axis=1)
        slope = np.where(is_pair, 1.0 / apart, 0.0).sum(axis=1)
        weight = np.where(used, value**2, 0.0)
        beyond = h - self.ways
        points = np.einsum("kp,kpbu->pbu", weight * (1.0 - 2.0 * beyond * slope), self.points)
        result: ComplexArray = points + np.einsum("kp,kpbu->pbu", weight * beyond, self.tangents)
        return result.reshape(len(self.V), -1)


def _step_factors(first: Array, second: Array, good: BoolArray, points: IntArray) -> Array:
    """The next step over the last, by corrections over what they may be. The first grows with the power of the step
    that twice the points of the predictor make, the second with its square."""
    order = 0.5 / points
    with np.errstate(all="ignore"):
        factors = STEP_SAFETY * np.minimum(
            (0.25 / np.maximum(first, 1e-300)) ** order, (0.1 / np.maximum(second, 1e-300)) ** (0.5 * order)
        )
    factors = np.where(np.isfinite(factors), factors, 0.0)
    return np.where(good, np.clip(factors, *STEP_FACTORS), np.clip(factors, *SHRINKING_FACTORS))


def refine_ends(homotopy: Homotopy, V: ComplexArray, arrived: BoolArray) -> PathEnds:
    """Solutions carried to round-off at the end of the way."""
    if not len(V):
        return PathEnds(V, np.zeros(0), arrived, arrived)
    one = np.ones(len(V))
    for _ in range(3):
        with np.errstate(all="ignore"):
            residuals, jacobian, _ = homotopy(V, one)
            bordered, (step,) = _solve_in_patch(jacobian, V, -residuals)
            distance = np.linalg.norm(step, axis=1)
            is_near = distance < 1e-3
        V = np.where(is_near[:, None], normalize(V + step), V)
    singular_values = np.linalg.svd(bordered, compute_uv=False)
    regularity = singular_values[:, -1] / singular_values[:, 0]
    arrived = arrived | (is_near & (distance < CORRECTION_TOLERANCE) & (regularity > SINGULAR_TOLERANCE))
    return PathEnds(V, regularity, arrived, arrived.copy())


def _predict_and_correct(
    homotopy: Homotopy, history: _History, h: Array, ahead: Array
) -> tuple[ComplexArray, ComplexArray, Array, Array]:
    """Solutions a step on, their tangents, and how far Newton's two corrections moved them."""
    V = history.predict(h)
    residuals, jacobian, _ = homotopy(V, ahead)
    _, (first,) = _solve_in_patch(jacobian, history.V, -residuals)
    V = V + first
    residuals, jacobian, along = homotopy(V, ahead)
    _, (second, tangent) = _solve_in_patch(jacobian, history.V, -residuals, -along)
    distances = (np.linalg.norm(step, axis=1) for step in (first, second))
    return V + second, tangent, *(np.where(np.isfinite(distance), distance, np.inf) for distance in distances)


def _solve_in_patch(
    jacobian: ComplexArray, patch: ComplexArray, *right_sides: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """The Jacobian with the two rows that keep X and Y from growing, and the solutions (sides, paths, unknowns) in the
    patch for right sides (paths, rows)."""
    paths, rows, half = len(patch), jacobian.shape[1], patch.shape[1] // 2
    border = np.zeros((paths, 2, 2 * half), dtype=complex)
    border[:, 0, :half], border[:, 1, half:] = patch[:, :half].conj(), patch[:, half:].conj()
    bordered = np.concatenate([jacobian, border], axis=1)
    right: ComplexArray = np.zeros((paths, rows + 2, len(right_sides)), dtype=complex)
    right[:, :rows] = np.stack(right_sides, axis=2)
    try:
        solutions: ComplexArray = np.linalg.solve(bordered, right)
    except np.linalg.LinAlgError:
        is_lost = ~np.isfinite(bordered).all(axis=(1, 2))[:, None, None]
        finite: ComplexArray = np.where(is_lost, np.eye(rows + 2), bordered)
        solutions = np.linalg.pinv(finite) @ np.where(is_lost, np.nan, right)
    return bordered, solutions.transpose(2, 0, 1)


def normalize(V: ComplexArray) -> ComplexArray:
    """X and Y of length one each."""
    half = V.shape[1] // 2
    parts = (V[:, :half], V[:, half:])
    with np.errstate(all="ignore"):  # what has gone astray ends as what is no number
        return np.concatenate([each / np.linalg.norm(each, axis=1, keepdims=True) for each in parts], axis=1)


def is_duplicate(V: ComplexArray) -> BoolArray:
    """Which solutions lie on another one (solutions,)."""
    half = V.shape[1] // 2
    X, Y = V[:, :half], V[:, half:]
    # sine of the angle between directions, whatever factor they have
    x, y = (np.sqrt(np.maximum(1.0 - np.abs(each @ each.conj().T) ** 2, 0.0)) for each in (X, Y))
    apart = np.maximum(x, y) + np.eye(len(V))
    return apart.min(axis=1, initial=1.0) < SAME_SOLUTION_DISTANCE


def _matrix_times_vector(matrices: ComplexArray, vectors: ComplexArray) -> ComplexArray:
    return (matrices @ vectors[..., None])[..., 0]


def _random_complex(rng: np.random.Generator, *shape: int) -> ComplexArray:
    return rng.normal(size=shape) + 1j * rng.normal(size=shape)


def _null_vector(matrix: ComplexArray) -> ComplexArray:
    return np.linalg.svd(matrix)[2][-1].conj()


class GenericInstance(NamedTuple):
    """A random instance of a structure with all its solutions that count once.

    `bound`: Bezout's number; `finite`: how many of them are at finite places.
    """

    begin: BlockPolynomials
    V: ComplexArray
    bound: int
    finite: int


def solve_generic_instance(
    form: IsotropicForm, like: Callable[[np.random.Generator], BlockPolynomials], seed: int = 7
) -> GenericInstance:
    """The solutions of a random instance, whose coefficients `like` draws."""
    rng = np.random.default_rng(seed)
    begin = like(rng)
    products = ProductHomotopy(form, begin, rng)
    starts = products.starts()
    found = track_paths(products, starts)
    again = found.is_single & is_duplicate(found.V)
    if again.any():
        closer = track_paths(products, starts[again], PREDICTION_TOLERANCE * 1e-2)
        for whole, part in zip(found, closer, strict=True):
            whole[again] = part
    V = found.V[found.is_single]
    V = V[_distinct_rows(V)]
    return GenericInstance(begin, V, form.bezout_number, int(np.sum(is_finite_solution(V))))


def _distinct_rows(V: ComplexArray) -> IntArray:
    kept: list[int] = []
    for k in range(len(V)):
        if not kept or not is_duplicate(V[[*kept, k]])[-1]:
            kept.append(k)
    return np.array(kept, dtype=int)


def is_finite_solution(V: ComplexArray, least: float = 1e-7) -> BoolArray:
    """Which solutions are at finite places, X0 and Y0 not vanishing."""
    half = V.shape[1] // 2
    return (np.abs(V[:, 0]) > least) & (np.abs(V[:, half]) > least)
