"""The band of a result within its tolerances as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.tolerance.allowance import Allowance
from planar.analysis.tolerance.tolerance import ToleranceBand
from planar.foundation.arrays import Array
from planar.model.file_units import display_unit
from planar.model.wording import amount
from planar.reports.fitted_table import FittedTable, plain_table
from planar.reports.number_format import AMONG_POSITIONS, column_heading, format_number, paragraphs
from planar.results.motion import Motion

MAX_ROWS = 24
"""Contributions that a table lists; JSON, and Python, has all."""
ENDS = ("least", "greatest")
LEAST_SHARE = 5e-5
"""Of the variance: less is not listed."""


def table(band: ToleranceBand, allowed: Allowance | None = None) -> RenderableType:
    """The band where it is widest, what contributes to it, and what is said."""
    mechanism = band.moving.mechanism
    head = [Text(mechanism.name, style="bold")]
    parts: list[RenderableType] = [*head, Text(), _band_table(band), Text(), _contribution_table(band)]
    if allowed is not None:
        parts += [Text(), _allowance_table(band, allowed)]
    return Group(*parts, Text(), paragraphs((" -", sentence) for sentence in _remarks(band, allowed)))


def _band_table(band: ToleranceBand) -> FittedTable:
    units, row = band.moving.mechanism.units, band.row
    unit = display_unit(band.kind, units)[1]
    where = ""
    if band.has_rows and isinstance(band.moving, Motion):
        running = band.moving.running_input
        kind = band.moving._relative_motions[running].input_kind.value
        position = float(band.moving.inputs[running].position[row])
        where = f" at {running} = {amount(position, kind, units)}{AMONG_POSITIONS}"
    title = f"{band.result.replace('_', ' ').capitalize()} of {band.of} within the tolerances{where}"
    shown = plain_table(
        title,
        "part",
        *(column_heading(name, band.kind, units) for name in ("nominal", "least", "greatest", "mean")),
        column_heading("std linear", band.kind, units),
        *([] if band.second_order is None else [column_heading("std second order", band.kind, units)]),
        *([] if band.sampled is None else [column_heading("std sampled", band.kind, units)]),
        *([] if band.guaranteed is None else [column_heading(f"guaranteed {end}", band.kind, units) for end in ENDS]),
    )
    lower, upper = band.linear.limits()
    count = band.nominal_rows.shape[1]
    labels = ["x", "y"] if band.linear.slopes.shape[1] == 2 and band.result != "dead_points" else ["", *"234"][:count]
    for k, label in enumerate(labels):
        values = [band.nominal_rows, lower, upper, band.statistical.mean, band.statistical.std]
        if band.second_order is not None:
            values.append(band.second_order.std)
        if band.sampled is not None:
            values.append(band.sampled.std)
        if band.guaranteed is not None:
            values += [band.guaranteed.lower, band.guaranteed.upper]
        shown.add_row(label or band.of, *(format_number(unit.from_si(float(each[row, k]))) for each in values))
    return shown


def _contribution_table(band: ToleranceBand) -> FittedTable:
    units, row = band.moving.mechanism.units, band.row
    shown = plain_table(
        f"Contributions{_among_positions(band)}",
        "number",
        "tolerance",
        column_heading("deviation", band.kind, units),
        "share, %",
    )
    unit = display_unit(band.kind, units)[1]
    reach = _deviations(band)[row]
    for name, share, far in _sorted_contributions(band, row, reach)[:MAX_ROWS]:
        if share > LEAST_SHARE or far > 0.0:
            shown.add_row(name, _tolerance_text(band, name), format_number(unit.from_si(far)), f"{100.0 * share:.1f}")
    return shown


def _among_positions(band: ToleranceBand) -> str:
    """What is said of the widest band over a motion, which is that of one of its positions."""
    return AMONG_POSITIONS if band.has_rows and isinstance(band.moving, Motion) else ""


def _deviations(band: ToleranceBand) -> Array:
    """How far each number and pin takes the result by itself (n, contributions)."""
    linear = band.linear
    greatest = np.maximum(np.abs(linear.lower), np.abs(linear.upper))
    by_numbers = np.linalg.norm(linear.slopes, axis=1) * greatest
    by_pins = np.linalg.norm(np.nan_to_num(linear.offset_slopes), ord=2, axis=(1, 3)) * linear.radii
    return np.concatenate([by_numbers, by_pins], axis=1)


def _sorted_contributions(band: ToleranceBand, row: int, reach: Array) -> list[tuple[str, float, float]]:
    shares = (float(np.nan_to_num(np.atleast_1d(each)[row])) for each in band.contribution.values())
    found = zip(band.names, shares, map(float, reach), strict=True)
    return sorted(found, key=lambda each: (-each[1], -each[2]))


def _tolerance_text(band: ToleranceBand, name: str) -> str:
    units = band.moving.mechanism.units
    for each in band.variations.numbers:
        if each.number == name:
            if each.lower == -each.upper:
                return f"± {amount(each.upper, each.kind, units)}"
            return f"{amount(each.lower, each.kind, units)} to {amount(each.upper, each.kind, units)}"
    radius = next(each.radius for each in band.variations.offsets if f"clearance.{each.pair}" == name)
    return f"within {amount(radius, 'length', units)}"


def _allowance_table(band: ToleranceBand, allowed: Allowance) -> FittedTable:
    units = band.moving.mechanism.units
    kinds = {each.number: each.kind for each in band.variations.numbers}
    by = "three standard deviations" if allowed.statistical else "the worst case"
    limit = amount(allowed.limit, band.kind, units)
    title = f"Tolerances that keep {band.of} within {limit} by {by}{_among_positions(band)}"
    shown = plain_table(title, "number", "equal contribution", "least cost")
    for name, value in allowed.equal.items():
        texts = (f"± {amount(each, kinds[name], units)}" for each in (value, allowed.least_cost[name]))
        shown.add_row(name, *texts)
    return shown


def _remarks(band: ToleranceBand, allowed: Allowance | None) -> Iterator[str]:
    units = band.moving.mechanism.units
    among = _among_positions(band)
    worst = amount(float(np.atleast_1d(band.worst)[band.row]), band.kind, units)
    yield f"worst case, all deviations at their limits: off by {worst} at most{among}, to the first order"
    spread = "limits are at three standard deviations" if band.distribution == "normal" else "all within limits alike"
    yield f"statistical: deviations are independent and {band.distribution}, {spread}; pins stand on their circles"
    if band.limit is not None:
        share = 100.0 * float(np.nanmin(np.atleast_1d(band.share_within)))
        told = ""
        if band.sampled is not None and band.sampled.within_all is not None:
            told = f"; of those sampled {100.0 * band.sampled.within_all:.2f} % at all positions"
        place = f" at the worst position{among}" if band.has_rows else ""
        yield f"{share:.2f} % of all mechanisms keep the limit{place}{told}"
    if band.sampled is not None:
        worst = amount(float(band.sampled.worst.max()), band.kind, units)
        yield f"of {band.sampled.mechanisms} random mechanisms the farthest is off by {worst}{among}"
    if band.guaranteed is not None:
        worst = amount(float(band.guaranteed.worst.max()), band.kind, units)
        where = ", at any position of the motion" if band.has_rows else ""
        yield f"guaranteed: no mechanism within the tolerances is off by more than {worst}{where} (Krawczyk's operator)"
    if allowed is not None:
        yield "contributing alike: each number moves the result as far"
        yield "of least cost: the sum of what is given over what is allowed is least"
        yield f"the given tolerances could all be {format_number(allowed.factor)} times as wide instead"
    yield from band.remarks


def record(band: ToleranceBand, allowed: Allowance | None = None) -> dict[str, Any]:
    """The band as JSON values (SI), `null` where there is none."""
    told: dict[str, Any] = {
        "mechanism": band.moving.mechanism.name,
        "of": band.of,
        "result": band.result,
        "kind": band.kind,
        "distribution": band.distribution,
        "nominal": _values(band.nominal),
        "lower": _values(band.lower),
        "upper": _values(band.upper),
        "worst": _values(band.worst),
        "mean": _values(band.mean),
        "std": _values(band.std),
        "contribution": {name: _values(share) for name, share in band.contribution.items()},
        "tolerances": {each.number: [each.lower, each.upper] for each in band.variations.numbers},
        "clearance": {each.pair: each.radius for each in band.variations.offsets},
        "linear_error": band.linear_error,
        "singular_rows": list(band.singular_rows),
        "remarks": list(band.remarks),
    }
    if band.second_order is not None:
        second = band.second_order
        told["second_order"] = {"mean": _values(band._shaped(second.mean)), "std": _values(band._shaped(second.std))}
    if band.limit is not None:
        told["limit"], told["share_within"] = list(band.limit), _values(band.share_within)
    if band.sampled is not None:
        own = band.sampled._asdict().items()
        told["sampled"] = {name: _plain(value) for name, value in own if name != "deviations"}
    if band.guaranteed is not None:
        told["guaranteed"] = {name: _plain(value) for name, value in band.guaranteed._asdict().items()}
    if allowed is not None:
        told["allowed"] = allowed._asdict()
    return told


def _plain(value: Any) -> Any:
    return _values(value) if isinstance(value, np.ndarray) else value


def _values(value: Any) -> Any:
    whole = np.asarray(value, dtype=float)
    known: Array = np.where(np.isfinite(whole), whole, 0.0).astype(object)
    known[~np.isfinite(whole)] = None
    return known.tolist()
