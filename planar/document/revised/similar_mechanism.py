"""A mechanism similar to another one: of the same shape, larger or smaller."""

from __future__ import annotations

from planar.document.dimensions import file_dimensions
from planar.document.revised.changed_numbers import with_values
from planar.model.mechanism import Mechanism


def similar_mechanism(mechanism: Mechanism, factor: float) -> Mechanism:
    """The mechanism with every length of its file `factor` times as long, the sketch and sliding inputs among them."""
    lengths = {name: each.value for name, each in file_dimensions(mechanism).items() if each.kind == "length"}
    return with_values(mechanism, {name: factor * value for name, value in lengths.items()})
