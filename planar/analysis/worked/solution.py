"""A position worked out as a chapter does: what is given and asked, both polygons step by step, the results."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from planar.analysis.polygons.construction import acceleration_polygon, velocity_polygon
from planar.analysis.polygons.polygon import Polygon
from planar.analysis.rich_text import MeasuredValue, Phrase, Symbol, format_number, join_phrases
from planar.analysis.worked.givens import given_data
from planar.analysis.worked.published import Comparison
from planar.analysis.worked.sections import Section, sections
from planar.model.file_units import rate_unit
from planar.model.mechanism import PUBLISHED_QUANTITIES, PublishedValue, relative_motions, unit_rate_note
from planar.model.pairs import MeasureKind
from planar.model.wording import REST_TOLERANCE, direction_sense, sentence, turning_sense
from planar.model.wording import join_all_names as words_listed
from planar.results.motion import State
from planar.solving.position import state_at_unit_rate

POLYGON_QUANTITIES = ("velocity", "acceleration", "angular velocity", "angular acceleration")
"""Kinds of quantity that are read off the polygons."""


class WorkedPolygon(NamedTuple):
    """One polygon, worked out: `kind` is velocity or acceleration."""

    kind: str
    polygon: Polygon
    sections: tuple[Section, ...]


class LinkResult(NamedTuple):
    """How a link turns (rad/s, rad/s^2), anticlockwise positive, with senses in words."""

    link: str
    velocity: float
    velocity_sense: str
    acceleration: float
    acceleration_sense: str


class PointResult(NamedTuple):
    """How a point moves: magnitudes (m/s, m/s^2) with senses in words."""

    point: str
    velocity: float
    velocity_sense: str
    acceleration: float
    acceleration_sense: str


class SlideResult(NamedTuple):
    """How something slides: displacement (m), and its rates along the line (m/s, m/s^2), signed."""

    pair: str
    displacement: float
    velocity: float
    acceleration: float


@dataclass(frozen=True)
class WorkedSolution:
    """A worked solution of one position."""

    state: State
    given: tuple[Phrase, ...]
    asked: tuple[Phrase, ...]
    velocity: WorkedPolygon
    acceleration: WorkedPolygon
    links: tuple[LinkResult, ...]
    points: tuple[PointResult, ...]
    slides: tuple[SlideResult, ...]
    rubbing: tuple[Phrase, ...] = ()
    "the speeds at which pins rub, where their radii are given"
    comparisons: tuple[Comparison, ...] = ()
    "of its published values"

    @property
    def worked_polygons(self) -> tuple[WorkedPolygon, WorkedPolygon]:
        """Velocity, then acceleration."""
        return self.velocity, self.acceleration


def worked_solution(state: State, comparisons: Sequence[Comparison] = ()) -> WorkedSolution:
    """The worked solution of a solved position; `comparisons` lay its published values beside the solved ones.

    Where no input has a rate, the first moves at its unit rate, and the last sentence of `given` says so.
    """
    original, state = state, state_at_unit_rate(state)
    given_phrases = list(given_data(state))
    if state is not original:
        given_phrases.append((sentence(unit_rate_note(state.mechanism, state.mechanism.inputs[0].pair)),))
    velocity, acceleration = (
        WorkedPolygon(each.kind, each, sections(each))
        for each in (velocity_polygon(state), acceleration_polygon(state))
    )
    return WorkedSolution(
        state,
        tuple(given_phrases),
        tuple(asked_phrases(state.mechanism.published)),
        velocity,
        acceleration,
        tuple(_link_results(state)),
        tuple(_point_results(state)),
        tuple(_slide_results(state)),
        tuple(_rubbing_speeds(state)),
        tuple(comparisons),
    )


def asked_phrases(published: Sequence[PublishedValue]) -> Iterator[Phrase]:
    """What the book asks for, else all that there is."""
    found: dict[str, list[str]] = {}
    wanted = [item for item in published if PUBLISHED_QUANTITIES[item.quantity] in POLYGON_QUANTITIES]
    for item in sorted(wanted, key=lambda item: item.relative_to is not None):
        of = item.of + (f" relative to {item.relative_to}" if item.relative_to else "")
        names = found.setdefault(item.quantity, [])
        if of not in names:
            names.append(of)
    if not found:
        yield (
            "The angular velocities and accelerations of all links, the velocities and accelerations of all points.",
        )
        return
    for quantity, names in found.items():
        yield (f"The {quantity} of {words_listed(names)}.",)


def _link_results(state: State) -> Iterator[LinkResult]:
    links = {name: link for name, link in state.links.items() if name != state.mechanism.frame}
    fastest, hardest = state.scales_of_links
    for name, link in links.items():
        both = (link.angular_velocity, fastest), (link.angular_acceleration, hardest)
        (v, vs), (a, as_) = [
            (rate if abs(rate) > REST_TOLERANCE * most else 0.0, turning_sense(rate, most)) for rate, most in both
        ]
        yield LinkResult(name, v, vs, a, as_ if a else "none")


def _point_results(state: State) -> Iterator[PointResult]:
    greatest = state.scales_of_points
    for name, point in state.points.items():
        both = [
            (float(np.hypot(*rate)), direction_sense(rate, most))
            for rate, most in zip((point.velocity, point.acceleration), greatest, strict=True)
        ]
        (v, vs), (a, as_) = [
            (size if size > REST_TOLERANCE * most else 0.0, sense)
            for (size, sense), most in zip(both, greatest, strict=True)
        ]
        yield PointResult(name, v, vs, a, as_ if a else "none")


def _slide_results(state: State) -> Iterator[SlideResult]:
    for name, pair in relative_motions(state.mechanism).items():
        if pair.input_kind is MeasureKind.LENGTH:
            report = state.pair(name)
            at, *rates = (float(value or 0.0) for value in list(report.values())[:3])
            told = (
                rate if abs(rate) > REST_TOLERANCE * most else 0.0
                for rate, most in zip(rates, state.scales_of_points, strict=True)
            )
            yield SlideResult(name, at, *told)


def _rubbing_speeds(state: State) -> Iterator[Phrase]:
    """How fast pins rub: the difference of two angular velocities times the radius."""
    measure, of = rate_unit("velocity", state.mechanism.units)
    by = of.from_si(1.0)
    for name, pair in relative_motions(state.mechanism).items():
        speed = state.pair(name).get("rubbing_speed")
        if speed is None:
            continue
        first, second = (state.link(link).angular_velocity for link in pair.links)
        apart = abs(second - first)
        frame = state.mechanism.frame
        between = [(Symbol("ω", link),) for link in pair.links[::-1] if link != frame]
        radius = speed / apart if apart > 1e-12 * (abs(first) + abs(second)) else 0.0
        told = f" × r = {format_number(apart)} × {format_number(radius * by)} = " if radius else " × r = "
        brackets = ("(", ")") if len(between) > 1 else ("", "")
        yield (
            f"At {name}: {brackets[0]}",
            *join_phrases(between, " − "),
            f"{brackets[1]}{told}",
            MeasuredValue(speed, measure, units_per_si=by),
        )
