"""Designs of one start that do what a task wants best: from a catalogue's matches, fitted by least squares."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.derivatives.design_equations import design_equations
from planar.document.revised.similar_mechanism import similar_mechanism
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.synthesis.catalogue.catalogue import Catalogue
from planar.synthesis.catalogue.catalogue_store import kept_catalogue
from planar.synthesis.catalogue.matches import Match, find_matches
from planar.synthesis.catalogue.moved_numbers import moved_numbers
from planar.synthesis.catalogue.step_choices import WantedItem
from planar.synthesis.fitting.design_fit import DesignFit, FittedDesigns
from planar.synthesis.fitting.wanted_equations import WantedEquations, tangents
from planar.synthesis.fitting.wanted_rows import wanted_rows, wanted_size
from planar.synthesis.task.freedom import can_move_whole
from planar.synthesis.task.starts import FreeNumbers, free_numbers
from planar.synthesis.task.synthesis_task import SynthesisTask, WantedPath

GUARD_POSITIONS = 24
"""Round a turn, at which a design that is to turn fully must go together all the time."""


class Candidate(NamedTuple):
    """A fitted design: its free numbers by name (SI), and the unknowns at each entry of what is wanted."""

    mechanism: Mechanism
    numbers: dict[str, float]
    unknowns: tuple[Array, ...]
    "of each wanted item (n, unknowns)"
    squares: float


class DesignSearch:
    """The search over one start."""

    def __init__(self, task: SynthesisTask, mechanism: Mechanism):
        self.task, self.start = task, mechanism
        own = design_equations(mechanism).solver.unit
        self.size = wanted_size(task, own)
        self.can_move = can_move_whole(task, mechanism, free_numbers(task, mechanism))
        if self.can_move:  # its scale is that of what is wanted, however large its file is
            mechanism = similar_mechanism(mechanism, self.size / own)
            own = design_equations(mechanism).solver.unit
        self.mechanism = mechanism
        self.free: FreeNumbers = free_numbers(task, mechanism)
        rows = wanted_rows(task, self.size)
        self.equations = tuple(WantedEquations(mechanism, each, self.free.names, own) for each in rows)
        self.ratio = own / self.size
        "of the scale of numbers to that of places"
        self.moves = moved_numbers(self.equations[0], self.free)
        closed = any(isinstance(each, WantedPath) and each.is_closed for each in task.wanted)
        self.needs_whole_turn = task.demands.whole_turn or closed
        guard = rows[0]._replace(inputs=np.zeros(GUARD_POSITIONS))
        self.guard = WantedEquations(mechanism, guard, self.free.names, own) if self.needs_whole_turn else None

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
        return find_matches(catalogue, items, self.can_move, many, self.needs_whole_turn)

    def fit(self, catalogue: Catalogue, matches: list[Match], keep: int) -> list[Candidate]:
        """The matches fitted, the best so many."""
        if not matches:
            return []
        guarded: list[Array] = []
        numbers, unknowns = [], [[] for _ in self.equations]  # type: ignore[var-annotated]
        for match in matches:
            x = catalogue.numbers[match.design]
            ys = [catalogue.unknowns[match.design][steps] for steps in match.steps]
            for k, y in enumerate(ys):
                # places of the catalogue are in units of what is wanted, numbers in those of the mechanism
                moved, own = self.moves.move(x, y, match.factor, match.offset / self.ratio)
                unknowns[k].append(own)
            numbers.append(moved if self.can_move else x)
            if self.guard is not None:
                guarded.append(self._turn(catalogue, match))
        x, ys = np.array(numbers), [np.array(each) for each in unknowns]
        zeros = self._zeros(x, ys)
        scale = self.equations[0].scale
        fit = DesignFit(self.equations, self.free.lower / scale, self.free.upper / scale, self.guard)
        found: FittedDesigns = fit.fit(x, ys, zeros, keep, np.array(guarded) if guarded else None)
        return [self._candidate(found, k) for k in range(len(found.squares)) if np.isfinite(found.squares[k])]

    def _turn(self, catalogue: Catalogue, match: Match) -> Array:
        """The unknowns of a match at positions all round its turn."""
        own = catalogue.unknowns[match.design]
        own = own[np.isfinite(own).all(axis=1)]
        own = own[np.linspace(0, len(own) - 1, GUARD_POSITIONS, endpoint=False).astype(int)]
        return self.moves.move(catalogue.numbers[match.design], own, match.factor, match.offset / self.ratio)[1]

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

    def _zeros(self, x: Array, unknowns: list[Array]) -> list[Array]:
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

    def _candidate(self, found: FittedDesigns, k: int) -> Candidate:
        numbers = found.numbers[k] * self.equations[0].scale
        return Candidate(
            self.mechanism,
            dict(zip(self.free.names, map(float, numbers), strict=True)),
            tuple(each[k] for each in found.unknowns),
            float(found.squares[k]),
        )
