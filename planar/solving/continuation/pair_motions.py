"""Relative motions at pairs along a curve of positions: position, first and second derivative by arc length."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.equations.coordinates import FRAME_PARTS, frames_from_coordinates
from planar.foundation.arrays import Array
from planar.foundation.jets import Jet, value_and_rates
from planar.model.pairs import Pair
from planar.solving.continuation.solution_curve import CurvePoint, SolutionCurve
from planar.solving.prepared_mechanism import PreparedMechanism


def pair_motions_at(setup: PreparedMechanism, pairs: Sequence[Pair], curve: SolutionCurve, point: CurvePoint) -> Array:
    """Position, first and second derivative by arc length of every pair's motion (pairs, 3), SI."""
    if not pairs:
        return np.zeros((0, 3))
    rates, second = curve.widen_direction(point.tangent), curve.widen_direction(point.curvature)
    moving = setup.functions.kinematics(curve.unknowns_and_inputs(point.y), rates, second, curve.p)
    bodies = dict.fromkeys(link for pair in pairs for link in pair.bodies)
    joined = {pair.name: setup.pairs[pair.name] for pair in pairs if pair.name in setup.pairs}
    named = [(link, part) for link in bodies for part in FRAME_PARTS]
    named += [(name, part) for name, pair in joined.items() for part, _ in pair.coordinate_kinds]
    columns = [setup.column[each] for each in named if each in setup.column]
    parts = np.stack([moving.w, moving.w1, moving.w2], axis=1)[columns] * setup.scale[columns, None]
    jets = {column: Jet(*each) for column, each in zip(columns, parts.tolist(), strict=True)}
    frames, own = frames_from_coordinates(jets, setup.column, bodies, joined)
    return np.array([value_and_rates(pair.input_position_at(setup.shapes, frames, own)) for pair in pairs], dtype=float)
