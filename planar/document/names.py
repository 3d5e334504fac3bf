"""The relative motions and points that a file names, looked up among those that there are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from planar.document.cursor import Cursor, did_you_mean, offered
from planar.foundation.errors import listed
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs import Pair, joining


def motion(cursor: Cursor, known: Mapping[str, Pair]) -> Pair:
    name = cursor.as_text()
    if name in known:
        return known[name]
    parts = [other for other in known if other.startswith(f"{name}:")]
    if parts:
        raise cursor.refuse(None, f"{name!r} joins several links; say which two move: {' or '.join(map(repr, parts))}")
    reverse = name.partition(":")[0] + ":" + ",".join(reversed(name.partition(":")[2].split(",")))
    if reverse in known:
        raise cursor.refuse(None, f"the links of {name!r} stand in the other order in the file; write {reverse!r}")
    carriers = cursor.carriers(name)
    if len(carriers) > 1:
        told = (
            f"there is no pair {name!r}, though {_links(carriers)} carry that point; add {joining(name)} to the pairs"
        )
        raise cursor.refuse(None, told)
    raise cursor.refuse(None, f"there is no pair {name!r}{offered(name, known, 'pairs')}")


def _links(names: Iterable[str]) -> str:
    return f"links {listed(map(repr, names))}"


def point_names(mechanism: Mechanism) -> dict[str, str]:
    """Every way to write a point, and the name that results give it."""
    named = named_points(mechanism)
    return {f"{link}.{point}": each.name for each in named for link, point in each.members} | {
        each.name: each.name for each in named
    }


def point_named(cursor: Cursor, name: str, points: Mapping[str, str]) -> str:
    if name in points:
        return points[name]
    several = [other for other in points if other.endswith(f".{name}")]
    if several:
        told = f"several points are called {name!r}; write {listed(map(repr, several), last=' or ')}"
        if len(cursor.carriers(name)) > 1 and name not in points.values():
            told += f", or add {joining(name)} to the pairs, if it is one pin of {_links(cursor.carriers(name))}"
        raise cursor.refuse(None, told)
    near = did_you_mean(name, points) or offered(name, dict.fromkeys(points.values()), "points")
    raise cursor.refuse(None, f"there is no point {name!r}{near}")
