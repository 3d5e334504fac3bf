"""Space diagram, velocity polygon and acceleration polygon beside one another, each to a scale of its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.drawing.paper import scales as paper
from planar.drawing.paper.picture import Picture, extent
from planar.drawing.polygons.polygon import polygon_picture
from planar.drawing.scheme.scene import plain_frames
from planar.drawing.scheme.scheme import scheme as scheme_picture
from planar.drawing.scheme.scheme import space_scale
from planar.model.file_units import unit_of_kind
from planar.model.mechanism import unit_rate_note
from planar.results.motion import State
from planar.solving.position import state_at_unit_rate

ScaleTexts = str | Sequence[str] | None
"""Scales as a reader writes them, each for what its unit measures: "1 cm = 100 mm", "1:5", "1 cm = 0.1 m/s"."""
PANEL_SIZE = (80.0, 80.0)
"""mm on paper for each of several drawings in a row of a sheet of A4."""


def polygon_panels(state: State, scales: ScaleTexts, count: int) -> list[Picture]:
    """Space diagram, velocity polygon and acceleration polygon, the first of them, each small enough for a row.

    Where no input has a rate, the polygons are those of the first input's unit rate, and the velocity polygon says so.
    """
    original, state = state, state_at_unit_rate(state)
    given = paper.parse_scales(scales, ("length", "velocity", "acceleration")[:count], state.mechanism.units)
    space = given.get("length")
    if space is None:
        whole = space_scale(state.mechanism, plain_frames(state.frames), state.shapes)
        width, height = _picture_size(scheme_picture(state, whole))
        space = paper.round_scale("length", whole.unit, width * whole.per_mm, height * whole.per_mm, PANEL_SIZE)
    pictures = [scheme_picture(state, space)._replace(title="Space diagram", notes=_scale_notes(space))]
    for polygon in (velocity_polygon(state), acceleration_polygon(state))[: count - 1]:
        width, height = map(float, np.ptp(np.array([(0.0, 0.0), *polygon.letters.values()]), axis=0))
        unit = unit_of_kind(polygon.kind, state.mechanism.units)[0]
        fits = given.get(polygon.kind) or paper.round_scale(polygon.kind, unit, width, height, PANEL_SIZE)
        drawn = polygon_picture(polygon, fits)
        rest = tuple(note for note in drawn.notes[1:] if note not in _scale_notes(fits))
        if state is not original and polygon.kind == "velocity":
            rest += (unit_rate_note(state.mechanism, state.mechanism.inputs[0].pair),)
        title = f"{polygon.kind} polygon".capitalize()
        pictures.append(drawn._replace(title=title, notes=(*_scale_notes(fits), *rest)))
    return pictures


def _scale_notes(scale: paper.Scale) -> tuple[str, str]:
    return str(scale), scale.calculating_scale


def _picture_size(picture: Picture) -> tuple[float, float]:
    low, high = extent(picture.marks)
    return high[0] - low[0], high[1] - low[1]
