"""A run of positions as the content of a file of numpy arrays (npz)."""

from __future__ import annotations

import io
from collections.abc import Iterable
from typing import Any

import numpy as np

from planar.model.file_units import RESULT_SI_UNITS
from planar.reports.columns import ReportedSeries, reported_series, run_header
from planar.results.motion import Motion


def encode_npz(motion: Motion, more: Iterable[ReportedSeries]) -> bytes:
    """SI arrays under names such as "points/C/velocity", and texts; "units" are rows of an array's name and its unit.

    `dict(arrays["units"])["points/C/velocity"]` is "m/s".
    """
    arrays: dict[str, Any] = {}
    units: dict[str, str] = {}
    if motion.time is not None:
        arrays["time"], units["time"] = motion.time, RESULT_SI_UNITS["time"]
    for thing in (*reported_series(motion), *more):
        for what, values in thing.values.items():
            if values is not None:
                name = "/".join(filter(None, (thing.group, thing.name, what)))
                arrays[name], units[name] = values, RESULT_SI_UNITS[thing.kinds[what]]
    texts: dict[str, Any] = {what: np.array(text) for what, text in run_header(motion).items()}
    content = io.BytesIO()
    np.savez(content, **arrays, **texts, units=np.array(list(units.items())))
    return content.getvalue()
