"""Mechanisms that cannot run, each with every command: all say the sentence of one judgement."""

from __future__ import annotations

import json
from math import atan2, hypot, pi, sqrt
from typing import Any

import pytest

import planar
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.pages.data.page_data import page_data
from planar.pages.editor.answer import edit_answer
from tests import command

GROUND = {"points": {"O": [0, 0], "C": [4, 0]}}


def bar(ends: str, length: float) -> dict[str, Any]:
    return {"ends": list(ends), "length": length}


def document(links: dict[str, Any], pairs: str | list[Any], sketch: dict[str, Any], **inputs: Any) -> dict[str, Any]:
    """A mechanism file; `inputs` by their pairs, a position or a position and a velocity (rad/s)."""
    given = [
        {"pair": pair, "position": value[0], "velocity": f"{value[1]} rad/s"}
        if isinstance(value, tuple)
        else {"pair": pair, "position": value}
        for pair, value in inputs.items()
    ]
    return {
        "planar": 1,
        "frame": "g",
        "links": links,
        "pairs": [{"turning": each} if isinstance(each, str) else each for each in pairs],
        "inputs": given,
        "sketch": sketch,
        "masses": [
            {"link": name, "mass": 1, "at": [0, 0], "inertia": 1} for name in links if name not in ("g", "block A")
        ],
    }


def four_bar(coupler: float = 4, **inputs: Any) -> dict[str, Any]:
    links = {"g": GROUND, "a": bar("OA", 1), "b": bar("AB", coupler), "c": bar("CB", 3)}
    return document(links, "OABC", {"A": [0, 1], "B": [4, 3]}, **inputs)


def follower_angle() -> float:
    """The angle of the link c of the four-bar where its link a stands upright."""
    x, y = 4.0, -1.0
    along = (16.0 - 9.0 + 17.0) / (2.0 * sqrt(17.0))
    across = sqrt(16.0 - along * along)
    bx, by = (along * x - across * y) / sqrt(17.0), 1.0 + (along * y + across * x) / sqrt(17.0)
    assert hypot(bx - 4.0, by) == pytest.approx(3.0)
    return atan2(by, bx - 4.0)


TRIANGLE = {"g": GROUND, "a": bar("OA", 5), "b": bar("AC", 3)}
IN_LINE = {"g": GROUND, "a": bar("OA", 1), "b": bar("AC", 3)}
FLAT = {"g": GROUND, "a": bar("OA", 1), "b": bar("AB", 2), "c": bar("BC", 1)}
FIVE = {"g": GROUND, "a": bar("OA", 2), "b": bar("AB", 3), "c": bar("BD", 3), "d": bar("CD", 2)}
PARALLELOGRAM = {"g": GROUND, "a": bar("OA", 2), "b": bar("AB", 4), "c": bar("CB", 2)}
BLOCK = {"sliding": "s", "on": "g", "block": "A", "line": {"through": "O", "angle": 0.5}}
SLIDE = {"sliding": "s", "links": ["g", "b"], "line": {"through": "O", "angle": 0}, "point": "B"}
STOPPED = four_bar(O=1.5)
STOPPED["pairs"][3] = {"turning": "C", "stops": [2, 3]}
BOTH = "those at 'O' and 'C' move one another; leave one of them out"
NO_INPUT = "with 0 inputs links 'a', 'b' and 'c' can still move in 1 way; give an input at 'O'"
DEAD = "the input at 'C' cannot move links 'a' and 'b', whose velocity is not determined"
CROSSING = "links 'b' and 'c' may move in more than one way from here; move the input"
DONE = ""

COMMANDS = {
    "inspect": ("inspect", "M"),
    "solve": ("solve", "M"),
    "scheme": ("plot", "M", "scheme", "-o", "out.svg"),
    "modes": ("modes", "M", "--no-certify"),
    "cycle": ("cycle", "M", "--steps", "4"),
    "circuits": ("circuits", "M"),
    "simulate": ("simulate", "M", "--duration", "0.01s", "--steps", "2"),
    "parts": ("parts", "M"),
    "view": ("view", "M", "-o", "out.html"),
    "diagrams": ("plot", "M", "diagrams", "-o", "out.svg"),
    "positions": ("plot", "M", "positions", "-o", "out.svg"),
    "loci": ("plot", "M", "loci", "-o", "out.svg"),
    "animate": ("animate", "M", "-o", "out.gif"),
    "balance": ("balance", "M"),
    "tolerance": ("plot", "M", "sensitivity", "-o", "out.svg"),
    "forces": ("forces", "M", "--cycle", "--steps", "4"),
    "force map": ("plot", "M", "force-map", "-o", "out.svg"),
    "explain": ("explain", "M"),
    "polygon": ("plot", "M", "velocity", "-o", "out.svg"),
}
"""Every command that needs a position or a motion, as words of a command line about the model M."""


def structure(links: str, remedy: str) -> str:
    return f"nothing moves: it is a structure of {links} with the frame 'g' (mobility 0){remedy}"


STILL = dict.fromkeys(("solve", "scheme", "modes"), DONE)
WAYS: dict[str, tuple[dict[str, Any], Outcome, str, dict[str, str]]] = {
    "a bar and a block": (
        document({"g": {"points": {"O": [0, 0]}}, "a": bar("OA", 5)}, ["O", BLOCK], {"A": [4.4, 2.4]}, O=0.5),
        Outcome.STRUCTURE,
        structure("links 'a' and 'block A'", " at O = 0.5 rad; remove the input at 'O', or remove link 'block A' with"),
        STILL,
    ),
    "a slide beyond a bar, driven at a speed": (
        document(
            {"g": {"points": {"O": [0, 0]}}, "a": bar("OA", 5), "b": {"points": {"A": [0, 0], "B": [8, -4]}}},
            ["O", "A", SLIDE],
            {"A": [3, 4], "B": [11, 0]},
            O=(0.9272952180016122, 1.0),
        ),
        Outcome.STRUCTURE,
        structure("links 'a' and 'b'", " at O = 0.927295 rad; remove the input at 'O', or remove link 'b' with its"),
        {"modes": DONE},
    ),
    "a triangle": (
        document(TRIANGLE, "OAC", {"A": [4, 3]}, O="36.86989764584402 deg"),
        Outcome.STRUCTURE,
        structure("links 'a' and 'b'", " at O = 0.643501 rad; remove the input at 'O', or remove link 'b' with its"),
        STILL,
    ),
    "bars in a line that only just close": (
        document(IN_LINE, "OAC", {"A": [1, 0]}, O=0),
        Outcome.STRUCTURE,
        structure("links 'a' and 'b'", " at O = 0 rad; remove the input at 'O', or remove link 'b' with its"),
        STILL | {"forces": "at O = 0 rad"},
    ),
    "a four-bar whose bars in a line only just close": (
        document(FLAT, "OABC", {"A": [1, 0], "B": [3, 0]}, O=0),
        Outcome.STRUCTURE,
        structure("links 'a', 'b' and 'c'", " at O = 0 rad; remove the input at 'O', or remove link"),
        {"modes": DONE},
    ),
    "a structure without an input": (
        document(TRIANGLE, "OAC", {"A": [4, 3]}),
        Outcome.STRUCTURE,
        structure(
            "links 'a' and 'b'", " as drawn; remove link 'a' with its pairs 'O' and 'A' to let it move, and give"
        ),
        STILL | {"simulate": DONE, "explain": DONE, "polygon": DONE},
    ),
    "no input": (
        four_bar(),
        Outcome.TOO_FEW_INPUTS,
        NO_INPUT,
        {"inspect": "it has 0 driving links"}
        | dict.fromkeys(("solve", "scheme", "simulate", "explain", "polygon"), DONE),
    ),
    "too few inputs": (
        document(FIVE, "OABDC", {"A": [0, 2], "B": [2, 4], "D": [4, 2]}, O=1.5),
        Outcome.TOO_FEW_INPUTS,
        "with 1 input links 'b', 'c' and 'd' can still move in 1 way; give an input at 'A' or 'B'",
        {"inspect": "it has 1 driving link, and it moves in 2 ways", "simulate": DONE},
    ),
    "a link that nothing joins": (
        four_bar(O=1.5) | {"links": four_bar()["links"] | {"e": bar("PQ", 2)}},
        Outcome.TOO_FEW_INPUTS,
        "no chain of pairs joins link 'e' to the frame 'g'; add a pair",
        {"inspect": "nothing joins 'e' to the frame"},
    ),
    "an input in a rigid part": (
        document(TRIANGLE | {"d": bar("AD", 2)}, "OAC", {"A": [4, 3]}, O="36.86989764584402 deg"),
        Outcome.INPUT_JAMMED,
        "the input at 'O' cannot move: the pairs hold links 'g' and 'a' fast, while link 'd' is free",
        {"inspect": "the input at 'O' cannot move", "simulate": DONE},
    ),
    "two inputs that disagree": (
        four_bar(O=1.5, C=1.0),
        Outcome.TOO_MANY_INPUTS,
        BOTH,
        {"inspect": "it has 2 driving links, and it moves in 1 way"},
    ),
    "two inputs where one is enough": (
        four_bar(O=pi / 2, C=follower_angle()),
        Outcome.TOO_MANY_INPUTS,
        BOTH,
        STILL | {"inspect": "it has 2 driving links, and it moves in 1 way", "simulate": DONE, "forces": BOTH},
    ),
    "a coupler too long": (
        four_bar(20, O=1.5),
        Outcome.CANNOT_BE_ASSEMBLED,
        "at O = 1.5 rad links 'b' and 'c' cannot be joined: at the nearest, pair 'B' stays open by 12.9461 m",
        {},
    ),
    "a dead point at the start": (
        document(four_bar()["links"], "OABC", {"A": [0.8, 0.6], "B": [4, 3]}, C=(pi / 2, 1.0)),
        Outcome.DEAD_POINT,
        DEAD,
        dict.fromkeys(set(COMMANDS) - {"solve", "scheme", "simulate", "loci"}, DONE),
    ),
    "a change point at the start": (
        document(PARALLELOGRAM, "OABC", {"A": [2, 0], "B": [6, 0]}, O=(0.0, 1.0)),
        Outcome.CHANGE_POINT,
        CROSSING,
        dict.fromkeys(("inspect", "modes", "circuits", "view"), DONE),
    ),
    "beyond a stop": (
        STOPPED,
        Outcome.STOP,
        "at O = 1.5 rad pair 'C' is at 1.7205 rad, outside of its stops at 2 rad and 3 rad; move the input",
        {"inspect": DONE, "modes": DONE, "circuits": DONE},
    ),
}


FEW_COMMANDS = {
    "bars in a line that only just close": ("scheme", "cycle", "circuits", "simulate", "view", "animate"),
    "a four-bar whose bars in a line only just close": ("cycle",),
    "a dead point at the start": ("solve", "scheme", "modes", "cycle", "simulate", "parts"),
    "a change point at the start": ("solve", "scheme", "cycle", "simulate", "parts", "diagrams", "animate", "balance"),
}
"""Where commands take long, those that are asked."""


@pytest.mark.parametrize("way", WAYS)
def test_every_command_says_the_same_sentence(way, tmp_path):
    value, outcome, sentence, others = WAYS[way]
    (tmp_path / "M").write_text(json.dumps(value), encoding="utf-8")
    for name in FEW_COMMANDS.get(way, COMMANDS):
        ended = command.run(tmp_path, *COMMANDS[name])
        expected = others.get(name, sentence)
        if name == "inspect":
            assert (ended.status, ended.err) == (0, "")
            assert expected in " ".join(ended.out.split())
        elif expected:
            status = 0 if name == "view" and not value["inputs"] else 1
            assert expected in ended.refused(status), name
            assert expected is not sentence or ended.err.startswith(f"planar: {outcome.value}: "), name
        else:
            assert (ended.status, ended.err) == (0, ""), name


def refusals(value: dict[str, Any]) -> dict[str, NoAnswer]:
    """What the Python functions that need a motion raise."""
    mechanism = planar.from_dict(value)
    pair = mechanism.inputs[0].pair if mechanism.inputs else None
    calls = {
        "cycle": lambda: planar.cycle(mechanism, 4),
        "circuits": lambda: planar.circuits(mechanism),
        "parts": lambda: planar.parts(mechanism),
        "in time": lambda: planar.cycle(mechanism, 4, duration=1.0),
        "force map": lambda: planar.force_map(mechanism, [pair] if pair else []),
        "harmonics": lambda: planar.harmonics(mechanism, "A"),
    }
    found = {}
    for name, call in calls.items():
        try:
            call()
        except NoAnswer as problem:
            found[name] = problem
        except BadInput as problem:
            raise AssertionError(f"{name}: {problem}") from problem
    return found


@pytest.mark.parametrize("way", ["a bar and a block", "a triangle", "a structure without an input", "no input"])
def test_functions_raise_the_same_outcome_with_the_same_sentence(way):
    value, outcome, sentence, _ = WAYS[way]
    found = refusals(value)
    assert set(found) == {"cycle", "circuits", "parts", "in time", "force map", "harmonics"}
    for problem in found.values():
        assert problem.outcome is outcome
        assert sentence in problem.reason


@pytest.mark.parametrize("way", ["a bar and a block", "a triangle"])
def test_sweeps_report_a_structure_design_by_design(way):
    value, outcome, sentence, _ = WAYS[way]
    result = planar.sweep(planar.from_dict(value), {"a.length": [5.0]}, 4, "A")
    assert [result.outcomes[code] for code in result.status[0]] == [outcome] * 5
    assert sentence in " ".join(result.remarks)
    run = planar.prepared(planar.from_dict(value), 4, "A")({"a.length": 5.0})
    assert [[*Outcome][code] for code in run.status] == [outcome] * 5


@pytest.mark.parametrize("way", ["a structure without an input", "no input"])
def test_sweeps_without_an_input_are_refused(way):
    value, outcome, sentence, _ = WAYS[way]
    for call in (planar.sweep, planar.prepared):
        with pytest.raises(NoAnswer) as refused:
            call(planar.from_dict(value), *([{"a.length": [5.0]}] if call is planar.sweep else []), steps=4)
        assert refused.value.outcome is outcome
        assert sentence in refused.value.reason


@pytest.mark.parametrize("way", ["a bar and a block", "a triangle", "no input"])
def test_pages_are_drawn_and_say_that_nothing_moves(way, tmp_path):
    value, _, sentence, _ = WAYS[way]
    text = planar.view(planar.from_dict(value), tmp_path / "page.html").read_text(encoding="utf-8")
    assert sentence.replace("'", "&#x27;") in text
    assert '<svg id="drawing"' in text
    if value["inputs"]:
        data, _ = page_data(planar.from_dict(value))
        assert data["fixed"]
        assert data["unit_rates"] is None
    assert sentence in edit_answer(value)["problem"]


def test_without_an_input_a_mechanism_stands_as_it_is_drawn():
    mechanism = planar.from_dict(four_bar())
    state = planar.solve(mechanism)
    assert state.mobility == 1
    assert state.residual < 1e-14
    assert hypot(*(state.point("B").position - state.point("A").position)) == pytest.approx(4.0, abs=1e-12)
    assert all(not link.angular_velocity for link in state.links.values())
    assert any(NO_INPUT in remark for remark in state.remarks)
    # the nearest to the sketch of all positions of the run
    run = planar.cycle(planar.from_dict(four_bar(O=pi / 2)), 3600)
    gaps = sum(((run.point(name).position - at) ** 2).sum(axis=1) for name, at in (("A", [0, 1]), ("B", [4, 3])))
    gap = sum(((state.point(name).position - at) ** 2).sum() for name, at in (("A", [0, 1]), ("B", [4, 3])))
    assert gap == pytest.approx(gaps.min(), abs=1e-5)
    # two freedoms, and a slide that can be as it is sketched
    five = planar.solve(planar.from_dict(document(FIVE, "OABDC", {"A": [0, 2], "B": [2, 4], "D": [4, 2]})))
    assert (five.mobility, len(five.mechanism.inputs)) == (2, 2)
    slider = planar.solve(planar.from_dict(planar.to_dict("slider-crank") | {"inputs": []}))
    assert slider.point("B").position == pytest.approx([1.78, 0], abs=1e-6)


def test_a_simulation_without_an_input_is_that_of_one_that_is_not_driven():
    """A pendulum let go from the angle at which it is drawn: the same motion as from that angle as an input."""
    links = {"g": {"points": {"O": [0, 0]}}, "a": bar("OA", 1)}
    weight = {"gravity": [0, -9.81], "masses": [{"link": "a", "mass": 1, "at": [1, 0]}]}
    free = document(links, "O", {"A": [0.6, -0.8]}) | weight
    given = free | {"inputs": [{"pair": "O", "position": atan2(-0.8, 0.6)}]}
    first, second = (planar.simulate(planar.from_dict(value), 0.5, 10) for value in (free, given))
    assert first.motion.point("A").position == pytest.approx(second.motion.point("A").position, abs=1e-9)
    assert second.motion.point("A").position[-1, 0] < 0.55  # it has moved
