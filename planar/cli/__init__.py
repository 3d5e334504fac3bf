"""The command line: words to calls."""

from planar.cli import analysing, assembling, circling, describing, drawing, loading, showing, solving
from planar.cli.shared import main

for _command in main.commands.values():
    _command.short_help = _command.help  # of one sentence: the list of commands has it whole

__all__ = ["analysing", "assembling", "circling", "describing", "drawing", "loading", "main", "showing", "solving"]
