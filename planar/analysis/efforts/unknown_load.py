"""Which load, spring or counterweight holds a mechanism: the inverse of forces."""

from __future__ import annotations

from collections import Counter
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.forces import forces
from planar.dynamics.friction.load_for_effort import LoadWithFriction
from planar.dynamics.virtual_velocities import has_length_motion
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, Unknown, join_names
from planar.foundation.short_repr import short_repr
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion, State

NO_INFLUENCE = 1e-12
"""Of the greatest effort: a change that is smaller is none."""
SAME_FACTOR_TOLERANCE = 1e-9
"""Of the greatest: factors that differ by less over a motion are one."""
MAX_GAUSS_NEWTON_STEPS, DIFFERENCE_STEP = 30, 1e-6


class UnknownLoad(NamedTuple):
    """What a load has to be multiplied by so that an input supplies `effort` (N m, at a slide N).

    `factor` over the motion (n,), or at a position: of a force, torque or effort, a spring's stiffness, or a mass; NaN
    where the load does nothing on the input, or friction jams. `best` is the one factor that comes nearest to that over
    the whole motion, in the sense of least squares of the effort over its rows, and `left` the greatest effort that
    differs then; `is_constant` whether it holds everywhere. `value` is what the file says, and `what` names it.
    `has_friction` where friction has its part, in the sense of the motion; `remarks` are what there is to say of it.
    """

    load: str
    what: str
    value: float
    input: str
    effort: float
    factor: Array | float
    best: float
    left: float
    is_constant: bool
    has_friction: bool = False
    remarks: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("State", "Motion")
def unknown_load(
    moving: State | Motion,
    load: str,
    effort: float = 0.0,
    of: str | None = None,
    inertia: bool = True,
    friction: bool = True,
) -> UnknownLoad:
    """Which size of a load, spring or mass lets an input (left out: the one that runs) supply so much: 0 holds it.

    `load` by its name as in `planar.dimensions`: `loads.0`, `springs.0` (its stiffness), `masses.rod`. Efforts are
    linear in each of these, whatever else acts, so that two solutions tell it exactly. With friction, in the sense of
    the motion, its size is solved for beside the reactions that friction follows; what is held at rest `holding` tells.
    Raises Unknown for a load that is not there, BadInput for an input that is not, and a load that does nothing on the
    input anywhere, and NoAnswer as `planar.forces` does.

    >>> import planar
    >>> lamp = planar.cycle(planar.load("balanced-lamp"), 12)
    >>> planar.unknown_load(lamp, "springs.0", inertia=False).is_constant
    True
    """
    mechanism = moving.mechanism
    name = of or (moving.running_input if isinstance(moving, Motion) else next(iter(moving.inputs), ""))
    if name not in moving.inputs:
        raise BadInput(name or "inputs", f"there is no input of this name; inputs are at {', '.join(moving.inputs)}")
    what, value = _describe_size(mechanism, load)
    doubled = scale_load(mechanism, load, 2.0)
    own, twice = (
        np.atleast_1d(np.asarray(forces(_with_mechanism(moving, each), inertia, False).inputs[name], dtype=float))
        for each in (mechanism, doubled)
    )
    line = _EffortLine(own, twice - own)
    if not line.acts.any():
        raise BadInput(load, f"it does nothing on the input at {name!r} here, so that no size of it holds that")
    factor, best, left = line.factors(effort), *line.best_factor(effort)
    remarks: tuple[str, ...] = ()
    has_friction = False
    if friction and any(pair.has_friction for pair in mechanism.pairs):
        column = [given.pair for given in mechanism.inputs].index(name)
        rubbing = LoadWithFriction(moving, doubled, column, inertia)
        told = rubbing.factors(effort)
        factor, has_friction, remarks = np.where(line.acts, told.values, np.nan), told.rubs, told.remarks
        best, left = (float(factor[0]), 0.0) if len(factor) == 1 else _best_with_friction(rubbing, effort, best)
    same = left <= SAME_FACTOR_TOLERANCE * line.scale
    found = factor if isinstance(moving, Motion) else float(factor[0])
    return UnknownLoad(
        load, what, value, name, float(effort), found, best, left, same, has_friction=has_friction, remarks=remarks
    )


class _EffortLine:
    """Efforts (n,) with a load as it is, and their shares that grow with it."""

    def __init__(self, own: Array, share: Array):
        self.own, self.share = own, share
        self.known = np.isfinite(share)
        self.scale = float(np.abs(np.concatenate([own[self.known], share[self.known]])).max(initial=0.0))
        self.acts = self.known & (np.abs(share) > NO_INFLUENCE * self.scale)

    def factors(self, effort: float) -> Array:
        """The factor at each position (n,)."""
        found = np.full(len(self.own), np.nan)
        found[self.acts] = 1.0 + (effort - self.own[self.acts]) / self.share[self.acts]
        return found

    def best_factor(self, effort: float) -> tuple[float, float]:
        """The one of least squares, and the greatest effort that differs then."""
        missing, share = effort - self.own[self.known], self.share[self.known]
        more = float(missing @ share) / float(share @ share)
        return 1.0 + more, float(np.abs(missing - more * share).max())


def _best_with_friction(rubbing: LoadWithFriction, effort: float, start: float) -> tuple[float, float]:
    """The same with friction, by Gauss' and Newton's steps over the positions that are told."""
    best, missing = start, effort - rubbing.efforts(start).values
    for _ in range(MAX_GAUSS_NEWTON_STEPS):
        step = DIFFERENCE_STEP * max(abs(best), 1.0)
        slope = (effort - rubbing.efforts(best + step).values - missing) / -step
        known = np.isfinite(slope) & np.isfinite(missing)
        if not slope[known].any():
            break
        more = float(missing[known] @ slope[known]) / float(slope[known] @ slope[known])
        tried = effort - rubbing.efforts(best + more).values
        known = np.isfinite(tried) & np.isfinite(missing)  # where it jams nothing is told
        if not np.sum(tried[known] ** 2) < np.sum(missing[known] ** 2):
            break
        best, missing = best + more, tried
        if abs(more) <= SAME_FACTOR_TOLERANCE * abs(best):
            break
    return (best, float(np.nanmax(np.abs(missing)))) if np.isfinite(missing).any() else (np.nan, np.nan)


def scale_load(mechanism: Mechanism, load: str, factor: float) -> Mechanism:
    """The mechanism with a load, the stiffness of a spring, or a mass so many times as great. Raises Unknown."""
    kind, index = _find_load(mechanism, load)
    if kind == "loads":
        each = mechanism.loads[index]
        changed = each.scaled(factor)
        return replace(mechanism, loads=(*mechanism.loads[:index], changed, *mechanism.loads[index + 1 :]))
    if kind == "springs":
        spring = mechanism.springs[index]
        stiffer = spring._replace(stiffness=factor * spring.stiffness)
        return replace(mechanism, springs=(*mechanism.springs[:index], stiffer, *mechanism.springs[index + 1 :]))
    mass = mechanism.masses[index]
    heavier = mass._replace(mass=factor * mass.mass)
    return replace(mechanism, masses=(*mechanism.masses[:index], heavier, *mechanism.masses[index + 1 :]))


def _names(mechanism: Mechanism) -> dict[str, tuple[str, int]]:
    """Every load, spring and mass by the name that its numbers begin with."""
    found = {f"loads.{k}": ("loads", k) for k in range(len(mechanism.loads))}
    found |= {f"springs.{k}": ("springs", k) for k in range(len(mechanism.springs))}
    count, seen = Counter(mass.link for mass in mechanism.masses), Counter[str]()
    for k, mass in enumerate(mechanism.masses):
        own = f"masses.{mass.link}" if count[mass.link] == 1 else f"masses.{mass.link}.{seen[mass.link]}"
        seen[mass.link] += 1
        found[own] = ("masses", k)
    return found


def _find_load(mechanism: Mechanism, load: str) -> tuple[str, int]:
    named = _names(mechanism)
    if load not in named:
        told = f"there are {join_names(named)}" if named else "nothing acts on this mechanism"
        raise Unknown(f"there is no load, spring or mass {load!r}; {told}")
    return named[load]


def _describe_size(mechanism: Mechanism, load: str) -> tuple[str, float]:
    """What the size of a load is, and that in the file (SI)."""
    kind, index = _find_load(mechanism, load)
    if kind == "springs":
        return "stiffness", mechanism.springs[index].stiffness
    if kind == "masses":
        return "mass", mechanism.masses[index].mass
    each = mechanism.loads[index]
    if each.force is not None:
        return "force", float(np.hypot(*each.force))
    if each.torque is not None:
        return "torque", each.torque
    if each.pair is None:
        return "force", each.effort or 0.0
    return "force" if has_length_motion(mechanism, each.pair) else "torque", each.effort or 0.0


def _with_mechanism(moving: State | Motion, mechanism: Mechanism) -> State | Motion:
    return replace(moving, mechanism=mechanism)
