"""Cosines and sines of the lanes of a vector at once, as LLVM IR."""

from __future__ import annotations

from collections.abc import Sequence
from math import factorial, pi

from planar.codegen.llvm_ir import IRWriter

RIGHT_ANGLE_PARTS = tuple(map(float.fromhex, ("0x1.921fb544p+0", "0x1.0b4611a6p-34", "0x1.3198a2e037073p-69")))
"""A right angle as a sum; whole multiples of all but the last, up to 2^21, are exact."""
ROUNDING_SHIFT = 1.5 * 2.0**52
"""Added to a number it leaves the nearest whole one in the last bits."""
SERIES_TERMS = 8
"""Of the powers of an angle up to half a right one: what is left out is less than the last digit."""


def write_cos_sin(t: IRWriter, angle: str) -> tuple[str, str]:
    """The cos and sin of an angle, up to 1e6 rad either way, to about two units in their last place.

    The nearest whole number of right angles is taken off. Of the rest both are the sums of their series.
    """
    shifted = t.binary("add", t.binary("mul", angle, t.constant(2.0 / pi)), t.constant(ROUNDING_SHIFT))
    turns, rest = t.binary("sub", shifted, t.constant(ROUNDING_SHIFT)), angle
    for part in RIGHT_ANGLE_PARTS:
        rest = t.binary("sub", rest, t.binary("mul", turns, t.constant(part)))
    square = t.binary("mul", rest, rest)
    cos_series = _write_polynomial(t, square, [(-1.0) ** k / factorial(2 * k) for k in range(SERIES_TERMS + 1)])
    tail = _write_polynomial(t, square, [(-1.0) ** k / factorial(2 * k + 1) for k in range(1, SERIES_TERMS)])
    sin_series = t.binary("add", rest, t.binary("mul", t.binary("mul", rest, square), tail))
    whole = f"<{t.lanes} x i64>"
    quarter = t.add_instruction(f"bitcast {t.vector} {shifted} to {whole}")
    after = t.add_instruction(f"add {whole} {quarter}, {_spread(t, 1)}")
    is_odd = _write_bit_test(t, quarter, 1)
    cos, sin = t.select(is_odd, sin_series, cos_series), t.select(is_odd, cos_series, sin_series)
    turned = ((cos, _write_bit_test(t, after, 2)), (sin, _write_bit_test(t, quarter, 2)))
    cos, sin = (t.select(flag, t.add_instruction(f"fneg {t.vector} {value}"), value) for value, flag in turned)
    return cos, sin


def _write_polynomial(t: IRWriter, x: str, coefficients: Sequence[float]) -> str:
    """A polynomial by its coefficients, the constant one first."""
    value = t.constant(coefficients[-1])
    for each in coefficients[-2::-1]:
        value = t.binary("add", t.binary("mul", value, x), t.constant(each))
    return value


def _write_bit_test(t: IRWriter, numbers: str, bit: int) -> str:
    """Whether a bit is set, in every lane."""
    whole = f"<{t.lanes} x i64>"
    masked = t.add_instruction(f"and {whole} {numbers}, {_spread(t, bit)}")
    return t.add_instruction(f"icmp ne {whole} {masked}, zeroinitializer")


def _spread(t: IRWriter, number: int) -> str:
    return f"<{', '.join([f'i64 {number}'] * t.lanes)}>"
