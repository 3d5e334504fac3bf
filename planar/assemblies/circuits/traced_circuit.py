"""One circuit followed as a curve, from an assembly of it: its branches, and where on them an assembly lies."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, pi
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome, TrackingEnd, join_names
from planar.solving.continuation.path import (
    MAX_PIECES,
    PathPiece,
    follow_circuit,
    is_endless,
    moving_pieces,
    split_at_dead_points,
)
from planar.solving.continuation.predictor_corrector import CurveTracker
from planar.solving.continuation.solution_curve import SolutionCurve
from planar.solving.position import PositionSolver

TURN = 2.0 * pi


class Branch(NamedTuple):
    """A part of a circuit on which the input goes one way.

    `number`: within its circuit, from 1; `low`, `high`: where the input turns back (rad or m), of an angle with the
    whole turns with which `Circuits` writes intervals, 0 and 2 pi turns where it rotates fully; `turns`: turns of the
    input after which the linkage is back, 0 where the branch has ends; `ends`: what stands at low and at high, "dead
    point", "stop of D", "without end" or "lost".
    """

    number: int
    low: float
    high: float
    turns: int
    ends: tuple[str, str]


class BranchLeg(NamedTuple):
    """A part of a branch that was followed in one go: its pieces, and the way and place of its curve's input."""

    curve: SolutionCurve
    pieces: tuple[PathPiece, ...]
    first: float
    direction: float

    def position(self, place: float) -> float:
        """Of the input (rad, sizes), where it is so far on the way."""
        return self.first + self.direction * place

    @property
    def ends(self) -> tuple[float, float]:
        """The positions of the input from which and to which the leg was followed."""
        return self.position(self.pieces[0].start), self.position(self.pieces[-1].stop)

    def unknowns_at(self, position: float, turns: bool) -> Iterator[Array]:
        """The unknowns wherever the input is at a position, or whole turns from it."""
        for piece in self.pieces:
            low, high = sorted((self.position(piece.start), self.position(piece.stop)))
            # of two pieces that share an end only the one that starts there counts
            place = position + TURN * ceil((low - position) / TURN) if turns else position
            while low <= place < high:
                yield piece.unknowns_at(self.curve, self.direction * (place - self.first))[0]
                if not turns:
                    break
                place += TURN


class TracedCircuit(NamedTuple):
    """A circuit's legs by branch, in the order in which it runs through them; whether it closes, and why not."""

    solver: PositionSolver
    branches: tuple[tuple[BranchLeg, ...], ...]
    home_branch: int
    "the branch of the assembly from which it was followed, on which the input goes up"
    resting_inputs: tuple[float, ...]
    "where the input rests on the curve (rad, sizes)"
    has_change_point: bool
    "whether it was followed through a change point, where branches cross"
    closed: bool
    lost_reason: str
    is_turning: bool
    "whether the input comes back after a turn"
    stopped_inputs: tuple[float, ...] = ()
    "where the curve ends at a stop (rad, sizes)"
    stop_names: tuple[str, str] = ("", "")
    "the stops at which its first and its last branch end: stop of D"

    @property
    def scale(self) -> float:
        """What positions of the input on the curve are multiplied by: rad and m outside."""
        return 1.0 if self.is_turning else self.solver.unit

    @property
    def stops(self) -> tuple[float, ...]:
        """The input's positions at the stops at which it ends (rad, m)."""
        return tuple(each * self.scale for each in self.stopped_inputs)

    @property
    def dead_points(self) -> tuple[float, ...]:
        """The input's positions at its dead points (rad, m)."""
        return tuple(each * self.scale for each in self.resting_inputs)

    def assemblies_at(self, position: float) -> Iterator[tuple[int, Array]]:
        """Every assembly with the input at a position (rad, m): the branch (from 0), and the unknowns (rad, m)."""
        by = self.solver.scale[list(self.solver.equations.unknowns)]
        for number, legs in enumerate(self.branches):
            for leg in legs:
                for z in leg.unknowns_at(position / self.scale, self.is_turning):
                    yield number, z * by

    def public_branches(self) -> Iterator[Branch]:
        """The branches in numbers."""
        last, scale = len(self.branches) - 1, self.scale
        for index, legs in enumerate(self.branches):
            # legs of one branch follow each other but for whole turns
            gone = sum(abs(leg.ends[1] - leg.ends[0]) for leg in legs)
            low = min(legs[0].ends)
            if self.closed:
                ends = ("dead point", "dead point") if self.resting_inputs else ("", "")
            else:
                out = "lost" if self.lost_reason else "without end"
                first, final = (name or out for name in self.stop_names)
                ends = (first if index == 0 else "dead point", final if index == last else "dead point")
            up = (index - self.home_branch) % 2 == 0
            turns = round(gone / TURN) if self.closed and not self.resting_inputs else 0
            if self.is_turning:
                low = 0.0 if turns else low % TURN
            yield Branch(index + 1, low * scale, (low + gone) * scale, turns, ends if up else ends[::-1])


def trace_circuit(solver: PositionSolver, index: int, z: Array) -> TracedCircuit:
    """The circuit of an assembly with unknowns z at the solver's inputs, of which one runs."""
    turns = not solver.is_sliding(solver.mechanism.inputs[index].pair)
    walk = _curve_tracker(solver, index, z, 1.0)
    first = float(solver.inputs.u[index])
    try:
        whole = follow_circuit(walk)
    except NoAnswer as problem:
        return _trace_open_circuit(solver, index, z, problem.reason.split(";")[0])
    legs = [BranchLeg(walk.curve, stretch, first, 1.0) for stretch in whole.branches]
    if not legs:
        given = solver.mechanism.inputs[index].pair
        raise NoAnswer(Outcome.TOO_MANY_INPUTS, f"the input at {given!r} cannot move; leave it out")
    rests = tuple(leg.ends[1] for leg in (legs if whole.starts_at_dead_point else legs[:-1]))
    if len(legs) == 1 or whole.starts_at_dead_point:
        branches: list[tuple[BranchLeg, ...]] = [(leg,) for leg in legs]
    else:  # the last comes back to where the first has started
        branches = [(legs[-1], legs[0]), *((leg,) for leg in legs[1:-1])]
    return TracedCircuit(solver, tuple(branches), 0, rests, bool(walk.passed), True, "", turns)


def _trace_open_circuit(solver: PositionSolver, index: int, z: Array, reason: str) -> TracedCircuit:
    """A circuit that is not found to close, followed both ways as far as it goes."""
    turns = not solver.is_sliding(solver.mechanism.inputs[index].pair)
    first = float(solver.inputs.u[index])
    sides: list[list[BranchLeg]] = []
    rests: list[float] = []
    stopped: list[float] = []
    names: list[str] = []
    lost, crossed = "", False
    for way in (-1.0, 1.0):
        walk = _curve_tracker(solver, index, z, way)
        found: list[PathPiece] = []
        out = False
        for piece in moving_pieces(walk):
            found.append(piece)
            out = is_endless(walk, piece)
            if out or len(found) > MAX_PIECES:
                break
        rests += [first + way * piece.stop for piece in found if piece.dead_point is not None]
        crossed |= bool(walk.passed)
        met = solver.stops_at(walk.point.y[:-1], walk.curve.inputs(walk.point.y)) if not out else ()
        names.append(f"stop of {join_names(dict.fromkeys(each.pair for each in met))}" if met else "")
        if walk.ending is TrackingEnd.STOP:
            stopped.append(first + way * float(walk.point.y[-1]))
        elif not (out or walk.limit is not None):
            lost = reason
        sides.append([BranchLeg(walk.curve, each, first, way) for each in split_at_dead_points(found)])
    back, ahead = sides
    home = (*back[:1], *ahead[:1])  # none where no way on is found at all
    branches = [*((leg,) for leg in back[:0:-1]), home, *((leg,) for leg in ahead[1:])] if home else []
    home_number, both = max(len(back) - 1, 0), (names[0], names[1])
    return TracedCircuit(
        solver, tuple(branches), home_number, tuple(rests), crossed, False, lost, turns, tuple(stopped), both
    )


def _curve_tracker(solver: PositionSolver, index: int, z: Array, way: float) -> CurveTracker:
    axis = np.zeros_like(solver.inputs.u)
    axis[index] = way
    return CurveTracker(solver, z, solver.inputs.u, axis)
