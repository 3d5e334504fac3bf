"""Phrases set as lines of a printed page: words and formulas measured, wrapped, and put on a sheet in millimetres."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import lru_cache
from itertools import groupby
from typing import TYPE_CHECKING, Any, NamedTuple

from planar.analysis.rich_text import Paper, Phrase, Quantity, measured, plain
from planar.drawing.labels.fonts import BOOK, shown
from planar.drawing.labels.mathtext import formula
from planar.drawing.labels.text_line import text_line
from planar.drawing.paper.pens import POINT, ready

if TYPE_CHECKING:
    from matplotlib.figure import Figure

LEADING = 1.32
"""From one line to the next, in sizes of the font, where nothing in them is higher."""
SPACE = 0.25
"""Between words, in sizes of the font: that of the book face."""
ALIKE = 0.1
"""mm by which each of several words may be moved when they are drawn as one text."""
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


@lru_cache(maxsize=8192)
def atom(text: str, math: bool, style: Style) -> Atom:
    """A text with its extent on paper. Raises ValueError where a formula is faulty."""
    line, by = text_line(text, math, style.slanted, style.heavy, BOOK), POINT * style.size
    return Atom(text, math, style.size, style.heavy, style.slanted, by * line.width, by * line.up, by * line.down)


def words(phrase: Phrase, style: Style = TEXT, paper: Mapping[str, Paper] | None = None) -> list[Word]:
    """A phrase as words: formulas where its pieces are such, else plain text, which is never read as a formula."""
    found: list[list[Atom]] = [[]]
    for piece in phrase:
        told = formula(piece) if not isinstance(piece, str) else None
        if told is not None:
            try:
                found[-1].append(atom(f"${told if told.isascii() else shown(told)}$", True, style))
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
                found[-1].append(atom(_short(part, style), False, style))
    return [tuple(word) for word in found if word]


def _short(text: str, style: Style) -> str:
    """A word that the fonts can show, with the middle of a very long one left out."""
    if len(text) > LONGEST:
        text = f"{text[: LONGEST * 2 // 3]}…{text[-LONGEST // 3 :]}"
    return shown(text, style.slanted, style.heavy) or "?"


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


def _runs(atoms: Sequence[tuple[float, Atom]]) -> Iterator[tuple[float, Atom]]:
    """The same with neighbouring words as one text: to draw each by itself takes long."""
    for math, group in groupby(atoms, lambda each: each[1].math):
        several = list(group)
        if math:
            yield from several
            continue
        start, first = several[0]
        text, end = "", start
        for away, each in several:
            text += f" {each.text}" if away > end + ALIKE else each.text
            end = away + each.width
        whole = atom(text, False, Style(first.size, first.heavy, first.slanted))
        if abs(start + whole.width - end) <= ALIKE * len(several):
            yield start, whole
        else:
            yield from several


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
        from planar.drawing.labels.matplotlib_text import write

        for away, each in _runs(row.atoms):
            at = (x + away) / self.width, y / self.height
            write(
                self.figure,
                each.text,
                at,
                each.size,
                math=each.math,
                slanted=each.slanted,
                heavy=each.heavy,
                family=BOOK,
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
