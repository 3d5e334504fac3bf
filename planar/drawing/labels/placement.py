"""Places for letters: near what they name, clear of strokes and of each other.

Every letter has candidates: its box stands at a distance from the spot, in some direction. A candidate costs what it
hides and how far off it is; two letters cost where their boxes meet. Letters choose in turns, each the cheapest place
beside where the others are now, until no one would move; one that finds no room sends others away if the whole gains.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import product
from math import ceil, floor, hypot
from typing import NamedTuple

import numpy as np

from planar.drawing.labels.text_metrics import fit_label, join_labels, text_size
from planar.drawing.paper.boxes import (
    Box,
    are_crossing,
    bounding_boxes,
    distances_from_boxes,
    lengths_inside_boxes,
    nearby_pairs,
    overlap_depths,
    surrounding_positions,
)
from planar.drawing.paper.picture import Circle, Label, Mark, PaperPoint
from planar.drawing.paper.stroke_shapes import StrokeSegments, stroke_segments

SAME_POINT_TOLERANCE = 0.05
"""mm within which spots coincide."""
LEADER_DISTANCE = 3.5
"""mm beyond `away` from which on a line leads from a letter to its spot."""
DISTANCE_STAGES = ((0.0, 0.8, 1.6, 2.4, 3.3), (4.5, 6.5, 9.0, 12.5, 17.0), (23.0, 31.0, 42.0))
"""mm beyond `away` at which a letter may stand; later ones only where those before have no room."""
MIN_STROKE_GAP, GOOD_STROKE_GAP, MIN_LABEL_GAP = 0.15, 0.7, 0.45
"""mm to strokes at the least; mm to strokes that look well; mm between letters at the least."""
STROKE_COST, OVERLAP_COST, LEADER_COST = 40.0, 120.0, 40.0
"""Costs of a stroke across a letter, of letters that meet, of a leader across a letter."""
READ_ON_DISTANCE, READ_ON_COST = 10.0, 4.0
"""mm within which a figure that follows words in their line is read as theirs, and what that costs."""
ACCEPTABLE_COST = 12.0
"""What the place of a letter costs at the most where nothing is wrong with it."""
FREEDOM_COST = 6.0
"""What places may cost beyond the cheapest one to count as room that a letter has."""
STROKES_AT_ONCE = 64
"""Strokes that are looked at together among many letters."""
MAX_FAR_LABELS = 200
"""Of more labels only places near by are looked at, without leaders, and labels that have no room there are left out:
leaders of so many cross everything."""
CROWDED_DISTANCES = (0.0, 1.6, 3.3)
"""mm beyond `away` at which one of so many may stand."""
MAX_SWEEPS, MAX_CHOICES = 5, 700
"""Rounds in which labels choose again, most drawings need two; and choices in all of them: very many choose once."""


class PlacedLabel(NamedTuple):
    """A letter fit to draw (several at one spot: joined), its text's box, and the line that leads to its spot."""

    label: Label
    box: Box
    leader: tuple[PaperPoint, PaperPoint] | None


def count_labels(labels: Iterable[Label]) -> int:
    """How many letters `place_labels` has to place, those of one spot joined."""
    fitted = [fit_label(each) for each in labels if each.text.strip()]
    return sum(each.side is not None for each in fitted) + len(_group_labels([e for e in fitted if e.side is None]))


def place_labels(
    labels: Iterable[Label], marks: Iterable[Mark], obstacles: Sequence[Box] = ()
) -> tuple[PlacedLabel, ...]:
    """Where letters go: off the strokes of the marks, off the obstacles, off each other; in the order given.

    Letters of one size and slant at one spot are joined into one text, equal texts stand once. The same letters and
    marks give the same places. Boxes never overlap each other; strokes are crossed only where all room within some
    40 mm is taken. Of more than MAX_FAR_LABELS those that have no room near their spots are left out.
    """
    marks = list(marks)
    fitted = [fit_label(each) for each in labels if each.text.strip()]
    settled = tuple(PlacedLabel(each, _side_box(each, each.side), None) for each in fitted if each.side is not None)
    named = [join_labels(together) for together in _group_labels([each for each in fitted if each.side is None])]
    if not named:
        return settled
    taken = [*obstacles, *(each.box for each in settled)]
    board = _LabelPlacer(named, stroke_segments(marks), np.array(taken, dtype=float).reshape(-1, 4))
    board.settle()
    rims = [mark for mark in marks if isinstance(mark, Circle)]
    return settled + tuple(
        PlacedLabel(letter, Box(*map(float, box)), _leader_line(letter, box, rims))
        for letter, box in zip(named, board.boxes, strict=True)
        if not np.isnan(box[0])
    )


def _side_box(label: Label, side: PaperPoint) -> Box:
    """The box of a letter that has to stand on one side of its spot."""
    width, height, _ = text_size(label.text, label.size, label.slanted, label.math)
    x, y = (
        at + way * (label.clearance + size / 2.0) for at, way, size in zip(label.at, side, (width, height), strict=True)
    )
    return Box(x - width / 2.0, y - height / 2.0, x + width / 2.0, y + height / 2.0)


def _name_same_point(one: Label, other: Label) -> bool:
    """Whether letters name the same spot in the same manner: the number of a link does not join a point's name."""
    return (one.size, one.slanted) == (other.size, other.slanted) and _distance(
        one.at, other.at
    ) <= SAME_POINT_TOLERANCE


def _group_labels(letters: list[Label]) -> list[list[Label]]:
    """Letters by spot and manner, in the order given."""
    groups: list[list[Label]] = []
    groups_in_cell: dict[tuple[int, int], list[int]] = {}
    for letter in letters:
        x, y = (floor(at / SAME_POINT_TOLERANCE) for at in letter.at)
        beside = product((x - 1, x, x + 1), (y - 1, y, y + 1))
        near = sorted(group for cell in beside for group in groups_in_cell.get(cell, ()))
        same = next((group for group in near if _name_same_point(groups[group][0], letter)), None)
        if same is None:
            groups_in_cell.setdefault((x, y), []).append(len(groups))
            groups.append([letter])
        else:
            groups[same].append(letter)
    return groups


def _distance(one: PaperPoint, other: PaperPoint) -> float:
    return hypot(one[0] - other[0], one[1] - other[1])


def _leader_line(letter: Label, box: np.ndarray, rims: list[Circle]) -> tuple[PaperPoint, PaperPoint] | None:
    """The line from a box to its spot, or to the rim of a pin there, where it is needed."""
    x, y = letter.at
    near = float(np.clip(x, box[0], box[2])), float(np.clip(y, box[1], box[3]))
    far = _distance(near, letter.at)
    if far <= _leaderless_distance(letter):
        return None
    rim = max(
        (
            each.radius
            for each in rims
            if _distance(each.centre, letter.at) <= SAME_POINT_TOLERANCE and each.radius < 2.0
        ),
        default=0,
    )
    ends = [(x + (near[0] - x) * part, y + (near[1] - y) * part) for part in ((far - 0.2) / far, rim / far)]
    return ends[0], ends[1]


def _leaderless_distance(letter: Label) -> float:
    """The distance to its spot (mm) up to which a letter needs no leader."""
    return letter.clearance + LEADER_DISTANCE


class _LabelCandidates(NamedTuple):
    """Candidates of one letter: boxes (n, 4), leaders (n, 4; NaN where none) and costs without other letters (n,)."""

    boxes: np.ndarray
    leaders: np.ndarray
    costs: np.ndarray

    def select(self, selection: slice | list[int] | np.ndarray) -> _LabelCandidates:
        """Those that a slice or indices choose."""
        return _LabelCandidates(self.boxes[selection], self.leaders[selection], self.costs[selection])

    def ordered(self) -> _LabelCandidates:
        """The same, the cheapest first."""
        return self.select(np.argsort(self.costs, kind="stable"))


class _LabelPlacer:
    """Letters being placed: candidates of each, and where each stands now."""

    def __init__(self, letters: list[Label], strokes: StrokeSegments, obstacles: np.ndarray):
        self.labels, self.strokes, self.obstacles = letters, strokes, obstacles
        self.bounds = bounding_boxes(strokes.ends)
        sizes = [text_size(each.text, each.size, each.slanted, each.math) for each in letters]
        self.sizes = np.array([(each.width, each.height) for each in sizes])
        self.points = np.array([each.at for each in letters])
        self.starts_with_digit = np.array([each.text[:1].isdigit() for each in letters])
        self.has_spaces = np.array([" " in each.text for each in letters])
        self.stages = [1] * len(letters)
        self.is_crowded = len(letters) > MAX_FAR_LABELS
        distances = CROWDED_DISTANCES if self.is_crowded else DISTANCE_STAGES[0]
        self.stage_count = 1 if self.is_crowded else len(DISTANCE_STAGES)
        self.candidates = [self._candidates(index, distances) for index in range(len(letters))]
        self.boxes = np.full((len(letters), 4), np.nan)
        self.leaders = np.full((len(letters), 4), np.nan)
        self.costs_paid = np.full(len(letters), np.inf)

    def _candidates(self, index: int, steps: Sequence[float]) -> _LabelCandidates:
        """Boxes at these distances beyond `away`, with what each costs by itself."""
        letter, spot, (width, height) = self.labels[index], self.points[index], self.sizes[index]
        rings = [
            (letter.clearance + step, *surrounding_positions(width, height, letter.clearance + step)) for step in steps
        ]
        far = np.concatenate([np.full(len(middles), distance) for distance, middles, _ in rings])
        middles = np.concatenate([each for _, each, _ in rings])
        ways = np.concatenate([each for _, _, each in rings])
        half = np.array([width, height]) / 2.0
        boxes = np.concatenate([spot + middles - half, spot + middles + half], axis=1)
        led = far > _leaderless_distance(letter)
        leaders = np.concatenate([spot + far[:, None] * ways, np.broadcast_to(spot, ways.shape)], axis=1)
        leaders[~led] = np.nan
        region = np.concatenate([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])
        near = self.strokes.select(nearby_pairs(region[None], self.bounds, 1.5)[1])
        costs = 1.2 * np.minimum(far - letter.clearance, LEADER_DISTANCE) + np.where(led, 6.0 + 0.5 * far, 0.0)
        costs += self._direction_costs(letter, ways) + 0.5 * self._offset_from_middle(middles, half, ways)
        if self.is_crowded:  # what costs too much stands nowhere
            clear = self._clear_of_strokes(boxes, near, costs)
            boxes, leaders, far, led, costs = boxes[clear], leaders[clear], far[clear], led[clear], costs[clear]
        costs += self._stroke_costs(boxes, near) + self._other_point_costs(index, region, boxes, far, led)
        if len(self.obstacles):
            deep = overlap_depths(boxes, self.obstacles, MIN_STROKE_GAP)
            costs += np.where(deep > 0.0, OVERLAP_COST + 10.0 * deep, 0.0).sum(axis=1)
        costs[led] += 5.0
        # leaders are only looked at where the rest would do
        good = led & (costs < min(costs.min() + ACCEPTABLE_COST, STROKE_COST + ACCEPTABLE_COST))
        if good.any():
            lines = leaders[good]
            line, piece = nearby_pairs(bounding_boxes(lines), bounding_boxes(near.ends), 0.0)
            crossed = are_crossing(lines[line], near.ends[piece]) * near.weights[piece]
            costs[good] += np.minimum(1.5 * np.bincount(line, crossed, minlength=len(lines)), 9.0) - 5.0
        return _LabelCandidates(boxes, leaders, costs).ordered()

    def _clear_of_strokes(self, boxes: np.ndarray, near: StrokeSegments, costs: np.ndarray) -> np.ndarray:
        """Indices of the boxes that strokes leave within reach of an acceptable cost; of one where there are none.

        Among many strokes the first ones decide over most boxes.
        """
        most = ACCEPTABLE_COST + FREEDOM_COST
        left = np.flatnonzero(costs <= most)
        crossing = costs[left]
        parts = ceil(len(near.ends) / STROKES_AT_ONCE)
        spread = np.concatenate([np.arange(k, len(near.ends), parts) for k in range(parts)] or [np.zeros(0, dtype=int)])
        first, count = 0, STROKES_AT_ONCE
        while first < len(spread):
            part = near.select(spread[first : first + count])  # those next to each other in the list lie side by side
            first, count = first + count, 2 * count
            box, piece = nearby_pairs(boxes[left], bounding_boxes(part.ends), GOOD_STROKE_GAP + 0.5)
            crossing = crossing + self._crossing_costs(boxes[left], part, box, piece)
            kept = crossing <= most
            left, crossing = left[kept], crossing[kept]
            if not len(left):
                return np.array([int(costs.argmin())])
        return left

    def _direction_costs(self, letter: Label, ways: np.ndarray) -> np.ndarray:
        """The free side is opposite to the strokes about the spot; with none, up and to the right."""
        costs = 0.25 * (1.0 - ways.sum(axis=1) / np.sqrt(2.0))
        radius = letter.clearance + 4.0
        low, high = self.bounds[:, :2] - radius, self.bounds[:, 2:] + radius
        ends = self.strokes.ends[((low <= letter.at) & (letter.at <= high)).all(axis=1)]
        start = ends[:, :2] - letter.at
        way = ends[:, 2:] - ends[:, :2]
        square = np.maximum((way**2).sum(axis=1), 1e-18)
        middle = -(start * way).sum(axis=1) / square
        root = middle**2 - ((start**2).sum(axis=1) - radius**2) / square
        reach = np.sqrt(np.maximum(root, 0.0))
        first, last = np.clip(middle - reach, 0.0, 1.0), np.clip(middle + reach, 0.0, 1.0)
        lengths = np.where(root > 0.0, (last - first) * np.sqrt(square), 0.0)
        if lengths.sum() > 1e-6:
            towards = start + ((first + last) / 2.0)[:, None] * way
            towards /= np.maximum(np.linalg.norm(towards, axis=1), 1e-9)[:, None]
            costs += 2.0 * (1.0 + ways @ (lengths @ towards) / lengths.sum())
        return costs

    @staticmethod
    def _offset_from_middle(middles: np.ndarray, half: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """How far a box beside its spot is off the middle, 0 to 1."""
        off = np.abs(middles) / half
        return np.where(ways[:, 0] == 0.0, off[:, 0], np.where(ways[:, 1] == 0.0, off[:, 1], 1.0))

    def _stroke_costs(self, boxes: np.ndarray, near: StrokeSegments) -> np.ndarray:
        """What strokes across boxes cost, and less those close by."""
        box, piece = nearby_pairs(boxes, bounding_boxes(near.ends), GOOD_STROKE_GAP + 0.5)
        wide = lengths_inside_boxes(boxes[box], near.ends[piece], near.half_widths[piece] + GOOD_STROKE_GAP) >= 0.0
        box, piece = box[wide], piece[wide]
        beside = np.bincount(box, near.weights[piece], minlength=len(boxes))
        return self._crossing_costs(boxes, near, box, piece) + np.minimum(1.5 * beside, 5.0)

    @staticmethod
    def _crossing_costs(boxes: np.ndarray, near: StrokeSegments, box: np.ndarray, piece: np.ndarray) -> np.ndarray:
        """What strokes across boxes cost, by pairs of a box and a piece of a stroke."""
        length = lengths_inside_boxes(boxes[box], near.ends[piece], near.half_widths[piece] + MIN_STROKE_GAP)
        across = np.where(length >= 0.0, near.weights[piece] * (STROKE_COST + 8.0 * length), 0.0)
        return np.bincount(box, across, minlength=len(boxes))

    def _other_point_costs(
        self, index: int, region: np.ndarray, boxes: np.ndarray, far: np.ndarray, led: np.ndarray
    ) -> np.ndarray:
        """What it costs to cover the spot of another letter, or to stand nearer to it than to one's own."""
        spots = self.points[np.abs(self.points - self.points[index]).max(axis=1) > SAME_POINT_TOLERANCE]
        low, high = region[:2] - LEADER_DISTANCE, region[2:] + LEADER_DISTANCE
        spots = spots[((spots >= low) & (spots <= high)).all(axis=1)]
        if not len(spots):
            return np.zeros(len(boxes))
        nearest = distances_from_boxes(boxes, spots).min(axis=1)
        return np.where(nearest < 0.4, STROKE_COST, 0.0) + np.where(~led & (nearest < far + 0.3), 4.0, 0.0)

    def _read_on_costs(self, index: int, boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
        """What it costs that a figure stands behind words in their line, as if it were a part of what they say (n,)."""
        costs = np.zeros(len(boxes))
        for own, theirs, behind in (
            (self.starts_with_digit, self.has_spaces, 1.0),
            (self.has_spaces, self.starts_with_digit, -1.0),
        ):
            found = self.boxes[others[theirs[others]]] if own[index] else np.empty((0, 4))
            left, right = (found[None], boxes[:, None]) if behind > 0.0 else (boxes[:, None], found[None])
            gap = right[..., 0] - left[..., 2]
            level = np.minimum(left[..., 3], right[..., 3]) - np.maximum(left[..., 1], right[..., 1])
            costs += READ_ON_COST * ((gap > 0.0) & (gap < READ_ON_DISTANCE) & (level > 0.0)).sum(axis=1)
        return costs

    def _costs_beside(self, index: int, choice: _LabelCandidates, others: np.ndarray) -> np.ndarray:
        """What the candidates cost besides others (indices) that stand somewhere (n,)."""
        boxes, leaders = self.boxes[others], self.leaders[others]
        leaders = leaders[~np.isnan(leaders[:, 0])]
        count, bounds = len(choice.boxes), bounding_boxes(leaders)
        deep = overlap_depths(choice.boxes, boxes, MIN_LABEL_GAP)
        costs = np.where(deep > 0.0, OVERLAP_COST + 20.0 * deep, 0.0).sum(axis=1) + self._read_on_costs(
            index, choice.boxes, others
        )
        if len(leaders):
            box, piece = nearby_pairs(choice.boxes, bounds, 0.2)
            blind = lengths_inside_boxes(choice.boxes[box], leaders[piece], 0.2) >= 0.0
            costs += LEADER_COST * np.bincount(box, blind, minlength=count)
        led = np.flatnonzero(~np.isnan(choice.leaders[:, 0]))
        if len(led):
            lines = choice.leaders[led]
            line, box = nearby_pairs(bounding_boxes(lines), boxes, 0.2)
            blind = lengths_inside_boxes(boxes[box], lines[line], 0.2) >= 0.0
            costs += LEADER_COST * np.bincount(led[line], blind, minlength=count)
            line, piece = nearby_pairs(bounding_boxes(lines), bounds, 0.0)
            costs += 5.0 * np.bincount(led[line], are_crossing(lines[line], leaders[piece]), minlength=count)
        return costs

    def _placed_indices(self, *excluded: int) -> np.ndarray:
        """Indices of the letters that stand somewhere, but for some."""
        stands = ~np.isnan(self.boxes[:, 0])
        stands[list(excluded)] = False
        return np.flatnonzero(stands)

    def _place(self, index: int, choice: _LabelCandidates, which: int) -> None:
        self.boxes[index], self.leaders[index] = choice.boxes[which], choice.leaders[which]
        self.costs_paid[index] = choice.costs[which]

    def _cheapest(self, index: int, choice: _LabelCandidates, others: np.ndarray) -> tuple[int, float]:
        """The cheapest candidate beside others, and its cost; the rest is not looked at once that is sure."""
        others = self._others_near(choice, others)
        best, least, start, count = 0, np.inf, 0, 24
        while start < len(choice.costs) and choice.costs[start] < least:
            part = slice(start, start + count)
            costs = choice.costs[part] + self._costs_beside(index, choice.select(part), others)
            if costs.min() < least:
                best, least = start + int(costs.argmin()), float(costs.min())
            start, count = start + count, 2 * count
        return best, least

    def _others_near(self, choice: _LabelCandidates, others: np.ndarray) -> np.ndarray:
        """Those of others (indices) that can cost any of the candidates something."""
        parts = np.concatenate([choice.boxes, bounding_boxes(choice.leaders)])
        region = np.concatenate([np.nanmin(parts[:, :2], axis=0), np.nanmax(parts[:, 2:], axis=0)])[None]
        boxes, leaders = self.boxes[others], bounding_boxes(self.leaders[others])
        low, high = np.fmin(boxes[:, :2], leaders[:, :2]), np.fmax(boxes[:, 2:], leaders[:, 2:])
        return others[nearby_pairs(region, np.concatenate([low, high], axis=1), READ_ON_DISTANCE)[1]]

    def _choose(self, index: int) -> float:
        """Put one letter where it costs least now, looking farther off while nothing good is found; that cost."""
        others = self._placed_indices(index)
        best, least = self._cheapest(index, self.candidates[index], others)
        while least > ACCEPTABLE_COST and self.stages[index] < self.stage_count:
            both = zip(
                self.candidates[index], self._candidates(index, DISTANCE_STAGES[self.stages[index]]), strict=True
            )
            self.candidates[index] = _LabelCandidates(*(np.concatenate(each) for each in both)).ordered()
            self.stages[index] += 1
            best, least = self._cheapest(index, self.candidates[index], others)
        if self.is_crowded and least > ACCEPTABLE_COST:
            self.boxes[index] = self.leaders[index] = np.nan
        else:
            self._place(index, self.candidates[index], best)
        return least

    def settle(self) -> None:
        """Let the letters choose, those with the least room first, until none moves; then part any that still meet."""
        costs = [choice.costs for choice in self.candidates]
        freedom = [np.searchsorted(ordered, ordered[0] + FREEDOM_COST) - ordered[0] for ordered in costs]
        order = [int(each) for each in np.argsort(freedom, kind="stable")]
        for index in order:
            self._choose(index)
        sweeps = min(MAX_SWEEPS, MAX_CHOICES // max(len(order), 1))
        tries = 0 if self.is_crowded else min(len(order), MAX_CHOICES - sweeps * len(order))
        for _ in range(sweeps):
            before = self.boxes.copy()
            for index in order:
                if self._choose(index) > ACCEPTABLE_COST and tries > 0:
                    self._displace(index)
                    tries -= 1
            if np.array_equal(before, self.boxes, equal_nan=True):
                break
        self._separate()

    def _displace(self, index: int) -> None:
        """Try good places that others hold: they choose anew, and all stays so if the whole then costs less."""
        choice = self.candidates[index]
        others = self._placed_indices(index)
        for which in range(min(6, len(choice.costs))):
            meets = others[overlap_depths(choice.boxes[which][None], self.boxes[others], MIN_LABEL_GAP)[0] > 0.0]
            if choice.costs[which] > ACCEPTABLE_COST or not 0 < len(meets) <= 3:
                continue
            touched = [index, *map(int, meets)]
            kept = self.boxes.copy(), self.leaders.copy(), self.costs_paid.copy()
            before = self._joint_cost(touched)
            self._place(index, choice, which)
            for each in touched[1:]:
                self._choose(each)
            if self._joint_cost(touched) < before - 1e-6:
                return
            self.boxes, self.leaders, self.costs_paid = kept

    def _joint_cost(self, touched: list[int]) -> float:
        """What some letters cost together, each pair of them once."""
        total = 0.0
        for place, index in enumerate(touched):
            now = _LabelCandidates(self.boxes[index][None], self.leaders[index][None], self.costs_paid[[index]])
            total += self.costs_paid[index] + float(
                self._costs_beside(index, now, self._placed_indices(*touched[: place + 1]))[0]
            )
        return total

    def _separate(self) -> None:
        """Letters that still meet another go outwards, ring by ring, until they stand alone."""
        for index in range(len(self.labels)):
            others = self._placed_indices(index)
            step = DISTANCE_STAGES[-1][-1] / 4.0
            while overlap_depths(self.boxes[[index]], self.boxes[others], 0.0).max(initial=0.0) > 0.0:
                choice = self._candidates(index, (step, step * 1.15, step * 1.3))
                costs = choice.costs + self._costs_beside(index, choice, others)
                costs[overlap_depths(choice.boxes, self.boxes[others], 0.0).max(axis=1) > 0.0] += 1e9
                self._place(index, choice, int(costs.argmin()))
                step *= 1.5
