"""Boxes that cover all positions of the inputs and all deviations of a mechanism, bisected until each is proved.

Two boxes of one branch are shown to be so at a point that they share: the solution there, enclosed narrowly, is the
only one that either has. At the positions of a motion that solution is the motion's own.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from planar.analysis.tolerance.varied import Varied, mean_slopes, slope_bounds
from planar.derivatives.enclosures import OVER, Enclosures, ParametricSystem, down, up
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.time_limit import MORE_TIME, stop_if_over

TIGHT = 0.03
"""Of a band's width: boxes that go farther over what the first order tells are bisected, to be narrower."""
OTHER_PART = 0.2
"""Of a point's other coordinate's width, which counts too."""
TIGHT_DEPTH = 4
"""How often, at most."""
WAY_PARTS = 8
"""Parts of the ways from the nominal to all deviations, where boxes of these are bisected."""
MAX_BOXES = 6000
"""Where more would be wanted it is undecided."""
DEPTH_OF_DOUBT = 4
"""After so many bisections it is asked whether there is a dead point."""
INPUT_FIRST = 0.5
"""An input is bisected where it moves what is solved for by this part of what a deviation does."""


class Undecided(Exception):
    """Boxes of bounds (lanes, varied) that are not proved, with what is near solutions at their middles."""

    def __init__(self, lower: Array, upper: Array, near: Array):
        super().__init__()
        self.lower, self.upper, self.near = lower, upper, near


class Boxes(NamedTuple):
    """Boxes side by side: bounds (lanes, varied), the row of the motion that each belongs to, the group in which they
    cover the same positions of the inputs, how often they were bisected, and where solutions are looked for."""

    lower: Array
    upper: Array
    row: IntArray
    group: IntArray
    depth: IntArray
    start: Array

    def rows(self, which: IntArray) -> Boxes:
        """Some of them."""
        lower, upper, row, group, depth, start = self
        return Boxes(lower[which], upper[which], row[which], group[which], depth[which], start[which])

    def with_more(self, more: Boxes) -> Boxes:
        """These and others."""
        lower, upper, row, group, depth, start = (np.concatenate(both) for both in zip(self, more, strict=True))
        return Boxes(lower, upper, row, group, depth, start)


Doubt = Callable[[Array, Array, Array], None]
"""Asks whether there is a dead point in boxes (as of `Undecided`), and raises where that is proved."""


class Cover:
    """The boxes of a motion whose rows have inputs u (n, inputs) and unknowns z (n, unknowns); `base` is t of all."""

    def __init__(self, system: ParametricSystem, varied: Varied, base: Array, u: Array, z: Array):  # many: a motion
        self.system, self.varied, self.base, self.u, self.z = system, varied, base, u, z
        self.place = np.array([system.columns.index(column) for column in varied.columns], dtype=int)
        self.boxes = self._roots()
        self.roots = len(self.boxes.row)
        self.children: dict[int, tuple[int, int, Array]] = {}
        "the two boxes in a box's place, and a point that they share"
        self.found: Enclosures | None = None
        self.low: Array = np.zeros((0, system.parts, len(varied.columns)))
        self.high = self.low

    def _roots(self) -> Boxes:
        """From each row half way to the next; of one row what it is alone."""
        low, high = np.minimum(self.varied.lower, 0.0), np.maximum(self.varied.upper, 0.0)
        middle = 0.5 * (self.u[1:] + self.u[:-1])
        ends = [np.stack([self.u[:-1], middle, self.u[1:]])[k : k + 2] for k in (0, 1)]
        if len(self.u) == 1:
            ends, start = [np.stack([self.u, self.u])], self.z
            row = np.zeros(1, dtype=int)
        else:
            near = [(3.0 * self.z[:-1] + self.z[1:]) / 4.0, (self.z[:-1] + 3.0 * self.z[1:]) / 4.0]
            start = np.stack(near, axis=1).reshape(2 * len(self.u) - 2, self.z.shape[1])
            row = np.repeat(np.arange(len(self.u)), 2)[1:-1]
        bounds = np.stack(ends, axis=2).reshape(2, len(row), -1)
        lower, upper = (
            np.concatenate([each, np.tile(deviation, (len(row), 1))], axis=1)
            for each, deviation in ((bounds.min(axis=0), low), (bounds.max(axis=0), high))
        )
        return Boxes(lower, upper, row, np.arange(len(row)), np.zeros(len(row), dtype=int), start)

    def decide(self, doubt: Doubt) -> None:
        """Bisect until all is proved, and as tight as it can be had. Raises Undecided, or what `doubt` raises."""
        todo: IntArray = np.arange(self.roots)
        while len(todo):
            stop_if_over(
                f"after {len(self.low)} boxes of deviations were enclosed",
                f"{MORE_TIME}, or ask for narrower tolerances or a shorter motion",
            )
            self._enclose(todo)
            assert self.found is not None
            failed = todo[~self.found.is_proved[todo]]
            deep = failed[self.boxes.depth[failed] >= DEPTH_OF_DOUBT]
            near = np.where(np.isfinite(self.found.middle), self.found.middle, self.boxes.start)
            if len(deep):
                doubt(self.boxes.lower[deep], self.boxes.upper[deep], near[deep])
            if len(self.boxes.row) + 2 * len(failed) > MAX_BOXES:
                raise Undecided(self.boxes.lower[failed], self.boxes.upper[failed], near[failed])
            loose = self._loose(todo[self.found.is_proved[todo]])
            todo = self._bisect(np.concatenate([failed, loose]), np.arange(len(failed) + len(loose)) >= len(failed))
        self._join()

    def _enclose(self, which: IntArray) -> None:
        boxes = self.boxes.rows(which)
        told = self.system.enclose(self.varied.boxes_of_t(self.base, boxes.lower, boxes.upper), boxes.start)
        low, high = self._slope_bounds(boxes, told, which)
        whole = told if self.found is None else Enclosures.stack([self.found, told])
        self.found, self.low, self.high = whole, np.concatenate([self.low, low]), np.concatenate([self.high, high])

    def _slope_bounds(self, boxes: Boxes, told: Enclosures, which: IntArray) -> tuple[Array, Array]:
        """What slopes are between (lanes, parts, varied)."""
        low, high = (each[..., self.place] for each in slope_bounds(told.slopes))
        whole = np.flatnonzero(told.is_proved & (boxes.group == which))
        if len(whole):
            bounds = boxes.lower[whole], boxes.upper[whole]
            low[whole], high[whole] = mean_slopes(self.system, self.varied, self.base, bounds, told.rows(whole))
        return low, high

    def _along(self, tangents: Array, moved: Array) -> Array:
        """How unknowns move, to the first order, with what varies (lanes, varied)."""
        return (tangents[..., self.place] @ moved[:, :, None])[:, :, 0]

    def _loose(self, proved: IntArray) -> IntArray:
        """Boxes that are wide for what they hold, and may be bisected yet."""
        assert self.found is not None
        boxes, k = self.boxes, self.varied.inputs
        alone = self._leaves()
        alone = alone[self.found.is_proved[alone] & (boxes.group[alone] == alone)]
        middle = self.found.slopes.middle[alone][..., self.place]
        ends = self.varied.deviations(middle, middle)
        rows = len(self.u)
        least, greatest = np.full((2, rows, self.system.parts), np.nan)
        np.fmin.at(least, boxes.row[alone], ends[0])
        np.fmax.at(greatest, boxes.row[alone], ends[1])
        width = greatest - least
        slack = TIGHT * (width + OTHER_PART * width.max(axis=1, keepdims=True, initial=0.0))
        low, high = self.varied.deviations(self.low[proved], self.high[proved])
        at = boxes.row[proved]
        over = (low < least[at] - slack[at]) | (high > greatest[at] + slack[at])
        wide = (boxes.upper[proved, :k] > boxes.lower[proved, :k]).any(axis=1)
        shallow = (boxes.depth[proved] < TIGHT_DEPTH) & (boxes.group[proved] == proved)
        room = max(0, (MAX_BOXES - len(boxes.row)) // 4)
        loose: IntArray = proved[over.any(axis=1) & wide & shallow][:room]
        return loose

    def _leaves(self) -> IntArray:
        is_leaf = np.ones(len(self.low), dtype=bool)
        is_leaf[list(self.children)] = False
        return np.flatnonzero(is_leaf)

    def _bisect(self, which: IntArray, is_loose: BoolArray) -> IntArray:
        """Put two boxes in the place of each, cut across what moves the unknowns farthest."""
        assert self.found is not None
        if not len(which):
            return which
        boxes, k = self.boxes.rows(which), self.varied.inputs
        half = 0.5 * (boxes.upper - boxes.lower)
        tangents = np.nan_to_num(self.found.tangents[which][..., self.place], nan=1.0, posinf=1e6, neginf=-1e6)
        far = (np.abs(tangents) * half[:, None]).max(axis=1, initial=0.0) + 1e-9 * half
        by_inputs = far[:, :k].max(axis=1, initial=0.0)
        of_inputs = is_loose | (by_inputs >= INPUT_FIRST * far[:, k:].max(axis=1, initial=0.0))
        of_inputs &= by_inputs > 0.0
        far[of_inputs, k:] = -1.0
        axis = np.argmax(far, axis=1)
        lane = np.arange(len(which))
        point = 0.5 * (boxes.lower + boxes.upper)
        lower, upper = np.repeat(boxes.lower, 2, axis=0), np.repeat(boxes.upper, 2, axis=0)
        upper[2 * lane, axis], lower[2 * lane + 1, axis] = point[lane, axis], point[lane, axis]
        middle = np.where(np.isfinite(self.found.middle[which]), self.found.middle[which], boxes.start)
        moved = 0.5 * (lower + upper) - np.repeat(point, 2, axis=0)
        near = np.repeat(middle, 2, axis=0) + self._along(np.repeat(self.found.tangents[which], 2, axis=0), moved)
        start = np.where(np.isfinite(near), near, np.repeat(middle, 2, axis=0))
        first = len(self.boxes.row)
        new = first + np.arange(2 * len(which))
        alone = boxes.group == which
        kept = np.repeat(np.where(alone & ~of_inputs, which, boxes.group), 2)
        group = np.where(np.repeat(alone & of_inputs, 2), new, kept)
        more = Boxes(lower, upper, np.repeat(boxes.row, 2), group, np.repeat(boxes.depth, 2) + 1, start)
        self.boxes = self.boxes.with_more(more)
        for n, each in enumerate(which.tolist()):
            self.children[each] = (first + 2 * n, first + 2 * n + 1, point[n])
        return new

    def _leaf_at(self, box: int, point: Array) -> int:
        while box in self.children:
            one, other, _ = self.children[box]
            within = (self.boxes.lower[one] <= point).all() and (point <= self.boxes.upper[one]).all()
            box = one if within else other
        return box

    def _join(self) -> None:
        """Show that all boxes are of the motion's own branch. Raises Undecided."""
        assert self.found is not None
        none = np.zeros(len(self.varied.lower))
        pairs, points = [], []
        starts: list[Array | None] = []
        for one, other, point in self.children.values():
            pairs.append((self._leaf_at(one, point), self._leaf_at(other, point)))
            points.append(point)
            starts.append(None)
        many = self.roots
        for k in range(many + 1 if len(self.u) > 1 else 1):
            row, is_between = divmod(k, 2)
            at = 0.5 * (self.u[row] + self.u[row + 1]) if is_between else self.u[row]
            point = np.concatenate([at, none])
            pairs.append((self._leaf_at(max(k - 1, 0), point), self._leaf_at(min(k, many - 1), point)))
            points.append(point)
            starts.append(None if is_between else self.z[row])
        place, first = np.array(points), np.array([one for one, _ in pairs])
        second = np.array([other for _, other in pairs])
        middle = 0.5 * (self.boxes.lower[first] + self.boxes.upper[first])
        near = self.found.middle[first] + self._along(self.found.tangents[first], place - middle)
        near = np.array([one if told is None else told for one, told in zip(near, starts, strict=True)])
        narrow = self.system.enclose(self.varied.boxes_of_t(self.base, place, place), near)
        joined = self.found.rows(first).holds(narrow) & self.found.rows(second).holds(narrow)
        if not joined.all():
            raise Undecided(place[~joined], place[~joined], near[~joined])

    def grouped_slopes(self) -> tuple[IntArray, Array, Array]:
        """What the mean slopes to all deviations are between (groups, parts, varied), over boxes that cover all
        deviations together, and the rows of these groups.

        Ways from the nominal are cut into parts, of which each goes through some of the boxes.
        """
        leaves = self._leaves()
        group, at = np.unique(self.boxes.group[leaves], return_inverse=True)
        low, high = np.zeros((2, len(group), *self.low.shape[1:]))
        k, size = self.varied.inputs, np.zeros_like(low)
        for share in np.arange(1, WAY_PARTS + 1) / WAY_PARTS:
            far = up(share * np.maximum(self.varied.upper, 0.0)), down(share * np.minimum(self.varied.lower, 0.0))
            near = (self.boxes.lower[leaves, k:] <= far[0]) & (self.boxes.upper[leaves, k:] >= far[1])
            met = np.flatnonzero(near.all(axis=1))
            least, greatest = np.full(low.shape, np.inf), np.full(low.shape, -np.inf)
            np.minimum.at(least, at[met], self.low[leaves[met]])
            np.maximum.at(greatest, at[met], self.high[leaves[met]])
            low, high, size = low + least, high + greatest, size + np.maximum(np.abs(least), np.abs(greatest))
        slack = (OVER - 1.0) * size
        return self.boxes.row[group], (low - slack) / WAY_PARTS, (high + slack) / WAY_PARTS
