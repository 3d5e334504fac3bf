"""Candidates for what is wanted at given inputs: every zero of their scale is tried, and for each the best move.

Where free points lie on their link is part of the move: a (o + r c) + b is linear in a, b and a c. Of the square of
what is wanted, without its middle, that is left which neither r nor, beside it, o can give.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import pi
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.synthesis.matching.clock_search import clocked_samples
from planar.synthesis.matching.match_problem import MatchProblem, MatchState, unit_numbers
from planar.synthesis.matching.wanted_entries import Entries, FunctionEntries, PathEntries, PoseEntries

LEAST_SHARE = 1e-6
"""Of a square, that is taken for none: what it stands for says nothing."""


class SampleTrial(NamedTuple):
    """Samples (n, entries) of designs; where these say so the mechanism has to be `turned` (n,) (rad) for them."""

    samples: Array
    turned: Array | None = None


def given_inputs(problem: MatchProblem, entries: Entries) -> Array | None:
    """Positions (n,) of the running input at the entries, None where they are not given."""
    if not isinstance(entries, FunctionEntries):
        return entries.inputs
    return entries.given if entries.from_pair == problem.input_pair else None


def timed_candidates(problem: MatchProblem, item: int, many: int) -> MatchState:
    """The designs that meet an item best whose samples follow from its inputs, angles or given values alone."""
    entries, count = problem.wanted[item], len(problem.catalogue)
    found = best_trials(problem, entries, np.arange(count), None)
    chosen = np.argsort(found.square, kind="stable")[:many]
    chosen = chosen[np.isfinite(found.square[chosen])]
    none = np.zeros((len(chosen), 0))
    samples = tuple(found.samples[chosen] if k == item else none for k in range(len(problem.wanted)))
    places = {}
    if isinstance(entries, PathEntries):
        places[entries.point] = problem.points[entries.point].coordinates[chosen].astype(complex)
    offset = np.zeros(len(chosen), dtype=complex)
    return MatchState(chosen, samples, found.factor[chosen], offset, places, np.full(len(chosen), np.inf))


class BestTrials(NamedTuple):
    """Of designs the least mean squares (n,), the samples (n, entries) that have them, and the factors of the moves."""

    square: Array
    samples: Array
    factor: ComplexArray


def best_trials(problem: MatchProblem, entries: Entries, design: IntArray, state: MatchState | None) -> BestTrials:
    """The best samples of designs (n,), each moved as is best, or as the candidates of a `state` are."""
    best = np.full(len(design), np.inf)
    found, factor = np.zeros((len(design), len(entries.weights))), np.ones(len(design), dtype=complex)
    with np.errstate(invalid="ignore"):  # beyond the ends of motions nothing is a number
        for trial in _trials(problem, entries, design, state is None):
            square, told = _least_squares(problem, entries, design, trial, state)
            better = square < best
            best[better], found[better], factor[better] = square[better], trial.samples[better], told[better]
    return BestTrials(best, found, factor)


def _trials(problem: MatchProblem, entries: Entries, design: IntArray, may_turn: bool) -> Iterator[SampleTrial]:
    """Samples of designs (n,) at which the inputs are as they are given, from every zero of their scale."""
    motions, count = problem.catalogue.motions, problem.catalogue.sample_count
    given = given_inputs(problem, entries)
    if given is None:
        yield from map(SampleTrial, clocked_samples(problem, entries, design, may_turn))
        return
    first, step = motions.first_input[design], motions.input_step[design]
    if not entries.is_absolute:
        off = (given - given[0]) / step[:, None]
        for start in range(count):
            yield SampleTrial(start + off)
    elif may_turn and problem.can_move and problem.turns_with_frame:
        for start in range(count):
            turned = given[0] - first - start * step
            yield SampleTrial((given - first[:, None] - turned[:, None]) / step[:, None], turned)
    else:
        off = (given - first[:, None]) / step[:, None]
        # an angle may have been counted from another turn on
        turns = np.zeros_like(off) if problem.is_sliding else np.floor(off * step[:, None] / (2.0 * pi) + 1e-9)
        yield SampleTrial(off - turns[:, :1] * 2.0 * pi / step[:, None])


def _least_squares(
    problem: MatchProblem, entries: Entries, design: IntArray, trial: SampleTrial, state: MatchState | None
) -> tuple[Array, ComplexArray]:
    """The least mean squares (n,) that any move leaves, or that of a state, and its factors."""
    weights = entries.weights / entries.weights.sum()
    ones = np.ones(len(design), dtype=complex)
    if isinstance(entries, FunctionEntries):
        off = problem.values(entries.to_pair, design, trial.samples) - entries.values
        if not entries.is_absolute:
            off = off - (off @ weights)[:, None]
        return off**2 @ weights, ones
    origin, turn = problem.frames(problem.link(entries), design, trial.samples)
    target: ComplexArray = np.broadcast_to(entries.places, origin.shape)
    is_free = isinstance(entries, PathEntries) and problem.points[entries.point].is_free
    if isinstance(entries, PathEntries) and not is_free:
        origin = origin + turn * problem.points[entries.point].coordinates[design, None]
    if state is not None or not problem.can_move:
        factor, offset = (ones, 0.0 * ones) if state is None else (state.factor, state.offset)
        left: ComplexArray = (target - offset[:, None]) / factor[:, None] - origin
        if is_free:
            left = left - turn * _product(turn, left, weights)[:, None]
        square = np.abs(factor) ** 2 * (np.abs(left) ** 2 @ weights)
        return square + _angle_square(problem, entries, turn, factor, weights), factor
    target, origin, own = (each - (each @ weights)[:, None] for each in (target, origin, turn))
    if is_free:
        size = np.maximum(_product(own, own, weights).real, LEAST_SHARE)
        target = target - own * (_product(own, target, weights) / size)[:, None]
        origin = origin - own * (_product(own, origin, weights) / size)[:, None]
    product, power = _product(origin, target, weights), _product(origin, origin, weights).real
    if trial.turned is not None:
        product = np.maximum((product * np.exp(-1j * trial.turned)).real, 0.0) * np.exp(1j * trial.turned)
    elif isinstance(entries, PoseEntries):
        product = _turned_by_poses(problem, entries, turn, product, power, weights)
    factor = product / np.maximum(power, LEAST_SHARE * problem.catalogue_scale**2)
    square = np.abs(target - factor[:, None] * origin) ** 2 @ weights
    return square + _angle_square(problem, entries, turn, factor, weights), factor


def _angle_square(
    problem: MatchProblem, entries: Entries, turn: ComplexArray, factor: ComplexArray, weights: Array
) -> Array:
    """The mean squares (n,) by which poses are missed in angle, at the size of what is wanted."""
    if not isinstance(entries, PoseEntries):
        return np.zeros(len(turn))
    off = np.abs(turn * unit_numbers(factor)[:, None] - np.exp(1j * entries.angles))
    found: Array = problem.size**2 * (off**2 @ weights)
    return found


def _turned_by_poses(
    problem: MatchProblem, entries: PoseEntries, turn: ComplexArray, product: ComplexArray, power: Array, weights: Array
) -> ComplexArray:
    """The product of places with the turn that is best for places and angles together, near to what each would have."""
    angles = _product(turn, np.broadcast_to(np.exp(1j * entries.angles), turn.shape), weights)
    size = np.abs(product)
    places = size**2 / np.maximum(power, LEAST_SHARE * problem.catalogue_scale**2)
    both = places * unit_numbers(product) + problem.size**2 * angles
    way = unit_numbers(both)
    return np.maximum((product * way.conj()).real, 0.0) * way


def _product(one: ComplexArray, other: ComplexArray, weights: Array) -> ComplexArray:
    found: ComplexArray = (one.conj() * other) @ weights
    return found
