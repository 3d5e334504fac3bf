"""The constraint equations of a mechanism as casadi SX: built once, decomposed into blocks, simplified inside each.

The symbols z, u, p, w and F are those of the table in `planar.equations`.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from planar.equations.block_decomposition import decompose_blocks
from planar.equations.coordinates import Coordinate
from planar.equations.elimination import (
    CoordinateSymbols,
    EliminationSteps,
    back_substitute,
    eliminate,
    expression_unknowns,
    split_constant_factors,
    stack_expressions,
)
from planar.equations.residuals import ConstraintRow, residuals, split_pair_numbers, wrapped_residual
from planar.foundation.generic_numbers import generic_numbers
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind

PIECEWISE_OPERATIONS = frozenset((ca.OP_FLOOR, ca.OP_LT, ca.OP_LE))
"""What formulas that are put together of pieces have in them."""


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


@dataclass(frozen=True, eq=False)
class ConstraintEquations:
    """The symbols of `planar.equations`; `coordinates`, `rows`, `unknowns` say which name owns which entry."""

    coordinates: tuple[Coordinate, ...]
    unknowns: tuple[int, ...]
    rows: tuple[ConstraintRow, ...]
    blocks: tuple[Block, ...]
    known_after_block: tuple[int, ...]
    """For every coordinate the block after which it is known; -1 for one that follows from the inputs alone."""
    z: ca.SX
    u: ca.SX
    p: ca.SX
    w: ca.SX
    F: ca.SX
    input_kinds: tuple[MeasureKind, ...]
    """What every entry of u is."""
    open_rows: tuple[int, ...] = ()
    """Of all rows of the pairs, in the mechanism's order, those that may stay open by a misfit."""
    misfit_columns: tuple[int, ...] = ()
    """The coordinate that is the misfit of each of them."""
    row_variables: tuple[int, ...] = ()
    """For every row of F the coordinate that is the unknown by which it is the derivative of the sum of squares; HELD
    for one that has to close beside that, UNRELATED for any other."""

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

    def outline(self) -> dict[str, Any]:
        """All but the expressions, as a JSON value; with `as_function` it is what `equations_from_outline` takes."""
        return {
            "coordinates": [(each.owner, each.part, each.kind.value, each.of_link) for each in self.coordinates],
            "unknowns": self.unknowns,
            "rows": [(row.pair, row.kind.value) for row in self.rows],
            "blocks": [
                (each.unknowns.start, each.unknowns.stop, each.rows.start, each.rows.stop, *each[2:])
                for each in self.blocks
            ],
            "known_after_block": self.known_after_block,
            "input_kinds": [kind.value for kind in self.input_kinds],
            "open_rows": self.open_rows,
            "misfit_columns": self.misfit_columns,
            "row_variables": self.row_variables,
        }


def equations_from_outline(outline: Mapping[str, Any], function: ca.Function) -> ConstraintEquations:
    """The equations of an outline, the same as those of which it was made, and their function (z, u, p) -> F, w."""
    z, u, p = (function.sx_in(k) for k in range(3))
    F, w = function(z, u, p)
    return ConstraintEquations(
        tuple(Coordinate(owner, part, MeasureKind(kind), own) for owner, part, kind, own in outline["coordinates"]),
        tuple(outline["unknowns"]),
        tuple(ConstraintRow(pair, MeasureKind(kind)) for pair, kind in outline["rows"]),
        tuple(
            Block(slice(*each[:2]), slice(*each[2:4]), tuple(each[4]), tuple(each[5]), *each[6:])
            for each in outline["blocks"]
        ),
        tuple(outline["known_after_block"]),
        z,
        u,
        p,
        w,
        F,
        tuple(map(MeasureKind, outline["input_kinds"])),
        tuple(outline["open_rows"]),
        tuple(outline["misfit_columns"]),
        tuple(outline["row_variables"]),
    )


class _MechanismCoordinates(NamedTuple):
    """A mechanism's coordinates as symbols, and as the frames and own coordinates that the pairs' formulas take."""

    coordinates: list[Coordinate]
    symbols: CoordinateSymbols
    frames: dict[str, Frame]
    own: dict[str, list[ca.SX]]


def build_equations(mechanism: Mechanism, given_links: Sequence[str] = ()) -> ConstraintEquations:
    """The equations of a mechanism; only its structure matters, its numbers are `p` and `u`.

    The links that are `given` are no unknowns: where they are is told by u, ahead of the inputs' positions. Of a
    mechanism that closes within a misfit the pairs that are held more than once take the position of least misfit.
    """
    found, surplus = _build_equations(mechanism, given_links)
    if mechanism.closes_within is None or not _is_overdetermined(found):
        return found
    if surplus:
        found, _ = _build_equations(mechanism, given_links, surplus)
    if _is_overdetermined(found):  # it showed after elimination only, or not for these alone
        every = [row for pair in mechanism.pairs for row in pair.residual_kinds]
        found, _ = _build_equations(mechanism, given_links, range(len(every)))
    return found


def _is_overdetermined(equations: ConstraintEquations) -> bool:
    """Whether some block has more rows than unknowns."""
    return any(slice_length(block.rows) > slice_length(block.unknowns) for block in equations.blocks)


def _build_equations(
    mechanism: Mechanism, given_links: Sequence[str], open_rows: Sequence[int] = ()
) -> tuple[ConstraintEquations, list[int]]:
    """The equations in which some rows of pairs may stay open, and the rows of pairs that are held more than once."""
    named = relative_motions(mechanism)
    drives = (
        *(MeasureKind.LENGTH, MeasureKind.LENGTH, MeasureKind.ANGLE) * len(given_links),
        *(named[g.pair].input_kind for g in mechanism.inputs),
    )
    u = ca.SX.sym("u", len(drives))
    unknown = _make_coordinates(mechanism, {link: u[3 * k : 3 * k + 3] for k, link in enumerate(given_links)})
    # each by a name of its own: casadi's search for common expressions (3.8.2) may take those of one name for one
    p = stack_expressions(
        ca.SX.sym(f"of {pair.name} {k}") for pair in mechanism.pairs for k in range(len(pair.number_kinds))
    )
    numbers = split_pair_numbers(mechanism.pairs, p)
    closing = list(residuals(mechanism, unknown.frames, numbers, unknown.own, u[3 * len(given_links) :]))
    rows = [row for row, _ in closing]
    misfits = {row: ca.SX.sym(f"misfit {row}") for row in open_rows}
    values = [value - misfits[k] if k in misfits else value for k, (_, value) in enumerate(closing)]
    lines = split_constant_factors(values, unknown.symbols)

    solved: EliminationSteps = []
    columns: list[int] = []
    left: list[int] = []
    surplus: list[int] = []
    tied: set[int] = set()
    pair_rows = len(rows) - len(mechanism.inputs)
    for group in decompose_blocks([line.dependencies for line in lines], len(unknown.coordinates)):
        remaining_rows, remaining = eliminate(group.rows, group.columns, lines, solved)
        if len(group.rows) > len(group.columns):
            surplus += [row for row in group.rows if row < pair_rows]
        if misfits.keys() & set(group.rows):
            tied |= {*range(len(columns), len(columns) + len(remaining))}
        columns += remaining
        left += remaining_rows
    z = ca.SX.sym("z", len(columns))
    open_ones = [wrapped_residual(lines[row].as_expression(unknown.symbols), rows[row].kind) for row in left]
    wanted = [stack_expressions(open_ones), stack_expressions(unknown.symbols.values)]
    F, w = back_substitute(dict(zip(columns, ca.vertsplit(z), strict=True)), solved, unknown.symbols, wanted)
    kept = tuple(rows[row] for row in left)
    whole = ConstraintEquations(tuple(unknown.coordinates), tuple(columns), kept, (), (), z, u, p, w, F, drives)
    if misfits:
        whole = _with_least_misfit(whole, rows, left, misfits, sorted(tied))
    return _split_into_blocks(mechanism, whole), surplus


def _with_least_misfit(
    e: ConstraintEquations,
    rows: Sequence[ConstraintRow],
    left: Sequence[int],
    misfits: Mapping[int, ca.SX],
    tied: Sequence[int],
) -> ConstraintEquations:
    """Equations whose rows may stay open by their misfits, made those of the position of least misfit.

    `rows` are all rows, `left` those that elimination leaves, `tied` the unknowns that the misfits move.
    """
    from planar.equations.misfits.least_misfit import HELD, UNRELATED, least_misfit_equations  # few pairs may stay open

    found = least_misfit_equations(ca.vertcat(e.F, e.w), e.z, left, misfits, tied)
    first = len(e.coordinates)
    shown = [Coordinate(rows[row].pair, f"misfit {row}", rows[row].kind, False) for row in misfits]
    shown += [Coordinate(rows[left[k]].pair, "multiplier", MeasureKind.LENGTH, False) for k in found.held]
    place = {row: first + k for k, row in enumerate(misfits)}
    names = [rows[row].pair for row in left if row in misfits] or [rows[row].pair for row in misfits]
    labels = [ConstraintRow(names[k % len(names)], MeasureKind.ANGLE) for k in range(len(tied))]
    labels += [rows[row] for row in found.free] + [rows[left[k]] for k in (*found.held, *found.unrelated)]
    untied = [k for k in range(e.z.numel()) if k not in {*tied}]
    variables = [*(e.unknowns[k] for k in tied), *(place[row] for row in found.free)]
    multipliers = range(first + len(misfits), first + len(shown))
    return replace(
        e,
        coordinates=(*e.coordinates, *shown),
        unknowns=(*variables, *multipliers, *(e.unknowns[k] for k in untied)),
        rows=tuple(labels),
        z=ca.vertcat(found.unknowns, *(e.z[k] for k in untied)),
        p=ca.vertcat(e.p, found.weights),
        w=found.w,
        F=found.F,
        open_rows=tuple(misfits),
        misfit_columns=tuple(place.values()),
        row_variables=(*variables, *([HELD] * len(found.held)), *([UNRELATED] * len(found.unrelated))),
    )


def _split_into_blocks(mechanism: Mechanism, equations: ConstraintEquations) -> ConstraintEquations:
    """The shortened equations split once more, in the order in which they are solved.

    Only now does it show where constraints hold each other twice: angles that a ring of slides closes by itself
    have dropped out, and what was matched with them is free.
    """
    both, moved = _drop_idle_unknowns(equations)
    equations = replace(equations, F=both[: len(equations.rows)], w=both[len(equations.rows) :])
    groups = [
        group
        for group in decompose_blocks(moved[: len(equations.rows)], len(equations.unknowns))
        if group.rows or group.columns
    ]
    level_of = {column: level for level, group in enumerate(groups) for column in group.columns}
    known_from = tuple(max((level_of[column] for column in held), default=-1) for held in moved[len(equations.rows) :])
    stages, first_unknown, first_row = [], 0, 0
    level_of_link: dict[str, int] = {}
    for coordinate, level in zip(equations.coordinates, known_from, strict=True):
        if coordinate.of_link:
            level_of_link[coordinate.owner] = max(level, level_of_link.get(coordinate.owner, -1))
    placed_at: dict[int, dict[str, None]] = {}
    for c, known in zip(equations.coordinates, known_from, strict=True):
        if c.of_link:
            placed_at.setdefault(known, {})[c.owner] = None
    joined_at: dict[int, list[str]] = {}
    for pair in mechanism.pairs:
        joined_at.setdefault(max(level_of_link.get(link, -1) for link in pair.bodies), []).append(pair.name)
    for level, group in enumerate(groups):
        placed, joined = placed_at.get(level, {}), joined_at.get(level, [])
        stages.append(
            Block(
                slice(first_unknown, first_unknown + len(group.columns)),
                slice(first_row, first_row + len(group.rows)),
                tuple(placed),
                tuple(joined),
                group.is_free,
                level,
            )
        )
        first_unknown, first_row = stages[-1].unknowns.stop, stages[-1].rows.stop
    columns = [column for group in groups for column in group.columns]
    order = [row for group in groups for row in group.rows]
    return replace(
        equations,
        unknowns=tuple(equations.unknowns[column] for column in columns),
        rows=tuple(equations.rows[row] for row in order),
        blocks=tuple(stages),
        known_after_block=known_from,
        z=equations.z[columns],
        F=equations.F[order],
        row_variables=tuple(equations.row_variables[row] for row in order) if equations.row_variables else (),
    )


def _drop_idle_unknowns(equations: ConstraintEquations) -> tuple[ca.SX, list[set[int]]]:
    """F and w, one below the other, with no unknown in an entry that does not move it; and those that move each.

    What cancels in a sum shows in numbers only: an entry of the Jacobian that vanishes at random places is none. Left
    standing it would have a block, or a link, wait for unknowns that are solved after it.
    """
    both = ca.vertcat(equations.F, equations.w)
    touched = expression_unknowns(both, equations.z)
    if not any(touched):
        return both, touched
    slope = ca.Function("slope", [equations.z, equations.u, equations.p], [ca.jacobian(both, equations.z)])
    ends = np.cumsum([symbol.numel() for symbol in (equations.z, equations.u, equations.p)])
    found = [slope(*np.split(numbers, ends[:2])) for numbers in generic_numbers(2, ends[2])]
    seen = sum(np.abs(np.array(each.nonzeros())) for each in found)
    rows, columns = found[0].sparsity().get_triplet()
    alive = {(row, column) for row, column, value in zip(rows, columns, seen, strict=True) if value > 1e-12}
    moved = [{column for column in held if (row, column) in alive} for row, held in enumerate(touched)]
    idle = {row: sorted(held - moved[row]) for row, held in enumerate(touched) if held != moved[row]}
    for row, columns in idle.items():
        both[row] = ca.substitute(both[row], equations.z[columns], ca.SX.zeros(len(columns)))
    return both, moved


def _make_coordinates(mechanism: Mechanism, given: Mapping[str, ca.SX]) -> _MechanismCoordinates:
    coordinates: list[Coordinate] = []
    values: list[ca.SX] = []
    turned: dict[int, tuple[ca.SX, ca.SX]] = {}
    frames: dict[str, Frame] = {}

    def add(owner: str, part: str, kind: MeasureKind, of_link: bool) -> ca.SX:
        coordinates.append(Coordinate(owner, part, kind, of_link))
        values.append(ca.SX.sym(f"of {owner}.{part}"))
        return values[-1]

    for link in mechanism.links:
        if link.name == mechanism.frame:
            frames[link.name] = GROUND
            continue
        if link.name in given:
            frames[link.name] = frame_at(*ca.vertsplit(given[link.name]))
            continue
        x, y = (add(link.name, part, MeasureKind.LENGTH, True) for part in ("x", "y"))
        angle = add(link.name, "angle", MeasureKind.ANGLE, True)
        both = turned[len(values) - 1] = ca.SX.sym(f"cos {link.name}"), ca.SX.sym(f"sin {link.name}")
        frames[link.name] = Frame(x, y, *both, angle)
    own = {pair.name: [add(pair.name, *each, False) for each in pair.coordinate_kinds] for pair in mechanism.pairs}
    return _MechanismCoordinates(coordinates, CoordinateSymbols(values, turned), frames, own)


def is_piecewise_in(expression: ca.SX, symbols: ca.SX) -> bool:
    """Whether an expression changes its formula as these symbols change."""
    others = [each for each in ca.symvar(expression) if not ca.depends_on(symbols, each)]
    function = ca.Function("pieces", [symbols, ca.vertcat(ca.SX(0, 1), *others)], [expression])
    depends: dict[int, bool] = {}
    for k in range(function.n_instructions()):
        code, out, of = function.instruction_id(k), function.instruction_output(k), function.instruction_input(k)
        if code == ca.OP_INPUT:
            depends[out[0]] = of[0] == 0
        elif code == ca.OP_CONST:
            depends[out[0]] = False
        elif code != ca.OP_OUTPUT:
            depends[out[0]] = any(depends[each] for each in of)
            if depends[out[0]] and code in PIECEWISE_OPERATIONS:
                return True
    return False
