"""How many conditions the masses of a balanced linkage meet, and which: the row space of its momentum."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from planar.document.first_argument import takes_mechanism
from planar.dynamics.balancing.generic_momentum import MomentumRows, generic_momentum
from planar.dynamics.balancing.mass_parameters import QUANTITIES, LinkAxes, mass_parameters
from planar.foundation.arrays import Array, IntArray
from planar.foundation.errors import BadInput, join_names
from planar.foundation.short_repr import short_repr
from planar.model.link_shapes import link_shape
from planar.model.mechanism import Mechanism, named_points

SAFETY_RATIO = 2.0
"""A singular value so many times the bound of its error is one; what is below is rounding."""
PIVOT_RATIO = 1e-4
"""Of a column: what has to be left of it beside those chosen before, for a condition to be told by it."""
ZERO_COEFFICIENT = 1e-9
"""Of the greatest in its condition, in units of the linkage's size: a smaller coefficient is none."""
EXACT_ZERO = 1e-14
"""What rounding leaves of an entry of an orthonormal row."""


class ConditionTerm(NamedTuple):
    """A coefficient (m to the power that makes the terms of one condition alike) times a mass parameter of a link.

    `quantity` is "m", "m x", "m y" or "I", about the axes that `axes` says.
    """

    coefficient: float
    quantity: str
    link: str
    axes: str


class BalanceCondition(NamedTuple):
    """A sum of mass parameters that is zero in a balanced linkage; its first term has the coefficient one.

    `value` is what it is with the masses of the file (kg times a power of m).
    """

    terms: tuple[ConditionTerm, ...]
    value: float

    def __repr__(self) -> str:
        return short_repr(self)

    def __str__(self) -> str:
        return " ".join(_format_term(each, not number) for number, each in enumerate(self.terms)) + " = 0"


@dataclass(frozen=True, eq=False)
class ConditionSet:
    """The conditions under which something of a linkage vanishes in every motion, at any speed.

    `kind` is "shaking force", "shaking moment" or "both"; `count` how many there are, which is the rank of the
    momentum over the motion. `singular_values` (columns,) are those of the momentum in units of its size and mass,
    greatest first, and `error_bound` what rounding, by the condition numbers of the positions, may put into any of
    them: the first `count` are above it for sure.
    """

    kind: str
    conditions: tuple[BalanceCondition, ...]
    singular_values: Array = field(repr=False)
    error_bound: float
    basis: Array = field(repr=False)
    "orthonormal rows (count, 4 links) that are zero on balanced mass parameters in units of the size"

    __repr__ = short_repr

    @property
    def count(self) -> int:
        """How many conditions there are."""
        return len(self.conditions)

    @property
    def basis_error(self) -> float:
        """What rounding puts into `basis`: what is left of singular values that are zero, by the least that is not."""
        kept, dropped = self.singular_values[: self.count], self.singular_values[self.count :]
        noise = max(float(dropped.max(initial=0.0)), float(np.finfo(float).eps * self.singular_values[0]))
        return noise / float(kept[-1]) if len(kept) else 0.0

    @property
    def is_certain(self) -> bool:
        """Whether the singular values that are told to be zero are all within the bound of their error."""
        return bool(np.all(self.singular_values[self.count :] <= self.error_bound))


@dataclass(frozen=True, eq=False)
class BalancingConditions:
    """What the masses of a linkage have to meet so that it does not shake its frame, whatever its speed.

    `force`, `moment` and `both` see `ConditionSet`; the moment is about the point `about` (2,), m, named
    `about_name`. `axes` say about which point of each link, and in which directions, its masses are taken; of the links
    in `free_masses` the force does not depend on the mass alone, but on mass times distance. `is_massless` where the
    file has no masses, so that every condition is met.
    """

    mechanism: Mechanism
    about: Array = field(repr=False)
    about_name: str
    axes: tuple[LinkAxes, ...] = field(repr=False)
    force: ConditionSet
    moment: ConditionSet
    both: ConditionSet
    rows: MomentumRows = field(repr=False)

    __repr__ = short_repr

    @property
    def is_massless(self) -> bool:
        """Whether no moving link has a mass."""
        return not np.any(self._parameters)

    @cached_property
    def free_masses(self) -> tuple[str, ...]:
        """The links whose mass does the shaking force nothing where its centre lies at the origin of its axes."""
        return self._links_without("m")

    @cached_property
    def idle_links(self) -> tuple[str, ...]:
        """The links that do not turn: of these the force depends on the mass alone, wherever it is centred."""
        return tuple(name for name in self._links_without("m x") if name in self._links_without("I", self.both))

    @cached_property
    def _parameters(self) -> Array:
        return mass_parameters(self.mechanism, self.rows.shapes, self.axes)

    def _links_without(self, quantity: str, of: ConditionSet | None = None) -> tuple[str, ...]:
        columns = (of or self.force).basis[:, QUANTITIES.index(quantity) :: 4]
        none = np.abs(columns).max(axis=0, initial=0.0) <= ZERO_COEFFICIENT
        return tuple(axes.link for axes, is_none in zip(self.axes, none, strict=True) if is_none)


@takes_mechanism
def balancing_conditions(mechanism: Mechanism, about: str | None = None, seed: int = 0) -> BalancingConditions:
    """The conditions under which a linkage shakes its frame by no force, and by no moment, at any speed.

    The momentum with each input alone at unit rate is linear in mass, first moments and moment of inertia of every link
    about a point of its own; its rank over the positions is the number of conditions (4 for the force of a four-bar: R.
    S. Berkof and G. G. Lowen, J. Eng. Ind. 91, 1969). Ranks are by singular values, against a bound from the condition
    numbers of the positions. The moment is about the point `about` of the frame (left out: its origin), which does not
    matter where the force is balanced. Raises BadInput for a point that is none of the frame's, NoAnswer where there is
    no motion.

    >>> import planar
    >>> planar.balancing_conditions("four-bar").force.count
    4
    """
    point, name = frame_point(mechanism, about)
    rows = generic_momentum(mechanism, point, seed)
    parameters = mass_parameters(mechanism, rows.shapes, rows.axes)
    force = _condition_set("shaking force", rows, rows.linear, rows.linear_error, parameters)
    moment = _condition_set("shaking moment", rows, rows.angular, rows.angular_error, parameters)
    together, off = np.concatenate([rows.linear, rows.angular]), float(np.hypot(rows.linear_error, rows.angular_error))
    both = _condition_set("both", rows, together, off, parameters)
    return BalancingConditions(mechanism, point, name, rows.axes, force, moment, both, rows)


def frame_point(mechanism: Mechanism, name: str | None) -> tuple[Array, str]:
    """Where a point of the frame is (2,), m, and its name; the frame's origin where none is named. Raises BadInput."""
    if name is None:
        return np.zeros(2), "the frame's origin"
    shape = next(link_shape(link) for link in mechanism.links if link.name == mechanism.frame)
    places = {
        each.name: shape.position(point)
        for each in named_points(mechanism)
        for link, point in each.members
        if link == mechanism.frame
    }
    if name not in places:
        raise BadInput("about", f"the frame has no point {name!r}; its points are {join_names(places)}")
    return np.array([float(places[name].x), float(places[name].y)]), name


def _condition_set(kind: str, rows: MomentumRows, matrix: Array, off: float, parameters: Array) -> ConditionSet:
    """The conditions that rows (n, 4 links) put on mass parameters."""
    singular, right = np.linalg.svd(matrix, full_matrices=False)[1:]
    bound = off + float(np.finfo(float).eps) * max(matrix.shape) * float(singular[0])
    rank = int(np.sum(singular > SAFETY_RATIO * bound))
    basis = right[:rank]
    basis = np.where(np.abs(basis) <= EXACT_ZERO, 0.0, basis)
    pivots = _choose_pivots(basis, rows.axes)
    reduced = np.linalg.solve(basis[:, pivots], basis) if rank else basis
    unit = rows.column_scale
    conditions = []
    for pivot, row in zip(pivots, reduced, strict=True):
        used = [
            pivot,
            *(k for k in np.flatnonzero(np.abs(row) > ZERO_COEFFICIENT * np.abs(row).max()) if k != pivot),
        ]
        terms = tuple(
            ConditionTerm(
                float(row[k] * unit[pivot] / unit[k]) if k != pivot else 1.0,
                QUANTITIES[k % 4],
                rows.axes[k // 4].link,
                rows.axes[k // 4].description,
            )
            for k in used
        )
        value = sum(term.coefficient * parameters[k] for term, k in zip(terms, used, strict=True))
        conditions.append(BalanceCondition(terms, float(value)))
    return ConditionSet(kind, tuple(conditions), singular, bound, basis)


def _choose_pivots(basis: Array, axes: tuple[LinkAxes, ...]) -> IntArray:
    """The mass parameters by which conditions are told (rank,): those that a counterweight sets most easily.

    First moments of links that turn about the frame, then their moments of inertia, then those of the others.
    """
    rank_of = {1: 0, 2: 0, 3: 1, 0: 4}
    order = sorted(
        range(basis.shape[1]),
        key=lambda k: (rank_of[k % 4] + (0 if axes[k // 4].is_pivoted or k % 4 == 0 else 2), k),
    )
    left = basis.copy()
    chosen: list[int] = []
    for column in order:
        size = float(np.linalg.norm(left[:, column]))
        if len(chosen) < len(basis) and size > PIVOT_RATIO:
            chosen.append(column)
            unit = left[:, column] / size
            left = left - np.outer(unit, unit @ left)
    return np.array(chosen, dtype=int)


def _format_term(term: ConditionTerm, is_first: bool) -> str:
    sense = "" if is_first and term.coefficient > 0.0 else "- " if term.coefficient < 0.0 else "+ "
    size = abs(term.coefficient)
    number = "" if abs(size - 1.0) < 1e-12 else f"{size:.6g} "
    return f"{sense}{number}{term.quantity}({term.link})"
