"""The command `sensitivity`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planar.cli.options import (
    at_option,
    json_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    motion_options,
    output_option,
    parse_drives,
    print_or_write,
    refuse_options,
    refuse_overwriting,
    run_motion,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput

if TYPE_CHECKING:
    from planar.dynamics.forces import Forces
    from planar.results.motion import Motion, State


@main.command()
@model_argument()
@json_option
@timeout_option
@at_option
@mode_option
@click.option("--of", "of", required=True, metavar="NAME", help="A point, a link, a pair or an input.")
@click.option("--result", metavar="NAME", help="Which of its results, as velocity; left out: the first.")
@click.option("--forces", "with_forces", is_flag=True, help="Also efforts of inputs and forces of pairs.")
@click.option("--static", is_flag=True, help="With --forces: leave the links' inertia out.")
@click.option("--cycle", "whole", is_flag=True, help="Over the whole motion, as `planar cycle` has it.")
@motion_options
@output_option("Write the table to a .txt, .svg or .html file.")
def sensitivity(  # many: options of the command
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    mode: int | None,
    of: str,
    result: str | None,
    with_forces: bool,
    static: bool,
    whole: bool,
    output: Path | None,
    **course: Any,
) -> None:
    """How a result changes with every number of the file, exactly, the greatest influence first."""
    if as_json and output is not None:
        raise BadInput("-o", "the table goes to a file or SI values are printed with --json; give one of the two")
    if whole and at:
        raise BadInput("--at", "a whole motion has no one position; say where it starts with --from")
    if not whole:
        refuse_options(course, "this is for a whole motion, with --cycle")
    if static and not with_forces:
        raise BadInput("--static", "this is for forces, with --forces")
    from planar.analysis.sensitivity.sensitivity import sensitivity as derivatives
    from planar.reports.tables.design.sensitivity import record, table
    from planar.solving.position import solve

    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    with limited_time(f"{mechanism.name}: derivatives"):
        moving = run_motion(mechanism, **course) if whole else solve(mechanism, parse_drives(mechanism, at))
        found = derivatives(_forces(moving, static) if with_forces else moving, of)
        if result is not None and result not in found.slopes:
            limits = "; stroke, swing, time ratio and dead points stand below the table of a motion, with --cycle"
            raise BadInput("--result", f"of {of!r} are told {', '.join(found.slopes)}, and no {result!r}{limits}")
        told = record(found) if as_json else table(found, result)
    if as_json:
        print_json(told, indent=1)
        return
    print_or_write(told, output)


def _forces(moving: State | Motion, static: bool) -> Forces:
    from planar.dynamics.forces import forces
    from planar.dynamics.load_validation import require_loads

    require_loads(moving.mechanism)
    return forces(moving, not static)
