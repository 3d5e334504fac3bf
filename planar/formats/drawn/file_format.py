"""What another program's kind of file says of itself: its name, how it is recognised, how it is read and written."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

from planar.formats.drawn.drawn_linkage import DrawnLinkage
from planar.foundation.errors import BadInput


class ForeignText(NamedTuple):
    """The text of a file, its value where it is JSON, and where it is from, for sentences."""

    text: str
    value: Any
    place: str
    title: str
    length_unit: str | None = None
    """The unit of length that the caller gives for a file that names none."""


class ReadDocument(NamedTuple):
    """A mechanism as a planar file has it, and what of the other program's file could not be taken over."""

    document: dict[str, Any]
    notes: tuple[str, ...]


class WrittenText(NamedTuple):
    """The text of another program's file, and what of the mechanism it cannot say beside the motion."""

    text: str
    notes: tuple[str, ...]
    says_stops: bool = False
    """Whether the text says stops, so that its notes name those that it does not say."""
    says_curved_slots: bool = False
    """The same of curved slots."""


class FileFormat(NamedTuple):
    """One kind of file. `read` raises BadInput at a place of the file, `write` where it cannot say the mechanism."""

    name: str
    """By which commands call it."""
    title: str
    """For people: the program and what it saves."""
    suffixes: tuple[str, ...]
    """Endings of its files, by which one is chosen that is to be written."""
    source: str
    """Where the form is described, or what it was learnt from."""
    recognise: Callable[[ForeignText], bool]
    read: Callable[[ForeignText], ReadDocument]
    write: Callable[[DrawnLinkage], WrittenText] | None = None
    precision: str = ""
    """What its numbers are rounded to where it is written."""
    links: tuple[str, ...] = ()
    """The forms of the links that hold a mechanism of this kind, for a message that lists them."""
    names_length_unit: bool = True
    """Whether its files say their unit of length, so that none can be given."""


def cannot_say(title: str, what: str, why: str = "") -> BadInput:
    """That a format has nothing for a part of a mechanism, as an error."""
    return BadInput(title, f"{what} cannot be said in this format{'; ' + why if why else ''}")
