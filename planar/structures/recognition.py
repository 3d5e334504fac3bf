"""Which chain a mechanism is made of, which of its links is fixed, and which joints are driven."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from itertools import islice, product
from math import comb
from typing import NamedTuple

from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import BadInput, join_names
from planar.foundation.short_repr import short_repr
from planar.model.link_graph import pin_pair_trees, unconnected_links
from planar.model.mechanism import Mechanism, pair_entries, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.structures.chain import Chain
from planar.structures.contraction import canonical_chain
from planar.structures.enumeration.chains import chains
from planar.structures.enumeration.chains_with_multiple_pins import has_movable_pins
from planar.structures.enumeration.pin_chains import Chains
from planar.structures.multiple_pins import canonical_pins, extra_links, link_pairs
from planar.structures.rigid_parts import Joint, has_rigid_part
from planar.structures.symmetry import first_alike, joint_exchanges

MAX_NUMBERED_LOOPS = 5
"""Of a chain of more loops the number is not looked for: with six there are hundreds of thousands and more."""
MAX_PINNED_LOOPS = 3
"""Of a chain of more loops with pins of several links the number is not looked for."""
MAX_PIN_LINKS = 6
"""Of a pin of more links one choice of pairs alone is looked at."""
MAX_PIN_CHOICES = 1000
"""So many choices of pairs at multiple pins are looked at."""
MAX_SLIDE_SETS, MAX_SLIDE_CHAINS = 1000, 300
"""Of a chain with more sets of as many joints as slide, or with so many chains before it, the number with slides is not
looked for."""
MAX_DRIVE_SETS = 10000
"""Of a chain with more sets of joints that could be driven, mechanisms are not numbered."""


@dataclass(frozen=True)
class MechanismStructure:
    """The chain of a mechanism, see `planar.chain_of`.

    `frame` and `drives` are the fixed link and the driven joints by their numbers in `chain`, and the same for every
    mechanism of this structure; `number` is its place in `chain.mechanisms(moving_drives=True)`, None where the inputs
    do not drive it definitely. `links` and `joints` are the numbers of the mechanism's own links and pairs, `slides`
    the joints that are sliding pairs, `groups` the Assur groups by names of links. Where pins hold more than two links
    `multiple_pins` names them, and `others` are the chains that other choices of pairs there give; of chains of more
    than five loops these are not looked for; `pinned_chain` is the chain that has these pins as they are. `inversions`
    are links that, fixed in place of the frame, give other mechanisms of the same chain, one for each of those, with
    the field's name for it, or nothing.
    """

    chain: Chain
    frame: int
    drives: tuple[int, ...]
    number: int | None
    links: dict[str, int]
    joints: dict[str, int]
    slides: tuple[int, ...]
    groups: tuple[tuple[tuple[str, ...], str], ...]
    multiple_pins: tuple[str, ...]
    others: tuple[Chain, ...]
    pinned_chain: Chain | None
    inversions: dict[str, str]

    __repr__ = short_repr

    @property
    def name(self) -> str:
        """What the field calls the inversion, else the chain, or nothing."""
        return self.chain.inversion_name(self.frame) or self.chain.name

    @property
    def loops(self) -> int:
        """How many independent loops there are."""
        return self.chain.loops


@takes_mechanism
def chain_of(mechanism: Mechanism) -> MechanismStructure:
    """Which chain a mechanism is made of, and which inversion and input of it.

    Its structure alone matters, no dimension. A pin of n links is n - 1 joints:
    of its first link (the frame, where that is among them) with each of the others, or of other pairs of them where
    an input is between two others, or the first choice has a rigid part.

    Raises BadInput where it is no closed chain of lower pairs: with a pair of two freedoms (a gear, a cam, a pin in a
    slot), a link that has one pair, or a part that by count is rigid.

    >>> import planar
    >>> found = planar.chain_of("watt-six-bar")
    >>> (found.chain.links, found.chain.number, found.frame, found.drives)
    (6, 0, 0, (1,))
    """
    _refuse_others(mechanism)
    names = [link.name for link in mechanism.links]
    inputs = [relative_motions(mechanism)[given.pair].links for given in mechanism.inputs]
    driven = [(names.index(a), names.index(b)) for a, b in inputs]
    choices = islice(_joint_choices(mechanism), MAX_PIN_CHOICES)
    whole = [each for each in choices if not has_rigid_part(len(names), [joint.links for joint in each])]
    if not whole:
        raise BadInput(
            "pairs",
            f"by count some links of {mechanism.name!r} are rigid against each other or held more than once, as none "
            "of a chain are; `planar inspect` names redundant pairs",
        )
    fitting = [each for each in whole if all(_joint_between(each, ends) is not None for ends in driven)]
    joints = (fitting or whole)[0]
    drives = [number for ends in driven if (number := _joint_between(joints, ends)) is not None]
    is_large = len(joints) - len(names) + 1 > MAX_NUMBERED_LOOPS
    others = dict.fromkeys(_known_chain(len(names), each)[0] for each in (whole[:1] if is_large else whole))
    return _describe(mechanism, joints, drives, tuple(others))


class NamedJoint(NamedTuple):
    """A joint of a mechanism: its name there, its two links by their places in the file, and whether it slides."""

    name: str
    links: Joint
    slides: bool


def _refuse_others(mechanism: Mechanism) -> None:
    higher = [pair for pair in mechanism.pairs if not pair.is_lower_pair]
    if higher:
        raise BadInput(
            higher[0].name,
            f"this pair ({higher[0].keyword}) does not leave two links one freedom, so that {mechanism.name!r} is no "
            "chain of lower pairs alone; put a link with two pins or slides in its place where that moves alike",
        )
    apart = unconnected_links(mechanism)
    if apart:
        raise BadInput(apart[0], f"nothing joins {join_names(map(repr, apart))} to the frame, so there is no one chain")
    ends = [link for group in pair_entries(mechanism) for link in {link for pair in group for link in pair.links}]
    loose = [link.name for link in mechanism.links if ends.count(link.name) < 2]
    if loose:
        told = "has one pair" if len(loose) == 1 else "have one pair each"
        which = join_names(map(repr, loose))
        raise BadInput(loose[0], f"{which} of {mechanism.name!r} {told}: the chain is open")


def _joint_choices(mechanism: Mechanism) -> Iterator[tuple[NamedJoint, ...]]:
    """The joints, at multiple pins by every choice of pairs, that one first which the mechanism's own pairs are."""
    place = {link.name: index for index, link in enumerate(mechanism.links)}

    def named(pair: Pair) -> NamedJoint:
        a, b = sorted(place[link] for link in pair.links)
        return NamedJoint(pair.name, (a, b), pair.input_kind is MeasureKind.LENGTH)

    entries: list[list[tuple[NamedJoint, ...]]] = []
    for group in pair_entries(mechanism):
        every = [named(pair) for pair in type(group[0]).relative_motions(group)]
        known = {each.links: each for each in every}
        own = tuple(known[named(pair).links] for pair in group)
        links = [*dict.fromkeys(link for pair in group for link in pair.links)]
        trees = pin_pair_trees(links) if 2 < len(links) <= MAX_PIN_LINKS else ()
        ends = [[sorted((place[a], place[b])) for a, b in tree] for tree in trees]
        chosen = [tuple(known[a, b] for a, b in tree) for tree in ends]
        entries.append([own, *(each for each in chosen if {*each} != {*own})])
    for parts in product(*entries):
        yield tuple(joint for each in parts for joint in each)


def _joint_between(joints: Sequence[NamedJoint], ends: Joint) -> int | None:
    return next((number for number, joint in enumerate(joints) if {*joint.links} == {*ends}), None)


def _known_chain(links: int, joints: Sequence[NamedJoint]) -> tuple[Chain, tuple[int, ...], tuple[int, ...]]:
    """A chain with its number, the number of each link in it, and that of each joint."""
    canonical = canonical_chain(links, [joint.links for joint in joints])
    chain = Chain(links, 3 * (links - 1) - 2 * len(joints), canonical.joints)
    place = {joint: number for number, joint in enumerate(chain.edges)}
    numbers = canonical.numbers
    own = [place[min(numbers[a], numbers[b]), max(numbers[a], numbers[b])] for _, (a, b), _ in joints]
    exchanges = joint_exchanges(chain.automorphisms, chain.edges)
    best, slides = first_alike((own[k] for k, joint in enumerate(joints) if joint.slides), exchanges)
    numbers = tuple(chain.automorphisms[best][link] for link in numbers)
    number = pin_number = None
    if chain.loops <= MAX_NUMBERED_LOOPS:
        pin_number = Chains(links, chain.freedom, True).number_of(chain)
    if not slides:
        number = pin_number
    elif comb(len(joints), len(slides)) <= MAX_SLIDE_SETS and pin_number is not None and pin_number < MAX_SLIDE_CHAINS:
        number = all_chains(links, chain.freedom, len(slides)).number_of(replace(chain, slides=slides))
    chain = Chain(links, chain.freedom, chain.edges, number, slides, pin_number)
    return chain, numbers, tuple(exchanges[best][joint] for joint in own)


def _pinned_chain(mechanism: Mechanism) -> Chain | None:
    """The chain with pins of several links as they are, and its number where chains have three loops at most; None
    where no pin is of more than two links, or a part is rigid."""
    place = {link.name: index for index, link in enumerate(mechanism.links)}
    groups = pair_entries(mechanism)
    held = [tuple(sorted({place[link] for pair in group for link in pair.links})) for group in groups]
    sliding = [pin for pin, group in zip(held, groups, strict=True) if group[0].input_kind is MeasureKind.LENGTH]
    links = len(place)
    if max(map(len, held)) == 2 or not has_movable_pins(links, tuple(held)):
        return None
    pins, numbers = canonical_pins(links, held)
    freedom = 3 * (links - 1) - 2 * sum(len(pin) - 1 for pin in pins)
    chain = Chain(links, freedom, link_pairs(pins), pins=pins)
    ends = [tuple(sorted(numbers[link] for link in pin)) for pin in sliding]
    exchanges = joint_exchanges(chain.automorphisms, chain.edges)
    _, slides = first_alike((chain.edges.index((a, b)) for a, b in ends), exchanges)
    chain = replace(chain, slides=slides)
    if chain.loops > MAX_PINNED_LOOPS:
        return chain
    return replace(chain, number=all_chains(links, freedom, len(slides), extra_links(pins)).number_of(chain))


@lru_cache(maxsize=16)
def all_chains(links: int, freedom: int, slides: int, multiple_pins: int = 0) -> Chains:
    """Those of some number of links, slides and links on pins beyond two, whose numbers are counted once."""
    return chains(links, freedom, slides=slides, multiple_pins=multiple_pins)


def _describe(
    mechanism: Mechanism, joints: Sequence[NamedJoint], drives: Sequence[int], others: Sequence[Chain]
) -> MechanismStructure:
    """What is found, in that one of the equal numberings of the chain that all mechanisms of this structure have."""
    chain, numbers, own = _known_chain(len(mechanism.links), joints)
    frame = numbers[[link.name for link in mechanism.links].index(mechanism.frame)]

    def chosen(exchange: tuple[int, ...], moved: tuple[int, ...]) -> tuple[int, tuple[int, ...]]:
        return exchange[frame], tuple(sorted(moved[own[each]] for each in drives))

    exchanges = zip(chain.automorphisms, joint_exchanges(chain.automorphisms, chain.edges), strict=True)
    exchange, moved = min(exchanges, key=lambda each: chosen(*each))
    fixed, driven = chosen(exchange, moved)
    links = {link.name: exchange[numbers[index]] for index, link in enumerate(mechanism.links)}
    named = {number: name for name, number in links.items()}
    groups = chain.assur_groups(fixed, driven) or ()
    (alike,) = (orbit for orbit in chain.symmetry.link_orbits if fixed in orbit)
    return MechanismStructure(
        chain,
        fixed,
        driven,
        _mechanism_number(chain, fixed, driven) if groups else None,
        links,
        {joint.name: moved[own[k]] for k, joint in enumerate(joints)},
        chain.slides,
        tuple((tuple(named[link] for link in each.links), each.assur_class) for each in groups),
        tuple(group[0].entry_name() for group in pair_entries(mechanism) if len(group) > 1),
        tuple(sorted((each for each in others if each != chain), key=lambda each: each.number or 0)),
        _pinned_chain(mechanism),
        {named[link]: chain.inversion_name(link) for link in chain.inversions if link not in alike},
    )


def _mechanism_number(chain: Chain, frame: int, drives: tuple[int, ...]) -> int | None:
    """The place among all mechanisms of a chain, where that has a number and they are not too many."""
    if chain.number is None or comb(chain.joints, chain.freedom) > MAX_DRIVE_SETS:
        return None
    every = chain.mechanisms(moving_drives=True)
    return next((k for k, each in enumerate(every) if (each.frame, each.drives) == (frame, drives)), None)
