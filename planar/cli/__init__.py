"""The command line: words to calls."""

from planar.cli import analysing, assembling, circling, describing, drawing, loading, showing, solving
from planar.cli.shared import main

__all__ = ["analysing", "assembling", "circling", "describing", "drawing", "loading", "main", "showing", "solving"]
