"""The symmetry of a chain: which links, and which joints, can stand for one another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from typing import NamedTuple

from planar.structures.rigid_parts import Joint

Automorphism = tuple[int, ...]
"""Which link stands in the place of each."""


class ChainSymmetry(NamedTuple):
    """The automorphisms of a chain: how many there are, and what they take to each other, by numbers.

    `link_orbits` and `joint_orbits` are sets of links, and of joints, that are alike but for their numbers; each begins
    with its least number.
    """

    order: int
    link_orbits: tuple[tuple[int, ...], ...]
    joint_orbits: tuple[tuple[int, ...], ...]


def neighbour_sets(links: int, joints: Iterable[Joint]) -> list[set[int]]:
    """The links that each is joined to."""
    found: list[set[int]] = [set() for _ in range(links)]
    for a, b in joints:
        found[a].add(b)
        found[b].add(a)
    return found


def orbits(size: int, exchanges: Iterable[Sequence[int]]) -> tuple[tuple[int, ...], ...]:
    """What exchanges of numbers take to each other, each set in order, and the sets by their first number."""
    least = list(range(size))
    for each in exchanges:
        for number, other in enumerate(each):
            least[other] = min(least[other], least[number])
    return tuple(
        tuple(other for other in range(size) if least[other] == number)
        for number in range(size)
        if number == least[number]
    )


def joint_exchanges(exchanges: Iterable[Automorphism], joints: Sequence[Joint]) -> list[tuple[int, ...]]:
    """What exchanges of links do to the joints."""
    place = {joint: number for number, joint in enumerate(joints)}
    return [tuple(place[min(e[a], e[b]), max(e[a], e[b])] for a, b in joints) for e in exchanges]


def first_alike(joints: Iterable[int], exchanges: Iterable[Sequence[int]]) -> tuple[int, tuple[int, ...]]:
    """Of the sets of joints that exchanges take a set to the first, and which exchange does so."""
    every = [*joints]
    slides, place = min((tuple(sorted(each[k] for k in every)), place) for place, each in enumerate(exchanges))
    return place, slides


def chain_symmetry(links: int, joints: Sequence[Joint], group: Sequence[Automorphism]) -> ChainSymmetry:
    """The symmetry of a chain whose automorphisms are given, all of them."""
    return ChainSymmetry(len(group), orbits(links, group), orbits(len(joints), joint_exchanges(group, joints)))
