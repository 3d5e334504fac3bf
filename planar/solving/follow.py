"""From one position to others along the branch on which it lies."""

from __future__ import annotations

from typing import NamedTuple, Protocol

import numpy as np

from planar.errors import NoAnswer, Outcome
from planar.program import Program, length
from planar.solving.branch import Branch

Array = np.ndarray

STRIDE = 0.1
"""Greatest first step of an input: rad, or lengths of the mechanism's size."""
SHORTEST = 3e-7
"""A step of the inputs (rad, or lengths of the size) below this says that the branch ends.

So near to a crossing of branches rounding (1e-16 over the distance) moves a position by less than a hundredth of what
the branches are apart; nearer, it could carry it from one to the other.
"""
CORRECTIONS = 8


class Followed(Protocol):
    """What following needs of a solver."""

    program: Program

    def open_along(self, z: Array, u: Array) -> Array:
        """What the worst constraint leaves open at every sample; z (samples, unknowns), u (samples, inputs)."""

    @property
    def tolerance(self) -> float:
        """What the gate lets pass."""

    def where(self, u: Array) -> str:
        """A position of the inputs in words."""


class Run(NamedTuple):
    """Unknowns at every sample that was reached (samples, unknowns), how many of them the general path had to solve,
    and why the rest was not reached, if not."""

    z: Array
    general: int
    stopped: NoAnswer | None = None


def follow(solver: Followed, p: Array, z: Array, start: Array, stop: Array) -> Array:
    """The unknowns at inputs `stop`, followed from those at `start` along the straight line between them.

    Raises NoAnswer where the branch ends on the way.
    """
    found = _followed(solver, p, z, start, stop - start)
    if found.t < 1.0:
        raise NoAnswer(
            Outcome.BRANCH_LOST,
            f"this assembly can be followed only to {solver.where(start + found.t * (stop - start))} on the way from "
            f"{solver.where(start)} to {solver.where(stop)}: there its motion ends, or branches; "
            f"stop short of it, or drive another pair",
        )
    return found.z


class _Followed(NamedTuple):
    """How far a branch was followed: the unknowns there, and the part of the way."""

    z: Array
    t: float


def _followed(solver: Followed, p: Array, z: Array, start: Array, way: Array) -> _Followed:
    """As far along the way as the branch goes.

    A predictor of second order, Newton's corrector, and both parts of the gate at every step; steps shrink where
    either objects.
    """
    stop = start + way
    reach = float(np.max(np.abs(way), initial=0.0)) or 1.0
    branch = Branch(solver.program, p)
    t, step = 0.0, min(1.0, STRIDE / reach)
    here = branch.at(z, start, way)
    while t < 1.0:
        step = min(step, 1.0 - t)
        inputs = stop if t + step >= 1.0 else start + (t + step) * way
        tried = corrected(solver.program, p, z + step * here.rates + 0.5 * step**2 * here.second, inputs)
        if tried is not None and solver.open_along(tried[None], inputs[None])[0] <= solver.tolerance:
            there = branch.at(tried, inputs, way)
            if branch.same(here, there, step):
                z, here, t, step = tried, there, t + step, 1.5 * step
                continue
        step *= 0.5
        if step * reach < SHORTEST:
            return _Followed(z, t)
    return _Followed(z, 1.0)


def run(solver: Followed, p: Array, z: Array, u: Array) -> Run:
    """The unknowns at every sample of a run of inputs u (samples, inputs), from those of the first.

    The whole run is one call of the compiled program; every sample then passes both parts of the gate, and from
    one that does not the general path goes on to the next.
    """
    samples = len(u)
    found = np.empty((samples, z.size))
    found[0] = z
    done, general = 1, 0
    while done < samples:
        if solver.program.square:
            found[done:] = _accumulated(solver.program, p, found[done - 1], u[done:], samples - 1)
            done += _passing(solver, p, found[done - 1 :], u[done - 1 :])
        if done < samples:
            try:
                found[done] = follow(solver, p, found[done - 1], u[done - 1], u[done])
            except NoAnswer as stopped:
                return Run(found[:done], general, stopped)
            done, general = done + 1, general + 1
    return Run(found, general)


def reach(solver: Followed, p: Array, z: Array, start: Array, way: Array) -> tuple[Array, float]:
    """The unknowns at the end of the branch from `start` along `way`, and how many of `way` it is away; 1 at most."""
    found = _followed(solver, p, z, start, way)
    return found.z, found.t


def _accumulated(program: Program, p: Array, z: Array, u: Array, steps: int) -> Array:
    """The unknowns at inputs u, by the program's one run of so many steps: a shorter one waits at its end."""
    if z.size == 0:
        return np.zeros((len(u), 0))
    inputs = np.concatenate([u, np.repeat(u[-1:], steps - len(u), axis=0)])
    return program.runs(steps)(z, inputs.T, np.repeat(p[:, None], steps, axis=1)).full().T[: len(u)]


def _passing(solver: Followed, p: Array, z: Array, u: Array) -> int:
    """How many samples after the first pass both parts of the gate, up to the first that does not."""
    closed = solver.open_along(z, u) <= solver.tolerance
    whole = len(closed) if closed.all() else int(np.argmin(closed))
    if whole < 2:
        return 0
    keeps = Branch(solver.program, p).along(z[:whole], u[:whole])
    return len(keeps) if keeps.all() else int(np.argmin(keeps))


def corrected(program: Program, p: Array, z: Array, u: Array, last: int | None = None) -> Array | None:
    """Newton's corrector, group after group (to the `last`), from unknowns near by; None where one does not close."""
    z = z.copy()
    for stage in program.equations.stages:
        if not length(stage.rows) or (last is not None and stage.level > last):
            continue
        closing = program.closing(stage)
        before = np.inf
        for _ in range(CORRECTIONS):
            left, slope = (each.full() for each in closing(z, u, p))
            gap = float(np.max(np.abs(left), initial=0.0))
            if not gap < before:
                break
            before = gap
            if slope.size:
                z[stage.unknowns] -= np.linalg.lstsq(slope, left, rcond=1e-12)[0].ravel()
        if not before <= 1e-10:
            return None
    return z
