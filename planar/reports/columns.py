"""What a run of positions holds, by name and kind of quantity, and the same as columns of a table with heads."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from typing import NamedTuple

import numpy as np

from planar.foundation.arrays import Array
from planar.model.file_units import unit_of_kind
from planar.results.motion import Motion

POINT_KINDS = {"position": "length", "velocity": "velocity", "acceleration": "acceleration", "jerk": "jerk"}
"""What is reported of a point, and the kind of quantity that each is; a jerk where the run has one."""

_VECTOR_LETTERS = {"position": "", "velocity": "v", "acceleration": "a", "jerk": "j", "force": "F"}


_GROUP_PREFIXES = {"inputs": "input ", "pairs": "pair ", "misfits": "misfit ", "reactions": "reaction "}
_GROUP_PREFIXES |= {"friction": "friction ", "without friction": "without friction input "}
_GROUP_PREFIXES |= {"rubbing": "rubbing ", "contacts": "contact ", "centres": "centre "}


class ReportedSeries(NamedTuple):
    """What is reported of one thing over a run, in SI.

    `group` is "inputs", "points", "links" or "pairs", or what else is reported beside the run; a name that is empty
    means the mechanism as a whole. `values` are arrays (n,), or (n, 2) of vectors, under the names of the quantities,
    None where the thing has no such quantity; `kinds` are the kinds of these quantities (see MEASURES).
    """

    group: str
    name: str
    kinds: Mapping[str, str]
    values: Mapping[str, Array | None]


class RunColumn(NamedTuple):
    """A column of a table: its name, its unit, its kind of quantity, and its values (n,) in that unit."""

    name: str
    unit: str
    kind: str
    values: Array

    @property
    def head(self) -> str:
        """Name and unit, as "C x [mm]"."""
        return f"{self.name} [{self.unit}]"


def run_header(motion: Motion) -> dict[str, str]:
    """The texts that stand at the head of a run in every format that has room for texts."""
    return {"mechanism": motion.mechanism.name, "outcome": motion.outcome.value, "reason": motion.reason}


def reported_series(motion: Motion) -> Iterator[ReportedSeries]:
    """Inputs, points, links, then what the pairs report; the jerks of points and links where the run has them."""
    for name, given in motion.inputs.items():
        values = given._asdict()
        yield ReportedSeries("inputs", name, dict(zip(values, motion.input_quantity_kinds(name), strict=True)), values)
    jerked = motion.jerked is not None
    for name in motion.point_names:
        values = motion.point(name)._asdict() | ({"jerk": motion.jerk(name)} if jerked else {})
        yield ReportedSeries("points", name, POINT_KINDS, values)
    for name in motion.frames:
        values = motion.link(name)._asdict() | ({"angular_jerk": motion.angular_jerk(name)} if jerked else {})
        yield ReportedSeries("links", name, {what: what.replace("_", " ") for what in values}, values)
    for name, report in motion.pairs.items():
        yield ReportedSeries("pairs", name, motion.result_kinds(name), report)
    for name, misfit in motion.misfits.items():
        values = {"misfit": np.broadcast_to(misfit, (len(motion),))}
        yield ReportedSeries("misfits", name, {"misfit": "length"}, values)


def run_columns(motion: Motion, more: Iterable[ReportedSeries] = ()) -> Iterator[RunColumn]:
    """Time where there is one, all that is told of the run but the frame's rest, then more; under names that differ.

    Units are those that go with the mechanism's file (see `planar.model.file_units.unit_of_kind`).
    """
    taken: set[str] = set()
    for name, kind, values in _named_values(motion, more):
        different, again = name, 1
        while different in taken:  # as a link "pair G" beside a pair "G"
            again += 1
            different = f"{name} ({again})"
        taken.add(different)
        measure, of = unit_of_kind(kind, motion.mechanism.units)
        yield RunColumn(different, measure, kind, of.from_si(values))


def _named_values(motion: Motion, more: Iterable[ReportedSeries]) -> Iterator[tuple[str, str, Array]]:
    """Name, kind and values (n,) in SI of every column."""
    if motion.time is not None:
        yield "time", "time", motion.time
    for thing in (*reported_series(motion), *more):
        if thing.group == "links" and thing.name == motion.mechanism.frame:
            continue
        of = _GROUP_PREFIXES.get(thing.group, "") + thing.name or thing.group
        for what, values in thing.values.items():
            if values is None:
                continue
            if values.ndim == 2:
                for axis, part in zip("xy", values.T, strict=True):
                    yield f"{of} {_VECTOR_LETTERS[what]}{axis}", thing.kinds[what], part
            else:
                yield f"{of} {what.replace('_', ' ')}", thing.kinds[what], values
