"""Runs as CSV, JSON, NumPy and Parquet files and as an xarray Dataset: every number, its unit, and what is left out."""

import csv
import io
import json
import sys
from dataclasses import replace

import numpy as np
import pyarrow.parquet
import pytest
import xarray as xr

import planar
from planar.document import files
from planar.foundation.errors import BadInput, Outcome
from planar.foundation.geometry import GROUND, frame_at
from planar.foundation.jets import Jet
from planar.foundation.units import SI_UNITS
from planar.model.pairs import pair_types
from planar.reports.columns import reported_series, run_columns
from planar.reports.files.csv import CSV_BLOCK_ROWS
from planar.reports.files.run_formats import check_writable, encode_run, record
from planar.results.records import InputMotion, Limit, ThirdRates
from tests.builders import four_bar
from tests.closed_forms import TRIPLE, TURN
from tests.command import run
from tests.command import written as in_file

MODELS = [
    "crank-rocker",
    "planetary-gear-set",
    "elliptical-trammel",
    "rack-steering",
    "chain-swing-arm",
    "whitworth",
]


def short_run(model):
    return short_run_of(planar.load(model))


def short_run_of(mechanism):
    return planar.cycle(mechanism, 6, pair=mechanism.inputs[0].pair)


def between_limits():
    """A run at both ends of which no rate is determined."""
    return planar.cycle(four_bar(*TRIPLE, 0.6), 12)


def timed(limits=(), rows=9):
    """A link of 200 mm whose angle is 0.5 + t^3, with time and third rates."""
    motion = planar.cycle(planar.load("single-link"), rows - 1)
    t = np.linspace(0.0, 1.0, rows)
    parts = (0.5 + t**3, 3.0 * t**2, 6.0 * t, np.full(rows, 6.0))
    frames, thirds = ({"frame": GROUND, "link": frame_at(0.0, 0.0, Jet(*parts[:count]))} for count in (3, 4))

    class Course:
        def limits(self, motion):
            return tuple(limits)

    inputs = {"O": InputMotion(*parts[:3])}
    return replace(motion, frames=frames, inputs=inputs, time=t, jerked=ThirdRates(thirds, {}), course=Course())


def jerk_of_turning(t):
    """The third derivative of r exp(i f) is r exp(i f) (i (f3 - f1^3) - 3 f1 f2), f1, f2, f3 those of the angle f."""
    first, second = 3.0 * t**2, 6.0 * t
    z = 0.2 * np.exp(1j * (0.5 + t**3)) * (1j * (6.0 - first**3) - 3.0 * first * second)
    return np.stack([z.real, z.imag], axis=1)


def things(motion):
    """Everything in a motion's own words: group, name, quantity, kind, values."""
    for name, given in motion.inputs.items():
        for what, kind, values in zip(given._fields, motion.input_quantity_kinds(name), given, strict=True):
            yield "inputs", name, what, kind, values
    for name, point in motion.points.items():
        for what, values in point._asdict().items():
            yield "points", name, what, "length" if what == "position" else what, values
    for name, link in motion.links.items():
        for what, values in link._asdict().items():
            yield "links", name, what, what.replace("_", " "), values
    for name, report in motion.pairs.items():
        for what, values in report.items():
            yield "pairs", name, what, motion.result_kinds(name)[what], values


def table_of(content):
    """Heads with their cells, as any reader of CSV finds them, the apostrophe taken off that marks a text."""
    heads, *rows = csv.reader(io.StringIO(content.decode(), newline=""))
    heads = [head.removeprefix("'") for head in heads]
    assert len(set(heads)) == len(heads)
    assert {len(row) for row in rows} == {len(heads)}
    return dict(zip(heads, zip(*rows, strict=True), strict=True))


def numbers(cells):
    return np.array([float(cell) if cell else np.nan for cell in cells])


def parquet_of(motion):
    return pyarrow.parquet.read_table(io.BytesIO(encode_run(motion, ".parquet")))


def strict(word):
    raise AssertionError(f"{word} is no JSON")


# what the command line writes


def limits_file(folder):
    value = json.loads(json.dumps(files.to_dict(four_bar(*TRIPLE, 0.6))))
    value["units"] = {"length": "mm", "angle": "deg"}
    for link, length in zip(("AB", "BC", "DC"), (900, 700, 850), strict=True):
        value["links"][link]["length"] = length
    value["links"]["AD"]["points"]["D"] = [1500, 0]
    value["links"]["BC"]["points"]["E"]["distance"] = 280
    value["inputs"] = [{"pair": "A", "position": 30, "velocity": "2 rad/s"}]
    value["sketch"] = {"C": [1000, 800]}
    return in_file(folder, value)


def test_a_run_is_written_as_csv_in_the_units_of_its_file(tmp_path):
    name = limits_file(tmp_path)
    assert "positions" in run(tmp_path, "cycle", name, "--steps", "12", "-o", "m.csv").done()
    motion = planar.cycle(planar.load(tmp_path / name), 12)
    heads, *rows = csv.reader(io.StringIO((tmp_path / "m.csv").read_text(encoding="utf-8")))
    assert len(rows) == 13
    columns = dict(zip(heads, zip(*rows, strict=True), strict=True))
    assert len(columns) == len(heads)
    wanted = {
        "input A position [deg]": np.degrees(motion.inputs["A"].position),
        "input A velocity [rad/s]": motion.inputs["A"].velocity,
        "input A acceleration [rad/s^2]": motion.inputs["A"].acceleration,
        "C x [mm]": 1e3 * motion.point("C").position[:, 0],
        "C y [mm]": 1e3 * motion.point("C").position[:, 1],
        "E vx [m/s]": motion.point("E").velocity[:, 0],
        "E ay [m/s^2]": motion.point("E").acceleration[:, 1],
        "BC angle [deg]": np.degrees(motion.link("BC").angle),
        "DC angular velocity [rad/s]": motion.link("DC").angular_velocity,
        "DC angular acceleration [rad/s^2]": motion.link("DC").angular_acceleration,
        "pair C relative angular velocity [rad/s]": motion.pair("C")["relative_angular_velocity"],
    }
    for head, values in wanted.items():
        found = [float(cell) if cell else np.nan for cell in columns[head]]
        np.testing.assert_allclose(found, values, rtol=1e-14, atol=1e-300)
    # where no rate is determined the cell is blank, not a number that says so
    assert columns["DC angular velocity [rad/s]"][0] == columns["E ay [m/s^2]"][-1] == ""
    assert not any("nan" in cell.lower() for row in rows for cell in row)
    assert not any(head.startswith("AD ") for head in heads)


def test_a_run_is_written_as_json_and_npz_in_si(tmp_path):
    name = limits_file(tmp_path)
    for output in ("run.json", "run.npz"):
        assert "positions" in run(tmp_path, "cycle", name, "--steps", "12", "-o", output).done()
    printed = json.loads(run(tmp_path, "cycle", name, "--steps", "12", "--json").done(), parse_constant=strict)
    told = json.loads((tmp_path / "run.json").read_text(encoding="utf-8"), parse_constant=strict)
    assert told == printed
    motion = planar.cycle(planar.load(tmp_path / name), 12)
    assert (told["outcome"], told["reason"], told["mechanism"]) == ("solved", motion.reason, "four-bar")
    assert told["residual"] == motion.residual
    with np.load(tmp_path / "run.npz", allow_pickle=False) as arrays:
        for group in ("inputs", "links", "points"):
            assert set(told[group]) == set(getattr(motion, group))
            for key, each in getattr(motion, group).items():
                for what, values in each._asdict().items():
                    np.testing.assert_array_equal(np.array(told[group][key][what], dtype=float), values)
                    np.testing.assert_array_equal(arrays[f"{group}/{key}/{what}"], values)
        np.testing.assert_array_equal(
            arrays["pairs/C/relative_angular_velocity"], motion.pair("C")["relative_angular_velocity"]
        )
        assert not any(name.endswith("rubbing_speed") for name in arrays)  # no pin has a radius
    assert told["links"]["DC"]["angular_velocity"][0] is None
    assert told["pairs"]["C"]["rubbing_speed"] is None
    assert np.shape(told["points"]["C"]["velocity"]) == (13, 2)


def test_a_slides_columns_have_units_of_length(tmp_path):
    model = ("elliptical-trammel", "--steps", "4", "--from", "80mm", "--to", "0.1 m")
    run(tmp_path, "cycle", *model, "-o", "m.csv").done()
    heads, *rows = csv.reader(io.StringIO((tmp_path / "m.csv").read_text(encoding="utf-8")))
    columns = dict(zip(heads, zip(*rows, strict=True), strict=True))
    np.testing.assert_allclose([float(x) for x in columns["input across position [mm]"]], [80, 85, 90, 95, 100])
    assert "input across velocity [m/s]" in columns
    np.testing.assert_allclose(
        [float(y) for y in columns["pair up displacement [mm]"]],
        np.sqrt(120.0**2 - np.array([80, 85, 90, 95, 100]) ** 2),
        rtol=1e-12,
    )


def test_a_run_is_written_as_parquet_by_the_command_line(tmp_path):
    name = limits_file(tmp_path)
    for output in ("m.parquet", "m.csv"):
        assert "positions" in run(tmp_path, "cycle", name, "--steps", "12", "-o", output).done()
    read = pyarrow.parquet.read_table(tmp_path / "m.parquet")
    cells = table_of((tmp_path / "m.csv").read_bytes())
    assert read.column_names == list(cells)
    assert read.num_rows == 13
    for head, column in zip(read.column_names, read.columns, strict=True):
        np.testing.assert_array_equal(column.to_numpy(), numbers(cells[head]))


# every number in every format, against the motion's own


@pytest.mark.parametrize("model", MODELS)
def test_a_table_has_every_number_of_a_run_under_a_head_of_its_own(model):
    motion = short_run(model)
    assert motion.mechanism.units[:2] == ("mm", "deg")
    wanted = {}
    for group, name, what, kind, values in things(motion):
        word, of = what.replace("_", " "), name if group in {"points", "links"} else f"{group[:-1]} {name}"
        letter = {"position": "", "velocity": "v", "acceleration": "a"}.get(what)
        if values is None or (group, name) == ("links", motion.mechanism.frame):
            continue
        if group == "points":
            wanted |= {f"{of} {letter}{axis}": (kind, part) for axis, part in zip("xy", values.T, strict=True)}
        else:
            wanted[f"{of} {word}"] = kind, values
    own = {"length": "mm", "angle": "deg"}
    cells = table_of(encode_run(motion, ".csv"))
    assert list(cells) == [f"{name} [{own.get(kind, SI_UNITS[kind])}]" for name, (kind, _) in wanted.items()]
    for found, (kind, values) in zip(cells.values(), wanted.values(), strict=True):
        size = {"length": 1e3, "angle": 180.0 / np.pi}.get(kind, 1.0)
        np.testing.assert_allclose(numbers(found), size * values, rtol=1e-15, atol=0)


@pytest.mark.parametrize("model", MODELS)
def test_parquet_is_read_back_equal_and_says_its_units(model):
    motion = short_run(model)
    read = parquet_of(motion)
    wanted = list(run_columns(motion))
    assert read.column_names == [column.head for column in wanted] == list(table_of(encode_run(motion, ".csv")))
    for column, found, field in zip(wanted, read.columns, read.schema, strict=True):
        np.testing.assert_array_equal(found.to_numpy(), column.values)
        assert field.metadata[b"unit"].decode() == column.unit
        assert field.metadata[b"quantity"].decode() == column.kind
        assert field.name.endswith(f"[{column.unit}]")


@pytest.mark.parametrize("model", MODELS)
def test_numpy_reads_back_every_number_with_its_unit(model):
    motion = short_run(model)
    with np.load(io.BytesIO(encode_run(motion, ".npz")), allow_pickle=False) as arrays:
        units = dict(arrays["units"])
        assert set(units) == set(arrays) - {"units", "mechanism", "outcome", "reason"}
        seen = 0
        for group, name, what, kind, values in things(motion):
            if values is not None:
                np.testing.assert_array_equal(arrays[f"{group}/{name}/{what}"], values)
                assert units[f"{group}/{name}/{what}"] == SI_UNITS[kind]
                seen += 1
        assert seen == len(units)


@pytest.mark.parametrize("model", MODELS)
def test_json_has_every_number_of_a_run(model):
    motion = short_run(model)
    found = json.loads(encode_run(motion, ".json"), parse_constant=strict)
    assert found == record(motion)
    assert found["units"] == "SI"
    assert found["limits"] == [each._asdict() for each in motion.limits]
    seen = 0
    for group, name, what, _, values in things(motion):
        if values is None:
            assert found[group][name][what] is None
        else:
            np.testing.assert_array_equal(np.array(found[group][name][what], dtype=float), values)
        seen += 1
    assert seen == sum(len(each) for group in ("inputs", "links", "points", "pairs") for each in found[group].values())


@pytest.mark.parametrize("model", MODELS)
def test_a_dataset_has_every_number_of_a_run_with_its_unit(model):
    motion = short_run(model)
    found = planar.dataset(motion)
    assert isinstance(found, xr.Dataset)
    assert found.sizes["row"] == len(motion)
    seen = 0
    for group, name, what, kind, values in things(motion):
        if values is None:
            continue
        one, word = group[:-1], what.replace("_", " ")
        if group == "inputs":
            variable, row = found[f"input_{name}_{what}"], found[f"input_{name}_{what}"]
            word = f"input {name} {word}"
            assert (f"input_{name}_{what}" in found.coords) == (what == "position")
        else:
            variable = found[f"{one}_{what}"]
            row = variable.sel({one: name})
            assert variable.dims == (one, "row", "axis")[: variable.ndim]
        np.testing.assert_array_equal(row, values)
        assert variable.attrs == {"units": SI_UNITS[kind], "long_name": word}
        seen += np.isfinite(values).sum()
    # where a pair has no such quantity there is no number, and there are none but the run's
    names = [*found.data_vars, *(name for name in found.coords if name.startswith("input_"))]
    assert sum(int(np.isfinite(found[name]).sum()) for name in names) == seen


def test_one_selects_from_a_dataset_by_names_and_by_the_input():
    motion = short_run("crank-rocker")
    rocker = planar.dataset(motion).link_angle.sel(link="rocker").swap_dims(row="input_A0_position")
    third = motion.inputs["A0"].position[0] + TURN / 3
    assert float(rocker.sel(input_A0_position=third, method="nearest")) == motion.link("rocker").angle[2]


def test_the_name_of_a_result_is_one_kind_of_quantity_in_all_pairs():
    """Or no unit could be given to a variable of several pairs."""
    kinds = {}
    for pair in pair_types().values():
        for what, kind in pair.result_kinds.items():
            assert kinds.setdefault(what, kind) == kind


@pytest.mark.parametrize("stop", [100.0, 60.0])
def test_how_a_run_ended_is_told_in_every_format_that_holds_texts(stop):
    motion = planar.cycle(planar.load("triple-rocker"), 12, stop=np.radians(stop))
    assert (motion.outcome is Outcome.SOLVED) == (stop < 70.0)
    about = {"mechanism": motion.mechanism.name, "outcome": motion.outcome.value, "reason": motion.reason}
    assert about.items() <= record(motion).items()
    assert planar.dataset(motion).attrs == about
    with np.load(io.BytesIO(encode_run(motion, ".npz")), allow_pickle=False) as arrays:
        assert {each: str(arrays[each]) for each in about} == about
    assert {each.decode(): text.decode() for each, text in parquet_of(motion).schema.metadata.items()} == about


# time, jerk, limits


def test_time_and_jerk_are_in_every_format():
    motion = timed()
    jerk, turning = jerk_of_turning(motion.time), np.full(9, 6.0)
    cells = table_of(encode_run(motion, ".csv"))
    heads = list(cells)
    assert heads[0] == "time [s]"
    assert heads[heads.index("P ay [m/s^2]") + 1 :][:2] == ["P jx [m/s^3]", "P jy [m/s^3]"]
    assert heads[heads.index("link angular acceleration [rad/s^2]") + 1] == "link angular jerk [rad/s^3]"
    np.testing.assert_array_equal(numbers(cells["time [s]"]), motion.time)
    for axis, head in enumerate(("P jx [m/s^3]", "P jy [m/s^3]")):
        np.testing.assert_allclose(numbers(cells[head]), jerk[:, axis], rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(numbers(cells["link angular jerk [rad/s^3]"]), turning)

    read = parquet_of(motion)
    assert read.column_names == heads
    for head in heads:
        np.testing.assert_array_equal(read[head].to_numpy(), numbers(cells[head]))

    found = json.loads(encode_run(motion, ".json"))
    assert found == record(motion)
    assert found["time"] == motion.time.tolist()
    np.testing.assert_allclose(found["points"]["P"]["jerk"], jerk, rtol=1e-12, atol=1e-12)
    assert found["links"]["link"]["angular_jerk"] == turning.tolist()
    assert found["links"]["frame"]["angular_jerk"] == [0.0] * 9

    with np.load(io.BytesIO(encode_run(motion, ".npz")), allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays["time"], motion.time)
        np.testing.assert_allclose(arrays["points/P/jerk"], jerk, rtol=1e-12, atol=1e-12)
        np.testing.assert_array_equal(arrays["links/link/angular_jerk"], turning)
        units = dict(arrays["units"])
    assert (units["time"], units["points/P/jerk"], units["links/link/angular_jerk"]) == ("s", "m/s^3", "rad/s^3")

    data = planar.dataset(motion)
    np.testing.assert_array_equal(data.coords["time"], motion.time)
    np.testing.assert_allclose(data.point_jerk.sel(point="P"), jerk, rtol=1e-12, atol=1e-12)
    np.testing.assert_array_equal(data.link_angular_jerk.sel(link="link"), turning)
    assert [data[name].attrs["units"] for name in ("time", "point_jerk", "link_angular_jerk")] == [
        "s",
        "m/s^3",
        "rad/s^3",
    ]
    half = data.point_velocity.sel(point="P", axis="x").swap_dims(row="time").sel(time=0.5)
    assert float(half) == motion.point("P").velocity[4, 0]


def test_without_time_and_jerk_there_is_no_word_of_them():
    motion = short_run("crank-rocker")
    assert not any("time" in column.head or "jerk" in column.head for column in run_columns(motion))
    assert "time" not in record(motion)
    assert not any("jerk" in thing.values for thing in reported_series(motion))
    assert not {"time", "point_jerk"} & set(planar.dataset(motion).variables)


def test_limits_are_told_in_json():
    limits = [
        Limit("input dead point", "O", np.float64(0.25), 1.5),
        Limit("stroke end", "stroke", 0.5, 0.02, "TDC", "the slide turns back"),
        Limit("change point", "O", 0.75, np.nan),
    ]
    found = json.loads(encode_run(timed(limits), ".json"), parse_constant=strict)["limits"]
    assert found == [
        limits[0]._asdict(),
        {"kind": "stroke end", "of": "stroke", "input": 0.5, "value": 0.02, "end": "TDC", "told": limits[1].told},
        {"kind": "change point", "of": "O", "input": 0.75, "value": None, "end": None, "told": ""},
    ]


# what is not determined


def test_a_rate_that_is_not_determined_is_blank_null_or_no_number():
    motion = between_limits()
    assert np.flatnonzero(np.isnan(motion.link("DC").angular_velocity)).tolist() == [0, 12]
    head = "DC angular velocity [rad/s]"
    cells = table_of(encode_run(motion, ".csv"))[head]
    column = parquet_of(motion)[head].to_pylist()
    told_in_json = record(motion)["links"]["DC"]["angular_velocity"]
    rates = planar.dataset(motion).link_angular_velocity.sel(link="DC")
    assert [row for row, cell in enumerate(cells) if cell == ""] == [0, 12]
    assert [row for row, value in enumerate(column) if value is None] == [0, 12]
    assert [row for row, value in enumerate(told_in_json) if value is None] == [0, 12]
    assert np.flatnonzero(np.isnan(rates)).tolist() == [0, 12]


def test_json_has_no_word_for_an_infinite_number():
    motion = timed()
    endless = motion.inputs["O"]._replace(acceleration=np.where(motion.time == 1.0, np.inf, 0.0))
    found = json.loads(encode_run(replace(motion, inputs={"O": endless}), ".json"), parse_constant=strict)
    assert found["inputs"]["O"]["acceleration"] == [*[0.0] * 8, None]


# names


FORMULAS = ["=SUM(A1)", '=HYPERLINK("x","y")', "+1", "-P", "@me", "'quoted'"]


@pytest.mark.parametrize("name", ['say "P"', "Kolben-Ø é 点", "a,b", " P ", "nan", "a/b", *FORMULAS])
def test_a_name_comes_back_as_it_is(name, monkeypatch):
    """Files allow fewer names than Python does; a pin of several links has commas in its own."""
    monkeypatch.setattr("planar.document.cursor.Cursor.check_name", lambda self, text: text)
    monkeypatch.setattr("planar.document.cursor.Cursor._check_printable", lambda self, text: None)
    value = files.to_dict(planar.load("single-link"))
    value["name"] = value["links"]["link"]["ends"][1] = name
    motion = planar.cycle(files.from_dict(value), 3)
    place = motion.point(name).position
    in_mm = numbers(table_of(encode_run(motion, ".csv"))[f"{name} x [mm]"])
    np.testing.assert_allclose(in_mm, 1e3 * place[:, 0], rtol=1e-15)
    read = parquet_of(motion)
    np.testing.assert_array_equal(read[f"{name} x [mm]"].to_numpy(), in_mm)
    assert read.schema.metadata[b"mechanism"].decode() == name
    assert json.loads(encode_run(motion, ".json"))["points"][name]["position"] == place.tolist()
    with np.load(io.BytesIO(encode_run(motion, ".npz")), allow_pickle=False) as arrays:
        np.testing.assert_array_equal(arrays[f"points/{name}/position"], place)
        assert dict(arrays["units"])[f"points/{name}/position"] == "m"
    np.testing.assert_array_equal(planar.dataset(motion).point_position.sel(point=name), place)


@pytest.mark.parametrize("name", FORMULAS)
def test_no_head_of_a_csv_file_is_a_formula_in_a_spreadsheet(name, monkeypatch):
    monkeypatch.setattr("planar.document.cursor.Cursor.check_name", lambda self, text: text)
    value = files.to_dict(planar.load("single-link"))
    value["links"]["link"]["ends"][1] = name
    content = encode_run(planar.cycle(files.from_dict(value), 3), ".csv").decode()
    heads = next(csv.reader(io.StringIO(content, newline="")))
    assert f"'{name} x [mm]" in heads
    assert not any(head[0] in "=+-@" for head in heads)


def test_a_link_named_as_what_a_pair_reports_keeps_a_head_of_its_own():
    """A pair G of wheels has a column "pair G angle", as a link "pair G" has."""
    motion = short_run("planetary-gear-set")
    name = next(name for name in motion.pairs if "angle" in motion.result_kinds(name))
    text = json.dumps(files.to_dict(motion.mechanism)).replace('"planet"', f'"pair {name}"')
    motion = short_run_of(files.from_dict(json.loads(text)))
    cells = table_of(encode_run(motion, ".csv"))
    link, pair = motion.link(f"pair {name}").angle, motion.pair(name)["angle"]
    assert np.abs(link - pair).max() > 0.1
    np.testing.assert_allclose(numbers(cells[f"pair {name} angle [deg]"]), np.degrees(link), rtol=1e-15)
    np.testing.assert_allclose(numbers(cells[f"pair {name} angle (2) [deg]"]), np.degrees(pair), rtol=1e-15)


# long runs, other endings, libraries that are not there


def test_a_run_longer_than_what_is_written_at_a_time_is_whole():
    motion = timed(rows=2 * CSV_BLOCK_ROWS + 7)
    cells = table_of(encode_run(motion, ".csv"))
    np.testing.assert_array_equal(numbers(cells["time [s]"]), motion.time)
    np.testing.assert_array_equal(numbers(cells["P vx [m/s]"]), motion.point("P").velocity[:, 0])


def test_the_ending_of_a_file_may_be_in_capitals():
    motion = timed()
    assert encode_run(motion, ".CSV") == encode_run(motion, ".csv")


@pytest.mark.parametrize("suffix", [".xls", "", ".parq"])
@pytest.mark.parametrize("asking", [check_writable, lambda suffix: encode_run(timed(), suffix)])
def test_an_unknown_ending_is_answered_with_all_that_there_are(asking, suffix):
    with pytest.raises(BadInput, match=r"files that end in \.csv, \.json, \.npz, \.parquet or \.xlsx"):
        asking(suffix)


def test_without_pyarrow_or_xarray_a_sentence_says_what_to_install(monkeypatch):
    motion = timed()
    for library in ("pyarrow", "pyarrow.parquet", "xarray"):
        monkeypatch.setitem(sys.modules, library, None)
    for asking in (lambda: encode_run(motion, ".parquet"), lambda: check_writable(".parquet")):
        with pytest.raises(BadInput, match=r"Parquet files need pyarrow: pip install \"planar-linkages\[parquet\]\""):
            asking()
    with pytest.raises(BadInput, match=r"a Dataset needs xarray: pip install \"planar-linkages\[xarray\]\""):
        planar.dataset(motion)
    for suffix in (".csv", ".json", ".npz"):
        assert encode_run(motion, suffix)
