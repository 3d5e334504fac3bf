"""The parameters by which results are derived: the inputs with their two rates, then numbers of the file."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np

from planar.document.dimensions import Dimension, change_dimensions, file_dimensions
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.jets import Scalar
from planar.model.mechanism import Input, Mechanism, relative_motions
from planar.solving.position import solved_mechanism

DESIGN_SECTIONS = ("links", "pairs", "loads", "springs", "masses", "gravity")
"""Of the file: numbers of the design itself. Inputs run, sketches choose, and neither changes what is solved."""
INPUT_RATES = ("position", "velocity", "acceleration")


def design_dimensions(mechanism: Mechanism) -> tuple[Dimension, ...]:
    """The numbers of a mechanism's file that are no counts, no stops, and no numbers of its inputs' courses."""
    return tuple(
        dimension
        for dimension in file_dimensions(mechanism).values()
        if dimension.path[0] in DESIGN_SECTIONS
        and dimension.kind != "count"
        and dimension.address[0] not in ("stops", "pair_stiffness")
        and "varies" not in dimension.address
    )


class Parameters:
    """The parameters of a mechanism: `names`, `dimensions` of the file, and `unit`, its size (m).

    `offsets` name pairs whose pins may stand aside in their holes: by `clearance.B.x` and `clearance.B.y` (m, in the
    axes of the pair's first link), the last ones. Raises BadInput of a mechanism of which no derivatives are known.
    """

    def __init__(self, mechanism: Mechanism, offsets: tuple[str, ...] = ()):
        solver = solved_mechanism(mechanism).solver
        solver.refuse_misfit("derivatives are not told")
        for pair in mechanism.pairs:
            if not pair.measures_symbols:
                raise BadInput(pair.name, "derivatives are not told of a mechanism with a cam of given points")
        self.mechanism, self.offsets, self.unit = mechanism, offsets, solver.unit
        self.file_dimensions = design_dimensions(mechanism)
        self.dimensions = (
            *self.file_dimensions,
            *(_offset_dimension(pair, axis) for pair in offsets for axis in "xy"),
        )
        self.inputs = tuple(given.pair for given in mechanism.inputs)
        self.names = (
            *(f"{name}.{rate}" for rate in INPUT_RATES for name in self.inputs),
            *(dimension.name for dimension in self.dimensions),
        )

    @cached_property
    def scale(self) -> Array:
        """What each parameter is in units of (parameters,): m for a length of the mechanism's size, else as it is."""
        motions = relative_motions(self.mechanism)
        kinds = [motions[name].input_quantity_kinds()[0] for name in self.inputs] * len(INPUT_RATES)
        kinds += [dimension.kind for dimension in self.dimensions]
        return np.array([self.unit if kind == "length" else 1.0 for kind in kinds])

    def mechanism_with(self, numbers: Sequence[Scalar]) -> Mechanism:
        """The mechanism with other numbers, of any arithmetic, in place of those of the file; inputs, courses of loads
        and stops are left out."""
        changed = replace(
            self.mechanism,
            inputs=tuple(Input(name, 0.0) for name in self.inputs),
            loads=tuple(load._replace(varies=None) for load in self.mechanism.loads),
            stops=(),
        )
        return change_dimensions(changed, zip(self.file_dimensions, numbers, strict=True))


def _offset_dimension(pair: str, axis: str) -> Dimension:
    place = ("tolerances", "clearance", pair, axis)
    return Dimension(f"clearance.{pair}.{axis}", 0.0, "length", "", place, place)
