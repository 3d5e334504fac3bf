"""A line of text, plain or a formula, as pieces of one font each with their places.

Formulas are written in the part of mathtext that drawings and solutions need: letters (slanted), digits, `\\mathrm{}`,
`\\mathit{}`, `\\dfrac{}{}`, indices `_` and `^`, primes, spaces `\\ ` and `\\,`, the symbols below, between dollars; a
dollar that is meant is `\\$`. They are set here because matplotlib takes milliseconds to read each.
"""

from __future__ import annotations

import re
from functools import lru_cache
from typing import NamedTuple

from planar.drawing.labels.fonts import DRAWING_FAMILY, font_families, font_properties, quiet_font_logs
from planar.drawing.paper.pens import require_matplotlib

SYMBOL_CHARACTERS = {"alpha": "α", "omega": "ω", "mu": "μ", "infty": "∞", "times": "×", "cdot": "·"}
STYLE_SLANTS = {"mathit": True, "mathrm": False}
"""Whether letters in it are slanted."""
OPERATORS, OPERATOR_SPACE = "+−×·=", 0.2
"""What has room on both sides between two terms, and how much, in sizes of the font."""
SPACE_WIDTHS = {" ": 0.25, ",": 0.17}
SCRIPT_SIZE = 0.7
"""The size of an index, of that of its letter."""
SUBSCRIPT_DROP, SUBSCRIPT_DROP_BELOW_POWER, SUPERSCRIPT_RISE, SCRIPT_GAP = 0.16, 0.24, 0.38, 0.04
"""How far an index goes down, one below a power, a power up, and both to the right."""
FRACTION_BAR_HEIGHT, FRACTION_BAR_THICKNESS, FRACTION_GAP = 0.26, 0.045, 0.16
"""The height of a fraction's bar above the base line, its thickness, and what is free above and below it."""
LETTER_PATTERN = r"[^\W_]"
"""A letter or a digit of any script, such as a formula may have."""
TOKEN_PATTERN = re.compile(r"\\(?:[A-Za-z]+|.)|\s+|.", re.DOTALL)


class TextPiece(NamedTuple):
    """A text of one font, from its left end on its base line (in sizes of the line's font), and its size of that."""

    text: str
    x: float
    y: float
    size: float
    slanted: bool
    heavy: bool
    families: tuple[str, ...]


FractionBar = tuple[float, float, float, float]
"""A filled rectangle: left, low, right, high (in sizes of the font)."""


class TextLine(NamedTuple):
    """A line in sizes of its font: pieces, bars of fractions, its width, and how far it goes up and down."""

    pieces: tuple[TextPiece, ...] = ()
    bars: tuple[FractionBar, ...] = ()
    width: float = 0.0
    ascent: float = 0.0
    descent: float = 0.0


@lru_cache(maxsize=8192)
def text_line(
    text: str, math: bool = False, slanted: bool = False, heavy: bool = False, family: str = DRAWING_FAMILY
) -> TextLine:
    """A text on one line; with `math` what is between dollars is a formula. Raises ValueError for one with a fault."""
    if not math:
        return _plain_line(text, slanted, heavy, family)
    pen = _LineWriter(heavy, family)
    parts = re.split(r"(?<!\\)\$", text)
    if len(parts) % 2 == 0:
        raise ValueError(f"a dollar is missing in {text!r}")
    for index, part in enumerate(parts):
        if index % 2:
            _FormulaReader(part).read(pen)
        else:
            pen.write(part.replace(r"\$", "$"), slanted)
        pen.flush()
    return pen.line()


@lru_cache(maxsize=8192)
def _plain_line(text: str, slanted: bool, heavy: bool, family: str) -> TextLine:
    """A text of one font."""
    if not text:
        return TextLine()
    require_matplotlib()
    from matplotlib.textpath import text_to_path

    chosen = font_families(text, slanted, heavy, family)
    looks = font_properties(1.0, slanted, heavy, chosen)
    with quiet_font_logs():
        width, height, down = text_to_path.get_text_width_height_descent(text, looks, False)
    piece = TextPiece(text, 0.0, 0.0, 1.0, slanted, heavy, chosen)
    return TextLine((piece,), (), float(width), float(height - down), float(down))


class _LineWriter:
    """A line while it is written; `x` is where it has come to."""

    def __init__(self, heavy: bool, family: str):
        self.heavy, self.family = heavy, family
        self.pieces: list[TextPiece] = []
        self.bars: list[FractionBar] = []
        self.extents: list[tuple[float, float]] = []
        self.x = 0.0
        self.pending, self.slanted = "", False
        "characters of one font that are not set yet"
        self.ends_term = False
        "whether the last that was written can be the first of two terms"

    def write(self, text: str, slanted: bool) -> None:
        """A text, in one piece with what was before in the same font."""
        if slanted is not self.slanted:
            self.flush()
        self.pending, self.slanted = self.pending + text, slanted

    def flush(self) -> None:
        """What has been written so far is a piece of its own."""
        line = _plain_line(self.pending, self.slanted, self.heavy, self.family)
        self.pending = ""
        self.add_line(line, self.x)
        self.x += line.width

    def add_line(self, line: TextLine, x: float, y: float = 0.0, size: float = 1.0) -> None:
        """Another line with its left end there, in a size of this line's."""
        for text, left, up, part, slanted, heavy, families in line.pieces:
            self.pieces.append(TextPiece(text, x + size * left, y + size * up, size * part, slanted, heavy, families))
        self.bars += [(x + size * a, y + size * b, x + size * c, y + size * d) for a, b, c, d in line.bars]
        if line.pieces or line.bars:
            self.extents.append((y + size * line.ascent, size * line.descent - y))

    def line(self) -> TextLine:
        """All that has been written."""
        self.flush()
        ups, downs = zip(*self.extents, strict=True) if self.extents else ((0.0,), (0.0,))
        return TextLine(tuple(self.pieces), tuple(self.bars), self.x, max(ups), max(downs))


class _FormulaReader:
    """What is between two dollars, read from left to right. Raises ValueError where it has a fault."""

    def __init__(self, text: str):
        self.rest: list[str] = TOKEN_PATTERN.findall(text)[::-1]
        "what is still to be read, the next at the end"
        self.in_script = False
        "whether it is an index, in which operators have no room"

    def read(self, pen: _LineWriter, end: str = "", slanted: bool | None = None) -> None:
        """Write everything up to the end; letters slanted, or all upright or slanted if told so."""
        while self.rest and self.rest[-1] != end:
            self._read_term(pen, slanted)
        if end:
            self._expect(end)

    def _read_term(self, pen: _LineWriter, slanted: bool | None) -> None:
        token = self.rest[-1]
        if token in ("_", "^", "'"):
            self._read_scripts(pen)
            return
        self.rest.pop()
        name = token[1:]
        if token == "{":
            self.read(pen, "}", slanted)
        elif token[0] != "\\":
            self._read_character(pen, token.replace("-", "−"), slanted)
        elif name in SYMBOL_CHARACTERS:
            self._read_character(pen, SYMBOL_CHARACTERS[name], slanted)
        elif name in STYLE_SLANTS:
            self._expect("{")
            self.read(pen, "}", STYLE_SLANTS[name])
        elif name in SPACE_WIDTHS:
            pen.flush()
            pen.x += SPACE_WIDTHS[name]
            pen.ends_term = False
        elif name == "dfrac":
            self._read_fraction(pen)
        else:
            raise ValueError(f"{token!r} is no part of a formula")

    def _read_character(self, pen: _LineWriter, character: str, slanted: bool | None) -> None:
        if character.isspace():
            return
        if character in "{}$":
            raise ValueError(f"{character!r} is no part of a formula")
        around = (
            character in OPERATORS and pen.ends_term and not self.in_script and self.rest and self.rest[-1] != "\\ "
        )
        if around:
            pen.flush()
            pen.x += OPERATOR_SPACE
        pen.write(character, character.isalpha() if slanted is None else slanted)
        if around:
            pen.flush()
            pen.x += OPERATOR_SPACE
        pen.ends_term = character not in OPERATORS + "(/,"

    def _read_scripts(self, pen: _LineWriter) -> None:
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
                lines[mark] = self._read_argument(pen, small=True)
        upper = _plain_line(primes.replace("′′′", "‴").replace("′′", "″"), False, pen.heavy, pen.family)
        start = ends = pen.x
        pen.add_line(upper, start)
        for mark, line in lines.items():
            deep = -SUBSCRIPT_DROP_BELOW_POWER if "^" in lines else -SUBSCRIPT_DROP
            left = start + SCRIPT_GAP + (upper.width if mark == "^" else 0.0)
            pen.add_line(line, left, deep if mark == "_" else SUPERSCRIPT_RISE, SCRIPT_SIZE)
            ends = max(ends, left + SCRIPT_SIZE * line.width)
        pen.x = max(ends, start + upper.width)
        pen.ends_term = True

    def _read_fraction(self, pen: _LineWriter) -> None:
        pen.flush()
        over, under = self._read_argument(pen), self._read_argument(pen)
        width = max(over.width, under.width) + 2.0 * SCRIPT_GAP
        left, right = pen.x + SCRIPT_GAP, pen.x + SCRIPT_GAP + width
        pen.add_line(over, left + (width - over.width) / 2.0, FRACTION_BAR_HEIGHT + FRACTION_GAP + over.descent)
        pen.add_line(under, left + (width - under.width) / 2.0, FRACTION_BAR_HEIGHT - FRACTION_GAP - under.ascent)
        pen.bars.append(
            (
                left,
                FRACTION_BAR_HEIGHT - FRACTION_BAR_THICKNESS / 2.0,
                right,
                FRACTION_BAR_HEIGHT + FRACTION_BAR_THICKNESS / 2.0,
            )
        )
        pen.x = right + SCRIPT_GAP
        pen.ends_term = True

    def _read_argument(self, pen: _LineWriter, small: bool = False) -> TextLine:
        """A group in braces, or one character."""
        inner, kept = _LineWriter(pen.heavy, pen.family), self.in_script
        self.in_script = self.in_script or small
        if not self.rest:
            raise ValueError("something is missing at the end of a formula")
        self._read_term(inner, None)
        self.in_script = kept
        return inner.line()

    def _expect(self, wanted: str) -> None:
        if not self.rest or self.rest.pop() != wanted:
            raise ValueError(f"{wanted!r} is missing in a formula")
