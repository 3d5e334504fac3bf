"""The command `chains`."""

from __future__ import annotations

from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from planar.cli.options import json_option, main, print_or_write, show_progress, show_status
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput
from planar.foundation.safe_files import is_existing

if TYPE_CHECKING:
    from planar.structures.enumeration.pin_chains import Chains

PICTURES = (".svg", ".pdf", ".png")
MAX_CHAINS_LISTED = 250
"""Chains that are printed unless more are asked for."""


@main.command()
@click.argument("links", type=int)
@click.option(
    "--freedom", type=int, default=1, show_default=True, metavar="F", help="How many joints have to be driven."
)
@click.option(
    "--slides", type=int, default=0, show_default=True, metavar="N", help="So many joints are sliding pairs, not pins."
)
@click.option(
    "--multiple-pins",
    type=int,
    default=0,
    show_default=True,
    metavar="N",
    help="Pins hold so many links beyond two each: one of three links counts once.",
)
@click.option("--not-fractionated", is_flag=True, help="Leave out chains that a single link parts.")
@click.option("--mechanisms", is_flag=True, help="Also what differs by the fixed link and by the driven joints on it.")
@click.option(
    "--limit",
    type=click.IntRange(1),
    default=MAX_CHAINS_LISTED,
    show_default=True,
    metavar="N",
    help="So many are listed, and drawn.",
)
@click.option(
    "-o",
    "output",
    type=click.Path(path_type=Path),
    metavar="PLACE",
    help="Draw them: an atlas in a folder, with an index; or sheets in a .pdf, .svg or .png file.",
)
@json_option
def chains(  # many: options of the command
    links: int,
    freedom: int,
    slides: int,
    multiple_pins: int,
    not_fractionated: bool,
    mechanisms: bool,
    limit: int,
    output: Path | None,
    as_json: bool,
) -> None:
    """All kinematic chains of so many LINKS: every structure that a linkage with pins and slides can have."""
    from planar.reports.tables.design.structures import record, table
    from planar.structures.enumeration.chains import chains as all_chains

    found = all_chains(links, freedom, slides=slides, multiple_pins=multiple_pins, fractionated=not not_fractionated)
    if output is not None:
        _draw(found, limit, mechanisms, output)
    if as_json:
        with show_status(f"chains of {links} links"):
            records = [record(each, mechanisms) for each in found]
        print_json(records)
        return
    with show_status(f"chains of {links} links"):
        told = table(found, [*islice(found, limit)], mechanisms)
    print_or_write(told, None)


def _draw(found: Chains, limit: int, mechanisms: bool, output: Path) -> None:
    """The first chains on sheets, in a file where its name says so, else in a folder."""
    from planar import plot
    from planar.pages.chain_atlas import write_atlas
    from planar.structures.multiple_pins import joint_kinds_phrase

    with show_status(f"chains of {found.links} links"):
        shown, count = [*islice(found, limit)], len(found)
    if not shown:
        told = joint_kinds_phrase(found.slides, found.multiple_pins)
        raise BadInput("command line", f"of the chains of {found.links} links none{told} moves")
    with show_progress(f"{len(shown)} chains") as progress:
        if output.suffix.lower() in PICTURES and not (is_existing(output) and output.is_dir()):
            plot.save(plot.chains(shown, mechanisms), output)
        else:
            write_atlas(shown, output, mechanisms, count, progress)
