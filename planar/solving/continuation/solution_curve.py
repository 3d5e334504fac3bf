"""The solution curve along a straight input path: points on it, tangents, curvature, what lies between two points."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache
from math import perm
from typing import NamedTuple

import numpy as np

from planar.equations.coordinates import FRAME_PARTS, frames_from_coordinates
from planar.equations.sparse_matrices import BorderedJacobian, SparseMatrices
from planar.foundation.arrays import Array, append_number, greatest_size, length_of, stack_row
from planar.foundation.jets import Jet, value_and_rates
from planar.model.pairs import Pair
from planar.solving.checks import DIFFERENCE_STEP, column_norms, singular_distance
from planar.solving.newton import SystemFunction, correct, correct_at_rank
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_CORRECTIONS = 10
CLOSED_TOLERANCE = 1e-10
"""A corrected point leaves no more open than this, where it is far out this part of how far."""
ZERO_SINGULAR_VALUE = 1e-10
"""A singular value that is this part of the greatest is zero to rounding."""
MIN_COLUMN_NORM = 1e-6
"""A column of the Jacobian is judged by its own size, down to this part of the size of the mechanism."""


REGULAR_SINGULAR_VALUE = 1e-4
"""A least singular value (columns of one size) from which on tangents are solved for without looking at all of them."""
MAX_TANGENT_RATIO = 100.0
"""How many times longer than its part in the direction asked for a tangent may be for that."""
SHORT_REGULAR_DISTANCE = 0.25
"""rad or sizes: a distance from singular Jacobians from which on no step is shortened."""
MAX_SOLVED_STEP = 1e3
"""A longer step is that of a singular system, solved once more in the sense of least squares."""
DEAD_POINT_TOLERANCE = 1e-7
"""The square root of twice what the inputs may have left (rad or sizes) of their way to where they turn back at a dead
point to rounding; also the least rate of the inputs along the curve from which one is left."""
RESTING_INPUT_RATE = 1e-13
"""A rate of the inputs along the curve, for one of what is farthest out, that is rounding."""


class CurvePoint(NamedTuple):
    """A point of the curve: y = (unknowns, how far the inputs are on their way), (n + 1,), its unit tangent, its second
    derivative by arc length, and how far it is at least to where the Jacobian could lose rank."""

    y: Array
    tangent: Array
    curvature: Array
    regular_distance: float

    @property
    def input_rate(self) -> float:
        """The rate of the inputs along the curve: positive where they go on, zero at a dead point."""
        return float(self.tangent[-1])

    @property
    def is_dead_point(self) -> bool:
        """Whether the point is a dead point to rounding.

        With rate g and second derivative b of the inputs by arc length it is g^2 / 2b before where they turn back. A
        small rate alone does not tell: it is small as well where slides go far out for little of the inputs.
        """
        g, b = self.input_rate, float(self.curvature[-1])
        is_near = g * g <= DEAD_POINT_TOLERANCE**2 * abs(b)
        return is_near or abs(g) * max(1.0, greatest_size(self.y)) < RESTING_INPUT_RATE

    def ahead(self, distance: float) -> Array:
        """Where the curve is so far ahead (n + 1,), to second order."""
        return self.y + distance * self.tangent + 0.5 * distance**2 * self.curvature

    def towards(self, direction: Array) -> CurvePoint:
        """The same point, to be left less than a right angle from a direction (n + 1,)."""
        return self if self.tangent @ direction >= 0.0 else self.reversed()

    def reversed(self) -> CurvePoint:
        """The same point, to be left the other way."""
        return self._replace(tangent=-self.tangent)


class ImplicitCurve:
    """A curve F(y) = 0 in y (n + 1,) by its residuals (rows,) and Jacobian J (rows, n + 1) alone.

    J has rank n but where curves cross; its null vector is the tangent. E. Allgower, K. Georg, Introduction to
    Numerical Continuation Methods, 2003.
    """

    def __init__(self, system: SystemFunction):
        self._system = system

    def residuals_and_jacobian(self, y: Array) -> tuple[Array, Array | SparseMatrices]:
        """F (rows,) and J (rows, n + 1), by its entries where unknowns are many."""
        return self._system(y)

    def jacobian(self, y: Array) -> Array | SparseMatrices:
        """J (rows, n + 1)."""
        return self.residuals_and_jacobian(y)[1]

    def second_derivative(self, y: Array, direction: Array) -> Array:
        """The second derivative of F along a direction (rows,)."""
        change: Array = self.jacobian(y + DIFFERENCE_STEP * direction) @ direction - self.jacobian(y) @ direction
        return change / DIFFERENCE_STEP

    def point_at(self, y: Array, towards: Array, with_distance: bool = True) -> CurvePoint:
        """The point at y, its tangent less than a right angle from a direction; its regular distance is not a number
        where it is not asked for."""
        jacobian = self.jacobian(y)
        if isinstance(jacobian, SparseMatrices):
            point = self._sparse_point_at(y, towards, jacobian, with_distance)
            if point is not None:
                return point
            jacobian = np.asarray(jacobian)
        least_value = self._least_singular_value(jacobian)
        n = len(y) - 1
        if len(jacobian) == n and least_value > REGULAR_SINGULAR_VALUE:
            system = stack_row(jacobian, towards)
            tangent = _solve_regular(system, input_axis(n + 1))
            size = np.inf if tangent is None else length_of(tangent)
            if tangent is not None and size * length_of(towards) < MAX_TANGENT_RATIO:
                tangent /= size
                system[n] = tangent
                curvature = _solve_shortest(system, append_number(-self.second_derivative(y, tangent), 0.0))
                distance = self._regular_distance(y, tangent, jacobian, least_value) if with_distance else np.nan
                return CurvePoint(y, tangent, curvature, distance)
        u, s, vt = np.linalg.svd(jacobian)
        tangent = vt[n] if vt[n] @ towards >= 0.0 else -vt[n]
        is_nonzero = s[:n] > ZERO_SINGULAR_VALUE * max(s[0], 1.0) if n else np.zeros(0, dtype=bool)
        along = (u.T[:n] @ self.second_derivative(y, tangent)) if n else np.zeros(0)
        curvature = -vt[:n].T @ np.where(is_nonzero, along / np.where(is_nonzero, s[:n], 1.0), 0.0)
        return CurvePoint(y, tangent, curvature, self._regular_distance(y, tangent, jacobian, least_value))

    def _sparse_point_at(
        self, y: Array, towards: Array, jacobian: SparseMatrices, with_distance: bool
    ) -> CurvePoint | None:
        """The same of many unknowns; None where all singular values have to be looked at."""
        try:
            bordered = BorderedJacobian(jacobian, towards)
        except ValueError:
            return None
        sizes = jacobian.column_norms(MIN_COLUMN_NORM)
        least_value = bordered.least_singular_value(sizes)
        if not (least_value > REGULAR_SINGULAR_VALUE and bordered.tangent_ratio < MAX_TANGENT_RATIO):
            return None
        tangent = bordered.tangent
        curvature = bordered.step(-self.second_derivative(y, tangent), tangent)
        distance = self._sparse_regular_distance(y, bordered, sizes, least_value) if with_distance else np.nan
        return CurvePoint(y, tangent, curvature, distance)

    def _sparse_regular_distance(self, y: Array, bordered: BorderedJacobian, sizes: Array, least_value: float) -> float:
        """The same as `_regular_distance`."""
        return np.inf

    def _least_singular_value(self, jacobian: Array) -> float:
        """The least singular value of J, columns of one size, so that a small link counts as much as a large one."""
        n = jacobian.shape[1] - 1
        if n == 0:
            return 1.0
        return float(np.linalg.svd(jacobian / column_norms(jacobian, MIN_COLUMN_NORM), compute_uv=False)[n - 1])

    def _regular_distance(self, y: Array, tangent: Array, jacobian: Array, least_value: float) -> float:
        """How far along the curve J is known to keep its rank: not asked of a curve that may cross others."""
        return np.inf

    def correct(self, y: Array, normal: Array) -> Array | None:
        """The point of the curve near y in the plane through y with this normal; None where Newton finds none."""

        def step(jacobian: Array | SparseMatrices, residuals: Array) -> Array:
            if isinstance(jacobian, SparseMatrices):
                sparse = _sparse_step(jacobian, residuals, normal)
                if sparse is not None:
                    return sparse
            return _solve_shortest(stack_row(np.asarray(jacobian), normal), append_number(-residuals, 0.0))

        y, gap = correct(self.residuals_and_jacobian, step, y, MAX_CORRECTIONS)
        return y if gap <= CLOSED_TOLERANCE * max(1.0, greatest_size(y)) else None


class SolutionCurve(ImplicitCurve):
    """All positions F(z, start + t way) = 0 near by, as a curve in y = (z, t): dead points are on it as any others.

    Lengths are in sizes of the mechanism, angles in rad. J = dF/dy loses rank at change points.
    """

    def __init__(self, solver: PreparedMechanism, start: Array, direction: Array):
        self.solver, self.functions, self.p = solver, solver.functions, solver.inputs.p
        self.start, self.input_direction = start, direction
        self._is_along_input = len(direction) == 1 and direction[0] == 1.0

    def inputs(self, y: Array) -> Array:
        """The inputs (inputs,) at a point, or at points (points, inputs)."""
        return self.start + y[..., -1:] * self.input_direction

    def unknowns_and_inputs(self, y: Array) -> Array:
        """Unknowns and inputs at a point, as the program takes them."""
        return np.concatenate([y[:-1], self.inputs(y)])

    def widen_direction(self, direction: Array) -> Array:
        """A direction along the curve, as one of unknowns and inputs."""
        return np.concatenate([direction[:-1], direction[-1] * self.input_direction])

    def residuals_and_jacobian(self, y: Array) -> tuple[Array, Array | SparseMatrices]:
        """F (rows,) and J (rows, n + 1)."""
        residuals, jacobian = self.functions.residuals_and_jacobian(y[:-1], self.inputs(y), self.p)
        if self._is_along_input:
            return residuals, jacobian
        if isinstance(jacobian, SparseMatrices):
            return residuals, jacobian.join_last_columns(self.input_direction)
        n = len(y) - 1
        narrow = np.empty((len(jacobian), n + 1))
        narrow[:, :n] = jacobian[:, :n]
        narrow[:, n] = jacobian[:, n:] @ self.input_direction
        return residuals, narrow

    def second_derivative(self, y: Array, direction: Array) -> Array:
        """The second derivative of F along a direction (rows,)."""
        wide = self.widen_direction(direction)
        return self.functions.kinematics(self.unknowns_and_inputs(y), wide, 0.0 * wide, self.p).F2

    def weighted_hessian_products(self, y: Array, weights: Array, directions: Array) -> Array:
        """The second derivatives of sums of the rows of F, each times its weight (rows, sums), times directions
        (n + 1, k): (sums, k, n + 1); of many unknowns by differences of the Jacobian."""
        if not self.functions.is_sparse:
            wide = np.array([self.widen_direction(direction) for direction in directions.T])
            changes = self.functions.formulas.jacobian_changes(self.unknowns_and_inputs(y), wide, self.p)
            of_inputs = changes.shape[2] - len(self.input_direction)
            along = changes[..., of_inputs:] @ self.input_direction[:, None]
            return (weights.T @ np.concatenate([changes[..., :of_inputs], along], axis=2)).swapaxes(0, 1)
        products = []
        for direction in directions.T:
            step = DIFFERENCE_STEP * direction
            ahead, behind = (weights.T @ self.jacobian(place) for place in (y + step, y - step))
            products.append((ahead - behind) / (2.0 * DIFFERENCE_STEP))
        return np.array(products).swapaxes(0, 1)

    def is_closed(self, y: Array) -> bool:
        """Whether a point passes the residual check."""
        return self.solver.max_residual(y[:-1], self.inputs(y)) <= self.solver.tolerance

    def _regular_distance(self, y: Array, tangent: Array, jacobian: Array, least_value: float) -> float:
        """How far along the curve J keeps its rank: until it has changed by its least singular value (Weyl).

        Constraints that nearly depend on one another all along keep J near a singular one, but do not bring it nearer.
        Where Weyl's bound would shorten a step the sharper one is taken, which does not change when constraints are
        combined: J (I + J^+ E) keeps its rank while the norm of J^+ E is below one. (P. Deuflhard, Newton Methods for
        Nonlinear Problems, 2004, sec. 2.1: affine covariance.)
        """
        if len(y) == 1:
            return np.inf
        sizes = column_norms(jacobian, MIN_COLUMN_NORM)
        ahead = np.asarray(self.jacobian(y + DIFFERENCE_STEP * tangent))
        change = (ahead - jacobian) / (sizes * DIFFERENCE_STEP)
        distance = float(singular_distance(least_value, np.linalg.norm(change)))
        if distance >= SHORT_REGULAR_DISTANCE or least_value < ZERO_SINGULAR_VALUE:
            return distance
        relative = np.linalg.lstsq(jacobian / sizes, change, rcond=0.1 * ZERO_SINGULAR_VALUE)[0]
        return max(distance, 1.0 / max(float(np.linalg.norm(relative)), 1e-300))

    def _sparse_regular_distance(self, y: Array, bordered: BorderedJacobian, sizes: Array, least_value: float) -> float:
        jacobian, tangent = bordered.jacobian, bordered.tangent
        ahead = self.jacobian(y + DIFFERENCE_STEP * tangent)
        assert isinstance(ahead, SparseMatrices)
        change = SparseMatrices(jacobian.pattern, (ahead.values - jacobian.values) / DIFFERENCE_STEP)
        distance = float(singular_distance(least_value, np.asarray(length_of(change.divide_columns(sizes).values))))
        if distance >= SHORT_REGULAR_DISTANCE:
            return distance
        return max(distance, 1.0 / max(bordered.relative_change(change, sizes), 1e-300))

    def correct_beside_bifurcation(self, y: Array, rank_loss: int, with_inputs: bool) -> Array:
        """A position beside a change point, closed to round-off but not moved from one branch to the other.

        `rank_loss` is by how much the Jacobian's rank falls at the change point; the inputs move only `with_inputs`.
        """
        n = len(y) - 1
        return correct_at_rank(self.residuals_and_jacobian, y, n - rank_loss, n + with_inputs)


def _sparse_step(jacobian: SparseMatrices, residuals: Array, normal: Array) -> Array | None:
    """The step that closes what is open, normal to a direction; None where it is that of a singular system."""
    try:
        step = BorderedJacobian(jacobian, normal).step(-residuals)
    except ValueError:
        return None
    return step if greatest_size(step) < MAX_SOLVED_STEP else None


def _solve_shortest(system: Array, known: Array) -> Array:
    """The shortest solution in the sense of least squares; straight away where the system is square and regular."""
    if system.shape[0] == system.shape[1]:
        solution = _solve_regular(system, known)
        if solution is not None and greatest_size(solution) < MAX_SOLVED_STEP:
            return solution
    return np.linalg.lstsq(system, known, rcond=1e-14)[0]


def _solve_regular(system: Array, known: Array) -> Array | None:
    """The solution of a square system; None where it is singular to the last bit, as on an exact dead point."""
    try:
        return np.linalg.solve(system, known)
    except np.linalg.LinAlgError:
        return None


def input_axis(size: int) -> Array:
    """The direction (n + 1,) in which the inputs go on while the unknowns rest."""
    return append_number(np.zeros(size - 1), 1.0)


def pair_motions_at(pairs: Sequence[Pair], curve: SolutionCurve, point: CurvePoint) -> Array:
    """Position, first and second derivative by arc length of the relative motions at pairs (pairs, 3), SI."""
    if not pairs:
        return np.zeros((0, 3))
    setup = curve.solver
    rates, second = curve.widen_direction(point.tangent), curve.widen_direction(point.curvature)
    motion = curve.functions.kinematics(curve.unknowns_and_inputs(point.y), rates, second, curve.p)
    bodies = dict.fromkeys(link for pair in pairs for link in pair.bodies)
    joined = {pair.name: setup.pairs[pair.name] for pair in pairs if pair.name in setup.pairs}
    names = [(link, part) for link in bodies for part in FRAME_PARTS]
    names += [(name, part) for name, pair in joined.items() for part, _ in pair.coordinate_kinds]
    columns = [setup.column[name] for name in names if name in setup.column]
    parts = np.stack([motion.w, motion.w1, motion.w2], axis=1)[columns] * setup.scale[columns, None]
    jets = {column: Jet(*rates) for column, rates in zip(columns, parts.tolist(), strict=True)}
    frames, coordinates = frames_from_coordinates(jets, setup.column, bodies, joined)
    motions = [value_and_rates(pair.input_position_at(setup.shapes, frames, coordinates)) for pair in pairs]
    return np.array(motions, dtype=float)


class Arc(NamedTuple):
    """The curve from one point to the next: a polynomial in how far one is along an axis.

    Between two points it is near the curve and `SolutionCurve.correct` carries it there. Beside a change point it is
    the curve to round-off, and nothing can correct it: there the slope is singular. `rank_loss` is how much rank it
    lacks at that change point, and 0 where there is none.
    """

    before: CurvePoint
    after: CurvePoint
    origin: Array
    axis: Array
    unit_length: float
    coefficients: Array
    "coefficients (degree + 1, n + 1), of powers of the distance over `unit_length`"
    rank_loss: int

    @property
    def is_exact(self) -> bool:
        """Whether the polynomial is the curve to round-off."""
        return self.rank_loss > 0

    @property
    def ends(self) -> tuple[float, float]:
        """How far its two ends are along the axis."""
        return self.place(self.before.y), self.place(self.after.y)

    def place(self, y: Array) -> float:
        """How far a point is along the axis."""
        return float(self.axis @ (y - self.origin))

    def polynomial(self, x: float, order: int = 0) -> Array:
        """The polynomial, or a derivative of it (n + 1,), so far along the axis."""
        shape = self.coefficients
        for _ in range(order):
            shape = shape[1:] * np.arange(1, len(shape))[:, None] / self.unit_length
        return ((x / self.unit_length) ** np.arange(len(shape))) @ shape

    def input_position(self, x: float) -> float:
        """How far the inputs are on their way so far along the axis, by the polynomial."""
        part, value = x / self.unit_length, 0.0
        for coefficient in reversed(self.coefficients[:, -1].tolist()):
            value = value * part + coefficient
        return value

    def curve_coordinates(self, curve: SolutionCurve, x: float) -> Array:
        """The point of the curve so far along the axis (n + 1,)."""
        rough = self.polynomial(x)
        if self.is_exact:
            return curve.correct_beside_bifurcation(rough, self.rank_loss, with_inputs=True)
        y = curve.correct(rough, self.axis)
        return rough if y is None else y

    def point_at(self, curve: SolutionCurve, x: float, with_distance: bool = True) -> CurvePoint:
        """The point of the curve so far along the axis, with its tangent; see `ImplicitCurve.point_at`."""
        y = self.curve_coordinates(curve, x)
        if not self.is_exact:
            return curve.point_at(y, self.before.tangent, with_distance)
        first, second = self.polynomial(x, 1), self.polynomial(x, 2)
        speed = float(np.linalg.norm(first))
        tangent = first / speed
        curvature = (second - tangent * (tangent @ second)) / speed**2
        sense = 1.0 if tangent @ self.before.tangent >= 0.0 else -1.0
        return CurvePoint(y, sense * tangent, curvature, 0.0)


def arc_between(before: CurvePoint, after: CurvePoint) -> Arc:
    """The arc between two points: the polynomial of fifth degree with their tangents and second derivatives."""
    chord = after.y - before.y
    length = length_of(chord)
    axis = chord / length
    shape = fit_polynomial((before, after), axis, (0.0, 1.0), length)
    return Arc(before, after, before.y, axis, length, shape, 0)


def fit_polynomial(
    points: tuple[CurvePoint, ...], axis: Array, positions: tuple[float, ...], unit_length: float
) -> Array:
    """Coefficients of the polynomial through points at these places (times half) along an axis from the origin."""
    rows = []
    for point in points:
        speed, change = float(axis @ point.tangent), float(axis @ point.curvature)
        first = point.tangent / speed
        rows += [point.y, first * unit_length, (point.curvature - first * change) / speed**2 * unit_length**2]
    return np.linalg.solve(_hermite_matrix(positions), np.array(rows))


@cache
def _hermite_matrix(places: tuple[float, ...]) -> Array:
    """Values, first and second derivatives of the powers at the places (3 places, powers)."""
    powers = range(3 * len(places))
    rows = [[perm(k, order) * x ** max(k - order, 0) for k in powers] for x in places for order in range(3)]
    return np.array(rows, dtype=float)
