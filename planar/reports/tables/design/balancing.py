"""Balancing as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.dynamics.balancing.balance import OBJECTIVES, Balance, BalanceTradeoff
from planar.dynamics.balancing.conditions import BalanceCondition, BalancingConditions, ConditionSet, ConditionTerm
from planar.dynamics.balancing.cone_program import NEEDS_SOLVER
from planar.dynamics.balancing.counterweights import Counterweight
from planar.dynamics.balancing.force_balance import ForceBalance
from planar.dynamics.balancing.mass_parameters import QUANTITIES, QUANTITY_POWERS
from planar.dynamics.balancing.positive_masses import MassBalance
from planar.equations.mechanism_numbers import mechanism_size
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, display_unit
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import (
    AMONG_POSITIONS,
    column_heading,
    format_quantity,
    paragraphs,
    precision_text,
    quantity_text,
)

POWERS = dict(zip(QUANTITIES, (int(power) for power in QUANTITY_POWERS), strict=True))
ROUNDING = 1e-12
"""Of the greatest force at the linkage's size: a moment or torque that is less is rounding."""
NEGLIGIBLE = 1e-8
"""Of what it was before: what is less is shown as none."""
OBJECTIVE_KINDS = {"shaking force": "force", "shaking moment": "torque", "peak torque": "torque"}


class Undecided(NamedTuple):
    """Of one kind of conditions it is not told whether bodies meet them, and why."""

    kind: str
    reason: str


class BalanceReport(NamedTuple):
    """What there is to say of a linkage: its conditions, whether bodies meet them, and of its own masses, where it has
    some, what complete balance needs, the best counterweights, and the tradeoff where it is asked for."""

    conditions: BalancingConditions
    possible: tuple[MassBalance | Undecided, ...] = ()
    complete: ForceBalance | None = None
    best: Balance | None = None
    tradeoff: BalanceTradeoff | None = None


def balance_tables(found: BalanceReport) -> RenderableType:
    """All of it, in the units of the file."""
    mechanism = found.conditions.mechanism
    units = mechanism.units
    parts: list[RenderableType] = [Text(mechanism.name, style="bold")]
    parts += [Text(), paragraphs(_condition_facts(found, units))]
    if found.complete is not None:
        parts += [Text(), paragraphs(_complete_facts(found.complete, units))]
        if found.complete.counterweights:
            parts.append(
                _counterweight_table("Counterweights of complete force balance", found.complete.counterweights, units)
            )
    if found.best is not None:
        parts += [Text(), _shaking_table(found.best, units), paragraphs(_best_facts(found.best, units))]
        if found.best.counterweights:
            parts.append(_counterweight_table(f"Counterweights{AMONG_POSITIONS}", found.best.counterweights, units))
    if found.tradeoff is not None:
        parts += [Text(), _tradeoff_table(found.tradeoff, units)]
    return Group(*parts)


def condition_text(condition: Sequence[ConditionTerm], units: FileUnits) -> str:
    """A sum of mass parameters, its coefficients with their unit of length."""
    of = parse_unit(units.length)
    first = POWERS[condition[0].quantity]
    parts = []
    for number, term in enumerate(condition):
        power = first - POWERS[term.quantity]
        size = abs(term.coefficient) * of.from_si(1.0) ** power
        unit = "" if not power else f" {units.length}" + ("" if power == 1 else f"^{power}")
        sense = "−" if term.coefficient < 0.0 else "+" if number else ""
        factor = "" if abs(size - 1.0) < 1e-9 and not power else f"{size:.6g}{unit} · "
        parts.append(f"{sense} {factor}{term.quantity}({term.link})".strip())
    return " ".join(parts)


def _condition_facts(found: BalanceReport, units: FileUnits) -> Iterator[tuple[str, str]]:
    conditions = found.conditions
    for kind, each in (("force", conditions.force), ("moment", conditions.moment), ("both", conditions.both)):
        about = {
            "force": "no shaking force",
            "moment": f"no moment about {conditions.about_name}",
            "both": "neither of both",
        }
        sure = "" if each.is_certain else "; a further one is not sure"
        count = f"{each.count} condition{'s' * (each.count != 1)} at any speed{sure}"
        yield about[kind], count
        if kind == "force":
            for line in _each_condition(each, conditions, units):
                yield "", line
    for axes in conditions.axes:
        yield "axes" if axes is conditions.axes[0] else "", f"{axes.link}: {axes.description}"
    if conditions.free_masses:
        told = ", ".join(conditions.free_masses)
        yield "on pivots", f"{told}: mass times distance counts, not the mass alone"
    if conditions.idle_links:
        told = ", ".join(conditions.idle_links)
        yield "do not turn", f"{told}: for the force the mass alone counts, wherever it is centred"
    for possible in found.possible:
        yield from _possible_facts(possible, units)
    if not found.possible:
        yield "not told", NEEDS_SOLVER


def _each_condition(of: ConditionSet, conditions: BalancingConditions, units: FileUnits) -> Iterator[str]:
    for each in of.conditions:
        now = "" if conditions.is_massless else f"  (now {_moment_text(each.value, each, units)})"
        yield f"{condition_text(each.terms, units)} = 0{now}"


def _moment_text(value: float, condition: BalanceCondition, units: FileUnits) -> str:
    power = POWERS[condition.terms[0].quantity]
    name, of = display_unit("mass", units)
    length = parse_unit(units.length)
    unit = name + ("" if not power else f" {units.length}" + ("" if power == 1 else f"^{power}"))
    return f"{of.from_si(value) * length.from_si(1.0) ** power:.6g} {unit}"


def _possible_facts(found: MassBalance | Undecided, units: FileUnits) -> Iterator[tuple[str, str]]:
    what = {"shaking force": "the force", "shaking moment": "the moment", "both": "both"}[found.kind]
    if isinstance(found, Undecided):
        yield f"can bodies balance {what}", f"not told: {found.reason}"
        return
    if found.is_possible:
        yield f"can bodies balance {what}", "yes, with mass on every link"
        return
    told = "no: for any bodies this sum is above zero, and balance wants it to be zero"
    yield f"can bodies balance {what}", told
    first = next((term for term in found.certificate if term.quantity == "I"), found.certificate[0])
    terms = [term._replace(coefficient=term.coefficient / abs(first.coefficient)) for term in found.certificate]
    terms.sort(key=lambda term: (term.link, term.quantity) != (first.link, first.quantity))
    yield "", condition_text(terms, units)


def _complete_facts(found: ForceBalance, units: FileUnits) -> Iterator[tuple[str, str]]:
    if found.is_possible and not found.counterweights:
        yield "complete balance", "its force is balanced as it is"
    elif not found.is_possible:
        yield "complete balance", "counterweights on these links cannot balance the force"
        for each in found.unmet:
            yield "", f"not met by them: {condition_text(each.terms, units)} = 0"


def _counterweight_table(title: str, weights: Iterable[Counterweight], units: FileUnits) -> FittedTable:
    length, mass = units.length, display_unit("mass", units)[0]
    table = plain_table(
        title,
        "link",
        column_heading("mass", "mass", units),
        column_heading("radius", "length", units),
        f"mass by radius, {mass} {length}",
        column_heading("angle", "angle", units),
        column_heading("inertia", "moment of inertia", units),
        left=(0,),
        keys=1,
    )
    for each in weights:
        table.add_row(
            each.link,
            format_quantity(each.mass, "mass", units),
            format_quantity(each.radius, "length", units),
            f"{display_unit('mass', units)[1].from_si(each.mass) * parse_unit(length).from_si(each.radius):.6g}",
            format_quantity(each.angle, "angle", units),
            format_quantity(each.inertia, "moment of inertia", units),
        )
    return table


def _shaking_table(found: Balance, units: FileUnits) -> FittedTable:
    table = plain_table(
        f"Shaking{AMONG_POSITIONS}", "", ("before", "after"), ("root mean square before", "after"), left=(0,), keys=1
    )
    names = {"shaking moment": f"shaking moment about {found.about_name}", "peak torque": f"effort of {found.input}"}
    slides = found.motion.has_length_motion(found.input)
    arm = mechanism_size(found.motion.mechanism, found.motion.shapes)
    rounding = ROUNDING / NEGLIGIBLE * found.before.measured("shaking force") * arm
    for objective in OBJECTIVES:
        kind = "force" if slides and objective == "peak torque" else OBJECTIVE_KINDS[objective]
        cells = [
            _beside(part.measured(objective, measure), max(found.before.measured(objective), rounding), kind, units)
            for measure in ("greatest", "root mean square")
            for part in (found.before, found.after)
        ]
        table.add_row(names.get(objective, objective), *cells)
    return table


def _best_facts(found: Balance, units: FileUnits) -> Iterator[tuple[str, str]]:
    slides = found.motion.has_length_motion(found.input)
    kind = "force" if slides and found.minimised == "peak torque" else OBJECTIVE_KINDS[found.minimised]
    value, bound = (_beside(each, found.value_before, kind, units) for each in (found.value, found.bound))
    borne = ", ".join(found.links)
    yield "least", f"{found.measure} {found.minimised}{AMONG_POSITIONS}: {value}, by counterweights on {borne}"
    if found.is_searched:
        yield "", f"the best discs of a search{AMONG_POSITIONS}; none within the limits go below {bound}"
    else:
        yield "", f"none within the limits go below {bound}{AMONG_POSITIONS}"
    if not found.counterweights:
        yield "", "no counterweight within the limits makes it less"
    if found.frame_error is not None:
        told = precision_text(found.frame_error, "of the greatest")
        yield "frame", f"reactions computed afresh put on it what is told here {told}"


def _beside(value: float, before: float, kind: str, units: FileUnits) -> str:
    """A quantity, none where the slack with which the lightest counterweights are looked for is all of it."""
    return quantity_text(value if value > NEGLIGIBLE * before else 0.0, kind, units)


def _tradeoff_table(found: BalanceTradeoff, units: FileUnits) -> FittedTable:
    table = plain_table(
        f"Shaking moment beside shaking force, about {found.about_name}{AMONG_POSITIONS}",
        column_heading("force", "force", units),
        column_heading("moment", "torque", units),
        column_heading("bound", "torque", units),
        left=(),
        keys=1,
    )
    for force, moment, bound in zip(found.force, found.moment, found.moment_bound, strict=True):
        cells = [format_quantity(float(force), "force", units, found.before[0])]
        cells += [format_quantity(float(each), "torque", units, found.before[1]) for each in (moment, bound)]
        table.add_row(*cells)
    return table


def record(found: BalanceReport) -> dict[str, Any]:
    """The same as a JSON value (SI)."""
    conditions = found.conditions
    told: dict[str, Any] = {
        "mechanism": conditions.mechanism.name,
        "about": {"point": conditions.about_name, "position": conditions.about.tolist()},
        "axes": {each.link: each.description for each in conditions.axes},
        "conditions": {
            "force": _set_record(conditions.force),
            "moment": _set_record(conditions.moment),
            "both": _set_record(conditions.both),
        },
        "free_masses": list(conditions.free_masses),
        "possible": {each.kind: _possible_record(each) for each in found.possible},
    }
    if found.complete is not None:
        told["complete_force_balance"] = {
            "possible": found.complete.is_possible,
            "counterweights": [each._asdict() for each in found.complete.counterweights],
            "unmet": [str(each) for each in found.complete.unmet],
        }
    if found.best is not None:
        told["best"] = _best_record(found.best)
    if found.tradeoff is not None:
        told["tradeoff"] = {
            "force": found.tradeoff.force.tolist(),
            "moment": found.tradeoff.moment.tolist(),
            "moment_bound": found.tradeoff.moment_bound.tolist(),
            "counterweights": [[each._asdict() for each in of] for of in found.tradeoff.counterweights],
        }
    return told


def _set_record(found: ConditionSet) -> dict[str, Any]:
    return {
        "count": found.count,
        "certain": found.is_certain,
        "error_bound": found.error_bound,
        "singular_values": found.singular_values.tolist(),
        "conditions": [
            {"terms": [term._asdict() for term in each.terms], "value": each.value} for each in found.conditions
        ],
    }


def _possible_record(found: MassBalance | Undecided) -> dict[str, Any]:
    if isinstance(found, Undecided):
        return {"possible": None, "reason": found.reason}
    return {
        "possible": found.is_possible,
        "margin": found.margin if np.isfinite(found.margin) else None,
        "masses": [
            {"link": each.link, "mass": each.mass, "at": list(each.at), "inertia": each.inertia}
            for each in found.masses
        ],
        "certificate": [term._asdict() for term in found.certificate],
        "error": found.error,
    }


def _best_record(found: Balance) -> dict[str, Any]:
    def values(array: np.ndarray) -> list[Any]:
        nested: list[Any] = [(None if not np.all(np.isfinite(each)) else each.tolist()) for each in np.asarray(array)]
        return nested

    return {
        "minimised": found.minimised,
        "measure": found.measure,
        "before": found.value_before,
        "after": found.value,
        "bound": found.bound,
        "searched": found.is_searched,
        "counterweights": [each._asdict() for each in found.counterweights],
        "frame_error": found.frame_error,
        "input": {"pair": found.input, "position": found.motion.inputs[found.input].position.tolist()},
        "shaking": {
            name: {key: values(value) for key, value in getattr(found, name)._asdict().items()}
            for name in ("before", "after")
        },
    }
