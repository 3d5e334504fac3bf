"""The search of a catalogue: candidates for the item that tells most, brought near to all that is wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.matching.curve_search import LEAST_CLOSED, arc_candidates, closed_curve_candidates, some_places
from planar.synthesis.matching.followed_items import with_followed_item
from planar.synthesis.matching.match_problem import MatchProblem, MatchState, unit_numbers
from planar.synthesis.matching.move_fit import fit_moves, with_distances
from planar.synthesis.matching.sample_search import is_in_order, nearest_samples
from planar.synthesis.matching.timed_search import timed_candidates
from planar.synthesis.matching.wanted_entries import Entries, FunctionEntries, PathEntries, PoseEntries

STAGES = ((1500, 1, 9, 0.3), (600, 3, 7, 0.1), (300, 5, 5, 0.01))
"""How many candidates are brought near, in how many rounds, how far samples may go in each (whole samples), and what
part of a miss along the path counts."""
MOST_FOLLOWED = 600
"""Candidates for which the samples of other items are looked for."""
NEAR_ALIKE = 0.06
"""Of the size of what is wanted: designs whose links come as near to one another throughout are taken for one."""


def find_candidates(problem: MatchProblem, random: np.random.Generator) -> MatchState:
    """The candidates nearest to what is wanted, of least distance first."""
    item = max(range(len(problem.wanted)), key=lambda k: _weight(problem.wanted[k]))
    state = _first_candidates(problem, item, STAGES[0][0], random)
    others = [k for k in range(len(problem.wanted)) if k != item]
    state = fit_moves(problem, state)
    for stage, (many, rounds, reach, along) in enumerate(STAGES):
        state = improve(problem, state.nearest(many), rounds, reach, along)
        if stage == 0 and others:
            state = state.select(np.isfinite(state.distance)).nearest(MOST_FOLLOWED)
            for other in others:
                state = with_followed_item(problem, state, other)
            state = fit_moves(problem, state)
    state = state.select(np.isfinite(state.distance))
    kept = _keeps_orders(problem, state)
    return state.select(kept if kept.any() else np.ones_like(kept)).nearest(len(state.design))


def improve(problem: MatchProblem, state: MatchState, rounds: int, reach: int, along: float) -> MatchState:
    """Candidates as they were best in so many rounds, in each of which samples are looked for anew, and then moves."""
    best = state
    for _ in range(rounds):
        samples = list(state.samples)
        for item, entries in enumerate(problem.wanted):
            if isinstance(entries, FunctionEntries) or entries.inputs is not None:
                continue
            if samples[item].shape[1]:
                samples[item] = nearest_samples(problem, state, item, reach if entries.in_order else None)
        # misses by samples that are nearest are what a move leaves
        here = with_distances(problem, state._replace(samples=tuple(samples)))
        best = best.with_better(here)
        state = fit_moves(problem, here, along)
    return best.with_better(state)


def spread_choice(problem: MatchProblem, state: MatchState, many: int) -> IntArray:
    """So many of the candidates, of least distance first, that are not all but alike; where there are not enough, the
    nearest of the others as well."""
    seen, chosen, alike = _motions_seen(problem, state), list[int](), list[int]()
    for k in range(len(state.design)):
        off = np.abs(seen[chosen] - seen[k]).max(axis=1, initial=0.0)
        (chosen if (off > NEAR_ALIKE).all() else alike).append(k)
        if len(chosen) == many:
            break
    return np.sort([*chosen, *alike[: many - len(chosen)]]).astype(int)


def _motions_seen(problem: MatchProblem, state: MatchState) -> Array:
    """Where all links are at the first entry, at one in the middle and at the last (n, numbers), in sizes of what is
    wanted; what is far away counts less."""
    samples = next(each for each in state.samples if each.shape[1])
    picked = samples[:, sorted({0, samples.shape[1] // 2, samples.shape[1] - 1})]
    factor, offset = state.factor[:, None], state.offset[:, None]
    found = []
    for link in range(len(problem.catalogue.links)):
        origin, turn = problem.frames(link, state.design, picked)
        at = (factor * origin + offset) / problem.size
        found += [at / (1.0 + np.abs(at)), 0.5 * turn * unit_numbers(factor)]
    every = np.concatenate(found, axis=1)
    seen: Array = np.nan_to_num(np.concatenate([every.real, every.imag], axis=1))
    return seen


def _keeps_orders(problem: MatchProblem, state: MatchState) -> BoolArray:
    """The candidates that meet what is to be met in order so."""
    found = np.ones(len(state.design), dtype=bool)
    closed, count = problem.catalogue.motions.is_closed[state.design], problem.catalogue.sample_count
    for entries, samples in zip(problem.wanted, state.samples, strict=True):
        if not isinstance(entries, FunctionEntries) and entries.in_order and samples.shape[1]:
            found &= is_in_order(samples, closed, count)
    return found


def _weight(entries: Entries) -> float:
    """How much an item tells of a design."""
    told = 3 if isinstance(entries, PoseEntries) else 2 if isinstance(entries, PathEntries) else 1
    return told * len(entries.weights)


def _first_candidates(problem: MatchProblem, item: int, many: int, random: np.random.Generator) -> MatchState:
    entries = problem.wanted[item]
    if not isinstance(entries, PathEntries) or entries.inputs is not None:
        return timed_candidates(problem, item, many)
    if entries.is_closed and len(entries.places) >= LEAST_CLOSED:
        return closed_curve_candidates(problem, item, many)
    if entries.in_order:
        return arc_candidates(problem, item, many, random)
    some = some_places(entries)
    fewer = entries._replace(places=entries.places[some], weights=entries.weights[some])
    part = replace(problem, wanted=(fewer,))
    state = fit_moves(part, arc_candidates(part, 0, many, random))
    every = nearest_samples(replace(problem, wanted=(entries,)), state, 0, None)
    none = np.zeros((len(every), 0))
    return state._replace(samples=tuple(every if k == item else none for k in range(len(problem.wanted))))
