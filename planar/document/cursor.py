"""A place in a JSON value that knows its path, its units, and how to refuse what stands there."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import isnan
from typing import Any

from planar.document.schema import FORBIDDEN_IN_NAMES
from planar.foundation.errors import BadInput, first_unprintable, suggest_name, suggest_spelling
from planar.foundation.units import UnitError, example_quantity, parse_quantity
from planar.model.file_units import FileUnits, takes_bare_number, unit_of_kind
from planar.model.link_shapes import Link, link_shape
from planar.model.mechanism import LARGEST_COUNTED_ANGLE, LARGEST_NUMBER, SMALLEST_NUMBER

# control characters, what turns the order of letters, halves of characters
_UNPRINTABLE = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


@dataclass(frozen=True)
class FileContext:
    """What every place of one file may need to know of the whole of it."""

    units: FileUnits = field(default_factory=FileUnits)
    frame: str = ""
    links: Mapping[str, Link] = field(default_factory=dict)

    @cached_property
    def links_by_point(self) -> Mapping[str, list[str]]:
        """The links that carry each point."""
        found: dict[str, list[str]] = {}
        for name, link in self.links.items():
            for point in dict.fromkeys(link.names):
                found.setdefault(point, []).append(name)
        return found


@dataclass(frozen=True)
class Cursor:
    """One value of the file. Every reading method returns SI data or raises BadInput with this place."""

    value: Any
    path: str = "$"
    context: FileContext = field(default_factory=FileContext)
    other_keys: tuple[str, ...] = ()
    """Keys that the object may have besides those that `check_keys` names, where they are read elsewhere."""

    # refusing

    def error_at(self, key: str | None, sentence: str) -> BadInput:
        return BadInput(self.path if key is None else self.place_of(key), sentence)

    def check_keys(self, *keys: str) -> None:
        for key in self.fields():
            if key not in keys:
                hint = suggest_name(key, (*keys, *self.other_keys), "allowed keys", None)
                raise self.error_at(key, f"unknown key {key!r}{hint}")

    # walking

    def place_of(self, key: str) -> str:
        """The place of a member."""
        return f"{self.path}.{key}" if re.fullmatch(r"\w+(\[\d+\])?", key) else f"{self.path}[{key!r}]"

    def check_json(self) -> None:
        """Refuse what no JSON file holds, and what no screen shows."""
        waiting = [self]
        while waiting:
            each = waiting.pop()
            value = each.value
            if isinstance(value, dict):
                for key in value:
                    if not isinstance(key, str):
                        raise each.error_at(None, f"keys are texts, but here is {type(key).__name__} {key!r:.40}")
                    Cursor(value, each.place_of(key))._check_printable(key)
                waiting += reversed([each[key] for key in value])
            elif isinstance(value, list):
                waiting += reversed(list(each.items()))
            elif isinstance(value, str):
                each._check_printable(value)
            elif isinstance(value, int) and abs(value) >= LARGEST_NUMBER:
                raise each.error_at(None, "the number is too large")
            elif not (value is None or isinstance(value, int | float)):
                raise each.error_at(None, f"a Python {type(value).__name__} is no value that a mechanism file can have")

    def _check_printable(self, text: str) -> None:
        bad = _UNPRINTABLE.search(text)
        if bad is not None:
            raise self.error_at(None, f"the text holds {bad[0]!r}, which is no character that can be shown")

    def fields(self) -> Mapping[str, Any]:
        if not isinstance(self.value, dict):
            raise self.error_at(None, f"an object {{...}} is wanted here, not {describe_value(self.value)}")
        return self.value

    def has(self, key: str) -> bool:
        return key in self.fields()

    def __getitem__(self, key: str) -> Cursor:
        if key not in self.fields():
            near = suggest_spelling(key, self.value, "is written {!r} the key meant?", 0.75)
            raise self.error_at(None, f"the key {key!r} is missing{near}")
        return Cursor(self.value[key], self.place_of(key), self.context)

    def object_at(self, key: str) -> Cursor:
        found = self[key]
        found.fields()
        return found

    def members(self) -> Iterator[tuple[str, Cursor]]:
        """The named members of an object whose keys are names."""
        for key in self.fields():
            yield key, self[key]

    def items(self) -> Iterator[Cursor]:
        """The items of a list."""
        if not isinstance(self.value, list):
            raise self.error_at(None, f"a list [...] is wanted here, not {describe_value(self.value)}")
        for index, value in enumerate(self.value):
            yield Cursor(value, f"{self.path}[{index}]", self.context, self.other_keys)

    def list_items(self, key: str) -> tuple[Cursor, ...]:
        return tuple(self[key].items()) if self.has(key) else ()

    # plain values

    def as_text(self) -> str:
        if not isinstance(self.value, str):
            raise self.error_at(None, f"a text is wanted here, not {describe_value(self.value)}")
        return self.value

    def text(self, key: str, default: str | None = None) -> str | None:
        return self[key].as_text() if self.has(key) else default

    def name(self, key: str) -> str:
        return self[key].as_name()

    def as_name(self) -> str:
        return self.check_name(self.as_text())

    def check_name(self, name: str) -> str:
        if not name.strip():
            raise self.error_at(None, "a name cannot be empty")
        found = [mark for mark in FORBIDDEN_IN_NAMES if mark in name]
        if found:
            raise self.error_at(None, f"the name {name!r} holds {found[0]!r}; names contain none of . : ,")
        if first_unprintable(name):
            raise self.error_at(None, f"the name {name!r} holds a character that cannot be shown")
        return name

    def as_line(self) -> str:
        """A text that stands in one line of tables and pages."""
        text = self.as_text()
        if first_unprintable(text):
            raise self.error_at(
                None, f"this text stands in a line, and {first_unprintable(text)!r} cannot be shown in one"
            )
        return text

    def names(self, key: str, count: int) -> tuple[str, ...]:
        found = tuple(item.as_name() for item in self[key].items())
        if len(found) != count:
            raise self.error_at(key, f"{count} names are wanted here, not {len(found)}")
        return found

    def choice(self, key: str, words: tuple[str, ...]) -> str | None:
        return self[key].as_choice(words) if self.has(key) else None

    def as_choice(self, words: tuple[str, ...]) -> str:
        word = self.as_text()
        if word not in words:
            raise self.error_at(None, f"{word!r} is none of {', '.join(words)}{suggest_spelling(word, words)}")
        return word

    # quantities

    def as_quantity(self, kind: str) -> float:
        if isinstance(self.value, str):
            try:
                found = parse_quantity(self.value, kind)
            except UnitError as problem:
                raise self.error_at(None, str(problem)) from None
        else:
            found = self._number_in_file_units(self.as_number(), kind)
        if not abs(found) < LARGEST_NUMBER:
            raise self.error_at(None, "the number is too large")
        # what is smaller than rounding leaves of any length is none
        return 0.0 if kind == "length" and abs(found) < SMALLEST_NUMBER else found

    def as_number(self) -> float:
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.error_at(None, f"a number is wanted here, not {describe_value(self.value)}")
        try:
            found = float(self.value)
        except OverflowError:
            raise self.error_at(None, "the number is too large") from None
        if isnan(found):
            raise self.error_at(None, "this is not a number")
        if not abs(found) < LARGEST_NUMBER:
            raise self.error_at(None, "the number is too large")
        return found

    def _number_in_file_units(self, number: float, kind: str) -> float:
        units = self.context.units
        if units.declared(kind):
            return unit_of_kind(kind, units)[1].to_si(number)
        if number == 0.0 or takes_bare_number(kind, units):
            return number
        if kind.startswith("angular") and units.angle != "rad":
            rate = "rad/s, deg/s or rpm" if kind == "angular velocity" else "rad/s^2 or deg/s^2"
            raise self.error_at(
                None,
                f"a bare rate {self.value} is unclear where the angle unit is {units.angle}; write {rate}, "
                f"such as {example_quantity(kind)!r}",
            )
        raise self.error_at(
            None,
            f"a bare {kind} {self.value} is unclear, as 'units' declares others but none of {kind}; write its unit, "
            f"as '{self.value} {unit_of_kind(kind, units)[0]}', or declare it",
        )

    def quantity(self, key: str, kind: str, default: float | None = None) -> float:
        if default is not None and not self.has(key):
            return default
        return self[key].as_quantity(kind)

    def quantities(self, key: str, kind: str, count: int) -> tuple[float, ...]:
        return tuple(item.as_quantity(kind) for item in self._items_counted(key, count))

    def quantity_lists(self, key: str, kind: str, count: int) -> tuple[tuple[float, ...], ...]:
        found = []
        for item in self[key].items():
            numbers = tuple(item.items())
            if len(numbers) != count:
                raise item.error_at(None, f"{count} numbers are wanted here, not {len(numbers)}")
            found.append(tuple(number.as_quantity(kind) for number in numbers))
        return tuple(found)

    def number(self, key: str) -> float:
        return self[key].as_number()

    def whole_numbers(self, key: str, count: int) -> tuple[float, ...]:
        for item in self._items_counted(key, count):
            number = isinstance(item.value, int | float) and not isinstance(item.value, bool)
            if not number or not item.as_number().is_integer():
                raise item.error_at(None, f"a whole number is wanted here, not {describe_value(item.value)}")
        return tuple(item.as_number() for item in self[key].items())

    def _items_counted(self, key: str, count: int) -> tuple[Cursor, ...]:
        found = tuple(self[key].items())
        if len(found) != count:
            raise self.error_at(key, f"{count} numbers are wanted here, not {len(found)}")
        return found

    def flag(self, key: str) -> bool:
        if not self.has(key):
            return False
        value = self[key].value
        if not isinstance(value, bool):
            raise self.error_at(key, f"true or false is wanted here, not {describe_value(value)}")
        return value

    def counted_angle(self, key: str) -> float:
        found = self.quantity(key, "angle")
        if abs(found) > LARGEST_COUNTED_ANGLE:
            told = (
                f"beyond {LARGEST_COUNTED_ANGLE:g} rad rounding leaves less than three digits of where an angle points"
            )
            raise self.error_at(key, f"{told}; count fewer turns")
        return found

    def optional_quantity(self, key: str, kind: str) -> float | None:
        return self[key].as_quantity(kind) if self.has(key) else None

    def as_vector(self, kind: str) -> tuple[float, float]:
        found = tuple(item.as_quantity(kind) for item in self.items())
        if len(found) != 2:
            raise self.error_at(None, f"two numbers [x, y] are wanted here, not {len(found)}")
        return found

    def as_positive(self, kind: str) -> float:
        found = self.as_quantity(kind)
        if found <= 0.0:
            least = f", {SMALLEST_NUMBER:g} m at least," if kind == "length" else ""
            raise self.error_at(None, f"a {kind} above zero{least} is wanted here, not {self.value!r}")
        return found

    # links and points

    @property
    def frame(self) -> str:
        return self.context.frame

    def links_with_point(self, point: str) -> tuple[str, ...]:
        found = self.context.links_by_point.get(point, ())
        return tuple(sorted(found, key=lambda name: name != self.context.frame))

    def as_link(self) -> str:
        name = self.as_text()
        if name not in self.context.links:
            raise self.error_at(None, f"there is no link {name!r}{suggest_name(name, self.context.links, 'links')}")
        return name

    def link(self, key: str) -> str:
        return self[key].as_link()

    def links(self, key: str) -> tuple[str, ...]:
        found = tuple(item.as_link() for item in self[key].items())
        if len(found) < 2:
            raise self.error_at(key, "a pair joins at least two links")
        for name in found:
            if found.count(name) > 1:
                raise self.error_at(key, f"link {name!r} stands here twice; different ones are wanted here")
        return found

    def two_links(self, key: str) -> tuple[str, str]:
        first, second, *more = self.links(key)
        if more:
            raise self.error_at(key, f"this pair joins two links, not {len(more) + 2}")
        return first, second

    def check_point_on_link(self, point: str, link: str, key: str) -> None:
        known = self.context.links[link].names
        if point not in known:
            raise self.error_at(key, f"link {link!r} has no point {point!r}{suggest_name(point, known, 'its points')}")

    def point(self, key: str, link: str) -> str:
        found = self[key].as_text()
        self.check_point_on_link(found, link, key)
        return found

    def check_distinct_points(
        self, key: str, link: str, first: str | tuple[float, float], second: str | tuple[float, float]
    ) -> None:
        placed = link_shape(self.context.links[link])
        if placed.position(first) == placed.position(second):
            raise self.error_at(key, "the two points coincide, so they give no direction")

    def point_reference(self, key: str, link: str) -> str | tuple[float, float]:
        if isinstance(self[key].value, list):
            return self[key].as_vector("length")
        return self.point(key, link)


def describe_value(value: Any) -> str:
    """What a JSON value is called in a sentence."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    kinds: dict[type, str] = {dict: "an object", list: "a list", str: "a text", int: "a number", float: "a number"}
    text = repr(value) if isinstance(value, str | int | float) else ""
    name = next(name for kind, name in kinds.items() if isinstance(value, kind))
    return f"the {name.split()[1]} {text}" if 0 < len(text) < 40 else name
