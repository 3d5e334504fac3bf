"""One number that a motion tells, an output: its value and rates at any position of the input, and where it turns."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from math import cos, isfinite, sin
from numbers import Real
from typing import Any, NamedTuple, Protocol

import numpy as np

from planar.analysis.interpolated_run import CLOSED_TOLERANCE, InterpolatedRun
from planar.analysis.motion.zeros import bracket_near_zeros, bracket_zeros
from planar.foundation.angles import TURN
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Unknown, suggest_name_of_kinds
from planar.foundation.jets import value_and_rates
from planar.foundation.root_finding import find_root
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.results.kinematic_result import ValueAndRates
from planar.results.motion import Motion, State
from planar.results.records import principal_turns

Axis = str | float
"""`x` or `y` of the frame, or a direction (rad) against its x-axis."""
STANDSTILL_RATIO = 1e-9
"""A velocity below this part of the greatest, where it is least, is none: the output stands still and goes on."""


class Extreme(NamedTuple):
    """An extreme value (SI), and the position of the running input (rad or m) where it is."""

    input: float
    value: float


class RangeExtreme(NamedTuple):
    """An extreme value (SI) over a range of the input, where it is, and whether the output turns back there; otherwise
    the input's range ends there."""

    input: float
    value: float
    turns_back: bool

    @property
    def extreme(self) -> Extreme:
        """The place and the value."""
        return Extreme(self.input, self.value)


class MotionQuantity(Protocol):
    """One number with rates, in a state or over a motion."""

    @property
    def name(self) -> str:
        """What it is called."""

    @property
    def kind(self) -> str:
        """ "length" (m) or "angle" (rad)."""

    def value_and_rates(self, moving: State | Motion) -> ValueAndRates:
        """Its value and rates in a state, or over a motion (n,)."""


class Output:
    """What a pair tells first, the angle of a link (pairs before links of the same name), or a point's coordinate.

    `kind` is "length" (m) or "angle" (rad). The least angle of what swings lies between -pi and pi, as a position has
    it, and the others count on from there; what turns right round starts there. `near` is what is round-off of it.
    """

    def __init__(self, run: InterpolatedRun, name: str, axis: Axis | None = None):
        moving, named = run.samples, relative_motions(run.mechanism)
        self.run, self.name, self.axis = run, name, axis
        self._direction = _axis_direction(axis)
        self._is_pair = self._direction is None and name in named
        if self._direction is not None:
            moving.point(name)  # refuses what there is not
        elif not self._is_pair and name not in moving.frames:
            if name in moving.point_names:
                raise BadInput(name, "of a point one coordinate is meant; name the axis, 'x' or 'y', or a direction")
            hint = suggest_name_of_kinds(name, {"pairs": named, "links": moving.frames})
            raise Unknown(f"there is no pair and no link {name!r}{hint}")
        length = self._direction is not None or (self._is_pair and named[name].input_kind is MeasureKind.LENGTH)
        self.kind = "length" if length else "angle"
        self.tolerance = CLOSED_TOLERANCE * run.solver.unit if length else CLOSED_TOLERANCE
        self._offset = 0.0
        self._values = np.broadcast_to(self.value_and_rates(moving)[0], run.positions.shape)
        if self._is_pair:
            self._offset = moving._turns_of_limit(name, self._values)
        elif not length and name not in moving._links_counting_turns:
            self._offset = principal_turns(self._values)
        self._values = self._values + self._offset

    def value_and_rates(self, moving: State | Motion) -> ValueAndRates:
        """Its value and rates in a state, or over a motion (n,)."""
        if self._direction is not None:
            rates: Sequence[Any] = [part @ self._direction for part in moving.point(self.name)[:3]]
        elif self._is_pair:
            pair, parts = moving._find_relative_motion(self.name)
            rates = list(pair.results(*parts).values())[:3]
        else:
            rates = value_and_rates(moving.frames[self.name].angle)
        position, velocity, acceleration = rates
        return position + self._offset, velocity, acceleration

    def evaluate(self, position: float) -> tuple[float, float, float]:
        """Its value and rates at a position of the input, beyond a closed range as well. Raises NoAnswer."""
        place = self.run.wrap_position(position)
        if place is None or not self.run.closed:
            return self._evaluate_in_range(position)
        value, velocity, acceleration = self._evaluate_in_range(place)
        value += self.gain_per_period * round((position - place) / self.run.period)
        return value, velocity, acceleration

    def _evaluate_in_range(self, position: float) -> tuple[float, float, float]:
        try:
            value, velocity, acceleration = self.value_and_rates(self.run.state_at(position))
        except NoAnswer:
            on = np.flatnonzero(self.run.positions == position)
            if not len(on):
                raise
            return float(self._values[on[0]]), float("nan"), float("nan")  # at a limit there are no rates
        return float(value), float(velocity), float(acceleration)

    @cached_property
    def gain_per_period(self) -> float:
        """What it gains over a range that is closed: whole turns of an angle."""
        order = np.argsort(self.run.positions, kind="stable")
        return float(self._values[order[-1]] - self._values[order[0]]) if self.run.closed else 0.0

    @property
    def full_turns(self) -> int:
        """The turns that an angle gains over a closed range of the input; 0 for what comes back, or a length."""
        return round(self.gain_per_period / TURN) if self.kind == "angle" else 0

    @cached_property
    def range_ends(self) -> tuple[Extreme, ...]:
        """The two ends of the input's range; of a closed one, and where it does not move, the first."""
        order = np.argsort(self.run.positions, kind="stable")[[0, -1]].tolist()
        ends = order[:1] if self.run.closed or not self.is_moving else order
        return tuple(Extreme(float(self.run.positions[k]), float(self._values[k])) for k in ends)

    @cached_property
    def range(self) -> tuple[float, float]:
        """Its least and greatest value: where it turns back, or at the ends of the input's range."""
        values = [each.value for each in (*self.turning_points, *self.range_ends)]
        return min(values), max(values)

    @property
    def is_moving(self) -> bool:
        """Whether it moves at all."""
        return float(np.ptp(self._values)) > self.tolerance

    @cached_property
    def turning_points(self) -> tuple[Extreme, ...]:
        """Where it turns back, in the order of the input: where its velocity passes zero, solved for to round-off.

        Where the velocity's zero is a triple one, as in the middle of an exact dwell, the place is good to about 1e-5
        of the input; the value is as exact as ever.
        """
        return self._turning_and_touching[0]

    @cached_property
    def standstills(self) -> tuple[Extreme, ...]:
        """Where it stands still, in the order of the input: turns back, or stands and goes on."""
        return tuple(sorted((*self._turning_and_touching[0], *self._turning_and_touching[1])))

    @cached_property
    def _turning_and_touching(self) -> tuple[tuple[Extreme, ...], tuple[Extreme, ...]]:
        if not self.is_moving:
            return (), ()
        positions, table = self.run.tabulate(
            lambda moving: np.stack(np.broadcast_arrays(*self.value_and_rates(moving)), axis=-1)
        )
        if not len(positions):
            return (), ()
        velocity, acceleration = table[:, 1] / self.run.rate, table[:, 2] / self.run.rate**2
        brackets, touching = list(bracket_zeros(positions, velocity)), []
        fastest = float(np.abs(velocity).max())
        for low, high in bracket_near_zeros(positions, velocity, acceleration):
            try:
                at = find_root(lambda at: self.evaluate(at)[2], low, high)
                least = self.evaluate(at)[1] / self.run.rate
            except NoAnswer:
                continue
            if abs(least) <= STANDSTILL_RATIO * fastest:
                touching.append(at)
            elif least * velocity[np.searchsorted(positions, low)] < 0.0:
                brackets += [(low, at), (at, high)]
        turning = []
        for low, high in brackets:
            try:
                turning.append(find_root(lambda at: self.evaluate(at)[1], low, high))
            except NoAnswer:
                continue  # what cannot be followed does not turn back
        return self._in_range(turning), self._in_range(touching)

    def _in_range(self, positions: list[float]) -> tuple[Extreme, ...]:
        """These in the range, once each."""
        found: dict[float, Extreme] = {}
        for position in positions:
            place = self.run.wrap_position(position)
            if place is not None:
                try:
                    found[place] = Extreme(place, self.evaluate(place)[0])
                except NoAnswer:
                    found[place] = Extreme(place, self.evaluate(position)[0])  # beside a limit, not on it
        return tuple(sorted(found.values()))

    @cached_property
    def range_extremes(self) -> tuple[RangeExtreme, RangeExtreme] | None:
        """The least and the greatest value over the input's range, of several places the first; each says whether the
        output turns back there.

        None where no rates are determined, or a sample lies beyond every value that was solved for.
        """
        if not self.run.has_rates.any():
            return None
        ends = list(self.range_ends)
        if self.full_turns:
            ends.append(Extreme(self.run.highest, ends[0].value + self.gain_per_period))
        candidates = [RangeExtreme(*point, True) for point in self.turning_points]
        candidates += [RangeExtreme(*point, False) for point in ends]
        values = [candidate.value for candidate in candidates]
        low, high = min(values), max(values)
        if self._values.min() < low - self.tolerance or self._values.max() > high + self.tolerance:
            return None
        least, greatest = (
            min(
                (candidate for candidate in candidates if abs(candidate.value - bound) <= self.tolerance),
                key=lambda candidate: not candidate.turns_back,
            )
            for bound in (low, high)
        )
        return least, greatest

    def turning_extremes(self) -> tuple[Extreme, Extreme] | None:
        """The least and the greatest value where it turns back, of several places the first in the range.

        None where it does not move, or is less or more at an end of the range without turning back there.
        """
        if len(self.turning_points) < 2:
            return None
        (least, *_), (greatest, *_) = self.all_turning_extremes()
        if least.value > self._values.min() + self.tolerance or greatest.value < self._values.max() - self.tolerance:
            return None
        return least, greatest

    def all_turning_extremes(self) -> tuple[list[Extreme], list[Extreme]]:
        """All places where it turns back at the least, and at the greatest value of those where it does."""
        values = [each.value for each in self.turning_points]
        low, high = min(values), max(values)
        found = (
            [each for each in self.turning_points if abs(each.value - end) <= self.tolerance] for end in (low, high)
        )
        least, greatest = found
        return least, greatest


def _axis_direction(axis: Axis | None) -> Array | None:
    """The unit vector of an axis. Raises BadInput."""
    if axis is None:
        return None
    if isinstance(axis, str) and axis in ("x", "y"):
        return np.array([1.0, 0.0]) if axis == "x" else np.array([0.0, 1.0])
    if isinstance(axis, Real) and not isinstance(axis, bool) and isfinite(axis):
        return np.array([cos(axis), sin(axis)])
    raise BadInput("axis", f"the axis is 'x', 'y' or a direction in rad, not {axis!r:.40}")
