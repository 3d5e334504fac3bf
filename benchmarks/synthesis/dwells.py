"""Linkages that stand still while the crank goes on: a function by six-bars, and an arc with a dyad behind it.

The dwell's error is the greatest departure of the output from where it stands, in % of all that it moves.
"""

from __future__ import annotations

from collections.abc import Iterator
from time import process_time
from typing import Any, NamedTuple

import numpy as np

import planar
from benchmarks.synthesis.misses import Array, is_whole_turn

MANY = 36
"""Pairs of a function, round the turn."""
SWING, RISE = 40.0, 120.0
"""Degrees of the output, and of the crank to rise and to return."""
RADIUS, ARC = 40.0, 60.0
"""mm and degrees of the arc that a point is to follow."""
ARC_PLACES = 9
DIRECTION = 15.0
"""Degrees between the directions of the dyad's pivot that are tried."""
POINT = "E"
TIME = 120.0
"""Seconds after which nothing new is begun."""


class DwellResult(NamedTuple):
    """The dwell's error and its length in degrees of the crank; none where there is no design; processor seconds."""

    name: str
    error: float | None
    crank: float
    seconds: float
    remarks: tuple[str, ...]


def rise_and_return(turned: Array, rise: float = RISE) -> Array:
    """Degrees of an output at degrees of the crank (n,): a cycloid up, a cycloid down, then a dwell for the rest."""
    share = np.clip(np.stack([turned, turned - rise]) / rise, 0.0, 1.0)
    up, down = share - np.sin(2.0 * np.pi * share) / (2.0 * np.pi)
    return SWING * (up - down)


def function_starts() -> Iterator[tuple[planar.Mechanism, str]]:
    """The six-bars with an output at the frame that is not the first rocker of a four-bar in them, and its pair."""
    chains = planar.chains(6)
    for chain in (chains[0], chains[1]):
        for each in chain.mechanisms():
            if each.name not in ("Watt II six-bar", "Stephenson III six-bar"):
                continue
            mechanism = chain.mechanism(each.frame, each.drives)
            for name in far_outputs(mechanism):
                yield mechanism, name


def far_outputs(mechanism: planar.Mechanism) -> Iterator[str]:
    """The pairs at the frame whose link is no neighbour of a neighbour of the driven link."""
    driven = mechanism.inputs[0].pair
    frame = mechanism.frame
    links = {pair.name: set(pair.links) - {frame} for pair in mechanism.pairs if frame in pair.links}
    inner = [set(pair.links) for pair in mechanism.pairs if frame not in pair.links]
    near = {link for pair in inner if pair & links[driven] for link in pair}
    reach = {link for pair in inner if pair & near for link in pair}
    for name, own in links.items():
        if name != driven and not own & reach:
            yield name


def dwell_task(mechanism: planar.Mechanism, output: str) -> dict[str, Any]:
    """The task of a whole turn with a dwell."""
    turned = np.arange(MANY) * 360.0 / MANY
    pairs = np.stack([turned, rise_and_return(turned)], axis=1).tolist()
    wanted = [{"from": mechanism.inputs[0].pair, "to": output, "pairs": pairs}]
    units = {"length": "mm", "angle": "deg"}
    start = planar.to_dict(mechanism)
    return {"planar": 1, "name": "dwell", "units": units, "start": start, "wanted": wanted, "demands": ["whole turn"]}


def measure_function(mechanism: planar.Mechanism, output: str, time_limit: float = TIME) -> DwellResult:
    """A six-bar with this output, and its dwell measured round the turn of its file."""
    begun = process_time()
    found = planar.synthesise(dwell_task(mechanism, output), many=3, time_limit=time_limit)
    seconds = process_time() - begun
    name = f"{mechanism.name}, from {mechanism.inputs[0].pair} to {output}"
    if not found:
        return DwellResult(name, None, 360.0 - 2.0 * RISE, seconds, found.remarks)
    best = found[0]
    turned = np.linspace(best.inputs[0][0] + np.radians(2.0 * RISE), best.inputs[0][0] + 2.0 * np.pi, 2)
    error = dwell_error(best.mechanism, output, float(turned[0]), float(turned[1]))
    return DwellResult(name, error, 360.0 - 2.0 * RISE, seconds, best.defects)


def dwell_error(mechanism: planar.Mechanism, output: str, start: float, stop: float) -> float:
    """The departure of an output from the middle of where it is between two positions of the input (rad); infinite
    where the input makes no whole turn."""
    again, running = planar.loads(planar.dumps(mechanism)), mechanism.inputs[0].pair
    motions = (planar.cycle(again, 120, pair=running, start=start, stop=stop), planar.cycle(again, 360, pair=running))
    if not is_whole_turn(again, motions[1]):
        return np.inf
    still, whole = (np.unwrap(np.asarray(each.pair(output)["relative_angle"])) for each in motions)
    return 50.0 * float(np.ptp(still)) / float(np.ptp(whole))


def arc_task() -> dict[str, Any]:
    """The task of a four-bar one of whose points follows an arc."""
    turned = np.radians(np.linspace(-0.5 * ARC, 0.5 * ARC, ARC_PLACES))
    places = (RADIUS * np.stack([np.cos(turned), np.sin(turned)], axis=1)).tolist()
    wanted = [{"point": POINT, "through": places, "in_order": True}]
    units = {"length": "mm", "angle": "deg"}
    return {
        "planar": 1,
        "name": "arc",
        "units": units,
        "start": "four-bar",
        "wanted": wanted,
        "demands": ["whole turn"],
    }


def measure_arc() -> DwellResult:
    """A four-bar for the arc with a dyad whose pin stands in the arc's centre meanwhile."""
    begun = process_time()
    found = planar.synthesise(arc_task(), many=3)
    seconds = process_time() - begun
    name = f"arc of {ARC:g} deg by a four-bar, with a dyad"
    if not found:
        return DwellResult(name, None, 0.0, seconds, found.remarks)
    best = found[0]
    inputs = np.unwrap(best.inputs[0])
    first, last = float(inputs[0]), float(inputs[-1])
    error = best_dyad_error(best.mechanism, first, last)
    return DwellResult(name, error, abs(float(np.degrees(last - first))), seconds, best.defects)


def best_dyad_error(mechanism: planar.Mechanism, first: float, last: float) -> float | None:
    """The least dwell's error of a dyad whose pivot lies in any direction, of those that let the crank turn fully."""
    path = planar.cycle(mechanism, 180, pair=mechanism.inputs[0].pair).point(POINT).position
    arm = 2.0 * float(np.hypot(*path.T).max())
    errors = []
    for direction in np.radians(np.arange(0.0, 360.0, DIRECTION)):
        pivot = arm * np.array([np.cos(direction), np.sin(direction)])
        try:
            errors.append(dwell_error(with_dyad(mechanism, pivot), "G", first, last))
        except planar.PlanarError:
            continue  # the crank is stopped on the arc
    least = min(errors, default=np.inf)
    return least if np.isfinite(least) else None


def with_dyad(mechanism: planar.Mechanism, pivot: Array) -> planar.Mechanism:
    """The linkage with a dyad from its point to a pivot (m); its pin is in the arc's centre, the origin."""
    value = planar.to_dict(mechanism)
    x, y = pivot.tolist()
    value["links"][value["frame"]]["points"]["G"] = [f"{x} m", f"{y} m"]
    value["links"]["EF"] = {"ends": [POINT, "F"], "length": f"{RADIUS} mm"}
    value["links"]["GF"] = {"ends": ["G", "F"], "length": f"{float(np.hypot(x, y))} m"}
    value["pairs"] += [{"turning": name} for name in (POINT, "F", "G")]
    value["sketch"] = value.get("sketch", {}) | {"F": [0, 0]}
    return planar.from_dict(value)
