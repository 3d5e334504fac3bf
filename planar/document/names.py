"""The relative motions and points that a file names, looked up among those that there are."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

from planar.document.cursor import Cursor
from planar.foundation.errors import join_names, suggest_name, suggest_spelling
from planar.model.mechanism import Mechanism, named_points
from planar.model.pairs import Pair, joining_entry_text


def find_motion(cursor: Cursor, known: Mapping[str, Pair]) -> Pair:
    name = cursor.as_text()
    if name in known:
        return known[name]
    parts = [other for other in known if other.startswith(f"{name}:")]
    if parts:
        raise cursor.error_at(
            None, f"{name!r} joins several links; say which two move: {' or '.join(map(repr, parts))}"
        )
    reverse = name.partition(":")[0] + ":" + ",".join(reversed(name.partition(":")[2].split(",")))
    if reverse in known:
        raise cursor.error_at(None, f"the links of {name!r} stand in the other order in the file; write {reverse!r}")
    carriers = cursor.links_with_point(name)
    if len(carriers) > 1:
        told = (
            f"there is no pair {name!r}, though {_links_phrase(carriers)} carry that point; add "
            f"{joining_entry_text(name)} to the pairs"
        )
        raise cursor.error_at(None, told)
    raise cursor.error_at(None, f"there is no pair {name!r}{suggest_name(name, known, 'pairs')}")


def _links_phrase(names: Iterable[str]) -> str:
    return f"links {join_names(map(repr, names))}"


def point_aliases(mechanism: Mechanism) -> dict[str, str]:
    """Every way to write a point, and the name that results give it."""
    named = named_points(mechanism)
    return {f"{link}.{point}": each.name for each in named for link, point in each.members} | {
        each.name: each.name for each in named
    }


def find_point(cursor: Cursor, name: str, points: Mapping[str, str]) -> str:
    if name in points:
        return points[name]
    several = [other for other in points if other.endswith(f".{name}")]
    if several:
        told = f"several points are called {name!r}; write {join_names(map(repr, several), last_joiner=' or ')}"
        if len(cursor.links_with_point(name)) > 1 and name not in points.values():
            told += (
                f", or add {joining_entry_text(name)} to the pairs, if it is one pin of "
                f"{_links_phrase(cursor.links_with_point(name))}"
            )
        raise cursor.error_at(None, told)
    written = dict.fromkeys(points.values())
    is_alias_near = suggest_spelling(name, points) and not suggest_spelling(name, written)
    hint = suggest_name(name, points if is_alias_near else written, "points")
    raise cursor.error_at(None, f"there is no point {name!r}{hint}")
