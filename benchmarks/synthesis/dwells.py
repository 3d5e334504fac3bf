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
RADIUS, ARC, DEPTH = 40.0, 60.0, 15.0
"""mm and degrees of the arc that a point is to follow, and by how much it comes back nearer to the centre (mm)."""
ARC_PLACES, BACK_PLACES, BACK_WEIGHT = 12, 6, 0.02
DIRECTION = 5.0
"""Degrees between the directions of the dyad's pivot that are tried."""
MOST_OPEN = 0.94
"""The greatest cosine of the angle between the dyad's bars, either way: it stays 20 degrees from its dead points."""
POINT, PIN, PIVOT = "E", "dyad pin", "dyad pivot"
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
    found = planar.synthesise(dwell_task(mechanism, output), many=3, timeout=time_limit)
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


def arc_places() -> Array:
    """Places (n, 2) in mm of a closed curve: an arc about the origin, and a way back nearer to it."""
    out = np.radians(np.linspace(-0.5 * ARC, 0.5 * ARC, ARC_PLACES))
    back = np.linspace(-1.0, 1.0, BACK_PLACES + 2)[1:-1]
    turned = np.concatenate([out, -np.radians(0.5 * ARC) * back])
    radius = np.concatenate([np.full(ARC_PLACES, RADIUS), RADIUS - DEPTH * (1.0 - back**2)])
    return radius[:, None] * np.stack([np.cos(turned), np.sin(turned)], axis=1)


def arc_task() -> dict[str, Any]:
    """The task of a four-bar one of whose points follows the arc; the way back counts little."""
    weights = [1.0] * ARC_PLACES + [BACK_WEIGHT] * BACK_PLACES
    through = [{"at": at, "weight": weight} for at, weight in zip(arc_places().tolist(), weights, strict=True)]
    wanted = [{"point": POINT, "through": through, "in_order": True, "closed": True}]
    units = {"length": "mm", "angle": "deg"}
    told = {"planar": 1, "name": "arc", "units": units, "start": "four-bar", "wanted": wanted}
    return told | {"demands": ["whole turn"]}


def measure_arc() -> DwellResult:
    """A four-bar for the arc with a dyad whose pin stands in the arc's centre meanwhile."""
    begun = process_time()
    found = planar.synthesise(arc_task(), many=3)
    seconds = process_time() - begun
    name = f"arc of {ARC:g} deg by a four-bar, with a dyad"
    if not found:
        return DwellResult(name, None, 0.0, seconds, found.remarks)
    return min(
        (_arc_result(name, each, seconds) for each in found),
        key=lambda each: np.inf if each.error is None else each.error,
    )


def _arc_result(name: str, design: planar.SynthesisedDesign, seconds: float) -> DwellResult:
    """A design with the dyad that swings most."""
    mechanism, inputs = design.mechanism, np.unwrap(design.inputs[0][:ARC_PLACES])
    crank = abs(float(np.degrees(inputs[-1] - inputs[0])))
    path = planar.cycle(mechanism, 180, pair=mechanism.inputs[0].pair).point(POINT).position
    pivot = best_pivot(path, RADIUS * 1e-3)
    if pivot is None:
        return DwellResult(name, None, crank, seconds, ("no dyad lets the crank turn fully",))
    error = dwell_error(with_dyad(mechanism, pivot), PIVOT, float(inputs[0]), float(inputs[-1]))
    return DwellResult(name, error, crank, seconds, design.defects)


def best_pivot(path: Array, radius: float) -> Array | None:
    """The pivot (2,) about which a dyad swings most, whose pin is in the origin while the point of a path (n, 2) is at
    `radius` from it; none where each stops the motion."""
    best, most = None, 0.0
    for arm in radius * np.geomspace(1.0, 8.0, 12):
        for direction in np.radians(np.arange(0.0, 360.0, DIRECTION)):
            pivot = arm * np.array([np.cos(direction), np.sin(direction)])
            apart = path - pivot
            far = np.hypot(*apart.T)
            at_pin = (radius**2 + arm**2 - far**2) / (2.0 * radius * arm)
            if np.abs(at_pin).max() > MOST_OPEN:
                continue
            opening = (arm**2 + far**2 - radius**2) / (2.0 * arm * far)
            swing = max(
                float(np.ptp(np.unwrap(np.arctan2(*apart.T[::-1]) + side * np.arccos(opening)))) for side in (1.0, -1.0)
            )
            if swing > most:
                best, most = pivot, swing
    return best


def with_dyad(mechanism: planar.Mechanism, pivot: Array) -> planar.Mechanism:
    """The linkage with a dyad from its point to a pivot (m); its pin is in the origin while the point is on the arc,
    whose middle lies in the x-axis."""
    value = planar.to_dict(mechanism)
    arm, radius = float(np.hypot(*pivot)), RADIUS * 1e-3
    at = planar.solve(mechanism).point(POINT).position
    pin = circle_crossings(at, radius, pivot, arm)[0 if pivot[1] > 0.0 else 1]
    value["links"][value["frame"]]["points"][PIVOT] = [f"{each} m" for each in pivot.tolist()]
    value["links"]["first bar"] = {"ends": [POINT, PIN], "length": f"{radius} m"}
    value["links"]["second bar"] = {"ends": [PIVOT, PIN], "length": f"{arm} m"}
    value["pairs"] += [{"turning": name} for name in (POINT, PIN, PIVOT)]
    value["sketch"] = value.get("sketch", {}) | {PIN: [f"{each} m" for each in pin.tolist()]}
    return planar.from_dict(value)


def circle_crossings(one: Array, radius: float, other: Array, arm: float) -> list[Array]:
    """Where circles about two centres (2,) cross: on the left of the way from one to the other, and on the right."""
    apart = other - one
    far = float(np.hypot(*apart))
    along = (radius**2 - arm**2 + far**2) / (2.0 * far)
    across = np.sqrt(max(radius**2 - along**2, 0.0)) * np.array([-apart[1], apart[0]]) / far
    return [one + along * apart / far + side * across for side in (1.0, -1.0)]
