"""Changes of one number, a dimension or an input, that let a mechanism go together that does not, and by how much."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass
from itertools import islice
from math import ceil, floor, log10
from typing import NamedTuple

import numpy as np

from planar.equations.constraint_equations import Stage
from planar.equations.functions import fitted, shapes
from planar.foundation.units import unit
from planar.model.dimensions import changed, dimensions
from planar.model.link_shapes import Unplaced
from planar.model.mechanism import Drive, Mechanism, with_inputs
from planar.model.wording import amount
from planar.solving.assembly.block_assemblies import Candidate, Candidates, closing_of
from planar.solving.assembly.nearest_assembly import Assembly, Failure, search
from planar.solving.newton import newton, polished
from planar.solving.prepared_mechanism import Setup

Array = np.ndarray

MOST = 40
"""Dimensions that are looked at."""
LONGEST = 30
"""Newton's steps of a number; what stays open falls about linearly with it, so a few do."""
RETREATS = 4
"""Times that a step is halved since the groups before do not go together where it leads."""
FARTHEST = 1.0
"""The farthest that a step goes (sizes, rad)."""
CLOSED = 1e-9
FALLING = 0.1
"""Below CLOSED steps go on as long as each leaves only so much of what the one before left open."""
NEARLY = 1e-4
"""Where so much of the last step less leaves a group open, the step did not go too far."""
ROUNDED = 1e-6
LESS = 0.99
"""Part of a change that is tried for whether it will do."""
BESIDE = 0.01
"""Of what is large for a number: where it is looked at once more."""
FLAT = 1e-3
"""A number by whose change (sizes, rad) less than this part of it closes hardly matters."""
PROVED = 4
"""Changes, the least first, that are tried by assembling the whole."""
DIGITS, ALL_DIGITS = 5, 15
LEAST_EFFORT = 200
"""Groups that may be solved in search of a remedy though that of an assembly took fewer."""
MOVED = 0.1
"""What it takes to move a group on from where it was, for one of solving it from a sketch."""


class Spent(Exception):
    """More groups would have to be solved than may be."""


class Effort:
    """How many groups may yet be solved."""

    def __init__(self, groups: float):
        self.left = groups

    def spend(self, groups: float) -> None:
        """Count groups. Raises Spent where there are none left."""
        self.left -= groups
        if self.left < 0.0:
            raise Spent


class _Counted(Candidates):
    """Candidates for which effort is spent."""

    def __init__(self, setup: Setup, effort: Effort):
        super().__init__(setup)
        self._effort = effort

    def of(self, stage: Stage, z: Array, every: bool = False) -> tuple[list[Candidate], Array]:
        self._effort.spend(1.0)
        return super().of(stage, z, every)


class Change(NamedTuple):
    """A dimension, or the input at a pair, at another value (m or rad), with which the whole goes together."""

    name: str
    kind: str
    "length or angle"
    was: float
    value: float
    shown: str
    "the value with its unit; the whole goes together with it as it stands there"


@dataclass(frozen=True)
class _Number:
    """A number of a mechanism that may be changed."""

    name: str
    kind: str
    was: float
    size: float
    "what is large for it (m or rad)"
    least: float
    changed: Callable[[float], Mechanism]


def remedy(setup: Setup, failure: Failure, otherwise: str) -> str:
    """A clause that says which dimension to make how long, or where to move an input; `otherwise` where there is none.

    A change is offered only after the mechanism with it, rounded as it is printed, has been assembled. No more is spent
    on it than on the search for an assembly; where that did not do it is said.
    """
    effort = Effort(max(LEAST_EFFORT, failure.groups))
    beside = (link for name in failure.stage.pairs for link in setup.pairs[name].bodies)
    links = frozenset((*failure.stage.links, *beside))
    told, cut = [], False
    try:
        for change in islice(moving(setup, failure, effort=effort), 1):
            told.append(f"at {change.name} = {change.shown}")
        for change in islice(mending(setup, failure, links, effort=effort), 1):
            was = amount(change.was, change.kind, setup.mechanism.units)
            told.insert(0, f"with {change.name} = {change.shown} instead of {was}")
    except Spent:
        cut = True
    if told:
        return f"it would go together {', or '.join(told)}"
    return f"{otherwise} (which, was looked for only as long as for an assembly)" if cut else otherwise


def mending(
    setup: Setup, failure: Failure, links: frozenset[str], thorough: bool = False, effort: Effort | None = None
) -> Iterator[Change]:
    """Changes of one dimension of these links each that let the whole go together, the least first.

    Each is the least with which the assembly goes together that comes nearest without it; only a `thorough` search
    looks whether another does with less, and tries all changes on the whole. Raises Spent where there is an end to the
    `effort`.
    """
    mechanism = setup.mechanism
    return _least_first(
        setup,
        failure,
        [
            _Number(
                each.name,
                "length",
                each.value,
                setup.unit,
                0.0 if each.name == f"{each.link}.length" else -np.inf,
                lambda value, each=each: changed(mechanism, each, value),
            )
            for each in islice(dimensions(mechanism, links), MOST)
        ],
        thorough,
        effort or Effort(np.inf),
    )


def moving(
    setup: Setup,
    failure: Failure,
    inputs: Collection[str] | None = None,
    thorough: bool = False,
    effort: Effort | None = None,
) -> Iterator[Change]:
    """Positions of one input each, of these or of all, at which the whole goes together: as `mending`."""
    mechanism = setup.mechanism
    return _least_first(
        setup,
        failure,
        [
            _Number(
                given.pair,
                "length" if setup.slides(given.pair) else "angle",
                given.position,
                setup.unit if setup.slides(given.pair) else 1.0,
                -np.inf,
                lambda value, given=given: with_inputs(mechanism, (Drive(given.pair, value),)),
            )
            for given in mechanism.inputs
            if inputs is None or given.pair in inputs
        ],
        thorough,
        effort or Effort(np.inf),
    )


def _least_first(
    setup: Setup, failure: Failure, numbers: list[_Number], thorough: bool, effort: Effort
) -> Iterator[Change]:
    found = []
    for number in numbers:
        value = _closing_value(setup, failure, number, effort)
        if value is not None:
            value = _with_less(number, value, effort) if thorough else value
            found.append((abs(value - number.was) / number.size, number, value))
    # of changes that are as small, that of a link's length
    found.sort(key=lambda each: (round(each[0], 6), not each[1].name.endswith(".length")))
    units = setup.mechanism.units
    for _, number, value in found if thorough else found[:PROVED]:
        name = units.length if number.kind == "length" else units.angle
        by = unit(name)
        near = by.from_si(value)
        # first a little beyond, where it goes together with ease; what is held twice needs the very value
        for shown in (f"{_rounded(near, value > number.was):.6g}", f"{near:.{DIGITS}g}", f"{near:.{ALL_DIGITS}g}"):
            there = by.to_si(float(shown))
            if goes_together(number.changed(there), effort):
                yield Change(number.name, number.kind, number.was, there, f"{shown} {name}")
                break


def _with_less(number: _Number, value: float, effort: Effort) -> float:
    """A value at which another assembly just goes together, if less of the change will do for that."""
    open_, closed = number.was, number.was + LESS * (value - number.was)
    if not goes_together(number.changed(closed), effort):
        return value
    while abs(closed - open_) > ROUNDED * number.size:
        tried = 0.5 * (open_ + closed)
        open_, closed = (open_, tried) if goes_together(number.changed(tried), effort) else (tried, closed)
    return closed


def _closing_value(setup: Setup, failure: Failure, number: _Number, effort: Effort) -> float | None:
    """The value (m or rad) of a number at which what stays open just closes; None where there is none.

    What stays open at the nearest position falls as the number changes by its share in it: Newton's method for a zero
    of the distance, the position being found anew at each step.
    """
    value, z, nudge = number.was, failure.z, 1e-7 * number.size
    open_at, way, least, found, retreats = number.was, 0.0, CLOSED, None, 0
    for _ in range(LONGEST):
        here = _at(setup, failure.stage, number.changed(value), z, effort)
        beside = here and _at(setup, failure.stage, number.changed(value + nudge), z, effort)
        if here is None or beside is None:
            if retreats == RETREATS:
                break
            value, retreats = 0.5 * (open_at + value), retreats + 1  # there the groups before it do not close
            continue
        nearest = here.nearest()
        gap = float(np.linalg.norm(here.left(nearest)))
        if found is not None and gap > least:
            break
        slope = float(here.left(nearest) @ (beside.left(nearest) - here.left(nearest))) / (gap or 1.0) / nudge
        way = way or -np.sign(slope)
        if gap <= least:
            found, least = value, FALLING * gap
        elif way * slope > 0.0:
            value = 0.5 * (open_at + value)  # it went over where it closes, and out on the other side
            continue
        else:
            open_at, z = value, nearest
        if abs(slope) * number.size < FLAT:
            if found is not None or value != number.was:
                break  # it hardly matters here, or nothing is left open
            value, way = number.was + BESIDE * number.size, 0.0  # where it is farthest off it may yet matter
            continue
        step = float(np.clip(-gap / slope, -FARTHEST * number.size, FARTHEST * number.size))
        value = max(value + step, 0.5 * (value + number.least))
    if found is None or found == number.was:
        return None
    return _least_closed(setup, failure.stage, number, (open_at, found), z, effort)


def _least_closed(
    setup: Setup, stage: Stage, number: _Number, between: tuple[float, float], z: Array, effort: Effort
) -> float:
    """Of a value at which a group is open and one at which it is closed, the one between them where that changes.

    The last step of Newton's method may have gone too far.
    """
    open_, closed = between
    part = NEARLY
    while abs(closed - open_) > ROUNDED * number.size:
        tried = closed + part * (open_ - closed)
        there = _at(setup, stage, number.changed(tried), z, effort)
        gap = np.inf if there is None else float(np.linalg.norm(there.left(there.nearest())))
        if gap > CLOSED and part == NEARLY:
            break
        open_, closed = (tried, closed) if gap > CLOSED else (open_, tried)
        part = 0.5
    return closed


class _There:
    """What a group leaves open when numbers have been changed, the groups before it standing where they then do."""

    def __init__(self, setup: Setup, stage: Stage, z: Array, u: Array, p: Array):
        self._stage, self._z = stage, z
        self._closing = closing_of(setup.program, stage, z, u, p)

    def nearest(self) -> Array:
        """All unknowns (unknowns,), those of the group where it is nearest to closing."""
        z = self._z.copy()
        z[self._stage.unknowns] = newton(self._closing, self._z[None, self._stage.unknowns]).unknowns[0]
        return z

    def left(self, z: Array) -> Array:
        """What is left open (rows,) with the group's unknowns as in z (unknowns,)."""
        return self._closing(z[None, self._stage.unknowns])[0][0]


def _at(setup: Setup, stage: Stage, mechanism: Mechanism, z: Array, effort: Effort) -> _There | None:
    """A group of a mechanism with other numbers, those before it moved on from z; None where they cannot be."""
    effort.spend(MOVED)
    try:
        p = fitted(mechanism, shapes(mechanism), setup.unit)
    except Unplaced:
        return None
    by = [setup.unit if slides else 1.0 for slides in setup.outline.slide]
    u = np.array([given.position / size for given, size in zip(mechanism.inputs, by, strict=True)])
    z = z.copy()
    for before in setup.equations.stages[: stage.level]:
        closing = closing_of(setup.program, before, z, u, p)
        z[before.unknowns] = polished(closing, z[before.unknowns])
        if np.max(np.abs(closing(z[None, before.unknowns])[0]), initial=0.0) > CLOSED:
            return None
    return _There(setup, stage, z, u, p)


def _rounded(value: float, up: bool) -> float:
    """A number of DIGITS digits beyond the value, seen from where it comes."""
    size = 10.0 ** (floor(log10(abs(value))) + 1 - DIGITS) if value else 1.0
    return (ceil if up else floor)(value / size) * size


def goes_together(mechanism: Mechanism, effort: Effort) -> bool:
    """Whether the whole can be assembled at its inputs. Raises Spent."""
    try:
        return isinstance(search(_Counted(Setup(mechanism), effort)), Assembly)
    except Unplaced:
        return False
