"""A cam as textbooks draw it: its profile found by inversion, and the displacement diagram with the same stations."""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, degrees, hypot, pi

import numpy as np

from planar.analysis.cams.cam_profile import CamProfile
from planar.drawing.diagrams import axes
from planar.drawing.paper.picture import Circle, Label, Mark, Pen, Picture, Polyline, paper_point
from planar.drawing.paper.scales import Scale, round_scale
from planar.foundation.arrays import Array
from planar.foundation.geometry import Vector, direction
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits
from planar.model.pairs.cams import turn_left

PARTS = 6
"""Of every rise and fall, between its stations."""
MAX_STATIONS = 42
DIAGRAM_WIDTH, DIAGRAM_HEIGHT = 150.0, 45.0
"""mm between the axes."""
NUMBER_SIZE = 7.0
"""points"""
BEYOND, ARROW_ANGLE = 6.0, 0.6
"""mm by which lines of stations go beyond the profile; rad of the arrow that shows how the cam turns."""
CENTRE_MARK = 0.7
"""mm: the radius of the mark at centres."""


def cam_pictures(found: CamProfile, units: FileUnits, scale: Scale | None = None) -> list[Picture]:
    """The construction of the profile by inversion, and the displacement diagram.

    Strokes are `about` "profile", "pitch curve", "base circle", "prime circle", "station 3", "roller 3", "face 3",
    "arm 3", and "lift" in the diagram.
    """
    return [_construction(found, units, scale), _displacement_diagram(found, units)]


def station_angles(found: CamProfile) -> Array:
    """The angles of the law (rad) at which the follower is drawn: six parts of every rise and fall, fewer of very many,
    dwells whole."""
    pieces = found.cam.lift_pieces(found.shapes)
    parts = max(1, min(PARTS, MAX_STATIONS // max(1, sum(each.moves for each in pieces))))
    return np.concatenate(
        [np.linspace(each.start, each.stop, (parts if each.moves else 1) + 1)[:-1] for each in pieces]
    )


def _construction(found: CamProfile, units: FileUnits, scale: Scale | None) -> Picture:
    """The cam held, the follower taken round it the other way."""
    turned = direction(found.cam.start)

    def drawn(points: Array) -> Array:
        x, y = Vector(points[:, 0], points[:, 1]).rotate(turned)
        return np.stack([x, y], axis=1)

    profile, pitch = drawn(found.profile), drawn(found.pitch_curve)
    sizes = np.ptp(np.concatenate([profile, pitch]), axis=0) + 2.0 * found.roller_radius
    used = scale or round_scale("length", units.length, float(sizes[0]), float(sizes[1]))
    mm = 1.0 / used.per_mm
    base, roller = found.base_radius, found.roller_radius
    marks: list[Mark] = [Circle((0.0, 0.0), base * mm, Pen.CONSTRUCTION, "base circle")]
    if roller:
        marks.append(Circle((0.0, 0.0), (base + roller) * mm, Pen.CONSTRUCTION, "prime circle"))
    outside = float(np.hypot(*pitch.T).max()) + roller + BEYOND / mm
    for number, angle in enumerate(station_angles(found)):
        marks += _station(found, number, float(angle), outside, mm)
    if roller:
        marks += _closed(pitch * mm, Pen.PITCH, "pitch curve")
    marks += _closed(profile * mm, Pen.LINK, "profile")
    marks += [Circle((0.0, 0.0), CENTRE_MARK, Pen.PIN, "centre"), Label("O", (0.0, 0.0), "centre", clearance=1.0)]
    marks += _sense_arrow(found.cam.sense, 0.45 * base * mm)
    named = f"base circle of radius {_told(base, units)}"
    notes = [str(used), f"{named}, roller of radius {_told(roller, units)}" if roller else named]
    most = found.greatest_pressure_angle
    notes.append(
        f"greatest pressure angle {degrees(most.value):.4g} deg at {degrees(most.input) % 360.0:.4g} deg of the law"
    )
    if found.problem():
        notes.append(found.problem())
    return Picture(tuple(marks), f"Profile of {found.pair} by inversion", tuple(notes))


def _station(found: CamProfile, number: int, angle: float, outside: float, mm: float) -> Iterator[Mark]:
    """The follower at one angle of the law, taken round against the cam."""
    at = found.contact_at(np.array([angle]))
    back = direction(-found.cam.sense * angle)

    def placed(vector: Vector) -> Vector:
        x, y = (float(np.ravel(part)[0]) for part in np.broadcast_arrays(vector.x, vector.y))
        return Vector(x, y).rotate(back)

    middle = placed(at.middle)
    followed = found.cam.follower_axes(found.shapes)
    if followed.line is not None:
        line = placed(followed.line)
        foot = middle - line * middle.dot(line)
        end = foot + line * outside
        yield Polyline(_points([foot, end], mm), Pen.CONSTRUCTION, f"station {number}")
    else:
        end = placed(followed.origin - followed.centre)
        yield Polyline(_points([end, middle], mm), Pen.POSITION, f"arm {number}")
        yield Circle(paper_point(end * mm), CENTRE_MARK, Pen.POSITION, f"station {number}")
    yield Label(str(number), paper_point(end * mm), f"station {number}", NUMBER_SIZE, 1.0)
    if found.is_flat:
        normal, touch = placed(at.normal), placed(at.point)
        along = turn_left(normal) * (0.4 * found.base_radius)
        yield Polyline(_points([touch - along, touch + along], mm), Pen.POSITION, f"face {number}")
        if followed.line is None:
            yield Polyline(_points([middle, touch], mm), Pen.POSITION, f"face {number}")
    elif found.roller_radius:
        yield Circle(paper_point(middle * mm), found.roller_radius * mm, Pen.POSITION, f"roller {number}")


def _points(points: list[Vector], mm: float) -> tuple[tuple[float, float], ...]:
    return tuple(paper_point(point * mm) for point in points)


def _closed(points: Array, pen: Pen, about: str) -> Iterator[Polyline]:
    yield Polyline(tuple(map(paper_point, points)), pen, about, closed=True)


def _sense_arrow(sense: float, radius: float) -> Iterator[Mark]:
    """How the cam turns."""
    start, stop = 90.0 - degrees(ARROW_ANGLE), 90.0 + degrees(ARROW_ANGLE)
    yield Circle((0.0, 0.0), radius, Pen.INPUT, "sense", start=start, stop=stop, arrow_end=int(sense))


def _told(length: float, units: FileUnits) -> str:
    return f"{parse_unit(units.length).from_si(length):.6g} {units.length}"


def _displacement_diagram(found: CamProfile, units: FileUnits) -> Picture:
    """The lift over the angle of the law, with the numbered stations of the construction."""
    slides = found.cam.line is not None
    written = units.length if slides else units.angle
    lift = found.lift[0] * parse_unit(written).from_si(1.0)
    first = float(found.angle[0])
    turned = np.degrees(found.angle - first)
    across = axes.fit_axis(np.array([0.0, 360.0]), DIAGRAM_WIDTH, "angle of the law (deg)", degrees=True)
    up = axes.fit_axis(np.append(lift, 0.0), DIAGRAM_HEIGHT, f"{'s' if slides else 'φ'} ({written})", 8.0)
    marks: list[Mark] = [*axes.axes_frame(across, up)]
    stations = station_angles(found) - first
    heights = np.interp(stations, found.angle - first, lift)
    # of stations that lie close every second, third, ... bears its number
    least = float(np.diff(np.append(stations, 2.0 * pi)).min())
    every = ceil(3.2 / max(float(across.on_paper(degrees(least))), 0.1))
    rises = np.sign(np.round(np.interp(stations, found.angle - first, np.gradient(lift, turned)), 9))
    rises[0] = -1.0  # clear of the axis
    for number, (angle, height) in enumerate(zip(stations, heights, strict=True)):
        foot = axes.point_on_paper(degrees(float(angle)), 0.0, across, up)
        top = axes.point_on_paper(degrees(float(angle)), float(height), across, up)
        if hypot(top[0] - foot[0], top[1] - foot[1]) > 0.0:
            marks.append(Polyline((foot, top), Pen.CONSTRUCTION, f"station {number}"))
        if number % every == 0:
            marks.append(Label(str(number), top, f"station {number}", NUMBER_SIZE, 0.8, side=(-int(rises[number]), 1)))
    marks += axes.curve_strokes(turned, lift, across, up, Pen.CURVE, "lift")
    notes = [f"greatest lift {lift.max():.6g} {written}"]
    if first:
        notes.append(f"from where the cam stands at {degrees(first):.6g} deg")
    return Picture(tuple(marks), "Displacement diagram", tuple(notes))
