"""The command `parts`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import (
    json_option,
    main,
    model_argument,
    output_option,
    print_or_write,
    range_options,
    read_ends,
    read_model,
    refuse_overwriting,
    show_status,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput


@main.command()
@model_argument()
@output_option("Write the sheets to a .dxf or .svg file, or solids to .step.")
@click.option("--thickness", default="3mm", show_default=True, metavar="LENGTH", help="Of the plates.")
@click.option("--pin", metavar="LENGTH", help="The diameter of the pins; left out, one that suits the links.")
@click.option("--wall", metavar="LENGTH", help="What is left round a hole; left out, as wide as a pin.")
@click.option("--play", default="0.1mm", show_default=True, metavar="LENGTH", help="What holes are wider than pins.")
@click.option("--sheet", default="600x400", show_default=True, metavar="WxH", help="Its width and height in mm.")
@click.option("--made-at", metavar="SCALE", help="The scale, as 1:5; left out, the largest that fits the sheet.")
@range_options
@json_option
# many: sizes of what is cut
def parts(
    model: str,
    output: Path | None,
    thickness: str,
    pin: str | None,
    wall: str | None,
    play: str,
    sheet: str,
    made_at: str | None,
    pair: str | None,
    start: str | None,
    stop: str | None,
    as_json: bool,
) -> None:
    """Plates to be cut: a layer for each, so that they clear one another; pins, gears, a sheet."""
    from planar.document import read_length
    from planar.manufacture.cut_files import SUFFIXES
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
    assert thick is not None and loose is not None
    first, last = read_ends(mechanism, pair, start, stop)
    with show_status(f"{mechanism.name}: plates and layers"):
        found = made(
            mechanism,
            thickness=thick,
            pin=diameter,
            wall=round_it,
            play=loose,
            sheet=_sheet(sheet),
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


def _sheet(text: str) -> tuple[float, float]:
    """A sheet's width and height (m) of a text such as 600x400. Raises BadInput."""
    try:
        width, height = (float(each) for each in text.lower().split("x"))
    except ValueError:
        width = height = 0.0
    if not (0.0 < width < 1e5 and 0.0 < height < 1e5):
        raise BadInput("--sheet", f"{text!r:.40} is not of the form WxH, such as 600x400 (mm)")
    return width / 1e3, height / 1e3


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
