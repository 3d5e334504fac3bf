"""The balance of virtual work at many positions, in the coordinates of the links alone."""

from __future__ import annotations

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import (
    KinematicArrays,
    LinkAction,
    action_on_link,
    effort_actions,
    inertia_actions,
    passive_actions,
)
from planar.dynamics.link_coordinates import LinkCoordinates
from planar.equations.elements import Element, ElementGroup, ElementPlacement, PlacedElement, group_elements
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.residuals import wrapped_residual
from planar.equations.sparse_matrices import SparseMatrices, SparsePattern
from planar.foundation.arrays import Array, IntArray
from planar.foundation.jets import Scalar
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair


class VirtualWorkBalance(NamedTuple):
    """Everything at positions (n, ...), over the coordinates of the links alone (links: 3 per moving link).

    `constraints` (n, links, rows): what a force of one in each row of the pairs puts on the links, the pairs' own
    coordinates eliminated; `input_directions` (n, inputs, links) the same of efforts of the inputs, `loads` (n, links)
    what loads, weights, springs and dampers put on them, `inertia` (n, links) what accelerating them takes, `openings`
    (n, rows) by how much the pairs' constraints are open (m, angles as rad times the square of the size).
    """

    constraints: SparseMatrices
    input_directions: Array
    loads: Array
    inertia: Array
    openings: Array


class _PairGroup(NamedTuple):
    """Pairs of one element, all alike in what their rows are: their `rows` (pairs, ...) among those of the constraints,
    own coordinates eliminated, and the `entries` there (pairs, rows, coordinates of links)."""

    placed: ElementGroup
    kinds: tuple[MeasureKind, ...]
    rows: IntArray
    entries: IntArray


class BalanceEquations(LinkCoordinates):
    """The balance of one structure: which links each pair, input and action is about, and where that stands."""

    def __init__(self, mechanism: Mechanism):
        super().__init__(mechanism)
        self.pair_rows: dict[str, slice] = {}
        "of every pair: its rows of the constraints"
        self.row_count = 0
        for pair in mechanism.pairs:
            first = self.row_count
            self.row_count += len(pair.residual_kinds) - len(pair.coordinate_kinds)
            self.pair_rows[pair.name] = slice(first, self.row_count)
        self._place_pairs(self.element_placement(mechanism.pairs))

    def _place_pairs(self, placement: ElementPlacement) -> None:
        """Group the pairs by their elements, and lay out the entries of the constraints, row after row."""
        pattern_rows: list[int] = []
        first_entries = [0]
        members: dict[tuple[Element, tuple[MeasureKind, ...]], list[tuple[PlacedElement, slice, IntArray]]] = {}
        for pair in self.mechanism.pairs:
            placed, rows, columns = placement.residual_of(pair, 0), self.pair_rows[pair.name], self._columns_of(pair)
            places = {column: k for k, column in enumerate(columns)}
            of_links = [places[column] for column in placed.coordinates[: 3 * placed.element.body_count]]
            entries = [
                [len(pattern_rows) + row * len(columns) + place for place in of_links]
                for row in range(rows.stop - rows.start)
            ]
            pattern_rows += columns * (rows.stop - rows.start)
            first_entries += [first_entries[-1] + len(columns) * (k + 1) for k in range(rows.stop - rows.start)]
            key = placed.element, tuple(pair.residual_kinds)
            members.setdefault(key, []).append((placed, rows, np.array(entries, dtype=int)))
        self._groups: list[_PairGroup] = []
        for (element, kinds), group in members.items():
            (placed_group,) = group_elements(placed for placed, _, _ in group)
            group_rows = np.array([range(rows.start, rows.stop) for _, rows, _ in group], dtype=int)
            group_entries = np.array([entries for _, _, entries in group])
            group_entries = group_entries.reshape(len(group), -1, 3 * element.body_count)
            self._groups.append(_PairGroup(placed_group, kinds, group_rows, group_entries))
        shape = self.link_coordinate_count, self.row_count
        self.pattern = SparsePattern(shape, np.array(pattern_rows, dtype=int), np.array(first_entries, dtype=int))

    def _columns_of(self, pair: Pair) -> list[int]:
        """The coordinates of the links that a pair joins."""
        firsts = sorted({self.link_columns[link] for link in pair.bodies if link in self.link_columns})
        return [first + k for first in firsts for k in range(3)]

    def balance(
        self, field: KinematicArrays, factors: Array, inertia: bool, spring_turns: Array | None = None
    ) -> VirtualWorkBalance:
        """The balance at positions (n) with factors of the loads (n, loads).

        `spring_turns` (springs, n) are those of `initial_spring_turns`, by default those of the first position.
        """
        q, _, _ = self.coordinates(field.moving)
        if spring_turns is None:
            spring_turns = np.repeat(self.initial_spring_turns(q[0], field.mechanism.springs)[:, None], len(q), axis=1)
        count = len(q)
        directions: Array = np.zeros((count, len(self.mechanism.inputs), self.link_coordinate_count))
        for k, given in enumerate(self.mechanism.inputs):
            directions[:, k] = self._on_links(field, effort_actions(field, "input", given.pair, np.ones(count)))
        constraints, openings = self._constraints(q, self._pair_numbers(field, count), field.size)
        return VirtualWorkBalance(
            constraints,
            directions,
            self._on_links(field, passive_actions(field, factors.T, spring_turns)),
            -self._on_links(field, inertia_actions(field) if inertia else ()),
            openings,
        )

    def _pair_numbers(self, field: KinematicArrays, count: int) -> Array:
        """The numbers of all pairs (n, numbers), in m and rad."""
        numbers: list[Scalar] = []
        for pair in field.mechanism.pairs:
            numbers += pair.measure([field.shapes[link] for link in pair.bodies])
        return np.array([np.broadcast_to(number, (count,)) for number in numbers]).reshape(len(numbers), count).T

    def _constraints(self, q: Array, p: Array, size: float) -> tuple[SparseMatrices, Array]:
        """What forces of one in the rows of pairs put on the links, and by how much these are open (n, rows)."""
        entries: Array = np.zeros((len(q), len(self.pattern.rows)))
        openings: Array = np.zeros((len(q), self.row_count))
        for group in self._groups:
            residuals, slopes = group.placed.evaluate(q, p)
            for k, kind in enumerate(group.kinds):
                if kind is not MeasureKind.LENGTH:
                    residuals[..., k] = wrapped_residual(residuals[..., k], kind) * size**2
            of_links = 3 * group.placed.element.body_count
            if own_count := slopes.shape[-1] - of_links:
                # what remains to hold the links is square to what the pair's own coordinates do
                basis = np.linalg.qr(slopes[..., of_links:], mode="complete")[0]
                basis = np.swapaxes(basis, -1, -2)[..., own_count:, :]
                slopes, residuals = basis @ slopes, (basis @ residuals[..., None])[..., 0]
            for body in range(0, of_links, 3):  # a link may be two bodies of a pair
                entries[:, group.entries[..., body : body + 3]] += slopes[..., body : body + 3]
            openings[:, group.rows] = residuals
        return SparseMatrices(self.pattern, entries), openings

    def _on_links(self, field: KinematicArrays, actions: Iterable[LinkAction]) -> Array:
        """What forces and couples put on the coordinates of the links (n, links)."""
        total: Array = np.zeros((field.position_count, self.link_coordinate_count))
        for action in actions:
            if action.link in self.link_columns:
                first = self.link_columns[action.link]
                for k, part in enumerate(action_on_link(field, action)):
                    total[:, first + k] += part
        return total


def balance_equations(mechanism: Mechanism) -> BalanceEquations:
    """The equations of a mechanism, kept for all of its structure: wherever links stand, however long they are, and
    whatever acts."""
    return _cached_balance_equations(equation_structure(mechanism))


_cached_balance_equations = lru_cache(maxsize=32)(BalanceEquations)
