"""The transmission angle: how squarely the rest of a mechanism drives an output link."""

from __future__ import annotations

from dataclasses import replace
from typing import NamedTuple

import numpy as np

from planar.analysis.interpolated_run import InterpolatedRun
from planar.analysis.motion.output import Extreme
from planar.analysis.motion.zeros import SERIES_TOLERANCE, bracket_maxima, find_maximum
from planar.derivatives.transmission_system import DrivenOutput
from planar.document.first_argument import takes_result
from planar.dynamics.external_actions import KinematicArrays
from planar.dynamics.reaction_solver import fill_balance
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.short_repr import short_repr
from planar.results.motion import Motion, State
from planar.solving.prepared_mechanism import PreparedMechanism


class Transmission(NamedTuple):
    """The transmission angle (rad, 0 to pi/2) of an output link: at a position, or (n,) at every one of a motion.

    It is NaN at a limit of a part of the mechanism at which the forces on the output are not determined. `pair` is the
    output's pair with the frame, `through` names the pairs at which it is driven. `least` is where over a
    motion the angle is least, and how great it is there; None of a position.
    """

    link: str
    pair: str
    through: tuple[str, ...]
    angle: float | Array
    least: Extreme | None = None

    def __repr__(self) -> str:
        return short_repr(self)


@takes_result("State", "Motion")
def transmission(moving: State | Motion, output: str) -> Transmission:
    """The transmission angle of a link that turns about a fixed pin or slides on the frame: a link, or that pair.

    All inputs hold still, the output alone is loaded, by a torque if it turns and by a force along its way if it
    slides, and all links are weightless: which force F do the other moving links exert on it? The angle is that between
    F and the line from the fixed pin to the pin (or the point of a slide) where F acts, or, if it slides, between F and
    the perpendicular to its way. At 90 degrees all of F does work, at 0 nothing does: there the input is at a limit.
    In a four-bar it is the angle between coupler and follower, in a slider-crank the rod's with the perpendicular.

    F balances the load with the forces in all pairs, those of wheels and cams along the normals of their contacts;
    where only its direction is determined, that counts. The least over a motion is solved for: where the derivative of
    a polynomial through exact values of cos^2 is zero, or, at a kink, by sections; good to about 1e-8 of the input.

    Raises Unknown for another name; BadInput where the link is not so joined to the frame, nothing but the input
    itself drives it, a turning link is driven at several places or by a couple, so that no one line of force acts on a
    pin, or where constraints hold twice, so that the forces are not determined.

    >>> import planar
    >>> state = planar.solve(planar.load("four-bar"))
    >>> round(planar.transmission(state, "D").angle, 3)
    1.57
    """
    mechanism = moving.mechanism
    driven = DrivenOutput(mechanism, output)
    if not mechanism.inputs:
        raise BadInput("inputs", "the mechanism has no input, and nothing is transmitted")
    PreparedMechanism(mechanism).refuse_misfit("a transmission angle is not told")
    through, angle = _angles(driven, moving)
    least = _find_least(moving, driven, through, angle) if isinstance(moving, Motion) else None
    return Transmission(driven.link, driven.pair.name, through, float(angle[0]) if least is None else angle, least)


def _angles(
    driven: DrivenOutput, moving: State | Motion, through: tuple[str, ...] = ()
) -> tuple[tuple[str, ...], Array]:
    """The pairs that drive the output, and the angle (n,). Raises BadInput where constraints hold twice."""
    reactions = fill_balance(KinematicArrays(replace(moving, mechanism=driven.mechanism), at_rest=True), None, False)
    through, angle = driven.angles(reactions, through)
    unknown = np.flatnonzero(np.isnan(angle))
    if unknown.size:
        _, link_count, force_count = reactions.equilibrium_matrix.shape
        is_way = (reactions.equilibrium.null_space[unknown] != 0.0).any(axis=1)
        if (force_count - is_way.sum(axis=1) == link_count).any():
            reason = (
                f"constraints hold twice, so that the forces on {driven.link} are not determined without elasticity"
            )
            raise BadInput(driven.link, f"{reason}; leave out the link that holds nothing new")
    return through, angle


def _find_least(motion: Motion, driven: DrivenOutput, through: tuple[str, ...], angle: Array) -> Extreme:
    """Where over a motion the angle is least, and how great it is."""
    steady = InterpolatedRun(motion)

    def exact(position: float) -> float:
        return float(_angles(driven, steady.state_at(position), through)[1][0])

    order = np.argsort(steady.positions, kind="stable")
    positions, angle = steady.positions[order], angle[order]
    sampled = Extreme(float(positions[np.nanargmin(angle)]), float(np.nanmin(angle)))
    ends = [0] if steady.closed else [0, -1]
    found = [Extreme(float(positions[k]), float(angle[k])) for k in ends if np.isfinite(angle[k])] or [sampled]
    if steady.closed:  # on over its seam
        positions = np.concatenate([positions[:-1], positions[:2] + steady.period])
        angle = np.concatenate([angle[:-1], angle[:2]])
    squares = np.nan_to_num(np.cos(angle) ** 2)  # where it is not determined nothing is looked for
    most = float(squares.max())
    for low, high in bracket_maxima(positions, squares) if np.ptp(squares) > SERIES_TOLERANCE else ():
        around = squares[(positions >= low) & (positions <= high)]
        if 2.0 * around.max() - around.min() < most:  # its top is not so far above its samples
            continue
        try:
            at = find_maximum(lambda at: float(np.cos(exact(at)) ** 2), low, high)
            place, value = steady.wrap_position(at), exact(at)
        except NoAnswer:
            continue  # the motion branches there
        if place is not None:
            found.append(Extreme(place, value))
    least = min(each.value for each in found)
    first = min(each for each in found if each.value <= least + SERIES_TOLERANCE)
    return first if least <= sampled.value + SERIES_TOLERANCE else sampled
