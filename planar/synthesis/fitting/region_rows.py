"""How far inside a polygon the points of a mechanism are, with slopes, at positions of many designs."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import design_equations
from planar.equations.casadi_call import BufferedFunction
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism, named_points
from planar.synthesis.demands.polygon import polygon_depths
from planar.synthesis.fitting.wanted_equations import in_entries


class RegionRows:
    """Depths (of a size in m) at positions y of designs x (see `in_entries`), a column for each named point."""

    def __init__(self, mechanism: Mechanism, corners: Array, size: float, free: Sequence[str], scale: Array):
        self.mechanism, self.corners, self.size = mechanism, corners / size, size
        self.free, self.scale = tuple(free), scale
        self.points = named_points(mechanism)

    def __len__(self) -> int:
        """How many columns there are."""
        return len(self.points)

    @cached_property
    def _places(self) -> tuple[BufferedFunction, BufferedFunction]:
        """(y, x) -> places of all points (x and y of each in turn), and the same with their Jacobians in y and x."""
        design = design_equations(self.mechanism)
        frames, _ = design.placed
        parts = []
        for each in self.points:
            link, at = each.members[0]
            parts += list(frames[link].to_world(design.work.shapes[link].position(at)))
        y, x, (places,) = in_entries(design, self.free, self.scale, [stack_expressions(parts) / self.size])
        told = [places], [places, ca.jacobian(places, y), ca.jacobian(places, x)]
        value, slopes = (ca.Function("places", [y, x], [ca.densify(each) for each in found]) for found in told)
        return BufferedFunction(value), BufferedFunction(slopes)

    def values(self, x: Array, y: Array) -> Array:
        """The depths (positions, points), of positions y (positions, unknowns) of designs x (positions, free)."""
        places = self._places[0].evaluate_batch(len(y), y, x)[0]
        return polygon_depths(places.reshape(-1, 2), self.corners)[0].reshape(len(y), len(self))

    def linearise(self, x: Array, y: Array) -> tuple[Array, Array, Array]:
        """The depths, and their slopes in y (positions, points, unknowns) and x (positions, points, free), each with
        the other held."""
        places, by_y, by_x = self._places[1].evaluate_batch(len(y), y, x)
        depths, ways = polygon_depths(places.reshape(-1, 2), self.corners)
        ways = ways.reshape(len(y), len(self), 2)
        y_slopes, x_slopes = (
            np.einsum("npa,npai->npi", ways, each.swapaxes(1, 2).reshape(len(y), len(self), 2, each.shape[1]))
            for each in (by_y, by_x)
        )
        return depths.reshape(len(y), len(self)), y_slopes, x_slopes
