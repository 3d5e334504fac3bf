"""What inputs supply against loads, as tables for a terminal, and as JSON values."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from planar.analysis.advantage import Advantage
from planar.analysis.forces import Forces, Loaded
from planar.analysis.published import Comparison
from planar.errors import Outcome
from planar.graph import numbered
from planar.mechanism import Mechanism, motions, named_points
from planar.units import SI, unit
from planar.views.table import DIGITS, paragraphs, plain_table, published
from planar.words import amount, listed

Advantages = Mapping[str, Mapping[str, Advantage]]
ROUNDING = 1e-12
"""A component below this part of a vector is printed as 0."""
MEASURES = {"1/m": "N per N·m", "m": "N·m per N", "1": "1"}
"""How an advantage's unit is printed."""


def tables(forces: Forces, advantages: Advantages, comparisons: Sequence[Comparison] = ()) -> RenderableType:
    """Inputs, loads, power, mechanical advantages, and the published torques beside the solved ones."""
    state = forces.state
    head = [Text(state.mechanism.name, style="bold")]
    if state.mechanism.source:
        head.append(Text(state.mechanism.source, style="italic"))
    head += [Text("in equilibrium without inertia, weight and friction"), Text()]
    parts: list[RenderableType] = [_inputs(forces), _loads(forces), paragraphs([("power", _power(forces))]), Text()]
    ratios = [each for row in advantages.values() for each in row.values()]
    if ratios:
        parts.append(_advantages(ratios))
    if any(each.through for each in ratios):
        links = listed([f"{number} {link}" for link, number in numbered(state.mechanism).items()])
        parts += [paragraphs([("links", links)]), Text()]
    if comparisons:
        parts += [published(comparisons), Text()]
    parts.append(paragraphs(_proof(forces)))
    notes = (*dict.fromkeys(each.why for each in ratios if each.why), *state.remarks)
    if notes:
        parts += [Text(), paragraphs(("-", sentence) for sentence in notes)]
    return Group(*head, *parts)


def where_to_write(mechanism: Mechanism) -> str:
    """That a file has no loads, and how they are written, with names of its own."""
    frame = mechanism.frame
    moving = [each.name for each in named_points(mechanism) if frame not in (link for link, _ in each.members)]
    links = [link.name for link in mechanism.links if link.name != frame]
    one = {"point": moving[-1], "force": [-100, 0]} if moving else {}
    if not moving and links:
        one = {"link": links[-1], "torque": 10}
    example = f'"loads": [{json.dumps(one, ensure_ascii=False)}]'
    return f"the mechanism has no loads; write forces (N) at points or torques (N m) on links as {example} in its file"


def _inputs(forces: Forces) -> Table:
    state = forces.state
    named, units = motions(state.mechanism), state.mechanism.units
    table = plain_table("Inputs", "input", "effort", "unit", "position", "rate", "power, W", left=(0, 2))
    for name, effort in forces.inputs.items():
        given, (kind, rate_kind, _) = state.inputs[name], named[name].driven()
        table.add_row(
            name,
            _number(effort),
            "N" if forces.slides(name) else "N·m",
            amount(given.position, kind, units),
            f"{_number(given.velocity)} {SI[rate_kind]}",
            _number(forces.powers[name]),
        )
    return table


def _loads(forces: Forces) -> Table:
    degree = forces.state.mechanism.units.angle
    headings = ("on", "force, N", f"at, {degree}", "torque, N·m", "velocity, m/s", f"at, {degree}")
    table = plain_table("Loads", *headings, "ang. velocity, rad/s", "power, W")
    for each in forces.loads:
        table.add_row(
            _on(each),
            *_arrow(each.load.force, degree),
            _number(each.load.torque),
            *_arrow(each.velocity, degree),
            _number(each.angular_velocity),
            _number(each.power),
        )
    return table


def _on(loaded: Loaded) -> str:
    return " and ".join(name for name in (loaded.load.point, loaded.load.link) if name is not None)


def _advantages(ratios: Sequence[Advantage]) -> Table:
    headings = ("output", "for the input", "by power", "by centres", "unit", "through")
    table = plain_table("Mechanical advantage", *headings, left=(0, 1, 4, 5))
    for each in ratios:
        values = _number(each.by_power), _number(each.by_centres)
        table.add_row(each.output, each.input, *values, MEASURES[each.measure], " ".join(each.through))
    return table


def _power(forces: Forces) -> str:
    if forces.proof.power is None:
        return "nothing that is loaded moves at the inputs' speeds, so that there is none"
    if forces.power_in < 0.0:
        given, taken = _number(-forces.power_out), _number(-forces.power_in)
        return f"the loads drive: {given} W from the loads, {taken} W taken up by the inputs"
    return f"in: {_number(forces.power_in)} W from the inputs; out: {_number(forces.power_out)} W against the loads"


def _proof(forces: Forces) -> list[tuple[str, str]]:
    proof = forces.proof
    told: list[str] = []
    if proof.power is not None:
        told.append(f"the powers of inputs and loads balance, but for {proof.power:.1e} of what the loads could have")
    if proof.routes is not None:
        told.append(
            "the efforts are those in the equilibrium of all links, with unknown forces in all pairs, "
            f"but for {proof.routes:.1e} of the loads"
        )
        told.append(f"and the links are in equilibrium, but for {proof.equilibrium:.1e} of the greatest force")
    if not told:
        told.append("none: nothing that is loaded moves, and the equilibrium of all links is not determined")
    return [("" if index else "proof", each) for index, each in enumerate(told)]


def _arrow(vector: Sequence[float] | np.ndarray | None, degree: str) -> tuple[str, str]:
    """A vector's magnitude and direction."""
    if vector is None:
        return "-", "-"
    size = float(np.hypot(*vector))
    x, y = (float(part) if abs(part) > ROUNDING * size else 0.0 for part in vector)
    return _number(size), _number(unit(degree).from_si(float(np.arctan2(y, x)))) if size else ""


def _number(value: float | None) -> str:
    return "-" if value is None else f"{value + 0.0:#.{DIGITS}g}".rstrip(".") if value else "0"


def record(forces: Forces, advantages: Advantages, comparisons: Sequence[Comparison] = ()) -> dict[str, Any]:
    """All of it as a JSON value (SI)."""
    state = forces.state
    found: dict[str, Any] = {
        "mechanism": state.mechanism.name,
        "outcome": Outcome.SOLVED.value,
        "links": dict(numbered(state.mechanism)),
        "inputs": {
            name: {"force" if forces.slides(name) else "torque": effort}
            | {"position": state.inputs[name].position, "velocity": state.inputs[name].velocity}
            | {"power": forces.powers[name]}
            for name, effort in forces.inputs.items()
        },
        "loads": [_load(each) for each in forces.loads],
        "power": {"in": forces.power_in, "out": forces.power_out},
        "advantage": {
            output: {
                name: {
                    "by_power": each.by_power,
                    "by_centres": each.by_centres,
                    "unit": each.measure,
                    "through": list(each.through),
                    "why": each.why,
                }
                for name, each in row.items()
            }
            for output, row in advantages.items()
        },
        "proof": forces.proof._asdict(),
        "remarks": list(state.remarks),
    }
    return found | ({"published": [each.record() for each in comparisons]} if comparisons else {})


def _load(loaded: Loaded) -> dict[str, Any]:
    """A load with the motion of what it acts on; only what it has."""
    load = loaded.load
    found = {
        "point": load.point,
        "force": None if load.force is None else list(load.force),
        "position": None if loaded.position is None else loaded.position.tolist(),
        "velocity": None if loaded.velocity is None else loaded.velocity.tolist(),
        "link": load.link,
        "torque": load.torque,
        "angular_velocity": loaded.angular_velocity,
        "power": loaded.power,
    }
    return {name: value for name, value in found.items() if value is not None}
