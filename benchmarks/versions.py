"""What was measured, and on what."""

from __future__ import annotations

import platform
from importlib.metadata import version
from importlib.util import find_spec
from os import cpu_count
from pathlib import Path

import planar
from benchmarks import peers
from benchmarks.limit import compiler_version

LIBRARIES = ("numpy", "casadi", "llvmlite", "scipy", "networkx")


def versions() -> str:
    """One line: planar, Python, the libraries that do the work, the peers, the C compiler, the processor."""
    return f"{_own_versions()}; {peers.versions()}; {compiler_version()}; {_machine()}"


def planar_versions() -> str:
    """One line without the compiler and the peers."""
    return f"{_own_versions()}; {_machine()}"


def _own_versions() -> str:
    libraries = ", ".join(f"{name} {version(name)}" for name in LIBRARIES if find_spec(name))
    return f"planar {planar.__version__}, Python {platform.python_version()}, {libraries}"


def _machine() -> str:
    return f"{_processor()}, {cpu_count()} cores"


def _processor() -> str:
    """The processor's name as its maker writes it, where the system tells."""
    told = Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
