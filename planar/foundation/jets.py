"""Arithmetic that floats, arrays, symbols and jets share, so that a formula is written once.

A *jet* is a quantity together with its time derivatives; running a formula on jets gives its velocity and acceleration
by the rules of Leibniz and of the chain, without a second formula (A. Griewank, A. Walther, Evaluating Derivatives,
SIAM 2008, ch. 13).
"""

from __future__ import annotations

import math
from math import comb
from typing import Any

import numpy as np

Scalar = Any
"""A float, a numpy array, a casadi SX or a Jet: whatever has + - *."""


TURN = 2.0 * math.pi


def _apply_function(name: str, x: Scalar) -> Scalar:
    if type(x) is float:
        return getattr(math, name)(x)
    method = getattr(x, name, None)
    return getattr(np, name)(x) if method is None else method()


def cos(x: Scalar) -> Scalar:
    """Cosine of an angle in radians."""
    return _apply_function("cos", x)


def sin(x: Scalar) -> Scalar:
    """Sine of an angle in radians."""
    return _apply_function("sin", x)


def tan(x: Scalar) -> Scalar:
    """Tangent of an angle in radians."""
    return _apply_function("tan", x)


def sqrt(x: Scalar) -> Scalar:
    """Square root."""
    return _apply_function("sqrt", x)


def hypot(x: Scalar, y: Scalar) -> Scalar:
    """The length of (x, y), however large or small its square."""
    if type(x) is float and type(y) is float:
        return math.hypot(x, y)
    if isinstance(x, float | np.ndarray) and isinstance(y, float | np.ndarray):
        return np.hypot(x, y)
    return sqrt(x * x + y * y)


def atan2(y: Scalar, x: Scalar) -> Scalar:
    """The angle of the direction (x, y), between -pi and pi."""
    if type(y) is float and hasattr(x, "__arctan2__"):  # a number over a symbol
        y = type(x)(y)
    method = getattr(y, "arctan2", None) or getattr(y, "__arctan2__", None)
    if method is not None:
        return method(x)
    turned = getattr(x, "__rarctan2__", None)  # of a symbol beside a number
    if turned is not None:
        return turned(y)
    if np.iscomplexobj(y) or np.iscomplexobj(x):  # beside a real place, to first order
        a, b = np.real(x), np.real(y)
        return np.arctan2(b, a) + 1j * (a * np.imag(y) - b * np.imag(x)) / (a * a + b * b)
    return np.arctan2(y, x)


class Jet:
    """A value with its first, second, ... time derivatives, under + - * and cos, sin.

    `parts[k]` is the k-th derivative: a float, or an array of any one shape.
    """

    __slots__ = ("parts",)
    __array_ufunc__ = None  # an array times a jet is a jet, not an array of jets

    def __init__(self, *parts: Scalar):
        self.parts = parts

    def _derivatives_of(self, other: Scalar) -> tuple[Scalar, ...]:
        if isinstance(other, Jet):
            return other.parts
        return (other,) + (0.0,) * (len(self.parts) - 1)

    def __add__(self, other: Scalar) -> Jet:
        return Jet(*(a + b for a, b in zip(self.parts, self._derivatives_of(other), strict=True)))

    def __neg__(self) -> Jet:
        return Jet(*(-a for a in self.parts))

    def __sub__(self, other: Scalar) -> Jet:
        return Jet(*(a - b for a, b in zip(self.parts, self._derivatives_of(other), strict=True)))

    def __rsub__(self, other: Scalar) -> Jet:
        found: Jet = -self + other
        return found

    def __mul__(self, other: Scalar) -> Jet:
        if not isinstance(other, Jet):
            return Jet(*[a * other for a in self.parts])
        a, b = self.parts, other.parts
        parts = [a[0] * b[0]]
        for n in range(1, len(a)):
            total = a[0] * b[n] + a[n] * b[0]
            for k in range(1, n):
                total = total + comb(n, k) * a[k] * b[n - k]
            parts.append(total)
        return Jet(*parts)

    __radd__ = __add__
    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Jet:
        """By Leibniz: (q b)^(n) = a^(n), solved for q^(n)."""
        a, b = self.parts, self._derivatives_of(other)
        parts: list[Scalar] = []
        for n in range(len(a)):
            known = sum((comb(n, k) * parts[k] * b[n - k] for k in range(n)), 0.0)
            parts.append((a[n] - known) / b[0])
        return Jet(*parts)

    def __rtruediv__(self, other: Scalar) -> Jet:
        return Jet(*self._derivatives_of(other)) / self

    def sqrt(self) -> Jet:
        """By Leibniz: (r r)^(n) = a^(n), solved for r^(n)."""
        a = self.parts
        parts = [sqrt(a[0])]
        for n in range(1, len(a)):
            known = sum((comb(n, k) * parts[k] * parts[n - k] for k in range(1, n)), 0.0)
            parts.append((a[n] - known) / (2.0 * parts[0]))
        return Jet(*parts)

    def arctan2(self, x: Scalar) -> Jet:
        """The angle of (x, self): its derivative is (x y' - y x') / (x^2 + y^2)."""
        other = Jet(*self._derivatives_of(x))
        if len(self.parts) == 1:
            return Jet(atan2(self.parts[0], other.parts[0]))
        y0, x0 = Jet(*self.parts[:-1]), Jet(*other.parts[:-1])
        y1, x1 = Jet(*self.parts[1:]), Jet(*other.parts[1:])
        rate = (x0 * y1 - y0 * x1) / (x0 * x0 + y0 * y0)
        return Jet(atan2(self.parts[0], other.parts[0]), *rate.parts)

    def __rarctan2__(self, y: Scalar) -> Jet:
        return Jet(*self._derivatives_of(y)).arctan2(self)

    def __pow__(self, exponent: float) -> Jet:
        """The rate is exponent a^(exponent - 1) a'."""
        a = self.parts
        if len(a) == 1:
            return Jet(a[0] ** exponent)
        rate = exponent * Jet(*a[:-1]) ** (exponent - 1.0) * Jet(*a[1:])
        return Jet(a[0] ** exponent, *rate.parts)

    def tan(self) -> Jet:
        c, s = self._cos_sin_derivatives()
        return Jet(*s) / Jet(*c)

    def __abs__(self) -> Jet:
        sized: Jet = self * sign_of(self)
        return sized

    def floor(self) -> Scalar:
        """A step has no rates."""
        value = _value_of(self)
        return value.floor() if _is_symbol(value) else np.floor(value)

    def __lt__(self, other: Scalar) -> Scalar:
        """Comparisons are of values alone."""
        return _value_of(self) < _value_of(other)

    def __le__(self, other: Scalar) -> Scalar:
        return _value_of(self) <= _value_of(other)

    def __gt__(self, other: Scalar) -> Scalar:
        return _value_of(self) > _value_of(other)

    def __ge__(self, other: Scalar) -> Scalar:
        return _value_of(self) >= _value_of(other)

    def _cos_sin_derivatives(self) -> tuple[list[Scalar], list[Scalar]]:
        """Derivatives of cos and sin: c' = -s a', s' = c a', expanded by Leibniz."""
        a = self.parts
        c, s = [cos(a[0])], [sin(a[0])]
        for n in range(1, len(a)):
            terms = [(comb(n - 1, k) * a[n - k], k) for k in range(n)]
            c.append(-sum(w * s[k] for w, k in terms))
            s.append(sum(w * c[k] for w, k in terms))
        return c, s

    def cos(self) -> Jet:
        return Jet(*self._cos_sin_derivatives()[0])

    def sin(self) -> Jet:
        return Jet(*self._cos_sin_derivatives()[1])


def _value_of(number: Scalar) -> Scalar:
    """The value of a number, which may be a jet of jets."""
    return _value_of(number.parts[0]) if isinstance(number, Jet) else number


class TermSizes(Jet):
    """The sizes of a quantity's terms and of their derivatives: a formula run on these says how much it adds up.

    What cancels in the formula does not here: + and - both add, and every number counts by its size.
    """

    __slots__ = ()

    def _derivatives_of(self, other: Scalar) -> tuple[Scalar, ...]:
        return other.parts if isinstance(other, TermSizes) else (abs(other),) + (0.0,) * (len(self.parts) - 1)

    def __add__(self, other: Scalar) -> TermSizes:
        return TermSizes(*super().__add__(other).parts)

    def __neg__(self) -> TermSizes:
        return self

    def __mul__(self, other: Scalar) -> TermSizes:
        return TermSizes(*super().__mul__(other if isinstance(other, TermSizes) else abs(other)).parts)

    def cos(self) -> TermSizes:
        """1, and the sizes of the derivatives: those of c' = -s a', s' = c a' are the same."""
        a = self.parts
        found: list[Scalar] = [1.0]
        for n in range(1, len(a)):
            found.append(sum(comb(n - 1, k) * a[n - k] * found[k] for k in range(n)))
        return TermSizes(*found)

    sin = cos
    __sub__ = __radd__ = __rsub__ = __add__
    __rmul__ = __mul__


def term_sizes(value: Jet) -> TermSizes:
    """The sizes of a quantity and its derivatives, each for itself."""
    return TermSizes(*(abs(part) for part in value.parts))


def constant_jet(value: Scalar, part_count: int) -> Scalar:
    """A number that may itself be a jet, of other derivatives, as a jet of `part_count` parts that does not change."""
    return Jet(value, *([0.0] * (part_count - 1))) if isinstance(value, Jet) else value


def value_and_rates(value: Scalar) -> tuple[Scalar, ...]:
    """Value, rate, second rate (and more, if a jet has them); a plain number is at rest."""
    return value.parts if isinstance(value, Jet) else (value, 0.0, 0.0)


# functions that are put together of pieces: derivatives at a joint are those of the piece that starts there


def within_turn(angle: Scalar) -> Scalar:
    """An angle (rad) less the whole turns in it: from 0 up to a turn."""
    if isinstance(angle, TermSizes):
        return angle
    if isinstance(angle, Jet):
        return Jet(within_turn(angle.parts[0]), *angle.parts[1:])
    if type(angle) is float:
        return angle - TURN * math.floor(angle / TURN)
    if _is_symbol(angle):
        return angle - TURN * (angle / TURN).floor()
    return angle - TURN * np.floor(np.real(angle) / TURN)


def value_between(x: Scalar, low: Scalar | None, high: Scalar | None, value: Scalar) -> Scalar:
    """A value where low <= x < high, else nothing; an end that is None is none."""
    if isinstance(x, TermSizes) or isinstance(value, TermSizes):
        return value
    if isinstance(value, Jet):
        return Jet(*(value_between(x, low, high, part) for part in value.parts))
    x, low, high = map(_value_of, (x, low, high))
    if any(map(_is_symbol, (x, low, high, value))):
        # flags are numbers, 0 or 1, whose derivative is none
        is_below = 1.0 if high is None else x < high
        return is_below * value if low is None else (low <= x) * (is_below * value)
    is_inside = np.asarray(True)
    if low is not None:
        is_inside = is_inside & (np.real(low) <= np.real(x))
    if high is not None:
        is_inside = is_inside & (np.real(x) < np.real(high))
    if is_inside.ndim == 0:
        return value if is_inside else value * 0.0
    return np.where(is_inside, value, 0.0)


def sign_of(x: Scalar) -> Scalar:
    """1 of a number from zero on, -1 below."""
    return 1.0 - value_between(x, None, 0.0, 2.0)


def part_of_piece(x: Scalar) -> Scalar:
    """A number that lies between 0 and 1 wherever it counts: sizes of its terms say no more."""
    if not isinstance(x, TermSizes):
        return x
    return TermSizes(1.0, *x.parts[1:])


def _is_symbol(value: Scalar) -> bool:
    return hasattr(value, "is_symbolic")
