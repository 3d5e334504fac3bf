"""Bodies that parallel slots hold to second order only: to first order they could turn, in every position."""

from itertools import permutations
from math import cos, factorial, pi, prod, sin, sqrt

import casadi as ca
import numpy as np
import pytest

import planar
from planar.analysis.identity.mobility import mobility
from planar.analysis.worked.solution import worked_solution
from planar.equations.rank_conditions import constraint_dependencies, determinant_rates, symbolic_determinant
from planar.foundation.errors import NoAnswer, Outcome
from planar.solving.assembly.block_assemblies import block_dependencies
from planar.solving.position import solved_mechanism
from tests.closed_forms import piston
from tests.command import run
from tests.page_scripts import in_node, needs_node

EXACT = 1e-12
"""A double root found as a simple one is exact to rounding: the conditions here are below 100."""
TO_SECOND_ORDER = "to second order only"


def slot(name, links, through, point):
    return {"slot": name, "links": links, "line": {"through": through, "angle": "90 deg"}, "point": point}


def mechanism(links, pairs, inputs, **more):
    value = {"planar": 1, "name": "jaws", "frame": "f", "links": links, "pairs": pairs, "inputs": inputs} | more
    return planar.from_dict(value)


def jaw(pins=(0.0, 2.0), at=0.3, velocity=0.1, **more):
    """A body whose pins slide in as many parallel slots of the frame, driven at the first."""
    names = "abcd"[: len(pins)]
    frame = {name.upper(): [x, 0.0] for name, x in zip(names, pins, strict=True)}
    body = {f"G{name}": [x, 0.0] for name, x in zip(names, pins, strict=True)}
    pairs = [slot(name, ["f", "b"], name.upper(), f"G{name}") for name in names]
    inputs = [{"pair": "a", "position": at, "velocity": velocity}]
    return mechanism({"f": {"points": frame}, "b": {"points": body}}, pairs, inputs, **more)


def press_in_two_slots(inputs, **more):
    """A crank of 0.5 m and a rod of 2.5 m that move a body in two parallel slots; its pin B right above the crank's."""
    links = {
        "f": {"points": {"P": [0, 0], "Q": [2, 0], "O": [1, -3]}},
        "crank": {"ends": ["O", "A"], "length": 0.5},
        "rod": {"ends": ["A", "B"], "length": 2.5},
        "b": {"points": {"F": [0, 0], "G": [2, 0], "B": [1, 0]}},
    }
    pairs = [{"turning": "O"}, {"turning": "A"}, {"turning": "B"}]
    pairs += [slot("p", ["f", "b"], "P", "F"), slot("q", ["f", "b"], "Q", "G")]
    return mechanism(links, pairs, inputs, **more)


def turned(position=0.3, **more):
    return press_in_two_slots([{"pair": "O", "position": position, "velocity": 1.0}], sketch={"B": [1, 0]}, **more)


def height(theta):
    """Of the rod's end above an in-line crank (0.5, 2.5), with its slope and bend by the angle."""
    return piston(theta - pi / 2, 0.5, 2.5)


@pytest.mark.parametrize("pins", [(0.0, 2.0), (0.0, 2.0, 5.0), (0.0, 1e-3), (0.0, 2.0, 5.0, 9.0)])
def test_pins_in_parallel_slots_leave_a_translation(pins):
    state = planar.solve(jaw(pins))
    assert state.mobility == 1
    assert state.link("b").angle == pytest.approx(0.0, abs=EXACT)
    for name, x in zip("abcd", pins, strict=False):
        assert state.point(f"G{name}").position == pytest.approx([x, 0.3], abs=EXACT)
        assert state.point(f"G{name}").velocity == pytest.approx([0.0, 0.1], abs=EXACT)
        assert state.point(f"G{name}").acceleration == pytest.approx([0.0, 0.0], abs=EXACT)
    assert any(TO_SECOND_ORDER in remark for remark in state.remarks)


@pytest.mark.parametrize("pins", [(0.0, 2.0), (0.0, 1.7, 5.0)])
def test_what_rounding_leaves_of_the_turning_of_a_body_that_slides_has_no_sense(pins):
    """Nothing else turns beside it: its size and its speed say what would be turning."""
    state = planar.solve(jaw(pins))
    assert state.link("b").sense == "does not turn"
    solution = worked_solution(state)
    assert [tuple(link)[1:] for link in solution.links] == [(0.0, "does not turn", 0.0, "none")]
    assert all(slide.acceleration == 0.0 for slide in solution.slides)
    assert all(point.acceleration == 0.0 for point in solution.points)


def test_pins_a_little_nearer_than_their_slots_lean_and_farther_do_not_go_together():
    """What is held to second order moves by the root of the play."""
    play = 1e-6
    links = {"f": {"points": {"A": [0, 0], "B": [2, 0]}}, "b": {"points": {"G": [0, 0], "H": [2 + play, 0]}}}
    pairs = [slot("a", ["f", "b"], "A", "G"), slot("b", ["f", "b"], "B", "H")]
    inputs = [{"pair": "a", "position": 0.3}]
    leaning = planar.solve(mechanism(links, pairs, inputs)).link("b").angle
    assert abs(leaning) == pytest.approx(sqrt(play), rel=1e-5)
    links["b"]["points"]["H"] = [2 - play, 0]
    with pytest.raises(NoAnswer) as refused:
        planar.solve(mechanism(links, pairs, inputs))
    assert refused.value.outcome is Outcome.CANNOT_BE_ASSEMBLED


@pytest.mark.parametrize("theta", [0.3, 1.5, 4.0])
def test_a_crank_moves_a_body_in_two_slots_as_it_would_in_a_guide(theta):
    state, (y, slope, bend) = planar.solve(turned(theta)), height(theta)
    assert state.point("G").position == pytest.approx([2.0, y - 3.0], abs=EXACT)
    assert state.point("G").velocity == pytest.approx([0.0, slope], abs=EXACT)
    assert state.point("G").acceleration == pytest.approx([0.0, bend], abs=EXACT)
    assert state.link("b").angular_velocity == pytest.approx(0.0, abs=EXACT)


def test_its_whole_turn_with_third_rates_has_the_stroke_ends_of_the_crank():
    motion = planar.cycle(turned(), steps=24, jerk=True)
    assert motion.outcome is Outcome.SOLVED
    ys = np.array([height(theta) for theta in motion.inputs["O"].position])
    assert np.abs(motion.point("F").position[:, 1] - ys[:, 0] + 3.0).max() < EXACT
    assert np.abs(motion.point("F").velocity[:, 1] - ys[:, 1]).max() < EXACT
    assert np.abs(motion.point("F").acceleration[:, 1] - ys[:, 2]).max() < EXACT
    ends = {limit.end: limit.input for limit in motion.limits if limit.of == "p"}
    assert ends == pytest.approx({"TDC": pi / 2, "BDC": 3 * pi / 2}, abs=1e-9)


def test_driven_at_a_slot_it_goes_from_dead_point_to_dead_point_and_all_round():
    """The crank is in line with the rod at y = 0 and y = -1."""
    mechanism_ = press_in_two_slots([{"pair": "p", "position": -0.4, "velocity": 1.0}], sketch={"A": [1.5, -3]})
    motion = planar.cycle(mechanism_, steps=6)
    assert motion.inputs["p"].position[[0, -1]] == pytest.approx([-1.0, 0.0], abs=1e-9)
    round_ = planar.cycle(mechanism_, steps=6, circuit=True)
    angles = round_.link("crank").angle
    assert angles[-1] - angles[0] == pytest.approx(2 * pi, abs=1e-9)
    assert [limit.kind for limit in round_.limits] == ["input dead point"] * 2


@pytest.mark.parametrize(("branch", "sense"), [(1, 1.0), (2, -1.0)])
def test_a_start_on_its_dead_point_is_told_as_one_and_left_either_way(branch, sense):
    mechanism_ = press_in_two_slots([{"pair": "p", "position": 0.0, "velocity": 1.0}], sketch={"A": [1, -2.5]})
    with pytest.raises(NoAnswer) as refused:
        planar.solve(mechanism_)
    assert refused.value.outcome is Outcome.DEAD_POINT
    angles = planar.cycle(mechanism_, steps=6, circuit=True, branches=[branch]).link("crank").angle
    assert angles[-1] - angles[0] == pytest.approx(sense * 2 * pi, abs=1e-9)


def test_slots_on_a_moving_link():
    """A body that slides on a turning link, in the complex plane: e^(i a) (4 + i s)."""
    links = {
        "f": {"points": {"O": [0, 0]}},
        "c": {"points": {"O": [0, 0], "P": [1, 0], "Q": [3, 0], "R": [4, 0]}},
        "b": {"points": {"F": [0, 0], "G": [2, 0], "H": [3, 0.5]}},
    }
    pairs = [{"turning": "O"}, slot("p", ["c", "b"], "P", "F"), slot("q", ["c", "b"], "Q", "G")]
    inputs = [{"pair": "O", "position": 0.3, "velocity": 2}, {"pair": "p", "position": 0.5, "velocity": 1}]
    state = planar.solve(mechanism(links, pairs, inputs))
    unit, at = np.exp(0.3j), np.exp(0.3j) * (4.0 + 1.0j)
    for found, value in (
        (state.point("H").position, at),
        (state.point("H").velocity, unit * 1j + 2j * at),
        (state.point("H").acceleration, -4.0 * at + 2.0 * 2j * unit * 1j),
    ):
        assert complex(*found) == pytest.approx(value, abs=EXACT)
    assert state.mobility == 2
    assert state.link("b").angular_velocity == pytest.approx(2.0, abs=EXACT)


def test_slots_on_two_links_that_others_hold_at_their_distance():
    """Which of the links are held twice shows only with the group that carries the slots."""
    links = {
        "f": {"points": {"O": [0, 0]}},
        "u": {"points": {"U": [0, 0]}},
        "v": {"points": {"V": [0, 0]}},
        "r": {"ends": ["U", "V"], "length": 2},
        "b": {"points": {"F": [0, 0], "G": [2, 0]}},
    }
    pairs = [
        {"sliding": name, "links": ["f", link], "line": {"through": "O", "angle": 0}, "point": point}
        for name, link, point in (("a", "u", "U"), ("k", "v", "V"))
    ]
    pairs += [{"turning": "U"}, {"turning": "V"}, slot("p", ["u", "b"], "U", "F"), slot("q", ["v", "b"], "V", "G")]
    inputs = [{"pair": "a", "position": 0.3, "velocity": 2}, {"pair": "p", "position": 0.5, "velocity": 1}]
    state = planar.solve(mechanism(links, pairs, inputs, sketch={"V": [2, 0]}))
    assert state.point("G").position == pytest.approx([2.3, 0.5], abs=EXACT)
    assert state.point("G").velocity == pytest.approx([2.0, 1.0], abs=EXACT)


def gripper():
    """Two jaws, each in two parallel slots, moved alike by two cranks that wheels turn against each other."""
    links = {
        "f": {"points": {"O": [0, 0], "C": [2, 0], "P": [-3, 3], "Q": [-1, 3], "R": [3, 3], "S": [5, 3]}},
        "k": {"ends": ["O", "A"], "length": 0.5},
        "l": {"ends": ["C", "D"], "length": 0.5},
        "x": {"ends": ["A", "E"], "length": 3.2},
        "y": {"ends": ["D", "H"], "length": 3.2},
        "b": {"points": {"F": [0, 0], "G": [2, 0], "E": [1, 0]}},
        "c": {"points": {"I": [0, 0], "J": [2, 0], "H": [1, 0]}},
    }
    pairs = [{"turning": name} for name in "OACDEH"]
    pairs += [{"gear": "w", "links": ["k", "l"], "ratio": -1, "mesh": {"k": 0, "l": pi}}]
    slots = (("p", "b", "P", "F"), ("q", "b", "Q", "G"), ("r", "c", "R", "I"), ("s", "c", "S", "J"))
    pairs += [slot(name, ["f", link], at, point) for name, link, at, point in slots]
    inputs = [{"pair": "O", "position": 0.4, "velocity": 1}]
    return mechanism(links, pairs, inputs, sketch={"E": [-2, 2.5], "H": [4, 2.5]})


def test_a_gripper_with_two_jaws_moves_both_alike():
    motion = planar.cycle(gripper(), steps=12)
    theta = motion.inputs["O"].position
    expected = 0.5 * np.sin(theta) + np.sqrt(3.2**2 - (2.0 + 0.5 * np.cos(theta)) ** 2)
    for point, x in (("E", -2.0), ("H", 4.0)):
        assert np.abs(motion.point(point).position - np.column_stack([np.full(13, x), expected])).max() < EXACT
    assert motion.residual < EXACT


def test_mobility_says_that_more_is_free_to_first_order_in_every_position():
    found = mobility(jaw((0.0, 2.0, 5.0)))
    assert (found.gruebler, found.instantaneous, found.finite) == (0, 2, 1)
    assert any("every position" in told for told in found.why)


def test_reactions_that_are_shared_are_named_and_have_no_numbers():
    forces = planar.forces(planar.solve(jaw((0.0, 2.0), loads=[{"point": "Ga", "force": [1.0, -3.0]}])))
    assert forces.inputs["a"] == pytest.approx(3.0)
    assert all(np.isnan(forces.reactions[name].force).all() for name in "ab")
    assert {"a", "b"} == set(forces.undetermined)


def test_the_centre_of_a_body_in_parallel_slots_is_at_infinity():
    centres = planar.centres(turned(0.3))
    assert centres["b", "f"].direction == pytest.approx([1.0, 0.0], abs=EXACT)
    # the rod's is where the normal to B's way meets the crank: x = 1 + dy_B / omega of the rod
    state = planar.solve(turned(0.3))
    x = 1.0 - state.point("B").velocity[1] / state.link("rod").angular_velocity
    assert centres["rod", "f"].position == pytest.approx([x, state.point("B").position[1]], abs=1e-9)


def test_circuits_and_assemblies_of_such_a_body():
    found = planar.circuits(turned())
    assert len(found) == 2
    assemblies = planar.modes(turned())
    assert sorted(float(each.points["G"][1]) for each in assemblies) == pytest.approx(
        [-3.0 + 0.5 * sin(0.3) - sqrt(2.5**2 - (0.5 * cos(0.3)) ** 2), height(0.3)[0] - 3.0], abs=1e-9
    )


def test_a_sweep_keeps_designs_in_which_pins_fit_their_slots_apart_from_those_in_which_they_do_not():
    lean, fits, wide = 1.9, 2.0, 2.1
    result = planar.sweep(jaw((0.0, lean)), {"f.B.x": [lean, lean]}, steps=2, stop=1.0, points=["Gb"])
    assert result.position["Gb"][0, :, 1] == pytest.approx([0.3, 0.65, 1.0], abs=1e-9)
    result = planar.sweep(turned(), {"f.Q.x": [lean, fits, wide]}, steps=2, points=["G"])
    assert (result.status[:, 0] == 0).tolist() == [True, True, False]
    assert result.position["G"][1, :, 1] == pytest.approx(
        [height(theta)[0] - 3.0 for theta in (0.3, 0.3 + pi, 0.3 + 2 * pi)], abs=1e-9
    )


@needs_node
def test_a_page_moves_it():
    act = 'page.moveTo(1.1, 0); return page.point("G").position;'
    found = in_node({"press": turned()}, act)
    assert found["press"] == pytest.approx([2.0, height(1.1)[0] - 3.0], abs=1e-9)


def test_the_command_tells_its_mobility(tmp_path):
    (tmp_path / "jaw.json").write_text(planar.dumps(jaw()))
    told = " ".join(run(tmp_path, "solve", "jaw.json").done().split())
    assert "mobility 1" in told
    assert TO_SECOND_ORDER in told


@pytest.mark.parametrize("size", [1, 2, 4, 6])
def test_determinants_without_division_are_those_of_numpy(size):
    matrices = np.random.default_rng(0).normal(size=(3, size, size)) * np.array([1.0, 5.0, 30.0])[:, None, None]
    entries = ca.SX.sym("entries", size, size)
    determinant = ca.Function("determinant", [entries], [symbolic_determinant(entries)])
    for matrix in matrices:
        assert float(determinant(matrix)) == pytest.approx(np.linalg.det(matrix), rel=1e-9)
    singular = matrices[0]
    singular[-1] = singular[: size - 1].sum(axis=0)
    assert float(determinant(singular)) == pytest.approx(0.0, abs=1e-12)


def test_rates_of_determinants_are_those_of_their_polynomials():
    rng, time = np.random.default_rng(0), np.polynomial.Polynomial([0.0, 1.0])
    for size in (1, 2, 4, 6):
        matrices = rng.normal(size=(4, 3, size, size)) * np.array([1.0, 5.0, 0.2, 30.0])[:, None, None, None]
        rates = determinant_rates(matrices)
        for sample in range(3):
            polynomials = [
                [
                    sum(part[i, j] * time**k / factorial(k) for k, part in enumerate(matrices[:, sample]))
                    for j in range(size)
                ]
                for i in range(size)
            ]
            total = sum(
                np.linalg.det(np.eye(size)[list(order)])
                * prod(row[j] for row, j in zip(polynomials, order, strict=True))
                for order in permutations(range(size))
            )
            expected = [total.deriv(k)(0.0) if k else total(0.0) for k in range(4)]
            for k in range(4):
                sizes = np.abs(expected).max()
                assert rates[k, sample] == pytest.approx(expected[k], rel=1e-9, abs=1e-11 * sizes)
        for orders in (1, 2, 3):
            np.testing.assert_allclose(determinant_rates(matrices[:orders]), rates[:orders], rtol=1e-9, atol=1e-10)


def test_on_what_constraints_depend_is_worked_out_once_for_a_structure():
    setup = solved_mechanism(planar.load("watt-six-bar")).solver
    before = block_dependencies(setup)
    count = constraint_dependencies.cache_info().misses
    assert block_dependencies(setup) == before
    assert constraint_dependencies.cache_info().misses == count
