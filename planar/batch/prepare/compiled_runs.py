"""The runs of one linkage as compiled functions: values of a design in, positions and rates out."""

from __future__ import annotations

import struct
from collections.abc import Callable, Mapping, Sequence
from ctypes import addressof, c_char
from math import ceil
from typing import NamedTuple

import numpy as np

from planar.batch.block import LEAD_IN_STEP
from planar.batch.design_arrays import read_designs
from planar.batch.march.kernel import BareAngle
from planar.batch.prepare.closed_form_run import closed_form_stages
from planar.batch.prepare.design_numbers import DesignNumbers, compiled_variables
from planar.batch.prepare.newton_run import newton_stages
from planar.batch.prepare.run_code import (
    ALL_SOLVED,
    UNSURE,
    CompiledRun,
    RunStages,
)
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import WIDEST_VECTOR_BYTES
from planar.foundation.arrays import Array, IntArray
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember
from planar.model.mechanism import LARGEST_INPUT_POSITION
from planar.model.pairs.base import Pair

NOT_COMPILED = (UnsupportedOperation, BareAngle)
"""Why there is no code for a structure: an operation, or an angle that counts its turns."""
MAX_BOUND_NAMES = 64
"""Sequences of names that are known at once."""
MAX_CHOICES = 8
"""Choices among the lengths that are zero in the file of which each has a function; for others there is one."""
MAX_POSITIONS = 20_000
"""Positions of a run that is compiled, with those that lead to it and between them."""
LEAST_STEPS = 128
"""Minimum steps of a run: each lane of a block that Newton's method solves takes some of them."""
FINE_STEP = 0.1
"""rad or sizes: longer steps of the input are divided."""

_view = c_char.from_buffer


def address_of(array: Array) -> int:
    """The address of an array: `array.ctypes.data` in a fifth of its time."""
    return addressof(_view(array))  # type: ignore[arg-type]


MakeNumbers = Callable[[Sequence[PointMember]], DesignNumbers]


class RunPositions(NamedTuple):
    """Positions of all inputs, u (positions, inputs): the first `lead` of them lead to where the run starts; from there
    on one of `every` so many is a position of the run."""

    u: Array
    lead: int
    every: int

    @property
    def wanted(self) -> range:
        """The positions of the run among all."""
        return range(self.lead, len(self.u), self.every)


class BoundRun(NamedTuple):
    """A compiled function for values with some names: what packs them, the place of each, and its address."""

    run: CompiledRun
    pack: Callable[..., bytes]
    places: IntArray
    address: int


class CompiledRuns:
    """Functions compiled without the lengths that are zero in the file, as most coordinates of pins on the frame.

    For designs that give such a length a value there is a function for each choice of them, made when first needed.
    Raises `NOT_COMPILED`.
    """

    def __init__(self, reference: ReferenceDesign, compile_run: Callable[[frozenset[str]], CompiledRun]):
        known = compiled_variables(reference.mechanism)
        self._reference, self._compile = reference, compile_run
        self._zeros = frozenset(name for name, each in known.items() if each.link and each.value == 0.0)
        self._names = frozenset(known)
        self._runs: dict[frozenset[str], CompiledRun | None] = {frozenset(): compile_run(self._zeros)}
        self._bound: dict[tuple[str, ...], BoundRun] = {}
        self.can_misfit = any(type(pair).find_misfit is not Pair.find_misfit for pair in reference.mechanism.pairs)
        "whether pairs may refuse a design before anything moves, as wheels that do not mesh"
        self._fitting: dict[str, float] = {}

    def __call__(self, values: Mapping[str, float], weights: int = 0) -> tuple[Array, float, int] | None:
        """The results of a design, how its run ends, and how many positions are good if it does not end as it should.

        None where that is not sure. `weights`: the address of what a gradient takes.
        """
        names = tuple(values)
        bound = self._bound.get(names) or self.bind(names)
        if bound is None:
            return None
        run, pack, _, places = bound
        try:
            packed = pack(*values.values())
        except (struct.error, TypeError):  # the general path says in words what is not a number
            return None
        out, scratch = np.empty(run.shape), 0
        if run.scratch_size:
            memory = np.empty(run.scratch_size + WIDEST_VECTOR_BYTES // 8)
            scratch = address_of(memory)
            scratch += -scratch % WIDEST_VECTOR_BYTES
        run.function(run.context, places, packed, scratch, address_of(out), weights)
        ending = out.item(0)
        if ending == UNSURE or (self.can_misfit and not self._is_fit(values)):
            return None
        return out[run.results], ending, 0 if ending == ALL_SOLVED else int(out.item(1))

    def bind(self, names: tuple[str, ...]) -> BoundRun | None:
        """The function for designs that give these numbers a value; None where there is none."""
        bound = self._bound.get(names)
        run = self._find_run(self._zeros.intersection(names)) if self._names.issuperset(names) else None
        if bound is None and run is not None:
            places = np.array([len(names), *(run.index[name] for name in names)], dtype=np.int64)
            if len(self._bound) >= MAX_BOUND_NAMES:
                self._bound.clear()
            # packing keeps the order; bytes are read where they are
            bound = BoundRun(run, struct.Struct(f"{len(names)}d").pack, places, places.ctypes.data)
            self._bound[names] = bound
        return bound

    def _find_run(self, nonzero: frozenset[str]) -> CompiledRun | None:
        """The function for designs that give these lengths a value; None where it cannot be compiled."""
        if nonzero not in self._runs and len(self._runs) > MAX_CHOICES:
            nonzero = self._zeros
        if nonzero not in self._runs:
            try:
                self._runs[nonzero] = self._compile(self._zeros - nonzero)
            except NOT_COMPILED:
                self._runs[nonzero] = None
        return self._runs[nonzero]

    def _is_fit(self, values: Mapping[str, float]) -> bool:
        """Whether no pair refuses a design; asked once for each change."""
        if values != self._fitting:
            mechanism = self._reference.mechanism
            arrays = read_designs(mechanism, values)
            rows = self._reference.design_rows(arrays, 1)
            if not rows.is_fit[0] or self._reference.is_unfit(arrays, rows.shapes)[0]:
                return False
            self._fitting = dict(values)
        return True


def prepare_runs(
    reference: ReferenceDesign,
    positions: Array,
    may_shift: bool,
    compile_run: Callable[[MakeNumbers, RunPositions], CompiledRun],
) -> CompiledRuns | None:
    """The compiled functions of runs over these positions of the running input; None where there are none.

    `may_shift`: whether the run starts where the design's own input stands, wherever that is. `compile_run` takes what
    makes the numbers of a design for points on links.
    """
    if not reference.can_be_compiled or not all(pair.measures_symbols for pair in reference.mechanism.pairs):
        return None
    grid = find_positions(reference, positions)
    if len(grid.u) > MAX_POSITIONS or np.max(np.abs(grid.u)) > LARGEST_INPUT_POSITION:
        return None
    shifting = {k for k in range(len(reference.mechanism.inputs)) if may_shift or k != reference.running_index}

    def compile_for_zeros(zeros: frozenset[str]) -> CompiledRun:
        return compile_run(lambda members: DesignNumbers(reference, members, shifting, zeros), grid)

    try:
        return CompiledRuns(reference, compile_for_zeros)
    except NOT_COMPILED:
        return None


def prepare_point_runs(
    reference: ReferenceDesign, points: tuple[str, ...], rates: bool, positions: Array, may_shift: bool
) -> CompiledRuns | None:
    """The compiled runs over points."""
    members = [reference.point_member(name) for name in points]

    def compile_run(make_numbers: MakeNumbers, grid: RunPositions) -> CompiledRun:
        design = make_numbers(members)
        return CompiledRun(design, run_stages(reference, design, members, rates, grid), grid.wanted)

    return prepare_runs(reference, positions, may_shift, compile_run)


def run_stages(
    reference: ReferenceDesign,
    design: DesignNumbers,
    members: Sequence[PointMember] | None,
    rates: bool,
    grid: RunPositions,
) -> RunStages:
    """The stages of a run over all these positions, for points on links, or, without them, for the states.

    Raises UnsupportedOperation.
    """
    equations = design.equations("q")
    if set(design.sketched_blocks) < {part.block.block_index for part in equations.blocks}:
        raise UnsupportedOperation("the sketch does not show every group")
    if not equations.has_newton_blocks:
        links = None if members is None else tuple(link for link, _ in members)
        return closed_form_stages(design, links, rates, grid.u)
    if reference.mechanism.stops:
        raise UnsupportedOperation("stops are looked for where all groups are in closed form")
    if grid.lead or reference.candidates.counts_turns:
        raise UnsupportedOperation("a group that is not in closed form starts where the file has it, turns or not")
    return newton_stages(reference, design, members or (), rates, grid.u)


def find_positions(reference: ReferenceDesign, positions: Array) -> RunPositions:
    """All positions of a run over those of its input (rad or m)."""
    u = reference.design_rows({}, 1).u
    running = reference.running_index
    run = positions / float(reference.input_scale[running])
    own = float(u[running, 0])
    every = ceil(np.max(np.abs(np.diff(run))) / FINE_STEP)
    # as many of every kind that the lanes of blocks solved by Newton's method have enough of them too
    every = max(every, ceil(LEAST_STEPS / (len(run) - 1)))
    run = np.interp(np.arange(every * (len(run) - 1) + 1) / every, np.arange(len(run)), run)
    lead = ceil(abs(run[0] - own) / LEAD_IN_STEP)
    lead_in = own + (run[0] - own) * np.arange(lead) / max(lead, 1)
    inputs = np.repeat(u.T, lead + len(run), axis=0)
    inputs[:, running] = np.concatenate([lead_in, run])
    return RunPositions(inputs, lead, every)
