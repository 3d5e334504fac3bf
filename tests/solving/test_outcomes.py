"""What has no answer ends with an outcome and a sentence that names the pairs."""

import copy
import re
from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.mechanism import Drive
from planar.model.pairs import pair_types
from planar.solving.position import solve
from tests.builders import four_bar_document
from tests.closed_forms import between
from tests.draws import part

MILLIMETRES = {"length": "mm", "angle": "deg"}
FOUR_BAR = four_bar_document(50, 66, 56, 100, 60, omega="10 rad/s", units=MILLIMETRES, sketch={"C": [80, 50]})


def changed(**top):
    return files.from_dict(copy.deepcopy(FOUR_BAR) | top)


def refused(mechanism, drives=()):
    with pytest.raises(NoAnswer) as caught:
        solve(mechanism, drives)
    return caught.value


def driven(position, pair="A"):
    return changed(inputs=[{"pair": pair, "position": position, "velocity": "10 rad/s"}])


def test_what_cannot_be_joined_says_where_and_by_how_much():
    problem = refused(driven(150))
    assert problem.outcome is Outcome.CANNOT_BE_ASSEMBLED
    # B is |B - D| from D, and BC + DC = 122 mm reach no further
    gap = np.hypot(100 - 50 * np.cos(np.radians(150)), 50 * np.sin(np.radians(150))) - 122
    assert f"by {gap:.6g} mm" in problem.reason
    assert "A = 150 deg" in problem.reason
    assert "'BC' and 'DC'" in problem.reason
    assert "pair '" in problem.reason


LIMIT = np.degrees(between(50, 100, 122))
"""The input at which BC and DC lie in one line (law of cosines)."""


@pytest.mark.parametrize("within", [0.0, 1e-13, 1e-12, 1e-11, 1e-10])
def test_at_the_dead_point_no_velocity_is_given(within):
    problem = refused(driven(float(LIMIT - within)))
    assert problem.outcome in (Outcome.DEAD_POINT, Outcome.CANNOT_BE_ASSEMBLED)
    if within >= 1e-12:
        assert problem.outcome is Outcome.DEAD_POINT
        assert "'A'" in problem.reason
        assert "'BC' and 'DC'" in problem.reason
        assert "drive 'B' or 'C' or 'D'" in problem.reason


@pytest.mark.parametrize("within", [1e-7, 1e-5, 1e-2])
def test_near_the_dead_point_the_velocity_is_right_to_what_rounding_leaves(within):
    """omega of DC by the closed form of the coupler's angle, evaluated in long double."""
    state = solve(driven(float(LIMIT - within)))
    theta = np.longdouble(np.radians(np.longdouble(LIMIT - within)))
    b, d = np.array([50 * np.cos(theta), 50 * np.sin(theta)]), np.array([np.longdouble(100), 0])
    r = np.hypot(*(d - b))
    cosine = (np.longdouble(56) ** 2 + r**2 - np.longdouble(66) ** 2) / (2 * 56 * r)
    bend = np.arctan2(np.sqrt((1 - cosine) * (1 + cosine)), cosine)
    back = np.arctan2(*(b - d)[::-1])
    angle = back - bend
    c = d + 56 * np.array([np.cos(angle), np.sin(angle)])
    arm_b, arm_c = c - b, c - d
    velocity_b = 10 * np.array([-b[1], b[0]])
    omega = (velocity_b @ arm_b) / (np.array([-arm_c[1], arm_c[0]]) @ arm_b)
    slope = np.sqrt(np.radians(within))  # the group's slope is of this order: rounding grows by its square
    assert state.link("DC").angular_velocity == pytest.approx(float(omega), rel=1e-15 / slope**2 + 1e-12)


def test_too_few_inputs_names_the_links_that_stay_free_and_where_to_drive():
    with pytest.raises(NoAnswer) as caught:
        planar.cycle(changed(inputs=[]))
    problem = caught.value
    assert problem.outcome is Outcome.TOO_FEW_INPUTS
    assert "0 inputs" in problem.reason
    assert all(f"'{name}'" in problem.reason for name in ("AB", "BC", "DC", "A", "B", "C", "D"))


def test_too_many_inputs_that_do_not_agree():
    two = [{"pair": "A", "position": 60}, {"pair": "D", "position": 120}]
    problem = refused(changed(inputs=two))
    assert problem.outcome is Outcome.TOO_MANY_INPUTS
    assert "'A' and 'D'" in problem.reason


def test_too_many_inputs_that_agree_in_position_but_not_in_velocity():
    angle = float(np.degrees(solve(changed()).link("DC").angle))
    two = [{"pair": "A", "position": 60, "velocity": "10 rad/s"}, {"pair": "D", "position": angle}]
    problem = refused(changed(inputs=two))
    assert problem.outcome is Outcome.TOO_MANY_INPUTS
    assert "velocities" in problem.reason


def test_two_inputs_that_agree_in_everything_are_no_error():
    state = solve(changed())
    link = state.link("DC")
    second = {
        "pair": "D",
        "position": f"{link.angle!r} rad",
        "velocity": f"{link.angular_velocity!r} rad/s",
        "acceleration": f"{link.angular_acceleration!r} rad/s^2",
    }
    both = solve(changed(inputs=[*FOUR_BAR["inputs"], second]))
    assert both.mobility == 1
    np.testing.assert_allclose(both.point("C").acceleration, state.point("C").acceleration, rtol=1e-9)


def test_a_link_that_nothing_joins_to_the_frame_is_named():
    links = FOUR_BAR["links"] | {"X": {"points": {"P": [0, 0]}}}
    problem = refused(changed(links=links))
    assert problem.outcome is Outcome.TOO_FEW_INPUTS
    assert "'X'" in problem.reason


PARALLELOGRAM = {
    "links": {
        "AD": {"points": {"A": [0, 0], "D": [100, 0]}},
        "AB": {"ends": ["A", "B"], "length": 50},
        "BC": {"ends": ["B", "C"], "length": 100},
        "DC": {"ends": ["D", "C"], "length": 50},
    }
}


@pytest.mark.parametrize("position", [0, 180])
def test_the_flat_parallelogram_is_a_change_point(position):
    problem = refused(
        changed(
            **PARALLELOGRAM, inputs=[{"pair": "A", "position": position, "velocity": "1 rad/s"}], sketch={"C": [150, 0]}
        )
    )
    assert problem.outcome is Outcome.CHANGE_POINT
    assert "'BC' and 'DC'" in problem.reason


@pytest.mark.parametrize("crank", [37.0, 90.0, 143.0])
def test_a_parallelogram_with_a_third_crank_moves_in_spite_of_its_redundant_pair(crank):
    links = {
        "AD": {"points": {"A": [0, 0], "D": [100, 0], "E": [40, 0]}},
        "AB": {"ends": ["A", "B"], "length": 50},
        "BC": {"ends": ["B", "C"], "length": 100, "points": {"F": {"along": ["B", "C"], "distance": 40}}},
        "DC": {"ends": ["D", "C"], "length": 50},
        "EF": {"ends": ["E", "F"], "length": 50},
    }
    turn = np.array([np.cos(np.radians(crank)), np.sin(np.radians(crank))])
    sketch = {"C": list(np.array([100, 0]) + 50 * turn), "F": list(np.array([40, 0]) + 50 * turn)}
    inputs = [{"pair": "A", "position": crank, "velocity": "3 rad/s", "acceleration": "2 rad/s^2"}]
    pairs = [{"turning": name} for name in "ABCDEF"]
    state = solve(changed(links=links, pairs=pairs, sketch=sketch, inputs=inputs))
    assert state.mobility == 1
    for name in ("AB", "DC", "EF"):
        assert state.link(name).angle == pytest.approx(np.radians(crank), abs=1e-12)
        assert state.link(name).angular_velocity == pytest.approx(3.0, rel=1e-12)
        assert state.link(name).angular_acceleration == pytest.approx(2.0, rel=1e-11)


def test_a_third_crank_of_another_length_cannot_be_assembled():
    links = {
        "AD": {"points": {"A": [0, 0], "D": [100, 0], "E": [40, 0]}},
        "AB": {"ends": ["A", "B"], "length": 50},
        "BC": {"ends": ["B", "C"], "length": 100, "points": {"F": {"along": ["B", "C"], "distance": 40}}},
        "DC": {"ends": ["D", "C"], "length": 50},
        "EF": {"ends": ["E", "F"], "length": 49},
    }
    problem = refused(changed(links=links, pairs=[{"turning": name} for name in "ABCDEF"]))
    assert problem.outcome is Outcome.CANNOT_BE_ASSEMBLED
    assert "mm" in problem.reason


def test_three_parallel_guides_are_redundant_and_solved():
    links = {
        "frame": {"points": {"O": [0, 0], "P": [0, 100], "Q": [0, -100]}},
        "table": {"points": {"a": [0, 0], "b": [0, 100], "c": [0, -100]}},
    }
    pairs = [
        {"sliding": f"s{k}", "links": ["frame", "table"], "line": {"through": p}, "point": q}
        for k, (p, q) in enumerate(zip("OPQ", "abc", strict=True))
    ]
    state = solve(
        changed(
            frame="frame",
            links=links,
            pairs=pairs,
            inputs=[{"pair": "s0", "position": 30, "velocity": "2 m/s"}],
            sketch={},
        )
    )
    assert state.mobility == 1
    assert state.pair("s2") == pytest.approx({"displacement": 0.03, "velocity": 2.0, "acceleration": 0.0}, abs=1e-15)


def test_wedges_close_in_angle_whatever_whole_turns_their_author_wrote():
    """Three links on three slides: the angles close by themselves, once round or not at all."""

    def wedge(turn):
        links = {
            "frame": {"points": {"O": [0, 0]}},
            "wedge": {"points": {"A": [0, 0]}},
            "rod": {"points": {"B": [0, 0]}},
        }
        pairs = [
            {"sliding": "floor", "links": ["frame", "wedge"], "line": {"through": "O"}, "point": "A"},
            {
                "sliding": "face",
                "links": ["wedge", "rod"],
                "line": {"through": "A", "angle": 30},
                "point": "B",
                "turn": turn,
            },
            {
                "sliding": "lift",
                "links": ["frame", "rod"],
                "line": {"through": "O", "angle": 90},
                "point": "B",
                "turn": -90,
            },
        ]
        return changed(
            frame="frame",
            links=links,
            pairs=pairs,
            sketch={},
            inputs=[{"pair": "floor", "position": -50, "velocity": "2 m/s"}],
        )

    for turn in (-30, 330):
        state = solve(wedge(turn))
        rise = 0.05 * np.tan(np.radians(30))
        assert state.pair("lift")["displacement"] == pytest.approx(rise, rel=1e-12)
        assert state.pair("lift")["velocity"] == pytest.approx(-2.0 * np.tan(np.radians(30)), rel=1e-12)
    assert refused(wedge(-29)).outcome is Outcome.CANNOT_BE_ASSEMBLED


def test_a_branch_that_ends_on_the_way_says_where():
    problem = refused(changed(), [Drive("A", np.radians(140.0))])
    assert problem.outcome is Outcome.DEAD_POINT
    assert f"A = {LIMIT:.6g} deg" in problem.reason


def test_a_frame_alone_with_a_rigid_truss_needs_no_input():
    links = {
        "g": {"points": {"A": [0, 0], "B": [100, 0]}},
        "a": {"ends": ["A", "C"], "length": 80},
        "b": {"ends": ["B", "C"], "length": 60},
    }
    state = solve(
        changed(frame="g", links=links, pairs=[{"turning": n} for n in "ABC"], inputs=[], sketch={"C": [60, 50]})
    )
    assert state.mobility == 0
    np.testing.assert_allclose(state.point("C").position, [0.064, 0.048], atol=1e-15)
    np.testing.assert_array_equal(state.point("C").velocity, [0, 0])


@pytest.mark.parametrize("start", part(np.linspace(21.3, 158.7, 40), 5))
def test_a_flat_parallelogram_is_passed_smoothly_and_never_without_a_word(start):
    """Beyond it the linkage may be a parallelogram or cross its bars: it stays what it is, and that is said."""
    turn = np.radians(start)
    sketch = {"C": [100 + 50 * np.cos(turn), 50 * np.sin(turn)]}
    mechanism = changed(
        **PARALLELOGRAM, inputs=[{"pair": "A", "position": start, "velocity": "1 rad/s"}], sketch=sketch
    )
    short_of_it = solve(mechanism, {"A": np.radians(175.0)})
    assert short_of_it.link("BC").angle == pytest.approx(0.0, abs=1e-10)
    assert not any("branches" in each for each in short_of_it.remarks)
    for beyond, flat in ((185.0 + start / 3, 180), (-5.0 - start / 3, 0)):
        state = solve(mechanism, {"A": np.radians(beyond)})
        assert state.link("BC").angle == pytest.approx(0.0, abs=1e-12)
        assert state.link("BC").angular_velocity == pytest.approx(0.0, abs=1e-12)
        assert state.link("DC").angular_velocity == pytest.approx(1.0, abs=1e-12)
        said = [each for each in state.remarks if "2 branches of the motion cross" in each]
        assert len(said) == 1
        assert float(re.search(r"A = (\S+) deg", said[0]).group(1)) == pytest.approx(flat, abs=1e-5)


@pytest.mark.parametrize("start", part(np.linspace(20.7, 70.1, 15), 1))
def test_a_slider_crank_of_equal_lengths_does_not_change_over_by_itself(start):
    links = {
        "f": {"points": {"O": [0, 0]}},
        "crank": {"ends": ["O", "A"], "length": 50},
        "rod": {"ends": ["A", "B"], "length": 50},
    }
    pairs = [{"turning": "O"}, {"turning": "A"}, {"sliding": "s", "on": "f", "block": "B", "line": {"through": "O"}}]
    inputs = [{"pair": "O", "position": start, "velocity": "1 rad/s"}]
    mechanism = changed(frame="f", links=links, pairs=pairs, inputs=inputs, sketch={})
    for turn in (80.0, 90.0 + start):
        state = solve(mechanism, {"O": np.radians(turn)})
        assert state.point("B").position[0] == pytest.approx(0.1 * np.cos(np.radians(turn)), abs=1e-14)
        assert state.point("B").velocity[0] == pytest.approx(-0.1 * np.sin(np.radians(turn)), abs=1e-12)
        assert any("O = 90 deg 2 branches" in each for each in state.remarks) is bool(turn > 90)


@pytest.mark.parametrize("position", [0, 30, 90, 179.9, 179.999, 180])
def test_three_cranks_not_in_line_carry_each_other_over_their_dead_points(position):
    """A coupled locomotive with a third crank off the line: any two cranks alone have dead points at 0 and 180."""
    links = {
        "f": {"points": {"A": [0, 0], "B": [100, 0], "C": [100, 100]}},
        "a": {"ends": ["A", "P"], "length": 50},
        "b": {"ends": ["B", "Q"], "length": 50},
        "c": {"ends": ["C", "R"], "length": 50},
        "k": {"points": {"P": [0, 0], "Q": [100, 0], "R": [100, 100]}},
    }
    inputs = [{"pair": "A", "position": position, "velocity": "2 rad/s", "acceleration": "1 rad/s^2"}]
    mechanism = changed(frame="f", links=links, pairs=[{"turning": n} for n in "ABCPQR"], inputs=inputs, sketch={})
    state = solve(mechanism)
    assert state.mobility == 1
    for name in "abc":
        assert np.exp(1j * state.link(name).angle) == pytest.approx(np.exp(1j * np.radians(position)), abs=1e-12)
        assert state.link(name).angular_velocity == pytest.approx(2.0, rel=1e-12)
        assert state.link(name).angular_acceleration == pytest.approx(1.0, rel=1e-11)
    turned = solve(mechanism, {"A": np.radians(position + 200.0)})
    assert turned.link("k").angle == pytest.approx(0.0, abs=1e-12)


@pytest.mark.parametrize("value", [float("nan"), float("inf"), "60 deg", [1.0], 1j, True, 1e13])
def test_an_input_moves_only_to_a_finite_number(value):
    with pytest.raises(BadInput, match="an input moves to"):
        solve(changed(), {"A": value})


def test_an_input_that_is_not_there_is_named_with_those_that_are():
    with pytest.raises(BadInput, match="there is no input at 'B'; the inputs are at A"):
        solve(changed(), {"B": 1.0})


@pytest.mark.parametrize("size", [1e-4, 1e-6, 1e-8])
def test_a_small_linkage_beside_a_large_one_is_judged_by_its_own_size(size):
    """A redundant parallelogram of a metre, and on the same frame a four-bar and a slotted lever many times smaller."""
    links = {
        "f": {
            "points": {
                **{"A": [0, 0], "D": [1, 0], "E": [0.4, 0]},
                **{"U": [0, 0], "V": [size, 0], "O": [0, 0], "Q": [0, -2 * size]},
            }
        },
        "a": {"ends": ["A", "B"], "length": 0.5},
        "k": {"ends": ["B", "C"], "length": 1, "points": {"F": {"along": ["B", "C"], "distance": 0.4}}},
        "d": {"ends": ["D", "C"], "length": 0.5},
        "e": {"ends": ["E", "F"], "length": 0.5},
        "p": {"ends": ["U", "P"], "length": 0.3 * size},
        "q": {"ends": ["P", "R"], "length": 0.9 * size},
        "r": {"ends": ["V", "R"], "length": 0.7 * size},
        "c": {"ends": ["O", "T"], "length": size},
        "l": {"points": {"Q": [0, 0]}},
    }
    pairs = [{"turning": name} for name in "ABCDEFUVPROQ"]
    pairs.append({"sliding": "s", "on": "l", "block": "T", "line": {"through": "Q"}})
    inputs = [{"pair": "A", "position": 70}, {"pair": "U", "position": 50}, {"pair": "O", "position": 60}]
    inputs = [given | {"velocity": "1 rad/s"} for given in inputs]
    sketch = {"C": [1.17, 0.47], "F": [0.57, 0.47], "R": [0.9 * size, 0.7 * size]}
    state = solve(changed(units={"angle": "deg"}, frame="f", links=links, pairs=pairs, inputs=inputs, sketch=sketch))
    assert state.mobility == 3
    assert state.link("e").angular_velocity == pytest.approx(1.0, rel=1e-12)
    pin = np.exp(1j * np.radians(60)) + 2j
    assert state.link("l").angular_velocity == pytest.approx((1j * np.exp(1j * np.radians(60)) / pin).imag, rel=1e-9)


def test_a_search_that_stops_early_says_so(monkeypatch):
    from planar.solving.assembly import nearest_assembly

    monkeypatch.setattr(nearest_assembly, "MAX_BEST_FIRST_EFFORT", -4.0)
    count = 6
    links = {"f": {"points": {f"G{k}": [100 * k, 0] for k in range(count + 1)}}}
    links["c"] = {"ends": ["G0", "B0"], "length": 60}
    for k in range(1, count + 1):
        links[f"k{k}"] = {"ends": [f"B{k - 1}", f"B{k}"], "length": 104}
        links[f"r{k}"] = {"ends": [f"G{k}", f"B{k}"], "length": 62}
    pairs = [{"turning": f"{letter}{k}"} for k in range(count + 1) for letter in "GB"]
    inputs = [{"pair": "G0", "position": 80}]
    state = solve(changed(frame="f", links=links, pairs=pairs, inputs=inputs, sketch={f"B{count}": [100 * count, -60]}))
    assert any("stopped before it had tried all combinations" in remark for remark in state.remarks)


def test_every_group_that_the_sketch_leaves_open_is_named():
    links = FOUR_BAR["links"] | {
        "AD": {"points": {"A": [0, 0], "D": [100, 0], "G": [200, 0]}},
        "CF": {"ends": ["C", "F"], "length": 110},
        "GF": {"ends": ["G", "F"], "length": 60},
    }
    state = solve(changed(links=links, pairs=[{"turning": name} for name in "ABCDFG"], sketch={}))
    assert re.search(r"C at \[[-\d., ]+\] mm and F at \[[-\d., ]+\] mm", state.remarks[0])


def made(**changes):
    """A four-bar made in Python of the public classes."""
    turning = pair_types()["turning"]
    links = (
        planar.Link("AD", (planar.Point("A", planar.At(0, 0)), planar.Point("D", planar.At(0.1, 0)))),
        planar.Link("AB", ends=("A", "B"), length=0.05),
        planar.Link("BC", ends=("B", "C"), length=0.066),
        planar.Link("DC", ends=("D", "C"), length=0.056),
    )
    ends = {"A": ("AD", "AB"), "B": ("AB", "BC"), "C": ("BC", "DC"), "D": ("AD", "DC")}
    pairs = tuple(turning(name, both, (name, name), name) for name, both in ends.items())
    given = {"links": links, "pairs": pairs, "inputs": (planar.Input("A", np.radians(60), 10.0),)}
    return planar.Mechanism("made", **{"frame": "AD"} | given | {"sketch": (("C", 0.08, 0.05),)} | changes)


def test_a_mechanism_made_in_python_is_solved_as_one_from_a_file():
    np.testing.assert_allclose(solve(made()).point("C").velocity, solve(changed()).point("C").velocity, rtol=1e-13)
    assert files.from_dict(files.to_dict(made())) == made()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"frame": "X"}, "no link 'X' to be the frame"),
        ({"inputs": (planar.Input("Q", 1.0),)}, "no pair 'Q' to be driven; pairs are A, B, C and D"),
        ({"links": ()}, "no link 'AD' to be the frame"),
        ({"links": (planar.Link("AD", (planar.Point("A", planar.At(0, 0)),)),)}, "there is no link 'AB'"),
    ],
)
def test_a_mechanism_made_in_python_that_names_what_it_lacks_is_refused(changes, words):
    with pytest.raises(BadInput, match=words):
        solve(made(**changes))


def test_a_pair_of_a_point_that_its_link_lacks_is_refused():
    pairs = tuple(replace(pair, points=("A", "Z")) if pair.name == "A" else pair for pair in made().pairs)
    with pytest.raises(BadInput, match="link 'AB' has no point 'Z'"):
        solve(made(pairs=pairs))


@pytest.mark.parametrize("size", [1e-3, 1e-5, 1e-6])
def test_a_small_dyad_hung_on_a_large_linkage_does_not_weaken_it(size):
    """Between the coupler of a four-bar of a metre and a pin of the frame close by hangs a dyad many times smaller."""
    links = {
        "f": {"points": {"A": [0, 0], "D": [1, 0]}},
        "a": {"ends": ["A", "B"], "length": 0.3},
        "b": {"ends": ["B", "C"], "length": 0.9, "points": {"U": [0.45, 0.5]}},
        "c": {"ends": ["D", "C"], "length": 0.7},
    }
    given = {
        "units": {"angle": "deg"},
        "frame": "f",
        "inputs": [{"pair": "A", "position": 50, "velocity": "2 rad/s"}],
    }
    sketch = {"C": [0.9, 0.7]}
    bare = solve(changed(links=links, pairs=[{"turning": name} for name in "ABCD"], sketch=sketch, **given))
    pin = np.add(bare.point("U").position, (size, 0)).tolist()
    links |= {"f": {"points": {"A": [0, 0], "D": [1, 0], "V": pin}}}
    links |= {"q": {"ends": ["U", "R"], "length": 0.6 * size}, "r": {"ends": ["V", "R"], "length": 0.7 * size}}
    sketch |= {"R": [pin[0] - size / 2, pin[1] + size / 2]}
    state = solve(changed(links=links, pairs=[{"turning": name} for name in "ABCDUVR"], sketch=sketch, **given))
    assert state.mobility == 1
    # law of cosines: r of the dyad against its base, and the speed with which U leaves V along q
    bend = np.pi - between(1.0, 0.7, 0.6)
    assert state.link("r").angle == pytest.approx(bend, abs=1e-14 / size)
    arm = state.point("R").position - state.point("U").position
    rate = state.point("R").velocity - state.point("U").velocity
    assert arm @ rate == pytest.approx(0.0, abs=1e-9 * size)
    assert state.link("b").angular_velocity == pytest.approx(bare.link("b").angular_velocity, rel=1e-12)
