"""What rounding the numbers of a position's equations makes of them and of their rates, by slopes."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_call import Called
from planar.equations.constraint_equations import Equations
from planar.equations.functions import compact, derivatives

Array = np.ndarray


class RoundOff(NamedTuple):
    """What `round_off` returns of F and w, one after the other (samples, rows and coordinates)."""

    value: Array
    terms: Array
    "the sum of the sizes of all numbers in them, each by its slope: a part of it is lost where all are rounded by it"
    slope: Array
    "by y = (z, u), (samples, rows and coordinates, y)"
    first: Array
    "the slope of the first rates, alike"
    second: Array
    "the slope of the second rates"


def round_off(equations: Equations, y: Array, y1: Array, y2: Array, p: Array) -> RoundOff:
    """What carries round-off at samples y = (z, u) with first and second rates, each (samples, y)."""
    value, terms, *slopes = _called(equations).over(len(y), y, y1, y2, p)
    return RoundOff(value[:, 0], terms[:, 0], *(each.transpose(0, 2, 1) for each in slopes))


@lru_cache(maxsize=16)
def _called(e: Equations) -> Called:
    both = ca.vertcat(e.F, e.w)
    y, y1, y2, first, second = derivatives(e, both)
    slopes = [ca.jacobian(each, y) for each in (both, first, second)]
    terms = ca.mtimes(ca.fabs(ca.jacobian(both, e.p)), ca.fabs(e.p)) + ca.mtimes(ca.fabs(slopes[0]), ca.fabs(y))
    return Called(compact("round_off", [y, y1, y2, e.p], [ca.densify(each) for each in (both, terms, *slopes)]))
