"""What is told of a position: points on links, and their rates."""

from __future__ import annotations

from collections.abc import Sequence

import casadi as ca

from planar.batch.march.kernel import KernelEquations, KernelWriter, Operand
from planar.equations.rates import first_and_second_rates
from planar.foundation.geometry import Vector
from planar.model.mechanism import links_counting_turns
from planar.model.pairs import MeasureKind


class PointKernelWriter(KernelWriter):
    """A kernel that tells where points on links are, none of which is the frame, and with `rates` their rates."""

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        rates: bool,
        lanes: int,
        invariant: frozenset[str],
        carried: frozenset[Operand],
    ):
        super().__init__(equations, lanes, len(links), invariant, carried)
        self.links, self.rates = links, rates

    def point_coordinates(self, points: Sequence[int]) -> ca.SX:
        """x and y of some of the points."""
        q = self.symbols["q"]
        places = [self.equations.frame(self.links[k]).to_world(Vector(q[2 * k], q[2 * k + 1])) for k in points]
        return ca.vertcat(ca.SX(0, 1), *(part for place in places for part in place))

    def counted_angles(self) -> ca.SX:
        """Angles of links that wheels or racks tie: they may turn much farther in a step than the inputs do."""
        e, links = self.equations.equations, links_counting_turns(self.equations.mechanism)
        unknown = {column: k for k, column in enumerate(e.unknowns)}
        columns = [
            column
            for column, each in enumerate(e.coordinates)
            if each.owner in links and each.of_link and each.kind is MeasureKind.ANGLE
        ]
        # what nothing is made of but cos and sin is as fast as the group that it is in
        found = [e.w[k] for k in columns if k not in unknown or self.is_carried(("z", unknown[k]))]
        return ca.vertcat(ca.SX(0, 1), *found)

    def output_expressions(self) -> list[ca.SX]:
        """The points' positions, and rates."""
        e, s = self.equations.equations, self.symbols
        places = self.point_coordinates(range(len(self.links)))
        if not self.rates:
            return [places]
        z1, z2 = self.equations.rates(s["u1"], s["u2"])
        y, y1, y2 = e.y, ca.vertcat(z1, s["u1"]), ca.vertcat(z2, s["u2"])
        return [places, *first_and_second_rates(places, y, y1, y2)]
