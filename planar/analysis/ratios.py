"""Ratios of the links' rates, from the linear equations round all loops at once: for what no two lines locate."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from planar.analysis.loops import loops
from planar.analysis.ties import Pin, Rate, Rates, classes, moving
from planar.analysis.walks import Known, Walks

Array = np.ndarray
NONE = 1e-10
"""A singular value below this part of the greatest is none."""


def motions_of(rates: Rates, walks: Walks, middle: Array, size: float) -> dict[str, Array] | None:
    """Every link's motion against the frame as w times its pole (x, y, 1), in sizes about the middle; of length one.

    With several inputs it is the motion at their given rates. None where it is not determined: no input moves, or
    links could move that the inputs do not drive.
    """
    mechanism = rates.state.mechanism
    alike = classes(rates.ties)
    frame = alike.get(Rate(mechanism.frame), Rate(mechanism.frame))
    known = Known((mechanism.frame,), frozenset({frame}), alike)
    several = len(mechanism.inputs) > 1
    found = loops(walks, moving(mechanism), known, 1, inputs=several)
    every = dict.fromkeys(
        [Rate(link) for link in moving(mechanism)] + [r for slide in rates.slides for r in slide.rates]
    )
    unknown = {stands: None for rate in every if (stands := known.unknown(rate)) is not None}
    unknowns = dict(found.unknowns) | {str(rate): rate for rate in unknown if rate not in found.unknowns.values()}
    names = list(unknowns)
    matrix = np.zeros((len(found.equations), len(names)))
    for row, equation in enumerate(found.equations):
        for name, coefficient in equation.terms:
            matrix[row, names.index(name)] = coefficient
    right = np.array([e.known for e in found.equations])
    turns = np.array([rate.turns for rate in unknowns.values()], dtype=bool)
    columns = np.where(turns, 1.0, size)  # slides in sizes
    rows = np.array([1.0 if e.axis == "turns" else 1.0 / size for e in found.equations])
    scaled = rows[:, None] * matrix * columns
    _, values, ways = np.linalg.svd(np.vstack([scaled, np.zeros((1, len(names)))]))
    free = ways[int((values > NONE * values.max(initial=0.0)).sum()) :]
    if several:
        if len(free) or not np.any(right):
            return None
        solved = np.linalg.lstsq(scaled, rows * right, rcond=None)[0]
    elif len(free) == 1:
        solved = free[0]
    else:
        return None
    values_of = dict(zip(unknowns.values(), solved * columns, strict=True))
    return _poles(rates, walks, known, values_of, middle, size)


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
