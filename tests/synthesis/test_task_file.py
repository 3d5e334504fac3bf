"""The form of a task's file: every mistake at its place, agreement with the schema, and what is written back."""

import io
import json
from copy import deepcopy
from dataclasses import fields
from math import inf

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from jsonschema import Draft202012Validator
from jsonschema.exceptions import best_match

import planar
from planar.foundation.errors import BadInput
from planar.synthesis.task.task_file import task_schema
from tests.command import run
from tests.documents import GONE
from tests.draws import draws
from tests.random_documents import LENGTHS, PIECES, SPELLED, UNITS, mutilated, places

VALIDATOR = Draft202012Validator(task_schema())
PATH = {"point": "E", "through": [[0, 25], {"at": [52, 10], "weight": 2}, [80, 4], [95, -20]], "in_order": True}
FULL = {
    "planar": 1,
    "name": "Lid",
    "units": {"length": "mm", "angle": "deg"},
    "start": ["four-bar", "four-bar"],
    "wanted": [
        PATH | {"tolerance": "0.5 mm"},
        {"point": "P", "on": "BC", "through": [{"at": [0, 1], "input": 3}], "absolute": True},
        {"link": "BC", "poses": [{"at": [0, 1], "angle": 10, "input": "0.2 rad", "weight": 0.5}]},
        {"from": "A", "to": "D", "pairs": [[0, 0], {"at": [20, 31], "weight": 3}], "tolerance": 1},
    ],
    "free": ["AB.length", "AD.D", "BC.P"],
    "within": {"AB.length": [20, 80], "AD.D": [None, "0.2 m"]},
    "demands": ["whole turn", "one branch", {"transmission": 30}, {"inside": [[0, 0], [200, 100]]}],
}
CHAINS = {"planar": 1, "start": {"chains": [4, 6]}, "wanted": [{"point": "P", "through": [[0, 1], [2, 1], [1, 3]]}]}
INLINE = {
    "planar": 1,
    "start": planar.to_dict("slider-crank"),
    "wanted": [{"from": "O", "to": "stroke", "pairs": [["0 deg", "0 m"], ["60 deg", "-0.2 m"]]}],
}
BASES = {"full": FULL, "chains": CHAINS, "inline": INLINE}

searching = settings(
    deadline=None, suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large, HealthCheck.filter_too_much]
)


def mistake(path, new, place, *words, of="full"):
    keys = [int(key) if key.isdigit() else key for key in path.split("/")] if path else []
    return pytest.param(of, keys, new, place, words, id=f"{of} {path or 'whole'}={str(new)[:40]}")


MISTAKES = [
    mistake("", [], "task", "a task's file", "list"),
    mistake("planar", GONE, "$", "'planar'", "missing"),
    mistake("planar", True, "$.planar", "format", "true"),
    mistake("strat", "four-bar", "$.strat", "unknown key", "'start'"),
    mistake("name", "a\nb", "$.name", "line"),
    mistake("name", 5, "$.name", "text"),
    mistake("units/length", "deg", "$.units.length", "length"),
    # what to start from
    mistake("start", GONE, "$", "'start'", "missing"),
    mistake("start", [], "$.start", "a mechanism to start from"),
    mistake("start", "four-baar", "$.start", "four-bar"),
    mistake("start", "x" * 5000, "$.start", "name of a file"),
    mistake("start/1", 5, "$.start[1]", "text"),
    mistake("start", {"planar": 1}, "$.start", "'frame'", "missing"),
    mistake("start/links/rod/length", -1, "$.start.links.rod.length", "above zero", of="inline"),
    mistake("start/inputs", [], "$.start", "no input", of="inline"),
    mistake("start/chains", [], "$.start.chains", "numbers of links", of="chains"),
    mistake("start/chains/0", 3, "$.start.chains[0]", "from 4 to 12", of="chains"),
    mistake("start/chains/0", 4.5, "$.start.chains[0]", "whole number", of="chains"),
    mistake("start/links", [4], "$.start.links", "unknown key", of="chains"),
    # what is wanted
    mistake("wanted", [], "$.wanted", "nothing is wanted"),
    mistake("wanted/0", {}, "$.wanted[0]", "'point'", "'link'", "'from'"),
    mistake("wanted/0/point", GONE, "$.wanted[0]", "'point'", "missing"),
    mistake("wanted/0/point", "e", "$.wanted[0].point", "no point 'e'", "'E'"),
    mistake("wanted/0/point", "A", "$.wanted[0].point", "frame"),
    mistake("wanted/0/on", "AB", "$.wanted[0].point", "'E'", "another link"),
    mistake("wanted/1/on", "AD", "$.wanted[1].on", "frame"),
    mistake("wanted/1/on", "CB", "$.wanted[1].on", "no link 'CB'"),
    mistake("wanted/1/point", "a.b", "$.wanted[1].point", "'.'"),
    mistake("wanted/0/through", [], "$.wanted[0].through", "places"),
    mistake("wanted/0/through/0", [1], "$.wanted[0].through[0]", "two numbers"),
    mistake("wanted/0/through/1/at", GONE, "$.wanted[0].through[1]", "'at'", "missing"),
    mistake("wanted/0/through/1/weight", 0, "$.wanted[0].through[1].weight", "above zero"),
    mistake("wanted/0/through/1/input", 5, "$.wanted[0].through", "entry 1 lacks it"),
    mistake("wanted/0/tolerance", -1, "$.wanted[0].tolerance", "above zero"),
    mistake("wanted/0/closed", "yes", "$.wanted[0].closed", "true or false"),
    mistake("wanted/1/closed", True, "$.wanted[1].through", "4 places"),
    mistake("wanted/2/link", "AD", "$.wanted[2].link", "frame"),
    mistake("wanted/2/poses", [], "$.wanted[2].poses", "poses"),
    mistake("wanted/2/poses/0/angle", GONE, "$.wanted[2].poses[0]", "'angle'", "missing"),
    mistake("wanted/2/poses/0/angle", "3 mm", "$.wanted[2].poses[0].angle", "angle"),
    mistake("wanted/3/from", "D", "$.wanted[3].from", "'A'"),
    mistake("wanted/3/to", "A", "$.wanted[3].to", "input itself"),
    mistake("wanted/3/to", "Q", "$.wanted[3].to", "no pair 'Q'"),
    mistake("wanted/3/pairs", [], "$.wanted[3].pairs", "[[0, 0], [20, 31]]"),
    mistake("wanted/3/pairs/0", [0], "$.wanted[3].pairs[0]", "two numbers"),
    mistake("wanted/3/pairs/1/weight", -1, "$.wanted[3].pairs[1].weight", "above zero"),
    mistake("wanted/0/pairs/0/1", "5 deg", "$.wanted[0].pairs[0][1]", "length", of="inline"),
    mistake("wanted/0/on", "b", "$.wanted[0].on", "chains", of="chains"),
    mistake(
        "wanted/0", {"link": "b", "poses": [{"at": [0, 0], "angle": 0}]}, "$.wanted[0].link", "chains", of="chains"
    ),
    mistake("wanted/0", {"from": "A", "to": "B", "pairs": [[0, 0]]}, "$.wanted[0].from", "chains", of="chains"),
    # what may change
    mistake("free", [], "$.free", "leave 'free' out"),
    mistake("free/0", "AB.lenght", "$.free[0]", "'AB.length'"),
    mistake("free/0", "A.position", "$.free[0]", "no number"),
    mistake("free", ["a.length"], "$.free[0]", "chains", of="chains"),
    mistake("within/AB.length", [80, 20], "$.within['AB.length']", "lower first"),
    mistake("within/AB.length", [20], "$.within['AB.length']", "lower"),
    mistake("within/AB.length", ["20 deg", 80], "$.within['AB.length'][0]", "length"),
    mistake("within/DC.length", [20, 80], "$.within['DC.length']", "'free'"),
    mistake("within/AD.D.x", [20, 80], "$.within['AD.D.x']", "already"),
    mistake("within/nothing", [20, 80], "$.within.nothing", "no number"),
    # what is demanded
    mistake("demands/0", "whole tern", "$.demands[0]", "'whole turn'"),
    mistake("demands/2", {}, "$.demands[2]", "demand"),
    mistake("demands/2/transmission", 95, "$.demands[2].transmission", "right angle"),
    mistake("demands/2/transmission", 0, "$.demands[2].transmission", "above zero"),
    mistake("demands/1", {"transmission": 40}, "$.demands[2].transmission", "already"),
    mistake("demands/3/inside", [[0, 0]], "$.demands[3].inside", "corners"),
    mistake("demands/3/inside", [[0, 0], [0, 5]], "$.demands[3].inside", "one line"),
    mistake("demands/3/inside", [[0, 0], [1, 1], [2, 2]], "$.demands[3].inside", "one line"),
    mistake("demands/3/inside", [[0, 0], [1, 1], [1, 0], [0, 2]], "$.demands[3].inside", "cross"),
    mistake("demands/3/inside", [[0, 0], [1, 1]] * 501, "$.demands[3].inside", "1000"),
]
UNSAID = (
    *("no such file", "name of a file", "has no input", "has no point", "has no link", "has no number", "no pair"),
    *("frame", "another link", "lacks it", "input itself", "the input that runs", "deg is", "is wanted, such as"),
    *("chains have no", "lower first", "needs no bounds", "already", "right angle", "one line", "cross"),
    *("a closed curve takes", "stands in a line", "too large", "is not a unit", "names contain none"),
)
"""What a schema cannot say, and the words by which the reader's sentences about it are known."""


def mistaken(of, path, new):
    value = deepcopy(BASES[of])
    if not path:
        return new
    holder = value
    for key in path[:-1]:
        holder = holder[key]
    if new is GONE:
        del holder[path[-1]]
    else:
        holder[path[-1]] = new
    return value


def refusal(value):
    """The error with which the reader refuses a value; None if it reads."""
    try:
        planar.read_task(value)
    except BadInput as problem:
        return problem
    return None


def wrong(value):
    """What the schema has against a value; None if nothing."""
    problem = best_match(VALIDATOR.iter_errors(value))
    return problem and f"{problem.json_path}: {problem.message[:500]}"


def same(one, other):
    """Whether two tasks are the same to the last bit."""

    def alike(first, second):
        if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
            return first.shape == second.shape and bool((first == second).all())
        if isinstance(first, tuple) and isinstance(second, tuple):
            return type(first) is type(second) and len(first) == len(second) and all(map(alike, first, second))
        return first == second

    return all(alike(getattr(one, each.name), getattr(other, each.name)) for each in fields(one))


def test_mistakes_are_refused_at_their_places_and_by_the_schema_where_that_can():
    for case in MISTAKES:
        name, path, new, place, words = case.values
        value = mistaken(name, path, new)
        problem = refusal(value)
        assert problem is not None, case.id
        assert problem.place == place, case.id
        for word in words:
            assert word in problem.sentence, case.id
        if wrong(value) is None:
            assert any(unsaid in problem.sentence for unsaid in UNSAID), f"{case.id}: {problem.sentence}"


@pytest.mark.parametrize("name", BASES)
def test_a_task_is_valid_and_written_back_is_the_same(name):
    assert wrong(BASES[name]) is None
    task = planar.read_task(BASES[name])
    value = planar.write_task(task)
    assert wrong(value) is None
    assert same(planar.read_task(json.loads(json.dumps(value))), task)
    assert same(planar.read_task(task), task)


def test_what_is_read_of_every_key():
    path, new, poses, function = planar.read_task(FULL).wanted
    assert (path.point, path.link, path.in_order, path.tolerance) == ("E", None, True, pytest.approx(5e-4))
    np.testing.assert_array_equal(path.weights, [1, 2, 1, 1])
    assert (new.link, new.is_absolute, new.inputs[0]) == ("BC", True, pytest.approx(np.radians(3)))
    assert (poses.weights[0], poses.inputs[0]) == (0.5, 0.2)
    np.testing.assert_array_equal(function.weights, [1, 3])
    task = planar.read_task(FULL)
    assert task.free == ("AB.length", "AD.D.x", "AD.D.y", "BC.P.x", "BC.P.y")
    assert task.within["AD.D.x"] == task.within["AD.D.y"] == (-inf, 0.2)
    assert task.demands.whole_turn and task.demands.one_branch
    with pytest.raises(ValueError, match="read-only"):
        path.places[0] = 0


def test_the_angles_of_poses_go_on_over_a_turn():
    poses = [{"at": [0, 0], "angle": each} for each in (170, -170, -150)]
    value = FULL | {"start": "four-bar", "wanted": [{"link": "BC", "poses": poses}]}
    del value["free"], value["within"]
    np.testing.assert_allclose(np.degrees(planar.read_task(value).wanted[0].angles), [170, 190, 210])


def test_what_names_are_is_asked_of_every_start(tmp_path):
    wanted = [{"point": "E", "through": [["0 m", "0 m"]]}]
    value = {"planar": 1, "start": ["four-bar", "slider-crank"], "wanted": wanted}
    planar.read_task(value)
    assert refusal(value | {"free": ["BC.length"]}).sentence.startswith("'Slider-crank' has no number")
    assert "'Slider-crank' has no link" in refusal(value | {"wanted": [wanted[0] | {"on": "BC"}]}).sentence
    assert "whole turn" in refusal({**INLINE, "demands": ["whole turn"]} | driven_at("stroke")).sentence


def driven_at(pair):
    start = deepcopy(INLINE["start"])
    start["inputs"] = [{"pair": pair, "position": "1.7 m"}]
    return {"start": start, "wanted": [{"point": "E", "through": [["0 m", "0 m"]]}]}


def test_points_and_pins_are_named_as_results_have_them():
    wanted = [{"point": "BC.E", "through": [["0 m", "0 m"]]}]
    assert planar.read_task({"planar": 1, "start": "four-bar", "wanted": wanted}).wanted[0].point == "E"
    start = {
        "planar": 1,
        "frame": "f",
        "links": {name: {"points": {"P": [0, 0]}} for name in "fab"},
        "pairs": [{"turning": "P", "links": ["f", "a", "b"]}],
        "inputs": [{"pair": "P:f,a", "position": 0}],
    }
    function = {"from": "P:f,a", "to": "P:f,b", "pairs": [[0, 0]]}
    assert planar.read_task({"planar": 1, "start": start, "wanted": [function]}).wanted[0].to_pair == "P:f,b"
    several = refusal({"planar": 1, "start": start, "wanted": [function | {"to": "P"}]})
    assert "joins several links" in several.sentence


def test_mechanisms_and_tasks_made_in_python_are_starts():
    mechanism = planar.load("four-bar")
    value = FULL | {"start": [mechanism, "four-bar"]}
    assert planar.read_task(value).starts == (mechanism, mechanism)
    made = planar.SynthesisTask("made", planar.read_task(FULL).wanted[:1], (mechanism,))
    assert same(planar.read_task(made), made)
    lost = planar.SynthesisTask("made", (made.wanted[0]._replace(point="Z"),), (mechanism,))
    assert refusal(lost).place == "$.wanted[0].point"
    uneven = made.wanted[0]._replace(weights=np.ones(2))
    assert refusal(planar.SynthesisTask("made", (uneven,), (mechanism,))).place == "$.wanted[0]"


def test_the_command_prints_the_schema_and_every_reference_leads_somewhere(tmp_path):
    printed = json.loads(run(tmp_path, "schema", "--task").done())
    assert printed == task_schema()
    Draft202012Validator.check_schema(printed)
    text = json.dumps(printed)
    assert text.count('"$ref"') == sum(text.count(f'"#/$defs/{name}"') for name in printed["$defs"])


def test_a_task_may_be_piped_in_and_no_file_is_told(tmp_path, monkeypatch):
    monkeypatch.setattr("sys.stdin", io.TextIOWrapper(io.BytesIO(json.dumps(FULL).encode())))
    assert planar.read_task("-").name == "Lid"
    for name in ("none.json", "x" * 5000, "", str(tmp_path)):
        assert refusal(name) is not None
    (tmp_path / "broken.json").write_text('{"planar": 1, "planar": 1}')
    assert "twice" in refusal(tmp_path / "broken.json").sentence
    for other in (None, 5, [FULL], b"{}"):
        assert refusal(other).place == "task"


# whatever is written


@st.composite
def tasks(draw):
    """The JSON value of some task of a four-bar."""
    timed, places_of = st.booleans(), st.tuples(SPELLED["length"], SPELLED["length"]).map(list)
    weight = st.one_of(st.just({}), LENGTHS.map(lambda x: {"weight": x}))

    def entries(**more):
        given = {"input": SPELLED["angle"]} if draw(timed) else {}
        kind = st.fixed_dictionaries({"at": places_of} | more | given)
        return draw(st.lists(st.tuples(kind, weight).map(lambda both: both[0] | both[1]), min_size=1, max_size=5))

    flags = st.fixed_dictionaries({}, optional={"in_order": st.booleans(), "absolute": st.booleans()})
    tolerance = st.one_of(st.just({}), LENGTHS.map(lambda x: {"tolerance": x}))
    pair = st.tuples(SPELLED["angle"], SPELLED["angle"]).map(list)
    wanted = [
        {"point": draw(st.sampled_from(["E", "F", "C", "BC.E"])), "through": entries()} | draw(flags) | draw(tolerance),
        {"link": draw(st.sampled_from(["BC", "DC"])), "poses": entries(angle=SPELLED["angle"])} | draw(flags),
        {
            "from": "A",
            "to": draw(st.sampled_from(["B", "C", "D"])),
            "pairs": draw(st.lists(pair, min_size=1, max_size=4)),
        },
    ]
    some = draw(st.lists(st.sampled_from(wanted), min_size=1, max_size=3, unique_by=id))
    bounds = draw(st.tuples(LENGTHS, LENGTHS).filter(lambda both: both[0] < both[1]))
    more = {
        "free": ["AB.length", "AD.D", "DC.length"],
        "within": {"AB.length": list(bounds), "AD.D.x": [None, bounds[1]]},
        "demands": [{"transmission": "30 deg"}, {"inside": [[0, 0], [bounds[0], bounds[1]]]}],
    }
    chosen = draw(st.sets(st.sampled_from(sorted(more))))
    value = {"planar": 1, "units": draw(UNITS), "start": "four-bar", "wanted": deepcopy(some)}
    return value | {key: more[key] for key in sorted(chosen)}


@settings(searching, max_examples=draws(60))
@given(tasks())
def test_any_task_is_valid_and_written_and_read_again_the_same(value):
    assert wrong(value) is None
    task = planar.read_task(value)
    written = planar.write_task(task)
    assert wrong(written) is None
    assert same(planar.read_task(json.loads(json.dumps(written))), task)


@settings(searching, max_examples=draws(200))
@given(st.sampled_from(sorted(BASES)), st.integers(1, 3), st.data())
def test_a_mutilated_task_is_read_or_refused_and_what_the_schema_refuses_the_reader_refuses(name, times, data):
    value = deepcopy(BASES[name])
    for _ in range(times):
        if places(value):
            mutilated(value, data.draw)
    problem = refusal(value)
    if problem is not None:
        assert str(problem).isprintable()
        assert len(str(problem)) < 1000
        return
    assert wrong(value) is None
    task = planar.read_task(value)
    assert same(planar.read_task(planar.write_task(task)), task)


@settings(searching, max_examples=draws(60))
@given(PIECES)
def test_any_value_at_all_is_refused_and_nothing_else(value):
    assert refusal(value) is not None
