"""A run of positions as the content of a file, by its suffix: CSV, npz, Parquet, a workbook, or JSON, made here."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from planar.foundation.arrays import Array
from planar.foundation.errors import unknown_format_error
from planar.reports.columns import ReportedSeries, reported_series, run_header
from planar.reports.files import csv, npz, parquet, workbook
from planar.results.motion import Motion
from planar.results.records import Limit

_NO_FACTS: Mapping[str, Any] = MappingProxyType({})


def check_writable(suffix: str) -> None:
    """Make sure, before a long run, that it can be written to a file of this suffix. Raises BadInput."""
    if suffix.lower() not in _FORMATS:
        raise unknown_format_error(suffix, "a run", _FORMATS)
    if suffix.lower() == ".parquet":
        parquet.require_pyarrow()
    if suffix.lower() == ".xlsx":
        workbook.require_xlsxwriter()


def encode_run(
    motion: Motion,
    suffix: str,
    more: Iterable[ReportedSeries] = (),
    facts: Callable[[], Mapping[str, Any]] = dict,
) -> bytes:
    """The run and further series in the format that a file's suffix names. Raises BadInput.

    `facts` of the run as a whole are in JSON alone, and are computed only for it.
    """
    check_writable(suffix)
    if suffix.lower() == ".json":
        return _encode_json(motion, more, facts())
    return _FORMATS[suffix.lower()](motion, more)


def record(motion: Motion, more: Iterable[ReportedSeries] = (), facts: Mapping[str, Any] = _NO_FACTS) -> dict[str, Any]:
    """The run as a JSON value in SI; null where no rate is determined.

    "time" is there where the run has one, so are "jerk" of points and "angular_jerk" of links; "limits" is a list of
    what `planar.results.records.Limit` holds.
    """
    return {**_run_record(motion, more, _to_list), **facts}


def _run_record(
    motion: Motion, more: Iterable[ReportedSeries], convert: Callable[[Array | None], Any]
) -> dict[str, Any]:
    groups: dict[str, dict[str, Any]] = {"inputs": {}, "links": {}, "points": {}, "pairs": {}}
    for thing in (*reported_series(motion), *more):
        group = groups.setdefault(thing.group, {})
        named = group.setdefault(thing.name, {}) if thing.name else group
        named |= {what: convert(values) for what, values in thing.values.items()}
    return {
        **run_header(motion),
        "residual": motion.residual,
        "units": "SI",
        **({} if motion.time is None else {"time": convert(motion.time)}),
        **groups,
        "limits": [_limit_record(each) for each in motion.limits],
        "remarks": list(motion.remarks),
    }


def _limit_record(limit: Limit) -> dict[str, Any]:
    """What is told of a limit; null for a number that is not there."""
    numbers = {what: _to_list(np.asarray(getattr(limit, what), dtype=float)) for what in ("input", "value")}
    return limit._asdict() | numbers


def _to_list(values: Array | None) -> Any:
    """An array as lists; null where it has no finite number, for which JSON has no word."""
    if values is None:
        return None
    there = np.isfinite(values)
    return (values if there.all() else np.where(there, values.astype(object), np.array(None))).tolist()


def _encode_json(motion: Motion, more: Iterable[ReportedSeries], facts: Mapping[str, Any]) -> bytes:
    whole = {**_run_record(motion, more, lambda values: values), **facts}
    # arrays become lists one by one as they are written: lists of a long run take four times the memory of its arrays
    return (json.dumps(whole, default=_to_list, ensure_ascii=False, allow_nan=False) + "\n").encode()


_FORMATS: dict[str, Callable[..., bytes]] = {
    ".csv": csv.encode_csv,
    ".json": _encode_json,
    ".npz": npz.encode_npz,
    ".parquet": parquet.encode_parquet,
    ".xlsx": workbook.encode_workbook,
}
