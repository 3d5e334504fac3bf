"""Circuits and branches as users meet them: the commands, the diagram, and which of how many a sketch means."""

import json
import subprocess
import sys
from functools import cache
from itertools import combinations, pairwise
from math import degrees, isclose, pi
from types import SimpleNamespace

import numpy as np
import pytest

import planar
from planar.assemblies.polynomial.completeness import Completeness
from planar.assemblies.selection import with_assembly_number
from planar.drawing.circuits.curves import BranchCurve, CircuitChart, InputWindow, MarkedAssembly
from planar.drawing.circuits.equal_curves import merge_equal_charts
from planar.drawing.labels.text_metrics import format_tick
from planar.model.wording import number_ranges
from tests import command
from tests.closed_forms import between
from tests.draws import first_cases, part
from tests.figures import text_boxes
from tests.fonts import own_fonts  # noqa: F401
from tests.known import MODELS

pytestmark = pytest.mark.filterwarnings("ignore::planar.foundation.errors.MissingGlyphs")
"""Names that no font here may have."""

LONG = "the pin of the rocker in the left bearing block"


def linkage(name, frame, links, pairs, driven, at, sketch):
    return {
        "planar": 1,
        "name": name,
        "units": {"length": "mm", "angle": "deg"},
        "frame": "frame",
        "links": {"frame": {"points": frame}, **{key: {"ends": e, "length": n} for key, (e, n) in links.items()}},
        "pairs": pairs,
        "inputs": [{"pair": driven, "position": at}],
        "sketch": sketch,
    }


CRANK, COUPLER, ROCKER, BASE = 50.0, 180.0, 120.0, 200.0
DRIVEN_ROCKER = linkage(
    "$x_{ 机构 " + "driven at its rocker " * 8,
    {"A0": [0, 0], LONG: [BASE, 0]},
    {"crank": (["A0", "A"], CRANK), "coupler": (["A", "B"], COUPLER), "rocker": ([LONG, "B"], ROCKER)},
    [{"turning": "A0"}, {"turning": LONG}, {"turning": "A"}, {"turning": "B"}],
    LONG,
    110,
    {"B": [160, 110]},
)
PISTON = linkage(
    "Engine driven by its piston",
    {"O": [0, 0]},
    {"crank": (["O", "A"], 50), "rod": (["A", "B"], 120)},
    [
        {"turning": "O"},
        {"turning": "A"},
        {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "O", "angle": 0}},
    ],
    "stroke",
    200,
    {"A": [30, 40]},
)
FILES = {"rocker.json": DRIVEN_ROCKER, "piston.json": PISTON}


def rocker_limits():
    """Where crank and coupler are in line, by the law of cosines (deg): two ranges, each from -180 to 180."""
    ends = []
    for reach in (COUPLER - CRANK, COUPLER + CRANK):
        inner = degrees(between(ROCKER, BASE, reach))
        ends += [180.0 - inner, inner - 180.0]
    return sorted(ends)


@pytest.fixture
def folder(tmp_path):
    for name, value in FILES.items():
        (tmp_path / name).write_text(json.dumps(value), encoding="utf-8")
    return tmp_path


@cache
def mechanism(name):
    return planar.from_dict(FILES[name]) if name in FILES else planar.load(name)


@cache
def found(name, pair=None):
    return planar.circuits(mechanism(name), pair)


@cache
def sheets(name, of=None, pair=None):
    return planar.plot.circuits(found(name, pair), of)


def panels(figure):
    return [axes for axes in figure.axes if axes.get_label().startswith("circuit ")]


def lines(axes, gid):
    return [np.array(line.get_data(), dtype=float) for line in axes.lines if line.get_gid() == gid]


def branches(axes):
    return [line for number in range(1, 20) for line in lines(axes, f"branch {number}")]


def texts(axes, gid):
    return [text.get_text() for text in axes.texts if text.get_gid() == gid]


def test_the_command_tells_limits_branches_and_assemblies_in_a_process_of_its_own(folder):
    value = json.loads(command.process(folder, "circuits", "rocker.json", "--json").done())
    ends = rocker_limits()
    told = [(each["low"], each["high"]) for circuit in value["circuits"] for each in circuit["branches"]]
    assert np.degrees(told) == pytest.approx(np.array([ends[2:], ends[2:], ends[:2], ends[:2]]), abs=1e-6)
    assert [[each["modes"] for each in circuit["branches"]] for circuit in value["circuits"]] == [[[1], [2]], [[], []]]
    assert value["nearest"] == 1
    assert np.degrees(value["assembles"]) == pytest.approx(np.array([ends[:2], ends[2:]]), abs=1e-6)
    assert sorted(each["assemblies"] for each in value["intervals"]) == [0, 0, 2, 2]


def test_the_table_says_what_the_values_are(folder):
    text = " ".join(command.run(folder, "circuits", "rocker.json").done().split())
    assert "2 circuits, numerically complete" in text
    for end in rocker_limits():
        assert f"{end:.6g}" in text
    assert "dead points 1, the nearest to the sketch" in text
    text = " ".join(command.run(folder, "circuits", "crank-rocker").done().split())
    assert "goes together all round" in text
    assert text.count("goes all round") == 2


def test_where_it_cannot_be_assembled_it_is_told_where_it_can(folder):
    done = command.run(folder, "circuits", "piston.json")
    assert "cannot be joined" in done.refused(1)
    assert "from -170 mm to -70 mm and 70 mm to 170 mm" in done.out
    done = command.run(folder, "circuits", "piston.json", "--json")
    value = json.loads(done.out)
    assert (done.status, value["outcome"]) == (1, "cannot be assembled")
    assert value["assembles"] == [pytest.approx(each, abs=1e-9) for each in ([-0.17, -0.07], [0.07, 0.17])]


@pytest.mark.parametrize("name", first_cases(["whitworth", "four-bar"]))
def test_assemblies_share_a_circuit_where_a_motion_leads_from_one_to_the_other(name, tmp_path):
    value = json.loads(command.run(tmp_path, "modes", name, "--circuits", "--json", "--no-certify").done())
    circuit = {each["number"]: each["circuit"] for each in value["modes"]}
    assert len({(each["circuit"], each["branch"]) for each in value["modes"]}) == len(circuit)
    modes = list(planar.modes(planar.load(name), certify=False))
    for one in modes:
        motion = planar.cycle(one.mechanism, circuit=True, steps=720)
        size = max(float(np.ptp(motion.point(point).position)) for point in one.points)
        for other in modes:
            away = [np.hypot(*(motion.point(point).position - at).T) for point, at in other.points.items()]
            met = np.max(away, axis=0).min() < 0.02 * size
            assert met == (circuit[one.number] == circuit[other.number])


def test_columns_of_circuit_and_branch_stand_in_the_list_of_assemblies(tmp_path):
    text = command.run(tmp_path, "modes", "four-bar", "--circuits", "--no-certify").done()
    head = next(line.split() for line in text.splitlines() if "branch" in line)
    rows = [line.split() for line in text.splitlines() if line.split()[:1] in (["1"], ["2"])][-2:]
    assert head.index("branch") == head.index("circuit") + 1
    assert [row[1:3] for row in rows] == [["1", "1"], ["1", "2"]]
    assert "circuit" not in command.run(tmp_path, "modes", "four-bar", "--no-certify").done()


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (("circuits", "four-bar", "--json", "-o", "a.txt"), "give one of the two"),
        (("circuits", "excavator-arm"), "several inputs"),
        (("circuits", "four-bar", "--input", "C"), "no input at 'C'"),
        (("modes", "four-bar", "--input", "A"), "without --circuits no input runs"),
        (("plot", "four-bar", "circuits", "-o", "a.png", "--from", "10deg"), "circuits does not use it"),
        (("plot", "four-bar", "circuits", "-o", "a.png", "--mode", "1"), "circuits does not use it"),
        (("plot", "four-bar", "circuits", "-o", "a.png", "--of", "Z"), "no pair, point or link of this name"),
        (("plot", "four-bar", "modes", "-o", "a.png", "--of", "DC"), "modes does not use it"),
    ],
)
def test_what_would_not_be_heeded_is_refused(words, sentence, tmp_path):
    assert sentence in command.run(tmp_path, *words).refused(2)


def test_every_curve_that_is_drawn_closes_the_loop():
    for axes in panels(sheets("rocker.json", "crank")[0]):
        drawn = branches(axes)
        assert len(drawn) == 2
        for rocker, crank in drawn:
            pin = BASE + ROCKER * np.cos(np.radians(rocker)), ROCKER * np.sin(np.radians(rocker))
            crank_pin = CRANK * np.cos(np.radians(crank)), CRANK * np.sin(np.radians(crank))
            assert np.hypot(pin[0] - crank_pin[0], pin[1] - crank_pin[1]) == pytest.approx(COUPLER, rel=1e-9)


@pytest.mark.parametrize("name", ["watt-six-bar", "four-bar"])
def test_a_drawing_has_dead_points_where_the_table_has_the_ends_of_branches(name):
    ends = {end for each in found(name) for branch in each.branches if not branch.turns for end in branch[1:3]}
    dots = {x for axes in panels(sheets(name)[0]) for marks in lines(axes, "dead point") for x in marks[0]}
    assert sorted({round(x, 6) for x in dots}) == pytest.approx(np.degrees(sorted(ends)), abs=1e-5)


@pytest.mark.parametrize(
    ("name", "of"), [("rocker.json", "crank"), ("drag-link", None), ("watt-six-bar", None), ("geared-five-bar", "QB")]
)
def test_no_line_leaps_and_what_leaves_at_one_side_comes_in_at_the_other(name, of):
    for axes in panels(sheets(name, of)[0]):
        wide, tall = np.ptp(axes.get_xlim()), np.ptp(axes.get_ylim())
        drawn = branches(axes)
        for line in drawn:
            steps = np.abs(np.diff(line))
            assert np.hypot(steps[0] / wide, steps[1] / tall).max() < 0.1
        if isclose(wide, 360.0):
            left, right = (
                [y for line in drawn for x, y in line.T if isclose(x, end, abs_tol=1e-9)] for end in axes.get_xlim()
            )
            number = int(axes.get_label().removeprefix("circuit "))
            turns = max(branch.turns for branch in found(name)[number - 1].branches)
            assert len(left) == len(right) >= turns  # a circuit that does not rotate fully need not be cut
            if not left:
                continue
            apart = (np.subtract.outer(left, right) + 180.0) % 360.0 - 180.0
            assert np.abs(apart).min(axis=1).max() < 1e-6


def test_dead_points_stand_at_the_ends_of_the_branches_with_the_inputs_position():
    ends = rocker_limits()
    for axes, own in zip(panels(sheets("rocker.json", "crank")[0]), (ends[2:], ends[:2]), strict=True):
        (dots,) = lines(axes, "dead point")
        assert sorted({round(x, 6) for x in dots[0]}) == pytest.approx(own, abs=1e-6)
        tips = np.concatenate([line[:, [0, -1]].T for line in branches(axes)])
        for tip in tips:
            assert np.abs(dots.T - tip).max(axis=1).min() < 1e-9
        assert texts(axes, "dead point") == [format_tick(float(f"{end:.4g}")) for end in own]


@pytest.mark.parametrize("name", ["rocker.json", "piston.json", "four-bar"])
def test_what_cannot_be_assembled_is_hatched_and_nothing_is_drawn_there(name):
    for axes in panels(sheets(name)[0]):
        gaps = [patch for patch in axes.patches if patch.get_gid() == "gap"]
        assert gaps
        assert all(patch.get_hatch() for patch in gaps)
        assert "cannot be assembled" in texts(axes, "gap")
        low, high = axes.get_xlim()
        shut = sum(patch.get_width() for patch in gaps)
        kind = 1e3 if name == "piston.json" else 180.0 / pi
        assert shut == pytest.approx(high - low - kind * sum(b - a for a, b in found(name).assembles), rel=1e-6)
        for line in branches(axes):
            for patch in gaps:
                inside = (line[0] > patch.get_x() + 1e-6) & (line[0] < patch.get_x() + patch.get_width() - 1e-6)
                assert not inside.any()


@pytest.mark.parametrize("name", ["four-bar", "watt-six-bar"])
def test_assemblies_of_the_file_are_marked_on_their_circuits(name):
    modes = planar.modes(mechanism(name), certify=False)
    circuits = found(name)
    link = "DC" if name == "four-bar" else "DD0"
    marked = 0
    for axes, circuit in zip(panels(sheets(name, link)[0]), circuits, strict=True):
        own = {mode.number: mode for mode in modes if circuits.of(mode)[0] is circuit}
        assert [text for text in texts(axes, "assembly") if text] == [str(number) for number in own]
        spots = [line for line in axes.lines if line.get_gid() == "assembly"]
        for line, mode in zip(spots, own.values(), strict=True):
            at = axes.transData.inverted().transform(axes.transAxes.transform(np.array(line.get_data()).ravel()))
            assert at[0] % 360.0 == pytest.approx(60.0, abs=1e-6)
            assert (at[1] - degrees(mode.state.link(link).angle) + 180.0) % 360.0 == pytest.approx(180.0, abs=0.1)
            filled = line.get_markerfacecolor() == "black"
            assert filled == (mode.number == modes.nearest.number)
            marked += 1
    assert marked == len(modes)


@pytest.mark.parametrize(("name", "link"), part([("watt-six-bar", "rocker"), ("jansen-leg", "c")], 2))
def test_left_out_the_output_is_one_that_tells_the_circuits_apart(name, link):
    # the link stands the same in circuits that differ in the last group of links only
    def least_distance(of):
        axes = panels(sheets(name, of)[0])
        spots = sorted(
            float(line.get_ydata()[0]) for each in axes for line in each.lines if line.get_gid() == "assembly"
        )
        return min((b - a for a, b in pairwise(spots)), default=0.0)  # assemblies at one place of a panel are one spot

    assert least_distance(link) < 1e-6
    assert least_distance(None) > 0.01


def test_of_a_point_there_is_a_sheet_for_x_and_one_for_y():
    x, y = sheets("four-bar", "C")
    circuit = found("four-bar")[0]
    for figure, k in ((x, 0), (y, 1)):
        drawn = np.concatenate([line[1] for line in branches(panels(figure)[0])])
        place = circuit.motion.point("C").position[:, k] * 1e3
        assert [drawn.min(), drawn.max()] == pytest.approx([place.min(), place.max()])


@pytest.mark.parametrize(
    ("name", "pair"),
    first_cases([("rocker.json", None), ("geared-five-bar", None), ("jansen-leg", None), ("piston.json", None)], 2),
)
def test_no_text_lies_on_another_or_leaves_the_sheet(name, pair):
    for figure in sheets(name, None, pair):
        (wide, high), shown = text_boxes(figure)
        for _, box in shown:
            assert min(box.x0, box.y0) >= 0.0
            assert box.x1 <= wide
            assert box.y1 <= high
        for (one, a), (other, b) in combinations(shown, 2):
            apart = a.x0 >= b.x1 - 0.5 or b.x0 >= a.x1 - 0.5 or a.y0 >= b.y1 - 0.5 or b.y0 >= a.y1 - 0.5
            assert apart, f"{one!r} lies on {other!r}"


def test_the_command_draws_it(folder, own_fonts):  # noqa: F811
    ended = command.run(folder, "plot", "rocker.json", "circuits", "-o", "a.svg")
    assert ended.status == 0
    assert "no installed font has 机" in ended.err
    text = (folder / "a.svg").read_text(encoding="utf-8")
    assert text.count('id="branch 1"') == 2
    assert "机" not in text


LARGE = ("ten-link", "chain-42", "walschaerts-valve-gear")
"""Models whose assemblies take longer to count than a remark is worth."""


@pytest.mark.parametrize(
    "file", part([stem for stem in MODELS if stem not in LARGE and MODELS[stem].closes_within is None], 4)
)
def test_the_remark_of_which_assembly_agrees_with_the_list(file):
    given = planar.load(file)
    told = [each for each in with_assembly_number(given).remarks if each not in given.remarks]
    modes = planar.modes(given, certify=False)
    said = f"assembly {modes.nearest.number} of {modes.total} at the file's inputs"
    sure = modes.complete is not Completeness.NOT
    assert [each[: len(said)] for each in told] == ([said] if modes.total > 1 and sure else [])


@pytest.mark.parametrize("file", LARGE)
def test_nothing_is_said_where_counting_takes_long(file):
    assert with_assembly_number(planar.load(file)) == planar.load(file)


@pytest.mark.parametrize("words", [("solve", "four-bar"), ("cycle", "four-bar"), ("explain", "four-bar")])
def test_commands_say_which_assembly_the_sketch_means(words, tmp_path):
    text = " ".join(command.run(tmp_path, *words).done().split())
    assert "assembly 1 of 2 at the file's inputs, the nearest to the sketch" in text
    text = " ".join(command.run(tmp_path, *words, "--mode", "2").done().split())
    assert "assembly 2: there are 2 assemblies" in text


def test_to_say_it_no_library_is_loaded_that_solving_does_without():
    code = (
        "import sys; from planar.cli import main; main(['solve', '000-P1'], standalone_mode=False); print(*sys.modules)"
    )
    ended = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert "of 2 at the file's inputs" in ended.stdout
    assert not set(ended.stdout.split()) & {"scipy", "flint", "networkx", "matplotlib"}


def curve_of(number, shift=0.0, branches=1, rows=200):
    """A circuit as it is drawn: a sine, in as many rows as asked."""
    x = np.linspace(0.0, 6.0, rows)
    branch = SimpleNamespace(turns=1)
    circuit = SimpleNamespace(number=number, closed=True, branches=[branch] * branches)
    return CircuitChart(
        circuit, (BranchCurve(1, x, np.sin(x) + shift),), (), (MarkedAssembly(number, 1.0, 0.5, number == 1),), False
    )


def test_circuits_that_look_the_same_are_drawn_once():
    shown = InputWindow(0.0, 6.0, False, (), 1.0)
    alike = [curve_of(1), curve_of(2, rows=317), curve_of(3, shift=0.1), curve_of(4, branches=2), curve_of(5)]
    found = merge_equal_charts(alike, shown)
    assert [[each.number for each in (chart.circuit, *chart.equal_circuits)] for chart in found] == [
        [1, 2, 5],
        [3],
        [4],
    ]
    assert [each.number for each in found[0].marked_assemblies] == [1, 2, 5]


@pytest.mark.parametrize(
    ("name", "link", "titles"),
    part([("watt-six-bar", "rocker", ["Circuits 1 and 2", "Circuit 3"]), ("scissor-lift", None, ["Circuits 1–8"])], 2),
)
def test_panels_of_circuits_that_look_the_same_are_one_with_their_numbers(name, link, titles):
    shown = [title for axes in panels(sheets(name, link)[0]) for title in texts(axes, "title")]
    assert [title.split(" of ")[0] for title in shown] == titles


def test_numbers_in_a_row_are_told_by_their_ends():
    assert number_ranges([3, 1, 2, 7, 9, 8, 12]) == "1–3, 7–9 and 12"
    assert number_ranges([1, 3, 5, 7]) == "1, 3, 5 and 7"
    assert number_ranges([4, 5]) == "4 and 5"
