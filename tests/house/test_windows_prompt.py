"""What README and the guide have people type, read by the rules of Windows' prompt; and what consoles can show.

Nothing of it runs on Windows here: how `cmd` and the C library take a line apart is written down in the tests.
"""

import json
import re
import shlex
from functools import cache
from pathlib import Path

import pytest

from planar.cli.streams import ERROR_HANDLER, PLAIN_LETTERS, allow_every_letter
from planar.guide.topics import FIRST_PAGE, guide_topics, read_page
from tests import command

ROOT = Path(__file__).parents[2]
PATHS = (FIRST_PAGE, *(each.path for each in guide_topics()))
TEXTS = [
    (ROOT / "README.md").read_text(encoding="utf-8"),
    *map(read_page, (FIRST_PAGE, *(t.path for t in guide_topics()))),
]
LINES = [
    line
    for text in TEXTS
    for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL)
    for line in block.splitlines()
    if line.startswith("planar ")
] + [line for text in TEXTS for line in re.findall(r"\) `(planar [^`]*)` \|", text)]
ENCODINGS = ("cp1252", "cp437", "cp850", "ascii")


def windows_words(line: str) -> list[str]:
    """A line as a program of Windows gets it in words: blanks part them but in double quotes; before these a backslash
    stands for itself in pairs."""
    words, word, quoted, begun, slashes = [], "", False, False, 0
    for letter in f"{line} ":
        if letter == "\\":
            slashes, begun = slashes + 1, True
            continue
        if letter == '"':
            word += "\\" * (slashes // 2)
            if slashes % 2:
                word += '"'
            else:
                quoted = not quoted
            begun, slashes = True, 0
            continue
        word, slashes = word + "\\" * slashes, 0
        if letter == " " and not quoted:
            words += [word] if begun else []
            word, begun = "", False
        else:
            word, begun = word + letter, True
    return words


def prompt_signs(line: str) -> str:
    """What `cmd` does not hand on as it stands: its own signs outside double quotes, and % anywhere."""
    outside = re.sub(r'"[^"]*"', "", line)
    return "".join(re.findall(r"[&|<>^()!'`$*?~]", outside)) + "".join(re.findall("%", line))


def test_a_line_is_taken_apart_as_windows_does():
    assert windows_words(r'a "b c" d\e "f\\" "g \"h"') == ["a", "b c", r"d\e", "f\\", 'g "h']
    assert windows_words("p 'a b'") == ["p", "'a", "b'"]


def test_a_command_means_the_same_in_both_shells():
    assert len(LINES) > 150
    for text in dict.fromkeys(LINES):
        line, _, _ = text.partition("#")  # which `cmd` does not know: the first hour says so
        line, redirect, target = line.partition(" > ")
        assert prompt_signs(line) == "", text
        assert windows_words(line) == shlex.split(line), text
        assert not redirect or re.fullmatch(r"[\w.-]+", target.strip()), text


def test_the_setup_on_windows_is_that_of_other_systems_spelt_otherwise():
    page = read_page("begin/first-hour")
    here, there = (
        re.search(rf"<!-- {mark} -->\n```\w+\n(.*?)```", page, re.DOTALL).group(1)
        for mark in ("set up", "set up on Windows")
    )
    spelt = {"python3 ": "py ", "\n. ": "\n", ".venv/bin/": ".venv\\Scripts\\"}
    for ours, theirs in spelt.items():
        here = here.replace(ours, theirs)
    assert here == there
    for line in there.splitlines():
        assert prompt_signs(line) == ""
        assert "'" not in line
    assert "py -m venv .venv && .venv\\Scripts\\pip install" in TEXTS[0]


@cache
def own_letters() -> frozenset[str]:
    """Letters beyond ASCII in the sources of the rooms that make texts for the screen."""
    rooms = [ROOT / "planar" / room for room in ("cli", "reports", "analysis")]
    sources = "".join(path.read_text(encoding="utf-8") for room in rooms for path in room.rglob("*.py"))
    return frozenset(re.findall(r"[^\x00-\x7f]", sources))


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_letter_that_the_tables_have_is_shown_by_others_where_a_console_lacks_it(encoding):
    allow_every_letter()
    letters = own_letters() | set(PLAIN_LETTERS)
    assert {"ω", "²", "₁", "×"} <= letters
    for letter in letters:
        assert b"\\" not in letter.encode(encoding, ERROR_HANDLER), letter
    assert "ω₁₂ = 10⁻¹² rad/s²".encode("ascii", ERROR_HANDLER) == b"omega12 = 10^-12 rad/s^2"
    assert "歯車".encode(encoding, ERROR_HANDLER) == b"\\u6b6f\\u8eca"  # a name is to be known again


def test_a_process_with_another_alphabet_prints_tables_and_json_that_reads_as_ever(tmp_path):
    name = command.written(tmp_path, (ROOT / "models" / "four-bar.json").read_text(encoding="utf-8"))
    done = command.process(tmp_path, "explain", name, PYTHONIOENCODING="ascii").done()
    assert "omega_AB = 10.5 rad/s, anticlockwise" in done
    assert "\\" not in done
    plain = command.process(tmp_path, "solve", name, "--json", PYTHONIOENCODING="cp437").out
    assert json.loads(plain) == json.loads(command.process(tmp_path, "solve", name, "--json").done())
