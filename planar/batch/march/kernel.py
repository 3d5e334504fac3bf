"""The parts of LLVM functions that solve positions: a mechanism's equations, printed block by block.

The angles' cos and sin are carried, never the angles. A block in closed form is computed by that; any other is solved
by Newton's method, whose step turns an angle by the first terms of its cos and sin; what is not quite of length one
then is brought to it. So no sine stands in the loop, and few divisions.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property, lru_cache, reduce
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.batch.march.design_batch import DesignBatch
from planar.batch.march.prediction import LEAST_START_REGULARITY
from planar.batch.march.stops import NUMBERS_PER_STOP, are_periodic, stop_rooms
from planar.codegen.instructions import CosSin, InvariantHoister, check_length, expand_angle_sums
from planar.equations.closed_form import ClosedForm, find_closed_form
from planar.equations.coordinates import coordinate_columns, frames_from_coordinates
from planar.equations.functions import EquationFunctions
from planar.equations.generic_evaluation import inline_function
from planar.equations.linear import solve_by_determinants, solve_with_volume
from planar.equations.mechanism_numbers import equation_structure
from planar.equations.rates import UnknownRates, block_jacobian, first_and_second_rates
from planar.equations.residuals import (
    closing_error,
    input_positions,
    residuals,
    scalars,
    split_pair_numbers,
)
from planar.equations.symbolic_equations import Block, ConstraintEquations, slice_length
from planar.foundation.geometry import Vector, frame_at
from planar.foundation.instruction_list import InstructionList, UnsupportedOperation
from planar.model.mechanism import Mechanism, links_counting_turns
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
        "the listings of `KernelInstructions.list_newton_step`, by block"
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

    def stop_coalescences(self, numbers: ca.SX) -> ca.SX:
        """For each pair with stops what reaches one where it meets one of them; see `StopLimits`."""
        positions = input_positions(self.stop_pairs, self.frames, {}, self.pair_coordinates)
        periodic = are_periodic(self.stop_pairs, self.mechanism)
        return ca.vertcat(ca.SX(0, 1), *(1.0 - room for room in stop_rooms(positions, periodic, scalars(numbers), ca)))

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


class KernelInstructions:
    """What a kernel computes as instructions, all in one list: blocks, checks, and points on links with their rates.

    `links` are those of the points, none of which is the frame. What depends on `invariant` kinds of operands alone is
    kept apart, in `hoister.invariants`; `carried` are the angles whose own values stand beside their cos and sin.
    """

    def __init__(
        self,
        equations: KernelEquations,
        links: tuple[str, ...],
        rates: bool,
        invariant: frozenset[str],
        carried: frozenset[Operand],
    ):
        self.equations, self.links, self.rates, self.carried = equations, links, rates, carried
        self.solves_rates_apart = equations.has_large_blocks
        "whether the unknowns' rates are solved block after block, so that they are symbols to what is made of them"
        e = equations.equations
        self.symbols: dict[str, ca.SX] = {
            "z": e.z,
            "u": e.u,
            "p": e.p,
            "q": ca.SX.sym("q", 2 * len(links)),
            "u1": ca.SX.sym("u1", e.u.numel()),
            "u2": ca.SX.sym("u2", e.u.numel()),
            "z1": ca.SX.sym("z1", e.z.numel()),
            "z2": ca.SX.sym("z2", e.z.numel()),
            "sign": ca.vertcat(ca.SX(0, 1), *(form.sign for form in equations.closed_forms)),
            "scale": ca.SX.sym("scale"),
            "stop": ca.SX.sym("stop", NUMBERS_PER_STOP * len(equations.stop_pairs)),
        }
        self.hoister = InvariantHoister[Operand](lambda operand: operand[0] in invariant)
        with_signs = [part for part in equations.blocks if part.closed_form and part.closed_form.sign.numel()]
        self.sign_index = {part.block.block_index: k for k, part in enumerate(with_signs)}

    def state_operands(self) -> tuple[Operand, ...]:
        """What stands for all unknowns: a length, or the cos and sin of an angle, and its value where it is carried."""
        operands: list[Operand] = []
        for k, is_angle in enumerate(self.equations.is_angle):
            operands += [("zc", k), ("zs", k)] if is_angle else []
            operands += [("z", k)] if not is_angle or ("z", k) in self.carried else []
        return tuple(operands)

    def list_values(self, outputs: Sequence[ca.SX], written: int | None = None) -> list[int]:
        """The numbers, in `hoister.result`, of the values of expressions. Raises UnsupportedOperation.

        `written`: the count of earlier instructions, see `check_length`; None without a limit.
        """
        return self.hoister.rebuild(*self._list_expressions(outputs, written))

    def list_newton_step(self, part: KernelBlock, written: int) -> list[int]:
        """The numbers, in `hoister.result`, of Newton's step of a block, the square of the volume that the columns of
        its Jacobian span, the product of the squares of their lengths, and the square of the shortest column.

        Where a column vanishes, as with the arm of a slide on which a link turns, an unknown is not determined, however
        large the angles between the columns. The listing is cached with the equations, since all functions of these
        have it in common. Without the step and the product, and with all columns in place of the volume: the residual,
        the Jacobian and the shortest column of a large block, of which numbers are solved. Raises UnsupportedOperation.
        """
        index = part.block.block_index
        if index not in self.equations.newton_steps:
            e, block = self.equations.equations, part.block
            residual, jacobian = e.F[block.rows], block_jacobian(e, block.rows, block.unknowns)
            squared_arm = reduce(ca.fmin, (ca.sumsqr(column) for column in ca.horzsplit(jacobian)), ca.SX(1.0))
            solved = [residual, ca.vec(jacobian)] if part.is_large else solve_with_volume(jacobian, residual)
            self.equations.newton_steps[index] = self._list_expressions([*solved, squared_arm], written)
        return self.hoister.rebuild(*self.equations.newton_steps[index])

    def _list_expressions(
        self, outputs: Sequence[ca.SX], written: int | None
    ) -> tuple[InstructionList[Operand], list[int]]:
        """The instructions of expressions, and the numbers of their values. Raises UnsupportedOperation."""
        function = ca.Function("part", list(self.symbols.values()), [ca.densify(ca.vertcat(*outputs))], {"cse": True})
        if written is not None:
            check_length(written + function.n_instructions())
        listing: InstructionList[Operand] = InstructionList()
        angles: dict[int, CosSin] = {}
        equations = self.equations
        are_angles = {"z": equations.is_angle, "u": equations.input_is_angle, "p": equations.number_is_angle}
        arguments = []
        for name, symbol in self.symbols.items():
            numbers = [
                listing.add_constant(0.0) if (name, k) in equations.zeros else listing.add_input((name, k))
                for k in range(symbol.numel())
            ]
            arguments.append(numbers)
            for k, is_angle in enumerate(are_angles.get(name, ())):
                if is_angle:
                    angles[numbers[k]] = CosSin(*(listing.add_input((name + part, k)) for part in "cs"))
        (values,) = inline_function(listing, function, arguments)
        return expand_angle_sums(listing, values, angles)

    def closed_form_operands(self, part: KernelBlock) -> list[Operand]:
        """What stands for the unknowns of a block in closed form, in the order of `closed_form_outputs`."""
        assert part.closed_form is not None
        return [
            operand
            for k, values in zip(part.unknowns, part.closed_form.values, strict=True)
            for operand in ([("zc", k), ("zs", k)] if len(values) == 2 else [("z", k)])
        ]

    def closed_form_outputs(self, part: KernelBlock) -> list[ca.SX]:
        """The unknowns of a block in closed form, then its `coalescence`."""
        form = part.closed_form
        assert form is not None
        return [*(value for values in form.values for value in values), self.coalescence(form)]

    def coalescence(self, form: ClosedForm) -> ca.SX:
        """How near the two assemblies of a closed form are to where they meet.

        An arm that shrinks to `LEAST_START_REGULARITY` counts as that too: what turns on it is not determined.
        """
        if form.squared_arm is None:
            return form.coalescence
        return form.coalescence + LEAST_START_REGULARITY**2 * (1.0 / form.squared_arm)  # the form divides by it too

    @staticmethod
    def slow_nearness(part: KernelBlock) -> ca.SX:
        """What varies as slowly as the links that hold a block in closed form, and reaches one (a cosine minus one too)
        where its two assemblies meet."""
        form = part.closed_form
        assert form is not None
        if form.cosine is not None:
            return form.cosine
        assert form.margin is not None
        return 1.0 - form.margin

    def point_coordinates(self, points: Sequence[int]) -> ca.SX:
        """x and y of some of the points."""
        q = self.symbols["q"]
        frames = self.equations.frames
        positions = [frames[self.links[k]].to_world(Vector(q[2 * k], q[2 * k + 1])) for k in points]
        return ca.vertcat(ca.SX(0, 1), *(part for position in positions for part in position))

    def counted_angles(self) -> ca.SX:
        """Angles of links that wheels or racks tie: they may turn much farther in a step than the inputs do."""
        e, links = self.equations.equations, links_counting_turns(self.equations.mechanism)
        unknown = {column: k for k, column in enumerate(e.unknowns)}
        columns = [
            column
            for column, coordinate in enumerate(e.coordinates)
            if coordinate.owner in links and coordinate.of_link and coordinate.kind is MeasureKind.ANGLE
        ]
        # what nothing is made of but cos and sin is as fast as the block that it is in
        counted = [e.w[k] for k in columns if k not in unknown or ("z", unknown[k]) in self.carried]
        return ca.vertcat(ca.SX(0, 1), *counted)

    def output_expressions(self) -> list[ca.SX]:
        """The points' positions, and rates."""
        e, s = self.equations.equations, self.symbols
        positions = self.point_coordinates(range(len(self.links)))
        if not self.rates:
            return [positions]
        u1, u2 = s["u1"], s["u2"]
        z1, z2 = (s["z1"], s["z2"]) if self.solves_rates_apart else self.equations.rates(u1, u2)
        return [positions, *first_and_second_rates(positions, e.y, ca.vertcat(z1, u1), ca.vertcat(z2, u2))]


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
