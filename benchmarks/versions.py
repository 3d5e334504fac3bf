"""What was measured, and on what."""

from __future__ import annotations

import platform
import tomllib
from importlib.metadata import version
from os import cpu_count
from pathlib import Path


def versions() -> str:
    """One line: planar, Python, the libraries that do the work, the processor."""
    libraries = ", ".join(f"{name} {version(name)}" for name in ("numpy", "casadi", "scipy", "networkx"))
    return f"planar {_planar()}, Python {platform.python_version()}, {libraries}; {_processor()}, {cpu_count()} cores"


def _planar() -> str:
    """The version in the project file beside this folder, which is the one that is measured, installed or not."""
    project = Path(__file__).parents[1] / "pyproject.toml"
    return tomllib.loads(project.read_text())["project"]["version"]


def _processor() -> str:
    """The processor's name as its maker writes it, where the system tells."""
    told = Path("/proc/cpuinfo")
    lines = told.read_text().splitlines() if told.exists() else []
    names = [line.partition(":")[2].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
