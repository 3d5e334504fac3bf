"""The residuals of all pairs and inputs, stacked in one place for every arithmetic that the pairs' formulas take.

Frames, own coordinates, numbers p and inputs u may be floats, arrays, jets, sizes of terms or casadi expressions, in
any unit, so that a residual can be differentiated by each of them. The order of the rows is that of the pairs in the
mechanism, then that of its inputs.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.foundation.angles import wrap_angle
from planar.foundation.geometry import Frame
from planar.foundation.jets import Scalar, cos, sin
from planar.foundation.lazy_module import LazyModule
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # known types of elements and blocks do without expressions

CARRIED_ROUNDING = 1e-3
"""The rates of a constraint are judged by its own terms, and by this part of the greatest speed anywhere: some rounding
of that is carried round a loop into terms that are small, as where a link comes to rest."""
Frames = Mapping[str, Frame]
"""Of every link."""
PairValues = Mapping[str, Sequence[Scalar]]
"""Of every pair: its numbers, or its own coordinates."""


class ConstraintRow(NamedTuple):
    """One constraint: of a pair, or of an input at it."""

    pair: str
    kind: MeasureKind


def scalars(values: ca.SX | Sequence[Scalar]) -> Sequence[Scalar]:
    """The entries of a column, one by one."""
    if isinstance(values, Sequence | np.ndarray):
        return values
    return ca.vertsplit(values) if values.numel() else []


def split_pair_numbers(pairs: Iterable[Pair], p: ca.SX | Sequence[Scalar]) -> dict[str, list[Scalar]]:
    """The numbers p of each pair, by its name; of an array (numbers, ...) its rows."""
    numbers = iter(scalars(p))
    return {pair.name: [next(numbers) for _ in pair.number_kinds] for pair in pairs}


def pair_arguments(
    pair: Pair, frames: Frames, numbers: PairValues, own_values: PairValues
) -> tuple[list[Frame], Sequence[Scalar], Sequence[Scalar]]:
    """What a pair's formulas take; a relative motion that no pair stands for has neither numbers nor coordinates."""
    return [frames[link] for link in pair.bodies], numbers.get(pair.name, ()), own_values.get(pair.name, ())


def pair_residuals(
    pairs: Iterable[Pair], frames: Frames, numbers: PairValues, own_values: PairValues
) -> Iterator[tuple[ConstraintRow, Scalar]]:
    """The residual of every constraint of some pairs, with what it is: lengths in the unit of the frames, or rad."""
    for pair in pairs:
        values = pair.residual(*pair_arguments(pair, frames, numbers, own_values))
        for kind, value in zip(pair.residual_kinds, values, strict=True):
            yield ConstraintRow(pair.name, kind), value


def input_positions(pairs: Iterable[Pair], frames: Frames, numbers: PairValues, own_values: PairValues) -> list[Scalar]:
    """The positions of relative motions (m or rad, as the frames are)."""
    return [pair.input_position(*pair_arguments(pair, frames, numbers, own_values)) for pair in pairs]


def input_residuals(
    pairs: Sequence[Pair], frames: Frames, numbers: PairValues, own_values: PairValues, u: Iterable[Scalar]
) -> Iterator[tuple[ConstraintRow, Scalar]]:
    """The positions of relative motions less those that they are to have."""
    for pair, position, target in zip(pairs, input_positions(pairs, frames, numbers, own_values), u, strict=True):
        yield ConstraintRow(pair.name, pair.input_kind), position - target


def residuals(
    mechanism: Mechanism, frames: Frames, numbers: PairValues, own_values: PairValues, u: ca.SX | Sequence[Scalar]
) -> Iterator[tuple[ConstraintRow, Scalar]]:
    """The residual of every constraint and every input of a mechanism; u are the positions of the inputs alone."""
    motions = relative_motions(mechanism)
    yield from pair_residuals(mechanism.pairs, frames, numbers, own_values)
    driven = [motions[motion.pair] for motion in mechanism.inputs]
    yield from input_residuals(driven, frames, numbers, own_values, scalars(u))


def closing_error(residual: Scalar, kind: MeasureKind) -> Scalar:
    """What is judged of a residual: of an angle that closes modulo a turn |sin| + 1 - cos, else it as it is.

    That needs no arc, is zero where the angle is a whole number of turns only, and near there the angle's size.
    """
    return abs(sin(residual)) + 1.0 - cos(residual) if kind is MeasureKind.ANGLE else residual


def wrapped_residual(residual: Scalar, kind: MeasureKind) -> Scalar:
    """A residual with its sign: an angle that closes modulo a turn between half a turn and minus that."""
    return wrap_angle(residual) if kind is MeasureKind.ANGLE else residual
