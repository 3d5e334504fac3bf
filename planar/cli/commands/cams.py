"""The command `cams`."""

from __future__ import annotations

import json
from pathlib import Path

import click

from planar.cli.options import (
    json_option,
    main,
    model_argument,
    output_option,
    print_or_write,
    read_model,
    refuse_overwriting,
    show_status,
)
from planar.foundation.errors import BadInput
from planar.foundation.units import UnitError, parse_quantity


@main.command()
@model_argument()
@click.option("--pair", "pair", metavar="NAME", help="The cam, where there are several.")
@click.option(
    "--pressure-angle",
    default="30 deg",
    show_default=True,
    metavar="ANGLE",
    help="The greatest pressure angle for which the least base circle is solved for.",
)
@click.option(
    "--tolerance",
    metavar="LENGTH",
    help="How far the straight lines between the points of a file may be from the profile; 0.01 mm where left out.",
)
@json_option
@output_option("Write the profile to a .csv or .svg file.")
def cams(
    model: str, pair: str | None, pressure_angle: str, tolerance: str | None, as_json: bool, output: Path | None
) -> None:
    """The profile of a cam: pressure angle, curvature, undercutting, least base circle."""
    from planar.analysis.cams.base_circle import least_base_circle
    from planar.analysis.cams.cam_profile import cam_profile
    from planar.reports.tables.cams import cam_tables, record

    if as_json and output is not None:
        raise BadInput("-o", "the profile goes to a file or SI values are printed with --json; give one of the two")
    if tolerance is not None and output is None:
        raise BadInput("--tolerance", "this is of the points of a file; name one with -o")
    mechanism = read_model(model)
    refuse_overwriting(model, output)
    with show_status(mechanism.name):
        found = cam_profile(mechanism, pair)
        if output is not None:
            from planar.foundation.safe_files import save_file
            from planar.reports.files.cam_files import DEFAULT_TOLERANCE, encode_profile

            within = DEFAULT_TOLERANCE if tolerance is None else _quantity("--tolerance", tolerance, "length")
            save_file(output, encode_profile(found, mechanism.units, output.suffix, within))
            return
        least = least_base_circle(mechanism, _quantity("--pressure-angle", pressure_angle, "angle"), pair)
    if as_json:
        click.echo(json.dumps(record(found, least), ensure_ascii=False, allow_nan=False))
        return
    print_or_write(cam_tables(mechanism, found, least), None)


def _quantity(option: str, text: str, kind: str) -> float:
    try:
        return parse_quantity(text, kind)
    except UnitError as problem:
        raise BadInput(option, str(problem)) from None
