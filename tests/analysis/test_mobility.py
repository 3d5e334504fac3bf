"""Mobility by count, by rank in a position, and of the motion; and which pairs hold more than they need to."""

import copy
import json
from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import NoAnswer, Outcome
from planar.solving.checks import rank
from planar.solving.full_constraints import FullConstraints
from planar.solving.position import PositionSolver
from tests.builders import four_bar_document
from tests.draws import first_cases, part
from tests.linkages import conditioning, determinate, random_linkage

MODELS = Path(__file__).parents[2] / "models"
DEG = np.pi / 180


def mechanism(links, pairs, inputs=(), sketch=None):
    value = {"planar": 1, "units": {"angle": "deg"}, "frame": "f", "links": links, "pairs": pairs}
    return files.from_dict(copy.deepcopy(value | {"inputs": list(inputs), "sketch": sketch or {}}))


def pins(names):
    return [{"turning": name} for name in names]


def four_bar_in_degrees(a, b, c, d, theta, sketch):
    units, names = {"angle": "deg"}, ["f", "AB", "BC", "DC"]
    value = four_bar_document(a, b, c, d, theta, names=names, units=units, omega="3 rad/s", sketch=sketch or {})
    return files.from_dict(value)


def three(found):
    return found.gruebler, found.instantaneous, found.finite


def constraints_at(value):
    """All constraints of a mechanism and its coordinates in the file's position."""
    solver = PositionSolver(value)
    z = solver.find_assembly().z
    w = solver.functions.coordinates(z, solver.inputs.u, solver.inputs.p)
    return FullConstraints(solver), w


def excess(slope, owners, among):
    """How many rows of these owners follow from others of them."""
    rows = [row for row, owner in enumerate(owners) if owner in among]
    return len(rows) - (rank(slope[rows]) if rows else 0)


def smallest(value, sets):
    """Every set depends on itself, none of its pairs can be left out of that, and together they hold all surplus."""
    constraints, w = constraints_at(value)
    slope, owners = constraints.jacobian(w), constraints.pair_of_row
    for each in sets:
        assert excess(slope, owners, each) > 0
        for pair in each:
            assert excess(slope, owners, set(each) - {pair}) == 0
    return excess(slope, owners, set(owners))


# the counts


def test_a_four_bar_has_one_freedom_however_it_is_counted():
    found = planar.mobility(planar.load("four-bar"))
    assert three(found) == (1, 1, 1)
    assert (found.surplus, found.redundant, found.why) == (0, (), ())


@pytest.mark.parametrize(
    "model", ["oldham", "elliptical-trammel", "peaucellier-lipkin", "planetary-gear-set", "scissor-lift", "scotch-yoke"]
)
def test_what_is_not_redundant_is_counted_right(model):
    found = planar.mobility(planar.load(model))
    assert three(found) == (1, 1, 1)
    assert (found.surplus, found.redundant, found.why) == (0, (), ())


def test_a_differential_has_two_freedoms():
    assert three(planar.mobility(planar.load("planetary-differential"))) == (2, 2, 2)


@pytest.mark.parametrize(("theta", "sketch"), [(0, {"C": [3, 0]}), (180, {"C": [1, 0]})])
def test_a_flat_parallelogram_may_go_on_in_two_ways_one_at_a_time(theta, sketch):
    found = planar.mobility(four_bar_in_degrees(1, 2, 1, 2, theta, sketch))
    assert three(found) == (1, 2, 1)
    (why,) = found.why
    assert "1 more way, but to first order only" in why
    assert "branches of the motion cross here" in why


TWO_BARS = {
    "f": {"points": {"A": [0, 0], "D": [3, 0], "O": [0, -2]}},
    "a": {"ends": ["A", "B"], "length": 1},
    "b": {"ends": ["B", "D"], "length": 2},
}


def test_two_bars_in_line_between_fixed_pins_shake_but_do_not_move():
    found = planar.mobility(mechanism(TWO_BARS, pins("ABD"), sketch={"B": [1, 0]}))
    assert three(found) == (0, 1, 0)
    (why,) = found.why
    assert "1 more way, but to first order only" in why
    assert "nothing moves on" in why


def test_a_crank_beside_bars_in_line_is_all_that_moves():
    links = TWO_BARS | {"c": {"ends": ["O", "P"], "length": 1}}
    inputs = [{"pair": "O", "position": 30}]
    assert three(planar.mobility(mechanism(links, pins("ABDO"), inputs, {"B": [1, 0]}))) == (1, 2, 1)


@pytest.mark.parametrize(
    ("lengths", "theta", "sketch"),
    first_cases(
        [
            ((2, 3, 1.5, 6.5), 0, {"B": [2, 0], "C": [5, 0]}),
            ((2, 6.5, 1.5, 3), 180, {"B": [-2, 0], "C": [4.5, 0]}),
            ((6.5, 3, 1.5, 2), 0, {"B": [6.5, 0], "C": [3.5, 0]}),
        ],
        2,
    ),
)
def test_a_four_bar_that_just_reaches_cannot_move_at_all(lengths, theta, sketch):
    """The longest is the other three together. Three angles, and of two closures the one along the line vanishes to
    first order: 3 - 1 = 2 ways in this position; to second order the stretched bars only become too short."""
    found = planar.mobility(four_bar_in_degrees(*lengths, theta, sketch))
    assert three(found) == (1, 2, 0)
    assert found.surplus == 0
    first, second = found.why
    assert "2 more ways, but to first order only" in first
    assert "nothing moves on" in first
    assert "the count gives 1" in second
    assert "0 ways" in second


def test_a_structure_and_a_truss_with_a_bar_too_many():
    truss = {
        "f": {"points": {"A": [0, 0], "B": [1, 0], "E": [2, 0]}},
        "a": {"ends": ["A", "C"], "length": 1},
        "b": {"ends": ["B", "C"], "length": 1},
    }
    assert three(planar.mobility(mechanism(truss, pins("ABC"), sketch={"C": [0.5, 1]}))) == (0, 0, 0)
    far = float(np.hypot(1.5, np.sqrt(3) / 2))
    found = planar.mobility(
        mechanism(truss | {"e": {"ends": ["E", "C"], "length": far}}, pins("ABCE"), sketch={"C": [0.5, 1]})
    )
    # a pin of three links is two pairs: 9 - 10
    assert three(found) == (-1, 0, 0)
    assert found.surplus == 1
    (redundant,) = found.redundant
    assert {"A", "B", "E"} <= set(redundant)


def test_links_that_nothing_drives_are_counted_too():
    links = {"f": {"points": {"O": [0, 0]}}} | {
        f"a{k}": {"ends": ["O" if k == 0 else f"P{k}", f"P{k + 1}"], "length": 1} for k in range(4)
    }
    assert three(planar.mobility(mechanism(links, pins(["O", "P1", "P2", "P3"])))) == (4, 4, 4)


def test_what_cannot_be_assembled_has_no_mobility():
    with pytest.raises(NoAnswer) as refused:
        planar.mobility(four_bar_in_degrees(1, 2, 1, 9, 60, {}))
    assert refused.value.outcome is Outcome.CANNOT_BE_ASSEMBLED


# redundant pairs


def third_crank(theta, off, along=0.8):
    links = {
        "f": {"points": {"A": [0, 0], "D": [2, 0], "E": [along, off]}},
        "AB": {"ends": ["A", "B"], "length": 1},
        "rod": {"points": {"B": [0, 0], "C": [2, 0], "F": [along, off]}},
        "DC": {"ends": ["D", "C"], "length": 1},
        "EF": {"ends": ["E", "F"], "length": 1},
    }
    turn = np.array([np.cos(theta * DEG), np.sin(theta * DEG)])
    sketch = {"C": list(turn + np.array([2, 0])), "F": list(turn + np.array([along, off]))}
    return mechanism(links, pins("ABCDEF"), [{"pair": "A", "position": theta, "velocity": "3 rad/s"}], sketch)


PLACES = [(0.7, 0.8), (0.0, 0.8), (0.0, 0.5), (0.0, 1.3)]
"""Of the third crank's pins: off the line of the others, and along it."""


@pytest.mark.parametrize(
    ("theta", "off", "along"),
    first_cases(
        sorted(
            ((theta, *place) for place in PLACES for theta in (0, 60, 180)),
            key=lambda case: (0, 60, 180, 60)[PLACES.index(case[1:])] != case[0],
        ),
        len(PLACES),
    ),
)
def test_of_six_pins_of_three_parallel_cranks_one_is_superfluous(theta, off, along):
    value = third_crank(theta, off, along)
    found = planar.mobility(value)
    flat = off == 0.0 and theta in (0, 180)
    assert three(found) == (0, 2 if flat else 1, 1)
    assert found.surplus == 1
    assert [set(each) for each in found.redundant] == [set("ABCDEF")]
    assert any("1 constraint of the pairs follows from the others" in why for why in found.why)
    assert any("in 1 way where the count gives 0" in why for why in found.why)
    assert any("'A', 'B', 'C', 'D', 'E' and 'F'" in why for why in found.why)
    assert any("first order" in why for why in found.why) == flat
    if theta == 60:
        # where two cranks lie flat the four pins of these two depend on one another already, but only there
        assert smallest(value, found.redundant) == 1
    assert planar.solve(value).mobility == 1


def guides(count):
    names = [f"G{k}" for k in range(count)]
    places = {name: [0.1 * k, 1.0 * k] for k, name in enumerate(names)}
    links = {"f": {"points": places}, "table": {"points": {f"t{name}": at for name, at in places.items()}}}
    pairs = [
        {"sliding": f"s{name}", "links": ["f", "table"], "line": {"through": name}, "point": f"t{name}"}
        for name in names
    ]
    return mechanism(links, pairs, [{"pair": "sG0", "position": 0.3, "velocity": "2 m/s"}])


@pytest.mark.parametrize("count", [2, 3, 5])
def test_of_parallel_guides_any_two_hold_the_same(count):
    value = guides(count)
    found = planar.mobility(value)
    assert three(found) == (3 - 2 * count, 1, 1)
    assert found.surplus == 2 * count - 2
    assert all(len(each) == 2 for each in found.redundant)
    # every guide is named, and each set is one of the pairs of them
    assert {name for each in found.redundant for name in each} == {f"sG{k}" for k in range(count)}
    constraints, w = constraints_at(value)
    slope, owners = constraints.jacobian(w), constraints.pair_of_row
    assert all(excess(slope, owners, pair) == 2 for pair in combinations(set(owners), 2))
    smallest(value, found.redundant)
    state = planar.solve(value)
    assert state.mobility == 1
    last = state.pair(f"sG{count - 1}")
    assert last == pytest.approx({"displacement": 0.3, "velocity": 2.0, "acceleration": 0.0}, abs=1e-14)


def scissor_lift_with(extra, **points):
    value = json.loads((MODELS / "scissor-lift.json").read_text(encoding="utf-8"))
    value["pairs"].append(extra)
    for name, at in points.items():
        value["links"]["frame"]["points"][name] = at
    return files.from_dict(value)


EDGE = {
    "slot": "edge guide",
    "links": ["frame", "platform"],
    "line": {"through": "W", "angle": 90},
    "point": "edge",
}
MAST = {
    "sliding": "mast",
    "links": ["frame", "platform"],
    "line": {"through": "O", "angle": 90},
    "point": "L3",
    "turn": -90,
}


@pytest.mark.parametrize(
    ("value", "surplus"),
    [(scissor_lift_with(EDGE, W=[700, 0]), 1), (scissor_lift_with(MAST), 2)],
    ids=["a pin in a slot", "a sliding guide"],
)
def test_a_scissor_lift_whose_platform_is_guided_once_more(value, surplus):
    """It rises 3 sqrt(l^2 - x^2) and stays level by itself; a guide beside it holds what is held already."""
    state = planar.solve(value)
    x, v = 0.52, -0.1
    height = 3 * np.sqrt(0.36 - x * x)
    assert state.mobility == 1
    assert state.point("L3").position == pytest.approx([0, height], abs=1e-14)
    assert state.point("L3").velocity == pytest.approx([0, -9 * x * v / height], abs=1e-13)
    assert state.point("L3").acceleration == pytest.approx([0, -9 * v * v * 0.36 / (0.36 - x * x) / height], abs=1e-12)
    found = planar.mobility(value)
    assert three(found) == (1 - surplus, 1, 1)
    assert found.surplus == surplus
    extra = "edge guide" if surplus == 1 else "mast"
    # without the guide nothing is redundant, so that it is in every set
    assert found.redundant
    assert all(extra in each for each in found.redundant)
    assert smallest(value, found.redundant) == surplus
    assert any(f"'{extra}'" in why for why in found.why)
    assert any(f"the count gives {1 - surplus}" in why for why in found.why)


def gear_ring(ratio, extra=False, position=40):
    links = {"f": {"points": {"O": [0, 0], "P": [0.5, 0], "Q": [0.25, 0.4], "W": [1, 0]}}}
    links |= {name: {"ends": [at, name], "length": 0.1} for name, at in zip("abc", "OPQ", strict=True)}
    pairs = pins("OPQ")
    pairs += [
        {"gear": "ab", "links": ["a", "b"], "ratio": -2 / 3},
        {"gear": "bc", "links": ["b", "c"], "ratio": -1.2},
        {"gear": "ca", "links": ["c", "a"], "ratio": ratio},
    ]
    inputs = [{"pair": "O", "position": position, "velocity": "2 rad/s", "acceleration": "3 rad/s^2"}]
    if extra:
        links["w"] = {"ends": ["W", "w"], "length": 0.1}
        pairs.append({"turning": "W"})
        inputs.append({"pair": "W", "position": 10})
    return mechanism(links, pairs, inputs)


@pytest.mark.parametrize("extra", [False, True])
@pytest.mark.parametrize("factor", [1.0, 0.3, 7.0])
def test_a_ring_of_gears_that_closes_turns(extra, factor):
    """Three wheels in a ring lock unless their ratios make 1: then one gear is superfluous."""
    value = files.to_dict(gear_ring(1.25, extra))
    for pair in value["pairs"]:
        if pair.get("gear") in ("ab", "ca"):
            pair["ratio"] *= factor if pair["gear"] == "ab" else 1 / factor
    value = files.from_dict(value)
    found = planar.mobility(value)
    assert three(found) == (0 + extra, 1 + extra, 1 + extra)
    assert [set(each) for each in found.redundant] == [{"ab", "bc", "ca"}]
    assert smallest(value, found.redundant) == 1
    state = planar.solve(value)
    for name, ratio in (("a", 1.0), ("b", -2 / 3 * factor), ("c", 0.8 * factor)):
        assert state.link(name).angle == pytest.approx(40 * DEG * ratio, abs=1e-13)
        assert state.link(name).angular_velocity == pytest.approx(2 * ratio, abs=1e-13)
        assert state.link(name).angular_acceleration == pytest.approx(3 * ratio, abs=1e-13)
    assert state.mobility == 1 + extra


def test_a_ring_of_gears_that_does_not_close_is_locked():
    assert three(planar.mobility(gear_ring(-1.25, position=0))) == (0, 0, 0)
    with pytest.raises(NoAnswer) as refused:
        planar.solve(gear_ring(-1.25, position=0))
    assert refused.value.outcome is Outcome.STRUCTURE
    assert "nothing moves" in refused.value.reason
    assert "remove the input at 'O'" in refused.value.reason


def test_a_second_planet_only_shares_the_load():
    value = json.loads((MODELS / "planetary-gear-set.json").read_text(encoding="utf-8"))
    value["links"]["arm"]["points"] = {"P2": {"along": ["O", "P"], "distance": -60}}
    value["links"]["planet 2"] = {"ends": ["P2", "T2"], "length": 20}
    second = [
        {"gear": "inner mesh 2", "links": ["sun", "planet 2"], "carrier": "arm", "radii": [40, 20]},
        {"gear": "outer mesh 2", "links": ["frame", "planet 2"], "carrier": "arm", "radii": [-80, 20]},
    ]
    value["pairs"] += [{"turning": "P2"}, *second]
    value = files.from_dict(value)
    found = planar.mobility(value)
    assert three(found) == (0, 1, 1)
    (redundant,) = found.redundant
    assert set(redundant) == {"inner mesh", "outer mesh", "inner mesh 2", "outer mesh 2"}
    assert smallest(value, found.redundant) == 1
    state = planar.solve(value)
    sun = 3000 * 2 * np.pi / 60
    # Willis: with the ring of 80 held and a sun of 40 the arm turns at a third, the planets at minus the sun's speed
    assert state.link("arm").angular_velocity == pytest.approx(sun / 3, rel=1e-13)
    for planet in ("planet", "planet 2"):
        assert state.link(planet).angular_velocity == pytest.approx(-sun, rel=1e-13)
    assert state.mobility == 1


def test_two_redundant_parts_are_told_apart():
    """Three parallel cranks, and beside them a table on two guides: each has its own set."""
    cranks = files.to_dict(third_crank(60, 0.7))
    table = files.to_dict(guides(2))
    links = cranks["links"] | {"table": table["links"]["table"]}
    links["f"]["points"] |= table["links"]["f"]["points"]
    value = cranks | {"links": links, "pairs": [*cranks["pairs"], *table["pairs"]]}
    value["inputs"] = [*cranks["inputs"], *table["inputs"]]
    value = files.from_dict(value)
    found = planar.mobility(value)
    assert three(found) == (-1, 2, 2)
    assert {frozenset(each) for each in found.redundant} == {frozenset("ABCDEF"), frozenset({"sG0", "sG1"})}
    assert planar.solve(value).mobility == 2


# any linkage


@pytest.mark.parametrize("seed", part(range(40), 8))
@pytest.mark.parametrize(("links", "higher"), [(4, 0.0), (6, 0.0), (5, 0.5)])
def test_of_random_linkages_that_are_solved_all_mobilities_are_the_number_of_inputs(seed, links, higher):
    built = random_linkage(seed, links, higher=higher)
    value = files.from_dict(built.value)
    settled = determinate(value, built)
    try:
        state = planar.solve(value)
    except NoAnswer:
        # the linkage is closed where it was built, so only freedom can be what is wrong
        assert not settled
        return
    assert settled
    solver = PositionSolver(value)
    if conditioning(solver, solver.find_assembly().z) < 1e-3:
        return
    found = planar.mobility(value)
    assert found.finite == found.instantaneous == state.mobility == len(value.inputs)
    assert found.gruebler == found.finite
    assert (found.surplus, found.redundant, found.why) == (0, (), ())
    # the rank that the count rests on, by numpy alone
    constraints, w = constraints_at(value)
    slope = constraints.jacobian(w)
    assert np.linalg.matrix_rank(slope, tol=1e-7) == w.size - len(value.inputs)
