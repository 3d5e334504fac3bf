"""The command `tolerance`."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path
from typing import Any

import click

from planar.cli.options import (
    at_option,
    json_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    motion_options,
    output_option,
    parse_drives,
    print_or_write,
    refuse_options,
    refuse_overwriting,
    run_motion,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput

LIMIT_RESULTS = {"stroke": "travel", "swing": "travel", "travel": "travel", "time ratio": "time_ratio"}
"""What results of limits are called."""


@main.command()
@model_argument()
@json_option
@timeout_option
@at_option
@mode_option
@click.option("--of", "of", required=True, metavar="NAME", help="A point, a link, a pair or an input.")
@click.option("--result", metavar="NAME", help="Which of its results, or travel, 'time ratio', dead_points.")
@click.option("--cycle", "whole", is_flag=True, help="Over the whole motion, as `planar cycle` has it.")
@click.option("--general", type=click.Choice(list("fmcv")), help="ISO 2768-1 of this class, in place of the file's.")
@click.option(
    "--lengths",
    metavar="VALUE",
    help="Every length of links and pairs that is not 0 within this, as 0.1mm, in place of the file's tolerances.",
)
@click.option("--limit", metavar="VALUE", help="A deviation, as 0.1mm: how many mechanisms keep it.")
@click.option("--allow", metavar="NAME=VALUE", help="The loosest tolerances that suffice, as E=0.05mm.")
@click.option("--statistical", is_flag=True, help="With --allow: by three standard deviations, not the worst case.")
@click.option("--samples", type=click.IntRange(min=2), metavar="N", help="Solve N random mechanisms, too.")
@click.option("--seed", type=int, default=0, metavar="S", help="From which they are drawn.")
@click.option("--guaranteed", is_flag=True, help="A band that is proved, at all positions between two, too.")
@motion_options
@output_option("Write the table to a .txt, .svg or .html file.")
def tolerance(  # many: options of the command
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    mode: int | None,
    of: str,
    result: str | None,
    whole: bool,
    general: str | None,
    lengths: str | None,
    limit: str | None,
    allow: str | None,
    statistical: bool,
    samples: int | None,
    seed: int,
    guaranteed: bool,
    output: Path | None,
    **course: Any,
) -> None:
    """How far a result may be off by the tolerances of the file, and which to tighten first."""
    if as_json and output is not None:
        raise BadInput("-o", "the table goes to a file or SI values are printed with --json; give one of the two")
    named = LIMIT_RESULTS.get(result or "", result)
    whole = whole or named in ("travel", "time_ratio", "dead_points")
    if whole and at:
        raise BadInput("--at", "a whole motion has no one position; say where it starts with --from")
    if not whole:
        refuse_options(course, "this is for a whole motion, with --cycle")
    if statistical and allow is None:
        raise BadInput("--statistical", "this is for the tolerances of --allow")
    from planar.analysis.tolerance.allowance import allowance
    from planar.analysis.tolerance.tolerance import tolerance as band_of
    from planar.reports.tables.design.tolerance import record, table
    from planar.solving.position import solve

    mechanism = load_model(model, mode)
    others: dict[str, Any] = {} if general is None else {"general": f"ISO 2768-1 {general}"}
    if lengths is not None:
        others["lengths"] = _read_deviation(lengths, "--lengths", "length", mechanism.units)
    refuse_overwriting(model, output)
    with limited_time(f"{mechanism.name}: tolerances"):
        moving = run_motion(mechanism, **course) if whole else solve(mechanism, parse_drives(mechanism, at))
        band = band_of(moving, of, others or None, result=named, samples=samples or 0, seed=seed, guaranteed=guaranteed)
        if limit is not None:
            band = band.with_limit(_read_deviation(limit, "--limit", band.kind, mechanism.units))
        allowed = None
        if allow is not None:
            name, _, value = allow.rpartition("=")
            if name != of:
                raise BadInput("--allow", f"write {of}=VALUE, such as {of}=0.05mm, for what --of names")
            far = _read_deviation(value, "--allow", band.kind, mechanism.units)
            allowed = allowance(band, far, statistical)
        told = record(band, allowed) if as_json else table(band, allowed)
    if as_json:
        print_json(told, indent=1)
        return
    print_or_write(told, output)


def _read_deviation(text: str, option: str, kind: str, units: Any) -> float:
    """A deviation (SI) in the file's units, or with its own."""
    from planar.document.cursor import Cursor, FileContext

    value: float | str = text
    with suppress(ValueError):
        value = float(text)
    cursor = Cursor(value, option, FileContext(units))
    found = cursor.as_number() if kind == "number" else cursor.as_quantity(kind)
    if not found > 0.0:
        raise BadInput(option, f"a deviation above 0 is wanted, not {text!r:.40}")
    return found
