"""The commands that solve a position or a motion."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planar.cli.options import (
    MODE_ADVICE,
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
    refuse_overwriting,
    report_motion,
    run_motion,
    scale_option,
    show_status,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput, unknown_format_error

if TYPE_CHECKING:
    from rich.console import RenderableType

    from planar.analysis.motion.answers import Answers
    from planar.analysis.worked.published import Comparison
    from planar.results.motion import Motion, State
    from planar.results.records import RelativeState

PAGES = (".pdf", ".png")
"""Files of pages with drawings."""
ADDED_PARTS = ("centres", "forces")
"""What `explain --with` adds to a worked solution."""


@main.command()
@model_argument()
@json_option
@at_option
@mode_option
@click.option(
    "--relative",
    "relative",
    multiple=True,
    metavar="POINT,POINT[,LINK]",
    help="Also how the first point moves against the second, in parts, in the axes of a link that carries the second.",
)
@output_option("Write the tables to a .txt, .svg or .html file.")
def solve(
    model: str, as_json: bool, at: tuple[str, ...], mode: int | None, relative: tuple[str, ...], output: Path | None
) -> None:
    """This position: mobility, all positions, velocities, accelerations, rubbing speeds."""
    state, comparisons = _solve_model(model, mode, at, as_json, output)
    relatives = {text: _relative_motion(state, text) for text in relative}
    if as_json:
        from planar.reports.files.json_values import record

        print_json(record(state, comparisons, relatives), indent=1)
        return
    from planar.reports.tables.position import solution_tables

    print_or_write(solution_tables(state, comparisons, relatives), output)


@main.command()
@model_argument()
@json_option
@at_option
@mode_option
@frame_number_option
@scale_option
@click.option(
    "--input", "pair", metavar="PAIR", help="The input that has a unit rate, where no input of the file has a velocity."
)
@click.option(
    "--with",
    "also",
    metavar="PARTS",
    help=f"What is added behind it: {' and '.join(ADDED_PARTS)}, or both with a comma between.",
)
@output_option("Write the text to a .txt, .svg or .html file, or pages with drawings to scale to a .pdf or .png file.")
def explain(  # many: one for each option
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    mode: int | None,
    scales: tuple[str, ...],
    pair: str | None,
    also: str | None,
    output: Path | None,
) -> None:
    """The worked solution: vector equations and tables, both polygons step by step, results."""
    from planar.drawing.paper.scales import parse_scales as read

    parts = _read_parts(also)
    if parts and as_json:
        raise BadInput(
            "--with", "what is added has records of its own: `planar centres --json`, `planar forces --json`"
        )

    on_pages = output is not None and output.suffix.lower() in PAGES
    if output is not None and not on_pages:
        from planar.reports.files.table_files import SUFFIXES

        if output.suffix not in SUFFIXES:
            raise unknown_format_error(output.suffix, "a worked solution", (*SUFFIXES, *PAGES))
    state, comparisons = _solve_model(model, mode, at, as_json, output, advice="", pair=pair)
    given = read(scales, units=state.mechanism.units)
    if output is not None and on_pages:
        from planar.drawing.output.solution_pages import encode_sheets, solution_pages
        from planar.foundation.safe_files import save_file

        with show_status(state.mechanism.name):
            notes = _missing_parts(state, parts)
            pages = solution_pages(state, comparisons, given, notes=notes) + _added_pages(state, parts)
            save_file(output, encode_sheets(pages, output.suffix))
        return
    from planar.analysis.worked.solution import worked_solution
    from planar.reports.tables.worked_solution import record, solution_text

    solution = worked_solution(state, comparisons)
    if as_json:
        print_json(record(solution, given), indent=1)
        return
    print_or_write(_with_parts(solution_text(solution, given), state, parts), output)


def _read_parts(also: str | None) -> tuple[str, ...]:
    """The parts that `--with` names."""
    parts = tuple(dict.fromkeys(part.strip() for part in (also or "").split(",") if part.strip()))
    for part in parts:
        if part not in ADDED_PARTS:
            raise BadInput("--with", f"there is no part {part!r:.40}; parts are {' and '.join(ADDED_PARTS)}")
    return parts


def _missing_parts(state: State, parts: tuple[str, ...]) -> list[str]:
    """A sentence for each part of `--with` that the file gives nothing for."""
    from planar.dynamics.load_validation import missing_loads

    message = missing_loads(state.mechanism) if "forces" in parts else ""
    return [f"no forces are shown: {message}"] if message else []


def _added_pages(state: State, parts: tuple[str, ...]) -> list[Any]:
    """The pages of what `--with` adds."""
    from planar import plot

    makers = {"centres": lambda: [plot.centres(state)]}
    if not _missing_parts(state, parts):
        makers["forces"] = lambda: plot.forces(state)
    return [page for part in parts if part in makers for page in makers[part]()]


def _with_parts(text: RenderableType, state: State, parts: tuple[str, ...]) -> RenderableType:
    """A text with the tables of what `--with` adds."""
    if not parts:
        return text
    from rich.console import Group
    from rich.text import Text

    found = [text]
    if "centres" in parts:
        from planar.analysis.centres.centres import centres
        from planar.reports.tables.centres import table

        found += [Text(), table(centres(state))]
    missing = _missing_parts(state, parts)
    found += [Text(), *(Text(f"- {sentence}") for sentence in missing)] if missing else []
    if "forces" in parts and not missing:
        from planar.analysis.motion.mechanical_advantage import advantages
        from planar.dynamics.forces import forces
        from planar.reports.tables.forces.position_forces import tables

        found += [Text(), tables(forces(state), advantages(state))]
    return Group(*found)


def _solve_model(  # many: one for each option
    model: str,
    mode: int | None,
    at: tuple[str, ...],
    as_json: bool,
    output: Path | None,
    advice: str = MODE_ADVICE,
    pair: str | None = None,
) -> tuple[State, tuple[Comparison, ...]]:
    """A model's position, moved to where `--at` says, with its published values unless it was moved.

    `pair` names an input with a unit rate. Raises BadInput where an input of the file has a rate.
    """
    from planar.analysis.worked.published import compare_published
    from planar.model.mechanism import has_input_rates, with_unit_rate
    from planar.solving.position import solve

    if as_json and output is not None:
        raise BadInput("-o", "tables go to a file or SI values are printed with --json; give one of the two")
    mechanism = load_model(model, mode, advice)
    refuse_overwriting(model, output)
    if pair is not None:
        if has_input_rates(mechanism):
            raise BadInput("--input", "it names an input with a unit rate, but an input of the file has a velocity")
        mechanism = with_unit_rate(mechanism, pair)
    moved = parse_drives(mechanism, at)
    state = solve(mechanism, moved)
    return state, () if moved else compare_published(state)


@main.command()
@model_argument()
@json_option
@motion_options
@mode_option
@click.option("--jerk", is_flag=True, help="Third rates as well.")
@click.option(
    "--of",
    "asked",
    multiple=True,
    metavar="NAME",
    help="Also what is asked of a pair, link or point: stroke or swing, greatest speed, time ratio, dwells, area, ...",
)
@timeout_option
@output_option("Write positions, velocities and accelerations to a .csv, .xlsx, .json, .npz or .parquet file.")
def cycle(
    model: str,
    as_json: bool,
    mode: int | None,
    jerk: bool,
    asked: tuple[str, ...],
    output: Path | None,
    steps: int,
    **course: Any,
) -> None:
    """The whole motion: position to position through the range of an input, or in time by the inputs' laws.

    Where the file gives no velocity, rates are those at the unit rate of the input that runs, and a remark says so.
    """
    from planar.model.mechanism import with_unit_rate

    if as_json and output is not None:
        raise BadInput("-o", "a run goes to a file or is printed with --json; give one of the two")
    mechanism = load_model(model, mode)
    if course["duration"] is None:  # in time, an input without a rate stands still
        mechanism = with_unit_rate(mechanism, course["pair"])
    refuse_overwriting(model, output)
    if output is not None:
        from planar.reports.files.run_formats import check_writable

        check_writable(output.suffix)
    with limited_time(f"{mechanism.name}: {steps} steps", returns_part=True):
        motion = run_motion(mechanism, steps, **course, jerk=jerk)
        if not as_json:
            motion.limits  # noqa: B018 - solved for while the sign is up
        told = {name: _answers(motion, name) for name in asked}

    def shown() -> Iterator[RenderableType]:
        from planar.reports.tables.motion import motion_tables

        yield motion_tables(motion)
        if told:
            from planar.reports.tables.answers import tables

            yield tables(motion, told)

    said = {}
    if told:
        from planar.reports.tables.answers import record

        said = {"answers": record(told)}
    report_motion(motion, as_json, output, shown, facts=lambda: said)


def _answers(motion: Motion, name: str) -> tuple[Answers, ...]:
    """What `--of` asks for."""
    from planar.analysis.motion.answers import answers
    from planar.foundation.errors import Unknown

    try:
        return answers(motion, name)
    except Unknown as problem:
        raise BadInput("--of", str(problem)) from None


def _relative_motion(state: State, text: str) -> RelativeState:
    """The relative motion that `--relative` asks for."""
    from planar.foundation.errors import Unknown

    names = [name.strip() for name in text.split(",")]
    if len(names) not in (2, 3):
        raise BadInput("--relative", f"{text!r} is not of the form POINT,POINT or POINT,POINT,LINK, such as C,B")
    try:
        return state.relative(*names)
    except Unknown as problem:
        raise BadInput("--relative", str(problem)) from None
