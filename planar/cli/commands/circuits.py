"""The command `circuits`."""

from __future__ import annotations

import sys
from pathlib import Path

import click

from planar.cli.exit_status import no_answer_status
from planar.cli.options import (
    at_option,
    input_option,
    json_option,
    limited_time,
    main,
    model_argument,
    output_option,
    parse_drives,
    print_or_write,
    read_model,
    refuse_overwriting,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput


@main.command()
@model_argument()
@json_option
@input_option
@at_option
@timeout_option
@output_option("Write the tables to a .txt, .svg or .html file.")
def circuits(model: str, as_json: bool, pair: str | None, at: tuple[str, ...], output: Path | None) -> None:
    """All circuits while an input runs, their branches, and where it goes together."""
    from planar.assemblies.circuits.circuits import circuits as all_circuits
    from planar.assemblies.modes import modes
    from planar.reports.tables.circuits import record, table

    if as_json and output is not None:
        raise BadInput("-o", "tables go to a file or SI values are printed with --json; give one of the two")
    mechanism = read_model(model)
    refuse_overwriting(model, output)
    with limited_time(f"{mechanism.name}: circuits", returns_part=True):
        here = modes(mechanism, parse_drives(mechanism, at), certify=False)
        found = all_circuits(here.mechanism, pair)
        told = record(found, here) if as_json else table(found, here)
    if as_json:
        print_json(told, indent=1)
    else:
        print_or_write(told, output)
    if not here:
        click.echo(f"planar: {here.refusal()}", err=True)
        sys.exit(no_answer_status(here.outcome))
