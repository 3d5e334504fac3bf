"""Harmonics, strokes and two-term formulas as text for a terminal, and as JSON values."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from math import floor, log10, pi
from typing import Any, NamedTuple

import numpy as np
from rich.console import Group, RenderableType
from rich.text import Text

from planar.analysis.motion.analytical_route import Formula, OnRod, Route
from planar.analysis.motion.harmonics import Harmonics
from planar.foundation.units import length_of_rates, unit
from planar.model.mechanism import Mechanism, Units
from planar.model.wording import amount, many
from planar.reports.tables_of_numbers import paragraphs, plain_table
from planar.results.motion import Array

NEGLIGIBLE, DIGITS = 1e-5, 6
"""Of the greatest harmonic: those after the last that is more are not printed. Digits of the greatest."""
MOST = 40
"""Harmonics printed at the most."""
SEAM = 1e-10
"""rad: so near to the end of a turn is its start."""
ZERO = 1e-12
"""Of what stands beside it: a number that is less is round-off."""


def analytical(mechanism: Mechanism, routes: Sequence[Route]) -> RenderableType:
    """What was found of slides and points, one after the other."""
    first = routes[0]
    running = first.series[0].input
    at = f"{running} = {amount(first.position, 'angle', mechanism.units)}"
    rate = f"at the steady rate of the file, {_number(first.rate)} rad/s"
    rate = "rates per radian of it, as its velocity in the file is 0" if first.per_unit else rate
    parts: list[RenderableType] = [Text(mechanism.name, style="bold")]
    if mechanism.source:
        parts.append(Text(mechanism.source, style="italic"))
    parts.append(Text(f"over a turn of {running}, {rate}; here is {at}"))
    for route in routes:
        parts += [Text(), *_route(route, mechanism.units)]
    if mechanism.notes:  # where chapters slip in just these formulas
        parts += [Text(), Text("Notes", style="bold"), paragraphs(("-", note) for note in mechanism.notes)]
    return Group(*parts)


class _Per(NamedTuple):
    """The units of velocity and acceleration, by time or by the input's angle, and how many of the length are 1 m."""

    velocity: str
    acceleration: str
    by: float


def _route(route: Route, units: Units) -> Iterator[RenderableType]:
    point = route.series[0].axis is not None
    yield Text(f"{'Point' if point else 'Slide'} {route.of}", style="bold")
    name, length = length_of_rates(units.length)
    per = _Per(*((f"{name}/rad", f"{name}/rad²") if route.per_unit else (f"{name}/s", f"{name}/s²")), length.from_si(1))
    yield paragraphs(_said(route, units, per))
    yield _harmonics(route.series, units)
    if route.formula is not None:
        yield _formula(route.formula, units, per)
    for rod in route.rods:
        yield _rod(rod, units, per)


def _said(route: Route, units: Units, per: _Per) -> Iterator[tuple[str, str]]:
    """Stroke, greatest speed, mean, and what the slide is, in words."""
    stroke = route.series[0].stroke
    if stroke is not None:
        told = (
            f"{word} at {_angle(end.input, units)}, displacement {_length(end.value, units)}"
            for word, end in (("TDC", stroke.top), ("BDC", stroke.bottom))
        )
        yield "stroke", f"{_length(stroke.length, units)}: {'; '.join(told)}"
    fastest = f"{_number(route.fastest.value * per.by)} {per.velocity} at {_angle(route.fastest.input, units)}"
    if route.formula is not None:
        by_two = route.formula.fastest
        fastest += f"; by two terms {_number(by_two.value * per.by)} {per.velocity} at {_angle(by_two.input, units)}"
    yield "greatest speed", fastest
    if route.piston is not None:
        one = route.piston
        told = f"crank r = {_length(one.r, units)}, rod l = {_length(one.l, units)}, n = l/r = {_number(one.n)}"
        if route.formula is None:
            told += f"; the stroke passes the crank's axis {_length(abs(one.offset), units)} off, where the two-term "
            told += "formula does not hold"
        yield "piston", told


def _harmonics(series: tuple[Harmonics, ...], units: Units) -> RenderableType:
    """c_n cos n theta + s_n sin n theta, theta being the position of the input."""
    scale = max(float(each.amplitudes.max()) for each in series)
    count = min(max(_count(each.amplitudes, scale) for each in series), MOST)
    heads = [
        f"{prefix}{name}, {units.length}" for prefix in _prefixes(series) for name in ("cosine", "sine", "amplitude")
    ]
    title = "Harmonics of the displacement" if series[0].axis is None else "Harmonics of x and y"
    table = plain_table(title, "n", *heads, left=())
    length = unit(units.length)
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
    left = f"; {many(most - count, 'more harmonic')} to round-off with --json" if most > count else ""
    positions = max(each.positions for each in series)
    note = f"mean + sum of cosine cos(n theta) + sine sin(n theta), theta the position of {series[0].input};"
    return Group(table, *(Text(text, style="italic") for text in (note, f"from {positions} exact positions{left}")))


def _prefixes(series: tuple[Harmonics, ...]) -> list[str]:
    return [f"{each.axis} " if each.axis else "" for each in series]


def _count(amplitudes: Array, scale: float) -> int:
    large = np.flatnonzero(amplitudes > NEGLIGIBLE * scale)
    return int(large[-1]) + 1 if len(large) else 1


def _formula(formula: Formula, units: Units, per: _Per) -> RenderableType:
    """The two-term formulas beside what is exact."""
    title = f"Piston from TDC, crank at {_angle(formula.theta, units)} from it"
    table = plain_table(
        title, "", ("exact", "two terms", "unit"), "off here", ("greatest error in a turn", "at"), left=(0, 3)
    )
    length = unit(units.length)
    names = (("displacement", units.length), ("velocity", per.velocity), ("acceleration", per.acceleration))
    scales = (length.from_si(1.0), per.by, per.by)
    for (name, measure), by, exact, two, off in zip(
        names, scales, formula.exact, formula.here, formula.deviations, strict=True
    ):
        table.add_row(
            name,
            *(_number(each * by) for each in (exact, two)),
            measure,
            _off(two, exact),
            _part(off.part),
            _angle(off.theta, units),
        )
    note = (
        "positive away from TDC; off here in parts of the exact value here, greatest errors in parts of the greatest"
        " exact value, at crank angles from TDC"
    )
    return Group(table, Text(note, style="italic"))


def _rod(rod: OnRod, units: Units, per: _Per) -> RenderableType:
    """A point of a rod by the two-term formulas beside what is exact."""
    title = f"On the rod of {rod.piston.pair}, {_length(rod.b, units)} from the piston"
    table = plain_table(title, "", ("exact", "two terms", "unit"), "off", left=(0, 3))
    length = unit(units.length)
    names = (
        ("", units.length, length.from_si(1.0)),
        ("velocity", per.velocity, per.by),
        ("acceleration", per.acceleration, per.by),
    )
    for (name, measure, by), exact, two in zip(names, rod.exact, rod.here, strict=True):
        rows = [(f"{name} {axis}".strip(), float(exact[k]), float(two[k])) for k, axis in enumerate("xy")]
        if name:
            rows.append((name, float(np.hypot(*exact)), float(np.hypot(*two))))
        for what, solved, told in rows:
            table.add_row(what, _number(solved * by), _number(told * by), measure, _off(told, solved))
    note = "x from the crank's axis towards the piston, y to the left of that"
    return Group(table, Text(note, style="italic"))


def _off(value: float, exact: float) -> str:
    return f"{100.0 * (value - exact) / exact + 0.0:+.3f} %" if exact else ""


def _part(part: float) -> str:
    return f"{100.0 * part:.3f} %"


def _angle(value: float, units: Units) -> str:
    """A place of the turn."""
    turned = (value + SEAM) % (2.0 * pi) - SEAM
    return amount(turned if abs(turned) > SEAM else 0.0, "angle", units)


def _length(value: float, units: Units) -> str:
    return amount(value if abs(value) > ZERO else 0.0, "length", units)


def _number(value: float) -> str:
    return "0" if abs(value) < 1e-14 else f"{value:.6g}"


def record(mechanism: Mechanism, routes: Iterable[Route]) -> dict[str, Any]:
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
        "slides": {each.of: _recorded(each) for each in found if each.series[0].axis is None},
        "points": {each.of: _recorded(each) for each in found if each.series[0].axis is not None},
    }


def _recorded(route: Route) -> dict[str, Any]:
    names = ("position" if route.series[0].axis else "displacement", "velocity", "acceleration")
    here = {name: _plain(part) for name, part in zip(names, route.here, strict=True)}
    found: dict[str, Any] = {"greatest_speed": route.fastest._asdict(), "here": here}
    if route.series[0].axis is not None:
        found |= {each.axis: _series(each) for each in route.series if each.axis}
        found["rods"] = [_on_rod(rod) for rod in route.rods]
        return found
    (series,) = route.series
    stroke = series.stroke
    found["stroke"] = stroke and {
        "length": stroke.length,
        "top": stroke.top._asdict(),
        "bottom": stroke.bottom._asdict(),
    }
    found |= _series(series)
    one, formula = route.piston, route.formula
    found["piston"] = one and {"r": one.r, "l": one.l, "n": one.n, "offset": one.offset, "in_line": one.in_line}
    if one is not None:
        found["piston"]["two_terms"] = formula and {
            "theta": formula.theta,
            "here": dict(zip(names, formula.here, strict=True)),
            "exact": dict(zip(names, formula.exact, strict=True)),
            "errors": {name: each._asdict() for name, each in zip(names, formula.deviations, strict=True)},
            "greatest_speed": formula.fastest._asdict(),
        }
    return found


def _plain(part: Array) -> Any:
    return part.tolist() if len(part) > 1 else float(part[0])


def _series(each: Harmonics) -> dict[str, Any]:
    rows = zip(each.cosines, each.sines, each.amplitudes, each.phases, strict=True)
    names = ("cosine", "sine", "amplitude", "phase")
    return {
        "mean": each.mean,
        "harmonics": [{"n": n} | dict(zip(names, map(float, row), strict=True)) for n, row in enumerate(rows, start=1)],
        "positions": each.positions,
        "rest": each.rest,
    }


def _on_rod(rod: OnRod) -> dict[str, Any]:
    def listed(point: Any) -> dict[str, Any]:
        return {name: part.tolist() for name, part in point._asdict().items()}

    return {"piston": rod.piston.pair, "b": rod.b, "two_terms": listed(rod.here), "exact": listed(rod.exact)}
