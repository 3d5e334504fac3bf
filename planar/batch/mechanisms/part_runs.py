"""Mechanisms of a part solved: pinned bars pin by pin, others block by block, what is left by the general path."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from planar.batch.general_path import SolvedDesign, solve_design
from planar.batch.mechanisms.block_runs import run_blocks
from planar.batch.mechanisms.initial_assembly import LinkageAssemblies, find_linkage_assemblies
from planar.batch.mechanisms.linkages import LinkageArrays, SweepRequest, make_linkage_arrays
from planar.batch.mechanisms.pins import make_pin_tape, result_pins, run_pins
from planar.batch.mechanisms.results import PointTable, SweptPart
from planar.batch.mechanisms.tape_runs import (
    DEAD_POINT_NUMBER,
    FULL_TURN,
    Endings,
    TapedLinkages,
    clear_points,
    make_values,
)
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
        part = _solve(mechanisms, request, None, uses_general_path)
        values = np.empty(part.values.shape, dtype) if values is None else values
        with np.errstate(over="ignore", invalid="ignore"):  # numbers behind the last step are arbitrary
            values[...] = part.values
        return replace(part, values=values)


class _PreparedPart(NamedTuple):
    """What is known of the mechanisms of a part before they run: the numbers of those that are pinned bars, these as
    arrays, and the tape of those that are solved pin by pin; those that are solved block by block, and their
    assemblies."""

    pinned: IntArray
    linkages: PinnedLinkages | None
    pin_tape: TapedLinkages | None
    arrays: LinkageArrays | None
    assemblies: LinkageAssemblies | None


def _prepare(mechanisms: Mechanisms, pair: str | None) -> _PreparedPart:
    """Prepare a part with the input that runs at `pair`, once for linkages that are arrays, or a mechanism alone."""
    pinned, linkages, pin_tape, assemblies = np.arange(len(mechanisms)), None, None, None
    owner: Any = mechanisms if isinstance(mechanisms, PinnedLinkages) else mechanisms[0]
    prepared: dict[str | None, _PreparedPart] = {}
    if isinstance(mechanisms, PinnedLinkages) or len(mechanisms) == 1:
        prepared = owner.__dict__.setdefault("_prepared_parts", prepared)
    if pair in prepared:
        return prepared[pair]
    if isinstance(mechanisms, PinnedLinkages):
        linkages = mechanisms
    else:
        layouts = {
            k: mechanism.layout
            for k, mechanism in enumerate(mechanisms)
            if isinstance(mechanism, PinnedMechanism) and mechanism.layout is not None and not mechanism.stops
        }
        pinned = np.array([] if pair is not None else list(layouts), dtype=np.int64)
        if len(pinned):
            linkages = PinnedLinkages.from_layouts(list(layouts.values()))
    is_open = np.ones(len(mechanisms), dtype=bool)
    if linkages is not None:
        pin_tape = make_pin_tape(linkages)
        is_open[pinned[pin_tape.which]] = False
    arrays = make_linkage_arrays({k: mechanisms[k] for k in np.flatnonzero(is_open).tolist()}, pair)
    if arrays is not None:
        assemblies = find_linkage_assemblies(arrays)
    prepared[pair] = _PreparedPart(pinned, linkages, pin_tape, arrays, assemblies)
    return prepared[pair]


def _solve(mechanisms: Mechanisms, request: SweepRequest, values: Array | None, uses_general_path: bool) -> SweptPart:
    pinned, linkages, pin_tape, arrays, assemblies = _prepare(mechanisms, request.pair)
    pins = None if linkages is None else result_pins(linkages, request.points)
    if pins is not None and len(pinned) == len(mechanisms):
        points = pins
    else:
        points = _point_table(mechanisms, request.points, pinned, pins, arrays)
    if values is None:
        watched_count = 0 if arrays is None else len(arrays.watched_points.owner)
        values = make_values(int(points.first[-1]) + watched_count, request.steps, request.rates)

    endings = Endings.undecided(len(mechanisms))
    if linkages is not None and pin_tape is not None and pins is not None:
        rows = np.arange(len(pins.codes)) + np.repeat(points.first[pinned] - pins.first[:-1], np.diff(pins.first))
        endings.start[pinned] = linkages.crank_angles
        run_pins(linkages, pin_tape, pinned, pins, rows, values, endings, request.steps)
    if arrays is not None and assemblies is not None:
        endings.start[arrays.which] = arrays.start
        run_blocks(arrays, assemblies, points, values, endings, request)

    undecided = np.flatnonzero(endings.solved < 0)
    endings.solved[undecided], endings.outcome[undecided] = 0, DEAD_POINT_NUMBER
    stopped = np.flatnonzero(endings.solved <= request.steps)
    clear_points(values, points.first, stopped, endings.solved[stopped])
    for k in undecided.tolist() if uses_general_path else ():
        names = points.names(k)
        solved = _solve_by_general_path(mechanisms[k], names, request)
        endings.solved[k], endings.outcome[k] = np.count_nonzero(solved.status == 0), solved.status[-1]
        endings.general_inputs[k] = solved.input
        endings.reasons[k] = str(solved.message or solved.rate_remark)
        target = values[points.first[k] : points.first[k + 1], :, : request.steps + 1]
        by_order = solved.out.reshape(request.steps + 1, target.shape[1] // 2, len(names), 2)
        target[:] = by_order.transpose(2, 1, 3, 0).reshape(target.shape)
    return SweptPart(values[: points.first[-1]], request.steps, points, endings)


def _point_table(
    mechanisms: Mechanisms,
    names: Sequence[str] | None,
    pinned: IntArray,
    pins: PointTable | None,
    arrays: LinkageArrays | None,
) -> PointTable:
    """The points of all mechanisms that are results: pins of those that are pinned bars, points of these names of
    others; all that move without names."""
    pin_rows = {} if pins is None else {k: row for row, k in enumerate(pinned.tolist())}
    structures = {} if arrays is None else dict(zip(arrays.which.tolist(), arrays.structures, strict=True))

    def point_names(k: int) -> Sequence[str]:
        if pins is not None and k in pin_rows:
            return pins.names(pin_rows[k])
        known: Collection[str]
        if k in structures:
            known, moving = structures[k].members, structures[k].moving_points
        else:
            members = named_points(mechanisms[k])
            known = [name for name, _ in members]
            moving = tuple(name for name, points in members if mechanisms[k].frame not in dict(points))
        return moving if names is None else [name for name in names if name in known]

    return PointTable.of_names(list(map(point_names, range(len(mechanisms)))))


def _solve_by_general_path(mechanism: Mechanism, names: Sequence[str], request: SweepRequest) -> SolvedDesign:
    """One mechanism as a separate cycle."""
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
    return solve_design(mechanism, pair, grid, request.steps, ends, tuple(names), request.rates)
