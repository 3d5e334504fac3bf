"""A family of exact tasks: the rows of one structure for so many entries, and its members by their numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.relations.compiled_rows import CompiledRows
from planar.synthesis.exact.relations.unknowns import NumberKind


class Member(NamedTuple):
    """The numbers of one member: of each part (entries, numbers, 2), a number beside its conjugate; of a turn the angle
    (rad, complex) stands first."""

    parts: tuple[ComplexArray, ...]

    def towards(self, other: Member, way: float) -> Member:
        """A member on the straight way to another."""
        return Member(tuple(a + way * (b - a) for a, b in zip(self.parts, other.parts, strict=True)))


class FamilyPart(NamedTuple):
    """Rows that stand once for each entry (one: conditions); `kinds` of the numbers that an entry gives."""

    rows: CompiledRows
    kinds: tuple[NumberKind, ...]
    entry_count: int


class Family(NamedTuple):
    """`parts` with rows in 2 `size` unknowns: places first, then their conjugates; the first part's numbers are given
    to all others too, before their own."""

    size: int
    parts: tuple[FamilyPart, ...]

    @property
    def row_count(self) -> int:
        """How many equations."""
        return sum(each.rows.equation_count * each.entry_count for each in self.parts)

    def random_member(self, rng: np.random.Generator) -> Member:
        """A member with random complex numbers."""
        return Member(tuple(_random_numbers(rng, each) for each in self.parts))

    def rows_at(
        self,
        x: ComplexArray,
        begin: Member,
        change: Sequence[ComplexArray],
        way: Array | ComplexArray,
        turns_are_straight: bool = False,
    ) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Rows (rows, paths), Jacobian (rows, unknowns, paths) and derivative along the way (rows, paths) of solutions
        x (unknowns, paths), where numbers have gone a part `way` (paths,) of their change; of turns the angle, or e
        itself on a straight way."""
        many = x.shape[1]
        found = []
        first: tuple[list[ComplexArray], list[ComplexArray]] = ([], [])
        for k, part in enumerate(self.parts):
            q, dq = _values(part, begin.parts[k], change[k], way, turns_are_straight)
            if k == 0:
                first = ([each[0] for each in q], [each[0] for each in dq])
            if not part.rows.equation_count:
                continue
            own = (q, dq) if k else ([], [])
            f, slope, along = part.rows.evaluate(
                [*x], [*first[0], *own[0]], [*first[1], *own[1]], (part.entry_count, many)
            )
            rows = part.rows.equation_count * part.entry_count
            slope = slope.swapaxes(1, 2).reshape(rows, -1, many)
            found.append((f.reshape(rows, many), slope, along.reshape(rows, many)))
        return tuple(np.concatenate(each) for each in zip(*found, strict=True))  # type: ignore[return-value]


def _random_numbers(rng: np.random.Generator, part: FamilyPart) -> ComplexArray:
    shape = (part.entry_count, len(part.kinds), 2)
    found: ComplexArray = rng.normal(size=shape) + 1j * rng.normal(size=shape)
    for k, kind in enumerate(part.kinds):
        if kind is NumberKind.TURN:
            found[:, k, 0] = rng.uniform(-np.pi, np.pi, part.entry_count) + 0.5j * rng.normal(size=part.entry_count)
        if kind in (NumberKind.TURN, NumberKind.LENGTH):
            found[:, k, 1] = found[:, k, 0]
    return found


def _values(
    part: FamilyPart, begin: ComplexArray, change: ComplexArray, way: Array | ComplexArray, turns_are_straight: bool
) -> tuple[list[ComplexArray], list[ComplexArray]]:
    """What stands for the symbols of a part, conjugates beside them, and their derivatives: (entries, paths) each."""
    value = begin[..., None] + change[..., None] * way
    step = np.broadcast_to(change[..., None], value.shape)
    turns = [k for k, kind in enumerate(part.kinds) if kind is NumberKind.TURN]
    if turns and turns_are_straight:
        step = step.copy()
        value[:, turns, 0] = np.exp(1j * begin[:, turns, 0])[..., None] + change[:, turns, 0][..., None] * way
        value[:, turns, 1] = 1.0 / value[:, turns, 0]
        step[:, turns, 1] = -step[:, turns, 0] * value[:, turns, 1] ** 2
    elif turns:
        step = step.copy()
        angle = 1j * value[:, turns, 0]
        value[:, turns, 0], value[:, turns, 1] = np.exp(angle), np.exp(-angle)
        step[:, turns, 0] *= 1j * value[:, turns, 0]
        step[:, turns, 1] *= -1j * value[:, turns, 1]
    pairs = [(k, side) for k in range(len(part.kinds)) for side in (0, 1)]
    return [value[:, k, side] for k, side in pairs], [step[:, k, side] for k, side in pairs]
