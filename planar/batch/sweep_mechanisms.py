"""A sweep over mechanisms of any structure: each through the same steps, none compiled by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from typing import overload

import numpy as np
from numpy.typing import DTypeLike

from planar.batch.executor import in_order, run_tasks, thread_count
from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.part_runs import solve_part
from planar.batch.mechanisms.parts import (
    PART_SIZE,
    PartRuns,
    check_inputs,
    end_message,
    find_endings,
    part_messages,
    read_mechanisms,
)
from planar.batch.mechanisms.pins import result_pins
from planar.batch.mechanisms.results import Each, SweptPart, join_parts
from planar.batch.mechanisms.tape_runs import make_values
from planar.batch.reductions.reduced_sweep import ReducedSweep, Reduction, result_type, sweep_reduced
from planar.batch.sweep import warn_of_backend
from planar.document.first_argument import MechanismSource
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import returns_part_in_time, time_is_over
from planar.model.mechanism import Mechanism
from planar.model.pin_linkages import PinnedLinkages
from planar.model.run_arguments import check_steps


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
    request = SweepRequest(step_count, names, rates, pair)
    runs = PartRuns(threads, executor, number_type, progress)
    if reduce is not None:
        return sweep_reduced(mechanisms, request, runs, reduce)
    if not isinstance(mechanisms, PinnedLinkages) or pair is not None:
        mechanisms = read_mechanisms(mechanisms)
        check_inputs(mechanisms, pair)
    parts = list(_sweep_parts(mechanisms, request, runs))
    general = [swept for part in parts for swept in part.general.values()]
    done = sum(map(len, parts))
    messages = part_messages([find_endings(part) for part in parts], done, len(general))
    reason = time_is_over() if done < len(mechanisms) else ""
    positions = sum(int(np.sum(swept.status == 0)) for swept in general)
    return Each(tuple(parts), positions, len(general), (*end_message(done, reason), *messages), reason=reason)


def _sweep_parts(
    mechanisms: list[Mechanism] | PinnedLinkages, request: SweepRequest, runs: PartRuns
) -> Iterator[SweptPart]:
    """Mechanisms part after part. Linkages that are arrays have all their points in one array, unless an executor has
    solved them."""
    count, values = len(mechanisms), None
    if isinstance(mechanisms, PinnedLinkages) and runs.executor is None:
        first = result_pins(mechanisms, request.points).first
        values = make_values(int(first[-1]), request.steps, request.rates, runs.dtype)
    bounds = [(k, min(k + PART_SIZE, count)) for k in range(0, count, PART_SIZE)]
    tasks = ((k, mechanisms[a:b] if b - a < count else mechanisms) for k, (a, b) in enumerate(bounds))

    def solve_here(k: int, part: list[Mechanism] | PinnedLinkages) -> SweptPart:
        a, b = bounds[k]
        return solve_part(part, request, runs.dtype, None if values is None else values[first[a] : first[b]])

    solve_there = partial(solve_part, request=request, dtype=runs.dtype)
    parts: list[SweptPart] = []
    done, missing = 0, set(request.points or ())
    for part in in_order(run_tasks(runs.threads, runs.executor, solve_there, tasks, solve_here)):
        parts.append(part)
        done += len(part)
        missing -= part.present_points(missing)
        runs.report(done, count)
    for name in request.points or ():
        if name in missing and count and done == count:
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")
    if values is None:
        yield from parts
    elif parts:
        yield join_parts(parts, values[: first[done]])
