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
from pathlib import Path
from typing import Any
from unittest.mock import patch

import pytest
from rich.console import Console

from planar.views.fitted import plain_table
from planar.views.table import paragraphs
from tests.command import FROM_OUTSIDE, ROOT, run

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
    ("cycle", "press.json", "--steps", "12", "--of", "stroke", "--of", "OA", "--of", "E"),
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
def press() -> str:
    """The mechanism of the README."""
    text = (ROOT / "README.md").read_text(encoding="utf-8")
    return text.split("<!-- file: press.json -->\n```json\n")[1].split("```")[0]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "press.json").write_text(press(), encoding="utf-8")
    stuck = json.loads(press())
    stuck["links"]["AB"]["length"] = 1200
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


@pytest.mark.parametrize("command", COMMANDS, ids=" ".join)
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


def holds(text: str, width: int, folder: Path) -> None:
    """The text has all that a file would have, in lines that fit."""
    assert not words(run(folder, "forces", "two-stroke-engine").done()) - words(text)
    assert all(len(line.rstrip()) <= width for line in text.splitlines())


@pytest.mark.parametrize("width", [40, 80])
def test_a_pipe_is_as_wide_as_it_is_said_to_be(width: int, folder: Path) -> None:
    holds(run(folder, "forces", "two-stroke-engine", COLUMNS=str(width)).done(), width, folder)


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
    holds(text, width, folder)


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
