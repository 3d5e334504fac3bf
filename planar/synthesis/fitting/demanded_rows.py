"""The guards of a task's demands: where designs must go together, and what is kept there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.foundation.errors import PlanarError
from planar.solving.cycle import cycle
from planar.synthesis.demands.output_transmissions import output_transmissions
from planar.synthesis.fitting.adjoint_rows import AdjointRows
from planar.synthesis.fitting.demand_guard import DemandGuard
from planar.synthesis.fitting.rate_rows import rate_rows
from planar.synthesis.fitting.region_rows import RegionRows
from planar.synthesis.fitting.transmission_rows import transmission_rows
from planar.synthesis.fitting.wanted_equations import WantedEquations, WantedRows
from planar.synthesis.task.freedom import generic_start
from planar.synthesis.task.starts import FreeNumbers
from planar.synthesis.task.synthesis_task import SynthesisTask

GUARD_POSITIONS = 24
"""Between which a motion is divided, all round a turn or from the first entry to the last."""
LEAST_RATE = 0.04
"""Of the input beside all unknowns, along the path: where it is less a dead point is near."""
SAMPLES = 24
"""Positions of a start, from which the outputs are known that one force drives, and by which pairs."""


def demand_guards(
    task: SynthesisTask, equations: WantedEquations, rows: WantedRows, free: FreeNumbers, size: float
) -> Mapping[bool, DemandGuard] | None:
    """The guards of designs that turn fully (True), and of others; None where nothing is demanded of the motion."""
    demands, mechanism = task.demands, equations.design.mechanism
    kept: list[tuple[AdjointRows | RegionRows, float]] = []
    if demands.transmission is not None:
        kept.append((output_rows(equations, free), demands.transmission))
    if demands.inside is not None:
        kept.append((RegionRows(mechanism, demands.inside, size, equations.free, equations.scale), 0.0))
    turns_only = not kept
    if task.needs_whole_turn or kept:
        kept.append((rate_rows(mechanism, equations.free, equations.scale), LEAST_RATE))
    is_guarded = bool(kept or demands.one_branch)
    is_bound = bool(task.exact) or any(getattr(each, "in_order", False) for each in task.wanted)
    if not (is_guarded or is_bound):
        return None
    positions = rows._replace(inputs=np.zeros(GUARD_POSITIONS + 1 if is_guarded else 0))
    guarded = WantedEquations(mechanism, positions, equations.free, equations.unit)
    kept = [each for each in kept if len(each[0])]
    told = tuple(each for each, _ in kept), tuple(least for _, least in kept)
    return {over_turn: DemandGuard(guarded, *told, not over_turn, turns_only) for over_turn in (True, False)}


def output_rows(equations: WantedEquations, free: FreeNumbers) -> AdjointRows:
    """The transmission angles (rad) of the outputs that one force drives."""
    mechanism = equations.design.mechanism
    try:
        motion = cycle(generic_start(mechanism, free), SAMPLES, pair=mechanism.inputs[0].pair)
        told = tuple(output_transmissions(motion))
    except PlanarError:
        told = ()  # the judge tells
    return transmission_rows(mechanism, told, equations.free, equations.scale)
