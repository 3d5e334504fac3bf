"""What acts on links, and their masses, in a file: entries to loads, springs and masses, and back."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import pairwise
from typing import Any

from planar.document.cursor import Cursor
from planar.document.names import find_motion, find_point
from planar.document.schema import (
    EFFORT_SCHEMA,
    FORCE_SCHEMA,
    MASS_SCHEMA,
    POINT_PAIR_SCHEMA,
    SPRING_SCHEMA,
    TORQUE_SCHEMA,
    TORSION_SPRING_SCHEMA,
    VARIATION_SCHEMA,
)
from planar.model.loads import Course, Load, Mass, Spring
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind, Pair, QuantityWriter

EFFORT_KINDS = {MeasureKind.LENGTH: "force"}
"""What the effort of an input, or between the links of a pair, is, where it is no torque."""


def read_loads(top: Cursor, mechanism: Mechanism, points: Mapping[str, str]) -> dict[str, Any]:
    """Loads, springs, masses and gravity of a file, by the mechanism's names for them. Raises BadInput."""
    named = relative_motions(mechanism)
    return {
        "loads": tuple(_read_load(item, mechanism, named, points) for item in top.list_items("loads")),
        "springs": tuple(_read_spring(item, points) for item in top.list_items("springs")),
        "masses": tuple(_read_mass(item) for item in top.list_items("masses")),
        "gravity": top["gravity"].as_vector("acceleration") if top.has("gravity") else (0.0, 0.0),
    }


def _read_load(cursor: Cursor, mechanism: Mechanism, named: Mapping[str, Pair], points: Mapping[str, str]) -> Load:
    kinds = {"point": FORCE_SCHEMA, "points": POINT_PAIR_SCHEMA, "link": TORQUE_SCHEMA, "pair": EFFORT_SCHEMA}
    targets = [key for key in kinds if cursor.has(key)]
    if len(targets) != 1:
        message = (
            "a load is a 'force' at a 'point' or between two 'points', a 'torque' on a 'link', or a 'force' or "
            "'torque' at a 'pair'"
        )
        raise cursor.error_at(None, message)
    cursor.check_keys(*kinds[targets[0]])
    varies = _read_variation(cursor["varies"], mechanism, named) if cursor.has("varies") else None
    if cursor.has("point"):
        point = _read_point(cursor["point"], points)
        axes = cursor.link("axes") if cursor.has("axes") else None
        return Load(point=point, force=cursor["force"].as_vector("force"), axes=axes, varies=varies)
    if cursor.has("points"):
        ends = _read_two_points(cursor, points, "a force acts between two different points")
        return Load(points=ends, effort=cursor.quantity("force", "force"), varies=varies)
    if cursor.has("link"):
        return Load(link=cursor["link"].as_link(), torque=cursor.quantity("torque", "torque"), varies=varies)
    pair = find_motion(cursor["pair"], named)
    wanted = EFFORT_KINDS.get(pair.input_kind, "torque")
    other = {"force": "torque", "torque": "force"}[wanted]
    if cursor.has(other):
        raise cursor.error_at(other, f"what acts between the links of pair {pair.name!r} is a {wanted}")
    return Load(pair=pair.name, effort=cursor.quantity(wanted, wanted), varies=varies)


def _read_point(cursor: Cursor, points: Mapping[str, str]) -> str:
    """A point where something acts, as it is written: `link.point` where several links share it and one is named."""
    name = cursor.as_text()
    found = find_point(cursor, name, points)
    shared = sum(each == found for other, each in points.items() if other != found) > 1
    return name if shared else found


def _read_variation(cursor: Cursor, mechanism: Mechanism, named: Mapping[str, Pair]) -> Course:
    cursor.check_keys(*VARIATION_SCHEMA)
    pair = None
    if cursor.has("with"):
        pair = find_motion(cursor["with"], named)
        if pair.name not in [given.pair for given in mechanism.inputs]:
            raise cursor.error_at("with", f"pair {pair.name!r} has no input; a load varies with an input, or with time")
    kind = pair.input_quantity_kinds()[0] if pair else "time"
    at = tuple(item.as_quantity(kind) for item in cursor["at"].items())
    factors = tuple(item.as_number() for item in cursor["factors"].items())
    if len(at) < 2 or len(at) != len(factors):
        told = f"as many factors as places, two at least, are wanted here, not {len(factors)} for {len(at)}"
        raise cursor.error_at("factors", told)
    for index, (before, after) in enumerate(pairwise(at)):
        if not before <= after:
            raise cursor.error_at(f"at[{index + 1}]", "the places rise; one that stands twice is a step")
    if not at[0] < at[-1]:
        raise cursor.error_at("at", "the places do not differ, so nothing varies over them")
    return Course(pair.name if pair else None, at, factors)


def _read_spring(cursor: Cursor, points: Mapping[str, str]) -> Spring:
    if cursor.has("points") == cursor.has("links"):
        raise cursor.error_at(None, "a spring stands between two 'points', or turns between two 'links'")
    turns = cursor.has("links")
    cursor.check_keys(*(TORSION_SPRING_SCHEMA if turns else SPRING_SCHEMA))
    if not cursor.has("stiffness") and not cursor.has("damping"):
        raise cursor.error_at(None, "a spring has a 'stiffness', a 'damping', or both")
    kinds = ("torsional stiffness", "torsional damping") if turns else ("stiffness", "damping")
    found = [
        _read_nonnegative(cursor, key, kind, 0.0) for key, kind in zip(("stiffness", "damping"), kinds, strict=True)
    ]
    if turns:
        links = cursor.two_links("links")
        return Spring(None, links, found[0], cursor.quantity("free_angle", "angle", 0.0), found[1])
    ends = _read_two_points(cursor, points, "a spring stands between two different points")
    return Spring(ends, None, found[0], _read_nonnegative(cursor, "free_length", "length", 0.0), found[1])


def _read_two_points(cursor: Cursor, points: Mapping[str, str], requirement: str) -> tuple[str, str]:
    """The two different points of the key `points`. Raises BadInput with the requirement."""
    ends = tuple(_read_point(item, points) for item in cursor["points"].items())
    if len(ends) != 2 or ends[0] == ends[1]:
        raise cursor.error_at("points", requirement)
    return ends[0], ends[1]


def _read_mass(cursor: Cursor) -> Mass:
    cursor.check_keys(*MASS_SCHEMA)
    link = cursor.link("link")
    mass, inertia = (
        _read_nonnegative(cursor, "mass", "mass"),
        _read_nonnegative(cursor, "inertia", "moment of inertia", 0.0),
    )
    return Mass(link, mass, cursor.point_reference("at", link), inertia)


def _read_nonnegative(cursor: Cursor, key: str, kind: str, default: float | None = None) -> float:
    value = cursor.quantity(key, kind, default)
    if value < 0.0:
        raise cursor.error_at(key, f"{kind} from zero on is wanted here, not {cursor[key].value!r}")
    return value


def write_loads(mechanism: Mechanism, quantity: QuantityWriter) -> dict[str, list[Any]]:
    """The same as entries of a file; nothing for what there is none of."""
    named = relative_motions(mechanism)
    found: dict[str, list[Any]] = {
        "loads": [write_load(load, named, quantity) for load in mechanism.loads],
        "springs": [write_spring(spring, quantity) for spring in mechanism.springs],
        "masses": [write_mass(mass, quantity) for mass in mechanism.masses],
        "gravity": [quantity(each, "acceleration") for each in mechanism.gravity if any(mechanism.gravity)],
    }
    return {key: value for key, value in found.items() if value}


def write_load(load: Load, named: Mapping[str, Pair], quantity: QuantityWriter) -> dict[str, Any]:
    """A load as a file has it, the relative motions at hand by name."""
    found: dict[str, Any] = {}
    if load.point is not None and load.force is not None:
        found |= {"point": load.point, "force": [quantity(each, "force") for each in load.force]}
    if load.points is not None and load.effort is not None:
        found |= {"points": list(load.points), "force": quantity(load.effort, "force")}
    if load.axes is not None:
        found["axes"] = load.axes
    if load.link is not None and load.torque is not None:
        found |= {"link": load.link, "torque": quantity(load.torque, "torque")}
    if load.pair is not None and load.effort is not None:
        kind = EFFORT_KINDS.get(named[load.pair].input_kind, "torque")
        found |= {"pair": load.pair, kind: quantity(load.effort, kind)}
    if load.varies is not None:
        course = load.varies
        kind = "time" if course.input is None else named[course.input].input_quantity_kinds()[0]
        found["varies"] = ({} if course.input is None else {"with": course.input}) | {
            "at": [quantity(each, kind) for each in course.at],
            "factors": [quantity(each, "number") for each in course.factors],
        }
    return found


def write_spring(spring: Spring, quantity: QuantityWriter) -> dict[str, Any]:
    """A spring as a file has it."""
    found: dict[str, Any] = {"links" if spring.is_torsional else "points": list(spring.ends)}
    kinds = ("torsional stiffness", "torsional damping") if spring.is_torsional else ("stiffness", "damping")
    found["stiffness"] = quantity(spring.stiffness, kinds[0])
    if spring.free:
        free = ("free_angle", "angle") if spring.is_torsional else ("free_length", "length")
        found[free[0]] = quantity(spring.free, free[1])
    return found | ({"damping": quantity(spring.damping, kinds[1])} if spring.damping else {})


def write_mass(mass: Mass, quantity: QuantityWriter) -> dict[str, Any]:
    """A mass as a file has it."""
    at = mass.at if isinstance(mass.at, str) else [quantity(each, "length") for each in mass.at]
    found = {"link": mass.link, "mass": quantity(mass.mass, "mass"), "at": at}
    return found | ({"inertia": quantity(mass.inertia, "moment of inertia")} if mass.inertia else {})
