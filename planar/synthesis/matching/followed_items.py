"""When candidates, moved as one item has it, come nearest to what else is wanted."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import ComplexArray
from planar.synthesis.matching.curve_index import CurveIndex
from planar.synthesis.matching.match_problem import MatchProblem, MatchState
from planar.synthesis.matching.sample_search import nearest_samples
from planar.synthesis.matching.timed_search import best_trials, given_inputs
from planar.synthesis.matching.wanted_entries import FunctionEntries, PathEntries


def with_followed_item(problem: MatchProblem, state: MatchState, item: int) -> MatchState:
    """The candidates with the samples at which an item is met best as they are moved, and the place of its point."""
    entries = problem.wanted[item]
    if isinstance(entries, PathEntries) and entries.point not in state.places:
        own = problem.points[entries.point].coordinates[state.design].astype(complex)
        state = state._replace(places={**state.places, entries.point: own})
    if given_inputs(problem, entries) is not None or isinstance(entries, FunctionEntries):
        return _with_samples(state, item, best_trials(problem, entries, state.design, state).samples)
    if not isinstance(entries, PathEntries) or not problem.points[entries.point].is_free:
        return _with_samples(state, item, nearest_samples(problem, state, item, None))
    best = np.full(len(state.design), np.inf)
    samples, places = np.zeros((len(best), len(entries.places))), state.places[entries.point].copy()
    for tried in _tried_places(problem.curves[entries.point], state):
        trial = state._replace(places={**state.places, entries.point: tried})
        found = nearest_samples(problem, trial, item, None)
        origin, turn = problem.frames(problem.link(entries), state.design, found)
        at = state.factor[:, None] * (origin + turn * tried[:, None]) + state.offset[:, None]
        square = np.abs(at - entries.places) ** 2 @ entries.weights
        better = square < best
        best[better], samples[better], places[better] = square[better], found[better], tried[better]
    return _with_samples(state._replace(places={**state.places, entries.point: places}), item, samples)


def _with_samples(state: MatchState, item: int, samples: np.ndarray) -> MatchState:
    return state._replace(samples=tuple(samples if k == item else each for k, each in enumerate(state.samples)))


def _tried_places(curves: CurveIndex, state: MatchState) -> list[ComplexArray]:
    """The places of a free point that were chosen on the candidates' links."""
    order = np.argsort(curves.design, kind="stable")
    each = len(order) // (int(curves.design.max()) + 1)
    rows = order.reshape(-1, each)[state.design]
    return list(curves.coordinates[rows.T].astype(complex))
