"""The command `convert`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import (
    apply_settings,
    json_option,
    main,
    model_argument,
    output_option,
    print_or_write,
    refuse_overwriting,
    refuse_settings,
    show_status,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput


@main.command()
@model_argument(required=False)
@output_option("Write the mechanism to this file; its ending chooses the program, .json is planar's own.")
@click.option("--to-format", metavar="NAME", help="The program that it is written for, where no ending says that.")
@click.option("--from-format", metavar="NAME", help="What MODEL is, where it is not to be recognised.")
@click.option("--length-unit", metavar="UNIT", help="The unit of length of a MODEL whose file names none, such as m.")
@click.option("--formats", is_flag=True, help="List the programs whose files are read and written.")
@json_option
def convert(
    model: str | None,
    output: Path | None,
    to_format: str | None,
    from_format: str | None,
    length_unit: str | None,
    formats: bool,
    as_json: bool,
) -> None:
    """Other programs' files to planar's, and planar's to theirs; what cannot be taken over is told."""
    if formats:
        refuse_settings()
        _list_formats(as_json)
        return
    from planar.document.files import read_source
    from planar.reports.files.converted import write_conversion

    if model is None:
        raise BadInput("command line", "name the MODEL to convert, or give --formats")
    refuse_overwriting(model, output)
    mechanism, kind, notes = read_source(model, from_format, length_unit)
    with show_status(mechanism.name):
        found = write_conversion(apply_settings(mechanism), kind, notes, output, to_format)
    if as_json:
        record = {"from": found.source_format, "to": found.target_format, "notes": list(found.notes)}
        print_json(record | ({"written": str(output)} if output else {"text": found.text}))
        return
    if output is None:
        click.echo(found.text, nl=False)
    for note in found.notes:
        click.echo(f"planar: {note}", err=True)


def _list_formats(as_json: bool) -> None:
    """Print the programs whose files are known."""
    from planar.reports.tables.inspection import format_records, formats_table

    if as_json:
        print_json(format_records())
    else:
        print_or_write(formats_table(), None)
