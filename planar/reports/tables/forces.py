"""The forces at a position, as tables for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.worked.published import Comparison
from planar.dynamics.forces import Forces
from planar.dynamics.load_attachment import choices
from planar.dynamics.reactions import Reaction
from planar.equations.functions import size
from planar.foundation.errors import Outcome
from planar.foundation.units import shown
from planar.model.link_graph import number_and_name, numbered
from planar.model.mechanism import motions
from planar.model.wording import amount, listed
from planar.reports.fitted_table import FittedTable
from planar.reports.tables import loads
from planar.reports.tables import mechanical_advantage as ratios
from planar.reports.tables_of_numbers import (
    ROUNDING,
    counted,
    kept,
    paragraphs,
    plain_table,
    published,
)


def tables(forces: Forces, advantages: ratios.Advantages, comparisons: Sequence[Comparison] = ()) -> RenderableType:
    """Inputs, what acts, reactions, power, mechanical advantages, and the published torques beside the solved ones."""
    state, units = forces.moving, forces.mechanism.units
    head = [Text(forces.mechanism.name, style="bold")]
    if forces.mechanism.source:
        head.append(Text(forces.mechanism.source, style="italic"))
    parts: list[RenderableType] = [Text(balanced(forces)), Text()]
    if forces.inputs:
        parts.append(_inputs(forces))
    acting, inertia = loads.moved(forces, inertia=False), loads.moved(forces, inertia=True)
    if acting:
        parts.append(loads.acting_table("Loads", acting, units, greatest(forces)[0]))
    if inertia:
        parts.append(loads.acting_table("Inertia", inertia, units, greatest(forces)[0]))
    most = sum(each.most for each in (*acting, *inertia))
    parts += [_reactions(forces), paragraphs(_sums(forces, most)), Text()]
    told = ratios.each_of(advantages)
    if told:
        parts.append(ratios.advantages_table(told))
    if any(each.through for each in told):
        links = listed([number_and_name(number, link) for link, number in numbered(forces.mechanism).items()])
        parts += [paragraphs([("links", links)]), Text()]
    if comparisons:
        parts += [published(comparisons, units), Text()]
    parts.append(paragraphs(proved(forces)))
    notes = (*undetermined(forces), *_time(forces), *dict.fromkeys(each.why for each in told if each.why))
    notes += (*choices(forces.mechanism), *state.remarks)
    if notes:
        parts += [Text(), paragraphs(("-", sentence) for sentence in notes)]
    return Group(*head, *parts)


def balanced(forces: Forces) -> str:
    """What the equilibrium takes account of, and what is left out."""
    kinds = {each.kind for each in forces.acting}
    there = [kind for kind in ("inertia", "weight") if kind in kinds]
    absent = [name for name in ("inertia", "weight", "friction") if name not in there]
    return f"in equilibrium {f'with {listed(there)}, ' if there else ''}without {listed(absent)}"


def accelerated(forces: Forces) -> bool:
    """Whether the links' inertia is taken account of."""
    return any(each.kind == "inertia" for each in forces.acting)


def measure(forces: Forces, name: str) -> tuple[str, str]:
    """What an input's effort is called, and its kind of quantity as it is printed."""
    return ("force", "N") if forces.slides(name) else ("torque", "N·m")


def greatest(forces: Forces) -> tuple[float, float]:
    """The greatest moment (N m) and the greatest force (N) of all that acts and all pairs: what rounding is beside."""
    exerted = [(each.force, each.couple) for each in (*forces.acting, *forces.reactions.values())]
    exerted += [(np.zeros(2), couple) for each in forces.reactions.values() for couple in each.couples.values()]
    force, couple = (max((_most(each[part]) for each in exerted), default=0.0) for part in (0, 1))
    return max(couple, force * size(forces.mechanism, forces.moving.shapes)), force


def _most(values: np.ndarray | float) -> float:
    return float(np.max(np.abs(np.nan_to_num(values)), initial=0.0))


def _inputs(forces: Forces) -> FittedTable:
    mechanism, given = forces.mechanism, forces.moving.inputs
    named, most = motions(mechanism), greatest(forces)
    table = plain_table("Inputs", "input", ("effort", "unit"), "position", "rate", "power, W", left=(0, 2))
    for name, effort in forces.inputs.items():
        kind, rate_kind, _ = named[name].driven()
        rate, of = shown(rate_kind, mechanism.units)
        table.add_row(
            name,
            counted(effort, most[forces.slides(name)]),
            measure(forces, name)[1],
            amount(given[name].position, kind, mechanism.units),
            f"{counted(of.from_si(given[name].velocity))} {rate}",
            counted(forces.powers[name], most[forces.slides(name)] * given[name].velocity),
        )
    return table


def _reactions(forces: Forces) -> FittedTable:
    degree, (moment, most) = forces.mechanism.units.angle, greatest(forces)
    headings = ("pair", "on", "by", ("force, N", f"at, {degree}"), ("x, N", "y, N"), "couple, N·m")
    table = plain_table("Reactions in the pairs", *headings, left=(0, 1, 2), keys=3)
    for name, reaction in forces.reactions.items():
        first, second = reaction.links
        if reaction.at is not None:
            parts = (counted(float(each), most) for each in reaction.force)
            arrow = loads.arrow(reaction.force, degree, most)
            table.add_row(name, second, first, *arrow, *parts, counted(float(reaction.couple), moment))
        for link, couple in reaction.couples.items():
            table.add_row(name, link, "", "-", "-", "-", "-", counted(float(couple), moment))
    return table


def _sums(forces: Forces, most: float) -> Iterator[tuple[str, str]]:
    """Power, beside the most that all could have, and what the frame feels of the links' inertia."""
    yield "power", _power(forces, most)
    if accelerated(forces):
        degree = forces.mechanism.units.angle
        force, moment = forces.shaking
        strength, way = loads.arrow(force, degree)
        turned = f" at {way} {degree}" if way else ""
        moved = counted(float(moment), greatest(forces)[0])
        yield "shaking", f"{strength} N{turned} and {moved} N·m about the frame's origin, on the frame"


def _power(forces: Forces, most: float) -> str:
    supplied, taken = forces.power_in, forces.power_out
    stored = sum(each.power for each in forces.acting if each.kind == "inertia")
    if not np.isfinite(supplied):
        return "not determined, as what the inputs supply is not"
    if forces.proof.power is None:
        return "nothing that is loaded moves at the inputs' speeds, so that there is none"
    if accelerated(forces):
        parts = ((supplied, "from the inputs"), (-taken, "from the loads"), (stored, "from the links' inertia"))
        return ", ".join(f"{counted(value, most)} W {source}" for value, source in parts)
    if supplied < -ROUNDING * most:
        given, absorbed = counted(-taken, most), counted(-supplied, most)
        return f"the loads drive: {given} W from the loads, {absorbed} W taken up by the inputs"
    return f"in: {counted(supplied, most)} W from the inputs; out: {counted(taken, most)} W against the loads"


def proved(forces: Forces) -> list[tuple[str, str]]:
    """How well laws are kept."""
    proof, told = forces.proof, []
    if proof.power is not None:
        told.append(f"all powers add up to nothing, {kept(proof.power, 'of the greatest')}")
    if proof.routes is not None:
        told.append(
            "the efforts are those by virtual power with each input alone at unit rate, "
            f"{kept(proof.routes, 'of what all that acts could ask for')}"
        )
    if proof.equilibrium is not None:
        told.append(f"{_which(forces)}, {kept(proof.equilibrium, 'of the greatest force')}")
    if not told:
        told.append("none: of no link all is told" if forces.undetermined else "none: nothing acts on what moves")
    return [("" if index else "proof", each) for index, each in enumerate(told)]


def _which(forces: Forces) -> str:
    told, moving = len(forces.bodies), len(forces.mechanism.links) - 1
    if told == moving:
        return "every link balances as a free body"
    return f"as free bodies {told} of {moving} links balance, the others feel what is not determined"


def undetermined(forces: Forces) -> tuple[str, ...]:
    """What equilibrium does not tell, with why; what has the same reason together."""
    by: dict[str, list[str]] = {}
    for name, why in forces.undetermined.items():
        by.setdefault(why, []).append(name)
    return tuple(f"not determined at {listed(names)}: {why}" for why, names in by.items())


def _time(forces: Forces) -> tuple[str, ...]:
    varying = any(load.varies is not None and load.varies.input is None for load in forces.mechanism.loads)
    return ("loads that vary with time are those at 0 s",) if varying else ()


def record(forces: Forces, advantages: ratios.Advantages, comparisons: Sequence[Comparison] = ()) -> dict[str, Any]:
    """All of it as a JSON value (SI); null for what is not determined."""
    given = forces.moving.inputs
    force, moment = forces.shaking
    found: dict[str, Any] = {
        "mechanism": forces.mechanism.name,
        "outcome": Outcome.SOLVED.value,
        "links": dict(numbered(forces.mechanism)),
        "inputs": {
            name: {measure(forces, name)[0]: _known(effort)}
            | {"position": given[name].position, "velocity": given[name].velocity}
            | {"power": _known(forces.powers[name])}
            for name, effort in forces.inputs.items()
        },
        "loads": loads.record(loads.moved(forces, inertia=False)),
        "inertia": loads.record(loads.moved(forces, inertia=True)),
        "reactions": {name: _reaction(each) for name, each in forces.reactions.items()},
        **({"shaking": {"force": force.tolist(), "moment": float(moment)}} if accelerated(forces) else {}),
        "power": {"in": _known(forces.power_in), "out": forces.power_out},
        "advantage": ratios.record(advantages),
        **said(forces),
        "remarks": [*choices(forces.mechanism), *forces.moving.remarks],
    }
    return found | ({"published": [each.record() for each in comparisons]} if comparisons else {})


def said(forces: Forces) -> dict[str, Any]:
    """What is said of all forces together, as JSON values."""
    return {
        "undetermined": dict(forces.undetermined),
        "proof": forces.proof._asdict(),
        "bodies": list(forces.bodies),
    }


def _reaction(reaction: Reaction) -> dict[str, Any]:
    """What the pair does to the second of its links; where its forces have no place, its couple on every link."""
    if reaction.at is None:
        return {"links": list(reaction.links)} | {
            "couples": {link: _known(float(couple)) for link, couple in reaction.couples.items()}
        }
    return {
        "links": list(reaction.links),
        "position": reaction.at.tolist(),
        "force": [_known(each) for each in reaction.force.tolist()],
        "couple": _known(float(reaction.couple)),
    }


def _known(value: float) -> float | None:
    return value if np.isfinite(value) else None
