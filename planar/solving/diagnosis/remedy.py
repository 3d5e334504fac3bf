"""Changes of one number, a dimension or an input, that let a mechanism go together that does not, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from math import ceil, floor, log10
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import change_dimension, link_lengths
from planar.equations.mechanism_numbers import pair_numbers, shapes_of_links
from planar.equations.symbolic_equations import Block
from planar.foundation.arrays import Array
from planar.foundation.errors import PlanarError
from planar.foundation.units import parse_unit
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.model.wording import amount
from planar.solving.assembly.block_assemblies import BlockAssemblies, block_residual_function
from planar.solving.assembly.nearest_assembly import Assembly, AssemblySearchFailure, find_nearest_assembly
from planar.solving.newton import ResidualFunction, correct_blocks, damped_newton
from planar.solving.prepared_mechanism import PreparedMechanism

MAX_DIMENSIONS = 40
"""Dimensions that are looked at."""
MAX_NEWTON_STEPS = 30
"""Newton's steps of a number; what stays open falls about linearly with it, so a few do."""
MAX_HALVINGS = 4
"""Times that a step is halved since the blocks before do not go together where it leads."""
MAX_STEP = 1.0
"""The farthest that a step goes (sizes, rad)."""
CLOSED_TOLERANCE = 1e-9
MIN_DECREASE = 0.1
"""Below CLOSED steps go on as long as each leaves only so much of what the one before left open."""
OVERSHOOT_RATIO = 1e-4
"""Where so much of the last step less leaves a block open, the step did not go too far."""
ROUNDING_TOLERANCE = 1e-6
SMALLER_CHANGE_RATIO = 0.99
"""Part of a change that is tried for whether it will do."""
NEIGHBOUR_RATIO = 0.01
"""Of what is large for a number: where it is looked at once more."""
MIN_SENSITIVITY = 1e-3
"""A number by whose change (sizes, rad) less than this part of it closes hardly matters."""
MAX_CHANGES_TRIED = 4
"""Changes, the least first, that are tried by assembling the whole."""
PRINTED_DIGITS, ALL_DIGITS = 5, 15
MAX_EFFORT = 4500.0
"""The effort (steps of Newton's method) in search of a remedy, about a second."""
CHANGE_EFFORT, MOVED_BLOCK_EFFORT = 3.0, 0.5
"""What it takes to change a number, and to move each earlier block on from where it was, in steps."""


class EffortSpent(Exception):
    """A search would take more effort than it may."""


class EffortBudget:
    """How many steps of Newton's method may still be taken."""

    def __init__(self, steps: float):
        self.steps_left = steps

    def spend(self, steps: float) -> None:
        """Count steps. Raises EffortSpent where none are left."""
        self.steps_left -= steps
        if self.steps_left < 0.0:
            raise EffortSpent


class _BudgetedAssemblies(BlockAssemblies):
    """Candidates for which effort is spent."""

    def __init__(self, setup: PreparedMechanism, budget: EffortBudget):
        super().__init__(setup)
        self._budget = budget

    def _count_effort(self, steps: float) -> None:
        super()._count_effort(steps)
        self._budget.spend(steps)


class RemedyChange(NamedTuple):
    """A dimension, or the input at a pair, at another value (m or rad), with which the whole goes together."""

    name: str
    kind: str
    "length or angle"
    was: float
    value: float
    shown: str
    "the value with its unit; the whole goes together with it as it stands there"


@dataclass(frozen=True)
class _ChangeableNumber:
    """A number of a mechanism that may be changed."""

    name: str
    kind: str
    was: float
    size: float
    "what is large for it (m or rad)"
    least: float
    change: Callable[[float], Mechanism]

    def changed(self, value: float) -> Mechanism | None:
        """The mechanism with this number at a value (m or rad); None where no mechanism may have it."""
        try:
            return self.change(value)
        except PlanarError:
            return None


@np.errstate(over="ignore", invalid="ignore", divide="ignore")  # a change that overflows is not offered
def describe_remedy(setup: PreparedMechanism, failure: AssemblySearchFailure, otherwise: str) -> str:
    """A clause that says which dimension to make how long, or where to move an input; `otherwise` where there is none.

    A change is offered only after the mechanism with it, rounded as it is printed, has been assembled. The clause says
    where the search was cut off.
    """
    budget = EffortBudget(MAX_EFFORT)
    beside = (link for name in failure.stage.pairs for link in setup.pairs[name].bodies)
    links = frozenset((*failure.stage.links, *beside))
    told, cut = [], False
    try:
        for change in islice(mending_inputs(setup, failure, budget=budget), 1):
            told.append(f"at {change.name} = {change.shown}")
        for change in islice(mending_dimensions(setup, failure, links, budget=budget), 1):
            was = amount(change.was, change.kind, setup.mechanism.units)
            told.insert(0, f"with {change.name} = {change.shown} instead of {was}")
    except EffortSpent:
        cut = True
    if told:
        return f"it would go together {', or '.join(told)}"
    return f"{otherwise} (the search for a single change that helps was cut off)" if cut else otherwise


def mending_dimensions(
    setup: PreparedMechanism,
    failure: AssemblySearchFailure,
    links: frozenset[str],
    thorough: bool = False,
    budget: EffortBudget | None = None,
) -> Iterator[RemedyChange]:
    """Changes of one dimension of these links each that let the whole go together, the least first.

    Each is the least with which the assembly goes together that comes nearest without it; only a `thorough` search
    looks whether another does with less, and tries all changes on the whole. Raises EffortSpent where there is an
    end to the `budget`.
    """
    mechanism = setup.mechanism
    return _smallest_changes_first(
        setup,
        failure,
        [
            _ChangeableNumber(
                each.name,
                "length",
                each.value,
                setup.unit,
                0.0 if each.name == f"{each.link}.length" else -np.inf,
                partial(change_dimension, mechanism, each),
            )
            for each in islice(link_lengths(mechanism, links), MAX_DIMENSIONS)
        ],
        thorough,
        budget or EffortBudget(np.inf),
    )


def mending_inputs(
    setup: PreparedMechanism,
    failure: AssemblySearchFailure,
    inputs: Collection[str] | None = None,
    thorough: bool = False,
    budget: EffortBudget | None = None,
) -> Iterator[RemedyChange]:
    """Positions of one input each, of these or of all, at which the whole goes together: as `mending_dimensions`."""
    mechanism = setup.mechanism
    return _smallest_changes_first(
        setup,
        failure,
        [
            _ChangeableNumber(
                given.pair,
                "length" if setup.is_sliding(given.pair) else "angle",
                given.position,
                setup.unit if setup.is_sliding(given.pair) else 1.0,
                -np.inf,
                partial(_with_input_at, mechanism, given.pair),
            )
            for given in mechanism.inputs
            if inputs is None or given.pair in inputs
        ],
        thorough,
        budget or EffortBudget(np.inf),
    )


def _with_input_at(mechanism: Mechanism, pair: str, position: float) -> Mechanism:
    return replace_inputs(mechanism, (Drive(pair, position),))


def _smallest_changes_first(
    setup: PreparedMechanism,
    failure: AssemblySearchFailure,
    numbers: list[_ChangeableNumber],
    thorough: bool,
    budget: EffortBudget,
) -> Iterator[RemedyChange]:
    found = []
    for number in numbers:
        value = _closing_value(setup, failure, number, budget)
        if value is not None:
            value = _smaller_value(number, value, budget) if thorough else value
            found.append((abs(value - number.was) / number.size, number, value))
    # of changes that are as small, that of a link's length
    found.sort(key=lambda each: (round(each[0], 6), not each[1].name.endswith(".length")))
    units = setup.mechanism.units
    for _, number, value in found if thorough else found[:MAX_CHANGES_TRIED]:
        name = units.length if number.kind == "length" else units.angle
        by = parse_unit(name)
        near = 0.0 if abs(value) <= ROUNDING_TOLERANCE * number.size else by.from_si(value)
        # first a little beyond, where it goes together with ease; what is held twice needs the very value
        for shown in (
            f"{_rounded_beyond(near, value > number.was):.6g}",
            f"{near:.{PRINTED_DIGITS}g}",
            f"{near:.{ALL_DIGITS}g}",
        ):
            there = by.to_si(float(shown))
            if can_be_assembled(number.changed(there), budget):
                yield RemedyChange(number.name, number.kind, number.was, there, f"{shown} {name}")
                break


def _smaller_value(number: _ChangeableNumber, value: float, budget: EffortBudget) -> float:
    """A value at which another assembly just goes together, if less of the change will do for that."""
    open_, closed = number.was, number.was + SMALLER_CHANGE_RATIO * (value - number.was)
    if not can_be_assembled(number.changed(closed), budget):
        return value
    while abs(closed - open_) > ROUNDING_TOLERANCE * number.size:
        tried = 0.5 * (open_ + closed)
        open_, closed = (open_, tried) if can_be_assembled(number.changed(tried), budget) else (tried, closed)
    return closed


def _closing_value(
    setup: PreparedMechanism, failure: AssemblySearchFailure, number: _ChangeableNumber, budget: EffortBudget
) -> float | None:
    """The value (m or rad) of a number at which what stays open just closes; None where there is none.

    What stays open at the nearest position falls as the number changes by its share in it: Newton's method for a zero
    of the distance, the position being found anew at each step.
    """
    value, z, nudge = number.was, failure.z, 1e-7 * number.size
    open_at, way, least, found, retreats = number.was, 0.0, CLOSED_TOLERANCE, None, 0
    for _ in range(MAX_NEWTON_STEPS):
        here = _changed_block(setup, failure.stage, number.changed(value), z, budget)
        beside = here and _changed_block(setup, failure.stage, number.changed(value + nudge), z, budget)
        if here is None or beside is None:
            if retreats == MAX_HALVINGS:
                break
            value, retreats = 0.5 * (open_at + value), retreats + 1  # there the blocks before it do not close
            continue
        nearest = here.nearest_unknowns()
        gap = float(np.linalg.norm(here.residuals(nearest)))
        if found is not None and gap > least:
            break
        slope = (
            float(here.residuals(nearest) @ (beside.residuals(nearest) - here.residuals(nearest)))
            / (gap or 1.0)
            / nudge
        )
        way = way or -np.sign(slope)
        if gap <= least:
            found, least = value, MIN_DECREASE * gap
        elif way * slope > 0.0:
            value = 0.5 * (open_at + value)  # it went over where it closes, and out on the other side
            continue
        else:
            open_at, z = value, nearest
        if abs(slope) * number.size < MIN_SENSITIVITY:
            if found is not None or value != number.was:
                break  # it hardly matters here, or nothing is left open
            value, way = number.was + NEIGHBOUR_RATIO * number.size, 0.0  # where it is farthest off it may yet matter
            continue
        step = float(np.clip(-gap / slope, -MAX_STEP * number.size, MAX_STEP * number.size))
        value = max(value + step, 0.5 * (value + number.least))
    if found is None or found == number.was:
        return None
    return _closing_boundary(setup, failure.stage, number, (open_at, found), z, budget)


def _closing_boundary(
    setup: PreparedMechanism,
    stage: Block,
    number: _ChangeableNumber,
    between: tuple[float, float],
    z: Array,
    budget: EffortBudget,
) -> float:
    """Of a value at which a block is open and one at which it is closed, the one between them where that changes.

    The last step of Newton's method may have gone too far.
    """
    open_, closed = between
    part = OVERSHOOT_RATIO
    while abs(closed - open_) > ROUNDING_TOLERANCE * number.size:
        tried = closed + part * (open_ - closed)
        there = _changed_block(setup, stage, number.changed(tried), z, budget)
        gap = np.inf if there is None else float(np.linalg.norm(there.residuals(there.nearest_unknowns())))
        if gap > CLOSED_TOLERANCE and part == OVERSHOOT_RATIO:
            break
        open_, closed = (tried, closed) if gap > CLOSED_TOLERANCE else (open_, tried)
        part = 0.5
    return closed


class _ChangedBlock:
    """What a block leaves open when numbers have been changed, the blocks before it standing where they then do."""

    def __init__(self, residual_function: ResidualFunction, stage: Block, z: Array, budget: EffortBudget):
        self._residual_function, self._stage, self._z, self._budget = residual_function, stage, z, budget

    def nearest_unknowns(self) -> Array:
        """All unknowns (unknowns,), those of the block where it is nearest to closing. Raises EffortSpent."""
        result = damped_newton(self._residual_function, self._z[None, self._stage.unknowns])
        self._budget.spend(result.steps)
        z = self._z.copy()
        z[self._stage.unknowns] = result.unknowns[0]
        return z

    def residuals(self, z: Array) -> Array:
        """What is left open (rows,) with the block's unknowns as in z (unknowns,)."""
        return self._residual_function(z[None, self._stage.unknowns])[0][0]


def _changed_block(
    setup: PreparedMechanism, stage: Block, mechanism: Mechanism | None, z: Array, budget: EffortBudget
) -> _ChangedBlock | None:
    """A block of a mechanism with other numbers, those before it moved on from z; None where they cannot be."""
    budget.spend(CHANGE_EFFORT + MOVED_BLOCK_EFFORT * stage.block_index)
    if mechanism is None:
        return None
    try:
        p = pair_numbers(mechanism, shapes_of_links(mechanism), setup.unit)
    except PointPlacementError:
        return None
    by = [setup.unit if slides else 1.0 for slides in setup.structure.input_slides]
    u = np.array([given.position / size for given, size in zip(mechanism.inputs, by, strict=True)])
    moved = correct_blocks(setup.functions, p, z, u, stage.block_index - 1)
    if moved is None:
        return None
    return _ChangedBlock(block_residual_function(setup.functions, stage, moved, u, p), stage, moved, budget)


def _rounded_beyond(value: float, up: bool) -> float:
    """A number of DIGITS digits beyond the value, seen from where it comes."""
    size = 10.0 ** (floor(log10(abs(value))) + 1 - PRINTED_DIGITS) if value else 1.0
    return (ceil if up else floor)(value / size) * size


def can_be_assembled(mechanism: Mechanism | None, budget: EffortBudget) -> bool:
    """Whether there is a mechanism and it can be assembled at its inputs. Raises EffortSpent."""
    if mechanism is None:
        return False
    try:
        return isinstance(find_nearest_assembly(_BudgetedAssemblies(PreparedMechanism(mechanism), budget)), Assembly)
    except PointPlacementError:
        return False
