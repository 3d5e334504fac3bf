"""Rounding errors of a position's equations and of their rates, carried by derivatives."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import casadi as ca

from planar.equations.block_motion import function_with_cse
from planar.equations.casadi_call import BufferedFunction
from planar.equations.rates import rate_symbols, time_derivatives
from planar.equations.symbolic_equations import ConstraintEquations
from planar.foundation.arrays import Array


class RoundingTerms(NamedTuple):
    """What `round_off` returns of F and w, one after the other (samples, rows and coordinates)."""

    value: Array
    term_sum: Array
    "the sum of the sizes of all numbers in them, each by its slope: a part of it is lost where all are rounded by it"
    jacobian: Array
    "by y = (z, u), (samples, rows and coordinates, y)"
    first_rate_jacobian: Array
    "the Jacobian of the first rates, alike"
    second_rate_jacobian: Array
    "the Jacobian of the second rates"


def rounding_terms(equations: ConstraintEquations, y: Array, y1: Array, y2: Array, p: Array) -> RoundingTerms:
    """What carries round-off at samples y = (z, u) with first and second rates, each (samples, y)."""
    value, terms, *slopes = _rounding_function(equations).evaluate_batch(len(y), y, y1, y2, p)
    return RoundingTerms(value[:, 0], terms[:, 0], *(each.transpose(0, 2, 1) for each in slopes))


@lru_cache(maxsize=16)
def _rounding_function(e: ConstraintEquations) -> BufferedFunction:
    both = ca.vertcat(e.F, e.w)
    y = e.y
    y1, y2 = rate_symbols(y, 2)
    first, second = time_derivatives(both, y, y1, y2)
    slopes = [ca.jacobian(each, y) for each in (both, first, second)]
    terms = ca.mtimes(ca.fabs(ca.jacobian(both, e.p)), ca.fabs(e.p)) + ca.mtimes(ca.fabs(slopes[0]), ca.fabs(y))
    return BufferedFunction(
        function_with_cse("round_off", [y, y1, y2, e.p], [ca.densify(each) for each in (both, terms, *slopes)])
    )
