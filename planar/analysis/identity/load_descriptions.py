"""What a file lets act on its links, and their masses, in words: loads, springs, dampers, masses, gravity."""

from __future__ import annotations

from dataclasses import dataclass
from math import atan2, hypot

from planar.dynamics.load_attachment import attachments
from planar.foundation.units import parse_unit
from planar.model.loads import Load, Mass, Spring
from planar.model.mechanism import Mechanism, relative_motions
from planar.model.pairs import MeasureKind
from planar.model.wording import amount


@dataclass(frozen=True)
class ActionDescription:
    """A load, a spring or a mass: where it is, on which links it acts, and how much it is."""

    kind: str
    at: str
    links: tuple[str, ...]
    amount: str


def describe_actions(mechanism: Mechanism) -> tuple[ActionDescription, ...]:
    """All of a mechanism in the order of its file."""
    found = [_describe_load(mechanism, load) for load in mechanism.loads]
    found += [_describe_spring(mechanism, spring) for spring in mechanism.springs]
    found += [_describe_mass(mechanism, mass) for mass in mechanism.masses]
    if any(mechanism.gravity):
        weighed = tuple(dict.fromkeys(mass.link for mass in mechanism.masses))
        told = _describe_vector(mechanism, mechanism.gravity, "acceleration")
        found.append(ActionDescription("gravity", "", weighed, told))
    return tuple(found)


def _describe_load(mechanism: Mechanism, load: Load) -> ActionDescription:
    links: tuple[str, ...]
    if load.point is not None and load.force is not None:
        link = attachments(mechanism)[load.point].link
        turns = "" if load.axes is None else f" in the axes of {load.axes}"
        kind, at, links, told = (
            "force",
            load.point,
            (link,),
            f"{_describe_vector(mechanism, load.force, 'force')}{turns}",
        )
    elif load.points is not None and load.effort is not None:
        where = attachments(mechanism)
        kind, at, links = (
            "force between two points",
            " and ".join(load.points),
            tuple(where[end].link for end in load.points),
        )
        told = amount(load.effort, "force", mechanism.units)
    elif load.link is not None and load.torque is not None:
        kind, at, links, told = "torque", load.link, (load.link,), amount(load.torque, "torque", mechanism.units)
    else:
        pair = relative_motions(mechanism)[load.pair or ""]
        slides = pair.input_kind is MeasureKind.LENGTH
        kind, at, links = "force in a pair" if slides else "torque in a pair", pair.name, pair.links
        told = amount(float(load.effort or 0.0), "force" if slides else "torque", mechanism.units)
    if load.varies is not None:
        told += f", varies with {load.varies.input or 'time'}"
    return ActionDescription(kind, at, links, told)


def _describe_spring(mechanism: Mechanism, spring: Spring) -> ActionDescription:
    of, free = ("torsional ", "angle") if spring.is_torsional else ("", "length")
    told = []
    if spring.stiffness:
        told.append(amount(spring.stiffness, f"{of}stiffness", mechanism.units))
        told.append(f"free {free} {amount(spring.free, free, mechanism.units)}")
    if spring.damping:
        told.append(f"damping {amount(spring.damping, f'{of}damping', mechanism.units)}")
    kind = "spring" if spring.stiffness or not spring.damping else "damper"
    if spring.is_torsional:
        return ActionDescription(f"torsional {kind}", "", spring.ends, ", ".join(told))
    where = attachments(mechanism)
    return ActionDescription(
        kind, " to ".join(spring.ends), tuple(where[end].link for end in spring.ends), ", ".join(told)
    )


def _describe_mass(mechanism: Mechanism, mass: Mass) -> ActionDescription:
    told = amount(mass.mass, "mass", mechanism.units)
    if mass.inertia:
        told += f", moment of inertia {amount(mass.inertia, 'moment of inertia', mechanism.units)}"
    return ActionDescription("mass", _describe_mass_centre(mechanism, mass), (mass.link,), told)


def _describe_mass_centre(mechanism: Mechanism, mass: Mass) -> str:
    """The point at which a mass is centred, or its x and y in the axes of its link."""
    if isinstance(mass.at, str):
        return mass.at
    x, y = (f"{parse_unit(mechanism.units.length).from_si(part):.6g}" for part in mass.at)
    return f"({x}, {y}) {mechanism.units.length}"


def _describe_vector(mechanism: Mechanism, vector: tuple[float, float], kind: str) -> str:
    x, y = vector
    return f"{amount(hypot(x, y), kind, mechanism.units)} at {amount(atan2(y, x), 'angle', mechanism.units)}"
