"""Phrases set as lines of a printed page: words and formulas measured, wrapped, and put on a sheet in millimetres."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.analysis.rich_text import MeasuredValue, PaperScale, Phrase, format_measured, plain_text
from planar.drawing.labels.fonts import BOOK_FAMILY, printable_text
from planar.drawing.labels.mathtext import formula
from planar.drawing.labels.text_line import text_line
from planar.drawing.paper.pens import MM_PER_POINT, require_matplotlib

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEADING = 1.32
"""From one line to the next, in sizes of the font, where nothing in them is higher."""
WORD_SPACE = 0.25
"""Between words, in sizes of the font: that of the book face."""
MERGE_TOLERANCE = 0.1
"""mm by which each of several words may be moved when they are drawn as one text."""
LINE_CLEARANCE = 1.5
"""mm between lines with tall formulas."""
MM_PER_INCH = 25.4
MAX_WORD_LENGTH = 90
"""Characters of a word that are shown."""
POWER_PATTERN = re.compile(r"(−?[0-9.]+)·10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+)(.*)", re.DOTALL)
_SUPERSCRIPT_DIGITS = str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")


class Atom(NamedTuple):
    """A text that is drawn at once: its size in points, on paper (mm) its width and how far up and down it goes."""

    text: str
    math: bool
    size: float
    heavy: bool
    slanted: bool
    width: float
    ascent: float
    descent: float


Word = tuple[Atom, ...]
"""Atoms between which no line is broken."""


class TypesetLine(NamedTuple):
    """A line of text: atoms with where each begins (mm), and its extent up and down from the base line."""

    atoms: tuple[tuple[float, Atom], ...]
    width: float
    ascent: float
    descent: float


class TextStyle(NamedTuple):
    """How a phrase is set."""

    size: float = 10.5
    heavy: bool = False
    slanted: bool = False


BODY_STYLE = TextStyle()


@lru_cache(maxsize=8192)
def make_atom(text: str, math: bool, style: TextStyle) -> Atom:
    """A text with its extent on paper. Raises ValueError where a formula is faulty."""
    line, by = text_line(text, math, style.slanted, style.heavy, BOOK_FAMILY), MM_PER_POINT * style.size
    return Atom(
        text, math, style.size, style.heavy, style.slanted, by * line.width, by * line.ascent, by * line.descent
    )


def split_words(
    phrase: Phrase, style: TextStyle = BODY_STYLE, paper: Mapping[str, PaperScale] | None = None
) -> list[Word]:
    """A phrase as words: formulas where its pieces are such, else plain text, which is never read as a formula."""
    found: list[list[Atom]] = [[]]
    for piece in phrase:
        told = formula(piece) if not isinstance(piece, str) else None
        if told is not None:
            try:
                found[-1].append(make_atom(f"${told if told.isascii() else printable_text(told)}$", True, style))
                continue
            except ValueError:
                pass
        text = format_measured(piece, paper) if isinstance(piece, MeasuredValue) else plain_text((piece,), paper)
        power = POWER_PATTERN.fullmatch(text)
        if power is not None:
            found[-1].append(
                make_atom(
                    rf"${power[1].replace('−', '-')}\cdot 10^{{{power[2].translate(_SUPERSCRIPT_DIGITS)}}}$",
                    True,
                    style,
                )
            )
            text = power[3]
        for index, part in enumerate(re.split(r"\s+", text)):
            if index:
                found.append([])
            if part:
                found[-1].append(make_atom(_shorten_word(part, style), False, style))
    return [tuple(word) for word in found if word]


def _shorten_word(text: str, style: TextStyle) -> str:
    """A word that the fonts can show, with the middle of a very long one left out."""
    if len(text) > MAX_WORD_LENGTH:
        text = f"{text[: MAX_WORD_LENGTH * 2 // 3]}…{text[-MAX_WORD_LENGTH // 3 :]}"
    return printable_text(text, style.slanted, style.heavy) or "?"


def typeset_lines(
    phrase: Phrase, width: float, style: TextStyle = BODY_STYLE, paper: Mapping[str, PaperScale] | None = None
) -> list[TypesetLine]:
    """A phrase as lines of at most so many mm; a word that is wider by itself is broken anywhere."""
    rows: list[TypesetLine] = []
    line: list[Atom | None] = []  # None: a space
    reach = 0.0
    space = WORD_SPACE * style.size * MM_PER_POINT
    for word in split_words(phrase, style, paper):
        across = sum(each.width for each in word)
        if line and reach + space + across > width:
            rows.append(_typeset_line(line, space))
            line, reach = [], 0.0
        if line:
            line.append(None)
            reach += space
        for part in word if reach + across <= width else _break_word(word, width):
            if line and line[-1] is not None and reach + part.width > width:
                rows.append(_typeset_line(line, space))
                line, reach = [], 0.0
            line.append(part)
            reach += part.width
    return [*rows, _typeset_line(line, space)] if line else rows


def _break_word(word: Word, width: float) -> Iterable[Atom]:
    """The atoms of a word, plain ones that are too wide in pieces."""
    for each in word:
        text = each.text
        style = TextStyle(each.size, each.heavy, each.slanted)
        if each.math or each.width <= width:
            yield each
            continue
        while text:
            count = len(text)
            while count > 1 and make_atom(text[:count], False, style).width > width:
                count = max(1, min(count - 1, int(count * width / make_atom(text[:count], False, style).width)))
            yield make_atom(text[:count], False, style)
            text = text[count:]


def _typeset_line(line: Sequence[Atom | None], space: float) -> TypesetLine:
    atoms, x = [], 0.0
    for each in line:
        if each is None:
            x += space
            continue
        atoms.append((x, each))
        x += each.width
    return TypesetLine(
        tuple(atoms),
        x,
        max((each.ascent for _, each in atoms), default=0.0),
        max((each.descent for _, each in atoms), default=0.0),
    )


def _merge_words(atoms: Sequence[tuple[float, Atom]]) -> Iterator[tuple[float, Atom]]:
    """The same with neighbouring words as one text: to draw each by itself takes long."""
    for math, group in groupby(atoms, lambda each: each[1].math):
        several = list(group)
        if math:
            yield from several
            continue
        start, first = several[0]
        text, end = "", start
        for away, each in several:
            text += f" {each.text}" if away > end + MERGE_TOLERANCE else each.text
            end = away + each.width
        whole = make_atom(text, False, TextStyle(first.size, first.heavy, first.slanted))
        if abs(start + whole.width - end) <= MERGE_TOLERANCE * len(several):
            yield start, whole
        else:
            yield from several


def line_height(row: TypesetLine, size: float) -> float:
    """mm that a line takes: at least the leading of its font."""
    leading = LEADING * size * MM_PER_POINT
    return max(leading, row.ascent + row.descent + LINE_CLEARANCE, row.ascent + LINE_CLEARANCE + 0.28 * leading)


def baseline_offset(row: TypesetLine, size: float) -> float:
    """mm from the top of a line to its base line."""
    return max(0.75 * LEADING * size * MM_PER_POINT, row.ascent + LINE_CLEARANCE / 2.0)


class TypesetPage(NamedTuple):
    """A page that is being filled; places in mm from its lower left corner."""

    figure: Any
    width: float
    height: float

    def draw_line(self, row: TypesetLine, x: float, y: float) -> None:
        """A line of text from x on, on its base line y."""
        from planar.drawing.labels.matplotlib_text import draw_text

        for away, each in _merge_words(row.atoms):
            at = (x + away) / self.width, y / self.height
            draw_text(
                self.figure,
                each.text,
                at,
                each.size,
                math=each.math,
                slanted=each.slanted,
                heavy=each.heavy,
                family=BOOK_FAMILY,
            )

    def draw_rule(self, x: tuple[float, float], y: float, thickness: float) -> None:
        """A level line, so many mm thick."""
        from matplotlib.lines import Line2D

        ends = [each / self.width for each in x]
        at = y / self.height
        self.figure.add_artist(
            Line2D(ends, [at, at], color="black", linewidth=thickness / MM_PER_POINT, solid_capstyle="butt", gid="rule")
        )


def blank_page(width: float, height: float) -> TypesetPage:
    """An empty white page of that size (mm)."""
    require_matplotlib()
    from matplotlib.figure import Figure

    made: Figure = Figure(figsize=(width / MM_PER_INCH, height / MM_PER_INCH), facecolor="white")
    return TypesetPage(made, width, height)
