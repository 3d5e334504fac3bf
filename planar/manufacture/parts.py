"""A mechanism as parts to be cut: plates in layers that clear one another over its run, pins, and sheets."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from math import cos, radians, sin
from pathlib import Path
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.equations.mechanism_numbers import shapes_of_links
from planar.formats.drawn.blocks import slots_for_blocks
from planar.formats.drawn.drawn_linkage import (
    DrawnLinkage,
    Joint,
    RackJoint,
    SlideJoint,
    SlotJoint,
    Tracer,
    WheelJoint,
    joined_links,
)
from planar.formats.drawn.drawn_mechanism import drawn_mechanism
from planar.foundation.errors import BadInput, NoAnswer, join_names
from planar.foundation.geometry import Frame
from planar.foundation.safe_files import save_file
from planar.foundation.time_limit import stops_in_time
from planar.foundation.units import parse_unit
from planar.manufacture.cam_plates import CamDrive, cam_drives, face_reach
from planar.manufacture.clearances import places_over
from planar.manufacture.cut_units import CutUnit, cut_unit
from planar.manufacture.layers import find_layers
from planar.manufacture.nesting import nested
from planar.manufacture.plate_making import Pin, Sizes, Travel, make_plates
from planar.manufacture.plates import Plate
from planar.manufacture.stacking import Spacer, find_spacers, joined_plates, layer_rules
from planar.model.mechanism import Mechanism, curved_slots, named_points
from planar.model.pairs.cams.profiled import ProfiledPair
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import rest_position

PIN_SHARE = 0.1
"""Of the middle one of the distances between pins, of which the pins' diameter is to be about so much."""
SCALES = (1.0, 2.0, 2.5, 5.0, 10.0, 20.0, 25.0, 50.0, 100.0, 200.0, 500.0, 1000.0)
"""By which a mechanism is made smaller, so that its largest plate fits the sheet."""
FACE_LEVEL = 2
"""Of the run by which the shoes of flat faces are as long as cams touch them."""
TRAVEL_LEVEL = 4
"""Of the run by which slots are as long as their travel: to 2e-6 of a crank."""


@dataclass(frozen=True)
class PartPin:
    """A pin: its diameter and length (m), and the first and last layer that it joins."""

    name: str
    diameter: float
    length: float
    layers: tuple[int, int]


@dataclass(frozen=True)
class PartSpacer:
    """A spacer that fills the gap between two plates on a pin: its inner and outer diameter and its length (m), and its
    first and last layer. The outer diameter is 0 if nothing wider than the pin clears the plates there."""

    pin: str
    inner: float
    outer: float
    length: float
    layers: tuple[int, int]


@dataclass(frozen=True)
class Parts:
    """Plates of the links of a mechanism, in mm where they were drawn, and the same laid out on sheets.

    `is_clear` tells whether no plate meets another in its layer and no pin runs through one, all over the run, between
    positions too; `positions` are the most that this took. What meets, and what else is to know, is in `notes`.
    `thickness`, `sheet` and `scale` are as they were asked for (m; a scale of 0.2 is 1:5). Drawings and lists are in
    `unit`, which is inches for a file in inches.
    """

    mechanism: Mechanism
    plates: tuple[Plate, ...]
    pins: tuple[PartPin, ...]
    spacers: tuple[PartSpacer, ...]
    sheets: tuple[tuple[Plate, ...], ...]
    thickness: float
    sheet: tuple[float, float]
    scale: float
    is_clear: bool
    positions: int
    notes: tuple[str, ...]

    def __repr__(self) -> str:
        layers = len({plate.layer for plate in self.plates})
        many = f"{len(self.plates)} plates in {layers} layers"
        return f"<Parts of {self.mechanism.name!r}: {many}, sheets: {len(self.sheets)}>"

    @property
    def unit(self) -> CutUnit:
        """The unit of length of drawings and lists."""
        return cut_unit(self.mechanism.units)

    @property
    def heading(self) -> str:
        """What is cut, from which plates, at which scale."""
        unit = self.unit
        plates = f"{unit.format(self.thickness)} {unit.name} plates"
        return f"{self.mechanism.name}: {plates} at scale {_scale_text(self.scale)}"

    def encode(self, suffix: str) -> bytes:
        """The sheets side by side, with the list of parts, as a .dxf or .svg file has them; for .step the solids.

        Those are stacked where the mechanism was drawn. Raises BadInput.
        """
        from planar.manufacture.cut_files import Layout, encode_layout

        if suffix.lower() == ".step":
            from planar.manufacture.step_file import encode_step

            return encode_step(self.plates, 1e3 * self.thickness, self.mechanism.name)
        numbers = {plate.name: number for number, plate in enumerate(self.plates, 1)}
        size = (1e3 * self.sheet[0], 1e3 * self.sheet[1])
        return encode_layout(Layout(self.sheets, size, numbers, self.lines(), self.unit), suffix)

    def save(self, file: str | os.PathLike[str]) -> None:
        """Write the sheets to a .dxf or .svg file, or the stacked plates to a .step file. Raises BadInput."""
        path = Path(file)
        save_file(path, self.encode(path.suffix))

    def lines(self) -> list[str]:
        """The list of plates, pins and spacers, a line each."""
        unit = self.unit
        lines = [self.heading]
        for number, plate in enumerate(self.plates, 1):
            teeth = f", {plate.teeth} teeth of module {plate.module:.4g} mm" if plate.teeth else ""
            lines.append(f"{number}  {plate.name}: layer {plate.layer}{teeth}")
        for pin in self.pins:
            size, (low, high) = f"{unit.format(pin.diameter)} x {unit.format(pin.length)} {unit.name}", pin.layers
            lines.append(f"pin {pin.name}: {size}, layers {low} to {high}")
        for spacer in self.spacers:
            size = " x ".join(map(unit.format, (spacer.inner, spacer.outer, spacer.length)))
            low, high = spacer.layers
            where = f"layer {low}" if low == high else f"layers {low} to {high}"
            lines.append(f"spacer on pin {spacer.pin}: {size} {unit.name}, {where}")
        return lines


def _scale_text(scale: float) -> str:
    """A scale as drawings have it: 1:5, 2:1."""
    return f"1:{1.0 / scale:.6g}" if scale <= 1.0 else f"{scale:.6g}:1"


@takes_mechanism
@stops_in_time
def parts(  # many: sizes of what is cut
    mechanism: Mechanism,
    *,
    thickness: float | None = None,
    pin: float | None = None,
    wall: float | None = None,
    play: float | None = None,
    sheet: tuple[float, float] | None = None,
    gap: float | None = None,
    holes: Sequence[str] = (),
    scale: float | None = None,
    steps: int = 90,
    start: float | None = None,
    stop: float | None = None,
    pair: str | None = None,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Parts:
    """The parts of a mechanism: a plate of this `thickness` for each link, gears, pins, spacers, sheets.

    Lengths in m. A plate is what is within `pin` / 2 + `wall` of its pins, holes and slots; holes and slots are wider
    than their pins by `play`; the pins of the file keep its radii. Points at which springs are fastened, and those
    named in `holes`, get holes as wide as those of pins. By default pins are about a tenth of the middle distance
    between pins, walls are as wide as pins, and the scale is the largest that lets each plate fit a `sheet`, `gap`
    apart. By default plates are 3 mm thick and sheets 600 x 400 mm; for a file in inches 1/8 in and 24 x 16 in.

    The run is that of `planar.cycle` from `start` to `stop` of the input at `pair`. Layers are found by the distances
    of all plates and pins at so many steps of it, and at up to 64 times as many where those leave it open whether
    something is met between positions. Raises BadInput for a pair that is none of plates, for a hole at no point, and
    where a plate cannot be; NoAnswer where the mechanism does not run, and after `timeout` s or a Ctrl-C.

    >>> import planar
    >>> planar.parts("four-bar", thickness=0.003)
    <Parts of 'Four-bar chain': 4 plates in 3 layers, sheets: 1>
    """
    for slot in curved_slots(mechanism):
        message = f"it stands for a curved slot of {slot.carrier!r}, and curved slots are not cut"
        raise BadInput(slot.link, f"{message}; leave out its 'curved_slot' to cut a bar in its place")
    unit = cut_unit(mechanism.units)
    thickness = unit.thickness if thickness is None else thickness
    play, gap = unit.play if play is None else play, unit.gap if gap is None else gap
    sheet = unit.sheet if sheet is None else sheet
    for name, value in {"thickness": thickness, "pin": pin, "wall": wall, "gap": gap, "scale": scale}.items():
        if value is not None and not 0.0 < value < 1e4:
            raise BadInput(name, f"a size above zero is wanted, not {value!r:.40}")
    drawn = rest_position(mechanism).frames
    linkage = _joined_linkage(mechanism, drawn)
    if pair is None and len(mechanism.inputs) > 1:
        pair = mechanism.inputs[0].pair
    run = _Run(_Course(mechanism, steps, start, stop, pair), drawn, linkage)
    drilled = tuple(_drilled_points(mechanism, drawn, holes))
    sizes = _Request(thickness, pin, wall, play, sheet, gap, steps, drilled)
    for made in SCALES if scale is None else (1.0 / scale,):
        found = _parts_at(mechanism, run, sizes, 1.0 / made)
        if found is not None:
            return found
    told = (
        "at no scale down to 1:1000 do its plates fit the sheet" if scale is None else "its plates do not fit the sheet"
    )
    size = " x ".join(map(unit.format, sheet))
    raise BadInput("sheet", f"{told} of {size} {unit.name}; choose a larger one or a smaller scale")


def _joined_linkage(mechanism: Mechanism, drawn: Mapping[str, Frame]) -> DrawnLinkage:
    """The linkage where its links were drawn, without links that no joint holds. Raises BadInput."""
    try:
        linkage = slots_for_blocks(drawn_mechanism(mechanism, drawn, "plates", (ProfiledPair,)))
    except BadInput as problem:
        message = problem.sentence.replace("cannot be said in this format", "cannot be cut as plates that lie flat")
        raise BadInput(problem.place, message) from None
    joined = {link for joint in linkage.joints for link in joined_links(joint)}
    return replace(linkage, links=tuple(link for link in linkage.links if link in joined))


class _Course(NamedTuple):
    """What runs, from where to where."""

    mechanism: Mechanism
    steps: int
    start: float | None
    stop: float | None
    pair: str | None

    def run(self, times: int = 1) -> Motion:
        """The motion, with so many times as many steps. Raises NoAnswer."""
        motion = cycle(self.mechanism, self.steps * times, self.start, self.stop, self.pair)
        if len(motion) < 2:
            raise NoAnswer(motion.outcome, motion.reason)
        return motion


@dataclass(frozen=True)
class _Request:
    thickness: float
    pin: float | None
    wall: float | None
    play: float
    sheet: tuple[float, float]
    gap: float
    steps: int
    drilled: tuple[Tracer, ...]


def _drilled_points(mechanism: Mechanism, drawn: Mapping[str, Frame], holes: Sequence[str]) -> Iterator[Tracer]:
    """The points of links that get holes, in metres where they were drawn: anchors of springs, and those named.

    Raises BadInput for a name that is no point.
    """
    points = {point.name: point.members for point in named_points(mechanism)}
    members = {f"{link}.{point}": ((link, point),) for each in points.values() for link, point in each}
    anchors = [end for spring in mechanism.springs if not spring.is_torsional for end in spring.ends]
    shapes = shapes_of_links(mechanism)
    for name in dict.fromkeys((*anchors, *holes)):
        known = points.get(name) or members.get(name)
        if known is None:
            raise BadInput("holes", f"there is no point {name!r}; points are {join_names(points)}")
        for link, point in known:
            place = drawn[link].to_world(shapes[link].position(point))
            yield Tracer(name, link, (float(place.x), float(place.y)))


class _Run:
    """A run, the same with more steps, and the linkage where it was drawn."""

    def __init__(self, course: _Course, drawn: Mapping[str, Frame], linkage: DrawnLinkage) -> None:
        self.course, self.drawn, self.linkage = course, drawn, linkage
        self.motions = [course.run()]

    @property
    def motion(self) -> Motion:
        return self.motions[0]

    @property
    def most_positions(self) -> int:
        """Of the run with the most steps that was looked at."""
        return len(self.motions[-1])

    def places(self, link: str, points: tuple[tuple[float, float], ...], scale: float, level: int = 0) -> np.ndarray:
        """Points of a link over the run with 2^level times as many steps, as `places_over` gives them."""
        while len(self.motions) <= level:
            self.motions.append(self.course.run(2 ** len(self.motions)))
        motion = self.motions[level]
        return places_over(points, self.drawn[link], motion.frames[link], 1e-3 / scale, len(motion))

    def travels(self, linkage: DrawnLinkage, scale: float) -> dict[str, Travel]:
        """How far each slide goes in its guide, and each pinion along its rack, from where it was drawn."""
        found = {}
        for joint in linkage.joints:
            if isinstance(joint, SlideJoint | SlotJoint | RackJoint):
                guide, rider = joined_links(joint)
                way = cos(radians(joint.angle)), sin(radians(joint.angle))
                ahead = (joint.at[0] + way[0], joint.at[1] + way[1])
                own = self.places(rider, (joint.at,), scale, TRAVEL_LEVEL)
                held = self.places(guide, (joint.at, ahead), scale, TRAVEL_LEVEL)
                ways = held[:, 1] - held[:, 0]
                along = np.einsum("ij,ij->i", own[:, 0] - held[:, 0], ways)
                found[joint.name] = Travel(float(along.min()), float(along.max()))
        return found

    def faces(self, drives: Sequence[CamDrive], scale: float) -> dict[str, Travel]:
        """How far along their flat faces cams touch followers."""
        found = {}
        for drive in drives:
            if drive.normal is not None:
                ahead = (drive.at[0] + drive.normal[0], drive.at[1] + drive.normal[1])
                face = self.places(drive.follower, (drive.at, ahead), scale, FACE_LEVEL)
                profiles = self.places(drive.cam, drive.profile, scale, FACE_LEVEL)
                found[drive.name] = Travel(*face_reach(profiles, face[:, 0], face[:, 1] - face[:, 0]))
        return found


def _parts_at(mechanism: Mechanism, run: _Run, request: _Request, scale: float) -> Parts | None:
    """The parts at a scale; None where a plate does not fit the sheet."""
    linkage = _scaled(run.linkage, scale)
    pin = _pin_diameter(linkage, cut_unit(mechanism.units)) if request.pin is None else 1e3 * request.pin
    wall = pin if request.wall is None else 1e3 * request.wall
    sizes = Sizes(pin, _own_pins(mechanism, scale, pin) if request.pin is None else {}, 1e3 * request.play, wall)
    angles = {pair.name: float(getattr(pair, "pressure_angle", radians(20.0))) for pair in mechanism.pairs}
    drives = cam_drives(mechanism, run.drawn, scale)
    travels = run.travels(linkage, scale) | run.faces(drives, scale)
    factor = 1e3 * scale
    drilled = [each._replace(at=(factor * each.at[0], factor * each.at[1])) for each in request.drilled]
    plates, pins, meshing = make_plates(linkage, sizes, travels, angles, drives, drilled)
    try:
        sheets = nested(plates, (1e3 * request.sheet[0], 1e3 * request.sheet[1]), 1e3 * request.gap)
    except BadInput:
        return None

    def places(link: str, points: tuple[tuple[float, float], ...], level: int) -> np.ndarray:
        return run.places(link, points, scale, level)

    layers, meets = find_layers(layer_rules(places, plates, pins, meshing, sizes))
    placed = tuple(plate._replace(layer=layer) for plate, layer in zip(plates, layers, strict=True))
    by_name = {plate.name: plate.layer for plate in placed}
    spacers = find_spacers(places, placed, pins, sizes)
    notes = _notes(plates, meets, run, scale) + _spacer_notes(spacers)
    return Parts(
        mechanism,
        placed,
        tuple(_part_pin(each, placed, sizes, request.thickness) for each in pins),
        tuple(_part_spacer(each, sizes, request.thickness) for each in spacers),
        tuple(tuple(plate._replace(layer=by_name[plate.name]) for plate in sheet) for sheet in sheets),
        request.thickness,
        request.sheet,
        scale,
        not meets,
        run.most_positions,
        notes,
    )


def _own_pins(mechanism: Mechanism, scale: float, usual: float) -> dict[str, float]:
    """The diameters of pins that the file says (mm), of those that are no thicker than suits plates."""
    told = {pair.entry_name(): pair.pin_diameter() for pair in mechanism.pairs}
    sizes = {name: 1e3 * scale * float(diameter) for name, diameter in told.items() if diameter is not None}
    return {name: size for name, size in sizes.items() if size <= 2.0 * usual}


def _scaled(linkage: DrawnLinkage, scale: float) -> DrawnLinkage:
    """The linkage in mm at a scale."""
    factor = scale * float(parse_unit(linkage.length).to_si(1.0)) * 1e3

    def place(at: tuple[float, float]) -> tuple[float, float]:
        return at[0] * factor, at[1] * factor

    joints: list[Joint] = []
    for joint in linkage.joints:
        if isinstance(joint, RackJoint):
            joints.append(joint._replace(at=place(joint.at), radius=joint.radius * factor))
        elif not isinstance(joint, WheelJoint):
            joints.append(joint._replace(at=place(joint.at)))
        elif joint.size_kind == "radii":
            joints.append(joint._replace(sizes=tuple(each * factor for each in joint.sizes)))
        else:
            joints.append(joint)
    tracers = tuple(each._replace(at=place(each.at)) for each in linkage.tracers)
    return replace(linkage, joints=tuple(joints), tracers=tracers, length="mm")


def _pin_diameter(linkage: DrawnLinkage, unit: CutUnit) -> float:
    """About a tenth of the middle distance between pins of a link, of those that rods are sold in."""
    places: dict[str, list[tuple[float, float]]] = {}
    for joint in linkage.joints:
        if not isinstance(joint, WheelJoint | RackJoint):
            for link in joined_links(joint):
                places.setdefault(link, []).append(joint.at)
    apart = sorted(
        float(np.hypot(a[0] - b[0], a[1] - b[1])) for points in places.values() for a, b in combinations(points, 2)
    )
    apart = [each for each in apart if each > 1e-6 * apart[-1]]
    wanted = PIN_SHARE * apart[len(apart) // 2] if apart else 5.0
    return min(unit.pins, key=lambda each: abs(each - wanted))


def _part_pin(pin: Pin, plates: Sequence[Plate], sizes: Sizes, thickness: float) -> PartPin:
    layers = [plates[index].layer for index in joined_plates(pin, plates)] or [0]
    low, high = min(layers), max(layers)
    return PartPin(pin.name, sizes.diameter(pin.name) / 1e3, thickness * (high - low + 1), (low, high))


def _part_spacer(spacer: Spacer, sizes: Sizes, thickness: float) -> PartSpacer:
    low, high = spacer.layers
    inner = sizes.diameter(spacer.pin) + sizes.play
    return PartSpacer(spacer.pin, inner / 1e3, spacer.diameter / 1e3, thickness * (high - low + 1), spacer.layers)


def _spacer_notes(spacers: Sequence[Spacer]) -> tuple[str, ...]:
    """Which pins have no room for a spacer."""
    pins = dict.fromkeys(repr(spacer.pin) for spacer in spacers if not spacer.diameter)
    if not pins:
        return ()
    return (f"no spacer clears the plates on pin {join_names(pins)}; hold the plates apart there by rings on the pin",)


def _notes(plates: Sequence[Plate], meets: Sequence[tuple[str, str | int]], run: _Run, scale: float) -> tuple[str, ...]:
    found = [f"made at {_scale_text(scale)}, so that each plate fits the sheet"] if scale != 1.0 else []
    found += [
        f"holes {one.pin!r} and {other.pin!r} of plate {plate.name!r} run into each other; choose smaller pins"
        for plate in plates
        for one, other in combinations(plate.drilled, 2)
        if np.hypot(one.at[0] - other.at[0], one.at[1] - other.at[1]) <= (one.diameter + other.diameter) / 2.0
    ]
    if meets:
        told = [_meeting(pin, what, plates) for pin, what in meets]
        found.append(f"no order of layers was found that keeps everything clear; in this one {join_names(told)}")
    if any(plate.kind == "disc" for plate in plates):
        found.append("wheels of belts and chains are discs of their pitch radius here; teeth and grooves are bought")
    few = sorted({plate.name for plate in plates if plate.kind == "wheel" and plate.teeth < 17})
    if few:
        found.append(f"teeth of {join_names(few)} are fewer than 17, and would be undercut by a hob")
    if run.motion.outcome.value != "solved":
        found.append(f"clear as far as it runs: {run.motion.reason}")
    return tuple(found)


def _meeting(pin: str, what: str | int, plates: Sequence[Plate]) -> str:
    """That a pin meets a plate, or another pin."""
    if isinstance(what, int):
        return f"pin {pin!r} meets plate {plates[what].name!r}"
    return f"pins {pin!r} and {what!r} meet"
