"""Closed forms of blocks of two unknowns: both assemblies, derived from their equations.

Two constraints whose unknowns are angles, entering by their cosines and sines, or lengths, are an equation of complex
numbers, in one of three forms where a, b, d, g do not depend on the unknowns and e is the unit vector of an angle:

    a e1 + b e2 + g = 0      two angles, as between three turning pairs: |g + a e1| = |b|
    a e1 + d s + g = 0       an angle and a length along a direction that is known: |g + d s| = |a|
    (a + d s) e1 + g = 0     an angle and a length along a direction that turns with it: |a + d s| = |g|

Each is a quadratic equation. Its two roots are the two assemblies; they meet at a dead point of the group.
"""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np

from planar.equations.casadi_functions import formula_text, is_piecewise_in, recorded_function
from planar.equations.elimination import stack_expressions
from planar.equations.symbolic_equations import Block, ConstraintEquations, slice_length
from planar.foundation.arrays import Array
from planar.foundation.generic_numbers import generic_numbers
from planar.foundation.recorded_formula import RecordedFormula
from planar.model.pairs import MeasureKind

ZERO_TOLERANCE = 1e-10
"""Of numbers about one: what is rounding."""
SAMPLE_POINTS = 3
"""Random places at which a form is compared with the equations."""


class ClosedForm(NamedTuple):
    """One block in closed form, as expressions in the symbols of its equations and in `sign`.

    `values`: for each unknown the cos and sin of an angle, or a length alone, given those of earlier blocks; `sign`: +1
    or -1, which of the two assemblies; `sign_expression`: in all unknowns, has this sign; `coalescence`: 0 to 1, where
    both assemblies meet, beyond it there is none: the squared cosine of the angle between what holds the block.
    `squared_arm`: of the arm on which a length turns, where that changes as the mechanism moves; else None. `cosine`:
    that cosine itself, which changes sign between the two dead points and so varies as slowly as what holds the block;
    None where an arm changes, for which `margin` is the square of the arm less that of the shortest that can be
    assembled. `squared_lengths` (2,): of the Jacobian's columns.
    """

    values: tuple[tuple[ca.SX, ...], ...]
    sign: ca.SX
    sign_expression: ca.SX
    coalescence: ca.SX
    squared_lengths: ca.SX
    squared_arm: ca.SX | None = None
    cosine: ca.SX | None = None
    margin: ca.SX | None = None


class _ComplexNumber(NamedTuple):
    """A complex number."""

    x: ca.SX
    y: ca.SX

    def __add__(self, other: _ComplexNumber) -> _ComplexNumber:  # type: ignore[override]
        return _ComplexNumber(self.x + other.x, self.y + other.y)

    def __neg__(self) -> _ComplexNumber:
        return _ComplexNumber(-self.x, -self.y)

    def multiply(self, other: _ComplexNumber) -> _ComplexNumber:
        return _ComplexNumber(self.x * other.x - self.y * other.y, self.y * other.x + self.x * other.y)

    def scale(self, factor: ca.SX) -> _ComplexNumber:
        return _ComplexNumber(self.x * factor, self.y * factor)

    def dot(self, other: _ComplexNumber) -> ca.SX:
        """The product with the other's conjugate, its real part: how far this goes along that."""
        return self.x * other.x + self.y * other.y

    def cross(self, other: _ComplexNumber) -> ca.SX:
        """The same, its imaginary part: positive where this is to the left of that."""
        return self.y * other.x - self.x * other.y

    @property
    def squared_length(self) -> ca.SX:
        return self.dot(self)

    @property
    def conjugate(self) -> _ComplexNumber:
        return _ComplexNumber(self.x, -self.y)


def find_closed_form(e: ConstraintEquations, stage: Block) -> ClosedForm | None:
    """The closed form of a block; None where it has none of the three forms."""
    if stage.is_free or not slice_length(stage.rows) == slice_length(stage.unknowns) == 2:
        return None
    angles = tuple(e.coordinates[column].kind is MeasureKind.ANGLE for column in e.unknowns[stage.unknowns])
    if not any(angles) or any(row.kind is MeasureKind.ANGLE for row in e.rows[stage.rows]):
        return None
    rows, unknowns = e.F[stage.rows], e.z[stage.unknowns]
    others = ca.vertcat(ca.SX(0, 1), *(symbol for symbol in ca.symvar(rows) if not ca.depends_on(unknowns, symbol)))
    derived = _derive_form(formula_text(rows, unknowns, others), angles)
    if derived is None:
        return None
    function, part_counts, has_arm = derived
    sign = ca.SX.sym("sign")
    *results, lengths, arm, slow = function(unknowns, others, sign)
    parts = iter(results)
    values = tuple(tuple(next(parts) for _ in range(count)) for count in part_counts)
    side, coalescence = parts
    # one function has both kinds: of the last number only one is asked for
    changing = (arm, None, slow) if has_arm else (None, slow, None)
    return ClosedForm(values, sign, side, coalescence, lengths, *changing)


def closed_form_formula(e: ConstraintEquations, block: Block) -> tuple[RecordedFormula | None, bool]:
    """The formula (z, u, p, sign) of a block's unknowns in closed form, then of where its assemblies meet, None where
    it has none; and whether a length turns on an arm that changes as the mechanism moves."""
    form = find_closed_form(e, block)
    if form is None:
        return None, False
    values = stack_expressions(ca.atan2(*parts[::-1]) if len(parts) == 2 else parts[0] for parts in form.values)
    function = ca.Function("form", [e.z, e.u, e.p, form.sign], [ca.densify(values), form.coalescence])
    return recorded_function(function), form.squared_arm is not None


@lru_cache(maxsize=1024)
def _derive_form(formula: str, angles: tuple[bool, ...]) -> tuple[ca.Function, tuple[int, ...], bool] | None:
    """The closed form of rows that are a function, as casadi writes it, of two unknowns, some of them angles, and of
    other symbols: once for all blocks of that formula.

    A function (unknowns, other symbols, sign) -> the parts of the values one after the other, and what else a
    `ClosedForm` holds; how many parts each value has, and whether there is an arm.
    """
    function = ca.Function.deserialize(formula)
    both, others = (ca.SX.sym(name, function.numel_in(k)) for k, name in enumerate(("unknowns", "others")))
    rows = function(both, others)
    if is_piecewise_in(rows, both):
        return None
    first = 0 if angles[0] else 1
    form = (_solve_two_angles if all(angles) else _solve_angle_and_length)(rows, [both[first], both[1 - first]])
    if form is None:
        return None
    values = form.values[::-1] if first else form.values
    arm = ca.SX(0.0) if form.squared_arm is None else form.squared_arm
    slow = form.cosine if form.margin is None else form.margin
    assert slow is not None
    results = [*(part for value in values for part in value), form.sign_expression, form.coalescence]
    outputs = [ca.densify(result) for result in (*results, form.squared_lengths, arm, slow)]
    part_counts = tuple(len(value) for value in values)
    derived = ca.Function("form", [both, others, form.sign], outputs)
    return derived, part_counts, form.squared_arm is not None


def _solve_two_angles(rows: ca.SX, unknowns: list[ca.SX]) -> ClosedForm | None:
    one, two = unknowns
    by_one = _cos_sin_coefficients(ca.substitute(rows, two, 0.0), one)
    by_two = _cos_sin_coefficients(ca.substitute(rows, one, 0.0), two)
    rest = ca.substitute(rows, ca.vertcat(one, two), ca.SX.zeros(2)) - by_one[0] - by_two[0]
    model = rest + _combine_cos_sin(*by_one, one) + _combine_cos_sin(*by_two, two)
    signs = _rotation_senses(rows - model, [by_one, by_two])
    if signs is None or 0 in signs:
        return None
    a, b, g = (_rows_as_complex(part, signs) for part in (by_one[0], by_two[0], rest))
    d = -g
    sign = ca.SX.sym("sign")
    # the square of four times a triangle's area, as Heron has it: so nothing cancels where the angles are small
    one_length, other_length = ca.sqrt(a.squared_length), ca.sqrt(b.squared_length)
    least, greatest = one_length - other_length, one_length + other_length
    area = (d.squared_length - least * least) * (greatest * greatest - d.squared_length)
    half = 0.5 * sign / d.squared_length  # the only division by what varies; the sign's square is one
    along = 0.5 + (a.squared_length - b.squared_length) * sign * half
    reached = d.scale(along) + _ComplexNumber(-d.y, d.x).scale(ca.sqrt(area) * half)
    e1 = reached.multiply(a.conjugate).scale(1.0 / a.squared_length)
    e2 = (d + -reached).multiply(b.conjugate).scale(1.0 / b.squared_length)
    side = a.multiply(_unit_number(one)).cross(b.multiply(_unit_number(two)))
    coalescence = 1.0 - area / (4.0 * a.squared_length * b.squared_length)
    lengths = ca.vertcat(a.squared_length, b.squared_length)
    cosine = (d.squared_length - a.squared_length - b.squared_length) / (2.0 * one_length * other_length)
    return ClosedForm((tuple(e1), tuple(e2)), sign, side, coalescence, lengths, None, cosine)


def _solve_angle_and_length(rows: ca.SX, unknowns: list[ca.SX]) -> ClosedForm | None:
    turn, slide = unknowns
    still = ca.substitute(rows, slide, 0.0)
    moved = ca.substitute(ca.jacobian(rows, slide), slide, 0.0)
    turned = _cos_sin_coefficients(still, turn)
    turned_slide = _cos_sin_coefficients(moved, turn)
    fixed_rows, fixed_slide = (
        ca.substitute(part, turn, 0.0) - by_turn[0] for part, by_turn in ((still, turned), (moved, turned_slide))
    )
    model = fixed_rows + _combine_cos_sin(*turned, turn)
    model = model + slide * (fixed_slide + _combine_cos_sin(*turned_slide, turn))
    signs = _rotation_senses(rows - model, [turned, turned_slide])
    if signs is None:
        return None
    parts = fixed_slide, turned_slide[0], turned[0]
    is_zero = [bool(np.all(np.abs(values) < ZERO_TOLERANCE)) for values in _evaluate_at_random(list(parts))]
    fixed, d, a, g = (_rows_as_complex(part, signs) for part in (*parts, fixed_rows))
    sign = ca.SX.sym("sign")
    if is_zero[1] and not is_zero[0] and not is_zero[2]:
        # the length goes along a direction that is known
        direction, base, reach = fixed, g, a
    elif is_zero[0] and not is_zero[1]:
        direction, base, reach = d, a, g
    else:
        return None
    gap, spanned = base.cross(direction), reach.squared_length * direction.squared_length
    length = (sign * ca.sqrt(spanned - gap * gap) - base.dot(direction)) / direction.squared_length
    side = direction.squared_length * slide + base.dot(direction)
    if direction is fixed:
        unit = (-(g + direction.scale(length))).multiply(a.conjugate).scale(1.0 / a.squared_length)
    else:
        unit = (-g).multiply((a + d.scale(length)).conjugate).scale(1.0 / g.squared_length)
    margin = reach.squared_length - gap * gap / direction.squared_length
    changing = (None, gap / ca.sqrt(spanned)) if direction is fixed else (g.squared_length, None, margin)
    lengths = ca.vertcat(reach.squared_length, direction.squared_length)
    return ClosedForm((tuple(unit), (length,)), sign, side, gap * gap / spanned, lengths, *changing)


def _cos_sin_coefficients(rows: ca.SX, angle: ca.SX) -> tuple[ca.SX, ca.SX]:
    """By what the cos and the sin of an angle are multiplied in rows that depend on it by these alone."""
    slope = ca.jacobian(rows, angle)
    return -ca.substitute(ca.jacobian(slope, angle), angle, 0.0), ca.substitute(slope, angle, 0.0)


def _combine_cos_sin(cosine: ca.SX, sine: ca.SX, angle: ca.SX) -> ca.SX:
    return cosine * ca.cos(angle) + sine * ca.sin(angle)


def _unit_number(angle: ca.SX) -> _ComplexNumber:
    return _ComplexNumber(ca.cos(angle), ca.sin(angle))


def _rows_as_complex(rows: ca.SX, signs: list[int]) -> _ComplexNumber:
    """Two rows as a complex number: the other way round where that makes angles turn to the left."""
    rows = ca.densify(rows)
    return _ComplexNumber(rows[1], rows[0]) if -1 in signs else _ComplexNumber(rows[0], rows[1])


def _rotation_senses(gap: ca.SX, turned: list[tuple[ca.SX, ca.SX]]) -> list[int] | None:
    """Which way every pair of factors turns: +1 left, -1 right, 0 where both vanish; None where the form is not it.

    Left: the factors of the sine are those of the cosine, turned to the left by a right angle. All have to turn alike,
    and the form has to agree with the equations.
    """
    signs, values = [], [_evaluate_at_random([gap, *factors]) for factors in turned]
    for difference, cosine, sine in values:
        if not np.all(np.abs(difference) < ZERO_TOLERANCE):
            return None
        rotated = np.stack([-cosine[1], cosine[0]])
        senses = [sense for sense in (1, -1) if np.all(np.abs(sine - sense * rotated) < ZERO_TOLERANCE)]
        if not senses:
            return None
        signs.append(0 if len(senses) == 2 else senses[0])
    return signs if len(set(signs) - {0}) == 1 else None


def _evaluate_at_random(parts: list[ca.SX]) -> list[Array]:
    """Expressions (2,) in numbers (2, places): at random places an identity holds by accident nowhere."""
    symbols = ca.vertcat(ca.SX(0, 1), *ca.symvar(ca.vertcat(*parts)))
    function = ca.Function("parts", [symbols], [ca.densify(part) for part in parts])
    values = function(generic_numbers(symbols.numel(), SAMPLE_POINTS))
    return [value.full() for value in (values if isinstance(values, tuple) else (values,))]
