"""Pairs of one element computed together: residuals or positions, and their derivatives by all coordinates."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from planar.equations.elements import Element, PlacedElement
from planar.equations.sparse_matrices import SparsePattern
from planar.foundation.arrays import Array, IntArray


class ElementGroup(NamedTuple):
    """The places of one element. Indices (places, ...): `coordinates` in w, `numbers` in p, `rows` of the formulas."""

    element: Element
    coordinates: IntArray
    numbers: IntArray
    rows: IntArray

    def evaluate(self, w: Array, p: Array) -> tuple[Array, Array]:
        """The values (n, places, rows) and their derivatives (n, places, rows, local coordinates).

        At coordinates w (n, coordinates), with cos and sin made from the angles, and numbers p (n, numbers), or (1,
        numbers) for all.
        """
        element, taken = self.element, self.element.arguments
        coordinates = w[:, self.coordinates]
        angles = coordinates[..., 2 : 3 * element.body_count : 3]
        arguments = [
            *(coordinates[..., k] for k in taken.coordinates),
            *(np.cos(angles[..., k]) for k in taken.cosines),
            *(np.sin(angles[..., k]) for k in taken.sines),
            *(p[:, self.numbers[:, k]] for k in taken.numbers),
        ]
        with np.errstate(all="ignore"):  # what is not defined is not a number
            rests = element.slopes_function(*arguments)
        slopes: Array = np.zeros((*coordinates.shape[:2], element.row_count, element.coordinate_count))
        for row, factors in enumerate(element.factors):
            for column, factor in factors.items():
                slopes[..., row, column] = factor
        values = (slopes @ coordinates[..., None])[..., 0]  # the linear parts
        for row, rest in enumerate(rests[: element.row_count]):
            values[..., row] += rest
        for (row, column), slope in zip(element.slope_entries, rests[element.row_count :], strict=True):
            slopes[..., row, column] += slope
        return values, slopes


def group_elements(placed_elements: Iterable[PlacedElement]) -> list[ElementGroup]:
    """The groups of placed elements."""
    members: dict[Element, list[PlacedElement]] = {}
    for placed in placed_elements:
        members.setdefault(placed.element, []).append(placed)
    return [
        ElementGroup(
            element,
            np.array([placed.coordinates for placed in group], dtype=int),
            np.array([placed.numbers for placed in group], dtype=int).reshape(len(group), -1),
            np.array([placed.rows for placed in group], dtype=int),
        )
        for element, group in members.items()
    ]


def pattern_of_groups(
    groups: Sequence[ElementGroup], row_count: int, coordinate_count: int, transposed: bool = False
) -> tuple[SparsePattern, list[IntArray]]:
    """Where the entries of dF/dq stand, or of its transpose, and of every group which of them its slopes are (elements,
    rows, local coordinates); a link may be two bodies of a pair, whose slopes are then added up."""
    shape = (coordinate_count, row_count) if transposed else (row_count, coordinate_count)
    places = []
    for group in groups:
        rows, columns = group.rows[:, :, None], group.coordinates[:, None, :]
        places.append((rows * shape[0] + columns if transposed else columns * shape[0] + rows).ravel())
    entries, indices = np.unique(np.concatenate([np.zeros(0, dtype=int), *places]), return_inverse=True)
    columns, rows = np.divmod(entries, max(shape[0], 1))
    first = np.searchsorted(columns, np.arange(shape[1] + 1))
    ends = np.cumsum([len(part) for part in places], dtype=int)
    entries_of_groups: list[IntArray] = [
        indices[end - len(part) : end].reshape(*group.rows.shape, group.coordinates.shape[1])
        for end, part, group in zip(ends, places, groups, strict=True)
    ]
    return SparsePattern(shape, rows, first), entries_of_groups
