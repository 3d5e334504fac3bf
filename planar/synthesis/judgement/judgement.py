"""A design judged by the general path: what it misses, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.jets import TURN, Scalar, value_and_rates
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.wording import amount
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.grids.grid_motion import motion_over_input
from planar.synthesis.judgement.defects import Defect
from planar.synthesis.judgement.entry_order import ordered_inputs
from planar.synthesis.judgement.input_range import InputRange, input_range, range_motion
from planar.synthesis.judgement.misses import entry_misses, repeat_entry, resting_misses
from planar.synthesis.judgement.motion_demands import region_defects, transmission_defects
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath
from planar.synthesis.task.task_numbers import task_motion_kind
from planar.synthesis.task.wanted_expressions import carried_name

STEPS = 90
SAME = 1e-6
"""Of the extent of what is wanted, or rad: an entry that is missed by no more beside the fit is met as fitted."""
FEET, FOOT_POSITIONS = 4, 13
"""How often, and at how many positions of the input, the nearest one to an entry is looked for."""
EXACT = 1e-9
"""The same of what is to be met exactly."""
REACH, ORDER, WHOLE_TURN, ONE_BRANCH = "the reach", "the order", "the whole turn", "one branch"
OTHER_ASSEMBLY = 0.01
"""Of the extent of what is wanted, or rad: what misses an entry by so much more than the fit is another assembly."""
NOWHERE_NEAR = 0.5
"""Of the root mean square of what one at rest misses: a design that misses more does not do what is wanted."""


@dataclass(frozen=True)
class Judgement:
    """What a design misses of each wanted item (n,), m or rad, where its input is (n,), and what is wrong with it."""

    misses: tuple[Array, ...]
    inputs: tuple[Array, ...]
    defects: tuple[Defect, ...]


class DesignJudge:
    """Judges mechanisms by one task; `size` (m) is the extent of what is wanted."""

    def __init__(self, task: SynthesisTask, size: float):
        self.task, self.size = task, size

    def fit_error(self, values: Sequence[Array]) -> float:
        """The root mean square of the misses of results `values` (n, parts) of a fit, SI."""
        every = [entry_misses(*each, self.size) for each in zip(self.task.wanted, values, strict=True)]
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
        defects = [*self._branch_defects(mechanism, reach, inputs)]
        if defects:
            return self._unreached(inputs, *defects)
        there = [reach.bring(each) for each in inputs]
        try:
            shown = _results(mechanism, self.task.wanted, there)
        except NoAnswer as problem:
            return self._unreached(inputs, Defect(REACH, f"it does not reach what is wanted: {problem}"))
        misses = []
        for k, (wanted, own, fitted) in enumerate(zip(self.task.wanted, shown, values, strict=True)):
            off, fit_off = entry_misses(wanted, own, self.size), entry_misses(wanted, fitted, self.size)
            scale = 1.0 if isinstance(wanted, WantedFunction) else self.size
            missed = np.flatnonzero(off > fit_off + SAME * scale)
            if len(missed) and not isinstance(wanted, WantedFunction) and wanted.inputs is None:
                there[k][missed], off[missed] = self._nearest_on_branch(motion, reach, wanted, missed)
            more = off - fit_off
            if float(more.max(initial=0.0)) > OTHER_ASSEMBLY * scale:
                entry = int(np.argmax(more))
                told = f"circuit defect: {wanted.of} meets entry {entry + 1} in another assembly only"
                defects.append(Defect("one circuit", told))
            misses.append(off)
        if not self.task.needs_whole_turn or reach.is_whole_turn:  # else it is rejected in whatever order
            defects += [*self._put_in_order(motion, reach, there, misses)]
        defects += [*self._tolerance_defects(misses)]
        if self.task.needs_whole_turn and not reach.is_whole_turn:
            low, high = (amount(each, reach.kind, mechanism.units) for each in (reach.low, reach.high))
            told = f"no whole turn: {running} goes from {low} to {high} only"
            defects.append(Defect(WHOLE_TURN, told, reach.high - reach.low, TURN))
        defects += [*self._motion_defects(motion, reach, there), *self._rest_defects(misses)]
        return Judgement(tuple(misses), tuple(there), tuple(defects))

    def _nearest_on_branch(
        self, motion: Motion, reach: InputRange, wanted: Wanted, entries: IntArray
    ) -> tuple[Array, Array]:
        """Where the input is nearest to entries, and how far off that is; a fit beyond a dead point tells neither."""
        nearest, least = np.empty(len(entries)), np.empty(len(entries))
        tried = [np.linspace(reach.low + reach.margin, reach.high - reach.margin, len(motion))] * len(entries)
        shown = _results(motion.mechanism, [wanted], tried[:1]) * len(entries)
        for foot in range(FEET):
            if foot:
                shown = _results(motion.mechanism, [wanted] * len(entries), tried)
            for k, entry in enumerate(entries.tolist()):
                at = tried[k]
                off = entry_misses(repeat_entry(wanted, entry, len(at)), shown[k], self.size)
                best = int(np.nanargmin(off))
                nearest[k], least[k] = at[best], off[best]
                tried[k] = np.linspace(at[max(best - 1, 0)], at[min(best + 1, len(at) - 1)], FOOT_POSITIONS)
        return nearest, least

    def _unreached(self, inputs: Sequence[Array], *defects: Defect) -> Judgement:
        return Judgement(tuple(np.full(len(each), np.nan) for each in inputs), tuple(inputs), defects)

    def _branch_defects(self, mechanism: Mechanism, reach: InputRange, inputs: Sequence[Array]) -> Iterator[Defect]:
        for wanted, own in zip(self.task.wanted, inputs, strict=True):
            beyond = reach.are_beyond(own)
            if beyond.any():
                entry = int(np.argmax(beyond))
                ends = " to ".join(amount(each, reach.kind, mechanism.units) for each in (reach.low, reach.high))
                yield Defect(
                    ONE_BRANCH,
                    f"branch defect: entry {entry + 1} of {wanted.of} lies beyond a dead point; the branch of the "
                    f"first goes from {reach.pair} = {ends}",
                )

    def _put_in_order(
        self, motion: Motion, reach: InputRange, inputs: list[Array], misses: list[Array]
    ) -> Iterator[Defect]:
        """Entries that are wanted in their order are met so, where that costs hardly anything; else a defect."""
        for k, wanted in enumerate(self.task.wanted):
            if isinstance(wanted, WantedFunction) or not wanted.in_order or reach.is_in_order(inputs[k]):
                continue
            off = np.full(len(inputs[k]), np.inf)
            if wanted.inputs is None:
                ends = reach.low + reach.margin, reach.high - reach.margin
                own = ordered_inputs(partial(self._every_miss, motion, wanted), *ends, reach.is_cyclic)
                off = np.diag(self._every_miss(motion, wanted, own))
            if float((off - misses[k]).max()) > OTHER_ASSEMBLY * self.size:
                yield Defect(ORDER, f"order defect: {wanted.of} does not meet its entries in their order")
            else:
                inputs[k], misses[k] = own, off

    def _every_miss(self, motion: Motion, wanted: Wanted, inputs: Array) -> Array:
        """How far each of n entries is missed at m positions of the input (m, n)."""
        shown = _results(motion.mechanism, [wanted], [inputs])[0]
        every = [
            entry_misses(repeat_entry(wanted, k, len(inputs)), shown, self.size) for k in range(len(wanted.weights))
        ]
        return np.stack(every, axis=1)

    def _tolerance_defects(self, misses: Sequence[Array]) -> Iterator[Defect]:
        for wanted, own in zip(self.task.wanted, misses, strict=True):
            scale = 1.0 if isinstance(wanted, WantedFunction) else self.size
            spared = (SAME if wanted.tolerance else EXACT) * scale  # for what rounding of a file takes
            if wanted.tolerance is not None and float(own.max(initial=0.0)) > wanted.tolerance + spared:
                kind = self._miss_kind(wanted)
                entry, units = int(np.argmax(own)), self.task.units
                off, most = (amount(each, kind, units) for each in (float(own[entry]), wanted.tolerance))
                told = f"entry {entry + 1} of {wanted.of} is missed by {off}, more than the tolerance of {most}"
                demand = f"the tolerance of {wanted.of}"
                yield Defect(demand, told, float(own[entry]), wanted.tolerance, kind, more=False, verb="misses by")

    def _rest_defects(self, misses: Sequence[Array]) -> Iterator[Defect]:
        """What does little better than one that stands still, as where a demand leaves it no room."""
        for wanted, own in zip(self.task.wanted, misses, strict=True):
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

    def _motion_defects(self, motion: Motion, reach: InputRange, inputs: Sequence[Array]) -> Iterator[Defect]:
        demands = self.task.demands
        if demands.transmission is None and demands.inside is None:
            return
        if not reach.is_whole_turn:
            every = np.concatenate(inputs)
            try:
                motion = cycle(motion.mechanism, STEPS, float(every.min()), float(every.max()), reach.pair)
            except (NoAnswer, BadInput) as problem:
                yield Defect(REACH, f"it does not run through what is wanted: {problem}")
                return
        if demands.transmission is not None:
            yield from transmission_defects(motion, demands.transmission)
        if demands.inside is not None:
            yield from region_defects(motion, demands.inside)


def _results(mechanism: Mechanism, wanted: Sequence[Wanted], inputs: Sequence[Array]) -> list[Array]:
    """What is shown (n, parts) at positions of the input. Raises NoAnswer."""
    sizes = [len(each) for each in inputs]
    motion = motion_over_input(mechanism, np.concatenate(inputs))
    found, first = [], 0
    for each, size in zip(wanted, sizes, strict=True):
        rows = slice(first, first + size)
        first += size
        if isinstance(each, WantedPath):
            found.append(motion.point(carried_name(mechanism, each.point)).position[rows])
        elif isinstance(each, WantedFunction):
            found.append(np.asarray(motion.pair(each.to_pair)[_pair_result(mechanism, each.to_pair)])[rows, None])
        else:
            frame = motion.frames[each.link]
            parts = [_values(getattr(frame, part), len(motion)) for part in ("x", "y", "angle")]
            found.append(np.stack(parts, axis=1)[rows])
    return found


def _pair_result(mechanism: Mechanism, name: str) -> str:
    """The name of the result of a pair that is its position."""
    return next(iter(relative_motions(mechanism)[name].result_kinds))


def _values(jet: Scalar, many: int) -> Array:
    value = np.asarray(value_and_rates(jet)[0], float)
    return np.broadcast_to(value, (many,))
