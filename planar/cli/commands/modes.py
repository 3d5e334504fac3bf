"""The command `modes`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from planar.cli.options import (
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
from planar.foundation.errors import BadInput, Outcome

if TYPE_CHECKING:
    from planar.assemblies.modes import Modes
    from planar.foundation.errors import NoAnswer


@main.command()
@model_argument()
@json_option
@timeout_option
@click.option(
    "--at",
    "at",
    multiple=True,
    metavar="PAIR=POSITION",
    help="The assemblies with an input there: A=75deg, stroke=20mm, or a number in the file's units.",
)
@click.option(
    "--limit", type=click.IntRange(1), default=64, show_default=True, metavar="N", help="Most that are listed."
)
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point whose place is printed.")
@click.option("--certify/--no-certify", default=True, help="Prove every assembly by intervals, or leave it.")
@click.option("--circuits", "circled", is_flag=True, help="Also the circuit and the branch on which each lies.")
@input_option
@output_option("Write the tables to a .txt, .svg or .html file.")
def modes(  # many: options of a command
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    limit: int,
    points: tuple[str, ...],
    certify: bool,
    circled: bool,
    pair: str | None,
    output: Path | None,
) -> None:
    """Every assembly at the given inputs, and whether these are all."""
    from planar.assemblies.circuits.circuits import circuits
    from planar.assemblies.modes import modes as assemblies
    from planar.reports.tables.modes import record, table

    if as_json and output is not None:
        raise BadInput("-o", "tables go to a file or SI values are printed with --json; give one of the two")
    if pair is not None and not circled:
        raise BadInput("--input", "without --circuits no input runs")
    mechanism = read_model(model)
    refuse_overwriting(model, output)
    with limited_time(f"{mechanism.name}: assemblies", returns_part=True):
        found = assemblies(mechanism, parse_drives(mechanism, at), certify=certify)
        if not found:
            if found.outcome is Outcome.INTERRUPTED:
                raise found.refusal()
            raise _explain_refusal(found, as_json, output)
        on = circuits(found.mechanism, pair) if circled else None
        told = record(found, limit, on) if as_json else table(found, limit, points, on)
    if as_json:
        print_json(told, indent=1)
        return
    print_or_write(told, output)


def _explain_refusal(found: Modes, as_json: bool, output: Path | None) -> NoAnswer:
    """The refusal to be raised, once it has been told why no assembly was found."""
    from planar.assemblies.circuits.circuits import circuits
    from planar.assemblies.conflict import conflict
    from planar.reports.tables.conflict import conflict_record, conflict_table

    problem, why = found.refusal(), conflict(found.mechanism)
    if why is not None:
        runs = [circuits(why.mechanism, pair) for pair in why.inputs]
        if as_json:
            problem.more = {"conflict": conflict_record(why, runs)}
        else:
            print_or_write(conflict_table(why, runs), output)
    return problem
