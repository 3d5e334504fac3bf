"""The constraint equations of a mechanism, built once as casadi SX, split into groups and shortened inside each.

Symbol table, used in every room above this one (lengths divided by the mechanism's size, angles in rad):

====  ==========================================================================  ============
z     unknown coordinates that remain after elimination                           (unknowns,)
u     x, y, angle of every given link, then positions of the inputs, in order     (inputs,)
p     numbers that the pairs take from the shapes of their links                  (numbers,)
w     x, y, angle of every moving link, then every pair's own coordinates         (coordinates,)
F     what the remaining constraints leave open, group after group                (rows,)
====  ==========================================================================  ============
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.block_decomposition import decompose
from planar.equations.elimination import Solved, Symbols, eliminate, expressed, lines_of, stack
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.model.mechanism import Mechanism, motions
from planar.model.pairs import Kind, Pair


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
    drives: tuple[Kind, ...]
    """What every entry of u is."""


class _Unknown(NamedTuple):
    """A mechanism's coordinates as symbols, and as the frames and own coordinates that the pairs' formulas take."""

    coordinates: list[Coordinate]
    symbols: Symbols
    frames: dict[str, Frame]
    own: dict[str, list[ca.SX]]


def build(mechanism: Mechanism, given: Sequence[str] = ()) -> Equations:
    """The equations of a mechanism; only its structure matters, its numbers are `p` and `u`.

    The links that are `given` are no unknowns: where they are is told by u, ahead of the inputs' positions.
    """
    named = motions(mechanism)
    drives = (
        *(Kind.LENGTH, Kind.LENGTH, Kind.ANGLE) * len(given),
        *(named[g.pair].drive_kind for g in mechanism.inputs),
    )
    u = ca.SX.sym("u", len(drives))
    unknown = _coordinates(mechanism, {link: u[3 * k : 3 * k + 3] for k, link in enumerate(given)})
    p, numbers = _numbers(mechanism)
    closures, rows = _closures(mechanism, unknown, numbers, u[3 * len(given) :])
    lines = lines_of(closures, unknown.symbols)

    solved: Solved = []
    columns: list[int] = []
    left: list[int] = []
    for group in decompose([line.depends for line in lines], len(unknown.coordinates)):
        remaining_rows, remaining = eliminate(group.rows, group.columns, lines, solved)
        columns += remaining
        left += remaining_rows
    z = ca.SX.sym("z", len(columns))
    open_ones = [_wrapped(lines[row].whole(unknown.symbols), rows[row].kind) for row in left]
    wanted = [stack(open_ones), stack(unknown.symbols.values)]
    F, w = expressed(dict(zip(columns, ca.vertsplit(z), strict=True)), solved, unknown.symbols, wanted)
    kept = tuple(rows[row] for row in left)
    whole = Equations(tuple(unknown.coordinates), tuple(columns), kept, (), (), z, u, p, w, F, drives)
    return _staged(mechanism, whole)


def _wrapped(left: ca.SX, kind: Kind) -> ca.SX:
    """What a constraint leaves open; an angle that closes modulo a turn, between half a turn and minus that."""
    return ca.atan2(ca.sin(left), ca.cos(left)) if kind is Kind.ANGLE else left


def _staged(mechanism: Mechanism, whole: Equations) -> Equations:
    """The shortened equations split once more, in the order in which they are solved.

    Only now does it show where constraints hold each other twice: angles that a ring of slides closes by itself
    have dropped out, and what was matched with them is free.
    """
    both, moved = _without_idle(whole)
    whole = replace(whole, F=both[: len(whole.rows)], w=both[len(whole.rows) :])
    groups = [
        group for group in decompose(moved[: len(whole.rows)], len(whole.unknowns)) if group.rows or group.columns
    ]
    level_of = {column: level for level, group in enumerate(groups) for column in group.columns}
    known_from = tuple(max((level_of[column] for column in held), default=-1) for held in moved[len(whole.rows) :])
    stages, first_unknown, first_row = [], 0, 0
    level_of_link: dict[str, int] = {}
    for coordinate, level in zip(whole.coordinates, known_from, strict=True):
        if coordinate.of_link:
            level_of_link[coordinate.owner] = max(level, level_of_link.get(coordinate.owner, -1))
    placed_at: dict[int, dict[str, None]] = {}
    for c, known in zip(whole.coordinates, known_from, strict=True):
        if c.of_link:
            placed_at.setdefault(known, {})[c.owner] = None
    joined_at: dict[int, list[str]] = {}
    for pair in mechanism.pairs:
        joined_at.setdefault(max(level_of_link.get(link, -1) for link in pair.bodies), []).append(pair.name)
    for level, group in enumerate(groups):
        placed, joined = placed_at.get(level, {}), joined_at.get(level, [])
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


def _without_idle(whole: Equations) -> tuple[ca.SX, list[set[int]]]:
    """F and w, one below the other, with no unknown in an entry that does not move it; and those that move each.

    What cancels in a sum shows in numbers only: an entry of the slope that vanishes at random places is none. Left
    standing it would have a group, or a link, wait for unknowns that are solved after it.
    """
    both = ca.vertcat(whole.F, whole.w)
    touched = _touched(both, whole.z)
    if not any(touched):
        return both, touched
    slope = ca.Function("slope", [whole.z, whole.u, whole.p], [ca.jacobian(both, whole.z)])
    rng = np.random.default_rng(0)
    sizes = [symbol.numel() for symbol in (whole.z, whole.u, whole.p)]
    found = [slope(*(rng.uniform(0.5, 2.0, size) for size in sizes)) for _ in range(2)]
    seen = sum(np.abs(np.array(each.nonzeros())) for each in found)
    rows, columns = found[0].sparsity().get_triplet()
    alive = {(row, column) for row, column, value in zip(rows, columns, seen, strict=True) if value > 1e-12}
    moved = [{column for column in held if (row, column) in alive} for row, held in enumerate(touched)]
    idle = {row: sorted(held - moved[row]) for row, held in enumerate(touched) if held != moved[row]}
    for row, columns in idle.items():
        both[row] = ca.substitute(both[row], whole.z[columns], ca.SX.zeros(len(columns)))
    return both, moved


def _touched(expressions: ca.SX, z: ca.SX) -> list[set[int]]:
    """The entries of z on which each expression depends."""
    held: list[set[int]] = [set() for _ in range(expressions.numel())]
    for row, column in zip(*ca.jacobian_sparsity(expressions, z).get_triplet(), strict=True):
        held[row].add(column)
    return held


def _coordinates(mechanism: Mechanism, given: Mapping[str, ca.SX]) -> _Unknown:
    coordinates: list[Coordinate] = []
    values: list[ca.SX] = []
    turned: dict[int, tuple[ca.SX, ca.SX]] = {}
    frames: dict[str, Frame] = {}

    def add(owner: str, part: str, kind: Kind, of_link: bool) -> ca.SX:
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
        x, y = (add(link.name, part, Kind.LENGTH, True) for part in ("x", "y"))
        angle = add(link.name, "angle", Kind.ANGLE, True)
        both = turned[len(values) - 1] = ca.SX.sym(f"cos {link.name}"), ca.SX.sym(f"sin {link.name}")
        frames[link.name] = Frame(x, y, *both, angle)
    own = {pair.name: [add(pair.name, *each, False) for each in pair.coordinates] for pair in mechanism.pairs}
    return _Unknown(coordinates, Symbols(values, turned), frames, own)


def _numbers(mechanism: Mechanism) -> tuple[ca.SX, dict[str, list[ca.SX]]]:
    """A symbol for each number of each pair, in the order in which `program.fitted` fills them."""
    numbers = {pair.name: [ca.SX.sym(f"of {pair.name}") for _ in pair.measures] for pair in mechanism.pairs}
    return stack(symbol for each in numbers.values() for symbol in each), numbers


def _closures(
    mechanism: Mechanism, unknown: _Unknown, numbers: dict[str, list[ca.SX]], u: ca.SX
) -> tuple[list[ca.SX], list[Row]]:
    """Every constraint that must vanish: the residuals of all pairs, then drive minus position of all inputs."""
    closures: list[ca.SX] = []
    rows: list[Row] = []

    def of(pair: Pair) -> tuple[Sequence[Frame], Sequence[ca.SX], Sequence[ca.SX]]:
        frames = [unknown.frames[link] for link in pair.bodies]
        return frames, numbers.get(pair.name, []), unknown.own.get(pair.name, [])

    for pair in mechanism.pairs:
        closures += pair.residual(*of(pair))
        rows += [Row(pair.name, kind) for kind in pair.constrains]
    named = motions(mechanism)
    for index, given in enumerate(mechanism.inputs):
        pair = named[given.pair]
        closures.append(pair.drive(*of(pair)) - u[index])
        rows.append(Row(pair.name, pair.drive_kind))
    return closures, rows
