"""Why no forces in the pairs balance the links, and what helps: another position, or another pair."""

from __future__ import annotations

from planar.dynamics.reaction_solver import ReactionSolver
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Mechanism
from planar.model.wording import quote_names
from planar.solving.assembly.nearest_assembly import links_held_to_second_order
from planar.solving.position import solved_mechanism


def explain_imbalance(reactions: ReactionSolver) -> str:
    """Why reactions are not told at positions of a motion at which nothing balances the links."""
    loose = explain_loose_links(reactions.mechanism)
    return f"no forces in the pairs balance the links there{f': {loose}' if loose else ', as at a dead point'}"


def imbalance_refusal(reactions: ReactionSolver) -> NoAnswer:
    """That nothing balances the links at a position."""
    loose = explain_loose_links(reactions.mechanism)
    input_names = quote_names([given.pair for given in reactions.mechanism.inputs])
    why = f": {loose}" if loose else f", which the inputs at {input_names} cannot hold; move the input"
    return NoAnswer(Outcome.DEAD_POINT, f"no forces in the pairs balance the links here{why}")


def explain_loose_links(mechanism: Mechanism) -> str:
    """Which links the pairs leave free to first order, wherever the inputs are, and what would hold them.

    Empty where that is so in single positions only: there another position helps.
    """
    solver = solved_mechanism(mechanism).solver
    if not solver.is_deflated:
        return ""
    links = links_held_to_second_order(solver)
    single = [
        pair.name
        for pair in mechanism.pairs
        if pair.prevented_motion_count() == 1 and not pair.ties_angles and not {*links}.isdisjoint(pair.bodies)
    ]
    them = "it" if len(links) == 1 else "them"
    helps = f"hold {them} by a further pair, or load {them} so that nothing pushes that way"
    if single:
        in_place = " or ".join(repr(name) for name in single)
        helps = f"have a pair that bears couples too, as a sliding pair, in place of {in_place}"
    return (
        f"wherever the inputs are the pairs hold link{'s' * (len(links) != 1)} {quote_names(links)} to second order "
        f"only, and bear no load that would move {them} to first order; {helps}"
    )
