"""A sweep over mechanisms of any structure: each through the same steps, none compiled by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import overload

import numpy as np
from numpy.typing import DTypeLike

from planar.batch.executor import in_order, run_tasks, thread_count
from planar.batch.general_path import solve_design
from planar.batch.mechanisms.linkage_runs import solve_by_blocks
from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.parts import (
    PART_SIZE,
    PartRuns,
    check_inputs,
    end_message,
    find_endings,
    part_messages,
    read_mechanisms,
)
from planar.batch.mechanisms.results import Each, Swept, SweptList, SweptPart
from planar.batch.mechanisms.tape_runs import FULL_TURN, make_values
from planar.batch.pinned.march import solve_pinned
from planar.batch.pinned.results import PinnedPart, join_parts
from planar.batch.pinned.tape import ToldPins, find_told_pins, pin_number
from planar.batch.reductions.reduced_sweep import ReducedSweep, Reduction, result_type, sweep_reduced
from planar.batch.sweep import warn_of_backend
from planar.document.first_argument import MechanismSource
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import returns_part_in_time, time_is_over
from planar.foundation.turns import take_turn
from planar.model.mechanism import Mechanism, named_points, relative_motions, running_input_index
from planar.model.pairs import MeasureKind as Measure
from planar.model.pin_linkage import PinnedMechanism
from planar.model.pin_linkages import PinnedLinkages
from planar.model.run_arguments import check_steps

Array = np.ndarray

LINKAGES_PART_SIZE = PART_SIZE
"""Linkages that are arrays already, and are handed on together."""


@overload
def sweep_each(  # many: the public signature
    mechanisms: Iterable[MechanismSource | PinnedLinkages],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    pair: str | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    dtype: DTypeLike = "float64",
    reduce: None = None,
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,
    backend: str | None = None,
) -> Each: ...
@overload
def sweep_each(  # many: the public signature
    mechanisms: Iterable[MechanismSource | PinnedLinkages],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    pair: str | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    dtype: DTypeLike = "float64",
    reduce: Mapping[str, str | Reduction[Each]],
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,
    backend: str | None = None,
) -> ReducedSweep: ...
@returns_part_in_time
def sweep_each(  # many: the public signature; # long: its docstring
    mechanisms: Iterable[MechanismSource | PinnedLinkages],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    pair: str | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    dtype: DTypeLike = "float64",
    reduce: Mapping[str, str | Reduction[Each]] | None = None,
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
    backend: str | None = None,
) -> Each | ReducedSweep:
    """The motions of mechanisms of any structure, each as `planar.sweep` would have it as a single design.

    `mechanisms` are mechanisms, files or names of models, or `planar.pinned_linkages`, of which none becomes an object
    of its own.

    Each runs from the assembly nearest to its sketch, at `steps` + 1 positions of its input (the only one, else the one
    at `pair`; the others stand still), a turn on from its own position; a slide runs between its limits. `points` are
    the names of those that are wanted, of every mechanism that has them; all that move, if left out. With `rates` their
    velocities and accelerations too.

    No mechanism is compiled by itself: it is parted into blocks of links, of kinds that many have in common, and runs
    as data. Single links and dyads are solved in closed form, blocks of up to eight links by Newton's method from step
    to step. To the general path, which is counted and said, fall mechanisms with wheels or racks, with links held more
    than once, with larger blocks, without a sketch that tells the assemblies of every block apart, with a slide as the
    input that runs, and those that come so near to where two assemblies meet that steps eight times finer do not show
    on which side they pass. A linkage that comes to a dead point has NaN from there on, and says so.

    Parts of the whole are solved in as many threads as there are cores for this process, or in so many `workers`; that
    changes no digit of the results. `executor`, any of `concurrent.futures`' kind, solves them elsewhere instead.
    `progress` is called with how many mechanisms are done, and how many there are, as far as that is known. `backend`
    is no longer needed.

    `dtype` "float32" halves the memory: each number is computed in double precision and rounded once. With `reduce` no
    positions are kept, only what is made of them part by part, by the names given: measures of points as
    `P7.path_length` (see `planar.sweep`), not a number where a mechanism has no such point, or functions that take an
    `Each` of some mechanisms and give an array with an entry for each. `mechanisms` may then be any iterable, of which
    only so many are taken at a time as are being solved, and may hold `planar.pinned_linkages` among the others; the
    result is a `ReducedSweep`.

    After `timeout` s, or a Ctrl-C, the result has the first mechanisms alone, and its `outcome` is "interrupted".

    Raises BadInput for what is no mechanism, a point that none has, an input that is not there, impossible steps.

    >>> import planar
    >>> planar.sweep_each(["four-bar", "slider-crank"], 12).general
    0
    """
    step_count, threads, number_type = check_steps(steps), thread_count(workers, executor), result_type(dtype)
    names = (points,) if isinstance(points, str) else None if points is None else tuple(dict.fromkeys(points))
    warn_of_backend(backend, "sweep_each", 4)
    wanted = SweepRequest(step_count, names, rates, pair)
    runs = PartRuns(threads, executor, number_type, progress)
    if reduce is not None:
        return sweep_reduced(mechanisms, wanted, runs, reduce, _solve_rounded)
    parts: list[SweptPart] = []
    if isinstance(mechanisms, PinnedLinkages) and pair is None:
        parts += _sweep_linkages(mechanisms, wanted, runs)
    else:
        mechanisms = read_mechanisms(mechanisms)
        parts += _sweep_list(mechanisms, wanted, runs)
    general = [each for part in parts for each in part.others if each.general]
    done = sum(map(len, parts))
    said = part_messages([find_endings(part) for part in parts], done, len(general))
    reason = time_is_over() if done < len(mechanisms) else ""
    positions = sum(int(np.sum(each.status == 0)) for each in general)
    return Each(tuple(parts), positions, len(general), (*end_message(done, reason), *said), reason=reason)


def _sweep_linkages(linkages: PinnedLinkages, request: SweepRequest, runs: PartRuns) -> Iterator[SweptPart]:
    """Linkages of pinned bars, many at a time: all their points in one array, or those of each part where an executor
    has solved it."""
    many = len(linkages)
    told = find_told_pins(linkages, request.points)
    for name in request.points or ():
        number = pin_number(name)
        if many and (number is None or number >= np.diff(linkages.first_pin).max()):
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")
    bounds = [(k, min(k + LINKAGES_PART_SIZE, many)) for k in range(0, many, LINKAGES_PART_SIZE)]
    tasks = ((k, linkages[a:b] if b - a < many else linkages) for k, (a, b) in enumerate(bounds))
    is_here = runs.executor is None
    values = make_values(len(told.pins), request.steps, request.rates, runs.dtype) if is_here else None

    def solve_here(k: int, part: PinnedLinkages) -> PinnedPart:
        a, b = bounds[k]
        own = told.select(linkages, a, b) if b - a < many else told
        room = None if values is None else values[told.first[a] : told.first[b]]
        return _solve_pinned_rounded(part, request, runs.dtype, own, room)

    solve_there = partial(_solve_pinned_rounded, request=request, dtype=runs.dtype)
    found: list[PinnedPart] = []
    for done in in_order(run_tasks(runs.threads, runs.executor, solve_there, tasks, solve_here)):
        found.append(done)
        runs.tell(sum(map(len, found)), many)
    if values is None:
        yield from found
    elif found:
        yield join_parts(found, values[: told.first[sum(map(len, found))]])


def _sweep_list(mechanisms: list[Mechanism], request: SweepRequest, runs: PartRuns) -> Iterator[SweptPart]:
    """Mechanisms of any kind, some at a time."""
    check_inputs(mechanisms, request.pair)
    solve_part = partial(_solve_rounded, request=request, dtype=runs.dtype)
    tasks = ((k, mechanisms[first : first + PART_SIZE]) for k, first in enumerate(range(0, len(mechanisms), PART_SIZE)))
    found = 0
    missing = set(request.points or ())
    for done in in_order(run_tasks(runs.threads, runs.executor, solve_part, tasks, lambda _, part: solve_part(part))):
        found += len(done)
        if missing:
            missing -= {name for k in range(len(done)) for name in done.swept(k).position}
        runs.tell(found, len(mechanisms))
        yield done
    for name in request.points or ():
        if name in missing and mechanisms and found == len(mechanisms):
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")


def _solve_rounded(part: list[Mechanism] | PinnedLinkages, request: SweepRequest, dtype: str) -> SweptPart:
    """Some mechanisms, their numbers rounded to a type."""
    if isinstance(part, PinnedLinkages):
        return _solve_pinned_rounded(part, request, dtype)
    solved = solve_mechanisms(part, request)
    return solved if dtype == "float64" else solved.astype(dtype)


def _solve_pinned_rounded(
    linkages: PinnedLinkages, request: SweepRequest, dtype: str, told: ToldPins | None = None, room: Array | None = None
) -> PinnedPart:
    """The same of linkages of pinned bars, written where there is `room`."""
    if dtype == "float64":
        return _solve_linkages(linkages, request, told, room)
    return _solve_linkages(linkages, request, told).astype(dtype, room)


def _solve_linkages(
    linkages: PinnedLinkages,
    request: SweepRequest,
    told: ToldPins | None = None,
    values: Array | None = None,
    mechanisms: Sequence[Mechanism] | None = None,
) -> PinnedPart:
    solve_blocks = partial(solve_partitioned, request=request)
    solve_general = partial(_solve_with_general_path, request=request)
    with take_turn():
        return solve_pinned(linkages, request, solve_blocks, solve_general, told, values, mechanisms)


def solve_mechanisms(mechanisms: Sequence[Mechanism], request: SweepRequest) -> SweptPart:
    """Some mechanisms, in their order."""
    with take_turn():
        return _solve_some(mechanisms, request)


def _solve_some(mechanisms: Sequence[Mechanism], request: SweepRequest) -> SweptPart:
    layouts = {
        k: each.layout
        for k, each in enumerate(mechanisms)
        if request.pair is None and isinstance(each, PinnedMechanism) and each.layout is not None and not each.stops
    }
    if not layouts:
        return SweptList(tuple(solve_partitioned(mechanisms, request)))
    if len(layouts) == len(mechanisms) == 1:
        kept = mechanisms[0].__dict__  # what is found of one linkage serves its next run
        if "_linkages" not in kept:
            kept["_linkages"] = PinnedLinkages.from_layouts(list(layouts.values()))
        return _solve_linkages(kept["_linkages"], request, mechanisms=mechanisms)
    own = [mechanisms[k] for k in layouts]
    pinned = _solve_linkages(PinnedLinkages.from_layouts(list(layouts.values())), request, mechanisms=own)
    if len(layouts) == len(mechanisms):
        return pinned
    found = {number: pinned.swept(k) for k, number in enumerate(layouts)}
    others = [k for k in range(len(mechanisms)) if k not in found]
    found |= zip(others, solve_partitioned([mechanisms[k] for k in others], request), strict=True)
    return SweptList(tuple(found[k] for k in range(len(mechanisms))))


def solve_partitioned(
    mechanisms: Sequence[Mechanism],
    request: SweepRequest,
    solve_general: Callable[[Mechanism, SweepRequest], Swept] | None = None,
) -> list[Swept]:
    """Some mechanisms, in their order, partitioned into blocks of links; what is left open by `solve_general`, the
    general path if that is left out."""
    solve_general = solve_general or _solve_with_general_path
    found = solve_by_blocks(mechanisms, request)
    return [found[k] if k in found else solve_general(mechanism, request) for k, mechanism in enumerate(mechanisms)]


def _solve_with_general_path(mechanism: Mechanism, request: SweepRequest) -> Swept:
    """One mechanism, solved as a cycle of its own."""
    running = running_input_index(mechanism, request.pair, "inputs")
    inputs = tuple(
        given._replace(law=None) if k == running else given._replace(velocity=0.0, acceleration=0.0, law=None)
        for k, given in enumerate(mechanism.inputs)
    )
    mechanism = replace(mechanism, inputs=inputs)
    pair = inputs[running].pair
    grid = None
    names = tuple(_result_points(mechanism, request.points))
    if relative_motions(mechanism)[pair].input_kind is not Measure.LENGTH:
        grid = inputs[running].position + np.linspace(0.0, 1.0, request.steps + 1) * FULL_TURN
    ends = (None, None) if grid is None else (float(grid[0]), float(grid[-1]))
    told = solve_design(mechanism, pair, grid, request.steps, ends, names, request.rates)
    out = told.out.reshape(request.steps + 1, 3 if request.rates else 1, len(names), 2)
    parts = [{name: out[:, k, i] for i, name in enumerate(names)} for k in range(out.shape[1])]
    position, velocity, acceleration = parts if request.rates else (parts[0], None, None)
    return Swept(position, velocity, acceleration, told.input, told.status, str(told.message or told.rate_remark), True)


def _result_points(mechanism: Mechanism, points: Sequence[str] | None) -> list[str]:
    """The names of the points that are results of a mechanism: those of `points` that it has, or all that move."""
    members = {name: {link for link, _ in at} for name, at in named_points(mechanism)}
    if points is not None:
        return [name for name in points if name in members]
    return [name for name, links in members.items() if mechanism.frame not in links]
