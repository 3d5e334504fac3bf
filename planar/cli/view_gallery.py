"""The commands that write pages for a browser."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import advancing, at, busy, drives, loaded, main, moded, output, spare
from planar.foundation.errors import no_format

SUFFIXES = (".html", ".htm")


@main.command()
@click.argument("model")
@output("Write the page to an .html file; left out, it is written to a folder of its own and opened in the browser.")
@at
@moded
def view(model: str, output: Path | None, at: tuple[str, ...], mode: int | None) -> None:
    """A page to take hold of it: it moves, with its numbers, and with other dimensions."""
    from planar.pages.view import view as write
    from planar.solving.position import solve

    if output is not None and output.suffix.lower() not in SUFFIXES:
        raise no_format(output.suffix, "a page", SUFFIXES)
    mechanism = loaded(model, mode)
    spare(model, output)
    with busy(mechanism.name):
        moved = drives(mechanism, at)
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
    from planar.document.files import found, load, model_files
    from planar.pages.gallery import gallery as write

    files = [found(model) for model in models] or list(model_files())
    with advancing(f"{len(files)} pages") as progress:
        index, refused = write([(file.stem, load(file)) for file in files], output, progress)
    for name, problem in refused:
        click.echo(f"planar: {name}: {problem}", err=True)
    click.echo(str(index))
