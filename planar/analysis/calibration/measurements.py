"""What was measured of a mechanism: the results it belongs to, its numbers, and how exact they are."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from planar.derivatives.result_slopes import position_results
from planar.foundation.arrays import Array
from planar.foundation.errors import BadInput, join_names
from planar.model.mechanism import Mechanism
from planar.solving.position import solve


class MeasuredSeries(NamedTuple):
    """What was measured of one result: its name, the result's name and kind, the values (n, parts) in SI with NaN for
    what is missing, and the standard deviation of one of them, in SI."""

    name: str
    result: str
    kind: str
    values: Array
    deviation: float


class Measurement(NamedTuple):
    """All series over the same samples, and the positions (n, inputs) of the inputs where these are known."""

    series: tuple[MeasuredSeries, ...]
    inputs: Array | None
    has_deviations: bool

    @property
    def many(self) -> int:
        """Samples."""
        return len(self.series[0].values)

    @property
    def values(self) -> Array:
        """All measured values (n, parts)."""
        return np.concatenate([each.values for each in self.series], axis=1)

    @property
    def deviations(self) -> Array:
        """The standard deviation of each part (parts,)."""
        return np.concatenate([[each.deviation] * each.values.shape[1] for each in self.series])

    @property
    def is_angle(self) -> Array:
        """Which parts are angles (parts,)."""
        return np.concatenate([[each.kind == "angle"] * each.values.shape[1] for each in self.series])

    @property
    def labels(self) -> list[str]:
        """What the parts are called: "C x", "BC angle"."""
        found = []
        for each in self.series:
            points = each.values.shape[1] == 2
            own = [f"{each.name} {axis}" for axis in "xy"] if points else [f"{each.name} {each.result}"]
            found += [text.replace("_", " ") for text in own]
        return found


def read_measurement(mechanism: Mechanism, measured: Any, inputs: Any, deviations: Any, size: float) -> Measurement:
    """What a caller gives, checked: see `planar.calibrate`. Raises BadInput, Unknown."""
    if not isinstance(measured, Mapping) or not measured:
        raise BadInput("measured", "name what was measured, with an array each, as {'E': positions}")
    given = {} if deviations is None else deviations
    if not isinstance(given, Mapping):
        raise BadInput("deviations", "give the standard deviations by name, as {'E': 1e-4}")
    for name in given:
        if name not in measured:
            raise BadInput(f"deviations[{name!r}]", f"nothing was measured of {name!r}, but of {join_names(measured)}")
    state, series = solve(mechanism), []
    for name, values in measured.items():
        known = position_results(state, str(name))
        named = values if isinstance(values, Mapping) else {next(iter(known), ""): values}
        for result, numbers in named.items():
            place = f"measured[{name!r}]"
            if result not in known:
                raise BadInput(place, f"of {name!r} are measured {join_names(known)}, and no {result!r}")
            parts, kind = len(known[result].parts), known[result].kind
            deviation = _read_deviation(name, given.get(name), size if kind == "length" else 1.0)
            series.append(MeasuredSeries(str(name), result, kind, _read_values(place, numbers, parts), deviation))
    count = {len(each.values) for each in series}
    if len(count) > 1:
        told = join_names([f"{len(each.values)} of {each.name!r}" for each in series])
        raise BadInput("measured", f"every sample has a row in each array; there are {told}")
    return Measurement(tuple(series), _read_inputs(mechanism, inputs, count.pop()), bool(given))


def _read_values(place: str, numbers: Any, parts: int) -> Array:
    try:
        values = np.asarray(numbers, dtype=float)
        values = values.reshape(-1, parts) if values.ndim == 1 and parts == 1 else values
    except (TypeError, ValueError):
        raise BadInput(place, "an array of numbers is wanted") from None
    if values.ndim != 2 or values.shape[1] != parts or not len(values):
        wanted = "(n, 2)" if parts == 2 else "(n,)"
        raise BadInput(place, f"an array of shape {wanted} is wanted here, not {np.shape(numbers)}")
    if np.isinf(values).any():
        raise BadInput(place, "a number here is not finite; what is missing is NaN")
    if not np.isfinite(values).any():
        raise BadInput(place, "there is no number here")
    return values


def _read_deviation(name: str, given: Any, default: float) -> float:
    if given is None:
        return default
    if isinstance(given, bool) or not isinstance(given, int | float) or not 0.0 < given < np.inf:
        raise BadInput(f"deviations[{name!r}]", f"a standard deviation above zero is wanted, in SI, not {given!r:.40}")
    return float(given)


def _read_inputs(mechanism: Mechanism, given: Any, many: int) -> Array | None:
    names = [each.pair for each in mechanism.inputs]
    if given is None or (isinstance(given, Mapping) and not given):
        if len(names) != 1:
            raise BadInput("inputs", f"the mechanism has {len(names)} inputs; their positions have to be measured too")
        return None
    if not isinstance(given, Mapping):
        raise BadInput("inputs", f"give the inputs' positions by name, as {{{names[0]!r}: positions}}")
    for name in given:
        if name not in names:
            raise BadInput(f"inputs[{name!r}]", f"there is no input {name!r}; there are {join_names(names)}")
    missing = [name for name in names if name not in given]
    if missing:
        raise BadInput("inputs", f"the positions of {join_names(missing)} are missing")
    columns = []
    for name in names:
        values = _read_values(f"inputs[{name!r}]", given[name], 1)
        if len(values) != many or not np.isfinite(values).all():
            raise BadInput(f"inputs[{name!r}]", f"a number for each of the {many} samples is wanted")
        columns.append(values)
    return np.concatenate(columns, axis=1)
