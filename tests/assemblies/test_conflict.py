"""Why a mechanism does not go together: the pairs in conflict by another solver, the changes by closed forms."""

import json
from dataclasses import replace
from math import cos, hypot, pi, radians, sin, sqrt

import numpy as np
import pytest
from scipy.optimize import least_squares

import planar
from planar.assemblies.polynomial.completeness import Completeness
from planar.document.dimensions import change_dimension, link_lengths
from planar.foundation.errors import NoAnswer, Outcome
from tests import command
from tests.builders import bar_linkage, bare_four_bar, six_bar
from tests.closed_forms import between
from tests.draws import first_cases, part


def nearest(mechanism: planar.Mechanism, pairs: set[str], inputs: set[str], tries: int) -> float:
    """What these pins and inputs of a linkage of bars leave open at least, from random starts, by scipy alone.

    Of a bar three unknowns: one end, and its direction.
    """
    frame = {point.name: complex(*point.place) for link in mechanism.links if not link.length for point in link.points}
    driven = [given for given in mechanism.inputs if given.pair in inputs]
    moving = [link for link in mechanism.links if link.length and not {*pairs, *inputs}.isdisjoint(link.names)]
    # all points: those of the frame, first ends, second ends; and which of them are to be one
    named = [*frame, *(link.names[0] for link in moving), *(link.names[1] for link in moving)]
    meeting = [[k for k, own in enumerate(named) if own == name] for name in pairs]
    joined = np.array([(own[0], other) for own in meeting for other in own[1:]], dtype=int).reshape(-1, 2)
    turned = [(k, given.position) for k, link in enumerate(moving) for given in driven if given.pair == link.names[0]]
    which, position = np.array(turned).reshape(-1, 2).T
    fixed, far = np.array(list(frame.values())), np.array([link.length for link in moving])

    def left(w: np.ndarray) -> np.ndarray:
        x, y, angle = w.reshape(-1, 3).T
        first = x + 1j * y
        points = np.concatenate([fixed, first, first + far * np.exp(1j * angle)])
        gaps = points[joined[:, 0]] - points[joined[:, 1]]
        open_ = np.concatenate([np.sin((angle[which.astype(int)] - position) / 2.0), gaps.real, gaps.imag])
        return open_ if open_.size else np.zeros(1)

    size, rng = max(link.length for link in moving), np.random.default_rng(1)
    scale, found = np.tile([size, size, 1.0], (len(moving), 1)), np.inf
    for _ in range(tries):
        start = rng.uniform(-1.0, 1.0, (len(moving), 3)) * [size, size, pi]
        ended = least_squares(left, start.ravel(), x_scale=scale.ravel(), max_nfev=100)
        found = min(found, float(np.abs(ended.fun).max()))
        if found < 1e-6 * size:
            break
    return found / size


def check_irreducible(mechanism: planar.Mechanism, found: planar.Conflict) -> None:
    """The set cannot be met, and without any one of its members the rest can."""
    pairs, inputs = set(found.pairs), set(found.inputs)
    assert nearest(mechanism, pairs, inputs, 6) > 3e-5
    for name in pairs:
        assert nearest(mechanism, pairs - {name}, inputs, 20) < 1e-5
    for name in inputs:
        assert nearest(mechanism, pairs, inputs - {name}, 20) < 1e-5


def check_mends(mechanism: planar.Mechanism, change) -> None:
    """With the change the whole has an assembly in the complete list, with a hundredth less of it none."""
    every = {each.name: each for each in link_lengths(mechanism, frozenset(link.name for link in mechanism.links))}
    there, short = (
        change_dimension(mechanism, every[change.name], change.was + part * (change.value - change.was))
        for part in (1.0, 0.99)
    )
    assert planar.modes(there, certify=False)
    assert not planar.modes(short, certify=False)


REACH = [
    (1.0, 0.8, 0.9, 2.2, 200.0),
    (0.7, 3.0, 1.1, 2.0, 60.0),
    (1.0, 1.2, 1.3, 3.0, 150.0),
    (0.7, 1.0, 2.8, 2.0, -40.0),
]
"""Crank, coupler, rocker, ground and the crank's angle: in turn bars that are too short, and a bar that is too long."""


@pytest.mark.parametrize(("crank", "coupler", "rocker", "ground", "at"), first_cases(REACH, 2))
def test_a_four_bar_is_mended_by_the_law_of_cosines(crank, coupler, rocker, ground, at):
    mechanism = bare_four_bar(crank, coupler, rocker, ground, radians(at))
    found = planar.conflict(mechanism)
    assert (found.pairs, found.inputs, found.complete) == (("A", "B", "C", "D"), ("A",), Completeness.PROVED)
    far = sqrt(crank**2 + ground**2 - 2.0 * crank * ground * cos(radians(at)))
    least, most = abs(coupler - rocker), coupler + rocker
    limit = most if far > most else least

    def third(side: float) -> list[float]:
        """What the other side may be, the angle between the two kept, so that the diagonal is at its limit."""
        root = limit**2 - (side * sin(radians(at))) ** 2
        return [side * cos(radians(at)) + sign * sqrt(root) for sign in (1.0, -1.0)] if root >= 0.0 else []

    beyond = 1.0 if far > most else -1.0
    expected = {
        "coupler.length": [far - rocker] if beyond > 0.0 else [rocker - far, rocker + far],
        "rocker.length": [far - coupler] if beyond > 0.0 else [coupler - far, coupler + far],
        "crank.length": third(ground),
        "frame.D.x": third(crank),
        "frame.A.x": [ground - each for each in third(crank)],
    }
    by_name = {each.name: each for each in found.dimensions}
    for name, ends in expected.items():
        there = [each for each in ends if not name.endswith("length") or each > 0.0]
        if not there:
            assert name not in by_name
            continue
        change = by_name[name]
        nearest_one = min(there, key=lambda each: abs(each - change.was))
        assert change.value == pytest.approx(nearest_one, abs=2e-4 * max(1.0, abs(nearest_one)))
        check_mends(mechanism, change)
    moves = [abs(each.value - each.was) for each in found.dimensions]
    assert moves == pytest.approx(sorted(moves), rel=1e-4)


@pytest.mark.parametrize("at", [150.0, 180.0])  # farthest open at 180: there no small move closes any of it
def test_of_a_four_bar_the_nearest_position_of_the_crank_is_told(at):
    mechanism = bare_four_bar(1.0, 1.2, 1.3, 3.0, radians(at))
    (change,) = planar.conflict(mechanism).positions
    limit = between(1.0, 3.0, 2.5)
    assert change.name == "A"
    off = pi - abs(change.value - pi)
    assert off == pytest.approx(limit, abs=1e-4)
    assert off < limit
    assert planar.modes(mechanism, {"A": change.value}, certify=False)


def test_where_the_second_loop_never_closes_the_first_is_no_part_of_the_conflict():
    """C is at most 100 + 56 from G, and F would have to be 240 and 30 from these."""
    mechanism = six_bar(30.0, 300.0)
    found = planar.conflict(mechanism)
    assert (set(found.pairs), found.inputs) == (set("CDFG"), ())
    assert "moving the input at 'A' does not mend it" in found.remarks[1]
    assert found.positions == ()
    check_irreducible(mechanism, found)
    for turned in np.linspace(0.0, 2.0 * pi, 7):
        assert not planar.modes(mechanism, {"A": float(turned)}, certify=False)


def test_where_the_second_loop_closes_elsewhere_the_first_and_its_input_belong_to_the_conflict():
    mechanism = six_bar(50.0, 68.0)
    assert not planar.modes(mechanism, certify=False)
    found = planar.conflict(mechanism)
    assert (set(found.pairs), found.inputs) == (set("ABCDFG"), ("A",))
    check_irreducible(mechanism, found)
    (change,) = found.positions
    assert planar.modes(mechanism, {"A": change.value}, certify=False)
    short = change.was + 0.99 * (change.value - change.was)
    assert not planar.modes(mechanism, {"A": short}, certify=False)


@pytest.mark.parametrize("third", first_cases([49.0, 51.0]))
def test_a_third_crank_that_differs_from_those_of_a_parallelogram(third):
    plate = {"points": {"B": [0, 0], "C": [100, 0], "F": [50, 0]}}
    links = {"frame": {"points": {"A": [0, 0], "D": [100, 0], "G": [50, 0]}}, "plate": plate}
    links |= {name: {"ends": [*name], "length": far} for name, far in (("AB", 50), ("DC", 50), ("GF", third))}
    value = {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": links,
        "pairs": [{"turning": name} for name in "ABCDFG"],
        "inputs": [{"pair": "A", "position": 60, "velocity": "1 rad/s"}],
        "sketch": {"C": [125, 43]},
    }
    found = planar.conflict(planar.from_dict(value))
    assert set(found.pairs) == set("ABCDFG")
    change = found.dimensions[0]
    assert (change.name, change.shown) == ("GF.length", "50 mm")
    links["GF"]["length"] = 50
    assert planar.conflict(planar.from_dict(value)) is None
    # with any one crank away the other two turn together
    links["GF"]["length"] = third
    for away, driven in (("AB", "D"), ("DC", "A"), ("GF", "A")):
        rest = value | {"links": {name: link for name, link in links.items() if name != away}, "sketch": {}}
        rest["pairs"] = [{"turning": name} for name in "ABCDFG" if name not in away]
        rest["inputs"] = [{"pair": driven, "position": 60, "velocity": "1 rad/s"}]
        assert planar.modes(planar.from_dict(rest), certify=False)


def test_a_triangle_in_which_a_side_is_too_long_is_a_conflict_by_itself():
    """Beside it on the frame a four-bar that is sound."""
    links = {"AP": ("A", "P", 1.0), "DP": ("D", "P", 1.0)}
    links |= {"EF": ("E", "F", 1.0), "FH": ("F", "H", 3.0), "KH": ("K", "H", 2.5)}
    value = bar_linkage({"A": [0.0, 0.0], "D": [3.0, 0.0], "E": [0.0, -5.0], "K": [3.2, -5.0]}, links, ("E", 0.3))
    found = planar.conflict(value)
    assert (set(found.pairs), found.inputs, found.complete) == (set("ADP"), (), Completeness.PROVED)
    check_irreducible(value, found)
    assert {each.name for each in found.dimensions} >= {"AP.length", "DP.length", "frame.A.x", "frame.D.x"}


def test_two_inputs_that_disagree_are_both_in_the_conflict():
    mechanism = bare_four_bar(1.0, 3.0, 2.5, 3.2, 0.8)
    rocker = planar.solve(mechanism).link("rocker").angle
    both = replace(mechanism, inputs=(*mechanism.inputs, planar.Input("D", rocker + 0.1)))
    found = planar.conflict(both)
    assert (found.pairs, found.inputs) == (("A", "B", "C", "D"), ("A", "D"))
    assert "D" in {each.name for each in found.positions}
    for change in found.positions:
        assert planar.modes(both, {change.name: change.value}, certify=False)
    (back,) = (each.value for each in found.positions if each.name == "D")
    assert min(abs(back - mode.state.link("rocker").angle) for mode in planar.modes(mechanism)) < 1e-9


def test_gears_in_a_ring_whose_ratios_disagree_hold_at_one_angle():
    links = {"frame": {"points": {"O": [0, 0], "P": [50, 0], "Q": [25, 40]}}}
    links |= {name: {"ends": [at, name], "length": 10} for name, at in zip("abc", "OPQ", strict=True)}
    ratios = {"ab": -0.5, "bc": -2.0, "ca": -1.0}
    gears = [{"gear": name, "links": [*name], "ratio": each} for name, each in ratios.items()]
    value = {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": links,
        "pairs": [*({"turning": name} for name in "OPQ"), *gears],
        "inputs": [{"pair": "O", "position": 20, "velocity": "1 rad/s"}],
    }
    found = planar.conflict(planar.from_dict(value))
    assert (found.pairs, found.inputs) == (("ab", "bc", "ca"), ("O",))
    assert [(each.name, each.value) for each in found.positions] == [("O", pytest.approx(0.0, abs=1e-12))]
    assert found.complete is Completeness.NOT
    assert "no proof" in found.remarks[1]


def broken(seed: int) -> planar.Mechanism:
    """A random linkage of dyads, closed as built, with one bar cut short."""
    rng = np.random.default_rng(seed)
    angle = float(rng.uniform(0.0, 2.0 * pi))
    frame = {"A": [0.0, 0.0], "D": [3.0, 0.0]}
    at = {name: np.array(place) for name, place in frame.items()} | {"B": np.array([cos(angle), sin(angle)])}
    ends = {"AB": ("A", "B")}
    for number in range(1, 1 + rng.integers(1, 4)):
        others = [name for name in at if name != "A"]
        p, q = ("B", "D") if number == 1 else map(str, rng.choice(others, 2, replace=False))
        at[name := f"P{number}"] = rng.uniform(-2.0, 4.0, 2)
        ends |= {f"{p}{name}": (p, name), f"{q}{name}": (q, name)}
    links = {name: (a, b, hypot(*(at[a] - at[b]))) for name, (a, b) in ends.items()}
    a, b, length = links[short := str(rng.choice([name for name in links if name != "AB"]))]
    return bar_linkage(frame, links | {short: (a, b, length * rng.uniform(0.05, 0.6))}, ("A", angle))


@pytest.mark.parametrize("seed", part([0, 2, 4, 5, 6, 9, 13, 15, 17, 21, 23], 3))  # the others go together as well
def test_of_random_linkages_with_a_bar_cut_short_the_conflict_is_irreducible_and_is_mended(seed):
    mechanism = broken(seed)
    assert not planar.modes(mechanism, certify=False)
    found = planar.conflict(mechanism)
    assert found.complete is not Completeness.NOT
    check_irreducible(mechanism, found)
    assert found.dimensions
    for change in found.dimensions[:2]:
        check_mends(mechanism, change)


def test_there_is_none_where_the_mechanism_goes_together_and_none_is_looked_for_where_links_are_free():
    assert planar.conflict(planar.load("four-bar")) is None
    with pytest.raises(NoAnswer) as caught:
        planar.conflict(replace(planar.load("four-bar"), inputs=()))
    assert caught.value.outcome is Outcome.TOO_FEW_INPUTS


def test_the_command_says_why_before_it_refuses(tmp_path):
    mechanism = bare_four_bar(1.0, 1.2, 1.3, 3.0, radians(150.0))
    (tmp_path / "far.json").write_text(planar.dumps(mechanism), encoding="utf-8")
    ended = command.run(tmp_path, "modes", "far.json")
    told = ended.refused(1)
    limit = float(between(1.0, 3.0, 2.5))
    assert f"or at A = {limit:.4f}"[:-1] in told
    assert "in conflict: pairs 'A', 'B', 'C' and 'D' and the input at 'A'" in ended.out
    assert "coupler.length" in ended.out
    value = json.loads(command.run(tmp_path, "modes", "far.json", "--json").out)
    assert value["outcome"] == "cannot be assembled"
    assert told.endswith(value["reason"])
    conflict = value["conflict"]
    assert (conflict["pairs"], conflict["inputs"]) == (["A", "B", "C", "D"], ["A"])
    assert conflict["assembles"]["A"]["intervals"] == [pytest.approx([-limit, limit], abs=1e-7)]
    assert conflict["positions"][0]["value"] == pytest.approx(limit, abs=1e-4)


def test_where_two_conflicts_stand_side_by_side_no_single_change_is_offered_and_that_is_said():
    links = {
        "crank": ("A", "B", 60.0),
        "rod": ("B", "C", 100.0),
        "rocker": ("D", "C", 120.0),
        "other rod": ("B", "F", 100.0),
        "other rocker": ("E", "F", 120.0),
    }
    frame = {"A": [0.0, 0.0], "D": [300.0, 0.0], "E": [-300.0, 0.0]}
    found = planar.conflict(bar_linkage(frame, links, ("A", 1.7)))
    assert set(found.pairs) in ({"A", "B", "C", "D"}, {"A", "B", "E", "F"})
    assert (found.dimensions, found.positions) == ((), ())
    assert "no change of one dimension" in found.remarks[-1]
