"""One position: assembled, gated, and with its velocities and accelerations."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from planar.algebra import Jet
from planar.equations import Stage
from planar.errors import NoAnswer, Outcome
from planar.graph import detached
from planar.mechanism import Drive, Input, Mechanism, motions, with_inputs
from planar.motion import State
from planar.pairs import Kind
from planar.plane import GROUND, frame_at
from planar.program import Motion, Program, extent, fitted, length, positions, program, rates, shapes, size
from planar.solve.assemble import Assembler, Assembly, Failure, placed
from planar.solve.follow import corrected, follow
from planar.solve.gate import Gate
from planar.words import amount, listed

Array = np.ndarray

SINGULAR = 1e-5
"""A group's slope is singular where its least singular value is below this part of its links' own reach.

Near a dead point the slope falls with the square root of the distance to it, so that round-off in the input of one
part in 1e16 becomes one in 1e16 / slope^2 in the velocity: at 1e-5 six digits remain, below they are lost.
"""

NEAR_BY = 1e-2
"""How far (rad, or lengths of the size) a position is moved to see whether what holds there holds elsewhere."""


def solve(mechanism: Mechanism, drives: Sequence[Drive] = ()) -> State:
    """The position at the mechanism's inputs, of the assembly nearest to its sketch, with its rates.

    `drives` change inputs: the position then is the one to which the assembly of the file's own inputs leads when
    they are moved there together.

    Raises NoAnswer, whose outcome says whether the mechanism cannot be assembled, stands on a dead point or a change
    point, or has too few or too many inputs; its text names links, pairs, position and remedy.
    """
    here = Solver(mechanism)
    found = here.assembly()
    if not drives:
        return here.state(found.z, found.remarks)
    there = Solver(with_inputs(mechanism, tuple(drives)))
    z = follow(there, there.station.p, found.z, here.station.u, there.station.u)
    return there.state(z, found.remarks)


@dataclass(frozen=True)
class Station:
    """The numbers of one position: inputs u with their rates (scaled), and the numbers p of the pairs."""

    u: Array
    u1: Array
    u2: Array
    p: Array


class Solver:
    """One mechanism, its program, and what is needed to solve and judge any of its positions."""

    def __init__(self, mechanism: Mechanism):
        self.mechanism = mechanism
        self.unit = size(mechanism)
        self.shapes = shapes(mechanism)
        self.program: Program = program(mechanism)
        self.equations = self.program.equations
        self.gate = Gate(mechanism, self.shapes, self.unit)
        self.column = {(c.owner, c.part): index for index, c in enumerate(self.equations.coordinates)}
        self.pairs = {pair.name: pair for pair in mechanism.pairs}
        self.named = motions(mechanism)
        self.scale = np.array([self.unit if c.kind is Kind.LENGTH else 1.0 for c in self.equations.coordinates])
        self.reach = {link.name: extent(link) / self.unit for link in mechanism.links}
        self.station = Station(
            positions(mechanism, self.unit),
            rates(mechanism, "velocity", self.unit),
            rates(mechanism, "acceleration", self.unit),
            fitted(mechanism, self.unit),
        )

    def assembly(self) -> Assembly:
        """The assembly nearest to the sketch. Raises NoAnswer."""
        self._refuse_freedom()
        found = Assembler(self.mechanism, self.program, self.station.u, self.station.p, self.unit).search()
        if isinstance(found, Failure):
            raise self._not_assembled(found)
        return Assembly(found.z, (*self.mechanism.remarks, *found.remarks))

    def at(self, state: State) -> State:
        """The state in the same position as another's, with this mechanism's own rates."""
        parts = {(link, part): getattr(frame, part) for link, frame in state.frames.items() for part in ("x", "y", "angle")}
        for name, own in state.own.items():
            parts |= {(name, part): jet for (part, _), jet in zip(self.pairs[name].coordinates, own, strict=True)}
        coordinates = [self.equations.coordinates[column] for column in self.equations.unknowns]
        w = [(parts[c.owner, c.part].parts[0], self.unit if c.kind is Kind.LENGTH else 1.0) for c in coordinates]
        return self.state(np.array([value / by for value, by in w]), state.remarks)

    def state(self, z: Array, remarks: tuple[str, ...] = ()) -> State:
        """The state at given unknowns, once they and their rates have passed the gate."""
        station = self.station
        self._gated(z)
        y = np.concatenate([z, station.u])
        rest = np.zeros_like(z)
        at_rest = self.program.kinematics(y, np.concatenate([rest, station.u1]), np.concatenate([rest, station.u2]), station.p)
        mobility = self._mobility(at_rest, z)
        z1 = self._rate(at_rest.slope, at_rest.F1)
        y1 = np.concatenate([z1, station.u1])
        moving = self.program.kinematics(y, y1, np.concatenate([rest, station.u2]), station.p)
        z2 = self._rate(moving.slope, moving.F2)
        whole = self.program.kinematics(y, y1, np.concatenate([z2, station.u2]), station.p)
        return self._stated(whole, mobility, remarks)

    # positions

    def _gated(self, z: Array) -> None:
        gaps = self._open(z[None], self.station.u[None])[:, 0]
        worst = int(np.argmax(gaps))
        gap, pair = float(gaps[worst]), self.gate.names[worst] if self.gate.names else ""
        if gap > self.gate.tolerance:
            raise NoAnswer(
                Outcome.CANNOT_BE_ASSEMBLED,
                f"{self._at()}, the nearest position leaves pair {pair!r} open by {gap:.2g} of the mechanism's size "
                f"where rounding explains {self.gate.tolerance:.2g}; change a length or the input a little",
            )

    def _open(self, z: Array, u: Array) -> Array:
        """What every constraint leaves open (constraints, samples); z (samples, unknowns), u (samples, inputs)."""
        w = self.program.positions(z.T, u.T, self.station.p).full()
        lengths = [given for given in self.mechanism.inputs if self._slides(given)]
        scale = np.array([self.unit if given in lengths else 1.0 for given in self.mechanism.inputs])
        with np.errstate(invalid="ignore"):  # what is not a number counts as open, and is refused as such
            frames, own = placed(w * self.scale[:, None], self.column, self.shapes, self.pairs)
            return self.gate.open(frames, own, u.T * scale[:, None])

    def _slides(self, given: Input) -> bool:
        return self.named[given.pair].drive_kind is Kind.LENGTH

    def open_along(self, z: Array, u: Array) -> Array:
        """What the worst constraint leaves open at every sample (samples,)."""
        return self._open(z, u).max(axis=0)

    @property
    def tolerance(self) -> float:
        """What the gate lets pass: round-off of the residual, in lengths of the size."""
        return self.gate.tolerance

    def _refuse_freedom(self) -> None:
        loose = detached(self.mechanism)
        if loose:
            raise NoAnswer(
                Outcome.TOO_FEW_INPUTS,
                f"no chain of pairs joins {_links(loose)} to the frame {self.mechanism.frame!r}; add a pair",
            )
        free = [stage for stage in self.equations.stages if stage.free]
        if not free:
            return
        links = list(dict.fromkeys(link for stage in free for link in stage.links))
        taken = {given.pair for given in self.mechanism.inputs}
        offered = [n for n, pair in self.pairs.items() if set(pair.links) & set(links) and n not in taken]
        missing = sum(length(stage.unknowns) - length(stage.rows) for stage in free)
        given = f"{len(taken)} input" + ("" if len(taken) == 1 else "s")
        raise NoAnswer(
            Outcome.TOO_FEW_INPUTS,
            f"with {given} {_links(links)} can still move in {missing} way{'s' * (missing != 1)}; "
            f"give an input at {' or '.join(map(repr, offered[:6])) or 'another pair'}",
        )

    def _not_assembled(self, failure: Failure) -> NoAnswer:
        stage = failure.stage
        redundant = self._redundant_without_inputs()
        driven = [given.pair for given in self.mechanism.inputs]
        inputs_here = any(row.is_input for row in self.equations.rows[stage.rows])
        if length(stage.rows) > length(stage.unknowns) and not redundant and (inputs_here or len(driven) > 1):
            return NoAnswer(
                Outcome.TOO_MANY_INPUTS,
                f"the inputs at {listed([repr(name) for name in driven])} are more than the mechanism's freedom and do "
                f"not agree {self._at()}; leave out {'one' if len(driven) > 1 else 'it'}",
            )
        gaps: dict[str, float] = {}
        for row, left in zip(self.equations.rows[stage.rows], failure.open, strict=True):
            gaps[row.pair] = float(np.hypot(gaps.get(row.pair, 0.0), left))
        pair = max(gaps, key=lambda name: gaps[name], default="")
        is_length = self.pairs[pair].constrains[0] is Kind.LENGTH if pair in self.pairs else True
        gap = amount(gaps[pair] * self.unit, "length", self.mechanism.units) if is_length else f"{gaps[pair]:.3g} rad"
        return NoAnswer(
            Outcome.CANNOT_BE_ASSEMBLED,
            f"{self._at()} {_links(stage.links)} cannot be joined: at the nearest, pair {pair!r} stays open by {gap}; "
            f"change the input or a length of {listed(stage.links)}",
        )

    def _redundant_without_inputs(self) -> bool:
        bare = program(replace(self.mechanism, inputs=())).equations
        return any(length(stage.rows) > length(stage.unknowns) for stage in bare.stages)

    # rates

    def _mobility(self, motion: Motion, z: Array) -> int:
        """The mobility by rank; raises NoAnswer where the velocity is not determined, or contradicted.

        With the inputs' positions counted as unknowns, what the pairs leave free is unknowns + inputs - rank.
        """
        inputs = self.station.u.size
        stages = self.equations.stages
        weak = [stage for stage in stages if self._weakness(stage, motion.slope) < SINGULAR]
        square = all(length(stage.rows) == length(stage.unknowns) for stage in stages)
        if not weak and square:
            return inputs
        rank = _rank(np.hstack([motion.slope, motion.drive_slope]))
        mobility = z.size + inputs - rank
        if _rank(motion.slope) == z.size and not weak:
            if mobility < inputs and not self._agree(motion):
                names = listed([repr(given.pair) for given in self.mechanism.inputs])
                raise NoAnswer(
                    Outcome.TOO_MANY_INPUTS,
                    f"the mobility is {mobility}, and the velocities of the inputs at {names} do not agree; leave one out",
                )
            return mobility
        raise self._singular(z, motion.slope, mobility, weak)

    def _singular(self, z: Array, slope: Array, mobility: int, weak: list[Stage]) -> NoAnswer:
        inputs = self.station.u.size
        moving = self._moving_at_rest(slope)
        names = listed([repr(given.pair) for given in self.mechanism.inputs]) or "none"
        links = _links(moving or [link for stage in weak for link in stage.links])
        if mobility <= inputs:
            others = [n for n, p in self.pairs.items() if set(p.links) & set(moving) and n not in names]
            return NoAnswer(
                Outcome.DEAD_POINT,
                f"{self._at()} the input at {names} cannot move {links}, whose velocity is not determined; "
                f"move the input away from here, or drive {' or '.join(map(repr, others[:4])) or 'another pair'}",
            )
        freedoms = f"{mobility} freedom{'s' * (mobility != 1)} for {inputs} input{'s' * (inputs != 1)}"
        if self._always_weak(z):
            return NoAnswer(
                Outcome.TOO_FEW_INPUTS,
                f"the mechanism has {freedoms}: {links} can still move, while other links hold each other more than "
                f"once; give an input at a pair of {links}",
            )
        return NoAnswer(
            Outcome.CHANGE_POINT,
            f"{self._at()} the mechanism has {freedoms}: {links} may move in more than one way from here; "
            f"move the input, or give a further input",
        )

    def _always_weak(self, z: Array) -> bool:
        """Whether the velocity is undetermined in closed positions near by too, so that it is no matter of this one."""
        u, p = self.station.u, self.station.p
        for seed in range(3):
            rng = np.random.default_rng(seed)
            near = u + rng.uniform(-NEAR_BY, NEAR_BY, u.size)
            moved = corrected(self.program, p, z + rng.uniform(-NEAR_BY, NEAR_BY, z.size), near)
            if moved is not None:
                y = np.concatenate([moved, near])
                if _rank(self.program.kinematics(y, 0.0 * y, 0.0 * y, p).slope) == z.size:
                    return False
        return True

    def _moving_at_rest(self, slope: Array) -> list[str]:
        """The links that can move while the inputs are held, from the slope's null vectors."""
        _, s, vt = np.linalg.svd(slope)
        null = vt[int(np.sum(s > SINGULAR * max(1.0, s[0] if s.size else 1.0))) :] if s.size else vt
        if null.size == 0:
            null = vt[-1:]
        strength = np.max(np.abs(null), axis=0, initial=0.0)
        found = [
            self.equations.coordinates[column].owner
            for column, size_of in zip(self.equations.unknowns, strength, strict=True)
            if size_of > 1e-3 * (strength.max() or 1.0)
        ]
        joined = [link for name in found for link in (self.pairs[name].links if name in self.pairs else (name,))]
        return [link for link in dict.fromkeys(joined) if link != self.mechanism.frame]

    def _weakness(self, stage: Stage, slope: Array) -> float:
        """The least singular value of a group's slope, each column by what its links could reach at best."""
        if not length(stage.unknowns):
            return 1.0
        reach = max((self.reach[link] for link in stage.links), default=0.0) or 1.0
        own = slope[stage.rows, stage.unknowns].copy()
        kinds = [row.kind for row in self.equations.rows[stage.rows]]
        own[[kind is Kind.LENGTH for kind in kinds], :] /= reach
        for index, column in enumerate(self.equations.unknowns[stage.unknowns]):
            coordinate = self.equations.coordinates[column]
            if coordinate.kind is Kind.LENGTH:
                own[:, index] *= reach
            natural = self.reach.get(coordinate.owner, reach) / reach if coordinate.kind is not Kind.LENGTH else 1.0
            own[:, index] /= max(float(np.linalg.norm(own[:, index])), natural or 1.0)
        s = np.linalg.svd(own, compute_uv=False)
        return float(s[-1] / max(1.0, s[0])) if len(s) == length(stage.unknowns) else 0.0

    def _agree(self, motion: Motion) -> bool:
        z1 = self._rate(motion.slope, motion.F1)
        left = motion.slope @ z1 + motion.F1
        return bool(np.max(np.abs(left), initial=0.0) <= 1e-9 * (np.max(np.abs(self.station.u1), initial=0.0) or 1.0))

    @staticmethod
    def _rate(slope: Array, known: Array) -> Array:
        """The rates of the unknowns that cancel what the known rates open."""
        if slope.shape[0] == slope.shape[1]:
            return np.linalg.solve(slope, -known) if known.size else np.zeros(0)
        return np.linalg.lstsq(slope, -known, rcond=1e-12)[0]

    def _stated(self, motion: Motion, mobility: int, remarks: tuple[str, ...]) -> State:
        parts = np.stack([motion.w, motion.w1, motion.w2], axis=1) * self.scale[:, None]
        jets = [Jet(*each) for each in parts.tolist()]
        frames = {
            link: frame_at(*(jets[self.column[link, part]] for part in ("x", "y", "angle")))
            if (link, "x") in self.column
            else GROUND
            for link in self.shapes
        }
        own = {n: tuple(jets[self.column[n, part]] for part, _ in pair.coordinates) for n, pair in self.pairs.items()}
        for order, name in ((1, "velocities"), (2, "accelerations")):
            gap, pair = self.gate.open_rates(frames, own, order)
            if gap > 1e3 * self.gate.tolerance:
                raise NoAnswer(
                    Outcome.DEAD_POINT if self.station.u.size <= mobility else Outcome.TOO_MANY_INPUTS,
                    f"{self._at()} the {name} break pair {pair!r} by {gap:.2g} of the greatest; move the input",
                )
        still = {
            link: frame if frame.fixed else frame_at(*(float(each.parts[0]) for each in (frame.x, frame.y, frame.angle)))
            for link, frame in frames.items()
        }
        values = {name: tuple(float(each.parts[0]) for each in each_own) for name, each_own in own.items()}
        return State(self.mechanism, mobility, float(self.gate.open(still, values).max()), remarks, frames, own, self.shapes)

    def _at(self) -> str:
        """The position in words."""
        return f"at {self.where(self.station.u)}" if self.mechanism.inputs else "as drawn"

    def where(self, u: Array) -> str:
        """A position of the inputs in words: A = 60 deg."""
        told = []
        for given, position in zip(self.mechanism.inputs, u, strict=True):
            kind, by = ("length", self.unit) if self._slides(given) else ("angle", 1.0)
            told.append(f"{given.pair} = {amount(position * by, kind, self.mechanism.units)}")
        return listed(told)


def _links(names: list[str] | tuple[str, ...]) -> str:
    return f"link{'s' * (len(names) != 1)} {listed([repr(name) for name in names])}"


def _rank(matrix: Array) -> int:
    if matrix.size == 0:
        return 0
    s = np.linalg.svd(matrix, compute_uv=False)
    return int(np.sum(s > SINGULAR * max(1.0, s[0])))
