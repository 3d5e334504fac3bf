"""Random four-bars and slider-cranks with the ranges of their inputs in closed form.

`python -m tests.ranges 1000` compares so many of each; the suite takes fewer.
"""

from __future__ import annotations

import sys
from typing import NamedTuple

import numpy as np

import planar
from planar.document import files
from planar.model.mechanism import Mechanism
from tests.builders import four_bar_document, slider_crank_document

TURN = 2.0 * np.pi
ALMOST = 1e-3
"""Sizes: closer than this to a change-point linkage a limit is known to less than the 1e-12 that is asked for: with the
root of the distance, so 1e-16 / 0.03 for an ulp of a length."""
SHORT = 1e-3
"""rad or sizes: a whole range that is shorter is left out, for the same reason."""


class Case(NamedTuple):
    """A mechanism, its input, and the two ends of the input's range."""

    mechanism: Mechanism
    pair: str
    ends: tuple[float, float]


def four_bar(rng: np.random.Generator, lengths: tuple[float, ...] | None = None) -> Case | None:
    """Any four-bar of Grashof's or not, its crank anywhere in its range; None near a change-point linkage, unless these
    are its `lengths`.

    The crank a turns as far as the triangle of the coupler b and the follower c on the diagonal f can be closed,
    |b - c| <= f <= b + c, where f^2 = a^2 + d^2 - 2 a d cos(theta).
    """
    a, b, c, d = rng.uniform(0.3, 2.0, 4) if lengths is None else lengths
    low, high = (np.sign(gap) * np.sqrt(abs(gap)) for gap in ((d - a) ** 2 - (b - c) ** 2, (b + c) ** 2 - (d + a) ** 2))
    least = min(abs(a + b - c - d), abs(a + c - b - d), abs(a + d - b - c), abs(b + c + a - d), abs(b + c + d - a))
    if lengths is None and least < ALMOST:
        return None
    if abs(d - a) > b + c or d + a < abs(b - c):
        return None  # cannot be assembled at all
    # half-angle formulas: cosines lose half of the digits near 0 and pi
    first = 0.0 if low > 0.0 else 2.0 * np.arcsin(np.sqrt((b - c - d + a) * (b - c + d - a) / (4.0 * a * d)))
    last = np.pi if high > 0.0 else 2.0 * np.arccos(np.sqrt((d + a - b - c) * (d + a + b + c) / (4.0 * a * d)))
    if last - first < SHORT:
        return None
    theta = rng.uniform(first + 0.01 * (last - first), last - 0.01 * (last - first))
    if first == 0.0 and last == np.pi:
        ends = (theta, theta + TURN)
    elif first == 0.0:
        ends = (-last, last)
    else:
        ends = (first, last) if last < np.pi else (first, TURN - first)
    return _case(four_bar_document(a, b, c, d, float(theta)), "A", "C", ends, rng)


def beside(rng: np.random.Generator) -> tuple[Case, float] | None:
    """A four-bar whose lengths miss those of a change-point linkage by little, and by how much."""
    a, b, c, _ = rng.uniform(0.3, 2.0, 4)
    gap = rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-11.0, -8.0)
    d = (a + b - c, a + c - b, b + c - a)[rng.integers(3)] + gap
    case = four_bar(rng, (a, b, c, d)) if d > 0.1 else None
    return case and (case, abs(gap))


def slider_crank(rng: np.random.Generator) -> Case | None:
    """A slider-crank driven at its crank r: the line is within the rod's reach, |r sin(theta) - e| <= l."""
    r, rod = rng.uniform(0.3, 2.0, 2)
    e = rng.uniform(-1.0, 1.0)
    up, down = (rod + e) / r, (rod - e) / r  # sin(theta) between -down and up
    if min(abs(up - 1.0), abs(down - 1.0), abs(up + 1.0), abs(down + 1.0)) < ALMOST or min(up, down) < -1.0:
        return None
    high = np.arcsin(up) if up < 1.0 else np.pi / 2
    low = -np.arcsin(down) if down < 1.0 else -np.pi / 2
    if high - low < SHORT:
        return None
    theta = rng.uniform(low + 0.01 * (high - low), high - 0.01 * (high - low))
    if up > 1.0 and down > 1.0:
        ends = (theta, theta + TURN)
    elif up > 1.0:
        ends = (low, np.pi - low)
    elif down > 1.0:
        ends = (-np.pi - high, high)
    else:
        ends = (low, high)
    return _case(slider_crank_document(r, rod, float(theta), e, slide="s"), "O", "B", ends, rng)


def driven_slide(rng: np.random.Generator) -> Case | None:
    """An offset slider-crank driven at its block: |r - l| <= sqrt(x^2 + e^2) <= r + l, on one side of the crank's pin
    where the block cannot pass it."""
    r, rod = rng.uniform(0.3, 2.0, 2)
    e = rng.uniform(-1.0, 1.0)
    near, far = abs(r - rod), r + rod
    if far - abs(e) < ALMOST or abs(near - abs(e)) < ALMOST or near < ALMOST:
        return None
    last = np.sqrt((far - e) * (far + e))
    first = -last if abs(e) > near else np.sqrt((near - e) * (near + e))
    x = rng.uniform(first + 0.01 * (last - first), last - 0.01 * (last - first))
    ends = (first, last)
    if first > 0.0 and rng.random() < 0.5:
        x, ends = -x, (-last, -first)
    return _case(slider_crank_document(r, rod, float(x), e, slide="s", driven="s"), "s", "A", ends, rng)


def _case(value, pair, pin, ends, rng) -> Case:
    """The mechanism in either of its assemblies, as this pin is sketched."""
    value["sketch"] = {pin: rng.uniform(-2.0, 2.0, 2).tolist()}
    return Case(files.from_dict(value), pair, (float(ends[0]), float(ends[1])))


KINDS = {"four-bar": four_bar, "slider-crank": slider_crank, "driven slide": driven_slide}


def cases(kind: str, count: int) -> tuple[list[Case], int]:
    """So many random linkages of a kind that can move, and how many were left out before."""
    rng = np.random.default_rng(20_240_601)
    found: list[Case] = []
    left_out = 0
    while len(found) < count:
        case = KINDS[kind](rng)
        if case is None:
            left_out += 1
        else:
            found.append(case)
    return found, left_out


def off(case: Case, steps: int) -> float:
    """How far the ends of the range are from the closed form (rad or m)."""
    motion = planar.cycle(case.mechanism, steps)
    return float(np.abs(motion.inputs[case.pair].position[[0, -1]] - case.ends).max())


def main(count: int) -> None:
    """Compare so many of each kind."""
    for kind in KINDS:
        some, _ = cases(kind, count)
        gaps = np.array([off(case, 60 if case.ends[1] - case.ends[0] == TURN else 1) for case in some])
        print(f"{kind}: {count} ranges, the worst {gaps.max():.2g} from the closed form; {np.sum(gaps > 1e-12)} over")


if __name__ == "__main__":
    main(int(sys.argv[1]))
