"""The assemblies of linkages nearest to their sketches, block after block."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from planar.batch.march.prediction import CLEAR_REGULARITY
from planar.batch.mechanisms.block_type import (
    COS,
    JUDGED_ROWS,
    MAX_SIGNS,
    POSE_ROWS,
    SKETCH_SUMS,
    BlockType,
    newton_numbers,
    squared_sketch_distance,
)
from planar.batch.mechanisms.linkages import BlockBatch, LinkageArrays, LinkArrays
from planar.batch.mechanisms.tape_runs import (
    LEAST_CLEARANCE,
    STEP_TABLE,
    TapedLinkages,
    make_block_kinds,
    make_tape,
    rotations,
    run_steps,
)
from planar.codegen.tape import LANES
from planar.foundation.arrays import Array, BoolArray, IntArray, part_offsets
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.model.pairs import MeasureKind
from planar.solving.assembly.nearest_assembly import is_at_sketch, is_surely_farther

SKETCH_DISTANCE_RATIO = 0.075
"""Largest mean distance of points from the sketch (sizes), divided by the regularity of the Jacobian, at which no other
assembly is nearer."""
START_TOLERANCE_FACTOR = 100.0
"""Factor of the residual tolerance at a start, which the run checks again."""
LEAST_SPREAD = 1e-12
"""Squared sizes: points of a link that are nearer to each other define no angle."""


NO_INDICES = np.zeros(0, dtype=np.int64)
NO_POINTS = LinkArrays(NO_INDICES, NO_INDICES, np.zeros((0, 2)))


class LinkageAssemblies(NamedTuple):
    """Assemblies of linkages: whether that of each is surely the one that a search of the mechanism returns
    (linkages,), and of every batch the numbers of its blocks for the run: p, then signs or unknowns (blocks,
    numbers)."""

    is_sure: BoolArray
    block_numbers: list[Array]


def find_linkage_assemblies(linkages: LinkageArrays) -> LinkageAssemblies:
    """Find the assemblies of linkages nearest to their sketches.

    An assembly mode of a block is accepted if every other mode is farther from the sketch by more than the distance of
    all blocks of the linkage together: every other choice gives a larger total distance. Newton's method solves blocks
    without closed form from the sketch; they are accepted if their points are near the sketch and the Jacobian is so
    regular that no other assembly is as near, see `BlockAssemblies`.
    """
    linkage_count = len(linkages)
    starts = _Starts(linkages)
    is_sure = starts.run(np.full(linkage_count, LEAST_CLEARANCE))
    if starts.take_solved_frames():
        is_sure = starts.run(np.full(linkage_count, LEAST_CLEARANCE))
    cost, clearance = np.zeros(linkage_count), np.full(linkage_count, LEAST_CLEARANCE)
    margins: list[tuple[IntArray, Array]] = []
    block_numbers: list[Array] = []
    for batch in linkages.batches:
        kind, owner = batch.block_type, batch.owner
        if kind.has_closed_form:
            rows = starts.judgements(batch)
            block_numbers.append(np.hstack([batch.p, rows[:, : kind.sign_count]]))
            nearest, second, residual, clear = rows[:, kind.sign_count : kind.sign_count + JUDGED_ROWS].T
            with np.errstate(invalid="ignore"):
                is_good = residual <= START_TOLERANCE_FACTOR * linkages.tolerance[owner]
                is_good &= ~(clear < LEAST_CLEARANCE)
            # a block with a single assembly mode may lie far off its sketch
            distance = np.where(is_good, np.maximum(nearest, 0.0), 0.0)
            margins.append((owner, second - nearest))
        else:
            unknowns, is_shown = starts.shown[kind]
            block_numbers.append(newton_numbers(kind, batch.p, unknowns))
            distance, points = starts.distance_to_sketch(batch)
            is_good = is_shown & (points > 0.0) & is_at_sketch(distance, points)
            needed = distance / np.maximum(points, 1.0) / SKETCH_DISTANCE_RATIO**2
            np.maximum.at(clearance, owner[is_good], np.minimum(needed, CLEAR_REGULARITY**2)[is_good])
        is_sure[owner[~is_good]] = False
        cost += np.bincount(owner, distance, linkage_count)
    for owner, margin in margins:
        is_sure[owner[~is_surely_farther(margin, cost[owner], roundings=2)]] = False
    if np.any(clearance > LEAST_CLEARANCE):
        is_sure &= starts.run(clearance)
    is_sure &= ~linkages.has_short_arm
    return LinkageAssemblies(is_sure, block_numbers)


class _Starts:
    """Linkages as a tape of one step, whose results are the poses of all links, then how blocks are judged."""

    def __init__(self, linkages: LinkageArrays):
        self.linkages, self.first = linkages, part_offsets(linkages.link_counts)
        self.place_count = 1 + int(self.first[-1])
        self.state = np.zeros((self.place_count + linkages.block_count, MAX_SIGNS + JUDGED_ROWS, LANES))
        self.state[0, COS] = 1.0
        self.sums = _sketch_sums(linkages.sketch_points([one.sketch for one in linkages.structures]), self.first)
        types = [batch.block_type for batch in linkages.batches]
        self.kinds = make_block_kinds(types, False, is_start=True)
        self.places = {batch.block_type: self._link_places(batch.owner[:, None], batch.link_indices)
                       for batch in linkages.batches}  # fmt: skip
        self.shown: dict[BlockType, tuple[Array, BoolArray]] = {}
        "unknowns of blocks without closed form where they are shown (blocks, unknowns), and which are (blocks,)"
        has_closed_form = all(kind.has_closed_form for kind in types)
        self.frames = None if has_closed_form else _shown_frames(linkages, self.first)
        self.tape = self._make_tape()

    def _link_places(self, owner: IntArray, link_index: IntArray) -> IntArray:
        """The places of links among those of all linkages; 0 is the frame of all."""
        return np.where(link_index > 0, link_index + self.first[owner], 0)

    def _make_tape(self) -> TapedLinkages:
        numbers = [self._start_numbers(batch) for batch in self.linkages.batches]
        last_slots = [
            self.place_count + batch.block_numbers if batch.block_type.has_closed_form else STEP_TABLE
            for batch in self.linkages.batches
        ]
        tape = make_tape(self.linkages, numbers, self._link_places, last_slots, NO_POINTS, NO_INDICES)
        return tape._replace(tolerance=START_TOLERANCE_FACTOR * self.linkages.tolerance)

    def _start_numbers(self, batch: BlockBatch) -> Array:
        """The numbers of blocks (blocks, numbers): p, then the sums of the sketch, or unknowns to start from."""
        kind, places = batch.block_type, self.places[batch.block_type]
        if self.frames is None or kind.has_closed_form:
            return np.hstack([batch.p, self.sums[places[:, batch.inner_slots]].reshape(len(places), -1)])
        self.shown[kind] = _unknowns_from_frames(kind, self.frames, places, batch.p)
        return newton_numbers(kind, batch.p, self.shown[kind][0])

    def run(self, clearance: Array) -> BoolArray:
        """Fill the state, linkage after linkage: which of them (linkages,) are closed and so regular."""
        tape = self.tape._replace(clearance=clearance)
        return run_steps(tape, self.kinds, False, self.state, rotations(1, 0.0), 1).good > 0

    def judgements(self, batch: BlockBatch) -> Array:
        """How blocks in closed form are judged (blocks, rows), see `BlockType.start_formula`."""
        return self.state[self.place_count + batch.block_numbers, :, 0]

    def take_solved_frames(self) -> bool:
        """Begin again where links are not shown, but where what was solved before has them; whether there are any."""
        if self.frames is None or all(is_shown.all() for _, is_shown in self.shown.values()):
            return False
        x, y, c, s = self.state[: self.place_count, :POSE_ROWS, 0].T
        with np.errstate(invalid="ignore"):
            is_solved = ~self.frames.is_known & (np.abs(c * c + s * s - 1.0) < 0.5)
        solved = Frame(x, y, c, s, np.where(is_solved, np.arctan2(s, c), 0.0))
        frame = _choose_frames(is_solved, solved, self.frames.frame)
        self.frames = self.frames._replace(frame=frame, is_known=self.frames.is_known | is_solved)
        self.tape = self._make_tape()
        return True

    def distance_to_sketch(self, batch: BlockBatch) -> tuple[Array, Array]:
        """Squared distances of the points of blocks to the sketch (blocks,), and how many points these are."""
        inner = self.places[batch.block_type][:, batch.inner_slots]
        poses, sums = (np.moveaxis(rows, 2, 0) for rows in (self.state[inner, :POSE_ROWS, 0], self.sums[inner]))
        with np.errstate(invalid="ignore", over="ignore"):
            squared_distance = np.maximum(np.sum(squared_sketch_distance(poses, sums), axis=1), 0.0)
        return squared_distance, sums[0].sum(axis=1)


class _ShownFrames(NamedTuple):
    """Where links are shown (places,): frames of those that `is_shown`, and of those that are known as they were
    solved; and the middles of the points of all, in the link `local` and where they are shown `world` (2, places), NaN
    of none."""

    frame: Frame
    is_shown: BoolArray
    is_known: BoolArray
    local: Array
    world: Array


def _shown_frames(linkages: LinkageArrays, first: IntArray) -> _ShownFrames:
    """By the points of links, two at least that lie apart; the mechanism's frame is where it is."""
    points = linkages.sketch_points([one.shown_points for one in linkages.structures])
    counts, px, py, tx, ty, along, across, _ = _sketch_sums(points, first).T
    divisor = np.maximum(counts, 1.0)
    turn = along - (px * tx + py * ty) / divisor, across - (px * ty - py * tx) / divisor
    is_shown = (counts > 1.0) & (np.hypot(*turn) > LEAST_SPREAD)
    angle = np.arctan2(turn[1], turn[0])
    local, world = (np.where(counts > 0.0, of / divisor, np.nan) for of in (np.stack([px, py]), np.stack([tx, ty])))
    angle[0], is_shown[0], local[:, 0], world[:, 0] = 0.0, True, 0.0, 0.0
    return _ShownFrames(_frame_through(angle, local, world), is_shown, is_shown, local, world)


def _frame_through(angle: Array, local: Array, world: Array) -> Frame:
    """The frame at an angle in which points of links (2, links) lie where they are in the world."""
    c, s = np.cos(angle), np.sin(angle)
    return Frame(world[0] - (c * local[0] - s * local[1]), world[1] - (s * local[0] + c * local[1]), c, s, angle)


def _choose_frames(is_new: BoolArray, new: Frame, old: Frame) -> Frame:
    """New frames where they are, old ones elsewhere."""
    return Frame(*(np.where(is_new, *parts) for parts in zip(new[:5], old[:5], strict=True)))


class _Slide(NamedTuple):
    """A pair with coordinates between links of a block type, and its numbers (blocks,)."""

    pair: Any
    numbers: list[Array]

    def residual(self, frames: Mapping[str, Frame], unit_coordinate: int | None = None) -> list[Array]:
        """The residual of the pair with links at these frames, all coordinates 0 but for one that is 1."""
        coordinates = [float(k == unit_coordinate) for k in range(len(self.pair.coordinate_kinds))]
        return list(self.pair.residual([frames[link] for link in self.pair.bodies], self.numbers, coordinates))


def _unknowns_from_frames(kind: BlockType, shown: _ShownFrames, index: IntArray, p: Array) -> tuple[Array, BoolArray]:
    """The unknowns of blocks whose links are shown (blocks, unknowns), and whether those of a block are (blocks,), by
    p (blocks, numbers). Lengths of slides are read off the frames, in which they are linear."""
    slides, first = list[_Slide](), 0
    for pair in kind.mechanism.pairs:
        if pair.coordinate_kinds:
            slides.append(_Slide(pair, [p[:, first + k] for k in range(len(pair.number_kinds))]))
        first += len(pair.number_kinds)
    slots = [*range(len(kind.given_links)), *range(kind.slot_count)[-len(kind.inner_links) :]]
    frames, known = {"frame": GROUND}, {"frame": np.ones(len(p), dtype=bool)}
    places = {name: index[:, slot] for name, slot in zip((*kind.given_links, *kind.inner_links), slots, strict=True)}
    for name, indices in places.items():
        frames[name] = Frame(*(part[indices] for part in shown.frame[:5]))
        known[name] = (shown.is_known if name in kind.given_links else shown.is_shown)[indices]
    for slide in slides * 2:
        _align_slider(slide, kind, shown, places, frames, known)
    needed = kind.inner_links if all(kind.unknown_is_angle) else places
    is_shown = np.logical_and.reduce([known[name] for name in needed])
    unknowns: dict[tuple[str, str], Array] = {}
    for slide in slides:
        constant = np.array(slide.residual(frames)[:2])
        for k, (part, _) in enumerate(slide.pair.coordinate_kinds):
            direction = np.array(slide.residual(frames, k)[:2]) - constant
            with np.errstate(invalid="ignore"):  # of links that are not shown
                length = -np.sum(direction * constant, axis=0) / np.sum(direction * direction, axis=0)
            unknowns[slide.pair.name, part] = length
    unknowns |= {(name, "angle"): frames[name].angle for name in kind.inner_links}
    e = kind.equations
    names = [(e.coordinates[column].owner, e.coordinates[column].part) for column in e.unknowns]
    return np.stack([unknowns[name] for name in names], axis=1), is_shown


def _align_slider(
    slide: _Slide,
    kind: BlockType,
    shown: _ShownFrames,
    places: Mapping[str, IntArray],
    frames: dict[str, Frame],
    known: dict[str, BoolArray],
) -> None:
    """Place a link of which a single point is shown, if a slide fixes its angle to a known link."""
    if MeasureKind.ANGLE not in slide.pair.residual_kinds:
        return
    row = slide.pair.residual_kinds.index(MeasureKind.ANGLE)
    for link, other in (slide.pair.bodies, slide.pair.bodies[::-1]):
        if link not in kind.inner_links:
            continue
        local, world = shown.local[:, places[link]], shown.world[:, places[link]]
        is_aligned = ~known[link] & known[other] & np.isfinite(local[0])
        if is_aligned.any():
            constant, rotated = (
                slide.residual({**frames, link: frame_at(0.0, 0.0, angle)})[row] for angle in (0.0, 1.0)
            )
            slider_frame = _frame_through(constant / (constant - rotated), local, world)
            frames[link] = _choose_frames(is_aligned, slider_frame, frames[link])
            known[link] |= is_aligned


def _sketch_sums(points: LinkArrays, first: IntArray) -> Array:
    """The sums of the points of every place (places, SKETCH_SUMS)."""
    px, py, tx, ty = points.numbers.T
    along, across = px * tx + py * ty, px * ty - py * tx
    squares = px * px + py * py + tx * tx + ty * ty
    terms = np.array([np.ones_like(px), px, py, tx, ty, along, across, squares])
    bins = (first[points.owner] + points.link_index) * SKETCH_SUMS + np.arange(SKETCH_SUMS)[:, None]
    sums = np.bincount(bins.ravel(), terms.ravel(), (1 + first[-1]) * SKETCH_SUMS)
    return np.asarray(sums.reshape(-1, SKETCH_SUMS), dtype=float)
