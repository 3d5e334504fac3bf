"""The code in links of PMKS+: numbers in base 64, thousandths, signs by a leading 0, parts that end in a dot."""

from __future__ import annotations

from typing import NamedTuple

from planar.foundation.errors import BadInput

DIGITS = "0123456789ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz_-"
CHECK_DIGITS = DIGITS[:62]


class CodedLink(NamedTuple):
    """A link of PMKS+ taken apart: its head, and the joints, links and forces as lists of their fields."""

    flags: str
    integers: list[str]
    units: str
    joints: list[list[str]]
    links: list[list[str]]
    forces: list[list[str]]


def encode_integer(value: int) -> str:
    """A whole number in base 64; a negative one begins with 0."""
    rest, found = abs(value), ""
    while rest or not found:
        rest, digit = divmod(rest, 64)
        found = DIGITS[digit] + found
    return ("0" if value < 0 else "") + found


def encode_decimal(value: float) -> str:
    """A number in thousandths."""
    return encode_integer(round(value * 1000.0))


def decode_integer(text: str, place: str) -> int:
    """A whole number of a link. Raises BadInput."""
    negative = text.startswith("0")
    value = 0
    if not text or len(text) > 40:
        raise BadInput(place, f"{text!r:.40} is no number of PMKS+")
    for each in text:
        digit = DIGITS.find(each)
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
    for each in rest:
        if each:
            sections[-1].append(each.split(","))
        else:
            sections.append([])
    sections += [[], [], []]
    return CodedLink(head[0], head[2].split(","), head[3], sections[0], sections[1], sections[2])


def put_together(coded: CodedLink, scale: str) -> str:
    """The code of a link from its parts."""
    head = f"{coded.flags}.{scale}.{','.join(coded.integers)}.{coded.units}"
    joints, links, forces = (
        "".join(",".join(each) + "." for each in part) for part in (coded.joints, coded.links, coded.forces)
    )
    body = f"{head}.{joints}.{links}.{forces}.N_"
    return body + check_digit(body)
