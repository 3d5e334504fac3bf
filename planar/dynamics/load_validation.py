"""Loads, springs and masses made in Python, checked against their mechanism; a file has its own checks."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator
from math import isfinite

from planar.dynamics.load_attachment import attachments
from planar.foundation.errors import BadInput
from planar.foundation.units import SI_UNITS
from planar.model.loads import Load, Mass, Spring
from planar.model.mechanism import Mechanism, named_points, relative_motions

Problems = Iterator[str]


def check_loads(mechanism: Mechanism) -> None:
    """Refuse loads, springs and masses that are none of this mechanism's. Raises BadInput."""
    known = _LoadChecker(mechanism)
    of = (
        ("loads", map(known.load_problems, mechanism.loads)),
        ("springs", map(known.spring_problems, mechanism.springs)),
        ("masses", map(known.mass_problems, mechanism.masses)),
    )
    for name, each in of:
        for index, problems in enumerate(each):
            for sentence in problems:
                raise BadInput(f"{name}[{index}]", sentence)
    if not all(map(isfinite, mechanism.gravity)):
        raise BadInput("gravity", "gravity is two finite numbers")


def require_loads(mechanism: Mechanism) -> None:
    """Raise BadInput where a mechanism has no loads, springs or masses, so that there are no forces to be shown."""
    if message := missing_loads(mechanism):
        raise BadInput("$.loads", message)


def missing_loads(mechanism: Mechanism) -> str:
    """If nothing acts on a mechanism, the sentence that says so and how loads are written in its file; else nothing."""
    if mechanism.loads or mechanism.springs or mechanism.masses:
        return ""
    frame = mechanism.frame
    moving = [each.name for each in named_points(mechanism) if frame not in (link for link, _ in each.members)]
    links = [link.name for link in mechanism.links if link.name != frame]
    load = {"point": moving[-1], "force": [-100, 0]} if moving else {"link": links[-1], "torque": 10} if links else {}
    mass = {"link": links[-1], "mass": 2, "at": [0, 0]} if links else {}
    example = json.dumps({"loads": [load], "masses": [mass]}, ensure_ascii=False)[1:-1] if links else '"loads": []'
    newton, moment, mass_unit = (
        mechanism.units.declared(kind) or SI_UNITS[kind] for kind in ("force", "torque", "mass")
    )
    return (
        f"the mechanism has no loads, springs or masses; write forces ({newton}) at points or torques ({moment}) on "
        f"links, and masses ({mass_unit}), as {example} in its file"
    )


class _LoadChecker:
    """The names of one mechanism."""

    def __init__(self, mechanism: Mechanism):
        self.names = {
            "point": tuple(attachments(mechanism)),
            "link": tuple(link.name for link in mechanism.links),
            "pair": tuple(relative_motions(mechanism)),
            "input": tuple(given.pair for given in mechanism.inputs),
        }
        self.own = {link.name: link.names for link in mechanism.links}

    def load_problems(self, load: Load) -> Problems:
        """What is wrong with a load."""
        if load.pair is not None and load.points is not None:
            yield "an effort acts at a pair or between two points, not both; make two loads of it"
        between = load.pair if load.points is None else load.points
        parts = ((load.point, load.force), (load.link, load.torque), (between, load.effort))
        if any((target is None) != (size is None) for target, size in parts):
            yield (
                "a force acts at a point, a torque on a link, an effort at a pair or between two points; one of the "
                "two is left out"
            )
        if all(target is None for target, _ in parts):
            yield "a load is a force at a point, a torque on a link, or an effort at a pair or between two points"
        yield from self._unknown_name_problems(point=load.point, link=load.link, pair=load.pair)
        for point in load.points or ():
            yield from self._unknown_name_problems(point=point)
        if load.points is not None and (len(load.points) != 2 or load.points[0] == load.points[1]):
            yield "a force acts between two different points"
        yield from self._unknown_name_problems(link=load.axes)
        yield from _nonfinite_problems((*(load.force or ()), load.torque or 0.0, load.effort or 0.0))
        if load.varies is not None:
            course = load.varies
            yield from self._unknown_name_problems(input=course.input)
            if len(course.at) < 2 or len(course.at) != len(course.factors) or list(course.at) != sorted(course.at):
                yield "a load varies over two places or more that rise, with a factor for each"
            yield from _nonfinite_problems((*course.at, *course.factors))

    def spring_problems(self, spring: Spring) -> Problems:
        """What is wrong with a spring."""
        if (spring.points is None) == (spring.links is None):
            yield "a spring stands between two points, or turns between two links"
        for end in spring.ends:
            yield from self._unknown_name_problems(**{"link" if spring.is_torsional else "point": end})
        yield from _nonfinite_problems((spring.stiffness, spring.free, spring.damping))
        if min(spring.stiffness, spring.damping) < 0.0:
            yield "stiffness and damping are zero or more"

    def mass_problems(self, mass: Mass) -> Problems:
        """What is wrong with a mass."""
        yield from self._unknown_name_problems(link=mass.link)
        if isinstance(mass.at, str) and mass.at not in self.own[mass.link]:
            yield f"link {mass.link!r} has no point {mass.at!r}"
        yield from _nonfinite_problems((mass.mass, mass.inertia, *(() if isinstance(mass.at, str) else mass.at)))
        if min(mass.mass, mass.inertia) < 0.0:
            yield "mass and inertia are zero or more"

    def _unknown_name_problems(self, **named: str | None) -> Problems:
        for what, name in named.items():
            if name is not None and name not in self.names[what]:
                yield f"there is no {what} {name!r}; {what}s are {', '.join(self.names[what])}"


def _nonfinite_problems(values: Iterable[float]) -> Problems:
    if not all(map(isfinite, values)):
        yield "loads, springs and masses are finite numbers"
