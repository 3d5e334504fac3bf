"""A linkage of turning pairs as rigid bodies or as pins and distances, which is how other solvers want it told."""

from __future__ import annotations

from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

import planar

Array = np.ndarray


class Joint(NamedTuple):
    """Two bodies that share a pin, and where it is in each."""

    first: str
    second: str
    at_first: tuple[float, float]
    at_second: tuple[float, float]


class Bodies(NamedTuple):
    """`places` (x, y, angle) of every body but the frame, at the file's position; `pins` of the plane there."""

    frame: str
    places: dict[str, tuple[float, float, float]]
    joints: tuple[Joint, ...]
    driven: int
    """The joint that is the input, between the frame and the crank."""
    pins: dict[str, tuple[float, float]]
    fixed: frozenset[str]
    distances: tuple[tuple[str, str, float], ...]
    points: dict[str, tuple[str, tuple[float, float]]]
    """A body that carries each point, and where."""
    crank: tuple[str, str, float]
    """The crank's fixed pin, its moving pin, and its length (m)."""


def bodies(document: dict[str, Any]) -> Bodies:
    """The mechanism file of a linkage of turning pairs, one of them an input at a fixed pin with the angle of a bar."""
    mechanism = planar.from_dict(document)
    state = planar.solve(mechanism)
    frame = document["frame"]
    links = {link.name: link for link in mechanism.links}
    local = {name: {p: _two(state.shapes[name].position(p)) for p in link.names} for name, link in links.items()}
    places = {name: _place(state, name, local[name]) for name in links if name != frame}
    holders = {
        pin: [name for name in links if pin in local[name]] for entry in document["pairs"] for pin in entry.values()
    }
    joints = tuple(
        Joint(first, second, local[first][pin], local[second][pin]) for pin, (first, second) in holders.items()
    )
    driven = document["inputs"][0]["pair"]
    crank = next(name for name in holders[driven] if name != frame)
    end = next(pin for pin in local[crank] if pin != driven)
    return Bodies(
        frame,
        places,
        joints,
        list(holders).index(driven),
        {pin: tuple(state.point(pin).position) for pin in holders},
        frozenset(local[frame]),
        tuple(
            (first, second, float(np.hypot(*np.subtract(local[name][first], local[name][second]))))
            for name in links
            if name not in (frame, crank)
            for first, second in combinations(local[name], 2)
        ),
        {pin: (held[-1], local[held[-1]][pin]) for pin, held in holders.items()}
        | {p: (name, at) for name in places for p, at in local[name].items() if p not in holders},
        (driven, end, float(np.hypot(*np.subtract(local[crank][end], local[crank][driven])))),
    )


def _place(state: Any, name: str, local: dict[str, tuple[float, float]]) -> tuple[float, float, float]:
    """The body's own axes, whose origin need not be one of its points."""
    point, (x, y) = next(iter(local.items()))
    angle = float(state.link(name).angle)
    at = state.point(point).position
    return (
        float(at[0] - np.cos(angle) * x + np.sin(angle) * y),
        float(at[1] - np.sin(angle) * x - np.cos(angle) * y),
        angle,
    )


def _two(at: Any) -> tuple[float, float]:
    return float(at.x), float(at.y)
