"""Positions of the input at which pairs pass their stops, along circuits that are followed as if there were none."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from planar.assemblies.circuits.traced_circuit import BranchLeg, TracedCircuit
from planar.foundation.arrays import Array
from planar.foundation.root_finding import find_root
from planar.solving.continuation.path import PathPiece
from planar.solving.continuation.solution_curve import pair_motions_at
from planar.solving.stops import PairStops


def stop_positions(circuits: Sequence[TracedCircuit], stops: PairStops) -> Iterator[float]:
    """Every position of the input (rad, m) at which a pair passes one of its stops."""
    for circuit in circuits:
        for legs in circuit.branches:
            for leg in legs:
                for piece in leg.pieces:
                    for place in _passed_on(leg, piece, stops):
                        yield leg.position(place) * circuit.scale


def _passed_on(leg: BranchLeg, piece: PathPiece, stops: PairStops) -> Iterator[float]:
    """Where on its way the input is as pairs pass their stops on a piece of the curve."""
    limits = np.array([stops.low, stops.high])

    def gaps(x: float) -> Array:
        """How far pairs are from their stops, whole turns aside, with the rate along the curve (2, stops, 2)."""
        motions = pair_motions_at(stops.pairs, leg.curve, piece.arc.point_at(leg.curve, x))
        off = np.where(np.isfinite(limits), motions[:, 0] - limits, np.inf)
        rate = np.broadcast_to(motions[:, 1], off.shape)
        half = np.where(stops.is_periodic & np.isfinite(off), 0.5 * off, 0.0)
        value = np.where(stops.is_periodic & np.isfinite(off), 2.0 * np.sin(half), off)
        return np.stack([value, np.where(stops.is_periodic, np.cos(half) * rate, rate)], axis=2)

    sense = 1.0 if piece.last >= piece.first else -1.0
    before, after = gaps(piece.first), gaps(piece.last)
    for side, k in np.argwhere(np.isfinite(limits)):
        (g0, s0), (g1, s1) = before[side, k], after[side, k]
        s0, s1 = sense * s0, sense * s1

        def part(x: float, of: int, side: int = side, k: int = k) -> float:
            return float(gaps(x)[side, k, of])

        ends = [piece.first, piece.last]
        if g0 * g1 > 0.0 and g0 * s0 < 0.0 < g1 * s1:  # it comes nearer, and goes away again
            ends.insert(1, find_root(lambda x: part(x, 1), *ends))
        values = [part(x, 0) for x in ends]
        for (x, a), (y, b) in zip(
            zip(ends, values, strict=True), list(zip(ends, values, strict=True))[1:], strict=False
        ):
            if a * b < 0.0 or b == 0.0:
                root = find_root(lambda x: part(x, 0), x, y)
                yield float(piece.arc.curve_coordinates(leg.curve, root)[-1])
