"""Exact members of a family of designs: random draws, brought to where all that is wanted is met, and recombined.

The unknowns are the free numbers and, at every wanted entry, those of the mechanism and its input. A draw is brought to
the nearest solution of all rows by Newton's steps of least norm. Numbers with two bounds hardly move in these steps, so
that their draws cover the bounds evenly, and the other numbers are solved for.

The members near one of them differ by the null space of the Jacobian of all rows. Where the orthogonal projector onto
it is block diagonal, each block of unknowns varies without the others, as two dyads do that carry a link through poses:
exchanging such parts gives new members.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.synthesis.catalogue.catalogue import LEAST_LENGTH, draw_numbers, draw_places, is_positive
from planar.synthesis.design_search import DesignSearch
from planar.synthesis.fitting.wanted_equations import GlobalNumbers, WantedEquations, entry_moves, exact_rows, tangents
from planar.synthesis.task.synthesis_task import WantedFunction

PLACE_DRAWS = 16
"""Random places of the links that are compared for each entry; the one with the least residual is the start."""
NEWTON_STEPS = 24
MAX_NUMBER_STEP, MAX_PLACE_STEP = 0.6, 0.8
"""Of a free number (of the mechanism's size), and of an entry's unknowns (rad, or of the size), in one step."""
BOUNDED_MOBILITY = 0.05
"""How readily a number with two bounds changes, beside one without."""
RESIDUAL_TOLERANCE = 1e-13
"""Greatest residual of a member, of the size or rad."""
REGULARISATION = 1e-10
"""Of the trace of the normal matrix of the rows, where some depend on others."""
PIVOT_RANGE = 1.5
"""Of the extent of the wanted places: how far from their middle pivots without bounds are drawn."""


class ExactMembers(NamedTuple):
    """Designs (n, ...) by their scaled free numbers (n, free), unknowns of every entry by wanted item (n, entries,
    unknowns), and zeros of scales by item (n, zeros)."""

    numbers: Array
    unknowns: tuple[Array, ...]
    zeros: tuple[Array, ...]

    def take(self, rows: IntArray | BoolArray) -> ExactMembers:
        """Those rows."""
        unknowns, zeros = (tuple(part[rows] for part in parts) for parts in (self.unknowns, self.zeros))
        return ExactMembers(self.numbers[rows], unknowns, zeros)

    @property
    def columns(self) -> Array:
        """All of a member in one row (n, columns): numbers, then the zeros, then the unknowns."""
        flat = [y.reshape(len(y), y.shape[1] * y.shape[2]) for y in self.unknowns]
        return np.concatenate([self.numbers, *self.zeros, *flat], axis=1)

    def with_columns(self, columns: Array) -> ExactMembers:
        """Members of the same kind from such rows (n, columns)."""
        shapes = [self.numbers.shape[1:], *(z.shape[1:] for z in self.zeros), *(y.shape[1:] for y in self.unknowns)]
        stops = np.cumsum([int(np.prod(shape)) for shape in shapes])[:-1]
        parts = np.split(columns, stops, axis=1)
        numbers, *others = (part.reshape(len(columns), *shape) for part, shape in zip(parts, shapes, strict=True))
        count = len(self.zeros)
        return ExactMembers(numbers, tuple(others[count:]), tuple(others[:count]))


def join_members(parts: Sequence[ExactMembers]) -> ExactMembers:
    """The members of several sets, one set after the other."""
    return parts[0].with_columns(np.concatenate([part.columns for part in parts]))


class MemberSampler:
    """Draws exact members of the designs of one search, the same for the same `seed`."""

    def __init__(self, search: DesignSearch, seed: int):
        self.search, self.equations, self.free = search, search.equations, search.free
        self.random = np.random.default_rng([seed, 17])
        scale = self.equations[0].scale
        self.lower, self.upper = self.free.lower / scale, self.free.upper / scale
        self.least = np.where(is_positive(self.free), np.maximum(self.lower, 2.0 * LEAST_LENGTH), self.lower)
        is_bounded = np.isfinite(self.lower) & np.isfinite(self.upper)
        self.bounded = np.flatnonzero(is_bounded)
        self.globals = GlobalNumbers(self.equations, len(self.lower))
        self.mobility = np.ones(self.globals.size)
        self.mobility[: len(self.lower)][is_bounded] = BOUNDED_MOBILITY
        self.n_drawn = 0

    def draw(self, count: int) -> ExactMembers:
        """The members that so many draws lead to."""
        numbers = self._draw_numbers(count)
        unknowns = [self._draw_unknowns(equations, numbers) for equations in self.equations]
        zeros = self.search.first_zeros(numbers, unknowns)
        return self.solve(ExactMembers(numbers, tuple(unknowns), tuple(zeros)))[0]

    def perturb(self, members: ExactMembers, spread: float) -> tuple[ExactMembers, IntArray]:
        """Members near given ones, and near which each is; numbers change by about the `spread` of the size, or of
        their bounds' range."""
        width = np.full(len(self.lower), 1.0 / self.search.ratio)
        width[self.bounded] = (self.upper - self.lower)[self.bounded]
        change = spread * width * self.random.normal(size=members.numbers.shape)
        return self.solve(members._replace(numbers=np.clip(members.numbers + change, self.least, self.upper)))

    def _draw_numbers(self, count: int) -> Array:
        unit = 1.0 / self.search.ratio
        numbers = draw_numbers(self.equations[0], self.free, count, self.random, unit)
        wanted = [item.places for item in self.search.task.wanted if not isinstance(item, WantedFunction)]
        if wanted:
            places = np.concatenate(wanted) / self.equations[0].unit
            middle = 0.5 * (places.min(axis=0) + places.max(axis=0))
            for pivot in self.search.moves.places:
                numbers[:, pivot] = middle + PIVOT_RANGE * unit * self.random.uniform(-1.0, 1.0, (count, 2))
        lower, upper = self.lower[self.bounded], self.upper[self.bounded]
        shares = _even_points(np.arange(self.n_drawn, self.n_drawn + count), len(self.bounded))
        numbers[:, self.bounded] = lower + (upper - lower) * shares
        self.n_drawn += count
        return np.clip(numbers, self.least, self.upper)

    def _draw_unknowns(self, equations: WantedEquations, numbers: Array) -> Array:
        """Of several random places of every entry those with the least residual (n, entries, unknowns)."""
        count, entries = len(numbers), len(equations.rows.weights)
        shift = self.random.uniform(-np.pi, np.pi, (count, 1)) if equations.rows.input_is_free else 0.0
        best: Array = np.zeros((count, entries, 0))
        least = np.full((count, entries), np.inf)
        for _ in range(PLACE_DRAWS):
            y = draw_places(equations, count * entries, self.random, 1.0 / self.search.ratio)
            y = y.reshape(count, entries, -1)
            if equations.rows.inputs is not None:
                y[..., -1] = equations.rows.inputs / equations.input_scale + shift
            squares = _entry_squares(equations, numbers, y)
            is_less = squares < least
            best = np.where(is_less[..., None], y, best) if best.shape[2] else y
            least = np.where(is_less, squares, least)
        return best

    def solve(self, starts: ExactMembers) -> tuple[ExactMembers, IntArray]:
        """The members that Newton's steps of least norm lead to, fewer than there are starts, and the start of each."""
        members, solved = starts, []
        rows, origins = np.arange(len(starts.numbers)), []
        ways = [tangents(np.nan_to_num(e.jacobians(starts.numbers, y))) for e, y in self._items(starts)]
        for _ in range(NEWTON_STEPS):
            members, ways = self._step(members, ways)
            residual = self.residuals(members)
            is_solved = residual < RESIDUAL_TOLERANCE
            solved.append(members.take(is_solved))
            origins.append(rows[is_solved])
            rest = np.flatnonzero(~is_solved & np.isfinite(residual))
            members, rows, ways = members.take(rest), rows[rest], [way[rest] for way in ways]
            if not len(rest):
                break
        return join_members(solved), np.concatenate(origins)

    def _items(self, members: ExactMembers) -> list[tuple[WantedEquations, Array]]:
        return list(zip(self.equations, members.unknowns, strict=True))

    def _step(self, members: ExactMembers, ways: list[Array]) -> tuple[ExactMembers, list[Array]]:
        """One step of least norm, shortened where it is long; and the directions of the entries' paths."""
        items = list(zip(self._items(members), members.zeros, ways, strict=True))
        with np.errstate(all="ignore"):
            lines = [e.linearise(members.numbers, y, zero, way) for (e, y), zero, way in items]
            rows, slopes = exact_rows(self.equations, lines, self.globals, every_item=True)
            rows, slopes = np.nan_to_num(rows), np.nan_to_num(slopes) * self.mobility
            normal = slopes @ slopes.swapaxes(1, 2)
            floor = REGULARISATION * np.einsum("cii->c", normal) + np.finfo(float).tiny
            normal = normal + floor[:, None, None] * np.eye(normal.shape[1])
            change = -np.einsum("cri,cr->ci", slopes, np.linalg.solve(normal, rows[..., None])[..., 0]) * self.mobility
            moves = [
                np.nan_to_num(entry_moves(e, line, change[:, self.globals.columns(k)]))
                for k, (e, line) in enumerate(zip(self.equations, lines, strict=True))
            ]
            ways = [line.tangent / np.linalg.norm(line.tangent, axis=-1, keepdims=True) for line in lines]
        greatest = np.abs(change).max(axis=1, initial=0.0) / MAX_NUMBER_STEP
        for move in moves:
            greatest = np.maximum(greatest, np.abs(move).max(axis=(1, 2)) / MAX_PLACE_STEP)
        share = 1.0 / np.maximum(greatest, 1.0)
        count = self.globals.free
        numbers = np.clip(members.numbers + share[:, None] * change[:, :count], self.least, self.upper)
        unknowns = [y + share[:, None, None] * move for y, move in zip(members.unknowns, moves, strict=True)]
        zeros = [
            zero + share[:, None] * change[:, columns]
            for zero, columns in zip(members.zeros, self.globals.zero_columns, strict=True)
        ]
        return ExactMembers(numbers, tuple(unknowns), tuple(zeros)), ways

    def residuals(self, members: ExactMembers) -> Array:
        """The greatest residual (n,) of each member, of the size or rad."""
        greatest = np.zeros(len(members.numbers))
        for (equations, y), zero in zip(self._items(members), members.zeros, strict=True):
            closure, _ = equations.closure_at(members.numbers, y)
            rows = equations.values(members.numbers, y) - equations.wanted_values(zero)
            for part in (closure, rows):
                greatest = np.maximum(greatest, np.abs(part).max(axis=(1, 2), initial=0.0))
        return greatest


def _even_points(indices: IntArray, dimension: int) -> Array:
    """Points (n, dimension) of a sequence that fills the unit cube evenly, by multiples of irrational steps: powers of
    the root of x^(dimension + 1) = x + 1 (M. Roberts, The Unreasonable Effectiveness of Quasirandom Sequences, 2018).
    """
    root = 2.0
    for _ in range(40):
        root = (1.0 + root) ** (1.0 / (dimension + 1))
    points: Array = np.mod(0.5 + (indices[:, None] + 1) * root ** -np.arange(1.0, dimension + 1.0), 1.0)
    return points


def _entry_squares(equations: WantedEquations, numbers: Array, y: Array) -> Array:
    """The sum of squares (n, entries) of what an entry misses and by how much it does not close."""
    closure, _ = equations.closure_at(numbers, y)
    squares: Array = np.sum(closure**2, axis=2)
    if not equations.rows.value_is_free:
        squares = squares + np.sum((equations.values(numbers, y) - equations.target) ** 2, axis=2)
    return squares


RANK_TOLERANCE, TIED = 1e-9, 1e-8
"""Of the greatest singular value, what counts as zero; and of the projector's entries."""
RECOMBINED_RESIDUAL = 1e-9
"""Greatest residual of a member that was put together."""


def null_space(sampler: MemberSampler, member: ExactMembers) -> Array:
    """The directions (columns, dimension) in which one member (1, ...) may change and stay exact."""
    columns = member.columns.shape[1]
    rows = []
    first = sampler.globals.free
    start = first + sum(zero.shape[1] for zero in member.zeros)
    for equations, y, zero in zip(sampler.equations, member.unknowns, member.zeros, strict=True):
        slopes = equations.slopes_at(member.numbers, y)
        size = y.shape[2]
        for entry in range(y.shape[1]):
            stop = start + size
            for by_unknowns, by_numbers, is_result in slopes:
                block = np.zeros((by_unknowns.shape[2], columns))
                block[:, : sampler.globals.free] = by_numbers[0, entry]
                block[:, start:stop] = by_unknowns[0, entry]
                if is_result and equations.rows.value_is_free:
                    block[:, first + zero.shape[1] - 1] = -1.0
                rows.append(block)
            if equations.is_timed:
                block = np.zeros((1, columns))
                block[0, stop - 1] = 1.0
                if equations.rows.input_is_free:
                    block[0, first] = -1.0
                rows.append(block)
            start = stop
        first += zero.shape[1]
    _, singular, vectors = np.linalg.svd(np.concatenate(rows))
    rank = int((singular > RANK_TOLERANCE * singular.max(initial=0.0)).sum())
    directions: Array = vectors[rank:].T
    return directions


def independent_parts(directions: Array) -> list[IntArray]:
    """The columns that vary with each other, in parts that vary independently."""
    projector = directions @ directions.T
    moving = np.flatnonzero(np.diag(projector) > TIED)
    is_tied = np.abs(projector[np.ix_(moving, moving)]) > TIED
    labels = np.arange(len(moving))
    for _ in moving:  # the least label goes from column to column
        labels = np.where(is_tied, labels, len(moving)).min(axis=1, initial=len(moving))
    return [moving[labels == label] for label in np.unique(labels)]


def recombine(sampler: MemberSampler, members: ExactMembers, parts: list[IntArray], count: int) -> ExactMembers:
    """So many members, less those that do not fit together, each part from another member."""
    columns = members.columns
    chosen = sampler.random.integers(len(columns), size=(len(parts), count))
    mixed = columns[chosen[0]]
    for part, rows in zip(parts[1:], chosen[1:], strict=True):
        mixed[:, part] = columns[rows][:, part]
    combined = members.with_columns(mixed)
    return combined.take(sampler.residuals(combined) < RECOMBINED_RESIDUAL)
