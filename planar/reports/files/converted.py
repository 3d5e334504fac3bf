"""Mechanisms from other programs' files, and into them."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from planar.document.files import OWN_FORMAT, as_mechanism, dumps, read_source
from planar.formats.drawn.drawn_linkage import DrawnLinkage, curved_slot_notes, lost_stop_notes
from planar.formats.drawn.file_format import WrittenText
from planar.formats.known_formats import file_formats, format_by_ending, named_format, writable_endings
from planar.foundation.errors import unknown_format_error
from planar.foundation.safe_files import save_file
from planar.model.mechanism import Mechanism


@dataclass(frozen=True)
class Conversion:
    """A mechanism taken from one kind of file to another, and what of it could not be taken over.

    `source_format` and `target_format` are names of formats, "planar" that of planar's own; `notes` are sentences.
    """

    mechanism: Mechanism
    source_format: str
    target_format: str
    text: str
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        message = f", {len(self.notes)} notes" if self.notes else ""
        return f"<Conversion of {self.mechanism.name!r} from {self.source_format} to {self.target_format}{message}>"


def convert(
    source: Mechanism | str | os.PathLike[str],
    target: str | os.PathLike[str] | None = None,
    *,
    to_format: str | None = None,
    from_format: str | None = None,
    length_unit: str | None = None,
) -> Conversion:
    """A mechanism, a file of any program, a link of PMKS+ or a model's name, as the text of another kind of file.

    The kind is that named by `to_format` ("planar", "linkage2", "pmks", "pmksplus", "pyslvs", "linkage_sim"), else that
    of the target's ending, else planar's own; the kind of the source is recognised, unless `from_format` names it.
    `length_unit` is the unit of length of a file that names none, such as "m". The text is written to `target`, if that
    is named. Raises BadInput where a kind cannot say the mechanism, naming the link or pair, and for files that cannot
    be read; NoAnswer where the mechanism cannot be assembled to be drawn.

    >>> import planar
    >>> print(planar.convert("four-bar", to_format="pmks").text.splitlines()[1])
    ground,AB,R,0.0,0.0,0.0,tfft
    """
    if isinstance(source, Mechanism) or not isinstance(source, str | os.PathLike):
        return write_conversion(as_mechanism(source), None, (), target, to_format)
    return write_conversion(*read_source(source, from_format, length_unit), target, to_format)


def write_conversion(
    mechanism: Mechanism,
    kind: str | None,
    notes: tuple[str, ...],
    target: str | os.PathLike[str] | None,
    to_format: str | None,
) -> Conversion:
    """A mechanism that was read, of this kind and with these notes, as the text of another kind of file."""
    named = to_format or _format_of(target)
    written = WrittenText(dumps(mechanism), ()) if named == OWN_FORMAT else written_text(mechanism, named)
    if target is not None:
        save_file(Path(target), written.text)
    return Conversion(mechanism, kind or OWN_FORMAT, named, written.text, (*notes, *written.notes))


def _format_of(target: str | os.PathLike[str] | None) -> str:
    """The name of the format that a file's ending chooses."""
    if target is None or Path(target).suffix.lower() in ("", ".json"):
        return OWN_FORMAT
    result = format_by_ending(os.fsdecode(target))
    if result is None:
        raise unknown_format_error(Path(target).suffix, "a mechanism", [".json", *writable_endings()])
    return result.name


def written_text(mechanism: Mechanism, name: str) -> WrittenText:
    """The mechanism where its inputs stand as another program's text."""
    from planar.formats.drawn.drawn_mechanism import drawn_mechanism
    from planar.solving.position import rest_position

    kind = named_format(name, OWN_FORMAT)
    if kind.write is None:
        writable = [item.name for item in file_formats().values() if item.write]
        raise unknown_format_error("", f"a mechanism ({kind.title} is only read)", [*writable])
    drawn = drawn_mechanism(mechanism, rest_position(mechanism).frames, kind.title)
    result = kind.write(drawn)
    notes = (*drawn.notes, *_omissions(drawn, name, result), *result.notes)
    return result._replace(notes=tuple(dict.fromkeys(notes)))


def _omissions(drawn: DrawnLinkage, name: str, text: WrittenText) -> list[str]:
    """What the text does not say of stops, curved slots, masses, forces and gravity, as notes."""
    notes = [] if text.says_stops else lost_stop_notes(drawn)
    notes += [] if text.says_curved_slots else curved_slot_notes(drawn)
    if drawn.masses and name != "linkage_sim":
        notes.append("masses are left out: the format has none, or no unit for them")
    if drawn.forces:
        notes.append("forces are left out: the format has none, or no unit for them")
    if any(drawn.gravity):
        notes.append("gravity is left out: the format has none")
    return notes
