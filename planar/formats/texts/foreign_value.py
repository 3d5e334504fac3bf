"""JSON values of other programs' files, with a sentence that names the place where one is not as wanted."""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from typing import Any, NamedTuple

from planar.foundation.errors import BadInput

MISSING: Any = object()


class ForeignValue(NamedTuple):
    """A value of a JSON file, and the way to it."""

    value: Any
    path: str = "$"

    def error(self, sentence: str) -> BadInput:
        """An error at this place."""
        return BadInput(self.path, sentence)

    def has(self, key: str) -> bool:
        """Whether it is an object with something under a key."""
        return isinstance(self.value, dict) and self.value.get(key) is not None

    def at(self, key: str) -> ForeignValue:
        """What stands under a key; an error where there is nothing."""
        if not isinstance(self.value, dict):
            raise self.error(f"an object with {key!r} is wanted here, not {_described(self.value)}")
        if self.value.get(key) is None:
            raise self.error(f"there is no {key!r} here")
        return ForeignValue(self.value[key], f"{self.path}.{key}")

    def items(self, key: str | None = None, optional: bool = False) -> Iterator[ForeignValue]:
        """The items of the list under a key, or of this list."""
        if key is not None:
            if optional and not self.has(key):
                return
            yield from self.at(key).items()
            return
        if not isinstance(self.value, list):
            raise self.error(f"a list is wanted here, not {_described(self.value)}")
        yield from (ForeignValue(item, f"{self.path}[{index}]") for index, item in enumerate(self.value))

    def members(self, key: str) -> Iterator[tuple[str, ForeignValue]]:
        """The members of the object under a key."""
        result = self.at(key)
        if not isinstance(result.value, dict):
            raise result.error(f"an object is wanted here, not {_described(result.value)}")
        yield from ((name, ForeignValue(item, f"{result.path}.{name}")) for name, item in result.value.items())

    def number(self, key: str | None = None, default: float = MISSING) -> float:
        """The finite number under a key, or this one; the default where there is none."""
        if key is not None:
            if default is not MISSING and not self.has(key):
                return default
            return self.at(key).number()
        good = isinstance(self.value, int | float) and not isinstance(self.value, bool)
        if not good or abs(self.value) > 1e300 or not isfinite(self.value):
            raise self.error(f"a number is wanted here, not {_described(self.value)}")
        return float(self.value)

    def pair(self, key: str) -> tuple[float, float]:
        """Two numbers under a key."""
        result = self.at(key)
        numbers = [item.number() for item in result.items()]
        if len(numbers) != 2:
            raise result.error(f"two numbers are wanted here, not {len(numbers)}")
        return numbers[0], numbers[1]

    def text(self, key: str | None = None, default: str = MISSING) -> str:
        """The text under a key, or this one; a whole number is taken as its digits."""
        if key is not None:
            if default is not MISSING and not self.has(key):
                return default
            return self.at(key).text()
        if isinstance(self.value, int) and not isinstance(self.value, bool):
            return str(self.value)
        if not isinstance(self.value, str):
            raise self.error(f"a text is wanted here, not {_described(self.value)}")
        return self.value

    def flag(self, key: str) -> bool:
        """Whether true stands under a key."""
        return self.has(key) and self.at(key).value is True


def _described(value: Any) -> str:
    """A value of a file in a few words."""
    if isinstance(value, dict | list):
        return "an object" if isinstance(value, dict) else "a list"
    return f"{value!r:.60}"
