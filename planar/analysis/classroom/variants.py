"""Variants of a problem: the same mechanism with other round numbers that go together."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from math import floor, hypot, log10
from typing import NamedTuple

import numpy as np

from planar.document.dimensions import Dimension, file_dimensions
from planar.document.first_argument import takes_mechanism
from planar.document.revised.changed_numbers import with_values
from planar.foundation.errors import BadInput, NoAnswer
from planar.foundation.time_limit import MORE_TIME, all_within_time, stop_if_over, stops_in_time
from planar.foundation.units import parse_unit
from planar.model.file_units import FileUnits, unit_of_kind
from planar.model.mechanism import Mechanism
from planar.model.pairs.guide_line import LinkLine
from planar.results.motion import State
from planar.solving.position import solve

SPREAD = 0.3
"""The part of itself by which a number differs at most from the mechanism's own."""
POSITION_SPREAD = 0.8
"""rad by which an input's angle differs at most."""
STEPS_IN_A_NUMBER = 25.0
"""A number is rounded to a round step that goes about so often into it."""
ANGLE_STEPS = {"deg": 5.0, "rad": 0.1}
"""What an input's angle is a multiple of."""
MAX_TRIES = 400
"""Draws of a variant before it is said that there is none."""
GREATEST_RATE_RATIO = 4.0
"""How many times as fast as in the mechanism itself a link may turn: beyond, it is near a dead point."""
LEAST_RATE = 0.05
"""Of the greatest rate of its kind: what is slower, and was not in the mechanism itself, is not read off a drawing."""
ON_LINE = 1e-6
"""Of its distance by which a point may be off a line that it lies on."""
GREATEST_SHIFT = 0.6
"""Sizes of the mechanism by which a point may stand elsewhere: beyond, it is another assembly."""


class Variant(NamedTuple):
    """A variant by its number, from 1 on: the mechanism, solved, and the numbers in which it differs (SI) by name."""

    number: int
    state: State
    values: dict[str, float]


@takes_mechanism
@stops_in_time
def problem_variants(
    mechanism: Mechanism,
    count: int = 30,
    seed: int = 0,
    *,
    timeout: float | None = None,  # noqa: ARG001 - of the decorator
) -> tuple[Variant, ...]:
    """So many variants of a mechanism, no two alike; variant k of a seed is the same however many there are.

    Lengths of links and the inputs' positions and rates differ from the mechanism's own by `SPREAD` at most, and are
    round in its file's units. Each goes together as the mechanism does, clear of dead points.

    Raises BadInput where it has nothing to vary, or too few variants go together; NoAnswer where the mechanism itself
    has no position, and after `timeout` s or a Ctrl-C, with the outcome "interrupted".

    >>> import planar
    >>> [round(each.values["BC.length"], 6) for each in planar.problem_variants("four-bar", 3, seed=7)]
    [0.05, 0.048, 0.054]
    """
    if isinstance(count, bool) or not isinstance(count, int) or count < 1:
        raise BadInput("count", f"a whole number of variants is wanted, not {count!r:.40}")
    base = solve(mechanism)
    varied = list(_varied_numbers(mechanism))
    if not varied:
        raise BadInput("mechanism", "there is no length and no input to vary")
    found: list[Variant] = []
    known: set[tuple[float, ...]] = {tuple(each.value for each in varied)}
    for number in all_within_time(range(1, count + 1), "variants", f"{MORE_TIME}, or ask for fewer"):
        found.append(_draw_variant(base, varied, number, np.random.default_rng([seed, number]), known))
        known.add(tuple(found[-1].values.values()))
    return tuple(found)


def _varied_numbers(mechanism: Mechanism) -> Iterator[Dimension]:
    """Lengths of links, and the inputs' numbers; nothing that is zero but for an input's angle."""
    for each in file_dimensions(mechanism).values():
        of_link = each.path[0] == "links" and each.kind == "length" and each.link != mechanism.frame
        is_length = of_link and each.path[-1] in ("length", "distance", "offset")
        of_input = each.path[0] == "inputs" and each.path[-1] in ("position", "velocity", "acceleration")
        if (is_length and each.value) or (of_input and (each.value or each.kind == "angle")):
            yield each


def _draw_variant(
    base: State, varied: list[Dimension], number: int, rng: np.random.Generator, known: set[tuple[float, ...]]
) -> Variant:
    units = base.mechanism.units
    # where the points are now tells the assembly better than a rough sketch
    places = ((name, base.point(name).position) for name, _, _ in base.mechanism.sketch)
    sketch = tuple((name, float(at[0]), float(at[1])) for name, at in places)
    mechanism = replace(base.mechanism, sketch=sketch)
    for _ in range(MAX_TRIES):
        stop_if_over(f"before variant {number} was drawn", f"{MORE_TIME}, or ask for fewer")
        values = {each.name: _draw_number(each, units, rng) for each in varied}
        if tuple(values.values()) in known:
            continue
        try:
            state = solve(with_values(mechanism, values))
        except (NoAnswer, BadInput):
            continue
        if _is_alike(state, base):
            return Variant(number, state, values)
    raise BadInput("mechanism", f"no variant {number} was found that goes together in {MAX_TRIES} draws")


def _draw_number(dimension: Dimension, units: FileUnits, rng: np.random.Generator) -> float:
    """A round number near the mechanism's own (SI)."""
    if dimension.kind == "angle":
        unit, step = parse_unit(units.angle), ANGLE_STEPS.get(units.angle, 0.1)
        at = dimension.value + rng.uniform(-POSITION_SPREAD, POSITION_SPREAD)
        return unit.to_si(step * round(unit.from_si(at) / step))
    unit = unit_of_kind(dimension.kind, units)[1]
    value = unit.from_si(dimension.value)
    step = _round_step(abs(value) / STEPS_IN_A_NUMBER)
    drawn = step * round(value * (1.0 + rng.uniform(-SPREAD, SPREAD)) / step)
    return unit.to_si(float(f"{drawn:.12g}"))


def _round_step(size: float) -> float:
    """1, 2 or 5 times a power of ten, not above a size."""
    power = 10.0 ** floor(log10(size))
    return max(each for each in (1.0, 2.0, 5.0) if each * power <= size * (1.0 + 1e-9)) * power


def _is_alike(state: State, base: State) -> bool:
    """Whether a variant is the assembly that the mechanism is, as clear of dead points, and as fit to be drawn."""
    size = max(hypot(*each.position) for each in base.points.values())
    shifts = (hypot(*(state.point(name).position - each.position)) for name, each in base.points.items())
    if max(shifts, default=0.0) > GREATEST_SHIFT * size:
        return False
    if _slots_held(base) - _slots_held(state):
        return False  # what slides is drawn beyond the end of its slot
    turning, before = _turning_rates(state), _turning_rates(base)
    if max(turning, default=0.0) > GREATEST_RATE_RATIO * max(before, default=0.0):
        return False
    kinds = (turning, before), (_point_rates(state), _point_rates(base))
    return all(_is_readable(*each) for each in kinds)


def _slots_held(state: State) -> set[str]:
    """The pairs of which what slides is between the ends of its line, as far as points of the link lie on that."""
    found = set()
    for pair in state.mechanism.pairs:
        line = getattr(pair, "line", None)
        reach = state.pair(pair.name).get("displacement") if isinstance(line, LinkLine) else None
        if reach is None or not isinstance(line, LinkLine):
            continue
        shape = state.shapes[pair.links[0]]
        x, y, along_x, along_y = line.measure_line(shape)
        offsets = [(place.x - x, place.y - y) for place in shape.points.values()]
        on_line = [
            dx * along_x + dy * along_y
            for dx, dy in offsets
            if abs(dx * along_y - dy * along_x) <= ON_LINE * hypot(dx, dy)
        ]
        if len(on_line) > 1 and min(on_line) <= reach <= max(on_line):
            found.add(pair.name)
    return found


def _is_readable(rates: list[float], before: list[float]) -> bool:
    """Whether none of the rates is all but nothing that was not so before."""
    least, least_before = (LEAST_RATE * max(each, default=0.0) for each in (rates, before))
    return all(rate >= least or own < least_before for rate, own in zip(rates, before, strict=True))


def _turning_rates(state: State) -> list[float]:
    return [abs(each.angular_velocity) for each in state.links.values()]


def _point_rates(state: State) -> list[float]:
    return [hypot(*each.velocity) for each in state.points.values()]
