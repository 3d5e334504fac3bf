"""The command line: words to calls."""

from planar.cli import analysing, describing, drawing, solving
from planar.cli.shared import main

__all__ = ["analysing", "describing", "drawing", "main", "solving"]
