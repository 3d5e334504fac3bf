"""The order in which entries are met, as slacks of a fit: how far the input goes on from each to the next."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.foundation.jets import TURN
from planar.synthesis.fitting.wanted_equations import WantedEquations
from planar.synthesis.task.synthesis_task import WantedFunction

LEAST_ORDERED = 3
"""Entries that have an order; two come one after the other, either way."""


class OrderSlacks:
    """Slacks of designs whose entries of some items are met in their order, either way; in one turn, if they turn.

    The sense of each design, and over which entries a new turn begins, is as it is at first. With no `is_kept` there
    are none.
    """

    def __init__(self, equations: Sequence[WantedEquations], unknowns: Sequence[Array], over_turn: bool, is_kept: bool):
        self.turns: list[Array] = []
        "of each ordered item what is added to the differences of inputs (designs, entries - 1)"
        self.senses: list[Array] = []
        self.over_turn = over_turn
        self.slices: list[slice] = []
        "of each ordered item among all entries"
        at = 0
        for each, y in zip(equations, unknowns, strict=True):
            wanted, many = each.rows.wanted, y.shape[1]
            if is_kept and not isinstance(wanted, WantedFunction) and wanted.in_order and many >= LEAST_ORDERED:
                self.slices.append(slice(at, at + many))
                self._add_item(np.diff(y[..., -1], axis=1))
            at += many

    def _add_item(self, steps: Array) -> None:
        if self.over_turn:
            onward, back = np.mod(steps, TURN), np.mod(-steps, TURN)
            sense = np.where(onward.sum(axis=1) <= back.sum(axis=1), 1.0, -1.0)
            gone = np.where(sense[:, None] > 0.0, onward, back)
            gone = np.where(gone > 0.75 * TURN, gone - TURN, gone)  # a little back, not nearly round
            self.turns.append(gone - sense[:, None] * steps)
        else:
            sense = np.where(steps.sum(axis=1) >= 0.0, 1.0, -1.0)
            self.turns.append(np.zeros_like(steps))
        self.senses.append(sense)

    def take(self, rows: IntArray) -> None:
        """Only these designs go on."""
        self.turns = [each[rows] for each in self.turns]
        self.senses = [each[rows] for each in self.senses]

    @property
    def count(self) -> int:
        """How many slacks a design has."""
        return sum(each.shape[1] + int(self.over_turn) for each in self.turns)

    def slacks(self, inputs: Array, rows: IntArray) -> Array:
        """How far the inputs (designs, entries) of designs go on from each entry to the next, and what is left of a
        turn after the last."""
        found = [np.zeros((len(rows), 0))]
        for own, sense, turns in zip(self.slices, self.senses, self.turns, strict=True):
            gone = sense[rows, None] * np.diff(inputs[:, own], axis=1) + turns[rows]
            found.append(gone)
            if self.over_turn:
                found.append(TURN - gone.sum(axis=1, keepdims=True))
        return np.concatenate(found, axis=1)

    def slopes(self, changes: Array, rows: IntArray) -> Array:
        """How slacks change (designs, slacks, ...) where inputs change by (designs, entries, ...)."""
        found = [np.zeros((len(rows), 0, *changes.shape[2:]))]
        for own, sense in zip(self.slices, self.senses, strict=True):
            gone = sense[rows].reshape(-1, *[1] * (changes.ndim - 1)) * np.diff(changes[:, own], axis=1)
            found.append(gone)
            if self.over_turn:
                found.append(-gone.sum(axis=1, keepdims=True))
        return np.concatenate(found, axis=1)
