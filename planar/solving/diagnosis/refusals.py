"""Why a mechanism has no answer: whether its motion is determined, and the sentences in which it is refused.

What finds causes and remedies is loaded only when something is refused.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from itertools import permutations
from typing import TYPE_CHECKING

import numpy as np

from planar.equations.symbolic_equations import slice_length
from planar.foundation.arrays import Array
from planar.foundation.errors import MAX_NAMES_LISTED, NoAnswer, Outcome, TrackingEnd
from planar.foundation.errors import join_names as several
from planar.foundation.lazy_module import LazyModule
from planar.foundation.time_limit import time_is_over
from planar.model.mechanism import unjoined_points
from planar.model.pairs import MeasureKind, joining_entry_text
from planar.model.wording import amount, count_phrase, join_all_names, quote_names
from planar.solving.assembly.nearest_assembly import AssemblySearchFailure
from planar.solving.checks import CONTACT_TOLERANCE
from planar.solving.prepared_mechanism import PreparedMechanism

if TYPE_CHECKING:
    from planar.solving import full_constraints
else:  # what finds causes is loaded only when something is refused
    full_constraints = LazyModule("planar.solving.full_constraints")

MAX_BRANCHES_LISTED = 4
"""Branches that are listed one by one."""
DISTINCT_RATE = 1e-3
"""Rates of an angle on two branches that tell them apart."""


def judge_motion(setup: PreparedMechanism, z: Array, pair: str | None = None) -> NoAnswer | None:
    """Why no motion of an input leads away from unknowns z (unknowns,); None where one may.

    The causes are a structure, no input, and inputs of which `pair` (None: each) is held by the others. Dead points and
    change points are not among them: motions lead away from these, and the run reports them. Counting motions takes
    some milliseconds, so this is asked when a motion fails, or where the equations are not regular.
    """
    names = [driven.pair for driven in setup.mechanism.inputs]
    links = [link.name for link in setup.mechanism.links if link.name != setup.mechanism.frame]
    if setup.equations.open_rows:  # lengths that do not agree count as if they did
        return None if names else always_free(setup, links)
    w = setup.functions.coordinates(z, setup.inputs.u, setup.inputs.p)
    motions = full_constraints.count_motions(setup, w)
    if motions == 0 or (motions is None and not names):
        return structure(setup, w)
    if not names:
        return always_free(setup, links)
    if motions is None or motions >= len(names):
        return None
    if any(full_constraints.can_move_alone(setup, w, name) for name in (names if pair is None else [pair])):
        return None
    return NoAnswer(
        Outcome.TOO_MANY_INPUTS,
        f"the mobility is {motions} {setup.describe_position()}, and {_inputs(setup)} are more"
        f"{_inputs_to_leave_out(setup)}",
    )


def judge_velocity(setup: PreparedMechanism, z: Array) -> tuple[int, Callable[[], NoAnswer] | None]:
    """The mobility at a position, and what computes the refusal where the inputs do not determine the velocity there or
    contradict one another; None where they do determine it.

    With one freedom more than inputs it is so to first order: the next orders decide.
    """
    s, rest = setup.inputs, np.zeros_like(z)
    # the unknowns rest while the inputs move
    y, y1, y2 = (np.concatenate(parts) for parts in ((z, s.u), (rest, s.u1), (rest, s.u2)))
    motion = setup.functions.kinematics(y, y1, y2, s.p)
    freedoms, weak = full_constraints.mobility_by_rank(setup, motion)
    if not weak:
        agrees = freedoms >= s.u.size or full_constraints.input_rates_agree(setup, motion)
        return freedoms, None if agrees else lambda: disagreeing_inputs(setup, freedoms, "velocities")

    def refuse() -> NoAnswer:
        links = full_constraints.links_free_at_rest(setup, motion.jacobian)
        links = links or list(dict.fromkeys(link for block in weak for link in block.links))
        if freedoms <= s.u.size:
            return dead_point(setup, links)
        count = full_constraints.count_motions(setup, motion.w)
        is_free = count is not None and count > s.u.size
        if is_free or (count is None and any(full_constraints.is_always_singular(setup, block, z) for block in weak)):
            return always_free(setup, links, motion.w)
        return change_point(setup, links, freedoms, z)

    return freedoms, refuse


def free_links(setup: PreparedMechanism) -> NoAnswer:
    """Links that the inputs leave free whatever the dimensions, or that nothing joins to the frame."""
    from planar.model.link_graph import unconnected_links  # the graph library is slow to load, and only needed here

    apart = unconnected_links(setup.mechanism)
    if apart:
        return NoAnswer(
            Outcome.TOO_FEW_INPUTS,
            f"no chain of pairs joins {_links(apart)} to the frame {setup.mechanism.frame!r}; "
            f"{_missing_pairs(setup, apart) or 'add a pair'}",
            **_all_links(apart),
        )
    jam = jammed_inputs(setup)
    if jam is not None:
        return jam
    stages = [stage for stage in setup.equations.blocks if stage.is_free]
    free = {link for stage in stages for link in stage.links}
    links = [link.name for link in setup.mechanism.links if link.name in free]
    ways = sum(slice_length(stage.unknowns) - slice_length(stage.rows) for stage in stages)
    inputs = len(setup.mechanism.inputs)
    forgotten = _missing_pairs(setup, links)
    return NoAnswer(
        Outcome.TOO_FEW_INPUTS,
        f"with {count_phrase(inputs, 'input')} {_links(links)} can still move in {count_phrase(ways, 'way')}; "
        f"{f'{forgotten}, or ' if forgotten else ''}give an input at "
        f"{_offered_pairs(setup, links, 6)}{_surplus_inputs(setup)}{_block_note(setup, links)}",
        **_all_links(links),
    )


def _block_note(setup: PreparedMechanism, links: Sequence[str]) -> str:
    """What a block is, where a free link hangs at the pin of one alone, or a free block at one link."""
    for block, point, link in (*_lone_blocks(setup, links), *_links_at_blocks(setup, links)):
        if link != setup.mechanism.frame:
            return (
                f"; {block!r} is a link of its own, pinned at {point!r} to link {link!r}: if that link itself "
                f"slides, name it in 'links' with \"point\": {point!r}"
            )
    return ""


def _lone_blocks(setup: PreparedMechanism, links: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Free blocks that are pinned to one link alone: block, point, link."""
    for pair in setup.mechanism.pairs:
        for (block, point), (link, _) in permutations(pair.coincident_points(), 2):
            pinned = [other for other in setup.mechanism.pairs if (block, point) in other.coincident_points()]
            if block in links and block == f"block {point}" and len(pinned) == 1:
                yield block, point, link


def _links_at_blocks(setup: PreparedMechanism, links: Sequence[str]) -> Iterator[tuple[str, str, str]]:
    """Free links that hang at the pin of a block alone: block, point, link."""
    names = {link.name for link in setup.mechanism.links}
    for link in links:
        pairs = [pair for pair in setup.mechanism.pairs if link in pair.bodies]
        points = {point for pair in pairs for owner, point in pair.coincident_points() if owner == link}
        block = f"block {min(points, default='')}"
        if len(points) == 1 and block in names and all(pair.coincident_points() for pair in pairs):
            yield block, points.pop(), link


def _missing_pairs(setup: PreparedMechanism, links: Sequence[str]) -> str:
    """Points that free links share with others but no pair joins, else of links that hang by one pair."""
    mechanism, loose = setup.mechanism, set(links)
    shared = {point: carriers for point, carriers in unjoined_points(mechanism).items() if loose & set(carriers)}
    if shared:
        places = [f"{_links(carriers)} at {point!r}" for point, carriers in shared.items()]
        return f"no pair joins {several(places, 3)}: add {several(map(joining_entry_text, shared), 3)} to the pairs"
    moving = [link.name for link in mechanism.links if link.name != mechanism.frame]
    joints = {link: [pair.entry_name() for pair in mechanism.pairs if link in pair.links] for link in moving}
    hanging = [f"link {link!r} hangs at {names[0]!r} alone" for link, names in joints.items() if len(names) == 1]
    return f"{several(hanging, 3)}: add the pair that joins it to the rest" if hanging else ""


def _all_links(links: Sequence[str]) -> dict[str, list[str]]:
    """All links, for a program, where the sentence names the first of them."""
    return {"links": list(links)} if len(links) > MAX_NAMES_LISTED + 1 else {}


def always_free(setup: PreparedMechanism, links: Sequence[str], w: Array | None = None) -> NoAnswer:
    """Links that stay free while others hold each other more than once, at a closed position w if one is known."""
    jam = jammed_inputs(setup, w)
    if jam is not None:
        return jam
    return NoAnswer(
        Outcome.TOO_FEW_INPUTS,
        f"with {count_phrase(len(setup.mechanism.inputs), 'input')} {_links(links)} can still move, while some of the "
        f"links hold each other more than once; give an input at {_offered_pairs(setup, links, 6)}",
        **_all_links(links),
    )


def jammed_inputs(setup: PreparedMechanism, w: Array | None = None) -> NoAnswer | None:
    """Inputs at pairs that the others hold fast, while something else is free; w as for `always_free`."""
    jam = full_constraints.find_jammed_inputs(setup, w)
    if jam is None:
        return None
    names, links = jam
    held = list(dict.fromkeys(link for name in names for link in setup.relative_motions[name].links))
    return NoAnswer(
        Outcome.INPUT_JAMMED,
        f"{_inputs_at(names)} cannot move: the pairs hold {_links(held)} fast, while {_links(links)} "
        f"{'is' if len(links) == 1 else 'are'} free; drive {_offered_pairs(setup, links, 4)} instead"
        f"{'' if len(names) == 1 else ', with one input for each way'}",
    )


def structure(setup: PreparedMechanism, w: Array) -> NoAnswer:
    """Links that no input can move from a position w, since their pairs leave no freedom: a structure."""
    mechanism = setup.mechanism
    links = [link.name for link in mechanism.links if link.name != mechanism.frame]
    if not links:
        return NoAnswer(Outcome.STRUCTURE, f"nothing moves: the frame {mechanism.frame!r} is the only link; add links")
    return NoAnswer(
        Outcome.STRUCTURE,
        f"nothing moves: it is a structure of {_links(links)} with the frame {mechanism.frame!r} (mobility 0) "
        f"{setup.describe_position()}; {_structure_remedy(setup, w)}",
        **_all_links(links),
    )


def _structure_remedy(setup: PreparedMechanism, w: Array) -> str:
    """What to remove from a structure: its inputs, or what lets it move."""
    mechanism = setup.mechanism
    link, pairs = full_constraints.releasing_parts(setup, w)
    removal = f"pair{'s' * (len(pairs) != 1)} {quote_names(list(pairs))}" if pairs else "links or pairs"
    if link is not None:
        removal = f"link {link!r} with its {removal}"
    if not mechanism.inputs:
        return f"remove {removal} to let it move, and give an input"
    return f"remove {_inputs(setup)}, or remove {removal} to let it move"


def change_point(setup: PreparedMechanism, links: Sequence[str], freedoms: int, z: Array) -> NoAnswer:
    """A position from which the mechanism may go on by several branches, and how one is chosen."""
    return NoAnswer(
        Outcome.CHANGE_POINT,
        f"{setup.describe_position()} the mechanism has {count_phrase(freedoms, 'freedom')} for "
        f"{count_phrase(len(setup.mechanism.inputs), 'input')}: {_links(links)} may move in more than one way from "
        f"here; move the input, or give a further input{_branch_choices(setup, z)}",
        **_all_links(links),
    )


def _branch_choices(setup: PreparedMechanism, z: Array) -> str:
    """By which number a cycle goes on along which branch, described by the link that moves most differently on them."""
    if len(setup.mechanism.inputs) != 1 or not setup.has_extent:
        return ""
    from planar.solving.continuation.bifurcation import bifurcation_at_start
    from planar.solving.continuation.solution_curve import SolutionCurve

    curve = SolutionCurve(setup, setup.inputs.u, np.ones(1))
    bifurcation = bifurcation_at_start(curve, np.append(z, 0.0))
    if bifurcation is None or len(bifurcation.branches) < 2:
        return ""
    columns = list(setup.equations.unknowns)
    (slides,) = setup.structure.input_slides
    branch_rates = [branch.tangent[:-1] / branch.input_rate for branch in bifurcation.branches]
    rates = np.array(branch_rates) * setup.scale[columns] / setup.input_scale
    angles = ~setup.structure.is_length[columns]
    spread = np.ptp(rates, axis=0)
    index = int(np.argmax(np.where(angles, spread, 0.0) if np.any(spread[angles] > DISTINCT_RATE) else spread))
    owner = setup.equations.coordinates[columns[index]].owner
    moves = [
        f"{number} moves {owner!r} by {round(rate, 6) + 0.0:.4g}"
        for number, rate in enumerate(rates[:MAX_BRANCHES_LISTED, index], 1)
    ]
    unit = f"{'rad' if angles[index] else 'm'} for each {'m' if slides else 'rad'} of the input"
    return f"; a cycle goes on by the way whose number `branches` (--branch) has: {', '.join(moves)} {unit}"


def dead_point(setup: PreparedMechanism, links: Sequence[str]) -> NoAnswer:
    """A position in which the inputs cannot move some links."""
    return NoAnswer(
        Outcome.DEAD_POINT,
        f"{setup.describe_position()} {_inputs(setup)} cannot move {_links(links)}, whose velocity is not determined; "
        f"move the input away from here, or drive {_offered_pairs(setup, links, 4)}",
        **_all_links(links),
    )


def motion_ended(setup: PreparedMechanism, rates: Sequence[Array], where: str, ending: TrackingEnd) -> NoAnswer:
    """Where motions of the inputs end: a dead point, the infinite, or branches that cannot be told apart; each with the
    rates of its unknowns there (unknowns,)."""
    links = list(dict.fromkeys(link for of_motion in rates for link in full_constraints.moved_links(setup, of_motion)))
    drive, moved = _offered_pairs(setup, links, 4), _links(links)
    beyond = f"{_inputs(setup)} cannot go beyond {where}"
    only, until = f"this assembly can be followed only to {where}", f"this assembly was followed as far as {where}"
    motions = f"motions of {moved} meet" if links else "motions meet"
    sentences = {
        TrackingEnd.DEAD_POINT: f"{beyond}, a dead point: {moved} would lead back from there; stay short of it, "
        f"go through the whole circuit, or drive {drive}",
        TrackingEnd.ENDLESS: f"{beyond}: towards there {moved} slide out without an end, as where lines become "
        f"parallel; stop short of it, or drive {drive}",
        TrackingEnd.OUT_OF_RANGE: f"{only}: there {moved} are out by millions of times the mechanism's size; stop "
        "short of it, or write the place that is wanted as the input's `position` in the file",
        TrackingEnd.INTERRUPTED: f"{until}, when {time_is_over()}; go on from there, or give more time",
        TrackingEnd.WORK_LIMIT: f"{until}, which took all the work that one answer may; stop there and go on from "
        f"there, divide the range into more steps, or drive {drive}",
    }
    lost = f"{only}: there {motions} that cannot be told apart; stop short of it, or drive {drive}"
    outcomes = {TrackingEnd.DEAD_POINT: Outcome.DEAD_POINT, TrackingEnd.INTERRUPTED: Outcome.INTERRUPTED}
    return NoAnswer(outcomes.get(ending, Outcome.BRANCH_LOST), sentences.get(ending, lost))


def motion_stopped(setup: PreparedMechanism, met: str, where: str) -> NoAnswer:
    """Where a motion of the inputs ends since pairs meet their stops."""
    return NoAnswer(
        Outcome.STOP, f"{_inputs(setup)} cannot go beyond {where}: there {met}; stay short of it, or move the stop"
    )


def not_closed(setup: PreparedMechanism, pair: str, gap: float, at: str = "") -> NoAnswer:
    """A position that the residual check does not let pass; the file's own, or another in words."""
    return NoAnswer(
        Outcome.CANNOT_BE_ASSEMBLED,
        f"{at or setup.describe_position()} the nearest position leaves pair {pair!r} open by {gap:.2g} of the "
        f"mechanism's size where rounding explains {setup.tolerance:.2g}; change a length or the input a little",
    )


def open_contact(setup: PreparedMechanism, pair: str, gap: float) -> NoAnswer:
    """A contact that the pair does not keep closed by itself, and that nothing else does."""
    apart = amount(gap, "length", setup.mechanism.units)
    state = f"are {apart} from touching" if gap > CONTACT_TOLERANCE * setup.unit else "touch in passing only"
    hint = setup.pairs[pair].open_contact_hint
    return NoAnswer(
        Outcome.CANNOT_BE_ASSEMBLED,
        f"{setup.describe_position()} {_links(setup.pairs[pair].links)} of pair {pair!r} {state}; let pins or guides "
        f"keep them in contact{f' ({hint})' if hint else ''}",
    )


def not_assembled(setup: PreparedMechanism, failure: AssemblySearchFailure) -> NoAnswer:
    """A block that cannot be joined: by how much, at which pair, and what would mend it."""
    return NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, lambda: _open_block_sentence(setup, failure))


def _open_block_sentence(setup: PreparedMechanism, failure: AssemblySearchFailure) -> str:
    """What to say of a block that cannot be joined; what would mend it takes as long to find as an assembly."""
    stage = failure.stage
    gaps: dict[str, float] = {}
    residuals = setup.functions.block_call(stage)(failure.z, setup.inputs.u, setup.inputs.p)[0][0]
    for row, residual in zip(setup.equations.rows[stage.rows], residuals, strict=True):
        gaps[row.pair] = float(np.hypot(gaps.get(row.pair, 0.0), residual))
    pair = max(gaps, key=lambda name: gaps[name])
    kind = next(row.kind for row in setup.equations.rows[stage.rows] if row.pair == pair)
    unit, quantity = (setup.unit, "length") if kind is MeasureKind.LENGTH else (1.0, "angle")
    links = _links(stage.links or setup.pairs.get(pair, setup.relative_motions[pair]).links)
    cut_off = f" (the search stopped after {failure.effort:.0f} steps)" if failure.is_cut_off else ""
    return (
        f"{setup.describe_position()} {links} cannot be joined{cut_off}: at the nearest, pair {pair!r} stays open by "
        f"{amount(gaps[pair] * unit, quantity, setup.mechanism.units)}; {_remedy(setup, failure, links)}"
    )


def _remedy(setup: PreparedMechanism, failure: AssemblySearchFailure, links: str) -> str:
    """A clause on what would let the block close; general advice where the search for that fails."""
    otherwise = f"change the input or a dimension of {links}"
    try:
        return _search_remedy(setup, failure, otherwise)
    except Exception:  # the text of a refusal never raises, whatever numbers the search for a remedy meets
        return otherwise


def _search_remedy(setup: PreparedMechanism, failure: AssemblySearchFailure, otherwise: str) -> str:
    """A change of one number that lets the block close, or a misfit to accept; `otherwise` where there is neither."""
    from planar.solving.assembly.least_misfit import offer_least_misfit
    from planar.solving.diagnosis.remedy import describe_remedy

    remedy = describe_remedy(setup, failure, otherwise)
    is_redundant = slice_length(failure.stage.rows) > slice_length(failure.stage.unknowns)
    offer = offer_least_misfit(setup.mechanism) if is_redundant else ""
    return f"{remedy}{'; or, ' * bool(offer)}{offer}"


def too_many_inputs(setup: PreparedMechanism) -> NoAnswer:
    """Inputs that the pairs leave no freedom for, at positions that do not agree."""
    return NoAnswer(
        Outcome.TOO_MANY_INPUTS,
        f"{_inputs(setup)} ask for more than the mechanism's freedom and do not agree "
        f"{setup.describe_position()}{_inputs_to_leave_out(setup)}",
    )


def _surplus_inputs(setup: PreparedMechanism) -> str:
    """What to say of inputs that move one another while other links are free."""
    sets = full_constraints.find_conflicting_inputs(setup) if len(setup.mechanism.inputs) > 1 else ()
    return f", and leave one out of those at {quote_names(sets[0])}, which move one another" if sets else ""


def _inputs_to_leave_out(setup: PreparedMechanism) -> str:
    """Which inputs conflict, and what to do about it."""
    sets = full_constraints.find_conflicting_inputs(setup)
    if not sets:
        return "; leave one out"
    clauses = [
        f"the input at {pairs[0]!r} cannot move"
        if len(pairs) == 1
        else f"those at {quote_names(pairs)} move one another"
        for pairs in sets[:3]
    ]
    which = "one of each" if len(sets) > 1 else "it" if len(sets[0]) == 1 else "one of them"
    return f": {join_all_names(clauses)}; leave {which} out"


def disagreeing_inputs(setup: PreparedMechanism, freedoms: int, what: str) -> NoAnswer:
    """Inputs whose positions agree but whose rates do not."""
    return NoAnswer(
        Outcome.TOO_MANY_INPUTS,
        f"the mobility is {freedoms}, and the {what} of {_inputs(setup)} do not agree{_inputs_to_leave_out(setup)}",
    )


def broken_rates(setup: PreparedMechanism, what: str, pair: str, gap: float, at: str = "") -> NoAnswer:
    """Rates that the residual check does not let pass, at the file's own position or at another in words."""
    return NoAnswer(
        Outcome.DEAD_POINT,
        f"{at or setup.describe_position()} the {what} break pair {pair!r} by {gap:.2g} of the greatest; move "
        "the input",
    )


def _links(names: Sequence[str]) -> str:
    return f"link{'s' * (len(names) != 1)} {quote_names(names)}"


def _inputs(setup: PreparedMechanism) -> str:
    return _inputs_at([given.pair for given in setup.mechanism.inputs])


def _inputs_at(pairs: Sequence[str]) -> str:
    return f"the input{'s' * (len(pairs) != 1)} at {quote_names(pairs)}"


def _offered_pairs(setup: PreparedMechanism, links: Sequence[str], maximum: int) -> str:
    """Pairs of these links that have no input, to be offered."""
    taken = {given.pair for given in setup.mechanism.inputs}
    offered = [name for name, pair in setup.pairs.items() if set(pair.links) & set(links) and name not in taken]
    return " or ".join(map(repr, offered[:maximum])) or "another pair"
