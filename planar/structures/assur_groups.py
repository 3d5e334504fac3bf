"""Assur groups: the smallest sets of links that are placed together, once what drives the mechanism is placed."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from planar.structures.rigid_parts import MOTIONS, Joint, independent_edges


class AssurGroup(NamedTuple):
    """Links that are placed together, by their numbers, and their class after I. I. Artobolevskii.

    `assur_class` is "II" of a dyad; of four links "III" where three hang on one that has three joints, "IV" where they
    make a loop; of other groups it is empty.
    """

    links: tuple[int, ...]
    assur_class: str


def assur_groups(
    links: int, joints: Sequence[Joint], frame: int, drives: Sequence[int]
) -> tuple[AssurGroup, ...] | None:
    """The Assur groups, in an order in which they can be placed; None where the drives do not fit.

    Drives fit that are as many as the freedom, and of which none drives what others drive already. What a drive joins
    counts as one body, so that a crank belongs to the frame. Every other body has three edges of the pebble game, and
    the groups are its strongly connected parts.

    B. Servatius, O. Shai, W. Whiteley, Combinatorial Characterization of the Assur Graphs from Engineering, European
    Journal of Combinatorics 31 (2010) 1091.
    """
    body = list(range(links))
    for number in drives:
        one, other = (body[link] for link in joints[number])
        body = [one if each == other else each for each in body]
    held = set(drives)
    between = [(body[a], body[b]) for number, (a, b) in enumerate(joints) if number not in held]
    game = None if any(a == b for a, b in between) else independent_edges(links, between)
    if game is None:
        return None
    root = body[frame]
    game.free(root)
    bodies = sorted({*body} - {root})
    if any(len(game.ends[each]) < MOTIONS for each in bodies):
        return None
    found = []
    for part in _strong_parts({each: game.ends[each] for each in (root, *bodies)}):
        if root not in part:
            within = sum(a in part and b in part for a, b in between)
            named = {(2, 1): "II", (4, 3): "III", (4, 4): "IV"}.get((len(part), within), "")
            found.append(AssurGroup(tuple(link for link in range(links) if body[link] in part), named))
    return tuple(found)


def _strong_parts(arrows: dict[int, list[int]]) -> list[set[int]]:
    """Sets of nodes that lead to each other, those first to which others lead. R. Tarjan, SIAM J. Computing 1."""
    place: dict[int, int] = {}
    low: dict[int, int] = {}
    open_nodes: dict[int, None] = {}
    found: list[set[int]] = []
    for start in arrows:
        path = [] if start in place else [start]
        ways = [iter(arrows[node]) for node in path]
        while path:
            node = path[-1]
            if node not in place:
                place[node] = low[node] = len(place)
                open_nodes[node] = None
            end = next(ways[-1], None)
            if end is not None:
                if end not in place:
                    path.append(end)
                    ways.append(iter(arrows[end]))
                elif end in open_nodes:
                    low[node] = min(low[node], place[end])
                continue
            path.pop()
            ways.pop()
            if path:
                low[path[-1]] = min(low[path[-1]], low[node])
            if low[node] == place[node]:
                found.append(set())
                while node not in found[-1]:
                    found[-1].add(open_nodes.popitem()[0])
    return found
