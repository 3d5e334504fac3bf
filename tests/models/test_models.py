"""The models that come along, each with a fact that it is known for."""

import numpy as np
import pytest

import planar
from tests.known import loop_sizes, state_turned_by


@pytest.mark.parametrize("degrees", [-40, -15, 0, 20, 38])
def test_peaucellier_and_lipkin_draw_a_straight_line(degrees):
    point = state_turned_by("peaucellier-lipkin", "C", degrees).point("Q")
    # OP * OQ = L^2 - l^2, with P on the circle of diameter 2 * 100 mm through O
    assert point.position[0] == pytest.approx((0.250**2 - 0.120**2) / 0.200, abs=1e-12)
    assert point.velocity[0] == pytest.approx(0.0, abs=1e-12)
    assert point.acceleration[0] == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("degrees", [-30, 0, 40])
def test_a_pantograph_copies_at_three_times_the_size(degrees):
    state = state_turned_by("pantograph", "O", degrees)
    small, large = state.point("P"), state.point("Q")
    for part in ("position", "velocity", "acceleration"):
        np.testing.assert_allclose(getattr(large, part), 3 * getattr(small, part), atol=1e-13)


@pytest.mark.parametrize("degrees", [0, 70, 180, 300])
def test_an_oldham_coupling_turns_both_shafts_alike_and_its_cross_on_a_circle(degrees):
    state = state_turned_by("oldham", "O1", degrees)
    first, second = state.link("disc 1"), state.link("disc 2")
    assert np.exp(1j * first.angle) == pytest.approx(np.exp(1j * second.angle), abs=1e-13)
    assert second.angular_velocity == pytest.approx(first.angular_velocity, rel=1e-12)
    middle = state.point("M").position - [0.015, 0]
    assert np.hypot(*middle) == pytest.approx(0.015, abs=1e-14)
    # the cross goes round its circle twice for each turn of the discs
    assert np.hypot(*state.point("M").velocity) == pytest.approx(2 * 0.015 * first.angular_velocity, rel=1e-12)


@pytest.mark.parametrize("slide", [0.02, 0.08, 0.11])
def test_the_trammels_point_runs_on_its_ellipse(slide):
    x, y = planar.solve(planar.load("elliptical-trammel"), {"across": slide}).point("E").position
    assert (x / 0.180) ** 2 + (y / 0.300) ** 2 == pytest.approx(1.0, abs=1e-13)


@pytest.mark.parametrize("slide", [0.3, 0.45, 0.52])
def test_the_scissor_lift_rises_three_times_one_stage_and_stays_level(slide):
    state = planar.solve(planar.load("scissor-lift"), {"foot": slide})
    height = 3 * np.sqrt(0.6**2 - slide**2)
    assert state.point("L3").position == pytest.approx([0, height], abs=1e-13)
    assert state.link("platform").angle == pytest.approx(0.0, abs=1e-13)
    # d(height)/d(slide) by the chain rule
    assert state.link("platform").angular_velocity == pytest.approx(0.0, abs=1e-12)
    assert state.point("L3").velocity[1] == pytest.approx(-9 * slide / height * -0.1, rel=1e-11)


def test_chebyshevs_point_stays_within_a_thousandth_of_its_base_of_a_straight_line():
    """Near the middle, y of P leaves 4/5 of the rocker's length by less than 0.35 % of the base."""
    heights = [state_turned_by("chebyshev-straight-line", "A0", d).point("P").position[1] for d in range(-20, 21, 5)]
    assert max(heights) - min(heights) < 0.0035 * 0.4
    assert np.mean(heights) == pytest.approx(0.4, abs=0.002)


@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_whitworths_slotted_link_points_from_its_pivot_at_the_crank_pin(degrees):
    state = state_turned_by("whitworth", "O", degrees)
    way = state.point("A").position - state.point("C").position
    assert state.link("slotted link").angle == pytest.approx(np.arctan2(way[1], way[0]), abs=1e-13)


def test_the_excavators_cylinders_are_as_long_as_given_and_all_three_move_the_bucket():
    mechanism = planar.load("excavator-arm")
    state = planar.solve(mechanism)
    for given, (base, end) in zip(mechanism.inputs, (("T", "R"), ("F", "G"), ("I", "J")), strict=True):
        apart = state.point(end).position - state.point(base).position
        assert np.hypot(*apart) == pytest.approx(given.position, rel=1e-13)
        rate = (state.point(end).velocity - state.point(base).velocity) @ apart / np.hypot(*apart)
        assert rate == pytest.approx(given.velocity, rel=1e-11)
    for given in mechanism.inputs:
        moved = planar.solve(mechanism, {given.pair: given.position + 0.01})
        assert np.hypot(*(moved.point("tip").position - state.point("tip").position)) > 0.005


def test_structures_are_what_their_names_say():
    assert loop_sizes("double-butterfly") == [5, 5, 5, 5, 6, 6, 8]
    assert loop_sizes("stephenson-3-five-bar") == [4, 5, 5]
    assert loop_sizes("watt-six-bar") == [4, 4, 6]
    assert min(loop_sizes("ten-link")) == 5
    for model in ("double-butterfly", "single-flier", "double-flier"):
        mechanism = planar.load(model)
        assert (len(mechanism.links), len(mechanism.pairs)) == (8, 10)
    assert len(planar.load("chain-42").links) == 42


def test_the_valve_of_the_tangent_cam_rises_by_the_lift_of_its_nose():
    motion = planar.cycle("tangent-cam", steps=72)
    height = motion.point("P").position[:, 1]
    assert height.max() - height.min() == pytest.approx(0.0175, abs=1e-12)


def test_the_measured_cam_lifts_as_the_cam_of_which_it_has_the_points():
    measured, made = (planar.cycle(stem, steps=24).point("P").position[:, 1] for stem in ("measured-cam", "valve-cam"))
    assert measured.max() - measured.min() == pytest.approx(0.05, abs=1e-5)
    assert np.abs((measured - measured.min()) - (made - made.min())).max() < 2e-4


def test_the_geneva_wheel_goes_on_by_a_quarter_with_every_turn_of_its_crank():
    angles = [state_turned_by("geneva-wheel", "O", turned).link("wheel").angle for turned in (0, 360, 720)]
    assert np.diff(angles) == pytest.approx([-np.pi / 2, -np.pi / 2], abs=1e-12)
    assert state_turned_by("geneva-wheel", "O", 110).link("wheel").angular_velocity == 0.0
