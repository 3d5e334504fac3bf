"""Phrases set as lines of a printed page: words and formulas measured, wrapped, and put on a sheet in millimetres."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cache, lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.analysis.phrases import Paper, Phrase, Quantity, measured, plain
from planar.drawing.formulas import formula
from planar.drawing.ink import POINT, ready
from planar.drawing.lettering import FAMILY as OTHER
from planar.drawing.lettering import shown

if TYPE_CHECKING:
    from matplotlib.figure import Figure
    from matplotlib.font_manager import FontProperties

FAMILY = "STIXGeneral"
"""The book face that comes along with matplotlib, for texts and formulas alike."""
LEADING = 1.32
"""From one line to the next, in sizes of the font, where nothing in them is higher."""
SPACE = 0.27
"""Between words, in sizes of the font."""
CLEAR = 1.5
"""mm between lines with tall formulas."""
INCH = 25.4
LONGEST = 90
"""Characters of a word that are shown."""
POWER = re.compile(r"(−?[0-9.]+)·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)(.*)", re.DOTALL)
_DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


class Atom(NamedTuple):
    """A text that is drawn at once: its size in points, on paper (mm) its width and how far up and down it goes."""

    text: str
    math: bool
    size: float
    heavy: bool
    slanted: bool
    width: float
    up: float
    down: float


Word = tuple[Atom, ...]
"""Atoms between which no line is broken."""


class Row(NamedTuple):
    """A line of text: atoms with where each begins (mm), and its extent up and down from the base line."""

    atoms: tuple[tuple[float, Atom], ...]
    width: float
    up: float
    down: float


class Style(NamedTuple):
    """How a phrase is set."""

    size: float = 10.5
    heavy: bool = False
    slanted: bool = False


TEXT = Style()


@lru_cache(maxsize=256)
def font(size: float, heavy: bool = False, slanted: bool = False, family: str = FAMILY) -> FontProperties:
    """A font, with formulas in the same face."""
    ready()
    from matplotlib.font_manager import FontProperties

    return FontProperties(
        family=family,
        size=size,
        weight="bold" if heavy else "normal",
        style="italic" if slanted else "normal",
        math_fontfamily="stix",
    )


@cache
def _has(character: str, heavy: bool, slanted: bool) -> bool:
    from matplotlib.font_manager import findfont, get_font

    return bool(get_font(findfont(font(10.0, heavy, slanted))).get_char_index(ord(character)))


def family(text: str, heavy: bool = False, slanted: bool = False) -> str:
    """The book face, or the one of the drawings where the book face lacks a letter."""
    return FAMILY if all(_has(each, heavy, slanted) for each in text) else OTHER


@lru_cache(maxsize=8192)
def atom(text: str, math: bool, style: Style) -> Atom:
    """A text with its extent on paper. Raises ValueError where a formula is faulty."""
    ready()
    from matplotlib.textpath import text_to_path

    shape = font(style.size, style.heavy, style.slanted, FAMILY if math else family(text, style.heavy, style.slanted))
    width, height, down = (
        float(each) * POINT for each in text_to_path.get_text_width_height_descent(text, shape, math)
    )
    return Atom(text, math, style.size, style.heavy, style.slanted, width, height - down, down)


def words(phrase: Phrase, style: Style = TEXT, paper: Mapping[str, Paper] | None = None) -> list[Word]:
    """A phrase as words: formulas where its pieces are such, else plain text, which is never read as a formula."""
    found: list[list[Atom]] = [[]]
    for piece in phrase:
        told = formula(piece) if not isinstance(piece, str) else None
        if told is not None:
            try:
                found[-1].append(atom(f"${told}$", True, style))
                continue
            except ValueError:
                pass
        text = measured(piece, paper) if isinstance(piece, Quantity) else plain((piece,), paper)
        power = POWER.fullmatch(text)
        if power is not None:
            found[-1].append(
                atom(rf"${power[1].replace('−', '-')}\cdot 10^{{{power[2].translate(_DIGITS)}}}$", True, style)
            )
            text = power[3]
        for index, part in enumerate(re.split(r"\s+", text)):
            if index:
                found.append([])
            if part:
                found[-1].append(atom(_shown(part, style), False, style))
    return [tuple(word) for word in found if word]


@lru_cache(maxsize=8192)
def lift(text: str, size: float) -> float:
    """Points by which PDF files have a formula too high: they count its height in whole points."""
    from matplotlib.textpath import text_to_path

    whole, exact = (text_to_path.mathtext_parser.parse(text, 72, font(many * size)).glyphs for many in (1.0, 100.0))
    return float(whole[0][-1]) - float(exact[0][-1]) / 100.0 if whole else 0.0


def _shown(text: str, style: Style) -> str:
    """A word that the fonts can show, with the middle of a very long one left out."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST * 2 // 3]}…{text[-LONGEST // 3 :]}"
    here = family(text, style.heavy, style.slanted) == FAMILY
    return text if here else shown(text, style.slanted, style.heavy) or "?"


def set_lines(phrase: Phrase, width: float, style: Style = TEXT, paper: Mapping[str, Paper] | None = None) -> list[Row]:
    """A phrase as lines of at most so many mm; a word that is wider by itself is broken anywhere."""
    rows: list[Row] = []
    line: list[Atom | None] = []  # None: a space
    reach = 0.0
    space = SPACE * style.size * POINT
    for word in words(phrase, style, paper):
        across = sum(each.width for each in word)
        if line and reach + space + across > width:
            rows.append(_lined(line, space))
            line, reach = [], 0.0
        if line:
            line.append(None)
            reach += space
        for part in word if reach + across <= width else _broken(word, width):
            if line and line[-1] is not None and reach + part.width > width:
                rows.append(_lined(line, space))
                line, reach = [], 0.0
            line.append(part)
            reach += part.width
    return [*rows, _lined(line, space)] if line else rows


def _broken(word: Word, width: float) -> Iterable[Atom]:
    """The atoms of a word, plain ones that are too wide in pieces."""
    for each in word:
        text = each.text
        style = Style(each.size, each.heavy, each.slanted)
        if each.math or each.width <= width:
            yield each
            continue
        while text:
            count = len(text)
            while count > 1 and atom(text[:count], False, style).width > width:
                count = max(1, min(count - 1, int(count * width / atom(text[:count], False, style).width)))
            yield atom(text[:count], False, style)
            text = text[count:]


def _lined(line: Sequence[Atom | None], space: float) -> Row:
    atoms, x = [], 0.0
    for each in line:
        if each is None:
            x += space
            continue
        atoms.append((x, each))
        x += each.width
    return Row(
        tuple(atoms),
        x,
        max((each.up for _, each in atoms), default=0.0),
        max((each.down for _, each in atoms), default=0.0),
    )


def height(row: Row, size: float) -> float:
    """mm that a line takes: at least the leading of its font."""
    leading = LEADING * size * POINT
    return max(leading, row.up + row.down + CLEAR, row.up + CLEAR + 0.28 * leading)


def base(row: Row, size: float) -> float:
    """mm from the top of a line to its base line."""
    return max(0.75 * LEADING * size * POINT, row.up + CLEAR / 2.0)


class Sheet(NamedTuple):
    """A page that is being filled; places in mm from its lower left corner."""

    figure: Any
    width: float
    height: float

    def row(self, row: Row, x: float, y: float) -> None:
        """A line of text from x on, on its base line y."""
        for away, each in row.atoms:
            face = FAMILY if each.math else family(each.text, each.heavy, each.slanted)
            self.figure.text(
                (x + away) / self.width,
                y / self.height,
                each.text,
                fontproperties=font(each.size, each.heavy, each.slanted, face),
                ha="left",
                va="baseline",
                parse_math=each.math,
                color="black",
            )

    def rule(self, x: tuple[float, float], y: float, thick: float) -> None:
        """A level line, so many mm thick."""
        from matplotlib.lines import Line2D

        ends = [each / self.width for each in x]
        at = y / self.height
        self.figure.add_artist(
            Line2D(ends, [at, at], color="black", linewidth=thick / POINT, solid_capstyle="butt", gid="rule")
        )


def sheet(width: float, tall: float) -> Sheet:
    """An empty white page of that size (mm)."""
    ready()
    from matplotlib.figure import Figure

    made: Figure = Figure(figsize=(width / INCH, tall / INCH), facecolor="white")
    return Sheet(made, width, tall)
