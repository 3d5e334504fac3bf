"""The command `calibrate`."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import click

from planar.cli.options import (
    json_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    output_option,
    print_or_write,
    refuse_overwriting,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput, join_names, unknown_format_error
from planar.foundation.units import UnitError, parse_quantity
from planar.model.mechanism import Mechanism

PICTURES = (".svg", ".pdf", ".png")


@main.command()
@model_argument()
@click.argument("measured", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@json_option
@timeout_option
@mode_option
@click.option(
    "--free", multiple=True, metavar="NAME", help="A number that is sought; left out, all that the samples depend on."
)
@click.option(
    "--deviation", "deviations", multiple=True, metavar="NAME=VALUE", help="The standard deviation of C: C=0.1mm."
)
@click.option("--untimed", is_flag=True, help="Leave out the positions of the inputs, if the file has them.")
@click.option(
    "--loss",
    type=click.Choice(["linear", "soft_l1", "huber", "cauchy"]),
    default="linear",
    show_default=True,
    help="Another one than linear lets outliers count less.",
)
@click.option(
    "--drawing",
    type=click.Path(dir_okay=False, path_type=Path),
    metavar="FILE",
    help="Draw the residuals to a .svg, .pdf or .png file.",
)
@output_option("Write the fitted mechanism to a .json file.")
def calibrate(  # many: options of the command
    model: str,
    measured: Path,
    as_json: bool,
    mode: int | None,
    free: tuple[str, ...],
    deviations: tuple[str, ...],
    untimed: bool,
    loss: str,
    drawing: Path | None,
    output: Path | None,
) -> None:
    """Dimensions from measurements: MEASURED is a CSV file with heads as runs have them: "C x [mm]", "C y [mm]"."""
    from planar.analysis.calibration.calibration import calibrate as fit
    from planar.analysis.calibration.measured_files import read_columns
    from planar.document.files import dumps
    from planar.document.tables.measured_table import read_measured_table
    from planar.foundation.safe_files import save_file
    from planar.reports.tables.design.calibration import record, table

    if output is not None and output.suffix.lower() != ".json":
        raise unknown_format_error(output.suffix, "a mechanism", (".json",))
    if drawing is not None and drawing.suffix.lower() not in PICTURES:
        raise unknown_format_error(drawing.suffix, "a drawing", PICTURES)
    mechanism = load_model(model, mode)
    for path in (output, drawing):
        refuse_overwriting(model, path)
        refuse_overwriting(str(measured), path, "the file of measurements")
    rows = read_measured_table(measured)
    with limited_time(f"{mechanism.name}: calibration"):
        given = read_columns(mechanism, rows)
        exact = _read_deviations(mechanism, deviations, given.measured)
        inputs = None if untimed else given.inputs
        found = fit(mechanism, given.measured, free, inputs=inputs, deviations=exact or None, loss=loss)
    if output is not None:
        save_file(output, dumps(found.mechanism))
    if drawing is not None:
        from planar import plot

        plot.save(plot.calibration(found), drawing)
    if as_json:
        print_json(record(found, rows.lines, given.unused), indent=1)
        return
    print_or_write(table(found, rows.lines, given.unused), None)


def _read_deviations(
    mechanism: Mechanism, texts: tuple[str, ...], measured: Mapping[str, Mapping[str, object]]
) -> dict[str, float]:
    """Standard deviations in SI, by the names of what was measured. Raises BadInput."""
    found = {}
    for text in texts:
        name, equals, value = (part.strip() for part in text.rpartition("="))
        if not equals or not name:
            raise BadInput("--deviation", f"{text!r} is not of the form NAME=VALUE, such as C=0.1mm")
        if name not in measured:
            raise BadInput("--deviation", f"nothing was measured of {name!r}, but of {join_names(measured)}")
        angles = all(result.endswith("angle") for result in measured[name])
        kind = "angle" if angles else "length"
        try:
            number = f"{float(value)} {getattr(mechanism.units, kind)}"
        except ValueError:
            number = value
        try:
            found[name] = parse_quantity(number, kind)
        except UnitError as problem:
            raise BadInput("--deviation", f"{text!r}: {problem}") from None
    return found
