"""Plates laid out on sheets: each along its length, the highest first, in rows (next fit by decreasing height)."""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, degrees

from planar.foundation.errors import BadInput
from planar.manufacture.plates import Plate, convex_hull, moved_plate, plate_box


def nested(plates: Sequence[Plate], sheet: tuple[float, float], gap: float) -> list[list[Plate]]:
    """The plates of every sheet, in mm from its lower left corner, `gap` apart from each other and the edge.

    Raises BadInput where one is larger than a sheet.
    """
    flat = sorted((_laid_flat(plate) for plate in plates), key=lambda each: -each[1][1])
    sheets: list[list[Plate]] = []
    x = y = high = 0.0
    for plate, (width, height) in flat:
        if width + 2.0 * gap > sheet[0] or height + 2.0 * gap > sheet[1]:
            told = f"it takes {width:.4g} x {height:.4g} mm; choose a larger sheet or a smaller scale"
            raise BadInput(plate.name, f"this plate is larger than the sheet: {told}")
        if not sheets or x + width + gap > sheet[0]:
            x, y, high = gap, (y + high + gap if sheets else gap), 0.0
        if not sheets or y + height + gap > sheet[1]:
            sheets.append([])
            x, y, high = gap, gap, 0.0
        sheets[-1].append(moved_plate(plate, 0.0, x, y))
        x, high = x + width + gap, max(high, height)
    return sheets


def _laid_flat(plate: Plate) -> tuple[Plate, tuple[float, float]]:
    """The plate turned so that its box is lowest, from (0, 0) on, and the box's sizes."""
    corners = convex_hull(plate.core)
    ways = [0.0] + [
        degrees(atan2(q[1] - p[1], q[0] - p[0]))
        for p, q in zip(corners, [*corners[1:], corners[0]], strict=True)
        if p != q
    ]
    boxes = [(plate_box([moved_plate(plate, -way, 0.0, 0.0)]), way) for way in ways]
    (left, low, right, top), way = min(boxes, key=lambda each: round(each[0][3] - each[0][1], 9))
    return moved_plate(plate, -way, -left, -low), (right - left, top - low)
