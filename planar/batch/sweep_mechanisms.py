"""A sweep over mechanisms of any structure: each through the same steps, none compiled by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from math import ceil
from numbers import Integral
from typing import NamedTuple

import numpy as np

from planar.batch.general_path import OUTCOMES, solve_design
from planar.batch.march.choice import available_runners
from planar.batch.mechanisms.bar_linkages import MAX_BARS, bar_linkage_arrays
from planar.batch.mechanisms.initial_assembly import StartAssemblies, find_start_assemblies
from planar.batch.mechanisms.linkage_arrays import LinkageArrays, PartitionedLinkage, make_linkage_arrays
from planar.batch.mechanisms.march import run_linkages
from planar.batch.mechanisms.partition import NotPartitionable, Partition, partition_mechanism
from planar.batch.mechanisms.results import Each, PointMapping, Swept
from planar.foundation.errors import BadInput, Outcome
from planar.model.link_shapes import PointPlacementError
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind as Measure
from planar.model.pin_linkage import PinnedMechanism
from planar.model.wording import count_phrase
from planar.solving.cycle import MAX_STEPS

Array = np.ndarray

FULL_TURN = 2.0 * np.pi
LONGEST_INPUT_STEP, REFINEMENT = 0.07, 8
"""rad: steps that are longer are divided, so that a position is never far from the one before; those that are not sure
once more, into so many."""
PART_SIZE = 512
"""Mechanisms that are assembled together, and handed to an executor."""
MAX_STATE_BYTES = 16 * 2**20
"""Bytes of the links' places that are worked on at once."""


class _Attempt(NamedTuple):
    """How linkages are run: with steps so many times finer, `polished` and `quick` as in `march.run_linkages`."""

    refinement: int
    polished: bool
    verdict_only: bool


_ATTEMPTS = (
    _Attempt(1, False, True),
    _Attempt(1, True, True),
    _Attempt(1, True, False),
    _Attempt(REFINEMENT, True, False),
)
"""One after the other, each for those that the ones before left open; the quick ones are for machine code."""


class SweepRequest(NamedTuple):
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
    if isinstance(steps, bool) or not isinstance(steps, Integral) or not 1 <= steps <= MAX_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MAX_STEPS} is wanted, not {steps!r:.40}")
    for k, mechanism in enumerate(whole):
        if not isinstance(mechanism, Mechanism):
            raise BadInput(f"mechanisms[{k}]", f"a mechanism is wanted, not {mechanism!r:.40}")
        if pair is not None or not isinstance(mechanism, PinnedMechanism) or mechanism.layout is None:
            _running_input(mechanism, pair, f"mechanisms[{k}]")
    names = (points,) if isinstance(points, str) else None if points is None else tuple(dict.fromkeys(points))
    native = available_runners(backend)[0][0] == "native" if whole else False
    wanted = SweepRequest(int(steps), names, rates, pair, native)
    parts = [whole[k : k + PART_SIZE] for k in range(0, len(whole), PART_SIZE)]
    found: list[Swept] = []
    for done in _solve_parts(parts, wanted, executor):
        found += done
        if progress is not None:
            progress(len(found), len(whole))
    for name in names or ():
        if found and not any(name in each.position for each in found):
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")
    general = [each for each in found if each.general]
    return Each(tuple(found), sum(int(np.sum(each.status == 0)) for each in general), len(general), _messages(found))


def _messages(found: Sequence[Swept]) -> tuple[str, ...]:
    """What there is to say: how many the general path solved, and how many ended before their time, with a reason."""
    told = []
    sent = sum(each.general for each in found)
    if sent:
        told.append(f"the general path solved {sent} of {count_phrase(len(found), 'mechanism')}, one after the other")
    ended: dict[int, list[Swept]] = {}
    for each in found:
        if each.status.any():
            ended.setdefault(int(each.status[-1]), []).append(each)
    told += [
        f"{count_phrase(len(own), 'mechanism')}: {OUTCOMES[code].value}; {own[0].reason}" for code, own in ended.items()
    ]
    return tuple(told)


def _solve_parts(
    parts: Sequence[list[Mechanism]], request: SweepRequest, executor: Executor | None
) -> Iterator[list[Swept]]:
    """The parts as they are solved, in their order, here or by an executor."""
    if executor is None:
        for part in parts:
            yield solve_mechanisms(part, request)
        return
    futures = []
    for part in parts:
        try:
            futures.append(executor.submit(solve_mechanisms, part, request))
        except Exception:  # whatever an executor raises, the part can be solved here
            futures.append(None)
    try:
        for part, future in zip(parts, futures, strict=True):
            problem = None if future is None else future.exception()
            if isinstance(problem, BadInput):
                raise problem
            yield solve_mechanisms(part, request) if future is None or problem is not None else future.result()
    finally:
        for future in futures:
            if future is not None:
                future.cancel()


def _running_input(mechanism: Mechanism, pair: str | None, place: str) -> int:
    """The number of the input that runs. Raises BadInput."""
    names = [given.pair for given in mechanism.inputs]
    if not names:
        raise BadInput(place, "the mechanism has no input that could run")
    if pair is None and len(names) > 1:
        raise BadInput(place, f"there are several inputs, {', '.join(names)}; name the one that runs")
    if pair is not None and pair not in names:
        raise BadInput(place, f"there is no input at {pair!r}; inputs are at {', '.join(names)}")
    return names.index(pair) if pair is not None else 0


class _LinkageGroup(NamedTuple):
    """Linkages that can be solved group after group: their numbers, as arrays, names of their points, where each
    starts, and the links of all groups."""

    numbers: Array
    arrays: LinkageArrays
    names: Sequence[Sequence[str]]
    start: Array
    links_of_block: Callable[[int], str]


def solve_mechanisms(mechanisms: Sequence[Mechanism], request: SweepRequest) -> list[Swept]:
    """Some mechanisms, in their order."""
    found: dict[int, Swept] = {}
    for ready in _linkage_groups(mechanisms, request):
        start = find_start_assemblies(ready.arrays, request.native)
        left = np.flatnonzero(start.is_sure)
        for each in _ATTEMPTS if request.native else _ATTEMPTS[2:]:
            for some in _cache_sized_chunks(
                ready.arrays.link_counts, left, request, _step_division(request.steps) * each.refinement
            ):
                found |= _run_attempt(ready, some, start, request, each)
            left = np.array([k for k in left if ready.numbers[k] not in found], dtype=int)
            if not left.size:
                break
    return [
        found[k] if k in found else _solve_with_general_path(mechanism, request)
        for k, mechanism in enumerate(mechanisms)
    ]


def _linkage_groups(mechanisms: Sequence[Mechanism], request: SweepRequest) -> Iterator[_LinkageGroup]:
    """Those of the mechanisms that are not for the general path."""
    taken: set[int] = set()
    pins = _pin_numbers(request.points) if request.pair is None else ()
    laid = {
        k: each.layout
        for k, each in enumerate(mechanisms)
        if isinstance(each, PinnedMechanism) and each.layout is not None
    }
    laid = {k: each for k, each in laid.items() if len(each.bars) <= MAX_BARS}
    if laid and pins != ():
        numbers = np.array(list(laid))
        own = bar_linkage_arrays(list(laid.values()), pins)
        if own is not None:
            taken = set(numbers[own.which].tolist())
            called = [f"P{k}" for k in range(max(len(each.pin_positions) for each in laid.values()))]
            names = [[called[pin] for pin in each] for each in own.pins]
            yield _LinkageGroup(numbers[own.which], own.arrays, names, own.start, own.links_of_block)
    ones, numbers, names, starts = [], [], [], []
    for k, mechanism in enumerate(mechanisms):
        made = None if k in taken else _partition_linkage(mechanism, request)
        if made is not None:
            one, own_names, start = made
            ones.append(one)
            numbers.append(k)
            names.append(own_names)
            starts.append(start)
    if not ones:
        return

    def block_links(number: int) -> str:
        for one in ones:
            if number < len(one.partition.blocks):
                links = list(one.partition.shapes)
                return ", ".join(links[k] for k in one.partition.blocks[number].inner_links)
            number -= len(one.partition.blocks)
        return ""

    yield _LinkageGroup(np.array(numbers), make_linkage_arrays(ones), names, np.array(starts), block_links)


def _pin_numbers(points: tuple[str, ...] | None) -> list[int] | tuple[()] | None:
    """The numbers of pins by their names: None for all that move, nothing where a name is not one of a pin."""
    if points is None:
        return None
    if all(name[:1] == "P" and name[1:].isdecimal() for name in points):
        return [int(name[1:]) for name in points]
    return ()


def _partition_linkage(
    mechanism: Mechanism, request: SweepRequest
) -> tuple[PartitionedLinkage, list[str], float] | None:
    """A mechanism parted into groups, with the names of its points and where it starts; None where it is for the
    general path."""
    running = _running_input(mechanism, request.pair, "inputs")
    try:
        own = partition_mechanism(mechanism)
    except (NotPartitionable, BadInput, PointPlacementError):
        return None
    kinds = {pair.name: pair.input_kind for pair in mechanism.pairs}
    angles = [kinds[given.pair] is not Measure.LENGTH for given in mechanism.inputs]
    if not angles[running] or not all(
        group.block_type.has_closed_form or group.block_type.has_newton_formulas for group in own.blocks
    ):
        return None
    unit = own.unit
    inputs = [
        (given.position if angle else given.position / unit, angle, k == running, given.velocity, given.acceleration)
        for k, (given, angle) in enumerate(zip(mechanism.inputs, angles, strict=True))
    ]
    members = _point_members(mechanism, request.points)
    shown = (
        [] if all(group.block_type.has_closed_form for group in own.blocks) else _shown_points(mechanism, own, members)
    )
    sketch: list[tuple[float, ...]] = []
    for name, x, y in mechanism.sketch:
        if name not in members:
            return None
        place, link, point = min((own.link_index[link], link, point) for link, point in members[name])
        if place:
            at = own.shapes[link].points[point]
            sketch.append((place, at.x / unit, at.y / unit, x / unit, y / unit))
    names, points = [], []
    for name in _wanted_points(mechanism, members, request.points):
        place, link, point = min((own.link_index[link], link, point) for link, point in members[name])
        names.append(name)
        points.append((place, *own.shapes[link].points[point]))
    return PartitionedLinkage(own, inputs, sketch, points, shown), names, mechanism.inputs[running].position


def _shown_points(mechanism: Mechanism, partition: Partition, members: Mapping) -> list[tuple[float, ...]]:
    """Points of every link that the sketch shows, or that lie on the frame: see `LinkageArrays`."""
    at = {name: (x, y) for name, x, y in mechanism.sketch}
    found: list[tuple[float, ...]] = []
    for name, both in members.items():
        on = next((point for link, point in both if link == mechanism.frame), None)
        place = at.get(name) if on is None else partition.shapes[mechanism.frame].points[on]
        if place is not None:
            for link, point in both:
                if partition.link_index[link]:
                    local = partition.shapes[link].points[point]
                    found.append((partition.link_index[link], *(part / partition.unit for part in (*local, *place))))
    return found


def _point_members(mechanism: Mechanism, points: tuple[str, ...] | None) -> Mapping[str, Sequence[tuple[str, str]]]:
    """The (link, point) of named points: of all, or of those that pairs keep together where no other is asked for."""
    together: dict[str, list[tuple[str, str]]] = {}
    for pair in mechanism.pairs:
        own = pair.coincident_points()
        if own:
            together.setdefault(pair.entry_name(), []).extend(own)
    wanted = (*(points or ()), *(name for name, _, _ in mechanism.sketch))
    if points is not None and all(name in together for name in wanted):
        return together
    return {each.name: each.members for each in named_points(mechanism)}


def _wanted_points(
    mechanism: Mechanism, members: Mapping[str, Sequence[tuple[str, str]]], points: tuple[str, ...] | None
) -> list[str]:
    """The names of the points that are wanted of a mechanism."""
    if points is not None:
        return [name for name in points if name in members]
    return [name for name, own in members.items() if all(link != mechanism.frame for link, _ in own)]


def _cache_sized_chunks(
    link_counts: Array, remaining: Array, request: SweepRequest, refinement: int
) -> Iterator[Array]:
    """So many of what is left at a time that their places fit into memory near the processor."""
    each = (request.steps + 1) * refinement * 8 * (10 if request.rates else 4)
    ends = np.cumsum(link_counts[remaining] * each)
    first = 0
    while first < len(remaining):
        before = ends[first - 1] if first else 0
        last = max(int(np.searchsorted(ends, before + MAX_STATE_BYTES, side="right")), first + 1)
        yield remaining[first:last]
        first = last


def _step_division(steps: int) -> int:
    """Into how many a step is divided."""
    return ceil(FULL_TURN / steps / LONGEST_INPUT_STEP)


def _run_attempt(
    group: _LinkageGroup, some: Array, start: StartAssemblies, request: SweepRequest, attempt: _Attempt
) -> dict[int, Swept]:
    """Those that came to their end, or to a dead point, by their numbers."""
    steps, finer = request.steps, _step_division(request.steps) * attempt.refinement
    gone = np.linspace(0.0, FULL_TURN, steps * finer + 1)
    lot = group.arrays.select(some)
    told = run_linkages(
        lot,
        start,
        gone,
        FULL_TURN / (steps * finer),
        request.rates,
        request.native,
        attempt.polished,
        attempt.verdict_only,
    )
    orders = 3 if request.rates else 1
    out = told.out[:, :, : len(gone) : finer].reshape(len(told.out), orders, 2, steps + 1)
    if finer > 1:
        out = np.ascontiguousarray(out)
    out = out.transpose(0, 1, 3, 2)
    found, first = {}, 0
    grid = np.linspace(0.0, 1.0, steps + 1) * FULL_TURN
    solved = np.zeros(steps + 1, dtype=np.int8)
    solved.flags.writeable = False
    inputs = group.start[some][:, None] + grid
    come, dead = told.good_steps.tolist(), told.ends_in_dead_point.tolist()
    for k, one in enumerate(some.tolist()):
        names = group.names[one]
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
            near = group.start[one] + gone[good - 1 : good + 1]
            links = group.links_of_block(int(told.dead_point_block[k]))
            reason = f"links {links} come to a dead point at an input of {near[0]:.6g} to {near[1]:.6g} rad"
        parts = [PointMapping(names, own[:, order]) for order in range(orders)]
        position, velocity, acceleration = parts if request.rates else (parts[0], None, None)
        number = int(group.numbers[one])
        found[number] = Swept(position, velocity, acceleration, inputs[k], status, reason, False)
    return found


def _solve_with_general_path(mechanism: Mechanism, request: SweepRequest) -> Swept:
    """One mechanism, solved as a cycle of its own."""
    running = _running_input(mechanism, request.pair, "inputs")
    inputs = tuple(
        given._replace(law=None) if k == running else given._replace(velocity=0.0, acceleration=0.0, law=None)
        for k, given in enumerate(mechanism.inputs)
    )
    mechanism = replace(mechanism, inputs=inputs)
    pair = inputs[running].pair
    grid = None
    members = {each.name: each.members for each in named_points(mechanism)}
    names = tuple(_wanted_points(mechanism, members, request.points))
    if relative_motions(mechanism)[pair].input_kind is not Measure.LENGTH:
        grid = inputs[running].position + np.linspace(0.0, 1.0, request.steps + 1) * FULL_TURN
    ends = (None, None) if grid is None else (float(grid[0]), float(grid[-1]))
    told = solve_design(mechanism, pair, grid, request.steps, ends, names, request.rates)
    out = told.out.reshape(request.steps + 1, 3 if request.rates else 1, len(names), 2)
    parts = [{name: out[:, k, i] for i, name in enumerate(names)} for k in range(out.shape[1])]
    position, velocity, acceleration = parts if request.rates else (parts[0], None, None)
    return Swept(position, velocity, acceleration, told.input, told.status, told.message, True)
