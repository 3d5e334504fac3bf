"""Designs as JSON values from which they are read again, to the last bit."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from planar.document.files import from_dict, to_dict
from planar.foundation.arrays import Array
from planar.synthesis.judgement.defects import Defect
from planar.synthesis.synthesis import SynthesisedDesign


def design_record(design: SynthesisedDesign) -> dict[str, Any]:
    """A design as JSON values, SI: null where a miss is not known. What is told of it beside is not among them."""
    is_known = bool(np.isfinite(design.error))
    return {
        "start": design.start,
        "error": design.error if is_known else None,
        "greatest_miss": design.greatest_miss if is_known else None,
        "misses": [_finite(each) for each in design.misses],
        "inputs": [_finite(each) for each in design.inputs],
        "shortages": [list(each) for each in design.shortages],
        "numbers": dict(design.numbers),
        "mechanism": to_dict(design.mechanism),
    }


def read_design(record: Mapping[str, Any]) -> SynthesisedDesign:
    """The design of a record. Raises BadInput, KeyError, TypeError or ValueError where it is none."""
    error, worst = (np.nan if record[key] is None else float(record[key]) for key in ("error", "greatest_miss"))
    return SynthesisedDesign(
        from_dict(record["mechanism"]),
        error,
        worst,
        tuple(_numbers(each) for each in record["misses"]),
        tuple(_numbers(each) for each in record["inputs"]),
        tuple(Defect(*each) for each in record["shortages"]),
        str(record["start"]),
        {str(name): float(value) for name, value in record["numbers"].items()},
    )


def _finite(values: Array) -> list[float | None]:
    return [float(each) if np.isfinite(each) else None for each in values]


def _numbers(values: list[float | None]) -> Array:
    return np.array([np.nan if each is None else each for each in values], float)
