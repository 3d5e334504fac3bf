"""A motion over a turn of the crank as its exact harmonics, of any slide, any point and any link."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import pi

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.extremes import Stroke, find_stroke
from planar.analysis.motion.output import Extreme
from planar.document.first_argument import takes_mechanism
from planar.equations.mechanism_numbers import mechanism_size, shapes_of_links
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, Unknown, suggest_name_of_kinds
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import stop_if_over, stops_in_time
from planar.model.mechanism import Drive, Mechanism, relative_motions, replace_inputs
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion
from planar.solving.cycle import cycle
from planar.solving.position import solved_mechanism

MIN_SAMPLES, MAX_SAMPLES = 64, 4096
"""Positions of a turn: doubled from the first until harmonics come to their end, up to the last."""
ROUND_OFF = 16.0 * float(np.finfo(float).eps)
"""Of a position, in sizes of the mechanism or rad: harmonics that are less are noise."""
CLOSED_TOLERANCE = 1e-9
"""What is the same within this part of its greatest is the same."""
COMPARISON_ANGLES = 4096
"""Of a turn, at which a shortened series is held against the whole one."""


@dataclass(frozen=True, eq=False)
class Harmonics:
    """A motion that repeats with every turn: mean + the sum over n = 1, 2, ... of c_n cos(n theta) + s_n sin(n theta).

    theta is the position of the input (rad) from which the mechanism is driven. `cosines` and `sines` (n,) are c_1,
    c_2, ... and s_1, s_2, ... (m, or rad where `kind` is "angle"), until they are round-off. An angle that goes round
    with the crank is told beyond its mean turn: `turns` * theta has to be added. `rest` is the greatest amplitude of
    the last quarter of those that can be told from so many `positions`. `stroke` is that of a slide.
    """

    mechanism: str
    of: str
    axis: str | None
    input: str
    kind: str
    turns: int
    mean: float
    cosines: Array
    sines: Array
    positions: int
    rest: float
    stroke: Stroke | None

    __repr__ = short_repr

    @property
    def amplitudes(self) -> Array:
        """Of c_n cos(n theta) + s_n sin(n theta) = amplitude cos(n theta - phase), (n,)."""
        return np.hypot(self.cosines, self.sines)

    @property
    def phases(self) -> Array:
        """The angles n theta (rad) at which the harmonics are greatest, (n,), between -pi and pi."""
        return np.arctan2(self.sines, self.cosines)

    def since(self, start: float) -> Harmonics:
        """The same series in the angle turned since a position (rad): from the TDC, `since(stroke.top.input)`."""
        n = np.arange(1, len(self.cosines) + 1)
        cos, sin = np.cos(n * start), np.sin(n * start)
        cosines, sines = self.cosines * cos + self.sines * sin, self.sines * cos - self.cosines * sin
        moved = self.stroke and self.stroke._replace(
            top=self.stroke.top._replace(input=self.stroke.top.input - start),
            bottom=self.stroke.bottom._replace(input=self.stroke.bottom.input - start),
        )
        return replace(self, mean=self.mean + self.turns * start, cosines=cosines, sines=sines, stroke=moved)

    def displacement(self, theta: float | Array, terms: int | None = None) -> Array:
        """The series at theta (rad), any shape, or its first `terms` harmonics (m or rad)."""
        return self.mean + self._evaluate(theta, 0, terms)

    def velocity(self, theta: float | Array, rate: float, terms: int | None = None) -> Array:
        """Its rate (m/s or rad/s) where theta goes at `rate` (rad/s)."""
        return rate * self._evaluate(theta, 1, terms)

    def acceleration(
        self, theta: float | Array, rate: float, terms: int | None = None, angular_acceleration: float = 0.0
    ) -> Array:
        """Its second rate (m/s^2 or rad/s^2) where theta goes at `rate` (rad/s) and speeds up so (rad/s^2)."""
        found = rate**2 * self._evaluate(theta, 2, terms)
        return found + angular_acceleration * self._evaluate(theta, 1, terms) if angular_acceleration else found

    def truncation(self, terms: int, order: int = 0) -> Extreme:
        """How far the first `terms` harmonics are from all at the most, and where, over a turn.

        Of the displacement (order 0), or of its first or second derivative with respect to theta.
        """
        theta = np.linspace(0.0, 2.0 * pi, COMPARISON_ANGLES, endpoint=False)
        off = np.abs(self._evaluate(theta, order, None) - self._evaluate(theta, order, terms))
        worst = int(np.argmax(off))
        return Extreme(float(theta[worst]), float(off[worst]))

    def _evaluate(self, theta: float | Array, order: int, terms: int | None) -> Array:
        """The derivative of an order of the harmonics with respect to theta."""
        theta = np.asarray(theta, dtype=float)
        n = np.arange(1, len(self.cosines) + 1)[:terms]
        turned = theta[..., None] * n + order * 0.5 * pi  # d/dx cos x = cos(x + pi/2), and of sin alike
        found: Array = (
            np.cos(turned) * (n**order * self.cosines[:terms]) + np.sin(turned) * (n**order * self.sines[:terms])
        ).sum(axis=-1)
        return found


@takes_mechanism
@stops_in_time
def harmonics(
    mechanism: Mechanism,
    of: str,
    axis: str | None = None,
    pair: str | None = None,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Harmonics:
    """The harmonics of a motion over a full turn of the crank.

    `of` is a slide, whose displacement is meant; with `axis` "x" or "y" a point; or a link or a turning pair, whose
    angle is meant. `pair` names the input that turns, where there are several.

    From exact positions equally spaced over a turn, so many that the harmonics come to their end, by a discrete Fourier
    transform. Those of a smooth motion fall off like a geometric series, so that nothing is lost (L. N. Trefethen,
    J. A. C. Weideman, The exponentially convergent trapezoidal rule, SIAM Review 56, 2014).

    Raises BadInput where there is nothing of that name, the input is a slide, or the motion does not repeat with every
    turn of it (wheels may need several); NoAnswer where the input makes no full turn,
    and after `timeout` s or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> planar.harmonics(planar.load("slider-crank"), "stroke").of
    'stroke'
    """
    steady, running = _at_steady_rate(mechanism, pair)
    samples, motion = MIN_SAMPLES, _run_full_turn(steady, MIN_SAMPLES, running)
    kind = _quantity_kind(motion, of, axis)
    unit = mechanism_size(mechanism, shapes_of_links(mechanism)) if kind == "length" else 1.0
    while True:
        stop_if_over(f"before {samples} positions of a turn were enough")
        values, turns = _periodic_values(motion, of, axis, running, kind)
        noise = ROUND_OFF * max(unit, float(np.abs(values).max()))
        mean, cosines, sines = _fourier_series(values, float(motion.inputs[running].position[0]))
        amplitudes = np.hypot(cosines, sines)
        rest = float(amplitudes[-samples // 8 :].max())
        if rest <= noise or samples >= MAX_SAMPLES:
            break
        samples *= 2
        motion = _run_full_turn(steady, samples, running)
    kept = max(int(np.flatnonzero(amplitudes > noise)[-1]) + 1 if (amplitudes > noise).any() else 1, 1)
    slide = axis is None and of in relative_motions(mechanism) and kind == "length"
    return Harmonics(
        mechanism=mechanism.name,
        of=of,
        axis=axis,
        input=running,
        kind=kind,
        turns=turns,
        mean=mean,
        cosines=cosines[:kept],
        sines=sines[:kept],
        positions=samples,
        rest=rest,
        stroke=find_stroke(InterpolatedRun(motion), of) if slide else None,
    )


def full_turn(mechanism: Mechanism, pair: str | None = None, steps: int = 360) -> Motion:
    """A full turn of an input from the file's position, at the file's steady rate, or 1 rad/s where that is zero.

    Raises BadInput, NoAnswer as `harmonics` does.
    """
    steady, running = _at_steady_rate(mechanism, pair, unit_rate=False)
    return _run_full_turn(steady, steps, running)


def _at_steady_rate(mechanism: Mechanism, pair: str | None, unit_rate: bool = True) -> tuple[Mechanism, str]:
    """The mechanism with the input that turns at a steady rate, and the name of that input."""
    names = [given.pair for given in mechanism.inputs]
    if not names:
        solved_mechanism(mechanism).check_motion()
    if pair is None and len(names) > 1:
        raise BadInput("inputs", f"there are several inputs, {', '.join(names)}; name the one that turns")
    running = names[0] if pair is None else pair
    if running not in names:
        raise BadInput(running, f"there is no input at {running!r}; inputs are at {', '.join(names)}")
    if relative_motions(mechanism)[running].input_kind is MeasureKind.LENGTH:
        raise BadInput(running, f"harmonics are of the turns of a crank, and the input at {running!r} slides")
    given = mechanism.inputs[names.index(running)]
    rate = 1.0 if unit_rate else given.velocity or 1.0
    return replace_inputs(mechanism, (Drive(running, None, rate, 0.0),)), running


def _run_full_turn(mechanism: Mechanism, steps: int, pair: str) -> Motion:
    """A full turn on from the file's position."""
    start = next(given.position for given in mechanism.inputs if given.pair == pair)
    motion = cycle(mechanism, steps, start, start + 2.0 * pi, pair)
    if motion.outcome is not Outcome.SOLVED:
        whole = cycle(mechanism, 1, pair=pair)  # says between which limits it goes
        outcome = Outcome.DEAD_POINT if whole.outcome is Outcome.SOLVED else whole.outcome
        raise NoAnswer(outcome, f"the input at {pair!r} makes no full turn, so there are no harmonics: {whole.reason}")
    return motion


def _quantity_kind(motion: Motion, of: str, axis: str | None) -> str:
    """What the motion is measured in. Raises BadInput where there is none of that name."""
    mechanism = motion.mechanism
    if axis is not None:
        if axis not in ("x", "y"):
            raise BadInput("axis", f"the axis is 'x' or 'y', not {axis!r:.40}")
        try:
            motion.point(of)
        except Unknown as problem:
            raise BadInput(of, str(problem)) from None
        return "length"
    named = relative_motions(mechanism)
    if of in named:
        return "length" if named[of].input_kind is MeasureKind.LENGTH else "angle"
    if of in motion.frames:
        return "angle"
    if of in motion.point_names:
        raise BadInput(of, "of a point the harmonics of one coordinate are found; name the axis, 'x' or 'y'")
    hint = suggest_name_of_kinds(of, {"pairs": named, "links": motion.frames})
    raise BadInput(of, f"there is no pair and no link {of!r}{hint}")


def _value_and_rates(motion: Motion, of: str, axis: str | None) -> list[Array]:
    """Position, velocity and acceleration of what is asked for, each (n,)."""
    if axis is not None:
        return [part[:, "xy".index(axis)] for part in motion.point(of)]
    if of in relative_motions(motion.mechanism):
        return [np.asarray(part) for part in list(motion.pair(of).values())[:3]]
    return list(motion.link(of))


def _periodic_values(motion: Motion, of: str, axis: str | None, pair: str, kind: str) -> tuple[Array, int]:
    """One turn of what is asked for, without its end, beyond whole turns of it.

    Closed is what comes back with the same position, velocity and acceleration. Raises BadInput where it is not.
    """
    value, *rates = _value_and_rates(motion, of, axis)
    gap = float(value[-1] - value[0])
    turns = round(gap / (2.0 * pi)) if kind == "angle" else 0
    gaps = [abs(gap - turns * 2.0 * pi), *(abs(float(rate[-1] - rate[0])) for rate in rates)]
    unit = mechanism_size(motion.mechanism, motion.shapes) if kind == "length" else 1.0
    scales = [unit, *(max(unit, float(np.abs(rate).max())) for rate in rates)]
    if not all(
        gap <= CLOSED_TOLERANCE * scale for gap, scale in zip(gaps, scales, strict=True)
    ):  # a rate that is not there, too
        told = f"after a turn of {pair!r} it is not where it was, so that its motion has no harmonics of one turn"
        raise BadInput(of, told)
    return (value - turns * motion.inputs[pair].position)[:-1], turns


def _fourier_series(values: Array, start: float) -> tuple[float, Array, Array]:
    """The mean, cosines and sines of equally spaced values of a turn that begins at an angle."""
    many = len(values)
    mean = float(values.mean())
    whole = np.fft.rfft(values - mean)[1 : many // 2] * (2.0 / many)
    whole *= np.exp(-1j * start * np.arange(1, many // 2))
    return mean, whole.real.copy(), -whole.imag
