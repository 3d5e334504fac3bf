"""What can be had again with other numbers: by a reviser that a room above sets, as those below know no files."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Self


class Revisable:
    """What has numbers with names, as a mechanism has those of its file."""

    reviser: ClassVar[Callable[[Any, Mapping[str, Any]], Any] | None] = None
    """Gives the same with some numbers changed; `planar` sets it."""

    def with_values(self, values: Mapping[str, float | str]) -> Self:
        """The same with some of its numbers changed, by the names that `planar.dimensions` gives them.

        A value is a number (SI), or a text with a unit as "400 mm". Raises BadInput where there is no such number, or
        a file would be refused for the value.

        >>> import planar
        >>> longer = planar.load("four-bar").with_values({"BC.length": "70 mm", "AD.D.x": 0.11})
        >>> planar.dimensions(longer)["BC.length"]
        0.07
        """
        revise = Revisable.reviser
        if revise is None:
            raise NotImplementedError("import planar, which knows how files are written")
        revised: Self = revise(self, values)
        return revised
