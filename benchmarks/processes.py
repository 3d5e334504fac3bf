"""How long whole processes take from their start to their end."""

from __future__ import annotations

import os
import subprocess
import sys
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import perf_counter
from typing import NamedTuple

import planar
from benchmarks import peers

MODEL = "002-E3.1"
RUNS, OF_PEERS = 7, 3
"""How often every command is run, and those that only import another solver."""
ROOT = Path(planar.__file__).parents[1]
SOLVE = ("-m", "planar", "solve", MODEL)


class Command(NamedTuple):
    """Arguments of Python, and whether what planar keeps on disk is there from a run before."""

    arguments: tuple[str, ...]
    is_known: bool = True
    remark: str = ""


COMMANDS = (
    Command(("-c", "import numpy, casadi")),
    Command(("-c", "import numpy, casadi, networkx")),
    Command(SOLVE, remark="its structure kept on disk"),
    Command(SOLVE, is_known=False, remark="nothing kept"),
    Command(("-c", f"import planar; planar.solve({MODEL!r})"), remark="its structure kept on disk"),
)
"""The first is the one that the others are compared with."""


@dataclass(frozen=True)
class Process:
    """Seconds of a whole process, the median of its runs, and the same in times of the first command."""

    command: str
    seconds: float
    ratio: float
    remark: str = ""


def cold_starts() -> tuple[Process, ...]:
    """Every command run in turn, again and again; the files, and their bytecode, are in the system's cache."""
    others = tuple(Command(("-c", f"import {name}")) for name in peers.installed())
    times: dict[Command, list[float]] = {command: [] for command in (*COMMANDS, *others)}
    for command in times:
        _time(command)
    for run in range(RUNS):
        for command, seconds in times.items():
            if run < OF_PEERS or command in COMMANDS:
                seconds.append(_time(command)[0])
    middle = {command: median(seconds) for command, seconds in times.items()}
    return tuple(
        Process(_words(command), seconds, seconds / middle[COMMANDS[0]], command.remark)
        for command, seconds in middle.items()
    )


def imports_traced() -> tuple[float, str]:
    """Seconds of a process that solves the model, and what `-X importtime` says of it."""
    return _time(Command(("-X", "importtime", *SOLVE)))


def bare() -> float:
    """Seconds of a process that does nothing."""
    return _time(Command(("-c", "pass")))[0]


def _time(command: Command) -> tuple[float, str]:
    """Seconds of a Python process, and what it wrote to its standard error."""
    with TemporaryDirectory() as empty:
        kept = str(Path(_folder().name, "kept")) if command.is_known else empty
        # bytecode is there, as where a package is installed
        environment = os.environ | {"PYTHONPYCACHEPREFIX": str(Path(_folder().name, "bytecode")), "PLANAR_CACHE": kept}
        environment.pop("PYTHONDONTWRITEBYTECODE", None)
        run = [sys.executable, *command.arguments]
        start = perf_counter()
        ended = subprocess.run(run, cwd=ROOT, env=environment, capture_output=True, text=True, check=True)
        return perf_counter() - start, ended.stderr


@cache
def _folder() -> TemporaryDirectory[str]:
    """Where processes keep what others of them find again; it goes with this process."""
    return TemporaryDirectory()


def _words(command: Command) -> str:
    return "python " + " ".join(f'"{word}"' if " " in word else word for word in command.arguments)
