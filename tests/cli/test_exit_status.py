"""What cannot be printed: one sentence and a status of its own, or none where nobody reads."""

import io
import os
import subprocess
import sys
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from pathlib import Path
from unittest.mock import patch

import pytest

from planar.cli import main
from planar.cli.exit_status import CLOSED_PIPE_STATUS, NOT_WRITTEN
from tests.command import ROOT

FULL = Path("/dev/full")
SENTENCE = "planar: the output cannot be written: No space left on device\n"
full = pytest.mark.skipif(not FULL.exists(), reason="there is no device that is always full")


def ended(*words, stdout, stderr=None):
    """Status and stderr of the command, printed into a stream."""
    said = io.StringIO() if stderr is None else stderr
    with (
        patch.object(sys, "argv", ["planar", *words]),
        redirect_stdout(stdout),
        redirect_stderr(said),
        pytest.raises(SystemExit) as ending,
    ):
        main(list(words), prog_name="planar")
    return ending.value.code, stderr is None and said.getvalue()


@contextmanager
def unread():
    """A stream into a pipe that nobody reads."""
    reading, writing = os.pipe()
    os.close(reading)
    stream = os.fdopen(writing, "w")
    yield stream
    with suppress(BrokenPipeError):
        stream.close()


WORDS = [
    ["solve", "four-bar"],
    ["cycle", "four-bar", "--steps", "4", "--json"],
    ["models"],
    ["--help"],
    ["solve", "--help"],
    ["--version"],
    ["solve", "there-is-no-such", "--json"],
]


@full
@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_a_full_disk_is_one_sentence_and_a_status_of_its_own(words):
    with FULL.open("w") as stream:
        assert ended(*words, stdout=stream) == (NOT_WRITTEN, SENTENCE)


@pytest.mark.parametrize("words", WORDS, ids=" ".join)
def test_a_pipe_that_nobody_reads_ends_quietly_as_other_programs_do(words):
    with unread() as stream:
        assert ended(*words, stdout=stream) == (CLOSED_PIPE_STATUS, "")


@full
def test_where_not_even_the_sentence_can_be_written_the_status_is_the_same():
    for words, status in ((["solve", "four-bar"], NOT_WRITTEN), (["solve", "there-is-no-such"], 2)):
        with FULL.open("w") as stream, FULL.open("w") as said:
            assert ended(*words, stdout=stream, stderr=said)[0] == status


class Kept(io.StringIO):
    """Takes what is printed, and finds no room for it when it is flushed once more at the end."""

    flushed = 0

    def flush(self):
        self.flushed += 1
        if self.flushed == 2:
            raise OSError(28, "No space left on device")


def test_what_is_left_to_be_written_at_the_end_counts():
    assert ended("--version", stdout=Kept()) == (NOT_WRITTEN, SENTENCE)


@full
def test_a_process_says_nothing_after_its_sentence():
    command = [sys.executable, "-m", "planar", "solve", "four-bar"]
    with FULL.open("w") as stream:
        found = subprocess.run(command, cwd=ROOT, stdout=stream, stderr=subprocess.PIPE, text=True, check=False)
    assert (found.returncode, found.stderr) == (NOT_WRITTEN, SENTENCE)
    with unread() as stream:
        found = subprocess.run(command, cwd=ROOT, stdout=stream, stderr=subprocess.PIPE, text=True, check=False)
    assert (found.returncode, found.stderr) == (CLOSED_PIPE_STATUS, "")


@pytest.mark.skipif(os.name != "posix", reason="the shell closes streams otherwise")
@pytest.mark.parametrize(
    ("words", "status"), [("solve four-bar", NOT_WRITTEN), ("--version", NOT_WRITTEN), ("solve there-is-no-such", 2)]
)
def test_an_output_that_the_shell_has_closed_is_one_that_cannot_be_written(words, status):
    shell = ["sh", "-c", f'"$0" -m planar {words} >&-', sys.executable]
    found = subprocess.run(shell, cwd=ROOT, stderr=subprocess.PIPE, text=True, check=False)
    assert found.returncode == status
    assert found.stderr.count("\n") == 1
    assert ("the output cannot be written: Bad file descriptor" in found.stderr) is (status == NOT_WRITTEN)


def test_what_prints_nothing_needs_no_output(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "stdout", None)
    with pytest.raises(SystemExit) as ending:
        main(["plot", "four-bar", "scheme", "-o", str(tmp_path / "a.svg")], prog_name="planar")
    assert ending.value.code == 0
    assert (tmp_path / "a.svg").exists()


@full
def test_a_file_without_room_ends_so_too(tmp_path):
    (tmp_path / "m.csv").symlink_to(FULL)
    status, said = ended("cycle", "four-bar", "--steps", "4", "-o", str(tmp_path / "m.csv"), stdout=io.StringIO())
    assert status == NOT_WRITTEN
    assert said.endswith("m.csv: the file cannot be written: No space left on device\n")


def test_the_statuses_stand_in_the_help():
    out = io.StringIO()
    ended("--help", stdout=out)
    assert f"{NOT_WRITTEN} where the result cannot be written" in " ".join(out.getvalue().split())


def test_a_folder_for_which_there_is_no_room_ends_so_too(tmp_path, monkeypatch):
    def no_room(self, *_, **__):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "mkdir", no_room)
    status, said = ended("gallery", "four-bar", "-o", str(tmp_path / "pages"), stdout=io.StringIO())
    assert (status, said) == (
        NOT_WRITTEN,
        f"planar: {tmp_path / 'pages'}: the folder cannot be made: No space left on device\n",
    )


def test_choices_are_listed_on_one_line():
    status, said = ended("plot", "four-bar", "-o", "a.png", stdout=io.StringIO())
    assert status == 2
    assert "\\" not in said
    assert "scheme, velocity, acceleration" in said


LONG_NAME = "x" * 5000


@pytest.mark.parametrize(
    "words",
    [
        ["solve", LONG_NAME],
        ["solve", f"https://{LONG_NAME}"],
        ["convert", f"mech={LONG_NAME}"],
        ["convert", "four-bar", "-o", f"{LONG_NAME}.json"],
        ["chains", "4", "-o", f"{LONG_NAME}.png"],
    ],
    ids=lambda words: " ".join(words)[:20],
)
def test_a_name_that_no_file_can_have_is_one_sentence(words):
    status, said = ended(*words, stdout=io.StringIO())
    assert status in (2, 3)
    assert said.startswith("planar: ")
    assert len(said.splitlines()) == 1
