"""The command `parts`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from planar.cli.options import (
    json_option,
    limited_time,
    main,
    model_argument,
    output_option,
    print_or_write,
    range_options,
    read_ends,
    read_model,
    refuse_overwriting,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput

if TYPE_CHECKING:
    from planar.manufacture.cut_units import CutUnit


@main.command()
@model_argument()
@output_option("Write the sheets to a .dxf or .svg file, or solids to .step.")
@click.option("--thickness", metavar="LENGTH", help="Of the plates; by default 3 mm, or 1/8 in for a file in inches.")
@click.option("--pin", metavar="LENGTH", help="The diameter of the pins; left out, one that suits the links.")
@click.option("--wall", metavar="LENGTH", help="What is left round a hole; left out, as wide as a pin.")
@click.option("--play", metavar="LENGTH", help="What holes are wider than pins; by default 0.1 mm or 0.005 in.")
@click.option("--hole", "holes", multiple=True, metavar="POINT", help="A hole at this point, too.")
@click.option(
    "--sheet", metavar="WxH", help="Its width and height; by default 600x400 (mm), 24x16 for a file in inches."
)
@click.option("--made-at", metavar="SCALE", help="The scale, as 1:5; left out, the largest that fits the sheet.")
@range_options
@json_option
@timeout_option
# many: sizes of what is cut
def parts(
    model: str,
    output: Path | None,
    thickness: str | None,
    pin: str | None,
    wall: str | None,
    play: str | None,
    holes: tuple[str, ...],
    sheet: str | None,
    made_at: str | None,
    pair: str | None,
    start: str | None,
    stop: str | None,
    as_json: bool,
) -> None:
    """Plates to be cut: a layer for each, so that they clear one another; pins, gears, a sheet."""
    from planar.document import read_length
    from planar.manufacture.cut_files import SUFFIXES
    from planar.manufacture.cut_units import cut_unit
    from planar.manufacture.parts import parts as made
    from planar.reports.tables.design.parts import parts_record, parts_tables

    if output is not None and output.suffix.lower() not in SUFFIXES:
        from planar.foundation.errors import unknown_format_error

        raise unknown_format_error(output.suffix, "parts", SUFFIXES)
    mechanism = read_model(model)
    refuse_overwriting(model, output)
    lengths = {"--thickness": thickness, "--pin": pin, "--wall": wall, "--play": play}
    thick, diameter, round_it, loose = (
        None if text is None else read_length(mechanism, text, option) for option, text in lengths.items()
    )
    first, last = read_ends(mechanism, pair, start, stop)
    with limited_time(f"{mechanism.name}: plates and layers"):
        found = made(
            mechanism,
            thickness=thick,
            pin=diameter,
            wall=round_it,
            play=loose,
            sheet=None if sheet is None else _sheet(sheet, cut_unit(mechanism.units)),
            holes=holes,
            scale=None if made_at is None else _scale(made_at),
            start=first,
            stop=last,
            pair=pair,
        )
    if output is not None:
        found.save(output)
    if as_json:
        print_json(parts_record(found))
    else:
        print_or_write(parts_tables(found), None)


def _sheet(text: str, unit: CutUnit) -> tuple[float, float]:
    """A sheet's width and height (m) of a text such as 600x400, in mm or inches. Raises BadInput."""
    try:
        width, height = (float(each) for each in text.lower().split("x"))
    except ValueError:
        width = height = 0.0
    if not (0.0 < width < 1e5 and 0.0 < height < 1e5):
        example = "x".join(map(unit.format, unit.sheet))
        raise BadInput("--sheet", f"{text!r:.40} is not of the form WxH, such as {example} ({unit.name})")
    return 1e-3 * unit.millimetres * width, 1e-3 * unit.millimetres * height


def _scale(text: str) -> float:
    """A scale of a text such as 1:5 or 2:1. Raises BadInput."""
    try:
        one, other = (float(each) for each in text.split(":"))
        found = one / other
    except (ValueError, ZeroDivisionError):
        found = 0.0
    if not 1e-6 < found < 1e6:
        raise BadInput("--made-at", f"{text!r:.40} is no scale such as 1:5")
    return found
