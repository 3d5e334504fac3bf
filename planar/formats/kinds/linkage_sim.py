"""Mechanisms that linkage_sim saves as JSON 1.0.0: bodies with points in axes of their own, and joints of two."""

from __future__ import annotations

from math import atan2, cos, sin
from typing import Any

from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.kinds.parts.linkage_sim_text import VERSION, write
from planar.formats.texts.foreign_value import ForeignValue
from planar.formats.texts.names import NameBook

FRAME = "ground"
JOINTS = ("revolute", "prismatic", "fixed")
Moved = dict[str, tuple[str, float, float, float]]
"""Bodies that are fixed to others: to which, where their origin lies there, and how they are turned."""


def recognise(source: ForeignText) -> bool:
    """Whether it is an object with bodies, joints and a version of the form."""
    value = source.value
    return isinstance(value, dict) and isinstance(value.get("bodies"), dict) and isinstance(value.get("joints"), dict)


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of a file, without the input, which the form does not hold. Raises BadInput at a JSON path."""
    return _Reader(ForeignValue(source.value), source.title).read()


class _Reader:
    """One file on its way to a planar file."""

    def __init__(self, top: ForeignValue, title: str) -> None:
        version = top.text("schema_version", VERSION)
        if version != VERSION:
            raise top.at("schema_version").error(f"the form is of version {VERSION}, not {version!r:.40}")
        self.top, self.title = top, title
        self.book = NameBook()
        self.bodies = dict(top.members("bodies"))
        if FRAME not in self.bodies:
            raise top.at("bodies").error(f"there is no body {FRAME!r} to stand still")
        self.links = {key: self.book.name("link", key) for key in self.bodies}
        self.points: dict[str, dict[str, str]] = {key: {} for key in self.bodies}
        self.places: dict[str, dict[str, tuple[float, float]]] = {key: {} for key in self.bodies}
        for key, body in self.bodies.items():
            self._add_points(key, body)
        self.notes = ["the form holds no input; add one under 'inputs' to the file that is written of it"]

    def _add_points(self, key: str, body: ForeignValue) -> None:
        points = NameBook()
        for group in ("attachment_points", "coupler_points"):
            if body.has(group):
                for name, place in body.members(group):
                    message = points.name("point", name)
                    self.points[key][name] = message
                    self.places[key][message] = ForeignValue({"at": place.value}, place.path).pair("at")

    def read(self) -> ReadDocument:
        book = NameBook()
        joints = [(book.fresh(name, "joint"), item) for name, item in self.top.members("joints")]
        moved = self._welds([item for _, item in joints if item.text("type") == "fixed"])
        pairs = []
        pins: list[tuple[str, list[tuple[str, str]]]] = []
        for name, item in joints:
            kind = item.text("type")
            if kind in ("revolute_driver", "prismatic_driver"):
                self.notes.append(f"the driver {name!r} is left out: its function is not in the file")
            elif kind not in JOINTS:
                raise item.at("type").error(f"joints are of type {', '.join(JOINTS)}, not {kind!r:.40}")
            elif kind == "revolute":
                pins = _with_pin(pins, name, [self._end(item, side) for side in "ij"])
            elif kind == "prismatic":
                pairs.append(self._slide(name, item, moved))
        pairs = [self._pin(name, members, moved) for name, members in pins] + pairs
        links = {self.links[key]: {"points": self._link_points(key)} for key in self.bodies if key not in moved}
        value: dict[str, Any] = {"planar": 1, "name": self.title, "notes": self.notes, "frame": self.links[FRAME]}
        value |= {"links": links, "pairs": pairs}
        masses = [mass for key, body in self.bodies.items() if (mass := self._mass(key, body, moved))]
        return ReadDocument(value | ({"masses": masses} if masses else {}), tuple(self.notes))

    def _link_points(self, key: str) -> dict[str, list[float]]:
        return {name: list(at) for name, at in self.places[key].items()} or {"origin": [0.0, 0.0]}

    def _end(self, joint: ForeignValue, side: str) -> tuple[str, str]:
        """The body and the point of a side of a joint."""
        body = joint.text(f"body_{side}")
        if body not in self.bodies:
            raise joint.at(f"body_{side}").error(f"there is no body {body!r:.60}")
        point = joint.text(f"point_{side}")
        if point not in self.points[body]:
            raise joint.at(f"point_{side}").error(f"the body {body!r:.60} has no point {point!r:.60}")
        return body, self.points[body][point]

    def _welds(self, joints: list[ForeignValue]) -> Moved:
        """The bodies that fixed joints hold; their points go over to the other body."""
        moved: Moved = {}
        for item in joints:
            (one, p), (two, q) = self._end(item, "i"), self._end(item, "j")
            turn = item.number("delta_theta_0", 0.0)
            if one in moved or two in moved or one == two:
                raise item.error("chains of fixed joints are not read; fix all bodies to one")
            if two == FRAME:
                one, two, p, q, turn = two, one, q, p, -turn
            c, s = cos(turn), sin(turn)
            (px, py), (qx, qy) = self.places[one][p], self.places[two][q]
            x, y = px - (c * qx - s * qy), py - (s * qx + c * qy)
            moved[two] = (one, x, y, turn)
            own = NameBook(self.places[one])
            renamed = {name: own.fresh(f"{two}_{name}") for name in self.places[two]}
            for name, (u, v) in self.places[two].items():
                self.places[one][renamed[name]] = (x + c * u - s * v, y + s * u + c * v)
            self.points[two] = {foreign: renamed[name] for foreign, name in self.points[two].items()}
        return moved

    def _pin(self, name: str, members: list[tuple[str, str]], moved: Moved) -> dict[str, Any]:
        links = [self.links[moved.get(body, (body,))[0]] for body, _ in members]
        if len(set(links)) < len(links):
            raise self.top.at("joints").error(f"the joint {name!r:.60} is between bodies that are fixed to each other")
        return {"turning": name, "links": links, "points": [point for _, point in members]}

    def _slide(self, name: str, joint: ForeignValue, moved: Moved) -> dict[str, Any]:
        (one, p), (two, q) = self._end(joint, "i"), self._end(joint, "j")
        first, second = (moved.get(item, (item, 0.0, 0.0, 0.0)) for item in (one, two))
        links = [self.links[first[0]], self.links[second[0]]]
        if links[0] == links[1]:
            raise joint.error("both its bodies are fixed to each other")
        x, y = joint.pair("axis_local_i")
        if x == y == 0.0:
            raise joint.at("axis_local_i").error("the axis of a slide has a direction")
        angle = atan2(y, x) + first[3]
        turn = joint.number("delta_theta_0", 0.0) + first[3] - second[3] - angle
        line = {"through": p, "angle": angle}
        return {"sliding": name, "links": links, "line": line, "point": q, "turn": turn}

    def _mass(self, key: str, body: ForeignValue, moved: Moved) -> dict[str, Any] | None:
        mass, inertia = body.number("mass", 0.0), body.number("Izz_cg", 0.0)
        if key == FRAME or not (mass or inertia):
            return None
        if min(mass, inertia) < 0.0:
            raise body.error("a mass and a moment of inertia are no less than zero")
        x, y = body.pair("cg_local") if body.has("cg_local") else (0.0, 0.0)
        link, u, v, turn = moved.get(key, (key, 0.0, 0.0, 0.0))
        at = [u + cos(turn) * x - sin(turn) * y, v + sin(turn) * x + cos(turn) * y]
        return {"link": self.links[link], "mass": mass, "at": at} | ({"inertia": inertia} if inertia else {})


def _with_pin(
    pins: list[tuple[str, list[tuple[str, str]]]], name: str, ends: list[tuple[str, str]]
) -> list[tuple[str, list[tuple[str, str]]]]:
    """The pins with one more joint: pins that share a point of a body are one, by that point's name if all have it."""
    joined = [(name, ends)]
    apart: list[tuple[str, list[tuple[str, str]]]] = []
    for item in pins:
        (joined if set(item[1]) & set(ends) else apart).append(item)
    members = list(dict.fromkeys(member for _, some in sorted(joined[1:]) + joined[:1] for member in some))
    points = {point for _, point in members}
    taken = {other for other, _ in apart}
    common = points.pop() if len(joined) > 1 and len(points) == 1 else joined[-1][0]
    return [*apart, (name if common in taken else common, members)]


FORMAT = FileFormat(
    name="linkage_sim",
    title="linkage_sim (JSON 1.0.0)",
    suffixes=(),
    source="src/linkage_sim/io/serialization.py and ARCHITECTURE.md of coleas33/linkage_sim",
    recognise=recognise,
    read=read,
    write=write,
    precision="double precision",
)
