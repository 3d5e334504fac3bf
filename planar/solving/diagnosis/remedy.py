"""Changes of one number, a dimension or an input, that let a mechanism go together that does not, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import islice
from math import ceil, floor, log10
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import change_dimension, link_lengths
from planar.equations.mechanism_numbers import pair_numbers, shapes_of_links
from planar.foundation.arrays import Array
from planar.foundation.errors import PlanarError
from planar.foundation.units import parse_unit
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.model.wording import amount
from planar.solving.assembly.block_assemblies import BlockAssemblies
from planar.solving.assembly.nearest_assembly import Assembly, AssemblySearchFailure, find_nearest_assembly
from planar.solving.newton import ResidualFunction, block_residual_function, correct_blocks, damped_newton
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


class _EffortSpent(Exception):
    """A search would take more effort than it may."""


class RemedyChange(NamedTuple):
    """A dimension, or the input at a pair, at another value (m or rad), with which the mechanism can be assembled."""

    name: str
    kind: str
    "length or angle"
    was: float
    value: float
    shown: str
    "the value with its unit; the mechanism can be assembled with it as it stands there"


@dataclass(frozen=True)
class _ChangeableNumber:
    """A number of a mechanism that may be changed."""

    name: str
    kind: str
    was: float
    size: float
    "what is large for it (m or rad)"
    minimum: float
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
    search = RemedySearch(setup, failure, max_effort=MAX_EFFORT)
    neighbours = (link for name in failure.stage.pairs for link in setup.pairs[name].bodies)
    clauses, is_cut_off = [], False
    try:
        for change in islice(search.positions(), 1):
            clauses.append(f"at {change.name} = {change.shown}")
        for change in islice(search.dimensions(frozenset((*failure.stage.links, *neighbours))), 1):
            was = amount(change.was, change.kind, setup.mechanism.units)
            clauses.insert(0, f"with {change.name} = {change.shown} instead of {was}")
    except _EffortSpent:
        is_cut_off = True
    if clauses:
        return f"it would go together {', or '.join(clauses)}"
    return f"{otherwise} (the search for a single change that helps was cut off)" if is_cut_off else otherwise


class RemedySearch:
    """The search for changes of one number each that let a mechanism be assembled, the least first.

    Each is the least with which the assembly closes that comes nearest without it; only a `thorough` search looks
    whether another does with less, and tries all changes on the whole mechanism. Where `max_effort` is spent (steps of
    Newton's method) its iterators raise _EffortSpent.
    """

    def __init__(
        self,
        setup: PreparedMechanism,
        failure: AssemblySearchFailure,
        thorough: bool = False,
        max_effort: float = np.inf,
    ):
        self.setup, self.failure, self.thorough = setup, failure, thorough
        self._effort_left = max_effort

    def dimensions(self, links: frozenset[str]) -> Iterator[RemedyChange]:
        """Changes of one dimension of these links each."""
        mechanism = self.setup.mechanism
        return self._smallest_first(
            _ChangeableNumber(
                length.name,
                "length",
                length.value,
                self.setup.unit,
                0.0 if length.name == f"{length.link}.length" else -np.inf,
                partial(change_dimension, mechanism, length),
            )
            for length in islice(link_lengths(mechanism, links), MAX_DIMENSIONS)
        )

    def positions(self, inputs: Collection[str] | None = None) -> Iterator[RemedyChange]:
        """Positions of one input each, of these or of all."""
        setup = self.setup
        return self._smallest_first(
            _ChangeableNumber(
                given.pair,
                "length" if setup.is_sliding(given.pair) else "angle",
                given.position,
                size,
                -np.inf,
                partial(_with_input_at, setup.mechanism, given.pair),
            )
            for given, size in zip(setup.mechanism.inputs, setup.input_scale.tolist(), strict=True)
            if inputs is None or given.pair in inputs
        )

    def _spend(self, steps: float) -> None:
        self._effort_left -= steps
        if self._effort_left < 0.0:
            raise _EffortSpent

    def _smallest_first(self, numbers: Iterable[_ChangeableNumber]) -> Iterator[RemedyChange]:
        changes = []
        for number in numbers:
            value = self._closing_value(number)
            if value is not None:
                if self.thorough:
                    value = self._first_closed(number, number.was, value, 1.0 - SMALLER_CHANGE_RATIO, self._can_close)
                changes.append((abs(value - number.was) / number.size, number, value))
        # of changes that are as small, that of a link's length
        changes.sort(key=lambda change: (round(change[0], 6), not change[1].name.endswith(".length")))
        units = self.setup.mechanism.units
        for _, number, value in changes if self.thorough else changes[:MAX_CHANGES_TRIED]:
            name = units.length if number.kind == "length" else units.angle
            unit = parse_unit(name)
            exact = 0.0 if abs(value) <= ROUNDING_TOLERANCE * number.size else unit.from_si(value)
            # first a little beyond, where it closes with ease; what is held twice needs the very value
            for shown in (
                f"{_rounded_beyond(exact, value > number.was):.6g}",
                f"{exact:.{PRINTED_DIGITS}g}",
                f"{exact:.{ALL_DIGITS}g}",
            ):
                rounded = unit.to_si(float(shown))
                if self._can_close(number, rounded):
                    yield RemedyChange(number.name, number.kind, number.was, rounded, f"{shown} {name}")
                    break

    def _can_close(self, number: _ChangeableNumber, value: float) -> bool:
        """Whether the mechanism can be assembled at its inputs with a number at a value."""
        mechanism = number.changed(value)
        if mechanism is None:
            return False
        try:
            assemblies = BlockAssemblies(PreparedMechanism(mechanism), spend=self._spend)
        except PointPlacementError:
            return False
        return isinstance(find_nearest_assembly(assemblies), Assembly)

    def _closing_value(self, number: _ChangeableNumber) -> float | None:
        """The value (m or rad) of a number at which what stays open just closes; None where there is none.

        What stays open at the nearest position falls as the number changes by its share in it: Newton's method for a
        zero of the distance, the position being solved again at each step.
        """
        value, z, nudge = number.was, self.failure.z, 1e-7 * number.size
        open_value, direction, tolerance, retreats = number.was, 0.0, CLOSED_TOLERANCE, 0
        closed_value: float | None = None
        for _ in range(MAX_NEWTON_STEPS):
            block = self._changed_block(number.changed(value), z)
            beside = block and self._changed_block(number.changed(value + nudge), z)
            if block is None or beside is None:
                if retreats == MAX_HALVINGS:
                    break
                value, retreats = 0.5 * (open_value + value), retreats + 1  # the blocks before it do not close there
                continue
            nearest, residuals = self._nearest(*block)
            gap = float(np.linalg.norm(residuals))
            if closed_value is not None and gap > tolerance:
                break
            change = beside[0](nearest[None, self.failure.stage.unknowns])[0][0] - residuals
            slope = float(residuals @ change) / (gap or 1.0) / nudge
            direction = direction or -np.sign(slope)
            if gap <= tolerance:
                closed_value, tolerance = value, MIN_DECREASE * gap
            elif direction * slope > 0.0:
                value = 0.5 * (open_value + value)  # it went over where it closes, and out on the other side
                continue
            else:
                open_value, z = value, nearest
            if abs(slope) * number.size < MIN_SENSITIVITY:
                if closed_value is not None or value != number.was:
                    break  # it hardly matters here, or nothing is left open
                # where it is farthest off it may yet matter
                value, direction = number.was + NEIGHBOUR_RATIO * number.size, 0.0
                continue
            step = float(np.clip(-gap / slope, -MAX_STEP * number.size, MAX_STEP * number.size))
            value = max(value + step, 0.5 * (value + number.minimum))
        if closed_value is None or closed_value == number.was:
            return None

        def is_closed(number: _ChangeableNumber, value: float) -> bool:
            block = self._changed_block(number.changed(value), z)
            return block is not None and float(np.linalg.norm(self._nearest(*block)[1])) <= CLOSED_TOLERANCE

        # the last step of Newton's method may have gone too far
        return self._first_closed(number, open_value, closed_value, OVERSHOOT_RATIO, is_closed)

    def _first_closed(
        self,
        number: _ChangeableNumber,
        open_value: float,
        closed_value: float,
        share: float,
        is_closed: Callable[[_ChangeableNumber, float], bool],
    ) -> float:
        """Of a value of a number that is open and one that is closed, the one between them where that changes; the
        closed one itself where a `share` of the way back is open already."""
        part = share
        while abs(closed_value - open_value) > ROUNDING_TOLERANCE * number.size:
            value = closed_value + part * (open_value - closed_value)
            if is_closed(number, value):
                closed_value = value
            elif part == share:
                break
            else:
                open_value = value
            part = 0.5
        return closed_value

    def _changed_block(self, mechanism: Mechanism | None, z: Array) -> tuple[ResidualFunction, Array] | None:
        """The constraints of the block that stays open in a mechanism with other numbers, and all unknowns
        (unknowns,), those before the block moved on from z; None where they cannot be."""
        setup, block = self.setup, self.failure.stage
        self._spend(CHANGE_EFFORT + MOVED_BLOCK_EFFORT * block.block_index)
        if mechanism is None:
            return None
        try:
            p = pair_numbers(mechanism, shapes_of_links(mechanism), setup.unit)
        except PointPlacementError:
            return None
        u = np.array([given.position for given in mechanism.inputs]) / setup.input_scale
        moved = correct_blocks(setup.functions, p, z, u, block.block_index - 1)
        return None if moved is None else (block_residual_function(setup.functions, block, moved, u, p), moved)

    def _nearest(self, residual_function: ResidualFunction, z: Array) -> tuple[Array, Array]:
        """All unknowns (unknowns,), those of the block where it is nearest to closing, and what it leaves open
        (rows,)."""
        unknowns = self.failure.stage.unknowns
        result = damped_newton(residual_function, z[None, unknowns])
        self._spend(result.steps)
        nearest = z.copy()
        nearest[unknowns] = result.unknowns[0]
        return nearest, residual_function(result.unknowns)[0][0]


def _with_input_at(mechanism: Mechanism, pair: str, position: float) -> Mechanism:
    return replace_inputs(mechanism, (Drive(pair, position),))


def _rounded_beyond(value: float, up: bool) -> float:
    """A number of DIGITS digits beyond the value, seen from where it comes."""
    size = 10.0 ** (floor(log10(abs(value))) + 1 - PRINTED_DIGITS) if value else 1.0
    return (ceil if up else floor)(value / size) * size
