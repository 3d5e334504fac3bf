"""Normal equations of rows of several kinds in the free numbers and the zeros of scales, every entry eliminated."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.fitting.wanted_equations import DAMPING_ALONG, LinearRows, WantedEquations


class GlobalNumbers:
    """The free numbers, then the zeros of scales that each kind of rows seeks."""

    def __init__(self, equations: Sequence[WantedEquations], many_free: int):
        self.free = at = many_free
        self.zero_columns: list[IntArray] = []
        for each in equations:
            self.zero_columns.append(np.arange(at, at + each.zero_count))
            at += each.zero_count
        self.size = at

    def columns(self, k: int) -> IntArray:
        """Those that rows of the kind k depend on."""
        return np.concatenate([np.arange(self.free), self.zero_columns[k]])


class InputChanges(NamedTuple):
    """How the inputs of all entries, one kind of rows after the other, change in a step: by themselves, and with the
    globals; and which are the least and the greatest."""

    own: Array
    "(designs, n)"
    slopes: Array
    "(designs, n, globals)"
    ends: IntArray
    "(designs, 2)"

    def between(self, design: IntArray, share: Array) -> tuple[Array, Array]:
        """The same (k,) and (k, globals) at shares (k,) of the range of designs (k,)."""
        parts, at = np.stack([1.0 - share, share], axis=1), self.ends[design]
        own, slopes = self.own[design[:, None], at], self.slopes[design[:, None], at]
        return np.sum(parts * own, axis=1), np.einsum("ke,kei->ki", parts, slopes)


def normal_equations(
    equations: Sequence[WantedEquations], lines: Sequence[LinearRows], numbers: GlobalNumbers
) -> tuple[Array, Array]:
    """The matrices (designs, size, size) and the slopes (designs, size) of half the sum of squares."""
    normal = np.zeros((len(lines[0].residual), numbers.size, numbers.size))
    for k, (each, line) in enumerate(zip(equations, lines, strict=True)):
        at = numbers.columns(k)
        own = np.einsum("cnpi,cnpj->cij", line.slopes, line.slopes, optimize=True)
        if not each.is_timed:
            size_along = np.sum(line.along**2, axis=-1) + DAMPING_ALONG
            across = np.einsum("cnpi,cnp->cni", line.slopes, line.along)
            own -= np.einsum("cni,cnj,cn->cij", across, across, 1.0 / size_along, optimize=True)
        normal[:, at[:, None], at] += own
    return normal, half_slopes(equations, lines, [line.residual for line in lines], numbers)


def half_slopes(
    equations: Sequence[WantedEquations],
    lines: Sequence[LinearRows],
    residuals: Sequence[Array],
    numbers: GlobalNumbers,
) -> Array:
    """The slopes (designs, size) of half the squares of residuals (designs, n, parts) that change as lines do."""
    slope = np.zeros((len(residuals[0]), numbers.size))
    for k, (each, line, residual) in enumerate(zip(equations, lines, residuals, strict=True)):
        slope[:, numbers.columns(k)] += np.einsum("cnpi,cnp->ci", line.slopes, _across(each, line, residual))
    return slope


def _across(equations: WantedEquations, line: LinearRows, residual: Array) -> Array:
    """Residuals (designs, n, parts) without their part along the path, where an entry may go along it."""
    if equations.is_timed:
        return residual
    along = np.einsum("cnp,cnp->cn", line.along, residual) / (np.sum(line.along**2, axis=-1) + DAMPING_ALONG)
    found: Array = residual - line.along * along[..., None]
    return found


def predicted_residuals(equations: WantedEquations, line: LinearRows, change: Array) -> Array:
    """What a change of the globals of its rows (designs, own) leaves of the residuals, to the first order."""
    return _across(equations, line, line.residual + np.einsum("cnpi,ci->cnp", line.slopes, change))


def exact_rows(
    equations: Sequence[WantedEquations],
    lines: Sequence[LinearRows],
    numbers: GlobalNumbers,
    every_item: bool = False,
) -> tuple[Array, Array]:
    """Rows (designs, k) and slopes (designs, k, globals) of what is to be met exactly, or of every item, without their
    part along."""
    many = len(lines[0].residual)
    rows, slopes = [np.zeros((many, 0))], [np.zeros((many, 0, numbers.size))]
    for k, (each, line) in enumerate(zip(equations, lines, strict=True)):
        if each.rows.wanted.tolerance != 0.0 and not every_item:
            continue
        both = np.concatenate([line.residual[..., None], line.slopes], axis=-1)
        if not each.is_timed:
            size_along = np.sum(line.along**2, axis=-1) + DAMPING_ALONG
            both = (
                both
                - line.along[..., None]
                * np.einsum("cnp,cnpi,cn->cni", line.along, both, 1.0 / size_along, optimize=True)[:, :, None]
            )
        both = both.reshape(many, -1, both.shape[-1])
        wide = np.zeros((*both.shape[:2], numbers.size))
        wide[..., numbers.columns(k)] = both[..., 1:]
        rows.append(both[..., 0])
        slopes.append(wide)
    return np.concatenate(rows, axis=1), np.concatenate(slopes, axis=1)


def entry_moves(equations: WantedEquations, line: LinearRows, change: Array) -> Array:
    """How each entry's unknowns change (designs, n, unknowns) with the globals of its rows (designs, own)."""
    moves: Array = line.own + np.einsum("cnyi,ci->cny", line.own_slopes, change)
    if not equations.is_timed:
        left = line.residual + np.einsum("cnpi,ci->cnp", line.slopes, change)
        along = -np.einsum("cnp,cnp->cn", line.along, left) / (np.sum(line.along**2, axis=-1) + DAMPING_ALONG)
        moves = moves + line.tangent * along[..., None]
    return moves


def input_changes(
    equations: Sequence[WantedEquations],
    lines: Sequence[LinearRows],
    unknowns: Sequence[Array],
    numbers: GlobalNumbers,
) -> InputChanges:
    """How the inputs of entries change; see `entry_moves`."""
    owns, slopes = [], []
    for k, (each, line) in enumerate(zip(equations, lines, strict=True)):
        own, slope = line.own[..., -1], line.own_slopes[..., -1, :]
        if not each.is_timed:
            rate = line.tangent[..., -1] / (np.sum(line.along**2, axis=-1) + DAMPING_ALONG)
            own = own - rate * np.einsum("cnp,cnp->cn", line.along, line.residual)
            slope = slope - rate[..., None] * np.einsum("cnp,cnpi->cni", line.along, line.slopes)
        wide = np.zeros((*own.shape, numbers.size))
        wide[..., numbers.columns(k)] = slope
        owns.append(own)
        slopes.append(wide)
    inputs = np.concatenate([each[..., -1] for each in unknowns], axis=1)
    ends = np.stack([np.argmin(inputs, axis=1), np.argmax(inputs, axis=1)], axis=1)
    return InputChanges(np.concatenate(owns, axis=1), np.concatenate(slopes, axis=1), ends)


def solve_damped(normal: Array, slope: Array, damping: Array, numbers: Array, lower: Array, upper: Array) -> Array:
    """The change of the globals; a number on its bound that would leave it stays. NaN where nothing is known."""
    free, size = numbers.shape[1], slope.shape[1]
    held = np.zeros(slope.shape, bool)
    bad: BoolArray = np.asarray(~(np.isfinite(normal).all(axis=(1, 2)) & np.isfinite(slope).all(axis=1)))
    normal, slope = np.where(bad[:, None, None], np.eye(size), normal), np.where(bad[:, None], 0.0, slope)
    damped = damped_matrices(normal, damping)
    for _ in range(2):
        matrix = np.where(held[:, :, None] | held[:, None, :], 0.0, damped) + held[:, :, None] * np.eye(size)
        change = solve_symmetric(matrix, np.where(held, 0.0, -slope))
        wanted = numbers + change[:, :free]
        out = ((wanted < lower) & (numbers <= lower)) | ((wanted > upper) & (numbers >= upper))
        if not (out & ~held[:, :free]).any():
            break
        held[:, :free] |= out
    change[bad] = np.nan
    return change


def damped_matrices(normal: Array, damping: Array) -> Array:
    """Normal matrices with so much of their diagonal more."""
    diagonal = np.einsum("cii->ci", normal)
    floor = 1e-9 * diagonal.max(axis=1, keepdims=True) + np.finfo(float).tiny
    found: Array = normal + (damping[:, None] * np.maximum(diagonal, floor))[:, :, None] * np.eye(normal.shape[1])
    return found


def solve_symmetric(matrices: Array, right: Array) -> Array:
    """The solutions (n, size) of symmetric systems; that of least size of one which is singular to the last digit."""
    try:
        found: Array = np.linalg.solve(matrices, right[..., None])[..., 0]
    except np.linalg.LinAlgError:
        found = np.empty_like(right)
        for k, (matrix, side) in enumerate(zip(matrices, right, strict=True)):
            try:
                found[k] = np.linalg.solve(matrix, side)
            except np.linalg.LinAlgError:
                found[k] = np.linalg.pinv(matrix, rcond=1e-14, hermitian=True) @ side
    return found
