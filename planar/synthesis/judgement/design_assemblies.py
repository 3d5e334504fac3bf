"""A design's assemblies at positions of its input, the circuit of its sketch, and a task's entries on them."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np

from planar.assemblies.circuits.traced_circuit import BranchLeg, TracedCircuit, trace_circuit
from planar.assemblies.modes import Modes
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, join_names
from planar.foundation.jets import TURN, value_and_rates
from planar.model.mechanism import Drive, Mechanism, named_points, relative_motions, replace_inputs
from planar.model.pairs import MeasureKind
from planar.solving.continuation.path import PathPiece
from planar.solving.continuation.solution_curve import Arc
from planar.solving.position import PositionSolver, solved_mechanism
from planar.solving.prepared_mechanism import LazyFrames
from planar.synthesis.judgement.defects import ONE_BRANCH, ONE_CIRCUIT, REACH, Defect
from planar.synthesis.judgement.input_range import InputRange
from planar.synthesis.task.synthesis_task import Wanted, WantedFunction, WantedPath
from planar.synthesis.task.wanted_results import carried_name, result_differences, wanted_results

MAX_ASSEMBLIES = 64
"""Assemblies at one position of the input that are looked at."""
PIECE_SAMPLES, REFINEMENTS, REFINED_SAMPLES = 12, 3, 13
"""Positions on each piece of a branch at which the one nearest to an entry is looked for, how often it is looked
at more closely, and at how many positions."""


class DesignAssemblies:
    """The assemblies of one design. The other inputs stand still. Raises NoAnswer where it cannot be assembled."""

    def __init__(self, mechanism: Mechanism):
        running, *others = mechanism.inputs
        standing = tuple(Drive(each.pair, None, 0.0, 0.0) for each in others)
        self.mechanism = replace_inputs(mechanism, standing) if standing else mechanism
        known = solved_mechanism(self.mechanism)
        self.solver, self.home = known.solver, known.assembly.z
        self.pair = running.pair
        self.scale = self.solver.unit if self.solver.is_sliding(self.pair) else 1.0
        self._by_position: dict[float, Array] = {}
        self._sampled_results: dict[str, Array] = {}
        "along the sketch's branch, by the name of what shows them"

    # assemblies

    def at(self, position: float) -> Array:
        """All assemblies (assemblies, unknowns) with the input at a position (rad or m)."""
        if position not in self._by_position:
            solver = self._solver_at(position)
            modes = islice(Modes(solver, solver.mechanism, (), False), MAX_ASSEMBLIES)
            listed = [each.z for each in modes if solver.is_inside_stops(each.z)]
            self._by_position[position] = np.array(listed).reshape(-1, len(self.home))
        return self._by_position[position]

    def _solver_at(self, position: float) -> PositionSolver:
        return self.solver.with_inputs_of(replace_inputs(self.mechanism, (Drive(self.pair, position),)))

    def measures_angle(self, wanted: Wanted) -> bool:
        """Whether the values of a wanted item are angles, where it is a function."""
        if not isinstance(wanted, WantedFunction):
            return True
        return relative_motions(self.mechanism)[wanted.to_pair].input_kind is not MeasureKind.LENGTH

    def results(self, wanted: Wanted, z: Array, positions: Array) -> Array:
        """What assemblies z (n, unknowns) with the input at positions (n,) show of a wanted item (n, parts), SI."""
        solver, u = self.solver, self._inputs(positions)
        w = solver.functions.coordinates(z, u, solver.inputs.p)
        frames, own = LazyFrames(solver, [w, np.zeros_like(w), np.zeros_like(w)]).frames_and_own
        if isinstance(wanted, WantedFunction):
            motion = relative_motions(self.mechanism)[wanted.to_pair]
            parts = [motion.input_position_at(solver.shapes, frames, own)]
        elif isinstance(wanted, WantedPath):
            link, point = self._carrier(carried_name(self.mechanism, wanted.point))
            parts = [*frames[link].to_world(solver.shapes[link].position(point))]
        else:
            parts = [getattr(frames[wanted.link], part) for part in ("x", "y", "angle")]
        columns = [np.broadcast_to(np.asarray(value_and_rates(part)[0], float), (len(z),)) for part in parts]
        return np.stack(columns, axis=1)

    def condition(self, z: Array, position: float) -> float:
        """By how much more the assembly moves than its equations are out, lengths in units of the links' reach."""
        least = self.solver.block_regularity(z, self._inputs(np.array([position]))[0])
        return 1.0 / max(float(np.prod(least)), 1e-300)

    def _inputs(self, positions: Array) -> Array:
        u = np.repeat(self.solver.inputs.u[None], len(positions), axis=0)
        u[:, 0] = positions / self.scale
        return u

    def _carrier(self, point: str) -> tuple[str, str]:
        return next(each.members[0] for each in named_points(self.mechanism) if each.name == point)

    # the circuit of the sketch

    @cached_property
    def circuit(self) -> TracedCircuit | None:
        """The circuit on which the sketched assembly lies; None where it cannot be followed."""
        try:
            return trace_circuit(self.solver, 0, self.home)
        except NoAnswer:
            return None

    @property
    def home_branch(self) -> int:
        """The number of the branch of the sketch, from 0."""
        return 0 if self.circuit is None else self.circuit.home_branch

    def along_circuit(self, position: float) -> tuple[list[int], Array]:
        """The assemblies of the circuit with the input at a position (rad or m): the branches, from 0, on which they
        lie, and their unknowns (assemblies, unknowns)."""
        every = [] if self.circuit is None else list(self.circuit.assemblies_at(position))
        by = self.solver.scale[list(self.solver.equations.unknowns)]
        z = np.array([unknowns for _, unknowns in every]).reshape(-1, len(by)) / by
        return [branch for branch, _ in every], z

    def has_change_point(self, z: Array, position: float) -> bool:
        """Whether the circuit of an assembly z (unknowns,) runs through a change point."""
        try:
            return trace_circuit(self._solver_at(position), 0, z).has_change_point
        except NoAnswer:
            return False

    def dead_points_before(self, branch: int, position: float) -> list[float]:
        """The positions (rad or m) of the dead points between the sketch's branch and another one, the shorter way
        round the circuit, with the input on that branch at a position."""
        circuit = self.circuit
        assert circuit is not None
        count, home = len(circuit.branches), circuit.home_branch
        last = count if circuit.closed else 0
        ahead = [self._branch_end(k % count) for k in range(home, branch + last * (branch < home))]
        back = [self._branch_end((k - 1) % count) for k in range(home + last * (branch > home), branch, -1)]
        ways = [way for way in (ahead, back) if way]
        start = float(self.solver.inputs.u[0]) * self.scale
        return min(ways, key=lambda way: (len(way), self._travel(start, way[0]) + self._travel(way[-1], position)))

    def _branch_end(self, branch: int) -> float:
        """The dead point between a branch and the next one."""
        circuit = self.circuit
        assert circuit is not None
        legs = circuit.branches[branch]
        is_ahead = circuit.closed or branch >= circuit.home_branch
        return (legs[-1].ends[1] if is_ahead else legs[0].ends[0]) * self.scale

    def _travel(self, one: float, other: float) -> float:
        apart = other - one
        return abs(apart if self.solver.is_sliding(self.pair) else apart - TURN * round(apart / TURN))

    @cached_property
    def _branch_pieces(self) -> list[tuple[BranchLeg, PathPiece, Array]]:
        """The pieces of the sketch's branch with their legs, and places (n,) along each."""
        if self.circuit is None or not self.circuit.branches:
            return []
        return [
            (leg, piece, np.linspace(piece.first, piece.last, PIECE_SAMPLES))
            for leg in self.circuit.branches[self.circuit.home_branch]
            for piece in leg.pieces
        ]

    def nearest(self, wanted: Wanted, entry: int, size: float) -> tuple[float, float] | None:
        """The position of the input (rad or m) on the sketch's branch where an entry of a path or of poses is missed
        least, and that miss; `size` (m) is the extent of what is wanted. None where the circuit cannot be followed."""
        pieces = self._branch_pieces
        if not pieces:
            return None
        if wanted.of not in self._sampled_results:
            y = np.concatenate([_on_arc(piece.arc, places) for _, piece, places in pieces])
            positions = np.concatenate(
                [self._positions(leg, rows) for (leg, _, _), rows in zip(pieces, np.split(y, len(pieces)), strict=True)]
            )
            self._sampled_results[wanted.of] = self.results(wanted, y[:, :-1], positions)
        shown = self._sampled_results[wanted.of]
        number, sample = divmod(int(np.argmin(_entry_distances(wanted, entry, shown, size))), PIECE_SAMPLES)
        leg, piece, places = pieces[number]
        (low, high), x = sorted((piece.first, piece.last)), float(places[sample])
        step = (high - low) / (PIECE_SAMPLES - 1)
        for _ in range(REFINEMENTS):
            tried = np.linspace(max(low, x - step), min(high, x + step), REFINED_SAMPLES)
            y = _on_arc(piece.arc, tried)
            shown = self.results(wanted, y[:, :-1], self._positions(leg, y))
            x = float(tried[int(np.argmin(_entry_distances(wanted, entry, shown, size)))])
            step *= 2.0 / (REFINED_SAMPLES - 1)
        y = piece.arc.curve_coordinates(leg.curve, x)[None]
        positions = self._positions(leg, y)
        miss = _entry_distances(wanted, entry, self.results(wanted, y[:, :-1], positions), size)
        return float(positions[0]), float(miss[0])

    def _positions(self, leg: BranchLeg, y: Array) -> Array:
        """The input (n,) rad or m at points of a leg's curve (n, unknowns and input)."""
        positions: Array = (leg.first + leg.direction * y[:, -1]) * self.scale
        return positions


def _entry_distances(wanted: Wanted, entry: int, shown: Array, size: float) -> Array:
    return result_differences(wanted, shown, wanted_results(wanted)[entry], size)


def _on_arc(arc: Arc, places: Array) -> Array:
    """Points (n, unknowns and input) of an arc's polynomial at places (n,) along its axis."""
    points: Array = ((places / arc.unit_length)[:, None] ** np.arange(len(arc.coefficients))) @ arc.coefficients
    return points


class EntryPlace(NamedTuple):
    """Where an entry is met.

    `entry` counts from 0, `position` (rad or m) is that of the input; `kind` says on what it lies: the "branch" of the
    sketch, its "circuit", a branch that is "crossed" at a change point, "another" circuit, a circuit that is "unknown",
    or "nowhere" where no assembly meets it. `dead_points` (rad or m) lie between it and the branch of the sketch.
    """

    entry: int
    position: float
    kind: str
    dead_points: tuple[float, ...] = ()


class EntryLocator(NamedTuple):
    """Finds the assemblies of a design that show given results to within a distance (m or rad); `size` (m) is the
    extent of what is wanted. `is_proof`: what lies on no branch of the circuit is looked for in all assemblies."""

    design: DesignAssemblies
    size: float
    within: float
    is_proof: bool

    def locate(self, wanted: Wanted, entry: int, position: float, result: Array) -> EntryPlace:
        """Where an entry is met, with the input at a position (rad or m) and a result (parts,) of a wanted item."""
        design = self.design
        branches, z = design.along_circuit(position)
        on = [branches[k] for k in self._rows(wanted, z, position, result)]
        if design.home_branch in on:
            return EntryPlace(entry, position, "branch")
        if on:
            return EntryPlace(entry, position, "circuit", tuple(design.dead_points_before(on[0], position)))
        is_crossing = design.circuit is not None and design.circuit.has_change_point
        if self.is_proof or is_crossing:
            z = design.at(position)
            rows = self._rows(wanted, z, position, result)
            if self.is_proof and not rows:
                return EntryPlace(entry, position, "nowhere")
            if is_crossing and any(design.has_change_point(z[row], position) for row in rows):
                return EntryPlace(entry, position, "crossed")
        is_followed = design.circuit is not None and not design.circuit.lost_reason
        return EntryPlace(entry, position, "another" if is_followed else "unknown")

    def _rows(self, wanted: Wanted, z: Array, position: float, result: Array) -> list[int]:
        """The assemblies (rows of z) that show the result."""
        if not len(z):
            return []
        shown = self.design.results(wanted, z, np.full(len(z), position))
        off = result_differences(wanted, shown, result, self.size, self.design.measures_angle(wanted))
        rows: list[int] = np.flatnonzero(off <= self.within).tolist()
        return rows


class PlaceWords(NamedTuple):
    """How positions and misses are written: the range of the input, the entry whose branch is the sketch's, misses."""

    reach: InputRange
    branch: str
    input_text: Callable[[float], str]
    miss_text: Callable[[Wanted, float], str]

    def defects(self, wanted: Wanted, places: Sequence[EntryPlace], misses: Array) -> Iterator[Defect]:
        """Of the entries of an item that are not met on the branch of the sketch, and are missed by (n,) there."""
        groups: dict[tuple[str, tuple[float, ...]], list[EntryPlace]] = {}
        for place in places:
            key = tuple(round(at, 9) for at in place.dead_points)
            groups.setdefault((place.kind, key), []).append(place)
        for (kind, _), group in groups.items():
            if kind == "branch":
                continue
            rest = self._branch_sentence(wanted, group, misses)
            entries = _entries_text(group)
            if kind == "nowhere":
                yield Defect(REACH, f"no assembly of it meets {entries} of {wanted.of}; {rest}")
                continue
            at = join_names([self.input_text(self._brought(each.position)) for each in group], max_names=None)
            met = f"{wanted.of} meets {entries} at {self.reach.pair} = {at}, {self._where(kind, group[0])}; {rest}"
            is_branch = kind in ("circuit", "crossed")
            yield Defect(
                ONE_BRANCH if is_branch else ONE_CIRCUIT, f"{'branch' if is_branch else 'circuit'} defect: {met}"
            )

    def _where(self, kind: str, place: EntryPlace) -> str:
        if kind == "circuit":
            at = join_names([self.input_text(self._brought(each)) for each in place.dead_points], max_names=None)
            points = "dead points" if len(place.dead_points) > 1 else "dead point"
            return f"on the same circuit beyond the {points} at {self.reach.pair} = {at}"
        return {
            "crossed": "on a branch that crosses this one at a change point",
            "another": "on another circuit",
            "unknown": "in another assembly, whose circuit could not be followed",
        }[kind]

    def _branch_sentence(self, wanted: Wanted, group: Sequence[EntryPlace], misses: Array) -> str:
        """What is missed on the branch of the sketch, or that it does not reach so far."""
        own = misses[[each.entry for each in group]]
        if not np.isfinite(own).all():
            low, high = (self.input_text(each) for each in (self.reach.low, self.reach.high))
            return f"{self.branch} goes from {self.reach.pair} = {low} to {high}"
        miss = self.miss_text(wanted, float(own.max()))
        return f"on {self.branch} the miss is {miss}{' at most' if len(group) > 1 else ''}"

    def _brought(self, position: float) -> float:
        """An angle by whole turns next to the range of the input."""
        if not self.reach.turns or self.reach.counts_turns:
            return position
        middle = 0.5 * (self.reach.low + self.reach.high)
        return position - TURN * round((position - middle) / TURN)


def _entries_text(places: Sequence[EntryPlace]) -> str:
    names = [str(place.entry + 1) for place in places]
    return f"{'entries' if len(names) > 1 else 'entry'} {join_names(names, max_names=None)}"
