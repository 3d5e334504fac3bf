"""Why a mechanism cannot be assembled: pairs and inputs in conflict, and the changes that mend it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import hypot
from typing import Any

from planar.assemblies.joint_feasibility import JointFeasibility, Requirement
from planar.assemblies.modes import modes
from planar.assemblies.polynomial.completeness import Completeness
from planar.document.first_argument import takes_mechanism
from planar.foundation.errors import NoAnswer
from planar.foundation.geometry import Vector
from planar.foundation.time_limit import stops_in_time
from planar.model.link_graph import pairs_farthest_first
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import quote_names
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.nearest_assembly import AssemblySearchFailure, find_nearest_assembly
from planar.solving.diagnosis.remedy import RemedyChange, RemedySearch
from planar.solving.position import PositionSolver, solved_mechanism

TOO_LONG_MARGIN = 1e-9
"""By so much more a side of a ring is called too long: part of the others together."""
LARGE_CONFLICT = 8
"""Pairs and inputs: where a set has more, no other is looked for."""
MAX_MOVING_LINKS = 12
"""Moving links among which a conflict is looked for."""
MAX_SEED_PAIRS = 6
"""Pairs of the block that stays open about which a smallest set is looked for."""


@dataclass(frozen=True, eq=False)
class Conflict:
    """Pairs and inputs of a mechanism that cannot be met together, and what would mend it.

    `pairs` (by the names of the file's entries) and `inputs` (by their pairs) are irreducible: without any one of them
    the others can be met, by positions that were found. Of the irreducible sets found it is the smallest.
    """

    mechanism: Mechanism
    pairs: tuple[str, ...]
    inputs: tuple[str, ...]
    links: tuple[str, ...]
    "those that these relate: only a dimension of one of them can mend it"
    complete: Completeness
    "how surely there is no position that meets them: whether the list of these is complete"
    _solver: PositionSolver
    _failure: AssemblySearchFailure

    def __reduce__(self) -> tuple[Any, ...]:
        # compiled equations stay in their process: another one looks for the conflict again
        return conflict, (self.mechanism,)

    def __repr__(self) -> str:
        return f"<Conflict in {self.mechanism.name!r} of {quote_names((*self.pairs, *self.inputs))}>"

    @cached_property
    def dimensions(self) -> tuple[RemedyChange, ...]:
        """Changes of one dimension each that let the whole go together, the least first of those found."""
        return tuple(RemedySearch(self._solver, self._failure, thorough=True).dimensions(frozenset(self.links)))

    @cached_property
    def positions(self) -> tuple[RemedyChange, ...]:
        """Positions of one input each, the others standing still, with which it goes together: the nearest found."""
        return tuple(RemedySearch(self._solver, self._failure, thorough=True).positions(self.inputs))

    @property
    def remarks(self) -> tuple[str, ...]:
        """What is in conflict, and how surely."""
        held = f"pair{'s' * (len(self.pairs) != 1)} {quote_names(self.pairs)}"
        if self.inputs:
            held += f" and the input{'s' * (len(self.inputs) != 1)} at {quote_names(self.inputs)}"
        others = [given.pair for given in self.mechanism.inputs if given.pair not in self.inputs]
        moved = (
            f"moving the input{'s' * (len(others) != 1)} at {quote_names(others)} does not mend it" if others else ""
        )
        if self.complete is Completeness.NOT:
            sure = "no position was found by a search from many starts, which is no proof"
            sure += f"; if there is none, {moved}" if moved else ""
        else:
            sure = f"the list of their positions is {self.complete.value}, and empty"
            sure += f"; {moved}" if moved else ""
        told = [f"in conflict: {held}; without any one of these the others can be met", sure]
        if not self.dimensions and not self.positions:
            told.append(
                "no change of one dimension or one input was found that mends it; others may be in conflict beside"
            )
        return tuple(told)


@takes_mechanism
@stops_in_time
def conflict(
    mechanism: Mechanism,
    drives: Mapping[str, float] | Sequence[Drive] = (),
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Conflict | None:
    """The pairs and inputs that keep a mechanism from going together at its inputs; None where it goes together.

    None too where those in conflict join more than MOST moving links: they are too many to be told apart.
    `drives` change inputs, as {pair: position} (rad or m). Raises NoAnswer where the inputs leave links free, and after
    `timeout` s or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> planar.conflict(planar.load("four-bar")) is None
    True
    """
    if isinstance(drives, Mapping):
        drives = [Drive(pair)._replace(position=position) for pair, position in drives.items()]
    mechanism = replace_inputs(mechanism, tuple(drives))
    if modes(mechanism, certify=False):
        return None
    solver = solved_mechanism(mechanism).solver
    failure = find_nearest_assembly(BlockAssemblies(solver))
    joining = JointFeasibility(solver)
    if not isinstance(failure, AssemblySearchFailure):
        return None
    joining.mark_infeasible(joining.requirements)
    found: dict[tuple[Requirement, ...], Completeness] = {}
    for order in _member_orders(joining, failure):
        held = _irreducible_set(joining, order)
        while held and held not in found:
            alone = _empty_list_completeness(joining, held)
            if alone is not None:
                found[held] = alone
            else:
                joining.mark_feasible(held)
                held = _irreducible_set(joining, order)
        if len(held) > LARGE_CONFLICT:
            break
    if not found:
        return None
    least = min(found, key=len)
    return Conflict(
        mechanism,
        tuple(each.name for each in least if not each.is_input),
        tuple(each.name for each in least if each.is_input),
        tuple(link.name for link in mechanism.links if any(link.name in joining.bodies(each) for each in least)),
        found[least],
        solver,
        failure,
    )


def _member_orders(joining: JointFeasibility, failure: AssemblySearchFailure) -> list[list[Requirement]]:
    """All members in several orders: from some pair of the block that stays open, those next to it first."""
    mechanism = joining.setup.mechanism
    entry_of = {pair.name: pair.entry_name() for pair in mechanism.pairs}
    orders = []
    for seed in dict.fromkeys(entry_of[name] for name in (failure.stage.pairs or entry_of)):
        first = next(name for name, entry in entry_of.items() if entry == seed)
        names = [seed, *(entry_of[name] for name in reversed(pairs_farthest_first(mechanism, first)))]
        rank = {name: index for index, name in reversed(list(enumerate(names)))}
        orders.append(sorted(joining.requirements, key=lambda each: (rank[joining.entry(each)], each.is_input)))
    return orders[:MAX_SEED_PAIRS]


def _irreducible_set(joining: JointFeasibility, order: Sequence[Requirement]) -> tuple[Requirement, ...]:
    """An irreducible set among members that do not agree, of the first as far as can be; none if it is too large.

    Of the first ones that do not agree one after the other is left out that is not needed for that: the deletion
    filter of J. Chinneck, E. Dravnieks, Locating Minimal Infeasible Constraint Sets in Linear Programs, ORSA J.
    Comput. 3, 1991.
    """
    near = [
        each for many, each in enumerate(order, start=1) if len(joining.moving_links(order[:many])) <= MAX_MOVING_LINKS
    ]
    if len(near) < len(order) and joining.is_feasible(near):
        return ()
    agreeing, not_so = 0, 1
    order = near
    while not_so < len(order) and joining.is_feasible(order[:not_so]):
        agreeing, not_so = not_so, min(2 * not_so, len(order))
    while not_so - agreeing > 1:
        middle = (agreeing + not_so) // 2
        agreeing, not_so = (middle, not_so) if joining.is_feasible(order[:middle]) else (agreeing, middle)
    held = order[:not_so]
    for each in reversed(order[: not_so - 1]):
        rest = [other for other in held if other != each]
        if not joining.is_feasible(rest):
            held = rest
    return tuple(each for each in joining.requirements if each in held)


def _empty_list_completeness(joining: JointFeasibility, members: Sequence[Requirement]) -> Completeness | None:
    """How complete the list of positions that meet these is, which is empty; None where it is not."""
    alone = _mechanism_of(joining, members)
    if alone is None:
        return Completeness.NOT
    try:
        found = modes(alone)
    except NoAnswer:  # some links are free
        return Completeness.NUMERICALLY if _is_side_too_long(joining, alone.pairs) else Completeness.NOT
    return None if found else found.complete


def _is_side_too_long(joining: JointFeasibility, pairs: Sequence[Pair]) -> bool:
    """Whether these are pins that join links to one ring in which one is longer than all others together."""
    ends: dict[str, list[Vector]] = {}
    for pair in pairs:
        if not pair.is_lower_pair or pair.input_kind is not MeasureKind.ANGLE:
            return False
        for link, point in pair.coincident_points():
            ends.setdefault(link, []).append(joining.setup.shapes[link].points[point])
    if any(len(each) != 2 for each in ends.values()):
        return False
    sides = [hypot(*(one - other)) for one, other in ends.values()]
    return max(sides) > (sum(sides) - max(sides)) * (1.0 + TOO_LONG_MARGIN)


def _mechanism_of(joining: JointFeasibility, members: Sequence[Requirement]) -> Mechanism | None:
    """The mechanism of these alone, without links that dangle; None where an input's pair is not among them."""
    mechanism = joining.setup.mechanism
    held = [link for member in members for link in joining.bodies(member)]
    needed = {link for link in held if held.count(link) > 1} | {mechanism.frame}
    pairs: list[Pair] = []
    for member in members:
        if not member.is_input:
            group = joining.pairs[member]
            among = [pair for pair in type(group[0]).relative_motions(group) if needed.issuperset(pair.links)]
            pairs += [pair for pair in among if pair.links[0] == among[0].links[0]]
    links = tuple(link for link in mechanism.links if any(link.name in pair.bodies for pair in pairs))
    inputs = [member.name for member in members if member.is_input]
    if not {Requirement(joining.entry(member)) for member in members} <= set(members):
        return None
    return replace(
        mechanism,
        frame=mechanism.frame if mechanism.frame in {link.name for link in links} else links[0].name,
        links=links,
        pairs=tuple(pairs),
        inputs=tuple(given for given in mechanism.inputs if given.pair in inputs),
        loads=(),
        sketch=(),
        published=(),
    )
