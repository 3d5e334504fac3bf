"""Velocities, accelerations and third rates of a run, from the derivatives of its constraints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.equations.linear import solve_vectors
from planar.foundation.arrays import Array
from planar.solving.checks.singular_values import MIN_REGULARITY
from planar.solving.continuation.run_samples import BranchRates, InputRates
from planar.solving.newton import truncated_step
from planar.solving.prepared_mechanism import PreparedMechanism
from planar.solving.rates.accuracy import AccuracyDoubts, find_accuracy_doubts
from planar.solving.rates.regularity import regularity

MIN_REGULARITY_FOR_RATES = 1e-3
"""Strength of a block from which on its rates are taken from its Jacobian, however near a change point is."""
DIRECTION_TOLERANCE = 1e-9
"""A part of the inputs' rates that is this much aside of the way along which a change point was passed is none."""


class SampleRates(NamedTuple):
    """w with its first, second and, where asked for, third rate at samples, each (samples, coordinates), and of which
    samples the accuracy is in doubt."""

    coordinate_rates: list[Array]
    doubts: AccuracyDoubts | None


def sample_rates(
    setup: PreparedMechanism, z: Array, inputs: InputRates, branch_rates: Mapping[int, BranchRates], with_jerk: bool
) -> SampleRates:
    """The rates at samples.

    NaN where none is determined: at dead points. At change points they are those of the branch that was followed.
    """
    program, p, none = setup.functions, setup.inputs.p, np.zeros_like(z)
    y = np.hstack([z, inputs.u])

    def whole(rate: Array, of_inputs: Array) -> Array:
        return np.hstack([rate, of_inputs])

    rest = program.kinematics(y, whole(none, inputs.u1), whole(none, inputs.u2), p)
    strength = regularity(setup, rest.jacobian).min(axis=-1, initial=1.0)
    strong = strength >= MIN_REGULARITY
    # near by, the rates along a branch are those of a linkage that has the change point exactly
    known = {
        index: in_time
        for index, each in branch_rates.items()
        if strength[index] < MIN_REGULARITY_FOR_RATES and (in_time := _rates_in_time(each, inputs, index)) is not None
    }
    weak = ~strong
    weak[list(known)] = False
    strong[list(known)] = False

    def solved(left: Array, order: int) -> Array:
        found = np.full(z.shape, np.nan)
        if strong.any():
            found[strong] = -solve_vectors(rest.jacobian[strong], left[strong])
        for index, each in known.items():
            slope, guess = rest.jacobian[index], each[order - 1]
            found[index] = guess - truncated_step(
                slope, left[index] + slope @ guess, z.shape[1] - branch_rates[index].rank_loss
            )
        return found

    z1 = solved(rest.F1, 1)
    y1 = whole(z1, inputs.u1)
    z2 = solved(program.kinematics(y, y1, whole(none, inputs.u2), p).F2, 2)
    y2 = whole(z2, inputs.u2)
    found = program.kinematics(y, y1, y2, p)
    parts, sure = [found.w, found.w1, found.w2], np.flatnonzero(strong)
    if with_jerk:
        z3 = solved(program.third_residual_rates((y, y1, y2, whole(none, inputs.u3)), p), 3)
        parts.append(program.third_coordinate_rates((y, y1, y2, whole(z3, inputs.u3)), p))
    for part in parts[1:]:
        part[weak] = np.nan
    found_doubts = (
        find_accuracy_doubts(setup, rest.jacobian[sure], found.w[sure], y[sure], y1[sure], y2[sure])
        if sure.size
        else None
    )
    return SampleRates(parts, found_doubts and found_doubts._replace(rows=sure[found_doubts.rows]))


def _rates_in_time(branch_rates: BranchRates, given: InputRates, index: int) -> Array | None:
    """Rates in time (3, unknowns) from those along a way; None where the inputs do not run along it."""
    way, size = branch_rates.input_direction, float(branch_rates.input_direction @ branch_rates.input_direction)
    along = []
    for rate in (given.u1[index], given.u2[index], given.u3[index]):
        part = float(rate @ way) / size
        if np.max(np.abs(rate - part * way)) > DIRECTION_TOLERANCE * max(1.0, float(np.max(np.abs(rate)))):
            return None
        along.append(part)
    t1, t2, t3 = along
    first, second, third = branch_rates.rates
    return np.array([first * t1, first * t2 + second * t1**2, first * t3 + 3.0 * second * t1 * t2 + third * t1**3])
