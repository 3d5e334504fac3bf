"""The run that a drawing of a whole motion shows: in time as it is, else at a steady speed, from top dead centre on."""

from __future__ import annotations

from contextlib import suppress
from math import ceil, isclose, pi
from typing import NamedTuple

import numpy as np

from planar.analysis.motion.extremes import Stroke, stroke
from planar.drawing.scheme.scene import plain_frames
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, Outcome, PlanarError, Unknown
from planar.foundation.geometry import Frame
from planar.model.mechanism import (
    Drive,
    Input,
    Mechanism,
    replace_inputs,
    running_input_index,
    unit_input_rate,
)
from planar.model.pairs import Pair
from planar.results.motion import Motion
from planar.results.records import PointMotion
from planar.solving.cycle import cycle
from planar.solving.position import solved_mechanism

COARSE_STEPS = 36
"""Steps of a turn, at least, that tell where slides turn back, and whether the mechanism is back after it."""
LIMIT_ROWS = 5
"""Rows beside a limit between which a path is too bent for straight lines."""
MAX_TURNS = 12
"""So many turns of the input are tried for one after which the mechanism is back."""
MIN_CURVE_STEPS = 720
"""Steps, at least, of a run that is drawn as a curve."""


class DrawnRun(NamedTuple):
    """A run of one input at a steady speed, or a motion in time, its rows n in the order of time.

    `rate` is the input's speed (rad/s or m/s), where the file gives none that of a radian or of the unit of length by
    the second: rates are then per radian, or per metre or inch, and `timed` is false. `stroke` is that of the slide
    from whose top the run starts, if it lies within the run.
    """

    motion: Motion
    input: Input
    "the input that runs, as the file has it"
    rate: float
    has_speed: bool
    turns: int
    "how many whole turns the input makes, 0 where it goes from one place to another"
    stroke: Stroke | None

    @property
    def makes_whole_turns(self) -> bool:
        """Whether the input makes whole turns."""
        return self.turns > 0

    @property
    def is_time_run(self) -> bool:
        """Whether it is a motion in time, in which inputs go as they do, to and fro for instance."""
        return self.motion.time is not None

    @property
    def time_order(self) -> slice:
        """The rows in the order of time."""
        if self.is_time_run:
            return slice(None)
        position = self.motion.inputs[self.input.pair].position
        return slice(None, None, -1) if (position[-1] - position[0]) * self.rate < 0.0 else slice(None)

    @property
    def position(self) -> Array:
        """The input's position (n,), rad or m."""
        return self.motion.inputs[self.input.pair].position[self.time_order]

    @property
    def input_travel(self) -> Array:
        """How far the input has gone from the start (n,), rad or m, never negative."""
        return np.abs(self.position - self.position[0])

    @property
    def time(self) -> Array:
        """Time from the start (n,), s; the same as `turned` where the file gives no speed."""
        return self.input_travel / abs(self.rate) if self.motion.time is None else self.motion.time

    @property
    def is_sliding_input(self) -> bool:
        """Whether the input is a length."""
        return self.motion.has_length_motion(self.input.pair)

    @property
    def start_position(self) -> float:
        """Where the input starts (rad or m); of a whole turn as an angle from 0 to a turn."""
        first = float(self.position[0])
        if not self.makes_whole_turns:
            return first
        first %= 2.0 * pi
        return 0.0 if min(first, 2.0 * pi - first) < 1e-9 else first

    def stroke_of(self, slide: str) -> Stroke | None:
        """The stroke of a slide, None in a motion in time and for a slide that is driven or on a moving link."""
        if self.stroke is not None and self.stroke.pair == slide:
            return self.stroke
        if self.is_time_run or slide not in (pair.name for pair in frame_slides(self.motion.mechanism)):
            return None
        return _slide_stroke(self.motion, slide)

    @property
    def starts_at_top(self) -> bool:
        """Whether the run starts in the top dead centre."""
        return self.makes_whole_turns and self.stroke is not None

    def time_at(self, position: float) -> float:
        """The time (s) at which the input first comes to a position."""
        gone = (position - self.position[0]) * np.sign(self.rate)
        if self.makes_whole_turns:
            gone %= 2.0 * pi
            gone = 0.0 if isclose(gone, 2.0 * pi, abs_tol=1e-9) else gone
        return float(gone / abs(self.rate))

    def point(self, name: str) -> PointMotion:
        """A point in the order of time. Raises BadInput for a name that is not there."""
        try:
            return PointMotion(*(part[self.time_order] for part in self.motion.point(name)))
        except Unknown as problem:
            raise BadInput(name, str(problem)) from None

    def path(self, name: str) -> Array:
        """The path of a point (m) through all rows, rounded off beside the ends of a range."""
        found = self.point(name)
        return smooth_path(found.position, found.velocity)

    def frames(self, row: int) -> dict[str, Frame]:
        """The frames of all links, as plain numbers, in a row in the order of time."""
        return plain_frames(self.motion.frames, row if self.time_order.step is None else len(self.motion) - 1 - row)

    @property
    def slide_ranges(self) -> dict[str, tuple[float, float]]:
        """From where to where every slide goes (m), by its pair."""
        found = {}
        for pair in self.motion.mechanism.pairs:
            if pair.point_on_line() is not None:
                went = self.motion.pair(pair.name)[next(iter(pair.result_kinds))]
                if went is not None:
                    found[pair.name] = (float(np.min(went)), float(np.max(went)))
        return found

    @property
    def bounds(self) -> tuple[Array, Array]:
        """The lower left and the upper right corner (m) of what all points run through."""
        rows = np.concatenate([np.asarray(self.motion.point(name).position) for name in self.motion.point_names])
        return rows.min(axis=0), rows.max(axis=0)

    @property
    def is_periodic(self) -> bool:
        """Whether everything is at the end where it was at the start."""
        return _is_closed(self.motion, 0, -1)

    def equal_divisions(self, count: int) -> IntArray | None:
        """The rows (count + 1,) that divide the run into equal parts, None where no rows do so."""
        step, rest = divmod(len(self.motion) - 1, count)
        return None if rest or step == 0 or not _is_even(self.time) else np.arange(count + 1) * step


def frame_slides(mechanism: Mechanism) -> tuple[Pair, ...]:
    """The pairs by which something slides on the frame, but for those that an input drives."""
    driven = {given.pair for given in mechanism.inputs}
    return tuple(
        pair
        for pair in mechanism.pairs
        if pair.point_on_line() is not None and mechanism.frame in pair.links and pair.name not in driven
    )


def steady_run(
    source: Motion | Mechanism,
    slide: str | None = None,
    pair: str | None = None,
    steps: int = MIN_CURVE_STEPS,
    count: int = 12,
) -> DrawnRun:
    """The run of a mechanism, or the same range as a motion's, in at least so many steps, a multiple of `count`.

    Over a whole turn it starts where `slide` (left out: the first on the frame that is not driven) is in its top dead
    centre, else where the motion starts; acceleration of the input is left out. A motion in time stays as it is.
    Raises BadInput and NoAnswer.
    """
    mechanism = source.mechanism if isinstance(source, Motion) else source
    pair = source.running_input if isinstance(source, Motion) else pair or _only_input(mechanism)
    given = next((each for each in mechanism.inputs if each.pair == pair), None)
    if given is None:
        raise BadInput(pair, f"there is no input at {pair!r}; inputs are at {_input_names(mechanism)}")
    rate = given.velocity or unit_input_rate(mechanism, pair)
    if isinstance(source, Motion) and source.time is not None:
        return DrawnRun(source, given, rate, has_speed=True, turns=0, stroke=None)
    timed = given.velocity != 0.0
    driven = replace_inputs(mechanism, (Drive(pair, None, rate, 0.0),))
    steps = count * ceil(steps / count)
    if not isinstance(source, Motion):
        motion = cycle(driven, steps, pair=pair)
    else:
        enough = len(source) > COARSE_STEPS * _whole_turns(source, pair) > 0
        motion = source if enough else _repeat_range(source, driven, pair, steps)
    turns = _whole_turns(motion, pair)
    slides = frame_slides(mechanism)
    slide = slide or (slides[0].name if slides else None)
    top = None if slide is None else _slide_stroke(motion, slide)
    if turns and (isinstance(source, Motion) or top is not None or rate < 0.0):
        start = float(motion.inputs[pair].position[0] if top is None else top.top.input)
        motion = cycle(driven, steps * turns, start, start + (turns if rate > 0.0 else -turns) * 2.0 * pi, pair)
    return DrawnRun(motion, given, rate, timed, turns, top)


def closed_run(run: DrawnRun) -> DrawnRun:
    """The same run over so many turns that it closes, at most `MAX_TURNS`; one turn where it does not, or makes none.

    Gears may bring a mechanism back only after several turns of its input.
    """
    if not run.makes_whole_turns or run.is_periodic:
        return run
    start, way = float(run.position[0]), float(np.sign(run.rate)) * 2.0 * pi
    pair, driven, steps = run.input.pair, run.motion.mechanism, (len(run.motion) - 1) // run.turns
    far = cycle(driven, COARSE_STEPS * MAX_TURNS, start, start + MAX_TURNS * way, pair)
    # it may come to an end before it has turned so often
    ways = range(run.turns + 1, (len(far) - 1) // COARSE_STEPS + 1)
    turns = next((turns for turns in ways if _is_closed(far, 0, turns * COARSE_STEPS)), 0)
    if not turns:
        return run
    return run._replace(motion=cycle(driven, steps * turns, start, start + turns * way, pair), turns=turns)


def _is_closed(motion: Motion, first: int, last: int) -> bool:
    points = [motion.point(name).position for name in motion.point_names]
    size = max((float(np.ptp(each, axis=0).max()) for each in points), default=0.0)
    return all(np.abs(each[first] - each[last]).max() <= 1e-6 * size for each in points)


def smooth_path(position: Array, velocity: Array) -> Array:
    """A path (m) through rows (n, 2), rounded off beside an end at which there is no velocity."""
    if len(position) <= LIMIT_ROWS:
        return position
    start, end = (bool(np.isnan(velocity[row]).any()) for row in (0, -1))
    parts = [position]
    if start:
        parts = [_round_near_limit(position[:LIMIT_ROWS]), parts[0][LIMIT_ROWS:]]
    if end:
        kept = max(len(parts[-1]) - LIMIT_ROWS, 0)
        parts = [*parts[:-1], parts[-1][:kept], _round_near_limit(position[: -LIMIT_ROWS - 1 : -1])[::-1]]
    return np.concatenate(parts)


def _round_near_limit(rows: Array) -> Array:
    """Points of a path from a limit on (n, 2), at even steps of the input, with more between them.

    Beside a limit everything moves as the square root of the input does, so that is what the polynomial through them
    goes by.
    """
    root = np.sqrt(np.arange(len(rows)))
    between = np.linspace(0.0, root[-1], 4 * len(rows) + 1)
    whole = np.empty((len(between), 2))
    for k, place in enumerate(between):
        factors = (place - root)[None] / np.where(np.eye(len(root), dtype=bool), 1.0, root[:, None] - root[None])
        factors[np.eye(len(root), dtype=bool)] = 1.0
        whole[k] = factors.prod(axis=1) @ rows
    return whole


def _only_input(mechanism: Mechanism) -> str:
    """The one input; where there are several, one has to be named. Raises NoAnswer where none can run."""
    if len(mechanism.inputs) != 1:
        solved_mechanism(mechanism).check_motion()
    return mechanism.inputs[running_input_index(mechanism, None)].pair


def _input_names(mechanism: Mechanism) -> str:
    return ", ".join(given.pair for given in mechanism.inputs) or "none"


def _repeat_range(motion: Motion, driven: Mechanism, pair: str, steps: int) -> Motion:
    """The range of a motion once more: what the input has by itself, if it is that; else from the first to the last."""
    rows = motion.inputs[pair].position
    span = abs(rows[-1] - rows[0])
    if len(rows) < 2 or span == 0.0:
        raise BadInput(pair, "the motion does not move, so there is nothing to draw of it")
    with suppress(PlanarError):  # a slide without limits has no range by itself
        own = cycle(driven, steps, pair=pair)
        ends = own.inputs[pair].position[[0, -1]]
        if np.allclose(ends, rows[[0, -1]], rtol=0.0, atol=1e-9 * span):
            return own
    return cycle(driven, steps, float(rows[0]), float(rows[-1]), pair)


def _whole_turns(motion: Motion, pair: str) -> int:
    """How many whole turns the input makes in a motion, 0 where it is a slide or makes others."""
    rows = motion.inputs[pair].position
    turns = abs(rows[-1] - rows[0]) / (2.0 * pi)
    if (
        motion.outcome is not Outcome.SOLVED
        or motion.has_length_motion(pair)
        or not isclose(turns, round(turns), rel_tol=1e-9)
    ):
        return 0
    return round(turns)


def _slide_stroke(motion: Motion, slide: str) -> Stroke | None:
    """The stroke between the dead centres of a slide, if it turns back at both ends."""
    travel = stroke(motion, slide) if motion.has_length_motion(slide) else None
    return travel if travel is not None and all(travel.turning) else None


def _is_even(time: Array) -> bool:
    steps = np.diff(time)
    return bool(np.allclose(steps, steps.mean(), rtol=1e-6))
