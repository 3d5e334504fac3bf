"""Famous linkages: straight lines, legs, valve gears, steering and lifting gear, each with a fact that it is known for.

Circles are met in the complex plane here, so that the values to compare with owe nothing to the solver.
"""

import math

import numpy as np
import pytest
from scipy.optimize import brentq

import planar
from tests.known import state_turned_by

NEAR = 1e-12  # of lengths in metres that are of the size of one


def at(state, name: str) -> complex:
    return complex(*state.point(name).position)


def speed(state, name: str) -> complex:
    return complex(*state.point(name).velocity)


def bend(state, name: str) -> complex:
    return complex(*state.point(name).acceleration)


def way(radians: float) -> complex:
    return complex(math.cos(radians), math.sin(radians))


def meet(a: complex, r: float, b: complex, s: float, side: int) -> complex:
    """Where circles of radius r about a and s about b meet, left (1) or right (-1) of the way from a to b."""
    apart = abs(b - a)
    along = (apart**2 + r**2 - s**2) / (2 * apart)
    return a + (along + 1j * side * math.sqrt(r**2 - along**2)) * (b - a) / apart


def rate(curve, t: float, h: float = 1e-3) -> complex:
    """The derivative of a curve, by differences of the fourth order."""
    return (8 * (curve(t + h) - curve(t - h)) - (curve(t + 2 * h) - curve(t - 2 * h))) / (12 * h)


# Straight lines


@pytest.mark.parametrize("degrees", [-100, -60, -20, 0, 20])
def test_harts_inversor_draws_a_straight_line(degrees):
    state = state_turned_by("hart-inversor", "B", degrees)
    g, p = at(state, "G"), at(state, "P")
    # the diagonals are parallel with the product 120^2 - 60^2, and AG and AP are half of them
    assert abs(g) * abs(p) == pytest.approx((0.120**2 - 0.060**2) / 4, rel=NEAR)
    assert (p / g).imag == pytest.approx(0, abs=NEAR)
    assert p.real == pytest.approx((0.120**2 - 0.060**2) / 4 / 0.040, abs=NEAR)
    assert speed(state, "P").real == pytest.approx(0, abs=NEAR)
    assert bend(state, "P").real == pytest.approx(0, abs=1e-11)
    assert abs(speed(state, "P")) > 0.01


@pytest.mark.parametrize("degrees", [-40, -25, -15, 0, 8])
def test_harts_a_frame_draws_the_bisector_of_its_base(degrees):
    state = state_turned_by("hart-a-frame", "A", degrees)
    assert at(state, "E").real == pytest.approx(0.1, abs=NEAR)
    assert speed(state, "E").real == pytest.approx(0, abs=NEAR)
    assert bend(state, "E").real == pytest.approx(0, abs=1e-11)
    assert abs(speed(state, "E")) > 0.001


@pytest.mark.parametrize("degrees", [-135, -80, -40, 0, 35])
def test_scott_russells_rod_ends_move_on_perpendicular_lines(degrees):
    state = state_turned_by("scott-russell", "O", degrees)
    angle, turn = math.radians(50 + degrees), 2 * math.pi
    expected = 0.3j * np.array([math.sin(angle), turn * math.cos(angle), -(turn**2) * math.sin(angle)])
    for found, value, size in zip((at, speed, bend), expected, (1, turn, turn**2), strict=True):
        assert found(state, "C") == pytest.approx(value, abs=NEAR * size)
    assert at(state, "B") == pytest.approx(0.3 * math.cos(angle), abs=NEAR)


def test_roberts_point_is_on_the_base_at_three_places_and_near_it_between():
    """P is at A0 where B stands above the middle, at B0 where A does, in the middle where all is symmetrical."""
    mechanism = planar.load("roberts-straight-line")
    height = math.sqrt(0.120**2 - 0.100**2)
    steep, flat = math.atan2(height, 0.100) + 2 * math.asin(50 / 120), math.atan2(height, 0.100)
    for angle, x in ((steep, 0.0), (math.acos(50 / 120), 0.1), (flat, 0.2)):
        assert at(planar.solve(mechanism, {"A0": angle}), "P") == pytest.approx(x, abs=1e-11)
    heights = [at(planar.solve(mechanism, {"A0": angle}), "P").imag for angle in np.linspace(flat, steep, 30)]
    assert 0.006 * 0.2 < -min(heights) < 0.007 * 0.2
    assert max(heights) < 1e-11


@pytest.mark.parametrize("degrees", [-50, -30, -11, 0, 10, 17])
def test_watts_point_runs_on_watts_curve_and_the_piston_rod_copies_it(degrees):
    state = state_turned_by("watt-parallel-motion", "A0", degrees)
    p = at(state, "P")
    # r^2 = b^2 - (a sin t +- sqrt(c^2 - a^2 cos^2 t))^2 from the middle of the pivots, squared until no root is left
    a, b, c = abs(complex(0.2, 0.05)), 0.2, 0.05
    u = p * abs(complex(4, -1)) / complex(4, -1)
    r, sine, cosine = abs(u), u.imag / abs(u), u.real / abs(u)
    root = c**2 - (a * cosine) ** 2
    assert (b**2 - r**2 - (a * sine) ** 2 - root) ** 2 == pytest.approx(4 * (a * sine) ** 2 * root, abs=1e-15)
    pivot = complex(-0.2, 0.05)
    assert at(state, "Q") - pivot == pytest.approx(2 * (p - pivot), abs=NEAR)
    assert speed(state, "Q") == pytest.approx(2 * speed(state, "P"), abs=NEAR)
    assert bend(state, "Q") == pytest.approx(2 * bend(state, "P"), abs=1e-11)


def test_watts_line_leaves_the_straight_by_the_fifth_power_of_the_way():
    mechanism = planar.load("watt-parallel-motion")
    middle = planar.solve(mechanism, {"A0": 0.0})
    assert speed(middle, "P").real == pytest.approx(0, abs=1e-14)
    assert bend(middle, "P").real == pytest.approx(0, abs=1e-13)
    near, far = (at(planar.solve(mechanism, {"A0": angle}), "P") for angle in (0.05, 0.1))
    assert far.real / near.real == pytest.approx((far.imag / near.imag) ** 5, rel=0.01)


@pytest.mark.parametrize("degrees", range(-150, 210, 45))
def test_hoeckens_curve_in_closed_form_and_as_that_of_its_cognate(degrees):
    """AP is a diameter about B through C, so CP is square to CA; and Chebyshev's 5 : 4 : 2 draws the same curve."""
    state = state_turned_by("hoeken-straight-line", "O", degrees)
    turn = way(math.radians(150 + degrees))
    arm = 0.1 * turn - 0.2
    p = at(state, "P")
    assert p == pytest.approx(0.2 - 1j * arm / abs(arm) * math.sqrt(0.5**2 - abs(arm) ** 2), abs=NEAR)
    assert abs(p - 0.1 * turn) == pytest.approx(0.5, abs=NEAR)
    assert abs(p + 0.1 * turn - 0.4) == pytest.approx(0.5, abs=NEAR)


def test_hoeckens_line_is_straight_and_its_speed_even():
    states = [state_turned_by("hoeken-straight-line", "O", degrees - 150) for degrees in range(90, 271, 10)]
    points = [at(state, "P") for state in states]
    for place, x in ((0, 0.4), (9, 0.2), (18, 0.0)):
        assert points[place] == pytest.approx(complex(x, 0.4), abs=NEAR)
    assert -1e-12 < min(p.imag for p in points) - 0.4 < max(p.imag for p in points) - 0.4 < 0.01 * 0.1
    crank = 2 * math.pi * 0.1
    assert speed(states[9], "P") == pytest.approx(-4 / 3 * crank, abs=NEAR)
    assert all(abs(speed(s, "P").real / crank + 4 / 3) < 0.005 for s in states[7:12])


@pytest.mark.parametrize("degrees", [-39, -20, -5, 0, 9])
def test_evans_beam_keeps_a_right_angle_at_the_radius_bars_pivot(degrees):
    state = state_turned_by("evans-grasshopper", "O", degrees)
    e, p = at(state, "E"), at(state, "P")
    assert (p * e.conjugate()).real == pytest.approx(0, abs=NEAR)  # Thales: A is as far from O as from E and P
    a = 0.3 * way(math.radians(15 + degrees))
    assert e == pytest.approx(meet(a, 0.3, complex(0.57, -0.6), 0.6, 1), abs=NEAR)
    assert abs(p.real) < 0.0003
    assert abs(p.imag) == pytest.approx(0.6 * abs(math.sin(math.radians(15 + degrees))), abs=0.002)


# Legs


def jansen(t: float) -> complex:
    hip, a = complex(-0.038, -0.0078), 0.015 * way(t)
    u = meet(a, 0.050, hip, 0.0415, -1)
    low = meet(a, 0.0619, hip, 0.0393, 1)
    v = hip + 0.0401 * (u - hip) / abs(u - hip) * way(math.acos((415**2 + 401**2 - 558**2) / (2 * 415 * 401)))
    w = meet(v, 0.0394, low, 0.0367, -1)
    return low + 0.049 * (w - low) / abs(w - low) * way(math.acos((367**2 + 490**2 - 657**2) / (2 * 367 * 490)))


def klann(t: float) -> complex:
    upper, lower, shaft = complex(0.1366, 0.1366), complex(0.1009, 0.0574), complex(0.1599, 0.075)
    pin, elbow = complex(0.1331, 0.075), complex(0.0741, 0.075)
    knee, hip = complex(0.0232, 0.0866), complex(0.0866, 0.1366)
    c = shaft + abs(pin - shaft) * way(t)
    e = meet(c, abs(elbow - pin), lower, abs(elbow - lower), -1)
    k = c + (knee - pin) * (e - c) / (elbow - pin)
    h = meet(k, abs(hip - knee), upper, abs(hip - upper), 1)
    return k - knee * (h - k) / (hip - knee)


LEGS = [("jansen-leg", 60, jansen), ("klann-leg", 180, klann)]


@pytest.mark.parametrize("degrees", range(0, 360, 40))
@pytest.mark.parametrize(("leg", "start", "curve"), LEGS, ids=["jansen", "klann"])
def test_a_legs_foot_as_circles_meet(leg, start, curve, degrees):
    state = state_turned_by(leg, "O", degrees)
    angle = math.radians(start + degrees)
    assert at(state, "foot") == pytest.approx(curve(angle), abs=NEAR)
    assert speed(state, "foot") == pytest.approx(-2 * math.pi * rate(curve, angle), abs=1e-9)


@pytest.mark.parametrize(
    ("leg", "turn", "stride", "lift", "low"),
    [
        ("jansen-leg", 180, (0.067, 0.069), (0.022, 0.023), 0.002),
        ("klann-leg", 165, (0.112, 0.114), (0.046, 0.047), 0.005),
    ],
)
def test_a_leg_steps_flat_for_half_the_turn(leg, turn, stride, lift, low):
    """Near the ground for about half the turn, over most of the stride, and well lifted on the way back."""
    mechanism = planar.load(leg)
    start = mechanism.inputs[0].position
    run = planar.cycle(mechanism, 72, start, start + 2.0 * math.pi).point("foot").position[:-1]
    feet = run @ np.array([1, 1j])
    for index in (7, 40):  # a position of the run is that to which the crank leads alone
        assert feet[index] == pytest.approx(at(state_turned_by(leg, "O", 5 * index), "foot"), abs=NEAR)
    down = feet.imag < feet.imag.min() + low
    assert stride[0] < np.ptp(feet.real) < stride[1]
    assert lift[0] < np.ptp(feet.imag) < lift[1]
    assert 5 * down.sum() >= turn
    assert np.ptp(feet[down].real) > 0.9 * np.ptp(feet.real)


def test_klanns_leg_is_drawn_as_in_the_patent():
    state = planar.solve(planar.load("klann-leg"))
    for name, place in (("foot", 0), ("K", complex(0.0232, 0.0866)), ("H", complex(0.0866, 0.1366))):
        assert at(state, name) == pytest.approx(place, abs=NEAR)


# Drawing and sewing


@pytest.mark.parametrize(("first", "second"), [(30, -65), (60, -20), (-20, -80), (45, -120)])
def test_a_drafting_machines_head_goes_anywhere_and_never_turns(first, second):
    given = {"A": math.radians(first), "E": math.radians(second)}
    state = planar.solve(planar.load("drafting-machine"), given)
    arms = 0.4 * way(given["A"]), 0.35 * way(given["E"])
    head = state.link("head")
    assert np.exp(1j * head.angle) == pytest.approx(1, abs=NEAR)
    assert (head.angular_velocity, head.angular_acceleration) == pytest.approx((0, 0), abs=1e-11)
    assert at(state, "G") == pytest.approx(sum(arms) + complex(0.02, 0.03), abs=NEAR)
    for name in ("G", "S", "T"):
        assert speed(state, name) == pytest.approx(1j * (0.4 * arms[0] - 0.6 * arms[1]), abs=NEAR)
        assert bend(state, name) == pytest.approx(-(0.4**2) * arms[0] - 0.6**2 * arms[1], abs=1e-11)


def eyelet(t: float) -> complex:
    c = 0.012 * way(t - math.radians(25))
    d = meet(c, 0.030, complex(-0.030, 0.025), 0.028, -1)
    return c + 0.070 * (d - c) / 0.030 * way(math.radians(15))


@pytest.mark.parametrize("degrees", range(0, 360, 45))
def test_needle_and_take_up_of_a_sewing_machine_in_closed_form(degrees):
    state = state_turned_by("sewing-machine", "O", degrees)
    t, turn = math.radians(60 + degrees), 40 * math.pi
    x, y = 0.016 * math.cos(t), 0.016 * math.sin(t)
    drop = math.sqrt(0.05**2 - x**2)
    assert at(state, "needle") == pytest.approx(1j * (y - drop - 0.09), abs=NEAR)
    assert speed(state, "needle") == pytest.approx(1j * turn * x * (1 - y / drop), abs=1e-11)
    assert at(state, "eyelet") == pytest.approx(eyelet(t), abs=NEAR)
    assert speed(state, "eyelet") == pytest.approx(turn * rate(eyelet, t), abs=1e-9)


def test_the_take_up_is_highest_after_the_needle_and_rises_faster_than_it_falls():
    angles = np.arange(0, 360, 5)
    heights = [at(state_turned_by("sewing-machine", "O", degrees - 60), "eyelet").imag for degrees in angles]
    top, bottom = angles[np.argmax(heights)], angles[np.argmin(heights)]
    assert 50 <= top - 90 <= 70  # the needle is highest at 90 and lowest at 270 degrees
    assert 60 <= bottom - 270 <= 90
    assert (top - bottom) % 360 < 170


# Valve gears


def stephenson(crank: float, arm: float) -> complex:
    """The die by a search for the fore rod's angle: the back rod fits at any angle, the hanger at one."""
    f, g = 0.08 * way(crank - math.radians(105)), 0.08 * way(crank + math.radians(105))
    n = complex(1.24, 0.3) + 0.25 * way(arm)

    def ends(angle: float) -> tuple[complex, complex]:
        a = f + 1.5 * way(angle)
        return a, meet(a, 0.36, g, 1.5, 1)

    a, b = ends(brentq(lambda angle: abs(sum(ends(angle)) / 2 - n) - 0.3, -0.2, 0.3, xtol=1e-15, rtol=1e-15))
    return a.real - a.imag * (b - a).real / (b - a).imag


@pytest.mark.parametrize("arm", [-30, -10, 0, 25])
@pytest.mark.parametrize("crank", range(0, 360, 60))
def test_stephensons_valve_in_all_gears(crank, arm):
    given = {"O": math.radians(crank), "W": math.radians(arm)}
    state = planar.solve(planar.load("stephenson-valve-gear"), given)
    assert at(state, "D") == pytest.approx(stephenson(given["O"], given["W"]), abs=1e-11)
    slope = rate(lambda t: stephenson(t, given["W"]), given["O"])
    assert speed(state, "D") == pytest.approx(-4 * math.pi * slope, abs=1e-8)


def test_with_open_rods_stephensons_lead_grows_and_travel_shrinks_to_mid_gear():
    mechanism = planar.load("stephenson-valve-gear")

    def valve(crank: float, arm: float) -> float:
        return at(planar.solve(mechanism, {"O": math.radians(crank), "W": math.radians(arm)}), "D").real

    gears = (-30, -15, 0)
    leads = [(valve(180, arm) - valve(0, arm)) / 2 for arm in gears]
    travels = [np.ptp([valve(crank, arm) for crank in range(0, 360, 15)]) for arm in gears]
    assert leads == sorted(leads)
    assert travels == sorted(travels, reverse=True)
    assert travels[2] == pytest.approx(2 * leads[2], rel=0.01)  # in mid gear the valve moves with the crank
    assert travels[0] > 2 * travels[2]
    assert np.ptp([valve(crank, 30) for crank in range(0, 360, 15)]) == pytest.approx(travels[0], rel=0.03)  # astern


@pytest.mark.parametrize("die", [168, 174, 180, 186, 192])
@pytest.mark.parametrize(("crank", "side"), [(0, 1), (180, -1)])
def test_walschaerts_lead_is_the_same_in_every_gear(crank, side, die):
    """At a dead centre the lever leans by 300 in 780, so the valve stands 65 x 300 / 780 mm off its middle."""
    given = {"O": math.radians(crank), "K": math.radians(die)}
    state = planar.solve(planar.load("walschaerts-valve-gear"), given)
    assert at(state, "V") == pytest.approx(1.9 + side * 0.025 + 0.5j, abs=NEAR)
    assert at(state, "R") == pytest.approx(at(state, "K"), abs=NEAR)


def walschaerts(crank: float, die: float) -> complex:
    a, e, t = 0.3 * way(crank), 0.18j * way(crank), complex(0.9, 0.56)
    x = a.real + math.sqrt(1.5**2 - a.imag**2) - 0.16j
    tail = meet(e, 0.82, t, abs(complex(0.1, 0.56)), -1)
    link = (tail - t) / complex(-0.1, -0.56)
    d = t + link * (1 + way(die))

    def valve(lean: float) -> complex:
        height = 0.5 + 0.065 * math.cos(lean)
        return d.real + math.sqrt(1 - (height - d.imag) ** 2) + 0.065 * math.sin(lean) + 0.5j

    def gap(lean: float) -> float:
        return abs(valve(lean) + 0.715 * complex(math.sin(lean), -math.cos(lean)) - x) - 0.4

    return valve(brentq(gap, -0.6, 0.6, xtol=1e-15, rtol=1e-15))


@pytest.mark.parametrize("die", [168, 175, 180, 190])
@pytest.mark.parametrize("crank", range(20, 360, 55))
def test_walschaerts_valve_in_all_gears(crank, die):
    given = {"O": math.radians(crank), "K": math.radians(die)}
    state = planar.solve(planar.load("walschaerts-valve-gear"), given)
    assert at(state, "V") == pytest.approx(walschaerts(given["O"], given["K"]), abs=1e-11)
    slope = rate(lambda t: walschaerts(t, given["K"]), given["O"])
    assert speed(state, "V") == pytest.approx(4 * math.pi * slope, abs=1e-8)


# Steering and suspension


def test_ackermanns_wheels_roll_on_one_centre_at_the_design_angle_and_nearly_below_it():
    mechanism = planar.load("ackermann-steering")

    def right(left: float) -> float:
        return planar.solve(mechanism, {"KL": left}).link("right knuckle").angle

    design = math.radians(35)
    outer = right(design)
    assert 1 / math.tan(outer) - 1 / math.tan(design) == pytest.approx(0.5, abs=1e-11)
    assert right(0.0) == pytest.approx(0, abs=NEAR)
    assert right(-outer) == pytest.approx(-design, abs=1e-11)  # the other way round the left wheel is the outer one
    errors = [right(inner) - math.atan(1 / (1 / math.tan(inner) + 0.5)) for inner in np.radians(range(5, 35, 5))]
    assert 0 < min(errors) < max(errors) < math.radians(0.5)
    assert right(math.radians(40)) < math.atan(1 / (1 / math.tan(math.radians(40)) + 0.5))


@pytest.mark.parametrize("slide", [-0.11, -0.06, -0.01, 0.03, 0.1])
def test_davis_gear_is_right_at_every_angle(slide):
    state = planar.solve(planar.load("davis-steering"), {"rack": slide})
    left, right = state.link("left knuckle"), state.link("right knuckle")
    # the left wheel is the inner one in a turn to the left, and the signs turn with the turn
    assert 1 / math.tan(right.angle) - 1 / math.tan(left.angle) == pytest.approx(0.5, abs=1e-11)
    # a rod's end stands 200 ahead of its pivot and 50 further in, moved by the slide
    for knuckle, sign in ((left, 1), (right, -1)):
        side = 0.05 * sign + slide
        assert knuckle.angle == pytest.approx(sign * math.atan(0.25) - math.atan(side / 0.2), abs=NEAR)
        assert knuckle.angular_velocity == pytest.approx(0.1 * 0.2 / (0.2**2 + side**2), rel=1e-11)


@pytest.mark.parametrize("degrees", [-10, -5, 0, 6, 14])
def test_a_double_wishbones_wheel_turns_about_the_point_where_its_arms_lines_meet(degrees):
    state = state_turned_by("double-wishbone", "LA", degrees)
    la, ua = complex(0.25, 0.19), complex(0.33, 0.44)
    lower = way(math.radians(degrees - 3))
    lb = la + 0.38 * lower
    ub = meet(lb, abs(complex(-20, 270)) / 1000, ua, 0.28, -1)
    assert (at(state, "LB"), at(state, "UB")) == pytest.approx((lb, ub), abs=NEAR)
    # the lines la + s lower and ua + t (ub - ua)
    upper = ub - ua
    centre = la + lower * ((ua - la) * upper.conjugate()).imag / (lower * upper.conjugate()).imag
    turn = (0.38j * lower / (lb - centre) / 1j).real
    assert state.link("knuckle").angular_velocity == pytest.approx(turn, rel=1e-10)
    contact = at(state, "contact")
    assert speed(state, "contact") == pytest.approx(1j * turn * (contact - centre), abs=1e-11)
    # the body rolls about the point of its middle line that is on the line from contact to centre
    roll = contact + (centre - contact) * contact.real / (contact - centre).real
    assert roll.real == pytest.approx(0, abs=NEAR)
    assert (speed(state, "contact") * (contact - roll).conjugate()).real == pytest.approx(0, abs=1e-11)


def test_a_double_wishbone_tilts_the_rising_wheels_top_inward():
    tilts = [state_turned_by("double-wishbone", "LA", degrees).link("knuckle").angle for degrees in (0, 5, 10, 15)]
    assert tilts == sorted(tilts)
    assert math.radians(2) < tilts[-1] - tilts[0] < math.radians(3)


# Folding and lifting


def jack(knee: float) -> float:
    """The jack's length for an angle of the folding brace at its knee, in radians from straight."""
    reach, c, h = abs(0.6 + 0.645 * way(knee)), complex(0.8, -0.05), complex(0.6, 0.3)
    leg = meet(0, 1.0, c, reach, -1)
    return abs(0.25 * leg - h)


@pytest.mark.parametrize("degrees", [80, 40, 20, 5, 1])
def test_a_landing_gears_brace_stands_still_for_the_leg_as_it_straightens(degrees):
    knee = math.radians(degrees)
    state = planar.solve(planar.load("landing-gear"), {"jack": jack(knee)})
    leg, upper, lower = (state.link(name) for name in ("leg", "upper brace", "lower brace"))
    assert np.exp(1j * (upper.angle - lower.angle)) == pytest.approx(np.exp(1j * knee), abs=1e-10)
    # the lower brace keeps its length, so the leg's and the upper brace's ends move alike along it
    ratio = 1.0 * math.sin(leg.angle - lower.angle) / (0.6 * math.sin(upper.angle - lower.angle))
    assert upper.angular_velocity == pytest.approx(ratio * leg.angular_velocity, rel=1e-9)
    # and the jack: its rate is the leg's turn times the distance of its line from the leg's pivot
    g, h = at(state, "G"), complex(0.6, 0.3)
    assert leg.angular_velocity == pytest.approx(0.1 * abs(g - h) / (g.conjugate() * h).imag * -1, rel=1e-9)
    assert (ratio > 30) == (degrees == 1)


def test_a_landing_gear_goes_no_further_than_its_straight_brace():
    mechanism = planar.load("landing-gear")
    planar.solve(mechanism, {"jack": jack(0.0) - 1e-6})
    with pytest.raises(planar.NoAnswer):
        planar.solve(mechanism, {"jack": jack(0.0) + 1e-6})


def test_a_level_luffing_cranes_hook_stays_level_over_its_reach():
    hooks = []
    for degrees in np.linspace(62.1, 85.8, 21):
        state = state_turned_by("level-luffing-crane", "O", degrees - 74)
        a = 24 * way(math.radians(degrees))
        b = meet(a, 2.6, complex(-1, 7.7), 18.6, -1)
        hooks.append(at(state, "hook"))
        assert hooks[-1] == pytest.approx(a + (a - b) / 2.6 * 13.8 * way(math.radians(9.8)), abs=1e-11)
    assert np.ptp(np.real(hooks)) > 12
    assert np.ptp(np.imag(hooks)) < 0.040
    assert all(np.diff(np.real(hooks)) < 0)


@pytest.mark.parametrize("slide", [0.06, 0.2, 0.3, 0.44])
def test_an_umbrellas_ribs_open_alike_by_the_cosine_rule(slide):
    state = planar.solve(planar.load("umbrella"), {"stroke": slide})
    cosine = (slide**2 + 0.23**2 - 0.22**2) / (2 * slide * 0.23)
    sine = math.sqrt(1 - cosine**2)
    assert at(state, "right tip") == pytest.approx(0.5 * complex(sine, -cosine), abs=NEAR)
    assert at(state, "left tip") == pytest.approx(0.5 * complex(-sine, -cosine), abs=NEAR)
    opening = 0.2 * (1 / 0.23 - cosine / slide) / sine  # d(angle)/d(slide) by the chain rule, at -0.2 m/s
    assert state.link("right rib").angular_velocity == pytest.approx(opening, rel=1e-10)
    assert state.link("left rib").angular_velocity == pytest.approx(-opening, rel=1e-10)
