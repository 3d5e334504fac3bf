"""The commands `centres` and `harmonics`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import (
    at_option,
    json_option,
    load_model,
    main,
    mode_option,
    model_argument,
    output_option,
    parse_drives,
    print_or_write,
    refuse_overwriting,
    show_status,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput


@main.command()
@model_argument()
@click.option("--pair", "pairs", multiple=True, metavar="NAME", help="A slide; left out, all that the frame guides.")
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point: harmonics of its x and y.")
@click.option("--input", "running", metavar="PAIR", help="The input that turns, where there are several.")
@mode_option
@json_option
def harmonics(
    model: str,
    pairs: tuple[str, ...],
    points: tuple[str, ...],
    running: str | None,
    mode: int | None,
    as_json: bool,
) -> None:
    """Strokes, harmonics and the two-term formula of pistons, over a turn."""
    from planar.analysis.motion.analytical_route import analytical_routes
    from planar.reports.tables.analytical import analytical_tables, record

    mechanism = load_model(model, mode)
    with show_status(mechanism.name):
        found = analytical_routes(mechanism, pairs, points, running)
    if as_json:
        print_json(record(mechanism, found))
        return
    print_or_write(analytical_tables(mechanism, found), None)


@main.command()
@model_argument()
@json_option
@at_option
@mode_option
@output_option("Write the table to a .txt, .svg or .html file.")
def centres(model: str, as_json: bool, at: tuple[str, ...], mode: int | None, output: Path | None) -> None:
    """All instantaneous centres, with the lines of centres that show each."""
    from planar.analysis.centres.centres import centres as all_centres
    from planar.reports.tables.centres import record, table
    from planar.solving.rest_position import rest_position

    if as_json and output is not None:
        raise BadInput("-o", "the table goes to a file or SI values are printed with --json; give one of the two")
    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    with show_status(mechanism.name):
        found = all_centres(rest_position(mechanism, parse_drives(mechanism, at)))
    if as_json:
        print_json(record(found), indent=1)
        return
    print_or_write(table(found), output)
