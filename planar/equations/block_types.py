"""Block types: blocks whose equations are the same from the coordinates that are known ahead of them on.

Each is derived once, whatever the mechanism and wherever in it the block stands, and its functions take only what its
own equations need: its unknowns, the coordinates of earlier blocks and inputs next to it, and its numbers.
"""

from __future__ import annotations

from collections.abc import Hashable, Sequence
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from planar.equations.assembled_equations import Elimination
from planar.equations.coordinates import Coordinate
from planar.equations.elements import Element, PlacedElement, fingerprint
from planar.equations.elimination import EliminationRow
from planar.equations.residuals import ConstraintRow
from planar.equations.symbolic_equations import Block, ConstraintEquations, expressions_of_elimination
from planar.foundation.arrays import IntArray
from planar.model.pairs import MeasureKind

MAX_BLOCK_TYPES = 1024


class BlockTypeKey(NamedTuple):
    """What a block type is derived from, all indices of coordinates local: the block's own ones, then known ones."""

    elements: tuple[tuple[Element, tuple[int, ...], tuple[int, ...]], ...]
    "each with its coordinates and numbers"
    solved: tuple[tuple[int, Hashable, Hashable], ...]
    "own coordinates that are eliminated, with the factors and multipliers of their rows"
    residuals: tuple[tuple[Hashable, Hashable], ...]
    "factors and multipliers of the rows that remain"
    row_kinds: tuple[MeasureKind, ...]
    own_kinds: tuple[tuple[MeasureKind, bool], ...]
    "what every own coordinate is, and whether it is one of a link"
    unknown_count: int
    "of own coordinates, which stand first"
    known_kinds: tuple[MeasureKind, ...]
    number_count: int

    @property
    def fingerprint(self) -> str:
        """What tells the type from others in every process."""
        elements = [(element.fingerprint, *places) for element, *places in self.elements]
        kinds = [kind.name for kind in (*self.row_kinds, *self.known_kinds)]
        own_kinds = [(kind.name, of_link) for kind, of_link in self.own_kinds]
        counts = len(self.row_kinds), self.unknown_count, self.number_count
        return fingerprint(elements, self.solved, self.residuals, kinds, own_kinds, counts)


class PlacedBlock(NamedTuple):
    """A block of a structure by its type: `known` index (w, u), `numbers` p, `coordinates` w."""

    key: BlockTypeKey
    known: IntArray
    numbers: IntArray
    coordinates: IntArray


def place_blocks(e: ConstraintEquations) -> tuple[PlacedBlock | None, ...]:
    """The types of all blocks; None for a block whose rows do not follow from earlier blocks term by term."""
    if e.elimination is None:
        return (None,) * len(e.blocks)
    elimination = e.elimination
    placer = _BlockPlacer(e, elimination)
    columns_of_level: list[list[int]] = [[] for _ in e.blocks]
    for column, level in enumerate(e.known_after_block):
        if level >= 0:
            columns_of_level[level].append(column)
    return tuple(placer.place(block, columns_of_level[block.block_index]) for block in e.blocks)


def place_input_coordinates(e: ConstraintEquations) -> tuple[PlacedBlock | None, ...]:
    """The coordinates that follow from the inputs alone as blocks without unknowns, one for each link or pair, in an
    order in which they can be computed."""
    if e.elimination is None:
        return ()
    placer = _BlockPlacer(e, e.elimination)
    groups: list[list[int]] = []
    for column, _ in e.elimination.solved:
        if e.known_after_block[column] < 0:
            if not groups or e.coordinates[groups[-1][-1]].owner != e.coordinates[column].owner:
                groups.append([])
            groups[-1].append(column)
    return tuple(placer.place(INPUT_BLOCK, columns) for columns in groups)


INPUT_BLOCK = Block(slice(0, 0), slice(0, 0), (), (), False, 0)
"""What stands for a block where nothing is unknown."""


class _BlockPlacer:
    def __init__(self, e: ConstraintEquations, elimination: Elimination):
        self._equations, self._elimination = e, elimination
        self._line_of = dict(elimination.solved)
        self._order = {column: place for place, (column, _) in enumerate(elimination.solved)}
        self._element_of_row = {row: placed for placed in elimination.elements for row in placed.rows}

    def place(self, block: Block, columns: Sequence[int]) -> PlacedBlock | None:
        """A block by its type; `columns` are the coordinates that are known after it."""
        e, elimination = self._equations, self._elimination
        unknowns = list(e.unknowns[block.unknowns])
        solved = sorted((column for column in columns if column in self._order), key=self._order.__getitem__)
        columns_inside = [*unknowns, *solved]
        if set(columns_inside) != set(columns) or block.is_free:
            return None
        residual_lines = [elimination.lines[row] for row in e.row_indices[block.rows]]
        solved_lines = [self._line_of[column] for column in solved]
        local = _LocalIndices(columns_inside)
        elements = self._place_elements((*solved_lines, *residual_lines), local, block.block_index)
        if elements is None:
            return None

        def terms(line: EliminationRow) -> tuple[Hashable, Hashable]:
            return (
                tuple((local.of_column(column), factor) for column, factor in line.factors.items()),
                tuple((local.rows[row], multiplier) for row, multiplier in line.multipliers.items()),
            )

        own_lines = zip(solved, solved_lines, strict=True)
        solved_terms = tuple((local.of_column(column), *terms(line)) for column, line in own_lines)
        residual_terms = tuple(terms(line) for line in residual_lines)
        if any(self._is_behind(column, block.block_index) for column in local.known):
            return None
        kinds = [*(coordinate.kind for coordinate in e.coordinates), *e.input_kinds]
        key = BlockTypeKey(
            elements,
            solved_terms,
            residual_terms,
            tuple(row.kind for row in e.rows[block.rows]),
            tuple((e.coordinates[column].kind, e.coordinates[column].of_link) for column in columns_inside),
            len(unknowns),
            tuple(kinds[column] for column in local.known),
            len(local.numbers),
        )
        indices = local.known, local.numbers, columns_inside
        return PlacedBlock(key, *(np.array(part, dtype=int) for part in indices))

    def _place_elements(
        self, lines: Sequence[EliminationRow], local: _LocalIndices, level: int
    ) -> tuple[tuple[Element, tuple[int, ...], tuple[int, ...]], ...] | None:
        """The elements of lines by local indices; None where they need what is not known ahead of a block."""
        needed_rows = {row for line in lines for row in line.multipliers}
        first_input = len(self._equations.coordinates)
        elements = []
        of_rows = (self._element_of_row[row] for line in lines for row in line.multipliers)
        for placed in {placed.rows.start: placed for placed in of_rows}.values():
            taken = placed.element.arguments.numbers
            number_of = {k: len(local.numbers) + place for place, k in enumerate(taken)}
            local.numbers += [placed.numbers[k] for k in taken]
            for row in placed.rows:
                local.rows[row] = len(local.rows)
            used: set[int] = set().union(*placed.element.nonlinear, placed.element.arguments.coordinates)
            # of rows that are not needed here it does not matter what is put in
            stand_ins = {
                k
                for k in used
                if placed.coordinates[k] not in local.places and self._is_behind(placed.coordinates[k], level)
            }
            by_row = zip(placed.rows, placed.element.nonlinear, strict=True)
            needed: set[int] = set().union(*(columns for row, columns in by_row if row in needed_rows))
            if stand_ins and not (self._equations.input_kinds and stand_ins.isdisjoint(needed)):
                return None
            coordinates = tuple(
                local.of_column(first_input if k in stand_ins else column) if k in used else -1
                for k, column in enumerate(placed.coordinates)
            )
            elements.append(
                (placed.element, coordinates, tuple(number_of.get(k, -1) for k in range(len(placed.numbers))))
            )
        return tuple(elements)

    def _is_behind(self, column: int, level: int) -> bool:
        """Whether a coordinate is not known ahead of a block of this level."""
        return column < len(self._equations.coordinates) and self._equations.known_after_block[column] >= level


class _LocalIndices:
    """Indices of a block's own: coordinates, its own ones first, then those that it takes as known; rows, numbers."""

    def __init__(self, columns_inside: Sequence[int]):
        self.places = {column: k for k, column in enumerate(columns_inside)}
        self.known: list[int] = []
        self.rows: dict[int, int] = {}
        self.numbers: list[int] = []

    def of_column(self, column: int) -> int:
        """That of a coordinate or input by its index in (w, u)."""
        if column not in self.places:
            self.places[column] = len(self.places)
            self.known.append(column)
        return self.places[column]


@lru_cache(maxsize=MAX_BLOCK_TYPES)
def block_equations(key: BlockTypeKey) -> ConstraintEquations:
    """The equations of a block type: z its unknowns, u the coordinates that are known ahead of it, w its own ones."""
    count = len(key.own_kinds)
    elements: list[PlacedElement] = []
    row_count = 0
    for element, columns, numbers in key.elements:
        element_rows = range(row_count, row_count + element.row_count)
        elements.append(PlacedElement(element, columns, numbers, element_rows))
        row_count = element_rows.stop
    solved = tuple((column, _line(factors, multipliers)) for column, factors, multipliers in key.solved)
    lines = tuple(_line(factors, multipliers) for factors, multipliers in key.residuals)
    elimination = Elimination(tuple(elements), solved, lines, count, len(key.known_kinds), key.number_count)
    coordinates = tuple(Coordinate(f"own {k}", "angle", *kind) for k, kind in enumerate(key.own_kinds))
    rows = tuple(ConstraintRow("", kind) for kind in key.row_kinds)
    unknowns = tuple(range(key.unknown_count))
    names = [f"number {k}" for k in range(key.number_count)]
    block = Block(slice(0, key.unknown_count), slice(0, len(rows)), (), (), False, 0)
    return ConstraintEquations(
        coordinates,
        unknowns,
        rows,
        (block,),
        (0,) * count,
        key.known_kinds,
        make_expressions=lambda: expressions_of_elimination(
            elimination, coordinates, key.known_kinds, unknowns, list(enumerate(key.row_kinds)), names, {}
        ),
        elimination=elimination,
        row_indices=tuple(range(len(rows))),
    )


def _line(factors: Hashable, multipliers: Hashable) -> EliminationRow:
    return EliminationRow(dict(factors), dict(multipliers), set(), set())  # type: ignore[call-overload]  # of a key
