"""Formulas that are recorded, beside themselves on floats."""

import casadi as ca
import numpy as np
import pytest

from planar.codegen.printed_formula import MAX_INTERPRETED_CALLS, FormulaFunction
from planar.foundation.geometry import Frame
from planar.foundation.instruction_list import Instruction
from planar.foundation.jets import atan2, cos, sign_of, sin, sqrt, tan, value_between, within_turn
from planar.foundation.recorded_formula import RecordedFormula, record_formula
from planar.model.pairs import pair_types

SAMPLES = [sample for pair_type in pair_types().values() for sample in pair_type.samples()]


def every_operation(x):
    a, b = x
    return [
        1.0 + a - 2.0,
        3.0 - b,
        -a * b / (2.0 + b) + 1.0 / a,
        a**2,
        abs(a - b),
        cos(a) + sin(b) + tan(a) - sqrt(b),
        atan2(a, b) + atan2(1.0, b) + atan2(a, 2.0),
        within_turn(10.0 * a),
        value_between(a, 0.5, b, 3.0) + sign_of(a - b),
        5.0,
    ]


@pytest.mark.parametrize("values", [(0.7, 1.3), (1.9, 0.4)])
def test_every_operation_is_recorded(values):
    formula = record_formula(every_operation, 2)
    expected = [float(np.asarray(part)) for part in every_operation([np.array(value) for value in values])]
    np.testing.assert_allclose([float(value) for value in formula.evaluate(values)], expected, rtol=1e-14)


def test_zeros_and_ones_leave_no_operation_and_what_no_result_needs_is_left_out():
    formula = record_formula(lambda x: [x[0] * 1.0 + 0.0 * x[1] + 0.0, 0.0 / x[2], x[1] - 0.0], 4)
    inputs = Instruction("input", key=0), Instruction("input", key=1)
    assert formula == RecordedFormula((*inputs, Instruction("const", number=0.0)), (0, 2, 1))


def test_formulas_are_equal_where_their_operations_are():
    first, second = (record_formula(lambda x, k=k: [x[0] * x[1] + k], 2) for k in (1.0, 2.0))
    assert first != second
    assert hash(first) == hash(record_formula(lambda y: [y[0] * y[1] + 1.0], 2))


@pytest.mark.parametrize("sample", SAMPLES, ids=lambda sample: type(sample.pair).__name__)
def test_the_formulas_of_every_pair_type_are_recorded(sample):
    pair, bodies = sample.pair, len(sample.frames)
    numbers = pair.measure(sample.shapes)

    def residual(x):
        frames = [Frame(*x[5 * k : 5 * k + 5]) for k in range(bodies)]
        values = x[5 * bodies :]
        return pair.residual(frames, values[: len(numbers)], values[len(numbers) :])

    values = [*(part for frame in sample.frames for part in frame[:5]), *numbers, *sample.own]
    symbols = ca.SX.sym("x", len(values))
    split = ca.vertsplit(symbols)
    recorded = record_formula(residual, len(values)).evaluate(split)
    both = ca.Function("both", [symbols], [ca.vertcat(*recorded), ca.vertcat(*residual(split))])
    aside = np.random.default_rng(0).uniform(-1e-3, 1e-3, (len(values), 3))
    result, expected = (part.full() for part in both(np.array(values, float)[:, None] + aside))
    np.testing.assert_array_equal(result, expected)
    assert np.isfinite(expected).all()


def test_a_formula_of_floats_and_arrays_says_the_same_before_and_after_it_is_printed():
    formula = record_formula(every_operation, 2)
    count = len(formula.results)
    function = FormulaFunction(formula, (1, 1), ((1, count),))
    a, b = np.random.default_rng(0).uniform(0.3, 2.0, (2, 7, 1))
    expected = np.array(
        [[float(np.asarray(value)) for value in formula.evaluate([*x, *y])] for x, y in zip(a, b, strict=True)]
    )
    for _ in range(2 * MAX_INTERPRETED_CALLS):
        np.testing.assert_allclose(function.evaluate_batch(7, a, b)[0][:, 0], expected, rtol=1e-14)
        np.testing.assert_allclose(function(a[0], b[0])[0][0], expected[0], rtol=1e-14)
