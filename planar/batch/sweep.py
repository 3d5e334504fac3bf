"""A sweep: one mechanism in many designs, each through the same steps."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from math import ceil
from numbers import Integral
from pathlib import Path
from typing import Any, overload

import numpy as np
from numpy.typing import DTypeLike

from planar.batch.assembly.assembly_lists import list_assemblies
from planar.batch.block import DesignBlock
from planar.batch.design_arrays import read_designs, split_into_blocks
from planar.batch.executor import TASKS_PER_WORKER, run_tasks, thread_count, worker_count
from planar.batch.named_results.design_forces import output_link
from planar.batch.named_results.design_slopes import design_slopes
from planar.batch.named_results.result_block import ResultBlock, solve_result_block
from planar.batch.named_results.result_rows import RequestedResults, select_names
from planar.batch.reductions import (
    ReducedSweep,
    Reduction,
    Reductions,
    ReductionStore,
    read_reductions,
    reduce_block,
    result_type,
)
from planar.batch.reference_design import ReferenceDesign, reference_design
from planar.batch.results import Sweep
from planar.batch.stores.store import BlockStore, SweepPlan, open_store
from planar.document.first_argument import takes_mechanism
from planar.dynamics.load_validation import check_loads
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import report_progress, returns_part_in_time, time_is_over
from planar.model.link_shapes import PointName
from planar.model.mechanism import LARGEST_COUNTED_ANGLE, Mechanism
from planar.model.run_arguments import check_number, check_steps
from planar.solving.cycle import MAX_DURATION
from planar.solving.position import solved_mechanism

MIN_BLOCK_POSITIONS, MAX_BLOCK_POSITIONS = 2**20, 2**22
"""Positions of a block at least, where there are as many: so many that solving them is more than beginning it."""
USUAL_BLOCKS = 12
"""Blocks into which designs are divided between these: as many for two, three, four or six cores."""
MAX_BLOCK_BYTES = {"memory": 256 * 2**20, "store": 64 * 2**20, "reduced": 16 * 2**20}
"""Bytes of a block's results: solved where they stay; kept until they are written; only reduced, where no page of
memory is new."""
MAX_EXECUTOR_BLOCK_BYTES = 128 * 2**20
"""Bytes of the results of a block that is solved elsewhere."""
BLOCK_MULTIPLE = 16
"""Blocks are multiples of so many designs, where there are enough."""


@overload
@takes_mechanism
def sweep(  # many: the public signature
    mechanism: Mechanism,
    designs: Mapping[str, Any],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    links: Sequence[str] | str = (),
    pairs: Sequence[str] | str = (),
    outputs: Sequence[str] | str = (),
    efforts: Sequence[str] | str = (),
    reactions: Sequence[str] | str = (),
    derivatives: Sequence[str] | str = (),
    assemblies: str = "nearest",
    rates: bool = True,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
    duration: float | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    block: int | None = None,
    store: str | Path | None = None,
    dtype: DTypeLike = "float64",
    reduce: None = None,
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,
    backend: str | None = None,
) -> Sweep: ...
@overload
@takes_mechanism
def sweep(  # many: the public signature
    mechanism: Mechanism,
    designs: Mapping[str, Any],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    links: Sequence[str] | str = (),
    pairs: Sequence[str] | str = (),
    outputs: Sequence[str] | str = (),
    efforts: Sequence[str] | str = (),
    reactions: Sequence[str] | str = (),
    derivatives: Sequence[str] | str = (),
    assemblies: str = "nearest",
    rates: bool = True,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
    duration: float | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    block: int | None = None,
    store: None = None,
    dtype: DTypeLike = "float64",
    reduce: Mapping[str, str | Reduction[Sweep]],
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,
    backend: str | None = None,
) -> ReducedSweep: ...
@takes_mechanism
@returns_part_in_time
def sweep(  # many: the public signature; # long: its docstring
    mechanism: Mechanism,
    designs: Mapping[str, Any],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    links: Sequence[str] | str = (),
    pairs: Sequence[str] | str = (),
    outputs: Sequence[str] | str = (),
    efforts: Sequence[str] | str = (),
    reactions: Sequence[str] | str = (),
    derivatives: Sequence[str] | str = (),
    assemblies: str = "nearest",
    rates: bool = True,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
    duration: float | None = None,
    workers: int | None = None,
    executor: Executor | None = None,
    block: int | None = None,
    store: str | Path | None = None,
    dtype: DTypeLike = "float64",
    reduce: Mapping[str, str | Reduction[Sweep]] | None = None,
    progress: Callable[[int, int], object] | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
    backend: str | None = None,
) -> Sweep | ReducedSweep:
    """The motions of many designs of one mechanism, which differ in any numbers of its file.

    `designs` maps names to arrays, all of one length, or single numbers (SI: m, rad, per s): `BC.length`, `A.position`,
    `BC.E.angle`, `wheels.ratio`, `stroke.line.angle`; the names are those of `planar.dimensions`. Each design is
    solved as `planar.cycle` would solve the mechanism so changed: from the assembly nearest to the sketch, at `steps`
    + 1 positions of one input from `start` to `stop` (rad or m), the others standing still. An angle runs from its
    own position a turn on where they are left out; a slide without a `stop` runs between its limits, each design
    between its own.

    With a `duration` (s), or where an input has a law and no range is given, each design runs in time instead, as
    `planar.cycle` does: all its inputs at once, by their laws or at their rates, over the duration or the mechanism's
    longest law.

    `points` are those whose positions are wanted, and with `rates` velocities and accelerations; all that move, if left
    out and nothing else is asked for. `links` and `pairs` are those whose angles and relative motions are wanted, with
    `rates` their rates too; `outputs` links or pairs at the frame whose transmission angles are; `efforts` inputs and
    `reactions` pairs whose forces are, under loads, weights, springs and inertia: see `Sweep`. A design that comes to a
    dead point or a stop has NaN from there on, `status` says why, `Sweep.dead_point` or `Sweep.stop_position` where.
    `derivatives` names numbers of the file by which positions, angles and relative motions are derived, and their
    rates, as `planar.sensitivity` has them: "BC.length" gives `Sweep.derivatives["position of E by BC.length"]`.

    `assemblies` "nearest" takes of each design that nearest to the sketch; "all" takes every assembly that it has at
    its own inputs, each as a design of its own: see `Sweep.assembly`.

    Designs run as compiled machine code; what that cannot do, or its checks do not let pass, the general path does,
    which is counted and said. `backend` is no longer needed.

    Blocks of designs are solved in as many threads as there are cores for this process, or in so many `workers`; that
    changes no digit of the results. `executor`, any of `concurrent.futures`' kind, solves them elsewhere instead; a
    block that is lost there is tried again, then solved here. `block` is how many designs are solved together. `store`,
    a path ending in .zarr or .parquet, takes the results block by block, with checksums, into a folder of its own; the
    same sweep into the same store goes on with the blocks that are missing or damaged. `progress` is called with how
    many designs are done, and how many there are.

    `dtype` "float32" halves the memory: each number is computed in double precision and rounded when it is written.
    With `reduce` no positions are kept, only what is made of every block as it comes, by the names given. Measures have
    names as `C.path_length`: of points x_extremes, y_extremes, bounding_box (least x and y, greatest x and y),
    speed_extremes and acceleration_extremes over the positions that are solved, path_length of designs solved at every
    step, enclosed_area and fourier_descriptors of those whose path is closed; of links, pairs and inputs the extremes
    of any other result, as `BC.angle_extremes` or `A.effort_extremes`. Or they are functions that take a `Sweep` of a
    block's designs and give an array with an entry for each. Only what measures need is then solved, and the result is
    a `ReducedSweep`; not a number stands where a measure has nothing to go by.

    After `timeout` s, or a Ctrl-C, designs that are not solved have NaN and the status "interrupted"; where a store has
    the others NoAnswer is raised, and the same sweep goes on.

    Raises BadInput for a name that is not there, a range or a store that cannot be; WriteFailure, which is one, where a
    store finds no more room.

    >>> import planar
    >>> swept = planar.sweep(planar.load("four-bar"), {"BC.length": [0.066, 0.07]}, 12, "C")
    >>> swept.position["C"].shape
    (2, 13, 2)
    """
    if block is not None and (isinstance(block, bool) or not isinstance(block, Integral) or block < 1):
        raise BadInput("block", f"a whole number of designs is wanted, not {block!r:.40}")
    check_steps(steps)
    duration = run_duration(mechanism, duration, (start, stop, pair))
    mechanism = check_range(mechanism, steps, start, stop, pair) if duration is None else mechanism
    values = read_designs(mechanism, designs)
    threads, number_type = thread_count(workers, executor), result_type(dtype)
    common = reference_design(mechanism, pair, duration is not None)
    if reduce is not None and store is not None:
        raise BadInput("store", "a store keeps all results, and reductions are kept in memory; leave out one of them")
    reductions = None if reduce is None else read_reductions(reduce, common.result_name, steps)
    asked = {"links": links, "pairs": pairs, "outputs": outputs, "efforts": efforts, "reactions": reactions}
    wanted = asked if reductions is None else reductions.with_results(asked)
    results = _select_results(common, wanted, duration is not None)
    names: tuple[PointName, ...] = () if points is None and any(results) else common.select_points(points)
    if derivatives:
        results = _with_derivatives(common, results, names, derivatives, rates)
    if reductions is not None:
        reduced_names, rates = reductions.with_points(names, rates)
        names = reduced_names or ()
    warn_of_backend(backend, "sweep", 5)
    if assemblies not in ("nearest", "all"):
        raise BadInput("assemblies", f"choose from nearest, all; there is no {assemblies!r:.40}")
    listed = list_assemblies(common, values) if assemblies == "all" else None
    if listed is not None:
        values = {name: array[listed.design] for name, array in values.items()}
    z = listed and listed.z
    all_designs = DesignBlock(mechanism, values, int(steps), names, rates, start, stop, pair, z, number_type, duration)
    kind = "reduced" if reduce is not None else "store" if store is not None or any(results) else "memory"
    width = len(names) + 2 * len(mechanism.links) * any(results)
    width += len(results.derivatives) * (len(names) + len(results.links) + len(results.pairs))
    size = int(block) if block is not None else _block_size(all_designs, width, executor, kind)
    plan = SweepPlan(all_designs, size, results, listed)
    into = open_store(store, plan) if reductions is None else ReductionStore(plan)
    for done in _solve_blocks(into, threads, executor, reductions):
        report_progress(done, all_designs.design_count)
        if progress is not None:
            progress(done, all_designs.design_count)
    result: Sweep | ReducedSweep = into.result()
    return result


def _solve_blocks(
    into: BlockStore, threads: int, executor: Executor | None, reductions: Reductions | None
) -> Iterator[int]:
    """Solve the blocks that are not there yet, and write them; how many designs are done after each."""
    plan = into.plan
    parts = list(split_into_blocks(plan.design_count, plan.block_size))
    all_designs = plan.all_designs
    missing = {k: part for k, part in enumerate(parts) if k not in into.finished}
    ready = plan.design_count - sum(part.stop - part.start for part in missing.values())
    if ready:
        yield ready

    def task(part: slice) -> ResultBlock:
        return ResultBlock(all_designs.select(part), plan.results)

    def solve_here(number: int, block: ResultBlock) -> Any:
        if reductions is not None:
            return reduce_block(block, reductions.functions)
        return solve_result_block(block, into.output_array(parts[number]))

    tasks = ((k, task(part)) for k, part in [*missing.items()])
    solve = solve_result_block if reductions is None else partial(reduce_block, reductions=reductions.functions)
    for k, done in run_tasks(min(threads, len(parts)), executor, solve, tasks, solve_here):
        if not into.takes(done):
            continue
        into.write_block(k, parts[k], done)
        missing.pop(k)
        ready += parts[k].stop - parts[k].start
        yield ready
    if missing:
        into.leave_out(missing, time_is_over())


def warn_of_backend(backend: str | None, function: str, stacklevel: int) -> None:
    """Say that an argument of earlier versions is no longer needed, where it is given."""
    if backend is not None:
        told = f"{function}: every run is compiled now; leave out the argument 'backend'"
        warnings.warn(told, DeprecationWarning, stacklevel)


def check_range(mechanism: Mechanism, steps: object, start: object, stop: object, pair: str | None) -> Mechanism:
    """The mechanism with inputs that run over a range at their own rates, whatever their laws. Raises BadInput."""
    check_steps(steps)
    check_number("start", start, LARGEST_COUNTED_ANGLE)
    check_number("stop", stop, LARGEST_COUNTED_ANGLE)
    lawful = [given.pair for given in mechanism.inputs if given.law is not None]
    if lawful and start is None and stop is None and pair is None:
        told = f"the input at {lawful[0]!r} has a law of time, which is not run here; give it a start and a stop"
        raise BadInput("designs", told)
    if not lawful:  # the same, of which more is known already
        return mechanism
    return replace(mechanism, inputs=tuple(given._replace(law=None) for given in mechanism.inputs))


def run_duration(mechanism: Mechanism, duration: float | None, range_: tuple[object, object, object]) -> float | None:
    """How long (s) a run in time takes, as of `cycle`; None where one input runs over a range. Raises BadInput."""
    check_number("duration", duration, MAX_DURATION, "s")
    laws = [given.law.duration for given in mechanism.inputs if given.law is not None]
    ranged = any(each is not None for each in range_)
    if duration is None:
        return max(laws) if laws and not ranged else None
    if not duration > 0.0:
        raise BadInput("duration", f"a time from zero on is wanted, not {duration!r:.40}")
    if not mechanism.inputs:
        solved_mechanism(mechanism).check_motion()
    if ranged:
        raise BadInput("duration", "a run in time has no range of one input; give the one or the other")
    return float(duration)


def _select_results(
    common: ReferenceDesign, asked: Mapping[str, Sequence[str] | str], is_timed: bool
) -> RequestedResults:
    """The results that are wanted beside those of points, by names. Raises BadInput."""
    mechanism = common.mechanism
    known = {
        "links": [link.name for link in mechanism.links if link.name != mechanism.frame],
        "pairs": list(common.motions),
        "outputs": [link.name for link in mechanism.links] + list(common.motions),
        "efforts": [given.pair for given in mechanism.inputs],
        "reactions": [pair.name for pair in mechanism.pairs],
    }
    results = RequestedResults(**{word: select_names(word, names, known[word]) for word, names in asked.items()})
    for output in results.outputs:
        output_link(mechanism, output)
    if results.has_forces:
        check_loads(mechanism)
        if not is_timed and any(load.varies is not None and load.varies.input is None for load in mechanism.loads):
            raise BadInput("loads", "a load varies with time, which this sweep has not; give it a duration")
    return results


def _with_derivatives(
    common: ReferenceDesign,
    results: RequestedResults,
    points: tuple[PointName, ...],
    derivatives: Sequence[str] | str,
    rates: bool,
) -> RequestedResults:
    """The results with derivatives in these numbers. Raises BadInput."""
    given = (derivatives,) if isinstance(derivatives, str) else tuple(dict.fromkeys(derivatives))
    found = results._replace(derivatives=given, derived_points=tuple(str(each) for each in points))
    design_slopes(common, found, rates)  # refuses what it does not tell
    return found


def _block_size(designs: DesignBlock, width: int, executor: Executor | None, kind: str) -> int:
    """How many designs make a block of so many points, `kind` as in MAX_BLOCK_BYTES; in threads that depends on the
    work alone, so that results do."""
    count, positions = designs.design_count, designs.steps + 1
    itemsize = 8 if kind == "reduced" else np.dtype(designs.dtype).itemsize
    design_bytes = positions * 2 * max(width, 1) * (3 if designs.rates else 1) * itemsize
    if executor is not None:
        size = min(MAX_EXECUTOR_BLOCK_BYTES // design_bytes, ceil(count / (TASKS_PER_WORKER * worker_count(executor))))
    else:
        minimum, maximum = MIN_BLOCK_POSITIONS // positions, MAX_BLOCK_POSITIONS // positions
        size = max(1, min(max(ceil(count / USUAL_BLOCKS), minimum), maximum, MAX_BLOCK_BYTES[kind] // design_bytes))
        size = ceil(count / ceil(count / size))
    return min(count, ceil(max(1, size) / BLOCK_MULTIPLE) * BLOCK_MULTIPLE)
