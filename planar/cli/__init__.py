"""The command line: words to calls."""

from planar.cli import (
    centres_harmonics,
    circuits,
    forces_simulate,
    guide,
    inspect_models_schema_bench,
    modes,
    plot_animate,
    problem_mark,
    solve_cycle_explain,
    view_gallery,
)
from planar.cli.options import main

for _command in main.commands.values():
    _command.short_help = _command.help  # of one sentence: the list of commands has it whole

__all__ = [
    "centres_harmonics",
    "circuits",
    "forces_simulate",
    "guide",
    "inspect_models_schema_bench",
    "main",
    "modes",
    "plot_animate",
    "problem_mark",
    "solve_cycle_explain",
    "view_gallery",
]
