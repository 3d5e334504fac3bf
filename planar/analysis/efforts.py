"""What the inputs must supply against the loads, by the balance of power."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from planar.mechanism import Input
from planar.motion import State
from planar.solving.position import Solver


def efforts(state: State) -> dict[str, float]:
    """The torque (N m) or force (N) at every input that balances the mechanism's loads without inertia.

    Power balance of virtual velocities: with input i alone moving at unit rate, its effort and the loads do no work
    together, T_i * 1 + sum F . v + sum M omega = 0. So it needs no speed, and holds for any number of inputs.
    """
    found = {}
    for given in state.mechanism.inputs:
        alone = tuple(Input(each.pair, each.position, float(each is given)) for each in state.mechanism.inputs)
        unit = Solver(replace(state.mechanism, inputs=alone)).at_rates_of(state)
        power = 0.0
        for load in state.mechanism.loads:
            if load.point is not None and load.force is not None:
                power += float(np.dot(load.force, unit.point(load.point).velocity))
            if load.link is not None and load.torque is not None:
                power += load.torque * unit.link(load.link).angular_velocity
        found[given.pair] = -power
    return found
