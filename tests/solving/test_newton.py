"""Newton's methods: what they return is what they have measured, and the better of two."""

import numpy as np
import pytest

from planar.solving.newton import correct, correct_at_rank, damped_newton, refine_multiple_root, settle, shortest_step

STEP = shortest_step(1e-14)


def circle_and_line(y):
    """A circle of radius 2 about the origin, and the line y = x."""
    return np.array([y @ y - 4.0, y[0] - y[1]]), np.array([2.0 * y, [1.0, -1.0]])


def square(y):
    """A double root at 0, to which every step leaves half of the way."""
    return y**2, np.diag(2.0 * y)


@pytest.mark.parametrize(
    "system, start, steps", [(circle_and_line, [1.0, 2.0], 8), (square, [1.0], 5), (square, [1.0], 0)]
)
def test_the_residual_told_is_that_of_the_place_returned(system, start, steps):
    y, gap = correct(system, STEP, np.array(start), steps)
    assert gap == np.max(np.abs(system(y)[0]))
    assert gap <= np.max(np.abs(system(np.array(start))[0]))


def test_a_step_that_leaves_more_open_is_not_taken():
    def away(jacobian, residuals):
        return np.ones(2)

    start = np.sqrt(2.0) * np.ones(2)
    y, gap = correct(circle_and_line, away, start, 8)
    assert np.array_equal(y, start)
    assert gap < 1e-14


def test_nothing_is_told_of_a_place_that_is_no_number():
    assert correct(square, STEP, np.array([np.nan]), 8)[1] == np.inf


def test_at_a_lower_rank_the_position_stays_where_it_is_free():
    def crossing(y):  # x y = 0 beside the origin, where nothing tells the two lines apart
        return np.array([y[0] * y[1], y[2]]), np.array([[y[1], y[0], 0.0], [0.0, 0.0, 1.0]])

    beside = correct_at_rank(crossing, np.array([1e-9, 1e-9, 1e-3]), 1, 3)
    assert beside == pytest.approx([1e-9, 1e-9, 0.0], abs=1e-12)


def test_a_multiple_root_is_found_to_the_root_of_rounding():
    root = refine_multiple_root(lambda z: (z**2, 2.0 * z[..., None]), np.array([5e-4]), 1e-3)
    assert abs(root[0]) < 1e-10
    assert damped_newton(lambda z: (z**2, 2.0 * z[..., None]), np.array([[1.0]])).converged.all()


def test_what_stands_still_need_not_close():
    y, is_settled = settle(lambda y: (np.array([y[0], y[0] - 1.0]), np.ones((2, 1))), STEP, np.zeros(1), 12, (1, 1e-13))
    assert is_settled
    assert y == pytest.approx([0.5])
    assert not settle(square, STEP, np.array([1.0]), 12, (1, 1e-13))[1]
    assert not settle(circle_and_line, STEP, np.array([9.0, 2.0]), 12, (2, 1e-13), longest_step=0.1)[1]
