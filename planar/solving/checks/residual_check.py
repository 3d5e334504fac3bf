"""The residual check that every answer passes: is every constraint closed, are its rates?

It knows nothing of elimination or Newton: it runs the pairs' own formulas on plain numbers (`constraint_check`). The
second part, since the residual of a flipped linkage is zero too, is `branch_check`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from functools import cached_property

import numpy as np

from planar.equations.constraint_check import ORDERS, ConstraintCheck, constraint_check
from planar.equations.mechanism_numbers import pair_numbers_from
from planar.equations.residuals import Frames, PairValues
from planar.foundation.arrays import Array
from planar.foundation.jets import Jet, Scalar, value_and_rates
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
        there = copy(self)
        there.mechanism = mechanism
        return there

    def of_designs(self, p: Array) -> ResidualCheck:
        """The same of designs, each with its own p (numbers, designs), whose frames are in lengths of the size."""
        there = copy(self)
        there.unit, there.p = 1.0, p
        return there

    @cached_property
    def p(self) -> Array:
        """The numbers of all pairs, lengths in sizes."""
        return pair_numbers_from(self.mechanism, self.numbers, self.unit)

    @cached_property
    def _check(self) -> ConstraintCheck:
        own_count = sum(len(pair.coordinate_kinds) for pair in self.mechanism.pairs)
        moving_count = sum(link.name != self.mechanism.frame for link in self.mechanism.links)
        return constraint_check(self.mechanism, 3 * moving_count + own_count)

    def _motion(self, frames: Frames, own: PairValues, inputs: Sequence[Scalar] | Array, orders: int) -> Array:
        """Links, pairs and inputs, values and rates up to `orders` (orders, entries, samples), lengths in sizes."""
        values: list[tuple[Scalar, float]] = []
        for link in self.mechanism.links:
            if link.name != self.mechanism.frame:
                frame = frames[link.name]
                values += [(frame.x, self.unit), (frame.y, self.unit), (frame.angle, 1.0)]
        for pair in self.mechanism.pairs:
            kinds = (kind for _, kind in pair.coordinate_kinds)
            values += [(value, self._unit_of(kind)) for value, kind in zip(own.get(pair.name, ()), kinds, strict=True)]
        kinds = (self.relative_motions[given.pair].input_kind for given in self.mechanism.inputs)
        values += [(value, self._unit_of(kind)) for value, kind in zip(inputs, kinds, strict=True)]
        rates = [(value_and_rates(value)[:orders], unit) for value, unit in values]
        count = max((np.size(part) for parts, _ in rates for part in parts), default=1)
        motion: Array = np.zeros((orders, len(values), count))
        for entry, (parts, unit) in enumerate(rates):
            for order, part in enumerate(parts):
                motion[order, entry] = part
            motion[:, entry] /= unit
        return motion

    def residuals(self, frames: Frames, own: PairValues, u: Sequence[Scalar] | Array | None = None) -> Array:
        """How far every constraint is open (constraints, samples): lengths of the size, or rad; see `row_pairs`.

        Frames of floats or arrays (samples,), whose cos and sin are made afresh from their angles. `u` (inputs, ...)
        are the positions of the inputs, else the mechanism's own. What is not a number counts as infinitely open.
        """
        motion = self._motion(frames, own, [given.position for given in self.mechanism.inputs] if u is None else u, 1)
        with np.errstate(all="ignore"):  # of what is not finite
            gaps = self._check.residuals(self._check.evaluate(motion, self.p), motion)
        gaps[list(self.open_rows)] *= 0.0
        return np.nan_to_num(gaps, nan=np.inf, posinf=np.inf)

    def find_open_contact(self, frames: Frames, own: PairValues) -> tuple[str, float] | None:
        """The first contact that guides have to keep closed and do not: its pair and the gap (m).

        No gap but a rate of it: the contact is closed in passing only.
        """
        if all(type(pair).contact_gap is Pair.contact_gap for pair in self.mechanism.pairs):
            return None
        motion = self._motion(frames, own, [given.position for given in self.mechanism.inputs], ORDERS)
        with np.errstate(all="ignore"):  # of what is not finite
            evaluated = self._check.evaluate(motion, self.p)
            scales = self._check.contact_scales(evaluated, motion)
            for name, gap in evaluated.gaps:
                if np.nanmax(np.abs(gap) / scales, initial=0.0) > CONTACT_TOLERANCE:
                    return name, float(np.max(np.abs(gap[0]))) * self.unit
        return None

    def rate_residuals(
        self, frames: Frames, own: PairValues, inputs: Sequence[Jet] | None = None
    ) -> list[tuple[Array, str]]:
        """How far velocities, then accelerations, break the worst constraint, as a part of its own terms; its pair.

        Of jets of arrays, an array. `inputs` are the inputs with their rates, else the mechanism's own.
        """
        u = [Jet(*given[1:4]) for given in self.mechanism.inputs] if inputs is None else inputs
        worst_rates: list[tuple[Array, str]] = []
        with np.errstate(all="ignore"):  # of what is not finite
            for errors in self._check.rate_errors(self._check.evaluate(self._motion(frames, own, u, ORDERS), self.p)):
                errors[list(self.open_rows)] *= 0.0
                gaps = np.nan_to_num(errors, nan=np.inf)
                worst = int(np.argmax(gaps.max(axis=1, initial=0.0))) if len(gaps) else -1
                worst_rates.append((gaps.max(axis=0, initial=0.0), self.row_pairs[worst] if worst >= 0 else ""))
        return worst_rates

    def _unit_of(self, kind: MeasureKind) -> float:
        return self.unit if kind is MeasureKind.LENGTH else 1.0


def _lengths(pair: Pair, numbers: Sequence[float]) -> list[float]:
    return [value for value, kind in zip(numbers, pair.number_kinds, strict=True) if kind is MeasureKind.LENGTH]
