"""How regular blocks are, as casadi expressions: bounds of singular values, and how far they hold."""

from __future__ import annotations

import casadi as ca


def regularity_bound(block: ca.SX, row_scale: ca.SX, column_floor: ca.SX) -> ca.SX:
    """No more than the regularity of a block, see `solving.rates.regularity`."""
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
    least (Weyl), see `solving.checks.branch_check`.

    The distance has the sign of the block's determinant: on one branch it stays the same, and of two assemblies that a
    dead point brings together one has the other.
    """
    change = ca.reshape(ca.jtimes(ca.vec(block), y, direction), block.shape)
    sizes = ca.horzcat(*(ca.norm_2(block[:, k]) for k in range(block.size2())))
    whole = ca.repmat(sizes, block.size1(), 1)
    value, _, sign = _singular_value_bounds(block / whole)
    return value, sign * value / ca.fmax(ca.norm_fro(change / whole), 1e-300)
