"""Random numbers of a mechanism's file: widely spread, or near to numbers that have proved good."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.document.dimensions import Dimension, file_dimensions, find_dimension
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.synthesis.swept.bare_mechanism import centre, length_scale

LENGTH_RANGE = (0.12, 3.0)
"""Of the mechanism's scale: between which lengths are drawn, evenly by their logarithm."""
COORDINATE_SPREAD = 1.0
"""Of the scale: the standard deviation of coordinates about the middle of their link, of a line's about where it is."""
RATIO_SPREAD, KEPT_RATIOS = 0.5, 0.5
"""Of a ratio's logarithm; and how many designs have the ratio of the file, since curves close at few ratios."""
NEAR_SPREADS = (0.03, 0.5)
"""Between which the spread of what is drawn near a design lies, of a number or the scale, evenly by its logarithm."""


class NumberDraws:
    """Numbers by `names` (see `planar.dimensions`) between `lower` and `upper`, infinite where there is no bound.

    Lengths are spread evenly by their logarithm about the size of the mechanism's links, or between both bounds;
    coordinates lie about the middle of their link, either way; angles point anywhere.
    """

    def __init__(self, mechanism: Mechanism, names: Sequence[str], lower: Array, upper: Array):
        known = file_dimensions(mechanism)
        dimensions = [find_dimension(known, name) for name in names]
        self.scale = length_scale(mechanism)
        self.start = np.array([float(each.value) for each in dimensions])
        self.lower, self.upper = np.asarray(lower, dtype=float), np.asarray(upper, dtype=float)
        kinds = np.array([each.kind for each in dimensions], dtype=object)
        self.is_angle, self.is_count = kinds == "angle", kinds == "count"
        self.is_length = np.array([is_signed_by_file(each) for each in dimensions], dtype=bool)
        self.is_coordinate = (kinds == "length") & ~self.is_length
        self.is_ratio = ~(self.is_angle | self.is_length | self.is_coordinate)
        middles = {link.name: centre(link) for link in mechanism.links}
        self.middle = np.array([_middle(each, middles) for each in dimensions])

    def draw_wide(self, count: int, random: np.random.Generator) -> Array:
        """So many designs (count, numbers), spread as widely as may be."""
        shape = (count, len(self.start))
        sign = np.where(self.start < 0.0, -1.0, 1.0)
        evenly = random.uniform(size=shape)
        low, high = np.log(LENGTH_RANGE)
        found = np.tile(self.start, (count, 1))
        found = np.where(self.is_length, sign * self.scale * np.exp(low + (high - low) * evenly), found)
        normal = random.normal(size=shape)
        found = np.where(self.is_coordinate, self.middle + COORDINATE_SPREAD * self.scale * normal, found)
        found = np.where(self.is_angle, np.pi * (2.0 * evenly - 1.0), found)
        is_kept = random.uniform(size=(count, 1)) < KEPT_RATIOS
        found = np.where(self.is_ratio & ~is_kept, self.start * np.exp(RATIO_SPREAD * normal), found)
        return self._within(self._between_bounds(found, evenly))

    def draw_near(self, designs: Array, random: np.random.Generator) -> Array:
        """Designs (n, numbers) near to others, each as near as chance will have it."""
        low, high = np.log(NEAR_SPREADS)
        spread = np.exp(random.uniform(low, high, (len(designs), 1)))
        change = spread * random.normal(size=designs.shape)
        is_kept = random.uniform(size=(len(designs), 1)) < KEPT_RATIOS
        found = np.where(self.is_length | (self.is_ratio & ~is_kept), designs * np.exp(change), designs)
        found = np.where(self.is_coordinate, designs + self.scale * change, found)
        return self._within(np.where(self.is_angle, designs + change, found))

    def _between_bounds(self, drawn: Array, evenly: Array) -> Array:
        """Between two bounds evenly, of lengths by their logarithm."""
        with np.errstate(all="ignore"):
            logarithmic = self.lower * (self.upper / self.lower) ** evenly
            uniform = self.lower + (self.upper - self.lower) * evenly
        is_bound = np.isfinite(self.lower) & np.isfinite(self.upper)
        found = np.where(is_bound & self.is_length & (self.lower > 0.0), logarithmic, drawn)
        return np.where(is_bound & ~(self.is_length & (self.lower > 0.0)), uniform, found)

    def _within(self, numbers: Array) -> Array:
        whole = np.where(self.is_count, np.round(numbers), numbers)
        found: Array = np.clip(whole, self.lower, self.upper)
        return found


def is_signed_by_file(dimension: Dimension) -> bool:
    """Whether a number is a length whose sign is said by what it is: no coordinate, and none along a line."""
    path = dimension.path
    return dimension.kind == "length" and (path[-1] == "length" or "distances" in path or "radii" in path)


def _middle(dimension: Dimension, middles: dict[str, complex]) -> float:
    """About what a coordinate is drawn (m)."""
    if dimension.path[0] != "links" or dimension.path[-1] not in (0, 1):
        return float(dimension.value)
    middle = middles[dimension.link]
    return middle.imag if dimension.path[-1] else middle.real
