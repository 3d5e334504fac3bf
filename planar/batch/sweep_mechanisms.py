"""A sweep over mechanisms of any structure: each through the same steps, none compiled by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from functools import partial
from operator import length_hint
from os import PathLike
from typing import overload

from numpy.typing import DTypeLike

from planar.batch.executor import in_order, run_tasks, thread_count
from planar.batch.general_path import OUTCOMES
from planar.batch.mechanisms.linkages import SweepRequest
from planar.batch.mechanisms.part_runs import solve_part
from planar.batch.mechanisms.pins import result_pins
from planar.batch.mechanisms.results import Each, SweptPart
from planar.batch.mechanisms.tape_runs import make_values
from planar.batch.reductions import (
    ReducedBlock,
    ReducedSweep,
    Reduction,
    join_blocks,
    read_reductions,
    reduce_all,
    result_type,
)
from planar.batch.results import LACKING_RATES, add_ending_counts
from planar.batch.sweep import warn_of_backend
from planar.document.files import as_mechanism
from planar.document.first_argument import MechanismSource
from planar.foundation.arrays import Array, part_offsets
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import interrupted, report_progress, returns_part_in_time, time_is_over
from planar.model.link_shapes import PointName
from planar.model.mechanism import Mechanism, running_input_index
from planar.model.pin_linkage import PinnedMechanism
from planar.model.pin_linkages import PinnedLinkages
from planar.model.run_arguments import check_steps
from planar.model.wording import count_phrase

PART_SIZE = 512
"""Number of mechanisms that a thread or an executor solves together."""
Part = list[Mechanism] | PinnedLinkages
_SolvedPart = tuple[SweptPart | ReducedBlock, int, set[PointName]]


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
    parts: Iterable[Part] = _read_parts(mechanisms, pair)
    count, functions = length_hint(mechanisms, 0), None
    if reduce is not None:
        reductions = read_reductions(reduce, str, step_count)
        for measure in reductions.measures:
            if not measure.is_of_point:
                raise BadInput("reduce", f"mechanisms tell points alone, not {measure.name}.{measure.quantity}")
        functions, (names, rates) = reductions.functions, reductions.with_points(names, rates)
    request = SweepRequest(step_count, names, rates, pair)
    values, first_rows = None, part_offsets([])
    if reduce is None:
        parts = list(parts)
        count = sum(map(len, parts))
        linkages = [part for part in parts if isinstance(part, PinnedLinkages)]
        if linkages and len(linkages) == len(parts) and executor is None:  # all points in one array
            first_rows = part_offsets([result_pins(part, names).first[-1] for part in linkages])
            values = make_values(int(first_rows[-1]), step_count, rates, number_type)

    started = 0

    def tasks() -> Iterator[tuple[int, Part]]:
        nonlocal started
        for part in parts:
            started += 1
            yield started - 1, part

    def solve_here(k: int, part: Part) -> _SolvedPart:
        target = None if values is None else values[first_rows[k] : first_rows[k + 1]]
        return _solve_part(part, request, number_type, functions, target)

    solve_there = partial(_solve_part, request=request, dtype=number_type, functions=functions)
    results: list[SweptPart | ReducedBlock] = []
    done, missing = 0, set(names or ())
    for result, part_count, present in in_order(run_tasks(threads, executor, solve_there, tasks(), solve_here)):
        results.append(result)
        missing -= present
        done += part_count
        report_progress(done, max(done, count))
        if progress is not None:
            progress(done, max(done, count))
    reason = time_is_over() if started > len(results) else ""
    if functions is not None and reason and not results:
        raise interrupted(reason, "before a mechanism was reduced")
    for name in names or ():
        if name in missing and done and not reason:
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")
    messages = _messages(results, done, reason)
    if functions is not None:
        blocks = [block for block in results if isinstance(block, ReducedBlock)]
        return ReducedSweep({}, *join_blocks(blocks), messages)
    swept = tuple(part for part in results if isinstance(part, SweptPart))
    positions, general = sum(part.general_positions for part in swept), sum(part.general_designs for part in swept)
    values = None if values is None else values[: first_rows[len(swept)]]
    return Each(swept, values, positions, general, messages, reason=reason)


def _solve_part(
    part: Part,
    request: SweepRequest,
    dtype: str,
    functions: Mapping[str, Reduction[Each]] | None,
    values: Array | None = None,
) -> _SolvedPart:
    """Solve some mechanisms, and reduce them if there are reductions: the result, how many mechanisms there are, and
    which of the points of the request are present."""
    solved = solve_part(part, request, dtype if functions is None else "float64", values)
    result: SweptPart | ReducedBlock = solved
    if functions is not None:
        counts = solved.general_positions, solved.general_designs
        reduced = reduce_all(Each((solved,), None, *counts, ()), functions, dtype)
        result = ReducedBlock(reduced, solved.last_status, *counts, solved.ending_counts)
    return result, len(solved), solved.present_points(request.points or ())


def _read_parts(sources: Iterable[MechanismSource | PinnedLinkages], pair: str | None) -> Iterator[Part]:
    """Yield mechanisms part by part, read when they are needed; each file or model once in a part. Raises BadInput."""
    if isinstance(sources, PinnedLinkages):
        sources = [sources]
    elif isinstance(sources, str | PathLike | Mechanism) or not isinstance(sources, Iterable):
        raise BadInput("mechanisms", f"a list of mechanisms is wanted, not {type(sources).__name__} {sources!r:.40}")
    done, waiting, files = 0, list[Mechanism](), dict[str | PathLike[str], Mechanism]()
    for source in sources:
        if isinstance(source, PinnedLinkages) and pair is None:
            if waiting:
                yield waiting
            yield from (source[k : k + PART_SIZE] for k in range(0, len(source), PART_SIZE))
            done, waiting = done + len(waiting) + len(source), []
            continue
        for item in source if isinstance(source, PinnedLinkages) else (source,):
            waiting.append(_read_mechanism(item, f"mechanisms[{done + len(waiting)}]", pair, files))
            if len(waiting) == PART_SIZE:
                yield waiting
                done, waiting = done + PART_SIZE, []
                files.clear()
    if waiting:
        yield waiting


def _read_mechanism(
    source: MechanismSource, place: str, pair: str | None, files: dict[str | PathLike[str], Mechanism]
) -> Mechanism:
    """A mechanism with an input that runs; `files` are those that have been read. Raises BadInput."""
    if isinstance(source, PinnedMechanism) and pair is None and source.layout is not None:
        return source
    if isinstance(source, str | PathLike):
        if source not in files:
            files[source] = as_mechanism(source)
        source = files[source]
    if not isinstance(source, Mechanism):
        raise BadInput(place, f"a mechanism is wanted, not {source!r:.40}")
    running_input_index(source, pair, place)
    return source


def _messages(results: Sequence[SweptPart | ReducedBlock], count: int, reason: str) -> tuple[str, ...]:
    """The messages about `count` mechanisms; `reason`: why the sweep ended early, empty where it did not."""
    messages = []
    if reason:
        messages.append(f"{reason} after {count_phrase(count, 'mechanism')}: the others are left out")
    general = sum(result.general_designs for result in results)
    if general:
        messages.append(f"the general path solved {general} of {count_phrase(count, 'mechanism')}, one after the other")
    totals = add_ending_counts(result.ending_counts for result in results)
    without_rates = totals.pop(0, None)
    messages += [
        f"{count_phrase(ended, 'mechanism')}: {OUTCOMES[code].value}; {first}"
        for code, (ended, first) in totals.items()
    ]
    if without_rates:
        ended, first = without_rates
        messages.append(f"{count_phrase(ended, 'mechanism')}: {LACKING_RATES}; {first}")
    return tuple(messages)
