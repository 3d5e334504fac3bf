"""Every way to solve every linkage: seconds a position, and the greatest error against the closed form."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from benchmarks.linkages import Linkage
from benchmarks.timing import best
from benchmarks.ways import Trial, trials
from benchmarks.ways.closed_form import FLOATS, reference

Array = np.ndarray


@dataclass(frozen=True)
class Row:
    """Seconds a position, the same in times of the closed form on floats, and the greatest error (see `error`)."""

    way: str
    rates: bool
    seconds: float
    ratio: float
    error: float


def compare(linkage: Linkage) -> tuple[Row, ...]:
    """All ways to solve a linkage, timed in turn."""
    tried = {(trial.way, trial.rates): trial for trial in trials(linkage)}
    exact = reference(linkage)
    times = best({key: trial.solve for key, trial in tried.items()})
    seconds = {key: time / tried[key].samples for key, time in times.items()}
    return tuple(
        Row(
            way,
            rates,
            seconds[way, rates],
            seconds[way, rates] / seconds[FLOATS, rates],
            _check(trial, linkage, exact),
        )
        for (way, rates), trial in tried.items()
    )


def _check(trial: Trial, linkage: Linkage, exact: Array) -> float:
    found = trial.read(trial.solve())
    return error(found, exact[: len(found), : trial.samples], [part == "angle" for _, part in linkage.answers], exact)


def error(found: Array, exact: Array, angles: list[bool], whole: Array) -> float:
    """The greatest error of any answer, of any order, as a part of the greatest value it takes in the whole turn.

    `found`, `exact` (orders, samples, answers), `whole` (3, all samples, answers). Angles may be whole turns apart.
    """
    apart = found - exact
    apart[0][:, angles] -= 2.0 * np.pi * np.round(apart[0][:, angles] / (2.0 * np.pi))
    return float(np.max(np.abs(apart) / np.max(np.abs(whole), axis=1, keepdims=True)[: len(found)]))
