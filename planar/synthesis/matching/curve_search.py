"""Candidates for a whole closed curve, and for places along an arc: by the shapes of curves."""

from __future__ import annotations

from collections.abc import Iterator
from itertools import permutations

import numpy as np

from planar.foundation.arrays import Array, ComplexArray, IntArray
from planar.synthesis.matching.curve_descriptors import align_curves, fourier_coefficients, lengths_along
from planar.synthesis.matching.curve_index import EVEN_POINTS, CurveIndex, design_curves, samples_at
from planar.synthesis.matching.match_problem import MatchProblem, MatchState
from planar.synthesis.matching.wanted_entries import PathEntries

LEAST_CLOSED = 8
"""Places round a closed curve at least, from which its shape is seen."""
SPLINE_POINTS = 160
"""At least, of a curve that is led through places."""
TRIALS = 256
"""Of where along the curves the places could be met."""
MOST_PLACES = 12
"""Of an arc, that are compared in these trials."""
MOST_ORDERS = 24
"""In which places may be met that are in none."""
SPANS = (0.1, 1.0)
"""Of a curve's length, between which the way from the first place to the last lies."""


def closed_curve_candidates(problem: MatchProblem, item: int, many: int) -> MatchState:
    """The candidates whose closed curves are most alike a wanted one, of least distance first."""
    entries = problem.wanted[item]
    assert isinstance(entries, PathEntries)
    curves = problem.curves[entries.point]
    outline = closed_spline(entries.places, SPLINE_POINTS)
    wanted = fourier_coefficients(outline[None], curves.coefficients.shape[1] // 2)[0]
    chosen, alignment = align_curves(wanted, curves.coefficients, problem.can_move, many)
    along = lengths_along(outline[None], True)[0]
    share = along[: -1 : len(outline) // len(entries.places)] / along[-1]
    sense = np.where(alignment.is_reversed, -1.0, 1.0)[:, None]
    shares = alignment.shift[:, None] + sense * share
    return _candidates(problem, item, curves, chosen, shares)


def arc_candidates(problem: MatchProblem, item: int, many: int, random: np.random.Generator) -> MatchState:
    """Candidates whose curves have arcs through the places of a path, by trials of where along the curves they lie."""
    entries = problem.wanted[item]
    assert isinstance(entries, PathEntries)
    curves = problem.curves[entries.point]
    some = some_places(entries)
    first_open = int(np.count_nonzero(curves.is_closed))
    found = []
    for part, is_closed in ((slice(0, first_open), True), (slice(first_open, None), False)):
        even = curves.even[:, part]
        if even.shape[1] and (is_closed or not entries.is_closed):
            orders = _orders(entries, some)
            trials = list(_trials(entries, orders, is_closed, random))
            score, pick = _best_trials(even, entries, trials, problem.can_move)
            best = np.argsort(score, kind="stable")[:many]
            shares = np.array([_all_shares(entries, trials[k][0], trials[k][1], is_closed) for k in pick[best]])
            found.append((best + (part.start or 0), score[best], shares))
    chosen, score, shares = (np.concatenate(each) for each in zip(*found, strict=True))
    best = np.argsort(score, kind="stable")[:many]
    return _candidates(problem, item, curves, chosen[best], shares[best])


def some_places(entries: PathEntries) -> IntArray:
    """The numbers of the places that are compared in trials: all, or so many from the first to the last."""
    found: IntArray = np.unique(np.linspace(0, len(entries.places) - 1, MOST_PLACES).round().astype(int))
    return found


def closed_spline(places: ComplexArray, least: int) -> ComplexArray:
    """Points of a smooth closed curve through places (n,), every so many of them one of the places.

    Catmull and Rom's spline with the square roots of distances as parameter, which goes round no loops of its own.
    """
    many = max(1, -(-least // len(places)))
    before, one, other, behind = (np.roll(places, -k)[:, None] for k in (-1, 0, 1, 2))
    a, b, c = (np.sqrt(np.abs(end - start)) + 1e-300 for start, end in ((before, one), (one, other), (other, behind)))
    start = ((one - before) / a - (other - before) / (a + b) + (other - one) / b) * b
    end = ((other - one) / b - (behind - one) / (b + c) + (behind - other) / c) * b
    t = np.arange(many) / many
    rise = t * t * (3.0 - 2.0 * t)
    found: ComplexArray = (1.0 - rise) * one + rise * other + t * (1.0 - t) * ((1.0 - t) * start - t * end)
    return found.ravel()


def _candidates(problem: MatchProblem, item: int, curves: CurveIndex, chosen: IntArray, shares: Array) -> MatchState:
    """Candidates of these curves, whose places are met at shares (n, entries) of the curves' lengths."""
    entries = problem.wanted[item]
    assert isinstance(entries, PathEntries)
    design, places = curves.design[chosen], curves.coordinates[chosen].astype(complex)
    motions = problem.catalogue.motions
    paths = design_curves(problem.catalogue, problem.points[entries.point].link, design, places)
    samples = np.empty(shares.shape)
    closed = curves.is_closed[chosen]
    samples[closed] = samples_at(lengths_along(paths[closed], True), shares[closed])
    last = np.minimum(np.arange(paths.shape[1]), motions.sample_count[design, None] - 1)[~closed]
    held = np.take_along_axis(paths[~closed], last, axis=1)
    samples[~closed] = samples_at(lengths_along(held, False), np.clip(shares[~closed], 0.0, 1.0 - 1e-9))
    none = np.zeros((len(chosen), 0))
    every = tuple(samples if k == item else none for k in range(len(problem.wanted)))
    ones, zeros = np.ones(len(chosen), dtype=complex), np.zeros(len(chosen), dtype=complex)
    return MatchState(design, every, ones, zeros, {entries.point: places}, np.full(len(chosen), np.inf))


def _orders(entries: PathEntries, some: IntArray) -> list[IntArray]:
    """Orders of entries in which places may be met; each other way round is tried with it."""
    if entries.in_order or len(some) < 3:
        return [some]
    places = entries.places
    found: dict[tuple[int, ...], None] = {}
    if len(some) <= 4:
        for each in permutations(some.tolist()):
            if each[0] < each[-1]:
                found[each] = None
        return [np.array(each) for each in found]
    centre = places[some].mean()
    about = some[np.argsort(np.angle(places[some] - centre))]
    for k in range(len(some)):  # round the middle, and from each place to the nearest that is left
        found[tuple(np.roll(about, k).tolist())] = None
        tour, left = [int(some[k])], set(some.tolist()) - {int(some[k])}
        while left:
            tour.append(min(left, key=lambda j: abs(places[j] - places[tour[-1]])))
            left.remove(tour[-1])
        found[tuple(tour)] = None
    return [np.array(each) for each in found][:MOST_ORDERS]


def _trials(
    entries: PathEntries, orders: list[IntArray], is_closed: bool, random: np.random.Generator
) -> Iterator[tuple[IntArray, IntArray]]:
    """The entries in an order, and the numbers of even points at which they could be met."""
    wanted, count = entries.places, EVEN_POINTS
    for k in range(TRIALS):
        order = orders[k % len(orders)][:: 1 if (k // len(orders)) % 2 else -1]
        chords = np.abs(np.diff(np.append(wanted[order], wanted[order[0]]) if entries.is_closed else wanted[order]))
        spread = 1.2 / np.sqrt(len(chords))
        gaps = (chords + 0.02 * chords.max(initial=1e-300)) * np.exp(spread * random.normal(size=len(chords)))
        shares = np.append(0.0, np.cumsum(gaps) / gaps.sum())[: len(order)]
        span = 1.0 if entries.is_closed else random.uniform(*SPANS)
        most = count if is_closed else (count - 1)
        start = random.uniform(0.0, count if is_closed else most * (1.0 - span))
        yield order, (np.round(start + span * most * shares).astype(int) % count)


def _best_trials(
    even: ComplexArray, entries: PathEntries, trials: list[tuple[IntArray, IntArray]], can_move: bool
) -> tuple[Array, IntArray]:
    """Of each curve the least mean square distance in any trial, and in which."""
    even = even - even.mean(axis=0) if can_move else even  # far from the middle squares would lose digits
    square = even.real**2 + even.imag**2
    score, pick = np.full(even.shape[1], np.inf, dtype=np.float32), np.zeros(even.shape[1], dtype=np.int32)
    for k, (order, points) in enumerate(trials):
        weights = (entries.weights[order] / entries.weights[order].sum()).astype(np.float32)
        target = entries.places[order].astype(np.complex64)
        if can_move:
            target = target - target @ weights
        own = even[points]
        product = (weights * target.conj()) @ own
        power = weights @ square[points]
        whole = float(weights @ np.abs(target) ** 2)
        if can_move:
            middle = weights @ own
            power = power - (middle.real**2 + middle.imag**2)
            off = whole - (product.real**2 + product.imag**2) / np.maximum(power, np.float32(1e-30))
        else:
            off = whole + power - 2.0 * product.real
        better = off < score
        score[better], pick[better] = off[better], k
    return score.astype(float), pick


def _all_shares(entries: PathEntries, order: IntArray, points: IntArray, is_closed: bool) -> Array:
    """Shares of a curve's length at which all entries are met, if those in `order` are at these even points; those
    between lie between, going on over the end of closed curves."""
    count = EVEN_POINTS if is_closed else EVEN_POINTS - 1
    share = np.zeros(len(entries.places))
    own = points / count
    if len(order) == len(entries.places):
        share[order] = own
        return share
    steps = np.diff(points)
    if is_closed:
        sense = 1 if np.count_nonzero(steps >= 0) >= np.count_nonzero(steps < 0) else -1
        steps = np.mod(sense * steps, EVEN_POINTS) * sense
    along = (points[0] + np.append(0, np.cumsum(steps))) / count
    rising = np.argsort(order)
    found: Array = np.interp(np.arange(len(share)), order[rising], along[rising])
    return found
