"""The commands that write pages for a browser."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import (
    at_option,
    load_model,
    main,
    mode_option,
    output_option,
    parse_drives,
    refuse_overwriting,
    show_progress,
    show_status,
)
from planar.foundation.errors import unknown_format_error

SUFFIXES = (".html", ".htm")


@main.command()
@click.argument("model")
@output_option(
    "Write the page to an .html file; left out, it is written to a folder of its own and opened in the browser."
)
@at_option
@mode_option
def view(model: str, output: Path | None, at: tuple[str, ...], mode: int | None) -> None:
    """A page to take hold of it: it moves, with its numbers, and with other dimensions."""
    from planar.pages.view import view as write
    from planar.solving.position import solve

    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise unknown_format_error(output.suffix, "a page", SUFFIXES)
    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    with show_status(mechanism.name):
        moved = parse_drives(mechanism, at)
        written = write(solve(mechanism, moved) if moved else mechanism, output)
    click.echo(str(written))


@main.command()
@click.argument("models", nargs=-1, metavar="[MODEL]...")
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
    from planar.document.files import find_model_file, load, model_files
    from planar.pages.gallery import write_gallery as write

    files = [find_model_file(model) for model in models] or list(model_files())
    with show_progress(f"{len(files)} pages") as progress:
        index, refused = write([(file.stem, load(file)) for file in files], output, progress)
    for name, problem in refused:
        click.echo(f"planar: {name}: {problem}", err=True)
    click.echo(str(index))
