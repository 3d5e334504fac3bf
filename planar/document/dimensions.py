"""The numbers of a mechanism's file: the name of each, its value and kind, and where it is.

A number's name is its place in the file, by the names of links, pairs and inputs: `BC.length`, `b.P.angle`, `AD.D.x`,
`BC.F.B` (the distance of F from B), `stroke.line.angle`, `wheels.radii.0`, `A.velocity`, `A.law.0.by`,
`loads.0.force.x`, `springs.0.stiffness`, `masses.rod.mass`, `gravity.y`, `sketch.B.x`. What a file leaves out has its
default. Where two numbers would bear one name, as a point `line` of a link A and the line of a pair A, both have the
word of their list before it: `links.A.line.x` and `pairs.A.line.x`.

Names, kinds and places are read off what the writer writes of the mechanism's own data, so that a new pair, or motion
of a law, has its numbers named by being written.
"""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import fields, is_dataclass, replace
from functools import cache
from numbers import Real
from typing import Any, NamedTuple

from planar.document.common_pair_keys import write_stops
from planar.document.loads import write_load, write_mass, write_spring
from planar.document.writer import write_input, write_link
from planar.foundation.errors import BadInput, join_names, suggest_name
from planar.model.input_laws import SEGMENT_TYPES
from planar.model.mechanism import Mechanism, pair_entries, relative_motions
from planar.model.pairs import Pair

Address = tuple[str | int, ...]
"""Where a number is in nested data: fields by name, items by number."""
NAMED_LISTS = ("links", "pairs", "inputs")
"""Lists of a file whose entries have names of their own."""
OTHER_LISTS = ("loads", "springs", "masses", "gravity", "sketch")
SPELLINGS: dict[tuple[str | int, int, str], str] = {
    ("links", 2, "points"): "",
    ("links", 4, "distances"): "",
    ("pairs", 3, "through"): "",
    **{("springs", 2, key): "free" for key in ("free_length", "free_angle")},
}
"""Keys that a name spells otherwise than the file, by their list and depth there."""
LAW_LISTS = frozenset(name for kind in SEGMENT_TYPES.values() for name, key in kind.keys.items() if key.is_list)
MOTOR_LISTS = frozenset({"speeds", "torques", "forces"})
VARIATION_LISTS = frozenset({"at", "factors"})
"""Keys whose numbers are counted; of other keys two numbers are x and y."""


class Dimension(NamedTuple):
    """A number of a mechanism's file: its name, its value (SI), and the kind of quantity that it is.

    `link` is the link that it describes, empty where it describes none; `path` its place in the file that is written of
    the mechanism, `address` its place in the mechanism itself.
    """

    name: str
    value: float
    kind: str
    link: str
    path: Address
    address: Address


def file_dimensions(mechanism: Mechanism) -> dict[str, Dimension]:
    """Every number of a mechanism's file by name, in the order of the file."""
    found = list(_every_dimension(mechanism))
    count = Counter(each.name for each in found)
    named = (
        each._replace(name=f"{each.path[0]}.{each.name}")
        if count[each.name] > 1 and each.path[0] in NAMED_LISTS
        else each
        for each in found
    )
    return {each.name: each for each in named}


def link_lengths(mechanism: Mechanism, links: Iterable[str]) -> Iterator[Dimension]:
    """The lengths (m) by which these links are described, in the order of the file.

    Of a point: x and y; the distance along two points; the distances from two points, under their names.
    """
    wanted = frozenset(links)
    taken = {pair.entry_name() for pair in mechanism.pairs}.union(OTHER_LISTS)
    if wanted.isdisjoint(taken):  # none of their names can be another number's
        found = (
            each
            for index, link in enumerate(mechanism.links)
            if link.name in wanted
            for each in _link_dimensions(mechanism, index)
        )
    else:
        found = (
            each for each in file_dimensions(mechanism).values() if each.path[0] == "links" and each.link in wanted
        )
    return (each for each in found if each.kind == "length")


def input_numbers(mechanism: Mechanism) -> Iterator[Dimension]:
    """The position, velocity and acceleration of every input (rad or m, and per second)."""
    return (each for each in _input_dimensions(mechanism) if len(each.address) == 3)


def change_dimension(mechanism: Mechanism, dimension: Dimension, value: Any) -> Mechanism:
    """The mechanism with this number at another value (SI), or at an array or a symbol, unchecked."""
    return change_dimensions(mechanism, [(dimension, value)])


def change_dimensions(mechanism: Mechanism, changes: Iterable[tuple[Dimension, Any]]) -> Mechanism:
    """The same with several numbers at other values."""
    pairs_of_entry: dict[str, list[int]] = {}
    for index, pair in enumerate(mechanism.pairs):  # a pin of several links is several pairs of one entry
        pairs_of_entry.setdefault(pair.entry_name(), []).append(index)
    values: dict[Address, Any] = {}
    for dimension, value in changes:
        section, number, *rest = dimension.address
        if section == "stops" and rest == ["restitution"]:
            mechanism = _with_restitution(mechanism, dimension, value)
        elif section == "pairs":
            for place in pairs_of_entry[mechanism.pairs[int(number)].entry_name()]:
                values["pairs", place, *rest] = value
        else:
            values[dimension.address] = value
    changed: Mechanism = replace_values(mechanism, values)
    return changed


def _with_restitution(mechanism: Mechanism, dimension: Dimension, value: Any) -> Mechanism:
    """The mechanism with another restitution at all stops of a pin, which one entry of the file says."""
    motions = relative_motions(mechanism)
    own = mechanism.stops[int(dimension.address[1])].pair
    same = (motions[each.pair].entry_name() == motions[own].entry_name() for each in mechanism.stops)
    changed = (
        each._replace(restitution=value) if alike else each for each, alike in zip(mechanism.stops, same, strict=True)
    )
    return replace(mechanism, stops=tuple(changed))


def find_dimension(known: Mapping[str, Dimension], name: str) -> Dimension:
    """The number of this name. Raises BadInput, with both readings where two numbers could be meant."""
    if name in known:
        return known[name]
    meant = [f"{section}.{name}" for section in NAMED_LISTS if f"{section}.{name}" in known]
    if meant:
        raise BadInput(
            str(name), f"two numbers of the mechanism could be meant; write {join_names(meant, last_joiner=' or ')}"
        )
    alike = [number for number in known if _spelling(number) == _spelling(str(name))]
    if len(alike) == 1:
        raise BadInput(str(name), f"the mechanism has no number of that name; did you mean {alike[0]!r}?")
    hint = suggest_name(str(name), known, "its numbers")
    raise BadInput(str(name), f"the mechanism has no number of that name{hint}")


def _spelling(name: str) -> tuple[str, ...]:
    """A name's parts without the words of lists that names leave out, and with 0 and 1 for x and y."""
    left_out = {"", "$", *NAMED_LISTS, *(key for (_, _, key), spelt in SPELLINGS.items() if not spelt)}
    parts = re.split(r"[.\[\]]+", name)
    return tuple({"x": "0", "y": "1"}.get(part, part) for part in parts if part not in left_out)


def _every_dimension(mechanism: Mechanism) -> Iterator[Dimension]:
    for index in range(len(mechanism.links)):
        yield from _link_dimensions(mechanism, index)
    yield from _pair_dimensions(mechanism)
    yield from _input_dimensions(mechanism)
    yield from _load_dimensions(mechanism)
    for index, (point, *_) in enumerate(mechanism.sketch):
        _, x, y = _tagged(mechanism.sketch[index], ("sketch", index))
        yield from _written_numbers(["sketch", point], [_mark(x, "length"), _mark(y, "length")])


def _link_dimensions(mechanism: Mechanism, index: int) -> list[Dimension]:
    link = mechanism.links[index]
    written = write_link(_tagged(link, ("links", index)), _mark)
    return _written_numbers(["links", link.name], written, link.name, link=link.name)


def _pair_dimensions(mechanism: Mechanism) -> Iterator[Dimension]:
    position = {id(pair): index for index, pair in enumerate(mechanism.pairs)}
    stops = [_tagged(each, ("stops", index)) for index, each in enumerate(mechanism.stops)]
    stiffness = {name: (value, index) for index, (name, value) in enumerate(mechanism.pair_stiffness)}
    for number, group in enumerate(pair_entries(mechanism)):
        tagged = [_tagged(pair, ("pairs", position[id(pair)])) for pair in group]
        kind: type[Pair] = type(group[0])
        lists = frozenset(key for key, schema in kind.entry_schemas.items() if schema.get("type") == "array")
        name = group[0].entry_name()
        yield from _written_numbers(["pairs", number], kind.write(tagged, _mark), name, lists=lists)
        named = frozenset(pair.name for pair in kind.relative_motions(group))
        written = write_stops({}, stops, group, _mark)
        yield from _written_numbers(["pairs", number], written, name, lists=named | {"stops"})
        if name in stiffness:
            value, at = stiffness[name]
            place = ("pairs", number, "stiffness")
            yield Dimension(f"{name}.stiffness", value, "stiffness", "", place, ("pair_stiffness", at, 1))


def _input_dimensions(mechanism: Mechanism) -> Iterator[Dimension]:
    motions = relative_motions(mechanism)
    for index, given in enumerate(mechanism.inputs):
        written = write_input(_tagged(given, ("inputs", index)), motions, _mark)
        yield from _written_numbers(["inputs", index], written, given.pair, lists=LAW_LISTS | MOTOR_LISTS)


def _load_dimensions(mechanism: Mechanism) -> Iterator[Dimension]:
    """Of loads and springs by their number, of masses by their link and, of several on it, their number there."""
    motions = relative_motions(mechanism)
    for index, load in enumerate(mechanism.loads):
        written = write_load(_tagged(load, ("loads", index)), motions, _mark)
        yield from _written_numbers(["loads", index], written, lists=VARIATION_LISTS)
    for index, spring in enumerate(mechanism.springs):
        yield from _written_numbers(["springs", index], write_spring(_tagged(spring, ("springs", index)), _mark))
    count, seen = Counter(mass.link for mass in mechanism.masses), Counter[str]()
    for index, mass in enumerate(mechanism.masses):
        own = f"masses.{mass.link}" if count[mass.link] == 1 else f"masses.{mass.link}.{seen[mass.link]}"
        seen[mass.link] += 1
        written = write_mass(_tagged(mass, ("masses", index)), _mark)
        yield from _written_numbers(["masses", index], written, own, link=mass.link)
    gravity = _tagged(mechanism.gravity, ("gravity",))
    yield from _written_numbers(["gravity"], [_mark(each, "acceleration") for each in gravity])


class _Tagged(float):
    """A number that knows where it is from, and is like no other, so that no writer leaves it out as a default."""

    __slots__ = ("address",)
    address: Address

    def __eq__(self, other: object) -> bool:
        return False

    def __ne__(self, other: object) -> bool:
        return True

    def __bool__(self) -> bool:
        return True

    __hash__ = float.__hash__


class _Mark(NamedTuple):
    number: _Tagged
    kind: str


def _mark(value: float, kind: str) -> Any:
    """What stands for a number in what is written; nothing for one that is not of the mechanism."""
    return _Mark(value, kind) if isinstance(value, _Tagged) else None


def _tagged(data: Any, address: Address) -> Any:
    """The same data, its numbers tagged with their places."""
    kind = type(data)
    if data is None or kind is str or kind is bool:
        return data
    if isinstance(data, tuple):
        names: Iterable[str | int] = getattr(kind, "_fields", range(len(data)))
        make: Callable[[Iterable[Any]], Any] = getattr(kind, "_make", tuple)
        return make([_tagged(each, (*address, name)) for name, each in zip(names, data, strict=True)])
    if isinstance(data, Real):
        found = _Tagged(data)
        found.address = address
        return found
    if is_dataclass(kind):
        return replace(data, **{name: _tagged(getattr(data, name), (*address, name)) for name in _own_fields(kind)})
    return data


@cache
def _own_fields(kind: type) -> tuple[str, ...]:
    """The names of what a dataclass is made of."""
    return tuple(each.name for each in fields(kind) if each.init)


def _written_numbers(
    start: list[str | int], written: Any, own: str | None = None, link: str = "", lists: frozenset[str] = frozenset()
) -> list[Dimension]:
    """The marked numbers of what is written at a place of the file.

    `own` is how their names begin, else as the place; `lists` are keys whose numbers are counted, else x and y.
    """
    found: list[Dimension] = []

    def walk(value: Any, path: Address, name: str) -> None:
        if isinstance(value, _Mark):
            found.append(Dimension(name, float(value.number), value.kind, link, path, value.number.address))
        elif isinstance(value, dict):
            for key, each in value.items():
                said = SPELLINGS.get((path[0], len(path), key), key)
                walk(each, (*path, key), f"{name}.{said}" if said else name)
        elif isinstance(value, list):
            counted = path[-1] in lists or len(value) != 2 or not isinstance(value[0], _Mark)
            for index, each in enumerate(value):
                walk(each, (*path, index), f"{name}.{index if counted else 'xy'[index]}")

    walk(written, tuple(start), own if own is not None else ".".join(map(str, start)))
    return found


def value_at(data: Any, address: Address) -> Any:
    """A part of nested data."""
    for step in address:
        data = getattr(data, step) if isinstance(step, str) else data[step]
    return data


def replace_value(data: Any, address: Address, value: Any) -> Any:
    """Nested data with one part replaced."""
    return replace_values(data, {address: value})


def replace_values(data: Any, values: Mapping[Address, Any]) -> Any:
    """Nested data with several parts replaced, each object that holds some of them once."""
    if () in values:
        return values[()]
    if not values:
        return data
    inside: dict[str | int, dict[Address, Any]] = {}
    for (step, *rest), value in values.items():
        inside.setdefault(step, {})[tuple(rest)] = value
    if isinstance(next(iter(inside)), int):
        items = list(data)
        for step, part in inside.items():
            items[int(step)] = replace_values(items[int(step)], part)
        return tuple(items)
    parts = {str(step): replace_values(getattr(data, str(step)), part) for step, part in inside.items()}
    return data._replace(**parts) if hasattr(data, "_replace") else replace(data, **parts)
