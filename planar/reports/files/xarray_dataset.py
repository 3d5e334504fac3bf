"""A run of positions as an xarray Dataset."""

from __future__ import annotations

from collections import defaultdict
from typing import TYPE_CHECKING, Any

import numpy as np

from planar.document.first_argument import takes_result
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput
from planar.foundation.units import SI_UNITS
from planar.reports.columns import ReportedSeries, reported_series, run_header
from planar.results.motion import Motion

if TYPE_CHECKING:
    import xarray as xr

Variable = tuple[tuple[str, ...], Array, dict[str, str]]
"""Dimensions, values and attributes, as xarray takes them."""


@takes_result("Motion")
def dataset(motion: Motion) -> xr.Dataset:
    """The motion as an xarray Dataset in SI, each variable with `units` and `long_name`.

    Along `row`, with the inputs' positions and the time, where there is one, as coordinates:

    - `input_A_velocity` and `input_A_acceleration` of every input A, with the coordinate `input_A_position`;
    - `point_position`, `point_velocity`, `point_acceleration` (point, row, axis), axes "x" and "y" of the frame;
    - `link_angle`, `link_angular_velocity`, `link_angular_acceleration` (link, row);
    - `pair_...` (pair, row) of all that pairs report; NaN also where a pair has no such quantity;
    - `point_jerk` and `link_angular_jerk` where the motion was made with them.

    `dataset(motion).link_angle.sel(link="DC").plot(x="input_A_position")` draws a diagram. Attributes are `mechanism`,
    `outcome` and `reason`. Raises BadInput where xarray is not installed.

    >>> import planar
    >>> motion = planar.cycle(planar.load("slider-crank"), 12)
    >>> planar.dataset(motion).sizes["row"]
    13
    """
    try:
        import xarray as xr
    except ImportError:
        raise BadInput("xarray", 'a Dataset needs xarray: pip install "planar-linkages[xarray]"') from None
    groups: dict[str, list[ReportedSeries]] = {"inputs": [], "points": [], "links": [], "pairs": []}
    for thing in reported_series(motion):
        groups[thing.group].append(thing)
    coordinates: dict[str, Any] = {
        "row": ("row", np.arange(len(motion)), {"long_name": "row"}),
        "axis": ["x", "y"],
    }
    coordinates |= {group[:-1]: [each.name for each in groups[group]] for group in ("points", "links", "pairs")}
    if motion.time is not None:
        coordinates["time"] = (("row",), motion.time, _attributes("time", "time"))
    variables = {
        name: variable
        for group in ("points", "links", "pairs")
        for name, variable in _stack_variables(groups[group]).items()
    }
    for each in groups["inputs"]:
        for what, values in each.values.items():
            if values is None:
                continue
            variable = (("row",), values, _attributes(each.kinds[what], f"input {each.name} {what}"))
            (coordinates if what == "position" else variables)[f"input_{each.name}_{what}"] = variable
    return xr.Dataset(variables, coordinates, run_header(motion))


def _stack_variables(things: list[ReportedSeries]) -> dict[str, Variable]:
    """Of things of one group every quantity as one array, things first."""
    found: dict[str, dict[int, Array]] = defaultdict(dict)
    kinds: dict[str, str] = {}
    for index, thing in enumerate(things):
        for what, values in thing.values.items():
            if values is not None:
                found[what][index], kinds[what] = values, thing.kinds[what]
    variables = {}
    for what, those in found.items():
        one = things[0].group[:-1]
        shape = next(iter(those.values())).shape
        whole = np.full((len(things), *shape), np.nan)
        for index, values in those.items():
            whole[index] = values
        dimensions = (one, "row", "axis")[: whole.ndim]
        variables[f"{one}_{what}"] = (dimensions, whole, _attributes(kinds[what], what.replace("_", " ")))
    return variables


def _attributes(kind: str, name: str) -> dict[str, str]:
    return {"units": SI_UNITS[kind], "long_name": name}
