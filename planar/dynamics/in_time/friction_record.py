"""What stuck and slipped in a simulation, and when: the events of friction, and how pairs rubbed at every time."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from planar.dynamics.friction.contact_functions import ContactFunctions
from planar.dynamics.in_time.stick_slip import StickSlip, StickSlipPhase
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.short_repr import short_repr


class FrictionEvent(NamedTuple):
    """A change of how a pair rubs at a time (s), the first at the start.

    `change` is "sticks", "slips", "reverses" without a rest, "stands still" where other pairs hold it, or "bears
    otherwise"; from then on its rate has this `sense` (1, -1, or 0 at rest), and it bears on, or is driven by, this
    `side`, in words.
    """

    time: float
    pair: str
    change: str
    sense: int
    side: str

    def __repr__(self) -> str:
        return short_repr(self)


class RubbingPair(NamedTuple):
    """How a pair rubbed at every row of a simulation (n,).

    The `sense` of its rate (1, -1, 0 at rest), where it `sticks`, held by friction, and its `heat` since the start (J).
    """

    sense: Array
    sticks: BoolArray
    heat: Array

    def __repr__(self) -> str:
        return short_repr(self)


class SlipPhase(NamedTuple):
    """A stretch of time (s) in which a pair slips in a sense (1, -1), or friction holds it."""

    start: float
    end: float
    sense: int
    sticks: bool

    def __repr__(self) -> str:
        return short_repr(self)


def slip_phases(events: Sequence[FrictionEvent], pair: str, end: float) -> list[SlipPhase]:
    """The phases of a pair up to an end (s), by what changed."""
    own = [each for each in events if each.pair == pair]
    ends = [each.time for each in own[1:]] + [end]
    return [
        SlipPhase(each.time, max(until, each.time), each.sense, each.change == "sticks")
        for each, until in zip(own, ends, strict=True)
    ]


class _PhaseEntry(NamedTuple):
    time: float
    senses: Array
    sticks: BoolArray


class FrictionRecord:
    """The phases of one motion, as they follow each other."""

    def __init__(self, functions: ContactFunctions | None):
        self.pairs: tuple[str, ...] = () if functions is None else functions.pairs
        self.events: list[FrictionEvent] = []
        self._entries: list[_PhaseEntry] = []
        self._sides: dict[str, str] = {}

    def begin(self, time: float, stick_slip: StickSlip, phase: StickSlipPhase) -> None:
        """Write down the phase that begins at a time."""
        before = self._entries[-1] if self._entries else None
        senses, sticks = phase.state
        for k, name in enumerate(self.pairs):
            sense, side = int(senses[k]), stick_slip.side(phase, name)
            was = None if before is None else (int(before.senses[k]), bool(before.sticks[k]))
            change = self._change(was, (sense, bool(sticks[k])), side != self._sides.get(name, "") and bool(sense))
            if change:
                self.events.append(FrictionEvent(float(time), name, change, sense, side))
            self._sides[name] = side
        self._entries.append(_PhaseEntry(time, senses, sticks))

    def rubbing(self, times: Array, heats: Array) -> dict[str, RubbingPair]:
        """Every pair at times (n,), with heats (n, pairs); where two phases meet as in the one before."""
        if not self._entries:
            return {}
        begun = np.array([each.time for each in self._entries])
        at = np.maximum(np.searchsorted(begun, times, side="left") - 1, 0)
        if begun.size:  # of those that begin at the start at once the last
            at = np.maximum(at, int(np.searchsorted(begun, times[0], side="right")) - 1)
        senses, sticks = (np.array([getattr(each, key) for each in self._entries]) for key in ("senses", "sticks"))
        return {name: RubbingPair(senses[at, k], sticks[at, k], heats[:, k]) for k, name in enumerate(self.pairs)}

    def _change(self, was: tuple[int, bool] | None, now: tuple[int, bool], is_turned: bool) -> str:
        """What changes between senses with whether a pair sticks; nothing where nothing does."""
        if was == now:
            return "bears otherwise" if is_turned else ""
        if now[1]:
            return "sticks"
        if not now[0]:
            return "stands still" if was is not None else ""
        return "reverses" if was is not None and was[0] == -now[0] else "slips"
