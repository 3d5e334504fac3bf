"""Every solution of contacts at one position, by bisecting boxes that an interval Newton method empties or proves.

In homogeneous coordinates v = (w, y) on the faces of a cube, so that forces beyond all bounds are searched as well. On
each box phi changes along slopes between known bounds: where Krawczyk's image of the box misses it there is no
solution, where the image lies inside there is just one (R. Krawczyk, Computing 4, 1969; R. E. Moore, R. B. Kearfott,
M. J. Cloud, Introduction to Interval Analysis, 2009, ch. 8).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import product
from typing import NamedTuple

import numpy as np

from planar.dynamics.friction.contact_system import ContactSystem
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.short_repr import short_repr

MAX_BOXES = 120_000
MAX_CASES = 4096
"""Of which part of a force each contact follows: of more not every one is tried by itself."""
LEAST_RADIUS = 1e-9
"""A box so small that is not decided holds solutions that lie together."""
OVERLAP, ROUNDING = 1.05, 1e-14
"""By how much boxes are taken larger than they are, so that a solution on an edge is inside of one."""
INFINITE_SHARE = 1e-9
"""A solution with less than this of w is at infinity: forces without a load."""
SAME_SOLUTION_DISTANCE = 1e-7
SAME_LENGTH_TOLERANCE = 1e-12
"""Of squares of coefficients."""
SOLVED_TOLERANCE = 1e-9
"""Of the greatest part or contact."""


class ContactSolutions(NamedTuple):
    """The solutions y (solutions, m), and whether it is proved that there are no others."""

    y: Array
    is_complete: bool

    def __repr__(self) -> str:
        return short_repr(self)


def find_all_solutions(system: ContactSystem) -> ContactSolutions:
    """All solutions at the one position of a system."""
    found: list[Array] = []
    is_complete, searched = True, 0
    for sides in _contact_sides(system):
        contacts = _HomogeneousContacts(system, sides)
        for face in range(contacts.count + 1):
            solutions, decided, count = _search_face(contacts, face, MAX_BOXES - searched)
            searched += count
            is_complete &= decided
            found += [contacts.restore(each) for each in solutions]
    y = np.array(found).reshape(-1, len(system.is_signed))
    y = y[system.at(np.zeros(len(y), dtype=int)).errors(y) < SOLVED_TOLERANCE] if len(y) else y
    return ContactSolutions(_distinct(y), is_complete)


def _contact_sides(system: ContactSystem) -> Iterator[IntArray]:
    """Every case of which part each contact is as great as (m,); -1 where that is not chosen.

    It is the first of a signed one; of very many cases none is chosen.
    """
    felt = np.abs(system.slopes[0]).max(axis=(0, 1), initial=0.0) > 0.0
    there = (system.loads[0] != 0.0) | (system.slopes[0] != 0.0).any(axis=2)
    fixed = np.where(system.is_signed, 0, -1)
    chosen = np.flatnonzero(felt & ~system.is_signed & ~system.is_resultant)
    choices = [np.flatnonzero(there[index]).tolist() or [0] for index in chosen]
    if np.prod([float(len(each)) for each in choices]) > MAX_CASES:
        choices = [[-1] for _ in chosen]
    for case in product(*choices):
        sides = fixed.copy()
        sides[chosen] = case
        yield sides


class _HomogeneousContacts:
    """y_j = phi_j(G_j v), v = (w, y) up to a factor, of those contacts alone that have to be searched for.

    Not those on which no other depends, those of which a part is chosen, and vectors that are always some times as long
    as another, as the forces at both ends of a link that nothing else loads. What the chosen parts are more than
    others is `excess` v, not below zero.
    """

    def __init__(self, system: ContactSystem, sides: IntArray):
        self.system = system
        self.unit = max(float(np.abs(system.loads).max(initial=0.0)), 1e-300)
        whole = np.concatenate([system.loads[0, :, :, None] / self.unit, -system.slopes[0]], axis=2)  # (m, k, 1 + m)
        self.felt = np.abs(system.slopes[0]).max(axis=(0, 1), initial=0.0) > 0.0
        signed = (sides >= 0) & self.felt
        at, chosen = np.concatenate([[False], signed]), self.felt & ~signed
        own = np.concatenate([[True], chosen])
        first = whole[signed, sides[signed]]
        expansion = np.eye(len(at))[:, own]
        expansion[at] = _solve_regular(np.eye(int(signed.sum())) - first[:, at], first[:, own])
        forms = whole[chosen] @ expansion
        follows, ratio = _lengths_that_follow(forms, system.is_resultant[chosen])
        kept = follows == np.arange(len(follows))
        merged = np.zeros((len(follows) + 1, int(kept.sum()) + 1))
        merged[0, 0] = 1.0
        merged[1 + np.arange(len(follows)), 1 + (np.cumsum(kept) - 1)[follows]] = ratio
        self.expansion = expansion @ merged
        self.forms = forms[kept] @ merged
        self.is_resultant = system.is_resultant[chosen][kept]
        self.count = int(kept.sum())
        self.lengths = np.linalg.norm(self.forms, axis=1)  # (m, 1 + m)
        leads = (sides >= 0) & self.felt & ~system.is_signed
        more = whole[leads, sides[leads]][:, None] - whole[leads]
        self.excess = more.reshape(-1, whole.shape[2]) @ self.expansion

    def restore(self, v: Array) -> Array:
        """All contacts (m,) at homogeneous coordinates."""
        y: Array = (self.expansion @ v)[1:] / v[0] * self.unit
        return np.where(self.felt, y, self.system.sizes(self.system.parts(y[None]))[0][0])

    def values(self, v: Array) -> Array:
        """y - phi (boxes, m) at v (boxes, 1 + m)."""
        parts = np.einsum("akc,nc->nak", self.forms, v)
        sizes = np.where(self.is_resultant, np.linalg.norm(parts, axis=2), parts.max(axis=2))
        found: Array = v[:, 1:] - sizes
        return found

    def slope_bounds(self, centre: Array, radius: Array) -> tuple[Array, Array]:
        """The slopes of y - phi over boxes: their middle and how far they are off it (boxes, m, 1 + m)."""
        parts, off = (
            np.einsum("akc,nc->nak", forms, at) for forms, at in ((self.forms, centre), (np.abs(self.forms), radius))
        )
        long, wide = np.linalg.norm(parts, axis=2), np.linalg.norm(off, axis=2)
        sine = np.minimum(wide / np.maximum(long, 1e-300), 1.0)
        chord = np.where(sine < 1.0, 2.0 * np.sin(0.5 * np.arcsin(sine)), 1.0)
        towards = np.where((sine < 1.0)[..., None], parts / np.maximum(long, 1e-300)[..., None], 0.0)
        middle = np.einsum("nak,akc->nac", towards, self.forms)
        spread = chord[..., None] * self.lengths
        can_lead = parts + off >= (parts - off).max(axis=2, keepdims=True)
        low = np.where(can_lead[..., None], self.forms, np.inf).min(axis=2)
        high = np.where(can_lead[..., None], self.forms, -np.inf).max(axis=2)
        resultant = self.is_resultant[:, None]
        middle, spread = (
            np.where(resultant, middle, 0.5 * (low + high)),
            np.where(resultant, spread, 0.5 * (high - low)),
        )
        own = np.concatenate([np.zeros((self.count, 1)), np.eye(self.count)], axis=1)
        return own - middle, spread


def _lengths_that_follow(forms: Array, is_resultant: BoolArray) -> tuple[IntArray, Array]:
    """Of every contact the first one of which it is always some times as great, itself if there is no other; and that
    ratio. Vectors G v and G' v are so where G'^T G' is proportional to G^T G."""
    count = len(forms)
    follows, ratio = np.arange(count), np.ones(count)
    gram = np.einsum("akc,akd->acd", forms, forms)
    size = np.sqrt(np.einsum("acc->a", gram))
    for k in range(count):
        for j in range(k):
            if follows[j] == j and is_resultant[j] and is_resultant[k] and size[j] > 0.0:
                by = float(size[k] / size[j])
                if np.abs(gram[k] - by**2 * gram[j]).max() <= SAME_LENGTH_TOLERANCE * size[k] ** 2:
                    follows[k], ratio[k] = j, by
                    break
    return follows, ratio


def _solve_regular(matrix: Array, right: Array) -> Array:
    """The solution; of a singular matrix, which none but special coefficients have, the least one."""
    try:
        return np.linalg.solve(matrix, right)
    except np.linalg.LinAlgError:
        return np.linalg.lstsq(matrix, right, rcond=None)[0]


def _search_face(contacts: _HomogeneousContacts, face: int, most: int) -> tuple[list[Array], bool, int]:
    """The solutions whose greatest coordinate is this one, whether all boxes were decided, and how many these were."""
    if not contacts.count:
        return [np.ones(1)], True, 1
    free = np.arange(contacts.count + 1) != face
    centre, radius = np.full((1, contacts.count + 1), 0.5), np.full((1, contacts.count + 1), 0.5)
    centre[:, face], radius[:, face] = 1.0, 0.0
    found: list[Array] = []
    decided, searched = True, 0
    while len(centre):
        searched += len(centre)
        if searched > most:
            return found, False, searched
        centre, radius, proved, tiny = _contract(contacts, free, centre, radius)
        for v in centre[proved]:
            solution = _refine(contacts, free, v)
            if solution is not None and solution[0] > INFINITE_SHARE:
                found.append(solution)
        for v in centre[tiny & ~proved]:
            solution = _refine(contacts, free, v)
            beyond = solution is not None and solution[0] <= INFINITE_SHARE
            decided &= beyond
            if solution is not None and not beyond:
                found.append(solution)
        left = ~proved & ~tiny
        centre, radius = _bisect(centre[left], radius[left])
    return found, decided, searched


def _contract(
    contacts: _HomogeneousContacts, free: BoolArray, centre: Array, radius: Array
) -> tuple[Array, Array, BoolArray, BoolArray]:
    """The boxes that may have solutions, as small as one step makes them; which have just one, and which are tiny."""
    wide = radius * OVERLAP + ROUNDING * free
    value = contacts.values(centre)
    middle, spread = contacts.slope_bounds(centre, wide)
    reach = np.einsum("nac,nc->na", np.abs(middle) + spread, wide)
    may = (np.abs(value) <= reach + ROUNDING).all(axis=1)
    may &= (centre @ contacts.excess.T + wide @ np.abs(contacts.excess).T >= -ROUNDING).all(axis=1)
    centre, radius, wide, value, middle, spread = (each[may] for each in (centre, radius, wide, value, middle, spread))
    square = middle[:, :, free]
    regular = np.abs(np.linalg.det(square)) > 1e-12
    square[~regular] = np.eye(contacts.count)
    inverse = np.linalg.inv(square)
    image = centre[:, free] - np.einsum("nab,nb->na", inverse, value)
    off = np.einsum("nab,nbc,nc->na", np.abs(inverse), spread, wide) + ROUNDING
    inside = (np.abs(image - centre[:, free]) + off < wide[:, free]).all(axis=1) & regular
    low = np.maximum(image - off, (centre - wide)[:, free])
    high = np.minimum(image + off, (centre + wide)[:, free])
    empty = (low > high).any(axis=1) & regular
    shrunk_centre, shrunk_radius = centre.copy(), radius.copy()
    shrunk_centre[:, free], shrunk_radius[:, free] = 0.5 * (low + high), 0.5 * (high - low)
    use = regular & ~empty
    centre, radius = np.where(use[:, None], shrunk_centre, centre), np.where(use[:, None], shrunk_radius, radius)
    tiny = radius.max(axis=1, initial=0.0) < LEAST_RADIUS
    return centre[~empty], radius[~empty], inside[~empty], tiny[~empty]


def _refine(contacts: _HomogeneousContacts, free: BoolArray, v: Array) -> Array | None:
    """The solution near v by Newton's steps; None where there is none."""
    none = np.zeros((1, len(v)))
    for _ in range(30):
        value = contacts.values(v[None])
        slope = contacts.slope_bounds(v[None], none)[0][0][:, free]
        step = np.linalg.lstsq(slope, value[0], rcond=None)[0]
        v = v.copy()
        v[free] -= step
        if np.abs(step).max(initial=0.0) < ROUNDING:
            break
    return v if np.abs(contacts.values(v[None])).max(initial=0.0) < SOLVED_TOLERANCE else None


def _bisect(centre: Array, radius: Array) -> tuple[Array, Array]:
    """Each box as two halves across its longest side."""
    if not len(centre):
        return centre, radius
    row, side = np.arange(len(centre)), np.argmax(radius, axis=1)
    half = radius.copy()
    half[row, side] *= 0.5
    step = np.zeros_like(radius)
    step[row, side] = half[row, side]
    return np.concatenate([centre - step, centre + step]), np.concatenate([half, half])


def _distinct(y: Array) -> Array:
    """Each solution once."""
    kept: list[Array] = []
    for each in y:
        near = max(np.abs(each).max(initial=0.0), 1e-300)
        if all(np.abs(each - other).max() > SAME_SOLUTION_DISTANCE * near for other in kept):
            kept.append(each)
    return np.array(kept).reshape(-1, y.shape[1])
