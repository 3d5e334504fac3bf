"""Designs of a catalogue beside what is wanted: where their links are, how each is moved, when it comes where."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from math import pi
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, BoolArray, ComplexArray, IntArray
from planar.model.mechanism import relative_motions
from planar.model.pairs import MeasureKind
from planar.synthesis.matching.carried_points import CarriedPoint
from planar.synthesis.matching.curve_index import CurveIndex
from planar.synthesis.matching.wanted_entries import Entries, PathEntries, PoseEntries, entries_size
from planar.synthesis.swept.bare_mechanism import length_scale
from planar.synthesis.swept.swept_catalogue import SweptCatalogue

OUTSIDE = 1e-6
"""Of a step: so little beyond the ends of a motion is none."""


def unit_numbers(factors: ComplexArray) -> ComplexArray:
    """The directions of complex numbers, 1 where they are nothing."""
    size = np.abs(factors)
    return np.asarray(np.where(size > 0.0, factors, 1.0) / np.where(size > 0.0, size, 1.0), dtype=complex)


class MatchState(NamedTuple):
    """Candidates (n,): of which `design`; `samples` (n, entries) at which each wanted item is met; the move place ->
    factor * place + offset; free points by name, in their links' axes; the distance, in sizes of what is wanted."""

    design: IntArray
    samples: tuple[Array, ...]
    factor: ComplexArray
    offset: ComplexArray
    places: Mapping[str, ComplexArray]
    distance: Array

    def select(self, kept: IntArray | BoolArray) -> MatchState:
        """Some of the candidates."""
        return MatchState(
            self.design[kept],
            tuple(each[kept] for each in self.samples),
            self.factor[kept],
            self.offset[kept],
            {name: each[kept] for name, each in self.places.items()},
            self.distance[kept],
        )

    def with_better(self, other: MatchState) -> MatchState:
        """The candidates, each as it is in the other state where it has less distance there."""
        better = other.distance < self.distance

        def choose(own: Any, others: Any) -> Any:
            return np.where(better.reshape(-1, *(1,) * (own.ndim - 1)), others, own)

        return MatchState(
            self.design,
            tuple(choose(*each) for each in zip(self.samples, other.samples, strict=True)),
            choose(self.factor, other.factor),
            choose(self.offset, other.offset),
            {name: choose(each, other.places[name]) for name, each in self.places.items()},
            choose(self.distance, other.distance),
        )

    def nearest(self, many: int) -> MatchState:
        """So many of the least distance, the least first."""
        return self.select(np.argsort(self.distance, kind="stable")[:many])


@dataclass(frozen=True, eq=False)
class MatchProblem:
    """What is `wanted` of the designs of a catalogue.

    `points` by name are those of paths, `curves` their curves; `can_move` says whether a mechanism may be moved, turned
    and made larger as a whole.
    """

    catalogue: SweptCatalogue
    wanted: tuple[Entries, ...]
    points: Mapping[str, CarriedPoint]
    curves: Mapping[str, CurveIndex]
    can_move: bool
    _directions: dict[int, ComplexArray] = field(default_factory=dict, repr=False)

    @cached_property
    def catalogue_scale(self) -> float:
        """How large links of designs are (m)."""
        return length_scale(self.catalogue.mechanism)

    @cached_property
    def size(self) -> float:
        """How large what is wanted is (m): see `entries_size`."""
        return entries_size(self.wanted, self.catalogue_scale)

    @property
    def input_pair(self) -> str:
        """Where the running input is."""
        return self.catalogue.mechanism.inputs[0].pair

    @cached_property
    def is_sliding(self) -> bool:
        """Whether the running input is a slide."""
        return not self.is_angle(self.input_pair)

    @cached_property
    def turns_with_frame(self) -> bool:
        """Whether the running input is an angle against the frame, which changes as all is turned."""
        mechanism = self.catalogue.mechanism
        return not self.is_sliding and mechanism.frame in relative_motions(mechanism)[self.input_pair].links

    def is_angle(self, pair: str) -> bool:
        """Whether the relative motion at a pair is an angle."""
        return relative_motions(self.catalogue.mechanism)[pair].input_kind is not MeasureKind.LENGTH

    def value_scale(self, pair: str) -> float:
        """What of a relative motion counts as the size of what is wanted does: 1 rad, or the size of links."""
        return 1.0 if self.is_angle(pair) else self.catalogue_scale

    def link(self, entries: PathEntries | PoseEntries) -> int:
        """The number of the link that is to come somewhere."""
        if isinstance(entries, PathEntries):
            return self.points[entries.point].link
        return self.catalogue.links.index(entries.link)

    def directions(self, link: int) -> ComplexArray:
        """exp(i angle) of a link (designs, samples)."""
        if link not in self._directions:
            angles = self.catalogue.motions.angles[link]
            found = np.empty(angles.shape, dtype=np.complex64)
            found.real, found.imag = np.cos(angles), np.sin(angles)
            self._directions[link] = found
        return self._directions[link]

    def frames(self, link: int, design: IntArray, samples: Array) -> tuple[ComplexArray, ComplexArray]:
        """Origins and directions (n, entries) of a link of designs (n,) at samples (n, entries), as on straight lines
        between whole samples; not numbers beyond the ends of a motion."""
        (one, other), part = self._between(design, samples)
        rows, origins, turns = design[:, None], self.catalogue.motions.origins[link], self.directions(link)
        origin = (1.0 - part) * origins[rows, one] + part * origins[rows, other]
        turn = (1.0 - part) * turns[rows, one] + part * turns[rows, other]
        return origin, turn / np.maximum(np.abs(turn), 1e-12)

    def frame_steps(self, link: int, design: IntArray, samples: Array) -> tuple[ComplexArray, ComplexArray]:
        """How origins and directions go on over the step in which samples are, nothing behind the last of an open
        motion."""
        (one, other), _ = self._between(design, samples)
        rows, origins, turns = design[:, None], self.catalogue.motions.origins[link], self.directions(link)
        return origins[rows, other] - origins[rows, one], turns[rows, other] - turns[rows, one]

    def values(self, pair: str, design: IntArray, samples: Array) -> Array:
        """Relative motions (n, entries) of a pair, as `frames` has places; angles count the turns of closed motions."""
        if pair == self.input_pair:
            return self.inputs(design, samples)
        (one, other), part = self._between(design, samples)
        rows, own, count = design[:, None], self.catalogue.motions.values[pair], self.catalogue.sample_count
        gain = _gain(own[design], self.catalogue.motions.is_closed[design])[:, None]
        whole = np.floor(samples / count)
        ahead = own[rows, other] + gain * (other < one)
        found: Array = (1.0 - part) * own[rows, one] + part * ahead + gain * whole
        return found

    def inputs(self, design: IntArray, samples: Array) -> Array:
        """Positions (n, entries) of the running input (rad or m) at samples."""
        motions = self.catalogue.motions
        found: Array = motions.first_input[design][:, None] + samples * motions.input_step[design][:, None]
        return found

    def _between(self, design: IntArray, samples: Array) -> tuple[tuple[IntArray, IntArray], Array]:
        """The whole samples before and behind, and the part of the step from one to the other."""
        motions, count = self.catalogue.motions, self.catalogue.sample_count
        closed, last = motions.is_closed[design][:, None], motions.sample_count[design][:, None] - 1
        outside = ~closed & ((samples < -OUTSIDE) | (samples > last + OUTSIDE))
        before = np.floor(np.where(np.isfinite(samples), samples, 0.0))
        one = np.where(closed, before % count, np.clip(before, 0, last)).astype(int)
        other = np.where(closed, (one + 1) % count, np.minimum(one + 1, last)).astype(int)
        return (one, other), np.where(outside, np.nan, samples - before)


def _gain(values: Array, closed: BoolArray) -> Array:
    """By how many whole turns (rad) an angle (n, samples) is greater when a closed motion begins again."""
    after = 2.0 * values[:, -1] - values[:, -2]
    turns = np.round((after - values[:, 0]) / (2.0 * pi))
    return np.where(closed & np.isfinite(turns), 2.0 * pi * turns, 0.0)
