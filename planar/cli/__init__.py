"""The command line: words to calls."""

from planar.cli import analysing, assembling, circling, describing, drawing, showing, solving
from planar.cli.shared import main

__all__ = ["analysing", "assembling", "circling", "describing", "drawing", "main", "showing", "solving"]
