"""What a mechanism is, in the words of textbooks: its links, pairs, chain, mobility, motions and names."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass

import numpy as np

from planar.analysis.identity.load_descriptions import ActionDescription, describe_actions
from planar.analysis.identity.mechanism_names import mechanism_names
from planar.analysis.identity.mobility import Mobility, gruebler, mobility
from planar.document.dimensions import Dimension, file_dimensions
from planar.document.first_argument import takes_mechanism
from planar.dynamics.load_attachment import attachment_remarks
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, PlanarError
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import stop_if_over, stops_in_time
from planar.foundation.units import SI_UNITS
from planar.model.file_units import RESULT_SI_UNITS, display_unit, is_customary
from planar.model.link_graph import link_numbers, pair_labels_by_type, unconnected_links
from planar.model.mechanism import Input, Mechanism, pair_entries
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase, join_all_names
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import solve, solved_mechanism
from planar.structures.recognition import MechanismStructure, chain_of

LINK_ORDERS = ("single", "unary", "binary", "ternary", "quaternary", "quinary")
RUN_STEPS = 120
"""Positions of a run that tells how links move."""
STANDSTILL_TOLERANCE = 1e-9
"""rad, or part of the size: what moves less stands still."""


@dataclass(frozen=True)
class LinkDescription:
    """A link: its number, how many pairs it has in a word, and how it moves over the range of the inputs."""

    number: str
    order: str
    motion: str


@dataclass(frozen=True)
class NumberDescription:
    """A number of the file: its value (SI) with the SI unit, empty of a plain number, and how it is printed."""

    value: float
    unit: str
    shown: str


@dataclass(frozen=True)
class Inspection:
    """See `inspect`. `mobility` is None where the mechanism cannot be assembled; `open_reason` then says why.

    `pairs`: of every type the pairs by the numbers of their links, as ("turning", ("O-1", "1-2")); `lower` and `higher`
    how many; `is_mechanism` and `is_linkage` with the reasons. `actions` are its loads, springs and masses; `remarks`
    say of which of them another link might have been meant. `structure` is the kinematic chain, None where it is none
    of lower pairs alone; `structure_reason` then says why. `dimensions` are all numbers of its file, by name, `units`
    the unit in which each kind of quantity is shown, where the file asks for other than metres, newtons and the like.
    """

    name: str
    names: tuple[str, ...]
    links: dict[str, LinkDescription]
    pairs: tuple[tuple[str, tuple[str, ...]], ...]
    lower: int
    higher: int
    closed: bool
    gruebler: int
    mobility: Mobility | None
    open_reason: str
    is_mechanism: bool
    mechanism_reason: str
    is_linkage: bool
    linkage_reason: str
    actions: tuple[ActionDescription, ...]
    remarks: tuple[str, ...]
    structure: MechanismStructure | None
    structure_reason: str
    dimensions: dict[str, NumberDescription]
    units: dict[str, str]

    __repr__ = short_repr


@takes_mechanism
@stops_in_time
def inspect(mechanism: Mechanism, *, timeout: float | None = None) -> Inspection:  # noqa: ARG001 - of the decorator
    """Everything that can be said of a mechanism before its motion is asked for.

    Raises NoAnswer after `timeout` s or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> planar.inspect(planar.load("four-bar")).names
    ('four-bar chain', 'triple-rocker')
    """
    try:
        found, trouble = mobility(mechanism), ""
    except NoAnswer as problem:
        found, trouble = None, str(problem)
    orders = Counter(
        link for group in pair_entries(mechanism) for link in {link for pair in group for link in pair.links}
    )
    number = link_numbers(mechanism)
    moving = _describe_motions(mechanism)
    links = {
        link: LinkDescription(number[link], _order_word(orders[link]), moving[link])
        for link in sorted(number, key=lambda link: int(number[link]))
    }
    lower = sum(pair.is_lower_pair for pair in mechanism.pairs)
    higher = len(mechanism.pairs) - lower
    closed = all(orders[link.name] > 1 for link in mechanism.links)
    is_mechanism, why = _judge_mechanism(mechanism, found, trouble)
    words = pair_labels_by_type(mechanism)
    structure, no_structure = _find_structure(mechanism)
    return Inspection(
        name=mechanism.name,
        names=mechanism_names(mechanism),
        links=links,
        pairs=words,
        lower=lower,
        higher=higher,
        closed=closed,
        gruebler=gruebler(mechanism),
        mobility=found,
        open_reason=trouble,
        is_mechanism=is_mechanism,
        mechanism_reason=why,
        is_linkage=is_mechanism and not higher,
        linkage_reason=_linkage_reason(is_mechanism, higher),
        actions=describe_actions(mechanism),
        remarks=(*mechanism.remarks, *attachment_remarks(mechanism)),
        structure=structure,
        structure_reason=no_structure,
        dimensions={name: _describe_number(mechanism, each) for name, each in file_dimensions(mechanism).items()},
        units=_shown_units(mechanism),
    )


def _find_structure(mechanism: Mechanism) -> tuple[MechanismStructure | None, str]:
    try:
        return chain_of(mechanism), ""
    except BadInput as problem:
        return None, problem.sentence


def _shown_units(mechanism: Mechanism) -> dict[str, str]:
    """The unit of every kind of quantity, where the file asks for others than metric files have."""
    units = mechanism.units
    if not units.declares_more and not is_customary(units.length):
        return {}
    return {kind: display_unit(kind, units)[0] for kind in RESULT_SI_UNITS if kind not in ("time", "number")}


def _describe_number(mechanism: Mechanism, number: Dimension) -> NumberDescription:
    if number.kind not in SI_UNITS:
        return NumberDescription(number.value, "", f"{number.value:.6g}")
    name, unit = display_unit(number.kind, mechanism.units)
    return NumberDescription(number.value, SI_UNITS[number.kind], f"{unit.from_si(number.value):.6g} {name}")


def _order_word(pairs: int) -> str:
    return LINK_ORDERS[pairs] if pairs < len(LINK_ORDERS) else f"of {pairs} pairs"


def _linkage_reason(is_mechanism: bool, higher: int) -> str:
    if not is_mechanism:
        return "it is no mechanism"
    return f"it has {count_phrase(higher, 'higher pair')}" if higher else "all its pairs are lower"


def _judge_mechanism(mechanism: Mechanism, count: Mobility | None, trouble: str) -> tuple[bool, str]:
    """One link fixed, as many driving links as freedoms, and the rest moving in a definite way."""
    if count is None:
        return False, trouble
    if unconnected_links(mechanism):
        return (
            False,
            f"nothing joins {join_all_names([repr(link) for link in unconnected_links(mechanism)])} to the frame",
        )
    given = count_phrase(len(mechanism.inputs), "driving link")
    refusal = solved_mechanism(mechanism).motion_refusal()
    if refusal is not None and refusal.outcome is Outcome.STRUCTURE:
        return False, f"it has {given}; {refusal.reason}"
    if len(mechanism.inputs) != count.finite:
        return False, f"it has {given}, and it moves in {count_phrase(count.finite, 'way')}"
    reason = f"one link is fixed, {count_phrase(len(mechanism.inputs), 'link')} driven, and the rest follows definitely"
    try:
        solve(mechanism)
    except NoAnswer as problem:
        passing = problem.outcome in (Outcome.DEAD_POINT, Outcome.CHANGE_POINT, Outcome.CANNOT_BE_ASSEMBLED)
        return passing, f"{reason}; but here: {problem.reason}" if passing else str(problem)
    return True, reason


def _describe_motions(mechanism: Mechanism) -> dict[str, str]:
    """How each link moves while the inputs run through their ranges, one after the other."""
    problem = solved_mechanism(mechanism).motion_refusal() if mechanism.inputs else None
    if problem is not None and problem.outcome is Outcome.STRUCTURE:
        return {link.name: "fixed" if link.name == mechanism.frame else "stands still" for link in mechanism.links}
    runs: list[Motion] = []
    for given in mechanism.inputs:
        stop_if_over(f"before the motion of the input at {given.pair!r} was followed")
        try:
            runs.append(_run_input(mechanism, given))
        except PlanarError:
            return {link.name: "fixed" if link.name == mechanism.frame else "unknown" for link in mechanism.links}
    pinned = _pinned_links(mechanism)
    return {link.name: _describe_motion(mechanism, link.name, runs, link.name in pinned) for link in mechanism.links}


def _is_back_at_start(run: Motion) -> bool:
    """Whether everything that slides is at the end where it was at the start."""
    return all(abs(float(np.ptp(jet.parts[0][[0, -1]]))) < 1e-6 for own in run.own.values() for jet in own)


def _run_input(mechanism: Mechanism, given: Input) -> Motion:
    """One input through its range; a slide without limits a few sizes to either side."""
    try:
        return cycle(mechanism, RUN_STEPS, pair=given.pair)
    except BadInput:
        far = 2.0 * mechanism_size(mechanism, shapes_of_links(mechanism))
        return cycle(mechanism, RUN_STEPS, given.position - far, given.position + far, given.pair)


def _describe_motion(mechanism: Mechanism, link: str, runs: list[Motion], is_pinned: bool) -> str:
    if link == mechanism.frame:
        return "fixed"
    if not runs:
        return "unknown"
    swing = max(float(np.ptp(run.link(link).angle)) for run in runs)
    places = [np.stack([_origin_coordinate(run, link, axis) for axis in "xy"]) for run in runs]
    size = max(float(np.abs(place).max()) for place in places) or 1.0
    strays = max(float(np.ptp(place, axis=1).max()) for place in places) > STANDSTILL_TOLERANCE * size
    if swing <= STANDSTILL_TOLERANCE:
        return "translates" if strays else "stands still"
    if not is_pinned:
        return "general plane motion"
    if any(_is_turning_fully(run, link) for run in runs):
        return "turns fully"
    return "rocks" if all(run.outcome is Outcome.SOLVED for run in runs) else "turns or rocks"


def _origin_coordinate(run: Motion, link: str, axis: str) -> Array:
    jet = getattr(run.frames[link], axis)
    return np.broadcast_to(jet.parts[0], (len(run),))


def _pinned_links(mechanism: Mechanism) -> set[str]:
    """The links that a pin holds to the frame."""
    pinned: set[str] = set()
    for group in pair_entries(mechanism):
        links = {link for pair in group for link in pair.links}
        if group[0].is_lower_pair and group[0].input_kind is MeasureKind.ANGLE and mechanism.frame in links:
            pinned |= links
    return pinned


def _is_turning_fully(run: Motion, link: str) -> bool:
    """Whether a link goes right round: over a whole cycle of the input it comes out turned, or it turns far enough."""
    angle = run.link(link).angle
    if float(np.ptp(angle)) >= 2.0 * np.pi - STANDSTILL_TOLERANCE:
        return True
    cyclic = any(
        not run.has_length_motion(name) and abs(float(np.ptp(given.position)) - 2.0 * np.pi) < STANDSTILL_TOLERANCE
        for name, given in run.inputs.items()
    )
    return (
        cyclic and _is_back_at_start(run) and run.outcome is Outcome.SOLVED and abs(float(angle[-1] - angle[0])) > 1e-6
    )
