"""Solutions of a member of a family proved, each to be the only one in a box of its own, and real or not."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from planar.assemblies.polynomial.krawczyk import (
    ProvedBox,
    apart_boxes,
    ball,
    ball_precision,
    direction_ball,
    is_own_image,
    polished_balls,
    prove_box,
)
from planar.foundation.arrays import BoolArray, ComplexArray
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind


class ExactCertificates(NamedTuple):
    """Of every solution: whether it is proved, and proved to be real; `x` are the solutions to the last digit."""

    proved: BoolArray
    is_real: BoolArray
    x: ComplexArray


def certify_member(family: Family, member: Member, x: ComplexArray) -> ExactCertificates:
    """What is proved of solutions x (solutions, unknowns) of a real member, whose numbers are the floats they are."""
    with ball_precision():
        equations = _MemberInBalls(family, member)
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
        proved = apart_boxes(exact, half, proved)
        for k, box in enumerate(boxes):
            real[k] = box is not None and proved[k] and is_own_image(box)
        return ExactCertificates(proved, real, exact)


class _MemberInBalls:
    def __init__(self, family: Family, member: Member):
        self.parts: list[tuple[Any, list[list[Any]]]] = []
        given: list[Any] = []
        for k, (part, numbers) in enumerate(zip(family.parts, member.parts, strict=True)):
            rows = [_in_balls(part.kinds, entry) for entry in numbers]
            if k == 0:
                given = rows[0]
            self.parts.append((part.rows, [given] if k == 0 else [[*given, *own] for own in rows]))

    def __call__(self, w: Sequence[Any]) -> tuple[list[Any], list[list[Any]]]:
        f: list[Any] = []
        slope: list[list[Any]] = []
        for rows, entries in self.parts:
            if not rows.equation_count:
                continue
            for numbers in entries:
                own, own_slope = rows.evaluate_as(w, numbers)
                f += own
                slope += own_slope
        return f, slope


def _in_balls(kinds: Sequence[NumberKind], numbers: ComplexArray) -> list[Any]:
    found = []
    for kind, (value, other) in zip(kinds, numbers, strict=True):
        if kind is NumberKind.TURN:
            way = direction_ball(float(value.real))
            found += [way, way.conjugate()]
        else:
            found += [ball(complex(value)), ball(complex(other))]
    return found
