"""What a page carries to find forces: a mechanism's balance as JavaScript, and what stands in which row of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

import casadi as ca

from planar.codegen.javascript import printed
from planar.dynamics.forces import forces
from planar.dynamics.lagrangian import Work
from planar.dynamics.load_attachment import choices
from planar.dynamics.reactions import borne
from planar.dynamics.virtual_velocities import slides
from planar.foundation.errors import NoAnswer
from planar.foundation.geometry import Vector
from planar.model.loads import Course, Load, Spring
from planar.model.mechanism import Mechanism, motions
from planar.model.pairs import Pair
from planar.model.pairs.base import Contact
from planar.reports.tables.forces import undetermined
from planar.results.motion import State


class Rows:
    """Rows over the coordinates q, and places in the world, that the page's function `balance` gives."""

    def __init__(self, work: Work):
        self.work, self.mechanism = work, work.mechanism
        self.rows: list[ca.SX] = []
        self.places: list[ca.SX] = []

    def add(self, rows: ca.SX) -> list[int]:
        """From which row on, and to which one."""
        first = self.count
        self.rows.append(rows)
        return [first, self.count]

    @property
    def count(self) -> int:
        """How many rows there are."""
        return sum(each.size1() for each in self.rows)

    def place(self, at: Vector) -> int:
        """The number of a place."""
        self.places.append(ca.vertcat(at.x, at.y))
        return len(self.places) - 1

    def origin(self, link: str) -> int:
        """The number of the place where a link's axes start."""
        return self.place(self.work.frames[link].carry(Vector(0.0, 0.0)))

    def carried(self, link: str, point: str) -> Vector:
        """Where a point of a link is."""
        return self.work.frames[link].carry(self.work.shapes[link].at(point))

    def along(self, pair: Pair, contact: Contact, way: Vector) -> int:
        """The row of a force of one along a way at a contact, on the second link, and its opposite on the first."""
        senses = dict(zip(pair.links, (-1.0, 1.0), strict=True))
        return self.add(self.work.push(senses, contact.at, way).T)[0]


def loaded(mechanism: Mechanism, d: ca.SX, state: State, unit: float) -> tuple[dict[str, Any], str] | None:
    """The data and the function of the forces; None where nothing acts.

    Of a mechanism with the dimensions `d` as symbols, as it stands in its file (`state`), and its size `unit` (m).
    """
    if not (mechanism.loads or mechanism.masses or mechanism.springs):
        return None
    work = Work(mechanism, unit)
    rows = Rows(work)
    slopes = ca.jacobian(work.gaps, work.q)
    first, pairs = 0, []
    for pair in mechanism.pairs:
        last = first + len(pair.constrains)
        pairs.append(_pair(pair, rows, rows.add(slopes[first:last, :])))
        first = last
    data = {
        "links": list(work.links),
        "coordinates": work.q.numel(),
        "pairs": pairs,
        "inputs": [
            _input(given.pair, rows, rows.add(work.effort(given.pair).T)[0], slides(mechanism, given.pair))
            for given in mechanism.inputs
        ],
        "acting": list(_acting(rows)),
        "springs": [_wound(work, spring) for spring in mechanism.springs],
        "massive": bool(mechanism.masses),
        "timed": any(load.varies is not None and load.varies.input is None for load in mechanism.loads),
        "untold": _untold(state),
        "choices": list(choices(mechanism)),
    }
    data["inertia"] = rows.add(work.inertia.T)[0]
    table = ca.vertcat(*rows.rows)
    data["row"], data["column"] = (list(each) for each in table.sparsity().get_triplet())
    told = ca.vertcat(*table.nonzeros(), *rows.places)
    given = [work.q, work.q1, work.q2, work.factors, work.turns, d]
    data |= {"rows": rows.count, "told": told.numel()}
    return data, printed("balance", ca.Function("balance", given, [told]))


def _pair(pair: Pair, rows: Rows, held: list[int]) -> dict[str, Any]:
    work, own = rows.work, rows.work.own[pair.name]
    contact = pair.contact(work.frames, work.shapes, rows.mechanism.pairs)
    end = borne(pair)
    at = contact.at if contact is not None else None
    if at is None and end is not None:
        at = rows.carried(*end)
    return {
        "name": pair.name,
        "links": list(pair.links),
        "bodies": list(dict.fromkeys(pair.bodies)),
        "rows": held,
        "own": [own.start, own.stop],
        "at": None if at is None else rows.place(at),
        "contact": contact
        and {
            "along": rows.along(pair, contact, contact.way),
            "apart": rows.along(pair, contact, contact.apart),
            "slope": float(contact.slope),
        },
        # only couples are known, not what forces they come from
        "unshared": pair.ties_angles and contact is None,
    }


def _input(name: str, rows: Rows, row: int, slide: bool) -> dict[str, Any]:
    """How an input acts, and where: on one link, and the opposite on another."""
    pair = motions(rows.mechanism)[name]
    way, end = pair.effort(rows.work.frames, rows.work.shapes), borne(pair)
    if way.at is not None:
        at = rows.place(way.at)
    elif end is not None:
        at = rows.place(rows.carried(*end))
    else:
        at = rows.origin(way.on)
    return {"pair": name, "row": row, "slides": slide, "on": way.on, "against": way.against, "at": at}


def _acting(rows: Rows) -> Iterator[dict[str, Any]]:
    """Every load, weight and spring, in the order of `Work.acting`: its row, and its places on links."""
    work, mechanism = rows.work, rows.mechanism
    row, _ = rows.add(work.acting.T)
    for load in mechanism.loads:
        on = _loaded_links(load, rows)
        name = next(each for each in (load.point, load.link, load.pair) if each is not None)
        yield {
            "kind": "load",
            "name": name,
            "row": row,
            "on": list(on.items()),
            "course": _course(load.varies, mechanism),
        }
        row += 1
    for mass in mechanism.masses:
        yield {"kind": "weight", "name": mass.link, "row": row, "on": [(mass.link, rows.place(work.centre(mass)))]}
        row += 1
    for number, spring in enumerate(mechanism.springs, start=1):
        if spring.turns:
            ends = [(link, rows.origin(link)) for link in spring.ends]
        else:
            hung = [work.attachments[end] for end in spring.ends]
            ends = [(each.link, rows.place(work.place(each))) for each in hung]
        yield {"kind": "spring", "name": str(number), "row": row, "on": ends}
        row += 1


def _loaded_links(load: Load, rows: Rows) -> Mapping[str, int]:
    """The links on which a load acts, each with the place."""
    on: dict[str, int] = {}
    if load.point is not None:
        at = rows.work.attachments[load.point]
        on[at.link] = rows.place(rows.work.place(at))
    if load.link is not None:
        on.setdefault(load.link, rows.origin(load.link))
    if load.pair is not None:
        way = _input(load.pair, rows, -1, False)
        on = {way["on"]: way["at"], way["against"]: way["at"]} | on
    return on


def _course(course: Course | None, mechanism: Mechanism) -> dict[str, Any] | None:
    if course is None:
        return None
    names = [given.pair for given in mechanism.inputs]
    return {
        "input": None if course.input is None else names.index(course.input),
        "turns": course.input is not None and not slides(mechanism, course.input),
        "at": list(course.at),
        "factors": list(course.factors),
    }


def _wound(work: Work, spring: Spring) -> dict[str, Any] | None:
    """Of a spring that turns: the coordinates of its links' angles, and off which angle it is wound up the least."""
    if not spring.turns:
        return None
    return {
        "angles": [work.column[end] + 2 if end in work.column else None for end in spring.ends],
        "free": spring.free,
    }


def _untold(state: State) -> list[str]:
    """What equilibrium does not tell as the file has it, in sentences."""
    try:
        return list(undetermined(forces(state)))
    except NoAnswer as refused:
        return [str(refused)]
