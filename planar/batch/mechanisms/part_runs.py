"""Mechanisms of a part solved: pinned bars pin by pin, others block by block, what is left by the general path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from planar.batch.general_path import solve_design
from planar.batch.mechanisms.block_runs import run_blocks
from planar.batch.mechanisms.linkages import LinkageArrays, SweepRequest, make_linkage_arrays
from planar.batch.mechanisms.pins import pin_tape, result_pins, run_pins
from planar.batch.mechanisms.results import Endings, PointTable, Swept, SweptPart
from planar.batch.mechanisms.tape_runs import DEAD_POINT_NUMBER, FULL_TURN, PartRun, clear_points, make_values
from planar.foundation.arrays import Array, IntArray
from planar.foundation.turns import take_turn
from planar.model.mechanism import Mechanism, named_points, relative_motions, running_input_index
from planar.model.pairs import MeasureKind
from planar.model.pin_linkage import PinnedMechanism
from planar.model.pin_linkages import PinnedLinkages

Mechanisms = Sequence[Mechanism] | PinnedLinkages


def solve_part(
    mechanisms: Mechanisms,
    request: SweepRequest,
    dtype: str = "float64",
    values: Array | None = None,
    uses_general_path: bool = True,
) -> SweptPart:
    """Solve mechanisms, in their order; the numbers of their points are rounded to a type.

    The points of pinned bars alone are written to `values` if they are given. Without the general path what it would
    solve has no positions, and ends at its start.
    """
    with take_turn():
        if dtype == "float64":
            return _solve(mechanisms, request, values, uses_general_path)
        return _solve(mechanisms, request, None, uses_general_path).astype(dtype, values)


def _solve(mechanisms: Mechanisms, request: SweepRequest, values: Array | None, uses_general_path: bool) -> SweptPart:
    numbers, linkages = _pinned_linkages(mechanisms, request)
    is_open = np.ones(len(mechanisms), dtype=bool)
    pins = None
    if linkages is not None:
        pins = result_pins(linkages, request.points)
        is_open[numbers[pin_tape(linkages).linkages.which]] = False
    arrays = make_linkage_arrays({k: mechanisms[k] for k in np.flatnonzero(is_open).tolist()}, request.pair)
    if pins is not None and len(numbers) == len(mechanisms):
        points = pins
    else:
        points = _point_table(mechanisms, request, numbers, pins, arrays)
    if values is None:
        watched_count = 0 if arrays is None else len(arrays.watched_points.owner)
        values = make_values(int(points.first[-1]) + watched_count, request.steps, request.rates)

    run = PartRun.undecided(len(mechanisms))
    bars = np.zeros((len(mechanisms), 2), dtype=np.int64)
    start = np.zeros(len(mechanisms))
    if linkages is not None and pins is not None:
        rows = np.arange(len(pins.codes)) + np.repeat(points.first[numbers] - pins.first[:-1], np.diff(pins.first))
        run_pins(linkages, numbers, pins, rows, values, run, request.steps)
        tape, start[numbers] = pin_tape(linkages), linkages.crank_angles
        which = tape.linkages.which
        bars[numbers[which]] = tape.bars[run.block[numbers[which]]] - linkages.first_bar[which, None]
    if arrays is not None:
        run_blocks(arrays, points, values, run, request)
        start[arrays.which] = arrays.start

    undecided = np.flatnonzero(~run.is_decided)
    run.solved[undecided], run.outcome[undecided] = 0, DEAD_POINT_NUMBER
    stopped = np.flatnonzero(run.solved <= request.steps)
    clear_points(values, points.first, stopped, run.solved[stopped])
    general = {}
    for k in undecided.tolist() if uses_general_path else ():
        general[k] = swept = _solve_by_general_path(mechanisms[k], points.names(k), request)
        orders = [order for order in (swept.position, swept.velocity, swept.acceleration) if order is not None]
        for row, name in enumerate(points.names(k), points.first[k]):
            for order, of_points in enumerate(orders):
                values[row, 2 * order : 2 * order + 2, : request.steps + 1] = of_points[name].T
    endings = Endings(start, run.solved, run.outcome, bars, run.near, run.reasons)
    return SweptPart(values[: points.first[-1]], request.steps, points, endings, general)


def _pinned_linkages(mechanisms: Mechanisms, request: SweepRequest) -> tuple[IntArray, PinnedLinkages | None]:
    """Those of the mechanisms that are pinned bars, their numbers and as arrays."""
    if isinstance(mechanisms, PinnedLinkages):
        return np.arange(len(mechanisms)), mechanisms
    layouts = {
        k: each.layout
        for k, each in enumerate(mechanisms)
        if request.pair is None and isinstance(each, PinnedMechanism) and each.layout is not None and not each.stops
    }
    if not layouts:
        return np.arange(0), None
    if len(mechanisms) > 1:
        return np.array(list(layouts)), PinnedLinkages.from_layouts(list(layouts.values()))
    cached = mechanisms[0].__dict__  # the tape of one linkage serves its next run
    if "_linkages" not in cached:
        cached["_linkages"] = PinnedLinkages.from_layouts(list(layouts.values()))
    return np.arange(1), cached["_linkages"]


def _point_table(
    mechanisms: Mechanisms,
    request: SweepRequest,
    numbers: IntArray,
    pins: PointTable | None,
    arrays: LinkageArrays | None,
) -> PointTable:
    """The points of all mechanisms: pins of those of these numbers, of others those named in the request, or all that
    move."""
    names: dict[int, Sequence[str]] = {}
    if pins is not None:
        names |= {k: pins.names(row) for row, k in enumerate(numbers.tolist())}
    if arrays is not None:
        for k, structure in zip(arrays.which.tolist(), arrays.structures, strict=True):
            if request.points is None:
                names.setdefault(k, structure.moving_points)
            else:
                names.setdefault(k, [name for name in request.points if name in structure.members])
    for k in range(len(mechanisms)):
        if k not in names:
            names[k] = _result_points(mechanisms[k], request.points)
    return PointTable.of_names([names[k] for k in range(len(mechanisms))])


def _result_points(mechanism: Mechanism, points: Sequence[str] | None) -> list[str]:
    """The names of the points that are results of a mechanism: those of `points` that it has, or all that move."""
    links = {name: {link for link, _ in members} for name, members in named_points(mechanism)}
    if points is not None:
        return [name for name in points if name in links]
    return [name for name in links if mechanism.frame not in links[name]]


def _solve_by_general_path(mechanism: Mechanism, names: Sequence[str], request: SweepRequest) -> Swept:
    """One mechanism as a cycle of its own."""
    running = running_input_index(mechanism, request.pair, "inputs")
    inputs = tuple(
        given._replace(law=None) if k == running else given._replace(velocity=0.0, acceleration=0.0, law=None)
        for k, given in enumerate(mechanism.inputs)
    )
    mechanism = replace(mechanism, inputs=inputs)
    pair, grid = inputs[running].pair, None
    if relative_motions(mechanism)[pair].input_kind is not MeasureKind.LENGTH:
        grid = inputs[running].position + np.linspace(0.0, 1.0, request.steps + 1) * FULL_TURN
    ends = (None, None) if grid is None else (float(grid[0]), float(grid[-1]))
    solved = solve_design(mechanism, pair, grid, request.steps, ends, tuple(names), request.rates)
    orders = solved.out.reshape(request.steps + 1, 3 if request.rates else 1, len(names), 2)
    by_name = [{name: orders[:, k, i] for i, name in enumerate(names)} for k in range(orders.shape[1])]
    position, velocity, acceleration = by_name if request.rates else (by_name[0], None, None)
    reason = str(solved.message or solved.rate_remark)
    return Swept(position, velocity, acceleration, solved.input, solved.status, reason, True)
