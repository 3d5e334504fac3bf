"""How candidates are moved best, and where their free points lie best, once it is known when they meet each entry.

A place of a link, moved as a whole, is a (o + r c) + b: linear in a, b and a c. So all of them follow from one linear
least-squares problem (variable projection), weakly held at what they were where places do not tell them. Where an entry
is met is free along the path: a miss along it hardly counts, which is what eliminating that place leaves to the first
order.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray
from planar.synthesis.matching.match_problem import MatchProblem, MatchState, unit_numbers
from planar.synthesis.matching.wanted_entries import (
    Entries,
    FunctionEntries,
    PathEntries,
    PoseEntries,
    entry_weights,
)

HOLD = 1e-5
"""Of the squares of a column: how much what was there before counts."""
FARTHEST_FACTOR = 25.0
"""Sizes of what is wanted: larger mechanisms are no match."""
LEAST_FACTOR = 1e-9


class _Rows(NamedTuple):
    """Real rows of entries: slopes (n, entries, rows, 2 columns) in the real, then in the imaginary parts of a, b and
    the a c; what they are to be (n, entries, rows), weights (entries,), and how what they tell goes on along the path;
    None where it may not."""

    slopes: Array
    goals: Array
    weights: Array
    along: Array | None


def fit_moves(problem: MatchProblem, state: MatchState, along: float = 1.0) -> MatchState:
    """The candidates with the best moves and places of free points for their samples, and their distances.

    Of a miss along the path the part `along` counts: far from the end steps of less go too far.
    """
    free = [name for name in state.places if problem.points[name].is_free]
    if not free and not problem.can_move:
        return with_distances(problem, state)
    found = _solve(problem, state, free, along)
    held = dict(found.places)
    changed: BoolArray = np.zeros(len(state.design), dtype=bool)
    for name in free:
        held[name] = problem.points[name].nearest_allowed(state.design, found.places[name])
        changed |= np.abs(held[name] - found.places[name]) > 1e-9 * problem.size
    found = found._replace(places=held)
    if problem.can_move and changed.any():
        again = _solve(problem, found.select(changed), [], along)
        factor, offset = found.factor.copy(), found.offset.copy()
        factor[changed], offset[changed] = again.factor, again.offset
        found = found._replace(factor=factor, offset=offset)
    return with_distances(problem, found)


def with_distances(problem: MatchProblem, state: MatchState) -> MatchState:
    """The candidates with their distances: root mean squares of misses, in sizes of what is wanted, and in rad."""
    square, weight = np.zeros(len(state.design)), 0.0
    for entries, samples in zip(problem.wanted, state.samples, strict=True):
        if samples.shape[1]:
            own = np.abs(item_misses(problem, state, entries, samples)) ** 2
            square += own @ entries.weights
            weight += float(entries.weights.sum())
    reach = np.abs(state.factor) * problem.catalogue_scale
    wrong = ~np.isfinite(square) | (reach > FARTHEST_FACTOR * problem.size) & problem.can_move
    return state._replace(distance=np.where(wrong, np.inf, np.sqrt(np.where(wrong, 0.0, square) / (weight or 1.0))))


def item_misses(problem: MatchProblem, state: MatchState, entries: Entries, samples: Array) -> Array:
    """How far candidates miss the entries (n, entries) of one item, in sizes of what is wanted, or rad."""
    if isinstance(entries, FunctionEntries):
        off = problem.values(entries.to_pair, state.design, samples) - entries.values
        middle = np.zeros(len(off)) if entries.is_absolute else off @ entry_weights(entries)
        return (off - middle[:, None]) / problem.value_scale(entries.to_pair)
    origin, turn = problem.frames(problem.link(entries), state.design, samples)
    factor, offset = state.factor[:, None], state.offset[:, None]
    if isinstance(entries, PathEntries):
        origin = origin + turn * state.places[entries.point][:, None]
    off = np.abs(factor * origin + offset - entries.places) / problem.size
    if isinstance(entries, PathEntries):
        return off
    turned: Array = np.abs(turn * unit_numbers(factor) - np.exp(1j * entries.angles))
    return np.hypot(off, turned)


def _solve(problem: MatchProblem, state: MatchState, free: Sequence[str], along: float) -> MatchState:
    """The least-squares solution, whatever bounds there are."""
    before = np.stack([state.factor, state.offset, *(state.factor * state.places[name] for name in free)], axis=1)
    held = np.concatenate([before.real, before.imag], axis=1)
    width = before.shape[1]
    sought = np.tile(np.arange(width) >= (0 if problem.can_move else 2), 2)  # else a is 1 and b is 0
    square = np.zeros((len(before), 2 * width, 2 * width))
    right = np.zeros((len(before), 2 * width))
    for rows in _rows(problem, state, free):
        slopes, goals = _without_along(rows, along)
        weighed = slopes.swapaxes(1, 2) * np.repeat(rows.weights, slopes.shape[1] // len(rows.weights))
        square += weighed @ slopes
        right += (weighed @ (goals - (slopes @ held[..., None])[..., 0])[..., None])[..., 0]
    square, right = square[:, sought][:, :, sought], right[:, sought]
    index = np.arange(square.shape[1])
    square[:, index, index] = square[:, index, index] * (1.0 + HOLD) + 1e-30
    held[:, sought] += np.linalg.solve(square, right[..., None])[..., 0]
    found = held[:, :width] + 1j * held[:, width:]
    factor = np.where(np.abs(found[:, 0]) > LEAST_FACTOR, found[:, 0], LEAST_FACTOR)
    places = dict(state.places) | {name: found[:, 2 + k] / factor for k, name in enumerate(free)}
    return state._replace(factor=factor, offset=found[:, 1], places=places)


def _without_along(rows: _Rows, share: float) -> tuple[Array, Array]:
    """Slopes (n, rows, columns) and what they are to be, with a share left of what is along the path; those of
    candidates that are no numbers are nothing."""
    slopes, goals = rows.slopes, rows.goals
    good: BoolArray = np.asarray(np.isfinite(slopes).all(axis=(1, 2, 3)) & np.isfinite(goals).all(axis=(1, 2)))
    if rows.along is not None:
        way = rows.along / np.maximum(np.linalg.norm(rows.along, axis=2, keepdims=True), 1e-300)
        slopes = slopes - (1.0 - share) * way[..., None] * np.einsum("ner,nerc->nec", way, slopes)[:, :, None]
        goals = goals - (1.0 - share) * way * np.sum(way * goals, axis=2, keepdims=True)
    slopes, goals = np.where(good[:, None, None, None], slopes, 0.0), np.where(good[:, None, None], goals, 0.0)
    return slopes.reshape(len(slopes), -1, slopes.shape[3]), goals.reshape(len(goals), -1)


def _rows(problem: MatchProblem, state: MatchState, free: Sequence[str]) -> Iterator[_Rows]:
    for entries, samples in zip(problem.wanted, state.samples, strict=True):
        if isinstance(entries, FunctionEntries) or not samples.shape[1]:
            continue
        link, factor = problem.link(entries), state.factor[:, None]
        origin, turn = problem.frames(link, state.design, samples)
        origins, turns = problem.frame_steps(link, state.design, samples)
        columns = np.zeros((*origin.shape, 2 + len(free)), dtype=complex)
        columns[..., 0], columns[..., 1] = origin, 1.0
        along = factor * origins
        if isinstance(entries, PathEntries):
            place = state.places[entries.point][:, None]
            along = along + factor * turns * place
            if entries.point in free:
                columns[..., 2 + free.index(entries.point)] = turn
            else:
                columns[..., 0] += turn * place
        slopes = np.stack(
            [
                np.concatenate([columns.real, -columns.imag], axis=2),
                np.concatenate([columns.imag, columns.real], axis=2),
            ],
            axis=2,
        )
        goals, way = _parts(np.broadcast_to(entries.places, origin.shape)), _parts(along)
        if isinstance(entries, PoseEntries):
            # of a the direction alone counts: it changes by i Im(da / a) of itself
            unit = problem.size * unit_numbers(factor)
            directions = np.zeros_like(slopes)
            by_turn, per = _parts(1j * turn * unit), 1.0 / np.maximum(np.abs(factor), LEAST_FACTOR) ** 2
            directions[..., 0] = -by_turn * (per * factor.imag)[..., None]
            directions[..., columns.shape[2]] = by_turn * (per * factor.real)[..., None]
            wanted = problem.size * np.exp(1j * entries.angles) - turn * unit
            slopes = np.concatenate([slopes, directions], axis=2)
            goals, way = (
                np.concatenate([goals, _parts(wanted)], axis=2),
                np.concatenate([way, _parts(turns * unit)], axis=2),
            )
        yield _Rows(slopes, goals, entries.weights, way if entries.inputs is None else None)


def _parts(numbers: ComplexArray) -> Array:
    """Real and imaginary parts (..., 2)."""
    return np.stack([numbers.real, numbers.imag], axis=-1)
