"""The derivatives of results of a state, a motion or forces, at every position, in every number of the file."""

from __future__ import annotations

from collections.abc import Container, Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.derivatives.design_equations import DesignEquations, design_equations
from planar.derivatives.force_equations import ForceEquations
from planar.derivatives.implicit_system import ImplicitSystem, ResultSlopes
from planar.derivatives.result_expressions import (
    ResultExpression,
    force_expressions,
    kinematic_expressions,
    refuse_name,
)
from planar.document.dimensions import Dimension
from planar.document.revised.changed_numbers import with_values
from planar.dynamics.forces import Forces
from planar.equations.casadi_call import BufferedFunction
from planar.equations.residuals import pair_residuals
from planar.foundation.arrays import Array, BoolArray
from planar.foundation.errors import BadInput
from planar.model.mechanism import Mechanism
from planar.model.pairs import MeasureKind
from planar.results.motion import Motion, State

OPENING = 1e-6
"""Constraints that are opened by more than this part of a change (sizes, rad) do not go with it."""
NUDGE = 1e-3
"""Of a number, or of the size: a change of its own that a file may be refused for."""
GOLDEN_FRACTION = (5.0**0.5 - 1.0) / 2.0
"""Its multiples leave fractions that are all different: no two numbers are changed by the same part."""


class NamedSlopes(NamedTuple):
    """Derivatives (n, parts, parameters) of results by name, the kind of quantity of each, and of the parameters their
    names; where there are none (n,), and which parameters cannot change alone."""

    slopes: Mapping[str, Array]
    kinds: Mapping[str, str]
    parameters: tuple[str, ...]
    is_singular: BoolArray
    tied: tuple[str, ...]


class SlopeSystem:
    """The system of equations that a result follows from, with its values at the result's positions."""

    def __init__(self, result: State | Motion | Forces, offsets: tuple[str, ...] = ()):
        self.moving = result.moving if isinstance(result, Forces) else result
        self.forces = result if isinstance(result, Forces) else None
        self.design: DesignEquations = design_equations(self.moving.mechanism, offsets)
        self.constants: Array | None = None
        if self.forces is None:
            self.balance = None
            self.system: ImplicitSystem = self.design.kinematics
            self.values, self.parameters = self.design.coordinates_at(self.moving)
        else:
            refuse_stiffness(self.forces)
            inertia = any(each.kind == "inertia" for each in self.forces.acting)
            self.balance = ForceEquations(self.design, inertia, self.forces)
            self.system = self.balance.system
            self.values, self.parameters, self.constants = self.balance.values_at(self.moving)

    def expressions(self, name: str) -> list[ResultExpression]:
        """What the result tells of a point, link, pair or input. Raises Unknown."""
        found = list(kinematic_expressions(self.design, self.moving, name))
        if self.balance is not None:
            found += force_expressions(self.balance, name)
        if not found:
            raise refuse_name(self.design, self.moving, name)
        return found

    def result_values(self, name: str) -> dict[str, Array]:
        """What the result tells of a name (n, parts), by the names of its results; angles go on over a turn."""
        found = {}
        given = self.system.given
        for each in self.expressions(name):
            value = BufferedFunction(ca.Function("value", given, [ca.densify(each.value)]))
            held = np.zeros((len(self.parameters), 0)) if self.constants is None else self.constants
            told = value.evaluate_batch(len(self.parameters), *self.values, self.parameters, held)[0]
            told = told.reshape(len(self.parameters), -1)
            found[each.name] = np.unwrap(told, axis=0) if each.kind == "angle" else told
        return found

    def slopes(self, results: ca.SX) -> ResultSlopes:
        """The derivatives of results (n, results, parameters), those in the inputs with what loads change by them."""
        jacobians = self.system.result_jacobians(results)
        found = self.system.slopes(jacobians, self.values, self.parameters, self.constants)
        if self.balance is None:
            return found
        own = self.design.t.numel()
        slopes, of_factors = found.slopes[..., :own], found.slopes[..., own:]
        slopes = slopes + self.balance.slopes_by_factors(of_factors, self.moving)
        return ResultSlopes(slopes, found.is_singular | self.balance.is_unknown, found.contradicts[:, :own])

    def named_slopes(self, name: str) -> NamedSlopes:
        """The derivatives of all that the result tells of a name."""
        found = self.expressions(name)
        gaps = pair_gaps(self.design)
        whole = self.slopes(ca.vertcat(*(each.value for each in found), gaps))
        parts = np.cumsum([each.value.numel() for each in found])
        *each_slopes, open_by = np.split(whole.slopes, parts, axis=1)
        tied = whole.contradicts | (np.abs(open_by * self.design.scale).max(axis=1, initial=0.0) > OPENING)
        tied[whole.is_singular] = False
        names = self.design.names
        bound = set(tied_dimensions(self.moving.mechanism)) | {names[k] for k in np.flatnonzero(tied.any(axis=0))}
        alone = np.array([name not in bound for name in names])
        slopes = {}
        for each, own in zip(found, each_slopes, strict=True):
            moved = np.where(alone, own, np.nan)
            moved[whole.is_singular] = np.nan
            slopes[each.name] = moved
        kinds = {each.name: each.kind for each in found}
        return NamedSlopes(slopes, kinds, names, whole.is_singular, tuple(name for name in names if name in bound))

    def gradient(self, weights: Mapping[str, Mapping[str, Array]]) -> tuple[Array, BoolArray]:
        """The derivatives (n, parameters) of the sum of results by name times their weights (n, parts), and where there
        are none (n,)."""
        values, given = [], []
        for name, of in weights.items():
            expressions = {each.name: each.value for each in self.expressions(name)}
            for result, numbers in of.items():
                values.append(expressions[result])
                given.append(numbers.reshape(len(self.parameters), -1))
        weighed = self.system.weighed_results(ca.vertcat(*values))
        found, is_singular = self.system.gradient(
            weighed, np.concatenate(given, axis=1), self.values, self.parameters, self.constants
        )
        own = self.design.t.numel()
        if self.balance is None:
            return found, is_singular
        by_factors = self.balance.slopes_by_factors(found[:, None, own:], self.moving)[:, 0]
        return found[:, :own] + by_factors, is_singular | self.balance.is_unknown

    def second_slopes(self, name: str, result: str) -> Array:
        """The second derivatives of a result (n, parts, parameters, parameters)."""
        (value,) = (each.value for each in self.expressions(name) if each.name == result)
        own = self.design.t.numel()
        found = [
            self.system.second_slopes(part, self.values, self.parameters, self.constants)[:, :own, :own]
            for part in ca.vertsplit(value)
        ]
        return np.stack(found, axis=1)


def pair_gaps(design: DesignEquations) -> ca.SX:
    """What all constraints leave open (sizes, rad), those that the equations do without among them."""
    frames, own = design.placed
    work, unit = design.work, design.solver.unit
    rows = pair_residuals(work.mechanism.pairs, frames, work.numbers, own)
    scaled = [value / unit if row.kind is MeasureKind.LENGTH else value for row, value in rows]
    scaled += [pair.contact_gap(work.numbers[pair.name], own[pair.name]) / unit for pair in work.mechanism.pairs]
    return ca.vertcat(ca.SX(0, 1), *scaled)


def refuse_stiffness(forces: Forces) -> None:
    """Refuse forces whose derivatives do not follow from equilibrium alone. Raises BadInput."""
    if forces.mechanism.pair_stiffness:
        raise BadInput(
            forces.mechanism.pair_stiffness[0][0],
            "derivatives are told of forces that equilibrium determines, and not of those shared by stiffness",
        )


def tied_dimensions(mechanism: Mechanism, among: Container[str] | None = None) -> tuple[str, ...]:
    """The numbers of a file, or those with these names, that cannot change alone, either way: others have to go with
    them.

    So the radii of wheels and the distance of their centres, or the rises of a cam's law.
    """
    known: dict[str, bool] = mechanism.__dict__.setdefault("_tied_dimensions", {})  # kept: numbers are tried
    design = design_equations(mechanism)
    chosen = [
        each
        for each in design.dimensions
        if each.path[0] in ("links", "pairs") and (among is None or each.name in among)
    ]
    untried = [each for each in chosen if each.name not in known]
    bound = {*_find_tied(design, untried)}
    known.update({each.name: each.name in bound for each in untried})
    return tuple(each.name for each in chosen if known[each.name])


def _find_tied(design: DesignEquations, dimensions: Sequence[Dimension]) -> list[str]:
    """Those of some numbers that cannot change alone, found by halving.

    A file is checked once for all numbers that are free: changed together, each by a part of its own, tied numbers do
    not go with one another but by chance.
    """
    if not dimensions or any(_is_accepted(design, dimensions, sign) for sign in (1.0, -1.0)):
        return []
    if len(dimensions) == 1:
        return [dimensions[0].name]
    middle = len(dimensions) // 2
    return [*_find_tied(design, dimensions[:middle]), *_find_tied(design, dimensions[middle:])]


def _is_accepted(design: DesignEquations, dimensions: Sequence[Dimension], sign: float) -> bool:
    """Whether a file is accepted in which these numbers are somewhat greater, or less for a sign of -1."""
    values = {}
    for index, each in enumerate(dimensions):
        size = abs(each.value) or (design.solver.unit if each.kind == "length" else 1.0)
        values[each.name] = each.value + sign * NUDGE * (1.0 + index * GOLDEN_FRACTION % 1.0) * size
    try:
        with_values(design.mechanism, values)
    except BadInput:
        return False
    return True
