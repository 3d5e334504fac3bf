"""Whether a design does what a task wants, by its own file and the general path."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import file_dimensions
from planar.document.files import from_dict, to_dict
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, NoAnswer, PlanarError
from planar.foundation.jets import TURN, value_and_rates
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.wording import amount
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.input_grid import motion_over_input
from planar.synthesis.judgement.defects import ORDER, REACH, WHOLE_TURN, Defect, region_defects, transmission_defects
from planar.synthesis.judgement.design_assemblies import DesignAssemblies, EntryLocator, EntryPlace, PlaceWords
from planar.synthesis.judgement.input_range import InputRange, input_range, ordered_inputs, range_motion
from planar.synthesis.task.starts import task_motion_kind
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath
from planar.synthesis.task.wanted_results import (
    carried_name,
    entry_misses,
    function_zero,
    repeat_entry,
    resting_misses,
    result_differences,
    wanted_results,
)

STEPS = 90
SAME = 1e-6
"""Of the extent of what is wanted, or rad: an entry that is missed by no more beside the fit is met as fitted."""
EXACT = 1e-9
"""The same of what is to be met exactly."""
OTHER_ASSEMBLY = 0.01
"""Of the extent of what is wanted, or rad: what misses an entry by so much more than the fit is another assembly."""
SAME_AS_FITTED = 1e-3
"""The same of results that are those of a fit, but for the digits of a file beside a dead point."""
NOWHERE_NEAR = 0.5
"""Of the root mean square of what one at rest misses: a design that misses more does not do what is wanted."""


@dataclass(frozen=True)
class Judgement:
    """What a design misses of each wanted item (n,), m or rad, where its input is (n,), and what is wrong with it."""

    misses: tuple[Array, ...]
    inputs: tuple[Array, ...]
    defects: tuple[Defect, ...]


class JudgedItem(NamedTuple):
    """A wanted item: where the input is (n,), how far entries are missed there and by the fit (n,), and where those are
    met that are not met on the branch of the sketch."""

    wanted: Wanted
    inputs: Array
    misses: Array
    fit_misses: Array
    elsewhere: tuple[EntryPlace, ...]

    @property
    def is_on_branch(self) -> BoolArray:
        """Which entries are met on the branch of the sketch."""
        found = np.ones(len(self.misses), bool)
        found[[place.entry for place in self.elsewhere]] = False
        return found


class DesignJudge:
    """Judges mechanisms by one task; `size` (m) is the extent of what is wanted, which designs meet as nearly as they
    can, or to round-off where `is_exact`."""

    def __init__(self, task: SynthesisTask, size: float, is_exact: bool = False):
        self.task, self.size, self.is_exact = task, size, is_exact

    def fit_error(self, values: Sequence[Array]) -> float:
        """The root mean square of the misses of results `values` (n, parts) of a fit, SI."""
        every = [
            entry_misses(wanted, shown, self.size, turns=self._miss_kind(wanted) == "angle")
            for wanted, shown in zip(self.task.wanted, values, strict=True)
        ]
        return float(np.sqrt(np.mean(np.concatenate(every) ** 2)))

    def judge(self, mechanism: Mechanism, inputs: Sequence[Array], values: Sequence[Array]) -> Judgement:
        """The judgement of a mechanism of which a fit has results `values` (n, parts) at `inputs` (n,), SI."""
        try:
            return self._judgement(mechanism, inputs, values)
        except NoAnswer as problem:  # where branches meet between the positions of its motion
            return self._unreached(inputs, Defect(REACH, f"it cannot be followed through what is wanted: {problem}"))

    def _judgement(self, mechanism: Mechanism, inputs: Sequence[Array], values: Sequence[Array]) -> Judgement:
        running = mechanism.inputs[0].pair
        try:
            motion = range_motion(mechanism, inputs, STEPS)
        except NoAnswer as problem:
            return self._unreached(inputs, Defect(REACH, f"it cannot be solved: {problem}"))
        reach = input_range(motion, inputs)
        try:
            shown = _results_within(mechanism, self.task.wanted, inputs, reach)
        except NoAnswer as problem:
            return self._unreached(inputs, Defect(REACH, f"it does not reach what is wanted: {problem}"))
        design = DesignAssemblies(mechanism)
        items = [
            self._judge_item(design, reach, *each) for each in zip(self.task.wanted, inputs, shown, values, strict=True)
        ]
        defects = [*self._place_defects(reach, items)]
        if not self.task.needs_whole_turn or reach.is_whole_turn:  # else it is rejected in whatever order
            defects += [*self._put_in_order(motion, reach, items)]
        defects += [*self._tolerance_defects(items)]
        if self.task.needs_whole_turn and not reach.is_whole_turn:
            low, high = (amount(each, reach.kind, mechanism.units) for each in (reach.low, reach.high))
            told = f"no whole turn: {running} goes from {low} to {high} only"
            defects.append(Defect(WHOLE_TURN, told, reach.high - reach.low, TURN))
        on_branch = np.concatenate([item.inputs[item.is_on_branch] for item in items])
        defects += [*self._motion_defects(motion, reach, on_branch), *self._rest_defects(items)]
        return Judgement(tuple(item.misses for item in items), tuple(item.inputs for item in items), tuple(defects))

    def _judge_item(  # many: what is known of an item
        self, design: DesignAssemblies, reach: InputRange, wanted: Wanted, inputs: Array, shown: Array, fitted: Array
    ) -> JudgedItem:
        """How far entries are missed on the branch of the sketch, where that shows results (n, parts), not numbers
        beyond its ends, and where those are met that it does not meet."""
        turns, scale = design.measures_angle(wanted), self._scale(design, wanted)
        zero = function_zero(wanted, fitted, turns) if isinstance(wanted, WantedFunction) else 0.0
        off, fit_off = (entry_misses(wanted, each, self.size, zero, turns=turns) for each in (shown, fitted))
        places = reach.bring(inputs)
        missed = np.flatnonzero(~(off <= fit_off + SAME * scale))
        if not isinstance(wanted, WantedFunction) and wanted.inputs is None:
            for entry in missed.tolist():
                nearest = design.nearest(wanted, entry, self.size)
                if nearest is not None and not nearest[1] >= off[entry]:
                    places[entry], off[entry] = reach.bring(np.array(nearest[:1]))[0], nearest[1]
        allowed = (SAME if self.is_exact else OTHER_ASSEMBLY) * scale
        locator = EntryLocator(design, self.size, (SAME if self.is_exact else SAME_AS_FITTED) * scale, self.is_exact)
        elsewhere = []
        for entry in np.flatnonzero(~(off <= fit_off + allowed)).tolist():
            place = locator.locate(wanted, entry, float(inputs[entry]), fitted[entry])
            if place.kind == "branch":  # where rounding leaves a dead point beyond the end
                places[entry], off[entry] = inputs[entry], fit_off[entry]
            else:
                elsewhere.append(place)
        return JudgedItem(wanted, places, off, fit_off, tuple(elsewhere))

    def _scale(self, design: DesignAssemblies, wanted: Wanted) -> float:
        """What misses of an item are compared with: rad, or the extent of what is wanted (m)."""
        return 1.0 if isinstance(wanted, WantedFunction) and design.measures_angle(wanted) else self.size

    def _place_defects(self, reach: InputRange, items: Sequence[JudgedItem]) -> Iterator[Defect]:
        """Of the entries that are met on other branches and circuits than that of the sketch."""
        if not any(item.elsewhere for item in items):
            return
        first = next(((item, int(np.argmax(item.is_on_branch))) for item in items if item.is_on_branch.any()), None)
        branch = "the branch of the sketch"
        if first is not None:
            of = f" of {first[0].wanted.of}" if len(items) > 1 else ""
            branch = f"the branch of entry {first[1] + 1}{of}"
        words = PlaceWords(
            reach,
            branch,
            lambda position: amount(position, reach.kind, self.task.units),
            lambda wanted, miss: amount(miss, self._miss_kind(wanted), self.task.units),
        )
        for item in items:
            yield from words.defects(item.wanted, item.elsewhere, item.misses)

    def _unreached(self, inputs: Sequence[Array], *defects: Defect) -> Judgement:
        return Judgement(tuple(np.full(len(positions), np.nan) for positions in inputs), tuple(inputs), defects)

    def _put_in_order(self, motion: Motion, reach: InputRange, items: Sequence[JudgedItem]) -> Iterator[Defect]:
        """Entries that are wanted in their order are met so, where that costs hardly anything; else a defect."""
        for item in items:
            wanted = item.wanted
            if isinstance(wanted, WantedFunction) or not wanted.in_order or reach.is_in_order(item.inputs):
                continue
            if item.elsewhere:
                continue
            off = np.full(len(item.inputs), np.inf)
            if wanted.inputs is None:
                ends = reach.low + reach.margin, reach.high - reach.margin
                own = ordered_inputs(partial(self._every_miss, motion, wanted), *ends, reach.is_cyclic)
                off = np.diag(self._every_miss(motion, wanted, own))
            if float((off - item.misses).max()) > OTHER_ASSEMBLY * self.size:
                yield Defect(ORDER, f"order defect: {wanted.of} does not meet its entries in their order")
            else:
                item.inputs[:], item.misses[:] = own, off

    def _every_miss(self, motion: Motion, wanted: Wanted, inputs: Array) -> Array:
        """How far each of n entries is missed at m positions of the input (m, n)."""
        shown = _results(motion.mechanism, [wanted], [inputs])[0]
        every = [
            entry_misses(repeat_entry(wanted, k, len(inputs)), shown, self.size) for k in range(len(wanted.weights))
        ]
        return np.stack(every, axis=1)

    def _tolerance_defects(self, items: Sequence[JudgedItem]) -> Iterator[Defect]:
        for item in items:
            wanted, own = item.wanted, np.where(item.is_on_branch, item.misses, 0.0)
            scale = 1.0 if isinstance(wanted, WantedFunction) else self.size
            spared = (SAME if wanted.tolerance else EXACT) * scale  # for what rounding of a file takes
            if wanted.tolerance is not None and float(own.max(initial=0.0)) > wanted.tolerance + spared:
                kind = self._miss_kind(wanted)
                entry, units = int(np.argmax(own)), self.task.units
                off, most = (amount(each, kind, units) for each in (float(own[entry]), wanted.tolerance))
                told = f"entry {entry + 1} of {wanted.of} is missed by {off}, more than the tolerance of {most}"
                demand = f"the tolerance of {wanted.of}"
                yield Defect(demand, told, float(own[entry]), wanted.tolerance, kind, more=False, verb="misses by")

    def _rest_defects(self, items: Sequence[JudgedItem]) -> Iterator[Defect]:
        """What does little better than one that stands still, as where a demand leaves it no room.

        An entry that is met on another branch counts by its miss there.
        """
        for item in items:
            wanted, own = item.wanted, np.where(item.is_on_branch, item.misses, item.fit_misses)
            resting, off = (float(np.sqrt(np.mean(each**2))) for each in (resting_misses(wanted, self.size), own))
            if resting > 0.0 and off > NOWHERE_NEAR * resting:
                told = (
                    f"{wanted.of} comes nowhere near: its misses are {off / resting:.2g} of those of one at rest "
                    "amid what is wanted"
                )
                yield Defect(self._narrow_demands(), told)

    def _narrow_demands(self) -> str:
        """The demands that may leave what is wanted no room."""
        demands = self.task.demands
        names = ["the region"] * (demands.inside is not None)
        names += ["the transmission angle"] * (demands.transmission is not None)
        names += [WHOLE_TURN] * self.task.needs_whole_turn
        names += ["the bounds"] * bool(self.task.within)
        return " or ".join(names) or "what is wanted"

    def _miss_kind(self, wanted: Wanted) -> str:
        return task_motion_kind(self.task, wanted.to_pair) if isinstance(wanted, WantedFunction) else "length"

    def _motion_defects(self, motion: Motion, reach: InputRange, inputs: Array) -> Iterator[Defect]:
        """What is wrong with the motion over a whole turn, else between positions (n,) of the input."""
        demands = self.task.demands
        if (demands.transmission is None and demands.inside is None) or not len(inputs):
            return
        if not reach.is_whole_turn:
            try:
                motion = cycle(motion.mechanism, STEPS, float(inputs.min()), float(inputs.max()), reach.pair)
            except (NoAnswer, BadInput) as problem:
                yield Defect(REACH, f"it does not run through what is wanted: {problem}")
                return
        if demands.transmission is not None:
            yield from transmission_defects(motion, demands.transmission)
        if demands.inside is not None:
            yield from region_defects(motion, demands.inside)


def _results_within(
    mechanism: Mechanism, wanted: Sequence[Wanted], inputs: Sequence[Array], reach: InputRange
) -> list[Array]:
    """What is shown (n, parts) at positions (n,) of the input, not numbers beyond the ends of its range. Raises
    NoAnswer."""
    within = [~reach.are_beyond(positions) for positions in inputs]
    places = [reach.bring(positions[rows]) for positions, rows in zip(inputs, within, strict=True)]
    if not any(len(place) for place in places):
        return [np.full(wanted_results(item).shape, np.nan) for item in wanted]
    found = []
    for each, rows, shown in zip(wanted, within, _results(mechanism, wanted, places), strict=True):
        every = np.full(wanted_results(each).shape, np.nan)
        every[rows] = shown
        found.append(every)
    return found


def _results(mechanism: Mechanism, wanted: Sequence[Wanted], inputs: Sequence[Array]) -> list[Array]:
    """What is shown (n, parts) at positions of the input. Raises NoAnswer."""
    sizes = [len(positions) for positions in inputs]
    motion = motion_over_input(mechanism, np.concatenate(inputs))
    found, first = [], 0
    for item, size in zip(wanted, sizes, strict=True):
        rows = slice(first, first + size)
        first += size
        if isinstance(item, WantedPath):
            found.append(motion.point(carried_name(mechanism, item.point)).position[rows])
        elif isinstance(item, WantedFunction):
            position = next(iter(relative_motions(mechanism)[item.to_pair].result_kinds))
            found.append(np.asarray(motion.pair(item.to_pair)[position])[rows, None])
        else:
            parts = (getattr(motion.frames[item.link], part) for part in ("x", "y", "angle"))
            values = [np.broadcast_to(np.asarray(value_and_rates(part)[0], float), len(motion)) for part in parts]
            found.append(np.stack(values, axis=1)[rows])
    return found


ROUND_OFF = 1024.0 * float(np.finfo(float).eps)
"""Of the greatest length: what the numbers of a file and the positions of its input are out by; results are out by as
much times the condition of the position."""
INPUT_STEPS, INPUT_DIFFERENCE = 3, 1e-7
"""Steps to where an open input comes nearest to an entry, and the difference (rad or m) by which they are taken."""
ENTRY_TOLERANCE = 1e-6
"""Of the extent of what is wanted, or rad: a file that misses more meets nothing, however ill-conditioned it is."""


class FileCheck(NamedTuple):
    """A mechanism read from its own file, and how it meets entries there.

    `results` (n, parts) of each item are what it is to show, `misses` (n,) how far it is from that (m or rad) in the
    assembly that comes nearest, infinite where it cannot be assembled; `tolerances` (n,) are what round-off explains.
    """

    mechanism: Mechanism
    results: tuple[Array, ...]
    misses: tuple[Array, ...]
    tolerances: tuple[Array, ...]
    scales: tuple[float, ...]
    "what misses of each item are compared with: rad, or the extent of what is wanted (m)"

    @property
    def is_met(self) -> bool:
        """Whether every entry is met to round-off."""
        limits = [
            np.minimum(own, ENTRY_TOLERANCE * scale) for own, scale in zip(self.tolerances, self.scales, strict=True)
        ]
        return all(bool((off <= limit).all()) for off, limit in zip(self.misses, limits, strict=True))

    @property
    def is_rounded(self) -> bool:
        """Whether round-off explains all misses."""
        return all(bool((off <= limit).all()) for off, limit in zip(self.misses, self.tolerances, strict=True))

    @property
    def worst(self) -> tuple[int, int]:
        """The item and the entry that are missed most, of what each is compared with."""
        every = [float(off.max()) / scale for off, scale in zip(self.misses, self.scales, strict=True)]
        item = int(np.argmax(every))
        return item, int(np.argmax(self.misses[item]))


def read_back(mechanism: Mechanism) -> Mechanism:
    """A mechanism from the text of its own file. Raises BadInput."""
    return from_dict(json.loads(json.dumps(to_dict(mechanism))))


def check_file(mechanism: Mechanism, wanted: Sequence[Wanted], inputs: Sequence[Array], size: float) -> FileCheck:
    """How the file of a mechanism meets wanted items at positions (n,) of its running input, the first of which is that
    of its sketch; `size` (m) is the extent of what is wanted. Raises BadInput where the file cannot be read."""
    again = read_back(mechanism)
    lengths = [abs(each.value) for each in file_dimensions(again).values() if each.kind == "length"]
    try:
        design = DesignAssemblies(again)
    except PlanarError:
        design = None
    results, misses, tolerances, scales = [], [], [], []
    for item, positions in zip(wanted, inputs, strict=True):
        result, is_angle = wanted_results(item), design is None or design.measures_angle(item)
        scale = 1.0 if isinstance(item, WantedFunction) and is_angle else size
        if design is None:
            none = np.full(len(result), np.inf)
            off, within = none, 0.0 * result[:, 0]
        else:
            if isinstance(item, WantedFunction) and not item.is_absolute:  # counted from the first entry
                first = design.results(item, design.home[None], positions[:1])
                result = result - result[:1] + first
            off, within = _entries(design, item, result, positions, size)
        within = within * ROUND_OFF * scale * max(1.0, *(length / size for length in lengths))
        if design is not None and not isinstance(item, WantedFunction) and item.inputs is None:
            for k in np.flatnonzero((off > within) & np.isfinite(off)):  # where the input is was not solved for itself
                off[k] = min(off[k], _least_miss(design, item, result[k], float(positions[k]), size))
        results.append(result)
        misses.append(off)
        tolerances.append(within)
        scales.append(scale)
    return FileCheck(again, tuple(results), tuple(misses), tuple(tolerances), tuple(scales))


def _least_miss(design: DesignAssemblies, wanted: Wanted, result: Array, position: float, size: float) -> float:
    """How far an entry is from a result (parts,) with the input where it comes nearest, beside a position."""
    least = np.inf
    for _ in range(INPUT_STEPS):
        near = [design.at(each) for each in (position, position + INPUT_DIFFERENCE)]
        if not all(len(each) for each in near):
            break
        shown = design.results(wanted, near[0], np.full(len(near[0]), position))
        off = result_differences(wanted, shown, result, size)
        nearest = int(np.argmin(off))
        least = min(least, float(off[nearest]))
        there = near[1][np.argmin(np.abs(near[1] - near[0][nearest]).max(axis=1))]
        ahead = design.results(wanted, there[None], np.array([position + INPUT_DIFFERENCE]))[0]
        slope = (ahead - shown[nearest]) / INPUT_DIFFERENCE
        miss = shown[nearest] - result
        miss[2:] = (miss[2:] + np.pi) % (2.0 * np.pi) - np.pi
        position -= float(miss @ slope) / max(float(slope @ slope), 1e-300)
    return least


def _entries(
    design: DesignAssemblies, wanted: Wanted, results: Array, positions: Array, size: float
) -> tuple[Array, Array]:
    """How far entries are from results (n, parts) at positions (n,) in the assembly that comes nearest (n,), and the
    condition of that (n,)."""
    misses, conditions = np.full(len(positions), np.inf), np.ones(len(positions))
    for k, position in enumerate(positions.tolist()):
        z = design.at(position)
        if not len(z):
            continue
        shown = design.results(wanted, z, np.full(len(z), position))
        off = result_differences(wanted, shown, results[k], size, design.measures_angle(wanted))
        nearest = int(np.argmin(off))
        misses[k], conditions[k] = off[nearest], design.condition(z[nearest], position)
    return misses, conditions
