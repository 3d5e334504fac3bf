"""Motions that Ondsel writes as formulas in `time`, worked out by rules of arithmetic alone."""

from __future__ import annotations

import re
from collections.abc import Callable
from math import cos, isfinite, pi, sin, sqrt

from planar.foundation.errors import BadInput

TOKEN = re.compile(r"\s*(?:(\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+(?:[eE][+-]?\d+)?)d?|([A-Za-z_]\w*)|([-+*/^()]))")
FUNCTIONS: dict[str, Callable[[float], float]] = {"sin": sin, "cos": cos, "sqrt": sqrt, "abs": abs}
MAX_DEPTH, MAX_LENGTH = 40, 2000


def motion_formula(text: str, place: str) -> Callable[[float], float]:
    """The formula as a function of time (s). Raises BadInput for anything but numbers, time, pi, + - * / ^ and sin."""
    if len(text) > MAX_LENGTH:
        raise BadInput(place, "the formula of a motion is longer than one is read")
    tokens, at = [], 0
    while text[at:].strip():
        found = TOKEN.match(text, at)
        if found is None:
            raise BadInput(place, f"the formula {text!r:.60} has a part that is no number, name or sign")
        tokens.append(found[1] or found[2] or found[3])
        at = found.end()

    def value(time: float) -> float:
        try:
            result = _Sum(tokens, time).whole()
        except (ZeroDivisionError, OverflowError, ValueError, IndexError, TypeError):
            result = float("nan")
        if not isfinite(result):
            raise BadInput(place, f"the formula {text!r:.60} has no value at {time:g} s")
        return result

    value(0.0)
    return value


class _Sum:
    """Works out a formula at one time, from the left."""

    def __init__(self, tokens: list[str], time: float) -> None:
        self.tokens, self.time, self.at, self.depth = tokens, time, 0, 0

    def whole(self) -> float:
        result = self.sum()
        if self.at != len(self.tokens):
            raise ValueError
        return result

    def sum(self) -> float:
        self.depth += 1
        if self.depth > MAX_DEPTH:
            raise ValueError
        result = self.product()
        while self.peek() in ("+", "-"):
            sign = self.take()
            result = result + self.product() if sign == "+" else result - self.product()
        self.depth -= 1
        return result

    def product(self) -> float:
        result = self.factor()
        while self.peek() in ("*", "/"):
            sign = self.take()
            result = result * self.factor() if sign == "*" else result / self.factor()
        return result

    def factor(self) -> float:
        token = self.take()
        if token in ("-", "+"):
            return -self.factor() if token == "-" else self.factor()
        if token == "(":
            result = self.sum()
            if self.take() != ")":
                raise ValueError
        elif token in ("time", "pi"):
            result = self.time if token == "time" else pi
        elif token in FUNCTIONS:
            if self.take() != "(":
                raise ValueError
            result = FUNCTIONS[token](self.sum())
            if self.take() != ")":
                raise ValueError
        else:
            result = float(token)
        if self.peek() == "^":
            self.take()
            result = float(result ** self.factor())
        return result

    def peek(self) -> str:
        return self.tokens[self.at] if self.at < len(self.tokens) else ""

    def take(self) -> str:
        self.at += 1
        return self.tokens[self.at - 1]


def constant_rate(formula: Callable[[float], float], until: float) -> float | None:
    """The rate of a formula that grows evenly up to a time; None for any other."""
    values = [formula(until * part / 7.0) for part in range(8)]
    rate = (values[-1] - values[0]) / until
    size = max(map(abs, values)) or 1.0
    even = all(abs(v - values[0] - rate * until * n / 7.0) <= 1e-12 * size for n, v in enumerate(values))
    return rate if even else None
