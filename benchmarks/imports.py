"""What a cold `planar solve` spends its time on, from Python's own trace of its imports."""

from __future__ import annotations

import re
import sys
from collections import Counter
from dataclasses import dataclass
from statistics import median

from benchmarks.processes import RUNS, bare, imports_traced

_LINE = re.compile(r"import time:\s*(\d+) \|\s*\d+ \| ( *)(\S+)")

SHOWN = 0.005
"""Parts below this share of the whole are left out."""


@dataclass(frozen=True)
class Cost:
    """Seconds of one part of a process, the median of the runs, and the part of the whole that it is."""

    part: str
    seconds: float
    share: float


def costs() -> tuple[Cost, ...]:
    """The parts of a cold `planar solve`, the dearest first, without those that hardly show.

    The solving is what is left of a process when its imports and an idle interpreter are taken off. Tracing slows
    imports a little, so shares are to be trusted more than seconds.
    """
    runs = []
    for _ in range(RUNS):
        whole, trace = imports_traced()
        parts, idle = by_package(trace), bare()
        runs.append(parts | {"Python itself": idle, "solving and printing": whole - idle - sum(parts.values())})
    middle = {part: median(run[part] for run in runs) for part in runs[0]}
    total = sum(middle.values())
    found = [Cost(part, seconds, seconds / total) for part, seconds in middle.items() if seconds > SHOWN * total]
    return tuple(sorted(found, key=lambda cost: -cost.seconds))


def by_package(trace: str) -> dict[str, float]:
    """Seconds of importing each installed package, the standard library's modules counted to whoever asks for them.

    The trace names every module after those that it imports, which stand indented under it; so read from its end,
    each module follows its importer. What the interpreter imports by itself is not counted.
    """
    spent: Counter[str] = Counter()
    importers: list[tuple[int, str]] = []
    for line in reversed(trace.splitlines()):
        match = _LINE.match(line)
        if match is None:
            continue
        depth, package = len(match[2]), match[3].split(".")[0]
        while importers and importers[-1][0] >= depth:
            importers.pop()
        if package in sys.stdlib_module_names or package.startswith("_"):
            package = importers[-1][1] if importers else ""
        importers.append((depth, package))
        if package:
            spent[package] += int(match[1])
    return {f"import {package}": microseconds * 1e-6 for package, microseconds in spent.items()}
