"""An atlas of kinematic chains: a folder of sheets, and a file that tells everything about each chain."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from planar.drawing.output.grid_sheets import GRID_COUNT
from planar.drawing.output.matplotlib_figure import encode_figure
from planar.drawing.structures.chain_pictures import DrawnChain
from planar.drawing.structures.chain_sheets import chain_sheets, draw_chains, inversion_sheets
from planar.foundation.errors import BadInput
from planar.foundation.safe_files import make_folder, save_file, write_error
from planar.reports.tables.design.structures import record
from planar.structures.chain import Chain
from planar.structures.multiple_pins import extra_links

INDEX = "chains.json"
SUFFIXES = (".svg", ".png")
"""What each sheet is written as."""
SHEET_NAME = re.compile(r"(chains|inversions)-[0-9]+\.(svg|png)")
PLACE_DIGITS = 4
"""Of the places of joints in the index, whose lines are of length 1 or so."""


def write_atlas(
    found: Sequence[Chain],
    folder: Path,
    mechanisms: bool = False,
    count: int | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Path:
    """Write sheets of chains, with `mechanisms` also of their inversions, and the index, whose path is given.

    `count` is how many chains there are, of which these are the first. An atlas that is there is written anew, other
    files beside it stay. Raises BadInput where the folder holds files, but no atlas, or cannot be written.
    """
    make_folder(folder)
    old = _held_files(folder)
    drawn = draw_chains(found, progress)
    names = _sheet_names("chains", len(drawn))
    fixed = [(number, frame) for number, each in enumerate(drawn) for frame in each.chain.inversions]
    inversion_names = _sheet_names("inversions", len(fixed)) if mechanisms else []
    places = {each: inversion_names[k // GRID_COUNT] for k, each in enumerate(fixed)} if mechanisms else {}
    chains = []
    for number, each in enumerate(drawn):
        own = {str(frame): places[number, frame] for frame in each.chain.inversions} if mechanisms else None
        chains.append(_index_record(each, names[number // GRID_COUNT], own))
    whole = {
        "links": drawn[0].chain.links,
        "freedom": drawn[0].chain.freedom,
        "slides": len(drawn[0].chain.slides),
        "multiple_pins": extra_links(drawn[0].chain.pins),
        "count": len(drawn) if count is None else count,
        "drawn": len(drawn),
        "sheets": [*names, *inversion_names],
    }
    # the index first, so that an atlas that is broken off is known as one
    save_file(folder / INDEX, _index_text(whole, chains))
    sheets = zip(names, chain_sheets(drawn), strict=True)
    for name, figure in (*sheets, *(zip(inversion_names, inversion_sheets(drawn), strict=True) if mechanisms else ())):
        for suffix in SUFFIXES:
            save_file(folder / f"{name}{suffix}", encode_figure(figure, suffix))
    written = {f"{name}{suffix}" for name in (*names, *inversion_names) for suffix in SUFFIXES}
    for path in old:
        if SHEET_NAME.fullmatch(path.name) and path.name not in written:
            path.unlink(missing_ok=True)
    return folder / INDEX


def _index_text(whole: dict[str, Any], chains: Sequence[dict[str, Any]]) -> str:
    """JSON with a line for each chain."""
    head = json.dumps(whole)[:-1]
    return f'{head}, "chains": [\n' + ",\n".join(map(json.dumps, chains)) + "\n]}\n"


def _held_files(folder: Path) -> list[Path]:
    """What a folder holds, which is an atlas or nothing. Raises BadInput."""
    try:
        held = [*folder.iterdir()]
    except OSError as problem:
        raise write_error(str(folder), "the folder", problem, "read") from None
    if held and not (folder / INDEX).is_file():
        raise BadInput(
            str(folder),
            f"this folder holds {held[0].name!r} and no atlas of chains ({INDEX}); name an empty or a new folder",
        )
    return held


def _sheet_names(what: str, pictures: int) -> list[str]:
    """Names of sheets in order, with as many digits as the last one takes."""
    sheets = -(-pictures // GRID_COUNT)
    return [f"{what}-{number:0{len(str(sheets))}d}" for number in range(1, sheets + 1)]


def _index_record(drawn: DrawnChain, sheet: str, inversion_sheets_of: dict[str, str] | None) -> dict[str, Any]:
    """Everything about a chain as JSON values: its places, too, and on which sheets it stands."""
    found = record(drawn.chain, with_mechanisms=True)
    found |= {
        "crossings": drawn.layout.crossings,
        "places": [[round(float(each), PLACE_DIGITS) for each in place] for place in drawn.layout.places],
        "outlines": [list(each) for each in drawn.layout.rotations],
        "sheet": sheet,
    }
    return found if inversion_sheets_of is None else found | {"inversion_sheets": inversion_sheets_of}
