"""A kinematic chain: links joined by pins and slides, none of them fixed yet."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import combinations, islice
from typing import NamedTuple

from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism
from planar.model.run_arguments import check_whole_number
from planar.model.wording import count_phrase
from planar.structures.assur_groups import AssurGroup, assur_groups
from planar.structures.chain_names import chain_name, inversion_names
from planar.structures.general_position import GeneralPosition
from planar.structures.multiple_pins import Pin, extra_links, joint_kinds_phrase, pin_automorphisms, pin_trees
from planar.structures.rigid_parts import Joint
from planar.structures.symmetry import (
    Automorphism,
    ChainSymmetry,
    chain_symmetry,
    joint_exchanges,
    neighbour_sets,
)

ASSUR_CLASSES = ("II", "III", "IV", "larger")
"""Of mechanisms, by their greatest group; larger: of more than four links."""
MAX_AUTOMORPHISMS = 20_000
"""A chain that has more is too regular for its links to be told apart one by one."""


class ChainMechanism(NamedTuple):
    """A chain with one link fixed and some joints driven, by their numbers in the chain.

    `name` is what the field calls the inversion, or nothing. `groups` are the Assur groups, in an order in which they
    can be placed once the driven links are: of each its links, and its class, "II" for a dyad, "III" or "IV" for four
    links, else nothing.
    """

    frame: int
    drives: tuple[int, ...]
    name: str
    groups: tuple[AssurGroup, ...]

    @property
    def assur_class(self) -> str:
        """The highest class of its groups, one of ASSUR_CLASSES."""
        return max((group.assur_class or ASSUR_CLASSES[-1] for group in self.groups), key=ASSUR_CLASSES.index)


@dataclass(frozen=True)
class Chain:
    """A kinematic chain of links and joints, in the numbering of links that all chains of its kind share.

    `links` is how many there are, numbered from 0: those with most joints first, binary ones last. `edges` are the
    joints, each by its two links, in order; a joint's number is its place among them. `slides` are the numbers of those
    that are sliding pairs, the others are pins. `number` is that among all chains of so many links and slides and this
    freedom, see `planar.chains`, and `pin_number` that which it has with pins in place of its slides; None where these
    are too many to be counted for it.

    `pins` are the joints, each by all its links: of several links on one pin, any two are a joint of `edges`, and all
    but one of the links count, so that there are fewer `joints` than edges.
    """

    links: int
    freedom: int
    edges: tuple[Joint, ...]
    number: int | None = field(default=None, compare=False)
    slides: tuple[int, ...] = ()
    pin_number: int | None = field(default=None, compare=False)
    pins: tuple[Pin, ...] = ()

    def __post_init__(self) -> None:
        if not self.slides:
            object.__setattr__(self, "pin_number", self.number)
        if not self.pins:
            object.__setattr__(self, "pins", self.edges)

    def __repr__(self) -> str:
        number = "" if self.number is None else f" {self.number}"
        beside = joint_kinds_phrase(len(self.slides), extra_links(self.pins))
        name = f", {self.name}" if self.name else ""
        return f"<Chain{number} of {self.links} links{beside}, freedom {self.freedom}{name}>"

    @property
    def joints(self) -> int:
        """How many joints there are, a pin of n links as n - 1."""
        return sum(len(pin) - 1 for pin in self.pins)

    @property
    def multiple_pins(self) -> tuple[Pin, ...]:
        """The pins of three and more links, each by these."""
        return tuple(pin for pin in self.pins if len(pin) > 2)

    @property
    def loops(self) -> int:
        """How many independent loops there are: joints - links + 1."""
        return self.joints - self.links + 1

    @cached_property
    def degrees(self) -> tuple[int, ...]:
        """How many pins and slides each link has."""
        return tuple(sum(link in pin for pin in self.pins) for link in range(self.links))

    @property
    def assortment(self) -> tuple[int, ...]:
        """How many links are binary, ternary, quaternary and so on, up to the most joints that a link has."""
        count = Counter(self.degrees)
        return tuple(count[degree] for degree in range(2, max(self.degrees) + 1))

    @cached_property
    def is_fractionated(self) -> bool:
        """Whether a single link parts the chain, so that what is on one side of it moves without the other."""
        beside = neighbour_sets(self.links, self.edges)
        return any(len(_reached(beside, link)) < self.links - 1 for link in range(self.links))

    @cached_property
    def is_planar(self) -> bool:
        """Whether it can be drawn so that no two links cross, whatever their shapes."""
        from networkx import Graph, check_planarity

        ends = ((("pin", number), link) for number, pin in enumerate(self.pins) for link in pin)
        return bool(check_planarity(Graph(ends))[0])

    @property
    def name(self) -> str:
        """What the field calls the chain, or nothing; with slides else what it calls the chain of pins."""
        return chain_name(self.edges, self.slides) or chain_name(self.edges)

    @cached_property
    def pin_chain(self) -> Chain:
        """The chain with pins in place of its slides; itself where it has none."""
        return replace(self, number=self.pin_number, slides=()) if self.slides else self

    def with_slides(self, slides: tuple[int, ...], number: int | None = None) -> Chain:
        """This chain of pins with slides in place of some: their numbers, of those that are alike the first."""
        return replace(self, number=number, slides=slides, pin_number=self.number) if slides else self

    @cached_property
    def symmetry(self) -> ChainSymmetry:
        """Its automorphisms: how many, and which links and which joints they exchange."""
        return chain_symmetry(self.links, self.edges, self.automorphisms)

    @cached_property
    def automorphisms(self) -> tuple[Automorphism, ...]:
        """Every exchange of its links that keeps pins and slides: which link stands in the place of each."""
        if self.slides:
            every = self.pin_chain.automorphisms
            moved = joint_exchanges(every, self.edges)
            kept = ({own[k] for k in self.slides} == {*self.slides} for own in moved)
            return tuple(each for each, is_kept in zip(every, kept, strict=True) if is_kept)
        found = tuple(islice(pin_automorphisms(self.links, self.pins), MAX_AUTOMORPHISMS + 1))
        if len(found) > MAX_AUTOMORPHISMS:
            raise BadInput("links", f"the chain can be exchanged with itself in more than {MAX_AUTOMORPHISMS} ways")
        return found

    @property
    def inversions(self) -> tuple[int, ...]:
        """The links that give different mechanisms where they are fixed: the first of each orbit."""
        return tuple(orbit[0] for orbit in self.symmetry.link_orbits)

    def mechanisms(self, moving_drives: bool = False) -> tuple[ChainMechanism, ...]:
        """All choices of a fixed link and of driven joints, as many as the freedom, that differ up to isomorphism.

        Driven joints are on the fixed link; with `moving_drives` those follow in which some are between moving links,
        as cylinders are. Drives of which one only moves what others move already are left out.

        >>> import planar
        >>> for each in planar.chains(6)[0].mechanisms():
        ...     print(each.frame, each.drives, each.name)
        0 (0,) Watt II six-bar
        0 (1,) Watt II six-bar
        2 (1,) Watt I six-bar
        2 (5,) Watt I six-bar
        """
        found = []
        for moving in (False, True)[: 1 + moving_drives]:
            for frame in self.inversions:
                for drives in self._drive_sets(frame, moving):
                    groups = self.assur_groups(frame, drives)
                    if groups is not None:
                        found.append(ChainMechanism(frame, drives, self.inversion_name(frame), groups))
        return tuple(found)

    def class_counts(self) -> dict[str, int]:
        """How many of its mechanisms that are driven on the fixed link are of which of ASSUR_CLASSES.

        >>> import planar
        >>> planar.chains(6)[1].class_counts()
        {'II': 2, 'III': 2, 'IV': 1}
        """
        count = Counter(each.assur_class for each in self.mechanisms())
        return {each: count[each] for each in ASSUR_CLASSES if count[each]}

    def describe_classes(self) -> str:
        """How many mechanisms are of which class, in words."""
        told = [f"{each}: {count}" for each, count in self.class_counts().items()]
        return ", ".join(told) or "no one link drives it"

    def assur_groups(self, frame: int, drives: Sequence[int]) -> tuple[AssurGroup, ...] | None:
        """The Assur groups of the mechanism with this link fixed and these joints driven, in an order in which they can
        be placed; None where the drives are not as many as the freedom, or one only moves what others move already."""
        if self.slides or self.multiple_pins:
            if not self._position.is_driven(self.slides, drives):
                return None
        elif len(self.pins) == len(self.edges):
            return assur_groups(self.links, self.edges, frame, drives)
        driven = [self.edges[k] for k in drives]
        found = []
        for joints in pin_trees(self.pins, driven):
            groups = assur_groups(self.links, joints, frame, [joints.index(each) for each in driven])
            if groups is not None:
                found.append(groups)
        return max(found, key=len, default=None)

    @cached_property
    def _position(self) -> GeneralPosition:
        return GeneralPosition(self.links, self.edges, self.multiple_pins)

    def inversion_name(self, frame: int) -> str:
        """What the field calls the mechanisms with this link fixed, or nothing; with slides that of the chain of pins,
        where they have none themselves."""
        orbit = next(each for each in self.symmetry.link_orbits if frame in each)
        named = inversion_names(self.edges, self.slides)
        own = next((named[link] for link in orbit if link in named), "")
        return own or (self.pin_chain.inversion_name(frame) if self.slides else "")

    def _drive_sets(self, frame: int, moving: bool) -> Iterator[tuple[int, ...]]:
        """Sets of joints, as many as the freedom, all on the fixed link or not all; of alike ones the first."""
        usable = [number for number, joint in enumerate(self.edges) if moving or frame in joint]
        keeping = joint_exchanges((each for each in self.automorphisms if each[frame] == frame), self.edges)
        for drives in combinations(usable, self.freedom):
            if moving and all(frame in self.edges[joint] for joint in drives):
                continue
            if all(drives <= tuple(sorted(each[joint] for joint in drives)) for each in keeping):
                yield drives

    def mechanism(self, frame: int | None = None, drive: int | Sequence[int] | None = None, seed: int = 0) -> Mechanism:
        """A mechanism of this chain with random dimensions that go together, the same for the same seed.

        `frame` is the number of the fixed link, `drive` that of the driven joint, or of as many as the chain has
        freedoms; left out, the first that fit, pins before slides. Lengths are in mm; joint k of `pins` is the
        letter k of the alphabet. A search looks for dimensions with which the first input turns fully, or slides far,
        see `planar.structures.linkage_search`; the mechanism's notes say whether it turns fully, or between which
        positions it runs. Raises BadInput for what does not drive the chain.

        >>> import planar
        >>> planar.chains(6)[0].mechanism(frame=2, drive=1, seed=1)
        <Mechanism 'Watt I six-bar': 6 links, 7 pairs, driven at B>
        """
        from planar.structures.linkage_dimensions import Linkage
        from planar.structures.linkage_search import find_linkage

        fixed = range(self.links) if frame is None else (check_whole_number("frame", frame, 0, self.links - 1),)
        given = None if drive is None else (drive,) if isinstance(drive, int) else tuple(drive)
        wanted = given and tuple(sorted({check_whole_number("drive", each, 0, len(self.edges) - 1) for each in given}))
        found = next(self._drivable(fixed, wanted), None)
        if found is None:
            usable = next(self._drivable(fixed, None), None)
            if usable is None:
                raise BadInput("frame", f"no joints on link {frame} drive all links; fix another one")
            count = count_phrase(self.freedom, "joint")
            raise BadInput("drive", f"{count} wanted that drive all links, as {usable[1]} with link {usable[0]} fixed")
        frame, drives = found
        ends = tuple(self.edges[joint] for joint in drives)
        return find_linkage(
            Linkage(self.pins, frame, tuple(map(self.pin_of, drives)), tuple(map(self.pin_of, self.slides)), ends),
            check_whole_number("seed", seed, 0),
            self._mechanism_name(frame),
        )

    def pin_of(self, joint: int) -> int:
        """On which of `pins` a joint of `edges` is, by its number."""
        return next(number for number, pin in enumerate(self.pins) if {*self.edges[joint]} <= {*pin})

    def _mechanism_name(self, frame: int) -> str:
        """What the field calls it, else its number in the chains; with slides that the name does not tell."""
        number = "" if self.number is None else f" {self.number}"
        name = self.inversion_name(frame) or self.name
        is_told = not self.slides or inversion_names(self.edges, self.slides)
        beside = "" if name and is_told else joint_kinds_phrase(len(self.slides), extra_links(self.pins))
        return f"{name}{beside}" if name else f"Chain{number} of {self.links} links{beside}, link {frame} fixed"

    def _drivable(self, frames: Iterable[int], wanted: tuple[int, ...] | None) -> Iterator[tuple[int, tuple[int, ...]]]:
        """Fixed links with joints that drive all links: those that are wanted, else any on the fixed link."""
        for frame in frames:
            usable = [number for number, joint in enumerate(self.edges) if frame in joint]
            usable.sort(key=lambda number: number in self.slides)  # cranks before pistons
            for drives in combinations(usable, self.freedom) if wanted is None else (wanted,):
                if self.assur_groups(frame, drives) is not None:
                    yield frame, drives

    def describe(self) -> str:
        """A sentence that tells links, joints, slides, loops and freedom."""
        kinds = ("binary", "ternary", "quaternary", "quinary")
        words = [
            f"{count} {kinds[k] if k < len(kinds) else f'with {k + 2} joints'}"
            for k, count in enumerate(self.assortment)
            if count
        ]
        slides = f" ({count_phrase(len(self.slides), 'slide')})" if self.slides else ""
        return (
            f"{count_phrase(self.links, 'link')} ({', '.join(words)}), {count_phrase(self.joints, 'joint')}{slides}, "
            f"{count_phrase(self.loops, 'loop')}, freedom {self.freedom}"
        )


def _reached(beside: Sequence[set[int]], without: int) -> set[int]:
    """The links that can be reached from one other than a link that is left out."""
    start = 0 if without else 1
    reached, waiting = {start}, [start]
    while waiting:
        for end in beside[waiting.pop()] - reached - {without}:
            reached.add(end)
            waiting.append(end)
    return reached
