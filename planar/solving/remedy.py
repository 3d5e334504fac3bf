"""The single dimension whose change lets a mechanism go together that does not, and by how much."""

from __future__ import annotations

from math import ceil, floor, log10

import numpy as np

from planar.dimensions import Dimension, changed, dimensions
from planar.mechanism import Mechanism
from planar.program import fitted, shapes
from planar.shapes import Unplaced
from planar.solving.assemble import Assembly, Failure, search
from planar.solving.candidates import Candidates
from planar.solving.newton import newton
from planar.solving.setup import Setup
from planar.units import unit
from planar.words import amount

Array = np.ndarray

MOST = 40
"""Dimensions that are looked at."""
LONGEST = 15
"""Newton's steps of a dimension; what stays open falls about linearly with it, so a few do."""
CLOSED = 1e-9
PROVED = 4
"""Dimensions, the least change first, that are tried by assembling the whole."""
DIGITS = 5


def remedy(setup: Setup, failure: Failure) -> str | None:
    """A clause that says which dimension to make how long; None where no single one was found.

    A change is offered only after the mechanism with it, rounded as it is printed, has been assembled.
    """
    beside = (link for name in failure.stage.pairs for link in setup.pairs[name].bodies)
    links = frozenset((*failure.stage.links, *beside))
    found = []
    for dimension in list(dimensions(setup.mechanism, links))[:MOST]:
        value = _closing_value(setup, failure, dimension)
        if value is not None:
            found.append((abs(value - dimension.value), dimension, value))
    length = unit(setup.mechanism.units.length)
    # of changes that are as small, that of a link's length
    found.sort(key=lambda each: (round(each[0] / setup.unit, 6), not each[1].name.endswith(".length")))
    for _, dimension, value in found[:PROVED]:
        near = length.from_si(value)
        # first a little beyond, where it goes together with ease; what is held twice needs the very value
        for shown in (_rounded(near, up=value > dimension.value), float(f"{near:.{DIGITS}g}")):
            if _goes_together(changed(setup.mechanism, dimension, length.to_si(shown))):
                units = setup.mechanism.units
                return (
                    f"it would go together with {dimension.name} = {shown:.6g} {units.length} "
                    f"instead of {amount(dimension.value, 'length', units)}"
                )
    return None


def _closing_value(setup: Setup, failure: Failure, dimension: Dimension) -> float | None:
    """The value (m) of a dimension at which the group that stays open just closes; None where there is none.

    What stays open at the nearest position falls as the dimension changes by its share in it: Newton's method for a
    zero of the distance, the position being found anew at each step.
    """
    candidates = Candidates(setup)
    value, z = dimension.value, failure.z[failure.stage.unknowns]
    nudge = 1e-7 * setup.unit
    for _ in range(LONGEST):
        closings = []
        for tried in (value, value + nudge):
            p = _numbers(setup, changed(setup.mechanism, dimension, tried))
            if p is None:
                return None
            closings.append(candidates.closing(failure.stage, failure.z, p))
        ended = newton(closings[0], z[None])
        z = ended.unknowns[0]
        left, ahead = (closing(z[None])[0][0] for closing in closings)
        gap = float(np.linalg.norm(left))
        if gap <= CLOSED:
            return value if value != dimension.value else None
        slope = float(left @ (ahead - left)) / gap / nudge
        if abs(slope) * setup.unit < 1e-3:
            return None  # it hardly matters here
        value -= gap / slope
        if abs(value) > 1e3 * setup.unit or (dimension.name == f"{dimension.link}.length" and value <= 0.0):
            return None
    return None


def _numbers(setup: Setup, mechanism: Mechanism) -> Array | None:
    try:
        return fitted(mechanism, shapes(mechanism), setup.unit)
    except Unplaced:
        return None


def _rounded(value: float, up: bool) -> float:
    """A number of DIGITS digits beyond the value, seen from where it comes."""
    size = 10.0 ** (floor(log10(abs(value))) + 1 - DIGITS) if value else 1.0
    return (ceil if up else floor)(value / size) * size


def _goes_together(mechanism: Mechanism) -> bool:
    try:
        return isinstance(search(Candidates(Setup(mechanism))), Assembly)
    except Unplaced:
        return False
