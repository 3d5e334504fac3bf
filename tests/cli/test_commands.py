"""The command line: what every command prints, where, and how it ends."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import click
import pytest

import planar
from planar.cli import main
from planar.cli.commands.plot_animate import DRAWINGS, OPTION_USES
from planar.cli.exit_status import REPEATABLE
from planar.document.files import MAX_FILE_BYTES
from planar.foundation.errors import BadInput
from planar.model.mechanism import unit_rate_note, with_unit_rate
from tests.builders import slider_crank_document
from tests.command import ROOT, process, run, written
from tests.known import MODELS

FAR = 1e-12
"""A result printed in full and read again is the same number; one solved again is so to round-off."""

FOUR_BAR: dict[str, Any] = {
    "planar": 1,
    "name": "Four-bar chain",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "AD",
    "links": {
        "AD": {"points": {"A": [0, 0], "D": [100, 0]}},
        "AB": {"ends": ["A", "B"], "length": 50},
        "BC": {"ends": ["B", "C"], "length": 66, "points": {"E": {"along": ["B", "C"], "distance": 40}}},
        "DC": {"ends": ["D", "C"], "length": 56},
    },
    "pairs": [{"turning": "A"}, {"turning": "B", "pin_radius": 40}, {"turning": "C"}, {"turning": "D"}],
    "inputs": [{"pair": "A", "position": 60, "velocity": "10.5 rad/s", "acceleration": "-26 rad/s^2"}],
    "sketch": {"C": [80, 50]},
}

SLIDER_CRANK: dict[str, Any] = {
    "planar": 1,
    "name": "Slider-crank",
    "units": {"length": "mm", "angle": "deg"},
    "frame": "frame",
    "links": {
        "frame": {"points": {"O": [0, 0]}},
        "crank": {"ends": ["O", "A"], "length": 480},
        "rod": {"ends": ["A", "B"], "length": 1600},
    },
    "pairs": [
        {"turning": "O"},
        {"turning": "A"},
        {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "O"}},
    ],
    "inputs": [{"pair": "O", "position": 60, "velocity": "20 rad/s"}],
    "sketch": {"B": [1780, 0]},
}


def changed(value: dict[str, Any], **names: str) -> dict[str, Any]:
    """A mechanism with some of its texts replaced wherever they stand."""
    text = json.dumps(value)
    for old, new in names.items():
        text = text.replace(json.dumps(old.replace("_", " ")), json.dumps(new))
    return json.loads(text)


def row(table: str, first: str) -> list[str]:
    """The cells of the row that begins with a word."""
    line = next(line for line in table.splitlines() if line.split()[:1] == [first])
    return re.split(r"\s{2,}", line.strip())


# in a process of its own


@pytest.mark.parametrize(
    "words",
    [
        [],
        ["--version"],
        ["solve", "m.json"],
        ["cycle", "m.json", "--steps", "4", "-o", "t.csv"],
        ["solve", "no.json"],
        ["solve", "short.json", "--json"],
        ["cycle", "m.json", "--steps", "0", "--json"],
        ["plot", "m.json", "--nope"],
    ],
    ids=" ".join,
)
def test_a_process_prints_writes_and_ends_as_the_command_does_within_this_one(words: list[str], tmp_path: Path) -> None:
    """What the other tests run without a process of its own is what users run."""
    short = json.loads(json.dumps(FOUR_BAR))
    short["links"]["AB"]["length"] = 500
    ways: list[tuple[int, str, str, dict[str, bytes]]] = []
    for way in (process, run):
        folder = tmp_path / way.__name__
        folder.mkdir()
        written(folder, FOUR_BAR)
        written(folder, short, "short.json")
        ended = way(folder, *words)
        files = {file.name: file.read_bytes() for file in folder.iterdir()}
        # a process that has computed much evaluates by machine code, which rounds otherwise
        out = re.sub(r"round-off \(\d\.\de-1[5-7]", "round-off (#", ended.out)
        ways.append((ended.status, out, ended.err, files))
    assert ways[0] == ways[1]


# solve


def test_solve_prints_every_link_point_and_pair(tmp_path: Path) -> None:
    out = run(tmp_path, "solve", written(tmp_path, FOUR_BAR)).done()
    state = planar.solve(planar.from_dict(FOUR_BAR))
    assert "Four-bar chain" in out
    assert "A = 60 deg" in out
    assert "mobility 1" in out
    link = state.link("BC")
    numbers = [float(cell) for cell in row(out, "BC")[1:4]]
    # six digits are printed
    assert numbers == pytest.approx(
        [57.29577951 * link.angle, link.angular_velocity, link.angular_acceleration], rel=1e-5
    )
    point = state.point("E")
    cells = row(out, "E")
    assert [float(cell) for cell in cells[1:3]] == pytest.approx(1e3 * point.position, rel=1e-5)
    assert float(cells[3]) == pytest.approx(float((point.velocity @ point.velocity) ** 0.5), rel=1e-5)
    assert cells[-1] == point.sense
    assert "mm" in out
    rubbing = state.pair("B")["rubbing_speed"]
    assert any(f"{rubbing:.4f}" in line for line in out.splitlines() if line.split()[:1] == ["B"])
    assert out.isascii() or "²" in out
    assert "\x1b" not in out


def test_solve_as_json_has_the_keys_and_values_of_the_contract(tmp_path: Path) -> None:
    def strict(word: str) -> None:
        raise AssertionError(f"{word} is no JSON")

    out = run(tmp_path, "solve", written(tmp_path, FOUR_BAR), "--json").done()
    told = json.loads(out, parse_constant=strict)
    state = planar.solve(planar.from_dict(FOUR_BAR))
    assert {"mechanism", "mobility", "residual", "inputs", "links", "points", "pairs"} <= told.keys()
    assert (told["mechanism"], told["mobility"]) == ("Four-bar chain", 1)
    assert 0.0 <= told["residual"] < FAR
    assert told["inputs"] == {
        "A": {"position": pytest.approx(1.0471975511965976), "velocity": 10.5, "acceleration": -26}
    }
    assert set(told["links"]) == {"AD", "AB", "BC", "DC"}
    for name, link in told["links"].items():
        for key in ("angle", "angular_velocity", "angular_acceleration"):
            assert link[key] == pytest.approx(getattr(state.link(name), key), abs=FAR, rel=FAR)
    assert set(told["points"]) == {"A", "B", "C", "D", "E"}
    for name, point in told["points"].items():
        for key in ("position", "velocity", "acceleration"):
            assert point[key] == pytest.approx(getattr(state.point(name), key), abs=FAR, rel=FAR)
    assert set(told["pairs"]) == {"A", "B", "C", "D"}
    for name, pair in told["pairs"].items():
        assert {"relative_angular_velocity", "rubbing_speed"} <= pair.keys()
        assert pair["rubbing_speed"] == (pytest.approx(state.pair(name)["rubbing_speed"]) if name == "B" else None)


def test_a_sliding_pair_reports_displacement_velocity_and_acceleration(tmp_path: Path) -> None:
    told = json.loads(run(tmp_path, "solve", written(tmp_path, SLIDER_CRANK), "--json").done())
    stroke, b = told["pairs"]["stroke"], told["points"]["B"]
    assert set(stroke) == {"displacement", "velocity", "acceleration"}
    assert stroke["displacement"] == pytest.approx(b["position"][0], rel=FAR)
    assert stroke["velocity"] == pytest.approx(b["velocity"][0], rel=FAR)
    assert stroke["acceleration"] == pytest.approx(b["acceleration"][0], rel=FAR)
    assert "block B" in told["links"]


def test_at_moves_an_input_in_its_own_unit_or_the_units_of_the_file(tmp_path: Path) -> None:
    name = written(tmp_path, FOUR_BAR)
    there = json.loads(json.dumps(FOUR_BAR))
    there["inputs"][0]["position"] = 75
    wanted = planar.solve(planar.from_dict(there)).link("BC").angle
    for word in ("A=75", "A = 75 deg"):
        told = json.loads(run(tmp_path, "solve", name, "--json", "--at", word).done())
        assert told["links"]["BC"]["angle"] == pytest.approx(wanted, abs=1e-10)  # another start, the same assembly
        assert told["inputs"]["A"]["velocity"] == 10.5


@pytest.mark.parametrize(
    ("word", "words"),
    [
        ("A", ["'A'", "PAIR=POSITION"]),
        ("B=75", ["no input at 'B'", "A"]),
        ("A=75mm", ["an angle is wanted"]),
        ("A=nan", ["A", "number"]),
    ],
)
def test_at_refuses_what_is_no_position_of_an_input(word: str, words: list[str], tmp_path: Path) -> None:
    ended = run(tmp_path, "solve", written(tmp_path, FOUR_BAR), "--at", word)
    sentence = ended.refused(2)
    assert ended.out == ""
    for each in words:
        assert each in sentence


# other commands


def test_models_lists_every_model_that_comes_along(tmp_path: Path) -> None:
    out = run(tmp_path, "models").done()
    told = json.loads(run(tmp_path, "models", "--json").done())
    assert [each["model"] for each in told] == [*MODELS]
    for each, (stem, mechanism) in zip(told, MODELS.items(), strict=True):
        assert set(each) == {"model", "ids", "about"}
        assert stem in out
        assert set(mechanism.ids) <= {stem, *each["ids"]}


def test_a_model_that_comes_along_solves_from_any_folder(tmp_path: Path) -> None:
    for stem, mechanism in [*MODELS.items()][:1]:
        told = json.loads(run(tmp_path, "solve", stem, "--json").done())
        assert told["mechanism"] == mechanism.name


def test_help_and_version_are_printed(tmp_path: Path) -> None:
    out = run(tmp_path, "--help").done()
    assert "solve" in out
    assert "models" in out
    assert re.fullmatch(r"planar \d+\.\d+\.\d+\S*\n", run(tmp_path, "--version").done())


# failures


def test_a_mechanism_without_an_answer_ends_with_1_and_the_reason(tmp_path: Path) -> None:
    value = json.loads(json.dumps(FOUR_BAR))
    value["links"]["AB"]["length"] = 500
    name = written(tmp_path, value)
    ended = run(tmp_path, "solve", name)
    sentence = ended.refused(1)
    assert ended.out == ""
    for word in ("cannot be assembled", "BC", "DC", "A = 60 deg"):
        assert word in sentence
    ended = run(tmp_path, "solve", name, "--json")
    assert ended.refused(1) == sentence
    told = json.loads(ended.out)
    assert set(told) == {"outcome", "reason"}
    assert told["outcome"] == "cannot be assembled"
    assert told["reason"] in sentence


def test_an_interrupt_ends_a_long_run_with_130_and_one_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr("planar.solving.continuation.path.fast_run", interrupted)
    for words in (["four-bar"], ["four-bar", "--json"]):
        ended = run(tmp_path, "cycle", *words, "--to", "3000rad")
        assert ended.refused(130) == "interrupted: stopped by the user before it was done"
    assert json.loads(ended.out)["outcome"] == "interrupted"


def test_bad_input_ends_with_2_and_names_the_place(tmp_path: Path) -> None:
    value = json.loads(json.dumps(FOUR_BAR))
    value["links"]["AB"]["lenght"] = value["links"]["AB"].pop("length")
    name = written(tmp_path, value)
    ended = run(tmp_path, "solve", name)
    sentence = ended.refused(2)
    assert ended.out == ""
    for word in ("$.links.AB.lenght", "'lenght'", "'length'"):
        assert word in sentence
    ended = run(tmp_path, "solve", name, "--json")
    assert ended.refused(2) == sentence
    told = json.loads(ended.out)
    assert set(told) == {"outcome", "reason"}
    assert told["outcome"] == "bad input"
    assert "$.links.AB.lenght" in told["reason"]


@pytest.mark.parametrize(
    ("model", "words"),
    [("none.json", ["none.json", "no such file"]), (".", ["folder"]), ("a\nb\x1b[31m", ["no such file"])],
    ids=["missing", "folder", "screen"],
)
def test_what_is_no_file_ends_with_2(model: str, words: list[str], tmp_path: Path) -> None:
    sentence = run(tmp_path, "solve", model).refused(2)
    for word in words:
        assert word in sentence


TEXT = json.dumps(FOUR_BAR)
BIG = "9" * 400


def told(old: str, new: str) -> str:
    """The four-bar chain with a piece of its text replaced."""
    assert old in TEXT
    return TEXT.replace(old, new, 1)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("", ["m.json", "not JSON"]),
        (TEXT[:-1], ["m.json", "not JSON", "line 1"]),
        (TEXT + "}", ["m.json", "not JSON", "line 1"]),
        (b'{"name": "\xff"}', ["m.json", "not UTF-8", "byte 10"]),
        (TEXT.encode("utf-16"), ["m.json", "not UTF-8"]),
        (told("66", "NaN"), ["m.json", "NaN", "not a number"]),
        (told("66", "-Infinity"), ["m.json", "-Infinity", "not a number"]),
        (told("66", "1e999"), ["$.links.BC.length", "too large"]),
        (told("66", BIG), ["$.links.BC.length", "too large"]),
        (told("100, 0", f"100, -{BIG}"), ["$.links.AD.points.D[1]", "too large"]),
        (told("66", "9" * 5000), ["m.json", "digits"]),
        (told('"frame": "AD"', '"frame": "AD", "frame": "AD"'), ["m.json", "'frame'", "twice"]),
        (told('"sketch"', '"sketh"'), ["$.sketh", "unknown key", "did you mean 'sketch'?"]),
        (told('"frame": "AD", ', ""), ["$: ", "'frame'", "missing"]),
        (told('"frame": "AD"', '"frame": "Ad"'), ["$.frame", "no link 'Ad'", "did you mean 'AD'?"]),
        (told('"turning": "C"', '"turning": "Z"'), ["$.pairs[2].turning", "no link", "'Z'"]),
        (told('"C"}', '"C", "links": ["BC", "CD"]}'), ["$.pairs[2].links[1]", "no link 'CD'"]),
        (told('"C"}', '"C", "links": ["BC", "AB"]}'), ["$.pairs[2].turning", "'AB'", "no point 'C'"]),
        (
            told('"along": ["B", "C"], "distance": 40', '"distances": {"B": 5, "C": 5}, "left_of": ["B", "C"]'),
            ["$.links.BC.points.E", "does not close", "B-C-E"],
        ),
        (told("66", "0"), ["$.links.BC.length", "above zero", "0"]),
        (told("66", '"-66 mm"'), ["$.links.BC.length", "above zero", "-66 mm"]),
        (told("66", '"66 deg"'), ["$.links.BC.length", "a length is wanted"]),
        (told("66", '"66"'), ["$.links.BC.length", "no unit"]),
        (told('"10.5 rad/s"', "10.5"), ["$.inputs[0].velocity", "bare rate", "rad/s"]),
        (
            told('"inputs": [', '"inputs": [{"pair": "A", "position": 1}, '),
            ["$.inputs[1].pair", "'A'", "an input already"],
        ),
        ("[" * 20_000, ["m.json", "nested too deeply"]),
        ('{"a":' * 20_000 + "1" + "}" * 20_000, ["m.json", "nested too deeply"]),
        (told("66", "[" * 300 + "]" * 300), ["$.links.BC.length", "a list"]),
        (TEXT + " " * MAX_FILE_BYTES, ["m.json", "larger than the 8 MiB"]),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, list) else "",
)
def test_a_file_that_cannot_be_meant_ends_every_command_with_2_and_one_sentence(
    content: str | bytes, words: list[str], tmp_path: Path
) -> None:
    (tmp_path / "m.json").write_bytes(content if isinstance(content, bytes) else content.encode())
    refused_by(["solve", "inspect", "cycle"][len(words[0]) % 3], "m.json", words, tmp_path)


def refused_by(command: str, model: str, words: list[str], folder: Path) -> None:
    ended = run(folder, command, model, "--json")
    sentence = ended.refused(2)
    assert sentence.startswith(words[0])
    for word in words:
        assert word in sentence
    assert json.loads(ended.out) == {"outcome": "bad input", "reason": sentence}


@pytest.mark.parametrize("command", ["solve", "inspect", "cycle"])
def test_a_byte_order_mark_is_no_mistake(command: str, tmp_path: Path) -> None:
    (tmp_path / "m.json").write_bytes(TEXT.encode("utf-8-sig"))
    assert "Four-bar chain" in run(tmp_path, command, "m.json").done()


@pytest.mark.parametrize("command", ["solve", "inspect", "cycle"])
def test_what_is_no_file_to_read_ends_with_2_and_is_not_waited_for(command: str, tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe")
    (tmp_path / "circle").symlink_to(tmp_path / "circle")
    for model in {"solve": ["pipe", "none"], "inspect": ["/dev/zero", "."], "cycle": ["circle", "m.json/x"]}[command]:
        refused_by(command, model, [model], tmp_path)


@pytest.mark.skipif(os.geteuid() == 0, reason="a superuser may read any file")
def test_a_file_that_may_not_be_read_ends_with_2(tmp_path: Path) -> None:
    (tmp_path / written(tmp_path, FOUR_BAR)).chmod(0)
    refused_by("solve", "m.json", ["m.json", "cannot be read"], tmp_path)


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["solv"], ["'solv'", "solve"]),
        (["--nope", "solve", "m.json"], ["--nope"]),
        (["solve"], ["MODEL", "`planar solve --help`"]),
        (["solve", "m.json", "more"], ["more"]),
        (["solve", "m.json", "--nope"], ["--nope"]),
        (["solve", "m.json", "--relativ", "C,B"], ["--relativ"]),
        (["solve", "m.json", "-o"], ["-o", "argument"]),
        (["solve", "m.json", "--a\nb\x1b[31m"], ["--a", r"b\x1b[31m"]),
        (["cycle", "m.json", "-o", "."], ["-o", "'.'"]),
        (["cycle", "m.json", "--steps", "abc"], ["--steps", "'abc'", "integer"]),
        (["cycle", "m.json", "--steps", "1e9"], ["--steps", "'1e9'", "integer"]),
        (["cycle", "m.json", "--steps", "0"], ["steps", "1", "0"]),
        (["cycle", "m.json", "--steps", "-5"], ["steps", "1", "-5"]),
        (["cycle", "m.json", "--steps", "1000000000"], ["steps", "100000", "1000000000"]),
        (["cycle", "m.json", "--from", "5 parsecs"], ["'5 parsecs'", "angle is wanted"]),
        (["cycle", "m.json", "--from", "nan"], ["not a number"]),
        (["cycle", "m.json", "--to", "5 mm"], ["'5 mm'", "angle is wanted"]),
        (["cycle", "m.json", "--to", ""], ["''"]),
        (["cycle", "m.json", "--input", "Z"], ["'Z'", "inputs are at A"]),
        (["models", "more"], ["more"]),
    ],
    ids=" ".join,
)
def test_a_wrong_command_line_ends_with_2_and_one_sentence(words: list[str], told: list[str], tmp_path: Path) -> None:
    written(tmp_path, FOUR_BAR)
    ended = run(tmp_path, words[0], "--json", *words[1:])
    sentence = ended.refused(2)
    for word in told:
        assert word in sentence
    assert json.loads(ended.out) == {"outcome": "bad input", "reason": sentence}


@pytest.mark.parametrize("words", [["solv"], ["--nope"], ["solve"], ["cycle", "m", "--steps", "x"]], ids=" ".join)
def test_a_wrong_command_line_prints_nothing_but_the_sentence(words: list[str], tmp_path: Path) -> None:
    ended = run(tmp_path, *words)
    assert words[-1] in ended.refused(2)
    assert ended.out == ""


def test_the_command_alone_tells_what_there_is(tmp_path: Path) -> None:
    ended = run(tmp_path)
    assert "Usage: planar" in ended.out + ended.err
    assert "solve" in ended.out + ended.err


def test_a_frame_alone_is_solved_or_refused_in_a_sentence(tmp_path: Path) -> None:
    value = {"planar": 1, "frame": "f", "links": {"f": {"points": {"A": [0, 0]}}}, "pairs": []}
    ended = run(tmp_path, "solve", written(tmp_path, value))
    assert ended.done() if ended.status == 0 else ended.refused(1)


# tables to files


def test_tables_are_written_in_the_format_of_the_file(tmp_path: Path) -> None:
    name = written(tmp_path, changed(FOUR_BAR, Four_bar="", AB="crank<1>") | {"name": "A <b>&amp;</b> [i]B[/i]"})
    beginnings = {"t.txt": "A <b>", "t.svg": "<svg", "t.html": "<!DOCTYPE html>"}
    for output, beginning in beginnings.items():
        assert run(tmp_path, "solve", name, "-o", output).done() == ""
        text = (tmp_path / output).read_text(encoding="utf-8")
        assert text.startswith(beginning)
        assert "\x1b" not in text
        if output == "t.txt":
            assert "A <b>&amp;</b> [i]B[/i]" in text
            assert row(text, "crank<1>")[1] == "60.0000"
        else:
            shown = re.sub(r"<[^>]*>|&#160;", " ", text)
            assert "<b>" not in text
            assert "&lt;b&gt;" in shown
            assert "[i]B[/i]" in shown
            assert "crank&lt;1&gt;" in shown
            assert "https://" not in re.sub(
                r"https?://www\.w3\.org|https://rich\.readthedocs\S*|https://www\.textual\S*", "", text
            )


@pytest.mark.parametrize(
    ("command", "output", "words"),
    [
        ("solve", "t.pdf", [".txt", ".svg", ".html", ".pdf"]),
        ("solve", "no/t.txt", ["t.txt", "cannot be written"]),
        ("cycle", "t.pdf", [".csv", ".json", ".npz", ".pdf"]),
        ("cycle", "t", [".csv", ".json", ".npz"]),
        ("cycle", "no/t.csv", ["t.csv", "cannot be written"]),
    ],
)
def test_a_file_that_cannot_be_written_ends_with_2(command: str, output: str, words: list[str], tmp_path: Path) -> None:
    sentence = run(tmp_path, command, written(tmp_path, FOUR_BAR), "-o", output).refused(2)
    for word in words:
        assert word in sentence


def test_a_file_asked_for_beside_json_is_not_forgotten(tmp_path: Path) -> None:
    ended = run(tmp_path, "solve", written(tmp_path, FOUR_BAR), "--json", "-o", "t.txt")
    assert ended.status == 2 or (tmp_path / "t.txt").is_file()


# texts of authors


def test_markup_in_names_is_printed_as_it_is_written(tmp_path: Path) -> None:
    value = changed(FOUR_BAR, AB="[red]x[/red]", B="[bold]p[/bold]", E="[/]", D="[link]")
    value |= {"name": "[bold]x[/bold]", "source": "[i]y[/i]", "notes": ["[u]n[/u] [/]"]}
    value["published"] = [{"symbol": "[b]v[/b] &c", "quantity": "velocity", "of": "C", "value": 1, "slip": "[s]"}]
    out = run(tmp_path, "solve", written(tmp_path, value)).done()
    for word in ("[bold]x[/bold]", "[i]y[/i]", "[u]n[/u] [/]", "[b]v[/b] &c", "[s]", "[link]", "[/]"):
        assert word in out
    assert row(out, "[red]x[/red]")[1] == "60.0000"
    assert row(out, "[bold]p[/bold]")[1] == "25.0000"
    assert "[red]x[/red] - BC" in out


def test_words_between_colons_are_no_pictures(tmp_path: Path) -> None:
    value = FOUR_BAR | {"name": "a :smile: b", "notes": [":x:"]}
    value["published"] = [{"symbol": ":smile:", "quantity": "velocity", "of": "C", "value": 1, "note": ":x:"}]
    out = run(tmp_path, "solve", written(tmp_path, value)).done()
    assert "a :smile: b" in out
    assert row(out, ":smile:")[1] == "velocity of C"
    assert out.count(":x:") == 2


@pytest.mark.parametrize("where", ["name", "AB"])
def test_no_text_of_a_file_commands_the_terminal(where: str, tmp_path: Path) -> None:
    text = "\x1b]0;title\x07\x1b[31mred\x9b2J"
    value = changed(FOUR_BAR, AB=text) if where == "AB" else FOUR_BAR | {"name": text, "notes": [text]}
    ended = run(tmp_path, "solve", written(tmp_path, value))
    for sign in ("\x1b", "\x07", "\x9b"):
        assert sign not in ended.out + ended.err
    assert ended.status in (0, 2)


CODE = "__import__('os')"


@pytest.mark.parametrize("where", ["Four-bar chain", "AB", "E", "A"])
def test_no_text_of_a_file_is_executed(where: str, tmp_path: Path) -> None:
    text = f"{CODE} $(touch done) `touch done` [link=file]x[/link]"
    name = written(tmp_path, changed(FOUR_BAR, **{where: text}))
    out = run(tmp_path, "solve", name, FORCE_COLOR="1", COLUMNS="400").done()
    assert text in out
    assert "\x1b]8" not in out  # no link that a terminal would open
    assert [file.name for file in tmp_path.iterdir()] == [name]


@pytest.mark.parametrize("where", ['"mm"', "66"])
def test_no_unit_of_a_file_is_executed(where: str, tmp_path: Path) -> None:
    name = written(tmp_path, told(where, json.dumps(f"{CODE}.system('touch done')")))
    assert "unit" in run(tmp_path, "solve", name).refused(2)
    assert [file.name for file in tmp_path.iterdir()] == [name]


def test_half_a_character_is_no_traceback(tmp_path: Path) -> None:
    name = written(tmp_path, json.dumps(changed(FOUR_BAR, AB="x\ud800") | {"name": "half \udc00"}))
    assert run(tmp_path, "solve", name).status in (0, 2)


def test_names_and_files_in_any_language_are_printed(tmp_path: Path) -> None:
    value = changed(FOUR_BAR, AB="曲柄", C="Ä") | {"name": "Träger 连杆 🦾"}
    name = written(tmp_path, value, "Träger 连杆.json")
    out = run(tmp_path, "solve", name).done()
    assert "Träger 连杆 🦾" in out
    assert row(out, "曲柄")[1] == "60.0000"
    told = json.loads(run(tmp_path, "solve", name, "--json").done())
    assert told["mechanism"] == "Träger 连杆 🦾"
    assert "曲柄" in told["links"]


def test_a_screen_without_the_characters_is_no_traceback(tmp_path: Path) -> None:
    value = changed(FOUR_BAR, AB="曲柄") | {"name": "连杆"}
    ended = process(tmp_path, "solve", written(tmp_path, value, "连杆.json"), PYTHONIOENCODING="ascii")
    assert "60.0000" in ended.done()


@pytest.mark.parametrize("said", [None, "3"])
def test_the_command_shares_no_small_matrix_among_threads_unless_the_user_wants_it(said):
    code = """
import os, sys
from planar.cli import main
assert "numpy" not in sys.modules
main(["solve", "four-bar"], standalone_mode=False)
assert "numpy" in sys.modules
names = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
print(*(os.environ.get(name) for name in names), file=sys.stderr)
"""
    names = ("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
    environment = {key: value for key, value in os.environ.items() if key not in names}
    environment |= {"PYTHONPATH": str(ROOT)} | ({} if said is None else dict.fromkeys(names, said))
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, env=environment, check=False)
    assert done.stderr.split() == [said or "1"] * len(names)


# commands and files that there are not


@pytest.mark.parametrize(
    ("word", "meant"), [("mobility", "inspect"), ("slove", "solve"), ("Assemblies", "modes"), ("velocity", "solve")]
)
def test_a_command_by_another_name_is_answered_with_the_one_that_does_it(word: str, meant: str, tmp_path: Path) -> None:
    assert f"did you mean {meant!r}?" in run(tmp_path, word).refused(2)


def test_of_an_argument_that_is_none_of_its_choices_every_choice_is_named_whole(tmp_path: Path) -> None:
    from planar.cli import main

    (choices,) = (each.type.choices for each in main.load_commands()["plot"].params if each.name == "what")
    sentence = run(tmp_path, "plot", "four-bar", "schema", "-o", "x.png").refused(2)
    for choice in choices:
        assert sentence.count(repr(choice)) == 1


def test_a_word_that_is_no_command_is_answered_with_the_commands(tmp_path: Path) -> None:
    sentence = run(tmp_path, "zzz", "four-bar").refused(2)
    for word in ("no such command 'zzz'", "animate", "tolerance and view", "planar --help"):
        assert word in sentence


def test_every_other_name_of_a_command_is_of_one_that_there_is_and_is_none_itself() -> None:
    from planar.cli import main
    from planar.cli.exit_status import COMMAND_SYNONYMS

    assert set(COMMAND_SYNONYMS.values()) <= set(main.modules)
    assert not set(COMMAND_SYNONYMS) & set(main.modules)
    assert {name: each.callback.__module__ for name, each in main.load_commands().items()} == main.modules


@pytest.mark.parametrize(
    ("words", "endings"),
    [
        (["solve", "four-bar"], ".txt, .html or .svg"),
        (["explain", "four-bar"], ".txt, .html, .svg, .pdf or .png"),
        (["cycle", "four-bar", "--steps", "2"], ".csv, .json, .npz, .parquet or .xlsx"),
        (["plot", "four-bar", "scheme"], ".png, .svg, .pdf or .dxf"),
        (["explain", "four-bar"], ".txt, .html, .svg, .pdf or .png"),
        (["view", "four-bar"], ".html or .htm"),
        (["animate", "four-bar"], ".gif or .mp4"),
    ],
)
def test_a_format_that_is_not_written_is_answered_with_those_that_are(
    words: list[str], endings: str, tmp_path: Path
) -> None:
    sentence = run(tmp_path, *words, "-o", "x.docx").refused(2)
    assert "'.docx'" in sentence
    assert f"can be written to files that end in {endings}" in sentence
    assert not (tmp_path / "x.docx").exists()


def test_a_run_of_a_file_without_a_velocity_is_at_the_unit_rate_of_the_input_that_runs(tmp_path: Path) -> None:
    value = slider_crank_document(0.1, 0.4, 1.0, omega=None, name="still")
    model = written(tmp_path, value)
    pair = value["inputs"][0]["pair"]
    found = json.loads(run(tmp_path, "cycle", model, "--steps", "6", "--json").out)
    turning = planar.from_dict(value | {"inputs": [value["inputs"][0] | {"velocity": 1.0}]})
    motion = planar.cycle(turning, 6)
    assert found["inputs"][pair]["velocity"] == [1.0] * 7
    for name, point in motion.points.items():
        assert found["points"][name]["acceleration"] == pytest.approx(point.acceleration)
    note = f"the file gives no velocity: velocities and accelerations are for 1 rad/s at the input {pair}"
    assert found["remarks"].count(note) == 1
    assert " ".join(run(tmp_path, "cycle", model, "--steps", "6").out.split()).count(note) == 1
    solved = json.loads(run(tmp_path, "solve", model, "--json").out)
    assert solved["inputs"][pair]["velocity"] == 0.0
    timed = json.loads(run(tmp_path, "cycle", model, "--duration", "1", "--steps", "2", "--json").out)
    assert timed["inputs"][pair]["velocity"] == [0.0] * 3  # in time it stands still


def test_the_unit_rate_is_that_of_the_input_that_is_named_and_none_beside_a_law_or_an_acceleration() -> None:
    mechanism = planar.load("pantograph")
    still = replace(
        mechanism, inputs=tuple(given._replace(velocity=0.0, acceleration=0.0) for given in mechanism.inputs)
    )
    first, second = (given.pair for given in still.inputs)
    for named, driven in ((None, first), (second, second)):
        moving = with_unit_rate(still, named)
        assert {given.pair: given.velocity for given in moving.inputs if given.velocity} == {driven: 1.0}
        assert moving.remarks[-1] == unit_rate_note(still, driven)
    assert with_unit_rate(mechanism) is mechanism
    started = replace(still, inputs=(still.inputs[0]._replace(acceleration=2.0), *still.inputs[1:]))
    assert with_unit_rate(started) is started
    with pytest.raises(BadInput, match="there is no input at 'nowhere'"):
        with_unit_rate(still, "nowhere")
    sliding = planar.load("excavator-arm")
    (driven, *_) = (given.pair for given in sliding.inputs)
    assert "for 1 m/s at the input" in unit_rate_note(sliding, driven)


def test_explain_takes_the_unit_rate_of_the_input_that_is_named_and_refuses_it_beside_a_velocity(
    tmp_path: Path,
) -> None:
    mechanism = planar.load("pantograph")
    value = planar.to_dict(mechanism)
    second = mechanism.inputs[1].pair
    refused = run(tmp_path, "explain", "pantograph", "--input", second).refused(2)
    assert refused.startswith("--input: it names an input with a unit rate")
    for given in value["inputs"]:
        given.pop("velocity", None)
    shown = run(tmp_path, "explain", written(tmp_path, value | {"published": []}), "--input", second).out
    assert " ".join(shown.split()).count(f"for 1 rad/s at the input {second}") == 1
    solution = json.loads(run(tmp_path, "explain", "m.json", "--input", second, "--json").out)
    assert any(link["velocity"] for link in solution["links"].values())


COMMAND_OPTIONS = [
    (name, option)
    for name, command in sorted(main.load_commands().items())
    for option in command.params
    if isinstance(option, click.Option) and not option.is_eager
]
"""Every option of every command, but those that print help."""


def test_an_option_that_takes_one_value_is_refused_when_it_is_repeated(tmp_path: Path) -> None:
    """No option of any command keeps its last value alone; the help says which options may be repeated."""
    assert len(COMMAND_OPTIONS) > 100
    for name, option in COMMAND_OPTIONS:
        word = max(option.opts, key=len)
        if option.multiple:
            assert REPEATABLE in (option.help or ""), (name, word)
            continue
        assert REPEATABLE not in (option.help or ""), (name, word)
        words = [word] if option.is_flag else [word, "1"]
        sentence = run(tmp_path, name, *words, *words).refused(2)
        assert sentence == f"{word}: this option is given 2 times but takes one value; give it once", name
    assert "given 3 times" in run(tmp_path, "solve", "four-bar", "--mode=1", "--mode", "1", "--mode=2").refused(2)


def test_an_option_that_a_drawing_does_not_use_is_refused_by_name(tmp_path: Path) -> None:
    """The refusal and the help of `plot` name the same drawings."""
    options = {word: option for name, option in COMMAND_OPTIONS if name == "plot" for word in option.opts}
    assert {*options} - {*OPTION_USES} == {"-o", "--set", "--timeout"}
    for word, use in OPTION_USES.items():
        named = re.search(r"(Not for|For) ([^.]*)[.]", options[word].help or "")
        assert named is not None, word
        listed = set(re.split(", | and ", named[2]))
        assert listed == ({*use.drawings} if named[1] == "For" else {*DRAWINGS} - {*use.drawings})
        value = [] if options[word].is_flag else ["first" if word == "--frame-number" else "1"]
        for drawing in sorted({*DRAWINGS} - {*use.drawings}):
            sentence = run(tmp_path, "plot", "no such file", drawing, word, *value, "-o", "a.png").refused(2)
            assert sentence.startswith(f"{word}: this option is for "), (word, drawing)
            assert f"{drawing} does not use it" in sentence
    assert "--of: torque is drawn of one name" in run(
        tmp_path, "plot", "four-bar", "torque", "--of", "A", "--of", "B", "-o", "a.png"
    ).refused(2)
