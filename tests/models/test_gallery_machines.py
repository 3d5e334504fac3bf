"""Famous linkages that come along, each with a fact that it is known for."""

from dataclasses import replace
from itertools import pairwise

import networkx as nx
import numpy as np
import pytest
from scipy.optimize import brentq

import planar
from planar.foundation.errors import Outcome
from planar.foundation.units import parse_quantity
from planar.model.link_graph import link_pair_graph
from tests.closed_forms import between, meeting, piston
from tests.known import loop_sizes, state_turned_by


def at(model: str, position: float):
    """The model's one input at a position (rad or m), in the assembly that the file shows."""
    mechanism = planar.load(model)
    (given,) = mechanism.inputs
    return planar.solve(mechanism, {given.pair: position})


def place(state, point: str) -> complex:
    return complex(*state.point(point).position)


def velocity(state, point: str) -> complex:
    return complex(*state.point(point).velocity)


def dot(a: complex, b: complex) -> float:
    return (a * b.conjugate()).real


def same_direction(angle: float, other: float, within: float = 1e-12):
    assert np.exp(1j * angle) == pytest.approx(np.exp(1j * other), abs=within)


def increments(angles) -> np.ndarray:
    """Steps from each angle to the next, the short way round."""
    return np.angle(np.exp(1j * np.diff(angles)))


TURN = range(0, 360, 30)
"""Degrees round a whole turn, counted from the file's own position."""


# Four-bars by Grashof's rule


@pytest.mark.parametrize("degrees", TURN)
def test_the_crank_rockers_output_in_closed_form(degrees):
    state = state_turned_by("crank-rocker", "A0", degrees)
    crank = 0.050 * np.exp(1j * np.radians(60 + degrees))
    rocker = state.link("rocker")
    same_direction(rocker.angle, np.angle(meeting(crank, 0.180, 0.200, 0.120) - 0.200))
    coupler = state.link("coupler").angle
    # what both ends of the coupler have along it is alike
    along = 0.050 * np.sin(np.radians(60 + degrees) - coupler) / (0.120 * np.sin(rocker.angle - coupler))
    assert rocker.angular_velocity == pytest.approx(along * 2 * np.pi, abs=1e-12)


def test_the_crank_rocker_swings_between_its_two_triangles():
    stretched = at("crank-rocker", between(0.200, 0.230, 0.120))
    folded = at("crank-rocker", np.pi + between(0.200, 0.130, 0.120))
    for state, reach in ((stretched, 0.230), (folded, 0.130)):
        assert state.link("rocker").angle == pytest.approx(np.pi - between(0.200, 0.120, reach), abs=1e-13)
        assert state.link("rocker").angular_velocity == pytest.approx(0.0, abs=1e-12)
    swing = folded.link("rocker").angle - stretched.link("rocker").angle
    assert np.degrees(swing) == pytest.approx(49.6, abs=0.05)
    angles = [state_turned_by("crank-rocker", "A0", degrees).link("rocker").angle for degrees in range(0, 360, 10)]
    assert stretched.link("rocker").angle < min(angles)
    assert max(angles) < folded.link("rocker").angle


def test_both_cranks_of_the_drag_link_turn_fully():
    """The follower never turns back, and is a whole turn on after one of the driver, which it does not share evenly."""
    angles = [state_turned_by("drag-link", "A0", degrees).link("follower").angle for degrees in range(0, 361, 15)]
    steps = increments(angles)
    assert min(steps) > 0
    assert sum(steps) == pytest.approx(2 * np.pi, abs=1e-12)
    assert max(steps) > 2 * min(steps)


@pytest.mark.parametrize("degrees", TURN)
def test_the_drag_links_speeds_are_as_the_distances_of_the_shafts_from_the_couplers_line(degrees):
    state = state_turned_by("drag-link", "A0", degrees)
    a, b = place(state, "A"), place(state, "B")
    across = 1j * (b - a) / abs(b - a)
    ratio = dot(a, across) / dot(a - 0.040, across)
    assert state.link("follower").angular_velocity == pytest.approx(ratio * 2 * np.pi, rel=1e-12)


def test_the_double_rockers_coupler_turns_fully_and_its_rockers_do_not():
    states = [state_turned_by("double-rocker", "A", degrees) for degrees in range(0, 361, 15)]
    coupler, left, right = (
        np.array([state.link(name).angle for state in states]) for name in ("coupler", "left rocker", "right rocker")
    )
    for base in (0.0, left, right):
        steps = increments(coupler - base)
        assert min(steps) > 0
        assert sum(steps) == pytest.approx(2 * np.pi, abs=1e-12)
    for rocker in (left, right):
        assert sum(increments(rocker)) == pytest.approx(0.0, abs=1e-12)
    # each turns back where the coupler and the other rocker are in line
    for angles, own, other in ((left, 0.100, 0.090), (np.pi - right, 0.090, 0.100)):
        assert between(own, 0.120, other - 0.040) <= min(angles) + 1e-12
        assert max(angles) <= between(own, 0.120, other + 0.040) + 1e-12


@pytest.mark.parametrize("reach", [0.090 + 0.040, 0.090 - 0.040])
def test_the_double_rocker_turns_back_in_its_triangle(reach):
    """At A the coupler points along AB0, or folded back: the angle of the triangle at A gives the input exactly."""
    inner = between(0.100, reach, 0.120)  # from AA0 to AB0, anticlockwise
    folded = 0.0 if reach > 0.090 else np.pi
    state = at("double-rocker", inner + folded - np.pi)
    assert state.link("left rocker").angle == pytest.approx(between(0.100, 0.120, reach), abs=1e-13)
    assert state.link("left rocker").angular_velocity == pytest.approx(0.0, abs=1e-12)


LOCK = between(0.090, 0.150, 0.155)
"""The triple-rocker's input where coupler and follower stretch to 155 mm."""


@pytest.mark.parametrize("sign", [-1, 1])
def test_the_triple_rocker_is_held_fast_where_coupler_and_follower_stretch(sign):
    state = at("triple-rocker", sign * (LOCK - 1e-5))
    coupler, follower = state.link("coupler").angle, state.link("follower").angle
    # so near, the two are stretched but for the root of what is left
    assert np.exp(1j * coupler) == pytest.approx(-np.exp(1j * follower), abs=0.02)
    with pytest.raises(planar.NoAnswer) as caught:
        at("triple-rocker", sign * (LOCK + 1e-6))
    assert caught.value.outcome is Outcome.DEAD_POINT
    mechanism = planar.load("triple-rocker")
    beyond = mechanism.inputs[0]._replace(position=sign * (LOCK + 1e-6))
    with pytest.raises(planar.NoAnswer) as caught:
        planar.solve(replace(mechanism, inputs=(beyond,)))
    assert caught.value.outcome is Outcome.CANNOT_BE_ASSEMBLED


@pytest.mark.parametrize("degrees", [-75, -40, 0, 40, 75])
def test_the_triple_rocker_swings_across_the_line_of_its_fixed_pins(degrees):
    driver = 0.090 * np.exp(1j * np.radians(degrees))
    state = at("triple-rocker", np.radians(degrees))
    assert place(state, "B") == pytest.approx(meeting(driver, 0.070, 0.150, 0.085), abs=1e-14)


# Parallel cranks and their crossed sister


@pytest.mark.parametrize("degrees", [0, 30, 90, 180, 200, 270, 360])
def test_the_third_crank_carries_the_rod_past_the_flat_positions(degrees):
    state = at("three-parallel-cranks", np.radians(degrees))
    crank = 0.060 * np.exp(1j * np.radians(degrees))
    assert state.link("rod").angle == pytest.approx(0.0, abs=1e-13)
    assert state.link("rod").angular_velocity == pytest.approx(0.0, abs=1e-12)
    for point, centre in (("A", 0), ("B", 0.240), ("C", 0.120 - 0.090j), ("E", 0.050 + 0.070j)):
        assert place(state, point) == pytest.approx(centre + crank, abs=1e-15)
        assert velocity(state, point) == pytest.approx(4j * np.pi * crank, abs=1e-12)
    for name in ("crank B", "crank C"):
        assert state.link(name).angular_velocity == pytest.approx(4 * np.pi, rel=1e-12)


@pytest.mark.parametrize("degrees", [1, 60, 120, 179])
def test_a_locomotives_wheels_turn_alike_and_the_rod_stays_level(degrees):
    state = at("coupled-wheels", np.radians(degrees))
    crank = 0.330 * np.exp(1j * np.radians(degrees))
    for point, centre in (("A", 0), ("B", 1.5), ("C", 3.0)):
        assert place(state, point) == pytest.approx(centre + crank, abs=1e-13)
    assert state.link("rod").angular_velocity == pytest.approx(0.0, abs=1e-11)
    for wheel in ("wheel B", "wheel C"):
        assert state.link(wheel).angular_velocity == pytest.approx(6 * np.pi, rel=1e-11)


@pytest.mark.parametrize("degrees", [5, 40, 70, 110, 150, 175])
def test_the_antiparallelogram_turns_as_two_ellipses_roll(degrees):
    """Polar equation of the ellipse with foci 60 mm and major axis 100 mm, about the focus at A0."""
    state = at("antiparallelogram", np.radians(degrees))
    a, b = place(state, "A"), place(state, "B")
    first = (0.100**2 - 0.060**2) / (2 * (0.100 - 0.060 * np.cos(np.radians(degrees))))
    crossing = (a + (b - a) * a.imag / (a.imag - b.imag)).real
    assert crossing == pytest.approx(first, abs=1e-13)
    assert crossing + abs(a - crossing) == pytest.approx(0.100, abs=1e-13)
    assert (0.100 - crossing) + abs(b - crossing) == pytest.approx(0.100, abs=1e-13)
    ratio = -first / (0.100 - first)
    assert state.link("follower").angular_velocity == pytest.approx(ratio * 2 * np.pi, rel=1e-11)
    # integrated: the tangents of the half angles keep their ratio
    half = np.tan(state.link("follower").angle / 2) / np.tan(np.radians(degrees) / 2)
    assert half == pytest.approx(-(0.100 + 0.060) / (0.100 - 0.060), rel=1e-10)


# The slider-crank and its inversions


def test_the_offset_slider_cranks_stroke_and_times():
    r, rod, e = 0.060, 0.200, 0.040
    far, near = np.arcsin(e / (rod + r)), np.pi + np.arcsin(e / (rod - r))
    ends = [at("offset-slider-crank", angle) for angle in (far, near)]
    for state in ends:
        assert state.pair("stroke")["velocity"] == pytest.approx(0.0, abs=1e-13)
    reached = [state.pair("stroke")["displacement"] for state in ends]
    stroke = np.sqrt((rod + r) ** 2 - e**2) - np.sqrt((rod - r) ** 2 - e**2)
    assert reached[0] - reached[1] == pytest.approx(stroke, abs=1e-14)
    assert stroke > 2 * r
    # the block comes back over the greater part of the turn
    assert (near - far) / (2 * np.pi + far - near) == pytest.approx(1.09, abs=0.001)
    for start, stop, way in ((far, near, -1), (near, far + 2 * np.pi, 1)):
        between_ends = np.linspace(start, stop, 8)[1:-1]
        assert all(way * at("offset-slider-crank", a).pair("stroke")["velocity"] > 0 for a in between_ends)


@pytest.mark.parametrize("degrees", TURN)
def test_the_oscillating_cylinder_points_at_the_crank_pin(degrees):
    state = state_turned_by("oscillating-cylinder", "O", degrees)
    pin = 0.050 * np.exp(1j * np.radians(60 + degrees))
    way, moved = pin - 0.180, 4j * np.pi * pin
    cylinder, stroke = state.link("cylinder"), state.pair("stroke")
    same_direction(cylinder.angle, np.angle(way))
    assert stroke["displacement"] == pytest.approx(abs(way), abs=1e-14)
    assert cylinder.angular_velocity == pytest.approx((moved / way).imag, abs=1e-12)
    assert stroke["velocity"] == pytest.approx(dot(moved, way) / abs(way), abs=1e-13)


@pytest.mark.parametrize("side", [1, -1])
def test_the_oscillating_cylinder_turns_back_where_the_crank_is_square_to_the_rod(side):
    state = at("oscillating-cylinder", side * np.arccos(50 / 180))
    same_direction(state.link("cylinder").angle, np.pi - side * np.arcsin(50 / 180))
    assert state.link("cylinder").angular_velocity == pytest.approx(0.0, abs=1e-12)


def test_the_shaper_returns_in_half_the_time():
    """The lever turns back where the crank is square to it: 60 degrees from the line OC, either side."""
    left, right = (at("crank-and-slotted-lever", np.radians(degrees)) for degrees in (210, 330))
    for state, lean in ((left, 30), (right, -30)):
        assert state.link("lever").angle == pytest.approx(np.radians(90 + lean), abs=1e-13)
        assert state.pair("ram")["velocity"] == pytest.approx(0.0, abs=1e-13)
    stroke = right.pair("ram")["displacement"] - left.pair("ram")["displacement"]
    assert stroke == pytest.approx(2 * 0.340 * np.sin(np.radians(30)), abs=1e-14)
    # the ram goes one way over 120 degrees of the crank, the other over 240: a ratio of two
    speeds = {d: at("crank-and-slotted-lever", np.radians(d)).pair("ram")["velocity"] for d in range(0, 360, 15)}
    assert all((speeds[d] > 0) == (210 < d < 330) for d in speeds if d not in (210, 330))
    # upright, crank pin and lever end are in one line with C: at 60 mm on the return, at 180 mm on the cut
    assert speeds[270] == pytest.approx(0.340 * 2 * np.pi * 60 / 60, rel=1e-12)
    assert speeds[90] == pytest.approx(-0.340 * 2 * np.pi * 60 / 180, rel=1e-12)


@pytest.mark.parametrize("degrees", TURN)
def test_the_scotch_yokes_motion_is_harmonic(degrees):
    state = state_turned_by("scotch-yoke", "O", degrees)
    w, angle = 10 * np.pi, np.radians(60 + degrees)
    wanted = 0.075 * np.array([np.cos(angle), -w * np.sin(angle), -w * w * np.cos(angle)])
    stroke = state.pair("stroke")
    assert [stroke[part] for part in ("displacement", "velocity", "acceleration")] == pytest.approx(
        wanted, abs=1e-13 * w * w
    )
    assert stroke["displacement"] == pytest.approx(wanted[0], abs=1e-15)


@pytest.mark.parametrize("degrees", TURN)
def test_the_rotary_engines_pistons_move_as_in_an_engine_at_rest(degrees):
    state = state_turned_by("rotary-engine", "O", degrees)
    r, rod, w = 0.060, 0.200, 40 * np.pi
    for k in range(7):
        turn = np.radians(60 + degrees + 360 * k / 7)
        a = turn - np.pi / 2  # from the fixed crank, which points upwards
        far, slope, _ = piston(a, r, rod)
        cylinder = state.pair(f"cylinder {k + 1}")
        assert cylinder["displacement"] == pytest.approx(far, abs=1e-14)
        assert cylinder["velocity"] == pytest.approx(w * slope, abs=1e-12 * r * w)
        # and round the pin each runs on a circle
        pin = place(state, f"P{k + 1}")
        assert pin == pytest.approx(far * np.exp(1j * turn), abs=1e-14)
        assert abs(pin - 0.060j) == pytest.approx(rod, abs=1e-14)


@pytest.mark.parametrize("degrees", [-60, -20, 0, 15, 50, 90])
def test_the_hand_pumps_plunger_goes_straight(degrees):
    state = state_turned_by("hand-pump", "O", degrees)
    a, w = state.link("handle").angle, np.radians(60)
    assert a == pytest.approx(np.radians(15 + degrees), abs=1e-13)  # the plunger's own axis points upwards
    r, rod = 0.090, 0.260
    root = np.sqrt(rod**2 - (r * np.cos(a)) ** 2)
    assert place(state, "O") == pytest.approx(1j * (root - r * np.sin(a)), abs=1e-14)
    lift = r * np.cos(a) * (r * np.sin(a) / root - 1) * w
    assert velocity(state, "O") == pytest.approx(1j * lift, abs=1e-13)
    assert velocity(state, "bucket") == pytest.approx(1j * lift, abs=1e-13)
    assert velocity(state, "H") == pytest.approx(1j * lift + 0.700j * w * np.exp(1j * a), abs=1e-13)


@pytest.mark.parametrize("slide", [-0.6, -0.1, 0.0, 0.5, 0.84])
def test_rapsons_slide_pulls_the_harder_the_further_the_helm(slide):
    state = at("rapsons-slide", slide)
    tiller, h = state.link("tiller"), 1.2
    helm = np.pi / 2 - tiller.angle
    assert h * np.tan(helm) == pytest.approx(slide, abs=1e-14)
    # torque over pull, by power
    assert 0.1 / -tiller.angular_velocity == pytest.approx(h / np.cos(helm) ** 2, rel=1e-12)
    # the second derivative of the arc tangent
    bend = 2 * h * slide / (h**2 + slide**2) ** 2 * 0.1**2
    assert tiller.angular_acceleration == pytest.approx(bend, abs=1e-14)


# Knees, wipers and a gas engine


@pytest.mark.parametrize("degrees", TURN)
def test_the_toggle_press_follows_its_triangles(degrees):
    state = state_turned_by("toggle-press", "A0", degrees)
    centre, angle, w = 0.260 - 0.160j, np.radians(60 + degrees), 2 * np.pi
    pin = centre + 0.040 * np.exp(1j * angle)
    knee = meeting(pin, 0.216, 0, 0.200)
    assert place(state, "B") == pytest.approx(knee, abs=1e-14)
    assert place(state, "D") == pytest.approx(2j * knee.imag, abs=1e-14)
    # the knee's speed along the rod is the crank pin's
    rod, moved = pin - knee, 1j * w * (pin - centre)
    turn = dot(moved, rod) / dot(1j * knee, rod)
    assert velocity(state, "B") == pytest.approx(1j * turn * knee, abs=1e-12)
    assert velocity(state, "D") == pytest.approx(2j * turn * knee.real, abs=1e-12)
    # a push F square to the line of thrust at the knee gives F / (2 tan a) at the ram
    lean = np.arctan2(knee.real, -knee.imag)
    if abs(turn) > 1e-3:
        gain = velocity(state, "B").real / velocity(state, "D").imag
        assert gain == pytest.approx(1 / (2 * np.tan(lean)), rel=1e-10)


def test_the_toggle_press_gains_as_it_straightens():
    """As the crank comes into line with its rod the knee straightens, and its torque counts for more at the ram."""
    centre = 0.260 - 0.160j
    knee = meeting(centre, 0.256, 0, 0.200)
    in_line = np.angle(knee - centre)
    before = [at("toggle-press", in_line - np.radians(d)) for d in (60, 40, 20, 10, 5, 2, 1)]
    gains = [2 * np.pi / abs(velocity(state, "D").imag) for state in before]
    assert all(later > 1.4 * sooner for sooner, later in pairwise(gains))
    end = at("toggle-press", in_line)
    assert velocity(end, "D") == pytest.approx(0.0, abs=1e-13)
    assert place(end, "B") == pytest.approx(knee, abs=1e-14)
    assert np.degrees(np.arctan2(knee.real, -knee.imag)) == pytest.approx(2.0, abs=0.05)


@pytest.mark.parametrize(
    ("wiper", "pivot", "rod", "side", "swing"),
    [("left wiper", -0.320 + 0.060j, 0.310, -1, 89.0), ("right wiper", 0.300 + 0.060j, 0.305, 1, 87.2)],
)
def test_each_wiper_swings_between_its_two_triangles(wiper, pivot, rod, side, swing):
    crank, lever, base = 0.055, 0.080, abs(pivot)
    ends = []
    for reach, folded in ((rod + crank, 0.0), (rod - crank, np.pi)):
        # triangle of the motor's shaft, the pivot and the end of the lever; the lever is above
        state = at("windscreen-wiper", np.angle(pivot) + side * between(base, reach, lever) + folded)
        same_direction(state.link(wiper).angle, np.angle(-pivot) - side * between(base, lever, reach))
        assert state.link(wiper).angular_velocity == pytest.approx(0.0, abs=1e-12)
        ends.append(state.link(wiper).angle)
    angles = [state_turned_by("windscreen-wiper", "M", degrees).link(wiper).angle for degrees in range(0, 360, 10)]
    assert min(ends) < min(angles)
    assert max(angles) < max(ends)
    assert np.degrees(max(ends) - min(ends)) == pytest.approx(swing, abs=0.05)


def atkinsons_piston(angle: float) -> tuple[float, float]:
    """Where the piston is, and its derivative by the crank's angle, by hand."""

    def reached(a: complex) -> tuple[complex, complex]:
        pin, moved = 0.120 * np.exp(1j * a), 0.120j * np.exp(1j * a)
        q = 0.110 + 0.170j
        b = meeting(q, 0.375, pin, 0.430)
        # b turns about q, so that the rod keeps its length
        turn = dot(moved, b - pin) / dot(1j * (b - q), b - pin)
        return pin + (b - pin) * 605 / 430, moved + (1j * turn * (b - q) - moved) * 605 / 430

    c, moved = reached(angle)
    root = np.sqrt(0.730**2 - c.imag**2)
    return c.real + root, moved.real - c.imag * moved.imag / root


@pytest.mark.parametrize("degrees", TURN)
def test_atkinsons_piston_in_closed_form(degrees):
    state = state_turned_by("atkinson-cycle-engine", "O", degrees)
    x, slope = atkinsons_piston(np.radians(60 + degrees))
    assert place(state, "P") == pytest.approx(x, abs=1e-13)
    assert velocity(state, "P") == pytest.approx(-slope * np.radians(130 * 6), abs=1e-12)


def test_atkinsons_piston_makes_four_unequal_strokes_in_a_turn():
    # the crank turns clockwise from the innermost position, where the exhaust is out
    grid = np.radians(np.arange(70, 70 - 361, -2.5))
    slopes = [atkinsons_piston(angle)[1] for angle in grid]
    turns = [
        brentq(lambda angle: atkinsons_piston(angle)[1], *pair, xtol=1e-15)
        for pair, ends in zip(pairwise(grid), pairwise(slopes), strict=True)
        if ends[0] * ends[1] < 0
    ]
    assert len(turns) == 4
    states = [at("atkinson-cycle-engine", angle) for angle in turns]
    for state in states:
        assert velocity(state, "P") == pytest.approx(0.0, abs=1e-12)
    reached = np.array([place(state, "P").real for state in states])
    strokes = np.diff(np.append(reached, reached[0]))
    # suction, compression, expansion, exhaust
    assert strokes == pytest.approx([-0.1527, 0.1262, -0.2787, 0.3052], abs=5e-5)
    # and nowhere else does it turn back
    moving = [
        np.sign(state_turned_by("atkinson-cycle-engine", "O", d).pair("stroke")["velocity"]) for d in range(0, 361, 10)
    ]
    assert sum(one != other for one, other in pairwise(moving)) == 4


# Six-bars


def ternary(model: str) -> tuple[str, set[str], set[str]]:
    """The frame, the links of three pins, and the links that the frame is joined to."""
    mechanism = planar.load(model)
    graph, frame = nx.Graph(link_pair_graph(mechanism)), mechanism.frame
    three = {name for kind, name in graph if kind == "link" and graph.degree((kind, name)) == 3}
    near = {name for kind, name in nx.ego_graph(graph, ("link", frame), 2) if kind == "link"}
    return frame, three, near - {frame}


def test_six_bars_are_the_inversions_that_their_names_say():
    """Watt's chain has two four-bar loops, Stephenson's one; which link is the frame makes the number."""
    for model, chain in (
        ("watt-1-six-bar", [4, 4, 6]),
        ("stephenson-1-six-bar", [4, 5, 5]),
        ("stephenson-2-six-bar", [4, 5, 5]),
    ):
        assert loop_sizes(model) == chain
        frame, three, near = ternary(model)
        assert len(three) == 2
        assert frame not in three
        # the frame joins the ternary links themselves in Stephenson I; else it has a ternary and a binary neighbour
        assert len(three & near) == (2 if model == "stephenson-1-six-bar" else 1)
    for model in ("watt-six-bar", "stephenson-3-five-bar"):
        frame, three, _ = ternary(model)
        assert frame in three


BARS = {
    "watt-1-six-bar": {
        "A0A": 80, "AB": 220, "B0B": 160, "A0C": 110, "AD": 180, "CE": 200, "DE": 170,
        "AC": np.sqrt(80**2 + 110**2 - 2 * 80 * 110 * np.cos(np.radians(60))),
        "BD": np.sqrt(220**2 + 180**2 - 2 * 220 * 180 * np.cos(np.radians(50))),
    },
    "stephenson-1-six-bar": {
        "A0A": 70, "AB": 240, "B0B": 150, "A0C": 90, "B0D": 140, "CE": 240, "DE": 220,
        "AC": np.sqrt(70**2 + 90**2 - 2 * 70 * 90 * np.cos(np.radians(40))),
        "BD": np.sqrt(150**2 + 140**2 - 2 * 150 * 140 * np.cos(np.radians(45))),
    },
    "stephenson-2-six-bar": {
        "OA": 35, "AD": 150, "AE": 170, "DE": 120, "PB": 320, "PC": 190, "BC": 155, "BD": 130, "CE": 110,
    },
}  # fmt: skip
"""Distances of pins (mm) in links; with the fixed pins they make the whole linkage but for its mirror images."""


@pytest.mark.parametrize("degrees", TURN)
@pytest.mark.parametrize("model", BARS)
def test_six_bars_keep_every_length_while_they_move(model, degrees):
    """Squared distances, and their first and second derivatives, without any angle."""
    state = state_turned_by(model, planar.load(model).inputs[0].pair, degrees)
    for bar, length in BARS[model].items():
        first, second = (state.point(name) for name in (bar[:-1], bar[-1]))
        r, v, a = (getattr(second, part) - getattr(first, part) for part in ("position", "velocity", "acceleration"))
        assert np.hypot(*r) == pytest.approx(length / 1000, abs=1e-14)
        assert r @ v == pytest.approx(0.0, abs=1e-13)
        assert v @ v + r @ a == pytest.approx(0.0, abs=1e-11)


@pytest.mark.parametrize("degrees", TURN)
def test_watt_1_and_stephenson_1_fall_into_two_dyads(degrees):
    """Each dyad's pin is the corner of a triangle on what was found before."""
    crank = np.exp(1j * np.radians(60 + degrees))
    watt = state_turned_by("watt-1-six-bar", "A0", degrees)
    b = meeting(0.080 * crank, 0.220, 0.230, 0.160)
    d = 0.080 * crank + 0.180 * np.exp(1j * (np.angle(b - 0.080 * crank) + np.radians(50)))
    c = 0.110 * crank * np.exp(1j * np.radians(60))
    assert place(watt, "B") == pytest.approx(b, abs=1e-13)
    assert place(watt, "E") == pytest.approx(meeting(c, 0.200, d, 0.170), abs=1e-13)
    stephenson = state_turned_by("stephenson-1-six-bar", "A0", degrees)
    b = meeting(0.070 * crank, 0.240, 0.250, 0.150)
    d = 0.250 + 0.140 * np.exp(1j * (np.angle(b - 0.250) - np.radians(45)))
    c = 0.090 * crank * np.exp(1j * np.radians(40))
    assert place(stephenson, "B") == pytest.approx(b, abs=1e-13)
    assert place(stephenson, "E") == pytest.approx(meeting(c, 0.240, d, 0.220), abs=1e-13)


def test_a_v_twin_at_a_right_angle_is_balanced_but_for_the_second_harmonic():
    """The first harmonics of both pistons are a force that turns, and a counterweight m r opposite the pin ends it."""
    engine = planar.load("v-twin-engine")
    harmonics = []
    for masses in (engine.masses, (*engine.masses, planar.Mass("crank", 0.5, (-0.04, 0.0)))):
        force = planar.forces(planar.cycle(replace(engine, masses=masses), 48)).shaking[0][:-1]
        harmonics.append(np.abs(np.fft.fft(force @ [1.0, 1j])) / 48)
    before, after = harmonics
    assert before[1] == pytest.approx(0.5 * 0.04 * (100.0 * np.pi) ** 2, rel=1e-12)
    assert max(after[1], after[-1], before[-1]) < 1e-12 * before[1]
    assert after[2] + after[-2] > 0.2 * before[1]


# In inches and pounds


def test_the_pump_jack_lifts_its_rods_by_the_arc_of_its_horsehead():
    """Its beam turns between where crank and pitman are in line; 54 in the unit's name is its stroke, roughly."""
    post = np.hypot(64, 75)
    far, near = (np.arccos((64**2 + post**2 - d**2) / (2 * 64 * post)) for d in (74.5 + 24, 74.5 - 24))
    stroke = planar.stroke(planar.cycle("pump-jack", 72), "lift").length / 0.0254
    assert stroke == pytest.approx(72 * (far - near), rel=1e-9)
    assert stroke == pytest.approx(54, rel=0.03)
    # the torque that 5000 lbf ask for is their lever, by power; the counterweight of 3000 lb hangs 43 in from the shaft
    state = planar.solve("pump-jack")
    lever = -5000 * state.pair("lift")["velocity"] / state.link("crank").angular_velocity / 0.0254
    weight = 3000 * 43 * np.cos(np.radians(60))
    torque = planar.forces(state).inputs["O"] / parse_quantity("1 lbf*in", "torque")
    assert torque == pytest.approx(weight - lever, rel=1e-5)


def test_the_engine_in_inches_has_its_mean_piston_speed_and_inertia_in_pounds():
    """3000 rpm with a stroke of 4 in are 2000 ft/min; at TDC the piston's acceleration is r w^2 (1 + r/l)."""
    motion = planar.cycle("engine-in-inches", 360)
    angle, speed = motion.inputs["O"].position, np.abs(motion.pair("stroke")["velocity"])
    mean = np.trapezoid(speed, angle) / (2 * np.pi)
    assert mean == pytest.approx(parse_quantity("2000 ft/min", "velocity"), rel=1e-4)
    top = planar.solve("engine-in-inches", {"O": np.pi / 2})
    acceleration = 2 * (3000 * np.pi / 30) ** 2 * (1 + 2 / 8)
    assert -top.pair("stroke")["acceleration"] / 0.0254 == pytest.approx(acceleration, rel=1e-12)
    inertia = next(each for each in planar.forces(top).acting if each.name == "inertia of block B")
    assert inertia.force[1] / parse_quantity("1 lbf", "force") == pytest.approx(2 * acceleration / 386.0886, rel=1e-6)
