"""The parts of a vector between two points: rotation and sliding; centripetal, tangential, Coriolis and sliding."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from planar.analysis.polygons.lettering import Lettering, line_name
from planar.analysis.polygons.polygon import Factor, PolygonVector, VectorPart
from planar.analysis.rate_equations import Rate, RateEquations, SlideJoint, moving_links
from planar.analysis.vector_chains import ChainVector, VectorChains
from planar.foundation.arrays import Array
from planar.model.wording import direction_sense
from planar.results.motion import State

NEGLIGIBLE_RATIO = 1e-12
"""A rate below this part of the greatest of its kind is none."""


class VectorParts:
    """The parts of the vectors of a position; `is_known` tells of a rate whether it is known so far."""

    def __init__(
        self,
        state: State,
        equations: RateEquations,
        chains: VectorChains,
        lettering: Lettering,
        is_known: Callable[[Rate], bool],
    ):
        self.frame = state.mechanism.frame
        self.equations, self.chains, self.lettering, self.is_known = equations, chains, lettering, is_known
        links = moving_links(state.mechanism)
        self.greatest_angular_velocity = max((abs(equations.value(Rate(link))) for link in links), default=0.0)
        greatest = max((abs(equations.value(Rate(link), 2)) for link in links), default=0.0)
        self.greatest_angular_acceleration = max(greatest, self.greatest_angular_velocity**2)

    def velocity_parts(self, leg: ChainVector) -> list[PolygonVector]:
        rate = self.equations.value(leg.rate)
        if leg.slide is not None:
            vector = self._directed_vector(leg, VectorPart.SLIDING, rate * self.chains.unit_rate_velocity(leg))
            return [self._with_magnitude(vector, leg, Factor(f"v at {leg.slide.name}", abs(rate), 1, "velocity"))]
        vector = self._directed_vector(leg, VectorPart.ROTATION, rate * self.chains.unit_rate_velocity(leg))
        turns = Factor(f"ω_{leg.rate.owner}", abs(rate), 1, "angular velocity")
        return [self._with_magnitude(vector, leg, turns, self._length_factor(leg))]

    def acceleration_parts(self, leg: ChainVector) -> list[PolygonVector]:
        return self._slide_parts(leg, leg.slide) if leg.slide is not None else self._turning_parts(leg)

    def _turning_parts(self, leg: ChainVector) -> list[PolygonVector]:
        """Centripetal and tangential part."""
        rate, second = (self.equations.value(leg.rate, order) for order in (1, 2))
        length = self._length_factor(leg)
        tangential = self._directed_vector(leg, VectorPart.TANGENTIAL, second * self.chains.unit_rate_velocity(leg))
        turns = Factor(f"α_{leg.rate.owner}", abs(second), 1, "angular acceleration")
        tangential = self._with_magnitude(tangential, leg, turns, length)
        if abs(rate) <= NEGLIGIBLE_RATIO * self.greatest_angular_velocity:
            return [tangential]
        if tangential.known:
            growing = rate * second > 0.0
            tangential = tangential._replace(towards=self.lettering.velocity_letter(leg.head if growing else leg.tail))
        speed = Factor(f"({self._velocity_chord(leg)})", abs(rate) * length.value, 2, "velocity")
        reach = self.chains.point_position(leg.head) - self.chains.point_position(leg.tail)
        centripetal = self._directed_vector(leg, VectorPart.CENTRIPETAL, -(rate**2) * reach)._replace(
            known=True,
            is_perpendicular=False,
            factors=(speed, length._replace(power=-1)),
            towards=self.lettering.point_name(leg.tail),
        )
        if tangential.known and abs(second) <= NEGLIGIBLE_RATIO * self.greatest_angular_acceleration:
            return [centripetal]
        return [centripetal, tangential]

    def _slide_parts(self, leg: ChainVector, slide: SlideJoint) -> list[PolygonVector]:
        """Coriolis part, where the line turns, and what is along the line."""
        rate, second = (self.equations.value(leg.rate, order) for order in (1, 2))
        way = self.chains.unit_rate_velocity(leg)
        sliding = self._directed_vector(leg, VectorPart.SLIDING, second * way)
        sliding = self._with_magnitude(sliding, leg, Factor(f"a at {slide.name}", abs(second), 1, "acceleration"))
        turns = self.equations.value(Rate(slide.guide))
        if abs(turns) <= NEGLIGIBLE_RATIO * self.greatest_angular_velocity:
            return [sliding]
        value = 2.0 * turns * rate * np.array([-way[1], way[0]])
        factors = (
            Factor("2", 2.0, 1, "pure"),
            Factor(f"ω_{slide.guide}", abs(turns), 1, "angular velocity"),
            Factor(f"({self._velocity_chord(leg)})", abs(rate), 1, "velocity"),
        )
        coriolis = self._directed_vector(leg, VectorPart.CORIOLIS, value)
        return [
            coriolis._replace(known=True, is_perpendicular=True, factors=factors, towards=direction_sense(value)),
            sliding,
        ]

    def _velocity_chord(self, leg: ChainVector) -> str:
        """The vector of the velocity polygon between a leg's points."""
        return f"{self.lettering.velocity_letter(leg.tail)}{self.lettering.velocity_letter(leg.head)}"

    def _length_factor(self, leg: ChainVector) -> Factor:
        length = float(np.hypot(*(self.chains.point_position(leg.head) - self.chains.point_position(leg.tail))))
        return Factor(line_name(self.lettering.point_name(leg.tail), self.lettering.point_name(leg.head)), length)

    def _directed_vector(self, leg: ChainVector, part: VectorPart, value: Array) -> PolygonVector:
        """A vector whose direction alone is known."""
        of, against = self.lettering.point_name(leg.head), self.lettering.point_name(leg.tail)
        if leg.slide is None:
            return PolygonVector(part, of, against, "", "", value, False, True, line_name(against, of))
        rider = of if leg.sign > 0.0 else against
        fixed = leg.slide.guide == self.frame
        line = f"line of motion of {rider}" if fixed else f"line on {leg.slide.guide}"
        return PolygonVector(part, of, against, "", "", value, False, False, line)

    def _with_magnitude(self, vector: PolygonVector, leg: ChainVector, *factors: Factor) -> PolygonVector:
        """The vector with its magnitude, where the rate behind it is known."""
        if not self.is_known(leg.rate):
            return vector
        return vector._replace(known=True, factors=factors, towards=direction_sense(vector.value))
