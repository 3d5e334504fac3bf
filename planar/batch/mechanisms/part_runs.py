"""Solve the mechanisms of a part: pinned bars pin by pin, others block by block, the rest by the general path."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from planar.batch.design_frames import DesignFrames
from planar.batch.general_path import DesignRun, SolvedDesign
from planar.batch.march.stops import SURE_DISTANCE, TURN
from planar.batch.mechanisms.initial_assembly import LinkageAssemblies, find_linkage_assemblies
from planar.batch.mechanisms.linkages import LinkageArrays, LinkArrays, SweepRequest, make_linkage_arrays, watched_links
from planar.batch.mechanisms.pins import frame_pins, make_pin_tape, prepare_pins, result_pins
from planar.batch.mechanisms.results import PointTable, SweptPart, between, dead_point_reason
from planar.batch.mechanisms.tape_runs import (
    STEP_TABLE,
    Endings,
    PreparedTape,
    make_block_kinds,
    make_tape,
    make_values,
    run_taped_linkages,
    temporary_slots,
)
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.foundation.turns import take_turn
from planar.model.link_shapes import PointName
from planar.model.mechanism import Mechanism, links_counting_turns, named_points, relative_motions, running_input_index
from planar.model.pairs import MeasureKind
from planar.model.pin_linkage import PinnedMechanism
from planar.model.pin_linkages import PinnedLinkages
from planar.solving.stops import PairStops


def prepare_blocks(
    arrays: LinkageArrays, assemblies: LinkageAssemblies, points: PointTable, pair: str | None
) -> PreparedTape:
    """Prepare the tape of linkages that are solved block after block, with the input that runs at `pair`; `points` are
    the results of the part.

    Behind their rows are those of the points of links that decide where pairs with stops are.
    """
    results = arrays.points([points.names(k) for k in arrays.which.tolist()])
    first_result = part_offsets(np.bincount(results.owner, minlength=len(arrays)))
    rows = np.arange(len(results.owner)) + (points.first[arrays.which] - first_result[:-1])[results.owner]
    watched = arrays.watched_points
    first_watched = points.first[-1] + part_offsets(np.bincount(watched.owner, minlength=len(arrays)))
    rows = np.concatenate([rows, np.arange(first_watched[0], first_watched[-1])])
    tape_points = LinkArrays(
        np.concatenate([results.owner, watched.owner]),
        np.concatenate([results.link_index, watched.link_index]),
        np.concatenate([results.numbers, watched.numbers]),
    )
    taped = make_tape(
        arrays, assemblies.block_numbers, temporary_slots, [STEP_TABLE] * len(arrays.batches), tape_points, rows
    ).select(np.flatnonzero(assemblies.is_sure))
    find_stops = {
        int(arrays.which[k]): partial(_find_stop, arrays, k, np.arange(*first_watched[k : k + 2]), pair)
        for k in np.flatnonzero(np.diff(first_watched)).tolist()
    }
    types = [batch.block_type for batch in arrays.batches]
    return PreparedTape(taped, partial(make_block_kinds, types), find_stops)


def note_dead_links(arrays: LinkageArrays, endings: Endings) -> None:
    """Note the reasons of linkages with blocks that come to a dead point."""
    is_dead = (endings.solved >= 0) & (endings.outcome == Outcome.DEAD_POINT.code)
    for number in arrays.which[is_dead[arrays.which]].tolist():
        links = arrays.links_of_block(int(endings.links[number, 0]))
        endings.reasons[number] = dead_point_reason(links, endings.start[number] + endings.near[number])


def _find_stop(
    arrays: LinkageArrays,
    k: int,
    rows: IntArray,
    running_pair: str | None,
    rotation: Array,
    point_places: Callable[[IntArray], Array],
    good: int,
) -> tuple[int, str] | None:
    """See `FindStop`: by two points of each watched link, in `rows` of the results."""
    mechanism, unit = arrays.mechanisms[k], float(arrays.unit[k])
    stops, counted = PairStops(mechanism, unit), links_counting_turns(mechanism)
    u = {given.pair: np.full((good, 1), given.position) for given in mechanism.inputs}
    is_long = stops.high - stops.low > TURN + SURE_DISTANCE
    if any(
        not counted.isdisjoint(pair.bodies) or (pair_is_long and pair.name not in u)
        for pair, pair_is_long in zip(stops.pairs, is_long.tolist(), strict=True)
    ):
        return None
    positions = arrays.start[k] + rotation
    u[mechanism.inputs[running_input_index(mechanism, running_pair, "inputs")].pair] = positions[:good, None]
    places = np.moveaxis(point_places(rows)[..., :good], 1, 2)[:, None, :, :, None]
    points = {link: (places[2 * n], places[2 * n + 1]) for n, link in enumerate(watched_links(mechanism))}
    frames = DesignFrames(mechanism, shapes_of_links(mechanism), u, points, unit)
    if not frames.is_clear[0]:
        return None
    values = np.array([frames.pair_value(pair.name)[0][:, 0] for pair in stops.pairs])
    ending = _find_first_stop(stops, values, np.array([angle[:, 0] for angle in frames.angles.values()]))
    if ending is None or (not ending[1] and good < len(positions)):
        return None  # beside a dead point it is not clear which comes first
    solved, stop = ending
    return solved, stop and f"{stop}, {between(positions[[max(solved - 1, 0), solved]])}"


def _find_first_stop(stops: PairStops, values: Array, angles: Array) -> tuple[int, str] | None:
    """The number of steps before the first stop, and the stop in words, empty if there is none, by the values of pairs
    with stops (stops, steps) and the angles of links (links, steps); None if that is not clear."""
    low, high, scale = (bound[:, None] for bound in (stops.low, stops.high, stops.scale))
    counted_values = values + stops.turns(values[:, 0])[:, None]
    distances = np.minimum(counted_values - low, high - counted_values) / scale
    nearest = distances.min(axis=0)
    if nearest[0] < -SURE_DISTANCE:
        return 0, stops.describe_met(values[:, 0])
    is_sure = stops.sure_rows(values, np.vstack([angles, values / scale]).T)
    if is_sure.all():
        return len(is_sure), ""
    first = int(np.argmin(is_sure))
    if first < 2 or nearest[first - 1] < SURE_DISTANCE or nearest[first] > -SURE_DISTANCE:
        return None
    k = int(np.argmin(distances[:, first]))
    is_upper = bool(values[k, first] > values[k, first - 1])
    return first, stops.side(is_upper, k).describe(stops.motions, stops.mechanism.units)


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
    """What is known of the mechanisms of a part before they run: the points that are results; where the input of each
    starts (rad); the tapes of those that are solved pin by pin, and block by block, these as arrays; the rows of pins
    on the frame, and where they are."""

    points: PointTable
    start: Array
    tapes: list[PreparedTape]
    arrays: LinkageArrays | None
    fixed_rows: IntArray
    fixed_places: Array


def _prepare_once(mechanisms: Mechanisms, request: SweepRequest) -> _PreparedPart:
    """Prepare a part; linkages that are arrays, or a mechanism alone, are not prepared again for the same points."""
    if len(mechanisms) > 1 and not isinstance(mechanisms, PinnedLinkages):
        return _prepare(mechanisms, request)
    cached = (mechanisms if isinstance(mechanisms, PinnedLinkages) else mechanisms[0]).__dict__
    known, part = cached.get("_prepared_part", (None, None))
    if part is None or known != (request.pair, request.points):
        part = _prepare(mechanisms, request)
        cached["_prepared_part"] = (request.pair, request.points), part
    return part


def _prepare(mechanisms: Mechanisms, request: SweepRequest) -> _PreparedPart:
    is_named = request.points is None or all(isinstance(name, str) for name in request.points)
    pinned, linkages = _pinned_linkages(mechanisms if is_named else (), request.pair)
    is_open, start = np.ones(len(mechanisms), dtype=bool), np.zeros(len(mechanisms))
    pins = pin_tape = None
    if linkages is not None:
        pins, pin_tape, start[pinned] = (
            result_pins(linkages, request.points),
            make_pin_tape(linkages),
            linkages.crank_angles,
        )
        is_open[pinned[pin_tape.which]] = False
    arrays = make_linkage_arrays({k: mechanisms[k] for k in np.flatnonzero(is_open).tolist()}, request.pair)
    if pins is not None and len(pinned) == len(mechanisms):
        points = pins
    else:
        points = _point_table(mechanisms, request.points, pinned, pins, arrays)
    tapes: list[PreparedTape] = []
    fixed_rows, fixed_places = np.zeros(0, dtype=np.int64), np.zeros((0, 2))
    if linkages is not None and pins is not None and pin_tape is not None:
        rows = np.arange(len(pins.codes)) + np.repeat(points.first[pinned] - pins.first[:-1], np.diff(pins.first))
        result_numbers = pins.codes + np.repeat(linkages.first_pin[:-1], np.diff(pins.first))
        is_fixed = np.isin(result_numbers, frame_pins(linkages))
        fixed_rows, fixed_places = rows[is_fixed], linkages.positions[result_numbers[is_fixed]]
        if len(pin_tape.which):
            tapes.append(prepare_pins(linkages, pin_tape, pinned, result_numbers, rows))
    if arrays is not None:
        start[arrays.which] = arrays.start
        tapes.append(prepare_blocks(arrays, find_linkage_assemblies(arrays), points, request.pair))
    return _PreparedPart(points, start, tapes, arrays, fixed_rows, fixed_places)


def _pinned_linkages(mechanisms: Mechanisms, pair: str | None) -> tuple[IntArray, PinnedLinkages | None]:
    """Those of the mechanisms that are pinned bars, their numbers and as arrays."""
    if isinstance(mechanisms, PinnedLinkages):
        return np.arange(len(mechanisms)), mechanisms
    layouts = {
        k: mechanism.layout
        for k, mechanism in enumerate(mechanisms if pair is None else ())
        if isinstance(mechanism, PinnedMechanism) and mechanism.layout is not None and not mechanism.stops
    }
    if not layouts:
        return np.arange(0), None
    return np.array(list(layouts)), PinnedLinkages.from_layouts(list(layouts.values()))


def _solve(mechanisms: Mechanisms, request: SweepRequest, values: Array | None, uses_general_path: bool) -> SweptPart:
    part = _prepare_once(mechanisms, request)
    points, endings = part.points, Endings.undecided(part.start)
    if values is None:
        watched_count = 0 if part.arrays is None else len(part.arrays.watched_points.owner)
        values = make_values(int(points.first[-1]) + watched_count, request.steps, request.rates)
    values[part.fixed_rows] = 0.0
    values[part.fixed_rows, :2] = part.fixed_places[:, :, None]
    for tape in part.tapes:
        run_taped_linkages(tape, values, request.steps, endings, request.turn)
    if part.arrays is not None:
        note_dead_links(part.arrays, endings)

    undecided = np.flatnonzero(endings.solved < 0)
    endings.solved[undecided], endings.outcome[undecided] = 0, Outcome.DEAD_POINT.code
    first = points.first.tolist()
    for k in np.flatnonzero(endings.solved <= request.steps).tolist():
        values[first[k] : first[k + 1], :, endings.solved[k] :] = np.nan
    for k in undecided.tolist() if uses_general_path else ():
        names = points.names(k)
        solved = _solve_by_general_path(mechanisms[k], names, request)
        endings.solved[k], endings.outcome[k] = np.count_nonzero(solved.status == 0), solved.status[-1]
        endings.general_inputs[k] = solved.input
        endings.reasons[k] = str(solved.message or solved.rate_remark)
        target = values[first[k] : first[k + 1], :, : request.steps + 1]
        by_order = solved.out.reshape(request.steps + 1, target.shape[1] // 2, len(names), 2)
        target[:] = by_order.transpose(2, 1, 3, 0).reshape(target.shape)
    return SweptPart(values[: points.first[-1]], request.steps, points, endings)


def _point_table(
    mechanisms: Mechanisms,
    names: Sequence[PointName] | None,
    pinned: IntArray,
    pins: PointTable | None,
    arrays: LinkageArrays | None,
) -> PointTable:
    """The points of all mechanisms that are results: pins of those that are pinned bars, points of these names of
    others; all that move without names."""
    pin_rows = {} if pins is None else {k: row for row, k in enumerate(pinned.tolist())}
    structures = {} if arrays is None else dict(zip(arrays.which.tolist(), arrays.structures, strict=True))

    def point_names(k: int) -> Sequence[PointName]:
        if pins is not None and k in pin_rows:
            return pins.names(pin_rows[k])
        known: Collection[str]
        if k in structures:
            known, moving = structures[k].members, structures[k].moving_points
        else:
            members = named_points(mechanisms[k])
            known = [name for name, _ in members]
            moving = tuple(name for name, points in members if mechanisms[k].frame not in dict(points))
        return moving if names is None else [name for name in names if not isinstance(name, str) or name in known]

    return PointTable.of_names(list(map(point_names, range(len(mechanisms)))))


def _solve_by_general_path(mechanism: Mechanism, names: Sequence[PointName], request: SweepRequest) -> SolvedDesign:
    """One mechanism as a separate cycle."""
    running = running_input_index(mechanism, request.pair, "inputs")
    inputs = tuple(
        given._replace(law=None) if k == running else given._replace(velocity=0.0, acceleration=0.0, law=None)
        for k, given in enumerate(mechanism.inputs)
    )
    mechanism = replace(mechanism, inputs=inputs)
    pair, grid = inputs[running].pair, None
    if relative_motions(mechanism)[pair].input_kind is not MeasureKind.LENGTH:
        grid = inputs[running].position + np.linspace(0.0, request.turn, request.steps + 1)
    return DesignRun(mechanism, pair, grid, request.steps).solve(tuple(names), request.rates)
