"""Contacts while links accelerate: what friction follows depends on accelerations, and these on friction.

With the masses M, columns A of what forces x put on the coordinates, and contacts y along D,

    M q'' - A x = Q + D y,    G q'' = c

gives accelerations and forces as q'' = a + a' y, x = b + b' y, and with these the equations of contacts.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from planar.dynamics.friction.contact_choice import solve_contacts
from planar.dynamics.friction.contact_functions import ContactFunctions, ContactValues
from planar.dynamics.friction.contact_system import ContactSystem
from planar.dynamics.friction.single_solution import has_single_solution
from planar.foundation.arrays import Array, BoolArray, IntArray
from planar.foundation.short_repr import short_repr

SINGULAR_TOLERANCE = 1e-12
SOLVED_TOLERANCE, MAX_NEWTON_STEPS = 1e-13, 12
"""Of the greatest part or contact; and steps from the solution before."""


class ConstrainedMotion(NamedTuple):
    """What accelerates at a position: masses (coordinates, coordinates), all constraints' slopes (rows, coordinates)
    and the accelerations that they ask for (rows,), of which the last are held at pairs with these efforts of one
    (coordinates, held); what acts (coordinates,), and the coordinates' scale. `is_firm`: whether all rows are needed.
    """

    mass: Array
    slope: Array
    wanted: Array
    held: Array
    push: Array
    scale: Array
    is_firm: bool

    def __repr__(self) -> str:
        return short_repr(self)


class ContactDynamics(NamedTuple):
    """Accelerations (coordinates,) and efforts that hold pairs (held,) without contacts, and by how much each contact
    changes them (..., m); what contacts put on the coordinates (coordinates, m); and the equations of contacts.
    """

    accelerations: Array
    changes: Array
    efforts: Array
    effort_changes: Array
    actions: Array
    system: ContactSystem

    def __repr__(self) -> str:
        return short_repr(self)


def contact_dynamics(
    functions: ContactFunctions, values: ContactValues, motion: ConstrainedMotion, senses: Array, at_rest: BoolArray
) -> ContactDynamics:
    """The equations at senses of the rubbing pairs' rates (pairs,), 0 where one does not rub.

    `at_rest` (pairs,): which have the coefficients of rest."""
    index, rubs = functions.pair_index, functions.is_friction
    sense = np.where(rubs, senses[index], 1.0)
    still = rubs & at_rest[index]
    actions = values.actions * np.where(rubs, -sense * values.rate_senses, 1.0)
    rows = np.arange(len(index))
    parts = values.parts[still.astype(int), (sense < 0.0).astype(int), rows] * (sense != 0.0)[:, None, None]
    many, count = len(motion.scale), values.columns.shape[1]
    columns = np.concatenate([values.columns, motion.held], axis=1) * motion.scale[:, None]
    mass = motion.mass * motion.scale * motion.scale[:, None]
    size = float(np.abs(mass).max(initial=0.0)) or 1.0
    whole = np.zeros((many + len(motion.slope), many + columns.shape[1]))
    whole[:many, :many], whole[:many, many:], whole[many:, :many] = mass / size, -columns, motion.slope * motion.scale
    right = np.zeros((len(whole), 1 + len(index)))
    right[:many, 0], right[many:, 0] = motion.push * motion.scale / size, motion.wanted
    right[:many, 1:] = actions * motion.scale[:, None] / size
    found = _solve(whole, right, motion.is_firm)
    rates, forces = found[:many] * motion.scale[:, None], found[many:] * size
    own, efforts = forces[:count], forces[count:]
    system = ContactSystem(
        (parts @ own[:, 0])[None],
        -(parts @ own[:, 1:])[None],
        functions.is_resultant,
        functions.is_signed,
        functions.is_friction,
    )
    return ContactDynamics(rates[:, 0], rates[:, 1:], efforts[:, 0], efforts[:, 1:], actions, system)


def _solve(whole: Array, right: Array, is_firm: bool) -> Array:
    if is_firm and whole.shape[0] == whole.shape[1]:
        try:
            return np.linalg.solve(whole, right)
        except np.linalg.LinAlgError:
            pass
    return np.linalg.lstsq(whole, right, rcond=SINGULAR_TOLERANCE)[0]


class CountedContacts(NamedTuple):
    """The solution y (m,) that goes over into that without friction, how many there are, and whether that is proved."""

    y: Array
    solution_count: int
    is_complete: bool


def solve_all(system: ContactSystem) -> CountedContacts:
    """The contacts at the one position of a system, all solutions counted."""
    found = solve_contacts(system)
    return CountedContacts(found.first[0], int(found.solution_count[0]), bool(found.is_complete[0]))


def is_single(system: ContactSystem) -> bool:
    """Whether it is proved at once that there is one solution."""
    return bool(has_single_solution(system)[0])


class HeldContacts:
    """Contacts that go on as they are: the leading part of each that follows the greatest (m,) stays the leading one.

    So nothing has kinks until another part is greater; `y` (m,) is where the next solution is looked for.
    """

    def __init__(self, system: ContactSystem, y: Array):
        self.leading: IntArray = np.argmax(system.parts(y[None])[0], axis=1)
        self.y = y

    def lead_by(self, contact: int, part: int) -> None:
        """Let a contact follow this part from now on."""
        self.leading[contact] = part

    def solve(self, system: ContactSystem) -> Array | None:
        """The solution near the last one (m,); None where there is none."""
        held = self._held_system(system)
        y = self.y[None]
        is_linear = not system.is_resultant.any()
        for _ in range(MAX_NEWTON_STEPS):
            y, before = held.newton_step(y)[0], y
            size = float(np.abs(y).max(initial=0.0))
            if not np.isfinite(size):
                return None
            if is_linear or float(np.abs(y - before).max(initial=0.0)) <= SOLVED_TOLERANCE * size:
                self.y = y[0]
                return self.y
        return None

    def leads(self, system: ContactSystem, y: Array) -> tuple[Array, IntArray]:
        """By how much the leading part of each contact is above the others, beside the greatest of all (m,), and which
        of the others is the greatest."""
        parts = system.parts(y[None])[0]
        rows = np.arange(len(parts))
        lead = parts[rows, self.leading]
        there = (system.loads[0] != 0.0) | (system.slopes[0] != 0.0).any(axis=2)
        others = np.where(there, parts, -np.inf)
        others[rows, self.leading] = -np.inf
        size = max(float(np.abs(parts).max(initial=0.0)), 1e-300)
        gap = (lead - others.max(axis=1, initial=-np.inf)) / size
        fixed = system.is_resultant | system.is_signed
        return np.where(fixed, np.inf, gap), others.argmax(axis=1)

    def _held_system(self, system: ContactSystem) -> ContactSystem:
        """The same with the leading part of each contact alone, first."""
        rows = np.arange(len(self.leading))
        pick = np.where(system.is_resultant | system.is_signed, 0, self.leading)
        loads, slopes = system.loads.copy(), system.slopes.copy()
        loads[0, :, 0], slopes[0, :, 0] = system.loads[0, rows, pick], system.slopes[0, rows, pick]
        return system._replace(loads=loads, slopes=slopes, is_signed=~system.is_resultant)
