"""Instantaneous centres as a page carries them: their names, the lines on which each lies, and the circle diagram."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations
from typing import Any

from planar.analysis.centres.centres import extent
from planar.analysis.centres.kennedy import KennedyConstruction, LinkPair
from planar.analysis.centres.pair_centres import primary_centres
from planar.analysis.rate_equations import rate_equations
from planar.drawing.centres.circle_diagram import circle_radius, link_points
from planar.model.link_graph import link_numbers, number_separator
from planar.results.motion import State

MAX_LINES = 5
"""Lines of Kennedy's theorem that a page carries of a centre; it takes two of them that cross."""


def centre_data(state: State, points: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """Every two links' centre in the order of their numbers, and where links stand in the circle diagram.

    `shown` is whether a pair of theirs shows it, `point` the one that both links have. Any three links have their
    centres on one line: `lines` has, by their numbers in the list, the two other centres of each, first those on which
    it is found at this position, then those that pairs show. `points` are those of `drawing_data`.
    """
    numbers = link_numbers(state.mechanism)
    links, separator = sorted(numbers, key=lambda link: int(numbers[link])), number_separator(numbers)
    primary = primary_centres(rate_equations(state), *extent(state))
    construction = KennedyConstruction(links, primary)
    construction.find_all()
    place = {frozenset(two): k for k, two in enumerate(combinations(links, 2))}

    def lines(two: LinkPair) -> list[list[int]]:
        found = construction.found.get(two)
        first = [line.link for line in found.lines if line.link] if found else []

        def rank(third: str) -> tuple[bool, int]:
            sides = [frozenset((link, third)) for link in two]
            return third not in first, -sum(each in primary.centres for each in sides)

        others = sorted((link for link in links if link not in two), key=rank)
        return [[place[frozenset((link, third))] for link in sorted(two)] for third in others[:MAX_LINES]]

    return {
        "all": [
            {
                "name": separator.join(numbers[link] for link in two),
                "links": two,
                "shown": frozenset(two) in primary.centres,
                "point": next((name for name, each in points.items() if {*two} <= {*each["links"]}), None),
                "lines": lines(frozenset(two)),
            }
            for two in combinations(links, 2)
        ],
        "circle": _places_on_circle(numbers),
    }


def _places_on_circle(numbers: Mapping[str, str]) -> dict[str, list[float]]:
    """Where links stand in the circle diagram, in the order of their numbers, in parts of its radius."""
    return {link: [x / circle_radius(len(numbers)) for x in at] for link, at in link_points(numbers).items()}
