"""Cognates: other linkages that trace the same path, and their inputs, which time it alike."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple, overload

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.document.reader import read_mechanism
from planar.document.writer import write_mechanism
from planar.foundation.angles import wrap_angle
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, PlanarError
from planar.foundation.time_limit import all_within_time, stop_if_over, stops_in_time
from planar.model.mechanism import Drive, Input, Mechanism, named_points, relative_motions, replace_inputs
from planar.model.pairs import MeasureKind, Pair
from planar.model.wording import count_phrase
from planar.results.motion import State
from planar.solving.cycle import cycle
from planar.solving.position import solve
from planar.synthesis.cognates.posed_linkage import (
    SAME_PLACE,
    PosedLinkage,
    Refusal,
    Tracer,
    exchanged,
    exchanges,
    pose_linkage,
    refusal_sentence,
)
from planar.synthesis.cognates.written_cognate import CognateNames, WrittenCognate
from planar.synthesis.task.synthesis_task import SynthesisTask, WantedPath
from planar.synthesis.task.wanted_results import carried_name

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

    def is_standing(self, posed: PosedLinkage, link: str, base: str) -> bool:
        """Whether a link does not turn against another one over the whole motion."""
        one, other = posed.turns[link], posed.turns[base]
        return all(float(np.ptp(angles[one] - angles[other])) < 1e-9 for angles in self.angles.values())


class _Joint(NamedTuple):
    """A relative motion of a cognate, with the two links as the file of the mechanism calls them."""

    name: str
    pair: Pair
    links: tuple[str, str]


class CognateInputs:
    """Finds the inputs of one cognate."""

    def __init__(self, written: WrittenCognate, bare: Mechanism, motion: PathMotion):
        self.written, self.posed, self.motion, self.bare = written, written.posed, motion, bare
        self.source = motion.state.mechanism

    def find(self) -> tuple[tuple[Input, ...], tuple[CognateInput, ...]]:
        """The inputs, and how they belong to those of the mechanism. Raises NoAnswer."""
        told: list[CognateInput | None] = [self._timed(given) for given in self.source.inputs]
        taken = {part.driven for part in told if part is not None}
        for k, given in enumerate(self.source.inputs):
            if told[k] is None:
                told[k] = self._untimed(given, taken)
                taken.add(told[k].driven)  # type: ignore[union-attr]
        inputs = [part for part in told if part is not None]
        return tuple(self._input(drive, given) for drive, given in zip(inputs, self.source.inputs, strict=True)), tuple(
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
        remade = [joint for joint in able if self.posed.remade & {*joint.links}]
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
            if told.scale == 1.0:
                return given
            position, velocity, acceleration = told.scale * np.array(given[1:4])
            return Input(given.pair, float(position), float(velocity), float(acceleration))
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


PATH_STEPS = 180
"""Parts of the motion over which it is seen what turns and what turns back."""
MAX_COGNATES = 96
"""Linkages that are told at the most."""


class Cognate(NamedTuple):
    """A linkage in which a point traces the same path.

    `mechanism` stands where that whose cognate it is stands, its point, called `point`, at the same place with the same
    velocity and acceleration. `inputs` tell by what it is driven, beside the inputs of that mechanism.
    """

    mechanism: Mechanism
    point: str
    inputs: tuple[CognateInput, ...]

    def __repr__(self) -> str:
        timed = "timed" if self.is_timed else "not timed"
        driven = ", ".join(drive.driven for drive in self.inputs)
        return f"<Cognate {self.mechanism.name!r}: driven at {driven}, {timed}>"

    @property
    def is_timed(self) -> bool:
        """Whether at steady speeds of its inputs the point goes through its path as with those of the mechanism."""
        return all(drive.is_timed for drive in self.inputs)

    @property
    def sentence(self) -> str:
        """How it is driven, and what that means for the timing."""
        return "; ".join(map(_input_sentence, self.inputs))


@dataclass(frozen=True, eq=False)
class Cognates(Sequence[Cognate]):
    """All cognates of a mechanism for the path of a point: a sequence, the mechanism itself first.

    `path` (n, 2) are places (m) of the point over the mechanism's motion. Those that keep the timing come before the
    others.
    """

    mechanism: Mechanism
    point: str
    path: Array
    found: tuple[Cognate, ...]

    def __repr__(self) -> str:
        return f"<Cognates of {self.mechanism.name!r} for {self.point}: {count_phrase(len(self), 'linkage')}>"

    @overload
    def __getitem__(self, index: int) -> Cognate: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Cognate]: ...
    def __getitem__(self, index: int | slice) -> Cognate | Sequence[Cognate]:
        return self.found[index]

    def __len__(self) -> int:
        return len(self.found)

    def __iter__(self) -> Iterator[Cognate]:
        return iter(self.found)

    @property
    def timed(self) -> tuple[Cognate, ...]:
        """The others that keep the timing of the path."""
        return tuple(each for each in self.found[1:] if each.is_timed)


@takes_mechanism
@stops_in_time
def cognates(
    mechanism: Mechanism,
    point: str,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Cognates:
    """The linkages with as many links in which a point traces the path that `point` traces.

    Of a four-bar all three of S. Roberts and P. L. Chebyshev, of a slider-crank both, of larger linkages all that come
    of exchanging a bar and a coupler pinned to it, and again, with what guides the coupler made larger and turned
    (E. A. Dijksman). Links that stay are those of the file; loads, springs and masses on others are left out. It is
    driven where that keeps the timing of the path, if a joint of it does; at the same place with the same velocity and
    acceleration it starts in any case.

    Raises Unknown for a point that is not there, BadInput where there is no cognate, as of a point on a crank, in a
    parallelogram, or at a pin of the coupler; what `planar.solve` and `planar.cycle` raise; and NoAnswer with the
    outcome "interrupted" after `timeout` s, or a Ctrl-C.

    >>> import planar
    >>> found = planar.cognates("four-bar", "E")
    >>> [each.inputs[0].driven for each in found], found.timed
    (['A', 'H', 'A'], (<Cognate 'Four-bar chain, cognate 1': driven at H, timed>,))
    """
    state = solve(mechanism)
    tracer, tracer_point, name = _tracer(state, point)
    posed, motion = pose_linkage(state), _path_motion(mechanism, state)
    others, refused = _search(posed, mechanism, tracer, motion)
    if not others:
        raise BadInput(point, refusal_sentence(name, refused))
    names = CognateNames(mechanism, posed)
    own = tuple(CognateInput(drive.pair, drive.pair, True, 1.0, False) for drive in mechanism.inputs)
    written = []
    for number, other in enumerate(all_within_time(others, "cognates"), 1):
        writer = WrittenCognate(state, other, tracer, tracer_point, names.pin_names(other, number))
        written.append(_written(writer, motion, f"{mechanism.name}, cognate {number}", name))
    path: Array = cycle(mechanism, PATH_STEPS, pair=mechanism.inputs[0].pair).point(name).position
    path.flags.writeable = False
    return Cognates(mechanism, name, path, (Cognate(mechanism, name, own), *written))


def first_cognates(mechanism: Mechanism) -> Cognates:
    """Those of the first point that has any. Raises BadInput where none has."""
    for name in solve(mechanism).point_names:
        with suppress(BadInput):
            return cognates(mechanism, name)
    raise BadInput(mechanism.name, "no point of it has a path that another linkage is known to trace")


def cognates_of(found: Cognates | Mechanism, of: str | None) -> Cognates:
    """Cognates as they are, or those of a mechanism's point, of the first that has any where none is named."""
    if isinstance(found, Cognates):
        return found
    return first_cognates(found) if of is None else cognates(found, of)


def _search(
    posed: PosedLinkage, mechanism: Mechanism, tracer: Tracer, motion: PathMotion
) -> tuple[list[PosedLinkage], list[Refusal]]:
    """All linkages that exchanges lead to, and the reasons why there are not more."""
    found, refused = [posed], list[Refusal]()
    for one in found:
        stop_if_over(f"after {len(found) - 1} cognates")
        changes, reasons = exchanges(one, mechanism, tracer)
        refused += reasons
        for change in changes:
            still = [link for link in (change.coupler, change.bar) if motion.is_standing(one, link, change.base)]
            if still:
                sentence = f"{still[0]!r} does not turn, as in a parallelogram, so that the point moves on a circle"
                refused.append(Refusal(4, sentence))
                continue
            other = exchanged(one, change)
            if len(found) <= MAX_COGNATES and not any(other.looks_like(each) for each in found):
                found.append(other)
    motions = relative_motions(mechanism)
    pins = [{*motions[given.pair].links} for given in mechanism.inputs if motions[given.pair].coincident_points()]

    def keeps_timing(linkage: PosedLinkage) -> bool:
        """Whether for every input some joint moves as it does."""
        joints = [{linkage.turns[link] for link in pair} for pin in linkage.pins for pair in combinations(pin.links, 2)]
        return all(links in joints for links in pins)

    return sorted(found[1:], key=lambda linkage: not keeps_timing(linkage)), refused


def _written(writer: WrittenCognate, motion: PathMotion, name: str, point: str) -> Cognate:
    """A cognate as a mechanism, solved to see that its point is there."""
    source = motion.state.mechanism
    bare = writer.mechanism(name, f"Its point traces the path of {point} of {source.name!r}.")
    inputs, told = CognateInputs(writer, bare, motion).find()
    mechanism = read_mechanism(write_mechanism(replace(bare, inputs=inputs)))
    own = writer.point_name(bare)
    off = solve(mechanism).point(own).position - motion.state.point(point).position
    if float(np.hypot(*off)) > SAME_PLACE * writer.posed.size:
        raise NoAnswer(
            Outcome.CHANGE_POINT,
            f"where {source.name!r} stands a cognate of it can go on in two ways; move its input somewhat",
        )
    return Cognate(mechanism, own, told)


def _tracer(state: State, point: str) -> tuple[Tracer, str, str]:
    """The point, what its link calls it, and what results call it. Raises Unknown and BadInput."""
    x, y = state.point(point).position
    named = next(
        each
        for each in named_points(state.mechanism)
        if each.name == point or any(f"{link}.{own}" == point for link, own in each.members)
    )
    links = frozenset(link for link, _ in named.members)
    if state.mechanism.frame in links:
        raise BadInput(point, f"{named.name!r} is a point of the frame, and traces no path")
    return Tracer(links, complex(x, y)), named.members[0][1], named.name


def _path_motion(mechanism: Mechanism, state: State) -> PathMotion:
    angles = {}
    for given in mechanism.inputs:
        motion = cycle(mechanism, PATH_STEPS, pair=given.pair)
        angles[given.pair] = {name: np.unwrap(each.angle) for name, each in motion.links.items()}
    moving = tuple(Drive(given.pair, velocity=1.0 / (1 + k)) for k, given in enumerate(mechanism.inputs))
    rates = solve(replace_inputs(mechanism, moving)).links
    return PathMotion(angles, state, {name: each.angular_velocity for name, each in rates.items()})


def _input_sentence(told: CognateInput) -> str:
    if told.is_timed:
        by = f", {abs(told.scale):.6g} times as fast" if abs(told.scale) != 1.0 else ""
        sense = ", the other way round" if told.scale < 0.0 else ""
        return f"driven at {told.driven}{by}{sense} it keeps the timing of the path"
    more = ", and comes along all of it only through its dead points" if told.turns_back else ""
    return f"driven at {told.driven} it does not keep the timing of the path{more}"


def task_cognates(mechanism: Mechanism, task: SynthesisTask) -> tuple[Cognate, ...]:
    """Other linkages that do the task as this one does: where it wants the path of one point and nothing else.

    Of a path whose timing is prescribed those that keep it, else all.
    """
    paths = [item for item in task.wanted if isinstance(item, WantedPath)]
    points = {path.point for path in paths}
    if len(paths) < len(task.wanted) or len(points) != 1:
        return ()
    try:
        found = cognates(mechanism, carried_name(mechanism, points.pop()))
    except PlanarError:
        return ()  # it has none
    if all(path.inputs is None for path in paths):
        return tuple(found[1:])
    return tuple(each for each in found.timed if all(one.scale == 1.0 for one in each.inputs))
