"""Gears, belts, chains, racks and slots that an author got wrong, and where their angles count turns."""

import json
from math import radians

import numpy as np
import pytest
from click.testing import CliRunner

import planar
from planar.cli import main
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from tests.wheel_documents import BELT, GEAR, INPUTS, MISTAKES, RACK, RATIO, WHEELS, driven, mistaken, pinion, wheels


@pytest.mark.parametrize(("entry", "place", "words"), MISTAKES)
def test_a_mistake_is_named_with_its_place(entry, place, words, tmp_path):
    value = mistaken(entry)
    with pytest.raises(BadInput) as problem:
        planar.from_dict(value)
    assert problem.value.place == f"$.pairs[{len(value['pairs']) - 1}]{place}"
    for word in words:
        assert word in problem.value.sentence
    file = tmp_path / "wrong.json"
    file.write_text(json.dumps(value), encoding="utf-8")
    ended = CliRunner().invoke(main, ["solve", str(file)])
    assert ended.exit_code == 2
    assert ended.output.count("\n") == 1


@pytest.mark.parametrize(("value", "place", "words"), INPUTS)
def test_an_input_has_the_units_of_its_pair(value, place, words):
    with pytest.raises(BadInput, match=words) as problem:
        planar.from_dict(value)
    assert problem.value.place == place


def between(first, second, ratio, name, **more):
    return {"gear": name, "links": [first, second], "ratio": ratio, **more}


def ring(*ratios, **more):
    """Three wheels, each geared to the next."""
    pairs = (between(a, b, r, f"{a}{b}") for (a, b), r in zip(("ab", "bc", "ca"), ratios, strict=True))
    first, second, third = pairs
    return wheels(first, second | more, third, inputs=WHEELS["inputs"][:1])


def tied(*entries):
    """The third wheel tied to the first, which alone is driven."""
    return wheels(*entries, between("a", "c", -1, "ac"), inputs=WHEELS["inputs"][:1])


@pytest.mark.parametrize(
    ("value", "outcome", "words"),
    [
        (ring(-1, -1, -1), Outcome.CANNOT_BE_ASSEMBLED, ["'ca'", "40 deg"]),
        (ring(-2, -1, 0.5, mesh={"b": 0, "c": 10}), Outcome.CANNOT_BE_ASSEMBLED, ["'ca'", "5 deg"]),
        (tied(RATIO, RATIO | {"gear": "h", "ratio": -2.1}), Outcome.CANNOT_BE_ASSEMBLED, ["'h'", "2 deg"]),
        (tied(RATIO, BELT | {"belt": "h"}), Outcome.CANNOT_BE_ASSEMBLED, ["'h'"]),
        (wheels(RATIO, inputs=[driven("O", 20), driven("R", 0), driven("Q", 30)]), Outcome.TOO_MANY_INPUTS, ["'Q'"]),
        (wheels(RATIO, inputs=[driven("R", 0)]), Outcome.TOO_FEW_INPUTS, ["'a'", "'b'", "'g'"]),
        (pinion(RACK | {"radius": 19.99}), Outcome.CANNOT_BE_ASSEMBLED, ["'r'", "0.01 mm from touching", "guides"]),
        (pinion(RACK | {"radius": -20}), Outcome.CANNOT_BE_ASSEMBLED, ["'r'", "40 mm from touching"]),
        (pinion(RACK, pairs=[], inputs=[driven("r", 30)]), Outcome.TOO_FEW_INPUTS, ["'w'", "1 way"]),
    ],
)
def test_what_has_no_answer_is_told(value, outcome, words):
    with pytest.raises(NoAnswer) as problem:
        planar.solve(planar.from_dict(value))
    assert problem.value.outcome is outcome
    for word in words:
        assert word in problem.value.reason


def test_a_closed_ring_of_gears_that_agree_turns():
    state = planar.solve(planar.from_dict(ring(-3, -1, 1 / 3)))
    assert state.mobility == 1
    assert [state.link(name).angular_velocity for name in "abc"] == pytest.approx([1, -3, 3], rel=1e-14)


@pytest.mark.parametrize("degrees", [20, 400, 3679.2, -100_000])
def test_an_input_may_be_at_a_gear_or_many_turns_on(degrees):
    at_wheel = planar.solve(planar.from_dict(wheels(GEAR)), {"O": radians(degrees)})
    assert at_wheel.link("b").angle == pytest.approx(radians(degrees) * -30 / 50, rel=1e-14)
    given = [driven("g", degrees * -30 / 50, velocity="-0.6 rad/s"), driven("R", 0)]
    at_gear = planar.solve(planar.from_dict(wheels(GEAR, inputs=given)))
    assert at_gear.link("a").angle == pytest.approx(radians(degrees), rel=1e-14)
    assert at_gear.link("a").angular_velocity == pytest.approx(1, rel=1e-14)


def test_a_train_may_go_from_one_carrier_to_the_next():
    """The second carrier hangs on the first; each gear obeys its ratio against its own."""
    value = {
        "planar": 1,
        "frame": "f",
        "links": {
            "f": {"points": {"O": [0, 0]}},
            "arm": {"ends": ["O", "P"], "length": 0.06},
            "second arm": {"ends": ["P", "R"], "length": 0.05},
            "v": {"points": {"P": [0, 0]}},
            "w": {"points": {"R": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"turning": "P", "links": ["v", "arm", "second arm"]},
            {"turning": "R"},
            {"gear": "g", "links": ["f", "v"], "carrier": "arm", "radii": [0.04, 0.02]},
            {"gear": "h", "links": ["v", "w"], "carrier": "second arm", "radii": [0.02, 0.03]},
        ],
        "inputs": [driven("O", 0.9, velocity=1), driven("P:arm,second arm", 0.3, velocity=2, acceleration=5)],
    }
    state = planar.solve(planar.from_dict(value))
    assert state.mobility == 2
    turning = np.array([state.link(name)[:3] for name in ("arm", "second arm", "v", "w")])
    np.testing.assert_allclose(turning[2] - turning[0], -2 * (0 - turning[0]), atol=1e-13)
    np.testing.assert_allclose(turning[3] - turning[1], -2 / 3 * (turning[2] - turning[1]), atol=1e-13)


@pytest.mark.parametrize("degrees", [100, 150, 200, 460, 820])
@pytest.mark.parametrize("ratio", [0.5, -2.122])
def test_a_gear_on_a_crank_that_a_linkage_turns_counts_its_turns(degrees, ratio):
    """A drag link turns a second crank fully round; the wheel geared to it goes on from turn to turn."""
    value = {
        "planar": 1,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "f",
        "links": {
            "f": {"points": {"A": [0, 0], "D": [20, 0], "W": [200, 0]}},
            "AB": {"ends": ["A", "B"], "length": 60},
            "BC": {"ends": ["B", "C"], "length": 50},
            "DC": {"ends": ["D", "C"], "length": 60},
            "w": {"ends": ["W", "X"], "length": 20},
        },
        "pairs": [
            *({"turning": name} for name in "ABCDW"),
            {"gear": "g", "links": ["DC", "w"], "ratio": ratio},
        ],
        "inputs": [driven("A", 100, velocity="1 rad/s")],
        "sketch": {"C": [-37, 17]},
    }
    mechanism = planar.from_dict(value)
    start, there = (planar.solve(mechanism, {"A": radians(at)}) for at in (100, degrees))
    crank = there.link("DC").angle - start.link("DC").angle
    assert there.link("w").angle == pytest.approx(ratio * there.link("DC").angle, rel=1e-13)
    assert round(crank / (2 * np.pi)) == round((degrees - 100) / 360)
    if degrees == 820:
        assert crank == pytest.approx(4 * np.pi, abs=1e-12)


CONTRACT = {
    "planar": 1,
    "name": "Andrew variable-stroke engine",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {
        "frame": {"points": {"O": [0, 0], "Q": [-158, 0]}},
        "OA": {"ends": ["O", "A"], "length": 90},
        "QB": {"ends": ["Q", "B"], "length": 45},
        "AC": {"ends": ["A", "C"], "length": 185},
        "BC": {"ends": ["B", "C"], "length": 185},
        "CD": {"ends": ["C", "D"], "length": 240},
    },
    "pairs": [
        *({"turning": name} for name in "OQABC"),
        {"gear": "wheels", "links": ["OA", "QB"], "ratio": -2.122, "mesh": {"OA": 79.2, "QB": 208.1}},
        {"sliding": "stroke", "on": "frame", "block": "D", "line": {"through": [0, 232], "angle": 0}},
    ],
    "inputs": [{"pair": "O", "position": 79.2, "velocity": "100 rpm"}],
    "loads": [{"point": "D", "force": [-3000, 0]}],
    "sketch": {"C": [-154, 159], "D": [74, 232]},
}


def test_the_geared_example_balances_power_as_a_difference_of_positions_says():
    """Torque times speed of the crank is load times speed of the slider, that taken from two positions."""
    mechanism = planar.from_dict(CONTRACT)
    state = planar.solve(mechanism)
    crank, step = mechanism.inputs[0].position, 1e-4
    ahead, behind = (planar.solve(mechanism, {"O": crank + way * step}).point("D").position[0] for way in (1, -1))
    # central difference: truncation of about step^2, so eight digits
    assert planar.forces(state).inputs["O"] == pytest.approx(3000 * (ahead - behind) / (2 * step), rel=1e-6)
    assert state.link("QB").angle == pytest.approx(np.radians(208.1), rel=1e-12)
    assert state.link("QB").angular_velocity == pytest.approx(-2.122 * 100 * np.pi / 30, rel=1e-12)
