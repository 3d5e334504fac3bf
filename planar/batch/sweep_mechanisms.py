"""A sweep over mechanisms of any structure: each through the same steps, none compiled by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from math import ceil
from numbers import Integral
from typing import NamedTuple

import numpy as np

from planar.batch.general_path import OUTCOMES, solve_one
from planar.batch.march.choice import marching
from planar.batch.mechanisms.bar_linkages import MOST, bars
from planar.batch.mechanisms.initial_assembly import Started, started
from planar.batch.mechanisms.linkage_arrays import Lot, One, lot_of
from planar.batch.mechanisms.march import ran
from planar.batch.mechanisms.partition import Parted, Unparted, parted
from planar.batch.mechanisms.results import Each, Points, Swept
from planar.foundation.errors import BadInput, Outcome
from planar.model.link_shapes import Unplaced
from planar.model.mechanism import Mechanism, motions, named_points
from planar.model.pairs import Kind as Measure
from planar.model.pin_linkage import Pinned
from planar.model.wording import many
from planar.solving.cycle import MOST_STEPS

Array = np.ndarray

TURN = 2.0 * np.pi
FINE, FINER = 0.07, 8
"""rad: steps that are longer are divided, so that a position is never far from the one before; those that are not sure
once more, into so many."""
TOGETHER = 512
"""Mechanisms that are assembled together, and handed to an executor."""
BYTES = 16 * 2**20
"""Bytes of the links' places that are worked on at once."""


class _Attempt(NamedTuple):
    """How linkages are run: with steps so many times finer, `polished` and `quick` as in `running.ran`."""

    finer: int
    polished: bool
    quick: bool


_ATTEMPTS = (_Attempt(1, False, True), _Attempt(1, True, True), _Attempt(1, True, False), _Attempt(FINER, True, False))
"""One after the other, each for those that the ones before left open; the quick ones are for machine code."""


class Wanted(NamedTuple):
    """What is asked of every mechanism, see `sweep_each`."""

    steps: int
    points: tuple[str, ...] | None
    rates: bool
    pair: str | None
    native: bool


def sweep_each(
    mechanisms: Iterable[Mechanism],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    pair: str | None = None,
    backend: str = "auto",
    executor: Executor | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Each:
    """The motions of mechanisms of any structure, each as `planar.sweep` would have it as a single design.

    Each runs from the assembly nearest to its sketch, at `steps` + 1 positions of its input (the only one, else the one
    at `pair`; the others stand still), a turn on from its own position; a slide runs between its limits. `points` are
    the names of those that are wanted, of every mechanism that has them; all that move, if left out. With `rates` their
    velocities and accelerations too.

    No mechanism is compiled by itself: it is parted into groups of links, of kinds that many have in common, and runs
    as data. Single links and dyads are solved in closed form, groups of up to eight links by Newton's method from step
    to step. To the general path, which is counted and said, fall mechanisms with wheels or racks, with links held more
    than once, with larger groups, without a sketch that tells the assemblies of every group apart, with a slide as the
    input that runs, and those that come so near to where two assemblies meet that steps eight times finer do not show
    on which side they pass. A linkage that comes to a dead point has NaN from there on, and says so.

    `backend` "native" runs compiled machine code, "casadi" numpy, "auto" the faster that is there. `executor`, any of
    `concurrent.futures`' kind, solves parts of the whole elsewhere. `progress` is called with how many mechanisms are
    done, and how many there are.

    Raises BadInput for a point that no mechanism has, an input that is not there, or steps that cannot be.
    """
    whole = list(mechanisms)
    if isinstance(steps, bool) or not isinstance(steps, Integral) or not 1 <= steps <= MOST_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MOST_STEPS} is wanted, not {steps!r:.40}")
    for k, mechanism in enumerate(whole):
        if not isinstance(mechanism, Mechanism):
            raise BadInput(f"mechanisms[{k}]", f"a mechanism is wanted, not {mechanism!r:.40}")
        if pair is not None or not isinstance(mechanism, Pinned) or mechanism.laid is None:
            _running(mechanism, pair, f"mechanisms[{k}]")
    names = (points,) if isinstance(points, str) else None if points is None else tuple(dict.fromkeys(points))
    native = marching(backend)[0][0] == "native" if whole else False
    wanted = Wanted(int(steps), names, rates, pair, native)
    parts = [whole[k : k + TOGETHER] for k in range(0, len(whole), TOGETHER)]
    found: list[Swept] = []
    for done in _solved(parts, wanted, executor):
        found += done
        if progress is not None:
            progress(len(found), len(whole))
    for name in names or ():
        if found and not any(name in each.position for each in found):
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")
    general = [each for each in found if each.general]
    return Each(tuple(found), sum(int(np.sum(each.status == 0)) for each in general), len(general), _said(found))


def _said(found: Sequence[Swept]) -> tuple[str, ...]:
    """What there is to say: how many the general path solved, and how many ended before their time, with a reason."""
    told = []
    sent = sum(each.general for each in found)
    if sent:
        told.append(f"the general path solved {sent} of {many(len(found), 'mechanism')}, one after the other")
    ended: dict[int, list[Swept]] = {}
    for each in found:
        if each.status.any():
            ended.setdefault(int(each.status[-1]), []).append(each)
    told += [f"{many(len(own), 'mechanism')}: {OUTCOMES[code].value}; {own[0].reason}" for code, own in ended.items()]
    return tuple(told)


def _solved(parts: Sequence[list[Mechanism]], wanted: Wanted, executor: Executor | None) -> Iterator[list[Swept]]:
    """The parts as they are solved, in their order, here or by an executor."""
    if executor is None:
        for part in parts:
            yield solve_part(part, wanted)
        return
    futures = []
    for part in parts:
        try:
            futures.append(executor.submit(solve_part, part, wanted))
        except Exception:  # whatever an executor raises, the part can be solved here
            futures.append(None)
    try:
        for part, future in zip(parts, futures, strict=True):
            problem = None if future is None else future.exception()
            if isinstance(problem, BadInput):
                raise problem
            yield solve_part(part, wanted) if future is None or problem is not None else future.result()
    finally:
        for future in futures:
            if future is not None:
                future.cancel()


def _running(mechanism: Mechanism, pair: str | None, place: str) -> int:
    """The number of the input that runs. Raises BadInput."""
    names = [given.pair for given in mechanism.inputs]
    if not names:
        raise BadInput(place, "the mechanism has no input that could run")
    if pair is None and len(names) > 1:
        raise BadInput(place, f"there are several inputs, {', '.join(names)}; name the one that runs")
    if pair is not None and pair not in names:
        raise BadInput(place, f"there is no input at {pair!r}; inputs are at {', '.join(names)}")
    return names.index(pair) if pair is not None else 0


class _Ready(NamedTuple):
    """Linkages that can be solved group after group: their numbers, as arrays, names of their points, where each
    starts, and the links of all groups."""

    numbers: Array
    lot: Lot
    names: Sequence[Sequence[str]]
    start: Array
    groups: Callable[[int], str]


def solve_part(mechanisms: Sequence[Mechanism], wanted: Wanted) -> list[Swept]:
    """Some mechanisms, in their order."""
    found: dict[int, Swept] = {}
    for ready in _ready(mechanisms, wanted):
        start = started(ready.lot, wanted.native)
        left = np.flatnonzero(start.sure)
        for each in _ATTEMPTS if wanted.native else _ATTEMPTS[2:]:
            for some in _blocks(ready.lot.places, left, wanted, _finer(wanted.steps) * each.finer):
                found |= _run(ready, some, start, wanted, each)
            left = np.array([k for k in left if ready.numbers[k] not in found], dtype=int)
            if not left.size:
                break
    return [found[k] if k in found else _general(mechanism, wanted) for k, mechanism in enumerate(mechanisms)]


def _ready(mechanisms: Sequence[Mechanism], wanted: Wanted) -> Iterator[_Ready]:
    """Those of the mechanisms that are not for the general path."""
    taken: set[int] = set()
    pins = _pins(wanted.points) if wanted.pair is None else ()
    laid = {k: each.laid for k, each in enumerate(mechanisms) if isinstance(each, Pinned) and each.laid is not None}
    laid = {k: each for k, each in laid.items() if len(each.bars) <= MOST}
    if laid and pins != ():
        numbers = np.array(list(laid))
        own = bars(list(laid.values()), pins)
        if own is not None:
            taken = set(numbers[own.which].tolist())
            called = [f"P{k}" for k in range(max(len(each.at) for each in laid.values()))]
            names = [[called[pin] for pin in each] for each in own.pins]
            yield _Ready(numbers[own.which], own.lot, names, own.start, own.links)
    ones, numbers, names, starts = [], [], [], []
    for k, mechanism in enumerate(mechanisms):
        made = None if k in taken else _one(mechanism, wanted)
        if made is not None:
            one, own_names, start = made
            ones.append(one)
            numbers.append(k)
            names.append(own_names)
            starts.append(start)
    if not ones:
        return

    def told(number: int) -> str:
        for one in ones:
            if number < len(one.parted.groups):
                links = list(one.parted.shapes)
                return ", ".join(links[k] for k in one.parted.groups[number].inner)
            number -= len(one.parted.groups)
        return ""

    yield _Ready(np.array(numbers), lot_of(ones), names, np.array(starts), told)


def _pins(points: tuple[str, ...] | None) -> list[int] | tuple[()] | None:
    """The numbers of pins by their names: None for all that move, nothing where a name is not one of a pin."""
    if points is None:
        return None
    if all(name[:1] == "P" and name[1:].isdecimal() for name in points):
        return [int(name[1:]) for name in points]
    return ()


def _one(mechanism: Mechanism, wanted: Wanted) -> tuple[One, list[str], float] | None:
    """A mechanism parted into groups, with the names of its points and where it starts; None where it is for the
    general path."""
    running = _running(mechanism, wanted.pair, "inputs")
    try:
        own = parted(mechanism)
    except (Unparted, BadInput, Unplaced):
        return None
    kinds = {pair.name: pair.drive_kind for pair in mechanism.pairs}
    angles = [kinds[given.pair] is not Measure.LENGTH for given in mechanism.inputs]
    if not angles[running] or not all(group.kind.direct or group.kind.followed for group in own.groups):
        return None
    unit = own.unit
    inputs = [
        (given.position if angle else given.position / unit, angle, k == running, given.velocity, given.acceleration)
        for k, (given, angle) in enumerate(zip(mechanism.inputs, angles, strict=True))
    ]
    members = _members(mechanism, wanted.points)
    shown = [] if all(group.kind.direct for group in own.groups) else _shown(mechanism, own, members)
    sketch: list[tuple[float, ...]] = []
    for name, x, y in mechanism.sketch:
        if name not in members:
            return None
        place, link, point = min((own.place_of[link], link, point) for link, point in members[name])
        if place:
            at = own.shapes[link].points[point]
            sketch.append((place, at.x / unit, at.y / unit, x / unit, y / unit))
    names, points = [], []
    for name in _wanted(mechanism, members, wanted.points):
        place, link, point = min((own.place_of[link], link, point) for link, point in members[name])
        names.append(name)
        points.append((place, *own.shapes[link].points[point]))
    return One(own, inputs, sketch, points, shown), names, mechanism.inputs[running].position


def _shown(mechanism: Mechanism, own: Parted, members: Mapping) -> list[tuple[float, ...]]:
    """Points of every link that the sketch shows, or that lie on the frame: see `Lot.shown`."""
    at = {name: (x, y) for name, x, y in mechanism.sketch}
    found: list[tuple[float, ...]] = []
    for name, both in members.items():
        on = next((point for link, point in both if link == mechanism.frame), None)
        place = at.get(name) if on is None else own.shapes[mechanism.frame].points[on]
        if place is not None:
            for link, point in both:
                if own.place_of[link]:
                    local = own.shapes[link].points[point]
                    found.append((own.place_of[link], *(part / own.unit for part in (*local, *place))))
    return found


def _members(mechanism: Mechanism, points: tuple[str, ...] | None) -> Mapping[str, Sequence[tuple[str, str]]]:
    """The (link, point) of named points: of all, or of those that pairs keep together where no other is asked for."""
    together: dict[str, list[tuple[str, str]]] = {}
    for pair in mechanism.pairs:
        own = pair.coincident()
        if own:
            together.setdefault(pair.entry_name(), []).extend(own)
    wanted = (*(points or ()), *(name for name, _, _ in mechanism.sketch))
    if points is not None and all(name in together for name in wanted):
        return together
    return {each.name: each.members for each in named_points(mechanism)}


def _wanted(
    mechanism: Mechanism, members: Mapping[str, Sequence[tuple[str, str]]], points: tuple[str, ...] | None
) -> list[str]:
    """The names of the points that are wanted of a mechanism."""
    if points is not None:
        return [name for name in points if name in members]
    return [name for name, own in members.items() if all(link != mechanism.frame for link, _ in own)]


def _blocks(places: Array, left: Array, wanted: Wanted, finer: int) -> Iterator[Array]:
    """So many of what is left at a time that their places fit into memory near the processor."""
    each = (wanted.steps + 1) * finer * 8 * (10 if wanted.rates else 4)
    ends = np.cumsum(places[left] * each)
    first = 0
    while first < len(left):
        before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, before + BYTES, side="right")), first + 1)
        yield left[first:last]
        first = last


def _finer(steps: int) -> int:
    """Into how many a step is divided."""
    return ceil(TURN / steps / FINE)


def _run(ready: _Ready, some: Array, start: Started, wanted: Wanted, how: _Attempt) -> dict[int, Swept]:
    """Those that came to their end, or to a dead point, by their numbers."""
    steps, finer = wanted.steps, _finer(wanted.steps) * how.finer
    gone = np.linspace(0.0, TURN, steps * finer + 1)
    lot = ready.lot.of(some)
    told = ran(lot, start, gone, TURN / (steps * finer), wanted.rates, wanted.native, how.polished, how.quick)
    orders = 3 if wanted.rates else 1
    out = told.out[:, :, : len(gone) : finer].reshape(len(told.out), orders, 2, steps + 1)
    if finer > 1:
        out = np.ascontiguousarray(out)
    out = out.transpose(0, 1, 3, 2)
    found, first = {}, 0
    grid = np.linspace(0.0, 1.0, steps + 1) * TURN
    solved = np.zeros(steps + 1, dtype=np.int8)
    solved.flags.writeable = False
    inputs = ready.start[some][:, None] + grid
    come, dead = told.good.tolist(), told.dead.tolist()
    for k, one in enumerate(some.tolist()):
        names = ready.names[one]
        own = out[first : first + len(names)]
        first += len(names)
        status, reason, good = solved, "", come[k]
        if good < len(gone):
            if not dead[k]:
                continue
            row = (good - 1) // finer + 1
            own[:, :, row:] = np.nan
            status = np.zeros(steps + 1, dtype=np.int8)
            status[row:] = OUTCOMES.index(Outcome.DEAD_POINT)
            near = ready.start[one] + gone[good - 1 : good + 1]
            links = ready.groups(int(told.at[k]))
            reason = f"links {links} come to a dead point at an input of {near[0]:.6g} to {near[1]:.6g} rad"
        parts = [Points(names, own[:, order]) for order in range(orders)]
        position, velocity, acceleration = parts if wanted.rates else (parts[0], None, None)
        number = int(ready.numbers[one])
        found[number] = Swept(position, velocity, acceleration, inputs[k], status, reason, False)
    return found


def _general(mechanism: Mechanism, wanted: Wanted) -> Swept:
    """One mechanism, solved as a cycle of its own."""
    running = _running(mechanism, wanted.pair, "inputs")
    inputs = tuple(
        given._replace(law=None) if k == running else given._replace(velocity=0.0, acceleration=0.0, law=None)
        for k, given in enumerate(mechanism.inputs)
    )
    mechanism = replace(mechanism, inputs=inputs)
    pair = inputs[running].pair
    grid = None
    members = {each.name: each.members for each in named_points(mechanism)}
    names = tuple(_wanted(mechanism, members, wanted.points))
    if motions(mechanism)[pair].drive_kind is not Measure.LENGTH:
        grid = inputs[running].position + np.linspace(0.0, 1.0, wanted.steps + 1) * TURN
    ends = (None, None) if grid is None else (float(grid[0]), float(grid[-1]))
    told = solve_one(mechanism, pair, grid, wanted.steps, ends, names, wanted.rates)
    out = told.out.reshape(wanted.steps + 1, 3 if wanted.rates else 1, len(names), 2)
    parts = [{name: out[:, k, i] for i, name in enumerate(names)} for k in range(out.shape[1])]
    position, velocity, acceleration = parts if wanted.rates else (parts[0], None, None)
    return Swept(position, velocity, acceleration, told.input, told.status, told.said, True)
