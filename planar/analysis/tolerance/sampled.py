"""A result of many mechanisms whose numbers are drawn at random within their tolerances, each solved."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from planar.analysis.tolerance.variations import Variations
from planar.batch.results import Sweep
from planar.batch.sweep import sweep
from planar.document.dimensions import file_dimensions
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Drive, relative_motions, replace_inputs
from planar.results.motion import Motion, State

POINT_RESULTS = ("position", "velocity", "acceleration")
LINK_RESULTS = ("angle", "angular_velocity", "angular_acceleration")
STEP = 1e-3
"""rad or m: how far an input goes on where one position is wanted."""
UNIFORM = 1e-9


class Sampled(NamedTuple):
    """Deviations of so many mechanisms from the nominal: mean and standard deviation, the least and the greatest, the
    greatest distance `worst` and, of a motion, at each position; `unsolved` of the `mechanisms` are left out.

    `deviations` are all (mechanisms, n, parts).
    `within` is the share (n,) within the limit and `within_all` at all positions, None without one.
    """

    mechanisms: int
    unsolved: int
    mean: Array
    std: Array
    lower: Array
    upper: Array
    worst: Array
    deviations: Array
    within: Array | None = None
    within_all: float | None = None

    def __repr__(self) -> str:
        return short_repr(self)


class Draw(NamedTuple):
    """How mechanisms are drawn: how many, from which seed, and whether normally or uniformly within tolerances."""

    mechanisms: int
    seed: int
    sigmas: float
    is_normal: bool


def sample_deviations(  # many: what is asked of which result, and what varies
    source: State | Motion | Forces,
    of: str,
    result: str,
    variations: Variations,
    draw: Draw,
    by_pins: tuple[Array, Array],
    by_numbers: Array,
) -> Array:
    """Deviations (designs, n, parts), NaN of a mechanism that is not solved at a position.

    Inputs and pins, which a sweep does not vary, add what they do to the first order: slopes (n, parts, k) of the
    numbers, of pins (n, parts, m, 2) and how far these stand aside (n, m).
    """
    rng = np.random.default_rng(draw.seed)
    moving = source.moving if isinstance(source, Forces) else source
    drawn: dict[str, Array] = {}
    more: Array = np.zeros(1)
    for k, each in enumerate(variations.numbers):
        middle, half = 0.5 * (each.lower + each.upper), 0.5 * (each.upper - each.lower)
        unit = (
            rng.normal(size=draw.mechanisms) / draw.sigmas
            if draw.is_normal
            else rng.uniform(-1.0, 1.0, draw.mechanisms)
        )
        if each.number in {f"{given.pair}.{rate}" for given in moving.mechanism.inputs for rate in INPUT_RATES}:
            more = more + by_numbers[..., k] * (middle + half * unit)[:, None, None]
        else:
            drawn[each.number] = middle + half * unit
    slopes, radii = by_pins
    for m in range(len(variations.offsets)):
        angle = rng.uniform(0.0, 2.0 * np.pi, draw.mechanisms)
        unit = np.stack([np.cos(angle), np.sin(angle)], axis=1)
        more = more + np.einsum("npd,sd,n->snp", slopes[:, :, m], unit, radii[:, m])
    if not drawn:
        return np.broadcast_to(more, (draw.mechanisms, *by_numbers.shape[:2]))
    values = _solve(source, of, result, drawn)
    nominal = _solve(source, of, result, {name: np.zeros(1) for name in drawn})
    found = values - nominal
    if result in ("angle", "relative_angle"):
        found = np.remainder(found + np.pi, 2.0 * np.pi) - np.pi
    return found + more


INPUT_RATES = ("position", "velocity", "acceleration")


def summarise(deviations: Array, limit: tuple[float, float] | None) -> Sampled:
    """What samples (designs, n, parts) tell."""
    whole = np.isfinite(deviations).any(axis=(1, 2))
    known = deviations[whole]
    if not len(known):
        raise BadInput("samples", "none of the mechanisms could be solved; the tolerances may be too wide")
    sizes = np.linalg.norm(known, axis=2) if known.shape[2] > 1 else np.abs(known[..., 0])
    with np.errstate(invalid="ignore"):
        within = None
        if limit is not None:
            signed = sizes if known.shape[2] > 1 else known[..., 0]
            within = (signed <= limit[1]) & (signed >= limit[0])
        alive = np.isfinite(known)
        mean = np.where(alive, known, 0.0).sum(axis=0) / np.maximum(alive.sum(axis=0), 1)
        var = np.where(alive, known - mean, 0.0) ** 2
        std = np.sqrt(var.sum(axis=0) / np.maximum(alive.sum(axis=0) - 1, 1))
    return Sampled(
        len(deviations),
        int(np.sum(~whole)),
        mean,
        std,
        np.where(alive, known, np.inf).min(axis=0),
        np.where(alive, known, -np.inf).max(axis=0),
        np.where(np.isfinite(sizes), sizes, 0.0).max(axis=0),
        deviations,
        None if within is None else within.mean(axis=0),
        None if within is None else float((within | ~np.isfinite(sizes)).all(axis=1).mean()),
    )


def _solve(source: State | Motion | Forces, of: str, result: str, deviations: dict[str, Array]) -> Array:
    """The result (designs, n, parts) of mechanisms whose numbers deviate."""
    moving = source.moving if isinstance(source, Forces) else source
    drives = tuple(
        Drive(name, float(np.ravel(each.position)[0]), *(float(np.ravel(rate)[0]) for rate in each[1:3]))
        for name, each in moving.inputs.items()
    )
    mechanism = moving.mechanism if isinstance(moving, Motion) else replace_inputs(moving.mechanism, drives)
    known = file_dimensions(mechanism)
    designs = {name: known[name].value + each for name, each in deviations.items()}
    places = ("position", "angle", *_pair_values(moving, of)[:1])
    options: dict[str, Any] = {"rates": result not in places}
    if isinstance(source, Forces) and result in ("effort", "force", "couple"):
        options["efforts" if result == "effort" else "reactions"] = [of]
    elif of in moving._point_names and result in POINT_RESULTS:
        options["points"] = [of]
    elif of in moving.frames and result in LINK_RESULTS:
        options["links"] = [of]
    else:
        options["pairs"] = [of]
    if isinstance(moving, State):
        running = mechanism.inputs[0].pair
        start = mechanism.inputs[0].position
        swept = sweep(mechanism, designs, 1, start=start, stop=start + STEP, pair=running, **options)
        return _result(swept, moving, of, result)[:, :1]
    if moving.time is not None:
        swept = sweep(mechanism, designs, len(moving) - 1, duration=float(moving.time[-1]), **options)
        return _result(swept, moving, of, result)
    at = moving.inputs[moving.running_input].position
    if np.ptp(np.diff(at)) > UNIFORM * max(1.0, np.abs(at).max()):
        raise BadInput("samples", "mechanisms are sampled over a motion at equal steps of its input")
    swept = sweep(
        mechanism, designs, len(at) - 1, start=float(at[0]), stop=float(at[-1]), pair=moving.running_input, **options
    )
    return _result(swept, moving, of, result)


def _pair_values(moving: State | Motion, of: str) -> list[str]:
    motions = relative_motions(moving.mechanism)
    return list(motions[of].result_kinds)[:3] if of in motions else []


def _result(swept: Sweep, moving: State | Motion, of: str, result: str) -> Array:
    if of in swept.position and result in POINT_RESULTS:
        return np.asarray(getattr(swept, result)[of])
    if of in swept.angle and result in LINK_RESULTS:
        return np.asarray(getattr(swept, result)[of])[..., None]
    if result == "effort":
        return np.asarray(swept.effort[of])[..., None]
    if result == "force":
        return np.asarray(swept.reaction[of])
    if result == "couple":
        return np.asarray(swept.reaction_couple[of])[..., None]
    names = _pair_values(moving, of)
    if result not in names:
        raise BadInput("samples", f"{result!r} of {of!r} is not among what mechanisms are sampled for")
    own = (swept.value, swept.value_rate, swept.value_second_rate)[names.index(result)]
    return np.asarray(own[of])[..., None]
