"""The stops of pairs as a page has them: between which positions each goes, and where it is, as JavaScript."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.model.link_shapes import LinkShape
from planar.pages.javascript import write_javascript
from planar.solving.position import PositionSolver


def stop_data(solver: PositionSolver) -> list[dict[str, Any]]:
    """Every pair's stops (rad, m; null where open), whether whole turns are left aside, and its size."""
    stops = solver.stops
    if stops is None:
        return []
    numbers = zip(stops.pairs, stops.low, stops.high, stops.is_periodic, stops.scale, strict=True)
    return [
        {
            "pair": pair.name,
            "kind": pair.input_quantity_kinds()[0],
            "low": float(low) if np.isfinite(low) else None,
            "high": float(high) if np.isfinite(high) else None,
            "periodic": bool(periodic),
            "size": float(size),
        }
        for pair, low, high, periodic, size in numbers
    ]


def stop_position_function(solver: PositionSolver, d: ca.SX, changed: dict[str, LinkShape]) -> str:
    """stopping(w, d): the positions of the pairs that have stops (rad, m), of coordinates in SI; null without."""
    stops = solver.stops
    if stops is None:
        return "const stopping=null;"
    w = ca.SX.sym("w", len(solver.equations.coordinates))
    frames, own = frames_from_coordinates(ca.vertsplit(w), solver.column, changed, solver.pairs)
    positions = [ca.SX(pair.input_position_at(changed, frames, own)) for pair in stops.pairs]
    return write_javascript("stopping", ca.Function("stopping", [w, d], [ca.vertcat(*positions)]))
