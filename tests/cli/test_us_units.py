"""A mechanism in inches and pounds on every face: tables, lists, drawings, pages and sheets have no metric unit, and
say the same as those of the same mechanism in SI."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
import pytest

import planar
from planar.analysis.classroom.variants import problem_variants
from planar.drawing.output.problem_sheets import answer_pages, problem_pages
from planar.foundation.units import UnitError, parse_unit
from planar.model.file_units import FileUnits
from planar.pages.data.page_data import page_data
from planar.reports.files.run_formats import encode_run
from planar.reports.fitted_table import FittedTable
from planar.reports.tables.forces.forces_over_motion import force_series
from tests.command import run, written
from tests.figures import visible_texts
from tests.known import MODELS

METRIC = re.compile(r"(?:m|mm|cm|km|µm|N|kN|mN|W|kW|mW|J|kJ|mJ|kg)(?:[/·²³^].*)?")
"""A word that is a unit of metres, newtons, kilograms, or made of them."""
METRIC_IN_SCRIPTS = re.compile(r"""["'`](?:[^"'`]* )?(?:N|N·m|W|J|kg|m/s|m/s²|mm)["'`]""")
INCHES: dict[str, Any] = {
    **planar.to_dict(MODELS["engine-in-inches"]),
    "units": {"length": "in", "angle": "deg"},
    "inputs": [{"pair": "O", "position": 120, "velocity": "20 rad/s", "acceleration": "-3 rad/s^2"}],
    "loads": [{"point": "B", "force": [0, "-12 lbf"]}, {"link": "rod", "torque": "7 lbf in"}],
    "springs": [
        {"points": ["B", "O"], "stiffness": "20 lbf/in", "free_length": 6, "damping": "0.5 lbf s/in"},
        {"links": ["block", "rod"], "stiffness": "3 lbf in/rad", "damping": "0.2 lbf in s/rad"},
    ],
    "masses": [
        {"link": "block B", "mass": "2 lb", "at": "B"},
        {"link": "rod", "mass": "1.5 lb", "at": "G", "inertia": "12 lb in^2"},
    ],
    "gravity": [0, "-386.0886 in/s^2"],
}
"""It declares inches alone, so that everything else follows."""
FEET: dict[str, Any] = INCHES | {
    "units": {
        "length": "in",
        "angle": "deg",
        "velocity": "ft/s",
        "angular_velocity": "rpm",
        "angular_acceleration": "deg/s^2",
    }
    | {"force": "ozf", "torque": "ft*lbf", "mass": "slug", "moment_of_inertia": "lb ft^2", "stiffness": "lbf/ft"}
    | {"damping": "lbf s/ft", "power": "hp", "energy": "ft lbf"}
}
"""It declares other units than those that follow, no two of a size."""


def metric_words(text: str) -> list[str]:
    """Words of a text that are metric units."""
    words = (word.strip("()[],;:=$.").removeprefix("(") for word in re.split(r"[\s]|(?<=\w)/(?=mm\b)|\[", text))
    return [word for word in words if METRIC.fullmatch(word)] if len(text) > 1 else []  # W is a weight


@pytest.fixture
def inches(tmp_path: Path) -> str:
    return written(tmp_path, INCHES)


MODEL_IN_FEET = FileUnits(**FEET["units"])
AS_BUILT = {
    "forces press --fluctuation 0.05 --rim-radius 2ft --cycle --steps 12": "motor-press",
    "forces press --at O=230deg": "motor-press",
    "forces press --solve-for loads.0 --effort 90lbf*ft --at O=230deg": "motor-press",
    "forces clamp": "toggle-clamp",
    "forces clamp --cycle --steps 12": "toggle-clamp",
    "forces clamp --effort -40lbf*ft": "toggle-clamp",
    "forces jack": "screw-jack",
    "forces truck --at stroke=700mm": "tipper",
    "forces truck --solve-for masses.body --effort 5000lbf": "tipper",
    "simulate truck --duration 2s --steps 4": "tipper",
    "simulate press --duration 100ms --steps 4": "motor-press",
    "forces lamp --solve-for springs.0 --cycle --steps 4": "balanced-lamp",
}
"""Commands on models with motors, friction and stops, which are shown in feet and pounds."""
TABLES = [
    "solve --relative B,A",
    "cycle --steps 12 --of G",
    "cycle --steps 12 --duration 10ms --jerk",
    "forces",
    "forces --cycle --steps 12",
    "centres",
    "modes --point B",
    "circuits",
    "inspect",
    "harmonics --point G",
    "simulate --duration 20ms --steps 4",
    "explain",
    "problem --vary 2",
]


@pytest.mark.parametrize("words", [*TABLES, *AS_BUILT], ids=lambda words: words.split(" -")[0])
def test_tables_say_in_feet_and_inches_what_they_say_in_si(
    words: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    command, *options = words.split()
    whole = FEET
    if words in AS_BUILT:
        whole, options = planar.to_dict(replace(MODELS[AS_BUILT[words]], units=MODEL_IN_FEET, source=None)), options[1:]
    inches = written(tmp_path, whole)
    seen: list[FittedTable] = []
    draw = FittedTable.__rich_console__
    monkeypatch.setattr(FittedTable, "__rich_console__", lambda self, *more: (seen.append(self), draw(self, *more))[1])
    assert not metric_words(run(tmp_path, command, inches, *options, COLUMNS="80").done())
    if command in ("problem", "explain"):  # other numbers are round in other units; numbers stand in sentences
        return
    ours = [quantity for table in seen for quantity in quantities(table)]
    seen.clear()
    si = planar.to_dict(replace(planar.from_dict(whole), units=FileUnits("m", "deg")))
    run(tmp_path, command, written(tmp_path, si, "si.json"), *options, COLUMNS="80").done()
    theirs = [quantity for table in seen for quantity in quantities(table)]
    assert [place for place, _ in ours] == [place for place, _ in theirs]
    assert len(ours) > 5 or command in ("modes", "circuits", "centres")
    for (place, one), (_, other) in zip(ours, theirs, strict=True):
        assert one == pytest.approx(other, rel=5e-4, abs=1e-8), place


def quantities(table: FittedTable) -> Iterator[tuple[tuple[str, str, str], float]]:
    """Every number of a table that has a unit, in SI, with where it stands."""
    written = [k for k, column in enumerate(table.columns) if column.name == "unit"]
    for row in table.rows:
        for k, (column, cell) in enumerate(zip(table.columns, row, strict=True)):
            number, _, unit = str(cell).replace("−", "-").partition(" ")
            try:
                value = float(number)
            except ValueError:
                continue
            beside = [at for at in written if at == k + 1] or [at for at in written if at < k][-1:] or written[:1]
            of = unit.split(",")[0].split(" at ")[0] or column.unit or "".join(str(row[at]) for at in beside)
            yield ((table.title or "").split(",")[0], column.name, str(row[0])), value * size_of(of)


def size_of(unit: str) -> float:
    """How much a unit is in SI; of one that is none, one."""
    over, _, under = unit.partition(" per ")
    if under:
        return size_of(over) / size_of(under)
    by_input = re.fullmatch(r"(\w+)/(\w+)(²?)", unit)
    try:
        return parse_unit(unit).to_si(1.0)
    except UnitError:
        if by_input is not None:
            return size_of(by_input[1]) / size_of(by_input[2]) ** (2 if by_input[3] else 1)
        return parse_unit(unit[:-1]).to_si(1.0) ** 2 if unit.endswith("²") else 1.0


def test_lists_have_no_metric_unit_in_their_heads_and_json_is_si(inches: str, tmp_path: Path) -> None:
    run(tmp_path, "cycle", inches, "--steps", "4", "--jerk", "-o", "list.csv").done()
    clamp = replace(MODELS["toggle-clamp"], units=MODEL_IN_FEET)
    lists = [(tmp_path / "list.csv").read_text()]
    for mechanism in (planar.from_dict(INCHES), clamp):  # as the command writes them; its tables take long
        motion = planar.cycle(mechanism, 4)
        lists.append(encode_run(motion, ".csv", force_series(planar.forces(motion))).decode())
    of_run, of_forces, of_clamp = (text.splitlines()[0] for text in lists)
    assert "[in/s^2]" in of_run and "[in/s^2]" in of_forces
    assert "friction plunger heat [hp],without friction input O torque [ft lbf]" in of_clamp
    assert not any(metric_words(heads) for heads in (of_run, of_forces, of_clamp))
    found = json.loads(run(tmp_path, "solve", inches, "--json").done())
    state = planar.solve(planar.from_dict(INCHES))
    assert found["points"]["B"]["velocity"] == pytest.approx(state.point("B").velocity.tolist())


OF_A_POSITION = ("scheme", "velocity", "acceleration", "centres", "forces", "solution")
OF_A_MOTION = ("positions", "loci", "diagrams", "centrodes", "circuits", "torque", "bearings")


@pytest.mark.parametrize("what", [*OF_A_POSITION, *OF_A_MOTION])
def test_drawings_have_no_metric_unit(what: str) -> None:
    check_drawing(planar.from_dict(INCHES), what)


@pytest.mark.parametrize(
    ("model", "what"), [("motor-press", "torque"), ("toggle-clamp", "forces"), ("tipper", "scheme")]
)
def test_drawings_of_motors_friction_and_stops_have_none(model: str, what: str) -> None:
    check_drawing(replace(MODELS[model], units=MODEL_IN_FEET), what)


def check_drawing(mechanism: planar.Mechanism, what: str) -> None:
    source = planar.solve(mechanism) if what in OF_A_POSITION else mechanism
    found = getattr(planar.plot, what)(source)
    figures = found if isinstance(found, list) else [found]
    texts = [text for figure in figures for text, _ in visible_texts(figure)]
    for figure in figures:
        plt.close(figure)
    assert texts
    assert not [text for text in texts if metric_words(text)]


def test_a_scale_is_said_by_the_inch_of_paper() -> None:
    figure = planar.plot.scheme(planar.solve("pump-jack"), scale="1:50")
    assert any("1 in = 50 in" in text for text, _ in visible_texts(figure))
    assert "1 cm = 20 cm" in " ".join(
        text for text, _ in visible_texts(planar.plot.scheme(planar.solve("four-bar"), "1 cm = 20 cm"))
    )


def test_problem_sheets_and_answers_have_no_metric_unit() -> None:
    mechanism = planar.from_dict(INCHES)
    base, variants = planar.solve(mechanism), problem_variants(mechanism, 1, seed=7)
    texts = [
        text
        for pages in (problem_pages(base, variants, 7), answer_pages(base, variants, 7))
        for figure in pages
        for text, _ in visible_texts(figure)
    ]
    assert any("in/s" in text for text in texts)
    assert not [text for text in texts if metric_words(text)]


@pytest.mark.parametrize("model", ["motor-press", "toggle-clamp", "tipper"])
def test_pages_of_motors_friction_and_stops_have_no_metric_unit(model: str) -> None:
    data, _ = page_data(replace(MODELS[model], units=MODEL_IN_FEET, about=None, notes=(), source=None))
    assert not [text for text in strings({**data, "document": {}, "unit_choices": {}}) if metric_words(text)]


def test_pages_take_every_unit_from_their_data() -> None:
    data, _ = page_data(planar.from_dict(INCHES))
    shown = {kind: unit["name"] for kind, unit in data["units"].items()}
    assert (shown["force"], shown["torque"], shown["power"]) == ("lbf", "lbf·in", "lbf·in/s")
    assert data["paper"] == {"name": "in", "mm": 25.4}
    assert not [text for text in strings({**data, "document": {}, "unit_choices": {}}) if metric_words(text)]
    assert not [text for text in strings(data["document"]["value"]) if metric_words(text)]
    scripts = Path(planar.__file__).parent / "pages" / "assets"
    for script in scripts.rglob("*.js"):
        if script.parent.name != "uplot":
            code = re.sub(r"/\*.*?\*/|//[^\n]*", "", script.read_text(encoding="utf-8"), flags=re.DOTALL)
            assert not METRIC_IN_SCRIPTS.search(code), script


def strings(value: Any) -> Iterator[str]:
    """All texts of a JSON value that are no keys."""
    if isinstance(value, str):
        yield value
    for each in value.values() if isinstance(value, dict) else value if isinstance(value, list | tuple) else ():
        yield from strings(each)
