"""XML of other programs' files: elements and attributes alone, nothing declared, nothing expanded, nothing fetched."""

from __future__ import annotations

from xml.etree.ElementTree import Element, ParseError, TreeBuilder, XMLParser

from planar.foundation.errors import BadInput

MAX_ELEMENTS, MAX_DEPTH = 100_000, 50
"""Of a file; a mechanism of a thousand links has a few thousand elements, five deep."""


class _PlainTree(TreeBuilder):
    """Builds elements, and refuses a declared type of document, with which entities come."""

    def __init__(self, place: str) -> None:
        super().__init__()
        self._place, self._depth, self._count = place, 0, 0

    def start(self, tag: str, attrs: dict[str, str], /) -> Element:
        self._depth += 1
        self._count += 1
        if self._depth > MAX_DEPTH or self._count > MAX_ELEMENTS:
            raise BadInput(self._place, "the file is larger or nested deeper than a mechanism can be")
        return super().start(tag, attrs)

    def end(self, tag: str, /) -> Element:
        self._depth -= 1
        return super().end(tag)

    def doctype(self, name: str, pubid: str | None, system: str | None) -> None:
        raise BadInput(self._place, "the file declares a type of document or entities, which no mechanism needs")


def parse_xml(text: str, place: str) -> Element:
    """The root of an XML text. Raises BadInput at a line, and for any declaration of a type of document or entity.

    A declaration is refused where it starts, before any entity that it defines could be expanded.
    """
    if "<!DOCTYPE" in text.upper() or "<!ENTITY" in text.upper():
        raise BadInput(place, "the file declares a type of document or entities, which no mechanism needs")
    parser = XMLParser(target=_PlainTree(place))
    try:
        parser.feed(text.encode())
        root: Element = parser.close()
    except ParseError as problem:
        line, column = problem.position
        raise BadInput(
            place, f"this is not XML: {str(problem).partition(':')[0]} at line {line}, column {column + 1}"
        ) from None
    return root


def number_attribute(element: Element, name: str, place: str, default: float | None = None) -> float:
    """The number of an attribute; the default where it is not there. Raises BadInput."""
    text = element.get(name)
    if text is None or not text.strip():
        if default is None:
            raise BadInput(place, f"there is no {name!r} here")
        return default
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not abs(value) < 1e300:
        raise BadInput(place, f"a number is wanted for {name!r}, not {text!r:.60}")
    return value
