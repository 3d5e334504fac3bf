"""Results in one line: their fields by name, of large arrays and containers the sizes alone."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass
from typing import Any

import numpy as np

MAX_NUMBERS, MAX_ITEMS, MAX_TEXT = 4, 4, 60
"""Numbers of an array, items of a container and characters of a text that are shown."""


def short_repr(result: Any) -> str:
    """A NamedTuple or a dataclass in one line; a class takes it as its `__repr__`."""
    names = [f.name for f in fields(result) if f.repr] if is_dataclass(result) else result._fields
    shown = ", ".join(f"{name}={_short(getattr(result, name))}" for name in names if not name.startswith("_"))
    return f"{type(result).__name__}({shown})"


def _short(value: Any) -> str:
    if isinstance(value, str):
        return repr(value if len(value) <= MAX_TEXT else f"{value[:MAX_TEXT]}…")
    if isinstance(value, np.ndarray):
        few = value.size <= MAX_NUMBERS and value.dtype.kind in "fiub"
        return str([float(f"{each:.6g}") for each in value.ravel()]) if few else f"<array {value.shape}>"
    if isinstance(value, Mapping):
        return f"<{', '.join(map(str, list(value)[:MAX_ITEMS]))}{', …' if len(value) > MAX_ITEMS else ''}>"
    if isinstance(value, Sequence) and not hasattr(value, "_fields"):
        if len(value) > MAX_ITEMS:
            return f"<{len(value)} items>"
        return f"({', '.join(map(_short, value))}{',' if len(value) == 1 else ''})"
    return " ".join(repr(value).split())
