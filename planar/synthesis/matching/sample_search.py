"""When candidates come nearest to what is wanted: samples of their motions, and parts of steps between them."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.synthesis.matching.curve_index import design_curves
from planar.synthesis.matching.match_problem import MatchProblem, MatchState, unit_numbers
from planar.synthesis.matching.wanted_entries import FunctionEntries, PathEntries, PoseEntries

SLACK = 0.5
"""Of a step: by which samples that are to follow one another may go back."""


def nearest_samples(problem: MatchProblem, state: MatchState, item: int, reach: int | None) -> Array:
    """The samples (n, entries) at which an item's entries are met best: within `reach` of those that are there, or
    anywhere; between two whole ones by the straight line."""
    entries = problem.wanted[item]
    assert not isinstance(entries, FunctionEntries)
    paths, wanted = _moved_paths(problem, state, entries)
    motions, count = problem.catalogue.motions, problem.catalogue.sample_count
    closed, last = motions.is_closed[state.design][:, None, None], motions.sample_count[state.design][:, None, None] - 1
    shape = (len(state.design), len(entries.places))
    if reach is None or 2 * reach + 1 >= count:
        tried = np.broadcast_to(np.arange(count), (*shape, count))
    else:
        around = np.round(np.nan_to_num(state.samples[item])).astype(int)
        tried = around[:, :, None] + np.arange(-reach, reach + 1)

    def squares(samples: IntArray) -> Array:
        off = [np.abs(each - target[..., None]) for each, target in zip(at(samples), wanted, strict=True)]
        return np.asarray(sum(each**2 for each in off))

    def at(samples: IntArray) -> list[ComplexArray]:
        own = np.where(closed, samples % count, np.clip(samples, 0, last))
        rows = np.arange(len(own))[:, None, None]
        return [path[rows, own] for path in paths]

    off = squares(tried)
    pick = np.argmin(np.where(np.isnan(off), np.inf, off), axis=2)[..., None]
    best = np.take_along_axis(tried, pick, axis=2)
    if reach is not None:
        best = np.where(closed, best, np.clip(best, 0, last))
    found, least = np.zeros(shape), np.full(shape, np.inf)
    here = at(best)
    for side in (-1, 1):
        there = at(best + side)
        along, length = np.zeros(shape), np.zeros(shape)
        for one, other, target in zip(here, there, wanted, strict=True):
            way = (other - one)[..., 0]
            along += (way.conj() * (target - one[..., 0])).real
            length += np.abs(way) ** 2
        part = np.clip(along / np.where(length > 0.0, length, 1.0), 0.0, 1.0)
        left = sum(
            np.abs(one[..., 0] + part * (other - one)[..., 0] - target) ** 2
            for one, other, target in zip(here, there, wanted, strict=True)
        )
        better = left < least
        found, least = np.where(better, best[..., 0] + side * part, found), np.where(better, left, least)
    return found


def _moved_paths(
    problem: MatchProblem, state: MatchState, entries: PathEntries | PoseEntries
) -> tuple[list[ComplexArray], list[ComplexArray]]:
    """What comes near to what is wanted (n, samples): places, of poses also directions at their size; and the wanted
    (1, entries)."""
    link = problem.link(entries)
    factor, offset = (each[:, None] for each in (state.factor, state.offset))
    if isinstance(entries, PathEntries):
        own = design_curves(problem.catalogue, link, state.design, state.places[entries.point])
        return [factor * own + offset], [entries.places[None]]
    turns = problem.size * problem.directions(link)[state.design] * unit_numbers(factor)
    places = factor * problem.catalogue.motions.origins[link][state.design] + offset
    return [places, turns], [entries.places[None], problem.size * np.exp(1j * entries.angles)[None]]


def is_in_order(samples: Array, closed: BoolArray, count: int) -> BoolArray:
    """Whether samples (n, entries) follow one another, either way, and of `closed` motions (n,) within one round."""
    found = np.zeros(len(samples), dtype=bool)
    for sense in (1.0, -1.0):
        found |= (np.diff(_steps_on(samples, sense, closed, count), axis=1) >= -SLACK).all(axis=1)
    return found


def with_rounds(samples: Array, closed: BoolArray, count: int, in_order: bool) -> Array:
    """The samples (n, entries) with whole rounds of `closed` motions (n,) so that they go on one after the other, or
    within one round where they are in no order."""
    if not in_order:
        return np.where(closed[:, None], np.mod(samples, count), samples)
    ahead, back = (_steps_on(samples, sense, closed, count) for sense in (1.0, -1.0))
    falls = [np.minimum(np.diff(each, axis=1), 0.0).sum(axis=1) for each in (ahead, back)]
    return samples[:, :1] + np.where((falls[0] >= falls[1])[:, None], ahead, -back)


def _steps_on(samples: Array, sense: float, closed: BoolArray, count: int) -> Array:
    """How far on, in a sense, samples (n, entries) are from the first; going on over the end of a closed motion is
    going on, and a little back is none."""
    ahead = sense * (samples - samples[:, :1])
    return np.where(closed[:, None], np.mod(ahead + SLACK, count) - SLACK, ahead)
