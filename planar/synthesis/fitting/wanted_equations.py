"""What is wanted of a mechanism as rows that are to be zero, linear in its free numbers alone.

Wanted entry i has unknowns of its own: z_i of the mechanism, and the position u_i of its running input. They keep

    F(z_i, u_i, d) = 0

and give a result r(z_i, u_i, d), which is to be w_i. To the first order, where K is the Jacobian of F in (z, u) with a
row c below that keeps it square,

    (dz, du) = -K^-1 (F + F_d dd) + t s,   t = K^-1 (0, 1)

so that r(z, u, d) depends on dd and one number s, how far the entry goes along the path. Where the input is not given
s is eliminated (Schur's complement), and with c along the path this holds at dead points of the input too. Where the
input is given c is the input's own row, and s is the same for all: the zero of its scale.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.equations.casadi_functions import BufferedFunction
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.model.mechanism import Mechanism
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction
from planar.synthesis.task.wanted_results import wanted_expression, wanted_results

DAMPING_ALONG = 1e-12
"""Of the squared size of the results: how much going along a path counts, where a result does not change along it."""


class WantedRows(NamedTuple):
    """Entries (n) that are wanted of one result (parts), in units in which a miss of one counts alike."""

    wanted: Wanted
    values: Array
    "(n, parts) SI"
    inputs: Array | None
    "(n,) of the running input (rad or m), where they are given"
    weights: Array
    "(n,)"
    scales: Array
    "(parts,): what a miss of one is in SI"
    input_is_free: bool
    "whether the zero of the given inputs is sought"
    value_is_free: bool
    "whether the zero of the values is sought"


class LinearRows(NamedTuple):
    """Rows of designs (designs, ...) to the first order, and what is to be done to each entry's unknowns."""

    residual: Array
    "(designs, n, parts)"
    slopes: Array
    "(designs, n, parts, globals)"
    along: Array
    "(designs, n, parts): by s"
    own: Array
    "(designs, n, unknowns): what closes the equations"
    own_slopes: Array
    "(designs, n, unknowns, globals)"
    tangent: Array
    "(designs, n, unknowns)"


class WantedEquations:
    """Rows of one kind of wanted entries of mechanisms that differ in free numbers.

    Unknowns of an entry are y = (z, u); `globals` are the free numbers, then the zeros of scales that are sought.
    """

    def __init__(self, mechanism: Mechanism, rows: WantedRows, free: Sequence[str], unit: float):
        self.design: DesignEquations = design_equations(mechanism)
        self.rows, self.free, self.unit = rows, tuple(free), unit
        design = self.design
        self.result = wanted_expression(design, rows.wanted) / ca.DM(rows.scales)
        self.z_count = design.z.numel()
        kinds = {dimension.name: dimension.kind for dimension in design.dimensions}
        self.scale = np.array([unit if kinds[name] == "length" else 1.0 for name in free])
        "SI of one of each free number"
        self.input_scale = float(design.input_scale[0])
        self.zero_count = int(rows.input_is_free) + int(rows.value_is_free)
        self.target = rows.values / rows.scales

    @property
    def is_timed(self) -> bool:
        """Whether the running input is given at every entry."""
        return self.rows.inputs is not None

    def _function(self, outputs: list[ca.SX]) -> BufferedFunction:
        y, x, (F, *rest) = in_entries(self.design, self.free, self.scale, outputs)
        found = [F, ca.jacobian(F, y)]
        for r in rest:
            found += [ca.jacobian(F, x), r, ca.jacobian(r, y), ca.jacobian(r, x)]
        return BufferedFunction(ca.Function("wanted", [y, x], [ca.densify(each) for each in found]))

    @cached_property
    def closure(self) -> BufferedFunction:
        """F and its Jacobian in y."""
        return self._function([self.design.F])

    @cached_property
    def whole(self) -> BufferedFunction:
        """Those, F's Jacobian in x, and the result with its Jacobians in y and x."""
        return self._function([self.design.F, self.result])

    def closure_at(self, x: Array, y: Array) -> tuple[Array, Array]:
        """The equations (designs, n, unknowns - 1), and their Jacobian in each entry's unknowns."""
        F, jacobian = self._at(self.closure, x, y)
        return F, jacobian

    def closure_slopes_at(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """The equations, and their Jacobians in each entry's unknowns and in the free numbers."""
        F, F_y, F_x, *_ = self._at(self.whole, x, y)
        return F, F_y, F_x

    def slopes_at(self, x: Array, y: Array) -> tuple[tuple[Array, Array, bool], ...]:
        """The Jacobians of the equations, then of the result (True), in each entry's unknowns and in the numbers."""
        _, F_y, F_x, _, r_y, r_x = self._at(self.whole, x, y)
        return (F_y, F_x, False), (r_y, r_x, True)

    def values(self, x: Array, y: Array) -> Array:
        """The result (designs, n, parts), in units of its scales; NaN where unknowns are."""
        many, entries, _ = y.shape
        known = np.isfinite(y).all(axis=2)
        values = np.full((many, entries, len(self.rows.scales)), np.nan)
        values[known] = self._value.evaluate_batch(int(known.sum()), y[known], x[np.nonzero(known)[0]])[0][:, 0]
        return values

    @cached_property
    def _value(self) -> BufferedFunction:
        y, x, (result,) = in_entries(self.design, self.free, self.scale, [self.result])
        return BufferedFunction(ca.Function("value", [y, x], [ca.densify(result)]))

    def jacobians(self, x: Array, y: Array) -> Array:
        """Of the equations in each entry's unknowns (designs, n, unknowns - 1, unknowns)."""
        return self._at(self.closure, x, y)[1]

    def tangents_near(self, x: Array, y: Array, before: Array) -> Array:
        """The unit vectors along the path (designs, n, unknowns), in the sense of those that are near."""
        jacobian = self.jacobians(x, y)
        matrix = np.concatenate([jacobian, before[:, :, None, :]], axis=2)
        right = np.zeros((*matrix.shape[:3], 1))
        right[..., -1, 0] = 1.0
        found = solve_rows(matrix, right)[..., 0]
        unit: Array = found / np.linalg.norm(found, axis=-1, keepdims=True)
        return unit

    def close(self, x: Array, y: Array, tangent: Array, steps: int) -> tuple[Array, BoolArray]:
        """Unknowns (designs, n, unknowns) that keep the equations, near given ones, and which designs have them.

        Newton's steps square to `tangent`, or with the input kept where it is given."""
        for step in range(steps + 1):
            F, jacobian = self._at(self.closure, x, y)
            worst = np.abs(F).max(axis=(1, 2), initial=0.0)
            if step == steps or bool((worst[np.isfinite(worst)] < CLOSED).all()):
                break
            K = self._bordered(jacobian, tangent)
            right = np.concatenate([F, np.zeros((*F.shape[:2], 1))], axis=2)
            y = y - np.clip(solve_rows(K, right[..., None])[..., 0], -MAX_CLOSING_STEP, MAX_CLOSING_STEP)
        return y, np.asarray(worst < CLOSED)

    def residuals(self, x: Array, y: Array, zeros: Array) -> Array:
        """The rows (designs, n, parts) without derivatives."""
        _, _, _, r, _, _ = self._at(self.whole, x, y)
        return (r - self.wanted_values(zeros)) * self.rows.weights[:, None]

    def wanted_values(self, zeros: Array) -> Array:
        """The results that are wanted (designs, n, parts), by the zeros of scales (designs, zeros)."""
        target = np.broadcast_to(self.target, (len(zeros), *self.target.shape))
        if not self.rows.value_is_free:
            return target
        moved: Array = target + zeros[:, -1, None, None]
        return moved

    def linearise(self, x: Array, y: Array, zeros: Array, tangent: Array) -> LinearRows:
        """The rows to the first order, at free numbers x (designs, free), unknowns y and zeros of scales."""
        F, F_y, F_x, r, r_y, r_x = self._at(self.whole, x, y)
        weights = self.rows.weights[:, None]
        residual = (r - self.wanted_values(zeros)) * weights
        r_y, r_x = r_y * weights[..., None], r_x * weights[..., None]
        K = self._bordered(F_y, tangent)
        many, entries, closures = F.shape
        right = np.zeros((many, entries, closures + 1, 2 + F_x.shape[-1]))
        right[:, :, :-1, 0], right[:, :, -1, 1], right[:, :, :-1, 2:] = F, 1.0, F_x
        solved = solve_rows(K, right)
        own, along, own_slopes = -solved[..., 0], solved[..., 1], -solved[..., 2:]
        residual = residual + np.einsum("cnpy,cny->cnp", r_y, own)
        slopes = r_x + r_y @ own_slopes
        moving = np.einsum("cnpy,cny->cnp", r_y, along)
        if self.rows.input_is_free:
            slopes = np.concatenate([slopes, moving[..., None]], axis=-1)
            own_slopes = np.concatenate([own_slopes, along[..., None]], axis=-1)
        if self.rows.value_is_free:
            ones = np.broadcast_to(-weights[..., None], (*moving.shape, 1))
            slopes = np.concatenate([slopes, ones], axis=-1)
            own_slopes = np.concatenate([own_slopes, np.zeros((*along.shape, 1))], axis=-1)
        return LinearRows(residual, slopes, moving, own, own_slopes, along)

    def _bordered(self, jacobian: Array, tangent: Array) -> Array:
        row = tangent[:, :, None, :]
        if self.is_timed:
            row = np.zeros((*jacobian.shape[:2], 1, jacobian.shape[3]))
            row[..., -1] = 1.0
        return np.concatenate([jacobian, row], axis=2)

    def _at(self, function: BufferedFunction, x: Array, y: Array) -> list[Array]:
        """What a function gives (designs, n, rows[, columns])."""
        many, entries, unknowns = y.shape
        rows = np.repeat(x, entries, axis=0)
        told = function.evaluate_batch(many * entries, y.reshape(-1, unknowns), rows)
        found = []
        for k, part in enumerate(told):
            shaped = part.reshape(many, entries, *part.shape[1:]).swapaxes(-1, -2)
            found.append(shaped[..., 0] if k in VECTORS else shaped)
        return found


def in_entries(
    design: DesignEquations, free: Sequence[str], scale: Array, outputs: list[ca.SX]
) -> tuple[ca.SX, ca.SX, list[ca.SX]]:
    """Symbols of an entry's unknowns y and of the free numbers x, in units of a `scale`, and expressions in them."""
    z_count = design.z.numel()
    x, y = ca.SX.sym("x", len(free)), ca.SX.sym("y", z_count + 1)
    names = [dimension.name for dimension in design.dimensions]
    d = ca.SX(ca.DM([dimension.value for dimension in design.dimensions]))
    for k, name in enumerate(free):
        d[names.index(name)] = x[k] * scale[k]
    u = ca.vertcat(y[-1] * float(design.input_scale[0]), *(drive.position for drive in design.mechanism.inputs[1:]))
    zero = ca.SX.zeros(design.u1.numel())
    given = [design.z, design.u, design.u1, design.u2, design.d]
    return y, x, ca.substitute(outputs, given, [y[:z_count], u, zero, zero, d])


CLOSED = 1e-10
"""Greatest residual of equations that are kept, of the size of the mechanism or a rad."""
MAX_CLOSING_STEP = 0.5
"""rad, or of the mechanism's size."""
VECTORS = (0, 3)
"""Of what the compiled function gives: vectors; the rest are matrices."""


def solve_rows(matrices: Array, right: Array) -> Array:
    """Solutions of square systems (..., n, n) with right sides (..., n, k); NaN where one is singular."""
    try:
        found: Array = np.linalg.solve(matrices, right)
    except np.linalg.LinAlgError:  # one of them, to the last digit
        flat, sides = matrices.reshape(-1, *matrices.shape[-2:]), right.reshape(-1, *right.shape[-2:])
        found = np.full(sides.shape, np.nan)
        for k, (matrix, side) in enumerate(zip(flat, sides, strict=True)):
            try:
                found[k] = np.linalg.solve(matrix, side)
            except np.linalg.LinAlgError:
                continue
        found = found.reshape(right.shape)
    return found


def tangents(jacobians: Array) -> Array:
    """The unit vectors (..., unknowns) that Jacobians (..., unknowns - 1, unknowns) do not see: along the path."""
    found: Array = np.linalg.svd(jacobians)[2][..., -1, :]
    return found


def wanted_size(task: SynthesisTask, mechanism_size: float) -> float:
    """The extent (m) of all places that are wanted; that of the mechanism where there are none, or but one."""
    places = [item.places for item in task.wanted if not isinstance(item, WantedFunction)]
    extent = float(np.ptp(np.concatenate(places), axis=0).max()) if places else 0.0
    return extent or mechanism_size


def wanted_rows(task: SynthesisTask, size: float) -> list[WantedRows]:
    """Of each wanted item its rows: places in units of the size, angles in rad, lengths of functions in the size."""
    heavier = EXACT_WEIGHT if 0 < len(task.exact) < len(task.wanted) else 1.0
    rows = []
    for wanted in task.wanted:
        values, is_function = wanted_results(wanted), isinstance(wanted, WantedFunction)
        weights = (heavier if wanted.tolerance == 0.0 else 1.0) * np.sqrt(wanted.weights)
        scales = np.ones(1) if is_function else np.array([size, size, 1.0])[: values.shape[1]]
        is_free = wanted.inputs is not None and not wanted.is_absolute
        rows.append(WantedRows(wanted, values, wanted.inputs, weights, scales, is_free, is_free and is_function))
    return rows


EXACT_WEIGHT = 30.0
"""Of a miss of what is to be met exactly beside others, before a fit's last steps meet it."""


class GlobalNumbers:
    """The free numbers, then the zeros of scales that each kind of rows seeks."""

    def __init__(self, equations: Sequence[WantedEquations], many_free: int):
        self.free = at = many_free
        self.zero_columns: list[IntArray] = []
        for item in equations:
            self.zero_columns.append(np.arange(at, at + item.zero_count))
            at += item.zero_count
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
    for k, (item, line) in enumerate(zip(equations, lines, strict=True)):
        at = numbers.columns(k)
        own = np.einsum("cnpi,cnpj->cij", line.slopes, line.slopes, optimize=True)
        if not item.is_timed:
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
    for k, (item, line, residual) in enumerate(zip(equations, lines, residuals, strict=True)):
        slope[:, numbers.columns(k)] += np.einsum("cnpi,cnp->ci", line.slopes, _across(item, line, residual))
    return slope


def _across(equations: WantedEquations, line: LinearRows, rows: Array) -> Array:
    """Rows (designs, n, parts, ...) without their part along the path, where an entry may go along it."""
    if equations.is_timed:
        return rows
    unit = line.along / (np.sum(line.along**2, axis=-1) + DAMPING_ALONG)[..., None]
    across: Array = rows - np.einsum("cnp,cnq,cnq...->cnp...", line.along, unit, rows, optimize=True)
    return across


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
    rows: list[Array] = [np.zeros((many, 0))]
    slopes: list[Array] = [np.zeros((many, 0, numbers.size))]
    for k, (item, line) in enumerate(zip(equations, lines, strict=True)):
        if item.rows.wanted.tolerance != 0.0 and not every_item:
            continue
        across = _across(item, line, np.concatenate([line.residual[..., None], line.slopes], axis=-1))
        both = across.reshape(many, -1, across.shape[-1])
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
    for k, (item, line) in enumerate(zip(equations, lines, strict=True)):
        own, slope = line.own[..., -1], line.own_slopes[..., -1, :]
        if not item.is_timed:
            rate = line.tangent[..., -1] / (np.sum(line.along**2, axis=-1) + DAMPING_ALONG)
            own = own - rate * np.einsum("cnp,cnp->cn", line.along, line.residual)
            slope = slope - rate[..., None] * np.einsum("cnp,cnpi->cni", line.along, line.slopes)
        wide = np.zeros((*own.shape, numbers.size))
        wide[..., numbers.columns(k)] = slope
        owns.append(own)
        slopes.append(wide)
    inputs = np.concatenate([y[..., -1] for y in unknowns], axis=1)
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
