"""Places for letters: near what they name, clear of strokes and of each other.

Every letter has candidates: its box stands at a distance from the spot, in some direction. A candidate costs what it
hides and how far off it is; two letters cost where their boxes meet. Letters choose in turns, each the cheapest place
beside where the others are now, until no one would move; one that finds no room sends others away if the whole gains.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from math import hypot
from typing import NamedTuple

import numpy as np

from planar.drawing.labels.text_metrics import fit, joined, measured
from planar.drawing.paper.boxes import Box, around, close, crossing, distances, inside, meet, ring
from planar.drawing.paper.picture import Circle, Letter, Mark, Spot
from planar.drawing.paper.stroke_shapes import Pieces, pieces

SAME = 0.05
"""mm within which spots coincide."""
LEADER = 3.5
"""mm beyond `away` from which on a line leads from a letter to its spot."""
STAGES = ((0.0, 0.8, 1.6, 2.4, 3.3), (4.5, 6.5, 9.0, 12.5, 17.0), (23.0, 31.0, 42.0))
"""mm beyond `away` at which a letter may stand; later ones only where those before have no room."""
CLEAR, WIDE, GAP = 0.15, 0.7, 0.45
"""mm to strokes at the least; mm to strokes that look well; mm between letters at the least."""
HIT, MEET, BLIND = 40.0, 120.0, 40.0
"""Costs of a stroke across a letter, of letters that meet, of a leader across a letter."""
ALONG, READS_ON = 10.0, 4.0
"""mm within which a figure that follows words in their line is read as theirs, and what that costs."""
GOOD = 12.0
"""What the place of a letter costs at the most where nothing is wrong with it."""
SWEEPS = 5
"""Rounds in which letters may move; most drawings need two."""


class Placed(NamedTuple):
    """A letter fit to draw (several at one spot: joined), its text's box, and the line that leads to its spot."""

    letter: Letter
    box: Box
    leader: tuple[Spot, Spot] | None


def placed(letters: Iterable[Letter], marks: Iterable[Mark], obstacles: Sequence[Box] = ()) -> tuple[Placed, ...]:
    """Where letters go: off the strokes of the marks, off the obstacles, off each other; in the order given.

    Letters of one size and slant at one spot are joined into one text, equal texts stand once. The same letters and
    marks give the same places. Boxes never overlap each other; strokes are crossed only where all room within some
    40 mm is taken.
    """
    marks = list(marks)
    fitted = [fit(each) for each in letters if each.text.strip()]
    settled = tuple(Placed(each, _beside(each, each.side), None) for each in fitted if each.side is not None)
    named = [joined(together) for together in _together([each for each in fitted if each.side is None])]
    if not named:
        return settled
    taken = [*obstacles, *(each.box for each in settled)]
    board = _Board(named, pieces(marks), np.array(taken, dtype=float).reshape(-1, 4))
    board.settle()
    rims = [mark for mark in marks if isinstance(mark, Circle)]
    return settled + tuple(
        Placed(letter, Box(*map(float, box)), _leader(letter, box, rims))
        for letter, box in zip(named, board.boxes, strict=True)
    )


def _beside(letter: Letter, side: Spot) -> Box:
    """The box of a letter that has to stand on one side of its spot."""
    width, height, _ = measured(letter.text, letter.size, letter.slanted, letter.math)
    x, y = (
        at + way * (letter.away + size / 2.0) for at, way, size in zip(letter.at, side, (width, height), strict=True)
    )
    return Box(x - width / 2.0, y - height / 2.0, x + width / 2.0, y + height / 2.0)


def _alike(one: Letter, other: Letter) -> bool:
    """Whether letters name the same spot in the same manner: the number of a link does not join a point's name."""
    return (one.size, one.slanted) == (other.size, other.slanted) and _apart(one.at, other.at) <= SAME


def _together(letters: list[Letter]) -> list[list[Letter]]:
    """Letters by spot and manner, in the order given."""
    groups: list[list[Letter]] = []
    for letter in letters:
        found = next((each for each in groups if _alike(each[0], letter)), None)
        if found is None:
            groups.append([letter])
        else:
            found.append(letter)
    return groups


def _apart(one: Spot, other: Spot) -> float:
    return hypot(one[0] - other[0], one[1] - other[1])


def _leader(letter: Letter, box: np.ndarray, rims: list[Circle]) -> tuple[Spot, Spot] | None:
    """The line from a box to its spot, or to the rim of a pin there, where it is needed."""
    x, y = letter.at
    near = float(np.clip(x, box[0], box[2])), float(np.clip(y, box[1], box[3]))
    far = _apart(near, letter.at)
    if far <= _reach(letter):
        return None
    rim = max((each.radius for each in rims if _apart(each.centre, letter.at) <= SAME and each.radius < 2.0), default=0)
    ends = [(x + (near[0] - x) * part, y + (near[1] - y) * part) for part in ((far - 0.2) / far, rim / far)]
    return ends[0], ends[1]


def _reach(letter: Letter) -> float:
    """The distance to its spot (mm) up to which a letter needs no leader."""
    return letter.away + LEADER


class _Choice(NamedTuple):
    """Candidates of one letter: boxes (n, 4), leaders (n, 4; NaN where none) and costs without other letters (n,)."""

    boxes: np.ndarray
    leaders: np.ndarray
    costs: np.ndarray

    def chosen(self, which: slice | list[int] | np.ndarray) -> _Choice:
        """Those that a slice or indices choose."""
        return _Choice(self.boxes[which], self.leaders[which], self.costs[which])

    def ordered(self) -> _Choice:
        """The same, the cheapest first."""
        return self.chosen(np.argsort(self.costs, kind="stable"))


class _Board:
    """Letters being placed: candidates of each, and where each stands now."""

    def __init__(self, letters: list[Letter], strokes: Pieces, obstacles: np.ndarray):
        self.letters, self.strokes, self.obstacles = letters, strokes, obstacles
        self.bounds = around(strokes.ends)
        sizes = [measured(each.text, each.size, each.slanted, each.math) for each in letters]
        self.sizes = np.array([(each.width, each.height) for each in sizes])
        self.spots = np.array([each.at for each in letters])
        self.figures = np.array([each.text[:1].isdigit() for each in letters])
        self.words = np.array([" " in each.text for each in letters])
        self.stages = [1] * len(letters)
        self.choices = [self._candidates(index, STAGES[0]) for index in range(len(letters))]
        self.boxes = np.full((len(letters), 4), np.nan)
        self.leaders = np.full((len(letters), 4), np.nan)
        self.paid = np.full(len(letters), np.inf)

    def _candidates(self, index: int, steps: Sequence[float]) -> _Choice:
        """Boxes at these distances beyond `away`, with what each costs by itself."""
        letter, spot, (width, height) = self.letters[index], self.spots[index], self.sizes[index]
        rings = [(letter.away + step, *ring(width, height, letter.away + step)) for step in steps]
        far = np.concatenate([np.full(len(middles), distance) for distance, middles, _ in rings])
        middles = np.concatenate([each for _, each, _ in rings])
        ways = np.concatenate([each for _, _, each in rings])
        half = np.array([width, height]) / 2.0
        boxes = np.concatenate([spot + middles - half, spot + middles + half], axis=1)
        led = far > _reach(letter)
        leaders = np.concatenate([spot + far[:, None] * ways, np.broadcast_to(spot, ways.shape)], axis=1)
        leaders[~led] = np.nan
        near = self._near(boxes)
        costs = 1.2 * np.minimum(far - letter.away, LEADER) + np.where(led, 6.0 + 0.5 * far, 0.0)
        costs += self._direction(letter, ways) + 0.5 * self._skew(middles, half, ways)
        costs += self._strokes(boxes, near) + self._others(index, boxes, far, led)
        if len(self.obstacles):
            deep = meet(boxes, self.obstacles, CLEAR)
            costs += np.where(deep > 0.0, MEET + 10.0 * deep, 0.0).sum(axis=1)
        costs[led] += 5.0
        # leaders are only looked at where the rest would do
        good = led & (costs < min(costs.min() + GOOD, HIT + GOOD))
        if good.any():
            lines = leaders[good]
            line, piece = close(around(lines), around(near.ends), 0.0)
            crossed = crossing(lines[line], near.ends[piece]) * near.weight[piece]
            costs[good] += np.minimum(1.5 * np.bincount(line, crossed, minlength=len(lines)), 9.0) - 5.0
        return _Choice(boxes, leaders, costs).ordered()

    def _near(self, boxes: np.ndarray) -> Pieces:
        """The strokes that any of the boxes can have to do with."""
        whole = np.concatenate([boxes[:, :2].min(axis=0), boxes[:, 2:].max(axis=0)])[None]
        return self.strokes.chosen(close(whole, self.bounds, 1.5)[1])

    def _direction(self, letter: Letter, ways: np.ndarray) -> np.ndarray:
        """The free side is opposite to the strokes about the spot; with none, up and to the right."""
        costs = 0.25 * (1.0 - ways.sum(axis=1) / np.sqrt(2.0))
        radius = letter.away + 4.0
        start = self.strokes.ends[:, :2] - letter.at
        way = self.strokes.ends[:, 2:] - self.strokes.ends[:, :2]
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
    def _skew(middles: np.ndarray, half: np.ndarray, ways: np.ndarray) -> np.ndarray:
        """How far a box beside its spot is off the middle, 0 to 1."""
        off = np.abs(middles) / half
        return np.where(ways[:, 0] == 0.0, off[:, 0], np.where(ways[:, 1] == 0.0, off[:, 1], 1.0))

    @staticmethod
    def _strokes(boxes: np.ndarray, near: Pieces) -> np.ndarray:
        """What strokes across boxes cost, and less those close by."""
        box, piece = close(boxes, around(near.ends), WIDE + 0.5)
        wide = inside(boxes[box], near.ends[piece], near.half[piece] + WIDE) >= 0.0
        box, piece = box[wide], piece[wide]
        weight = near.weight[piece]
        tight = inside(boxes[box], near.ends[piece], near.half[piece] + CLEAR)
        across = np.where(tight >= 0.0, weight * (HIT + 8.0 * tight), 0.0)
        beside = np.bincount(box, weight, minlength=len(boxes))
        return np.bincount(box, across, minlength=len(boxes)) + np.minimum(1.5 * beside, 5.0)

    def _others(self, index: int, boxes: np.ndarray, far: np.ndarray, led: np.ndarray) -> np.ndarray:
        """What it costs to cover the spot of another letter, or to stand nearer to it than to one's own."""
        spots = self.spots[np.abs(self.spots - self.spots[index]).max(axis=1) > SAME]
        low, high = boxes[:, :2].min(axis=0) - LEADER, boxes[:, 2:].max(axis=0) + LEADER
        spots = spots[((spots >= low) & (spots <= high)).all(axis=1)]
        if not len(spots):
            return np.zeros(len(boxes))
        nearest = distances(boxes, spots).min(axis=1)
        return np.where(nearest < 0.4, HIT, 0.0) + np.where(~led & (nearest < far + 0.3), 4.0, 0.0)

    def _read_on(self, index: int, boxes: np.ndarray, others: np.ndarray) -> np.ndarray:
        """What it costs that a figure stands behind words in their line, as if it were a part of what they say (n,)."""
        costs = np.zeros(len(boxes))
        for own, theirs, behind in ((self.figures, self.words, 1.0), (self.words, self.figures, -1.0)):
            found = self.boxes[others[theirs[others]]] if own[index] else np.empty((0, 4))
            left, right = (found[None], boxes[:, None]) if behind > 0.0 else (boxes[:, None], found[None])
            gap = right[..., 0] - left[..., 2]
            level = np.minimum(left[..., 3], right[..., 3]) - np.maximum(left[..., 1], right[..., 1])
            costs += READS_ON * ((gap > 0.0) & (gap < ALONG) & (level > 0.0)).sum(axis=1)
        return costs

    def _beside(self, index: int, choice: _Choice, others: np.ndarray) -> np.ndarray:
        """What the candidates cost besides others (indices) that stand somewhere (n,)."""
        boxes, leaders = self.boxes[others], self.leaders[others]
        leaders = leaders[~np.isnan(leaders[:, 0])]
        count, bounds = len(choice.boxes), around(leaders)
        deep = meet(choice.boxes, boxes, GAP)
        costs = np.where(deep > 0.0, MEET + 20.0 * deep, 0.0).sum(axis=1) + self._read_on(index, choice.boxes, others)
        if len(leaders):
            box, piece = close(choice.boxes, bounds, 0.2)
            blind = inside(choice.boxes[box], leaders[piece], 0.2) >= 0.0
            costs += BLIND * np.bincount(box, blind, minlength=count)
        led = np.flatnonzero(~np.isnan(choice.leaders[:, 0]))
        if len(led):
            lines = choice.leaders[led]
            line, box = close(around(lines), boxes, 0.2)
            blind = inside(boxes[box], lines[line], 0.2) >= 0.0
            costs += BLIND * np.bincount(led[line], blind, minlength=count)
            line, piece = close(around(lines), bounds, 0.0)
            costs += 5.0 * np.bincount(led[line], crossing(lines[line], leaders[piece]), minlength=count)
        return costs

    def _standing(self, *without: int) -> np.ndarray:
        """Indices of the letters that stand somewhere, but for some."""
        stands = ~np.isnan(self.boxes[:, 0])
        stands[list(without)] = False
        return np.flatnonzero(stands)

    def _stand(self, index: int, choice: _Choice, which: int) -> None:
        self.boxes[index], self.leaders[index] = choice.boxes[which], choice.leaders[which]
        self.paid[index] = choice.costs[which]

    def _best(self, index: int, choice: _Choice, others: np.ndarray) -> tuple[int, float]:
        """The cheapest candidate beside others, and its cost; the rest is not looked at once that is sure."""
        best, least, start, count = 0, np.inf, 0, 24
        while start < len(choice.costs) and choice.costs[start] < least:
            part = slice(start, start + count)
            costs = choice.costs[part] + self._beside(index, choice.chosen(part), others)
            if costs.min() < least:
                best, least = start + int(costs.argmin()), float(costs.min())
            start, count = start + count, 2 * count
        return best, least

    def _choose(self, index: int) -> float:
        """Put one letter where it costs least now, looking farther off while nothing good is found; that cost."""
        others = self._standing(index)
        best, least = self._best(index, self.choices[index], others)
        while least > GOOD and self.stages[index] < len(STAGES):
            both = zip(self.choices[index], self._candidates(index, STAGES[self.stages[index]]), strict=True)
            self.choices[index] = _Choice(*(np.concatenate(each) for each in both)).ordered()
            self.stages[index] += 1
            best, least = self._best(index, self.choices[index], others)
        self._stand(index, self.choices[index], best)
        return least

    def settle(self) -> None:
        """Let the letters choose, those with the least room first, until none moves; then part any that still meet."""
        freedom = [np.searchsorted(each.costs, each.costs[0] + 6.0) - each.costs[0] for each in self.choices]
        order = [int(each) for each in np.argsort(freedom, kind="stable")]
        for index in order:
            self._choose(index)
        tries = len(order)
        for _ in range(SWEEPS):
            before = self.boxes.copy()
            for index in order:
                if self._choose(index) > GOOD and tries > 0:
                    self._displace(index)
                    tries -= 1
            if np.array_equal(before, self.boxes):
                break
        self._part()

    def _displace(self, index: int) -> None:
        """Try good places that others hold: they choose anew, and all stays so if the whole then costs less."""
        choice = self.choices[index]
        others = self._standing(index)
        for which in range(min(6, len(choice.costs))):
            meets = others[meet(choice.boxes[which][None], self.boxes[others], GAP)[0] > 0.0]
            if choice.costs[which] > GOOD or not 0 < len(meets) <= 3:
                continue
            touched = [index, *map(int, meets)]
            kept = self.boxes.copy(), self.leaders.copy(), self.paid.copy()
            before = self._cost(touched)
            self._stand(index, choice, which)
            for each in touched[1:]:
                self._choose(each)
            if self._cost(touched) < before - 1e-6:
                return
            self.boxes, self.leaders, self.paid = kept

    def _cost(self, touched: list[int]) -> float:
        """What some letters cost together, each pair of them once."""
        total = 0.0
        for place, index in enumerate(touched):
            now = _Choice(self.boxes[index][None], self.leaders[index][None], self.paid[[index]])
            total += self.paid[index] + float(self._beside(index, now, self._standing(*touched[: place + 1]))[0])
        return total

    def _part(self) -> None:
        """Letters that still meet another go outwards, ring by ring, until they stand alone."""
        for index in range(len(self.letters)):
            others = self._standing(index)
            step = STAGES[-1][-1] / 4.0
            while meet(self.boxes[[index]], self.boxes[others], 0.0).max(initial=0.0) > 0.0:
                choice = self._candidates(index, (step, step * 1.15, step * 1.3))
                costs = choice.costs + self._beside(index, choice, others)
                costs[meet(choice.boxes, self.boxes[others], 0.0).max(axis=1) > 0.0] += 1e9
                self._stand(index, choice, int(costs.argmin()))
                step *= 1.5
