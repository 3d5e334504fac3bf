"""What acts on links, and their masses, in a file: entries to loads, springs and masses, and back."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from planar.document.cursor import Cursor
from planar.document.names import motion, point_named
from planar.document.schema import EFFORT, FORCE, MASS, SPRING, TORQUE, TORSION, VARIES
from planar.model.loads import Course, Load, Mass, Spring
from planar.model.mechanism import Mechanism, motions
from planar.model.pairs import Kind, Pair, Quantity

EFFORTS = {Kind.LENGTH: "force"}
"""What the effort of an input, or between the links of a pair, is, where it is no torque."""


def read_applied(top: Cursor, mechanism: Mechanism, points: Mapping[str, str]) -> dict[str, Any]:
    """Loads, springs, masses and gravity of a file, by the mechanism's names for them. Raises BadInput."""
    named = motions(mechanism)
    return {
        "loads": tuple(_load(item, mechanism, named, points) for item in top.listed("loads")),
        "springs": tuple(_spring(item, points) for item in top.listed("springs")),
        "masses": tuple(_mass(item) for item in top.listed("masses")),
        "gravity": top["gravity"].as_vector("acceleration") if top.has("gravity") else (0.0, 0.0),
    }


def _load(cursor: Cursor, mechanism: Mechanism, named: Mapping[str, Pair], points: Mapping[str, str]) -> Load:
    kinds = {"point": FORCE, "link": TORQUE, "pair": EFFORT}
    given = [key for key in kinds if cursor.has(key)]
    if len(given) != 1:
        told = "a load is a 'force' at a 'point', a 'torque' on a 'link', or a 'force' or 'torque' at a 'pair'"
        raise cursor.refuse(None, told)
    cursor.only(*kinds[given[0]])
    varies = _course(cursor["varies"], mechanism, named) if cursor.has("varies") else None
    if cursor.has("point"):
        point = _end(cursor["point"], points)
        axes = cursor.link("axes") if cursor.has("axes") else None
        return Load(point=point, force=cursor["force"].as_vector("force"), axes=axes, varies=varies)
    if cursor.has("link"):
        return Load(link=cursor["link"].as_link(), torque=cursor.quantity("torque", "torque"), varies=varies)
    pair = motion(cursor["pair"], named)
    wanted = EFFORTS.get(pair.drive_kind, "torque")
    other = {"force": "torque", "torque": "force"}[wanted]
    if cursor.has(other):
        raise cursor.refuse(other, f"what acts between the links of pair {pair.name!r} is a {wanted}")
    return Load(pair=pair.name, effort=cursor.quantity(wanted, wanted), varies=varies)


def _end(cursor: Cursor, points: Mapping[str, str]) -> str:
    """A point where something acts, as it is written: `link.point` where several links share it and one is named."""
    name = cursor.as_text()
    found = point_named(cursor, name, points)
    shared = sum(each == found for other, each in points.items() if other != found) > 1
    return name if shared else found


def _course(cursor: Cursor, mechanism: Mechanism, named: Mapping[str, Pair]) -> Course:
    cursor.only(*VARIES)
    pair = None
    if cursor.has("with"):
        pair = motion(cursor["with"], named)
        if pair.name not in [given.pair for given in mechanism.inputs]:
            raise cursor.refuse("with", f"pair {pair.name!r} has no input; a load varies with an input, or with time")
    kind = pair.driven()[0] if pair else "time"
    at = tuple(item.as_quantity(kind) for item in cursor["at"].items())
    factors = tuple(item.as_number() for item in cursor["factors"].items())
    if len(at) < 2 or len(at) != len(factors):
        told = f"as many factors as places, two at least, are wanted here, not {len(factors)} for {len(at)}"
        raise cursor.refuse("factors", told)
    for index, (before, after) in enumerate(pairwise(at)):
        if not before <= after:
            raise cursor.refuse(f"at[{index + 1}]", "the places rise; one that stands twice is a step")
    if not at[0] < at[-1]:
        raise cursor.refuse("at", "the places do not differ, so nothing varies over them")
    return Course(pair and pair.name, at, factors)


def _spring(cursor: Cursor, points: Mapping[str, str]) -> Spring:
    if cursor.has("points") == cursor.has("links"):
        raise cursor.refuse(None, "a spring stands between two 'points', or turns between two 'links'")
    turns = cursor.has("links")
    cursor.only(*(TORSION if turns else SPRING))
    if not cursor.has("stiffness") and not cursor.has("damping"):
        raise cursor.refuse(None, "a spring has a 'stiffness', a 'damping', or both")
    kinds = ("torsional stiffness", "torsional damping") if turns else ("stiffness", "damping")
    found = [_from_zero(cursor, key, kind, 0.0) for key, kind in zip(("stiffness", "damping"), kinds, strict=True)]
    if turns:
        links = cursor.two_links("links")
        return Spring(None, links, found[0], cursor.quantity("free_angle", "angle", 0.0), found[1])
    ends = tuple(_end(item, points) for item in cursor["points"].items())
    if len(ends) != 2 or ends[0] == ends[1]:
        raise cursor.refuse("points", "a spring stands between two different points")
    return Spring((ends[0], ends[1]), None, found[0], _from_zero(cursor, "free_length", "length", 0.0), found[1])


def _mass(cursor: Cursor) -> Mass:
    cursor.only(*MASS)
    link = cursor.link("link")
    mass, inertia = _from_zero(cursor, "mass", "mass"), _from_zero(cursor, "inertia", "moment of inertia", 0.0)
    return Mass(link, mass, cursor.place("at", link), inertia)


def _from_zero(cursor: Cursor, key: str, kind: str, default: float | None = None) -> float:
    value = cursor.quantity(key, kind, default)
    if value < 0.0:
        raise cursor.refuse(key, f"{kind} from zero on is wanted here, not {cursor[key].value!r}")
    return value


def write_applied(mechanism: Mechanism, quantity: Quantity) -> dict[str, list[Any]]:
    """The same as entries of a file; nothing for what there is none of."""
    named = motions(mechanism)
    found = {
        "loads": [_written_load(load, named, quantity) for load in mechanism.loads],
        "springs": [_written_spring(spring, quantity) for spring in mechanism.springs],
        "masses": [_written_mass(mass, quantity) for mass in mechanism.masses],
        "gravity": [quantity(each, "acceleration") for each in mechanism.gravity if any(mechanism.gravity)],
    }
    return {key: value for key, value in found.items() if value}


def _written_load(load: Load, named: Mapping[str, Pair], quantity: Quantity) -> dict[str, Any]:
    found: dict[str, Any] = {}
    if load.point is not None and load.force is not None:
        found |= {"point": load.point, "force": [quantity(each, "force") for each in load.force]}
    if load.axes is not None:
        found["axes"] = load.axes
    if load.link is not None and load.torque is not None:
        found |= {"link": load.link, "torque": quantity(load.torque, "torque")}
    if load.pair is not None and load.effort is not None:
        kind = EFFORTS.get(named[load.pair].drive_kind, "torque")
        found |= {"pair": load.pair, kind: quantity(load.effort, kind)}
    if load.varies is not None:
        course = load.varies
        kind = "time" if course.input is None else named[course.input].driven()[0]
        found["varies"] = ({} if course.input is None else {"with": course.input}) | {
            "at": [quantity(each, kind) for each in course.at],
            "factors": list(course.factors),
        }
    return found


def _written_spring(spring: Spring, quantity: Quantity) -> dict[str, Any]:
    found: dict[str, Any] = {"links" if spring.turns else "points": list(spring.ends)}
    kinds = ("torsional stiffness", "torsional damping") if spring.turns else ("stiffness", "damping")
    found["stiffness"] = quantity(spring.stiffness, kinds[0])
    if spring.free:
        free = ("free_angle", "angle") if spring.turns else ("free_length", "length")
        found[free[0]] = quantity(spring.free, free[1])
    return found | ({"damping": quantity(spring.damping, kinds[1])} if spring.damping else {})


def _written_mass(mass: Mass, quantity: Quantity) -> dict[str, Any]:
    at = mass.at if isinstance(mass.at, str) else [quantity(each, "length") for each in mass.at]
    found = {"link": mass.link, "mass": quantity(mass.mass, "mass"), "at": at}
    return found | ({"inertia": quantity(mass.inertia, "moment of inertia")} if mass.inertia else {})
