"""How what is shown by the rooms above is named by those below, which know nothing of them."""

from __future__ import annotations

from importlib import import_module


class Shown:
    """What a notebook shows as a page that can be played with (Jupyter and others call `_repr_html_`)."""

    def _repr_html_(self) -> str | None:
        # loaded only where something is shown: solving needs none of it
        return import_module("planar.pages.shown").framed(self)
