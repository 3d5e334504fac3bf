"""The forces in pairs and of inputs with friction in the sense of the motion: every solution, and remarks on them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple

import numpy as np

from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.friction.contact_choice import ContactChoice, solve_contacts
from planar.dynamics.friction.contact_rows import ContactRows, ContactState
from planar.dynamics.reaction_solver import ForceSolution, ReactionSolver
from planar.dynamics.reactions import Reaction
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.foundation.short_repr import short_repr
from planar.model.wording import count_phrase, join_all_names, quote_names
from planar.results.motion import State


class FrictionalSolution(NamedTuple):
    """One way in which forces with friction can be, and how pairs rub in it."""

    forces: ForceSolution
    contacts: Mapping[str, ContactState]

    def __repr__(self) -> str:
        return short_repr(self)


class FrictionalForces(NamedTuple):
    """The solution that goes over into that without friction, and `others` at a single position.

    `solution_count` (n,) is of all. There is no solution where nothing moves, so that friction has no sense, and where
    the forces that it follows are not determined. `remarks` are what there is to say.
    """

    solution: FrictionalSolution | None
    others: tuple[FrictionalSolution, ...]
    solution_count: IntArray
    remarks: tuple[str, ...]

    def __repr__(self) -> str:
        return short_repr(self)


def solve_friction(reactions: ReactionSolver, field: KinematicArrays, without: ForceSolution) -> FrictionalForces:
    """The forces with friction beside those `without`. Raises NoAnswer where a position jams.

    Where a motion rests for a while they are not determined.
    """
    rows = ContactRows(reactions, field)
    senses = rows.senses()
    is_state, many = isinstance(field.moving, State), rows.count
    if not any(sense.any() for sense in senses.values()):
        told = "nothing moves that rubs, so that friction has no sense: these are the forces without it"
        return FrictionalForces(None, (), np.ones(many, dtype=int), (told,))
    moves = np.any([sense != 0.0 for sense in senses.values()], axis=0)
    unknown = without.is_balanced & moves & ~rows.is_determined()
    sound = without.is_balanced & moves & ~unknown
    system, actions = rows.system(senses)
    choice = solve_contacts(system.where(sound))
    jams = sound & (choice.solution_count == 0)
    if is_state and jams.any():
        raise NoAnswer(Outcome.INPUT_JAMMED, _jam_sentence(choice, rows.rubbing_pairs))
    solution = reactions.solve_beside(rows.pair_actions(actions, np.nan_to_num(choice.first)))
    whys = [without.imbalance]
    if jams.any():
        whys.append("friction jams it there: no forces in the pairs balance the links")
    if (without.is_balanced & ~moves).any():
        whys.append("nothing moves there that rubs, so that friction has no sense")
    if unknown.any():
        whys.append(f"what friction at {quote_names(rows.rubbing_pairs)} follows is not determined")
    why = "; ".join(filter(None, whys))
    solution = solution._replace(is_balanced=sound & solution.is_balanced & ~jams, imbalance=why)
    others = tuple(
        FrictionalSolution(
            reactions.solve_beside(rows.pair_actions(actions, y[None])), rows.states(system, senses, y[None])
        )
        for y in choice.others.get(0, ())
        if is_state
    )
    remarks = (*_unrubbed_sentences(senses), *_choice_sentences(choice, jams, is_state))
    first = FrictionalSolution(solution, rows.states(system, senses, choice.first))
    return FrictionalForces(first, others, np.where(sound, choice.solution_count, 0), remarks)


def solve_with_friction(reactions: ReactionSolver, field: KinematicArrays) -> ForceSolution:
    """The forces at many positions, with friction where pairs have any and rub."""
    without = reactions.solve()
    if not any(pair.has_friction for pair in reactions.pairs.values()):
        return without
    result = solve_friction(reactions, field, without).solution
    return without if result is None else result.forces


def pair_heat(field: KinematicArrays, reaction: Reaction) -> Array:
    """What a pair takes of the power of its links (n,), W, from its reaction and how the links move."""
    if reaction.at is None:
        power = [couple * field.angle_rates(link) for link, couple in reaction.couples.items()]
        lost: Array = -np.sum(power, axis=0)
        return lost
    first, second = reaction.links
    slip = field.velocity_at(second, reaction.at) - field.velocity_at(first, reaction.at)
    turning = field.angle_rates(second) - field.angle_rates(first)
    found: Array = -(np.einsum("nk,nk->n", reaction.force, slip) + reaction.couple * turning)
    return found


def _jam_sentence(choice: ContactChoice, pairs: tuple[str, ...]) -> str:
    proved = "" if choice.is_complete.all() else ", as far as was searched"
    return (
        f"with the friction at {quote_names(pairs)} no forces in the pairs balance the links in this motion{proved}: "
        f"it jams; {_part_phrase(choice.part[0])}"
    )


def _part_phrase(part: float) -> str:
    return f"with {100.0 * part:.4g} % of every coefficient of friction, and no more, it still moves"


def _unrubbed_sentences(senses: Mapping[str, Array]) -> Iterator[str]:
    """Which pairs have friction but do not rub."""
    still = [name for name, sense in senses.items() if not sense.any()]
    if still:
        yield f"nothing rubs at {quote_names(still)}, where friction is not determined and is left out"


def _choice_sentences(choice: ContactChoice, jams: BoolArray, is_state: bool) -> Iterator[str]:
    """What there is to say of several solutions, or of none."""
    several = choice.solution_count > 1
    folded = ~jams & (choice.part < 1.0)
    if is_state:
        if several.any():
            yield (
                f"with friction there are {choice.solution_count[0]} solutions, and equilibrium does not tell which is "
                "there; this is the "
                + ("one with the least forces" if folded.any() else "one that goes over into that without friction")
            )
        if folded.any():
            yield f"no solution goes over into that without friction: {_part_phrase(choice.part[0])}"
    else:
        counted = {
            "friction jams it": jams,
            "several solutions with friction, the first of which is told": several,
            "only solutions that do not go over into that without friction": folded,
        }
        many = [
            f"{what} at {count_phrase(int(rows.sum()), 'position')}" for what, rows in counted.items() if rows.any()
        ]
        if many:
            yield join_all_names(many)
    unsure = ~choice.is_complete
    if unsure.any():
        where = count_phrase(int(unsure.sum()), "position")
        yield f"whether there are more solutions was not searched to the end at {where}"
