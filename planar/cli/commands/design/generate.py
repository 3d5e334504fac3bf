"""The command `generate`."""

from __future__ import annotations

from pathlib import Path

import click

from planar.cli.options import limited_time, main, show_progress, timeout_option
from planar.foundation.errors import BadInput

DATA_SET, FILE = ".zarr", ".json"


@main.command()
@click.option("--links", type=int, default=8, show_default=True, metavar="N", help="The fixed one among them.")
@click.option("--count", type=int, metavar="N", help="Of a data set: how many linkages.  [default: 1000]")
@click.option("--steps", type=int, metavar="N", help="Of a data set: parts of a turn.  [default: 100]")
@click.option("--chain", type=int, metavar="K", help="Of one linkage: its chain by the number that `chains` tells.")
@click.option("--freedom", type=int, default=1, show_default=True, metavar="F", help="Of one linkage.")
@click.option(
    "--slides", type=int, default=0, show_default=True, metavar="N", help="Of one linkage: joints that slide."
)
@click.option(
    "--multiple-pins",
    type=int,
    default=0,
    show_default=True,
    metavar="N",
    help="Of one linkage: links on pins beyond two each.",
)
@click.option("--frame", type=int, metavar="LINK", help="Of one linkage: the link that is fixed.")
@click.option("--drive", "drives", type=int, multiple=True, metavar="JOINT", help="Of one linkage: a driven joint.")
@timeout_option
@click.option("--seed", type=int, default=0, show_default=True, metavar="S", help="The same gives the same linkages.")
@click.option(
    "-o",
    "output",
    required=True,
    type=click.Path(path_type=Path),
    help="One linkage as a mechanism file (.json), or a data set (.zarr).",
)
def generate(  # many: options of the command
    links: int,
    count: int | None,
    steps: int | None,
    chain: int | None,
    freedom: int,
    slides: int,
    multiple_pins: int,
    frame: int | None,
    drives: tuple[int, ...],
    seed: int,
    output: Path,
) -> None:
    """Random linkages of given structure, whose crank turns fully: one as a file, or many as a data set."""
    of_one = {"--chain": chain is not None, "--frame": frame is not None, "--drive": bool(drives)}
    of_many = {"--count": count is not None, "--steps": steps is not None}
    of_one |= {"--freedom": freedom != 1, "--slides": slides != 0, "--multiple-pins": multiple_pins != 0}
    if output.suffix == DATA_SET:
        for option in (name for name, is_given in of_one.items() if is_given):
            raise BadInput(
                option, "a data set has all structures of one degree of freedom; for one linkage write -o FILE.json"
            )
        _generate_data_set(output, links, 1000 if count is None else count, 100 if steps is None else steps, seed)
        return
    if output.suffix != FILE:
        raise BadInput("-o", f"a linkage goes to a .json file, a data set to a .zarr folder, not {str(output)[:60]!r}")
    for option in (name for name, is_given in of_many.items() if is_given):
        raise BadInput(option, "this is for a data set; write -o FOLDER.zarr")
    from planar.document.files import dumps
    from planar.foundation.safe_files import save_file
    from planar.structures.enumeration.chains import chains
    from planar.structures.multiple_pins import joint_kinds_phrase

    with limited_time("a linkage"):
        found = chains(links, freedom, slides=slides, multiple_pins=multiple_pins)
        if not found:
            told = joint_kinds_phrase(slides, multiple_pins)
            raise BadInput("command line", f"of the chains of {links} links none{told} moves")
        if chain is not None and not 0 <= chain < len(found):
            raise BadInput("--chain", f"chains of {links} links have numbers from 0 to {len(found) - 1}, not {chain}")
        mechanism = found[chain or 0].mechanism(frame, drives or None, seed)
    save_file(output, dumps(mechanism))
    click.echo(f"{mechanism.name}. {' '.join(mechanism.notes)}")


def _generate_data_set(output: Path, links: int, count: int, steps: int, seed: int) -> None:
    from planar.structures.linkage_store import generate as generate_linkages

    with show_progress("linkages") as progress:
        found = generate_linkages(output, links, count, steps=steps, seed=seed, progress=progress)
    click.echo(f"{len(found)} linkages of {links} links at {steps + 1} positions: {output}")
