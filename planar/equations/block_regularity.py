"""How regular blocks are, as casadi expressions: bounds of singular values, and how far they hold."""

from __future__ import annotations

import casadi as ca
import numpy as np

from planar.equations.elimination import stack_expressions
from planar.equations.rates import UnknownRates
from planar.equations.symbolic_equations import slice_length

MAX_SIGNED_SIZE = 4
"""Unknowns of a block whose determinant is written in expressions."""


def regular_distances(rates: UnknownRates, along: ca.SX) -> tuple[ca.SX, ca.SX]:
    """The least singular value of any block, and how far along a direction of y each block is regular (blocks,).

    The distances have the sign of the block's determinant, where it is small enough to be written: on one branch it
    stays the same, and of two assemblies that a dead point brings together one has the other.
    """
    least, distances = ca.SX(1.0), []
    for block, jacobian in zip(rates.equations.blocks, rates.jacobians, strict=True):
        if not slice_length(block.unknowns):
            distances.append(ca.SX(np.inf))
            continue
        value, distance = _regular_distance(jacobian, rates.y, along)
        least = ca.fmin(least, value)
        distances.append(distance)
    return least, stack_expressions(distances)


def greatest_entry(values: ca.SX) -> ca.SX:
    """The greatest of a column of numbers from zero on."""
    found = ca.SX(0.0)
    for value in ca.vertsplit(values) if values.numel() else []:
        found = ca.fmax(found, value)
    return found


def regularity_bound(block: ca.SX, row_scale: ca.SX, column_floor: ca.SX) -> ca.SX:
    """No more than the regularity of a block, see `solving.rates.regularity`."""
    scaled = block / ca.repmat(row_scale, 1, block.size2())
    sizes = [ca.fmax(ca.norm_2(scaled[:, k]), column_floor[k]) for k in range(block.size2())]
    low, high = _singular_value_bounds(scaled / ca.repmat(ca.horzcat(*sizes), block.size1(), 1))
    return low / ca.fmax(1.0, high)


def _singular_value_bounds(matrix: ca.SX) -> tuple[ca.SX, ca.SX]:
    """No more than the least singular value of a square matrix, and no less than the greatest; of two by two exact."""
    if matrix.numel() == 1:
        return ca.fabs(matrix), ca.fabs(matrix)
    square = ca.sumsqr(matrix)
    if matrix.numel() == 4:
        det = ca.fabs(matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0])
        greatest = ca.sqrt(0.5 * (square + ca.sqrt(ca.fmax(square * square - 4.0 * det * det, 0.0))))
        return det / greatest, greatest
    # the inverse is as large as that of the triangle
    inverse = ca.solve(ca.qr(matrix)[1], ca.SX.eye(matrix.size1()))
    return 1.0 / ca.norm_fro(inverse), ca.sqrt(square)


def _regular_distance(block: ca.SX, y: ca.SX, direction: ca.SX) -> tuple[ca.SX, ca.SX]:
    """No more than the least singular value of a block, columns of one size, and how far along a direction it is one at
    least (Weyl), see `solving.checks.branch_check`."""
    change = ca.reshape(ca.jtimes(ca.vec(block), y, direction), block.shape)
    sizes = ca.horzcat(*(ca.norm_2(block[:, k]) for k in range(block.size2())))
    whole = ca.repmat(sizes, block.size1(), 1)
    value = _singular_value_bounds(block / whole)[0]
    distance = value / ca.fmax(ca.norm_fro(change / whole), 1e-300)
    if block.size1() > MAX_SIGNED_SIZE:
        return value, distance
    return value, ca.if_else(ca.det(block / whole) < 0.0, -distance, distance)
