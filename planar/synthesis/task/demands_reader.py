"""What a task's file demands besides: whole turns, one branch, transmission angles, the room that there is."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import pi

import numpy as np

from planar.document.cursor import Cursor
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.synthesis.task.synthesis_task import Demands
from planar.synthesis.task.task_schema import DEMAND_SCHEMA, DEMAND_WORDS, MAX_CORNERS, WHOLE_TURN
from planar.synthesis.task.wanted_reader import check_turning_input, frozen_array

FLAT = 1e-12
"""Of the squared extent of a polygon: an area below is none."""


def read_demands(items: Iterable[Cursor], starts: Sequence[Mechanism]) -> Demands:
    """The demands of a list. Raises BadInput with the place."""
    demands = Demands()
    for each in items:
        if isinstance(each.value, str):
            if each.as_choice(DEMAND_WORDS) == WHOLE_TURN:
                check_turning_input(each, starts, "only an input that turns can make a whole turn")
                demands = demands._replace(whole_turn=True)
            else:
                demands = demands._replace(one_branch=True)
            continue
        each.check_keys(*DEMAND_SCHEMA)
        if not each.fields():
            raise each.error_at(None, "a demand is wanted here: 'whole turn', 'transmission' or 'inside'")
        for key in each.fields():
            if getattr(demands, key) is not None:
                raise each.error_at(key, f"{key!r} is demanded already; write one of the two")
        if each.has("transmission"):
            demands = demands._replace(transmission=_read_angle(each["transmission"]))
        if each.has("inside"):
            demands = demands._replace(inside=_read_region(each["inside"]))
    return demands


def _read_angle(cursor: Cursor) -> float:
    found = cursor.as_positive("angle")
    if not found < pi / 2:
        raise cursor.error_at(None, "a least transmission angle is less than a right angle")
    return found


def _read_region(cursor: Cursor) -> Array:
    """The corners (n, 2) of a rectangle or a polygon."""
    given = tuple(cursor.items())
    if len(given) > MAX_CORNERS:
        raise cursor.error_at(None, f"a polygon has {MAX_CORNERS} corners at most, not {len(given)}")
    corners = np.array([each.as_vector("length") for each in given])
    if len(corners) < 2:
        raise cursor.error_at(None, "two opposite corners of a rectangle are wanted here, or a polygon's corners")
    if len(corners) == 2:
        (left, low), (right, high) = corners.min(axis=0), corners.max(axis=0)
        corners = np.array([[left, low], [right, low], [right, high], [left, high]])
    extent = float(np.ptp(corners, axis=0).max())
    unit = (corners - corners[0]) / (extent or 1.0)
    x, y = unit.T
    if _crosses_itself(unit):
        raise cursor.error_at(None, "the sides of this polygon cross; its corners stand one after the other round it")
    if not 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) > FLAT:
        raise cursor.error_at(None, "there is nothing inside: the corners lie on one line")
    return frozen_array(corners)


def _crosses_itself(corners: Array) -> bool:
    """Whether two sides of a polygon (n, 2) cross between their ends."""
    start, end = corners[:, None], np.roll(corners, -1, axis=0)[:, None]
    side = end - start

    def left_of(points: Array) -> Array:
        """On which side (sides, n) of each side points (n, 2) lie."""
        away = points[None] - start
        return np.asarray(np.sign(side[..., 0] * away[..., 1] - side[..., 1] * away[..., 0]))

    first, second = left_of(corners), left_of(np.roll(corners, -1, axis=0))
    parted = first * second < 0.0
    return bool((parted & parted.T).any())
