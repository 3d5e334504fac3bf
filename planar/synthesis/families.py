"""The exact designs of one start where numbers stay open: a sample of the family that keeps what is demanded.

The unknowns are the free numbers and, at every wanted entry, those of the mechanism and its input. A random draw is
brought to the nearest solution of all rows by Newton's steps of least norm. Numbers with two bounds hardly move in
these steps, so that their draws cover the bounds evenly, and the other numbers are solved for.

The members near one of them differ by the null space of the Jacobian of all rows. Where the orthogonal projector onto
it is block diagonal, each block of unknowns varies without the others, as two dyads do that carry a link through poses:
exchanging such parts gives new members.

Batches of cheap tests come before any member is judged. Two entries on one branch have Jacobians whose determinants
have one sign. Members that pass are run through their branch, on which all entries must lie, in their order; what is
demanded of the motion is evaluated at positions of it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.jets import TURN
from planar.foundation.time_limit import time_is_over
from planar.model.mechanism import links_counting_turns
from planar.model.pairs import MeasureKind
from planar.model.wording import count_phrase
from planar.synthesis.catalogue import LEAST_LENGTH, Match, draw_numbers, draw_places, follow_branches, is_positive
from planar.synthesis.design_search import Candidate, DesignSearch, judge_candidate, spread_positions
from planar.synthesis.fitting.demand_rows import output_rows
from planar.synthesis.fitting.wanted_equations import GlobalNumbers, WantedEquations, entry_moves, exact_rows, tangents
from planar.synthesis.judgement.input_range import InputRange
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.synthesis import FamilyCount, SynthesisedDesign, least_transmission
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


MAX_FOLLOWED = 1200
"""Members that are run through their branch at once."""
ON_BRANCH = 0.05
"""rad, or of the size: an entry that is nearer to the chords of its branch is on it."""
NEAR_END = 0.5
"""The same beside the end of a branch, which is followed until the dead point is near."""
POSITIONS = 25
"""Of the motion, at which demands are evaluated."""
OTHER_BRANCH, NOT_FOLLOWED, ENTRY_LACK, OFF_BRANCH, NO_WHOLE_TURN, NO_ORDER = 20.0, 15.0, 12.0, 10.0, 6.0, 4.0
"""Violations, to which is added how far a member is from keeping the demand: any of the first is the worst."""


class Screening(NamedTuple):
    """Of each member (n,) how far it is from what is demanded, 0 where nothing is missing, and its least transmission
    angle (rad); infinite where there is none or it is not known."""

    violation: Array
    transmission: Array


class MemberScreen:
    """Screens the members of one search."""

    def __init__(self, search: DesignSearch):
        self.search, self.equations = search, search.equations
        first = self.equations[0]
        self.outputs = output_rows(first, search.free)
        design = first.design
        kinds = [design.equations.coordinates[k].kind for k in design.equations.unknowns]
        self.input_turns = design.equations.input_kinds[0] is not MeasureKind.LENGTH
        self.counts_turns = bool(links_counting_turns(search.mechanism))
        is_angle = [kind is not MeasureKind.LENGTH for kind in kinds]
        self.is_angle = np.array([*is_angle, self.input_turns and not self.counts_turns], bool)
        "of the unknowns and the input, those that are the same a turn apart"

    def screen(self, members: ExactMembers) -> Screening:
        """What members lack."""
        violation = self._determinant_signs(members)
        transmission = np.full(len(violation), np.inf)
        same = np.flatnonzero(violation == 0.0)
        lacks = self._entry_lacks(members.take(same))
        violation[same] = np.where(lacks > 0.0, ENTRY_LACK + np.tanh(lacks), NOT_FOLLOWED)
        rows = same[lacks == 0.0][:MAX_FOLLOWED]
        if len(rows):
            violation[rows], transmission[rows] = self._follow(members.take(rows))
        return Screening(violation, transmission)

    def _determinant_signs(self, members: ExactMembers) -> Array:
        """By how much determinants (n,) differ from those of one sign; 0 where all entries have the same."""
        determinants = []
        for equations, y in zip(self.equations, members.unknowns, strict=True):
            jacobian = equations.jacobians(members.numbers, y)[..., :-1]
            lengths = np.linalg.norm(jacobian, axis=-1).prod(axis=-1)
            determinants.append(np.linalg.det(jacobian) / np.maximum(lengths, np.finfo(float).tiny))
        values = np.concatenate(determinants, axis=1)
        wrong = np.minimum(np.maximum(values, 0.0).sum(axis=1), np.maximum(-values, 0.0).sum(axis=1))
        return np.where(
            wrong > 0.0, OTHER_BRANCH + wrong / np.maximum(np.abs(values).sum(axis=1), np.finfo(float).tiny), 0.0
        )

    def _entry_lacks(self, members: ExactMembers) -> Array:
        """By how much (n,) the wanted entries themselves miss what is demanded of the whole motion."""
        lacks = np.zeros(len(members.numbers))
        guards = self.search.guards
        if guards is None or guards[True].turns_only:
            return lacks
        for y in members.unknowns:  # both guards demand the same
            lacks = np.maximum(lacks, -guards[True].slacks(members.numbers, y).min(axis=1, initial=0.0))
        return lacks

    def _follow(self, members: ExactMembers) -> tuple[Array, Array]:
        """Violations and least transmission angles (n,) of members whose determinants have one sign."""
        branches, is_whole = follow_branches(self.equations[0], members.numbers, members.unknowns[0][:, 0])
        count = len(branches)
        violation, positions = np.zeros(count), np.zeros((count, POSITIONS, branches.shape[2]))
        for k, branch in enumerate(branches):
            known = branch[np.isfinite(branch).all(axis=1)]
            entries = [y[k] for y in members.unknowns]
            violation[k], positions[k] = self._entries_on(known, entries, bool(is_whole[k]))
        return violation + self._demand_lacks(members.numbers, positions, is_whole), self._transmissions(
            members.numbers, positions
        )

    def _entries_on(self, branch: Array, entries: list[Array], is_whole: bool) -> tuple[float, Array]:
        """How far entries are from lying on a branch, in their order, and positions of the motion that they need."""
        scale = self.equations[0].input_scale
        inputs = branch[:, -1] * scale
        is_cyclic = is_whole and not self.counts_turns
        turns = self.input_turns, self.counts_turns
        reach = InputRange("", float(inputs.min()), float(inputs.max()), is_whole, is_cyclic, *turns)
        off, violation, brought = [], 0.0, []
        for y, wanted in zip(entries, self.search.task.wanted, strict=True):
            given = y[:, -1] * scale
            there = reach.bring(given)
            brought.append(there)
            distance = self._distances(branch, y)
            near_end = np.minimum(*(self._distances(branch[[k]], y) for k in (0, -1))) if not is_whole else np.inf
            is_on = (distance < ON_BRANCH) | (near_end < NEAR_END)
            off.append(np.where(is_on, 0.0, np.tanh(distance)))
            if getattr(wanted, "in_order", False) and not reach.is_in_order(there):
                violation = NO_ORDER + _disorder(np.diff(there), is_cyclic)
        if self.search.task.needs_whole_turn and not is_whole:
            violation += NO_WHOLE_TURN + 1.0 - (reach.high - reach.low) / TURN
        missing = float(np.concatenate(off).mean())
        violation += OFF_BRANCH + missing if missing else 0.0
        return violation, spread_positions(branch, np.concatenate(brought) / scale, POSITIONS, is_whole)

    def _distances(self, branch: Array, y: Array) -> Array:
        """How far entries (n, unknowns) are from the chords of a branch (steps, unknowns)."""
        chords = np.diff(branch, axis=0, append=branch[-1:])
        apart = y[:, None] - branch
        apart[..., self.is_angle] -= TURN * np.round(apart[..., self.is_angle] / TURN)
        lengths = np.maximum(np.sum(chords**2, axis=1), np.finfo(float).tiny)
        share = np.clip(np.sum(apart * chords, axis=2) / lengths, 0.0, 1.0)
        distances: Array = np.linalg.norm(apart - share[..., None] * chords, axis=2).min(axis=1)
        return distances

    def _demand_lacks(self, numbers: Array, positions: Array, is_whole: BoolArray) -> Array:
        """By how much (n,) demands of the motion are missed most, rad or of the size."""
        lacks = np.zeros(len(numbers))
        if self.search.guards is None:
            return lacks
        for over_turn, guard in self.search.guards.items():
            rows = np.flatnonzero(is_whole == over_turn)
            if len(rows) and guard.rows and not guard.turns_only:
                slacks = guard.slacks(numbers[rows], positions[rows])
                lacks[rows] = np.maximum(-slacks.min(axis=1, initial=0.0), 0.0)
        return lacks

    def _transmissions(self, numbers: Array, positions: Array) -> Array:
        """The least transmission angle (n,) at positions of the motion."""
        if not len(self.outputs):
            return np.full(len(numbers), np.inf)
        values = self.outputs.values(np.repeat(numbers, POSITIONS, axis=0), positions.reshape(-1, positions.shape[2]))
        least: Array = np.nan_to_num(values, nan=0.0).reshape(len(numbers), -1).min(axis=1)
        return least


def _disorder(steps: Array, is_cyclic: bool) -> float:
    """By how much steps of the input (n,) go back, as a part of all; of a cyclic one how many turns they take more."""
    if is_cyclic:
        return min(float(np.mod(steps, TURN).sum()), float(np.mod(-steps, TURN).sum())) / TURN - 1.0
    back = min(float(np.maximum(steps, 0.0).sum()), float(np.maximum(-steps, 0.0).sum()))
    return back / max(float(np.abs(steps).sum()), np.finfo(float).tiny)


DRAWS, DRAW_ROUNDS = 250, 8
"""Random draws of one round, and how many rounds there are while too few members keep the demands."""
RECOMBINATIONS, RECOMBINED_ROUNDS = 12_000, 24
"""Members put together from independent parts of others in one round, and how many rounds at most."""
PARENTS, CHILDREN = 40, 10
"""Members that lack least, where too few keep the demands, and how many are drawn near each of them in a round."""
SPREADS = (0.2, 0.1, 0.05, 0.02) * 3
"""Of the size or of the bounds' range: how far from their parents these are drawn, one round after the other."""
POOL = 4
"""Members that keep the demands, times the designs that are listed, at which no more are sought."""
CANDIDATES = 1.5
"""Members that are judged at most, times the designs that are listed."""
MAX_HOPELESS = 25_000
"""Members that are tried where not even the entries of any keep the demands; after these only the nearest go on."""
SAME_LINKAGE = 1e-6
"""Of the size: members whose numbers are nearer to each other are one linkage."""
NEAREST = 3
"""Members that are judged where none keeps the demands, so that it is said what they lack."""


class FamilySample(NamedTuple):
    """Exact designs that keep the demands, the best transmission first, and those nearest to it where none does."""

    designs: tuple[SynthesisedDesign, ...]
    rejected: tuple[SynthesisedDesign, ...]
    family: FamilyCount

    @property
    def sentence(self) -> str:
        """What was tried, in words."""
        dimension, tried, met = self.family
        if not tried:
            return "no exact linkage was reached from random draws within the bounds"
        kind = f"a family with {count_phrase(dimension, 'open parameter')}" if dimension else "single linkages"
        counts = f"{count_phrase(tried, 'exact linkage was', 'exact linkages were')} tried, {met or 'none'} "
        counts += "meets all that is demanded" if met < 2 else "meet all that is demanded"
        listed = (
            f"; {len(self.designs)} of these, spread over the family, are listed" if len(self.designs) < met else ""
        )
        return f"{kind}: {counts}{listed}"


class FamilySearch:
    """Samples the exact designs of one search, the same for the same `seed`; `say` is told what is done, and nothing
    new is begun once time is over."""

    def __init__(
        self,
        search: DesignSearch,
        count: int,
        seed: int,
        say: Callable[[str], None] = lambda _: None,
    ):
        self.search, self.count, self.say = search, count, say
        self.sampler, self.screen = MemberSampler(search, seed), MemberScreen(search)
        self.dimension = self.tried = self.met = 0
        self.members: list[ExactMembers] = []
        self.screenings: list[Screening] = []
        "of the members that are kept: those that keep the demands, and the nearest of the others"

    def run(self) -> FamilySample:
        """Sample the family, and judge the members chosen."""
        basis: list[ExactMembers] = []
        for _ in range(DRAW_ROUNDS):
            self.say("exact members of the family")
            drawn = self.sampler.draw(DRAWS)
            if len(drawn.numbers):
                self._add(drawn)
                basis.append(drawn)
                self._recombine(join_members(basis))
            if self._is_enough() or self._is_hopeless() or time_is_over() or (basis and not self.dimension):
                break
        if self.tried and not self.dimension:
            self._keep_distinct()
        elif self.tried and not self._is_enough():
            self._improve()
        return self._judged()

    def _is_enough(self) -> bool:
        return self.met >= POOL * self.count

    def _is_hopeless(self) -> bool:
        return self.tried > MAX_HOPELESS and min(part.violation.min() for part in self.screenings) >= ENTRY_LACK

    def _recombine(self, members: ExactMembers) -> None:
        """Exchange parts of members that vary independently, while too few keep the demands."""
        directions = null_space(self.sampler, members.take(np.array([0])))
        self.dimension = directions.shape[1]
        parts = independent_parts(directions)
        if len(parts) < 2:
            return
        for _ in range(RECOMBINED_ROUNDS // DRAW_ROUNDS):
            if self._is_enough() or self._is_hopeless() or time_is_over():
                break
            combined = recombine(self.sampler, members, parts, RECOMBINATIONS)
            if len(combined.numbers):
                self._add(combined)

    def _improve(self) -> None:
        """Draw members near those that lack least; each of these gives way to the best drawn near it alone, so that
        all parts of the family go on."""
        members, violation, _ = self._known()
        best = np.argsort(violation, kind="stable")[:PARENTS]
        parents, violation = members.take(best), violation[best]
        for spread in SPREADS:
            if self._is_enough() or time_is_over():
                break
            self.say("members near those that lack least")
            starts = np.repeat(np.arange(len(violation)), CHILDREN)
            children, origins = self.sampler.perturb(parents.take(starts), spread)
            if not len(origins):
                continue
            both = join_members([parents, children])
            lacks = np.concatenate([violation, self._add(children).violation])
            owner = np.concatenate([np.arange(len(violation)), starts[origins]])
            order = np.lexsort([lacks, owner])
            rows = order[np.unique(owner[order], return_index=True)[1]]
            parents, violation = both.take(rows), lacks[rows]

    def _add(self, members: ExactMembers) -> Screening:
        """Screen members, and keep those that meet the demands and the nearest of the others."""
        screening = self.screen.screen(members)
        self.tried += len(members.numbers)
        is_met = screening.violation == 0.0
        self.met += int(is_met.sum())
        others = np.argsort(np.where(is_met, np.inf, screening.violation), kind="stable")[:PARENTS]
        rows = np.union1d(np.flatnonzero(is_met), others)
        self.members.append(members.take(rows))
        self.screenings.append(Screening(screening.violation[rows], screening.transmission[rows]))
        return screening

    def _keep_distinct(self) -> None:
        """Keep one of the members that are the same linkage, where nothing is left open."""
        members, violation, transmission = self._known()
        apart = np.abs(members.numbers[:, None] - members.numbers).max(axis=2, initial=0.0)
        rows = np.unique(np.argmax(apart < SAME_LINKAGE, axis=1))
        self.members, self.screenings = [members.take(rows)], [Screening(violation[rows], transmission[rows])]
        self.tried, self.met = len(rows), int((violation[rows] == 0.0).sum())

    def _known(self) -> tuple[ExactMembers, Array, Array]:
        """The members that are kept, their violations and their least transmission angles."""
        violation, transmission = (np.concatenate(parts) for parts in zip(*self.screenings, strict=True))
        return join_members(self.members), violation, transmission

    def _judged(self) -> FamilySample:
        """The members chosen, judged by the general path."""
        if not self.tried:
            return FamilySample((), (), FamilyCount(self.dimension, 0, 0))
        members, violation, transmission = self._known()
        judge = DesignJudge(self.search.task, self.search.size)
        sound: list[SynthesisedDesign] = []
        rejected: list[SynthesisedDesign] = []
        most = max(NEAREST, int(CANDIDATES * self.count))
        chosen = self._spread(members.numbers, np.flatnonzero(violation == 0.0), transmission, most)
        nearest = np.argsort(np.where(violation > 0.0, violation, np.inf), kind="stable")[:NEAREST]
        for row in [*chosen, *nearest[violation[nearest] > 0.0].tolist()]:
            if len(sound) >= self.count or (sound and violation[row] > 0.0):
                break
            self.say(f"{count_phrase(len(sound), 'design')} judged")
            number = len(sound) + len(rejected) + 1
            design = judge_candidate(self.search, judge, self._candidate(members, row), number)
            if design is not None:
                (rejected if design.defects else sound).append(design)
        sound.sort(key=lambda design: -least_transmission(design))
        met = max(self.met, len(sound)) if sound else 0
        count = FamilyCount(self.dimension, self.tried, met)
        return FamilySample(tuple(sound), () if sound else tuple(rejected), count)

    def _spread(self, numbers: Array, rows: IntArray, transmission: Array, count: int) -> list[int]:
        """So many of some rows, each the farthest from those before; the third that transmits best is taken where
        there are enough."""
        if not len(rows):
            return []
        rows = rows[np.argsort(-transmission[rows], kind="stable")]
        rows = rows[: max(2 * count, len(rows) // 3)]
        places = numbers[rows]
        places = places / np.maximum(places.std(axis=0), 1e-9)
        chosen = [0]
        distance = np.linalg.norm(places - places[0], axis=1)
        while len(chosen) < min(count, len(rows)):
            chosen.append(int(np.argmax(distance)))
            distance = np.minimum(distance, np.linalg.norm(places - places[chosen[-1]], axis=1))
        return [int(rows[k]) for k in chosen]

    def _candidate(self, members: ExactMembers, row: int) -> Candidate:
        numbers = members.numbers[row] * self.search.equations[0].scale
        names = self.search.free.names
        return Candidate(
            self.search.mechanism,
            dict(zip(names, numbers.tolist(), strict=True)),
            tuple(y[row] for y in members.unknowns),
            0.0,
            0.0,
            Match(row, 0.0, 1.0 + 0.0j, 0.0j, ()),
        )
