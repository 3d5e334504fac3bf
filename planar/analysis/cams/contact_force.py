"""How hard a follower presses on its cam, and where it would lift off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.cams.cam_profile import cams_with_profiles
from planar.document.first_argument import takes_result
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr
from planar.model.pairs.cams.profiled import ProfiledPair

NO_FORCE_RATIO = 1e-9
"""Of the greatest force: what is less is none."""


class ContactForce(NamedTuple):
    """The force (N) with which a cam presses on its follower along their common normal, over n positions (n,).

    Where it is below zero nothing presses: a follower that is not held both ways (`grooved`) lifts off, and what is
    said of such positions is not what happens. `lifts_off` (n,) says where; NaN where the force is not determined.
    """

    force: Array
    grooved: bool
    lifts_off: Array

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("Forces")
def contact_forces(forces: Forces) -> Mapping[str, ContactForce]:
    """The contact force of every cam that has a profile, by its name: at one position, or over a motion.

    >>> import planar
    >>> pressing = planar.contact_forces(planar.forces(planar.solve("cam-with-spring")))
    >>> float(round(pressing["lift"].force[0], 3))  # N
    109.884
    """
    return {pair.name: _contact_force(forces, pair) for pair in cams_with_profiles(forces.mechanism)}


def _contact_force(forces: Forces, pair: ProfiledPair) -> ContactForce:
    field = KinematicArrays(forces.moving, forces.moving.shapes)
    contact = pair.tooth_contact(field.frames, field.shapes, forces.mechanism.pairs)
    assert contact is not None
    acting = np.atleast_2d(np.asarray(forces.reactions[pair.name].force, dtype=float))
    normal = np.stack(np.broadcast_arrays(*contact.drive_direction, np.zeros(len(acting)))[:2], axis=-1)
    found = np.einsum("ij,ij->i", acting, normal)
    assert pair.shape is not None
    none = NO_FORCE_RATIO * float(np.nanmax(np.abs(found), initial=0.0))
    return ContactForce(found, pair.shape.grooved, (found < -none) & (not pair.shape.grooved))


def lift_off_remarks(forces: Forces) -> list[str]:
    """A sentence for each cam whose follower lifts off somewhere."""
    told = []
    for name, each in contact_forces(forces).items():
        if not each.lifts_off.any():
            continue
        many = len(each.lifts_off)
        where = f"at {int(each.lifts_off.sum())} of {many} positions" if many > 1 else "here"
        told.append(
            f"the follower of {name!r} lifts off {where}: the cam would have to pull it by up to "
            f"{-float(np.nanmin(each.force)):.6g} N; a stronger spring, a groove or less speed keeps it down"
        )
    return told
