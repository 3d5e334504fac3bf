"""The expressions of Pyslvs, `M[J[R, P[x, y], L[ground, L1]], ...]`: read without running anything, and written."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import NamedTuple

from planar.foundation.errors import BadInput

TOKEN = re.compile(
    r"\s*(?:(?P<mark>[\[\](),])|(?P<word>[A-Za-z_][\w-]*)|(?P<number>[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?))"
)
COMMENT = re.compile(r"#\[.*?#\][^\n]*|#[^\n]*", re.DOTALL)
MAX_JOINTS = 5000


class PyslvsJoint(NamedTuple):
    """A joint: R, P or RP, its links, of P and RP the one with the slot first, and the slot's angle (degrees)."""

    kind: str
    links: tuple[str, ...]
    x: float
    y: float
    angle: float


def parse_expression(text: str, place: str) -> list[PyslvsJoint]:
    """The joints of an expression. Raises BadInput, and tells the sign at which it ends to be one."""
    return _Parser(COMMENT.sub("", text), place).mechanism()


class _Parser:
    """Reads an expression from the left, a word or a mark at a time."""

    def __init__(self, text: str, place: str) -> None:
        self.text, self.place, self.at = text, place, 0

    def mechanism(self) -> list[PyslvsJoint]:
        self.start("M")
        joints = []
        while not self.closes():
            joints.append(self.joint())
            if len(joints) > MAX_JOINTS:
                raise BadInput(self.place, f"a mechanism of more than {MAX_JOINTS} joints is not read")
            if not self.skip(","):
                self.expect("]")
                break
        return joints

    def joint(self) -> PyslvsJoint:
        self.start("J")
        kind = self.word()
        if kind not in ("R", "P", "RP"):
            raise self.error(f"a joint is of type R, P or RP, not {kind!r:.40}")
        angle, at, links = 0.0, (0.0, 0.0), None
        while self.skip(","):
            key = self.word()
            self.expect("[")
            if key == "A":
                angle = self.number()
            elif key == "P":
                x = self.number()
                self.expect(",")
                at = x, self.number()
            elif key == "L":
                links = tuple(self.names())
                continue
            elif key == "color":
                self.colour()
                continue
            else:
                raise self.error(f"there is no part {key!r:.40} of a joint")
            self.expect("]")
        self.expect("]")
        if links is None:
            raise self.error("the joint has no links, L[...]")
        return PyslvsJoint(kind, links, *at, angle)

    def names(self) -> Iterator[str]:
        while not self.closes():
            yield self.word()
            if not self.skip(","):
                self.expect("]")
                return

    def colour(self) -> None:
        while not self.closes():
            self.take()

    def start(self, name: str) -> None:
        if self.word() != name:
            raise self.error(f"{name}[ is wanted here")
        self.expect("[")

    def take(self) -> tuple[str, str]:
        result = TOKEN.match(self.text, self.at)
        if result is None or result.lastgroup is None:
            raise self.error("the expression ends here, or goes on with what is no part of it")
        self.at = result.end()
        return result.lastgroup, result[result.lastgroup]

    def word(self) -> str:
        kind, text = self.take()
        if kind != "word":
            raise self.error(f"a name is wanted, not {text!r:.40}")
        return text

    def number(self) -> float:
        kind, text = self.take()
        if kind != "number" or abs(float(text)) > 1e100:
            raise self.error(f"a number is wanted, not {text!r:.40}")
        return float(text)

    def skip(self, mark: str) -> bool:
        result = TOKEN.match(self.text, self.at)
        if result is None or result["mark"] != mark:
            return False
        self.at = result.end()
        return True

    def closes(self) -> bool:
        return self.skip("]")

    def expect(self, mark: str) -> None:
        if not self.skip(mark):
            raise self.error(f"{mark!r} is wanted here")

    def error(self, sentence: str) -> BadInput:
        line = self.text.count("\n", 0, self.at) + 1
        return BadInput(f"{self.place}, line {line}", f"{sentence}, before {self.text[self.at :][:30].strip()!r}")


def write_expression(joints: list[PyslvsJoint]) -> str:
    """The expression of these joints."""
    parts = []
    for item in joints:
        angle = "" if item.kind == "R" else f", A[{item.angle!r}]"
        parts.append(f"J[{item.kind}{angle}, P[{item.x!r}, {item.y!r}], L[{', '.join(item.links)}]]")
    return f"M[{', '.join(parts)}]"
