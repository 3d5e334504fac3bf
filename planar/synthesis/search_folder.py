"""The folder of a search: designs as JSON records, exact to the last bit, from which an interrupted search goes on."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from planar.document.files import from_dict, load_value, to_dict
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.safe_files import PARTIAL_FILE_NAME, make_folder, save_file, write_error
from planar.synthesis.judgement.defects import Defect
from planar.synthesis.synthesis import SynthesisedDesign
from planar.synthesis.task.synthesis_task import SynthesisTask
from planar.synthesis.task.task_file import write_task


def design_record(design: SynthesisedDesign) -> dict[str, Any]:
    """A design as JSON values, SI: null where a miss is not known. What is told of it beside is not among them."""
    is_known = bool(np.isfinite(design.error))
    return {
        "start": design.start,
        "error": design.error if is_known else None,
        "greatest_miss": design.greatest_miss if is_known else None,
        "misses": [_finite(each) for each in design.misses],
        "inputs": [_finite(each) for each in design.inputs],
        "shortages": [list(each) for each in design.shortages],
        "numbers": dict(design.numbers),
        "mechanism": to_dict(design.mechanism),
    }


def read_design(record: Mapping[str, Any]) -> SynthesisedDesign:
    """The design of a record. Raises BadInput, KeyError, TypeError or ValueError where it is none."""
    error, worst = (np.nan if record[key] is None else float(record[key]) for key in ("error", "greatest_miss"))
    return SynthesisedDesign(
        from_dict(record["mechanism"]),
        error,
        worst,
        tuple(_numbers(each) for each in record["misses"]),
        tuple(_numbers(each) for each in record["inputs"]),
        tuple(Defect(*each) for each in record["shortages"]),
        str(record["start"]),
        {str(name): float(value) for name, value in record["numbers"].items()},
    )


def _finite(values: Array) -> list[float | None]:
    return [float(each) if np.isfinite(each) else None for each in values]


def _numbers(values: list[float | None]) -> Array:
    return np.array([np.nan if each is None else each for each in values], float)


TASK_FILE, SEARCH_FILE, ROUNDS_FOLDER = "task.json", "search.json", "search"
DAMAGES = (BadInput, KeyError, TypeError, ValueError, AttributeError)
"""What comes of reading a file that somebody changed: its round is made once more."""


def claim_folder(folder: Path, task: SynthesisTask) -> None:
    """Make sure that a folder is there for the designs of a task, and for nothing else; its file is written there.

    Raises BadInput where it holds the designs of another task, or other things, and where it cannot be written.
    """
    own = json.loads(json.dumps(write_task(task)))
    make_folder(folder)
    try:
        held = sorted(each.name for each in folder.iterdir() if not PARTIAL_FILE_NAME.fullmatch(each.name))
    except OSError as problem:
        raise write_error(str(folder), "the folder", problem, "read") from None
    if TASK_FILE in held:
        other = load_value(folder / TASK_FILE, "a task's file")
        if other != own:
            name = other.get("name") if isinstance(other, dict) else None
            named = f", {name!r:.60}" if isinstance(name, str) and name != task.name else ""
            told = f"this folder holds the designs of another task{named} ({TASK_FILE}); name another folder"
            raise BadInput(str(folder), told)
    elif held:
        told = f"this folder holds {held[0]!r:.60} and no designs of a task ({TASK_FILE})"
        raise BadInput(str(folder), f"{told}; name an empty or a new folder")
    else:
        save_file(folder / TASK_FILE, json.dumps(own, indent=2, ensure_ascii=False) + "\n")


class SearchFolder:
    """The rounds of a search that are done, in files of their own; each is written whole or not at all.

    `plan` is what makes a search what it is beside its task: another one in the folder is refused (BadInput).
    """

    def __init__(self, folder: Path, task: SynthesisTask, plan: Mapping[str, Any]):
        self.folder = folder
        claim_folder(folder, task)
        own = json.loads(json.dumps(plan))
        if not (folder / SEARCH_FILE).exists():
            save_file(folder / SEARCH_FILE, json.dumps(own, indent=2) + "\n")
        known = load_value(folder / SEARCH_FILE, "a search's file")
        if known != own:
            raise BadInput(str(folder), f"{_difference(known, own)}; name another folder")
        make_folder(folder / ROUNDS_FOLDER)

    def read(self, start: int, number: int) -> tuple[float, list[SynthesisedDesign], list[str]] | None:
        """The size, the designs and the remarks of a start's round (0: exact designs), None where it is not done."""
        path = self._path(start, number)
        if not path.is_file():
            return None
        try:
            record = load_value(path, "a round's file")
            designs = [read_design(each) for each in record["designs"]]
            return float(record["size"]), designs, [str(each) for each in record["remarks"]]
        except DAMAGES:
            return None

    def write(
        self, start: int, number: int, size: float, designs: Sequence[SynthesisedDesign], remarks: Sequence[str]
    ) -> None:
        """Keep a round that is done."""
        record = {"size": size, "designs": [design_record(each) for each in designs], "remarks": [*remarks]}
        save_file(self._path(start, number), json.dumps(record, ensure_ascii=False, allow_nan=False) + "\n")

    def _path(self, start: int, number: int) -> Path:
        return self.folder / ROUNDS_FOLDER / f"{start:05d}-{number}.json"


def _difference(known: Any, own: Mapping[str, Any]) -> str:
    """What of a search in the folder is another."""
    if not isinstance(known, dict):
        return f"{SEARCH_FILE} there is of no search"
    for name, value in own.items():
        if known.get(name) != value:
            if isinstance(value, dict):
                return "the search in this folder has other settings"
            return f"the search in this folder has {name} = {known.get(name)!r:.40}, and not {value!r:.40}"
    return "the search in this folder has other settings"
