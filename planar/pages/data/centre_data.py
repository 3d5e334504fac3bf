"""Instantaneous centres as a page carries them: their names, the lines on which each lies, and the circle diagram."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from heapq import nsmallest
from itertools import chain, combinations
from typing import Any

from planar.analysis.centres.centres import extent
from planar.analysis.centres.kennedy import FoundCentre, KennedyConstruction, LinkPair, PrimaryCentres
from planar.analysis.centres.pair_centres import primary_centres
from planar.analysis.rate_equations import rate_equations
from planar.drawing.centres.choice import MAX_CENTRES
from planar.drawing.centres.circle_diagram import circle_radius, link_points
from planar.model.link_graph import link_label, link_numbers, number_separator
from planar.results.motion import State

MAX_LINES = 5
"""Lines of Kennedy's theorem that a page carries of a centre; it takes two of them that cross."""


def centre_data(state: State, points: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Every two links' centre in the order of their numbers, and links with their places in the circle diagram.

    `shown` is whether a pair of theirs shows it, `point` the one that both links have. Any three links have their
    centres on one line: `lines` has, by their numbers in the list, the two other centres of each, first those on which
    it is found at this position, then those that pairs show. `points` are those of `drawing_data`.
    """
    numbers = link_numbers(state.mechanism)
    links, separator = sorted(numbers, key=lambda link: int(numbers[link])), number_separator(numbers)
    primary = primary_centres(rate_equations(state), *extent(state))
    place = {frozenset(two): k for k, two in enumerate(combinations(links, 2))}
    third_links = _third_links(links, primary)
    common: dict[LinkPair, str] = {}
    for name, point in points.items():
        for two in combinations(point["links"], 2):
            common.setdefault(frozenset(two), name)
    return {
        "all": [
            {
                "name": separator.join(numbers[link] for link in two),
                "links": two,
                "shown": frozenset(two) in primary.centres,
                "point": common.get(frozenset(two)),
                "lines": [[place[frozenset((link, third))] for link in two] for third in third_links[two]],
            }
            for two in combinations(links, 2)
        ],
        "links": [
            {
                "link": link,
                "number": numbers[link],
                "label": link_label(numbers[link], link),
                "place": [part / circle_radius(len(links)) for part in at],
            }
            for link, at in link_points(numbers).items()
        ],
    }


def _third_links(links: Sequence[str], primary: PrimaryCentres) -> dict[tuple[str, str], list[str]]:
    """Of every two links the third ones whose centres with both give the lines to be taken, the best first."""
    pairs = list(combinations(links, 2))
    located: Mapping[LinkPair, FoundCentre] = {}
    if len(pairs) <= MAX_CENTRES:  # of more it would take long, and few are shown
        construction = KennedyConstruction(links, primary)
        construction.find_all()
        located = construction.found
    shown: dict[str, set[str]] = {link: set() for link in links}
    for a, b in map(tuple, primary.centres):
        shown[a].add(b)
        shown[b].add(a)
    place = {link: k for k, link in enumerate(links)}
    chosen = {}
    for two in pairs:
        found, (one, other) = located.get(frozenset(two)), two
        first = {line.link for line in found.lines if line.link} if found else set()
        ranks = (first, shown[one] & shown[other], shown[one] ^ shown[other])
        best = (nsmallest(MAX_LINES + 2, rank, key=place.__getitem__) for rank in ranks)
        thirds: dict[str, None] = {}
        for third in chain(*best, links):
            if len(thirds) == MAX_LINES:
                break
            if third not in two:
                thirds[third] = None
        chosen[two] = [*thirds]
    return chosen
