"""Assemblies of Ondsel's solver (`.asmt`), as FreeCAD hands them over: parts in space whose joints lie in one plane."""

from __future__ import annotations

from math import atan2, degrees, hypot
from typing import NamedTuple

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    DrawnMass,
    Joint,
    PinJoint,
    Place,
    RackJoint,
    SlideJoint,
    Tracer,
    WheelJoint,
)
from planar.formats.drawn.file_format import FileFormat, ForeignText, ReadDocument
from planar.formats.drawn.rigid_links import merge_links, merge_links_of_two_pins, without_loose_links
from planar.formats.drawn.wheels import common_carrier, wheel_centre
from planar.formats.kinds.parts.ondsel_motion import constant_rate, motion_formula
from planar.formats.kinds.parts.ondsel_tree import (
    IDENTITY,
    Node,
    Pose,
    Triple,
    dot,
    markers,
    numbers,
    parse_tree,
    read_pose,
)
from planar.formats.texts.names import NameBook
from planar.foundation.errors import BadInput

FRAME = "ground"
PARALLEL, CLOSED, EXACT = 1e-6, 1e-4, 1e-8
"""Of unit vectors that are parallel; of the assembly's size, gaps of joints that are closed, and that are told."""
KNOWN = (
    *("RevoluteJoint", "CylindricalJoint", "TranslationalJoint", "FixedJoint"),
    *("GearJoint", "RackPinionJoint"),
)
"""Joints of which some are pairs of a plane."""
TABLE_STEPS = 200
"""Of the table that stands for a motion of any other course than an even one."""


class Held(NamedTuple):
    """A marker: the part that it is on, and where it is in space."""

    part: str
    pose: Pose


def recognise(source: ForeignText) -> bool:
    """Whether it begins as such a file does, with an assembly."""
    return source.value is None and "\nAssembly\n" in source.text[:300].replace("\r", "") and "\n\tParts" in source.text


def read(source: ForeignText) -> ReadDocument:
    """The mechanism of an assembly whose joints all turn about parallel axes. Raises BadInput at a line or a joint."""
    root = parse_tree(source.text, source.place)
    assembly = root.find("Assembly")
    if assembly is None:
        raise BadInput(source.place, "there is no assembly in this file")
    linkage, welds = _Reader(assembly, source).read()
    whole = without_loose_links(merge_links_of_two_pins(merge_links(linkage, welds)))
    return drawn_document(whole, source.place)


class _Reader:
    """One assembly on its way to a linkage."""

    def __init__(self, assembly: Node, source: ForeignText) -> None:
        self.assembly, self.place = assembly, source.place
        self.title = assembly.value("Name") or source.title
        self.book = NameBook({FRAME})
        self.notes: list[str] = []
        self.markers: dict[str, Held] = {}
        base = f"/{assembly.value('Name') or ''}"
        whole = read_pose(assembly, self.place) if assembly.find("Position3D") else IDENTITY
        for name, pose in markers(assembly, whole, self.place):
            self.markers[f"{base}/{name}"] = Held(FRAME, pose)
        self.parts: dict[str, tuple[Node, Pose]] = {}
        for part in assembly.walk("Parts"):
            pose = whole.place(read_pose(part, self.place))
            name = self.book.fresh(part.value("Name") or "part")
            self.parts[name] = part, pose
            for marker, at in markers(part, pose, self.place):
                self.markers[f"{base}/{part.value('Name') or ''}/{marker}"] = Held(name, at)
        constraints = assembly.find("ConstraintSets")
        self.given = [] if constraints is None else constraints.walk("Joints")
        self.motions = [] if constraints is None else constraints.walk("Motions")
        if constraints is not None and constraints.walk("Limits"):
            self.notes.append("limits of joints are left out")
        self.normal = self._normal()
        self.first, self.second = _plane_axes(self.normal)

    def _ends(self, joint: Node) -> tuple[Held, Held]:
        found = [self.markers.get(joint.value(key) or "") for key in ("MarkerI", "MarkerJ")]
        if found[0] is None or found[1] is None:
            raise BadInput(self._told(joint), "it names a marker that is not there")
        return found[0], found[1]

    def _told(self, joint: Node) -> str:
        return f"{self.place}, line {joint.line}, joint {joint.value('Name') or ''}"

    def _normal(self) -> Triple:
        """The common direction of all axes about which parts turn, its largest part positive."""
        turning = [each for each in self.given if each.text == "RevoluteJoint"]
        if not turning:
            raise BadInput(self.place, "there is no revolute joint, so no plane in which the parts move")
        normal = self._ends(turning[0])[0].pose.column(2)
        if max(normal, key=abs) < 0.0:
            normal = (-normal[0], -normal[1], -normal[2])
        for each in turning:
            if abs(abs(dot(normal, self._ends(each)[0].pose.column(2))) - 1.0) > PARALLEL:
                raise BadInput(self._told(each), "its axis is not parallel to the others: the parts move in space")
        return normal

    def flat(self, at: Triple) -> Place:
        """A place in the plane."""
        return dot(self.first, at), dot(self.second, at)

    def read(self) -> tuple[DrawnLinkage, list[tuple[str, ...]]]:
        found: list[Joint] = []
        welds: list[tuple[str, ...]] = []
        named: dict[str, tuple[Joint, Node]] = {}
        size = max((hypot(*self.flat(each.pose.at)) for each in self.markers.values()), default=0.0) or 1.0
        gears = [each for each in self.given if each.text == "GearJoint"]
        for each in (*(joint for joint in self.given if joint not in gears), *gears):
            if each.text not in KNOWN:
                raise self._no_pair(each)
            one, other = self._ends(each)
            if each.text == "FixedJoint":
                welds.append((one.part, other.part))
                continue
            if each.text == "RackPinionJoint":
                found.append(self._rack(each, one, other))
                continue
            joint = self._gear(each, found) if each in gears else self._joint(each, one, other, size)
            found.append(joint)
            named[(each.value("Name") or "").rpartition("/")[2]] = joint, each
        used = {each.value(key) for each in self.given for key in ("MarkerI", "MarkerJ")}
        tracers = [
            Tracer(self.book.fresh(name.rpartition("/")[2]), held.part, self.flat(held.pose.at))
            for name, held in self.markers.items()
            if name not in used and held.part != FRAME
        ]
        inputs = [given for motion in self.motions if (given := self._input(motion, named))]
        if self.assembly.walk("ForceTorques"):
            self.notes.append("forces and torques of the file are left out")
        gravity = self.assembly.find("ConstantGravity")
        weight = numbers(gravity.children[0], 3, self.place) if gravity and gravity.children else (0.0, 0.0, 0.0)
        if abs(dot(weight, self.normal)) > 1e-9:
            self.notes.append("what of gravity is upright to the plane of motion is left out")
        linkage = DrawnLinkage(
            self.title,
            FRAME,
            tuple(found),
            tuple(tracers),
            tuple(inputs),
            masses=tuple(self._masses(welds)),
            gravity=self.flat(weight),
            length="m",
            links=(FRAME, *self.parts),
            notes=tuple(self.notes),
        )
        return linkage, welds

    def _joint(self, given: Node, one: Held, other: Held, size: float) -> Joint:
        name, at = self.book.fresh(given.value("Name") or "joint"), self.flat(other.pose.at)
        start, axis = self.flat(one.pose.at), one.pose.column(2)
        across = abs(dot(axis, self.normal))
        gap = hypot(at[0] - start[0], at[1] - start[1])
        if given.text == "RevoluteJoint" or (given.text == "CylindricalJoint" and across > 1.0 - PARALLEL):
            if gap > CLOSED * size:
                raise BadInput(self._told(given), f"its markers are {gap:.3g} m apart; save the assembly closed")
            if gap > EXACT * size:
                self.notes.append(f"the joint {name!r} is open by {gap:.2g} m in the file, and closed here")
            return PinJoint(name, (one.part, other.part), at)
        if given.text in ("TranslationalJoint", "CylindricalJoint") and across < PARALLEL:
            u, v = self.flat(axis)
            off = abs((at[0] - start[0]) * v - (at[1] - start[1]) * u)
            if off > CLOSED * size:
                raise BadInput(self._told(given), f"its markers are {off:.3g} m off its line; save the assembly closed")
            return SlideJoint(name, one.part, other.part, at, degrees(atan2(v, u)), start)
        raise self._no_pair(given)

    def _no_pair(self, given: Node) -> BadInput:
        return BadInput(self._told(given), f"a {given.text!r:.40} as this stands is no pair of the plane that is read")

    def _rack(self, given: Node, rack: Held, pinion: Held) -> RackJoint:
        """x + r a stays as it is: of the pinion's marker along the x-axis of the rack's, and its turn about that z."""
        radius, *_ = numbers(Node(given.value("pitchRadius") or "", given.line), 1, self.place)
        way, axis = rack.pose.column(0), dot(rack.pose.column(2), self.normal)
        if abs(abs(axis) - 1.0) > PARALLEL or abs(dot(way, self.normal)) > PARALLEL:
            raise BadInput(
                self._told(given), "its pinion's axis is not parallel to the others: the parts move in space"
            )
        if radius == 0.0:
            raise BadInput(self._told(given), "zero is no radius of a pinion")
        u, v = self.flat(way)
        name, at = self.book.fresh(given.value("Name") or "rack"), self.flat(pinion.pose.at)
        sense = 1.0 if axis > 0.0 else -1.0
        return RackJoint(name, rack.part, pinion.part, at, degrees(atan2(v, u)), sense * radius)

    def _gear(self, given: Node, found: list[Joint]) -> WheelJoint:
        """Gears by their radii: external ones where the centres are as far apart as both together."""
        one, other = (held.part for held in self._ends(given))
        radii = [numbers(Node(given.value(key) or "", given.line), 1, self.place)[0] for key in ("radiusI", "radiusJ")]
        carrier = common_carrier(found, one, other)
        centres = [wheel_centre(found, wheel, carrier) for wheel in (one, other)] if carrier else []
        if carrier is None or centres[0] is None or centres[1] is None:
            raise BadInput(self._told(given), "its wheels turn on no common part")
        apart = hypot(centres[0][0] - centres[1][0], centres[0][1] - centres[1][1])
        first, second = abs(radii[0]), abs(radii[1])
        if abs(apart - first - second) > CLOSED * (first + second):
            first, second = (-first, second) if first > second else (first, -second)
        return WheelJoint(
            self.book.fresh(given.value("Name") or "gear"), "gear", (one, other), carrier, "radii", (first, second)
        )

    def _input(self, motion: Node, named: dict[str, tuple[Joint, Node]]) -> DrawnInput | None:
        """A motion of a joint: even, or by a table of its formula over the time of the simulation."""
        joint, given = named.get((motion.value("MotionJoint") or "").rpartition("/")[2], (None, None))
        turns = isinstance(joint, PinJoint)
        text = motion.value("RotationZ" if turns else "TranslationZ")
        if given is None or not isinstance(joint, PinJoint | SlideJoint) or text is None:
            self.notes.append(f"the motion {motion.value('Name') or ''!r:.40} is left out")
            return None
        one, other = self._ends(given)
        formula = motion_formula(text, self._told(motion))
        sense = -1.0 if turns and dot(one.pose.column(2), self.normal) < 0.0 else 1.0
        until = self._end_of_time()
        rate = constant_rate(formula, until)
        links = (one.part, other.part)
        if rate is not None:
            return DrawnInput(joint.name, links, sense * rate)
        times = tuple(until * step / TABLE_STEPS for step in range(TABLE_STEPS + 1))
        moved = tuple(sense * (formula(time) - formula(0.0)) for time in times)
        self.notes.append(f"the motion {text!r:.60} is a table of {TABLE_STEPS + 1} points here, smooth between them")
        return DrawnInput(joint.name, links, table=(times, moved))

    def _end_of_time(self) -> float:
        simulation = self.assembly.find("SimulationParameters")
        text = simulation.value("tend") if simulation is not None else None
        try:
            until = float(text or "1")
        except ValueError:
            until = 1.0
        return until if 0.0 < until < 1e6 else 1.0

    def _masses(self, welds: list[tuple[str, ...]]) -> list[DrawnMass]:
        """The masses of moving parts, their moments of inertia about the plane's normal."""
        still = {FRAME, *(part for two in welds if FRAME in two for part in two)}
        found = []
        for name, (part, pose) in self.parts.items():
            marker = part.find("PrincipalMassMarker")
            if marker is None or name in still:
                continue
            mass, *_ = numbers(Node(marker.value("Mass") or "", marker.line), 1, self.place)
            inertia = marker.find("MomentOfInertias")
            moments = numbers(inertia.children[0], 3, self.place) if inertia and inertia.children else (0.0, 0.0, 0.0)
            where = pose.place(read_pose(marker, self.place))
            about = sum(moments[i] * dot(where.column(i), self.normal) ** 2 for i in range(3))
            if mass > 0.0:
                found.append(DrawnMass(name, mass, self.flat(where.at), max(about, 0.0)))
        return found


def _plane_axes(normal: Triple) -> tuple[Triple, Triple]:
    """Two axes of the plane, anticlockwise seen against its normal: x and y where that is z."""
    start: Triple = (1.0, 0.0, 0.0) if abs(normal[0]) < 0.9 else (0.0, 1.0, 0.0)
    along = dot(start, normal)
    first = tuple(start[i] - along * normal[i] for i in range(3))
    size = hypot(*first)
    x, y, z = (each / size for each in first)
    return (x, y, z), (normal[1] * z - normal[2] * y, normal[2] * x - normal[0] * z, normal[0] * y - normal[1] * x)


FORMAT = FileFormat(
    name="ondsel",
    title="Ondsel, FreeCAD (.asmt)",
    suffixes=(".asmt",),
    source="ASMT*.cpp and testapp/*.asmt of FreeCAD/OndselSolver",
    recognise=recognise,
    read=read,
    names_length_unit=False,
)
