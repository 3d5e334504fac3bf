"""Names of other programs as names that a planar file can have: each once, without what would be read as a mark."""

from __future__ import annotations

import re
from collections.abc import Iterable

MARKS = re.compile(r"[.:,]+|\s{2,}|[^\S ]+")
"""What no name has in a planar file, and blanks but for single spaces."""


class NameBook:
    """Gives every foreign name one name of its own, the same for the same."""

    def __init__(self, taken: Iterable[str] = ()) -> None:
        self._names: dict[tuple[str, str], str] = {}
        self._taken = set(taken)

    def name(self, kind: str, foreign: str) -> str:
        """The name of a thing of this kind ("link", "joint"), by what the file calls it."""
        known = self._names.get((kind, foreign))
        if known is None:
            known = self._names[kind, foreign] = self.fresh(foreign, kind)
        return known

    def fresh(self, wanted: str, instead: str = "part") -> str:
        """A name near to the one wanted that nothing has yet."""
        printable = "".join(item for item in wanted if item.isprintable() or item.isspace())
        base = MARKS.sub("_", printable.strip()).strip("_") or instead
        result, count = base, 1
        while result in self._taken:
            count += 1
            result = f"{base}_{count}"
        self._taken.add(result)
        return result
