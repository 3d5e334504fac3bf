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

MAX_CORRECTION = 0.1
"""Of the size of a solution: how far the proved one may be from it."""


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
            if box is not None and _distance(box, each) > MAX_CORRECTION * np.abs(each).max(initial=1.0):
                box = None  # that is another solution
            boxes.append(box)
            if box is not None:
                proved[k], half[k] = True, box.half
                exact[k] = [complex(one) for one in box.middle]
        proved = apart_boxes(exact, half, proved)
        for k, box in enumerate(boxes):
            real[k] = box is not None and proved[k] and is_own_image(box)
        return ExactCertificates(proved, real, exact)


def _distance(box: ProvedBox, x: ComplexArray) -> float:
    return float(np.abs(np.array([complex(number) for number in box.middle]) - x).max(initial=0.0))
