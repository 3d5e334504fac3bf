"""The sensitivity of what a result tells of a point, a link, a pair or an input to every number of the file."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from planar.analysis.sensitivity.transmission_slopes import TransmissionSlopes, transmission_slopes
from planar.derivatives.result_slopes import SlopeSystem, second_derivatives
from planar.document.dimensions import file_dimensions
from planar.document.first_argument import takes_result
from planar.dynamics.forces import Forces
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, NoAnswer, Outcome, join_names
from planar.foundation.short_repr import short_repr
from planar.foundation.time_limit import stops_in_time
from planar.model.link_shapes import shape_extent
from planar.results.motion import Motion, State

if TYPE_CHECKING:
    from planar.analysis.sensitivity.limit_slopes import LimitSlopes, TravelSlopes

INFLUENCE_STEP = 1e-3
"""Of the mechanism's size for lengths, of a rad for angles, else of the number itself: the change of an effect."""

ROUNDING = 1e-12
"""Of the greatest effect: a lesser one is none."""


class Influence(NamedTuple):
    """What one number of the file does to one result.

    `slope` (SI) is where it is greatest over a motion, with its sign; of a point it is the length of the vector.
    `effect` is what a change of the number by one part in a thousand (of a length: of the mechanism's size) changes the
    result by, to the first order.
    """

    dimension: str
    kind: str
    slope: float
    row: int
    effect: float

    def __repr__(self) -> str:
        return short_repr(self)


@dataclass(frozen=True, eq=False)
class Sensitivity:
    """The derivatives of what a result tells of one name, in every number of the file.

    `slopes["position"]["BC.length"]` is d position / d BC.length in SI (m per m, rad per m), exact but for rounding: of
    a state a number, or (2,) of a point and a force, of a motion or forces over one with a first axis for its n
    positions. Each is an attribute, too: `sensitivity.position`. Which results there are is what the state, the motion
    or the forces tell of that name, with their names there: of a point `position`, `velocity`, `acceleration`, of a
    link `angle`, `angular_velocity`, `angular_acceleration`, of a pair what `pair` tells, of forces `effort` and
    `power` of an input, `force` and `couple` of a pair. `kinds` are the kinds of quantity of the results, `dimensions`
    those of the numbers. An input's position, velocity and acceleration are those at the position that is asked.

    `tied` are numbers that cannot change alone, as the rod of a parallelogram with a crank too many or the radii of
    wheels in a fixed frame: their derivatives are NaN. So are all at rows of `singular_rows`, dead points and change
    points, where there are none.
    """

    of: str
    result: State | Motion | Forces
    slopes: Mapping[str, Mapping[str, Array]]
    kinds: Mapping[str, str]
    dimensions: Mapping[str, str]
    tied: tuple[str, ...]
    singular_rows: tuple[int, ...]

    def __repr__(self) -> str:
        return (
            f"<Sensitivity of {self.of!r} in {self.moving!r}: {', '.join(self.slopes)}; {len(self.dimensions)} numbers>"
        )

    def __getattr__(self, name: str) -> Mapping[str, Array]:
        slopes = self.__dict__.get("slopes", {})
        if name in slopes:
            found: Mapping[str, Array] = slopes[name]
            return found
        raise AttributeError(f"of {self.__dict__.get('of')!r} are told {join_names(slopes)}, and no {name!r}")

    @property
    def moving(self) -> State | Motion:
        """The state or the motion."""
        return self.result.moving if isinstance(self.result, Forces) else self.result

    @property
    def size(self) -> float:
        """The mechanism's size (m): the greatest distance between two points of one link."""
        return max(map(shape_extent, self.moving.shapes.values()), default=0.0) or 1.0

    @cached_property
    def dead_points(self) -> tuple[LimitSlopes, ...]:
        """How the dead points of the input that runs move, if it is the one that is asked for."""
        from planar.analysis.sensitivity.limit_slopes import dead_point_slopes  # loads casadi, as what follows

        moving = self.moving
        return dead_point_slopes(moving) if isinstance(moving, Motion) and moving.running_input == self.of else ()

    @cached_property
    def travel(self) -> TravelSlopes | None:
        """The stroke of a slide or the swing of a rocker over the motion, with its time ratio; None without one."""
        from planar.analysis.sensitivity.limit_slopes import travel_slopes

        moving = self.moving
        has_travel = self.of in moving.frames or self.of in moving._relative_motions
        return travel_slopes(moving, self.of) if isinstance(moving, Motion) and has_travel else None

    @cached_property
    def transmission(self) -> TransmissionSlopes | None:
        """How the transmission angle of the link or pair changes, and the least of a motion; None of what has none."""
        has_angle = self.of in self.moving.frames or self.of in self.moving._relative_motions
        return transmission_slopes(self.moving, self.of) if has_angle else None

    def second(self, result: str) -> Mapping[str, Mapping[str, Array]]:
        """The second derivatives of a result: `second("position")["BC.length"]["AB.length"]`, SI, shaped as the first.

        Loads that follow an input count as straight there. NaN as the first ones.
        """
        getattr(self, result)  # refuses what there is not
        whole = second_derivatives(self.result, self.of, result, self.kinds[result])
        is_motion = isinstance(self.moving, Motion)
        whole[list(self.singular_rows)] = np.nan
        names = list(self.slopes[result])
        for k in (names.index(name) for name in self.tied):
            whole[:, :, k] = whole[:, :, :, k] = np.nan
        return {
            name: {other: _one_parameter(whole[..., k, :], j, is_motion) for j, other in enumerate(names)}
            for k, name in enumerate(names)
        }

    def influences(self, result: str) -> tuple[Influence, ...]:
        """What each number does to a result, the greatest effect first; what has none is left out."""
        found, known = [], file_dimensions(self.moving.mechanism)
        size = self.size
        for name, slopes in getattr(self, result).items():
            rows = np.asarray(slopes) if isinstance(self.moving, Motion) else np.asarray(slopes)[None]
            strengths = np.abs(rows) if rows.ndim == 1 else np.linalg.norm(rows, axis=1)
            if not np.isfinite(strengths).any() or not np.nanmax(strengths):
                continue
            row = int(np.nanargmax(strengths))
            slope = float(rows[row] if rows.ndim == 1 else strengths[row])
            kind = self.dimensions[name]
            step = size if kind == "length" else 1.0 if kind == "angle" else abs(known[name].value)
            found.append(Influence(name, kind, slope, row, abs(slope) * INFLUENCE_STEP * step))
        least = ROUNDING * max((each.effect for each in found), default=0.0)
        told = (each for each in found if max(each.effect, 0.0 if each.effect else abs(each.slope)) > least)
        return tuple(sorted(told, key=lambda each: -each.effect))


@takes_result("State", "Motion", "Forces")
@stops_in_time
def sensitivity(
    result: State | Motion | Forces,
    of: str,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> Sensitivity:
    """The derivatives of what a result tells of a point, a link, a pair or an input, in every number of the file.

    Exact but for rounding, by one linear solution a position; see `Sensitivity`. Raises Unknown where there is nothing
    of that name; NoAnswer at a dead point or change point, where there are no derivatives, and after `timeout` s, or a
    Ctrl-C, with the outcome "interrupted"; BadInput of forces with friction where these are not determined or a contact
    is about to bear another way, and of a linkage that closes within a misfit.

    >>> import planar
    >>> state = planar.solve(planar.load("slider-crank"))
    >>> round(float(planar.sensitivity(state, "stroke").displacement["rod.length"]), 3)
    1.036
    """
    system = SlopeSystem(result)
    found = system.named_slopes(of)
    moving = result.moving if isinstance(result, Forces) else result
    is_motion = isinstance(moving, Motion)
    if found.is_unknown.all():
        raise BadInput(
            of,
            "there are no derivatives of forces with friction here: they are not determined, or a contact is about to "
            "bear another way; take `forces.frictionless`",
        )
    if found.is_singular.all():
        raise NoAnswer(
            Outcome.DEAD_POINT,
            f"{of!r} has no derivatives here: at a dead point or change point the position does not follow smoothly "
            f"from the dimensions; move the input away from it",
        )
    slopes = {
        name: {parameter: _one_parameter(whole, k, is_motion) for k, parameter in enumerate(system.names)}
        for name, whole in found.slopes.items()
    }
    return Sensitivity(
        of,
        result,
        slopes,
        found.kinds,
        _dimension_kinds(moving, system.names),
        found.tied,
        tuple(map(int, np.flatnonzero(found.is_singular))),
    )


def _one_parameter(whole: Array, k: int, is_motion: bool) -> Array:
    """The derivatives in one parameter, those of a scalar and of one position without axes for these."""
    found: Array = whole[:, :, k]
    found = found[:, 0] if found.shape[1] == 1 else found
    return found if is_motion else found[0]


def _dimension_kinds(moving: State | Motion, names: tuple[str, ...]) -> dict[str, str]:
    return {name: each.kind for name, each in file_dimensions(moving.mechanism).items() if name in {*names}}
