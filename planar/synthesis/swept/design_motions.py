"""The motions of many designs as frames of their links: as far as each goes from where it is put together."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from math import pi
from typing import NamedTuple

import numpy as np

from planar.batch.results import Sweep
from planar.batch.sweep import sweep
from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.foundation.errors import BadInput
from planar.model.link_shapes import Along, At, Link, Point, PointDefinition
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.swept.bare_mechanism import length_scale

CLOSING_TOLERANCE = 1e-4
"""Of the scale, and rad: so near to where it began a motion is closed, in single precision."""
PROBES = ("its origin", "its axis")
"""Points that are put on every link to see its axes: no file will have such names."""


class DesignMotions(NamedTuple):
    """Designs (designs,) with `sample_count` positions each, the input going on by `input_step` (rad or m) from
    `first_input`; those of which the motion `is_closed` come back to the first after the last.

    `origins` (links, designs, samples) are x + iy (m) of the origins of the links' axes, `angles` their directions
    (rad), `values` by pair (designs, samples) relative motions; not numbers behind the last position.
    """

    first_input: Array
    input_step: Array
    sample_count: IntArray
    is_closed: BoolArray
    origins: ComplexArray
    angles: Array
    values: Mapping[str, Array]

    def select(self, kept: IntArray | BoolArray) -> DesignMotions:
        """Some of the designs."""
        return DesignMotions(
            self.first_input[kept],
            self.input_step[kept],
            self.sample_count[kept],
            self.is_closed[kept],
            self.origins[:, kept],
            self.angles[:, kept],
            {pair: each[kept] for pair, each in self.values.items()},
        )


def join_motions(parts: Sequence[DesignMotions]) -> DesignMotions:
    """Designs one after the other."""
    return DesignMotions(
        np.concatenate([each.first_input for each in parts]),
        np.concatenate([each.input_step for each in parts]),
        np.concatenate([each.sample_count for each in parts]),
        np.concatenate([each.is_closed for each in parts]),
        np.concatenate([each.origins for each in parts], axis=1),
        np.concatenate([each.angles for each in parts], axis=1),
        {pair: np.concatenate([each.values[pair] for each in parts]) for pair in parts[0].values},
    )


class MotionSweeps:
    """Sweeps of one mechanism: `samples` positions to `turns` turns of the input, or to the range of a slide."""

    def __init__(self, mechanism: Mechanism, samples: int, pairs: Sequence[str] = (), turns: int = 1):
        if not mechanism.inputs:
            raise BadInput("inputs", f"{mechanism.name!r} has no input that could run")
        self.scale, self.samples, self.pairs, self.turns = length_scale(mechanism), samples, tuple(pairs), turns
        self.links = tuple(link.name for link in mechanism.links if link.name != mechanism.frame)
        self.mechanism = _with_probes(mechanism, self.scale)
        self.input = mechanism.inputs[0].pair
        kind = relative_motions(mechanism)[self.input].input_kind
        self.is_sliding = kind is MeasureKind.LENGTH

    def run(
        self, names: Sequence[str], numbers: Array, start: float, sketch: Mapping[str, complex] | None = None
    ) -> DesignMotions:
        """The motions of designs with these numbers (designs, names), put together with the input at `start`.

        Of their assemblies that nearest to `sketch` is taken, places by point, or to that of the file.

        An angle runs both ways until it has turned, or as far as it goes; a slide from limit to limit.
        """
        mechanism = self.mechanism
        if sketch is not None:
            mechanism = replace(mechanism, sketch=tuple((name, at.real, at.imag) for name, at in sketch.items()))
        designs = {**dict(zip(names, numbers.T, strict=True)), f"{self.input}.position": np.full(len(numbers), start)}
        if self.is_sliding:
            found = self._sweep(mechanism, designs, None, None)
            steps = (found.input[:, -1] - found.input[:, 0]) / (self.samples - 1)
            count = np.where(np.asarray(found.status)[:, -1] == 0, self._solved(found), 0)
            return self._motions(found, None, count, found.input[:, 0], steps)
        span = 2.0 * pi * self.turns
        ahead = self._sweep(mechanism, designs, start, start + span)
        count = self._solved(ahead)
        step, first = np.full(len(numbers), span / self.samples), np.full(len(numbers), start)
        part = np.flatnonzero((count > 0) & (count <= self.samples))
        if not len(part):
            return self._motions(ahead, None, count, first, step)
        back = self._sweep(mechanism, {name: each[part] for name, each in designs.items()}, start, start - span)
        before = np.zeros(len(numbers), dtype=int)
        before[part] = np.minimum(self._solved(back) - 1, self.samples - count[part])
        before = np.maximum(before, 0)
        return self._motions(ahead, (back, part, before), count, first - before * step, step)

    def closing_turns(self, most: int) -> int:
        """After how many turns of the input the mechanism itself comes back, 1 where it does not in so many."""
        if self.is_sliding:
            return 1
        given, own = self.mechanism.inputs[0], self.turns
        for turns in range(1, most + 1):
            self.turns = turns
            found = self.run((), np.zeros((1, 0)), given.position)
            if found.is_closed[0]:
                break
        self.turns, found_turns = own, turns if found.is_closed[0] else 1
        return found_turns

    def _sweep(
        self, mechanism: Mechanism, designs: Mapping[str, Array], start: float | None, stop: float | None
    ) -> Sweep:
        points = [f"{link}.{probe}" for link in self.links for probe in PROBES]
        steps = self.samples - 1 if start is None else self.samples
        return sweep(
            mechanism,
            designs,
            steps,
            points,
            pairs=self.pairs,
            rates=False,
            start=start,
            stop=stop,
            pair=self.input,
            backend="auto",
            dtype="float32",
        )

    @staticmethod
    def _solved(swept: Sweep) -> IntArray:
        """How many positions from the first are solved (designs,)."""
        failed = np.asarray(swept.status) != 0
        found: IntArray = np.where(failed.any(axis=1), np.argmax(failed, axis=1), failed.shape[1])
        return found

    def _motions(
        self,
        ahead: Sweep,
        behind: tuple[Sweep, IntArray, IntArray] | None,
        solved: IntArray,
        first: Array,
        step: Array,
    ) -> DesignMotions:
        """What was swept ahead, with what was swept back of some designs before it."""

        def joined(pick: str, name: str) -> Array:
            own = np.asarray(getattr(ahead, pick)[name])
            if behind is None:
                return own[:, : self.samples]
            back, part, before = behind
            found = own[:, : self.samples].copy()
            other = np.asarray(getattr(back, pick)[name])
            some = np.flatnonzero(before[part] > 0)
            rows, k = part[some], np.arange(self.samples)[None] - before[part[some], None]
            both = np.concatenate([other[some, ::-1], own[rows, 1:]], axis=1)
            index = np.clip(k + other.shape[1] - 1, 0, both.shape[1] - 1)
            found[rows] = np.take_along_axis(both, index.reshape(*index.shape, *(1,) * (both.ndim - 2)), axis=1)
            return found

        before = behind[2] if behind is not None else 0
        count = np.minimum(solved + before, self.samples)
        beyond = np.arange(self.samples) >= count[:, None]
        shape = (len(self.links), len(count), self.samples)
        origins, angles = np.empty(shape, dtype=np.complex64), np.empty(shape, dtype=np.float32)
        closed = solved > self.samples
        for k, link in enumerate(self.links):
            at, axis = (_as_complex(joined("position", f"{link}.{probe}")) for probe in PROBES)
            origins[k], angles[k] = np.where(beyond, np.nan, at), np.where(beyond, np.nan, np.angle(axis - at))
            if closed.any():
                last = [_as_complex(np.asarray(ahead.position[f"{link}.{probe}"])[:, [0, -1]]) for probe in PROBES]
                off = np.max([np.abs(each[:, 1] - each[:, 0]) for each in last], axis=0)
                closed &= ~(off > CLOSING_TOLERANCE * self.scale)
        values = {pair: np.where(beyond, np.nan, joined("value", pair)).astype(np.float32) for pair in self.pairs}
        return DesignMotions(first, step, count, closed, origins, angles, values)


def _as_complex(places: Array) -> ComplexArray:
    found: ComplexArray = np.ascontiguousarray(places).view(np.complex64)[..., 0]
    return found


def _with_probes(mechanism: Mechanism, scale: float) -> Mechanism:
    """The mechanism with two points on every moving link: the origin of its axes, and one on its x-axis."""

    def probed(link: Link) -> Link:
        if link.name == mechanism.frame:
            return link
        places: tuple[PointDefinition, PointDefinition] = (At(0.0, 0.0), At(scale, 0.0))
        if link.axis is not None:
            places = (Along(*link.axis, 0.0), Along(*link.axis, scale))
        return replace(link, points=(*link.points, *map(Point, PROBES, places)))

    return replace(mechanism, links=tuple(map(probed, mechanism.links)))
