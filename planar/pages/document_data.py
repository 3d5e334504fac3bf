"""A mechanism's file as a page carries it, and where in it the numbers stand that a page can change."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from planar.document.files import to_dict
from planar.model.dimensions import Dimension
from planar.model.link_shapes import Along, At, PointDefinition
from planar.model.mechanism import Input, Mechanism


def document_data(mechanism: Mechanism, dimensions: list[Dimension]) -> dict[str, Any]:
    """`value` is the whole file; `dimensions` the path to each; `inputs` of each all positions (SI) with their paths.

    The first of these is the input's own, the others, of a law's tables, lie as far from it as they did.
    """
    value = to_dict(mechanism)
    return {
        "value": value,
        "dimensions": [dimension_path(mechanism, each) for each in dimensions],
        "inputs": [
            [{"path": ["inputs", k, *rest], "at": at} for rest, at in _position_paths(given)]
            for k, given in enumerate(mechanism.inputs)
        ],
    }


def dimension_path(mechanism: Mechanism, dimension: Dimension) -> list[str | int]:
    """Where a dimension stands in the file that is written of its mechanism."""
    start: list[str | int] = ["links", dimension.link]
    point, part, place = _dimension_parts(mechanism, dimension)
    if place is None:
        return [*start, part]
    if isinstance(place, At):
        return [*start, "points", point, "xy".index(part)]
    return [*start, "points", point, *([] if isinstance(place, Along) else ["distances"]), part]


def dimension_words(mechanism: Mechanism, dimension: Dimension) -> str:
    """What a dimension is of its link, in words: length, x of E, B to E."""
    point, part, place = _dimension_parts(mechanism, dimension)
    if place is None:
        return part
    if isinstance(place, At):
        return f"{part} of {point}"
    return f"{place.start if isinstance(place, Along) else part} to {point}"


def is_positive_length(mechanism: Mechanism, dimension: Dimension) -> bool:
    """Whether a dimension is a length between two points, and no coordinate or signed distance."""
    return not isinstance(_dimension_parts(mechanism, dimension)[2], At | Along)


def _dimension_parts(mechanism: Mechanism, dimension: Dimension) -> tuple[str, str, PointDefinition | None]:
    """The point that a dimension places, what it is of it, and how that point is described; of a length no point."""
    what = dimension.name.removeprefix(f"{dimension.link}.")
    link = next(each for each in mechanism.links if each.name == dimension.link)
    for point in link.points:
        part = what.removeprefix(f"{point.name}.")
        if part != what and part in _length_names(point.place):
            return point.name, part, point.place
    return "", what, None


def _length_names(place: PointDefinition) -> tuple[str, ...]:
    """The names that the lengths of a place have."""
    if isinstance(place, At):
        return "x", "y"
    return ("distance",) if isinstance(place, Along) else (place.first, place.second)


def _position_paths(given: Input) -> Iterator[tuple[list[str | int], float]]:
    yield ["position"], given.position
    for i, piece in enumerate(given.law.segments if given.law else ()):
        for j, at in enumerate(getattr(piece, "positions", ())):
            yield ["law", i, "positions", j], at
