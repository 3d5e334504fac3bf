"""The residual check on samples of positions, with their rates or without, in lengths of the size.

Every constraint is judged by its pair's own formula, which is recorded together with its rates and the sizes of its
terms; pairs of equal formula are computed at once, on arrays with a row for each pair.
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from functools import cached_property, lru_cache
from math import pi
from typing import NamedTuple

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.coordinates import FRAME_PARTS, consecutive_ranges
from planar.equations.elements import PARTS_OF_FRAME, pair_formula, recorded_pair_formula
from planar.equations.residuals import CARRIED_ROUNDING, closing_error
from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import GROUND, Frame, frame_term_sizes
from planar.foundation.jets import Jet, Scalar, TermSizes, cos, sin, term_sizes, value_and_rates
from planar.foundation.recorded_formula import RecordedNumber, elementwise, greatest_entries, record_formula
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair

ORDERS = 3
"""A value, its first and its second rate."""
RESULTS_OF_ROW = ORDERS + 2
"""What a constraint leaves open with its rates, then the sizes of the terms of the two rates."""
MAX_RECORDED_CHECKS = 1024
MAX_STACKED_NUMBERS = 2**14
"""Numbers (pairs times samples) of an array that is computed with: larger ones are computed in parts."""
MAX_CACHED_GROUPINGS = 64


class ConstraintJudgement(NamedTuple):
    """What is judged at samples (samples,): see `AcceptanceResult`."""

    residual: Array
    finite_sum: Array
    velocity_error: Array
    acceleration_error: Array
    contact_gap: Array


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


class _PairGroup(NamedTuple):
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

    def record(self, orders: int) -> FormulaFunction:
        """The formula for values alone (1), or with both rates and the sizes of their terms (3), recorded once."""
        key = self.key, type(self.pair), orders
        check = _RECORDED_CHECKS.get(key)
        if check is None:
            if len(_RECORDED_CHECKS) >= MAX_RECORDED_CHECKS:
                _RECORDED_CHECKS.clear()
            check = _RECORDED_CHECKS[key] = _record_check(self, orders)
        return check


_RECORDED_CHECKS: dict[Hashable, FormulaFunction] = {}


class _PlacedGroup:
    """Pairs of equal formula: of (w, u) the `own` coordinates (own, pairs), `inputs` (pairs,), of p the `numbers`."""

    def __init__(self, group: _PairGroup, own: IntArray, numbers: IntArray, inputs: IntArray):
        self.group, self.own, self.numbers, self.inputs = group, own, numbers, inputs
        self.bodies, self.rows = group.bodies, group.rows

    @cached_property
    def check(self) -> FormulaFunction:
        """With rates."""
        return self.group.record(ORDERS)

    @cached_property
    def value_check(self) -> FormulaFunction:
        """Of values alone."""
        return self.group.record(1)

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
        arguments += [entries(motion[:, self.own[:, part]]), entries(motion[:, self.inputs[part]])]
        numbers = p[self.numbers[:, part]]
        arguments.append(entries(numbers if p.ndim > 1 else np.repeat(numbers[..., None], samples, axis=-1)))
        check = self.value_check if orders == 1 else self.check
        results = check.evaluate_entries(positions, *arguments)
        count = 1 if orders == 1 else RESULTS_OF_ROW
        split = count * len(self.rows)
        return results[:split].reshape(count, len(self.rows), *shape), results[split:].reshape(-1, orders, *shape)


class ConstraintCheck:
    """The constraints of one structure, of coordinates w and inputs u with their rates.

    `column` says where in w the parts of links and the pairs' own coordinates stand; the inputs come after them.
    """

    def __init__(self, mechanism: Mechanism, column: Mapping[tuple[str, str], int]):
        motions = relative_motions(mechanism)
        inputs = tuple(motions[given.pair] for given in mechanism.inputs)
        links = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
        self._frame_columns = np.array([[column[link, part] for link in links] for part in FRAME_PARTS], dtype=int)
        self._frame_columns = self._frame_columns.reshape(len(FRAME_PARTS), -1)
        own_columns = [column[pair.name, part] for pair in mechanism.pairs for part, _ in pair.coordinate_kinds]
        self._own = np.array(own_columns, dtype=int)
        numbers = consecutive_ranges({pair.name: len(pair.number_kinds) for pair in mechanism.pairs})
        kinds = [kind for pair in mechanism.pairs for kind in pair.residual_kinds]
        pair_row_count = len(kinds)
        kinds += [pair.input_kind for pair in inputs]
        self._lengths = np.flatnonzero([kind is MeasureKind.LENGTH for kind in kinds])
        self._angles = np.flatnonzero([kind is MeasureKind.ANGLE for kind in kinds])
        self._row_count, self._coordinate_count = len(kinds), len(column)
        self._groups = [
            _PlacedGroup(
                group,
                self._own[group.own],
                # the relative motion of an input that no pair stands for has no numbers, nor does its formula need any
                _index_columns([numbers.get(name, [0] * len(group.pair.number_kinds)) for name in group.names]),
                len(column) + group.rows[0] - pair_row_count if group.is_input else np.zeros(0, dtype=int),
            )
            for group in _pair_groups(tuple(mechanism.pairs), inputs, links)
        ]

    def evaluate(self, motion: Array, p: Array) -> ConstraintRows:
        """What samples of (w, u) leave open, alone (1, entries, samples) or with their rates (3, entries, samples).

        p are the numbers (numbers,), or (numbers, samples) where they differ.
        """
        orders, samples = motion.shape[0], motion.shape[-1]
        frames = _frames(motion[:, self._frame_columns])
        rows: Array = np.zeros((1 if orders == 1 else RESULTS_OF_ROW, self._row_count, samples), dtype=motion.dtype)
        gaps: list[tuple[str, Array]] = []
        for group in self._groups if samples else ():
            for part in group.parts(samples):
                rows[:, group.rows[:, part]], of_contacts = group.evaluate(part, frames, motion, p)
                names = group.group.names[part]
                gaps += [(names[k], gap[:, k]) for gap in of_contacts for k in range(len(names))]
        rows[0, self._angles] = closing_error(rows[0, self._angles], MeasureKind.ANGLE)
        return ConstraintRows(rows[:orders], rows[orders:], gaps, frames)

    def judge(self, motion: Array, p: Array) -> ConstraintJudgement:
        """Judge samples of (w, u) with their rates (3, entries, samples)."""
        evaluated = self.evaluate(motion, p)
        residual = greatest_entries(self.residuals(evaluated, motion))
        velocity, acceleration = map(greatest_entries, self.rate_errors(evaluated))
        contact: Array = 0.0 * residual
        if evaluated.gaps:
            scales = self.contact_scales(evaluated, motion)
            contact = greatest_entries(np.concatenate([np.abs(gap) / scales for _, gap in evaluated.gaps]))
        return ConstraintJudgement(residual, evaluated.rows.sum(axis=(0, 1)), velocity, acceleration, contact)

    def residuals(self, evaluated: ConstraintRows, motion: Array) -> Array:
        """How far constraints are open (constraints, samples), beside the turns that angles count.

        The round-off of an angle, and of where its cos and sin put things, grows with them.
        """
        counted = np.concatenate([np.abs(evaluated.frames[0, 4]), np.abs(motion[0, self._own])])
        return np.abs(evaluated.rows[0]) / _at_least_one(greatest_entries(counted) / (2.0 * pi))

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


def _pair_groups(pairs: tuple[Pair, ...], inputs: tuple[Pair, ...], moving: tuple[str, ...]) -> tuple[_PairGroup, ...]:
    """Pairs, then inputs, of a mechanism with these moving links, that are computed together."""
    try:
        hash(pairs)
    except TypeError:  # made in Python, of lists
        return _make_groups(pairs, inputs, moving)
    return _cached_groups(pairs, inputs, moving)


def _make_groups(pairs: tuple[Pair, ...], inputs: tuple[Pair, ...], moving: tuple[str, ...]) -> tuple[_PairGroup, ...]:
    links = {link: k for k, link in enumerate(moving)}
    own = consecutive_ranges({pair.name: len(pair.coordinate_kinds) for pair in pairs})
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
            _PairGroup(
                formula,
                pair,
                is_input,
                is_moving,
                tuple(member.name for member, *_ in group),
                _index_columns([[links[link] for link in member.bodies if link in links] for member, *_ in group]),
                _index_columns([own.get(member.name, ()) for member, *_ in group]),
                _index_columns([rows for *_, rows in group]),
            )
        )
    return tuple(groups)


_cached_groups = lru_cache(maxsize=MAX_CACHED_GROUPINGS)(_make_groups)


def _index_columns(indices: Sequence[Sequence[int]]) -> IntArray:
    """Indices (pairs, entries) as columns (entries, pairs)."""
    columns: IntArray = np.array([list(row) for row in indices], dtype=int).reshape(len(indices), -1).T
    return columns


def _nonzero(scale: Array) -> Array:
    """What is divided by; one where nothing moves."""
    return elementwise(lambda each: each + 1.0 * (each <= 0.0), scale)


def _at_least_one(values: Array) -> Array:
    return greatest_entries(np.stack([values, 0.0 * values + 1.0]))


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
    pair, is_input, has_rates = group.pair, group.is_input, orders == ORDERS
    counts = [orders * PARTS_OF_FRAME] * len(group.bodies)
    counts += [orders * len(group.own), orders * is_input, len(pair.number_kinds)]
    ends = np.cumsum(counts)

    def jets(entries: Sequence[RecordedNumber], sizes: bool) -> list[Scalar]:
        if not has_rates:
            return list(entries)
        values = [Jet(*entries[k :: len(entries) // ORDERS]) for k in range(len(entries) // ORDERS)]
        return [term_sizes(value) for value in values] if sizes else values

    def formula(arguments: Sequence[RecordedNumber]) -> list[Scalar]:
        parts = [arguments[end - count : end] for count, end in zip(counts, ends, strict=True)]
        numbers = parts[-1]

        def values(sizes: bool) -> tuple[list[Scalar], list[Scalar]]:
            """The residuals, and what is own of the pair."""
            moving = iter(parts[:-3])
            frames = []
            for moves in group.is_moving:
                x, y, cosine, sine, angle = jets(next(moving), sizes) if moves else GROUND[:5]
                is_sized = moves and sizes
                frames.append(
                    frame_term_sizes(x, y, angle) if is_sized else Frame(x, y, cosine, sine, angle, not moves)
                )
            own = jets(parts[-3], sizes)
            residuals = pair_formula(pair, is_input)(frames, numbers, own)
            positions = jets(parts[-2], sizes) if is_input else [0.0] * len(residuals)
            return [value - position for value, position in zip(residuals, positions, strict=True)], own

        residuals, own = values(False)
        if not has_rates:
            return residuals
        terms, _ = values(True)
        rows = [[*value_and_rates(value)] for value in residuals]
        sizes = [value.parts[1:] if isinstance(value, TermSizes) else (0.0, 0.0) for value in terms]
        gap = pair.contact_gap(numbers, own) if not is_input else 0.0
        results = [[*row, *size] for row, size in zip(rows, sizes, strict=True)]
        by_result = [row[k] for k in range(RESULTS_OF_ROW) for row in results]
        return [*by_result, *(gap.parts if isinstance(gap, Jet) else ())]

    recorded = record_formula(formula, int(ends[-1]))
    return FormulaFunction(recorded, counts, ((1, len(recorded.results)),))
