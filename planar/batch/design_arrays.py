"""Designs: one mechanism whose dimensions and inputs are arrays, an entry for each design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from planar.document.cursor import suggest_spelling
from planar.foundation.errors import BadInput
from planar.model.dimensions import Dimension, change_dimension, dimensions
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism

Array = np.ndarray

INPUT_QUANTITIES = ("position", "velocity", "acceleration")


class InputQuantity(NamedTuple):
    """What an input is given by: `pair.position`, `.velocity` or `.acceleration`."""

    name: str
    pair: str
    quantity: str
    value: float


def design_variables(mechanism: Mechanism) -> dict[str, Dimension | InputQuantity]:
    """Everything that designs may differ in, by name: lengths of links as in `planar.model.dimensions`, then inputs."""
    links = frozenset(link.name for link in mechanism.links)
    found: dict[str, Dimension | InputQuantity] = {each.name: each for each in dimensions(mechanism, links)}
    for given in mechanism.inputs:
        for what in INPUT_QUANTITIES:
            found[f"{given.pair}.{what}"] = InputQuantity(
                f"{given.pair}.{what}", given.pair, what, getattr(given, what)
            )
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


def _read_values(name: str, given: Any, known: Mapping[str, Dimension | InputQuantity]) -> Array:
    if name not in known:
        meant = suggest_spelling(str(name), known, cutoff=0.5) or f"; there are {', '.join(list(known)[:12])}"
        raise BadInput(str(name), f"the mechanism has no such dimension or input{meant}")
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise BadInput(name, f"numbers (m, rad, per s) are wanted, not {given!r:.60}") from None
    if array.ndim > 1:
        raise BadInput(name, f"one row of numbers is wanted, not an array of {array.ndim} axes; ravel a grid of them")
    if not np.all(np.isfinite(array)):
        raise BadInput(name, "a number here is not finite")
    if (
        name.endswith(".position")
        and isinstance(known[name], InputQuantity)
        and np.any(np.abs(array) > LARGEST_INPUT_POSITION)
    ):
        raise BadInput(name, f"an input moves to {LARGEST_INPUT_POSITION:g} rad or m at most")
    return array


def with_design_values(mechanism: Mechanism, values: Mapping[str, Any]) -> Mechanism:
    """The mechanism with these numbers, or arrays of them, in place of its own."""
    known = design_variables(mechanism)
    for name, value in values.items():
        of = known[name]
        if isinstance(of, Dimension):
            mechanism = change_dimension(mechanism, of, value)
        else:
            given = tuple(
                each._replace(**{of.quantity: value}) if each.pair == of.pair else each for each in mechanism.inputs
            )
            mechanism = replace(mechanism, inputs=given)
    return mechanism


def values_of_design(values: Mapping[str, Array], index: int) -> dict[str, float]:
    """The numbers of one design."""
    return {name: float(array[index]) for name, array in values.items()}


def split_into_blocks(design_count: int, size: int) -> Iterator[slice]:
    """The designs in blocks of a size."""
    for first in range(0, design_count, size):
        yield slice(first, min(first + size, design_count))
