"""Assemblies of Ondsel's solver (`.asmt`), as FreeCAD hands them over: parts in space whose joints lie in one plane."""

from __future__ import annotations

from math import atan2, degrees, hypot, pi
from typing import NamedTuple

from planar.formats.drawn.drawn_document import drawn_document
from planar.formats.drawn.drawn_linkage import (
    DrawnInput,
    DrawnLinkage,
    DrawnMass,
    DrawnStop,
    Joint,
    PinJoint,
    Place,
    RackJoint,
    SlideJoint,
    Tracer,
    WheelJoint,
    stop_phrase,
    unit_note,
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
    cross,
    dot,
    markers,
    numbers,
    parse_tree,
    read_pose,
)
from planar.formats.texts.names import NameBook
from planar.foundation.errors import BadInput
from planar.foundation.units import parse_unit

FRAME = "ground"
PARALLEL, TOUCHING, EXACT = 1e-6, 1e-4, 1e-8
"""Of unit vectors that are parallel; of the radii of wheels that touch; of the assembly's size, gaps of joints that are
noted."""
ERROR_TOLERANCE, MAX_GAP_RATIO = 1e-6, 4e-5
"""The solver's `errorTol` where a file states none, and the greatest gap of a closed joint, of the assembly's size.

The solver stops when its last step is below `errorTol`. Current writers measure the step in lengths of the assembly,
older ones in the file's unit: engine1.asmt of the solver's examples, of size 0.021 m, has a joint that is open by
0.63 um, 3e-5 of the size, within the `errorTol` of 1e-6 that it states.
"""
AT_LIMIT = 1e-6
"""rad, or of the assembly's size: a joint this far beyond its limit is at it."""
SOLVER_LINE, FREECAD_NAME = "OndselSolver", "OndselAssembly"
"""The first line of a file that the solver wrote, and the name that FreeCAD gives an assembly.

One of them with placeholder masses is a file of FreeCAD, which measures in mm; the solver's examples are in m.
"""
STANDARD_GRAVITY = (9.7, 9.9)
"""Between which magnitudes gravity is in m/s^2, whatever the unit of length."""
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
    merged = without_loose_links(merge_links_of_two_pins(merge_links(linkage, welds)))
    return drawn_document(merged, source.place)


class _Reader:
    """One assembly on its way to a linkage."""

    def __init__(self, assembly: Node, source: ForeignText) -> None:
        self.assembly, self.place = assembly, source.place
        self.title = assembly.value("Name") or source.title
        self.has_placeholder_masses = _has_placeholder_masses(assembly)
        is_named = assembly.value("Name") == FREECAD_NAME or source.text.lstrip().startswith(SOLVER_LINE)
        is_from_freecad = self.has_placeholder_masses and is_named
        self.length = source.length_unit or ("mm" if is_from_freecad else "m")
        self.metres = parse_unit(self.length).to_si(1.0)
        self.book = NameBook({FRAME})
        self.notes: list[str] = []
        self.markers: dict[str, Held] = {}
        base = f"/{assembly.value('Name') or ''}"
        merged = read_pose(assembly, self.place) if assembly.find("Position3D") else IDENTITY
        for name, pose in markers(assembly, merged, self.place):
            self.markers[f"{base}/{name}"] = Held(FRAME, pose)
        self.parts: dict[str, tuple[Node, Pose]] = {}
        for part in assembly.walk("Parts"):
            pose = merged.place(read_pose(part, self.place))
            name = self.book.fresh(part.value("Name") or "part")
            self.parts[name] = part, pose
            for marker, at in markers(part, pose, self.place):
                self.markers[f"{base}/{part.value('Name') or ''}/{marker}"] = Held(name, at)
        constraints = assembly.find("ConstraintSets")
        self.given = [] if constraints is None else constraints.walk("Joints")
        self.motions = [] if constraints is None else constraints.walk("Motions")
        self.limits = [] if constraints is None else constraints.walk("Limits")
        gravity = assembly.find("ConstantGravity")
        self.gravity = numbers(gravity.children[0], 3, self.place) if gravity and gravity.children else (0.0, 0.0, 0.0)
        normal = self._normal()
        self.first, self.second = _plane_axes(normal, self.gravity)
        self.normal = cross(self.first, self.second)
        self.size = max(map(self._extent, (assembly, *assembly.walk("Parts"))), default=0.0) or 1.0
        self.max_gap = min(self._error_tolerance() * max(self.size, 1.0), MAX_GAP_RATIO * self.size)

    def _extent(self, node: Node) -> float:
        """The largest distance from the axes of a node at which something of it lies."""
        extent = 0.0
        for child in node.children:
            if child.text == "Position3D" and len(child.children) == 1:
                extent = max(extent, hypot(*numbers(child.children[0], 3, self.place)))
            elif child.text not in ("ConstraintSets", "ForceTorques"):
                extent = max(extent, self._extent(child))
        return extent

    def _error_tolerance(self) -> float:
        """The `errorTol` of the solver that wrote the file."""
        parameters = self.assembly.find("SimulationParameters")
        value = parameters and parameters.find("errorTol")
        return numbers(value.children[0], 1, self.place)[0] if value and value.children else ERROR_TOLERANCE

    def _ends(self, joint: Node) -> tuple[Held, Held]:
        result = [self.markers.get(joint.value(key) or "") for key in ("MarkerI", "MarkerJ")]
        if result[0] is None or result[1] is None:
            raise BadInput(self._place_of(joint), "it names a marker that is not there")
        return result[0], result[1]

    def _place_of(self, joint: Node) -> str:
        return f"{self.place}, line {joint.line}, joint {joint.value('Name') or ''}"

    def _normal(self) -> Triple:
        """The common direction of all axes about which parts turn."""
        turning = [item for item in self.given if item.text == "RevoluteJoint"]
        if not turning:
            raise BadInput(self.place, "there is no revolute joint, so no plane in which the parts move")
        normal = self._ends(turning[0])[0].pose.column(2)
        for item in turning:
            if abs(abs(dot(normal, self._ends(item)[0].pose.column(2))) - 1.0) > PARALLEL:
                raise BadInput(self._place_of(item), "its axis is not parallel to the others: the parts move in space")
        return normal

    def flat(self, at: Triple) -> Place:
        """A place in the plane."""
        return dot(self.first, at), dot(self.second, at)

    def read(self) -> tuple[DrawnLinkage, list[tuple[str, ...]]]:
        result: list[Joint] = []
        welds: list[tuple[str, ...]] = []
        named: dict[str, tuple[Joint, Node]] = {}
        gears = [item for item in self.given if item.text == "GearJoint"]
        for item in (*(joint for joint in self.given if joint not in gears), *gears):
            if item.text not in KNOWN:
                raise self._no_pair(item)
            one, other = self._ends(item)
            if item.text == "FixedJoint":
                welds.append((one.part, other.part))
                continue
            if item.text == "RackPinionJoint":
                result.append(self._rack(item, one, other))
                continue
            joint = self._gear(item, result) if item in gears else self._joint(item, one, other)
            result.append(joint)
            named[(item.value("Name") or "").rpartition("/")[2]] = joint, item
        used = {item.value(key) for item in self.given for key in ("MarkerI", "MarkerJ")}
        tracers = [
            Tracer(self.book.fresh(name.rpartition("/")[2]), held.part, self.flat(held.pose.at))
            for name, held in self.markers.items()
            if name not in used and held.part != FRAME
        ]
        inputs = [given for motion in self.motions if (given := self._input(motion, named))]
        if self.assembly.walk("ForceTorques"):
            self.notes.append("forces and torques of the file are left out")
        self._note_size()
        linkage = DrawnLinkage(
            self.title,
            FRAME,
            tuple(result),
            tuple(tracers),
            tuple(inputs),
            masses=tuple(self._masses(welds)),
            stops=tuple(self._stops(named)),
            gravity=self._plane_gravity(),
            length=self.length,
            links=(FRAME, *self.parts),
            notes=tuple(self.notes),
        )
        return linkage, welds

    def _note_size(self) -> None:
        """Say how large the assembly is in the unit in which it is read."""
        places = [self.flat(held.pose.at) for held in self.markers.values()]
        for part, pose in self.parts.values():
            marker = part.find("PrincipalMassMarker")
            if marker is not None and marker.find("Position3D") is not None:
                places.append(self.flat(pose.place(read_pose(marker, self.place)).at))
        width, height = (max(values) - min(values) for values in zip(*places, strict=True))
        size = f"{_rounded(height)} {self.length} high and {_rounded(width)} {self.length} wide"
        self.notes.append(f"{unit_note(self.length)}: the assembly is {size}")

    def _plane_gravity(self) -> Place:
        """Gravity in the plane of motion (m/s^2)."""
        magnitude = hypot(*self.gravity)
        low, high = STANDARD_GRAVITY
        factor = 1.0 if low < magnitude < high else self.metres
        if abs(dot(self.gravity, self.normal)) > 1e-9 * magnitude:
            self.notes.append("the component of gravity across the plane of motion is left out")
        x, y = self.flat(self.gravity)
        return factor * x, factor * y

    def _stops(self, named: dict[str, tuple[Joint, Node]]) -> list[DrawnStop]:
        """The stops of joints by the limits of the file, two of which may be of one joint."""
        bounds: dict[tuple[str, tuple[str, str]], dict[str, float]] = {}
        for limit in self.limits:
            name, text = limit.value("Name") or "", limit.value("Limit") or ""
            joint, node = self._limited_joint(limit, named)
            if joint is None or node is None:
                self.notes.append(f"the limit {name!r} of {text} is at no pin or slide and is left out")
                continue
            value = motion_formula(text, self._place_of(limit))(0.0)
            markers = [self.markers.get(limit.value(key) or "") for key in ("MarkerI", "MarkerJ")]
            one, other = (markers[0], markers[1]) if markers[0] and markers[1] else self._ends(node)
            if isinstance(joint, PinJoint):
                sense = 1.0 if dot(one.pose.column(2), self.normal) > 0.0 else -1.0
                position, links = _turn_about_z(one.pose, other.pose), (one.part, other.part)
            else:
                guide, axis = self._ends(node)[0], one.pose.column(2)
                sense = 1.0 if dot(axis, guide.pose.column(2)) > 0.0 else -1.0
                sense *= 1.0 if one.part == joint.guide else -1.0
                position = sum(axis[i] * (other.pose.at[i] - one.pose.at[i]) for i in range(3))
                links = (joint.guide, joint.slider)
            is_upper = (limit.value("Type") == "=<") == (sense > 0.0)
            bounds.setdefault((joint.name, links), {})["high" if is_upper else "low"] = sense * (value - position)
        return [
            stop for (name, links), distances in bounds.items() if (stop := self._stop(name, links, distances, named))
        ]

    def _limited_joint(
        self, limit: Node, named: dict[str, tuple[Joint, Node]]
    ) -> tuple[PinJoint | SlideJoint | None, Node | None]:
        """The pin or slide of a limit: the one that it names, else that of its markers."""
        joint, node = named.get((limit.value("MotionJoint") or "").rpartition("/")[2], (None, None))
        if node is None:
            ends = {limit.value("MarkerI"), limit.value("MarkerJ")}
            at_markers = (
                item for item in named.values() if {item[1].value("MarkerI"), item[1].value("MarkerJ")} == ends
            )
            joint, node = next(at_markers, (None, None))
        if isinstance(joint, PinJoint) and limit.text == "RotationLimit":
            return joint, node
        return (joint, node) if isinstance(joint, SlideJoint) and limit.text == "TranslationLimit" else (None, None)

    def _stop(
        self, name: str, links: tuple[str, str], distances: dict[str, float], named: dict[str, tuple[Joint, Node]]
    ) -> DrawnStop | None:
        """The stop of these distances from the drawn position; None, with a note, where that is beyond it."""
        joint = next(joint for joint, _ in named.values() if joint.name == name)
        low, high = distances.get("low"), distances.get("high")
        if isinstance(joint, PinJoint) and low is not None and high is not None:
            turns = next((turn for turn in (0.0, -2.0 * pi, 2.0 * pi) if low + turn <= 0.0 <= high + turn), 0.0)
            low, high = low + turns, high + turns
        room = AT_LIMIT * (1.0 if isinstance(joint, PinJoint) else self.size)
        stop = DrawnStop(name, links, low, high)
        if (low or 0.0) > room or (high or 0.0) < -room or (low is not None and high is not None and not low < high):
            self.notes.append(f"{stop_phrase(stop, joint, self.length)} are left out: it was drawn beyond them")
            return None
        return DrawnStop(name, links, None if low is None else min(low, 0.0), None if high is None else max(high, 0.0))

    def _joint(self, given: Node, one: Held, other: Held) -> Joint:
        name, at = self.book.fresh(given.value("Name") or "joint"), self.flat(other.pose.at)
        start, axis = self.flat(one.pose.at), one.pose.column(2)
        across = abs(dot(axis, self.normal))
        gap = hypot(at[0] - start[0], at[1] - start[1])
        if given.text == "RevoluteJoint" or (given.text == "CylindricalJoint" and across > 1.0 - PARALLEL):
            if gap > self.max_gap:
                message = f"its markers are {gap:.3g} {self.length} apart; save the assembly closed"
                raise BadInput(self._place_of(given), message)
            if gap > EXACT * self.size:
                self.notes.append(f"the joint {name!r} is open by {gap:.2g} {self.length} in the file, and closed here")
            return PinJoint(name, (one.part, other.part), at)
        if given.text in ("TranslationalJoint", "CylindricalJoint") and across < PARALLEL:
            u, v = self.flat(axis)
            off = abs((at[0] - start[0]) * v - (at[1] - start[1]) * u)
            if off > self.max_gap:
                message = f"its markers are {off:.3g} {self.length} off its line; save the assembly closed"
                raise BadInput(self._place_of(given), message)
            if off > EXACT * self.size:
                self.notes.append(
                    f"the joint {name!r} is {off:.2g} {self.length} off its line in the file, and on it here"
                )
            return SlideJoint(name, one.part, other.part, at, degrees(atan2(v, u)), start)
        raise self._no_pair(given)

    def _no_pair(self, given: Node) -> BadInput:
        return BadInput(
            self._place_of(given), f"a {given.text!r:.40} as this stands is no pair of the plane that is read"
        )

    def _rack(self, given: Node, rack: Held, pinion: Held) -> RackJoint:
        """x + r a stays as it is: of the pinion's marker along the x-axis of the rack's, and its turn about that z."""
        radius, *_ = numbers(Node(given.value("pitchRadius") or "", given.line), 1, self.place)
        way, axis = rack.pose.column(0), dot(rack.pose.column(2), self.normal)
        if abs(abs(axis) - 1.0) > PARALLEL or abs(dot(way, self.normal)) > PARALLEL:
            raise BadInput(
                self._place_of(given), "its pinion's axis is not parallel to the others: the parts move in space"
            )
        if radius == 0.0:
            raise BadInput(self._place_of(given), "zero is no radius of a pinion")
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
            raise BadInput(self._place_of(given), "its wheels turn on no common part")
        apart = hypot(centres[0][0] - centres[1][0], centres[0][1] - centres[1][1])
        first, second = abs(radii[0]), abs(radii[1])
        if abs(apart - first - second) > TOUCHING * (first + second):
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
        formula = motion_formula(text, self._place_of(motion))
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
        if self.has_placeholder_masses:
            self.notes.append(
                "every part has a mass of 1 kg and moments of inertia of 1 kg m^2, which are placeholders; "
                "no mass is read"
            )
            return []
        still = {FRAME, *(part for two in welds if FRAME in two for part in two)}
        result = []
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
                result.append(DrawnMass(name, mass, self.flat(where.at), max(about, 0.0) * self.metres**2))
        return result


def _has_placeholder_masses(assembly: Node) -> bool:
    """Whether every part has the mass and the moments of inertia that stand for none."""
    markers_of_mass = [part.find("PrincipalMassMarker") for part in assembly.walk("Parts")]
    values = [
        [*(marker.value("Mass") or "").split(), *(marker.value("MomentOfInertias") or "").split()]
        for marker in markers_of_mass
        if marker is not None
    ]
    return bool(values) and all(len(item) == 4 and set(map(_number, item)) == {1.0} for item in values)


def _rounded(size: float) -> str:
    """A size to three digits, whole from 100 on."""
    return f"{size:.0f}" if size >= 100.0 else f"{size:.3g}"


def _number(text: str) -> float | None:
    try:
        return float(text)
    except ValueError:
        return None


def _turn_about_z(one: Pose, other: Pose) -> float:
    """The angle of the other's x-axis about the z-axis of the one (rad)."""
    axis = other.column(0)
    return atan2(dot(one.column(1), axis), dot(one.column(0), axis))


def _plane_axes(normal: Triple, gravity: Triple) -> tuple[Triple, Triple]:
    """The horizontal and the vertical axis of the plane of motion, as a view of the assembly shows them.

    The view is that from above (x, y), else from the front (x, z) or from the right (y, z) or between them, and
    in these the vertical axis points against gravity where that acts in the plane.
    """
    x, y, z = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    if abs(normal[2]) > 0.9:
        upward = y
    else:
        weight = _along_plane(gravity, normal)
        is_in_plane = hypot(*weight) > 0.9 * hypot(*gravity) > 0.0
        upward = (-gravity[0], -gravity[1], -gravity[2]) if is_in_plane else z
    vertical = _unit(_along_plane(upward, normal))
    horizontal = _unit(cross(vertical, normal))
    leading = dot(horizontal, x) if abs(dot(horizontal, x)) > 1e-9 else dot(horizontal, y) or dot(horizontal, z)
    if leading < 0.0:
        horizontal = (-horizontal[0], -horizontal[1], -horizontal[2])
    return horizontal, vertical


def _along_plane(vector: Triple, normal: Triple) -> Triple:
    across = dot(vector, normal)
    return vector[0] - across * normal[0], vector[1] - across * normal[1], vector[2] - across * normal[2]


def _unit(vector: Triple) -> Triple:
    size = hypot(*vector)
    return vector[0] / size, vector[1] / size, vector[2] / size


FORMAT = FileFormat(
    name="ondsel",
    title="Ondsel, FreeCAD (.asmt)",
    suffixes=(".asmt",),
    source="ASMT*.cpp and testapp/*.asmt of FreeCAD/OndselSolver",
    recognise=recognise,
    read=read,
    names_length_unit=False,
)
