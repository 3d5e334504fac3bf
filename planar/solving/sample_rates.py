"""Velocities, accelerations and third rates of a run, and what round-off leaves of them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import NamedTuple

import numpy as np

from planar.equations.linear import inverse_arrays, solve_vectors
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase
from planar.solving.checks import EPS, MAX_RATE_ERROR, MIN_REGULARITY, NEGLIGIBLE_ERROR
from planar.solving.continuation.fast_path import BranchRates, InputRates
from planar.solving.newton import truncated_step
from planar.solving.prepared_mechanism import PreparedMechanism

MIN_REGULARITY_FOR_RATES = 1e-3
"""Strength of a block from which on its rates are taken from its Jacobian, however near a change point is."""
DIRECTION_TOLERANCE = 1e-9
"""A part of the inputs' rates that is this much aside of the direction in which a change point was passed is none."""
SMALLEST_NORMAL = float(np.finfo(float).tiny)
MAX_ACCELERATION_ERROR = 0.1
"""Part of an acceleration that may be wrong."""
SHORT_ARM = 1e-4
"""Sizes: an arm that is shorter is named as a cause of what is lost."""


def sample_rates(
    setup: PreparedMechanism, z: Array, inputs: InputRates, branch_rates: Mapping[int, BranchRates], with_jerk: bool
) -> tuple[list[Array], AccuracyDoubts | None]:
    """w with its first, second and, where asked for, third rate at samples, each (samples, coordinates), and of which
    samples the accuracy is in doubt.

    NaN where none is determined: at dead points. At change points they are those of the branch that was followed.
    """
    functions, p, rest = setup.functions, setup.inputs.p, np.zeros_like(z)
    y = np.hstack([z, inputs.u])
    at_rest = functions.kinematics(y, np.hstack([rest, inputs.u1]), np.hstack([rest, inputs.u2]), p)
    jacobians = at_rest.jacobian
    strength = setup.jacobian_regularity(jacobians).min(axis=-1, initial=1.0)
    # near by, the rates along a branch are those of a linkage that has the change point exactly
    known = {
        row: in_time
        for row, along in branch_rates.items()
        if strength[row] < MIN_REGULARITY_FOR_RATES and (in_time := _rates_in_time(along, inputs, row)) is not None
    }
    is_known = np.isin(np.arange(len(z)), list(known))
    is_regular = (strength >= MIN_REGULARITY) & ~is_known

    def solved(residuals: Array, order: int) -> Array:
        rates = np.full(z.shape, np.nan)
        if is_regular.any():
            rates[is_regular] = -solve_vectors(jacobians[is_regular], residuals[is_regular])
        for row, in_time in known.items():
            guess, rank = in_time[order - 1], z.shape[1] - branch_rates[row].rank_loss
            rates[row] = guess - truncated_step(jacobians[row], residuals[row] + jacobians[row] @ guess, rank)
        return rates

    y1 = np.hstack([solved(at_rest.F1, 1), inputs.u1])
    z2 = solved(functions.kinematics(y, y1, np.hstack([rest, inputs.u2]), p).F2, 2)
    y2 = np.hstack([z2, inputs.u2])
    motion = functions.kinematics(y, y1, y2, p)
    parts = [motion.w, motion.w1, motion.w2]
    if with_jerk:
        z3 = solved(functions.formulas.third_residual_rates((y, y1, y2, np.hstack([rest, inputs.u3])), p), 3)
        parts.append(functions.formulas.third_coordinate_rates((y, y1, y2, np.hstack([z3, inputs.u3])), p))
    for part in parts[1:]:
        part[~(is_regular | is_known)] = np.nan
    rows = np.flatnonzero(is_regular)
    if not rows.size:
        return parts, None
    doubts = find_accuracy_doubts(setup, jacobians[rows], motion.w[rows], y[rows], y1[rows], y2[rows])
    return parts, doubts and doubts._replace(rows=rows[doubts.rows])


def _rates_in_time(branch_rates: BranchRates, inputs: InputRates, index: int) -> Array | None:
    """Rates in time (3, unknowns) from those along a direction; None where the inputs do not run along it."""
    direction, size = branch_rates.input_direction, float(branch_rates.input_direction @ branch_rates.input_direction)
    along = []
    for rate in (inputs.u1[index], inputs.u2[index], inputs.u3[index]):
        part = float(rate @ direction) / size
        if np.max(np.abs(rate - part * direction)) > DIRECTION_TOLERANCE * max(1.0, float(np.max(np.abs(rate)))):
            return None
        along.append(part)
    t1, t2, t3 = along
    first, second, third = branch_rates.rates
    return np.array([first * t1, first * t2 + second * t1**2, first * t3 + 3.0 * second * t1 * t2 + third * t1**3])


class AccuracyDoubts(NamedTuple):
    """Samples whose accuracy is not sure: which, and what round-off makes of each (doubted,).

    `position` is the greatest error of an angle (rad) or a length (sizes), `velocity` and `acceleration` those of the
    rates as a part of what moves in the same loop; not numbers where none is known. `causes` are in words, with what
    mends them.
    """

    rows: IntArray
    position: Array
    velocity: Array
    acceleration: Array
    causes: list[tuple[str, str]]

    @property
    def is_too_inexact(self) -> BoolArray:
        """Which have too few digits left: next to a change point of positions and velocities that are known well the
        accelerations may be known to one."""
        return ~(
            (np.maximum(self.position, self.velocity) <= MAX_RATE_ERROR) & (self.acceleration <= MAX_ACCELERATION_ERROR)
        )

    @property
    def greatest(self) -> Array:
        """The greatest of the three errors."""
        return np.maximum.reduce(self[1:4])

    def remarks(self, describe: Callable[[int], str]) -> tuple[str, ...]:
        """What there is to say of those that are accurate enough: of the worst, at the place of its row in words."""
        exact = np.flatnonzero(~self.is_too_inexact)
        if not exact.size:
            return ()
        worst = int(exact[np.argmax(self.greatest[exact])])
        digits = max(int(-np.log10(self.greatest[worst])), 1)
        where = describe(int(self.rows[worst]))
        return (f"rounding leaves {count_phrase(digits, 'digit')} of the rates{where}, as {self.causes[worst][0]}",)

    def refusal(self, setup: PreparedMechanism, k: int, where: str) -> NoAnswer:
        """What to say of the k-th of them, at a place in words."""
        cause, remedy = self.causes[k]
        what = "no digit of the accelerations"
        for part, of in ((self.velocity, "the rates"), (self.position, "the position")):
            if not part[k] <= MAX_RATE_ERROR:
                what = f"less than three digits of {of}"
        return NoAnswer(Outcome.TOO_INEXACT, f"{where} rounding leaves {what}, as {cause}; {remedy}")


def find_accuracy_doubts(
    setup: PreparedMechanism, jacobian: Array, w: Array, y: Array, y1: Array, y2: Array
) -> AccuracyDoubts | None:
    """Which samples may be less accurate than they look; None where none is. Arguments as of `rate_errors`, with the
    Jacobian (samples, rows, unknowns) and w (samples, coordinates) in sizes.
    """
    amplification, stages, arms = _error_amplification(setup, jacobian)
    counted = np.maximum(np.abs(w).max(axis=1, initial=0.0) / np.pi, 1.0)
    # what is not a number is not below anything
    rows = np.flatnonzero(~(EPS * amplification * counted <= NEGLIGIBLE_ERROR))
    if not rows.size:
        return None
    errors = rate_errors(setup, y[rows], y1[rows], y2[rows])
    is_doubted = ~(errors.max(axis=0) <= NEGLIGIBLE_ERROR)
    rows = rows[is_doubted]
    if not rows.size:
        return None
    causes = [_cause(setup, w[row], float(counted[row]), int(stages[row]), arms[row]) for row in rows]
    position, velocity, acceleration = errors[:, is_doubted]
    return AccuracyDoubts(rows, position, velocity, acceleration, causes)


def _error_amplification(setup: PreparedMechanism, jacobian: Array) -> tuple[Array, IntArray, Array]:
    """By how much round-off is greater in the rates at most, and in which group (samples,); the arm of every unknown.

    A place that is rounded by EPS turns a link whose arm is short by EPS / arm, the more where the group is nearly
    singular; rates that are made of such angles lose as much once more.
    """
    greatest, which = np.ones(len(jacobian)), np.zeros(len(jacobian), dtype=int)
    strong, arms = setup.jacobian_regularity(jacobian), np.ones((len(jacobian), jacobian.shape[2]))
    for index, stage in enumerate(setup.equations.blocks):
        block_jacobian = jacobian[:, stage.rows, stage.unknowns]
        if block_jacobian.shape[-1]:
            arms[:, stage.unknowns] = np.linalg.norm(block_jacobian, axis=1)
            shortest_arm = arms[:, stage.unknowns].min(axis=1)
            amplification = 1.0 / np.maximum(shortest_arm * strong[:, index] ** 2, SMALLEST_NORMAL)
            which = np.where(amplification > greatest, index, which)
            greatest = np.maximum(greatest, amplification)
    return greatest, which, arms


def _cause(setup: PreparedMechanism, w: Array, counted: float, stage: int, arms: Array) -> tuple[str, str]:
    """Why round-off grows at a sample, and a remedy."""
    e = setup.equations
    if EPS * counted > NEGLIGIBLE_ERROR:
        worst = e.coordinates[int(np.argmax(np.abs(w)))]
        size = f"{float(np.max(np.abs(w))):.3g}"
        if worst.kind is MeasureKind.LENGTH:
            return f"{worst.owner!r} is {size} times as far away as the mechanism is large", "bring them nearer"
        return f"the angle of link {worst.owner!r} counts up to {size} rad", "start from fewer turns"
    unknowns = e.blocks[stage].unknowns
    k = unknowns.start + int(np.argmin(arms[unknowns])) if unknowns.stop > unknowns.start else 0
    if arms.size and arms[k] < SHORT_ARM:
        link = e.coordinates[e.unknowns[k]].owner
        return (
            f"link {link!r} has an arm of {float(arms[k]):.2g} of the mechanism's size",
            f"lengthen link {link!r}, or make one link of those that it joins",
        )
    links = ", ".join(repr(link) for link in e.blocks[stage].links)
    return f"{links} stand next to a dead point or a change point", "move the input"


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # what is not a number is not known
def rate_errors(setup: PreparedMechanism, y: Array, y1: Array, y2: Array) -> Array:
    """What round-off makes of y = (z, u) and its rates, each (samples, y), with no more known than doubles hold: errors
    (3, samples) as `AccuracyDoubts` has them.

    Every number of a row may be wrong by EPS of itself, and the row by what it leaves open. So much is the position
    wrong by the inverse of the slope (N. J. Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed., SIAM
    2002, sec. 7.2: the componentwise condition), and the rates' rows by what that changes in them.
    """
    e = setup.equations
    rows, unknowns = len(e.rows), len(e.unknowns)
    terms = setup.functions.formulas.rounding_terms(y, y1, y2, setup.inputs.p)
    slope, first, second = (
        np.abs(jacobian) for jacobian in (terms.jacobian, terms.first_rate_jacobian, terms.second_rate_jacobian)
    )
    inverse = np.abs(inverse_arrays(terms.jacobian[:, :rows, :unknowns]))

    def solved(of_rows: Array, of_inputs: Array) -> Array:
        return np.hstack([_matrix_times_vector(inverse, of_rows), of_inputs])

    inputs = np.abs(y[:, unknowns:])
    dy = solved(np.abs(terms.value[:, :rows]) + EPS * terms.term_sum[:, :rows], EPS * inputs)
    position_errors = _matrix_times_vector(slope[:, rows:], dy) + EPS * terms.term_sum[:, rows:]
    lost1 = _matrix_times_vector(first, dy) + EPS * _matrix_times_vector(slope, np.abs(y1))
    dy1 = solved(lost1[:, :rows], EPS * np.abs(y1[:, unknowns:]))
    lost2 = (
        _matrix_times_vector(second, dy)
        + 2.0 * _matrix_times_vector(first, dy1)
        + EPS * _matrix_times_vector(slope, np.abs(y2))
    )
    dy2 = solved(lost2[:, :rows], EPS * np.abs(y2[:, unknowns:]))
    one, two = _reference_rates(setup, slope[:, :rows], np.abs(y1), np.abs(y2))
    errors = position_errors, _relative_errors(dy1, one), _relative_errors(dy2, two)
    return np.array([np.max(error, axis=1, initial=0.0) for error in errors])


def _reference_rates(setup: PreparedMechanism, slope: Array, y1: Array, y2: Array) -> tuple[Array, Array]:
    """How fast everything in y moves, or would if it did not just come to rest (samples, y), to each order.

    What comes first moves the rows of a group, and a row its unknowns, each by its arm. So a link that turns back is
    judged by what moves it, and one that is slow because all is slow around it by that.
    """
    e = setup.equations
    unknown_count = len(e.unknowns)
    angles = np.append(e.unknown_is_angle, np.ones(y1.shape[1] - unknown_count, dtype=bool))
    one, two = y1.copy(), np.maximum(y2, y1 * y1 * angles)
    for stage in e.blocks:
        unknowns = slice(stage.unknowns.start, stage.unknowns.stop)
        block = slope[:, stage.rows]
        names = [row.pair for row in e.rows[stage.rows]]
        alike = np.array([[a == b for b in names] for a in names], dtype=bool).reshape(len(names), len(names))
        for pace in (one, two):
            for _ in range(len(names)):
                terms = (block * pace[:, None]).max(axis=2, initial=0.0)
                # both rows of a pin: what moves along one axis now moves along the other in a while
                terms = np.where(alike, terms[:, None], 0.0).max(axis=2, initial=0.0)
                arms = np.sqrt((alike @ (block[:, :, unknowns] ** 2)).clip(SMALLEST_NORMAL))
                could = np.where(block[:, :, unknowns] > 0.0, terms[:, :, None] / arms, 0.0).max(axis=1, initial=0.0)
                grown = np.maximum(pace[:, unknowns], could)
                if np.all(grown <= 2.0 * pace[:, unknowns]):
                    break
                pace[:, unknowns] = grown
        two[:, unknowns] = np.maximum(two[:, unknowns], one[:, unknowns] ** 2 * angles[unknowns])
    return one, two


def _matrix_times_vector(matrices: Array, vectors: Array) -> Array:
    return (matrices @ vectors[..., None])[..., 0]


def _relative_errors(errors: Array, references: Array) -> Array:
    return np.where(errors > 0.0, errors / np.maximum(references, SMALLEST_NORMAL), 0.0)
