"""Which exact members keep what a task demands, seen by batches of cheap tests before any is judged.

Two entries on one branch have Jacobians whose determinants have one sign. Members that pass are run through their
branch, on which all entries must lie, in their order; what is demanded of the motion is evaluated at positions of it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.foundation.jets import TURN
from planar.model.mechanism import links_counting_turns
from planar.model.pairs import MeasureKind
from planar.synthesis.catalogue.branch_tracking import follow_branches
from planar.synthesis.design_search import DesignSearch, spread_positions
from planar.synthesis.families.exact_members import ExactMembers
from planar.synthesis.fitting.demanded_rows import output_rows
from planar.synthesis.judgement.input_range import InputRange

MAX_FOLLOWED = 1200
"""Members that are run through their branch at once."""
ON_BRANCH = 0.05
"""rad, or of the size: an entry that is nearer to the chords of its branch is on it."""
NEAR_END = 0.5
"""The same beside the end of a branch, which is followed until the dead point is near."""
POSITIONS = 25
"""Of the motion, at which demands are evaluated."""
OTHER_BRANCH, NOT_FOLLOWED, ENTRY_LACK, OFF_BRANCH, NO_WHOLE_TURN, NO_ORDER = 20.0, 15.0, 12.0, 10.0, 6.0, 4.0
"""Violations, to which is added how far a member is from keeping the demand: any of the first is the worst."""


class Screening(NamedTuple):
    """Of each member (n,) how far it is from what is demanded, 0 where nothing is missing, and its least transmission
    angle (rad); infinite where there is none or it is not known."""

    violation: Array
    transmission: Array


class MemberScreen:
    """Screens the members of one search."""

    def __init__(self, search: DesignSearch):
        self.search, self.equations = search, search.equations
        first = self.equations[0]
        self.outputs = output_rows(first, search.free)
        design = first.design
        kinds = [design.equations.coordinates[k].kind for k in design.equations.unknowns]
        self.input_turns = design.equations.input_kinds[0] is not MeasureKind.LENGTH
        self.counts_turns = bool(links_counting_turns(search.mechanism))
        is_angle = [kind is not MeasureKind.LENGTH for kind in kinds]
        self.is_angle = np.array([*is_angle, self.input_turns and not self.counts_turns], bool)
        "of the unknowns and the input, those that are the same a turn apart"

    def screen(self, members: ExactMembers) -> Screening:
        """What members lack."""
        violation = self._determinant_signs(members)
        transmission = np.full(len(violation), np.inf)
        same = np.flatnonzero(violation == 0.0)
        lacks = self._entry_lacks(members.take(same))
        violation[same] = np.where(lacks > 0.0, ENTRY_LACK + np.tanh(lacks), NOT_FOLLOWED)
        rows = same[lacks == 0.0][:MAX_FOLLOWED]
        if len(rows):
            violation[rows], transmission[rows] = self._follow(members.take(rows))
        return Screening(violation, transmission)

    def _determinant_signs(self, members: ExactMembers) -> Array:
        """By how much determinants (n,) differ from those of one sign; 0 where all entries have the same."""
        determinants = []
        for equations, y in zip(self.equations, members.unknowns, strict=True):
            jacobian = equations.jacobians(members.numbers, y)[..., :-1]
            lengths = np.linalg.norm(jacobian, axis=-1).prod(axis=-1)
            determinants.append(np.linalg.det(jacobian) / np.maximum(lengths, np.finfo(float).tiny))
        values = np.concatenate(determinants, axis=1)
        wrong = np.minimum(np.maximum(values, 0.0).sum(axis=1), np.maximum(-values, 0.0).sum(axis=1))
        return np.where(
            wrong > 0.0, OTHER_BRANCH + wrong / np.maximum(np.abs(values).sum(axis=1), np.finfo(float).tiny), 0.0
        )

    def _entry_lacks(self, members: ExactMembers) -> Array:
        """By how much (n,) the wanted entries themselves miss what is demanded of the whole motion."""
        lacks = np.zeros(len(members.numbers))
        for guard in (self.search.guards or {}).values():
            if guard.rows and not guard.turns_only:
                for y in members.unknowns:
                    lacks = np.maximum(lacks, -guard.slacks(members.numbers, y).min(axis=1, initial=0.0))
        return lacks

    def _follow(self, members: ExactMembers) -> tuple[Array, Array]:
        """Violations and least transmission angles (n,) of members whose determinants have one sign."""
        branches, is_whole = follow_branches(self.equations[0], members.numbers, members.unknowns[0][:, 0])
        count = len(branches)
        violation, positions = np.zeros(count), np.zeros((count, POSITIONS, branches.shape[2]))
        for k, branch in enumerate(branches):
            known = branch[np.isfinite(branch).all(axis=1)]
            entries = [y[k] for y in members.unknowns]
            violation[k], positions[k] = self._entries_on(known, entries, bool(is_whole[k]))
        return violation + self._demand_lacks(members.numbers, positions, is_whole), self._transmissions(
            members.numbers, positions
        )

    def _entries_on(self, branch: Array, entries: list[Array], is_whole: bool) -> tuple[float, Array]:
        """How far entries are from lying on a branch, in their order, and positions of the motion that they need."""
        scale = self.equations[0].input_scale
        inputs = branch[:, -1] * scale
        is_cyclic = is_whole and not self.counts_turns
        turns = self.input_turns, self.counts_turns
        reach = InputRange("", float(inputs.min()), float(inputs.max()), is_whole, is_cyclic, *turns)
        off, violation, brought = [], 0.0, []
        for y, wanted in zip(entries, self.search.task.wanted, strict=True):
            given = y[:, -1] * scale
            there = reach.bring(given)
            brought.append(there)
            distance = self._distances(branch, y)
            near_end = np.minimum(*(self._distances(branch[[k]], y) for k in (0, -1))) if not is_whole else np.inf
            is_on = (distance < ON_BRANCH) | (near_end < NEAR_END)
            off.append(np.where(is_on, 0.0, np.tanh(distance)))
            if getattr(wanted, "in_order", False) and not reach.is_in_order(there):
                violation = NO_ORDER + _disorder(np.diff(there), is_cyclic)
        if self.search.task.needs_whole_turn and not is_whole:
            violation += NO_WHOLE_TURN + 1.0 - (reach.high - reach.low) / TURN
        missing = float(np.concatenate(off).mean())
        violation += OFF_BRANCH + missing if missing else 0.0
        return violation, spread_positions(branch, np.concatenate(brought) / scale, POSITIONS, is_whole)

    def _distances(self, branch: Array, y: Array) -> Array:
        """How far entries (n, unknowns) are from the chords of a branch (steps, unknowns)."""
        chords = np.diff(branch, axis=0, append=branch[-1:])
        apart = y[:, None] - branch
        apart[..., self.is_angle] -= TURN * np.round(apart[..., self.is_angle] / TURN)
        lengths = np.maximum(np.sum(chords**2, axis=1), np.finfo(float).tiny)
        share = np.clip(np.sum(apart * chords, axis=2) / lengths, 0.0, 1.0)
        distances: Array = np.linalg.norm(apart - share[..., None] * chords, axis=2).min(axis=1)
        return distances

    def _demand_lacks(self, numbers: Array, positions: Array, is_whole: BoolArray) -> Array:
        """By how much (n,) demands of the motion are missed most, rad or of the size."""
        lacks = np.zeros(len(numbers))
        if self.search.guards is None:
            return lacks
        for over_turn, guard in self.search.guards.items():
            rows = np.flatnonzero(is_whole == over_turn)
            if len(rows) and guard.rows and not guard.turns_only:
                slacks = guard.slacks(numbers[rows], positions[rows])
                lacks[rows] = np.maximum(-slacks.min(axis=1, initial=0.0), 0.0)
        return lacks

    def _transmissions(self, numbers: Array, positions: Array) -> Array:
        """The least transmission angle (n,) at positions of the motion."""
        if not len(self.outputs):
            return np.full(len(numbers), np.inf)
        values = self.outputs.values(np.repeat(numbers, POSITIONS, axis=0), positions.reshape(-1, positions.shape[2]))
        least: Array = np.nan_to_num(values, nan=0.0).reshape(len(numbers), -1).min(axis=1)
        return least


def _disorder(steps: Array, is_cyclic: bool) -> float:
    """By how much steps of the input (n,) go back, as a part of all; of a cyclic one how many turns they take more."""
    if is_cyclic:
        return min(float(np.mod(steps, TURN).sum()), float(np.mod(-steps, TURN).sum())) / TURN - 1.0
    back = min(float(np.maximum(steps, 0.0).sum()), float(np.maximum(-steps, 0.0).sum()))
    return back / max(float(np.abs(steps).sum()), np.finfo(float).tiny)
