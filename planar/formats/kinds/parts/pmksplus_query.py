"""Links of PMKS+ as it wrote them until 2023: `?j=...&l=...&f=...&s=...`, a line for each joint, link and force."""

from __future__ import annotations

import re
from math import isfinite

from planar.formats.kinds.parts.pmksplus_code import (
    DRIVEN,
    GROUNDED,
    PRISMATIC,
    PlusForce,
    PlusJoint,
    PlusLink,
    PlusMechanism,
)
from planar.foundation.errors import BadInput

SECTION = re.compile(r"(?:^|[?&])(j|l|f|pp|tp|s)=")
"""How a part of the address begins: joints, links, forces, points and poses of a synthesis, settings."""
UNITS = {"cm": "cm", "m": "m", "in": "in", "inch": "in", "mm": "mm"}
TRUE, FALSE = ("t", "true"), ("f", "false")


def decode_query(text: str, place: str) -> PlusMechanism:
    """The mechanism of an address of this form, which is decoded already. Raises BadInput at a joint or link."""
    sections = _sections(text)
    joints: dict[str, PlusJoint] = {}
    for fields in _rows(sections.get("j", "")):
        key, joint = _joint(fields, place)
        if key in joints:
            raise BadInput(f"{place}, joint {key}", "there are two joints of this name")
        joints[key] = joint
    links = dict(_link(fields, place) for fields in _rows(sections.get("l", "")))
    forces = tuple(_force(fields, place) for fields in _rows(sections.get("f", "")))
    settings = [item.strip() for item in sections.get("s", "").split(",")]
    notes = []
    length = UNITS.get(settings[3].lower() if len(settings) > 3 else "")
    if length is None:
        notes.append("the link names no unit of length; its numbers are taken as cm")
    for key, name in (("pp", "points"), ("tp", "poses")):
        if sections.get(key, "").strip():
            notes.append(f"the {name} of a synthesis in the link are left out")
    rpm = _number(settings[0], place) if settings[0] else 0.0
    is_clockwise = len(settings) > 1 and settings[1].lower() in TRUE
    sense = -1.0 if is_clockwise else 1.0
    return PlusMechanism(joints, links, forces, length or "cm", "N", sense * rpm, None, 1.0, tuple(notes))


def _sections(text: str) -> dict[str, str]:
    """The parts of an address by their letters."""
    _, *pieces = SECTION.split(text)
    return dict(zip(pieces[::2], pieces[1::2], strict=True))


def _rows(text: str) -> list[list[str]]:
    return [[field.strip() for field in line.split(",")] for line in text.splitlines() if line.strip()]


def _joint(fields: list[str], place: str) -> tuple[str, PlusJoint]:
    """Its id, x, y, links, type, whether it is of the ground, the angle of a slide (rad), whether it is driven."""
    where = f"{place}, joint {fields[0]:.40}"
    if len(fields) < 7 or not fields[0] or fields[4] not in ("R", "P"):
        raise BadInput(where, f"this is no joint of PMKS+: {','.join(fields)!r:.60}")
    rest = [field for field in fields[6:] if field]
    angles = [field for field in rest if field.lower() not in (*TRUE, *FALSE, "null")]
    flags = PRISMATIC if fields[4] == "P" else 0
    flags |= GROUNDED if _flag(fields[5], where) else 0
    flags |= DRIVEN if rest and rest[-1].lower() in TRUE else 0
    angle = _number(angles[0], where) if angles and fields[4] == "P" else 0.0
    return fields[0], PlusJoint(fields[0], (_number(fields[1], where), _number(fields[2], where)), flags, angle)


def _link(fields: list[str], place: str) -> tuple[str, PlusLink]:
    """Its id, type (R by default), mass, moment of inertia, centre of mass, joints, forces, shape."""
    where = f"{place}, link {fields[0]:.40}"
    is_typed = len(fields) > 1 and fields[1] in ("R", "P")
    values = fields[2:] if is_typed else fields[1:]
    if len(values) < 5 or not fields[0]:
        raise BadInput(where, f"this is no link of PMKS+: {','.join(fields)!r:.60}")
    joints = tuple(item for item in values[4].split("|") if item)
    mass = 0.0 if values[0].lower() in ("", "null") else _number(values[0], where)
    return fields[0], PlusLink(fields[0], joints, is_typed and fields[1] == "P", mass)


def _force(fields: list[str], place: str) -> PlusForce:
    """Its id, link, start, end, whether its direction is kept, whether it points outward, its magnitude."""
    where = f"{place}, force {fields[0]:.40}"
    if len(fields) < 9:
        raise BadInput(where, f"this is no force of PMKS+: {','.join(fields)!r:.60}")
    x, y, u, v = (_number(item, where) for item in fields[2:6])
    is_local, is_outward = not _flag(fields[6], where), _flag(fields[7], where)
    return PlusForce(fields[0], fields[1], (x, y), (u, v), _number(fields[8], where), is_local, is_outward)


def _number(text: str, where: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = float("nan")
    if not isfinite(value) or abs(value) > 1e100:
        raise BadInput(where, f"{text!r:.40} is no number")
    return value


def _flag(text: str, where: str) -> bool:
    if text.lower() not in (*TRUE, *FALSE):
        raise BadInput(where, f"'t' or 'f' is expected here, not {text!r:.40}")
    return text.lower() in TRUE
