"""A run of positions as columns: named, with units, for files that other programs read."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np

from planar.errors import BadInput
from planar.motion import Motion
from planar.units import SI, unit

Array = np.ndarray


class Column(NamedTuple):
    """What stands in a column: of what, which quantity, its kind, and its values (n,) in SI."""

    of: str
    what: str
    kind: str
    values: Array


def columns(motion: Motion) -> Iterator[Column]:
    """Inputs, points, links, then what the pairs report, in the order of the file."""
    for name, given in motion.inputs.items():
        kinds = motion.driven(name)
        for what, kind, values in zip(("position", "velocity", "acceleration"), kinds, given, strict=True):
            yield Column(f"input {name}", what, kind, values)
    for name, point in motion.points.items():
        for letter, kind, vectors in zip(("", "v", "a"), ("length", "velocity", "acceleration"), point, strict=True):
            for axis, values in zip("xy", vectors.T, strict=True):
                yield Column(name, f"{letter}{axis}", kind, values)
    for name, link in motion.links.items():
        if name != motion.mechanism.frame:
            for what, values in link._asdict().items():
                yield Column(name, what.replace("_", " "), what.replace("_", " "), values)
    for name, report in motion.pairs.items():
        of = motion.reported(name)
        for what, found in report.items():
            if found is not None:
                yield Column(f"pair {name}", what.replace("_", " "), of[what], found)


def written(motion: Motion, suffix: str) -> str | bytes:
    """The run in the format that a file's suffix names. Raises BadInput."""
    formats: dict[str, Callable[[Motion], str | bytes]] = {".csv": _csv, ".json": _json, ".npz": _npz}
    if suffix not in formats:
        raise BadInput(suffix or "the file", f"a run is written to {', '.join(formats)} files")
    return formats[suffix](motion)


def _csv(motion: Motion) -> str:
    """A row a position; positions and angles in the units of the mechanism's file, rates in SI, as the heads say."""
    units = motion.mechanism.units
    heads, values = [], []
    for column in columns(motion):
        name = {"angle": units.angle, "length": units.length}.get(column.kind, SI[column.kind])
        heads.append(f"{column.of} {column.what} [{name}]")
        values.append([unit(name).from_si(float(value)) for value in column.values])
    text = io.StringIO()
    table = csv.writer(text, lineterminator="\n")
    table.writerow(heads)
    table.writerows(["" if np.isnan(value) else repr(value) for value in row] for row in zip(*values, strict=True))
    return text.getvalue()


def record(motion: Motion) -> dict[str, Any]:
    """The run as a JSON value in SI; null where no rate is determined."""
    return {
        "mechanism": motion.mechanism.name,
        "outcome": motion.outcome.value,
        "reason": motion.reason,
        "residual": motion.residual,
        "inputs": {name: _lists(given._asdict()) for name, given in motion.inputs.items()},
        "links": {name: _lists(link._asdict()) for name, link in motion.links.items()},
        "points": {name: _lists(point._asdict()) for name, point in motion.points.items()},
        "pairs": {name: _lists(report) for name, report in motion.pairs.items()},
        "remarks": list(motion.remarks),
    }


def _lists(arrays: dict[str, Array | None]) -> dict[str, Any]:
    return {
        name: None if values is None else np.where(np.isnan(values), None, values).tolist()
        for name, values in arrays.items()
    }


def _json(motion: Motion) -> str:
    return json.dumps(record(motion), ensure_ascii=False, allow_nan=False) + "\n"


def _npz(motion: Motion) -> bytes:
    """SI arrays under names such as "points/C/velocity"."""
    arrays: dict[str, Array] = {}
    for group in ("inputs", "links", "points"):
        for name, each in getattr(motion, group).items():
            arrays |= {f"{group}/{name}/{what}": values for what, values in each._asdict().items()}
    for name, report in motion.pairs.items():
        arrays |= {f"pairs/{name}/{what}": values for what, values in report.items() if values is not None}
    content = io.BytesIO()
    np.savez(content, **arrays)
    return content.getvalue()
