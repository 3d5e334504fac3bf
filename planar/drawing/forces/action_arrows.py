"""What acts on each link as a free body, lettered as textbooks letter forces and couples."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from planar.drawing.paper.picture import Pen
from planar.drawing.scheme.scheme import LOWERED
from planar.dynamics.external_actions import Acting
from planar.dynamics.forces import Forces
from planar.model.link_graph import numbered

Array = np.ndarray

NOTHING = 1e-9
"""A force, or a couple at an arm of the mechanism's size, below this part of the greatest force is round-off."""
SIMPLE = re.compile(r"[A-Za-z0-9,: ]+")
"""What mathtext can show as an index."""
PENS = {"input": Pen.LOAD, "inertia": Pen.INERTIA, "load": Pen.LOAD, "spring": Pen.LOAD, "weight": Pen.LOAD}
MASSIVE = ("weight", "inertia")
"""What acts at a centre of mass."""
LETTERS = {"load": ("P", "M"), "weight": ("W", "W"), "spring": ("S", "S"), "input": ("F", "T")}
"""Of the force and of the couple that each kind of action is."""


class Sign(NamedTuple):
    """A letter with its index, `primes` where a link feels several that are called the same."""

    base: str
    index: str
    primes: int = 0

    @property
    def text(self) -> tuple[str, bool]:
        """How it is written, and whether that is mathtext."""
        letters = self.base.removeprefix("-")
        if not SIMPLE.fullmatch(self.index):
            return f"{self.base}{'′' * self.primes} ({self.index})", False
        index = self.index.replace(" ", r"\ ").replace(",", "{,}").replace(":", "{:}")
        each = (f"{letter}{chr(39) * self.primes}_{{{index}}}".replace("α", r"\alpha ") for letter in letters)
        return f"${'-' if self.base != letters else ''}{''.join(each)}$", True

    @property
    def plain(self) -> str:
        """How it is written in a sentence: F₃₂."""
        return f"{self.base}{'′' * self.primes}{self.index.translate(LOWERED)}"

    def __str__(self) -> str:
        return f"{self.base}{'′' * self.primes}_{self.index}"


class Push(NamedTuple):
    """A force (2,), N, at a place (2,), m, or a couple, N m, that a link feels; not a number where it is not told.

    A couple that belongs to no place in particular has none.
    """

    sign: Sign
    pen: Pen
    at: Array | None
    force: Array | None = None
    couple: float | None = None
    massive: bool = False
    "whether its place is a centre of mass"

    @property
    def told(self) -> bool:
        """Whether equilibrium tells it."""
        return bool(np.isfinite(self.force if self.force is not None else self.couple).all())


def pushes(forces: Forces, arm: float) -> dict[str, tuple[Push, ...]]:
    """What acts on every moving link at a position, but for what is nothing; `arm` is the mechanism's size (m)."""
    mechanism = forces.mechanism
    number = numbered(mechanism)
    of = {
        link: [*_reactions(forces, link, number), *_actions(forces, link, number)]
        for link in number
        if link != mechanism.frame
    }
    sizes = [_size(each, arm) for felt in of.values() for each in felt if each.told]
    least = NOTHING * max(sizes, default=0.0)
    return {
        link: tuple(_distinct(each for each in felt if not each.told or _size(each, arm) > least))
        for link, felt in of.items()
    }


def both(link: str, other: str) -> str:
    """The index of what a link feels of another, by their numbers: 32, or 12,3 where one has two digits."""
    return ("," if len(link + other) > 2 else "").join((link, other))


def _reactions(forces: Forces, link: str, number: Mapping[str, str]) -> Iterator[Push]:
    for name, pair in forces.reactions.items():
        if pair.couples:
            if link in pair.couples:
                yield Push(Sign("M", name), Pen.REACTION, None, couple=float(pair.couples[link]))
            continue
        if link not in pair.links or pair.at is None:
            continue
        first, second = pair.links
        sense, other = (1.0, first) if link == second else (-1.0, second)
        index = both(number[link], number[other])
        yield Push(Sign("F", index), Pen.REACTION, pair.at, sense * np.asarray(pair.force))
        yield Push(Sign("M", index), Pen.REACTION, pair.at, couple=sense * float(pair.couple))


def _actions(forces: Forces, link: str, number: Mapping[str, str]) -> Iterator[Push]:
    for each in forces.acting:
        if each.link != link:
            continue
        force, couple = _signs(each, number)
        pen, massive = PENS[each.kind], each.kind in MASSIVE
        yield Push(force, pen, np.asarray(each.at), np.asarray(each.force), massive=massive)
        driven = forces.reactions.get(each.name) if each.kind == "input" else None
        at = np.asarray(each.at) if massive else driven and driven.at
        yield Push(couple, pen, at, couple=float(each.couple))


def _signs(acting: Acting, number: Mapping[str, str]) -> tuple[Sign, Sign]:
    """The letters of the force and of the couple of an action."""
    own = number[acting.link]
    if acting.kind == "inertia":
        return Sign("-ma", own), Sign("-Iα", own)
    index = {"weight": own, "spring": acting.name.removeprefix("spring ")}.get(acting.kind, acting.name)
    force, couple = LETTERS[acting.kind]
    return Sign(force, index), Sign(couple, own if acting.name == acting.link else index)


def _size(push: Push, arm: float) -> float:
    return float(np.hypot(*push.force)) if push.force is not None else abs(push.couple or 0.0) / arm


def _distinct(felt: Iterable[Push]) -> Iterator[Push]:
    """The same with primes on letters that a link has had before."""
    seen: dict[Sign, int] = {}
    for each in felt:
        seen[each.sign] = seen.get(each.sign, -1) + 1
        yield each._replace(sign=each.sign._replace(primes=seen[each.sign]))
