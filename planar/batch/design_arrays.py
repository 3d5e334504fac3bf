"""Designs: one mechanism whose dimensions and inputs are arrays, an entry for each design."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from planar.document.cursor import did_you_mean
from planar.foundation.errors import BadInput
from planar.model.dimensions import Dimension, changed, dimensions
from planar.model.mechanism import FARTHEST, Mechanism

Array = np.ndarray

OF_INPUT = ("position", "velocity", "acceleration")


class OfInput(NamedTuple):
    """What an input is given by: `pair.position`, `.velocity` or `.acceleration`."""

    name: str
    pair: str
    what: str
    value: float


def liftable(mechanism: Mechanism) -> dict[str, Dimension | OfInput]:
    """Everything that designs may differ in, by name: lengths of links as in `planar.model.dimensions`, then inputs."""
    links = frozenset(link.name for link in mechanism.links)
    found: dict[str, Dimension | OfInput] = {each.name: each for each in dimensions(mechanism, links)}
    for given in mechanism.inputs:
        for what in OF_INPUT:
            found[f"{given.pair}.{what}"] = OfInput(f"{given.pair}.{what}", given.pair, what, getattr(given, what))
    return found


def checked(mechanism: Mechanism, designs: Mapping[str, Any]) -> dict[str, Array]:
    """The designs as arrays of one length (designs,), single numbers spread. Raises BadInput."""
    if not isinstance(designs, Mapping) or not designs:
        raise BadInput("designs", "name what the designs differ in, with an array each, as {'BC.length': lengths}")
    known = liftable(mechanism)
    values = {name: _values(name, given, known) for name, given in designs.items()}
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


def _values(name: str, given: Any, known: Mapping[str, Dimension | OfInput]) -> Array:
    if name not in known:
        meant = did_you_mean(str(name), known, cutoff=0.5) or f"; there are {', '.join(list(known)[:12])}"
        raise BadInput(str(name), f"the mechanism has no such dimension or input{meant}")
    try:
        array = np.asarray(given, dtype=float)
    except (TypeError, ValueError):
        raise BadInput(name, f"numbers (m, rad, per s) are wanted, not {given!r:.60}") from None
    if array.ndim > 1:
        raise BadInput(name, f"one row of numbers is wanted, not an array of {array.ndim} axes; ravel a grid of them")
    if not np.all(np.isfinite(array)):
        raise BadInput(name, "a number here is not finite")
    if name.endswith(".position") and isinstance(known[name], OfInput) and np.any(np.abs(array) > FARTHEST):
        raise BadInput(name, f"an input moves to {FARTHEST:g} rad or m at most")
    return array


def lifted(mechanism: Mechanism, values: Mapping[str, Any]) -> Mechanism:
    """The mechanism with these numbers, or arrays of them, in place of its own."""
    known = liftable(mechanism)
    for name, value in values.items():
        of = known[name]
        if isinstance(of, Dimension):
            mechanism = changed(mechanism, of, value)
        else:
            given = tuple(
                each._replace(**{of.what: value}) if each.pair == of.pair else each for each in mechanism.inputs
            )
            mechanism = replace(mechanism, inputs=given)
    return mechanism


def one(values: Mapping[str, Array], index: int) -> dict[str, float]:
    """The numbers of one design."""
    return {name: float(array[index]) for name, array in values.items()}


def blocks(many: int, size: int) -> Iterator[slice]:
    """The designs in blocks of a size."""
    for first in range(0, many, size):
        yield slice(first, min(first + size, many))
