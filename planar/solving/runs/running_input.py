"""One input that runs while the others stand still: its positions, what may be spent on them, and their curve."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from math import pi

import numpy as np

from planar.foundation.arrays import Array
from planar.model.mechanism import LARGEST_INPUT_POSITION, Drive, Mechanism, replace_inputs, running_input_index
from planar.solving.continuation.predictor_corrector import MAX_ARCS, ArcBudget, CurveTracker
from planar.solving.position import solved_mechanism
from planar.solving.rates.sample_rates import InputRates

ARCS_PER_TURN = 100
"""Arcs by which what may be spent grows with each turn that is asked for, as far as a motion is followed at most."""

Progress = Callable[[float, float], None]


class RunningInput:
    """One input of a mechanism that runs while the others stand still.

    `progress(done, total)` is called now and then, in rad or m of the input's way.
    """

    def __init__(
        self,
        mechanism: Mechanism,
        pair: str | None,
        branches: Sequence[int],
        third: bool,
        progress: Progress | None = None,
    ):
        names = [given.pair for given in mechanism.inputs]
        self.index = running_input_index(mechanism, pair)
        still = tuple(Drive(name, None, 0.0, 0.0) for k, name in enumerate(names) if k != self.index)
        self.known = solved_mechanism(replace_inputs(mechanism, still))
        self.solver = self.known.solver
        self.pair = names[self.index]
        self.is_sliding = self.solver.is_sliding(self.pair)
        self.scale = self.solver.unit if self.is_sliding else 1.0
        self.u, self.p = self.solver.inputs.u, self.solver.inputs.p
        self.branches, self.with_jerk = tuple(branches), third
        self.assembly = self.known.assembly
        self.progress = progress
        self.current_budget = self.arc_budget(0.0)

    def input_rates(self, positions: Array, senses: Array | float = 1.0) -> InputRates:
        """The inputs over a run, each row with the file's rates; backwards the velocity turns round."""
        s, many = self.solver.inputs, len(positions)
        u1, u2 = (np.repeat(rate[None], many, axis=0) for rate in (s.u1, s.u2))
        return InputRates(self.inputs_at(positions), u1 * np.reshape(senses, (-1, 1)), u2, np.zeros_like(u1))

    def inputs_at(self, positions: Array | float) -> Array:
        """The inputs where the one that runs is at a position, or at positions (positions, inputs)."""
        inputs = np.tile(self.u, (*np.shape(positions), 1))
        inputs[..., self.index] = positions
        return inputs

    def arc_budget(self, reach: float, first: float | None = None) -> ArcBudget:
        """What may be spent on so long a way of the input; who asked is told how far from `first` it has come."""
        tell = None
        if self.progress is not None and first is not None:
            inform, total = self.progress, reach * self.scale

            def tell(u: Array) -> None:
                inform(min(abs(float(u[self.index]) - first) * self.scale, total), total)

        return ArcBudget(MAX_ARCS + int(ARCS_PER_TURN * min(reach, LARGEST_INPUT_POSITION) / (2.0 * pi)), tell)

    def curve_tracker(self, z: Array, first: float, way: float = 1.0, work: ArcBudget | None = None) -> CurveTracker:
        """A walk from a position of the input, in the direction in which it goes on."""
        axis = np.zeros_like(self.u)
        axis[self.index] = way
        position = z, self.inputs_at(first)
        return CurveTracker.from_position(self.solver, self.p, position, axis, self.branches, work)
