"""The residual check that every answer passes: is every constraint closed, are its rates?

It knows nothing of elimination or Newton: it runs the pairs' own formulas on plain numbers. The second part,
since the residual of a flipped linkage is zero too, is `branch`.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import cached_property
from math import inf, isfinite, pi

import numpy as np

from planar.equations.residuals import (
    CARRIED_ROUNDING,
    ConstraintRow,
    Frames,
    PairValues,
    closing_error,
    input_residuals,
    pair_residuals,
)
from planar.equations.stacked_residuals import StackedCoordinates, StackedResiduals
from planar.foundation.arrays import Array
from planar.foundation.geometry import Frame
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair

CONTACT_TOLERANCE = 1e-6
"""Sizes: dimensions in files are rounded, so a contact that guides keep closed may be open by as much."""
EPS = float(np.finfo(float).eps)
NEGLIGIBLE_ERROR = 1e-7
"""Relative errors by round-off that are surely below this are neither looked for nor told."""
MAX_RATE_ERROR = 1e-3
"""Angles (rad) and rates that may have greater relative errors are no answer: less than three digits are sure."""
MIN_STACKED_PAIRS = 16
"""From so many pairs on one position takes less time on arrays, pairs of equal formula together, than on floats."""
SHORT_ARM = EPS / (NEGLIGIBLE_ERROR * 1e-2**2)
"""Sizes: where no link has a shorter arm and no block is nearer than 1e-2 to being singular, which backends keep clear
of, rounding surely takes no more than that."""


def residual_tolerance(link_count: int | Array, reach: float | Array) -> Array:
    """By how much constraints may be open (sizes, or rad) that close but for rounding; `reach` is the longest length.

    An entry of a residual is a sum of a few terms as long as the mechanism reaches, after one step of rounding for each
    link on the way round a loop.
    """
    return 16.0 * EPS * (4 + link_count) * np.maximum(1.0, reach)


class ResidualCheck:
    """The constraints of one mechanism (SI, lengths judged in units of its size)."""

    def __init__(
        self,
        mechanism: Mechanism,
        shapes: Mapping[str, LinkShape],
        unit: float,
        named: Mapping[str, Pair] | None = None,
    ):
        self.mechanism, self.unit = mechanism, unit
        self.relative_motions = relative_motions(mechanism) if named is None else named
        self.numbers = {
            pair.name: pair.measure([shapes[link] for link in pair.bodies])
            for pair in (*mechanism.pairs, *(self.relative_motions[given.pair] for given in mechanism.inputs))
        }
        self.row_pairs = [pair.name for pair in mechanism.pairs for _ in pair.residual_kinds]
        self.row_pairs += [given.pair for given in mechanism.inputs]
        """The pair of every constraint, the inputs' last."""
        reach = max(
            (abs(value) for pair in mechanism.pairs for value in _lengths(pair, self.numbers[pair.name])), default=0.0
        )
        self.tolerance = float(residual_tolerance(len(mechanism.links), reach / unit))
        self.open_rows: frozenset[int] = frozenset()
        "rows of pairs that may stay open by a misfit: they are judged with it, see `PreparedMechanism.residuals`"

    def with_inputs_of(self, mechanism: Mechanism) -> ResidualCheck:
        """The same for a mechanism that differs from this one in its inputs' numbers alone."""
        there = object.__new__(ResidualCheck)
        there.__dict__.update(self.__dict__)
        there.mechanism = mechanism
        return there

    @cached_property
    def _stacked(self) -> StackedResiduals:
        return StackedResiduals(self.mechanism, self.relative_motions)

    def residuals(
        self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Array]], u: Array | None = None
    ) -> Array:
        """How far every constraint is open (constraints, samples): lengths of the size, or rad; see `row_pairs`.

        Frames with cos and sin made from their angles, floats or arrays (samples,). `u` (inputs, ...) are the
        positions of the inputs, else the mechanism's own. What is not a number counts as infinitely open.
        """
        positions = [given.position for given in self.mechanism.inputs] if u is None else u
        coordinates = self._stacked.stack(frames, own, positions)
        gaps = self._evaluate(coordinates)
        # the round-off of an angle, and of where its cos and sin put things, grows with the turns that it counts
        turns = coordinates.greatest_angle(self.unit) / (2.0 * pi)
        with np.errstate(invalid="ignore"):  # of what is not finite
            angles = self._stacked.is_angle
            gaps[angles] = closing_error(gaps[angles], MeasureKind.ANGLE)
            gaps = np.abs(gaps) / self._row_units / np.maximum(1.0, np.where(np.isfinite(turns), turns, 1.0))
        return np.nan_to_num(gaps, nan=np.inf, posinf=np.inf)

    def greatest_residual(
        self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[float]], u: Sequence[float]
    ) -> float:
        """How far the worst constraint is open at one position, in plain floats: arrays of one take five times as long.

        Raises ValueError, OverflowError or ZeroDivisionError where Python, other than numpy, has no number.
        """
        if len(self.mechanism.pairs) >= MIN_STACKED_PAIRS:
            return float(self.residuals(frames, own, np.array(u)).max(initial=0.0))  # type: ignore[arg-type]
        gaps = [
            abs(closing_error(left, kind)) / self._unit_of(kind) for (_, kind), left in self._residuals(frames, own, u)
        ]
        if not all(isfinite(gap) for gap in gaps):
            return inf
        counted = [abs(frame.angle) for frame in frames.values()]
        counted += [abs(length) / self.unit for lengths in own.values() for length in lengths]
        return max(gaps, default=0.0) / max(1.0, max(counted, default=0.0) / (2.0 * pi))

    def find_open_contact(
        self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]]
    ) -> tuple[str, float] | None:
        """The first contact that guides have to keep closed and do not: its pair and the gap (m).

        No gap but a rate of it: the contact is closed in passing only.
        """
        for pair in self.mechanism.pairs:
            gap = pair.contact_gap(self.numbers[pair.name], own[pair.name])
            if not isinstance(gap, Jet):
                continue
            for order, part in enumerate(gap.parts):
                scale = self.unit * (self._greatest_rate(frames, own, order) if order else 1.0)
                if np.nanmax(np.abs(part) / scale, initial=0.0) > CONTACT_TOLERANCE:
                    return pair.name, float(np.max(np.abs(gap.parts[0])))
        return None

    def rate_residuals(
        self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]], inputs: Sequence[Jet] | None = None
    ) -> list[tuple[Array, str]]:
        """How far velocities, then accelerations, break the worst constraint, as a part of its own terms; its pair.

        Of jets of arrays, an array. `inputs` are the inputs with their rates, else the mechanism's own.
        """
        u = [Jet(*given[1:4]) for given in self.mechanism.inputs] if inputs is None else inputs
        coordinates = self._stacked.stack(frames, own, u)
        rates = self._evaluate(coordinates)
        if not isinstance(rates, Jet):
            return [(np.zeros(1), "")] * 2
        sizes = self._evaluate(coordinates.term_sizes())
        units, lengths = self._row_units, self._stacked.is_length
        worst_rates: list[tuple[Array, str]] = []
        with np.errstate(all="ignore"):  # of what is not finite
            for order in (1, 2):
                # a velocity counts as one in an arc of the size: what turning leaves there but for rounding is none
                speeds = [(sizes.parts[k][lengths] / self.unit) ** (order / k) for k in range(1, order + 1)]
                carried = CARRIED_ROUNDING * np.max([speed.max(axis=0, initial=0.0) for speed in speeds], axis=0)
                scale = _row_scale(sizes.parts[order], carried * units)
                gaps = np.nan_to_num(np.abs(rates.parts[order]) / scale, nan=np.inf)
                worst = int(np.argmax(gaps.max(axis=1, initial=0.0)))
                worst_rates.append((gaps.max(axis=0), self.row_pairs[worst]))
        return worst_rates

    def _greatest_rate(self, frames: Mapping[str, Frame], own: Mapping[str, Sequence[Jet]], order: int) -> Array:
        """The greatest rate of an order (lengths of the size), what a velocity makes of itself in an arc included.

        A velocity along a line counts as one in an arc of the size: what turning leaves there but for rounding is none.
        """
        rates = [np.zeros(1)]
        for frame in frames.values():
            if not frame.fixed:
                for value, size in ((frame.angle, 1.0), (frame.x, self.unit), (frame.y, self.unit)):
                    rates += [(np.abs(value.parts[k]) / size) ** (order / k) for k in range(1, order + 1)]
        rates += [np.abs(jet.parts[order]) / self.unit for each in own.values() for jet in each]
        greatest = np.maximum.reduce(np.broadcast_arrays(*rates))
        return np.where(greatest == 0.0, 1.0, greatest)

    def _evaluate(self, coordinates: StackedCoordinates) -> Scalar:
        """The residuals (constraints, samples), an array or a jet; rows that may stay open count as closed."""
        residuals = self._stacked.evaluate(coordinates, self.numbers)
        for part in residuals.parts if isinstance(residuals, Jet) else (residuals,):
            part[list(self.open_rows)] *= 0.0
        return residuals

    @property
    def _row_units(self) -> Array:
        """What residuals are judged in units of (constraints, 1)."""
        return np.where(self._stacked.is_length, self.unit, 1.0)[:, None]

    def _unit_of(self, kind: MeasureKind) -> float:
        return self.unit if kind is MeasureKind.LENGTH else 1.0

    def _residuals(
        self, frames: Frames, own: PairValues, u: Iterable[Scalar] | None = None
    ) -> Iterator[tuple[ConstraintRow, Scalar]]:
        """The residuals of all pairs, then of all inputs, with their rows: floats, arrays or jets alike."""
        inputs = self.mechanism.inputs
        for k, (row, left) in enumerate(pair_residuals(self.mechanism.pairs, frames, self.numbers, own)):
            yield row, left * 0.0 if k in self.open_rows else left
        motions = [self.relative_motions[given.pair] for given in inputs]
        yield from input_residuals(
            motions, frames, self.numbers, own, [given.position for given in inputs] if u is None else u
        )


def _row_scale(whole: Array, carried: Array) -> Array:
    """What a row that should vanish is divided by; one where nothing moves."""
    scale = whole + carried
    return np.where(scale == 0.0, 1.0, scale)


def _lengths(pair: Pair, numbers: Sequence[float]) -> list[float]:
    return [value for value, kind in zip(numbers, pair.number_kinds, strict=True) if kind is MeasureKind.LENGTH]
