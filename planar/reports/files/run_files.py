"""A run of positions in the formats that other programs read."""

from __future__ import annotations

import io
import json
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from planar.foundation.errors import no_format
from planar.reports.columns import MEASURES, Told, about, columns, told
from planar.reports.files import parquet
from planar.results.motion import Motion
from planar.results.records import Limit

Array = np.ndarray

_NOTHING: Mapping[str, Any] = MappingProxyType({})
FORMULAS = ("=", "+", "-", "@", "'")
"""What a formula begins with in spreadsheets, and what marks a text there."""
ROWS = 500
"""Of a CSV file that are made at a time: enough to be quick, few enough for the memory of many columns."""


def writable(suffix: str) -> None:
    """Make sure, before a long run, that it can be written to a file of this suffix. Raises BadInput."""
    if suffix.lower() not in _FORMATS:
        raise no_format(suffix, "a run", _FORMATS)
    if suffix.lower() == ".parquet":
        parquet.ready()


def written(motion: Motion, suffix: str, more: Iterable[Told] = (), said: Mapping[str, Any] = _NOTHING) -> bytes:
    """The run, and what more is told of it, in the format that a file's suffix names. Raises BadInput.

    What is `said` of all of it together is for JSON.
    """
    writable(suffix)
    if suffix.lower() == ".json":
        return _json(motion, more, said)
    return _FORMATS[suffix.lower()](motion, more)


def record(motion: Motion, more: Iterable[Told] = (), said: Mapping[str, Any] = _NOTHING) -> dict[str, Any]:
    """The run as a JSON value in SI; null where no rate is determined.

    "time" is there where the run has one, so are "jerk" of points and "angular_jerk" of links; "limits" is a list of
    what `planar.results.records.Limit` holds.
    """
    return _record(motion, more, _list) | said


def _record(motion: Motion, more: Iterable[Told], shown: Callable[[Array | None], Any]) -> dict[str, Any]:
    groups: dict[str, dict[str, Any]] = {"inputs": {}, "links": {}, "points": {}, "pairs": {}}
    for thing in (*told(motion), *more):
        group = groups.setdefault(thing.group, {})
        named = group.setdefault(thing.name, {}) if thing.name else group
        named |= {what: shown(values) for what, values in thing.values.items()}
    return {
        **about(motion),
        "residual": motion.residual,
        "units": "SI",
        **({} if motion.time is None else {"time": shown(motion.time)}),
        **groups,
        "limits": [_limit(each) for each in motion.limits],
        "remarks": list(motion.remarks),
    }


def _limit(limit: Limit) -> dict[str, Any]:
    """What is told of a limit; null for a number that is not there."""
    numbers = {what: _list(np.asarray(getattr(limit, what), dtype=float)) for what in ("input", "value")}
    return limit._asdict() | numbers


def _list(values: Array | None) -> Any:
    """An array as lists; null where it has no finite number, for which JSON has no word."""
    if values is None:
        return None
    there = np.isfinite(values)
    return (values if there.all() else np.where(there, values, None)).tolist()


def _json(motion: Motion, more: Iterable[Told], said: Mapping[str, Any]) -> bytes:
    whole = _record(motion, more, lambda values: values) | said
    # arrays become lists one by one as they are written: lists of a long run take four times the memory of its arrays
    return (json.dumps(whole, default=_list, ensure_ascii=False, allow_nan=False) + "\n").encode()


def _csv(motion: Motion, more: Iterable[Told]) -> bytes:
    """A row a position; positions and angles in the units of the mechanism's file, rates in SI, as the heads say."""
    all_columns = tuple(columns(motion, more))
    text = io.BytesIO()
    text.write((",".join(_cell(column.head) for column in all_columns) + "\n").encode())
    for first in range(0, len(motion), ROWS):
        block = np.column_stack([column.values[first : first + ROWS] for column in all_columns]).tolist()
        rows = "".join(",".join(map(repr, row)) + "\n" for row in block)
        text.write(rows.replace("nan", "").encode())  # what is not determined is a blank cell
    return text.getvalue()


def _cell(text: str) -> str:
    """A text as a cell, in quotes where it holds what ends a cell (RFC 4180).

    What a spreadsheet would take for a formula has an apostrophe before it, and so has what begins with one: a reader
    takes one apostrophe off.
    """
    text = f"'{text}" if text[:1] in FORMULAS else text
    return '"' + text.replace('"', '""') + '"' if any(mark in text for mark in ',"\n\r') else text


def _npz(motion: Motion, more: Iterable[Told]) -> bytes:
    """SI arrays under names such as "points/C/velocity", and texts; "units" are rows of an array's name and its unit.

    `dict(arrays["units"])["points/C/velocity"]` is "m/s".
    """
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    if motion.time is not None:
        arrays["time"], units["time"] = motion.time, MEASURES["time"]
    for thing in (*told(motion), *more):
        for what, values in thing.values.items():
            if values is not None:
                name = "/".join(filter(None, (thing.group, thing.name, what)))
                arrays[name], units[name] = values, MEASURES[thing.kinds[what]]
    texts = {what: np.array(text) for what, text in about(motion).items()}
    content = io.BytesIO()
    np.savez(content, **arrays, **texts, units=np.array(list(units.items())))
    return content.getvalue()


_FORMATS: dict[str, Callable[..., bytes]] = {
    ".csv": _csv,
    ".json": _json,
    ".npz": _npz,
    ".parquet": parquet.written,
}
