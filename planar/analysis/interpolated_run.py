"""A run between its samples: its states at any position of the input that runs, at a steady rate of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import islice
from math import pi

import numpy as np

from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.geometry import frame_at
from planar.foundation.jets import Jet
from planar.model.mechanism import Drive, replace_inputs
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion, State
from planar.solving.continuation.fast_path import resting_inputs
from planar.solving.continuation.path import follow_samples
from planar.solving.position import PositionSolver
from planar.solving.samples import moving_jets, rows_with_rates, run_unknowns

CLOSED_TOLERANCE = 1e-9
"""rad, or part of the size: a motion that comes so near to where it started is closed."""
SEAM_TOLERANCE = 1e-12
"""rad: so near to the end of a turn a position is at its start."""


class InterpolatedRun:
    """A motion between its samples: states at any position of its running input, which runs steadily.

    Its `rate` is the file's velocity, without acceleration; where the file's velocity is zero it is 1 rad/s or 1 m/s,
    so that rates are per unit of the input. Of a motion there and back it is the way there; raises BadInput for a run
    in time and for a circuit, whose input is more than once at a position.
    """

    def __init__(self, motion: Motion):
        motion = _forward_part(motion)
        ranges = {name: float(np.ptp(given.position)) for name, given in motion.inputs.items()}
        self.pair = max(ranges, key=ranges.__getitem__)
        given = next(each for each in motion.mechanism.inputs if each.pair == self.pair)
        self.rate = given.velocity or 1.0
        self.mechanism = replace_inputs(motion.mechanism, (Drive(self.pair, None, self.rate, 0.0),))
        self.solver = PositionSolver(self.mechanism)
        self._running_index = [each.pair for each in self.mechanism.inputs].index(self.pair)
        self.positions: Array = motion.inputs[self.pair].position
        self.lowest, self.highest = float(self.positions.min()), float(self.positions.max())
        self.z = run_unknowns(self.solver, motion)
        self.samples = self._samples_at_rate(motion, given.velocity, given.acceleration)
        self.has_rates = rows_with_rates(self.samples)
        course = motion.course
        self._singular = np.zeros(len(self.positions), dtype=bool)
        self._singular[[row for row in course.singular_rows if row < len(motion)] if course is not None else []] = True
        self._change_points = () if course is None else course.fork_positions
        self.closed = self._is_closed()
        self._states: dict[float, State] = {}

    @property
    def period(self) -> float:
        """How far the input runs (rad or m)."""
        return self.highest - self.lowest

    @property
    def pin(self) -> str | None:
        """The frame's point about which the driving crank turns, as `link.point`, if there is one."""
        pair = self.solver.relative_motions[self.pair]
        on = [f"{link}.{point}" for link, point in pair.coincident_points() if link == self.mechanism.frame]
        return on[0] if on and pair.input_kind is MeasureKind.ANGLE else None

    def state_at(self, position: float) -> State:
        """The state at a position of the running input, on this motion's branch. Raises NoAnswer."""
        if position not in self._states:
            index = int(np.argmin(np.where(self._is_on_branch(position), np.abs(self.positions - position), np.inf)))
            solver = self._solver_at(position)
            start = solver.inputs.u.copy()
            start[self._running_index] = self.positions[index] / solver.input_scale[self._running_index]
            run = follow_samples(solver, self.z[index], resting_inputs(np.stack([start, solver.inputs.u])))
            if run.stopped is not None:
                raise run.stopped
            z, rates = run.z[-1], run.branch_rates.get(1)
            self._states[position] = solver.state(z) if rates is None else solver.state_on_branch(z, rates)
        return self._states[position]

    def _is_on_branch(self, position: float) -> BoolArray:
        """Which samples lead to a position on this motion's branch (samples,).

        Not those on change points, from which several ways lead on, nor those beyond one where another way was taken.
        """
        sound = self.has_rates & ~self._singular
        for fork in self._change_points:
            sound &= (self.positions - fork) * (position - fork) >= 0.0
        return sound

    def tabulate(self, measure: Callable[[State | Motion], Array]) -> tuple[Array, Array]:
        """Positions in order, and what is measured there (positions, ...), of states that have rates.

        Besides the samples there are some just beyond open ends of the range, or nearer and nearer to its limits; what
        is closed goes on over its seam.
        """
        order = np.argsort(self.positions, kind="stable")
        order = order[self.has_rates[order]]
        where, what = self.positions[order], np.asarray(measure(self.samples))[order]
        if self.closed and len(where):
            if where[-1] - where[0] > self.period - CLOSED_TOLERANCE:  # both ends are one position
                where, what = where[:-1], what[:-1]
            return np.concatenate([where, where[:2] + self.period]), np.concatenate([what, what[:2]])
        for position in self._positions_beside_ends() if len(where) else ():
            try:
                beside = np.asarray(measure(self.state_at(position)))[None]
            except NoAnswer:
                continue  # the motion does not go on so far
            index = int(np.searchsorted(where, position))
            where, what = np.insert(where, index, position), np.insert(what, index, beside, axis=0)
        return where, what

    def open_limits(self) -> tuple[tuple[float, float], ...]:
        """The ends of an open range that are limits, where no rate is determined, each with the way inwards."""
        if self.closed:
            return ()
        ends = ((self.lowest, 1.0), (self.highest, -1.0))
        return tuple((end, way) for end, way in ends if not self.has_rates[self.positions == end].any())

    def _positions_beside_ends(self) -> Iterator[float]:
        step = self.period / max(len(self.positions) - 1, 1)
        limits = dict(self.open_limits())
        for end, way in ((self.lowest, 1.0), (self.highest, -1.0)):
            if end in limits:
                yield from (end + way * step * by for by in (0.1, 1e-2, 1e-3, 1e-4))
            elif step:
                yield end - way * step * 0.01

    def wrap_position(self, position: float) -> float | None:
        """The position in the range of the motion, over a closed one the same place of the turn; None outside."""
        if self.closed:
            return max(position - self.period * ((position - self.lowest + SEAM_TOLERANCE) // self.period), self.lowest)
        inside = self.lowest - CLOSED_TOLERANCE <= position <= self.highest + CLOSED_TOLERANCE
        return min(max(position, self.lowest), self.highest) if inside else None

    def _solver_at(self, position: float) -> PositionSolver:
        return self.solver.with_inputs_of(replace_inputs(self.mechanism, (Drive(self.pair, position),)))

    def _samples_at_rate(self, motion: Motion, velocity: float, acceleration: float) -> Motion:
        """The samples at the steady rate."""
        if velocity and not acceleration:
            return motion
        if not velocity:
            return self._samples_at_unit_rate(motion)

        def steady(jet: Jet) -> Jet:
            # d2x/dt2 = x'' v^2 + x' a, of which the second part is the input's acceleration
            position, rate, second = jet.parts
            return Jet(position, rate, second - rate * (acceleration / velocity))

        return self._with_jets(motion, map(steady, moving_jets(motion)))

    def _samples_at_unit_rate(self, motion: Motion) -> Motion:
        """The samples of a motion whose input stands still in the file, with rates where these are known."""
        jets = moving_jets(motion)
        rates: Array = np.full((2, len(jets), len(self.positions)), np.nan)
        for row, (position, z) in enumerate(zip(self.positions.tolist(), self.z, strict=True)):
            try:
                state = PositionSolver(replace_inputs(self.mechanism, (Drive(self.pair, position),))).state(z)
            except NoAnswer:
                continue
            rates[..., row] = np.array([jet.parts[1:] for jet in moving_jets(state)]).reshape(-1, 2).T
        return self._with_jets(motion, (Jet(jet.parts[0], *rates[:, k]) for k, jet in enumerate(jets)))

    def _with_jets(self, motion: Motion, jets: Iterator[Jet]) -> Motion:
        """The samples with other jets, in the order of `moving_jets`."""
        frames = {
            link: frame if frame.fixed else frame_at(next(jets), next(jets), next(jets))
            for link, frame in motion.frames.items()
        }
        own = {name: tuple(islice(jets, len(coordinates))) for name, coordinates in motion.own.items()}
        return replace(motion, mechanism=self.mechanism, frames=frames, own=own)

    def _is_closed(self) -> bool:
        """Whether the motion comes back to where it started after whole turns of the input."""
        turns = self.period / (2.0 * pi)
        if (
            self.solver.relative_motions[self.pair].input_kind is MeasureKind.LENGTH
            or turns < 0.5
            or abs(turns - round(turns)) > CLOSED_TOLERANCE
        ):
            return False
        unit = self.solver.unit
        for frame in self.samples.frames.values():
            if not frame.fixed:
                gaps = [(each.parts[0][-1] - each.parts[0][0]) / unit for each in (frame.x, frame.y)]
                gaps += [each.parts[0][-1] - each.parts[0][0] for each in (frame.cos, frame.sin)]
                if max(map(abs, gaps)) > CLOSED_TOLERANCE:
                    return False
        slides = [jet.parts[0] for own in self.samples.own.values() for jet in own]
        return all(abs(each[-1] - each[0]) <= CLOSED_TOLERANCE * unit for each in slides)


def _forward_part(motion: Motion) -> Motion:
    """The motion, or its way there if it comes back."""
    if motion.time is not None:
        raise BadInput("motion", "this is asked of the range of one input; the motion is a run in time")
    ways = [np.diff(given.position) for given in motion.inputs.values()]
    if not any((way > 0.0).any() and (way < 0.0).any() for way in ways):
        return motion
    middle = (len(motion) - 1) // 2
    if all(np.array_equal(given.position, given.position[::-1]) for given in motion.inputs.values()):
        return motion.up_to_row(middle)
    raise BadInput("motion", "this is asked of one range of the input; a circuit goes through its dead points")
