"""One input moving at unit rate, the others held: the virtual velocities of power balances."""

from __future__ import annotations

from dataclasses import replace

from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Input, Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.model.wording import quote_names
from planar.results.motion import State
from planar.solving.position import PositionSolver


def unit_rate_state(state: State, pair: str) -> State:
    """The same position with this input moving at unit rate (1 rad/s or 1 m/s) and the others held.

    Raises NoAnswer where no input can move alone, because there are more of them than freedoms.
    """
    refuse_surplus_inputs(state)
    driven = tuple(Input(each.pair, each.position, float(each.pair == pair)) for each in state.mechanism.inputs)
    return PositionSolver(replace(state.mechanism, inputs=driven)).state_with_rates(state)


def refuse_surplus_inputs(state: State) -> None:
    """Raise NoAnswer where there are more inputs than freedoms."""
    given = state.mechanism.inputs
    if state.mobility < len(given):
        raise NoAnswer(
            Outcome.TOO_MANY_INPUTS,
            f"the {len(given)} inputs at {quote_names([each.pair for each in given])} drive a mechanism of mobility "
            f"{state.mobility}: none moves alone, and equilibrium does not tell what each supplies; "
            f"leave out {len(given) - state.mobility} of them",
        )


def has_length_motion(mechanism: Mechanism, name: str) -> bool:
    """Whether the relative motion at a pair is a length."""
    return relative_motions(mechanism)[name].input_kind is MeasureKind.LENGTH
