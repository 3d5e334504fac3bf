"""How much of what a task wants its free numbers can meet, and whether they move a mechanism as a whole.

Both are ranks. An entry's result r depends on the free numbers d and, along its path, on the input; where the input is
not given the part along the path is left out. Zeros of scales that are sought are unknowns beside d.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.analysis.calibration.identifiability import unseen_changes
from planar.derivatives.design_equations import design_equations
from planar.document.revised.changed_numbers import with_values
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, PlanarError
from planar.model.mechanism import Mechanism
from planar.model.wording import count_phrase
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.synthesis.task.starts import FreeNumbers, free_numbers, motion_kind
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath
from planar.synthesis.task.wanted_results import wanted_slopes

MOVED = 1e-6
"""Of a move: what free numbers leave of it is none."""
GENERIC_CHANGE = 0.01
"""Of a number, or of the size: by as much a start is changed that may be a special one."""
SPREAD = 0.6180339887498949
"""Of the motion: how far it is from one entry to the next, so that any number of them lies well spread."""


RANDOM_STARTS = 24
"""Of mechanisms at random, more and more different from a start that does not move."""
LEAST_POSITIONS = 24
"""Of a motion, at which derivatives are taken."""
NEARLY_SINGULAR = 1e6
"""Of the median of derivatives: a position with greater ones is a dead point."""
MOVES = 4
"""Along x, along y, a turn, growth."""


class FreedomCount(NamedTuple):
    """How many independent unknowns a task leaves free, zeros of scales included, how many conditions what is wanted
    sets beyond inputs that are not given, and how many of these can be met exactly."""

    free: int
    demanded: int
    met: int

    @property
    def excess(self) -> int:
        """How many conditions more are set than can be met exactly."""
        return self.demanded - self.met

    @property
    def sentence(self) -> str:
        """The count in words."""
        sets = f"what is wanted sets {count_phrase(self.demanded, 'condition')}"
        free = f"{count_phrase(self.free, 'independent number is', 'independent numbers are')} free"
        left = self.free - self.met
        told = [f"{self.excess} more than can be met exactly"] if self.excess else []
        told += [f"{count_phrase(left, 'stays', 'stay')} open"] if left else []
        return f"{sets}, and {free}: {' and '.join(told) or 'as many'}"


class _ResultRows(NamedTuple):
    """Results (n, parts) of a wanted item at n positions, with their derivatives by the free numbers (n, parts, free)
    and by the input (n, parts); lengths in units of the mechanism."""

    wanted: Wanted
    values: Array
    slopes: Array
    along: Array

    @property
    def is_timed(self) -> bool:
        """Whether the input is given at every entry."""
        return self.wanted.inputs is not None

    def spread(self, count: int) -> _ResultRows:
        """So many of the positions, which lie well spread over the motion."""
        many = len(self.values)
        if count >= many:
            return self
        at = np.argsort(np.argsort(np.modf(SPREAD * np.arange(1, many + 1))[0]))[:count]
        return _ResultRows(self.wanted, *(each[at] for each in self[1:]))

    def project(self, rows: Array) -> Array:
        """Rows (n, parts, ...) without their part along the path, where the input is not given."""
        if self.is_timed:
            return rows
        unit = self.along / np.maximum(np.linalg.norm(self.along, axis=1, keepdims=True), np.finfo(float).tiny)
        found: Array = rows - unit[:, :, None] * np.einsum("np,npk->nk", unit, rows)[:, None]
        return found

    def zeros(self) -> Array:
        """The derivatives (n, parts, zeros) by the zeros of scales that are sought."""
        if self.wanted.is_absolute or not self.is_timed:
            return np.zeros((*self.values.shape, 0))
        of_values = [np.ones_like(self.along)] if isinstance(self.wanted, WantedFunction) else []
        return np.stack([self.along, *of_values], axis=2)

    @property
    def condition_count(self) -> int:
        """How many conditions its wanted entries set."""
        parts = int(self.values.shape[1])
        return len(self.wanted.weights) * (parts if self.is_timed else parts - 1)


def count_freedom(task: SynthesisTask, mechanism: Mechanism, wanted: Sequence[Wanted] | None = None) -> FreedomCount:
    """The free unknowns of a start (see `start_mechanisms`) beside the conditions of what is `wanted`, by rank: of all
    that the task wants, or of some of it.

    A four-bar whose coupler point comes to places at any input meets nine of them exactly, a function five pairs.
    Raises NoAnswer where the start cannot move.
    """
    free = free_numbers(task, mechanism)
    conditions = task.wanted if wanted is None else wanted
    items = _result_rows(generic_start(mechanism, free), conditions, free)
    every, own = (
        unseen_changes(_stack([item.spread(count) for item, count in zip(items, counts, strict=True)]))[2]
        for counts in ([len(item.values) for item in items], [len(condition.weights) for condition in conditions])
    )
    return FreedomCount(every, sum(item.condition_count for item in items), own)


def number_slopes(task: SynthesisTask, mechanism: Mechanism, free: FreeNumbers) -> Array:
    """The derivatives (rows, numbers and zeros of scales) of all that is wanted by the free numbers, over the motion of
    a mechanism near a start. Raises NoAnswer where the start cannot move."""
    return _stack(_result_rows(moving_start(mechanism, free), task.wanted, free))


def has_open_numbers(task: SynthesisTask, mechanism: Mechanism) -> bool:
    """Whether a start can meet all that is wanted exactly with numbers to spare; no where it cannot move."""
    try:
        count = count_freedom(task, mechanism)
    except NoAnswer:
        return False
    return not count.excess and count.free > count.met


def exactness_in_excess(task: SynthesisTask, mechanism: Mechanism) -> str | None:
    """What forbids that a start meets all that is to be met exactly, in words; None where nothing does."""
    if not task.exact:
        return None
    count = count_freedom(task, mechanism, task.exact)
    if not count.excess:
        return None
    free = count_phrase(count.free, "independent number is", "independent numbers are")
    met = f", by which {count.met} can be met" if count.met < count.free else ""
    sets = f"what is to be met exactly, with a tolerance of 0, sets {count_phrase(count.demanded, 'condition')}"
    return f"{sets}, and only {free} free in {mechanism.name!r}{met}: give some of it a tolerance"


def can_move_whole(task: SynthesisTask, mechanism: Mechanism, free: FreeNumbers) -> bool:
    """Whether free numbers, but for their bounds, bring what is wanted of the mechanism to any place, size and turn."""
    if any(isinstance(item, WantedFunction) for item in task.wanted):
        return False
    items = _result_rows(mechanism, task.wanted, free)
    matrix = _stack(items)
    right = np.concatenate([item.project(_moves(item)).reshape(-1, MOVES) for item in items])
    left = right - matrix @ np.linalg.lstsq(matrix, right, rcond=None)[0]
    return bool((np.linalg.norm(left, axis=0) <= MOVED * np.linalg.norm(right, axis=0)).all())


def _moves(item: _ResultRows) -> Array:
    """How results change where the mechanism moves along x, along y, turns about the origin and grows (n, parts, 4)."""
    found = np.zeros((*item.values.shape, MOVES))
    x, y = item.values[:, 0], item.values[:, 1]
    found[:, 0, 0] = found[:, 1, 1] = 1.0
    found[:, 0, 2], found[:, 1, 2] = -y, x
    found[:, 0, 3], found[:, 1, 3] = x, y
    if not isinstance(item.wanted, WantedPath):
        found[:, 2, 2] = 1.0
    return found


def _stack(items: Sequence[_ResultRows]) -> Array:
    """The derivatives (rows, unknowns) of all results by the free numbers and by each item's own zeros."""
    zeros = [item.zeros() for item in items]
    total = sum(zero.shape[2] for zero in zeros)
    rows, first = [], 0
    for item, own in zip(items, zeros, strict=True):
        wide = np.zeros((*own.shape[:2], total))
        wide[..., first : first + own.shape[2]] = own
        first += own.shape[2]
        both = item.project(np.concatenate([item.slopes, wide], axis=2))
        rows.append(both.reshape(-1, both.shape[2]))
    return np.concatenate(rows)


def _result_rows(mechanism: Mechanism, wanted: Sequence[Wanted], free: FreeNumbers) -> list[_ResultRows]:
    """What is wanted over the motion of a mechanism, where it is determined, with its derivatives."""
    motion = _motion(mechanism, max(LEAST_POSITIONS, 2 * len(free.names)))
    system, derived = wanted_slopes(motion, wanted)
    all_slopes = np.concatenate([*derived.slopes.values()], axis=1)
    sizes = np.abs(np.nan_to_num(all_slopes)).max(axis=(1, 2), initial=0.0)
    regular = ~derived.is_singular & (sizes <= NEARLY_SINGULAR * np.median(sizes))
    results = [values[regular] for values in derived.values.values()]
    values = np.concatenate(results, axis=1)
    units = [
        system.parameters.unit if _is_length(mechanism, item, part) else 1.0
        for item, own in zip(wanted, results, strict=True)
        for part in range(own.shape[1])
    ]
    slopes = all_slopes[regular] * system.parameters.scale / np.array(units)[:, None]
    columns = [system.names.index(name) for name in free.names]
    ends = np.cumsum([0, *(result.shape[1] for result in results)])
    return [
        _ResultRows(
            item,
            (values / units)[:, first:last],
            slopes[:, first:last][..., columns],
            slopes[:, first:last, 0],
        )
        for item, first, last in zip(wanted, ends[:-1], ends[1:], strict=True)
    ]


def _motion(mechanism: Mechanism, steps: int) -> Motion:
    """The motion through the range of the input; of a slide without an end so far as the mechanism is large, both ways.
    Raises NoAnswer where it cannot move."""
    running = mechanism.inputs[0]
    try:
        return cycle(mechanism, steps, pair=running.pair)
    except BadInput:
        room, start = design_equations(mechanism).solver.unit, float(running.position)
        return cycle(mechanism, steps, start - room, start + room, running.pair)


def _is_length(mechanism: Mechanism, wanted: Wanted, part: int) -> bool:
    if isinstance(wanted, WantedFunction):
        return motion_kind(mechanism, wanted.to_pair) == "length"
    return part < 2


def moving_start(mechanism: Mechanism, free: FreeNumbers) -> Mechanism:
    """A mechanism that moves, with other values of the free numbers than a start, as near to it as can be found. Raises
    NoAnswer where none is found."""
    rng, drive = np.random.default_rng(7), mechanism.inputs[0]
    turns = np.where(np.array(free.kinds) == "length", _size(free), 1.0)
    for spread in (None, *np.geomspace(0.02, 1.0, RANDOM_STARTS)):
        try:
            if spread is None:
                changed = generic_start(mechanism, free)
            else:
                values = np.clip(free.values + spread * turns * rng.normal(size=len(turns)), free.lower, free.upper)
                changed = with_values(mechanism, dict(zip(free.names, values.tolist(), strict=True)))
                if motion_kind(mechanism, drive.pair) == "angle":
                    changed = with_values(changed, {f"{drive.pair}.position": rng.uniform(-np.pi, np.pi)})
            cycle(changed, LEAST_POSITIONS, pair=drive.pair)
        except PlanarError as problem:
            reason = problem
        else:
            return changed
    raise reason


def _size(free: FreeNumbers) -> float:
    """The greatest of the free lengths (m), 1 where there is none."""
    return float(np.abs(free.values[np.array(free.kinds) == "length"]).max(initial=0.0)) or 1.0


def generic_start(mechanism: Mechanism, free: FreeNumbers) -> Mechanism:
    """A mechanism near a start, which may be a special one; the start itself, where that does not go together."""
    size = _size(free)
    way = np.cos(1.0 + np.arange(len(free.names)))
    scale = np.where(np.array(free.kinds) == "length", size, 1.0)
    values = np.clip(free.values + GENERIC_CHANGE * way * scale, free.lower, free.upper)
    try:
        changed = with_values(mechanism, dict(zip(free.names, values.tolist(), strict=True)))
        _motion(changed, LEAST_POSITIONS)
    except PlanarError:
        return mechanism
    return changed
