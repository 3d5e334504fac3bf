"""What a complete list says of a task that is made from a known linkage, checked by closed forms."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from time import process_time
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.known_linkages.closed_forms import Position, crank_angles
from benchmarks.known_linkages.known_tasks import (
    STEP,
    Item,
    KnownTask,
    Verdict,
    conditions_on_numbers,
    item_rows,
    jacobian,
)
from benchmarks.known_linkages.other_solutions import STARTS, other_solutions
from benchmarks.known_linkages.vectors import Vector
from planar.foundation.arrays import Array

SAME = 1e-5
"""Of the size of a linkage: pins nearer to each other are the same."""
ROUND_OFF = 1e-9
"""Of the size, and rad: the least miss that counts."""
GRID = 14_401
"""Positions of the input that are tried where a design misses at those it names."""
LEAST_MISSES = 12
"""Positions of the input from which it is refined where all entries go together."""
REFINED_HALVINGS = 20
"""Of a step to where a linkage cannot be assembled."""
EXCHANGED = {"A": "D", "D": "A", "B": "C", "C": "B"}
"""Names of pins of a four-bar whose cranks change their names."""


class Fault(NamedTuple):
    """Something that is wrong, by its kind, with what was seen."""

    kind: str
    detail: str


class Outcome(NamedTuple):
    """What came of a task."""

    faults: tuple[Fault, ...]
    answer: str
    "what the list, or the refusal, says"
    seconds: float
    is_lost: bool = False
    "whether paths were lost, and the list says so"


ItemMet = tuple[float, float, tuple[float, ...]]
"""The greatest miss of an item, where the input is at its first entry, and the signs of the assembly there."""


class Met(NamedTuple):
    """How well a linkage meets a task: the greatest miss, and its position at the first entry."""

    miss: float
    tolerance: float
    angle: float
    signs: tuple[float, ...]
    first: Position
    numbers: Mapping[str, Any]

    @property
    def is_met(self) -> bool:
        """Whether it misses by no more than round-off."""
        return self.miss <= self.tolerance


def check_task(task: KnownTask, starts: int = STARTS) -> Outcome:
    """Ask for the complete list of a task and check it, also by Newton's method from so many starts."""
    began = process_time()
    try:
        found = planar.synthesise(task.value, complete=True)
    except planar.BadInput as refusal:
        faults = (Fault("refused, though it has a list", str(refusal)),) if task.verdict is Verdict.LIST else ()
        return Outcome(faults, str(refusal), process_time() - began)
    except planar.NoAnswer as problem:
        return Outcome((Fault("no answer", str(problem)),), str(problem), process_time() - began)
    except Exception as problem:  # whatever is raised is what is looked for
        told = f"{type(problem).__name__}: {problem}"
        return Outcome((Fault(f"raises {type(problem).__name__}", _last_place(problem)),), told, process_time() - began)
    seconds = process_time() - began
    answer = " | ".join(found.summary)
    is_lost = found.complete.startswith("incomplete")
    return Outcome(tuple(_list_faults(task, found, starts)), answer, seconds, is_lost)


def _last_place(problem: BaseException) -> str:
    """The functions in which an error was raised, the last ones."""
    names, trace = [], problem.__traceback__
    while trace is not None:
        names.append(trace.tb_frame.f_code.co_name)
        trace = trace.tb_next
    return f"{problem} (in {' > '.join(names[-3:])})"


def _list_faults(task: KnownTask, found: planar.CompleteSynthesis, starts: int) -> Iterator[Fault]:
    if task.verdict is Verdict.TOO_MANY:
        yield Fault("listed, though conditions are too many", " | ".join(found.summary))
    elif task.verdict is Verdict.OPEN and found.expected is not None:
        yield Fault("listed, though numbers stay open", " | ".join(found.summary))
    listed = []
    for k, design in enumerate(found):
        name = f"design {k + 1} of {len(found)}, {', '.join(design.defects) or 'no defect'}"
        if any(each.demand == "a file's form" for each in design.shortages):
            yield Fault("a design has no file", name)
            continue
        met = how_it_meets(task, planar.dimensions(design.mechanism), design.inputs)
        elsewhere = met if met.is_met else how_it_meets(task, met.numbers, None)
        yield from (Fault(kind, f"{name}: {detail}") for kind, detail in _design_faults(task, design, met, elsewhere))
        listed.append((design, elsewhere if elsewhere.is_met else met))
    if task.verdict is Verdict.LIST:
        yield from _missing(task, found, listed, starts)


def _design_faults(
    task: KnownTask, design: planar.SynthesisedDesign, met: Met, elsewhere: Met
) -> Iterator[tuple[str, str]]:
    """What is wrong with a design; one with a defect names inputs of its first branch, where it need not meet."""
    is_listed = isinstance(design, planar.ExactDesign)  # and not of the sample of a family
    is_proved = is_listed and design.certified
    changed = [
        each
        for each, value in task.linkage.numbers.items()
        if each not in task.free and abs(met.numbers.get(each, value) - value) > ROUND_OFF * (1.0 + abs(value))
    ]
    if changed:
        yield "a given number is changed", ", ".join(changed)
    if is_proved and not elsewhere.is_met:
        yield "a proved design misses", f"{elsewhere.miss:.3g}"
    elif is_proved and not met.is_met and not design.defects:
        yield "a proved design misses at the inputs that it names", f"{met.miss:.3g}"
    if met.is_met and is_listed and not is_proved:
        yield "a design that meets is not proved", f"{met.miss:.3g}"


def _missing(
    task: KnownTask, found: planar.CompleteSynthesis, listed: Sequence[tuple[Any, Met]], starts: int
) -> Iterator[Fault]:
    """The linkages that should be on a list and are not, and those that are on it twice."""
    known = how_it_meets(task, task.linkage.numbers, task.angles)
    assert known.is_met
    may_exchange = task.linkage.kind == "four-bar" and all(item.inputs is None for item in task.items)
    is_lost = found.complete.startswith("incomplete")
    rows = conditions_on_numbers(*jacobian(task.linkage, task.items, task.angles, task.free))
    is_movable = len(task.free) > len(rows)  # where the linkage stands is open
    same = [design for design, met in listed if is_same(task, known, met, may_exchange, is_movable)]
    if not same:
        kind = "the known linkage is missing from " + ("an incomplete list" if is_lost else "a list")
        yield Fault(kind, " | ".join(found.summary))
    elif same[0].defects:
        yield Fault("the known linkage is called defective", "; ".join(same[0].defects))
    for k, (_, met) in enumerate(listed):
        if any(is_same(task, met, other, may_exchange) for _, other in listed[:k]):
            yield Fault("a linkage is listed twice", f"design {k + 1} of {len(listed)}")
    if is_lost or not same or is_movable:
        return
    others = [_met_by(task, *each) for each in other_solutions(task, starts)]
    missing = [each for each in others if not any(is_same(task, each, met, may_exchange) for _, met in listed)]
    if missing:
        yield Fault("a linkage is missing from a list", f"{len(missing)} of {len(others)} by Newton's method")


def _met_by(task: KnownTask, numbers: dict[str, float], angle: float, signs: tuple[float, ...]) -> Met:
    first = task.linkage.structure.kinematics(numbers, angle, signs)
    return Met(0.0, 0.0, angle, signs, first, numbers)


def is_same(task: KnownTask, one: Met, other: Met, may_exchange: bool, from_frame: bool = False) -> bool:
    """Whether two linkages have the same pins at the first entry, in the plane or on the frame."""
    wanted = _features(task, one, from_frame)
    size = max(abs(each - next(iter(wanted.values()))) for each in wanted.values()) + 1e-9
    has = _features(task, other, from_frame)
    names: list[dict[str, str]] = [{}, EXCHANGED] if may_exchange else [{}]
    senses = (1.0, -1.0) if from_frame and "line" in has else (1.0,)  # the line of a slide may be written either way
    return any(
        all(
            abs(has[name] * (1.0 if name == "line" else sense) - wanted[names_.get(name, name)]) < SAME * size
            for name in wanted
        )
        for names_ in names
        for sense in senses
    )


def _features(task: KnownTask, met: Met, from_frame: bool) -> dict[str, complex]:
    """Places by which linkages are told from each other: pins, P, and the direction of a line up to a half turn; on
    the frame, or in the plane."""
    position = met.first
    found = {name: _complex(pin) for name, pin in position.pins.items()}
    if task.linkage.structure.coupler is not None and any(item.what != "function" for item in task.items):
        found["P"] = _complex(position.place(met.numbers, task.linkage.structure.coupler, "P"))
    if position.line is not None:
        found["line"] = _complex(position.line) ** 2
    if from_frame:
        origin, output = found[task.linkage.structure.inputs], task.linkage.structure.output
        way = _complex(position.line) if position.line is not None and output == "s" else found[output] - origin
        found = {name: z / (way / abs(way)) ** 2 if name == "line" else (z - origin) / way for name, z in found.items()}
    return found


def _complex(vector: Vector) -> complex:
    return complex(float(vector.x), float(vector.y))


# how a linkage meets a task


def how_it_meets(task: KnownTask, numbers: Mapping[str, Any], inputs: Sequence[Array] | None) -> Met:
    """The greatest miss of a linkage by the file's numbers, near positions of its input or anywhere."""
    misses: list[float] = []
    first: tuple[float, tuple[float, ...]] | None = None
    for k, item in enumerate(task.items):
        said = None if inputs is None else np.asarray(inputs[k], float)
        near = _scan(task, item, numbers) if said is None or not np.isfinite(said).all() else [said]
        own, angle, signs = min((_meet_item(task, item, numbers, each) for each in near), key=lambda met: met[0])
        misses.append(own)
        first = first or (angle, signs)
    assert first is not None
    size = max(abs(float(numbers[each])) for each in task.linkage.numbers if each in numbers)
    position = task.linkage.structure.kinematics(numbers, *first)
    return Met(max(misses), _tolerance(task, numbers, size), *first, position, numbers)


def _tolerance(task: KnownTask, numbers: Mapping[str, Any], size: float) -> float:
    """Round-off of the numbers, by how much the task depends on them."""
    names = [each for each in task.linkage.numbers if each in numbers]
    linkage = task.linkage._replace(numbers={each: float(numbers[each]) for each in names})
    try:
        by_number, _ = jacobian(linkage, task.items, task.angles, names)
    except (ValueError, KeyError):
        return ROUND_OFF * (1.0 + size)
    slope = float(np.nan_to_num(np.abs(by_number) @ np.abs([linkage.numbers[each] for each in names])).max(initial=0.0))
    return ROUND_OFF * (1.0 + size) + 1e4 * float(np.finfo(float).eps) * slope


def _combinations(task: KnownTask) -> list[tuple[float, ...]]:
    return [*product((1.0, -1.0), repeat=task.linkage.structure.sign_count)]


def _meet_item(task: KnownTask, item: Item, numbers: Mapping[str, Any], said: Array) -> ItemMet:
    """The greatest miss of an item, each entry in its best assembly; where the first is met, and its signs."""
    best: ItemMet = (np.inf, float(said[0]), task.linkage.signs)
    for first in _combinations(task) if _counts_from_first(item) else [()]:
        signs, angles = _best_signs(task, item, numbers, said, first)
        angles = _refined(task, item, numbers, angles, signs)
        miss = _greatest(_rows(task, item, numbers, angles, signs))
        if miss < best[0]:
            best = (miss, float(angles[0]), tuple(float(each[0]) for each in signs))
    return best


def _counts_from_first(item: Item) -> bool:
    return item.what == "function" and not item.is_absolute


def _best_signs(
    task: KnownTask, item: Item, numbers: Mapping[str, Any], said: Array, first: tuple[float, ...]
) -> tuple[tuple[Array, ...], Array]:
    """Signs of every entry, and where the input is."""
    count = len(item.targets)
    misses, every_sign, every_angle = [], [], []
    for signs in _combinations(task):
        own = tuple(np.full(count, each) for each in signs)
        for array, value in zip(own, first, strict=False):
            array[0] = value
        angles = _refined(task, item, numbers, said, own) if item.has_open_inputs else said
        rows = np.abs(_rows(task, item, numbers, angles, own)).max(axis=0)
        if _counts_from_first(item):
            rows = np.insert(rows, 0, 0.0)
        misses.append(np.where(np.isfinite(rows), rows, np.inf))
        every_sign.append(np.stack(own))
        every_angle.append(angles)
    choice, entries = np.argmin(misses, axis=0), np.arange(count)
    return tuple(np.array(every_sign)[choice, :, entries].T), np.array(every_angle)[choice, entries]


def _rows(task: KnownTask, item: Item, numbers: Mapping[str, Any], angles: Any, signs: Any) -> Array:
    with np.errstate(all="ignore"):
        rows: Array = item_rows(item, task.linkage.structure, numbers, angles, signs)
    return rows


def _greatest(rows: Array) -> float:
    size = np.abs(rows)
    return float(np.where(np.isfinite(size), size, np.inf).max(initial=0.0))


def _refined(task: KnownTask, item: Item, numbers: Mapping[str, Any], said: Array, signs: Any) -> Array:
    """The positions of the input by least squares, as far as they are open."""
    if item.inputs is not None and item.is_absolute:
        return item.inputs
    angles = said if item.inputs is None else said[0] + (item.inputs - item.inputs[0])
    for _ in range(12):
        rows = _rows(task, item, numbers, angles + 1j * STEP, signs)
        slope, miss = rows.imag / STEP, rows.real
        along, square = (slope * miss).sum(axis=0), (slope * slope).sum(axis=0)
        if item.inputs is not None:
            along, square = along.sum(), square.sum()
        step = np.divide(along, square, out=np.zeros_like(along), where=(square > 0.0) & np.isfinite(along))
        step = np.clip(step, -0.2, 0.2)
        for _ in range(REFINED_HALVINGS):  # beside a dead point a whole step may lead beyond it
            is_within = np.isfinite(np.abs(_rows(task, item, numbers, angles - step, signs))).all(axis=0)
            if is_within.all():
                break
            step = np.where(is_within if item.inputs is None else False, step, 0.5 * step)
        angles = np.where(is_within if item.inputs is None else is_within.all(), angles - step, angles)
    return angles


def _scan(task: KnownTask, item: Item, numbers: Mapping[str, Any]) -> list[Array]:
    """Where the input comes near to every entry, over a whole turn: several such positions where all go together."""
    if item.inputs is not None and item.is_absolute:
        return [item.inputs]
    count, structure = len(item.targets), task.linkage.structure
    grid = np.linspace(-np.pi, np.pi, GRID)
    relative = np.zeros(count) if item.inputs is None else item.inputs - item.inputs[0]
    near_ends = _beside_dead_points(task, numbers, grid)
    grid = np.sort(np.concatenate([grid, *(near_ends - each for each in np.unique(relative))]))
    angles = grid[:, None] + relative
    if item.inputs is None and structure.coupler is not None:
        angles = np.vstack([angles, crank_angles(structure, numbers, item.targets[:, :2], item.what == "places")])
    every = []
    for first in _combinations(task) if _counts_from_first(item) else [()]:
        misses = []
        for signs in _combinations(task):
            rows = _rows(task, item, numbers, angles, _entry_signs(count, first, signs) if first else signs)
            miss = np.abs(rows).max(axis=0)
            misses.append(np.where(np.isfinite(miss), miss, np.inf))
        every.append(np.min(misses, axis=0))
    miss = np.min(every, axis=0)
    if item.inputs is None:
        return [angles[miss.argmin(axis=0), np.arange(count)]]
    whole = np.pad(miss.max(axis=1), 1, constant_values=np.inf)
    (least,) = np.nonzero((whole[1:-1] <= whole[:-2]) & (whole[1:-1] <= whole[2:]) & np.isfinite(whole[1:-1]))
    return [angles[row] for row in least[np.argsort(whole[1:-1][least])][:LEAST_MISSES]] or [angles[0]]


def _beside_dead_points(task: KnownTask, numbers: Mapping[str, Any], grid: Array) -> Array:
    """Positions of the input nearer and nearer to where the linkage ceases to be assembled."""
    found = []
    for signs in _combinations(task):

        def is_assembled(angles: Array, signs: tuple[float, ...] = signs) -> Array:
            with np.errstate(all="ignore"):
                output = task.linkage.structure.kinematics(numbers, angles, signs).output
            here: Array = np.isfinite(output.x if isinstance(output, Vector) else output)
            return here

        is_here = is_assembled(grid)
        (cells,) = np.nonzero(is_here[1:] != is_here[:-1])
        within, beyond = (np.where(is_here[cells] == side, grid[cells], grid[cells + 1]) for side in (True, False))
        step = within - beyond
        for _ in range(REFINED_HALVINGS + 30):
            middle = 0.5 * (within + beyond)
            is_middle = is_assembled(middle)
            within, beyond = np.where(is_middle, middle, within), np.where(is_middle, beyond, middle)
        found.append((within + step * 0.5 ** np.arange(REFINED_HALVINGS)[:, None]).ravel())
    return np.concatenate(found)


def _entry_signs(count: int, first: tuple[float, ...], others: tuple[float, ...]) -> tuple[Array, ...]:
    """The signs of the assembly at every entry: those of the first one, and those of all others."""
    return tuple(np.append(one, np.full(count - 1, other)) for one, other in zip(first, others, strict=True))
