"""One number that a motion tells, an output: its value and rates at any position of the input, and where it turns."""

from __future__ import annotations

from functools import cached_property
from math import cos, isfinite, sin
from numbers import Real
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import SAME, Steady
from planar.analysis.motion.zeros import changes, dips
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.jets import orders
from planar.foundation.root_finding import root
from planar.model.mechanism import motions
from planar.model.pairs import Kind
from planar.results.motion import Moving, Parts, Unknown
from planar.results.records import turns_to_least

Array = np.ndarray
Axis = str | float
"""`x` or `y` of the frame, or a direction (rad) against its x-axis."""
TOUCHING = 1e-9
"""A velocity below this part of the greatest, where it is least, is none: the output stands still and goes on."""


class Extreme(NamedTuple):
    """An extreme value (SI), and the position of the running input (rad or m) where it is."""

    input: float
    value: float


class Output:
    """What a pair tells first, the angle of a link (pairs before links of the same name), or a point's coordinate.

    `kind` is "length" (m) or "angle" (rad). The least angle of what swings lies between -pi and pi, as a position has
    it, and the others count on from there; what turns right round starts there. `near` is what is round-off of it.
    """

    def __init__(self, steady: Steady, name: str, axis: Axis | None = None):
        moving, named = steady.samples, motions(steady.mechanism)
        self.steady, self.name, self.axis = steady, name, axis
        self._way = _direction(axis)
        self._pair = self._way is None and name in named
        if self._way is not None:
            moving.point(name)  # refuses what there is not
        elif not self._pair and name not in moving.frames:
            if name in moving.point_names:
                raise BadInput(name, "of a point one coordinate is meant; name the axis, 'x' or 'y', or a direction")
            raise Unknown(
                f"there is no pair and no link {name!r}; pairs are {', '.join(named)}, links {', '.join(moving.frames)}"
            )
        length = self._way is not None or (self._pair and named[name].drive_kind is Kind.LENGTH)
        self.kind = "length" if length else "angle"
        self.near = SAME * steady.solver.unit if length else SAME
        self._off = 0.0
        self._values = np.broadcast_to(self.of(moving)[0], steady.positions.shape)
        if self._pair:
            self._off = moving._turns_of_swing(name, self._values)
        elif not length and name not in moving._counting:
            self._off = turns_to_least(self._values)
        self._values = self._values + self._off

    def of(self, moving: Moving) -> Parts:
        """Its value and rates in a state, or over a motion (n,)."""
        if self._way is not None:
            position, velocity, acceleration = (part @ self._way for part in moving.point(self.name)[:3])
        elif self._pair:
            pair, parts = moving._motion(self.name)
            position, velocity, acceleration = list(pair.report(*parts).values())[:3]
        else:
            position, velocity, acceleration = orders(moving.frames[self.name].angle)
        return position + self._off, velocity, acceleration

    def at(self, position: float) -> tuple[float, float, float]:
        """Its value and rates at a position of the input, beyond a closed range as well. Raises NoAnswer."""
        place = self.steady.within(position)
        if place is None or not self.steady.closed:
            return self._at(position)
        value, *rates = self._at(place)
        return value + self.gain * round((position - place) / self.steady.period), *rates

    def _at(self, position: float) -> tuple[float, float, float]:
        try:
            value, velocity, acceleration = self.of(self.steady.at(position))
        except NoAnswer:
            on = np.flatnonzero(self.steady.positions == position)
            if not len(on):
                raise
            return float(self._values[on[0]]), float("nan"), float("nan")  # at a limit there are no rates
        return float(value), float(velocity), float(acceleration)

    @cached_property
    def gain(self) -> float:
        """What it gains over a range that is closed: whole turns of an angle."""
        order = np.argsort(self.steady.positions, kind="stable")
        return float(self._values[order[-1]] - self._values[order[0]]) if self.steady.closed else 0.0

    @cached_property
    def borders(self) -> tuple[Extreme, ...]:
        """The two ends of the input's range; of a closed one, and where it does not move, the first."""
        order = np.argsort(self.steady.positions, kind="stable")[[0, -1]].tolist()
        ends = order[:1] if self.steady.closed or not self.moves else order
        return tuple(Extreme(float(self.steady.positions[k]), float(self._values[k])) for k in ends)

    @cached_property
    def range(self) -> tuple[float, float]:
        """Its least and greatest value: where it turns back, or at the ends of the input's range."""
        values = [each.value for each in (*self.turns, *self.borders)]
        return min(values), max(values)

    @property
    def moves(self) -> bool:
        """Whether it moves at all."""
        return float(np.ptp(self._values)) > self.near

    @cached_property
    def turns(self) -> tuple[Extreme, ...]:
        """Where it turns back, in the order of the input: where its velocity passes zero, solved for to round-off.

        Where the velocity's zero is a triple one, as in the middle of an exact dwell, the place is good to about 1e-5
        of the input; the value is as exact as ever.
        """
        return self._still[0]

    @cached_property
    def stations(self) -> tuple[Extreme, ...]:
        """Where it stands still, in the order of the input: turns back, or stands and goes on."""
        return tuple(sorted((*self._still[0], *self._still[1])))

    @cached_property
    def _still(self) -> tuple[tuple[Extreme, ...], tuple[Extreme, ...]]:
        if not self.moves:
            return (), ()
        positions, table = self.steady.tabled(lambda moving: np.stack(np.broadcast_arrays(*self.of(moving)), axis=-1))
        if not len(positions):
            return (), ()
        velocity, acceleration = table[:, 1] / self.steady.rate, table[:, 2] / self.steady.rate**2
        brackets, touching = list(changes(positions, velocity)), []
        fastest = float(np.abs(velocity).max())
        for low, high in dips(positions, velocity, acceleration):
            try:
                at = root(lambda at: self.at(at)[2], low, high)
                least = self.at(at)[1] / self.steady.rate
            except NoAnswer:
                continue
            if abs(least) <= TOUCHING * fastest:
                touching.append(at)
            elif least * velocity[np.searchsorted(positions, low)] < 0.0:
                brackets += [(low, at), (at, high)]
        turning = []
        for low, high in brackets:
            try:
                turning.append(root(lambda at: self.at(at)[1], low, high))
            except NoAnswer:
                continue  # what cannot be followed does not turn back
        return self._placed(turning), self._placed(touching)

    def _placed(self, positions: list[float]) -> tuple[Extreme, ...]:
        """These in the range, once each."""
        found: dict[float, Extreme] = {}
        for position in positions:
            place = self.steady.within(position)
            if place is not None:
                try:
                    found[place] = Extreme(place, self.at(place)[0])
                except NoAnswer:
                    found[place] = Extreme(place, self.at(position)[0])  # beside a limit, not on it
        return tuple(sorted(found.values()))

    def ends(self) -> tuple[Extreme, Extreme] | None:
        """The least and the greatest value where it turns back, of several places the first in the range.

        None where it does not move, or is less or more at an end of the range without turning back there.
        """
        if len(self.turns) < 2:
            return None
        (least, *_), (greatest, *_) = self.all_ends()
        if least.value > self._values.min() + self.near or greatest.value < self._values.max() - self.near:
            return None
        return least, greatest

    def all_ends(self) -> tuple[list[Extreme], list[Extreme]]:
        """All places where it turns back at the least, and at the greatest value of those where it does."""
        values = [each.value for each in self.turns]
        low, high = min(values), max(values)
        found = ([each for each in self.turns if abs(each.value - end) <= self.near] for end in (low, high))
        least, greatest = found
        return least, greatest


def _direction(axis: Axis | None) -> Array | None:
    """The unit vector of an axis. Raises BadInput."""
    if axis is None:
        return None
    if isinstance(axis, str) and axis in ("x", "y"):
        return np.array([1.0, 0.0]) if axis == "x" else np.array([0.0, 1.0])
    if isinstance(axis, Real) and not isinstance(axis, bool) and isfinite(axis):
        return np.array([cos(axis), sin(axis)])
    raise BadInput("axis", f"the axis is 'x', 'y' or a direction in rad, not {axis!r:.40}")
