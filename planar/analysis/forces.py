"""What the inputs must supply against the loads, by the balance of power."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import isfinite
from typing import NamedTuple

import numpy as np

from planar.analysis.equilibrium import carriers, equilibrium
from planar.errors import BadInput, NoAnswer, Outcome
from planar.mechanism import Input, Load, Mechanism, motions
from planar.motion import State
from planar.pairs import Kind
from planar.solving.position import Solver
from planar.words import listed

Array = np.ndarray
ROUNDING = 1e-14
"""Of the power that loads would have at the greatest speed: less is the round-off of their velocities."""


class Loaded(NamedTuple):
    """A load, the motion of what it acts on at the state's own rates, and its power (W), positive where it drives."""

    load: Load
    position: Array | None
    "(2,), m, of a point"
    velocity: Array | None
    "(2,), m/s, of a point"
    angular_velocity: float | None
    "rad/s, of a link"
    power: float


class Proof(NamedTuple):
    """How far three laws are from being kept, each beside what it balances; None where a law says nothing.

    `power`: what inputs and loads supply together at the state's own rates, beside what the loads would if each acted
    along the greatest motion that there is; None where nothing moves. `routes`: between the efforts and the multipliers
    of the inputs in the equilibrium of all links, beside the loads at an arm of the mechanism's size; `equilibrium`:
    what that leaves open. Both None without loads, or where links could move to first order with the inputs held.
    """

    power: float | None
    routes: float | None
    equilibrium: float | None


@dataclass(frozen=True)
class Forces:
    """What the inputs of a position have to supply against its loads, without inertia, weight and friction.

    `inputs["O"]` is a torque (N m) at a pair whose motion is an angle, a force (N) at one whose motion is a length,
    positive in the positive sense of the input's motion; `powers` (W) are those of the inputs at the state's own rates.
    """

    state: State
    inputs: Mapping[str, float]
    loads: tuple[Loaded, ...]
    powers: Mapping[str, float]
    proof: Proof

    @property
    def greatest(self) -> float:
        """What the loads would supply, W, if each acted along the greatest motion that there is."""
        return greatest(self.state)

    @property
    def power_in(self) -> float:
        """What the inputs supply, W."""
        return sum(self.powers.values())

    @property
    def power_out(self) -> float:
        """What the mechanism does against the loads, W."""
        return 0.0 - sum(loaded.power for loaded in self.loads)

    def slides(self, name: str) -> bool:
        """Whether an input's effort is a force (N), not a torque (N m)."""
        return slides(self.state.mechanism, name)


def forces(state: State) -> Forces:
    """The torque or force at every input that balances a mechanism's loads, at rest or in slow motion.

    By virtual power with each input alone at unit rate, so that it needs no speed and holds for any number of inputs;
    without inertia, weight and friction. Without loads every effort is zero. Raises BadInput where a load is none of
    this mechanism's; NoAnswer where there are more inputs than freedoms, which equilibrium does not tell apart.
    """
    found = efforts(state)
    loads = tuple(loaded(state, load) for load in state.mechanism.loads)
    powers = {name: effort * state.inputs[name].velocity + 0.0 for name, effort in found.items()}
    whole = greatest(state)
    left = abs(sum(powers.values()) + sum(each.power for each in loads))
    return Forces(state, found, loads, powers, Proof(left / whole if whole else None, *_other_route(state, found)))


def efforts(state: State) -> dict[str, float]:
    """The torque (N m) or force (N) at every input that balances the mechanism's loads.

    Power balance of virtual velocities: with input i alone moving at unit rate, its effort and the loads do no work
    together, T_i * 1 + sum F . v + sum M omega = 0. Raises as `forces` does.
    """
    mechanism = state.mechanism
    _check(mechanism)
    found = {given.pair: 0.0 for given in mechanism.inputs}
    for name in found if mechanism.loads else ():
        unit = alone(state, name)
        power = sum(loaded(unit, load).power for load in mechanism.loads)
        found[name] = -power if abs(power) > ROUNDING * greatest(unit) else 0.0
    return found


def alone(state: State, pair: str) -> State:
    """The same position with this input moving at unit rate (1 rad/s or 1 m/s) and the others held.

    Raises NoAnswer where no input can move alone, because there are more of them than freedoms.
    """
    given = state.mechanism.inputs
    if state.mobility < len(given):
        raise NoAnswer(
            Outcome.TOO_MANY_INPUTS,
            f"the {len(given)} inputs at {listed([each.pair for each in given])} drive a mechanism of mobility "
            f"{state.mobility}: none moves alone, and equilibrium does not tell what each supplies; "
            f"leave out {len(given) - state.mobility} of them",
        )
    driven = tuple(Input(each.pair, each.position, float(each.pair == pair)) for each in given)
    return Solver(replace(state.mechanism, inputs=driven)).at_rates_of(state)


def loaded(state: State, load: Load) -> Loaded:
    """A load with the motion of what it acts on."""
    power, position, velocity, turning = 0.0, None, None, None
    if load.point is not None and load.force is not None:
        position, velocity, *_ = state.point(load.point)
        power += float(np.dot(load.force, velocity))
    if load.link is not None and load.torque is not None:
        turning = state.link(load.link).angular_velocity
        power += load.torque * turning
    return Loaded(load, position, velocity, turning, power)


def greatest(state: State) -> float:
    """The power (W) that the loads would have if each acted along the greatest motion of any point, or of any link."""
    loads = state.mechanism.loads
    speed = max((float(np.hypot(*point.velocity)) for point in state.points.values()), default=0.0)
    turning = max(abs(link.angular_velocity) for link in state.links.values())
    forces = sum(float(np.hypot(*load.force)) for load in loads if load.force is not None)
    return forces * speed + turning * sum(abs(load.torque) for load in loads if load.torque is not None)


def slides(mechanism: Mechanism, name: str) -> bool:
    """Whether the relative motion at a pair is a length."""
    return motions(mechanism)[name].drive_kind is Kind.LENGTH


def _other_route(state: State, found: Mapping[str, float]) -> tuple[float | None, float | None]:
    """How far the efforts are from the inputs' multipliers, and what these leave open: see `Proof`."""
    balance = equilibrium(state)
    if balance is None:
        return None, None
    worst = 0.0
    for name, effort in found.items():
        arm = balance.size if slides(state.mechanism, name) else 1.0
        apart = abs(effort - balance.efforts[name]) * arm
        worst = max(worst, apart / max(balance.scale, abs(effort) * arm))
    return worst, balance.left


def _check(mechanism: Mechanism) -> None:
    """Refuse loads of a mechanism made in Python that are none; those of a file are checked at their place there."""
    points, links = carriers(mechanism), [link.name for link in mechanism.links]
    for index, load in enumerate(mechanism.loads):
        place = f"loads[{index}]"
        if (load.point is None) != (load.force is None) or (load.link is None) != (load.torque is None):
            raise BadInput(place, "a force acts at a point and a torque on a link; one of the two is left out")
        if load.point is None and load.link is None:
            raise BadInput(place, "a load is a force at a point, or a torque on a link")
        if load.point is not None and load.point not in points:
            raise BadInput(place, f"there is no point {load.point!r}; points are {', '.join(points)}")
        if load.link is not None and load.link not in links:
            raise BadInput(place, f"there is no link {load.link!r}; links are {', '.join(links)}")
        if not all(isfinite(value) for value in (*(load.force or ()), load.torque or 0.0)):
            raise BadInput(place, "a load is a finite number")
