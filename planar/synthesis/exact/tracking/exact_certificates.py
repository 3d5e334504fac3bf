"""Solutions of a member of a family proved, each to be the only one in a box of its own, and real or not."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.assemblies.polynomial.krawczyk import (
    ProvedBox,
    apart_boxes,
    ball_precision,
    is_own_image,
    polished_balls,
    prove_box,
)
from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.tracking.member_in_balls import MemberInBalls

SAME = 1e-9
"""Of the size of a solution: two that are nearer to each other are one."""
MAX_CORRECTION = 0.1
"""Of the size of a solution: one that moves farther as it is polished may have come to another one."""


class ExactCertificates(NamedTuple):
    """Of every solution: whether it is proved, and proved to be real; `x` are the solutions to the last digit."""

    proved: BoolArray
    is_real: BoolArray
    x: ComplexArray


def certify_member(family: Family, member: Member, x: ComplexArray) -> ExactCertificates:
    """What is proved of solutions x (solutions, unknowns) of a real member, whose numbers are the floats they are."""
    with ball_precision():
        equations = MemberInBalls(family, member)
        proved, real = np.zeros(len(x), dtype=bool), np.zeros(len(x), dtype=bool)
        half = np.full(len(x), np.inf)
        exact = x.copy()
        boxes: list[ProvedBox | None] = []
        for k, each in enumerate(x):
            middle = polished_balls(equations, each)
            box = prove_box(equations, middle) if middle is not None else None
            boxes.append(box)
            if box is not None:
                proved[k], half[k] = True, box.half
                exact[k] = [complex(one) for one in box.middle]
        correction = np.abs(exact - x).max(axis=1, initial=0.0) / np.abs(x).max(axis=1, initial=1.0)
        for k in np.flatnonzero(correction > MAX_CORRECTION).tolist():
            distance = np.abs(np.delete(exact, k, axis=0) - exact[k]).max(axis=1, initial=0.0)
            if distance.min(initial=np.inf) < SAME * np.abs(exact[k]).max(initial=1.0):
                boxes[k], proved[k], half[k], exact[k] = None, False, np.inf, x[k]  # polished to another one
        proved = apart_boxes(exact, half, proved)
        for k, box in enumerate(boxes):
            real[k] = box is not None and proved[k] and is_own_image(box)
        return ExactCertificates(proved, real, exact)
