"""Designs of one start that do what a task wants best: from a catalogue's matches, fitted by least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.derivatives.design_equations import design_equations
from planar.document.revised.similar_mechanism import similar_mechanism
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.synthesis.catalogue.branch_tracking import follow_branches
from planar.synthesis.catalogue.catalogue import Catalogue
from planar.synthesis.catalogue.catalogue_store import kept_catalogue
from planar.synthesis.catalogue.matches import Match, find_matches
from planar.synthesis.catalogue.moved_numbers import moved_numbers
from planar.synthesis.catalogue.step_choices import WantedItem
from planar.synthesis.fitting.demand_guard import DemandGuard
from planar.synthesis.fitting.demanded_rows import demand_guards
from planar.synthesis.fitting.design_fit import DesignFit, FittedDesigns
from planar.synthesis.fitting.kept_demands import lacks
from planar.synthesis.fitting.wanted_equations import WantedEquations, tangents
from planar.synthesis.fitting.wanted_rows import wanted_rows, wanted_size
from planar.synthesis.task.freedom import can_move_whole
from planar.synthesis.task.starts import FreeNumbers, free_numbers
from planar.synthesis.task.synthesis_task import SynthesisTask


class Candidate(NamedTuple):
    """A fitted design: its free numbers by name (SI), and the unknowns at each entry of what is wanted."""

    mechanism: Mechanism
    numbers: dict[str, float]
    unknowns: tuple[Array, ...]
    "of each wanted item (n, unknowns)"
    squares: float
    lack: float
    "by how much a demand is missed, rad or of the extent of what is wanted"
    match: Match
    "from which it was fitted"


DEMANDING, LACK_WEIGHT = 6, 0.3
"""Where something is demanded of the motion, so many times as many matches as are fitted are looked at, and what they
lack (rad, or of the extent of what is wanted) counts so much beside their distance."""


class _FitStart(NamedTuple):
    """From where a design is fitted: its numbers, the unknowns at entries, and at positions that are guarded."""

    numbers: Array
    unknowns: list[Array]
    guarded: Array
    over_turn: bool
    match: Match


class DesignSearch:
    """The search over one start."""

    def __init__(self, task: SynthesisTask, mechanism: Mechanism):
        self.task, self.start = task, mechanism
        own = design_equations(mechanism).solver.unit
        self.size = wanted_size(task, own)
        self.can_move = can_move_whole(task, mechanism, free_numbers(task, mechanism))
        if self.can_move and not task.within:  # its scale is that of what is wanted, however large its file is
            mechanism = similar_mechanism(mechanism, self.size / own)
            own = design_equations(mechanism).solver.unit
        self.mechanism = mechanism
        self.free: FreeNumbers = free_numbers(task, mechanism)
        rows = wanted_rows(task, self.size)
        self.equations = tuple(WantedEquations(mechanism, each, self.free.names, own) for each in rows)
        self.ratio = own / self.size
        "of the scale of numbers to that of places"
        self.moves = moved_numbers(self.equations[0], self.free)
        self.guards = demand_guards(task, self.equations[0], rows[0], self.free, self.size)

    def catalogue(self, count: int, seed: int) -> Catalogue:
        """Random designs of this start with their motion, from disk where they were kept."""
        return kept_catalogue(self.start, self.equations, self.free, count, seed)

    def matches(self, catalogue: Catalogue, many: int) -> list[Match]:
        """The designs of the catalogue nearest to what is wanted."""
        items = [
            WantedItem(
                each.rows.wanted,
                each.target,
                None if each.rows.inputs is None else each.rows.inputs / each.input_scale,
                each.rows.input_is_free,
            )
            for each in self.equations
        ]
        factors = self._factors(catalogue) if self.can_move else None
        if self.guards is None or not self.guards[True].kept_by(False, False).rows:
            return find_matches(catalogue, items, factors, many, self.task.needs_whole_turn)
        found = find_matches(catalogue, items, factors, DEMANDING * many, self.task.needs_whole_turn)
        scores = np.hypot([each.distance for each in found], LACK_WEIGHT * self._lacks(catalogue, found))
        return [found[k] for k in np.argsort(scores, kind="stable")[:many]]

    def _lacks(self, catalogue: Catalogue, matches: list[Match]) -> Array:
        """By how much matches miss what is demanded of their motion (matches,)."""
        assert self.guards is not None
        starts, found = self._fit_starts(catalogue, matches), np.zeros(len(matches))
        for over_turn, guard in self.guards.items():
            rows = [k for k, each in enumerate(starts) if each.over_turn is over_turn]
            if rows:
                x, y = (np.array([getattr(starts[k], name) for k in rows]) for name in ("numbers", "guarded"))
                found[rows] = lacks(guard.slacks(x, y))
        return found

    def _factors(self, catalogue: Catalogue) -> Array | None:
        """By how much the designs of a catalogue may grow."""
        scale = self.equations[0].scale
        return self.moves.factors(catalogue.numbers, self.free.lower / scale, self.free.upper / scale)

    def fit(
        self, catalogue: Catalogue, matches: list[Match], keep: int, keeps_turn: bool = False, keeps_order: bool = False
    ) -> list[Candidate]:
        """The matches fitted, the best so many; of those that turn fully, and of others, where demands are kept.

        With `keeps_turn` designs turn fully all the way, with `keeps_order` entries are met in their order, where that
        is wanted; both may end in a worse optimum. What comes to turn fully is fitted once more, since its demands are
        kept all round the turn then."""
        guards = self.guards
        if guards is not None:
            guards = {key: each.kept_by(keeps_turn, keeps_order) for key, each in guards.items()}
        groups = self._fit_starts(catalogue, matches)
        found: list[Candidate] = []
        for over_turn in (False, True):
            own = [each for each in groups if each.over_turn is over_turn]
            if not own:
                continue
            fitted = self._fit_alike(own, keep, None if guards is None else guards[over_turn])
            turned: dict[int, _FitStart] = {}
            if not over_turn and guards is not None and guards[True].rows:
                turned = self._turned(fitted, own)
            groups += turned.values()
            known = np.flatnonzero(np.isfinite(fitted.squares)).tolist()
            found += [self._candidate(fitted, k, own[fitted.order[k]].match) for k in known if k not in turned]
        return sorted(found, key=lambda each: (each.lack > 0.0, each.squares))[:keep]

    def _fit_starts(self, catalogue: Catalogue, matches: list[Match]) -> list[_FitStart]:
        """Matches as they lie, with the positions at which each is guarded."""
        found = []
        for match in matches:
            x, own = catalogue.numbers[match.design], catalogue.unknowns[match.design]
            # places of the catalogue are in units of what is wanted, numbers in those of the mechanism
            moved, y = self.moves.move(x, own, match.factor, match.offset / self.ratio)
            ys = [y[steps] for steps in match.steps]
            over_turn = self.guards is not None and bool(catalogue.is_whole[match.design])
            branch = y[np.isfinite(y).all(axis=1)]
            found.append(_FitStart(moved, ys, self._guarded(branch, ys, over_turn), over_turn, match))
        return found

    def _guarded(self, branch: Array, unknowns: list[Array], over_turn: bool) -> Array:
        """The unknowns at positions of a branch (steps, unknowns) all round its turn, or between entries."""
        many = 0 if self.guards is None else self.guards[over_turn].position_count
        return spread_positions(branch, np.concatenate([each[:, -1] for each in unknowns]), many, over_turn)

    def _fit_alike(self, starts: list[_FitStart], keep: int, guard: DemandGuard | None) -> FittedDesigns:
        """Designs fitted that all turn fully, or are all seen between their entries only."""
        x = np.array([each.numbers for each in starts])
        ys = [np.array(each) for each in zip(*(each.unknowns for each in starts), strict=True)]
        zeros = self.first_zeros(x, ys)
        scale = self.equations[0].scale
        fit = DesignFit(self.equations, self.free.lower / scale, self.free.upper / scale, guard)
        positions = np.array([each.guarded for each in starts])
        shares = np.broadcast_to(np.linspace(0.0, 1.0, positions.shape[1]), positions.shape[:2])
        return fit.fit(x, ys, zeros, keep, (positions, shares) if guard is not None else None)

    def _turned(self, found: FittedDesigns, starts: list[_FitStart]) -> dict[int, _FitStart]:
        """Those of fitted designs that turn fully, by their number."""
        if not len(found.numbers):
            return {}
        branches, is_whole = follow_branches(self.equations[0], found.numbers, found.unknowns[0][:, 0])
        told = {}
        for k in np.flatnonzero(is_whole & np.isfinite(found.squares)).tolist():
            branch, ys = branches[k][np.isfinite(branches[k]).all(axis=1)], [each[k] for each in found.unknowns]
            match = starts[found.order[k]].match
            told[k] = _FitStart(found.numbers[k], ys, self._guarded(branch, ys, True), True, match)
        return told

    def most_regular(self, candidate: Candidate) -> Array:
        """The unknowns of that entry which is farthest from a dead point: there the assemblies lie apart."""
        every = np.concatenate(candidate.unknowns)
        each = self.equations[0]
        x = np.array([candidate.numbers[name] for name in self.free.names]) / each.scale
        jacobian = each.jacobians(x[None], every[None])[0]
        best = int(np.argmax(np.abs(tangents(jacobian)[:, -1]))) if jacobian.shape[1] else 0
        found: Array = np.asarray(every[best])
        return found

    def shown(self, k: int, candidate: Candidate) -> Array:
        """The results (n, parts) of a wanted item that a candidate has at its entries, SI."""
        each = self.equations[k]
        x = np.array([candidate.numbers[name] for name in self.free.names]) / each.scale
        values: Array = each.values(x[None], candidate.unknowns[k][None])[0] * each.rows.scales
        return values

    def first_zeros(self, x: Array, unknowns: list[Array]) -> list[Array]:
        """The zeros of scales that fit best at first; given inputs are brought to where they are wanted."""
        found: list[Array] = []
        for k, each in enumerate(self.equations):
            zeros = np.zeros((len(x), each.zero_count))
            if each.rows.inputs is not None:
                wanted = np.broadcast_to(each.rows.inputs / each.input_scale, unknowns[k].shape[:2])
                if each.rows.input_is_free:
                    wanted = wanted + np.mean(unknowns[k][..., -1] - wanted, axis=1, keepdims=True)
                unknowns[k] = np.concatenate([unknowns[k][..., :-1], wanted[..., None]], axis=-1)
            if each.rows.value_is_free:
                off = each.values(x, unknowns[k])[..., 0] - each.target[:, 0]
                zeros[:, -1] = np.mean(off, axis=1)
            found.append(zeros)
        return found

    def _candidate(self, found: FittedDesigns, k: int, match: Match) -> Candidate:
        numbers = found.numbers[k] * self.equations[0].scale
        return Candidate(
            self.mechanism,
            dict(zip(self.free.names, map(float, numbers), strict=True)),
            tuple(each[k] for each in found.unknowns),
            float(found.squares[k]),
            float(found.lacks[k]),
            match,
        )


def spread_positions(branch: Array, inputs: Array, count: int, over_turn: bool) -> Array:
    """The unknowns (count, unknowns) at positions of a branch (steps, unknowns): all round its turn, or spread evenly
    from the least to the greatest of some inputs (n,)."""
    if over_turn:
        turned: Array = branch[np.linspace(0, len(branch) - 1, count).astype(int)]
        return turned
    spread = np.linspace(inputs.min(), inputs.max(), count)
    positions: Array = np.stack([np.interp(spread, branch[:, -1], part) for part in branch.T], axis=1)
    return positions
