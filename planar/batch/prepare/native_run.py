"""What of a mechanism's runs is compiled, and where it begins."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planar.batch.block import LEAD_IN_STEP
from planar.batch.design_arrays import read_designs, with_design_values
from planar.batch.prepare.design_numbers import DesignNumbers, compiled_variables
from planar.batch.prepare.run_endings import DEAD_POINT, STOP, UNSURE
from planar.batch.prepare.value_binder import MAX_BOUND_NAMES
from planar.batch.reference_design import ReferenceDesign
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember
from planar.model.mechanism import LARGEST_INPUT_POSITION
from planar.model.pairs.base import Pair

if TYPE_CHECKING:
    from planar.batch.prepare.compiled_run import CompiledRun
    from planar.batch.prepare.newton_run import NewtonRun

Array = np.ndarray
NativeRun = Callable[..., tuple[Any, float, int]]
"""From values by name to the rows of the wanted points (rows, positions), which are the caller's own, how the run ended
(see `run_endings`), and at which position. Raises KeyError for a name that is not there."""


class NativeRuns(NamedTuple):
    """The function for most designs, and the one for designs with a name that the first does not know; and what finds
    that of all designs with these names, or None, where pairs have no say in it."""

    run: NativeRun
    run_other: NativeRun
    find_run: Callable[[tuple[str, ...]], Any] | None = None


MAX_CHOICES = 8
"""Choices among the lengths that the file has as nothing of which each has a function; for others there is one."""
MAX_POSITIONS = 20_000
"""Positions of a run that is compiled, those on its way and between them too."""
LEAST_STEPS = 128
"""Steps of a run, those between its own too: each lane of a group that Newton's method solves takes some of them."""
FINE_STEP = 0.1
"""rad or sizes: where the input goes farther in a step, other positions are looked at between."""


def prepare_native_run(
    reference: ReferenceDesign, points: tuple[str, ...], rates: bool, positions: Array, may_shift: bool
) -> NativeRuns | None:
    """The compiled functions of a run over these positions of the running input; None where there are none.

    `may_shift`: whether the run starts where the design's own input stands, wherever that is.
    """

    def compile_run(grid: RunPositions, zeros: frozenset[str]) -> NativeRun:
        members = [reference.point_member(name) for name in points]
        design = run_design_numbers(reference, members, may_shift, zeros)
        run = compile_run_function(reference, design, members, rates, grid)
        return partial(_at_wanted_positions, run, grid) if grid.lead or grid.every > 1 else run

    return prepare_native(reference, positions, compile_run)


def prepare_native(
    reference: ReferenceDesign, positions: Array, compile_run: Callable[[RunPositions, frozenset[str]], NativeRun]
) -> NativeRuns | None:
    """What is compiled of a run over these positions, for each choice of lengths that are nothing in all designs; None
    where that cannot be."""
    if not reference.can_be_compiled or not all(pair.measures_symbols for pair in reference.mechanism.pairs):
        return None
    grid = find_positions(reference, positions)
    if len(grid.u) > MAX_POSITIONS or np.max(np.abs(grid.u)) > LARGEST_INPUT_POSITION:
        return None
    try:
        runs = RunsByZeros(partial(compile_run, grid), reference)
    except UnsupportedOperation:
        return None
    if any(type(pair).find_misfit is not Pair.find_misfit for pair in reference.mechanism.pairs):
        return NativeRuns(FittingPairs(reference, runs.run), FittingPairs(reference, runs.run_other))
    return NativeRuns(runs.run, runs.run_other, runs.find_known_run)


def run_design_numbers(
    reference: ReferenceDesign, members: Sequence[PointMember], may_shift: bool, zeros: frozenset[str]
) -> DesignNumbers:
    """What a run takes of a design; `zeros`: lengths that are nothing in all designs."""
    shifting = set(range(len(reference.mechanism.inputs)))
    if not may_shift:
        shifting.remove(reference.running_index)
    return DesignNumbers(reference, members, shifting, zeros)


def compile_run_function(  # many: what a run is made of
    reference: ReferenceDesign,
    design: DesignNumbers,
    members: Sequence[PointMember],
    rates: bool,
    grid: RunPositions,
    states: bool = False,
) -> CompiledRun | NewtonRun:
    """The function of a run over all these positions, for points on links, or for the states.

    Raises UnsupportedOperation.
    """
    from planar.batch.prepare.compiled_run import CompiledRun
    from planar.batch.prepare.newton_run import NewtonRun

    if design.equations("q").has_newton_blocks:
        if reference.mechanism.stops:
            raise UnsupportedOperation("stops are looked for where all groups are in closed form")
        if grid.lead or reference.candidates.counts_turns:
            raise UnsupportedOperation("a group that is not in closed form starts where the file has it, turns or not")
        return NewtonRun(reference, design, members, rates, grid.u)  # which holds its states beside the rows
    return CompiledRun(design, tuple(link for link, _ in members), rates, grid.u, states)


class RunsByZeros:
    """Runs compiled without the lengths that the file has as nothing, as most coordinates of pins on the frame; of
    designs that give such a length a value there is one for each choice of them, made when it is first wanted."""

    def __init__(self, compile_run: Callable[[frozenset[str]], NativeRun], reference: ReferenceDesign):
        known = compiled_variables(reference.mechanism)
        self._zeros = frozenset(name for name, each in known.items() if each.link and each.value == 0.0)
        self._names = frozenset(known)
        self._compile = compile_run
        self.run = compile_run(self._zeros)
        self._others: dict[frozenset[str], NativeRun] = {}
        self._by_names: dict[tuple[str, ...], NativeRun] = {}

    def run_other(self, values: Mapping[str, float], *more: Any) -> tuple[Any, float, int]:
        """The run of a design that gives a length a value which the file has as nothing."""
        names = tuple(values)
        return (self._by_names.get(names) or self.find_run(names))(values, *more)

    def find_known_run(self, names: tuple[str, ...]) -> NativeRun | None:
        """The run of designs that give these numbers a value; None where there is none."""
        run = self.find_run(names) if self._names.issuperset(names) else None
        return None if run is _refuse else run

    def find_run(self, names: tuple[str, ...]) -> NativeRun:
        """The run of designs that give these numbers a value. Raises KeyError for one that is not there."""
        run = self._by_names.get(names)
        if run is None:
            if not self._names.issuperset(names):
                raise KeyError(names)
            if len(self._by_names) >= MAX_BOUND_NAMES:
                self._by_names.clear()
            given = self._zeros.intersection(names)
            run = self._by_names[names] = self._find_other(given) if given else self.run
        return run

    def _find_other(self, given: frozenset[str]) -> NativeRun:
        """The run of designs that give these lengths a value."""
        if given not in self._others and len(self._others) >= MAX_CHOICES:
            given = self._zeros
        run = self._others.get(given)
        if run is None:
            try:
                run = self._compile(self._zeros - given)
            except UnsupportedOperation:
                run = _refuse
            self._others[given] = run
        return run


def _refuse(_values: Mapping[str, float], *_more: Any) -> tuple[Any, float, int]:
    """Of a structure that is not compiled nothing is known."""
    return np.empty((0, 0)), UNSURE, 0


class FittingPairs:
    """A run of designs that pairs may refuse before anything moves, as wheels that do not mesh: they are asked once for
    each change."""

    def __init__(self, reference: ReferenceDesign, run: NativeRun):
        self._reference, self._run = reference, run
        self._fitting: dict[str, float] = {}

    def __call__(self, values: Mapping[str, float], *more: Any) -> tuple[Any, float, int]:
        found = self._run(values, *more)
        return found if self._is_fit(values) else (found[0], UNSURE, 0)

    def _is_fit(self, values: Mapping[str, float]) -> bool:
        if values != self._fitting:
            mechanism = self._reference.mechanism
            arrays = read_designs(mechanism, values)
            if self._reference.is_unfit(arrays, self._reference.shapes(with_design_values(mechanism, arrays)))[0]:
                return False
            self._fitting = dict(values)
        return True


class RunPositions(NamedTuple):
    """Where all inputs are, u (positions, inputs): `lead` positions on the way to where the run starts; from there on
    every so manieth is a position of the run."""

    u: Array
    lead: int
    every: int


def find_positions(reference: ReferenceDesign, positions: Array) -> RunPositions:
    """All positions of a run over those of its input (rad or m)."""
    u, _, _ = reference.inputs(reference.mechanism, 1)
    running = reference.running_index
    run = positions / float(reference.input_scale[running])
    own = float(u[running, 0])
    every = ceil(np.max(np.abs(np.diff(run))) / FINE_STEP)
    # so few of every kind that the lanes of groups solved by Newton's method have enough of them too
    every = max(every, ceil(LEAST_STEPS / (len(run) - 1)))
    run = np.interp(np.arange(every * (len(run) - 1) + 1) / every, np.arange(len(run)), run)
    lead = ceil(abs(run[0] - own) / LEAD_IN_STEP)
    way = own + (run[0] - own) * np.arange(lead) / max(lead, 1)
    found = np.repeat(u.T, lead + len(run), axis=0)
    found[:, running] = np.concatenate([way, run])
    return RunPositions(found, lead, every)


def _at_wanted_positions(run: NativeRun, grid: RunPositions, values: Mapping[str, float]) -> tuple[Any, float, int]:
    """A run without the positions on its way, on which it must not end, and between."""
    rows, ending, position = run(values)
    if ending in (DEAD_POINT, STOP) and position <= grid.lead:
        ending = UNSURE
    return rows[:, grid.lead :: grid.every], ending, max(ceil((position - grid.lead) / grid.every), 0)
