"""All circuits of a mechanism while one input runs, with their branches, and whether these are all."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, overload

import numpy as np

from planar.assemblies.circuits.circuit_search import CircuitSearch, InputInterval, is_same_assembly
from planar.assemblies.circuits.traced_circuit import Branch, TracedCircuit
from planar.assemblies.modes import Mode
from planar.assemblies.polynomial.completeness import Completeness
from planar.document.first_argument import takes_mechanism
from planar.foundation.angles import TURN, interval_offset
from planar.foundation.arrays import Array
from planar.foundation.errors import Outcome
from planar.foundation.notebook_display import Displayable
from planar.foundation.time_limit import returns_part_in_time, time_is_over
from planar.model.mechanism import (
    Drive,
    Mechanism,
    links_counting_turns,
    relative_motions,
    replace_inputs,
    running_input_index,
)
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import PositionSolver, solved_mechanism
from planar.solving.prepared_mechanism import PreparedMechanism

END_MARGIN = 1e-6
"""Of a branch that does not close: its very ends may be dead points, from which two branches lead."""
TURN_TOLERANCE = 1e-12
"""rad: what rounding leaves of a turn."""


@takes_mechanism
@returns_part_in_time
def circuits(
    mechanism: Mechanism,
    pair: str | None = None,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Circuits:
    """All circuits of a mechanism while one input runs, the others standing still.

    A circuit is a connected curve of positions, a branch a part of it without a dead point (T. Chase, J. Mirth,
    J. Mech. Des. 115, 1993). `pair` names the input that runs, where there are several. After
    `timeout` s, or a Ctrl-C, those are returned that were found, and `remarks` say so.

    Raises BadInput where there is no such input, NoAnswer where the inputs leave links free whatever the dimensions, or
    nothing can move.

    >>> import planar
    >>> planar.circuits(planar.load("four-bar"))
    <1 circuits of 'Four-bar chain' over A, numerically complete>
    """
    PreparedMechanism(mechanism).refuse_misfit("the circuits are not listed")
    problem = solved_mechanism(mechanism).motion_refusal(pair)
    # another position of the input may be assembled, and within the stops
    if problem is not None and problem.outcome not in (Outcome.CANNOT_BE_ASSEMBLED, Outcome.STOP):
        raise problem
    return Circuits(mechanism, mechanism.inputs[running_input_index(mechanism, pair)].pair)


@dataclass(frozen=True, eq=False)
class Circuit:
    """A connected curve of positions, and its branches in the order in which it runs through them.

    `closed`: False where it runs out without end, or was lost; `mechanism`: the same mechanism, its sketch and input on
    this circuit.
    """

    number: int
    branches: tuple[Branch, ...]
    closed: bool
    mechanism: Mechanism = field(repr=False)
    pair: str
    curve: TracedCircuit = field(repr=False)

    def __reduce__(self) -> tuple[Any, ...]:
        # compiled equations stay in their process: another one follows the circuits again
        return _circuit_again, (self.mechanism, self.pair, self.number)

    @cached_property
    def motion(self) -> Motion:
        """The positions all round it, or over the branch from which it was followed where it does not close."""
        if self.closed:
            return cycle(self.mechanism, pair=self.pair, circuit=True)
        low, high = self.home_range
        margin = END_MARGIN * (high - low)
        return cycle(self.mechanism, start=low + margin, stop=high - margin, pair=self.pair)

    @cached_property
    def home_range(self) -> tuple[float, float]:
        """The input's range on the branch from which the circuit was followed, around the position of `mechanism`."""
        home = self.branches[self.curve.home_branch]
        position = next(given.position for given in self.mechanism.inputs if given.pair == self.pair)
        offset = interval_offset(home.low, home.high, position) if self.curve.is_turning else 0.0
        return home.low + offset, home.high + offset

    @cached_property
    def branch(self) -> Array:
        """The number of the branch on which each row of `motion` lies (rows,); of a dead point the one that it ends."""
        if not self.closed:
            return np.full(len(self.motion), self.curve.home_branch + 1)
        ways = np.sign(np.diff(self.motion.inputs[self.pair].position))
        passed = np.cumsum(ways[1:] != ways[:-1])
        return np.concatenate([[0, 0], passed])[: len(self.motion)] % len(self.branches) + 1


def _circuit_again(mechanism: Mechanism, pair: str, number: int) -> Circuit:
    """The circuit of this number of a mechanism."""
    return circuits(mechanism, pair)[number - 1]


class Circuits(Displayable, Sequence[Circuit]):
    """All circuits, in an order that does not depend on the sketch: by the lowest input, angles counted from 0 to 2 pi,
    then by the assemblies there.

    `critical`: positions of the input (rad or m) at which assemblies meet: dead points, and where branches cross;
    `intervals`: the input's range cut there; `complete`: whether the number of circuits is claimed; `remarks`: how they
    were found, and what is not claimed. An interval of an angle contains the file's position of the input if whole
    turns can bring it there, as the range of `cycle` does; otherwise it starts in (-pi, pi]. A critical angle is the
    start of an interval.
    """

    def __init__(self, mechanism: Mechanism, pair: str):
        found = CircuitSearch(mechanism, pair).find_circuits()
        self.mechanism, self.pair = mechanism, pair
        self.complete, self.remarks = found.complete, found.remarks
        self.reason = time_is_over() if found.complete is Completeness.NOT else ""
        self._is_sliding = solved_mechanism(mechanism).solver.is_sliding(pair)
        self._search_intervals = found.intervals
        placed = (
            each._replace(low=low, high=high)
            for each in found.intervals
            for low, high in [self._place(*each[:2], with_ends=each.assemblies != 0)]
        )
        self.intervals: tuple[InputInterval, ...] = tuple(sorted(placed, key=lambda interval: interval.low))
        self.critical = (
            found.critical
            if self._is_sliding or not found.critical
            else tuple(interval.low for interval in self.intervals)
        )
        self._found = tuple(self._circuit(number, *each) for number, each in enumerate(found.circuits, start=1))

    def _place(self, low: float, high: float, with_ends: bool = True) -> tuple[float, float]:
        """An interval of the input with the whole turns with which it is written."""
        if self._is_sliding:
            return low, high
        position = next(given.position for given in self.mechanism.inputs if given.pair == self.pair)
        offset = interval_offset(low, high, position, with_ends)
        return low + offset, high + offset

    def _circuit(self, number: int, curve: TracedCircuit, mode: Mode) -> Circuit:
        branches = tuple(
            branch._replace(low=low, high=high)
            for branch in curve.public_branches()
            for low, high in [self._place(branch.low, branch.high)]
        )
        position = next(given.position for given in mode.mechanism.inputs if given.pair == self.pair)
        counts_turns = not links_counting_turns(self.mechanism).isdisjoint(
            relative_motions(self.mechanism)[self.pair].links
        )
        if not (self._is_sliding or counts_turns):
            home = branches[curve.home_branch]
            position -= interval_offset(home.low, home.high, position)
        moved = replace_inputs(self.mechanism, (Drive(self.pair, position),))
        kept = replace(moved, sketch=mode.mechanism.sketch, published=())
        return Circuit(number, branches, curve.closed, kept, self.pair, curve)

    @overload
    def __getitem__(self, index: int) -> Circuit: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Circuit]: ...
    def __getitem__(self, index: int | slice) -> Circuit | Sequence[Circuit]:
        return self._found[index]

    def __len__(self) -> int:
        return len(self._found)

    @property
    def outcome(self) -> Outcome:
        """Whether the search came to its end: solved, else interrupted, for the `reason`."""
        return Outcome.INTERRUPTED if self.reason else Outcome.SOLVED

    def __reduce__(self) -> tuple[Any, ...]:
        return circuits, (self.mechanism, self.pair)

    def __repr__(self) -> str:
        return f"<{len(self)} circuits of {self.mechanism.name!r} over {self.pair}, {self.complete.value}>"

    @cached_property
    def assembles(self) -> tuple[tuple[float, float], ...]:
        """The intervals of the input within which the linkage can be assembled; a whole turn is (0, 2 pi)."""
        found: list[tuple[float, float]] = []
        for low, high, assemblies in self._search_intervals:
            if assemblies == 0:
                continue
            joined = bool(found) and found[-1][1] == low
            found.append((found.pop()[0] if joined else low, high))
        if not found or self._is_sliding:
            return tuple(found)
        if sum(high - low for low, high in found) >= TURN - TURN_TOLERANCE:
            return ((0.0, TURN),)
        if found[-1][1] >= found[0][0] + TURN - TURN_TOLERANCE:  # a turn ends where it starts
            found = [*found[1:-1], (found[-1][0], found[0][1] + TURN)]
        return tuple(sorted(self._place(low, high) for low, high in found))

    def of(self, mode: Mode) -> tuple[Circuit, Branch] | None:
        """The circuit and the branch on which an assembly lies, at any position of the input."""
        solver = PositionSolver(mode.mechanism)
        unknowns = mode.z * solver.scale[list(solver.equations.unknowns)]
        position = next(given.position for given in mode.mechanism.inputs if given.pair == self.pair)
        for each in self._found:
            for number, at in each.curve.assemblies_at(position):
                if is_same_assembly(solver, at, unknowns[None]).all():
                    return each, each.branches[number]
        return None
