"""The transmission angles of a start's outputs, at positions of many designs.

Forces are those of all constraints' multipliers under an effort on the output alone; see `planar.transmission`.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import casadi as ca

from planar.analysis.motion.transmission_angle import Transmission
from planar.derivatives.transmission_system import TransmissionSystem
from planar.foundation.arrays import Array
from planar.model.mechanism import Mechanism
from planar.model.output_pair import find_output_pair
from planar.synthesis.fitting.adjoint_rows import AdjointRows, LinearSystem


def transmission_rows(
    mechanism: Mechanism, transmissions: Sequence[Transmission], free: Sequence[str], scale: Array
) -> AdjointRows:
    """Angles (rad), a column for each of the transmissions."""
    return AdjointRows(_linear_systems(mechanism, transmissions), free, scale)


def _linear_systems(mechanism: Mechanism, transmissions: Sequence[Transmission]) -> Iterator[LinearSystem]:
    """The balance under an effort on each output."""
    for each in transmissions:
        pair = find_output_pair(mechanism, each.pair)[1]
        system = TransmissionSystem(mechanism, each.link, pair, each.through)
        balance, design = system.balance, system.design
        given = [balance.work.factors, balance.constants, design.z1, design.z2]
        known = [ca.SX.ones(given[0].numel()), *(ca.SX.zeros(other.numel()) for other in given[1:])]
        acting, angle = ca.substitute(
            [balance.in_unknowns(balance.acting), balance.in_unknowns(system.angle)], given, known
        )
        yield LinearSystem(design, acting, balance.unknowns, angle)
