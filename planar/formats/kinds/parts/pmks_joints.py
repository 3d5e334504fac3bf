"""The joints of PMKS, which its texts and its `.pmks` files have in common, to a linkage."""

from __future__ import annotations

from typing import NamedTuple

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    Joint,
    PinJoint,
    SlideJoint,
    SlotJoint,
    Tracer,
    unit_note,
)
from planar.formats.drawn.file_format import ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links_of_two_pins, without_loose_links
from planar.formats.drawn.wheels import meshing_gears
from planar.formats.texts.names import NameBook
from planar.foundation.errors import BadInput

FRAME = "ground"


class PmksJoint(NamedTuple):
    """A joint of PMKS: R, P, RP or G, with an angle in degrees; of P and RP the first link has the slot."""

    links: tuple[str, ...]
    kind: str
    x: float
    y: float
    angle: float
    driven: bool


def pmks_document(
    source: ForeignText, given: list[PmksJoint], notes: tuple[str, ...] = (), velocity: float = 0.0
) -> ReadDocument:
    """The planar file of these joints. Raises BadInput where one cannot be."""
    book = NameBook({FRAME})
    joints: list[Joint] = []
    tracers: list[Tracer] = []
    drives: list[DrawnInput] = []
    pins = _merged_pins([item._replace(links=_link_names(item.links, book)) for item in given])
    letters = iter(_letters())
    for number, item in enumerate(pins, 1):
        place, at = f"{source.place}, joint {number}", (item.x, item.y)
        name = book.fresh(next(letters))
        if len(item.links) == 1:
            if item.kind != "R":
                raise BadInput(place, f"a joint of type {item.kind} joins two links, not {item.links[0]!r} alone")
            tracers.append(Tracer(name, item.links[0], at))
            continue
        if item.kind == "R":
            joints.append(PinJoint(name, item.links, at))
        elif item.kind == "G":
            joints.append(meshing_gears(name, (item.links[0], item.links[1]), at, _pin_joints(pins), place))
        else:
            joints += _sliding(name, item, book)
        if item.driven and item.kind in ("R", "P"):
            drives.append(_drive(name, item, velocity))
        elif item.driven:
            raise BadInput(place, f"a joint of type {item.kind} cannot be driven; that is one of type R or P")
    if not drives:
        drives = _first_drive(joints, velocity)
    length = source.length_unit or "mm"
    linkage = DrawnLinkage(
        source.title, FRAME, tuple(joints), tuple(tracers), tuple(drives[:1]), length=length, notes=notes
    )
    if len(drives) > 1:
        linkage = linkage.with_notes(f"the input at {drives[1].joint!r} is left out: the first drives alone")
    merged = without_loose_links(merge_links_of_two_pins(linkage.with_notes(unit_note(length))))
    return drawn_document(merged, source.place)


def _link_names(links: tuple[str, ...], book: NameBook) -> tuple[str, ...]:
    """The links of a joint, each once; what is called ground stands still."""
    result = (FRAME if item.lower() in ("ground", "gnd") else book.name("link", item) for item in links)
    return tuple(dict.fromkeys(result))


def _merged_pins(given: list[PmksJoint]) -> list[PmksJoint]:
    """The joints, those pins as one that lie on one another and share a link."""
    result: list[PmksJoint] = []
    for item in given:
        same = [
            index
            for index, other in enumerate(result)
            if item.kind == other.kind == "R"
            and (item.x, item.y) == (other.x, other.y)
            and set(item.links) & set(other.links)
            and min(len(item.links), len(other.links)) > 1
        ]
        if same:
            other = result[same[0]]
            links = tuple(dict.fromkeys((*other.links, *item.links)))
            result[same[0]] = other._replace(links=links, driven=other.driven or item.driven)
        else:
            result.append(item)
    return result


def _pin_joints(given: list[PmksJoint]) -> list[Joint]:
    return [PinJoint("", item.links, (item.x, item.y)) for item in given if item.kind == "R" and len(item.links) > 1]


def _sliding(name: str, given: PmksJoint, book: NameBook) -> list[Joint]:
    """A slide, or a pin in a slot; further links are on the same block, or on the same pin."""
    guide, first, *others = given.links
    at = (given.x, given.y)
    if given.kind == "P":
        more = [SlideJoint(book.fresh(f"{name}_{item}"), guide, item, at, given.angle) for item in others]
        return [SlideJoint(name, guide, first, at, given.angle), *more]
    pin = [PinJoint(book.fresh(f"{name}_pin"), (first, *others), at)] if others else []
    return [*pin, SlotJoint(name, guide, first, at, given.angle)]


def _drive(name: str, given: PmksJoint, velocity: float) -> DrawnInput:
    """What a driven joint turns or moves: against the ground where that is there, else the second link."""
    if FRAME in given.links and given.kind == "R":
        other = next(item for item in given.links if item != FRAME)
        return DrawnInput(name, (FRAME, other), velocity)
    return DrawnInput(name, (given.links[0], given.links[1]), velocity)


def _first_drive(joints: list[Joint], velocity: float) -> list[DrawnInput]:
    """The first pin on the ground, which drives where no joint says that it does."""
    pins = [item for item in joints if isinstance(item, PinJoint) and FRAME in item.links]
    return [
        DrawnInput(item.name, (FRAME, next(link for link in item.links if link != FRAME)), velocity)
        for item in pins[:1]
    ]


def _letters() -> list[str]:
    """A to Z, then with numbers."""
    return [chr(65 + n % 26) + (str(n // 26) if n >= 26 else "") for n in range(6000)]
