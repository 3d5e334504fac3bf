"""Means, extremes and crossings of forces between the positions of a motion, against closed forms."""

import json
import pickle
from math import acos, pi, radians

import numpy as np
import pytest

import planar
from planar.drawing.forces.torque import torque_picture
from planar.dynamics.flywheel import explain_no_cycle
from planar.dynamics.force_course import force_course
from planar.reports.tables.forces.forces_over_motion import run_facts
from planar.solving.samples import ContinuousRun


def shaft(torque, places, factors, **others):
    """A shaft on which a torque (N m) acts by a table over its angle (deg)."""
    return planar.from_dict(
        {
            "planar": 1,
            "units": {"length": "m", "angle": "deg"},
            "frame": "frame",
            "links": {"frame": {"points": {"O": [0, 0]}}, "shaft": {"points": {"O": [0, 0]}}},
            "pairs": [{"turning": "O"}],
            "inputs": [{"pair": "O", "position": 0, "velocity": "6 rpm", **others}],
            "loads": [{"link": "shaft", "torque": torque, "varies": {"with": "O", "at": places, "factors": factors}}],
        }
    )


@pytest.mark.parametrize("steps", [7, 90, 720])
def test_a_punch_that_steps_between_positions_has_its_exact_mean_and_energy(steps):
    """26,598.8 N m from 0 to 57.6 deg, else nothing."""
    punch = shaft(-26598.8, [0, 0, 57.6, 57.6, 360], [0, 1, 1, 0, 0])
    wheel = planar.flywheel(planar.forces(planar.cycle(punch, steps)), fluctuation=0.03)
    share = 57.6 / 360.0
    assert wheel.mean == pytest.approx(26598.8 * share, rel=1e-12)
    assert wheel.energy == pytest.approx(26598.8 * (1.0 - share) * radians(57.6), rel=1e-12)
    assert wheel.inertia == pytest.approx(wheel.energy / (0.03 * (0.2 * pi) ** 2), rel=1e-12)
    assert np.degrees(wheel.slowest) == pytest.approx(57.6, abs=1e-9)
    assert np.degrees(wheel.fastest) % 360.0 == pytest.approx(0.0, abs=1e-9)


def test_a_turning_moment_table_has_the_areas_of_its_polygon():
    """A triangle of height 1 over 60 to 180 deg: mean 1/6, energy the area above that mean, where the sides meet it."""
    table = shaft(-600.0, [0, 60, 120, 180, 360], [0, 0, 1, 0, 0])
    wheel = planar.flywheel(planar.forces(planar.cycle(table, 91)))
    assert wheel.mean == pytest.approx(100.0, rel=1e-12)
    assert [np.degrees(each) for each in (wheel.fastest, wheel.slowest)] == pytest.approx([70.0, 170.0], abs=1e-8)
    assert wheel.energy == pytest.approx(0.5 * 500.0 * radians(100.0), rel=1e-11)


def test_a_force_on_a_slider_does_the_work_of_its_way():
    """F from 200 deg to 299.3 deg: the mean is F times the way of the slider between, by the turn."""
    first, last, force = radians(200.0), radians(299.3), 1500.0
    document = json.loads(planar.dumps(planar.load("motor-press")))
    document["inputs"][0].pop("motor", None)
    document.pop("masses", None)
    (load,) = document["loads"]
    load["force"] = -force
    load["varies"] = {"with": "O", "at": [0, 200, 200, 299.3, 299.3, 360], "factors": [0, 0, 1, 1, 0, 0]}
    mechanism = planar.from_dict(document)
    start, stop = (planar.solve(mechanism, {"O": at}).pair("ram")["displacement"] for at in (first, last))
    wanted = force * (stop - start) / (2.0 * pi)
    for steps in (90, 91):
        found = planar.forces(planar.cycle(mechanism, steps))
        assert planar.flywheel(found).mean == pytest.approx(wanted, rel=1e-11)


def test_pieces_of_a_law_in_time_are_integrated_each_by_itself():
    """Half a turn at constant acceleration, half a turn back to rest: mean 0, energy that of the speed between."""
    document = {
        "planar": 1,
        "frame": "frame",
        "links": {"frame": {"points": {"O": [0, 0]}}, "rotor": {"points": {"O": [0, 0]}}},
        "pairs": [{"turning": "O"}],
        "inputs": [{"pair": "O", "position": 0, "law": [{"motion": "parabolic", "by": 2.0 * pi, "in": 2.0}]}],
        "masses": [{"link": "rotor", "mass": 1.0, "at": "O", "inertia": 3.0}],
    }
    found = planar.forces(planar.cycle(planar.from_dict(document), 91))
    wheel = planar.flywheel(found)
    assert wheel.mean == pytest.approx(0.0, abs=1e-9)
    assert wheel.energy == pytest.approx(0.5 * 3.0 * (2.0 * pi) ** 2, rel=1e-9)
    assert wheel.slowest == pytest.approx(pi, rel=1e-7)


@pytest.mark.parametrize("steps", [90, 91])
def test_a_follower_lifts_off_where_its_closed_form_says(steps, tmp_path):
    """A spring of 1 N/mm compressed by 2.5 mm at rest, 0.9 kg, a lift of 15 (1 - cos) mm at 500 rpm."""
    document = {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": [0, 0], "T": [0, 200]}},
            "cam": {"points": {"O": [0, 0]}},
            "follower": {"points": {"P": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"sliding": "guide", "links": ["frame", "follower"], "line": {"through": "O", "angle": 90}, "point": "P"},
            {
                "cam": "lift",
                "links": ["cam", "follower"],
                "line": {"through": "O", "angle": 90},
                "point": "P",
                "centre": "O",
                "base_radius": 25,
                "flat": 0,
                "law": [{"motion": "harmonic", "by": 30, "in": 180}, {"motion": "harmonic", "by": -30, "in": 180}],
            },
        ],
        "inputs": [{"pair": "O", "position": 0, "velocity": "500 rpm"}],
        "masses": [{"link": "follower", "mass": 0.9, "at": "P"}],
        "springs": [{"points": ["T", "P"], "stiffness": "1 N/mm", "free_length": 177.5}],
        "sketch": {"P": [0, 25]},
    }
    contact = planar.contact_forces(planar.forces(planar.cycle(planar.from_dict(document), steps)))["lift"]
    speed = 500.0 * 2.0 * pi / 60.0
    amplitude = 0.9 * 0.015 * speed**2 - 15.0
    ((first, last),) = contact.lift_off_intervals
    angle = acos(-17.5 / amplitude)
    assert (first, last) == pytest.approx((angle, 2.0 * pi - angle), rel=1e-9)
    assert contact.smallest == pytest.approx(17.5 - amplitude, rel=1e-9)


def test_a_run_between_its_rows_is_the_run_of_other_rows():
    """Over a range, back again, and in time: the same positions and accelerations as of a run that has these rows."""
    for name, options in (
        ("two-stroke-engine", {}),
        ("slotted-lever", {"there_and_back": True}),
        ("cam-with-spring", {"duration": 0.1}),
    ):
        coarse, fine = (planar.cycle(name, steps, **options) for steps in (40, 120))
        run = ContinuousRun(pickle.loads(pickle.dumps(coarse)))
        places = ContinuousRun(fine).rows
        regular = np.isfinite(fine.point(fine.point_names[-1]).acceleration).all(axis=1)
        found = run.motion_at(places[regular])
        for point in fine.point_names:
            wanted, result = fine.point(point).acceleration[regular], found.point(point).acceleration
            assert np.allclose(result, wanted, rtol=1e-7, atol=1e-7 * np.abs(wanted).max())


def test_where_there_is_no_cycle_there_is_no_mean_and_both_say_why():
    found = planar.forces(planar.cycle("two-stroke-engine", 20, radians(10.0), radians(200.0)))
    reason = explain_no_cycle(found, "O")
    assert "no whole cycle" in reason
    assert any(reason in note for note in _notes_of(found))


def _notes_of(found):
    assert run_facts(found)["mean_effort"] == {"O": None}
    return torque_picture(found).notes


def test_a_simulated_motion_is_known_at_its_rows_alone():
    simulated = planar.simulate("physical-pendulum", 0.2, 20)
    assert force_course(planar.forces(simulated.motion)) is None
