"""All that a designer asks of one pair, link or point of a motion, and why what is not there is not."""

from __future__ import annotations

from dataclasses import dataclass

from planar.analysis.interpolated_run import Steady
from planar.analysis.motion.coupler_area import Area, area
from planar.analysis.motion.dwells import Dwell, stretches
from planar.analysis.motion.extremes import Extremes, Stroke, Swing, ends, fastest, spread
from planar.analysis.motion.mechanical_advantage_over_motion import AdvantageOver, over
from planar.analysis.motion.output import Axis, Extreme, Output
from planar.analysis.motion.time_ratio import TimeRatio, passages
from planar.analysis.motion.transmission_angle import Transmission, transmission
from planar.foundation.errors import BadInput
from planar.model.mechanism import motions
from planar.results.motion import Motion, Unknown

AXES: tuple[Axis, ...] = ("x", "y")


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


def answers(motion: Motion, name: str) -> tuple[Answers, ...]:
    """What there is to tell of a name over a motion: of the pair, the link and the point that bear it.

    Raises Unknown where there is nothing of that name.
    """
    steady, found = Steady(motion), []
    if name in motions(motion.mechanism):
        found.append(_of_output(motion, steady, name, "pair"))
    if name in motion.frames and name not in motions(motion.mechanism):
        found.append(_of_output(motion, steady, name, "link"))
    if name in motion._point_names:
        found.append(_of_point(motion, steady, name))
    if not found:
        raise Unknown(
            f"there is no pair, link or point {name!r}; pairs are {', '.join(motions(motion.mechanism))}, "
            f"links {', '.join(motion.frames)}, points {', '.join(motion.point_names)}"
        )
    return tuple(found)


def _of_output(motion: Motion, steady: Steady, name: str, what: str) -> Answers:
    output = Output(steady, name)
    found, slides = output.ends(), output.kind == "length"
    driven, why = _transmitted(motion, steady, name)
    return Answers(
        of=name,
        what=what,
        input=steady.pair,
        rate=steady.rate,
        per_unit=_per_unit(motion, steady),
        length=slides,
        stroke=ends(steady, name) if slides else None,
        swing=Swing(name, *found, found[1].value - found[0].value) if found and not slides else None,
        velocity=fastest(steady, output) if output.moves else None,
        acceleration=fastest(steady, output, "acceleration") if output.moves else None,
        time_ratio=passages(output),
        dwells=tuple((None, each) for each in stretches(output)),
        transmission=driven,
        advantage=over(steady, output) if output.moves and name != steady.pair else None,
        notes=(*_no_ends(output), *why),
    )


def _of_point(motion: Motion, steady: Steady, name: str) -> Answers:
    outputs = [Output(steady, name, axis) for axis in AXES]
    moves, notes = any(each.moves for each in outputs), []
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
        per_unit=_per_unit(motion, steady),
        length=True,
        extremes=tuple(spread(each) for each in outputs),
        velocity=fastest(steady, name) if moves else None,
        acceleration=fastest(steady, name, "acceleration") if moves else None,
        dwells=tuple((each.axis, dwell) for each in outputs for dwell in stretches(each)),
        area=within,
        advantage=over(steady, name) if moves else None,
        notes=tuple(notes) if moves else ("it does not move",),
    )


def _no_ends(output: Output) -> tuple[str, ...]:
    """Why an output has no stroke or swing, if it has none."""
    if not output.moves:
        return ("it does not turn" if output.kind == "angle" else "it does not move",)
    if output.ends() is not None:
        return ()
    if output.gain:
        return ("it turns right round, so that it has no ends",)
    return ("where it is least or greatest in the range of the input it does not turn back, so that it has no ends",)


def _transmitted(motion: Motion, steady: Steady, name: str) -> tuple[Transmission | None, tuple[str, ...]]:
    """The transmission angle, or why there is none of a link joined to the frame."""
    mechanism, named = motion.mechanism, motions(motion.mechanism)
    joined = named[name].links if name in named else (mechanism.frame, name)
    if mechanism.frame not in joined or name in (mechanism.frame, steady.pair):
        return None, ()
    try:
        return transmission(motion, name), ()
    except BadInput as problem:
        return None, (f"no transmission angle: {problem.sentence}",)


def _per_unit(motion: Motion, steady: Steady) -> bool:
    return not any(given.pair == steady.pair and given.velocity for given in motion.mechanism.inputs)
