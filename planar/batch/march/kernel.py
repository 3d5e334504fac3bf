"""The parts of LLVM functions that solve positions: a mechanism's equations, printed block by block.

The angles' cos and sin are carried, never the angles. A block in closed form is computed by that; any other is solved
by Newton's method, whose step turns an angle by the first terms of its cos and sin; what is not quite of length one
then is brought to it. So no sine stands in the loop, and few divisions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.design_batch import DesignBatch
from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import EquationFunctions
from planar.equations.linear import solve_by_determinants
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.rates import UnknownRates
from planar.equations.residuals import (
    closing_error,
    residuals,
    scalars,
    split_pair_numbers,
)
from planar.equations.symbolic_equations import Block, ConstraintEquations, slice_length
from planar.foundation.geometry import frame_at
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind, Pair

Operand = tuple[str, int]
"""A number that the expressions take: which kind of it, and its index.

"z" of an unknown, "zc" and "zs" the cos and sin of an angle; "u", "uc", "us" the same of an input; "p" the numbers of
pairs ("pc", "ps" the cos and sin of one that is an angle, if an operand stands for these), "q" those of points, "stop"
those of stops; "u1", "u2" rates of inputs; "sign" of a block in closed form.
"""


MAX_EXPRESSION_UNKNOWNS = 8
"""Unknowns of a block that expressions solve; of larger ones these grow too long, and the numbers are solved."""


class BareAngle(Exception):
    """An angle stands outside cos and sin, so that its value has to be carried beside them."""

    def __init__(self, operand: Operand):
        super().__init__()
        self.operand = operand


class KernelBlock(NamedTuple):
    """A block, and its closed form if it has one."""

    block: Block
    closed_form: ClosedForm | None

    @property
    def unknowns(self) -> range:
        return range(self.block.unknowns.start, self.block.unknowns.stop)

    @property
    def is_large(self) -> bool:
        """Whether its systems are solved in numbers, not by expressions."""
        return len(self.unknowns) > MAX_EXPRESSION_UNKNOWNS


class KernelEquations:
    """A mechanism's equations with the blocks' closed forms. Raises UnsupportedOperation where a block holds itself
    twice.

    `zeros`: operands of kinds "p" and "q" that are zero in all designs, as most coordinates of pins in their links.
    `stop_pairs`: the pairs whose stops are checked. `given_links`: links whose places are the first inputs. `blocks`:
    by default those of the equations. `turns_numbers`: whether the numbers that are angles have operands for their cos
    and sin.
    """

    def __init__(
        self,
        equations: ConstraintEquations,
        mechanism: Mechanism,
        zeros: frozenset[Operand] = frozenset(),
        stop_pairs: tuple[Pair, ...] = (),
        given_links: tuple[str, ...] = (),
        blocks: tuple[KernelBlock, ...] | None = None,
        turns_numbers: bool = False,
    ):
        e = self.equations = equations
        if not e.is_square:
            raise UnsupportedOperation("constraints hold each other more than once")
        self.mechanism, self.zeros, self.stop_pairs = mechanism, zeros, stop_pairs
        if blocks is None:
            blocks = tuple(
                KernelBlock(block, find_closed_form(e, block)) for block in e.blocks if slice_length(block.unknowns)
            )
        self.blocks, self.given_links = blocks, given_links
        self.is_angle = tuple(e.coordinates[column].kind is MeasureKind.ANGLE for column in e.unknowns)
        self.input_is_angle = tuple(kind is MeasureKind.ANGLE for kind in e.input_kinds)
        kinds = [kind for pair in mechanism.pairs for kind in pair.number_kinds]
        self.number_is_angle = tuple(turns_numbers and kind is MeasureKind.ANGLE for kind in kinds)
        self.closed_forms = tuple(part.closed_form for part in self.blocks if part.closed_form is not None)
        self.has_newton_blocks = len(self.closed_forms) < len(self.blocks)
        self.has_large_blocks = any(part.is_large for part in self.blocks)
        self.newton_steps: dict[int, tuple[InstructionList[Operand], list[int]]] = {}
        "the listings of Newton's step by block, which a `KernelWriter` makes"
        self.sides = ca.vertcat(ca.SX(0, 1), *(form.sign_expression for form in self.closed_forms))
        self.frames, self.pair_coordinates = frames_from_coordinates(
            ca.vertsplit(e.w),
            coordinate_columns(e.coordinates),
            [link.name for link in mechanism.links if link.name not in given_links],
            {pair.name: pair for pair in mechanism.pairs},
        )
        self.frames |= {link: frame_at(*ca.vertsplit(e.u)[3 * k : 3 * k + 3]) for k, link in enumerate(given_links)}
        "of all links, and of pairs by name, as expressions"
        self.input_operands: tuple[Operand, ...] = tuple(
            operand
            for k, is_angle in enumerate(self.input_is_angle)
            for operand in (("uc", k), ("us", k), ("u", k))[0 if is_angle else 2 :]
        )
        "what stands for the inputs"

    @cached_property
    def carrying_angles(self) -> tuple[int, ...]:
        """The unknown angles on which blocks beside their own depend, by number."""
        e = self.equations
        rows, columns = ca.jacobian_sparsity(e.F, e.z).get_triplet()
        own_rows = {
            k: range(part.block.rows.start, part.block.rows.stop) for part in self.blocks for k in part.unknowns
        }
        carrying = {k for row, k in zip(rows, columns, strict=True) if self.is_angle[k] and row not in own_rows[k]}
        return tuple(sorted(carrying))

    def residuals(self) -> ca.SX:
        """What every constraint leaves open, by the pairs' own formulas: nothing of the elimination is believed.

        Of an angle that closes modulo a turn |sin| + 1 - cos, which needs no arc.
        """
        e = self.equations
        numbers, inputs = split_pair_numbers(self.mechanism.pairs, e.p), scalars(e.u)[3 * len(self.given_links) :]
        rows = residuals(self.mechanism, self.frames, numbers, self.pair_coordinates, inputs)
        return ca.vertcat(ca.SX(0, 1), *(closing_error(value, row.kind) for row, value in rows))

    def rates(self, u1: ca.SX, u2: ca.SX) -> tuple[ca.SX, ca.SX]:
        """First and second rates of the unknowns, block after block."""
        return UnknownRates(self.equations, solve_by_determinants).first_and_second(u1, u2)


@lru_cache(maxsize=256)
def kernel_equations(
    functions: EquationFunctions,
    structure: Mechanism,
    zeros: frozenset[Operand] = frozenset(),
    stop_pairs: tuple[Pair, ...] = (),
) -> KernelEquations:
    """The equations of a structure, kept. Raises UnsupportedOperation."""
    return KernelEquations(functions.equations, structure, zeros, stop_pairs)


def batch_equations(batch: DesignBatch) -> KernelEquations:
    """The equations of a batch's structure. Raises UnsupportedOperation."""
    return kernel_equations(batch.functions, equation_structure(batch.mechanism), batch.zeros, batch.stop_pairs)


def operand_rows(operands: Sequence[Operand], values: np.ndarray) -> np.ndarray:
    """Cosines, sines and values of rows (rows, designs), as operands say."""
    rows = np.empty((len(operands), values.shape[1]))
    for row, (part, k) in zip(rows, operands, strict=True):
        value = values[k]
        # designs mostly start at one input
        is_common = value.size and value[0] == value[-1] and np.all(value == value[0])
        row[:] = {"c": np.cos, "s": np.sin}.get(part[1:], np.positive)(value[:1] if is_common else value)
    return rows


def unknowns_from_state(operands: Sequence[Operand], state: np.ndarray, count: int) -> np.ndarray:
    """The unknowns z (unknowns, designs) of a state (operands, designs)."""
    rows, z = dict(zip(operands, state, strict=True)), np.empty((count, state.shape[1]))
    for k in range(count):
        z[k] = rows["z", k] if ("z", k) in rows else np.arctan2(rows["zs", k], rows["zc", k])
    return z
