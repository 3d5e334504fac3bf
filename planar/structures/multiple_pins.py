"""Pins of several links: as vertices of a graph beside the links, so that chains with them are numbered as others."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import combinations, product

from planar.model.wording import count_phrase
from planar.structures.contraction import automorphisms, canonical_chain
from planar.structures.rigid_parts import Joint
from planar.structures.symmetry import Automorphism

Pin = tuple[int, ...]
"""The links on a pin, in order."""


def canonical_pins(links: int, pins: Sequence[Pin]) -> tuple[tuple[Pin, ...], tuple[int, ...]]:
    """Pins in the numbering of links that all chains of their kind share, in order; the number of each link given.

    Links and pins of three and more links are numbered as the links of a chain are, a pin as a link with as many joints
    before other such; then the pins are left out.
    """
    edges, marked = _graph(links, pins)
    found = canonical_chain(links + marked, edges, marked)
    order = sorted(range(links), key=lambda link: found.numbers[link])
    numbers = tuple(order.index(link) for link in range(links))
    return tuple(sorted(tuple(sorted(numbers[link] for link in pin)) for pin in pins)), numbers


def pin_automorphisms(links: int, pins: Sequence[Pin]) -> Iterator[Automorphism]:
    """Every exchange of links that keeps the pins."""
    edges, marked = _graph(links, pins)
    for each in automorphisms(links + marked, edges, marked):
        yield each[:links]


def extra_links(pins: Sequence[Pin]) -> int:
    """How many links pins hold beyond two each."""
    return sum(len(pin) - 2 for pin in pins)


def joint_kinds_phrase(slides: int, multiple_pins: int) -> str:
    """What joints there are beside pins of two links, after a number of links: ` with 1 slide`, or nothing."""
    told = [count_phrase(slides, "slide")] if slides else []
    told += [f"{count_phrase(multiple_pins, 'extra link')} on pins"] if multiple_pins else []
    return f" with {' and '.join(told)}" if told else ""


def link_pairs(pins: Sequence[Pin]) -> tuple[Joint, ...]:
    """Any two links on a pin each, in order: what may turn against one another."""
    return tuple(sorted(ends for pin in pins for ends in combinations(pin, 2)))


def merged_pins(pins: Sequence[Pin]) -> Iterator[tuple[Pin, ...]]:
    """Pins of which two that share a link with more than two are one."""
    for one, other in combinations(pins, 2):
        common = {*one} & {*other}
        if common and sum(not common.isdisjoint(pin) for pin in pins) > 2:
            yield (*(pin for pin in pins if pin not in (one, other)), tuple(sorted({*one, *other})))


def pin_trees(pins: Sequence[Pin], driven: Sequence[Joint]) -> Iterator[list[Joint]]:
    """Joints of two links each that stand for the pins: of each one of its links with all others, every one in turn, of
    which those are told in which driven joints are."""
    stars = []
    for pin in pins:
        wanted = [ends for ends in driven if {*ends} <= {*pin}]
        middles = [link for link in pin if all(link in ends for ends in wanted)] if len(pin) > 2 else pin[:1]
        stars.append([[(min(m, link), max(m, link)) for link in pin if link != m] for m in middles])
    for chosen in product(*stars):
        yield [joint for star in chosen for joint in star]


def _graph(links: int, pins: Sequence[Pin]) -> tuple[list[Joint], int]:
    """The edges of a graph of links and, after them, multiple pins, and how many these are."""
    multiple = [pin for pin in pins if len(pin) > 2]
    edges = [(pin[0], pin[1]) for pin in pins if len(pin) == 2]
    edges += [(link, links + k) for k, pin in enumerate(multiple) for link in pin]
    return edges, len(multiple)
