"""Where entries are met that a design does not meet on the branch of its sketch: the branch, the circuit, in words."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import join_names
from planar.foundation.jets import TURN
from planar.synthesis.judgement.defects import ONE_BRANCH, ONE_CIRCUIT, REACH, Defect
from planar.synthesis.judgement.design_assemblies import DesignAssemblies
from planar.synthesis.judgement.input_range import InputRange
from planar.synthesis.judgement.misses import result_differences
from planar.synthesis.task.synthesis_task import Wanted


class EntryPlace(NamedTuple):
    """Where an entry is met.

    `entry` counts from 0, `position` (rad or m) is that of the input; `kind` says on what it lies: the "branch" of the
    sketch, its "circuit", a branch that is "crossed" at a change point, "another" circuit, a circuit that is "unknown",
    or "nowhere" where no assembly meets it. `dead_points` (rad or m) lie between it and the branch of the sketch.
    """

    entry: int
    position: float
    kind: str
    dead_points: tuple[float, ...] = ()


class EntryLocator(NamedTuple):
    """Finds the assemblies of a design that show given results to within a distance (m or rad); `size` (m) is the
    extent of what is wanted. `is_proof`: what lies on no branch of the circuit is looked for in all assemblies."""

    design: DesignAssemblies
    size: float
    within: float
    is_proof: bool

    def locate(self, wanted: Wanted, entry: int, position: float, result: Array) -> EntryPlace:
        """Where an entry is met, with the input at a position (rad or m) and a result (parts,) of a wanted item."""
        design = self.design
        branches, z = design.along_circuit(position)
        on = [branches[k] for k in self._rows(wanted, z, position, result)]
        if design.home_branch in on:
            return EntryPlace(entry, position, "branch")
        if on:
            return EntryPlace(entry, position, "circuit", tuple(design.dead_points_before(on[0], position)))
        is_crossing = design.circuit is not None and design.circuit.has_change_point
        if self.is_proof or is_crossing:
            z = design.at(position)
            rows = self._rows(wanted, z, position, result)
            if self.is_proof and not rows:
                return EntryPlace(entry, position, "nowhere")
            if is_crossing and any(design.has_change_point(z[row], position) for row in rows):
                return EntryPlace(entry, position, "crossed")
        is_followed = design.circuit is not None and not design.circuit.lost_reason
        return EntryPlace(entry, position, "another" if is_followed else "unknown")

    def _rows(self, wanted: Wanted, z: Array, position: float, result: Array) -> list[int]:
        """The assemblies (rows of z) that show the result."""
        if not len(z):
            return []
        shown = self.design.results(wanted, z, np.full(len(z), position))
        off = result_differences(wanted, shown, result, self.size, self.design.measures_angle(wanted))
        rows: list[int] = np.flatnonzero(off <= self.within).tolist()
        return rows


class PlaceWords(NamedTuple):
    """How positions and misses are written: the range of the input, the entry whose branch is the sketch's, misses."""

    reach: InputRange
    branch: str
    input_text: Callable[[float], str]
    miss_text: Callable[[Wanted, float], str]

    def defects(self, wanted: Wanted, places: Sequence[EntryPlace], misses: Array) -> Iterator[Defect]:
        """Of the entries of an item that are not met on the branch of the sketch, and are missed by (n,) there."""
        groups: dict[tuple[str, tuple[float, ...]], list[EntryPlace]] = {}
        for each in places:
            key = tuple(round(at, 9) for at in each.dead_points)
            groups.setdefault((each.kind, key), []).append(each)
        for (kind, _), group in groups.items():
            if kind == "branch":
                continue
            rest = self._branch_sentence(wanted, group, misses)
            entries = _entries_text(group)
            if kind == "nowhere":
                yield Defect(REACH, f"no assembly of it meets {entries} of {wanted.of}; {rest}")
                continue
            at = join_names([self.input_text(self._brought(each.position)) for each in group], max_names=None)
            met = f"{wanted.of} meets {entries} at {self.reach.pair} = {at}, {self._where(kind, group[0])}; {rest}"
            is_branch = kind in ("circuit", "crossed")
            yield Defect(
                ONE_BRANCH if is_branch else ONE_CIRCUIT, f"{'branch' if is_branch else 'circuit'} defect: {met}"
            )

    def _where(self, kind: str, place: EntryPlace) -> str:
        if kind == "circuit":
            at = join_names([self.input_text(self._brought(each)) for each in place.dead_points], max_names=None)
            points = "dead points" if len(place.dead_points) > 1 else "dead point"
            return f"on the same circuit beyond the {points} at {self.reach.pair} = {at}"
        return {
            "crossed": "on a branch that crosses this one at a change point",
            "another": "on another circuit",
            "unknown": "in another assembly, whose circuit could not be followed",
        }[kind]

    def _branch_sentence(self, wanted: Wanted, group: Sequence[EntryPlace], misses: Array) -> str:
        """What is missed on the branch of the sketch, or that it does not reach so far."""
        own = misses[[each.entry for each in group]]
        if not np.isfinite(own).all():
            low, high = (self.input_text(each) for each in (self.reach.low, self.reach.high))
            return f"{self.branch} goes from {self.reach.pair} = {low} to {high}"
        miss = self.miss_text(wanted, float(own.max()))
        return f"on {self.branch} the miss is {miss}{' at most' if len(group) > 1 else ''}"

    def _brought(self, position: float) -> float:
        """An angle by whole turns next to the range of the input."""
        if not self.reach.turns or self.reach.counts_turns:
            return position
        middle = 0.5 * (self.reach.low + self.reach.high)
        return position - TURN * round((position - middle) / TURN)


def _entries_text(places: Sequence[EntryPlace]) -> str:
    names = [str(each.entry + 1) for each in places]
    return f"{'entries' if len(names) > 1 else 'entry'} {join_names(names, max_names=None)}"
