"""Strips of a page: lines, tables and pictures one below the other, broken over as many pages as they take."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import TYPE_CHECKING, NamedTuple

from planar.analysis.rich_text import Paper, Phrase
from planar.drawing.labels.typesetting import TEXT, Row, Sheet, Style, base, height, set_lines, sheet

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 210.0, 297.0
"""mm: A4, upright."""
MARGIN = 18.0
"""mm on every side."""
FOOT = 8.0
"""mm above the lower margin, kept for the number of the page."""
ROOM = WIDTH - 2.0 * MARGIN
"""mm that a line may be wide."""
PAGE = HEIGHT - 2.0 * MARGIN - FOOT
"""mm of a page that strips may take."""
GAP = 4.0
"""mm between the columns of a table."""
AFTER = 5.0
"""mm below a drawing on top of a page."""
WHOLE = 70.0
"""mm: rows of a table that take no more stay on one page."""
THICK, THIN = 0.35, 0.18
"""mm: the rules above and below a table, and those inside it."""


class Strip(NamedTuple):
    """What takes the width of the page and is not broken: drawn from its upper left corner (mm on the sheet)."""

    height: float
    draw: Callable[[Sheet, float, float], None]
    keep: bool = False
    "stays on one page with the next"
    before: float = 0.0
    "mm above it, unless it begins a page"
    again: Strip | None = None
    "stands above it once more where it begins a page: the head of a table"
    floats: bool = False
    "waits for the next page where it does not fit, and lets what follows go first: a drawing"


def paged(strips: Iterable[Strip]) -> list[Figure]:
    """Strips on pages with numbers. A strip higher than a page is the caller's fault."""
    book = _Book()
    for group in _groups(strips):
        book.add(group)
    while book.waiting:
        book.turn()
    for number, page in enumerate(book.pages, 1):
        (row,) = set_lines((f"{number} / {len(book.pages)}",), ROOM, Style(9.0))
        page.row(row, (WIDTH - row.width) / 2.0, MARGIN + row.down)
    return [page.figure for page in book.pages]


class _Book:
    """Pages while they are filled: `y` is how far down the last one is full (mm from below)."""

    def __init__(self) -> None:
        self.pages: list[Sheet] = []
        self.waiting: list[Strip] = []
        self.y = self.begun = 0.0

    def add(self, group: Sequence[Strip]) -> None:
        """Strips that stay together."""
        if not self.pages:
            self.turn()
        if group[0].floats and (self.waiting or not self._fits(group)):
            self.waiting.append(group[0])
            return
        while not self._fits(group):
            self.turn()
            if group[0].again is not None:
                self._put(group[0].again)
                self.begun = self.y
        for strip in group:
            self._put(strip)

    def turn(self) -> None:
        """A new page, with as many waiting drawings on top as it holds."""
        self.pages.append(sheet(WIDTH, HEIGHT))
        self.y = self.begun = HEIGHT - MARGIN
        while self.waiting and self._fits(self.waiting[:1]):
            self._put(self.waiting.pop(0))
            self.y -= AFTER

    def _fits(self, group: Sequence[Strip]) -> bool:
        tall = sum(strip.height + strip.before for strip in group)
        if self.y == self.begun:
            tall -= group[0].before
        # what is higher than an empty page has to go somewhere
        return self.y - tall >= MARGIN + FOOT - 1e-6 or (self.y == self.begun and tall > self.begun - MARGIN - FOOT)

    def _put(self, strip: Strip) -> None:
        self.y -= 0.0 if self.y == self.begun else strip.before
        strip.draw(self.pages[-1], MARGIN, self.y)
        self.y -= strip.height


def _groups(strips: Iterable[Strip]) -> Iterator[tuple[Strip, ...]]:
    """Strips that stay together; a group that no page could hold is let go."""
    group: list[Strip] = []
    for strip in strips:
        group.append(strip)
        if not strip.keep:
            yield from _held(group)
            group = []
    yield from _held(group)


def _held(group: Sequence[Strip]) -> Iterator[tuple[Strip, ...]]:
    if group and sum(strip.height + strip.before for strip in group) <= PAGE:
        yield tuple(group)
    else:
        yield from ((strip,) for strip in group)


def lines(
    phrase: Phrase,
    style: Style = TEXT,
    paper: Mapping[str, Paper] | None = None,
    label: str = "",
    indent: float = 0.0,
    before: float = 0.0,
    keep: bool = False,
    centred: bool = False,
) -> Iterator[Strip]:
    """A paragraph, a strip a line; `label` hangs in the indent (mm); `keep` holds it on a page with what follows."""
    rows = set_lines(phrase, ROOM - indent, style, paper)
    marks = set_lines((label,), ROOM, style) if label else []
    for index, row in enumerate(rows):
        mark = marks[0] if marks and not index else None
        start = (ROOM - row.width) / 2.0 if centred else indent
        # neither the first nor the last line of a paragraph stands alone
        together = keep or index == 0 < len(rows) - 1 or index == len(rows) - 2
        yield Strip(height(row, style.size), _writer(row, mark, start, style), together, 0.0 if index else before)


def _writer(row: Row, mark: Row | None, start: float, style: Style) -> Callable[[Sheet, float, float], None]:
    def draw(page: Sheet, x: float, y: float) -> None:
        page.row(row, x + start, y - base(row, style.size))
        if mark is not None:
            page.row(mark, x + start - mark.width - 1.5, y - base(row, style.size))

    return draw


class Column(NamedTuple):
    """A column of a table: its heading, and whether its cells stand to the right, as numbers do."""

    heading: str
    right: bool = False


def table(
    columns: Sequence[Column],
    cells: Sequence[Sequence[Phrase]],
    size: float = 9.5,
    before: float = 2.0,
    title: str = "",
) -> Iterator[Strip]:
    """A table with rules, its head repeated where it goes on to another page."""
    style, heavy = Style(size), Style(size, heavy=True)
    heads: list[Phrase] = [(column.heading,) for column in columns]
    natural = [
        max(_natural(heads[k], heavy), *(_natural(row[k], style) for row in cells), 5.0) for k in range(len(columns))
    ]
    widths = _shared(natural, ROOM - GAP * (len(columns) - 1))
    if title:
        yield from lines((title,), Style(10.0, heavy=True), before=before, keep=True)
        before = 0.8
    head = _cells(heads, widths, columns, heavy, (THICK, THIN))
    yield head._replace(before=before, keep=True)
    rows = [
        _cells(row, widths, columns, style, (0.0, THICK if index == len(cells) - 1 else 0.0))
        for index, row in enumerate(cells)
    ]
    short = sum(row.height for row in rows) <= WHOLE
    for index, row in enumerate(rows):
        # no row stands alone at the foot of a page, nor on top of one
        yield row._replace(again=head, keep=index < len(rows) - 1 and (short or index in (0, len(rows) - 2)))


def _natural(phrase: Phrase, style: Style) -> float:
    return max((row.width for row in set_lines(phrase, 1e6, style)), default=0.0)


def _shared(natural: Sequence[float], room: float) -> list[float]:
    """Widths of columns: as wide as they would be, the widest cut to one width until all fit."""
    low, high = 0.0, max(natural, default=0.0)
    if sum(natural) <= room:
        return list(natural)
    for _ in range(60):
        cut = (low + high) / 2.0
        low, high = (cut, high) if sum(min(each, cut) for each in natural) <= room else (low, cut)
    return [min(each, low) for each in natural]


def _cells(
    cells: Sequence[Phrase],
    widths: Sequence[float],
    columns: Sequence[Column],
    style: Style,
    rules: tuple[float, float],
) -> Strip:
    """A row of cells, with a rule above and below it where its thickness is not zero."""
    # a hair more, so that a cell as wide as its column is one line
    rows = [set_lines(cell, width + 1e-6, style) for cell, width in zip(cells, widths, strict=True)]
    pad = 0.6
    tall = max((sum(height(row, style.size) for row in each) for each in rows), default=0.0) + 2.0 * pad
    whole = sum(widths) + GAP * (len(widths) - 1)

    def draw(page: Sheet, x: float, y: float) -> None:
        for at, thick in ((y, rules[0]), (y - tall, rules[1])):
            if thick:
                page.rule((x, x + whole), at, thick)
        left = x
        for each, width, column in zip(rows, widths, columns, strict=True):
            down = y - pad - (tall - 2.0 * pad - sum(height(row, style.size) for row in each)) / 2.0
            for row in each:
                page.row(row, left + (width - row.width if column.right else 0.0), down - base(row, style.size))
                down -= height(row, style.size)
            left += width + GAP

    return Strip(tall, draw)
