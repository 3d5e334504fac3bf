"""Machine code of recorded formulas: to the last digit what numpy computes, made once it pays."""

import numpy as np
import pytest

from planar.codegen import printed_formula
from planar.codegen.formula_kernel import compile_kernel
from planar.codegen.printed_formula import FormulaFunction
from planar.foundation.instruction_list import UnsupportedOperation
from planar.foundation.jets import atan2, cos, sin, sqrt, tan
from planar.foundation.recorded_formula import greatest_of, least_of, record_formula, where


def values(arguments):
    """Every operation that formulas have."""
    a, b, c, d = arguments
    return [
        a + b * c - d / a,
        cos(a) * sin(b) - tan(0.3 * c),
        sqrt(a * b) + atan2(c, d),
        abs(c) + greatest_of(a, b) - least_of(c, d),
        where(a < b, c) + where(1.0 - 1.0 * (a <= b), d),
        (3.0 * a).floor() - (-b) + a**3,
        2.5 + 0.0 * a,
        a,
    ]


def function():
    return FormulaFunction(record_formula(values, 4), (2, 1, 1), ((1, 8),))


def arguments(count, seed=0):
    """Two entries and one that vary, and one that does not, some of them not numbers."""
    rng = np.random.default_rng(seed)
    first, third = rng.uniform(-2.0, 2.0, (2, count)), rng.uniform(-2.0, 2.0, (1, count))
    first[0, 3::7], third[0, 4::9] = np.nan, 0.0
    return [first, rng.uniform(0.5, 1.0, 1), third]


@pytest.mark.parametrize("count", [0, 1, 7, 8, 9, 73])
def test_it_is_what_numpy_computes_to_the_last_digit(count):
    formula = function()
    kernel = compile_kernel(formula.formula, formula.argument_counts, (True, False, True))
    given = arguments(count)
    with np.errstate(all="ignore"):
        expected = np.array([np.broadcast_to(value, count) for value in formula._of_arrays(*given)])
    result = kernel(count, given)
    assert result.shape == (8, count)
    # what a library's functions of angles give in their last digit is their own
    np.testing.assert_allclose(result, expected, rtol=1e-15, atol=1e-16)


def test_it_is_made_once_numpy_took_longer_than_that_takes(monkeypatch):
    made = []

    def counted(*given):
        made.append(given)
        return compile_kernel(*given)

    monkeypatch.setattr("planar.codegen.formula_kernel.compile_kernel", counted)
    formula, given = function(), arguments(500)
    expected = formula.evaluate_entries(500, *given)
    assert not made
    monkeypatch.setattr(printed_formula, "MIN_COMPILED_TIME", 0.0)
    monkeypatch.setattr(printed_formula, "COMPILED_TIME_PER_INSTRUCTION", 0.0)
    for _ in range(3):
        np.testing.assert_allclose(formula.evaluate_entries(500, *given), expected, rtol=1e-15, atol=1e-16)
    assert len(made) == 1
    other = [given[0], given[1], given[2][:, 0]]
    np.testing.assert_allclose(formula.evaluate_entries(500, *other)[2, :1], expected[2, :1], rtol=1e-15)
    assert len(made) == 2


@pytest.mark.parametrize("why", ["too long", "unknown operation"])
def test_where_it_cannot_be_made_numpy_goes_on(monkeypatch, why):
    monkeypatch.setattr(printed_formula, "MIN_COMPILED_TIME", 0.0)
    monkeypatch.setattr(printed_formula, "COMPILED_TIME_PER_INSTRUCTION", 0.0)

    def refuse(*given):
        raise UnsupportedOperation("unknown")

    monkeypatch.setattr("planar.codegen.formula_kernel.compile_kernel", refuse)
    if why == "too long":
        monkeypatch.setattr(printed_formula, "MAX_COMPILED_INSTRUCTIONS", 3)
    formula, given = function(), arguments(40)
    first = formula.evaluate_entries(40, *given)
    np.testing.assert_array_equal(formula.evaluate_entries(40, *given), first)
    assert not formula._kernels
