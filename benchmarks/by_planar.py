"""planar on a swept linkage: `planar.sweep`, and `planar.cycle` design by design."""

from __future__ import annotations

from typing import Any

import numpy as np

import planar
from benchmarks.entry import Array, Entry
from benchmarks.swept.base import Swept
from planar.document.dimensions import change_dimension, link_lengths
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.continuation.fast_path import resting_inputs
from planar.solving.continuation.path import follow_samples
from planar.solving.position import PositionSolver

SYSTEM = "planar.sweep"
CYCLED = 3
"""So many designs are enough to time `planar.cycle` design by design."""


def sweeps(swept: Swept, d: Array, steps: int) -> list[Entry]:
    """Designs d (dimensions, designs) over a turn, positions alone and with rates; refused ones are NaN."""
    mechanism = planar.from_dict(swept.document())
    found = [_sweep(mechanism, swept, d, steps, rates) for rates in (False, True)]
    return [*found, _cycle_each(mechanism, swept, d[:, :CYCLED], steps)]


def turns(swept: Swept, steps: int) -> list[Entry]:
    """The file's own design over a turn: a run with its checks, and `planar.cycle`, which has rates and limits too."""
    mechanism = planar.from_dict(swept.document())
    solver = PositionSolver(mechanism)
    z, p = solver.find_assembly().z, solver.inputs.p
    start = mechanism.inputs[0].position
    u = (start + 2.0 * np.pi * np.linspace(0.0, 1.0, steps + 1))[:, None]
    link = next(each.name for each in mechanism.links if swept.point in each.names and each.name != mechanism.frame)
    columns = [solver.column[link, part] for part in ("x", "y", "angle")]
    at = solver.shapes[link].position(swept.point)

    def read(found: Array) -> Array:
        x, y, angle = solver.functions.coordinates(found, u, p).T[columns]
        c, s = np.cos(angle), np.sin(angle)
        return np.stack([x * solver.unit + c * at.x - s * at.y, y * solver.unit + s * at.x + c * at.y])[..., None]

    one, all_steps = np.arange(1), np.arange(steps + 1)
    return [
        Entry(
            "planar, a run with its checks",
            False,
            one,
            all_steps,
            lambda: follow_samples(solver, z, resting_inputs(u)).z,
            read,
        ),
        *(_prepare(mechanism, swept, steps, rates) for rates in (False, True)),
        Entry(
            "planar.cycle, from the sketch",
            True,
            one,
            all_steps,
            lambda: [planar.cycle(mechanism, steps)],
            lambda found: _read(found, swept.point, steps),
        ),
    ]


def sweep_new_designs(swept: Swept, d: Array, steps: int) -> list[Entry]:
    """Designs d (dimensions, designs) by `planar.prepared`, a call each."""
    mechanism = planar.from_dict(swept.document())
    names = [dimension.name for dimension in swept.dimensions]
    values = [dict(zip(names, map(float, each), strict=True)) for each in d.T]

    def entry(rates: bool) -> Entry:
        ready = planar.prepared(mechanism, steps, swept.point, rates=rates)

        def read(found: list[Any]) -> Array:
            return np.stack([_read_prepared(each, swept.point, rates) for each in found], axis=2)

        known = np.arange(d.shape[1]), np.arange(steps + 1)
        return Entry("planar.prepared", rates, *known, lambda: [ready(each) for each in values], read)

    return [entry(rates) for rates in (False, True)]


def _read_prepared(found: Any, point: str, rates: bool) -> Array:
    """(2 or 6, steps) of a run."""
    orders = (found.position, found.velocity, found.acceleration)[: 3 if rates else 1]
    return np.concatenate([order[point].T for order in orders])


def _prepare(mechanism: Mechanism, swept: Swept, steps: int, rates: bool) -> Entry:
    ready = planar.prepared(mechanism, steps, swept.point, rates=rates)

    def read(found: Any) -> Array:
        return _read_prepared(found, swept.point, rates)[..., None]

    return Entry("planar.prepared", rates, np.arange(1), np.arange(steps + 1), ready, read)


def _sweep(mechanism: Mechanism, swept: Swept, d: Array, steps: int, rates: bool) -> Entry:
    named, points = _name_values(swept, d), [swept.point]

    def read(found: Any) -> Array:
        orders = (found.position, found.velocity, found.acceleration)[: 3 if rates else 1]
        told = np.concatenate([np.moveaxis(np.array(order[swept.point]), (0, 1, 2), (2, 1, 0)) for order in orders])
        told[:, np.asarray(found.status).T != 0] = np.nan
        return told

    return Entry(
        SYSTEM,
        rates,
        np.arange(d.shape[1]),
        np.arange(steps + 1),
        lambda: planar.sweep(mechanism, named, steps=steps, points=points, rates=rates, workers=1),
        read,
    )


def _cycle_each(mechanism: Mechanism, swept: Swept, d: Array, steps: int) -> Entry:
    remade = []
    for values in d.T:
        each = mechanism
        for dimension, value in zip(swept.dimensions, values, strict=True):
            held = next(one for one in _all(each) if one.name == dimension.name)
            each = change_dimension(each, held, float(value))
        remade.append(each)
    return Entry(
        "planar.cycle, design by design",
        True,
        np.arange(d.shape[1]),
        np.arange(steps + 1),
        lambda: [_cycle(each, steps) for each in remade],
        lambda found: _read(found, swept.point, steps),
    )


def _cycle(mechanism: Mechanism, steps: int) -> Motion | None:
    """A turn; None where it does not go together."""
    try:
        return planar.cycle(mechanism, steps, *_turn(mechanism))
    except planar.NoAnswer:
        return None


def _turn(mechanism: Mechanism) -> tuple[float, float]:
    start = mechanism.inputs[0].position
    return start, start + 2.0 * np.pi


def _all(mechanism: Mechanism) -> list:
    return list(link_lengths(mechanism, frozenset(link.name for link in mechanism.links)))


def _name_values(swept: Swept, d: Array) -> dict[str, Array]:
    return {dimension.name: values for dimension, values in zip(swept.dimensions, d, strict=True)}


def _read(found: list[Motion | None], point: str, steps: int) -> Array:
    told = np.full((6, steps + 1, len(found)), np.nan)
    for design, motion in enumerate(found):
        if motion is None:
            continue
        moved = motion.point(point)
        # a motion that ends before has its dead point after the last step that is on the grid
        known = steps + 1 if motion.outcome.value == "solved" else len(moved.position) - 1
        for order, values in enumerate((moved.position, moved.velocity, moved.acceleration)):
            told[2 * order : 2 * order + 2, :known, design] = values[:known].T
    return told
