"""Runs of linkages that are partitioned into blocks, and their ends at stops of pairs."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import numpy as np

from planar.batch.march.stops import SURE_DISTANCE, TURN
from planar.batch.mechanisms.block_tapes import make_block_kinds, make_tape, temporary_slots
from planar.batch.mechanisms.initial_assembly import LinkageAssemblies
from planar.batch.mechanisms.linkages import LinkageArrays, LinkArrays, watched_links
from planar.batch.mechanisms.results import PointTable, between, dead_point_reason
from planar.batch.mechanisms.tape_runs import (
    DEAD_POINT_NUMBER,
    STEP_TABLE,
    Endings,
    LinkageEnding,
    PreparedTape,
)
from planar.batch.named_results.design_frames import DesignFrames
from planar.equations.mechanism_numbers import shapes_of_links
from planar.foundation.arrays import Array, IntArray, part_offsets
from planar.foundation.errors import Outcome
from planar.model.mechanism import links_counting_turns, running_input_index
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
    find_endings = {
        int(arrays.which[k]): partial(_find_ending, arrays, k, np.arange(*first_watched[k : k + 2]), pair)
        for k in np.flatnonzero(np.diff(first_watched)).tolist()
    }
    types = [batch.block_type for batch in arrays.batches]
    return PreparedTape(taped, partial(make_block_kinds, types), find_endings)


def note_dead_links(arrays: LinkageArrays, endings: Endings) -> None:
    """Note the reasons of linkages with blocks that come to a dead point."""
    is_dead = (endings.solved >= 0) & (endings.outcome == DEAD_POINT_NUMBER)
    for number in arrays.which[is_dead[arrays.which]].tolist():
        links = arrays.links_of_block(int(endings.links[number, 0]))
        endings.reasons[number] = dead_point_reason(links, endings.start[number] + endings.near[number])


def _find_ending(
    arrays: LinkageArrays,
    k: int,
    rows: IntArray,
    running_pair: str | None,
    rotation: Array,
    point_places: Callable[[IntArray], Array],
    good: int,
) -> LinkageEnding | None:
    """How a linkage ends whose pairs have stops, by two points of each watched link in `rows`; None if that is not
    sure."""
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
    if ending is None or (ending.outcome is Outcome.SOLVED and good < len(positions)):
        return None  # beside a dead point it is not clear which comes first
    if ending.outcome is Outcome.SOLVED:
        return ending
    near = between(positions[[max(ending.solved_steps - 1, 0), ending.solved_steps]])
    return ending._replace(reason=f"{ending.reason}, {near}")


def _find_first_stop(stops: PairStops, values: Array, angles: Array) -> LinkageEnding | None:
    """The ending at the first stop, by the values of pairs with stops (stops, steps) and the angles of links (links,
    steps); None if that is not clear."""
    low, high, scale = (bound[:, None] for bound in (stops.low, stops.high, stops.scale))
    counted_values = values + stops.turns(values[:, 0])[:, None]
    distances = np.minimum(counted_values - low, high - counted_values) / scale
    nearest = distances.min(axis=0)
    if nearest[0] < -SURE_DISTANCE:
        return LinkageEnding(0, Outcome.STOP, stops.describe_met(values[:, 0]))
    is_sure = stops.sure_rows(values, np.vstack([angles, values / scale]).T)
    if is_sure.all():
        return LinkageEnding(len(is_sure))
    first = int(np.argmin(is_sure))
    if first < 2 or nearest[first - 1] < SURE_DISTANCE or nearest[first] > -SURE_DISTANCE:
        return None
    k = int(np.argmin(distances[:, first]))
    is_upper = bool(values[k, first] > values[k, first - 1])
    return LinkageEnding(first, Outcome.STOP, stops.side(is_upper, k).describe(stops.motions, stops.mechanism.units))
