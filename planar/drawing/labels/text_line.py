"""A line of text, plain or a formula, as pieces of one font each with their places.

Formulas are written in the part of mathtext that drawings and solutions need: letters (slanted), digits, `\\mathrm{}`,
`\\mathit{}`, `\\dfrac{}{}`, indices `_` and `^`, primes, spaces `\\ ` and `\\,`, the symbols below, between dollars; a
dollar that is meant is `\\$`. They are set here because matplotlib takes milliseconds to read each.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

from planar.drawing.labels.fonts import FAMILY, families, font, quiet
from planar.drawing.paper.pens import ready

SYMBOLS = {"alpha": "α", "omega": "ω", "mu": "μ", "infty": "∞", "times": "×", "cdot": "·"}
STYLES = {"mathit": True, "mathrm": False}
"""Whether letters in it are slanted."""
OPERATORS, AROUND = "+−×·=", 0.2
"""What has room on both sides between two terms, and how much, in sizes of the font."""
SPACES = {" ": 0.25, ",": 0.17}
SCRIPT = 0.7
"""The size of an index, of that of its letter."""
DOWN, DEEP, UP, BESIDE = 0.16, 0.24, 0.38, 0.04
"""How far an index goes down, one below a power, a power up, and both to the right."""
AXIS, THICK, CLEAR = 0.26, 0.045, 0.16
"""The height of a fraction's bar above the base line, its thickness, and what is free above and below it."""
LETTER = r"[^\W_]"
"""A letter or a digit of any script, such as a formula may have."""
TOKEN = re.compile(r"\\(?:[A-Za-z]+|.)|\s+|.", re.DOTALL)


class Piece(NamedTuple):
    """A text of one font, from its left end on its base line (in sizes of the line's font), and its size of that."""

    text: str
    x: float
    y: float
    size: float
    slanted: bool
    heavy: bool
    families: tuple[str, ...]


Bar = tuple[float, float, float, float]
"""A filled rectangle: left, low, right, high (in sizes of the font)."""


class TextLine(NamedTuple):
    """A line in sizes of its font: pieces, bars of fractions, its width, and how far it goes up and down."""

    pieces: tuple[Piece, ...] = ()
    bars: tuple[Bar, ...] = ()
    width: float = 0.0
    up: float = 0.0
    down: float = 0.0


@lru_cache(maxsize=8192)
def text_line(
    text: str, math: bool = False, slanted: bool = False, heavy: bool = False, family: str = FAMILY
) -> TextLine:
    """A text on one line; with `math` what is between dollars is a formula. Raises ValueError for one with a fault."""
    if not math:
        return _plain(text, slanted, heavy, family)
    pen = _Pen(heavy, family)
    parts = re.split(r"(?<!\\)\$", text)
    if len(parts) % 2 == 0:
        raise ValueError(f"a dollar is missing in {text!r}")
    for index, part in enumerate(parts):
        if index % 2:
            _Formula(part).read(pen)
        else:
            pen.write(part.replace(r"\$", "$"), slanted)
        pen.flush()
    return pen.line()


@lru_cache(maxsize=8192)
def _plain(text: str, slanted: bool, heavy: bool, family: str) -> TextLine:
    """A text of one font."""
    if not text:
        return TextLine()
    ready()
    from matplotlib.textpath import text_to_path

    chosen = families(text, slanted, heavy, family)
    looks = font(1.0, slanted, heavy, chosen)
    with quiet():
        width, height, down = text_to_path.get_text_width_height_descent(text, looks, False)
    piece = Piece(text, 0.0, 0.0, 1.0, slanted, heavy, chosen)
    return TextLine((piece,), (), float(width), float(height - down), float(down))


class _Pen:
    """A line while it is written; `x` is where it has come to."""

    def __init__(self, heavy: bool, family: str):
        self.heavy, self.family = heavy, family
        self.pieces: list[Piece] = []
        self.bars: list[Bar] = []
        self.extents: list[tuple[float, float]] = []
        self.x = 0.0
        self.run, self.slanted = "", False
        "characters of one font that are not set yet"
        self.term = False
        "whether the last that was written can be the first of two terms"

    def write(self, text: str, slanted: bool) -> None:
        """A text, in one piece with what was before in the same font."""
        if slanted is not self.slanted:
            self.flush()
        self.run, self.slanted = self.run + text, slanted

    def flush(self) -> None:
        """What has been written so far is a piece of its own."""
        line = _plain(self.run, self.slanted, self.heavy, self.family)
        self.run = ""
        self.put(line, self.x)
        self.x += line.width

    def put(self, line: TextLine, x: float, y: float = 0.0, size: float = 1.0) -> None:
        """Another line with its left end there, in a size of this line's."""
        for text, left, up, part, *looks in line.pieces:
            self.pieces.append(Piece(text, x + size * left, y + size * up, size * part, *looks))
        self.bars += [(x + size * a, y + size * b, x + size * c, y + size * d) for a, b, c, d in line.bars]
        if line.pieces or line.bars:
            self.extents.append((y + size * line.up, size * line.down - y))

    def line(self) -> TextLine:
        """All that has been written."""
        self.flush()
        ups, downs = zip(*self.extents, strict=True) if self.extents else ((0.0,), (0.0,))
        return TextLine(tuple(self.pieces), tuple(self.bars), self.x, max(ups), max(downs))


class _Formula:
    """What is between two dollars, read from left to right. Raises ValueError where it has a fault."""

    def __init__(self, text: str):
        self.rest: list[str] = TOKEN.findall(text)[::-1]
        "what is still to be read, the next at the end"
        self.small = False
        "whether it is an index, in which operators have no room"

    def read(self, pen: _Pen, end: str = "", slanted: bool | None = None) -> None:
        """Write everything up to the end; letters slanted, or all upright or slanted if told so."""
        while self.rest and self.rest[-1] != end:
            self._term(pen, slanted)
        if end:
            self._take(end)

    def _term(self, pen: _Pen, slanted: bool | None) -> None:
        token = self.rest[-1]
        if token in ("_", "^", "'"):
            self._scripts(pen)
            return
        self.rest.pop()
        name = token[1:]
        if token == "{":
            self.read(pen, "}", slanted)
        elif token[0] != "\\":
            self._character(pen, token.replace("-", "−"), slanted)
        elif name in SYMBOLS:
            self._character(pen, SYMBOLS[name], slanted)
        elif name in STYLES:
            self._take("{")
            self.read(pen, "}", STYLES[name])
        elif name in SPACES:
            pen.flush()
            pen.x += SPACES[name]
            pen.term = False
        elif name == "dfrac":
            self._fraction(pen)
        else:
            raise ValueError(f"{token!r} is no part of a formula")

    def _character(self, pen: _Pen, character: str, slanted: bool | None) -> None:
        if character.isspace():
            return
        if character in "{}$":
            raise ValueError(f"{character!r} is no part of a formula")
        around = character in OPERATORS and pen.term and not self.small and self.rest and self.rest[-1] != "\\ "
        if around:
            pen.flush()
            pen.x += AROUND
        pen.write(character, character.isalpha() if slanted is None else slanted)
        if around:
            pen.flush()
            pen.x += AROUND
        pen.term = character not in OPERATORS + "(/,"

    def _scripts(self, pen: _Pen) -> None:
        """Primes, an index and a power of what was before, in any order."""
        pen.flush()
        primes, lines = "", dict[str, TextLine]()
        while self.rest and self.rest[-1] in ("_", "^", "'"):
            mark = self.rest.pop()
            if mark == "'":
                primes += "′"
            elif mark in lines:
                raise ValueError(f"there are two {mark!r} of one letter")
            else:
                lines[mark] = self._argument(pen, small=True)
        upper = _plain(primes.replace("′′′", "‴").replace("′′", "″"), False, pen.heavy, pen.family)
        start = ends = pen.x
        pen.put(upper, start)
        for mark, line in lines.items():
            deep = -DEEP if "^" in lines else -DOWN
            left = start + BESIDE + (upper.width if mark == "^" else 0.0)
            pen.put(line, left, deep if mark == "_" else UP, SCRIPT)
            ends = max(ends, left + SCRIPT * line.width)
        pen.x = max(ends, start + upper.width)
        pen.term = True

    def _fraction(self, pen: _Pen) -> None:
        pen.flush()
        over, under = self._argument(pen), self._argument(pen)
        width = max(over.width, under.width) + 2.0 * BESIDE
        left, right = pen.x + BESIDE, pen.x + BESIDE + width
        pen.put(over, left + (width - over.width) / 2.0, AXIS + CLEAR + over.down)
        pen.put(under, left + (width - under.width) / 2.0, AXIS - CLEAR - under.up)
        pen.bars.append((left, AXIS - THICK / 2.0, right, AXIS + THICK / 2.0))
        pen.x = right + BESIDE
        pen.term = True

    def _argument(self, pen: _Pen, small: bool = False) -> TextLine:
        """A group in braces, or one character."""
        inner, kept = _Pen(pen.heavy, pen.family), self.small
        self.small = self.small or small
        if not self.rest:
            raise ValueError("something is missing at the end of a formula")
        self._term(inner, None)
        self.small = kept
        return inner.line()

    def _take(self, wanted: str) -> None:
        if not self.rest or self.rest.pop() != wanted:
            raise ValueError(f"{wanted!r} is missing in a formula")
