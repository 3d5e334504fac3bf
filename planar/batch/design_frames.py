"""Where the links of many designs are at every step, out of places on them: frames, angles that count turns, pairs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from planar.foundation.arrays import Array, IntArray
from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, links_counting_turns, relative_motions
from planar.model.pairs import MeasureKind
from planar.model.pairs.base import Pair

LONGEST_CLEAR_TURN = 2.0
"""rad by which a link may have turned from a step to the next: of more it is not clear in which sense it turned."""
LEAST_TIE = 1e-6
"""Beside the strongest: wheels whose turns change what pairs leave open by less are not tied by them."""
FULL_TURN = 2.0 * np.pi


class DesignFrames:
    """Frames of links, and own coordinates of pairs, as jets of arrays (steps + 1, designs), in SI.

    `shapes` have numbers, or an array (designs,) where designs differ; `inputs` are the positions of inputs, each an
    array that spreads over (steps + 1, designs). `places` are, of every link but the frame, the origin of its axes and
    the place at `arm` (m) on its x-axis, each (orders, steps + 1, 2, designs): positions, then first and second rates;
    `time` (steps + 1,) that of a run in time (s).
    """

    def __init__(
        self,
        mechanism: Mechanism,
        shapes: Mapping[str, LinkShape],
        inputs: Mapping[str, Array],
        places: Mapping[str, tuple[Array, Array]],
        arm: float,
        time: Array | None = None,
    ):
        self.mechanism, self.shapes, self.inputs, self.time = mechanism, shapes, inputs, time
        self.motions = relative_motions(mechanism)
        self.counted_links = links_counting_turns(mechanism)
        self.origins = {link: origin for link, (origin, _) in places.items()}
        self.directions = {link: (axis - origin) / arm for link, (origin, axis) in places.items()}
        angles = {link: np.arctan2(axis[0, :, 1], axis[0, :, 0]) for link, axis in self.directions.items()}
        self.is_clear = np.ones(next(iter(angles.values())).shape[1], dtype=bool)
        "the designs of which it is clear how far their links have turned (designs,)"
        for link, angle in angles.items():
            turned = np.diff(angle, axis=0)
            turned -= FULL_TURN * np.round(turned / FULL_TURN)
            self.is_clear &= ~np.any(np.abs(turned) > LONGEST_CLEAR_TURN, axis=0)
            angles[link] = np.concatenate([angle[:1], angle[:1] + np.cumsum(turned, axis=0)])
        self.design_shape = next(iter(angles.values())).shape
        "(steps + 1, designs)"
        self.angles = self._with_counted_turns(angles)
        self._frames: dict[str, Frame] = {self.mechanism.frame: GROUND}

    def angle(self, link: str) -> tuple[Array, ...]:
        """A link's angle with all its turns (steps + 1, designs), and rates where these are there."""
        cos, sin = (self.directions[link][0, :, axis] for axis in (0, 1))
        rates = (cos * rate[:, 1] - sin * rate[:, 0] for rate in self.directions[link][1:])
        return (self.angles[link], *rates)

    def frame(self, link: str) -> Frame:
        """The frame of a link."""
        if link not in self._frames:
            vectors = self.origins[link], self.directions[link]
            x, y, cos, sin = (_jet(*vector[:, :, axis]) for vector in vectors for axis in (0, 1))
            self._frames[link] = Frame(x, y, cos, sin, _jet(*self.angle(link)))
        return self._frames[link]

    @property
    def frames(self) -> dict[str, Frame]:
        """The frames of all links."""
        return {link: self.frame(link) for link in (self.mechanism.frame, *self.angles)}

    def replace_angles(self, designs: IntArray, angles: Mapping[str, Array]) -> None:
        """Take other angles (steps + 1, designs) of some designs, of which more is known."""
        for link, angle in angles.items():
            self.angles[link][:, designs] = angle
        self._frames = {self.mechanism.frame: GROUND}
        self.is_clear[designs] = True

    def _with_counted_turns(self, angles: dict[str, Array]) -> dict[str, Array]:
        """Angles of links that wheels tie with the turns that they start with, as far as inputs and pairs tell them.

        The turns are the whole numbers that close all of them; where they do not tell, a design is none of the clear
        ones.
        """
        if self.counted_links.isdisjoint(angles):
            return angles
        bodies = {body for pairs in self._turn_ties() for pair in pairs for body in pair.bodies}
        tied = [link for link in angles if link in bodies]
        start = {link: angle[0] for link, angle in angles.items()}
        gaps = self._start_gaps(start)
        changed = [self._start_gaps(start | {link: start[link] + FULL_TURN}) for link in tied]
        change = np.nan_to_num(np.stack(changed, axis=-1) - gaps[:, :, None])  # (designs, ties, links)
        s = np.linalg.svd(change, compute_uv=False)
        self.is_clear &= (change.shape[2] <= change.shape[1]) & (s[:, -1] > LEAST_TIE * s[:, 0])
        turns = np.round(-np.linalg.pinv(change) @ gaps[:, :, None])[..., 0]
        residual = np.abs(gaps + np.einsum("dtl,dl->dt", change, turns)).max(axis=1)
        self.is_clear &= residual <= LEAST_TIE * s[:, 0]
        for link, link_turns in zip(tied, turns.T, strict=True):
            angles[link] = angles[link] + FULL_TURN * link_turns
        return angles

    def _turn_ties(self) -> tuple[list[Pair], list[Pair]]:
        """The relative motions of inputs, and the pairs, that tell how many turns links have made."""
        inputs = [
            pair
            for pair in map(self.motions.__getitem__, self.inputs)
            if pair.input_kind is MeasureKind.ANGLE and not self.counted_links.isdisjoint(pair.bodies)
        ]
        return inputs, [pair for pair in self.mechanism.pairs if pair.counts_turns]

    def _start_gaps(self, angles: Mapping[str, Array]) -> Array:
        """By how much the ties are open at the start (designs, ties), where links have these angles (designs,)."""
        frames = {self.mechanism.frame: GROUND}
        for link, angle in angles.items():
            origin = self.origins[link][0, 0]
            frames[link] = frame_at(origin[0], origin[1], angle)
        inputs, pairs = self._turn_ties()
        gaps = [pair.input_position_at(self.shapes, frames, {}) - self.inputs[pair.name][0] for pair in inputs]
        for pair in pairs:
            arguments = pair_arguments(pair, frames, self.shapes)
            residual = pair.residual(*arguments, solve_own_coordinates(pair, *arguments))
            (row,) = set(range(len(residual))).difference(_rows_without_turns(pair))
            gaps.append(residual[row])
        return np.stack([np.broadcast_to(gap, self.design_shape[1:]) for gap in gaps], axis=-1)

    def link_angle(self, name: str) -> tuple[Array, ...]:
        """A link's angle (steps + 1, designs), with its rates where these are there, as `Motion.link` tells it."""
        angle, *rates = self.angle(name)
        if name not in self.counted_links:
            angle = angle - np.where(np.abs(angle[0]) <= np.pi, 0.0, FULL_TURN * np.round(angle[0] / FULL_TURN))
        return (angle, *rates)

    def pair_value(self, name: str) -> tuple[Array, ...]:
        """The relative motion at a pair (steps + 1, designs), with its rates where these are there; an angle with the
        turns that `Motion.pair` tells it with."""
        pair = self.motions[name]
        frames = {link: self.frame(link) for link in pair.bodies}
        own = solve_own_coordinates(pair, *pair_arguments(pair, frames, self.shapes))
        position = pair.input_position_at(self.shapes, frames, {name: own})
        value, *rates = position.parts if isinstance(position, Jet) else (position,)
        if pair.input_kind is MeasureKind.ANGLE and not self.counted_links.issuperset(pair.links):
            start = self.inputs[name][0] if name in self.inputs else np.zeros(value.shape[1:])
            # an angle of none of the inputs starts between -pi and pi, and one that does is left there
            turns = np.round((start - value[0]) / FULL_TURN)
            if name not in self.inputs:
                turns = np.where(np.abs(value[0]) <= np.pi, 0.0, turns)
            value = value + FULL_TURN * turns
        return (value, *rates)


def _jet(*parts: Array) -> Jet | Array:
    """A jet of value and rates; a value that has none by itself."""
    return Jet(*parts) if len(parts) > 1 else parts[0]


def pair_arguments(
    pair: Pair, frames: Mapping[str, Frame], shapes: Mapping[str, LinkShape]
) -> tuple[list[Frame], list[Scalar]]:
    """The frames and the numbers that the formulas of a pair take."""
    return [frames[link] for link in pair.bodies], [*pair.measure([shapes[link] for link in pair.bodies])]


def solve_own_coordinates(pair: Pair, frames: Sequence[Frame], numbers: Sequence[Scalar]) -> list[Scalar]:
    """A pair's own coordinates, two at most, where its links have these frames, of arrays or of jets of them.

    They enter what it leaves open linearly, r + A x; of the rows that know no turns x is what leaves the least open.
    """
    count = len(pair.coordinate_kinds)
    if not count:
        return []
    rows = _rows_without_turns(pair)

    def residual(*own: float) -> list[Scalar]:
        every = pair.residual(frames, numbers, own)
        return [every[row] for row in rows]

    r = residual(*[0.0] * count)
    units = [[float(k == j) for j in range(count)] for k in range(count)]
    columns = [[shifted - base for shifted, base in zip(residual(*unit), r, strict=True)] for unit in units]
    sides = [-_dot(column, r) for column in columns]
    normal = [[_dot(first, second) for second in columns] for first in columns]
    if count == 1:
        return [sides[0] / normal[0][0]]
    (a, b), (_, d) = normal
    determinant = a * d - b * b
    return [(d * sides[0] - b * sides[1]) / determinant, (a * sides[1] - b * sides[0]) / determinant]


def _dot(first: Sequence[Scalar], second: Sequence[Scalar]) -> Scalar:
    return sum((a * b for a, b in zip(first, second, strict=True)), 0.0)


def _rows_without_turns(pair: Pair) -> list[int]:
    """The rows of what a pair leaves open that are the same where a link has turned right round."""
    numbers = [0.3 + 0.1 * k for k in range(len(pair.number_kinds))]
    own = [0.7 + 0.2 * k for k in range(len(pair.coordinate_kinds))]
    frames = [frame_at(0.1 * k, 0.2 + 0.3 * k, 0.4 + 0.5 * k) for k in range(len(pair.bodies))]
    residual = pair.residual(frames, numbers, own)
    same = np.ones(len(residual), dtype=bool)
    for k, frame in enumerate(frames):
        turned = [*frames[:k], frame_at(frame.x, frame.y, frame.angle + FULL_TURN), *frames[k + 1 :]]
        same &= np.abs(np.subtract(pair.residual(turned, numbers, own), residual)) < 1e-9
    return np.flatnonzero(same).tolist()
