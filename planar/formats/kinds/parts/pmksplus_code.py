"""The code in links of PMKS+: numbers in base 64, thousandths, signs by a leading 0, parts that end in a dot."""

from __future__ import annotations

from typing import NamedTuple

from planar.formats.drawn.drawn_linkage import Place
from planar.foundation.errors import BadInput

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
CHECK_DIGITS = DIGITS[:62]
LENGTHS, FORCES = {0: "in", 1: "cm", 2: "m"}, {0: "lbf", 1: "N"}
"""Units by their numbers in the head."""
PRISMATIC, DRIVEN, GROUNDED, WELDED, SEALED = 1, 2, 4, 8, 32
"""Bits of a joint's flags; the slide of a hydraulic cylinder is sealed."""
WHOLE_LINKS, PARTS_OF_LINKS = "YAMG0123", "Namg4567"
"""First signs of links, and of links that are welded in another one; they also say what of a mass its author chose."""
DEFAULT_LINEAR_SPEED = 5.0
"""The speed of a driven slide (unit of length per second) of links that say none."""


class PlusJoint(NamedTuple):
    """A joint of PMKS+; `slot` is the link with the slot and its two joints, `speed` that of this joint alone."""

    name: str
    at: Place
    flags: int
    angle: float = 0.0
    slot: tuple[str, str, str] | None = None
    speed: float = 0.0


class PlusLink(NamedTuple):
    """A link of PMKS+, or a block without extent; `parts` are the links that are welded in it."""

    name: str
    joints: tuple[str, ...]
    is_block: bool
    mass: float = 0.0
    parts: tuple[str, ...] = ()


class PlusForce(NamedTuple):
    """A force of PMKS+ from one place to another; it points back where it is not outward."""

    name: str
    link: str
    start: Place
    end: Place
    magnitude: float
    is_local: bool
    is_outward: bool


class PlusMechanism(NamedTuple):
    """The mechanism of a link of PMKS+, its joints, links and forces by the names that it uses for them.

    `rpm` is the speed of a driven pin, `linear_speed` that of a driven slide (unit of length per second), None where
    the link does not say it; both are signed. `scale` is the size of the drawn parts, on which strokes depend.
    """

    joints: dict[str, PlusJoint]
    links: dict[str, PlusLink]
    forces: tuple[PlusForce, ...]
    length: str
    force: str
    rpm: float
    linear_speed: float | None
    scale: float
    notes: tuple[str, ...] = ()


class CodedLink(NamedTuple):
    """A link of PMKS+ split into its head, and the joints, links and forces as lists of their fields."""

    flags: str
    decimals: list[str]
    integers: list[str]
    units: str
    joints: list[list[str]]
    links: list[list[str]]
    forces: list[list[str]]


def encode_integer(value: int) -> str:
    """A whole number in base 64; a negative one begins with 0."""
    rest, result = abs(value), ""
    while rest or not result:
        rest, digit = divmod(rest, 64)
        result = DIGITS[digit] + result
    return ("0" if value < 0 else "") + result


def encode_decimal(value: float) -> str:
    """A number in thousandths."""
    return encode_integer(round(value * 1000.0))


def decode_integer(text: str, place: str) -> int:
    """A whole number of a link. Raises BadInput."""
    negative = text.startswith("0")
    value = 0
    if not text or len(text) > 40:
        raise BadInput(place, f"{text!r:.40} is no number of PMKS+")
    for item in text:
        digit = DIGITS.find(item)
        if digit < 0:
            raise BadInput(place, f"{text!r:.40} is no number of PMKS+")
        value = 64 * value + digit
    return -value if negative else value


def decode_decimal(text: str, place: str) -> float:
    """A number in thousandths of a link. Raises BadInput."""
    return decode_integer(text, place) / 1000.0


def decode_flags(text: str, place: str) -> int:
    """Flags as the bits of a number. Raises BadInput."""
    return abs(decode_integer(text, place))


def check_digit(text: str) -> str:
    """The digit that ends a link: its length modulo 62."""
    return CHECK_DIGITS[len(text) % 62]


def take_apart(text: str, place: str) -> CodedLink:
    """The parts of a link's code. Raises BadInput where it is cut short or is none."""
    body, check = text[:-1], text[-1:]
    if check != check_digit(body):
        raise BadInput(place, "the link is cut short or changed: its last sign does not fit its length")
    parts = body.split(".")
    if len(parts) < 4:
        raise BadInput(place, "this is no link of PMKS+: it has too few parts")
    head, rest = parts[:4], parts[4:]
    sections: list[list[list[str]]] = [[]]
    for item in rest:
        if item:
            sections[-1].append(item.split(","))
        else:
            sections.append([])
    sections += [[], [], []]
    return CodedLink(head[0], head[1].split(","), head[2].split(","), head[3], *sections[:3])


def decode_mechanism(text: str, place: str) -> PlusMechanism:
    """The mechanism of a link's code. Raises BadInput."""
    coded = take_apart(text, place)
    joints = {}
    for fields in coded.joints:
        if len(fields) < 5 or len(fields[0]) < 2:
            raise BadInput(place, f"a joint of the link has too few parts: {','.join(fields)!r:.60}")
        key, where = fields[0][1:], f"{place}, joint {fields[0][1:]}"
        if key in joints:
            raise BadInput(where, "there are two joints of this name")
        flags = decode_flags(fields[0][:1], where)
        x, y, angle = (decode_decimal(item, where) for item in fields[2:5])
        slot = (fields[5], fields[6], fields[7]) if len(fields) >= 8 and fields[5] else None
        speed = decode_decimal(fields[8], where) if len(fields) >= 9 and fields[8] else 0.0
        joints[key] = PlusJoint(fields[1] or key, (x, y), flags, angle, slot, speed)
    links = dict(_decode_link(fields, place) for fields in coded.links if fields[0][:1] not in PARTS_OF_LINKS)
    sense = -1.0 if decode_flags(coded.flags or "0", place) & 1 else 1.0
    decimals = [decode_decimal(item, place) for item in coded.decimals if item]
    linear_speed = sense * (decimals[1] if len(decimals) > 1 and decimals[1] else DEFAULT_LINEAR_SPEED)
    return PlusMechanism(
        joints,
        links,
        tuple(_decode_force(fields, place) for fields in coded.forces),
        _unit(coded.units, 0, LENGTHS, "cm", place),
        _unit(coded.units, 2, FORCES, "N", place),
        sense * (decode_integer(coded.integers[0], place) if coded.integers[0] else 0),
        linear_speed,
        decimals[0] if decimals else 1.0,
    )


def _unit(text: str, index: int, units: dict[int, str], default: str, place: str) -> str:
    return units.get(decode_integer(text[index], place), default) if index < len(text) else default


def _decode_link(fields: list[str], place: str) -> tuple[str, PlusLink]:
    head = fields[0]
    if len(head) < 3 or len(fields) < 8 or head[0] not in WHOLE_LINKS or head[1] not in "RP":
        raise BadInput(place, f"a part of the link is no link: {','.join(fields)!r:.60}")
    listed = fields[7:]
    end = listed.index("") if "" in listed else len(listed)
    parts = tuple(item for item in listed[end:] if item)
    mass = decode_decimal(fields[2], place) if fields[2] else 0.0
    return head[2:], PlusLink(fields[1] or head[2:], tuple(listed[:end]), head[1] == "P", mass, parts)


def _decode_force(fields: list[str], place: str) -> PlusForce:
    if len(fields) < 8 or not fields[0]:
        raise BadInput(place, f"a force of the link is none: {','.join(fields)!r:.60}")
    flags = decode_flags(fields[0][:1], place)
    x, y, u, v, size = (decode_decimal(item, place) for item in fields[3:8])
    return PlusForce(fields[2], fields[1], (x, y), (u, v), size, bool(flags & 1), bool(flags & 2))


def put_together(coded: CodedLink) -> str:
    """The code of a link from its parts."""
    head = f"{coded.flags}.{','.join(coded.decimals)}.{','.join(coded.integers)}.{coded.units}"
    joints, links, forces = (
        "".join(",".join(item) + "." for item in part) for part in (coded.joints, coded.links, coded.forces)
    )
    body = f"{head}.{joints}.{links}.{forces}.N_"
    return body + check_digit(body)
