"""The command line: words to calls."""

from planar.cli.options import main

main.modules = {
    "animate": "planar.cli.commands.plot_animate",
    "balance": "planar.cli.commands.design.balancing",
    "bench": "planar.cli.commands.inspect_models_schema_bench",
    "calibrate": "planar.cli.commands.design.calibrate",
    "cams": "planar.cli.commands.cams",
    "centres": "planar.cli.commands.centres_harmonics",
    "chains": "planar.cli.commands.design.chains",
    "circuits": "planar.cli.commands.circuits",
    "cognates": "planar.cli.commands.design.cognates",
    "convert": "planar.cli.commands.convert",
    "cycle": "planar.cli.commands.solve_cycle_explain",
    "edit": "planar.cli.commands.edit",
    "explain": "planar.cli.commands.solve_cycle_explain",
    "forces": "planar.cli.commands.forces_simulate",
    "gallery": "planar.cli.commands.view_gallery",
    "generate": "planar.cli.commands.design.generate",
    "guide": "planar.cli.commands.guide",
    "harmonics": "planar.cli.commands.centres_harmonics",
    "inspect": "planar.cli.commands.inspect_models_schema_bench",
    "mark": "planar.cli.commands.problem_mark",
    "models": "planar.cli.commands.inspect_models_schema_bench",
    "modes": "planar.cli.commands.modes",
    "parts": "planar.cli.commands.design.parts",
    "plot": "planar.cli.commands.plot_animate",
    "problem": "planar.cli.commands.problem_mark",
    "schema": "planar.cli.commands.inspect_models_schema_bench",
    "sensitivity": "planar.cli.commands.design.sensitivity",
    "simulate": "planar.cli.commands.forces_simulate",
    "solve": "planar.cli.commands.solve_cycle_explain",
    "synthesise": "planar.cli.commands.design.synthesise",
    "tolerance": "planar.cli.commands.design.tolerance",
    "view": "planar.cli.commands.view_gallery",
}

__all__ = ["main"]
