"""The Geneva wheel against its closed form, and published values."""

from math import acos, atan2, cos, pi, radians, sin, sqrt

import numpy as np
import pytest

import planar
from planar.document.revised.changed_numbers import with_values


def geneva(slots, velocity="1 rad/s", **more):
    """A crank about the origin, the wheel to its right."""
    return planar.from_dict(
        {
            "planar": 1,
            "units": {"length": "mm", "angle": "deg"},
            "frame": "plate",
            "links": {
                "plate": {"points": {"O": [0, 0], "Q": [100, 0]}},
                "crank": {"points": {"O": [0, 0]}},
                "wheel": {"points": {"Q": [0, 0]}},
            },
            "pairs": [
                {"turning": "O", "links": ["plate", "crank"]},
                {"turning": "Q", "links": ["plate", "wheel"]},
                {"geneva": "cross", "links": ["crank", "wheel"], "slots": slots} | more,
            ],
            "inputs": [{"pair": "O", "position": 0, "velocity": velocity}],
        }
    )


@pytest.mark.parametrize("slots", [3, 4, 7])
def test_the_wheel_turns_with_the_pin_and_rests_else(slots):
    mechanism, engaged, part = geneva(slots), pi / 2 - pi / slots, sin(pi / slots)
    for turns in (-3, 0, 5):
        for angle in (-pi + 1e-3, -engaged - 1e-3, -0.7 * engaged, 0.0, 0.4 * engaged, engaged + 1e-3, 3.0):
            wheel = planar.solve(mechanism, {"O": angle + 2.0 * pi * turns}).link("wheel")
            if abs(angle) < engaged:
                turned = -atan2(part * sin(angle), 1.0 - part * cos(angle))
                speed = -part * (cos(angle) - part) / (1.0 - 2.0 * part * cos(angle) + part**2)
            else:
                turned, speed = -np.sign(angle) * pi / slots, 0.0
            assert wheel.angle == pytest.approx(turned - 2.0 * pi * turns / slots, abs=1e-12)
            assert wheel.angular_velocity == pytest.approx(speed, abs=1e-12)


@pytest.mark.parametrize(("slots", "fastest", "acceleration"), [(4, 2.414, 5.41), (6, 1.0, 1.35), (8, 0.62, 0.70)])
def test_the_greatest_rates_are_the_published_ones(slots, fastest, acceleration):
    """J. H. Bickford, Mechanisms for Intermittent Motion, ch. 9; at the angle of the closed form."""
    part = sin(pi / slots)
    mechanism = geneva(slots)
    assert -planar.solve(mechanism).link("wheel").angular_velocity == pytest.approx(fastest, rel=2e-2)
    assert -planar.solve(mechanism).link("wheel").angular_velocity == pytest.approx(part / (1.0 - part), rel=1e-12)
    k = (1.0 + part**2) / (4.0 * part)
    worst = acos(-k + sqrt(k * k + 2.0))
    found = planar.solve(mechanism, {"O": worst}).link("wheel").angular_acceleration
    assert abs(found) == pytest.approx(acceleration, rel=1e-2)
    near = [planar.solve(mechanism, {"O": worst + each}).link("wheel").angular_acceleration for each in (-1e-3, 1e-3)]
    assert abs(found) > max(map(abs, near))


def test_power_goes_through_while_engaged_and_not_else():
    value = planar.to_dict(geneva(4, "2 rad/s")) | {"loads": [{"link": "wheel", "torque": 3}]}
    mechanism = planar.from_dict(value)
    for angle in (0.0, 0.5, 2.0):
        state = planar.solve(mechanism, {"O": angle})
        torque = planar.forces(state).inputs["O"]
        assert torque * 2.0 == pytest.approx(-3.0 * state.link("wheel").angular_velocity, abs=1e-12)


def test_sweeps_run_through_dwells_and_steps():
    mechanism = planar.load("geneva-wheel")
    starts = {"O.position": np.radians([-200.0, -60.0, 10.0])}
    alone = [planar.cycle(with_values(mechanism, {"O.position": each}), steps=90) for each in starts["O.position"]]
    swept = planar.sweep(mechanism, starts, 90)
    for index, motion in enumerate(alone):
        np.testing.assert_allclose(swept.position["E"][index], motion.point("E").position, atol=1e-12)
        np.testing.assert_allclose(swept.acceleration["E"][index], motion.point("E").acceleration, atol=1e-9)


def test_a_wheel_that_cannot_be_meant_is_refused():
    with pytest.raises(planar.BadInput, match="from 3 to 100 slots, not 2"):
        geneva(2)
    with pytest.raises(planar.BadInput, match="the carrier is a third link"):
        geneva(4, carrier="wheel")
    assert planar.solve(geneva(4, mesh={"crank": 30, "wheel": 10}), {"O": radians(30)}).link(
        "wheel"
    ).angle == pytest.approx(radians(10))
