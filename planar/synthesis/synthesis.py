"""The result of a synthesis: its designs, how each moves, which is better, and the folder of a search."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple, overload

import numpy as np

from planar.analysis.motion.output import Extreme
from planar.document.files import from_dict, load_value, to_dict
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.safe_files import PARTIAL_FILE_NAME, make_folder, save_file, write_error
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.synthesis.cognates.cognates import Cognate
from planar.synthesis.judgement.defects import Defect, output_transmissions
from planar.synthesis.judgement.input_range import input_range, range_motion
from planar.synthesis.task.synthesis_task import SynthesisTask
from planar.synthesis.task.task_file import write_task

STEPS = 90


class DesignMotion(NamedTuple):
    """How a design moves: its input `pair` goes from `low` to `high` (rad or m), `is_whole_turn`: it turns fully.

    `transmission` has the least transmission angle (rad) of every output that has one, by its pair, with the input
    there: over the whole turn, else between the first and the last entry of what is wanted.
    """

    pair: str
    low: float
    high: float
    is_whole_turn: bool
    transmission: Mapping[str, Extreme]

    @property
    def least_transmission(self) -> Extreme | None:
        """The least transmission angle of all outputs, None where there is none."""
        return min(self.transmission.values(), key=lambda each: each.value, default=None)

    def __repr__(self) -> str:
        return short_repr(self)


def design_motion(mechanism: Mechanism, inputs: Sequence[Array]) -> DesignMotion | None:
    """How a design moves that is to come to positions (n,) of its input; None where it cannot be solved."""
    running = mechanism.inputs[0].pair
    try:
        motion = range_motion(mechanism, inputs, STEPS)
    except (NoAnswer, BadInput):
        return None
    reach = input_range(motion, inputs)
    used: Motion | None = motion
    if not reach.is_whole_turn:
        every = reach.bring(np.concatenate(inputs))
        try:
            used = cycle(mechanism, STEPS, float(every.min()), float(every.max()), running)
        except (NoAnswer, BadInput):
            used = None  # what is wanted lies at one place, or beyond what it runs through
    return DesignMotion(
        running, reach.low, reach.high, reach.is_whole_turn, {} if used is None else least_transmissions(used)
    )


def least_transmissions(motion: Motion) -> dict[str, Extreme]:
    """The least transmission angle (rad) over a motion at every output that has one, by its pair."""
    return {each.pair: each.least for each in output_transmissions(motion) if each.least is not None}


@dataclass(frozen=True, eq=False)
class SynthesisedDesign:
    """A linkage that does what a task wants, as far as it says.

    `error` is the root mean square of its misses and `greatest_miss` the greatest (m; rad where functions of angles
    alone are wanted); `misses` (n,) are those of each wanted item and `inputs` (n,) where the input is there.
    `shortages` tell what it is short of, none of an accepted design. `start` names the mechanism that it was made from;
    `numbers` are those that were sought, by name (SI). `cognates` are other linkages that come to the same places of a
    point: of a path whose timing is prescribed those that keep it.
    """

    mechanism: Mechanism
    error: float
    greatest_miss: float
    misses: tuple[Array, ...] = field(repr=False)
    inputs: tuple[Array, ...] = field(repr=False)
    shortages: tuple[Defect, ...] = field(repr=False)
    start: str
    numbers: Mapping[str, float] = field(repr=False)
    cognates: tuple[Cognate, ...] = field(default=(), repr=False)

    @cached_property
    def motion(self) -> DesignMotion | None:
        """How it moves, run when it is asked for first; None where it does not."""
        return design_motion(self.mechanism, self.inputs) if self.numbers else None

    @property
    def defects(self) -> tuple[str, ...]:
        """What is wrong with it, in sentences."""
        return tuple(shortage.sentence for shortage in self.shortages)

    def __repr__(self) -> str:
        told = f", {count_phrase(len(self.defects), 'defect')}" if self.defects else ""
        return f"<SynthesisedDesign {self.mechanism.name!r}: greatest miss {self.greatest_miss:.3g}{told}>"


class FamilyCount(NamedTuple):
    """`dimension` parameters of a family are open; `tried` members were tried, of which `met` keep the demands."""

    dimension: int
    tried: int
    met: int


@dataclass(frozen=True, eq=False)
class Synthesis(Sequence[SynthesisedDesign]):
    """The designs that a task leads to, the best first; `rejected` are those with a defect, `remarks` say what to know.

    `size` is the extent of what is wanted (m), beside which misses may be seen; `seed` gave them. `is_finished` says
    whether every start was searched: an interrupt and a limit of time leave some.
    """

    task: SynthesisTask
    designs: tuple[SynthesisedDesign, ...]
    rejected: tuple[SynthesisedDesign, ...]
    size: float
    remarks: tuple[str, ...] = ()
    seed: int = 0
    is_finished: bool = True

    def __repr__(self) -> str:
        best = f", greatest miss of the best {self.designs[0].greatest_miss:.3g}" if self.designs else ""
        return f"<Synthesis of {self.task.name!r}: {count_phrase(len(self), 'design')}{best}>"

    def __len__(self) -> int:
        """How many sound designs there are."""
        return len(self.designs)

    @overload
    def __getitem__(self, index: int) -> SynthesisedDesign: ...
    @overload
    def __getitem__(self, index: slice) -> tuple[SynthesisedDesign, ...]: ...
    def __getitem__(self, index: int | slice) -> SynthesisedDesign | tuple[SynthesisedDesign, ...]:
        """A design, or some of them."""
        return self.designs[index]

    def __iter__(self) -> Iterator[SynthesisedDesign]:
        """The designs, the best first."""
        return iter(self.designs)


def check_synthesis(found: Any) -> Synthesis:
    """What `planar.synthesise` found, as it is. Raises BadInput for anything else."""
    if not isinstance(found, Synthesis):
        raise BadInput("found", f"what planar.synthesise found is wanted, not {found!r:.60}")
    return found


def rank_designs(designs: Sequence[SynthesisedDesign], many: int, exact: float = 0.0) -> tuple[SynthesisedDesign, ...]:
    """The best so many by their error, of those alike one; of those with no more error than `exact` the ones that
    transmit best are first."""

    def order(design: SynthesisedDesign) -> tuple[bool, float, float]:
        is_exact = design.error <= exact
        return not np.isfinite(design.error), *((0.0, -least_transmission(design)) if is_exact else (design.error, 0.0))

    found: list[SynthesisedDesign] = []
    for each in sorted(designs, key=order):
        if not any(_are_alike(each, other) for other in found):
            found.append(each)
        if len(found) == many:
            break
    return tuple(found)


def least_transmission(design: SynthesisedDesign) -> float:
    """The least transmission angle (rad) of all outputs of a design; 0 where none is known."""
    extreme = None if design.motion is None else design.motion.least_transmission
    return 0.0 if extreme is None else extreme.value


def _are_alike(one: SynthesisedDesign, other: SynthesisedDesign) -> bool:
    """Whether two designs are one: of one start, with joints at the same places at their first entry."""
    if one.start != other.start:
        return False
    first, second = ({name: (x, y) for name, x, y in each.mechanism.sketch} for each in (one, other))
    if first.keys() != second.keys() or not first:
        return False
    a, b = (np.array([each[name] for name in first]) for each in (first, second))
    return bool(np.abs(a - b).max() < ALIKE * max(float(np.ptp(a, axis=0).max()), 1e-12))


ALIKE = 2e-3
"""Of a mechanism's extent: designs whose joints are nearer to each other are one."""


def design_record(design: SynthesisedDesign) -> dict[str, Any]:
    """A design as JSON values, SI: null where a miss is not known. What is told of it beside is not among them."""
    is_known = bool(np.isfinite(design.error))
    return {
        "start": design.start,
        "error": design.error if is_known else None,
        "greatest_miss": design.greatest_miss if is_known else None,
        "misses": [_finite(miss) for miss in design.misses],
        "inputs": [_finite(drive) for drive in design.inputs],
        "shortages": [list(shortage) for shortage in design.shortages],
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
    return [float(value) if np.isfinite(value) else None for value in values]


def _numbers(values: list[float | None]) -> Array:
    return np.array([np.nan if value is None else value for value in values], float)


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
        record = {"size": size, "designs": [design_record(design) for design in designs], "remarks": [*remarks]}
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
