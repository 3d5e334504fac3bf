"""A design judged by the general path: what it misses, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from planar.analysis.motion.transmission_angle import transmission
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, NoAnswer, PlanarError
from planar.foundation.jets import TURN, Scalar, value_and_rates
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.model.wording import amount
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.grids.grid_motion import motion_over_input
from planar.synthesis.task.synthesis_task import SynthesisTask, Wanted, WantedFunction, WantedPath
from planar.synthesis.task.wanted_expressions import carried_name

STEPS = 90
SAME = 1e-6
"""Of the extent of what is wanted, or rad: an entry that is missed by no more beside the fit is met as fitted."""
FEET, FOOT_POSITIONS = 4, 13
"""How often, and at how many positions of the input, the nearest one to an entry is looked for."""
OTHER_ASSEMBLY = 0.01
"""Of the extent of what is wanted, or rad: what misses an entry by so much more than the fit is another assembly."""
ON_END = 1e-6
"""rad, or of the range: an entry so little beyond the end of a branch is on it."""


@dataclass(frozen=True)
class Judgement:
    """What a design misses of each wanted item (n,), m or rad, where its input is (n,), and what is wrong with it."""

    misses: tuple[Array, ...]
    inputs: tuple[Array, ...]
    defects: tuple[str, ...]


class DesignJudge:
    """Judges mechanisms by one task; `size` (m) is the extent of what is wanted."""

    def __init__(self, task: SynthesisTask, size: float):
        self.task, self.size = task, size

    def judge(self, mechanism: Mechanism, inputs: Sequence[Array], values: Sequence[Array]) -> Judgement:
        """The judgement of a mechanism of which a fit has results `values` (n, parts) at `inputs` (n,), SI."""
        running = mechanism.inputs[0].pair
        try:
            motion = cycle(mechanism, STEPS, pair=running)
        except NoAnswer as problem:
            return self._unreached(inputs, f"it cannot be solved: {problem}")
        given = motion.inputs[running].position
        is_whole = _turns(mechanism) and float(np.ptp(given)) > TURN * (1.0 - 1e-9)
        inputs = [_by_whole_turns(each, given) if _turns(mechanism) else each for each in inputs]
        defects = [*self._branch_defects(mechanism, motion, is_whole, inputs)]
        if defects:
            return self._unreached(inputs, *defects)
        there = [_brought_into(each, given, is_whole) for each in inputs]
        try:
            shown = _results(mechanism, self.task.wanted, there)
        except NoAnswer as problem:
            return self._unreached(inputs, f"it does not reach what is wanted: {problem}")
        misses = []
        for k, (wanted, own, fitted) in enumerate(zip(self.task.wanted, shown, values, strict=True)):
            off, fit_off = _misses(wanted, own, self.size), _misses(wanted, fitted, self.size)
            scale = 1.0 if isinstance(wanted, WantedFunction) else self.size
            for entry in np.flatnonzero(off > fit_off + SAME * scale).tolist():
                if not isinstance(wanted, WantedFunction) and wanted.inputs is None:
                    there[k][entry], off[entry] = self._nearest_on_branch(motion, k, entry)
            more = off - fit_off
            if float(more.max(initial=0.0)) > OTHER_ASSEMBLY * scale:
                entry = int(np.argmax(more))
                defects.append(f"circuit defect: {wanted.of} meets entry {entry + 1} in another assembly only")
            misses.append(off)
        defects += [*self._order_defects(mechanism, there, is_whole)]
        defects += [*self._tolerance_defects(misses)]
        if self.task.demands.whole_turn and not is_whole:
            low, high = (
                amount(float(each), _input_kind(mechanism), mechanism.units) for each in (given.min(), given.max())
            )
            defects.append(f"no whole turn: {running} goes from {low} to {high} only")
        defects += [*self._motion_defects(mechanism, motion, there, is_whole)]
        return Judgement(tuple(misses), tuple(there), tuple(defects))

    def _nearest_on_branch(self, motion: Motion, item: int, entry: int) -> tuple[float, float]:
        """Where the input is nearest to an entry, and how far off that is; a fit beyond a dead point tells neither."""
        wanted = self.task.wanted[item]
        given = np.sort(motion.inputs[motion.mechanism.inputs[0].pair].position)
        margin = ON_END * float(np.ptp(given))
        tried = np.clip(given, given[0] + margin, given[-1] - margin)
        for _ in range(FEET):
            shown = _results(motion.mechanism, [wanted], [tried])[0]
            off = _misses(_at_entry(wanted, entry, len(tried)), shown, self.size)
            best = int(np.nanargmin(off))
            around = tried[max(best - 1, 0)], tried[min(best + 1, len(tried) - 1)]
            nearest = float(tried[best]), float(off[best])
            tried = np.linspace(*around, FOOT_POSITIONS)
        return nearest

    def _unreached(self, inputs: Sequence[Array], *sentences: str) -> Judgement:
        return Judgement(tuple(np.full(len(each), np.nan) for each in inputs), tuple(inputs), sentences)

    def _branch_defects(
        self, mechanism: Mechanism, motion: Motion, is_whole: bool, inputs: Sequence[Array]
    ) -> Iterator[str]:
        if is_whole:
            return
        running = mechanism.inputs[0].pair
        given = motion.inputs[running].position
        low, high = float(given.min()), float(given.max())
        margin = ON_END * max(high - low, 1e-3)
        for wanted, own in zip(self.task.wanted, inputs, strict=True):
            beyond: BoolArray = np.asarray((own < low - margin) | (own > high + margin))
            if beyond.any():
                entry = int(np.argmax(beyond))
                ends = " to ".join(amount(each, _input_kind(mechanism), mechanism.units) for each in (low, high))
                yield (
                    f"branch defect: entry {entry + 1} of {wanted.of} lies beyond a dead point; the branch of the "
                    f"first goes from {running} = {ends}"
                )

    def _order_defects(self, mechanism: Mechanism, inputs: Sequence[Array], is_whole: bool) -> Iterator[str]:
        for wanted, own in zip(self.task.wanted, inputs, strict=True):
            if isinstance(wanted, WantedFunction) or not wanted.in_order or len(own) < 3:
                continue
            if is_whole:
                steps = np.mod(np.diff(own), TURN)
                rounds = float(steps.sum()) / TURN, float((TURN - steps).sum()) / TURN
                is_ordered = min(rounds) < 1.0 + 1e-9
            else:
                steps = np.diff(own)
                is_ordered = bool((steps > -1e-9).all() or (steps < 1e-9).all())
            if not is_ordered:
                yield f"order defect: {wanted.of} does not meet its entries in their order"

    def _tolerance_defects(self, misses: Sequence[Array]) -> Iterator[str]:
        for wanted, own in zip(self.task.wanted, misses, strict=True):
            if wanted.tolerance is not None and float(own.max(initial=0.0)) > wanted.tolerance:
                kind = "angle" if isinstance(wanted, WantedFunction) else "length"
                entry, units = int(np.argmax(own)), self.task.units
                off, most = (amount(each, kind, units) for each in (float(own[entry]), wanted.tolerance))
                yield f"entry {entry + 1} of {wanted.of} is missed by {off}, more than the tolerance of {most}"

    def _motion_defects(
        self, mechanism: Mechanism, motion: Motion, inputs: Sequence[Array], is_whole: bool
    ) -> Iterator[str]:
        demands = self.task.demands
        if demands.transmission is None and demands.inside is None:
            return
        running = mechanism.inputs[0].pair
        if not is_whole:
            every = np.concatenate(inputs)
            try:
                motion = cycle(mechanism, STEPS, float(every.min()), float(every.max()), running)
            except (NoAnswer, BadInput) as problem:
                yield f"it does not run through what is wanted: {problem}"
                return
        if demands.transmission is not None:
            yield from _transmission_defects(motion, demands.transmission)
        if demands.inside is not None:
            yield from _region_defects(motion, demands.inside)


def _transmission_defects(motion: Motion, least: float) -> Iterator[str]:
    mechanism = motion.mechanism
    outputs = [
        pair.name
        for pair in mechanism.pairs
        if mechanism.frame in pair.links and pair.name not in {each.pair for each in mechanism.inputs}
    ]
    for name in outputs:
        try:
            found = transmission(motion, name)
        except PlanarError:
            continue  # nothing is transmitted to it by one force
        if found.least is not None and found.least.value < least:
            at = amount(found.least.input, _input_kind(mechanism), mechanism.units)
            angle, wanted = (amount(each, "angle", mechanism.units) for each in (found.least.value, least))
            where = f"{mechanism.inputs[0].pair} = {at}"
            yield f"the transmission angle at {name} falls to {angle} at {where}, below {wanted}"


def _region_defects(motion: Motion, corners: Array) -> Iterator[str]:
    for name in motion.point_names:
        places = np.atleast_2d(motion.point(name).position)
        outside = ~_are_inside(places, corners)
        if outside.any():
            at = places[int(np.argmax(outside))]
            x, y = (amount(float(each), "length", motion.mechanism.units) for each in at)
            yield f"{name} leaves the region at x = {x}, y = {y}"


def _are_inside(places: Array, corners: Array) -> BoolArray:
    """Which places (n, 2) lie in a polygon, its border included by a hair."""
    first, second = corners, np.roll(corners, -1, axis=0)
    x, y = places[:, 0, None], places[:, 1, None]
    crosses = (first[:, 1] > y) != (second[:, 1] > y)
    rise = np.where(crosses, second[:, 1] - first[:, 1], 1.0)
    right = first[:, 0] + (y - first[:, 1]) / rise * (second[:, 0] - first[:, 0])
    inside: BoolArray = np.asarray(np.sum(crosses & (x < right), axis=1) % 2 == 1)
    along = second - first
    share = np.clip(np.sum((places[:, None] - first) * along, axis=2) / np.sum(along**2, axis=1), 0.0, 1.0)
    off = np.linalg.norm(places[:, None] - first - share[..., None] * along, axis=2).min(axis=1)
    found: BoolArray = inside | np.asarray(off < 1e-9 * float(np.ptp(corners, axis=0).max()))
    return found


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


def _difference(own: Array, other: Array, wanted: Wanted) -> Array:
    """Of results (n, parts), angles by less than half a turn."""
    apart: Array = own - other
    if isinstance(wanted, WantedPath):
        return apart
    turned = apart[:, -1] - TURN * np.round(apart[:, -1] / TURN)
    told: Array = np.concatenate([apart[:, :-1], turned[:, None]], axis=1)
    return told


def _misses(wanted: Wanted, shown: Array, size: float) -> Array:
    """How far each entry is missed (n,): m, of functions rad or m; of a pose the angle counts by the size."""
    if isinstance(wanted, WantedPath):
        found: Array = np.linalg.norm(shown - wanted.places, axis=1)
        return found
    if isinstance(wanted, WantedFunction):
        off = _difference(shown, wanted.values[:, None], wanted)[:, 0]
        return np.abs(off if wanted.is_absolute else off - off.mean())
    target = np.concatenate([wanted.places, wanted.angles[:, None]], axis=1)
    apart = _difference(shown, target, wanted) * np.array([1.0, 1.0, size])
    missed: Array = np.linalg.norm(apart, axis=1)
    return missed


def _at_entry(wanted: Wanted, entry: int, many: int) -> Wanted:
    """A path or poses, so many times this entry."""
    assert not isinstance(wanted, WantedFunction)
    places = np.broadcast_to(wanted.places[entry], (many, 2))
    if isinstance(wanted, WantedPath):
        return wanted._replace(places=places)
    return wanted._replace(places=places, angles=np.broadcast_to(wanted.angles[entry], (many,)))


def _by_whole_turns(inputs: Array, given: Array) -> Array:
    """Angles of an input, each by whole turns where it is nearest to the middle of the range that runs."""
    middle = 0.5 * float(given.min() + given.max())
    found: Array = inputs - TURN * np.round((inputs - middle) / TURN)
    return found


def _brought_into(inputs: Array, given: Array, is_whole: bool) -> Array:
    """Positions of an input by whole turns in the range that runs."""
    low, high = float(given.min()), float(given.max())
    if not is_whole:
        return np.clip(inputs, low, high)
    found: Array = low + np.mod(inputs - low, TURN)
    return np.minimum(found, high)


def _turns(mechanism: Mechanism) -> bool:
    return relative_motions(mechanism)[mechanism.inputs[0].pair].input_kind is not MeasureKind.LENGTH


def _input_kind(mechanism: Mechanism) -> str:
    return "angle" if _turns(mechanism) else "length"
