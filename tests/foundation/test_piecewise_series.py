"""Series on pieces: integrals, extremes and crossings of functions with jumps, bends, gaps and poles."""

import numpy as np
import pytest

from planar.foundation.piecewise_series import fit_series

TURN = 2.0 * np.pi


def test_a_named_step_costs_nothing_and_is_exact():
    calls = []

    def step(x):
        calls.append(len(x))
        return np.where(x < 1.3, 2.0 + x, np.sin(x))

    series = fit_series(step, [0.0, 1.3, TURN])
    assert sum(calls) < 200
    assert series.integral() == pytest.approx(2.6 + 0.845 + np.cos(1.3) - 1.0, abs=1e-13)
    greatest, least = series.greatest(), series.smallest()
    assert (greatest.place, greatest.value) == (1.3, pytest.approx(3.3, abs=1e-13))  # the value before the step
    assert (least.place, least.value) == pytest.approx((1.5 * np.pi, -1.0))


def test_a_step_that_is_not_named_is_found_to_round_off():
    place = 1.234567
    series = fit_series(lambda x: np.where(x < place, 1.0, -2.0), [0.0, TURN])
    assert series.integral() == pytest.approx(place - 2.0 * (TURN - place), abs=1e-9)
    (crossing,) = series.crossings()
    assert crossing == pytest.approx(place, abs=1e-9)
    ((low, high),) = series.intervals_below()
    assert (low, high) == pytest.approx((place, TURN), abs=1e-9)
    assert not series.has_gaps


def test_bends_and_columns_of_very_different_size():
    series = fit_series(lambda x: np.stack([np.abs(np.sin(x)), 1e-6 * np.cos(x)], axis=-1), [0.0, TURN])
    assert series.integral(0) == pytest.approx(4.0, rel=1e-11)
    assert series.positive_integral(1) == pytest.approx(2e-6, rel=1e-9)
    assert series.running_integral(np.array([0.5 * np.pi]), 1) == pytest.approx([1e-6], rel=1e-9)


def test_columns_that_are_rounding_alone_do_not_need_a_series():
    noise = np.random.default_rng(0)
    series = fit_series(lambda x: 1e-15 * noise.standard_normal(len(x)), [0.0, 1.0], 1e-3)
    assert len(series.pieces) < 10
    assert abs(series.integral()) < 1e-14


def test_gaps_are_seen_and_poles_have_no_series():
    holes = fit_series(lambda x: np.where((x > 1.0) & (x < 2.0), np.nan, x), [0.0, 3.0])
    assert holes.has_gaps
    assert holes.integral() == pytest.approx(3.0, abs=1e-6)
    assert fit_series(lambda x: 1.0 / np.abs(x - 1.0), [0.0, 3.0]) is None
