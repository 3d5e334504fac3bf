"""Block types: links that are solved together from others whose poses are known, and the functions that solve them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import lru_cache
from itertools import product
from math import inf
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.kernel import BareAngle, KernelBlock, KernelEquations
from planar.batch.march.kernel_writer import (
    KernelWriter,
    OperandNames,
    write_nearest,
    write_normalised,
    write_rational_rotation,
    write_residual_sum,
)
from planar.batch.march.prediction import LEAST_COSINE, TABLE_COLUMNS
from planar.codegen.tape import LANES, BlockFormula, BlockText, FormulaInput, LinkDirection
from planar.equations.casadi_functions import inline_function
from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.linear import solve_by_determinants
from planar.equations.rates import block_jacobian, first_and_second_rates
from planar.equations.symbolic_equations import Block, ConstraintEquations, build_equations, slice_length
from planar.foundation.arrays import Array
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation
from planar.model.link_shapes import Link
from planar.model.mechanism import Input, Mechanism
from planar.model.pairs import MeasureKind as Measure
from planar.model.pairs import Pair

FRAME_BODY = -99
"""The body of a signature that is the mechanism's frame."""
X, Y, COS, SIN, X1, Y1, TURN1, X2, Y2, TURN2 = range(10)
"""Rows of a slot: where a link is, then its rates. Of an input X is its position, X1 and X2 its rates."""
POSE_ROWS = 4
"""Rows of a slot that are a link's place: x, y, cos and sin."""
SKETCH_SUMS = 8
"""Numbers of a link's points in the sketch: how many, their sums in the link and in the world, and mixed ones."""


class BlockPair(NamedTuple):
    """A pair of a block type: its pair type, its bodies (inner links 0, 1, ..., given ones -1, -2, ...), and whether it
    is driven."""

    type: type[Pair]
    bodies: tuple[int, ...]
    driven: bool


class BlockSignature(NamedTuple):
    """What defines a block type: the counts of inner and given links, and the pairs in their order."""

    inner_count: int
    given_count: int
    pairs: tuple[BlockPair, ...]


class _SymbolicPair:
    """A pair between the links of a block type: the formulas of its pair type with other bodies."""

    def __init__(self, name: str, joint: BlockPair):
        like = _sample_pair(joint.type)
        self.name, self.bodies = name, tuple(_body_name(body) for body in joint.bodies)
        self.residual_kinds, self.number_kinds = like.residual_kinds, like.number_kinds
        self.coordinate_kinds, self.input_kind = like.coordinate_kinds, like.input_kind
        self.residual, self.input_position = like.residual, like.input_position

    def entry_name(self) -> str:
        return self.name

    @classmethod
    def relative_motions(cls, group: Sequence[_SymbolicPair]) -> tuple[_SymbolicPair, ...]:
        return tuple(group)


def _body_name(body: int) -> str:
    return "frame" if body == FRAME_BODY else f"inner{body}" if body >= 0 else f"given{-1 - body}"


MAX_SIGNS = 2
"""Maximum number of signs of a block type in closed form."""
MAX_BLOCK_TYPES = 1024
"""Number of block types that are kept."""
JUDGED_ROWS = 4
"""Number of rows after the signs in the result of `BlockType.start_function`."""


class BlockType:
    """One type of block: its equations, in closed form where there is one, and the functions that solve it.

    Slots are the given links, the inputs, then the inner links. Numbers are p of the pairs, the cosine and sine of
    those that are angles, then a sign for each group of equations that has two assembly modes; at the start, in place
    of the signs, the sums of the points in the sketch, see `_sketch_sums` of the initial assembly. Without closed form
    the unknowns to start from stand in place of the signs, cosine and sine of an angle, a length and 0, and after the
    slots there is one of the `step_table`.
    """

    def __init__(self, signature: BlockSignature):
        pairs = tuple(_SymbolicPair(f"p{k}", pair) for k, pair in enumerate(signature.pairs))
        self.given_links = tuple(_body_name(-1 - k) for k in range(signature.given_count))
        self.inner_links = tuple(_body_name(k) for k in range(signature.inner_count))
        inputs = tuple(Input(p.name, 0.0) for p, joint in zip(pairs, signature.pairs, strict=True) if joint.driven)
        links = tuple(Link(name) for name in ("frame", *self.inner_links, *self.given_links))
        self.mechanism = Mechanism("", "frame", links, pairs, inputs)  # type: ignore[arg-type]  # pairs by formula
        e = self.equations = build_equations(self.mechanism, self.given_links)
        self.input_count = len(inputs)
        self.slot_count = len(self.given_links) + self.input_count + len(self.inner_links)
        measures = [measure for pair in pairs for measure in pair.number_kinds]
        self.angle_measures = tuple(k for k, measure in enumerate(measures) if measure is Measure.ANGLE)
        self.length_measures = tuple(k for k, measure in enumerate(measures) if measure is Measure.LENGTH)
        self.measure_count, self.number_count = len(measures), len(measures) + 2 * len(self.angle_measures)
        "how many numbers of its pairs it takes: without, and with the cosine and sine of angles"
        self.unknown_is_angle = tuple(e.coordinates[column].kind is not Measure.LENGTH for column in e.unknowns)
        self.is_square = e.is_square
        stages = [stage for stage in e.blocks if slice_length(stage.unknowns)]
        blocks = [KernelBlock(stage, find_closed_form(e, stage) or linear_form(e, stage)) for stage in stages]
        forms = [block.closed_form for block in blocks if block.closed_form is not None]
        self.sign_count = sum(form.sign.numel() for form in forms)
        "how many blocks of its equations have two assembly modes"
        self._texts: dict[tuple[bool, bool] | None, BlockText] = {}
        has_forms = len(forms) == len(blocks) and self.sign_count <= MAX_SIGNS
        self.has_closed_form = has_forms and self._can_be_written(blocks, None)
        "whether all unknowns are in closed form, by functions that can be compiled"
        size = slice(0, e.z.numel())
        together = KernelBlock(Block(size, size, self.inner_links, (), False, 0), None)
        # the run with rates has all instructions of the one without
        self.has_newton_functions = not self.has_closed_form and self._can_be_written([together], (True, False))
        "whether Newton's method can follow it, where it is not in closed form"

    def _can_be_written(self, blocks: Sequence[KernelBlock], option: tuple[bool, bool] | None) -> bool:
        """Whether the function of an option, see `_write`, can be written with the equations in these blocks."""
        if not self.is_square:
            return False
        given = self.given_links
        self.kernel = KernelEquations(
            self.equations, self.mechanism, given_links=given, blocks=tuple(blocks), turns_numbers=True
        )
        try:
            self._write(option)
        except (UnsupportedOperation, BareAngle):
            return False
        return True

    def _write(self, option: tuple[bool, bool] | None) -> BlockText:
        """The text of the start (None), or of the run with or without rates, polished or not."""
        if option not in self._texts:
            writer = _BlockTypeWriter(self, 1 if self.kernel.has_newton_blocks else LANES)
            if option is None:
                writer.write_start()
            elif self.kernel.has_newton_blocks:
                writer.write_newton_run(option[0])
            else:
                writer.write_run(*option)
            self._texts[option] = writer.text
        return self._texts[option]

    @property
    def start_function(self) -> Any:
        """(given links and inputs, numbers with sums of the sketch) -> of the assembly mode nearest to the sketch x, y,
        cos and sin of the inner links; then in a slot behind them its signs, its squared distance, that of the next
        mode, its residual, and the least distance measure of any mode from a dead point."""
        return self._write(None).function

    def run_function(self, rates: bool, polished: bool = False) -> Any:
        """(given links and inputs, numbers) -> rows of the inner links; checked, see `BlockText`."""
        return self._write((rates, polished and self.has_closed_form)).function


def linear_form(e: ConstraintEquations, stage: Block) -> ClosedForm | None:
    """The only assembly, without a sign, of one or two lengths whose constraints are linear in them; else None."""
    count = slice_length(stage.unknowns)
    are_lengths = all(e.coordinates[column].kind is Measure.LENGTH for column in e.unknowns[stage.unknowns])
    if stage.is_free or count != slice_length(stage.rows) or count > 2 or not are_lengths:
        return None
    rows, unknowns = e.F[stage.rows], e.z[stage.unknowns]
    jacobian = ca.densify(ca.jacobian(rows, unknowns))
    if any(e.rows[row].kind is Measure.ANGLE for row in range(stage.rows.start, stage.rows.stop)):
        return None
    if ca.jacobian_sparsity(jacobian, unknowns).nnz():
        return None
    values = -solve_by_determinants(jacobian, ca.substitute(rows, unknowns, ca.SX.zeros(count)))
    lengths = ca.vertcat(*(ca.sumsqr(column) for column in ca.horzsplit(jacobian)))
    coalescence = ca.SX(0.0)
    if count == 2:
        det = jacobian[0, 0] * jacobian[1, 1] - jacobian[0, 1] * jacobian[1, 0]
        coalescence = 1.0 - det * det / (lengths[0] * lengths[1])
    no_sign = ca.SX(0, 1)
    return ClosedForm(tuple((value,) for value in ca.vertsplit(values)), no_sign, no_sign, coalescence, lengths)


FAR_AWAY = 1e300
"""A squared distance, greater than any residual of an assembly."""


class _BlockTypeWriter(KernelWriter):
    """Writes the functions of a block type."""

    def __init__(self, block_type: BlockType, lanes: int):
        super().__init__(block_type.kernel, (), False, lanes, frozenset({"p", "pc", "ps"}))
        self.block_type, self.text = block_type, BlockText(self.ir)
        first = block_type.slot_count - len(block_type.inner_links)
        self.inner_slots = range(first, block_type.slot_count)

    def coalescence(self, form: ClosedForm) -> ca.SX:
        """How near the two assemblies of a closed form are to where they meet."""
        return form.coalescence

    def write_run(self, rates: bool, polished: bool) -> None:
        """The run in closed form; `polished` by a step of Newton's method."""
        self.text.begin_steps(len(self.inner_slots))
        first = self.block_type.number_count
        signs = {("sign", k): self.text.number(first + k) for k in range(self.block_type.sign_count)}
        names = self._load_operands(rates) | signs
        clear = self._write_closed_forms(names, polished)
        rows, residual = self._write_links(names, rates)
        self._end_run(rows, self.ir.compare("ole", residual, self.text.tolerance), clear)

    def write_newton_run(self, rates: bool) -> None:
        """The run by Newton's method, all unknowns together, step after step."""
        t, text, first = self.ir, self.text, self.block_type.number_count
        (part,) = self.equations.blocks
        self.allocate_newton_state(self.state_operands())
        self.allocate_linear_systems()
        self.regularity_slot = t.allocate()
        self.store_start({leaf: text.number(first + 2 * leaf[1] + (leaf[0] == "zs")) for leaf in self.state_slots})
        text.begin_steps(len(self.inner_slots))
        names = self._load_operands(rates)
        row = t.double_pointer(text.slot(self.block_type.slot_count), t.add_instruction(f"mul i64 %k, {TABLE_COLUMNS}"))
        t.store(t.constant(1.0), self.regularity_slot)
        self.begin_newton_step(row)
        self.write_newton_block(part, names)
        rows, residual = self._write_links(names, rates)
        is_good = t.and_flags(t.compare("ole", residual, text.tolerance), self.write_is_as_predicted())
        self._end_run(rows, is_good, t.load(self.regularity_slot))
        if self.linear_systems is not None:
            t.write_line(self.linear_systems.function_text)

    def write_rotation(self, cos: str, sin: str, angle: str) -> tuple[str, str]:
        """The cos and sin of an angle that Newton's method turns, at the start by much."""
        # back onto the circle, which rounding leaves
        return write_normalised(self.ir, *write_rational_rotation(self.ir, cos, sin, angle))

    def _end_run(self, rows: list[list[str]], is_good: str, clear: str) -> None:
        """Store the rows of the inner links, and judge the steps."""
        self._store_links(rows)
        directions = [LinkDirection(row[COS], row[SIN], None) for row in rows]
        self.text.end_checked_steps(is_good, directions, clear, LEAST_COSINE)

    def _store_links(self, rows: list[list[str]]) -> None:
        for slot, row in zip(self.inner_slots, rows, strict=True):
            self.text.store_rows(row, [(slot, k) for k in range(len(row))])

    def _load_operands(self, rates: bool) -> OperandNames:
        """Load the poses of the given links, the inputs, with their rates, and the numbers of the pairs."""
        text, kind, names = self.text, self.block_type, OperandNames()
        given = 3 * len(kind.given_links)
        for k, is_angle in enumerate(self.equations.input_is_angle):
            slot, part = divmod(k, 3) if k < given else (len(kind.given_links) + k - given, 0)
            if part < 2:
                names["u", k] = text.load_row(slot, part)
            if is_angle:
                names["uc", k], names["us", k] = (text.load_row(slot, row) for row in (COS, SIN))
            if rates:
                names["u1", k], names["u2", k] = (text.load_row(slot, row + part) for row in (X1, X2))
        names |= {("p", k): text.number(k) for k in range(kind.measure_count)}
        for place, k in enumerate(kind.angle_measures):
            first = kind.measure_count + 2 * place
            names["pc", k], names["ps", k] = text.number(first), text.number(first + 1)
        return names

    def _write_closed_forms(self, names: OperandNames, polished: bool = False) -> str:
        """The unknowns, block after block, put into `names`; the least distance measure from a dead point."""
        t, e = self.ir, self.equations.equations
        clear = t.constant(1.0)
        for part in self.equations.blocks:
            distance = t.binary("sub", t.constant(1.0), self.write_closed_form(part, names))
            clear = t.call_intrinsic("minnum", clear, distance)
            if polished:
                turning = [k for k in part.unknowns if self.equations.is_angle[k]]
                for k in turning:
                    c, s = names["zc", k], names["zs", k]
                    square = t.binary("add", t.binary("mul", c, c), t.binary("mul", s, s))
                    size = t.call_intrinsic("sqrt", square)
                    names["zc", k], names["zs", k] = t.binary("div", c, size), t.binary("div", s, size)
                jacobian = block_jacobian(e, part.block.rows, part.block.unknowns)
                steps = self.write_values([solve_by_determinants(jacobian, e.F[part.block.rows])], names)
                for k, step in zip(part.unknowns, steps, strict=True):
                    if k in turning:
                        back = t.add_instruction(f"fneg {t.vector} {step}")
                        both = write_rational_rotation(t, names["zc", k], names["zs", k], back)
                        names["zc", k], names["zs", k] = both
                    else:
                        names["z", k] = t.binary("sub", names["z", k], step)
        return clear

    def _write_links(self, names: OperandNames, rates: bool = False) -> tuple[list[list[str]], str]:
        """The rows of the inner links: their poses, each followed by its rates if they are wanted: x', y', angle', then
        the second ones; and the sum of the residuals."""
        t, e, s, links = self.ir, self.equations.equations, self.symbols, self.block_type.inner_links
        poses = ca.vertcat(*(ca.SX(part) for link in links for part in self.equations.frames[link][:POSE_ROWS]))
        outputs: list[ca.SX] = [self.equations.residuals(), poses]
        if rates:
            z1, z2 = self.equations.rates(s["u1"], s["u2"])
            y1, y2 = ca.vertcat(z1, s["u1"]), ca.vertcat(z2, s["u2"])
            outputs += first_and_second_rates(e.w[: 3 * len(links)], e.y, y1, y2)
        residuals, *orders = self.write_separately(outputs, names)
        rows = [
            [value for k, order in enumerate(orders) for value in _part_of(order, link, 3 if k else POSE_ROWS)]
            for link in range(len(links))
        ]
        return rows, write_residual_sum(t, [*residuals, *self.write_circle_residuals(names)])

    def write_start(self) -> None:
        """The start: all assembly modes, and of them the nearest to the sketch."""
        t, text, kind = self.ir, self.text, self.block_type
        text.begin_steps()
        operands, count = self._load_operands(False), len(self.inner_slots)
        sum_names = {("sum", k): text.number(kind.number_count + k) for k in range(SKETCH_SUMS * count)}
        poses, sums = (ca.SX.sym(name, size * count) for name, size in (("pose", POSE_ROWS), ("sum", SKETCH_SUMS)))
        self.symbols |= {"pose": poses, "sum": sums}
        links = zip(ca.vertsplit(poses, POSE_ROWS), ca.vertsplit(sums, SKETCH_SUMS), strict=True)
        squared_distance = sum(squared_sketch_distance(*map(ca.vertsplit, link)) for link in links)
        far, least_clear = t.constant(FAR_AWAY), t.constant(inf)
        options = []
        for signs in product((1.0, -1.0), repeat=kind.sign_count):
            sign_names = {("sign", k): t.constant(sign) for k, sign in enumerate(signs)}
            names: OperandNames = operands | sign_names
            clear = self._write_closed_forms(names)
            rows, residual = self._write_links(names)
            values = [value for row in rows for value in row]
            pose_names = {("pose", k): value for k, value in enumerate(values)}
            (distance,) = self.write_values([squared_distance], pose_names | sum_names)
            # a mode that cannot be assembled is far away
            distance = t.select(t.compare("olt", residual, far), distance, far)
            options.append(([*values, *sign_names.values(), residual], distance))
            least_clear = t.call_intrinsic("minnum", least_clear, t.call_intrinsic("fabs", clear))
        places = [(slot, row) for slot in self.inner_slots for row in range(POSE_ROWS)]
        places += [(kind.slot_count, k) for k in range(kind.sign_count + JUDGED_ROWS)]
        (*outputs, residual), nearest, second = write_nearest(t, options)
        text.store_rows([*outputs, nearest, second, residual, least_clear], places)
        text.end_steps()


def squared_sketch_distance(pose: Iterable[Any], sums: Iterable[Any]) -> Any:
    """The squared distance of the points of a link to the sketch, by x, y, cos and sin, from the sums of its points."""
    (x, y, c, s), (count, px, py, tx, ty, along, across, squares) = pose, sums
    mixed = x * (c * px - s * py - tx) + y * (s * px + c * py - ty) - c * along - s * across
    return count * (x * x + y * y) + 2.0 * mixed + squares


def _part_of(values: Sequence[str], index: int, size: int) -> Sequence[str]:
    return values[size * index : size * (index + 1)]


def newton_numbers(block_type: BlockType, p: Array, start: Array) -> Array:
    """The numbers of blocks without closed form: p (blocks, numbers) and unknowns to start from (blocks, unknowns)."""
    is_angle = block_type.unknown_is_angle
    both = np.stack([np.where(is_angle, np.cos(start), start), np.where(is_angle, np.sin(start), 0.0)], axis=2)
    return np.hstack([p, both.reshape(len(p), -1)])


@lru_cache(maxsize=MAX_BLOCK_TYPES)
def find_block_type(signature: BlockSignature) -> BlockType:
    """The block type of a signature; equal signatures have the same."""
    return BlockType(signature)


@lru_cache
def _sample_pair(type_: type[Pair]) -> Pair:
    return type_.samples()[0].pair


def write_formula(inputs: Sequence[Sequence[FormulaInput]], write: Callable[..., Sequence[ca.SX]]) -> BlockFormula:
    """The formula of what `write` returns for groups of inputs, each a column."""
    listing: InstructionList[FormulaInput] = InstructionList()
    symbols = [ca.SX.sym(f"of{k}", len(group)) for k, group in enumerate(inputs)]
    function = ca.Function("written", symbols, [ca.densify(ca.vertcat(*write(*symbols)))], {"cse": True})
    (outputs,) = inline_function(listing, function, [[listing.add_input(leaf) for leaf in group] for group in inputs])
    return BlockFormula(listing, outputs)
