"""The command `cognates`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import (
    json_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    print_or_write,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import unknown_format_error

PICTURES = (".svg", ".pdf", ".png")


@main.command()
@model_argument()
@json_option
@timeout_option
@mode_option
@click.option("--of", "of", required=True, metavar="POINT", help="The point whose path is traced.")
@click.option(
    "--drawing",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw them with the path to a .svg, .pdf or .png file.",
)
@click.option(
    "-o",
    "output",
    type=click.Path(file_okay=False, path_type=Path),
    metavar="FOLDER",
    help="Write each as a mechanism file, cognate-1.json and so on.",
)
def cognates(model: str, as_json: bool, mode: int | None, of: str, drawing: Path | None, output: Path | None) -> None:
    """Other linkages in which a point traces the same path: of a four-bar those of Roberts and Chebyshev."""
    from planar.document.files import dumps
    from planar.foundation.safe_files import make_folder, save_file
    from planar.reports.tables.design.cognates import record, table
    from planar.synthesis.cognates.cognates import cognates as find

    if drawing is not None and drawing.suffix.lower() not in PICTURES:
        raise unknown_format_error(drawing.suffix, "a drawing", PICTURES)
    mechanism = load_model(model, mode)
    with limited_time(f"{mechanism.name}: cognates"):
        found = find(mechanism, of)
    if output is not None:
        make_folder(output)
        for number, each in enumerate(found[1:], 1):
            save_file(output / f"cognate-{number}.json", dumps(each.mechanism))
    if drawing is not None:
        from planar import plot

        plot.save(plot.cognates(found), drawing)
    if as_json:
        print_json(record(found), indent=1)
        return
    print_or_write(table(found), None)
