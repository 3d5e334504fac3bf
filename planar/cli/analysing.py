"""The commands that answer one question about a mechanism."""

from __future__ import annotations

import json

import click

from planar.cli.shared import as_json, busy, main, show


@main.command()
@click.argument("model")
@click.option("--pair", "pairs", multiple=True, metavar="NAME", help="A slide; left out, all that the frame guides.")
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point: harmonics of its x and y.")
@click.option("--input", "running", metavar="PAIR", help="The input that turns, where there are several.")
@as_json
def harmonics(model: str, pairs: tuple[str, ...], points: tuple[str, ...], running: str | None, as_json: bool) -> None:
    """Strokes, harmonics and the two-term formula of pistons, over a turn."""
    from planar.analysis.analytical import routes
    from planar.files import load
    from planar.views.analytical import analytical, record

    mechanism = load(model)
    with busy(mechanism.name):
        found = routes(mechanism, pairs, points, running)
    if as_json:
        click.echo(json.dumps(record(mechanism, found), ensure_ascii=False, allow_nan=False))
        return
    show(analytical(mechanism, found), None)
