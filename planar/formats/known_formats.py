"""The kinds of files that are known: by name, by ending, and recognised by what stands in a file."""

from __future__ import annotations

from functools import cache
from importlib import import_module
from pathlib import PurePath
from pkgutil import iter_modules
from typing import Any

from planar.formats.drawn.file_format import FileFormat, ForeignText
from planar.foundation.errors import BadInput, join_names
from planar.foundation.units import UnitError, parse_unit


@cache
def file_formats() -> dict[str, FileFormat]:
    """Every kind of file of other programs, by its name."""
    from planar.formats import kinds

    modules = [
        import_module(f"{kinds.__name__}.{item.name}") for item in iter_modules(kinds.__path__) if not item.ispkg
    ]
    return {item.name: item for item in (module.FORMAT for module in modules)}


def named_format(name: str | None, own: str) -> FileFormat:
    """The format of a name. Raises BadInput, and tells the names that there are, that of planar's `own` among them."""
    known = file_formats()
    if name not in known:
        raise BadInput(name or "''", f"there is no such format; formats are {join_names(sorted((*known, own)))}")
    return known[name]


def format_by_ending(name: str) -> FileFormat | None:
    """The format that is written to files with this name's ending; None where it is planar's own, or nobody's."""
    suffix = PurePath(name).suffix.lower()
    return next((item for item in file_formats().values() if item.write and suffix in item.suffixes), None)


def writable_endings() -> list[str]:
    """The endings of files by which a format is chosen that can be written."""
    return sorted({suffix for item in file_formats().values() if item.write for suffix in item.suffixes})


def known_links() -> str:
    """The forms of the links that are read, each with its program, as a list for a message."""
    forms = [f"{link} ({kind.title})" for kind in file_formats().values() for link in kind.links]
    return ", ".join([*forms, "planar:... (planar)"])


def foreign_text(content: bytes, place: str, value: Any, length_unit: str | None = None) -> ForeignText:
    """A file's content as a text, beside its value where it is JSON. Raises BadInput where it is no text."""
    text = _decoded(content, place)
    title = "linkage" if place.startswith(("link ", "standard input")) else PurePath(place).stem
    if length_unit is not None:
        _check_length_unit(length_unit)
    return ForeignText(text, value, place, title, length_unit)


def _check_length_unit(name: str) -> None:
    """Refuse what is no unit of length. Raises BadInput."""
    try:
        kind = parse_unit(name).kind
    except UnitError as problem:
        raise BadInput("length unit", str(problem)) from None
    if kind != "length":
        raise BadInput("length unit", f"{name!r} is a unit of {kind}, not of length; give one such as mm, m or in")


def _decoded(content: bytes, place: str) -> str:
    """The characters of a file; Linkage and PMKS save in the code page of their Windows."""
    try:
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as problem:
        if b"<linkage2" not in content[:4000] and b"mech=" not in content[:4000]:
            raise BadInput(place, f"the file is not UTF-8 text (byte {problem.start})") from None
    return content.decode("latin-1")


def recognised_format(source: ForeignText) -> FileFormat | None:
    """The format that a text is of, if any."""
    return next((item for item in file_formats().values() if item.recognise(source)), None)
