"""Solved values beside those that a book prints."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from planar.foundation.arrays import Array
from planar.model.mechanism import Drive, PublishedValue
from planar.model.wording import direction_sense, join_all_names, turning_sense
from planar.results.motion import State
from planar.solving.position import solve


@dataclass(frozen=True)
class Comparison:
    """One published quantity: its solved value (SI), its sense, and what comes of laying the two side by side.

    `apart` is (printed - solved) / solved, None where nothing is printed or the solved value is zero.
    """

    published: PublishedValue
    solved: float
    sense: str
    relative_difference: float | None
    verdict: str

    @property
    def about(self) -> str:
        """What the value is of, in words."""
        item = self.published
        text = f"{item.component + ' of ' if item.component else ''}{item.quantity} of {item.of}"
        text += f" relative to {item.relative_to}" if item.relative_to else ""
        changed = [drive.pair for drive in item.inputs]
        return f"{text} (other input at {join_all_names(changed)})" if changed else text

    def record(self) -> dict[str, Any]:
        """It as a JSON value (SI)."""
        return {
            "symbol": self.published.symbol,
            "quantity": self.published.quantity,
            "of": self.published.of,
            "solved": self.solved,
            "published": self.published.value,
            "verdict": self.verdict,
            "slip": self.published.slip,
        }


def compare_published(state: State) -> tuple[Comparison, ...]:
    """Every quantity that the mechanism's file says was published, with its solved value."""
    known: dict[tuple[Drive, ...], State] = {(): state}

    def at(drives: tuple[Drive, ...]) -> State:
        if drives not in known:
            known[drives] = solve(state.mechanism, drives)
        return known[drives]

    return tuple(_compare(item, at(item.inputs), at(item.start)) for item in state.mechanism.published)


def compare_value(item: PublishedValue, state: State) -> Comparison:
    """One value beside that of a position."""
    return _compare(item, state, state)


def _compare(item: PublishedValue, state: State, start: State) -> Comparison:
    value = _solved_value(item, state, start)
    solved, sense = (value, _turning_sense(item, value)) if isinstance(value, float) else _size_and_sense(item, value)
    if item.value is None:
        return Comparison(item, solved, sense, None, "not printed")
    printed = item.value if item.component is not None else abs(item.value)
    reference = solved if item.component is not None else abs(solved)
    apart = (printed - reference) / reference if reference else None
    if item.slip is not None:
        verdict = "slip in the book"
    elif abs(printed - reference) > item.tolerance * abs(reference):
        verdict = "differs"
    elif item.sense is not None and item.sense not in sense.split(", "):
        verdict = "sense differs"
    else:
        verdict = "agrees"
    return Comparison(item, solved, sense, apart, verdict)


def _turning_sense(item: PublishedValue, value: float) -> str:
    if not item.quantity.startswith("angular"):
        return ""
    return "none" if item.quantity == "angular acceleration" and not value else turning_sense(value)


def _size_and_sense(item: PublishedValue, value: Array) -> tuple[float, str]:
    """The magnitude of a vector, or its component where one is asked for, with its sense."""
    sense = "none" if item.quantity != "velocity" and not value.any() else direction_sense(value)
    if item.component is not None:
        return float(value["xy".index(item.component)]), sense
    return float(np.hypot(*value)), sense


def _solved_value(item: PublishedValue, state: State, start: State) -> float | Array:
    if item.quantity in ("angular velocity", "angular acceleration"):
        return _angular_value(item, state)
    of_pair = {
        "rubbing speed": "rubbing_speed",
        "displacement": "displacement",
        "sliding velocity": "velocity",
        "sliding acceleration": "acceleration",
    }
    if item.quantity in of_pair:
        return float(state.pair(item.of)[of_pair[item.quantity]] or 0.0)
    if item.quantity == "input torque":
        from planar.dynamics.forces import forces  # few examples have loads

        return float(forces(state).inputs[item.of])
    if item.relative_to is not None:
        relative = state.relative(item.of, item.relative_to)
        return {
            "position": relative.position,
            "velocity": relative.velocity,
            "acceleration": relative.acceleration,
            "centripetal acceleration": relative.centripetal,
            "tangential acceleration": relative.tangential,
            "Coriolis acceleration": relative.coriolis,
        }[item.quantity]
    point = state.point(item.of)
    if item.quantity == "position":
        return point.position - start.point(item.of).position if item.start else point.position
    return {"velocity": point.velocity, "acceleration": point.acceleration}[item.quantity]


def _angular_value(item: PublishedValue, state: State) -> float:
    link = state.link(item.of)
    return link.angular_velocity if item.quantity == "angular velocity" else link.angular_acceleration
