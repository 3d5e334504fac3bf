"""The constraint equations of a mechanism as casadi SX: built once, decomposed into blocks, simplified inside each.

The symbols z, u, p, w and F are those of the table in `planar.equations`.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.equations.assembled_equations import AssembledEquations, Elimination
from planar.equations.block_decomposition import BlockIndices, decompose_blocks
from planar.equations.coordinates import FRAME_PARTS, Coordinate, consecutive_ranges
from planar.equations.elements import ElementPlacement, PlacedElement
from planar.equations.elimination import (
    CoordinateSymbols,
    EarlierRows,
    EliminationRow,
    EliminationSteps,
    back_substitute,
    dependency_order,
    eliminate,
    expression_unknowns,
    stack_expressions,
)
from planar.equations.residuals import ConstraintRow, wrapped_residual
from planar.foundation.arrays import Array, IntArray
from planar.foundation.generic_numbers import generic_numbers
from planar.foundation.lazy_module import LazyModule
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # known types of elements and blocks do without expressions

MIN_MOVING_SLOPE = 1e-12
"""An entry of a Jacobian at random places, unknowns of about one, that is greater than rounding."""
HELD, UNRELATED = -1, -2
"""Rows that are no derivatives of the sum of squares of misfits: that have to close beside it, and the rest."""


class Block(NamedTuple):
    """A block after elimination: which entries of z and of F it has, and the links and pairs that it is about."""

    unknowns: slice
    rows: slice
    links: tuple[str, ...]
    pairs: tuple[str, ...]
    is_free: bool
    block_index: int


def slice_length(part: slice) -> int:
    """How many entries a part of z or F has."""
    return part.stop - part.start


class ConstraintExpressions(NamedTuple):
    """The symbols of `planar.equations`, and F and w in them."""

    z: ca.SX
    u: ca.SX
    p: ca.SX
    w: ca.SX
    F: ca.SX


@dataclass(frozen=True, eq=False)
class ConstraintEquations:
    """The symbols of `planar.equations`; `coordinates`, `rows`, `unknowns` say which name owns which entry.

    Expressions are made when they are first asked for: structures of many unknowns are evaluated without any.
    """

    coordinates: tuple[Coordinate, ...]
    unknowns: tuple[int, ...]
    rows: tuple[ConstraintRow, ...]
    blocks: tuple[Block, ...]
    known_after_block: tuple[int, ...]
    """For every coordinate the block after which it is known; -1 for one that follows from the inputs alone."""
    input_kinds: tuple[MeasureKind, ...]
    """What every entry of u is."""
    make_expressions: Callable[[], ConstraintExpressions]
    open_rows: tuple[int, ...] = ()
    """Of all rows of the pairs, in the mechanism's order, those that may stay open by a misfit."""
    misfit_columns: tuple[int, ...] = ()
    """The coordinate that is the misfit of each of them."""
    row_variables: tuple[int, ...] = ()
    """For every row of F the coordinate that is the unknown by which it is the derivative of the sum of squares; HELD
    for one that has to close beside that, UNRELATED for any other."""
    elimination: Elimination | None = None
    """How the equations are assembled from elements; None where expressions alone say what they are."""
    row_indices: tuple[int, ...] = ()
    """The rows of F among all rows of the structure."""

    @cached_property
    def assembled(self) -> AssembledEquations | None:
        """The same equations, evaluated from their elements."""
        if self.elimination is None:
            return None
        is_angle = [row.kind is MeasureKind.ANGLE for row in self.rows]
        return AssembledEquations(self.elimination, self.unknowns, self.row_indices, is_angle)

    @property
    def argument_counts(self) -> tuple[int, int, int]:
        """How many entries z, u and p have."""
        if self.elimination is not None:
            return len(self.unknowns), self.elimination.input_count, self.elimination.number_count
        return self.z.numel(), self.u.numel(), self.p.numel()

    @cached_property
    def expressions(self) -> ConstraintExpressions:
        """F and w, and what they are made of."""
        return self.make_expressions()

    @property
    def z(self) -> ca.SX:
        """The unknowns."""
        return self.expressions.z

    @property
    def u(self) -> ca.SX:
        """The inputs."""
        return self.expressions.u

    @property
    def p(self) -> ca.SX:
        """The numbers."""
        return self.expressions.p

    @property
    def w(self) -> ca.SX:
        """The coordinates."""
        return self.expressions.w

    @property
    def F(self) -> ca.SX:  # noqa: N802  # as the symbol is
        """The residuals."""
        return self.expressions.F

    @cached_property
    def unknown_is_angle(self) -> np.ndarray:
        """Which unknowns are angles (unknowns,)."""
        return np.array([self.coordinates[column].kind is not MeasureKind.LENGTH for column in self.unknowns], bool)

    @cached_property
    def y(self) -> ca.SX:
        """(z, u): what changes in time."""
        return ca.vertcat(self.z, self.u)

    @property
    def is_square(self) -> bool:
        """Whether every block has as many rows as unknowns, and these close them."""
        return not self.open_rows and not any(
            block.is_free or slice_length(block.rows) != slice_length(block.unknowns) for block in self.blocks
        )

    @cached_property
    def jacobian(self) -> ca.SX:
        """dF/dy (rows, y)."""
        return ca.jacobian(self.F, self.y)

    def as_function(self) -> ca.Function:
        """(z, u, p) -> F, w."""
        return ca.Function("equations", [self.z, self.u, self.p], [self.F, self.w])


class EliminatedStructure(NamedTuple):
    """A structure's constraints after elimination; `unknowns` are the coordinates that remain, `remaining_rows` the
    rows of all that close them."""

    mechanism: Mechanism
    coordinates: tuple[Coordinate, ...]
    rows: tuple[ConstraintRow, ...]
    "all rows: those of the pairs, then those of the inputs"
    input_kinds: tuple[MeasureKind, ...]
    elimination: Elimination
    unknowns: tuple[int, ...]
    remaining_rows: tuple[int, ...]
    surplus_rows: tuple[int, ...]
    "rows of pairs that are held more than once"
    groups: tuple[BlockIndices, ...]


def build_equations(mechanism: Mechanism, given_links: Sequence[str] = ()) -> ConstraintEquations:
    """The equations of a mechanism; only its structure matters, its numbers are `p` and `u`.

    The links that are `given` are no unknowns: where they are is told by u, ahead of the inputs' positions. Of a
    mechanism that closes within a misfit the pairs that are held more than once take the position of least misfit.
    """
    structure = _eliminate_structure(mechanism, tuple(given_links))
    equations = _assembled_equations_of(structure)
    if mechanism.closes_within is None or not _is_overdetermined(equations):
        return equations
    if structure.surplus_rows:
        equations = _least_misfit_equations_of(structure, structure.surplus_rows)
    if _is_overdetermined(equations):  # it showed after elimination only, or not for these alone
        pair_rows = len(structure.rows) - len(mechanism.inputs)
        equations = _least_misfit_equations_of(structure, range(pair_rows))
    return equations


def _is_overdetermined(equations: ConstraintEquations) -> bool:
    """Whether some block has more rows than unknowns."""
    return any(slice_length(block.rows) > slice_length(block.unknowns) for block in equations.blocks)


def _place_elements(
    mechanism: Mechanism, given_links: Sequence[str], driven: Sequence[Pair]
) -> tuple[tuple[PlacedElement, ...], tuple[Coordinate, ...], tuple[ConstraintRow, ...], int]:
    """The elements of pairs, then those of inputs; the coordinates, the rows, and how many numbers there are."""
    coordinates: list[Coordinate] = []
    frame_columns: dict[str, range] = {}
    for link in mechanism.links:
        if link.name != mechanism.frame and link.name not in given_links:
            frame_columns[link.name] = range(len(coordinates), len(coordinates) + 3)
            kinds = (MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.ANGLE)
            coordinates += [
                Coordinate(link.name, part, kind, True) for part, kind in zip(FRAME_PARTS, kinds, strict=True)
            ]
    own_columns: dict[str, range] = {}
    for pair in mechanism.pairs:
        own_columns[pair.name] = range(len(coordinates), len(coordinates) + len(pair.coordinate_kinds))
        coordinates += [Coordinate(pair.name, part, kind, False) for part, kind in pair.coordinate_kinds]
    number_counts = {pair.name: len(pair.number_kinds) for pair in mechanism.pairs}
    for k, link_name in enumerate(given_links):
        frame_columns[link_name] = range(len(coordinates) + 3 * k, len(coordinates) + 3 * k + 3)
    placement = ElementPlacement(frame_columns, own_columns, consecutive_ranges(number_counts))
    elements: list[PlacedElement] = []
    rows: list[ConstraintRow] = []
    for pair in mechanism.pairs:
        elements.append(placement.residual_of(pair, len(rows)))
        rows += [ConstraintRow(pair.name, kind) for kind in pair.residual_kinds]
    for motion in driven:
        elements.append(placement.input_position_of(motion, len(rows)))
        rows.append(ConstraintRow(motion.name, motion.input_kind))
    return tuple(elements), tuple(coordinates), tuple(rows), sum(number_counts.values())


def _eliminate_structure(mechanism: Mechanism, given_links: tuple[str, ...]) -> EliminatedStructure:
    """The constraints of a structure, shortened by the coordinates that enter them with constant factors."""
    motions = relative_motions(mechanism)
    driven = [motions[driven_input.pair] for driven_input in mechanism.inputs]
    input_kinds = (
        *(MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.ANGLE) * len(given_links),
        *(motion.input_kind for motion in driven),
    )
    elements, coordinates, rows, number_count = _place_elements(mechanism, given_links, driven)
    lines = _elimination_rows(elements)
    for k in range(len(driven)):
        factors, column = lines[len(rows) - len(driven) + k].factors, len(coordinates) + 3 * len(given_links) + k
        factors[column] = factors.get(column, 0.0) - 1.0

    solved: EliminationSteps = []
    unknowns: list[int] = []
    remaining_rows: list[int] = []
    surplus: list[int] = []
    is_coordinate = range(len(coordinates)).__contains__
    earlier, pair_lines = EarlierRows(solved), _elimination_rows(elements)
    groups = decompose_blocks([{*filter(is_coordinate, line.dependencies)} for line in lines], len(coordinates))
    for group in groups:
        group_rows, group_unknowns = eliminate(group.rows, group.columns, lines, solved)
        if len(group.rows) > len(group.columns):
            surplus += [row for row in group.rows if row < len(rows) - len(driven)]
        unknowns += group_unknowns
        remaining_rows += group_rows
        for row in group_rows:
            earlier.shorten(lines[row])
        for row in group.rows:
            if rows[row].kind is not MeasureKind.ANGLE:  # these close modulo a turn
                earlier.add(pair_lines[row])
    elimination = Elimination(
        elements,
        tuple(dependency_order(solved)),
        tuple(lines),
        len(coordinates),
        len(input_kinds),
        number_count,
    )
    return EliminatedStructure(
        mechanism,
        coordinates,
        rows,
        input_kinds,
        elimination,
        tuple(unknowns),
        tuple(remaining_rows),
        tuple(surplus),
        groups,
    )


def _elimination_rows(elements: Sequence[PlacedElement]) -> list[EliminationRow]:
    """The rows of elements before elimination."""
    lines: list[EliminationRow] = []
    for placed in elements:
        element = placed.element
        for row, local_factors, local_nonlinear in zip(placed.rows, element.factors, element.nonlinear, strict=True):
            factors = {placed.coordinates[k]: factor for k, factor in local_factors.items()}
            nonlinear = {placed.coordinates[k] for k in local_nonlinear}
            lines.append(EliminationRow(factors, {row: 1.0}, set(nonlinear), set(nonlinear)))
    return lines


def _assembled_equations_of(structure: EliminatedStructure) -> ConstraintEquations:
    """The equations of a structure, their blocks found by numbers at random places.

    What cancels in a sum shows in numbers only: an entry of the Jacobian that vanishes at random places is none. Left
    standing it would have a block, or a link, wait for unknowns that are solved after it.
    """
    elimination, unknown_count = structure.elimination, len(structure.unknowns)
    remaining = tuple(structure.rows[row] for row in structure.remaining_rows)
    assembled = AssembledEquations(
        elimination, structure.unknowns, structure.remaining_rows, [row.kind is MeasureKind.ANGLE for row in remaining]
    )
    stops = np.cumsum([unknown_count, elimination.input_count, elimination.number_count])
    z, u, p = np.split(generic_numbers(2, int(stops[-1])), stops[:2], axis=1)
    with np.errstate(all="ignore"):
        # what grew beyond all numbers, along a long train of wheels, is more than rounding
        _, entries = assembled.residuals_and_jacobians(z, u, p)
    pattern = assembled.pattern.first_columns(unknown_count)
    moved = _moving_columns(len(remaining), pattern.rows, pattern.columns, entries[:, : len(pattern.rows)])

    def make_expressions() -> ConstraintExpressions:
        return _without_idle_unknowns(_expressions_of(structure, {}), moved)

    equations = ConstraintEquations(
        structure.coordinates, structure.unknowns, remaining, (), (), structure.input_kinds, make_expressions
    )

    def coordinate_levels(level_of: Mapping[int, int]) -> tuple[int, ...]:
        levels = {column: level_of[k] for k, column in enumerate(structure.unknowns)}
        for column, line in elimination.solved:
            needed = (set(line.factors) | line.rest_coordinates) - {column}
            levels[column] = max((levels.get(other, -1) for other in needed), default=-1)
        return tuple(levels[column] for column in range(elimination.coordinate_count))

    return _split_into_blocks(structure, equations, moved, coordinate_levels)


def _expressions_of(structure: EliminatedStructure, misfits: Mapping[int, ca.SX]) -> ConstraintExpressions:
    """F and w as expressions, in the order in which elimination leaves them; some rows stay open by their misfits."""
    return expressions_of_elimination(
        structure.elimination,
        structure.coordinates,
        structure.input_kinds,
        structure.unknowns,
        [(row, structure.rows[row].kind) for row in structure.remaining_rows],
        [f"{pair.name} {k}" for pair in structure.mechanism.pairs for k in range(len(pair.number_kinds))],
        misfits,
    )


def expressions_of_elimination(
    elimination: Elimination,
    coordinates: Sequence[Coordinate],
    input_kinds: Sequence[MeasureKind],
    unknowns: Sequence[int],
    rows: Sequence[tuple[int, MeasureKind]],
    number_names: Sequence[str],
    misfits: Mapping[int, ca.SX],
) -> ConstraintExpressions:
    """F and w as expressions: w in the order of the coordinates, F in that of rows, each a line of the elimination."""
    u = ca.SX.sym("u", elimination.input_count)
    inputs = ca.vertsplit(u) if elimination.input_count else []
    # each by a name of its own: casadi's search for common expressions (3.8.2) may take those of one name for one
    p = stack_expressions(ca.SX.sym(f"of {name}") for name in number_names)
    values = [ca.SX.sym(f"of {coordinate.owner}.{coordinate.part}") for coordinate in coordinates]
    cos_sin = {
        k: (ca.SX.sym(f"cos {coordinate.owner}"), ca.SX.sym(f"sin {coordinate.owner}"))
        for k, coordinate in enumerate(coordinates)
        if coordinate.of_link and coordinate.kind is MeasureKind.ANGLE
    }
    for k, (kind, value) in enumerate(zip(input_kinds, inputs, strict=True), len(values)):
        if kind is not MeasureKind.LENGTH:
            cos_sin[k] = ca.cos(value), ca.sin(value)
    symbols = CoordinateSymbols([*values, *inputs], cos_sin)
    rests: list[ca.SX] = []
    for placed in elimination.elements:
        taken = placed.element.arguments
        arguments = [
            *(symbols.values[placed.coordinates[k]] for k in taken.coordinates),
            *(cos_sin[placed.coordinates[3 * k + 2]][0] for k in taken.cosines),
            *(cos_sin[placed.coordinates[3 * k + 2]][1] for k in taken.sines),
            *(p[placed.numbers[k]] for k in taken.numbers),
        ]
        rests += map(ca.SX, placed.element.rest.evaluate(arguments))
    for row, misfit in misfits.items():
        rests[row] = rests[row] - misfit
    z = ca.SX.sym("z", len(unknowns))
    residuals = [wrapped_residual(elimination.lines[row].as_expression(symbols, rests), kind) for row, kind in rows]
    replaced = dict(zip(unknowns, ca.vertsplit(z), strict=True)) if unknowns else {}
    F, w = back_substitute(
        replaced, elimination.solved, symbols, rests, [stack_expressions(residuals), stack_expressions(values)]
    )
    return ConstraintExpressions(z, u, p, w, F)


def _without_idle_unknowns(expressions: ConstraintExpressions, moved: Sequence[set[int]]) -> ConstraintExpressions:
    """F and w with no unknown in an entry that does not move it; `moved` are those that move the entries of F, and
    those of w if they were looked for."""
    z, u, p, w, F = expressions
    both, row_count = ca.vertcat(F, w), F.numel()
    for row, (unknowns, moving) in enumerate(zip(expression_unknowns(both, z), moved, strict=False)):
        idle = sorted(unknowns - moving)
        if idle:
            both[row] = ca.substitute(both[row], z[idle], ca.SX.zeros(len(idle)))
    return ConstraintExpressions(z, u, p, both[row_count:], both[:row_count])


def _least_misfit_equations_of(structure: EliminatedStructure, open_rows: Sequence[int]) -> ConstraintEquations:
    """The equations of the position of least misfit, in which some rows of pairs may stay open."""
    misfits = {row: ca.SX.sym(f"misfit {row}") for row in open_rows}
    equations = _with_least_misfit(structure, _expressions_of(structure, misfits), misfits)
    expressions = equations.expressions
    moved = _moving_unknowns(expressions)
    equations = replace(equations, make_expressions=lambda: _without_idle_unknowns(expressions, moved))

    def coordinate_levels(level_of: Mapping[int, int]) -> tuple[int, ...]:
        of_coordinates = moved[len(equations.rows) :]
        return tuple(max((level_of[column] for column in unknowns), default=-1) for unknowns in of_coordinates)

    return _split_into_blocks(structure, equations, moved, coordinate_levels)


def _slope_of_squares(
    values: ca.SX, weights: ca.SX, unknowns: ca.SX, multipliers: Sequence[ca.SX], closing: Sequence[ca.SX]
) -> ca.SX:
    """The derivatives of the weighed sum of squares of misfits by unknowns, of which the last are the multipliers of
    rows that have to close: by these, the rows.

    The sum is least where all of them vanish (C. F. Gauss, Theoria combinationis 1823); a row that has to close, as an
    input's, has a multiplier (J.-L. Lagrange). Angles count as arcs at the mechanism's size.
    """
    # J^T W r by itself: the derivative of a sum of squares would take the squares first
    slope = ca.jtimes(values, unknowns, weights * values, True)
    if not multipliers:
        return slope
    residuals = stack_expressions(closing)
    slope += ca.jtimes(residuals, unknowns, stack_expressions(multipliers), True)
    return ca.vertcat(slope[: -len(multipliers)], residuals)


def _with_least_misfit(
    structure: EliminatedStructure, expressions: ConstraintExpressions, misfits: Mapping[int, ca.SX]
) -> ConstraintEquations:
    """Equations whose rows may stay open by their misfits, made those of the position of least misfit.

    An eliminated row leaves its misfit, which is an unknown; one that remains has for a misfit its residual.

    F first has the derivatives by the unknowns that misfits move, by the misfits of rows that were eliminated, and of
    multipliers the rows that are held; then the rows that are unrelated to misfits. w has the misfits of all rows and
    the multipliers behind it, p what the squares count.
    """
    z, u, p, w, F = expressions
    rows, last_rows, unknowns = structure.rows, structure.remaining_rows, structure.unknowns
    remaining = [misfits[row] for row in last_rows if row in misfits]
    if remaining:
        F, w = ca.substitute([F, w], [stack_expressions(remaining)], [ca.SX.zeros(len(remaining))])
    loose = {column for group in structure.groups if misfits.keys() & set(group.rows) for column in group.columns}
    tied = [k for k, column in enumerate(unknowns) if column in loose]
    untied = [k for k in range(len(unknowns)) if k not in {*tied}]
    touched = expression_unknowns(F, z)
    # a row that must close is held where it rests on unknowns that the misfits move, and on these alone
    closing = [k for k, row in enumerate(last_rows) if row not in misfits]
    closing_rows = [k for k in closing if touched[k] and touched[k] <= {*tied}]
    unrelated = [k for k in closing if k not in closing_rows]
    residual_of = {row: F[k] for k, row in enumerate(last_rows)}
    free = [row for row in misfits if row not in residual_of]
    multipliers = [ca.SX.sym(f"multiplier {k}") for k in closing_rows]
    weights = stack_expressions(ca.SX.sym(f"weight {row}") for row in misfits)
    values = stack_expressions(residual_of.get(row, symbol) for row, symbol in misfits.items())
    moved = stack_expressions([*(z[k] for k in tied), *(misfits[row] for row in free), *multipliers])
    slope = _slope_of_squares(values, weights, moved, multipliers, [F[k] for k in closing_rows])
    first = len(structure.coordinates)
    added = [Coordinate(rows[row].pair, f"misfit {row}", rows[row].kind, False) for row in misfits]
    added += [Coordinate(rows[last_rows[k]].pair, "multiplier", MeasureKind.LENGTH, False) for k in closing_rows]
    column_of = {row: first + k for k, row in enumerate(misfits)}
    names = [rows[row].pair for row in last_rows if row in misfits] or [rows[row].pair for row in misfits]
    labels = [ConstraintRow(names[k % len(names)], MeasureKind.ANGLE) for k in range(len(tied))]
    labels += [rows[row] for row in free]
    labels += [rows[last_rows[k]] for k in (*closing_rows, *unrelated)]
    variables = [*(unknowns[k] for k in tied), *(column_of[row] for row in free)]
    multiplier_columns = range(first + len(misfits), first + len(added))
    with_misfits = ConstraintExpressions(
        ca.vertcat(moved, *(z[k] for k in untied)),
        u,
        ca.vertcat(p, weights),
        ca.vertcat(w, values, *multipliers),
        ca.vertcat(slope, *(F[k] for k in unrelated)),
    )
    return ConstraintEquations(
        coordinates=(*structure.coordinates, *added),
        unknowns=(*variables, *multiplier_columns, *(unknowns[k] for k in untied)),
        rows=tuple(labels),
        blocks=(),
        known_after_block=(),
        input_kinds=structure.input_kinds,
        make_expressions=lambda: with_misfits,
        open_rows=tuple(misfits),
        misfit_columns=tuple(column_of.values()),
        row_variables=(*variables, *([HELD] * len(closing_rows)), *([UNRELATED] * len(unrelated))),
    )


def _split_into_blocks(
    structure: EliminatedStructure,
    equations: ConstraintEquations,
    moved: Sequence[set[int]],
    coordinate_levels: Callable[[Mapping[int, int]], tuple[int, ...]],
) -> ConstraintEquations:
    """The shortened equations split once more, in the order in which they are solved.

    Only now does it show where constraints hold each other twice: angles that a ring of slides closes by itself
    have dropped out, and what was matched with them is free. `moved` are the unknowns that move every entry of F;
    `coordinate_levels` gives from the block of every unknown that after which every coordinate is known, -1 for none.
    """
    mechanism = structure.mechanism
    groups = [
        group
        for group in decompose_blocks(moved[: len(equations.rows)], len(equations.unknowns))
        if group.rows or group.columns
    ]
    level_of = {column: level for level, group in enumerate(groups) for column in group.columns}
    known_from = coordinate_levels(level_of)
    stages, first_unknown, first_row = [], 0, 0
    level_of_link: dict[str, int] = {}
    placed_at: dict[int, dict[str, None]] = {}
    for coordinate, level in zip(equations.coordinates, known_from, strict=True):
        if coordinate.of_link:
            level_of_link[coordinate.owner] = max(level, level_of_link.get(coordinate.owner, -1))
            placed_at.setdefault(level, {})[coordinate.owner] = None
    joined_at: dict[int, list[str]] = {}
    for pair in mechanism.pairs:
        joined_at.setdefault(max(level_of_link.get(link, -1) for link in pair.bodies), []).append(pair.name)
    for level, group in enumerate(groups):
        unknowns = slice(first_unknown, first_unknown + len(group.columns))
        rows = slice(first_row, first_row + len(group.rows))
        links, pairs = tuple(placed_at.get(level, ())), tuple(joined_at.get(level, ()))
        stages.append(Block(unknowns, rows, links, pairs, group.is_free, level))
        first_unknown, first_row = unknowns.stop, rows.stop
    columns = [column for group in groups for column in group.columns]
    order = [row for group in groups for row in group.rows]

    def make_expressions() -> ConstraintExpressions:
        z, u, p, w, F = equations.expressions
        return ConstraintExpressions(z[columns], u, p, w, F[order])

    return replace(
        equations,
        unknowns=tuple(equations.unknowns[column] for column in columns),
        rows=tuple(equations.rows[row] for row in order),
        blocks=tuple(stages),
        known_after_block=known_from,
        make_expressions=make_expressions,
        row_variables=tuple(equations.row_variables[row] for row in order) if equations.row_variables else (),
        elimination=None if equations.open_rows else structure.elimination,
        row_indices=() if equations.open_rows else tuple(structure.remaining_rows[row] for row in order),
    )


def _moving_unknowns(expressions: ConstraintExpressions) -> list[set[int]]:
    """The unknowns that move each entry of F and w at random places."""
    z, u, p, w, F = expressions
    jacobian = ca.jacobian(ca.vertcat(F, w), z)
    slope = ca.Function("slope", [z, u, p], [jacobian])
    stops = np.cumsum([symbol.numel() for symbol in (z, u, p)])
    slopes = [slope(*np.split(numbers, stops[:2])).nonzeros() for numbers in generic_numbers(2, stops[2])]
    rows, columns = np.array(jacobian.sparsity().get_triplet(), dtype=int)
    return _moving_columns(jacobian.size1(), rows, columns, np.array(slopes))


def _moving_columns(row_count: int, rows: IntArray, columns: IntArray, entries: Array) -> list[set[int]]:
    """For every row the columns whose entries (places, entries) are more than rounding at random places."""
    moving: list[set[int]] = [set() for _ in range(row_count)]
    is_moving = ~(np.abs(entries).sum(axis=0) <= MIN_MOVING_SLOPE)
    for row, column in zip(rows[is_moving].tolist(), columns[is_moving].tolist(), strict=True):
        moving[row].add(column)
    return moving
