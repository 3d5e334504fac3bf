"""The commands `forces` and `simulate`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from planar.cli.options import (
    at_option,
    frame_number_option,
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
    report_motion,
    run_motion,
    steps_option,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput

if TYPE_CHECKING:
    from planar.dynamics.friction.holding import Holding
    from planar.model.mechanism import Mechanism

ONE_DESTINATION = "results go to a file or are printed with --json; give one of the two"


@main.command()
@model_argument()
@json_option
@timeout_option
@at_option
@mode_option
@frame_number_option
@click.option("--static", is_flag=True, help="Leave the links' inertia out: at rest, or in slow motion.")
@click.option("--without-friction", "frictionless", is_flag=True, help="Leave the friction of the pairs out.")
@click.option("--cycle", "whole", is_flag=True, help="Over the whole motion, as `planar cycle` has it.")
@click.option(
    "--over",
    metavar="INPUTS",
    help="Worst cases over several inputs, each in its range: 'O,P' or 'O=10deg:50deg,P'; --steps says how finely.",
)
@click.option(
    "--fluctuation",
    type=float,
    metavar="NUMBER",
    help="With --cycle: the flywheel for this coefficient of fluctuation of speed, as 0.02.",
)
@click.option(
    "--rim-radius", metavar="LENGTH", help="With --fluctuation: the mass of its rim at this radius, as 400mm."
)
@click.option(
    "--solve-for",
    metavar="LOAD",
    help="Which size of this load, spring or mass holds it: loads.0, springs.0, masses.rod.",
)
@click.option(
    "--effort",
    metavar="EFFORT",
    help="With --solve-for: what the input is to supply, as '5 N m', in place of nothing. Without, at rest with "
    "friction: how much of each load is held with it.",
)
@motion_options
@output_option(
    "Write the tables to a .txt, .svg or .html file; with --cycle every position to .csv, .xlsx, .json, .npz, .parquet."
)
# many: options of the command
def forces(
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    mode: int | None,
    static: bool,
    frictionless: bool,
    whole: bool,
    over: str | None,
    fluctuation: float | None,
    rim_radius: str | None,
    solve_for: str | None,
    effort: str | None,
    output: Path | None,
    **course: Any,
) -> None:
    """What the inputs supply and the pairs carry against loads, weights, springs, friction and inertia.

    Also the torques that hold wheels of the frame (an annulus, for example), what stops carry if an input is released,
    and the mechanical advantage along the path of each loaded point and along each load.
    """
    if as_json and output is not None:
        raise BadInput("-o", ONE_DESTINATION)
    if whole and at:
        raise BadInput("--at", "the forces of a whole motion have no one position; say where it starts with --from")
    if whole and effort is not None and solve_for is None:
        raise BadInput("--effort", "how much of each load is held is told at one position; leave --cycle out")
    if over is not None:
        _refuse_beside_over((("--at", at), ("--cycle", whole), ("--solve-for", solve_for), ("--effort", effort)))
    if not whole:
        refuse_options(
            set(course) - ({"steps"} if over else set()) | {"fluctuation", "rim_radius"},
            "this is for the forces of a whole motion, with --cycle",
        )
    if rim_radius is not None and fluctuation is None:
        raise BadInput("--rim-radius", "this is the radius of a flywheel; say for which --fluctuation")
    from planar.dynamics.load_validation import require_loads

    mechanism, taken = load_model(model, mode), (not static, not frictionless)
    refuse_overwriting(model, output)
    require_loads(mechanism)
    if over is not None:
        from planar.cli.commands.force_map import show_force_map

        steps = int(course["steps"]) if _is_given("steps") else None
        show_force_map(mechanism, over, steps, taken, as_json, output)
        return
    given = None if effort is None else _parse_effort(mechanism, effort)
    if effort is not None and solve_for is None:
        _require_held_loads(mechanism)
    if whole:
        _forces_over_motion(mechanism, taken, as_json, output, (fluctuation, rim_radius, solve_for, given), course)
    else:
        _forces_at_position(mechanism, at, taken, as_json, output, (solve_for, given))


def _refuse_beside_over(options: Iterable[tuple[str, Any]]) -> None:
    for option, value in options:
        if value:
            raise BadInput(option, "worst cases over several inputs are told without; leave it out, or --over")


def _is_given(option: str) -> bool:
    return click.get_current_context().get_parameter_source(option) is ParameterSource.COMMANDLINE


def _require_held_loads(mechanism: Mechanism) -> None:
    """Refuse an effort where no friction holds anything."""
    if not any(pair.has_friction for pair in mechanism.pairs):
        told = "no pair has friction, so that nothing is held at rest; name the load that is wanted by --solve-for"
        raise BadInput("--effort", told)
    if not mechanism.loads:
        raise BadInput("--effort", "there is no load that friction could hold; name what is wanted by --solve-for")


def _parse_effort(mechanism: Mechanism, text: str) -> float:
    """An effort of the input (N m, at a slide N)."""
    from planar.document import read_effort

    if len(mechanism.inputs) != 1:
        raise BadInput("--effort", "this is the effort of the one input, and there are several")
    return read_effort(mechanism, mechanism.inputs[0].pair, text, "--effort")


def _forces_at_position(
    mechanism: Mechanism,
    at: tuple[str, ...],
    taken: tuple[bool, bool],
    as_json: bool,
    output: Path | None,
    asked: tuple[str | None, float | None],
) -> None:
    """The forces at one position, inertia and friction `taken` into account or not; a load is `asked` for an effort."""
    from rich.console import Group

    from planar.analysis.efforts.unknown_load import unknown_load
    from planar.analysis.motion.mechanical_advantage import advantages
    from planar.analysis.worked.published import compare_published
    from planar.dynamics.forces import forces as at_state
    from planar.dynamics.friction.holding import holding, load_names
    from planar.reports.tables.forces.friction import held_loads_table, held_record
    from planar.reports.tables.forces.position_forces import record, tables
    from planar.solving.position import solve

    moved = parse_drives(mechanism, at)
    load, effort = asked
    with limited_time(mechanism.name):
        state = solve(mechanism, moved)
        found, ratios = at_state(state, *taken), advantages(state)
        unknown = None if load is None else unknown_load(state, load, effort or 0.0, None, *taken)
        held: tuple[Holding, ...] = ()
        if load is None and effort is not None:
            held = tuple(holding(state, name, effort) for name in load_names(mechanism))
        printed = (
            [] if moved else [each for each in compare_published(state) if each.published.quantity == "input torque"]
        )
    if as_json:
        print_json(
            record(found, ratios, printed, unknown) | ({"held_loads": held_record(held)} if held else {}), indent=1
        )
        return
    shown = tables(found, ratios, printed, unknown)
    print_or_write(Group(shown, held_loads_table(held)) if held else shown, output)


def _forces_over_motion(
    mechanism: Mechanism,
    taken: tuple[bool, bool],
    as_json: bool,
    output: Path | None,
    asked: tuple[float | None, str | None, str | None, float | None],
    course: dict[str, Any],
) -> None:
    """The forces over a whole motion; and what is asked: a flywheel's fluctuation and radius, a load for an effort."""
    from planar.analysis.efforts.unknown_load import unknown_load
    from planar.document import read_length
    from planar.dynamics.forces import forces as over_motion
    from planar.reports.files.run_formats import check_writable
    from planar.reports.tables.forces.flywheels import wanted_flywheel
    from planar.reports.tables.forces.forces_over_motion import force_series, run_facts, tables

    if output is not None:
        check_writable(output.suffix)
    with limited_time(f"{mechanism.name}: {course['steps']} steps", returns_part=True):
        motion = run_motion(mechanism, **course)
        found = over_motion(motion, *taken)
        fluctuation, radius, load, effort = asked
        length = None if radius is None else read_length(mechanism, radius, "--rim-radius")
        wheel = wanted_flywheel(found, fluctuation, length)
        unknown = None if load is None else unknown_load(motion, load, effort or 0.0, None, *taken)
    report_motion(
        motion,
        as_json,
        output,
        lambda: [tables(found, wheel, unknown)],
        force_series(found),
        lambda: run_facts(found, wheel, unknown),
    )


@main.command()
@model_argument()
@json_option
@click.option("--duration", required=True, metavar="TIME", help="How long: 2s, 500ms.")
@steps_option
@mode_option
@click.option(
    "--drive",
    "driven",
    multiple=True,
    metavar="PAIR",
    help="An input that keeps to its law, or the file's velocity and acceleration, though it has a motor or no law.",
)
@click.option("--moving", is_flag=True, help="Start with the file's velocities, not from rest.")
@click.option(
    "--diagrams",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw displacement, velocity and acceleration over time, what friction holds shaded.",
)
@click.option(
    "--of", multiple=True, metavar="NAME", help="With --diagrams: the slide, link, point or pair that is drawn."
)
@timeout_option
@output_option("Write positions, velocities, accelerations, energies to a .csv, .xlsx, .json, .npz or .parquet file.")
# many: options of the command
def simulate(
    model: str,
    as_json: bool,
    duration: str,
    steps: int,
    mode: int | None,
    driven: tuple[str, ...],
    moving: bool,
    diagrams: Path | None,
    of: tuple[str, ...],
    output: Path | None,
) -> None:
    """The mechanism let go: its motion in time under loads, weights, springs and friction."""
    from planar.document import read_time
    from planar.dynamics.simulation import simulate as let_go
    from planar.reports.files.run_formats import check_writable
    from planar.reports.tables.simulation import energy_series, simulation_facts, tables

    if as_json and output is not None:
        raise BadInput("-o", ONE_DESTINATION)
    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    refuse_overwriting(model, diagrams)
    if of and diagrams is None:
        raise BadInput("--of", "this says what diagrams are of; say where to with --diagrams")
    if output is not None:
        check_writable(output.suffix)
    with limited_time(mechanism.name, returns_part=True):
        try:
            found = let_go(mechanism, read_time(duration, "--duration"), steps, driven, moving=moving)
        except BadInput as problem:
            raise (BadInput("--drive", problem.sentence) if problem.place == "driven" else problem) from None
    if diagrams is not None:
        from planar import plot as drawn

        drawn.save(drawn.diagrams(found, of or None), diagrams)
    report_motion(
        found.motion, as_json, output, lambda: [tables(found)], energy_series(found), lambda: simulation_facts(found)
    )
