"""What kinematic diagrams show, as numbers: displacement, velocity and acceleration over time, and chords of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams.axes import FLAT_TOLERANCE
from planar.drawing.diagrams.drawn_run import DrawnRun, frame_slides
from planar.drawing.scheme.link_bodies import largest_span as size_of
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.model.link_graph import link_numbers
from planar.model.mechanism import Mechanism, named_points, relative_motions
from planar.model.pairs import MeasureKind

ZERO_TOLERANCE = FLAT_TOLERANCE
"""A curve below this part of the mechanism's size, or of that times the input's rate, is round-off: beside a change
point accelerations have errors a thousand times those of other positions."""


class MotionCurve(NamedTuple):
    """A displacement (m or rad) with its first and second rate, each (n,) in time; `name` is x, y or ""."""

    name: str
    value: Array
    rate: Array
    second: Array
    from_top: bool = False
    "whether the displacement is measured from the top dead centre of a slide"
    subject: str = ""
    "the slide, point or link of the curve, where a diagram has curves of several"

    @property
    def label(self) -> str:
        """The name of the curve in a legend."""
        return " ".join(filter(None, (self.subject, self.name)))

    @property
    def derivatives(self) -> tuple[Array, Array, Array]:
        """Displacement, velocity, acceleration."""
        return self.value, self.rate, self.second


class DiagramSubject(NamedTuple):
    """What is drawn: its name in a title, whether it is an angle, and its curves.

    `slide` is the pair whose displacement it is, if it is one.
    """

    title: str
    is_angle: bool
    curves: tuple[MotionCurve, ...]
    slide: str | None = None


def merge_subjects(names: Sequence[str], subjects: Sequence[DiagramSubject]) -> list[DiagramSubject]:
    """One subject for the lengths and one for the angles among several, every curve labelled by its name."""
    if len(subjects) == 1:
        return list(subjects)
    merged = []
    for is_angle in (False, True):
        alike = [(name, subject) for name, subject in zip(names, subjects, strict=True) if subject.is_angle is is_angle]
        if alike:
            curves = tuple(curve._replace(subject=name) for name, subject in alike for curve in subject.curves)
            slide = next((subject.slide for _, subject in alike if subject.slide), None)
            merged.append(DiagramSubject(", ".join(subject.title for _, subject in alike), is_angle, curves, slide))
    return merged


class ChordRates(NamedTuple):
    """Mean rates over equal intervals, each (count,), and the times of the intervals' middles."""

    times: Array
    rates: Array


class Peak(NamedTuple):
    """The greatest magnitude of a curve, and when it is."""

    time: float
    value: float


def default_subject(mechanism: Mechanism) -> str:
    """The first undriven slide on the frame; without one the link on a pin of the frame that is farthest along."""
    slides = frame_slides(mechanism)
    if slides:
        return slides[0].name
    order = {link: int(number) for link, number in link_numbers(mechanism).items() if link != mechanism.frame}
    named = relative_motions(mechanism)
    driving = {link for given in mechanism.inputs for link in named[given.pair].links}
    pinned = {
        link
        for pair in mechanism.pairs
        if pair.is_lower_pair and pair.input_kind is MeasureKind.ANGLE and mechanism.frame in pair.links
        for link in pair.links
        if link != mechanism.frame
    }
    for among in (pinned - driving, set(order) - driving, set(order)):
        if among:
            return max(among, key=order.__getitem__)
    raise BadInput("of", "the mechanism has no moving link, so there is nothing to draw")


def find_slide(mechanism: Mechanism, of: str) -> str | None:
    """The slide that a name means: the pair itself, or the one on the frame that carries the point of this name."""
    named = relative_motions(mechanism)
    if of in named and named[of].input_kind is MeasureKind.LENGTH:
        return of
    riders = {
        rides[0]: pair.name
        for pair in mechanism.pairs
        if (rides := pair.point_on_line()) and rides[1] == mechanism.frame
    }
    for point in named_points(mechanism):
        if of in (point.name, *(f"{link}.{own}" for link, own in point.members)):
            return next((riders[member] for member in point.members if member in riders), None)
    return None


def diagram_subject(run: DrawnRun, of: str) -> DiagramSubject:
    """The curves of a pair that slides, a point, a link, or a pair that turns. Raises BadInput for an unknown name.

    What is nothing but round-off is nothing in them.
    """
    found = _raw_subject(run, of)
    size = size_of(run.motion.shapes)
    whole, pace = 1.0 if found.is_angle else size, abs(run.rate) / (size if run.is_sliding_input else 1.0)
    least = [ZERO_TOLERANCE * whole * pace**order for order in range(3)]
    curves = []
    for curve in found.curves:
        value, rate, second = (
            _zero_if_still(values, limit) for values, limit in zip(curve.derivatives, least, strict=True)
        )
        curves.append(curve._replace(value=value, rate=rate, second=second))
    return found._replace(curves=tuple(curves))


def _zero_if_still(values: Array, least: float) -> Array:
    """Zero where a curve is never more than the least that counts."""
    return np.where(np.isnan(values), values, 0.0) if np.nanmax(np.abs(values), initial=0.0) <= least else values


def _raw_subject(run: DrawnRun, of: str) -> DiagramSubject:
    motion, order = run.motion, run.time_order
    slide = find_slide(motion.mechanism, of)
    if slide is not None:
        words = f"slide {slide}" if slide == of else f"point {of} of slide {slide}"
        return DiagramSubject(words, False, (_slide_curve(run, slide),), slide)
    points = (*motion.point_names, *(f"{link.name}.{point}" for link in motion.mechanism.links for point in link.names))
    if of in points:
        found = run.point(of)
        parts = (part.T for part in (found.position - found.position[0], found.velocity, found.acceleration))
        curves = (
            MotionCurve(name, value, rate, second)
            for name, (value, rate, second) in zip("xy", zip(*parts, strict=True), strict=True)
        )
        return DiagramSubject(f"point {of}", False, tuple(curves))
    if any(link.name == of for link in motion.mechanism.links):
        value, rate, second = (part[order] for part in motion.link(of))
        return DiagramSubject(f"link {of}", True, (MotionCurve("", value, rate, second),))
    named = relative_motions(motion.mechanism)
    if of in named:
        value, rate, second = _pair_rates(run, of)
        return DiagramSubject(f"pair {of}", True, (MotionCurve("", value, rate, second),))
    raise BadInput(of, f"there is no pair, point or link of this name; {available_names(motion.mechanism)}")


def available_names(mechanism: Mechanism) -> str:
    """What could be drawn, for those who named something else."""
    links = [link.name for link in mechanism.links if link.name != mechanism.frame]
    slides = [name for name, pair in relative_motions(mechanism).items() if pair.input_kind is MeasureKind.LENGTH]
    points = [each.name for each in named_points(mechanism)]
    told = [("slides", slides), ("points", points), ("links", links)]
    return "; ".join(f"{what} are {', '.join(names)}" for what, names in told if names)


def _pair_rates(run: DrawnRun, pair: str) -> Sequence[Array]:
    """Position, velocity and acceleration at a pair in the order of time."""
    values = run.motion.pair(pair)
    return [np.asarray(values[name])[run.time_order] for name in [*run.motion.result_kinds(pair)][:3]]


def _slide_curve(run: DrawnRun, pair: str) -> MotionCurve:
    """A slide from its top dead centre, growing away from it; where it has none from the start of the run."""
    value, rate, second = _pair_rates(run, pair)
    slide_stroke = run.stroke_of(pair)
    if slide_stroke is None:
        return MotionCurve("", value - value[0], rate, second)
    top, bottom = slide_stroke.top.value, slide_stroke.bottom.value
    sign = 1.0 if bottom > top else -1.0
    return MotionCurve("", sign * (value - top), sign * rate, sign * second, from_top=True)


def chord_rates(run: DrawnRun, values: Array, count: int) -> ChordRates:
    """Graphical differentiation: chord slopes over `count` equal intervals, each to be drawn at the interval's middle.

    Machine Elements, 1.3.6 (iii): the motion is taken as steady over each interval.
    """
    time = run.time
    rows = run.equal_divisions(count)
    marks = np.linspace(0.0, time[-1], count + 1)
    at = np.interp(marks, time, values) if rows is None else values[rows]
    return ChordRates((marks[1:] + marks[:-1]) / 2.0, np.diff(at) / np.diff(marks))


def find_peak(time: Array, values: Array) -> Peak | None:
    """The greatest magnitude, between samples by the parabola through the greatest and its neighbours."""
    if not np.isfinite(values).any():
        return None
    size = np.abs(values)
    at = int(np.nanargmax(size))
    here = Peak(float(time[at]), float(size[at]))
    if at in (0, len(values) - 1) or not np.isfinite(size[at - 1 : at + 2]).all():
        return here
    before, middle, after = size[at - 1 : at + 2]
    bend = before - 2.0 * middle + after
    if bend >= 0.0:
        return here
    off = 0.5 * (before - after) / bend
    step = time[at + 1] - time[at]
    return Peak(here.time + off * step, float(middle - 0.25 * (before - after) * off))
