"""The commands `view` and `gallery`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from planar.cli.exit_status import NO_ANSWER
from planar.cli.options import (
    at_option,
    frame_number_option,
    input_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    output_option,
    parse_drives,
    read_model,
    refuse_overwriting,
    refuse_settings,
    show_status,
    timeout_option,
)
from planar.foundation.errors import unknown_format_error

SUFFIXES = (".html", ".htm")


@main.command()
@model_argument()
@frame_number_option
@output_option(
    "Write the page to an .html file; left out, it is written to a folder of its own and opened in the browser."
)
@at_option
@input_option
@mode_option
@click.option(
    "--task",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    metavar="TASK",
    help="Show what a task wants under it, to be dragged: its free dimensions follow.",
)
def view(
    model: str, output: Path | None, at: tuple[str, ...], pair: str | None, mode: int | None, task: Path | None
) -> None:
    """A page to take hold of it: it moves, with its numbers, and with other dimensions.

    The input that runs first is the first with a velocity, unless --input names another.
    """
    from planar.pages.view import view as write
    from planar.solving.position import solve, solved_mechanism

    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise unknown_format_error(output.suffix, "a page", SUFFIXES)
    mechanism = load_model(model, mode, advice="")
    refuse_overwriting(model, output)
    if task is not None:
        refuse_overwriting(str(task), output, "the task's own file")
    with show_status(mechanism.name):
        moved = parse_drives(mechanism, at)
        written = write(solve(mechanism, moved) if moved else mechanism, output, task=task, pair=pair)
        problem = solved_mechanism(mechanism).motion_refusal()
    click.echo(str(written))
    if problem is not None:
        click.echo(f"planar: {problem}", err=True)
        if mechanism.inputs:
            sys.exit(NO_ANSWER)


@main.command()
@model_argument("models", nargs=-1, metavar="[MODEL]...")
@timeout_option
@click.option(
    "-o",
    "output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    required=True,
    help="The folder for the pages and their index.",
)
def gallery(models: tuple[str, ...], output: Path) -> None:
    """A page for each model, and an index of small moving pictures; without models of all that come along."""
    from planar.document import LINK_PREFIX
    from planar.document.files import PIPED, find_model_file, model_files
    from planar.pages.gallery import write_gallery as write

    if not models:
        refuse_settings()
    named = models or tuple(map(str, model_files()))
    words = {PIPED: "piped"} | {model: "link" for model in named if model.startswith(LINK_PREFIX)}
    files = [words.get(model) or find_model_file(model).stem for model in named]
    with limited_time(f"{len(files)} pages", returns_part=True):
        each = [(name, read_model(model)) for name, model in zip(files, named, strict=True)]
        index, refused = write(each, output)
    for name, problem in refused:
        click.echo(f"planar: {name}: {problem}", err=True)
    click.echo(str(index))
