"""Ratios of the links' rates, from the linear equations round all loops at once: for what no two lines locate."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.polygons.loop_equations import loops
from planar.analysis.rate_equations import Pin, Rate, Rates, classes, moving
from planar.analysis.vector_chains import Known, Walks
from planar.solving.full_constraints import SINGULAR

Array = np.ndarray
ROUNDING = 1e-15
"""What equations and slopes are exact to, in the mechanism's size."""
EXACT = 1e-13
"""How exact a motion is at best, so that lines through centres that pairs show are preferred."""


class Choice(NamedTuple):
    """One motion of those that a position allows; None where it is not determined, and `why`."""

    way: Array | None
    why: str = ""
    condition: float = 1.0
    "by which rounding grows in it"


class Moved(NamedTuple):
    """Every link's motion against the frame as w times its pole (x, y, 1), in sizes about the middle.

    The greatest is of length one, so all are nothing where nothing can move. None where they are not determined.
    """

    links: Mapping[str, Array] | None
    why: str
    error: float


def chosen(free: Array, drives: Array, rates: Array) -> Choice:
    """The motion (n,) among orthonormal ones (n, ways): the only one, else that of the inputs' `rates` (inputs,).

    `drives` (inputs, n) is how fast the inputs move by unit rates; inputs that are not needed are not asked.
    """
    ways = free.shape[1]
    if ways == 0:
        return Choice(np.zeros(free.shape[0]))
    if ways == 1:
        return Choice(free[:, 0])
    seen = drives @ free
    values = np.linalg.svd(seen, compute_uv=False) if len(seen) >= ways else np.zeros(1)
    if values[-1] <= SINGULAR * max(1.0, values[0]):
        told = "" if len(drives) == 0 else ", and the inputs do not tell which"
        return Choice(None, f"the links may move in {ways} ways from this position{told}")
    if not np.any(rates):
        return Choice(None, "it depends on the ratio of the inputs' rates, which are not given or all zero")
    solved = np.linalg.lstsq(seen, rates, rcond=None)[0]
    if np.max(np.abs(seen @ solved - rates)) > SINGULAR * np.max(np.abs(rates)):
        return Choice(None, "the rates of the inputs contradict one another")
    return Choice(free @ solved, condition=float(values[0] / values[-1]))


def motions_of(rates: Rates, walks: Walks, middle: Array, size: float) -> Moved:
    """The motions of the links from positions and the inputs' rates alone: at rest or on a dead point as anywhere."""
    mechanism = rates.state.mechanism
    alike = classes(rates.ties)
    frame = alike.get(Rate(mechanism.frame), Rate(mechanism.frame))
    known = Known((mechanism.frame,), frozenset({frame}), alike)
    found = loops(walks, moving(mechanism), known, 1, inputs=False)
    every = [Rate(link) for link in moving(mechanism)] + [rate for slide in rates.slides for rate in slide.rates]
    unknown = dict.fromkeys(
        [*found.unknowns.values(), *(stands for rate in every if (stands := known.unknown(rate)) is not None)]
    )
    column = {rate: index for index, rate in enumerate(unknown)}
    if not column:
        return Moved({link.name: np.zeros(3) for link in mechanism.links}, "", ROUNDING)
    columns = np.array([1.0 if rate.turns else size for rate in column])  # slides in sizes
    matrix = np.zeros((len(found.equations), len(column)))
    for row, equation in enumerate(found.equations):
        by = 1.0 if equation.axis == "turns" else 1.0 / size
        for name, coefficient in equation.terms:
            matrix[row, column[found.unknowns[name]]] += by * coefficient
    scaled = matrix * columns
    _, values, ways = np.linalg.svd(np.vstack([scaled, np.zeros((1, len(column)))]))
    rank = int((values > SINGULAR * values.max(initial=0.0)).sum())
    drives, given = _drives(rates, known, column, columns, size)
    choice = chosen(ways[rank:].T, drives, given)
    if choice.way is None:
        return Moved(None, choice.why, 1.0)
    error = 10.0 * ROUNDING * choice.condition * (values[0] / values[rank - 1] if rank else 1.0)
    values_of = dict(zip(column, choice.way * columns, strict=True))
    return Moved(_poles(rates, walks, known, values_of, middle, size), "", max(EXACT, error))


def _drives(rates: Rates, known: Known, column: Mapping[Rate, int], columns: Array, size: float) -> tuple[Array, Array]:
    """How fast each input moves by unit rates (inputs, rates), and how fast it is to (inputs,), lengths in sizes."""
    ties = [tie for tie in rates.ties if tie.given]
    matrix, right = np.zeros((len(ties), len(column))), np.zeros(len(ties))
    velocities = {given.pair: given.velocity for given in rates.state.mechanism.inputs}
    for row, tie in enumerate(ties):
        by = 1.0 if any(rate.turns for rate in tie.slopes) else 1.0 / size
        right[row] = by * velocities[tie.pair]
        for rate, slope in tie.slopes.items():
            stands = known.unknown(rate)
            if stands in column:
                matrix[row, column[stands]] += by * slope * columns[column[stands]]
    return matrix, right


def _poles(
    rates: Rates, walks: Walks, known: Known, values: Mapping[Rate, float], middle: Array, size: float
) -> dict[str, Array]:
    """Each link's motion, carried on from joint to joint."""

    def value(rate: Rate) -> float:
        stands = known.unknown(rate)
        return 0.0 if stands is None else values.get(stands, 0.0)

    frame = rates.state.mechanism.frame
    poles, waiting = {frame: np.zeros(3)}, [frame]
    while waiting:
        link = waiting.pop(0)
        for joint in walks.joints(link):
            for other in joint.members:
                if other in poles:
                    continue
                place = walks.end(joint, link)
                x, y = (walks.at(place) - middle) / size
                mx, my, turning = poles[link]
                speed = np.array([my - turning * y, turning * x - mx])
                if not isinstance(joint, Pin):
                    sign = 1.0 if other == joint.rider else -1.0
                    speed = speed + sum(
                        sign * value(r) * w / size for w, r in zip(joint.ways, joint.rates, strict=True)
                    )
                turns = value(Rate(other))
                poles[other] = np.array([turns * x - speed[1], turns * y + speed[0], turns])
                waiting.append(other)
    most = max(float(np.linalg.norm(pole)) for pole in poles.values())
    return {link: pole / most for link, pole in poles.items()} if most else poles
