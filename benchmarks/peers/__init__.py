"""Other solvers of linkages, those of them that are installed: `pip install \"planar-linkages[bench]\"`.

Each file is one of them and gives its `entries` for a swept linkage; none of their code is run unless it is timed.
"""

from __future__ import annotations

from importlib import import_module
from importlib.metadata import version
from importlib.util import find_spec

from benchmarks.entry import Array, Entry
from benchmarks.swept.base import Swept

PACKAGES = {
    "pylinkage": "by_pylinkage",
    "python_solvespace": "by_solvespace",
    "kinepy": "by_kinepy",
    "exudyn": "by_exudyn",
    "kimech": "by_kimech",
}
"""The module that each is imported as, and the file here that knows it."""


def installed() -> tuple[str, ...]:
    """Those that can be imported."""
    needs = {"pylinkage": ("pylinkage", "numba")}
    return tuple(name for name in PACKAGES if all(find_spec(each) for each in needs.get(name, (name,))))


def versions() -> str:
    """Names and versions of those that are installed."""
    return ", ".join(f"{name} {version(name.replace('_', '-'))}" for name in installed()) or "no peers"


def sweeps(swept: Swept, d: Array, theta: Array) -> list[Entry]:
    """The peers that take many designs at once."""
    if "pylinkage" not in installed():
        return []
    return import_module("benchmarks.peers.by_pylinkage").entries(swept, d, theta, many=True)


def turns(swept: Swept, theta: Array) -> list[Entry]:
    """Every peer on the file's own design, where it has what the linkage needs."""
    found: list[Entry] = []
    for name in installed():
        module = import_module(f"benchmarks.peers.{PACKAGES[name]}")
        if name == "pylinkage":
            found += module.entries(swept, swept.base()[:, None], theta, many=False)
        elif swept.only_turning:
            found += module.entries(swept, theta)
    return found
