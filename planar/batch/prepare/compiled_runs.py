"""The runs of one linkage as compiled functions: values of a design in, positions and rates out.

A run has stages, LLVM functions one after the other; the first computes the numbers of a design.
"""

from __future__ import annotations

import ctypes
import struct
from collections import deque
from collections.abc import Callable, Mapping, Sequence
from math import ceil, prod
from sys import getrefcount
from typing import Any, NamedTuple, TypeVar

import casadi as ca
import numpy as np

from planar.batch.block import LEAD_IN_STEP
from planar.batch.design_arrays import read_designs
from planar.batch.general_path import OUTCOMES
from planar.batch.march.kernel import BareAngle, KernelEquations, Operand, operand_rows
from planar.batch.march.kernel_writer import OperandNames, write_angle_sum
from planar.batch.prepare.design_numbers import DesignNumbers, compiled_variables
from planar.batch.reference_design import ReferenceDesign
from planar.codegen.instructions import check_length
from planar.codegen.llvm_compile import allocate_aligned, compile_function
from planar.codegen.llvm_ir import IRWriter
from planar.equations.casadi_functions import inline_function
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import Outcome
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation, required_values
from planar.model.link_shapes import PointMember
from planar.model.mechanism import LARGEST_INPUT_POSITION
from planar.model.pairs.base import Pair

ALL_SOLVED, UNSURE, CANNOT_BE_ASSEMBLED, DEAD_POINT, STOP = 0.0, 1.0, 2.0, 3.0, 4.0
"""How a run ends: at its last position, unknown, at its start, at a dead point, or where a pair meets its stop."""
CLEARLY_OPEN = 1.0 + 1e-4
"""Coalescence of a block from which on it cannot be joined, and of a pair that is beyond its stop, despite rounding."""
STATUS_OF_ENDING = {
    CANNOT_BE_ASSEMBLED: OUTCOMES.index(Outcome.CANNOT_BE_ASSEMBLED),
    DEAD_POINT: OUTCOMES.index(Outcome.DEAD_POINT),
    STOP: OUTCOMES.index(Outcome.STOP),
}
"""The status of the positions from an ending on."""
REASONABLE_SIZES = (1e-99, 1e99)
"""Magnitudes of given values that are not zero; the general path refuses or solves others."""

LANES = 16
T = TypeVar("T")

RUN_FUNCTION, NUMBERS_STAGE = "run", "numbers"
RUN_ARGUMENTS = "ptr %context, ptr %places, ptr %given, ptr %scratch, ptr %out, ptr %weights"
"""The constants of a run, eight bytes each, see `RunStages`; how many values are given, and the place of each among
those of the file's design; these values; memory; rows that are written; and the weights of a gradient.

The first row of `out` begins with how the run ends and at which position; stages count all, a run those wanted.
"""
RUN_TYPES = ("array",) * 6
STAGE_ARGUMENTS = "ptr %context, ptr %places, ptr %given, ptr noalias %numbers, ptr noalias %scratch, ptr noalias %out"
"""The same with the numbers of the design. A stage writes how the run ends; the next one begins if all is solved."""
STAGE_CALL = "ptr %context, ptr %places, ptr %given, ptr %numbers, ptr %scratch, ptr %out"
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
MAX_KEPT_BYTES = 8_000_000
"""Memory for results that a compiled run keeps."""


class RunStages(NamedTuple):
    """The stages of a run after that of the numbers, which stand in `order`.

    `constants` by name: arrays, functions, runs, whole numbers, floats; the first are the values of the file's design,
    and "blocks" counts the vectors of positions in a row. `row_count` rows are written behind the first one, of which
    `result_count` are results; `scratch_size` numbers of memory are used.
    """

    names: tuple[str, ...]
    writers: tuple[IRWriter, ...]
    order: tuple[Operand, ...]
    constants: Mapping[str, Any]
    result_count: int
    row_count: int
    scratch_size: int = 0


class CompiledRun:
    """A run compiled with the constants of its stages.

    Behind the rows of the stages `out` has room for `more_rows`; `results` is the part of it that a call returns, at
    the `wanted` positions.
    """

    def __init__(
        self, design: DesignNumbers, stages: RunStages, wanted: range, t: IRWriter | None = None, more_rows: int = 0
    ):
        """`t` has the function; by default it calls the stages alone."""
        self._constants, self.index = stages.constants, design.index
        if t is None:
            t = IRWriter(1)
            begin_run(t, stages, wanted)
            end_run(t)
        self.text = t.module_text(write_numbers(design, stages.order), *stages.writers)
        self.function: Any = compile_function(self.text, RUN_FUNCTION, *RUN_TYPES)
        self._context = np.array([_eight_bytes(value) for value in stages.constants.values()], dtype=np.int64)
        self.context = self._context.ctypes.data
        self.shape = 1 + stages.row_count + more_rows, stages.constants["blocks"] * LANES
        self.scratch_size = stages.scratch_size
        self._scratch: deque[Array] = deque()
        self._outputs: deque[Output] = deque()
        self._max_outputs = max(1, MAX_KEPT_BYTES // (8 * prod(self.shape)))
        self.results: Any = slice(1, 1 + stages.result_count), slice(wanted.start, wanted.stop, wanted.step)
        if more_rows:
            self.results = slice(1 + stages.row_count, None)

    def __call__(self, places: int, values: bytes, weights: int) -> Array:
        """The rows of one design, see `RUN_ARGUMENTS`.

        The memory of an earlier result that nobody refers to is used again: new pages cost more than a run.
        """
        output = _take_kept(self._outputs, self._make_output)
        if getrefcount(output.rows) > UNUSED_REFERENCES:
            self._outputs.append(output)
            output = self._make_output()
        if self.scratch_size:
            scratch = _take_kept(self._scratch, lambda: allocate_aligned(1, 1, self.scratch_size))
            self.function(self.context, places, values, address_of(scratch), output.address, weights)
            self._scratch.append(scratch)
        else:
            self.function(self.context, places, values, 0, output.address, weights)
        if len(self._outputs) < self._max_outputs:
            self._outputs.append(output)
        return output.rows

    def _make_output(self) -> Output:
        rows = np.empty(self.shape)
        return Output(rows, rows.ctypes.data)


def _take_kept(kept: deque[T], make: Callable[[], T]) -> T:
    """One of the kept, no longer kept, or a new one; another thread may take the last one at any time."""
    try:
        return kept.popleft()
    except IndexError:
        return make()


class Output(NamedTuple):
    """Rows that a run writes, and their address."""

    rows: Array
    address: int


_unused = Output(np.empty(0), 0)
UNUSED_REFERENCES = getrefcount(_unused.rows)
"""References to rows that no result shares."""


def _eight_bytes(value: Any) -> int:
    """A constant as a whole number: an address of an array, a function or constants of a run, the bits of a float."""
    if isinstance(value, np.ndarray):
        return value.ctypes.data
    if isinstance(value, CompiledRun):
        return value.context
    if isinstance(value, float):
        return int(np.array(value).view(np.int64))
    return value if isinstance(value, int) else ctypes.cast(value, ctypes.c_void_p).value or 0


def padded_width(count: int) -> int:
    """The length of a row of `count` positions, rounded up to full vectors."""
    return -(-count // LANES) * LANES


def input_rows(operands: Sequence[Operand], u: Array) -> Array:
    """Inputs at positions u (positions, inputs) as rows of whole vectors; behind the last position it is repeated."""
    return operand_rows(operands, u[np.minimum(np.arange(padded_width(len(u))), len(u) - 1)].T)


def load_constant(t: IRWriter, constants: Mapping[str, Any], name: str) -> str:
    """One of the constants of a run: a pointer, a whole number or a float."""
    kind = "i64" if isinstance(constants[name], int) else "double" if isinstance(constants[name], float) else "ptr"
    place = t.add_instruction(f"getelementptr i64, ptr %context, i64 {[*constants].index(name)}")
    return t.add_instruction(f"load {kind}, ptr {place}")


def load_number(t: IRWriter, order: Sequence[Operand], operand: Operand) -> str:
    """One of the numbers of a design."""
    return t.add_instruction(f"load double, ptr {t.double_pointer('%numbers', str(order.index(operand)))}")


def load_numbers(t: IRWriter, order: Sequence[Operand], *kinds: str) -> OperandNames:
    """The numbers of a design of some kinds, in every lane."""
    return {operand: t.broadcast(load_number(t, order, operand)) for operand in order if operand[0] in kinds}


def write_shifted_inputs(
    t: IRWriter, equations: KernelEquations, inputs: OperandNames, shifts: OperandNames
) -> OperandNames:
    """The inputs of a design: those of the file's design, each shifted by as much as the design has it elsewhere."""
    shifted: OperandNames = {}
    for k, is_angle in enumerate(equations.input_is_angle):
        shifted["u", k] = t.binary("add", inputs["u", k], shifts["d", k])
        if is_angle:
            shifted["uc", k], shifted["us", k] = write_angle_sum(
                t, inputs["uc", k], inputs["us", k], shifts["dc", k], shifts["ds", k]
            )
    return shifted


def begin_run(t: IRWriter, stages: RunStages, wanted: range, sum_count: int = 0) -> None:
    """Begin the function that calls all stages while each goes well, and counts how many `wanted` positions are %good.

    A run that ends before the first of them is not sure. What follows is written for runs that are sure alone. There is
    room for `sum_count` numbers in `%sums`.
    """
    t.write_line(f"define void @{RUN_FUNCTION}({RUN_ARGUMENTS}) {{")
    t.write_label("entry")
    for array, size in (("numbers", len(stages.order)), ("sums", sum_count)):
        t.write_line(f"%{array} = alloca [{size} x double], align 64")

    def branch(value: float, label: str, otherwise: str) -> None:
        ending = t.add_instruction("load double, ptr %out")
        flag = t.add_instruction(f"fcmp oeq double {ending}, {value}")
        t.write_line(f"br i1 {flag}, label %{label}, label %{otherwise}")

    for stage in (NUMBERS_STAGE, *stages.names):
        t.write_line(f"call void @{stage}({STAGE_CALL})")
        branch(ALL_SOLVED, f"after_{stage}", "ended")
        t.write_label(f"after_{stage}")
    t.write_line("br label %solved")
    t.write_label("solved")
    t.write_line("br label %counted")
    t.write_label("ended")
    branch(CANNOT_BE_ASSEMBLED, "counted", "started")
    t.write_label("started")
    branch(UNSURE, "leave", "stopped")
    t.write_label("stopped")
    position = t.add_instruction(f"load double, ptr {t.double_pointer('%out', '1')}")
    t.write_line(f"%position = fptosi double {position} to i64")
    is_before = t.add_instruction(f"icmp sle i64 %position, {wanted.start}")
    t.write_line(f"%ahead = sub i64 %position, {wanted.start - wanted.step + 1}")
    t.write_line(f"%stop = sdiv i64 %ahead, {wanted.step}")
    t.write_line(f"br i1 {is_before}, label %unsure, label %counted")
    t.write_label("unsure")
    t.write_line(f"store double {UNSURE}, ptr %out")
    t.write_line("br label %leave")
    t.write_label("counted")
    t.write_line(f"%good = phi i64 [{len(wanted)}, %solved], [0, %ended], [%stop, %stopped]")
    good = t.add_instruction("sitofp i64 %good to double")
    t.write_line(f"store double {good}, ptr {t.double_pointer('%out', '1')}")


def end_run(t: IRWriter) -> None:
    """End the function."""
    t.write_line("br label %leave")
    t.write_label("leave")
    t.end_function()


def write_numbers(design: DesignNumbers, order: Sequence[Operand]) -> IRWriter:
    """The first stage: the numbers of a design in this order.

    All is well where all numbers are finite, the `margin` is not negative, and the magnitudes of given values are
    reasonable; a design with an `opening` cannot be assembled. Raises UnsupportedOperation.
    """
    t = IRWriter(1)
    t.write_line(f"define internal void @{NUMBERS_STAGE}({STAGE_ARGUMENTS}) {{")
    t.write_label("entry")
    values = t.double_pointer("%numbers", str(order.index(("value", 0))))
    are_reasonable = _write_design_values(t, values, design.symbols.numel())
    names = write_expressions(t, [*design.numbers.values(), *design.points], {values: design.symbols})
    zero = t.constant(0.0)
    # zero, or not a number where one of them is not finite
    products = [t.binary("mul", zero, name) for name in dict.fromkeys(names)]
    is_finite = t.compare("oeq", t.add_all([zero, *products]), zero)
    numbers = dict(zip(design.numbers, names, strict=False))
    is_fit = t.and_flags(t.and_flags(are_reasonable, is_finite), t.compare("oge", numbers["margin", 0], zero))
    is_open = t.and_flags(are_reasonable, t.compare("ogt", numbers["opening", 0], zero))
    refusal = t.select(is_open, t.constant(CANNOT_BE_ASSEMBLED), t.constant(UNSURE))
    t.store(t.select(is_fit, t.constant(ALL_SOLVED), refusal), "%out")
    for k, operand in enumerate(order):
        if operand in numbers:
            t.store(numbers[operand], t.double_pointer("%numbers", str(k)))
    t.end_function()
    t.write_line("declare void @llvm.memcpy.p0.p0.i64(ptr, ptr, i64, i1)")
    return t


def _write_design_values(t: IRWriter, values: str, size: int) -> str:
    """Write the values of a design: those of the file's design, and the given ones in their places.

    Return a flag that the magnitudes of the given ones are reasonable.
    """
    own = t.add_instruction("load ptr, ptr %context")
    t.write_line(f"call void @llvm.memcpy.p0.p0.i64(ptr {values}, ptr {own}, i64 {8 * size}, i1 false)")
    slot = t.allocate()
    t.store(t.constant(1.0), slot)
    t.write_line("%count = load i64, ptr %places")
    t.write_line("%any = icmp sgt i64 %count, 0")
    t.write_line("br i1 %any, label %value, label %known")
    t.write_label("value")
    t.write_line("%k = phi i64 [0, %entry], [%knext, %value]")
    number = t.load(t.double_pointer("%given", "%k"))
    after = t.add_instruction("add i64 %k, 1")
    place = t.add_instruction(f"getelementptr i64, ptr %places, i64 {after}")
    t.store(number, t.double_pointer(values, t.add_instruction(f"load i64, ptr {place}")))
    magnitude = t.call_intrinsic("fabs", number)
    minimum, maximum = (t.constant(bound) for bound in REASONABLE_SIZES)
    is_reasonable = t.and_flags(t.compare("oge", magnitude, minimum), t.compare("ole", magnitude, maximum))
    is_reasonable = t.or_flags(is_reasonable, t.compare("oeq", magnitude, t.constant(0.0)))
    t.store(t.select_or_zero(is_reasonable, t.load(slot)), slot)
    t.close_loop("k", "count", "value", "known")
    t.write_label("known")
    return t.compare("oeq", t.load(slot), t.constant(1.0))


def write_expressions(t: IRWriter, outputs: Sequence[ca.SX], inputs: Mapping[str, ca.SX]) -> list[str]:
    """Write expressions in symbols whose numbers stand behind these pointers. Raises UnsupportedOperation."""
    function = ca.Function("values", list(inputs.values()), [ca.densify(ca.vertcat(*outputs))], {"cse": True})
    check_length(function.n_instructions())
    listing: InstructionList[tuple[str, int]] = InstructionList()
    arguments = [[listing.add_input((base, k)) for k in range(symbols.numel())] for base, symbols in inputs.items()]
    [values] = inline_function(listing, function, arguments)
    order = required_values(listing, values)
    required = set(order)
    known = {
        number: t.load(t.double_pointer(base, str(k)))
        for base, numbers in zip(inputs, arguments, strict=True)
        for k, number in enumerate(numbers)
        if number in required
    }
    names: dict[int, str] = {}
    t.write_values(listing, order, names, known)
    return [names[value] for value in values]


_view = ctypes.c_char.from_buffer


def address_of(array: Array) -> int:
    """The address of an array: `array.ctypes.data` in a fifth of its time."""
    return ctypes.addressof(_view(array))  # type: ignore[arg-type]


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
        out = run(places, packed, weights)
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
