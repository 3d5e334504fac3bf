"""What a drawing of a chain is worth: equal lengths, joints away from each other and from lines; and its descent."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.foundation.arrays import Array
from planar.structures.rigid_parts import Joint

CLEARANCE_WEIGHT, HEIGHT_WEIGHT, APART_WEIGHT = 0.06, 0.12, 0.1
"""Of what keeps joints away from lines, from the other sides of their own link, and from each other, beside what makes
lengths equal."""
STRAIGHT_WEIGHT = 2.0
"""Of bars that cross: of their being straight."""
HALF_LENGTH = 0.6
"""How long a bar is wanted from its end to where another crosses it."""
LONGEST_MOVE = 0.08
"""How far a spot goes in one step."""
LEAST_LENGTH = 1e-6


class LayoutEnergy:
    """The energy of places of spots that sides join, for many drawings at once; lengths are of 1 where none matters.

    Places are complex numbers (drawings, spots). `plates` are the spots round each link with three and more joints,
    `bent` three spots each on one bar, `crossing` sides that may cross each other.
    """

    def __init__(
        self,
        spots: int,
        sides: Sequence[Joint],
        plates: Sequence[Sequence[int]],
        bent: Sequence[tuple[int, int, int]] = (),
        crossing: Sequence[tuple[int, int]] = (),
    ):
        unit = np.eye(spots, dtype=complex)  # as places are, so that products of them are quick
        self.ends = np.array(sides)
        self.along = unit[self.ends[:, 1]] - unit[self.ends[:, 0]]
        self.rest = np.array([HALF_LENGTH if any({*side} <= {*each} for each in bent) else 1.0 for side in sides])
        pairs = np.array([(k, s) for k in range(spots) for s, side in enumerate(sides) if k not in side])
        own = [any({k, *sides[s]} <= {*plate} for plate in plates) for k, s in pairs]
        self.spot, self.side = pairs.T
        self.clearance = np.where(own, HEIGHT_WEIGHT, CLEARANCE_WEIGHT)
        self.at_spot, self.at_start, self.at_end = (unit[each] for each in (self.spot, *self.ends[self.side].T))
        one, other = np.triu_indices(spots, 1)
        self.apart = unit[one] - unit[other]
        self.bends = [(unit[[a]] - unit[[b]], unit[[c]] - unit[[b]]) for a, b, c in bent]
        allowed = {frozenset(each) for each in crossing}
        disjoint = [
            (s, t)
            for s, side in enumerate(sides)
            for t, before in enumerate(sides[:s])
            if not {*side} & {*before} and frozenset((s, t)) not in allowed
        ]
        self.first, self.second = np.array(disjoint, dtype=int).reshape(-1, 2).T

    def value(self, at: Array) -> tuple[Array, Array]:
        """The energy of each drawing, and its slope (drawings, spots), by x and, times i, by y."""
        way = at @ self.along.T
        length = np.maximum(np.abs(way), LEAST_LENGTH)
        stretch = np.log(length / self.rest)
        energy = (stretch**2).sum(axis=1)
        slope = (2.0 * stretch / length**2 * way) @ self.along
        apart = at @ self.apart.T
        square = np.maximum(np.abs(apart), LEAST_LENGTH) ** 2
        energy += (APART_WEIGHT / square).sum(axis=1)
        slope += (-2.0 * APART_WEIGHT / square**2 * apart) @ self.apart
        part, gap = self._gaps(at, way)
        near = np.maximum(np.abs(gap), LEAST_LENGTH) ** 2
        energy += (self.clearance / near).sum(axis=1)
        shove = -2.0 * self.clearance / near**2 * gap
        slope += shove @ self.at_spot - ((1.0 - part) * shove) @ self.at_start - (part * shove) @ self.at_end
        for one, other in self.bends:
            self._straighten(at, one, other, energy, slope)
        return energy, slope

    def _gaps(self, at: Array, way: Array) -> tuple[Array, Array]:
        """Where on each side a spot's nearest point is, from 0 to 1, and the way from there to the spot."""
        start, line = at[:, self.ends[self.side, 0]], way[:, self.side]
        to_spot = at[:, self.spot] - start
        part = (to_spot * line.conj()).real / np.maximum(np.abs(line), LEAST_LENGTH) ** 2
        part = np.clip(part, 0.0, 1.0)
        return part, to_spot - part * line

    def _straighten(self, at: Array, one: Array, other: Array, energy: Array, slope: Array) -> None:
        """Add what a bend at the middle of three spots costs."""
        to_one, to_other = (at @ each.T for each in (one, other))
        far = [np.maximum(np.abs(each), LEAST_LENGTH) for each in (to_one, to_other)]
        u, v = to_one / far[0], to_other / far[1]
        together = (u * v.conj()).real
        energy += 2.0 * STRAIGHT_WEIGHT * (1.0 + together[:, 0])
        slope += (2.0 * STRAIGHT_WEIGHT * (v - together * u) / far[0]) @ one
        slope += (2.0 * STRAIGHT_WEIGHT * (u - together * v) / far[1]) @ other

    def crossings(self, at: Array) -> Array:
        """Of each drawing how many sides without a common spot cross that may not."""
        a, b = (at[:, self.ends[self.first, k]] for k in (0, 1))
        c, d = (at[:, self.ends[self.second, k]] for k in (0, 1))
        ab, cd = (b - a).conj(), (d - c).conj()
        across = (ab * (c - a)).imag * (ab * (d - a)).imag <= 0.0
        across &= (cd * (a - c)).imag * (cd * (b - c)).imag <= 0.0
        found: Array = across.sum(axis=1)
        return found

    def descend(self, at: Array, steps: int) -> tuple[Array, Array]:
        """Places of less energy in so many steps, in none of which more sides cross; with their energy."""
        move = np.full((len(at), 1), LONGEST_MOVE)
        (energy, slope), crossed = self.value(at), self.crossings(at)
        for _ in range(steps):
            size = np.abs(slope)
            longest = size.max(axis=1, keepdims=True)
            if ((longest < 1e-6) | (move < 1e-7)).all():
                break
            trial = at - move * slope / (size + 0.05 * longest + LEAST_LENGTH)
            value, steeper = self.value(trial)
            now = self.crossings(trial)
            better = (value < energy) & (now <= crossed)
            kept = better[:, None]
            at, slope = np.where(kept, trial, at), np.where(kept, steeper, slope)
            energy, crossed = np.where(better, value, energy), np.where(better, now, crossed)
            move = np.where(kept, np.minimum(LONGEST_MOVE, 1.3 * move), move / 2.0)
        return energy, at
