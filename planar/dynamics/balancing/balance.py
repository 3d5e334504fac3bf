"""The best counterweights of a linkage over a motion, before and after, and the balanced linkage."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from planar.document.first_argument import takes_result
from planar.dynamics.balancing.conditions import frame_point
from planar.dynamics.balancing.counterweights import (
    Counterweight,
    CounterweightLimit,
    CounterweightSet,
    choose_counterweights,
)
from planar.dynamics.balancing.disc_search import search_discs
from planar.dynamics.balancing.frame_load import frame_load
from planar.dynamics.balancing.mass_parameters import as_mass, mass_parameters
from planar.dynamics.balancing.optimum import Optimum, Response, minimise_greatest
from planar.dynamics.balancing.shaking_maps import LinkKinematics, ShakingMaps
from planar.dynamics.forces import forces
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput, join_names
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import MORE_TIME, all_within_time, stops_in_time
from planar.model.mechanism import Mechanism
from planar.results.motion import Motion
from planar.solving.cycle import cycle

OBJECTIVES = ("shaking force", "shaking moment", "peak torque")
MEASURES = ("greatest", "root mean square")
TRADEOFF_SLACK = 1e-6
"""Of what it was before: by so much more than the least the one may be where the other is made least."""


class Shaking(NamedTuple):
    """What a linkage does over the n rows of a motion: `force` (n, 2), N, and `moment` (n,), N m, on its frame by the
    inertia of its links, and what its input supplies, `effort` (n,), N m, at a slide N. NaN where rates are not told.
    `share` (n,) is the part of the motion that each row stands for, by its input or its time: all add up to one.
    """

    force: Array
    moment: Array
    effort: Array
    share: Array

    def __repr__(self) -> str:
        return short_repr(self)

    def measured(self, objective: str, measure: str = "greatest") -> float:
        """The greatest or the root mean square of the shaking force, the shaking moment or the effort."""
        values = {
            "shaking force": np.linalg.norm(self.force, axis=1),
            "shaking moment": np.abs(self.moment),
            "peak torque": np.abs(self.effort),
        }[objective]
        return float(np.nanmax(values) if measure == "greatest" else np.sqrt(np.nansum(self.share * values**2)))


@dataclass(frozen=True, eq=False)
class Balance:
    """The counterweights that make the `minimised` "shaking force", "shaking moment" or "peak torque" least.

    By its `measure`, "greatest" or "root mean square" over the rows of the `motion`, it was `value_before`, is `value`,
    and no counterweights within the limits bring it below `bound` (N, N m). `is_searched`: the counterweights are
    discs, the bound is that of their convex hull, and between the two nothing is known. `before` and `after` see
    `Shaking`; the effort is that of the input `input`, friction left out, and the moment is about the point `about`
    (2,), m, named `about_name`. `balanced` is the linkage with its counterweights as further masses.
    """

    motion: Motion
    minimised: str
    measure: str
    counterweights: tuple[Counterweight, ...]
    value_before: float
    value: float
    bound: float
    is_searched: bool
    before: Shaking
    after: Shaking
    balanced: Mechanism
    input: str
    about: Array = field(repr=False)
    about_name: str
    links: tuple[str, ...]

    __repr__ = short_repr

    @cached_property
    def frame_error(self) -> float | None:
        """How far what pairs, inputs and springs put on the frame, by `planar.forces` on the balanced linkage afresh,
        is from `after` and the loads and weights, beside the greatest part of it or of `before`. None where reactions
        are not told.
        """
        found = frame_load(replace(self.motion, mechanism=self.balanced), self.about)
        if found is None:
            return None
        claimed = np.column_stack([self.after.force, self.after.moment / found.arm])
        off = np.abs(found.shaking - claimed)
        told = np.isfinite(off).all(axis=1)
        scale = max(found.scale, self.before.measured("shaking force"))
        return float(off[told].max(initial=0.0)) / scale if told.any() and scale else None


@dataclass(frozen=True, eq=False)
class BalanceTradeoff:
    """How small the greatest shaking moment can be beside the greatest shaking force, from the least of the one to
    that of the other.

    `force` (k,), N, and `moment` (k,), N m, of the best counterweights, `moment_bound` (k,) below which no others bring
    the moment at that force; `counterweights` of each, and `before` the two without any. The moment is about the point
    named `about_name`.
    """

    mechanism: Mechanism
    force: Array
    moment: Array
    moment_bound: Array
    counterweights: tuple[tuple[Counterweight, ...], ...]
    before: tuple[float, float]
    about_name: str

    __repr__ = short_repr


class _Responses:
    """What mass parameters do over a motion, as responses, and what they are without counterweights."""

    def __init__(self, source: Motion | Mechanism, about: str | None, of: str | None):
        self.motion = source if isinstance(source, Motion) else cycle(source)
        mechanism = self.motion.mechanism
        self.about, self.about_name = frame_point(mechanism, about)
        self.input = self.motion.running_input if of is None else of
        if self.input not in self.motion.inputs:
            named = join_names(self.motion.inputs)
            raise BadInput("of", f"there is no input at {self.input!r}; inputs are at {named}")
        self.kinematics = LinkKinematics(self.motion)
        self.parameters = mass_parameters(mechanism, self.motion.shapes, self.kinematics.axes)
        if not self.parameters.any():
            raise BadInput("masses", "no moving link has a mass, so that nothing shakes; give 'masses'")
        self.maps: ShakingMaps = self.kinematics.shaking_maps(self.about)
        found = forces(self.motion, friction=False)
        self.effort = np.broadcast_to(found.inputs[self.input], (len(self.motion),))
        self.rows: BoolArray = self.kinematics.regular_rows & np.isfinite(self.effort)
        self.share = _shares(self.motion, self.rows)
        if not self.rows.any():
            raise BadInput("motion", "at no position are all rates and the effort of the input told")

    def response(self, objective: str) -> Response:
        """What is made least, at the rows that are told."""
        if objective == "peak torque":
            efforts = self.maps.efforts[self.input][self.rows]
            part = float(np.abs(efforts * self.parameters).max())
            return Response(efforts[:, None], self.effort[self.rows, None], part)
        if objective == "shaking force":
            matrix = self.maps.force[self.rows]
        elif objective == "shaking moment":
            matrix = self.maps.moment[self.rows, None]
        else:
            raise BadInput("minimise", f"one of {', '.join(OBJECTIVES)} is wanted, not {objective!r:.60}")
        return Response(matrix, matrix @ self.parameters, float(np.abs(matrix * self.parameters).max()))

    def shaking(self, more: Array) -> Shaking:
        """The shaking with mass parameters (4 links,) more, over all rows."""
        parameters = self.parameters + more
        found = Shaking(
            self.maps.force @ parameters,
            self.maps.moment @ parameters,
            self.effort + self.maps.efforts[self.input] @ more,
            self.share,
        )
        for each in found[:3]:
            each[~self.rows] = np.nan
        return found

    def weights(self, links: Any, limit: CounterweightLimit | None) -> CounterweightSet:
        """The counterweights that may be."""
        total = float(self.parameters[::4].sum())
        axes = self.kinematics.axes
        return choose_counterweights(axes, self.motion.shapes, links, limit or CounterweightLimit(), total)

    def balanced(self, weights: CounterweightSet, x: Array) -> Mechanism:
        """The linkage with counterweights of variables (4 links,) as further masses."""
        axes, shapes, mechanism = self.kinematics.axes, self.motion.shapes, self.motion.mechanism
        more = tuple(
            as_mass(axes[link], shapes[axes[link].link], own)
            for link, own in zip(weights.links, (x * weights.unit).reshape(-1, 4), strict=True)
            if own[0] > 0.0
        )
        return replace(mechanism, masses=(*mechanism.masses, *more))


def _shares(motion: Motion, rows: BoolArray) -> Array:
    """The part of a motion that each row stands for (n,): half the way to its neighbours; none for rows left out."""
    along = motion.inputs[motion.running_input].position if motion.time is None else motion.time
    steps = np.abs(np.diff(along))
    found = np.zeros(len(along))
    found[:-1] += 0.5 * steps
    found[1:] += 0.5 * steps
    found[~rows] = 0.0
    if not found.any():
        found[rows] = 1.0
    share: Array = found / max(float(found.sum()), 1e-300)
    return share


@takes_result("Mechanism", "Motion", "Motion")
@stops_in_time
# long: the docstring
def balance(
    source: Mechanism | Motion,
    minimise: str = "shaking force",
    counterweights: Sequence[str] | Mapping[str, CounterweightLimit] | None = None,
    limit: CounterweightLimit | None = None,
    measure: str = "greatest",
    about: str | None = None,
    of: str | None = None,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Balance:
    """The counterweights that make the shaking force, the shaking moment or the peak torque over a motion least.

    `counterweights` names the links that bear one (left out: all on pivots of the frame), or gives the limit of each;
    `limit` is that of the others, see `CounterweightLimit`. `measure` is "greatest" or "root mean square" over the rows
    of the motion, of a mechanism those of `planar.cycle`. The moment is about the point `about` of the frame (left out:
    its origin), the torque that of the input `of` (left out: that which runs), with all loads, springs and weights, but
    without friction. Everything is linear in mass, first moments and moment of inertia of a counterweight, and these
    form a cone, m I >= |m c|^2, so that the least is found for sure, with a bound below which no counterweight goes. Of
    the best the lightest are told. Discs of a given thickness form no convex set: of these the best are searched for.
    Raises BadInput where no link has a mass, nothing moves, a name or a limit is none, or the conic solver is not
    installed (extra `balance`); NoAnswer after `timeout` s or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> found = planar.balance("two-stroke-engine", counterweights=["crank"])
    >>> round(found.value_before), round(found.value), round(found.bound)  # N
    (1224, 870, 870)
    """
    if measure not in MEASURES:
        raise BadInput("measure", f"one of {', '.join(MEASURES)} is wanted, not {measure!r:.60}")
    known = _Responses(source, about, of)
    weights = known.weights(counterweights, limit)
    wanted = known.response(minimise)
    if not np.abs(wanted.matrix).max(initial=0.0) and not np.abs(wanted.offset).max(initial=0.0):
        raise BadInput("inputs", "nothing speeds up or slows down, so that nothing shakes; give the input a velocity")
    if measure != "greatest":
        wanted = wanted.as_root_mean_square(known.share[known.rows])
    best: Optimum = minimise_greatest(wanted, weights)
    searched = any(limit.inertia_factor for limit in weights.limits)
    if searched:
        best = search_discs(wanted, weights, best)
    more = np.zeros(len(known.parameters))
    x = weights.as_bodies(best.x)
    more[weights.columns] = x * weights.unit
    before, after = known.shaking(0.0 * more), known.shaking(more)
    axes = known.kinematics.axes
    return Balance(
        known.motion,
        minimise,
        measure,
        weights.counterweights(x, axes),
        before.measured(minimise, measure),
        after.measured(minimise, measure),
        best.bound,
        searched,
        before,
        after,
        known.balanced(weights, x),
        known.input,
        known.about,
        known.about_name,
        tuple(axes[link].link for link in weights.links),
    )


@takes_result("Mechanism", "Motion", "Motion")
@stops_in_time
def balance_tradeoff(
    source: Mechanism | Motion,
    counterweights: Sequence[str] | Mapping[str, CounterweightLimit] | None = None,
    limit: CounterweightLimit | None = None,
    about: str | None = None,
    count: int = 9,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> BalanceTradeoff:
    """The least greatest shaking moment for every greatest shaking force between the least of each (Pareto's curve).

    Arguments are those of `planar.balance`; `count` points at equal steps of the force, or one where
    the same counterweights are best for both. Raises BadInput as that does,
    for fewer than two points, and for discs, which form no convex set; NoAnswer after `timeout` s or a Ctrl-C, with the
    outcome "interrupted".

    >>> import planar
    >>> curve = planar.balance_tradeoff("two-stroke-engine", ["crank", "rod"], count=3)
    >>> bool((curve.moment[:-1] >= curve.moment[1:] - 1e-9).all())
    True
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 2:
        raise BadInput("count", f"two points or more are wanted, not {count!r:.40}")
    known = _Responses(source, about, None)
    weights = known.weights(counterweights, limit)
    if any(limit.inertia_factor for limit in weights.limits):
        raise BadInput("counterweights", "the curve is of counterweights of any shape; discs form no convex set")
    force, moment = known.response("shaking force"), known.response("shaking moment")
    nothing = np.zeros(4 * len(weights.links))
    mine = force.restricted(weights), moment.restricted(weights)
    before = mine[0].greatest(nothing), mine[1].greatest(nothing)
    least = minimise_greatest(force, weights).value
    steady = minimise_greatest(moment, weights)
    most = minimise_greatest(force, weights, [(moment, steady.value + TRADEOFF_SLACK * before[1])]).value
    found, values = [], []
    first = least + TRADEOFF_SLACK * before[0]
    levels = np.linspace(first, most, count) if most > first else np.array([first])
    for level in all_within_time(levels, "points of the curve", f"{MORE_TIME}, or ask for fewer"):
        best = minimise_greatest(moment, weights, [(force, float(level))])
        values.append((mine[0].greatest(best.x), best.value, best.bound))
        found.append(weights.counterweights(weights.as_bodies(best.x), known.kinematics.axes))
    sizes, moments, bounds = (np.array(each) for each in zip(*values, strict=True))
    return BalanceTradeoff(known.motion.mechanism, sizes, moments, bounds, tuple(found), before, known.about_name)
