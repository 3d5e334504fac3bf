"""The commands that answer one question about a mechanism."""

from __future__ import annotations

import json
from pathlib import Path

import click

from planar.cli.options import as_json, at, busy, drives, loaded, main, moded, output, show, spare
from planar.foundation.errors import BadInput


@main.command()
@click.argument("model")
@click.option("--pair", "pairs", multiple=True, metavar="NAME", help="A slide; left out, all that the frame guides.")
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point: harmonics of its x and y.")
@click.option("--input", "running", metavar="PAIR", help="The input that turns, where there are several.")
@moded
@as_json
def harmonics(
    model: str,
    pairs: tuple[str, ...],
    points: tuple[str, ...],
    running: str | None,
    mode: int | None,
    as_json: bool,
) -> None:
    """Strokes, harmonics and the two-term formula of pistons, over a turn."""
    from planar.analysis.motion.analytical_route import routes
    from planar.reports.tables.analytical import analytical, record

    mechanism = loaded(model, mode)
    with busy(mechanism.name):
        found = routes(mechanism, pairs, points, running)
    if as_json:
        click.echo(json.dumps(record(mechanism, found), ensure_ascii=False, allow_nan=False))
        return
    show(analytical(mechanism, found), None)


@main.command()
@click.argument("model")
@as_json
@at
@moded
@output("Write the table to a .txt, .svg or .html file.")
def centres(model: str, as_json: bool, at: tuple[str, ...], mode: int | None, output: Path | None) -> None:
    """All instantaneous centres, with the lines of centres that show each."""
    from planar.analysis.centres.centres import centres as all_centres
    from planar.reports.tables.centres import record, table
    from planar.solving.rest_position import standing

    if as_json and output is not None:
        raise BadInput("-o", "the table goes to a file or SI values are printed with --json; give one of the two")
    mechanism = loaded(model, mode)
    spare(model, output)
    with busy(mechanism.name):
        found = all_centres(standing(mechanism, drives(mechanism, at)))
    if as_json:
        click.echo(json.dumps(record(found), ensure_ascii=False, indent=1, allow_nan=False))
        return
    show(table(found), output)
