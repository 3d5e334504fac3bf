"""Sweeps where it is easy to be wrong: dead points between two steps, wheels that turn far, assemblies far from a
sketch."""

import numpy as np
import pytest

import planar
from planar.batch import block
from planar.batch.design_arrays import values_of_design, with_design_values
from planar.batch.march import kernel
from planar.batch.reference_design import reference_design
from planar.document.dimensions import link_lengths
from planar.foundation.errors import BadInput, Outcome
from tests.builders import bar_linkage, bare_four_bar, designs_around, four_bar_document
from tests.draws import first_cases, part
from tests.known import MODELS
from tests.linkages import random_linkage


def four_bar_or_by_wheel(a, b, c, d, theta, side=1, ratio=None):
    """A four-bar, its crank driven, or by a wheel so many times slower."""
    value = four_bar_document(a, b, c, d, theta, side)
    if ratio is not None:
        value["links"]["AD"]["points"]["O"] = [-1, 0]
        value["links"]["W"] = {"ends": ["O", "P"], "length": 0.4}
        mesh = {"gear": "g", "links": ["W", "AB"], "ratio": ratio, "mesh": {"W": 0.0, "AB": theta}}
        value["pairs"] += [{"turning": "O"}, mesh]
        value["inputs"] = [{"pair": "O", "position": 0.0, "velocity": 1.0}]
        value["sketch"]["P"] = [-0.6, 0.0]
    return planar.from_dict(value)


def chain_of_dyads(rng, cells):
    """A crank and dyads from pin to pin, built closed."""
    theta, r = rng.uniform(-3.0, 3.0), rng.uniform(0.2, 1.0)
    pin = r * np.array([np.cos(theta), np.sin(theta)])
    frame, bars, sketch = {"A": [0, 0]}, {"L0": ("A", "P0", float(r))}, {"P0": pin.tolist()}
    for k in range(1, cells + 1):
        pivot, after = rng.uniform(-1.5, 1.5, 2), rng.uniform(-1.5, 1.5, 2)
        frame[f"G{k}"] = pivot.tolist()
        bars[f"C{k}"] = (f"P{k - 1}", f"P{k}", float(np.hypot(*(after - pin))))
        bars[f"R{k}"] = (f"G{k}", f"P{k}", float(np.hypot(*(after - pivot))))
        sketch[f"P{k}"], pin = after.tolist(), after
    return bar_linkage(frame, bars, ("A", float(theta)), sketch)


def around(mechanism, spread, many, rng):
    lengths = link_lengths(mechanism, frozenset(link.name for link in mechanism.links))
    return {each.name: each.value * (1.0 + spread * rng.uniform(-1.0, 1.0, many)) for each in lengths if each.value}


def agrees(mechanism, designs, steps, **more):
    """Whether a sweep is, design by design, what `planar.cycle` finds."""
    swept = planar.sweep(mechanism, designs, steps, **more)
    for index in range(len(swept)):
        row = np.atleast_2d(swept.input)[index if np.ndim(swept.input) == 2 else 0]
        try:
            design = with_design_values(mechanism, values_of_design(designs, index))
            motion = planar.cycle(design, steps, float(row[0]), float(row[-1]), more.get("pair"))
        except planar.NoAnswer as problem:
            assert {swept.outcomes[code] for code in swept.status[index]} == {problem.outcome}
            continue
        solved = len(motion) - (motion.outcome is not Outcome.SOLVED)
        assert np.count_nonzero(swept.status[index] == 0) == solved
        for point in swept.points:
            wanted = motion.point(point).position[:solved]
            np.testing.assert_allclose(swept.position[point][index][:solved], wanted, atol=1e-9)
            assert np.isnan(swept.position[point][index][solved:]).all()


@pytest.mark.parametrize("steps", [20, 100])
def test_a_dead_point_between_the_first_two_positions_is_seen(steps):
    rng, turn = np.random.default_rng(steps), 2.0 * np.pi / steps
    for _ in range(3):
        a, b, d = rng.uniform(0.3, 0.8), rng.uniform(0.5, 1.5), 1.5
        c = b + (d - a) + 10.0 ** rng.uniform(-6.0, -2.5)  # the crank cannot pass the frame's line, by so little
        mechanism = four_bar_or_by_wheel(a, b, c, d, -0.9 * turn, -1)
        agrees(mechanism, {"A.position": rng.uniform(-1.0, 0.0, 6) * turn}, steps, points="C")


@pytest.mark.parametrize("ratio", first_cases([-13, 3, 13, 6.5], 2))
def test_a_wheel_may_turn_far_in_a_step_of_the_input(ratio):
    mechanism = four_bar_or_by_wheel(0.5, 0.6, 0.7, 1.3, 0.9, ratio=ratio)
    lengths = 0.5 * (1.0 + 0.02 * np.random.default_rng(0).uniform(-1.0, 1.0, 3))
    for steps in (13, 26):
        agrees(mechanism, {"AB.length": lengths}, steps, points="C")
        ready = planar.prepared(mechanism, steps, "C")
        swept = planar.sweep(mechanism, {"AB.length": lengths}, steps, "C")
        for index, length in enumerate(lengths):
            np.testing.assert_array_equal(ready({"AB.length": length}).status, swept.status[index])


@pytest.mark.parametrize("seed", part(range(6), 2))
def test_of_dyads_in_a_row_the_assembly_nearest_to_the_sketch_is_taken(seed):
    rng = np.random.default_rng(seed)
    mechanism = chain_of_dyads(rng, 1 + seed % 4)
    designs = around(mechanism, (0.003, 0.03, 0.1)[seed % 3], 12, rng)
    agrees(mechanism, designs, (14, 25, 50)[seed % 3], points=f"P{1 + seed % 4}")


def test_groups_of_three_unknowns_are_swept():
    mechanism = planar.from_dict(random_linkage(156960, 5, 0.0, 0.3).value)
    drive = next(each for each in mechanism.inputs if each.pair == "T1")
    designs = around(mechanism, 0.01, 4, np.random.default_rng(0))
    agrees(mechanism, designs, 3, pair="T1", start=drive.position, stop=drive.position + 0.3)


def test_what_is_known_of_one_run_is_not_another_runs():
    ready = planar.prepared(four_bar_or_by_wheel(0.3, 0.8, 0.7, 1.0, 0.5), 60, "C")
    found = ready()
    with pytest.raises(ValueError, match="read-only"):
        found.status[3] = 7
    with pytest.raises(BadInput, match="one number"):
        ready({"AB.length": [0.3, 0.31]})
    first = found.position["C"].copy()
    ready({"AB.length": 0.31})
    np.testing.assert_array_equal(found.position["C"], first)
    np.testing.assert_array_equal(ready().position["C"], first)


def crank_and_slotted_arm(crank):
    """A block at the end of a crank slides on an arm that turns about Q, one metre from the crank's pivot."""
    return planar.from_dict(
        {
            "planar": 1,
            "frame": "f",
            "links": {
                "f": {"points": {"O": [0, 0], "Q": [1, 0]}},
                "crank": {"ends": ["O", "A"], "length": crank},
                "arm": {"points": {"Q": [0, 0], "E": [1.5, 0.5]}},
                "block": {"points": {"A": [0, 0]}},
            },
            "pairs": [
                {"turning": "O", "links": ["f", "crank"]},
                {"turning": "Q", "links": ["f", "arm"]},
                {"turning": "A", "links": ["crank", "block"]},
                {"sliding": "s", "links": ["arm", "block"], "line": {"through": "Q", "angle": 0}, "point": "A"},
            ],
            "inputs": [{"pair": "O", "position": -0.5, "velocity": 1.0}],
            "sketch": {"A": [0.7, -0.4], "E": [1, 1]},
        }
    )


@pytest.mark.parametrize("left", [1e-3, 1e-6, 1e-12])
def test_a_block_that_comes_to_the_pole_of_its_arm_has_the_rates_of_a_cycle(left):
    alone = planar.cycle(crank_and_slotted_arm(1.0 - left), 200, -1.0, 1.0).point("E").velocity
    designs = {"crank.length": np.array([0.8, 1.0 - left])}
    swept = planar.sweep(crank_and_slotted_arm(0.8), designs, 200, "E", start=-1.0, stop=1.0)
    assert swept.velocity["E"][1] == pytest.approx(alone, rel=1e-6, nan_ok=True)
    assert np.isnan(alone[100]).all() == (left < 1e-4)
    told = "1 of 2 designs: rates are missing or have few digits (the first: 1 row without rates"
    assert any(each.startswith(told) for each in swept.remarks) == (left < 1e-4)


def test_a_design_much_larger_than_the_base_is_judged_by_its_own_size():
    large = dict.fromkeys(("crank.length", "rocker.length"), np.array([1e6, 1e6]))
    base = bare_four_bar(1.0, 0.5, 1.0, 1.0, 1.0)
    reference = reference_design(base, None)
    assert not reference.design_rows(large, 2).is_fit.any()


@pytest.mark.parametrize(("coupler", "told"), [(1e-3, ""), (1e-9, "have few digits"), (1e-12, "too inexact")])
def test_a_sweep_says_how_many_designs_have_few_digits(coupler, told):
    ends = {"start": np.pi / 3.0 - coupler / 10.0, "stop": np.pi / 3.0 + coupler / 10.0}
    designs = {"coupler.length": np.array([0.5, coupler, coupler])}
    swept = planar.sweep(bare_four_bar(1.0, 0.5, 1.0, 1.0, np.pi / 3.0), designs, 4, **ends)
    found = [each for each in swept.remarks if each.startswith("2 of 3 designs: ")]
    assert [told in each for each in found] == ([True] if told else [])
    assert swept.whole.tolist() == [True, *[told != "too inexact"] * 2]
    assert np.isnan(swept.position["C"][1:]).all() == (told == "too inexact")


def test_a_sweep_of_mechanisms_says_how_many_lack_rates():
    turned = [crank_and_slotted_arm(each).with_values({"O.position": -np.pi}) for each in (0.8, 1.0 - 1e-6)]
    found = planar.sweep_each(turned, 200)
    assert found[1].reason.startswith("1 row without rates")
    assert any(each.startswith("1 mechanism: rates are missing or have few digits") for each in found.remarks)


@pytest.mark.parametrize("far", [1e5, 1e9])
def test_inputs_stand_as_far_as_in_a_file(far):
    mechanism = bare_four_bar(1.0, 3.0, 3.0, 3.0, 1.0)
    alone = planar.cycle(mechanism.with_values({"A.position": far}), 8, far, far + 1.0)
    for swept in (
        planar.sweep(mechanism, {"A.position": [far]}, 8, "C", stop=far + 1.0),
        planar.sweep(mechanism, {"coupler.length": [3.0]}, 8, "C", start=far, stop=far + 1.0),
    ):
        assert swept.velocity["C"][0] == pytest.approx(alone.point("C").velocity, rel=1e-14 * far)
        assert swept.whole.all()
    assert planar.sweep(mechanism, {"A.position": [1.0]}, 8, "C", start=1.0, stop=1.0 + 2e4 * np.pi).whole.all()


def test_newton_does_not_turn_a_link_on_an_arm_that_vanishes(monkeypatch):
    monkeypatch.setattr(kernel, "find_closed_form", lambda equations, block: None)
    value = {
        "planar": 1,
        "name": "a slot over its own pivot",
        "frame": "frame",
        "links": {
            "frame": {"points": {"O": [0, 0], "Q": [1, 0]}},
            "OA": {"ends": ["O", "A"], "length": 1.0},
            "L": {"points": {"Q": [0, 0], "E": [0.5, 0.3]}},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "Q"},
            {"slot": "S", "links": ["L", "OA"], "line": {"through": "Q", "angle": 0.0}, "point": "A"},
        ],
        "inputs": [{"pair": "O", "position": 0.5, "velocity": 1.0}],
        "sketch": {"A": [0.88, 0.48], "E": [0.6, 0.6]},
    }
    mechanism, lengths = planar.from_dict(value), {"OA.length": np.full(2, 1.0)}
    agrees(mechanism, lengths, 20, points="E", start=0.5, stop=-0.5)
    assert planar.sweep(mechanism, lengths, 20, points="E", start=0.5, stop=-0.5).general > 0


@pytest.mark.parametrize("steps", [13, 24])
def test_a_gap_between_two_steps_is_not_passed_over(steps):
    """A short coupler and rocker under a long crank may close again within the step in which they come to a dead
    point."""
    rng, count = np.random.default_rng(steps), 40_000
    a, g = rng.uniform(0.6, 1.4, (2, count))
    b, c = rng.uniform(0.05, 0.5, (2, count))
    start = rng.uniform(0.0, 2.0 * np.pi, count)
    closes = np.abs(b * b + c * c - (a * a + g * g - 2.0 * a * g * np.cos(start))) < 1.9 * b * c
    a, g, b, c, start = (values[closes] for values in (a, g, b, c, start))
    with np.errstate(invalid="ignore"):
        angles = [np.arccos((a * a + g * g - reach**2) / (2.0 * a * g)) for reach in (b + c, np.abs(b - c))]
    turned = np.remainder(np.concatenate([angles, np.negative(angles)]) - start, 2.0 * np.pi)
    turned = np.sort(np.where(np.isnan(turned), np.inf, turned), axis=0)
    assert np.count_nonzero(turned[1] - turned[0] < 2.0 * np.pi / steps) > 300
    values = {"crank.length": a, "coupler.length": b, "rocker.length": c, "frame.D.x": g, "A.position": start}
    base = bare_four_bar(1.2, 0.3, 0.25, 1.2, 0.2)
    swept = planar.sweep(base, values, steps, "C", rates=False)
    np.testing.assert_allclose(np.nan_to_num(swept.dead_point - start, nan=np.inf), turned[0], atol=1e-8)
    solved = np.minimum(np.ceil(turned[0] / (2.0 * np.pi / steps)), steps + 1).astype(int)
    assert (np.asarray(swept.status) == 0).sum(axis=1).tolist() == solved.tolist()


def test_a_prepared_run_ends_at_a_gap_within_a_step():
    """Coupler and rocker are stretched at 0.0816 rad and meet again at 0.3098 rad, in the first of 13 steps."""
    a, b, c, g, start = 0.99015, 0.44587, 0.32621, 0.94358, 6.08748
    run = planar.prepared(bare_four_bar(a, b, c, g, start), 13, "C", rates=False)()
    assert np.count_nonzero(np.asarray(run.status) == 0) == 1


@pytest.mark.parametrize("steps", [9, 24])
def test_an_arm_too_short_for_its_offset_between_two_steps_is_not_passed_over(steps):
    """A guide at an offset from the pivot of its arm: where the crank's pin comes nearer than that, it comes apart."""
    value = planar.to_dict(crank_and_slotted_arm(0.8))
    value["links"]["arm"]["points"]["P"] = [0.0, 0.1]
    value["pairs"][3]["line"]["through"] = "P"
    rng, count = np.random.default_rng(steps), 500
    offset, start = rng.uniform(0.03, 0.2, count), rng.uniform(-2.5, -0.7, count)
    crank = 1.0 + offset * rng.uniform(-0.9, 0.9, count)
    values = {"crank.length": crank, "arm.P.y": offset, "O.position": start}
    swept = planar.sweep(planar.from_dict(value), values, steps, "A", rates=False)
    turned = -np.arccos((crank**2 + 1.0 - offset**2) / (2.0 * crank)) - start
    np.testing.assert_allclose(swept.dead_point - start, turned, atol=1e-8)


def test_many_links_are_solved_block_after_block():
    # parallelograms, each driven by the rocker of the one before
    cells, angle = 32, 1.0
    pins = {f"P{k}": [k + 0.5 * np.cos(angle), 0.5 * np.sin(angle)] for k in range(cells + 1)}
    frame = {f"G{k}": [k, 0] for k in range(cells + 1)}
    bars = {f"R{k}": (f"G{k}", f"P{k}", 0.5) for k in range(cells + 1)}
    bars |= {f"C{k}": (f"P{k - 1}", f"P{k}", 1.0) for k in range(1, cells + 1)}
    mechanism = bar_linkage(frame, bars, ("G0", angle), pins)
    designs = {"C32.length": 1.0 + 1e-3 * np.arange(3)}
    asked = {"links": "R32", "pairs": mechanism.pairs[5].name, "derivatives": "C32.length"}
    swept = planar.sweep(mechanism, designs, 12, stop=angle + 0.5, **asked)
    assert not swept.status.any()
    assert swept.general == 0
    agrees(mechanism, designs, 12, stop=angle + 0.5)
    # the second design has a coupler that ends its run
    agrees(mechanism, {"C1.length": np.array([1.0, 0.6])}, 12, stop=angle + 0.5)


def test_a_dead_point_of_many_links_is_one_of_few():
    mechanism = chain_of_dyads(np.random.default_rng(3), 32)
    start = mechanism.inputs[0].position
    motion = planar.cycle(mechanism, 12, start, start + 0.02)
    assert motion.outcome is Outcome.DEAD_POINT
    agrees(mechanism, {"C32.length": [next(link.length for link in mechanism.links if link.name == "C32")]}, 12)


@pytest.mark.parametrize("stem", part([stem for stem in MODELS if len(MODELS[stem].inputs) == 1], 10))
def test_designs_solved_block_after_block_are_those_solved_together(stem, monkeypatch):
    mechanism = MODELS[stem]
    designs = designs_around(mechanism, 1e-3)
    asked = {"links": mechanism.links[-1].name, "pairs": mechanism.pairs[-1].name}
    if not isinstance(mechanism.inputs[0].law, type(None)):
        asked["start"] = mechanism.inputs[0].position
    together = planar.sweep(mechanism, designs, 24, **asked)
    monkeypatch.setattr(block, "MAX_JOINED_LINKS", 0)
    by_blocks = planar.sweep(mechanism, designs, 24, **asked)
    np.testing.assert_array_equal(by_blocks.status, together.status)
    for order, near in (("position", 1e-10), ("velocity", 1e-8), ("acceleration", 1e-6)):
        for name, found in getattr(by_blocks, order).items():
            expected = getattr(together, order)[name]
            scale = max(1.0, np.nanmax(np.abs(expected), initial=0.0))
            np.testing.assert_allclose(found, expected, atol=near * scale)
