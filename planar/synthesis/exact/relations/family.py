"""A family of exact tasks: the rows of one structure for so many entries, and its members by their numbers."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array, ComplexArray
from planar.synthesis.exact.relations.compiled_rows import CompiledRows
from planar.synthesis.exact.relations.exact_numbers import ExactNumber
from planar.synthesis.exact.relations.unknowns import NumberKind


class Member(NamedTuple):
    """The numbers of one member: of each part (entries, numbers, 2), a number beside its conjugate; of a turn the angle
    (rad, complex) stands first. `exact` are those of a task, entry by entry, as its file has them."""

    parts: tuple[ComplexArray, ...]
    exact: tuple[list[list[ExactNumber]], ...] | None = None

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

    def part_rows(self, k: int) -> slice:
        """Where the rows of a part stand among all."""
        counts = [part.rows.equation_count * part.entry_count for part in self.parts]
        return slice(sum(counts[:k]), sum(counts[: k + 1]))

    def number_values(self, member: Member, k: int) -> ComplexArray:
        """What stands for the symbols of a part's numbers, conjugates beside them (symbols, entries)."""
        still = np.zeros_like(member.parts[k])
        return _values(self.parts[k], member.parts[k], still, np.zeros(1), False)[0][..., 0]

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
        itself on a straight way. Numbers may have a last axis of paths."""
        count = x.shape[1]
        f: ComplexArray = np.empty((self.row_count, count), dtype=x.dtype)
        jacobian: ComplexArray = np.empty((self.row_count, len(x), count), dtype=x.dtype)
        along = np.empty_like(f)
        for k, part in enumerate(self.parts):
            q, dq = _values(part, begin.parts[k], change[k], way, turns_are_straight)
            if k == 0:
                first = q, dq
            blocks = ([q], [dq]) if k == 0 else ([first[0], q], [first[1], dq])
            if not part.rows.equation_count:
                continue
            values, slopes, changes = part.rows.evaluate(x, *blocks)
            rows = self.part_rows(k)
            f[rows], along[rows] = values.reshape(-1, count), changes.reshape(-1, count)
            jacobian[rows].reshape(part.rows.equation_count, part.entry_count, -1, count)[...] = slopes.transpose(
                1, 2, 0, 3
            )
        return f, jacobian, along


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
) -> tuple[ComplexArray, ComplexArray]:
    """What stands for the symbols of a part, conjugates beside them, and their derivatives: (numbers, entries, paths)
    each."""
    begin, change = (each if each.ndim == 4 else each[..., None] for each in (begin, change))
    value = begin + change * way
    step = np.empty_like(value)
    step[...] = change
    for k, kind in enumerate(part.kinds):
        if kind is not NumberKind.TURN:
            continue
        if turns_are_straight:
            value[:, k, 0] = np.exp(1j * begin[:, k, 0]) + change[:, k, 0] * way
            value[:, k, 1] = 1.0 / value[:, k, 0]
            step[:, k, 1] = -step[:, k, 0] * value[:, k, 1] ** 2
        else:
            angle = 1j * value[:, k, 0]
            value[:, k, 0], value[:, k, 1] = np.exp(angle), np.exp(-angle)
            step[:, k, 0] *= 1j * value[:, k, 0]
            step[:, k, 1] *= -1j * value[:, k, 1]
    shape = (2 * len(part.kinds), len(value), value.shape[-1])
    return value.transpose(1, 2, 0, 3).reshape(shape), step.transpose(1, 2, 0, 3).reshape(shape)
