"""Harmonics, strokes and two-term formulas as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import floor, log10, pi
from typing import Any, NamedTuple

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.motion.analytical_route import AnalyticalRoute, RodPointComparison, TwoTermComparison
from planar.analysis.motion.harmonics import Harmonics
from planar.foundation.arrays import Array
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, display_unit, unit_by_input
from planar.model.mechanism import Mechanism
from planar.model.wording import amount, count_phrase
from planar.reports.fitted_table import plain_table
from planar.reports.number_format import paragraphs

NEGLIGIBLE_RATIO, DIGITS = 1e-5, 6
"""Of the greatest harmonic: those after the last that is more are not printed. Digits of the greatest."""
MAX_HARMONICS = 40
"""Harmonics printed at the most."""
TURN_END_TOLERANCE = 1e-10
"""rad: so near to the end of a turn is its start."""
ZERO_RATIO = 1e-12
"""Of what stands beside it: a number that is less is round-off."""


def analytical_tables(mechanism: Mechanism, routes: Sequence[AnalyticalRoute]) -> RenderableType:
    """What was found of slides and points, one after the other."""
    first = routes[0]
    running = first.series[0].input
    at = f"{running} = {amount(first.position, 'angle', mechanism.units)}"
    rate = f"at the steady rate of the file, {_rate_text(first.rate, mechanism.units)}"
    rate = "rates per radian of it, as its velocity in the file is 0" if first.per_unit else rate
    parts: list[RenderableType] = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        parts.append(Text(mechanism.source, style="italic"))
    parts.append(Text(f"over a turn of {running}, {rate}; here is {at}"))
    for route in routes:
        parts += [Text(), *_route_tables(route, mechanism.units)]
    if mechanism.notes:  # where chapters slip in just these formulas
        parts += [Text(), Text("Notes", style="bold"), paragraphs(("-", note) for note in mechanism.notes)]
    return Group(*parts)


def _rate_text(rate: float, units: FileUnits) -> str:
    name, of = display_unit("angular velocity", units)
    return f"{_format_number(of.from_si(rate))} {name}"


class _RateUnits(NamedTuple):
    """The units of velocity and acceleration, by time or by the input's angle, and how many of each are one in SI."""

    velocity: str
    acceleration: str
    per_si: tuple[float, float]


def _route_tables(route: AnalyticalRoute, units: FileUnits) -> Iterator[RenderableType]:
    point = route.series[0].axis is not None
    yield Text(f"{'Point' if point else 'Slide'} {route.of}", style="bold")
    if route.per_unit:
        found = [unit_by_input(True, order, False, units) for order in (1, 2)]
    else:
        shown = [display_unit(kind, units) for kind in ("velocity", "acceleration")]
        found = [(name, of.from_si(1.0)) for name, of in shown]
    (velocity, first), (acceleration, second) = found
    per = _RateUnits(velocity, acceleration, (first, second))
    yield paragraphs(_route_facts(route, units, per))
    yield _harmonics_table(route.series, units)
    if route.formula is not None:
        yield _formula_table(route.formula, units, per)
    for rod in route.rods:
        yield _rod_table(rod, units, per)


def _route_facts(route: AnalyticalRoute, units: FileUnits, per: _RateUnits) -> Iterator[tuple[str, str]]:
    """Stroke, greatest speed, mean, and what the slide is, in words."""
    stroke = route.series[0].stroke
    if stroke is not None:
        ends = (
            f"{word} at {_angle_text(end.input, units)}, displacement {_length_text(end.value, units)}"
            for word, end in (("TDC", stroke.top), ("BDC", stroke.bottom))
        )
        yield "stroke", f"{_length_text(stroke.length, units)}: {'; '.join(ends)}"
    fastest = (
        f"{_format_number(route.fastest.value * per.per_si[0])} {per.velocity} at "
        f"{_angle_text(route.fastest.input, units)}"
    )
    if route.formula is not None:
        by_two = route.formula.fastest
        fastest += (
            f"; by two terms {_format_number(by_two.value * per.per_si[0])} {per.velocity} at "
            f"{_angle_text(by_two.input, units)}"
        )
    yield "greatest speed", fastest
    if route.piston is not None:
        one = route.piston
        told = (
            f"crank r = {_length_text(one.r, units)}, rod l = {_length_text(one.l, units)}, n = l/r = "
            f"{_format_number(one.n)}"
        )
        if route.formula is None:
            told += (
                f"; the stroke passes the crank's axis {_length_text(abs(one.offset), units)} off, where the two-term "
            )
            told += "formula does not hold"
        yield "piston", told


def _harmonics_table(series: tuple[Harmonics, ...], units: FileUnits) -> RenderableType:
    """c_n cos n theta + s_n sin n theta, theta being the position of the input."""
    scale = max(float(each.amplitudes.max()) for each in series)
    count = min(max(_significant_count(each.amplitudes, scale) for each in series), MAX_HARMONICS)
    heads = [
        f"{prefix}{name}, {units.length}" for prefix in _prefixes(series) for name in ("cosine", "sine", "amplitude")
    ]
    title = "Harmonics of the displacement" if series[0].axis is None else "Harmonics of x and y"
    table = plain_table(title, "n", *heads, left=())
    length = parse_unit(units.length)
    digits = max(DIGITS - 1 - floor(log10(length.from_si(scale))), 0) if scale else 0

    def shown(value: float) -> str:
        return f"{round(length.from_si(value), digits) + 0.0:.{digits}f}"

    means = [text for each in series for text in (shown(each.mean), "", "")]
    table.add_row("mean", *means)
    for k in range(count):
        row = []
        for each in series:
            some = [part[k] if k < len(part) else 0.0 for part in (each.cosines, each.sines, each.amplitudes)]
            row += [shown(float(value)) for value in some]
        table.add_row(str(k + 1), *row)
    most = max(len(each.cosines) for each in series)
    left = f"; {count_phrase(most - count, 'more harmonic')} to round-off with --json" if most > count else ""
    positions = max(each.positions for each in series)
    note = f"mean + sum of cosine cos(n theta) + sine sin(n theta), theta the position of {series[0].input};"
    return Group(table, *(Text(text, style="italic") for text in (note, f"from {positions} exact positions{left}")))


def _prefixes(series: tuple[Harmonics, ...]) -> list[str]:
    return [f"{each.axis} " if each.axis else "" for each in series]


def _significant_count(amplitudes: Array, scale: float) -> int:
    large = np.flatnonzero(amplitudes > NEGLIGIBLE_RATIO * scale)
    return int(large[-1]) + 1 if len(large) else 1


def _formula_table(formula: TwoTermComparison, units: FileUnits, per: _RateUnits) -> RenderableType:
    """The two-term formulas beside what is exact."""
    title = f"Piston from TDC, crank at {_angle_text(formula.theta, units)} from it"
    table = plain_table(
        title, "", ("exact", "two terms", "unit"), "off here", ("greatest error in a turn", "at"), left=(0, 3)
    )
    length = parse_unit(units.length)
    names = (("displacement", units.length), ("velocity", per.velocity), ("acceleration", per.acceleration))
    scales = (length.from_si(1.0), *per.per_si)
    for (name, measure), by, exact, two, off in zip(
        names, scales, formula.exact, formula.here, formula.deviations, strict=True
    ):
        table.add_row(
            name,
            *(_format_number(each * by) for each in (exact, two)),
            measure,
            _deviation_text(two, exact),
            _percent_text(off.part),
            _angle_text(off.theta, units),
        )
    note = (
        "positive away from TDC; off here in parts of the exact value here, greatest errors in parts of the greatest"
        " exact value, at crank angles from TDC"
    )
    return Group(table, Text(note, style="italic"))


def _rod_table(rod: RodPointComparison, units: FileUnits, per: _RateUnits) -> RenderableType:
    """A point of a rod by the two-term formulas beside what is exact."""
    title = f"On the rod of {rod.piston.pair}, {_length_text(rod.b, units)} from the piston"
    table = plain_table(title, "", ("exact", "two terms", "unit"), "off", left=(0, 3))
    length = parse_unit(units.length)
    names = (
        ("", units.length, length.from_si(1.0)),
        ("velocity", per.velocity, per.per_si[0]),
        ("acceleration", per.acceleration, per.per_si[1]),
    )
    for (name, measure, by), exact, two in zip(names, rod.exact, rod.here, strict=True):
        rows = [(f"{name} {axis}".strip(), float(exact[k]), float(two[k])) for k, axis in enumerate("xy")]
        if name:
            rows.append((name, float(np.hypot(*exact)), float(np.hypot(*two))))
        for what, solved, told in rows:
            table.add_row(
                what, _format_number(solved * by), _format_number(told * by), measure, _deviation_text(told, solved)
            )
    note = "x from the crank's axis towards the piston, y to the left of that"
    return Group(table, Text(note, style="italic"))


def _deviation_text(value: float, exact: float) -> str:
    return f"{100.0 * (value - exact) / exact + 0.0:+.3f} %" if exact else ""


def _percent_text(part: float) -> str:
    return f"{100.0 * part:.3f} %"


def _angle_text(value: float, units: FileUnits) -> str:
    """A place of the turn."""
    turned = (value + TURN_END_TOLERANCE) % (2.0 * pi) - TURN_END_TOLERANCE
    return amount(turned if abs(turned) > TURN_END_TOLERANCE else 0.0, "angle", units)


def _length_text(value: float, units: FileUnits) -> str:
    return amount(value if abs(value) > ZERO_RATIO else 0.0, "length", units)


def _format_number(value: float) -> str:
    return "0" if abs(value) < 1e-14 else f"{value:.6g}"


def record(mechanism: Mechanism, routes: Iterable[AnalyticalRoute]) -> dict[str, Any]:
    """What was found as a JSON value in SI; angles in rad, positions those of the input."""
    found = list(routes)
    first = found[0]
    return {
        "mechanism": mechanism.name,
        "input": {
            "pair": first.series[0].input,
            "position": first.position,
            "rate": first.rate,
            "per_unit": first.per_unit,
        },
        "slides": {each.of: _route_record(each) for each in found if each.series[0].axis is None},
        "points": {each.of: _route_record(each) for each in found if each.series[0].axis is not None},
    }


def _route_record(route: AnalyticalRoute) -> dict[str, Any]:
    names = ("position" if route.series[0].axis else "displacement", "velocity", "acceleration")
    here = {name: _to_json(part) for name, part in zip(names, route.here, strict=True)}
    found: dict[str, Any] = {"greatest_speed": route.fastest._asdict(), "here": here}
    if route.series[0].axis is not None:
        found |= {each.axis: _series_record(each) for each in route.series if each.axis}
        found["rods"] = [_rod_record(rod) for rod in route.rods]
        return found
    (series,) = route.series
    stroke = series.stroke
    found["stroke"] = stroke and {
        "length": stroke.length,
        "top": stroke.top._asdict(),
        "bottom": stroke.bottom._asdict(),
    }
    found |= _series_record(series)
    one, formula = route.piston, route.formula
    found["piston"] = one and {"r": one.r, "l": one.l, "n": one.n, "offset": one.offset, "in_line": one.is_in_line}
    if one is not None:
        found["piston"]["two_terms"] = formula and {
            "theta": formula.theta,
            "here": dict(zip(names, formula.here, strict=True)),
            "exact": dict(zip(names, formula.exact, strict=True)),
            "errors": {name: each._asdict() for name, each in zip(names, formula.deviations, strict=True)},
            "greatest_speed": formula.fastest._asdict(),
        }
    return found


def _to_json(part: Array) -> Any:
    return part.tolist() if len(part) > 1 else float(part[0])


def _series_record(each: Harmonics) -> dict[str, Any]:
    rows = zip(each.cosines, each.sines, each.amplitudes, each.phases, strict=True)
    names = ("cosine", "sine", "amplitude", "phase")
    return {
        "mean": each.mean,
        "harmonics": [{"n": n} | dict(zip(names, map(float, row), strict=True)) for n, row in enumerate(rows, start=1)],
        "positions": each.positions,
        "rest": each.rest,
    }


def _rod_record(rod: RodPointComparison) -> dict[str, Any]:
    def listed(point: Any) -> dict[str, Any]:
        return {name: part.tolist() for name, part in point._asdict().items()}

    return {"piston": rod.piston.pair, "b": rod.b, "two_terms": listed(rod.here), "exact": listed(rod.exact)}
