"""Cognates as text for a terminal, and as JSON values."""

from __future__ import annotations

from itertools import combinations
from math import hypot
from typing import Any

from rich.console import Group, RenderableType
from rich.text import Text

from planar.document.writer import write_mechanism
from planar.model.file_units import display_unit
from planar.model.link_shapes import link_shape
from planar.model.mechanism import Mechanism, named_points
from planar.model.wording import count_phrase
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import column_heading, format_number, paragraphs
from planar.synthesis.cognates.cognates import Cognate, Cognates


def table(found: Cognates) -> RenderableType:
    """The linkages with their fixed pivots, lengths and inputs, and what the inputs mean for the timing."""
    others = count_phrase(len(found) - 1, "other linkage traces", "other linkages trace")
    head = Text(f"{found.mechanism.name}: {others} the path of {found.point}", style="bold")
    rows = plain_table(
        None,
        "no.",
        "fixed pivots",
        column_heading("lengths", "length", found.mechanism.units),
        "driven at",
        "timing",
        left=(1, 2, 3, 4),
        keys=1,
    )
    for number, each in enumerate(found):
        rows.add_row(
            str(number),
            ", ".join(f"{name} {_place(at, each.mechanism)}" for name, at in fixed_pivots(each.mechanism).items()),
            ", ".join(_lengths(each)),
            ", ".join(one.driven for one in each.inputs),
            "kept" if each.is_timed else "another",
        )
    told = [f"{number}: {each.sentence}" for number, each in enumerate(found) if number]
    return Group(head, Text(), rows, Text(), paragraphs((" -", sentence) for sentence in told))


def fixed_pivots(mechanism: Mechanism) -> dict[str, tuple[float, float]]:
    """The places (m) of the pins on the frame, by name."""
    shape = link_shape(next(link for link in mechanism.links if link.name == mechanism.frame))
    found = {}
    for pair in mechanism.pairs:
        for link, point in pair.coincident_points():
            if link == mechanism.frame:
                at = shape.position(point)
                found[pair.entry_name()] = float(at.x), float(at.y)
    return found


def record(found: Cognates) -> dict[str, Any]:
    """The cognates as JSON values, the mechanism itself first; lengths in m."""
    return {
        "mechanism": found.mechanism.name,
        "point": found.point,
        "path": found.path.tolist(),
        "cognates": [cognate_record(each) for each in found],
    }


def cognate_record(cognate: Cognate) -> dict[str, Any]:
    """One of them."""
    return {
        "name": cognate.mechanism.name,
        "point": cognate.point,
        "is_timed": cognate.is_timed,
        "inputs": [each._asdict() for each in cognate.inputs],
        "fixed_pivots": {name: list(at) for name, at in fixed_pivots(cognate.mechanism).items()},
        "mechanism": write_mechanism(cognate.mechanism),
    }


def _place(at: tuple[float, float], mechanism: Mechanism) -> str:
    unit = display_unit("length", mechanism.units)[1]
    return "({}, {})".format(*(format_number(unit.from_si(each)) for each in at))


def _lengths(cognate: Cognate) -> list[str]:
    """The distances between the joints, and the point, of every moving link."""
    mechanism, unit = cognate.mechanism, display_unit("length", cognate.mechanism.units)[1]
    found = []
    for link in mechanism.links:
        if link.name == mechanism.frame:
            continue
        shape = link_shape(link)
        joints = [
            each.name
            for each in named_points(mechanism)
            for owner, _ in each.members
            if owner == link.name and (len(each.members) > 1 or each.name == cognate.point)
        ]
        own = {
            each.name: point for each in named_points(mechanism) for owner, point in each.members if owner == link.name
        }
        for one, other in combinations(joints, 2):
            apart = shape.position(own[one]) - shape.position(own[other])
            found.append(f"{one}-{other} {format_number(unit.from_si(hypot(*apart)))}")
    return found
