"""Sweeps over mechanisms of any structure: as each mechanism's own cycle and closed forms have it, refused alike."""

from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

import planar
from benchmarks import chain
from planar.batch.march.prediction import LEAST_COSINE
from planar.batch.mechanisms import block_type, partition
from planar.batch.mechanisms.block_type import BlockPair, BlockSignature, find_block_type
from planar.batch.mechanisms.partition import NotPartitionable, partition_mechanism
from planar.codegen import instructions, tape
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.pairs import pair_types
from planar.solving.position import PositionSolver
from tests.builders import block_slider_crank, four_bar
from tests.closed_forms import ROCKER, TURN, rocker
from tests.draws import first_cases
from tests.known import MODELS
from tests.linkages import random_linkage

ORDERS = ("position", "velocity", "acceleration")


def as_cycle(mechanism, found, steps, outcomes, allowed=1e-9):
    """Whether a mechanism's status, rows and rates are those of its own cycle."""
    pair = mechanism.inputs[0].pair
    still = tuple(each._replace(velocity=0.0, acceleration=0.0) for each in mechanism.inputs[1:])
    mechanism = replace(mechanism, inputs=(mechanism.inputs[0], *still))
    start = mechanism.inputs[0].position
    ends = (None, None) if PositionSolver(mechanism).is_sliding(pair) else (start, start + TURN)
    try:
        motion = planar.cycle(mechanism, steps, *ends, pair)
    except (NoAnswer, BadInput) as problem:
        outcome = getattr(problem, "outcome", Outcome.CANNOT_BE_ASSEMBLED)
        assert {outcomes[code] for code in found.status} == {outcome}
        assert all(np.all(np.isnan(getattr(found, order)[point])) for order in ORDERS for point in found.position)
        return
    many = int(np.sum(found.status == 0))
    assert many in (len(motion), len(motion) - 1)
    assert (many == steps + 1) or outcomes[found.status[-1]] is motion.outcome
    for order in ORDERS:
        for name, values in getattr(found, order).items():
            wanted = getattr(motion.point(name), order)
            scale = max(1.0, float(np.nanmax(np.abs(wanted), initial=0.0)))
            np.testing.assert_allclose(values[:many], wanted[:many], atol=allowed * scale, rtol=0.0)
            assert np.all(np.isnan(values[many:]))


def triads(many):
    """A crank, then plates on three bars each, of which one is driven and two swing; one of these drives the next."""
    places, bars, fixed, drive = [(0, 0), (0.25, 0.0)], [[0, 1]], [0], 1
    for k in range(many):
        at, first = np.array(places[drive]), len(places)
        p = at + np.array([0.9, 0.05 * (-1) ** k])
        q, r = p + np.array([0.1, 0.25]), p + np.array([0.7, 0.1])
        places += [p, q, r, q - np.array([0.0, 1.1]), r + np.array([0.1, -1.3]), q + np.array([0.0, 0.03 * (-1) ** k])]
        fixed += [first + 3, first + 4]
        bars += [
            [drive, first],
            [first, first + 1, first + 2],
            [first + 3, first + 1, first + 5],
            [first + 4, first + 2],
        ]
        drive = first + 5
    return planar.pinned(np.array(places), bars, fixed, velocity=3.0, acceleration=-2.0)


def dyads(seed, pins):
    """Random pins, each held by two earlier ones; some of these linkages cannot turn all round."""
    rng = np.random.default_rng(seed)
    places, bars = [(0.0, 0.0), (1.0, 0.1), (0.1, 0.25)], [[0, 2]]
    while len(places) < pins:
        a, b = rng.choice(len(places), 2, replace=False)
        way = np.subtract(places[b], places[a])
        p = places[a] + rng.uniform(0.3, 0.7) * way + rng.uniform(0.7, 1.2) * np.array([-way[1], way[0]])
        if {a, b} != {0, 1}:
            places.append(tuple(p + rng.uniform(-0.3, 0.3, 2)))
            bars += [[int(a), len(places) - 1], [len(places) - 1, int(b)]]
    return planar.pinned(np.array(places), bars, [0, 1], velocity=2.0, acceleration=1.0)


# as the cycle of every mechanism


def test_mixed_mechanisms_are_the_cycles_of_each():
    mechanisms = [
        four_bar(*ROCKER, 0.8),
        four_bar(*ROCKER, 0.8, -1),
        MODELS["slider-crank"],
        MODELS["004-QR"],
        MODELS["watt-six-bar"],
        MODELS["double-butterfly"],
        MODELS["stephenson-1-six-bar"],
        triads(2),
        MODELS["002-E3.4"],
    ]
    result = planar.sweep_each(mechanisms, 60)
    assert result.general == 0
    assert result.remarks == ()
    assert result.whole.all()
    for mechanism, found in zip(mechanisms, result, strict=True):
        as_cycle(mechanism, found, 60, result.outcomes)


@pytest.mark.parametrize(
    ("seed", "links", "higher"),
    first_cases([(9, 3, 0.5), (10, 4, 0.5), *((seed, 1 + seed % 5, 0.0) for seed in range(7, -1, -1))], 5),
)
def test_random_linkages_of_every_pair_type(seed, links, higher):
    mechanism = files.from_dict(random_linkage(seed, links, higher=higher).value)
    result = planar.sweep_each([mechanism], 20, pair=mechanism.inputs[0].pair)
    as_cycle(mechanism, result[0], 20, result.outcomes, 1e-7)


def test_a_slide_that_goes_off_just_before_a_dead_point_ends_the_run():
    """A later link slides out without an end within the step in which an earlier one comes to a dead point."""
    mechanism = files.from_dict(random_linkage(24306, 3, blur=0.02, higher=0.3).value)
    result = planar.sweep_each([mechanism], 24, pair=mechanism.inputs[0].pair)
    assert result.outcomes[result[0].status[-1]] is Outcome.BRANCH_LOST
    as_cycle(mechanism, result[0], 24, result.outcomes, 1e-7)


@pytest.mark.parametrize(("seed", "links", "blur"), [(5004, 5, 0.003), (5103, 6, 0.02), (6071, 5, 0.01)])
def test_blocks_without_closed_form_start_at_inexact_sketches(seed, links, blur):
    """The assembly is the one that the mechanism itself takes, though its sketch is off, or shows one point alone of a
    link that slides on another (the last)."""
    mechanism = files.from_dict(random_linkage(seed, links, blur=blur).value)
    assert not all(each.block_type.has_closed_form for each in partition_mechanism(mechanism)[0].blocks)
    result = planar.sweep_each([mechanism], 20, pair=mechanism.inputs[0].pair)
    assert result.sent == 0
    as_cycle(mechanism, result[0], 20, result.outcomes, 1e-7)


def test_many_random_dyads_end_where_their_cycles_end():
    mechanisms = [dyads(seed, 4 + seed % 4) for seed in range(14)]
    result = planar.sweep_each(mechanisms, 40)
    assert result.sent <= 4
    ends = {result.outcomes[each.status[-1]] for each in result}
    assert ends == {Outcome.SOLVED, Outcome.DEAD_POINT}
    stopped = [each for each in result if each.status.any() and not each.general]
    assert stopped
    for mechanism, found in zip(mechanisms, result, strict=True):
        names, is_dead, _ = found.reason.removeprefix("links ").partition(" come to a dead point")
        links = names.split(", ")
        assert found.general or bool(is_dead) == found.status.any()
        assert not is_dead or links == [link.name for link in mechanism.links if link.name in links]
    for mechanism, found in zip(mechanisms, result, strict=True):
        as_cycle(mechanism, found, 40, result.outcomes, 1e-8)


def as_arrays(mechanisms):
    """Places, bars and pins on the frame of pinned mechanisms, as `planar.pinned_linkages` takes them."""
    laid = [each.layout for each in mechanisms]
    places = np.full((len(laid), max(len(each.pin_positions) for each in laid), 2), np.nan)
    widest = max(len(bar) for each in laid for bar in each.bars)
    bars = np.full((len(laid), max(len(each.bars) for each in laid), widest), -1)
    frame = np.full((len(laid), max(len(each.frame_pins) for each in laid)), -1)
    for k, each in enumerate(laid):
        places[k, : len(each.pin_positions)] = each.pin_positions
        frame[k, : len(each.frame_pins)] = each.frame_pins
        for number, bar in enumerate(each.bars):
            bars[k, number, : len(bar)] = bar
    rates = ([getattr(each, name) for each in laid] for name in ("velocity", "acceleration"))
    return (places, bars, frame, [each.crank for each in laid]), dict(
        zip(("velocity", "acceleration"), rates, strict=True)
    )


def test_linkages_as_arrays_are_the_mechanisms_one_by_one():
    """Ones that go round and ones that stop, with bars of three pins, and one that is no crank and dyads."""
    places = [(0.0, 0.0), (0.3, 0.2), (1.0, 0.0), (0.9, 0.7), (0.6, 1.1), (2.0, 0.0), (2.1, 0.8)]
    bell = planar.pinned(places, [(0, 1), (1, 3), (2, 3, 4), (4, 6), (5, 6)], [0, 2, 5], velocity=-3.0)
    mechanisms = [*(dyads(seed, 4 + seed % 5) for seed in range(12)), bell, triads(1)]
    given, rates = as_arrays(mechanisms)
    linkages = planar.pinned_linkages(*given, **rates)
    assert list(linkages) == mechanisms
    arrays = planar.sweep_each(linkages, 60)
    each = planar.sweep_each([replace(one) for one in mechanisms], 60)
    np.testing.assert_array_equal(arrays.whole, each.whole)
    assert not arrays.whole.all()
    rows = arrays.rows()
    for k, (one, other) in enumerate(zip(arrays, each, strict=True)):
        np.testing.assert_array_equal(one.status, other.status)
        for order in ORDERS:
            assert list(getattr(one, order)) == list(getattr(other, order))
            own = getattr(rows, order)[rows.first[k] : rows.first[k + 1]]
            for values, (name, wanted) in zip(own, getattr(other, order).items(), strict=True):
                np.testing.assert_array_equal(values, getattr(one, order)[name])
                np.testing.assert_allclose(values, wanted, rtol=1e-8, atol=1e-8)


def test_linkages_as_arrays_in_parts_and_with_points_of_some(monkeypatch):
    from planar.batch import sweep_mechanisms

    given, rates = as_arrays([dyads(seed, 4 + seed % 4) for seed in range(7)])
    linkages = planar.pinned_linkages(*given, **rates)
    whole = planar.sweep_each(linkages, 100, ["P5", "P0"])
    monkeypatch.setattr(sweep_mechanisms, "PART_SIZE", 3)
    with ThreadPoolExecutor(2) as pool:
        found = [planar.sweep_each(linkages, 100, ["P5", "P0"], executor=each) for each in (None, pool)]
    for result in found:
        np.testing.assert_array_equal(result.rows().position, whole.rows().position)
        np.testing.assert_array_equal(result.rows().first, np.cumsum([0, *(len(one.position) for one in whole)]))
    assert [list(one.position) for one in whole][:3] == [["P0"], ["P0"], ["P5", "P0"]]
    np.testing.assert_array_equal(whole[2].position["P0"][0], linkages[2].layout.pin_positions[0])
    with pytest.raises(BadInput, match="no mechanism has a point 'C'"):
        planar.sweep_each(linkages, 6, ["C"])


def test_pins_read_as_arrays_and_links_read_one_by_one_are_the_same():
    laid = [dyads(seed, 9) for seed in range(6)]
    plain = [replace(each) for each in laid]
    assert plain[0].layout is None
    one, two = (planar.sweep_each(each, 50) for each in (laid, plain))
    for own, other in zip(one, two, strict=True):
        np.testing.assert_array_equal(own.status, other.status)
        for order in ORDERS:
            assert list(getattr(own, order)) == [f"P{k}" for k in range(2, 9)]
            for name, values in getattr(own, order).items():
                np.testing.assert_allclose(values, getattr(other, order)[name], rtol=1e-9, atol=1e-9)


def test_the_order_in_which_bars_are_given_does_not_matter():
    """A pin of many links is written from its first link; the dyad that places it may be of two others."""
    for seed in range(5):
        mechanism = dyads(seed, 9)
        laid = mechanism.layout
        turned = [laid.bars[0], *(bar[::-1] for bar in laid.bars[:0:-1])]
        other = planar.pinned(laid.pin_positions, turned, laid.frame_pins, velocity=2.0, acceleration=1.0)
        result = planar.sweep_each([mechanism, other, replace(other)], 50)
        assert result.general == 0
        for found in result[1:]:
            np.testing.assert_array_equal(found.status, result[0].status)
            for name, values in found.velocity.items():
                np.testing.assert_allclose(values, result[0].velocity[name], rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("apart", [0.0, 1e-17, 1e-9, 1e-3])
def test_pins_that_only_later_groups_hang_on_may_lie_next_to_each_other(apart):
    """The rocker's angle is known by its own arm before anything hangs on a pin beside its joint."""
    places = [(0.0, 0.0), (0.3, 0.2), (1.0, 0.0), (0.9, 0.7), (0.9 + apart, 0.7), (2.0, 0.0), (2.1, 0.8)]
    bars = [(0, 1), (1, 3), (2, 3, 4), (4, 6), (5, 6)]
    mechanism = planar.pinned(places, bars, [0, 2, 5], 0)
    for each in (mechanism, replace(mechanism)):  # read as arrays, and link by link
        result = planar.sweep_each([each], 50)
        assert (result.general, result[0].status.sum()) == (0, 0)
    assert planar.sweep(planar.from_dict(planar.to_dict(mechanism)), {"P0.velocity": [1.0, 2.0]}, 50).general == 0


# closed forms


@pytest.mark.parametrize("links", [4, 22, 42])
def test_rows_of_four_bars_against_the_closed_form(links):
    result = planar.sweep_each([planar.from_dict(chain.document(links))], 100)
    assert result.general == 0
    last, cells = (links - 2) // 2, chain.cells(links)
    theta = result[0].input
    assert theta[-1] - theta[0] == pytest.approx(TURN)
    angle, velocity, acceleration = chain.motion(np, links, theta)
    arm = cells[-1].c * np.exp(1j * angle)
    wanted = sum(cell.g for cell in cells) + arm, 1j * velocity * arm, (1j * acceleration - velocity**2) * arm
    for order, value in zip(ORDERS, wanted, strict=True):
        found = getattr(result[0], order)[f"C{last}"] @ [1, 1j]
        np.testing.assert_allclose(found, value, atol=1e-11 * np.max(np.abs(value)))


def test_four_bars_that_cannot_turn_are_refused_exactly_where_they_must_be():
    rng, steps, first = np.random.default_rng(0), 60, 0.8
    a, b, c, d = rng.uniform(0.2, 1.5, (4, 300))
    b_at = a * np.exp(1j * first)
    far = np.abs(d - b_at)
    there = (far < b + c) & (far > abs(b - c))
    a, b, c, d = (each[there] for each in (a, b, c, d))
    phi = np.array([rocker(*each, first, 1 - 2 * (k % 2)) for k, each in enumerate(zip(a, b, c, d, strict=True))])
    pins = np.stack([0.0 * a, d + 0j, a * np.exp(1j * first), d + c * np.exp(1j * phi)], axis=1)
    places = np.stack([pins.real, pins.imag], axis=2)
    result = planar.sweep_each([planar.pinned(each, [[0, 2], [2, 3], [1, 3]], [0, 1]) for each in places], steps, "P3")
    theta = first + np.linspace(0, TURN, steps + 1)
    far = np.sqrt(a * a + d * d - 2 * a * d * np.cos(theta)[:, None]).T
    closes = np.logical_and.accumulate((far <= (b + c)[:, None]) & (far >= abs(b - c)[:, None]), axis=1)
    # between two rows the diagonal may be longest, at half a turn, or shortest, at a whole one
    for place, extreme in ((np.pi, a + d), (TURN, abs(a - d))):
        broken = (extreme > b + c) | (extreme < abs(b - c))
        closes &= ~(broken[:, None] & (theta > place))
    status = np.stack([each.status for each in result])
    np.testing.assert_array_equal(status == 0, closes)
    found = np.stack([each.position["P3"] for each in result]) @ [1, 1j]
    np.testing.assert_array_equal(np.isnan(found), ~closes)
    np.testing.assert_allclose(np.abs(found - d[:, None])[closes], np.broadcast_to(c[:, None], closes.shape)[closes])
    apart = np.abs(found - a[:, None] * np.exp(1j * theta))
    np.testing.assert_allclose(apart[closes], np.broadcast_to(b[:, None], closes.shape)[closes])
    assert 0.2 * len(a) < result.whole.sum() < 0.8 * len(a)
    assert result.sent < 0.1 * len(a)
    # each on the side of its diagonal on which it was drawn
    side = np.sign(((found - a[:, None] * np.exp(1j * theta)) / (d[:, None] - a[:, None] * np.exp(1j * theta))).imag)
    assert np.all((side == side[:, :1]) | ~closes)


@pytest.mark.parametrize("steps", [1, 5, 37])
def test_few_steps_are_as_good_as_many(steps):
    mechanism = triads(1)
    fine, coarse = planar.sweep_each([mechanism], 37 * 5), planar.sweep_each([mechanism], steps)
    every = 37 * 5 // steps
    for order in ORDERS:
        for name, values in getattr(coarse[0], order).items():
            np.testing.assert_allclose(values, getattr(fine[0], order)[name][::every], atol=1e-11)


# what falls to the general path, and what is refused


def test_what_the_general_path_does_is_counted_and_said():
    unsketched = replace(four_bar(*ROCKER, 0.8), sketch=())
    mechanisms = [four_bar(*ROCKER, 0.8), MODELS["geared-five-bar"], unsketched, MODELS["elliptical-trammel"]]
    mechanisms.append(block_slider_crank())
    result = planar.sweep_each(mechanisms, 12)
    assert [each.general for each in result] == [False, True, True, True, True]
    assert (result.general, result.sent) == (4 * 13, 4)
    assert "4 of 5 mechanisms" in result.remarks[0]
    for mechanism, found in zip(mechanisms, result, strict=True):
        as_cycle(mechanism, found, 12, result.outcomes)


def test_formulas_too_long_to_be_compiled_are_left_to_the_general_path(monkeypatch):
    mechanisms = [MODELS["watt-six-bar"], MODELS["double-butterfly"]]  # dyads, and four unknowns at once
    longest = 1_000
    monkeypatch.setattr(instructions, "MAX_INSTRUCTIONS", longest)
    monkeypatch.setattr(partition, "_structures", {})
    find_block_type.cache_clear()
    result = planar.sweep_each(mechanisms, 12)
    find_block_type.cache_clear()
    assert [each.general for each in result] == [False, True]
    for mechanism, found in zip(mechanisms, result, strict=True):
        as_cycle(mechanism, found, 12, result.outcomes)


def test_what_cannot_be_assembled_says_so_and_spoils_nothing():
    broken = four_bar(0.3, 0.2, 0.2, 1.0, 0.8)
    result = planar.sweep_each([four_bar(*ROCKER, 0.8), broken], 12, rates=False)
    assert {result.outcomes[code] for code in result[1].status} == {Outcome.CANNOT_BE_ASSEMBLED}
    assert "cannot" in result[1].reason
    assert result.whole.tolist() == [True, False]
    assert result[0].velocity is None
    assert np.all(np.isnan(result[1].position["C"]))


def test_models_are_swept_by_their_names():
    named, given = planar.sweep_each(["four-bar", "four-bar"], 12), planar.sweep_each([planar.load("four-bar")], 12)
    assert len(named) == 2
    for each in named:
        for point, wanted in given[0].position.items():
            np.testing.assert_array_equal(each.position[point], wanted)


def test_a_sketch_between_two_assemblies_is_left_to_the_search_of_the_whole():
    mechanism = four_bar(*ROCKER, 0.8)
    found = planar.solve(mechanism), planar.solve(four_bar(*ROCKER, 0.8, -1))
    between = 0.5 * sum(state.point("C").position for state in found)
    beside = between + 1e-12 * (found[0].point("C").position - between)
    mechanism = replace(mechanism, sketch=(("C", *beside),))
    assert planar.sweep_each([mechanism], 6)[0].general


BAD = {
    "no mechanism": (lambda: planar.sweep_each([four_bar(*ROCKER, 0.8), 4]), r"mechanisms\[1\]: a mechanism is wanted"),
    "no model": (lambda: planar.sweep_each(["four-bar", "none such"]), "none such"),
    "no list": (lambda: planar.sweep_each("four-bar"), "a list of mechanisms is wanted"),
    "no input": (lambda: planar.sweep_each([replace(four_bar(*ROCKER, 0.8), inputs=())]), "no input"),
    "several": (lambda: planar.sweep_each([MODELS["planetary-differential"]]), "name the one that runs"),
    "another": (lambda: planar.sweep_each([four_bar(*ROCKER, 0.8)], pair="Q"), "no input at 'Q'"),
    "point": (lambda: planar.sweep_each([four_bar(*ROCKER, 0.8)], 6, "Z"), "no mechanism has a point 'Z'"),
    "steps": (lambda: planar.sweep_each([four_bar(*ROCKER, 0.8)], 0), "whole number"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_asked_is_refused(name):
    ask, told = BAD[name]
    with pytest.raises(BadInput, match=told):
        ask()


def test_elsewhere_in_parts_and_with_points_of_some(monkeypatch):
    from planar.batch import sweep_mechanisms as each

    monkeypatch.setattr(each, "PART_SIZE", 3)
    mechanisms = [dyads(seed, 5 + seed % 3) for seed in range(4)] + [four_bar(*ROCKER, 0.8)] * 4
    seen = []
    with ThreadPoolExecutor(2) as pool:
        found = planar.sweep_each(mechanisms, 20, ["P3", "C"], executor=pool, progress=lambda *of: seen.append(of))
    wanted = planar.sweep_each(mechanisms, 20, ["P3", "C"])
    assert [list(one.position) for one in found] == [["P3"]] * 4 + [["C"]] * 4
    assert seen == [(3, 8), (6, 8), (8, 8)]
    for one, other in zip(found, wanted, strict=True):
        for name, values in one.acceleration.items():
            np.testing.assert_array_equal(values, other.acceleration[name])
    assert len(found[2:5]) == 3
    assert planar.sweep_each([]).whole.tolist() == []


# groups


def test_a_mechanism_is_parted_into_links_that_follow_one_after_the_other():
    for mechanism, sizes in (
        (planar.from_dict(chain.document(42)), [1] + [2] * 20),
        (triads(3), [1, 4, 4, 4]),
        (MODELS["double-butterfly"], [1, 6]),
    ):
        own = partition_mechanism(mechanism)[0]
        assert [len(group.inner_links) for group in own.blocks] == sizes
        assert sorted(own.link_index.values())[0] == 0
        known = {0, 1}
        for group in own.blocks:
            inner = set(group.link_indices[len(group.link_indices) - len(group.inner_links) :])
            assert set(group.link_indices) <= known | inner
            assert not known & inner
            known |= inner
    blocks = partition_mechanism(planar.from_dict(chain.document(42)))[0].blocks
    assert len({id(group.block_type) for group in blocks}) <= 4
    with pytest.raises(NotPartitionable, match=r"held more than once|free"):
        partition_mechanism(MODELS["three-parallel-cranks"])


def test_mechanisms_of_one_structure_share_it_and_differ_in_their_numbers(monkeypatch):
    mechanisms = [four_bar(*ROCKER, 0.8), four_bar(*(1.1 * length for length in ROCKER), 0.7)]
    (structure, numbers), (other_structure, other_numbers) = map(partition_mechanism, mechanisms)
    assert structure is other_structure
    assert numbers != other_numbers
    undriven = replace(mechanisms[0], inputs=(), sketch=())
    with pytest.raises(NotPartitionable, match="free"):
        partition_mechanism(undriven)
    together = planar.sweep_each(mechanisms, 24)
    for mechanism, found in zip(mechanisms, together, strict=True):
        monkeypatch.setattr(partition, "_structures", {})
        (alone,) = planar.sweep_each([mechanism], 24)
        for name, values in found.acceleration.items():
            np.testing.assert_array_equal(values, alone.acceleration[name])


DYADS = ("TTT", "TTS", "TST", "STS", "SST", "TSS")


@pytest.mark.parametrize("joints", DYADS)
def test_every_dyad_is_in_closed_form(joints):
    types = {"T": pair_types()["turning"], "S": pair_types()["sliding"]}
    bodies = ((0, -1), (0, 1), (1, -2))
    signature = BlockSignature(
        2, 2, tuple(BlockPair(types[t], of, False) for t, of in zip(joints, bodies, strict=True))
    )
    assert find_block_type(signature).has_closed_form == (joints.count("S") < 3)
    assert find_block_type(signature) is find_block_type(signature)


def plain_ending(left, clear, directions, tolerance, clearance):
    """How many of the first steps are good, and why no more, looked at one after the other."""
    steps = len(left)
    cosines = np.ones(steps)
    for c, s in directions:
        cosines[1:] = np.minimum(cosines[1:], c[1:] * c[:-1] + s[1:] * s[:-1])
    good = (left <= tolerance) & (cosines >= LEAST_COSINE)
    for k in range(steps):
        before = clear[max(k - 2, 0) : k]
        needed = max(clearance, abs(clear[k] - 2.0 * clear[k - 1] + clear[k - 2]) if k > 1 else 0.0)
        if not good[k] or clear[k] <= needed or np.any(before <= needed):
            is_dead = clear[k] < 0.0 and k > 0 and bool(np.all(before > needed))
            return k, tape.DEAD_POINT if is_dead else tape.UNDECIDED
    return steps, tape.GOOD


class UncheckedText(tape.BlockText):
    """Writes in place of its checks whether a step is closed, and its distance measure from a dead point."""

    def begin_steps(self, direction_count=None):
        super().begin_steps()

    def end_checked_steps(self, is_good, directions, clear, least_cosine):
        is_open = self.ir.select(is_good, self.ir.constant(0.0), self.ir.constant(1.0))
        self.store_rows([is_open, clear], [(2, 8), (2, 9)])
        self.end_steps()


def test_a_tape_ends_where_its_steps_one_after_the_other_end(monkeypatch):
    """Dyads beside a link that turns: some reach round, some come to a dead point, some to where they turn fast."""
    pins = ((0, -1), (1, -2), (0, 1))
    joints = tuple(BlockPair(pair_types()["turning"], of, False) for of in pins)
    checked = block_type.BlockType(BlockSignature(2, 2, joints)).run_function(False)
    monkeypatch.setattr(block_type, "BlockText", UncheckedText)
    unchecked = block_type.BlockType(BlockSignature(2, 2, joints)).run_function(False)
    steps, many = 601, 60
    tolerance, clearance = np.full(many, 1e-12), np.full(many, 1e-4)
    rng = np.random.default_rng(3)
    stride = tape.padded_steps(steps)
    turn = np.linspace(0.0, 2.0, stride)
    room = np.zeros((2 + many, 10, stride))
    room[0, 2], room[1, 2:4] = 1.0, (np.cos(turn), np.sin(turn))
    # of each pair the point of the inner link first
    p = np.array([[0.0, 0.0, 0.4, 0.0, 0.0, 0.0, 1.0, 0.1, 0.9, 0.0, 0.8, 0.0, 1.0]] * many)
    p[:, :-1] += 1e-3 * rng.uniform(size=(many, 12))
    p[:, 10] = np.append(rng.uniform(0.2, 1.6, many - 1), 0.02)
    at = room.ctypes.data + np.arange(2 + many) * room.strides[0]
    # the second link is four rows behind the first
    slots = np.column_stack([np.full((many, 2), at[[1, 0]]), at[2:], at[2:] + 4 * room.strides[1]])
    whole = tape.Tape(np.arange(many + 1), np.zeros(many, dtype=int), slots, p, tolerance, clearance)
    tape.run_tape([unchecked], steps, whole)
    values = room[2:, :, :steps].copy()
    found = tape.run_tape([checked], steps, whole)
    for k, own in enumerate(values):
        good = found.good[k]
        np.testing.assert_array_equal(room[2 + k, :8, :good], own[:8, :good])
        wanted = plain_ending(own[8], own[9], [own[2:4], own[6:8]], 0.5, clearance[k])
        assert (found.good[k], found.outcome[k]) == wanted, k
    assert set(found.outcome.tolist()) == {tape.GOOD, tape.DEAD_POINT, tape.UNDECIDED}


def test_the_sketch_of_what_rides_on_others_says_how_these_go_together():
    """Two bars meet above or below; their pin is sketched a little above, and far below what slides on one of them."""
    mechanism = planar.from_dict(
        {
            "planar": 1,
            "name": "a rider",
            "frame": "base",
            "links": {
                "base": {"points": {"O": [0, 0], "P": [1, 0], "Q": [2, 0]}},
                "left": {"ends": ["O", "C"], "length": 0.8},
                "right": {"ends": ["P", "C"], "length": 0.8},
                "rider": {"points": {"R": [0, 0]}},
                "crank": {"ends": ["Q", "S"], "length": 0.3},
            },
            "pairs": [
                *({"turning": name} for name in "OPCQ"),
                {"sliding": "ride", "links": ["left", "rider"], "line": {"through": "O", "to": "C"}, "point": "R"},
            ],
            "inputs": [{"pair": "Q", "position": "1 rad", "velocity": "1 rad/s"}, {"pair": "ride", "position": 1.5}],
            "sketch": {"C": [0.5, 0.05], "R": [0.9, -1.1]},
        }
    )
    (found,) = planar.sweep_each([mechanism], 24, pair="Q")
    expected = planar.solve(mechanism).point("C").position
    assert expected[1] < -0.5
    np.testing.assert_allclose(found.position["C"][0], expected, atol=1e-12)
