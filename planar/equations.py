"""The constraint equations of a mechanism, built once as casadi SX, split into groups and shortened inside each.

Symbol table, used in every room above this one (lengths divided by the mechanism's size, angles in rad):

====  ==========================================================================  ============
z     unknown coordinates that remain after elimination                           (unknowns,)
u     positions of the inputs, in the order of the mechanism's inputs             (inputs,)
p     numbers that the pairs take from the shapes of their links                  (numbers,)
w     x, y, angle of every moving link, then every pair's own coordinates         (coordinates,)
F     what the remaining constraints leave open, group after group                (rows,)
====  ==========================================================================  ============
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.groups import decompose
from planar.mechanism import Mechanism, motions
from planar.pairs import Kind, Pair
from planar.plane import GROUND, Frame


class Coordinate(NamedTuple):
    """One entry of w: a part of a link's frame ("x", "y", "angle"), or a coordinate of a pair's own."""

    owner: str
    part: str
    kind: Kind
    of_link: bool


class Row(NamedTuple):
    """One constraint: of a pair, or of an input at it."""

    pair: str
    kind: Kind
    is_input: bool


class Stage(NamedTuple):
    """A group after elimination: which entries of z and of F it has, and the links and pairs that it is about."""

    unknowns: slice
    rows: slice
    links: tuple[str, ...]
    pairs: tuple[str, ...]
    free: bool
    level: int


@dataclass(frozen=True, eq=False)
class Equations:
    """See the module's symbol table; `coordinates`, `rows`, `unknowns` say which name owns which entry."""

    coordinates: tuple[Coordinate, ...]
    unknowns: tuple[int, ...]
    rows: tuple[Row, ...]
    stages: tuple[Stage, ...]
    known_from: tuple[int, ...]
    """For every coordinate the stage after which it is known; -1 for one that follows from the inputs alone."""
    z: ca.SX
    u: ca.SX
    p: ca.SX
    w: ca.SX
    F: ca.SX


@dataclass
class _Line:
    """A constraint under elimination: sum of factor * coordinate, plus a rest that is not linear in them."""

    factors: dict[int, float]
    rest: ca.SX
    in_rest: set[int]
    "coordinates whose symbols stand in `rest`"
    bent: set[int]
    "coordinates that the constraint depends on, through others or not, other than by its factors"


@dataclass
class _Symbols:
    mechanism: Mechanism
    coordinates: list[Coordinate] = field(default_factory=list)
    values: list[ca.SX] = field(default_factory=list)
    turned: dict[int, tuple[ca.SX, ca.SX]] = field(default_factory=dict)
    "cos and sin of each angle coordinate"
    frames: dict[str, Frame] = field(default_factory=dict)
    own: dict[str, list[ca.SX]] = field(default_factory=dict)

    def add(self, owner: str, part: str, kind: Kind, of_link: bool) -> ca.SX:
        symbol = ca.SX.sym(f"{owner}.{part}")
        self.coordinates.append(Coordinate(owner, part, kind, of_link))
        self.values.append(symbol)
        return symbol


def build(mechanism: Mechanism) -> Equations:
    """The equations of a mechanism; only its structure matters, its numbers are `p` and `u`."""
    symbols = _coordinates(mechanism)
    p, numbers = _numbers(mechanism)
    u = ca.SX.sym("u", len(mechanism.inputs))
    closures, rows = _closures(mechanism, symbols, numbers, u)
    lines, depends = _lines(closures, symbols)
    groups = decompose(depends, len(symbols.coordinates))

    solved: list[tuple[int, _Line]] = []
    unknowns: list[int] = []
    left: list[int] = []
    for group in groups:
        remaining_rows, remaining = _eliminate(group.rows, group.columns, lines, solved)
        unknowns += remaining
        left += remaining_rows
    symbol = ca.SX.sym("z", len(unknowns))
    F, w = _written_in(symbol, unknowns, left, [rows[row] for row in left], lines, solved, symbols)
    whole = Equations(
        tuple(symbols.coordinates), tuple(unknowns), tuple(rows[row] for row in left), (), (), symbol, u, p, w, F
    )
    return _staged(mechanism, whole)


def _staged(mechanism: Mechanism, whole: Equations) -> Equations:
    """The shortened equations split once more, in the order in which they are solved.

    Only now does it show where constraints hold each other twice: angles that a ring of slides closes by itself
    have dropped out, and what was matched with them is free.
    """
    groups = [group for group in decompose(_moved(whole), len(whole.unknowns)) if group.rows or group.columns]
    level_of = {column: level for level, group in enumerate(groups) for column in group.columns}
    known_from = tuple(max((level_of[column] for column in held), default=-1) for held in _touched(whole.w, whole.z))
    stages, first_unknown, first_row = [], 0, 0
    level_of_link: dict[str, int] = {}
    for coordinate, level in zip(whole.coordinates, known_from, strict=True):
        if coordinate.of_link:
            level_of_link[coordinate.owner] = max(level, level_of_link.get(coordinate.owner, -1))
    for level, group in enumerate(groups):
        placed = {
            c.owner: None
            for c, known in zip(whole.coordinates, known_from, strict=True)
            if c.of_link and known == level
        }
        joined = [
            pair.name for pair in mechanism.pairs if max(level_of_link.get(link, -1) for link in pair.links) == level
        ]
        stages.append(
            Stage(
                slice(first_unknown, first_unknown + len(group.columns)),
                slice(first_row, first_row + len(group.rows)),
                tuple(placed),
                tuple(joined),
                group.free,
                level,
            )
        )
        first_unknown, first_row = stages[-1].unknowns.stop, stages[-1].rows.stop
    columns = [column for group in groups for column in group.columns]
    order = [row for group in groups for row in group.rows]
    return replace(
        whole,
        unknowns=tuple(whole.unknowns[column] for column in columns),
        rows=tuple(whole.rows[row] for row in order),
        stages=tuple(stages),
        known_from=known_from,
        z=whole.z[columns],
        F=whole.F[order],
    )


def _moved(whole: Equations) -> list[set[int]]:
    """The unknowns that really move each remaining constraint.

    What cancels in a sum shows in numbers only: an entry of the slope that vanishes at random places is none.
    """
    touched = _touched(whole.F, whole.z)
    if not any(touched):
        return touched
    slope = ca.Function("slope", [whole.z, whole.u, whole.p], [ca.densify(ca.jacobian(whole.F, whole.z))])
    rng = np.random.default_rng(0)
    sizes = [symbol.numel() for symbol in (whole.z, whole.u, whole.p)]
    seen = sum(np.abs(slope(*(rng.uniform(0.5, 2.0, size) for size in sizes)).full()) for _ in range(2))
    return [{column for column in held if seen[row, column] > 1e-12} for row, held in enumerate(touched)]


def _touched(expressions: ca.SX, z: ca.SX) -> list[set[int]]:
    """The entries of z on which each expression depends."""
    held: list[set[int]] = [set() for _ in range(expressions.numel())]
    for row, column in zip(*ca.jacobian_sparsity(expressions, z).get_triplet(), strict=True):
        held[row].add(column)
    return held


def stack(expressions: Iterable[ca.SX]) -> ca.SX:
    """Expressions one below the other, symbolic though there be none."""
    return ca.vertcat(ca.SX(0, 1), *expressions)


def _coordinates(mechanism: Mechanism) -> _Symbols:
    symbols = _Symbols(mechanism)
    for link in mechanism.links:
        if link.name == mechanism.frame:
            symbols.frames[link.name] = GROUND
            continue
        x = symbols.add(link.name, "x", Kind.LENGTH, True)
        y = symbols.add(link.name, "y", Kind.LENGTH, True)
        angle = symbols.add(link.name, "angle", Kind.ANGLE, True)
        turned = ca.SX.sym(f"cos {link.name}"), ca.SX.sym(f"sin {link.name}")
        symbols.turned[len(symbols.values) - 1] = turned
        symbols.frames[link.name] = Frame(x, y, *turned, angle)
    for pair in mechanism.pairs:
        symbols.own[pair.name] = [symbols.add(pair.name, part, kind, False) for part, kind in pair.coordinates]
    return symbols


def _numbers(mechanism: Mechanism) -> tuple[ca.SX, dict[str, list[ca.SX]]]:
    """A symbol for each number of each pair, in the order in which `program.fitted` fills them."""
    numbers = {pair.name: [ca.SX.sym(pair.name) for _ in pair.measures] for pair in mechanism.pairs}
    return stack(symbol for each in numbers.values() for symbol in each), numbers


def _closures(
    mechanism: Mechanism, symbols: _Symbols, numbers: dict[str, list[ca.SX]], u: ca.SX
) -> tuple[list[ca.SX], list[Row]]:
    """Every constraint that must vanish: the residuals of all pairs, then drive minus position of all inputs."""
    closures: list[ca.SX] = []
    rows: list[Row] = []

    def applied(formula: str, pair: Pair) -> ca.SX | Sequence[ca.SX]:
        first, second = (symbols.frames[link] for link in pair.links)
        return getattr(pair, formula)(first, second, numbers.get(pair.name), symbols.own.get(pair.name))

    for pair in mechanism.pairs:
        closures += applied("residual", pair)
        rows += [Row(pair.name, kind, False) for kind in pair.constrains]
    named = motions(mechanism)
    for index, given in enumerate(mechanism.inputs):
        pair = named[given.pair]
        closures.append(applied("drive", pair) - u[index])
        rows.append(Row(pair.name, pair.drive_kind, True))
    return closures, rows


def _lines(closures: list[ca.SX], symbols: _Symbols) -> tuple[list[_Line], list[set[int]]]:
    """The constraints with their constant factors taken out, and the coordinates on which each depends."""
    count = len(symbols.values)
    both = [symbol for pair in symbols.turned.values() for symbol in pair]
    owner = [index for index in symbols.turned for _ in range(2)]
    everything = stack([*symbols.values, *both])
    stacked = stack(closures)
    slopes = ca.jacobian(stacked, everything)
    factors: list[dict[int, float]] = [{} for _ in closures]
    bent: list[set[int]] = [set() for _ in closures]
    crooked: set[int] = set()
    rows, columns = slopes.sparsity().get_triplet()
    for row, column, slope in zip(rows, columns, slopes.nonzeros(), strict=True):
        if column < count and slope.is_constant():
            factors[row][column] = float(slope)
        else:
            bent[row].add(column if column < count else owner[column - count])
            if column < count:
                crooked.add(column)
    # a symbol that is linear wherever it stands is taken out of all constraints at once, any other one by one
    straight = [column for column in range(count) if column not in crooked]
    zeroed = stack(symbols.values[index] for index in straight)
    rest = ca.vertsplit(ca.substitute(stacked, zeroed, ca.SX.zeros(len(straight))))
    lines = []
    for row, expression in enumerate(rest):
        bends = [symbols.values[column] for column in factors[row] if column in crooked]
        straightened = ca.substitute(expression, ca.vertcat(*bends), ca.SX.zeros(len(bends))) if bends else expression
        lines.append(_Line(factors[row], straightened, set(bent[row]), set(bent[row])))
    return lines, [set(line.factors) | line.bent for line in lines]


def _eliminate(
    rows: Sequence[int], columns: Sequence[int], lines: list[_Line], solved: list[tuple[int, _Line]]
) -> tuple[list[int], list[int]]:
    """Solve constraints with constant factors for one coordinate each, the shortest first.

    x and y of a link enter a turning pair with factor one, so this leaves the loop equations by itself.
    Returns the rows and columns of the group that remain.
    """
    remaining_rows, remaining = list(rows), set(columns)
    while True:
        best: tuple[tuple[int, int, int], int, int] | None = None
        for row in remaining_rows:
            line = lines[row]
            inside = [column for column in line.factors if column in remaining]
            size = len(inside) + len(line.bent & remaining)
            for column in inside:
                if column not in line.bent and (best is None or (size, row, column) < best[0]):
                    best = (size, row, column), row, column
        if best is None:
            return remaining_rows, sorted(remaining)
        _, pivot_row, pivot = best
        remaining_rows.remove(pivot_row)
        remaining.discard(pivot)
        by = lines[pivot_row]
        solved.append((pivot, by))
        for row in remaining_rows:
            _replace(lines[row], pivot, by)


def _replace(line: _Line, pivot: int, by: _Line) -> None:
    """Put the solution of `by` for the pivot into another constraint."""
    if pivot in line.bent:
        line.bent.discard(pivot)
        line.bent |= (set(by.factors) | by.bent) - {pivot}
    factor = line.factors.pop(pivot, 0.0)
    if factor == 0.0:
        return
    ratio = factor / by.factors[pivot]
    for column, slope in by.factors.items():
        if column != pivot:
            total = line.factors.get(column, 0.0) - ratio * slope
            if total == 0.0:
                line.factors.pop(column, None)
            else:
                line.factors[column] = total
    line.rest = line.rest - ratio * by.rest
    line.in_rest |= by.in_rest
    line.bent |= by.bent


def _written_in(
    z: ca.SX,
    unknowns: list[int],
    left: list[int],
    rows: list[Row],
    lines: list[_Line],
    solved: list[tuple[int, _Line]],
    symbols: _Symbols,
) -> tuple[ca.SX, ca.SX]:
    """The remaining constraints and all coordinates as expressions of z, u and p alone."""
    replaced: list[ca.SX] = []
    by: list[ca.SX] = []
    for index, column in enumerate(unknowns):
        replaced.append(symbols.values[column])
        by.append(z[index])
        if column in symbols.turned:
            replaced += symbols.turned[column]
            by += [ca.cos(z[index]), ca.sin(z[index])]
    for column, line in _in_order(solved):
        factor = line.factors[column]
        others = {other: -slope / factor for other, slope in line.factors.items() if other != column}
        rest = -line.rest / factor
        replaced.append(symbols.values[column])
        by.append(sum((slope * symbols.values[other] for other, slope in others.items()), rest))
        if column in symbols.turned:
            replaced += symbols.turned[column]
            by += _turned(by[-1], others, rest, symbols)
    left_over = [_total(lines[row], symbols) for row in left]
    for index, row in enumerate(rows):
        if row.kind is Kind.ANGLE and not row.is_input:
            left_over[index] = ca.atan2(ca.sin(left_over[index]), ca.cos(left_over[index]))
    F, w = stack(left_over), stack(symbols.values)
    return tuple(ca.substitute_inplace(replaced, by, [F, w])[1]) if replaced else (F, w)


def _total(line: _Line, symbols: _Symbols) -> ca.SX:
    return sum((slope * symbols.values[column] for column, slope in line.factors.items()), line.rest)


def _turned(angle: ca.SX, others: dict[int, float], rest: ca.SX, symbols: _Symbols) -> list[ca.SX]:
    """cos and sin of an angle that is a sum of angles, from theirs where that needs no new sine of an unknown."""
    if not all(abs(slope) == 1.0 and other in symbols.turned for other, slope in others.items()):
        return [ca.cos(angle), ca.sin(angle)]
    cosine, sine = (ca.cos(rest), ca.sin(rest)) if not rest.is_zero() else (ca.SX(1), ca.SX(0))
    for other, slope in others.items():
        c, s = symbols.turned[other][0], slope * symbols.turned[other][1]
        cosine, sine = cosine * c - sine * s, sine * c + cosine * s
    return [cosine, sine]


def _in_order(solved: list[tuple[int, _Line]]) -> list[tuple[int, _Line]]:
    """The solved coordinates, each after those in which it is expressed."""
    line_of = dict(solved)
    done: dict[int, _Line] = {}
    for start in line_of:
        waiting = [start]
        while waiting:
            column = waiting[-1]
            line = line_of[column]
            open_ones = [
                other
                for other in (set(line.factors) | line.in_rest) - {column}
                if other in line_of and other not in done
            ]
            if open_ones:
                waiting += sorted(open_ones)
            else:
                done.setdefault(waiting.pop(), line)
    return list(done.items())
