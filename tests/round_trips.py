"""A mechanism through another program's file and back: whether all its points still go where they went."""

from __future__ import annotations

import json
from dataclasses import replace

import numpy as np

import planar
from planar.document.reader import read_mechanism
from planar.formats.known_formats import file_formats, foreign_text
from planar.foundation.units import parse_unit
from planar.model.mechanism import Drive, Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind
from planar.reports.files.converted import written_text
from planar.results.motion import State
from planar.solving.position import rest_position

UNITLESS = ("pmks", "pyslvs")
"""Formats that name no unit of length: what is read of them is taken as mm."""


def read_text(text: str, title: str = "back") -> Mechanism:
    """The mechanism of another program's text."""
    return read_mechanism(read_document(text, title))


def read_document(text: str, title: str = "back") -> dict:
    """Its planar file."""
    from planar.formats.known_formats import recognised_format

    value = json.loads(text) if text.lstrip().startswith('{"') or text.startswith("{\n") else None
    source = foreign_text(text.encode(), title, value)
    return recognised_format(source).read(source).document


def read_back(mechanism: Mechanism, name: str) -> Mechanism:
    """What is read of the mechanism's text in a format; of linkage_sim's, which holds no inputs, with its inputs."""
    text = written_text(mechanism, name).text
    assert file_formats()[name].recognise(
        foreign_text(text.encode(), "back", json.loads(text) if text.startswith("{") else None)
    )
    found = read_text(text)
    if name != "linkage_sim":
        return found
    state, known = rest_position(mechanism), {each.name for each in named_points(found)}
    sketch = tuple((n, *map(float, p.position)) for n, p in state.points.items() if n in known)
    motions = relative_motions(found)
    inputs = tuple(  # its links' axes are those of the drawing, so that all angles are 0
        given if motions[given.pair].input_kind is MeasureKind.LENGTH else given._replace(position=0.0)
        for given in mechanism.inputs
    )
    return replace(found, inputs=inputs, sketch=sketch)


def scale_of(mechanism: Mechanism, name: str) -> float:
    """Lengths read back by those written, where the unit is not said."""
    unit = mechanism.units.length if mechanism.units.length in ("mm", "cm", "m", "in") else "mm"
    return parse_unit("mm").to_si(1.0) / parse_unit(unit).to_si(1.0) if name in UNITLESS else 1.0


def moved(mechanism: Mechanism, by: float) -> State | None:
    """The position with the first input moved; None where it cannot."""
    given = mechanism.inputs[0]
    try:
        return rest_position(mechanism, [Drive(given.pair, given.position + by)])
    except planar.NoAnswer:
        return None


def places(state: State) -> np.ndarray:
    """All points that are not of the frame (n, 2)."""
    frame = {name for each in named_points(state.mechanism) for name in [each.name] if on_frame(state, each)}
    return np.array([point.position for name, point in state.points.items() if name not in frame])


def on_frame(state: State, point: object) -> bool:
    return any(link == state.mechanism.frame for link, _ in point.members)


def worst_deviation(mechanism: Mechanism, name: str, steps: tuple[float, ...] = (0.01, -0.02)) -> float:
    """How far points are off, by the mechanism's size: where it stands, and with the input moved by parts of a turn."""
    back, scale = read_back(mechanism, name), scale_of(mechanism, name)
    before, after = places(rest_position(mechanism)), places(rest_position(back)) / scale
    size = max(np.ptp(before, axis=0).max(), np.abs(before).max(), 1e-9)
    apart = np.linalg.norm(before[:, None] - after[None], axis=2)
    found = [apart.min(axis=1).max() / size]
    if not mechanism.inputs:
        return found[0]
    slides = relative_motions(mechanism)[mechanism.inputs[0].pair].input_kind is MeasureKind.LENGTH
    for step in steps:
        by = step * size if slides else 2.0 * np.pi * step
        one, other = moved(mechanism, by), moved(back, by * scale if slides else by)
        if one is None or other is None:
            assert one is None and other is None, f"{mechanism.name}: {name}: moves one way only"
            continue
        # points that lay on one another may have parted: any of those will do
        near = apart <= apart.min(axis=1)[:, None] + 1e-9 * size
        off = np.linalg.norm(places(one)[:, None] - places(other)[None] / scale, axis=2)
        found.append(np.where(near, off, np.inf).min(axis=1).max() / size)
    return max(found)
