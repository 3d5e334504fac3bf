"""Designs as arrays: one mechanism whose dimensions and inputs have an entry for each design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import numpy as np

from planar.document.dimensions import (
    Dimension,
    change_dimensions,
    file_dimensions,
)
from planar.foundation.errors import BadInput, suggest_name
from planar.model.mechanism import LARGEST_COUNTED_ANGLE, Mechanism

Array = np.ndarray


def design_variables(mechanism: Mechanism) -> dict[str, Dimension]:
    """Everything that designs may differ in, by name: all numbers of the file (see `document.dimensions`)."""
    found: dict[str, Dimension] | None = mechanism.__dict__.get("_design_variables")  # kept: asked often
    if found is None:
        found = file_dimensions(mechanism)
        object.__setattr__(mechanism, "_design_variables", found)
    return found


def read_designs(mechanism: Mechanism, designs: Mapping[str, Any]) -> dict[str, Array]:
    """The designs as arrays of one length (designs,), single numbers spread. Raises BadInput."""
    if not isinstance(designs, Mapping) or not designs:
        raise BadInput("designs", "name what the designs differ in, with an array each, as {'BC.length': lengths}")
    known = design_variables(mechanism)
    values = {name: _read_values(name, given, known) for name, given in designs.items()}
    many = {name: len(array) for name, array in values.items() if array.ndim}
    if not many:
        many = {next(iter(values)): 1}
    first, count = next(iter(many.items()))
    for name, other in many.items():
        if other != count:
            raise BadInput(name, f"here are {other} numbers, but {count} of {first!r}; designs take one of each")
    if not count:
        raise BadInput(first, "there is no number here, so there is no design")
    return {name: np.broadcast_to(array, (count,)) for name, array in values.items()}


def _read_values(name: str, given: Any, known: Mapping[str, Dimension]) -> Array:
    if name not in known:
        hint = suggest_name(str(name), known, "its numbers")
        raise BadInput(str(name), f"the mechanism has no such dimension or input{hint}")
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise BadInput(name, f"numbers (m, rad, per s) are wanted, not {given!r:.60}") from None
    if array.ndim > 1:
        raise BadInput(name, f"one row of numbers is wanted, not an array of {array.ndim} axes; ravel a grid of them")
    if not np.all(np.isfinite(array)):
        raise BadInput(name, "a number here is not finite")
    if known[name].kind == "count" and np.any(array != np.round(array)):
        raise BadInput(name, "whole numbers are wanted here")
    if (
        known[name].path[0] == "inputs"
        and known[name].path[-1] == "position"
        and np.any(np.abs(array) > LARGEST_COUNTED_ANGLE)
    ):
        raise BadInput(name, f"an input moves to {LARGEST_COUNTED_ANGLE:g} rad or m at most")
    return array


def with_design_values(mechanism: Mechanism, values: Mapping[str, Any]) -> Mechanism:
    """The mechanism with these numbers, or arrays of them, in place of its own."""
    known = design_variables(mechanism)
    return change_dimensions(mechanism, ((known[name], value) for name, value in values.items()))


def values_of_design(values: Mapping[str, Array], index: int) -> dict[str, float]:
    """The numbers of one design."""
    return {name: float(array[index]) for name, array in values.items()}


def split_into_blocks(design_count: int, size: int) -> Iterator[slice]:
    """The designs in blocks of a size."""
    for first in range(0, design_count, size):
        yield slice(first, min(first + size, design_count))
