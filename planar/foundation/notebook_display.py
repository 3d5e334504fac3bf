"""What notebooks show of results: by a presenter that a room above sets, as those below know no pages."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, ClassVar


class Displayable:
    """What a notebook shows as a page that can be played with (Jupyter and others call `_repr_html_`)."""

    presenter: ClassVar[Callable[[Any], str | None] | None] = None
    """Gives the HTML of a result; `planar` sets it."""

    def _repr_html_(self) -> str | None:
        present = Displayable.presenter
        return present(self) if present else None
