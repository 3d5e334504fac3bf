"""The sensitivity of a result to every number of the file as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.sensitivity.limit_slopes import LimitSlopes, TravelSlopes
from planar.analysis.sensitivity.sensitivity import INFLUENCE_STEP, Influence, Sensitivity
from planar.analysis.sensitivity.transmission_slopes import TransmissionSlopes
from planar.document.revised.changed_numbers import dimensions
from planar.foundation.arrays import Array
from planar.model.file_units import FileUnits, display_unit
from planar.model.mechanism import relative_motions
from planar.model.wording import amount, join_all_names
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import AMONG_POSITIONS, column_heading, format_number, paragraphs
from planar.results.motion import Motion

MAX_ROWS = 24
"""Numbers that a table lists; JSON, and Python, has all."""


def table(found: Sensitivity, result: str | None = None) -> RenderableType:
    """The numbers that change a result, the greatest influence first, what they do to its limits, and what is said."""
    name = result or next(iter(found.slopes))
    moving = found.moving
    head = [Text(moving.mechanism.name, style="bold")]
    if moving.mechanism.source:
        head.append(Text(moving.mechanism.source, style="italic"))
    influences = found.influences(name)
    parts: list[RenderableType] = [*head, Text(), _influence_table(found, name, influences)]
    parts += [Text(), _travel_table(found.travel, found)] if found.travel is not None else []
    parts += [Text(), _transmission_table(found.transmission, found)] if found.transmission is not None else []
    parts += [each for dead in found.dead_points for each in (Text(), _dead_point_table(dead, found))]
    return Group(*parts, Text(), paragraphs((" -", sentence) for sentence in _remarks(found, name, influences)))


def slope_text(slope: float, result_kind: str, dimension_kind: str, units: FileUnits) -> str:
    """A derivative (SI) in the units in which both are shown: "1.05 mm/mm"."""
    (result_name, result_unit), (dimension_name, dimension_unit) = (
        display_unit(kind, units) for kind in (result_kind, dimension_kind)
    )
    value = result_unit.from_si(slope * dimension_unit.to_si(1.0))
    unit = f"{result_name or '1'}/{_denominator(dimension_name)}" if dimension_name else result_name
    return f"{format_number(value)} {unit}".rstrip()


def _denominator(name: str) -> str:
    return f"({name})" if any(sign in name for sign in "/· ") else name


def _influence_table(found: Sensitivity, name: str, influences: tuple[Influence, ...]) -> FittedTable:
    units, values = found.moving.mechanism.units, dimensions(found.moving.mechanism)
    kind, motion = found.kinds[name], found.moving if isinstance(found.moving, Motion) else None
    is_vector = motion is None and any(np.ndim(each) for each in found.slopes[name].values())
    headings = ["slope in x", "slope in y"] if is_vector else ["slope"]
    if motion is not None:
        headings = ["greatest slope", "at time" if motion.time is not None else f"at {motion.running_input}"]
    what = name.replace("_", " ")
    among = "" if motion is None else AMONG_POSITIONS
    title = f"{what[0].upper()}{what[1:]} of {found.of}, by the numbers of the file{among}"
    columns = ("value", *headings, column_heading("effect", kind, units))
    shown = plain_table(title, "number", *columns)
    effect_unit = display_unit(kind, units)[1]
    for each in influences[:MAX_ROWS]:
        cells = [] if motion is None else [_position_text(motion, each.row)]
        slopes = found.slopes[name][each.dimension] if is_vector else [each.slope]
        told = [slope_text(float(slope), kind, each.kind, units) for slope in slopes]
        value = amount(values[each.dimension], each.kind, units)
        shown.add_row(each.dimension, value, *told, *cells, format_number(effect_unit.from_si(each.effect)))
    return shown


def _position_text(motion: Motion, row: int) -> str:
    if motion.time is not None:
        return f"{format_number(float(motion.time[row]))} s"
    kind = relative_motions(motion.mechanism)[motion.running_input].input_kind.value
    return amount(float(motion.inputs[motion.running_input].position[row]), kind, motion.mechanism.units)


def _travel_table(travel: TravelSlopes, found: Sensitivity) -> FittedTable:
    units, kind = found.moving.mechanism.units, _output_kind(found)
    word = "Stroke" if kind == "length" else "Swing"
    ratio = f"; time ratio {format_number(travel.time_ratio)}" if travel.time_ratio is not None else ""
    shown = plain_table(
        f"{word} of {travel.of}: {amount(travel.travel, kind, units)}{ratio}",
        "number",
        f"{word.lower()}, slope",
        *(["time ratio, slope"] if travel.time_ratio_slopes is not None else []),
    )
    for name, slope in sorted(travel.travel_slopes.items(), key=lambda each: -abs(each[1])):
        by_ratio = (travel.time_ratio_slopes or {}).get(name, 0.0)
        if abs(slope) + abs(by_ratio) < ZERO_SLOPE:
            continue
        of = found.dimensions[name]
        cells = [slope_text(by_ratio, "number", of, units)] if travel.time_ratio_slopes is not None else []
        shown.add_row(name, slope_text(slope, kind, of, units), *cells)
    return shown


def _transmission_table(transmission: TransmissionSlopes, found: Sensitivity) -> FittedTable:
    units, least = found.moving.mechanism.units, transmission.least
    if least is not None:
        title = f"Least transmission angle: {amount(least.value, 'angle', units)}"
        slopes = dict(transmission.least_slopes or {})
    else:
        title = f"Transmission angle: {amount(float(transmission.angle), 'angle', units)}"
        slopes = {name: float(slope) for name, slope in transmission.slopes.items()}
    shown = plain_table(title, "number", "transmission angle, slope")
    for name, slope in sorted(slopes.items(), key=lambda each: -abs(each[1])):
        if abs(slope) >= ZERO_SLOPE:
            shown.add_row(name, slope_text(slope, "angle", found.dimensions[name], units))
    return shown


def _dead_point_table(dead: LimitSlopes, found: Sensitivity) -> FittedTable:
    units, kind = found.moving.mechanism.units, _output_kind(found)
    shown = plain_table(f"Dead point at {dead.of} = {amount(dead.input, kind, units)}", "number", "slope")
    for name, slope in sorted(dead.input_slopes.items(), key=lambda each: -abs(each[1])):
        if abs(slope) >= ZERO_SLOPE:
            shown.add_row(name, slope_text(slope, kind, found.dimensions[name], units))
    return shown


ZERO_SLOPE = 1e-12
"""SI: a derivative of a limit below this is rounding."""


def _output_kind(found: Sensitivity) -> str:
    motions = relative_motions(found.moving.mechanism)
    return motions[found.of].input_kind.value if found.of in motions else "angle"


def _remarks(found: Sensitivity, name: str, influences: tuple[Influence, ...]) -> Iterator[str]:
    units = found.moving.mechanism.units
    steps = ((found.size, "length"), (1.0, "angle"))
    length, angle = (amount(INFLUENCE_STEP * step, kind, units) for step, kind in steps)
    yield f"effect: of {length} more of a length, of {angle} of an angle, of 0.1 % of any other number"
    if len(influences) > MAX_ROWS:
        yield f"the first {MAX_ROWS} of {len(influences)} numbers; --json has all"
    others = [each for each in found.slopes if each != name]
    if others:
        yield f"also told, with --result: {join_all_names(others)}"
    if found.tied:
        yield (
            f"{join_all_names(found.tied)} cannot change alone, since other numbers have to go with them: "
            f"no derivative is told"
        )
    if found.singular_rows:
        yield f"{len(found.singular_rows)} positions are dead points or change points, where there are no derivatives"


def record(found: Sensitivity) -> dict[str, Any]:
    """All derivatives as JSON values (SI), `null` where there is none."""
    told: dict[str, Any] = {
        "mechanism": found.moving.mechanism.name,
        "of": found.of,
        "results": {
            name: {
                "kind": found.kinds[name],
                "slopes": {number: _values(slope) for number, slope in slopes.items()},
            }
            for name, slopes in found.slopes.items()
        },
        "tied": list(found.tied),
        "singular_rows": list(found.singular_rows),
    }
    if isinstance(found.moving, Motion):
        running = found.moving.running_input
        told["input"] = {"pair": running, "position": found.moving.inputs[running].position.tolist()}
    if found.travel is not None:
        told["travel"] = {
            "length": found.travel.travel,
            "slopes": _finite(found.travel.travel_slopes),
            "ends": [_limit_record(each) for each in found.travel.ends],
            "time_ratio": found.travel.time_ratio,
            "time_ratio_slopes": found.travel.time_ratio_slopes and _finite(found.travel.time_ratio_slopes),
        }
    if found.transmission is not None:
        least = found.transmission.least
        told["transmission"] = {
            "angle": _values(np.asarray(found.transmission.angle)),
            "slopes": {name: _values(np.asarray(slope)) for name, slope in found.transmission.slopes.items()},
            "least": least and {"input": least.input, "value": least.value},
            "least_slopes": found.transmission.least_slopes and _finite(found.transmission.least_slopes),
        }
    if found.dead_points:
        told["dead_points"] = [_limit_record(each) for each in found.dead_points]
    return told


def _limit_record(limit: LimitSlopes) -> dict[str, Any]:
    return {
        "kind": limit.kind,
        "input": limit.input,
        "value": limit.value,
        "input_slopes": _finite(limit.input_slopes),
        "value_slopes": _finite(limit.value_slopes),
    }


def _finite(slopes: Any) -> dict[str, float | None]:
    return {name: float(slope) if np.isfinite(slope) else None for name, slope in slopes.items()}


def _values(slopes: Array) -> Any:
    whole = np.asarray(slopes, dtype=float)
    known: Array = np.where(np.isfinite(whole), whole, 0.0).astype(object)
    known[~np.isfinite(whole)] = None
    return known.tolist()
