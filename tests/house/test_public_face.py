"""What callers meet: names that are exported, arguments that are taken, results that print, pickle and copy."""

import copy
import doctest
import inspect
import io
import json
import pickle
import sys
import tomllib
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from importlib import import_module
from importlib.util import find_spec
from multiprocessing import get_context
from pathlib import Path
from tempfile import TemporaryDirectory

import click
import numpy as np
import pytest

import planar
from planar.cli import main
from planar.document.answer_lists import AnswerList, HandedInValue
from planar.document.writer import write_mechanism
from planar.model.input_laws import SEGMENT_TYPES
from planar.model.pairs import pair_types
from planar.pages.editor.server import EditServer
from tests.command import run

ROOT = Path(planar.__file__).parent
FUNCTIONS = {
    name: each
    for name in planar.__all__
    if not inspect.isclass(each := getattr(planar, name)) and not inspect.ismodule(each)
}
DRAWINGS = {name: getattr(planar.plot, name) for name in planar.plot.__all__}
CLASSES = {name: each for name in planar.__all__ if inspect.isclass(each := getattr(planar, name))}
FREE = {
    "chains",
    "read_task",
    "synthesise",
    "task_schema",
    "write_task",
    "generate",
    "schema",
    "build",
    "pinned",
    "pinned_linkages",
    "centre_of",
    "from_dict",
    "load",
    "loads",
    "sweep_each",
    "save",
}
"""Functions whose first argument is neither a mechanism nor a result."""
COMMANDS = {
    name: command
    for name, command in main.load_commands().items()
    if any(isinstance(each, click.Argument) and each.name.startswith("model") for each in command.params)
}


def results():
    """Results of all kinds, by what they are."""
    slider, bars = planar.load("slider-crank"), planar.load("four-bar")
    state, motion, turn = planar.solve(slider), planar.cycle(slider, steps=24), planar.cycle(bars, steps=36)
    engine = planar.load("two-stroke-engine")
    run, listed, circuits = planar.cycle(engine, steps=60), planar.modes(bars), planar.circuits(bars)
    apart = planar.load("four-bar").with_values({"BC.length": 0.9, "BC.F.B": 0.5, "BC.F.C": 0.5})
    swept = planar.sweep_each([bars], steps=6)
    prepared = planar.prepared(bars, steps=6)
    yield from (slider, state, motion, planar.solve(planar.load("open-arm")), listed, listed[0], circuits, circuits[0])
    yield planar.tolerance(state, "stroke", {"rod.length": 1e-4})
    yield from (state.point("B"), state.link("rod"), state.relative("B", "A"), motion.point("B"), motion.link("rod"))
    yield from (motion.limits[0], circuits[0].branches[0], planar.inspect(slider), planar.mobility(slider))
    yield from (centres := planar.centres(state), next(iter(centres)) if hasattr(centres, "__iter__") else centres)
    yield from (
        planar.centrodes(motion, "rod"),
        planar.centre_path(motion, "rod"),
        planar.curvature(state, "rod"),
        planar.velocity_by_centres(centres, "B"),
    )
    yield from (planar.centre_of((0, 0), (1, 0), (0, 1), (-1, 0)), planar.stroke(motion, "stroke"))
    yield from (planar.swing(motion, "rod"), planar.extremes(turn, "E"), planar.greatest(motion, "stroke"))
    yield from (
        planar.time_ratio(motion, "stroke"),
        planar.transmission(turn, "DC"),
        planar.transmission(state, "stroke"),
    )
    yield from (planar.advantage(state, "stroke"), planar.advantage_over(motion, "stroke"), planar.area(motion, "E"))
    yield from (planar.dwells(motion, "stroke", within=0.1)[:1], planar.answers(motion, "stroke"))
    yield from (planar.harmonics(slider, "stroke"), forces := planar.forces(planar.solve(engine)), planar.forces(run))
    yield from (forces.reactions["stroke"], planar.flywheel(planar.forces(run)), planar.conflict(apart))
    yield from (
        planar.simulate("physical-pendulum", 0.05, steps=4),
        planar.sweep(bars, {"BC.length": [0.066]}, steps=6),
        planar.sweep(bars, {"BC.length": [0.066]}, steps=6, reduce={"path": "C.path_length"}),
    )
    yield planar.simulate("tipper", 0.3, steps=4).impacts[0]
    yield planar.simulate("physical-pendulum", 1.0, steps=1).oscillations["O"]
    train = replace(planar.load("planetary-gear-set"), loads=(planar.Load(link="arm", torque=-300.0),))
    yield planar.forces(planar.solve(train)).fixed_wheels["O"]
    yield from ((rubbed := planar.simulate("stick-slip", 0.005, steps=1)).friction_events[0], rubbed.rubbing["block"])
    yield planar.unknown_load(planar.solve("balanced-lamp"), "springs.0")
    yield planar.motor_duty(planar.forces(planar.solve("motor-press")))
    yield from (
        conditions := planar.balancing_conditions(engine),
        conditions.force,
        one := conditions.force.conditions[0],
    )
    yield from (one.terms[0], planar.CounterweightLimit(1.0, 0.05), planar.force_balance(engine))
    if find_spec("clarabel"):
        yield from (best := planar.balance(run), best.before, best.counterweights[0], planar.mass_balance(engine))
        yield planar.balance_tradeoff(run, ["crank", "rod"], count=2)
    yield from (planar.cam_profile("valve-cam"), planar.least_base_circle("valve-cam"))
    yield planar.contact_forces(planar.forces(planar.solve("cam-with-spring")))["lift"]
    yield from (swept, swept[0], prepared, prepared())
    yield prepared.gradient({"position": {"C": np.ones((7, 2))}}, of="BC.length")
    handed_in = AnswerList(7, (HandedInValue("Ann", 1, "velocity of C", 0.6, "m/s", 3),))
    marks = planar.mark_answers(bars, handed_in)
    yield from (marks, student := marks.students[0], student.values[0], planar.problem_variants(bars, 1)[0])
    clamp = planar.cycle(planar.load("toggle-clamp"), steps=40)
    yield from (planar.holding(clamp), planar.self_locking(clamp), planar.forces(clamp).friction["A"])
    grid = planar.force_map("excavator-arm", {"boom cylinder": (2.4, 2.9, 3)}, inertia=False)
    yield from (grid, grid.worst[0])
    measured = planar.cycle("crank-rocker", 11)
    path, inputs = {"A": measured.point("A").position}, {"A0": measured.inputs["A0"].position}
    fitted = planar.calibrate("crank-rocker", path, ["crank.length", "coupler.length"], inputs=inputs)
    yield from (fitted, fitted.unidentified[0], planar.Outlier(7, "B x", 8.5))
    wanted = {"point": "E", "through": [["0 mm", "0 mm"], ["20 mm", "12 mm"], ["42 mm", "15 mm"], ["63 mm", "8 mm"]]}
    steps = []
    task = {"planar": 1, "start": "four-bar", "wanted": [wanted]}
    found = planar.synthesise(task, many=1, progress=steps.append)
    yield from (found, found[0], found[0].motion, steps[0], found.task, found.task.wanted[0], found.task.demands)
    pairs = [[f"{a} deg", f"{b} deg"] for a, b in ((0, 0), (25, 14), (50, 33), (70, 51), (90, 75))]
    function = {"from": "A", "to": "D", "pairs": pairs}
    listed = planar.synthesise({"planar": 1, "start": "four-bar", "wanted": [function]}, complete=True)
    points = np.zeros((2, 1, 2))
    yield from (listed, listed[0], planar.FamilyCount(2, 9, 3))
    yield planar.DyadCurve("A", "B", 1, *points, np.zeros(0), np.zeros((3, 3, 3)))
    turned = {"from": "A", "to": "D", "pairs": [["0 deg", "0 deg"], ["20 deg", "31 deg"]]}
    posed = {"link": "BC", "poses": [{"at": ["0 mm", "1 mm"], "angle": "90 deg"}]}
    yield from planar.read_task({"planar": 1, "start": "four-bar", "wanted": [turned, posed]}).wanted
    slopes = planar.sensitivity(motion, "stroke")
    yield from (slopes, slopes.travel, slopes.travel.ends[0], slopes.influences("displacement")[0], slopes.transmission)
    yield from (planar.chains(8), chain := planar.chains(6)[0], chain.mechanisms()[0], chain.symmetry)
    with TemporaryDirectory() as folder:
        yield planar.generate(f"{folder}/four-bars.zarr", links=4, count=2, steps=4)
    yield planar.chain_of("four-bar")
    yield from (found := planar.cognates("four-bar", "E"), found[1], found[1].inputs[0])
    yield planar.convert("four-bar", to_format="pmks")
    yield from (made := planar.parts("four-bar"), made.pins[0], made.plates[0], made.spacers[0])
    yield from (planar.BadInput("here", "wrong"), planar.Unknown("no such point"), planar.Outcome.SOLVED)
    yield planar.NoAnswer(planar.Outcome.DEAD_POINT, "it stops", links=["a"])


@pytest.fixture(scope="module")
def made():
    return list(results())


def test_what_is_exported_is_there_once_and_typed():
    assert planar.__all__ == sorted(set(planar.__all__))
    known = {kind.__name__ for kind in (*pair_types().values(), *SEGMENT_TYPES.values())}
    assert known | {"InputLaw", "LinkLine", "Unknown", "dimensions", "build"} <= set(planar.__all__)
    assert not {path.stem for path in ROOT.glob("*.py")} & set(FUNCTIONS)
    assert issubclass(planar.Unknown, planar.PlanarError) and issubclass(planar.Unknown, KeyError)


def test_results_print_in_one_line_and_are_copied(made):
    """All of them in one test, since they take long to make."""
    for result in made:
        printed = repr(result)
        assert "\n" not in printed
        assert "object at 0x" not in printed
        for other in (pickle.loads(pickle.dumps(result)), copy.copy(result), copy.deepcopy(result)):
            assert type(other) is type(result)
            assert repr(other) == printed


def test_every_public_class_of_results_is_among_them(made):
    flat = [one for each in made for one in (each if type(each) is tuple else (each,))]
    shown = {kind for each in flat for kind in type(each).__mro__}
    rooms = ("planar.model", "planar.foundation")  # of what mechanisms are made of
    assert not {name for name, each in CLASSES.items() if each not in shown and not each.__module__.startswith(rooms)}


def test_a_pickled_motion_keeps_its_limits():
    motion = planar.cycle("slider-crank", steps=12)
    again = pickle.loads(pickle.dumps(motion))
    assert again.limits == motion.limits
    assert np.array_equal(again.point("B").position, motion.point("B").position)
    assert planar.stroke(again, "stroke") == planar.stroke(motion, "stroke")


def test_a_pool_runs_public_functions():
    with ProcessPoolExecutor(1, get_context("spawn")) as pool:
        (motion,) = pool.map(planar.cycle, ["four-bar"])
        assert repr(motion) == repr(planar.cycle("four-bar"))
        with pytest.raises(planar.BadInput, match="no model of that name"):
            list(pool.map(planar.cycle, ["no-such-model"]))


@pytest.mark.parametrize("wrong", [None, 3, {"links": {}}, ["four-bar"]], ids=repr)
def test_the_wrong_thing_is_bad_input(wrong):
    functions = FUNCTIONS | {f"plot.{name}": drawing for name, drawing in DRAWINGS.items()}
    names = functions.keys() - FREE - {"plot.save"}
    assert len(names) > 70
    for name in sorted(names):
        more = [
            "stroke"
            for parameter in list(inspect.signature(functions[name]).parameters.values())[1:]
            if parameter.default is parameter.empty and parameter.kind is not parameter.KEYWORD_ONLY
        ]
        try:
            functions[name](wrong, *more)
        except planar.BadInput as refusal:
            assert "is wanted, not" in str(refusal), name
        else:
            pytest.fail(f"{name} takes {wrong!r}")


def of_mechanism():
    """Functions of a mechanism alone."""
    for name, function in FUNCTIONS.items():
        first, *more = inspect.signature(function).parameters.values() or [None]
        alone = first and first.annotation.startswith("Mechanism") and name != "view"
        if alone and all(each.default is not each.empty for each in more):
            yield name


def function_of_cams(name):
    """Whether a function is of mechanisms with a cam."""
    return FUNCTIONS[name].__module__.startswith("planar.analysis.cams")


@pytest.mark.parametrize("name", sorted(of_mechanism()))
def test_a_path_or_a_models_name_is_a_mechanism(name, tmp_path):
    path = tmp_path / "m.json"
    model = "valve-cam" if function_of_cams(name) else "two-stroke-engine" if "balance" in name else "four-bar"
    path.write_text(json.dumps(write_mechanism(planar.load(model))))
    function = FUNCTIONS[name]
    first = next(iter(inspect.signature(function).parameters))
    assert repr(function(planar.load(path))) == repr(function(str(path))) == repr(function(**{first: path}))
    function(model)


def test_names_that_are_not_there_are_unknown():
    state, motion = planar.solve("four-bar"), planar.cycle("four-bar", steps=4)
    for ask in (state.point, state.link, state.pair, motion.point, motion.link, motion.pair):
        with pytest.raises(planar.Unknown):
            ask("nothing")
        with pytest.raises(KeyError):
            ask("nothing")


@pytest.mark.usefixtures("coarse_pictures")
@pytest.mark.parametrize("name", sorted(COMMANDS))
def test_every_command_of_a_model_takes_set_and_what_is_piped_in(name, tmp_path, monkeypatch, capfd):
    more = {
        "plot": ["scheme", "-o", "o.svg"],
        "view": ["-o", "o.html"],
        "edit": ["--no-browser"],
        "gallery": ["-o", "pages"],
        "animate": ["-o", "o.gif"],
        "simulate": ["--duration", "0.01s", "--steps", "2"],
        "bench": ["--seconds", "0"],
        "cycle": ["--steps", "4"],
        "problem": ["--vary", "2"],
        "mark": ["answers.csv"],
        "cognates": ["--of", "E"],
        "sensitivity": ["--of", "B"],
        "tolerance": ["--of", "B", "--general", "m"],
        "calibrate": ["measured.csv", "--free", "rod.length"],
    }
    run_of = planar.cycle(planar.load("slider-crank").with_values({"crank.length": 0.025}), 12)
    rows = zip(np.degrees(run_of.inputs["O"].position), 1e3 * run_of.pair("stroke")["displacement"], strict=True)
    lines = ["input O position [deg],pair stroke displacement [mm]", *(f"{at},{far}" for at, far in rows)]
    (tmp_path / "measured.csv").write_text("\n".join(lines))
    (tmp_path / "answers.csv").write_text("seed 1\nstudent,variant,quantity,value\nAnn,1,velocity of B,1\n")
    model = {
        "forces": "two-stroke-engine",
        "simulate": "physical-pendulum",
        "animate": "slider-crank",
        "cams": "valve-cam",
    }
    monkeypatch.setattr(EditServer, "serve_forever", lambda *_, **__: None)
    monkeypatch.chdir(tmp_path)
    piped = json.dumps(write_mechanism(planar.load(model.get(name, "slider-crank")))).encode()
    changed = {"simulate": "O.velocity=2rad/s", "cams": "lift.base_radius=30mm"}.get(name, "crank.length=25mm")
    for value, status in ((changed, 0), ("nothing=3", 2)):
        monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(piped)))
        with pytest.raises(SystemExit) as ended:
            main([name, "-", *more.get(name, []), "--set", value])
        assert ended.value.code in (status, None if status == 0 else status)
    assert "nothing: the mechanism has no number of that name" in capfd.readouterr().err


def test_inspect_lists_every_number(tmp_path):
    told = json.loads(run(tmp_path, "inspect", "four-bar", "--json", "--set", "BC.length=70mm").done())
    known = planar.dimensions("four-bar")
    assert list(told["dimensions"]) == list(known)
    assert told["dimensions"]["BC.length"] == {"value": 0.07, "unit": "m", "shown": "70 mm"}


def test_hints_name_the_distribution():
    project = tomllib.loads((ROOT.parent / "pyproject.toml").read_text())["project"]
    assert project["name"] == "planar-linkages"
    assert list(project["scripts"]) == ["planar"]
    for path in (*ROOT.rglob("*.py"), ROOT.parent / "README.md", ROOT.parent / "pyproject.toml"):
        text = path.read_text()
        assert "'planar[" not in text and '"planar[' not in text, path


EXAMPLES = sorted(path for path in ROOT.rglob("*.py") if ">>> " in path.read_text())


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_examples_in_docstrings(path):
    module = import_module(".".join(path.relative_to(ROOT.parent).with_suffix("").parts))
    found = doctest.testmod(module)
    assert found.attempted and not found.failed
