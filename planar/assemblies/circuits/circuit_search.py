"""The search for all circuits: assemblies between dead points listed, each followed, and both compared."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import islice, pairwise
from math import pi, remainder
from typing import NamedTuple

import numpy as np

from planar.assemblies.circuits.dead_points import (
    BRANCHES_CROSS,
    SAME_POSITION_DISTANCE,
    CriticalPositions,
    critical_positions,
    longest_choice,
)
from planar.assemblies.circuits.stop_positions import stop_positions
from planar.assemblies.circuits.traced_circuit import TracedCircuit, trace_circuit
from planar.assemblies.modes import Mode, Modes
from planar.assemblies.polynomial.completeness import Completeness
from planar.foundation.angles import distances
from planar.foundation.arrays import Array
from planar.foundation.time_limit import time_is_over
from planar.model.mechanism import Drive, Mechanism, replace_inputs
from planar.model.wording import count_phrase
from planar.solving.diagnosis import refusals
from planar.solving.position import PositionSolver, solved_mechanism

TURN = 2.0 * pi
MAX_ASSEMBLIES = 256
"""Assemblies at one position of the input up to which circuits are looked for."""
MAX_LONGEST_CHOICE = 12
"""Blocks that hang on one another and may be assembled in two ways: of more not all circuits are looked for."""
MAX_ROUNDS = 4
"""How often dead points that only circuits showed part the input's range anew."""
TRIAL_POSITIONS = 12
"""Positions of the input at which assemblies are listed where dead points may be missing."""
SAME_DEAD_POINT_DISTANCE = 1e-6
"""rad or sizes: a dead point that a circuit comes to is one that was found before if it is as near to it as this."""
SAME_ASSEMBLY_DISTANCE = 1e-5
"""rad or sizes: unknowns of one assembly, reached along a curve or listed, differ by less."""
LISTING_POSITION_RATIO = 0.4631
"""Where in an interval assemblies are listed: not in the middle, where symmetric linkages have special positions."""


class ListedInterval(NamedTuple):
    """A part of the input's range between two dead points (rad, m), and the assemblies somewhere in it."""

    low: float
    high: float
    solver: PositionSolver
    modes: tuple[Mode, ...]
    is_whole: bool
    is_complete: bool

    @property
    def position(self) -> float:
        """Where the assemblies are listed."""
        return self.low + LISTING_POSITION_RATIO * (self.high - self.low)

    @property
    def unknowns(self) -> Array:
        """Of every assembly (assemblies, unknowns), rad and m."""
        by = self.solver.scale[list(self.solver.equations.unknowns)]
        return np.array([mode.z * by for mode in self.modes]).reshape(len(self.modes), len(by))


class InputInterval(NamedTuple):
    """A part of the input's range (rad or m) without a dead point inside, and how many assemblies there are in it;
    None where they are too many to be counted, or not known to be as many all over it."""

    low: float
    high: float
    assemblies: int | None


class CircuitSearchResult(NamedTuple):
    """Circuits, each with the assembly from which it was followed; see `circuits.Circuits`."""

    circuits: tuple[tuple[TracedCircuit, Mode], ...]
    critical: tuple[float, ...]
    intervals: tuple[InputInterval, ...]
    complete: Completeness
    remarks: tuple[str, ...]


def is_same_assembly(solver: PositionSolver, one: Array, others: Array) -> Array:
    """Which of others (others, unknowns) are the same assembly as one, rad and m, whole turns aside."""
    e = solver.equations
    scale = solver.scale[list(e.unknowns)]
    return np.all(distances(e.unknown_is_angle, others / scale, one / scale) < SAME_ASSEMBLY_DISTANCE, axis=1)


class CircuitSearch:
    """The circuits of one mechanism, looked for. Raises NoAnswer where inputs leave links free whatever their sizes."""

    def __init__(self, mechanism: Mechanism, pair: str):
        self.mechanism, self.pair = mechanism, pair
        names = [given.pair for given in mechanism.inputs]
        self.index = names.index(pair)
        self.standing_drives = tuple(Drive(name, None, 0.0, 0.0) for name in names if name != pair)
        self.solver = solved_mechanism(replace_inputs(mechanism, self.standing_drives)).solver
        if any(stage.is_free for stage in self.solver.equations.blocks):
            raise refusals.free_links(self.solver)
        self.is_sliding = self.solver.is_sliding(pair)

    def find_circuits(self) -> CircuitSearchResult:
        """All that are found, once circuits show no dead point that was not known."""
        many = longest_choice(self.solver)
        if many > MAX_LONGEST_CHOICE:
            return self._own_circuit(
                f"up to 2^{many} assemblies hang on one another, too many to be followed; only the circuit of the "
                "file's own assembly is listed"
            )
        known = critical_positions(self.solver, self.index)
        doubts = list(known.doubts)
        cuts = self._distinct((*known.positions, *known.crossings, *self._stop_positions()))
        file = self.solver.mechanism.inputs[self.index].position
        low, high = known.span
        tried = (
            [file, *(low + (high - low) / TRIAL_POSITIONS * (np.arange(TRIAL_POSITIONS) + LISTING_POSITION_RATIO))]
            if known.doubts
            else []
        )
        for _ in range(MAX_ROUNDS):
            places = [self._list_assemblies(low, high) for low, high in self._cut_range(known, cuts)]
            more = [self._list_assemblies(at, at) for at in tried]
            circuits, differing = self._follow_circuits([*places, *more])
            fresh = self._new_dead_points(cuts, circuits)
            if not fresh or time_is_over():
                break
            cuts = self._distinct((*cuts, *fresh))
            if not known.doubts:
                doubts.append("circuits have dead points that were not found before")
        met = [*known.crossings, *(at for each, _ in circuits for at in (*each.dead_points, *each.stops))]
        # where links that come first have a dead point, none of the whole linkage need be
        kept = [at for at in cuts if any(self._is_near(at, other) for other in met)]
        intervals = tuple(self._input_interval(low, high, places) for low, high in self._cut_range(known, kept))
        if any(place.is_whole for place in places) and any(each.assemblies is None for each in intervals):
            doubts.append("the number of assemblies changes where no dead point was found")
        doubts += differing + self._completeness_doubts(places, circuits)
        return CircuitSearchResult(tuple(circuits), tuple(kept), intervals, *self._completeness_claim(kept, doubts))

    def _own_circuit(self, why: str) -> CircuitSearchResult:
        """The circuit of the assembly nearest to the sketch alone. Raises NoAnswer where there is none."""
        z = solved_mechanism(self.solver.mechanism).assembly.z
        curve = trace_circuit(self.solver, self.index, z)
        cuts = self._distinct((*curve.dead_points, *curve.stops))
        span = (cuts[0], cuts[-1]) if cuts else (0.0, TURN)
        ranges = self._cut_range(CriticalPositions((), (), span, ()), cuts[1:-1] if self.is_sliding else cuts)
        intervals = tuple(InputInterval(low, high, None) for low, high in ranges)
        mode = Mode(None, (), False, False, z, self.solver)
        return CircuitSearchResult(((curve, mode),), tuple(cuts), intervals, Completeness.NOT, (why,))

    def _stop_positions(self) -> Iterator[float]:
        """Where pairs pass their stops, along circuits that have none."""
        if self.solver.stops is not None:
            free = CircuitSearch(replace(self.mechanism, stops=()), self.pair).find_circuits()
            yield from stop_positions([each for each, _ in free.circuits], self.solver.stops)

    def _input_interval(self, low: float, high: float, places: Sequence[ListedInterval]) -> InputInterval:
        """A part of the input's range, and how many assemblies there are all over it."""
        gone = (place.position - low if self.is_sliding else (place.position - low) % TURN for place in places)
        inside = [place for place, at in zip(places, gone, strict=True) if 0.0 < at < high - low]
        counts = {len(place.modes) if place.is_whole else None for place in inside}
        return InputInterval(low, high, counts.pop() if len(counts) == 1 else None)

    def _cut_range(self, known: CriticalPositions, cuts: Sequence[float]) -> Iterator[tuple[float, float]]:
        """The input's range, cut."""
        if self.is_sliding:
            yield from pairwise([known.span[0], *cuts, known.span[1]])
        elif not cuts:
            yield 0.0, TURN
        else:
            yield from pairwise([*cuts, cuts[0] + TURN])

    def _list_assemblies(self, low: float, high: float) -> ListedInterval:
        bare = ListedInterval(low, high, self.solver, (), False, False)
        moved = (*self.standing_drives, Drive(self.pair, bare.position))
        solver = self.solver.with_inputs_of(replace_inputs(self.mechanism, moved))
        modes = Modes(solver, self.mechanism, moved, False)
        listing = tuple(islice((mode for mode in modes if solver.is_inside_stops(mode.z)), MAX_ASSEMBLIES + 1))
        whole = len(listing) <= MAX_ASSEMBLIES and not time_is_over()
        return ListedInterval(
            low, high, solver, listing[:MAX_ASSEMBLIES], whole, modes.complete is not Completeness.NOT
        )

    def _follow_circuits(self, places: Sequence[ListedInterval]) -> tuple[list[tuple[TracedCircuit, Mode]], list[str]]:
        """Every assembly that lies on no circuit yet, followed; and where the circuits differ from what is listed."""
        unknowns = [place.unknowns for place in places]
        taken = [np.zeros(len(place.modes), dtype=int) for place in places]
        circuits: list[tuple[TracedCircuit, Mode]] = []
        strange, between = 0, False
        for place, own in zip(places, taken, strict=True):
            for number, mode in enumerate(place.modes):
                if own[number] or mode.double or time_is_over():  # from where branches meet none is followed
                    continue
                each = trace_circuit(place.solver, self.index, mode.z)
                if not each.branches or time_is_over():
                    continue
                circuits.append((each, mode))
                passed = set()
                for k, other in enumerate(places):
                    for branch, at in each.assemblies_at(other.position):
                        passed.add(branch)
                        here = is_same_assembly(other.solver, at, unknowns[k])
                        taken[k] += here
                        strange += not here.any()
                between |= len(passed) < len(each.branches)
        twice = sum(int(np.sum(count > 1)) for count in taken)
        missed = sum(int(np.sum(count == 0)) for count in taken)
        if time_is_over():
            return circuits, [f"not all assemblies were followed, as {time_is_over()}"]
        differing = []
        if strange:
            differing.append("circuits run through assemblies that are not listed")
        if between:
            differing.append("some branches lie between dead points that are one to rounding")
        if twice or missed:
            differing.append("some assemblies lie on more than one circuit, or on none")
        return circuits, differing

    def _new_dead_points(self, cuts: Sequence[float], circuits: Sequence[tuple[TracedCircuit, Mode]]) -> list[float]:
        """Dead points of circuits that are at none of these positions of the input."""
        found: list[float] = []
        for at in (at for each, _ in circuits for at in each.dead_points):
            if not any(self._is_near(at, other) for other in (*cuts, *found)):
                found.append(at)
        return found

    def _distinct(self, positions: Sequence[float]) -> list[float]:
        """Positions of the input in their order; what rounding makes of one is one."""
        found: list[float] = []
        for at in sorted(positions if self.is_sliding else (at % TURN for at in positions)):
            if not any(self._is_near(at, other, SAME_POSITION_DISTANCE) for other in found):
                found.append(at)
        return found

    def _is_near(self, one: float, other: float, within: float = SAME_DEAD_POINT_DISTANCE) -> bool:
        """Whether two positions of the input are one; `within` in rad or sizes."""
        return (
            abs(one - other) < within * self.solver.unit
            if self.is_sliding
            else abs(remainder(one - other, TURN)) < within
        )

    def _completeness_doubts(
        self, places: Sequence[ListedInterval], circuits: Sequence[tuple[TracedCircuit, Mode]]
    ) -> list[str]:
        """What of the lists, and of following, leaves it open whether these are all."""
        doubts = []
        if not all(place.is_whole for place in places) and not time_is_over():
            doubts.append(f"there are positions with more than {MAX_ASSEMBLIES} assemblies")
        if not all(place.is_complete for place in places):
            doubts.append("lists of assemblies are not known to be complete")
        if any(each.has_change_point for each, _ in circuits):
            doubts.append(BRANCHES_CROSS)
        if any(not each.closed and not each.lost_reason and not all(each.stop_names) for each, _ in circuits):
            doubts.append("slides run out without an end, and may come back from there")
        lost = dict.fromkeys(each.lost_reason for each, _ in circuits if each.lost_reason)
        return doubts + [f"one was lost: {why}" for why in lost][:1]

    def _completeness_claim(self, kept: Sequence[float], doubts: Sequence[str]) -> tuple[Completeness, tuple[str, ...]]:
        if doubts:
            return Completeness.NOT, (f"the number of circuits is not claimed: {'; '.join(dict.fromkeys(doubts))}",)
        what = "dead points and stops" if self.solver.stops else "dead points"
        where = f"{what} at {count_phrase(len(kept), 'position', 'positions')} of the input" if kept else f"no {what}"
        told = f"{where}, found over its whole range as all zeros of a function that is known to rounding"
        return Completeness.NUMERICALLY, (told, "every assembly between them lies on one circuit, and on one only")
