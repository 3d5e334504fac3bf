"""Where the links of many designs are at every step, out of places on them: frames, angles that count turns, pairs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from math import comb

import numpy as np

from planar.foundation.geometry import GROUND, Frame, frame_at
from planar.foundation.jets import Jet, Scalar
from planar.model.link_shapes import LinkShape
from planar.model.mechanism import Mechanism, links_counting_turns, relative_motions
from planar.model.pairs import MeasureKind
from planar.model.pairs.base import Pair

Array = np.ndarray

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
        directions = {link: (axis - origin) / arm for link, (origin, axis) in places.items()}
        angles = {link: np.arctan2(each[0, :, 1], each[0, :, 0]) for link, each in directions.items()}
        self.is_clear = np.ones(next(iter(angles.values())).shape[1], dtype=bool)
        "the designs of which it is clear how far their links have turned (designs,)"
        for link, angle in angles.items():
            turned = np.diff(angle, axis=0)
            turned -= FULL_TURN * np.round(turned / FULL_TURN)
            self.is_clear &= ~np.any(np.abs(turned) > LONGEST_CLEAR_TURN, axis=0)
            angles[link] = np.concatenate([angle[:1], angle[:1] + np.cumsum(turned, axis=0)])
        self.design_shape = next(iter(angles.values())).shape
        "(steps + 1, designs)"
        self.origins = {link: origin for link, (origin, _) in places.items()}
        self.directions = directions
        self._set_angles(self._with_counted_turns(angles))

    def _set_angles(self, angles: Mapping[str, Array]) -> None:
        self.angles = dict(angles)
        self._frames: dict[str, Frame] = {self.mechanism.frame: GROUND}
        self.own: dict[str, tuple[Jet | Array, ...]] = {}

    def angle(self, link: str) -> tuple[Array, ...]:
        """A link's angle with all its turns (steps + 1, designs), and rates where these are there."""
        cos, sin = (self.directions[link][0, :, axis] for axis in (0, 1))
        rates = (cos * each[:, 1] - sin * each[:, 0] for each in self.directions[link][1:])
        return (self.angles[link], *rates)

    def frame(self, link: str) -> Frame:
        """The frame of a link."""
        if link not in self._frames:
            x, y, cos, sin = (
                _jet(*each[link][:, :, axis]) for each in (self.origins, self.directions) for axis in (0, 1)
            )
            self._frames[link] = Frame(x, y, cos, sin, _jet(*self.angle(link)))
        return self._frames[link]

    @property
    def frames(self) -> dict[str, Frame]:
        """The frames of all links."""
        return {link: self.frame(link) for link in (self.mechanism.frame, *self.angles)}

    def replace_angles(self, designs: Array, angles: Mapping[str, Array]) -> None:
        """Take other angles (steps + 1, designs) of some designs, of which more is known."""
        whole = {link: angle.copy() for link, angle in self.angles.items()}
        for link, each in angles.items():
            whole[link][:, designs] = each
        self._set_angles(whole)
        self.is_clear[designs] = True

    def _with_counted_turns(self, angles: dict[str, Array]) -> dict[str, Array]:
        """Angles of links that wheels tie with the turns that they start with, as far as inputs and pairs tell them.

        The turns are the whole numbers that close all of them; where they do not tell, a design is none of the clear
        ones.
        """
        if self.counted_links.isdisjoint(angles):
            return angles
        ties: list[tuple[tuple[str, ...], Callable[[Mapping[str, Array]], Scalar]]] = []
        for name, position in self.inputs.items():
            pair = self.motions[name]
            if pair.input_kind is MeasureKind.ANGLE and not self.counted_links.isdisjoint(pair.bodies):
                ties.append((pair.bodies, partial(self._input_gap, pair, position[0])))
        ties += [(pair.bodies, partial(self._turn_gap, pair)) for pair in self.mechanism.pairs if pair.counts_turns]
        tied = [link for link in angles if any(link in bodies for bodies, _ in ties)]
        here = {link: angle[0] for link, angle in angles.items()}
        off = np.stack([np.broadcast_to(gap(here), self.design_shape[1:]) for _, gap in ties], axis=-1)
        further = [
            np.stack([gap(here | {link: here[link] + FULL_TURN}) + 0.0 * off[:, 0] for _, gap in ties], axis=-1)
            for link in tied
        ]
        change = np.nan_to_num(np.stack(further, axis=-1) - off[:, :, None])  # (designs, ties, links)
        s = np.linalg.svd(change, compute_uv=False)
        self.is_clear &= (change.shape[2] <= change.shape[1]) & (s[:, -1] > LEAST_TIE * s[:, 0])
        turns = np.round(-np.linalg.pinv(change) @ off[:, :, None])[..., 0]
        left = np.abs(off + np.einsum("dtl,dl->dt", change, turns)).max(axis=1)
        self.is_clear &= left <= LEAST_TIE * s[:, 0]
        for link, own in zip(tied, turns.T, strict=True):
            angles[link] = angles[link] + FULL_TURN * own
        return angles

    def _input_gap(self, pair: Pair, position: Array, angles: Mapping[str, Array]) -> Scalar:
        """By how much an input's angle at the start is off its position, where links have these angles (designs,)."""
        numbers = pair.measure([self.shapes[link] for link in pair.bodies])
        return pair.input_position([self._start_frame(link, angles) for link in pair.bodies], numbers, ()) - position

    def _turn_gap(self, pair: Pair, angles: Mapping[str, Array]) -> Scalar:
        """What a pair that counts turns leaves open at the start, where links have these angles (designs,)."""
        frames = [self._start_frame(link, angles) for link in pair.bodies]
        numbers = pair.measure([self.shapes[link] for link in pair.bodies])
        left = pair.residual(frames, numbers, solve_own_coordinates(pair, frames, numbers))
        (row,) = set(range(len(left))).difference(_rows_without_turns(pair))
        return left[row]

    def _start_frame(self, link: str, angles: Mapping[str, Array]) -> Frame:
        if link == self.mechanism.frame:
            return GROUND
        origin = self.origins[link][0, 0]
        return frame_at(origin[0], origin[1], angles[link])

    def own_coordinates(self, pair: Pair) -> tuple[Jet | Array, ...]:
        """The own coordinates of a pair."""
        if pair.coordinate_kinds and pair.name not in self.own:
            frames = [self.frame(link) for link in pair.bodies]
            numbers = pair.measure([self.shapes[link] for link in pair.bodies])
            self.own[pair.name] = tuple(solve_own_coordinates(pair, frames, numbers))
        return self.own.get(pair.name, ())

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
        own = {name: self.own_coordinates(pair)}
        value, *rates = _parts(
            pair.input_position_at(self.shapes, {link: self.frame(link) for link in pair.bodies}, own)
        )
        if pair.input_kind is MeasureKind.ANGLE and not self.counted_links.issuperset(pair.links):
            meant = self.inputs[name][0] if name in self.inputs else np.zeros(value.shape[1:])
            # an angle of none of the inputs starts between -pi and pi, and one that does is left there
            turns = np.round((meant - value[0]) / FULL_TURN)
            if name not in self.inputs:
                turns = np.where(np.abs(value[0]) <= np.pi, 0.0, turns)
            value = value + FULL_TURN * turns
        return (value, *rates)


def _jet(*parts: Array) -> Jet | Array:
    """A jet of value and rates; a value that has none by itself."""
    return Jet(*parts) if len(parts) > 1 else parts[0]


def solve_own_coordinates(pair: Pair, frames: Sequence[Frame], numbers: Sequence[Scalar]) -> list[Scalar]:
    """A pair's own coordinates where its links have these frames, of arrays or of jets of them.

    They enter what it leaves open linearly, r + A x; of the rows that know no turns x is what leaves the least open.
    """
    count = len(pair.coordinate_kinds)
    if not count:
        return []
    rows = _rows_without_turns(pair)
    none = pair.residual(frames, numbers, (0.0,) * count)
    units = [tuple(float(k == j) for j in range(count)) for k in range(count)]
    columns = [[each - none[k] for k, each in enumerate(pair.residual(frames, numbers, unit))] for unit in units]
    r = [_parts(none[k]) for k in rows]
    a = [[_parts(column[k]) for column in columns] for k in rows]
    orders = max(len(each) for each in r)
    shape = np.broadcast_shapes(*(np.shape(each[0]) for each in r))

    def order(parts: tuple[Scalar, ...], k: int) -> Array:
        return np.broadcast_to(np.asarray(parts[k] if k < len(parts) else 0.0, dtype=float), shape)

    a_ = [np.stack([np.stack([order(e, k) for e in row], -1) for row in a], -2) for k in range(orders)]
    r_ = [np.stack([order(e, k) for e in r], -1)[..., None] for k in range(orders)]
    turned = np.swapaxes(a_[0], -1, -2)
    inverse = _inverse(turned @ a_[0])
    x: list[Array] = []
    for k in range(orders):
        left = r_[k] + sum(comb(k, j) * (a_[k - j] @ x[j]) for j in range(k))
        x.append(-inverse @ (turned @ left))
    return [_jet(*(each[..., j, 0] for each in x)) for j in range(count)]


def _parts(value: Scalar) -> tuple[Scalar, ...]:
    return value.parts if isinstance(value, Jet) else (value,)


def _inverse(square: Array) -> Array:
    """The inverses of matrices (..., 1, 1) or (..., 2, 2) that are near the unit's."""
    if square.shape[-1] == 1:
        return 1.0 / square
    return np.linalg.inv(square)


def _rows_without_turns(pair: Pair) -> list[int]:
    """The rows of what a pair leaves open that are the same where a link has turned right round."""
    numbers = [0.3 + 0.1 * k for k in range(len(pair.number_kinds))]
    own = [0.7 + 0.2 * k for k in range(len(pair.coordinate_kinds))]
    frames = [frame_at(0.1 * k, 0.2 + 0.3 * k, 0.4 + 0.5 * k) for k in range(len(pair.bodies))]
    before = pair.residual(frames, numbers, own)
    same = np.ones(len(before), dtype=bool)
    for k, frame in enumerate(frames):
        turned = [*frames[:k], frame_at(frame.x, frame.y, frame.angle + FULL_TURN), *frames[k + 1 :]]
        same &= np.abs(np.subtract(pair.residual(turned, numbers, own), before)) < 1e-9
    return [int(k) for k in np.flatnonzero(same)]
