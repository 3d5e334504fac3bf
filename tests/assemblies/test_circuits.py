"""Circuits and branches: as many as closed forms, published classifications and fine sampling of dyads say."""

from collections import Counter
from itertools import product
from math import acos, pi, sin, sqrt

import numpy as np
import pytest
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import planar
from planar.assemblies.circuits.chebyshev_zeros import SignedLog, find_zeros
from planar.assemblies.polynomial.completeness import Completeness
from tests.builders import bare_four_bar, slider_crank_document
from tests.closed_forms import between
from tests.draws import draws, first_cases, is_exhaustive, part
from tests.known import MODELS
from tests.linkages import random_linkage

CLAIMED = Completeness.NUMERICALLY
TURN = 2.0 * pi


def driven_slide(crank: float, rod: float, off: float, at: float) -> planar.Mechanism:
    """A slider-crank driven by its slide."""
    return planar.from_dict(slider_crank_document(crank, rod, at, off, 0, slide="slide", driven="slide"))


class Chain:
    """A crank on the frame and dyads at random, each between points of links before it, in complex numbers."""

    def __init__(self, seed: int, dyads: int):
        rng = np.random.default_rng([8, seed])
        self.points = {"frame": {"A": 0.0 + 0.0j}, "crank": {"A": 0.0 + 0.0j}}
        self.dyads = []
        for k in range(dyads):
            links = list(self.points)
            # the first holds the crank, each other one what was put there before it
            first = "crank" if k == 0 else links[-1 - int(rng.integers(2))]
            second = "frame" if k == 0 else str(rng.choice([link for link in links if link != first]))
            pins = []
            for link, name in ((first, f"P{k}"), (second, f"Q{k}")):
                size = 1.0 if link == "crank" else 2.5
                self.points[link][name] = complex(*rng.uniform(-size, size, 2))
                pins.append((link, self.points[link][name]))
            r, s = rng.uniform(1.5, 3.5, 2)
            self.points[f"one {k}"] = {f"P{k}": 0.0j, f"J{k}": complex(r)}
            self.points[f"other {k}"] = {f"Q{k}": 0.0j, f"J{k}": complex(s)}
            self.dyads.append((*pins, r, s))

    def mechanism(self, driven: str = "A") -> planar.Mechanism:
        pins = Counter(name for points in self.points.values() for name in points)
        value = {
            "planar": 1,
            "name": "chain",
            "units": {"length": "m", "angle": "rad"},
            "frame": "frame",
            "links": {
                link: {"points": {name: [at.real, at.imag] for name, at in points.items()}}
                for link, points in self.points.items()
            },
            "pairs": [{"turning": name} for name, count in pins.items() if count == 2],
            "inputs": [{"pair": driven, "position": 0.3, "velocity": 1.0}],
        }
        return planar.from_dict(value)

    def reached(self, angles: np.ndarray, signs: tuple[int, ...]) -> np.ndarray:
        """How many dyads go together one after the other, with these sides, at each angle."""
        frames = {"frame": (0.0j, 1.0 + 0.0j), "crank": (0.0j, np.exp(1j * angles))}
        count, whole = np.zeros(len(angles), dtype=int), np.ones(len(angles), dtype=bool)
        for k, ((one, at), (other, there), r, s) in enumerate(self.dyads):
            p, q = frames[one][0] + frames[one][1] * at, frames[other][0] + frames[other][1] * there
            far = np.abs(q - p)
            whole = whole & (abs(r - s) < far) & (far < r + s)
            count += whole
            along = (r * r - s * s + far * far) / (2.0 * far)
            across = signs[k] * np.sqrt(np.maximum(r * r - along * along, 0.0))
            joint = p + (q - p) / far * (along + 1j * across)
            frames[f"one {k}"], frames[f"other {k}"] = (p, (joint - p) / r), (q, (joint - q) / s)
        return count

    def sampled(self, samples: int = 4000) -> list[int]:
        """The number of branches of every circuit, as samples of the crank's turn join into components."""
        many = len(self.dyads)
        angles = 0.123 + TURN / samples * np.arange(samples)
        reached = np.array([self.reached(angles, signs) for signs in product((1, -1), repeat=many)])
        closed, nodes = reached == many, np.arange(reached.size).reshape(reached.shape)
        on = closed & np.roll(closed, -1, axis=1)
        joined, dead = [np.array([nodes[on], np.roll(nodes, -1, axis=1)[on]])], []
        for way in (-1, 1):
            beside = np.roll(reached, way, axis=1)
            row, at = np.nonzero(closed & (beside < many))
            # the dyad that comes apart on the way does so where its two sides meet; rows have a bit for each side
            side = 1 << (many - 1 - beside[row, at])
            joined.append(np.array([nodes[row, at], nodes[row ^ side, at]]))
            dead.append(nodes[row, at][row & side == 0])
        edges = np.hstack(joined)
        graph = coo_array((np.ones(edges.shape[1]), edges), (nodes.size, nodes.size))
        _, parts = connected_components(graph, directed=False)
        ends = np.bincount(parts[np.concatenate(dead)], minlength=nodes.size)
        return sorted(max(1, int(ends[part])) for part in np.unique(parts[closed.ravel()]))


@pytest.mark.parametrize("seed", part(range(24), 4))
def test_random_chains_of_dyads_have_the_circuits_and_branches_that_samples_join_into(seed):
    chain = Chain(seed, 1 + seed % 3)
    found = planar.circuits(chain.mechanism())
    assert found.complete is CLAIMED, found.remarks
    assert sorted(len(each.branches) for each in found) == chain.sampled()


def test_branches_of_half_a_thousandth_of_a_radian_are_not_missed():
    chain = Chain(26, 3)
    found = planar.circuits(chain.mechanism())
    assert sorted(len(each.branches) for each in found) == chain.sampled(20_000) == [2, 2, 2, 4]
    assert min(branch.high - branch.low for each in found for branch in each.branches) < 6e-4
    assert chain.sampled(2000) != [2, 2, 2, 4]  # so that samples alone could not tell


@pytest.mark.parametrize(("seed", "dyads", "driven"), part([(23, 2, "Q1"), (35, 3, "Q2"), (31, 2, "Q1")], 2))
def test_a_linkage_driven_through_a_larger_group_has_as_many_circuits_as_by_its_crank(seed, dyads, driven):
    chain = Chain(seed, dyads)
    found = planar.circuits(chain.mechanism(driven))
    assert found.complete is CLAIMED, found.remarks
    assert len(found) == len(chain.sampled())


@pytest.mark.parametrize(
    ("sizes", "by_crank", "by_rocker"),
    [
        ((1.0, 3.0, 2.5, 3.2), [1, 1], [2, 2]),  # crank and rocker
        ((2.5, 3.0, 3.2, 1.0), [1, 1], [1, 1]),  # drag link
        ((2.5, 1.0, 3.2, 3.0), [2, 2], [2, 2]),  # double rocker, its coupler turns
        ((2.0, 2.2, 2.1, 4.0), [2], [2]),  # triple rocker
    ],
)
def test_four_bars_have_the_circuits_and_branches_of_grashofs_types(sizes, by_crank, by_rocker):
    crank, coupler, rocker, ground = sizes
    for (driving, driven), expected in (((crank, rocker), by_crank), ((rocker, crank), by_rocker)):
        found = planar.circuits(bare_four_bar(driving, coupler, driven, ground, 0.8))
        assert found.complete is CLAIMED
        assert [len(each.branches) for each in found] == expected
        # at a dead point coupler and driven link are in line; law of cosines
        cosines = [
            (driving**2 + ground**2 - reach**2) / (2.0 * driving * ground)
            for reach in (coupler + driven, coupler - driven)
        ]
        limits = sorted(angle % TURN for c in cosines if abs(c) < 1.0 for angle in (acos(c), -acos(c)))
        assert sorted(angle % TURN for angle in found.critical) == pytest.approx(limits, abs=1e-12)
        assert list(found.critical) == sorted(interval.low for interval in found.intervals if limits)
        turns = {branch.turns for each in found for branch in each.branches}
        assert turns == ({0} if limits else {1})


@pytest.mark.parametrize("off", part([sign * 10.0**-k for k in range(1, 16) for sign in (1.0, -1.0)], 5))
def test_near_a_change_point_the_number_is_right_or_not_claimed(off):
    # Grashof: the longest and the shortest together are shorter than the other two
    for sizes, expected in (((2.0, 3.0, 4.0, 5.0 + off), 1 if off > 0.0 else 2), ((1.0, 3.0, 1.0 + off, 3.0), 2)):
        found = planar.circuits(bare_four_bar(*sizes, 0.8))
        assert found.complete is Completeness.NOT or len(found) == expected
        assert found.complete is CLAIMED or abs(off) < 1e-9


@pytest.mark.parametrize(
    ("sizes", "ends"),
    [
        ((2.6317247148879606, 6.726347374138128, 2.626533937612866, 1.4680887221786225), [2]),
        ((1.6415436074204666, 2.008758315150048, 4.764488721558837, 1.1141867991730539), [2]),
        ((2.4107410406747265, 1.3013485872118156, 1.630615209442886, 0.5212227560976578), [2]),
        ((1.048358912139295, 1.431504824072348, 1.0219752212651174, 1.405121133202041), [2, 2]),
    ],
)
def test_where_links_all_but_lie_in_line_each_dead_point_is_met_once(sizes, ends):
    """One is longer than the others allow for a whole turn, or all but too long to go together, by 1e-9 or less."""
    found = planar.circuits(bare_four_bar(*sizes, 1.0))
    assert [len(each.branches) for each in found] == ends
    assert all(branch.high - branch.low > 1e-6 for each in found for branch in each.branches)


def test_an_assembly_lies_on_the_branch_of_its_side():
    found = planar.circuits(bare_four_bar(2.5, 1.0, 3.2, 3.0, 0.8))
    sides = {}
    for angle in np.random.default_rng(2).uniform(-7.0, 7.0, draws(135)):
        for mode in planar.modes(bare_four_bar(2.5, 1.0, 3.2, 3.0, float(angle)), certify=False):
            b, c, d = (mode.points[name] for name in "BCD")
            side = (c - b)[0] * (d - c)[1] - (c - b)[1] * (d - c)[0] > 0.0
            circuit, branch = found.of(mode)
            assert (angle - branch.low) % TURN <= branch.high - branch.low
            # of the two circuits one has the input above, one below the frame
            sides.setdefault((circuit.number, branch.number), set()).add((side, sin(angle) > 0.0))
    assert sorted(map(list, sides.values())) == [[each] for each in product((False, True), repeat=2)]


@pytest.mark.parametrize("off", [0.0, 0.4])
def test_a_driven_slide_has_its_limits_where_crank_and_rod_are_in_line(off):
    crank, rod = 1.0, 2.5
    found = planar.circuits(driven_slide(crank, rod, off, 9.0))
    assert found.complete is CLAIMED
    assert [len(each.branches) for each in found] == [2, 2]
    limits = sorted(side * sqrt((rod + sign * crank) ** 2 - off**2) for side in (1.0, -1.0) for sign in (1.0, -1.0))
    assert found.critical == pytest.approx(limits, abs=1e-9)
    assert [span for each in found.assembles for span in each] == pytest.approx(limits, abs=1e-9)
    assert [each.assemblies for each in found.intervals] == [0, 2, 0, 2, 0]
    assert len(planar.modes(driven_slide(crank, rod, off, 9.0))) == 0  # the file's own input is no position of it


def test_a_linkage_that_never_goes_together_has_no_circuit():
    found = planar.circuits(bare_four_bar(1.0, 1.0, 1.0, 5.0, 0.3))
    assert len(found) == 0
    assert found.assembles == ()
    assert found.complete is CLAIMED


@pytest.mark.parametrize(
    ("position", "turns"), first_cases([(-0.6, -1), (0.8, 0), (0.8, 2), (-0.6, 0), (-0.6, 2), (0.8, -1)], 3)
)
def test_an_interval_is_written_around_the_files_position_as_the_range_of_cycle_is(position, turns):
    mechanism = bare_four_bar(2.0, 1.8, 3.0, 4.0, position + turns * TURN)
    found = planar.circuits(mechanism)
    run = planar.cycle(mechanism, 4).inputs["A"].position
    limit = between(2.0, 4.0, 4.8)  # coupler and rocker stretched
    assert run[[0, -1]] == pytest.approx([turns * TURN - limit, turns * TURN + limit], abs=1e-9)
    assert found.assembles == (pytest.approx((run[0], run[-1]), abs=1e-9),)
    assert {(each.low, each.high) for circuit in found for each in circuit.branches} == set(found.assembles)
    inside, outside = sorted(found.intervals, key=lambda interval: interval.assemblies, reverse=True)
    assert (inside.low, inside.high) == found.assembles[0]
    assert (outside.low, outside.high) == pytest.approx((limit, TURN - limit), abs=1e-9)  # it starts in (-pi, pi]
    assert [each.motion.inputs["A"].position.min() for each in found] == pytest.approx([run[0]], abs=1e-9)


def test_a_circuit_that_is_not_there_at_the_files_input_is_found():
    mechanism = planar.load("stephenson-2-six-bar")
    found = planar.circuits(mechanism)
    met = {found.of(mode)[0].number for mode in planar.modes(mechanism, certify=False)}
    assert found.complete is CLAIMED
    assert {each.number for each in found} - met
    assert all(found.of(mode)[0] is each for each in found for mode in [planar.modes(each.mechanism).nearest])


@pytest.mark.parametrize("name", first_cases(["four-bar", "stephenson-2-six-bar", "klann-leg", "umbrella"], 2))
def test_numbers_of_assemblies_are_those_listed_anywhere_in_an_interval(name):
    mechanism = planar.load(name)
    found = planar.circuits(mechanism)
    rng = np.random.default_rng(4)
    for low, high, assemblies in found.intervals:
        for position in rng.uniform(low, high, 2):
            modes = planar.modes(mechanism, {found.pair: float(position)}, certify=False)
            assert len(modes) == assemblies
            assert all(found.of(mode) is not None for mode in modes)


@pytest.mark.parametrize("name", first_cases(["four-bar", "slider-crank", "klann-leg"], 2))
def test_rows_of_a_circuits_motion_lie_on_their_branches(name):
    for circuit in planar.circuits(planar.load(name)):
        assert len(circuit.branch) == len(circuit.motion)
        positions = circuit.motion.inputs[circuit.pair].position
        for branch in circuit.branches:
            own = positions[circuit.branch == branch.number]
            turns = round(float((own.mean() - 0.5 * (branch.low + branch.high)) / TURN)) if not branch.turns else 0
            low, high = branch.low + turns * TURN, branch.high + turns * TURN
            assert branch.turns or (low - 1e-9 <= own.min() and own.max() <= high + 1e-9)
            assert own.max() - own.min() > 0.95 * (high - low)


def test_the_order_does_not_depend_on_the_sketch():
    mechanism = planar.load("klann-leg")
    found = planar.circuits(mechanism)
    for other in found:
        again = planar.circuits(other.mechanism)
        assert [each.branches for each in again] == [each.branches for each in found]


@pytest.mark.parametrize(
    ("name", "why"),
    [
        ("antiparallelogram", "branches cross"),
        ("geared-five-bar", "turns"),
        ("rapsons-slide", "without end"),
        ("peaucellier-lipkin", "branches cross"),  # of some no way on
        ("umbrella", "branches cross"),
    ][: None if is_exhaustive() else 3],
)
def test_what_is_not_known_is_not_claimed(name, why):
    mechanism = planar.load(name)
    found = planar.circuits(mechanism)
    assert found.complete is Completeness.NOT
    assert "not claimed" in found.remarks[0]
    assert why in found.remarks[0]
    circuit, branch = found.of(planar.modes(mechanism, certify=False).nearest)
    assert branch in circuit.branches
    at = next(each.position for each in mechanism.inputs if each.pair == found.pair)
    assert any(branch.low - 1e-6 <= at + 2.0 * np.pi * turn <= branch.high + 1e-6 for turn in (-1, 0, 1))


@pytest.mark.parametrize("seed", part(range(12), 3))
def test_every_assembly_of_random_linkages_lies_on_a_circuit_where_their_number_is_claimed(seed):
    mechanism = planar.from_dict(random_linkage(seed, 5).value)
    pair = mechanism.inputs[0].pair
    found = planar.circuits(mechanism, pair)
    rng = np.random.default_rng(seed)
    for low, high, assemblies in found.intervals if found.complete is CLAIMED else ():
        for position in rng.uniform(low, high, 3):
            modes = planar.modes(mechanism, {pair: float(position)}, certify=False)
            assert len(modes) == assemblies
            assert None not in [found.of(mode) for mode in modes]


def test_circuits_that_come_back_from_infinity_are_not_counted():
    found = planar.circuits(planar.from_dict(random_linkage(39, 3).value))
    assert not any(each.closed for each in found)
    assert found.complete is Completeness.NOT
    assert "without an end" in found.remarks[0]


def test_a_slide_without_end_is_followed_both_ways():
    for circuit in planar.circuits(planar.load("rapsons-slide")):
        assert not circuit.closed
        (branch,) = circuit.branches
        assert branch.ends == ("without end", "without end")
        assert branch.low < -100.0 < 100.0 < branch.high


def test_several_inputs_run_one_at_a_time():
    mechanism = planar.load("excavator-arm")
    with pytest.raises(planar.BadInput, match="name the one that runs"):
        planar.circuits(mechanism)
    with pytest.raises(planar.BadInput, match="no input at 'arm'"):
        planar.circuits(mechanism, "arm")
    found = planar.circuits(mechanism, "boom cylinder")
    still = [{each.pair: each.position for each in circuit.mechanism.inputs} for circuit in found]
    assert all(
        each[given.pair] == given.position
        for each in still
        for given in mechanism.inputs
        if given.pair != "boom cylinder"
    )


def zeros_of(function, low, high):
    """The zeros of a function of one place."""
    return find_zeros(lambda places: [function(at) for at in places], low, high)


def test_zeros_are_found_however_near_to_each_other_and_to_the_ends():
    rng = np.random.default_rng(3)
    for _ in range(40):
        gap = 10.0 ** rng.uniform(-3.0, -1.0)
        at = sorted([*rng.uniform(0.01, 1.99, 5), 1.0, 1.0 + gap, 1e-4])

        def function(x, at=at):
            factor = np.prod([x - each for each in at]) * (2.0 + sqrt(x) + sqrt(2.0 - x) * x)
            return SignedLog(float(np.sign(factor)), float(np.log(abs(factor))) if factor else -np.inf)

        found = zeros_of(function, 0.0, 2.0)
        assert found.is_complete
        assert found.touched == ()
        assert found.crossed == pytest.approx(at, abs=1e-11)


@pytest.mark.parametrize("lift", [0.0, 1e-6])
def test_a_function_that_touches_zero_is_told_from_one_that_does_not(lift):
    def function(x):
        value = (x - 0.3) ** 2 * (x + 2.0) + lift
        return SignedLog(float(np.sign(value)), float(np.log(abs(value))) if value else -np.inf)

    found = zeros_of(function, -1.0, 1.0)
    assert found.crossed == ()
    assert found.touched == (() if lift else pytest.approx((0.3,) * len(found.touched), abs=1e-6))
    assert bool(found.touched) is not bool(lift)


@pytest.mark.parametrize("place", np.random.default_rng(6).uniform(-1.0, 1.0, 20))
def test_a_jump_is_not_taken_for_a_function_that_is_known(place):
    assert not zeros_of(lambda x: SignedLog(1.0 if x < place else -1.0, 0.0), -1.0, 1.0).is_complete


def test_of_many_blocks_that_hang_on_one_another_the_own_circuit_alone_is_listed():
    found = planar.circuits(MODELS["chain-42"])
    assert "up to 2^20 assemblies hang on one another" in found.remarks[0]
    (own,) = found
    limits = sorted(planar.cycle(MODELS["chain-42"], 12).inputs["A0"].position[[0, -1]])
    assert {each.assemblies for each in found.intervals} == {None}
    assert own.home_range == pytest.approx(tuple(limits))
    assert found.complete is Completeness.NOT
