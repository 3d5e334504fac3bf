"""The command line: words to calls."""

from planar.cli.options import main

main.modules = {
    "animate": "planar.cli.plot_animate",
    "bench": "planar.cli.inspect_models_schema_bench",
    "calibrate": "planar.cli.measured.calibrate",
    "cams": "planar.cli.cams",
    "centres": "planar.cli.centres_harmonics",
    "circuits": "planar.cli.circuits",
    "cycle": "planar.cli.solve_cycle_explain",
    "explain": "planar.cli.solve_cycle_explain",
    "forces": "planar.cli.forces_simulate",
    "gallery": "planar.cli.view_gallery",
    "guide": "planar.cli.guide",
    "harmonics": "planar.cli.centres_harmonics",
    "inspect": "planar.cli.inspect_models_schema_bench",
    "mark": "planar.cli.problem_mark",
    "models": "planar.cli.inspect_models_schema_bench",
    "modes": "planar.cli.modes",
    "plot": "planar.cli.plot_animate",
    "problem": "planar.cli.problem_mark",
    "schema": "planar.cli.inspect_models_schema_bench",
    "sensitivity": "planar.cli.sensitivity",
    "simulate": "planar.cli.forces_simulate",
    "solve": "planar.cli.solve_cycle_explain",
    "view": "planar.cli.view_gallery",
}

__all__ = ["main"]
