"""Designs of one start that do what a task wants best: matches of a catalogue, fitted, written and judged."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import ceil, log10
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.document.dimensions import file_dimensions
from planar.document.revised.changed_numbers import with_values
from planar.document.revised.similar_mechanism import similar_mechanism
from planar.equations.elimination import stack_expressions
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.file_units import FileUnits, unit_of_kind
from planar.model.mechanism import Mechanism, NamedPoint, named_points
from planar.synthesis.catalogue import (
    Catalogue,
    Match,
    WantedItem,
    find_matches,
    follow_branches,
    kept_catalogue,
    moved_numbers,
)
from planar.synthesis.fitting.demand_rows import DemandGuard, demand_guards
from planar.synthesis.fitting.design_fit import DesignFit, FittedDesigns
from planar.synthesis.fitting.moving_designs import lacks
from planar.synthesis.fitting.wanted_equations import WantedEquations, tangents, wanted_rows, wanted_size
from planar.synthesis.judgement.judgement import DesignJudge
from planar.synthesis.synthesis import SynthesisedDesign
from planar.synthesis.task.freedom import can_move_whole
from planar.synthesis.task.starts import FreeNumbers, free_numbers
from planar.synthesis.task.synthesis_task import SynthesisTask

DIGITS, SKETCH_DIGITS = 13, 7
"""Of the size of a mechanism, or of a rad, to which its numbers are written, so that what is met exactly still is; and
those of its sketch, which only chooses the assembly."""


def write_design(
    design: DesignEquations,
    numbers: Mapping[str, float],
    y: Array,
    input_position: float,
    name: str,
) -> Mechanism:
    """The mechanism with these numbers (SI, rounded to `DIGITS`), whose sketch is where it stands with
    unknowns y (unknowns,). Raises BadInput where a file with these numbers is refused."""
    start = design.mechanism
    units, size = start.units, design.solver.unit
    known = file_dimensions(start)
    told = {key: _rounded(value, known[key].kind, units, size, DIGITS) for key, value in numbers.items()}
    running = f"{start.inputs[0].pair}.position"
    told[running] = _rounded(input_position, known[running].kind, units, size, DIGITS)
    joints = [
        point for point in named_points(start) if len(point.members) > 1 and start.frame not in dict(point.members)
    ]
    places = _places(design, joints, told, y)
    sketch = []
    for joint, at in zip(joints, places, strict=True):
        x, y_own = (_rounded(part, "length", units, size, SKETCH_DIGITS) for part in at)
        sketch.append((joint.name, x, y_own))
    made = replace(start, sketch=tuple(sketch), name=name, about=None, source=None, published=(), ids=())
    return with_values(made, told)


def _places(
    design: DesignEquations, joints: list[NamedPoint], numbers: Mapping[str, float], y: Array
) -> list[tuple[float, float]]:
    frames = design.positions.frames
    parts = []
    for joint in joints:
        link, point = joint.members[0]
        parts += list(frames[link].to_world(design.work.shapes[link].position(point)))
    d = [numbers.get(dimension.name, dimension.value) for dimension in design.dimensions]
    u = [y[-1] * design.input_scale[0], *(drive.position for drive in design.mechanism.inputs[1:])]
    at = ca.Function("places", [design.z, design.u, design.d], [stack_expressions(parts)])
    found = at(ca.DM(y[:-1]), ca.DM(u), ca.DM(d)).full().ravel().tolist()
    return list(zip(found[::2], found[1::2], strict=True))


def _rounded(value: float, kind: str, units: FileUnits, size: float, digits: int) -> float:
    """A quantity (SI) with so many digits behind that of the size, in the file's units."""
    if kind not in ("length", "angle"):
        return float(value)
    of = unit_of_kind(kind, units)[1]
    whole = abs(of.from_si(size if kind == "length" else 1.0))
    return float(of.to_si(round(of.from_si(float(value)), digits - ceil(log10(whole)))))


class Candidate(NamedTuple):
    """A fitted design: its free numbers by name (SI), and the unknowns at each entry of what is wanted."""

    mechanism: Mechanism
    numbers: dict[str, float]
    unknowns: tuple[Array, ...]
    "of each wanted item (n, unknowns)"
    squares: float
    lack: float
    "by how much a demand is missed, rad or of the extent of what is wanted"
    match: Match
    "from which it was fitted"


DEMANDING, LACK_WEIGHT = 6, 0.3
"""Where something is demanded of the motion, so many times as many matches as are fitted are looked at, and what they
lack (rad, or of the extent of what is wanted) counts so much beside their distance."""


def has_given_lengths(task: SynthesisTask, mechanism: Mechanism) -> bool:
    """Whether a length of the file is not among the numbers that are named as free."""
    lengths = {name for name, each in file_dimensions(mechanism).items() if each.kind == "length" and each.value}
    return bool(lengths - {*task.free})


class _FitStart(NamedTuple):
    """From where a design is fitted: its numbers, the unknowns at entries, and at positions that are guarded."""

    numbers: Array
    unknowns: list[Array]
    guarded: Array
    over_turn: bool
    match: Match


class DesignSearch:
    """The search over one start."""

    def __init__(self, task: SynthesisTask, mechanism: Mechanism):
        self.task, self.start = task, mechanism
        own = design_equations(mechanism).solver.unit
        self.size = wanted_size(task, own)
        self.can_move = can_move_whole(task, mechanism, free_numbers(task, mechanism))
        # its scale is that of what is wanted, however large its file is, where no length of the file is to be kept
        if self.can_move and not task.within and not (task.free and has_given_lengths(task, mechanism)):
            mechanism = similar_mechanism(mechanism, self.size / own)
            own = design_equations(mechanism).solver.unit
        self.mechanism = mechanism
        self.free: FreeNumbers = free_numbers(task, mechanism)
        rows = wanted_rows(task, self.size)
        self.equations = tuple(WantedEquations(mechanism, row, self.free.names, own) for row in rows)
        self.ratio = own / self.size
        "of the scale of numbers to that of places"
        self.moves = moved_numbers(self.equations[0], self.free)
        self.guards = demand_guards(task, self.equations[0], rows[0], self.free, self.size)

    def catalogue(self, count: int, seed: int) -> Catalogue:
        """Random designs of this start with their motion, from disk where they were kept."""
        return kept_catalogue(self.start, self.equations, self.free, count, seed)

    def matches(self, catalogue: Catalogue, many: int) -> list[Match]:
        """The designs of the catalogue nearest to what is wanted."""
        items = [
            WantedItem(
                item.rows.wanted,
                item.target,
                None if item.rows.inputs is None else item.rows.inputs / item.input_scale,
                item.rows.input_is_free,
            )
            for item in self.equations
        ]
        factors = self._factors(catalogue) if self.can_move else None
        if self.guards is None or not self.guards[True].kept_by(False, False).rows:
            return find_matches(catalogue, items, factors, many, self.task.needs_whole_turn)
        found = find_matches(catalogue, items, factors, DEMANDING * many, self.task.needs_whole_turn)
        scores = np.hypot([each.distance for each in found], LACK_WEIGHT * self._lacks(catalogue, found))
        return [found[k] for k in np.argsort(scores, kind="stable")[:many]]

    def _lacks(self, catalogue: Catalogue, matches: list[Match]) -> Array:
        """By how much matches miss what is demanded of their motion (matches,)."""
        assert self.guards is not None
        starts, found = self._fit_starts(catalogue, matches), np.zeros(len(matches))
        for over_turn, guard in self.guards.items():
            rows = [k for k, start in enumerate(starts) if start.over_turn is over_turn]
            if rows:
                x, y = (np.array([getattr(starts[k], name) for k in rows]) for name in ("numbers", "guarded"))
                found[rows] = lacks(guard.slacks(x, y))
        return found

    def _factors(self, catalogue: Catalogue) -> Array | None:
        """By how much the designs of a catalogue may grow."""
        scale = self.equations[0].scale
        return self.moves.factors(catalogue.numbers, self.free.lower / scale, self.free.upper / scale)

    def fit(
        self, catalogue: Catalogue, matches: list[Match], keep: int, keeps_turn: bool = False, keeps_order: bool = False
    ) -> list[Candidate]:
        """The matches fitted, the best so many; of those that turn fully, and of others, where demands are kept.

        With `keeps_turn` designs turn fully all the way, with `keeps_order` entries are met in their order, where that
        is wanted; both may end in a worse optimum. What comes to turn fully is fitted once more, since its demands are
        kept all round the turn then."""
        guards = self.guards
        if guards is not None:
            guards = {key: each.kept_by(keeps_turn, keeps_order) for key, each in guards.items()}
        groups = self._fit_starts(catalogue, matches)
        found: list[Candidate] = []
        for over_turn in (False, True):
            own = [each for each in groups if each.over_turn is over_turn]
            if not own:
                continue
            fitted = self._fit_alike(own, keep, None if guards is None else guards[over_turn])
            turned: dict[int, _FitStart] = {}
            if not over_turn and guards is not None and guards[True].rows:
                turned = self._turned(fitted, own)
            groups += turned.values()
            known = np.flatnonzero(np.isfinite(fitted.squares)).tolist()
            found += [self._candidate(fitted, k, own[fitted.order[k]].match) for k in known if k not in turned]
        return sorted(found, key=lambda each: (each.lack > 0.0, each.squares))[:keep]

    def _fit_starts(self, catalogue: Catalogue, matches: list[Match]) -> list[_FitStart]:
        """Matches as they lie, with the positions at which each is guarded."""
        found = []
        for match in matches:
            x, own = catalogue.numbers[match.design], catalogue.unknowns[match.design]
            # places of the catalogue are in units of what is wanted, numbers in those of the mechanism
            moved, y = self.moves.move(x, own, match.factor, match.offset / self.ratio)
            ys = [y[steps] for steps in match.steps]
            over_turn = self.guards is not None and bool(catalogue.is_whole[match.design])
            branch = y[np.isfinite(y).all(axis=1)]
            found.append(_FitStart(moved, ys, self._guarded(branch, ys, over_turn), over_turn, match))
        return found

    def _guarded(self, branch: Array, unknowns: list[Array], over_turn: bool) -> Array:
        """The unknowns at positions of a branch (steps, unknowns) all round its turn, or between entries."""
        many = 0 if self.guards is None else self.guards[over_turn].position_count
        return spread_positions(branch, np.concatenate([y[:, -1] for y in unknowns]), many, over_turn)

    def _fit_alike(self, starts: list[_FitStart], keep: int, guard: DemandGuard | None) -> FittedDesigns:
        """Designs fitted that all turn fully, or are all seen between their entries only."""
        x = np.array([start.numbers for start in starts])
        ys = [np.array(each) for each in zip(*(start.unknowns for start in starts), strict=True)]
        zeros = self.first_zeros(x, ys)
        scale = self.equations[0].scale
        fit = DesignFit(self.equations, self.free.lower / scale, self.free.upper / scale, guard)
        positions = np.array([start.guarded for start in starts])
        shares = np.broadcast_to(np.linspace(0.0, 1.0, positions.shape[1]), positions.shape[:2])
        return fit.fit(x, ys, zeros, keep, (positions, shares) if guard is not None else None)

    def _turned(self, found: FittedDesigns, starts: list[_FitStart]) -> dict[int, _FitStart]:
        """Those of fitted designs that turn fully, by their number."""
        if not len(found.numbers):
            return {}
        branches, is_whole = follow_branches(self.equations[0], found.numbers, found.unknowns[0][:, 0])
        told = {}
        for k in np.flatnonzero(is_whole & np.isfinite(found.squares)).tolist():
            branch, ys = branches[k][np.isfinite(branches[k]).all(axis=1)], [y[k] for y in found.unknowns]
            match = starts[found.order[k]].match
            told[k] = _FitStart(found.numbers[k], ys, self._guarded(branch, ys, True), True, match)
        return told

    def most_regular(self, candidate: Candidate) -> Array:
        """The unknowns of that entry which is farthest from a dead point: there the assemblies lie apart."""
        every = np.concatenate(candidate.unknowns)
        each = self.equations[0]
        x = np.array([candidate.numbers[name] for name in self.free.names]) / each.scale
        jacobian = each.jacobians(x[None], every[None])[0]
        best = int(np.argmax(np.abs(tangents(jacobian)[:, -1]))) if jacobian.shape[1] else 0
        found: Array = np.asarray(every[best])
        return found

    def shown(self, k: int, candidate: Candidate) -> Array:
        """The results (n, parts) of a wanted item that a candidate has at its entries, SI."""
        each = self.equations[k]
        x = np.array([candidate.numbers[name] for name in self.free.names]) / each.scale
        values: Array = each.values(x[None], candidate.unknowns[k][None])[0] * each.rows.scales
        return values

    def first_zeros(self, x: Array, unknowns: list[Array]) -> list[Array]:
        """The zeros of scales that fit best at first; given inputs are brought to where they are wanted."""
        found: list[Array] = []
        for k, item in enumerate(self.equations):
            zeros = np.zeros((len(x), item.zero_count))
            if item.rows.inputs is not None:
                wanted = np.broadcast_to(item.rows.inputs / item.input_scale, unknowns[k].shape[:2])
                if item.rows.input_is_free:
                    wanted = wanted + np.mean(unknowns[k][..., -1] - wanted, axis=1, keepdims=True)
                unknowns[k] = np.concatenate([unknowns[k][..., :-1], wanted[..., None]], axis=-1)
            if item.rows.value_is_free:
                off = item.values(x, unknowns[k])[..., 0] - item.target[:, 0]
                zeros[:, -1] = np.mean(off, axis=1)
            found.append(zeros)
        return found

    def _candidate(self, found: FittedDesigns, k: int, match: Match) -> Candidate:
        numbers = found.numbers[k] * self.equations[0].scale
        return Candidate(
            self.mechanism,
            dict(zip(self.free.names, map(float, numbers), strict=True)),
            tuple(y[k] for y in found.unknowns),
            float(found.squares[k]),
            float(found.lacks[k]),
            match,
        )


def spread_positions(branch: Array, inputs: Array, count: int, over_turn: bool) -> Array:
    """The unknowns (count, unknowns) at positions of a branch (steps, unknowns): all round its turn, or spread evenly
    from the least to the greatest of some inputs (n,)."""
    if over_turn:
        turned: Array = branch[np.linspace(0, len(branch) - 1, count).astype(int)]
        return turned
    spread = np.linspace(inputs.min(), inputs.max(), count)
    positions: Array = np.stack([np.interp(spread, branch[:, -1], part) for part in branch.T], axis=1)
    return positions


def judge_candidate(
    search: DesignSearch, judge: DesignJudge, candidate: Candidate, number: int
) -> SynthesisedDesign | None:
    """A candidate with its judgement, named by a `number`; None where no file can describe it."""
    equations = search.equations
    values = tuple(search.shown(k, candidate) for k in range(len(equations)))
    inputs = [y[:, -1] * item.input_scale for item, y in zip(equations, candidate.unknowns, strict=True)]
    y = search.most_regular(candidate)
    name = f"{search.task.name}: {search.mechanism.name} {number}"
    try:
        input_position = float(y[-1] * equations[0].input_scale)
        mechanism = write_design(equations[0].design, candidate.numbers, y, input_position, name)
    except BadInput:
        return None
    judgement = judge.judge(mechanism, inputs, values)
    misses = np.concatenate(judgement.misses)
    written = file_dimensions(mechanism)
    return SynthesisedDesign(
        mechanism,
        float(np.sqrt(np.mean(misses**2))),
        float(misses.max()),
        judgement.misses,
        judgement.inputs,
        judgement.defects,
        search.mechanism.name,
        {key: float(written[key].value) for key in candidate.numbers},
    )
