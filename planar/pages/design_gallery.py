"""A folder of designs: a mechanism file and a page each, a gallery with what was wanted under them, and a table."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

from planar.document.files import dumps
from planar.foundation.errors import NoAnswer
from planar.foundation.safe_files import save_file
from planar.model.mechanism import Mechanism
from planar.pages.data.wanted_data import apply_task
from planar.pages.design_cards import GalleryCard, gallery_page
from planar.pages.page import PageLink, page
from planar.reports.tables.design.design_columns import design_columns, design_csv
from planar.synthesis.synthesis import Synthesis, check_synthesis, claim_folder
from planar.synthesis.task.synthesis_task import SynthesisTask

INDEX, TABLE = "index.html", "designs.csv"
OWN_NAME = re.compile(r"(rejected-)?[0-9]{2,}(-cognate-[0-9]+)?\.(json|html)")
"""What a folder of designs holds beside its gallery and its table."""


def write_designs(found: Synthesis, folder: str | Path, *, progress: Callable[[int, int], None] | None = None) -> Path:
    """Write what `planar.synthesise` found to a folder, and give the path of its gallery, `index.html`.

    Of each design a mechanism file, a page on which what is wanted can be dragged, and its cognates; of those rejected
    the mechanism files; all in a gallery with their drawings, in a table (`designs.csv`), and the task. Designs of the
    same task that are there are written anew. `progress` is told after each page how many are done, of how many. Raises
    BadInput where the folder holds designs of another task or other things, or cannot be written.

    >>> import planar
    >>> from tempfile import mkdtemp
    >>> task = {"planar": 1, "units": {"length": "mm", "angle": "deg"}, "start": "slider-crank",
    ...     "wanted": [{"point": "A", "through": [[0, 0], [20, 12], [42, 15]]}]}
    >>> planar.write_designs(planar.synthesise(task, many=1), mkdtemp()).name
    'index.html'
    """
    found, place = check_synthesis(found), Path(folder)
    claim_folder(place, found.task)
    cards = []
    files = {}
    for number, design in enumerate(found, start=1):
        name = f"{number:02d}"
        files[f"{name}.json"] = dumps(design.mechanism)
        cognates = {f"{name}-cognate-{k}.json": each for k, each in enumerate(design.cognates, start=1)}
        files |= {file: dumps(each.mechanism) for file, each in cognates.items()}
        text = _page(design.mechanism, found.task)
        if text is not None:
            files[f"{name}.html"] = text
        cards.append(GalleryCard(name, design, None if text is None else f"{name}.html", f"{name}.json", [*cognates]))
        if progress is not None:
            progress(number, len(found))
    for number, design in enumerate(found.rejected, start=1):
        name = f"rejected-{number:02d}"
        files[f"{name}.json"] = dumps(design.mechanism)
        cards.append(GalleryCard(name, design, None, f"{name}.json", []))
    columns = tuple(design_columns(found, [each.name for each in cards]))
    files[TABLE] = design_csv(columns)
    for name, text in files.items():
        save_file(place / name, text)
    save_file(place / INDEX, gallery_page(found, cards, columns, TABLE))
    for path in _left_over(place, files):
        path.unlink(missing_ok=True)
    return place / INDEX


def design_files(found: Synthesis, folder: Path) -> list[Path]:
    """The mechanism files of the designs that `write_designs` writes."""
    return [folder / f"{number:02d}.json" for number in range(1, len(found) + 1)]


def _page(mechanism: Mechanism, task: SynthesisTask) -> str | None:
    """The page of a design, None where it has no position to start from."""
    try:
        ready, wanted = apply_task(mechanism, task)
        return page(ready, back=PageLink(INDEX, "All designs"), wanted=wanted)
    except NoAnswer:
        return None


def _left_over(folder: Path, written: Sequence[str] | dict[str, str]) -> Iterator[Path]:
    """Files of designs that were there before and are no more."""
    for path in [*folder.iterdir()]:
        if OWN_NAME.fullmatch(path.name) and path.name not in written:
            yield path
