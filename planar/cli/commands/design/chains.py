"""The command `chains`."""

from __future__ import annotations

from contextlib import suppress
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import click

from planar.cli.options import json_option, limited_time, main, print_or_write, show_progress, timeout_option
from planar.cli.streams import print_json
from planar.foundation.errors import BadInput
from planar.foundation.safe_files import is_existing

if TYPE_CHECKING:
    from planar.structures.chain import Chain
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
@timeout_option
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

    with limited_time(f"chains of {links} links", returns_part=True):
        found = all_chains(
            links, freedom, slides=slides, multiple_pins=multiple_pins, fractionated=not not_fractionated
        )
        listed = _list_in_time(found, None if as_json else limit)
        count = len(listed) if as_json else _count_in_time(found)
    if output is not None:
        _draw(found, listed[:limit], count, mechanisms, output)
    if as_json:
        print_json([record(each, mechanisms) for each in listed])
        return
    print_or_write(table(found, listed, mechanisms, count), None)


def _list_in_time(found: Chains, limit: int | None) -> list[Chain]:
    """The first chains, as many as there is time for."""
    from planar.foundation.time_limit import ComputationEnded, within_time

    listed = []
    with suppress(ComputationEnded):
        for chain in within_time(islice(found, limit)):
            listed.append(chain)
    return listed


def _count_in_time(found: Chains) -> int | None:
    """How many chains there are; None where there is no time to count them."""
    from planar.foundation.time_limit import ComputationEnded

    try:
        return len(found)
    except ComputationEnded:
        return None


def _draw(found: Chains, shown: list[Chain], count: int | None, mechanisms: bool, output: Path) -> None:
    """The first chains on sheets, in a file where its name says so, else in a folder."""
    from planar import plot
    from planar.pages.chain_atlas import write_atlas
    from planar.structures.multiple_pins import joint_kinds_phrase

    if not shown and count is None:
        return
    if not shown:
        told = joint_kinds_phrase(found.slides, found.multiple_pins)
        raise BadInput("command line", f"of the chains of {found.links} links none{told} moves")
    with show_progress(f"{len(shown)} chains") as progress:
        if output.suffix.lower() in PICTURES and not (is_existing(output) and output.is_dir()):
            plot.save(plot.chains(shown, mechanisms), output)
        else:
            write_atlas(shown, output, mechanisms, count, progress)
