"""Stops of pairs: where a motion meets them, against closed forms; what lies outside is refused."""

import json
import re
from dataclasses import replace
from io import StringIO

import numpy as np
import pytest
from rich.console import Console

import planar
from planar.batch.general_path import OUTCOMES, DesignRun
from planar.reports.tables.modes import table

DEG = np.pi / 180.0


def four_bar(pair="D", stops=(95, 110), **more):
    """The textbook's four-bar chain (50, 66, 56 on a frame of 100 mm), one of its pairs between stops."""
    given = planar.to_dict(planar.load("four-bar")) | {"published": []}
    entry = next(each for each in given["pairs"] if each["turning"] == pair)
    entry |= {"stops": stops if isinstance(stops, dict) else list(stops)} | more
    return given


def crank_angle(rocker):
    """The crank's angle at a rocker's: D and C are known, A and B by two circles (the branch of the sketch)."""
    c = np.array([100.0, 0.0]) + 56.0 * np.array([np.cos(rocker), np.sin(rocker)])
    far = np.hypot(*c)
    return np.arctan2(c[1], c[0]) + np.arccos((50.0**2 + far**2 - 66.0**2) / (2.0 * 50.0 * far))


def test_the_range_ends_where_an_output_meets_its_stops():
    motion = planar.cycle(planar.from_dict(four_bar()), 24)
    # the crank runs to where the rocker stands at 110 deg and at 95 deg, to round-off
    expected = sorted(crank_angle(angle * DEG) for angle in (95.0, 110.0))
    position = motion.inputs["A"].position
    assert np.allclose(position[[0, -1]], expected, atol=1e-13)
    assert [(each.kind, each.of, each.value) for each in motion.limits] == [
        ("stop", "D", pytest.approx(95 * DEG)),
        ("stop", "D", pytest.approx(110 * DEG)),
    ]
    assert np.isfinite(motion.point("C").velocity).all()  # no dead point: velocities are there at the stop
    assert motion.outcome is planar.Outcome.SOLVED
    assert "pair 'D' meets its upper stop at 110 deg" in motion.reason


def test_a_run_that_is_asked_for_ends_at_the_stop_with_its_name():
    motion = planar.cycle(planar.from_dict(four_bar()), 36, stop=200 * DEG)
    assert motion.outcome is planar.Outcome.STOP
    assert "cannot go beyond A = 72.5043 deg: there pair 'D' meets its upper stop at 110 deg" in motion.reason
    assert motion.inputs["A"].position[-1] == pytest.approx(crank_angle(110 * DEG), abs=1e-13)
    timed = planar.cycle(planar.from_dict(four_bar()), 50, duration=0.1)
    assert timed.outcome is planar.Outcome.STOP
    (limit,) = timed.limits
    # 60 deg + 10.5 t - 13 t^2 comes to the same angle
    t = np.roots([-13.0, 10.5, 60 * DEG - crank_angle(110 * DEG)]).min()
    assert (limit.kind, limit.of, limit.input) == ("stop", "D", pytest.approx(t, abs=1e-12))


def test_an_inputs_own_stops_are_its_range_also_whole_turns_off():
    own = planar.from_dict(four_bar("A", (30 + 360, 70 + 360)))
    assert np.allclose(planar.cycle(own, 4).inputs["A"].position, np.linspace(30, 70, 5) * DEG, atol=1e-13)
    open_ended = planar.from_dict(
        four_bar("A", (None, 70))
    )  # the other way the dead point comes before the stop's back
    kinds = [each.kind for each in planar.cycle(open_ended, 4).limits if each.of == "A"]
    assert kinds == ["input dead point", "stop"]


def test_positions_outside_are_refused_by_pair_position_and_remedy():
    mechanism = planar.from_dict(four_bar())
    for refused in (
        lambda: planar.solve(planar.from_dict(four_bar(stops=(30, 60)))),
        lambda: planar.cycle(planar.from_dict(four_bar(stops=(30, 60)))),
    ):
        with pytest.raises(planar.NoAnswer) as problem:
            refused()
        assert problem.value.outcome is planar.Outcome.STOP
        assert "pair 'D' is at 100.35 deg, outside of its stops at 30 deg and 60 deg; move" in problem.value.reason
    with pytest.raises(planar.NoAnswer, match=r"beyond A = 72\.5043 deg"):
        planar.solve(mechanism, {"A": 80 * DEG})
    at_stop = planar.solve(mechanism, {"A": crank_angle(110 * DEG)})
    assert at_stop.pairs["D"]["relative_angle"] == pytest.approx(110 * DEG, abs=1e-12)
    tipper = planar.load("tipper")
    assert planar.solve(tipper, {"stroke": 1.2}).inputs["stroke"].position == 1.2
    whole = planar.cycle(tipper, 5, 0.7, 1.2)
    assert (whole.outcome, len(whole)) == (planar.Outcome.SOLVED, 6)


def test_circuits_are_cut_at_stops_and_the_list_stays_complete():
    found = planar.circuits(planar.from_dict(four_bar()))
    ends = [[(branch.low, branch.high, branch.ends) for branch in each.branches] for each in found]
    # a second, mirrored assembly has the rocker between the same angles, at the other crank angles
    beta = [crank_angle(angle * DEG) for angle in (110.0, 95.0)]
    assert ends[0] == [(pytest.approx(beta[1]), pytest.approx(beta[0]), ("stop of D",) * 2)]
    assert len(found) == 2
    assert found.complete.value == "numerically complete"
    assert not any(circuit.closed for circuit in found)


@pytest.mark.parametrize(
    ("stops", "told"),
    [
        ([1], "$.pairs[3].stops: a lower and an upper stop are wanted here, not 1 (null: open)"),
        ([5, 2], "$.pairs[3].stops: the lower stop comes first, and below the upper one"),
        ([None, None], "$.pairs[3].stops: both ends are open; name the lower stop, the upper stop or both"),
        (["5 mm", 2], "$.pairs[3].stops[0]: '5 mm' is a length, but an angle is wanted"),
    ],
)
def test_bad_stops_are_refused_at_their_place(stops, told):
    with pytest.raises(planar.BadInput, match=re.escape(told)):
        planar.from_dict(four_bar(stops=stops))


def test_restitution_is_refused_without_stops_and_out_of_range():
    given = four_bar(restitution=1.5)
    with pytest.raises(planar.BadInput, match=r"\$\.pairs\[3\]\.restitution: a number from 0 to 1"):
        planar.from_dict(given)
    del given["pairs"][3]["stops"]
    with pytest.raises(planar.BadInput, match=r"\$\.pairs\[3\]\.restitution: a 'restitution' is that of 'stops'"):
        planar.from_dict(given)


def test_a_pin_of_three_links_names_the_relative_motion():
    given = {
        "planar": 1,
        "units": {"angle": "deg"},
        "frame": "f",
        "links": {"f": {"points": {"O": [0, 0]}}, "a": {"points": {"O": [0, 0]}}, "b": {"points": {"O": [0, 0]}}},
        "pairs": [{"turning": "O", "stops": [0, 90]}],
        "inputs": [{"pair": "O:f,a", "position": 10}, {"pair": "O:f,b", "position": 40}],
    }
    with pytest.raises(planar.BadInput, match=re.escape("'O' joins 3 links; name the relative motion that stops")):
        planar.from_dict(given)
    given["pairs"][0]["stops"] = {"O:a,b": [20, 50]}
    mechanism = planar.from_dict(given)
    assert planar.from_dict(json.loads(planar.dumps(mechanism))) == mechanism
    motion = planar.cycle(mechanism, 4, pair="O:f,a")
    assert np.allclose(motion.inputs["O:f,a"].position / DEG, np.linspace(-10, 20, 5))
    assert mechanism.with_values({"O.stops.O:a,b.1": "45 deg"}).stops[0].high == pytest.approx(45 * DEG)


def test_sweeps_have_the_statuses_of_the_general_path():
    rng, mechanism = np.random.default_rng(5), planar.from_dict(four_bar())
    lengths, uppers = rng.uniform(0.06, 0.07, 6), rng.uniform(101, 120, 6) * DEG
    found = planar.sweep(mechanism, {"BC.length": lengths, "D.stops.1": uppers}, 72, "C")
    stop = OUTCOMES.index(planar.Outcome.STOP)
    assert stop in found.status
    for k, (length, upper) in enumerate(zip(lengths, uppers, strict=True)):
        own = mechanism.with_values({"BC.length": length, "D.stops.1": upper})
        told = DesignRun(own, "A", found.input, 72).solve(("C",), False)
        assert np.array_equal(told.status, found.status[k])
    (each,) = planar.sweep_each([mechanism], 72)
    assert stop in each.status
    assert stop in planar.prepared(mechanism, 72, "C")({}).status


@pytest.mark.parametrize(
    ("model", "pair", "steps"),
    [("crank-rocker", "B0", 72), ("slider-crank", "stroke", 7), ("watt-1-six-bar", "B0", 144)],
)
def test_compiled_rows_meet_the_stops_that_the_general_path_meets(model, pair, steps, monkeypatch):
    free = planar.load(model)
    here = next(iter(planar.solve(free).pair(pair).values()))
    values = next(iter(planar.cycle(free, 72).pair(pair).values()))
    span = float(np.ptp(values))
    stops = planar.Stops(pair, float(here - 0.2 * span), float(here + 0.3 * span))
    mechanism = replace(free, stops=(stops,), published=())
    fast = planar.cycle(mechanism, steps)
    monkeypatch.setattr("planar.solving.continuation.path.fast_run", lambda *_: None)
    monkeypatch.setattr("planar.solving.cycle.fast_run", lambda *_: None)
    slow = planar.cycle(replace(mechanism, name="again"), steps)
    assert (fast.outcome, fast.reason, len(fast)) == (slow.outcome, slow.reason, len(slow))
    (given,) = fast.inputs
    np.testing.assert_allclose(fast.inputs[given].position, slow.inputs[given].position, atol=1e-12)
    assert [each.kind for each in fast.limits] == [each.kind for each in slow.limits]


def test_the_tippers_cylinder_holds_its_body_between_its_stops():
    """By the law of cosines in the triangle OAB, and by virtual work: the stop carries what the weight asks for."""
    mechanism = planar.load("tipper")
    motion = planar.cycle(mechanism, 10)
    eye, arm = np.hypot(0.8, 0.45), np.hypot(1.0, 0.21)
    stroke = motion.inputs["stroke"].position
    inner = np.arccos((eye**2 + arm**2 - stroke**2) / (2.0 * eye * arm))
    expected = inner + np.arctan2(-0.45, 0.8) - np.arctan2(0.21, 1.0)
    np.testing.assert_allclose(motion.link("body").angle, expected, atol=1e-13)
    state = planar.solve(mechanism, {"stroke": 0.7})
    forces = planar.forces(state, inertia=False)
    assert forces.stops["stroke"] == pytest.approx(forces.inputs["stroke"])
    rate = (
        planar.solve(mechanism, {"stroke": 0.7 + 1e-6}).point("G").position[1] - state.point("G").position[1]
    ) / 1e-6
    assert forces.stops["stroke"] == pytest.approx(2000 * 9.81 * rate, rel=1e-5)
    assert planar.forces(planar.solve(mechanism, {"stroke": 1.2})).stops == {"stroke": 0.0}


def test_assemblies_beyond_a_stop_are_listed_and_marked():
    found = planar.modes(planar.from_dict(four_bar()), certify=False)
    assert [mode.is_beyond_stop for mode in found] == [False, True]
    assert [mode.outcome for mode in found] == [planar.Outcome.SOLVED, planar.Outcome.STOP]
    assert len(found) == len(planar.modes("four-bar", certify=False))
    page = Console(width=160, record=True, file=StringIO())
    page.print(table(found, 10))
    told = page.export_text()
    assert "; 1 of these lies beyond a stop" in told
    assert "2: at A = 60 deg pair 'D' is at" in told
    with pytest.raises(planar.NoAnswer, match="outside of its stops"):
        planar.solve(found[1].mechanism)
