"""What a page carries of tolerances: those of the dimensions that it changes, and which others there are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from planar.analysis.tolerance.variations import find_variations
from planar.document.dimensions import Dimension
from planar.model.mechanism import Mechanism


class ToleranceData(NamedTuple):
    """Of each dimension how far it may be off, [lower, upper] (m) or None, and by name what else may."""

    dimensions: list[list[float] | None]
    others: list[str]


def tolerance_data(mechanism: Mechanism, dimensions: Sequence[Dimension]) -> ToleranceData:
    """The tolerances of a file, nothing where it has none."""
    if mechanism.tolerances is None:
        return ToleranceData([None] * len(dimensions), [])
    variations = find_variations(mechanism, None)
    own = {each.number: [float(each.lower), float(each.upper)] for each in variations.numbers}
    names = {each.name for each in dimensions}
    others = [name for name in own if name not in names]
    others += [f"the pin of {each.pair}" for each in variations.offsets]
    return ToleranceData([own.get(each.name) for each in dimensions], others)
