"""Cams as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from math import degrees
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.cams.base_circle import BaseCircle
from planar.analysis.cams.cam_profile import CamProfile
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits
from planar.model.mechanism import Mechanism
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import format_number, format_or_zero, paragraphs


def cam_tables(mechanism: Mechanism, found: CamProfile, least: BaseCircle) -> RenderableType:
    """A cam's facts, and its pieces of law with their greatest rates."""
    head = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        head.append(Text(mechanism.source, style="italic"))
    cam, follower = found.cam.links
    head.append(Text(f"{found.pair}: {cam} lifts {follower}, both on {found.cam.carrier}"))
    return Group(*head, paragraphs(_facts(found, least, mechanism.units)), Text(), _law_table(found, mechanism.units))


def _length(value: float, units: FileUnits) -> str:
    return f"{format_number(parse_unit(units.length).from_si(value))} {units.length}"


def _angle(value: float) -> str:
    return f"{degrees(value) % 360.0:.6g}"


def _facts(found: CamProfile, least: BaseCircle, units: FileUnits) -> Iterator[tuple[str, str]]:
    face = "a flat face" if found.is_flat else "a point"
    if found.roller_radius:
        face = f"a roller of radius {_length(found.roller_radius, units)}"
    guided = "slides" if found.cam.line is not None else "swings"
    yield "follower", f"{guided}, with {face}"
    yield "base circle", f"radius {_length(found.base_radius, units)}"
    most = found.greatest_pressure_angle
    yield (
        "pressure angle",
        f"{degrees(most.value):.6g} deg at most, at {_angle(most.input)} deg of the law",
    )
    radius = found.least_curvature_radius
    told = "nowhere convex" if np.isinf(radius.value) else _length(radius.value, units)
    yield "least radius of curvature", f"{told}, at {_angle(radius.input)} deg of the law"
    if found.face_reach is not None:
        low, high = (_length(value, units) for value in found.face_reach)
        yield "contact on the face", f"from {low} to {high}, to the left of its normal from the follower's point"
    yield "can it be made", found.problem() or "yes: nothing of the profile is undercut or cut off"
    if found.cam.has_given_profile:
        return
    wanted = f"{degrees(least.pressure_angle):.6g} deg"
    for about, value in (
        (f"least base circle for {wanted}", least.pressure),
        ("least base circle without undercutting", least.curvature),
    ):
        yield about, "none that the follower reaches" if value is None else _length(value, units) if value else "any"


def _law_table(found: CamProfile, units: FileUnits) -> FittedTable:
    slides = found.cam.line is not None
    unit = units.length if slides else units.angle
    per = parse_unit(unit).from_si(1.0)
    title = "Law of lift, and the greatest rates by the cam's angle"
    heads = ("motion", ("from, deg", "to, deg"), (f"by, {unit}", "s'", "s''", "s'''"))
    table = plain_table(title, *heads, left=(0,), keys=1)
    pieces = found.cam.lift_pieces(found.shapes)
    greatest = np.abs(found.lift).max(axis=1) * per
    for piece, lift in zip(pieces, np.split(found.lift, len(pieces), axis=1), strict=True):
        rates = [
            format_or_zero(float(np.abs(rate).max()) * per, scale)
            for rate, scale in zip(lift[1:], greatest[1:], strict=True)
        ]
        way = format_or_zero(float(lift[0, -1] - lift[0, 0]) * per, greatest[0])
        table.add_row(piece.name, format_number(degrees(piece.start)), format_number(degrees(piece.stop)), way, *rates)
    return table


def record(found: CamProfile, least: BaseCircle) -> dict[str, Any]:
    """The same as a JSON value, in SI: with the profile, the pitch curve and what is told at each of its samples."""

    def values(array: np.ndarray) -> list[Any]:
        nested: list[Any] = np.where(np.isfinite(array), array, np.nan).tolist()
        return [None if each != each else each for each in nested] if array.ndim == 1 else nested  # noqa: PLR0124

    radius = found.least_curvature_radius
    return {
        "mechanism": found.mechanism,
        "pair": found.pair,
        "base_radius": found.base_radius,
        "roller_radius": found.roller_radius,
        "flat": found.is_flat,
        "greatest_pressure_angle": found.greatest_pressure_angle._asdict(),
        "least_curvature_radius": radius._asdict() | ({} if np.isfinite(radius.value) else {"value": None}),
        "undercut": [list(span) for span in found.undercut],
        "problem": found.problem(),
        "face_reach": found.face_reach and list(found.face_reach),
        "least_base_circle": least._asdict(),
        "angle": values(found.angle),
        "lift": [values(rate) for rate in found.lift],
        "profile": values(found.profile),
        "pitch_curve": values(found.pitch_curve),
        "pressure_angle": values(found.pressure_angle),
        "curvature_radius": values(found.curvature_radius),
    }
