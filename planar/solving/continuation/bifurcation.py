"""Bifurcations (change points): the point where branches cross, the branches through it, and the curve beside it.

At a change point the Jacobian J (rows, n + 1) of the constraints has k > 1 null vectors N (n + 1, k) and left ones L.
Ways through it are v = N c with L^T F''(v, v) = 0: quadratic forms in c, one for each left null vector. Their second
derivatives w follow from J w + F''(v, v) = 0 and, in the null space, from L^T (F'''(v, v, v) + 3 F''(v, w)) = 0,
which is linear in w. (C. Rheinboldt 1986; A. Mueller, Higher-order analysis of kinematic singularities of lower pair
linkages and serial manipulators, J. Mech. Robotics 10, 2018.)
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from planar.equations.sparse_matrices import BorderedJacobian, SparseMatrices, closing_step
from planar.foundation.arrays import Array, ComplexArray, append_number, greatest_size, length_of, stack_row
from planar.solving.checks import SINGULAR_TOLERANCE
from planar.solving.continuation.solution_curve import Arc, CurvePoint, SolutionCurve, fit_polynomial
from planar.solving.newton import settle, shortest_step
from planar.solving.prepared_mechanism import PreparedMechanism

SMALL_SINGULAR_VALUE = 0.1
"""A singular value below this part of the greatest may be one that vanishes near by."""
ALIKE_RATIO = 30.0
"""Singular values are small alike up to this multiple of the least."""
MOST_ALIKE_VALUES = 64
"""Beyond this number, as in a long row, a point where all vanish is not looked for."""
MORE_VALUES = 2
"""Singular values that are looked at, beside those which are brought to zero."""
LEAST_VALUES = 8
"""Singular values, the least ones, of which each is brought to zero."""
MOST_SMALL_VALUES = 4
"""Singular values, with the one that is zero, that are brought to zero together where single ones do not lead there."""
ON_BRANCH_RATIO = 1e-2
"""A point is on a branch if it is no further from it than this part of its distance from the change point."""
START_DISTANCE_TOLERANCE = 1e-6
"""rad or sizes: so far a position on a change point is from it at most, known to the root of rounding."""
AT_BIFURCATION_DISTANCE = 1e-5
"""So near to a singular Jacobian a start may be a change point, known to the root of rounding."""
ZERO_INPUT_RATE = 1e-7
"""A rate of the inputs along a branch below this is none."""
HALF_ARC_LENGTH, MIN_HALF_ARC_LENGTH = 0.02, 1e-4
"""Half the length of the arc that is taken as a polynomial beside a change point, and where it is given up."""
ARC_FIT_TOLERANCE = 1e-11
"""How well that polynomial must meet the curve between the points that it is laid through."""
EXACT_SINGULAR_TOLERANCE = 1e-10
"""At the position to round-off a singular value below this part of the greatest is zero."""
EXACT_FORM_TOLERANCE = 1e-10
"""There a quadratic form below this part of the greatest vanishes."""
SAME_DIRECTION_TOLERANCE = 1e-6
"""Directions that are nearer to one another are one."""
MAX_NULL_VECTORS = 6
"""Of k null vectors there are up to 2^(k - 1) directions: of more than these they are not looked for."""
STARTS_PER_DIRECTION, MAX_DIRECTION_STEPS = 24, 40
"""Complex directions from which Newton's method starts, for each that there may be, and its steps."""
SETTLED_DIRECTION = 1e-9
"""Of its size: a complex direction that moves less has settled."""
MAX_REFINEMENTS, CONVERGED_STEP = 12, 1e-13


class Bifurcation(NamedTuple):
    """A change point with the branches through it, points at one place with the tangents of the branches: first the one
    by which the tracker came.

    `is_complete` says whether these are all; where branches touch one another, or are very many, some are missing.
    `rank_loss` is how much rank the Jacobian lacks.
    """

    y: Array
    branches: tuple[CurvePoint, ...]
    is_complete: bool
    rank_loss: int


def bifurcation_candidates(curve: SolutionCurve, point: CurvePoint, farthest: float) -> Iterator[ConstraintsAt]:
    """The points next to this one at which the Jacobian has more than one null vector, those to which Newton's method
    converges by steps no longer than `farthest`.

    The constraints leave nothing but rounding open there at a change point, more where the curve only comes near one.

    Each of the least singular values that is small is brought to zero; where several loops come near a change point at
    once, each is found.
    Where many are small alike, as at the flat position of a scissor lift, they are first brought to zero together.
    """
    y = point.y + min(point.regular_distance, 0.1) * point.tangent
    start = constraints_at(curve, y)
    small = start.values < min(SMALL_SINGULAR_VALUE * start.greatest, ALIKE_RATIO * start.values[-1])
    if MOST_SMALL_VALUES <= small.sum() <= MOST_ALIKE_VALUES:
        candidate = _refine_candidate(curve, start, start.right[-1 - small.sum() :].T, farthest)
        if candidate is not None:
            yield candidate
    for second in range(2, min(len(start.right), LEAST_VALUES + 1) + 1):
        if second > 2 and start.values[1 - second] > SMALL_SINGULAR_VALUE * start.greatest:
            return
        candidate = _refine_candidate(curve, start, start.right[[-second, -1]].T, farthest)
        if candidate is None and 2 < second <= MOST_SMALL_VALUES:
            candidate = _refine_candidate(curve, start, start.right[-second:].T, farthest)
        if candidate is not None and candidate.null.shape[1] > 2:
            candidate = _refine_candidate(curve, candidate, candidate.null)
        if candidate is not None:
            yield candidate


class ConstraintsAt(NamedTuple):
    """The constraints at a point y: F (rows,), J (rows, n + 1), and the singular values of J with their vectors, those
    on the left as columns and those on the right as rows; the least ones alone where unknowns are many. `greatest` is
    no less than the greatest of them, or than one."""

    y: Array
    residual: Array
    jacobian: Array | SparseMatrices
    left: Array
    values: Array
    right: Array
    greatest: float

    @property
    def null(self) -> Array:
        """The null vectors of J (n + 1, k)."""
        return self.right[int(np.sum(self.values > SINGULAR_TOLERANCE * self.greatest)) :].T

    @property
    def gap(self) -> float:
        """What the worst constraint leaves open."""
        return greatest_size(self.residual)


def constraints_at(curve: SolutionCurve, y: Array, count: int = LEAST_VALUES) -> ConstraintsAt:
    """The constraints at y, with `count` of the least singular values where unknowns are many."""
    residual, jacobian = curve.residuals_and_jacobian(y)
    if isinstance(jacobian, SparseMatrices):
        try:
            vectors = BorderedJacobian(jacobian, np.ones(len(y))).least_singular_vectors(count)
            return ConstraintsAt(y, residual, jacobian, *vectors, max(jacobian.greatest_singular_value_bound(), 1.0))
        except ValueError:
            jacobian = np.asarray(jacobian)
    left, values, right = np.linalg.svd(jacobian)
    return ConstraintsAt(y, residual, jacobian, left, values, right, max(values[0], 1.0) if values.size else 1.0)


def _refine_candidate(
    curve: SolutionCurve, start: ConstraintsAt, null_start: Array, longest_step: float = 1.0
) -> ConstraintsAt | None:
    """The point next to a start at which the Jacobian has null vectors next to these (n + 1, k); None where Newton's
    method does not settle by steps no longer than the longest."""
    count = null_start.shape[1] + MORE_VALUES

    def step_at(y: Array) -> tuple[Array, Array]:
        constraints = start if y is start.y else constraints_at(curve, y, count)
        return _step_to_lower_rank(curve, constraints, null_start), np.zeros((0, 0))

    settled_at = (len(start.y), CONVERGED_STEP)
    y, is_settled = settle(step_at, lambda _, step: step, start.y, MAX_REFINEMENTS, settled_at, longest_step)
    candidate = constraints_at(curve, y) if is_settled else None
    return candidate if candidate is not None and candidate.null.shape[1] > 1 else None


def _step_to_lower_rank(curve: SolutionCurve, constraints: ConstraintsAt, null_start: Array) -> Array:
    """A step of Newton's method for the rank of the Jacobian, after Lyapunov and Schmidt.

    Of the singular vectors those next to the null vectors that are sought, N on the right and L on the left, are set
    apart. The step closes F along all others, and moves along N so that L^T J N vanishes to first order. Where L^T F
    stays open the curve only comes near a change point. Further singular values that are zero close nothing.
    """
    y, residual, jacobian, left, values, right, greatest = constraints
    nearest = np.argsort(-np.linalg.norm(right @ null_start, axis=1), kind="stable")[: null_start.shape[1]]
    others = np.setdiff1d(np.arange(len(values)), nearest)
    null, left_null = right[nearest].T, np.delete(left, others, axis=1)
    regular = others[values[others] > EXACT_SINGULAR_TOLERANCE * greatest]
    if isinstance(jacobian, SparseMatrices):
        closing = closing_step(
            jacobian, residual, np.delete(left, regular, axis=1), np.delete(right, regular, axis=0).T
        )
    else:
        closing = -right[regular].T @ ((left[:, regular].T @ residual) / values[regular])
    forms, defects = [], []
    if not left_null.shape[1]:
        return closing
    for weights, slopes in zip(left_null.T, curve.weighted_hessian_products(y, left_null, null), strict=True):
        forms.append(slopes @ null)
        defects.append(weights @ jacobian @ null + slopes @ closing)
    along = np.linalg.lstsq(np.concatenate(forms), -np.concatenate(defects), rcond=1e-12)[0]
    return closing + null @ along


class _BranchConditions:
    """The conditions of second and third order for branches through one change point."""

    def __init__(self, curve: SolutionCurve, y: Array):
        self.curve, self.y = curve, y
        self.u, self.s, self.vt = np.linalg.svd(curve.jacobian(y))
        self.rank = int(np.sum(self.s > EXACT_SINGULAR_TOLERANCE * max(self.s[0], 1.0)))
        self.null, self.left_null = self.vt[self.rank :].T, self.u[:, self.rank :]
        self.forms = curve.weighted_hessian_products(y, self.left_null, self.null) @ self.null

    def branch_along(self, c: Array, sideways: Array | float = 0.0) -> CurvePoint | None:
        """The branch with tangent null c and its second derivative; None where the third order leaves it open.

        `sideways` is the second derivative of the inputs (inputs,) by how far they are on their straight line, where
        they bend off it.
        """
        curve, rank = self.curve, self.rank
        v = self.null @ c
        position, ahead = curve.unknowns_and_inputs(self.y), curve.widen_direction(v)
        aside = np.concatenate([np.zeros(len(v) - 1), np.broadcast_to(v[-1] ** 2 * sideways, curve.start.shape)])
        second_order = curve.functions.kinematics(position, ahead, aside, curve.p).F2
        base = -self.vt[:rank].T @ ((self.u[:, :rank].T @ second_order) / self.s[:rank])
        # of the null space only what is normal to the tangent
        across = np.linalg.svd(c[None])[2][1:].T

        def third_order(e: Array) -> Array:
            second = curve.widen_direction(base + self.null @ (across @ e)) + aside
            return self.left_null.T @ curve.functions.formulas.third_rate_remainder(position, ahead, second, curve.p)

        e = solve_third_order(third_order, across.shape[1])
        return None if e is None else CurvePoint(self.y, v, base + self.null @ (across @ e), 0.0)


def bifurcation_ahead(curve: SolutionCurve, point: CurvePoint, y: Array) -> Bifurcation | None:
    """A change point with the branches through it, if one of them leads from a point beside it."""
    conditions = _BranchConditions(curve, y)
    first = nearest_direction(conditions.forms, conditions.null.T @ (y - point.y))
    coming = None if first is None else conditions.branch_along(first)
    if first is None or coming is None or not _leads_to(curve, point, coming):
        return None
    directions = branch_directions(conditions.forms)
    others = [conditions.branch_along(c) for c in directions.vectors if not is_same_direction(c, first)]
    branches = tuple(branch for branch in others if branch is not None)
    return Bifurcation(y, (coming, *branches), directions.is_complete and len(branches) == len(others), len(first) - 1)


def bifurcation_at_start(curve: SolutionCurve, y: Array) -> Bifurcation | None:
    """The change point on which a position lies to rounding, with all branches on which the inputs move.

    First those on which the unknowns move least for the inputs, in whichever direction these go; None where the
    position is no such point.
    """
    conditions = _conditions_at_start(curve, y)
    if conditions is None:
        return None
    directions = branch_directions(conditions.forms)
    branches = [branch for branch in map(conditions.branch_along, directions.vectors) if branch is not None]
    outgoing = [
        branch if branch.input_rate > 0.0 else branch.reversed()
        for branch in branches
        if abs(branch.input_rate) > ZERO_INPUT_RATE
    ]
    if not outgoing:
        return None
    # in the direction of the inputs, so that both directions from here count alike
    sense = np.sign(curve.input_direction[np.argmax(np.abs(curve.input_direction))])
    rates = [tuple(np.round(sense * branch.tangent[:-1] / branch.input_rate, 6)) for branch in outgoing]
    order = sorted(range(len(outgoing)), key=lambda k: (round(float(np.linalg.norm(rates[k])), 6), rates[k]))
    is_complete = directions.is_complete and len(branches) == len(directions.vectors)
    return Bifurcation(conditions.y, tuple(outgoing[k] for k in order), is_complete, conditions.null.shape[1] - 1)


def _conditions_at_start(curve: SolutionCurve, y: Array) -> _BranchConditions | None:
    """The conditions at the change point on which a position lies to rounding; None where it is none."""
    start = constraints_at(curve, y)
    counts = dict.fromkeys((max(start.null.shape[1], 2), 2))
    refined = (_refine_candidate(curve, start, start.right[-count:].T) for count in counts)
    near = next((candidate for candidate in refined if candidate is not None), None)
    if near is not None and near.null.shape[1] > 2:
        near = _refine_candidate(curve, near, near.null)
    if near is None or np.linalg.norm(near.y - y) > START_DISTANCE_TOLERANCE or near.gap > curve.solver.tolerance:
        return None
    return _BranchConditions(curve, near.y)


def singular_rates(setup: PreparedMechanism, z: Array) -> tuple[Array, Array, Array] | None:
    """A singular position near z, to round-off, of one freedom more than inputs, with the first and second rates of the
    one motion through it; None if it is not one."""
    u1, u2 = setup.inputs.u1, setup.inputs.u2
    if not u1.size:
        return None  # no input gives a direction
    speed, gain = float(np.linalg.norm(u1)), float(np.linalg.norm(u2))
    # inputs that only start to move go as their accelerations say, those that stand still as the first of them
    axis = u1 if speed > 0.0 else u2 if gain > 0.0 else np.eye(u1.size)[0]
    axis = axis / np.linalg.norm(axis)
    conditions = _conditions_at_start(SolutionCurve(setup, setup.inputs.u, axis), np.append(z, 0.0))
    if conditions is None or conditions.null.shape[1] != 2:
        return None
    directions = branch_directions(conditions.forms).vectors
    directions = [c for c in directions if abs(float(conditions.null[-1] @ c)) > ZERO_INPUT_RATE]
    # in units of time in which the inputs run at speed one
    acceleration = u2 / speed**2 if speed > 0.0 else 0.0 * u2
    along = float(acceleration @ axis)
    branch = conditions.branch_along(directions[0], acceleration - along * axis) if len(directions) == 1 else None
    if branch is None:
        return None
    (*_, t), (*_, t1), (*_, t2) = branch.y, branch.tangent, branch.curvature
    first = branch.tangent[:-1] / t1
    second = (branch.curvature[:-1] - first * t2) / t1**2
    z = branch.y[:-1] - t * first
    if speed > 0.0:
        return z, first * speed, (second + first * along) * speed**2
    return z, 0.0 * first, first * gain


def _leads_to(curve: SolutionCurve, point: CurvePoint, branch: CurvePoint) -> bool:
    """Whether a branch through a change point leads to a point beside it."""
    distance = float(branch.tangent @ (branch.y - point.y))
    if distance * float(branch.tangent @ point.tangent) <= 0.0:
        return False
    guess = curve.correct(branch.ahead(-distance), branch.tangent)
    return guess is not None and float(np.linalg.norm(guess - point.y)) < ON_BRANCH_RATIO * abs(distance)


def branch_crossing(curve: SolutionCurve, branch: CurvePoint, rank_loss: int) -> Arc | None:
    """The arc from one side of a change point to the other along one branch: a polynomial of eighth degree.

    Its error falls with the ninth power of its length; so far that rounding is all that is left.
    """
    half = min(HALF_ARC_LENGTH, 0.1 / max(float(np.linalg.norm(branch.curvature)), 1e-300))
    while half > MIN_HALF_ARC_LENGTH:
        places = [curve.correct(branch.ahead(x), branch.tangent) for x in (-half, half)]
        ends = [curve.point_at(y, branch.tangent) for y in places if y is not None]
        if len(ends) == 2 and all(end.tangent @ branch.tangent > 0.9 for end in ends):
            before, after = ends
            shape = fit_polynomial((before, branch, after), branch.tangent, (-1.0, 0.0, 1.0), half)
            arc = Arc(before, after, branch.y, branch.tangent, half, shape, rank_loss)
            if _fits_curve(curve, arc):
                return arc
        half *= 0.5
    return None


def _fits_curve(curve: SolutionCurve, arc: Arc) -> bool:
    """Whether the polynomial of an arc beside a change point is the curve to round-off."""
    for x in (-0.5 * arc.unit_length, 0.5 * arc.unit_length):
        rough = arc.polynomial(x)
        exact = curve.correct(rough, arc.axis)
        if exact is None or np.max(np.abs(exact - rough)) > ARC_FIT_TOLERANCE:
            return False
    return True


def nearest_direction(forms: Array, c: Array, tolerance: float = EXACT_FORM_TOLERANCE) -> Array | None:
    """The direction (k,) of length one next to c in which all quadratic forms (forms, k, k) vanish."""
    scale = greatest_size(forms)
    if scale < SINGULAR_TOLERANCE:
        return None
    forms = forms / scale

    def of_length_one(c: Array) -> tuple[Array, Array]:
        rows = forms @ c
        return append_number(rows @ c, 0.5 * float(c @ c - 1.0)), stack_row(2.0 * rows, c)

    start = c / length_of(c)
    c, _ = settle(of_length_one, shortest_step(1e-10), start, MAX_REFINEMENTS, (len(c), CONVERGED_STEP))
    vanishes = greatest_size(forms @ c @ c) < tolerance
    return c if vanishes and abs(c @ c - 1.0) < SAME_DIRECTION_TOLERANCE else None


class BranchDirections(NamedTuple):
    """Directions (k,) of length one, each with one of its two senses, and whether these are surely all."""

    vectors: list[Array]
    is_complete: bool


def branch_directions(forms: Array, tolerance: float = EXACT_FORM_TOLERANCE) -> BranchDirections:
    """The directions (k,) in which quadratic forms (forms, k, k) vanish.

    `tolerance` is how exactly the forms are known, as a part of the greatest. None where all vanish, or where two
    directions are one: branches that only touch are not parted by this order. Of two null vectors the directions are
    the roots of a polynomial. Of more Newton's method looks for all complex ones, of which there are 2^(k - 1) by
    Bezout's theorem if no two are one: the real ones among that number are all.
    """
    size = forms.shape[1]
    if size == 2:
        return BranchDirections(_roots_of_two(forms, tolerance), True)
    scale = greatest_size(forms)
    if size > MAX_NULL_VECTORS or len(forms) < size - 1 or scale < SINGULAR_TOLERANCE:
        return BranchDirections([], False)
    rng = np.random.default_rng(0)
    mixed = forms / scale
    if len(forms) > size - 1:
        mixed = np.tensordot(rng.normal(size=(size - 1, len(forms))), mixed, 1)
    complex_directions = _complex_directions(mixed, STARTS_PER_DIRECTION * 2 ** (size - 1), rng)
    real = [c.real for c in complex_directions if np.abs(c.imag).max() < SAME_DIRECTION_TOLERANCE]
    directions = [direction for c in real if (direction := nearest_direction(forms, c, tolerance)) is not None]
    return BranchDirections(directions, len(complex_directions) == 2 ** (size - 1))


def _complex_directions(forms: Array, start_count: int, rng: np.random.Generator) -> list[ComplexArray]:
    """The complex directions (k,) in which k - 1 forms vanish, to which Newton's method leads from random starts, with
    steps normal to where it is: of length one, the greatest entry positive."""
    size = forms.shape[1]
    c = rng.normal(size=(start_count, size)) + 1j * rng.normal(size=(start_count, size))
    change = np.full(start_count, np.inf)
    for _ in range(MAX_DIRECTION_STEPS):
        c /= np.linalg.norm(c, axis=1, keepdims=True)
        rows = np.einsum("fij,sj->sfi", forms, c)
        slopes = np.concatenate([2.0 * rows, c.conj()[:, None]], axis=1)
        open_ = np.append(np.einsum("sfi,si->sf", rows, c), np.zeros((len(c), 1)), axis=1)
        is_regular = np.abs(np.linalg.det(slopes)) > 0.0
        c, slopes, open_ = c[is_regular], slopes[is_regular], open_[is_regular]
        step = np.linalg.solve(slopes, open_[..., None])[..., 0]
        c, change = c - step, np.linalg.norm(step, axis=1)
    directions: list[ComplexArray] = []
    for direction in c[change < SETTLED_DIRECTION]:
        greatest = direction[np.argmax(np.abs(direction))]
        unit = direction * (abs(greatest) / greatest / np.linalg.norm(direction))
        if all(1.0 - abs(np.vdot(unit, other)) > SAME_DIRECTION_TOLERANCE for other in directions):
            directions.append(unit)
    return directions


def is_same_direction(c: Array, other: Array) -> bool:
    """Whether two directions of length one are one, whichever sense they have."""
    return min(length_of(c - other), length_of(c + other)) <= SAME_DIRECTION_TOLERANCE


def solve_third_order(condition: Callable[[Array], Array], count: int) -> Array | None:
    """The part e (count,) of a second derivative in the null space that meets a condition (forms,) linear in it.

    None where it leaves e open.
    """
    base = condition(np.zeros(count))
    jacobian = np.stack([condition(unit) - base for unit in np.eye(count)], axis=1)
    if np.linalg.svd(jacobian, compute_uv=False)[-1] < SINGULAR_TOLERANCE:
        return None
    return np.linalg.lstsq(jacobian, -base, rcond=None)[0]


def _roots_of_two(forms: Array, tolerance: float) -> list[Array]:
    """The roots that quadratic forms in two unknowns have in common."""
    quadratics = np.stack([forms[:, 0, 0], forms[:, 0, 1] + forms[:, 1, 0], forms[:, 1, 1]], axis=1)
    _, sizes, rows = np.linalg.svd(np.vstack([quadratics, np.zeros((1, 3))]))
    if sizes[0] <= SINGULAR_TOLERANCE:
        return []
    a, b, c = rows[0]
    discriminant = b * b - 4.0 * a * c
    if discriminant <= tolerance:
        return []
    # the roots of a s^2 + b s t + c t^2, without cancelling
    q = -0.5 * (b + np.copysign(np.sqrt(discriminant), b))
    roots = [np.array(root) / np.hypot(*root) for root in ((q, a), (c, q))]
    return [
        root
        for root in roots
        if np.max(np.abs(quadratics @ (root[0] ** 2, root[0] * root[1], root[1] ** 2))) <= tolerance * sizes[0]
    ]
