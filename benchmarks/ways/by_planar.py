"""planar: its general path, its run through the gate, the run's program without it, and single positions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

import planar
from benchmarks.linkages import Linkage
from benchmarks.ways.trial import CRANK, Array, Trial
from planar.equations.acceptance import InputSamples
from planar.model.mechanism import Drive, replace_inputs
from planar.results.motion import Motion, State
from planar.solving.continuation.fast_path import resting_inputs
from planar.solving.continuation.path import follow_samples, follow_to
from planar.solving.position import PositionSolver, solve


class Turn:
    """A linkage over a turn of its crank, in planar's unknowns z (samples, unknowns) and inputs u (samples, 1)."""

    def __init__(self, linkage: Linkage):
        self.mechanism = planar.from_dict(linkage.document())
        self.solver = PositionSolver(self.mechanism)
        self.start = self.solver.find_assembly().z
        self.u = CRANK[:, None]
        self.numbers = self.solver.inputs.p
        self._columns = [self.solver.column[name] for name in linkage.answers]
        self._scale = [1.0 if part == "angle" else self.solver.unit for _, part in linkage.answers]

    def general(self) -> Array:
        """z by the general path, sample by sample, both parts of the gate at each."""
        z = np.empty((len(self.u), self.start.size))
        z[0] = self.start
        for index in range(1, len(self.u)):
            z[index] = follow_to(self.solver, z[index - 1], self.u[index - 1], self.u[index])
        return z

    def gated(self) -> Array:
        """z by one call of the run's program, then both parts of the gate for all samples."""
        return follow_samples(self.solver, self.start, resting_inputs(self.u)).z

    def bare(self) -> Array:
        """z block after block at all samples, with what is judged of them by one evaluation."""
        way = InputSamples(self.u, np.ones_like(self.u), np.zeros_like(self.u))
        return self.solver.acceptance.run(self.start, way, self.solver.acceptance_scales)[0]

    def rates(self, z: Array) -> tuple[Array, Array, Array]:
        """z with its first and second rates: two calls of the program and two small systems a sample, ungated."""
        station, kinematics = self.solver.inputs, self.solver.functions.kinematics
        still, z1, z2 = np.zeros_like(self.start), np.empty_like(z), np.empty_like(z)
        for index, (at, u) in enumerate(zip(z, self.u, strict=True)):
            y, y2 = np.concatenate([at, u]), np.concatenate([still, station.u2])
            rest = kinematics(y, np.concatenate([still, station.u1]), y2, station.p)
            z1[index] = -np.linalg.solve(rest.jacobian, rest.F1)
            moving = kinematics(y, np.concatenate([z1[index], station.u1]), y2, station.p)
            z2[index] = -np.linalg.solve(rest.jacobian, moving.F2)
        return z, z1, z2

    def stations(self) -> list[tuple[PositionSolver, Array]]:
        """A solver for every sample, with the unknowns there."""
        pair = self.mechanism.inputs[0].pair
        moved = (replace_inputs(self.mechanism, (Drive(pair, position=float(u[0])),)) for u in self.u)
        return [(PositionSolver(mechanism), z) for mechanism, z in zip(moved, self.gated(), strict=True)]

    def answers(self, z: Array) -> Array:
        """The linkage's answers (1, samples, 2) at z."""
        w = self.solver.functions.coordinates(z, self.u, self.numbers).T
        return (w[self._columns].T * self._scale)[None]

    def answers_with_rates(self, found: tuple[Array, Array, Array]) -> Array:
        """The linkage's answers (3, samples, 2) at z with its rates."""
        station = self.solver.inputs
        answers = np.empty((3, len(self.u), 2))
        for index, (z, z1, z2, u) in enumerate(zip(*found, self.u, strict=True)):
            y1, y2 = np.concatenate([z1, station.u1]), np.concatenate([z2, station.u2])
            motion = self.solver.functions.kinematics(np.concatenate([z, u]), y1, y2, station.p)
            for order, w in enumerate((motion.w, motion.w1, motion.w2)):
                answers[order, index] = w[self._columns] * self._scale
        return answers


def trials(linkage: Linkage) -> tuple[Trial, ...]:
    """planar's ways, the most guarded first."""
    turn = Turn(linkage)
    stations = turn.stations()
    samples = len(CRANK)

    def with_rates(positions: Callable[[], Array]) -> Callable[[], tuple[Array, Array, Array]]:
        return lambda: turn.rates(positions())

    def states(found: list[State]) -> Array:
        return np.stack([_answers(linkage, state) for state in found], axis=1)

    ways = (
        ("planar, general path", turn.general),
        ("planar, run through the gate", turn.gated),
        ("planar, the run's program alone", turn.bare),
    )

    def cycled() -> Motion:
        return planar.cycle(turn.mechanism, samples - 1, float(CRANK[0]), float(CRANK[-1]))

    return (
        Trial("planar.cycle, from the sketch", True, samples, cycled, lambda motion: _answers(linkage, motion)),
        Trial("planar.solve, from the sketch", True, 1, lambda: [solve(turn.mechanism)], states),
        Trial("planar Solver.state, z known", True, samples, lambda: [s.state(z) for s, z in stations], states),
        *(Trial(way, False, samples, positions, turn.answers) for way, positions in ways),
        *(Trial(way, True, samples, with_rates(positions), turn.answers_with_rates) for way, positions in ways),
    )


def _answers(linkage: Linkage, state: State | Motion) -> Array:
    """The linkage's answers (3, 2) in one state, or (3, samples, 2) over a motion."""
    found = []
    for name, part in linkage.answers:
        if part == "angle":
            link = state.link(name)
            found.append((link.angle, link.angular_velocity, link.angular_acceleration))
        else:
            found.append(tuple(state.pair(name).values()))
    return np.moveaxis(np.array(found), 0, -1)
