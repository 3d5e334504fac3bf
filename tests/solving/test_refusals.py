"""Every way in which a mechanism has no answer, by the library and by the real command; and that the advice helps."""

import copy
import json
import re
import signal
from dataclasses import replace

import numpy as np
import pytest

import planar
from planar.document import files
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.solving import newton, position
from planar.solving.assembly import block_assemblies, nearest_assembly
from planar.solving.diagnosis import refusals, remedy
from tests.builders import four_bar_document, six_bar_document, slider_crank_document
from tests.closed_forms import between
from tests.command import run, written
from tests.draws import first_cases, is_exhaustive, part
from tests.known import MODELS

DEG = np.pi / 180


def value(links, pairs, inputs, sketch=None, unit="mm"):
    given = [
        {"pair": pair, "position": position, "velocity": "1 m/s" if pair == "s" else "1 rad/s"}
        for pair, position in inputs
    ]
    return copy.deepcopy(
        {
            "planar": 1,
            "units": {"length": unit, "angle": "deg"},
            "frame": "f",
            "links": links,
            "pairs": pairs,
            "inputs": given,
            "sketch": sketch or {},
        }
    )


def pins(names):
    return [{"turning": name} for name in names]


UNITS = {"units": {"length": "mm", "angle": "deg"}}


def mm_four_bar(a=50, b=66, c=56, d=100, theta=60, sketch=None, pair="A"):
    more = {"names": ["f", "AB", "BC", "DC"], "omega": "1 rad/s", "sketch": sketch or {"C": [80, 50]}} | UNITS
    return four_bar_document(a, b, c, d, theta, driven=pair, **more)


def mm_slider_crank(r=50, rod=120, offset=0, theta=60, drive="O"):
    more = {"names": ("f", "crank", "rod"), "slide": "s", "driven": drive, "sketch": {"B": [150, offset]}} | UNITS
    return slider_crank_document(r, rod, theta, offset, omega="1 m/s" if drive == "s" else "1 rad/s", **more)


def mm_six_bar(last=60):
    sketch = {"C": [80, 50], "F": [130, 50]}
    return six_bar_document(30, last, 60, ground="f", omega="1 rad/s", sketch=sketch, **UNITS)


def refused(given, drives=()):
    with pytest.raises(NoAnswer) as caught:
        planar.solve(files.from_dict(given), drives)
    return caught.value


def solved(given):
    return planar.solve(files.from_dict(given))


BESIDE = {
    "f": {"points": {"A": [0, 0], "D": [100, 0], "U": [0, -300], "V": [100, -300]}},
    "AB": {"ends": ["A", "B"], "length": 30},
    "BC": {"ends": ["B", "C"], "length": 90},
    "DC": {"ends": ["D", "C"], "length": 70},
    "p": {"ends": ["U", "P"], "length": 80},
    "q": {"ends": ["V", "P"], "length": 90},
}
BRACED = float(np.degrees(between(80, 100, 90)))
"""The angle of p in its triangle."""


def beside(*inputs):
    """A four-bar, and on the same frame a triangle that nothing can move."""
    return value(BESIDE, pins("ABCDUVP"), inputs, {"C": [90, 70], "P": [50, -230]})


def twins(*inputs):
    """Two four-bars on one frame."""
    links = {name: BESIDE[name] for name in ("f", "AB", "BC", "DC")} | {
        "p": {"ends": ["U", "P"], "length": 30},
        "r": {"ends": ["P", "R"], "length": 90},
        "q": {"ends": ["V", "R"], "length": 70},
    }
    return value(links, pins("ABCDUVPR"), inputs, {"C": [90, 70], "R": [90, -230]})


def wheels(ratio, *inputs):
    """Three wheels geared in a ring, and a fourth that nothing drives."""
    links = {"f": {"points": {"O": [0, 0], "P": [50, 0], "Q": [25, 40], "W": [100, 0]}}}
    links |= {name: {"ends": [at, name], "length": 10} for name, at in zip("abcw", "OPQW", strict=True)}
    gears = zip(("ab", "bc", "ca"), (-0.5, -2.0, ratio), strict=True)
    return value(
        links,
        [*pins("OPQW"), *({"gear": name, "links": list(name), "ratio": each} for name, each in gears)],
        inputs,
    )


PARALLELOGRAM = mm_four_bar(50, 100, 50, 100, 180, {"C": [50, 0]})
LIMIT = float(np.degrees(between(50, 100, 122)))
"""Where BC and DC of the first four-bar stretch into one line."""

CASES = {
    "cannot be assembled": (mm_four_bar(theta=150), ["A = 150 deg", "'BC' and 'DC'", "pair '", "BC.length"]),
    "dead point": (
        mm_four_bar(theta=LIMIT),
        [f"A = {LIMIT:.6g} deg", "'A'", "'BC' and 'DC'", "drive 'B' or 'C' or 'D'"],
    ),
    "change point": (PARALLELOGRAM, ["A = 180 deg", "2 freedoms for 1 input", "'BC' and 'DC'", "a further input"]),
    "too few inputs": (twins(("A", 50)), ["1 input", "'p', 'r' and 'q'", "1 way", "'U' or 'V' or 'P' or 'R'"]),
    "too many inputs": (beside(("A", 50), ("U", 60)), ["'A' and 'U'", "the input at 'U' cannot move", "leave it out"]),
    "too inexact": (
        mm_four_bar(a=44, b=1e-11, c=56, theta=0, sketch={"C": [44, 0]}),
        ["A = 0 deg", "link 'BC' has an arm of 1e-13", "lengthen link 'BC'"],
    ),
    "input jammed": (beside(("U", 60)), ["'U'", "'f' and 'p' fast", "'AB', 'BC' and 'DC'", "drive 'A' or 'B'"]),
    "structure": (
        value({name: BESIDE[name] for name in ("f", "p", "q")}, pins("UVP"), [("U", BRACED)], {"P": [50, -230]}),
        ["nothing moves", "links 'p' and 'q' with the frame 'f'", "remove link 'q' with its pairs 'V' and 'P'"],
    ),
    "stop": (
        mm_four_bar() | {"pairs": [{"turning": "A", "stops": [70, 90]}, *pins("BCD")]},
        ["A = 60 deg", "pair 'A' is at 60 deg", "its stops at 70 deg and 90 deg", "move the input"],
    ),
}


@pytest.mark.parametrize("outcome", CASES)
def test_the_command_ends_with_1_and_says_outcome_and_reason(outcome, tmp_path):
    given, words = CASES[outcome]
    problem = refused(given)
    assert problem.outcome == outcome
    for word in words:
        assert word in problem.reason
    ended = run(tmp_path, "solve", written(tmp_path, given), "--json")
    assert ended.refused(1) == f"{outcome}: {problem.reason}"
    assert json.loads(ended.out) == {"outcome": outcome, "reason": problem.reason}


def test_a_dead_point_on_the_way_by_the_command(tmp_path):
    name = written(tmp_path, mm_four_bar())
    ended = run(tmp_path, "solve", name, "--json", "--at", "A=140")
    told = json.loads(ended.out)
    assert ended.refused(1) == f"dead point: {told['reason']}"
    assert told["outcome"] == "dead point"
    for word in (f"beyond A = {LIMIT:.6g} deg", "links 'BC' and 'DC'", "drive 'B' or 'C' or 'D'"):
        assert word in told["reason"]
    assert refused(mm_four_bar(), {"A": 140 * DEG}).reason == told["reason"]


def test_a_slide_that_goes_out_without_an_end_is_lost_there():
    """A pin on the line x = 1 m in the slot of a lever about the origin stands at y = tan(angle)."""
    value = {
        "planar": 1,
        "frame": "frame",
        "units": {"angle": "deg"},
        "links": {
            "frame": {"points": {"O": [0, 0]}},
            "lever": {"points": {"O": [0, 0]}},
            "rod": {"points": {"P": [0, 0]}},
        },
        "pairs": [
            {"turning": "O"},
            {"sliding": "rail", "links": ["frame", "rod"], "line": {"through": [1, 0], "angle": 90}, "point": "P"},
            {"sliding": "slot", "on": "lever", "block": "P", "line": {"through": "O"}},
        ],
        "inputs": [{"pair": "O", "position": 20, "velocity": "1 rad/s"}],
    }
    problem = refused(value, {"O": 100.0 * DEG})
    assert problem.outcome is Outcome.BRANCH_LOST
    for word in ("beyond O = 90 deg", "without an end", "drive 'rail'"):
        assert word in problem.reason


def test_every_outcome_is_provoked_here():
    assert {*CASES, "solved", "branch lost", "interrupted"} == {str(outcome) for outcome in Outcome}


@pytest.mark.usefixtures("interruptions")
def test_a_run_ends_where_its_time_is_over_or_the_user_interrupts_it(tmp_path):
    mechanism = files.from_dict(mm_four_bar())  # its input has limits, which are walked to
    ended = planar.cycle(mechanism, 12, stop=2.0 * np.pi, timeout=1e-9)
    assert ended.outcome is Outcome.INTERRUPTED
    assert "when the time limit of 1e-09 s was reached; go on from there, or give more time" in ended.reason
    with pytest.raises(NoAnswer, match=r"followed as far as A = .*, when the time limit of 1e-09 s was reached"):
        planar.cycle(mechanism, 12, timeout=1e-9)
    assert planar.cycle(mechanism, 12).outcome is Outcome.SOLVED  # nothing of that is kept

    def interrupt(done, total):
        signal.raise_signal(signal.SIGINT)

    interrupted = planar.cycle(mechanism, 12, stop=2.0 * np.pi, progress=interrupt)
    assert interrupted.outcome is Outcome.INTERRUPTED
    assert "when the user interrupted it" in interrupted.reason
    name = written(tmp_path, mm_four_bar())
    by_command = run(tmp_path, "cycle", name, "--to", "360", "--timeout", "1 us")
    assert "when the time limit of 1e-06 s was reached" in by_command.refused(1)
    assert run(tmp_path, "cycle", name, "--timeout", "-1 s").refused(2).startswith("--timeout: ")
    with pytest.raises(BadInput, match="timeout: a time above zero, in s, is wanted, not 0"):
        planar.cycle(mechanism, timeout=0)


def test_circuits_and_simulations_end_where_their_time_is_over():
    found = planar.circuits(planar.load("watt-six-bar"), timeout=1e-9)
    assert found.complete.name == "NOT"
    assert "the time limit of 1e-09 s was reached" in found.remarks[0]
    let_go = planar.simulate(planar.load("door-closer"), 1.0, 20, timeout=1e-9).motion
    assert (let_go.outcome, len(let_go) < 21) == (Outcome.INTERRUPTED, True)
    assert let_go.reason.endswith("s: the time limit of 1e-09 s was reached")


# cannot be assembled: the gap, and the dimension offered


OFFER = re.compile(r"it would go together with (\S+) = (\S+) mm instead of (\S+) mm")


def with_length(given, name, length):
    changed = copy.deepcopy(given)
    link, what = name.split(".", 1)
    if what == "length":
        changed["links"][link]["length"] = length
    else:
        point, axis = what.split(".")
        changed["links"][link]["points"][point]["xy".index(axis)] = length
    return changed


def diagonal(a, d, theta):
    return float(np.hypot(d - a * np.cos(theta * DEG), a * np.sin(theta * DEG)))


STATIONS = [(a, d, theta) for a, d in ((50, 100), (70, 100), (50, 130)) for theta in (120, 150, 180, -140)]


@pytest.mark.parametrize(("a", "d", "theta"), part([each for each in STATIONS if diagonal(*each) > 123], 5))
def test_bars_that_are_too_short_are_told_the_gap_and_the_length_that_just_reaches(a, d, theta):
    given = mm_four_bar(a, 66, 56, d, theta)
    problem = refused(given)
    assert problem.outcome is Outcome.CANNOT_BE_ASSEMBLED
    far = diagonal(a, d, theta)
    assert f"stays open by {far - 122:.6g} mm" in problem.reason
    name, new, old = OFFER.search(problem.reason).groups()
    longer = {"BC.length": (66, far - 56), "DC.length": (56, far - 66)}
    if name in longer:
        was, just = longer[name]
        assert float(old) == was
        # printed with five digits, beyond the value that just reaches
        assert just <= float(new) <= just * (1 + 2e-4)
    check_offer(given, problem.reason)


@pytest.mark.parametrize(("b", "c"), first_cases([(200, 56), (66, 230)]))
def test_a_bar_that_is_too_long_is_told_how_short_it_would_have_to_be(b, c):
    given = mm_four_bar(50, b, c, 100, 60)
    problem = refused(given)
    far = diagonal(50, 100, 60)
    assert f"stays open by {abs(b - c) - far:.6g} mm" in problem.reason
    check_offer(given, problem.reason)


def check_offer(given, reason, other=None):
    """What is offered goes together as printed, and a change that is less by a thousandth does not."""
    name, new, old = OFFER.search(reason).groups()
    new, old = float(new), float(old)
    try:
        solved(with_length(given, name, new))
    except NoAnswer as problem:
        # stretched to its limit it stands on a dead point, or flat on a change point, but it stands
        assert problem.outcome in (Outcome.DEAD_POINT, Outcome.CHANGE_POINT)
    less = with_length(given, name, new - 1e-3 * (new - old))
    if other is not None:
        # a chain may go together with less from another assembly of what comes before
        assert np.hypot(*(solved(less).point("C").position - other)) > 0.01
    else:
        assert refused(less).outcome is Outcome.CANNOT_BE_ASSEMBLED


@pytest.mark.parametrize("offset", [100, -90])
def test_a_rod_that_does_not_reach_its_line_is_told_so(offset):
    given = mm_slider_crank(50, 60, offset, -60 if offset > 0 else 60)
    problem = refused(given)
    assert problem.outcome is Outcome.CANNOT_BE_ASSEMBLED
    gap = abs(offset) + 50 * np.sin(60 * DEG) - 60
    assert f"{gap:.6g} mm" in problem.reason
    assert "'rod'" in problem.reason
    check_offer(given, problem.reason)


@pytest.mark.parametrize("last", [15, 300])
def test_a_six_bar_whose_second_dyad_does_not_reach(last):
    given = mm_six_bar(last)
    reason = refused(given).reason
    at = planar.solve(files.from_dict(mm_four_bar())).point("C").position * 1e3
    far = float(np.hypot(*(at - [200, 0])))
    gap = far - (30 + last) if last < 100 else last - 30 - far
    assert f"by {gap:.6g} mm" in reason
    assert "'CF' and 'GF'" in reason
    name, new, _ = OFFER.search(reason).groups()
    if last == 300:
        assert name == "CF.length"
        assert float(new) == pytest.approx(300 - far, rel=1e-4)
    check_offer(given, reason, at / 1e3 if last == 300 else None)


def test_where_no_single_length_helps_none_is_offered():
    """A truss with two bars too many, of lengths that no one change reconciles."""
    links = {"f": {"points": {"A": [0, 0], "B": [100, 0], "D": [200, 0], "E": [300, 0]}}}
    links |= {f"b{at}": {"ends": [at, "C"], "length": far} for at, far in zip("ABDE", (100, 90, 50, 400), strict=True)}
    problem = refused(value(links, pins("ABCDE"), [], {"C": [60, 80]}))
    assert problem.outcome is Outcome.CANNOT_BE_ASSEMBLED
    assert "it would go together" not in problem.reason
    assert "change the input or a dimension of" in problem.reason


def test_the_search_for_a_remedy_stops_after_its_effort(monkeypatch):
    """The steps of Newton's method from all starts are those counted, and little else."""
    given, steps = mm_six_bar(15), []
    real = newton.damped_newton

    def counted(*arguments, **options):
        result = real(*arguments, **options)
        steps.append(result.steps)
        return result

    monkeypatch.setattr(remedy, "damped_newton", counted)
    for limit, words in (
        (60.0, "the search for a single change that helps was cut off"),
        (4500.0, "would go together"),
    ):
        monkeypatch.setattr(remedy, "MAX_EFFORT", limit)
        steps.clear()
        assert words in refused(given | {"name": f"effort {limit}"}).reason
        assert sum(steps) <= limit + newton.MAX_NEWTON_STEPS


# dead points and change points


@pytest.mark.parametrize(("theta", "x"), [(0, 170), (180, 70)])
def test_a_piston_cannot_move_its_crank_out_of_the_dead_centres(theta, x):
    problem = refused(mm_slider_crank(theta=x, drive="s"))
    assert problem.outcome is Outcome.DEAD_POINT
    assert f"s = {x} mm" in problem.reason
    assert "'s'" in problem.reason
    assert "'crank'" in problem.reason
    drive = re.search(r"drive '(\w+)'", problem.reason).group(1)
    assert drive in "OAB"
    state = solved(mm_slider_crank(theta=theta))
    assert state.point("B").position[0] == pytest.approx(x / 1e3)
    assert state.point("B").velocity[0] == pytest.approx(0.0, abs=1e-15)


def test_after_driving_what_is_advised_the_dead_point_is_no_more():
    problem = refused(mm_four_bar(theta=LIMIT))
    offered = re.findall(r"'(\w)'", problem.reason.split("drive ")[1])
    assert offered == ["B", "C", "D"]
    # stretched: C on the way from D to B, 56 from D
    b = 50 * np.exp(1j * LIMIT * DEG)
    angle = float(np.degrees(np.angle(b - 100)))
    c = 100 + 56 * np.exp(1j * angle * DEG)
    given = mm_four_bar(theta=angle, pair="D", sketch={"C": [c.real, c.imag], "B": [b.real, b.imag]})
    state = solved(given)
    assert state.link("AB").angle == pytest.approx(LIMIT * DEG, abs=1e-7)
    assert state.link("AB").angular_velocity == pytest.approx(0.0, abs=1e-6)


@pytest.mark.parametrize("theta", [0, 180])
def test_a_further_input_leads_over_a_change_point(theta):
    given = mm_four_bar(50, 100, 50, 100, theta, {"C": [100 + 50 * np.cos(theta * DEG), 0]})
    assert refused(given).outcome is Outcome.CHANGE_POINT
    given["inputs"].append({"pair": "D", "position": theta, "velocity": "1 rad/s"})
    state = solved(given)
    assert state.link("BC").angular_velocity == pytest.approx(0.0, abs=1e-12)


# too few, too many


@pytest.mark.parametrize(
    ("inputs", "ways", "free"),
    [
        ([("A", 50)], "1 way", ["p", "r", "q"]),
        ([("U", 50)], "1 way", ["AB", "BC", "DC"]),
    ],
)
def test_too_few_inputs_name_what_stays_free_and_a_pair_that_helps(inputs, ways, free):
    problem = refused(twins(*inputs))
    assert problem.outcome is Outcome.TOO_FEW_INPUTS
    assert f"can still move in {ways}" in problem.reason
    told, advice = problem.reason.split("; give an input at ")
    assert set(re.findall(r"'(\w+)'", told)) == set(free)
    offered = re.findall(r"'(\w)'", advice)
    position = {"U": 50, "V": 100, "P": 10, "A": 50, "B": 10, "D": 100}
    assert solved(twins(*inputs, (offered[0], position[offered[0]]))).mobility == 2


def test_without_inputs_the_position_is_as_drawn_and_says_where_to_drive():
    state = solved(twins())
    assert state.mobility == len(state.mechanism.inputs) == 2
    (remark,) = state.remarks
    assert "can still move in 2 ways" in remark
    assert set(re.findall(r"'(\w+)'", remark.split(" can still")[0].split("links")[1])) == {*"prq", "AB", "BC", "DC"}


def test_of_three_inputs_two_conflict_and_are_named():
    problem = refused(twins(("A", 50), ("D", 100), ("U", 50)))
    assert problem.outcome is Outcome.TOO_MANY_INPUTS
    assert "those at 'A' and 'D' move one another; leave one of them out" in problem.reason
    for kept in ("A", "D"):
        assert solved(twins((kept, 50 if kept == "A" else 100), ("U", 50))).mobility == 2


def test_two_conflicts_are_both_named():
    problem = refused(twins(("A", 50), ("D", 100), ("U", 50), ("V", 100)))
    assert problem.outcome is Outcome.TOO_MANY_INPUTS
    assert "those at 'A' and 'D' move one another" in problem.reason
    assert "those at 'U' and 'V' move one another" in problem.reason
    assert "leave one of each out" in problem.reason


def test_inputs_whose_positions_agree_but_not_their_velocities():
    angle = float(np.degrees(solved(twins(("A", 50), ("U", 50))).link("DC").angle))
    problem = refused(twins(("A", 50), ("D", angle), ("U", 50)))
    assert problem.outcome is Outcome.TOO_MANY_INPUTS
    assert "the velocities" in problem.reason
    assert "'A' and 'D' move one another" in problem.reason
    assert "mobility is 2" in problem.reason


def test_surplus_inputs_that_agree_are_no_error():
    alone = solved(twins(("A", 50), ("U", 50)))
    link = alone.link("DC")
    given = twins(("A", 50), ("U", 50))
    second = {
        "position": link.angle,
        "velocity": link.angular_velocity,
        "acceleration": link.angular_acceleration,
    }
    units = {"position": "rad", "velocity": "rad/s", "acceleration": "rad/s^2"}
    given["inputs"].append({"pair": "D"} | {what: f"{number!r} {units[what]}" for what, number in second.items()})
    both = solved(given)
    assert both.mobility == 2
    for name, each in alone.links.items():
        assert both.link(name).angular_velocity == pytest.approx(each.angular_velocity, abs=1e-12)


def test_an_input_that_cannot_move_is_accepted_at_rest_in_its_place():
    given = beside(("A", 50), ("U", BRACED))
    assert refused(given).outcome is Outcome.TOO_MANY_INPUTS
    assert "'U' cannot move" in refused(given).reason
    del given["inputs"][1]["velocity"]
    assert solved(given).mobility == 1


# input jammed


@pytest.mark.parametrize(
    ("given", "fast", "free"),
    [
        (beside(("U", 60)), {"f", "p"}, {"AB", "BC", "DC"}),
        (beside(("U", BRACED)), {"f", "p"}, {"AB", "BC", "DC"}),
        (beside(("P", 20)), {"p", "q"}, {"AB", "BC", "DC"}),
        (wheels(-1.0, ("O", 0)), {"f", "a"}, {"w"}),
        (wheels(-1.0, ("P", 30)), {"f", "b"}, {"w"}),
    ],
    ids=["a braced triangle", "in its place", "between its bars", "a ring of gears", "its second wheel"],
)
def test_an_input_at_what_is_held_fast_is_told_what_to_drive_instead(given, fast, free):
    mechanism = files.from_dict(given)
    assert planar.mobility(mechanism).gruebler == len(mechanism.inputs) == 1
    problem = refused(given)
    assert problem.outcome is Outcome.INPUT_JAMMED
    (pair,) = (each["pair"] for each in given["inputs"])
    parts = re.fullmatch(
        r"the input at '(\w)' cannot move: the pairs hold links (.*) fast, while links? (.*) (?:is|are) free; "
        r"drive (.*) instead",
        problem.reason,
    )
    assert parts.group(1) == pair
    assert [set(re.findall(r"'(\w+)'", parts.group(k))) for k in (2, 3)] == [fast, free]
    offered = re.findall(r"'(\w)'", parts.group(4))
    assert offered
    for other in offered:
        followed = copy.deepcopy(given)
        position = {"A": 50, "B": -20, "C": 60, "D": 100, "W": 5}[other]
        followed["inputs"] = [{"pair": other, "position": position, "velocity": "1 rad/s"}]
        state = solved(followed)
        assert state.mobility == 1
        assert state.pair(other)["relative_angular_velocity"] == pytest.approx(1.0, abs=1e-12)


def test_a_ring_of_gears_that_closes_is_not_jammed():
    assert solved(wheels(1.0, ("O", 20), ("W", 5))).link("b").angular_velocity == pytest.approx(-0.5)


# pairs that were forgotten


@pytest.mark.parametrize("point", "BD")
def test_a_pin_that_was_forgotten_is_named_with_the_links_that_it_would_join_and_mends_it(point):
    whole = mm_four_bar()
    part = whole | {"pairs": [pair for pair in whole["pairs"] if pair["turning"] != point]}
    with pytest.raises(NoAnswer) as refused:
        planar.solve(planar.from_dict(part))
    links = " and ".join(repr(name) for name, link in whole["links"].items() if point in str(link))
    assert f"no pair joins links {links} at {point!r}" in refused.value.reason
    advice = json.loads(re.search(r"add ({.*?}) to the pairs", refused.value.reason)[1])
    assert planar.solve(planar.from_dict(part | {"pairs": [*part["pairs"], advice]})).mobility == 1


@pytest.mark.parametrize(("point", "place"), [("A", "$.inputs[0].pair"), ("C", "$.sketch.C")])
def test_a_pin_that_was_forgotten_is_named_where_the_file_counts_on_it(point, place):
    whole = mm_four_bar()
    with pytest.raises(planar.BadInput) as refused:
        planar.from_dict(whole | {"pairs": [pair for pair in whole["pairs"] if pair["turning"] != point]})
    assert refused.value.place == place
    assert f'add {{"turning": "{point}"}} to the pairs' in refused.value.sentence


def test_a_guide_that_was_forgotten_leaves_a_link_that_hangs_by_one_pair():
    whole = mm_slider_crank()
    with pytest.raises(NoAnswer) as refused:
        planar.solve(planar.from_dict(whole | {"pairs": whole["pairs"][:2], "sketch": {}}))
    assert "link 'rod' hangs at 'A' alone: add the pair that joins it to the rest" in refused.value.reason


def test_names_that_stand_twice_by_chance_are_no_forgotten_pins():
    whole = mm_four_bar()
    for name in ("AB", "BC", "DC"):
        whole["links"][name]["points"] = {"G": [10, 0]}
    whole["pairs"] = [pair for pair in whole["pairs"] if pair["turning"] != "D"]
    with pytest.raises(NoAnswer) as refused:
        planar.solve(planar.from_dict(whole))
    assert "'G'" not in refused.value.reason


# very many names


def test_of_very_many_links_a_sentence_names_a_few_and_counts_the_rest_and_a_program_gets_all(tmp_path):
    """An arm of 100 links: 99 of them are free."""
    many = 100
    links = {"f": {"points": {"P0": [0, 0]}}}
    links |= {f"link number {k}": {"ends": [f"P{k}", f"P{k + 1}"], "length": 1} for k in range(many)}
    arm = value(links, pins([f"P{k}" for k in range(many)]), [("P0", 10)])
    with pytest.raises(NoAnswer) as refused:
        planar.solve(planar.from_dict(arm))
    assert len(str(refused.value)) < 1400
    assert f"and {many - 13} more can still move" in refused.value.reason
    assert refused.value.more["links"] == [f"link number {k}" for k in range(1, many)]
    told = json.loads(run(tmp_path, "solve", written(tmp_path, arm), "--json").out)
    assert len(told["links"]) == many - 1


def test_whatever_the_reason_is_made_of_it_is_bounded_and_one_line():
    for text in ("x" * 10**6, "a\nb\x1b[31m" * 10**4):
        problem = NoAnswer(Outcome.DEAD_POINT, text)
        assert len(problem.reason) < 3000
        assert str(problem).isprintable()


# what is not there


@pytest.mark.parametrize(
    ("key", "wrong", "offers"),
    [
        ("pairs", [{"turning": "A", "links": ["f", "4"]}], "links are f, AB, BC and DC"),
        ("pairs", [{"turning": "A", "links": ["f", "AB"], "points": ["Z", "A"]}], "its points are A and D"),
        ("frame", "4", "links are f, AB, BC and DC"),
        ("inputs", [{"pair": "Q4", "position": 1}], "pairs are A, B, C and D"),
        ("sketch", {"Q4": [1, 2]}, "points are A, D, B and C"),
    ],
)
def test_what_is_not_there_is_answered_with_what_there_is(key, wrong, offers):
    with pytest.raises(planar.BadInput) as refused:
        planar.from_dict(mm_four_bar() | {key: wrong})
    assert offers in refused.value.sentence


def test_of_very_many_names_that_there_are_a_few_are_listed():
    links = {f"l{k}": {"points": {"P": [0, 0]}} for k in range(50)}
    with pytest.raises(planar.BadInput) as refused:
        planar.from_dict({"planar": 1, "frame": "Q", "links": links, "pairs": []})
    assert refused.value.sentence.endswith("l10, l11 and 38 more")


def test_what_would_mend_it_is_looked_for_once_and_only_where_somebody_asks(monkeypatch):
    looked, search_for_one = [], remedy.describe_remedy
    monkeypatch.setattr(remedy, "describe_remedy", lambda *given: looked.append(given) or search_for_one(*given))
    apart = files.from_dict(mm_four_bar(theta=150) | {"name": "looked for once"})  # solved by no other test
    assert not planar.modes(apart, certify=False)
    assert len(planar.circuits(apart)) == 1
    assert not looked
    with pytest.raises(NoAnswer) as told:
        planar.solve(apart)
    with pytest.raises(NoAnswer) as again:
        planar.solve(apart)
    assert "it would go together with" in told.value.reason == again.value.reason
    assert len(looked) == 1


def test_a_range_whose_start_is_out_of_contact_is_refused_as_the_position_is(monkeypatch):
    monkeypatch.setattr("planar.solving.cycle.MAX_ARCS", 400)  # nothing else ends so long a way
    wheel = planar.load("rolling-wheel").with_values(
        {
            "frame.O.x": 0.01344,
            "frame.O.y": 0.02811,
            "wheel.length": 0.41017,
            "rod.length": 1.24066,
            "block B.B.x": -0.12831,
            "block B.B.y": 0.00416,
            "axle box.line.x": -0.02814,
            "axle box.line.y": 0.03025,
            "rail.radius": 0.09711,
            "axle box.position": 0.33437,
        }
    )
    with pytest.raises(planar.NoAnswer, match="from touching"):
        planar.cycle(wheel, 24)


@pytest.mark.parametrize("model", ["three-parallel-cranks", "coupled-wheels"])
def test_what_is_held_twice_wants_an_input_where_it_has_none(model):
    with pytest.raises(planar.NoAnswer) as refused:
        planar.solve(replace(planar.load(model), inputs=()))
    assert refused.value.outcome is planar.Outcome.TOO_FEW_INPUTS
    assert "give an input at" in refused.value.reason


# numbers that no mechanism has

EXTREMES = (1e15, -1e15, 1e12, 1e-15, -1e-15, 2.0**53)
KNOWN_EXTREMES = [
    ("rack-differential", "lower.position", 1e12),
    ("tipper", "chassis.A.x", 2.0**53),
    ("tipper", "stroke.position", -(2.0**53)),
    ("umbrella", "stroke.position", 1e16),
    ("elliptical-trammel", "across.position", 1e15),
    ("excavator-arm", "boom cylinder.position", 2.0**53),
    ("tangent-cam", "lift.noses.0.at.y", 1e12),
    ("tangent-cam", "lift.noses.0.at.x", -1e15),
]


def random_extremes(count):
    """Numbers of the smaller models, each at an extreme value (SI)."""
    rng = np.random.default_rng(5)
    small = [name for name, mechanism in MODELS.items() if len(mechanism.links) <= 8]
    for name in rng.choice(small, count):
        yield str(name), str(rng.choice(list(planar.dimensions(MODELS[name])))), float(rng.choice(EXTREMES))


@pytest.mark.parametrize(("model", "number", "size"), [*KNOWN_EXTREMES, *random_extremes(25 if is_exhaustive() else 8)])
def test_of_extreme_numbers_there_is_an_answer_or_a_sentence_and_no_warning(model, number, size, monkeypatch):
    def unguarded(setup, failure, links):
        return refusals._search_remedy(setup, failure, links)

    monkeypatch.setattr(refusals, "_remedy", unguarded)  # what it suppresses is seen here
    try:
        planar.solve(MODELS[model].with_values({number: size}))
    except planar.PlanarError as problem:
        assert len(str(problem).splitlines()) == 1


@pytest.mark.parametrize(
    ("model", "number", "size"),
    [
        ("scissor-lift", "frame.O.x", 2.0**53),
        ("excavator-arm", "bucket tube.I.y", 1e15),
        ("chain-42", "frame.A15.y", 1e16),
        ("coupled-wheels", "frame.C0.x", 1e-15),
    ],
)
def test_extreme_numbers_take_a_bounded_effort(model, number, size, monkeypatch):
    """One search for an assembly, and a remedy within its effort."""
    searches, steps, real = [], [], newton.damped_newton
    search = position.find_nearest_assembly

    def counted(*arguments, **options):
        result = real(*arguments, **options)
        steps.append(result.steps)
        return result

    for module in (block_assemblies, remedy):
        monkeypatch.setattr(module, "damped_newton", counted)
    monkeypatch.setattr(position, "find_nearest_assembly", lambda *given: searches.append(1) or search(*given))
    monkeypatch.setattr(remedy, "MAX_EFFORT", 300.0)
    with pytest.raises(NoAnswer) as problem:
        planar.solve(MODELS[model].with_values({number: size}))
    assert str(problem.value)
    assert len(searches) == 1
    assert sum(steps) < 1000


def test_a_refusal_has_its_text_where_the_search_for_a_remedy_fails(monkeypatch):
    def fail(*_):
        raise ZeroDivisionError

    monkeypatch.setattr(remedy, "describe_remedy", fail)
    reason = refused(mm_four_bar(theta=151) | {"name": "without a remedy"}).reason
    assert "change the input or a dimension of link" in reason


def test_the_search_for_an_assembly_stops_after_its_effort(monkeypatch):
    monkeypatch.setattr(nearest_assembly, "MAX_REPEATED_EFFORT", 10.0)
    monkeypatch.setattr(refusals, "_remedy", lambda *_: "change it")
    with pytest.raises(NoAnswer, match=r"the search stopped after \d+ steps"):
        planar.solve(MODELS["chain-42"].with_values({"frame.A15.y": 1e13}))


def test_a_search_that_stops_before_a_block_fails_says_so_too(monkeypatch):
    monkeypatch.setattr(nearest_assembly, "MAX_REPEATED_EFFORT", -1.0)
    monkeypatch.setattr(refusals, "_remedy", lambda *_: "change it")
    with pytest.raises(NoAnswer, match=r"the search stopped after \d+ steps"):
        planar.solve(planar.from_dict(mm_four_bar(theta=71)))


def test_a_dyad_out_of_reach_is_told_by_its_closed_form_not_by_all_starts(monkeypatch):
    # without it "closed to round-off" is met at this size by combinations of earlier blocks that are far from closed
    calls, damped = [], block_assemblies.damped_newton
    monkeypatch.setattr(
        block_assemblies, "damped_newton", lambda *arguments: calls.append(arguments[1]) or damped(*arguments)
    )
    with pytest.raises(NoAnswer) as problem:
        planar.solve(MODELS["chain-42"].with_values({"frame.A15.y": 2e13}))
    reason = problem.value.reason
    assert "search stopped" not in reason
    assert "would go together with frame.A15.y = 0 mm" in reason
    assert len(calls) < 200
    assert max(len(starts) for starts in calls) < 10  # those near the sketch alone


def test_where_a_text_is_no_json_is_said_once():
    with pytest.raises(planar.BadInput, match="Invalid control character at line 1, column 9"):
        planar.loads('{"a": "b\n')


@pytest.mark.parametrize("rod_ends", [["B", "S"], ["B", "Q"]])
def test_a_block_beside_a_link_that_was_to_slide_is_told_apart_from_it(rod_ends):
    """The sleeve hangs at the block's pin alone, together with the rod or without it."""
    links = {
        "frame": {"points": {"A": [0, 0]}},
        "AB": {"ends": ["A", "B"], "length": 30},
        "rod": {"ends": rod_ends, "length": 80},
        "sleeve": {"points": {"S": [0, 0], "T": [10, 0]}},
    }
    block = {"sliding": "slide", "on": "frame", "block": "S", "line": {"through": "A", "angle": 0}}
    given = {"planar": 1, "units": {"length": "mm", "angle": "deg"}, "frame": "frame", "links": links}
    given |= {"pairs": [{"turning": "A"}, {"turning": "B"}, block], "inputs": [{"pair": "A", "position": 50}]}
    reason = refused(given).reason
    assert "'block S' is a link of its own, pinned at 'S' to link 'sleeve'" in reason
    assert "name it in 'links' with \"point\": 'S'" in reason
