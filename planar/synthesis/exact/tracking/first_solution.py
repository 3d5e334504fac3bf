"""One random solution of a random member: a random mechanism, and the entries that it meets."""

from __future__ import annotations

import numpy as np

from planar.foundation.arrays import ComplexArray
from planar.foundation.errors import NoAnswer, Outcome
from planar.synthesis.exact.relations.family import Family, Member
from planar.synthesis.exact.relations.unknowns import NumberKind

TRIES, STEPS = 200, 60
CLOSED = 1e-12


def first_solution(family: Family, rng: np.random.Generator) -> tuple[Member, ComplexArray]:
    """A member and unknowns (2 size,) that solve it, found by Newton's steps of least length in unknowns and numbers
    together. Raises NoAnswer."""
    for _ in range(TRIES):
        member = family.random_member(rng)
        x = rng.normal(size=2 * family.size) + 1j * rng.normal(size=2 * family.size)
        found = _solve(family, member, x)
        if found is not None:
            return found
    raise NoAnswer(Outcome.CANNOT_BE_ASSEMBLED, "no random mechanism of this kind was found")


def _solve(family: Family, member: Member, x: ComplexArray) -> tuple[Member, ComplexArray] | None:
    directions = list(_directions(family))
    for _ in range(STEPS):
        f, slope, columns = _linearise(family, member, x, directions)
        whole = np.concatenate([slope, columns], axis=1)
        if not np.all(np.isfinite(whole)):
            return None
        if np.abs(f).max() < CLOSED:
            values = np.linalg.svd(slope, compute_uv=False)
            return (member, x) if values[-1] > 1e-6 * values[0] else None
        step = -np.linalg.lstsq(whole, f, rcond=1e-12)[0]
        step *= min(1.0, 1.0 / max(float(np.abs(step).max()), 1e-300))
        x = x + step[: len(x)]
        parts = [each.copy() for each in member.parts]
        for each, change in zip(directions, step[len(x) :], strict=True):
            for k, part in enumerate(each.parts):
                parts[k] += change * part
        member = Member(tuple(parts))
    return None


def _directions(family: Family) -> list[Member]:
    """A member of each number that may change, one where it does."""
    found = []
    for k, part in enumerate(family.parts):
        if not k and not part.rows.equation_count:
            continue  # what entries give is enough
        for entry in range(part.entry_count):
            for n, kind in enumerate(part.kinds):
                for sides in [(0, 1)] if kind in (NumberKind.TURN, NumberKind.LENGTH) else [(0,), (1,)]:
                    parts = [np.zeros((each.entry_count, len(each.kinds), 2), dtype=complex) for each in family.parts]
                    for side in sides:
                        parts[k][entry, n, side] = 1.0
                    found.append(Member(tuple(parts)))
    return found


def _linearise(
    family: Family, member: Member, x: ComplexArray, directions: list[Member]
) -> tuple[ComplexArray, ComplexArray, ComplexArray]:
    still = np.zeros(1)
    f, slope, _ = family.rows_at(x[:, None], member, [np.zeros_like(each) for each in member.parts], still)
    columns = [family.rows_at(x[:, None], member, each.parts, still)[2][:, 0] for each in directions]
    return f[:, 0], slope[:, :, 0], np.array(columns).T.reshape(len(f), -1)
