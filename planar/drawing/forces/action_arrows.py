"""What acts on each link as a free body, lettered as textbooks letter forces and couples."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from planar.drawing.paper.picture import Pen
from planar.drawing.scheme.springs_masses import SUBSCRIPTS
from planar.dynamics.external_actions import ExternalAction
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.model.link_graph import link_numbers

ROUND_OFF_RATIO = 1e-9
"""A force, or a couple at an arm of the mechanism's size, below this part of the greatest force is round-off."""
SIMPLE_INDEX = re.compile(r"[A-Za-z0-9,: ]+")
"""What mathtext can show as an index."""
ACTION_PENS = {"input": Pen.LOAD, "inertia": Pen.INERTIA, "load": Pen.LOAD, "spring": Pen.LOAD, "weight": Pen.LOAD}
MASS_ACTIONS = ("weight", "inertia")
"""What acts at a centre of mass."""
REACTION_LETTERS = ("F", "M")
ACTION_LETTERS = {"load": ("P", "M"), "weight": ("W", "W"), "spring": ("S", "S"), "input": ("F", "T")}
"""Of the force and of the couple that a pair exerts, and that each kind of action is."""


class ActionSymbol(NamedTuple):
    """A letter with its index, `primes` where a link feels several that are called the same."""

    base: str
    subscript: str
    primes: int = 0

    @property
    def label(self) -> tuple[str, bool]:
        """How it is written, and whether that is mathtext."""
        letters = self.base.removeprefix("-")
        if not SIMPLE_INDEX.fullmatch(self.subscript):
            return f"{self.base}{'′' * self.primes} ({self.subscript})", False
        index = self.subscript.replace(" ", r"\ ").replace(",", "{,}").replace(":", "{:}")
        each = (f"{letter}{chr(39) * self.primes}_{{{index}}}".replace("α", r"\alpha ") for letter in letters)
        return f"${'-' if self.base != letters else ''}{''.join(each)}$", True

    @property
    def plain_text(self) -> str:
        """How it is written in a sentence: F₃₂."""
        return f"{self.base}{'′' * self.primes}{self.subscript.translate(SUBSCRIPTS)}"

    def __str__(self) -> str:
        return f"{self.base}{'′' * self.primes}_{self.subscript}"


class FrictionCircle(NamedTuple):
    """The circle about a pin to which its force is tangent where it turns with friction: centre (2,), radius (m)."""

    pair: str
    centre: Array
    radius: float


class ActionArrow(NamedTuple):
    """A force (2,), N, at a place (2,), m, or a couple, N m, that a link feels; not a number where it is not told.

    A couple that belongs to no place in particular has none.
    """

    symbol: ActionSymbol
    pen: Pen
    at: Array | None
    force: Array | None = None
    couple: float | None = None
    at_mass_centre: bool = False
    "whether its place is a centre of mass"
    friction_circle: FrictionCircle | None = None
    "to which the force is tangent"

    @property
    def vector(self) -> Array:
        """The force (2,); nothing of a couple."""
        return np.zeros(2) if self.force is None else self.force

    @property
    def is_determined(self) -> bool:
        """Whether equilibrium tells it."""
        return bool(np.isfinite(self.couple or 0.0 if self.force is None else self.force).all())


def action_arrows(forces: Forces, arm: float) -> dict[str, tuple[ActionArrow, ...]]:
    """What acts on every moving link at a position, but for what is nothing; `arm` is the mechanism's size (m)."""
    mechanism = forces.mechanism
    number = link_numbers(mechanism)
    of = {
        link: [*_reaction_arrows(forces, link, number), *_load_arrows(forces, link, number)]
        for link in number
        if link != mechanism.frame
    }
    sizes = [_magnitude_at_arm(each, arm) for felt in of.values() for each in felt if each.is_determined]
    least = ROUND_OFF_RATIO * max(sizes, default=0.0)
    return {
        link: tuple(
            _with_primes(each for each in felt if not each.is_determined or _magnitude_at_arm(each, arm) > least)
        )
        for link, felt in of.items()
    }


def link_pair_index(link: str, other: str) -> str:
    """The index of what a link feels of another, by their numbers: 32, or 12,3 where one has two digits."""
    return ("," if len(link + other) > 2 else "").join((link, other))


def reaction_symbols(link: str, other: str) -> tuple[ActionSymbol, ActionSymbol]:
    """The letters of the force and of the couple that a link feels of another, by their numbers."""
    index = link_pair_index(link, other)
    force, couple = REACTION_LETTERS
    return ActionSymbol(force, index), ActionSymbol(couple, index)


def _reaction_arrows(forces: Forces, link: str, number: Mapping[str, str]) -> Iterator[ActionArrow]:
    for name, pair in forces.reactions.items():
        if pair.couples:
            if link in pair.couples:
                yield ActionArrow(ActionSymbol("M", name), Pen.REACTION, None, couple=float(pair.couples[link]))
            continue
        if link not in pair.links or pair.at is None:
            continue
        first, second = pair.links
        sense, other = (1.0, first) if link == second else (-1.0, second)
        force, couple = reaction_symbols(number[link], number[other])
        circle = _friction_circle(forces, name)
        if circle is not None and np.isfinite([*pair.force, pair.couple]).all():
            size = float(np.hypot(*pair.force))
            off = float(pair.couple) / size * np.array([pair.force[1], -pair.force[0]]) / size
            yield ActionArrow(
                force, Pen.REACTION, pair.at + off, sense * np.asarray(pair.force), friction_circle=circle
            )
            continue
        yield ActionArrow(force, Pen.REACTION, pair.at, sense * np.asarray(pair.force))
        yield ActionArrow(couple, Pen.REACTION, pair.at, couple=sense * float(pair.couple))


def _friction_circle(forces: Forces, name: str) -> FrictionCircle | None:
    """The friction circle of a pair that turns with friction under a force."""
    pair = next(each for each in forces.mechanism.pairs if each.name == name)
    radius, rubbing, reaction = pair.friction_circle_radius(), forces.friction.get(name), forces.reactions[name]
    if radius is None or rubbing is None or not rubbing.sense or reaction.at is None or not np.any(reaction.force):
        return None
    return FrictionCircle(name, reaction.at, float(np.asarray(radius)))


def _load_arrows(forces: Forces, link: str, number: Mapping[str, str]) -> Iterator[ActionArrow]:
    for each in forces.acting:
        if each.link != link:
            continue
        force, couple = _symbols_of_action(each, number)
        pen, massive = ACTION_PENS[each.kind], each.kind in MASS_ACTIONS
        yield ActionArrow(force, pen, np.asarray(each.at), np.asarray(each.force), at_mass_centre=massive)
        driven = forces.reactions.get(each.name) if each.kind == "input" else None
        at = np.asarray(each.at) if massive else driven and driven.at
        yield ActionArrow(couple, pen, at, couple=float(each.couple))


def _symbols_of_action(acting: ExternalAction, number: Mapping[str, str]) -> tuple[ActionSymbol, ActionSymbol]:
    """The letters of the force and of the couple of an action, or of inertia."""
    own = number[acting.link]
    if acting.kind == "inertia":
        return ActionSymbol("-ma", own), ActionSymbol("-Iα", own)
    name = acting.name.removeprefix("spring ") if acting.kind == "spring" else acting.name
    return action_symbols(acting.kind, name, acting.link, number)


def action_symbols(kind: str, name: str, link: str, number: Mapping[str, str]) -> tuple[ActionSymbol, ActionSymbol]:
    """The letters of the force and of the couple of a load, weight, input or spring (its number) on a link."""
    index = number[link] if kind == "weight" else name
    force, couple = ACTION_LETTERS[kind]
    return ActionSymbol(force, index), ActionSymbol(couple, number[link] if name == link else index)


def _magnitude_at_arm(push: ActionArrow, arm: float) -> float:
    return float(np.hypot(*push.force)) if push.force is not None else abs(push.couple or 0.0) / arm


def _with_primes(felt: Iterable[ActionArrow]) -> Iterator[ActionArrow]:
    """The same with primes on letters that a link has had before."""
    seen: dict[ActionSymbol, int] = {}
    for each in felt:
        seen[each.symbol] = seen.get(each.symbol, -1) + 1
        yield each._replace(symbol=each.symbol._replace(primes=seen[each.symbol]))
