"""All linkages that trace the path of a point as a given one does, with where each is driven."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import NamedTuple, overload

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.document.reader import read_mechanism
from planar.document.writer import write_mechanism
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome
from planar.model.mechanism import Drive, Mechanism, named_points, replace_inputs
from planar.model.wording import count_phrase
from planar.results.motion import State
from planar.solving.cycle import cycle
from planar.solving.position import solve
from planar.synthesis.cognates.cognate_inputs import (
    CognateInput,
    CognateInputs,
    PathMotion,
    is_standing,
    keeps_timing,
    with_inputs,
)
from planar.synthesis.cognates.cognate_names import CognateNames
from planar.synthesis.cognates.exchanges import Refusal, Tracer, exchanged, exchanges, refusal_sentence
from planar.synthesis.cognates.posed_linkage import SAME_PLACE, PosedLinkage, pose_linkage
from planar.synthesis.cognates.written_cognate import WrittenCognate

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
        driven = ", ".join(each.driven for each in self.inputs)
        return f"<Cognate {self.mechanism.name!r}: driven at {driven}, {timed}>"

    @property
    def is_timed(self) -> bool:
        """Whether at steady speeds of its inputs the point goes through its path as with those of the mechanism."""
        return all(each.is_timed for each in self.inputs)

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
def cognates(mechanism: Mechanism, point: str) -> Cognates:
    """The linkages with as many links in which a point traces the path that `point` traces.

    Of a four-bar all three of S. Roberts and P. L. Chebyshev, of a slider-crank both, of larger linkages all that come
    of exchanging a bar and a coupler pinned to it, and again, with what guides the coupler made larger and turned
    (E. A. Dijksman). Links that stay are those of the file; loads, springs and masses on others are left out. It is
    driven where that keeps the timing of the path, if a joint of it does; at the same place with the same velocity and
    acceleration it starts in any case.

    Raises Unknown for a point that is not there, BadInput where there is no cognate, as of a point on a crank, in a
    parallelogram, or at a pin of the coupler; and what `planar.solve` and `planar.cycle` raise.

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
    own = tuple(CognateInput(each.pair, each.pair, True, 1.0, False) for each in mechanism.inputs)
    written = []
    for number, other in enumerate(others, 1):
        writer = WrittenCognate(state, other, tracer, tracer_point, names.pin_names(other, number))
        written.append(_written(writer, motion, f"{mechanism.name}, cognate {number}", name))
    return Cognates(mechanism, name, _path(mechanism, name), (Cognate(mechanism, name, own), *written))


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
        changes, reasons = exchanges(one, mechanism, tracer)
        refused += reasons
        for change in changes:
            still = next(
                (link for link in (change.coupler, change.bar) if is_standing(one, motion, link, change.base)), None
            )
            if still is not None:
                refused.append(
                    Refusal(4, f"{still!r} does not turn, as in a parallelogram, so that the point moves on a circle")
                )
                continue
            other = exchanged(one, change)
            if len(found) <= MAX_COGNATES and not any(other.looks_like(each) for each in found):
                found.append(other)
    return sorted(found[1:], key=lambda each: not keeps_timing(each, mechanism)), refused


def _written(writer: WrittenCognate, motion: PathMotion, name: str, point: str) -> Cognate:
    """A cognate as a mechanism, solved to see that its point is there."""
    source = motion.state.mechanism
    bare = writer.mechanism(name, f"Its point traces the path of {point} of {source.name!r}.")
    inputs, told = CognateInputs(writer, bare, motion).find()
    mechanism = read_mechanism(write_mechanism(with_inputs(bare, inputs)))
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


def _path(mechanism: Mechanism, name: str) -> Array:
    found: Array = cycle(mechanism, PATH_STEPS, pair=mechanism.inputs[0].pair).point(name).position
    found.flags.writeable = False
    return found


def _input_sentence(told: CognateInput) -> str:
    if told.is_timed:
        by = f", {abs(told.scale):.6g} times as fast" if abs(told.scale) != 1.0 else ""
        sense = ", the other way round" if told.scale < 0.0 else ""
        return f"driven at {told.driven}{by}{sense} it keeps the timing of the path"
    more = ", and comes along all of it only through its dead points" if told.turns_back else ""
    return f"driven at {told.driven} it does not keep the timing of the path{more}"
