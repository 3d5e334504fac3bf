"""Random complex linkages: unknowns at random, numbers that fit them, and entries where the linkage moves to.

The solutions of a random member may be several irreducible sets, of which some hold no linkage (isotropic directions,
links of no length). Unknowns at random are those of a linkage, and its kinematics keep it one.
"""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import BoolArray, ComplexArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind

TRIES, STEPS = 60, 40
CLOSED = 1e-11
"""Of the size of rows: what they may leave at a solution."""
REGULAR, DEGENERATE = 1e-7, 1e-6
"""Least singular value, of the greatest, of a solution that counts once, and what vanishes at no linkage."""


def first_solution(family: Family, rng: np.random.Generator) -> tuple[Member, ComplexArray]:
    """A member and unknowns (2 size,) of a random linkage that solve it. Raises NoAnswer."""
    for _ in range(TRIES):
        linkage = _RandomLinkage(family, rng)
        if linkage.meet_conditions() and linkage.move() and linkage.is_regular():
            return linkage.member, linkage.x
    raise NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, "no random mechanism of this kind was found")


class _RandomLinkage:
    def __init__(self, family: Family, rng: np.random.Generator):
        self.family, self.rng = family, rng
        self.member = family.random_member(rng)
        count = 2 * family.size
        self.x: ComplexArray = rng.normal(size=count) + 1j * rng.normal(size=count)

    def meet_conditions(self) -> bool:
        """Choose the given numbers so that the conditions hold, and unknowns for conditions without any."""
        rows = self.family.parts[0].rows.equation_count
        if not rows:
            return True
        _, by_unknowns, by_numbers = self._linearise(0)
        has_numbers = np.abs(by_numbers).max(axis=1, initial=0.0) > 0.0
        unknowns, numbers = by_unknowns.shape[1], by_numbers.shape[1]
        in_unknowns = np.arange(unknowns + numbers) < unknowns
        return (
            (has_numbers.all() or self._solve_conditions(~has_numbers, in_unknowns))
            and (not has_numbers.any() or self._solve_conditions(has_numbers, ~in_unknowns))
        ) or self._solve_conditions(np.ones(rows, dtype=bool), np.ones(unknowns + numbers, dtype=bool))

    def _solve_conditions(self, rows: BoolArray, columns: BoolArray) -> bool:
        """Newton's steps of least length in some columns, unknowns before given numbers."""
        for _ in range(STEPS):
            f, by_unknowns, by_numbers = self._linearise(0)
            slope = np.where(columns, np.concatenate([by_unknowns, by_numbers], axis=1), 0.0)[rows]
            if not np.isfinite(slope).all():
                return False
            size = np.abs(slope).sum(axis=1)
            if (np.abs(f[rows]) <= CLOSED * size).all():
                return True
            step = _limited(-np.linalg.lstsq(slope, f[rows], rcond=1e-12)[0])
            self.x = self.x + step[: len(self.x)]
            self._change_numbers(0, step[len(self.x) :][None])
        return False

    def move(self) -> bool:
        """Choose the numbers of every entry so that its rows vanish where the unknowns are."""
        for k, part in enumerate(self.family.parts):
            if k == 0 or not part.rows.equation_count:
                continue
            is_open = np.ones(part.entry_count, dtype=bool)
            for _ in range(TRIES):
                is_open &= ~self._solve_entries(k)
                if not is_open.any():
                    break
                self.member.parts[k][is_open] = self.family.random_member(self.rng).parts[k][is_open]
            if is_open.any():
                return False
        return True

    def _solve_entries(self, k: int) -> BoolArray:
        """Newton's steps of least length in the numbers of each entry; which entries (entries,) come to a linkage."""
        part = self.family.parts[k]
        for _ in range(STEPS):
            f, _, slope = self._linearise(k)
            f, slope = (np.moveaxis(each.reshape(-1, part.entry_count, *each.shape[1:]), 1, 0) for each in (f, slope))
            is_finite = np.asarray(np.isfinite(slope).all(axis=(1, 2)) & np.isfinite(f).all(axis=1))
            slope = np.where(is_finite[:, None, None], slope, 0.0)
            is_closed = is_finite & (np.abs(f) <= CLOSED * np.abs(slope).sum(axis=2)).all(axis=1)
            if is_closed.all():
                break
            step = -(np.linalg.pinv(slope) @ np.where(is_finite[:, None], f, 0.0)[..., None])[..., 0]
            self._change_numbers(k, np.array([_limited(each) for each in step]))
        first, own = (self.family.number_values(self.member, each) for each in (0, k))
        sizes = part.rows.nonzero_values(
            self.x, np.concatenate([np.broadcast_to(first, (len(first), part.entry_count)), own])
        )
        closed: BoolArray = is_closed & (sizes > DEGENERATE).all(axis=0)
        return closed

    def is_regular(self) -> bool:
        """Whether the member has this solution once."""
        still = [np.zeros_like(each) for each in self.member.parts]
        slope = self.family.rows_at(self.x[:, None], self.member, still, np.zeros(1))[1]
        size = np.linalg.norm(slope[..., 0], axis=1, keepdims=True)
        if not np.isfinite(slope).all() or not (size > 0.0).all():
            return False
        values = np.linalg.svd(slope[..., 0] / size, compute_uv=False)
        return bool(values[-1] > REGULAR * values[0])

    def _linearise(self, k: int) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
        """Rows of a part, and their derivatives by unknowns and by the numbers of an entry (rows, numbers)."""
        directions = _directions(self.family.parts[k].kinds)
        count = max(1, len(directions))
        change = [np.zeros((*each.shape, count), dtype=complex) for each in self.member.parts]
        for n, (number, sides) in enumerate(directions):
            change[k][:, number, sides, n] = 1.0
        x = np.repeat(self.x[:, None], count, axis=1)
        f, slope, along = self.family.rows_at(x, self.member, change, np.zeros(count))
        rows = self.family.part_rows(k)
        return f[rows, 0], slope[rows, :, 0], along[rows, : len(directions)]

    def _change_numbers(self, k: int, step: ComplexArray) -> None:
        """Move the numbers of each entry of a part by steps (entries, numbers)."""
        for n, (number, sides) in enumerate(_directions(self.family.parts[k].kinds)):
            for side in sides:
                self.member.parts[k][:, number, side] += step[:, n]


def _directions(kinds: tuple[NumberKind, ...]) -> list[tuple[int, list[int]]]:
    """The numbers of an entry that may change on their own, and which of a pair do."""
    result = []
    for number, kind in enumerate(kinds):
        is_one = kind in (NumberKind.TURN, NumberKind.LENGTH)
        result += [(number, sides) for sides in ([[0, 1]] if is_one else [[0], [1]])]
    return result


def _limited(step: ComplexArray) -> ComplexArray:
    return step * min(1.0, 1.0 / max(float(np.abs(step).max(initial=0.0)), 1e-300))
