"""The cases of parametrised tests that run no line that cheaper ones do not: they run in exhaustive runs alone.

They stand in `repeated_cases.json` by their tests. What is not there runs, and of every test one case does. The file is
made from a run with coverage by test (`pip install pytest-cov`; half an hour on two slow cores):

    python -m pytest --repeated --cov=planar --cov-context=test --junitxml=times.xml
    python -m tests.repeated_cases times.xml
"""

from __future__ import annotations

import json
import sqlite3
import sys
from collections import defaultdict
from collections.abc import Mapping, Sequence
from functools import cache
from heapq import heapify, heappop, heapreplace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

FILE = Path(__file__).with_suffix(".json")
COVERAGE_FILE = Path(".coverage")
MIN_SECONDS = 0.3
"""Shorter cases run whatever they show."""
FULL = (
    "tests/pages/",
    "tests/layers/",
    "tests/models/",
    "tests/equations/",
    "tests/batch/test_stores",
    "tests/cli/test_commands",
    "tests/cli/test_exit_status",
    "tests/house/test_architecture",
    "tests/house/test_doctests",
    "tests/house/test_readme",
    "tests/synthesis/test_random_tasks",
    "tests/synthesis/test_textbook_lists",
)
"""Tests of which other things than lines of Python are tried: scripts of pages, processes, published values, examples
that are read, what is said of all."""


@cache
def repeated_cases() -> dict[str, frozenset[str]]:
    """By the names of tests, `path::function`, the cases that repeat what others show."""
    cases = json.loads(FILE.read_text(encoding="utf-8"))
    return {test: frozenset(own) for test, own in cases.items()}


def without_repeated(nodes: Sequence[str]) -> set[str]:
    """Of tests by their names `path::function[case]` those that do not repeat what other cases show; all cases of a
    test of which none would be left."""
    kept: set[str] = set()
    left_out: dict[str, list[str]] = defaultdict(list)
    for node in nodes:
        test, _, case = node.partition("[")
        if case.removesuffix("]") in repeated_cases().get(test, ()):
            left_out[test].append(node)
        else:
            kept.add(node)
    tests = {node.partition("[")[0] for node in kept}
    return kept.union(*(own for test, own in left_out.items() if test not in tests))


def covered_lines(path: Path) -> dict[str, np.ndarray]:
    """By the names of tests, the lines that each runs, as bits of all lines of all files."""
    connection = sqlite3.connect(path)
    rows = connection.execute(
        "select context, file_id, numbits from line_bits join context on context.id = context_id"
    ).fetchall()
    width: dict[int, int] = defaultdict(int)
    for _, file, bits in rows:
        width[file] = max(width[file], len(bits))
    first = dict(zip(width, np.cumsum([0, *width.values()]).tolist(), strict=False))
    lines: dict[str, np.ndarray] = defaultdict(lambda: np.zeros(sum(width.values()), np.uint8))
    for context, file, bits in rows:
        own = lines[context.partition("|")[0]]
        own[first[file] : first[file] + len(bits)] |= np.frombuffer(bits, np.uint8)
    return lines


def seconds_of_tests(path: Path) -> dict[str, float]:
    """By the names of tests how long each took."""
    seconds: dict[str, float] = defaultdict(float)
    for case in ElementTree.parse(path).iter("testcase"):
        file = case.attrib["classname"].replace(".", "/")
        seconds[f"{file}.py::{case.attrib['name']}"] += float(case.attrib["time"])
    return seconds


def covering_tests(lines: Mapping[str, np.ndarray], seconds: Mapping[str, float]) -> set[str]:
    """Tests that together run every line that any test runs, taken by how many lines more each runs in its time."""
    covered = lines.get("", 0 * next(iter(lines.values()))).copy()

    def gain(test: str) -> float:
        return -float(np.bitwise_count(lines[test] & ~covered).sum()) / max(seconds[test], 1e-3)

    waiting = [(gain(test), test) for test in lines if test in seconds]
    heapify(waiting)
    chosen: set[str] = set()
    while waiting and waiting[0][0] < 0.0:
        test = waiting[0][1]
        now = gain(test)
        if len(waiting) > 1 and now > min(waiting[1:3])[0]:
            heapreplace(waiting, (now, test))
            continue
        heappop(waiting)
        if now < 0.0:
            chosen.add(test)
            covered |= lines[test]
    return chosen


def main(times: Path) -> None:
    """Write the file anew."""
    seconds = seconds_of_tests(times)
    chosen = covering_tests(covered_lines(COVERAGE_FILE), seconds)
    cases: dict[str, list[str]] = defaultdict(list)
    for node in seconds:
        cases[node.partition("[")[0]].append(node)
    repeated = {}
    for test, nodes in cases.items():
        if not any(node in chosen for node in nodes):
            chosen.add(min(nodes, key=seconds.__getitem__))
        left_out = [node for node in nodes if node not in chosen and seconds[node] > MIN_SECONDS]
        if left_out and not test.startswith(FULL):
            repeated[test] = sorted(node.partition("[")[2].removesuffix("]") for node in left_out)
    FILE.write_text(json.dumps(dict(sorted(repeated.items())), indent=1) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
