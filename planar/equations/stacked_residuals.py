"""The residuals of a mechanism on plain numbers, pairs of equal formula computed together.

Pairs have equal formulas where these perform the same operations between links of which the same are the frame. What
is computed is the formula of one of them as its type has it, on arrays with a row for each pair.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planar.equations.pair_formulas import pair_formula, recorded_pair_formula
from planar.equations.residuals import Frames, PairValues
from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import GROUND, Frame, frame_term_sizes
from planar.foundation.jets import Jet, Scalar, TermSizes, term_sizes, value_and_rates
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair

MAX_STACKED_NUMBERS = 2**14
"""Numbers (pairs times samples) of an array that is computed with: larger ones are computed in parts."""
MAX_CACHED_GROUPINGS = 64


class StackedCoordinates(NamedTuple):
    """What residuals are computed from: the frames of the moving links (links, samples), the pairs' own coordinates
    (own coordinates, samples) and the positions of the inputs (inputs, samples), arrays or jets of arrays."""

    frames: Frame
    own: Scalar
    inputs: Scalar

    @property
    def sample_count(self) -> int:
        """The samples of all together."""
        arrays = (array for value in (*self.frames[:5], *self[1:]) for array in _arrays_of(value))
        return max((array.shape[-1] for array in arrays if isinstance(array, np.ndarray)), default=1)

    def greatest_angle(self, unit: float) -> Array:
        """The greatest angle of all links, or own coordinate in such units (samples,)."""
        sizes = [np.fmax.reduce(np.abs(value), axis=0, initial=0.0) for value in (self.frames.angle, self.own / unit)]
        return np.fmax(*sizes)

    def frame_of(self, links: IntArray) -> Frame:
        """The frames of some links by their indices."""
        return Frame(*(_rows_of(part, links) for part in self.frames[:5]))

    def term_sizes(self) -> StackedCoordinates:
        """The sizes of the terms of all, which are jets."""
        frames, own, inputs = self
        sizes = frame_term_sizes(*(_term_sizes(part) for part in (frames.x, frames.y, frames.angle)))
        return StackedCoordinates(sizes, _term_sizes(own), _term_sizes(inputs))


class PairGroup(NamedTuple):
    """Pairs whose residuals, or positions as inputs, are computed together by the formula of one of them."""

    key: Hashable
    "equal where the formula is"
    pair: Pair
    is_input: bool
    is_moving: tuple[bool, ...]
    "whether a body moves"
    names: tuple[str, ...]
    bodies: IntArray
    "(moving bodies, pairs): indices of links"
    own: IntArray
    "(own coordinates, pairs)"
    rows: IntArray
    "(constraints, pairs)"

    def parts(self, size: int) -> Iterator[PairGroup]:
        """Groups of at most so many of its pairs."""
        for start in range(0, len(self.names), size):
            part = slice(start, start + size)
            yield self._replace(
                names=self.names[part], bodies=self.bodies[:, part], own=self.own[:, part], rows=self.rows[:, part]
            )

    def evaluate(self, coordinates: StackedCoordinates, numbers: PairValues) -> Sequence[Scalar]:
        """The values of the formula, an array (pairs, samples) or a jet of arrays for each constraint."""
        moving = iter(self.bodies)
        frames = [coordinates.frame_of(next(moving)) if moves else GROUND for moves in self.is_moving]
        columns = zip(*(numbers.get(name, ()) for name in self.names), strict=True)
        own = [_rows_of(coordinates.own, indices) for indices in self.own]
        return pair_formula(self.pair, self.is_input)(frames, [_stack(column) for column in columns], own)


class StackedResiduals:
    """The residuals of all pairs and inputs of a mechanism; the rows are those of `residuals`."""

    def __init__(self, mechanism: Mechanism, motions: Mapping[str, Pair]):
        inputs = tuple(motions[given.pair] for given in mechanism.inputs)
        self._moving = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
        self._pairs = mechanism.pairs
        self._groups = pair_groups(tuple(mechanism.pairs), inputs, self._moving)
        kinds = [kind for pair in mechanism.pairs for kind in pair.residual_kinds]
        self._pair_row_count = len(kinds)
        kinds += [pair.input_kind for pair in inputs]
        self.is_length, self.is_angle = (
            np.array([kind is wanted for kind in kinds], dtype=bool)
            for wanted in (MeasureKind.LENGTH, MeasureKind.ANGLE)
        )
        "of every row"

    def stack(self, frames: Frames, own: PairValues, u: Iterable[Scalar]) -> StackedCoordinates:
        """Frames of links, own coordinates of pairs and positions of inputs: floats, arrays (samples,), jets."""
        moving = [frames[link] for link in self._moving]
        return StackedCoordinates(
            Frame(*(_stack([frame[part] for frame in moving]) for part in range(5))),
            _stack([value for pair in self._pairs for value in own.get(pair.name, ())]),
            _stack(list(u)),
        )

    def evaluate(self, coordinates: StackedCoordinates, numbers: PairValues) -> Scalar:
        """The residuals (constraints, samples), an array or a jet of arrays; not finite where they are undefined."""
        size = max(1, MAX_STACKED_NUMBERS // max(1, coordinates.sample_count))
        residuals: list[tuple[IntArray, Scalar]] = []
        with np.errstate(all="ignore"):
            for group in self._groups:
                for part in group.parts(size):
                    values = part.evaluate(coordinates, numbers)
                    if part.is_input:
                        (position,) = values
                        values = [position - _rows_of(coordinates.inputs, part.rows[0] - self._pair_row_count)]
                    residuals += zip(part.rows, values, strict=True)
        return _join_rows(residuals, len(self.is_length))


def pair_groups(pairs: tuple[Pair, ...], inputs: tuple[Pair, ...], moving: tuple[str, ...]) -> tuple[PairGroup, ...]:
    """Pairs, then inputs, of a mechanism with these moving links, that are computed together."""
    try:
        hash(pairs)
    except TypeError:  # made in Python, of lists
        return _make_groups(pairs, inputs, moving)
    return _cached_groups(pairs, inputs, moving)


def _make_groups(pairs: tuple[Pair, ...], inputs: tuple[Pair, ...], moving: tuple[str, ...]) -> tuple[PairGroup, ...]:
    links = {link: k for k, link in enumerate(moving)}
    own: dict[str, range] = {}
    own_count = 0
    for pair in pairs:
        own[pair.name] = range(own_count, own_count + len(pair.coordinate_kinds))
        own_count += len(pair.coordinate_kinds)
    members: dict[Hashable, list[tuple[Pair, bool, tuple[bool, ...], range]]] = {}
    row = 0
    for k, pair in enumerate((*pairs, *inputs)):
        is_input = k >= len(pairs)
        rows = range(row, row + (1 if is_input else len(pair.residual_kinds)))
        row = rows.stop
        is_moving = tuple(link in links for link in pair.bodies)
        counts = len(own.get(pair.name, ())), len(pair.number_kinds)
        key = recorded_pair_formula(pair, is_input, is_moving, *counts), is_input, is_moving, counts
        members.setdefault(key, []).append((pair, is_input, is_moving, rows))
    groups = []
    for formula, group in members.items():
        pair, is_input, is_moving, _ = group[0]
        groups.append(
            PairGroup(
                formula,
                pair,
                is_input,
                is_moving,
                tuple(each.name for each, *_ in group),
                index_columns([[links[link] for link in each.bodies if link in links] for each, *_ in group]),
                index_columns([own.get(each.name, ()) for each, *_ in group]),
                index_columns([rows for *_, rows in group]),
            )
        )
    return tuple(groups)


_cached_groups = lru_cache(maxsize=MAX_CACHED_GROUPINGS)(_make_groups)


def index_columns(indices: Sequence[Sequence[int]]) -> IntArray:
    """Indices (pairs, entries) as columns (entries, pairs)."""
    columns: IntArray = np.array([list(row) for row in indices], dtype=int).reshape(len(indices), -1).T
    return columns


def _stack(values: Sequence[Scalar]) -> Scalar:
    """Floats or arrays (samples,) as an array (values, samples), jets as the jet of such arrays."""
    jets = [value for value in values if isinstance(value, Jet)]
    if jets:
        return type(jets[0])(*(_stack(part) for part in zip(*map(value_and_rates, values), strict=True)))
    if not len(values):
        return np.zeros((0, 1))
    try:
        stacked = np.array(values, dtype=float)
    except ValueError:  # of different shapes
        stacked = np.array(np.broadcast_arrays(*values), dtype=float)
    return stacked.reshape(len(values), -1)


def _rows_of(value: Scalar, indices: IntArray) -> Scalar:
    if isinstance(value, Jet):
        return type(value)(*(_rows_of(part, indices) for part in value.parts))
    return value[indices] if isinstance(value, np.ndarray) else value


def _term_sizes(value: Scalar) -> Scalar:
    return term_sizes(value) if isinstance(value, Jet) else TermSizes(abs(value), 0.0, 0.0)


def _join_rows(rows: Sequence[tuple[IntArray, Scalar]], count: int) -> Scalar:
    """Values of rows, given by their indices, as one array (rows, samples) or jet of arrays."""
    jets = [value for _, value in rows if isinstance(value, Jet)]
    if jets:
        parts = zip(*(value_and_rates(value) for _, value in rows), strict=True)
        indices = [index for index, _ in rows]
        return type(jets[0])(*(_join_rows(list(zip(indices, part, strict=True)), count) for part in parts))
    joined = np.empty((count, max((np.shape(value)[-1] for _, value in rows if np.ndim(value)), default=1)))
    for index, value in rows:
        joined[index] = value
    return joined


def _arrays_of(value: Scalar) -> tuple[Scalar, ...]:
    return value.parts if isinstance(value, Jet) else (value,)
