"""A sweep: one mechanism in many designs, each through the same steps."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from dataclasses import replace
from math import ceil
from numbers import Integral, Real
from pathlib import Path
from typing import Any

from planar.batch.block import DesignBlock, SolvedDesigns, solve_design_block
from planar.batch.design_arrays import read_designs, split_into_blocks
from planar.batch.march.choice import available_runners
from planar.batch.reference_design import reference_design
from planar.batch.results import Sweep
from planar.batch.stores.store import SweepPlan, open_store
from planar.foundation.errors import BadInput
from planar.model.mechanism import LARGEST_INPUT_POSITION, Mechanism
from planar.solving.cycle import MAX_STEPS

MAX_BLOCK_BYTES = 128 * 2**20
"""Bytes of a block's results."""
BLOCK_MULTIPLE = 16
"""Blocks are multiples of so many designs, where there are enough."""
MAX_EXECUTOR_TRIES = 2
"""How often a block is given to an executor before it is solved here."""
BLOCKS_PER_WORKER = 2
"""Blocks in the hands of an executor for each of its workers."""


def sweep(
    mechanism: Mechanism,
    designs: Mapping[str, Any],
    steps: int = 200,
    points: Sequence[str] | str | None = None,
    *,
    rates: bool = True,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
    backend: str = "auto",
    executor: Executor | None = None,
    block: int | None = None,
    store: str | Path | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Sweep:
    """The motions of many designs of one mechanism, which differ in dimensions of links or in their inputs.

    `designs` maps names to arrays, all of one length, or single numbers (m, rad, per s): `BC.length`, `A.position`,
    `BC.E.distance`; the dimensions have the names that `planar.model.dimensions` gives them, an input has `.position`,
    `.velocity` and `.acceleration`. Each design is solved as `planar.cycle` would solve the mechanism so changed: from
    the assembly nearest to the sketch, at `steps` + 1 positions of one input from `start` to `stop` (rad or m), the
    others standing still. An angle runs from the design's own position a turn on where they are left out; a slide
    without a `stop` runs between its limits, each design between its own.

    `points` are those whose positions are wanted, and with `rates` velocities and accelerations; all that move, if left
    out. A design that comes to a dead point has NaN from there on, and `status` says why.

    `backend` "native" runs compiled machine code, "casadi" is always there, "auto" takes the faster that is there. What
    a backend cannot do, or its gate does not let pass, the general path does, which is counted and said.

    `executor`, any of `concurrent.futures`' kind, solves the blocks elsewhere; a block that is lost there is tried
    again, then solved here. `block` is how many designs are solved together. `store`, a path ending in .zarr or
    .parquet, takes the results block by block, with checksums, into a folder of its own; the same sweep into the same
    store goes on with the blocks that are missing or damaged. `progress` is called with how many designs are done, and
    how many there are.

    Raises BadInput for a name that is not there, a range or a store that cannot be; WriteFailure, which is one, where a
    store finds no more room.
    """
    values = read_designs(mechanism, designs)
    if block is not None and (isinstance(block, bool) or not isinstance(block, Integral) or block < 1):
        raise BadInput("block", f"a whole number of designs is wanted, not {block!r:.40}")
    mechanism = check_range(mechanism, steps, start, stop, pair)
    common = reference_design(mechanism, pair)
    names = common.select_points(points)
    available_runners(backend)
    many = len(next(iter(values.values())))
    size = int(block) if block is not None else _block_size(many, steps, len(names), rates, executor)
    whole = DesignBlock(mechanism, values, int(steps), names, rates, start, stop, pair, backend)
    into = open_store(store, SweepPlan(whole, size))
    size = into.block_size

    def task(part: slice) -> DesignBlock:
        return whole._replace(designs={name: array[part] for name, array in values.items()})

    parts = dict(enumerate(split_into_blocks(many, size)))
    ready = sum(part.stop - part.start for k, part in parts.items() if k in into.finished)
    if progress is not None and ready:
        progress(ready, many)
    todo = {k: part for k, part in parts.items() if k not in into.finished}
    for k, done in _solve_blocks(
        {k: task(part) for k, part in todo.items()}, executor, lambda k: into.output_array(parts[k])
    ):
        into.write_block(k, parts[k], done)
        ready += parts[k].stop - parts[k].start
        if progress is not None:
            progress(ready, many)
    return into.result()


def check_range(mechanism: Mechanism, steps: object, start: object, stop: object, pair: str | None) -> Mechanism:
    """The mechanism with inputs that run over a range at their own rates, whatever their laws. Raises BadInput."""
    if isinstance(steps, bool) or not isinstance(steps, Integral) or not 1 <= steps <= MAX_STEPS:
        raise BadInput("steps", f"a whole number of steps from 1 to {MAX_STEPS} is wanted, not {steps!r:.40}")
    for name, value in (("start", start), ("stop", stop)):
        wrong = isinstance(value, bool) or not isinstance(value, Real) or not abs(value) <= LARGEST_INPUT_POSITION
        if value is not None and wrong:
            raise BadInput(name, f"a number up to {LARGEST_INPUT_POSITION:g} (rad or m) is wanted, not {value!r:.40}")
    lawful = [given.pair for given in mechanism.inputs if given.law is not None]
    if lawful and start is None and stop is None and pair is None:
        told = f"the input at {lawful[0]!r} has a law of time, which a sweep does not run; give it a start and a stop"
        raise BadInput("designs", told)
    return replace(mechanism, inputs=tuple(given._replace(law=None) for given in mechanism.inputs))


def _block_size(many: int, steps: int, points: int, rates: bool, executor: Executor | None) -> int:
    """How many designs make a block."""
    each = (steps + 1) * 2 * max(points, 1) * (3 if rates else 1) * 8
    size = max(1, MAX_BLOCK_BYTES // each)
    if executor is not None:
        size = min(size, ceil(many / (BLOCKS_PER_WORKER * _worker_count(executor))))
    return min(many, ceil(size / BLOCK_MULTIPLE) * BLOCK_MULTIPLE)


def _worker_count(executor: Executor) -> int:
    return max(1, getattr(executor, "_max_workers", None) or os.cpu_count() or 1)


def _solve_blocks(
    tasks: Mapping[int, DesignBlock], executor: Executor | None, output_array: Callable[[int], Any]
) -> Iterator[tuple[int, SolvedDesigns]]:
    """The blocks as they are solved, here, each in its room, or by an executor; each by its number."""
    if executor is None:
        for k, task in tasks.items():
            yield k, solve_design_block(task, output_array(k))
        return
    waiting, tries = list(tasks)[::-1], dict.fromkeys(tasks, 0)
    running: dict[Future, int] = {}
    most = BLOCKS_PER_WORKER * _worker_count(executor)
    try:
        while waiting or running:
            while waiting and len(running) < most:
                k = waiting.pop()
                future = _submit(executor, tasks[k]) if tries[k] < MAX_EXECUTOR_TRIES else None
                tries[k] += 1
                if future is None:
                    yield k, solve_design_block(tasks[k])
                else:
                    running[future] = k
            for future in wait(running, return_when=FIRST_COMPLETED).done if running else ():
                k = running.pop(future)
                problem = future.exception() if not future.cancelled() else None
                if isinstance(problem, BadInput):
                    raise problem
                if future.cancelled() or problem is not None:
                    waiting.append(k)
                else:
                    yield k, future.result()
    finally:
        for future in running:
            future.cancel()


def _submit(executor: Executor, task: DesignBlock) -> Future | None:
    """The block in the executor's hands; None where it takes no more, as when its workers have been killed."""
    try:
        return executor.submit(solve_design_block, task)
    except Exception:  # whatever an executor raises, the block can be solved here
        return None
