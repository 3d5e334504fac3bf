"""A mechanism with nothing but what its motion depends on, so that no other number can refuse a design."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from planar.foundation.arrays import Array
from planar.model.link_shapes import Along, Distances, Link, link_shape
from planar.model.mechanism import Mechanism, named_points


def bare_mechanism(mechanism: Mechanism, points: Iterable[str] = ()) -> Mechanism:
    """The mechanism without points that no pair needs, but for those in `points` (by result name or as `link.point`).

    Loads, springs, masses, stops, laws of inputs and what a book prints are left out as well.
    """
    wanted = set(points)
    named = {member: each.name for each in named_points(mechanism) for member in each.members}
    said = {*_texts(mechanism.pairs)}
    links = []
    for link in mechanism.links:
        kept = {
            name
            for name in link.names
            if name in said or f"{link.name}.{name}" in wanted or named[link.name, name] in wanted
        }
        links.append(_with_points(link, kept))
    changed = replace(
        mechanism,
        links=tuple(links),
        inputs=tuple(given._replace(law=None, motor=None) for given in mechanism.inputs),
        loads=(),
        springs=(),
        masses=(),
        stops=(),
        published=(),
        notes=(),
        remarks=(),
        tolerances=None,
        pair_stiffness=(),
    )
    left = {name for each in named_points(changed) for name in (each.name, *map(".".join, each.members))}
    return replace(changed, sketch=tuple(each for each in mechanism.sketch if each[0] in left))


def length_scale(mechanism: Mechanism) -> float:
    """How large links are (m), 1 without any: the root mean square of the greatest distances between points of each."""
    places = map(_places, mechanism.links)
    extents = [float(np.max(np.abs(at[:, None] - at), initial=0.0)) for at in places]
    sizes = [each for each in extents if each > 0.0]
    return float(np.sqrt(np.mean(np.square(sizes)))) if sizes else 1.0


def centre(link: Link) -> complex:
    """The middle of a link's points in the axes in which it was drawn (m); 0 where there are none."""
    places = _places(link)
    return complex(places.mean()) if len(places) else 0j


def _places(link: Link) -> Array:
    shape = link_shape(link)
    at = [shape.position(name) for name in link.names]
    return np.array([complex(each.x, each.y) for each in at])


def _with_points(link: Link, kept: set[str]) -> Link:
    """The link with these points and those on which they rest."""
    definitions = {point.name: point.place for point in link.points}
    needed = [*kept, *(link.ends or ()), *(link.axis or ())]
    found = set[str]()
    while needed:
        name = needed.pop()
        if name not in found:
            found.add(name)
            needed += _bases(definitions.get(name))
    return replace(link, points=tuple(point for point in link.points if point.name in found))


def _bases(place: Any) -> tuple[str, ...]:
    if isinstance(place, Along):
        return place.start, place.towards
    return (place.first, place.second) if isinstance(place, Distances) else ()


def _texts(value: Any) -> Iterator[str]:
    """Every text in nested data, so that any point that a pair could mean is kept."""
    if isinstance(value, str):
        yield value
    elif is_dataclass(value) and not isinstance(value, type):
        for each in fields(value):
            yield from _texts(getattr(value, each.name))
    elif isinstance(value, Mapping):
        for key, each in value.items():
            yield from _texts(key)
            yield from _texts(each)
    elif isinstance(value, tuple | list | set | frozenset):
        for each in value:
            yield from _texts(each)
