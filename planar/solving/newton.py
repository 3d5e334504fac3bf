"""Newton's methods: damped from many starts, undamped from near by, block by block, at a given rank, to multiple roots.

Damped steps lead to a root from anywhere, undamped ones carry a position that is all but closed to round-off. What the
two solve is theirs to give: a block of constraints, or those along a curve with a plane across it.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np

from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_vectors
from planar.equations.symbolic_equations import Block, slice_length
from planar.foundation.arrays import Array, greatest_size

ResidualFunction = Callable[[Array], tuple[Array, Array]]
"""Unknowns (starts, n) -> what is left open (starts, m), and its Jacobian (starts, m, n)."""
SystemFunction = Callable[[Array], tuple[Array, Any]]
"""The same from one place: unknowns (n,) -> residuals (m,), Jacobian (m, n), an array or what stands for one."""
StepSolver = Callable[[Any, Array], Array]
"""Jacobian (m, n), residuals (m,) -> the step (n,) that closes them to first order."""

CLOSED_TOLERANCE = 1e-11
"""A group counts as closed below this (lengths of the mechanism's size); the gate asks for more afterwards."""
STALLED_COST_RATIO = 1e-10
STALLED_COST = 1e-8
"""Below such squares of residuals a start may yet close, however slowly it comes nearer."""
SETTLED_STEP = 1e-13
FIRST_DAMPING = 1e-3
"""The damping from which steps start anywhere, for squares of singular values in parts of the greatest one's."""
MIN_DAMPING_RATIO, MIN_DAMPING, MAX_DAMPING = 0.1, 1e-17, 1e12
"""To so small a part the damping falls at each step, and between these it stays."""
ROUNDED_COST = 1e-31
"""Where the squares of residuals come to less, on average, no step makes them any better."""
MAX_SMALL_UNKNOWNS, MIN_ROUGH_DAMPING = 24, 1e-12
"""Of more unknowns steps that are damped by more than this are solved by the normal equations."""
MAX_NEWTON_STEPS = 200
"""Iterations. A double root halves its error each time, so 27 take it from 1 to the square root of round-off."""
MAX_POLISHING_STEPS = 4
MAX_BLOCK_STEPS, CLOSED_BLOCK_TOLERANCE = 8, 1e-10
BLOCK_RANK_TOLERANCE = 1e-12
"""Singular values of a block below this part of the greatest are none."""
LOWER_RANK_STEPS = 2
MAX_MULTIPLE_ROOT_STEPS = 40
"""Newton's steps to a root where several may meet: towards three each leaves two thirds of the way."""
MULTIPLE_ROOT_RANK_TOLERANCE = 1e-13
EPS = float(np.finfo(float).eps)


class NewtonResult(NamedTuple):
    """Where each start ended: the unknowns, the greatest part left open, and whether that closes the block.

    `steps` is how many steps were taken, of all starts at once.
    """

    unknowns: Array
    residual: Array
    converged: Array
    steps: int

    def joined(self, other: NewtonResult) -> NewtonResult:
        """The ends of the starts of both."""
        unknowns, residual, converged = (np.concatenate(parts) for parts in zip(self[:3], other[:3], strict=True))
        return NewtonResult(unknowns, residual, converged, self.steps + other.steps)


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # a step that overflows is not better, and not taken
def damped_newton(
    residual_function: ResidualFunction,
    starts: Array,
    tolerance: float = CLOSED_TOLERANCE,
    first_damping: float = FIRST_DAMPING,
) -> NewtonResult:
    """Solve from every start by Levenberg's and Marquardt's damping of Gauss and Newton's method.

    The damping falls with every step that does what the linear system foresees, so convergence at a simple root is
    quadratic; where nothing closes it stays as high as the bending asks. Blocks with more constraints than unknowns are
    solved in the sense of least squares, singular ones by the shortest step.
    K. Madsen, H. B. Nielsen, O. Tingleff, Methods for Non-Linear Least Squares Problems, 2nd ed., 2004, sec. 3.2.
    """
    z = np.array(starts, dtype=float)
    count, unknowns = z.shape
    residuals, jacobian = residual_function(z)
    if unknowns == 0:
        return _newton_result(z, residuals, tolerance, 0)
    cost = np.add.reduce(residuals * residuals, axis=1)
    damping, growth = np.full(count, first_damping), np.full(count, 2.0)
    end, end_residuals, active = z.copy(), residuals.copy(), np.arange(count)
    steps = 0
    while steps < MAX_NEWTON_STEPS:
        steps += 1
        step = _damped_step(residuals, jacobian, damping)
        trial = z + step
        new_residuals, new_jacobian = residual_function(trial)
        new_cost = np.add.reduce(new_residuals * new_residuals, axis=1)
        gain, better = cost - new_cost, new_cost < cost
        settled = (np.maximum.reduce(np.abs(step), axis=1) < SETTLED_STEP) | (damping > MAX_DAMPING)
        # closed, or far from closed and hardly coming closer: a start that ends where nothing closes
        stalled = (gain < STALLED_COST_RATIO * cost) & (new_cost > STALLED_COST)
        settled |= better & (stalled | (new_cost <= ROUNDED_COST * residuals.shape[1]))
        predicted = residuals + np.matmul(jacobian, step[:, :, None])[:, :, 0]
        predicted_gain = np.maximum(cost - np.add.reduce(predicted * predicted, axis=1), 1e-300)
        ratio = np.where(better, np.minimum(gain / predicted_gain, 1.0), 0.0)
        lower = np.maximum(damping * np.maximum(1.0 - (2.0 * ratio - 1.0) ** 3, MIN_DAMPING_RATIO), MIN_DAMPING)
        damping, growth = np.where(better, lower, damping * growth), np.where(better, 2.0, 2.0 * growth)
        if better.all():
            z, residuals, jacobian, cost = trial, new_residuals, new_jacobian, new_cost
        elif better.any():
            z, residuals = np.where(better[:, None], trial, z), np.where(better[:, None], new_residuals, residuals)
            jacobian, cost = np.where(better[:, None, None], new_jacobian, jacobian), np.where(better, new_cost, cost)
        if settled.any():
            end[active[settled]], end_residuals[active[settled]] = z[settled], residuals[settled]
            remaining = ~settled
            active, z, residuals, jacobian, cost, damping, growth = (
                values[remaining] for values in (active, z, residuals, jacobian, cost, damping, growth)
            )
            if not active.size:
                break
    end[active], end_residuals[active] = z, residuals
    return _newton_result(end, end_residuals, tolerance, steps)


def _damped_step(residuals: Array, jacobian: Array, damping: Array) -> Array:
    """The damped step, from a singular value decomposition, so that nothing is squared and nothing need be regular.

    Of many unknowns one that is damped a good deal by the normal equations, at a fraction of the cost.
    """
    unknowns = jacobian.shape[2]
    if unknowns > MAX_SMALL_UNKNOWNS and damping.min() > MIN_ROUGH_DAMPING:
        transposed = jacobian.swapaxes(1, 2)
        squares = transposed @ jacobian
        # the trace is the sum of the squares of all singular values
        ridge = damping * np.maximum(np.trace(squares, axis1=1, axis2=2), 1e-300)
        return -solve_vectors(
            squares + ridge[:, None, None] * np.eye(unknowns), (transposed @ residuals[..., None])[..., 0]
        )
    u, s, vt = np.linalg.svd(jacobian, full_matrices=False)
    along = np.einsum("kmr,km->kr", u, residuals)
    scale = np.maximum(s[:, :1], 1e-300)
    gain = s / np.maximum(s * s + damping[:, None] * scale * scale, 1e-300)
    return -np.einsum("krn,kr->kn", vt, np.where(s > 1e-14 * scale, gain, 0.0) * along)


def correct(residual_function: SystemFunction, solve_step: StepSolver, y: Array, max_steps: int) -> tuple[Array, float]:
    """Undamped steps from y (n,), as long as each leaves less open: the best place (n,), and what is open there."""
    residuals, jacobian = residual_function(y)
    gap = greatest_size(residuals)
    if not gap < np.inf:
        return y, np.inf
    for _ in range(max_steps):
        trial = y + solve_step(jacobian, residuals)
        residuals, jacobian = residual_function(trial)
        new_gap = greatest_size(residuals)
        if not new_gap < gap:
            break
        y, gap = trial, new_gap
    return y, gap


def shortest_step(rank_tolerance: float) -> StepSolver:
    """Steps in the sense of least squares; singular values below this part of the greatest are none."""
    return lambda jacobian, residuals: -np.linalg.lstsq(jacobian, residuals, rcond=rank_tolerance)[0]


def polish_root(residual_function: ResidualFunction, z: Array) -> Array:
    """One root (n,) of a block carried to round-off."""
    if not z.size:
        return z
    system = one_system(residual_function)
    return correct(system, lambda j, r: _damped_step(r[None], j[None], np.zeros(1))[0], z, MAX_POLISHING_STEPS)[0]


def one_system(residual_function: ResidualFunction) -> SystemFunction:
    """The function of one start, from that of several."""

    def evaluate_one(z: Array) -> tuple[Array, Array]:
        residuals, jacobian = residual_function(z[None])
        return residuals[0], jacobian[0]

    return evaluate_one


def block_residual_function(
    functions: EquationFunctions, block: Block, z: Array, u: Array, p: Array
) -> ResidualFunction:
    """The constraints of a block as a function of its own unknowns, those of earlier blocks in z and all numbers
    given."""
    function = functions.block_call(block)

    def evaluate(block_unknowns: Array) -> tuple[Array, Array]:
        count = len(block_unknowns)
        starts = np.repeat(z[None], count, axis=0)
        starts[:, block.unknowns] = block_unknowns
        residuals, slopes = function.evaluate_batch(count, starts, u, p) if count > 1 else function(starts[0], u, p)
        return residuals.reshape(count, -1), slopes.reshape(count, *slopes.shape[-2:]).transpose(0, 2, 1)

    return evaluate


def correct_blocks(functions: EquationFunctions, p: Array, z: Array, u: Array, last_block: int) -> Array | None:
    """All unknowns (n,) at inputs u from near by, block after block to the last; None where one does not close."""
    z = z.copy()
    for block in functions.equations.blocks[: last_block + 1]:
        if slice_length(block.rows):
            closing = one_system(block_residual_function(functions, block, z, u, p))
            start = z[block.unknowns].copy()
            z[block.unknowns], gap = correct(closing, shortest_step(BLOCK_RANK_TOLERANCE), start, MAX_BLOCK_STEPS)
            if gap > CLOSED_BLOCK_TOLERANCE:
                return None
    return z


def correct_position(
    functions: EquationFunctions,
    position: tuple[Array, Array, Array],
    free_count: int,
    rank_tolerance: float,
    max_steps: int,
) -> tuple[Array, float]:
    """The best place near a `position` (z, u, p) of which the first `free_count` of z and u may move, in steps of least
    squares: unknowns and inputs, and what is open there."""
    z, u, p = position
    y, fixed = np.concatenate([z, u]), np.concatenate([z, u])[free_count:]

    def evaluate(free: Array) -> tuple[Array, Array]:
        y = np.concatenate([free, fixed])
        residuals, jacobian = functions.residuals_and_jacobian(y[: len(z)], y[len(z) :], p)
        return residuals, jacobian[:, :free_count]

    free, gap = correct(evaluate, shortest_step(rank_tolerance), y[:free_count], max_steps)
    return np.concatenate([free, fixed]), gap


def correct_at_rank(residual_function: SystemFunction, y: Array, rank: int, free_count: int) -> Array:
    """A place beside one where the rank falls to this, closed to round-off by its first unknowns, the rest held.

    It is not moved along what the lower rank leaves free: from one branch to the other.
    """
    y = y.copy()
    for _ in range(LOWER_RANK_STEPS):
        residuals, jacobian = residual_function(y)
        y[:free_count] -= truncated_step(jacobian[:, :free_count], residuals, rank)
    return y


def repeat_step(residual_function: SystemFunction, inverse: Array, y: Array, steps: int) -> Array:
    """Where so many steps from y (n,) lead by one inverse (n, m) of the Jacobian, or of a part of it."""
    for _ in range(steps):
        y = y - inverse @ residual_function(y)[0]
    return y


def truncated_step(jacobian: Array, residuals: Array, rank: int) -> Array:
    """The shortest step that closes what is open, by so many of the directions in which the Jacobian is steepest."""
    u, s, vt = np.linalg.svd(jacobian, full_matrices=False)
    return vt[:rank].T @ ((u.T[:rank] @ residuals) / s[:rank])


def refine_multiple_root(residual_function: ResidualFunction, root: Array, longest_step: float) -> Array:
    """The place with the least left open on Newton's way from near a root (n,) to which several may come.

    A step along what is all but open bends away before the next one brings it nearer, so none is refused; one that is
    longer than `longest_step` leads elsewhere.
    """
    best, minimum = root, np.inf
    for _ in range(MAX_MULTIPLE_ROOT_STEPS):
        residuals, jacobian = residual_function(root[None])
        gap = float(np.abs(residuals).max())
        if gap < minimum:
            best, minimum = root, gap
        step = np.linalg.pinv(jacobian[0], rcond=MULTIPLE_ROOT_RANK_TOLERANCE) @ residuals[0]
        if not EPS < np.abs(step).max() < longest_step:
            break
        root = root - step
    return best


def settle(
    residual_function: SystemFunction,
    solve_step: StepSolver,
    y: Array,
    max_steps: int,
    still: tuple[int, float],
    longest_step: float = np.inf,
) -> tuple[Array, bool]:
    """Undamped steps from y (n,) until they stand still, as long as none is too long: where, and whether they do.

    `still`: how many of the unknowns, the first, have to, and by how much less they then move. For systems that come
    near a root without having one: that they close is for others to see.
    """
    leading, settled_step = still
    for _ in range(max_steps):
        residuals, jacobian = residual_function(y)
        step = solve_step(jacobian, residuals)
        size = greatest_size(step)
        if not size < np.inf or size > longest_step:
            return y, False
        y = y + step
        if greatest_size(step[:leading]) < settled_step:
            return y, True
    return y, False


def _newton_result(z: Array, residuals: Array, tolerance: float, steps: int) -> NewtonResult:
    gap = np.max(np.abs(residuals), axis=1, initial=0.0)
    return NewtonResult(z, gap, gap <= tolerance, steps)
