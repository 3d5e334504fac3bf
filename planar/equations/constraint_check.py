"""The residual check on samples of positions with their rates, in lengths of the size: every constraint by its pair's
own formula, which is recorded together with its rates and the sizes of its terms, pairs of equal formula at once."""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from math import pi
from typing import NamedTuple

import numpy as np

from planar.codegen.printed_formula import FormulaFunction
from planar.equations.coordinates import FRAME_PARTS, Coordinate, coordinate_columns
from planar.equations.pair_formulas import PARTS_OF_FRAME, pair_formula
from planar.equations.residuals import CARRIED_ROUNDING, closing_error
from planar.equations.stacked_residuals import MAX_STACKED_NUMBERS, PairGroup, index_columns, pair_groups
from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import GROUND, Frame, frame_term_sizes
from planar.foundation.jets import Jet, Scalar, TermSizes, cos, sin, term_sizes, value_and_rates
from planar.foundation.recorded_formula import RecordedNumber, elementwise, greatest_entries, record_formula
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind

ORDERS = 3
"""A value, its first and its second rate."""
RESULTS_OF_ROW = ORDERS + 2
"""What a constraint leaves open with its rates, then the sizes of the terms of the two rates."""
MAX_RECORDED_CHECKS = 1024


class ConstraintJudgement(NamedTuple):
    """What is judged at samples (samples,): see `AcceptanceResult`."""

    residual: Array
    finite_sum: Array
    velocity_error: Array
    acceleration_error: Array
    contact_gap: Array


class _PlacedGroup(NamedTuple):
    """Pairs of equal formula: of (w, u) the `own` coordinates (own, pairs), `inputs` (pairs,), of p the `numbers`."""

    check: FormulaFunction
    bodies: IntArray
    own: IntArray
    numbers: IntArray
    inputs: IntArray
    rows: IntArray


class ConstraintCheck:
    """The constraints of one structure, of coordinates w and inputs u with their rates."""

    def __init__(self, mechanism: Mechanism, coordinates: Sequence[Coordinate]):
        motions = relative_motions(mechanism)
        inputs = tuple(motions[given.pair] for given in mechanism.inputs)
        links = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
        column = coordinate_columns(coordinates)
        self._frame_columns = np.array([[column[link, part] for link in links] for part in FRAME_PARTS], dtype=int)
        self._frame_columns = self._frame_columns.reshape(len(FRAME_PARTS), -1)
        own_columns = [column[pair.name, part] for pair in mechanism.pairs for part, _ in pair.coordinate_kinds]
        self._own = np.array(own_columns, dtype=int)
        numbers: dict[str, range] = {}
        count = 0
        for pair in mechanism.pairs:
            numbers[pair.name] = range(count, count + len(pair.number_kinds))
            count += len(pair.number_kinds)
        kinds = [kind for pair in mechanism.pairs for kind in pair.residual_kinds]
        pair_row_count = len(kinds)
        kinds += [pair.input_kind for pair in inputs]
        self._lengths = np.flatnonzero([kind is MeasureKind.LENGTH for kind in kinds])
        self._angles = np.flatnonzero([kind is MeasureKind.ANGLE for kind in kinds])
        self._row_count, self._coordinate_count = len(kinds), len(coordinates)
        self._groups = [
            _PlacedGroup(
                _recorded_check(group),
                group.bodies,
                self._own[group.own],
                # the relative motion of an input that no pair stands for has no numbers, nor does its formula need any
                index_columns([numbers.get(name, [0] * len(group.pair.number_kinds)) for name in group.names]),
                len(coordinates) + group.rows[0] - pair_row_count if group.is_input else np.zeros(0, dtype=int),
                group.rows,
            )
            for group in pair_groups(tuple(mechanism.pairs), inputs, links)
        ]

    def judge(self, motion: Array, p: Array) -> ConstraintJudgement:
        """Judge samples of (w, u) with their rates (3, entries, samples); p (numbers,)."""
        frames = _frames(motion[:, self._frame_columns])
        samples = motion.shape[-1]
        rows: Array = np.zeros((RESULTS_OF_ROW, self._row_count, samples), dtype=motion.dtype)
        gaps: list[Array] = []
        for group in self._groups:
            size = max(1, MAX_STACKED_NUMBERS // samples)
            for first in range(0, group.rows.shape[1], size):
                part = slice(first, first + size)
                results, of_contacts = _evaluate(group, part, frames, motion, p)
                rows[:, group.rows[:, part]] = results
                gaps += of_contacts
        return self._judgement(rows, gaps, motion, frames)

    def _judgement(self, rows: Array, gaps: list[Array], motion: Array, frames: Array) -> ConstraintJudgement:
        finite_sum = rows[:ORDERS].sum(axis=(0, 1))
        left = rows[0]
        left[self._angles] = closing_error(left[self._angles], MeasureKind.ANGLE)
        counted = np.concatenate([np.abs(frames[0, 4]), np.abs(motion[0, self._own])])
        residual = greatest_entries(np.abs(left)) / _at_least_one(greatest_entries(counted) / (2.0 * pi))
        # a velocity counts as one in an arc of the size: what turning leaves there but for rounding is none
        first, second = rows[ORDERS], rows[ORDERS + 1]
        speed = greatest_entries(first[self._lengths])
        of_second = greatest_entries(np.concatenate([second[self._lengths], (speed * speed)[None]]))
        velocity = greatest_entries(np.abs(rows[1]) / _nonzero(first + CARRIED_ROUNDING * speed))
        acceleration = greatest_entries(np.abs(rows[2]) / _nonzero(second + CARRIED_ROUNDING * of_second))
        contact: Array = 0.0 * residual
        if gaps:
            coordinates = np.abs(motion[:, : self._coordinate_count])
            greatest = greatest_entries(coordinates[1])
            of_arcs = greatest_entries(np.concatenate([coordinates[2], frames[1, 4] * frames[1, 4]]))
            scales = np.stack([0.0 * residual + 1.0, _nonzero(greatest), _nonzero(of_arcs)])
            contact = greatest_entries(np.concatenate([np.abs(gap) / scales for gap in gaps]))
        return ConstraintJudgement(residual, finite_sum, velocity, acceleration, contact)


def _nonzero(scale: Array) -> Array:
    """What is divided by; one where nothing moves."""
    return elementwise(lambda each: each + 1.0 * (each <= 0.0), scale)


def _at_least_one(values: Array) -> Array:
    return greatest_entries(np.stack([values, 0.0 * values + 1.0]))


def _frames(coordinates: Array) -> Array:
    """x, y, cos, sin and angle of links with their rates (3, 5, links, samples), from x, y and angle of them."""
    angle, first, second = coordinates[:, 2]
    cosine, sine = elementwise(cos, angle), elementwise(sin, angle)
    square = first * first
    frames: Array = np.empty((ORDERS, PARTS_OF_FRAME, *angle.shape), dtype=coordinates.dtype)
    frames[:, :2], frames[:, 4] = coordinates[:, :2], coordinates[:, 2]
    frames[0, 2], frames[0, 3] = cosine, sine
    frames[1, 2], frames[1, 3] = -sine * first, cosine * first
    frames[2, 2], frames[2, 3] = -sine * second - cosine * square, cosine * second - sine * square
    return frames


def _evaluate(group: _PlacedGroup, part: slice, frames: Array, motion: Array, p: Array) -> tuple[Array, list[Array]]:
    """What the constraints of some pairs of a group leave open (results, constraints, pairs, samples), and their
    contact gaps (3, samples)."""
    samples = motion.shape[-1]
    shape = group.rows[:, part].shape[1], samples
    positions = shape[0] * samples

    def entries(values: Array) -> Array:
        return values.reshape(-1, positions)

    arguments = [entries(frames[:, :, body[part]]) for body in group.bodies]
    arguments += [entries(motion[:, group.own[:, part]]), entries(motion[:, group.inputs[part]])]
    arguments.append(entries(np.repeat(p[group.numbers[:, part], None], samples, axis=-1)))
    results = group.check.evaluate_entries(positions, *arguments)
    split = RESULTS_OF_ROW * len(group.rows)
    rows = results[:split].reshape(RESULTS_OF_ROW, len(group.rows), *shape)
    gaps = results[split:].reshape(-1, ORDERS, *shape)
    return rows, [gap[:, k] for gap in gaps for k in range(shape[0])]


_RECORDED_CHECKS: dict[Hashable, FormulaFunction] = {}


def _recorded_check(group: PairGroup) -> FormulaFunction:
    """The check of a group's formula, recorded once."""
    key = group.key, type(group.pair)
    check = _RECORDED_CHECKS.get(key)
    if check is None:
        if len(_RECORDED_CHECKS) >= MAX_RECORDED_CHECKS:
            _RECORDED_CHECKS.clear()
        check = _RECORDED_CHECKS[key] = _record_check(group)
    return check


def _record_check(group: PairGroup) -> FormulaFunction:
    pair, is_input = group.pair, group.is_input
    counts = [ORDERS * PARTS_OF_FRAME] * len(group.bodies)
    counts += [ORDERS * len(group.own), ORDERS * is_input, len(pair.number_kinds)]
    ends = np.cumsum(counts)

    def jets(entries: Sequence[RecordedNumber], sizes: bool) -> list[Scalar]:
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
        terms, _ = values(True)
        rows = [[*value_and_rates(value)] for value in residuals]
        sizes = [value.parts[1:] if isinstance(value, TermSizes) else (0.0, 0.0) for value in terms]
        gap = pair.contact_gap(numbers, own) if not is_input else 0.0
        results = [[*row, *size] for row, size in zip(rows, sizes, strict=True)]
        by_result = [row[k] for k in range(RESULTS_OF_ROW) for row in results]
        return [*by_result, *(gap.parts if isinstance(gap, Jet) else ())]

    recorded = record_formula(formula, int(ends[-1]))
    return FormulaFunction(recorded, counts, ((1, len(recorded.results)),))
