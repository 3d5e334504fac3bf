"""The pair types, found by looking in this folder: a new type is a new file."""

import json
from functools import cache
from importlib import import_module
from inspect import isabstract
from pkgutil import iter_modules
from typing import Any

from planar.model.entry_reader import EntryReader, QuantityWriter
from planar.model.pairs.base import ExpandedEntry, MeasureKind, Pair, PairSample

__all__ = [
    "EntryReader",
    "ExpandedEntry",
    "MeasureKind",
    "Pair",
    "PairSample",
    "QuantityWriter",
    "joining_entry",
    "joining_entry_text",
    "pair_types",
]


@cache
def pair_types() -> dict[str, type[Pair]]:
    """Every pair type by its keyword."""
    modules = [import_module(f"{__name__}.{found.name}") for found in iter_modules(__path__)]
    types = (value for module in modules for value in vars(module).values() if isinstance(value, type))
    return {kind.keyword: kind for kind in types if issubclass(kind, Pair) and not isabstract(kind)}


def joining_entry(point: str) -> dict[str, Any]:
    """The entry of a file that joins all links which carry a point of this name."""
    return next(entry for kind in pair_types().values() if (entry := kind.joining_entry(point)))


def joining_entry_text(point: str) -> str:
    """The same as JSON."""
    return json.dumps(joining_entry(point), ensure_ascii=False)
