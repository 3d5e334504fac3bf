"""The formulas of linkages of pinned bars in the places of their pins: derived from the blocks that bars make."""

from __future__ import annotations

from collections.abc import Sequence
from enum import IntEnum
from functools import lru_cache

import casadi as ca

from planar.batch.mechanisms.block_type import (
    FRAME_BODY,
    BlockPair,
    BlockSignature,
    BlockType,
    FormulaBuilder,
    SymbolicAssembly,
    find_block_type,
)
from planar.batch.mechanisms.tape_runs import POINT_ROWS, TABLE_COS, TABLE_SIN
from planar.codegen.block_formula import BlockFormula, FormulaInput, simplify_formula
from planar.codegen.instructions import CosSin
from planar.codegen.tape import TapeFormula
from planar.equations.generic_evaluation import inline_function
from planar.equations.linear import solve_by_determinants
from planar.equations.rates import UnknownRates, first_and_second_rates
from planar.foundation.geometry import Frame, Vector
from planar.foundation.instruction_list import InstructionList, required_values
from planar.model.pin_linkage import turning_pair_type


class PinStep(IntEnum):
    """How a pin is placed: on the crank; as the pin between two bars whose others are known; on a bar through two
    pins. Of those the second may be one of the frame."""

    CRANK = 0
    DYAD = 1
    DYAD_ON_FRAME = 2
    CARRIED = 3
    CARRIED_ON_FRAME = 4


NUMBERS = 6
"""Numbers of a step at most. Of a crank: where it is on the frame, the pin from there as it stands (m), velocity and
acceleration. Of a dyad: the lengths of its bars (m), its sign, one by the linkage's size. Of a pin on a bar: where it
is, in parts of the way from the first pin to the second. Then the second pin (m) where that is on the frame."""
_FRAME_PIN = {PinStep.DYAD_ON_FRAME: 4, PinStep.CARRIED_ON_FRAME: 2}


@lru_cache
def pin_formulas(rates: bool, polished: bool) -> tuple[TapeFormula, ...]:
    """The formulas of all steps, which take two pins and write the third. `polished`: closed forms are followed by a
    step of Newton's method."""
    many = POINT_ROWS[rates]
    rows = tuple((2, row) for row in range(many))
    made = [TapeFormula(_crank_formula(rates), rows)]
    for step in (PinStep.DYAD, PinStep.DYAD_ON_FRAME):
        directions = (many, many + 1), (many + 2, many + 3)
        made.append(TapeFormula(_dyad_formula(step, rates, polished), rows, directions, is_checked=True))
    for step in (PinStep.CARRIED, PinStep.CARRIED_ON_FRAME):
        made.append(TapeFormula(_carried_formula(step, rates), rows))
    return tuple(each._replace(formula=simplify_formula(each.formula)) for each in made)


@lru_cache
def crank_and_dyad_types() -> tuple[BlockType, BlockType]:
    """The crank, and the dyad of two bars."""
    pin = turning_pair_type()
    dyad = (BlockPair(pin, (0, -1), False), BlockPair(pin, (1, -2), False), BlockPair(pin, (0, 1), False))
    return find_block_type(BlockSignature(1, 0, (BlockPair(pin, (FRAME_BODY, 0), True),))), find_block_type(
        BlockSignature(2, 2, dyad)
    )


class _PinFormulaBuilder(FormulaBuilder):
    """The formulas of a block whose given links are known by a pin alone, and whose bars lie along two pins."""

    def known_pin(self, slot: int, place: int | None) -> None:
        """A link that is given by one of its pins, about which it need not turn; `place`: that of its numbers, where
        it is on the frame."""
        none, angle = self.instructions.add_constant(0.0), self.add_input("angle", slot)
        self.cos_sin[angle] = CosSin(self.instructions.add_constant(1.0), none)
        if place is not None:
            self.u += [self.add_input("p", place), self.add_input("p", place + 1), angle]
            self.u1 += [none] * 3
            self.u2 += [none] * 3
            return
        rows = [self.add_input("row", slot, row) for row in range(6)]
        for own, (x, y), turn in zip((self.u, self.u1, self.u2), (rows[:2], rows[2:4], rows[4:]), (angle, none, none),
                                     strict=True):  # fmt: skip
            own += [x, y, turn]

    def clear_inputs(self) -> None:
        """Nothing is given yet."""
        self.u, self.u1, self.u2, self.p, self.cos_sin = [], [], [], [], {}

    def point_rows(self, way: SymbolicAssembly, local: Sequence[ca.SX], rates: bool, more: Sequence[list[int]] = (),
                   symbols: Sequence[ca.SX] = ()) -> list[int]:  # fmt: skip
        """x and y of a point of the first inner link, then of its rates."""
        e, (u1, u2) = self.equations, self.symbols[2:]
        frames, _ = self._inner_frames()
        x, y, *_ = frames[self.block_equations.inner_links[0]].to_world(Vector(*local))
        point = ca.vertcat(ca.SX(x), ca.SX(y))
        wanted: list[ca.SX] = [point]
        if rates:
            z1, z2 = UnknownRates(e, solve_by_determinants).first_and_second(u1, u2)
            wanted += first_and_second_rates(point, e.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))
        return self._inline(symbols, wanted, way.z, more)


def _crank_formula(rates: bool) -> BlockFormula:
    work = _PinFormulaBuilder(crank_and_dyad_types()[0])
    work.clear_inputs()
    none, (at, own, (velocity, acceleration)) = work.instructions.add_constant(0.0), _pairs(work, 3)
    angle = work.add_input("angle", 0)
    work.cos_sin[angle] = CosSin(work.add_input("row", 0, TABLE_COS), work.add_input("row", 0, TABLE_SIN))
    work.u, work.u1, work.u2, work.p = [angle], [velocity], [acceleration], [*at, none, none]
    local = ca.SX.sym("local", 2)
    way = work.closed_form_assembly([])
    return work.make_formula(work.point_rows(way, ca.vertsplit(local), rates, [own], [local]))


def _pairs(work: FormulaBuilder, count: int) -> list[list[int]]:
    return [[work.add_input("p", 2 * k), work.add_input("p", 2 * k + 1)] for k in range(count)]


def _dyad_formula(step: PinStep, rates: bool, polished: bool) -> BlockFormula:
    """Rows of the pin between two bars, cosines and sines of these, what is left open, and how clear they are of where
    two ways to assemble them meet."""
    work = _PinFormulaBuilder(crank_and_dyad_types()[1])
    work.clear_inputs()
    work.known_pin(0, None)
    work.known_pin(1, _FRAME_PIN.get(step))
    none, add = work.instructions.add_constant(0.0), work.instructions.add
    first, second, sign, per_size = (work.add_input("p", k) for k in range(4))
    # of each pair the pin in the first of its links, and in the second: bars lie along their own x-axes
    work.p = [*[none] * 8, first, none, second, none]
    way = work.closed_form_assembly([sign], polished)
    poses = work.poses(way)
    rows = work.point_rows(way, ca.vertsplit(work.equations.p[8:10]), rates)
    residuals = work.residuals(way, poses)
    lengths = len(residuals) - len(way.cos_sin)
    left = none
    for gap in residuals[:lengths]:
        left = add("add", left, add("abs", gap))
    left = add("mul", left, per_size)
    for gap in residuals[lengths:]:
        left = add("add", left, add("abs", gap))
    clear = add("sub", work.instructions.add_constant(1.0), way.bends[0])
    directions = [part for pose in poses for part in pose[2:]]
    return work.make_formula([*rows, *directions, left, clear])


def _carried_formula(step: PinStep, rates: bool) -> BlockFormula:
    """Rows of a pin on a bar, from those of two others: linear in these, and so are its rates."""
    listing: InstructionList[FormulaInput] = InstructionList()
    place = _FRAME_PIN.get(step)
    parts = [listing.add_input(FormulaInput("p", k)) for k in range(2)]
    p, q, local = (ca.SX.sym(name, 2) for name in "pql")
    way = q - p
    point = Frame(p[0], p[1], way[0], way[1], ca.SX(0.0)).to_world(Vector(local[0], local[1]))
    function = ca.Function("carried", [p, q, local], [ca.vertcat(*point)], {"cse": True})
    wanted: list[int] = []
    for order in range(3 if rates else 1):
        one = [listing.add_input(FormulaInput("row", 0, 2 * order + k)) for k in range(2)]
        if place is None:
            two = [listing.add_input(FormulaInput("row", 1, 2 * order + k)) for k in range(2)]
        elif order:
            two = [listing.add_constant(0.0)] * 2
        else:
            two = [listing.add_input(FormulaInput("p", place + k)) for k in range(2)]
        wanted += inline_function(listing, function, [one, two, parts])[0]
    leaves = {k: key for k in required_values(listing, wanted) if (key := listing.instructions[k].key) is not None}
    return BlockFormula(listing, tuple(wanted), leaves)
