"""Whether some links of a chain move too little: counts over all its parts, by the pebble game."""

from __future__ import annotations

from collections.abc import Iterable

Joint = tuple[int, int]
"""The two links that a joint joins, the lower number first."""
MOTIONS = 3
"""Of a link in the plane."""


class PebbleGame:
    """Directed edges among links, at most three from each; a link has a pebble for each edge that it might have yet.

    Edges are taken that leave every set of k links with at most 3 k - `least` of them. An edge is where two links have
    more than `least` pebbles between them, which are fetched along edges against their direction, turning these round.

    A. Lee, I. Streinu, Pebble Game Algorithms and Sparse Graphs, Discrete Mathematics 308 (2008) 1425.
    """

    def __init__(self, links: int, least: int = MOTIONS):
        self.least = least
        self.ends: list[list[int]] = [[] for _ in range(links)]

    def add(self, joint: Joint) -> bool:
        """Take an edge, if it may be; whether it was."""
        one, other = joint
        for link, kept in (joint, joint[::-1]):
            while len(self.ends[one]) + len(self.ends[other]) > 2 * MOTIONS - self.least - 1:
                if not self._fetch(link, kept):
                    break
        if len(self.ends[one]) + len(self.ends[other]) > 2 * MOTIONS - self.least - 1:
            return False
        start, end = (one, other) if len(self.ends[one]) < MOTIONS else (other, one)
        self.ends[start].append(end)
        return True

    def free(self, link: int) -> None:
        """Fetch all the pebbles that a link can have, so that no edge starts there."""
        while self._fetch(link, link):
            pass

    def _fetch(self, link: int, kept: int) -> bool:
        """Bring a pebble to a link from elsewhere than one of two; whether there was one."""
        if not self.ends[link]:
            return False
        came: dict[int, int] = {link: link, kept: kept}
        waiting = [link]
        while waiting:
            at = waiting.pop()
            for end in self.ends[at]:
                if end in came:
                    continue
                came[end] = at
                if len(self.ends[end]) < MOTIONS:
                    self._turn_path(came, end, link)
                    return True
                waiting.append(end)
        return False

    def _turn_path(self, came: dict[int, int], end: int, start: int) -> None:
        while end != start:
            before = came[end]
            self.ends[before].remove(end)
            self.ends[end].append(before)
            end = before


def has_rigid_part(links: int, joints: Iterable[Joint]) -> bool:
    """Whether some links, pinned as they are, have freedom 0 or less against each other by count.

    None have where every k of them have at most 3 (k - 1) - 1 constraints, of which a pin has two.
    """
    game = PebbleGame(links, MOTIONS + 1)
    return not all(game.add(joint) for joint in joints for _ in range(2))


def independent_edges(links: int, joints: Iterable[Joint]) -> PebbleGame | None:
    """The constraints of a chain's pins, two each; None where by count some of them follow from others."""
    game = PebbleGame(links)
    taken = [game.add(joint) for joint in joints for _ in range(2)]
    return game if all(taken) else None
