"""Where a cognate is driven: so that it keeps the timing of the path where some joint of it does, else elsewhere."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from typing import NamedTuple

import numpy as np

from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.errors import NoAnswer, Outcome
from planar.model.mechanism import Input, Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair
from planar.results.motion import State
from planar.synthesis.cognates.posed_linkage import PosedLinkage
from planar.synthesis.cognates.written_cognate import WrittenCognate

ROUNDING = 1e-13
"""rad: angles that are nearer are one."""
STANDING = 1e-6
"""Of the fastest relative motion of pins: one that is slower stands still."""


class CognateInput(NamedTuple):
    """How an input of a cognate belongs to that of the mechanism whose cognate it is.

    `pair` is the mechanism's, `driven` the cognate's. `is_timed`: a steady speed there traces the path with the same
    velocities as a steady speed here, `scale` times that here. `turns_back`: over the mechanism's motion it turns back
    somewhere, so that it comes through the whole path only through its dead points.
    """

    pair: str
    driven: str
    is_timed: bool
    scale: float
    turns_back: bool


class PathMotion(NamedTuple):
    """What the mechanism does over its motion: by input the angles of all links (n,), and the state that it is in."""

    angles: dict[str, dict[str, Array]]
    state: State
    rates: dict[str, float]
    "of the links' angles (rad/s), where the inputs move"


class _Joint(NamedTuple):
    """A relative motion of a cognate, with the two links as the file of the mechanism calls them."""

    name: str
    pair: Pair
    links: tuple[str, str]


def keeps_timing(posed: PosedLinkage, mechanism: Mechanism) -> bool:
    """Whether for every input some joint of a cognate moves as it does."""
    together = [{posed.turns[link] for link in links} for pin in posed.pins for links in combinations(pin.links, 2)]
    motions = relative_motions(mechanism)
    pins = [{*motions[given.pair].links} for given in mechanism.inputs if motions[given.pair].coincident_points()]
    return all(links in together for links in pins)


class CognateInputs:
    """Finds the inputs of one cognate."""

    def __init__(self, written: WrittenCognate, bare: Mechanism, motion: PathMotion):
        self.written, self.posed, self.motion, self.bare = written, written.posed, motion, bare
        self.source = motion.state.mechanism

    def find(self) -> tuple[tuple[Input, ...], tuple[CognateInput, ...]]:
        """The inputs, and how they belong to those of the mechanism. Raises NoAnswer."""
        told: list[CognateInput | None] = [self._timed(given) for given in self.source.inputs]
        taken = {each.driven for each in told if each is not None}
        for k, given in enumerate(self.source.inputs):
            if told[k] is None:
                told[k] = self._untimed(given, taken)
                taken.add(told[k].driven)  # type: ignore[union-attr]
        inputs = [each for each in told if each is not None]
        return tuple(self._input(each, given) for each, given in zip(inputs, self.source.inputs, strict=True)), tuple(
            inputs
        )

    def _timed(self, given: Input) -> CognateInput | None:
        """The joint that moves as the input of the mechanism does, if there is one."""
        pair = relative_motions(self.source)[given.pair]
        if pair.input_kind is MeasureKind.LENGTH:
            scale = next((guide.scale for guide in self.posed.guides if guide.pair == pair.name), 1.0)
            return CognateInput(given.pair, given.pair, True, scale, False)
        if not pair.coincident_points():
            return CognateInput(given.pair, given.pair, True, 1.0, False)
        alike = [each for each in self._joints() if self._turns(each) == {*pair.links}]
        alike.sort(key=lambda each: each.name != given.pair)
        if not alike:
            return None
        sense = 1.0 if self._rate(alike[0], self.motion.rates) * self._source_rate(pair) >= 0.0 else -1.0
        return CognateInput(given.pair, alike[0].name, True, sense, False)

    def _untimed(self, given: Input, taken: set[str]) -> CognateInput:
        """A joint on the frame that does not turn back over the motion, or as near to that as there is."""
        rates = {each.name: abs(self._rate(each, self.motion.rates)) for each in self._joints()}
        fastest = max(rates.values(), default=0.0)
        able = [each for each in self._joints() if each.name not in taken and rates[each.name] > STANDING * fastest]
        if not able:
            raise NoAnswer(
                Outcome.DEAD_POINT,
                f"where {self.source.name!r} stands no other joint of its cognates moves; move its input somewhat",
            )
        remade = [each for each in able if self.posed.remade & {*each.links}]
        best = min(
            remade or able,
            key=lambda each: (
                self.source.frame not in each.links,
                self._turns_back(each, given.pair),
                each.name != given.pair,
            ),
        )
        return CognateInput(given.pair, best.name, False, 1.0, self._turns_back(best, given.pair))

    def _joints(self) -> Iterator[_Joint]:
        """The relative motions at the pins of the cognate."""
        motions = relative_motions(self.bare)
        for pin in self.posed.pins:
            own = self.written.pin_names[pin]
            for links in combinations(pin.links, 2):
                new = {self.written.links[link] for link in links}
                name, pair = next(
                    (name, pair)
                    for name, pair in motions.items()
                    if pair.entry_name() == own and {*pair.links} == new and pair.coincident_points()
                )
                first = links if self.written.links[links[0]] == pair.links[0] else (links[1], links[0])
                yield _Joint(name, pair, first)

    def _turns(self, joint: _Joint) -> set[str]:
        return {self.posed.turns[link] for link in joint.links}

    def _rate(self, joint: _Joint, rates: dict[str, float]) -> float:
        return self._relative(joint, {link: rates[self.posed.turns[link]] for link in joint.links})

    def _source_rate(self, pair: Pair) -> float:
        first, second = (self.motion.rates[link] for link in pair.links)
        return first - second if pair.links[1] == self.source.frame else second - first

    def _relative(self, joint: _Joint, values: dict[str, float]) -> float:
        """The second against the first, or of what is not the frame."""
        first, second = joint.links
        return values[first] - values[second] if second == self.source.frame else values[second] - values[first]

    def _turns_back(self, joint: _Joint, given: str) -> bool:
        angles = self.motion.angles.get(given)
        if angles is None:
            return False
        first, second = (angles[self.posed.turns[link]] for link in joint.links)
        steps = np.diff(second - first)
        return bool(steps.min(initial=0.0) < 0.0 < steps.max(initial=0.0))

    def _input(self, told: CognateInput, given: Input) -> Input:
        """The input where the cognate stands, as fast as makes the point move as it does."""
        pair = relative_motions(self.bare)[told.driven]
        if not {*pair.links} & {self.written.links[link] for link in self.posed.remade} and told.scale == 1.0:
            return given
        if pair.input_kind is MeasureKind.LENGTH:
            scaled = replace_numbers(given, told.scale)
            return scaled if told.scale == 1.0 else scaled._replace(law=None, motor=None)
        joint = next(each for each in self._joints() if each.name == told.driven)
        state = self.motion.state
        position = wrap_angle(self._relative(joint, {link: self.written.axes[link].angle for link in joint.links}))
        turning = {link: state.link(self.posed.turns[link]) for link in joint.links}
        velocity = self._relative(joint, {link: each.angular_velocity for link, each in turning.items()})
        acceleration = self._relative(joint, {link: each.angular_acceleration for link, each in turning.items()})
        if told.is_timed:
            if told.scale == 1.0 and abs(wrap_angle(position - given.position)) < ROUNDING:
                position = given.position  # the same but for rounding
            velocity, acceleration = told.scale * given.velocity, told.scale * given.acceleration
        keeps = told.is_timed and told.scale == 1.0
        law = given.law.start_at(position, velocity) if keeps and given.law is not None else None
        return Input(told.driven, position, velocity, acceleration, law, given.motor if keeps else None)


def replace_numbers(given: Input, scale: float) -> Input:
    """An input that goes so many times as far as fast."""
    return given._replace(
        position=scale * given.position, velocity=scale * given.velocity, acceleration=scale * given.acceleration
    )


def with_inputs(bare: Mechanism, inputs: Sequence[Input]) -> Mechanism:
    """The mechanism with these inputs."""
    return replace(bare, inputs=tuple(inputs))


def is_standing(posed: PosedLinkage, motion: PathMotion, link: str, base: str) -> bool:
    """Whether a link does not turn against another one over the whole motion."""
    one, other = posed.turns[link], posed.turns[base]
    return all(float(np.ptp(angles[one] - angles[other])) < 1e-9 for angles in motion.angles.values())
