"""All that a designer asks of one pair, link or point of a motion, and why what is not there is not."""

from __future__ import annotations

from dataclasses import dataclass

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.coupler_area import Area, area
from planar.analysis.motion.dwells import Dwell, find_dwells
from planar.analysis.motion.extremes import (
    Extremes,
    Stroke,
    Swing,
    find_extremes,
    find_greatest,
    find_stroke,
    find_swing,
)
from planar.analysis.motion.mechanical_advantage_over_motion import AdvantageOver, advantage_over_run
from planar.analysis.motion.output import Axis, Extreme, Output
from planar.analysis.motion.time_ratio import TimeRatio, find_time_ratio
from planar.analysis.motion.transmission_angle import Transmission, transmission
from planar.document.first_argument import takes_result
from planar.foundation.errors import BadInput, Unknown, suggest_name_of_kinds
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import relative_motions
from planar.model.wording import count_phrase
from planar.results.motion import Motion

POINT_AXES: tuple[Axis, ...] = ("x", "y")


@dataclass(frozen=True, eq=False)
class Answers:
    """What is told of a pair, a link or a point (`what`) over the run of an input at a steady `rate` (rad/s or m/s).

    `length` says whether values are lengths (m) or angles (rad). None or empty is what there is not; `notes` say why of
    what one might expect. `per_unit` is true where the file's rate is zero: rates and times are then per rad or m.
    """

    of: str
    what: str
    input: str
    rate: float
    per_unit: bool
    length: bool
    stroke: Stroke | None = None
    swing: Swing | None = None
    extremes: tuple[Extremes, ...] = ()
    velocity: Extreme | None = None
    acceleration: Extreme | None = None
    time_ratio: TimeRatio | None = None
    dwells: tuple[tuple[Axis | None, Dwell], ...] = ()
    area: Area | None = None
    transmission: Transmission | None = None
    advantage: AdvantageOver | None = None
    notes: tuple[str, ...] = ()

    __repr__ = short_repr


@takes_result("Motion")
def answers(motion: Motion, name: str) -> tuple[Answers, ...]:
    """What there is to tell of a name over a motion: of the pair, the link and the point that bear it.

    Raises Unknown where there is nothing of that name.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> len(planar.answers(motion, "A"))
    2
    """
    steady, found = InterpolatedRun(motion), []
    if name in relative_motions(motion.mechanism):
        found.append(_output_answers(motion, steady, name, "pair"))
    if name in motion.frames and name not in relative_motions(motion.mechanism):
        found.append(_output_answers(motion, steady, name, "link"))
    if name in motion._point_names:
        found.append(_point_answers(motion, steady, name))
    if not found:
        known = {"pairs": relative_motions(motion.mechanism), "links": motion.frames, "points": motion.point_names}
        raise Unknown(f"there is no pair, link or point {name!r}{suggest_name_of_kinds(name, known)}")
    return tuple(found)


def _output_answers(motion: Motion, steady: InterpolatedRun, name: str, what: str) -> Answers:
    output = Output(steady, name)
    slides = output.kind == "length"
    driven, why = _transmission_or_reason(motion, steady, name)
    return Answers(
        of=name,
        what=what,
        input=steady.pair,
        rate=steady.rate,
        per_unit=_is_per_unit(motion, steady),
        length=slides,
        stroke=find_stroke(steady, name) if slides else None,
        swing=None if slides else find_swing(output),
        velocity=find_greatest(steady, output) if output.is_moving else None,
        acceleration=find_greatest(steady, output, "acceleration") if output.is_moving else None,
        time_ratio=find_time_ratio(output),
        dwells=tuple((None, each) for each in find_dwells(output)),
        transmission=driven,
        advantage=advantage_over_run(steady, output) if output.is_moving and name != steady.pair else None,
        notes=(*_why_no_range(output), *why),
    )


def _point_answers(motion: Motion, steady: InterpolatedRun, name: str) -> Answers:
    outputs = [Output(steady, name, axis) for axis in POINT_AXES]
    moves, notes = any(each.is_moving for each in outputs), []
    within: Area | None = None
    try:
        within = area(motion, name) if moves else None
    except BadInput as problem:
        notes.append(f"no area: {problem.sentence}")
    return Answers(
        of=name,
        what="point",
        input=steady.pair,
        rate=steady.rate,
        per_unit=_is_per_unit(motion, steady),
        length=True,
        extremes=tuple(find_extremes(output, axis) for output, axis in zip(outputs, POINT_AXES, strict=True)),
        velocity=find_greatest(steady, name) if moves else None,
        acceleration=find_greatest(steady, name, "acceleration") if moves else None,
        dwells=tuple((each.axis, dwell) for each in outputs for dwell in find_dwells(each)),
        area=within,
        advantage=advantage_over_run(steady, name) if moves else None,
        notes=tuple(notes) if moves else ("it does not move",),
    )


def _why_no_range(output: Output) -> tuple[str, ...]:
    """Why an output has no stroke or swing, if it has none."""
    if not output.is_moving:
        return ("it does not turn" if output.kind == "angle" else "it does not move",)
    if output.full_turns:
        turns = count_phrase(abs(output.full_turns), "turn")
        return (f"it rotates fully, {turns} over the range of the input, so that no angle is least or greatest",)
    if output.range_extremes is None:
        return ("where it is least or greatest is not determined: it has no velocity there",)
    return ()


def _transmission_or_reason(
    motion: Motion, steady: InterpolatedRun, name: str
) -> tuple[Transmission | None, tuple[str, ...]]:
    """The transmission angle, or why there is none of a link joined to the frame."""
    mechanism, named = motion.mechanism, relative_motions(motion.mechanism)
    joined = named[name].links if name in named else (mechanism.frame, name)
    if mechanism.frame not in joined or name in (mechanism.frame, steady.pair):
        return None, ()
    try:
        return transmission(motion, name), ()
    except BadInput as problem:
        return None, (f"no transmission angle: {problem.sentence}",)


def _is_per_unit(motion: Motion, steady: InterpolatedRun) -> bool:
    return not any(given.pair == steady.pair and given.velocity for given in motion.mechanism.inputs)
