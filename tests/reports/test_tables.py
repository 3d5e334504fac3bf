"""Tables on terminals of any width: no number is cut, no name goes missing, no line is longer than it must be."""

from __future__ import annotations

import io
import json
import os
import re
import subprocess
import sys
from collections import Counter
from functools import cache
from math import pi
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
import pytest
from rich.console import Console

import planar
from planar.cli import main
from planar.drawing.paper.picture import Label
from planar.drawing.polygons.panels import polygon_panels
from planar.drawing.scheme.scheme import scheme
from planar.pages.data.page_data import page_data
from planar.reports.files.table_files import encode_tables
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import paragraphs, precision_text, vector_direction
from tests.command import FROM_OUTSIDE, ROOT, process, run
from tests.draws import part

WIDTHS = (40, 60, 80, 100, 200)
WIDE = 500
"""Characters: no table of these commands takes as many."""
COMMANDS: list[tuple[str, ...]] = [
    ("solve", "four-bar"),
    ("solve", "002-E3.1"),
    ("solve", "slider-crank", "--relative", "B,A"),
    ("solve", "gear-reducer"),
    ("solve", "planetary-differential"),
    ("solve", "press.json"),
    ("inspect", "two-stroke-engine"),
    ("inspect", "gear-reducer"),
    ("modes", "press.json"),
    ("modes", "press.json", "--circuits"),
    ("modes", "stuck.json"),
    ("circuits", "press.json"),
    ("cycle", "press.json", "--steps", "12", "--of", "stroke", "--of", "E"),
    ("cycle", "gear-reducer", "--steps", "12"),
    ("centres", "press.json"),
    ("forces", "two-stroke-engine"),
    ("forces", "000-P2"),
    ("forces", "gear-reducer"),
    ("forces", "two-stroke-engine", "--cycle", "--steps", "12"),
    ("simulate", "physical-pendulum", "--duration", "0.1s", "--steps", "4"),
    ("explain", "press.json"),
    ("harmonics", "000-P5", "--point", "A"),
    ("models",),
]


@cache
def press_of_readme() -> str:
    """The mechanism of the README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return text.split("<!-- file: press.json -->\n```json\n")[1].split("```")[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "press.json").write_text(press_of_readme(), encoding="utf-8")
    stuck = json.loads((ROOT / "models" / "four-bar.json").read_text(encoding="utf-8"))
    stuck["links"]["BC"] = {"ends": ["B", "C"], "length": 20}
    (tmp_path / "stuck.json").write_text(json.dumps(stuck), encoding="utf-8")
    return tmp_path


def printed(renderables: list[Any], width: int) -> str:
    """What stands on a terminal of so many characters."""
    out = io.StringIO()
    console = Console(file=out, width=width, markup=False, emoji=False, highlight=False)
    for each in renderables:
        console.print(each, crop=False)
    return out.getvalue()


def words(text: str) -> Counter[str]:
    """The words and numbers of a text; what a heading has in one line or in two is the same."""
    return Counter(word.rstrip(",") for word in text.split() if word.strip("─"))


@pytest.mark.parametrize("command", part(COMMANDS, 2), ids=" ".join)
def test_every_word_and_number_of_a_wide_screen_stands_whole_on_a_narrow_one(
    command: tuple[str, ...], folder: Path
) -> None:
    shown: list[Any] = []
    with patch.object(Console, "print", lambda self, each, **_: shown.append(each)):
        run(folder, *command)
    every = words(printed(shown, WIDE))
    assert every
    for width in WIDTHS:
        text = printed(shown, width)
        assert not every - words(text), width
        assert all(len(line.rstrip()) <= width for line in text.splitlines()), width


def holds(text: str, width: int, file: str) -> None:
    """The text has all that a file would have, in lines that fit."""
    assert not words(file) - words(text)
    assert all(len(line.rstrip()) <= width for line in text.splitlines())


@pytest.mark.parametrize("width", [40, 80])
def test_a_pipe_is_as_wide_as_it_is_said_to_be(width: int, folder: Path) -> None:
    text, file = (run(folder, "forces", "two-stroke-engine", **wide).done() for wide in ({"COLUMNS": str(width)}, {}))
    holds(text, width, file)


def test_a_terminal_shows_every_number_whole(folder: Path) -> None:
    width = 60
    pty = pytest.importorskip("pty")
    fcntl, termios, struct = (pytest.importorskip(name) for name in ("fcntl", "termios", "struct"))
    ours, theirs = pty.openpty()
    fcntl.ioctl(theirs, termios.TIOCSWINSZ, struct.pack("HHHH", 50, width, 0, 0))
    environment = {key: value for key, value in os.environ.items() if key not in FROM_OUTSIDE}
    child = subprocess.Popen(
        [sys.executable, "-m", "planar", "forces", "two-stroke-engine"],
        stdin=subprocess.DEVNULL,
        stdout=theirs,
        stderr=subprocess.DEVNULL,
        env=environment | {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8", "TERM": "xterm"},
        cwd=folder,
    )
    os.close(theirs)
    found = b""
    while True:
        try:
            part = os.read(ours, 65536)
        except OSError:  # how Linux says that the other end is shut
            break
        if not part:
            break
        found += part
    os.close(ours)
    assert child.wait(60) == 0
    text = re.sub(r"\x1b\[[0-9;]*m", "", found.decode("utf-8"))
    holds(text, width, process(folder, "forces", "two-stroke-engine").done())


def table(rows: list[tuple[str, ...]]) -> Any:
    made = plain_table("Forces", "link", ("force, N", "at, deg"), "sense", "power, W")
    for row in rows:
        made.add_row(*row)
    return made


def test_a_table_that_is_too_wide_goes_on_below_with_the_names_again() -> None:
    lines = printed([table([("rod", "12345.6", "-140.000", "to the left", "-1599.61")])], 40).splitlines()
    rows = [line.split() for line in lines if line.split()[:1] == ["rod"]]
    assert rows == [["rod", "12345.6", "-140.000", "to", "the", "left"], ["rod", "-1599.61"]]


def test_a_direction_stays_beside_its_magnitude_at_any_width() -> None:
    made = table([("rod", "12345.6", "-140.000", "to the left", "-1599.61")])
    for width in range(30, 70):
        text = printed([made], width)
        assert any("12345.6" in line and "-140.000" in line for line in text.splitlines()), width


def test_what_no_width_holds_makes_the_line_longer() -> None:
    name = "a" * 50
    text = printed([table([(name, "12345.6", "-140.000", "to the left", "-1599.61")])], 20)
    assert words(text) >= Counter([name, "12345.6", "-140.000", "-1599.61"])


def test_a_long_name_in_a_heading_is_not_broken() -> None:
    made = plain_table(None, "link", "at averylongnameofapair, deg")
    made.add_row("rod", "1")
    assert "averylongnameofapair" in words(printed([made], 40))


def test_a_table_that_fits_is_one_table() -> None:
    made = table([("rod", "12345.6", "-140.000", "to the left", "-1599.61")])
    assert printed([made], 60) == printed([made], 200)


def test_characters_that_take_two_places_are_counted_so() -> None:
    made = plain_table(None, "link", "force, N")
    made.add_row("連桿連桿連桿連桿", "12345.6")
    assert words(printed([made], 30)) >= Counter(["連桿連桿連桿連桿", "12345.6"])


def test_paragraphs_break_between_words() -> None:
    said = [("mobility", "in this position 1.23456e-17 of the greatest"), ("-", "end")]
    assert words(printed([paragraphs(said)], 24)) == words(printed([paragraphs(said)], 200))


# units: inches

CRANK = {
    "planar": 1,
    "name": "Slider-crank",
    "units": {"length": "in", "angle": "deg"},
    "frame": "frame",
    "links": {
        "frame": {"points": {"O": [0, 0]}},
        "crank": {"ends": ["O", "A"], "length": 2},
        "rod": {"ends": ["A", "B"], "length": 8, "points": {"E": {"along": ["A", "B"], "distance": 3}}},
    },
    "pairs": [
        {"turning": "O", "pin_radius": 0.5},
        {"turning": "A", "pin_radius": 0.25},
        {"sliding": "stroke", "on": "frame", "block": "B", "line": {"through": "O"}},
    ],
    "inputs": [{"pair": "O", "position": 60, "velocity": "600 rpm", "acceleration": "100 rad/s^2"}],
    "loads": [{"point": "B", "force": ["-100 lbf", 0]}],
    "sketch": {"B": [8, 0]},
}
METRIC = re.compile(r"(?<![a-zA-Z·])m{1,2}(/s|/rad|²|$|\s)", re.MULTILINE)
"""A metre or a millimetre, or what is by one; not the N·m of a torque."""


@pytest.fixture
def inches(tmp_path: Path) -> Path:
    (tmp_path / "in.json").write_text(json.dumps(CRANK), encoding="utf-8")
    return tmp_path


@pytest.mark.parametrize(
    "command",
    [
        ("solve", "in.json", "--relative", "B,A"),
        ("cycle", "in.json", "--steps", "36", "--of", "stroke", "--of", "E", "--of", "rod"),
        ("explain", "in.json"),
        ("explain", "dyads.json"),
        ("forces", "in.json"),
        ("forces", "in.json", "--cycle", "--steps", "12"),
        ("simulate", "in.json", "--duration", "0.01s", "--steps", "2"),
        ("harmonics", "in.json", "--point", "E"),
    ],
    ids=" ".join,
)
def test_nothing_of_a_mechanism_in_inches_is_told_in_metres(command: tuple[str, ...], inches: Path) -> None:
    driven = CRANK | {
        "inputs": [{"pair": "stroke", "position": 8.8, "velocity": "20 in/s", "acceleration": "5 in/s^2"}],
    }
    driven["masses"] = [{"link": "rod", "mass": "1 lb", "at": "E"}]
    (inches / "dyads.json").write_text(json.dumps(driven), encoding="utf-8")
    if command[0] == "simulate":
        command = (command[0], "dyads.json", *command[2:])
    text = run(inches, *command).done()
    assert not METRIC.findall(text)
    assert " in" in text


def test_a_worked_solution_in_inches_computes_in_inches(inches: Path) -> None:
    """omega r = 62.8 x 2 = 126 in/s, and its square by the radius: closed forms at each step."""
    text = run(inches, "explain", "in.json").done()
    speed = 20.0 * pi * 2.0
    assert f"ω_crank × OA = 62.8 × 2 = {speed:.0f}" in text
    assert f"(oa)²/OA = ({speed:.0f})²/2 = {speed**2 / 2.0:.0f}" in text
    velocity = planar.solve(planar.from_dict(CRANK)).point("B").velocity[0] / 0.0254
    assert f"v_B = gb = {abs(velocity):.0f} in/s" in text


def test_numbers_in_inches_are_those_in_millimetres_of_the_same_mechanism(inches: Path) -> None:
    shown = json.dumps(CRANK)
    in_mm = json.loads(shown)
    in_mm["units"]["length"] = "mm"
    for link, length in (("crank", 50.8), ("rod", 203.2)):
        in_mm["links"][link]["length"] = length
    in_mm["links"]["rod"]["points"]["E"]["distance"] = 76.2
    in_mm["pairs"][0]["pin_radius"], in_mm["pairs"][1]["pin_radius"] = 12.7, 6.35
    in_mm["sketch"] = {"B": [203.2, 0]}
    (inches / "mm.json").write_text(json.dumps(in_mm), encoding="utf-8")
    heads, ours = saved(inches, "in.json")
    theirs_heads, theirs = saved(inches, "mm.json")
    sizes = {"in": 25.4, "in/s": 0.0254, "in/s^2": 0.0254}
    assert len(heads) == len(theirs_heads)
    for head, theirs_head, column, other in zip(heads, theirs_heads, ours.T, theirs.T, strict=True):
        (name, measure), (their_name, theirs_measure) = (each[:-1].split(" [") for each in (head, theirs_head))
        assert name == their_name
        assert theirs_measure == {"in": "mm", "in/s": "m/s", "in/s^2": "m/s^2"}.get(measure, measure)
        scale = max(1e-9, float(np.abs(other).max()))
        np.testing.assert_allclose(column * sizes.get(measure, 1.0), other, atol=1e-9 * scale)


def saved(folder: Path, model: str) -> tuple[list[str], np.ndarray]:
    """The columns of a run in a file."""
    run(folder, "cycle", model, "--steps", "12", "-o", "run.csv").done()
    heads, *rows = (folder / "run.csv").read_text(encoding="utf-8").splitlines()
    return heads.split(","), np.array([[float(cell or "nan") for cell in row.split(",")] for row in rows])


def test_drawings_and_pages_in_inches_have_inches() -> None:
    mechanism = planar.from_dict(CRANK)
    state = planar.solve(mechanism)
    told = [note for each in polygon_panels(state, None, 3) for note in each.notes]
    assert len([note for note in told if " in/s" in note]) == 2
    assert not [note for note in told if METRIC.search(note.replace("/mm", ""))]
    data, _ = page_data(mechanism)
    assert {kind: data["units"][kind]["name"] for kind in ("length", "velocity", "acceleration")} == {
        "length": "in",
        "velocity": "in/s",
        "acceleration": "in/s²",
    }
    assert data["units"]["acceleration"]["si"] == pytest.approx(0.0254, rel=1e-15)
    pushed = CRANK | {"inputs": [{"pair": "stroke", "position": 8.8, "velocity": "20 in/s"}]}
    texts = [mark.text for mark in scheme(planar.solve(planar.from_dict(pushed))).marks if isinstance(mark, Label)]
    assert "v = 20 in/s" in texts


@pytest.mark.parametrize(
    "command",
    [("solve", "four-bar"), ("cycle", "four-bar", "--steps", "8"), ("centres", "four-bar"), ("forces", "000-P2")],
    ids=" ".join,
)
def test_what_is_left_to_rounding_is_said_in_words(command: tuple[str, ...], tmp_path: Path) -> None:
    text = " ".join(run(tmp_path, *command).done().split())
    figures = re.findall(r"\S+ \S+ \(?\d\.\de-\d\d", text)
    assert all(re.match(r"to round-off \(\d\.\de-1[0-9]", each) for each in figures)
    assert figures or "exactly" in text
    assert "0.0e+00" not in text


def test_how_well_something_holds_in_words() -> None:
    said = [precision_text(value, "of the greatest") for value in (0.0, 2.2e-16, 3e-7)]
    assert said == ["exactly", "to round-off (2.2e-16 of the greatest)", "but for 3.0e-07 of the greatest"]


def test_a_ratio_of_like_for_like_has_no_unit(tmp_path: Path) -> None:
    (line,) = [
        each
        for each in run(tmp_path, "forces", "gear-reducer").done().splitlines()
        if re.search(r"\bI\d\d I\d\d", each)
    ]
    assert line.split() == ["output", "shaft", "O1", "9.00000", "9.00000", "I14", "I13", "I34"]


def test_a_direction_lies_above_minus_180_up_to_180_degrees() -> None:
    """Of a vector to the left, whatever rounding leaves of its other part."""
    told = [vector_direction(np.array([-2.0, y])) for y in (0.0, -0.0, 1e-16, -1e-16)]
    assert told == [pi] * 4
    assert vector_direction(np.array([0.0, -3.0])) == -pi / 2.0


@pytest.mark.parametrize("suffix", [".txt", ".svg", ".html"])
def test_a_saved_table_holds_what_is_wider_than_a_page(suffix: str) -> None:
    name = "a" * 150
    text = encode_tables(table([(name, "12345.6", "-140.000", "to the left", "-1599.61")]), suffix)
    assert name in text
    if suffix == ".svg":
        wide = float(re.search(r'viewBox="0 0 ([\d.]+)', text).group(1))
        ends = [float(x) + float(w) for x, w in re.findall(r'<text[^>]*x="([\d.]+)"[^>]*textLength="([\d.]+)"', text)]
        assert max(ends) <= wide


@pytest.mark.parametrize("width", [60, 80])
def test_the_list_of_commands_has_every_sentence_whole(width: int, tmp_path: Path) -> None:
    text = run(tmp_path, "--help", COLUMNS=str(width)).done()
    assert "..." not in text.split("Commands:")[1]
    for command in main.load_commands().values():
        assert " ".join(command.help.split()) in " ".join(text.split())
    assert all(len(line) <= 80 for line in text.splitlines())
