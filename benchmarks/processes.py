"""How long whole processes take from their start to their end."""

from __future__ import annotations

import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from time import perf_counter

import planar
from benchmarks import peers

MODEL = "002-E3.1"
RUNS, OF_PEERS = 7, 3
"""How often every command is run, and those that only import another solver."""
ROOT = Path(planar.__file__).parents[1]
SOLVE = ("-m", "planar", "solve", MODEL)
COMMANDS: tuple[tuple[str, ...], ...] = (
    ("-c", "import numpy, casadi"),
    ("-c", "import numpy, casadi, networkx"),
    SOLVE,
)
"""Arguments of Python; the first command is the one that the others are compared with."""


@dataclass(frozen=True)
class Process:
    """Seconds of a whole process, the median of its runs, and the same in times of the first command."""

    command: str
    seconds: float
    ratio: float


def cold_starts() -> tuple[Process, ...]:
    """Every command run in turn, again and again; the files are in the system's cache."""
    others = tuple(("-c", f"import {name}") for name in peers.installed())
    times: dict[tuple[str, ...], list[float]] = {command: [] for command in (*COMMANDS, *others)}
    for run in range(RUNS):
        for command, seconds in times.items():
            if run < OF_PEERS or command in COMMANDS:
                seconds.append(_timed(command)[0])
    middle = {command: median(seconds) for command, seconds in times.items()}
    return tuple(
        Process(_shown(command), seconds, seconds / middle[COMMANDS[0]]) for command, seconds in middle.items()
    )


def imports_traced() -> tuple[float, str]:
    """Seconds of a process that solves the model, and what `-X importtime` says of it."""
    return _timed(("-X", "importtime", *SOLVE))


def bare() -> float:
    """Seconds of a process that does nothing."""
    return _timed(("-c", "pass"))[0]


def _timed(arguments: tuple[str, ...]) -> tuple[float, str]:
    """Seconds of a Python process, and what it wrote to its standard error."""
    start = perf_counter()
    ended = subprocess.run([sys.executable, *arguments], cwd=ROOT, capture_output=True, text=True, check=True)
    return perf_counter() - start, ended.stderr


def _shown(command: tuple[str, ...]) -> str:
    return "python " + " ".join(f'"{word}"' if " " in word else word for word in command)
