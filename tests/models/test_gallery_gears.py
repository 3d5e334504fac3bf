"""Models with gears, racks, belts, chains and pins in slots, against their closed forms.

A closed form gives a place, as x + iy, or an angle over an input; a Chebyshev series through it gives the rates.
"""

import numpy as np
import pytest
from numpy.polynomial import Chebyshev

import planar
from tests.closed_forms import meeting
from tests.known import state_turned_by


def rates(closed, at, velocity, acceleration=0.0, reach=0.3):
    """Value, velocity and acceleration of a closed form where its input stands at `at` and moves so."""
    series = Chebyshev.interpolate(closed, 16, [at - reach, at + reach])
    first, second = series.deriv()(at), series.deriv(2)(at)
    return closed(at), first * velocity, second * velocity**2 + first * acceleration


def agrees(state, name, closed, reach=0.3):
    """Whether a point, or a link's angle, moves as a closed form over the mechanism's first input says."""
    (given, *_) = state.inputs.values()
    value, first, second = rates(closed, *given, reach)
    moves = state.point(name) if name in state.points else state.link(name)
    found = [complex(*part) if np.ndim(part) else part for part in moves[:3]]
    if name not in state.points:
        found[0], value = np.exp(1j * found[0]), np.exp(1j * value)
    scale = max(1.0, abs(given.velocity)) ** 2
    assert found[0] == pytest.approx(value, abs=1e-13)
    assert found[1] == pytest.approx(first, abs=1e-11 * scale)
    assert found[2] == pytest.approx(second, abs=1e-9 * scale)


def turn(angle):
    return np.exp(1j * angle)


# gears between cranks


def geared_five_bar_points(a):
    """A, B, C and P of the geared five-bar, the first crank at angle a; the second turns -1.5 times as far."""
    at_a, at_b = 0.04 * turn(a), 0.15 + 0.03 * turn(np.radians(100) - 1.5 * (a - np.radians(60)))
    c = meeting(at_a, 0.13, at_b, 0.11)
    return at_a, at_b, c, at_a + 0.07 * turn(np.radians(35)) * (c - at_a) / abs(c - at_a)


@pytest.mark.parametrize("degrees", [-700, -300, -100, 0, 45, 170, 290, 360, 500, 719])
def test_the_geared_five_bar_goes_where_circles_meet_turn_after_turn(degrees):
    state = state_turned_by("geared-five-bar", "O", degrees)
    for index, name in enumerate("ABCP"):
        agrees(state, name, lambda a, index=index: geared_five_bar_points(a)[index])
    assert state.link("QB").angle == pytest.approx(np.radians(100 - 1.5 * degrees), abs=1e-12)


def test_the_geared_five_bar_closes_after_two_turns_but_not_after_one():
    start, once, twice = (state_turned_by("geared-five-bar", "O", d).point("P").position for d in (0, 360, 720))
    np.testing.assert_allclose(twice, start, atol=1e-14)
    assert np.hypot(*(once - start)) > 0.01


@pytest.mark.parametrize("degrees", [0, 77, 180, 310, 800])
def test_cartwrights_crosshead_runs_straight(degrees):
    state = state_turned_by("cartwright", "O", degrees)
    c = state.point("C")
    assert [c.position[0], c.velocity[0], c.acceleration[0]] == pytest.approx([0.08, 0, 0], abs=1e-12)
    agrees(state, "C", lambda a: 0.08 + 1j * (0.06 * np.sin(a) + np.sqrt(0.3**2 - (0.08 - 0.06 * np.cos(a)) ** 2)))


# planets


@pytest.mark.parametrize("degrees", [0, 60, 150, 240, 330, 1000, -500])
def test_the_epicyclic_gears_planet_obeys_willis_and_its_rod_meets_the_rocker(degrees):
    state = state_turned_by("epicyclic-coupler", "O", degrees)
    arm, planet = state.link("arm"), state.link("planet")
    for part in (0, 1, 2):  # angle, angular velocity, angular acceleration
        assert planet[part] - arm[part] == pytest.approx(-60 / 30 * (0 - arm[part]), rel=1e-14)

    def e(a):
        return 0.09 * turn(a) + 0.02 * turn(3 * a)

    agrees(state, "E", e)
    agrees(state, "B", lambda a: meeting(e(a), 0.23, 0.26, 0.18), reach=0.15)
    agrees(state, "rocker", lambda a: np.angle(meeting(e(a), 0.23, 0.26, 0.18) - 0.26), reach=0.15)


@pytest.mark.parametrize("degrees", [0, 100, 2000])
def test_the_planetary_gear_set_obeys_willis(degrees):
    state = state_turned_by("planetary-gear-set", "O:frame,sun", degrees)
    sun, planet, arm = (state.link(name) for name in ("sun", "planet", "arm"))
    for part in (0, 1, 2):
        assert arm[part] == pytest.approx(sun[part] / (1 + 80 / 40), rel=1e-14)
        assert planet[part] - arm[part] == pytest.approx(-40 / 20 * (sun[part] - arm[part]), rel=1e-14)
        assert sun[part] - arm[part] == pytest.approx(-80 / 40 * (0 - arm[part]), rel=1e-14)


@pytest.mark.parametrize(("sun_at", "ring_at"), [(0.5, -1.3), (40.0, 2.0), (-3.0, 70.0)])
def test_the_planetary_differential_adds_its_two_inputs(sun_at, ring_at):
    state = planar.solve(planar.load("planetary-differential"), {"O:frame,sun": sun_at, "O:frame,ring": ring_at})
    sun, ring, planet, arm = (state.link(name) for name in ("sun", "ring", "planet", "arm"))
    assert (sun.angle, ring.angle) == pytest.approx((sun_at, ring_at), rel=1e-14)
    for part in (0, 1, 2):
        assert sun[part] - arm[part] == pytest.approx(-80 / 40 * (ring[part] - arm[part]), rel=1e-13)
        assert planet[part] - arm[part] == pytest.approx(80 / 20 * (ring[part] - arm[part]), rel=1e-13)


@pytest.mark.parametrize("degrees", [0, 25, 91, 200, 700])
def test_cardans_wheel_draws_straight_lines_and_an_ellipse(degrees):
    state = state_turned_by("cardan-gears", "O", degrees)
    a = state.inputs["O"].position
    agrees(state, "T", lambda a: 0.1 * np.cos(a) + 0j * a)
    assert [part[1] for part in state.point("T")[:3]] == pytest.approx([0, 0, 0], abs=1e-12)
    x, y = state.point("E").position
    assert (x, y) == pytest.approx((0.08 * np.cos(a), 0.02 * np.sin(a)), abs=1e-14)
    # 120 degrees further round the rim the diameter lies 60 degrees further round the ring
    for part in state.point("N")[:3]:
        assert (complex(*part) / turn(np.radians(60))).imag == pytest.approx(0, abs=1e-12)


@pytest.mark.parametrize("degrees", [-150, -60, 0, 10, 30, 60, 150])
def test_the_hypocycloid_draws_the_slider_by_its_closed_form(degrees):
    state = state_turned_by("hypocycloid-dwell", "O", degrees)

    def e(a):
        return 0.1 * turn(a) + 0.01 * turn(-2 * a)

    agrees(state, "E", e)
    agrees(state, "B", lambda a: e(a).real + np.sqrt(0.24**2 - e(a).imag ** 2) + 0j)


def test_the_hypocycloids_slider_dwells():
    """The rod is as long as the radius of curvature, so only the fourth power of the angle moves the slider."""
    there = state_turned_by("hypocycloid-dwell", "O", 30)
    rest = [there.point("B").velocity[0], there.point("B").acceleration[0], there.link("rod").angular_velocity]
    assert rest[:2] == pytest.approx([0, 0], abs=1e-13)
    assert abs(rest[2]) > 1
    small, large = (state_turned_by("hypocycloid-dwell", "O", 30 + d).point("B").position[0] - 0.15 for d in (2, 4))
    assert large / small == pytest.approx(16, rel=0.01)
    assert state_turned_by("hypocycloid-dwell", "O", 10).point("B").position[0] - 0.15 < 0.00025


@pytest.mark.parametrize("degrees", [0, 90, 200, 500, 1000])
def test_watts_flywheel_turns_twice_a_cycle(degrees):
    state, next_cycle = (state_turned_by("sun-and-planet", "O:arm,frame", d) for d in (degrees, degrees + 360))
    wheel, arm, rod = (state.link(name) for name in ("flywheel", "arm", "rod"))
    assert next_cycle.link("flywheel").angle - wheel.angle == pytest.approx(4 * np.pi, abs=1e-12)
    assert next_cycle.link("rod").angle == pytest.approx(rod.angle, abs=1e-12)
    for part in (1, 2):
        assert wheel[part] == pytest.approx(2 * arm[part] - rod[part], abs=1e-13)
    # the mesh is at 0 degrees of the flywheel and -90 of the rod, both against the arm
    assert wheel.angle - arm.angle == pytest.approx(-(rod.angle - arm.angle + np.pi / 2), abs=1e-12)
    agrees(state, "E", lambda a: meeting(-2.4 + 3j, 2.4, 0.6 * turn(a), 2.9))
    way = state.point("P").position - state.point("E").position
    assert turn(rod.angle) == pytest.approx(complex(*way) / 2.9, abs=1e-13)


# racks


@pytest.mark.parametrize("degrees", [-400, -100, 0, 33, 380])
def test_the_steering_rack_moves_by_radius_times_angle_and_turns_both_arms(degrees):
    state = state_turned_by("rack-steering", "O", degrees)
    agrees(state, "S", lambda a: 0.008 * a - 0.128j, reach=1.0)
    assert state.pair("travel")["displacement"] == pytest.approx(0.008 * np.radians(degrees), abs=1e-15)
    assert state.pair("mesh")["displacement"] == pytest.approx(-0.008 * np.radians(degrees), abs=1e-15)

    def rod_end(a, side):
        return 0.008 * a - 0.128j + side * 0.31

    agrees(state, "A", lambda a: meeting(rod_end(a, -1), 0.26, -0.6, 0.14), reach=1.0)
    agrees(state, "B", lambda a: meeting(0.6, 0.14, rod_end(a, 1), 0.26), reach=1.0)


def test_the_steering_arms_mirror_each_other():
    middle = state_turned_by("rack-steering", "O", 0)
    assert middle.link("left arm").angle + middle.link("right arm").angle == pytest.approx(-np.pi, abs=1e-13)
    one, other = (state_turned_by("rack-steering", "O", d) for d in (300, -300))
    assert one.link("left arm").angle + other.link("right arm").angle == pytest.approx(-np.pi, abs=1e-13)
    inner, outer = (one.link(arm).angle - middle.link(arm).angle for arm in ("left arm", "right arm"))
    assert inner > outer + np.radians(1) > np.radians(10)


@pytest.mark.parametrize("distance", [-0.7, 0.05, 0.3, 0.9, 2.6, 10.0])
def test_a_rolling_wheels_rim_runs_on_a_cycloid(distance):
    state = planar.solve(planar.load("rolling-wheel"), {"axle box": distance})
    r = 0.2

    def p(s):
        return s - r * np.sin(s / r) + 1j * r * (1 - np.cos(s / r))

    agrees(state, "P", p, reach=0.06)
    agrees(state, "B", lambda s: p(s).real - np.sqrt(0.7**2 - p(s).imag ** 2) + 0j, reach=0.06)
    wheel = state.link("wheel")
    assert wheel.angle == pytest.approx(-np.pi / 2 - distance / r, abs=1e-12)
    assert (wheel.angular_velocity, wheel.angular_acceleration) == pytest.approx((-1 / r, -0.5 / r), rel=1e-13)


@pytest.mark.parametrize("turns", [0, 1, 5])
def test_the_rim_stands_still_on_the_rail(turns):
    p = planar.solve(planar.load("rolling-wheel"), {"axle box": 2 * np.pi * 0.2 * turns}).point("P")
    np.testing.assert_allclose(p.velocity, 0, atol=1e-13)
    np.testing.assert_allclose(p.acceleration, [0, 1.0**2 / 0.2], atol=1e-11)


@pytest.mark.parametrize(("lower", "upper"), [(0.12, -0.04), (-0.5, 0.3), (2.0, 2.0)])
def test_the_centre_between_two_racks_moves_by_their_mean(lower, upper):
    state = planar.solve(planar.load("rack-differential"), {"lower": lower, "upper": upper})
    pinion, centre = state.link("pinion"), state.point("C")
    racks = np.array([[lower, 0.3, 1.0], [upper, 0.1, -2.0]])
    np.testing.assert_allclose([part[0] for part in centre[:3]], racks.mean(axis=0), atol=1e-13)
    np.testing.assert_allclose([part[1] for part in centre[:3]], 0, atol=1e-15)
    np.testing.assert_allclose(pinion[:3], (racks[0] - racks[1]) / 0.05, atol=1e-12)


# pins in slots


@pytest.mark.parametrize("degrees", [0, 50, 130, 222, 300])
def test_a_pin_in_a_slot_moves_as_a_pin_with_a_block(degrees):
    slot, block = state_turned_by("slotted-lever", "O", degrees), state_turned_by("004-QR", "O", degrees)
    for name in "ADR":
        for one, other in zip(slot.point(name)[:3], block.point(name)[:3], strict=True):
            np.testing.assert_allclose(one, other, atol=1e-11)
    for one, other in zip(slot.link("CD")[:3], block.link("CD")[:3], strict=True):
        assert one == pytest.approx(other, abs=1e-11)
    assert slot.pair("slot") == pytest.approx(block.pair("slot"), abs=1e-11)


@pytest.mark.parametrize("degrees", [0, 55, 90, 200, 305])
def test_the_scotch_yoke_moves_harmonically(degrees):
    state = state_turned_by("slotted-yoke", "O", degrees)
    agrees(state, "Y", lambda a: 0.08 * np.cos(a) + 0j)
    assert state.pair("slot")["displacement"] == pytest.approx(0.08 * np.sin(state.inputs["O"].position), abs=1e-15)
    assert state.link("yoke")[:3] == pytest.approx((0, 0, 0), abs=1e-13)


# belts and chains


@pytest.mark.parametrize(("upper", "elbow"), [(110, -95), (30, -200), (-170, 40), (900, -800)])
def test_the_drafting_head_keeps_its_angle(upper, elbow):
    a, b = np.radians([upper, elbow])
    state = planar.solve(planar.load("band-drafting-machine"), {"O": a, "E:upper arm,forearm": b})
    for link in ("elbow", "head"):
        assert state.link(link)[:3] == pytest.approx((0, 0, 0), abs=1e-12)
    x, h = state.point("X"), state.point("H")
    assert complex(*h.position) == pytest.approx(0.4 * turn(a) + 0.35 * turn(a + b), abs=1e-12)
    for part in (1, 2):
        np.testing.assert_allclose(x[part], h[part], atol=1e-12)


@pytest.mark.parametrize("degrees", [0, 30, 50, 100, 275, 1200])
def test_the_belt_arms_tip_runs_straight(degrees):
    state = state_turned_by("belt-arm", "O", degrees)
    assert [part[1] for part in state.point("T")[:3]] == pytest.approx([0, 0, 0], abs=1e-12)
    agrees(state, "T", lambda a: 0.6 * np.cos(a) + 0j)


@pytest.mark.parametrize(("sprocket", "arm"), [(0.0, 0.0), (50.0, -0.4), (-7.0, 9.0)])
def test_a_chain_on_a_swinging_arm_turns_the_wheel_by_both(sprocket, arm):
    state = planar.solve(planar.load("chain-swing-arm"), {"O:frame,sprocket": sprocket, "O:frame,arm": arm})
    moves = [state.link(name) for name in ("sprocket", "arm", "wheel")]
    for part in (0, 1, 2):
        driving, swinging, wheel = (move[part] for move in moves)
        assert wheel == pytest.approx(driving * 15 / 45 + swinging * (1 - 15 / 45), abs=1e-12)
