"""The motion of a block type: its coordinates with their rates, and how regular it is: bounds of singular values, and
how far they hold. As one formula, or by matrices of numbers for a block of many unknowns."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from planar.equations.elimination import stack_expressions
from planar.equations.linear import solve_vectors
from planar.equations.sparse_matrices import SparseMatrices
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.arrays import Array
from planar.foundation.lazy_module import LazyModule
from planar.foundation.recorded_formula import RecordedFormula

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # matrices of numbers do without expressions

MAX_CSE_NODES = 30_000
"""Of expressions in which what stands in several places is looked for: the time for that grows faster than they do, and
what it saves is little."""
DIFFERENCE_STEP = 1e-6
"""The part of a step over which the change of a Jacobian is taken."""


def derive_block_motion(e: ConstraintEquations) -> RecordedFormula:
    """The formula of equations that are one block, of which u are the coordinates that are known ahead.

    (z, u, u1, u2, p, row scale, column floor) -> w, w1, w2, F, then the regularity (see
    `PreparedMechanism.jacobian_regularity`) and the least singular value, no more than they are, by how much round-off
    is greater in the rates, and how far in such steps as u1 the block is regular, with the sign of its determinant.
    """
    from planar.equations.casadi_functions import recorded_function
    from planar.equations.rates import UnknownRates, first_and_second_rates

    u1, u2 = (ca.SX.sym(name, e.u.numel()) for name in ("u1", "u2"))
    row_scale, column_floor = ca.SX.sym("by", e.F.numel()), ca.SX.sym("least", e.z.numel())
    rates = UnknownRates(e)
    z1, z2 = rates.first_and_second(u1, u2)
    w1, w2 = first_and_second_rates(e.w, rates.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))
    regularity, least, loss, distance = ca.SX(1.0), ca.SX(1.0), ca.SX(1.0), ca.SX(np.inf)
    if e.z.numel():
        (jacobian,) = rates.jacobians
        regularity = ca.fmin(regularity, regularity_bound(jacobian, row_scale, column_floor))
        for k in range(jacobian.size2()):
            loss = ca.fmax(loss, 1.0 / (ca.norm_2(jacobian[:, k]) * regularity * regularity))
        least, distance = regular_distance(jacobian, rates.y, ca.vertcat(z1, u1))
    motion = stack_expressions([e.w, w1, w2, e.F, regularity, ca.fmin(least, 1.0), loss, distance])
    results = [ca.densify(motion)]
    if ca.n_nodes(results[0]) <= MAX_CSE_NODES:
        results = ca.cse(results)
    arguments = [e.z, e.u, u1, u2, e.p, row_scale, column_floor]
    return recorded_function(ca.Function("motion", arguments, results))


def regularity_bound(block: ca.SX, row_scale: ca.SX, column_floor: ca.SX) -> ca.SX:
    """No more than the regularity of a block, see `PreparedMechanism.jacobian_regularity`."""
    scaled = block / ca.repmat(row_scale, 1, block.size2())
    sizes = [ca.fmax(ca.norm_2(scaled[:, k]), column_floor[k]) for k in range(block.size2())]
    low, high, _ = _singular_value_bounds(scaled / ca.repmat(ca.horzcat(*sizes), block.size1(), 1))
    return low / ca.fmax(1.0, high)


def _singular_value_bounds(matrix: ca.SX) -> tuple[ca.SX, ca.SX, ca.SX]:
    """No more than the least singular value of a square matrix, and no less than the greatest; of two by two exact. And
    the sign of the determinant."""
    if matrix.numel() == 1:
        return ca.fabs(matrix), ca.fabs(matrix), _sign(matrix)
    square = ca.sumsqr(matrix)
    if matrix.numel() == 4:
        det = matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
        greatest = ca.sqrt(0.5 * (square + ca.sqrt(ca.fmax(square * square - 4.0 * det * det, 0.0))))
        return _or_singular(ca.fabs(det) / greatest), greatest, _sign(det)
    # the inverse is as large as that of the triangle
    triangle, sign = reduce_to_triangle(matrix)
    inverse = ca.solve(triangle, ca.SX.eye(matrix.size1()))
    return _or_singular(1.0 / ca.norm_fro(inverse)), ca.sqrt(square), sign


def _inverse_or_none(value: ca.SX) -> ca.SX:
    """1 by a number; none where it is none, so that a column without length is left as it is."""
    return ca.if_else(value > 0.0, 1.0 / value, 0.0)


def _or_singular(bound: ca.SX) -> ca.SX:
    """A bound on a singular value; where it is no number, which `fmin` would pass over, none."""
    return ca.if_else(bound >= 0.0, bound, 0.0)


def _sign(value: ca.SX) -> ca.SX:
    """-1 below zero, else 1."""
    return ca.if_else(value < 0.0, -1.0, 1.0)


def reduce_to_triangle(matrix: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The triangle R of a square matrix Q R, and the sign of its determinant: A. Householder's reflections, of which
    each turns the sign over. They need no pivot; where nothing stands below the diagonal there is none."""
    count = matrix.size1()
    rows = [[matrix[i, j] for j in range(count)] for i in range(count)]
    sign = ca.SX(1.0)
    for k in range(count - 1):
        below = [i for i in range(k + 1, count) if not rows[i][k].is_zero()]
        if below:
            corner, used = rows[k][k], [k, *below]
            away = _sign(corner)
            length = ca.sqrt(sum((rows[i][k] ** 2 for i in below), corner**2))
            normal = {k: corner + away * length} | {i: rows[i][k] for i in below}
            scale = _inverse_or_none(length * (length + ca.fabs(corner)))
            for j in range(k + 1, count):
                along = sum((normal[i] * rows[i][j] for i in used if not rows[i][j].is_zero()), ca.SX(0.0))
                if not along.is_zero():
                    along = along * scale
                    for i in used:
                        rows[i][j] = rows[i][j] - normal[i] * along
            rows[k][k] = -away * length
            for i in below:
                rows[i][k] = ca.SX(1, 1)
            sign = -sign
        sign = sign * _sign(rows[k][k])
    sign = sign * _sign(rows[-1][-1])
    return ca.vertcat(*(ca.horzcat(*row) for row in rows)), sign


def regular_distance(block: ca.SX, y: ca.SX, direction: ca.SX) -> tuple[ca.SX, ca.SX]:
    """No more than the least singular value of a block, columns of one size, and how far along a direction it is one at
    least (Weyl), see `solving.continuation.fast_path`.

    The distance has the sign of the block's determinant: on one branch it stays the same, and of two assemblies that a
    dead point brings together one has the other.
    """
    change = ca.reshape(ca.jtimes(ca.vec(block), y, direction), block.shape)
    sizes = ca.horzcat(*(ca.norm_2(block[:, k]) for k in range(block.size2())))
    lengths = ca.repmat(sizes, block.size1(), 1)
    value, _, sign = _singular_value_bounds(block / lengths)
    return value, sign * value / ca.fmax(ca.norm_fro(change / lengths), 1e-300)


class LargeBlockMotion:
    """The motion of equations that are one block, see `derive_block_motion`."""

    def __init__(self, e: ConstraintEquations):
        assert e.assembled is not None
        self._assembled = e.assembled

    def evaluate_entries(self, count: int, *arguments: Array) -> Array:
        """The results (results, positions) of arguments (entries, positions) or (entries,)."""
        z, u, u1, u2 = (argument.T for argument in arguments[:4])
        numbers, row_scale, column_floor = arguments[4:]
        y, rest = np.hstack([z, u]), np.zeros_like(z)
        residuals, _, entries = self._assembled.kinematics(y, np.hstack([rest, u1]), np.hstack([rest, u2]), numbers)
        jacobians = self._jacobians(entries, z.shape[1])
        z1 = -solve_vectors(jacobians, residuals[:, 1])
        y1 = np.hstack([z1, u1])
        residuals, _, _ = self._assembled.kinematics(y, y1, np.hstack([rest, u2]), numbers)
        z2 = -solve_vectors(jacobians, residuals[:, 2])
        residuals, coordinates, _ = self._assembled.kinematics(y, y1, np.hstack([z2, u2]), numbers)
        bounds = self._bounds(y, y1, numbers, jacobians, row_scale, column_floor)
        return np.vstack([coordinates.reshape(count, -1).T, residuals[:, 0].T, bounds])

    def _jacobians(self, entries: Array, unknown_count: int) -> Array:
        both: Array = np.asarray(SparseMatrices(self._assembled.pattern, entries))
        return both[..., :unknown_count]

    def _bounds(
        self, y: Array, y1: Array, numbers: Array, jacobians: Array, row_scale: Array, column_floor: Array
    ) -> Array:
        """Regularity, least singular value, loss by round-off and distance (4, positions)."""
        scaled = jacobians / row_scale[:, None]
        sizes = np.maximum(np.linalg.norm(scaled, axis=-2), column_floor)
        values = _singular_values(scaled / sizes[:, None])
        regularity = np.minimum(values[:, -1] / np.maximum(1.0, values[:, 0]), 1.0)
        lengths = np.linalg.norm(jacobians, axis=-2)
        loss = np.maximum(1.0 / (lengths.min(axis=1) * regularity * regularity), 1.0)
        columns = jacobians / lengths[:, None]
        least = np.minimum(_singular_values(columns)[:, -1], 1.0)
        nudge = DIFFERENCE_STEP / np.maximum(np.abs(y1).max(axis=1, initial=0.0), DIFFERENCE_STEP)
        split = jacobians.shape[-1]
        moved = y + nudge[:, None] * y1
        _, entries = self._assembled.residuals_and_jacobians(moved[:, :split], moved[:, split:], numbers)
        ahead = self._jacobians(entries, split)
        change = np.linalg.norm((ahead - jacobians) / lengths[:, None], axis=(1, 2)) / nudge
        with np.errstate(invalid="ignore"):
            signs = np.linalg.slogdet(np.nan_to_num(jacobians))[0]
        return np.stack(
            [regularity, least, loss, np.where(signs < 0.0, -1.0, 1.0) * least / np.maximum(change, 1e-300)]
        )


def _singular_values(matrices: Array) -> Array:
    """The singular values (positions, values), the greatest first; zero of what is not a number."""
    finite: Array = matrices.copy()
    finite[~np.isfinite(matrices).all(axis=(1, 2))] = 0.0
    values: Array = np.linalg.svd(finite, compute_uv=False)
    return values
