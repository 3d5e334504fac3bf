"""Symbolic elimination of the coordinates that enter constraints with constant factors.

x and y of a link enter a turning pair with factor one, and the angle of a sliding link the sliding pair: solving
these constraints for them leaves the loop equations by itself.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from heapq import heapify, heappop, heappush
from typing import TYPE_CHECKING, NamedTuple

from planar.foundation.lazy_module import LazyModule

if TYPE_CHECKING:
    import casadi as ca
else:
    ca = LazyModule("casadi")  # known types of elements and blocks do without expressions


CANCELLATION_TOLERANCE = 1e-12
"""A factor below this part of those that it was made of is what rounding left of zero."""
MAX_SHORT_LOOP = 12
"""Solutions that are put into a constraint, or rows on a path between two coordinates, up to which it is short."""


class CoordinateSymbols(NamedTuple):
    """The coordinates' symbols, and for each that is an angle, by its index, those of its cos and sin."""

    values: Sequence[ca.SX]
    cos_sin: dict[int, tuple[ca.SX, ca.SX]]


@dataclass
class EliminationRow:
    """A constraint under elimination: sum of factor * coordinate, plus a rest that is not linear in them.

    The rest is a sum of rests of the pairs' own rows, each times its multiplier.
    """

    factors: dict[int, float]
    multipliers: dict[int, float]
    rest_coordinates: set[int]
    "coordinates on which the rest depends"
    nonlinear: set[int]
    "coordinates that the constraint depends on, through others or not, other than by its factors"

    @property
    def dependencies(self) -> set[int]:
        """Every coordinate on which the constraint depends."""
        return set(self.factors) | self.nonlinear

    def rest(self, rests: Sequence[ca.SX]) -> ca.SX:
        """The rest as an expression, from those of the pairs' rows."""
        total: ca.SX | None = None
        for row, multiplier in self.multipliers.items():
            term = rests[row] if multiplier == 1.0 else multiplier * rests[row]
            total = term if total is None else total + term
        return ca.SX(0.0) if total is None else total

    def as_expression(self, symbols: CoordinateSymbols, rests: Sequence[ca.SX]) -> ca.SX:
        """The constraint as one expression."""
        return sum((slope * symbols.values[column] for column, slope in self.factors.items()), self.rest(rests))


EliminationSteps = list[tuple[int, EliminationRow]]
"""Coordinates in the order of their elimination, each with the constraint that gives it."""


def stack_expressions(expressions: Iterable[ca.SX]) -> ca.SX:
    """Expressions one below the other, symbolic though there be none."""
    return ca.vertcat(ca.SX(0, 1), *expressions)


def eliminate(
    rows: Sequence[int], columns: Sequence[int], constraints: Sequence[EliminationRow], solved: EliminationSteps
) -> tuple[list[int], list[int]]:
    """Solve constraints of a block for one coordinate each, the shortest first; `solved` grows by them.

    Returns the rows and columns of the block that remain.
    """
    remaining_rows, remaining = list(rows), set(columns)
    while True:
        best: tuple[tuple[int, int, int], int, int] | None = None
        for row in remaining_rows:
            line = constraints[row]
            inside = [column for column in line.factors if column in remaining]
            size = len(inside) + len(line.nonlinear & remaining)
            for column in inside:
                if column not in line.nonlinear and (best is None or (size, row, column) < best[0]):
                    best = (size, row, column), row, column
        if best is None:
            return remaining_rows, sorted(remaining)
        _, pivot_row, pivot = best
        remaining_rows.remove(pivot_row)
        remaining.discard(pivot)
        by = constraints[pivot_row]
        solved.append((pivot, by))
        for row in remaining_rows:
            _substitute_pivot(constraints[row], pivot, by)


def _substitute_pivot(line: EliminationRow, pivot: int, pivot_line: EliminationRow) -> None:
    """Put the solution of `by` for the pivot into another constraint."""
    if pivot in line.nonlinear:
        line.nonlinear.discard(pivot)
        line.nonlinear |= (set(pivot_line.factors) | pivot_line.nonlinear) - {pivot}
    if pivot in line.factors:
        substitute_solution(line.factors, line.multipliers, pivot, pivot_line)
        line.rest_coordinates |= pivot_line.rest_coordinates
        line.nonlinear |= pivot_line.nonlinear


def substitute_solution(
    factors: dict[int, float], multipliers: dict[int, float], pivot: int, pivot_line: EliminationRow
) -> None:
    """Put a constraint's solution for a coordinate into a sum of coordinates and of rests of rows."""
    ratio = factors.pop(pivot) / pivot_line.factors[pivot]
    for column, slope in pivot_line.factors.items():
        if column != pivot:
            _add_term(factors, column, -ratio * slope)
    for row, multiplier in pivot_line.multipliers.items():
        _add_term(multipliers, row, -ratio * multiplier)


def _add_term(terms: dict[int, float], key: int, term: float) -> None:
    """Add to a factor of a sum; one that cancels is left out."""
    previous = terms.get(key, 0.0)
    total = previous + term
    if abs(total) <= CANCELLATION_TOLERANCE * max(abs(previous), abs(term)):
        terms.pop(key, None)
    else:
        terms[key] = total


def substitute_solutions(
    factors: dict[int, float],
    multipliers: dict[int, float],
    solved: Sequence[tuple[int, EliminationRow]],
    place_of: Mapping[int, int],
    limit: int | None = None,
) -> bool:
    """Put the solutions for all coordinates that were solved for into a sum of coordinates and of rests of rows.

    The last one goes first (`place_of` has the places in `solved`): what cancels is not followed to the frame.
    Returns whether that took fewer solutions than `limit`; if not, the sum stays as it is then.
    """
    places = [-place_of[column] for column in factors if column in place_of]
    heapify(places)
    count = 0
    while places:
        column, line = solved[-heappop(places)]
        if column not in factors:  # it cancelled, or stood there twice
            continue
        for other in line.factors:
            if other != column and other not in factors and other in place_of:
                heappush(places, -place_of[other])
        substitute_solution(factors, multipliers, column, line)
        count += 1
        if count == limit:
            return False
    return True


class EarlierRows:
    """The rows of earlier blocks that tie two coordinates by equal factors.

    In a tower of loops a constraint between two links of a stage leads, solution by solution, down to the frame and up
    again. A path from one coordinate to the other by few rows of the stages below shortens it.
    """

    def __init__(self, solved: EliminationSteps):
        self._solved = solved
        self._order: dict[int, int] = {}
        self._ties: dict[int, list[tuple[int, EliminationRow]]] = {}
        "for every coordinate the others that a row ties to it, with the row as the pair has it"

    def add(self, line: EliminationRow) -> None:
        """A row of a block that is done, as it was before elimination."""
        if len(line.factors) == 2:
            (one, first), (other, second) = line.factors.items()
            if abs(first) == abs(second):
                self._ties.setdefault(one, []).append((other, line))
                self._ties.setdefault(other, []).append((one, line))

    def shorten(self, line: EliminationRow) -> None:
        """Take rows of earlier blocks into a constraint between two of their coordinates if that makes it short."""
        for place in range(len(self._order), len(self._solved)):
            self._order[self._solved[place][0]] = place
        endpoints = [column for column in line.factors if column in self._order]
        sums = dict(line.factors), dict(line.multipliers)
        if len(endpoints) != 2 or substitute_solutions(*sums, self._solved, self._order, MAX_SHORT_LOOP):
            return
        path = self._path_between(*endpoints)
        if path is None:
            return
        factors, multipliers = dict(line.factors), dict(line.multipliers)
        column = endpoints[0]
        for other, by in path:
            substitute_solution(factors, multipliers, column, by)
            column = other
        if column in factors:  # it does not cancel
            return
        line.factors, line.multipliers = factors, multipliers
        for _, by in path:
            line.rest_coordinates |= by.rest_coordinates

    def _path_between(self, start: int, end: int) -> list[tuple[int, EliminationRow]] | None:
        """The shortest path from one coordinate to another: coordinates with the rows that lead to them."""
        reached_by: dict[int, tuple[int, EliminationRow] | None] = {start: None}
        front = [start]
        for _ in range(MAX_SHORT_LOOP):
            next_front: list[int] = []
            for column in front:
                for other, line in self._ties.get(column, ()):
                    if other not in reached_by:
                        reached_by[other] = column, line
                        next_front.append(other)
            front = next_front
            if end in reached_by:
                path = []
                while (step := reached_by[end]) is not None:
                    path.append((end, step[1]))
                    end = step[0]
                return path[::-1]
        return None


def back_substitute(
    remaining: dict[int, ca.SX],
    solved: Sequence[tuple[int, EliminationRow]],
    symbols: CoordinateSymbols,
    rests: Sequence[ca.SX],
    expressions: list[ca.SX],
) -> list[ca.SX]:
    """Expressions with every coordinate replaced: the remaining ones as given, the solved ones by their constraints, in
    an order in which they can be computed."""
    replaced: list[ca.SX] = []
    by: list[ca.SX] = []
    for column, value in remaining.items():
        replaced.append(symbols.values[column])
        by.append(value)
        if column in symbols.cos_sin:
            replaced += symbols.cos_sin[column]
            by += [ca.cos(value), ca.sin(value)]
    for column, line in solved:
        factor = line.factors[column]
        others = {other: -slope / factor for other, slope in line.factors.items() if other != column}
        rest = -line.rest(rests) / factor
        replaced.append(symbols.values[column])
        by.append(sum((slope * symbols.values[other] for other, slope in others.items()), rest))
        if column in symbols.cos_sin:
            replaced += symbols.cos_sin[column]
            by += _cos_sin_of_sum(by[-1], others, rest, symbols)
    return ca.substitute_inplace(replaced, by, expressions)[1] if replaced else expressions


def _cos_sin_of_sum(angle: ca.SX, others: dict[int, float], rest: ca.SX, symbols: CoordinateSymbols) -> list[ca.SX]:
    """cos and sin of an angle that is a sum of angles, from theirs where that needs no new sine of an unknown."""
    if not all(abs(slope) == 1.0 and other in symbols.cos_sin for other, slope in others.items()):
        return [ca.cos(angle), ca.sin(angle)]
    cosine, sine = (ca.cos(rest), ca.sin(rest)) if not rest.is_zero() else (ca.SX(1), ca.SX(0))
    for other, slope in others.items():
        c, s = symbols.cos_sin[other][0], slope * symbols.cos_sin[other][1]
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
    return [cosine, sine]


def dependency_order(solved: EliminationSteps) -> EliminationSteps:
    """The solved coordinates, each after those in which it is expressed."""
    line_of = dict(solved)
    done: dict[int, EliminationRow] = {}
    for start in line_of:
        waiting = [start]
        while waiting:
            column = waiting[-1]
            line = line_of[column]
            open_ones = [
                other
                for other in (set(line.factors) | line.rest_coordinates) - {column}
                if other in line_of and other not in done
            ]
            if open_ones:
                waiting += sorted(open_ones)
            else:
                done.setdefault(waiting.pop(), line)
    return list(done.items())


def expression_unknowns(expressions: ca.SX, z: ca.SX) -> list[set[int]]:
    """The entries of z on which each expression depends."""
    unknowns: list[set[int]] = [set() for _ in range(expressions.numel())]
    for row, column in zip(*ca.jacobian_sparsity(expressions, z).get_triplet(), strict=True):
        unknowns[row].add(column)
    return unknowns
