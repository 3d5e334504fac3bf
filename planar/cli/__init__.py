"""The command line: words to calls."""

from planar.cli import analysing, assembling, describing, drawing, loading, solving
from planar.cli.shared import main

__all__ = ["analysing", "assembling", "describing", "drawing", "loading", "main", "solving"]
