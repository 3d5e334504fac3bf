"""The residual check on samples of positions, with their rates or without, in lengths of the size.

Every constraint is judged by its pair's own formula, which is recorded together with its rates and the sizes of its
terms; pairs of equal formula are computed at once, on arrays with a row for each pair.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from math import pi
from typing import NamedTuple

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.coordinates import consecutive_ranges
from planar.equations.elements import PARTS_OF_FRAME, pair_formula, recorded_pair_formula
from planar.equations.residuals import CARRIED_ROUNDING, closing_error
from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import GROUND, Frame, frame_term_sizes
from planar.foundation.jets import Jet, Scalar, TermSizes, cos, sin, term_sizes, value_and_rates
from planar.foundation.recorded_formula import (
    RecordedFormula,
    RecordedNumber,
    elementwise,
    greatest_entries,
    record_formula,
)
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair

ORDERS = 3
"""A value, its first and its second rate."""
RESULTS_OF_ROW = ORDERS + 2
"""What a constraint leaves open with its rates, then the sizes of the terms of the two rates."""
MAX_RECORDED_CHECKS = 1024
MAX_STACKED_NUMBERS = 2**14
"""Numbers (pairs times samples) of an array that is computed with: larger ones are computed in parts."""
MAX_CACHED_CHECKS = 64


class ConstraintRows(NamedTuple):
    """What constraints leave open at samples, with the frames (orders, 5, links, samples) that it was computed from.

    `rows` (orders, constraints, samples): the values, and with rates the first and the second of them; then `sizes` (2,
    constraints, samples) are those of the terms of the two rates. `gaps` of contacts (orders, samples), each by its
    pair.
    """

    rows: Array
    sizes: Array
    gaps: list[tuple[str, Array]]
    frames: Array


class _GroupKey(NamedTuple):
    """What is equal of pairs that are computed together."""

    formula: RecordedFormula
    is_input: bool
    is_moving: tuple[bool, ...]
    "whether a body moves"
    counts: tuple[int, int]
    "of own coordinates and numbers"


@dataclass(eq=False)
class _PairGroup:
    """Pairs whose residuals, or positions as inputs, are computed together by the formula of one of them.

    Indices (entries, pairs): `bodies` of links, `rows` of constraints, `own` of (w, u) and `inputs` (pairs,) of it as
    well, `numbers` of p.
    """

    key: _GroupKey
    pair: Pair
    names: tuple[str, ...]
    bodies: IntArray
    rows: IntArray
    own_columns: IntArray
    inputs: IntArray
    numbers: IntArray

    @cached_property
    def check(self) -> FormulaFunction:
        """The formula with both rates and the sizes of their terms."""
        return self._recorded(ORDERS)

    @cached_property
    def value_check(self) -> FormulaFunction:
        """The formula of values alone."""
        return self._recorded(1)

    def _recorded(self, orders: int) -> FormulaFunction:
        """The formula, recorded once for all groups of equal ones."""
        key = self.key, type(self.pair), orders
        if key not in _RECORDED_CHECKS:
            if len(_RECORDED_CHECKS) >= MAX_RECORDED_CHECKS:
                _RECORDED_CHECKS.clear()
            _RECORDED_CHECKS[key] = _record_check(self, orders)
        return _RECORDED_CHECKS[key]

    def parts(self, samples: int) -> Iterator[slice]:
        """The pairs in parts, so that arrays stay small."""
        size = max(1, MAX_STACKED_NUMBERS // samples)
        for first in range(0, self.rows.shape[1], size):
            yield slice(first, first + size)

    def evaluate(self, part: slice, frames: Array, motion: Array, p: Array) -> tuple[Array, Array]:
        """What the constraints of some pairs leave open (results, constraints, pairs, samples), and the gaps of
        contacts (gaps, orders, pairs, samples)."""
        orders, samples = motion.shape[0], motion.shape[-1]
        shape = self.rows[:, part].shape[1], samples
        positions = shape[0] * samples

        def entries(values: Array) -> Array:
            return values.reshape(-1, positions)

        arguments = [entries(frames[:, :, body[part]]) for body in self.bodies]
        arguments += [entries(motion[:, self.own_columns[:, part]]), entries(motion[:, self.inputs[part]])]
        numbers = p[self.numbers[:, part]]
        arguments.append(entries(numbers if p.ndim > 1 else np.repeat(numbers[..., None], samples, axis=-1)))
        check = self.value_check if orders == 1 else self.check
        results = check.evaluate_entries(positions, *arguments)
        count = 1 if orders == 1 else RESULTS_OF_ROW
        split = count * len(self.rows)
        return results[:split].reshape(count, len(self.rows), *shape), results[split:].reshape(-1, orders, *shape)


_RECORDED_CHECKS: dict[Hashable, FormulaFunction] = {}


class ConstraintCheck:
    """The constraints of pairs, then of inputs, between these moving links, of coordinates w and inputs u with rates.

    In w the parts of all links come first, then the pairs' own coordinates; behind all coordinates stand the inputs.
    """

    def __init__(self, pairs: Sequence[Pair], inputs: Sequence[Pair], moving: Sequence[str], coordinate_count: int):
        kinds = [kind for pair in pairs for kind in pair.residual_kinds] + [pair.input_kind for pair in inputs]
        self._lengths = np.flatnonzero([kind is MeasureKind.LENGTH for kind in kinds])
        self._angles = np.flatnonzero([kind is MeasureKind.ANGLE for kind in kinds])
        self._row_count, self._link_count = len(kinds), len(moving)
        self._coordinate_count = coordinate_count
        own_count = sum(len(pair.coordinate_kinds) for pair in pairs)
        self._own = slice(3 * len(moving), 3 * len(moving) + own_count)
        self.groups = self._make_groups(pairs, inputs, moving)

    def _make_groups(self, pairs: Sequence[Pair], inputs: Sequence[Pair], moving: Sequence[str]) -> list[_PairGroup]:
        links = {link: k for k, link in enumerate(moving)}
        own_columns = consecutive_ranges({pair.name: len(pair.coordinate_kinds) for pair in pairs}, 3 * len(moving))
        numbers = consecutive_ranges({pair.name: len(pair.number_kinds) for pair in pairs})
        members: dict[_GroupKey, list[tuple[Pair, range, int]]] = {}
        row = 0
        for k, pair in enumerate((*pairs, *inputs)):
            is_input = k >= len(pairs)
            rows = range(row, row + (1 if is_input else len(pair.residual_kinds)))
            row = rows.stop
            is_moving = tuple(link in links for link in pair.bodies)
            counts = len(own_columns.get(pair.name, ())), len(pair.number_kinds)
            key = _GroupKey(recorded_pair_formula(pair, is_input, is_moving, *counts), is_input, is_moving, counts)
            members.setdefault(key, []).append((pair, rows, self._coordinate_count + k - len(pairs)))
        groups = []
        for key, group in members.items():
            pair = group[0][0]
            groups.append(
                _PairGroup(
                    key,
                    pair,
                    tuple(member.name for member, *_ in group),
                    _index_columns([[links[link] for link in member.bodies if link in links] for member, *_ in group]),
                    _index_columns([rows for _, rows, _ in group]),
                    _index_columns([own_columns.get(member.name, ()) for member, *_ in group]),
                    np.array([column for *_, column in group if key.is_input], dtype=int),
                    # the relative motion of an input that no pair stands for has no numbers, nor does it need any
                    _index_columns([numbers.get(member.name, [0] * len(pair.number_kinds)) for member, *_ in group]),
                )
            )
        return groups

    def evaluate(self, motion: Array, p: Array) -> ConstraintRows:
        """What samples of (w, u) leave open, alone (1, entries, samples) or with their rates (3, entries, samples).

        p are the numbers (numbers,), or (numbers, samples) where they differ.
        """
        orders, samples = motion.shape[0], motion.shape[-1]
        links = motion[:, : 3 * self._link_count].reshape(orders, self._link_count, 3, samples)
        frames = _frames(links.swapaxes(1, 2))
        rows: Array = np.zeros((1 if orders == 1 else RESULTS_OF_ROW, self._row_count, samples), dtype=motion.dtype)
        gaps: list[tuple[str, Array]] = []
        for group in self.groups if samples else ():
            for part in group.parts(samples):
                rows[:, group.rows[:, part]], of_contacts = group.evaluate(part, frames, motion, p)
                names = group.names[part]
                gaps += [(names[k], gap[:, k]) for gap in of_contacts for k in range(len(names))]
        rows[0, self._angles] = closing_error(rows[0, self._angles], MeasureKind.ANGLE)
        return ConstraintRows(rows[:orders], rows[orders:], gaps, frames)

    def judge(self, motion: Array, p: Array) -> tuple[Array, Array, Array, Array, Array]:
        """Judge samples of (w, u) with their rates (3, entries, samples): residual, finite sum, velocity error,
        acceleration error and contact gap (samples,), see `AcceptanceResult`."""
        evaluated = self.evaluate(motion, p)
        residual = greatest_entries(self.residuals(evaluated, motion))
        velocity, acceleration = map(greatest_entries, self.rate_errors(evaluated))
        contact: Array = 0.0 * residual
        if evaluated.gaps:
            scales = self.contact_scales(evaluated, motion)
            contact = greatest_entries(np.concatenate([np.abs(gap) / scales for _, gap in evaluated.gaps]))
        return residual, evaluated.rows.sum(axis=(0, 1)), velocity, acceleration, contact

    def residuals(self, evaluated: ConstraintRows, motion: Array) -> Array:
        """How far constraints are open (constraints, samples), beside the turns that angles count.

        The round-off of an angle, and of where its cos and sin put things, grows with them.
        """
        counted = np.concatenate([np.abs(evaluated.frames[0, 4]), np.abs(motion[0, self._own])])
        turns = greatest_entries(counted) / (2.0 * pi)
        return np.abs(evaluated.rows[0]) / greatest_entries(np.stack([turns, 0.0 * turns + 1.0]))

    def rate_errors(self, evaluated: ConstraintRows) -> tuple[Array, Array]:
        """How far first and second rates break constraints, as parts of their terms (constraints, samples)."""
        # a velocity counts as one in an arc of the size: what turning leaves there but for rounding is none
        first, second = evaluated.sizes
        speed = greatest_entries(first[self._lengths])
        of_second = greatest_entries(np.concatenate([second[self._lengths], (speed * speed)[None]]))
        return (
            np.abs(evaluated.rows[1]) / _nonzero(first + CARRIED_ROUNDING * speed),
            np.abs(evaluated.rows[2]) / _nonzero(second + CARRIED_ROUNDING * of_second),
        )

    def contact_scales(self, evaluated: ConstraintRows, motion: Array) -> Array:
        """What gaps of contacts and their rates are parts of (3, samples)."""
        coordinates = np.abs(motion[:, : self._coordinate_count])
        greatest = greatest_entries(coordinates[1])
        arcs = evaluated.frames[1, 4] * evaluated.frames[1, 4]
        of_arcs = greatest_entries(np.concatenate([coordinates[2], arcs]))
        return np.stack([0.0 * greatest + 1.0, _nonzero(greatest), _nonzero(of_arcs)])


def constraint_check(mechanism: Mechanism, coordinate_count: int) -> ConstraintCheck:
    """The constraints of a mechanism of so many coordinates; mechanisms of equal pairs share them."""
    motions = relative_motions(mechanism)
    inputs = tuple(motions[driven.pair] for driven in mechanism.inputs)
    moving = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
    pairs = tuple(mechanism.pairs)
    try:
        return _cached_check(pairs, inputs, moving, coordinate_count)
    except TypeError:  # made in Python, of lists
        return ConstraintCheck(pairs, inputs, moving, coordinate_count)


_cached_check = lru_cache(maxsize=MAX_CACHED_CHECKS)(ConstraintCheck)


def _index_columns(indices: Sequence[Sequence[int]]) -> IntArray:
    """Indices (pairs, entries) as columns (entries, pairs)."""
    columns: IntArray = np.array([list(row) for row in indices], dtype=int).reshape(len(indices), -1).T
    return columns


def _nonzero(scale: Array) -> Array:
    """What is divided by; one where nothing moves."""
    return elementwise(lambda size: size + 1.0 * (size <= 0.0), scale)


def _frames(coordinates: Array) -> Array:
    """x, y, cos, sin and angle of links with their rates (orders, 5, links, samples), from x, y and angle of them.

    cos and sin are made afresh from the angle.
    """
    angle = coordinates[0, 2]
    cosine, sine = elementwise(cos, angle), elementwise(sin, angle)
    frames: Array = np.empty((len(coordinates), PARTS_OF_FRAME, *angle.shape), dtype=coordinates.dtype)
    frames[:, :2], frames[:, 4] = coordinates[:, :2], coordinates[:, 2]
    frames[0, 2], frames[0, 3] = cosine, sine
    if len(coordinates) == ORDERS:
        first, second = coordinates[1:, 2]
        square = first * first
        frames[1, 2], frames[1, 3] = -sine * first, cosine * first
        frames[2, 2], frames[2, 3] = -sine * second - cosine * square, cosine * second - sine * square
    return frames


def _record_check(group: _PairGroup, orders: int) -> FormulaFunction:
    pair, is_input, has_rates = group.pair, group.key.is_input, orders == ORDERS
    counts = [orders * PARTS_OF_FRAME] * len(group.bodies)
    counts += [orders * len(group.own_columns), orders * is_input, len(pair.number_kinds)]
    stops = np.cumsum(counts)

    def jets(entries: Sequence[RecordedNumber], sizes: bool) -> list[Scalar]:
        if not has_rates:
            return list(entries)
        values = [Jet(*entries[k :: len(entries) // ORDERS]) for k in range(len(entries) // ORDERS)]
        return [term_sizes(value) for value in values] if sizes else values

    def formula(arguments: Sequence[RecordedNumber]) -> list[Scalar]:
        parts = [arguments[end - count : end] for count, end in zip(counts, stops, strict=True)]
        numbers = parts[-1]

        def values(sizes: bool) -> tuple[list[Scalar], list[Scalar]]:
            """The residuals, and what is own of the pair."""
            moving = iter(parts[:-3])
            frames = []
            for moves in group.key.is_moving:
                x, y, cosine, sine, angle = jets(next(moving), sizes) if moves else GROUND[:5]
                is_sized = moves and sizes
                frames.append(
                    frame_term_sizes(x, y, angle) if is_sized else Frame(x, y, cosine, sine, angle, not moves)
                )
            own_coordinates = jets(parts[-3], sizes)
            residuals = pair_formula(pair, is_input)(frames, numbers, own_coordinates)
            positions = jets(parts[-2], sizes) if is_input else [0.0] * len(residuals)
            return [value - position for value, position in zip(residuals, positions, strict=True)], own_coordinates

        residuals, own_coordinates = values(False)
        if not has_rates:
            return residuals
        terms, _ = values(True)
        rows = [[*value_and_rates(value)] for value in residuals]
        sizes = [value.parts[1:] if isinstance(value, TermSizes) else (0.0, 0.0) for value in terms]
        gap = pair.contact_gap(numbers, own_coordinates) if not is_input else 0.0
        results = [[*row, *size] for row, size in zip(rows, sizes, strict=True)]
        by_result = [row[k] for k in range(RESULTS_OF_ROW) for row in results]
        return [*by_result, *(gap.parts if isinstance(gap, Jet) else ())]

    recorded = record_formula(formula, int(stops[-1]))
    return FormulaFunction(recorded, counts, ((1, len(recorded.results)),))
