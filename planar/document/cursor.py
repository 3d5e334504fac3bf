"""A place in a JSON value that knows its path, its units, and how to refuse what stands there."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from difflib import get_close_matches
from functools import cached_property
from math import isnan
from typing import Any

from planar.document.schema import FORBIDDEN
from planar.foundation.errors import BadInput, listed, unshown
from planar.foundation.units import UnitError, example, quantity, unit
from planar.model.link_shapes import Link, shape
from planar.model.mechanism import HUGE, MOST_COUNTED, TINY, Units

# control characters, what turns the order of letters, halves of characters
_UNSHOWN = re.compile(r"[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]")


@dataclass(frozen=True)
class Whole:
    """What every place of one file may need to know of the whole of it."""

    units: Units = field(default_factory=Units)
    frame: str = ""
    links: Mapping[str, Link] = field(default_factory=dict)

    @cached_property
    def carried_by(self) -> Mapping[str, list[str]]:
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
    whole: Whole = field(default_factory=Whole)

    # refusing

    def refuse(self, key: str | None, sentence: str) -> BadInput:
        return BadInput(self.path if key is None else self._path(key), sentence)

    def only(self, *keys: str) -> None:
        for key in self.fields():
            if key not in keys:
                raise self.refuse(key, f"unknown key {key!r}{did_you_mean(key, keys)}")

    # walking

    def _path(self, key: str) -> str:
        return f"{self.path}.{key}" if re.fullmatch(r"\w+(\[\d+\])?", key) else f"{self.path}[{key!r}]"

    def only_json(self) -> None:
        """Refuse what no JSON file holds, and what no screen shows."""
        waiting = [self]
        while waiting:
            each = waiting.pop()
            value = each.value
            if isinstance(value, dict):
                for key in value:
                    if not isinstance(key, str):
                        raise each.refuse(None, f"keys are texts, but here is {type(key).__name__} {key!r:.40}")
                    replace(each, path=each._path(key))._shown(key)
                waiting += reversed([each[key] for key in value])
            elif isinstance(value, list):
                waiting += reversed(list(each.items()))
            elif isinstance(value, str):
                each._shown(value)
            elif isinstance(value, int) and abs(value) >= HUGE:
                raise each.refuse(None, "the number is too large")
            elif not (value is None or isinstance(value, int | float)):
                raise each.refuse(None, f"a Python {type(value).__name__} is no value that a mechanism file can have")

    def _shown(self, text: str) -> None:
        bad = _UNSHOWN.search(text)
        if bad is not None:
            raise self.refuse(None, f"the text holds {bad[0]!r}, which is no character that can be shown")

    def fields(self) -> Mapping[str, Any]:
        if not isinstance(self.value, dict):
            raise self.refuse(None, f"an object {{...}} is wanted here, not {called(self.value)}")
        return self.value

    def has(self, key: str) -> bool:
        return key in self.fields()

    def __getitem__(self, key: str) -> Cursor:
        if key not in self.fields():
            near = did_you_mean(key, self.value, "is written {!r} the key meant?", 0.75)
            raise self.refuse(None, f"the key {key!r} is missing{near}")
        return replace(self, value=self.value[key], path=self._path(key))

    def inside(self, key: str) -> Cursor:
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
            raise self.refuse(None, f"a list [...] is wanted here, not {called(self.value)}")
        for index, value in enumerate(self.value):
            yield replace(self, value=value, path=f"{self.path}[{index}]")

    def listed(self, key: str) -> tuple[Cursor, ...]:
        return tuple(self[key].items()) if self.has(key) else ()

    # plain values

    def as_text(self) -> str:
        if not isinstance(self.value, str):
            raise self.refuse(None, f"a text is wanted here, not {called(self.value)}")
        return self.value

    def text(self, key: str, default: str | None = None) -> str | None:
        return self[key].as_text() if self.has(key) else default

    def name(self, key: str) -> str:
        return self[key].as_name()

    def as_name(self) -> str:
        return self.checked_name(self.as_text())

    def checked_name(self, name: str) -> str:
        if not name.strip():
            raise self.refuse(None, "a name cannot be empty")
        found = [mark for mark in FORBIDDEN if mark in name]
        if found:
            raise self.refuse(None, f"the name {name!r} holds {found[0]!r}; names contain none of . : ,")
        if unshown(name):
            raise self.refuse(None, f"the name {name!r} holds a character that cannot be shown")
        return name

    def as_line(self) -> str:
        """A text that stands in one line of tables and pages."""
        text = self.as_text()
        if unshown(text):
            raise self.refuse(None, f"this text stands in a line, and {unshown(text)!r} cannot be shown in one")
        return text

    def names(self, key: str, count: int) -> tuple[str, ...]:
        found = tuple(item.as_name() for item in self[key].items())
        if len(found) != count:
            raise self.refuse(key, f"{count} names are wanted here, not {len(found)}")
        return found

    def one_of(self, key: str, words: tuple[str, ...]) -> str | None:
        if not self.has(key):
            return None
        word = self[key].as_text()
        if word not in words:
            raise self.refuse(key, f"{word!r} is none of {', '.join(words)}{did_you_mean(word, words)}")
        return word

    # quantities

    def as_quantity(self, kind: str) -> float:
        if isinstance(self.value, str):
            try:
                found = quantity(self.value, kind)
            except UnitError as problem:
                raise self.refuse(None, str(problem)) from None
        else:
            found = self._bare(self.as_number(), kind)
        if not abs(found) < HUGE:
            raise self.refuse(None, "the number is too large")
        # what is smaller than rounding leaves of any length is none
        return 0.0 if kind == "length" and abs(found) < TINY else found

    def as_number(self) -> float:
        if isinstance(self.value, bool) or not isinstance(self.value, int | float):
            raise self.refuse(None, f"a number is wanted here, not {called(self.value)}")
        try:
            found = float(self.value)
        except OverflowError:
            raise self.refuse(None, "the number is too large") from None
        if isnan(found):
            raise self.refuse(None, "this is not a number")
        if not abs(found) < HUGE:
            raise self.refuse(None, "the number is too large")
        return found

    def _bare(self, number: float, kind: str) -> float:
        units = self.whole.units
        if kind == "length":
            return unit(units.length).to_si(number)
        if kind == "angle":
            return unit(units.angle).to_si(number)
        if kind.startswith("angular") and unit(units.angle).to_si(1.0) != 1.0 and number != 0.0:
            rate = "rad/s, deg/s or rpm" if kind == "angular velocity" else "rad/s^2 or deg/s^2"
            raise self.refuse(
                None,
                f"a bare rate {self.value} is unclear where the angle unit is {units.angle}; write {rate}, "
                f"such as {example(kind)!r}",
            )
        return number

    def quantity(self, key: str, kind: str, default: float | None = None) -> float:
        if default is not None and not self.has(key):
            return default
        return self[key].as_quantity(kind)

    def quantities(self, key: str, kind: str, count: int) -> tuple[float, ...]:
        return tuple(item.as_quantity(kind) for item in self._counted(key, count))

    def number(self, key: str) -> float:
        return self[key].as_number()

    def counts(self, key: str, count: int) -> tuple[float, ...]:
        for item in self._counted(key, count):
            number = isinstance(item.value, int | float) and not isinstance(item.value, bool)
            if not number or not item.as_number().is_integer():
                raise item.refuse(None, f"a whole number is wanted here, not {called(item.value)}")
        return tuple(item.as_number() for item in self[key].items())

    def _counted(self, key: str, count: int) -> tuple[Cursor, ...]:
        found = tuple(self[key].items())
        if len(found) != count:
            raise self.refuse(key, f"{count} numbers are wanted here, not {len(found)}")
        return found

    def flag(self, key: str) -> bool:
        if not self.has(key):
            return False
        if not isinstance(self[key].value, bool):
            raise self.refuse(key, f"true or false is wanted here, not {called(self[key].value)}")
        return self[key].value

    def turned(self, key: str) -> float:
        found = self.quantity(key, "angle")
        if abs(found) > MOST_COUNTED:
            told = f"beyond {MOST_COUNTED:g} rad rounding leaves less than three digits of where an angle points"
            raise self.refuse(key, f"{told}; count fewer turns")
        return found

    def optional(self, key: str, kind: str) -> float | None:
        return self[key].as_quantity(kind) if self.has(key) else None

    def as_vector(self, kind: str) -> tuple[float, float]:
        found = tuple(item.as_quantity(kind) for item in self.items())
        if len(found) != 2:
            raise self.refuse(None, f"two numbers [x, y] are wanted here, not {len(found)}")
        return found

    def positive(self, kind: str) -> float:
        found = self.as_quantity(kind)
        if found <= 0.0:
            least = f", {TINY:g} m at least," if kind == "length" else ""
            raise self.refuse(None, f"a {kind} above zero{least} is wanted here, not {self.value!r}")
        return found

    # links and points

    @property
    def frame(self) -> str:
        return self.whole.frame

    def carriers(self, point: str) -> tuple[str, ...]:
        found = self.whole.carried_by.get(point, ())
        return tuple(sorted(found, key=lambda name: name != self.whole.frame))

    def as_link(self) -> str:
        name = self.as_text()
        if name not in self.whole.links:
            raise self.refuse(None, f"there is no link {name!r}{offered(name, self.whole.links, 'links')}")
        return name

    def link(self, key: str) -> str:
        return self[key].as_link()

    def links(self, key: str) -> tuple[str, ...]:
        found = tuple(item.as_link() for item in self[key].items())
        if len(found) < 2:
            raise self.refuse(key, "a pair joins at least two links")
        for name in found:
            if found.count(name) > 1:
                raise self.refuse(key, f"link {name!r} stands here twice; different ones are wanted here")
        return found

    def two_links(self, key: str) -> tuple[str, str]:
        first, second, *more = self.links(key)
        if more:
            raise self.refuse(key, f"this pair joins two links, not {len(more) + 2}")
        return first, second

    def carried(self, point: str, link: str, key: str) -> None:
        known = self.whole.links[link].names
        if point not in known:
            raise self.refuse(key, f"link {link!r} has no point {point!r}{offered(point, known, 'its points')}")

    def point(self, key: str, link: str) -> str:
        found = self[key].as_text()
        self.carried(found, link, key)
        return found

    def distinct(
        self, key: str, link: str, first: str | tuple[float, float], second: str | tuple[float, float]
    ) -> None:
        placed = shape(self.whole.links[link])
        if placed.at(first) == placed.at(second):
            raise self.refuse(key, "the two points coincide, so they give no direction")

    def place(self, key: str, link: str) -> str | tuple[float, float]:
        if isinstance(self[key].value, list):
            return self[key].as_vector("length")
        return self.point(key, link)


def called(value: Any) -> str:
    """What a JSON value is called in a sentence."""
    if value is None:
        return "null"
    if isinstance(value, bool):
        return "true" if value else "false"
    kinds: dict[type, str] = {dict: "an object", list: "a list", str: "a text", int: "a number", float: "a number"}
    text = repr(value) if isinstance(value, str | int | float) else ""
    name = next(name for kind, name in kinds.items() if isinstance(value, kind))
    return f"the {name.split()[1]} {text}" if 0 < len(text) < 40 else name


def offered(word: str, known: Iterable[str], what: str) -> str:
    """A clause that offers the nearest known name, or the names that there are."""
    names = list(known)
    return did_you_mean(word, names) or (f"; {what} are {listed(names)}" if names else "; there is none")


def did_you_mean(word: str, known: Any, sentence: str = "did you mean {!r}?", cutoff: float = 0.6) -> str:
    """A clause that offers the nearest known word, or nothing."""
    near = get_close_matches(word, list(known), 1, cutoff) or [each for each in known if each.lower() == word.lower()]
    return "; " + sentence.format(near[0]) if near else ""
