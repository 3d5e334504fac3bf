"""The commands `centres` and `harmonics`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from planar.cli.options import (
    at_option,
    frame_number_option,
    json_option,
    limited_time,
    load_model,
    main,
    mode_option,
    model_argument,
    output_option,
    parse_drives,
    print_or_write,
    range_options,
    refuse_options,
    refuse_overwriting,
    report_motion,
    run_motion,
    steps_option,
    timeout_option,
)
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput

if TYPE_CHECKING:
    from planar.model.mechanism import Mechanism


@main.command()
@model_argument()
@click.option("--pair", "pairs", multiple=True, metavar="NAME", help="A slide; left out, all that the frame guides.")
@click.option("--point", "points", multiple=True, metavar="NAME", help="A point: harmonics of its x and y.")
@click.option("--input", "running", metavar="PAIR", help="The input that turns, where there are several.")
@mode_option
@json_option
@timeout_option
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
    with limited_time(mechanism.name):
        found = analytical_routes(mechanism, pairs, points, running)
    if as_json:
        print_json(record(mechanism, found))
        return
    print_or_write(analytical_tables(mechanism, found), None)


@main.command()
@model_argument()
@json_option
@timeout_option
@at_option
@mode_option
@frame_number_option
@click.option(
    "--link",
    "links",
    multiple=True,
    metavar="NAME",
    help="Only the centres of this link with all others, of several links those between them. May be repeated.",
)
@click.option("--cycle", "whole", is_flag=True, help="The paths of centres over the whole motion.")
@click.option(
    "--of",
    "names",
    multiple=True,
    metavar="CENTRE",
    help="With --cycle: the centre whose path is listed, by numbers or names of two links: 24, I24, BC,AD.",
)
@steps_option
@range_options
@output_option(
    "Write the table to a .txt, .svg or .html file, or paths beside the run to .csv, .xlsx, .json, .npz or .parquet."
)
def centres(  # many: options of the command
    model: str,
    as_json: bool,
    at: tuple[str, ...],
    mode: int | None,
    links: tuple[str, ...],
    whole: bool,
    names: tuple[str, ...],
    output: Path | None,
    **course: Any,
) -> None:
    """All instantaneous centres, with the lines of centres that show each; or their paths over the motion."""
    from planar.analysis.centres.centres import centres as all_centres
    from planar.analysis.centres.centres import chosen_links
    from planar.reports.tables.centres import record, table
    from planar.solving.position import rest_position

    if as_json and output is not None:
        raise BadInput("-o", "the table goes to a file or SI values are printed with --json; give one of the two")
    if whole and links:
        raise BadInput("--link", "this is for one position; with --cycle name a centre with --of")
    if whole and at:
        raise BadInput("--at", "a whole motion has no one position; say where it starts with --from")
    if not whole:
        refuse_options({*course, "names"}, "this is for the path of a centre over a whole motion, with --cycle")
    mechanism = load_model(model, mode)
    refuse_overwriting(model, output)
    if whole:
        _report_paths(mechanism, names, as_json, output, course)
        return
    chosen_links(mechanism, links)
    with limited_time(mechanism.name):
        found = all_centres(rest_position(mechanism, parse_drives(mechanism, at)), links)
    if as_json:
        print_json(record(found), indent=1)
        return
    print_or_write(table(found), output)


def _report_paths(
    mechanism: Mechanism, names: tuple[str, ...], as_json: bool, output: Path | None, course: dict[str, Any]
) -> None:
    """Print or write the paths of the centres that `--of` names."""
    from planar.analysis.centres.centrodes import centre_path, links_of_centre
    from planar.foundation.errors import Unknown
    from planar.reports.files.run_formats import check_writable
    from planar.reports.files.table_files import SUFFIXES
    from planar.reports.tables.centres import path_series, path_table

    if not names:
        raise BadInput("--of", "name the centre whose path is listed, such as --of 24")
    try:
        links = list(dict.fromkeys(links_of_centre(mechanism, name) for name in names))
    except Unknown as problem:
        raise BadInput("--of", str(problem)) from None
    is_table = output is not None and output.suffix in SUFFIXES
    if output is not None and not is_table:
        check_writable(output.suffix)
    with limited_time(mechanism.name, returns_part=True):
        motion = run_motion(mechanism, **course)
        paths = [centre_path(motion, *two) for two in links]
    if is_table:
        print_or_write(path_table(motion, paths), output)
        return
    report_motion(motion, as_json, output, lambda: [path_table(motion, paths)], path_series(paths))
