"""The columns of a motion as `planar cycle` writes them: their heads, and what pairs report, as JavaScript."""

from __future__ import annotations

import casadi as ca
import numpy as np

from planar.equations.coordinates import frames_from_coordinates
from planar.equations.rates import first_and_second_rates
from planar.foundation.errors import Outcome
from planar.foundation.jets import Jet
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, links_counting_turns, relative_motions
from planar.model.pairs import MeasureKind
from planar.pages.javascript import write_javascript
from planar.reports.columns import run_columns
from planar.results.motion import Motion
from planar.results.records import InputMotion
from planar.solving.position import PositionSolver


def column_heads(mechanism: Mechanism, solver: PositionSolver) -> list[list[str]]:
    """Name, unit and kind of every column, of inputs, points, links and pairs in this order; none of what stands."""
    if not mechanism.inputs:
        return []
    rest = np.zeros(1)
    still = [Jet(rest, rest, rest) for _ in solver.equations.coordinates]
    inputs = {given.pair: InputMotion(rest, rest, rest) for given in mechanism.inputs}
    frames, own = frames_from_coordinates(still, solver.column, solver.shapes, solver.pairs)
    one = Motion(mechanism, inputs, Outcome.SOLVED, "", 0.0, (), frames, own, solver.shapes)
    return [[column.name, column.unit, column.kind] for column in run_columns(one)]


def uncounted_angles(mechanism: Mechanism) -> list[list[int]]:
    """Of what pairs report the angles whose turns are not counted: which number it is, and its input's number or -1.

    They start within half a turn either way, or where the input is (see `planar.results.motion.Motion.pair`).
    """
    inputs, counts = [given.pair for given in mechanism.inputs], links_counting_turns(mechanism)
    found, at = [], 0
    for name, pair in relative_motions(mechanism).items():
        if pair.input_kind is MeasureKind.ANGLE and not counts.issuperset(pair.links):
            found.append([at, inputs.index(name) if name in inputs else -1])
        at += sum(each is not None for each in pair.results(0.0, 0.0, 0.0).values())
    return found


def reported_function(mechanism: Mechanism, solver: PositionSolver, d: ca.SX, changed: dict[str, LinkShape]) -> str:
    """reported(w, w1, w2, d): all that pairs report (SI), of coordinates and rates in SI."""
    w, w1, w2 = (ca.SX.sym(name, len(solver.equations.coordinates)) for name in ("w", "w1", "w2"))
    frames, own = frames_from_coordinates(ca.vertsplit(w), solver.column, changed, solver.pairs)
    values: list[ca.SX] = []
    for pair in relative_motions(mechanism).values():
        position = ca.SX(pair.input_position_at(changed, frames, own))
        rates = first_and_second_rates(position, w, w1, w2)
        values += [ca.SX(each) for each in pair.results(position, *rates).values() if each is not None]
    return write_javascript("reported", ca.Function("reported", [w, w1, w2, d], [ca.vertcat(*values)]))
