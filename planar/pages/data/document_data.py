"""A mechanism's file as a page carries it, and where in it the numbers stand that a page can change."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from planar.document.dimensions import Dimension
from planar.document.files import to_dict
from planar.model.link_shapes import At, Distances, Offset, PointDefinition
from planar.model.mechanism import Input, Mechanism

LENGTH_DEPTH = 3
"""Keys on the way to the length of a link; other lengths place points of it."""


def document_data(mechanism: Mechanism, dimensions: list[Dimension]) -> dict[str, Any]:
    """`value` is the whole file; `dimensions` the path to each; `inputs` of each all positions (SI) with their paths.

    The first of these is the input's own, the others, of a law's tables, lie as far from it as they did.
    """
    value = to_dict(mechanism)
    return {
        "value": value,
        "dimensions": [list(each.path) for each in dimensions],
        "inputs": [
            [{"path": ["inputs", k, *rest], "at": at} for rest, at in _position_paths(given)]
            for k, given in enumerate(mechanism.inputs)
        ],
    }


def dimension_words(mechanism: Mechanism, dimension: Dimension) -> str:
    """What a length of a link is, in words: length, x of E, B to E."""
    part = dimension.name.rsplit(".", 1)[1]
    if len(dimension.path) == LENGTH_DEPTH:
        return part
    point, place = dimension.path[3], _place(mechanism, dimension)
    if isinstance(place, At):
        return f"{part} of {point}"
    if isinstance(place, Offset) and part == "offset":
        return f"offset of {point} from {place.start}{place.towards}"
    return f"{part if isinstance(place, Distances) else place.start} to {point}"


def is_positive_length(mechanism: Mechanism, dimension: Dimension) -> bool:
    """Whether a length of a link is one between two points, and no coordinate or signed distance."""
    return len(dimension.path) == LENGTH_DEPTH or isinstance(_place(mechanism, dimension), Distances)


def _place(mechanism: Mechanism, dimension: Dimension) -> PointDefinition:
    """How the point is described that a length places."""
    _, link, _, point, *_ = dimension.address
    return mechanism.links[int(link)].points[int(point)].place


def _position_paths(given: Input) -> Iterator[tuple[list[str | int], float]]:
    yield ["position"], given.position
    for i, piece in enumerate(given.law.segments if given.law else ()):
        for j, at in enumerate(getattr(piece, "positions", ())):
            yield ["law", i, "positions", j], at
