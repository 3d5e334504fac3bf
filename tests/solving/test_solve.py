"""Solved positions against closed forms that share no line with the solver."""

import copy

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import planar
from planar.document import files
from planar.foundation.errors import Unknown
from planar.model.mechanism import Drive
from tests.builders import block_slider_crank, four_bar
from tests.closed_forms import piston, rocker
from tests.draws import part

DEG = np.pi / 180


def mechanism(links, pairs, inputs, sketch=None, frame="frame"):
    value = {"planar": 1, "units": {"length": "m", "angle": "deg"}, "frame": frame, "links": links, "pairs": pairs}
    return files.from_dict(copy.deepcopy(value | {"inputs": inputs, "sketch": sketch or {}}))


lengths = st.floats(0.2, 2.0)


def governor(turn, sketch, guide_angle=90.0):
    """Half a Porter governor: arms of 12 on a spindle, a sleeve with its pin 1.5 beside the axis."""
    slide = {
        "sliding": "lift",
        "links": ["spindle", "sleeve"],
        "line": {"through": "A", "angle": guide_angle},
        "point": "S",
    }
    links = {
        "spindle": {"points": {"A": [0, 0]}},
        "arm": {"ends": ["A", "B"], "length": 12},
        "rod": {"ends": ["B", "C"], "length": 12},
        "sleeve": {"points": {"S": [0, 0], "C": [1.5, 0]}},
    }
    pairs = [{"turning": "A"}, {"turning": "B"}, {"turning": "C"}, slide | ({} if turn is None else {"turn": turn})]
    return mechanism(links, pairs, [{"pair": "A", "position": -48.19}], sketch, "spindle")


@pytest.mark.parametrize("turn", [90, -90])
def test_a_turn_that_is_left_out_is_that_of_the_sketch(turn):
    """The pin lies on the side of the axis where it is sketched, at the height of a triangle with the arms."""
    x = -1.5 if turn == 90 else 1.5
    state = planar.solve(governor(None, {"C": [x * 1.1, -19.0]}))
    arm = 12.0 * np.array([np.cos(48.19 * DEG), -np.sin(48.19 * DEG)])
    y = arm[1] - np.sqrt(12.0**2 - (arm[0] - x) ** 2)
    assert state.point("C").position == pytest.approx([x, y], abs=1e-12)
    assert any(f"{turn} deg is assumed" in remark for remark in state.remarks)
    written = planar.to_dict(state.mechanism)
    assert written["pairs"][3]["turn"] == pytest.approx(turn)
    assert not any("assumed" in remark for remark in planar.from_dict(written).remarks)


@pytest.mark.parametrize(
    ("turn", "sketch"),
    [
        (None, {}),
        (None, {"B": [8, -9]}),  # no point of the sleeve
        (None, {"C": [0.0, -19.0]}),  # on the line, as a turn of 0 has it
        (None, {"C": [0.6, -19.0]}),  # between two turns
        (0, {"C": [1.5, -19.0]}),  # the file decides
        (180, {"C": [1.5, -19.0]}),
    ],
)
def test_a_turn_is_kept_that_the_file_gives_or_the_sketch_leaves_open(turn, sketch):
    made = governor(turn, sketch)
    assert planar.to_dict(made)["pairs"][3].get("turn", 0) == pytest.approx(turn or 0)
    assert not any("assumed" in remark for remark in made.remarks)


@given(st.sampled_from([0, 90, -90, 180]), st.floats(-180.0, 180.0), st.floats(-0.4, 0.4), st.floats(-0.4, 0.4))
def test_any_turn_is_read_from_a_rough_sketch_of_two_points(turn, guide_angle, dx, dy):
    """Both points of the sleeve sketched within a third of its length, along any line."""
    way = np.exp(1j * guide_angle * DEG)
    s, c = 5.0 * way, 5.0 * way + 1.5 * way * np.exp(1j * turn * DEG)
    made = governor(None, {"S": [s.real, s.imag], "C": [c.real + dx, c.imag + dy]}, guide_angle)
    assert planar.to_dict(made)["pairs"][3].get("turn", 0) == pytest.approx(turn, abs=1e-9)


def test_a_position_far_from_the_sketch_names_the_point_and_the_link():
    """The sleeve of a turn of 0 has its pin on the axis, 1.5 from the sketch; its two points are turned by 90 deg."""
    state = planar.solve(governor(0, {"C": [1.5, -17.9], "S": [0.0, -17.9]}))
    (remark,) = (text for text in state.remarks if "far from the sketch" in text)
    assert "link 'sleeve' is turned by 90 deg" in remark
    far = planar.solve(governor(0, {"C": [0.0, -25.0]}))
    gap = abs(far.point("C").position[1] + 25.0)
    assert any(f"C is {gap:.4g} m from where it is sketched" in remark for remark in far.remarks)
    near = planar.solve(governor(0, {"C": [0.0, -18.0]}))
    assert not any("sketched" in remark for remark in near.remarks)


@given(lengths, lengths, lengths, lengths, st.floats(-3.1, 3.1), st.booleans())
def test_four_bar_satisfies_freudenstein_and_its_derivatives(a, b, c, d, theta, up):
    """K1 cos(phi) - K2 cos(theta) + K3 = cos(theta - phi) (F. Freudenstein, Trans. ASME 77, 1955), both assemblies."""
    r = np.hypot(d - a * np.cos(theta), a * np.sin(theta))
    assume(abs(b - c) + 0.05 < r < b + c - 0.05)
    side = 1 if up else -1
    phi = rocker(a, b, c, d, theta, side)
    omega, alpha = 2.0, -3.0
    state = planar.solve(four_bar(a, b, c, d, theta, side, omega, alpha))
    found = state.link("DC")
    assert np.cos(found.angle - phi) == pytest.approx(1, abs=1e-14)

    k1, k2, k3 = d / a, d / c, (a * a - b * b + c * c + d * d) / (2 * a * c)
    # d/dt of the equation above, once and twice, solved for phi' and phi''
    p, t, v, w = phi, theta, found.angular_velocity, found.angular_acceleration
    assert k1 * np.cos(p) - k2 * np.cos(t) + k3 == pytest.approx(np.cos(t - p), abs=1e-12 * (k1 + k2 + k3 + 1))
    slope = -k1 * np.sin(p) - np.sin(t - p)
    rate = -(k2 * np.sin(t) + np.sin(t - p)) * omega / slope
    bends = -k1 * np.cos(p) * rate**2 + k2 * np.cos(t) * omega**2 + k2 * np.sin(t) * alpha
    second = -(bends + np.cos(t - p) * (omega - rate) ** 2 + np.sin(t - p) * alpha) / slope
    assert v == pytest.approx(rate, rel=1e-9, abs=1e-9)
    assert w == pytest.approx(second, rel=1e-7, abs=1e-7)


offsets = st.floats(-0.2, 0.2).map(lambda x: x if abs(x) > 1e-90 else 0.0)  # no length is smaller, in any unit


@given(st.floats(0.1, 1.0), st.floats(1.3, 3.0), offsets, st.floats(-3.1, 3.1))
def test_offset_slider_crank(r, ratio, offset, theta):
    """x = r cos + sqrt(l^2 - (r sin - e)^2), differentiated by hand."""
    rod = r * ratio + abs(offset)
    state = planar.solve(block_slider_crank(r, rod, offset, theta))  # no sketch: the slide ahead of `through`
    w, al = 3.0, -1.0
    x, dx, ddx = piston(theta, r, rod, offset)
    scale = r * ratio
    assert state.point("B").position == pytest.approx([x, offset], abs=1e-14 * 10)
    assert state.point("B").velocity == pytest.approx([dx * w, 0], abs=1e-12 * scale * 10)
    assert state.point("B").acceleration == pytest.approx([dx * al + ddx * w * w, 0], abs=1e-11 * scale * 10)
    slide = state.pair("s")
    assert [slide["displacement"], slide["velocity"]] == pytest.approx([x, dx * w], abs=1e-12)


def whitworth(theta, r=0.1, d=0.04):
    """Crank OA, block A sliding on the slotted link CS, which turns fully about C as r > d."""
    links = {
        "frame": {"points": {"O": [0, 0], "C": [0, -d]}},
        "OA": {"ends": ["O", "A"], "length": r},
        "CS": {"ends": ["C", "S"], "length": 0.3},
    }
    pairs = [
        {"turning": "O"},
        {"turning": "C"},
        {"sliding": "slot", "on": "CS", "block": "A", "line": {"through": "C"}},
    ]
    inputs = [{"pair": "O", "position": theta / DEG, "velocity": "5 rad/s", "acceleration": "2 rad/s^2"}]
    return mechanism(links, pairs, inputs)


@given(st.floats(-3.1, 3.1))
def test_slotted_link_with_its_coriolis_part(theta):
    """The block in polar coordinates about C: rho e^(i psi) = r e^(i theta) + i d, differentiated."""
    r, d, w, al = 0.1, 0.04, 5.0, 2.0
    z = r * np.exp(1j * theta) + 1j * d
    z1 = 1j * w * r * np.exp(1j * theta)
    z2 = (1j * al - w * w) * r * np.exp(1j * theta)
    unit = z / abs(z)
    rho1, psi1 = (z1 / unit).real, (z1 / unit).imag / abs(z)
    rho2 = (z2 / unit).real + abs(z) * psi1**2
    psi2 = ((z2 / unit).imag - 2 * rho1 * psi1) / abs(z)
    state = planar.solve(whitworth(theta))
    lever, slot = state.link("CS"), state.pair("slot")
    assert np.exp(1j * lever.angle) == pytest.approx(unit, abs=1e-13)
    assert (lever.angular_velocity, lever.angular_acceleration) == pytest.approx((psi1, psi2), rel=1e-11, abs=1e-11)
    assert list(slot.values()) == pytest.approx([abs(z), rho1, rho2], rel=1e-11, abs=1e-11)

    parts = state.relative("A", "C")
    assert parts.axes == "CS"
    assert complex(*parts.centripetal) == pytest.approx(-(psi1**2) * z, abs=1e-11)
    assert complex(*parts.tangential) == pytest.approx(1j * psi2 * z, abs=1e-11)
    assert complex(*parts.coriolis) == pytest.approx(2j * psi1 * rho1 * unit, abs=1e-11)
    assert complex(*parts.sliding_acceleration) == pytest.approx(rho2 * unit, abs=1e-11)
    whole = parts.centripetal + parts.tangential + parts.coriolis + parts.sliding_acceleration
    assert whole == pytest.approx(parts.acceleration, abs=1e-11)
    assert parts.acceleration == pytest.approx(state.point("A").acceleration, abs=1e-12)
    assert parts.rotation + parts.sliding == pytest.approx(parts.velocity, abs=1e-12)


def test_between_two_points_of_a_link_nothing_slides_and_no_coriolis_part_is_left():
    state = planar.solve(four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={"C": [1.5, 1.0]}))
    parts = state.relative("C", "B")
    link = state.link("BC")
    assert parts.axes == "BC"
    np.testing.assert_array_equal(parts.coriolis, 0)
    np.testing.assert_array_equal(parts.sliding, 0)
    assert np.linalg.norm(parts.centripetal) == pytest.approx(1.2 * link.angular_velocity**2)
    assert np.linalg.norm(parts.tangential) == pytest.approx(1.2 * abs(link.angular_acceleration))
    assert parts.centripetal @ parts.position < 0
    velocities = state.point("C").velocity - state.point("B").velocity
    assert parts.velocity == pytest.approx(velocities)
    assert parts.acceleration == pytest.approx(state.point("C").acceleration - state.point("B").acceleration)


def test_relative_motion_of_points_on_no_common_link_asks_for_axes():
    state = planar.solve(four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={"C": [1.5, 1.0]}))
    with pytest.raises(Unknown, match="name the link"):
        state.relative("A", "C")
    parts = state.relative("A", "C", axes="BC")
    assert parts.velocity == pytest.approx(state.point("A").velocity - state.point("C").velocity)
    whole = parts.centripetal + parts.tangential + parts.coriolis + parts.sliding_acceleration
    assert whole == pytest.approx(parts.acceleration)


@pytest.mark.parametrize("name", ["nobody", "BC", "X.Y"])
def test_unknown_names_are_answered_with_the_known_ones(name):
    state = planar.solve(four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={"C": [1.5, 1.0]}))
    with pytest.raises(Unknown, match=r"points are (A, D, B and C|C, B, A and D)"):
        state.point(name)
    with pytest.raises(Unknown, match=r"pairs are (A, B, C and D|C, B, A and D)"):
        state.pair(name)


def test_points_are_found_under_their_link_too():
    state = planar.solve(four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={"C": [1.5, 1.0]}))
    np.testing.assert_array_equal(state.point("BC.C").position, state.point("C").position)


@pytest.mark.parametrize("theta", [10, 75, 200, 333])
def test_scotch_yoke_is_harmonic(theta):
    r = 0.05
    links = {
        "frame": {"points": {"O": [0, 0]}},
        "crank": {"ends": ["O", "A"], "length": r},
        "yoke": {"points": {"B": [0, 0]}},
    }
    pairs = [
        {"turning": "O"},
        {"sliding": "slot", "on": "yoke", "block": "A", "line": {"through": "B", "angle": 90}},
        {"sliding": "guide", "links": ["frame", "yoke"], "line": {"through": "O"}, "point": "B"},
    ]
    inputs = [{"pair": "O", "position": theta, "velocity": "12 rad/s"}]
    state = planar.solve(mechanism(links, pairs, inputs, {"B": [r * np.cos(theta * DEG), 0]}))
    s, c = np.sin(theta * DEG), np.cos(theta * DEG)
    assert list(state.pair("guide").values()) == pytest.approx([r * c, -12 * r * s, -144 * r * c], abs=1e-14)
    assert list(state.pair("slot").values()) == pytest.approx([r * s, 12 * r * c, -144 * r * s], abs=1e-14)


@pytest.mark.parametrize("slide", [-0.09, 0.02, 0.1])
def test_a_sliding_input_drives_a_trammel_whose_points_run_on_ellipses(slide):
    bar, far = 0.12, 0.3
    links = {
        "frame": {"points": {"O": [0, 0]}},
        "bar": {"ends": ["P", "Q"], "length": bar, "points": {"E": {"along": ["P", "Q"], "distance": far}}},
    }
    pairs = [
        {"sliding": "x", "on": "frame", "block": "P", "line": {"through": "O"}},
        {"sliding": "y", "on": "frame", "block": "Q", "line": {"through": "O", "angle": 90}},
    ]
    inputs = [{"pair": "x", "position": slide, "velocity": "0.2 m/s", "acceleration": "0.1 m/s^2"}]
    state = planar.solve(mechanism(links, pairs, inputs, {"Q": [0, 0.1]}))
    e = state.point("E")
    # (x / (far - bar))^2 + (y / far)^2 = 1, and its derivatives: the trammel of Archimedes
    axes = np.array([far - bar, far])
    q, v, a = e.position / axes, e.velocity / axes, e.acceleration / axes
    assert q @ q == pytest.approx(1, abs=1e-14)
    assert q @ v == pytest.approx(0, abs=1e-14)
    assert q @ a + v @ v == pytest.approx(0, abs=1e-12)
    assert state.point("P").velocity == pytest.approx([0.2, 0])


def test_inputs_between_moving_links_add_up_along_an_open_chain():
    """An arm of three links, each turned against the one before: angles and rates are sums, points a polygon."""
    links = {"frame": {"points": {"P0": [0, 0]}}} | {
        f"L{k}": {"ends": [f"P{k}", f"P{k + 1}"], "length": 1.0 + k} for k in range(3)
    }
    pairs = [{"turning": f"P{k}"} for k in range(3)]
    inputs = [
        {"pair": f"P{k}", "position": 20 + 30 * k, "velocity": f"{k + 1} rad/s", "acceleration": f"{-k} rad/s^2"}
        for k in range(3)
    ]
    state = planar.solve(mechanism(links, pairs, inputs))
    angles = np.cumsum([20, 50, 80]) * DEG
    rates, seconds = np.cumsum([1, 2, 3]), np.cumsum([0, -1, -2])
    arms = np.array([1.0, 2.0, 3.0]) * np.exp(1j * angles)
    assert complex(*state.point("P3").position) == pytest.approx(sum(arms))
    assert complex(*state.point("P3").velocity) == pytest.approx(sum(1j * rates * arms))
    assert complex(*state.point("P3").acceleration) == pytest.approx(sum((1j * seconds - rates**2) * arms))
    assert state.mobility == 3
    assert state.pair("P1")["relative_angular_velocity"] == 2.0


def test_an_input_between_moving_links_of_a_pin_of_three():
    links = {
        "frame": {"points": {"O": [0, 0]}},
        "a": {"ends": ["O", "P"], "length": 1},
        "b": {"ends": ["P", "Q"], "length": 1},
        "c": {"ends": ["P", "R"], "length": 1},
    }
    inputs = [
        {"pair": "O", "position": 10},
        {"pair": "P:a,b", "position": 20},
        {"pair": "P:b,c", "position": 30, "velocity": "2 rad/s"},
    ]
    state = planar.solve(mechanism(links, [{"turning": "O"}, {"turning": "P"}], inputs))
    assert [state.link(name).angle / DEG for name in "abc"] == pytest.approx([10, 30, 60])
    assert state.pair("P:a,c")["relative_angular_velocity"] == pytest.approx(2.0)
    assert state.pair("P:b,c")["relative_angle"] / DEG == pytest.approx(30)


@pytest.mark.parametrize("order", [["frame", "a"], ["a", "frame"]])
def test_at_a_pin_on_the_frame_the_input_is_the_other_links_angle(order):
    links = {"frame": {"points": {"O": [0, 0]}}, "a": {"ends": ["P", "O"], "length": 2}}
    inputs = [{"pair": "O", "position": 30, "velocity": "1 rad/s"}]
    state = planar.solve(mechanism(links, [{"turning": "O", "links": order}], inputs))
    assert state.link("a").angle / DEG == pytest.approx(30)
    # the link's angle is of its first end to its second, also when the pin is at the second
    assert state.point("P").position == pytest.approx([-2 * np.cos(30 * DEG), -2 * np.sin(30 * DEG)])


def test_a_turned_slide_keeps_its_angle():
    """A block whose x-axis stands at 90 degrees to its line, on a line at 30 degrees."""
    links = {"frame": {"points": {"O": [0, 0]}}, "b": {"points": {"P": [0, 0], "Q": [1, 0]}}}
    pairs = [{"sliding": "s", "links": ["frame", "b"], "line": {"through": "O", "angle": 30}, "point": "P", "turn": 90}]
    state = planar.solve(mechanism(links, pairs, [{"pair": "s", "position": 2, "velocity": "3 m/s"}]))
    assert state.link("b").angle / DEG == pytest.approx(120)
    assert complex(*state.point("P").position) == pytest.approx(2 * np.exp(30j * DEG))
    assert complex(*state.point("Q").position) == pytest.approx(2 * np.exp(30j * DEG) + np.exp(120j * DEG))
    assert complex(*state.point("Q").velocity) == pytest.approx(3 * np.exp(30j * DEG))


def test_a_link_drawn_in_place_has_its_angle_along_its_axis():
    links = {
        "frame": {"points": {"O": [1, 1]}},
        "t": {"points": {"O": [1, 1], "P": [2, 2], "Q": [1, 3]}, "axis": ["O", "P"]},
    }
    state = planar.solve(mechanism(links, [{"turning": "O"}], [{"pair": "O", "position": 45}]))
    assert state.point("Q").position == pytest.approx([1, 3])
    assert state.link("t").angle / DEG == pytest.approx(45)


@pytest.mark.parametrize("side", [1, -1])
def test_the_sketch_chooses_the_assembly(side):
    state = planar.solve(four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={"C": [1.4, 0.8 * side]}))
    assert np.sign(state.point("C").position[1]) == side
    assert not any("leaves open" in remark for remark in state.remarks)


def test_without_a_sketch_the_tie_is_named_and_the_same_assembly_taken_each_time():
    states = [planar.solve(four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={})) for _ in range(2)]
    assert states[0].point("C").position[1] > 0
    np.testing.assert_array_equal(states[0].point("C").position, states[1].point("C").position)
    assert "no sketch" in states[0].remarks[0]
    at = states[0].point("C").position
    assert f"taken is C at [{at[0]:.4g}, {at[1]:.4g}] m" in states[0].remarks[0]


def test_a_sketched_point_far_down_the_chain_decides_what_lies_before_it():
    """Two dyads in a row, only the last pin sketched: the first dyad is chosen so that the last comes nearest."""
    links = {
        "frame": {"points": {"A": [0, 0], "D": [4, 0], "G": [9, 0]}},
        "AB": {"ends": ["A", "B"], "length": 1.0},
        "BC": {"ends": ["B", "C"], "length": 3.5},
        "DC": {
            "ends": ["D", "C"],
            "length": 2.5,
            "points": {"E": {"along": ["D", "C"], "distance": 2.0, "angle": -30}},
        },
        "EF": {"ends": ["E", "F"], "length": 4.0},
        "GF": {"ends": ["G", "F"], "length": 2.5},
    }
    pairs = [{"turning": n} for n in "ABCDEFG"]
    inputs = [{"pair": "A", "position": 70}]
    found = []
    for c in (3, -3):
        for f in (3, -3):
            whole = planar.solve(mechanism(links, pairs, inputs, {"C": [4, c], "F": [8, f]}))
            found.append((whole.point("C").position, whole.point("F").position))
    for c, f in found:
        only_last = planar.solve(mechanism(links, pairs, inputs, {"F": list(f)}))
        np.testing.assert_allclose(only_last.point("F").position, f, atol=1e-12)
        np.testing.assert_allclose(only_last.point("C").position, c, atol=1e-12)


def test_moving_an_input_keeps_to_the_branch_where_the_sketch_would_mislead():
    """A crank-rocker carried round by half a turn: the sketch, drawn for the start, is nearer to the other assembly."""
    start = four_bar(0.3, 0.9, 0.7, 1.0, 0.8, 0, 1.0, 0.0, points=None, sketch={"C": [0.9, 0.7]})
    for turn in np.linspace(0.5, 6.0, 12):
        state = planar.solve(start, [Drive("A", 0.8 + turn)])
        b, c, d = (state.point(name).position for name in "BCD")
        assert np.cross(np.append(c - b, 0), np.append(d - b, 0))[2] < 0
    np.testing.assert_allclose(
        planar.solve(start, [Drive("A", 0.8 + 2 * np.pi)]).point("C").position,
        planar.solve(start).point("C").position,
        atol=1e-13,
    )


def test_states_and_mechanisms_are_immutable():
    value = four_bar(0.5, 1.2, 1.0, 1.4, 1.0, 0, 3.0, 1.0, points=None, sketch={"C": [1.5, 1.0]})
    state = planar.solve(value)
    for thing, name in ((value, "name"), (state, "residual"), (value.links[0], "length"), (state.link("BC"), "angle")):
        with pytest.raises(AttributeError):
            setattr(thing, name, 1.0)


@pytest.mark.parametrize("links", part([12, 42, 60], 1, 1))
def test_a_long_chain_of_dyads_is_solved_in_its_order(links):
    """Rhombic dyads in a row, each link one metre: the k-th pins are known in closed form as sums of two directions."""
    count = (links - 2) // 2
    tilt, flat = 1.1, 0.1
    members = {
        "frame": {
            "points": {"A0": [0, 0], **{f"G{k}": [k * np.cos(flat), k * np.sin(flat)] for k in range(1, count + 1)}}
        }
    }
    members["c0"] = {"ends": ["A0", "B0"], "length": 1.0}
    pairs = [{"turning": "A0"}, {"turning": "B0"}]
    sketch = {}
    for k in range(1, count + 1):
        members[f"r{k}"] = {"ends": [f"B{k - 1}", f"B{k}"], "length": 1.0}
        members[f"c{k}"] = {"ends": [f"G{k}", f"B{k}"], "length": 1.0}
        pairs += [{"turning": f"G{k}"}, {"turning": f"B{k}"}]
        sketch[f"B{k}"] = [k * np.cos(flat) + 0.9 * np.cos(tilt), k * np.sin(flat) + 1.1 * np.sin(tilt)]
    inputs = [{"pair": "A0", "position": tilt / DEG, "velocity": "2 rad/s"}]
    state = planar.solve(mechanism(members, pairs, inputs, sketch))
    end = state.point(f"B{count}")
    assert end.position == pytest.approx(
        [count * np.cos(flat) + np.cos(tilt), count * np.sin(flat) + np.sin(tilt)], abs=1e-12
    )
    assert end.velocity == pytest.approx([-2 * np.sin(tilt), 2 * np.cos(tilt)], abs=1e-11)
    assert end.acceleration == pytest.approx([-4 * np.cos(tilt), -4 * np.sin(tilt)], abs=1e-10)
