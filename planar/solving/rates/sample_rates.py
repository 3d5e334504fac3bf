"""Velocities, accelerations and third rates of a run, from the derivatives of its constraints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.solving.checks.branch_check import cancelling
from planar.solving.continuation.path import Local
from planar.solving.continuation.solution_curve import truncated
from planar.solving.prepared_mechanism import Setup
from planar.solving.rates.accuracy import Doubts, doubts
from planar.solving.rates.regularity import SINGULAR, strengths

Array = np.ndarray

BESIDE = 1e-3
"""Strength of a group from which on its rates are taken from its slope, however near a change point is."""
ALONG = 1e-9
"""A part of the inputs' rates that is this much aside of the way along which a change point was passed is none."""


class Given(NamedTuple):
    """Positions of the inputs over a run, with their first, second and third rates, each (samples, inputs)."""

    u: Array
    u1: Array
    u2: Array
    u3: Array


class Rated(NamedTuple):
    """w with its first, second and, where asked for, third rate at samples, each (samples, coordinates), and of which
    samples the accuracy is in doubt."""

    parts: list[Array]
    doubts: Doubts | None


def rates(setup: Setup, z: Array, given: Given, local: Mapping[int, Local], third: bool) -> Rated:
    """The rates at samples.

    NaN where none is determined: at dead points. At change points they are those of the branch that was followed.
    """
    program, p, none = setup.program, setup.station.p, np.zeros_like(z)
    y = np.hstack([z, given.u])

    def whole(rate: Array, of_inputs: Array) -> Array:
        return np.hstack([rate, of_inputs])

    rest = program.kinematics(y, whole(none, given.u1), whole(none, given.u2), p)
    strength = strengths(setup, rest.slope).min(axis=-1, initial=1.0)
    strong = strength >= SINGULAR
    # near by, the rates along a branch are those of a linkage that has the change point exactly
    known = {index: _carried(each, given, index) for index, each in local.items() if strength[index] < BESIDE}
    known = {index: each for index, each in known.items() if each is not None}
    weak = ~strong
    weak[list(known)] = False
    strong[list(known)] = False

    def solved(left: Array, order: int) -> Array:
        found = np.full(z.shape, np.nan)
        if strong.any():
            found[strong] = cancelling(rest.slope[strong], left[strong][..., None])[..., 0]
        for index, each in known.items():
            slope, guess = rest.slope[index], each[order - 1]
            found[index] = guess - truncated(slope, left[index] + slope @ guess, z.shape[1] - local[index].lost)
        return found

    z1 = solved(rest.F1, 1)
    y1 = whole(z1, given.u1)
    z2 = solved(program.kinematics(y, y1, whole(none, given.u2), p).F2, 2)
    y2 = whole(z2, given.u2)
    found = program.kinematics(y, y1, y2, p)
    parts, sure = [found.w, found.w1, found.w2], np.flatnonzero(strong)
    if third:
        z3 = solved(program.jerks(y, y1, y2, whole(none, given.u3), p)[0], 3)
        parts.append(program.jerks(y, y1, y2, whole(z3, given.u3), p)[1])
    for part in parts[1:]:
        part[weak] = np.nan
    found_doubts = doubts(setup, rest.slope[sure], found.w[sure], y[sure], y1[sure], y2[sure]) if sure.size else None
    return Rated(parts, found_doubts and found_doubts._replace(rows=sure[found_doubts.rows]))


def _carried(local: Local, given: Given, index: int) -> Array | None:
    """Rates in time (3, unknowns) from those along a way; None where the inputs do not run along it."""
    way, size = local.way, float(local.way @ local.way)
    along = []
    for rate in (given.u1[index], given.u2[index], given.u3[index]):
        part = float(rate @ way) / size
        if np.max(np.abs(rate - part * way)) > ALONG * max(1.0, float(np.max(np.abs(rate)))):
            return None
        along.append(part)
    t1, t2, t3 = along
    first, second, third = local.rates
    return np.array([first * t1, first * t2 + second * t1**2, first * t3 + 3.0 * second * t1 * t2 + third * t1**3])
