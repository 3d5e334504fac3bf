"""Ratios of the links' rates from the linear equations of all loops at once: for centres that no two lines locate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.polygons.loop_equations import loop_equations
from planar.analysis.rate_equations import PinJoint, Rate, RateEquations, moving_links, turning_classes
from planar.analysis.vector_chains import KnownRates, VectorChains
from planar.foundation.arrays import Array
from planar.solving.checks import SINGULAR_TOLERANCE

ROUNDING = 1e-15
"""What equations and slopes are exact to, in the mechanism's size."""
LEAST_ERROR = 1e-13
"""How exact a motion is at best, so that lines through centres that pairs show are preferred."""


class ChosenMotion(NamedTuple):
    """One motion of those that a position allows; None where it is not determined, and `why`."""

    motion: Array | None
    reason: str = ""
    condition: float = 1.0
    "by which rounding grows in it"


class LinkPoles(NamedTuple):
    """Every link's motion against the frame as w times its pole (x, y, 1), in sizes about the middle.

    The greatest is of length one, so all are nothing where nothing can move. None where they are not determined.
    """

    links: Mapping[str, Array] | None
    reason: str
    error: float


def choose_motion(motions: Array, input_rows: Array, rates: Array) -> ChosenMotion:
    """The motion (n,) among orthonormal ones (n, ways): the only one, else that of the inputs' `rates` (inputs,).

    `drives` (inputs, n) is how fast the inputs move by unit rates; inputs that are not needed are not asked.
    """
    ways = motions.shape[1]
    if ways == 0:
        return ChosenMotion(np.zeros(motions.shape[0]))
    if ways == 1:
        return ChosenMotion(motions[:, 0])
    seen = input_rows @ motions
    values = np.linalg.svd(seen, compute_uv=False) if len(seen) >= ways else np.zeros(1)
    if values[-1] <= SINGULAR_TOLERANCE * max(1.0, values[0]):
        told = "" if len(input_rows) == 0 else ", and the inputs do not tell which"
        return ChosenMotion(None, f"the links may move in {ways} ways from this position{told}")
    if not np.any(rates):
        return ChosenMotion(None, "it depends on the ratio of the inputs' rates, which are not given or all zero")
    solved = np.linalg.lstsq(seen, rates, rcond=None)[0]
    if np.max(np.abs(seen @ solved - rates)) > SINGULAR_TOLERANCE * np.max(np.abs(rates)):
        return ChosenMotion(None, "the rates of the inputs contradict one another")
    return ChosenMotion(motions @ solved, condition=float(values[0] / values[-1]))


def solve_link_poles(equations: RateEquations, chains: VectorChains, middle: Array, size: float) -> LinkPoles:
    """The motions of the links from positions and the inputs' rates alone: at rest or on a dead point as anywhere."""
    mechanism = equations.state.mechanism
    alike = turning_classes(equations.equations)
    frame = alike.get(Rate(mechanism.frame), Rate(mechanism.frame))
    known = KnownRates((mechanism.frame,), frozenset({frame}), alike)
    found = loop_equations(chains, moving_links(mechanism), known, 1, inputs=False)
    every = [Rate(link) for link in moving_links(mechanism)] + [
        rate for slide in equations.slides for rate in slide.rates
    ]
    unknown = dict.fromkeys(
        [*found.unknowns.values(), *(stands for rate in every if (stands := known.unknown_rate(rate)) is not None)]
    )
    column = {rate: index for index, rate in enumerate(unknown)}
    if not column:
        return LinkPoles({link.name: np.zeros(3) for link in mechanism.links}, "", ROUNDING)
    columns = np.array([1.0 if rate.is_angular else size for rate in column])  # slides in sizes
    matrix = np.zeros((len(found.equations), len(column)))
    for row, equation in enumerate(found.equations):
        by = 1.0 if equation.axis == "turns" else 1.0 / size
        for name, coefficient in equation.terms:
            matrix[row, column[found.unknowns[name]]] += by * coefficient
    scaled = matrix * columns
    _, values, ways = np.linalg.svd(np.vstack([scaled, np.zeros((1, len(column)))]))
    rank = int((values > SINGULAR_TOLERANCE * values.max(initial=0.0)).sum())
    drives, given = _input_rows(equations, known, column, columns, size)
    choice = choose_motion(ways[rank:].T, drives, given)
    if choice.motion is None:
        return LinkPoles(None, choice.reason, 1.0)
    error = 10.0 * ROUNDING * choice.condition * (values[0] / values[rank - 1] if rank else 1.0)
    values_of = dict(zip(column, choice.motion * columns, strict=True))
    return LinkPoles(_carry_poles(equations, chains, known, values_of, middle, size), "", max(LEAST_ERROR, error))


def _input_rows(
    equations: RateEquations, known: KnownRates, column: Mapping[Rate, int], columns: Array, size: float
) -> tuple[Array, Array]:
    """How fast each input moves by unit rates (inputs, rates), and how fast it is to (inputs,), lengths in sizes."""
    ties = [tie for tie in equations.equations if tie.is_input]
    matrix, right = np.zeros((len(ties), len(column))), np.zeros(len(ties))
    velocities = {given.pair: given.velocity for given in equations.state.mechanism.inputs}
    for row, tie in enumerate(ties):
        by = 1.0 if any(rate.is_angular for rate in tie.coefficients) else 1.0 / size
        right[row] = by * velocities[tie.pair]
        for rate, slope in tie.coefficients.items():
            stands = known.unknown_rate(rate)
            if stands is not None and stands in column:
                matrix[row, column[stands]] += by * slope * columns[column[stands]]
    return matrix, right


def _carry_poles(
    equations: RateEquations,
    chains: VectorChains,
    known: KnownRates,
    values: Mapping[Rate, float],
    middle: Array,
    size: float,
) -> dict[str, Array]:
    """Each link's motion, carried on from joint to joint."""

    def value(rate: Rate) -> float:
        stands = known.unknown_rate(rate)
        return 0.0 if stands is None else values.get(stands, 0.0)

    frame = equations.state.mechanism.frame
    poles: dict[str, Array] = {frame: np.zeros(3)}
    waiting = [frame]
    while waiting:
        link = waiting.pop(0)
        for joint in chains.joints(link):
            for other in joint.members:
                if other in poles:
                    continue
                place = chains.joint_point(joint, link)
                x, y = (chains.point_position(place) - middle) / size
                mx, my, turning = poles[link]
                speed = np.array([my - turning * y, turning * x - mx])
                if not isinstance(joint, PinJoint):
                    sign = 1.0 if other == joint.rider else -1.0
                    speed = speed + sum(
                        sign * value(r) * w / size for w, r in zip(joint.directions, joint.rates, strict=True)
                    )
                turns = value(Rate(other))
                poles[other] = np.array([turns * x - speed[1], turns * y + speed[0], turns])
                waiting.append(other)
    most = max(float(np.linalg.norm(pole)) for pole in poles.values())
    return {link: pole / most for link, pole in poles.items()} if most else poles
