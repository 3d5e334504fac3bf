"""One input moving at unit rate, the others held: the virtual velocities of power balances."""

from __future__ import annotations

from dataclasses import replace

from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Input, Mechanism, motions
from planar.model.pairs import Kind
from planar.model.wording import quoted
from planar.results.motion import State
from planar.solving.position import Solver


def alone(state: State, pair: str) -> State:
    """The same position with this input moving at unit rate (1 rad/s or 1 m/s) and the others held.

    Raises NoAnswer where no input can move alone, because there are more of them than freedoms.
    """
    refuse_surplus(state)
    driven = tuple(Input(each.pair, each.position, float(each.pair == pair)) for each in state.mechanism.inputs)
    return Solver(replace(state.mechanism, inputs=driven)).at_rates_of(state)


def refuse_surplus(state: State) -> None:
    """Raise NoAnswer where there are more inputs than freedoms."""
    given = state.mechanism.inputs
    if state.mobility < len(given):
        raise NoAnswer(
            Outcome.TOO_MANY_INPUTS,
            f"the {len(given)} inputs at {quoted([each.pair for each in given])} drive a mechanism of mobility "
            f"{state.mobility}: none moves alone, and equilibrium does not tell what each supplies; "
            f"leave out {len(given) - state.mobility} of them",
        )


def slides(mechanism: Mechanism, name: str) -> bool:
    """Whether the relative motion at a pair is a length."""
    return motions(mechanism)[name].drive_kind is Kind.LENGTH
