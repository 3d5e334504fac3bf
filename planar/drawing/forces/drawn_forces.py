"""The forces over the run that a drawing shows."""

from __future__ import annotations

from math import pi
from typing import NamedTuple

import numpy as np

from planar.drawing.diagrams.axes import number
from planar.drawing.diagrams.drawn_run import closing, steady
from planar.dynamics.flywheel import turns
from planar.dynamics.forces import Forces, forces
from planar.dynamics.load_validation import refuse_unloaded
from planar.equations.functions import size
from planar.foundation.errors import BadInput
from planar.foundation.units import unit
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion

Array = np.ndarray

NOTHING = 1e-9
"""A force below this part of the greatest in any pair at that position is round-off."""


class Loaded(NamedTuple):
    """Forces over a motion, and what they are drawn over, in the order in which that grows.

    `over` is of the input that runs, in the file's units, else the time (s) where the input turns back; of a whole
    cycle it goes from zero on.
    """

    forces: Forces
    over: Array
    name: str
    "of what it is, with its unit"
    unit: str
    order: Array
    period: float
    "of a whole cycle, in the unit; else 0"
    notes: tuple[str, ...]

    def along(self, values: Array) -> Array:
        """What the motion has at its rows (n, ...), in this order."""
        found = np.asarray(values)[self.order]
        if not self.period:
            return found
        before, after = self.over[1], self.period - self.over[-2]
        part = after / (before + after) if before + after else 0.0
        edge = (found[:1] * part + found[-1:] * (1.0 - part)) if before else found[:1]
        return np.concatenate([edge, found, edge])

    @property
    def arm(self) -> float:
        """The mechanism's size (m)."""
        return size(self.forces.mechanism, self.forces.moving.shapes)

    @property
    def least(self) -> Array:
        """What a force (N) at least is beside round-off, of the greatest in any pair there; a couple at the arm."""
        found = np.zeros(len(self.over))
        for each in self.forces.reactions.values():
            found = np.fmax(found, np.hypot(*self.along(each.force).T))
        return NOTHING * found

    def place(self, row: int) -> str:
        """Where a row is: at 120 deg."""
        return f"at {number(self.over[row], 4)} {self.unit}"


def loaded(what: Forces | Motion | Mechanism) -> Loaded:
    """Forces as they are given, or those over a whole cycle at the input's steady speed.

    Without a speed in the file inertia is left out. Raises BadInput for the forces of one position, for a mechanism on
    which nothing acts, and what `planar.cycle` and `planar.forces` raise.
    """
    refuse_unloaded(what if isinstance(what, Mechanism) else what.mechanism)
    notes = []
    if isinstance(what, Forces):
        found = what
    elif isinstance(what, Motion) and what.time is not None:
        found = forces(what)
    else:
        run = closing(steady(what))
        found = forces(run.motion, inertia=run.timed)
        if not run.timed and run.motion.mechanism.masses:
            notes.append("without inertia: the file gives no speed of the input")
    motion = found.moving
    if not isinstance(motion, Motion):
        raise BadInput("forces", "this is drawn over a motion; give the forces over one")
    name = motion.running
    position, way = motion.inputs[name].position, np.diff(motion.inputs[name].position)
    units = motion.mechanism.units
    if (way > 0.0).all() or (way < 0.0).all() or motion.time is None:
        written = units.length if motion.slides(name) else units.angle
        over, label = position * unit(written).denominator / unit(written).numerator, f"{name} ({written})"
    else:
        written, over, label = "s", motion.time, "t (s)"
    period = unit(written).from_si(2.0 * pi) * turns(motion, name) if written != "s" else 0.0
    if period:
        over = np.mod(over[:-1], period)
        over[period - over < 1e-9 * period] = 0.0
    order = np.argsort(over, kind="stable")
    over = over[order]
    if period:
        over = np.concatenate([[0.0], over, [period]])
    return Loaded(found, over, label, written, order, period, tuple(notes))
