"""Linkages of bars that are pinned together, given by the places of their pins."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import fields
from functools import cached_property, lru_cache
from itertools import chain
from math import atan2, hypot, isfinite
from numbers import Integral, Real
from typing import Any, NamedTuple

import numpy as np

from planar.foundation.arrays import Array, greatest_size
from planar.foundation.errors import BadInput
from planar.model.file_units import FileUnits
from planar.model.link_shapes import At, Link, Point
from planar.model.mechanism import LARGEST_INPUT_POSITION, Input, Mechanism
from planar.model.pairs import MeasureKind, Pair, pair_types

FRAME_NAME = "frame"


def pinned(
    places: Any,
    bars: Any,
    frame: Sequence[int],
    crank: int = 0,
    *,
    velocity: float = 1.0,
    acceleration: float = 0.0,
    name: str = "",
) -> Mechanism:
    """The linkage of bars between pins at `places` (pins, 2), in m, which are its sketch too.

    `bars` are pairs of pin numbers (an array, or lists), or longer lists for a link with more pins; `frame` are the
    pins on the frame. Bar number `crank` is driven where it is pinned to the frame, from where it stands, with this
    angular velocity and acceleration (rad/s, rad/s^2). Pins are called P0, P1, ..., bars bar0, bar1, ..., the fixed
    link frame. A bar's own x-axis goes from its first pin to its second.

    Raises BadInput, with the place among the arguments, for pins that are not there or stand alone, bars of no length,
    a crank that is not pinned to the frame at one point.

    >>> import planar
    >>> places = [(0, 0), (0, 1), (3, 2), (4, 0)]
    >>> planar.pinned(places, [(0, 1), (1, 2), (2, 3)], [0, 3], name="Bars")
    <Mechanism 'Bars': 4 links, 4 pairs, driven at P0>
    """
    positions, lists, fixed = _read_positions(places), _read_bars(bars), list(frame)
    numbers = positions.tolist()
    if not fixed:
        raise BadInput("frame", "no pin is on the frame")
    if isinstance(crank, bool) or not isinstance(crank, int | Integral) or not 0 <= crank < len(lists):
        raise BadInput("crank", f"the number of a bar is wanted, of which there are {len(lists)}, not {crank!r:.40}")
    for key, rate in (("velocity", velocity), ("acceleration", acceleration)):
        if isinstance(rate, bool) or not isinstance(rate, float | Real) or not isfinite(rate):
            raise BadInput(key, f"a finite number is wanted, not {rate!r:.40}")
    pins = [*fixed, *chain.from_iterable(lists)]
    # most linkages have bars of two pins, whose numbers are whole numbers of Python's own
    if set(map(len, lists)) != {2} or set(map(type, pins)) != {int} or min(pins) < 0 or max(pins) >= len(numbers):
        fixed = [_check_pin(pin, f"frame[{k}]", len(numbers)) for k, pin in enumerate(fixed)]
        lists = [_check_bar(k, bar, numbers) for k, bar in enumerate(lists)]
        pins = [*fixed, *chain.from_iterable(lists)]
    else:
        for k, (first, second) in enumerate(lists):
            if numbers[first] == numbers[second]:
                _check_bar(k, lists[k], numbers)
    used = set(pins)
    if len(used) < len(numbers):
        pin = next(pin for pin in range(len(numbers)) if pin not in used)
        raise BadInput(f"places[{pin}]", f"pin {pin} is on no bar, and not on the frame")
    on = [pin for pin in lists[crank] if pin in fixed]
    if len(on) != 1:
        problem = "is not pinned to the frame" if not on else "is pinned to the frame twice, so it cannot turn"
        raise BadInput("crank", f"bar {crank} {problem}")
    frame_pins, rates = tuple(dict.fromkeys(fixed)), (float(velocity), float(acceleration))
    return PinnedMechanism.from_layout(name, PinLayout(positions, lists, frame_pins, int(crank), *rates))


class PinLayout(NamedTuple):
    """A pinned linkage as numbers: places (pins, 2); the pins of every bar; those on the frame."""

    pin_positions: Array
    bars: list[tuple[int, ...]]
    frame_pins: tuple[int, ...]
    crank: int
    velocity: float
    acceleration: float

    @property
    def crank_angle(self) -> float:
        """The angle of the crank (rad)."""
        (ax, ay), (bx, by) = (self.pin_positions[pin].tolist() for pin in self.bars[self.crank][:2])
        return atan2(by - ay, bx - ax)


class PinnedMechanism(Mechanism):
    """A mechanism whose links, pairs, input and sketch are made of `laid` when they are first asked for."""

    layout: PinLayout | None = None

    @classmethod
    def from_layout(cls, name: str, laid: PinLayout) -> PinnedMechanism:
        """The mechanism of a linkage that has been checked."""
        own = object.__new__(cls)
        own.__dict__.update(name=name, frame=FRAME_NAME, units=_UNITS, layout=laid)
        return own

    def __reduce__(self) -> Any:
        if self.layout is not None:
            return PinnedMechanism.from_layout, (self.name, self.layout)
        return Mechanism, tuple([getattr(self, each.name) for each in fields(Mechanism)])

    @cached_property
    def links(self) -> tuple[Link, ...]:
        """The frame, then the bars."""
        laid = self._checked_layout
        positions = laid.pin_positions.tolist()
        frame = Link(FRAME_NAME, tuple([Point(f"P{pin}", At(*positions[pin])) for pin in laid.frame_pins]))
        return (frame, *[_bar_link(f"bar{k}", bar, positions) for k, bar in enumerate(laid.bars)])

    @cached_property
    def pairs(self) -> tuple[Pair, ...]:
        """The pins, one after the other."""
        make: Callable[..., Pair] = turning_pair_type()
        found = []
        for pin, held in enumerate(self._links_on_pins):
            point, first = f"P{pin}", held[0]
            for other in held[1:]:
                name = point if len(held) == 2 else f"{point}:{first},{other}"
                found.append(make(name, (first, other), (point, point), point))
        return tuple(found)

    @cached_property
    def inputs(self) -> tuple[Input, ...]:
        """The crank's."""
        laid = self._checked_layout
        (pin,) = (pin for pin in laid.bars[laid.crank] if pin in laid.frame_pins)
        name = f"P{pin}" if len(self._links_on_pins[pin]) == 2 else f"P{pin}:{FRAME_NAME},bar{laid.crank}"
        return (Input(name, laid.crank_angle, laid.velocity, laid.acceleration),)

    @cached_property
    def sketch(self) -> tuple[tuple[str, float, float], ...]:
        """Where the pins are that move."""
        laid = self._checked_layout
        fixed = set(laid.frame_pins)
        return tuple([(f"P{pin}", x, y) for pin, (x, y) in enumerate(laid.pin_positions.tolist()) if pin not in fixed])

    @cached_property
    def _links_on_pins(self) -> list[list[str]]:
        """The links on every pin, the frame first."""
        laid = self._checked_layout
        holding: list[list[str]] = [[] for _ in laid.pin_positions]
        for pin in laid.frame_pins:
            holding[pin].append(FRAME_NAME)
        for k, bar in enumerate(laid.bars):
            for pin in bar:
                holding[pin].append(f"bar{k}")
        return holding

    @property
    def _checked_layout(self) -> PinLayout:
        assert self.layout is not None
        return self.layout


_UNITS = FileUnits()


def _read_positions(places: Any) -> Array:
    """The places as an array of its own."""
    try:
        at = np.array(places, dtype=float)
    except (TypeError, ValueError):
        raise BadInput("places", "an array (pins, 2) of numbers (m) is wanted") from None
    if at.ndim != 2 or at.shape[1] != 2 or len(at) < 2:
        raise BadInput("places", "an array (pins, 2) is wanted, of two pins at least")
    if not greatest_size(at) <= LARGEST_INPUT_POSITION:
        k = int(np.argmin(np.all(np.abs(at) <= LARGEST_INPUT_POSITION, axis=1)))
        raise BadInput(f"places[{k}]", f"numbers up to {LARGEST_INPUT_POSITION:g} m are wanted, not {at[k].tolist()}")
    at.flags.writeable = False
    return at


def _read_bars(bars: Any) -> list[tuple[int, ...]]:
    """The pins of every bar."""
    try:
        return list(map(tuple, bars.tolist() if hasattr(bars, "tolist") else bars))
    except TypeError:
        raise BadInput("bars", "lists of pin numbers are wanted, one for each bar") from None


def _check_pin(pin: Any, place: str, many: int) -> int:
    if isinstance(pin, bool) or not isinstance(pin, Integral) or pin < 0 or not pin < many:
        raise BadInput(place, f"the number of a pin is wanted, of which there are {many}, not {pin!r:.40}")
    return int(pin)


def _check_bar(number: int, bar: Sequence[int], at: Sequence[Sequence[float]]) -> tuple[int, ...]:
    """The pins of a bar, whole numbers of Python's own. Raises BadInput for a bar that is none."""
    bar = tuple([_check_pin(pin, f"bars[{number}][{k}]", len(at)) for k, pin in enumerate(bar)])
    if len(bar) < 2 or len(set(bar)) < len(bar):
        raise BadInput(f"bars[{number}]", "two pins or more are wanted, each once")
    if at[bar[0]] == at[bar[1]]:
        raise BadInput(f"bars[{number}]", f"pins {bar[0]} and {bar[1]} are at one place, so the bar has no length")
    return bar


def _bar_link(own: str, bar: Sequence[int], at: Sequence[Sequence[float]]) -> Link:
    """One bar, its own axes along its first two pins."""
    (ax, ay), (bx, by) = at[bar[0]], at[bar[1]]
    dx, dy = bx - ax, by - ay
    length = hypot(dx, dy)
    c, s = dx / length, dy / length
    points = []
    for pin in bar[2:]:
        x, y = at[pin][0] - ax, at[pin][1] - ay
        points.append(Point(f"P{pin}", At(c * x + s * y, c * y - s * x)))
    return Link(own, tuple(points), (f"P{bar[0]}", f"P{bar[1]}"), length)


@lru_cache
def turning_pair_type() -> type[Pair]:
    """The pair that keeps a point of one link on a point of another."""
    two = (MeasureKind.LENGTH, MeasureKind.LENGTH)
    return next(each for each in pair_types().values() if each.residual_kinds == two and not each.coordinate_kinds)


@lru_cache
def sliding_pair_type() -> type[Pair]:
    """The pair that keeps a point of one link on a line of another, and the angle between the two."""
    return next(each for each in pair_types().values() if each.is_lower_pair and each.input_kind is MeasureKind.LENGTH)
