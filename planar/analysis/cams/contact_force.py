"""How hard a follower presses on its cam, the stress where they touch, and where it would lift off."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from planar.analysis.cams.cam_profile import cams_with_profiles
from planar.document.first_argument import takes_result
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.force_course import force_course, has_unknown_intervals
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.short_repr import short_repr
from planar.model.pairs.cams.profiled import ProfiledPair
from planar.results.motion import Motion

NO_FORCE_RATIO = 1e-9
"""Of the greatest force: what is less is none."""


class ContactForce(NamedTuple):
    """The force (N) with which a cam presses on its follower along their common normal, over n positions (n,).

    Where it is below zero nothing presses: a follower that is not held both ways (`grooved`) lifts off, and what is
    said of such positions is not what happens. `lifts_off` (n,) says where; NaN where the force is not determined.
    `stress` (n,) is the greatest pressure between the two (Pa), where the file says what they are made of: Hertz's
    sqrt(F E* / (pi b R)) of two cylinders of width b, 1/R the sum of their curvatures (K. L. Johnson, Contact
    Mechanics, Cambridge University Press 1985, ch. 4); none where they do not press. `lift_off_intervals` are those
    (from, to) of the running input, or of the time of a run in time, in which the follower lifts off; `smallest` is the
    smallest force. Over a motion both are solved for between its positions (`is_solved`), unless the motion is known at
    these alone.
    """

    force: Array
    grooved: bool
    lifts_off: Array
    stress: Array | None = None
    lift_off_intervals: tuple[tuple[float, float], ...] = ()
    smallest: float = np.nan
    is_solved: bool = True

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


def contact_columns(forces: Forces) -> Array:
    """Of every cam with a profile its force, and the square of its stress where there is one, at n positions
    (n, columns)."""
    columns = []
    for pair in cams_with_profiles(forces.mechanism):
        contact = _contact_at_rows(forces, pair)
        columns.append(contact.force)
        if contact.stress is not None:
            columns.append(contact.stress**2)
    return np.stack(columns, axis=-1)


def _contact_force(forces: Forces, pair: ProfiledPair) -> ContactForce:
    contact = _contact_at_rows(forces, pair)
    if not isinstance(forces.moving, Motion):
        return contact._replace(smallest=float(contact.force[0]))
    course = force_course(forces)
    series = None
    if course is not None and not has_unknown_intervals(contact.force):
        series = course.series(lambda at_places: _contact_at_rows(at_places, pair).force, course.least_scales[1])
    if course is None or series is None:
        return contact._replace(
            lift_off_intervals=_row_intervals(forces.moving, contact.lifts_off),
            smallest=float(np.nanmin(contact.force)) if np.isfinite(contact.force).any() else np.nan,
            is_solved=False,
        )
    intervals = () if contact.grooved else (course.positions(interval) for interval in series.intervals_below(0.0))
    lift_off = tuple((float(start), float(stop)) for start, stop in intervals)
    return contact._replace(lift_off_intervals=lift_off, smallest=series.smallest().value)


def _row_intervals(motion: Motion, chosen: Array) -> tuple[tuple[float, float], ...]:
    """From where to where rows of a motion are chosen, in their order."""
    along = motion.inputs[motion.running_input].position if motion.time is None else motion.time
    edges = np.flatnonzero(np.diff(np.concatenate([[False], chosen, [False]]).astype(int)))
    return tuple((float(along[first]), float(along[stop - 1])) for first, stop in edges.reshape(-1, 2))


def _contact_at_rows(forces: Forces, pair: ProfiledPair) -> ContactForce:
    field = KinematicArrays(forces.moving)
    contact = pair.tooth_contact(field.frames, field.shapes, forces.mechanism.pairs)
    assert contact is not None
    acting = np.atleast_2d(np.asarray(forces.reactions[pair.name].force, dtype=float))
    normal = np.stack(np.broadcast_arrays(*contact.drive_direction, np.zeros(len(acting)))[:2], axis=-1)
    found = np.einsum("ij,ij->i", acting, normal)
    assert pair.shape is not None
    none = NO_FORCE_RATIO * float(np.nanmax(np.abs(found), initial=0.0))
    lifts_off = (found < -none) & (not pair.shape.grooved)
    return ContactForce(found, pair.shape.grooved, lifts_off, _stress(field, pair, found))


def _stress(field: KinematicArrays, pair: ProfiledPair, force: Array) -> Array | None:
    """Hertz's pressure of a force (n,) between profile and face; None where no material is given."""
    assert pair.shape is not None
    material = pair.shape.contact
    if material is None:
        return None
    cam, _, carrier = (field.frames[body] for body in pair.bodies)
    law_angle = np.asarray((cam.angle - carrier.angle - pair.start) * pair.sense, dtype=float)
    touching = pair.contact([field.shapes[body] for body in pair.bodies], law_angle)
    assert touching is not None
    curvature = 1.0 / np.asarray(touching.curvature_radius, dtype=float)
    if pair.shape.flat is None:
        curvature = curvature + 1.0 / pair.shape.roller_radius
    pressing = np.abs(force) if pair.shape.grooved else np.maximum(force, 0.0)
    with np.errstate(invalid="ignore"):  # NaN where the profile is undercut, and fits no roller
        found: Array = np.sqrt(pressing * material.effective_modulus * curvature / (np.pi * material.width))
    return np.broadcast_to(found, force.shape)
