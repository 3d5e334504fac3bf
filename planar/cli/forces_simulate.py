"""The commands of forces: what they are in a motion that is given, and what motion comes of them."""

from __future__ import annotations

import json
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from planar.cli.options import (
    advancing,
    as_json,
    at,
    busy,
    cycled,
    drives,
    loaded,
    main,
    moded,
    output,
    run,
    show,
    spare,
    stepped,
    tell,
)
from planar.foundation.errors import BadInput

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism

ONE_PLACE = "results go to a file or are printed with --json; give one of the two"


@main.command()
@click.argument("model")
@as_json
@at
@moded
@click.option("--static", is_flag=True, help="Leave the links' inertia out: at rest, or in slow motion.")
@click.option("--cycle", "whole", is_flag=True, help="Over the whole motion, as `planar cycle` has it.")
@cycled
@output("Write the tables to a .txt, .svg or .html file; with --cycle every position to .csv, .json, .npz or .parquet.")
def forces(
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    mode: int | None,
    static: bool,
    whole: bool,
    output: Path | None,
    **course: Any,
) -> None:
    """What the inputs supply and the pairs carry against loads, weights, springs and inertia."""
    if as_json and output is not None:
        raise BadInput("-o", ONE_PLACE)
    if whole and at:
        raise BadInput("--at", "the forces of a whole motion have no one position; say where it starts with --from")
    if not whole:
        _refuse(course)
    from planar.dynamics.load_validation import refuse_unloaded

    mechanism = loaded(model, mode)
    spare(model, output)
    refuse_unloaded(mechanism)
    if whole:
        _over(mechanism, not static, as_json, output, course)
    else:
        _here(mechanism, at, not static, as_json, output)


def _refuse(course: Iterable[str]) -> None:
    """Refuse options of a whole motion, which would not be heeded."""
    context = click.get_current_context()
    for option in context.command.params:
        if option.name in course and context.get_parameter_source(option.name) is ParameterSource.COMMANDLINE:
            raise BadInput(option.opts[0], "this is for the forces of a whole motion, with --cycle")


def _here(mechanism: Mechanism, at: tuple[str, ...], inertia: bool, as_json: bool, output: Path | None) -> None:
    """The forces at one position."""
    from planar.analysis.motion.mechanical_advantage import advantages
    from planar.analysis.worked.published import compare
    from planar.dynamics.forces import forces as at_state
    from planar.reports.tables.forces import record, tables
    from planar.solving.position import solve

    moved = drives(mechanism, at)
    with busy(mechanism.name):
        state = solve(mechanism, moved)
        found, ratios = at_state(state, inertia), advantages(state)
        printed = [] if moved else [each for each in compare(state) if each.published.quantity == "input torque"]
    if as_json:
        click.echo(json.dumps(record(found, ratios, printed), ensure_ascii=False, indent=1, allow_nan=False))
        return
    show(tables(found, ratios, printed), output)


def _over(mechanism: Mechanism, inertia: bool, as_json: bool, output: Path | None, course: dict[str, Any]) -> None:
    """The forces over a whole motion."""
    from planar.dynamics.forces import forces as over_motion
    from planar.reports.files.run_files import writable
    from planar.reports.tables.forces_over_motion import said, tables, told

    if output is not None:
        writable(output.suffix)
    with busy(f"{mechanism.name}: {course['steps']} steps"):
        motion = run(mechanism, **course)
        found = over_motion(motion, inertia)
    tell(motion, as_json, output, lambda: [tables(found)], told(found), said(found))


@main.command()
@click.argument("model")
@as_json
@click.option("--duration", required=True, metavar="TIME", help="How long: 2s, 500ms.")
@stepped
@moded
@click.option(
    "--drive",
    "driven",
    multiple=True,
    metavar="PAIR",
    help="An input that keeps to the file's velocity and acceleration; one with a law keeps to it anyway.",
)
@click.option("--moving", is_flag=True, help="Start with the file's velocities, not from rest.")
@output("Write positions, velocities, accelerations and energies to a .csv, .json, .npz or .parquet file.")
def simulate(
    model: str,
    as_json: bool,
    duration: str,
    steps: int,
    mode: int | None,
    driven: tuple[str, ...],
    moving: bool,
    output: Path | None,
) -> None:
    """The mechanism let go: its motion in time under loads, weights and springs."""
    from planar.document import read_time
    from planar.dynamics.simulation import simulate as let_go
    from planar.reports.files.run_files import writable
    from planar.reports.tables.simulation import said, tables, told

    if as_json and output is not None:
        raise BadInput("-o", ONE_PLACE)
    mechanism = loaded(model, mode)
    spare(model, output)
    if output is not None:
        writable(output.suffix)
    with advancing(mechanism.name) as progress:
        tick = None if progress is None else lambda done: progress(done, 1.0)
        found = let_go(mechanism, read_time(duration, "--duration"), steps, driven, moving=moving, tick=tick)
    tell(found.motion, as_json, output, lambda: [tables(found)], told(found), said(found))
