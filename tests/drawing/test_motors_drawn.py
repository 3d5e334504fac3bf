"""Motors in schemes: a circle with an M by what each drives, clear of all other strokes."""

from math import hypot, radians

import numpy as np
import pytest

import planar
from planar.drawing.paper.picture import Circle, Label, Polyline
from planar.drawing.scheme.clearance import Clearance
from planar.drawing.scheme.scheme import scheme
from planar.drawing.scheme.symbol_table import MOTOR_DISTANCE, MOTOR_RADIUS
from planar.guide.keys_page import read_example


def check_motors(state: planar.State) -> None:
    """Every motor stands at its distance, with its letter inside and nothing else."""
    picture = scheme(state)
    for given in state.mechanism.inputs:
        if given.motor is None:
            continue
        own = [mark for mark in picture.marks if getattr(mark, "about", "") == f"motor of {given.pair}"]
        (circle,) = (mark for mark in own if isinstance(mark, Circle))
        shaft, letter = (mark for mark in own if isinstance(mark, Polyline))
        assert circle.radius == MOTOR_RADIUS
        assert all(hypot(x - circle.centre[0], y - circle.centre[1]) < MOTOR_RADIUS for x, y in letter.points)
        assert letter.points[0][0] == letter.points[1][0] < letter.points[2][0]  # upright
        far = hypot(*np.subtract(shaft.points[0], circle.centre))
        assert MOTOR_RADIUS < far < MOTOR_DISTANCE
        others = Clearance.from_marks(each for each in picture.marks if each not in own and not isinstance(each, Label))
        assert np.hypot(*(others.points - circle.centre).T).min() > MOTOR_RADIUS


@pytest.mark.parametrize("degrees", range(0, 360, 45))
def test_the_motor_of_a_crank_is_clear_of_it_wherever_it_stands(degrees):
    check_motors(planar.solve("motor-press", {"O": radians(degrees)}))


def test_motors_of_pins_and_of_a_cylinder_are_all_drawn():
    check_motors(planar.solve(planar.from_dict(read_example("input"))))
