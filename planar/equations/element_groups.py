"""Pairs of one element computed together: residuals or positions, and their derivatives by all coordinates."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from planar.equations.elements import Element, PlacedElement
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
