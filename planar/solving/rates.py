"""Velocities, accelerations and third rates of a run, from the derivatives of its constraints."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.solving.branch import cancelling
from planar.solving.curve import truncated
from planar.solving.follow import Local
from planar.solving.freedom import SINGULAR, strengths
from planar.solving.setup import Setup

Array = np.ndarray

ALONG = 1e-9
"""A part of the inputs' rates that is this much aside of the way along which a change point was passed is none."""


class Given(NamedTuple):
    """Positions of the inputs over a run, with their first, second and third rates, each (samples, inputs)."""

    u: Array
    u1: Array
    u2: Array
    u3: Array


def rates(setup: Setup, z: Array, given: Given, local: Mapping[int, Local], third: bool) -> list[Array]:
    """w with its first, second and, where asked for, third rate at samples (samples, coordinates).

    NaN where none is determined: at dead points. At change points they are those of the branch that was followed.
    """
    program, p, none = setup.program, setup.station.p, np.zeros_like(z)
    y = np.hstack([z, given.u])

    def whole(rate: Array, of_inputs: Array) -> Array:
        return np.hstack([rate, of_inputs])

    rest = program.kinematics(y, whole(none, given.u1), whole(none, given.u2), p)
    strong = strengths(setup, rest.slope).min(axis=-1, initial=1.0) >= SINGULAR
    known = {index: _carried(each, given, index) for index, each in local.items()}
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
    parts = [found.w, found.w1, found.w2]
    if third:
        z3 = solved(program.jerks(y, y1, y2, whole(none, given.u3), p)[0], 3)
        parts.append(program.jerks(y, y1, y2, whole(z3, given.u3), p)[1])
    for part in parts[1:]:
        part[weak] = np.nan
    return parts


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
