"""Simulated impacts on stops: Newton's law in closed forms, rests, lift-off, several at once, energy."""

from __future__ import annotations

from math import pi, sqrt

import numpy as np
import pytest

import planar
from planar.dynamics.in_time.complementarity import solve_complementarity

G = 10.0


def ball(restitution, **more):
    """A mass of 2 kg that falls 1 m on a stop."""
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {"f": {"points": {"O": [0, 0]}}, "b": {"points": {"P": [0, 0]}}},
            "pairs": [
                {
                    "sliding": "s",
                    "links": ["f", "b"],
                    "line": {"through": "O", "angle": pi / 2},
                    "point": "P",
                    "stops": [0, None],
                    "restitution": restitution,
                }
            ],
            "inputs": [{"pair": "s", "position": 1.0}],
            "masses": [{"link": "b", "mass": 2, "at": "P", "inertia": 1}],
            "gravity": [0, -G],
        }
        | more
    )


@pytest.mark.parametrize("restitution", [0.0, 0.3, 1.0])
def test_a_ball_bounces_by_newtons_law_and_comes_to_rest(restitution):
    """It falls for t0 = sqrt(2 h / g), flies 2 t0 e, 2 t0 e^2, ...: in all t0 (1 + e) / (1 - e), if e < 1."""
    found = planar.simulate(ball(restitution), 1.2, 24)
    fall, speed = sqrt(2.0 / G), sqrt(2.0 * G)
    for k, each in enumerate(found.impacts[:3]):
        time = fall + 2.0 * fall * sum(restitution**j for j in range(1, k + 1))
        assert each.time == pytest.approx(time, abs=1e-11)
        assert each.approach == pytest.approx(speed * restitution**k, rel=1e-9)
        assert each.rebound == pytest.approx(speed * restitution ** (k + 1), rel=1e-9, abs=1e-15)
        assert each.impulse == pytest.approx(2.0 * (1.0 + restitution) * each.approach)
        assert each.lost == pytest.approx((1.0 - restitution**2) * each.approach**2, abs=1e-12)
    assert found.balance < 1e-12
    if restitution < 1.0:
        assert found.impacts[-1].rests
        assert found.impacts[-1].time == pytest.approx(fall * (1.0 + restitution) / (1.0 - restitution), abs=1e-4)
        assert found.lost[-1] == pytest.approx(2.0 * G, rel=1e-10)
        end = found.motion.inputs["s"]
        assert np.allclose([end.position[-1], end.velocity[-1], end.acceleration[-1]], 0.0, atol=1e-12)


def test_what_rests_on_a_stop_lifts_off_when_it_is_no_longer_pressed():
    """A force that grows by 10 N/s lifts 20 N after 2 s; then m z'' = 10 (t - 2), z = 10 (t - 2)^3 / 6 m."""
    rising = {"point": "P", "force": [0, 10.0], "varies": {"at": [0, 4], "factors": [0, 4]}}
    resting = ball(0.5, loads=[rising], inputs=[{"pair": "s", "position": 0.0}])
    found = planar.simulate(resting, 3.0, 30)
    gone = np.maximum(found.motion.time - 2.0, 0.0)
    np.testing.assert_allclose(found.motion.inputs["s"].position, 10.0 * gone**3 / 12.0, atol=1e-11)
    assert found.impacts == ()


def test_a_kink_of_a_load_is_no_impact_of_what_rests():
    """A load that steps while the ball rests, below its weight: it stays where it is, and nothing strikes."""
    steps = {
        "point": "P",
        "force": [0, 10.0],
        "varies": {"at": [0, 0.2, 0.2, 0.4, 0.4, 1], "factors": [0, 0, 1, 1, -2, -2]},
    }
    found = planar.simulate(ball(0.5, loads=[steps], inputs=[{"pair": "s", "position": 0.0}]), 1.0, 20)
    assert found.impacts == ()
    np.testing.assert_allclose(found.motion.inputs["s"].position, 0.0, atol=1e-15)


def linkage(**stops):
    """Two sliders at right angles joined by a rod of 1 m, on which gravity acts across: (cos, sin) of its angle."""
    slides = {
        name: {"sliding": name, "links": ["f", name], "line": {"through": "O", "angle": angle}, "point": point}
        for name, angle, point in (("x", 0.0, "A"), ("y", pi / 2, "B"))
    }
    for name, both in stops.items():
        slides[name] |= {"stops": both, "restitution": 0.5}
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0]}},
                "x": {"points": {"A": [0, 0]}},
                "y": {"points": {"B": [0, 0]}},
                "rod": {"ends": ["A", "B"], "length": 1.0},
            },
            "pairs": [{"turning": "A"}, {"turning": "B"}, *slides.values()],
            "inputs": [{"pair": "y", "position": 0.9}],
            "masses": [
                {"link": "x", "mass": 3, "at": "A", "inertia": 1},
                {"link": "y", "mass": 2, "at": "B", "inertia": 1},
            ],
            "gravity": [0, -G],
            "sketch": {"A": [sqrt(1 - 0.81), 0], "B": [0, 0.9]},
        }
    )


def test_an_impulse_acts_on_all_links_through_what_joins_them():
    """x^2 + y^2 = 1: at x = 0.6 the energy 2 g (0.9 - 0.8) is (3 x'^2 + 2 y'^2) / 2 with 0.6 x' = -0.8 y'."""
    found = planar.simulate(linkage(x=[None, 0.6]), 0.5, 50)
    first = found.impacts[0]
    inertia = 3.0 + 2.0 * (0.6 / 0.8) ** 2
    speed = sqrt(2.0 * 2.0 * G * 0.1 / inertia)
    assert (first.pair, first.position) == ("x", 0.6)
    assert first.approach == pytest.approx(speed, rel=1e-10)
    assert first.impulse == pytest.approx(1.5 * inertia * speed, rel=1e-10)
    assert first.lost == pytest.approx(0.75 * 2.0 * G * 0.1, rel=1e-10)
    assert found.balance < 1e-10


def test_two_stops_that_are_met_at_once_share_the_impulse():
    found = planar.simulate(linkage(x=[None, 0.6], y=[0.8, None]), 2.0, 40)
    alone = planar.simulate(linkage(x=[None, 0.6]), 2.0, 40)
    np.testing.assert_allclose(found.motion.point("A").position, alone.motion.point("A").position, atol=1e-7)
    assert found.lost[-1] == pytest.approx(alone.lost[-1], rel=1e-7)
    assert found.balance < 1e-9


def test_an_input_that_is_driven_against_its_stop_ends_the_motion():
    given = planar.to_dict(ball(0.0))
    given["inputs"] = [{"pair": "s", "position": 1.0, "velocity": -0.5}]
    found = planar.simulate(planar.from_dict(given), 3.0, 30, ["s"])
    assert found.motion.outcome is planar.Outcome.STOP
    assert "pair 's' meets its lower stop at 0 m, against which a driven input goes on" in found.motion.reason
    assert found.motion.time[-1] == pytest.approx(2.0)


def test_complementary_contacts_satisfy_their_conditions():
    rng = np.random.default_rng(3)
    for many in (1, 2, 4, 5):
        root = rng.normal(size=(many, max(1, many - 1)))
        matrix = root @ root.T
        offset = matrix @ rng.normal(size=many)  # what impulses along the contacts can mend
        x = solve_complementarity(matrix, offset)
        y = matrix @ x + offset
        assert x.min() >= 0.0
        assert y.min() >= -1e-9
        assert abs(x @ y) < 1e-9
    assert solve_complementarity(np.zeros((1, 1)), np.array([-1.0])) is None
