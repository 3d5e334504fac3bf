"""One linkage's runs as one compiled function: values of a design in, positions and rates out."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import ceil
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from planar.batch.block import LEAD_IN_STEP
from planar.batch.design_arrays import read_designs
from planar.batch.march.kernel import Operand
from planar.batch.prepare.design_numbers import NUMBERS_FUNCTION, SAID, DesignNumbers, compiled_variables, write_numbers
from planar.batch.prepare.llvm_positions import LANES, POSITIONS_FUNCTION, PositionRows, write_positions
from planar.batch.prepare.llvm_start import START_FUNCTION, write_start
from planar.batch.prepare.run_calls import (
    ALL_SOLVED,
    DEAD_POINT,
    MAX_BOUND_NAMES,
    STOP,
    UNSURE,
    RunCall,
    ValueBinder,
    address_of,
)
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.llvm_compile import compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.foundation.instruction_list import UnsupportedOperation
from planar.model.link_shapes import PointMember
from planar.model.mechanism import LARGEST_INPUT_POSITION
from planar.model.pairs.base import Pair

if TYPE_CHECKING:
    from planar.batch.prepare.newton_run import NewtonRun

Array = np.ndarray

FUNCTION_NAME = "run"
ARGUMENT_TYPES = ("array",) * 4
"""Of the function's arguments: what does not change from call to call; places of values that are given, these; out."""
CONTEXT = ("own values", "drive", "blocks", "positions")
"""What does not change, each of eight bytes: addresses and whole numbers."""


class RunLayout(NamedTuple):
    """The text of the function `run`, what it writes, and of what the rows of given inputs are cos, sin and value."""

    ir: str
    rows: PositionRows
    inputs: tuple[Operand, ...]


def write_run(design: DesignNumbers, links: tuple[str, ...], rates: bool, states: bool = False) -> RunLayout:
    """The function for points on these links, or for the states. Raises UnsupportedOperation."""
    equations = design.equations("q")
    signs = [("sign", k) for k in range(len(equations.closed_forms))]
    order: list[Operand] = [*design.numbers, SAID, *signs]
    positions = write_positions(equations, links, rates, order, states)
    numbers, start = write_numbers(design, order), write_start(design.equations("at"), design.sketched, order)
    t = IRWriter(1)
    t.write_line(f"define void @{FUNCTION_NAME}(ptr %context, ptr %places, ptr %given, ptr %out) {{")
    t.write_label("entry")
    own, drive, blocks, many = (
        t.add_instruction(f"load {kind}, ptr {t.double_pointer('%context', str(k))}")
        for k, kind in enumerate(("ptr", "ptr", "i64", "i64"))
    )
    t.write_line(f"%numbers = alloca [{len(order)} x double], align 64")
    t.write_line(f"call void @{NUMBERS_FUNCTION}(ptr {own}, ptr %places, ptr %given, ptr %numbers)")
    said_row = t.add_instruction(f"mul i64 {blocks}, {LANES * positions.rows.row_count}")
    ending = t.double_pointer("%out", said_row)
    said = t.double_pointer("%numbers", str(order.index(SAID)))
    fit = t.add_instruction(f"load double, ptr {said}")
    t.write_line(f"store double {fit}, ptr {ending}")
    t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {fit}, {ALL_SOLVED}')}, label %fits, label %ends")
    t.write_label("fits")
    t.write_line(f"call void @{START_FUNCTION}(ptr %numbers)")
    begins = t.add_instruction(f"load double, ptr {said}")
    t.write_line(f"store double {begins}, ptr {ending}")
    t.write_line(f"br i1 {t.add_instruction(f'fcmp oeq double {begins}, {ALL_SOLVED}')}, label %begins, label %ends")
    t.write_label("begins")
    t.write_line(
        f"call void @{POSITIONS_FUNCTION}(i64 {blocks}, i64 {many}, ptr %numbers, ptr {drive}, ptr %out, ptr {ending})"
    )
    t.write_line("ret void")
    t.write_label("ends")
    t.write_line("ret void")
    t.write_line("}")
    return RunLayout(t.module_text(numbers, start, *positions.writers), positions.rows, positions.inputs)


class CompiledRun:
    """The function ready to be called, always over the same positions of the inputs; from any thread.

    Raises UnsupportedOperation.
    """

    def __init__(self, design: DesignNumbers, links: tuple[str, ...], rates: bool, u: Array, states: bool = False):
        """u (positions, inputs): where the inputs are of a design that has them where the file has them.

        With `states` the rows are what stands for the unknowns, and not those of points.
        """
        if len(u) < 3:
            raise UnsupportedOperation("two positions do not show what lies between them")
        layout = write_run(design, links, rates, states)
        self._function: Any = compile_function(layout.ir, FUNCTION_NAME, *ARGUMENT_TYPES)
        blocks = -(-len(u) // LANES)
        width = blocks * LANES
        # those that do not fill the lanes are the last again
        whole = np.concatenate([u, np.repeat(u[-1:], width - len(u), axis=0)]).T
        turned = {"c": np.cos, "s": np.sin}
        self._drive = np.array([turned.get(name[1:], np.positive)(whole[k]) for name, k in layout.inputs])
        self._own = design.own_values
        self._context = np.array([self._own.ctypes.data, self._drive.ctypes.data, blocks, len(u)], dtype=np.int64)
        self._context_pointer = self._context.ctypes.data
        self._shape = layout.rows.row_count + 1, width
        self._told, self._positions, self._ending = layout.rows.told, len(u), layout.rows.row_count * width
        binder = ValueBinder(design.index)
        self.bind, self.bound = binder.bind, binder.bound

    def __call__(self, values: Mapping[str, float]) -> tuple[Array, float, int]:
        """See `native_run.NativeRun`."""
        names = tuple(values)
        pack, _, places = self.bound.get(names) or self.bind(names)
        out = np.empty(self._shape)
        self._function(self._context_pointer, places, pack(*values.values()), address_of(out))
        ending = out.item(self._ending)
        rows = out[: self._told, : self._positions]
        return rows, ending, int(out.item(self._ending + 1)) if ending in (DEAD_POINT, STOP) else 0

    def run_call(self) -> RunCall:
        """How other compiled code runs it."""
        rows, width = self._shape
        return RunCall(self._function, self._context_pointer, rows * width, None, self._ending, 0, width)


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
            rows = self._reference.design_rows(arrays, 1)
            if not rows.is_fit[0] or self._reference.is_unfit(arrays, rows.shapes)[0]:
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
    u = reference.design_rows({}, 1).u
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
