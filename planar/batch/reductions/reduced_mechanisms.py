"""Reductions of mechanisms of any structure: of some at a time, and of all."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from operator import length_hint

import numpy as np

from planar.batch.executor import in_order, run_tasks
from planar.batch.mechanisms.linkage_groups import SweepRequest
from planar.batch.mechanisms.parts import PartRuns, end_message, find_endings, part_messages, stream_parts
from planar.batch.mechanisms.results import Each, SweptPart
from planar.batch.reductions.point_reductions import ResultReduction
from planar.batch.reductions.reduced_sweep import ReducedBlock, ReducedSweep, Reduction, read_reductions, reduce_all
from planar.document.first_argument import MechanismSource
from planar.foundation.errors import BadInput
from planar.foundation.time_limit import interrupted, time_is_over
from planar.model.mechanism import Mechanism
from planar.model.pin_linkages import PinnedLinkages

Array = np.ndarray
SolvePart = Callable[[list[Mechanism] | PinnedLinkages, SweepRequest, str], SweptPart]


def sweep_reduced(
    mechanisms: Iterable[MechanismSource | PinnedLinkages],
    request: SweepRequest,
    runs: PartRuns,
    reduce: Mapping[str, str | Reduction[Each]],
    solve: SolvePart,
) -> ReducedSweep:
    """Reductions alone of all mechanisms, of which only those are held that are being solved."""
    wanted = read_reductions(reduce, str, request.steps)
    for each in wanted.measures:
        if isinstance(each, ResultReduction):
            raise BadInput("reduce", f"mechanisms tell points alone, not {each.name}.{each.quantity}")
    points, rates = wanted.with_points(request.points, request.rates)
    request = request._replace(points=points, rates=rates)
    solve_part = partial(_solve_and_reduce, solve=solve, request=request, reductions=wanted.functions, dtype=runs.dtype)
    blocks: list[ReducedBlock] = []
    done, missing = 0, set(points or ())
    taken = 0

    def tasks() -> Iterator[tuple[int, list[Mechanism] | PinnedLinkages]]:
        nonlocal taken
        for part in stream_parts(mechanisms, request.pair):
            taken += 1
            yield taken - 1, part

    for block, there in in_order(
        run_tasks(runs.threads, runs.executor, solve_part, tasks(), lambda _, part: solve_part(part))
    ):
        blocks.append(block)
        missing -= there
        done += len(block.status)
        runs.tell(done, max(done, length_hint(mechanisms, 0)))
    reason = time_is_over() if taken > len(blocks) else ""
    if reason and not blocks:
        raise interrupted(reason, "before a mechanism was reduced")
    for name in points or ():
        if name in missing and done and not reason:
            raise BadInput("points", f"no mechanism has a point {name!r:.60}")
    sent = sum(block.general_designs for block in blocks)
    said = part_messages([block.endings for block in blocks], done, sent)
    return join_blocks(blocks, (*end_message(done, reason), *said))


def _solve_and_reduce(
    part: list[Mechanism] | PinnedLinkages,
    solve: SolvePart,
    request: SweepRequest,
    reductions: Mapping[str, Reduction[Each]],
    dtype: str,
) -> tuple[ReducedBlock, set[str]]:
    """Reductions of some mechanisms, and which of the points that are wanted are there."""
    solved = solve(part, request, "float64")
    there = {name for name in request.points or () if np.any(solved.point_rows(name) >= 0)}
    return reduce_part(solved, reductions, dtype), there


def reduce_part(part: SweptPart, reductions: Mapping[str, Reduction[Each]], dtype: str) -> ReducedBlock:
    """What is kept of some mechanisms."""
    general = [each for each in part.others if each.general]
    positions = sum(int(np.sum(each.status == 0)) for each in general)
    some = Each((part,), positions, len(general), ())
    return ReducedBlock(
        reduce_all(some, reductions, dtype), part.last_status, positions, len(general), find_endings(part)
    )


def join_blocks(blocks: Sequence[ReducedBlock], said: tuple[str, ...]) -> ReducedSweep:
    """The reductions of all mechanisms, part after part. Raises BadInput where they are not of one shape."""
    reduced = {}
    for name in tuple(blocks[0].reduced) if blocks else ():
        shapes = {block.reduced[name].shape[1:] for block in blocks}
        if len(shapes) > 1:
            raise BadInput(f"reduce.{name}", f"some mechanisms have an array {min(shapes)} each, others {max(shapes)}")
        reduced[name] = np.concatenate([block.reduced.pop(name) for block in blocks])
    status = np.concatenate([np.zeros(0, dtype=np.int8), *(block.status for block in blocks)])
    return ReducedSweep({}, reduced, status, sum(block.general_positions for block in blocks), said)
