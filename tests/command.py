"""The command `planar` as tests run it: in this process, which is quick, or in one of its own, as its users do."""

from __future__ import annotations

import io
import json
import os
import subprocess
import sys
import warnings
from contextlib import chdir, redirect_stderr, redirect_stdout
from pathlib import Path
from typing import Any
from unittest.mock import patch

from planar.cli import main
from tests.watchdog import watched

ROOT = Path(__file__).parent.parent
FROM_OUTSIDE = ("COLUMNS", "FORCE_COLOR", "NO_COLOR")
"""What the terminal of who runs the tests must not change."""
LONGEST = 120
"""Seconds; no speed is tested: what would wait for ever ends."""


class Ended:
    """A finished command: status, and the text of its two streams."""

    def __init__(self, status: int, out: bytes, err: bytes):
        self.status, self.out, self.err = status, out.decode("utf-8"), err.decode("utf-8")
        assert "Traceback" not in self.err, self.err

    def refused(self, status: int) -> str:
        """The sentence of a failure: one printable line on stderr."""
        assert self.status == status, self.err
        assert self.err.startswith("planar: ")
        assert self.err.endswith("\n")
        assert self.err[:-1].isprintable()
        return self.err[len("planar: ") : -1]

    def done(self) -> str:
        assert (self.status, self.err) == (0, "")
        return self.out


def run(folder: Path, *words: str, **environment: str) -> Ended:
    """The command in a folder, its output piped; all of it but the start of a process."""
    assert not any(key.startswith("PYTHON") for key in environment), "the interpreter heeds this when it starts"
    out, err = (io.TextIOWrapper(io.BytesIO(), encoding="utf-8", write_through=True) for _ in range(2))
    with (
        patch.dict(os.environ, environment),
        patch.object(sys, "argv", ["planar", *words]),
        Path(os.devnull).open(encoding="utf-8") as nothing,
        patch.object(sys, "stdin", nothing),
        chdir(folder),
        redirect_stdout(out),
        redirect_stderr(err),
        warnings.catch_warnings(),
        watched(LONGEST),
    ):
        warnings.simplefilter("error")
        for key in set(FROM_OUTSIDE) - set(environment):
            os.environ.pop(key, None)
        try:
            main(list(words), prog_name="planar")
            status = 0
        except SystemExit as ending:
            status = ending.code or 0
    assert isinstance(status, int), status
    return Ended(status, *(stream.buffer.getvalue() for stream in (out, err)))


def process(folder: Path, *words: str, **environment: str) -> Ended:
    """The command in a folder as a process of its own, its output piped."""
    inherited = {key: value for key, value in os.environ.items() if key not in FROM_OUTSIDE}
    told = {"PYTHONPATH": str(ROOT), "PYTHONIOENCODING": "utf-8", "PYTHONWARNINGS": "error"} | environment
    ended = subprocess.run(
        [sys.executable, "-m", "planar", *words],
        cwd=folder,
        env=inherited | told,
        capture_output=True,
        check=False,
        stdin=subprocess.DEVNULL,
        timeout=LONGEST,
    )
    return Ended(ended.returncode, ended.stdout, ended.stderr)


def written(folder: Path, value: Any, name: str = "m.json") -> str:
    (folder / name).write_text(value if isinstance(value, str) else json.dumps(value), encoding="utf-8")
    return name
